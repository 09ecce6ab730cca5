"""The nouns: frozen data that knows no other stage, saved as JSON and loaded again (`saving`)."""

from __future__ import annotations

from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Hole, Part, Slot
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.model.solution import Solution, WorkerFigures
from leafcut.model.tool import Recipe, Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Motion, Toolpath, ToolpathBuilder

__all__ = [
    "Arc",
    "Contour",
    "DrillCycle",
    "Hole",
    "Issue",
    "Kind",
    "Machine",
    "Measure",
    "Metric",
    "Motion",
    "OperationOutcome",
    "Outcome",
    "Part",
    "Recipe",
    "RoutingProblem",
    "Severity",
    "Sheet",
    "SheetContour",
    "Slot",
    "Solution",
    "Tool",
    "ToolKind",
    "ToolLibrary",
    "Toolpath",
    "ToolpathBuilder",
    "WorkerFigures",
]
