"""The order of a sheet: precedence, bands, heat, sliding starts, and kept plans."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cut_sheets import (
    LASER,
    PLASMA,
    assert_leads_in_scrap,
    assert_nothing_is_gouged,
    cutting_of,
    in_order,
    part_in_hole,
    part_in_notch,
    ring,
    sheet_of,
    square,
    two_squares,
)
from leafcut.errors import OptionError, PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.cutting import CutPlan, Lead, PlanFile
from leafcut.model.problem import Metric
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cutting import (
    Cutting,
    HeadTravel,
    build_problem,
    drawing_order,
    sweep_bands,
    total_travel,
)
from leafcut.processes.sheet.plan.heat import hot_start_pairs, spread_starts
from leafcut.processes.sheet.plan.moved_starts import slide_starts
from leafcut.processes.sheet.plan.plan_file import check_plan_fits_drawing, order_as_planned, restrict_starts_to_plan
from leafcut.processes.sheet.spec import parse_sheet_size, with_size_and_zones
from leafcut.read.plan_file import load_plan, plan_file_text

DISTANCE = Metric()


def problem_of(cutting: Cutting, metric: Metric = DISTANCE, overhead: float = 0.0):
    return build_problem(cutting, range(len(cutting.contours)), HeadTravel(metric, overhead, (0.0, 0.0)))


@pytest.mark.hazard
@pytest.mark.parametrize(
    "mouth, compensation, closed",
    [(0.5, "geometry", True), (2.9, "geometry", True), (3.2, "geometry", False), (0.5, "none", True)],
)
def test_a_part_in_a_notch_that_the_kerf_closes_is_cut_first(mouth: float, compensation: str, closed: bool) -> None:
    """The kerf is 1.5 mm; two of them close a mouth below 3 mm, and detach the scrap in the notch with the part."""
    cutting = cutting_of(part_in_notch(mouth), compensation=compensation, small_hole=0.0)
    order = [cutting.contours[s.contour].index for s in drawing_order(cutting)]
    assert order == ([2, 1, 0] if closed else [0, 2, 1])
    swept = sweep_bands(cutting, CutOptions(sweep="x"), width=1.0)
    assert len(swept) == (1 if closed else 2)


def assert_legal(cutting: Cutting, order) -> None:
    """Inner before outer and marks before cuts, seen from the sheet alone; every contour once."""
    at = {cutting.contours[s.contour].index: k for k, s in enumerate(order)}
    assert len(order) == len(at) == len(cutting.contours)
    contours = cutting.sheet.contours
    for index, place in at.items():
        around = contours[index].parent
        while around >= 0:
            assert at.get(around, math.inf) > place
            around = contours[around].parent
        if contours[index].kind == "mark":
            for other, later in at.items():
                if contours[other].kind == "cut" and contours[other].part == contours[index].part:
                    assert later > place


def test_the_innermost_contours_come_first() -> None:
    cutting = cutting_of(part_in_hole())
    assert [cutting.contours[s.contour].index for s in drawing_order(cutting)] == [3, 2, 1, 0]
    problem = problem_of(cutting)
    assert {tuple(p) for p in problem.precedence.tolist()} == {(1, 0), (2, 1), (3, 2)}


def test_a_part_in_a_hole_too_narrow_to_be_cut_comes_before_what_is_around_the_hole() -> None:
    """The neck of the hole is 1 mm wide, the kerf 1.5 mm."""
    left, neck, right = (30, 70), (79.5, 80.5), (90, 130)
    hole = Polyline.of_points(
        [
            *((left[0], 40), (left[1], 40), (left[1], neck[0]), (right[0], neck[0]), (right[0], 40), (right[1], 40)),
            *(
                (right[1], 120),
                (right[0], 120),
                (right[0], neck[1]),
                (left[1], neck[1]),
                (left[1], 120),
                (left[0], 120),
            ),
        ],
        closed=True,
    )
    cutting = cutting_of(sheet_of((square(10, 10, 140), 0, -1, 1), (hole, 1, 0, 1), (square(40, 60, 20), 2, 1, 2)))
    assert [c.index for c in cutting.contours] == [0, 2]
    assert [cutting.contours[s.contour].index for s in drawing_order(cutting)] == [2, 0]
    assert cutting.contour_precedence == [(1, 0)]


def test_a_mark_comes_before_the_cuts_of_its_part() -> None:
    cutting = cutting_of(ring())
    assert [cutting.contours[s.contour].index for s in drawing_order(cutting)] == [2, 1, 0]


def test_a_node_costs_its_pierce_its_path_and_what_it_takes_to_come_down() -> None:
    """A square of 50 mm cut 0.75 mm outside is 4 · 50 + 2π · 0.75 long; leads of 6 mm, 20 mm/s, half a second."""
    cutting = cutting_of(two_squares(), lead_in="line", lead_out="line")
    problem = problem_of(cutting, Metric("linear", velocity=(100.0, 100.0), acceleration=(1e3, 1e3)), 1.25)
    full = [k for k, s in enumerate(cutting.starts) if s.lead_out.length == 6.0]
    wanted = (200.0 + 2.0 * math.pi * 0.75 + 6.0 + 6.0) / 20.0 + 0.5 + 1.25
    assert full
    assert problem.service[full] == pytest.approx(wanted, rel=1e-4)


def test_the_measure_of_the_literature_counts_the_ways_only() -> None:
    problem = problem_of(cutting_of(two_squares()))
    assert not problem.service.any()


def random_sheet(seed: int) -> Sheet:
    """Return parts of several shapes on a grid, some with holes, some of these with parts in them."""
    rng = np.random.default_rng(seed)
    contours: list[Contour] = []
    part = 0
    for i, j in itertools.product(range(2), range(2)):
        part += 1
        x, y, side = 20.0 + 130.0 * i, 20.0 + 130.0 * j, float(rng.uniform(40, 110))
        outline = square(x, y, side) if rng.random() < 0.5 else Polyline.circle(x + 55, y + 55, 0.5 * side)
        cx, cy = (x + 0.5 * side, y + 0.5 * side) if outline.n_segments == 4 else (x + 55, y + 55)
        outer = len(contours)
        contours.append(Contour(outline, depth=0, parent=-1, part=part))
        radius = float(rng.uniform(0.1, 0.4)) * side
        if rng.random() < 0.7:
            contours.append(Contour(Polyline.circle(cx, cy, radius), depth=1, parent=outer, part=part))
            if radius > 25.0:
                part += 1
                inner = square(cx - 7, cy - 7, 14)
                contours.append(Contour(inner, depth=2, parent=outer + 1, part=part))
    return Sheet("random", tuple(contours), square(0, 0, 290))


@settings(max_examples=settings().max_examples // 5)
@given(seed=st.integers(0, 10_000), heat=st.booleans(), laser=st.booleans())
def test_on_any_sheet_no_cut_gouges_and_inner_contours_come_first(seed: int, heat: bool, laser: bool) -> None:
    sheet, data = random_sheet(seed), LASER if laser else PLASMA
    cutting = cutting_of(sheet, data)
    order = drawing_order(cutting)
    before = total_travel((0.0, 0.0), order)
    slid = list(slide_starts(in_order(cutting, order), HeadTravel(DISTANCE, start=(0.0, 0.0))).starts)
    assert total_travel((0.0, 0.0), slid) <= before + 1e-6
    if heat:
        slid = list(spread_starts(in_order(cutting, slid), 60.0, HeadTravel(DISTANCE, start=(0.0, 0.0))).starts)
        assert len(hot_start_pairs(slid, 60.0)) <= len(hot_start_pairs(order, 60.0))
    assert_legal(cutting, slid)
    cuts = [cutting.cut(s) for s in slid]
    assert_nothing_is_gouged(sheet, cuts, data.kerf)
    assert_leads_in_scrap(sheet, cuts, data.kerf)


def test_starts_slide_to_the_shortest_polyline() -> None:
    """Two circles of radius 20 without leads, from (0, 50): the shortest way touches both on their common line."""
    sheet = sheet_of((Polyline.circle(60, 50, 20), 0, -1, 1), (Polyline.circle(160, 50, 20), 0, -1, 2))
    cutting = cutting_of(sheet, lead_in="none", lead_out="none", compensation="none")
    slid = list(
        slide_starts(
            in_order(cutting, drawing_order(cutting)),
            HeadTravel(DISTANCE, start=(0.0, 50.0), end=(200.0, 50.0)),
        ).starts
    )
    # From the left point of the first circle on, every straight way through both circles is as short as it can be.
    assert total_travel((0.0, 50.0), slid) + math.dist(slid[-1].exit, (200.0, 50.0)) == pytest.approx(200.0, abs=0.05)


def test_cuts_beside_each_other_are_not_made_one_after_the_other() -> None:
    """Four squares in a row, 30 mm apart: any order but neighbour after neighbour keeps 60 mm between starts."""
    sheet = sheet_of(*((square(20 + 40 * k, 20, 30), 0, -1, k + 1) for k in range(4)))
    cutting = cutting_of(sheet)
    rule = 45.0
    order = drawing_order(cutting)
    spread = list(spread_starts(in_order(cutting, order), rule, HeadTravel(DISTANCE)).starts)
    assert hot_start_pairs(order, rule)
    assert not hot_start_pairs(spread, rule)
    assert_legal(cutting, spread)


def test_a_sweep_goes_from_band_to_band_with_all_that_is_in_a_part() -> None:
    sheet = sheet_of(
        (square(220, 20, 60), 0, -1, 1), (square(20, 20, 60), 0, -1, 2),
        (Polyline.circle(50, 50, 20), 1, 1, 2), (square(120, 20, 60), 0, -1, 3),
    )  # fmt: skip
    cutting = cutting_of(sheet)
    assert sweep_bands(cutting, CutOptions()) == [[0, 1, 2, 3]]
    assert sweep_bands(cutting, CutOptions(sweep="x")) == [[1, 2], [3], [0]]
    assert sweep_bands(cutting, CutOptions(sweep="-x")) == [[0], [3], [1, 2]]
    assert sweep_bands(cutting, CutOptions(sweep="y")) == [[0, 1, 2, 3]]


def test_a_part_outside_the_sheet_of_the_given_size_is_named() -> None:
    none = np.zeros((0, 4))
    assert with_size_and_zones(two_squares(), CutOptions(sheet_size="200x100"), none).outline is not None
    with pytest.raises(PlanError, match=r"part 2.*outside the sheet of 100 × 100 mm"):
        with_size_and_zones(two_squares(), CutOptions(sheet_size="100x100"), none)
    for wrong in ("100", "axb", "0x10", "1e9x1", "nanx3"):
        with pytest.raises(OptionError, match="--sheet-size"):
            parse_sheet_size(wrong)


# -- plan files ------------------------------------------------------------------------------------------------------


def saved(cutting: Cutting, order, tmp_path, edit=lambda text: text):
    cuts = tuple(cutting.cut(s) for s in order)
    file = tmp_path / "plan.json"
    file.write_text(edit(plan_file_text(CutPlan(cutting.sheet, cutting.rules.data, cuts).file)), encoding="utf-8")
    return load_plan(file)


def test_a_plan_file_gives_the_same_cuts_again(tmp_path) -> None:
    sheet = part_in_hole()
    cutting = cutting_of(sheet)
    order = list(slide_starts(in_order(cutting, drawing_order(cutting)), HeadTravel(DISTANCE, start=(0.0, 0.0))).starts)
    plan = saved(cutting, order, tmp_path)
    again = restrict_starts_to_plan(cutting_of(sheet), plan, everything=True)
    kept = order_as_planned(again, plan)
    assert [s.contour for s in kept] == [s.contour for s in order]
    for a, b in zip(kept, order, strict=True):
        assert a.entry == pytest.approx(b.entry, abs=0.01)
        assert a.exit == pytest.approx(b.exit, abs=0.01)
        assert a.clockwise == b.clockwise


def test_what_a_plan_fixes_is_the_only_choice_and_the_rest_stays_free(tmp_path) -> None:
    sheet = two_squares()
    cutting = cutting_of(sheet, direction="free")

    def edit(text: str) -> str:
        return text.replace('"fixed": []', '"fixed": ["start", "direction"]', 1)

    first = drawing_order(cutting)[0]
    plan = saved(cutting, drawing_order(cutting), tmp_path, edit)
    followed = restrict_starts_to_plan(cutting_of(sheet, direction="free"), plan)
    mine = [followed.starts[n] for n in followed.starts_by_contour[0]]
    assert {s.clockwise for s in mine} == {first.clockwise}
    assert {round(s.at, 2) for s in mine} == {round(first.at, 2)}
    assert len(followed.starts_by_contour[1]) == len(cutting.starts_by_contour[1])
    slid = list(
        slide_starts(in_order(followed, drawing_order(followed)), HeadTravel(DISTANCE, start=(0.0, 0.0))).starts
    )
    assert slid[0].at == pytest.approx(first.at, abs=0.01)


def test_a_fixed_order_is_kept_and_one_that_cuts_a_part_loose_first_is_refused(tmp_path) -> None:
    sheet = two_squares()
    cutting = cutting_of(sheet)
    order = list(reversed(drawing_order(cutting)))

    def edit(text: str) -> str:
        return text.replace('"fixed": []', '"fixed": ["order"]')

    followed = restrict_starts_to_plan(cutting_of(sheet), saved(cutting, order, tmp_path, edit))
    assert (1, 0) in followed.contour_precedence
    inner = cutting_of(part_in_hole())
    wrong = list(reversed(drawing_order(inner)))
    plan = saved(inner, wrong, tmp_path, edit)
    with pytest.raises(PlanError, match=r"has part 1: outline .* before part 1: hole .*, which must be cut first"):
        restrict_starts_to_plan(cutting_of(part_in_hole()), plan)


def test_a_cut_that_goes_ahead_comes_before_all_below_it_in_the_plan_and_nothing_else_is_held(tmp_path) -> None:
    sheet = sheet_of(*((square(70 * k, 20, 50), 0, -1, k + 1) for k in range(4)))
    order = [drawing_order(cutting_of(sheet))[k] for k in (3, 1, 0, 2)]
    plan = saved(cutting_of(sheet), order, tmp_path, lambda text: text.replace('"fixed": []', '"fixed": ["ahead"]', 1))
    assert set(restrict_starts_to_plan(cutting_of(sheet), plan).contour_precedence) == {(3, 0), (3, 1), (3, 2)}


@pytest.mark.parametrize(
    ("sheet", "words"),
    [
        (two_squares(25.0), r"contour 2 at \(95, 20\) started at \(90, 20\)"),
        (sheet_of((square(20, 20, 50), 0, -1, 1)), "1 contour, but the plan has 2"),
        (sheet_of((square(20, 20, 51), 0, -1, 1), (square(90, 20, 50), 0, -1, 2)), "204.000 mm long"),
        (ring(), "contour 1"),
    ],
    ids=str,
)
def test_a_plan_for_another_drawing_is_refused_with_its_first_difference(sheet, words, tmp_path) -> None:
    cutting = cutting_of(two_squares())
    plan = saved(cutting, drawing_order(cutting), tmp_path)
    with pytest.raises(PlanError, match=words):
        check_plan_fits_drawing(sheet, plan)


def test_a_fixed_start_far_from_its_contour_is_refused(tmp_path) -> None:
    cutting = cutting_of(two_squares())
    plan = saved(cutting, drawing_order(cutting), tmp_path)
    far = replace(plan, cuts=(replace(plan.cuts[0], start=(500.0, 500.0), fixed=("start",)), *plan.cuts[1:]))
    with pytest.raises(PlanError, match="away from part 1"):
        restrict_starts_to_plan(cutting, far)
    twice = replace(plan, cuts=(plan.cuts[0], plan.cuts[0]))
    with pytest.raises(PlanError, match="cut twice"):
        restrict_starts_to_plan(cutting, twice)


def test_a_fixed_lead_that_does_not_fit_is_refused_with_its_contour(tmp_path) -> None:
    cutting = cutting_of(two_squares(4.0))
    order = drawing_order(cutting)

    def edit(text: str) -> str:
        start = '"start": [70.75, 45.0]'
        lines = text.splitlines()
        row = next(k for k, line in enumerate(lines) if '"contours": [1]' in line)
        head, tail = lines[row].split('"start": [', 1)
        lines[row] = head + start + tail[tail.index("]") + 1 :].replace('"fixed": []', '"fixed": ["start", "lead"]')
        lines[row] = lines[row].replace('"length": 6.0', '"length": 30.0')
        return "\n".join(lines)

    plan = saved(cutting, order, tmp_path, edit)
    with pytest.raises(PlanError, match="no lead fits at the fixed start or direction of part 1"):
        restrict_starts_to_plan(cutting, plan)


def fixed_plan(cutting: Cutting, *words: str, **changes: Any) -> PlanFile:
    """Return the plan of a cutting in drawing order, with the properties `words` fixed for its first cut."""
    cuts = tuple(cutting.cut(s) for s in drawing_order(cutting))
    plan = CutPlan(cutting.sheet, cutting.rules.data, cuts).file
    return replace(plan, cuts=(replace(plan.cuts[0], fixed=words, **changes), *plan.cuts[1:]))


@pytest.mark.parametrize("words", [("start",), ("start", "direction", "lead")])
def test_a_plan_pierces_nothing_above_the_pierce_capacity(words) -> None:
    thick = replace(PLASMA, thickness=20.0, pierce_delay=0.0, can_pierce=False)
    cutting = cutting_of(sheet_of((square(20, 20, 60), 0, -1, 1), size=100), thick)
    plan = fixed_plan(cutting, *words)
    followed = restrict_starts_to_plan(cutting, plan)
    assert followed.starts
    for start in followed.starts:
        assert not start.pierce
        assert followed.cut(start).choice.start == pytest.approx(plan.cuts[0].start, abs=1e-3)


def test_a_plan_made_for_the_programs_compensation_is_refused_where_the_controller_does_it() -> None:
    cutting = cutting_of(two_squares(), compensation="controller")
    followed = restrict_starts_to_plan(cutting, fixed_plan(cutting, "start", "direction", "lead"))
    assert [s.contour for s in followed.starts].count(0) == 1
    for words, changes, reason in (
        (("lead",), {"lead_in": Lead("arc", 6.0, math.radians(90.0))}, "but the fixed lead of"),
        (("lead",), {"lead_in": Lead("line", 6.0, math.radians(90.0))}, "but the fixed lead of"),
        (("lead",), {"lead_in": Lead()}, "but the fixed lead of"),
        (("start",), {"start": (20.0, 20.0)}, "at a corner"),
    ):
        with pytest.raises(PlanError, match=reason):
            restrict_starts_to_plan(cutting, fixed_plan(cutting, *words, **changes))


def test_a_plan_cannot_have_a_closed_cut_run_forward() -> None:
    cutting = cutting_of(two_squares())
    with pytest.raises(PlanError, match="clockwise or counter-clockwise, not forward"):
        restrict_starts_to_plan(cutting, fixed_plan(cutting, "direction", direction="forward"))
