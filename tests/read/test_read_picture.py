"""Pictures of pockets: dark is milled, and the outline is more exact than the pixels."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import shapely
from PIL import Image
from shapely.affinity import translate

from leafcut.geometry.regions import region
from leafcut.options import PocketOptions
from leafcut.read import read_pockets

SEVEN = (
    "p1_rect_rounded",
    "p2_circle",
    "p3_fleur",
    "p4_star",
    "p5_islands3",
    "p6_islands6",
    "p7_islands11",
)


@pytest.mark.parametrize("name", SEVEN)
def test_the_picture_of_a_pocket_is_the_same_region_within_half_a_pixel(name: str, data: Path) -> None:
    folder = data / "pockets"
    truth = shapely.from_wkt((folder / f"{name}.wkt").read_text())
    said = json.loads((folder / "meta.json").read_text())[name]
    size = said["png_mm_per_px"]
    (pocket,) = read_pockets(folder / f"{name}.png", pocket_options=PocketOptions(pixel_size=size)).pockets
    left, top = said["png_origin_upper_left_mm"]
    with Image.open(folder / f"{name}.png") as image:
        rows = image.size[1]
    found = translate(region(pocket.outline, pocket.islands), left, top - rows * size)
    assert len(found.interiors) == len(truth.interiors)
    assert found.area == pytest.approx(truth.area, rel=1e-3)
