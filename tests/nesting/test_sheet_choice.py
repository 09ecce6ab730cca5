"""Of several kinds of sheet those are taken that cost least, never more than there are; remnants go out and come in."""

from __future__ import annotations

import itertools
import json
import math
import random
from collections import Counter
from pathlib import Path
from typing import Any

import ezdxf
import pytest
import shapely

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import NestOutcome, NestPart, Stock
from leafcut.nesting import run as nest_run
from leafcut.nesting.plan import remnant as nest_remnant
from leafcut.nesting.plan.pieces import pieces_from_parts
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json

#: Plates of 50 × 50, 10 mm between two and along the edge: a sheet of L × W holds ⌊(L − 10) / 60⌋ × ⌊(W − 10) / 60⌋.
RULES: dict[str, Any] = {"kerf": 2, "gap": 8, "margin": 10, "variants": 1, "nester": "rectangles"}
SIZES = ((130, 130), (190, 130), (250, 190), (310, 310), (370, 70))


def drawing(
    file: Path, *outlines: list[tuple[float, float]], circles: tuple[tuple[float, float, float], ...] = ()
) -> Path:
    document = ezdxf.new(units=4)
    for points in outlines:
        document.modelspace().add_lwpolyline(points, close=True)
    for x, y, radius in circles:
        document.modelspace().add_circle((x, y), radius)
    document.saveas(file)
    return file


