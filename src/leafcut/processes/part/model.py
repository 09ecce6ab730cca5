"""The edges of a part, the request that both the planner and the verification use, and the results of milling."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.model.tool import Tool
from leafcut.model.toolpath import FIRST_OFFSET

#: Maximum chord error when arcs of the drawing become lines, mm.
CHORD = 0.002
#: Minimum distance between the cuts along two parts without tabs, mm. The verification locates a cut with an accuracy
#: of 0.03 mm, and assigns it to the edge that it follows.
_APART = 0.1
#: Distance between two passes of an isolation, in radii of the tool: they overlap by a fifth of their width.
PASS = 1.6
#: Minimum path length for each tab, as a multiple of the tab interval. Two thirds of the path remain for cutting.
_SHARE = 3.0


@dataclass(frozen=True)
class Edge:
    """A closed edge of the finished part.

    Attributes
    ----------
    path
        The edge, mm.
    inside
        Whether the edge is an opening, so that the tool runs inside it.
    within
        Indices of the edges around this edge, in any order. They are milled later.
    name, layer
        Name for messages, and layer in the drawing.
    is_bore
        Whether the edge is a round hole of at most two mill diameters. Such a hole leaves no slug, so it needs no tabs.
    tabs
        Number of tabs on an outline.
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
    """Return the area of the finished part as a prepared shapely geometry."""
    material: Any = shapely.Polygon()
    # An inner edge always has a smaller area than the edge around it.
    for shape, inside in sorted(((shape_of(edge), edge.inside) for edge in edges), key=lambda pair: -pair[0].area):
        material = material.difference(shape) if inside else material.union(shape)
    shapely.prepare(material)
    return material


@dataclass(frozen=True)
class Engraving:
    """A path to engrave, with its depth below the top, mm, tool number, name and layer."""

    path: Polyline
    depth: float
    tool: int
    name: str = ""
    layer: str = ""

    @cached_property
    def line(self) -> shapely.LineString:
        """The path as a shapely line, which is a ring if the path is closed."""
        points = self.path.flattened(CHORD)
        return shapely.LinearRing(points) if self.path.closed else shapely.LineString(points)


@dataclass(frozen=True)
class PocketMill:
    """The end mill that clears a pocket.

    It has a tool number, a radius and a maximum step-down, mm, and a maximum feed in material, mm/s.
    """

    tool: int
    radius: float
    step: float
    feed: float


@dataclass(frozen=True)
class PocketArea:
    """A closed area that is cleared to a depth below the top, mm, except for its islands.

    If `mill` is None, the end mill of the part clears the area. The smaller mill `rest`, if any, then clears the places
    that the first mill cannot reach.
    """

    outline: Polyline
    islands: tuple[Polyline, ...]
    depth: float
    name: str = ""
    layer: str = ""
    mill: PocketMill | None = None
    rest: PocketMill | None = None

    @cached_property
    def region(self) -> shapely.Polygon:
        """The area minus its islands."""
        return shapely.Polygon(self.outline.flattened(CHORD), [island.flattened(CHORD) for island in self.islands])


@dataclass(frozen=True)
class VBit:
    """A V-bit or chamfer mill.

    It has a tool number, a radius and the radius of the flat at its tip, mm. `spread` is the tangent of half the point
    angle, which is the growth of the radius per mm of height.
    """

    tool: int
    radius: float
    tip: float
    spread: float


@dataclass(frozen=True)
class Chamfer:
    """A closed edge whose top is broken.

    Attributes
    ----------
    path
        The drawn edge, mm.
    inside
        Whether the edge is an opening or a hole.
    corner
        Radius of the mill that cuts the edge, mm, which leaves corners with this radius. 0 for a drilled hole.
    width
        Width of the chamfer on the top face, mm.
    """

    path: Polyline
    inside: bool
    corner: float
    width: float
    bit: VBit
    name: str = ""
    layer: str = ""

    @property
    def depth(self) -> float:
        """Height of the chamfer, which is also the depth of the tip of the V-bit, mm."""
        return round(self.width / self.bit.spread, 6)


@dataclass(frozen=True)
class Carving:
    """An area that a V-bit carves to its walls.

    Attributes
    ----------
    area
        The drawn area. Its depth is the depth of the V-bit, mm.
    limit
        Maximum depth, mm.
    flat
        The end mill that clears the floor where the walls would meet below `limit`. If it is None, no shape is that
        wide.
    floors
        The areas of the floor that this end mill can clear. The V-bit clears the rest.
    """

    area: PocketArea
    bit: VBit
    limit: float
    flat: PocketMill | None = None
    floors: tuple[PocketArea, ...] = ()


@dataclass(frozen=True, eq=False)
class Isolation:
    """Copper that grooves separate from everything around it.

    Attributes
    ----------
    copper
        Area of all copper shapes, a shapely geometry.
    depth
        Depth of the groove below the top, mm.
    radius
        Radius of the tool at the top of the plate when it cuts at this depth, mm.
    passes
        Number of passes side by side.
    """

    copper: Any
    depth: float
    tool: int
    radius: float
    passes: int = 1
    layer: str = ""

    @property
    def offsets(self) -> list[float]:
        """Distance of each pass from the copper, mm."""
        return [self.radius * (1.0 + PASS * number) for number in range(self.passes)]


