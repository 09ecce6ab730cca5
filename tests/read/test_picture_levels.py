"""Brightness of pictures: what is dark, where the wall lies, which spots are dirt, and all refusals in full."""

from __future__ import annotations

import io
import re
import zlib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from leafcut.errors import LeafcutError, OptionError
from leafcut.model.issue import Issue
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read import picture
from leafcut.read.format import Source
from leafcut.read.registry import read_source_with_format, run_reader

Grey = NDArray[np.float32]


def source_of(image: Image.Image, kind: str = "PNG", **options: Any) -> Source:
    file = io.BytesIO()
    image.save(file, kind, **options)
    return Source(f"p.{kind.lower()}", file.getvalue())


def grey_of(*rows: list[float]) -> Grey:
    return np.array(rows, dtype=np.float32)


def brightness(image: Image.Image, invert: bool = False) -> list[list[float]]:
    return np.round(picture._pixel_brightness(Source("p.png", b""), image, invert).astype(np.float64), 4).tolist()


def best_splits(grey: Grey) -> list[float]:
    """Return the borders of the 256 bins at which the variance between the two classes is largest, by brute force."""
    low, high = float(grey.min()), float(grey.max())
    width = (high - low) / 256
    bins = np.minimum(((grey.astype(np.float64).ravel() - low) / width).astype(int), 255)
    values = low + (bins + 0.5) * width
    found: dict[float, float] = {}
    for k in range(1, 256):
        dark, bright = values[bins < k], values[bins >= k]
        if len(dark) and len(bright):
            found[low + k * width] = len(dark) * len(bright) * (bright.mean() - dark.mean()) ** 2
    most = max(found.values())
    return [border for border, between in found.items() if between >= most * (1 - 1e-9)]


