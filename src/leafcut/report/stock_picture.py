"""Draw a height field from above, coloured by depth, with shaded walls, axes and a scale."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter, ImageFont

from leafcut.report.svg import tick_label, tick_step, ticks
from leafcut.units import to_fixed

if TYPE_CHECKING:
    from leafcut.material.height_field import HeightField
    from leafcut.report.styles import RGB

#: Colours from the top of the stock to its deepest point. Lightness falls steadily, so that the picture is readable
#: with any colour vision. The darkest colour is still light enough for shadows.
DEPTHS: tuple[RGB, ...] = (
    (240, 241, 237),
    (184, 219, 200),
    (104, 181, 183),
    (62, 135, 170),
    (54, 90, 150),
    (60, 50, 118),
)
#: Colours of through cuts, paper, text and edges.
THROUGH, _PAPER, _INK, _EDGE = (255, 190, 84), (255, 255, 255), (40, 44, 48), (150, 154, 158)
#: Colours of moves over the part, and of its fixture.
PATH_COLOUR, FIXTURE_COLOUR = (190, 40, 66), (126, 118, 108)
#: Length of the longer side of the height field in the picture, and minimum length of the shorter side, pixels.
LONGER, _SHORTER = 1400, 8
#: Maximum number of cells along the longer side. More cells would only use more memory.
_MAX_CELLS = 2 * LONGER
#: Margins around the field, pixels. The left margin contains the numbers of Y, the right margin the scale, and the
#: bottom margin the numbers of X.
LEFT, RIGHT, TOP, BOTTOM = 96, 190, 30, 76
#: Maximum length of the scale, and a length that always fits on the page, pixels.
_SCALE, _MIN_SCALE = 460, 220
#: Strength of slope shading; strength of shadows; radius of shadows as a share of the size; depth at which shadows
#: reach full strength, as a share of the range of heights.
_SHADE, _SHADOW, _NEAR, _FULL = 0.4, 0.45, 0.012, 0.35
_SIZE, _TICK = 22, 8
#: If cells are larger than the first value, pixels, slanted walls look like stairs. Smoothing over the second value,
#: cells, hides the stairs.
_STAIRS, _SOFT = 1.5, 0.6
#: Minimum distance between round numbers and the ends of the scale, and usual spacing of the numbers, pixels.
_APART, _NUMBER = 30, 70
#: Number of colours.
_STEPS = 1024


class OverStock(NamedTuple):
    """Overlays on a height field.

    Attributes
    ----------
    paths
        Lines, float64[m, 4]: x and y of both ends, mm.
    air
        Cells without material before the first cut, bool[rows, columns].
    held
        Cells of the fixture, bool[rows, columns].
    """

    paths: NDArray[np.float64]
    air: NDArray[np.bool_]
    held: NDArray[np.bool_]


def stock_png(field: HeightField, top: float, over: OverStock | None = None) -> bytes:
    """Draw a height field from above as PNG. `top` is the height of the uncut stock, mm."""
    step = max(-(-max(field.heights.shape) // _MAX_CELLS), 1)
    heights = field.heights[::step, ::step].astype(np.float32)
    through = heights <= field.floor + 1e-6
    lowest = float(heights[~through].min()) if (~through).any() else field.floor
    bottom = min(lowest, top - 1e-6)
    coloured = _cell_colours(heights, through, top, bottom, field.cell * step)
    if over is not None:
        through &= ~over.air[::step, ::step]
        coloured[over.air[::step, ::step]] = _PAPER
        coloured[over.held[::step, ::step]] = FIXTURE_COLOUR
    picture = _enlarge_or_shrink(Image.fromarray(coloured[::-1]))
    width, height = picture.size
    page = Image.new(
        "RGB", (width + LEFT + RIGHT, max(height, _MIN_SCALE + 40 * bool(through.any())) + TOP + BOTTOM), _PAPER
    )
    if over is not None:
        _draw_paths(picture, field, over.paths)
    page.paste(picture, (LEFT, TOP))
    draw, font = ImageDraw.Draw(page), ImageFont.load_default(_SIZE)
    draw.rectangle((LEFT - 1, TOP - 1, LEFT + width, TOP + height), outline=_EDGE)
    _draw_axes(draw, font, field, (width, height))
    scale_height = page.size[1] - TOP - BOTTOM - (40 if through.any() else 0)
    _draw_colour_scale(
        draw, font, (LEFT + width + 36, TOP), min(scale_height, _SCALE), top, bottom, bool(through.any())
    )
    out = io.BytesIO()
    page.save(out, "PNG", optimize=True)
    return out.getvalue()


def _cell_colours(
    heights: NDArray[np.float32], through: NDArray[np.bool_], top: float, bottom: float, cell: float
) -> NDArray[np.uint8]:
    """Return the colour of each cell, uint8[rows, columns, 3]."""
    place = np.clip((top - heights) / (top - bottom), 0.0, 1.0)
    colours = _depth_colours(_STEPS)[(place * (_STEPS - 1)).astype(np.int64)].astype(np.float32)
    colours *= (_slope_brightness(heights, cell) * _shadow_brightness(heights, through, top, bottom))[..., None]
    colours[through] = THROUGH
    return np.asarray(np.clip(colours, 0, 255), dtype=np.uint8)


def _enlarge_or_shrink(picture: Image.Image) -> Image.Image:
    share = LONGER / max(picture.size)
    width, height = (max(round(n * share), _SHORTER) for n in picture.size)
    if share > _STAIRS:
        picture = picture.filter(ImageFilter.GaussianBlur(_SOFT))
    return picture.resize((width, height), Image.Resampling.LANCZOS if share < 1 else Image.Resampling.BICUBIC)


def _depth_colours(steps: int) -> NDArray[np.float64]:
    place, stops = np.linspace(0.0, 1.0, steps), np.linspace(0.0, 1.0, len(DEPTHS))
    return np.stack([np.interp(place, stops, [colour[k] for colour in DEPTHS]) for k in range(3)], axis=-1)


def _slope_brightness(heights: NDArray[np.float32], cell: float) -> NDArray[np.float32]:
    """Return the brightness of each cell, depending on its slope.

    A flat cell has 1. The light comes from the upper left.
    """
    if min(heights.shape) < 2:
        return np.ones_like(heights)
    rise_y, rise_x = np.gradient(heights, cell)
    lean = (rise_x - rise_y) / np.sqrt(1.0 + rise_x**2 + rise_y**2)
    return np.asarray(1.0 + _SHADE * np.clip(lean, -1.0, 0.5), dtype=np.float32)


def _shadow_brightness(
    heights: NDArray[np.float32], through: NDArray[np.bool_], top: float, bottom: float
) -> NDArray[np.float32]:
    """Return the brightness of each cell: 1 in the open, and less if the surroundings are higher."""
    high = np.where(through, np.float32(bottom), heights)
    near = max(round(_NEAR * max(heights.shape)), 1)
    around = _moving_average(_moving_average(high, near, 0), near, 1)
    deep = np.clip((around - high) / (_FULL * (top - bottom)), 0.0, 1.0)
    return np.asarray(1.0 - _SHADOW * deep, dtype=np.float32)


def _moving_average(values: NDArray[np.float32], near: int, axis: int) -> NDArray[np.float32]:
    """Return the moving average along an axis. Beyond the edges, the edge values continue."""
    wide = [(near + 1, near) if k == axis else (0, 0) for k in range(2)]
    sums = np.cumsum(np.pad(values, wide, mode="edge"), axis=axis, dtype=np.float64)
    count = 2 * near + 1
    length = values.shape[axis]
    last = np.take(sums, range(count, count + length), axis=axis)
    return np.asarray((last - np.take(sums, range(length), axis=axis)) / count, dtype=np.float32)


def _draw_paths(picture: Image.Image, field: HeightField, paths: NDArray[np.float64]) -> None:
    """Draw each line with a light outline, so that it is visible on dark and light colours."""
    (width, height), (rows, columns) = picture.size, field.heights.shape
    low = np.array([field.x, field.y]) - 0.5 * field.cell
    share = (paths.reshape(-1, 2, 2) - low) / (field.cell * np.array([columns, rows]))
    places = np.stack([share[..., 0] * width, (1.0 - share[..., 1]) * height], axis=-1)
    draw = ImageDraw.Draw(picture)
    for colour, wide in ((_PAPER, 6), (PATH_COLOUR, 3)):
        for line in places.reshape(-1, 4).tolist():
            draw.line(line, fill=colour, width=wide)


def _draw_axes(draw: Any, font: Any, field: HeightField, size: tuple[int, int]) -> None:
    width, height = size
    rows, columns = field.heights.shape
    low_x, low_y = field.x - 0.5 * field.cell, field.y - 0.5 * field.cell
    step = tick_step(max(rows, columns) * field.cell, 8)
    for value in ticks(low_x, low_x + columns * field.cell, step):
        x = LEFT + (value - low_x) / (columns * field.cell) * width
        draw.line((x, TOP + height + 1, x, TOP + height + _TICK), fill=_INK)
        draw.text((x, TOP + height + _TICK + 4), _tick_text(value, step), fill=_INK, font=font, anchor="mt")
    for value in ticks(low_y, low_y + rows * field.cell, step):
        y = TOP + height - (value - low_y) / (rows * field.cell) * height
        draw.line((LEFT - _TICK, y, LEFT - 2, y), fill=_INK)
        draw.text((LEFT - _TICK - 6, y), _tick_text(value, step), fill=_INK, font=font, anchor="rm")
    draw.text((LEFT + width / 2, TOP + height + BOTTOM - 6), "X, Y and Z in mm", fill=_INK, font=font, anchor="mb")


def _tick_text(value: float, step: float) -> str:
    """Format the number of a tick with a hyphen as minus, because the font has no minus sign."""
    return tick_label(value, step).replace("−", "-")


def _colour_scale_heights(top: float, bottom: float, length: int) -> list[float]:
    """Return round heights for a scale of `length` pixels, from the top down. They keep a distance from its ends."""
    keeps = _APART * (top - bottom) / length
    rounded = ticks(bottom + keeps, top - keeps, tick_step(top - bottom, max(length // _NUMBER, 1)))
    return sorted((float(height) for height in rounded), reverse=True)


def _draw_colour_scale(
    draw: Any, font: Any, at: tuple[int, int], length: int, top: float, bottom: float, through: bool
) -> None:
    x, y = at
    for row, colour in enumerate(_depth_colours(max(length, 2)).astype(int).tolist()):
        draw.line((x, y + row, x + 26, y + row), fill=tuple(colour))
    draw.rectangle((x - 1, y - 1, x + 27, y + length), outline=_EDGE)
    # Two decimals are enough unless the range is very small.
    decimals = 2 if top - bottom >= 0.2 else 3
    for height in (top, *_colour_scale_heights(top, bottom, length), bottom):
        share = (top - height) / (top - bottom)
        draw.text(
            (x + 38, y + share * length),
            to_fixed(height, decimals),
            fill=_INK,
            font=font,
            anchor="lt" if share == 0.0 else "lm",
        )
        draw.line((x + 27, y + share * length, x + 32, y + share * length), fill=_INK)
    if through:
        draw.rectangle((x - 1, y + length + 22, x + 27, y + length + 44), fill=THROUGH, outline=_EDGE)
        draw.text((x + 38, y + length + 33), "through", fill=_INK, font=font, anchor="lm")
