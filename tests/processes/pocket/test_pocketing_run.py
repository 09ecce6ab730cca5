"""From a pocket to a milling program, through the API and the command line."""

from __future__ import annotations

import io
import itertools
import json
import math
import re
import threading
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely
from rich.console import Console

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError, OptionError, PlanError, VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.heartbeat import Progress, Trial
from leafcut.model.outcome import Outcome
from leafcut.model.pocket import PocketMeasures, PocketPath, PocketResult
from leafcut.model.toolpath import Kind
from leafcut.order import solve as solving
from leafcut.processes.pocket import clearing
from leafcut.processes.pocket import clearing as pocketing
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.report.pocket_report import PocketReport
from leafcut.processes.pocket.strategies import STRATEGIES, check_algorithm
from leafcut.processes.registry import report_of
from leafcut.processes.settings import collect_settings
from leafcut.report.json_answer import program_as_json
from leafcut.report.summary import print_summary
from rs274_moves import run_rs274

FAST: dict[str, Any] = {
    "tool_diameter": 10,
    "depth": 4,
    "step_down": 2,
    "feed": "800mm/min",
    "spindle_speed": 3000,
    "iterations": 5,
    "threads": 1,
}
EXAMPLES = Path(__file__).parents[3] / "examples"
#: A pocket of 44 × 36 mm with round corners and an island. A tool of 10 mm reaches all of it.
POCKET = shapely.box(7, 7, 37, 29).buffer(7, quad_segs=64) - shapely.Point(22, 18).buffer(4, quad_segs=64)
#: Region of tool centres that leaves 0.3 mm of stock.
ROUGHED = POCKET.buffer(-5.28)


@pytest.fixture(scope="module")
def drawing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("pocket") / "plate.wkt"
    file.write_text(POCKET.wkt)
    return file


@pytest.mark.hazard
@pytest.mark.parametrize(("stickout", "refused"), [(12, True), (16, False)])
def test_the_holder_of_the_mill_stays_out_of_a_clamp_as_high_as_it(
    tmp_path: Path, stickout: float, refused: bool
) -> None:
    """A clamp of 9 mm, 10 mm beside a pocket 4 mm deep; a holder of 40 mm is at Z8 there, or at Z12."""
    drawing, tools = tmp_path / "plate.wkt", tmp_path / "tools.toml"
    drawing.write_text(shapely.box(0, 0, 40, 30).wkt)
    tools.write_text(
        '[[tool]]\nnumber = 1\ndiameter = "6 mm"\nkind = "end-mill"\nfeed = "300 mm/min"\nplunge_feed = "90 mm/min"\n'
        f'spindle_speed = "6000 rpm"\nstickout = "{stickout} mm"\nholder = "40 x 50"\n'
    )
    given = {**FAST, "strategy": "contour", "depth": 4, "tool_diameter": 6, "tools": tools, "keep_out": "50 0 60 30 9"}
    if refused:
        words = r"pocket plate: the holder of .* hits the keep-out zone '50 0 60 30 9', 13.* stick out 2 mm farther"
        with pytest.raises(PlanError, match=words):
            api.optimize(drawing, **given)
    else:
        assert api.optimize(drawing, **given).verified


@pytest.fixture
def contour_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep one strategy where the others do not matter."""
    monkeypatch.setattr(clearing, "STRATEGIES", tuple(w for w in STRATEGIES if w.name == "contour"))


@pytest.fixture(scope="module")
def outcome(drawing: Path):
    return api.optimize(drawing, **FAST)


def test_a_pocket_becomes_a_verified_program(outcome) -> None:
    assert outcome.verified
    assert outcome.process == "pocket"
    [plan] = outcome.detail.plans
    assert plan.levels == (-2.0, -4.0)
    measures = plan.result.measures
    assert measures.gouge_mm2 == 0.0
    assert measures.uncovered_percent <= 0.1
    assert measures.reachable_mm2 == pytest.approx(POCKET.area, rel=1e-3)


def test_every_level_of_the_program_clears_the_pocket_and_stays_inside_it(outcome) -> None:
    """Judged by shapely alone: the swept discs of the program's own moves at each height."""
    path = interpret_own_program(outcome.text, load_dialect("linuxcnc"))
    before = path.before
    for z in (-2.0, -4.0):
        lines = []
        for row in np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)).tolist():
            a, b = before[row], path.end[row]
            if abs(a[2] - z) > 1e-6 or abs(b[2] - z) > 1e-6:
                continue
            points = [a[:2], b[:2]]
            if path.kind[row] != Kind.FEED:
                centre = np.array(path.arcs[int(path.ref[row])].center[:2])
                side = -1.0 if path.kind[row] == Kind.ARC_CW else 1.0
                first, last = (math.atan2(*(p - centre)[::-1]) for p in points)
                turn = (side * (last - first)) % (2 * math.pi) or 2 * math.pi
                angles = first + side * np.linspace(0, turn, 200)
                points = centre + math.dist(a[:2], centre) * np.column_stack([np.cos(angles), np.sin(angles)])
            lines.append(shapely.LineString(points).buffer(5.0, quad_segs=32))
        swept = shapely.union_all(lines)
        assert swept.difference(POCKET.buffer(0.011)).area < 1e-6
        assert POCKET.difference(swept).area / POCKET.area < 1e-3


