"""Pictures of pockets: dark is milled, and the outline is more exact than the pixels."""

from __future__ import annotations

import io
import json
import math
import random
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image
from shapely.affinity import rotate, translate

from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.geometry.regions import region_with_islands
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions
from leafcut.read import picture, read, read_pockets
from leafcut.read.picture import otsu_threshold

#: Half a pixel is 0.25 mm. The exception is a narrow free-form tip, which is neither a line nor an arc.
SEVEN = {
    "p1_rect_rounded": 0.02,
    "p2_circle": 0.02,
    "p3_fleur": 0.36,
    "p4_star": 0.15,
    "p5_islands3": 0.15,
    "p6_islands6": 0.2,
    "p7_islands11": 0.25,
}
#: Pictures whose reading takes about half a second or more.
LARGE = {"p3_fleur", "p5_islands3", "p6_islands6", "p7_islands11"}
#: Width of a pixel of the pictures made here, mm, and their width and height, pixels.
SIZE, SIDE = 0.5, 80
DISC = shapely.Point(20.13, 19.87).buffer(12.345, 256)
SQUARE = rotate(shapely.box(8.2, 8.1, 31.7, 32.4), 17.0)

Picture = NDArray[np.uint8]
Save = Callable[..., Path]


def drawn(shape: Any, shades: int = 1) -> Picture:
    """Return the picture of a region: black where it is; with shades, the share of each pixel that it covers."""
    steps = (np.arange(SIDE * shades) + 0.5) / shades * SIZE
    x, y = np.meshgrid(steps, SIDE * SIZE - steps)
    inside = shapely.contains_xy(shape, x.ravel(), y.ravel()).reshape(SIDE, shades, SIDE, shades)
    return np.asarray((255.0 * (1.0 - inside.mean(axis=(1, 3)))).round(), dtype=np.uint8)


@pytest.fixture
def save(tmp_path: Path) -> Save:
    """Return a function that saves an array or a picture under a name."""

    def write(picture: Any, name: str = "p.png", **options: Any) -> Path:
        image = picture if isinstance(picture, Image.Image) else Image.fromarray(picture)
        image.save(tmp_path / name, **options)
        return tmp_path / name

    return write


def pockets(path: Path, **options: Any) -> Part:
    return read_pockets(path, pocket_options=PocketDrawingOptions(**{"pixel_size": SIZE, **options}))


def only(part: Part) -> Any:
    """Return the shape of a part's only pocket."""
    (pocket,) = part.pockets
    return region_with_islands(pocket.outline, pocket.islands, 0.01)


def refusal(path: Path, **options: Any) -> str:
    with pytest.raises(ReadError) as caught:
        pockets(path, **options)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(str(path))
    return text


def codes(part: Part) -> list[str]:
    return [issue.code for issue in part.issues]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in LARGE else []) for name in SEVEN]
)
def test_the_picture_of_a_pocket_is_its_region_within_half_a_pixel(name: str, data: Path) -> None:
    folder = data / "pockets"
    truth = shapely.from_wkt((folder / f"{name}.wkt").read_text())
    said = json.loads((folder / "meta.json").read_text())[name]
    (pocket,) = pockets(folder / f"{name}.png", pixel_size=said["png_mm_per_px"]).pockets
    with Image.open(folder / f"{name}.png") as image:
        rows = image.size[1]
    left, top = said["png_origin_upper_left_mm"]
    found = translate(region_with_islands(pocket.outline, pocket.islands), left, top - rows * said["png_mm_per_px"])
    assert len(found.interiors) == len(truth.interiors)
    assert found.area == pytest.approx(truth.area, rel=5e-4)
    assert found.boundary.hausdorff_distance(truth.boundary) <= SEVEN[name]
    assert pocket.outline.n_segments + sum(i.n_segments for i in pocket.islands) < 80


