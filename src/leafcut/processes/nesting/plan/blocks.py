"""Equal parts in blocks, a kerf apart, so that the edges between them can be cut once: pairs, two rows, or a grid.

A block is nested as one piece, with the whole gap around it: every cut between its parts can begin in the scrap beside
it, and nothing is locked in. Rectangles make rows and grids; of other parts two make a pair, the second turned by half
a turn beside the longest straight edge along which that is possible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import shapely
from shapely import Polygon
from shapely.affinity import affine_transform

from leafcut.geometry.polyline import Polyline
from leafcut.model.nest import Placement
from leafcut.processes.nesting.plan.pieces import CHORD, RECTANGLE, SAME_ANGLE, NestPiece

#: Parts in one block at most; more would leave little to choose where it lies, and much heat in one place.
MOST = 12
#: A block takes this share of either side of a sheet at most, so that a sheet holds several.
LARGEST = 0.5
#: Edges shorter than this, mm, and than so many kerfs, are not worth a common line;
#: `processes.sheet.plan.common_cuts.edges` takes no less.
SHORTEST, SHORTEST_KERFS = 5.0, 8.0
#: Outlines nearer than the kerf by less than this are rounding, mm.
ROUNDING = 1e-4

#: A part in a block: turned by an angle about the drawing's origin, then moved, rad and mm.
PartPlace = tuple[float, float, float]


def in_blocks(
    pieces: Sequence[NestPiece], counts: Sequence[int], kerf: float, kind: str, inner: tuple[float, float]
) -> tuple[list[NestPiece], list[int]]:
    """Return blocks of pieces, what is left of the pieces, and how many there are of each.

    Parameters
    ----------
    kind
        ``pairs``, ``rows`` (two at most) or ``grids``.
    inner
        Length and width of a sheet less its margins, mm.
    """
    found: list[NestPiece] = []
    numbers: list[int] = []
    for piece, count in zip(pieces, counts, strict=True):
        left = count
        while left > 1:
            block = _block(piece, left, kerf, kind, inner)
            if block is None:
                break
            size = len(block.members) // len(piece.members)
            found.append(block)
            numbers.append(left // size)
            left %= size
        if left:
            found.append(piece)
            numbers.append(left)
    return found, numbers


def _block(piece: NestPiece, count: int, kerf: float, kind: str, inner: tuple[float, float]) -> NestPiece | None:
    """Return the largest block that `count` of a piece make; None where they make none that fits."""
    box = next((b for b in piece.boxes if piece.area >= RECTANGLE * b.width * b.height), None)
    if box is None:
        pair = _pair(piece, kerf)
        return None if pair is None or not pair.fits(*inner) else pair
    columns, rows = _grid(box.width + kerf, box.height + kerf, count, kerf, kind, inner)
    if columns * rows < 2:
        return None
    places = [
        (box.angle, i * (box.width + kerf) - box.x, j * (box.height + kerf) - box.y)
        for j in range(rows)
        for i in range(columns)
    ]
    width, height = columns * (box.width + kerf) - kerf, rows * (box.height + kerf) - kerf
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    made = _made(piece, Polyline.of_points(corners, closed=True), places)
    return None if made is None or not made.fits(*inner) else made


def _grid(
    width: float, height: float, count: int, kerf: float, kind: str, inner: tuple[float, float]
) -> tuple[int, int]:
    """Return columns and rows of as many cells (mm) as there are, and of those the squarest; (1, 1) for no grid."""
    least = max(SHORTEST, SHORTEST_KERFS * kerf)
    most = min(count, 2 if kind == "pairs" else MOST)
    best, rank = (1, 1), (0.0, 0.0)
    for columns in range(1, most + 1):
        for rows in range(1, most // columns + 1):
            shared = (columns == 1 or height >= least) and (rows == 1 or width >= least)
            sides = sorted((columns * width, rows * height))
            # Two parts make a block wherever they fit, more only where the sheet holds several such blocks.
            room = sorted(side * (1.0 if columns * rows == 2 else LARGEST) for side in inner)
            if kind == "rows" and min(columns, rows) > 2:
                continue
            if shared and all(side <= limit for side, limit in zip(sides, room, strict=True)):
                own = (float(columns * rows), -abs(math.log(columns * width / (rows * height))))
                best, rank = max(((best, rank), ((columns, rows), own)), key=lambda one: one[1])
    return best


def _pair(piece: NestPiece, kerf: float) -> NestPiece | None:
    """Return two of a piece, a kerf apart along the longest straight edge where the turned one has room; or None."""
    path = piece.path if piece.path.area >= 0.0 else piece.path.reversed()
    edges = [s for s in path.segments() if not s.is_arc]
    for s in sorted(edges, key=lambda s: -round(math.dist(s.start, s.end), 6)):
        length = math.dist(s.start, s.end)
        if length < max(SHORTEST, SHORTEST_KERFS * kerf):
            return None
        # Outlines run counter-clockwise: the scrap is to the right of an edge.
        out = ((s.end[1] - s.start[1]) / length, (s.start[0] - s.end[0]) / length)
        x, y = s.start[0] + s.end[0] + kerf * out[0], s.start[1] + s.end[1] + kerf * out[1]
        other = affine_transform(piece.polygon, [-1.0, 0.0, 0.0, -1.0, x, y])
        if piece.polygon.distance(other) < kerf - ROUNDING:
            continue
        a, b = s.start, s.end
        c, d = (x - a[0], y - a[1]), (x - b[0], y - b[1])
        return _made(
            piece,
            _around([piece.polygon, other, shapely.Polygon([a, b, c, d])], piece),
            [(0.0, 0.0, 0.0), (math.pi, x, y)],
        )
    return None


def _around(shapes: list[Polygon], piece: NestPiece) -> Polyline:
    """Return the edge of shapes together; of chords that stand for arcs as much outside as these are inside."""
    whole: Any = shapely.union_all([shape.buffer(0.0) for shape in shapes])
    if piece.slack:
        whole = whole.buffer(CHORD, join_style="mitre")
    edge: Any = shapely.Polygon(whole.exterior).simplify(0.1 * CHORD)
    return Polyline.of_points(edge.exterior.coords, closed=True)


def _made(piece: NestPiece, path: Polyline, places: Sequence[PartPlace]) -> NestPiece | None:
    """Return a block of a piece in some places; None where it could lie in no angle that all of its parts may have."""
    members: list[Placement] = [m for angle, x, y in places for m in piece.laid(angle, x, y)]
    angles = piece.angles
    if angles is not None:
        turns = sorted({angle for angle, _, _ in places})
        free = (a - turns[0] for a in angles)
        angles = tuple(a % math.tau for a in free if all(_among(a + turn, piece.angles or ()) for turn in turns))
        if not angles:
            return None
    return NestPiece(path, tuple(members), angles)


def _among(angle: float, allowed: Sequence[float]) -> bool:
    return any(abs(math.remainder(angle - a, math.tau)) <= SAME_ANGLE for a in allowed)
