"""Built-in examples, and the drawings made of them."""

from __future__ import annotations

import itertools
import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.read import read
from leafcut.read.examples import PLATE_NAMES, create_plate

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_ten_point_map_has_ten_different_points():
    part = read("example:ten-points")
    assert len({(h.x, h.y) for h in part.holes}) == 10


@pytest.mark.parametrize("name", PLATE_NAMES)
def test_a_plate_has_the_holes_its_name_says_none_touching_another_or_the_edge(name):
    made = create_plate(name)
    assert len(made.holes) == int(name.rsplit("-", 1)[1])
    for a, b in itertools.combinations(made.holes, 2):
        assert math.hypot(a.x - b.x, a.y - b.y) > (a.diameter + b.diameter) / 2 + 0.1
    for h in made.holes:
        edge = min(h.x, h.y, made.width - h.x, made.height - h.y)
        assert edge > h.diameter / 2 + 0.1


@pytest.mark.parametrize("name", PLATE_NAMES)
def test_the_drawing_of_a_plate_and_the_built_in_one_are_the_same_part(name):
    drawn, built_in = read(EXAMPLES / f"{name.replace('-', '_')}.dxf"), read(f"example:{name}")
    assert [(h.x, h.y, h.diameter, h.layer) for h in drawn.holes] == [
        (h.x, h.y, h.diameter, h.layer) for h in built_in.holes
    ]
    assert drawn.units == built_in.units == "in"


def test_the_script_writes_the_drawings_that_are_kept_byte_for_byte(tmp_path):
    runpy.run_path(str(EXAMPLES / "make_plates.py"))["main"](tmp_path)
    made = sorted(tmp_path.iterdir())
    drawings = {f"{name.replace('-', '_')}.dxf" for name in PLATE_NAMES}
    assert {path.name for path in made} == {"cam_121.nc", "sheet.dxf"} | drawings
    for path in made:
        kept = (EXAMPLES / path.name).read_text()
        # ezdxf writes its own version into the file; everything else is ours.
        assert _without_version(path.read_text()) == _without_version(kept)


def _without_version(text):
    return [line for line in text.splitlines() if "@" not in line and not line.startswith("1.")]


def test_the_same_seed_gives_the_same_random_map_and_another_seed_another():
    a, b, c = (read(f"random:200:{seed}").hole_xy for seed in (7, 7, 8))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)
    assert np.array_equal(read("random:200").hole_xy, read("random:200:1").hole_xy)
    assert np.array_equal(a, np.round(a, 3))
    assert a.min() >= 0
    assert a.max() <= math.sqrt(200) * 10
    # Uniform: each quarter of the square has about a quarter of the points.
    quarter = ((a < a.max() / 2).sum(axis=1) == 2).mean()
    assert 0.15 < quarter < 0.35


@pytest.mark.parametrize(
    "name",
    [
        "random:",
        "random:x",
        "random:0",
        "random:5:-1",
        "random:1000001",
        "random:5:1:1",
        "example:",
        "example:plate-71",
    ],
)
def test_a_name_that_is_no_example_is_refused_with_what_there_is(name):
    with pytest.raises(ReadError, match=r"did you mean|choose one of|random:N"):
        read(name)
