"""Read pictures (PNG, JPEG, BMP) of pockets.

Dark areas are milled and bright areas remain. The user states the size of a pixel. The origin is the lower left corner
of the picture, and y points up. At an intermediate brightness, the wall lies between two pixels.
"""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError

from leafcut.errors import OptionError, ReadError, count_of, printable
from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue
from leafcut.model.part import Part
from leafcut.model.pocket import EITHER
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.format import MAX_COORDINATE, Source, first_positions_text
from leafcut.read.recognition import picture_kind

#: Maximum number of pixels. Tracing needs about 30 bytes per pixel.
MAX_PIXELS = 25_000_000
#: Maximum number of scans of a JPEG. A progressive JPEG has about ten. A scan of a few bytes still takes as long to
#: decode as all pixels.
MAX_SCANS = 100
_SCAN = b"\xff\xda"
#: Maximum number of transitions between dark and bright. A larger number means noise, not outlines.
MAX_STEPS = 250_000
#: Maximum number of transitions for the optimal arc fit, which is slow. Smoothed outlines are accurate enough for finer
#: pictures.
MAX_FITTED = 50_000
#: Maximum number of outlines. A larger number means noise.
MAX_OUTLINES = 5_000
#: Minimum contrast between dark and bright, relative to the full range.
LEAST_CONTRAST = 0.1

#: A picture is levelled if the light falloff exceeds the first value. The second value is the number of iterations.
UNEVEN, LIGHT_ROUNDS = 0.25, 6

Grey = NDArray[np.float32]

_READ = ("PNG", "JPEG", "BMP")


def read_picture_pockets(source: Source, _: ReadOptions, options: PocketDrawingOptions, joining: SheetOptions) -> Part:
    """Convert the dark regions of a picture to pockets, in mm. Bright spots inside them become islands.

    Raises
    ------
    ReadError
        The file is not a supported picture, is truncated, animated or too large, or has no contrast or too many spots.
    OptionError
        `pixel_size` is missing.
    """
    from leafcut.geometry.tracing import fit_traced_outline, smooth_outline, trace_level_lines  # start-up

    image = _open_picture(source)
    if options.pixel_size is None:
        raise OptionError(
            "{}: a picture needs --pixel-size, the width of a pixel{}", source.path, _pixel_size_hint(image)
        )
    size = options.pixel_size
    if max(image.size) * size > MAX_COORDINATE:
        raise ReadError(
            source.path, Message("with pixels of {:g} mm the picture is {:g} mm long", size, max(image.size) * size)
        )
    grey = _pixel_brightness(source, image, options.invert)
    issues: list[Issue] = []
    if options.threshold is None:
        grey = _level_uneven_light(grey, options.invert, issues)
    level = _threshold_level(source, grey, options)
    grey = _relative_to_level(grey, level)
    steps = _count_transitions(grey < 0.0)
    if steps > MAX_STEPS:
        raise ReadError(
            source.path,
            Message("{:,} steps between dark and bright: this is noise, not an outline; blur or scale it down", steps),
        )
    fit = fit_traced_outline if steps <= MAX_FITTED else smooth_outline
    height = grey.shape[0]
    lines = _drop_dirt_spots(source, trace_level_lines(grey), options.speckle / size, (size, height), issues)
    _warn_of_edge_walls(lines, grey.shape, issues)
    part = Part(source.name, source=source.file_name, format="picture", issues=tuple(issues))
    try:
        return _add_pockets(part, [fit(line) for line in lines], (size, height), joining, source)
    except ReadError:
        # Walls a pixel apart can meet after smoothing. The unsmoothed outlines do not meet.
        return _add_pockets(
            part, [Polyline.of_points(line, closed=True) for line in lines], (size, height), joining, source
        )


