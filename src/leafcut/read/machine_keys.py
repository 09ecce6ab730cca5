"""The keys of a machine profile, with their meanings and defaults.

The code uses this table to validate and complete profiles, and to write templates and the reference page
(`tools/make_reference.py`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.files.schemas import MACHINE
from leafcut.model.kinds import Head

RAPID_STYLES = ("linear", "dogleg")
CORNERS = ("linuxcnc", "grbl", "round")
#: Value for an unknown travel limit of an axis.
UNKNOWN = "unknown"


@dataclass(frozen=True)
class ProfileKey:
    """A key of a machine profile.

    Attributes
    ----------
    default
        Value that applies if the key is missing, as written in a profile; None if the key has no default.
    why
        Source of the default. For a key without a default, the effect of a missing key.
    reported
        Whether a run reports that it uses the default (L408), because times or refusals depend on it.
    unit, size
        For a quantity, its internal unit (a key of `units.FACTORS`), and the number of values: one, or one per axis.
    """

    name: str
    help: str
    default: Any = None
    why: str = ""
    example: Any = None
    required: bool = False
    reported: bool = False
    unit: str = ""
    size: int = 1
    choices: tuple[str, ...] = ()
    bounds: str = ""

    @property
    def kind(self) -> str:
        """The kind of value: flag, choice, quantity, axes (a quantity per axis), number, whole, wholes, or text."""
        if isinstance(self.default, bool):
            return "flag"
        if self.choices:
            return "choice"
        if self.unit:
            return "axes" if self.size > 1 else "quantity"
        numbers = {float: "number", int: "whole", list: "wholes"}
        return numbers.get(type(self.default if self.example is None else self.example), "text")

    @property
    def table(self) -> str:
        """The name of the table that contains the key, or "" for the top level."""
        return self.name.rpartition(".")[0]

    @property
    def key(self) -> str:
        """The name of the key within its table."""
        return self.name.rpartition(".")[2]

    @property
    def default_text(self) -> str:
        """The default of the key with its source, as text."""
        value = "" if self.default is None else toml_value(self.default)
        return f"{value} ({self.why})" if value and self.why else value or self.why


_ZEROS = ["0 mm", "0 mm", "0 mm"]

PROFILE_KEYS: tuple[ProfileKey, ...] = (
    ProfileKey("name", "name of the machine", why="the name of the file"),
    ProfileKey("description", "description of the machine, in one line", why="its name"),
    ProfileKey("controller", "dialect of its programs: linuxcnc, haas, fanuc, grbl … as for --dialect", required=True),
    ProfileKey(
        "process",
        f"kind of tool: {', '.join(Head)}",
        Head.SPINDLE.value,
        "most machines have one",
        reported=True,
        choices=tuple(Head),
    ),
    ProfileKey(
        "cut_process",
        "cutting source with its power, as named in cut charts; only the chart rows of this source are used",
        why="set --cut-process, unless the chart has rows for every source of that process",
        example="laser_fiber_3kW",
        bounds="starts with the cutting method: plasma, laser, oxyfuel or waterjet",
    ),
    ProfileKey(
        "units",
        "units of a program that does not state them: mm, in",
        "mm",
        "the controllers' own default",
        choices=("mm", "in"),
    ),
    ProfileKey(
        "max_feed",
        "highest programmed feed",
        why="the slower of the rapids of x and y",
        reported=True,
        unit="mm/s",
        bounds="above 0",
    ),
    ProfileKey(
        "acceleration_factor",
        "share of the acceleration that a move from rest to rest uses, above 0 and at most 1",
        1.0,
        "all of it; LinuxCNC reserves 10 %",
    ),
    ProfileKey(
        "home",
        "machine coordinates where the machine waits before and after a program",
        _ZEROS,
        "machine zero",
        unit="mm",
        size=3,
        bounds="within the travel",
    ),
    ProfileKey(
        "work_offset",
        "program zero in machine coordinates",
        why="unknown: only the size of the work is checked against the travel; --work-offset sets it for one run",
        example=["-400 mm", "-200 mm", "-300 mm"],
        unit="mm",
        size=3,
    ),
    ProfileKey(
        "safe_z",
        "machine coordinate z that is safe for tool changes and at the end",
        why="the clearance height of the program",
        example="0 mm",
        unit="mm",
        bounds="within the travel of z",
    ),
    ProfileKey(
        "nozzle_diameter",
        "nozzle diameter of a head that stays down; its rapids go around detached parts",
        "0 mm",
        "unknown: only the centre of the head goes around them",
        unit="mm",
        bounds="0 to 200 mm",
    ),
    ProfileKey(
        "rapid.style",
        "linear: all axes arrive together; dogleg: each axis at its own speed",
        "linear",
        "as LinuxCNC, GRBL and Mach",
        reported=True,
        choices=RAPID_STYLES,
    ),
    ProfileKey(
        "rapid.velocity",
        "speed of rapids: one for all axes, or a list of three",
        required=True,
        unit="mm/s",
        size=3,
        bounds="above 0",
    ),
    ProfileKey(
        "rapid.acceleration",
        "acceleration: one for all axes, or a list of three",
        "500 mm/s2",
        "estimate: between a hobby router and a machining centre",
        reported=True,
        unit="mm/s²",
        size=3,
        bounds="above 0",
    ),
    ProfileKey(
        "corners.style",
        f"corners of feed moves: {', '.join(CORNERS)}",
        why="the style of the controller's name, round for other controllers",
        example="round",
        choices=CORNERS,
    ),
    ProfileKey(
        "corners.deviation",
        "maximum deviation at corners, for grbl and round",
        "0.01 mm",
        "GRBL's own $11",
        unit="mm",
        bounds="above 0",
    ),
    ProfileKey(
        "corners.arc_tolerance",
        "maximum deviation of a GRBL board's chords from an arc",
        "0.002 mm",
        "GRBL's own $12",
        unit="mm",
        bounds="above 0",
    ),
    ProfileKey(
        "motors.steps_per_mm",
        "steps of a GRBL board's motors: one for all axes, or a list of three",
        "250 steps/mm",
        "GRBL's own $100 to $102",
        unit="steps/mm",
        size=3,
        bounds="above 0",
    ),
    ProfileKey(
        "motors.lock_time",
        "time for which a GRBL board holds its motors after every stop; 0 if they stay on ($1=255)",
        "25 ms",
        "GRBL's own $1",
        unit="s",
        bounds="0 or more, below 1 s",
    ),
    ProfileKey(
        "travel.min",
        "lowest machine coordinates",
        why="unknown: travel is not checked",
        example=["-400 mm", "-200 mm", UNKNOWN],
        unit="mm",
        size=3,
    ),
    ProfileKey(
        "travel.max",
        "highest machine coordinates",
        why="unknown: travel is not checked",
        example=["0 mm", "0 mm", UNKNOWN],
        unit="mm",
        size=3,
        bounds="above the lowest",
    ),
    ProfileKey("spindle.min_speed", "lowest spindle speed", "0 rpm", "no lower limit", unit="rpm", bounds="0 or more"),
    ProfileKey(
        "spindle.max_speed",
        "highest spindle speed",
        "10000 rpm",
        "estimate: a common spindle",
        reported=True,
        unit="rpm",
        bounds="above 0, not below the lowest speed",
    ),
    ProfileKey(
        "spindle.power",
        "power of the spindle, a limit for `leafcut tools speeds`",
        why="unknown: no limit",
        example="7.5 kW",
        unit="W",
        bounds="0 or more",
    ),
    ProfileKey(
        "spindle.torque",
        "torque of the spindle, a limit for `leafcut tools speeds`",
        why="unknown: no limit",
        example="40 N·m",
        unit="N·mm",
        bounds="0 or more",
    ),
    ProfileKey(
        "spindle.max_thrust",
        "maximum thrust of the Z axis, a limit for `leafcut tools speeds`",
        why="unknown: no limit",
        example="5 kN",
        unit="N",
        bounds="0 or more",
    ),
    ProfileKey(
        "spindle.start_time",
        "time until the spindle reaches its speed",
        "0 s",
        "no wait",
        reported=True,
        unit="s",
        bounds="0 or more",
    ),
    ProfileKey(
        "tool_change.automatic",
        "true: the machine changes tools; false: the program pauses for the operator",
        True,
        reported=True,
    ),
    ProfileKey(
        "tool_change.preselect",
        "true: drilling programs name the next tool after each change (T without M6), so that the magazine is ready",
        False,
    ),
    ProfileKey("tool_change.optional_stop", "true: drilling programs stop (M1) before each change", False),
    ProfileKey(
        "tool_change.time",
        "duration of a tool change",
        "10 s",
        "estimate: between a carousel and a manual change",
        reported=True,
        unit="s",
        bounds="0 or more",
    ),
    ProfileKey(
        "tool_change.position",
        "machine coordinates x, y of tool changes",
        why="the current position",
        example=["0 mm", "0 mm"],
        unit="mm",
        size=2,
    ),
    ProfileKey(
        "probe.feed",
        "feed rate of the torch while probing the sheet; required in this table",
        why="without [probe] the torch does not probe",
        example="2 m/min",
        unit="mm/s",
        bounds="above 0 and at most the highest feed",
    ),
    ProfileKey(
        "probe.depth",
        "maximum probing depth below Z0",
        "20 mm",
        "estimate: more than the deflection of a sheet",
        unit="mm",
        bounds="above the switch offset",
    ),
    ProfileKey(
        "probe.switch_offset",
        "travel of Z from contact until the switch trips",
        "0 mm",
        "the tip itself is the switch",
        unit="mm",
        bounds="0 or more, below the depth",
    ),
)

#: The tables of a profile in order, with the keys of each; "" is the top level.
KEYS: dict[str, tuple[str, ...]] = {
    table: tuple(key.key for key in PROFILE_KEYS if key.table == table)
    for table in dict.fromkeys(key.table for key in PROFILE_KEYS)
}

#: Keys and tables of the top level.
TOP_KEYS: tuple[str, ...] = (*KEYS[""], *(table for table in KEYS if table), "sources")

#: Keys of `[sources]`: every value that is a fact about the machine.
SOURCE_KEYS: tuple[str, ...] = tuple(key.name for key in PROFILE_KEYS if key.name not in ("name", "description"))


def fill_in_defaults(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Fill in the defaults of a profile. A missing table [probe] stays missing.

    Returns
    -------
    dict
        The profile with defaults.
    dict
        Value and source of each default that a run must report, by key.
    """
    filled = {name: dict(value) if isinstance(value, Mapping) else value for name, value in data.items()}
    reported_defaults: dict[str, str] = {}
    for key in PROFILE_KEYS:
        if key.default is None or (key.table == "probe" and "probe" not in data):
            continue
        table = filled.setdefault(key.table, {}) if key.table else filled
        if isinstance(table, dict) and key.key not in table:
            table[key.key] = key.default
            if key.reported:
                reported_defaults[key.name] = key.default_text
    return filled, reported_defaults


