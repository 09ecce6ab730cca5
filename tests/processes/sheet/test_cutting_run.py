"""A drawing of a sheet in, a cutting program out, through the API and the command line."""

from __future__ import annotations

import itertools
import json
import math
import shutil
from importlib.resources import files
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from cut_sheets import assert_leads_in_scrap, assert_nothing_is_gouged
from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import OptionError, PlanError, PostError, VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.toolpath import Kind
from leafcut.processes.registry import report_of
from leafcut.read.plan_file import load_plan
from leafcut.report.json_answer import program_as_json
from own_machines import blind_table
from rs274_moves import run_rs274

FAST: dict[str, Any] = {"process": "cut", "thickness": "6", "iterations": 5, "threads": 1}


@pytest.fixture(scope="module")
def drawing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four parts with a hole each and a mark, drawn outlines first, on a sheet of 320 × 320 mm."""
    file = tmp_path_factory.mktemp("sheet") / "plates.dxf"
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for x, y in ((20, 20), (170, 20), (20, 170), (170, 170)):
        corners = [(x, y), (x + 120, y), (x + 120, y + 120), (x, y + 120)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "CUT"})
        space.add_circle((x + 40, y + 40), 25, dxfattribs={"layer": "CUT"})
        space.add_circle((x + 95, y + 95), 6, dxfattribs={"layer": "CUT"})
        space.add_line((x + 70, y + 20), (x + 100, y + 20), dxfattribs={"layer": "MARK"})
    space.add_lwpolyline([(0, 0), (320, 0), (320, 320), (0, 320)], close=True, dxfattribs={"layer": "SHEET"})
    document.saveas(file)
    return file


@pytest.fixture(scope="module")
def outcome(drawing: Path):
    return api.optimize(drawing, save_plan=drawing.with_name("plan.json"), **FAST)


@pytest.fixture
def plan(drawing: Path, outcome, tmp_path: Path) -> Path:
    """Return a copy of the plan of `outcome`."""
    return Path(shutil.copy(drawing.with_name("plan.json"), tmp_path))


def test_a_sheet_becomes_a_verified_program_that_takes_less_time(outcome) -> None:
    assert outcome.verified
    assert outcome.process == "cut"
    assert outcome.machine.name == "plasma-table"
    assert outcome.after.time_s < outcome.before.time_s
    assert outcome.after.travel_mm < outcome.before.travel_mm
    plan = outcome.detail.plan
    assert len(plan.cuts) == 16
    assert_nothing_is_gouged(plan.sheet, plan.cuts, plan.data.kerf)
    assert_leads_in_scrap(plan.sheet, plan.cuts, plan.data.kerf)


def test_a_program_read_again_takes_the_time_of_its_plan_but_for_rounded_places(outcome, tmp_path: Path) -> None:
    (tmp_path / "a.ngc").write_text(outcome.text)
    found = api.simulate(tmp_path / "a.ngc", machine="plasma-table")
    assert any(cut.small_hole for cut in outcome.detail.plan.cuts)  # which are slower than the material's feed
    assert found.measure.time_s == pytest.approx(outcome.after.time_s, abs=0.001 * len(outcome.detail.plan.cuts))


def test_every_face_states_the_lengths_of_the_plan_of_a_sheet(outcome) -> None:
    """Cuts along the path, travel between them in X and Y; neither includes the toolpath's rises and descents."""
    cuts = outcome.detail.plan.cuts
    along = sum(cut.path.length for cut in cuts)
    between = sum(math.dist(a.path.end, b.path.start) for a, b in itertools.pairwise(cuts))
    answer = program_as_json(report_of(outcome))
    sheet = answer["cutting"]["after"]
    assert answer["after"]["cut_mm"] == sheet["cut_mm"] == pytest.approx(along)
    assert answer["after"]["travel_mm"] == sheet["rapid_mm"] == pytest.approx(between)
    assert outcome.after.travel_mm > between


