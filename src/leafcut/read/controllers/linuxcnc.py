"""Import the settings of LinuxCNC from the INI file of a machine and the files that it includes.

Source: LinuxCNC 2.9, "INI Configuration" (sections EMC, DISPLAY, RS274NGC, KINS, TRAJ, AXIS_letter, JOINT_num,
SPINDLE_num, EMCIO; ``#INCLUDE``). Configurations before 2.8 have axis limits in ``[AXIS_0]`` and following sections.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from leafcut.errors import printable
from leafcut.model.kinds import Head
from leafcut.read.controllers.ini_text import Entry, Ini, read_ini
from leafcut.read.controllers.values import Axes, Values, parse_leading_number

#: Limits beyond this mean unlimited, in machine units; LinuxCNC's default is 1e99.
_NO_LIMIT = 1e6
#: Default of ARC_BLEND_KINK_RATIO: share of the acceleration reserved for corners.
_KINK_RATIO = 0.1
_UNITS = {"mm": "mm", "metric": "mm", "in": "in", "inch": "in", "imperial": "in"}
_QTPLASMAC, _PLASMA = re.compile(r"plasmac", re.IGNORECASE), re.compile(r"plasma", re.IGNORECASE)
#: Entries that may name a plasma table: key and section.
_NAMES = (
    ("DISPLAY", "DISPLAY"), ("MACHINE", "EMC"), ("PYVCP", "DISPLAY"), ("EMBED_TAB_COMMAND", "DISPLAY"),
    ("HALFILE", "HAL"), ("PARAMETER_FILE", "RS274NGC"),
)  # fmt: skip


def import_linuxcnc(text: str, file: str, units: str | None = None) -> Values:
    """Import the INI file of a LinuxCNC machine.

    `units` (mm or in) applies only if the file does not state its units.

    Raises
    ------
    ReadError
        An axis, the units, a velocity or an acceleration is missing, or a value is implausible or not a number. The
        error is also raised if an included file cannot be read or lies outside the folder.
    """
    ini = read_ini(text, file, include=True)
    values = Values(file, "LinuxCNC")
    reader = _Reader(
        ini,
        values,
        _resolve_units(ini, values, units),
        _axis_letters_of_joints(ini, values),
        _has_trivial_kinematics(ini),
    )
    name = ini.get("MACHINE", "EMC")
    if name is not None and name.text:
        values.take("name", printable(name.text, 40), f"[EMC]MACHINE, {name.place}")
    reader.store_motion()
    reader.store_travel()
    reader.store_process()
    reader.store_spindle()
    reader.store_tool_change()
    return values


def _resolve_units(ini: Ini, values: Values, given: str | None) -> str:
    entry = ini.get("LINEAR_UNITS", "TRAJ")
    if entry is None:
        if given is None:
            raise values.refusal("[TRAJ] has no LINEAR_UNITS, so its lengths may be mm or inches; set --units")
        values.assume("units", given, "--units; the file does not state it")
        return given
    word = entry.text.split()[0].lower() if entry.text.split() else ""
    unit = _UNITS.get(word)
    if unit is None and re.fullmatch(r"[0-9.]+", word):
        unit = "mm" if float(word or 0) == 1.0 else "in" if abs(float(word) - 1 / 25.4) < 1e-4 else None
    if unit is None:
        raise values.refusal(f"LINEAR_UNITS is '{printable(entry.text, 20)}', but must be mm or inch ({entry.place})")
    if given not in (None, unit):
        raise values.refusal(f"its LINEAR_UNITS are {unit} ({entry.place}), not {given}; leave --units out")
    values.take("units", unit, f"[TRAJ]LINEAR_UNITS, {entry.place}")
    return unit


def _axis_letters_of_joints(ini: Ini, values: Values) -> str:
    kinematics = ini.get("KINEMATICS", "KINS")
    text = kinematics.text.lower() if kinematics else "trivkins"
    if kinematics is not None and not _has_trivial_kinematics(ini):
        values.note(
            f"its kinematics are {printable(kinematics.text, 40)} ({kinematics.place}): the joints and "
            "the axes have different limits, so times are estimates"
        )
    match = re.search(r"coordinates\s*=\s*([a-z]+)", text)
    coordinates = ini.get("COORDINATES", "TRAJ")
    letters = match[1] if match else re.sub(r"[^a-z]", "", coordinates.text.lower()) if coordinates else "xyz"
    missing = [axis for axis in "xyz" if axis not in letters]
    if missing:
        raise values.refusal(f"has no axis {', '.join(missing)}, but leafcut's machines have x, y and z")
    return letters


def _has_trivial_kinematics(ini: Ini) -> bool:
    kinematics = ini.get("KINEMATICS", "KINS")
    return kinematics is None or kinematics.text.lower().startswith("trivkins")


@dataclass
class _Reader:
    ini: Ini
    values: Values
    units: str
    joints: str
    trivial: bool

    def store_motion(self) -> None:
        """Store the velocities and accelerations of the axes. The limits of the path also apply to each axis."""
        limits = []
        for key, name, unit in (("MAX_VELOCITY", "VELOCITY", "s"), ("MAX_ACCELERATION", "ACCELERATION", "s2")):
            axis_values = [self._required_number(key, axis) for axis in "xyz"]
            numbers = [value for value, _ in axis_values]
            source = _source_text([place for _, place in axis_values], key)
            path_limit = self.ini.get(f"MAX_LINEAR_{name}", "TRAJ") or self.ini.get(key, "TRAJ")
            bound = math.inf if path_limit is None else self._parse_number(path_limit, f"[TRAJ]MAX_LINEAR_{name}")
            if path_limit is not None and bound <= 0:
                raise self.values.refusal(
                    f"[TRAJ]MAX_LINEAR_{name} is {bound:g}, but must be above 0 ({path_limit.place})"
                )
            clipped = [min(value, bound) for value in numbers]
            if path_limit is not None and clipped != numbers:
                source += f"; at most [TRAJ]MAX_LINEAR_{name}, {path_limit.place}"
            limits.append(Axes(tuple(clipped), f"{self.units}/{unit}", source, derived=clipped != numbers))
        self.values.store_motion(*limits)
        ratio = self.ini.get("ARC_BLEND_KINK_RATIO", "TRAJ")
        blend_ratio = _KINK_RATIO if ratio is None else self._parse_number(ratio, "[TRAJ]ARC_BLEND_KINK_RATIO")
        if not 0 <= blend_ratio < 1:
            raise self.values.refusal(
                f"[TRAJ]ARC_BLEND_KINK_RATIO is {blend_ratio:g}, but must be 0 or more, and below 1"
            )
        origin = "LinuxCNC's default" if ratio is None else ratio.place
        self.values.derive(
            "acceleration_factor", round(1.0 - blend_ratio, 6), f"1 - [TRAJ]ARC_BLEND_KINK_RATIO, {origin}"
        )
        self.values.derive("rapid.style", "linear", "LinuxCNC moves all axes together on a straight line")
        self.values.derive("corners.style", "linuxcnc", "LinuxCNC's own planner")

    def store_travel(self) -> None:
        limits = []
        for key, unlimited in (("MIN_LIMIT", -math.inf), ("MAX_LIMIT", math.inf)):
            numbers, sources = [], []
            for axis in "xyz":
                entry = self._entry(key, axis)
                value = unlimited if entry is None else self._parse_number(entry[0], f"{entry[1]}{key}")
                numbers.append(unlimited if abs(value) >= _NO_LIMIT else value)
                sources += [] if entry is None else [f"{entry[1]} {entry[0].place}"]
            limits.append(Axes(tuple(numbers), self.units, _source_text(sources, key)))
        if any(math.isfinite(value) for limit in limits for value in limit.numbers):
            self.values.store_travel(*limits)
        else:
            self.values.note("the file has no MIN_LIMIT and MAX_LIMIT: the travel is not checked")
        homes, sources = [], []
        for axis in "xyz":
            joint_section, axis_section = f"JOINT_{self.joints.index(axis)}", f"AXIS_{'xyz'.index(axis)}"
            home = self.ini.get("HOME", joint_section, axis_section)
            section = joint_section if self.ini.get("HOME", joint_section) is not None else axis_section
            homes.append(0.0 if home is None else self._parse_number(home, f"[{section}]HOME"))
            sources += [] if home is None else [f"[{section}] {home.place}"]
        source = _source_text(sources, "HOME") if sources else "LinuxCNC's default of HOME"
        self.values.store_home(Axes(tuple(homes), self.units, source, assumed=not sources))

    def store_process(self) -> None:
        """Store the process: a plasma torch if an entry or a section mentions a torch, otherwise a spindle."""
        names = [entry for entry in (self.ini.get(*place) for place in _NAMES) if entry is not None]
        qtplasmac = next((entry for entry in names[:2] if _QTPLASMAC.search(entry.text)), None)
        if "QTPLASMAC" in self.ini.sections or "PLASMAC" in self.ini.sections or qtplasmac is not None:
            origin = qtplasmac.place if qtplasmac is not None else "its section"
            self.values.derive("controller", "qtplasmac", f"the file is set up for QtPlasmaC, {origin}")
            self.values.store_process(Head.TORCH, f"QtPlasmaC, {origin}")
            return
        plasma = next((entry for entry in names if _PLASMA.search(entry.text)), None)
        if "PLASMA" in self.ini.sections or plasma is not None:
            origin = plasma.place if plasma is not None else "its section [PLASMA]"
            self.values.derive("controller", "plasma", f"the file names plasma, {origin}")
            self.values.store_process(Head.TORCH, f"plasma, {origin}")
            return
        self.values.derive("controller", "linuxcnc", "the file is one of LinuxCNC")
        self.values.assume("process", Head.SPINDLE.value, "the file does not state the process")

    def store_spindle(self) -> None:
        settings = (
            ("MAX_FORWARD_VELOCITY", "SPINDLE_0"),
            ("MAX_VELOCITY", "SPINDLE_0"),
            ("MAX_SPINDLE_SPEED", "DISPLAY"),
            ("MAX_SPINDLE_0_SPEED", "DISPLAY"),
        )
        for key, section in settings:
            entry = self.ini.get(key, section)
            if entry is None:
                continue
            lowest = self.ini.get(key.replace("MAX", "MIN"), section)
            slowest = 0.0 if lowest is None else self._parse_number(lowest, f"[{section}]{key.replace('MAX', 'MIN')}")
            highest = self._parse_number(entry, f"[{section}]{key}")
            self.values.store_spindle_range(highest, max(slowest, 0.0), f"[{section}]{key}, {entry.place}")
            break
        if self.values.entries["controller"].value == "linuxcnc":
            self.values.assume_spindle_start()

    def store_tool_change(self) -> None:
        random = self.ini.get("RANDOM_TOOLCHANGER", "EMCIO")
        if random is not None and random.text.strip().lower() in ("1", "yes", "true"):
            origin = f"[EMCIO]RANDOM_TOOLCHANGER, {random.place}"
            self.values.derive("tool_change.automatic", True, origin)
            self.values.assume("tool_change.time", "10 s", "between a carousel and a manual change")
        else:
            self.values.store_manual_tool_changes("LinuxCNC's HAL files decide, which are not read")
        entry = self.ini.get("TOOL_CHANGE_POSITION", "EMCIO")
        if entry is not None:
            texts = entry.text.split()
            if len(texts) < 2:
                raise self.values.refusal(
                    f"TOOL_CHANGE_POSITION is '{printable(entry.text, 30)}', but must be x, y and z ({entry.place})"
                )
            position = [
                parse_leading_number(self.values, text, f"[EMCIO]TOOL_CHANGE_POSITION ({entry.place})")
                for text in texts[:2]
            ]
            written = [f"{coordinate:.10g} {self.units}" for coordinate in position]
            self.values.take("tool_change.position", written, f"[EMCIO]TOOL_CHANGE_POSITION, {entry.place}")

    def _entry(self, key: str, axis: str) -> tuple[Entry, str] | None:
        letter, old, joint = f"AXIS_{axis.upper()}", f"AXIS_{'xyz'.index(axis)}", f"JOINT_{self.joints.index(axis)}"
        for section in (letter, joint, old) if self.trivial else (letter,):
            entry = self.ini.get(key, section)
            if entry is not None:
                return entry, f"[{section}]"
        return None

    def _required_number(self, key: str, axis: str) -> tuple[float, str]:
        entry = self._entry(key, axis)
        if entry is None:
            sections = f"[AXIS_{axis.upper()}]" + (f" or [JOINT_{self.joints.index(axis)}]" if self.trivial else "")
            raise self.values.refusal(f"has no {key} in {sections}; is the file complete?")
        return self._parse_number(entry[0], f"{entry[1]}{key}"), f"{entry[1]} {entry[0].place}"

    def _parse_number(self, entry: Entry, label: str) -> float:
        return parse_leading_number(self.values, entry.text, f"{label} ({entry.place})")


def _source_text(sources: list[str], key: str) -> str:
    return f"{key} of {', '.join(sources)}"