def test_a_cheaper_strategy_that_is_not_written_has_the_reason_beside_it(outcome: Outcome) -> None:
    [plan] = outcome.detail.plans
    options = {PocketOptions: PocketOptions()}
    settings = SimpleNamespace(of=options.__getitem__, solve=SimpleNamespace(objective="time"))
    job: Any = SimpleNamespace(run=SimpleNamespace(settings=settings), finish_rules=plan.rules, rules=plan.rules)
    sound = PocketMeasures(1000.0, 0.0, 0, reachable_mm2=1000.0)
    cheaper = {
        "zigzag": (replace(sound, max_step_over=1.5 * plan.rules.step_over), "mm apart, more than the step-over of"),
        "contour": (replace(sound, uncovered_mm2=20.0), "leaves 2 % uncut"),
        "connected": (replace(sound, gouge_mm2=3.0), "gouges 3 mm² of the walls"),
        "firefly": (replace(sound, retracts=2), "costs at most 5 % less, with more retracts"),
    }
    results = [PocketResult(name, measures=m, program_s=98.0) for name, (m, _) in cheaper.items()]
    written, slower = (PocketResult(name, measures=sound, program_s=s) for name, s in (("ants", 100.0), ("own", 101.0)))
    found = pocketing.add_rejection_reasons(job, [*results, written, slower], written)
    assert [r.passed_over for r in found[4:]] == ["", ""]
    for result in found[:4]:
        assert cheaper[result.strategy][1] in result.passed_over
    shown = replace(outcome, detail=replace(outcome.detail, plans=(replace(plan, results=tuple(found), chosen=4),)))
    facts = {fact.name: fact.sentence for fact in PocketReport(shown).facts}
    assert facts["contour"] == "not written: leaves 2 % uncut"
    rows = {row["strategy"]: row for row in program_as_json(PocketReport(shown))["strategies"]}
    assert rows["connected"]["passed_over"] == "gouges 3 mm² of the walls" and "passed_over" not in rows["ants"]


def test_the_strategies_are_told_beside_each_other(outcome) -> None:
    [plan] = outcome.detail.plans
    known = {r.strategy: r for r in plan.results}
    assert {"zigzag", "contour", "connected", "firefly", "ants"} <= set(known)
    possible = [r for r in plan.results if r.measures is not None]
    assert all(r.path is not None and not r.refused for r in possible)
    assert all(r.refused for r in plan.results if r.measures is None)
    fine = [r for r in possible if r.measures.uncovered_percent <= 0.1 and not r.measures.gouge_mm2]
    quickest = min(r.program_s for r in fine)
    assert plan.result.program_s <= 1.05 * quickest
    near = [r for r in fine if r.program_s <= 1.05 * quickest]
    assert plan.result.measures.retracts == min(r.measures.retracts for r in near)


def test_the_strategy_that_is_asked_for_is_written(drawing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clearing, "STRATEGIES", tuple(w for w in STRATEGIES if w.name in ("contour", "ants")))
    for name in ("contour", "ants"):
        outcome = api.optimize(drawing, strategy=name, **FAST)
        assert outcome.detail.plans[0].result.strategy == name
        assert outcome.verified


@pytest.mark.usefixtures("contour_only")
@pytest.mark.parametrize("entry", ["ramp", "helix", "plunge", "predrilled"])
def test_linuxcnc_accepts_the_program(rs274: str, drawing: Path, tmp_path: Path, entry: str) -> None:
    outcome = api.optimize(drawing, strategy="contour", entry=entry, stock=0.3, **FAST)
    status, said = run_rs274(rs274, outcome.text, tmp_path)
    assert status == 0, said[-500:]
    assert ("needs a hole" in outcome.text) is (entry == "predrilled")


