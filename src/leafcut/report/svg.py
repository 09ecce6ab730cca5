"""Write SVG as text, with escaped attributes, and with compact path data for up to a hundred thousand points."""

from __future__ import annotations

import math
from html import escape

import numpy as np
from numpy.typing import NDArray

from leafcut.report.wording import replace_unprintable

#: Number of integer steps of path data per user unit. The steps are too small to see, but keep the numbers short.
STEPS = 32


def element(tag: str, *children: str, **attributes: str | float | None) -> str:
    """Return ``<tag attributes>children</tag>``. Attributes are escaped, but children must already be SVG.

    In attribute names, a trailing underscore is dropped, and other underscores become hyphens. An attribute with the
    value None is left out.
    """
    words = [tag]
    for name, value in attributes.items():
        if value is not None:
            text = replace_unprintable(value) if isinstance(value, str) else svg_number(value)
            words.append(f'{name.rstrip("_").replace("_", "-")}="{escape(text)}"')
    return f"<{' '.join(words)}>{''.join(children)}</{tag}>"


def text_element(words: str, x: float, y: float, **attributes: str | float | None) -> str:
    """Return a text element with escaped words."""
    return element("text", escape(replace_unprintable(words)), x=x, y=y, **attributes)


def centred_text_element(words: str, x: float, y: float, width: float) -> str:
    """Return a text element centred at x. If the text does not fit into the given width, it is shifted to the left."""
    half = 3.6 * len(words)
    return text_element(words, min(x, width - half), y, text_anchor="middle")


def title_element(words: str) -> str:
    """Return the accessible title of a drawing."""
    return element("title", escape(replace_unprintable(words)))


def embed_styles(svg: str, css: str) -> str:
    """Embed styles into a drawing, and return the text of an SVG file."""
    head, end_of_title, rest = svg.partition("</title>")
    return f"{head}{end_of_title}{element('style', css)}{rest}\n"


def svg_number(value: float) -> str:
    """Format a finite number with at most two decimals, without trailing zeros."""
    words = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if words == "-0" else words


def segments_path_data(segments: NDArray[np.float64]) -> str:
    """Return the path data of straight segments, float64[n, 2, 2], user units, in `STEPS`.

    A segment that starts at the end of the previous segment continues its line. Relative numbers are differences of
    rounded absolute numbers, so rounding errors do not add up.
    """
    if not len(segments):
        return ""
    rows = np.rint(segments.reshape(-1, 4) * STEPS).astype(np.int64)
    joined = np.concatenate([[False], (rows[1:, :2] == rows[:-1, 2:]).all(axis=1)])
    words = []
    for (x0, y0, x1, y1), continues in zip(rows.tolist(), joined.tolist(), strict=True):
        if not continues:
            words.append(f"M{x0} {y0}l")
        elif words:
            words.append(" ")
        words.append(_joined_coordinates(x1 - x0, y1 - y0))
    return "".join(words)


def dots_path_data(points: NDArray[np.float64]) -> str:
    """Return the path data of dots at points, float64[n, 2], user units, in `STEPS`.

    A dot is a line of length 0 (``h0``), which round caps turn into a disc. A dot takes ten characters, and a circle
    element takes fifty.
    """
    rows = np.rint(points * STEPS).astype(np.int64)
    moves = np.diff(rows, axis=0, prepend=np.zeros((1, 2), dtype=np.int64))
    return "".join(f"m{_joined_coordinates(x, y)}h0" for x, y in moves.tolist())


def _joined_coordinates(x: int, y: int) -> str:
    return f"{x}{y}" if y < 0 else f"{x} {y}"


def scaled_group_element(*children: str) -> str:
    """Wrap path data in a group that scales the data from `STEPS` to user units."""
    return element("g", *children, transform=f"scale({1 / STEPS:g})")


def tick_step(span: float, count: int) -> float:
    """Return a tick spacing that gives about `count` ticks over `span`. It is 1, 2 or 5 times a power of ten."""
    if not span > 0:
        return 1.0
    rough = span / count
    power = 10.0 ** math.floor(math.log10(rough))
    # A slightly smaller step is better than a much larger one: 2 for 2.6, not 5.
    return next(power * f for f in (1.0, 2.0, 5.0, 10.0) if power * f >= 0.75 * rough)


def ticks(low: float, high: float, step: float) -> list[float]:
    """Return the multiples of `step` between `low` and `high`, but no more than a hundred."""
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [i * step for i in range(first, min(last, first + 100) + 1)]


def tick_label(value: float, step: float) -> str:
    """Format the label of a tick, with as many decimals as the tick step."""
    places = max(0, -math.floor(math.log10(step) + 1e-9)) if step > 0 else 0
    return f"{value:.{places}f}".replace("-", "−") if abs(value) > step / 2 else "0"
