"""The remnants of a sheet that are worth keeping as new sheets after the parts are cut."""

from __future__ import annotations

from typing import Any

import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.nest import Layout, Nest, Stock
from leafcut.nesting.plan.pieces import chord_polygon
from leafcut.nesting.plan.positions import buffer_distance

#: Tolerance for simplifying the edge of a remnant, mm.
_COARSE = 0.05
#: Mitre limit at corners of enlarged or shrunk regions, relative to the distance by which they change.
_MITRE = 2.0


#: A remnant, and the position of its lower left corner on the sheet, mm.
KeptRemnant = tuple[Stock, tuple[float, float]]


def find_remnants(nest: Nest, layout: Layout, spacing: float, least: float, name: str) -> list[KeptRemnant]:
    """Return the remnants of a sheet, largest first. Each remnant is moved to (0, 0).

    Remnants keep a distance of at least `spacing` mm from the parts. Strips narrower than `least` mm are cut off, and a
    remnant is dropped if no disc of this diameter fits into it.
    """
    outline, *holes = (chord_polygon(path) for path in nest.stock_of(layout).paths)
    sheet = outline.difference(shapely.union_all(holes)) if holes else outline
    clear = buffer_distance(spacing) + _COARSE
    shells = [chord_polygon(p.placed(nest.parts[p.part].outline)) for p in layout.placements]
    remaining = sheet.difference(shapely.union_all([shell.buffer(clear, quad_segs=8) for shell in shells]))
    simplified = _without_strips(remaining, least).simplify(_COARSE)
    pieces = [piece for piece in shapely.get_parts(simplified) if not piece.buffer(-0.5 * least).is_empty]
    pieces.sort(key=lambda piece: (-round(piece.area, 3), piece.bounds))
    return [_remnant_as_stock(piece, f"{name}_{number}") for number, piece in enumerate(pieces, 1)]


def _without_strips(region: Any, least: float) -> Any:
    """Remove strips narrower than `least` mm from a region. The result lies inside the region."""
    inner = region.buffer(-0.5 * least, join_style="mitre", mitre_limit=_MITRE)
    return inner.buffer(0.5 * least, join_style="mitre", mitre_limit=_MITRE).intersection(region)


def _remnant_as_stock(piece: Any, name: str) -> KeptRemnant:
    x0, y0, x1, y1 = piece.bounds
    rings = [piece.exterior, *piece.interiors]
    paths = [Polyline.of_points([(x - x0, y - y0) for x, y in ring.coords[:-1]], closed=True) for ring in rings]
    return Stock(x1 - x0, y1 - y0, 1, None, tuple(paths), name), (x0, y0)