@pytest.mark.usefixtures("contour_only")
def test_with_stock_the_walls_are_finished_and_the_pocket_is_whole(drawing: Path) -> None:
    outcome = api.optimize(drawing, strategy="contour", stock=0.3, **FAST)
    [plan] = outcome.detail.plans
    assert plan.result.measures.uncovered_percent <= 0.1
    assert plan.result.measures.gouge_mm2 == 0.0
    assert {p.kind for p in plan.result.path.pieces} >= {"rough", "finish"}


@pytest.mark.usefixtures("contour_only")
def test_the_end_mill_of_a_library_is_called_by_its_number_with_its_own_data(drawing: Path) -> None:
    tools = EXAMPLES / "tools.toml"
    outcome = api.optimize(drawing, tools=tools, tool_number=13, depth=4, strategy="contour", entry="plunge")
    assert outcome.operations[0].tool.diameter == 10.0
    words = outcome.text.split()
    assert {"T13", "S4000", "F800", "F200"} <= set(words) and "T1" not in words
    assert not [i for i in outcome.issues if i.code == "L401"]


@pytest.mark.usefixtures("contour_only")
@pytest.mark.parametrize(("number", "told"), [(None, ["T1 end-mill Ø10"]), (1, []), (7, [])])
def test_a_tool_number_that_nobody_stated_is_said_to_be_assumed(
    drawing: Path, number: int | None, told: list[str]
) -> None:
    """Programs for one drawing would otherwise share T1 for different tools without a word."""
    outcome = api.optimize(drawing, strategy="contour", tool_number=number, **FAST)
    notes = [i.message for i in outcome.issues if i.code == "L401" and "load it under this number" in i.message]
    assert [words.split(" is assumed")[0] for words in notes] == told


@pytest.mark.usefixtures("contour_only")
def test_the_uncut_area_and_corners_that_the_tool_does_not_reach_are_one_statement(tmp_path: Path) -> None:
    """A tool of radius r leaves (4 − π) r² in the corners of a rectangle: 21.46 mm² of 1200 mm² for Ø10."""
    (tmp_path / "box.wkt").write_text(shapely.box(0, 0, 40, 30).wkt)
    outcome = api.optimize(tmp_path / "box.wkt", strategy="contour", **FAST)
    (uncut,) = [fact for fact in report_of(outcome).facts if fact.name == "Uncut"]
    found = re.fullmatch(
        r"\S+ mm² of the (\S+) mm² that the tool can reach; the rest is reported as uncut", uncut.sentence
    )
    assert found and float(found[1].replace(",", "")) == pytest.approx(1200.0 - (4.0 - math.pi) * 25.0, abs=1.0)
    assert [i.code for i in outcome.issues if "corners" in i.message] == ["L701"]


@pytest.mark.usefixtures("contour_only")
def test_entries_heights_and_range_of_the_summary_are_those_of_the_program(drawing: Path) -> None:
    """Two levels of 2 mm, each entered once; the range is that of the coordinates in the text."""
    outcome = api.optimize(
        drawing, strategy="contour", entry="plunge", clearance_height=12, retract_height=3, machine="haas-vf2", **FAST
    )
    facts = {fact.name: fact.sentence for fact in report_of(outcome).facts if fact.name}
    assert facts["Entry"] == "2 × plunge"
    assert facts["Heights"] == "clearance Z12, retract Z3"
    heights = [float(z) for z in re.findall(r"^(?!.*G53).*Z(-?[0-9.]+)", outcome.text, re.M)]
    assert facts["Range"].endswith(f"Z {min(heights):g} to {max(heights):g} mm")
    assert facts["Work offset"] in outcome.text.split()


@pytest.mark.usefixtures("contour_only")
def test_on_mach3_roughing_runs_through_where_the_stock_is_more_than_what_corners_lose(drawing: Path) -> None:
    """v² / 4a = (800 / 60)² / (4 · 600) mm = 0.074 mm: less than 0.3 mm of stock, and more than none."""
    options = {**FAST, "machine": "mach3-router", "spindle_speed": 9000, "strategy": "contour"}
    path = interpret_own_program(api.optimize(drawing, stock=0.3, **options).text, load_dialect("mach3"))
    modes = np.flatnonzero(path.kind == Kind.BLENDING)
    assert path.ref[modes].tolist() == [640, 610] * (len(modes) // 2) and len(modes) >= 4
    runs_on = np.searchsorted(modes, np.arange(len(path))) % 2 == 1
    feeds = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW) & np.isin(path.end[:, 2], (-2.0, -4.0))
    at_walls = feeds & ~shapely.contains_xy(ROUGHED, path.end[:, :2])
    assert not runs_on[path.kind == Kind.RAPID].any() and runs_on[feeds].any()
    assert at_walls.any() and not runs_on[at_walls].any()
    outcome = api.optimize(drawing, **options)
    assert "G64" not in outcome.text
    [told] = [i.message for i in outcome.issues if i.code == "L704"]
    assert "by up to 0.074 mm" in told


