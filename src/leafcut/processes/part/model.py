"""The edges of a part, the request that planner and judge share, and the results of milling."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline

#: Maximum distance of chords from the arcs of the drawing, mm.
CHORD = 0.002
#: Minimum length of tool path for each tab, in lengths of a tab interval: two thirds remain free for cuts.
_SHARE = 3.0


@dataclass(frozen=True)
class Edge:
    """A closed edge of the finished part, mm.

    `inside` marks an opening, in which the tool runs inside the edge. `within` contains the indices of the edges around
    this edge, in no order; they are milled later. `layer` is the layer in the drawing. `is_bore` marks a round hole no
    wider than two diameters of the mill: it leaves no slug, so it needs no tabs. `tabs` is the number of tabs of an
    outline.
    """

    path: Polyline
    inside: bool
    within: tuple[int, ...] = ()
    name: str = ""
    layer: str = ""
    is_bore: bool = False
    tabs: int = 0


def shape_of(edge: Edge) -> shapely.Polygon:
    """Return the area inside an edge."""
    return shapely.Polygon(edge.path.flattened(CHORD))


def material_of(edges: Sequence[Edge]) -> Any:
    """Return the area of the finished part, prepared for queries."""
    material: Any = shapely.Polygon()
    # An inner edge always has a smaller area than the edge around it.
    for shape, inside in sorted(((shape_of(edge), edge.inside) for edge in edges), key=lambda pair: -pair[0].area):
        material = material.difference(shape) if inside else material.union(shape)
    shapely.prepare(material)
    return material


@dataclass(frozen=True)
class Engraving:
    """A path to engrave: its depth below the top, mm, the number of the tool, and its name and layer."""

    path: Polyline
    depth: float
    tool: int
    name: str = ""
    layer: str = ""

    @cached_property
    def line(self) -> shapely.LineString:
        """The engraved path; a ring if it is closed."""
        points = self.path.flattened(CHORD)
        return shapely.LinearRing(points) if self.path.closed else shapely.LineString(points)


@dataclass(frozen=True)
class PocketMill:
    """The end mill of a pocket: its number, its radius and largest step-down, mm, and its largest feed in material,
    mm/s.
    """

    tool: int
    radius: float
    step: float
    feed: float


@dataclass(frozen=True)
class PocketArea:
    """A closed area to clear to a depth below the top, mm, except for its islands; its name and layer.

    `mill` is None for the end mill of the part.
    """

    outline: Polyline
    islands: tuple[Polyline, ...]
    depth: float
    name: str = ""
    layer: str = ""
    mill: PocketMill | None = None

    @cached_property
    def region(self) -> shapely.Polygon:
        """The area without its islands."""
        return shapely.Polygon(self.outline.flattened(CHORD), [island.flattened(CHORD) for island in self.islands])


@dataclass(frozen=True)
class TabRules:
    """Tabs on an edge: requested number, width between the cuts, and height above the underside of the plate, mm."""

    count: int
    width: float
    height: float

    @property
    def fewest(self) -> int:
        """Minimum number of tabs on an outline."""
        return min(self.count, 2)

    def number_on(self, length: float, diameter: float) -> int:
        """Return the number of tabs that fit on a tool path of `length` mm; at most the requested number."""
        return min(self.count, math.floor(length / (_SHARE * (self.width + diameter)) + 1e-9))

    def width_of_fewest(self, length: float, diameter: float) -> float:
        """Return the largest tab width, mm, at which the minimum number of tabs fits on a path of `length` mm."""
        return math.floor(10.0 * (length / (_SHARE * self.fewest) - diameter)) / 10.0

    @property
    def web(self) -> float:
        """Minimum width of the material beyond the cut that holds a tab, mm."""
        return 0.5 * self.width

    def area(
        self, start: Point, end: Point, middle: Point, radius: float, finish: float, *, waste_left: bool
    ) -> shapely.Polygon:
        """Return the area that must remain of a tab: from the edge of the part across the cut, which is wider by the
        allowance `finish`, to the web.

        The cuts end at `start` and `end`, and `middle` lies between these points on the tool path. If `waste_left`, the
        web is on the left, looking from the start to the end.
        """
        along = np.subtract(end, start) / max(math.dist(start, end), 1e-9)
        across = np.array([-along[1], along[0]]) * (1.0 if waste_left else -1.0)
        half, part, waste = 0.5 * self.width * along, -radius * across, (radius + finish + self.web) * across
        return shapely.Polygon(middle + np.array([part - half, part + half, waste + half, waste - half]))


@dataclass(frozen=True)
class PartHole:
    """A hole through the plate for a drill: its centre, the tool, and the lowest height of the tip, mm."""

    x: float
    y: float
    tool: int
    tip: float


@dataclass(frozen=True)
class PartRequest:
    """The work of the program: edges to mill through the plate, with tabs, holes to drill, paths to engrave, and
    pockets to clear.

    `bottom` is the lowest height of the mill, and `thickness` the thickness of the plate, mm. `sheet` is the area of
    the plate, None if it is unknown. `step` is the largest step-down in pockets, mm, and `feed` the largest feed in
    material there, mm/s. `finish` is the allowance that roughing leaves on walls, mm; with it, a pass along each wall
    follows, in the direction of `climb` milling or against it.
    """

    edges: tuple[Edge, ...]
    holes: tuple[PartHole, ...]
    tool: int
    radius: float
    thickness: float
    bottom: float
    tabs: TabRules
    sheet: shapely.Polygon | None = None
    engravings: tuple[Engraving, ...] = ()
    pockets: tuple[PocketArea, ...] = ()
    step: float = math.inf
    feed: float = math.inf
    finish: float = 0.0
    climb: bool = True

    def mill_of(self, pocket: PocketArea) -> PocketMill:
        """Return the end mill of a pocket."""
        return pocket.mill or PocketMill(self.tool, self.radius, self.step, self.feed)


@dataclass(frozen=True)
class LayerWork:
    """The work of a layer: number of shapes, operation, depth, mm (0 for none), and label of the tool ("" for none)."""

    layer: str
    shapes: int
    operation: str
    depth: float
    tool: str


@dataclass(frozen=True)
class PartDetail:
    """Numbers of milled outlines and openings, drilled holes and tabs; thickness and heights of rapids, mm.

    `layers` contains the work of each layer.
    """

    outlines: int
    openings: int
    holes: int
    tabs: int
    thickness: float
    clearance: float
    retract: float
    layers: tuple[LayerWork, ...] = ()