@pytest.mark.parametrize("seed", range(4))
def test_the_threshold_parts_the_classes_best(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grey = np.concatenate([rng.normal(0.2, 0.05, 60), rng.normal(0.7, 0.1, 90)]).astype(np.float32)
    splits = best_splits(grey)
    assert picture.otsu_threshold(grey) == pytest.approx((splits[0] + splits[-1]) / 2, abs=1e-6)


def test_the_threshold_of_two_tones_is_in_the_middle() -> None:
    """The first tone is in the first of 256 bins, the second in the last."""
    assert picture.otsu_threshold(grey_of([0.25, 0.75, 0.75])) == pytest.approx(0.5)
    assert picture.otsu_threshold(grey_of([0.0, 0.0, 0.0])) == pytest.approx(0.0, abs=1e-6)


LEVELS: list[tuple[Grey, dict[str, Any], float | str]] = [
    (grey_of([0.2, 0.2, 0.3, 0.8, 0.9, 0.9]), {}, 0.55),
    (grey_of([0.2, 0.8]), {"threshold": 0.3}, 0.3),
    (grey_of([0.2, 0.8]), {"threshold": 0.3, "invert": True}, 0.7),
    (grey_of([0.25, 0.75]), {"threshold": 0.75}, 0.75),
    (grey_of([0.25, 0.75]), {"threshold": 0.25}, "p.png: all pixels are brighter than --threshold 25%"),
    (grey_of([0.25, 0.75]), {"threshold": 0.8}, "p.png: all pixels are darker than --threshold 80%"),
    (grey_of([0.5, 0.59]), {}, "p.png: no contrast: brightness from 50 to 59%, too little to distinguish pockets; set "
     "--threshold"),
    (grey_of([0.5, 0.625]), {}, 0.5625),
]  # fmt: skip


@pytest.mark.parametrize(("grey", "options", "level"), LEVELS)
def test_outlines_are_traced_midway_between_dark_and_bright(grey: Grey, options: Any, level: float | str) -> None:
    def found() -> float:
        return picture._threshold_level(Source("p.png", b""), grey, PocketDrawingOptions(**options))

    if isinstance(level, float):
        assert found() == pytest.approx(level, abs=1e-6)
    else:
        with pytest.raises(LeafcutError) as refused:
            found()
        assert str(refused.value) == level


@pytest.mark.parametrize(
    ("grey", "level", "relative"),
    [
        ([0.0, 0.25, 0.5, 1.0], 0.5, [-1, -2 / 3, 0, 1]),
        ([0.0, 0.3, 0.4, 0.8, 0.9, 1.0], 0.5, [-1, -1, -0.5, 0.75, 1, 1]),
        ([0.1, 0.2], 0.5, [-1, -6 / 7]),
        ([0.6, 0.9], 0.5, [0.4, 1]),
    ],
)
def test_brightness_is_taken_relative_to_the_middles_of_both_classes(
    grey: list[float], level: float, relative: list[float]
) -> None:
    found = picture._relative_to_level(grey_of(grey), level)
    assert found.tolist() == [pytest.approx(relative, abs=1e-6)]
    assert found.dtype == np.float32


def test_steps_are_counted_in_both_directions() -> None:
    assert picture._count_transitions(np.array([[0, 1, 1], [0, 1, 0]], dtype=bool)) == 4
    assert picture._count_transitions(np.zeros((3, 3), dtype=bool)) == 0


def chequered(falloff: float) -> tuple[Grey, NDArray[np.bool_], NDArray[np.float64]]:
    """Return a picture of dark and bright squares under a light that falls off to the right and to the top."""
    y, x = np.mgrid[0:60, 0:80]
    bright = (x // 10 + y // 10) % 2 == 1
    light = 1.0 - 0.6 * falloff * (x / 79) ** 2 - 0.4 * falloff * (y / 59)
    return (np.where(bright, 1.0, 0.25) * light).astype(np.float32), bright, light


@pytest.mark.parametrize("invert", [False, True])
@pytest.mark.parametrize("falloff", [0.3, 0.6])
def test_a_light_that_falls_off_is_levelled(falloff: float, invert: bool) -> None:
    """The light is a quadratic surface, so it is found exactly: bright is 1, and dark a quarter of it."""
    grey, bright, _ = chequered(falloff)
    issues: list[Issue] = []
    found = picture._level_uneven_light(1.0 - grey if invert else grey, invert, issues)
    flat = 1.2 - found if invert else found
    assert flat[bright] == pytest.approx(1.0, abs=0.01)
    assert flat[~bright] == pytest.approx(0.25, abs=0.01)
    assert [str(issue) for issue in issues] == [
        f"L426 the picture is lit unevenly by up to {100 * falloff:.0f}% and was levelled; set --threshold to use it "
        "anyway"
    ]


def test_an_even_light_is_left_alone() -> None:
    for grey in (chequered(0.2)[0], grey_of([0.5, 0.59])):
        issues: list[Issue] = []
        assert picture._level_uneven_light(grey, False, issues) is grey and not issues


def square(x: float, y: float, side: float, height: float = 0.0) -> NDArray[np.float64]:
    height = height or side
    return np.array([(x, y), (x + side, y), (x + side, y + height), (x, y + height)])


def test_spots_no_wider_than_the_speckle_are_dirt() -> None:
    lines = [square(10, 10, 3), square(20, 40, 1.9), square(30, 50, 20, 1.5), square(50, 60, 2.1)]
    issues: list[Issue] = []
    found = picture._drop_dirt_spots(Source("p.png", b""), lines, 2.0, (0.5, 100), issues)
    assert [id(line) for line in found] == [id(lines[0]), id(lines[3])]
    assert [str(issue) for issue in issues] == [
        ("L214 ignored 2 spots narrower than 1 mm as dirt; change the limit with --speckle (at (10, 30), (15, 25))")
    ]
    assert picture._drop_dirt_spots(Source("p.png", b""), [square(1, 1, 2)], 0.0, (0.5, 100), issues)
    for spots, words in (([], ""), ([square(0, 0, 1)], " that is wider than --speckle 1 mm")):
        with pytest.raises(LeafcutError) as refused:
            picture._drop_dirt_spots(Source("p.png", b""), spots, 2.0, (0.5, 100), issues)
        text = f"p.png: no region to mill{words}; choose the milled area with --threshold and --invert"
        assert str(refused.value) == text


@pytest.mark.parametrize(
    ("x", "y", "edges"),
    [
        (0.5, 0.5, ""), (0.4, 5, "left"), (17.5, 5, ""), (17.6, 5, "right"), (5, 0.4, "upper"), (5, 27.5, ""),
        (5, 27.6, "lower"), (0, 0, "left, upper"), (18, 28, "right, lower"),
    ],
)  # fmt: skip
def test_an_edge_within_half_a_pixel_is_a_wall(x: float, y: float, edges: str) -> None:
    issues: list[Issue] = []
    picture._warn_of_edge_walls([square(x, y, 2), square(9, 9, 1)], (30, 20), issues)
    text = f"L425 the milled area reaches the {edges} edge of the picture, which becomes a wall"
    assert [str(issue) for issue in issues] == ([text] if edges else [])


def test_brightness_is_that_of_each_kind_of_pixel() -> None:
    assert brightness(Image.fromarray(np.array([[0, 51, 255]], np.uint8))) == [[0, 0.2, 1]]
    assert brightness(Image.fromarray(np.array([[0, 51, 255]], np.uint8)), True) == [[1, 0.8, 0]]
    assert brightness(Image.fromarray(np.array([[0, 13107, 65535]], np.uint16))) == [[0, 0.2, 1]]
    assert brightness(Image.fromarray(np.array([[0, 13107, 65535]], np.int32))) == [[0, 0.2, 1]]


@pytest.mark.parametrize("mode", ["RGBA", "LA", "P"])
def test_transparent_pixels_are_not_milled(mode: str) -> None:
    """The left pixel is black and opaque, the right one white and transparent."""
    image = Image.new("RGBA", (2, 1), (0, 0, 0, 255))
    image.putpixel((1, 0), (60, 60, 60, 0))
    if mode == "P":
        image = Image.new("P", (2, 1), 0)
        image.putpalette([0, 0, 0, 60, 60, 60])
        image.putpixel((1, 0), 1)
        image.info["transparency"] = 1
    else:
        image = image.convert(mode)
    assert brightness(image) == [[0, 1]]
    assert brightness(image, True) == [[1, 1]]


def test_sizes_and_densities_are_those_of_the_file() -> None:
    image = Image.new("L", (7, 5), 255)
    for kind in ("PNG", "JPEG", "BMP"):
        assert picture.picture_size(source_of(image, kind)) == (7, 5)
    assert picture._pixel_size_hint(image) == ", such as --pixel-size 0.1"
    for dpi, text in (
        (254, "; its file says 254 pixels per inch: --pixel-size 0.1"),
        (0, ", such as --pixel-size 0.1"),
        (72.5, "; its file says 72.5 pixels per inch: --pixel-size 0.350345"),
    ):
        image.info["dpi"] = (dpi, 99)
        assert picture._pixel_size_hint(image) == text
    image.info["dpi"] = ()
    assert picture._pixel_size_hint(image) == ", such as --pixel-size 0.1"


def bomb(width: int, height: int) -> bytes:
    data = bytearray(source_of(Image.new("L", (7, 5))).data)
    data[16:24] = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    return bytes(data)


LARGE = "the limit is 25,000,000: crop it to the pocket or scale it down"


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "this is not a picture; save it as PNG, JPEG or BMP"),
        (b"GIF89a", "this is a GIF picture; save it as PNG, JPEG or BMP"),
        (bomb(5000, 5001), f"the picture has 5000 × 5001 pixels; {LARGE}"),
        (bomb(20_000, 20_000), f"the picture has too many pixels; {LARGE}"),
        (b"\x89PNG\r\n\x1a\n", "a damaged PNG picture (invalid header); save it again"),
        (b"\xff\xd8\xff" + b"\xff\xda" * 101, "a damaged JPEG picture (invalid header); save it again"),
    ],
)
def test_a_file_that_is_no_picture_is_refused_with_its_reason(data: bytes, text: str) -> None:
    with pytest.raises(LeafcutError) as refused:
        picture.picture_size(Source("p.png", data))
    assert re.sub(r"\(.* .*\)", "(invalid header)", str(refused.value)) == f"p.png: {text}"


