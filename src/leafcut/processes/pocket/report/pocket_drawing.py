"""Drawing of pockets: walls, islands, tool path, entries, and uncut areas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from leafcut.geometry.arrays import segments
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import polygons, shrink, swept
from leafcut.material.removal import swept_area
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.model.pocket import Pocket, PocketPath, PocketPlan, PocketRules
from leafcut.report.frame import Frame
from leafcut.report.marks import arrow_head, end_marks
from leafcut.report.missing_drawing import missing_drawing, missing_points
from leafcut.report.svg import element, lines_data, scaled_group, svg_number, title

#: Chord error for arcs, in user units of the drawing.
_CHORDS = 0.06
#: Tolerance for uncut and unreachable areas in the drawing, mm; coarser than the tolerance of the path.
_SEEN = 0.02
#: Arrowheads: spacing along a path and half length, in user units of the drawing, and maximum number.
_ARROW_APART, _ARROW, _MOST_ARROWS = 70.0, 3.2, 90
_HATCH = 4.0
_WIDE_FROM = 1.9
#: Kinds of path sections, from the lowest layer of the drawing to the highest.
_KINDS = ("rough", "link", "entry", "finish")


@dataclass(frozen=True, eq=False)
class PocketShapes:
    """The area of a pocket that the tool cannot reach, and the reachable area that remains uncut (shapely geometry)."""

    unreachable: Any
    uncovered: Any


@dataclass(frozen=True, eq=False)
class PocketScene:
    """Data that all drawings of a page share: the frame, the pockets, and the issues about missing work."""

    frame: Frame
    pockets: tuple[Pocket, ...]
    missing: tuple[Issue, ...] = ()


def build_pocket_scene(plans: Sequence[PocketPlan], missing: tuple[Issue, ...] = ()) -> PocketScene:
    """Return the scene of all pockets of a drawing."""
    boxes = np.array([plan.pocket.outline.extents for plan in plans])
    corners = np.concatenate([boxes.reshape(-1, 2), missing_points(missing)])
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    frame = Frame.around((low[0], low[1]), (high[0], high[1]), _WIDE_FROM)
    return PocketScene(frame, tuple(p.pocket for p in plans), missing)


def shapes_of(pocket: Pocket, path: PocketPath, rules: PocketRules) -> PocketShapes:
    """Return the unreachable area and the uncut area of a pocket. Films no thicker than the tolerance are left out."""
    whole = pocket.region(_SEEN)
    reachable = swept(shrink(whole, rules.radius, _SEEN), rules.radius, _SEEN).intersection(whole)
    steps = np.concatenate([segments(piece.path.flattened(0.5 * _SEEN)) for piece in path.pieces])
    cleared = swept_area(steps, rules.radius + _SEEN, 24)
    return PocketShapes(_visible_area(whole.difference(reachable)), _visible_area(reachable.difference(cleared)))


def _visible_area(shape: Any) -> Any:
    film = 2.0 * _SEEN
    return shape.buffer(-film).buffer(film, join_style="mitre").intersection(shape)


def pocket_drawing(
    scene: PocketScene,
    paths: Sequence[PocketPath],
    name: str,
    words: str,
    *,
    shapes: Sequence[PocketShapes] = (),
    tool_diameter: float = 0.0,
    size: bool = False,
) -> str:
    """Return an SVG element with the pockets and a path in each of them.

    The title of the element is `words`; `name` must be unique on the page.
    """
    frame, window = scene.frame, f"window-{name}"
    parts = (
        *(_pocket(frame, pocket) for pocket in scene.pockets),
        *(_unfinished_areas(frame, one, f"{name}-{k}") for k, one in enumerate(shapes)),
        *(_tool_path(frame, path) for path in paths),
        *(_arrows(frame, path) for path in paths),
    )
    lost = missing_drawing(frame, scene.missing)
    inside = (element("g", *parts, clip_path=f"url(#{window})"), lost, *_marks(frame, paths, tool_diameter))
    return frame.drawing(words, window, inside, "drawing pocket", size)


def small_drawing(scene: PocketScene, paths: Sequence[PocketPath], words: str) -> str:
    """Return a small SVG drawing of pockets and paths, without axes and marks."""
    frame = scene.frame
    parts = (*(_pocket(frame, p) for p in scene.pockets), *(_tool_path(frame, path) for path in paths))
    box = f"0 0 {svg_number(frame.width)} {svg_number(frame.height)}"
    return element("svg", title(words), *parts, viewBox=box, class_="drawing pocket small", role="img")


# -- shapes ----------------------------------------------------------------------------------------------------------


def _pocket(frame: Frame, pocket: Pocket) -> str:
    walls = "".join(f"{_line(frame, path)}z" for path in (pocket.outline, *pocket.islands))
    named = title(Message("pocket {}", pocket.name)) if pocket.name else ""
    return scaled_group(element("path", named, d=walls, class_="floor"))


def _unfinished_areas(frame: Frame, shapes: PocketShapes, name: str) -> str:
    """Draw unreachable areas hatched, and uncut areas filled."""
    drawn = []
    if not shapes.unreachable.is_empty:
        clip, hatch = f"far-{name}", _hatch(frame, shapes.unreachable)
        outline = scaled_group(element("path", d=_area_path(frame, shapes.unreachable)))
        drawn.append(element("clipPath", outline_of(frame, shapes.unreachable), id=clip))
        drawn.append(element("g", outline, element("g", hatch, clip_path=f"url(#{clip})"), class_="far"))
    if not shapes.uncovered.is_empty:
        drawn.append(
            scaled_group(element("path", title("stays uncut"), d=_area_path(frame, shapes.uncovered), class_="uncut"))
        )
    return "".join(drawn)


def outline_of(frame: Frame, shape: Any) -> str:
    """Return the SVG path around an area, for use in a clip path."""
    return element("path", d=_area_path(frame, shape), transform="scale(0.03125)", clip_rule="evenodd")


def _hatch(frame: Frame, shape: Any) -> str:
    x0, y0, x1, y1 = shape.bounds
    (left, bottom), (right, top) = frame.place(np.array([[x0, y0], [x1, y1]])).tolist()
    height = bottom - top
    count = min(math.ceil((right - left + height) / _HATCH) + 1, 400)
    lines = [
        f"M{svg_number(left + k * _HATCH - height)} {svg_number(bottom)}l{svg_number(height)} {svg_number(-height)}"
        for k in range(count)
    ]
    return element("path", d="".join(lines), class_="hatch")


def _area_path(frame: Frame, shape: Any) -> str:
    rings = [ring for p in polygons(shape) for ring in (p.exterior, *p.interiors)]
    return "".join(f"{lines_data(segments(frame.place(np.asarray(r.coords)[:, :2])))}z" for r in rings)


def _line(frame: Frame, path: Polyline) -> str:
    return lines_data(segments(frame.place(path.flattened(_CHORDS / frame.scale))))


# -- the tool path ---------------------------------------------------------------------------------------------------


def _tool_path(frame: Frame, path: PocketPath) -> str:
    data: dict[str, str] = {}
    for piece in path.pieces:
        data[piece.kind] = data.get(piece.kind, "") + _line(frame, piece.path)
    rapids = [
        [a.path.end, b.path.start]
        for a, b, gap in zip(path.pieces[:-1], path.pieces[1:], path.gaps, strict=True)
        if gap > 0.0
    ]
    lines = [element("path", d=data[kind], class_=f"way {kind}") for kind in _KINDS if kind in data]
    if rapids:
        moves = lines_data(frame.place(np.array(rapids)))
        lines.append(element("path", d=moves, class_="rapid"))
    return scaled_group(*lines)


def _arrows(frame: Frame, path: PocketPath) -> str:
    apart = max(_ARROW_APART / frame.scale, path.feed_mm / _MOST_ARROWS)
    heads: dict[str, list[str]] = {}
    waiting = 0.5 * apart
    for piece in path.pieces:
        at = waiting
        while at < piece.path.length:
            (x, y), (dx, dy) = frame.place(np.array(piece.path.point_at(at))).tolist(), piece.path.direction_at(at)
            heads.setdefault(piece.kind, []).append(arrow_head((x, y), (dx, -dy), _ARROW))
            at += apart
        waiting = at - piece.path.length
    return "".join(element("path", d="".join(h), class_=f"head {kind}") for kind, h in sorted(heads.items()))


def _marks(frame: Frame, paths: Sequence[PocketPath], tool_diameter: float) -> list[str]:
    drawn = [path for path in paths if path.pieces]
    if not drawn:
        return []
    first = frame.place(np.array(drawn[0].pieces[0].path.start)).tolist()
    last = frame.place(np.array(drawn[-1].pieces[-1].path.end)).tolist()
    marks = []
    if tool_diameter > 0.0:
        radius = 0.5 * tool_diameter * frame.scale
        marks.append(element("circle", title("the tool"), cx=first[0], cy=first[1], r=radius, class_="tool-disc"))
    downs = [
        frame.place(np.array(piece.path.start)).tolist()
        for path in drawn
        for piece, gap in zip(path.pieces, (math.inf if path is not drawn[0] else 0.0, *path.gaps), strict=True)
        if gap > 0.0
    ]
    marks += [element("circle", cx=x, cy=y, r=2.4, class_="down") for x, y in downs]
    return [*marks, *end_marks((*first, 4.6), (*last, 4.2), (frame.width, frame.height))]
