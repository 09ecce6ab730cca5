"""The whole drawing in Chromium: beneath what is worked, by density, measured, and where it lies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from canvas_scenes import PART, PLACES, grid_of_holes, grid_program
from canvas_server import loaded, serving

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.part import Hole, Part
from leafcut.studio.drawing.scene import part_scene

PIXEL = """([x, y]) => {
  const pane = drawing.panes[1], ratio = pane.ratio(), { view } = drawing;
  const px = Math.round(view.toX(x) * ratio), py = Math.round(view.toY(y) * ratio);
  const pixel = (dx, dy) => [...pane.ctx.getImageData(px + dx, py + dy, 1, 1).data];
  const pixels = [-1, 0, 1].flatMap((dx) => [-1, 0, 1].map((dy) => pixel(dx, dy)));
  return pixels.reduce((one, other) => (other[3] > one[3] ? other : one));
}"""
#: The strongest of the pixels around a place.
STRONGEST = """([x, y]) => {
  const pane = drawing.panes[1], ratio = pane.ratio(), { view } = drawing;
  const px = Math.round(view.toX(x) * ratio), py = Math.round(view.toY(y) * ratio);
  const { data } = pane.ctx.getImageData(px - 2, py - 2, 5, 5);
  return Math.max(...data.filter((_, k) => k % 4 === 3));
}"""
#: How much ink is in a box, each pixel by how little it lets through.
INK = """([x0, y0, x1, y1]) => {
  const pane = drawing.panes[1], ratio = pane.ratio(), { view } = drawing;
  const left = Math.round(view.toX(x0) * ratio), top = Math.round(view.toY(y1) * ratio);
  const width = Math.round((x1 - x0) * view.scale * ratio), height = Math.round((y1 - y0) * view.scale * ratio);
  const { data } = pane.ctx.getImageData(left, top, width, height);
  let sum = 0;
  for (let k = 3; k < data.length; k += 4) sum += data[k] / 255;
  return sum / (width * height);
}"""
PLACE = """([x, y]) => {
  const box = drawing.panes[1].canvas.getBoundingClientRect();
  return [box.left + drawing.view.toX(x), box.top + drawing.view.toY(y)];
}"""
CENTRE = "([x, y]) => { drawing.view.x = x; drawing.view.y = y; drawing.view.pan(0, 0); }"
RESET = """async () => {
  drawing.measure.toggle(false);
  drawing.clear();
  drawing.hidden.clear();
  drawing.setPlacement({});
  drawing.setLayers({ holes: true, whole: true, travel: true, origin: false, grid: false, numbers: false });
  window.told = [];
  window.listening ??= drawing.on("origin", (detail) => window.told.push(detail));
}"""

#: An edge around the grid of holes, on one layer, and a mark on another.
EDGE = Polyline.of_points([(0, 0), (80, 0), (80, 60), (0, 60)], closed=True)
MARK = Polyline.of_points([(20, 55), (60, 55)])
WHOLE = Part("whole", contours=(Contour(EDGE, layer="EDGE"), Contour(MARK, "text", layer="NOTES")))


def board(count: int) -> Part:
    """Return a board of 200 × 200 mm with holes of 0.3 mm in its left half alone."""
    places = np.random.default_rng(5).uniform((0, 0), (100, 200), (count, 2)).round(2)
    return Part("board", (*(Hole(x, y, 0.3) for x, y in places.tolist()), Hole(200.0, 100.0, 0.3)))


@pytest.fixture(scope="module")
def opened(browser: Any) -> Iterator[tuple[Any, list[str]]]:
    """Return the page, and the list of its errors."""
    scenes = {
        "grid.part": grid_of_holes(),
        "grid.after": grid_program(),
        "grid.whole": part_scene(WHOLE),
        "board.part": part_scene(board(40_000)),
    }
    with serving(scenes) as address:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        yield page, loaded(page, address)
        page.close()


@pytest.fixture
def page(opened: tuple[Any, list[str]]) -> Iterator[Any]:
    page, wrong = opened
    page.mouse.move(1, 719)
    page.evaluate(RESET)
    yield page
    assert wrong == []


def shown(page: Any, name: str, *layers: str) -> None:
    page.evaluate("([name, layers]) => load(name, layers)", [name, list(layers)])
    page.evaluate("drawing.fit(); settled()")


def at(page: Any, x: float, y: float) -> tuple[float, float]:
    px, py = page.evaluate(PLACE, [x, y])
    return float(px), float(py)


def readout(page: Any) -> str:
    page.evaluate("settled()")
    return str(page.inner_text(".lc-readout"))


def test_what_is_not_worked_is_drawn_fainter_than_what_is(page: Any) -> None:
    shown(page, "grid", "whole", "part")
    (x, y), radius = PLACES[6], 0.5 * PART.holes[6].diameter
    edge, rim = (page.evaluate(STRONGEST, place) for place in ([40, 0], [x + radius, y]))
    assert 60 < edge < 170 < rim
    page.evaluate("drawing.setLayers({whole: false}); settled()")
    assert page.evaluate(PIXEL, [40, 0])[3] == 0


def test_layers_of_the_drawing_have_colours_and_can_be_switched_off(page: Any) -> None:
    shown(page, "grid", "whole", "part")
    edge, mark = page.evaluate(PIXEL, [40, 0]), page.evaluate(PIXEL, [40, 55])
    assert edge[3] > 60 and mark[3] > 60
    assert max(abs(a - b) for a, b in zip(edge[:3], mark[:3], strict=True)) > 30
    page.locator(".lc-menu > summary").click()
    legend = page.get_by_role("group", name="Layers of the drawing")
    assert [box.inner_text() for box in legend.locator("label").all()] == ["EDGE", "NOTES"]
    legend.get_by_label("NOTES").uncheck()
    page.evaluate("settled()")
    assert page.evaluate(PIXEL, [40, 55])[3] == 0 and page.evaluate(PIXEL, [40, 0])[3] > 60
    legend.get_by_label("NOTES").check()
    page.evaluate("settled()")
    assert page.evaluate(PIXEL, [40, 55])[3] > 60
    page.locator(".lc-menu > summary").click()


def test_a_drawing_of_one_layer_has_no_legend(page: Any) -> None:
    shown(page, "grid", "part")
    page.locator(".lc-menu > summary").click()
    assert page.get_by_role("group", name="Layers of the drawing").count() == 0
    page.locator(".lc-menu > summary").click()


def test_many_tiny_holes_are_shades_until_they_are_zoomed(page: Any) -> None:
    """In the half that has them there is ink everywhere, in the other none; near by there are circles with gaps."""
    shown(page, "board", "part")
    left, right = page.evaluate(INK, [2, 2, 98, 198]), page.evaluate(INK, [102, 2, 196, 90])
    assert left > 0.25 and right == 0
    assert page.evaluate("drawing.partPaths.density.pictures.size") == 1
    page.evaluate("drawing.view.pan(1, 0); settled()")
    assert page.evaluate("drawing.partPaths.density.pictures.size") == 1  # it is made once for a scale
    page.evaluate("drawing.partPaths.density.pictures.clear(); drawing.view.zoom(40); settled()")
    assert page.evaluate("drawing.partPaths.density.pictures.size") == 0


def test_two_places_are_measured_from_centre_to_centre(page: Any) -> None:
    """Pointing 1 mm beside a hole's centre means the centre: from the first hole to the last it is 60 and 40 mm."""
    shown(page, "grid", "whole", "part")
    page.get_by_role("button", name="Measure").click()
    assert page.get_by_role("button", name="Measure").get_attribute("aria-pressed") == "true"
    (x0, y0), (x1, y1) = PLACES[0], PLACES[11]
    page.mouse.click(*at(page, x0 + 0.5, y0 - 0.5))
    page.mouse.move(*at(page, x1 - 0.5, y1))
    said = f"{np.hypot(x1 - x0, y1 - y0):.3f} mm"
    assert said in readout(page)
    page.mouse.click(*at(page, x1 - 0.5, y1))
    page.mouse.move(*at(page, 5, 5))
    assert said in readout(page) and "ΔX 60.000  ΔY 40.000" in readout(page)
    page.keyboard.press("Escape")
    assert page.get_by_role("button", name="Measure").get_attribute("aria-pressed") == "false"
    assert said not in page.inner_text(".lc-drawing")


