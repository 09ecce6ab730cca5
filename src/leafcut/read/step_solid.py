"""Read a STEP file with OpenCASCADE in a subprocess: holes, pockets, outlines, and triangles.

    python -m leafcut.read.step_solid FILE OUT.npz MOST_TRIANGLES holes|pockets|outlines|mesh only|all|NUMBER \
        x|y|z|-x|-y|-z top|bottom|drawn box|''

A damaged file can crash OpenCASCADE or fill the memory. Then only this process ends. Its only output is OUT.npz. The
entry `told` is JSON: a problem, or the holes, pockets or outlines of the solid after rotation and lifting, the height
that became Z0, the convex hull in top view, and the bounding box of the solid.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import count_of
from leafcut.message import Message
from leafcut.model.part import TURNS, HoleStep
from leafcut.read.step_shapes import ALL, ONLY, PARALLEL, as_face, clip_above, face_triangles, subshapes

#: Memory limit of this process, bytes.
MEMORY = 8 * 1024**3
#: Mesh tolerance: distance, mm, and angle, rad.
DEFLECTION, ANGLE = 0.05, 0.3
#: Tolerance of equal lengths, mm.
SAME = 1e-3
#: Maximum number of solids listed in a message.
MOST_NAMED = 8
#: Maximum gap, degrees, up to which a round wall still counts as a full turn.
WHOLE = 1


class RoundWall(NamedTuple):
    """A round wall around a vertical axis.

    It has a lower and an upper height, and a radius at each of these heights, mm.
    """

    x: float
    y: float
    low: float
    high: float
    low_radius: float
    high_radius: float
    #: The whole degrees that the wall covers in top view.
    covers: frozenset[int]

    @property
    def straight(self) -> bool:
        """Whether the wall is a cylinder."""
        return abs(self.low_radius - self.high_radius) < SAME

    @property
    def taper(self) -> float:
        """How much the radius increases per mm of height."""
        return 0.0 if self.straight else (self.high_radius - self.low_radius) / (self.high - self.low)


@dataclass(frozen=True)
class SolidHole:
    """A hole in a solid that is open at the top.

    Attributes
    ----------
    x, y, top, diameter
        Axis and diameter of the narrowest cylinder, and the height at which the hole starts, mm.
    depth
        Distance from the top of the hole to the lower end of the narrowest cylinder, mm.
    pointed
        For a blind hole, whether the hole ends in a cone, like the point of a drill. Otherwise its floor is flat.
    """

    x: float
    y: float
    top: float
    diameter: float
    depth: float
    through: bool
    pointed: bool
    steps: tuple[HoleStep, ...] = ()


def labels_of_close_values(values: list[float]) -> list[int]:
    """Return a label for each value.

    Two values have the same label if they differ by at most `SAME`, or if a chain of such differences connects them.
    """
    order = np.argsort(values, kind="stable")
    steps = np.diff(np.asarray(values, dtype=np.float64)[order]) > SAME
    number = np.zeros(len(values), dtype=np.int64)
    number[order[1:]] = np.cumsum(steps)
    return [int(label) for label in number]


def join_wall_pieces(walls: list[RoundWall]) -> list[RoundWall]:
    """Join the pieces of each wall, and return the walls that cover a full turn. Other walls do not belong to holes.

    The pieces of a wall lie on the same cylinder or cone, and overlap or touch in height. Under a sloping surface, the
    pieces end at different heights.
    """
    level = [wall.low_radius - wall.taper * wall.low for wall in walls]
    keys = zip(
        labels_of_close_values([wall.x for wall in walls]),
        labels_of_close_values([wall.y for wall in walls]),
        labels_of_close_values([w.taper for w in walls]),
        labels_of_close_values(level),
        strict=True,
    )
    by_surface: dict[tuple[int, ...], list[RoundWall]] = {}
    for key, wall in zip(keys, walls, strict=True):
        by_surface.setdefault(key, []).append(wall)
    merged: list[RoundWall] = []
    for pieces in by_surface.values():
        group: list[RoundWall] = []
        for piece in sorted(pieces, key=lambda w: -w.high):
            if group and piece.high < min(w.low for w in group) + SAME:
                merged.append(_merge_wall_pieces(group))
                group = []
            group.append(piece)
        merged.append(_merge_wall_pieces(group))
    return [wall for wall in merged if len(wall.covers) >= 360 - WHOLE]


def _merge_wall_pieces(pieces: list[RoundWall]) -> RoundWall:
    low, high = min(pieces, key=lambda w: w.low), max(pieces, key=lambda w: w.high)
    covers = frozenset[int]().union(*(w.covers for w in pieces))
    return high._replace(low=low.low, low_radius=low.low_radius, covers=covers)


def hole_columns(walls: list[RoundWall], apart: Callable[[RoundWall, RoundWall], bool]) -> Iterator[list[RoundWall]]:
    """Yield the walls of each hole, from top to bottom.

    A hole consists of the walls around the same axis without material between them. If two walls have a gap between
    them, another feature, such as a cross hole or a groove, opens into the hole.
    """
    by_axis: dict[tuple[int, int], list[RoundWall]] = {}
    for x, y, wall in zip(
        labels_of_close_values([w.x for w in walls]), labels_of_close_values([w.y for w in walls]), walls, strict=True
    ):
        by_axis.setdefault((x, y), []).append(wall)
    for axis_walls in by_axis.values():
        column: list[RoundWall] = []
        for wall in sorted(axis_walls, key=lambda w: (-w.high, -w.low)):
            if column and apart(column[-1], wall):
                yield column
                column = []
            column.append(wall)
        yield column


def column_to_hole(column: list[RoundWall]) -> SolidHole | None:
    """Convert a column of walls to a hole, or return None if the column contains no cylinder.

    The function assumes that the hole is open at the bottom.
    """
    straight = [wall for wall in column if wall.straight]
    if not straight:
        return None
    radius = min(wall.low_radius for wall in straight)
    narrow = min((wall for wall in straight if wall.low_radius < radius + SAME), key=lambda w: w.low)
    top, last = column[0].high, column[-1]
    pointed = last.low < narrow.low - SAME and last.low_radius < SAME
    wider = [wall for wall in column if max(wall.low_radius, wall.high_radius) > radius + SAME and wall.taper >= 0.0]
    wider += [wall for wall in column if wall.taper < 0.0]
    steps = tuple(_wall_to_hole_step(w, column, top) for w in wider if w.low_radius > SAME)
    return SolidHole(narrow.x, narrow.y, top, 2.0 * radius, top - narrow.low, True, pointed, steps)


def _wall_to_hole_step(wall: RoundWall, column: list[RoundWall], top: float) -> HoleStep:
    """Convert a wide wall to a step of a hole, such as a counterbore.

    The step is `open` if a tool can reach it from above, with clearance below the point of the tool.
    """
    index = column.index(wall)
    above = all(w.low_radius > wall.high_radius - SAME and w.taper >= 0.0 for w in column[:index])
    below = column[index + 1 :]
    diameter, depth = 2.0 * max(wall.low_radius, wall.high_radius), top - wall.low
    if wall.straight:
        return HoleStep(diameter, depth, math.pi, depth, diameter, above and bool(below))
    if wall.taper < 0.0 or not below:
        return HoleStep(diameter, depth, math.pi, depth, diameter)
    # The cone of the tool continues below the wall; the next cylinder has to be as wide as the cone's lower end.
    extension = wall.low_radius / wall.taper
    next_wall = below[0]
    clear = next_wall.straight and abs(next_wall.high_radius - wall.low_radius) < SAME
    clear &= next_wall.high - next_wall.low > extension - SAME and abs(next_wall.high - wall.low) < SAME
    angle = 2.0 * math.atan(wall.taper)
    return HoleStep(diameter, depth, angle, depth + extension, 2.0 * wall.low_radius, above and clear)


class Surface(NamedTuple):
    """The triangles of a solid, float64[n, 3, 3], mm.

    The surface also stores the lower and the upper corner of each triangle's bounding box, float64[n, 3], mm.
    """

    triangles: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    @classmethod
    def of(cls, triangles: NDArray[np.float64]) -> Surface:
        """Create a surface, and compute the bounding boxes of its triangles."""
        return cls(triangles, triangles.min(axis=1), triangles.max(axis=1))


def enters_cylinder(surface: Surface, x: float, y: float, radius: float, low: float, high: float) -> bool:
    """Return whether a surface enters a vertical cylinder between two heights, exclusive."""
    triangles, lower, upper = surface
    close = (upper[:, 2] > low) & (lower[:, 2] < high)
    close &= (
        (upper[:, 0] > x - radius)
        & (lower[:, 0] < x + radius)
        & (upper[:, 1] > y - radius)
        & (lower[:, 1] < y + radius)
    )
    for triangle in triangles[close]:
        piece = clip_above(clip_above(triangle, low) * (1, 1, -1), -high)
        if len(piece) and shapely.MultiPoint(piece[:, :2]).convex_hull.distance(shapely.Point(x, y)) < radius:
            return True
    return False


def main(arguments: list[str]) -> int:
    """Read a STEP file within the memory limit `MEMORY`, and write the result."""
    _limit_memory()
    file, out, max_triangles, features, which, up, level, boxed = arguments
    result, triangles = _read_solid(file, int(max_triangles), features, which, up, level, bool(boxed))
    np.savez(out, told=np.array(json.dumps(result)), triangles=triangles)
    return 0


def _limit_memory() -> None:
    if sys.platform == "win32":
        return
    import resource

    for kind, limit in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(kind)[1]
        # Keep a lower existing limit. macOS refuses to limit the memory.
        with suppress(ValueError, OSError):
            lowest = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
            resource.setrlimit(kind, (lowest, lowest))


def _read_solid(
    file: str, max_triangles: int, features: str, which: str, up: str, level: str, boxed: bool
) -> tuple[dict[str, Any], NDArray[np.float64]]:
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SOLID

    none = np.zeros((0, 3, 3))
    reader = STEPControl_Reader()
    if reader.ReadFile(file) != IFSelect_RetDone:
        return {"problem": Message("the STEP file could not be read; it is damaged or truncated")}, none
    reader.TransferRoots()
    if not reader.NbShapes():
        return {"problem": Message("the STEP file has no solid")}, none
    shape = reader.OneShape()
    solids = list(subshapes(shape, TopAbs_SOLID))
    if not solids:
        return {"problem": Message("the STEP file has no solid")}, none
    if which not in (ONLY, ALL) and int(which) > len(solids):
        return {"problem": Message("--solid {}: the STEP file has {}", which, _describe_solids(solids))}, none
    if which == ONLY and len(solids) > 1:
        return {"problem": Message("the STEP file has {}; choose one with --solid", _describe_solids(solids))}, none
    if which != ALL:
        shape = solids[0 if which == ONLY else int(which) - 1]
    shape = _transform_shape(shape, TURNS[up], 0.0)
    BRepMesh_IncrementalMesh(shape, DEFLECTION, False, ANGLE, False)
    faces = [as_face(face) for face in subshapes(shape, TopAbs_FACE)]
    triangles = np.concatenate([np.zeros((0, 3, 3)), *map(face_triangles, faces)])
    if len(triangles) > max_triangles:
        return {
            "problem": Message("the solid has {:,} triangles; at most {:,} are read", len(triangles), max_triangles)
        }, none
    z = 0.0
    if len(triangles) and level != "drawn":
        z = float(triangles[:, :, 2].max() if level == "top" else triangles[:, :, 2].min())
    if z:
        shape = _transform_shape(shape, TURNS["z"], -z)
        triangles = triangles - (0.0, 0.0, z)
        faces = [as_face(face) for face in subshapes(shape, TopAbs_FACE)]
    result: dict[str, Any] = {}
    if features != "mesh":
        hull: Any = shapely.MultiPoint(triangles[:, :, :2].reshape(-1, 2)).convex_hull
        x0, y0, _, x1, y1, _ = _bounding_box(shape) if boxed else (0.0,) * 6
        result = {
            "z": z,
            "height": float(np.ptp(triangles[:, :, 2])) if len(triangles) else 0.0,
            "hull": shapely.get_coordinates(hull).tolist(),
            "box": [[x0, y0], [x1, y0], [x1, y1], [x0, y1]] if boxed else [],
        }
    return result | _extract_features(features, shape, triangles, faces), triangles


def _extract_features(
    features: str, shape: Any, triangles: NDArray[np.float64], faces: Sequence[Any]
) -> dict[str, Any]:
    if features == "mesh":
        return {}
    if features == "holes":
        holes, excluded, aside = _find_holes(shape, triangles)
        return {"holes": [asdict(hole) for hole in holes], **excluded, "aside": aside}
    from leafcut.read.step_sections import find_outlines, find_pockets

    def is_visible_from_above(x: float, y: float, z: float) -> bool:
        return not _vertical_line_meets(shape, x, y, z + DEFLECTION, float(triangles[:, :, 2].max()) + 1.0)

    return (find_outlines if features == "outlines" else find_pockets)(shape, triangles, faces, is_visible_from_above)


def _transform_shape(shape: Any, rows: Sequence[Sequence[int]], lift: float) -> Any:
    from OCP.gp import gp_Trsf
    from OCP.TopLoc import TopLoc_Location

    move = gp_Trsf()
    (a, b, c), (d, e, f), (g, h, i) = rows
    move.SetValues(a, b, c, 0.0, d, e, f, 0.0, g, h, i, lift)
    return shape.Moved(TopLoc_Location(move))


def _bounding_box(shape: Any) -> tuple[float, float, float, float, float, float]:
    """Return the lowest and the highest corner of a shape's bounding box, mm."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    return (*_point_coordinates(box.CornerMin()), *_point_coordinates(box.CornerMax()))


