"""The same part in several fixtures: each work offset gets the whole part, and the tool retracts before each change."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_golden_part import GOLDEN, is_golden, without_comments

import leafcut
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.model.toolpath import Kind
from leafcut.processes.part.model import Edge, PartHole, PartRequest, TabRules
from leafcut.processes.part.proof.fixtures import judge_fixtures
from leafcut.processes.part.proof.part import judge_part
from leafcut.processes.part.report import PartReport
from leafcut.proof.program import interpret_written_program
from leafcut.report.wording import fact_line
from rs274_moves import run_rs274

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">
<path d="M0,0 L40,0 L40,40 L0,40 Z"/>{}</svg>"""
HOLE = '<circle cx="12" cy="20" r="2.5"/>'
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
LINUXCNC = load_dialect("linuxcnc")
OFFSETS = (540, 550, 570)
BOTTOM = -3.5
REQUEST = PartRequest(
    (Edge(Polyline.of_points([(0, 0), (40, 0), (40, 40), (0, 40)], closed=True), False, name="square", tabs=2),),
    (PartHole(12.0, 20.0, 2, BOTTOM - 2.5 / math.tan(math.radians(59))),),
    tool=5,
    radius=2.0,
    thickness=3.0,
    bottom=BOTTOM,
    tabs=TabRules(2, 6.0, 1.5),
)


def milled(folder: Path, shapes: str = HOLE, **options: Any) -> leafcut.ProgramResult:
    (folder / "part.svg").write_text(SVG.format(shapes))
    (folder / "tools.toml").write_text(TOOLS)
    common = {"thickness": 3, "tabs": 2, "origin": "lower-left", "threads": 1, "preset": "fast"}
    return leafcut.part(folder / "part.svg", tools=folder / "tools.toml", **{**common, **options})


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> str:
    return milled(tmp_path_factory.mktemp("fixtures"), copies="G54,G55,G57", machine="linuxcnc-mill").text


def judged(text: str, dialect: str = "linuxcnc", safe_z: float | None = 0.0) -> set[str]:
    written = interpret_written_program(text, load_dialect(dialect))
    return {str(one.what) for one in judge_fixtures(REQUEST, written, OFFSETS, safe_z, 10.0)}


def blocks(text: str) -> list[str]:
    return without_comments(text).splitlines()


@pytest.mark.hazard
def test_each_fixture_gets_the_whole_part_in_the_same_order(program: str) -> None:
    """The lines of a fixture alone, without those of the other fixtures, are a program of the part."""
    assert judged(program) == set()
    drilled, milled_part = re.split(r"(?=\(T5 )", program[program.index("(T2 drill D5") :])
    before, *holes = re.split(r"\nG5[57]\n", drilled)
    head, first = before.split("\nG0 X12 Y20\n")
    holes = ["G0 X12 Y20\n" + first, *(hole for hole in holes)]
    change, start, *edges = re.split(r"\nG5[457]\n", milled_part)
    spindle, first = re.split(r"\n(?=G0 X)", start, maxsplit=1)
    edges = [first, *edges]
    assert len(holes) == len(edges) == 3
    for hole, edge in zip(holes, edges, strict=True):
        stop = "" if "M5" in hole else "\nM5\n"
        text = "\n".join(["G21 G17 G90 G94 G54", head, hole + stop, change, spindle, "G43 H5", edge, "M2"])
        written = interpret_written_program(text.replace("G0 X12 Y20\nZ10", "G0 X12 Y20\nG43 H2 Z10"), LINUXCNC)
        assert judge_part(REQUEST, written) == []
    cuts = [[line for line in edge.splitlines() if not line.startswith(("G43", "Z2", "M"))] for edge in edges]
    assert cuts[0] == cuts[1] == cuts[2]


