"""The remaining stock as a solid and as a picture, against a box with a slot of known volume."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from leafcut.material.height_field import HeightField, StockBlock
from leafcut.report import stock_picture
from leafcut.report.stock_picture import BOTTOM, DEPTHS, LEFT, LONGER, RIGHT, THROUGH, TOP, stock_png
from leafcut.report.stock_report import MAX_CELLS, stock_stl

BLOCK = StockBlock((10.0, 20.0, -6.0), (30.0, 32.0, 0.0))


def slotted(cell: float = 0.5) -> HeightField:
    """Return a block with a slot 3 deep over the left half of its cells, and a square hole cut through."""
    field = HeightField.of_block(BLOCK, cell)
    columns = field.heights.shape[1]
    field.heights[:, : columns // 2] = -3.0
    rows = field.heights.shape[0] // 4
    field.heights[rows : 2 * rows, 3 * columns // 4 : 3 * columns // 4 + rows] = -6.0
    return field


def triangles(data: bytes) -> np.ndarray:
    count = int.from_bytes(data[80:84], "little")
    assert len(data) == 84 + 50 * count
    rows = np.frombuffer(data[84:], dtype=[("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
    spans = np.cross(rows["corner"][:, 1] - rows["corner"][:, 0], rows["corner"][:, 2] - rows["corner"][:, 0])
    assert (np.einsum("ij,ij->i", spans, rows["normal"]) > 0).all()
    corners: np.ndarray = rows["corner"].astype(np.float64)
    return corners


def test_a_solid_is_closed_looks_outwards_and_has_the_volume_of_what_is_left() -> None:
    """Every edge is passed once each way; by the divergence theorem, the volume of a slanted wall included."""
    field = slotted()
    data, step = stock_stl(field)
    corners = triangles(data)
    assert step == 1
    _, number = np.unique(corners.reshape(-1, 3).round(4), axis=0, return_inverse=True)
    a, b, c = number.reshape(-1, 3).T
    edges = np.concatenate([np.stack([a, b], 1), np.stack([b, c], 1), np.stack([c, a], 1)])
    there, times = np.unique(edges, axis=0, return_counts=True)
    back, times_back = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    assert (there == back).all()
    assert (times == times_back).all()
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert volume == pytest.approx(field.volume, rel=0.02)
    assert corners.min(axis=(0, 1)) == pytest.approx((10.0, 20.0, -6.0))
    assert corners.max(axis=(0, 1)) == pytest.approx((30.0, 32.0, 0.0))


def test_a_solid_of_many_cells_takes_every_second_one() -> None:
    data, step = stock_stl(HeightField.of_block(BLOCK, 0.02))
    assert step == 2
    assert len(triangles(data)) < 4.2 * MAX_CELLS


def test_a_picture_has_y_upwards_its_colours_by_depth_and_its_scale() -> None:
    field = slotted()
    picture = np.asarray(Image.open(io.BytesIO(stock_png(field, 0.0))).convert("RGB")).astype(int)
    scale = LONGER / 20.0

    def at(x: float, y: float) -> tuple[int, ...]:
        return tuple(picture[round(TOP + (32.0 - y) * scale), round(LEFT + (x - 10.0) * scale)].tolist())

    assert picture.shape[:2] == (TOP + round(12 * scale) + BOTTOM, LEFT + LONGER + RIGHT)
    assert at(25.0, 30.0) == DEPTHS[0]
    assert at(13.0, 22.0) == DEPTHS[-1]
    assert at(25.5, 24.0) == pytest.approx(THROUGH, abs=6)  # smooth edges reach a little into what is small
    # The floor beside the wall lies in its shadow.
    assert sum(at(19.6, 22.0)) < sum(DEPTHS[-1])


def test_a_tick_of_the_axes_stands_at_its_round_coordinate() -> None:
    """Every 2 mm of 10 to 30 in X, below the picture."""
    picture = np.asarray(Image.open(io.BytesIO(stock_png(slotted(), 0.0))).convert("L")).astype(int)
    row = picture[TOP + round(LONGER * 12 / 20) + 4, LEFT - 2 : LEFT + LONGER + 2]
    assert (np.flatnonzero(row < 100) - 2).tolist() == pytest.approx([140 * k for k in range(11)], abs=1)


@pytest.mark.parametrize("shape", [(1, 1), (1, 4000), (4000, 3), (2, 2)])
def test_a_long_or_tiny_stock_has_a_picture_that_is_not_larger_than_others(shape: tuple[int, int]) -> None:
    field = HeightField(np.zeros(shape, dtype=np.float32), 0.0, 0.0, 0.25, -5.0)
    field.heights[0, 0] = -2.0
    width, height = Image.open(io.BytesIO(stock_png(field, 0.0))).size
    assert max(width, height) <= LONGER + LEFT + RIGHT
    assert min(width, height) >= 220


def test_a_stock_of_one_cell_has_a_picture_and_a_solid() -> None:
    field = HeightField.of_block(StockBlock((0, 0, 0), (1, 1, 1)), 1.0)
    assert stock_png(field, 1.0).startswith(b"\x89PNG")
    assert len(stock_stl(field)[0]) >= 84


@pytest.mark.parametrize(
    ("top", "bottom", "length", "found"),
    [
        (0.0, -7.12, 460, [-1.0, -2.0, -3.0, -4.0, -5.0, -6.0]),
        (0.0, -3.21, 255, [-1.0, -2.0]),
        (12.0, 0.0, 460, [10.0, 8.0, 6.0, 4.0, 2.0]),
        (0.0, -0.25, 460, [-0.05, -0.1, -0.15, -0.2]),
    ],
)
def test_the_scale_has_round_heights_apart_from_its_ends(
    top: float, bottom: float, length: int, found: list[float]
) -> None:
    """The ends are exact and stand there, too: a number of 22 pixels that is nearer than 30 would touch one."""
    assert stock_picture._colour_scale_heights(top, bottom, length) == pytest.approx(found)