def _add_pockets(
    part: Part, outlines: list[Polyline], frame: tuple[float, int], joining: SheetOptions, source: Source
) -> Part:
    """Add the outlines to the part as pockets, in mm. `frame` contains the pixel size and the number of rows."""
    from leafcut.read.pocket_outlines import contours_to_pockets  # start-up

    size, rows = frame
    contours = []
    for outline in outlines:
        vertices = outline.vertices * np.array([size, -size, -1.0]) + np.array([0.0, size * rows, 0.0])
        contours.append(Contour(Polyline(vertices, closed=True)))
    kinds = [EITHER] * len(contours)
    return contours_to_pockets(replace(part, contours=tuple(contours)), kinds, joining, source.path, picture=True)


# -- the file --------------------------------------------------------------------------------------------------------


def picture_size(source: Source) -> tuple[int, int]:
    """Return the width and height of a picture, px.

    Raises
    ------
    ReadError
        The file is not a supported picture, or it is damaged, animated or too large.
    """
    width, height = _open_picture(source).size
    return width, height


def _open_picture(source: Source) -> Any:
    kind = picture_kind(source.data)
    if kind not in _READ:
        description = Message("this is a {} picture", kind) if kind else Message("this is not a picture")
        raise ReadError(source.path, Message("{}; save it as PNG, JPEG or BMP", description))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pictures that are too large are refused below
            image = Image.open(io.BytesIO(source.data), formats=[kind])
            width, height = image.size
            animated = kind == "PNG" and image.n_frames > 1
    except Image.DecompressionBombError:
        raise ReadError(source.path, _too_large_message(Message("too many pixels"))) from None
    except UnidentifiedImageError:
        raise ReadError(source.path, Message("a damaged {} picture (invalid header); save it again", kind)) from None
    except Exception as problem:  # decoders raise unrelated exceptions on damaged files
        raise ReadError(
            source.path, Message("a damaged {} picture ({}); save it again", kind, printable(str(problem), 80))
        ) from None
    if width * height > MAX_PIXELS:
        raise ReadError(source.path, _too_large_message(Message("{} × {} pixels", width, height)))
    if kind == "JPEG" and (scans := source.data.count(_SCAN)) > MAX_SCANS:
        raise ReadError(
            source.path, Message("the picture has {:,} scans; the limit is {}: save it as PNG", scans, MAX_SCANS)
        )
    if animated:
        raise ReadError(source.path, "an animated picture; save one frame of it")
    return image


def _too_large_message(size_text: str) -> Message:
    return Message(
        "the picture has {}; the limit is {:,}: crop it to the pocket or scale it down", size_text, MAX_PIXELS
    )


def _pixel_size_hint(image: Any) -> Message:
    try:
        density = float(image.info["dpi"][0])
        return Message("; its file says {:.6g} pixels per inch: --pixel-size {:.6g}", density, 25.4 / density)
    except (KeyError, IndexError, TypeError, ValueError, ArithmeticError):
        return Message(", such as --pixel-size 0.1")


