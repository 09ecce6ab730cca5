"""A part that is not flat, for the pictures: a plate with a dome, a step, four bosses, and holes at all heights."""

from __future__ import annotations

import numpy as np

from leafcut.report.stock_mesh import stock_stl
from leafcut.stock.height_field import HeightField

#: What holds the part: boxes, mm.
FIXTURES = ("-14 30 -20 7 50 9", "133 30 -20 154 50 4")
#: Its size, its floor, and the side of a cell, mm.
_WIDTH, _DEPTH, _FLOOR, _CELL = 140.0, 80.0, -20.0, 0.5
#: Middle, radius and height of the dome; x, y, radius and height of bosses, mm.
_DOME = (52.0, 40.0, 24.0, 11.0)
_BOSSES = ((14.0, 14.0, 8.0, 6.0), (14.0, 66.0, 8.0, 6.0), (122.0, 16.0, 9.0, 4.0), (122.0, 64.0, 9.0, 4.0))


def part_stl() -> bytes:
    """Return the part as STL, in mm."""
    x = np.arange(0.5 * _CELL, _WIDTH, _CELL)[None, :]
    y = np.arange(0.5 * _CELL, _DEPTH, _CELL)[:, None]
    heights = np.where(x + 0 * y > 92.0, -7.0, 0.0)
    across, up, radius, high = _DOME
    away = np.hypot(x - across, y - up) / radius
    heights = np.maximum(heights, np.where(away < 1.0, high * np.sqrt(np.maximum(1.0 - away**2, 0.0)), -99.0))
    for bx, by, wide, top in _BOSSES:
        heights = np.maximum(heights, np.where(np.hypot(x - bx, y - by) < wide, top, -99.0))
    field = HeightField(heights.astype(np.float32), float(x[0, 0]), float(y[0, 0]), _CELL, _FLOOR)
    return stock_stl(field)[0]


def holes_csv() -> str:
    """Return its holes: in the bosses, round the dome and on the lower step."""
    places = [(bx, by, 6.0) for bx, by, _, _ in _BOSSES]
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    places += [(52.0 + 31.0 * np.cos(turn), 40.0 + 31.0 * np.sin(turn), 4.0) for turn in turns]
    places += [(x, y, 4.0) for x in (98.0, 108.0, 118.0) for y in (34.0, 40.0, 46.0)]
    return "x,y,diameter\n" + "".join(f"{px:.3f},{py:.3f},{wide:g}\n" for px, py, wide in places)
