"""`Stage`, `Order` and `Candidate`: tasks to be ordered, a sequence for them, and its motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from leafcut.geometry.arrays import Ints
from leafcut.model.measure import Measure
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.model.toolpath import Toolpath


@dataclass(frozen=True, eq=False)
class Stage:
    """Tasks that are ordered together, such as the holes of a tool.

    Attributes
    ----------
    problem
        Tasks as clusters, their choices as nodes, with precedence and travel cost. Its start is that of the tool, or
        None if the stage `follows` another stage.
    given
        int32[tasks]: the choices in the order of the input; empty if that order cannot be used.
    first
        int32[k]: choices that the user wants first, in this order.
    parts
        Number of parts that the tasks belong to, for one ant per part; 0 for one ant per choice.
    """

    problem: RoutingProblem
    follows: bool
    given: Ints
    name: str = "ordering"
    first: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    parts: int = 0


@dataclass(frozen=True, eq=False)
class Order:
    """The chosen choices of every stage, in sequence.

    Attributes
    ----------
    choices
        int32[tasks] for each stage; after a pass of the process, its own recipes.
    solutions
        Cost, bound and history of each stage; empty if no search found the order.
    kept
        Tasks that keep their position in the input, as (stage, task), with the reason.
    """

    choices: tuple[Any, ...]
    solutions: tuple[Solution, ...] = ()
    kept: Mapping[tuple[int, int], str] = field(default_factory=dict)
    unchanged: bool = False


@dataclass(frozen=True, eq=False)
class Candidate:
    """An order as motion.

    `text` and `written`, the toolpath read back from it, are "" and None before the program is written and proved.
    """

    order: Order
    path: Toolpath
    measure: Measure
    detail: Any = None
    text: str = ""
    written: Toolpath | None = None

    def cost(self, objective: str) -> float:
        """Return the time, s, or for the objective ``distance`` the travel, mm."""
        return self.measure.time_s if objective == "time" else self.measure.travel_mm
