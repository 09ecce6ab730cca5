"""No rapid where there is metal: heights of rapids, the spindle, and the zones that may be crossed high up only."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.geometry.zones import touches_any_zone, widened
from leafcut.model.cycles import expand
from leafcut.model.toolpath import Kind, Toolpath, positions_before
from leafcut.verify.difference import Difference, place, shorten

Mask = NDArray[np.bool_]

#: The least height over the surface that counts as clear of it, mm: the smallest R plane that can be asked for.
LEAST_CLEARANCE = 0.05

#: Room for the rounding of written heights, mm (0.0001 inch is 0.00254 mm).
_ROOM = 0.002

_POINTS: Mapping[int, float] = MappingProxyType({})


def check_clearance(
    path: Toolpath,
    *,
    surface_z: float = 0.0,
    clearance: float = LEAST_CLEARANCE,
    zones: ArrayLike | None = None,
    zone_height: float | None = None,
    tool_radii: Mapping[int, float] = _POINTS,
    safe_z: float = 0.0,
    dogleg: bool = False,
    torch: bool = False,
    milled: bool = False,
) -> list[Difference]:
    """Return every move that could crash, with its line and place; nothing when the program is safe by these rules.

    1. A rapid in x or y is nowhere lower than `clearance` mm over `surface_z`, and z is known when it is made.
       After a move to machine z (G53, G28) at or above `safe_z` it is known to be high.
    2. A rapid does not go down below `surface_z`, but for the return into a hole: over a place where a feed has gone at
       least as deep since the tool arrived there. Not looked at where an area is `milled`: how low a rapid may go
       there, what was cut before says (`verify.pocket`).
    3. The spindle turns whenever something is cut. A tool change stops it. Of a `torch` instead: it is off in every
       rapid in x or y; over the sheet with the torch off a feed does no harm.
    4. A rapid across one of `zones` (float64[k, 4]: x0 ≤ x1, y0 ≤ y1 in order x0, y0, x1, y1, mm) is at or above
       `zone_height`, and nothing is cut there below it (an arc is taken by its chord). The tool's radius (`tool_radii`
       by number, mm; 0 where it is not given) is kept away from the rectangle. With `dogleg` the axes do not arrive
       together, so all of the rectangle between start and end of a rapid counts as crossed.

    Drilling cycles are taken as the moves that they make.
    """
    path = expand(path)
    before = positions_before(path)
    rapid = path.kind == Kind.RAPID
    across = _moves_across(path, before)
    lowest = np.fmin(before[:, 2], path.end[:, 2])
    high_up = _at_machine_height(path, safe_z)
    checks: list[tuple[str, Mask, str]] = [
        ("height not known", across & np.isnan(path.end[:, 2]) & ~high_up, "x or y moves before z was placed"),
        (
            "rapid below clearance",
            rapid & across & (lowest < surface_z + clearance - _ROOM),
            f"a rapid in x or y must be at Z{surface_z + clearance:.3f} or above",
        ),
        (
            "rapid into the part",
            rapid
            & _goes_down(path, before)
            & (path.end[:, 2] < surface_z - _ROOM)
            & ~_returns(path, before)
            & (not milled),
            f"a rapid goes down below the surface, Z{surface_z:.3f}, where nothing was cut",
        ),
        ("torch burns", rapid & across & (_spindle_speed(path) != 0), "it must be off in a rapid")
        if torch
        else ("spindle stands", _cutting(path) & (_spindle_speed(path) == 0), "it must turn before something is cut"),
    ]
    table = np.zeros((0, 4)) if zones is None else np.asarray(zones, dtype=np.float64).reshape(-1, 4)
    if len(table):
        height = np.inf if zone_height is None else zone_height
        crossing = _crossing(path, before, table, dogleg, tool_radii)
        low = crossing & ~(lowest >= height - _ROOM)
        text = f"rapids over a keep-out zone must be at Z{height:.3f} or above"
        checks.append(("crosses a zone", rapid & across & low & ~high_up, text))
        checks.append(("cuts in a zone", _cutting(path) & low, "nothing may be cut inside a keep-out zone"))
    wrong = [(int(row), what, text) for what, mask, text in checks for row in np.flatnonzero(mask)[:100]]
    found = sum(int(mask.sum()) for _, mask, _ in checks)
    return shorten([_difference(path, before, *one) for one in sorted(wrong)], found)


def _difference(path: Toolpath, before: NDArray[np.float64], row: int, what: str, text: str) -> Difference:
    came, goes = (place(*p) for p in (before[row].tolist(), path.end[row].tolist()))
    return Difference(what, 0, int(path.line[row]), f"{text}; this move goes from {came} to {goes}")


def _moves_across(path: Toolpath, before: NDArray[np.float64]) -> Mask:
    """Return which motions move x or y; the first time that an axis is placed counts as a move."""
    moved = np.isfinite(path.end[:, :2]) & ~(path.end[:, :2] == before[:, :2])
    across: Mask = (path.kind <= Kind.ARC_CCW) & moved.any(axis=1)
    return across


def _goes_down(path: Toolpath, before: NDArray[np.float64]) -> Mask:
    """Return which motions lower z; from a height that is not known counts as down."""
    down: Mask = np.isfinite(path.end[:, 2]) & ~(path.end[:, 2] >= before[:, 2])
    return down


def _cutting(path: Toolpath) -> Mask:
    cutting: Mask = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)
    return cutting


def _latest(path: Toolpath, sets: Mask) -> NDArray[np.int64]:
    """Return for every row the latest row up to it where `sets` holds, -1 before the first."""
    rows = np.where(sets, np.arange(len(path)), -1)
    return np.maximum.accumulate(rows) if len(rows) else rows


def _spindle_speed(path: Toolpath) -> NDArray[np.float64]:
    """Return the speed of the spindle at every row: M6 stops it on LinuxCNC and Haas alike."""
    row = _latest(path, (path.kind == Kind.SPINDLE) | (path.kind == Kind.TOOL))
    turning = (row >= 0) & (path.kind[row] == Kind.SPINDLE)
    return np.where(turning, path.value[row], 0.0)


def _at_machine_height(path: Toolpath, safe_z: float) -> Mask:
    """Return at which rows z was last placed by a move in machine coordinates to a safe height."""
    in_machine = (path.kind == Kind.MACHINE) & np.isfinite(path.end[:, 2])
    in_program = (path.kind <= Kind.ARC_CCW) & np.isfinite(path.end[:, 2])
    row = _latest(path, in_machine | in_program)
    high: Mask = (row >= 0) & in_machine[row] & (path.end[row, 2] >= safe_z - _ROOM)
    return high


def _returns(path: Toolpath, before: NDArray[np.float64]) -> Mask:
    """Return which motions end no deeper than a feed has gone at this x, y since the tool arrived here.

    A running minimum within each stay: every stay is shifted down by more than the whole range of heights, so that a
    minimum carried over from an earlier stay is recognised by being too high.
    """
    arrives = _moves_across(path, before) | (path.kind == Kind.MACHINE)
    stay = np.cumsum(arrives)
    heights = path.end[:, 2]
    known = heights[np.isfinite(heights)]
    shift = 2.0 * float(np.ptp(known)) + 1.0 if len(known) else 1.0
    fed = np.where(_cutting(path) & np.isfinite(heights), heights, np.inf)
    deepest = np.minimum.accumulate(fed - shift * stay) + shift * stay if len(path) else fed
    in_this_stay = deepest <= (known.max() if len(known) else 0.0)
    result: Mask = ~arrives & in_this_stay & (heights >= deepest - _ROOM)
    return result


def _crossing(
    path: Toolpath,
    before: NDArray[np.float64],
    zones: NDArray[np.float64],
    dogleg: bool,
    radii: Mapping[int, float],
) -> Mask:
    """Return which motions touch a zone; from a place that is not known, the end alone is looked at."""
    end = np.where(np.isnan(path.end[:, :2]), before[:, :2], path.end[:, :2])
    begin = np.where(np.isnan(before[:, :2]), end, before[:, :2])
    change = _latest(path, path.kind == Kind.TOOL)
    tool = np.where(change >= 0, path.ref[change], 0)
    crossing = np.zeros(len(path), dtype=bool)
    for bent in (False, True):
        style = (path.kind == Kind.RAPID) & dogleg
        for number in np.unique(tool).tolist():
            rows = (tool == number) & (style == bent)
            own = widened(zones, radii.get(number, 0.0))
            crossing[rows] = touches_any_zone(begin[rows], end[rows], own, dogleg=bent)
    return crossing
