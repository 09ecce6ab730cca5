"""Create drilling programs with the hole orders of other CAM programs, for the lab experiment `cam_orders`.

    python -m benchmarks cam_orders              writes src/leafcut/lab/parts/cam_orders/CAM/PLATE.nc

The three CAM programs order the holes of each drill:

* FreeCAD: its drilling operation, run by `freecadcmd`.
* pcb2gcode: nearest neighbour and 2-opt, implemented here.
* dxf2gcode: a genetic algorithm, implemented here; its result depends on chance, so the order for seed 1 is stored.

All programs have the same tools, heights, feeds and cycle, so they differ only in the order of the holes.
"""

from __future__ import annotations

import csv
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

from benchmarks import ROOT, page

PARTS = ROOT / "src" / "leafcut" / "lab" / "parts"
PLATES, PROGRAMS = PARTS / "plates", PARTS / "cam_orders"

#: Spindle speed, rpm, and feed, mm/min, by drill diameter, mm, as `leafcut drill` assumes for mild steel.
CUTTING = {3.175: (2005, 127.3), 6.35: (1003, 127.4)}
#: Thickness of the plates, clearance height, and height of the retract plane, mm.
THICKNESS, CLEARANCE, RETRACT = 6.35, 10.0, 2.0
#: Length of the tip of a 118° drill relative to its diameter, and distance drilled below the plate, mm.
TIP, BELOW = 0.5 / math.tan(math.radians(59.0)), 0.5
#: Minimum gain of a 2-opt move, mm; smaller gains are rounding errors.
LEAST_GAIN = 1e-9
#: Position before the first hole.
ORIGIN = (0.0, 0.0)
#: Defaults of dxf2gcode: maximum population, maximum number of generations, and share of mutations that reverse a
#: section.
MOST_TOURS, MOST_GENERATIONS, REVERSALS = 20, 6, 0.75

Point = tuple[float, float]
#: Function that returns the holes of one drill in the order of a CAM program.
HoleOrder = Callable[[Sequence[Point]], list[Point]]


def pcb2gcode_order(holes: Sequence[Point]) -> list[Point]:
    """Return the holes in the order of pcb2gcode, which starts at the origin and may end at any hole.

    Lengths are Chebyshev distances. The nearest-neighbour order replaces the given order if it is shorter. Then
    repeated sweeps over all sections reverse each section whose reversal shortens the path, until a sweep finds none.

    Source: pcb2gcode, tsp_solver.hpp, with its default options. Differs: `LEAST_GAIN`.
    """
    order = min(list(holes), _nearest_neighbour(holes, ORIGIN, _chebyshev), key=_open_length)
    improved = True
    while improved:
        improved = False
        for first in range(len(order)):
            for last in range(first + 1, len(order)):
                before = order[first - 1] if first else ORIGIN
                gain = _chebyshev(before, order[first]) - _chebyshev(before, order[last])
                if last + 1 < len(order):
                    gain += _chebyshev(order[last], order[last + 1]) - _chebyshev(order[first], order[last + 1])
                if gain > LEAST_GAIN:
                    order[first : last + 1] = order[first : last + 1][::-1]
                    improved = True
    return order


def dxf2gcode_order(holes: Sequence[Point], seed: int = 1) -> list[Point]:
    """Return the holes in the order of dxf2gcode: the shortest tour through the origin that a genetic algorithm finds.

    The first tours are nearest-neighbour tours from random starts. In each generation, pairs compete twice. The winners
    of the second round survive, and each pair of winners of the first round has a child. All of these enter the next
    generation, both unchanged and mutated.

    Source: dxf2gcode 20191025, postpro/tspoptimisation.py, with its default options. Differs: its mutation rate of 0.95
    is omitted, because with rounding it applies to all tours of every possible population.
    """
    if len(holes) < 2:
        return list(holes)
    rng, stops = random.Random(seed), [ORIGIN, *holes]
    size = min(8 * math.ceil(len(stops) / 8), MOST_TOURS)
    starts = [rng.randrange(len(stops)) for _ in range(size)]
    tours = [_from_origin(_nearest_neighbour_tour(stops, start)) for start in starts]
    for _ in range(min(MOST_GENERATIONS, len(holes))):
        winners = _winners(tours, stops, rng)
        pairs = rng.sample(winners, len(winners))
        children = [_child(*pair, rng) for pair in zip(pairs[::2], pairs[1::2], strict=True)]
        kept = _winners(winners, stops, rng) + children
        tours = [_from_origin(tour) for tour in (*kept, *(_mutated(tour, rng) for tour in kept))]
    best = min(tours, key=lambda tour: tour_length(tour, stops))
    return [stops[k] for k in best[1:]]


def tour_length(tour: Sequence[int], stops: Sequence[Point]) -> float:
    """Return the length of a closed tour."""
    return math.fsum(math.dist(stops[a], stops[b]) for a, b in pairwise([*tour, tour[0]]))


def _from_origin(tour: list[int]) -> list[int]:
    start = tour.index(0)
    return tour[start:] + tour[:start]


def _winners(tours: Sequence[list[int]], stops: Sequence[Point], rng: random.Random) -> list[list[int]]:
    """Return the shorter tour of each pair in a random pairing of the tours."""
    drawn = rng.sample(list(tours), len(tours))
    return [min(pair, key=lambda tour: tour_length(tour, stops)) for pair in zip(drawn[::2], drawn[1::2], strict=False)]


def _section(length: int, rng: random.Random) -> tuple[int, int]:
    first, last = sorted(rng.sample(range(length), 2))
    return first, last


