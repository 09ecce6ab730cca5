"""A plate read from a solid: the material after the program has the heights of the solid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("OCP")

import leafcut
from made_solids import DOWN, UP, box, cone, cut, cylinder, rounded, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

THICKNESS, DIAMETER, CELL = 6.0, 3.0, 0.2
OPTIONS: dict[str, Any] = {
    "thickness": THICKNESS, "tool_diameter": DIAMETER, "feed": "600mm/min", "spindle_speed": 5000, "preset": "fast",
    "threads": 1,
}  # fmt: skip


@pytest.mark.hazard
def test_the_pockets_of_a_solid_are_cleared_to_their_floors(tmp_path: Path) -> None:
    """A hole has a counterbore, and a pocket has a deeper one in its floor. A blind hole is as wide as the mill."""
    solid = cut(
        box(0, 0, 0, 60, 40, THICKNESS),
        cylinder((12, 20, 4), UP, 6, 3),
        cylinder((12, 20, -1), UP, 3, 8),
        rounded(25, 5, 4, 55, 35, THICKNESS, 3),
        rounded(35, 12, 2, 50, 28, THICKNESS, 3),
        cylinder((5, 5, 3), UP, 0.5 * DIAMETER, 4),
    )
    program = tmp_path / "part.ngc"
    outcome = leafcut.part(saved(tmp_path / "plate.step", solid), program, **OPTIONS)
    missing = [(issue.missing.what, issue.missing.count) for issue in outcome.issues if issue.missing is not None]
    assert missing == [("pocket", 1)]
    field = leafcut.stock(program, workpiece="-5,-5,-7,65,45,0", cell=CELL, tool_diameter=DIAMETER).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    from_bore = np.hypot(x - 12, y - 20)
    wide, deep = (np.abs(x - 40) - 15, np.abs(y - 20) - 15), (np.abs(x - 42.5) - 7.5, np.abs(y - 20) - 8)
    in_wide, in_deep = (np.maximum(*sides) for sides in (wide, deep))
    expected = {
        -2.0: ((from_bore > 3.3) & (from_bore < 5.7)) | ((in_wide < -1.5) & (in_deep > 0.3)),
        -4.0: in_deep < -1.5,
        0.0: (from_bore > 6.3) & (in_wide > 0.3) & (x > 0.3) & (x < 59.7) & (y > 0.3) & (y < 39.7),
    }
    for height, cells in expected.items():
        assert cells.any() and (np.round(field.heights[cells], 3) == height).all()
    assert (field.heights[from_bore < 2.7] <= -THICKNESS).all()


@pytest.mark.parametrize("name", ["countersink", "from below", "chamfer"])
def test_features_of_a_solid_that_are_no_pockets_are_named(name: str, tmp_path: Path) -> None:
    tools = {
        "countersink": cone((30, 20, 3), 1, 4, 3),
        "from below": cylinder((30, 20, 2), DOWN, 5, 4),
        "chamfer": cone((30, 20, 3), 15, 18, 3),
    }
    solid = cut(box(0, 0, 0, 60, 40, THICKNESS), rounded(3, 3, 4, 10, 37, THICKNESS, 3), tools[name])
    outcome = leafcut.part(saved(tmp_path / "plate.step", solid), **OPTIONS)
    assert [issue.code for issue in outcome.issues if issue.missing is not None] == ["L219"]
    assert {row.operation for row in outcome.detail.layers} == {"profile", "pocket"}


@pytest.mark.hazard
def test_copies_of_a_solid_have_its_pockets_and_its_missing_work(tmp_path: Path) -> None:
    solid = cut(box(0, 0, 0, 40, 30, THICKNESS), rounded(5, 5, 4, 20, 25, THICKNESS, 3), cone((30, 20, 3), 1, 4, 3))
    plate, program = saved(tmp_path / "plate.step", solid), tmp_path / "part.ngc"
    (single,) = leafcut.part(plate, **OPTIONS).missing
    result = leafcut.part(plate, program, copies="2x1", copy_spacing=10, **OPTIONS)
    (both,) = result.missing
    assert both.missing.count == 2 * single.missing.count
    assert both.missing.where[len(single.missing.where) :] == tuple((x + 50, y) for x, y in single.missing.where)
    pockets = [row.shapes for row in result.detail.layers if row.operation == "pocket"]
    assert (result.detail.outlines, pockets) == (2, [2])
    field = leafcut.stock(program, workpiece="-5,-5,-7,95,35,0", cell=CELL, tool_diameter=DIAMETER).field
    shift = round(50 / CELL)
    y = field.y + CELL * np.arange(field.heights.shape[0])
    x = field.x + CELL * np.arange(field.heights.shape[1])
    pocket = np.ix_((y > 7) & (y < 23), (x > 7) & (x < 18))
    first, second = field.heights[:, :-shift], field.heights[:, shift:]
    for heights in (first, second):
        assert (np.round(heights[pocket], 3) == -2.0).all()
