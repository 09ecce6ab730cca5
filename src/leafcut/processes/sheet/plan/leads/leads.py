"""Leads: how a cut comes to its contour and leaves it, and whether there is room for that in the scrap.

Seen from where a lead meets its contour, travel is along +u and the scrap on the side of +v. A line comes from
(−L·cos a, L·sin a); an arc of radius L/a is tangent to the contour and turns by a.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Mask, Point, Points
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.tiles import Tiles
from leafcut.model.cutting import Lead
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.cut_contours import FLATNESS, ROUNDING, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules

#: The least lead is so many kerfs long, and so many mm: the pierce's hole must not reach the part.
LEAST_KERFS, LEAST_LEAD = 1.0, 0.2
#: Parts are taken so much smaller than they are, mm: more than a path beside a part may be too near to it (the offset's
#: tolerance and the chords), less than what the proof lets pass.
SMALLER = 0.02


@lru_cache(maxsize=4096)
def lead_shape(lead: Lead) -> Points:
    """Return the points (u, v) of a lead-in, float64[k, 2], mm, the last one at (0, 0)."""
    if lead.style == "none" or lead.length <= 0.0:
        return np.zeros((1, 2))
    if lead.style == "line":
        return np.array([[-lead.length * math.cos(lead.angle), lead.length * math.sin(lead.angle)], [0.0, 0.0]])
    radius = lead.length / lead.angle
    step = 2.0 * math.acos(max(1.0 - FLATNESS / radius, 0.5))
    turn = np.linspace(lead.angle, 0.0, max(math.ceil(lead.angle / step), 1) + 1)
    arc = np.column_stack([-radius * np.sin(turn), radius * (1.0 - np.cos(turn))])
    if lead.run_in <= 0.0:
        return arc
    along = np.array([math.cos(lead.angle), -math.sin(lead.angle)])
    return np.vstack([arc[0] - lead.run_in * along, arc])


def placed(shape: Points, at: Points, travel: Points, left: bool, out: bool = False) -> NDArray[np.float64]:
    """Return a lead's points at n places, float64[n, k, 2]; `out`: as a lead-out, from the contour on.

    Parameters
    ----------
    shape
        Of `lead_shape`.
    at, travel
        Where the lead meets the contour, and the direction of travel there (unit vectors): float64[n, 2].
    left
        True: the scrap is to the left of travel.
    """
    u, v = shape[:, 0], shape[:, 1]
    if out:
        u, v = -u[::-1], v[::-1]
    normal = np.column_stack([-travel[:, 1], travel[:, 0]]) * (1.0 if left else -1.0)
    points: NDArray[np.float64] = (
        at[:, None, :] + u[None, :, None] * travel[:, None, :] + v[None, :, None] * normal[:, None, :]
    )
    return points


def lead_path(lead: Lead, at: Point, travel: Point, left: bool, out: bool = False) -> Polyline | None:
    """Return a lead at one place as a path in the direction of travel; None for no lead."""
    ends = placed(lead_shape(lead), np.array([at]), np.array([travel]), left, out)[0]
    if len(ends) < 2:
        return None
    bulge = 0.0 if lead.style == "line" else math.tan(0.25 * lead.angle) * (1.0 if left else -1.0)
    arc = [[*ends[0], bulge], [*ends[-1], 0.0]]
    if lead.run_in > 0.0 and lead.style == "arc":
        arc = [[*ends[0], 0.0], [*ends[1], bulge], arc[1]]
        if out:
            arc = [[*ends[0], bulge], [*ends[-2], 0.0], [*ends[-1], 0.0]]
    return Polyline(np.array(arc))


def ways_to_lead(lead: Lead, kerf: float) -> list[Lead]:
    """Return a lead and what may stand in for it where there is no room: shorter, at another angle, of another style.

    Between leads of one length the one that comes in with the travel is before the one that comes against it.
    """
    if lead.style == "none":
        return [lead]
    least = max(LEAST_KERFS * kerf, LEAST_LEAD)
    ways = [replace(lead, length=max(share * lead.length, least)) for share in (1.0, 0.7, 0.45)]
    if lead.run_in > 0.0:
        return list(dict.fromkeys(ways))
    for share in (1.0, 0.7, 0.45, 0.3):
        length = max(share * lead.length, least)
        ways += [Lead("line", length, math.radians(angle)) for angle in (90.0, 60.0, 120.0, 35.0, 145.0)]
    ways += [Lead("line", least, math.radians(angle)) for angle in (90.0, 60.0, 120.0)]
    return list(dict.fromkeys(ways))


class Scrap:
    """What there is between the parts: says whether something fits into it.

    The parts are taken `SMALLER` mm smaller than they are, so that a kerf that touches its own part is not in the way.
    """

    def __init__(self, sheet: Sheet, contours: list[CutContour], rules: CutRules) -> None:
        self.rules = rules
        self.contours = contours
        self.parts, self.part_numbers = _materials(sheet)
        self._metal = Tiles(self.parts)
        cut = [c for c in contours if c.kind == "cut"]
        self._line_owner = np.array([c.index for c in cut], dtype=np.int64)
        self._kerfs = Tiles([c.line for c in cut])
        self.zones = [shapely.box(*zone) for zone in sheet.zones]
        self._zone_tree = shapely.STRtree(self.zones)
        rings = [path.flattened(FLATNESS) for path in sheet.paths]
        outline = shapely.Polygon(rings[0], rings[1:]) if rings else None
        self.sheet = outline
        self.inner = None if outline is None else outline.buffer(-(self._half - ROUNDING))
        if self.inner is not None:
            shapely.prepare(self.inner)
        self.bridge_owners = np.zeros((0, 2), dtype=np.int64)
        self._bridge_tree: Any = None

    def with_bridges(self, lines: Any, owners: NDArray[np.int64]) -> Scrap:
        """Return the same scrap with bridges in it (shapely lines): others keep away from them.

        `owners` is int64[n, 2]: the contours (indices in `Sheet.contours`) that each joins.
        """
        other = copy(self)
        other.bridge_owners = np.asarray(owners, dtype=np.int64).reshape(-1, 2)
        other._bridge_tree = shapely.STRtree(lines)  # noqa: SLF001  # of its own class
        return other

    @property
    def _half(self) -> float:
        """Half a kerf: what a lead sweeps to each side, whoever compensates."""
        return 0.5 * self.rules.kerf

    def free(self, lines: Any, *owners: CutContour, leaves_sheet: bool = False) -> Mask:
        """Return which lines (shapely, n of them) the torch may follow on behalf of a contour, or of two, bool[n].

        The kerf of a line touches no part, no clamp, no kerf of other contours and no bridge between those, and stays
        on the sheet.
        """
        own = [c.index for c in owners]
        lines = np.asarray(lines, dtype=object)
        ok = np.ones(len(lines), dtype=bool)
        # Where nobody compensates, a lead ends on the part's edge itself.
        reach = self._half if self.rules.half > 0.0 else 0.0
        ok[self._metal.near(lines, reach)[0]] = False
        pairs = self._kerfs.near(lines, 2.0 * self._half - ROUNDING)
        ok[pairs[0][~np.isin(self._line_owner[pairs[1]], own)]] = False
        if len(self.bridge_owners):
            pairs = self._bridge_tree.query(lines, predicate="dwithin", distance=2.0 * self._half - ROUNDING)
            ok[pairs[0][~np.isin(self.bridge_owners[pairs[1]], own).any(axis=1)]] = False
        ok[self.zones_near(lines)[0]] = False
        if self.inner is not None and not leaves_sheet:
            ok &= shapely.contains(self.inner, lines)
        return ok

    def parts_near(self, lines: Any) -> NDArray[np.int64]:
        """Return pairs of a line and a part that the kerf along it touches, int64[2, k]."""
        return self._metal.near(lines, self._half)

    def zones_near(self, lines: Any) -> NDArray[np.int64]:
        """Return pairs of a line and a forbidden zone that the kerf along it touches, int64[2, k]."""
        return np.asarray(self._zone_tree.query(lines, predicate="dwithin", distance=self._half))

    def clear(self, places: Points, radius: float) -> Mask:
        """Return round which places (float64[n, 2]) there is no part within `radius`, bool[n]."""
        ok = np.ones(len(places), dtype=bool)
        if radius > 0.0:
            ok[self._metal.near(shapely.points(places), radius - ROUNDING)[0]] = False
        return ok

    def leaves_once(self, leads: NDArray[np.float64], owner: CutContour) -> Mask:
        """Return which lead-ins (float64[n, k, 2], the last point on the contour) keep away from their contour's kerf.

        Going outwards, the way from a lead to its own contour may only grow until the two kerfs are apart; from there
        on they must stay apart.
        """
        fine = _dense(leads, 0.25 * self.rules.kerf)
        away = shapely.distance(shapely.points(fine), owner.line)
        apart = away >= self.rules.kerf - ROUNDING
        left = np.maximum.accumulate(apart, axis=1)
        # The pierce itself is half a kerf away at least: its hole would reach the part else.
        ok: Mask = (apart | ~left).all(axis=1) & (away[:, -1] >= self._half - ROUNDING)
        return ok


def _dense(leads: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return leads with points put in between, from the contour outwards: float64[n, m, 2]."""
    outwards = leads[:, ::-1]
    longest = np.hypot(*np.moveaxis(np.diff(outwards, axis=1), 2, 0)).max(initial=0.0)
    pieces = min(max(math.ceil(longest / step), 1), 64)
    shares = np.arange(pieces) / pieces
    rows = outwards[:, :-1, None, :] + shares[None, None, :, None] * np.diff(outwards, axis=1)[:, :, None, :]
    flat = rows.reshape(len(leads), -1, 2)
    return np.concatenate([flat, outwards[:, -1:]], axis=1)


def _materials(sheet: Sheet) -> tuple[list[Any], list[int]]:
    """Return every part as a shapely polygon with its holes, a little smaller than it is, and its number."""
    rings = {
        i: shapely.LinearRing(c.contour.path.flattened(FLATNESS))
        for i, c in enumerate(sheet.contours)
        if c.contour.kind == "cut" and c.contour.path.closed and c.contour.path.n_segments > 1
    }
    holes: dict[int, list[Any]] = {}
    for i, c in enumerate(sheet.contours):
        if i in rings and c.is_hole:
            holes.setdefault(c.parent, []).append(rings[i])
    outlines = [i for i in rings if not sheet.contours[i].is_hole]
    solid = [shapely.Polygon(rings[i], holes.get(i, [])) for i in outlines]
    smaller = shapely.buffer(np.array(solid, dtype=object), -SMALLER, quad_segs=2)
    return list(smaller), [sheet.contours[i].part for i in outlines]


def as_lines(leads: NDArray[np.float64]) -> Any:
    """Return leads (float64[n, k, 2]) as shapely lines."""
    return shapely.linestrings(leads)
