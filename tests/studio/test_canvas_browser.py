"""The drawing in Chromium: its content, the pointer, the program next to it, and playing in machine time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from canvas_scenes import CUT_LINE, MACHINE, PART, PLACES, grid_of_holes, grid_path, grid_program
from canvas_server import loaded, serving, until

from leafcut.model.issue import Issue
from leafcut.model.part import Part
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.report.playback import playback_of_path
from leafcut.studio.drawing.scene import part_scene, pheromone_scene, toolpath_scene

PIXEL = """([x, y, dx = 0, dy = 0]) => {
  const pane = drawing.panes[1], ratio = pane.ratio(), { view } = drawing;
  const px = Math.round((view.toX(x) + dx) * ratio), py = Math.round((view.toY(y) + dy) * ratio);
  return [...pane.ctx.getImageData(px, py, 1, 1).data];
}"""
PLACE = "([x, y]) => { const b = drawing.panes[1].canvas.getBoundingClientRect(); \
return [b.left + drawing.view.toX(x), b.top + drawing.view.toY(y)]; }"


UNDER = "([px, py]) => { const b = drawing.panes[1].canvas.getBoundingClientRect(); \
return [drawing.view.mmX(px - b.left), drawing.view.mmY(py - b.top)]; }"
RESET = """async () => {
  delete document.documentElement.dataset.theme;
  drawing.clear();
  drawing.editable = false;
  const on = ["rapids", "cuts", "holes", "numbers", "arrows", "issues", "pheromone", "kerf", "grid"];
  drawing.setLayers({ extents: false, ...Object.fromEntries(on.map((layer) => [layer, true])) });
  await load("grid", ["part", "after"]);
  drawing.fit();
  events.length = 0;
  await settled();
}"""


def there_and_back(x: float, y: float) -> Toolpath:
    """Return 6,000 cuts of 100 mm on one line, up (where x is given) or across (where y is)."""
    path = ToolpathBuilder()
    path.rapid(x, y, 0.0)
    for k in range(6000):
        far = 100.0 if k % 2 == 0 else 0.0
        path.feed(x=x or far, y=y or far, feed=50.0)
    return path.build()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Return the address of the page, with the scenes of the tests."""
    slow = grid_path()
    scenes = {
        "grid.part": grid_of_holes(),
        "grid.after": grid_program(),
        "grid.before": toolpath_scene(slow, MACHINE),
        "grid.pheromone": pheromone_scene(PLACES, [(0, 1), (0, 11)], [1.0, 0.0]),
        "odd.part": part_scene(Part("odd", PART.holes, issues=(Issue("L311", "a gap was closed", "at (25, 35)"),))),
        "wide.after": toolpath_scene(there_and_back(0, 50), MACHINE),
        "tall.after": toolpath_scene(there_and_back(50, 0), MACHINE),
        "later.pheromone": pheromone_scene(PLACES, [(0, 1), (0, 11)], [0.0, 1.0]),
    }
    with serving(scenes) as served:
        yield served


