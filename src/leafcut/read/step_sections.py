"""Compute the pockets and outlines of a solid from horizontal sections, as part of the subprocess `step_solid`.

In a section just above the floor, a closed pocket appears as a hole in the material. Islands appear inside this hole.
The curves are exact lines and arcs. Faces and triangles show whether walls are vertical, and whether the part has
overhangs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.containment import nesting_depths_and_parents
from leafcut.geometry.joining import join_paths
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import polygons as polygons_of
from leafcut.geometry.tidying import chord_polygons
from leafcut.message import Message
from leafcut.read.step_shapes import PARALLEL, as_edge, as_face, clip_above, face_triangles, subshapes

#: Height of a section above its floor, mm.
OVER = 0.01
#: Tolerance of the lines that approximate free curves, mm.
CHORD = 0.005
#: Tolerance for joining the curves of a section, mm.
ENDS = 1e-4
#: Largest Z component of the normals of a vertical face.
UPRIGHT = 1e-5
#: Overhangs over a pocket that are smaller than this, mm, come from the chords of the pocket's own walls.
HANGS = 0.12
#: Maximum number of heights of level faces.
MOST_HEIGHTS = 200
#: Openings narrower than this, mm, are gaps between triangles.
NARROWEST = 0.05
#: Minimum roundness 4 π A / P² of a circle made of chords.
ROUND = 0.98
#: Tolerance between the sections of a flat sheet: area, mm², per mm of outline.
SAME_EDGE = 0.02


class SectionRing(NamedTuple):
    """A closed curve in a section. `leans` is true if at least one of its faces is not vertical."""

    path: Polyline
    leans: bool

    @property
    def diameter(self) -> float:
        """Diameter of the ring, mm, or 0 if the ring is not a circle."""
        bulges = self.path.bulges
        if not len(bulges) or not (bulges != 0.0).all() or np.ptp(np.sign(bulges)):
            return 0.0
        arcs = list(self.path.segments())
        x, y = arcs[0].center
        same = all(math.dist(arc.center, (x, y)) < 1e-3 and abs(arc.radius - arcs[0].radius) < 1e-3 for arc in arcs)
        return 2.0 * arcs[0].radius if same else 0.0


@dataclass(frozen=True)
class LevelSection:
    """The rings of a section. Each ring has its nesting depth, and the index of its parent or −1."""

    rings: list[SectionRing]
    shapes: NDArray[Any]
    depth: NDArray[np.int64]
    parent: NDArray[np.int64]

    def ring_around(self, x: float, y: float) -> int:
        """Return the index of the smallest ring around a point, or −1."""
        inside = np.flatnonzero(shapely.contains_xy(self.shapes, x, y))
        return int(inside[np.argmin(shapely.area(self.shapes[inside]))]) if len(inside) else -1

    def rings_within(self, ring: int) -> list[int]:
        """Return the rings directly inside a ring."""
        return np.flatnonzero(self.parent == ring).tolist()

    def region(self, ring: int) -> Any:
        """Return the area inside a ring. The rings directly inside this ring are cut out."""
        inner = [self.shapes[k].exterior for k in self.rings_within(ring)]
        return shapely.Polygon(self.shapes[ring].exterior, inner)

    @property
    def material(self) -> Any:
        """The cross-section of the material at this height."""
        return shapely.union_all([self.region(k) for k in np.flatnonzero(self.depth % 2 == 0).tolist()])


class LevelFace(NamedTuple):
    """A point on a horizontal face that faces up, mm."""

    x: float
    y: float
    z: float


def find_pockets(
    shape: Any, triangles: NDArray[np.float64], faces: Sequence[Any], seen: Callable[[float, float, float], bool]
) -> dict[str, Any]:
    """Return the closed pockets with level floors and vertical walls, and the number of rejected pockets by reason.

    The function `seen` returns whether a point is visible from above.
    """
    highest = float(triangles[:, :, 2].max())
    floors = [face for face in _level_faces(faces) if face.z < highest - OVER]
    result: dict[str, Any] = {"pockets": [], "highest": highest, "open": 0, "leaning": 0, "covered": 0}
    result["openings"] = _find_through_openings(triangles)
    result["sloping"] = _count_sloping_faces(faces, seen)
    by_height: dict[float, list[LevelFace]] = {}
    for floor in floors:
        by_height.setdefault(round(floor.z, 3), []).append(floor)
    if len(by_height) > MOST_HEIGHTS:
        return {
            "problem": Message(
                "the solid has level faces at {} heights; at most {} are read", len(by_height), MOST_HEIGHTS
            )
        }
    for height in sorted(by_height, reverse=True):
        section = section_at(shape, by_height[height][0].z + OVER)
        rings_done = set[int]()
        for floor in by_height[height]:
            ring = section.ring_around(floor.x, floor.y)
            if ring < 0 or section.depth[ring] % 2 == 0:
                result["open"] += seen(floor.x, floor.y, floor.z)
                continue
            if ring in rings_done:
                continue
            rings_done.add(ring)
            if is_overhung(triangles, section.region(ring), height + 2.0 * OVER):
                result["covered"] += 1
            elif any(section.rings[k].leans for k in (ring, *section.rings_within(ring))):
                result["leaning"] += 1
            else:
                result["pockets"].append(_pocket_as_dict(section, ring, height))
    return result


def _find_through_openings(triangles: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return the outline of each through-opening in top view, with its diameter, or 0 if the opening is not round.

    An opening at any height is a hole in the shadow of the solid.
    """
    film, openings = 0.5 * NARROWEST, []
    rings = shapely.MultiPolygon(
        [shapely.Polygon(ring) for piece in polygons_of(_shadow_area(triangles)) for ring in piece.interiors]
    )
    for shape in polygons_of(rings.buffer(-film).buffer(film, join_style="mitre")):
        round_ = 4.0 * math.pi * shape.area > ROUND * shape.length**2
        diameter = 2.0 * math.sqrt(shape.area / math.pi) if round_ else 0.0
        outline = [(x, y, 0.0) for x, y in shapely.get_coordinates(shape.exterior)[:-1].tolist()]
        openings.append({"outline": outline, "diameter": diameter})
    return openings


