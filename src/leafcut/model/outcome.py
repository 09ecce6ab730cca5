"""`Outcome`: all that one run of `optimize` found out; the report and the JSON answer are views of it."""

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

#: Which of the two paths of an outcome.
Which = Literal["before", "after"]


@dataclass(frozen=True)
class OperationOutcome:
    """One tool's work: how many holes or slots, by which cycle, and the solution of its order.

    `hole_order` are indices into `Part.holes` (or `Part.slots` when `slots`), in the order of machining. The rest is
    for a program of another CAM: `cuts` is how many cuts are ordered with the holes, `lines` the first and the last
    line of their section, and `staying` the holes that the tool drills in their old places.
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
        """All holes that the tool drills here (or slots), those that stay last."""
        return self.hole_order + self.staying


#: The results that one process alone has.
D = TypeVar("D")


@dataclass(frozen=True)
class Outcome(Generic[D]):
    """The whole run: what every process finds out, and the `detail` of one.

    Attributes
    ----------
    part
        What was read; of a program, its holes.
    process
        ``drill``; ``cut`` for a sheet; ``pocket``; of a program ``drill``, ``mill``, ``laser`` or ``plasma``.
    before, nearest, after
        The same work in the order it came in, by nearest neighbour (None for programs), and as written.
    path_before, path_after
        Toolpaths of the first and the last.
    text
        The program, whole.
    detail
        What belongs to the process alone: the plans of a sheet or of pockets, the proof of a program.
    written
        What the text does, read back for the proof, with the line of every row. None where `path_after` was read.
    encoding, extension
        Of the program's text in a file, and what the name of such a file ends in, with the dot.
    output, report
        Where program and report were written, or empty.
    seconds, compile_seconds
        Time of the run without compiling, and the time of compiling.
    made_by
        Name of the process that made it.
    options
        Every option that is not at its default, flag → value as a person would type it.
    defaults
        Which of the options that were used are of the person's own defaults, as one types them.
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
        """The issues of work that the input asks for and the program does not do: what, how many, where and why."""
        return missing_work(self.issues)

    @property
    def program_sha256(self) -> str:
        """SHA-256 of the program's bytes as they are in its file, in hexadecimal digits."""
        return hashlib.sha256(self.text.encode(self.encoding, "replace")).hexdigest()

    @property
    def saved_percent(self) -> float:
        """Machine time saved against the drawing's order, percent."""
        return 100.0 * (1.0 - self.after.time_s / self.before.time_s) if self.before.time_s > 0 else 0.0

    @property
    def lower_bound(self) -> float | None:
        """Sum of the operations' lower bounds in the unit of their costs, or None when one has none.

        Each is a bound of the travel of one tool from where the tool before it ended: of several tools, the sum is a
        bound of their paths one by one, not of all ways to share the work.
        """
        bounds = [o.solution.lower_bound for o in self.operations]
        return None if not bounds or any(b is None for b in bounds) else sum(b for b in bounds if b is not None)

    @property
    def gap(self) -> float | None:
        """How far at most the orders are above the least possible, as a fraction; None without a bound."""
        return gap(sum(o.solution.cost for o in self.operations), self.lower_bound)