@dataclass(frozen=True)
class TabRules:
    """The tabs on an edge: requested number, width between the cuts, and height above the bottom of the plate, mm."""

    count: int
    width: float
    height: float

    @property
    def fewest(self) -> int:
        """Minimum number of tabs on an outline."""
        return min(self.count, 2)

    def number_on(self, length: float, diameter: float) -> int:
        """Return the number of tabs that fit on a tool path of `length` mm. This is at most the requested number."""
        return min(self.count, math.floor(length / (_SHARE * (self.width + diameter)) + 1e-9))

    def width_of_fewest(self, length: float, diameter: float) -> float:
        """Return the maximum tab width, mm, at which the minimum number of tabs still fits on a path of `length` mm."""
        return math.floor(10.0 * (length / (_SHARE * self.fewest) - diameter)) / 10.0

    def least_gap(self, radius: float, finish: float) -> float:
        """Return the minimum distance between two parts, mm: room for both cuts, and for a tab and its web, if any.

        `radius` is the radius of the mill and `finish` is the finishing allowance, mm.
        """
        return 2.0 * (radius + finish) + (2.0 * radius + self.web if self.count else _APART)

    @property
    def web(self) -> float:
        """Minimum width of the strip beyond the cut that a tab is attached to, mm."""
        return 0.5 * self.width

    def area(
        self, start: Point, end: Point, middle: Point, radius: float, finish: float, *, waste_left: bool
    ) -> shapely.Polygon:
        """Return the area of a tab that no cut may enter. It reaches from the part across the cut into the web.

        Parameters
        ----------
        start, end
            Points on the tool path where the cuts on both sides of the tab end.
        middle
            Point on the tool path halfway between `start` and `end`.
        radius, finish
            Radius of the mill, and finishing allowance, which makes the cut wider, mm.
        waste_left
            Whether the web is on the left, looking from `start` to `end`.
        """
        along = np.subtract(end, start) / max(math.dist(start, end), 1e-9)
        across = np.array([-along[1], along[0]]) * (1.0 if waste_left else -1.0)
        half, part, waste = 0.5 * self.width * along, -radius * across, (radius + finish + self.web) * across
        return shapely.Polygon(middle + np.array([part - half, part + half, waste + half, waste - half]))


@dataclass(frozen=True)
class PartHole:
    """A through hole for a drill, with its centre, its tool, and the lowest height of the drill tip, mm."""

    x: float
    y: float
    tool: int
    tip: float


@dataclass(frozen=True)
class PartRequest:
    """The work that a program must do.

    The program mills `edges` through the plate, leaves tabs, drills holes, engraves paths, clears pockets, cuts
    chamfers, carves shapes and isolates copper.

    Attributes
    ----------
    bottom
        Lowest height of the mill, mm.
    thickness
        Thickness of the plate, mm.
    sheet
        Area of the plate, or None if it is unknown.
    steps
        Maximum step-down of each mill by its number, mm.
    feed
        Maximum feed of the end mill in material inside pockets, mm/s.
    finish
        Allowance that roughing leaves on walls, mm. If it is not 0, a finishing pass follows along each wall.
    climb
        Whether finishing passes use climb milling.
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
    chamfers: tuple[Chamfer, ...] = ()
    carvings: tuple[Carving, ...] = ()
    isolations: tuple[Isolation, ...] = ()
    steps: Mapping[int, float] = field(default_factory=dict)
    feed: float = math.inf
    finish: float = 0.0
    climb: bool = True

    def mill_of(self, pocket: PocketArea) -> PocketMill:
        """Return the end mill of a pocket."""
        return pocket.mill or PocketMill(self.tool, self.radius, self.steps.get(self.tool, math.inf), self.feed)

    def mills_of(self, pocket: PocketArea) -> list[PocketMill]:
        """Return the end mills of a pocket in the order of their work."""
        return [self.mill_of(pocket), *([pocket.rest] if pocket.rest else [])]

    @property
    def clearing_mills(self) -> dict[int, PocketMill]:
        """The end mills that clear pockets and the floors of carved shapes, by tool number."""
        mills = [mill for pocket in self.pockets for mill in self.mills_of(pocket)]
        return {mill.tool: mill for mill in (*mills, *(one.flat for one in self.carvings if one.flat))}


@dataclass(frozen=True)
class LayerWork:
    """The work on a layer.

    It consists of the number of shapes, the operation, its depth in mm (0 for none), and its tools in their order.
    """

    layer: str
    shapes: int
    operation: str
    depth: float
    tools: tuple[Tool, ...]

    @property
    def tool(self) -> str:
        """The labels of the tools ("" for none)."""
        return " + ".join(tool.label for tool in self.tools)


@dataclass(frozen=True)
class CopyGrid:
    """Copies of a drawing in columns along X and rows along Y. `pitch` is the distance from copy to copy, mm."""

    columns: int
    rows: int
    pitch: Point

    @property
    def number(self) -> int:
        """Number of copies."""
        return self.columns * self.rows

    @property
    def places(self) -> list[Point]:
        """Offset of each copy, mm. The first copy stays where the drawing is."""
        dx, dy = self.pitch
        return [(column * dx, row * dy) for row in range(self.rows) for column in range(self.columns)]


@dataclass(frozen=True)
class PartDetail:
    """The results of milling a part.

    These are the numbers of milled outlines and openings, drilled holes and tabs. The plate thickness, the heights of
    rapids and the allowance of the finishing pass (0 without one) are in mm. `layers` contains the work on each layer.
    `copies` is None if the program mills the drawing once on each plate. `work_offsets` contains the work offset of
    each plate, in tenths. The numbers are those of one plate.
    """

    outlines: int
    openings: int
    holes: int
    tabs: int
    thickness: float
    clearance: float
    retract: float
    finish: float = 0.0
    layers: tuple[LayerWork, ...] = ()
    copies: CopyGrid | None = None
    work_offsets: tuple[int, ...] = (FIRST_OFFSET,)
