"""Hole orders of CAM programs: rules of their algorithms, and the stored programs."""

from __future__ import annotations

import itertools
import math
import random
import re
from pathlib import Path

import pytest

from benchmarks import cam_orders

ORIGIN, PLATES, PROGRAMS = cam_orders.ORIGIN, cam_orders.PLATES, cam_orders.PROGRAMS
STORED = sorted(PROGRAMS.glob("*/*.nc"))


def points(count: int, seed: int) -> list[cam_orders.Point]:
    rng = random.Random(seed)
    return [(rng.uniform(0, 100), rng.uniform(0, 100)) for _ in range(count)]


def chebyshev(path: list[cam_orders.Point]) -> float:
    """Return the length of a path from the origin, the longer of the distances in X and Y for each move."""
    steps = itertools.pairwise([ORIGIN, *path])
    return sum(max(abs(a - c), abs(b - d)) for (a, b), (c, d) in steps)


def closed(path: list[cam_orders.Point]) -> float:
    """Return the Euclidean length of a tour through the origin."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise([ORIGIN, *path, ORIGIN]))


def drilled(program: Path) -> list[list[cam_orders.Point]]:
    """Return the holes of each tool of a program, in order, read with regular expressions alone."""
    sections = re.findall(r"^G98 G81 (.*?)^G80", program.read_text(encoding="ascii"), re.DOTALL | re.MULTILINE)
    found = [re.findall(r"X(\S+) Y(\S+)", section) for section in sections]
    return [[(float(x), float(y)) for x, y in places] for places in found]


@pytest.mark.parametrize("seed", range(5))
def test_no_reversed_section_shortens_the_order_of_pcb2gcode(seed: int) -> None:
    holes = points(7, seed)
    order = cam_orders.pcb2gcode_order(holes)
    best = min(chebyshev(list(path)) for path in itertools.permutations(holes))
    assert sorted(order) == sorted(holes)
    assert best - 1e-9 <= chebyshev(order) <= chebyshev(holes) + 1e-9
    for first, last in itertools.combinations(range(8), 2):
        changed = order[:first] + order[first:last][::-1] + order[last:]
        assert chebyshev(order) <= chebyshev(changed) + 1e-6


def test_pcb2gcode_keeps_a_given_order_that_is_shorter_than_the_nearest_neighbours() -> None:
    """From the origin the nearest hole is at −1, then 2, then −5: 1 + 3 + 7 = 11. In the given order: 2 + 3 + 4 = 9."""
    given = [(2.0, 0.0), (-1.0, 0.0), (-5.0, 0.0)]
    assert cam_orders.pcb2gcode_order(given) == given


@pytest.mark.parametrize("seed", range(5))
def test_the_tour_of_dxf2gcode_is_no_longer_than_the_longest_of_nearest_neighbours(seed: int) -> None:
    holes = points(6, seed)
    order = cam_orders.dxf2gcode_order(holes, seed)
    stops, neighbours = [ORIGIN, *holes], []
    for start in stops:
        tour, left = [start], [stop for stop in stops if stop != start]
        while left:
            tour.append(min(left, key=lambda stop: math.dist(stop, tour[-1])))
            left.remove(tour[-1])
        neighbours.append(sum(math.dist(a, b) for a, b in itertools.pairwise([*tour, start])))
    best = min(closed(list(path)) for path in itertools.permutations(holes))
    assert sorted(order) == sorted(holes)
    assert best - 1e-9 <= closed(order) <= max(neighbours) + 1e-9
    assert cam_orders.dxf2gcode_order(holes, seed) == order


def test_each_plate_has_a_program_of_each_cam() -> None:
    plates = {plate.stem for plate in PLATES.glob("*.csv")}
    assert len(plates) == 11
    assert {(file.parent.name, file.stem) for file in STORED} == set(itertools.product(cam_orders.ORDERS, plates))


@pytest.mark.parametrize("program", STORED, ids=lambda file: f"{file.parent.name}-{file.stem}")
def test_a_stored_program_drills_the_holes_of_its_plate_once_each(program: Path) -> None:
    lines = (PLATES / f"{program.stem}.csv").read_text(encoding="utf-8").splitlines()[1:]
    rows = [tuple(map(float, line.split(","))) for line in lines]
    by_diameter = [sorted((x, y) for x, y, d in rows if d == diameter) for diameter in sorted({row[2] for row in rows})]
    assert [sorted(holes) for holes in drilled(program)] == by_diameter
    depths = [float(z) for z in re.findall(r"Z-(\S+)", program.read_text(encoding="ascii"))]
    assert len(depths) == len(by_diameter) and min(depths) > 6.35


@pytest.mark.parametrize("program", [file for file in STORED if file.parent.name == "freecad"], ids=lambda f: f.stem)
def test_freecad_drills_next_the_hole_with_the_least_squared_distance_plus_x(program: Path) -> None:
    """The rule of FreeCAD 0.20's `PathUtils.sort_locations` for drilling; its unit is ignored."""
    for holes in drilled(program):
        for k, (here, there) in enumerate(itertools.pairwise([ORIGIN, *holes])):
            weight = {hole: math.dist(here, hole) ** 2 + abs(hole[0]) for hole in holes[k:]}
            assert weight[there] <= min(weight.values()) + 1e-3


@pytest.mark.parametrize("cam", ["pcb2gcode", "dxf2gcode"])
@pytest.mark.parametrize("plate", ["plate_8x8_10", "plate_15x15_21"])
def test_a_stored_program_has_the_order_of_its_algorithm(cam: str, plate: str) -> None:
    (holes,) = cam_orders.holes_of(PLATES / f"{plate}.csv").values()
    assert drilled(PROGRAMS / cam / f"{plate}.nc") == [cam_orders.ORDERS[cam](holes)]


@pytest.mark.external
def test_freecad_gives_the_stored_order(freecadcmd: str) -> None:
    (holes,) = cam_orders.holes_of(PLATES / "plate_8x8_10.csv").values()
    assert drilled(PROGRAMS / "freecad" / "plate_8x8_10.nc") == [cam_orders.freecad_order(holes, freecadcmd)]
