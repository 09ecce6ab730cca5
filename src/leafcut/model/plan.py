"""`Stage`, `Order` and `Candidate`: tasks to order, a sequence of them, and the motion for the sequence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from leafcut.geometry.arrays import Ints
from leafcut.message import Message
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
        Tasks as clusters and their choices as nodes, with precedence and travel cost. The problem has no start if the
        stage `follows` another stage.
    follows
        Whether the stage starts where the previous stage ends.
    given
        The choices in the order of the input, int32[tasks]. Empty if that order cannot be used.
    first
        The choices that the user wants to come first, int32[k], in this order.
    parts
        Number of parts that the tasks belong to, for one ant per part; 0 for one ant per choice.
    """

    problem: RoutingProblem
    follows: bool
    given: Ints
    name: Message = Message("ordering")
    first: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    parts: int = 0


@dataclass(frozen=True, eq=False)
class Order:
    """The choices of every stage, in sequence.

    Attributes
    ----------
    choices
        The choices of each stage, int32[tasks]. A process that refines an order may store the choices in another form.
    solutions
        Cost, bound and history of each stage. Empty for an order that does not come from a search.
    kept
        Tasks that keep their position in the input. Maps (stage, task) to the reason.
    unchanged
        Whether the program is the same as the input.
    """

    choices: tuple[Any, ...]
    solutions: tuple[Solution, ...] = ()
    kept: Mapping[tuple[int, int], str] = field(default_factory=dict)
    unchanged: bool = False


@dataclass(frozen=True, eq=False)
class Candidate:
    """An order, and the motion that was generated from it.

    `text` is the program, and `written` is the toolpath read back from the program. Both stay empty until the program
    has been written and verified.
    """

    order: Order
    path: Toolpath
    measure: Measure
    detail: Any = None
    text: str = ""
    written: Toolpath | None = None

    def cost(self, objective: str) -> float:
        """Return the machine time, s, or for the objective ``distance``, the travel, mm."""
        return self.measure.time_s if objective == "time" else self.measure.travel_mm