def _describe_solids(solids: Sequence[Any]) -> Message:
    texts = []
    for number, solid in enumerate(solids[:MOST_NAMED], 1):
        box = _bounding_box(solid)
        size = " × ".join(f"{b - a:.4g}" for a, b in zip(box[:3], box[3:], strict=True))
        x, y, z = (round(value, 3) + 0.0 for value in box[:3])
        texts.append(Message("{}: {} mm at {:g}, {:g}, Z{:g}", number, size, x, y, z))
    more = Message("; and {} more", len(solids) - MOST_NAMED) if len(solids) > MOST_NAMED else ""
    return Message("{} ({}{})", count_of(len(solids), "solid"), Message.joined("; ", texts), more)


def _point_coordinates(point: Any) -> tuple[float, float, float]:
    return point.X(), point.Y(), point.Z()


def _find_holes(shape: Any, triangles: NDArray[np.float64]) -> tuple[list[SolidHole], dict[str, int], dict[str, int]]:
    """Return the holes that are open at the top.

    The other two results are the numbers of all other holes, by reason and by direction.
    """
    walls, aside, free = _find_round_walls(shape)
    surface = Surface.of(triangles)

    def is_material_between(upper: RoundWall, lower: RoundWall) -> bool:
        if upper.low < lower.high:
            return False
        return _vertical_line_meets(shape, upper.x, upper.y, lower.high - SAME, upper.low + SAME)

    holes, excluded = [], {"below": 0, "obstructed": 0, "free": free}
    for column in hole_columns(join_wall_pieces(walls), is_material_between):
        hole = column_to_hole(column)
        if hole is None:
            continue
        # The triangles are chords of the wall, so they come nearer to the axis, by at most the factor cos(ANGLE).
        radius = hole.diameter / 2.0 * math.cos(ANGLE)
        bottom = hole.top - hole.depth

        def meets(low: float, high: float, drilled: SolidHole = hole, radius: float = radius) -> bool:
            return enters_cylinder(surface, drilled.x, drilled.y, radius, low, high)

        if meets(bottom + SAME, math.inf):
            open_below = not meets(-math.inf, hole.top - SAME)
            excluded["below" if open_below else "obstructed"] += 1
            continue
        # Clearance below a through hole: the point of its drill, 118°, and 1 mm.
        clearance = hole.diameter / 2.0 / math.tan(math.radians(59.0)) + 1.0
        closed = hole.pointed or meets(bottom - clearance, bottom + SAME)
        steps = tuple(
            replace(step, open=step.open and not _is_step_covered(surface, hole, step)) if step.open else step
            for step in hole.steps
        )
        holes.append(replace(hole, through=not closed, steps=steps))
    return sorted(holes, key=lambda h: (h.y, h.x, -h.top)), excluded, aside


