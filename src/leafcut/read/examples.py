"""Built-in parts: ``example:plate-70``, ``example:ten-points``, and random maps ``random:N[:SEED]``.

Test parts in the literature on drilling order have the same sizes and numbers of holes. The patterns (bolt circles,
grids, rows) are our own. `examples/make_plates.py` writes the same plates as DXF files.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from leafcut.errors import ReadError, name_suggestion, printable
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.format import MAX_HOLES, Source
from leafcut.units import MM_PER_INCH

EXAMPLE, RANDOM = "example:", "random:"
DEFAULT_SEED = 1

#: A small map for demonstrations: ten points, mm.
TEN_POINTS = (
    (12.0, 64.0), (78.0, 18.0), (45.0, 90.0), (90.0, 72.0), (24.0, 20.0),
    (60.0, 52.0), (8.0, 38.0), (96.0, 44.0), (36.0, 58.0), (70.0, 88.0),
)  # fmt: skip

Inches = tuple[float, float]


@dataclass(frozen=True)
class PlateHole:
    """A hole in a plate, with its centre and diameter in inches."""

    x: float
    y: float
    diameter: float


@dataclass(frozen=True)
class Plate:
    """A rectangular plate, in inches. Its lower left corner is at the origin, and its holes are in drawing order."""

    name: str
    width: float
    height: float
    thickness: float
    holes: tuple[PlateHole, ...]


def _hole_row(x: float, y: float, dx: float, dy: float, n: int) -> list[Inches]:
    return [(x + i * dx, y + i * dy) for i in range(n)]


def _hole_grid(x: float, y: float, pitch: float, columns: int, rows: int) -> list[Inches]:
    return [(x + i * pitch, y + j * pitch) for j in range(rows) for i in range(columns)]


def _bolt_circle(x: float, y: float, diameter: float, n: int, first_degrees: float = 0.0) -> list[Inches]:
    angles = [math.radians(first_degrees + 360.0 * i / n) for i in range(n)]
    # Four decimals of an inch, as in a drawing.
    return [(round(x + diameter / 2 * math.cos(a), 4), round(y + diameter / 2 * math.sin(a), 4)) for a in angles]


def _corner_holes(width: float, height: float, margin: float) -> list[Inches]:
    return [(x, y) for y in (margin, height - margin) for x in (margin, width - margin)]


#: Centres of a group of holes, and their diameter.
_Group = tuple[list[Inches], float]
_QUARTER, _EIGHTH = 0.25, 0.125


#: Maps the name of a plate to its groups of holes.
_PATTERNS: dict[str, list[_Group]] = {
    "plate-10": [(_corner_holes(10, 12, 0.75), _QUARTER), (_bolt_circle(5, 6, 4.5, 6), _QUARTER)],
    "plate-27": [
        (_corner_holes(10, 12, 0.75), _QUARTER),
        (_bolt_circle(5, 8.25, 4, 8, 22.5), _QUARTER),
        (_hole_grid(2, 1.75, 1.5, 5, 3), _QUARTER),
    ],
    "plate-45": [
        (_corner_holes(10, 12, 0.625), _QUARTER),
        (_bolt_circle(5, 8, 6, 12, 15), _QUARTER),
        (_bolt_circle(5, 8, 2.5, 5, 90), _QUARTER),
        (_hole_grid(1.875, 1.25, 1.25, 6, 3), _QUARTER),
        (_hole_row(0.625, 3.5, 0, 1.0, 3), _QUARTER),
        (_hole_row(9.375, 3.5, 0, 1.0, 3), _QUARTER),
    ],
    "plate-65": [
        (_corner_holes(10, 12, 0.5), _QUARTER),
        (_hole_row(0.5, 2.0, 0, 8 / 7, 8), _QUARTER),
        (_hole_row(9.5, 2.0, 0, 8 / 7, 8), _QUARTER),
        (_bolt_circle(5, 8.25, 5.5, 16), _QUARTER),
        (_bolt_circle(5, 8.25, 2, 4, 45), _QUARTER),
        (_hole_grid(3, 1, 1, 5, 5), _QUARTER),
    ],
    "plate-70": [
        (_corner_holes(10, 12, 0.5), _QUARTER),
        (_hole_row(0.5, 2.0, 0, 1.0, 9), _QUARTER),
        (_hole_row(9.5, 2.0, 0, 1.0, 9), _QUARTER),
        (_bolt_circle(5, 8.125, 6, 18), _QUARTER),
        (_bolt_circle(5, 8.125, 2.75, 6, 30), _QUARTER),
        (_hole_grid(2.5, 1.0, 1, 6, 4), _QUARTER),
    ],
    "plate-8x8-10": [(_bolt_circle(4, 4, 4.5, 8), _QUARTER), ([(1.0, 1.0), (7.0, 7.0)], _QUARTER)],
    "plate-8x8-21": [
        (_corner_holes(8, 8, 0.75), _QUARTER),
        (_bolt_circle(4, 4, 5.5, 12, 15), _QUARTER),
        (_bolt_circle(4, 4, 2.5, 4, 45), _QUARTER),
        ([(4.0, 4.0)], _QUARTER),
    ],
    "plate-8x8-35": [
        (_corner_holes(8, 8, 0.75), _QUARTER),
        ([(4.0, 0.75), (4.0, 7.25), (0.75, 4.0), (7.25, 4.0)], _QUARTER),
        (_bolt_circle(4, 5.25, 2.75, 12), _QUARTER),
        (_hole_grid(2.0, 1.5, 1, 5, 3), _QUARTER),
    ],
    "plate-8x8-70": [
        (_corner_holes(8, 8, 0.5), _QUARTER),
        (_hole_row(2.0, 0.5, 2.0, 0, 3) + _hole_row(2.0, 7.5, 2.0, 0, 3), _QUARTER),
        (_hole_row(0.5, 2.0, 0, 2.0, 3) + _hole_row(7.5, 2.0, 0, 2.0, 3), _QUARTER),
        (_bolt_circle(4, 5.0, 4.25, 24), _QUARTER),
        (_bolt_circle(4, 5.0, 2, 12), _QUARTER),
        (_hole_grid(2.25, 1, 0.7, 6, 3), _QUARTER),
    ],
    "plate-15x15-10": [(_bolt_circle(7.5, 7.5, 9, 8), _QUARTER), ([(1.5, 1.5), (13.5, 13.5)], _QUARTER)],
    "plate-15x15-21": [
        (_corner_holes(15, 15, 1), _QUARTER),
        (_bolt_circle(7.5, 7.5, 11, 12, 15), _QUARTER),
        (_bolt_circle(7.5, 7.5, 5, 4, 45), _QUARTER),
        ([(7.5, 7.5)], _QUARTER),
    ],
    "plate-15x15-35": [
        (_corner_holes(15, 15, 1), _QUARTER),
        ([(7.5, 1.0), (7.5, 14.0), (1.0, 7.5), (14.0, 7.5)], _QUARTER),
        (_bolt_circle(7.5, 10, 5, 12), _QUARTER),
        (_hole_grid(3.5, 2.5, 2, 5, 3), _QUARTER),
    ],
    "plate-15x15-70": [
        (_corner_holes(15, 15, 0.75), _QUARTER),
        (_hole_row(3.75, 0.75, 3.75, 0, 3) + _hole_row(3.75, 14.25, 3.75, 0, 3), _QUARTER),
        (_hole_row(0.75, 3.75, 0, 3.75, 3) + _hole_row(14.25, 3.75, 0, 3.75, 3), _QUARTER),
        (_bolt_circle(7.5, 9.5, 8, 24), _QUARTER),
        (_bolt_circle(7.5, 9.5, 4, 12), _QUARTER),
        (_hole_grid(4.375, 2, 1.25, 6, 3), _QUARTER),
    ],
    "board-97": [
        (_corner_holes(15, 15, 0.5), _QUARTER),
        *(
            (_hole_grid(x, y, 0.75, 5, 3), _EIGHTH)
            for x, y in [(1.5, 2.0), (10.5, 2.0), (1.5, 11.5), (10.5, 11.5), (6.0, 1.25)]
        ),
        (_bolt_circle(7.5, 7.75, 5, 18), _EIGHTH),
    ],
    "board-121": [
        (_corner_holes(15, 15, 0.5), _QUARTER),
        *(
            ([centre, *_bolt_circle(*centre, 2.75, 12)], _EIGHTH)
            for centre in [(x, y) for y in (2.75, 7.5, 12.25) for x in (2.75, 7.5, 12.25)]
        ),
    ],
    "board-200": [
        (_corner_holes(15, 15, 0.5), _QUARTER),
        *(
            (_hole_grid(x, y, 0.625, 5, 4), _EIGHTH)
            for x, y in [
                (1.5, 1.5),
                (5.75, 1.25),
                (10.5, 1.5),
                (1.25, 6.25),
                (11.25, 6.25),
                (1.5, 11.5),
                (5.75, 11.75),
                (10.5, 11.5),
            ]
        ),
        *((_bolt_circle(*circle, 12), _EIGHTH) for circle in [(6.0, 6.25, 2.0), (9.0, 6.25, 2.0), (7.5, 9.25, 2.5)]),
    ],
}
PLATE_NAMES = tuple(_PATTERNS)
EXAMPLE_NAMES = ("ten-points", *PLATE_NAMES)


def create_plate(name: str) -> Plate:
    """Create one of the plates in `PLATE_NAMES`.

    The holes are shuffled to imitate the order of a drawing made by hand. The name of the plate is the seed.
    """
    width, height = (8, 8) if "8x8" in name else (15, 15) if name.startswith(("plate-15x15", "board")) else (10, 12)
    groups = list(_PATTERNS[name])

    import random  # start-up

    draw = random.Random(name)
    draw.shuffle(groups)
    holes = []
    for group, diameter in groups:
        points = list(group)
        draw.shuffle(points)
        holes += [PlateHole(round(x, 4), round(y, 4), diameter) for x, y in points]
    return Plate(name, width, height, 0.25, tuple(holes))


def read_example(source: Source, options: ReadOptions) -> Part:
    """Create a built-in part.

    Raises
    ------
    ReadError
        The example does not exist, or the numbers of a random map are out of range.
    """
    if source.path.startswith(RANDOM):
        return _random_map(source)
    name = source.path.removeprefix(EXAMPLE).strip().lower().replace("_", "-")
    if name not in EXAMPLE_NAMES:
        raise ReadError(
            source.path, Message("unknown example '{}'{}", printable(name), name_suggestion(name, EXAMPLE_NAMES))
        )
    if name == "ten-points":
        return _map_part(name, TEN_POINTS)
    drawn = create_plate(name)
    holes = tuple(
        Hole(round(h.x * MM_PER_INCH, 6), round(h.y * MM_PER_INCH, 6), round(h.diameter * MM_PER_INCH, 6), "HOLES")
        for h in drawn.holes
    )
    width, height = round(drawn.width * MM_PER_INCH, 6), round(drawn.height * MM_PER_INCH, 6)
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    edge = (Contour(Polyline.of_points(corners, closed=True), "sheet", "OUTLINE"),)
    return Part(name, holes, source=EXAMPLE + name, format="example", units="in", edge=edge)


def _random_map(source: Source) -> Part:
    """Create n uniformly distributed points in a square with sides of √n·10 mm.

    Neighbours are then about 5 mm apart for every n.
    """
    fields = source.path.removeprefix(RANDOM).split(":")
    try:
        n, seed = int(fields[0]), int(fields[1]) if len(fields) > 1 else DEFAULT_SEED
        valid = len(fields) <= 2 and 1 <= n <= MAX_HOLES and 0 <= seed < 2**32
    except ValueError:
        valid = False
    if not valid:
        reason = Message("a random map is random:N or random:N:SEED, N from 1 to {:,}, SEED from 0 to 2³²−1", MAX_HOLES)
        raise ReadError(printable(source.path), reason)
    side = round(math.sqrt(n) * 10.0, 3)
    xy = np.round(np.random.default_rng(seed).random((n, 2)) * side, 3)
    return _map_part(f"random-{n}-{seed}", xy.tolist(), f"{RANDOM}{n}:{seed}")


def _map_part(name: str, points: object, source: str = "") -> Part:
    holes = tuple([Hole(x, y, 0.0) for x, y in points])  # type: ignore[attr-defined]
    return Part(name, holes, source=source or EXAMPLE + name, format="example")