def test_holes_and_marks_of_a_part_come_before_its_outline(outcome) -> None:
    seen: dict[int, list[str]] = {}
    for cut in outcome.detail.plan.cuts:
        contour = outcome.detail.plan.sheet.contours[cut.contours[0]]
        seen.setdefault(cut.part, []).append("mark" if cut.kind == "mark" else "hole" if contour.is_hole else "outline")
    assert {tuple(words) for words in seen.values()} == {("mark", "hole", "hole", "outline")}


@pytest.fixture
def limits(monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """Return the list to which every search but that for nearest neighbours adds its time limit."""
    from leafcut.order import solve as solving

    limits: list[float | None] = []
    inner = solving.solve

    def spy(problem: Any, options: Any, *rest: Any, **words: Any) -> Any:
        if options.algorithm != "nn":
            limits.append(options.time_limit)
        return inner(problem, options, *rest, **words)

    monkeypatch.setattr(solving, "solve", spy)
    return limits


def test_once_the_time_is_over_no_start_slides_and_no_order_is_sought_again(
    drawing: Path, limits: list[float | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock of the deadline goes on by a second each time it is read."""
    ticks = itertools.count()
    monkeypatch.setattr("leafcut.order.stop.clock", lambda: float(next(ticks)))
    monkeypatch.setattr(
        "leafcut.processes.sheet.plan.moved_starts._slide_start",
        lambda *_: pytest.fail("a start slid when the time was over"),
    )
    late = api.optimize(drawing, **FAST, time_limit="1s", bound=False)
    assert len(limits) == 1
    assert late.verified
    assert late.after.time_s <= late.before.time_s


def test_the_order_has_nine_tenths_of_the_time_of_all_searches(drawing: Path, limits: list[float | None]) -> None:
    """Of 10 s a tenth is kept for the lower bound, and a tenth of the rest for sliding the starts."""
    assert api.optimize(drawing, **FAST, time_limit="10s").verified
    assert limits[0] == pytest.approx(0.9 * 9.0)


@pytest.mark.parametrize("bow", [0.008, 0.3])
def test_an_almost_straight_spline_is_cut_as_lines(tmp_path: Path, bow: float) -> None:
    """As one arc it had a radius of 7 km, which no program can state."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 200), (0, 0), (600, 0), (600, 200)])
    spline = space.add_spline()
    spline.dxf.degree = 3
    spline.control_points = [(600, 200, 0), (400, 200 + bow, 0), (200, 200 + bow, 0), (0, 200, 0)]
    spline.knots = [0, 0, 0, 0, 1, 1, 1, 1]
    document.saveas(tmp_path / "flat.dxf")
    cut = api.optimize(tmp_path / "flat.dxf", process="cut", thickness="3mm", machine="laser-table", algorithm="nn")
    assert cut.verified
    assert all(math.dist(arc.center[:2], (300, 100)) < 6_000 for arc in cut.path_after.arcs)


def test_a_part_is_cut_though_a_notch_has_a_mouth_narrower_than_the_kerf(tmp_path: Path) -> None:
    """The outline and a chamber of 3 × 3 mm are cut, and the ends of its neck of 2 × 0.6 mm by the kerf of 1.3 mm."""
    notch = [(51.5, 72), (51.5, 69), (48.5, 69), (48.5, 72), (49.7, 72), (49.7, 74)]
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline(
        [(0, 0), (100, 0), (100, 74), (50.3, 74), (50.3, 72), *notch, (0, 74)], close=True
    )
    document.saveas(tmp_path / "notch.dxf")
    cut = api.optimize(tmp_path / "notch.dxf", process="cut", thickness="3mm", machine="plasma-table", algorithm="nn")
    assert cut.verified
    assert 348 + math.tau * 0.65 + 4 * 1.7 < cut.after.cut_mm < 380  # with its leads
    (missing,) = (issue for issue in cut.issues if issue.missing is not None)
    assert (missing.code, missing.missing.what) == ("L612", "place")
    assert float(str(missing.message).split(" mm² ")[0].split()[-1]) == pytest.approx(1.14, abs=0.05)


def test_a_hole_into_which_the_kerf_does_not_go_is_told_and_the_rest_is_cut(tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(0, 0), (60, 0), (60, 60), (0, 60)], close=True)
    document.modelspace().add_circle((30, 30), 0.4)
    document.saveas(tmp_path / "narrow.dxf")
    outcome = api.optimize(tmp_path / "narrow.dxf", **FAST)
    assert outcome.verified
    assert [cut.contours for cut in outcome.detail.plan.cuts] == [(0,)]
    assert [i.code for i in outcome.issues].count("L611") == 1
    assert [i.severity for i in outcome.issues if i.code == "L611"] == ["missing"]


def test_what_is_not_cut_is_told_first_and_changes_the_exit_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(0, 0), (60, 0), (60, 60), (0, 60)], close=True)
    document.modelspace().add_circle((30, 30), 0.4)
    document.saveas(tmp_path / "narrow.dxf")
    words = ["optimize", str(tmp_path / "narrow.dxf"), "--process", "cut", "--thickness", "6", "--iterations=3", "-o"]
    target = tmp_path / "narrow.ngc"
    assert run([*words, str(target)]) == 3
    told = capsys.readouterr().out.strip().splitlines()
    assert told[0].startswith("missing: L611")
    assert target.exists()
    assert run([*words, str(tmp_path / "b.ngc"), "--quiet"]) == 3
    assert capsys.readouterr().err.startswith("leafcut: missing: L611")
    assert run([*words, str(tmp_path / "c.ngc"), "--strict"]) == 1
    assert "--strict" in capsys.readouterr().err
    assert not (tmp_path / "c.ngc").exists()


