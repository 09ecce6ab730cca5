"""Write a nested sheet as a DXF drawing for any cutting program; leafcut can read it back."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from leafcut.files.digests import DIGEST_LINE, sign_program
from leafcut.geometry.polyline import Polyline
from leafcut.model.nest import Layout, Nest, Stock

#: Lock on the global metadata option of ezdxf, so that one thread at a time changes it.
_EZDXF_LOCK = threading.Lock()
#: AutoCAD colour index by layer.
LAYERS = {"CUT": 7, "CUT_HOLES": 3, "MARK": 5, "SHEET": 8}
#: Application name of the extended data (XDATA) that contains the name of a part.
APPLICATION = "LEAFCUT"
#: Number of decimals of coordinates in mm; rounding to a nanometre hides effects of the order of addition.
DIGITS = 6
#: Tolerance for the bulges of two half circles that form a circle.
ROUND = 1e-9


def write_layout(nest: Nest, layout: Layout) -> str:
    """Return one sheet of a nest as DXF R2000 in mm.

    Outlines are on layer CUT, with the name of their part as XDATA. Holes are on CUT_HOLES, marks on MARK, and the edge
    of the sheet on SHEET. Arcs stay arcs. The output is deterministic.
    """
    with _without_dates():
        return _drawing_text(_layout_drawing(nest, layout))


def write_stock(stock: Stock) -> str:
    """Return a remnant as a drawing, with its outline and its holes on layer SHEET."""
    with _without_dates():
        drawing = _new_drawing()
        _draw_stock(drawing.modelspace(), stock)
        return _drawing_text(drawing)


def _new_drawing() -> Any:
    import ezdxf
    from ezdxf.enums import InsertUnits

    drawing = ezdxf.new("R2000", units=InsertUnits.Millimeters)
    for name, colour in LAYERS.items():
        drawing.layers.add(name, color=colour)
    drawing.appids.add(APPLICATION)
    return drawing


def _layout_drawing(nest: Nest, layout: Layout) -> Any:
    drawing = _new_drawing()
    space = drawing.modelspace()
    _draw_stock(space, nest.stock_of(layout))
    for placement in layout.placements:
        part = nest.parts[placement.part]
        for number, contour in enumerate(part.contours):
            hole = number > 0 and contour.path.closed
            layer = "MARK" if contour.kind == "mark" else "CUT_HOLES" if hole else "CUT"
            drawn = _draw_path(space, placement.placed(contour.path), layer)
            if number == 0:
                drawn.set_xdata(APPLICATION, [(1000, _escape_ascii(part.label))])
    return drawing


def _draw_stock(space: Any, stock: Stock) -> None:
    for path in stock.paths:
        _draw_path(space, path, "SHEET").set_xdata(APPLICATION, [(1000, _escape_ascii(stock.label)), (1000, "sheet")])


def _escape_ascii(name: str) -> str:
    r"""Escape non-ASCII characters as in DXF R2000, for example \U+00E4."""
    return "".join(c if c.isascii() else f"\\U+{ord(c):04X}" for c in name)


def _draw_path(space: Any, path: Polyline, layer: str) -> Any:
    """Draw a circle as CIRCLE, any other path as LWPOLYLINE with bulges. Return the entity."""
    attributes = {"layer": layer}
    bulges = path.bulges
    if path.closed and len(bulges) == 2 and abs(abs(bulges[0]) - 1.0) < ROUND and abs(bulges[0] - bulges[1]) < ROUND:
        arc = path.segment(0)
        center = (round(arc.center[0], DIGITS), round(arc.center[1], DIGITS))
        return space.add_circle(center, round(arc.radius, DIGITS), dxfattribs=attributes)
    rows = [(round(x, DIGITS), round(y, DIGITS), bulge) for x, y, bulge in path.vertices.tolist()]
    return space.add_lwpolyline(rows, format="xyb", close=path.closed, dxfattribs=attributes)


def _drawing_text(drawing: Any) -> str:
    """Return a drawing as text, with its digest in a comment (group code 999)."""
    stream = io.StringIO()
    drawing.write(stream)
    return sign_program(f"999\n{DIGEST_LINE}\n{stream.getvalue()}")


@contextmanager
def _without_dates() -> Iterator[None]:
    """Prevent ezdxf from writing dates and random numbers. A lock protects its option, which is global."""
    import ezdxf

    with _EZDXF_LOCK:
        before = ezdxf.options.write_fixed_meta_data_for_testing
        ezdxf.options.write_fixed_meta_data_for_testing = True
        try:
            yield
        finally:
            ezdxf.options.write_fixed_meta_data_for_testing = before
