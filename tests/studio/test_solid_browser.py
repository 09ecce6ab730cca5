"""The stock in three dimensions, in Chromium: cut as Python cuts it, there and back, drawn, measured and clicked."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from canvas_server import loaded, serving, until
from numpy.typing import NDArray
from solid_scenes import (
    CRASH_DEPTH,
    CRASH_LINE,
    HOLDER_LINE,
    SLOT_LINE,
    cut,
    see,
    shaped_scenes,
    shaped_solid,
    stepped_path,
    stepped_stock,
)

from leafcut.material.solid import cut_display_solid

#: Where a place of the program is on the page.
AT = """([x, y, z]) => {
  const { solid } = drawing, [ox, oy] = solid.header.origin, box = solid.over.getBoundingClientRect();
  const [px, py] = solid.camera.project(x - ox, y - oy, z);
  return [box.left + px, box.top + py];
}"""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Return the address of the page, with the scenes."""
    with serving(shaped_scenes()) as served:
        yield served


@pytest.fixture(scope="module")
def opened(browser: Any, address: str) -> Iterator[tuple[Any, list[str]]]:
    """Return a page with the stock, and the list of its errors."""
    context = browser.new_context(viewport={"width": 1100, "height": 800})
    page = context.new_page()
    yield page, loaded(page, address)
    context.close()


@pytest.fixture
def page(opened: tuple[Any, list[str]]) -> Iterator[Any]:
    """Return the page with the stock at the end of the program, seen from the top; nothing may go wrong on it."""
    page, wrong = opened
    page.evaluate("drawing.clear()")
    see(page)
    page.evaluate(
        "() => { const { solid } = drawing; solid.look('top'); solid.cutOpen('', 0.5); solid.colour('metal'); }"
    )
    page.evaluate("events.length = 0")
    cut(page)
    yield page
    assert wrong == []


def heights(page: Any) -> NDArray[np.float32]:
    """Return the heights of all cells, as the page shows them."""
    rows, columns = page.evaluate("[drawing.solid.stock.grid.rows, drawing.solid.stock.grid.columns]")
    found = page.evaluate("[...drawing.solid.stock.heights]")
    return np.array(found, dtype=np.float32).reshape(rows, columns)


def cutters_of(page: Any) -> list[int]:
    """Return which move cut each cell last, as a sum of every row of cells: a short witness of all of them."""
    return page.evaluate("""() => {
      const { by, grid } = drawing.solid.stock, sums = [];
      for (let at = 0; at < by.length; at += grid.columns) {
        sums.push(by.subarray(at, at + grid.columns).reduce((a, b) => a + b, 0));
      }
      return sums;
    }""")


def seek(page: Any, share: float) -> None:
    page.evaluate("(share) => drawing.seek(share * drawing.player.duration)", share)
    cut(page)


def test_the_browser_cuts_every_cell_as_python_does(page: Any) -> None:
    np.testing.assert_allclose(heights(page), shaped_solid().after.heights, rtol=0, atol=1e-5)


def test_going_back_shows_what_going_there_showed(page: Any) -> None:
    seek(page, 0.37)
    there, cutters = heights(page), cutters_of(page)
    seek(page, 0.92)
    assert heights(page).sum() < there.sum()
    seek(page, 0.37)
    np.testing.assert_allclose(heights(page), there, rtol=0, atol=1e-5)
    assert cutters_of(page) == cutters
    seek(page, 0.0)
    assert (heights(page) == 0.0).all()
    page.evaluate("drawing.seek(null)")
    cut(page)
    np.testing.assert_allclose(heights(page), shaped_solid().after.heights, rtol=0, atol=1e-5)


def test_a_click_on_the_stock_selects_the_line_that_cut_it_last(page: Any) -> None:
    page.mouse.click(*page.evaluate(AT, [40.0, 10.0, -3.0]))
    until(page, "events.some(([name]) => name === 'select')")
    assert page.evaluate("events.findLast(([name]) => name === 'select')[1].line") == SLOT_LINE
    page.mouse.click(*page.evaluate(AT, [105.0, 70.0, 0.0]))
    assert "not cut" in page.inner_text(".lc-readout")


def test_a_collision_is_marked_and_leads_to_its_line_by_pointer_and_by_key(page: Any) -> None:
    assert page.inner_text(".lc-collisions") == "Collisions: 1"
    page.mouse.click(*page.evaluate(AT, [110.0, 20.0, -CRASH_DEPTH]))
    said = page.inner_text(".lc-readout")
    assert f"{CRASH_DEPTH:.3f} mm" in said
    assert f"line {CRASH_LINE}" in said
    page.evaluate("events.length = 0")
    page.locator(".lc-over").focus()
    page.keyboard.press("PageDown")
    until(page, "events.some(([name]) => name === 'select')")
    assert page.evaluate("events.findLast(([name]) => name === 'select')[1].line") == CRASH_LINE


def test_measured_is_the_way_between_two_places_of_the_surface(page: Any) -> None:
    page.evaluate("drawing.toggleMeasure()")
    page.mouse.click(*page.evaluate(AT, [20.0, 70.0, 0.0]))
    page.mouse.click(*page.evaluate(AT, [50.0, 10.0, -3.0]))
    dx, dy, dz = page.evaluate(
        "() => { const { from, to } = drawing.solid.marks; return ['x', 'y', 'z'].map((a) => to[a] - from[a]); }"
    )
    assert dx == pytest.approx(30.0, abs=0.3)
    assert dy == pytest.approx(-60.0, abs=0.3)
    assert dz == pytest.approx(-3.0, abs=1e-4)
    assert f"{np.sqrt(dx**2 + dy**2 + dz**2):.3f} mm" in page.inner_text(".lc-readout")
    page.keyboard.press("Escape")
    page.evaluate("drawing.solid.marks.measure(false)")


