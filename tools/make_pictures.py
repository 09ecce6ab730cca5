"""Write the pictures for the README and for the pages on sheets, cutting data and curved parts."""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path

import ezdxf
from curved_part import FIXTURES, holes_csv, part_stl

import leafcut
from leafcut.processes.registry import report_of
from leafcut.report.page import path_svg, stock_pictures

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"


def main() -> None:
    """Write before.svg, after.svg, sheet_before.svg, sheet_after.svg, front.svg and surface.png to docs/pictures."""
    plate = leafcut.optimize("example:plate-70", thickness="0.25in")
    with tempfile.TemporaryDirectory() as folder:
        drawing = draw_sheet(Path(folder) / "brackets.dxf")
        surface, holes = Path(folder) / "cover.stl", Path(folder) / "holes.csv"
        surface.write_bytes(part_stl())
        holes.write_text(holes_csv(), encoding="utf-8")
        curved = leafcut.optimize(
            holes,
            process="drill",
            surface=surface,
            depth="through",
            fixture=FIXTURES,
            machine="linuxcnc-mill",
            threads=1,
        )
        sheet = leafcut.optimize(drawing, process="cut", machine="plasma-table", thickness="6mm", threads=1)
    for prefix, outcome in (("", plate), ("sheet_", sheet)):
        for which in ("before", "after"):
            (PICTURES / f"{prefix}{which}.svg").write_text(path_svg(report_of(outcome), which), encoding="utf-8")
    shown = stock_pictures(report_of(curved))
    assert shown is not None
    (_, picture, _), *_ = shown["pictures"]
    (PICTURES / "surface.png").write_bytes(base64.b64decode(picture.partition(",")[2]))
    leafcut.tool_speeds(
        ROOT / "examples" / "plate_70.dxf",
        material="c45",
        tools=ROOT / "examples" / "tools.toml",
        thickness="0.25in",
        machine="haas-vf2",
        plot=PICTURES / "front.svg",
    )


def draw_sheet(file: Path) -> Path:
    """Draw eight angle brackets with three holes each and two flanges on a sheet of 1000 × 500 mm, outlines first."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    corners = [(0, 0), (180, 0), (180, 60), (60, 60), (60, 180), (0, 180)]
    for x in (20, 230, 440, 650):
        for y, turn in ((20, 1), (480, -1)):
            space.add_lwpolyline([(x + u, y + turn * v) for u, v in corners], close=True, dxfattribs={"layer": "CUT"})
            for u, v in ((150, 30), (30, 30), (30, 150)):
                space.add_circle((x + u, y + turn * v), 14, dxfattribs={"layer": "CUT"})
    for y in (130, 370):
        space.add_circle((905, y), 75, dxfattribs={"layer": "CUT"})
        space.add_circle((905, y), 40, dxfattribs={"layer": "CUT"})
    edge = [(0, 0), (1000, 0), (1000, 500), (0, 500)]
    space.add_lwpolyline(edge, close=True, dxfattribs={"layer": "SHEET"})
    document.saveas(file)
    return file


if __name__ == "__main__":
    main()
