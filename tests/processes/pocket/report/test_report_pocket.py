"""The report of pockets, from plans made by hand: the drawing, the table of strategies, JSON, the summary."""

from __future__ import annotations

import io
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from leafcut.geometry.polyline import Polyline
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.pocket import (
    Pocket,
    PocketMeasures,
    PocketPath,
    PocketPiece,
    PocketPlan,
    PocketResult,
    PocketRules,
)
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.pocket.model import PocketDetail
from leafcut.processes.pocket.report.pocket_report import (
    build_pocket_scene,
    figures_by_strategy,
    pocket_drawing,
    sum_measures,
    unfinished_shapes,
)
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json
from leafcut.report.page import path_svg, report_page_html
from leafcut.report.summary import print_summary
from page_parser import Page

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)


def line(*points: tuple[float, float], kind: str = "rough") -> PocketPiece:
    return PocketPiece(Polyline.of_points(points), kind)


#: A pocket of 60 × 20 mm: two passes 10 mm apart and lifted between them, or one ring with a link.
POCKET = Pocket(Polyline.of_points([(0, 0), (60, 0), (60, 20), (0, 20)], closed=True), name="<1>")
ZIGZAG = PocketPath("zigzag", (line((5, 5), (55, 5)), line((5, 15), (55, 15))))
RING = PocketPath(
    "contour",
    (
        line((5, 10), (55, 10)),
        line((55, 10), (55, 15), kind="link"),
        line((55, 15), (5, 15), (5, 5), (55, 5), (55, 15), kind="finish"),
    ),
)
MEASURES = PocketMeasures(
    feed_mm=100.0,
    rapid_mm=51.0,
    retracts=1,
    reachable_mm2=1000.0,
    uncovered_mm2=5.0,
    max_step_over=6.0,
    max_engagement=math.pi,
    mean_engagement=math.pi / 2,
    air_mm=1.0,
    floor_mm=80.0,
)
BETTER = replace(MEASURES, feed_mm=175.0, rapid_mm=0.0, retracts=0, uncovered_mm2=0.0)
PLAN = PocketPlan(
    POCKET,
    RULES,
    (-1.0, -2.0),
    (
        PocketResult("zigzag", ZIGZAG, MEASURES),
        PocketResult("contour", RING, BETTER),
        PocketResult("adaptive", refused="no <limit> is given"),
    ),
    chosen=1,
)


@pytest.fixture
def pocketed(empty_outcome: Outcome) -> Outcome:
    tool = Tool(1, 10.0, ToolKind.END_MILL, feed=800 / 60, spindle_rpm=3000.0)
    solution = Solution(np.zeros(1, dtype=np.int32), 0.0, "s", "none", 1)
    return replace(
        empty_outcome,
        process="pocket",
        detail=PocketDetail((PLAN,)),
        operations=(OperationOutcome(tool, "", (), False, solution, cuts=1),),
        nearest=None,
    )


def test_figures_of_several_pockets_are_sums_and_the_largest() -> None:
    both = sum_measures([MEASURES, BETTER])
    assert (both.feed_mm, both.rapid_mm, both.retracts) == (275.0, 51.0, 1)
    assert both.uncovered_percent == pytest.approx(0.25)
    assert both.max_engagement == math.pi
    other = replace(PLAN, results=(*PLAN.results[:1], PocketResult("contour", refused="no"), PLAN.results[2]), chosen=0)
    rows = {row.name: row for row in figures_by_strategy([PLAN, other])}
    assert rows["zigzag"].measures == sum_measures([MEASURES, MEASURES])
    assert rows["contour"].measures is None and rows["contour"].refused == "no"


def test_the_written_and_the_usual_strategy_have_the_times_of_their_programs(pocketed: Outcome) -> None:
    """The table states no second time for a program, in whatever order its regions are."""
    before, after = (
        replace(measure, time_s=time_s) for measure, time_s in ((pocketed.before, 91.0), (pocketed.after, 77.0))
    )
    rows = program_as_json(report_of(replace(pocketed, before=before, after=after)))["strategies"]
    times = {row["strategy"]: row.get("time_s") for row in rows}
    chosen = next(row["strategy"] for row in rows if row["chosen"])
    usual = pocketed.detail.plans[0].usual.strategy
    assert chosen != usual
    assert (times[chosen], times[usual]) == (77.0, 91.0)


def test_a_program_is_compared_with_the_faster_of_the_plain_strategies() -> None:
    """Neither with a slower one nor with a strategy that only leafcut has."""
    zigzag, contour = (replace(r, program_s=s) for r, s in zip(PLAN.results[:2], (90.0, 60.0), strict=True))
    own = replace(contour, strategy="connected", program_s=50.0)
    plan = replace(PLAN, results=(zigzag, contour, own), chosen=2)
    assert plan.usual == contour
    assert {row.name for row in figures_by_strategy([plan]) if row.usual} == {"contour"}
    assert replace(plan, results=(zigzag, own), chosen=1).usual == zigzag
    assert replace(plan, results=(own,), chosen=0).usual == own