def profile_template(data: Mapping[str, Any], name: str) -> str:
    """Write a profile as TOML with an explanation of every key.

    Missing keys appear as comments with their default or an example, so the text describes the same machine as the
    profile.
    """
    lines = [
        f"# Machine profile {name}: save it as my.toml, change it, and run with --machine my.toml.",
        "# Lengths, speeds, accelerations and times are texts with a unit; lists are x, y and z.",
        "# A line such as '# key = value' is a key that is not set: the value is its default, or an example.",
        MACHINE.toml_line,
    ]
    for table in KEYS:
        values = data.get(table, {}) if table else data
        lines.append("")
        if table:
            lines.append(f"[{table}]" if table in data or table != "probe" else f"# [{table}]")
        for key in (key for key in PROFILE_KEYS if key.table == table):
            lines.extend(_template_lines(key, values, name if key.name == "name" else None))
    sources = data.get("sources", {})
    if sources:
        lines += ["", "# Source of each value; estimates are marked", "[sources]"]
        lines += [f"{json.dumps(key)} = {toml_value(source)}" for key, source in sources.items()]
    return "\n".join(lines) + "\n"


def _template_lines(key: ProfileKey, values: Mapping[str, Any], name: str | None) -> Iterator[str]:
    fallback = "required" if key.required else f"otherwise {key.why}" if key.default is None else ""
    fallback = fallback or f"otherwise {key.default_text}"
    yield f"# {key.help}; {fallback}"
    if key.key in values:
        yield f"{key.key} = {toml_value(values[key.key])}"
        return
    value = key.default if key.default is not None else key.example if key.example is not None else name
    if value is not None:
        yield f"# {key.key} = {toml_value(value)}"


def toml_value(value: Any) -> str:
    """Format a string, a number, a bool, or a list of these as TOML."""
    # TOML escapes strings like JSON; both allow characters beyond ASCII.
    return json.dumps(value, ensure_ascii=False)
