"""`RoutingProblem`: clusters of nodes to visit, a common model for all processes.

Every cluster is visited once, through exactly one of its nodes. A hole is a cluster of one node. "Route this slot from
either end" is a cluster of two nodes; "start this contour at any of its points, in either direction" is a cluster of a
generalised travelling salesman problem. A node has an entry point, an exit point and a service time in between.
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

#: Upper limit for coordinates, far below the overflow of a squared distance at 1e154.
FARTHEST = 1e100


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights of the tool at its positions, and safe heights between them, mm.

    Attributes
    ----------
    places, heights
        float64[k, 2] and float64[k]: positions, and the height of the tool there before and after its work; at any
        other position, such as the first, `otherwise`.
    safe
        float64[rows, columns]: safe height over each square tile, row by row from the lowest y; −∞ for no obstacle.
    x, y, side
        Lower left corner of the first tile, and side of a tile.
    velocity, acceleration
        Of z, mm/s and mm/s².
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
        """Return the tool's heights, float64[n], at positions float64[n, 2]; the higher one if there are two."""
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
    """Cost of travelling from an exit to the next entry, in numbers for a kernel.

    Attributes
    ----------
    name
        One of `METRICS`: a distance in mm, a TSPLIB function, or the seconds of a ``linear`` or ``dogleg`` machine.
    velocity, acceleration
        Of x and y, mm/s and mm/s²; used by ``linear`` and ``dogleg``.
    per_mm
        Additional cost per length, s/mm; used by ``linear`` and ``dogleg``. It is tiny, and prefers the shorter of two
        moves of equal time.
    zones
        float64[k, 4]: rectangles (x0, y0, x1, y1) in mm over which a move must be lifted.
    lift
        Cost of a lift, in the unit of the metric.
    matrix
        float64[n, n] for ``EXPLICIT``.
    relief
        Heights of positions and moves, for metrics of positions: the cost of a move includes rising to its height and
        descending again, in seconds of z or in mm; None: all heights are equal.
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
            raise PlanError(f"unknown metric '{self.name}'; choose one of {', '.join(METRICS)}")
        if self.name == "EXPLICIT" and self.matrix is None:
            raise PlanError("the metric EXPLICIT needs a matrix of costs")

    @property
    def unit(self) -> str:
        """``s`` for a machine time, ``mm`` for a distance."""
        return "s" if self.name in ("linear", "dogleg") else "mm"


@dataclass(frozen=True, eq=False)
class RoutingProblem:
    """Clusters of nodes, the cost of moves between them, and the ends of the path.

    Attributes
    ----------
    entry, exit
        float64[n, 2]: positions where the tool arrives at a node and leaves it, mm.
    cluster
        int32[n]: cluster of every node, numbered from 0 without gaps.
    service
        float64[n]: cost of the node itself, in the unit of the metric.
    precedence
        int32[k, 2]: pairs (before, after) of clusters.
    start, end
        (x, y) in mm, or None for a free end. Ignored if `closed`.
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
            raise PlanError(f"a problem of {n} nodes needs entry and exit of shape ({n}, 2) and cluster of ({n},)")
        ends = [np.array(p) for p in (self.start, self.end) if p is not None]
        if not all((np.abs(p) < FARTHEST).all() for p in (self.entry, self.exit, *ends)):
            raise PlanError(f"a coordinate is not a number, or farther away than {FARTHEST:g}")
        if n and (self.cluster.min() < 0 or not np.bincount(self.cluster).all()):
            raise PlanError("clusters must be numbered from 0 without gaps")

    @classmethod
    def of_points(
        cls,
        points: ArrayLike | Sequence[Sequence[float]],
        metric: Metric | None = None,
        **rest: object,
    ) -> RoutingProblem:
        """Return the problem in which every point (n rows of x, y in mm) is its own cluster."""
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