@pytest.mark.usefixtures("contour_only")
def test_several_pockets_are_one_program_in_the_order_of_the_shortest_way(tmp_path: Path) -> None:
    centres = [(20, 20), (220, 20), (80, 20), (140, 20)]
    discs = [shapely.Point(c).buffer(14, quad_segs=64) for c in centres]
    (tmp_path / "four.wkt").write_text(shapely.MultiPolygon(discs).wkt)
    outcome = api.optimize(tmp_path / "four.wkt", strategy="contour", **FAST)
    assert len(outcome.detail.plans) == 4
    path = outcome.path_after
    cutting = path.end[(path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW) & (path.end[:, 2] < 0)]
    visits = [round(x / 60 - 1 / 3) for x in cutting[:, 0]]
    order = [v for k, v in enumerate(visits) if k == 0 or v != visits[k - 1]]
    assert order == [0, 1, 2, 3]
    # One program: the spindle starts once, and the tool is lifted between the pockets.
    [row] = program_as_json(report_of(outcome))["strategies"]
    assert row["time_s"] == pytest.approx(outcome.after.time_s)
    assert row["retracts"] == 3 and row["rapid_mm"] == pytest.approx(180.0, abs=60.0)
    assert sum(plan.result.program_s for plan in outcome.detail.plans) > row["time_s"] + 3.0


def test_a_slot_as_wide_as_the_tool_is_milled_once_along_its_middle_whatever_the_strategy(tmp_path: Path) -> None:
    (tmp_path / "slot.wkt").write_text(shapely.LineString([(0, 0), (60, 0)]).buffer(5, quad_segs=64).wkt)
    for strategy in ("best", "zigzag"):
        outcome = api.optimize(tmp_path / "slot.wkt", strategy=strategy, **FAST)
        found = outcome.detail.plans[0].result.measures
        assert found.feed_mm == pytest.approx(60.0, abs=0.05)
        assert (found.uncovered_percent, found.gouge_mm2) == (0.0, 0.0) and outcome.verified
        assert np.nanmax(np.abs(outcome.path_after.end[:, 1])) <= 0.005


@pytest.mark.usefixtures("contour_only")
def test_a_passage_too_narrow_for_the_tool_gives_two_regions_and_both_are_cleared(tmp_path: Path) -> None:
    whole = shapely.union_all([shapely.box(0, 0, 40, 40), shapely.box(40, 16, 60, 24), shapely.box(60, 0, 100, 40)])
    (tmp_path / "two.wkt").write_text(whole.wkt)
    outcome = api.optimize(tmp_path / "two.wkt", strategy="contour", **FAST)
    assert outcome.detail.plans[0].result.measures.uncovered_percent <= 0.1
    told = [i.message for i in outcome.issues if i.code == "L701"]
    assert any("near (50.00, 20.00)" in words for words in told)