def test_the_example_picture_is_the_example_drawing(examples: Path) -> None:
    (drawing,), (picture,) = (pockets(examples / f"pocket.{kind}", pixel_size=0.25).pockets for kind in ("dxf", "png"))
    first = region_with_islands(drawing.outline, drawing.islands)
    second = translate(region_with_islands(picture.outline, picture.islands), -5.0, -5.0)
    assert len(first.interiors) == 2
    assert first.boundary.hausdorff_distance(second.boundary) <= 0.02


@pytest.mark.parametrize("shades, off", [(1, 0.06), (4, 0.02)])
def test_a_disc_is_a_circle_with_its_radius(shades: int, off: float, save: Save) -> None:
    (pocket,) = pockets(save(drawn(DISC, shades))).pockets
    assert pocket.outline.n_segments == 2
    x0, y0, x1, y1 = pocket.outline.extents
    assert (x1 - x0) / 2.0 == pytest.approx(12.345, abs=off)
    assert ((x0 + x1) / 2.0, (y0 + y1) / 2.0) == (pytest.approx(20.13, abs=off), pytest.approx(19.87, abs=off))


@pytest.mark.parametrize("shades", [1, 4])
@pytest.mark.parametrize("name", ["p.png", "p.jpg", "p.bmp"])
def test_a_turned_square_has_four_straight_walls_and_sharp_corners(shades: int, name: str, save: Save) -> None:
    part = pockets(save(drawn(SQUARE, shades), name))
    assert part.pockets[0].outline.n_segments == 4
    assert only(part).boundary.hausdorff_distance(SQUARE.boundary) <= 0.06
    assert part.format == "picture"


def test_rounded_corners_are_arcs_tangent_to_the_walls(save: Save) -> None:
    shape = rotate(shapely.box(8.2, 8.1, 31.7, 32.4).buffer(-5).buffer(5, 64), 17)
    part = pockets(save(drawn(shape, 4)))
    outline = part.pockets[0].outline
    assert (outline.n_segments, int((outline.bulges != 0.0).sum())) == (8, 4)
    assert [s.radius for s in outline.segments() if s.is_arc] == pytest.approx([5.0] * 4, abs=0.15)


def test_the_origin_is_the_lower_left_corner_and_y_points_up(save: Save) -> None:
    picture = np.full((40, 60), 255, np.uint8)
    picture[30:38, 4:24] = 0
    assert only(pockets(save(picture))).bounds == pytest.approx((2.0, 1.0, 12.0, 5.0), abs=1e-6)


def test_bright_spots_are_islands_and_dark_spots_in_them_pockets(save: Save) -> None:
    shape = DISC - shapely.Point(20, 20).buffer(8).difference(shapely.Point(20, 20).buffer(4))
    part = pockets(save(drawn(shape)))
    outer, inner = sorted(part.pockets, key=lambda p: -p.area)
    assert len(outer.islands) == 1
    assert inner.area == pytest.approx(math.pi * 16.0, rel=0.05)


def test_what_is_bright_is_milled_on_request(save: Save) -> None:
    assert only(pockets(save(255 - drawn(DISC)), invert=True)).area == pytest.approx(DISC.area, rel=0.01)


def test_dirt_is_left_out_and_said(save: Save) -> None:
    picture = drawn(DISC)
    picture[2, 3] = 0  # a spot beside the pocket, and one in it
    picture[38, 40] = 255
    picture[70:72, 5:60] = 0  # a scratch: long, and 1 mm wide
    part = pockets(save(picture), speckle=1.5)
    assert len(part.pockets) == 1
    assert part.pockets[0].islands == ()
    assert next(str(i) for i in part.issues if i.code == "L214").startswith("L214 ignored 3 spots narrower than 1.5 mm")
    assert len(pockets(save(picture), speckle=0.0).pockets) == 3


def test_a_region_at_the_edge_of_the_picture_ends_there_and_it_is_said(save: Save) -> None:
    picture = np.full((20, 20), 255, np.uint8)
    picture[10:, :8] = 0
    part = pockets(save(picture))
    assert only(part).bounds == pytest.approx((0.0, 0.0, 4.0, 5.0), abs=1e-6)
    assert "L425" in codes(part)


