"""Sections of solids by level planes: rings, pockets, openings and outlines of shapes with known sizes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

pytest.importorskip("OCP")

from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.TopAbs import TopAbs_FACE

from leafcut.geometry.polyline import Polyline
from leafcut.read import read_contours, step_sections
from leafcut.read.step_sections import (
    LevelSection,
    SectionRing,
    _count_sloping_faces,
    _find_through_openings,
    _level_faces,
    find_outlines,
    find_pockets,
    is_overhung,
    section_at,
)
from leafcut.read.step_shapes import as_face, clip_above, face_triangles, subshapes
from made_solids import UP, box, cone, cut, cylinder, fused, saved

Triangles = NDArray[np.float64]


def meshed(shape: Any) -> tuple[list[Any], Triangles]:
    """Return the faces and the triangles of a shape."""
    BRepMesh_IncrementalMesh(shape, 0.05, False, 0.3, False)
    faces = [as_face(face) for face in subshapes(shape, TopAbs_FACE)]
    return faces, np.concatenate([face_triangles(face) for face in faces])


def everywhere(*_: float) -> bool:
    return True


@pytest.mark.parametrize(
    ("height", "points"),
    [
        (5.0, [(5, 0, 5), (0, 0, 10), (0, 5, 5)]),
        (-1.0, [(10, 0, 0), (0, 0, 10), (0, 10, 0)]),
        (0.0, [(10, 0, 0), (0, 0, 10), (0, 10, 0)]),
        (10.0, []),
        (8.0, [(2, 0, 8), (0, 0, 10), (0, 2, 8)]),
    ],
)
def test_the_part_of_a_triangle_above_a_height_is_cut_off(height: float, points: list[tuple[float, ...]]) -> None:
    corners = np.array([(10, 0, 0), (0, 0, 10), (0, 10, 0)], dtype=float)
    found = clip_above(corners, height)
    assert found.tolist() == [pytest.approx(point) for point in points]
    assert clip_above(corners[[2, 0, 1]] + (0, 0, 1), height + 1).shape == found.shape


@pytest.mark.parametrize(
    ("path", "diameter"),
    [
        (Polyline.circle(5, 6, 2), 4.0),
        (Polyline.circle(5, 6, 2, clockwise=True), 4.0),
        (Polyline.of_points([(0, 0), (4, 0), (4, 4)], closed=True), 0.0),
        (Polyline(np.array([(0, 0, 1), (4, 0, 0)]), True), 0.0),
        (Polyline(np.array([(0, 0, 1), (4, 0, -1)]), True), 0.0),
        (Polyline(np.array([(0, 0, 1), (4, 0, 0.5)]), True), 0.0),
        (Polyline(np.array([(0, 0, 1), (4, 0, 1.001)]), True), 0.0),
        (Polyline(np.array([(0, 0, 1), (4, 0, 1.0001)]), True), 4.0),
    ],
)
def test_a_ring_of_arcs_around_one_centre_is_a_circle(path: Polyline, diameter: float) -> None:
    assert SectionRing(path, False).diameter == pytest.approx(diameter, abs=1e-3)


def test_a_section_has_rings_in_each_other() -> None:
    """A plate with a hole that has a pin in it, beside another plate."""
    boxes = [
        shapely.box(0, 0, 40, 40),
        shapely.box(10, 10, 30, 30),
        shapely.box(18, 18, 22, 22),
        shapely.box(50, 0, 60, 9),
    ]
    rings = [SectionRing(Polyline.of_points(list(b.exterior.coords)[:-1], closed=True), False) for b in boxes]
    section = LevelSection(rings, np.array(boxes, dtype=object), np.array([0, 1, 2, 0]), np.array([-1, 0, 1, -1]))
    places = [(5, 5), (15, 15), (20, 20), (55, 5), (45, 5)]
    assert [section.ring_around(*place) for place in places] == [0, 1, 2, 3, -1]
    assert [section.rings_within(k) for k in range(4)] == [[1], [2], [], []]
    assert [section.region(k).area for k in range(4)] == [1200, 384, 16, 90]
    assert section.material.area == 1200 + 16 + 90


TILTED = np.array([[(0, 0, 5), (10, 0, 5), (0, 10, 15)]], dtype=float)


@pytest.mark.parametrize(
    ("region", "z", "over"),
    [
        (shapely.box(-5, -5, 5, 5), 4.0, True), (shapely.box(20, 0, 30, 10), 4.0, False),
        (shapely.box(-5, -5, 5, 5), 15.0, False), (shapely.box(-5, -5, 5, 5), 10.1, False),
        (shapely.box(-5, -5, 5, 5), 9.7, True), (shapely.box(-5, -5, 0.11, 5), 4.0, False),
        (shapely.box(-5, -5, 0.13, 5), 4.0, True), (shapely.box(1, 1, 1.1, 1.1), 4.0, True),
        (shapely.box(8, 8, 8.1, 8.1), 4.0, False), (shapely.box(8, 8, 12, 12), 4.0, False),
    ],
)  # fmt: skip
def test_a_surface_hangs_over_a_region_beyond_its_edge(region: Any, z: float, over: bool) -> None:
    """A triangle rises from 5 at y 0 to 15 at y 10; 0.12 mm along the edge of a region do not count."""
    below = np.array([[(-9, -9, 0), (9, -9, 0), (0, 9, 1)]], dtype=float)
    assert is_overhung(np.concatenate([below, TILTED]), region, z) is over


def test_the_middle_of_a_face_lies_in_its_largest_triangle(monkeypatch: pytest.MonkeyPatch) -> None:
    corners = np.array(
        [[(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 0, 1), (9, 0, 1), (0, 9, 1)], [(0, 0, 1), (2, 0, 1), (0, 2, 1)]]
    )
    monkeypatch.setattr(step_sections, "face_triangles", lambda face: corners.astype(float))
    assert step_sections._face_centre(None) == (3, 3, 1)
    monkeypatch.setattr(step_sections, "face_triangles", lambda face: np.zeros((0, 3, 3)))
    assert all(math.isnan(value) for value in step_sections._face_centre(None))


def test_level_faces_face_up_or_down() -> None:
    faces, _ = meshed(cut(box(0, 0, 0, 30, 20, 10), box(10, 5, 6, 20, 15, 10)))
    up, down = ([(face.x, face.y, face.z) for face in _level_faces(faces, side)] for side in (False, True))
    assert sorted(z for _, _, z in up) == pytest.approx([6, 10]) and [z for _, _, z in down] == pytest.approx([0])
    ((x, y),) = [(x, y) for x, y, z in up if z < 7]
    assert 10 < x < 20 and 5 < y < 15


@pytest.mark.parametrize(
    ("shape", "count"),
    [
        (box(0, 0, 0, 9, 9, 9), 0),
        (cylinder((0, 0, 0), UP, 3, 9), 0),
        (cone((0, 0, 0), 3, 1, 9), 0),
        (cylinder((0, 0, 0), (1, 0, 0), 3, 9), 1),
    ],
)
def test_faces_that_slope_are_counted_where_they_are_seen(shape: Any, count: int) -> None:
    faces, _ = meshed(shape)
    points: list[tuple[float, ...]] = []

    def seen(*point: float) -> bool:
        points.append(point)
        return True

    assert _count_sloping_faces(faces, seen) == count
    # The points lie on the upper side of the cylinder.
    assert all(z > 2 for _, _, z in points) and len(points) >= count
    assert _count_sloping_faces(faces, lambda *_: False) == 0


def test_a_section_has_lines_arcs_and_chords() -> None:
    block = cut(box(0, 0, 0, 60, 40, 10), cylinder((15, 20, 0), UP, 5, 10), cone((45, 20, 0), 6, 10, 10))
    section = section_at(block, 5.0)
    found = sorted((ring.diameter, ring.leans, ring.path.n_segments, abs(ring.path.area)) for ring in section.rings)
    assert found == [
        (0.0, False, 4, pytest.approx(2400)),
        (pytest.approx(10), False, 2, pytest.approx(math.pi * 25)),
        (pytest.approx(16), True, 2, pytest.approx(math.pi * 64)),
    ]
    assert sorted(section.depth.tolist()) == [0, 1, 1]
    # A cylinder at 45° has an ellipse as its section, with chords within 0.005 mm.
    (ring,) = section_at(cylinder((0, 0, 0), (1, 0, 1), 5, 40), 14.0).rings
    x, y = ring.path.vertices[:, 0] - 14, ring.path.vertices[:, 1]
    assert np.hypot(x / math.sqrt(2), y) == pytest.approx(5, abs=0.01) and ring.leans
    assert len(section_at(block, 20.0).rings) == 0 and section_at(block, 20.0).material.is_empty


def test_pockets_are_closed_level_and_free_above() -> None:
    """A pocket with an island, an open step, a pocket with a sloping wall, and one under a roof."""
    solid = cut(
        box(0, 0, 0, 120, 60, 20),
        cut(box(10, 10, 14, 40, 50, 20), box(20, 20, 14, 30, 30, 20)),
        box(100, 0, 15, 120, 60, 20),
        cone((60, 15, 12), 5, 8, 8),
        box(50, 30, 12, 90, 50, 20),
    )
    solid = fused(solid, box(60, 25, 20, 70, 55, 23))
    faces, triangles = meshed(solid)
    found = find_pockets(solid, triangles, faces, everywhere)
    assert {key: found[key] for key in ("highest", "open", "leaning", "covered", "sloping")} == {
        "highest": pytest.approx(23),
        "open": 3,
        "leaning": 1,
        "covered": 1,
        "sloping": 0,
    }
    (pocket,) = found["pockets"]
    assert (pocket["z"], pocket["diameter"], len(pocket["islands"])) == (14, 0, 1)
    assert abs(Polyline(np.array(pocket["outline"]), True).area) == pytest.approx(1200)
    assert abs(Polyline(np.array(pocket["islands"][0]), True).area) == pytest.approx(100)
    assert find_pockets(solid, triangles, faces, lambda *_: False)["open"] == 0


def plate(*holes: Any) -> Triangles:
    """Return the upper side of a plate of 60 by 40 mm with holes as triangles."""
    area = shapely.box(0, 0, 60, 40) - shapely.union_all(holes)
    flat = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    corners = np.array([shapely.orient_polygons(one).exterior.coords[:3] for one in flat])
    return np.concatenate([corners, np.zeros((len(corners), 3, 1))], axis=2)


@pytest.mark.parametrize(
    ("hole", "diameter", "area"),
    [
        (shapely.box(10, 10, 30, 20), 0.0, 200), (shapely.Point(20, 20).buffer(5, quad_segs=16), 10.0, math.pi * 25),
        (shapely.Point(20, 20).buffer(5, quad_segs=2), 0.0, 70.7), (shapely.box(10, 10, 30, 10.04), 0.0, 0),
        (shapely.box(10, 10, 30, 10.06), 0.0, 1.2),
    ],
)  # fmt: skip
def test_openings_are_holes_of_the_shadow(hole: Any, diameter: float, area: float) -> None:
    found = _find_through_openings(plate(hole))
    assert [one["diameter"] for one in found] == ([pytest.approx(diameter, abs=0.05)] if area else [])
    outlines = [shapely.Polygon([point[:2] for point in one["outline"]]) for one in found]
    assert [outline.area for outline in outlines] == ([pytest.approx(area, rel=0.01)] if area else [])
    assert all(point[2] == 0 for one in found for point in one["outline"])


def outlines(shape: Any) -> dict[str, Any]:
    faces, triangles = meshed(shape)
    return find_outlines(shape, triangles, faces, everywhere)


def test_a_sheet_has_the_outlines_of_a_section_that_equals_its_shadow() -> None:
    flat = outlines(cut(box(0, 0, 0, 40, 30, 3), cylinder((20, 15, 0), UP, 5, 3)))
    assert not flat["uneven"]
    areas = sorted(abs(Polyline(np.array(row), True).area) for row in flat["outlines"])
    assert areas == pytest.approx([math.pi * 25, 1200])
    # Chamfers above and below: only the middle is as wide as the shadow.
    disc = fused(cone((0, 0, 0), 9, 10, 1), cylinder((0, 0, 1), UP, 10, 1), cone((0, 0, 2), 10, 9, 1))
    found = outlines(disc)
    assert found["uneven"] and SectionRing(
        Polyline(np.array(found["outlines"][0]), True), False
    ).diameter == pytest.approx(20)
    # A recess from above or from below is not cut.
    for z in (0, 2):
        found = outlines(cut(box(0, 0, 0, 40, 30, 3), box(10, 10, z, 20, 20, z + 1)))
        assert found["uneven"] and len(found["outlines"]) == 1


def test_a_solid_without_such_a_section_is_no_sheet() -> None:
    stairs = fused(box(0, 0, 0, 20, 20, 3), box(15, 0, 3, 40, 20, 6))
    assert outlines(stairs) == {
        "problem": "the solid is not a flat sheet: no level section equals its view from above; cut it from a drawing "
        "of its outline"
    }


@pytest.mark.usefixtures("opencascade_at_hand")
def test_a_recess_in_a_sheet_is_missing_work(tmp_path: Path) -> None:
    part = read_contours(saved(tmp_path / "a.step", cut(box(0, 0, 0, 40, 30, 3), box(10, 10, 2, 20, 20, 3))))
    assert [str(issue) for issue in part.issues] == [
        "L219 the sheet also has pockets, steps or chamfers, which will not be cut"
    ]
    (issue,) = part.issues
    assert issue.missing is not None and (issue.missing.what, issue.missing.count) == ("feature", 1)
