"""`Outcome`: all results of a run of `optimize`; the report and the JSON answer are views of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Generic, Literal, TypeVar

from leafcut.model.issue import Issue, missing_work
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.part import Part
from leafcut.model.solution import Solution, gap
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath

#: Selects one of the two paths of an outcome.
Which = Literal["before", "after"]


@dataclass(frozen=True)
class OperationOutcome:
    """Work of a tool: holes or slots, cycle, and the solution of its order.

    `hole_order` are indices into `Part.holes` (or `Part.slots` if `slots`), in machining order. The others apply to a
    program of another CAM: `cuts` is the number of cuts ordered with the holes, `lines` the first and the last line of
    their section, and `staying` the holes that the tool drills in their original positions.
    """

    tool: Tool
    cycle: str
    hole_order: tuple[int, ...]
    slots: bool
    solution: Solution
    cuts: int = 0
    lines: tuple[int, int] | None = None
    staying: tuple[int, ...] = ()

    @property
    def holes(self) -> tuple[int, ...]:
        """All holes that the tool drills here (or slots), those with fixed positions last."""
        return self.hole_order + self.staying


#: Results specific to a process.
D = TypeVar("D")


@dataclass(frozen=True)
class Outcome(Generic[D]):
    """Results of a run: those common to all processes, and the process's own `detail`.

    Attributes
    ----------
    process
        ``drill``; ``cut`` for a sheet; ``pocket``; of a program ``drill``, ``mill``, ``laser`` or ``plasma``.
    before, nearest, after
        Measures of the input order, of nearest neighbour (None for programs), and of the written program.
    written
        The text read back for the proof, with the line of every row. None if `path_after` was read from it.
    encoding, extension
        Encoding of the program file, and its extension including the dot.
    options
        Every option that differs from its default: flag → value as typed.
    defaults
        Used options that were set by the user's own defaults, as typed.
    """

    part: Part
    machine: Machine
    process: str
    operations: tuple[OperationOutcome, ...]
    before: Measure
    nearest: Measure | None
    after: Measure
    path_before: Toolpath
    path_after: Toolpath
    text: str
    dialect: str
    seed: int
    verified: bool
    detail: D
    issues: tuple[Issue, ...] = ()
    written: Toolpath | None = None
    encoding: str = "utf-8"
    extension: str = ".nc"
    output: str = ""
    report: str = ""
    options: dict[str, str] = field(default_factory=dict)
    defaults: tuple[str, ...] = ()
    version: str = ""
    made_by: str = ""
    seconds: float = 0.0
    compile_seconds: float = 0.0

    @property
    def missing(self) -> tuple[Issue, ...]:
        """Issues about requested work that the program does not do, with position and reason."""
        return missing_work(self.issues)

    @property
    def program_sha256(self) -> str:
        """SHA-256 of the bytes of the program file, in hexadecimal digits."""
        return hashlib.sha256(self.text.encode(self.encoding, "replace")).hexdigest()

    @property
    def saved_percent(self) -> float:
        """Machine time saved relative to the drawing's order, percent."""
        return 100.0 * (1.0 - self.after.time_s / self.before.time_s) if self.before.time_s > 0 else 0.0

    @property
    def lower_bound(self) -> float | None:
        """Sum of the operations' lower bounds in the unit of their costs, or None if one is missing.

        Each bounds the travel of a tool from the end of the previous tool's path. For several tools, the sum bounds
        their paths one by one, not every distribution of the work.
        """
        bounds = [o.solution.lower_bound for o in self.operations]
        return None if not bounds or any(b is None for b in bounds) else sum(b for b in bounds if b is not None)

    @property
    def gap(self) -> float | None:
        """Upper bound of the relative excess over the optimal cost; None without a lower bound."""
        return gap(sum(o.solution.cost for o in self.operations), self.lower_bound)
