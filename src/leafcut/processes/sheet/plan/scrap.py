"""The scrap between the parts, with checks of whether a lead, a bridge or a pierce fits into it."""

from __future__ import annotations

import math
from copy import copy
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Mask, Points
from leafcut.geometry.index import ShapeIndex
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.contours import ROUNDING, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads import FLATNESS

#: Parts are shrunk by this distance, mm. It is larger than the error of an offset path made of chords, and smaller than
#: the tolerance of the verification.
PART_SHRINKAGE = 0.02


class Scrap:
    """The scrap between the parts of a sheet.

    The parts are shrunk slightly. Otherwise, the kerf along a part would seem to touch that part.
    """

    def __init__(self, sheet: Sheet, contours: list[CutContour], rules: CutRules) -> None:
        self.rules = rules
        self.contours = contours
        self.parts, self.part_numbers = _part_polygons(sheet)
        self._metal = ShapeIndex(self.parts)
        cut = [c for c in contours if c.kind == "cut"]
        self._line_owner = np.array([c.index for c in cut], dtype=np.int64)
        self._kerfs = ShapeIndex([c.line for c in cut])
        self.zones = [shapely.box(*zone) for zone in sheet.zones]
        self._zone_tree = shapely.STRtree(self.zones)
        rings = [path.flattened(FLATNESS) for path in sheet.paths]
        outline = shapely.Polygon(rings[0], rings[1:]) if rings else None
        self.sheet = outline
        self.inner = None if outline is None else outline.buffer(-(self._half_kerf - ROUNDING))
        if self.inner is not None:
            shapely.prepare(self.inner)
        self.bridge_owners = np.zeros((0, 2), dtype=np.int64)
        self._bridge_tree: Any = None

    def with_bridges(self, lines: Any, owners: NDArray[np.int64]) -> Scrap:
        """Add bridges as obstacles that other cuts must avoid.

        `owners`, int64[n, 2], contains the two contours that each bridge connects.
        """
        other = copy(self)
        other.bridge_owners = np.asarray(owners, dtype=np.int64).reshape(-1, 2)
        other._bridge_tree = shapely.STRtree(lines)  # noqa: SLF001  # of its own class
        return other

    @property
    def _half_kerf(self) -> float:
        """Half the width of the kerf that a lead leaves, mm. It does not matter whether the kerf is compensated."""
        return 0.5 * self.rules.kerf

    def allowed_mask(self, lines: Any, *owners: CutContour, leaves_sheet: bool = False) -> Mask:
        """Return a mask of the lines, bool[n], that the torch may follow when it cuts the contours `owners`.

        The kerf along an allowed line touches no part, no clamp, and no kerf or bridge of another contour. It also
        stays on the sheet, unless `leaves_sheet` is set.
        """
        own = [c.index for c in owners]
        lines = np.asarray(lines, dtype=object)
        ok = np.ones(len(lines), dtype=bool)
        # Without compensation, a lead ends on the edge of its own part.
        reach = self._half_kerf if self.rules.half > 0.0 else 0.0
        ok[self._metal.pairs_near(lines, reach)[0]] = False
        pairs = self._kerfs.pairs_near(lines, 2.0 * self._half_kerf - ROUNDING)
        ok[pairs[0][~np.isin(self._line_owner[pairs[1]], own)]] = False
        if len(self.bridge_owners):
            pairs = self._bridge_tree.query(lines, predicate="dwithin", distance=2.0 * self._half_kerf - ROUNDING)
            ok[pairs[0][~np.isin(self.bridge_owners[pairs[1]], own).any(axis=1)]] = False
        ok[self.zones_near(lines)[0]] = False
        if self.inner is not None and not leaves_sheet:
            ok &= shapely.contains(self.inner, lines)
        return ok

    def parts_near(self, lines: Any) -> NDArray[np.int64]:
        """Return pairs (line, part), int64[2, k], in which the kerf along the line touches the part."""
        return self._metal.pairs_near(lines, self._half_kerf)

    def zones_near(self, lines: Any) -> NDArray[np.int64]:
        """Return pairs (line, keep-out zone), int64[2, k], in which the kerf along the line touches the zone."""
        return np.asarray(self._zone_tree.query(lines, predicate="dwithin", distance=self._half_kerf))

    def clear_mask(self, places: Points, radius: float) -> Mask:
        """Return a mask of the points, float64[n, 2], that have no part within `radius` mm."""
        ok = np.ones(len(places), dtype=bool)
        if radius > 0.0:
            ok[self._metal.pairs_near(shapely.points(places), radius - ROUNDING)[0]] = False
        return ok

    def mask_leaving_own_kerf(self, leads: NDArray[np.float64], owner: CutContour) -> Mask:
        """Return a mask of the lead-ins that do not re-enter the kerf of their own contour.

        `leads`, float64[n, k, 2], end on the contour.
        """
        fine = _with_extra_points(leads, 0.25 * self.rules.kerf)
        away = shapely.distance(owner.line, shapely.points(fine))
        apart = away >= self.rules.kerf - ROUNDING
        left = np.maximum.accumulate(apart, axis=1)
        # The pierce must be at least half a kerf away; otherwise its hole would reach the part.
        ok: Mask = (apart | ~left).all(axis=1) & (away[:, -1] >= self._half_kerf - ROUNDING)
        return ok


def _with_extra_points(leads: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Insert points into leads so that neighbouring points are at most `step` mm apart.

    The result is float64[n, m, 2], and each lead starts at the contour.
    """
    outwards = leads[:, ::-1]
    longest = np.hypot(*np.moveaxis(np.diff(outwards, axis=1), 2, 0)).max(initial=0.0)
    pieces = min(max(math.ceil(longest / step), 1), 64)
    shares = np.arange(pieces) / pieces
    rows = outwards[:, :-1, None, :] + shares[None, None, :, None] * np.diff(outwards, axis=1)[:, :, None, :]
    flat = rows.reshape(len(leads), -1, 2)
    return np.concatenate([flat, outwards[:, -1:]], axis=1)


def _part_polygons(sheet: Sheet) -> tuple[list[Any], list[int]]:
    """Convert the parts to slightly shrunk shapely polygons with holes. Return the polygons and the part numbers."""
    rings = {
        i: shapely.LinearRing(c.path.flattened(FLATNESS))
        for i, c in enumerate(sheet.contours)
        if c.kind == "cut" and c.path.closed and c.path.n_segments > 1
    }
    holes: dict[int, list[Any]] = {}
    for i, c in enumerate(sheet.contours):
        if i in rings and c.is_hole:
            holes.setdefault(c.parent, []).append(rings[i])
    outlines = [i for i in rings if not sheet.contours[i].is_hole]
    solid = [shapely.Polygon(rings[i], holes.get(i, [])) for i in outlines]
    smaller = shapely.buffer(np.array(solid, dtype=object), -PART_SHRINKAGE, quad_segs=2)
    return list(smaller), [sheet.contours[i].part for i in outlines]