@pytest.fixture(scope="module")
def opened(browser: Any, address: str) -> Iterator[tuple[Any, list[str]]]:
    """Return the page, and the list of its errors."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, device_scale_factor=2)
    page = context.new_page()
    yield page, loaded(page, address)
    context.close()


@pytest.fixture
def page(opened: tuple[Any, list[str]]) -> Iterator[Any]:
    """Return the page with the part and its program; afterwards nothing may have failed or gone to another host."""
    page, wrong = opened
    page.mouse.move(1, 719)
    page.evaluate(RESET)
    yield page
    assert wrong == []


def place_of(page: Any, x: float, y: float) -> tuple[float, float]:
    px, py = page.evaluate(PLACE, [x, y])
    return float(px), float(py)


def readout(page: Any) -> str:
    page.evaluate("settled()")
    return str(page.inner_text(".lc-readout"))


def test_there_is_ink_where_a_hole_is_and_none_beside_it(page: Any) -> None:
    """The rim of hole 7 (radius 2.25 mm) has its colour; half way to the next hole there is only the grid."""
    page.evaluate("drawing.setLayers({rapids: false, numbers: false, arrows: false, grid: false})")
    page.evaluate("settled()")
    x, y = PLACES[6]
    assert page.evaluate(PIXEL, [x, y])[3] == 255
    rim = page.evaluate(PIXEL, [x + 2.25, y])
    assert rim[3] > 200 and max(abs(a - b) for a, b in zip(rim, (0x5C, 0x6A, 0x62), strict=False)) < 60
    assert page.evaluate(PIXEL, [x + 10, y + 8])[3] == 0


def test_rapids_and_cuts_have_their_own_colours_and_layers(page: Any) -> None:
    page.evaluate("drawing.setLayers({holes: false, grid: false, arrows: false, numbers: false})")
    page.evaluate("settled()")
    blue, orange = page.evaluate(PIXEL, [20, 10]), page.evaluate(PIXEL, [20, 70])
    assert blue[2] > blue[0] and blue[3] > 90 and orange[0] > orange[2] and orange[3] > 90
    page.keyboard.press("Tab")
    page.evaluate("drawing.panes[1].canvas.focus()")
    page.keyboard.press("r")  # a plain letter is the page's
    page.evaluate("settled()")
    assert page.evaluate(PIXEL, [20, 10])[3] > 90
    page.keyboard.press("Shift+R")
    page.evaluate("settled()")
    assert page.evaluate(PIXEL, [20, 10])[3] == 0 and page.evaluate(PIXEL, [20, 70])[3] > 90


def test_what_is_under_the_pointer_stays_there_when_zooming(page: Any) -> None:
    px, py = (round(c) for c in place_of(page, *PLACES[5]))
    x, y = page.evaluate(UNDER, [px, py])
    page.mouse.move(px, py)
    before = page.evaluate("drawing.view.scale")
    page.mouse.wheel(0, -600)
    until(page, f"drawing.view.scale > {1.4 * before}")
    assert place_of(page, x, y) == pytest.approx((px, py), abs=1e-6)


def test_a_drag_takes_what_is_under_the_pointer_along(page: Any) -> None:
    px, py = place_of(page, *PLACES[5])
    page.mouse.move(px, py)
    page.mouse.down()
    page.mouse.move(px + 60, py - 25, steps=4)
    page.mouse.up()
    x, y = place_of(page, *PLACES[5])
    # What moves less than a click is not yet a drag: the first step may be lost.
    assert (x, y) == pytest.approx((px + 60, py - 25), abs=5)
    assert page.evaluate("drawing.selected") is None


def test_two_fingers_keep_what_is_between_them(page: Any) -> None:
    px, py = (round(c) for c in place_of(page, *PLACES[5]))
    x, y = page.evaluate(UNDER, [px, py])
    before = page.evaluate("drawing.view.scale")
    session = page.context.new_cdp_session(page)
    for kind, apart in (("touchStart", 40), ("touchMove", 60), ("touchMove", 80), ("touchEnd", 0)):
        points = [{"x": px + side * apart, "y": py, "id": k} for k, side in enumerate((-1, 1))]
        fingers = [] if kind == "touchEnd" else points
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})
    assert page.evaluate("drawing.view.scale") == pytest.approx(2 * before, rel=0.02)
    assert place_of(page, x, y) == pytest.approx((px, py), abs=1)


def test_keys_move_and_fit_the_view(page: Any) -> None:
    before = page.evaluate("drawing.view.snapshot()")
    page.evaluate("drawing.panes[1].canvas.focus()")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("+")
    moved = page.evaluate("drawing.view.snapshot()")
    assert moved["x"] > before["x"] and moved["scale"] > before["scale"]
    page.keyboard.press("f")
    assert page.evaluate("drawing.view.snapshot()") == before


def test_the_pointer_names_the_hole_it_is_on(page: Any) -> None:
    for hole in (0, 6, 11):
        x, y = PLACES[hole]
        page.mouse.move(*place_of(page, x + 0.5, y - 0.4))
        said = readout(page)
        assert said.startswith(f"Hole {hole + 1} ")
        assert f"Ø {PART.holes[hole].diameter:.3f}" in said and f"X {x:.3f}  Y {y:.3f}" in said
        assert f"no. {hole + 1}" in said and f"line {hole + 2}" in said


def test_the_pointer_names_moves_with_their_length_and_line(page: Any) -> None:
    page.mouse.move(*place_of(page, 20, 70.1))
    assert readout(page).startswith("Cut · 40.000 mm") and f"line {CUT_LINE}" in readout(page)
    page.mouse.move(*place_of(page, 60, 50.0))
    assert readout(page).startswith("Arc · 62.832 mm · R 20.000")
    page.mouse.move(*place_of(page, 20, 10.0))
    assert readout(page).startswith("Rapid · 20.000 mm")
    page.mouse.move(*place_of(page, 85, 30.0))
    assert readout(page).startswith("X 85.0")


def test_the_pointer_says_what_an_issue_is(page: Any) -> None:
    page.evaluate("load('odd', ['part'])")
    page.evaluate("settled()")
    page.mouse.move(*place_of(page, 25, 35))
    assert readout(page) == "L311 · a gap was closed · at (25, 35)"


def test_playing_is_where_the_toolpath_is_at_that_time(page: Any) -> None:
    """The place is worked out here from rows and seconds; the page is asked at times in the middle of rows."""
    rows = playback_of_path(grid_path(), MACHINE)
    ends = np.cumsum(rows.seconds)
    for time in (0.05, 3.0, 0.5 * ends[-1], ends[-2] - 0.5):
        row = int(np.searchsorted(ends, time, side="right"))
        share = (time - ends[row - 1]) / rows.seconds[row] if row else time / rows.seconds[0]
        if row and row not in rows.arc_row:
            x, y, z = rows.place[row - 1] + share * (rows.place[row] - rows.place[row - 1])
            page.evaluate("t => drawing.seek(t)", float(time))
            at = page.evaluate("drawing.panes[1].at")
            assert at["row"] == row
            assert (at["x"], at["y"], at["z"]) == pytest.approx((x, y, z), abs=1e-3)
    page.evaluate("t => drawing.seek(t)", float(ends[-2] + 0.5 * rows.seconds[-1]))
    at = page.evaluate("drawing.panes[1].at")
    assert (at["x"], at["y"]) == pytest.approx((60.0, 50.0), abs=1e-3)


def test_while_playing_the_past_is_strong_the_future_pale_and_the_line_is_told(page: Any) -> None:
    page.evaluate("drawing.setLayers({holes: false, grid: false, arrows: false, numbers: false})")
    page.evaluate("drawing.seek(drawing.main.scene.ends[drawing.main.scene.rowOfLine(8)] + 0.01)")
    page.evaluate("settled()")
    past, future = page.evaluate(PIXEL, [20, 10]), page.evaluate(PIXEL, [20, 50])
    assert past[3] > 1.8 * future[3] > 0
    until(page, "events.findLast(([name]) => name === 'time')[1].line === 8")


def test_playing_goes_on_with_the_clock_and_by_blocks(page: Any) -> None:
    page.evaluate("drawing.player.play(1)")
    until(page, "drawing.player.time > 0.1")
    page.evaluate("drawing.panes[1].canvas.focus()")
    page.keyboard.press(" ")
    until(page, "!drawing.player.playing")
    page.evaluate("drawing.seek(0)")
    line = "drawing.main.scene.line[drawing.main.scene.rowAt(drawing.player.time - 1e-6)]"
    for key, run in ((".", 2), (".", 3), (",", 2), (".", 3)):
        page.keyboard.press(key)
        assert page.evaluate(line) == run


def test_a_picture_that_takes_several_frames_is_finished_and_shows_the_newest(page: Any) -> None:
    """With hardly any drawing time, the content of the same view differs from the previous one."""
    page.evaluate("import('/static/buffer.js').then(m => { m.budget.learn = () => {}; m.budget.perMs = 1; })")
    page.evaluate("drawing.setLayers({holes: false, grid: false, arrows: false, numbers: false})")
    page.evaluate("drawing.fit(); drawing.view.zoom(0.5)")
    for name, across, up in (("wide", True, False), ("tall", False, True)):
        page.evaluate(f"load('{name}', ['after'])")
        page.evaluate("settled()")
        assert [page.evaluate(PIXEL, at)[3] > 90 for at in ([10, 50], [50, 10])] == [across, up]
    page.evaluate("import('/static/buffer.js').then(m => delete m.budget.learn)")


def test_before_and_after_stand_side_by_side_under_one_view_and_one_clock(page: Any) -> None:
    page.evaluate("load('grid', ['before'])")
    page.evaluate("settled()")
    assert page.evaluate("drawing.mode") == "after"
    page.click("[data-mode=side]")
    page.evaluate("drawing.seek(4)")
    page.evaluate("settled()")
    left, right = page.evaluate("drawing.panes.map(p => [p.at.row, p.canvas.width, p.main.scene.header.which])")
    assert left[:2] == right[:2] and (left[2], right[2]) == ("before", "after")


def test_pheromone_changes_with_its_strengths(page: Any) -> None:
    page.evaluate("drawing.setLayers({rapids: false, holes: false, grid: false, arrows: false, numbers: false})")
    page.evaluate("load('grid', ['pheromone'])")
    page.evaluate("settled()")
    assert page.evaluate(PIXEL, [20, 10])[3] > 60 and page.evaluate(PIXEL, [25, 20])[3] == 0
    page.evaluate("load('later', ['pheromone'])")
    page.evaluate("settled()")
    assert page.evaluate(PIXEL, [20, 10])[3] == 0 and page.evaluate(PIXEL, [25, 20])[3] > 60


def test_a_stop_can_be_dragged_only_where_editing_is_allowed(page: Any) -> None:
    def drag() -> Any:
        page.mouse.move(*place_of(page, *PLACES[0]))
        page.mouse.down()
        page.mouse.move(*place_of(page, *PLACES[5]), steps=5)
        page.mouse.up()
        return page.evaluate("events.filter(e => e[0] === 'drag').map(e => e[1])")

    assert drag() == []
    page.evaluate("drawing.fit(); drawing.editable = true")
    (told,) = drag()
    assert (told["what"], told["number"], told["onto"]) == ("order", 1, 6)
    assert told["from"] == pytest.approx(PLACES[0], abs=1e-3)


def test_colours_follow_the_theme_of_the_page(page: Any) -> None:
    light = page.evaluate("drawing.panes[1].colours.cut")
    page.evaluate("document.documentElement.dataset.theme = 'dark'")
    until(page, "drawing.panes[1].colours.cut === '#ff8450'")
    assert light == "#cf3f0a"


def test_bytes_that_are_no_scene_are_refused_with_one_line(page: Any) -> None:
    said = page.evaluate("() => { try { drawing.show(new ArrayBuffer(3), 'after'); } catch (e) { return e.message; } }")
    assert said == "this is no scene of leafcut's"
    assert page.evaluate("drawing.main.scene.rows") > 30


def test_the_notice_of_a_run_says_how_it_ended(page: Any) -> None:
    states = ["done", "stopped", "failed", "cancelled", "interrupted"]
    told = page.evaluate(
        """async (states) => {
          const told = [], ends = ["failed", "cancelled", "interrupted"];
          const words = { done: "over", ...Object.fromEntries(ends.map((end) => [end, end])) };
          window.Notification = class { constructor(_, { body }) { told.push(body); } };
          window.Notification.permission = "granted";
          Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
          localStorage.setItem("leafcut-notice", "on");
          await import("/static/badge.js");
          document.dispatchEvent(new Event("DOMContentLoaded"));
          const badge = document.createElement("div"), look = () => new Promise((done) => setTimeout(done, 20));
          Object.assign(badge, { id: "badge", hidden: true });
          badge.dataset.words = JSON.stringify(words);
          document.body.append(badge);
          for (const end of states) {
            for (const state of ["running", end]) {
              badge.dataset.job = JSON.stringify({ job: end, name: "plate", state, share: 0 });
              await look();
            }
          }
          badge.remove();
          localStorage.removeItem("leafcut-notice");
          delete document.hidden;
          return told;
        }""",
        states,
    )
    assert told == ["over", "over", "failed", "cancelled", "interrupted"]
