"""Quotes of sheets and of milled plates, against hand calculations; and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import OptionError, PlanError
from leafcut.results.program import ProgramResult

FAST: dict[str, Any] = {"preset": "fast", "threads": 1, "bound": False, "iterations": 5}
SHOP: dict[str, Any] = {
    "seller": "Example Metalwork; 1 Main Street", "terms": "No taxes included", "currency": "EUR", "valid_days": 30,
    "shop_rate": 72, "setup_cost": 25, "markup": "20%",
}  # fmt: skip
SHEET = {"thickness": 6, "material": "mild_steel", "cutting_rate": 36, "pierce_cost": 0.5, **SHOP, **FAST}
PLATE = {"thickness": 4, "tool_diameter": 3, "feed": "600mm/min", "spindle_speed": 12000, "material": "aluminium"}
PLATE |= {"machine": "shapeoko-router", **SHOP, **FAST}
#: Densities of mild steel and of aluminium 6061, kg/mm³.
STEEL, ALUMINIUM = 7850e-9, 2700e-9
SQUARE, BORE = 40.0 * 40.0, math.pi * 8.0**2


def drawing(file: Path, *, edge: bool = True, holes: tuple[bool, ...] = (True, True), tiny: bool = False) -> Path:
    """Draw squares with or without a hole; around them a sheet of 200 by 100 mm; a hole below the kerf."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for k, hole in enumerate(holes):
        x = 20.0 + 90.0 * k
        space.add_lwpolyline([(x, 30), (x + 40, 30), (x + 40, 70), (x, 70)], close=True)
        if hole:
            space.add_circle((x + 20, 50), 8)
    if edge:
        corners = [(0, 0), (200, 0), (200, 100), (0, 100)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "SHEET"})
    if tiny:
        space.add_circle((25, 35), 0.2)
    document.saveas(file)
    return file


@pytest.fixture(scope="module")
def sheet(tmp_path_factory: pytest.TempPathFactory) -> tuple[ProgramResult, Path]:
    """Return a quoted sheet with two different squares, three sheets in the batch, at 1.40 per kg."""
    folder = tmp_path_factory.mktemp("sheet")
    file, page = drawing(folder / "squares.dxf", holes=(True, False)), folder / "quote.html"
    return api.cut(file, quote=page, quantity=3, price_per_kg=1.4, **SHEET), page


def test_the_cost_of_a_sheet_is_machine_cutting_pierces_and_metal(sheet: tuple[ProgramResult, Path]) -> None:
    outcome, _ = sheet
    times = outcome.detail.plan.measures.sheet
    metal = 200 * 100 * 6 * STEEL * 1.4
    each = 72 * times.total_s / 3600 + 36 * (times.cut_s + times.pierce_s) / 3600 + 0.5 * 3 + metal
    assert times.pierces == 3
    assert outcome.detail.plan.measures.cost == pytest.approx(each)
    assert outcome.quote.cost == pytest.approx(3 * each + 25)
    least = 1.2 * (3 * each + 25)
    assert least <= outcome.quote.total < least + 0.01 * 6


def test_the_lines_of_a_sheet_are_its_kinds_of_parts(sheet: tuple[ProgramResult, Path]) -> None:
    outcome, _ = sheet
    first, second = outcome.quote.lines
    assert (first.quantity, second.quantity) == (3, 3)
    assert first.part.weight_kg == pytest.approx((SQUARE - BORE) * 6 * STEEL, rel=1e-6)
    assert second.part.weight_kg == pytest.approx(SQUARE * 6 * STEEL, rel=1e-6)
    assert first.time_s + second.time_s == pytest.approx(outcome.detail.plan.measures.sheet.total_s)
    assert [len(line.part.edges) for line in outcome.quote.lines] == [2, 1]


def test_the_page_is_written_with_the_program(sheet: tuple[ProgramResult, Path]) -> None:
    outcome, page = sheet
    html = page.read_text(encoding="utf-8")
    assert f"EUR {outcome.quote.total:.2f}" in html
    assert "Example Metalwork" in html and "mild steel" in html and "No taxes included" in html
    assert "supplied by the customer" not in html


@pytest.mark.parametrize("price", ["stock_price", "price_per_kg"])
def test_material_without_a_price_is_supplied_by_the_customer(tmp_path: Path, price: str) -> None:
    page = tmp_path / "quote.html"
    outcome = api.cut(drawing(tmp_path / "squares.dxf"), quote=page, **{price: 0}, **SHEET)
    assert outcome.quote.is_material_supplied
    assert "supplied by the customer" in page.read_text(encoding="utf-8")


