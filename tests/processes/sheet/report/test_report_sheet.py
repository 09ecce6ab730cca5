"""The report of a sheet, from plans made by hand: drawings, table of parts, words."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.model.contour import Contour
from leafcut.model.cutting import Cut, CutChoice, CutData, CutMeasures, CutPlan, CutTimes, PartTimes
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.sheet import Sheet
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.processes.registry import report_of
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.report.cut_words import contour_words, cut_title, name_words, size_words
from leafcut.processes.sheet.report.sheet_drawing import build_sheet_scene, part_window, path_sections, sheet_drawing
from leafcut.processes.sheet.report.sheet_report import detailed_cuts, draw_cut_detail
from leafcut.report.json_answer import program_as_json
from leafcut.report.page import path_svg, report_page_html
from leafcut.report.summary import print_summary
from leafcut.report.svg import STEPS
from leafcut.report.wording import clock_text, money_words
from page_parser import Page

DATA = CutData(
    "laser_fiber_3kw",
    "mild_steel",
    6.0,
    60.0,
    0.2366667,
    None,
    1.0,
    0.7333,
    1.0,
    source="a chart",
    confidence="low, a guess",
)


def box(x: float, y: float, width: float, height: float) -> Polyline:
    """Return a closed rectangle."""
    return Polyline.of_points([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], closed=True)


#: A plate of 100 × 60 mm with a hole of 20 mm and a mark, and a square of 40 mm, on a sheet of 200 × 100 mm.
SHEET = Sheet(
    "two",
    (
        Contour(box(10, 10, 100, 60), depth=0, parent=-1, part=1),
        Contour(Polyline.circle(40, 40, 10), depth=1, parent=0, part=1),
        Contour(Polyline.of_points([(70, 30), (90, 30)]), "mark", depth=1, parent=0, part=1),
        Contour(box(130, 20, 40, 40), depth=0, parent=-1, part=2),
    ),
    outline=box(0, 0, 200, 100),
    zones=((180.0, 40.0, 200.0, 60.0),),
)


def cut_of(contours: Sequence[int], path: Polyline, lead: float, **changes: object) -> Cut:
    """Return a cut with a lead-in and a lead-out of the same length."""
    numbers = tuple(contours)
    cut = Cut(numbers, path, lead, path.length - lead, math.inf, ((0.0, 60.0),), CutChoice(numbers), part=1)
    return replace(cut, **changes)  # type: ignore[arg-type]


def round_trip(start: tuple[float, float], contour: Polyline) -> Polyline:
    """Return the path from a position to a closed contour, around it, and back."""
    there = Polyline.of_points([start, contour.start])
    return concatenate(there, Polyline(np.vstack([contour.vertices, [*contour.start, 0.0]]), False), there.reversed())


HOLE = cut_of([1], round_trip((46.0, 40.0), Polyline.circle(40, 40, 10)), 4.0)
MARK = cut_of([2], Polyline.of_points([(70, 30), (90, 30)]), 0.0, kind="mark", pierce=False)
PLATE = cut_of([0], round_trip((5.0, 10.0), box(10, 10, 100, 60)), 5.0)
SQUARE = cut_of([3], round_trip((127.0, 20.0), box(130, 20, 40, 40)), 3.0, part=2)


def times_of(
    cut_s: float, pierce_s: float, rapid_s: float, rapid_mm: float, perimeter: float, pierces: int
) -> CutTimes:
    return CutTimes(cut_s, pierce_s, rapid_s, perimeter + 8.0, rapid_mm, perimeter, 0.0, pierces)


def plan_of(cuts: Sequence[Cut], rapid_s: float, **changes: object) -> CutPlan:
    """Return a plan with an invented time norm, which the report must show."""
    one, two = times_of(382.0, 1.4, 0.0, 0.0, 382.8, 2), times_of(65.0, 0.7, rapid_s, 1500.0 * rapid_s, 160.0, 1)
    whole = times_of(447.0, 2.1, rapid_s + 1.0, 1500.0 * rapid_s, 542.8, 3)
    measures = CutMeasures(
        sheet=whole,
        batch=whole.multiplied_by(10),
        quantity=10,
        parts=(PartTimes(1, 5685.84, one, 4.25), PartTimes(2, 1600.0, two, 0.75)),
        utilisation=0.3643,
        cost=5.0,
        batch_cost=50.0,
        cuts=tuple(times_of(2.0 + k, 0.7, 0.1, 5.0, 60.0, int(c.pierce)) for k, c in enumerate(cuts)),
    )
    return CutPlan(SHEET, DATA, tuple(cuts), replace(measures, **changes))  # type: ignore[arg-type]


@pytest.fixture
def sheet_outcome(empty_outcome: Outcome) -> Callable[..., Outcome]:
    """Return a maker of outcomes of a sheet: drawn as plate, hole, mark, square; found as hole, mark, plate, square."""

    def make(*, nearest: bool = False, **changes: object) -> Outcome:
        before, after = plan_of([PLATE, HOLE, MARK, SQUARE], 12.0), plan_of([HOLE, MARK, PLATE, SQUARE], 3.0)
        between = plan_of([HOLE, MARK, PLATE, SQUARE], 4.0) if nearest else None
        measures = [
            None if p is None else replace(empty_outcome.before, time_s=p.measures.sheet.total_s)
            for p in (before, between, after)
        ]
        outcome = replace(
            empty_outcome,
            process="cut",
            before=measures[0],
            nearest=measures[1],
            after=measures[2],
            detail=SheetDetail((before, between, after)),
        )
        return replace(outcome, **changes)  # type: ignore[arg-type]

    return make


def drawings(html: str) -> list[str]:
    """Return the drawings of a page, one text each."""
    return re.findall(r'<svg viewBox="[^"]*" class="drawing sheet(?: ramped)?" .*?</svg>', html, re.S)


def outlines(data: str) -> list[np.ndarray]:
    """Return the closed outlines of path data in relative lines, float64[k, 2] each, in user units."""
    found = []
    for piece in data.split("z"):
        if piece:
            numbers = np.array([int(n) for n in re.findall(r"-?\d+", piece)]).reshape(-1, 2)
            found.append(np.cumsum(numbers, axis=0) / STEPS)
    return found


def area(points: np.ndarray) -> float:
    x, y = points.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0


def test_a_part_is_drawn_as_its_area_without_its_holes(sheet_outcome):
    """100 × 60 mm with a hole of 20 mm: two closed outlines, and what is between them is 6000 − 100π mm²."""
    html = report_page_html(report_of(sheet_outcome()))
    scale = build_sheet_scene([sheet_outcome().detail.plan]).frame.scale
    (data,) = re.findall(r'<path id="part-1" d="([^"]*)"', html)
    plate, hole = outlines(data)
    assert area(plate) / scale**2 == pytest.approx(6000.0, rel=2e-3)
    assert area(hole) / scale**2 == pytest.approx(100.0 * math.pi, rel=1e-2)
    assert "fill-rule: evenodd" in html
    assert len(outlines(re.findall(r'<path id="part-2" d="([^"]*)"', html)[0])) == 1


def test_every_pierce_is_one_dot_where_the_torch_pierces(sheet_outcome):
    outcome = sheet_outcome()
    frame = build_sheet_scene([outcome.detail.plan]).frame
    for svg in drawings(report_page_html(report_of(outcome))):
        dots = re.findall(r'<circle cx="([^"]*)" cy="([^"]*)" r="[^"]*" class="begin pierce">', svg)
        expected = frame.to_user_units(np.array([(46.0, 40.0), (5.0, 10.0), (127.0, 20.0)]))
        assert np.array(sorted(dots), dtype=float) == pytest.approx(
            np.array(sorted(expected.tolist(), key=lambda p: f"{p[0]:.2f}".rstrip("0"))), abs=0.01
        )
        assert svg.count('class="begin mark"') == 1


def test_a_start_at_the_edge_is_no_pierce(sheet_outcome):
    plan = plan_of([replace(PLATE, pierce=False), SQUARE], 1.0)
    svg = path_svg(report_of(sheet_outcome(detail=SheetDetail((plan, None, plan)))), "after")
    assert svg.count('class="begin pierce"') == 1
    assert svg.count('class="begin edge-start"') == 1


def test_up_in_the_drawing_is_up_on_the_sheet_and_both_have_one_scale(sheet_outcome):
    outcome = sheet_outcome()
    frame = build_sheet_scene([p for p in outcome.detail.plans if p]).frame
    (x0, y0), (x1, y1) = frame.to_user_units(np.array([(0.0, 0.0), (200.0, 100.0)]))
    assert y1 < y0
    assert x1 - x0 == pytest.approx(2.0 * (y0 - y1))
    before, after = drawings(report_page_html(report_of(outcome)))
    assert before.split(" class")[0] == after.split(" class")[0]  # one view box
    assert '<use href="#sheet-parts">' in after


def test_the_stretches_of_a_cut_are_its_leads_its_kerf_and_where_the_torch_is_off():
    """A hole of 20 mm: 4 mm in, 20π mm round, of which a joint from 10 to 12 mm stays, and 4 mm out, the last dark."""
    end = 4.0 + 20.0 * math.pi
    cut = replace(HOLE, joints=((10.0, 12.0),), torch_off_at=end + 3.0)
    kinds = [(k, round(a, 3), round(b, 3)) for k, a, b in path_sections(cut)]
    assert kinds == [
        ("lead", 0.0, 4.0),
        ("kerf", 4.0, 10.0),
        ("dark", 10.0, 12.0),
        ("kerf", 12.0, round(end, 3)),
        ("lead", round(end, 3), round(end + 3.0, 3)),
        ("dark", round(end + 3.0, 3), round(end + 4.0, 3)),
    ]
    assert [k for k, _, _ in path_sections(MARK)] == ["mark"]
    assert [k for k, _, _ in path_sections(replace(SQUARE, loops=((20.0, 30.0),)))] == [
        "lead",
        "kerf",
        "lead",
        "kerf",
        "lead",
    ]


def test_the_kerf_is_as_wide_as_it_is_where_that_can_be_seen(sheet_outcome):
    thin = sheet_outcome().detail.plan
    wide = replace(thin, data=replace(DATA, kerf=3.0))
    scene = build_sheet_scene([wide])
    assert scene.true_kerf
    assert f'class="kerf" stroke-width="{3.0 * scene.frame.scale * STEPS:.2f}'.rstrip("0") in sheet_drawing(
        scene, wide, "a", ""
    )
    assert not build_sheet_scene([thin]).true_kerf
    assert build_sheet_scene([thin]).kerf > DATA.kerf * scene.frame.scale


def test_a_run_over_several_contours_is_one_cut_with_one_dot(sheet_outcome):
    path = concatenate(HOLE.path, Polyline.of_points([HOLE.path.end, SQUARE.path.start]), SQUARE.path)
    over = (HOLE.path.length, path.length - SQUARE.path.length)
    plan = plan_of([cut_of([1, 3], path, 3.0, bridges=(over,))], 1.0)
    assert [k for k, _, _ in path_sections(plan.cuts[0])] == ["lead", "kerf", "bridge", "kerf", "lead"]
    svg = path_svg(report_of(sheet_outcome(detail=SheetDetail((plan, None, plan)))), "after")
    assert svg.count('class="begin pierce"') == 1
    assert contour_words(plan, plan.cuts[0]) == "hole, outline"
    assert cut_title(plan, 0).startswith("1: parts 1, 2, hole, outline · ")


def test_pointing_at_a_cut_says_part_contour_length_and_seconds(sheet_outcome):
    html = report_page_html(report_of(sheet_outcome()))
    assert "<title>1: part 1, hole · 70.8 mm · cutting 2.00 s, piercing 0.70 s</title>" in html
    assert "<title>part 1 · 2 contours · 6 min 23 s</title>" in html


@pytest.mark.parametrize("cuts, every", [(40, 1), (100, 2), (130, 5)])
def test_of_many_cuts_every_so_manieth_has_its_number(cuts, every):
    squares = [cut_of([3], box(9.0 * (k % 15), 9.0 * (k // 15), 4, 4), 0.0) for k in range(cuts)]
    plan = plan_of(squares, 1.0)
    svg = sheet_drawing(build_sheet_scene([plan]), plan, "after", "")
    (group,) = re.findall(r'<g class="number".*?</g>', svg, re.S)
    numbers = [int(n) for n in re.findall(r">(\d+)</text>", group)]
    assert numbers
    assert set(numbers) <= set(range(every, cuts + 1, every)) - {1, cuts}  # there stand "start" and "end"
    assert len(numbers) >= 0.9 * (cuts // every)
    assert svg.count('class="begin pierce"') == cuts


def test_the_table_has_the_figures_of_every_part_of_the_sheet_and_of_the_batch(sheet_outcome):
    html = report_page_html(report_of(sheet_outcome()))
    (table,) = re.findall(r'<table class="parts">.*?</table>', html, re.S)
    rows = [
        [re.sub("<.*?>", "", c) for c in re.findall(r"<t[hd].*?</t[hd]>", r)]
        for r in re.findall(r"<tr>.*?</tr>", table)
    ]
    assert rows[1:] == [
        ["1", "", "2 + 1 mark", "56.86", "382.8 mm", "2", "6 min 22 s", "1.40 s", "0.00 s", "6 min 23 s", "4.25"],
        ["2", "", "1", "16", "160.0 mm", "1", "1 min 05 s", "0.70 s", "3.00 s", "1 min 09 s", "0.75"],
        ["start and end", "", "", "", "", "1.00 s", "1.00 s", ""],
        ["Sheet", "542.8 mm", "3", "7 min 27 s", "2.10 s", "4.00 s", "7 min 33 s", "5.00"],
        ["10 sheets", "5.43 m", "30", "1 h 14 min", "21.0 s", "40.0 s", "1 h 15 min", "50.00"],
    ]


def test_a_part_of_the_table_leads_to_the_part_in_the_drawing(sheet_outcome):
    outcome = sheet_outcome()
    page = Page(report_page_html(report_of(outcome)))
    assert {"part-1", "part-2"} <= set(page.values("id"))
    assert {"#part-1", "#part-2"} <= set(page.values("href"))
    _, _, width, height = map(float, part_window(build_sheet_scene([outcome.detail.plan]), 2).split())
    assert width == pytest.approx(height)
    assert part_window(build_sheet_scene([outcome.detail.plan]), 7) == ""


def test_the_totals_are_those_of_the_norm(sheet_outcome):
    page = Page(report_page_html(report_of(sheet_outcome())))
    words = page.words.replace(" ".join(page.cells["style"][0].split()), "")
    for said in (
        "2 parts · 3 contours · 1 mark · 3 pierces · sheet 200 × 100 mm",
        "Time of a sheet 7 min 33 s 7 min 27 s of cutting",
        "Pierces 3 2.10 s of piercing",
        "Perimeter 542.8 mm",
        "Path length 5.04 m perimeters + 4.50 m between",  # 542.8 + 1500 × 3
        "Sheet used 36.4 % 0.00729 m² of parts",
        "Cost of a sheet 5.00",
        "Batch of 10 sheets 1 h 15 min cost 50.00; 20 parts in all, 2 on each sheet",
        "9.00 s saved compared with the drawing’s order",
        "1 min 30 s on the batch of 10 sheets. The travel between the cuts is 75.0 % shorter.",
        "kerf 0.237 mm",
        "laser fiber 3 kW",
        "mild steel, 6 mm",
        "confidence low a guess; a chart",
    ):
        assert said in words
    for drilling in ("spindle", "Tools", "holes", "Ø", "hundred parts", "0.23666"):
        assert drilling not in words


def test_one_sheet_is_reckoned_for_a_hundred(sheet_outcome):
    plans = [replace(p, measures=replace(p.measures, quantity=1)) if p else None for p in sheet_outcome().detail.plans]
    words = Page(report_page_html(report_of(sheet_outcome(detail=SheetDetail(tuple(plans)))))).words
    assert "15 min 00 s on 100 sheets" in words
    assert "Batch of" not in words


def test_the_nearest_neighbours_order_is_drawn_where_it_is_known(sheet_outcome):
    assert len(drawings(report_page_html(report_of(sheet_outcome())))) == 2
    html = report_page_html(report_of(sheet_outcome(nearest=True)))
    assert len(drawings(html)) == 3
    assert Page(html).words.count("Nearest neighbour") == 3  # card, caption, row of the times


def test_a_closer_look_shows_the_first_hole_and_the_first_outline_with_the_kerf_in_its_width(sheet_outcome):
    plan = sheet_outcome().detail.plan
    assert detailed_cuts(plan) == [0, 2]
    assert detailed_cuts(plan_of([MARK, SQUARE], 1.0)) == [1]
    assert detailed_cuts(plan_of([MARK], 1.0)) == []
    look = draw_cut_detail(replace(plan, data=replace(DATA, kerf=1.0)), 0)
    # 1.6 lead-ins of 4 mm are half of 190 units: a kerf of 1 mm is 95 / 6.4 units wide.
    assert f'class="kerf band" stroke-width="{95.0 / 6.4 * STEPS:g}"' in look["svg"]
    assert look["svg"].count("<circle") == 1
    assert (look["caption"], look["words"]) == ("Cut 1: part 1, hole", "lead-in 4.0 mm, lead-out 4.0 mm")
    dark = replace(HOLE, torch_off_at=HOLE.lead_out + 1.0)
    assert (
        draw_cut_detail(plan_of([dark], 1.0), 0)["words"]
        == "lead-in 4.0 mm, lead-out 1.0 mm, 3.0 mm with the torch off"
    )


def test_pages_of_sheets_are_well_formed_and_text_from_files_stays_text(sheet_outcome, empty_outcome):
    evil = '<script>alert("x")</script>'
    outcome = sheet_outcome(nearest=True)
    data = replace(DATA, process=evil, material=evil, source=evil, confidence=evil)
    plans = tuple(replace(p, data=data) for p in outcome.detail.plans)
    part = replace(outcome.part, name=evil)
    bare = replace(outcome.detail.plan, sheet=Sheet("bare", SHEET.contours))
    nothing = CutPlan(Sheet("nothing"), DATA, ())
    for plans_of_one in (plans, (bare, None, bare), (nothing, None, nothing)):
        page = Page(
            report_page_html(
                report_of(
                    replace(
                        outcome,
                        detail=SheetDetail(plans_of_one),
                        part=part,
                        nearest=plans_of_one[1] and outcome.nearest,
                    )
                )
            )
        )
        assert "script" not in page.tags
        ids = page.values("id")
        assert len(ids) == len(set(ids))
        assert set(page.values("href")) <= {f"#{i}" for i in ids}
    assert "sheet-parts" not in Page(report_page_html(report_of(empty_outcome))).values("id")


def test_the_terminal_says_the_ways_between_and_sensible_digits(sheet_outcome):
    console = Console(file=io.StringIO(), width=80)
    print_summary(report_of(sheet_outcome()), console)
    shown = console.file.getvalue()
    assert "2 parts · 3 contours · 1 mark · 3 pierces" in shown
    assert re.search(r"order +between +cutting", shown)
    assert re.search(r"drawing +18.00 m +550.8 mm", shown)  # 1500 × 12, 542.8 + 8
    assert re.search(r"leafcut +4.50 m", shown)
    assert "kerf 0.237 mm" in " ".join(shown.split())
    assert re.search(r"cost of a sheet +5.00", shown) and re.search(
        r"batch of 10 sheets .*cost 50.00; 20 parts in all", shown
    )


def test_a_gap_is_said_of_the_starts_that_were_tried(sheet_outcome):
    """42 s above a bound of 40 s: 5 % of all the sheet's time, not of its travel; two bands are two searches."""
    order = np.arange(4, dtype=np.int32)
    found = Solution(order, 42.0, "s", "mmas", 7, history=((0.1, 60.0), (1.0, 42.0)), lower_bound=40.0)
    band = OperationOutcome(Tool(1, 0.2, ToolKind.TORCH), "", (), False, found, cuts=4)
    one = report_of(sheet_outcome(operations=(band,))).gap_sentence()
    assert one == "time at most 5.00 % above the least possible with the starts that were tried"
    assert (
        report_of(sheet_outcome(operations=(band, band))).gap_sentence() == f"{one}, each band from the end of the last"
    )
    words = Page(report_page_html(report_of(sheet_outcome(operations=(band, band))))).words
    assert "band 1, 4 cuts" in words
    assert "band 2, 4 cuts" in words
    assert "4 cuts mmas" in Page(report_page_html(report_of(sheet_outcome(operations=(band,))))).words