def test_a_section_takes_off_the_half_that_is_nearer(page: Any) -> None:
    page.evaluate("drawing.solid.look('front')")
    cut(page)
    place = "drawing.solid.placeAt(drawing.solid.camera.width / 2, drawing.solid.camera.height_px / 2)"
    assert page.evaluate(f"{place}.y") == pytest.approx(-40.0, abs=0.2)
    page.evaluate("drawing.solid.cutOpen('y', 0.5)")
    assert page.evaluate(f"{place}.y") == pytest.approx(0.0, abs=0.2)


def test_every_colouring_but_the_metal_says_what_its_colours_mean(page: Any) -> None:
    pictures = set()
    for colouring, words in (("metal", ""), ("depth", "mm"), ("engagement", "100 %"), ("feed", "mm/min")):
        page.locator(".lc-solid-bar select").first.select_option(colouring)
        cut(page)
        assert page.locator(".lc-scale").is_visible() == bool(words)
        assert words in page.locator(".lc-scale").inner_text()
        pictures.add(page.locator(".lc-picture").screenshot())
    assert len(pictures) == 4


def test_keys_turn_move_and_zoom_the_view(page: Any) -> None:
    page.locator(".lc-over").focus()
    state = "(() => { const c = drawing.solid.camera; return [c.turn, c.height, c.scale, c.x]; })()"
    before = page.evaluate(state)
    for key in ("ArrowLeft", "ArrowDown", "+", "Shift+ArrowRight"):
        page.keyboard.press(key)
        after = page.evaluate(state)
        assert after != before
        before = after
    page.keyboard.press("Home")
    assert page.evaluate("drawing.solid.camera.fitted")


def test_a_part_that_is_not_flat_is_cut_as_python_cuts_it_and_what_holds_it_is_coloured_otherwise(page: Any) -> None:
    see(page, "steps")
    solid = cut_display_solid(stepped_path(), stepped_stock())
    np.testing.assert_allclose(heights(page), solid.after.heights, rtol=0, atol=1e-5)
    seek(page, 0.0)
    assert (heights(page) == solid.before.heights).all()
    tint = np.array(page.evaluate("[...drawing.solid.stock.tint]")).reshape(solid.held.shape)
    assert ((tint == 255) == solid.held).all()
    page.locator(".lc-over").focus()
    page.keyboard.press("PageDown")
    said = page.inner_text(".lc-readout")
    assert "Holder" in said
    assert f"line {HOLDER_LINE}" in said


def test_a_tool_is_drawn_with_the_holder_that_is_known(page: Any) -> None:
    see(page, "steps")
    seek(page, 0.5)
    parts = page.evaluate("drawing.solid._tool().parts.map(([low, high, radius]) => [low, high, radius])")
    assert parts == [[30, 42, 10], [20, 30, 3], [pytest.approx(3.0 / np.tan(np.radians(59.0))), 20, 3]]


def test_what_two_programs_leave_otherwise_is_marked_and_told(page: Any) -> None:
    page.evaluate("load('compared', ['before', 'after', 'solid_before', 'solid_after'])")
    until(page, "drawing.modes.length === 4 && drawing.solid.ready && !drawing.solid.differs.hidden")
    cut(page)
    assert "higher here" in page.inner_text(".lc-differs")
    tones = "[253, 254].map((tone) => drawing.solid.stock.tint.filter((t) => t === tone).length)"
    higher, lower = page.evaluate(tones)
    assert higher * page.evaluate("drawing.solid.stock.grid.cell ** 2") == pytest.approx(
        10.0 * 50.0 + 25.0 * np.pi, rel=0.1
    )
    assert lower == 0
    assert page.locator("[data-mode]:visible").all_inner_texts() == ["Before", "After"]
    page.get_by_role("button", name="Next difference").click()
    assert page.inner_text(".lc-readout") == "Z -2.500 here, Z -3.000 in the other program"
    page.evaluate("drawing.setMode('before')")
    cut(page)
    until(page, "drawing.solid.ready")
    assert page.evaluate(tones) == [0, higher]
    page.evaluate("drawing.clear()")
    see(page, "same")
    until(page, "drawing.solid.ready && !drawing.solid.differs.hidden")
    assert page.inner_text(".lc-differs") == "Both programs leave the same stock"


def test_stock_that_is_not_known_is_told_and_not_drawn(page: Any) -> None:
    page.evaluate("drawing.clear()")
    page.evaluate("load('unknown', ['after', 'solid_after'])")
    until(page, "!drawing.solid.reason.hidden")
    assert "the shape of T9 is unknown" in page.inner_text(".lc-refused")
    until(page, "drawing.solid.picture.hidden")


def test_there_is_no_solid_view_where_there_is_no_stock(page: Any) -> None:
    page.evaluate("drawing.clear('solid_after')")
    assert page.locator("[data-space=solid]").is_hidden()
    assert page.locator(".lc-solid").is_hidden()
    assert page.locator(".lc-pane:not(.lc-solid) .lc-canvas").last.is_visible()


def test_a_browser_without_webgl_shows_the_reason(browser: Any, address: str) -> None:
    with closing(browser.new_context()) as context:
        context.add_init_script("""{
          const { getContext } = HTMLCanvasElement.prototype;
          HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
            return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...more);
          };
        }""")
        page = context.new_page()
        loaded(page, address)
        page.evaluate("load('shapes', ['after', 'solid_after'])")
        page.evaluate("drawing.setSpace('solid')")
        until(page, "!drawing.solid.reason.hidden")
        assert page.inner_text(".lc-refused") == "The stock cannot be shown: this browser has no WebGL"
        assert page.locator(".lc-busy").is_hidden()
