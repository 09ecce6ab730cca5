"""Pieces of divided holes and chambers of notches: each fault with its place, from rectangles."""

from __future__ import annotations

from dataclasses import replace

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.difference import Difference
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.proof.sheet_shapes import build_targets, check_divided_shapes

#: Half of the kerf, mm.
HALF = 0.75


def ring(*points: tuple[float, float]) -> Polyline:
    return Polyline.of_points(list(points), closed=True)


def box(left: float, low: float, right: float, high: float) -> Polyline:
    return ring((left, low), (right, low), (right, high), (left, high))


def sheet(*contours: Contour) -> Sheet:
    return Sheet("a", contours, box(-5, -5, 70, 50))


OUTLINE = Contour(box(0, 0, 60, 40), "cut", depth=0, parent=-1, part=1)
#: Two windows of 10 mm, with a neck of 1 mm between them, which the kerf does not pass.
HOLE = replace(
    OUTLINE,
    depth=1,
    parent=0,
    path=ring(
        (10, 10),
        (20, 10),
        (20, 14.5),
        (30, 14.5),
        (30, 10),
        (40, 10),
        (40, 20),
        (30, 20),
        (30, 15.5),
        (20, 15.5),
        (20, 20),
        (10, 20),
    ),
)
LEFT, RIGHT = replace(HOLE, path=box(10, 10, 20, 20)), replace(HOLE, path=box(30, 10, 40, 20))
#: An outline with two chambers of 10 mm behind mouths of 1 mm.
NOTCHED = replace(
    OUTLINE,
    path=ring(
        (0, 0),
        (19.5, 0),
        (19.5, 10),
        (15, 10),
        (15, 20),
        (25, 20),
        (25, 10),
        (20.5, 10),
        (20.5, 0),
        (60, 0),
        (60, 40),
        (35.5, 40),
        (35.5, 30),
        (40, 30),
        (40, 22),
        (30, 22),
        (30, 30),
        (34.5, 30),
        (34.5, 40),
        (0, 40),
    ),
)
ONE = replace(HOLE, path=box(15, 10, 25, 20), chamber=True)
OTHER = replace(ONE, path=box(30, 22, 40, 30))
NOT_CUT, BEYOND = "a piece of a divided hole is not cut, at", "a divided hole is cut beyond its edge, at"


@pytest.mark.parametrize(
    ("drawn", "divided", "faults"),
    [
        ([OUTLINE, HOLE], [OUTLINE, HOLE], []),
        ([OUTLINE, HOLE], [OUTLINE, LEFT, RIGHT], []),
        ([OUTLINE, HOLE], [OUTLINE, LEFT], [f"{NOT_CUT} X34.910 Y15.012"]),
        ([OUTLINE, HOLE], [OUTLINE, LEFT, replace(RIGHT, path=box(31, 10, 41, 20))],
         [f"{BEYOND} X36.000 Y15.000", f"{NOT_CUT} X34.910 Y15.012"]),
        ([OUTLINE, HOLE], [OUTLINE, LEFT, replace(RIGHT, path=box(30, 10, 40.019, 20))], []),
        ([OUTLINE, HOLE], [OUTLINE, replace(LEFT, path=box(10.76, 10, 20, 20)), RIGHT], []),
        ([OUTLINE, HOLE], [OUTLINE, replace(LEFT, path=box(10.8, 10, 20, 20)), RIGHT], [f"{NOT_CUT} X15.090 Y15.012"]),
        ([OUTLINE, HOLE], [replace(OUTLINE, path=box(0, 0, 60, 40)), LEFT, RIGHT],
         ["the contour at X30.000 Y20.000 is cut in sections, which only a hole may be"]),
        ([NOTCHED], [NOTCHED], []),
        ([NOTCHED], [NOTCHED, ONE, OTHER], []),
        ([NOTCHED], [NOTCHED, ONE], ["a chamber of a notch is not cut, at X35.000 Y26.000"]),
        ([NOTCHED], [NOTCHED, OTHER], ["a chamber of a notch is not cut, at X20.000 Y15.000"]),
        ([NOTCHED], [NOTCHED, ONE, OTHER, replace(ONE, path=box(45, 10, 50, 20))],
         ["a chamber is cut beyond its notch, at X47.500 Y15.000"]),
        ([NOTCHED], [NOTCHED, ONE, replace(OTHER, path=box(30, 22, 41, 30))],
         ["a chamber is cut beyond its notch, at X35.500 Y26.000"]),
        # No other outline has a chamber that is cut.
        ([replace(NOTCHED, kind="mark")], [replace(NOTCHED, kind="mark"), ONE],
         ["a chamber is cut beyond its notch, at X20.000 Y15.000"]),
        ([OUTLINE, NOTCHED], [OUTLINE, NOTCHED, ONE, OTHER], []),
    ],
)  # fmt: skip
def test_pieces_fill_the_hole_or_the_notch_that_was_drawn(
    drawn: list[Contour], divided: list[Contour], faults: list[str]
) -> None:
    found = check_divided_shapes(sheet(*drawn), sheet(*divided), HALF)
    assert found == [Difference("divided hole", 0, 0, text) for text in faults]


@pytest.mark.parametrize(
    ("high", "room"),
    # A notch behind which the kerf leaves no room for a pierce stays uncut, and so does one beside another kerf.
    [(27.9, False), (28.0, False), (28.2, True)],
)
def test_a_chamber_without_room_for_a_pierce_stays_uncut(high: float, room: bool) -> None:
    """The second chamber is 30 to 40 by 25 to `high`; its kerf is 1.5 mm smaller, and a pierce needs 1.5 mm."""
    corners = [(x, {30: high, 22: 25}.get(y, y)) for x, y in NOTCHED.path.vertices[:, :2].tolist()]
    notched = replace(NOTCHED, path=ring(*corners))
    found = check_divided_shapes(sheet(notched), sheet(notched, ONE), HALF)
    assert len(found) == room


def test_contours_are_named_by_number_kind_part_and_start() -> None:
    mark = Contour(Polyline.of_points([(1, 2), (3, 4)]), "mark")
    cut = Contour(Polyline.of_points([(1, 2), (3, 4)]), "cut", part=2)
    edge = replace(OUTLINE, kind="sheet")
    assert [target.name for target in build_targets(sheet(edge, OUTLINE, HOLE, LEFT, mark, cut), HALF)] == [
        "contour 2 (outline of part 1, at X0.000 Y0.000)",
        "contour 4 (hole of part 1, at X10.000 Y10.000)",
        "contour 5 (mark, at X1.000 Y2.000)",
        "contour 6 (cut of part 2, at X1.000 Y2.000)",
    ]


@pytest.mark.parametrize(
    ("side", "targets", "may_stay"), [(2.94, 0, False), (2.96, 1, True), (3.04, 1, True), (3.06, 1, False)]
)
def test_a_hole_two_kerfs_wide_may_stay_uncut(side: float, targets: int, may_stay: bool) -> None:
    """A kerf of 1.5 mm; rounding decides within 0.025 mm on each side."""
    found = build_targets(sheet(replace(HOLE, path=box(10, 10, 10 + side, 10 + side))), HALF)
    assert [target.may_stay for target in found] == [may_stay] * targets
