"""Draws two parts to be nested into this folder, a bracket (DXF) and a gusset (SVG): ``python examples/make_parts.py``.

The bracket is an L of 180 × 140 mm, 50 mm wide, with rounded corners and a hole in either leg. The gusset is a
triangle of 160 × 100 mm with its corners cut and a hole.
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


def main(folder: Path = Path(__file__).parent) -> None:
    """Write both into `folder`."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    # Without dates, names and random numbers of the program that writes.
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        bracket().saveas(folder / "bracket.dxf")
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    (folder / "gusset.svg").write_text(GUSSET, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
