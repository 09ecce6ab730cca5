"""Thumbnails of a drawing. Each kind of work has its own thumbnail, which emphasizes the objects to machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.polyline import Polyline
from leafcut.model.part import Hole, Part

#: Width, height and margin of a thumbnail, in units of the thumbnail.
WIDTH, HEIGHT, MARGIN = 96, 56, 4
#: Maximum number of outlines and of holes, maximum number of points, and minimum distance between points.
_MAX_HOLES, _MAX_POINTS, _MIN_STEP = 1_500, 6_000, 0.5
_TOLERANCE = 0.15
#: Objects below this size are drawn as dots.
_SMALL = 1.0


class Thumbnails:
    """Thumbnails of a drawing. They share the SVG paths of its objects."""

    def __init__(self, whole: Part) -> None:
        frame = _Frame(_extents_with_holes(whole))
        sizes = np.array([_longer_side(c.path) for c in whole.contours])
        left = _MAX_POINTS
        self._contours: dict[int, str] = {}
        # Largest first, so that only the smallest objects are omitted.
        for k in np.argsort(-sizes, kind="stable")[:_MAX_HOLES].tolist():
            if left <= 0:
                break
            self._contours[k], count = frame.polyline_path_data(
                whole.contours[k].path, small=sizes[k] * frame.scale < _SMALL
            )
            left -= count
        step = max(len(whole.holes) // _MAX_HOLES, 1)
        self._holes = {k: frame.hole_path_data(whole.holes[k]) for k in range(0, len(whole.holes), step)}

    def picture(
        self, contours: NDArray[np.bool_] | None, holes: NDArray[np.bool_] | None, style: str
    ) -> dict[str, str]:
        """Return the SVG path data of a thumbnail: ``strong``, ``faint``, and ``style``.

        Parameters
        ----------
        contours, holes
            Masks of the objects to emphasize, bool[n], or None to emphasize nothing.
        style
            One of `Process.pictured`. The styles ``holes`` and ``areas`` are filled, and the style ``lines`` is not.
        """
        paths: dict[bool, list[str]] = {True: [], False: []}
        for drawn, chosen in ((self._contours, contours), (self._holes, holes)):
            for k, data in drawn.items():
                paths[chosen is not None and bool(chosen[k])].append(data)
        return {"strong": "".join(paths[True]), "faint": "".join(paths[False]), "style": style}


class _Frame:
    def __init__(self, extents: tuple[float, float, float, float]) -> None:
        x0, y0, x1, y1 = extents
        width, height = max(x1 - x0, 1e-6), max(y1 - y0, 1e-6)
        self.scale = min((WIDTH - 2 * MARGIN) / width, (HEIGHT - 2 * MARGIN) / height)
        self.x = 0.5 * WIDTH - self.scale * 0.5 * (x0 + x1)
        self.y = 0.5 * HEIGHT + self.scale * 0.5 * (y0 + y1)

    def polyline_path_data(self, path: Polyline, *, small: bool) -> tuple[str, int]:
        if small:
            x0, y0, x1, y1 = path.extents
            return self._dot_path_data(*self._to_picture(np.array([[0.5 * (x0 + x1), 0.5 * (y0 + y1)]]))[0]), 1
        places = self._to_picture(path.flattened(_TOLERANCE / self.scale))
        kept = places[_indices_to_draw(places)]
        steps = "L".join(f"{x:.1f} {y:.1f}" for x, y in kept.tolist())
        return f"M{steps}{'Z' if path.closed else ''}", len(kept)

    def hole_path_data(self, hole: Hole) -> str:
        x, y, radius = self.x + self.scale * hole.x, self.y - self.scale * hole.y, 0.5 * self.scale * hole.diameter
        if 2.0 * radius < _SMALL:
            return self._dot_path_data(x, y)
        arc = f"a{radius:.1f} {radius:.1f} 0 1 0"
        return f"M{x - radius:.1f} {y:.1f}{arc}{2 * radius:.1f} 0{arc}{-2 * radius:.1f} 0Z"

    def _to_picture(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack([self.x + self.scale * places[:, 0], self.y - self.scale * places[:, 1]])

    @staticmethod
    def _dot_path_data(x: float, y: float) -> str:
        return f"M{x - 0.6:.1f} {y:.1f}h1.2v1.2h-1.2z"


def _extents_with_holes(whole: Part) -> tuple[float, float, float, float]:
    """Return the bounding box of a drawing with its complete holes. `Part.extents` covers only their centres."""
    x0, y0, x1, y1 = whole.extents
    for hole in whole.holes:
        r = 0.5 * hole.diameter
        x0, y0, x1, y1 = min(x0, hole.x - r), min(y0, hole.y - r), max(x1, hole.x + r), max(y1, hole.y + r)
    return x0, y0, x1, y1


def _longer_side(path: Polyline) -> float:
    x0, y0, x1, y1 = path.extents
    return max(x1 - x0, y1 - y0)


def _indices_to_draw(places: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the indices of the points to draw.

    If consecutive points lie in the same grid cell, only the first is drawn.
    """
    cells = np.round(places / _MIN_STEP)
    new = np.ones(len(places), dtype=np.bool_)
    new[1:] = np.any(cells[1:] != cells[:-1], axis=1)
    return np.flatnonzero(new)
