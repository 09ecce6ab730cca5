"""Draw a sheet: parts, kerfs, leads, rapids, marks, and the pierces with their order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Cut, CutPlan
from leafcut.model.issue import Issue
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.report.cut_words import cut_title, part_title
from leafcut.report.drawing import RAMP
from leafcut.report.frame import Frame
from leafcut.report.labels import Surroundings, label_positions
from leafcut.report.marks import arrow_head_path_data, arrow_heads_svg, end_marks_svg, label_side
from leafcut.report.missing_drawing import missing_work_svg
from leafcut.report.svg import (
    STEPS,
    element,
    scaled_group_element,
    segments_path_data,
    svg_number,
    text_element,
    title_element,
)

#: Chord error for arcs, in user units of the drawing.
_CHORDS = 0.06
#: Minimum width of a drawn kerf, in user units, for sheets with few cuts and with many cuts.
_THINNEST_KERF = 0.8
_THINNEST_KERF_OF_MANY = 0.65
#: If there are more cuts than this, lines and dots are smaller, and rapids are coloured from first to last.
_FEW = 60
#: Maximum number of labels. On a sheet with more cuts, only every second, fifth or tenth cut (and so on) has a number.
_MOST_NUMBERS = 60
_EVERY = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
#: Minimum length of a cut that gets an arrowhead, in user units, and position of the arrowhead, as a share of the
#: length.
_LONG_CUT = 70.0
_ARROW_AT = 0.3
_KERF_ARROW = 2.6
_HATCH = 5.0
#: Aspect ratio from which a drawing spans both columns of the page, for few cuts and for many cuts.
_WIDE_FROM = (2.4, 1.6)
_RAPID_ARROW, _RAPID_ARROW_OF_MANY = 3.6, 2.8
#: Numbers keep clear of the words "start" and "end" by avoiding discs around them. These are the distances of the discs
#: from the mark, and their radius, in user units.
_WORD_DISCS = (10.0, 20.0, 30.0)
_WORD_DISC = 5.0
#: If the last cut is closer to the end than this, the word "end" replaces its number, in user units.
_AT_ITS_END = 12.0


@dataclass(frozen=True, eq=False)
class SheetScene:
    """Data that all drawings of a sheet share.

    Attributes
    ----------
    every
        Cuts are numbered in steps of this size.
    many
        Whether there are enough cuts that rapids are coloured by their position in the order.
    kerf
        Width of the drawn kerf, in user units.
    true_kerf
        Whether the width of the drawn kerf is to scale.
    """

    frame: Frame
    sheet: Sheet
    every: int
    many: bool
    kerf: float
    true_kerf: bool
    missing: tuple[Issue, ...] = ()

    @property
    def dot(self) -> float:
        """Radius of the dot for a pierce, in user units."""
        return 1.3 if self.many else 1.9


def build_sheet_scene(plans: list[CutPlan], missing: tuple[Issue, ...] = ()) -> SheetScene:
    """Collect the data that all drawings of a sheet share, including the issues about missing work."""
    sheet = plans[-1].sheet
    boxes = [c.path.extents for plan in plans for c in plan.cuts]
    boxes += [c.path.extents for c in sheet.contours]
    boxes += [*sheet.zones, *([sheet.outline.extents] if sheet.outline is not None else [])]
    corners = np.array(boxes, dtype=np.float64).reshape(-1, 4)
    if not len(corners):
        corners = np.zeros((1, 4))
    low, high = corners[:, :2].min(axis=0).tolist(), corners[:, 2:].max(axis=0).tolist()
    cuts = max(len(plan.cuts) for plan in plans)
    every = next((e for e in _EVERY if cuts <= e * _MOST_NUMBERS), _EVERY[-1])
    many = cuts > _FEW
    frame = Frame.around_corners((low[0], low[1]), (high[0], high[1]), _WIDE_FROM[many])
    thinnest = _THINNEST_KERF_OF_MANY if many else _THINNEST_KERF
    kerf = plans[-1].data.kerf * frame.scale
    return SheetScene(frame, sheet, every, many, max(kerf, thinnest), kerf >= thinnest, missing)


def sheet_drawing(
    scene: SheetScene, plan: CutPlan, name: str, words: str, *, parts: str = "", size: bool = False
) -> str:
    """Draw a plan as an SVG element with `words` as its title.

    Parameters
    ----------
    name
        A name that is unique on the page.
    parts
        With ``"=name"``, the SVG defines the parts under an id. With ``"#name"``, it reuses the parts of another SVG on
        the page.
    size
        Whether the element has a width and height.
    """
    frame = scene.frame
    drawn = element("use", href=parts) if parts.startswith("#") else _draw_sheet(scene, plan, parts.removeprefix("="))
    moves, arrow = _travel_moves(frame, plan), _RAPID_ARROW_OF_MANY if scene.many else _RAPID_ARROW
    window = f"window-{name}"
    moving = (
        _draw_rapids(scene, moves),
        *(_draw_cut(scene, plan, k) for k in range(len(plan.cuts))),
        _draw_kerf_arrows(scene, plan),
    )
    inside = (
        drawn,
        missing_work_svg(frame, scene.missing),
        element("g", *moving, arrow_heads_svg(moves, arrow), clip_path=f"url(#{window})"),
        *_draw_order_marks(scene, plan, moves),
    )
    return frame.drawing_svg(words, window, inside, "drawing sheet ramped" if scene.many else "drawing sheet", size)


# -- the sheet and its parts -----------------------------------------------------------------------------------------


def part_id(part: int) -> str:
    """Return the SVG id of a part."""
    return f"part-{part}"


def _draw_sheet(scene: SheetScene, plan: CutPlan, name: str) -> str:
    frame, sheet = scene.frame, scene.sheet
    shapes = []
    if sheet.outline is not None:
        shapes.append(element("path", d=_area_data(frame, sheet.paths), class_="stock"))
    areas: dict[int, list[Polyline]] = {}
    for c in sheet.contours:
        if c.kind == "cut" and c.path.closed and c.part and not c.chamber:
            areas.setdefault(c.part, []).append(c.path)
    for part, paths in areas.items():
        words = title_element(part_title(plan, part))
        shapes.append(
            element("path", words, id=part_id(part) if name else None, d=_area_data(frame, paths), class_="part")
        )
    return element(
        "g", scaled_group_element(*shapes), *(_draw_clamp(frame, zone) for zone in sheet.zones), id=name or None
    )


def part_window(scene: SheetScene, part: int) -> str:
    """Return the SVG view box around a part, in the units of its path, or "" if the part does not exist."""
    boxes = [c.path.extents for c in scene.sheet.contours if c.part == part and c.kind == "cut" and c.path.closed]
    if not boxes:
        return ""
    x0, y0, x1, y1 = (f(b[i] for b in boxes) for i, f in enumerate((min, min, max, max)))
    (left, bottom), (right, top) = scene.frame.to_user_units(np.array([[x0, y0], [x1, y1]])).tolist()
    margin = 0.04 * max(right - left, bottom - top)
    edges = (left - margin, top - margin, right - left + 2 * margin, bottom - top + 2 * margin)
    return " ".join(svg_number(STEPS * e) for e in edges)


def _chords(frame: Frame, path: Polyline) -> Points:
    return frame.to_user_units(path.flattened(_CHORDS / frame.scale))


def _area_data(frame: Frame, paths: Sequence[Polyline]) -> str:
    return "".join(f"{segments_path_data(_segments(_chords(frame, path)))}z" for path in paths)


def _segments(points: Points) -> Points:
    return np.stack([points[:-1], points[1:]], axis=1)


def _draw_clamp(frame: Frame, zone: tuple[float, float, float, float]) -> str:
    (x0, y1), (x1, y0) = frame.to_user_units(np.array([zone[:2], zone[2:]])).tolist()
    width, height = x1 - x0, y1 - y0
    lines = []
    for k in range(1, min(math.ceil((width + height) / _HATCH), 200)):
        # Draw lines at 45° from the left or the bottom edge to the top or the right edge.
        at = k * _HATCH
        left, top = (max(at - height, 0.0), min(at, height)), (min(at, width), max(at - width, 0.0))
        lines.append(
            f"M{svg_number(x0 + left[0])} {svg_number(y0 + left[1])}"
            f"L{svg_number(x0 + top[0])} {svg_number(y0 + top[1])}"
        )
    edge = element("rect", x=x0, y=y0, width=width, height=height)
    return element(
        "g", title_element("clamp: the torch stays out"), edge, element("path", d="".join(lines)), class_="clamp"
    )


# -- the cuts --------------------------------------------------------------------------------------------------------


def path_sections(cut: Cut) -> list[tuple[str, float, float]]:
    """Divide the path of a cut into sections. Each section has a kind, a start and an end, mm along the path.

    The kinds are ``kerf``, ``lead``, ``bridge``, ``dark`` and ``mark``. Micro-joints are ``dark``, and so are overcuts
    with the torch off. Corner loops in the scrap count as leads.
    """
    whole = cut.path.length
    places = {0.0, cut.lead_in, cut.lead_out, cut.torch_off_at, whole}
    places |= {at for span in (*cut.joints, *cut.loops, *cut.bridges) for at in span}
    edges = sorted(at for at in places if 0.0 <= at <= whole)
    found: list[tuple[str, float, float]] = []
    for low, high in itertools.pairwise(edges):
        kind = _kind_at(cut, 0.5 * (low + high))
        begin = found.pop()[1] if found and found[-1][0] == kind else low
        found.append((kind, begin, high))
    return found


def _kind_at(cut: Cut, at: float) -> str:
    if at > cut.torch_off_at or any(a < at < b for a, b in cut.joints):
        return "dark"
    if cut.kind == "mark":
        return "mark"
    if any(a < at < b for a, b in cut.bridges):
        return "bridge"
    if at < cut.lead_in or at > cut.lead_out or any(a < at < b for a, b in cut.loops):
        return "lead"
    return "kerf"


def _draw_cut(scene: SheetScene, plan: CutPlan, number: int) -> str:
    cut, frame = plan.cuts[number], scene.frame
    data: dict[str, str] = {}
    for kind, low, high in path_sections(cut):
        points = _chords(frame, cut.path.piece(low, high))
        data[kind] = data.get(kind, "") + segments_path_data(_segments(points))
    # Leads are drawn over the kerf, because they are short and start at its end.
    lines = [
        element("path", d=d, class_=kind, stroke_width=_line_width(scene, kind)) for kind, d in sorted(data.items())
    ]
    x, y = frame.to_user_units(np.array(cut.path.start)).tolist()
    dot = element("circle", cx=x, cy=y, r=scene.dot * (0.8 if cut.kind == "mark" else 1.0), class_=dot_class(cut))
    return element("g", title_element(cut_title(plan, number)), scaled_group_element(*lines), dot)


def _line_width(scene: SheetScene, kind: str) -> float:
    if kind == "dark":
        return 0.6 * STEPS
    return STEPS * (scene.kerf if kind == "kerf" else max(scene.kerf, _THINNEST_KERF))


def dot_class(cut: Cut) -> str:
    """Return the CSS class of the dot at the start of a cut.

    It depends on the kind of start: a pierce, the edge, or a mark.
    """
    return "begin mark" if cut.kind == "mark" else "begin pierce" if cut.pierce else "begin edge-start"


def _draw_kerf_arrows(scene: SheetScene, plan: CutPlan) -> str:
    heads = []
    for cut in plan.cuts:
        length = cut.lead_out - cut.lead_in
        if length * scene.frame.scale >= _LONG_CUT:
            at = cut.lead_in + _ARROW_AT * length
            (x, y), (dx, dy) = (
                scene.frame.to_user_units(np.array(cut.path.point_at(at))).tolist(),
                cut.path.direction_at(at),
            )
            heads.append(arrow_head_path_data((x, y), (dx, -dy), _KERF_ARROW))
    return element("path", d="".join(heads), class_="kerf-arrow") if heads else ""


# -- the order -------------------------------------------------------------------------------------------------------


def _travel_moves(frame: Frame, plan: CutPlan) -> Points:
    """Return the travel moves between cuts in user units, float64[n, 2, 2]."""
    moves = [(a.path.end, b.path.start) for a, b in zip(plan.cuts[:-1], plan.cuts[1:], strict=True)]
    return frame.to_user_units(np.array(moves, dtype=np.float64).reshape(-1, 2, 2))


def _draw_rapids(scene: SheetScene, moves: Points) -> str:
    """Draw the travel moves as thin dashed lines. If there are many cuts, the lines are coloured from first to last."""
    if not scene.many:
        return scaled_group_element(element("path", d=segments_path_data(moves), class_="rapid")) if len(moves) else ""
    chunks = np.array_split(moves, RAMP)
    return scaled_group_element(
        *(element("path", d=segments_path_data(c), class_=f"rapid r{i}") for i, c in enumerate(chunks) if len(c))
    )


def _draw_order_marks(scene: SheetScene, plan: CutPlan, moves: Points) -> list[str]:
    if not plan.cuts:
        return []
    frame = scene.frame
    starts = frame.to_user_units(np.array([c.path.start for c in plan.cuts]))
    end = frame.to_user_units(np.array(plan.cuts[-1].path.end)).tolist()
    size = (frame.width, frame.height)
    reach = scene.dot + 3.0
    marks = end_marks_svg((*starts[0].tolist(), reach), (*end, reach), size)
    # The first cut has the word "start"; a last cut close to the end has the word "end".
    worded = {0, len(starts) - 1} if math.dist(starts[-1], end) < _AT_ITS_END else {0}
    numbered = [k for k in range(len(plan.cuts)) if (k + 1) % scene.every == 0 and k not in worded]
    lines = np.concatenate([moves, *(_segments(_chords(frame, c.path)) for c in plan.cuts)])
    free = np.full(len(starts), scene.dot)
    free[0] = reach + 1.0
    dots = np.column_stack([starts, free])
    stops = np.column_stack([starts, free, np.zeros(len(starts))])[numbered]
    words, font = [str(k + 1) for k in numbered], 7.5 if scene.many else 9.0
    kept = [[*end, reach]]
    for x, y in (starts[0].tolist(), end):
        side = label_side(x, frame.width)
        kept += [[x + side * (reach + beside), y, _WORD_DISC] for beside in _WORD_DISCS]
    spots = label_positions(stops, words, font, Surroundings(np.concatenate([dots, np.array(kept)]), lines, size))
    numbers = [text_element(w, s[0], s[1], dy="0.35em") for w, s in zip(words, spots, strict=True) if s]
    return [*marks, element("g", *numbers, class_="number", font_size=font, stroke_width=font * 0.3)]


def legend(scene: SheetScene, plans: list[CutPlan]) -> dict[str, Any]:
    """Return the marks and colours that appear in the drawings."""
    cuts = [cut for plan in plans for cut in plan.cuts]
    kinds = {kind for cut in cuts for kind, _, _ in path_sections(cut)}
    return {
        "kinds": kinds,
        "true_kerf": scene.true_kerf,
        "stock": scene.sheet.outline is not None,
        "clamps": bool(scene.sheet.zones),
        "edges": any(c.kind == "cut" and not c.pierce for c in cuts),
        "pierces": any(c.kind == "cut" and c.pierce for c in cuts),
        "every": {1: "numbers give the order", 2: "every second start has its number in the order"}.get(
            scene.every, f"every {scene.every}th start has its number in the order"
        ),
        "ramp": [f"r{i}" for i in range(0, RAMP, 3)] if scene.many else None,
    }