def test_equal_parts_are_one_line_with_the_name_of_the_drawing(tmp_path: Path) -> None:
    outcome = api.cut(drawing(tmp_path / "squares.dxf"), quote=tmp_path / "q.html", stock_price=9, **SHEET)
    (line,) = outcome.quote.lines
    assert (line.part.name, line.quantity) == ("squares", 2)


def test_a_plate_has_the_copies_of_its_drawing(tmp_path: Path) -> None:
    """Hand calculation: the machine time at the shop rate, and the plate; half of it for each of two copies."""
    file = drawing(tmp_path / "square.dxf", edge=False, holes=(True,))
    more = {"copies": "2x1", "pitch": (70, 70), "quantity": 5, "stock_price": 40}
    outcome = api.part(file, quote=tmp_path / "q.html", **more, **PLATE)
    each = 72 * outcome.after.time_s / 3600 + 40
    (line,) = outcome.quote.lines
    assert (line.quantity, line.part.outlines, len(line.part.edges)) == (10, 1, 2)
    assert line.time_s == pytest.approx(outcome.after.time_s / 2)
    assert outcome.quote.cost == pytest.approx(5 * each + 25)
    assert line.price == math.ceil(round(100 * 1.2 * (5 * each + 25) / 10, 6)) / 100
    assert line.part.weight_kg == pytest.approx((SQUARE - BORE) * 4 * ALUMINIUM, rel=1e-4)


