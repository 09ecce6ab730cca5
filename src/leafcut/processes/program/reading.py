"""Read a program from another CAM system, and detect its process, machine, units and feeds."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import OptionError, ReadError
from leafcut.files.digests import machine_in_header
from leafcut.files.whole_files import read_program
from leafcut.gcode.dialects import Dialect, load_dialect
from leafcut.gcode.languages import describe_unsupported_language
from leafcut.gcode.material import add_controller_moves
from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import first_size_in_other_unit
from leafcut.gcode.words import COMMENT
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import Head, ProgramKind
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import FeedOptions, MachineOptions, Settings, flag_name
from leafcut.processes.cutting_machines import CUTTING_MACHINES
from leafcut.processes.job import Job, machine_of
from leafcut.proof.doubts import find_probable_mistakes
from leafcut.read.machine import load_machine, machine_names
from leafcut.read.registry import detect_format_name
from leafcut.units import LARGE_UNITS, SECONDS_PER_MINUTE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from leafcut.geometry.arrays import Mask
    from leafcut.model.machine import Machine
    from leafcut.read import Input

#: Options that set the feed if the program takes its feed from the material table of the controller.
_OF_MATERIALS = ("cut_speed", "cut_process", "material", "thickness", "amps", "nozzle", "chart")
#: Assumed thickness for a feed from the cut chart if the user does not specify a thickness, mm.
_USUAL_THICKNESS = 3.0
#: File extensions of drawings that a user may pass by mistake instead of a program.
DRAWINGS = (".dxf", ".svg", ".step", ".stp", ".stl")
#: Issue codes of rapids that are dangerous only if the part surface is at Z0 everywhere.
BELOW_SURFACE = ("L801", "L802")
#: The machine may be named in comments within this number of lines at the top of a program.
_TOP = 200
#: Names of router software and controllers in comments, with the machine profile. Manufacturers come before firmware.
#: "Carbide" alone would match the material of a tool.
_NAMED = (
    (re.compile(r"open\s?builds", re.IGNORECASE), "openbuilds-router"),
    (re.compile(r"shapeoko|carbide\s?(?:3d|create|motion)", re.IGNORECASE), "shapeoko-router"),
    (re.compile(r"\bgrbl", re.IGNORECASE), "shapeoko-router"),
)
#: Controllers that run on both routers and mills. A program with the spindle speed of a router is for a router.
_WITH_SPEED = (
    (re.compile(r"\bmach\s?4\b", re.IGNORECASE), "mach4-router"),
    (re.compile(r"\bmach\s?[23]\b", re.IGNORECASE), "mach3-router"),
    (re.compile(r"\buccnc\b", re.IGNORECASE), "uccnc-router"),
    (re.compile(r"\bmasso\b", re.IGNORECASE), "masso-router"),
    (re.compile(r"\beding\s?cnc\b", re.IGNORECASE), "edingcnc-router"),
)
#: Names of machining centres and high-speed mills in comments. Their spindles can be as fast as router spindles.
_CENTRE = re.compile(
    r"\b(?:haas|fanuc|mazak|okuma|doosan|hurco|brother|mori|makino|datron|tormach|fadal|sinumerik|heidenhain|fagor|"
    r"centroid|syil)\b",
    re.IGNORECASE,
)
#: Range of router spindle speeds, rpm. VFD spindles reach 24000, and trim routers reach 30000. Belt-driven mills and
#: most machining centres stay below this range.
_ROUTER_RPM = (12_000.0, 30_000.0)


@dataclass(frozen=True)
class ProgramRead:
    """A program that was read for a dialect and a machine.

    If the machine was only guessed from the program, `limits` is the machine whose limits are checked instead.
    """

    program: Program
    dialect: Dialect
    machine: Machine
    issues: tuple[Issue, ...] = ()
    process: str = "mill"
    limits: Machine | None = None

    @property
    def machine_with_checked_limits(self) -> Machine:
        """The machine whose limits are checked."""
        return self.limits or self.machine

    def find_dangers(self, simulated: Mapping[str, Mask] = MappingProxyType({})) -> list[Issue]:
        """Return the dangers of the program as one issue per kind, with the worst danger first.

        If leafcut wrote the program for a solid or a surface, a rapid below Z0 is only a warning. `simulated` maps
        issue codes to masks of the rows that were checked by simulating the stock.
        """
        from leafcut.processes.program.stated_part import stated_part
        from leafcut.proof.dangers import RANK, find_dangers

        # On a laser machine, S is the beam power in every program.
        process = ProgramKind.LASER if self.machine.head is Head.LASER else self.process
        found = find_dangers(
            self.program, self.machine_with_checked_limits, process, self.dialect.has_z_words, simulated
        )
        found += find_probable_mistakes(self.program, self.dialect, process)
        found.sort(key=lambda issue: (RANK[issue.severity], issue.code))
        if stated_part(self.program) is None:
            return found
        # The surface of a solid is not at Z0 everywhere, so rapids over lower steps are below Z0.
        return [replace(i, severity=Severity.WARNING) if i.code in BELOW_SURFACE else i for i in found]


def read_file(
    program: Input,
    settings: Settings,
    dialect_name: str | None,
    check_cancelled: Heartbeat,
    base: ProgramRead | None = None,
) -> ProgramRead:
    """Read a program file for the machine and dialect of the settings.

    If another program is passed as `base`, its machine and dialect are used.
    """
    machine = base.machine if base else machine_of(settings)
    program_dialect = base.dialect if base else load_dialect(dialect_name or machine.controller)
    return read_foreign(
        read_program(program), str(program), settings, machine, program_dialect, check_cancelled, choose=base is None
    )


def controller_motion(program: Program, program_dialect: Dialect, clearance: float) -> tuple[Toolpath, list[Issue]]:
    """Return the motion of a program, including the moves that the controller adds at each cut.

    A warning reports unknown materials.
    """
    if program_dialect.torch is None or not program_dialect.torch.material_comment:
        return program.path, []
    path, unknown = add_controller_moves(program.path, program.lines, clearance)
    message = Message(
        "{} cuts use a material that the program does not define, (o=0, …), so their pierces are not timed", unknown
    )
    if unknown == 1:
        message = Message(
            "1 cut uses a material that the program does not define, (o=0, …), so its pierce is not timed"
        )
    return path, [Issue("L413", message)] if unknown else []


def read_new(job: Job, program_dialect: Dialect, text: str) -> Program:
    """Interpret a newly written program for the machine of the job."""
    check_cancelled = job.start_step(Message("verifying"))
    return read_foreign(
        text,
        "the new program",
        job.settings,
        job.machine,
        program_dialect,
        check_cancelled,
        process="mill",
        choose=False,
    ).program


def refuse_other_languages(text: str, source: str) -> None:
    """Refuse files that are not G-code. The error names the format.

    Raises
    ------
    OptionError
        The file is a drawing.
    ReadError
        The program is in a language other than G-code.
    """
    if Path(source).suffix.lower() in DRAWINGS and (kind := detect_format_name(source)) not in ("", "gcode"):
        raise OptionError(
            "{}: this is a drawing ({}), not a program; create its program first: leafcut {}", source, kind, source
        )
    if what := describe_unsupported_language(text):
        raise ReadError(source, what)


def read_foreign(
    text: str,
    source: str,
    settings: Settings,
    machine: Machine,
    program_dialect: Dialect,
    check_cancelled: Heartbeat = ignore_heartbeat,
    *,
    process: str = "auto",
    choose: bool = True,
    router: bool = True,
) -> ProgramRead:
    """Read a program from another CAM system for a machine.

    If the user did not name a machine, `choose` picks the machine that the header of leafcut names. For other programs,
    it picks a laser for a laser program and a plasma table for a QtPlasmaC program. On a spindle machine, a laser or
    torch program is timed without spindle starts.

    With `router`, a router program is timed on a router. Do not set it if speeds or heights will change, because their
    safety depends on how the real controller rounds corners.

    Raises
    ------
    ReadError
        The program is invalid or in another language.
    OptionError
        ``--units`` is invalid, or the program states its own units.
    """
    named = "machine" in settings.given or settings.machine.machine != MachineOptions().machine
    free = choose and not named and program_dialect.name == machine.controller
    header = machine_in_header(text) if free else ""
    if header in machine_names():
        chosen = _load_machine_and_dialect(settings, header)
        read = read_foreign(text, source, settings, *chosen, check_cancelled, process=process, choose=False)
        message = Message("the machine is {}, as the header of the program states; change it with --machine", header)
        return replace(read, issues=(Issue("L417", message, severity=Severity.NOTE), *read.issues))
    if program_dialect.language != "g-code":
        return _read_leafcut_language(text, source, settings, machine, program_dialect)
    refuse_other_languages(text, source)
    if free and _QTPLASMAC in text:
        return _read_for_plasma(text, source, settings, check_cancelled, process)
    try:
        read = _read_gcode(text, source, settings, machine, program_dialect, check_cancelled)
    except ReadError as error:
        if not free or not _can_read(text, source, settings, _HAAS, check_cancelled):
            raise
        hint = Message(
            "the program was read for {}, but a Haas would accept it; choose your machine, such as --machine {}",
            machine.name,
            _HAAS,
        )
        raise ReadError(source, Message("{}; {}", error.reason, hint), error.line) from None
    read = replace(read, process=_given_or_detected_process(read, process))
    if free and read.process in _BEAMS and (read.program.obeyed or _OF_QTPLASMAC.search(text)):
        # Other dialects would ignore its material comments and move cuts past them.
        return _read_for_plasma(text, source, settings, check_cancelled, process)
    if free and read.process == ProgramKind.LASER and machine.head is Head.SPINDLE:
        chosen = _load_machine_and_dialect(settings, _laser_profile_for(read.program))
        again = _read_gcode(text, source, settings, *chosen, check_cancelled)
        return replace(again, process="laser", issues=(_assumed_machine_note(again.machine, "laser"), *again.issues))
    if machine.head is Head.SPINDLE and read.process in _BEAMS:
        head, what = _BEAMS[read.process]
        message = Message(
            "the program drives {}, for which S is the power; {} is timed without spindle start-up", what, machine.name
        )
        note = Issue("L807", message, severity=Severity.NOTE)
        machine = replace(machine, head=head, spindle_start_s=0.0)
        return replace(read, machine=machine, issues=(note, *read.issues) if choose else read.issues)
    if choose and router and not named and machine.head is Head.SPINDLE:
        return _timed_on_router(read)
    return read


#: The machine head and its name in messages, by beam process.
_BEAMS: dict[str, tuple[Head, str]] = {
    ProgramKind.LASER: (Head.LASER, Message("a laser")),
    ProgramKind.PLASMA: (Head.TORCH, Message("a torch")),
}
#: Machine to suggest if the default machine rejects a program. Most machining centres use the same dialect.
_HAAS = "haas-vf2"
_QTPLASMAC = "#<_hal[plasmac."
#: Words that only QtPlasmaC uses: they select the torch or the scribe, or a material number.
_OF_QTPLASMAC = re.compile(r"^[^(;\n]*M0*(?:[35]\s*\$[0-2]|190\s*P)", re.IGNORECASE | re.MULTILINE)
#: Laser profiles from slow to fast. The first profile that is fast and large enough is chosen.
_LASERS = ("grbl-laser-5w", "grbl-laser-20w", "grbl-laser-co2")


def _can_read(text: str, source: str, settings: Settings, machine: str, check_cancelled: Heartbeat) -> bool:
    try:
        _read_gcode(text, source, settings, *_load_machine_and_dialect(settings, machine), check_cancelled)
    except ReadError:
        return False
    return True


def _read_for_plasma(
    text: str, source: str, settings: Settings, check_cancelled: Heartbeat, process: str
) -> ProgramRead:
    read = _read_gcode(
        text, source, settings, *_load_machine_and_dialect(settings, CUTTING_MACHINES["plasma"]), check_cancelled
    )
    done = "plasma" if process == "auto" else process
    return replace(read, process=done, issues=(_assumed_machine_note(read.machine, "plasma"), *read.issues))


def _timed_on_router(read: ProgramRead) -> ProgramRead:
    """Time the program on the router that it indicates. The limits of the default machine still apply."""
    if (found := router_for(read.program)) is None:
        return read
    name, word = found
    message = Message(
        "{} indicates a router, so the program is timed on {} and checked against the limits of {}; name your "
        "machine with --machine",
        word,
        name,
        read.machine.name,
    )
    note = Issue("L807", message, severity=Severity.NOTE)
    machine = with_router_times(read.machine, load_machine(name))
    return replace(read, machine=machine, limits=read.machine, issues=(note, *read.issues))


def _given_or_detected_process(read: ProgramRead, process: str) -> str:
    from leafcut.processes.program.plan.program_rows import detect_process

    return detect_process(read.program) if process == "auto" else process


def _load_machine_and_dialect(settings: Settings, name: str) -> tuple[Machine, Dialect]:
    machine = machine_of(settings.but(replace(settings.machine, machine=name)))
    return machine, load_dialect(machine.controller)


def _assumed_machine_note(machine: Machine, what: str) -> Issue:
    what = {"laser": Message("a laser"), "plasma": Message("a plasma table")}[what]
    message = Message(
        "this program is for {}, so the machine is assumed to be {}; name your machine with --machine",
        what,
        machine.name,
    )
    return Issue("L807", message, severity=Severity.NOTE)


def _laser_profile_for(program: Program) -> str:
    path = program.path
    feeds = path.value[(path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)]
    fastest = float(np.max(feeds, initial=0.0))
    low, high = path.extents
    for name in _LASERS:
        machine = load_machine(name)
        sides = zip(low[:2], high[:2], machine.travel_min[:2], machine.travel_max[:2], strict=True)
        if fastest <= machine.max_feed + 1e-9 and all(b - a <= d - c + 1e-9 for a, b, c, d in sides):
            return name
    return _LASERS[-1]


def _read_leafcut_language(
    text: str, source: str, settings: Settings, machine: Machine, program_dialect: Dialect
) -> ProgramRead:
    """Read a program in a language other than G-code. Only programs that leafcut wrote are supported."""
    from leafcut.gcode.own_program import interpret_own_program
    from leafcut.gcode.program_interpreter import split_lines

    if "units" in settings.asked:
        raise OptionError("--units: the program states its own units; leave it out")
    program = Program.of_toolpath(
        interpret_own_program(text, program_dialect, source), split_lines(text, program_dialect, source)
    )
    return ProgramRead(program, program_dialect, machine)


def _read_gcode(
    text: str, source: str, settings: Settings, machine: Machine, program_dialect: Dialect, check_cancelled: Heartbeat
) -> ProgramRead:
    """Read a G-code program for a machine. Notes report assumed units and feeds."""
    from leafcut.gcode.program_interpreter import interpret_program

    units = settings.read.units or machine.units
    if units not in ("mm", "in"):
        raise OptionError("--units {}: a program is in mm or in inches; use mm or in", units)
    feed, issues = _material_feed(text, settings, program_dialect)
    program = interpret_program(
        text, program_dialect, source, units=units, on_progress=check_cancelled, material_feed=feed
    )
    if program.title_lines:
        what = Message("line 1 is") if program.title_lines == 1 else Message("lines 1 to {} are", program.title_lines)
        issues.append(
            Issue("L101", Message("{} not G-code, so leafcut ignores this title above the percent sign", what))
        )
    if not program.assumed_units and "units" in settings.asked:
        raise OptionError("--units: the program states its own units (G20 or G21); leave it out")
    if program.assumed_units:
        whose = "--units" if settings.read.units else machine.name
        name = LARGE_UNITS.get(units, units)
        line, size = first_size_in_other_unit(program.lines, units)
        if line:
            message = Message(
                "the program does not state its units (G20 or G21) and is read in {}, the units of {}, but a "
                "comment gives the size {}; check the size, and set --units if the units are wrong",
                name,
                whose,
                size,
            )
            issues.append(Issue("L102", message, Message("line {}", line)))
        else:
            message = Message(
                "the program does not state its units (G20 or G21) and is read in {}, the units of {}; set "
                "--units to change that",
                name,
                whose,
            )
            issues.append(Issue("L102", message, severity=Severity.NOTE))
    return ProgramRead(program, program_dialect, machine, tuple(issues))


def _material_feed(text: str, settings: Settings, program_dialect: Dialect) -> tuple[float | None, list[Issue]]:
    """Return the feed for materials that the program does not define, mm/s.

    The result is None if the program does not take its feed from a material.
    """
    word = "" if program_dialect.torch is None else program_dialect.torch.material_feed
    if not word or word not in text:
        for name in _OF_MATERIALS:
            # The material of `reorder --feeds` is that of the milled part.
            if name in settings.asked and not (name == "material" and settings.of(FeedOptions).feeds):
                raise OptionError(
                    "{} is not used, because the program states its own feeds; leave it out", flag_name(name)
                )
        return None, []
    issues: list[Issue] = []
    feed = settings.cut_data.cut_speed
    if feed is None:
        feed, whose = _chart_feed(settings)
        said = Message(
            "{}: the feed of the controller's material is assumed to be {:,.0f} mm/min", word, feed * SECONDS_PER_MINUTE
        )
        issues.append(Issue("L413", Message("{}, {}; set it with --cut-speed", said, whose), severity=Severity.NOTE))
    return feed, issues


def _chart_feed(settings: Settings) -> tuple[float, str]:
    """Look up the feed in the cut chart, mm/s. Return the feed and a text that names its source."""
    from leafcut.read.cutchart import find_cut_data, load_chart

    options, job = settings.cut_data, settings.job
    thickness = job.thickness or _USUAL_THICKNESS
    rows = load_chart(options.chart)
    data, _ = find_cut_data(
        rows, options.cut_process or "plasma", job.material, thickness, options.amps, options.nozzle
    )
    return data.feed, Message("the cut chart's for {:g} mm of {}", thickness, job.material.replace("_", " "))


# -- timing on a router ----------------------------------------------------------------------------------------------


def router_for(program: Program) -> tuple[str, str] | None:
    """Return the router profile that a program indicates, and the word that indicates it.

    Return None if the program contains no such word.
    """
    top = " ".join(text for line in program.lines[:_TOP] for text in COMMENT.findall(line))
    for name, machine in _NAMED:
        if named := name.search(top):
            return machine, named[0]
    path = program.path
    fastest = float(np.max(np.abs(path.value[path.kind == Kind.SPINDLE]), initial=0.0))
    if not _ROUTER_RPM[0] <= fastest <= _ROUTER_RPM[1] or _CENTRE.search(top):
        return None
    machine = next((machine for name, machine in _WITH_SPEED if name.search(top)), "mach3-router")
    return machine, f"S{fastest:.0f}"


def with_router_times(machine: Machine, router: Machine) -> Machine:
    """Return a machine with the motion and times of a router but with its own limits.

    The router is only a guess, so the lower of the two maximum feeds applies. Units, travel, heights and spindle do not
    change.
    """
    return replace(
        machine,
        name=router.name,
        description=router.description,
        rapid_velocity=router.rapid_velocity,
        acceleration=router.acceleration,
        acceleration_factor=router.acceleration_factor,
        max_feed=min(machine.max_feed, router.max_feed),
        corners=router.corners or ("grbl" if router.control.startswith("grbl") else "round"),
        corner_deviation=router.corner_deviation,
        arc_tolerance=router.arc_tolerance,
        steps_per_mm=router.steps_per_mm,
        motor_lock_s=router.motor_lock_s,
        tool_change_s=router.tool_change_s,
        spindle_start_s=router.spindle_start_s,
    )