def _pixel_brightness(source: Source, image: Any, invert: bool) -> Grey:
    """Return the brightness of each pixel, float32[rows, columns], from 0 to 1. Dark pixels are milled."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = ImageOps.exif_transpose(image)
            if image.mode.startswith("I"):
                grey = np.asarray(image).astype(np.float32)
                grey /= 65535.0
            else:
                if "transparency" in image.info or image.mode in ("RGBA", "LA"):
                    # Transparent pixels are not milled.
                    clear = Image.new("RGBA", image.size, (0, 0, 0, 255) if invert else (255, 255, 255, 255))
                    image = Image.alpha_composite(clear, image.convert("RGBA"))
                grey = np.asarray(image.convert("L")).astype(np.float32)
                grey /= 255.0
    except Exception as problem:  # decoders raise unrelated exceptions on damaged files
        raise ReadError(
            source.path, Message("a damaged or truncated picture ({}); save it again", printable(str(problem), 80))
        ) from None
    return 1.0 - grey if invert else grey


# -- dark and bright -------------------------------------------------------------------------------------------------


def _threshold_level(source: Source, grey: Grey, options: PocketDrawingOptions) -> float:
    """Return the brightness at which outlines are traced.

    This is the user's threshold, or else the middle between dark and bright.
    """
    low, high = float(grey.min()), float(grey.max())
    if options.threshold is not None:
        level = options.threshold if not options.invert else 1.0 - options.threshold
        if not low < level <= high:
            message = Message(
                "all pixels are brighter than --threshold {:g}%"
                if low >= level
                else "all pixels are darker than --threshold {:g}%",
                100.0 * options.threshold,
            )
            raise ReadError(source.path, message)
        return level
    split = otsu_threshold(grey)
    dark, bright = float(np.median(grey[grey < split])) if low < split else low, high
    bright = float(np.median(grey[grey >= split])) if high >= split else high
    if bright - dark < LEAST_CONTRAST:
        raise ReadError(
            source.path,
            Message(
                "no contrast: brightness from {:.3g} to {:.3g}%, too little to distinguish pockets; set --threshold",
                100.0 * low,
                100.0 * high,
            ),
        )
    return 0.5 * (dark + bright)


def _level_uneven_light(grey: Grey, invert: bool, issues: list[Issue]) -> Grey:
    """Level the brightness of an unevenly lit photo.

    The code models the light as a quadratic surface, and fits it so that all bright areas become equally bright, and
    all dark areas equally dark. It then divides the brightness by this surface, and separates dark and bright pixels
    again. The fit includes the dark areas, because a fit to the bright pixels alone would have to extrapolate there. An
    evenly lit picture is returned without changes.
    """
    light = 1.0 - grey if invert else grey
    if float(np.ptp(light)) < LEAST_CONTRAST:
        return grey
    step = max(max(grey.shape) // 200, 1)
    thin = light[::step, ::step].astype(np.float64)
    terms, samples = _quadratic_terms_of_pixels(thin.shape), thin.ravel()
    surface: NDArray[np.float64] = np.ones_like(samples)
    for _ in range(LIGHT_ROUNDS):
        flat = samples / surface
        bright = flat >= otsu_threshold(flat.astype(np.float32))
        shade = np.where(bright, 1.0, flat[~bright].mean() / flat[bright].mean())
        weights = np.linalg.lstsq(terms * shade[:, None], samples, rcond=None)[0]
        surface = np.maximum(terms @ weights, 0.02)
    falloff = 1.0 - float(surface.min() / surface.max())
    if falloff < UNEVEN:
        return grey
    message = Message("the picture is lit unevenly by up to {:.0f}% and was levelled", 100.0 * falloff)
    issues.append(Issue("L426", Message("{}; set --threshold to use it anyway", message)))
    levelled: Grey = np.empty_like(light)
    y, x = (np.linspace(-1.0, 1.0, n) for n in light.shape)
    for row, dark in enumerate(light):  # row by row: the whole surface would take gigabytes
        flat = np.clip(dark / np.maximum(_quadratic_terms(x, y[row]) @ weights, 0.02), 0.0, 1.2)
        levelled[row] = 1.2 - flat if invert else flat
    return levelled


def _quadratic_terms_of_pixels(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Compute the terms 1, x, y, x², xy, y² for every pixel, float64[n, 6]. x and y range from −1 to 1."""
    y, x = (a.ravel() for a in np.meshgrid(*(np.linspace(-1.0, 1.0, n) for n in shape), indexing="ij"))
    return _quadratic_terms(x, y)