@pytest.mark.hazard
def test_linuxcnc_moves_to_each_fixture_at_machine_zero(rs274: str, program: str, tmp_path: Path) -> None:
    """The fixtures have different origins. Machine Z0 is the safe height."""
    heights = {1: -100.0, 2: -80.0, 4: -60.0}
    origins = "".join(f"G21 G10 L2 P{n} X{100 * n} Y50 Z{z:g}\n" for n, z in heights.items())
    status, said = run_rs274(rs274, origins + program, tmp_path)
    assert status == 0, said[-500:]
    moves: dict[int, list[tuple[str, ...]]] = {n: [] for n in heights}
    active, changed = 1, False
    height = math.nan
    for line in said.splitlines():
        match = re.search(r"(SET_G5X_OFFSET|STRAIGHT_TRAVERSE|STRAIGHT_FEED|ARC_FEED)\((.*)\)", line)
        if match is None:
            continue
        words = tuple(word.strip() for word in match[2].split(","))
        if match[1] == "SET_G5X_OFFSET":
            changed = changed or int(words[0]) != active
            active = int(words[0])
        elif match[1] == "STRAIGHT_TRAVERSE":
            z = float(words[2])
            if changed:
                assert z + heights[active] == pytest.approx(0.0, abs=1e-3)
                changed = False
            height = z + heights[active]
        else:
            assert not changed
            moves[active].append((match[1], *words))
    assert height == pytest.approx(0.0, abs=1e-3)
    assert moves[1]
    assert moves[1] == moves[2] == moves[4]


def without(text: str, block: str, number: int = 0) -> str:
    """Return a program without the occurrence `number` of a block."""
    lines = text.splitlines(keepends=True)
    del lines[[k for k, line in enumerate(lines) if line.strip() == block][number]]
    return "".join(lines)


def second_block_missing(text: str) -> str:
    return re.sub(r"(?s)\nG55\n.*?\n(?=G53 G0 Z0)", "\nG55\n", text, count=1)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda text: without(text, "G55"), "fixtures"),
        (lambda text: without(text, "G57", 1), "fixtures"),
        (lambda text: without(text, "G54"), "fixtures"),
        (lambda text: text.replace("\nG57\n", "\nG55\n", 1), "fixtures"),
        (lambda text: text.replace("\nG57\n", "\nG58\n", 1), "fixtures"),
        (
            lambda text: text.replace("\nG55\n", "\nG5x\n").replace("\nG57\n", "\nG55\n").replace("G5x", "G57"),
            "fixtures",
        ),
        (lambda text: text.replace("\nG57\n", "\nG54\n", 1), "fixtures"),
        *((lambda text, k=k: without(text, "G53 G0 Z0", k), "fixtures") for k in range(1, 6)),
        (lambda text: text.replace("G53 G0 Z0\nG55", "G53 G0 Z-20\nG55", 1), "fixtures"),
        (lambda text: text.replace("G55\nG0 X12 Y20", "G55\nG0 X12 Y20 Z2", 1), "fixtures"),
        (lambda text: text.replace("G55\nG0 X12 Y20", "G55\nG0 Z2\nX12 Y20", 1), "fixtures"),
        (second_block_missing, "fixtures"),
        (lambda text: re.sub(r"(G57\nG0 X12 Y20\n[^\n]*\n)G99 G81[^\n]*\n", r"\1", text), "hole"),
        (
            lambda text: re.sub(r"(?s)(.*)\nG0 Z10\nG53 G0 Z0\nG57", r"\1\nG1 X20 Y20\nG0 Z10\nG53 G0 Z0\nG57", text),
            "gouge",
        ),
        # A rapid into the plate from the unknown height after the change of the work offset.
        (
            lambda text: re.sub(r"(\nT5 M6(?:.|\n)*?\nG55\nG0 X[^\n]*\n)Z2\n", r"\1Z-1\n", text, count=1),
            "rapid into the part",
        ),
        (lambda text: text.replace("\nT2 M6", "\nG58\nG0 X1 Y1\nG0 Z5\nT2 M6", 1), "fixtures"),
    ],
)
def test_an_error_of_a_fixture_is_found(change: Any, what: str, program: str) -> None:
    changed = change(program)
    assert changed != program
    assert what in judged(changed)