def find_outlines(
    shape: Any, triangles: NDArray[np.float64], faces: Sequence[Any], seen: Callable[[float, float, float], bool]
) -> dict[str, Any]:
    """Find the outlines of a solid in top view, using a level section that equals the shadow of the solid.

    If no section equals the shadow, the result contains a `problem`. If sections at other heights differ, the result is
    `uneven`. It then also contains the pockets, and `other` states whether the solid has further features. The function
    `seen` returns whether a point is visible from above.
    """
    highest, lowest = float(triangles[:, :, 2].max()), float(triangles[:, :, 2].min())
    steps = sorted({round(face.z, 3) for face in (*_level_faces(faces), *_level_faces(faces, down=True))})
    if len(steps) > MOST_HEIGHTS:
        return {
            "problem": Message("the solid has level faces at {} heights; at most {} are read", len(steps), MOST_HEIGHTS)
        }
    middle = 0.5 * (lowest + highest)
    heights = [middle] if min(abs(z - middle) for z in (*steps, lowest)) > OVER else []
    heights += [lowest + OVER, highest - OVER]
    heights += [z + offset for z in steps for offset in (OVER, -OVER) if lowest < z + offset < highest]
    shadow = _shadow_area(triangles)
    allowed = SAME_EDGE * shadow.length
    sections = [section_at(shape, z) for z in heights]
    missing = [float(shapely.area(shadow.symmetric_difference(section.material))) for section in sections]
    best = min(range(len(heights)), key=lambda k: (missing[k] > allowed, k if missing[k] <= allowed else missing[k]))
    if missing[best] > allowed or not len(sections[best].rings):
        return {
            "problem": Message(
                "the solid is not a flat sheet: no level section equals its view from above; cut it from a "
                "drawing of its outline"
            )
        }
    material = sections[best].material
    uneven = any(shapely.area(material.symmetric_difference(section.material)) > allowed for section in sections)
    result: dict[str, Any] = {
        "outlines": [ring.path.vertices.tolist() for ring in sections[best].rings],
        "uneven": uneven,
    }
    if not uneven:
        return result
    result |= find_pockets(shape, triangles, faces, seen)
    pockets = [(pocket["z"], _pocket_region(pocket)) for pocket in result["pockets"]]
    cut_at = [shapely.union_all([region for floor, region in pockets if floor < z]) for z in heights]
    rests = [material - section.material - cut for section, cut in zip(sections, cut_at, strict=True)]
    return result | {"other": any(shapely.area(rest) > allowed for rest in rests)}


