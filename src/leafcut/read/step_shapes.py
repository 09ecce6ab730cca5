"""Functions for OpenCASCADE shapes. The module `step_solid` and its submodules share them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Which solid to read: the only solid or all solids. A number selects a single solid.
ONLY, ALL = "only", "all"
#: Two unit vectors are parallel if they differ by at most this.
PARALLEL = 1e-6


def subshapes(shape: Any, kind: Any) -> Iterator[Any]:
    """Yield the subshapes of one kind, such as faces or edges."""
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def as_face(shape: Any) -> Any:
    """Cast a shape to a face."""
    from OCP.TopoDS import TopoDS

    return TopoDS.Face(shape) if hasattr(TopoDS, "Face") else TopoDS.Face_s(shape)


def as_edge(shape: Any) -> Any:
    """Cast a shape to an edge."""
    from OCP.TopoDS import TopoDS

    return TopoDS.Edge(shape) if hasattr(TopoDS, "Edge") else TopoDS.Edge_s(shape)


def face_triangles(face: Any) -> NDArray[np.float64]:
    """Return the triangles of a meshed face, float64[n, 3, 3]. They are counter-clockwise when seen from outside."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_REVERSED
    from OCP.TopLoc import TopLoc_Location

    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, location)
    if mesh is None:
        return np.zeros((0, 3, 3))
    move = location.Transformation()
    points = [mesh.Node(k).Transformed(move) for k in range(1, mesh.NbNodes() + 1)]
    corners = np.array([(p.X(), p.Y(), p.Z()) for p in points])
    rows = [mesh.Triangle(k) for k in range(1, mesh.NbTriangles() + 1)]
    index = np.array([(t.Value(1), t.Value(2), t.Value(3)) for t in rows], dtype=np.int64) - 1
    if face.Orientation() == TopAbs_REVERSED:
        index = index[:, ::-1]
    triangles: NDArray[np.float64] = corners[index]
    return triangles


def clip_above(corners: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Clip a flat convex polygon to the part above a height, and keep the order of the corners."""
    clipped = []
    for start, stop in pairwise((*corners, corners[0])):
        if start[2] > height:
            clipped.append(start)
        if (start[2] > height) != (stop[2] > height):
            clipped.append(start + (stop - start) * ((height - start[2]) / (stop[2] - start[2])))
    return np.array(clipped).reshape(-1, 3)
