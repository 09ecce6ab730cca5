"""Writes the built-in plates, a sheet to cut and a CAM's program into this folder: ``python examples/make_plates.py``.

The patterns are those of `leafcut.read.examples`, so ``leafcut optimize examples/plate_70.dxf`` and
``leafcut optimize example:plate-70`` are the same part. The bytes are the same on every run.
"""

from __future__ import annotations

import random
from pathlib import Path

import ezdxf
from ezdxf.enums import InsertUnits

from leafcut.read.examples import PLATE_NAMES, Plate, create_plate


def draw(plate: Plate) -> ezdxf.document.Drawing:
    """Return a drawing in inches: the outline on layer OUTLINE, the holes on layer HOLES in the plate's order."""
    drawing = ezdxf.new("R2000", units=InsertUnits.Inches)
    drawing.header["$MEASUREMENT"] = 0
    drawing.layers.add("OUTLINE", color=7)
    drawing.layers.add("HOLES", color=1)
    space = drawing.modelspace()
    corners = [(0, 0), (plate.width, 0), (plate.width, plate.height), (0, plate.height)]
    space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "OUTLINE"})
    for hole in plate.holes:
        space.add_circle((hole.x, hole.y), hole.diameter / 2, dxfattribs={"layer": "HOLES"})
    return drawing


def sheet() -> ezdxf.document.Drawing:
    """Return a nested sheet in mm: brackets, gussets, slots, flanges with a washer inside; its edge on layer SHEET."""
    drawing = ezdxf.new("R2000", units=InsertUnits.Millimeters)
    for layer, color in (("CUT", 7), ("SHEET", 8)):
        drawing.layers.add(layer, color=color)
    space, on = drawing.modelspace(), {"layer": "CUT"}
    space.add_lwpolyline([(0, 0), (600, 0), (600, 400), (0, 400)], close=True, dxfattribs={"layer": "SHEET"})
    for x, y in ((110, 290), (310, 290), (510, 110)):
        for radius in (80, 50, 30, 10):
            space.add_circle((x, y), radius, dxfattribs=on)
    for k in range(3):
        x, y = 20 + 130 * k, 20
        bracket = [(x, y), (x + 110, y), (x + 110, y + 40), (x + 40, y + 40), (x + 40, y + 160), (x, y + 160)]
        space.add_lwpolyline(bracket, close=True, dxfattribs=on)
        for u, v in ((20, 20), (85, 20), (20, 135)):
            space.add_circle((x + u, y + v), 6, dxfattribs=on)
        space.add_lwpolyline([(x + 60, y + 60), (x + 110, y + 60), (x + 60, y + 130)], close=True, dxfattribs=on)
    for x in (430, 530):
        slot = [(x, 230, 0.0), (x + 40, 230, 1.0), (x + 40, 270, 0.0), (x, 270, 1.0)]
        space.add_lwpolyline(slot, format="xyb", close=True, dxfattribs=on)
        space.add_lwpolyline([(u, v + 70, b) for u, v, b in slot], format="xyb", close=True, dxfattribs=on)
    return drawing


def program(plate: Plate, seed: int = 121) -> str:
    """Return a program in mm that centres and drills the plate, as a CAM writes it: holes in the order of drawing them.

    That order is arbitrary: here it is random.
    """
    places = [f"X{25.4 * h.x:.3f} Y{25.4 * h.y:.3f}" for h in plate.holes]
    shuffle = random.Random(seed).shuffle
    lines = [
        "%",
        "O0121 (BOARD 121, OP 10)",
        "(HOLES IN THE ORDER IN WHICH THEY WERE DRAWN)",
        "G21 G17 G40 G49 G80 G90",
    ]
    for tool, name, speed, cycle in (
        (1, "CENTRE DRILL", 3000, "G81 {} Z-1. R2. F150."),
        (2, "DRILL 1.0", 4000, "G83 {} Z-6. R2. Q1.5 F120."),
    ):
        shuffle(places)
        first, *rest = places
        lines += [f"T{tool} M6 ({name})", f"S{speed} M3", f"G0 G54 {first}", f"G43 H{tool} Z25.", "M8"]
        lines += [f"G99 {cycle.format(first)}", *rest, "G80", "M9", "G0 Z25.", "M5", "M1"]
    return "\n".join([*lines[:-1], "G91 G28 Z0.", "G90", "M30", "%", ""])


def main(folder: Path = Path(__file__).parent) -> None:
    """Write all drawings into `folder`."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    # Without dates, names and random numbers of the program that writes: a changed file is a changed plate.
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        for name in PLATE_NAMES:
            draw(create_plate(name)).saveas(folder / f"{name.replace('-', '_')}.dxf")
        sheet().saveas(folder / "sheet.dxf")
        (folder / "cam_121.nc").write_text(program(create_plate("board-121")), encoding="ascii", newline="\n")
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


if __name__ == "__main__":
    main()