@pytest.mark.usefixtures("contour_only")
def test_json_on_the_command_line_says_the_way_over_one_level(
    drawing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["--tool-diameter", "10", "--depth", "4", "--json"]
    assert run(["optimize", str(drawing), *flags, "-o", str(tmp_path / "p.ngc")]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["process"] == "pocket" and answer["verified"]
    assert answer["counts"] == {"pockets": 1, "islands": 1, "levels": 1, "tools": 1}
    keys = {"feed_mm", "rapid_mm", "retracts", "uncovered_percent", "gouge_mm2", "max_step_over"}
    assert keys <= set(answer["pocket"])
    chosen = [s for s in answer["strategies"] if s["chosen"]]
    assert len(chosen) == 1 and chosen[0]["feed_mm"] == answer["pocket"]["feed_mm"]
    assert (tmp_path / "p.ngc").read_text().count("\n") > 20


def test_the_summary_fits_a_terminal_and_names_the_strategies(outcome) -> None:
    out = io.StringIO()
    print_summary(report_of(outcome), Console(file=out, width=80, color_system=None))
    said = out.getvalue()
    assert all(len(line) <= 80 for line in said.splitlines())
    assert all(name in said for name in ("contour", "connected", "firefly", "ants", "retracts", "uncut", "verified"))


# -- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("contour_only")
@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"tool_diameter": None}, OptionError, "--tool-diameter"),
        ({"depth": None}, OptionError, "--depth"),
        ({"depth": 0}, OptionError, "depth"),
        ({"depth": 500}, VerifyError, "travel"),
        ({"depth": 4, "thickness": 3}, OptionError, "--thickness 3 mm by more than --break-through 0.5 mm"),
        ({"tool_diameter": 70}, PlanError, "does not fit anywhere"),
        ({"stock": 7}, OptionError, "--stock 7 mm is more than the step-over of 6 mm"),
        ({"step_over": 0.96}, OptionError, "0.95"),
        ({"step_over": 0.01}, OptionError, "0.02"),
        ({"strategy": "adaptive"}, OptionError, "--max-engagement"),
        ({"max_engagement": "60deg"}, PlanError, "contour engages 180°, more than --max-engagement 60°"),
        ({"machine": "plasma-table"}, PlanError, "cannot mill"),
        ({"tools": EXAMPLES / "tools.toml", "tool_number": 2}, PlanError, "T2 drill 5.0, M6 core Ø5 is a drill"),
        ({"retract_height": 20}, PlanError, "R plane"),
        ({"feed": "100m/min"}, PlanError, "feeds at"),
        ({"keep_out": "20 0 40 10"}, PlanError, "pocket plate is in the keep-out zone '20 0 40 10'"),
        ({"start_point": "1,2,3"}, OptionError, "two numbers"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line_and_nothing_is_written(
    drawing: Path, tmp_path: Path, options: dict[str, Any], error: type[LeafcutError], words: str
) -> None:
    with pytest.raises(error, match=words) as refused:
        api.optimize(drawing, tmp_path / "p.ngc", **{**FAST, "strategy": "contour", **options})
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "p.ngc").exists()