def test_pockets_and_drilled_holes_reduce_the_weight(tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for layer, corner, size in (("EDGE", 0.0, 60.0), ("DEEP", 10.0, 20.0)):
        low, high = corner, corner + size
        points = [(low, low), (high, low), (high, high), (low, high)]
        space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
    space.add_circle((45, 45), 3, dxfattribs={"layer": "HOLE"})
    document.saveas(tmp_path / "part.dxf")
    (tmp_path / "rules.toml").write_text('[layer]\nEDGE = "profile"\nDEEP = "pocket 2mm"\nHOLE = "bore"\n')
    outcome = api.part(
        tmp_path / "part.dxf", operations=tmp_path / "rules.toml", quote=tmp_path / "q.html", stock_price=1, **PLATE
    )
    volume = (60 * 60 - math.pi * 9) * 4 - 20 * 20 * 2
    part = outcome.quote.lines[0].part
    assert part.weight_kg == pytest.approx(volume * ALUMINIUM, rel=1e-3)
    assert not part.lighter


def test_a_density_of_the_shop_replaces_that_of_the_material(tmp_path: Path) -> None:
    file = drawing(tmp_path / "square.dxf", holes=(False,))
    given = {**PLATE, "material": "birch plywood", "density": 680, "price_per_kg": 2}
    outcome = api.part(file, quote=tmp_path / "q.html", **given)
    assert outcome.quote.lines[0].part.weight_kg == pytest.approx(SQUARE * 4 * 680e-9, rel=1e-4)
    plate = 200 * 100 * 4 * 680e-9 * 2
    assert outcome.quote.cost == pytest.approx(72 * outcome.after.time_s / 3600 + plate + 25)


def test_the_json_answer_has_the_quote(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = drawing(tmp_path / "squares.dxf")
    options = {name: value for name, value in SHEET.items() if name != "bound"} | {"stock_price": 9, "quantity": 2}
    words = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    page = tmp_path / "quote.html"
    assert run(["cut", str(file), *words, "--no-bound", f"--quote={page}", "--json", "--no-defaults"]) == 0
    quote = json.loads(capsys.readouterr().out)["quote"]
    assert (quote["currency"], quote["runs"], quote["parts"][0]["quantity"]) == ("EUR", 2, 4)
    assert quote["price"] == pytest.approx(4 * quote["parts"][0]["price_each"])
    assert page.exists()


def refused(file: Path, page: Path, words: str, **options: Any) -> None:
    with pytest.raises((OptionError, PlanError), match=words):
        api.optimize(file, quote=page, **options)
    assert not page.exists()


def test_what_the_shop_has_not_stated_is_refused_by_name(tmp_path: Path) -> None:
    file, page = drawing(tmp_path / "squares.dxf"), tmp_path / "quote.html"
    names = [
        "seller",
        "terms",
        "currency",
        "valid_days",
        "shop_rate",
        "setup_cost",
        "markup",
        "cutting_rate",
        "material",
    ]
    flags = ", ".join("--" + name.replace("_", "-") for name in names)
    refused(file, page, f"^--quote: a quote also needs {flags}; ", process="cut", thickness=6)
    for name in names:
        given = {key: value for key, value in SHEET.items() if key != name}
        refused(file, page, f"needs --{name.replace('_', '-')}; ", process="cut", stock_price=9, **given)
    given = {key: value for key, value in PLATE.items() if key != "material"}
    refused(file, page, "needs --material; ", process="part", stock_price=9, **given)
    refused(file, page, "needs --seller; ", process="cut", stock_price=9, **{**SHEET, "seller": " ; "})


@pytest.mark.parametrize(
    "edge, options, words",
    [
        (True, {}, "^--quote: the price of the material is missing; give --stock-price or --price-per-kg"),
        (False, {"price_per_kg": 2}, "^--price-per-kg: the size of the sheet or plate is unknown"),
        (True, {"price_per_kg": 2, "stock_price": 0}, "^--price-per-kg: not used with --stock-price"),
        (True, {"price_per_kg": 2, "stock_price": 3}, "^--price-per-kg: not used with --stock-price"),
    ],
)
def test_a_price_of_the_material_is_never_guessed(edge: bool, options: Any, words: str, tmp_path: Path) -> None:
    file = drawing(tmp_path / "squares.dxf", edge=edge)
    refused(file, tmp_path / "quote.html", words, process="cut", **options, **SHEET)


def test_an_unknown_density_is_refused(tmp_path: Path) -> None:
    file, given = drawing(tmp_path / "squares.dxf"), {**PLATE, "material": "birch plywood", "stock_price": 9}
    refused(file, tmp_path / "q.html", "^--quote: the density of 'birch plywood' is unknown", process="part", **given)


def test_a_program_that_leaves_out_work_has_no_quote(tmp_path: Path) -> None:
    file = drawing(tmp_path / "squares.dxf", tiny=True)
    given = {"process": "cut", "stock_price": 9, **SHEET}
    refused(file, tmp_path / "q.html", "^--quote: the program leaves out work, .*; correct the drawing", **given)


def test_other_kinds_of_work_and_other_files_are_refused(tmp_path: Path) -> None:
    file, page = drawing(tmp_path / "squares.dxf"), tmp_path / "quote.html"
    words = "^--quote: this option does not apply to drilling, only to cutting a sheet and milling parts"
    refused(file, page, words, process="drill", depth=3)
    refused(file, tmp_path / "quote.pdf", "'quote.pdf' is not a web page; name a file ending in .html", process="cut")
    with pytest.raises(OptionError, match=r"^--markup: only used with --quote; add --quote"):
        api.cut(file, thickness=6, markup=20)


def test_values_of_the_shop_are_not_used_without_a_quote(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text("markup = 20\nprice_per_kg = 2\nsetup_cost = 5\n")
    outcome = api.cut(drawing(tmp_path / "squares.dxf"), thickness=6, options_file=shop, **FAST)
    assert outcome.quote is None
    assert outcome.detail.plan.measures.cost == 0.0


@pytest.mark.slow
def test_the_price_in_a_nested_drawing_counts_unless_another_is_given(tmp_path: Path) -> None:
    """The nest states 60 for its sheet; the parts keep their names."""
    part = drawing(tmp_path / "square.dxf", edge=False, holes=(True,))
    nested = tmp_path / "nested.dxf"
    api.nest([f"{part}:3"], nested, sheet="400x200@60", nester="rectangles", kerf=1.5, gap=6, seed=1)
    given = {"quote": tmp_path / "q.html", **SHEET}
    stated = api.cut(nested, **given)
    replaced = api.cut(nested, stock_price=0, **given)
    assert stated.quote.cost - replaced.quote.cost == pytest.approx(60)
    assert [(line.part.name, line.quantity) for line in stated.quote.lines] == [("square", 3)]
    with pytest.raises(
        OptionError, match=r"^--price-per-kg: the drawing states a price of 60 for the sheet; leave out"
    ):
        api.cut(nested, price_per_kg=2, **given)


def test_a_file_of_options_cannot_name_the_quote(tmp_path: Path) -> None:
    """The next job would replace the quote of this one."""
    shop = tmp_path / "shop.toml"
    shop.write_text('quote = "quote.html"\n')
    with pytest.raises(OptionError, match=r"^--quote: name the file on the command line"):
        api.cut(drawing(tmp_path / "squares.dxf"), options_file=shop, stock_price=9, **SHEET)
