"""Select the end mill of a job and its feeds, either from the tool library or from conservative cutting data."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from leafcut.errors import OptionError, PlanError, printable
from leafcut.material.chip_feeds import plunge_feed, ramp_feed
from leafcut.message import Message
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool, ToolKind, ToolLibrary
from leafcut.options import JobOptions, MillingOptions, Settings
from leafcut.processes.spindle_moves import check_spindle_heights

#: Surface speed of high-speed steel end mills, m/min. The values are the low end of workshop tables for milling (mild
#: steel 25 … 35, stainless 9 … 20, aluminium and brass 60 … 150, plastics from 20), less 40 % because end and side cut
#: simultaneously. Carbide allows three times the speed.
SURFACE_SPEEDS = {"mild_steel": 20.0, "stainless_304": 8.0, "aluminium": 60.0, "brass": 40.0, "plastic": 40.0}
#: Other names of materials that share the same cutting data.
_NAMES = {
    "steel": "mild_steel",
    "stainless": "stainless_304",
    "stainless_steel": "stainless_304",
    "aluminum": "aluminium",
    "plastics": "plastic",
    "aluminium_6061": "aluminium",
    "aluminium_7075": "aluminium",
    "aluminium_cast": "aluminium",
    "brass_cuzn39pb3": "brass",
    "stainless_316": "stainless_304",
    "steel_s235": "mild_steel",
}
#: Feed per tooth, in tool diameters, and maximum feed per tooth, mm. Catalogues of end mills give 0.005 to 0.01
#: diameters, up to 0.05 mm for a 10 mm mill (Iscar, solid end mills, recommended cutting parameters).
FEED_PER_TOOTH, MOST_PER_TOOTH = 0.01, 0.05
#: A spindle is refused if all its speeds differ from the suitable speed by more than the factor `MOST_OFF`, because the
#: tool would break or burn. The program warns if it assumes a speed above `FAST` times the suitable speed.
MOST_OFF, FAST = 2.0, 1.5
#: Assumed number of teeth (slot mills have two teeth).
TEETH = 2
#: Default plunge rate, relative to the feed: a plunging end mill cuts with its centre, where the cutting speed is 0.
PLUNGE_PART = 1.0 / 3.0


@dataclass(frozen=True)
class MillingData:
    """An end mill, its plunge rate, mm/s, and the kind and angle, rad, of its entry moves.

    Attributes
    ----------
    air_feed
        Feed for moves at depth that do not cut, mm/s. It is only used if it exceeds the feed of the tool.
    limits
        Limits for feeds that depend on the load. If None, the plunge rate limits the vertical speed on a ramp.
    """

    tool: Tool
    plunge_feed: float
    entry: str = "ramp"
    entry_angle: float = math.radians(3.0)
    air_feed: float = 0.0
    limits: FeedLimits | None = None

    def ramp_feed(self, depth: float) -> float:
        """Return the feed for a ramp or a helix into material with a depth of `depth` mm, in mm/s."""
        feed = min(self.tool.feed, self.plunge_feed / math.sin(self.entry_angle))
        return feed if self.limits is None else ramp_feed(self.limits, feed, self.entry_angle, depth)

    @property
    def limited_plunge_feed(self) -> float:
        """Feed for a plunge into material, mm/s. The spindle power may limit it."""
        return self.plunge_feed if self.limits is None else plunge_feed(self.limits, self.plunge_feed)


def library_mill_for(library: ToolLibrary | None, settings: Settings, depth: float | None) -> Tool | None:
    """Return the end mill that the settings select (see `select_library_mill`), or None without a library."""
    if library is None:
        return None
    job, number = settings.job, settings.of(MillingOptions).tool_number
    return select_library_mill(library, number, job.tool_diameter, job.diameter_tolerance, depth)


def assumed_number_issues(options: MillingOptions, mill: Tool | None, tool: Tool) -> list[Issue]:
    """Return a note if the number of the end mill is neither in the tool library nor given as an option."""
    if mill is not None or options.tool_number is not None:
        return []
    words = Message("{} is assumed; load it under this number, or give --tool-number", tool.label)
    return [Issue("L401", words, severity=Severity.NOTE)]


def select_library_mill(
    library: ToolLibrary, number: int | None, asked: float | None, tolerance: float, depth: float | None
) -> Tool:
    """Select an end mill from a library.

    The number takes precedence over the diameter `asked`, mm. If neither is given, the library must contain exactly one
    end mill. `depth` is the maximum milling depth, mm.

    Raises
    ------
    OptionError
        The library does not contain the requested number. Or it contains several end mills, and neither a number nor a
        diameter is given.
    PlanError
        The library contains no end mill, or the tool is not an end mill, has a different diameter, or is too short.
    """
    tool = _mill_by_number(library, number) if number is not None else _mill_by_diameter(library, asked)
    if asked is not None and abs(tool.diameter - asked) > tolerance + 1e-9:
        raise PlanError(
            "{}: {} differs from --tool-diameter {:g} mm; {}",
            library.source,
            tool.label,
            asked,
            _mill_list_text(library),
        )
    if depth is not None and depth > tool.reach + 1e-9:
        raise PlanError(
            "{} cuts {:g} mm deep at most, but {:g} mm are needed; use a longer tool",
            tool.label,
            tool.reach,
            depth,
        )
    return tool


def _mill_by_number(library: ToolLibrary, number: int) -> Tool:
    tool = library.by_number.get(number)
    if tool is None:
        raise OptionError("--tool-number {}: {} has no such tool; {}", number, library.source, _mill_list_text(library))
    if tool.kind is not ToolKind.END_MILL:
        raise PlanError(
            "--tool-number {}: {} is a {}, not an end mill; {}",
            number,
            tool.label,
            tool.kind.value,
            _mill_list_text(library),
        )
    return tool


def _mill_by_diameter(library: ToolLibrary, asked: float | None) -> Tool:
    mills = _end_mills(library)
    if not mills:
        raise PlanError('{}: the library has no end mill; add a [[tool]] with kind = "end-mill"', library.source)
    if asked is None and len(mills) > 1:
        raise OptionError("{}; choose one with --tool-number or --tool-diameter", _mill_list_text(library))
    return mills[0] if asked is None else min(mills, key=lambda tool: abs(tool.diameter - asked))


def _end_mills(library: ToolLibrary) -> list[Tool]:
    return [tool for tool in library.tools if tool.kind is ToolKind.END_MILL]


def _mill_list_text(library: ToolLibrary) -> Message:
    names = ", ".join(tool.label for tool in _end_mills(library))
    return (
        Message("{} has these end mills: {}", library.source, names)
        if names
        else Message("{} has no end mill", library.source)
    )


def add_cutting_data(
    mill: Tool | None,
    number: int | None,
    job: JobOptions,
    diameter: float,
    machine: Machine,
) -> tuple[Tool, list[Issue]]:
    """Return the end mill with its feed and speed, and issues about assumed values.

    Options take precedence over the library. If neither gives a value, tables for high-speed steel mills provide it.

    Raises
    ------
    OptionError
        The tables do not contain the material.
    PlanError
        The machine cannot run at this speed or feed. Or no speed is given, and the spindle cannot reach a suitable
        speed.
    """
    tool = mill or Tool(number or 1, diameter, ToolKind.END_MILL, point_angle=math.pi, assumed=True)
    asked_rpm, asked_feed = job.spindle_speed or tool.spindle_rpm, job.feed or tool.feed
    name, careful = "", asked_rpm
    if not (asked_rpm and asked_feed):
        known = _material_with_data(job.material)
        name, careful = known.replace("_", " "), 1000.0 * SURFACE_SPEEDS[known] / (math.pi * tool.diameter)
    has = Message(
        "the spindle of {} turns {:g} to {:g} rpm", machine.name, machine.spindle_min_rpm, machine.spindle_max_rpm
    )
    if not asked_rpm and not machine.spindle_min_rpm / MOST_OFF <= careful <= machine.spindle_max_rpm * MOST_OFF:
        raise PlanError(
            "{} needs {:.0f} rpm in {}, but {}; use a smaller mill, or give --material or the --spindle-speed "
            "that your mill and material need"
            if careful < machine.spindle_min_rpm
            else "{} needs {:.0f} rpm in {}, but {}; use a larger mill, or give --material or the --spindle-speed "
            "that your mill and material need",
            tool.label,
            careful,
            name,
            has,
        )
    rpm = asked_rpm or float(round(min(max(careful, machine.spindle_min_rpm), machine.spindle_max_rpm)))
    if not machine.spindle_min_rpm <= rpm <= machine.spindle_max_rpm:
        whose = "--spindle-speed" if job.spindle_speed else Message("the speed of {}", tool.label)
        raise PlanError("{} is {:g} rpm, but {}; choose a speed in this range", whose, rpm, has)
    per_tooth = min(FEED_PER_TOOTH * tool.diameter, MOST_PER_TOOTH)
    feed = asked_feed or min(per_tooth * (tool.teeth or TEETH) * rpm / 60.0, machine.max_feed)
    if feed > machine.max_feed * (1 + 1e-9):
        whose = "--feed" if job.feed else Message("the feed of {}", tool.label)
        raise PlanError(
            "{} is {:g} mm/min, but {} feeds at {:g} mm/min at most; choose a lower feed",
            whose,
            feed * 60,
            machine.name,
            machine.max_feed * 60,
        )
    tool = replace(tool, feed=feed, spindle_rpm=rpm)
    if asked_rpm and asked_feed:
        return replace(tool, assumed=False), []
    too_fast = rpm > (MOST_OFF if asked_rpm else FAST) * careful
    words = Message(
        "{}: leafcut assumes {:.6g} mm/min at {:.0f} rpm (for high-speed steel in {}, {:.3g} mm per tooth); "
        "check both values, and change them with --material, --feed or --spindle-speed",
        tool.label,
        feed * 60,
        rpm,
        name,
        per_tooth,
    )
    if too_fast:
        # The requested speed is too high for the material that the assumed feed is based on.
        words = Message("{}. The recommended spindle speed is {:.0f} rpm", words, careful)
        if not asked_rpm:
            words = Message("{}, but the minimum speed of the spindle of {} is {:.0f} rpm", words, machine.name, rpm)
    return tool, [Issue("L401", words, severity=Severity.WARNING if too_fast else Severity.NOTE)]


def _material_with_data(material: str) -> str:
    """Return the name of the material in `SURFACE_SPEEDS`. Raises OptionError if the table does not contain it."""
    key = "_".join(material.lower().replace("-", " ").split())
    key = _NAMES.get(key, key)
    if key not in SURFACE_SPEEDS:
        raise OptionError(
            "--material: leafcut has no cutting data of end mills for '{}', only for {}; give --feed and "
            "--spindle-speed",
            printable(material),
            ", ".join(name.replace("_", "-") for name in SURFACE_SPEEDS),
        )
    return key


def milling_data(
    options: MillingOptions,
    job: JobOptions,
    diameter: float,
    machine: Machine,
    mill: Tool | None = None,
    entry: str = "ramp",
) -> tuple[MillingData, list[Issue]]:
    """Return the end mill with its feeds, and issues about assumed values.

    Without a `mill` from a library, this function assumes an end mill with the given diameter, mm.

    Raises
    ------
    PlanError
        The machine has no spindle or cannot run at the speed or feed, or some heights contradict each other.
    """
    check_spindle_heights(machine, job, "mill")
    tool, issues = add_cutting_data(mill, options.tool_number, job, diameter, machine)
    plunge = options.plunge_feed or tool.plunge_feed or PLUNGE_PART * tool.feed
    return MillingData(tool, min(plunge, machine.max_feed), entry, options.entry_angle, machine.max_feed), issues