def _is_step_covered(surface: Surface, hole: SolidHole, step: HoleStep) -> bool:
    cone = 0.5 * (step.diameter - step.narrow) / math.tan(0.5 * step.angle) if step.angle < math.pi else 0.0
    start = hole.top - step.depth + cone + SAME
    return enters_cylinder(surface, hole.x, hole.y, 0.5 * step.diameter * math.cos(ANGLE), start, math.inf)


def _find_round_walls(shape: Any) -> tuple[list[RoundWall], dict[str, int], int]:
    """Find the round walls of a solid.

    Returns
    -------
    walls
        Concave round walls around vertical axes.
    by_direction
        Number of full concave cylinders in each other direction.
    free
        Number of free-form faces. The function does not detect holes in such faces.
    """
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepTools import BRepTools
    from OCP.GeomAbs import (
        GeomAbs_BezierSurface,
        GeomAbs_BSplineSurface,
        GeomAbs_Cone,
        GeomAbs_Cylinder,
        GeomAbs_SurfaceOfExtrusion,
        GeomAbs_SurfaceOfRevolution,
    )
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED

    forms = (GeomAbs_BezierSurface, GeomAbs_BSplineSurface, GeomAbs_SurfaceOfExtrusion, GeomAbs_SurfaceOfRevolution)
    walls, aside, free = [], dict[tuple[float, ...], float](), 0
    for subshape in subshapes(shape, TopAbs_FACE):
        face = as_face(subshape)
        surface = BRepAdaptor_Surface(face)
        kind = surface.GetType()
        free += kind in forms
        if kind not in (GeomAbs_Cylinder, GeomAbs_Cone):
            continue
        round_ = surface.Cylinder() if kind == GeomAbs_Cylinder else surface.Cone()
        # The normal of the surface points away from the axis, unless its axes are left-handed; the face normal
        # points out of the material.
        if (face.Orientation() == TopAbs_REVERSED) != round_.Position().Direct():
            continue
        u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
        axis, location = round_.Axis().Direction(), round_.Axis().Location()
        if abs(abs(axis.Z()) - 1.0) > PARALLEL:
            if kind == GeomAbs_Cylinder:
                key = tuple(round(value, 3) for value in _axis_direction(axis)) + tuple(
                    round(value / SAME) for value in (*_axis_foot(axis, location), round_.Radius())
                )
                aside[key] = aside.get(key, 0.0) + (u1 - u0)
            continue
        slope = 0.0 if kind == GeomAbs_Cylinder else round_.SemiAngle()
        start = round_.Radius() if kind == GeomAbs_Cylinder else round_.RefRadius()
        ends = [(location.Z() + v * math.cos(slope) * axis.Z(), abs(start + v * math.sin(slope))) for v in (v0, v1)]
        (low, low_radius), (high, high_radius) = sorted(ends)
        covers = _covered_degrees(round_.Position(), u0, u1)
        walls.append(RoundWall(location.X(), location.Y(), low, high, low_radius, high_radius, covers))
    by_direction: dict[str, int] = {}
    for key, turn in aside.items():
        if turn > math.tau - math.radians(WHOLE):
            direction = ", ".join(f"{value:g}" for value in key[:3])
            by_direction[direction] = by_direction.get(direction, 0) + 1
    return walls, by_direction, free


