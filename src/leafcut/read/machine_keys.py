"""The keys of a machine profile: what each means and what is taken where a profile does not say it.

Profiles are checked, completed, written out as templates and documented (`docs/make_reference.py`) from this one table.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.kinds import Head

RAPID_STYLES = ("linear", "dogleg")
CORNERS = ("linuxcnc", "grbl", "round")


@dataclass(frozen=True)
class ProfileKey:
    """One key of a profile.

    Attributes
    ----------
    name
        ``key``, or ``table.key``.
    help
        What it means, in a line.
    default
        What is taken where the profile does not say it, as it would stand there; None where there is nothing to take.
    why
        Where the default comes from, or what holds in its place.
    example
        What a template shows of a key without a default.
    required
        No profile is complete without it.
    told
        Whoever runs with the default is told so: time, or what is refused, hangs on it.
    """

    name: str
    help: str
    default: Any = None
    why: str = ""
    example: Any = None
    required: bool = False
    told: bool = False

    @property
    def table(self) -> str:
        """The table that it stands in, empty for the top."""
        return self.name.rpartition(".")[0]

    @property
    def key(self) -> str:
        """Its name in its table."""
        return self.name.rpartition(".")[2]

    @property
    def shown_default(self) -> str:
        """The default, and where it comes from, in words."""
        value = "" if self.default is None else toml_value(self.default)
        return f"{value} ({self.why})" if value and self.why else value or self.why


_ZEROS = ["0 mm", "0 mm", "0 mm"]

PROFILE_KEYS: tuple[ProfileKey, ...] = (
    ProfileKey("name", "what the machine is called", why="the name of the file"),
    ProfileKey("description", "what it is, in a line", why="its name"),
    ProfileKey(
        "controller", "dialect of its programs: linuxcnc, haas, fanuc, grbl … as --dialect has them", required=True
    ),
    ProfileKey(
        "process", f"what it works with: {', '.join(Head)}", Head.SPINDLE.value, "most machines have one", told=True
    ),
    ProfileKey("units", "units of a program that does not say them: mm, in", "mm", "the controllers' own default"),
    ProfileKey("max_feed", "highest programmed feed", why="the slower of the rapids of x and y", told=True),
    ProfileKey(
        "acceleration_factor",
        "part of the acceleration that moves from rest to rest use, above 0 and at most 1",
        1.0,
        "all of it; LinuxCNC keeps 10 % back",
    ),
    ProfileKey("home", "machine coordinates where it waits before and after a program", _ZEROS, "machine zero"),
    ProfileKey(
        "work_offset",
        "program zero in machine coordinates",
        why="not known: only the size of a job is checked against the travel; --work-offset says it for one run",
        example=["-400 mm", "-200 mm", "-300 mm"],
    ),
    ProfileKey(
        "safe_z",
        "machine coordinate z that is safe for tool changes and the end",
        why="the clearance height of the program",
        example="0 mm",
    ),
    ProfileKey(
        "nozzle_diameter",
        "how wide the nozzle of a cutting head is, for a head that stays down: ways keep off parts that are cut free",
        "0 mm",
        "not known: only its middle is counted",
    ),
    ProfileKey(
        "rapid.style",
        "linear: all axes arrive together; dogleg: each axis at its own speed",
        "linear",
        "LinuxCNC, GRBL and Mach move so",
        told=True,
    ),
    ProfileKey("rapid.velocity", "of rapids, one for all axes or a list of three", required=True),
    ProfileKey(
        "rapid.acceleration",
        "one for all axes or a list of three",
        "500 mm/s2",
        "estimate: between a hobby router and a machining centre",
        told=True,
    ),
    ProfileKey(
        "corners.style",
        f"how feed moves take corners: {', '.join(CORNERS)}",
        why="as the controllers of that name do, and round for the others",
        example="round",
    ),
    ProfileKey(
        "corners.deviation", "how far a corner may be cut short, where it is grbl or round", "0.01 mm", "GRBL's own $11"
    ),
    ProfileKey("travel.min", "lowest machine coordinates", required=True),
    ProfileKey("travel.max", "highest machine coordinates", required=True),
    ProfileKey("spindle.min_speed", "lowest speed", "0 rpm", "no lower limit"),
    ProfileKey("spindle.max_speed", "highest speed", "10000 rpm", "estimate: a common spindle", told=True),
    ProfileKey("spindle.start_time", "wait until it has its speed", "0 s", "no wait", told=True),
    ProfileKey(
        "tool_change.automatic", "true: by itself; false: a person does it, and the program pauses", True, told=True
    ),
    ProfileKey("tool_change.time", "of one change", "10 s", "estimate: between a carousel and a hand", told=True),
    ProfileKey(
        "tool_change.position",
        "machine coordinates x, y where tools are changed",
        why="where the tool is",
        example=["0 mm", "0 mm"],
    ),
    ProfileKey(
        "probe.feed",
        "of a torch that finds the sheet by touching it; required in this table",
        why="without [probe] the torch does not touch off",
        example="2 m/min",
    ),
    ProfileKey(
        "probe.depth", "how far below Z0 it goes at most", "20 mm", "estimate: more than a bent sheet gives way"
    ),
    ProfileKey(
        "probe.switch_offset", "how far Z goes on between touch and switch", "0 mm", "the tip itself is the contact"
    ),
)

#: Tables of a profile, in their order, and the keys of each; "" holds those at its top.
KEYS: dict[str, tuple[str, ...]] = {
    table: tuple(key.key for key in PROFILE_KEYS if key.table == table)
    for table in dict.fromkeys(key.table for key in PROFILE_KEYS)
}

#: What may stand at its top.
TOP_KEYS: tuple[str, ...] = (*KEYS[""], *(table for table in KEYS if table), "sources")

#: What a profile may give a source for: every value that is a fact of the machine.
SOURCE_KEYS: tuple[str, ...] = tuple(key.name for key in PROFILE_KEYS if key.name not in ("name", "description"))


def with_defaults(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a profile with the defaults that are no more than a value put in, and what has to be told of these.

    What is told is name of the key → value and where it comes from. A table [probe] that is not there stays so.
    """
    filled = {name: dict(value) if isinstance(value, Mapping) else value for name, value in data.items()}
    told: dict[str, str] = {}
    for key in PROFILE_KEYS:
        if key.default is None or (key.table == "probe" and "probe" not in data):
            continue
        table = filled.setdefault(key.table, {}) if key.table else filled
        if isinstance(table, dict) and key.key not in table:
            table[key.key] = key.default
            if key.told:
                told[key.name] = key.shown_default
    return filled, told


