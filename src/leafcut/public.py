"""Every public name of leafcut, with its home: functions, what they take and return, and errors."""

from __future__ import annotations

from leafcut.api import cut_stock, cutting_data, nest, optimize, simulate, solve_file, solve_part, verify_programs
from leafcut.errors import (
    DataError,
    LeafcutError,
    OptionError,
    PlanError,
    PostError,
    ReadError,
    SendError,
    SolveError,
    VerifyError,
)
from leafcut.files.whole_files import OutputError, StandardInput
from leafcut.geometry.polyline import Polyline
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.same_stock import StockDifference
from leafcut.material.stock_cut import BodyCut, RapidCut, StockCut, ToolCut
from leafcut.model.certificate import Certificate, Counts
from leafcut.model.contour import Contour
from leafcut.model.cutter import Body
from leafcut.model.cutting import (
    Consumption,
    ConsumptionRates,
    Cut,
    CutChoice,
    CutData,
    CutMeasures,
    CutPlan,
    CutTimes,
    Lead,
    PartTimes,
)
from leafcut.model.cutting_front import CuttingData, CuttingPoint, ToolFront
from leafcut.model.difference import Difference
from leafcut.model.heartbeat import Heartbeat, Progress
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.kinds import CuttingWork, Head, ToolMaterial
from leafcut.model.machine import Machine, Probe
from leafcut.model.measure import Measure
from leafcut.model.mesh import Mesh
from leafcut.model.motion import Arc, DrillCycle, Kind
from leafcut.model.nest import Layout, Nest, NestOutcome, NestPart, Placement, Remnant, Stock
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.pace_change import FeedLimit, PaceChange, ToolPace
from leafcut.model.part import Grouping, Hole, HoleStep, Opening, Part, ProgramZero, Slot
from leafcut.model.pocket import (
    Pocket,
    PocketMeasures,
    PocketPath,
    PocketPiece,
    PocketPlan,
    PocketProgram,
    PocketResult,
    PocketRules,
)
from leafcut.model.sequence import Staying
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.model.shown_stock import ShownStock
from leafcut.model.simulation import Simulation
from leafcut.model.snapshot import NextPlace, Observer, Pheromone, SearchStep, Snapshot
from leafcut.model.solution import Solution, Solved, WorkerFigures
from leafcut.model.tool import BodySegment, Tool, ToolKind
from leafcut.model.toolpath import Toolpath
from leafcut.model.work_material import ToolLife, WorkMaterial
from leafcut.options import ReadOptions
from leafcut.options.keywords import (
    CuttingDataKeywords,
    NestKeywords,
    OptimizeKeywords,
    SimulateKeywords,
    SolveKeywords,
    StockKeywords,
    VerifyKeywords,
)
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.processes.pocket.model import PocketDetail
from leafcut.processes.program.model import AvoidedAreas, ProgramDetail, StockProof
from leafcut.processes.sheet.model import SheetDetail
from leafcut.read import Input, Source
from leafcut.read import read as read_part
from leafcut.read.nest_list import WantedDrawing

__all__ = [
    "Arc",
    "AvoidedAreas",
    "Body",
    "BodyCut",
    "BodySegment",
    "Certificate",
    "Consumption",
    "ConsumptionRates",
    "Contour",
    "Counts",
    "Cut",
    "CutChoice",
    "CutData",
    "CutMeasures",
    "CutPlan",
    "CutTimes",
    "CuttingData",
    "CuttingDataKeywords",
    "CuttingPoint",
    "CuttingWork",
    "DataError",
    "Difference",
    "DrillCycle",
    "DrillingDetail",
    "FeedLimit",
    "Grouping",
    "Head",
    "Heartbeat",
    "HeightField",
    "Hole",
    "HoleStep",
    "Input",
    "Issue",
    "Kind",
    "Layout",
    "Lead",
    "LeafcutError",
    "Machine",
    "Measure",
    "Mesh",
    "MissingWork",
    "Nest",
    "NestKeywords",
    "NestOutcome",
    "NestPart",
    "NextPlace",
    "Observer",
    "Opening",
    "OperationOutcome",
    "OptimizeKeywords",
    "OptionError",
    "Outcome",
    "OutputError",
    "PaceChange",
    "Part",
    "PartTimes",
    "Pheromone",
    "Placement",
    "PlanError",
    "Pocket",
    "PocketDetail",
    "PocketMeasures",
    "PocketPath",
    "PocketPiece",
    "PocketPlan",
    "PocketProgram",
    "PocketResult",
    "PocketRules",
    "Polyline",
    "PostError",
    "Probe",
    "ProgramDetail",
    "ProgramZero",
    "Progress",
    "RapidCut",
    "ReadError",
    "ReadOptions",
    "Remnant",
    "SearchStep",
    "SendError",
    "Severity",
    "Sheet",
    "SheetContour",
    "SheetDetail",
    "ShownStock",
    "SimulateKeywords",
    "Simulation",
    "Slot",
    "Snapshot",
    "Solution",
    "SolveError",
    "SolveKeywords",
    "Solved",
    "Source",
    "StandardInput",
    "Staying",
    "Stock",
    "StockBlock",
    "StockCut",
    "StockDifference",
    "StockKeywords",
    "StockProof",
    "Tool",
    "ToolCut",
    "ToolFront",
    "ToolKind",
    "ToolLife",
    "ToolMaterial",
    "ToolPace",
    "Toolpath",
    "VerifyError",
    "VerifyKeywords",
    "WantedDrawing",
    "WorkMaterial",
    "WorkerFigures",
    "cut_stock",
    "cutting_data",
    "nest",
    "optimize",
    "read_part",
    "simulate",
    "solve_file",
    "solve_part",
    "verify_programs",
]