def test_corners_of_outlines_are_measured_too(page: Any) -> None:
    shown(page, "grid", "whole", "part")
    page.get_by_role("button", name="Measure").click()
    page.mouse.click(*at(page, 0.4, 0.4))
    page.mouse.click(*at(page, 79.7, 60.3))
    assert "ΔX 80.000  ΔY 60.000" in readout(page)


def test_it_is_measured_with_the_keys(page: Any) -> None:
    """Enter takes what is in the middle of the drawing."""
    shown(page, "grid", "part")
    page.evaluate("drawing.panes[1].canvas.focus()")
    page.keyboard.press("d")
    page.evaluate(CENTRE, PLACES[0])
    page.keyboard.press("Enter")
    page.evaluate(CENTRE, PLACES[3])
    page.keyboard.press("Enter")
    assert "60.000 mm" in readout(page)
    page.keyboard.press("Escape")
    assert page.evaluate("drawing.measure.on") is False


def test_zero_is_dragged_onto_what_is_near_and_only_where_an_option_takes_it(page: Any) -> None:
    shown(page, "grid", "whole", "part")
    page.evaluate("drawing.setLayers({origin: true})")
    for movable, told in ((False, []), (True, [{"x": 30, "y": 10}])):
        page.evaluate("(movable) => drawing.setPlacement({ movable })", movable)
        page.evaluate("drawing.fit(); settled()")
        page.mouse.move(*at(page, 0, 0))
        page.mouse.down()
        page.mouse.move(*at(page, 20, 20))
        page.mouse.move(*at(page, 30.4, 9.8))
        page.mouse.up()
        found = [{axis: round(value, 3) for axis, value in one.items()} for one in page.evaluate("told")]
        assert found == told


