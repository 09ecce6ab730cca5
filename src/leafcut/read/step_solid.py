"""What a STEP file holds, found by OpenCASCADE in a process of its own: holes, other sides, and triangles.

    python -m leafcut.read.step_solid FILE OUT.npz MOST_TRIANGLES

A damaged file can end OpenCASCADE, or fill the memory: that ends this process alone. It writes nothing but OUT.npz,
whose `told` is JSON: what is wrong, or the holes.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

#: Triangles leave the solid by at most this, mm, and by this angle, rad.
DEFLECTION, ANGLE = 0.05, 0.3
#: Lengths that differ by less are one, mm; directions that differ by less are one.
SAME, PARALLEL = 1e-3, 1e-6
#: A round wall that misses less than this of a full turn is a whole one, rad.
WHOLE = math.radians(1.0)


class RoundWall(NamedTuple):
    """A round wall about an upright axis: its heights, and its radius at the lower and the upper end, mm."""

    x: float
    y: float
    low: float
    high: float
    low_radius: float
    high_radius: float
    #: How much of a turn it goes round, rad.
    turn: float

    @property
    def straight(self) -> bool:
        """Whether it is a cylinder."""
        return abs(self.low_radius - self.high_radius) < SAME


@dataclass(frozen=True)
class SolidHole:
    """A hole that is open above.

    Attributes
    ----------
    x, y, top, diameter
        Of the narrowest straight part, and where the hole begins, mm.
    depth
        From the top to the lower end of that part, mm.
    through
        Whether it is open below.
    pointed
        Of a blind hole: whether a cone ends it, as the point of a drill leaves it; else its floor is flat.
    steps
        Wider parts above: diameter and depth from the top of each, mm, from above; a cone's largest diameter.
    """

    x: float
    y: float
    top: float
    diameter: float
    depth: float
    through: bool
    pointed: bool
    steps: tuple[tuple[float, float], ...] = ()


def joined(walls: list[RoundWall]) -> list[RoundWall]:
    """Return whole walls, halves of one put together; what goes round less than a turn is no hole."""
    found: dict[tuple[float, ...], RoundWall] = {}
    for wall in walls:
        key = tuple(round(value / SAME) for value in wall[:6])
        before = found.get(key)
        found[key] = wall if before is None else wall._replace(turn=before.turn + wall.turn)
    return [wall for wall in found.values() if wall.turn > math.tau - WHOLE]


def columns(walls: list[RoundWall]) -> Iterator[list[RoundWall]]:
    """Yield the walls of each hole from above: those of one axis of which one ends where the next begins."""
    by_axis: dict[tuple[float, float], list[RoundWall]] = {}
    for wall in walls:
        by_axis.setdefault((round(wall.x / SAME), round(wall.y / SAME)), []).append(wall)
    for every in by_axis.values():
        column: list[RoundWall] = []
        for wall in sorted(every, key=lambda one: -one.high):
            narrower = column and wall.high_radius <= column[-1].low_radius + SAME
            if column and not (narrower and abs(column[-1].low - wall.high) < SAME):
                yield column
                column = []
            column.append(wall)
        yield column


def hole_of(column: list[RoundWall]) -> SolidHole | None:
    """Return the hole of a column, taken for open below; None where nothing of it is straight."""
    straight = [wall for wall in column if wall.straight]
    if not straight:
        return None
    narrow = min(straight, key=lambda one: (one.low_radius, -one.low))
    top, last = column[0].high, column[-1]
    pointed = last.low < narrow.low - SAME and last.low_radius < SAME
    wider = [wall for wall in column if max(wall.low_radius, wall.high_radius) > narrow.low_radius + SAME]
    steps = tuple((2.0 * max(wall.low_radius, wall.high_radius), top - wall.low) for wall in wider)
    return SolidHole(narrow.x, narrow.y, top, 2.0 * narrow.low_radius, top - narrow.low, True, pointed, steps)


def main(arguments: list[str]) -> int:
    """Read a file and write what it holds."""
    file, out, most = arguments[0], arguments[1], int(arguments[2])
    told, triangles = _found(file, most)
    np.savez(out, told=np.array(json.dumps(told)), triangles=triangles)
    return 0


def _found(file: str, most: int) -> tuple[dict[str, Any], np.ndarray]:
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SOLID

    none = np.zeros((0, 3, 3))
    reader = STEPControl_Reader()
    if reader.ReadFile(file) != IFSelect_RetDone:
        return {"problem": "the STEP file could not be read; it is damaged or cut off"}, none
    reader.TransferRoots()
    if not reader.NbShapes():
        return {"problem": "the STEP file has no solid"}, none
    shape = reader.OneShape()
    solids = len(list(_parts(shape, TopAbs_SOLID)))
    if solids != 1:
        what = "no solid" if not solids else f"{solids} solids; export one part alone"
        return {"problem": f"the STEP file has {what}"}, none
    triangles = _triangles(shape)
    if len(triangles) > most:
        return {"problem": f"the solid has {len(triangles):,} triangles; at most {most:,} are taken"}, none
    holes, below, aside = _holes(shape, triangles)
    return {"holes": [asdict(hole) for hole in holes], "below": below, "aside": aside}, triangles


def _parts(shape: Any, kind: Any) -> Iterator[Any]:
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _face(shape: Any) -> Any:
    from OCP.TopoDS import TopoDS

    return TopoDS.Face(shape) if hasattr(TopoDS, "Face") else TopoDS.Face_s(shape)


def _triangles(shape: Any) -> np.ndarray:
    """Return the triangles of a shape, float64[n, 3, 3]."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopLoc import TopLoc_Location

    BRepMesh_IncrementalMesh(shape, DEFLECTION, False, ANGLE, False)
    found = []
    for one in _parts(shape, TopAbs_FACE):
        location = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(_face(one), location)
        if mesh is None:
            continue
        move = location.Transformation()
        points = [mesh.Node(k).Transformed(move) for k in range(1, mesh.NbNodes() + 1)]
        corners = np.array([(p.X(), p.Y(), p.Z()) for p in points])
        rows = [mesh.Triangle(k) for k in range(1, mesh.NbTriangles() + 1)]
        index = np.array([(t.Value(1), t.Value(2), t.Value(3)) for t in rows], dtype=np.int64) - 1
        found.append(corners[index])
    return np.concatenate(found) if found else np.zeros((0, 3, 3))


