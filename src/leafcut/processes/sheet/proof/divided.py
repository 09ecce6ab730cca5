"""The proof of holes and notches that are cut in pieces: none beyond what is drawn, and all that the kerf reaches."""

from __future__ import annotations

from typing import Any

import shapely

from leafcut.model.difference import Difference
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.processes.sheet.proof.sheet_shapes import QUARTER, TOLERANCE
from leafcut.processes.sheet.proof.torch_runs import FLATNESS
from leafcut.proof.difference import place


def check_divided(drawn: Sheet, sheet: Sheet, half: float) -> list[Difference]:
    """Return what is wrong with a sheet whose holes and notches were divided, beside the sheet as `drawn`.

    Parameters
    ----------
    half
        How far the middle of the kerf keeps from the parts, mm.
    """
    changed = [k for k, one in enumerate(drawn.contours) if sheet.contours[k].contour is not one.contour]
    if not changed and len(sheet.contours) == len(drawn.contours):
        return []
    holes = {k: _shape(drawn.contours[k]) for k in changed}
    added = sheet.contours[len(drawn.contours) :]
    pieces = [_shape(one) for one in (*(sheet.contours[k] for k in changed), *added) if not one.chamber]
    found = _check_chambers(drawn, [_shape(one) for one in added if one.chamber], half)
    found += [
        _wrong(f"a divided contour is no hole, at {_place(shape)}")
        for k, shape in holes.items()
        if not drawn.contours[k].is_hole
    ]
    found += [
        _wrong(f"a divided hole is cut beyond its edge, at {_place(piece)}")
        for piece in pieces
        if not any(hole.buffer(TOLERANCE).covers(piece) for hole in holes.values())
    ]
    whole = shapely.union_all([piece.buffer(TOLERANCE) for piece in pieces])
    for hole in holes.values():
        for reached in shapely.get_parts(hole.buffer(-half, quad_segs=QUARTER)):
            room = not reached.buffer(-half - 2.0 * TOLERANCE).is_empty
            if room and not whole.covers(reached):
                found.append(_wrong(f"a piece of a divided hole is not cut, at {_place(reached)}"))
    return found


def _check_chambers(drawn: Sheet, chambers: list[Any], half: float) -> list[Difference]:
    """Return the chambers that lie in no notch, and those that are not cut of an outline with others that are.

    One without room for a pierce, or whose kerf would run into another, may stay.
    """
    if not chambers:
        return []
    found, lost = list[Difference](), list(chambers)
    whole = shapely.union_all([chamber.buffer(TOLERANCE) for chamber in chambers])
    for one in drawn.contours:
        if one.is_hole or one.contour.kind != "cut" or not one.contour.path.closed:
            continue
        outline = _shape(one)
        grown = outline.buffer(half, quad_segs=QUARTER)
        ways = [grown.exterior, *grown.interiors]
        reached = [shapely.Polygon(way) for way in ways[1:]]
        if not any(whole.covers(ring) for ring in reached):
            continue
        closed = shapely.Polygon(grown.exterior).buffer(-half, quad_segs=QUARTER).difference(outline)
        lost = [chamber for chamber in lost if not closed.buffer(TOLERANCE).covers(chamber)]
        for k, ring in enumerate(reached, 1):
            alone = shapely.distance(ways[k], ways[:k] + ways[k + 1 :]).min() > 2.0 * half + 4.0 * TOLERANCE
            room = alone and not ring.buffer(-half - 2.0 * TOLERANCE).is_empty
            if room and not whole.covers(ring):
                found.append(_wrong(f"a chamber of a notch is not cut, at {_place(ring)}"))
    return found + [_wrong(f"a chamber is cut beyond its notch, at {_place(chamber)}") for chamber in lost]


def _shape(one: SheetContour) -> Any:
    return shapely.Polygon(one.contour.path.flattened(FLATNESS))


def _place(shape: Any) -> str:
    x, y = shape.representative_point().coords[0]
    return place(x, y)


def _wrong(text: str) -> Difference:
    return Difference("divided hole", 0, 0, text)