def test_as_many_pixels_and_scans_as_the_limits_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    image = Image.new("L", (7, 5))
    jpeg = source_of(image, "JPEG")
    monkeypatch.setattr(picture, "MAX_PIXELS", 35)
    monkeypatch.setattr(picture, "MAX_SCANS", jpeg.data.count(b"\xff\xda"))
    assert picture.picture_size(source_of(image)) == picture.picture_size(jpeg) == (7, 5)
    monkeypatch.setattr(picture, "MAX_SCANS", 0)
    with pytest.raises(LeafcutError, match=r"^p\.jpeg: the picture has 1 scans; the limit is 0: save it as PNG$"):
        picture.picture_size(jpeg)
    png = source_of(image, save_all=True, append_images=[Image.new("L", (7, 5), 255)])
    with pytest.raises(LeafcutError, match=r"^p\.png: an animated picture; save one frame of it$"):
        picture.picture_size(png)


def test_a_picture_without_a_pixel_size_or_with_too_large_a_one_is_refused() -> None:
    source = source_of(Image.new("L", (10_001, 1)))
    for size, kind, text in (
        (None, OptionError, "p.png: a picture needs --pixel-size, the width of a pixel, such as --pixel-size 0.1"),
        (100.0, LeafcutError, "p.png: with pixels of 100 mm the picture is 1.0001e+06 mm long"),
    ):
        with pytest.raises(kind) as refused:
            picture.read_picture_pockets(source, ReadOptions(), PocketDrawingOptions(pixel_size=size), SheetOptions())
        assert str(refused.value) == text
    with pytest.raises(LeafcutError) as refused:
        run_reader(*read_source_with_format(source), ReadOptions())
    assert str(refused.value) == "p.png: pictures are read for pockets only; use --process pocket"
