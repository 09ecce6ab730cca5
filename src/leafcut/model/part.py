"""`Part`: the content of a drawing in millimetres. It does not depend on a machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue
from leafcut.model.pocket import Pocket


@dataclass(frozen=True, slots=True)
class HoleStep:
    """A wider section of a hole, such as a counterbore, a countersink or an undercut, in mm and rad.

    Attributes
    ----------
    depth
        Depth of the lower end below the top of the hole.
    angle
        Included angle of the cone; π for a counterbore with a flat floor.
    tip, narrow
        Depth of the tip when a sharp tool with this angle cuts the section, and diameter of the hole at the lower end
        of the section.
    open
        Whether a tool of this shape can reach the section from above without cutting anything else.
    """

    diameter: float
    depth: float
    angle: float
    tip: float
    narrow: float
    open: bool = False


@dataclass(frozen=True, slots=True)
class Hole:
    """A round hole in plan view, mm.

    Attributes
    ----------
    diameter
        Diameter; 0 for a bare point.
    z
        Drawn height.
    depth
        For a hole in a solid, how far the full diameter extends below `z`; otherwise None.
    through, flat
        For a hole in a solid, whether it is open at the bottom, and whether its floor is flat rather than a cone.
    steps
        For a hole in a solid, its wider sections.
    """

    x: float
    y: float
    diameter: float
    layer: str = ""
    handle: str = ""
    z: float = 0.0
    depth: float | None = None
    through: bool = False
    flat: bool = False
    steps: tuple[HoleStep, ...] = ()


@dataclass(frozen=True, slots=True)
class Opening:
    """A round opening through a solid, mm."""

    outline: Polyline
    diameter: float


@dataclass(frozen=True, slots=True)
class Slot:
    """A slot, given by the two ends of its centre line and its width, mm. The tool may start at either end."""

    start: tuple[float, float]
    end: tuple[float, float]
    width: float
    layer: str = ""
    handle: str = ""


@dataclass(frozen=True)
class Grouping:
    """Clusters of alternative points on a map. A tour visits one point of every cluster.

    Attributes
    ----------
    cluster
        Cluster of each point, int32[n], numbered from 0 without gaps.
    precedence
        Pairs (before, after) of clusters, int32[k, 2].
    first
        Cluster at the start of the closed tour, or -1 if any cluster may be first.
    """

    cluster: NDArray[np.int32]
    precedence: NDArray[np.int32]
    first: int = -1

    @property
    def n_clusters(self) -> int:
        """Number of clusters."""
        return int(self.cluster.max()) + 1


#: Maps a direction of a solid to the rows of the matrix that turns this direction upwards: a quarter turn about Y for
#: X, a quarter turn about X for Y, a half turn about X for -Z.
TURNS: dict[str, tuple[tuple[int, int, int], ...]] = {
    "x": ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}


@dataclass(frozen=True, slots=True)
class ProgramZero:
    """The position of the program zero in the drawing or in the solid.

    Attributes
    ----------
    place
        Description, such as "lower left corner of the part". "" if the zero comes from the drawing or from coordinates.
    x, y
        Coordinates in the drawing before mirroring and rotation, or in the rotated solid, mm.
    up
        Direction of the solid that points up, a key of `TURNS`; "" for a drawing.
    level
        Level of Z0: ``top`` or ``bottom`` of the solid, ``drawn`` for the solid's own Z0, ``surface`` for Z0 of the
        surface file, ``holes`` for Z0 of the drawing of the holes, or "" for the surface of a plate.
    z
        Height of Z0 in the rotated solid, mm. For ``surface`` and ``holes``, the highest point above Z0.
    """

    place: str = ""
    x: float = 0.0
    y: float = 0.0
    up: str = ""
    level: str = ""
    z: float = 0.0

    def facts(self, scale: float = 1.0) -> list[tuple[str, str]]:
        """Describe the zero in X and Y, and Z0 if its height is known, as pairs (name, text).

        `scale` is the number of mm per output unit.
        """

        def coordinate(value: float) -> str:
            return f"{round(value / scale, 4) + 0.0:.4f}".rstrip("0").rstrip(".")

        orientation = f", turned with {self.up.upper()} up" if self.up not in ("", "z") else ""
        owner = f"the {'solid' if self.up else 'drawing'}{orientation}"
        position = f"X{coordinate(self.x)} Y{coordinate(self.y)} of {owner}"
        flat = ("zero", f"{self.place}, {position}" if self.place else position)
        if not self.level:
            return [flat]
        if self.level in ("surface", "holes"):
            file, reference = (
                ("surface file", "its top") if self.level == "surface" else ("drawing", "the highest hole")
            )
            return [flat, ("Z0", f"Z0 of the {file}, {reference} is at Z{coordinate(self.z)}")]
        level = "" if self.level == "drawn" else f"{self.level} of the part, "
        return [flat, ("Z0", f"{level}Z{coordinate(self.z)} of {owner}")]


@dataclass(frozen=True)
class Part:
    """Holes, slots and contours in file order, in mm.

    Attributes
    ----------
    name
        Name for messages: a file or an example.
    holes, slots
        Holes and slots in file order. The "before" measure uses this order.
    source, format
        Name of the file, and name of the reader that read the file.
    edge_weight_type
        Distance function that a TSPLIB file states, such as "EUC_2D", else empty.
    matrix
        Distances from a TSPLIB file with explicit weights, float64[n, n], else None. The value -1 marks a forbidden
        connection.
    optimum
        Length of the best known tour if the file states it, else None.
    contours
        Contours to cut from sheet or to mark, in file order. A drawing is read either for its holes and slots, for its
        contours, or for its pockets. A plate read from a solid has contours and pockets.
    grouping
        Clusters of a generalised travelling salesman problem, else None.
    pockets
        Pockets to clear, in file order.
    openings
        Round through-openings in a solid that was read for its pockets.
    besides
        Issues about other kinds of work in the drawing. This work counts as missing unless the user chose that kind.
    edge
        Lines around the holes or pockets of a plate, of kind ``sheet``. Drawings show them, but they are never
        machined.
    reference
        The geometry that `ReadOptions.origin` refers to (`read.reference`); None for the machined objects.
    zero
        Position of the program zero. For a solid, the reader sets the height, and `processes.placing` sets the rest.
    height
        Height of a solid in its orientation, mm; None for a drawing.
    """

    name: str
    holes: tuple[Hole, ...] = ()
    slots: tuple[Slot, ...] = ()
    issues: tuple[Issue, ...] = ()
    source: str = ""
    format: str = ""
    units: str = "mm"
    edge_weight_type: str = ""
    matrix: NDArray[np.float64] | None = None
    optimum: float | None = None
    contours: tuple[Contour, ...] = ()
    grouping: Grouping | None = None
    pockets: tuple[Pocket, ...] = ()
    edge: tuple[Contour, ...] = ()
    reference: Part | None = None
    zero: ProgramZero | None = None
    height: float | None = None
    openings: tuple[Opening, ...] = ()
    besides: tuple[Issue, ...] = ()

    @property
    def has_hole_depths(self) -> bool:
        """Whether the holes have their own depths and heights, as in a solid."""
        return any(hole.depth is not None for hole in self.holes)

    @property
    def hole_xy(self) -> NDArray[np.float64]:
        """Centres of the holes, float64[n, 2], mm."""
        return np.array([(h.x, h.y) for h in self.holes], dtype=np.float64).reshape(-1, 2)

    @property
    def diameters(self) -> NDArray[np.float64]:
        """Diameters of the holes, float64[n], mm."""
        return np.array([h.diameter for h in self.holes], dtype=np.float64)

    @property
    def extents(self) -> tuple[float, float, float, float]:
        """Bounding box of all machined objects, mm: smallest x and y, then largest x and y. Zeros for an empty part."""
        points = [(h.x, h.y) for h in self.holes] + [p for s in self.slots for p in (s.start, s.end)]
        points += [p for c in self.contours for p in (c.path.extents[:2], c.path.extents[2:])]
        points += [p for c in self.pockets for p in (c.outline.extents[:2], c.outline.extents[2:])]
        if not points:
            return (0.0, 0.0, 0.0, 0.0)
        low, high = np.min(points, axis=0), np.max(points, axis=0)
        return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
