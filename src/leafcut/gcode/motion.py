"""Execute moves: straight moves, arcs, moves in machine coordinates, and moves of the origin (G10, G52, G92 …).

After a move of the origin, the position on an axis is known only if the word states it. Examples are G92 X0, and G10
L20 of the active frame. Otherwise, the position is unknown until the axis is programmed again.
"""

from __future__ import annotations

import math

from leafcut.gcode.state import AXES, InterpreterState, axes_in_block, parse_whole_number
from leafcut.gcode.words import BlockError, UnclearBlock, Word
from leafcut.geometry.arrays import Point3
from leafcut.model.toolpath import Arc, plane_axes

#: The start and end radius of an arc may differ by this much, mm, …
_RADIUS_TOLERANCE = 0.0127
#: … or by this share of the radius, whichever is more (LinuxCNC: SPIRAL_RELATIVE_TOLERANCE; GRBL also uses 0.1 %).
_RADIUS_RELATIVE_TOLERANCE = 0.001
#: A radius may be too small to reach the end of an arc by at most this much, mm.
SHORT_RADIUS_TOLERANCE = 0.002
#: Maximum number of turns in a block. A larger number is an error in the program.
MAX_TURNS = 10_000
#: G codes that move the origin or store a position, in tenths.
_G10, _G28_1, _G30_1, _G52, _G92 = 100, 281, 301, 520, 920
_G92_OFF = (921, 922, 923)


