"""The solid view in headless Chromium without a GPU: frames a second at 512 × 512 cells, and how fast it is cut.

    python benchmarks/solid_view.py [--moves 100000] [--renderer columns|gpu] [--write docs/benchmarks.md]

A relief of so many moves of a ball mill over a square of 512 × 512 cells, made by formula. It is checked that the
browser gets the heights that Python gets.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from page import facts, table, write_section

from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.stock.solid import solid_of
from leafcut.studio.drawing.scene import toolpath_scene
from leafcut.studio.drawing.solid import solid_scene

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "studio"))
from canvas_scenes import MACHINE
from canvas_server import browser, serving, until

SIDE = 100.0
STOCK = ShownStock({1: Tool(1, 6.0, ToolKind.BALL_MILL)}, block=((0.0, 0.0, -12.0), (SIDE, SIDE, 0.0)))

#: Turns the view in every frame and returns the time of every frame, ms.
TURNED = """async (frames) => {
  const times = [], { solid } = drawing;
  let last = performance.now();
  for (let k = 0; k < frames; k++) {
    solid.camera.orbit(k % 60 < 30 ? 4 : -4, k % 20 < 10 ? 1 : -1);
    solid.wake();
    const now = await new Promise(requestAnimationFrame);
    times.push(now - last);
    last = now;
  }
  return times;
}"""
#: The same while it is played.
PLAYED = """async (frames) => {
  const times = [];
  drawing.seek(0.1 * drawing.player.duration);
  drawing.play(20);
  let last = performance.now();
  for (let k = 0; k < frames; k++) {
    const now = await new Promise(requestAnimationFrame);
    times.push(now - last);
    last = now;
  }
  drawing.pause();
  return times;
}"""


def relief(moves: int) -> Toolpath:
    """Return waves, carved in lines along x."""
    path = ToolpathBuilder()
    path.tool(1)
    path.rapid(0.0, 0.0, 5.0)
    lines = max(round(math.sqrt(moves / 2.0)), 1)
    along = max(moves // lines, 1)
    for row in range(lines):
        y = SIDE * row / lines
        for k in range(along):
            x = SIDE * (k if row % 2 == 0 else along - 1 - k) / max(along - 1, 1)
            path.feed(x, y, -5.0 + 3.0 * math.sin(x / 8.0) * math.cos(y / 10.0), feed=30.0, line=row * along + k + 1)
    return path.build()


def told(times: Sequence[float]) -> str:
    """Return frames a second of times in ms, and how long the slow ones take."""
    kept = sorted(times[5:])
    return f"{1000 / statistics.fmean(kept):.0f} frames a second, 95 % within {kept[int(0.95 * len(kept))]:.0f} ms"


def measured(path: Toolpath, chromium: str, renderer: str) -> list[tuple[str, str]]:
    """Return what the browser does with the stock: what, and the figure."""
    begin = time.perf_counter()
    scene = solid_scene(path, MACHINE, STOCK)
    rows = [("scene of the stock", f"{time.perf_counter() - begin:.2f} s, {len(scene) / 1e6:.1f} MB")]
    expected = solid_of(path, STOCK).after.heights
    scenes = {"bench.after": toolpath_scene(path, MACHINE, name="bench"), "bench.solid_after": scene}
    with serving(scenes) as address, browser(chromium) as launched:
        page = launched.new_page(viewport={"width": 1400, "height": 900})
        page.goto(f"{address}?renderer={renderer}")
        until(page, "window.loaded")
        page.evaluate("load('bench', ['after', 'solid_after'])")
        begin = time.perf_counter()
        page.evaluate("drawing.setSpace('solid')")
        until(page, "drawing.solid.ready")
        rows.append(("cut from the first move to the last", f"{time.perf_counter() - begin:.2f} s"))
        heights = np.array(page.evaluate("[...drawing.solid.stock.heights]"), dtype=np.float32)
        assert heights.shape == (512 * 512,)
        assert np.abs(heights - expected.ravel()).max() < 1e-5
        times = page.evaluate(TURNED, 150)
        finer = page.evaluate("[drawing.solid.picture.width, drawing.solid.over.width, drawing.solid.quality]")
        assert finer[0] >= 0.4 * finer[1]
        rows.append(("turned", f"{told(times)}, {finer[2]:.2f} drawn for a pixel of the screen"))
        for share in (0.5, 0.95, 0.2):
            begin = time.perf_counter()
            page.evaluate("(share) => drawing.seek(share * drawing.player.duration)", share)
            until(page, "drawing.solid.ready")
            rows.append((f"gone to {share:.0%} of the time", f"{time.perf_counter() - begin:.2f} s"))
        rows.append(("played, 20×", told(page.evaluate(PLAYED, 150))))
        assert page.evaluate("drawing.solid.renderer.name") == (renderer or "columns")
    return rows


def main(arguments: Sequence[str]) -> None:
    """Make the relief, and measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moves", type=int, default=100_000)
    parser.add_argument("--renderer", default="", choices=("", "columns", "gpu"))
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="the page whose section on this is written")
    given = parser.parse_args(arguments)
    rows = measured(relief(given.moves), given.chromium, given.renderer)
    print("\n".join(f"{what}: {figure}" for what, figure in rows))
    if given.write:
        about = f"""## The solid view of the studio

A relief of {given.moves:,} moves of a ball mill on 512 × 512 cells in headless Chromium without a GPU, 1400 × 900
pixels; the heights of all cells are compared with Python's.

{table(("note", "figure"), rows)}

{facts("solid_view", arguments, ("numpy", "playwright"))}
"""
        write_section(given.write, "solid-view", about)


if __name__ == "__main__":
    main(sys.argv[1:])
