"""The studio's drawing in headless Chromium without a GPU: frames a second at pan and zoom, memory, bytes and seconds.

    python benchmarks/studio.py [--segments 100000] [--chromium /usr/bin/chromium] [--write docs/benchmarks.md]

A program of that many segments is made by chance from a fixed seed: a third rapids, the rest cuts that stay near each
other, arcs among them. It is checked that the browser has as many rows as the toolpath, that their lengths add up to
the same, and that pixels where the path goes have its colour after the last frame. As many holes of a board are shown,
too, which are shades until they are zoomed, and a drawing of as many segments under what is cut of it.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from page import facts, table, write_section

from leafcut.gcode.dialects import dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.machine import Machine
from leafcut.model.part import Hole, Part
from leafcut.model.toolpath import Toolpath
from leafcut.report.playback import playback
from leafcut.studio.drawing.scene import part_scene, toolpath_scene

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "studio"))
from canvas_server import browser, serving, until

MACHINE = Machine(
    name="bench",
    description="a mill of no particular make",
    controller="linuxcnc",
    rapid_velocity=(400.0, 400.0, 400.0),
    acceleration=(1500.0, 1500.0, 1500.0),
    max_feed=100.0,
    travel_min=(0.0, 0.0, -300.0),
    travel_max=(2000.0, 1000.0, 0.0),
)

#: Pans and zooms for a while, and returns the time of every frame in ms.
FRAMES = """async ([act, frames]) => {
  const times = [];
  let last = performance.now();
  for (let k = 0; k < frames; k++) {
    if (act === "pan") drawing.view.pan(k % 40 < 20 ? 9 : -9, 4 * Math.sin(k / 7));
    else drawing.view.zoom(k % 40 < 20 ? 1.07 : 1 / 1.07, 500, 300);
    const now = await new Promise(requestAnimationFrame);
    times.push(now - last);
    last = now;
  }
  return times;
}"""
SUM = """() => {
  let sum = 0;
  for (let row = 0; row < drawing.main.scene.rows; row++) sum += drawing.main.scene.lengthOf(row);
  return sum;
}"""
INK = """() => {
  const pane = drawing.panes[1], { scene } = pane.main, { view } = drawing, { width, height } = pane.canvas;
  const { data } = pane.ctx.getImageData(0, 0, width, height);
  let inked = 0, probed = 0;
  for (let row = 1; row < scene.rows; row += 97) {
    if (!scene.moves(row)) continue;
    const [x, y] = scene.along(row, 0.5);
    const px = Math.round(view.toX(x + scene.origin[0])), py = Math.round(view.toY(y + scene.origin[1]));
    if (px < 60 || py < 10 || px > view.width - 10 || py > view.height - 60) continue;
    probed++;
    if (data[4 * (py * width + px) + 3] > 60) inked++;
  }
  return [inked, probed];
}"""


def program(segments: int) -> str:
    """Return a program of so many segments, one a line."""
    rng = np.random.default_rng(7)
    x, y = 500.0, 400.0
    lines = ["G21 G90 G17", "G0 Z5", "T1 M6", "S9000 M3", f"G0 X{x} Y{y}", "G1 Z-1 F600"]
    for k, (dx, dy, far) in enumerate(rng.normal(0.0, 1.0, (segments, 3)).tolist()):
        reach = 40.0 if k % 3 == 0 else 4.0
        before, (x, y) = (x, y), (min(max(x + reach * dx, 0.0), 1000.0), min(max(y + reach * dy, 0.0), 800.0))
        if k % 3 == 0:
            lines.append(f"G0 X{x:.3f} Y{y:.3f}")
        elif k % 10 == 1 and math.dist((x, y), before) > 0.01:
            lines.append(f"G3 X{x:.3f} Y{y:.3f} R{500.0 + abs(far):.3f} F900")
        else:
            lines.append(f"G1 X{x:.3f} Y{y:.3f} F900")
    return "\n".join([*lines, "G0 Z5", "M2", ""])


def made(path: Toolpath, text: str) -> tuple[bytes, float]:
    """Return the scene and the median of the processor seconds that it takes."""
    seconds = []
    for _ in range(5):
        begin = time.process_time()
        scene = toolpath_scene(path, MACHINE, text=text)
        seconds.append(time.process_time() - begin)
    return scene, statistics.median(seconds)


def board(holes: int) -> bytes:
    """Return a board of 500 × 400 mm with so many holes of four diameters."""
    rng = np.random.default_rng(11)
    places, widths = rng.uniform((0, 0), (500, 400), (holes, 2)).round(3), rng.choice((0.3, 0.6, 0.8, 1.0), holes)
    rows = zip(places.tolist(), widths.tolist(), strict=True)
    return part_scene(Part("board", tuple(Hole(x, y, width) for (x, y), width in rows)))


def outlines(segments: int) -> bytes:
    """Return a drawing of so many segments: outlines of 19 lines and an arc, on four layers."""
    rng = np.random.default_rng(13)
    angles = np.linspace(0.0, 1.9 * math.pi, 20)
    found = []
    for k, (x, y) in enumerate(rng.uniform((0, 0), (1000, 800), (segments // 20, 2)).tolist()):
        radius = rng.uniform(2.0, 6.0, 20)
        points = np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles), np.zeros(20)])
        points[-1, 2] = 0.3
        found.append(Contour(Polyline(points, closed=True), layer=f"layer {k % 4}"))
    return part_scene(Part("outlines", contours=tuple(found)))


def length_of(path: Toolpath) -> float:
    """Return the length of all moves from known places, mm."""
    rows = playback(path, MACHINE)
    steps = np.nan_to_num(np.diff(rows.place, axis=0))
    length = np.sqrt((steps**2).sum(axis=1))
    length[rows.arc_row - 1] = np.hypot(rows.arc[:, 2] * np.abs(rows.arc[:, 4]), steps[rows.arc_row - 1, 2])
    return float(length.sum())


def memory_mb(page: Any) -> float:
    """Return what the page's processes hold, MB: the renderer's resident memory."""
    session = page.context.browser.new_browser_cdp_session()
    ids = [p["id"] for p in session.send("SystemInfo.getProcessInfo")["processInfo"] if p["type"] == "renderer"]
    pages = [int(Path(f"/proc/{pid}/statm").read_text().split()[1]) for pid in ids]
    return max(pages) * 4096 / 1e6


def measured(scene: bytes, rows: int, length: float, chromium: str) -> list[tuple[str, str]]:
    """Return what the browser does with a scene: what, and the figure."""
    with serving({"bench.after": scene}) as address, browser(chromium) as launched:
        page = launched.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address)
        until(page, "window.loaded")
        begin = time.perf_counter()
        page.evaluate("load('bench', ['after'])")
        page.evaluate("settled()")
        shown = time.perf_counter() - begin
        assert page.evaluate("drawing.main.scene.rows") == rows
        assert abs(page.evaluate(SUM) - length) < 1e-4 * length
        lines = [("from the server to the picture", f"{shown:.2f} s")]
        for act in ("pan", "zoom"):
            page.evaluate("drawing.fit()")
            times = sorted(page.evaluate(FRAMES, [act, 120])[5:])
            mean, slow = statistics.fmean(times), times[int(0.95 * len(times))]
            lines.append((act, f"{1000 / mean:.0f} frames a second, 95 % within {slow:.0f} ms"))
        page.evaluate("drawing.fit()")
        page.evaluate("settled()")
        inked, probed = page.evaluate(INK)
        assert probed > 100 and inked >= 0.98 * probed, (inked, probed)
        begin = time.perf_counter()
        page.evaluate("drawing.view.zoom(1.5); settled()")
        lines.append(("the whole picture anew after a zoom", f"{1000 * (time.perf_counter() - begin):.0f} ms"))
        page.evaluate("drawing.fit(); drawing.play(200)")
        times = page.evaluate(FRAMES, ["pan", 60])
        lines.append(("pan while it is played", f"{1000 / statistics.fmean(times):.0f} frames a second"))
        lines.append(("memory of the page", f"{memory_mb(page):.0f} MB"))
    return lines


def moved(scenes: dict[str, bytes], about: str, chromium: str) -> list[tuple[str, str]]:
    """Return how many frames a second a drawing is moved with, as it is fitted and near by."""
    with (
        serving({f"bench.{layer}": scene for layer, scene in scenes.items()}) as address,
        browser(chromium) as launched,
    ):
        page = launched.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address)
        until(page, "window.loaded")
        page.evaluate("(layers) => load('bench', layers)", list(scenes))
        page.evaluate("settled()")
        lines = []
        for act, near in (("pan", ""), ("zoom", ""), ("pan", ", near by")):
            page.evaluate("drawing.fit()")
            if near:
                page.evaluate("drawing.view.zoom(12); settled()")
            times = sorted(page.evaluate(FRAMES, [act, 120])[5:])
            mean, slow = statistics.fmean(times), times[int(0.95 * len(times))]
            words = f"{1000 / mean:.0f} frames a second, 95 % within {slow:.0f} ms"
            lines.append((f"{about}: {act}{near}", words))
        page.evaluate("drawing.fit()")
        begin = time.perf_counter()
        page.evaluate("drawing.view.zoom(1.5); settled()")
        lines.append((f"{about}: anew after a zoom", f"{1000 * (time.perf_counter() - begin):.0f} ms"))
    return lines


def main(arguments: Sequence[str]) -> None:
    """Make the program, the scene, and measure both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=100_000)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="the page whose section on this is written")
    given = parser.parse_args(arguments)
    text = program(given.segments)
    path = interpret_program(text, dialect("linuxcnc")).path
    scene, seconds = made(path, text)
    rows = [("scene of the toolpath, its clock included", f"{seconds:.3f} s of a processor, {len(scene) / 1e6:.1f} MB")]
    rows += measured(scene, len(playback(path, MACHINE).doing), length_of(path), given.chromium)
    count = f"{given.segments:,}"
    rows += moved({"part": board(given.segments)}, f"board of {count} holes", given.chromium)
    sheet = outlines(given.segments)
    rows += moved({"whole": sheet, "part": sheet}, f"drawing of {count} segments", given.chromium)
    print("\n".join(f"{what}: {figure}" for what, figure in rows))
    if given.write:
        about = f"""## The drawing of the studio

A toolpath of {given.segments:,} segments in headless Chromium without a GPU, 1400 × 900 pixels; how many rows there
are, how long they are, and the ink on the screen are checked. While a view moves, the last picture is shown, moved and
scaled, until the next one is drawn.

{table(("note", "figure"), rows)}

{facts("studio", arguments, ("numpy", "playwright"))}
"""
        write_section(given.write, "studio", about)


if __name__ == "__main__":
    main(sys.argv[1:])
