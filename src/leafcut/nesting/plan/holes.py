"""Place small parts into the holes of large parts before nesting, because this area is scrap otherwise."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from shapely.geometry.base import BaseGeometry

from leafcut.geometry.polyline import Polyline
from leafcut.model.nest import NestPart, Placement
from leafcut.nesting.plan.pieces import NestPiece, angles_within, polygon_of
from leafcut.nesting.plan.positions import FREE_ANGLES, buffer_distance, find_position

#: Maximum number of holes to fill in a part (largest first), and maximum number of kinds of part to try in each hole.
MAX_HOLES = 20
MAX_TRIED = 40


def fill_holes(
    parts: Sequence[NestPart], pieces: Sequence[NestPiece], spacing: float
) -> tuple[list[NestPiece], list[int]]:
    """Put small parts into the holes of the pieces, smallest pieces first. Return all pieces and their quantities.

    The members of all pieces add up to the quantities of `parts`. Parts keep `spacing` (mm) from the edge of the hole.
    """
    filled, counts = list(pieces), [part.quantity for part in parts]
    clear = buffer_distance(spacing)
    for root in sorted(range(len(parts)), key=lambda i: (pieces[i].area, i)):
        spaces = _hole_spaces(parts[root].holes, clear)
        while spaces and counts[root]:
            members, used = _fill_spaces(root, spaces, filled, counts, clear)
            if not used:
                break
            number = min([counts[root], *(counts[piece] // count for piece, count in used.items())])
            filled.append(NestPiece(pieces[root].path, (*pieces[root].members, *members), pieces[root].angles))
            counts.append(number)
            counts[root] -= number
            for piece, count in used.items():
                counts[piece] -= count * number
    kept = [i for i, count in enumerate(counts) if count]
    return [filled[i] for i in kept], [counts[i] for i in kept]


def _hole_spaces(holes: Sequence[Polyline], clear: float) -> list[BaseGeometry]:
    large = sorted(holes, key=lambda hole: -abs(hole.area))[:MAX_HOLES]
    polygons = [polygon_of(hole) for hole in large]
    spaces = [polygon.buffer(-clear) for polygon in polygons if polygon.is_valid]
    return [space for space in spaces if not space.is_empty]


def _fill_spaces(
    root: int, spaces: list[BaseGeometry], pieces: list[NestPiece], counts: list[int], clear: float
) -> tuple[list[Placement], Counter[int]]:
    members: list[Placement] = []
    used: Counter[int] = Counter()
    for space in spaces:
        remaining = space
        fitting = [i for i, p in enumerate(pieces) if i != root and counts[i] and p.area < space.area]
        for number in sorted(fitting, key=lambda i: (-pieces[i].area, i))[:MAX_TRIED]:
            piece = pieces[number]
            while used[number] < counts[number] and piece.area < remaining.area:
                position = find_position(piece, remaining, _angles(piece, pieces[root].angles), quick=True)
                if position is None:
                    break
                angle, x, y, polygon = position
                members += piece.placements(angle, x, y)
                used[number] += 1
                remaining = remaining.difference(polygon.buffer(clear))
    return members, +used


def _angles(piece: NestPiece, outer: Sequence[float] | None) -> list[float]:
    """Return the rotations of a piece in a hole that remain allowed at every rotation (`outer`) of the outer part."""
    angles = piece.angles if piece.angles is not None else FREE_ANGLES
    return [angle for angle in angles if angles_within(piece.angles, outer, angle)]