def test_a_drag_of_zero_is_given_up_with_escape(page: Any) -> None:
    shown(page, "grid", "part")
    page.evaluate("drawing.setLayers({origin: true}); drawing.setPlacement({ movable: true })")
    page.evaluate("drawing.view.fit([-9, -9, 90, 70])")
    page.evaluate("drawing.panes[1].canvas.focus()")
    page.mouse.move(*at(page, 0, 0))
    page.mouse.down()
    page.mouse.move(*at(page, 30, 30))
    page.keyboard.press("Escape")
    page.mouse.up()
    assert page.evaluate("told") == []


@pytest.mark.parametrize("fits", [True, False])
def test_the_travel_of_the_machine_is_outlined(page: Any, fits: bool) -> None:
    """Dashed: some of the pixels along its edge have ink, some none; red where the part does not fit."""
    shown(page, "grid", "part")
    travel = {"box": [0, 0, 90, 70], "known": True, "fits": fits, "machine": "m"}
    page.evaluate("(travel) => drawing.setPlacement({ travel })", travel)
    page.evaluate("drawing.view.fit([-20, -20, 110, 90]); settled()")
    along = [page.evaluate(PIXEL, [x, 0.0]) for x in np.linspace(2, 88, 60).tolist()]
    inked = [pixel for pixel in along if pixel[3] > 90]
    assert 10 < len(inked) < 55
    red = all(pixel[0] > pixel[1] + 60 for pixel in inked)
    assert red is not fits
