"""Shapes of lead-ins and lead-outs.

A lead meets its contour at the origin of a local coordinate system. The u axis is the direction of travel, and the v
axis points into the scrap. A straight lead of length L and angle a starts at (−L·cos a, L·sin a). An arc of length L
and angle a has the radius L/a and touches the contour tangentially.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Lead

#: Chord error for arcs, mm.
FLATNESS = 0.005
#: Minimum length of a lead, in kerf widths and in mm. If a lead were shorter, its pierce hole would reach the part.
LEAST_KERFS, LEAST_LEAD = 1.0, 0.2
NO_LEAD = Lead()


@lru_cache(maxsize=4096)
def lead_shape(lead: Lead) -> Points:
    """Return the points (u, v) of a lead-in, float64[k, 2], mm. The lead ends at (0, 0)."""
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


def place_leads(shape: Points, at: Points, travel: Points, left: bool, out: bool = False) -> NDArray[np.float64]:
    """Place a lead at n positions along contours, and return its points, float64[n, k, 2], mm.

    Parameters
    ----------
    shape
        A result of `lead_shape`.
    at
        Points where the lead meets the contour, float64[n, 2], mm.
    travel
        Unit vectors of travel at these points, float64[n, 2].
    left
        Whether the scrap is to the left of the direction of travel.
    out
        Whether to place a lead-out instead of a lead-in.
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
    """Return a lead as a path in the direction of travel, or None if the lead has no length."""
    ends = place_leads(lead_shape(lead), np.array([at]), np.array([travel]), left, out)[0]
    if len(ends) < 2:
        return None
    bulge = 0.0 if lead.style == "line" else math.tan(0.25 * lead.angle) * (1.0 if left else -1.0)
    arc = [[*ends[0], bulge], [*ends[-1], 0.0]]
    if lead.run_in > 0.0 and lead.style == "arc":
        arc = [[*ends[0], 0.0], [*ends[1], bulge], arc[1]]
        if out:
            arc = [[*ends[0], bulge], [*ends[-2], 0.0], [*ends[-1], 0.0]]
    return Polyline(np.array(arc))


def lead_variants(lead: Lead, kerf: float) -> list[Lead]:
    """Return a lead, followed by alternatives for narrow scrap: shorter leads, other angles and other styles."""
    if lead.style == "none":
        return [lead]
    least = max(LEAST_KERFS * kerf, LEAST_LEAD)
    found = [replace(lead, length=max(share * lead.length, least)) for share in (1.0, 0.7, 0.45)]
    if lead.run_in > 0.0:
        return list(dict.fromkeys(found))
    for share in (1.0, 0.7, 0.45, 0.3):
        length = max(share * lead.length, least)
        found += [Lead("line", length, math.radians(angle)) for angle in (90.0, 60.0, 120.0, 35.0, 145.0)]
    found += [Lead("line", least, math.radians(angle)) for angle in (90.0, 60.0, 120.0)]
    return list(dict.fromkeys(found))


def leads_as_lines(leads: NDArray[np.float64]) -> Any:
    """Return leads, float64[n, k, 2], as an array of shapely lines."""
    return shapely.linestrings(leads)
