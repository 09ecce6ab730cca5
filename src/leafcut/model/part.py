"""`Part`: what a drawing says, in millimetres, without a word about machines."""

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
    """A wider part of a hole: a counterbore, a countersink or an undercut; mm, rad.

    Attributes
    ----------
    diameter
        Of a cone the largest.
    depth
        Of its lower end below the top of the hole.
    angle
        Full angle of the cone; π for a counterbore, whose floor is flat.
    tip, narrow
        How deep the tip of a tool of this angle goes to make it, and the width of the hole at its lower end.
    open
        Whether a tool of this form can make it from above without cutting anything else.
    """

    diameter: float
    depth: float
    angle: float
    tip: float
    narrow: float
    open: bool = False


@dataclass(frozen=True, slots=True)
class Hole:
    """A round hole seen from above: centre and diameter in mm, with the drawing's layer and entity handle.

    A diameter of 0 means a bare point: the drawing says where, not how wide. `z` is the height at which it is drawn.
    `depth` is how deep its full diameter goes below that, mm, where a solid says it, else None; then `through` says
    whether it is open below, `flat` that its floor is flat and not the cone of a drill's point, and `steps` what of it
    is wider.
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
    """A round opening through a solid: its outline and its diameter, mm."""

    outline: Polyline
    diameter: float


@dataclass(frozen=True, slots=True)
class Slot:
    """A routed slot: the centre line from start to end, and its width, in mm. Either end may come first."""

    start: tuple[float, float]
    end: tuple[float, float]
    width: float
    layer: str = ""
    handle: str = ""


@dataclass(frozen=True)
class Grouping:
    """Which of the points of a map stand for each other: a tour visits one of every cluster.

    Attributes
    ----------
    cluster
        int32[n]: the cluster of each point, numbered from 0 without gaps.
    precedence
        int32[k, 2]: pairs (before, after) of clusters.
    first
        The cluster with which the closed tour begins, -1 for any.
    """

    cluster: NDArray[np.int32]
    precedence: NDArray[np.int32]
    first: int = -1

    @property
    def n_clusters(self) -> int:
        """Number of clusters."""
        return int(self.cluster.max()) + 1


#: The rows of the matrix that turns a direction of a solid up: a quarter about Y for X, a quarter about X for Y, half a
#: turn about X for -Z.
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
    """Where the zero of a program lies in the drawing or in the solid.

    Attributes
    ----------
    place
        What is there, "lower left corner of the part"; "" for the zero of the drawing or a point of it.
    x, y
        Of the drawing before it is mirrored and rotated, or of the solid after it is turned, mm.
    up
        Direction of the solid that points up, a key of `TURNS`; "" for a drawing.
    level
        What of the solid is at Z0: ``top``, ``bottom``, or ``drawn`` for its own Z0. ``surface`` and ``holes``: Z0 is
        that of the file of the surface, or of the drawing of the holes. "" for the surface of a plate.
    z
        Height of Z0 in the turned solid; of ``surface`` and ``holes`` the highest place over Z0, mm.
    """

    place: str = ""
    x: float = 0.0
    y: float = 0.0
    up: str = ""
    level: str = ""
    z: float = 0.0

    def facts(self, scale: float = 1.0) -> list[tuple[str, str]]:
        """Return name and words of the zero in X and Y, and of Z0 of a solid; `scale` is the number of mm in a unit."""

        def said(value: float) -> str:
            return f"{round(value / scale, 4) + 0.0:.4f}".rstrip("0").rstrip(".")

        turned = f", turned with {self.up.upper()} up" if self.up not in ("", "z") else ""
        whose = f"the {'solid' if self.up else 'drawing'}{turned}"
        where = f"X{said(self.x)} Y{said(self.y)} of {whose}"
        flat = ("zero", f"{self.place}, {where}" if self.place else where)
        if not self.level:
            return [flat]
        if self.level in ("surface", "holes"):
            file, most = ("surface file", "its top") if self.level == "surface" else ("drawing", "the highest hole")
            return [flat, ("Z0", f"Z0 of the {file}, {most} is at Z{said(self.z)}")]
        level = "" if self.level == "drawn" else f"{self.level} of the part, "
        return [flat, ("Z0", f"{level}Z{said(self.z)} of {whose}")]


@dataclass(frozen=True)
class Part:
    """Holes, slots and contours in the drawing's order, in mm.

    Attributes
    ----------
    name
        For people: the file's name or the example's.
    holes, slots
        In the order of the drawing, which is the order that "before" is measured in.
    source
        Name of the file it came from, and `format`, the reader that took it.
    edge_weight_type
        TSPLIB's rule of distance when the file gives one ("EUC_2D"), else empty.
    matrix
        float64[n, n], the distances of a TSPLIB file of explicit weights, else None; -1 for a way not allowed.
    optimum
        Length of the best known tour when the file says it, else None.
    contours
        What is to be cut from sheet or marked on it, in the order of the drawing; a drawing is read either for its
        holes and slots, for its contours, or for its pockets.
    grouping
        The sets of a generalised travelling salesman problem, else None.
    pockets
        What is to be cleared, in the order of the drawing.
    openings
        Round openings through a solid whose pockets are read.
    besides
        Work of other kinds that the drawing shows: missing where nobody chose the kind of work, else a note.
    edge
        Lines around the holes or the pockets of a plate, of kind ``sheet``: they are shown, and never worked.
    reference
        What the places of `ReadOptions.origin` refer to (`read.reference`); None for what is worked.
    zero
        Where the zero of the program lies. Of a solid a reader gives the height, and `processes.placing` the rest.
    height
        Of a solid as it lies, mm; None for a drawing.
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
    def hole_xy(self) -> NDArray[np.float64]:
        """Centres of the holes, float64[n, 2], mm."""
        return np.array([(h.x, h.y) for h in self.holes], dtype=np.float64).reshape(-1, 2)

    @property
    def diameters(self) -> NDArray[np.float64]:
        """Diameters of the holes, float64[n], mm."""
        return np.array([h.diameter for h in self.holes], dtype=np.float64)

    @property
    def extents(self) -> tuple[float, float, float, float]:
        """Smallest x and y, largest x and y of all that is worked, mm; zeros for an empty part."""
        points = [(h.x, h.y) for h in self.holes] + [p for s in self.slots for p in (s.start, s.end)]
        points += [p for c in self.contours for p in (c.path.extents[:2], c.path.extents[2:])]
        points += [p for c in self.pockets for p in (c.outline.extents[:2], c.outline.extents[2:])]
        if not points:
            return (0.0, 0.0, 0.0, 0.0)
        low, high = np.min(points, axis=0), np.max(points, axis=0)
        return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
