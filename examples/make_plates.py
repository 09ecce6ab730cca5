"""Writes the built-in plates as DXF drawings into this folder: ``python examples/make_plates.py``.

The patterns are those of `leafcut.read.examples`, so ``leafcut optimize examples/plate_70.dxf`` and
``leafcut optimize example:plate-70`` are the same part. The bytes are the same on every run.
"""

from __future__ import annotations

from pathlib import Path

import ezdxf
from ezdxf.enums import InsertUnits

from leafcut.read.examples import PLATE_NAMES, Plate, plate


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


def main(folder: Path = Path(__file__).parent) -> None:
    """Write all drawings into `folder`."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    # Without dates, names and random numbers of the program that writes: a changed file is a changed plate.
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        for name in PLATE_NAMES:
            draw(plate(name)).saveas(folder / f"{name.replace('-', '_')}.dxf")
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


if __name__ == "__main__":
    main()
