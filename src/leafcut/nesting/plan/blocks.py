"""Arrange equal parts in blocks for common-line cutting. The parts of a block are one kerf apart.

Rectangles form rows or grids, and other shapes form pairs. A block is nested as a single piece with the full gap around
it, so that each cut can start in the surrounding scrap.
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
from leafcut.nesting.plan.pieces import CHORD, RECTANGLE, SAME_ANGLE, NestPiece

#: Maximum number of parts in a block. Larger blocks fit in few positions and concentrate heat.
MAX_MEMBERS = 12
#: Maximum side of a block with more than two parts, relative to the side of the sheet. This leaves room for several
#: blocks on a sheet.
LARGEST = 0.5
#: Minimum length of an edge for a common line, in mm and in kerf widths. It must not be less than the minimum in
#: `processes.sheet.plan.common_edges`.
SHORTEST, SHORTEST_KERFS = 5.0, 8.0
#: Tolerance for rounding errors of the distance between outlines, mm.
ROUNDING = 1e-4

#: Position of a part in a block: rotation about the origin of the drawing, rad, then translation in x and y, mm.
PartPlace = tuple[float, float, float]


def group_in_blocks(
    pieces: Sequence[NestPiece], counts: Sequence[int], kerf: float, kind: str, inner: tuple[float, float]
) -> tuple[list[NestPiece], list[int]]:
    """Group equal pieces in blocks. Return the blocks and the ungrouped pieces, and the quantity of each.

    Parameters
    ----------
    kind
        ``pairs``, ``rows`` (at most two rows) or ``grids``.
    inner
        Length and width of a sheet without its margins, mm.
    """
    grouped: list[NestPiece] = []
    numbers: list[int] = []
    for piece, count in zip(pieces, counts, strict=True):
        remaining = count
        while remaining > 1:
            block = _largest_block(piece, remaining, kerf, kind, inner)
            if block is None:
                break
            size = len(block.members) // len(piece.members)
            grouped.append(block)
            numbers.append(remaining // size)
            remaining %= size
        if remaining:
            grouped.append(piece)
            numbers.append(remaining)
    return grouped, numbers


def _largest_block(
    piece: NestPiece, count: int, kerf: float, kind: str, inner: tuple[float, float]
) -> NestPiece | None:
    box = next((b for b in piece.boxes if piece.area >= RECTANGLE * b.width * b.height), None)
    if box is None:
        pair = _pair_block(piece, kerf)
        return None if pair is None or not pair.fits(*inner) else pair
    columns, rows = _grid_size(box.width + kerf, box.height + kerf, count, kerf, kind, inner)
    if columns * rows < 2:
        return None
    positions = [
        (box.angle, i * (box.width + kerf) - box.x, j * (box.height + kerf) - box.y)
        for j in range(rows)
        for i in range(columns)
    ]
    width, height = columns * (box.width + kerf) - kerf, rows * (box.height + kerf) - kerf
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    block = _build_block(piece, Polyline.of_points(corners, closed=True), positions)
    return None if block is None or not block.fits(*inner) else block


def _grid_size(
    width: float, height: float, count: int, kerf: float, kind: str, inner: tuple[float, float]
) -> tuple[int, int]:
    """Return the columns and rows of the largest possible block, or (1, 1) if no block is possible.

    If several blocks have the same number of parts, the one closest to a square is chosen. `width` and `height` are the
    sides of a part plus one kerf, mm.
    """
    min_side = max(SHORTEST, SHORTEST_KERFS * kerf)
    max_members = min(count, 2 if kind == "pairs" else MAX_MEMBERS)
    best, rank = (1, 1), (0.0, 0.0)
    for columns in range(1, max_members + 1):
        for rows in range(1, max_members // columns + 1):
            shared = (columns == 1 or height >= min_side) and (rows == 1 or width >= min_side)
            sides = sorted((columns * width, rows * height))
            # A block of two may be as large as the sheet. Larger blocks must leave space for others on the sheet.
            limits = sorted(side * (1.0 if columns * rows == 2 else LARGEST) for side in inner)
            if kind == "rows" and min(columns, rows) > 2:
                continue
            if shared and all(side <= limit for side, limit in zip(sides, limits, strict=True)):
                candidate_rank = (float(columns * rows), -abs(math.log(columns * width / (rows * height))))
                best, rank = max(((best, rank), ((columns, rows), candidate_rank)), key=lambda entry: entry[1])
    return best


def _pair_block(piece: NestPiece, kerf: float) -> NestPiece | None:
    path = piece.path if piece.path.area >= 0.0 else piece.path.reversed()
    edges = [s for s in path.segments() if not s.is_arc]
    for s in sorted(edges, key=lambda s: -round(math.dist(s.start, s.end), 6)):
        length = math.dist(s.start, s.end)
        if length < max(SHORTEST, SHORTEST_KERFS * kerf):
            return None
        # Outlines are counter-clockwise, so the scrap is to the right of an edge.
        normal = ((s.end[1] - s.start[1]) / length, (s.start[0] - s.end[0]) / length)
        x, y = s.start[0] + s.end[0] + kerf * normal[0], s.start[1] + s.end[1] + kerf * normal[1]
        twin = affine_transform(piece.polygon, [-1.0, 0.0, 0.0, -1.0, x, y])
        if piece.polygon.distance(twin) < kerf - ROUNDING:
            continue
        a, b = s.start, s.end
        c, d = (x - a[0], y - a[1]), (x - b[0], y - b[1])
        return _build_block(
            piece,
            _union_outline([piece.polygon, twin, shapely.Polygon([a, b, c, d])], piece),
            [(0.0, 0.0, 0.0), (math.pi, x, y)],
        )
    return None


def _union_outline(shapes: list[Polygon], piece: NestPiece) -> Polyline:
    """Return the outline of the union of several shapes, mm.

    If the piece has arcs, the outline grows by the chord error, so that no arc is cut off.
    """
    union: Any = shapely.union_all([shape.buffer(0.0) for shape in shapes])
    if piece.chord_allowance:
        union = union.buffer(CHORD, join_style="mitre")
    edge: Any = shapely.Polygon(union.exterior).simplify(0.1 * CHORD)
    return Polyline.of_points(edge.exterior.coords, closed=True)


def _build_block(piece: NestPiece, path: Polyline, positions: Sequence[PartPlace]) -> NestPiece | None:
    """Build a block from copies of a piece at the given positions.

    Return None if no allowed rotation suits all copies.
    """
    members: list[Placement] = [m for angle, x, y in positions for m in piece.placements(angle, x, y)]
    angles = piece.angles
    if angles is not None:
        turns = sorted({angle for angle, _, _ in positions})
        offsets = (a - turns[0] for a in angles)
        angles = tuple(
            a % math.tau for a in offsets if all(_is_allowed_angle(a + turn, piece.angles or ()) for turn in turns)
        )
        if not angles:
            return None
    return NestPiece(path, tuple(members), angles)


def _is_allowed_angle(angle: float, allowed: Sequence[float]) -> bool:
    return any(abs(math.remainder(angle - a, math.tau)) <= SAME_ANGLE for a in allowed)
