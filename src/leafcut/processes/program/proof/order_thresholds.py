"""Thresholds of the order rules. In doubt, one policy keeps the order, and the other policy allows any order."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OrderThresholds:
    """Thresholds of the order rules.

    Attributes
    ----------
    keep
        Whether to keep an order that may matter. In that case, several lines need not form a ring to enclose an area,
        and a line with very many points encloses its convex hull.
    sagitta
        Maximum distance of an arc from its chords, mm.
    gap, open_part
        A line counts as closed if the gap between its ends is at most `gap`, mm, or at most this part of its length.
    alone
        Maximum gap between the ends of a line that is certainly closed, mm.
    still
        A move up to this length does not count as sideways, mm. Rounding may cause such a drift in a plunge.
    width
        Assumed width of an unknown tool, mm. Passes at different depths keep their order if they are within this
        distance of each other.
    beside, beside_part
        Two passes at the same depth run side by side if at least the part `beside_part` of the shorter pass is within
        `beside`, mm, of the other pass.
    lean, widening
        Rows are parallel if they diverge by at most the part `lean` of their length, and their spacing grows by at most
        the factor `widening`.
    through, surely_through, around_through
        Distances from the deepest cut, mm. Within `through`, a cut may go through the material. Within
        `surely_through`, it certainly goes through. Within `around_through`, it is an outline that may contain scrap.
    area, sure_area
        Minimum area of a part that may be detached, and of a part that is certainly detached, mm².
    tab
        Minimum height of a tab, mm. A lower rise belongs to the lowest level.
    smaller
        An area inside another area is separate if it is smaller than this part of the outer area. Otherwise, both areas
        are passes of the same outline.
    same_depth
        Parts may be detached in any order if the depths of their outlines differ by at most this distance, mm.
    """

    keep: bool
    sagitta: float
    gap: float
    open_part: float
    alone: float
    still: float
    width: float
    beside: float
    beside_part: float
    lean: float
    widening: float
    through: float
    surely_through: float
    around_through: float
    area: float
    sure_area: float
    tab: float
    smaller: float
    same_depth: float


#: In doubt, keep the order. Few tools of desktop machines and routers are wider than 12.7 mm (half an inch).
KEEP = OrderThresholds(
    keep=True,
    sagitta=0.02,
    gap=0.05,
    open_part=0.1,
    alone=0.005,
    still=1e-6,
    width=12.7,
    beside=1.0,
    beside_part=0.45,
    lean=0.02,
    widening=1.05,
    through=1.0,
    surely_through=1.0,
    around_through=0.6,
    area=1.0,
    sure_area=1.0,
    tab=0.2,
    smaller=0.95,
    same_depth=0.01,
)
#: In doubt, allow any order.
FREE = OrderThresholds(
    keep=False,
    sagitta=0.002,
    gap=0.01,
    open_part=0.0,
    alone=0.01,
    still=0.01,
    width=6.0,
    beside=0.99,
    beside_part=0.55,
    lean=0.015,
    widening=1.01,
    through=1.1,
    surely_through=0.9,
    around_through=0.4,
    area=0.5,
    sure_area=1.5,
    tab=0.15,
    smaller=0.94,
    same_depth=0.02,
)
