"""The settings, machine, deadline and progress of a job, and the checks that all processes share."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from leafcut.errors import OptionError, PlanError, VerifyError
from leafcut.gcode.dialects import Dialect
from leafcut.geometry.arrays import Point
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.heartbeat import Heartbeat, OnProgress, Progress, Trial, heartbeat_for_step
from leafcut.model.issue import Issue, Severity, missing_work
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.model.snapshot import Observer
from leafcut.model.tool import ToolLibrary
from leafcut.options import Settings, flag_name
from leafcut.order.stop import Deadline
from leafcut.processes.placing import negative_axes
from leafcut.units import LARGE_UNITS


@dataclass(frozen=True)
class Job:
    """The settings, machine and progress of a job.

    All searches of the job share the `deadline`. The lower bounds have their own deadline, `bounds`.
    """

    settings: Settings
    machine: Machine
    deadline: Deadline
    progress: OnProgress | None = None
    cancelled: threading.Event = field(default_factory=threading.Event)
    observe: Observer | None = None
    bounds: Deadline = field(default_factory=Deadline)

    def quiet(self) -> Job:
        """Return the same job without progress reports."""
        return replace(self, progress=None, observe=None)

    def for_dialect(self, dialect: Dialect) -> Job:
        """Adapt the job to a dialect.

        If the dialect has no moves in machine coordinates, the tool retracts to the clearance height.
        """
        if dialect.has_machine_moves or self.machine.safe_z is None:
            return self
        return replace(self, machine=replace(self.machine, safe_z=None))

    def report(self, step: Message, share: float = 0.0, trial: Trial | None = None) -> None:
        """Report the current step, the share of the work that is done, and the result of a trial."""
        if self.progress is not None:
            self.progress(Progress(step, share, trial=trial))

    def start_step(self, step: Message) -> Heartbeat:
        """Report the start of a step, and return a function that repeats this report.

        Whoever receives the report may raise an exception to cancel the job.
        """
        return heartbeat_for_step(self.progress, step)


def machine_of(settings: Settings) -> Machine:
    """Return the machine that the user chose in the settings."""
    from leafcut.read.machine import load_machine

    return load_machine(settings.machine.machine, settings.machine.work_offset)


def library_of(settings: Settings, machine: Machine) -> ToolLibrary | None:
    """Return the tool library in the settings, or None. Raises DataError if the file is not a tool library."""
    job = settings.job
    if job.tools is None:
        return None
    from leafcut.read.tools import load_tools

    return load_tools(job.tools, machine.units, job.material if "material" in settings.given else "")


def dialect_of(job: Job) -> Dialect:
    """Return the dialect that the user chose. If the user chose none, return the dialect of the machine."""
    from leafcut.gcode.dialects import load_dialect

    return load_dialect(job.settings.post.dialect or job.machine.controller)


def check_dialect_options(settings: Settings, dialect: Dialect) -> None:
    """Raise OptionError if the controller does not support an option."""
    torch = dialect.torch
    powered = torch is not None and bool(torch.power)
    no_power = Message("{} programs have no laser power", dialect.name)
    for name, supported, reason in (
        ("program_number", dialect.program_number, Message("{} programs have no number", dialect.name)),
        ("line_numbers", dialect.line_numbers, Message("{} does not support block numbers", dialect.name)),
        ("beam_power", powered, no_power),
        ("mark_power", powered, no_power),
        ("coolant", dialect.torch is None, Message("{} has no coolant", dialect.name)),
    ):
        if name in settings.asked and not supported:
            raise OptionError("{}: {}; leave it out", flag_name(name), reason)


def plane_point(point: tuple[float, ...] | None) -> Point | None:
    """Return a start or end point in the plane. Raises OptionError unless it has exactly two numbers."""
    if point is not None and len(point) != 2:
        raise OptionError("--start-point and --end-point need two numbers, x,y")
    return None if point is None else (point[0], point[1])


def check_tool_change_options(machine: Machine, dialect: Dialect) -> None:
    """Raise OptionError if the machine changes tools in a way that the controller does not support."""
    for supported, reason in (
        (machine.tool_changer, Message("the tools of this machine are changed by hand")),
        (dialect.tool_change == "M6", Message("{} has no M6", dialect.name)),
        (dialect.language != "klartext", Message("{} programs cannot preselect a tool", dialect.name)),
        (dialect.length_offset != "D", Message("a T word of {} also activates the tool length", dialect.name)),
    ):
        if machine.preselect_tool and not supported:
            raise OptionError(
                "--machine {}: {}; remove tool_change.preselect from the machine's profile", machine.name, reason
            )
    if machine.optional_stop and "M1" not in dialect.m_words.split():
        raise OptionError(
            "--machine {}: {} has no M1; remove tool_change.optional_stop from the machine's profile",
            machine.name,
            dialect.name,
        )


def refuse_differences(problems: Sequence[Difference]) -> None:
    """Raise VerifyError if a program has differences.

    The message names the first difference and states how many more there are.
    """
    if problems:
        more = Message(" (and {} more)", len(problems) - 1) if len(problems) > 1 else ""
        raise VerifyError("the program was not written: {}{}", problems[0], more)


def refuse_too_large(problems: Sequence[Difference], part: Part, settings: Settings) -> None:
    """Raise VerifyError if a part exceeds the travel of the machine.

    The message suggests checking the unit, because files written by ezdxf state metres by default.
    """
    try:
        refuse_differences(problems)
    except VerifyError as problem:
        # A drawing in millimetres that states such a unit by mistake becomes too large.
        stated = LARGE_UNITS.get(part.units)
        if stated and not settings.read.units:
            problem.add_note(
                Message(
                    "the drawing states that its unit is {}; if it is drawn in millimetres, give --units mm", stated
                )
            )
        raise


def refuse_missing_work(settings: Settings, source: object, issues: Iterable[Issue]) -> None:
    """Raise PlanError if some work is missing and ``--strict`` is set."""
    missing = missing_work(issues) if settings.read.strict else ()
    if missing:
        more = Message(" (and {} more)", len(missing) - 1) if len(missing) > 1 else ""
        raise PlanError("{}: {}{}; --strict refuses an incomplete program", source, missing[0], more)


def assumed_machine_note(settings: Settings, machine: Machine, issues: Iterable[Issue]) -> list[Issue]:
    """Return a note that the default machine is used.

    There is no note if the user or another note already names a machine.
    """
    if "machine" in settings.given or any(issue.code in ("L417", "L807") for issue in issues):
        return []
    return [
        Issue(
            "L417",
            Message("the machine is assumed to be {}; name yours with --machine", machine.name),
            severity=Severity.NOTE,
        )
    ]


def machine_issues(
    machine: Machine, box: tuple[float, float, float, float] | None = None, zero_is_set: bool = False
) -> list[Issue]:
    """Return issues about assumed values of a machine, and about limits that are not checked.

    If a part is on the negative side of the zero, the result also contains a warning, or a note if ``--origin`` set the
    zero. `box` is the extent of the work, as in `placing.negative_axes`.
    """
    issues = []
    if box is not None and (axes := negative_axes(box, machine)):
        x0, y0, x1, y1 = box
        lowest = " ".join(f"{axis}{low:.4g}" for axis, low in (("X", x0), ("Y", y0)) if axis in axes)
        message = Message(
            "the part reaches {}: it extends from X{:.4g} to {:.4g} and from Y{:.4g} to {:.4g} mm; set the "
            "work zero accordingly, or use --origin lower-left",
            lowest,
            x0,
            x1,
            y0,
            y1,
        )
        issues.append(Issue("L403", message, severity=Severity.NOTE if zero_is_set else Severity.WARNING))
    if machine.assumed:
        values = ", ".join(f"{key} {source.partition(' (')[0]}" for key, source in machine.assumed.items())
        message = Message(
            "the profile of {} is incomplete, so leafcut assumes {}; see 'leafcut list machines'", machine.name, values
        )
        issues.append(Issue("L408", message, severity=Severity.NOTE))
    if machine.work_offset is None:
        # An unknown travel limit is already reported with the assumed values.
        message = Message(
            "the position of the part on {} is unknown, so only its size was compared with the machine's "
            "travel; set --work-offset to check its position",
            machine.name,
        )
        if not any(math.isfinite(machine.reach(axis)) for axis in range(3)):
            message = Message(
                "the position of the part on {} and the machine's travel are unknown, so the travel was not "
                "checked; set --work-offset to check the position",
                machine.name,
            )
        issues.append(Issue("L403", message, severity=Severity.NOTE))
    return issues
