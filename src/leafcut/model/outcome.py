"""`Outcome`: all results of a job. The report and the JSON answer are derived from it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Generic, Literal, TypeVar

from leafcut.model.issue import Issue, missing_work
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.part import Part
from leafcut.model.quote import Quote
from leafcut.model.solution import Solution, gap
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath

#: Selects one of the two paths of an outcome.
Which = Literal["before", "after"]


@dataclass(frozen=True)
class OperationOutcome:
    """The work of a tool: its holes or slots, its cycle, and the solution of its order.

    Attributes
    ----------
    hole_order
        Indices into `Part.holes` (or `Part.slots` if `slots`), in machining order.
    cuts
        For a program from another CAM system, the number of cuts that are ordered together with the holes.
    lines
        For such a program, the first and last line of the section with these holes and cuts.
    staying
        For such a program, the holes that keep their original position in the order.
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
        """All holes or slots of the tool. The holes that keep their position in the order come last."""
        return self.hole_order + self.staying


#: Type of the results that are specific to a process.
D = TypeVar("D")


@dataclass(frozen=True)
class Outcome(Generic[D]):
    """Results of a job. The results in `detail` are specific to the process.

    Attributes
    ----------
    process
        ``drill``, ``cut`` or ``pocket``. For a program from another CAM system, ``drill``, ``mill``, ``laser`` or
        ``plasma``.
    before, nearest, after
        Measures of the input order, of the nearest-neighbour order (None for programs), and of the written program.
    written
        Toolpath that was read back from the text for the proof, with the line of every row. None if it equals
        `path_after`.
    encoding, extension
        Encoding of the program file, and its extension including the dot.
    options
        Maps a flag to its value as typed, for every option that differs from its default.
    defaults
        Options that came from the user's own defaults, as typed.
    made_by
        Name of the process that generated the program. The process may be a plug-in.
    work_offset
        Words of the work offsets that the program selects, such as ``G54``. Empty if the program selects none.
    quote
        Prices for the customer, if the user asked for a quote.
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
    work_offset: str = ""
    quote: Quote | None = None
    seconds: float = 0.0
    compile_seconds: float = 0.0

    @property
    def missing(self) -> tuple[Issue, ...]:
        """Issues about requested work that the program does not do, with the position and the reason."""
        return missing_work(self.issues)

    @property
    def program_sha256(self) -> str:
        """SHA-256 of the bytes of the program file, as hexadecimal digits."""
        return hashlib.sha256(self.text.encode(self.encoding, "replace")).hexdigest()

    @property
    def saved_percent(self) -> float:
        """Machine time that the new order saves compared with the order of the input, percent."""
        return 100.0 * (1.0 - self.after.time_s / self.before.time_s) if self.before.time_s > 0 else 0.0

    @property
    def lower_bound(self) -> float | None:
        """Sum of the lower bounds of all operations, in the unit of their costs.

        It is None if an operation has no bound.

        Each bound assumes that the tool starts at the end of the previous tool's path. With several tools, the sum is
        therefore not a true bound if these paths could end elsewhere.
        """
        bounds = [o.solution.lower_bound for o in self.operations]
        return None if not bounds or any(b is None for b in bounds) else sum(b for b in bounds if b is not None)

    @property
    def gap(self) -> float | None:
        """Upper limit for the excess of the cost over the optimum, as a fraction; None without a lower bound."""
        return gap(sum(o.solution.cost for o in self.operations), self.lower_bound)
