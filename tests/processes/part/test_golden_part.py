"""Golden programs of a small part with a drilled hole, an opening and tabs, and of the name plate; LinuxCNC accepts
them.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

import leafcut
from rs274_moves import run_rs274

GOLDEN = Path(__file__).parents[2] / "golden"
EXAMPLES = Path(__file__).parents[3] / "examples"
EXTENSIONS = {"linuxcnc": "ngc", "haas": "nc", "grbl": "nc"}
CASES = [("linuxcnc", "mm"), ("linuxcnc", "inch"), ("haas", "mm"), ("grbl", "mm")]
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">
<path d="M0,0 L60,0 L60,30 A10,10 0 0 1 50,40 L0,40 Z"/><circle cx="42" cy="20" r="6"/><circle cx="12" cy="20" r="2.5"/>
</svg>"""
TOOLS = """
[[tool]]
number = 2
diameter = "5 mm"
spindle_speed = "2000 rpm"
feed = "200 mm/min"
[[tool]]
number = 5
kind = "end-mill"
diameter = "4 mm"
spindle_speed = "3000 rpm"
feed = "400 mm/min"
"""


def program(folder: Path, dialect: str, units: str) -> str:
    """Return the program of the part without its comments."""
    (folder / "part.svg").write_text(SVG)
    (folder / "tools.toml").write_text(TOOLS)
    text = leafcut.part(
        folder / "part.svg",
        thickness=3,
        tools=folder / "tools.toml",
        tabs=2,
        dialect=dialect,
        output_units=units,
        origin="lower-left",
        threads=1,
        preset="fast",
    ).text
    return without_comments(text)


def without_comments(text: str) -> str:
    return "".join(f"{line}\n" for line in text.splitlines() if not re.match(r"\s*[(;]", line))


def nameplate() -> str:
    """Return the program of the name plate in the examples without its comments."""
    return without_comments(
        leafcut.part(
            EXAMPLES / "nameplate.dxf",
            operations=EXAMPLES / "nameplate.toml",
            thickness=6,
            tool_diameter=3,
            feed="600mm/min",
            spindle_speed=5000,
            threads=1,
            preset="fast",
        ).text
    )


def is_golden(file: Path, text: str) -> bool:
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        file.write_text(text, encoding="ascii")
    return file.read_text(encoding="ascii") == text


@pytest.mark.parametrize("dialect, units", CASES)
def test_a_part_is_the_golden_program(dialect: str, units: str, tmp_path: Path) -> None:
    file = GOLDEN / f"part_{dialect}_{units}.{EXTENSIONS[dialect]}"
    assert is_golden(file, program(tmp_path, dialect, units))


def test_the_name_plate_is_the_golden_program() -> None:
    assert is_golden(GOLDEN / "nameplate_linuxcnc_mm.ngc", nameplate())


def test_the_board_is_the_golden_program(rs274: str, tmp_path: Path) -> None:
    text = leafcut.part(
        EXAMPLES / "board.zip",
        operations=EXAMPLES / "board.toml",
        tools=EXAMPLES / "board_tools.toml",
        tool_number=1,
        thickness=1.6,
        tab_width=2,
        machine="shapeoko-router",
        threads=1,
        preset="fast",
    ).text
    assert is_golden(GOLDEN / "board_grbl_mm.nc", without_comments(text))
    status, said = run_rs274(rs274, text, tmp_path)
    assert status == 0, said[-500:]


@pytest.mark.parametrize("dialect, units", [case for case in CASES if case[0] != "haas"])
def test_linuxcnc_accepts_a_golden_part(rs274: str, dialect: str, units: str, tmp_path: Path) -> None:
    status, said = run_rs274(rs274, program(tmp_path, dialect, units), tmp_path)
    assert status == 0, said[-500:]