def test_the_time_norm_adds_up_to_the_machine_time(outcome) -> None:
    norm = outcome.detail.plan.measures
    assert norm.sheet.total_s == pytest.approx(outcome.after.time_s)
    assert norm.sheet.pierces == 12
    assert norm.sheet.pierce_s == pytest.approx(12 * 0.2)
    parts = sum(p.times.total_s for p in norm.parts)
    assert -1e-6 <= norm.sheet.total_s - parts < 3.0  # the move to the first cut
    assert norm.utilisation == pytest.approx((4 * (120**2 - 3.14159265 * (25**2 + 6**2))) / 320**2, rel=1e-6)


@pytest.fixture(scope="module")
def moving_z(drawing: Path):
    """The same without marks for a table whose program pierces and moves Z."""
    return api.optimize(drawing, dialect="plasma", ignore_layers="MARK", **FAST)


def test_the_program_pierces_as_often_as_there_are_cuts(outcome, moving_z) -> None:
    """QtPlasmaC waits for the pierce itself; elsewhere the program does."""
    for found, runs, dwells in ((outcome, 16, 0), (moving_z, 12, 12)):
        path = interpret_own_program(found.text, load_dialect(found.dialect), left_over=True)
        on = (path.kind == Kind.SPINDLE) & (path.value > 0)
        assert on.sum() == runs
        assert (path.kind == Kind.DWELL).sum() == dwells


def test_the_sheet_is_found_before_every_pierce_where_the_machine_can(
    drawing: Path, outcome, moving_z, tmp_path: Path
) -> None:
    """12 pierces: from 10 mm to the sheet at 2000 mm/min takes 0.3 s each, instead of a part of the way at rapid."""
    assert "G38.2" not in outcome.text  # QtPlasmaC does that itself
    assert moving_z.text.count("\nG38.2 Z-20") == moving_z.text.count("\nG92 Z0") == 12
    assert moving_z.text.endswith("M5\nG0 Z10\nG92.1\nM2\n")
    assert [i.code for i in moving_z.issues].count("L618") == 1
    blind = str(blind_table(tmp_path))
    plain = api.optimize(drawing, dialect="plasma", ignore_layers="MARK", machine=blind, **FAST)
    assert plain.verified
    assert "G38.2" not in plain.text
    assert 12 * 0.2 < moving_z.after.time_s - plain.after.time_s < 12 * 0.5
    norm, other = moving_z.detail.plan.measures.sheet, plain.detail.plan.measures.sheet
    assert norm.cut_s == pytest.approx(other.cut_s, abs=0.01)
    assert norm.pierce_s > other.pierce_s