def _quadratic_terms(x: NDArray[np.float64], y: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Compute the terms 1, x, y, x², xy, y² for points, float64[n, 6]."""
    y = np.broadcast_to(y, x.shape)
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])


def _relative_to_level(grey: Grey, level: float) -> Grey:
    """Scale the brightness relative to the level: 0 at the level, −1 or less if clearly dark, 1 if clearly bright.

    A wall between clearly dark and clearly bright pixels then lies halfway between them, regardless of the threshold.
    """
    dark, bright = grey < level, grey >= level
    below = max(level - float(np.median(grey[dark])), 1e-6) if dark.any() else 1.0
    above = max(float(np.median(grey[bright])) - level, 1e-6) if bright.any() else 1.0
    moved = grey - np.float32(level)
    return np.clip(np.where(dark, moved / below, moved / above), -1.0, 1.0).astype(np.float32)


def otsu_threshold(grey: Grey) -> float:
    """Find the brightness that best separates dark from bright pixels.

    The result maximizes the variance between the two classes. If several brightness values share the maximum, because
    no pixel lies between them, the function returns the middle value.

    Source: Otsu, "A threshold selection method from gray-level histograms", IEEE Trans. SMC 9 (1979), equation 18.
    """
    counts, edges = np.histogram(grey, bins=256, range=(float(grey.min()), max(float(grey.max()), 1e-6)))
    share = counts / counts.sum()
    middle = 0.5 * (edges[1:] + edges[:-1])
    below, mean = np.cumsum(share)[:-1], np.cumsum(share * middle)
    total = mean[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.nan_to_num((total * below - mean[:-1]) ** 2 / (below * (1.0 - below)))
    best = np.flatnonzero(between >= between.max() * (1.0 - 1e-9))
    return float(0.5 * (edges[best[0] + 1] + edges[best[-1] + 1]))


#: Half of a pixel, pixels.
_HALF_PIXEL = 0.5


def _count_transitions(dark: NDArray[np.bool_]) -> int:
    return int((dark[1:] != dark[:-1]).sum()) + int((dark[:, 1:] != dark[:, :-1]).sum())


def _drop_dirt_spots(
    source: Source, lines: list[Points], narrow: float, frame: tuple[float, int], issues: list[Issue]
) -> list[Points]:
    """Drop the outlines of spots that are at most `narrow` pixels wide. Report these spots as dirt (L214)."""
    import shapely  # start-up

    size, rows = frame
    wide = [line for line in lines if np.ptp(line, axis=0).min() >= narrow]
    if len(wide) > MAX_OUTLINES:
        raise ReadError(
            source.path,
            Message(
                "{:,} outlines: this is noise, not a pocket; blur the picture or set a larger --speckle", len(wide)
            ),
        )
    kept = [line for line in wide if not shapely.Polygon(line).buffer(-0.5 * narrow).is_empty]
    if not kept:
        detail = Message(" that is wider than --speckle {:g} mm", narrow * size) if lines else ""
        raise ReadError(
            source.path, Message("no region to mill{}; choose the milled area with --threshold and --invert", detail)
        )
    if n_dirt := len(lines) - len(kept):
        known = {id(line) for line in kept}
        dirt = [line[0] for line in lines if id(line) not in known]
        positions = [(round(float(x) * size, 3), round((rows - float(y)) * size, 3)) for x, y in dirt]
        message = Message(
            "ignored {} narrower than {:g} mm as dirt; change the limit with --speckle",
            count_of(n_dirt, "spot"),
            narrow * size,
        )
        issues.append(Issue("L214", message, first_positions_text(positions)))
    return kept


def _warn_of_edge_walls(lines: list[Points], shape: tuple[int, ...], issues: list[Issue]) -> None:
    """Warn that the milled region has walls along the edges of the picture (L425)."""
    points = np.concatenate(lines)
    (left, upper), (right, lower) = points.min(axis=0), points.max(axis=0)
    rows, columns = shape
    # A level line crosses at most half of a pixel at the edge.
    sides = (
        (Message("left"), left),
        (Message("right"), columns - right),
        (Message("upper"), upper),
        (Message("lower"), rows - lower),
    )
    if reached := [name for name, distance in sides if distance < _HALF_PIXEL]:
        message = Message(
            "the milled area reaches the {} edge of the picture, which becomes a wall", Message.joined(", ", reached)
        )
        issues.append(Issue("L425", message))
