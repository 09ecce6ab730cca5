"""A height field as a picture: coloured by depth, with light from the upper left, and a scale."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.report.colours import RGB

if TYPE_CHECKING:
    from leafcut.stock.height_field import HeightField

#: From the top of the stock down to its deepest place: lightness falls all the way, so that any colour vision reads it.
_DEPTHS: tuple[RGB, ...] = (
    (238, 240, 236),
    (168, 212, 189),
    (77, 166, 173),
    (42, 108, 150),
    (38, 50, 108),
    (30, 14, 56),
)
#: What is cut through, the paper, what is written, and the edge of the scale.
_THROUGH, _PAPER, _INK, _EDGE = (255, 196, 92), (255, 255, 255), (40, 44, 48), (150, 154, 158)
#: The longer side of the picture of the field, pixels: at least and at most.
_LEAST, _MOST = 900, 1800
#: Margin, and room for the scale on the right, pixels.
_MARGIN, _SCALE = 28, 150
#: How strongly slopes are shaded.
_SHADE = 0.55


def stock_png(field: HeightField, top: float) -> bytes:
    """Return a height field as a PNG, seen from above, y upwards; `top` is the height of the uncut stock, mm."""
    from PIL import Image, ImageDraw, ImageFont

    heights, through = _at_size(field)
    lowest = float(heights[~through].min()) if (~through).any() else field.floor
    bottom = min(lowest, top - 1e-6)
    colours = _coloured(heights, top, bottom) * _light(heights, field, heights.shape[0])[..., None]
    colours[through] = _THROUGH
    picture = Image.fromarray(np.clip(colours, 0, 255).astype(np.uint8)[::-1])
    width, height = picture.size
    page = Image.new("RGB", (width + 2 * _MARGIN + _SCALE, height + 2 * _MARGIN), _PAPER)
    page.paste(picture, (_MARGIN, _MARGIN))
    draw, font = ImageDraw.Draw(page), ImageFont.load_default(20)
    draw.rectangle((_MARGIN - 1, _MARGIN - 1, _MARGIN + width, _MARGIN + height), outline=_EDGE)
    _draw_scale(draw, font, (2 * _MARGIN + width, _MARGIN), min(height - 40, 420), top, bottom, bool(through.any()))
    out = io.BytesIO()
    page.save(out, "PNG", optimize=True)
    return out.getvalue()


def _at_size(field: HeightField) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the heights, one a pixel, and which pixels are cut through: few cells are enlarged, many thinned out."""
    heights = field.heights.astype(np.float64)
    longer = max(heights.shape)
    if longer < _LEAST:
        times = -(-_LEAST // longer)
        heights = np.repeat(np.repeat(heights, times, axis=0), times, axis=1)
    elif longer > _MOST:
        step = longer / _MOST
        rows, columns = ((np.arange(max(int(n / step), 1)) * step).astype(np.int64) for n in heights.shape)
        heights = heights[np.ix_(rows, columns)]
    return heights, heights <= field.floor + 1e-6


def _coloured(heights: NDArray[np.float64], top: float, bottom: float) -> NDArray[np.float64]:
    place = np.clip((top - heights) / (top - bottom), 0.0, 1.0)
    stops = np.linspace(0.0, 1.0, len(_DEPTHS))
    colours = [np.interp(place, stops, [colour[k] for colour in _DEPTHS]) for k in range(3)]
    return np.stack(colours, axis=-1)


def _light(heights: NDArray[np.float64], field: HeightField, rows: int) -> NDArray[np.float64]:
    """Return how light every pixel is for its slope, about 1 where it is flat."""
    size = field.cell * field.heights.shape[0] / rows
    if min(heights.shape) < 2:
        return np.ones_like(heights)
    rise_y, rise_x = np.gradient(heights, size)
    lean = (rise_x - rise_y) / np.sqrt(1.0 + rise_x**2 + rise_y**2)
    light: NDArray[np.float64] = 1.0 + _SHADE * np.clip(lean, -1.0, 0.6)
    return light


def _draw_scale(
    draw: Any, font: Any, at: tuple[int, int], length: int, top: float, bottom: float, through: bool
) -> None:
    """Draw the colours of the heights from top to bottom, with their numbers, and what cut through looks like."""
    x, y = at
    ramp = _coloured(np.linspace(top, bottom, max(length, 2)), top, bottom)
    for row, colour in enumerate(ramp.astype(int).tolist()):
        draw.line((x, y + row, x + 22, y + row), fill=tuple(colour))
    draw.rectangle((x - 1, y - 1, x + 23, y + length), outline=_EDGE)
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        height = top + share * (bottom - top)
        draw.text((x + 32, y + share * length), f"{height:.2f} mm", fill=_INK, font=font, anchor="lm")
    if through:
        draw.rectangle((x - 1, y + length + 18, x + 23, y + length + 38), fill=_THROUGH, outline=_EDGE)
        draw.text((x + 32, y + length + 28), "through", fill=_INK, font=font, anchor="lm")
