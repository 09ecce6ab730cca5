"""Isolation: the tool follows copper at its effective radius, so that it cuts a groove around each copper shape."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from leafcut.geometry.regions import as_polyline, chords_per_quarter, polygons
from leafcut.message import Message
from leafcut.processes.part.model import Edge, Engraving, Isolation
from leafcut.processes.part.plan.engraving import EngravingTask
from leafcut.processes.part.plan.finishing import index_of_areas

#: Maximum distance that the groove enters the copper, so that a gap of exactly its width is cut, mm.
_SLACK = 0.004
#: Chord error and tolerance of the path, mm.
_FINE, _TOLERANCE = 0.001, 0.001


def isolation_tasks(
    isolations: Sequence[Isolation], edges: Sequence[Edge], step: float, climb: bool
) -> list[EngravingTask]:
    """Create the isolation tasks of one tool. Each pass is at most `step` mm deep."""
    areas = index_of_areas(edges)
    tasks = []
    for one in isolations:
        for offset in one.offsets:
            grown = one.copper.buffer(offset - _SLACK, quad_segs=chords_per_quarter(offset, _FINE))
            for piece in polygons(grown.simplify(_TOLERANCE)):
                oriented = orient(piece, -1.0 if climb else 1.0)
                for ring in (oriented.exterior, *oriented.interiors):
                    path = as_polyline(ring.coords, closed=True)
                    name = Message("the isolation at ({:.4g}, {:.4g}) on layer {}", *path.start, one.layer)
                    groove = Engraving(path, one.depth, one.tool, name, one.layer)
                    later = np.sort(areas.query(ring, predicate="intersects")).tolist()
                    tasks.append(EngravingTask(groove, max(math.ceil(one.depth / step - 1e-9), 1), tuple(later)))
    return tasks


def narrow_gaps(isolation: Isolation) -> list[tuple[float, float]]:
    """Return a place in each gap between two copper shapes that is narrower than the groove, mm."""
    pieces = np.array(polygons(isolation.copper), dtype=object)
    reach = 2.0 * (isolation.radius - _SLACK)
    pairs = shapely.STRtree(pieces).query(pieces, predicate="dwithin", distance=reach).T
    lines = [shapely.shortest_line(pieces[a], pieces[b]) for a, b in pairs.tolist() if a < b]
    return [tuple(line.interpolate(0.5, normalized=True).coords[0]) for line in lines]