def _child(mother: list[int], father: list[int], rng: random.Random) -> list[int]:
    """Return the tour of `father` with a random section of `mother` inserted at a random position."""
    first, last = _section(len(mother), rng)
    section = mother[first : last + 1]
    rest = [stop for stop in father if stop not in section]
    position = rng.randrange(len(mother))
    return rest[:position] + section + rest[position:]


def _mutated(tour: list[int], rng: random.Random) -> list[int]:
    """Return the tour with a random section reversed, or with two of its stops swapped."""
    changed = list(tour)
    first, last = _section(len(tour), rng)
    if rng.random() < REVERSALS:
        changed[first : last + 1] = changed[first : last + 1][::-1]
    else:
        changed[first], changed[last] = changed[last], changed[first]
    return changed


def _chebyshev(a: Point, b: Point) -> float:
    return max(abs(a[0] - b[0]), abs(a[1] - b[1]))


def _open_length(path: Sequence[Point]) -> float:
    return math.fsum(_chebyshev(a, b) for a, b in pairwise([ORIGIN, *path]))


def _nearest_neighbour(holes: Sequence[Point], start: Point, distance: Callable[[Point, Point], float]) -> list[Point]:
    left, order = list(holes), [start]
    while left:
        order.append(left.pop(min(range(len(left)), key=lambda k: distance(order[-1], left[k]))))
    return order[1:]


def _nearest_neighbour_tour(stops: Sequence[Point], start: int) -> list[int]:
    left, tour = [k for k in range(len(stops)) if k != start], [start]
    while left:
        tour.append(left.pop(min(range(len(left)), key=lambda k: math.dist(stops[tour[-1]], stops[left[k]]))))
    return tour


def freecad_order(holes: Sequence[Point], freecadcmd: str = "freecadcmd") -> list[Point]:
    """Return the holes in the order of FreeCAD's drilling operation.

    Raises
    ------
    RuntimeError
        FreeCAD failed, or its operation does not drill these holes.
    """
    with tempfile.TemporaryDirectory() as folder:
        given, answer = Path(folder, "holes.csv"), Path(folder, "order.csv")
        given.write_text("".join(f"{x!r},{y!r}\n" for x, y in holes), encoding="utf-8")
        environment = os.environ | {"HOLES": str(given), "ORDER": str(answer), "HOME": folder}
        done = subprocess.run(
            [freecadcmd, str(Path(__file__).with_name("freecad_drilling.py"))],
            env=environment, cwd=folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            raise RuntimeError(f"FreeCAD failed: {done.stderr.strip().splitlines()[-1:]}")
        with answer.open(encoding="utf-8", newline="") as file:
            drilled = [(float(x), float(y)) for x, y in csv.reader(file)]
    order = [min(holes, key=lambda hole: math.dist(hole, place)) for place in drilled]
    if sorted(order) != sorted(holes):
        raise RuntimeError(f"FreeCAD drills {len(set(order))} of {len(holes)} holes")
    return order


#: Ordering function of each CAM program, by the name of its folder.
ORDERS: dict[str, HoleOrder] = {
    "freecad": freecad_order, "pcb2gcode": pcb2gcode_order, "dxf2gcode": dxf2gcode_order,
}  # fmt: skip


def holes_of(plate: Path) -> dict[float, list[Point]]:
    """Return the holes of a plate by diameter, mm, smallest diameter first."""
    holes: dict[float, list[Point]] = {}
    with plate.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            holes.setdefault(float(row["diameter"]), []).append((float(row["x"]), float(row["y"])))
    return dict(sorted(holes.items()))


def program(comment: str, holes: dict[float, list[Point]]) -> str:
    """Return the drilling program for holes in this order, by diameter."""
    lines = ["%", "O0001", f"({comment})", "G21", "G17 G90 G40 G49 G80", "G94 G54", "G53 G0 Z0."]
    for tool, (diameter, order) in enumerate(holes.items(), 1):
        speed, feed = CUTTING[diameter]
        depth = THICKNESS + BELOW + TIP * diameter
        (x, y), *rest = order
        lines += [f"(T{tool} drill D{diameter:g})", f"T{tool} M6", f"S{speed} M3", f"G0 X{x:.4f} Y{y:.4f}"]
        lines += [f"G43 H{tool} Z{CLEARANCE:.1f}"]
        lines += [f"G98 G81 X{x:.4f} Y{y:.4f} Z-{depth:.3f} R{RETRACT:.1f} F{feed:.1f}"]
        lines += [*(f"X{x:.4f} Y{y:.4f}" for x, y in rest), "G80", "G53 G0 Z0.", "M5"]
    return "\n".join([*lines, "M30", "%", ""])


def main(argv: Sequence[str]) -> int:
    """Write the programs of the plates."""
    parser = page.parser("cam_orders", __doc__, writes=False)
    parser.add_argument("cams", nargs="*", default=list(ORDERS), type=page.one_of(ORDERS), metavar="CAM")
    given = parser.parse_args(argv)
    if "freecad" in given.cams and shutil.which("freecadcmd") is None:
        print("freecadcmd is missing: install FreeCAD, or name the other CAM programs", file=sys.stderr)
        return 2
    for cam in given.cams:
        folder = PROGRAMS / cam
        folder.mkdir(parents=True, exist_ok=True)
        for plate in sorted(PLATES.glob("*.csv")):
            order = {diameter: ORDERS[cam](holes) for diameter, holes in holes_of(plate).items()}
            (folder / f"{plate.stem}.nc").write_text(
                program(f"{plate.stem} in the order of {cam}", order), encoding="ascii"
            )
    return 0
