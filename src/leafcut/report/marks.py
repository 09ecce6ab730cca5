"""Draw marks on paths: arrow heads, and the first and last position."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from leafcut.report.svg import element, svg_number, text_element

_MAX_ARROWS = 28
_SHORTEST_ARROWED = 22.0
_ARROW = 4.2
#: Minimum distance between arrow heads, user units.
_ARROWS_APART = 13.0
_GOLDEN = 0.618034
#: Space for a word to the right of a mark, user units. If there is less space, the word moves to the left of the mark.
_WORD = 50.0


def arrow_heads_svg(segments: NDArray[np.float64], reach: float = _ARROW) -> str:
    """Draw arrow heads in the middle of some long rapids, spread over the path.

    `reach` is half the length of an arrow head.
    """
    along = segments[:, 1] - segments[:, 0]
    length = np.hypot(along[:, 0], along[:, 1])
    long = np.flatnonzero(length >= min(_SHORTEST_ARROWED, length.max(initial=0.0) * 0.9))
    if not len(long):
        return ""
    if len(long) > _MAX_ARROWS:
        # Take one rapid from each section of the path, at varying positions, so that heads in a grid are not aligned.
        spread = np.arange(_MAX_ARROWS) + np.arange(_MAX_ARROWS) * _GOLDEN % 1.0
        long = long[(spread * len(long) / _MAX_ARROWS).astype(np.int64)]
    heads: list[str] = []
    middles: list[tuple[float, float]] = []
    for row in long[length[long] > 2 * reach].tolist():
        (dx, dy), (mx, my) = (along[row] / length[row]).tolist(), segments[row].mean(axis=0).tolist()
        if any(math.hypot(mx - x, my - y) < _ARROWS_APART for x, y in middles):
            continue
        middles.append((mx, my))
        heads.append(arrow_head_path_data((mx, my), (dx, dy), reach))
    return element("path", d="".join(heads), class_="arrow")


def arrow_head_path_data(middle: tuple[float, float], along: tuple[float, float], reach: float) -> str:
    """Return the path data of an arrow head.

    The caller passes its centre, its direction (unit vector) and half its length.
    """
    (mx, my), (dx, dy) = middle, along
    wings = [(mx + s * dy * reach * 0.62 - dx * reach, my - s * dx * reach * 0.62 - dy * reach) for s in (1, -1)]
    tip = (mx + dx * reach, my + dy * reach)
    return "M" + "L".join(f"{svg_number(px)} {svg_number(py)}" for px, py in (wings[0], tip, wings[1])) + "z"


def end_marks_svg(
    first: tuple[float, float, float], last: tuple[float, float, float], size: tuple[float, ...]
) -> list[str]:
    """Draw a ring around the first position and a square around the last position.

    Each position is given as x, y and radius, user units. If `size` contains the width and height of the drawing, the
    function adds the words "start" and "end".
    """
    (x0, y0, ring), (x1, y1, half) = first, last
    side = svg_number(2 * half)
    square = f"M{svg_number(x1 - half)} {svg_number(y1 - half)}h{side}v{side}h{svg_number(-2 * half)}z"
    shapes = (element("circle", cx=x0, cy=y0, r=ring), element("path", d=square))
    marks = [element("g", *shapes, class_="halo"), element("g", *shapes, class_="end")]
    if size:
        marks += [_mark_label_svg("start", x0, y0, ring, *size), _mark_label_svg("end", x1, y1, half, *size)]
    return marks


def label_side(x: float, width: float) -> float:
    """Return on which side of a mark at x its word fits: 1 for right, -1 for left."""
    return -1.0 if x > width - _WORD else 1.0


def _mark_label_svg(word: str, x: float, y: float, reach: float, width: float, height: float) -> str:
    side = label_side(x, width)
    y = min(max(y, 8.0), height - 8.0)
    return text_element(
        word,
        x + side * (reach + 4),
        y,
        dy="0.35em",
        text_anchor="end" if side < 0 else "start",
        class_="mark",
    )