def test_linuxcnc_takes_the_program(outcome, moving_z, rs274: str, tmp_path: Path) -> None:
    for found, runs, dwells in ((outcome, 16, 0), (moving_z, 12, 12)):
        status, canon = run_rs274(rs274, found.text, tmp_path)
        assert status == 0, canon
        assert canon.count("START_SPINDLE_CLOCKWISE") == runs
        assert canon.count("DWELL(0.2") == canon.count("STRAIGHT_PROBE") == dwells


def test_a_kerf_that_the_controller_compensates_goes_to_linuxcnc_with_its_slow_holes(
    drawing: Path, rs274: str, tmp_path: Path
) -> None:
    """The holes of 12 mm are cut slower (M67), programmed before G41.1, under which LinuxCNC refuses M67."""
    found = api.optimize(drawing, compensation="controller", **FAST)
    assert found.verified
    assert "M67 E3 Q60" in found.text
    assert found.text.count("G41.1 D1.5") == found.text.count("G40\n") == 12
    status, said = run_rs274(rs274, found.text, tmp_path)
    assert status == 0, said


def test_a_hole_too_small_for_a_controllers_lead_is_compensated_by_the_program(rs274: str, tmp_path: Path) -> None:
    """Holes of 5 mm and 40 mm: the large one and the outline under G41, the small one along its own path."""
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(0, 0), (150, 0), (150, 80), (0, 80)], close=True)
    for x, radius in ((20, 2.5), (90, 20)):
        document.modelspace().add_circle((x, 40), radius)
    document.saveas(tmp_path / "plate.dxf")
    found = api.optimize(tmp_path / "plate.dxf", compensation="controller", **FAST)
    assert found.verified
    by_diameter = {round(c.path.piece(c.lead_in, c.lead_out).length): c.compensation for c in found.detail.plan.cuts}
    assert by_diameter == {round(math.pi * (5 - 1.54)): 40, round(math.pi * 40): 41, 460: 41}
    assert [i.code for i in found.issues if "compensated by the program" in i.message] == ["L626"]
    status, said = run_rs274(rs274, found.text, tmp_path)
    assert status == 0, said


@pytest.mark.parametrize(
    "options",
    [
        *(
            pytest.param(options, marks=pytest.mark.slow)
            for options in (
                {},
                {"output_units": "inch", "small_hole": "0"},
                {"machine": "laser-table", "dialect": "grbl-laser", "thickness": "3"},
            )
        ),
        {"chains": True, "pierce_delay": "3 s"},
        {"compensation": "controller"},
        {"dialect": "plasma", "ignore_layers": "MARK"},
        {"machine": "laser-table", "thickness": "3", "micro_joints": 2},
    ],
    ids=str,
)
def test_the_time_of_the_report_is_that_of_the_written_program(drawing: Path, tmp_path: Path, options) -> None:
    """Also where the controller waits for the pierce and moves Z itself, or nobody does."""
    found = api.optimize(drawing, tmp_path / "out.ngc", **{**FAST, "iterations": 1, **options})
    answer = api.simulate(tmp_path / "out.ngc", machine=found.machine.name, dialect=found.dialect)
    assert answer.measure.time_s == pytest.approx(found.after.time_s, rel=0.01)
    assert answer.issues == ()


