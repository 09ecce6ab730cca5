"""Programs for the comparison of machine times: small generators, and real files from the shared data."""

from __future__ import annotations

import math
import random
import re
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import ROOT, data_folder
from leafcut.api import optimize
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, NestPart, Placement, Stock
from leafcut.nesting.post import layout_as_dxf

HEAD = "G21 G90 G17 G40 G49 G80 G94 {mode}\nF600\nG0 Z5\nG0 X0 Y0\n"

#: Real files without stops, within the travel of the simulated machine.
FILES = (
    "camotics_buildbotics.gcode",
    "camotics_scorpion.nc",
    "cncjs_jsdc_laser.gcode",
    "lcnc_bezel.ngc",
    "lcnc_test_12mmflat.ngc",
    "ugs_enclosure_cambam.nc",
)

#: Programs with too many blocks per second for a fast simulation.
SLOW = "3000 segments of 0.05 mm, 5000 mm/min, G64"


def drilling(cycle: str, words: str, count: int, seed: int) -> str:
    """Return a program that drills holes at random positions with one canned cycle."""
    places = random.Random(seed)
    at = [f"X{places.uniform(0, 160):.2f} Y{places.uniform(0, 100):.2f}" for _ in range(count)]
    return f"{HEAD.format(mode='G64')}G99 {cycle} {at[0]} R2 {words} F300\n" + "\n".join(at[1:]) + "\nG80\nG0 Z20\nM2\n"


def pocket(feed: int, mode: str, passes: int = 20) -> str:
    """Return a program that follows a zigzag with a step of 2 mm."""
    cuts = [f"G1 Y{2 * i} F{feed}\nG1 X{60 if i % 2 == 0 else 0}" for i in range(passes)]
    return HEAD.format(mode=mode) + "G1 Z-1 F300\n" + "\n".join(cuts) + "\nG0 Z20\nM2\n"


def arcs(feed: int, mode: str, count: int = 30) -> str:
    """Return a program of tangent half circles with a radius of 2 to 30 mm, alternately G2 and G3."""
    lines, x, up = ["G1 Z-1 F300"], 0.0, True
    for i in range(count):
        radius = 2 + (i * 7) % 29
        x += 2 * radius
        lines.append(f"{'G2' if up else 'G3'} X{x:.3f} Y0 I{radius} J0 F{feed}")
        up = not up
    return HEAD.format(mode=mode) + "\n".join(lines) + "\nG0 Z20\nM2\n"


def segments(feed: int, mode: str, count: int = 1500, length: float = 0.3) -> str:
    """Return a program that follows a wavy line of many short segments."""
    lines, x, y = ["G1 Z-1 F300"], 0.0, 0.0
    for i in range(count):
        angle = 1.2 * math.sin(i / 60.0)
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
        lines.append(f"G1 X{x:.4f} Y{y:.4f}" + (f" F{feed}" if i == 0 else ""))
    return HEAD.format(mode=mode) + "\n".join(lines) + "\nG0 Z20\nM2\n"


def spiral(feed: int, mode: str, turns: int = 12, step: float = 3.0) -> str:
    """Return a program that follows an outward spiral of half circles."""
    lines, x, side = ["G1 Z-1 F300"], 0.0, 1
    for i in range(2 * turns):
        across = step * (i + 1)
        x += side * across
        lines.append(f"G3 X{x:.4f} Y0 I{side * across / 2:.4f} J0 F{feed}")
        side = -side
    return HEAD.format(mode=mode) + "\n".join(lines) + "\nG0 Z20\nM2\n"