def test_a_move_to_the_position_for_tool_changes_keeps_the_safe_height(program: str) -> None:
    moved = program.replace("\nT5 M6", "\nG53 G0 X-50 Y-50\nT5 M6", 1)
    assert moved != program
    assert "fixtures" not in judged(moved)


def test_a_tool_without_work_is_found(program: str) -> None:
    assert "fixtures" in judged(program.replace("\nT5 M6", "\nT9 M6\nT5 M6", 1))


@pytest.mark.hazard
def test_without_a_safe_height_the_tool_moves_at_the_clearance_height(tmp_path: Path) -> None:
    rate = {"feed": "600mm/min", "spindle_speed": 12000, "tool_number": 5}
    result = milled(tmp_path, "", copies="G54,G55,G57", machine="shapeoko-router", **rate)
    warning = next(one for one in result.issues if "between the fixtures" in one.message)
    assert "Z10" in warning.message
    written = interpret_written_program(result.text, load_dialect("grbl"))
    for row in np.flatnonzero(written.kind == Kind.FRAME).tolist():
        assert written.place_before(row)[2] == 10.0
        assert math.isnan(written[row + 1].end[2])
    low = re.sub(r"Z10\nG55", "Z2\nG55", result.text)
    request_alone = {"safe_z": None, "dialect": "grbl"}
    assert "fixtures" not in judged(result.text, **request_alone)
    assert "fixtures" in judged(low, **request_alone)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"copies": "G54"}, "give at least two work offsets, each only once"),
        ({"copies": "G54,G55,G54"}, "give at least two work offsets, each only once"),
        ({"copies": "G54,G53"}, "or a list of work offsets, such as G54,G55"),
        ({"copies": "G54,G59.1", "dialect": "haas"}, "haas programs have no work offset G59.1"),
        ({"copies": "G54,G55", "dialect": "siemens"}, "siemens programs have no work offset G55"),
        ({"copies": "G54,G55", "dialect": "marlin"}, "marlin programs have no work offset G54"),
        ({"copies": "G54,G55", "dialect": "grbl"}, "grbl has no tool lengths, so Z0 of each fixture would be wrong"),
        ({"copies": "G54,G55", "copy_spacing": 10}, "--copy-spacing: fixtures with their own work offsets"),
        ({"copies": "G54,G55", "pitch": (60, 60)}, "--pitch: fixtures with their own work offsets"),
    ],
)
def test_fixtures_that_do_not_suit_are_refused(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match=words):
        milled(tmp_path, **options)


def test_a_known_origin_belongs_to_g54_alone(tmp_path: Path) -> None:
    """The part leaves the travel of haas-vf2 (X -762 to 0 mm) in G54. The origins of G55 and G56 are unknown."""
    options = {"machine": "haas-vf2", "work_offset": (-20.0, -200.0, -300.0)}
    with pytest.raises(LeafcutError, match="outside the machine's travel"):
        milled(tmp_path, copies="G54,G55", **options)
    assert milled(tmp_path, copies="G55,G56", **options).work_offset == "G55, G56"


def test_the_report_names_the_fixtures(tmp_path: Path) -> None:
    result = milled(tmp_path, copies="G54,G55", machine="haas-vf2")
    answer = result.to_dict()
    each = pytest.approx(0.5 * answer["after"]["time_s"])
    assert answer["copies"] == {"count": 2, "work_offsets": ["G54", "G55"], "time_each_s": each}
    lines = {str(fact.name): fact_line(fact) for fact in PartReport(result).facts if fact.name}
    assert lines["Fixtures"] == "2, one plate each in G54, G55; moves between them are not included in the time"
    assert "(one plate each in G54, G55)" in result.text


def test_several_fixtures_are_the_golden_program(program: str) -> None:
    assert is_golden(GOLDEN / "fixtures_linuxcnc_mm.ngc", without_comments(program))
