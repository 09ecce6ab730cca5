"""Drawings and quantities in, nested sheets out; overlaps are sought with shapely, apart from the program's check."""

from __future__ import annotations

import itertools
import json
import math
import shlex
from pathlib import Path
from typing import Any

import ezdxf
import pytest
import shapely

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError, OptionError, PlanError, ReadError
from leafcut.model.heartbeat import Progress, Trial
from leafcut.nesting.plan.strip import NesterError
from leafcut.options import ReadOptions, SheetOptions
from leafcut.processes.contours import prepare_sheet
from leafcut.processes.registry import report_of
from leafcut.read import read_contours
from leafcut.report.json_answer import program_as_json

SMALL: dict[str, Any] = {"sheet": "300x200", "kerf": 2, "gap": 3, "margin": 8, "variants": 2, "iterations": 20}


@pytest.fixture(scope="module")
def drawings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An L of 60 × 60 with a hole, a plate of 50 × 20, and a contour that is open."""
    folder = tmp_path_factory.mktemp("parts")
    corners = [(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)]
    for name, points, closed in (
        ("angle", corners, True),
        ("plate", [(0, 0), (50, 0), (50, 20), (0, 20)], True),
        ("open", [(0, 0), (50, 0), (50, 20)], False),
    ):
        document = ezdxf.new(units=4)
        document.modelspace().add_lwpolyline(points, close=closed)
        if name == "angle":
            document.modelspace().add_circle((10, 10), 5)
        document.saveas(folder / f"{name}.dxf")
    return folder


def outlines(file: Path) -> list[shapely.Polygon]:
    sheet = prepare_sheet(read_contours(file, ReadOptions()), SheetOptions())
    return [shapely.Polygon(c.path.flattened(0.01)) for c in sheet.contours if not c.is_hole]


@pytest.mark.parametrize("nester", ["shapes", "rectangles"])
def test_the_written_sheet_has_every_part_apart_from_all_others_and_inside_the_margin(
    nester: str, drawings: Path, tmp_path: Path
) -> None:
    out = tmp_path / "nested.dxf"
    found = api.nest([f"{drawings}/angle.dxf:4", f"{drawings}/plate.dxf:3"], out, nester=nester, **SMALL)
    assert found.files[0] == (str(out),)
    shapes = outlines(out)
    assert sorted(round(s.area) for s in shapes) == [1000] * 3 + [2000] * 4
    assert min(a.distance(b) for a, b in itertools.combinations(shapes, 2)) >= 5.0 - 0.01
    assert all(shapely.box(8, 8, 292, 192).buffer(0.01).contains(s) for s in shapes)


def test_the_same_seed_gives_the_same_nest(drawings: Path) -> None:
    one, other = (api.nest([f"{drawings}/angle.dxf:3"], seed=5, **SMALL) for _ in range(2))
    assert [n.layouts for n in one.nests] == [n.layouts for n in other.nests]
    assert all(n.repeatable for n in one.nests)


def test_the_same_nest_is_the_same_file_whenever_it_is_written(drawings: Path, tmp_path: Path) -> None:
    for name in ("one.dxf", "other.dxf"):
        api.nest([f"{drawings}/angle.dxf:3"], tmp_path / name, **SMALL)
    assert (tmp_path / "one.dxf").read_bytes() == (tmp_path / "other.dxf").read_bytes()


def test_what_one_sheet_does_not_hold_goes_to_more_sheets(drawings: Path, tmp_path: Path) -> None:
    """Twelve angles of 60 × 60 lie on no sheet of 150 × 150: nine squares of that size would be its whole area."""
    out = tmp_path / "many.dxf"
    options = {**SMALL, "sheet": "150x150", "variants": 1}
    found = api.nest([f"{drawings}/angle.dxf:12"], out, **options)
    layouts = found.nests[0].layouts
    assert len(found.files[0]) == len(layouts)
    assert sum(len(outlines(Path(f))) * one.count for f, one in zip(found.files[0], layouts, strict=True)) == 12


def test_a_nested_sheet_is_cut(drawings: Path, tmp_path: Path) -> None:
    out = tmp_path / "nested.dxf"
    api.nest([f"{drawings}/angle.dxf:2"], out, **{**SMALL, "gap": 10})
    assert api.optimize(out, process="cut", thickness=6, iterations=5, threads=1).verified


def test_the_cut_sheet_keeps_names_and_quantities_of_the_order(drawings: Path, tmp_path: Path) -> None:
    (tmp_path / "Träger “1” µ.dxf").write_bytes((drawings / "angle.dxf").read_bytes())
    (tmp_path / "order.csv").write_text(f"file,quantity\nTräger “1” µ.dxf,2\n{drawings}/plate.dxf,3\n", "utf-8")
    sheet = tmp_path / "nested.dxf"
    api.nest([str(tmp_path / "order.csv")], sheet, nester="rectangles", **{**SMALL, "gap": 10})
    cut: dict[str, Any] = {"process": "cut", "thickness": 6, "iterations": 5, "threads": 1}
    outcome = api.optimize(sheet, quantity=4, shop_rate=60.0, report=tmp_path / "r.html", **cut)
    answer = program_as_json(report_of(outcome))["cutting"]
    pieces = {p["name"]: (p["per_sheet"], p["in_batch"]) for p in answer["pieces"]}
    assert pieces == {"Träger “1” µ": (2, 8), "plate": (3, 12)}
    assert sorted(p["name"] for p in answer["parts"]) == ["Träger “1” µ"] * 2 + ["plate"] * 3
    whole = sum(p["per_sheet"] * p["cost_each"] for p in answer["pieces"])
    assert whole == pytest.approx(sum(p["cost"] for p in answer["parts"]))
    assert "Träger “1” µ" in (tmp_path / "r.html").read_text("utf-8")


def strip(**changes: Any) -> str:
    item = {"id": 7, "demand": 2, "allowed_orientations": [0.0, 180.0]}
    item["shape"] = {"type": "simple_polygon", "data": [[0, 0], [40, 0], [0, 30], [0, 0]]}
    return json.dumps({"name": "two", "items": [{**item, **changes}], "strip_height": 100})


def test_a_strip_instance_gives_its_items_with_their_number_and_angles(tmp_path: Path) -> None:
    (tmp_path / "two.json").write_text(strip())
    given = {**SMALL, "nester": "rectangles"}
    nest = api.nest([f"{tmp_path}/two.json:3"], tmp_path / "out.dxf", **given).nests[0]
    assert [(p.name, p.quantity, p.area) for p in nest.parts] == [("two-7", 6, 600.0)]
    assert nest.parts[0].rotations == pytest.approx((0.0, math.pi))
    assert len(outlines(tmp_path / "out.dxf")) == 6
    turned = api.nest([f"{tmp_path}/two.json"], **{**given, "rotations": "90"}).nests[0]
    assert turned.parts[0].rotations == pytest.approx((0.5 * math.pi,))
    in_cm = api.nest([f"{tmp_path}/two.json"], **{**given, "units": "cm", "sheet": "2000x2000"}).nests[0]
    assert in_cm.parts[0].area == 60_000.0  # ten times as long and as wide


@pytest.mark.parametrize(
    "text",
    [
        "{", "[]", '{"items": []}', '{"items": [3]}', strip(demand=0), strip(demand=True), strip(shape={}),
        strip(allowed_orientations=[]), strip(allowed_orientations=[1e999]),
        strip(shape={"type": "simple_polygon", "data": [[0, 0], [1, 1]]}),
        strip(shape={"type": "simple_polygon", "data": [[0, 0], [1, 1e300], [1, 2]]}),
        strip(shape={"type": "simple_polygon", "data": [[0, 0], [1, float("nan")], [1, 2]]}),
        strip(shape={"type": "multi_polygon", "data": []}), "[" * 100_000,
    ],
)  # fmt: skip
def test_a_strip_instance_that_is_not_whole_is_refused_in_one_line(text: str, tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(ReadError, match=r"bad\.json") as caught:
        api.nest([f"{tmp_path}/bad.json"], **SMALL)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("parts", "options", "error", "words"),
    [
        ([], {}, OptionError, "no parts"),
        (["angle.dxf:0"], {}, OptionError, "quantity"),
        (["angle.dxf:-3"], {}, OptionError, "quantity"),
        (["missing.dxf:2"], {}, ReadError, "missing.dxf"),
        (["open.dxf:2"], {}, LeafcutError, "open"),
        (["angle.dxf:2"], {"sheet": "50x50"}, PlanError, "sheet"),
        (["angle.dxf:2"], {"sheet": "big"}, OptionError, "--sheet"),
        (["angle.dxf:2"], {"rotations": "up"}, OptionError, "rotations"),
    ],
    ids=str,
)
def test_what_cannot_be_nested_is_refused_in_one_line(
    parts: list[str], options: dict[str, Any], error: type[Exception], words: str, drawings: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.dxf"
    with pytest.raises(error, match=words) as caught:
        api.nest([f"{drawings}/{name}" for name in parts], out, **{**SMALL, **options})
    assert "\n" not in str(caught.value)
    assert not out.exists()


@pytest.mark.parametrize("machine, size", [(None, (2500, 1250)), ("laser-table", (3000, 1500))])
def test_without_a_size_the_sheet_is_as_large_as_the_table_that_cuts_it(
    machine: str | None, size: tuple[float, float], drawings: Path
) -> None:
    options = {"nester": "rectangles"} if machine is None else {"nester": "rectangles", "machine": machine}
    found = api.nest([f"{drawings}/plate.dxf:2"], **options).nests[0]
    assert (found.stocks[0].length, found.stocks[0].width) == size


def test_a_sheet_larger_than_the_table_is_refused_before_anything_is_nested_or_told(drawings: Path) -> None:
    parts = [f"{drawings}/missing.dxf:2"]
    with pytest.raises(OptionError, match="exceeds the travel of plasma-table, 2510 × 1260"):
        api.nest(parts, sheet="3000x1500", machine="plasma-table")
    found = api.nest([f"{drawings}/plate.dxf:2"], sheet="3000x1500", nester="rectangles")
    assert [i.code for i in found.issues if "plasma-table" in i.message] == ["L435"]
    unused = api.nest([f"{drawings}/plate.dxf:2"], sheet=("3000x1500@900", "1000x1000@10"), nester="rectangles")
    assert {layout.stock for layout in unused.nests[0].layouts} == {1}
    assert "L435" not in [i.code for i in unused.issues]


def test_a_table_of_unknown_travel_needs_a_size_and_takes_any(drawings: Path, tmp_path: Path) -> None:
    file = tmp_path / "my.toml"
    file.write_text('controller = "qtplasmac"\nprocess = "torch"\nrapid.velocity = "9 m/min"\n')
    given = {"machine": str(file), "nester": "rectangles"}
    with pytest.raises(OptionError, match="--sheet: the travel of my is unknown"):
        api.nest([f"{drawings}/plate.dxf:2"], **given)
    found = api.nest([f"{drawings}/plate.dxf:2"], sheet="9000x5000", **given).nests[0]
    assert (found.stocks[0].length, found.stocks[0].width) == (9000, 5000)


@pytest.mark.parametrize(
    ("threads", "variants", "shares"),
    [
        (1, 3, [(30, 1)]),
        (2, 3, [(30, 2)]),
        (2, 1, [(30, 2)]),
        (3, 3, [(30, 2), (15, 1), (15, 1)]),
        (9, 3, [(30, 7), (30, 1), (30, 1)]),
    ],
)
def test_of_a_time_limit_the_first_variant_has_all_and_most_threads_however_many_there_are(
    threads: int, variants: int, shares: list[tuple[int, int]], drawings: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that it is as dense as the nester alone in the same time; the others take a third of the threads at most."""
    budgets: list[tuple[int, float, int]] = []

    def spy(items: Any, height: float, seed: int, budget: Any, **_: Any) -> Any:
        budgets.append((seed, budget.seconds, budget.workers))
        raise NesterError("seen")

    monkeypatch.setattr("leafcut.nesting.plan.shapes.pack_strip", spy)
    options = {"sheet": "300x200", "nester": "shapes", "time_limit": "30s", "threads": threads, "variants": variants}
    api.nest([f"{drawings}/angle.dxf:3"], **options)
    assert [(round(seconds), workers) for _, seconds, workers in sorted(budgets)] == shares
    budgets.clear()
    api.nest([f"{drawings}/angle.dxf:3"], **{**options, "time_limit": None})
    assert [workers for *_, workers in budgets] == [1] * variants, "the number of threads does not change the nests"