def sheet(mode: str, count: int = 12) -> str:
    """Return a program for plasma parts: pierce, lead-in, and rectangle with round corners, with torch on and off for
    each.
    """
    lines = []
    for i in range(count):
        x, y = 70 * (i % 4), 60 * (i // 4)
        lines.append(
            f"G0 X{x - 5} Y{y + 10}\nG0 Z1.5\nM3 S1\nG4 P0.6\nG1 X{x} Y{y + 10} F2400\nG1 Y{y + 40}\n"
            f"G2 X{x + 10} Y{y + 50} I10 J0\nG1 X{x + 50}\nG2 X{x + 60} Y{y + 40} I0 J-10\nG1 Y{y + 5}\nG1 X{x}\n"
            f"G1 Y{y + 12}\nM5\nG0 Z20"
        )
    return HEAD.format(mode=mode) + "\n".join(lines) + "\nM2\n"


def contour(feed: int, mode: str, layers: int = 4) -> str:
    """Return a program for a slot with round ends in layers, with tangent arcs as lead-in and lead-out."""
    lines = [
        f"G0 X50 Y-8\nG0 Z1\nG1 Z{-1 - layer} F200\nG3 X58 Y0 I0 J8 F{feed}\nG1 X100\nG3 X100 Y30 I0 J15\nG1 X20\n"
        "G3 X20 Y0 I0 J-15\nG1 X58\nG3 X66 Y8 I0 J8\nG0 Z5"
        for layer in range(layers)
    ]
    return HEAD.format(mode=mode) + "\n".join(lines) + "\nM2\n"


def polygon(feed: int, mode: str, corners: int = 24, rounds: int = 3) -> str:
    """Return a program of rounds along a regular polygon, with corners of 15 degrees."""
    at = [(40 * math.cos(math.tau * i / corners), 40 * math.sin(math.tau * i / corners)) for i in range(corners)]
    lines = [f"G1 X{x:.4f} Y{y:.4f} F{feed}" for _ in range(rounds) for x, y in at]
    return HEAD.format(mode=mode) + "G0 X40 Y0\nG1 Z-1 F300\n" + "\n".join(lines) + "\nG0 Z20\nM2\n"


def helix(feed: int, mode: str, holes: int = 10) -> str:
    """Return a program for holes milled by helices; the first turn of each helix is the steepest."""
    lines = []
    for i in range(holes):
        turns = [f"G3 X{20 * i + 4} Y0 I-4 J0 Z{-0.5 * k:.2f} F{feed}" for k in range(8)]
        lines.append("\n".join([f"G0 X{20 * i + 4} Y0\nG0 Z1", *turns, "G0 Z5"]))
    return HEAD.format(mode=mode) + "\n".join(lines) + "\nM2\n"


def corners(feed: int, mode: str, count: int = 60, seed: int = 3) -> str:
    """Return a program of lines and arcs that meet at random angles."""
    chance = random.Random(seed)
    lines, x, y = [], 0.0, 0.0
    for _ in range(count):
        dx, dy = chance.uniform(-15, 15), chance.uniform(-15, 15)
        x, y = x + dx, y + dy
        radius = 0.5 * math.hypot(dx, dy) * chance.uniform(1.05, 3.0)
        word = chance.choice(("G1", "G1", "G2", "G3"))
        lines.append(f"{word} X{x:.4f} Y{y:.4f}" + (f" R{radius:.4f}" if word != "G1" else "") + f" F{feed}")
    return HEAD.format(mode=mode) + "G1 Z-1 F300\n" + "\n".join(lines) + "\nG0 Z20\nM2\n"


def relief(feed: int, mode: str, lines: int = 8) -> str:
    """Return a program for an engraved relief: rows of 0.5 mm segments that rise and fall."""
    out = []
    for row in range(lines):
        xs = [0.5 * i for i in range(121)]
        for x in xs if row % 2 == 0 else reversed(xs):
            z = -1 + 0.8 * math.sin(x / 4.0 + row / 3.0)
            out.append(f"G1 X{x:.3f} Y{row * 0.6:.3f} Z{z:.4f} F{feed}")
    return HEAD.format(mode=mode) + "\n".join(out) + "\nG0 Z20\nM2\n"


#: Profile of the simulated machine.
PROFILE = ROOT / "src" / "leafcut" / "machines" / "linuxcnc-sim.toml"
#: A nest of 18 parts with arcs, holes, slots and windows.
NEST = ROOT / "src" / "leafcut" / "lab" / "parts" / "nests" / "nest_018.dxf"


def perforated(thickness: float, columns: int = 4, rows: int = 3, holes: int = 9) -> str:
    """Return leafcut's program for plates in a grid, each with rows of small holes of four sizes."""
    outline = rounded_rectangle(120.0, 90.0, 6.0)
    places = [(20.0 + 40.0 * (k % 3), 15.0 + 30.0 * (k // 3), 3.0 + k % 4) for k in range(holes)]
    paths = [outline, *(Polyline.circle(*place) for place in places)]
    plate = NestPart("plate", tuple(Contour(path) for path in paths), columns * rows)
    placements = [Placement(0, 0.0, 15.0 + 140.0 * i, 15.0 + 110.0 * j) for j in range(rows) for i in range(columns)]
    length, sheet_width = 10.0 + 140.0 * columns, 10.0 + 110.0 * rows
    nest = Nest((plate,), (Stock(length, sheet_width),), (Layout(tuple(placements)),), (0,))
    return cut_program(layout_as_dxf(nest, nest.layouts[0]), thickness)


def rounded_rectangle(width: float, height: float, radius: float) -> Polyline:
    """Return a counter-clockwise rectangle with round corners."""
    quarter, r = math.tan(math.pi / 8.0), radius
    points = [
        (r, 0.0, 0.0), (width - r, 0.0, quarter), (width, r, 0.0), (width, height - r, quarter),
        (width - r, height, 0.0), (r, height, quarter), (0.0, height - r, 0.0), (0.0, r, quarter),
    ]  # fmt: skip
    return Polyline(np.array(points), closed=True)


def cut_program(drawing: str, thickness: float) -> str:
    """Return the program that `leafcut cut` writes for a drawing (DXF) on a plasma table with a Z axis."""
    with tempfile.TemporaryDirectory() as folder:
        file, table = Path(folder) / "sheet.dxf", Path(folder) / "table.toml"
        file.write_text(drawing, encoding="utf-8")
        profile = PROFILE.read_text(encoding="utf-8")
        table.write_text(profile.replace('process = "spindle"', 'process = "torch"'), encoding="utf-8")
        return optimize(
            file,
            process="cut",
            machine=str(table),
            dialect="plasma",
            thickness=thickness,
            ignore_layers="MARK*",
            preset="fast",
            bound=False,
        ).text


def programs() -> dict[str, Callable[[], str]]:
    """Return functions that create the programs, by name."""
    found: dict[str, Callable[[], str]] = {
        "100 holes, G81": partial(drilling, "G81", "Z-5", 100, 1),
        "40 holes, G83 Q1.5": partial(drilling, "G83", "Z-8 Q1.5", 40, 2),
        "40 holes, G73 Q1.5": partial(drilling, "G73", "Z-8 Q1.5", 40, 3),
        "40 holes, G82 P0.2": partial(drilling, "G82", "Z-3 P0.2", 40, 4),
    }
    for mode in ("G61", "G64 P0.02", "G64"):
        for feed in (1200, 3000):
            found[f"zigzag pocket, {feed} mm/min, {mode}"] = partial(pocket, feed, mode)
        for name, write, feed in (
            ("half circles", arcs, 1500),
            ("1500 short segments", segments, 3000),
            ("spiral of half circles", spiral, 2400),
            ("slot contours", contour, 3000),
            ("polygon of 24 corners", polygon, 3000),
            ("relief", relief, 1800),
            ("random corners, lines and arcs", corners, 3000),
            ("helices", helix, 3000),
        ):
            found[f"{name}, {feed} mm/min, {mode}"] = partial(write, feed, mode)
        found[f"12 plasma parts, {mode}"] = partial(sheet, mode)
    found[SLOW] = partial(segments, 5000, "G64", 3000, 0.05)
    if data_folder().is_dir():
        found.update({name: partial(real_program, name) for name in FILES})
    return found


def sheets() -> dict[str, Callable[[], str]]:
    """Return functions that create leafcut's programs for sheets of mild steel, by name."""
    return {
        "nest of 18 parts with arcs, holes and slots, 2 mm": lambda: cut_program(NEST.read_text(encoding="utf-8"), 2.0),
        "12 plates with 108 small holes, 2 mm": partial(perforated, 2.0),
    }


def milled(text: str, **options: Any) -> str:
    """Return leafcut's program for a pocket (well-known text) on the simulated machine."""
    with tempfile.TemporaryDirectory() as folder:
        drawing = Path(folder) / "pocket.wkt"
        drawing.write_text(text, encoding="utf-8")
        return optimize(
            drawing,
            machine="linuxcnc-sim",
            tool_diameter=10,
            feed="1200mm/min",
            spindle_speed=6000,
            preset="fast",
            **options,
        ).text


def pockets() -> dict[str, Callable[[], str]]:
    """Return functions that create leafcut's programs for pockets with a 10 mm mill, by name."""
    import shapely

    plate = shapely.box(12, 12, 108, 68).buffer(12, quad_segs=64)
    plate -= shapely.Point(40, 40).buffer(10, quad_segs=64).union(shapely.box(72, 30, 92, 50))
    disc = shapely.Point(40, 40).buffer(35, quad_segs=64)
    return {
        "pocket with two islands, two levels, ramps": partial(milled, plate.wkt, depth=4, step_down=2),
        "the same by zigzag": partial(milled, plate.wkt, depth=2, strategy="zigzag"),
        "round pocket, a helix, walls finished": partial(milled, disc.wkt, depth=3, entry="helix", stock=0.3),
    }


def real_program(name: str) -> str:
    """Return the text of a real file; if it has neither G61 nor G64, G64 is added as its first line.

    LinuxCNC starts in G64, but a fast simulation may plan the first moves before it sets that mode.
    """
    text = (data_folder() / "gcode" / name).read_text(encoding="utf-8", errors="replace")
    return text if re.search(r"G6[14]", text) else f"G64\n{text}"
