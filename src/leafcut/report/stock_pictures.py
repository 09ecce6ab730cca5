"""What a run leaves of its stock, in pictures for its page: of a program before and after, and whether they differ."""

from __future__ import annotations

import base64
import io
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from leafcut.errors import LeafcutError

if TYPE_CHECKING:
    from leafcut.material.solid import Solid
    from leafcut.report.path_report import PathReport

#: Heights that differ by less are the same, mm.
_TOLERANCE = 0.01
#: Colours of a picture: more would only make the page larger.
_COLOURS = 160


def stock_pictures(report: PathReport[Any]) -> dict[str, Any] | None:
    """Return what a page shows of the stock; None where it is not known.

    That is ``pictures``, (title, address of the picture, size) of each, and ``same``, whether they differ, in words.
    """
    from leafcut.material.same_stock import stock_differences
    from leafcut.material.solid import solid_of

    outcome, stock = report.outcome, report.stock()
    try:
        if report.came_in != "program":
            solid = solid_of(outcome.path_after, stock)
            return {"pictures": [_picture("After: leafcut", solid, ways=stock.surface is not None)], "same": ""}
        before = solid_of(outcome.path_before, stock)
        after = solid_of(outcome.path_after, replace(stock, block=(before.block.low, before.block.high)))
    except LeafcutError:
        return None
    wrong = sum(one.cells for one in stock_differences(before.after, after.after, _TOLERANCE))
    cells = f"{after.after.heights.size:,} cells of {after.after.cell:.3g} mm"
    return {
        "pictures": [_picture("Before: the program’s order", before), _picture("After: leafcut", after)],
        "same": f"{wrong:,} of {cells} differ." if wrong else f"No difference, in {cells}.",
    }


def _picture(title: str, solid: Solid, *, ways: bool = False) -> tuple[str, str, str]:
    """Return a title, the address of the picture with the ways between the cuts or without, and the size."""
    from PIL import Image

    from leafcut.report.stock_picture import OverStock, stock_png

    x, y = solid.origin
    field = replace(solid.after, x=solid.after.x + x, y=solid.after.y + y)  # with the program's coordinates at its axes
    over = None
    if ways:
        lines = solid.moves.ends[solid.moves.rapid][:, [0, 1, 3, 4]] + (x, y, x, y)
        over = OverStock(lines, solid.before.heights <= solid.before.floor, solid.held)
    drawn = Image.open(io.BytesIO(stock_png(field, solid.block.high[2], over)))
    out = io.BytesIO()
    drawn.quantize(_COLOURS).save(out, "PNG", optimize=True)
    size = " × ".join(f"{b - a:.1f}" for a, b in zip(solid.block.low, solid.block.high, strict=True))
    if ways:
        title = f"{title}, its ways in red{', fixtures in grey' if solid.held.any() else ''}"
    return title, f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}", f"{size} mm"