def test_a_drawing_is_never_written_over(drawings: Path) -> None:
    before = (drawings / "angle.dxf").read_bytes()
    with pytest.raises(LeafcutError, match="never overwritten"):
        api.nest([f"{drawings}/angle.dxf:2"], drawings / "angle.dxf", **SMALL)
    assert (drawings / "angle.dxf").read_bytes() == before


def test_the_command_line_answers_in_json(drawings: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["nest", f"{drawings}/plate.dxf:6", "--sheet", "300x200", "--nester", "rectangles", "--json", "--dry-run"]
    assert run(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["variants"]


def test_the_summary_ends_with_a_command_that_cuts_the_written_sheets(
    drawings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file name with a space stays one word. Without a file, there is no command."""
    words = ["nest", f"{drawings}/plate.dxf:6", "--sheet", "150x70", "--nester", "rectangles"]
    assert run([*words, "-o", str(tmp_path / "my sheet.dxf")]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("next: "))
    typed = shlex.split(line.removeprefix("next: leafcut ").replace("…", "6"))
    assert [Path(word) for word in typed[1:-2]] == sorted(tmp_path.glob("*.dxf"))
    assert run([*typed, "--preset", "fast", "--dry-run"]) == 0
    capsys.readouterr()
    assert run([*words, "--dry-run"]) == 0
    assert "next: " not in capsys.readouterr().out


def test_a_refusal_among_several_drawings_names_the_drawing(drawings: Path) -> None:
    with pytest.raises(PlanError, match=r"open\.dxf: the layers to cut contain 1 open path"):
        api.nest([f"{drawings}/angle.dxf:1", f"{drawings}/open.dxf:2"], **SMALL)


def test_quiet_nesting_still_tells_of_parts_that_have_no_room(
    drawings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["nest", f"{drawings}/plate.dxf:9", "--sheet", "80x60:1", "--nester", "rectangles"]
    assert run([*words, "-q", "-o", str(tmp_path / "few.dxf")]) == 3
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "no room for" in shown.err
    assert "of plate" in shown.err


def test_every_variant_is_told_by_its_name_and_what_came_of_it(drawings: Path) -> None:
    told: list[Trial] = []

    def tell(progress: Progress) -> None:
        if progress.trial is not None:
            told.append(progress.trial)

    outcome = api.nest([f"{drawings}/angle.dxf:4", f"{drawings}/plate.dxf:3"], progress=tell, **SMALL)
    begun = {one.name for one in told if not one.figure}
    known = {one.name: one for one in told if one.figure}
    assert known.keys() <= begun
    for made in outcome.nests:
        assert known[f"{made.method} {made.seed}"].figure == f"{100.0 * made.utilisation_of_used:.1f} %"
    # The less, the better: the densest is the best of them.
    best = min(known.values(), key=lambda one: math.inf if one.cost is None else one.cost)
    assert best.figure == f"{100.0 * max(made.utilisation_of_used for made in outcome.nests):.1f} %"
