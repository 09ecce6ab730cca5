"""Thresholds of the order rules: in doubt the order of two pieces of work is kept, or it is free."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Doubt:
    """The thresholds of the rules.

    Attributes
    ----------
    keep
        In doubt the order is kept. A line of very many points then encloses its convex hull, and several lines need not
        form a ring to enclose an area.
    sagitta
        Largest distance of an arc from its chords, mm.
    gap, open_part
        A line is closed if the distance of its ends is within `gap`, mm, or within this part of its length.
    alone
        A line with a smaller gap, mm, is closed for certain.
    still
        Shorter moves are not sideways, mm: a plunge may drift by rounding.
    width
        Of a tool whose width is unknown, mm: passes at different depths keep their order within it.
    beside, beside_part
        Passes at one depth run side by side if this part of the shorter one is within this distance of the other, mm.
    lean, widening
        Rows are parallel within this part of their length; each is at most this factor farther than the one before.
    through, surely_through, around_through
        A cut within these distances of the deepest one, mm, may be through the material, is through for certain, and
        is an outline in which a piece of scrap may lie.
    area, sure_area
        Smallest area of a part, mm²: of one that may be cut free, and of one that is for certain.
    tab
        Height of a tab, mm: lower rises belong to the lowest level.
    smaller
        An area within another one is smaller than this part of it; otherwise both are passes of one outline.
    same_depth
        Parts whose outlines differ in depth by no more, mm, may come free in any order.
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


#: 12.7 mm (half an inch) is wider than the tools of desktop machines and of most routers.
KEEP = Doubt(
    keep=True, sagitta=0.02, gap=0.05, open_part=0.1, alone=0.005, still=1e-6,
    width=12.7, beside=1.0, beside_part=0.45, lean=0.02, widening=1.05,
    through=1.0, surely_through=1.0, around_through=0.6, area=1.0, sure_area=1.0, tab=0.2, smaller=0.95,
    same_depth=0.01,
)  # fmt: skip
FREE = Doubt(
    keep=False, sagitta=0.002, gap=0.01, open_part=0.0, alone=0.01, still=0.01,
    width=6.0, beside=0.99, beside_part=0.55, lean=0.015, widening=1.01,
    through=1.1, surely_through=0.9, around_through=0.4, area=0.5, sure_area=1.5, tab=0.15, smaller=0.94,
    same_depth=0.02,
)  # fmt: skip
