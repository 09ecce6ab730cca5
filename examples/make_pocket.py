"""Draws a pocket with two islands, as a drawing and as a picture, into this folder: ``python examples/make_pocket.py``.

Both show the same region: a recess of 120 × 80 mm with corners of 10 mm, round a boss of 24 mm and a turned slot of
36 × 16 mm. In the picture a pixel is 0.25 mm wide, and its lower left corner is 5 mm left of the recess and below it.
"""

from __future__ import annotations

import math
from pathlib import Path

import ezdxf
import numpy as np
from ezdxf.enums import InsertUnits
from PIL import Image

WIDTH, HEIGHT, CORNER = 120.0, 80.0, 10.0
BOSS = (38.0, 44.0, 12.0)
#: Centre, half the length of the straight part, radius of the ends, angle in degrees.
SLOT = (84.0, 36.0, 10.0, 8.0, 30.0)
MARGIN, PIXEL = 5.0, 0.25


def drawing() -> ezdxf.document.Drawing:
    """Return the recess on layer POCKET and what stands in it on layer ISLAND, mm."""
    made = ezdxf.new("R2000", units=InsertUnits.Millimeters)
    made.layers.add("POCKET", color=5)
    made.layers.add("ISLAND", color=1)
    space = made.modelspace()
    quarter, c = math.tan(math.pi / 8.0), CORNER
    wall = [
        (c, 0.0, 0.0), (WIDTH - c, 0.0, quarter), (WIDTH, c, 0.0), (WIDTH, HEIGHT - c, quarter),
        (WIDTH - c, HEIGHT, 0.0), (c, HEIGHT, quarter), (0.0, HEIGHT - c, 0.0), (0.0, c, quarter),
    ]  # fmt: skip
    space.add_lwpolyline(wall, format="xyb", close=True, dxfattribs={"layer": "POCKET"})
    space.add_circle(BOSS[:2], BOSS[2], dxfattribs={"layer": "ISLAND"})
    x, y, half, radius, degrees = SLOT
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    around = [(-half, -radius, 0.0), (half, -radius, 1.0), (half, radius, 0.0), (-half, radius, 1.0)]
    turned = [(round(x + u * cos - v * sin, 6), round(y + u * sin + v * cos, 6), b) for u, v, b in around]
    space.add_lwpolyline(turned, format="xyb", close=True, dxfattribs={"layer": "ISLAND"})
    return made


def picture() -> Image.Image:
    """Return the recess black on white: a wall's pixels are as dark as the share of them that is milled."""
    columns, rows = (int((size + 2.0 * MARGIN) / PIXEL) for size in (WIDTH, HEIGHT))
    x, y = np.meshgrid((np.arange(columns) + 0.5) * PIXEL - MARGIN, HEIGHT + MARGIN - (np.arange(rows) + 0.5) * PIXEL)
    # How far a place is beyond each outline, negative inside.
    wall = (
        np.hypot(
            np.maximum(np.abs(x - WIDTH / 2.0) - WIDTH / 2.0 + CORNER, 0.0),
            np.maximum(np.abs(y - HEIGHT / 2.0) - HEIGHT / 2.0 + CORNER, 0.0),
        )
        - CORNER
    )
    boss = np.hypot(x - BOSS[0], y - BOSS[1]) - BOSS[2]
    cx, cy, half, radius, degrees = SLOT
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    u, v = (x - cx) * cos + (y - cy) * sin, (y - cy) * cos - (x - cx) * sin
    slot = np.hypot(np.maximum(np.abs(u) - half, 0.0), v) - radius
    outside = np.maximum(wall, np.maximum(-boss, -slot))
    return Image.fromarray((np.clip(0.5 + outside / PIXEL, 0.0, 1.0) * 255.0).round().astype(np.uint8))


def main(folder: Path = Path(__file__).parent) -> None:
    """Write both into `folder`."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    # Without dates, names and random numbers of the program that writes.
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        drawing().saveas(folder / "pocket.dxf")
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    picture().save(folder / "pocket.png", optimize=True)


if __name__ == "__main__":
    main()
