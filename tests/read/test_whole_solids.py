"""Everything that is read of a solid: checked by eye against the numbers of which it is made."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("OCP")

from test_whole_parts import readings_of

from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read import read, read_contours, read_pockets, read_whole
from leafcut.read.format import Source, load_source
from leafcut.read.step import report_work_besides_holes
from made_solids import DOWN, box, cone, cut, cylinder, fused, rounded, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")


def besides(file: Path, options: ReadOptions) -> Part:
    """Return a part with only the work that no drill can do."""
    source: Source = load_source(file)
    return Part("besides holes", issues=tuple(report_work_besides_holes(source, options)))


READ = {
    "holes": (read, ReadOptions()),
    "holes from below, as drawn": (read, ReadOptions(up="-z", z_zero="drawn")),
    "holes from the side, turned by 30°": (read, ReadOptions(up="x", origin="lower-left", rotate=math.pi / 6)),
    "pockets": (read_pockets, ReadOptions(z_zero="bottom")),
    "outlines": (read_contours, ReadOptions()),
    "everything": (read_whole, ReadOptions(origin="center")),
    "second solid": (read, ReadOptions(solid=2)),
    "besides holes of the second solid": (besides, ReadOptions(solid=2)),
    "besides holes": (besides, ReadOptions()),
}


def block(folder: Path) -> Path:
    """Return a block from Z0 to Z20 with holes from three sides, a pocket with an island, a slope and a window."""
    solid = cut(
        box(0, 0, 0, 120, 80, 20),
        cut(rounded(10, 10, 14, 60, 50, 20, 5), rounded(25, 22, 14, 40, 34, 18, 4)),
        cylinder((15, 15, 14), DOWN, 2, 14),
        cylinder((20, 65, 20), DOWN, 2.5, 8),
        cylinder((30, 65, 20), DOWN, 3, 20),
        cylinder((30, 65, 20), DOWN, 5, 4),
        cone((85, 65, 15), 0, 5, 5),
        cylinder((85, 65, 20), DOWN, 2, 12),
        cylinder((100, 10, 8), DOWN, 2, 8),
        cylinder((0, 40, 10), (1, 0, 0), 1.5, 5),
        rounded(40, 60, 0, 70, 75, 20, 3),
        rounded(80, 20, 12, 100, 45, 20, 5),
        box(110, 30, 15, 120, 50, 20),
    )
    return saved(folder / "block.step", fused(solid, cylinder((90, 32, 12), (0, 0, 1), 2, 4)))


def sheet(folder: Path) -> Path:
    """Return a sheet of 3 mm with a hole and a window, with its lower corner at (-10, -5)."""
    solid = cut(box(-10, -5, 0, 50, 35, 3), cylinder((0, 5, 3), DOWN, 2, 3), rounded(10, 5, 0, 30, 25, 3, 4))
    return saved(folder / "sheet.step", solid)


def odd(folder: Path) -> Path:
    """Return two solids; the second has a step all around, a slope, a cross hole in a pocket, and a roofed pocket."""
    solid = cut(
        fused(box(0, 0, 0, 80, 60, 10), box(5, 5, 10, 75, 55, 14)),
        cone((20, 20, 9), 6, 8, 5),
        cone((20, 45, 14), 0, 0.001, 0.001),
        box(40, 15, 8, 60, 35, 14),
        box(40, 40, 6, 60, 50, 10),
        cylinder((50, 0, 9), (0, 1, 0), 1, 20),
    )
    return saved(folder / "odd.step", box(-30, 0, 0, -20, 10, 5), solid)


#: Titles of the readings of each solid: each takes half a second.
READINGS = {
    block: ("holes", "pockets", "besides holes"),
    odd: ("second solid", "besides holes of the second solid", "holes"),
    sheet: ("holes from below, as drawn", "holes from the side, turned by 30°", "outlines", "everything"),
}


@pytest.mark.parametrize("make", READINGS, ids=lambda make: make.__name__)
def test_a_solid_is_read_as_it_was_made(tmp_path: Path, make: Callable[[Path], Path]) -> None:
    expected = Path(__file__).parent / "solids" / f"{make.__name__}.txt"
    readers = {title: READ[title] for title in READINGS[make]}
    assert readings_of(make(tmp_path), readers) == expected.read_text(encoding="utf-8")