def _covered_degrees(axes: Any, start_angle: float, stop_angle: float) -> frozenset[int]:
    """Return the whole degrees that a piece of a round wall covers in top view."""
    angle = np.linspace(start_angle, stop_angle, max(int(math.degrees(stop_angle - start_angle) * 4.0), 2))
    along, across = axes.XDirection(), axes.YDirection()
    x = along.X() * np.cos(angle) + across.X() * np.sin(angle)
    y = along.Y() * np.cos(angle) + across.Y() * np.sin(angle)
    return frozenset((np.degrees(np.arctan2(y, x)) // 1.0).astype(np.int64).tolist())


def _axis_direction(axis: Any) -> tuple[float, float, float]:
    """Return the direction of an axis. Opposite directions get the same sign."""
    x, y, z = axis.X(), axis.Y(), axis.Z()
    sign = next((math.copysign(1.0, value) for value in (x, y, z) if abs(value) > PARALLEL), 1.0)
    return sign * x + 0.0, sign * y + 0.0, sign * z + 0.0


def _axis_foot(axis: Any, location: Any) -> tuple[float, float, float]:
    """Return the point on an axis that is nearest to the origin, which identifies the axis."""
    along = location.X() * axis.X() + location.Y() * axis.Y() + location.Z() * axis.Z()
    return location.X() - along * axis.X(), location.Y() - along * axis.Y(), location.Z() - along * axis.Z()


def _vertical_line_meets(shape: Any, x: float, y: float, low: float, high: float) -> bool:
    from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
    from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector

    lines = IntCurvesFace_ShapeIntersector()
    lines.Load(shape, 1e-7)
    lines.Perform(gp_Lin(gp_Pnt(x, y, low), gp_Dir(0, 0, 1)), 0.0, high - low)
    return int(lines.NbPnt()) > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