def test_the_json_answer_has_norm_data_and_parts(sheet_outcome):
    answer = program_as_json(report_of(sheet_outcome()))
    cutting = answer["cutting"]
    assert answer["counts"] == {"parts": 2, "contours": 3, "marks": 1, "pierces": 3}
    assert cutting["sheet"]["time"] == "0:07:33"
    assert cutting["sheet"]["length_mm"] == pytest.approx(542.8 + 4500.0)
    assert [p["contours"] for p in cutting["parts"]] == [2, 1]
    assert [p["pierces"] for p in cutting["parts"]] == [2, 1]
    assert cutting["confidence"] == "low, a guess"
    assert cutting["before"]["rapid_mm"] == pytest.approx(18000.0)
    assert cutting["nearest"] is None


def test_times_sizes_and_sums_are_said_as_in_a_shop():
    assert [clock_text(s) for s in (0.0, 59.6, 3727.0, 90061.0)] == ["0:00:00", "0:01:00", "1:02:07", "25:01:01"]
    assert [size_words(v) for v in (0.2366667, 6.0, 1.5, 25.4, 120.0)] == ["0.237", "6", "1.5", "25.4", "120"]
    assert [money_words(v) for v in (0.0421, 12.4, 1234.5)] == ["0.042", "12.40", "1,234.50"]
    assert name_words("laser_fiber_3kW") == "laser fiber 3 kW"
