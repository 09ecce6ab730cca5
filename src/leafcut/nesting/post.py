"""Write a nested sheet as a DXF drawing. Any cutting program can use it, and leafcut can read it back."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from leafcut.files.digests import DIGEST_LINE, fill_in_digest
from leafcut.geometry.polyline import Polyline
from leafcut.model.nest import Layout, Nest, Stock

#: Lock for the metadata option of ezdxf. The option is global, so only one thread at a time may change it.
_EZDXF_LOCK = threading.Lock()
#: AutoCAD colour index by layer.
LAYERS = {"CUT": 7, "CUT_HOLES": 3, "MARK": 5, "SHEET": 8}
#: Application name under which the name of a part is stored as extended data (XDATA).
APPLICATION = "LEAFCUT"
#: Number of decimals of coordinates in mm. Rounding to a nanometre hides differences that depend on the order of
#: additions.
DIGITS = 6
#: Tolerance for recognising a circle by the bulges of its two half circles.
ROUND = 1e-9


def layout_as_dxf(nest: Nest, layout: Layout) -> str:
    """Write one sheet of a nest as DXF R2000 in mm.

    Outlines are on layer CUT, and the name of the part is attached as XDATA. Holes are on layer CUT_HOLES, marks on
    MARK, and the edge of the sheet on SHEET. Arcs remain arcs. The same nest always gives the same text.
    """
    with _reproducible_dxf():
        return _drawing_text(_layout_drawing(nest, layout))


def remnant_as_dxf(stock: Stock) -> str:
    """Write a remnant as a drawing. Its outline and its holes are on layer SHEET."""
    with _reproducible_dxf():
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
    r"""Escape non-ASCII characters in the style of DXF R2000, for example \U+00E4."""
    return "".join(c if c.isascii() else f"\\U+{ord(c):04X}" for c in name)


def _draw_path(space: Any, path: Polyline, layer: str) -> Any:
    """Draw a circle as CIRCLE, and any other path as LWPOLYLINE with bulges. Return the entity."""
    attributes = {"layer": layer}
    bulges = path.bulges
    if path.closed and len(bulges) == 2 and abs(abs(bulges[0]) - 1.0) < ROUND and abs(bulges[0] - bulges[1]) < ROUND:
        arc = path.segment(0)
        center = (round(arc.center[0], DIGITS), round(arc.center[1], DIGITS))
        return space.add_circle(center, round(arc.radius, DIGITS), dxfattribs=attributes)
    rows = [(round(x, DIGITS), round(y, DIGITS), bulge) for x, y, bulge in path.vertices.tolist()]
    return space.add_lwpolyline(rows, format="xyb", close=path.closed, dxfattribs=attributes)


def _drawing_text(drawing: Any) -> str:
    """Return a drawing as text. A comment (group code 999) contains its digest."""
    stream = io.StringIO()
    drawing.write(stream)
    return fill_in_digest(f"999\n{DIGEST_LINE}\n{stream.getvalue()}")


@contextmanager
def _reproducible_dxf() -> Iterator[None]:
    """Prevent ezdxf from writing dates and random numbers. The option for this is global, so a lock protects it."""
    import ezdxf

    with _EZDXF_LOCK:
        before = ezdxf.options.write_fixed_meta_data_for_testing
        ezdxf.options.write_fixed_meta_data_for_testing = True
        try:
            yield
        finally:
            ezdxf.options.write_fixed_meta_data_for_testing = before
