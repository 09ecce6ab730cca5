"""What remains of a sheet when its parts are cut: pieces that are worth keeping, as sheets of their own."""

from __future__ import annotations

import math
from typing import Any

import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.nest import Layout, Nest, Stock
from leafcut.processes.nesting.plan.pieces import polygon_of
from leafcut.processes.nesting.plan.rooms import clear_of

#: The edge of a remnant is drawn in as many points as it takes to leave it by no more than this, mm.
_COARSE = 0.05
#: Corners grow by at most this many times the distance.
_MITRE = 2.0
#: Corners of 90 degrees and more are this far from a disc's centre at most, in radii.
_RIGHT_ANGLE = 1.0001 * math.sqrt(2.0)


#: A remnant, and where its lower left corner was on the sheet, mm.
KeptRemnant = tuple[Stock, tuple[float, float]]


def remains(nest: Nest, layout: Layout, spacing: float, least: float, name: str) -> list[KeptRemnant]:
    """Return what remains of a sheet, the largest piece first, each from (0, 0) on.

    Between it and the parts stays `spacing` (mm). Strips narrower than `least` are cut off, and what is then too small
    for a disc of that diameter is left out.
    """
    outline, *holes = (polygon_of(path) for path in nest.stock_of(layout).paths)
    sheet = outline.difference(shapely.union_all(holes)) if holes else outline
    clear = clear_of(spacing) + _COARSE
    shells = [polygon_of(p.placed(nest.parts[p.part].outline)) for p in layout.placements]
    # Sharp corners stay sharp: beside a round one a strip could not be cut off straight.
    kept_clear = [shell.buffer(clear, join_style="mitre", mitre_limit=_MITRE) for shell in shells]
    rest = sheet.difference(shapely.union_all(kept_clear))
    whole = _without_strips(rest, least).simplify(_COARSE)
    pieces = [piece for piece in shapely.get_parts(whole) if not piece.buffer(-0.5 * least).is_empty]
    pieces.sort(key=lambda piece: (-round(piece.area, 3), piece.bounds))
    return [_as_stock(piece, f"{name}_{number}") for number, piece in enumerate(pieces, 1)]


def _without_strips(region: Any, least: float) -> Any:
    """Return where a disc of diameter `least` has room in a region, and the corners beside it that are not acute."""
    radius = 0.5 * least
    inner = region.buffer(-radius, join_style="mitre", mitre_limit=_MITRE)
    discs = inner.buffer(radius)
    corners = shapely.get_parts(inner.buffer(radius, join_style="mitre", mitre_limit=_MITRE).difference(discs))
    wide = [c for c in corners if _reach(c, inner) <= _RIGHT_ANGLE * radius]
    return shapely.union_all([discs, *wide]).intersection(region)


def _reach(corner: Any, inner: Any) -> float:
    """Return how far a corner reaches from a region, mm."""
    return float(shapely.distance(shapely.points(shapely.get_coordinates(corner)), inner).max(initial=0.0))


def _as_stock(piece: Any, name: str) -> KeptRemnant:
    x0, y0, x1, y1 = piece.bounds
    rings = [piece.exterior, *piece.interiors]
    paths = [Polyline.of_points([(x - x0, y - y0) for x, y in ring.coords[:-1]], closed=True) for ring in rings]
    return Stock(x1 - x0, y1 - y0, 1, None, tuple(paths), name), (x0, y0)