def test_a_material_without_its_comment_is_reported_as_missing(outcome, tmp_path: Path) -> None:
    file = tmp_path / "out.ngc"
    file.write_text("".join(t for t in outcome.text.splitlines(True) if not t.startswith("(o=0")))
    assert "12 cuts use a material" in api.simulate(file, machine="plasma-table").issues[0].message


def test_a_beam_that_does_not_wait_has_no_pierce_delay(drawing: Path) -> None:
    words: dict[str, Any] = {**FAST, "machine": "laser-table", "dialect": "grbl-laser", "thickness": "3"}
    assert api.optimize(drawing, **words).detail.plan.measures.sheet.pierce_s == 0.0
    with pytest.raises(OptionError, match="--pierce-delay"):
        api.optimize(drawing, pierce_delay="1 s", **words)


def test_the_same_seed_gives_the_same_program(drawing: Path, outcome) -> None:
    assert api.optimize(drawing, **FAST).text == outcome.text


def test_chains_save_pierces_and_time_and_are_proved(drawing: Path, outcome) -> None:
    """Holes keep their pierces; the four outlines share fewer than four. A slow pierce makes it worth while."""
    slow = {**FAST, "pierce_delay": "3 s"}
    plain, joined = api.optimize(drawing, **slow), api.optimize(drawing, chains=True, **slow)
    assert joined.verified
    one, other = plain.detail.plan.measures, joined.detail.plan.measures
    assert other.sheet.pierces < one.sheet.pierces == 12
    assert joined.after.time_s < plain.after.time_s
    assert {p.part for p in other.parts} == {p.part for p in one.parts}
    assert sum(p.times.pierces for p in other.parts) == other.sheet.pierces
    assert sum(p.times.perimeter_mm for p in other.parts) == pytest.approx(one.sheet.perimeter_mm)
    assert_nothing_is_gouged(joined.detail.plan.sheet, joined.detail.plan.cuts, joined.detail.plan.data.kerf)


def test_algorithm_none_writes_the_order_of_the_drawing(drawing: Path) -> None:
    kept = api.optimize(drawing, algorithm="none", **FAST)
    assert kept.after.time_s == kept.before.time_s
    assert [c.contours[0] for c in kept.detail.plan.cuts][-1] == max(
        k for k, c in enumerate(kept.detail.plan.sheet.contours) if c.depth == 0 and c.kind == "cut"
    )


def test_a_saved_plan_keeps_its_fixed_choices(drawing: Path, outcome, plan: Path) -> None:
    again = api.optimize(drawing, plan=plan, algorithm="none", **FAST)
    assert [c.contours for c in again.detail.plan.cuts] == [c.contours for c in outcome.detail.plan.cuts]
    assert again.after.time_s == pytest.approx(outcome.after.time_s, rel=1e-3)
    data = json.loads(plan.read_text())
    row = next(c for c in data["cuts"] if c["contours"] == [1])
    row.update({"start": [80.0, 19.25], "fixed": ["start"]})
    plan.write_text(json.dumps(data))
    third = api.optimize(drawing, plan=plan, **FAST)
    choice = next(c.choice for c in third.detail.plan.cuts if c.contours == (0,))
    assert choice.start == pytest.approx((80.0, 19.25), abs=0.01)
    assert choice.fixed == ("start",)
    assert load_plan(plan).cuts


def test_linuxcnc_takes_a_program_with_chains(drawing: Path, rs274: str, tmp_path: Path) -> None:
    joined = api.optimize(drawing, chains=True, **{**FAST, "pierce_delay": "3 s"})
    status, canon = run_rs274(rs274, joined.text, tmp_path)
    assert status == 0, canon
    marks = sum(c.kind == "mark" for c in joined.detail.plan.cuts)
    assert canon.count("START_SPINDLE_CLOCKWISE") == joined.detail.plan.measures.sheet.pierces + marks < 16