def _pocket_region(pocket: dict[str, Any]) -> Any:
    outline, *islands = [
        Polyline(np.array(path), True).flattened(CHORD) for path in (pocket["outline"], *pocket["islands"])
    ]
    return shapely.Polygon(outline, islands)


def section_at(shape: Any, z: float) -> LevelSection:
    """Cut a solid with a horizontal plane, and return the section."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Section
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS_Shape

    cutting = BRepAlgoAPI_Section(shape, gp_Pln(gp_Pnt(0, 0, z), gp_Dir(0, 0, 1)), False)
    cutting.Approximation(False)
    cutting.Build()
    strokes: list[Polyline] = []
    leaning: list[tuple[float, float]] = []
    for edge in subshapes(cutting.Shape(), TopAbs_EDGE):
        vertices = _edge_vertices(edge)
        if vertices is None:
            continue
        face = TopoDS_Shape()
        if cutting.HasAncestorFaceOn1(edge, face) and not _is_vertical(face):
            middle = Polyline(vertices).flattened(CHORD)
            leaning += [tuple(middle[len(middle) // 2, :2].tolist()), tuple(middle[0, :2].tolist())]
        closed = len(vertices) > 2 and math.dist(vertices[0, :2], vertices[-1, :2]) < ENDS
        strokes.append(Polyline(vertices[:-1], True) if closed else Polyline(vertices))
    paths = [
        joined.path for joined in join_paths(strokes, ENDS).paths if joined.path.closed and abs(joined.path.area) > 1e-6
    ]
    shapes = np.array(list(chord_polygons(paths)), dtype=object)
    depth, parent = (
        nesting_depths_and_parents(shapes) if paths else (np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    )
    points: Any = shapely.points(leaning) if leaning else []
    edges = shapely.boundary(shapes)
    leans = [bool(len(points)) and bool(shapely.dwithin(edge, points, 0.02).any()) for edge in edges]
    return LevelSection(
        [SectionRing(path, is_leaning) for path, is_leaning in zip(paths, leans, strict=True)], shapes, depth, parent
    )


def is_overhung(triangles: NDArray[np.float64], region: Any, z: float) -> bool:
    """Return whether any surface above a height overhangs a region. The edge of the region does not count."""
    inner = region.buffer(-HANGS)
    if inner.is_empty:
        inner = region.representative_point()
    high = triangles[triangles[:, :, 2].max(axis=1) > z]
    boxes = shapely.box(*(high[:, :, k].min(axis=1) for k in (0, 1)), *(high[:, :, k].max(axis=1) for k in (0, 1)))
    for k in np.flatnonzero(shapely.intersects(boxes, inner)).tolist():
        piece = clip_above(high[k], z)
        if len(piece) and shapely.MultiPoint(piece[:, :2]).convex_hull.intersects(inner):
            return True
    return False


def _pocket_as_dict(section: LevelSection, ring: int, z: float) -> dict[str, Any]:
    outline, islands = section.rings[ring], [section.rings[k] for k in section.rings_within(ring)]
    return {
        "z": z,
        "diameter": 0.0 if islands else outline.diameter,
        "outline": outline.path.vertices.tolist(),
        "islands": [island.path.vertices.tolist() for island in islands],
    }


def _shadow_area(triangles: NDArray[np.float64]) -> Any:
    a, b, c = triangles[:, 0, :2], triangles[:, 1, :2], triangles[:, 2, :2]
    up = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) > (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    flat: Any = shapely.polygons(triangles[up, :, :2])  # every triangle that faces down has one above it that faces up
    return shapely.union_all(flat[shapely.area(flat) > 1e-9], grid_size=1e-5)


def _level_faces(faces: Sequence[Any], down: bool = False) -> Iterator[LevelFace]:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_Plane
    from OCP.TopAbs import TopAbs_REVERSED

    for face in faces:
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() != GeomAbs_Plane:
            continue
        position = surface.Plane().Position()
        up = position.Direction().Z() * (1.0 if position.Direct() else -1.0)
        up *= -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
        if abs(up - (-1.0 if down else 1.0)) < PARALLEL:
            x, y, z = _face_centre(face)
            yield LevelFace(x, y, z)


def _face_centre(face: Any) -> tuple[float, float, float]:
    corners = face_triangles(face)
    if not len(corners):
        return math.nan, math.nan, math.nan
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    size = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    x, y, z = corners[int(np.argmax(size))].mean(axis=0).tolist()
    return x, y, z


def _count_sloping_faces(faces: Sequence[Any], seen: Callable[[float, float, float], bool]) -> int:
    """Count the visible sloping faces that face up. Level faces, vertical faces and cones of holes do not count."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_Cone

    count = 0
    for face in faces:
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() == GeomAbs_Cone and abs(abs(surface.Cone().Axis().Direction().Z()) - 1.0) < PARALLEL:
            continue
        corners = face_triangles(face)
        if not len(corners) or np.ptp(corners[:, :, 2]) < 1e-6 or _is_vertical(face):
            continue
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        up = np.argsort(-normals[:, 2])[:4]
        points = corners[up[normals[up, 2] > 1e-6]].mean(axis=1)
        count += any(seen(*point) for point in points.tolist())
    return count


