"""Import the settings of Marlin and RepRapFirmware.

Marlin's settings come from the reply to ``M503``. RepRapFirmware on Duet boards keeps its settings in ``config.g``.
Both use the same commands with different units: M203 is in mm/s in Marlin, and in mm/min in RepRapFirmware.

Source: Marlin's G-code reference (M201, M203, M204, M205, M211, M503) and Configuration.h (junction deviation
equivalent to a jerk: 0.4 jerk² / acceleration); Duet3D's G-code dictionary (M201, M203, M208, M550, M566, M669, M950).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from leafcut.errors import printable
from leafcut.model.kinds import Head
from leafcut.read.controllers.values import (
    Axes,
    Values,
    format_axes,
    format_line_numbers,
    parse_leading_number,
)

#: Maximum length of a line, characters. The rest of a longer line is ignored.
LONGEST_LINE = 1000
#: A settings line, optionally after a prefix written by the terminal or the firmware.
LINE = re.compile(
    r"^(?:.{0,100}?\becho:|(?:(?:Recv|Received|<<<|READ|SENT|>>>|>)[:\s]*)?)\s*([GM]\d{1,4}(?:\.\d)?)\b(.*)$",
    re.IGNORECASE,
)
_WORD = re.compile(r"([A-Za-z])\s*(\"[^\"]*\"|\{[^}]*\}|[-+.0-9:eE]+)?")
_ENDSTOPS = re.compile(
    r"Min:\s*X([-\d.]+)\s*Y([-\d.]+)\s*Z([-\d.]+).{0,200}?Max:\s*X([-\d.]+)\s*Y([-\d.]+)\s*Z([-\d.]+)", re.DOTALL
)
#: Factor f = (1 - s) / s ≈ 0.41 with s = sin 45°: the junction deviation f jerk² / a allows the same speed at a 90°
#: corner as the jerk.
_JERK_FACTOR = (1.0 - math.sqrt(0.5)) / math.sqrt(0.5)


@dataclass(frozen=True)
class _Source:
    line: int
    file: str = ""


@dataclass(frozen=True)
class _Line:
    place: _Source
    word: str
    letters: dict[str, str]


#: A numeric variable of RepRapFirmware: ``global xMax = 335``, ``set var.steps = 90``.
_VARIABLE = re.compile(r"^\s*(global|var|set\s+global|set\s+var)(?:\s+|\.)(\w{1,60})\s*=\s*\{?([-+.0-9]{1,30})\}?\s*$")
_VARIABLE_USE = re.compile(r"\{\s*(global|var)\.(\w{1,60})\s*\}")
_CONDITION = re.compile(r"^\s*(if|elif|while)\b")
#: Limits for files that a config.g runs (M98): number of files, nesting depth, and bytes per file.
_MOST_RUN, _DEEPEST_RUN, _MOST_BYTES_RUN = 100, 8, 262_144


@dataclass
class _Settings:
    words: dict[str, dict[str, tuple[str, _Source]]] = field(default_factory=dict)
    inch: _Source | None = None


def import_marlin(text: str, file: str) -> Values:
    """Import the reply of Marlin to M503.

    Raises
    ------
    ReadError
        M203 or M201 is missing or lacks an axis, or a value is implausible or not a number.
    """
    settings = _collect_settings(_parse_lines(text))
    values = Values(file, "Marlin")
    unit = "in" if settings.inch else "mm"
    values.store_controller("marlin", "the file is one of Marlin", "grbl")
    if settings.inch:
        values.take("units", "in", f"G20, {_sources_text([settings.inch])}")
    rates = _axis_settings(values, settings, "M203", f"{unit}/s", "highest rates")
    values.store_motion(rates, _marlin_acceleration(values, settings, unit))
    endstops = _ENDSTOPS.search(text)
    if endstops is not None:
        limits = [parse_leading_number(values, limit, "a soft endstop") for limit in endstops.groups()]
        line = text.count("\n", 0, endstops.start()) + 1
        source = f"soft endstops (M211), {format_line_numbers([line])}"
        values.store_travel(Axes(tuple(limits[:3]), unit, source), Axes(tuple(limits[3:]), unit, source))
    else:
        values.note("M503 does not report the travel (M211 does): it is not checked")
    _store_zero_home(values)
    jerk = settings.words.get("M205", {})
    if "J" in jerk:
        deviation, place = jerk["J"]
        found_deviation = _parse_setting_number(values, deviation, "M205 J", place)
        if not found_deviation > 0:
            raise values.refusal(f"M205 J is {found_deviation:g}, but must be above 0", place.line)
        values.derive("corners.style", "grbl", "Marlin plans by junction deviation, as GRBL does")
        values.take("corners.deviation", f"{found_deviation:.10g} {unit}", f"M205 J, {_sources_text([place])}")
    elif "X" in jerk:
        _store_jerk_corners(values, _first_motor_value(values, jerk["X"], "M205 X"), jerk["X"][1], unit, "M205 X")
    else:
        values.assume("corners.style", "grbl", "the file has no M205")
    _store_steps(values, settings, unit)
    _store_common_values(values, "Marlin")
    return values


def _marlin_acceleration(values: Values, settings: _Settings, unit: str) -> Axes:
    """Return the acceleration from M204 T (S in old versions), capped at the limits of the axes (M201)."""
    limits = _axis_settings(values, settings, "M201", f"{unit}/s2", "highest accelerations")
    path = settings.words.get("M204", {})
    letter = next((candidate for candidate in "TSP" if candidate in path), None)
    if letter is None:
        return limits
    text, place = path[letter]
    travel = _parse_setting_number(values, text, f"M204 {letter}", place)
    if not travel > 0:
        raise values.refusal(f"M204 {letter} is {travel:g}, but must be above 0", place.line)
    source = f"M204 {letter}, {_sources_text([place])}, at most {limits.source}"
    return Axes(tuple(min(travel, value) for value in limits.numbers), limits.unit, source, derived=True)


def import_rrf(text: str, file: str) -> Values:
    """Import the ``config.g`` of RepRapFirmware, and the files in its folder that it runs (M98).

    Raises
    ------
    ReadError
        M203 or M201 is missing or lacks an axis, a value is an expression, implausible, or not a number, or config.g
        runs too many files.
    """
    values = Values(file, "RepRapFirmware")
    lines = _MacroExpander(Path(file), values).collect_lines(text)
    settings = _collect_settings(lines)
    unit = "in" if settings.inch else "mm"
    name = settings.words.get("M550", {}).get("P")
    if name is not None and name[0].strip('" '):
        values.take("name", printable(name[0].strip('"'), 40), f"M550, {_sources_text([name[1]])}")
    laser = "M452" in settings.words
    if laser:
        reason = "leafcut has no dialect of RepRapFirmware's laser mode; this is the nearest"
        values.assume("controller", "grbl-laser", reason)
    else:
        values.store_controller("rrf", "the file is one of RepRapFirmware", "grbl")
    if settings.inch:
        values.take("units", "in", f"G20, {_sources_text([settings.inch])}")
    rates = _axis_settings(values, settings, "M203", f"{unit}/min", "highest speeds")
    acceleration = _axis_settings(values, settings, "M201", f"{unit}/s2", "highest accelerations")
    values.store_motion(rates, acceleration)
    _store_rrf_home(values, lines, _store_rrf_travel(values, lines, unit), unit)
    jerk = settings.words.get("M566", {})
    if "X" in jerk:
        _store_jerk_corners(
            values, _first_motor_value(values, jerk["X"], "M566 X") / 60.0, jerk["X"][1], unit, "M566 X"
        )
    else:
        values.assume("corners.style", "grbl", "the file has no M566")
    _store_steps(values, settings, unit)
    kinematics = settings.words.get("M669", {}).get("K")
    if "M665" in settings.words or (kinematics is not None and kinematics[0].strip() != "0"):
        values.note("its kinematics are not Cartesian (M669, M665), so times are estimates")
    _store_rrf_spindle(values, lines)
    _store_common_values(values, "RepRapFirmware", laser=laser)
    return values


def _store_rrf_spindle(values: Values, lines: list[_Line]) -> None:
    """Store the spindle speeds from M950 R0, such as ``L24000`` or ``L6000:24000``."""
    for line in lines:
        if line.word == "M950" and "R" in line.letters and line.letters.get("L"):
            speeds = [
                _parse_setting_number(values, part, "M950 L", line.place) for part in line.letters["L"].split(":")
            ]
            slowest = min(speeds) if len(speeds) > 1 else 0.0
            values.store_spindle_range(max(speeds), slowest, f"M950 L, {_sources_text([line.place])}")


def _store_rrf_travel(values: Values, lines: list[_Line], unit: str) -> dict[str, list[float]]:
    """Store the travel from M208, and return the limits of each axis.

    M208 has either the form ``X0:200``, or the maximum with S0 and the minimum with S1.
    """
    ends: dict[str, list[float]] = {axis: [-math.inf, math.inf] for axis in "XYZ"}
    entries = [(line, axis) for line in lines if line.word == "M208" for axis in "XYZ" if axis in line.letters]
    plain = [(line, axis) for line, axis in entries if "{" not in line.letters[axis]]
    for line, axis in plain:
        numbers = [
            _parse_setting_number(values, part, f"M208 {axis}", line.place)
            for part in line.letters[axis].split(":")[:2]
        ]
        if len(numbers) == 2:
            ends[axis] = numbers
        elif line.letters.get("S", "").strip() == "1":
            ends[axis][0] = numbers[0]
        else:
            # RepRapFirmware's default of the lower limit is 0.
            ends[axis] = [0.0 if ends[axis][0] == -math.inf else ends[axis][0], numbers[0]]
    for axis in "XYZ":
        if not math.isfinite(ends[axis][1]):
            ends[axis] = [-math.inf, math.inf]
    if plain != entries:
        values.note("M208 has expressions, which are not evaluated: write the travel of those axes into the profile")
    elif not entries:
        values.note("the file has no M208: the travel is not checked")
    if plain:
        source = f"M208, {_sources_text(line.place for line, _ in plain)}"
        low, high = (tuple(ends[axis][k] for axis in "XYZ") for k in (0, 1))
        values.store_travel(Axes(low, unit, source), Axes(high, unit, source))
    return ends


def _store_rrf_home(values: Values, lines: list[_Line], ends: dict[str, list[float]], unit: str) -> None:
    """Store the home position from M574.

    The value 1 means the lower end of the axis and 2 the upper end, as set by M208. An axis that homes with a probe
    (S2) has no home position.
    """
    homes, positions = dict.fromkeys("XYZ", 0.0), []
    for line in lines:
        if line.word != "M574" or line.letters.get("S", "").strip() == "2":
            continue
        for axis in "XYZ":
            end = {"1": 0, "2": 1}.get(line.letters.get(axis, "").strip())
            if end is not None and math.isfinite(ends[axis][end]):
                homes[axis] = ends[axis][end]
                positions.append(line.place)
    if not positions:
        _store_zero_home(values)
        return
    source = f"M574, {_sources_text(positions)}: the ends with its limit switches, with the values of M208"
    values.store_home(Axes(tuple(homes.values()), unit, source, derived=True))


def _store_steps(values: Values, settings: _Settings, unit: str) -> None:
    letters = settings.words.get("M92", {})
    if unit == "mm" and all(axis in letters and not letters[axis][0].startswith("{") for axis in "XYZ"):
        steps = [_first_motor_value(values, letters[axis], f"M92 {axis}") for axis in "XYZ"]
        if all(step > 0 for step in steps):
            source = _sources_text(letters[axis][1] for axis in "XYZ")
            values.take("motors.steps_per_mm", format_axes(steps, "steps/mm"), f"M92, {source}")


def _store_jerk_corners(values: Values, jerk: float, place: _Source, unit: str, label: str) -> None:
    """Convert the jerk to a junction deviation that allows the same speed at a 90° corner, and store it."""
    acceleration = values.entries["rapid.acceleration"].value
    text = acceleration if isinstance(acceleration, str) else acceleration[0]
    axis_acceleration = parse_leading_number(values, text, "rapid.acceleration")
    if not jerk > 0:
        raise values.refusal(f"{label} is {jerk:g}, but must be above 0", place.line)
    deviation = _JERK_FACTOR * jerk * jerk / axis_acceleration
    values.derive("corners.style", "grbl", f"corners by jerk ({label}) as corners by junction deviation")
    values.derive(
        "corners.deviation",
        f"{deviation:.4g} {unit}",
        f"0.41 × jerk² ÷ acceleration, which takes a corner of 90° as fast; {label}, {_sources_text([place])}",
    )


def _store_zero_home(values: Values) -> None:
    values.store_home(Axes((0.0, 0.0, 0.0), "mm", "the file does not state the end of homing", assumed=True))


def _store_common_values(values: Values, name: str, laser: bool = False) -> None:
    values.derive("rapid.style", "linear", f"{name} moves all axes together on a straight line")
    if laser:
        values.store_process(Head.LASER, "M452")
    else:
        values.assume("process", Head.SPINDLE.value, "the file does not state the process")
    values.assume_spindle_start(laser)
    values.store_manual_tool_changes("the file does not state how tools are changed")


def _axis_settings(values: Values, settings: _Settings, word: str, unit: str, label: str) -> Axes:
    letters = settings.words.get(word)
    if letters is None:
        raise values.refusal(f"has no {word}, the {label}; is the file complete?")
    missing = [axis for axis in "XYZ" if axis not in letters]
    if missing:
        raise values.refusal(f"{word} has no {' and no '.join(missing)}; is the file complete?")
    # If an axis has several motors (X100:100), the slowest decides.
    numbers = []
    for axis in "XYZ":
        text, place = letters[axis]
        numbers.append(min(_parse_setting_number(values, part, f"{word} {axis}", place) for part in text.split(":")))
    return Axes(tuple(numbers), unit, f"{word}, {_sources_text(letters[axis][1] for axis in 'XYZ')}")


def _parse_setting_number(values: Values, text: str, label: str, place: _Source) -> float:
    if place.file:
        return parse_leading_number(values, text, f"{label} ({place.file}, line {place.line})")
    return parse_leading_number(values, text, label, place.line)


def _first_motor_value(values: Values, entry: tuple[str, _Source], label: str) -> float:
    return _parse_setting_number(values, entry[0].partition(":")[0], label, entry[1])


def _sources_text(positions: Iterable[_Source]) -> str:
    lines_by_file: dict[str, list[int]] = {}
    for place in positions:
        lines_by_file.setdefault(place.file, []).append(place.line)
    return ", ".join(
        f"{file}, {format_line_numbers(lines)}" if file else format_line_numbers(lines)
        for file, lines in lines_by_file.items()
    )


def match_command(line: str) -> re.Match[str] | None:
    """Match the command at the start of a settings line. Return None for other lines."""
    return LINE.match(line[:LONGEST_LINE].partition(";")[0].strip())


def has_rrf_travel(text: str) -> bool:
    """Return whether a text contains RepRapFirmware's M208, which has an axis letter, unlike Marlin's M208."""
    return any(line.word == "M208" and not {"X", "Y", "Z"}.isdisjoint(line.letters) for line in _parse_lines(text))


def _parse_lines(text: str) -> list[_Line]:
    parsed = (_parse_line(line, _Source(count)) for count, line in enumerate(text.splitlines(), 1))
    return [line for line in parsed if line is not None]


def _parse_line(line: str, place: _Source) -> _Line | None:
    match = match_command(line)
    if match is None:
        return None
    letters = {word[1].upper(): word[2] or "" for word in _WORD.finditer(match[2])}
    return _Line(place, match[1].upper(), letters)


def _collect_settings(lines: list[_Line]) -> _Settings:
    settings = _Settings()
    for line in lines:
        if line.word in ("G20", "G21"):
            settings.inch = line.place if line.word == "G20" else None
            continue
        letters = {letter: (value, line.place) for letter, value in line.letters.items()}
        settings.words.setdefault(line.word, {}).update(letters)
    return settings


@dataclass
class _MacroExpander:
    """Collects the lines of a config.g, and of the files that it runs with M98, in the order of execution.

    It does not evaluate conditions.
    """

    root: Path
    values: Values
    variables: dict[str, str] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    run: int = 0
    conditions: bool = False

    def collect_lines(self, text: str) -> list[_Line]:
        lines = self._parse_text(text, "", 0)
        if self.missing:
            names = ", ".join(dict.fromkeys(self.missing))
            self.values.note(
                f"it runs files that are not in its folder, so their settings are unknown: {printable(names, 80)}"
            )
        if self.conditions:
            self.values.note("it has conditions (if, while): every line was read as if it were executed")
        return lines

    def _parse_text(self, text: str, file: str, depth: int) -> list[_Line]:
        lines: list[_Line] = []
        for count, raw_line in enumerate(text.splitlines(), 1):
            content = raw_line[:LONGEST_LINE].partition(";")[0]
            self.conditions = self.conditions or _CONDITION.match(content) is not None
            variable = _VARIABLE.match(content)
            if variable is not None:
                self.variables[f"{variable[1].split()[-1]}.{variable[2]}"] = variable[3]
                continue
            line = _parse_line(
                _VARIABLE_USE.sub(lambda use: self.variables.get(f"{use[1]}.{use[2]}", use[0]), content),
                _Source(count, file),
            )
            if line is None:
                continue
            if line.word == "M98":
                name = re.search(r"""P\s*["']?([^"'\s]{1,200})""", content, re.IGNORECASE)
                lines += self._lines_of_macro(name[1] if name else "", depth)
            else:
                lines.append(line)
        return lines

    def _lines_of_macro(self, name: str, depth: int) -> list[_Line]:
        """Return the lines of a file that M98 runs. The file must be in the same folder as the config.g (``/sys``)."""
        inner = re.sub(r"^(0:)?/sys/", "", name)
        if not self.root.is_file():  # standard input has no folder
            self.missing.append(name)
            return []
        folder = self.root.parent.resolve()
        path = (folder / inner).resolve()
        if inner.startswith(("/", "\\", "~")) or ":" in inner or path.parent != folder or not path.is_file():
            self.missing.append(name)
            return []
        self.run += 1
        if depth == _DEEPEST_RUN or self.run > _MOST_RUN:
            raise self.values.refusal(
                f"runs '{printable(name, 60)}', one of more than {_MOST_RUN} files or more than {_DEEPEST_RUN} deep; "
                "does a file run itself?"
            )
        try:
            with path.open("rb") as stream:
                data = stream.read(_MOST_BYTES_RUN + 1)
        except OSError as problem:
            raise self.values.refusal(
                f"runs '{printable(name, 60)}', which cannot be read ({problem.strerror})"
            ) from None
        if len(data) > _MOST_BYTES_RUN:
            raise self.values.refusal(f"runs '{printable(name, 60)}', which has more than {_MOST_BYTES_RUN >> 10} KiB")
        return self._parse_text(data.decode("utf-8", "replace"), printable(path.name, 40), depth + 1)
