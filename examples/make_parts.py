"""Draws parts into this folder: ``python examples/make_parts.py``.

A bracket (DXF) and a gusset (SVG) are to be nested. A name plate (DXF) has a layer for each operation of a mill, and a
door sign (DXF) has letters to carve with a V-bit.

The bracket is an L of 180 × 140 mm, 50 mm wide, with rounded corners and a hole in either leg. The gusset is a
triangle of 160 × 100 mm with its corners cut and a hole. The name plate of 80 × 50 mm has a pocket with an island,
letters, four holes and a window. The door sign of 90 × 50 mm has the letters LEAF as outlines, a leaf, and two holes.
"""

from __future__ import annotations

import math
from pathlib import Path

import ezdxf
from ezdxf.enums import InsertUnits

GUSSET = """<svg xmlns="http://www.w3.org/2000/svg" width="160mm" height="100mm" viewBox="0 0 160 100">
<path d="M15 100H150L160 90V85L30 0H10L0 10V85Z"/>
<circle cx="48" cy="62" r="15"/>
</svg>
"""


def bracket() -> ezdxf.document.Drawing:
    """Return the bracket, mm."""
    made = ezdxf.new("R2000", units=InsertUnits.Millimeters)
    quarter = math.tan(math.pi / 8.0)
    outline = [
        (10, 0, 0.0), (170, 0, quarter), (180, 10, 0.0), (180, 40, quarter), (170, 50, 0.0), (65, 50, -quarter),
        (50, 65, 0.0), (50, 130, quarter), (40, 140, 0.0), (10, 140, quarter), (0, 130, 0.0), (0, 10, quarter),
    ]  # fmt: skip
    space = made.modelspace()
    space.add_lwpolyline(outline, format="xyb", close=True)
    space.add_circle((145, 25), 11)
    space.add_circle((25, 105), 11)
    return made


def nameplate() -> ezdxf.document.Drawing:
    """Return the name plate, mm, on the layers OUTLINE, POCKET_3, TEXT, HOLES and NOTES."""
    made = ezdxf.new("R2000", units=InsertUnits.Millimeters)
    quarter, space = math.tan(math.pi / 8.0), made.modelspace()
    outline, pocket, text, holes = ({"layer": name} for name in ("OUTLINE", "POCKET_3", "TEXT", "HOLES"))
    edge = [
        (5, 0, 0.0), (75, 0, quarter), (80, 5, 0.0), (80, 45, quarter), (75, 50, 0.0), (5, 50, quarter), (0, 45, 0.0),
        (0, 5, quarter),
    ]  # fmt: skip
    space.add_lwpolyline(edge, format="xyb", close=True, dxfattribs=outline)
    space.add_lwpolyline([(52, 16), (68, 16), (68, 28), (52, 28)], close=True, dxfattribs=outline)
    space.add_lwpolyline([(12, 12), (44, 12), (44, 30), (12, 30)], close=True, dxfattribs=pocket)
    space.add_circle((28, 21), 3, dxfattribs=pocket)
    space.add_lwpolyline([(18, 44), (18, 36), (23, 36)], dxfattribs=text)
    space.add_arc((32, 40), 4, 45, 315, dxfattribs=text)
    space.add_circle((45, 40), 4, dxfattribs=text)
    for x, y in ((6, 6), (74, 6), (74, 44), (6, 44)):
        space.add_circle((x, y), 2.5, dxfattribs=holes)
    note = space.add_text("Mill 3 mm deep", height=2.5, dxfattribs={"layer": "NOTES"})
    note.set_placement((12, -6))
    return made


#: Outlines of the letters L, E, A (with its triangle) and F, 16 mm high, and the position of each letter in X, mm.
LETTERS = (
    (10, [(0, 0), (9, 0), (9, 3), (3, 3), (3, 16), (0, 16)]),
    (23, [(0, 0), (9, 0), (9, 3), (3, 3), (3, 7), (8, 7), (8, 9), (3, 9), (3, 13), (9, 13), (9, 16), (0, 16)]),
    (35, [(0, 0), (3.2, 0), (4.4, 4), (9.6, 4), (10.8, 0), (14, 0), (9, 16), (5, 16)]),
    (35, [(5.3, 7), (7, 12.4), (8.7, 7)]),
    (52, [(0, 0), (3, 0), (3, 7), (8, 7), (8, 9.5), (3, 9.5), (3, 13), (9, 13), (9, 16), (0, 16)]),
)


def sign() -> ezdxf.document.Drawing:
    """Return the door sign, mm, on the layers OUTLINE, HOLES and CARVED."""
    made = ezdxf.new("R2000", units=InsertUnits.Millimeters)
    quarter, space = math.tan(math.pi / 8.0), made.modelspace()
    outline, holes, carved = ({"layer": name} for name in ("OUTLINE", "HOLES", "CARVED"))
    edge = [
        (6, 0, 0.0), (84, 0, quarter), (90, 6, 0.0), (90, 44, quarter), (84, 50, 0.0), (6, 50, quarter), (0, 44, 0.0),
        (0, 6, quarter),
    ]  # fmt: skip
    space.add_lwpolyline(edge, format="xyb", close=True, dxfattribs=outline)
    for x in (10, 80):
        space.add_circle((x, 42), 2, dxfattribs=holes)
    for x, corners in LETTERS:
        space.add_lwpolyline([(x + dx, 18 + dy) for dx, dy in corners], close=True, dxfattribs=carved)
    leaf = [(66, 20, 0.35), (80, 34, 0.35)]
    space.add_lwpolyline(leaf, format="xyb", close=True, dxfattribs=carved)
    space.add_circle((45, 10), 1.5, dxfattribs=carved)
    return made


def main(folder: Path = Path(__file__).parent) -> None:
    """Write all parts into `folder`."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    # Without dates, names and random numbers of the program that writes.
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        bracket().saveas(folder / "bracket.dxf")
        nameplate().saveas(folder / "nameplate.dxf")
        sign().saveas(folder / "sign.dxf")
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    (folder / "gusset.svg").write_text(GUSSET, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
