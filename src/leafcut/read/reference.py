"""Compute the reference outline of a part for `--origin`.

All commands use the same reference outline, regardless of layers and hole selections. It comes from the complete
drawing without texts, dimensions and drawing frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour, is_annotation_layer
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.format import Format, Source
from leafcut.read.registry import run_reader

#: Tolerance for joining lines, mm. It does not depend on `--join-tolerance`, so that this option does not move the
#: zero.
JOINED = 0.05


def read_whole_drawing(format_: Format, loaded: Source, options: ReadOptions) -> Part:
    """Read the complete drawing, ignoring the layer and hole selections in `options`.

    Raises the same errors as `read_whole`.
    """
    everything = replace(options, layers=(), min_diameter=None, max_diameter=None, concentric="all")
    reader = format_.whole or format_.contours or format_.read
    return run_reader(replace(format_, read=reader), loaded, everything)


def read_reference_geometry(format_: Format, loaded: Source, options: ReadOptions) -> Part | None:
    """Return the closed outlines of a drawing, or its complete geometry if no outline is closed.

    Return None if the program machines everything in the drawing, as for drill files, point maps and pictures. The
    origin then depends only on the centres of the holes. Raises the same errors as `read_whole_drawing`.
    """
    if format_.whole is None and format_.contours is None:
        filtered = options.layers or options.min_diameter is not None or options.max_diameter is not None
        return read_whole_drawing(format_, loaded, options) if filtered else None
    return closed_outlines(read_whole_drawing(format_, loaded, options))


def closed_outlines(whole: Part) -> Part:
    """Return the closed outlines, circles and points of a drawing.

    The outermost closed outline determines the bounding box. An open path around all closed outlines is an outline with
    a gap, so the function then returns the complete geometry.
    """
    from leafcut.geometry.tidying import tidy_outlines  # start-up: it needs shapely

    drawn = [c for c in whole.contours if c.kind != "text"]
    kept = [c.path for c in drawn if not is_annotation_layer(c.layer)]
    holes = [h for h in whole.holes if not is_annotation_layer(h.layer)]
    if not kept and not holes:
        kept, holes = [c.path for c in drawn], list(whole.holes)
    try:
        paths = [joined.path for joined in tidy_outlines(kept, JOINED).paths]
    except PlanError:  # hundreds of ends in one point: the outline is unknown
        paths = kept
    closed = _geometry_as_part([path for path in paths if path.closed], holes)
    opened = [path for path in paths if not path.closed]
    if not (closed.holes or closed.contours) or any(_surrounds(path.extents, closed.extents) for path in opened):
        return _geometry_as_part(paths, holes)
    return closed


def _geometry_as_part(paths: Sequence[Polyline], holes: Sequence[Hole]) -> Part:
    circles = [Polyline.circle(h.x, h.y, 0.5 * h.diameter) for h in holes if h.diameter]
    points = tuple(h for h in holes if not h.diameter)
    return Part("", points, contours=tuple(Contour(path) for path in (*paths, *circles)))


def _surrounds(outer: tuple[float, float, float, float], inner: tuple[float, float, float, float]) -> bool:
    """Return whether the box `outer` extends beyond the box `inner` on every side by more than `JOINED`."""
    below = all(outer[k] < inner[k] - JOINED for k in (0, 1))
    return below and all(outer[k] > inner[k] + JOINED for k in (2, 3))