def test_only_edges_that_a_milled_region_reaches_are_walls(save: Save) -> None:
    """A spot at the left edge is dirt and not milled; the region ends at the lower edge alone."""
    picture = np.full((40, 40), 255, np.uint8)
    picture[20:, 10:30] = 0
    picture[5, 0] = 0
    part = pockets(save(picture), speckle=1.0)
    (message,) = [issue.message for issue in part.issues if issue.code == "L425"]
    assert message.startswith("the milled area reaches the lower edge of the picture")


def test_noise_in_a_picture_is_no_drawing_to_repair(save: Save) -> None:
    """Nobody drew outlines that touch each other in noise: the picture is blurred, not repaired."""
    noise = np.random.default_rng(1).integers(0, 256, (80, 80)).astype(np.uint8)
    said = refusal(save(noise), speckle=0.05, pixel_size=0.1)
    assert "blur the picture" in said and "--speckle" in said
    assert "drawing" not in said and "drawn" not in said


def _kinds() -> dict[str, Image.Image]:
    grey = Image.fromarray(drawn(DISC, 4))
    deep = Image.fromarray(drawn(DISC, 4).astype(np.uint16) * 257)
    clear = Image.new("LA", grey.size, (0, 0))
    clear.putalpha(grey.point(lambda v: 255 - v))  # black ink on glass
    palette = grey.convert("P")
    marked = palette.copy()
    marked.info["transparency"] = 255
    return {
        "bits": grey.convert("1", dither=Image.Dither.NONE),
        "rgb": grey.convert("RGB"),
        "rgba": grey.convert("RGBA"),
        "palette": palette,
        "16 bit": deep,
        "alpha": clear,
        "cmyk": grey.convert("CMYK"),
    }


@pytest.mark.parametrize("kind, image", _kinds().items(), ids=_kinds())
def test_every_kind_of_pixel_gives_the_same_disc(kind: str, image: Image.Image, save: Save) -> None:
    assert only(pockets(save(image, "p.jpg" if kind == "cmyk" else "p.png"))).area == pytest.approx(DISC.area, rel=0.01)


def test_a_photo_is_turned_as_its_camera_says(save: Save) -> None:
    shape = translate(shapely.box(0, 0, 10, 20), 5, 12)
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned by 90° clockwise
    picture = Image.fromarray(np.rot90(drawn(shape)))
    found = only(pockets(save(picture, "p.jpg", exif=exif, quality=95)))
    assert found.bounds == pytest.approx(shape.bounds, abs=0.1)


def test_the_threshold_lies_between_dark_and_bright_however_pale(save: Save) -> None:
    pale = (180 + drawn(DISC, 4) / 255.0 * 40).astype(np.uint8)
    assert only(pockets(save(pale))).area == pytest.approx(DISC.area, rel=0.005)
    assert 60 < otsu_threshold(np.array([10, 12, 110, 112], np.float32)) < 62


def test_a_threshold_says_what_of_three_tones_is_milled(save: Save) -> None:
    picture = np.full((80, 80), 255, np.uint8)
    picture[10:70, 10:70] = 128
    picture[20:60, 20:60] = 0
    path = save(picture)
    # Between three tones a wall is true to a quarter of a pixel.
    assert only(pockets(path, threshold=0.25)).area == pytest.approx(400.0, abs=0.25 * SIZE * 80.0 + 0.1)
    assert only(pockets(path, threshold=0.75)).area == pytest.approx(900.0, abs=0.25 * SIZE * 120.0 + 0.1)
    inverted = pockets(path, threshold=0.25, invert=True)
    assert only(inverted).area == pytest.approx(1600.0 - 400.0, abs=0.25 * SIZE * 80.0 + 0.1)