def test_adaptive_refuses_stock_that_exceeds_the_engagement_limit_in_sharp_corners(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a corner of 90° both walls engage the tool: by at least 90° if stock remains there."""
    monkeypatch.setattr(clearing, "STRATEGIES", tuple(w for w in STRATEGIES if w.name == "adaptive"))
    (tmp_path / "box.wkt").write_text(shapely.box(0, 0, 24, 20).wkt)
    with pytest.raises(PlanError, match="leave out --stock"):
        api.optimize(tmp_path / "box.wkt", strategy="adaptive", max_engagement="60deg", stock=0.5, **FAST)


def test_every_strategy_keeps_the_step_over_or_is_refused_by_name(drawing: Path, tmp_path: Path) -> None:
    """The tool has 10 mm, the step-over 3 mm; points of a grid are at least 5 mm apart."""
    (tmp_path / "small.wkt").write_text(shapely.box(7, 7, 23, 15).buffer(7, quad_segs=64).wkt)
    plans = api.optimize(tmp_path / "small.wkt", step_over=0.3, max_engagement="180deg", **FAST).detail.plans
    found = {r.strategy: r for r in plans[0].results}
    kept = {name for name, r in found.items() if r.measures is not None and r.measures.max_step_over <= 3.005}
    assert kept == {"zigzag", "contour", "connected", "adaptive"}
    assert all("exceeds the step-over of 3 mm" in found[name].refused for name in ("firefly", "ants"))
    with pytest.raises(
        PlanError, match=r"--strategy ants is not possible: the grid of the strategy needs points more than 0.5 diam"
    ):
        api.optimize(drawing, step_over=0.3, strategy="ants", **FAST)


def test_passes_wider_apart_than_the_step_over_are_never_written(
    drawing: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Rings for 6 mm where 3 are asked for: the strategy is refused by its figures, and the proof by the text's."""
    contour = next(w for w in STRATEGIES if w.name == "contour")

    def wide(region: Any, run: Any, grids: Any) -> PocketPath:
        return contour.path(replace(region, rules=replace(region.rules, step_over=6.0)), run, grids)

    monkeypatch.setattr(clearing, "STRATEGIES", (replace(contour, path=wide),))
    for strategy in ("best", "contour"):
        with pytest.raises(PlanError, match=r"contour:? has passes [\d.]+ mm apart, more than the step-over of 3 mm"):
            api.optimize(drawing, tmp_path / "p.ngc", **{**FAST, "strategy": strategy, "step_over": 0.3})
    monkeypatch.setattr(pocketing, "_limit_error", lambda *_: "")
    with pytest.raises(VerifyError, match=r"passes are [\d.]+ mm apart, 3 mm are allowed"):
        api.optimize(drawing, tmp_path / "p.ngc", **{**FAST, "strategy": "contour", "step_over": 0.3})
    assert not (tmp_path / "p.ngc").exists()


@pytest.mark.parametrize(
    ("size", "engagement", "least"), [((22, 18), 90, 0.4), pytest.param((42, 32), 60, 0.6, marks=pytest.mark.slow)]
)
def test_the_air_feed_applies_only_where_nothing_is_cut_and_saves_its_share_of_the_time(
    size: tuple[int, int], engagement: int, least: float, tmp_path: Path
) -> None:
    """Shapely judges: earlier moves of a tool 0.03 mm narrower cover each faster move.

    `least` is the minimum share of air moves with the faster feed; short moves keep theirs.
    """
    (tmp_path / "box.wkt").write_text(shapely.box(0, 0, *size).wkt)
    options = {**FAST, "strategy": "adaptive", "max_engagement": f"{engagement}deg", "step_down": 4}
    profile = (files("leafcut") / "machines" / "linuxcnc-mill.toml").read_text(encoding="utf-8")
    (tmp_path / "mill.toml").write_text(re.sub(r"max_feed = .*", 'max_feed = "2400 mm/min"', profile, count=1))
    (tmp_path / "slow.toml").write_text(re.sub(r"max_feed = .*", 'max_feed = "800 mm/min"', profile, count=1))
    slow = api.optimize(tmp_path / "box.wkt", machine=str(tmp_path / "slow.toml"), **options)
    fast = api.optimize(tmp_path / "box.wkt", machine=str(tmp_path / "mill.toml"), **options)
    measures = fast.detail.plans[0].result.measures
    air_s = 60.0 * measures.air_mm / 800.0
    assert 0.5 * least * air_s < slow.after.time_s - fast.after.time_s <= 2.0 / 3.0 * air_s
    path = interpret_own_program(fast.text, load_dialect("linuxcnc"))
    before, swept, length = path.before, [shapely.Polygon()], 0.0
    for row in np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW) & (path.end[:, 2] == -4)).tolist():
        line = shapely.LineString([before[row][:2], path.end[row][:2]])
        if path.value[row] > 14.0:
            assert path.kind[row] == Kind.FEED and before[row][2] == -4
            swept = [shapely.union_all(swept)]
            assert line.buffer(4.97).difference(swept[0]).area < 1e-3
            length += line.length
        elif path.kind[row] == Kind.FEED:
            swept.append(line.buffer(5.0, quad_segs=64))
        else:
            centre = np.array(path.arcs[int(path.ref[row])].center[:2])
            side = -1.0 if path.kind[row] == Kind.ARC_CW else 1.0
            first, last = (math.atan2(*(p[:2] - centre)[::-1]) for p in (before[row], path.end[row]))
            angles = first + side * np.linspace(0, (side * (last - first)) % (2 * math.pi) or 2 * math.pi, 100)
            arc = centre + math.dist(before[row][:2], centre) * np.column_stack([np.cos(angles), np.sin(angles)])
            swept.append(shapely.LineString(arc).buffer(5.0, quad_segs=64))
    assert length > least * measures.air_mm


def test_a_strategy_that_is_asked_for_is_the_only_one_that_is_tried(drawing: Path) -> None:
    told: list[str] = []
    outcome = api.optimize(drawing, progress=lambda now: told.append(now.step), strategy="contour", **FAST)
    assert [r.strategy for r in outcome.detail.plans[0].results] == ["contour"]
    assert not {"zigzag", "connected", "firefly", "ants", "adaptive"} & set(told)


@pytest.mark.parametrize("strategy", ["best", "connected"])
def test_a_run_stopped_while_it_makes_the_connected_way_writes_what_is_there(drawing: Path, strategy: str) -> None:
    """The connected path still clears everything; strategies that were not started are not tried."""
    cancelled = threading.Event()

    def progress(now: Progress) -> None:
        if "connected" in now.step:
            cancelled.set()

    outcome = api.optimize(drawing, progress=progress, cancelled=cancelled, **{**FAST, "strategy": strategy})
    results = {r.strategy: r for r in outcome.detail.plans[0].results}
    if strategy == "best":
        assert results["firefly"].refused == results["ants"].refused == "it was not tried before the search was stopped"
        assert results["contour"].path is not None
    else:
        assert outcome.detail.plans[0].result is results["connected"]
        assert results["connected"].measures.uncovered_percent <= 0.1
    assert outcome.verified


