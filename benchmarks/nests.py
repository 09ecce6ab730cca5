"""Ten nests of 18 to 120 parts, made by leafcut from parts of its own design: what sheet cutting is measured on.

    python benchmarks/nests.py nests            writes nests/nest_018.dxf … nests/nest_120.dxf

Brackets, flanges, rings, gussets, base plates with holes, slotted strips and marked levers, in sizes drawn by chance
from a fixed seed. Always the same drawings on one kind of machine: the nester is ended by a number of steps, not by the
clock.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Nest, NestPart
from leafcut.options import SolveOptions
from leafcut.processes.nesting.options import NestOptions
from leafcut.processes.nesting.post import write_layout
from leafcut.processes.nesting.run import nest

#: Parts of each nest.
SIZES = (18, 24, 30, 38, 46, 56, 68, 82, 100, 120)
#: Kinds of part in a nest of n: about one for six parts.
PARTS_PER_KIND = 6
#: Bulge of a quarter circle.
QUARTER = math.tan(math.pi / 8)
QUARTER_TURNS = tuple(0.5 * math.pi * k for k in range(4))


def rounded(corners: Sequence[tuple[float, float]], radius: float) -> Polyline:
    """Return the closed polyline through corners, counter-clockwise, each rounded by an arc where it turns left."""
    rows = []
    count = len(corners)
    for i, (x, y) in enumerate(corners):
        before, after = np.subtract(corners[i - 1], (x, y)), np.subtract(corners[(i + 1) % count], (x, y))
        ux, uy = before / np.hypot(*before), after / np.hypot(*after)
        turn = math.pi - math.acos(float(np.clip(ux @ uy, -1.0, 1.0)))
        if radius <= 0.0 or after[0] * before[1] - after[1] * before[0] <= 0.0:
            rows.append((x, y, 0.0))
            continue
        cut = radius * math.tan(0.5 * turn)
        rows += [(x + cut * ux[0], y + cut * ux[1], math.tan(0.25 * turn)), (x + cut * uy[0], y + cut * uy[1], 0.0)]
    return Polyline(np.array(rows), closed=True)


def circle_of_holes(n: int, radius: float, hole: float) -> list[Polyline]:
    """Return n holes on a circle about the origin."""
    angles = [math.tau * k / n for k in range(n)]
    return [Polyline.circle(radius * math.cos(a), radius * math.sin(a), hole, clockwise=True) for a in angles]


def bracket(size: float) -> list[Polyline]:
    """Return an angle with two holes in either leg."""
    leg = 0.3 * size
    corners = [(0.0, 0.0), (size, 0.0), (size, leg), (leg, leg), (leg, size), (0.0, size)]
    middle, hole = 0.5 * leg, 0.06 * size
    places = [(0.55 * size, middle), (0.85 * size, middle), (middle, 0.55 * size), (middle, 0.85 * size)]
    return [rounded(corners, 0.06 * size), *(Polyline.circle(x, y, hole) for x, y in places)]


def flange(size: float) -> list[Polyline]:
    """Return a round flange with a bore and bolt holes."""
    radius = 0.5 * size
    return [
        Polyline.circle(0.0, 0.0, radius),
        Polyline.circle(0.0, 0.0, 0.45 * radius),
        *circle_of_holes(6, 0.74 * radius, 0.08 * radius),
    ]


def ring(size: float) -> list[Polyline]:
    """Return a thin ring: other parts may lie in it."""
    return [Polyline.circle(0.0, 0.0, 0.5 * size), Polyline.circle(0.0, 0.0, 0.39 * size)]


def gusset(size: float) -> list[Polyline]:
    """Return a triangle with its corners cut off and a hole."""
    corners = [(0.12 * size, 0.0), (size, 0.0), (size, 0.1 * size), (0.1 * size, 0.9 * size), (0.0, 0.9 * size)]
    return [rounded([*corners, (0.0, 0.12 * size)], 0.0), Polyline.circle(0.3 * size, 0.3 * size, 0.08 * size)]


def base_plate(size: float) -> list[Polyline]:
    """Return a plate with rounded corners, four holes and a window."""
    width, height = size, 0.7 * size
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    places = [(x, y) for x in (0.1 * size, width - 0.1 * size) for y in (0.1 * size, height - 0.1 * size)]
    window = [
        (0.3 * size, 0.25 * size),
        (0.7 * size, 0.25 * size),
        (0.7 * size, 0.45 * size),
        (0.3 * size, 0.45 * size),
    ]
    holes = [Polyline.circle(x, y, 0.045 * size) for x, y in places]
    return [rounded(corners, 0.08 * size), rounded(window, 0.04 * size), *holes]


def slotted_strip(size: float) -> list[Polyline]:
    """Return a strip with round ends and two slots."""
    half, end = 0.09 * size, 0.5 * size
    outline = [(-end, -half, 0.0), (end, -half, 1.0), (end, half, 0.0), (-end, half, 1.0)]
    found = [Polyline(np.array(outline), closed=True)]
    for middle in (-0.27 * size, 0.27 * size):
        low, high, r = middle - 0.12 * size, middle + 0.12 * size, 0.035 * size
        found.append(Polyline(np.array([(low, -r, 0.0), (high, -r, 1.0), (high, r, 0.0), (low, r, 1.0)]), closed=True))
    return found


def lever(size: float) -> list[Polyline]:
    """Return a lever with a large and a small eye, joined by tangents."""
    big, small, length = 0.22 * size, 0.12 * size, 0.66 * size
    lean = math.asin((big - small) / length)
    cos, sin = math.cos(lean), math.sin(lean)
    right = math.tan(0.25 * (math.pi - 2.0 * lean))
    left = math.tan(0.25 * (math.pi + 2.0 * lean))
    points = [
        (big * sin, -big * cos, 0.0),
        (length + small * sin, -small * cos, right),
        (length + small * sin, small * cos, 0.0),
        (big * sin, big * cos, left),
    ]
    outline = Polyline(np.array(points), closed=True)
    return [outline, Polyline.circle(0.0, 0.0, 0.5 * big), Polyline.circle(length, 0.0, 0.5 * small)]


DESIGNS = {
    "bracket": (bracket, 120, 320),
    "flange": (flange, 110, 300),
    "ring": (ring, 160, 360),
    "gusset": (gusset, 90, 260),
    "base_plate": (base_plate, 140, 420),
    "slotted_strip": (slotted_strip, 160, 480),
    "lever": (lever, 160, 400),
}


def part(design: str, size: float, quantity: int = 1) -> NestPart:
    """Return a part of a design; levers carry a mark along their middle."""
    paths = DESIGNS[design][0](size)
    contours = [Contour(path) for path in paths]
    if design == "lever":
        contours.append(Contour(Polyline.of_points([(0.2 * size, 0.0), (0.4 * size, 0.0)]), "mark"))
    return NestPart(f"{design}_{size:g}", tuple(contours), quantity, QUARTER_TURNS)


def lot(n_parts: int) -> list[NestPart]:
    """Return n parts of some kinds in sizes drawn by chance, always the same for a number."""
    chance = random.Random(n_parts)
    kinds = max(3, n_parts // PARTS_PER_KIND)
    names = [list(DESIGNS)[k % len(DESIGNS)] for k in range(kinds)]
    sizes = [5.0 * chance.randint(DESIGNS[name][1] // 5, DESIGNS[name][2] // 5) for name in names]
    counts = [n_parts // kinds + (k < n_parts % kinds) for k in range(kinds)]
    return [part(*each) for each in zip(names, sizes, counts, strict=True)]


def make(n_parts: int) -> Nest:
    """Return the nest of a lot on one sheet 1500 mm wide, as long as it needs."""
    parts = lot(n_parts)
    area = sum(one.area * one.quantity for one in parts)
    length = math.ceil(area / 1500.0 / 0.55 / 100.0 + 5.0) * 100
    options = NestOptions(sheet=f"{length}x1500", kerf=2.0, gap=10.0, variants=1)  # type: ignore[arg-type]
    return nest(parts, options, SolveOptions(preset="fast", bound=False)).nests[0]


def plates(rows: int, columns: int, kerf: float, gap: float) -> Nest:
    """Return a nest of plates of 150 × 100 mm with a hole, in rows and columns `gap` mm and a kerf apart."""
    outline = Polyline.of_points([(0, 0), (150, 0), (150, 100), (0, 100)], closed=True)
    plate = NestPart("plate", (Contour(outline), Contour(Polyline.circle(50, 50, 20, clockwise=True))), rows * columns)
    sheet = f"{math.ceil(40 + columns * (150 + kerf + gap))}x{math.ceil(40 + rows * (100 + kerf + gap))}"
    options = NestOptions(sheet=sheet, kerf=kerf, gap=gap, margin=20.0, nester="rectangles", variants=1)
    return nest([plate], options, SolveOptions(preset="fast", bound=False)).nests[0]


def main(arguments: Sequence[str]) -> None:
    """Write the ten nests into a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--sizes", default=",".join(str(n) for n in SIZES), help="numbers of parts")
    given = parser.parse_args(arguments)
    given.folder.mkdir(parents=True, exist_ok=True)
    for size in (int(word) for word in given.sizes.split(",")):
        began = time.perf_counter()
        found = make(size)
        if len(found.layouts) != 1 or found.n_placed != size:
            sys.exit(f"{size} parts: {found.n_placed} on {found.n_sheets} sheets")
        (given.folder / f"nest_{size:03d}.dxf").write_text(write_layout(found, found.layouts[0]), encoding="utf-8")
        stock = found.stock_of(found.layouts[0])
        contours = sum(1 for _ in found.contours(found.layouts[0]))
        print(
            f"{size:4d} parts, {contours} contours, {stock.length:g} × {stock.width:g} mm, "
            f"{100 * found.utilisation_of_used:.1f} % of {found.used_length:.0f} mm, {found.method}, "
            f"{time.perf_counter() - began:.1f} s"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