def test_a_plan_with_bridges_is_kept_as_a_whole_or_only_where_they_are_fixed(drawing: Path, tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    slow = {**FAST, "pierce_delay": "3 s"}
    first = api.optimize(drawing, save_plan=plan, chains=True, **slow)
    data = json.loads(plan.read_text())
    bridged = [k for k, c in enumerate(data["cuts"]) if c.get("bridge")]
    assert len(bridged) == 12 - first.detail.plan.measures.sheet.pierces > 0
    again = api.optimize(drawing, plan=plan, algorithm="none", **slow)
    assert [c.contours for c in again.detail.plan.cuts] == [c.contours for c in first.detail.plan.cuts]
    assert again.after.time_s == pytest.approx(first.after.time_s, rel=1e-3)
    data["cuts"][bridged[0]]["fixed"] = ["bridge"]
    joined = [data["cuts"][k]["contours"][0] - 1 for k in (bridged[0] - 1, bridged[0])]
    plan.write_text(json.dumps(data))
    third = api.optimize(drawing, plan=plan, **{**slow, "iterations": 1})
    assert any(list(c.contours) == joined for c in third.detail.plan.cuts) or third.after.time_s <= first.after.time_s
    corners = [(x + dx, y + dy) for x in (20, 170) for y in (20, 170) for dx in (0, 120) for dy in (0, 120)]
    own, other = (data["cuts"][k]["start"] for k in (bridged[0], bridged[0] - 1))
    near = [c for c in corners if math.dist(c, own) < 175.0]
    data["cuts"][bridged[0]]["start"] = max(near, key=lambda c: math.dist(c, other))
    plan.write_text(json.dumps(data))
    with pytest.raises(PlanError, match="no bridge through the scrap"):
        api.optimize(drawing, plan=plan, **slow)
    data["cuts"][0] |= {"bridge": True, "fixed": ["bridge"]}
    plan.write_text(json.dumps(data))
    with pytest.raises(PlanError, match="no cut precedes cut 1, so it cannot have a bridge"):
        api.optimize(drawing, plan=plan, **slow)


def test_ants_as_many_as_parts_search_as_the_paper_on_sheets_has_it(
    drawing: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of its parameters reach the search: α = β = 0.5, evaporation 0.3, 200 iterations, an ant for each part."""
    from leafcut.order import solve as room

    seen: list[tuple[Any, Any]] = []
    search = room.solve

    def spy(problem: Any, options: Any, aco: Any, **words: Any) -> Any:
        seen.append((options, aco))
        return search(problem, options, aco, **words)

    monkeypatch.setattr(room, "solve", spy)
    options = {
        "algorithm": "as", "local_search": False, "pheromone_weight": 0.5, "heuristic_weight": 0.5,
        "evaporation_rate": 0.3, "iterations": 200, "n_ants": "parts", "objective": "distance", "bound": False,
    }  # fmt: skip
    found = api.optimize(drawing, process="cut", thickness=6, **options)
    options, aco = next(pair for pair in seen if pair[0].algorithm == "as")
    assert (options.iterations, options.local_search) == (200, False)
    assert (aco.n_ants, aco.pheromone_weight, aco.heuristic_weight, aco.evaporation_rate) == (4, 0.5, 0.5, 0.3)
    assert found.verified


@pytest.mark.parametrize("algorithm", ["auto", "none"])
def test_an_order_that_detaches_a_part_before_its_holes_is_refused(drawing: Path, plan: Path, algorithm: str) -> None:
    data = json.loads(plan.read_text())
    data["cuts"].reverse()
    for cut in data["cuts"]:
        cut["fixed"] = ["order"]
    plan.write_text(json.dumps(data))
    with pytest.raises(PlanError, match=r"the fixed order has part \d: outline .* before part \d: .*must be cut first"):
        api.optimize(drawing, plan=plan, algorithm=algorithm, **FAST)


def test_a_sheet_that_the_machine_cannot_reach_is_refused_before_it_is_planned(
    drawing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("leafcut.processes.sheet.spec.prepare_cutting", lambda *_: pytest.fail("it was planned"))
    profile = Path(str(files("leafcut.machines") / "plasma-table.toml")).read_text()
    (tmp_path / "small.toml").write_text(profile.replace('"2505 mm"', '"200 mm"'))
    with pytest.raises(VerifyError, match=r"X goes from 20\.000 to 290\.000 mm"):
        api.optimize(drawing, machine=str(tmp_path / "small.toml"), **FAST)


def test_an_unchanged_plan_never_makes_the_sheet_slower(drawing: Path, outcome, plan: Path) -> None:
    worse = {**FAST, "iterations": 0}
    assert api.optimize(drawing, plan=plan, **worse).after.time_s <= outcome.after.time_s * (1 + 1e-4)


def test_distance_as_the_literature_counts_it_can_be_what_is_made_small(drawing: Path) -> None:
    found = api.optimize(drawing, objective="distance", **FAST)
    before, _, after = found.detail.norms
    assert after.sheet.length_mm < before.sheet.length_mm
    assert after.sheet.perimeter_mm == pytest.approx(4 * (480 + 2 * 3.14159265 * 31 + 30), rel=1e-6)


def test_sweep_and_heat_are_kept(drawing: Path) -> None:
    found = api.optimize(drawing, sweep="-x", start_point="310,0", heat_distance="30", **FAST)
    columns = [c.path.start[0] < 155 for c in found.detail.plan.cuts]
    assert columns == sorted(columns)  # the right column first
    assert [i.code for i in found.issues].count("L614") == 1


def test_a_laser_table_cuts_by_the_lasers_rules(drawing: Path) -> None:
    found = api.optimize(
        drawing, **{**FAST, "thickness": "3"}, machine="laser-table", cut_process="laser_fiber_3kW", micro_joints=2
    )
    assert found.verified
    assert found.dialect == "fanuc-laser"
    assert {len(c.joints) for c in found.detail.plan.cuts if c.kind == "cut"} == {0, 2}


@pytest.mark.parametrize(
    "options, error, words",
    [
        ({"thickness": None}, OptionError, "--thickness"),
        ({"thickness": "99"}, PlanError, "nearest are"),
        ({"machine": "haas-vf2"}, OptionError, "has a spindle"),
        ({"machine": "linuxcnc-mill"}, OptionError, "linuxcnc-mill has a spindle"),  # the default, but it was named
        ({"keep_out": "100 0 200 320"}, PlanError, "keep-out zone"),
        ({"sheet_size": "200x200"}, PlanError, "outside the sheet"),
        ({"machine": "plasma-table", "work_offset": "2400,0,0"}, VerifyError, "not written"),
        ({"start_point": "1,2,3"}, OptionError, "--start-point"),
        ({"clearance_height": "3"}, PlanError, "--clearance-height"),
    ],
)
def test_what_cannot_be_cut_is_refused_in_one_line(drawing: Path, options, error, words: str) -> None:
    with pytest.raises(error, match=words) as caught:
        api.optimize(drawing, **{**FAST, **options})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dialect": "plasma"}, "marking"),
        ({"machine": "laser-table", "thickness": "3", "dialect": "grbl-laser", "compensation": "controller"}, "G41"),
        ({"dialect": "plasma", "ignore_layers": "MARK", "material_number": 3}, "--material-number"),
    ],
    ids=str,
)
def test_what_the_controller_has_no_words_for_is_refused_before_the_search(
    drawing: Path, monkeypatch: pytest.MonkeyPatch, options, words: str
) -> None:
    monkeypatch.setattr("leafcut.processes.sheet.spec.prepare_cutting", lambda *_: pytest.fail("it was planned"))
    with pytest.raises(PostError, match=words):
        api.optimize(drawing, **{**FAST, **options})


def test_the_command_line_answers_with_the_norm(drawing: Path, tmp_path: Path, capsys) -> None:
    out, page = tmp_path / "plates.ngc", tmp_path / "plates.html"
    words = ["optimize", str(drawing), "--process", "cut", "--thickness", "6", "-o", str(out), "--iterations", "5"]
    assert run([*words, "--json", "--quantity", "3", "--report", str(page)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["counts"] == {"parts": 4, "contours": 12, "marks": 4, "pierces": 12}
    assert answer["cutting"]["batch"]["total_s"] == pytest.approx(3 * answer["cutting"]["sheet"]["total_s"])
    assert len(answer["cutting"]["parts"]) == 4
    assert answer["cutting"]["sheet"]["time"].startswith("0:")
    assert out.read_text().rstrip().endswith("M2")
    assert page.stat().st_size > 1000
    assert run(words) == 0
    shown = capsys.readouterr().out
    assert "4 parts · 12 contours" in shown
    assert "cut with" in shown


def test_a_plan_file_is_never_written_over_an_input(drawing: Path, tmp_path: Path, capsys) -> None:
    plan = tmp_path / "plan.json"
    words = ["optimize", str(drawing), "--process", "cut", "--thickness", "6", "--iterations", "1", "-q"]
    assert run([*words, "--save-plan", str(plan)]) == 0
    assert run([*words, "--plan", str(plan), "--save-plan", str(plan)]) == 1
    assert "never overwritten" in capsys.readouterr().err


def test_starts_in_the_air_are_told_where_the_controller_probes_before_each_cut(tmp_path: Path) -> None:
    """QtPlasmaC goes down to find the sheet wherever the torch goes on; a program with its own Z does not."""
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(20, 20), (90, 20), (90, 90), (20, 90)], close=True)
    document.saveas(tmp_path / "thick.dxf")
    options = {**FAST, "thickness": "25", "amps": 45, "sheet_size": "200x200"}
    probing = api.optimize(tmp_path / "thick.dxf", **options)
    assert [i.code for i in probing.issues].count("L619") == 1
    assert "L619" not in {i.code for i in api.optimize(tmp_path / "thick.dxf", dialect="plasma", **options).issues}
    assert "L619" not in {i.code for i in api.optimize(tmp_path / "thick.dxf", **FAST).issues}


def test_holes_of_other_diameters_than_chosen_are_not_cut(drawing: Path) -> None:
    """Of a hole of 50 mm and one of 12 mm in each of four parts the small ones are left for a drill."""
    outcome = api.optimize(drawing, min_diameter="20", **FAST)
    assert outcome.verified
    assert len(outcome.detail.plan.cuts) == 12
    assert [i.message for i in outcome.issues if i.code == "L205"] == [
        "left out 4 holes outside the selected range of diameters"
    ]


def test_leads_that_meet_do_not_make_a_program_slower_than_the_nearest_neighbours_order(tmp_path: Path) -> None:
    """Plates so dense that leads of the order first found meet, and what has to move costs more than was saved."""
    drawn = tmp_path / "dense.svg"
    squares = ((10, 39, True), (10, 68, False), (39, 39, False), (39, 68, True), (68, 10, True), (68, 68, True))
    shapes = [f'<rect x="{x}" y="{y}" width="24" height="24"/>' for x, y, _ in squares]
    shapes += [f'<circle cx="{x + 12}" cy="{y + 12}" r="6"/>' for x, y, hole in squares if hole]
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="107mm" height="107mm" viewBox="0 0 107 107">'
    drawn.write_text(f"{head}{''.join(shapes)}</svg>", encoding="utf-8")
    found = api.optimize(drawn, process="cut", thickness="3", preset="fast", threads=1)
    assert found.verified
    assert found.nearest is not None
    assert found.after.time_s < found.nearest.time_s
    assert_leads_in_scrap(found.detail.plan.sheet, found.detail.plan.cuts, found.detail.plan.data.kerf)
