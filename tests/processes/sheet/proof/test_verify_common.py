"""The proof of common lines: right programs are accepted, and every fault of a line that two parts share is caught."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import pytest
from proved_sheets import CLEARANCE, STEEL, laid, machine_for

from cut_sheets import in_order, rectangle, sheet_of, split_rectangle, square
from golden_differences import check_golden
from leafcut.errors import PlanError
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.model.cutting import Cut, CutPlan
from leafcut.model.difference import Difference
from leafcut.model.problem import Metric
from leafcut.model.sheet import Sheet
from leafcut.options import PostOptions
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cut_rules import CutRules, resolve_rules
from leafcut.processes.sheet.plan.cutting import HeadTravel, drawing_order, prepare_cutting
from leafcut.processes.sheet.plan.moved_starts import clear_pierces_of_kerfs, with_leads_apart
from leafcut.processes.sheet.post import write_cut_program
from leafcut.processes.sheet.proof.cut_motion import read_cut_program
from leafcut.processes.sheet.proof.matched_runs import CutRequest
from leafcut.processes.sheet.proof.sheet import check_sheet

Cuts = tuple[Cut, ...]
PITCH = 60 + STEEL.kerf


def four() -> Sheet:
    """Four squares of 60 mm a kerf apart, the first with a hole."""
    boxes = [(square(40 + i * PITCH, 40 + j * PITCH, 60), 0, -1, 1 + i + 2 * j) for j in range(2) for i in range(2)]
    return sheet_of(*boxes, (Polyline.circle(70, 70, 12), 1, 0, 1), size=240)


def planned() -> tuple[Cuts, CutRules]:
    """Hole, the line through, the two lines that end at it, and what is around."""
    rules = resolve_rules(STEEL, CutOptions(common_lines=True), switches=True)
    cutting = prepare_cutting(four(), rules)
    return tuple(cutting.cut(s) for s in drawing_order(cutting)), rules


def wrong(cuts: Cuts, rules: CutRules, sheet: Sheet | None = None) -> list[Difference]:
    plan = CutPlan(sheet or four(), STEEL, cuts)
    text = write_cut_program(plan, laid(cuts), load_dialect("qtplasmac"), PostOptions(), ["four"])
    asked = CutRequest(rules.half, safe_height=CLEARANCE)
    words = load_dialect("qtplasmac")
    return check_sheet(
        plan.sheet, plan, text, read_cut_program(text, plan, words), words, machine_for("qtplasmac"), asked
    )


@pytest.mark.hazard
def test_a_right_program_is_accepted() -> None:
    cuts, rules = planned()
    assert [round(c.common) for c in cuts] == [0, 120, 60, 60, 0]
    assert wrong(cuts, rules) == []


def late_line(cuts: Cuts) -> Cuts:
    """A line after the cut around the parts."""
    return (*cuts[:3], cuts[4], cuts[3])


def late_hole(cuts: Cuts) -> Cuts:
    """The hole after a line of its part."""
    return (*cuts[1:3], cuts[0], *cuts[3:])


def dropped(cuts: Cuts) -> Cuts:
    """One of the lines is left out."""
    return (*cuts[:2], *cuts[3:])


def twice(cuts: Cuts) -> Cuts:
    """A line that ends at another one goes on along it."""
    x, y = cuts[2].path.end
    path = concatenate(cuts[2].path, Polyline.of_points([(x, y), (x + 20, y)]))
    return (*cuts[:2], replace(cuts[2], path=path, lead_out=path.length, torch_off_at=path.length), *cuts[3:])


def across(cuts: Cuts) -> Cuts:
    """A line goes across the one through, and the last one is not there."""
    (x, y), (_, v) = cuts[2].path.start, cuts[3].path.start
    path = Polyline.of_points([(x, y), (x, v)])
    return (*cuts[:2], replace(cuts[2], path=path, lead_out=path.length, torch_off_at=path.length), cuts[4])


def aside(cuts: Cuts) -> Cuts:
    """A line is a tenth of a millimetre off its middle."""
    return (*cuts[:3], replace(cuts[3], path=cuts[3].path.moved(0.1, 0.0)), cuts[4])


def short(cuts: Cuts) -> Cuts:
    """A line ends before it comes to the other kerf."""
    path = cuts[3].path
    return (*cuts[:3], replace(cuts[3], path=path.piece(0.0, path.length - 5.0)), cuts[4])


def turned(cuts: Cuts) -> Cuts:
    """The outer path has the opposite direction."""
    path = cuts[4].path.reversed()
    return (*cuts[:4], replace(cuts[4], path=path))


@pytest.mark.hazard
@pytest.mark.parametrize(
    "fault, word",
    [
        (late_line, "out of order"),
        (late_hole, "out of order"),
        (dropped, "incomplete"),
        (twice, "cut twice"),
        (across, "crosses a kerf"),
        (aside, "cuts into a part"),
        (short, "incomplete"),
        (turned, "direction"),
    ],
)
def test_a_fault_is_caught(fault: Callable[[Cuts], Cuts], word: str) -> None:
    cuts, rules = planned()
    found = wrong(fault(cuts), rules)
    assert word in {d.what for d in found}, fault.__doc__
    check_golden("sheet_differences.toml", "common lines", fault.__name__, found)


def test_an_edge_that_is_cut_twice_is_told_with_the_place_where_that_begins() -> None:
    """The line along X100.75 ends at the line along Y100.75 and continues along it: both are reported."""
    cuts, rules = planned()
    texts = [d.text for d in wrong(twice(cuts), rules) if d.what == "cut twice"]
    assert len(texts) == 2
    assert all(re.fullmatch(r"an edge of two parts is cut twice at X100\.7\d\d Y100\.7\d\d", text) for text in texts)


def test_a_kerf_along_the_edge_of_a_part_does_not_let_the_part_go() -> None:
    """Without common lines a hole may be cut after the neighbour of its part, a kerf away."""
    rules = resolve_rules(STEEL, CutOptions(), switches=True)
    cutting = prepare_cutting(four(), rules)
    by_contour = {c.contours[0]: c for c in (cutting.cut(s) for s in cutting.starts)}
    found = {d.what for d in wrong(tuple(by_contour[k] for k in (3, 1, 4, 0, 2)), rules)}
    assert "out of order" not in found
    found = {d.what for d in wrong(tuple(by_contour[k] for k in (3, 1, 0, 4, 2)), rules)}
    assert "out of order" in found


@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=[pytest.mark.slow] if seed > 9 else []) for seed in range(24)]
)
def test_whatever_a_rectangle_is_split_into_is_proved_or_refused(seed: int) -> None:
    """Also if the parts form several groups: the outer path of one group follows edges of another, a kerf away."""
    rules = resolve_rules(STEEL, CutOptions(common_lines=True), switches=True)
    boxes = split_rectangle(seed, STEEL.kerf)
    sheet = sheet_of(*((rectangle(*box), 0, -1, n) for n, box in enumerate(boxes, 1)), size=500)
    try:
        cutting = prepare_cutting(sheet, rules)
    except PlanError as refused:
        assert "no lead fits into the scrap" in str(refused)
        return
    order = list(clear_pierces_of_kerfs(in_order(cutting, drawing_order(cutting)), HeadTravel(Metric())).starts)
    cuts = tuple(cutting.cut(s) for s in list(with_leads_apart(in_order(cutting, order), HeadTravel(Metric())).starts))
    assert any(c.common for c in cuts) or len(boxes) == 1
    assert wrong(cuts, rules, sheet) == []