def test_without_a_scale_the_line_says_how_to_give_it(save: Save) -> None:
    path = save(drawn(DISC), dpi=(300, 300))
    with pytest.raises(OptionError, match=r"--pixel-size, the width of a pixel; its file says .* 0\.0846"):
        read_pockets(path)
    with pytest.raises(OptionError, match=r"such as --pixel-size 0\.1"):
        read_pockets(save(drawn(DISC), "q.png"))


def test_pictures_that_cannot_be_pockets_are_refused(save: Save) -> None:
    assert "no contrast: brightness from 78.4 to 78.4%" in refusal(save(np.full((9, 9), 200, np.uint8)))
    assert "all pixels are brighter than --threshold 20%" in refusal(
        save(np.full((9, 9), 200, np.uint8)), threshold=0.2
    )
    assert "all pixels are darker than --threshold 90%" in refusal(save(np.full((9, 9), 200, np.uint8)), threshold=0.9)
    assert "wider than --speckle 30 mm" in refusal(save(drawn(DISC)), speckle=30.0)
    assert "1e+06" in refusal(save(np.zeros((1, 20_000), np.uint8)), pixel_size=100.0).replace("2e+06", "1e+06")


def test_noise_is_refused(save: Save, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.random.default_rng(1).integers(0, 256, (60, 60), dtype=np.uint8)
    monkeypatch.setattr("leafcut.read.picture.MAX_STEPS", 1000)
    assert "this is noise" in refusal(save(picture))
    monkeypatch.setattr("leafcut.read.picture.MAX_STEPS", 100_000)
    monkeypatch.setattr("leafcut.read.picture.MAX_OUTLINES", 3)
    assert "this is noise, not a pocket" in refusal(save(picture), speckle=0.0)


def test_a_very_fine_picture_is_smoothed_quickly(save: Save, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("leafcut.read.picture.MAX_FITTED", 10)
    found = only(pockets(save(drawn(DISC))))
    assert found.boundary.hausdorff_distance(DISC.boundary) <= 0.25


def test_files_that_are_no_good_pictures_are_refused(save: Save, tmp_path: Path) -> None:
    good = save(drawn(DISC, 4)).read_bytes()
    for name, data, words in (
        ("cut.png", good[: len(good) // 2], "damaged or truncated"),
        ("head.png", good[:20], "damaged PNG"),
        ("text.png", b"hello", "this is not a picture; save it as PNG, JPEG or BMP"),
    ):
        (tmp_path / name).write_bytes(data)
        assert words in refusal(tmp_path / name)
    frames = [Image.fromarray(drawn(DISC)), Image.fromarray(drawn(SQUARE))]
    assert "a GIF picture; save it as PNG" in refusal(save(frames[0], "a.gif"))
    assert "a TIFF picture" in refusal(save(frames[0], "a.tif"))
    moving = save(frames[0], "a.png", save_all=True, append_images=frames[1:])
    assert "an animated picture" in refusal(moving)
    with pytest.raises(ReadError, match="--process pocket"):
        read(save(frames[0]), ReadOptions())


def test_a_jpeg_of_very_many_scans_is_refused_before_it_is_decoded(save: Save, tmp_path: Path) -> None:
    """Each scan of a few bytes is decoded over all pixels."""
    data = save(drawn(DISC), "p.jpg", progressive=True).read_bytes()
    at = data.rindex(b"\xff\xda")
    (tmp_path / "scans.jpg").write_bytes(data[:at] + 200 * data[at:-2] + data[-2:])
    assert "scans; the limit is 100: save it as PNG" in refusal(tmp_path / "scans.jpg")


def test_light_is_levelled_without_a_surface_of_the_whole_picture_in_memory() -> None:
    """Six powers of 25 million pixels are more than a gigabyte."""
    y, x = np.mgrid[0:600, 0:800]
    grey = (np.where((x // 100 + y // 100) % 2, 0.9, 0.2) * (1.0 - x / 1600)).astype(np.float32)
    tracemalloc.start()
    try:
        levelled = picture._level_uneven_light(grey, False, [])
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert levelled is not grey
    assert peak < 6 * 8 * grey.size


@pytest.mark.parametrize(("width", "height"), [(6000, 6000), (12_000, 12_000), (60_000, 60_000)])
def test_a_bomb_of_pixels_is_refused_before_it_is_unpacked(width: int, height: int, tmp_path: Path, save: Save) -> None:
    data = bytearray(save(drawn(DISC)).read_bytes())
    data[16:24] = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    (tmp_path / "bomb.png").write_bytes(data)
    assert "the limit is 25,000,000" in refusal(tmp_path / "bomb.png")


_FILES = {name: io.BytesIO() for name in ("PNG", "JPEG", "BMP")}
for _name, _file in _FILES.items():
    Image.fromarray(drawn(DISC.difference(shapely.Point(20, 20).buffer(4)), 2)[::2, ::2]).save(_file, _name)
_TEXT = b"POLYGON ((0 0, 50 0, 50 40, 0 40, 0 0), (10 10, 10 20, 20 20, 20 10, 10 10))"


@given(st.sampled_from([*_FILES, "WKT"]), st.integers(0, 2**32), st.integers(0, 12), st.booleans())
def test_whatever_is_in_a_file_there_are_pockets_or_one_line(name: str, seed: int, flips: int, cut: bool) -> None:
    from leafcut.options import SheetOptions
    from leafcut.read.format import Source
    from leafcut.read.registry import choose_format, formats

    rng = random.Random(seed)
    data = bytearray(_TEXT if name == "WKT" else _FILES[name].getvalue())
    for _ in range(flips):
        data[rng.randrange(len(data))] = rng.choice((rng.randrange(256), 40, 41, 44, 48, 45))
    if cut:
        del data[rng.randrange(len(data)) :]
    source = Source("damaged." + name.lower(), bytes(data))
    try:
        format_ = choose_format(formats(), source)
        if format_.pockets is None:
            return
        part = format_.pockets(source, ReadOptions(), PocketDrawingOptions(pixel_size=SIZE), SheetOptions())
    except LeafcutError as problem:
        assert "\n" not in str(problem)
        assert " 0x" not in str(problem)
        return
    assert part.pockets
    assert all(np.isfinite(p.outline.vertices).all() for p in part.pockets)


@pytest.mark.parametrize("invert", [False, True])
def test_a_picture_whose_light_falls_off_is_levelled_and_the_outline_is_that_under_even_light(
    save: Save, invert: bool
) -> None:
    """From the lower left corner to the upper right one the light falls to a third: one threshold parts nothing."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / (SIDE - 1)
    light = 1.0 - 0.5 * x - 0.17 * y
    shades = drawn(DISC, 4) / 255.0
    seen = np.round(255.0 * light * (0.25 + 0.7 * (1.0 - shades if invert else shades))).astype(np.uint8)
    part = read_pockets(save(seen), ReadOptions(), PocketDrawingOptions(pixel_size=SIZE, invert=invert))
    [pocket] = part.pockets
    assert pocket.area == pytest.approx(DISC.area, rel=0.01)
    assert [i.code for i in part.issues] == ["L426"]


def test_light_is_not_made_up_where_nothing_is_bright(save: Save) -> None:
    """An island in a large, evenly lit pocket: levelling by the bright pixels alone treated the floor as bright."""
    noise = np.random.default_rng(59).normal(0.0, 8.0, (200, 200))
    seen = np.full((200, 200), 92.0)
    seen[28:90, 57:95] = 163.0
    part = read_pockets(
        save(np.clip(seen + noise, 0, 255).astype(np.uint8)),
        ReadOptions(),
        PocketDrawingOptions(pixel_size=SIZE),
    )
    assert "L426" not in [i.code for i in part.issues]
    [pocket] = part.pockets
    assert pocket.area == pytest.approx((200 * 200 - 62 * 38) * SIZE**2, rel=0.02)
