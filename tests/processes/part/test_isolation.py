"""Isolation milling of boards: grooves separate the copper and never enter it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import leafcut
from boards import DRILLS, archive, edge, gerber, rectangle
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.model.toolpath import Kind
from leafcut.processes.part.model import Isolation, PartRequest, TabRules
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

RULES = '[layer]\n"COPPER" = "isolate 0.1mm T6"\n"OUTLINE" = "profile"\n"HOLES" = "bore"\n'
#: The V-bit is 0.1 + 2 · 0.1 · tan(45°) = 0.3 mm wide at a depth of 0.1 mm.
TOOLS = """
[[tool]]
number = 1
kind = "end-mill"
diameter = "1 mm"
spindle_speed = "6000 rpm"
feed = "200 mm/min"
[[tool]]
number = 2
diameter = "0.8 mm"
spindle_speed = "6000 rpm"
feed = "60 mm/min"
[[tool]]
number = 6
kind = "v-bit"
diameter = "3 mm"
tip_diameter = "0.1 mm"
point_angle = "90 deg"
spindle_speed = "6000 rpm"
feed = "200 mm/min"
"""
#: Two pads 0.3 mm apart, a pad 2 mm away, and a frame around a pad.
PADS = [(4000, 1000, 6000, 2000), (6300, 1000, 8000, 2000), (10000, 1000, 12000, 2000), (6500, 5500, 7500, 6500)]
COPPER = "".join(rectangle(*pad) for pad in PADS[:3]) + rectangle(5000, 4000, 9000, 8000) + "%LPC*%\n"
COPPER += rectangle(6000, 5000, 8000, 7000) + "%LPD*%\n" + rectangle(*PADS[3])


def area(copper: str = COPPER) -> Any:
    boxes = [shapely.box(*(0.001 * v for v in pad)) for pad in PADS]
    return shapely.union_all([*boxes, shapely.box(5, 4, 9, 8) - shapely.box(6, 5, 8, 7)])


def milled(folder: Path, rules: str = RULES, copper: str = COPPER, **options: Any) -> leafcut.ProgramResult:
    files = {"b-F_Cu.gbr": gerber(copper), "b-Edge_Cuts.gbr": edge(0, 0, 20000, 10000), "b.drl": DRILLS}
    files["b-B_Cu.gbr"] = gerber(rectangle(1000, 4000, 2000, 5000), "Copper,L2,Bot")
    (folder / "board.zip").write_bytes(archive(files))
    (folder / "tools.toml").write_text(TOOLS)
    (folder / "rules.toml").write_text(rules)
    given: dict[str, Any] = {"tools": folder / "tools.toml", "tool_number": 1, "operations": folder / "rules.toml"}
    given |= {"thickness": 1.6, "tab_width": 2, "preset": "fast", "threads": 1}
    return leafcut.part(folder / "board.zip", folder / "board.ngc", **{**given, **options})


def swept(outcome: leafcut.ProgramResult, radius: float = 0.15) -> Any:
    path = outcome.written
    change = np.maximum.accumulate(np.where(path.kind == Kind.TOOL, np.arange(len(path.kind)), 0))
    tool = path.ref[change]
    rows = np.flatnonzero((tool == 6) & (path.kind == Kind.FEED) & (path.end[:, 2] < -0.05))
    lines = [shapely.LineString([path.before[k, :2], path.end[k, :2]]) for k in rows.tolist()]
    return shapely.union_all(lines).buffer(radius, quad_segs=32)


@pytest.mark.hazard
@pytest.mark.parametrize("passes", [1, 3])
def test_grooves_separate_all_copper_and_enter_none(passes: int, tmp_path: Path) -> None:
    """The width of the groove is 2 r plus 1.6 r for each further pass."""
    outcome = milled(tmp_path, RULES.replace("T6", f"T6 passes {passes}"))
    assert not any(issue.code == "L707" for issue in outcome.issues)
    groove, copper = swept(outcome), area()
    assert groove.intersection(copper.buffer(-0.008)).is_empty
    left = shapely.box(0, 0, 20, 10) - groove
    own = [sum(rest.buffer(0.01).covers(pad.buffer(-0.02)) for pad in copper.geoms) for rest in left.geoms]
    assert max(own) == 1 and sum(own) == len(copper.geoms) == 5
    alone = shapely.box(10, 1, 12, 2)
    width = 0.3 + 0.24 * (passes - 1)
    assert groove.buffer(0.006).covers(alone.buffer(width - 0.006) - alone.buffer(0.006))
    rows = {(row.layer, row.operation): row for row in outcome.detail.layers}
    assert rows["COPPER", "isolate"].shapes == 5 and ("HOLES", "drill") in rows and ("OUTLINE", "profile") in rows
    assert outcome.detail.tabs == 4


@pytest.mark.hazard
def test_a_gap_narrower_than_the_groove_is_missing_work_with_its_place(tmp_path: Path) -> None:
    outcome = milled(tmp_path, copper=rectangle(4000, 1000, 6000, 2000) + rectangle(6250, 1000, 8000, 2000))
    (issue,) = [issue for issue in outcome.issues if issue.code == "L707"]
    assert "1 gap of copper narrower than the groove of T6" in str(issue) and "0.3 mm" in str(issue)
    assert issue.missing is not None and issue.missing.where[0][0] == pytest.approx(6.125)
    assert swept(outcome).intersection(shapely.box(4.01, 1.01, 5.99, 1.99)).is_empty


@pytest.mark.parametrize("gap", [285, 290, 296, 300])
def test_a_board_with_gaps_near_the_width_of_the_groove_is_milled(gap: int, tmp_path: Path) -> None:
    """One gap is between two shapes, the other is a notch in a shape; the groove is 0.3 mm wide."""
    notched = (
        rectangle(4000, 4000, 6000, 6000) + rectangle(6000 + gap, 4000, 8000, 6000) + rectangle(4000, 6000, 8000, 7000)
    )
    outcome = milled(
        tmp_path, copper=notched + rectangle(4000, 1000, 6000, 2000) + rectangle(6000 + gap, 1000, 8000, 2000)
    )
    assert [issue.code for issue in outcome.issues if issue.missing] == ["L707"] * (gap < 292)
    cut = swept(outcome).buffer(0.006)
    assert cut.covers(shapely.box(6.01, 1.1, 6.0 + 0.001 * gap - 0.01, 1.9)) == (gap > 292)


def test_the_bottom_side_is_mirrored_about_the_middle_of_the_board(tmp_path: Path) -> None:
    outcome = milled(tmp_path, side="bottom")
    assert swept(outcome).bounds == pytest.approx((17.7, 3.7, 19.3, 5.3), abs=0.01)
    assert any(issue.code == "L447" for issue in outcome.issues)


@pytest.mark.hazard
def test_both_sides_have_the_same_zero_whatever_lies_beside_the_board(tmp_path: Path) -> None:
    beside = COPPER + rectangle(-8000, 1000, -7000, 2000)
    programs = [milled(tmp_path, copper=beside, side=side, origin="lower-left") for side in ("top", "bottom")]
    holes = [
        {(round(x, 3), round(y, 3)) for x, y in program.written.end[program.written.kind == Kind.DRILL, :2].tolist()}
        for program in programs
    ]
    assert holes[0] and {(round(20.0 - x, 3), y) for x, y in holes[0]} == holes[1]


def test_linuxcnc_accepts_the_program(rs274: str, tmp_path: Path) -> None:
    outcome = milled(tmp_path)
    assert outcome.text == milled(tmp_path).text
    status, said = run_rs274(rs274, outcome.text, tmp_path)
    assert status == 0, said


@pytest.mark.hazard
@pytest.mark.parametrize(
    "rules, words",
    [
        (RULES.replace("T6", "T2"), "not a milling tool"),
        (RULES.replace("0.1mm", "1.5mm"), "T6 v-bit Ø3 is too narrow to cut 1.5 mm deep"),
        (RULES.replace("T6", "T6 passes 0"), "not an operation|passes"),
        (RULES.replace('"bore"', '"pocket 0.1mm passes 2"'), "'passes' is only for 'isolate'"),
        (RULES.replace("0.1mm ", ""), "needs a depth"),
        (None, "a board needs an operation for each layer"),
        (RULES.replace('"profile"', '"isolate 0.1mm T6"'), "only one layer can be isolated"),
    ],
)
def test_an_isolation_that_cannot_be_milled_is_refused(rules: str | None, words: str, tmp_path: Path) -> None:
    options = {"operations": None} if rules is None else {}
    with pytest.raises(LeafcutError, match=words):
        milled(tmp_path, rules or RULES, **options)


@pytest.mark.hazard
def test_a_v_bit_without_a_tip_and_a_drawing_that_is_no_board_are_refused(tmp_path: Path) -> None:
    milled(tmp_path)
    (tmp_path / "sharp.toml").write_text(TOOLS.replace('tip_diameter = "0.1 mm"', ""))
    with pytest.raises(LeafcutError, match=r"T6 .* needs its tip_diameter"):
        milled(tmp_path, tools=tmp_path / "sharp.toml")
    (tmp_path / "pads.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="9mm" viewBox="0 0 20 9">'
        '<g id="COPPER"><rect x="1" y="1" width="5" height="5"/></g></svg>'
    )
    (tmp_path / "svg.toml").write_text('[layer]\n"*" = "isolate 0.1mm T6"\n')
    with pytest.raises(LeafcutError, match="only for circuit boards"):
        leafcut.part(
            tmp_path / "pads.svg", tools=tmp_path / "tools.toml", tool_number=1, operations=tmp_path / "svg.toml",
            thickness=1.6,
        )  # fmt: skip


#: One pad from (0, 0) to (2, 1); a tool with a radius of 0.15 mm.
PAD = shapely.box(0, 0, 2, 1)


def judged(
    offset: float = 0.15, depth: float = 0.1, left_out: float = 0.0, twice: bool = False, two: bool = False
) -> str:
    copper = shapely.union(PAD, shapely.box(2.5, 0, 4, 1)) if two else PAD
    rings = [piece.buffer(offset, quad_segs=32).exterior for piece in shapely.get_parts(copper)]
    rows = ["%", "G21 G17 G90 G94 G40 G80", "T6 M6", "S10000 M3", "G0 Z5"]
    for ring in rings * (2 if twice else 1):
        points = [p for p in ring.coords if not (left_out and p[0] > 2.0 - left_out)] if left_out else list(ring.coords)
        rows += [f"G0 X{points[0][0]:.4f} Y{points[0][1]:.4f}", f"G1 Z{-depth} F100"]
        rows += [f"G1 X{x:.4f} Y{y:.4f}" for x, y in points[1:]] + ["G0 Z5"]
    text = "\n".join([*rows, "M5", "M2", "%", ""])
    request = PartRequest(
        edges=(), holes=(), tool=1, radius=0.5, thickness=1.6, bottom=-1.8, tabs=TabRules(0, 1.0, 0.5),
        isolations=(Isolation(copper, 0.1, 6, 0.15, 1, "COPPER"),),
    )  # fmt: skip
    return " ".join(map(str, judge_part(request, interpret_written_program(text, load_dialect("linuxcnc")))))


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, words",
    [
        ({"depth": 0.08}, "is not isolated 0.1 mm deep"),
        ({"depth": 0.13}, "the cut uses tool 6, not tool 1"),
        ({"offset": 0.12}, "the cut uses tool 6, not tool 1"),
        ({"offset": 0.19}, "the cut uses tool 6, not tool 1"),
        ({"offset": -0.15}, "is not isolated"),
        ({"left_out": 1.0}, "is not isolated"),
        ({"twice": True}, "is isolated 2"),
    ],
)
def test_the_proof_finds_every_wrong_groove(change: dict[str, Any], words: str) -> None:
    assert judged() == "" and judged(two=True) == ""
    assert words in judged(**change)
