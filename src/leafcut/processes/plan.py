"""The work of a job after planning. The next step is the search for an order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from leafcut.errors import VerifyError
from leafcut.model.plan import Order, Stage

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.geometry.arrays import Point
    from leafcut.model.issue import Issue
    from leafcut.model.machine import Machine
    from leafcut.model.part import Part
    from leafcut.model.tool import Tool
    from leafcut.processes.job import Job


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """The work of a job, ready for the search for an order.

    Attributes
    ----------
    job, part, dialect
        The job with its final machine, the placed part, and the dialect of the program.
    work
        The tasks, in a form that only the process understands.
    spec
        The request with which verification compares the program. It does not depend on the plan.
    kind
        Kind of a program from another CAM system: ``drill``, ``mill``, ``laser`` or ``plasma``. For all other programs,
        the kind of the outcome is the name of the process.
    box
        Smallest x and y and largest x and y of the work, mm; None if they are not checked.
    made_for
        Solid or surface for which the program is written, and where it is placed; "" for none.
    compared_with
        Name of the order with which the header compares the time.
    start
        First position of the tool, mm, if the user gave it.
    keeps_given
        Whether the order of the input must not change. Then there is no search.
    search_share
        Share of the remaining time for the search. The passes get the rest.
    may_fall_back
        Whether `Process.fastest` may use the order of the input or the nearest-neighbour order instead of the search
        result, if that order is faster. The passes of a process may do this in any case.
    encoding
        Encoding of the program file.
    limits
        The machine whose limits are checked, if the machine of the job is only used to compute times.
    """

    job: Job
    part: Part
    dialect: Dialect
    work: Any
    spec: Any = None
    stages: tuple[Stage, ...] = ()
    kind: str = ""
    tools: Sequence[Tool] = ()
    box: tuple[float, float, float, float] | None = None
    made_for: str = ""
    compared_with: str = "in the drawing's order"
    start: Point | None = None
    issues: Sequence[Issue] = ()
    keeps_given: bool = False
    search_share: float = 1.0
    may_fall_back: bool = True
    encoding: str = "utf-8"
    limits: Machine | None = None

    @property
    def input_order(self) -> Order:
        """The tasks in the order of the input."""
        return Order(tuple(stage.given for stage in self.stages))


class OrderRefused(VerifyError):
    """Raised if the program of an order cannot be written or verified.

    If the tasks at fault are known, `faulty` contains them as pairs (stage, task), and `stages` contains whole stages
    at fault.
    """

    def __init__(self, reason: str, faulty: Iterable[tuple[int, int]] = (), stages: Iterable[int] = ()) -> None:
        super().__init__(reason)
        self.faulty, self.stages = set(faulty), set(stages)


#: A function that improves an order. It considers effects between neighbouring tasks, such as heat.
Pass = Callable[[Plan, Order], Order]
