"""The proof of holes that are cut in pieces: no piece beyond the drawn hole, and all that the kerf reaches in one."""

from __future__ import annotations

from typing import Any

import shapely

from leafcut.model.difference import Difference
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.processes.sheet.proof.sheet_shapes import QUARTER, TOLERANCE
from leafcut.processes.sheet.proof.torch_runs import FLATNESS
from leafcut.proof.difference import place


def check_divided(drawn: Sheet, sheet: Sheet, half: float) -> list[Difference]:
    """Return what is wrong with a sheet whose holes were divided, beside the sheet as `drawn`.

    Parameters
    ----------
    half
        How far the middle of the kerf keeps from the parts, mm.
    """
    changed = [k for k, one in enumerate(drawn.contours) if sheet.contours[k].contour is not one.contour]
    if not changed and len(sheet.contours) == len(drawn.contours):
        return []
    holes = {k: _shape(drawn.contours[k]) for k in changed}
    pieces = [_shape(one) for one in (*(sheet.contours[k] for k in changed), *sheet.contours[len(drawn.contours) :])]
    found = [
        _wrong(f"what was divided is no hole, at {_place(shape)}")
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


def _shape(one: SheetContour) -> Any:
    return shapely.Polygon(one.contour.path.flattened(FLATNESS))


def _place(shape: Any) -> str:
    x, y = shape.representative_point().coords[0]
    return place(x, y)


def _wrong(text: str) -> Difference:
    return Difference("divided hole", 0, 0, text)
