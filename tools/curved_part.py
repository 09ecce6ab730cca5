"""A part that is not flat, for the pictures: a plate with a step, a dome, four bosses, and holes at all heights."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

#: Boxes of the fixtures that hold the part, mm.
FIXTURES = ("-14 30 -20 7 50 9", "133 30 -20 154 50 4")
_FLOOR = -20.0
#: Dimensions of the part, mm: first x, last x and height of both steps; centre, radius and height of the dome; x, y,
#: radius and height of the bosses.
_STEPS, _DEPTH = ((0.0, 92.0, 0.0), (92.0, 140.0, -7.0)), 80.0
_DOME = (52.0, 40.0, 24.0, 11.0)
_BOSSES = ((14.0, 14.0, 8.0, 6.0), (14.0, 66.0, 8.0, 6.0), (122.0, 16.0, 9.0, 4.0), (122.0, 64.0, 9.0, 4.0))
_AROUND, _UP = 96, 24


def part_stl() -> bytes:
    """Return the part as binary STL, in mm, as overlapping solids."""
    solids = [_box(x0, x1, top) for x0, x1, top in _STEPS]
    solids += [_turned(x, y, [(radius, _FLOOR), (radius, top)]) for x, y, radius, top in _BOSSES]
    x, y, radius, high = _DOME
    angles = np.linspace(0.0, 0.5 * np.pi, _UP + 1)[:-1]
    rings = [(radius * np.cos(a), high * np.sin(a)) for a in angles]
    solids.append(_turned(x, y, [(radius, _FLOOR), *rings], high))
    triangles = np.concatenate(solids)
    rows = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("none", "<u2")])
    rows["corners"] = triangles
    return b"a cover, mm".ljust(80) + len(triangles).to_bytes(4, "little") + rows.tobytes()


def _turned(x: float, y: float, rings: list[tuple[float, float]], tip: float | None = None) -> NDArray[np.float64]:
    """Return a solid of revolution through rings (radius, height), from bottom to top, closed by a disc or by a tip."""
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    levels = [np.column_stack([radius * circle + (x, y), np.full(_AROUND, z)]) for radius, z in rings]
    found = []
    for low, high in pairwise(levels):
        after, above = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
        found += [np.stack([low, after, above], axis=1), np.stack([low, above, high], axis=1)]
    ends = ((levels[0], rings[0][1], -1), (levels[-1], rings[-1][1] if tip is None else tip, 1))
    for level, z, way in ends:
        middle = np.broadcast_to(np.array([x, y, z]), level.shape)
        found.append(np.stack([middle, level, np.roll(level, -1, axis=0)][::way], axis=1))
    return np.concatenate(found)


def _box(x0: float, x1: float, top: float) -> NDArray[np.float64]:
    corners = np.array([(x, y, z) for x in (x0, x1) for y in (0.0, _DEPTH) for z in (_FLOOR, top)])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    box: NDArray[np.float64] = corners[np.array([(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)])]
    return box


def holes_csv() -> str:
    """Return the holes of the part: in the bosses, around the dome and on the lower step."""
    places = [(bx, by, 6.0) for bx, by, _, _ in _BOSSES]
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    places += [(52.0 + 31.0 * np.cos(turn), 40.0 + 31.0 * np.sin(turn), 4.0) for turn in turns]
    places += [(x, y, 4.0) for x in (98.0, 108.0, 118.0) for y in (34.0, 40.0, 46.0)]
    return "x,y,diameter\n" + "".join(f"{px:.3f},{py:.3f},{wide:g}\n" for px, py, wide in places)
