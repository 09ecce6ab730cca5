"""The edges of a part, the request that planner and judge share, and the results of milling."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.geometry.polyline import Polyline


@dataclass(frozen=True)
class Edge:
    """A closed edge of the finished part, mm.

    `inside` means that the tool runs inside the edge of an opening. `within` are the indices of the edges around
    this edge, in no order; they are milled later.
    """

    path: Polyline
    inside: bool
    within: tuple[int, ...] = ()
    name: str = ""


@dataclass(frozen=True)
class TabRules:
    """Tabs on an edge: requested number, width between the cuts, and height over the underside, mm."""

    count: int
    width: float
    height: float

    def needed_length(self, diameter: float) -> float:
        """Return the shortest tool path, mm, that has tabs: each has two thirds of its share free for cuts."""
        return 3.0 * self.count * (self.width + diameter)


@dataclass(frozen=True)
class PartHole:
    """A hole through the plate for a drill: its centre, the tool, and the lowest height of the tip, mm."""

    x: float
    y: float
    tool: int
    tip: float


@dataclass(frozen=True)
class PartRequest:
    """What the program must do: mill these edges through the plate with a tool, leave tabs, and drill these holes.

    `bottom` is the lowest height of the mill, and `thickness` the thickness of the plate, mm.
    """

    edges: tuple[Edge, ...]
    holes: tuple[PartHole, ...]
    tool: int
    radius: float
    thickness: float
    bottom: float
    tabs: TabRules


@dataclass(frozen=True)
class PartDetail:
    """Numbers of milled outlines and openings, drilled holes and tabs; thickness and heights of rapids, mm."""

    outlines: int
    openings: int
    holes: int
    tabs: int
    thickness: float
    clearance: float
    retract: float