def profile_template(data: Mapping[str, Any], name: str) -> str:
    """Return a profile as a text that explains itself: every key with what it means, and as the profile says it.

    Keys that it does not say stand there as comments with what is taken for them. Read again it is the same machine.
    """
    lines = [
        f"# Machine profile {name}: save it as my.toml, change it, and run with --machine my.toml.",
        "# Lengths, speeds, accelerations and times are texts with a unit; lists are x, y and z.",
        "# A key behind # is not said: what stands there is what holds, or an example where nothing does.",
    ]
    for table, keys in _by_table().items():
        there = data.get(table, {}) if table else data
        lines.append("")
        if table:
            lines.append(f"[{table}]" if table in data or table != "probe" else f"# [{table}]")
        for key in keys:
            lines.extend(_template_lines(key, there, name if key.name == "name" else None))
    sources = data.get("sources", {})
    if sources:
        lines += ["", "# Where each value comes from; an estimate says so", "[sources]"]
        lines += [f"{json.dumps(key)} = {toml_value(words)}" for key, words in sources.items()]
    return "\n".join(lines) + "\n"


def _template_lines(key: ProfileKey, there: Mapping[str, Any], name: str | None) -> Iterator[str]:
    said = "required" if key.required else f"otherwise {key.why}" if key.default is None else ""
    said = said or f"otherwise {key.shown_default}"
    yield f"# {key.help}; {said}"
    if key.key in there:
        yield f"{key.key} = {toml_value(there[key.key])}"
        return
    value = key.default if key.default is not None else key.example if key.example is not None else name
    if value is not None:
        yield f"# {key.key} = {toml_value(value)}"


def _by_table() -> dict[str, list[ProfileKey]]:
    return {table: [key for key in PROFILE_KEYS if key.table == table] for table in KEYS}


def toml_value(value: Any) -> str:
    """Return a text, a number, true or false, or a list of these as TOML has it."""
    # What JSON escapes in a text TOML escapes in the same way; of letters beyond ASCII neither needs to.
    return json.dumps(value, ensure_ascii=False)
