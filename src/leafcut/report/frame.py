"""The frame of a drawing: the visible range in mm, its scale, its axes, and a scale bar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.report.svg import (
    centred_text_element,
    element,
    svg_number,
    text_element,
    tick_label,
    tick_step,
    ticks,
    title_element,
)

#: Width of a drawing in one column and in both columns of the page, user units. A unit is about one screen pixel.
WIDTH = 480.0
WIDE = 960.0
_WIDE_FROM = 2.4
_TOP, _BOTTOM, _RIGHT = 6.0, 44.0, 6.0
_TICK = 4.0
_LARGEST_HEIGHT = 1.35 * WIDTH
_SMALLEST_HEIGHT = 0.28 * WIDTH
_MARGIN = 0.04
_CHARACTER = 6.8
_WIDEST_NUMBERS = 120.0


@dataclass(frozen=True)
class Frame:
    """A window on the part. It maps mm (y up) to user units (y down).

    Attributes
    ----------
    low, high
        Corners of the window, mm.
    scale
        Number of user units per mm.
    left
        Space for the numbers of the y axis, user units.
    width, height
        Size of the window, user units.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    scale: float
    left: float
    width: float
    height: float

    @classmethod
    def around_corners(
        cls, low: tuple[float, float], high: tuple[float, float], wide_from: float = _WIDE_FROM
    ) -> Frame:
        """Create the frame around two corners, in mm, with a margin.

        If the frame is more than `wide_from` times as wide as high, it spans both columns of the page.
        """
        span = max(high[0] - low[0], high[1] - low[1])
        margin = _MARGIN * span if span > 0 else 10.0
        spans = [high[i] - low[i] + 2 * margin for i in range(2)]
        middle = [(high[i] + low[i]) / 2 for i in range(2)]
        step = tick_step(max(spans), 6)
        numbers = (tick_label(middle[1] + s * spans[1] / 2, step) for s in (-1, 1))
        left = min(28.0 + _CHARACTER * max(len(n) for n in numbers), _WIDEST_NUMBERS)
        width = (WIDE if spans[0] > wide_from * spans[1] else WIDTH) - left - _RIGHT
        height = min(max(width * spans[1] / spans[0], _SMALLEST_HEIGHT), _LARGEST_HEIGHT)
        scale = min(width / spans[0], height / spans[1])
        # Extend the range to the edges of the window, so that the part is in its middle.
        low = (middle[0] - width / scale / 2, middle[1] - height / scale / 2)
        high = (middle[0] + width / scale / 2, middle[1] + height / scale / 2)
        return cls(low, high, scale, left, width, height)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the whole drawing with its axes, user units."""
        return (self.left + self.width + _RIGHT, _TOP + self.height + _BOTTOM)

    @property
    def needs_both_columns(self) -> bool:
        """Whether the drawing needs the whole width of a page."""
        return self.width > WIDTH

    def to_user_units(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert points, float64[…, 2], from mm to user units, relative to the upper left corner of the window."""
        placed: NDArray[np.float64] = np.stack(
            [(points[..., 0] - self.low[0]) * self.scale, (self.high[1] - points[..., 1]) * self.scale], axis=-1
        )
        return placed

    @property
    def upper_left(self) -> tuple[float, float]:
        """Upper left corner of the window in the drawing, user units."""
        return (self.left, _TOP)

    def drawing_svg(self, words: str, window: str, inside: tuple[str, ...], kind: str, size: bool) -> str:
        """Draw a complete drawing with its axes as an SVG element.

        Parameters
        ----------
        window
            Id of the clip path.
        inside
            Elements to draw, in user units relative to the window.
        kind
            CSS class of the drawing.
        size
            Whether the SVG states its width and height, which a separate file needs.
        """
        (width, height), (x, y) = self.size, self.upper_left
        edge = element("rect", x=0.0, y=0.0, width=self.width, height=self.height)
        return element(
            "svg",
            title_element(words),
            element("clipPath", edge, id=window),
            self.axes_svg(),
            element("g", *inside, transform=f"translate({svg_number(x)} {svg_number(y)})"),
            viewBox=f"0 0 {svg_number(width)} {svg_number(height)}",
            width=width if size else None,
            height=height if size else None,
            class_=kind,
            role="img",
            xmlns="http://www.w3.org/2000/svg" if size else None,
        )

    def axes_svg(self) -> str:
        """Draw the edge of the frame, ticks in mm on the left and at the bottom, and a scale bar."""
        step = tick_step(max(self.high[0] - self.low[0], self.high[1] - self.low[1]), 6)
        marks, numbers = [], []
        x0, y0 = self.upper_left
        bottom = y0 + self.height
        for value in ticks(self.low[0], self.high[0], step):
            x = x0 + (value - self.low[0]) * self.scale
            marks.append(f"M{svg_number(x)} {svg_number(bottom)}v{svg_number(_TICK)}")
            numbers.append(centred_text_element(tick_label(value, step), x, bottom + 15, self.size[0]))
        for value in ticks(self.low[1], self.high[1], step):
            y = y0 + (self.high[1] - value) * self.scale
            marks.append(f"M{svg_number(x0)} {svg_number(y)}h{svg_number(-_TICK)}")
            numbers.append(text_element(tick_label(value, step), x0 - _TICK - 3, y, text_anchor="end", dy="0.34em"))
        edge = element("rect", x=x0, y=y0, width=self.width, height=self.height, rx=1.0, class_="edge")
        names = text_element("x mm", x0, bottom + 36) + text_element(
            "y mm",
            11,
            y0 + self.height / 2,
            text_anchor="middle",
            transform=f"rotate(-90 11 {svg_number(y0 + self.height / 2)})",
        )
        return element(
            "g", edge, element("path", d="".join(marks), class_="tick"), *numbers, names, self._scale_bar_svg(step)
        )

    def _scale_bar_svg(self, step: float) -> str:
        """Draw a scale bar as long as a tick step. Unlike a ratio, a bar stays correct when the page is scaled."""
        length = step * self.scale
        x, y = self.left + self.width - length, _TOP + self.height + 33
        path = f"M{svg_number(x)} {svg_number(y - 3)}v6m0 -3h{svg_number(length)}m0 -3v6"
        return element("path", d=path, class_="bar") + text_element(
            f"{tick_label(step, step)} mm", x - 6, y, text_anchor="end", dy="0.34em"
        )