def _is_vertical(face: Any) -> bool:
    """Return whether a face is vertical. The function tests the normals on a grid of points."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepLProp import BRepLProp_SLProps
    from OCP.BRepTools import BRepTools
    from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane

    face = as_face(face)
    surface = BRepAdaptor_Surface(face)
    if surface.GetType() == GeomAbs_Plane:
        return bool(abs(surface.Plane().Axis().Direction().Z()) < UPRIGHT)
    if surface.GetType() == GeomAbs_Cylinder:
        return bool(abs(abs(surface.Cylinder().Axis().Direction().Z()) - 1.0) < PARALLEL)
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    for u in np.linspace(u0, u1, 6).tolist():
        for v in np.linspace(v0, v1, 6).tolist():
            properties = BRepLProp_SLProps(surface, u, v, 1, 1e-9)
            if properties.IsNormalDefined() and abs(properties.Normal().Z()) > UPRIGHT:
                return False
    return True


def _edge_vertices(edge: Any) -> NDArray[np.float64] | None:
    """Return the vertices of an edge as x, y and bulge, float64[n, 3], or None if the edge has no length."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_QuasiUniformDeflection
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

    curve = BRepAdaptor_Curve(as_edge(edge))
    first, last = curve.FirstParameter(), curve.LastParameter()
    kind, bulge = curve.GetType(), 0.0
    if kind == GeomAbs_Line:
        parameters = [first, last]
    elif kind == GeomAbs_Circle:
        # An arc with a bulge must not exceed half a turn.
        n_arcs = max(math.ceil((last - first) / math.pi - 1e-9), 1)
        parameters = np.linspace(first, last, n_arcs + 1).tolist()
        position = curve.Circle().Position()
        bulge = math.copysign(math.tan(0.25 * (last - first) / n_arcs), position.Direction().Z())
    else:
        points = GCPnts_QuasiUniformDeflection(curve, CHORD)
        parameters = [points.Parameter(k) for k in range(1, points.NbPoints() + 1)]
    rows = np.array([(p.X(), p.Y(), bulge) for p in map(curve.Value, parameters)])
    rows[-1, 2] = 0.0
    return rows if np.hypot(*np.diff(rows[:, :2], axis=0).T).sum() > 1e-7 else None