def test_a_time_limit_leaves_the_connected_way_longer_but_whole(
    drawing: Path, outcome: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock of the search goes on by a second each time it is read."""
    ticks = itertools.count()
    monkeypatch.setattr("leafcut.order.stop.clock", lambda: float(next(ticks)))
    monkeypatch.setattr(clearing, "STRATEGIES", tuple(w for w in STRATEGIES if w.name == "connected"))
    short = api.optimize(drawing, **{**FAST, "strategy": "connected", "time_limit": "1s"})
    found = short.detail.plans[0].result
    assert found.measures.uncovered_percent <= 0.1 and found.measures.retracts == 0
    [whole] = [r for r in outcome.detail.plans[0].results if r.strategy == "connected"]
    assert found.measures.feed_mm > whole.measures.feed_mm


@pytest.mark.usefixtures("contour_only")
def test_the_bound_of_the_order_of_pockets_ends_with_its_tenth_of_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 10 s one is for the lower bound of the written order; the usual order has none."""
    inner, limits = solving.solve, list[float | None]()

    def spy(problem: Any, options: Any, *given: Any, **named: Any) -> Any:
        if options.bound:
            limits.append(named["bounds"].remaining_time_limit)
        return inner(problem, options, *given, **named)

    monkeypatch.setattr(solving, "solve", spy)
    (tmp_path / "two.wkt").write_text(shapely.union(shapely.box(0, 0, 20, 20), shapely.box(30, 0, 50, 20)).wkt)
    assert api.optimize(tmp_path / "two.wkt", **{**FAST, "strategy": "contour", "time_limit": "10s"}).verified
    assert limits == [pytest.approx(1.0)]


@pytest.mark.usefixtures("contour_only")
def test_a_picture_without_a_scale_is_refused(tmp_path: Path) -> None:
    from PIL import Image

    picture = Image.new("L", (200, 160), 255)
    picture.paste(0, (20, 20, 180, 140))
    picture.save(tmp_path / "p.png")
    with pytest.raises(OptionError, match="--pixel-size"):
        api.optimize(tmp_path / "p.png", **FAST)
    outcome = api.optimize(tmp_path / "p.png", pixel_size=0.5, strategy="contour", **FAST)
    assert outcome.process == "pocket"
    assert outcome.detail.plans[0].pocket.area == pytest.approx(80 * 60, rel=0.01)


def test_a_program_is_no_pocket(tmp_path: Path) -> None:
    (tmp_path / "p.nc").write_text("G21 G90\nG0 Z5\nG1 X10 F100\nM2\n")
    with pytest.raises(OptionError, match="the input is a program, not a drawing"):
        api.optimize(tmp_path / "p.nc", process="pocket", **FAST)


def test_a_strategy_that_gouges_is_never_written(
    drawing: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A path shifted by 0.1 mm is refused by name, and is not chosen."""
    contour = next(w for w in STRATEGIES if w.name == "contour")

    def shifted(region: Any, run: Any, grids: Any) -> PocketPath:
        path = contour.path(region, run, grids)
        return replace(path, pieces=tuple(replace(p, path=p.path.moved(0.1, 0.0)) for p in path.pieces))

    monkeypatch.setattr(clearing, "STRATEGIES", (replace(contour, path=shifted),))
    with pytest.raises(VerifyError, match="gouge"):
        api.optimize(drawing, tmp_path / "p.ngc", **{**FAST, "strategy": "contour"})
    with pytest.raises(PlanError, match="no strategy"):
        api.optimize(drawing, tmp_path / "p.ngc", **FAST)
    assert not (tmp_path / "p.ngc").exists()


def test_what_stays_uncut_is_a_warning_with_its_places(drawing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines without a pass along the walls leave cusps between their ends."""
    monkeypatch.setattr("leafcut.processes.pocket.plan.zigzag.offset_rings", lambda region: [])
    outcome = api.optimize(drawing, strategy="zigzag", **FAST)
    [left] = [i for i in outcome.issues if i.code == "L711"]
    assert "remain uncut" in left.message and left.place.startswith("near (")


def test_the_connected_path_of_a_square_keeps_the_step_over_and_is_shorter_than_contour_parallel_rings(
    tmp_path: Path,
) -> None:
    """Rings of tool centres by hand: squares of 40, 28, 16 and 4 mm, with three moves of 6 mm between them."""
    (tmp_path / "square.wkt").write_text(shapely.box(0, 0, 50, 50).wkt)
    (plan,) = api.optimize(
        tmp_path / "square.wkt", **{**FAST, "depth": 2, "strategy": "connected", "step_over": 0.6}
    ).detail.plans
    found = plan.result.measures
    assert 5.0 < found.max_step_over <= 6.0
    assert (found.retracts, found.gouge_mm2, found.rapid_mm) == (0, 0.0, 0.0)
    assert found.uncovered_percent <= 0.001
    assert found.feed_mm < 4 * (40 + 28 + 16 + 4) + 3 * 6


@pytest.mark.slow
def test_the_written_connected_path_keeps_the_step_over_and_is_shorter_than_contour_parallel_feeds(
    data: Path,
) -> None:
    """The limit is the measured feed length of contour-parallel clearing with the same step-over."""
    (result,) = api.optimize(
        data / "pockets" / "p6_islands6.wkt", **{**FAST, "depth": 2, "strategy": "connected", "step_over": 0.6}
    ).detail.plans
    found = result.result.measures
    assert found is not None
    assert found.max_step_over <= 6.0
    assert found.retracts == 0
    assert found.gouge_mm2 == 0.0
    assert found.uncovered_percent <= 0.001
    assert found.feed_mm + found.rapid_mm <= 4704.0


@pytest.mark.parametrize(
    "strategy, algorithm, taken",
    [
        ("ants", "kicks", "auto, colony, as, eas, asrank, mmas or acs"),
        ("ants", "firefly", "auto, colony, as, eas, asrank, mmas or acs"),
        ("firefly", "mmas", "auto or firefly"),
    ],
)
def test_an_algorithm_that_a_strategy_would_not_use_is_refused(
    strategy: str, algorithm: str, taken: str, drawing: Path
) -> None:
    with pytest.raises(OptionError) as refused:
        api.optimize(drawing, strategy=strategy, algorithm=algorithm, **FAST)
    said = f"--strategy {strategy} supports {taken}, not {algorithm}; choose one of these, or another --strategy"
    assert str(refused.value) == f"--algorithm: {said}"


@pytest.mark.parametrize(
    "strategy, algorithm", [("ants", "mmas"), ("firefly", "firefly"), ("best", "kicks"), ("contour", "2opt")]
)
def test_an_algorithm_that_a_strategy_or_the_order_of_pockets_uses_is_taken(strategy: str, algorithm: str) -> None:
    check_algorithm(collect_settings({"strategy": strategy, "algorithm": algorithm}))


def test_an_algorithm_of_a_file_for_many_kinds_of_work_stops_no_pocket(tmp_path: Path) -> None:
    """As with every option from a file: unused options are ignored there."""
    file = tmp_path / "ours.toml"
    file.write_text('algorithm = "kicks"\n')
    check_algorithm(collect_settings({"strategy": "ants"}, file))


def test_the_header_tells_the_process_where_the_drawing_alone_does_not(drawing: Path, contour_only: None) -> None:
    """Of a drawing of shapes pockets are made without a word; of a DXF they have to be asked for."""
    alone = api.optimize(drawing, process="pocket", strategy="contour", **FAST)
    assert "--process" not in alone.options
    told = api.optimize(EXAMPLES / "pocket.dxf", process="pocket", strategy="contour", **FAST)
    assert told.options["--process"] == "pocket"
    assert "seed 1 --process pocket --" in told.text.lower()


def test_every_strategy_is_told_by_its_name_and_the_time_of_its_program(drawing: Path) -> None:
    told: list[Trial] = []

    def tell(progress: Progress) -> None:
        if progress.trial is not None:
            told.append(progress.trial)

    (plan,) = api.optimize(drawing, progress=tell, **{**FAST, "strategy": "best"}).detail.plans
    assert [result.strategy for result in plan.results] == [way.name for way in STRATEGIES]
    # Those that do not search are tried first: before a search it is known how long it takes to look at a path.
    searches = {way.name: way.searches for way in STRATEGIES}
    tried = sorted(plan.results, key=lambda result: searches[result.strategy])
    assert [one.name for one in told] == [result.strategy for result in tried for _ in "ab"]  # begun, and done
    costs = [one.cost for one in told[1::2]]
    assert costs == [None if result.measures is None else result.program_s for result in tried]
    assert all((one.figure == "–") is (one.cost is None) for one in told[1::2])