def box(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return drawing(tmp_path_factory.mktemp("plate") / "plate.dxf", box(0, 0, 50, 50))


def holds(length: int, width: int) -> int:
    return ((length - 10) // 60) * ((width - 10) // 60)


def least(wanted: int, sheets: list[tuple[tuple[int, int], int, float]]) -> float:
    """Return the minimum cost of sheets that hold these plates, by brute force; infinite if none do."""
    choices = itertools.product(*(range(count + 1) for _, count, _ in sheets))
    return min(
        (
            sum(n * price for n, (_, _, price) in zip(choice, sheets, strict=True))
            for choice in choices
            if sum(n * holds(*size) for n, (size, _, _) in zip(choice, sheets, strict=True)) >= wanted
        ),
        default=math.inf,
    )


def taken(found: NestOutcome) -> list[int]:
    best = found.nests[0]
    return [sum(one.count for one in best.layouts if one.stock == k) for k in range(len(best.stocks))]


@pytest.mark.parametrize("seed", range(6))
def test_the_sheets_taken_cost_no_more_than_the_best_of_all_choices(seed: int, plate: Path) -> None:
    """Brute force over every number of every kind of sheet; with prices, and by area without."""
    made = random.Random(seed)
    priced = seed % 3 > 0
    sheets = [
        (size, made.randint(1, 4), float(made.randint(5, 60)) if priced else float(size[0] * size[1]))
        for size in made.sample(SIZES, 3)
    ]
    wanted = made.randint(3, sum(count * holds(*size) for size, count, _ in sheets))
    words = [f"{a}x{b}:{count}" + (f"@{price:g}" if priced else "") for (a, b), count, price in sheets]
    found = api.nest([f"{plate}:{wanted}"], sheet=words, **RULES)
    best = found.nests[0]
    cost = best.cost if priced else best.sheet_area
    assert cost == pytest.approx(least(wanted, sheets))
    assert all(n <= count for n, (_, count, _) in zip(taken(found), sheets, strict=True))
    assert best.unplaced == (0,)


def test_what_has_no_room_is_told_first_and_by_the_exit_status_and_no_sheet_is_invented(
    plate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["--sheet", "130x130:1@9", "--sheet", "70x70:2@3", *["--kerf", "2", "--gap", "8", "--nester", "rectangles"]]
    assert run(["nest", f"{plate}:9", "-o", str(tmp_path / "out.dxf"), *flags]) == 3
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("missing: L436 there is no room for 3 of plate")
    assert "130x130 (1 of 1 taken at 9), 70x70 (2 of 2 taken at 3)" in second
    assert run(["nest", f"{plate}:9", *flags, "--json", "--dry-run"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert answer["variants"][0]["cost"] == 15.0
    assert [(s["name"], s["count"], s["price"]) for s in answer["sheets"]] == [("130x130", 1, 9.0), ("70x70", 2, 3.0)]
    assert answer["issues"][0]["severity"] == "missing"


def test_the_price_of_a_sheet_lives_from_the_nest_to_the_cost_of_its_parts(plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.dxf"
    api.nest([f"{plate}:2"], out, sheet="300x200:1@42.5", **{**RULES, "gap": 20})
    cut: dict[str, Any] = {"process": "cut", "thickness": 6, "iterations": 5, "threads": 1}
    answer = program_as_json(report_of(api.optimize(out, quantity=3, **cut)))["cutting"]
    assert (answer["cost"], answer["batch_cost"]) == (42.5, 127.5)
    assert [piece["cost_each"] for piece in answer["pieces"]] == pytest.approx([21.25])


@pytest.mark.parametrize(
    ("sheet", "words"),
    [
        ("300x200:0", "count of 0"),
        ("300x200@cheap", "is not a sheet"),
        ("300x200@5,400x200", "400x200 has no price"),
        ("", "is empty"),
        ("away.dxf", "away.dxf"),
        ("two.dxf", "2 separate outlines"),
        ("tiny.dxf", "leaves no room for parts"),
        ("open.dxf", "open path"),
    ],
)
def test_what_is_no_sheet_is_refused_in_one_line(
    sheet: str, words: str, plate: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawing(tmp_path / "two.dxf", box(0, 0, 200, 200), box(300, 0, 400, 200))
    drawing(tmp_path / "tiny.dxf", box(0, 0, 15, 200))
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline(box(0, 0, 200, 200), close=False)
    document.saveas(tmp_path / "open.dxf")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LeafcutError, match=words) as caught:
        api.nest([f"{plate}:2"], sheet=sheet, **RULES)
    assert "\n" not in str(caught.value)


def rings(file: Path, layer: str) -> list[shapely.Polygon]:
    """Return the outlines that ezdxf reads from a layer, arcs in chords of a hundredth."""
    found = []
    for entity in ezdxf.readfile(file).modelspace().query(f'*[layer=="{layer}"]'):
        path = ezdxf.path.make_path(entity)
        found.append(shapely.Polygon([(p.x, p.y) for p in path.flattening(0.01)]))
    return found


def metal(file: Path) -> shapely.Polygon:
    outline, *holes = sorted(rings(file, "SHEET"), key=lambda ring: -ring.area)
    return outline.difference(shapely.union_all(holes))


def test_what_remains_goes_out_and_comes_in_and_its_parts_overlap_none_of_the_earlier_ones(
    plate: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read again by ezdxf and measured by shapely, where they lay on the first sheet."""
    disc = drawing(tmp_path / "disc.dxf", circles=((0, 0, 60),))
    monkeypatch.setattr(nest_run, "REMNANT_SIZE", 80.0)
    rules = {**RULES, "gap": 6, "variants": 1}
    first, second = tmp_path / "first.dxf", tmp_path / "second.dxf"
    found = api.nest([f"{disc}:3"], first, sheet="600x400", remnants_out=tmp_path, **rules)
    (rest,) = found.remnants
    remnant = metal(Path(rest.file))
    parts = rings(first, "CUT")
    assert len(parts) == 3
    # Where the remnant was on the sheet: its lower left corner went to (0, 0).
    low = [600 - rest.stock.length, 400 - rest.stock.width]
    placed = shapely.affinity.translate(remnant, *low)
    assert min(placed.distance(part) for part in parts) >= 8.0 - 0.01
    assert shapely.box(0, 0, 600, 400).buffer(1e-6).covers(placed)
    assert remnant.area == pytest.approx(rest.stock.area, rel=1e-3)
    again = api.nest([f"{plate}:20"], second, sheet=rest.file, **rules)
    assert again.nests[0].unplaced == (0,)
    later = [shapely.affinity.translate(part, *low) for part in rings(second, "CUT")]
    assert len(later) == 20
    assert min(a.distance(b) for a in later for b in parts) >= 8.0 + 10.0 - 0.02
    assert min(a.distance(b) for a, b in itertools.combinations(later, 2)) >= 8.0 - 0.01
    assert all(remnant.buffer(-10.0 + 0.01).covers(part) for part in rings(second, "CUT"))


def test_a_sheet_with_a_hole_is_nested_round_the_hole_and_cut_without_a_lead_in_it(plate: Path, tmp_path: Path) -> None:
    """A ring of metal round a window: parts, kerfs and leads keep out of it, and the program is proved."""
    ring = drawing(tmp_path / "ring.dxf", box(0, 0, 300, 300), circles=((150, 150, 60),))
    out = tmp_path / "out.dxf"
    found = api.nest([f"{plate}:8"], out, sheet=f"{ring}", **{**RULES, "gap": 20})
    assert found.nests[0].unplaced == (0,)
    hole = shapely.Point(150, 150).buffer(60)
    assert min(part.distance(hole) for part in rings(out, "CUT")) >= 10.0 - 0.02
    outcome = api.optimize(out, process="cut", thickness=3, iterations=5, threads=1)
    assert outcome.verified
    plan = outcome.detail.plan
    assert plan is not None
    assert len(plan.sheet.holes) == 1
    lines = [shapely.LineString(cut.path.flattened(0.01)) for cut in plan.cuts]
    assert min(line.distance(hole) for line in lines) >= 0.5 * plan.data.kerf - 0.01


def test_the_drawing_of_a_nested_sheet_is_the_sheet_with_its_parts_cut_out(plate: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.dxf", tmp_path / "second.dxf"
    api.nest([f"{plate}:4"], first, sheet="310x310", **RULES)
    api.nest([f"{plate}:6"], second, sheet=str(first), **RULES)
    both = rings(first, "CUT") + rings(second, "CUT")
    assert len(both) == 10
    assert min(a.distance(b) for a, b in itertools.combinations(both, 2)) >= 10.0 - 0.01


def test_a_remnant_is_filled_once_for_the_same_parts_and_ends_with_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    square = Polyline.of_points([(0, 0), (40, 0), (40, 40), (0, 40)], closed=True)
    edge = Polyline.of_points([(0, 0), (200, 0), (200, 60), (0, 60)], closed=True)
    pieces = pieces_from_parts([NestPart("square", (Contour(square),), quantity=3)])
    stock = Stock(200.0, 60.0, 1, None, (edge,), "rest")
    looked = []
    find_position = nest_remnant.find_position
    monkeypatch.setattr(
        nest_remnant, "find_position", lambda *given, **more: looked.append(1) or find_position(*given, **more)
    )
    packer = nest_remnant.RemnantPacker(pieces, stock, 5.0, 5.0)
    first, again = packer.fill(Counter({0: 3}), False), packer.fill(Counter({0: 3}), True)
    assert len(first) == len(again) == len(looked) == 3 and packer.repeatable
    late = nest_remnant.RemnantPacker(pieces, stock, 5.0, 5.0, end=0.0)
    assert late.fill(Counter({0: 3}), False) == [] and not late.repeatable


@pytest.mark.parametrize("nester", ["rectangles", "shapes"])
@pytest.mark.parametrize("first", [True, False])
def test_a_remnant_is_filled_before_a_sheet_is_bought_for_the_rest(
    first: bool, nester: str, plate: Path, tmp_path: Path
) -> None:
    """The remnant holds 3 × 2 plates, the sheet alone would hold all: what lies on the remnant saves length of it."""
    rest = drawing(tmp_path / "rest.dxf", box(0, 0, 195, 135))
    sheets = [str(rest), "610x130"][:: 1 if first else -1]
    found = api.nest([f"{plate}:14"], sheet=sheets, **{**RULES, "nester": nester}, iterations=20)
    best = found.nests[0]
    on = {best.stocks[one.stock].name: len(one.placements) for one in best.layouts}
    assert on == {"rest": 6, "610x130": 8}
    assert best.unplaced == (0,)
    assert best.used_length < 4 * 60 + 10 + 1


def test_a_remnant_with_a_price_is_used_only_if_that_costs_less(plate: Path, tmp_path: Path) -> None:
    rest = drawing(tmp_path / "rest.dxf", box(0, 0, 190, 130))
    best = api.nest([f"{plate}:14"], sheet=[f"{rest}@5", "610x130@9"], **RULES).nests[0]
    assert [best.stocks[one.stock].name for one in best.layouts] == ["610x130"]


def test_of_remnants_alone_the_one_with_the_least_area_is_used(plate: Path, tmp_path: Path) -> None:
    wide, small = (drawing(tmp_path / f"{side}.dxf", box(0, 0, side, 135)) for side in (430, 195))
    best = api.nest([f"{plate}:6"], sheet=[str(wide), str(small)], **RULES).nests[0]
    assert [best.stocks[one.stock].name for one in best.layouts] == ["195"]
