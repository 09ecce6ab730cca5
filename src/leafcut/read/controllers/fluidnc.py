"""Import the settings of FluidNC from its ``config.yaml``.

FluidNC does not support YAML anchors. The reader refuses a file with anchors, because a few lines can expand to
gigabytes.

Source: the wiki of FluidNC, "Config file" (axes, homing, spindles, kinematics); bdring/FluidNC, Machine/Axis.h
(defaults of missing keys) and Machine/Axes.cpp `limitsMinPosition` (position of the travel).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.errors import ReadError, printable
from leafcut.model.kinds import Head
from leafcut.model.machine import XYZ
from leafcut.read.controllers.values import (
    Axes,
    Scalar,
    Values,
    format_axes,
    format_line_numbers,
    parse_leading_number,
)

#: Maximum size of a file, bytes. Real files have a few kB, and parsing takes about 1 ms per kB.
MOST_BYTES = 262_144
#: Maximum nesting depth of mappings. Real files have six levels.
_MAX_DEPTH = 40

#: FluidNC's defaults: rate, mm/min; acceleration, mm/s²; travel, mm; junction deviation, mm.
_RATE, _ACCELERATION, _TRAVEL, _DEVIATION = 1000.0, 25.0, 1000.0, 0.01
#: More defaults: steps per mm, arc tolerance, mm (Machine/Axis.h, Machine/MachineConfig.h).
_STEPS, _ARC_TOLERANCE = 80.0, 0.002
#: Sections of spindles, and of a laser.
_SPINDLES = ("pwm", "10v", "besc", "dac", "hbridge", "relay", "onoff", "huanyang", "h2a", "h100", "yl620", "siemensv20",
             "danfossvlt2800", "nowforever", "modbusvfd")  # fmt: skip
_LASER = "laser"


#: A mapping of FluidNC's file; keys are lower case, because FluidNC ignores case.
_Tree = dict[str, "Scalar | _Tree"]


def import_fluidnc(text: str, file: str) -> Values:
    """Import a FluidNC configuration.

    Raises
    ------
    ReadError
        The text is not YAML, has anchors, or does not define the x or y axis. The error is also raised if a value is
        implausible or not a number.
    """
    tree = _parse_yaml(text, file)
    values = Values(file, "FluidNC")
    for key in ("name", "board"):
        entry = tree.get(key)
        if isinstance(entry, Scalar) and entry.text.strip():
            values.take("name", printable(entry.text, 40), f"{key}, {format_line_numbers([entry.line])}")
            break
    axes = _subtree(tree, "axes")
    parts = [_subtree(axes, axis) for axis in "xyz"]
    for axis, part in zip("xy", parts, strict=False):
        if not part:
            raise values.refusal(f"has no axis {axis} in 'axes'; is the file complete?")
    values.store_motion(
        _axis_values(values, parts, "max_rate_mm_per_min", _RATE, "mm/min"),
        _axis_values(values, parts, "acceleration_mm_per_sec2", _ACCELERATION, "mm/s2"),
    )
    _store_travel(values, parts)
    _store_process(values, tree)
    values.derive("rapid.style", "linear", "FluidNC plans as GRBL: all axes together on a straight line")
    values.derive("corners.style", "grbl", "FluidNC plans as GRBL, by junction deviation")
    values.assume("corners.deviation", f"{_DEVIATION} mm", "FluidNC's default of junction_deviation_mm")
    for key, name in (("junction_deviation_mm", "corners.deviation"), ("arc_tolerance_mm", "corners.arc_tolerance")):
        entry = tree.get(key)
        if isinstance(entry, Scalar):
            value = parse_leading_number(values, entry.text, key, entry.line)
            values.take(name, f"{value:.10g} mm", f"{key}, {format_line_numbers([entry.line])}")
    if all(isinstance(part.get("steps_per_mm"), Scalar) for part in parts):
        steps = _axis_values(values, parts, "steps_per_mm", math.nan, "steps/mm")
        values.take("motors.steps_per_mm", format_axes(steps.numbers, steps.unit), steps.source)
    kinematics = [name for name in _subtree(tree, "kinematics") if name != "cartesian"]
    if kinematics:
        values.note(f"its kinematics are {printable(kinematics[0], 20)}: limits are per motor, so times are estimates")
    return values


@dataclass(frozen=True)
class FluidConfiguration:
    """The settings of a board with FluidNC.

    Attributes
    ----------
    low, high
        Travel limits in machine coordinates, mm; infinite for an axis without ``max_travel_mm``.
    rates, accelerations, steps
        Maximum rate, mm/s, acceleration, mm/s², and steps per mm of each axis.
    deviation, arc_tolerance
        Junction deviation and tolerance of arcs, mm.
    homing, soft_limits
        Whether all three axes have homing, and whether all three have soft limits.
    fastest
        Maximum spindle speed or laser power; infinite without a ``speed_map``.
    """

    low: XYZ
    high: XYZ
    rates: XYZ
    accelerations: XYZ
    steps: XYZ
    deviation: float
    arc_tolerance: float
    homing: bool
    must_home: bool
    soft_limits: bool
    fastest: float


def parse_board_configuration(text: str, file: str) -> FluidConfiguration:
    """Parse the complete configuration of a board, as sent in reply to ``$CD``.

    Raises
    ------
    ReadError
        The text is not YAML, or a value is implausible or not a number.
    """
    tree = _parse_yaml(text, file)
    values = Values(file, "FluidNC")
    axes = _subtree(tree, "axes")
    parts = [_subtree(axes, axis) for axis in "xyz"]
    ends = [_axis_travel(values, axis, part) for axis, part in zip("xyz", parts, strict=True)]
    cycles = [_number_or_default(values, _subtree(part, "homing"), "cycle", -1.0) for part in parts]
    _store_process(values, tree)
    speed = values.entries.get("spindle.max_speed")
    return FluidConfiguration(
        low=_as_xyz([low for low, _, _, _ in ends]),
        high=_as_xyz([high for _, high, _, _ in ends]),
        rates=_as_xyz([_number_or_default(values, part, "max_rate_mm_per_min", _RATE) / 60.0 for part in parts]),
        accelerations=_as_xyz(
            [_number_or_default(values, part, "acceleration_mm_per_sec2", _ACCELERATION) for part in parts]
        ),
        steps=_as_xyz([_number_or_default(values, part, "steps_per_mm", _STEPS) for part in parts]),
        deviation=_number_or_default(values, tree, "junction_deviation_mm", _DEVIATION),
        arc_tolerance=_number_or_default(values, tree, "arc_tolerance_mm", _ARC_TOLERANCE),
        homing=all(cycle >= 1 for cycle in cycles),
        must_home=_is_true(_subtree(tree, "start"), "must_home", otherwise=True),
        soft_limits=all(_is_true(part, "soft_limits", otherwise=False) for part in parts),
        fastest=math.inf if speed is None else parse_leading_number(values, speed.value, "speed_map"),
    )


def _as_xyz(numbers: list[float]) -> XYZ:
    return (numbers[0], numbers[1], numbers[2])


def _number_or_default(values: Values, tree: _Tree, key: str, otherwise: float, owner: str = "") -> float:
    entry = tree.get(key)
    return parse_leading_number(values, entry.text, key + owner, entry.line) if isinstance(entry, Scalar) else otherwise


def _is_true(tree: _Tree, key: str, *, otherwise: bool) -> bool:
    entry = tree.get(key)
    return entry.text.strip().lower() in ("true", "yes", "1") if isinstance(entry, Scalar) else otherwise


def _axis_travel(values: Values, axis: str, part: _Tree) -> tuple[float, float, float, int]:
    """Return the travel of an axis.

    Returns
    -------
    float, float
        Travel limits.
    float
        Home position.
    int
        Line number of the travel, or 0 if the file does not state the travel.
    """
    entry = part.get("max_travel_mm")
    if not isinstance(entry, Scalar):
        return -math.inf, math.inf, 0.0, 0
    length = parse_leading_number(values, entry.text, f"max_travel_mm of {axis}", entry.line)
    homing = _subtree(part, "homing")
    home = _number_or_default(values, homing, "mpos_mm", 0.0, f" of {axis}")
    # Without homing, the travel counts down from machine zero, as with homing in positive direction (the default).
    counts_down = not homing or _is_true(homing, "positive_direction", otherwise=True)
    if not length > 0:
        raise values.refusal(f"max_travel_mm of {axis} is {length:g}, but must be above 0", entry.line)
    return (home - length, home, home, entry.line) if counts_down else (home, home + length, home, entry.line)


def _store_travel(values: Values, parts: list[_Tree]) -> None:
    lowest, highest, homes, lines = [], [], [], []
    for axis, part in zip("xyz", parts, strict=True):
        low, high, home, line = _axis_travel(values, axis, part)
        lowest.append(low)
        highest.append(high)
        homes.append(home)
        lines += [line] * bool(line)
    if not lines:
        values.note("the file has no max_travel_mm: the travel is not checked")
    else:
        source = f"max_travel_mm and homing, {format_line_numbers(lines)}"
        values.store_travel(
            Axes(tuple(lowest), "mm", source, derived=True), Axes(tuple(highest), "mm", source, derived=True)
        )
    homed = any(_subtree(part, "homing") for part in parts)
    source = "mpos_mm of homing" if homed else "no homing: machine zero is its position at power-on"
    values.store_home(Axes(tuple(homes), "mm", source, derived=homed, assumed=not homed))


def _store_process(values: Values, tree: _Tree) -> None:
    spindle = next((name for name in _SPINDLES if name in tree), None)
    laser = _LASER in tree
    only_laser = laser and spindle is None
    values.derive("controller", "grbl-laser" if only_laser else "grbl", "FluidNC uses the dialect of GRBL")
    if only_laser:
        values.store_process(Head.LASER, f"section '{_LASER}' and no spindle")
    else:
        values.assume("process", Head.SPINDLE.value, f"section '{spindle}'" if spindle else "the file names no spindle")
        if laser:
            values.note('it also has a laser: create a separate profile for it, with process = "laser"')
    section = _subtree(tree, spindle or _LASER)
    speeds = section.get("speed_map")
    if isinstance(speeds, Scalar):
        _store_speed_map(values, speeds)
    start = section.get("spinup_ms")
    if isinstance(start, Scalar):
        seconds = parse_leading_number(values, start.text, "spinup_ms", start.line) / 1000.0
        values.take(
            "spindle.start_time", f"{max(seconds, 0.0):.10g} s", f"spinup_ms, {format_line_numbers([start.line])}"
        )
    else:
        values.assume_spindle_start(only_laser)
    values.store_manual_tool_changes("FluidNC changes tools by macros, which are not read")


def _store_speed_map(values: Values, entry: Scalar) -> None:
    """Store the lowest and the highest speed in a speed map such as ``0=0% 6000=25% 24000=100%``."""
    speeds = []
    for pair in entry.text.split():
        speed, equals, power = pair.partition("=")
        if not equals:
            raise values.refusal(
                f"speed_map is '{printable(entry.text, 40)}', but must be speeds such as 0=0%", entry.line
            )
        share = parse_leading_number(values, power, "a share of speed_map", entry.line)
        speeds.append((parse_leading_number(values, speed, "a speed of speed_map", entry.line), share))
    turning = [speed for speed, power in speeds if power > 0 and speed > 0]
    if turning:
        several = len(turning) > 1
        values.store_spindle_range(
            max(turning), min(turning) if several else 0.0, f"speed_map, {format_line_numbers([entry.line])}"
        )


def _axis_values(values: Values, parts: list[_Tree], key: str, otherwise: float, unit: str) -> Axes:
    numbers, lines, missing = [], [], []
    for axis, part in zip("xyz", parts, strict=True):
        entry = part.get(key)
        if isinstance(entry, Scalar):
            numbers.append(parse_leading_number(values, entry.text, f"{key} of {axis}", entry.line))
            lines.append(entry.line)
        else:
            numbers.append(otherwise)
            missing.append(axis)
    source = f"{key}, {format_line_numbers(lines)}" if lines else key
    if missing:
        source += f"; of {', '.join(missing)} FluidNC's default, {otherwise:g}"
    return Axes(tuple(numbers), unit, source, assumed=bool(missing))


def _subtree(tree: Mapping[str, Any], key: str) -> _Tree:
    subtree = tree.get(key)
    return subtree if isinstance(subtree, dict) else {}


def _parse_yaml(text: str, file: str) -> _Tree:
    """Parse the mappings and scalars of a YAML text, and skip lists and tags."""
    import yaml

    if len(text.encode()) > MOST_BYTES:
        raise ReadError(file, f"has more than {MOST_BYTES >> 10} KiB, too large for a FluidNC configuration")
    root: _Tree = {}
    #: Path of the parser. Each entry has a mapping (None if skipped) and the key that is waiting for its value.
    stack: list[tuple[_Tree | None, str | None]] = []

    def put(value: Scalar | _Tree) -> bool:
        if not stack:
            return isinstance(value, dict)
        tree, key = stack[-1]
        if tree is None:
            return False
        if key is None:
            stack[-1] = (tree, value.text.strip().lower() if isinstance(value, Scalar) else "")
            return False
        tree.setdefault(key, value)
        stack[-1] = (tree, None)
        return True

    try:
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
                raise ReadError(file, "has an anchor (& or *), which FluidNC does not know", event.start_mark.line + 1)
            if len(stack) > _MAX_DEPTH:
                raise ReadError(file, "is nested too deep", event.start_mark.line + 1)
            if isinstance(event, yaml.ScalarEvent):
                put(Scalar(event.value, event.start_mark.line + 1))
            elif isinstance(event, yaml.MappingStartEvent):
                mapping: _Tree = root if not stack else {}
                stack.append((mapping if put(mapping) else None, None))
            elif isinstance(event, yaml.SequenceStartEvent):
                put({})
                stack.append((None, None))
            elif isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
                stack.pop()
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        reason = printable(str(getattr(problem, "problem", None) or problem), 80)
        raise ReadError(file, f"is not YAML ({reason})", mark.line + 1 if mark is not None else None) from None
    return root