def run_straight(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Execute a straight move, G0 or G1."""
    before = list(state.path.position)
    x, y, z = (state.take_target(letters, axis) for axis in range(3))
    if state.motion == 0:
        state.path.rapid(x, y, z, line=state.line)
        return
    end = [b if t is None else t for b, t in zip(before, (x, y, z), strict=True)]
    moved = [e - b for e, b in zip(end, before, strict=True) if not (math.isnan(e) and math.isnan(b))]
    state.path.feed(x, y, z, feed=state.feed_for(letters, math.hypot(*moved)), line=state.line)


def run_probe(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Execute G38.2: move straight down until the probe trips. If it never trips, the controller raises an alarm."""
    if "X" in letters or "Y" in letters or "Z" not in letters:
        raise BlockError("a probe (G38.2) that does not go straight down is not understood")
    before, z = state.path.position[2], state.take_target(letters, 2)
    if z is None or not z < before:
        raise BlockError("a probe (G38.2) that starts at an unknown height or does not move downwards")
    state.path.probe(z, feed=state.feed_for(letters, before - z), line=state.line)


def run_machine_move(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Execute a move in machine coordinates, G53 with G0."""
    if state.motion != 0:
        raise UnclearBlock("G53 is understood with G0 only")
    if state.incremental:
        raise BlockError("G53 cannot be incremental (G91)")
    x, y, z = (state.mm(letters.pop(axis)) if axis in letters else None for axis in AXES)
    if x is None and y is None and z is None:
        raise BlockError("G53 has no axis word")
    state.path.machine(x, y, z, line=state.line)


def run_reference_return(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Execute G28 or G30: a rapid to the programmed point, followed by a rapid to machine zero on the same axes.

    By convention, the stored position is machine zero.
    """
    given = [axis in letters for axis in AXES]
    before = list(state.path.position)
    x, y, z = (state.take_target(letters, axis) for axis in range(3))
    if any(v is not None and v != b for v, b in zip((x, y, z), before, strict=True)):
        state.path.rapid(x, y, z, line=state.line)
    x, y, z = (0.0 if axis or not any(given) else None for axis in given)
    state.path.machine(x, y, z, line=state.line)


def run_arc(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Execute an arc (G2 or G3), given by its centre (I, J, K) or by its radius (R). P is the number of turns."""
    begin = (state.path.position[0], state.path.position[1], state.path.position[2])
    targets = [state.take_target(letters, axis) for axis in range(3)]
    end = [b if t is None else t for b, t in zip(begin, targets, strict=True)]
    axes = plane_axes(state.plane)
    first, second, normal = axes
    if math.isnan(begin[first]) or math.isnan(begin[second]):
        raise UnclearBlock("the arc starts at an unknown position")
    clockwise = state.motion == 2
    if "R" in letters:
        if targets[first] is None and targets[second] is None:
            raise BlockError("an arc with R needs an end point")
        center = _centre_from_radius(begin, end, axes, state.mm(letters.pop("R")), clockwise)
    else:
        center = _centre_from_offsets(state, letters, begin, axes)
        check_radii(begin[first], begin[second], end[first], end[second], center[first], center[second])
    turns = 1
    if "P" in letters and state.dialect.arc_turns:
        word = letters.pop("P")
        turns = int(word.value)
        if turns != word.value or not 1 <= turns <= MAX_TURNS:
            raise BlockError("{}: an arc takes a whole number of turns from 1 to {}", word, MAX_TURNS)
    rise = end[normal] - begin[normal]
    length = math.hypot(
        _swept_angle(begin, end, center, axes, clockwise, turns)
        * math.dist(_plane_coordinates(begin, axes), _plane_coordinates(center, axes)),
        0.0 if math.isnan(rise) else rise,
    )
    state.path.arc(
        clockwise,
        (end[0], end[1], end[2]),
        Arc((center[0], center[1], center[2]), state.plane, turns),
        feed=state.feed_for(letters, length),
        line=state.line,
    )


def _plane_coordinates(point: list[float] | Point3, axes: tuple[int, int, int]) -> tuple[float, float]:
    return point[axes[0]], point[axes[1]]


def _centre_from_offsets(
    state: InterpreterState, letters: dict[str, Word], begin: Point3, axes: tuple[int, int, int]
) -> list[float]:
    """Compute the centre of an arc from two of I, J and K. The third coordinate is taken from the start."""
    names = ["IJK"[axis] for axis in axes[:2]]
    if not any(name in letters for name in names):
        raise BlockError("an arc needs {} and {}, or R", names[0], names[1])
    center = list(begin)
    for name, axis in zip(names, axes[:2], strict=True):
        word = letters.pop(name, None)
        if word is None and state.absolute_centres:
            raise BlockError("an arc with an absolute centre (G90.1) needs {}", name)
        value = 0.0 if word is None else state.mm(word)
        center[axis] = value if state.absolute_centres else begin[axis] + value
    return center


def check_radii(u0: float, v0: float, u1: float, v1: float, uc: float, vc: float) -> None:
    """Check that the start (u0, v0) and the end (u1, v1) of an arc are equally far from its centre (uc, vc)."""
    inner, outer = math.hypot(u0 - uc, v0 - vc), math.hypot(u1 - uc, v1 - vc)
    if inner == 0.0:
        raise BlockError("the arc has a radius of 0")
    if abs(inner - outer) > _RADIUS_TOLERANCE and abs(inner - outer) > _RADIUS_RELATIVE_TOLERANCE * inner:
        raise BlockError(
            "the arc does not end on its circle: its radius is {:.4f} mm at the start and {:.4f} mm at the end",
            inner,
            outer,
        )


def _centre_from_radius(
    begin: Point3, end: list[float], axes: tuple[int, int, int], radius: float, clockwise: bool
) -> list[float]:
    """Return the centre of an arc with a given radius. A negative radius selects the arc of more than half a turn."""
    (u0, v0), (u1, v1) = _plane_coordinates(begin, axes), _plane_coordinates(end, axes)
    du, dv = u1 - u0, v1 - v0
    half = math.hypot(du, dv) / 2.0
    if half == 0.0:
        raise BlockError("an arc with R cannot end where it starts; write it with a centre")
    if half > abs(radius) + SHORT_RADIUS_TOLERANCE:
        raise BlockError("the radius {:g} mm is too small to reach the end of the arc", abs(radius))
    # From the midpoint of the chord to the centre, perpendicular to the chord: right for a short clockwise arc.
    height = math.sqrt(max(radius * radius - half * half, 0.0))
    side = -1.0 if clockwise == (radius > 0.0) else 1.0
    center = list(begin)
    center[axes[0]] = (u0 + u1) / 2.0 - side * height * dv / (2.0 * half)
    center[axes[1]] = (v0 + v1) / 2.0 + side * height * du / (2.0 * half)
    return center


def _swept_angle(
    begin: Point3, end: list[float], center: list[float], axes: tuple[int, int, int], clockwise: bool, turns: int
) -> float:
    """Return the swept angle of an arc, rad. It is always positive."""
    (u0, v0), (u1, v1), (uc, vc) = (
        _plane_coordinates(begin, axes),
        _plane_coordinates(end, axes),
        _plane_coordinates(center, axes),
    )
    turn = math.atan2(v1 - vc, u1 - uc) - math.atan2(v0 - vc, u0 - uc)
    sweep = (-turn if clockwise else turn) % math.tau
    return (sweep if sweep > 1e-9 else math.tau) + math.tau * (turns - 1)


def changes_origin(code: int) -> bool:
    """Return whether a G code, in tenths, moves the origin or stores a position."""
    return code in (_G10, _G28_1, _G30_1, _G52, _G92, *_G92_OFF)


def run_origin_change(state: InterpreterState, code: int, letters: dict[str, Word]) -> None:
    """Execute a code that moves the origin, and add a SHIFT row.

    Raises
    ------
    BlockError
        A word is missing.
    UnclearBlock
        The program does not contain the stored value.
    """
    if code in _G92_OFF:
        if state.policy.cancels_shift(state):
            state.move_origin((True, True, True))
    elif code in (_G92, _G52) and not any(axes_in_block(letters)):
        raise BlockError("G92 has no axis word" if code == _G92 else "G52 has no axis word")
    elif code == _G92:
        _, values = _take_axis_words(letters)
        state.move_origin((False, False, False), {axis: state.mm(word) for axis, word in values.items()})
    elif code in (_G28_1, _G30_1):
        raise UnclearBlock("G{:g} stores the current position of the tool", code / 10)
    elif code == _G10:
        _execute_g10(state, letters)
    else:
        state.move_origin(_take_axis_words(letters)[0])


def _execute_g10(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Execute G10. L2 and L20 set a work offset. Other tables are not supported."""
    if "L" not in letters:
        raise UnclearBlock("G10 without L is not understood")
    table = parse_whole_number(letters.pop("L"), 999)
    if table not in (2, 20):
        raise UnclearBlock("G10 L{} is not understood", table)
    if "P" not in letters:
        raise BlockError("G10 L{} needs P, the work offset that it sets", table)
    number = parse_whole_number(letters.pop("P"), 999)
    turned = letters.pop("R", None) is not None
    named, values = _take_axis_words(letters)
    active = {540 + 10 * n: n + 1 for n in range(6)} | {590 + n: n + 6 for n in range(1, 4)}
    if number not in (0, active.get(state.frame)):
        # Not the active offset: nothing moves until it is selected, but the row must not be lost.
        state.move_origin((False, False, False))
    elif turned:
        state.move_origin((True, True, named[2]))
    elif table == 20 and state.dialect.groups == "rs274":
        state.move_origin((False, False, False), {axis: state.mm(word) for axis, word in values.items()})
    else:
        state.move_origin(named)


def _take_axis_words(letters: dict[str, Word]) -> tuple[tuple[bool, bool, bool], dict[int, Word]]:
    """Remove the X, Y and Z words from `letters`. Return a flag for each axis, and the removed words by axis."""
    named = axes_in_block(letters)
    return named, {axis: letters.pop(AXES[axis]) for axis in range(3) if named[axis]}
