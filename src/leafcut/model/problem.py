"""`RoutingProblem`: clusters of nodes to visit. All processes use this model.

A solution visits every cluster exactly once, at one of its nodes. A hole is a cluster with one node. A slot is a
cluster with two nodes, one for each direction. A contour has a node for each combination of start point and direction,
as in a generalised travelling salesman problem. A node has an entry point, an exit point and a service time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PlanError

#: Names of metrics: plain distances, TSPLIB's distance functions, and machine time.
METRICS = (
    "euclidean", "chebyshev", "manhattan",
    "EUC_2D", "CEIL_2D", "ATT", "GEO", "MAX_2D", "MAN_2D", "EXPLICIT",
    "linear", "dogleg",
)  # fmt: skip

#: Upper limit for coordinates. Squared distances overflow at 1e154.
FARTHEST = 1e100


@dataclass(frozen=True, eq=False)
class Relief:
    """The heights of the tool at its positions, and safe heights for the travel moves between them, mm.

    Attributes
    ----------
    places, heights
        Positions, float64[k, 2], and the height of the tool before and after its work at each position, float64[k].
    otherwise
        Height at all other positions, such as the start.
    safe
        Safe height over each square tile, float64[rows, columns], row by row from the lowest y; −∞ without an obstacle.
    x, y, side
        Lower left corner of the first tile, and side length of a tile.
    velocity, acceleration
        Velocity and acceleration of the z axis, mm/s and mm/s².
    """

    places: NDArray[np.float64]
    heights: NDArray[np.float64]
    otherwise: float
    safe: NDArray[np.float64]
    x: float
    y: float
    side: float
    velocity: float
    acceleration: float

    def at(self, xy: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the height of the tool at each position, float64[n, 2], mm.

        If a position has two heights, return the higher.
        """
        known, otherwise = self._known, self.otherwise
        return np.array([known.get((x, y), otherwise) for x, y in xy.tolist()], dtype=np.float64)

    @cached_property
    def _known(self) -> dict[tuple[float, float], float]:
        known: dict[tuple[float, float], float] = {}
        for (x, y), height in zip(self.places.tolist(), self.heights.tolist(), strict=True):
            known[x, y] = max(height, known.get((x, y), height))
        return known


@dataclass(frozen=True, eq=False)
class Metric:
    """The cost of a travel move from an exit to the next entry, in a form that compiled kernels can use.

    Attributes
    ----------
    name
        A name from `METRICS`: a distance in mm, a TSPLIB function, or the time in seconds on a ``linear`` or ``dogleg``
        machine.
    velocity, acceleration
        Velocity and acceleration of x and y, mm/s and mm/s², for ``linear`` and ``dogleg``.
    per_mm
        Small additional cost per length, s/mm, for ``linear`` and ``dogleg``. If two moves take equal time, it favours
        the shorter move.
    zones
        Rectangles (x0, y0, x1, y1), float64[k, 4], mm. A move must be lifted above them.
    lift
        Cost of a lift, in the unit of the metric.
    matrix
        Costs for ``EXPLICIT``, float64[n, n].
    relief
        Heights of positions and travel moves. The cost of a move then includes the rise and the descent. None if all
        heights are equal.
    """

    name: str = "euclidean"
    velocity: tuple[float, float] = (1.0, 1.0)
    acceleration: tuple[float, float] = (1.0, 1.0)
    per_mm: float = 0.0
    zones: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))
    lift: float = 0.0
    matrix: NDArray[np.float64] | None = None
    relief: Relief | None = None

    def __post_init__(self) -> None:
        if self.name not in METRICS:
            raise PlanError("unknown metric '{}'; choose one of {}", self.name, ", ".join(METRICS))
        if self.name == "EXPLICIT" and self.matrix is None:
            raise PlanError("the metric EXPLICIT needs a matrix of costs")

    @property
    def unit(self) -> str:
        """Unit of the cost: ``s`` for machine time, ``mm`` for distance."""
        return "s" if self.name in ("linear", "dogleg") else "mm"


@dataclass(frozen=True, eq=False)
class RoutingProblem:
    """Clusters of nodes, the cost of moves between them, and the ends of the path.

    Attributes
    ----------
    entry, exit
        Positions where the tool arrives at each node and where it leaves the node, float64[n, 2], mm.
    cluster
        Cluster of each node, int32[n], numbered from 0 without gaps.
    service
        Cost of working at each node, float64[n], in the unit of the metric.
    precedence
        Pairs (before, after) of clusters, int32[k, 2].
    start, end
        First and last position of the tool, (x, y) in mm, or None for an open end. Ignored if `closed`.
    """

    entry: NDArray[np.float64]
    exit: NDArray[np.float64]
    cluster: NDArray[np.int32]
    service: NDArray[np.float64]
    metric: Metric = field(default_factory=Metric)
    precedence: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int32))
    start: tuple[float, float] | None = None
    end: tuple[float, float] | None = None
    closed: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        n = len(self.entry)
        if self.entry.shape != (n, 2) or self.exit.shape != (n, 2) or self.cluster.shape != (n,):
            raise PlanError("a problem of {} nodes needs entry and exit of shape ({}, 2) and cluster of ({},)", n, n, n)
        ends = [np.array(p) for p in (self.start, self.end) if p is not None]
        if not all((np.abs(p) < FARTHEST).all() for p in (self.entry, self.exit, *ends)):
            raise PlanError("a coordinate is not a number, or is larger than {:g}", FARTHEST)
        if n and (self.cluster.min() < 0 or not np.bincount(self.cluster).all()):
            raise PlanError("clusters must be numbered from 0 without gaps")

    @classmethod
    def of_points(
        cls,
        points: ArrayLike | Sequence[Sequence[float]],
        metric: Metric | None = None,
        **rest: object,
    ) -> RoutingProblem:
        """Create a problem in which each point is a separate cluster. `points` has n rows of x and y in mm."""
        xy = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 2))
        n = len(xy)
        return cls(
            entry=xy,
            exit=xy,
            cluster=np.arange(n, dtype=np.int32),
            service=np.zeros(n),
            metric=metric or Metric(),
            **rest,  # type: ignore[arg-type]
        )

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.entry)

    @property
    def n_clusters(self) -> int:
        """Number of clusters."""
        return int(self.cluster.max()) + 1 if len(self.cluster) else 0
