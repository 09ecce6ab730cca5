"""Marlin (the answer to ``M503``) and RepRapFirmware of Duet boards (``config.g``): the same words in other units.

Source: Marlin's G-code reference (M201, M203, M204, M205, M211, M503) and Configuration.h (a junction deviation that
stands for a jerk: 0.4 jerk² / acceleration); Duet3D's G-code dictionary (M201, M203, M208, M550, M566, M669, M950).
M203 is in mm/s in Marlin, and in mm/min in RepRapFirmware.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from leafcut.errors import shown
from leafcut.kinds import Head
from leafcut.read.controllers.values import SPINDLE_START, Axes, Values, in_lines, number

#: No line of settings is longer; what stands behind that is not looked at.
LONGEST_LINE = 1000
#: A line of settings, behind what a terminal or the firmware writes before it.
LINE = re.compile(
    r"^(?:.{0,100}?\becho:|(?:(?:Recv|Received|<<<|READ|SENT|>>>|>)[:\s]*)?)\s*([GM]\d{1,4}(?:\.\d)?)\b(.*)$",
    re.IGNORECASE,
)
_WORD = re.compile(r"([A-Za-z])\s*(\"[^\"]*\"|\{[^}]*\}|[-+.0-9:eE]+)?")
_ENDSTOPS = re.compile(
    r"Min:\s*X([-\d.]+)\s*Y([-\d.]+)\s*Z([-\d.]+).{0,200}?Max:\s*X([-\d.]+)\s*Y([-\d.]+)\s*Z([-\d.]+)", re.DOTALL
)
#: δ = 0.4 jerk² / a: a corner of 90° is then taken as fast. Exactly (1 - s) / s with s the sine of 45°.
_OF_JERK = (1.0 - math.sqrt(0.5)) / math.sqrt(0.5)


@dataclass
class _Settings:
    """The last value of each letter of each word, and the line it stands in."""

    words: dict[str, dict[str, tuple[str, int]]] = field(default_factory=dict)
    inch: int | None = None


def read_marlin(text: str, file: str) -> Values:
    """Return what Marlin's answer to M503 says.

    Raises
    ------
    ReadError
        M203 or M201 is missing, or lacks an axis; a value is no number, or one that no machine has.
    """
    settings = _settings(text)
    values = Values(file, "Marlin")
    unit = "in" if settings.inch else "mm"
    values.controller("marlin", "the file is one of Marlin", "grbl")
    if unit == "in":
        values.take("units", "in", f"G20, {in_lines([settings.inch or 0])}")
    rates = _axes(values, settings, "M203", f"{unit}/s", "highest rates")
    values.motion(rates, _marlin_acceleration(values, settings, unit))
    found = _ENDSTOPS.search(text)
    if found is not None:
        places = [number(values, one, "a soft endstop") for one in found.groups()]
        line = text.count("\n", 0, found.start()) + 1
        words = f"soft endstops (M211), {in_lines([line])}"
        values.travel(Axes(tuple(places[:3]), unit, words), Axes(tuple(places[3:]), unit, words))
    else:
        values.note("M503 does not tell the travel (M211 does): nothing is checked against it")
    _zero_home(values)
    jerk = settings.words.get("M205", {})
    if "J" in jerk:
        deviation, line = jerk["J"]
        found_deviation = number(values, deviation, "M205 J", line)
        if not found_deviation > 0:
            raise values.refusal(f"M205 J is {found_deviation:g}, but must be above 0", line)
        values.derive("corners.style", "grbl", "Marlin plans by junction deviation, as GRBL does")
        values.take("corners.deviation", f"{found_deviation:.10g} {unit}", f"M205 J, {in_lines([line])}")
    elif "X" in jerk:
        _jerk_corners(values, number(values, *_named(jerk["X"], "M205 X")), jerk["X"][1], unit, "M205 X")
    else:
        values.assume("corners.style", "grbl", "the file has no M205")
    _rest(values, "Marlin")
    return values


def _marlin_acceleration(values: Values, settings: _Settings, unit: str) -> Axes:
    """Of moves without an extruder: M204 T (S of old ones), at most that of each axis."""
    most = _axes(values, settings, "M201", f"{unit}/s2", "highest accelerations")
    path = settings.words.get("M204", {})
    letter = next((one for one in "TSP" if one in path), None)
    if letter is None:
        return most
    text, line = path[letter]
    travel = number(values, text, f"M204 {letter}", line)
    if not travel > 0:
        raise values.refusal(f"M204 {letter} is {travel:g}, but must be above 0", line)
    words = f"M204 {letter}, {in_lines([line])}, at most {most.source}"
    return Axes(tuple(min(travel, one) for one in most.numbers), most.unit, words, derived=True)


def read_rrf(text: str, file: str) -> Values:
    """Return what the ``config.g`` of RepRapFirmware says.

    Raises
    ------
    ReadError
        M203 or M201 is missing, or lacks an axis; a value is an expression, no number, or one that no machine has.
    """
    settings = _settings(text)
    values = Values(file, "RepRapFirmware")
    unit = "in" if settings.inch else "mm"
    name = settings.words.get("M550", {}).get("P")
    if name is not None and name[0].strip('" '):
        values.take("name", shown(name[0].strip('"'), 40), f"M550, {in_lines([name[1]])}")
    values.controller("rrf", "the file is one of RepRapFirmware", "grbl")
    if unit == "in":
        values.take("units", "in", f"G20, {in_lines([settings.inch or 0])}")
    rates = _axes(values, settings, "M203", f"{unit}/min", "highest speeds")
    acceleration = _axes(values, settings, "M201", f"{unit}/s2", "highest accelerations")
    values.motion(rates, acceleration)
    _rrf_travel(values, text, unit)
    _zero_home(values)
    jerk = settings.words.get("M566", {})
    if "X" in jerk:
        value = number(values, *_named(jerk["X"], "M566 X")) / 60.0
        _jerk_corners(values, value, jerk["X"][1], unit, "M566 X")
    else:
        values.assume("corners.style", "grbl", "the file has no M566")
    kinematics = settings.words.get("M669", {}).get("K")
    if "M665" in settings.words or (kinematics is not None and kinematics[0].strip() != "0"):
        values.note("its kinematics are not those of three straight axes (M669, M665): times are estimates")
    _rrf_spindle(values, text)
    _rest(values, "RepRapFirmware", laser="M452" in settings.words)
    return values


def _rrf_spindle(values: Values, text: str) -> None:
    """M950 R0: ``L24000``, or ``L6000:24000``."""
    for count, (word, letters) in _lines(text):
        if word == "M950" and "R" in letters and letters.get("L"):
            speeds = [number(values, part, "M950 L", count) for part in letters["L"].split(":")]
            values.spindle(max(speeds), min(speeds) if len(speeds) > 1 else 0.0, f"M950 L, {in_lines([count])}")


def _rrf_travel(values: Values, text: str, unit: str) -> None:
    """M208: ``X0:200``, or the highest with S0 and the lowest with S1."""
    ends: dict[str, list[float]] = {axis: [-math.inf, math.inf] for axis in "XYZ"}
    lines = []
    for count, (word, letters) in _lines(text):
        if word != "M208":
            continue
        lowest = "S" in letters and letters["S"].strip() == "1"
        for axis in "XYZ":
            if axis not in letters:
                continue
            parts = letters[axis].split(":")
            each = [number(values, part, f"M208 {axis}", count) for part in parts[:2]]
            if len(each) == 2:
                ends[axis] = each
            else:
                ends[axis][0 if lowest else 1] = each[0]
                if not lowest and ends[axis][0] == -math.inf:
                    ends[axis][0] = 0.0  # RepRapFirmware's default
            lines.append(count)
    if not lines:
        values.note("the file has no M208: nothing is checked against the travel")
        return
    words = f"M208, {in_lines(lines)}"
    for axis in "XYZ":
        if math.isfinite(ends[axis][0]) and not math.isfinite(ends[axis][1]):
            ends[axis] = [-math.inf, math.inf]
    low, high = (tuple(ends[axis][k] for axis in "XYZ") for k in (0, 1))
    values.travel(Axes(low, unit, words), Axes(high, unit, words))


def _jerk_corners(values: Values, jerk: float, line: int, unit: str, what: str) -> None:
    """Keep the junction deviation with which a corner of 90° is taken at the speed that a jerk allows."""
    acceleration = values.found["rapid.acceleration"].value
    first = acceleration if isinstance(acceleration, str) else acceleration[0]
    along = number(values, first, "rapid.acceleration")
    if not jerk > 0:
        raise values.refusal(f"{what} is {jerk:g}, but must be above 0", line)
    deviation = _OF_JERK * jerk * jerk / along
    values.derive("corners.style", "grbl", f"corners by jerk ({what}) as corners by junction deviation")
    values.derive(
        "corners.deviation",
        f"{deviation:.4g} {unit}",
        f"0.41 × jerk² ÷ acceleration, which takes a corner of 90° as fast; {what}, {in_lines([line])}",
    )


def _zero_home(values: Values) -> None:
    values.home_at(Axes((0.0, 0.0, 0.0), "mm", "the file does not say where homing ends", assumed=True))


def _rest(values: Values, name: str, laser: bool = False) -> None:
    values.derive("rapid.style", "linear", f"{name} moves all axes together on a straight line")
    if laser:
        values.work(Head.LASER, "M452")
    else:
        values.assume("process", Head.SPINDLE.value, "the file does not say what does the work")
    values.assume("spindle.start_time", *(("0 s", "a laser is there at once") if laser else SPINDLE_START))
    values.tools_by_hand("the file does not say how tools are changed")


def _axes(values: Values, settings: _Settings, word: str, unit: str, what: str) -> Axes:
    letters = settings.words.get(word)
    if letters is None:
        raise values.refusal(f"has no {word}, the {what}; is the file whole?")
    missing = [axis for axis in "XYZ" if axis not in letters]
    if missing:
        raise values.refusal(f"{word} has no {' and no '.join(missing)}; is the file whole?")
    # Of several motors, X100:100, the slowest decides.
    numbers = []
    for axis in "XYZ":
        text, line = letters[axis]
        numbers.append(min(number(values, part, f"{word} {axis}", line) for part in text.split(":")))
    return Axes(tuple(numbers), unit, f"{word}, {in_lines(letters[axis][1] for axis in 'XYZ')}")


def _named(entry: tuple[str, int], what: str) -> tuple[str, str, int]:
    return entry[0].split(":", maxsplit=1)[0], what, entry[1]


def word_of(line: str) -> re.Match[str] | None:
    """Return the word that a line of settings begins with, and what follows it; None of any other line."""
    return LINE.match(line[:LONGEST_LINE].partition(";")[0].strip())


def _lines(text: str) -> list[tuple[int, tuple[str, dict[str, str]]]]:
    """Return each line that is a word of settings: its number, the word, and the text of each letter."""
    found = []
    for count, line in enumerate(text.splitlines(), 1):
        match = word_of(line)
        if match:
            letters = {word[1].upper(): word[2] or "" for word in _WORD.finditer(match[2])}
            found.append((count, (match[1].upper(), letters)))
    return found


def _settings(text: str) -> _Settings:
    found = _Settings()
    for count, (word, letters) in _lines(text):
        if word in ("G20", "G21"):
            found.inch = count if word == "G20" else None
            continue
        found.words.setdefault(word, {}).update({letter: (value, count) for letter, value in letters.items()})
    return found
