"""Pieces to nest: an outline, its allowed rotations, and the parts that it contains."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from shapely import Polygon, oriented_envelope
from shapely.validation import explain_validity

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.nest import NestPart, Placement

#: Chord error of arcs, mm. It is added to the spacing of outlines that contain arcs.
CHORD = 0.01
#: Largest difference between equal angles, rad.
SAME_ANGLE = 1e-9
#: An outline counts as a rectangle if it fills this share of its bounding box.
RECTANGLE = 1.0 - 1e-6
#: Rotations to try when checking whether a freely rotatable part fits on the sheet.
FREE_ANGLES = tuple(math.radians(k) for k in range(180))
#: A piece may exceed the sheet by this rounding error, mm.
SIDE_TOLERANCE = 1e-6
#: Maximum number of parts, and maximum number of kinds of part. If a list has more, it probably contains a mistake.
MAX_PARTS = 100_000
MAX_KINDS = 2_000


@dataclass(frozen=True, eq=False)
class Box:
    """The bounding box of a piece that is rotated by `angle`, rad: lower left corner and sides, mm."""

    angle: float
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, eq=False)
class NestPiece:
    """A part together with the parts in its holes, or a block of parts. All of them move together.

    Attributes
    ----------
    path
        Outline in the coordinates of the drawing.
    members
        Placements of the parts in the same coordinates. If the piece is a part with filled holes, the first member is
        the part itself at angle 0 and (0, 0).
    angles
        Allowed rotations, rad, or None for any.
    """

    path: Polyline
    members: tuple[Placement, ...]
    angles: tuple[float, ...] | None

    @cached_property
    def polygon(self) -> Polygon:
        """The outline as a polygon. Arcs are approximated by chords."""
        return chord_polygon(self.path)

    @cached_property
    def area(self) -> float:
        """Area inside the outline, including holes, mm²."""
        return abs(self.path.area)

    @cached_property
    def chord_allowance(self) -> float:
        """Additional distance that covers the chord error of arcs, mm."""
        return CHORD if self.path.bulges.any() else 0.0

    def box(self, angle: float) -> Box:
        """Return the bounding box of the piece after rotation by `angle`, rad."""
        x0, y0, x1, y1 = self.path.turned(angle).extents
        return Box(angle, x0, y0, x1 - x0, y1 - y0)

    @cached_property
    def boxes(self) -> tuple[Box, ...]:
        """Bounding boxes at all allowed rotations. If any rotation is allowed, only some rotations are used."""
        angles = self.angles if self.angles is not None else (*self._tightest_angles, *FREE_ANGLES)
        return tuple(self.box(angle) for angle in angles)

    @cached_property
    def _tightest_angles(self) -> tuple[float, ...]:
        """The rotation with the smallest bounding box, and the rotation by another 90°, rad."""
        envelope: Any = oriented_envelope(self.polygon)
        corners = list(envelope.exterior.coords)
        edge = math.atan2(corners[1][1] - corners[0][1], corners[1][0] - corners[0][0])
        return (-edge % math.tau, (0.5 * math.pi - edge) % math.tau)

    @cached_property
    def is_rectangle(self) -> bool:
        """Whether the outline fills its bounding box at one of the allowed rotations."""
        return any(self.area >= RECTANGLE * b.width * b.height for b in self.boxes)

    def fits(self, length: float, width: float) -> bool:
        """Return whether the piece fits into a rectangle at one of the allowed rotations."""
        return any(b.width <= length + SIDE_TOLERANCE and b.height <= width + SIDE_TOLERANCE for b in self.boxes)

    def placements(self, angle: float, x: float, y: float) -> list[Placement]:
        """Return the placements of all members.

        The piece is first rotated by `angle`, rad, and then moved by (x, y), mm.
        """
        cos, sin = math.cos(angle), math.sin(angle)
        return [
            Placement(m.part, (m.angle + angle) % math.tau, x + cos * m.x - sin * m.y, y + sin * m.x + cos * m.y)
            for m in self.members
        ]


def chord_polygon(path: Polyline) -> Polygon:
    """Convert a closed path to a polygon. Arcs are approximated by chords."""
    return Polygon(path.flattened(CHORD))


def pieces_from_parts(parts: Sequence[NestPart]) -> list[NestPiece]:
    """Create one piece for each part.

    Raises
    ------
    PlanError
        If the list of parts is empty or too long, a quantity is below 1, or an outline encloses no area or crosses
        itself.
    """
    if not parts:
        raise PlanError("no parts to nest")
    if len(parts) > MAX_KINDS or sum(part.quantity for part in parts) > MAX_PARTS:
        raise PlanError(
            "more than {:,} kinds of part or {:,} parts in all; nest them in several runs", MAX_KINDS, MAX_PARTS
        )
    return [_checked_piece(number, part) for number, part in enumerate(parts)]


def _checked_piece(number: int, part: NestPart) -> NestPiece:
    if part.quantity < 1:
        raise PlanError("{}: the quantity is {}; it must be 1 or more", part.name, part.quantity)
    if not part.contours or not part.outline.closed or len(part.outline.flattened(CHORD)) < 4:
        raise PlanError("{}: its outline is not closed; join its ends in the drawing", part.name)
    piece = NestPiece(part.outline, (Placement(number, 0.0, 0.0, 0.0),), part.rotations)
    if not piece.polygon.is_valid or piece.area <= 0.0:
        location = explain_validity(piece.polygon).partition("[")[2].rstrip("]")
        where = Message(" near ({})", ", ".join(f"{float(v):.6g}" for v in location.split())) if location else ""
        raise PlanError("{}: its outline crosses or touches itself{}; repair the drawing", part.name, where)
    return piece


def check_fit(parts: Sequence[NestPart], pieces: Sequence[NestPiece], inner: Sequence[tuple[float, float]]) -> None:
    """Raise PlanError if a part does not fit on any sheet. The error names the first such part.

    `inner` contains the length and width of each kind of sheet without margins, mm.
    """
    for part, piece in zip(parts, pieces, strict=True):
        if not any(piece.fits(*size) for size in inner):
            length, width = max(inner, key=math.prod)
            box = min(piece.boxes, key=lambda b: max(b.width - length, b.height - width))
            sheet = Message("a sheet") if len(inner) == 1 else Message("the largest sheet")
            raise PlanError(
                "{}: the part measures {:.6g} × {:.6g} mm, but {} without its margins measures only {:.6g} × "
                "{:.6g} mm; use a larger sheet, a smaller margin or more rotations",
                part.name,
                box.width,
                box.height,
                sheet,
                length,
                width,
            )


def select_by_area(counts: Counter[int], weight: Callable[[int], float], area: float) -> Counter[int]:
    """Select pieces up to a total weight of about `area`, mm², but at least one piece.

    Return the quantity of each piece.

    First, each kind of piece contributes the same share of its quantity. Then the largest pieces fill the remaining
    area. `weight` returns the area that a piece requires, mm².
    """
    total_weight = sum(weight(piece) * count for piece, count in counts.items())
    if total_weight <= area:
        return +counts
    share = Counter({piece: int(area / total_weight * count) for piece, count in counts.items()})
    remaining = area - sum(weight(piece) * count for piece, count in share.items())
    order = sorted(+counts, key=lambda piece: (-weight(piece), piece))
    for piece in order:
        extra = min(counts[piece] - share[piece], int(remaining / weight(piece)))
        share[piece] += extra
        remaining -= extra * weight(piece)
    return +share or Counter({order[0]: 1})


def has_common_rotation(inner: Iterable[float] | None, outer: Sequence[float] | None, turn: float) -> bool:
    """Return whether a part in a hole has an allowed rotation for every rotation of the surrounding part.

    Parameters
    ----------
    inner, outer
        Allowed rotations of the part in the hole and of the surrounding part, rad, or None for any.
    turn
        Rotation of the inner part relative to the surrounding part, rad.
    """
    if inner is None:
        return True
    if outer is None:
        return False
    allowed = list(inner)
    return all(any(_angle_between(turn + angle, a) <= SAME_ANGLE for a in allowed) for angle in outer)


def _angle_between(a: float, b: float) -> float:
    return abs((a - b + math.pi) % math.tau - math.pi)