def test_json_has_the_way_over_one_level_and_every_strategy(pocketed: Outcome) -> None:
    answer = program_as_json(report_of(pocketed))
    pocket = answer["pocket"]
    assert (pocket["feed_mm"], pocket["rapid_mm"], pocket["retracts"]) == (175.0, 0.0, 0)
    assert (pocket["uncovered_percent"], pocket["gouge_mm2"], pocket["max_step_over"]) == (0.0, 0.0, 6.0)
    assert [s["strategy"] for s in answer["strategies"]] == ["zigzag", "contour", "adaptive"]
    assert answer["strategies"][0]["uncovered_percent"] == pytest.approx(0.5)
    assert answer["strategies"][2] == {
        "strategy": "adaptive",
        "chosen": False,
        "usual": False,
        "refused": "no <limit> is given",
    }
    assert answer["counts"]["pockets"] == 1


def test_other_work_has_no_pocket_in_its_answer(empty_outcome: Outcome) -> None:
    assert "pocket" not in program_as_json(report_of(empty_outcome))


def test_the_page_is_whole_and_what_files_say_is_harmless(pocketed: Outcome) -> None:
    html = report_page_html(report_of(pocketed))
    page = Page(html)
    assert "not possible: no <limit> is given" in page.words
    assert all(words in page.words for words in ("zigzag", "contour", "written", "Never lifted".lower(), "simulated"))
    assert "<limit>" not in html and "<1>" not in html


def test_the_drawing_tells_clearing_walls_links_and_rapids_apart() -> None:
    scene = build_pocket_scene([PLAN])
    ring = pocket_drawing(scene, [RING], "a", "a ring", tool_diameter=10.0)
    assert all(f'class="way {kind}"' in ring for kind in ("rough", "link", "finish"))
    assert 'class="rapid"' not in ring and 'class="tool-disc"' in ring
    zigzag = pocket_drawing(scene, [ZIGZAG], "b", "a zigzag")
    assert 'class="rapid"' in zigzag and zigzag.count('class="down"') == 1


def test_what_is_out_of_reach_and_what_stays_are_found_for_the_picture() -> None:
    shapes = unfinished_shapes(POCKET, ZIGZAG, RULES)
    # Four corners of (1 − π/4)·5² each.
    assert shapes.unreachable.area == pytest.approx(4 * (1 - math.pi / 4) * 25, rel=0.02)
    # Between two passes 10 mm apart a tool of 10 mm leaves nothing but the rounded ends: two places of
    # 2·(5² − π·5²/4) at the left and the right, half of the corner figure each side of y = 10.
    assert shapes.uncovered.area == pytest.approx(4 * (1 - math.pi / 4) * 25, rel=0.05)
    svg = pocket_drawing(build_pocket_scene([PLAN]), [ZIGZAG], "c", "words", shapes=[shapes])
    assert 'class="uncut"' in svg and 'class="hatch"' in svg
    assert re.search(r'clip-path="url\(#far-c-0\)"', svg)


def test_the_drawings_as_files_are_those_of_the_usual_and_of_the_written_strategy(pocketed: Outcome) -> None:
    before, after = path_svg(report_of(pocketed), "before"), path_svg(report_of(pocketed), "after")
    assert "zigzag" in before and "contour" in after
    assert 'class="rapid"' in before and 'class="rapid"' not in after


def test_the_summary_begins_with_the_size_of_the_pocket_or_of_the_largest(pocketed: Outcome) -> None:
    def first_words(outcome: Outcome) -> str:
        out = io.StringIO()
        print_summary(report_of(outcome), Console(file=out, width=80, color_system=None))
        name, words, *_ = out.getvalue().split("\n")[1].split(" · ")
        assert name == outcome.part.name
        return words

    small = replace(PLAN, pocket=Pocket(Polyline.circle(100, 0, 5)))
    assert first_words(pocketed) == "1 pocket of 60 × 20 mm"
    several = replace(pocketed, detail=PocketDetail((small, PLAN)))
    assert first_words(several) == "2 pockets, the largest 60 × 20 mm"


def test_the_summary_fits_a_terminal(pocketed: Outcome) -> None:
    out = io.StringIO()
    searched = replace(pocketed, options={"--preset": "thorough"})
    print_summary(report_of(searched), Console(file=out, width=80, color_system=None))
    said = out.getvalue()
    assert all(len(row) <= 80 for row in said.splitlines())
    assert "not possible: no <limit> is given" in said
    assert re.search(r"contour +175\.0 mm +– +– +0\.00 %", said)


@pytest.mark.parametrize(("feed", "shows"), [(800, ""), (16_500, "in cleared areas at up to 16,500 mm/min")])
def test_the_summary_states_the_feed_in_cleared_areas_however_short_they_are(
    pocketed: Outcome, feed: float, shows: str
) -> None:
    """1 mm of 175 mm cuts air: less than a share that is worth a line, unless it is faster than the mill."""
    written = ToolpathBuilder()
    written.feed(0.0, 0.0, -1.0, feed=feed / 60)
    plan = replace(PLAN, results=(PLAN.results[0], PocketResult("contour", RING, replace(BETTER, air_mm=1.0))))
    report = report_of(replace(pocketed, path_after=written.build(), detail=PocketDetail((plan,))))
    air = [fact.sentence for fact in report.facts if fact.name == "Air"]
    assert (shows in air[0]) if shows else not air