def _holes(shape: Any, triangles: np.ndarray) -> tuple[list[SolidHole], int, dict[str, int]]:
    """Return the holes that are open above, how many are open below alone, and by direction those of other sides."""
    walls, aside = _walls(shape)
    highest, lowest = float(triangles[:, :, 2].max()), float(triangles[:, :, 2].min())
    holes, below = [], 0
    for column in columns(joined(walls)):
        hole = hole_of(column)
        if hole is None:
            continue
        up = _meets(shape, hole.x, hole.y, column[0].high + SAME, highest + 1.0)
        down = _meets(shape, hole.x, hole.y, lowest - 1.0, column[-1].low - SAME)
        if not up:
            floor = _meets(shape, hole.x, hole.y, column[-1].low - SAME, column[-1].low + SAME)
            closed = hole.pointed or floor or down
            holes.append(hole if not closed else SolidHole(**{**asdict(hole), "through": False}))
        elif not down:
            below += 1
    return sorted(holes, key=lambda one: (one.y, one.x, -one.top)), below, aside


def _walls(shape: Any) -> tuple[list[RoundWall], dict[str, int]]:
    """Return the hollow round walls about upright axes, and how many whole ones have another direction, by it."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepTools import BRepTools
    from OCP.GeomAbs import GeomAbs_Cone, GeomAbs_Cylinder
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED

    walls, aside = [], dict[tuple[float, ...], float]()
    for one in _parts(shape, TopAbs_FACE):
        face = _face(one)
        surface = BRepAdaptor_Surface(face)
        kind = surface.GetType()
        if kind not in (GeomAbs_Cylinder, GeomAbs_Cone):
            continue
        round_ = surface.Cylinder() if kind == GeomAbs_Cylinder else surface.Cone()
        # Its own normal looks away from the axis, unless its axes are left-handed; that of the solid out of material.
        if (face.Orientation() == TopAbs_REVERSED) != round_.Position().Direct():
            continue
        u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
        axis, at = round_.Axis().Direction(), round_.Axis().Location()
        if abs(abs(axis.Z()) - 1.0) > PARALLEL:
            if kind == GeomAbs_Cylinder:
                key = tuple(round(value, 3) for value in _direction(axis)) + tuple(
                    round(value / SAME) for value in (*_foot(axis, at), round_.Radius())
                )
                aside[key] = aside.get(key, 0.0) + (u1 - u0)
            continue
        slope = 0.0 if kind == GeomAbs_Cylinder else round_.SemiAngle()
        start = round_.Radius() if kind == GeomAbs_Cylinder else round_.RefRadius()
        ends = [(at.Z() + v * math.cos(slope) * axis.Z(), abs(start + v * math.sin(slope))) for v in (v0, v1)]
        (low, low_radius), (high, high_radius) = sorted(ends)
        walls.append(RoundWall(at.X(), at.Y(), low, high, low_radius, high_radius, u1 - u0))
    counted: dict[str, int] = {}
    for key, turn in aside.items():
        if turn > math.tau - WHOLE:
            words = ", ".join(f"{value:g}" for value in key[:3])
            counted[words] = counted.get(words, 0) + 1
    return walls, counted


def _direction(axis: Any) -> tuple[float, float, float]:
    """Return a direction, the same for both ways along it."""
    x, y, z = axis.X(), axis.Y(), axis.Z()
    sign = next((math.copysign(1.0, value) for value in (x, y, z) if abs(value) > PARALLEL), 1.0)
    return sign * x + 0.0, sign * y + 0.0, sign * z + 0.0


def _foot(axis: Any, at: Any) -> tuple[float, float, float]:
    """Return the place of an axis that is nearest to zero: of one axis it is the same wherever it is said to begin."""
    along = at.X() * axis.X() + at.Y() * axis.Y() + at.Z() * axis.Z()
    return at.X() - along * axis.X(), at.Y() - along * axis.Y(), at.Z() - along * axis.Z()


def _meets(shape: Any, x: float, y: float, low: float, high: float) -> bool:
    """Return whether the upright line at a place meets the solid between two heights."""
    from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
    from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector

    lines = IntCurvesFace_ShapeIntersector()
    lines.Load(shape, 1e-7)
    lines.Perform(gp_Lin(gp_Pnt(x, y, low), gp_Dir(0, 0, 1)), 0.0, high - low)
    return int(lines.NbPnt()) > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
