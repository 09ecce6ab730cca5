"""The height field of a written pocket program and the polygons of the pocket proof remove the same, cell by cell."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import leafcut
from leafcut.material.removal import measure_removal
from leafcut.processes.pocket.strategies import STRATEGIES

TOOL = 10.0
#: Two levels of unequal depth: the comparison is of the second.
DEPTH, STEP_DOWN = 3.0, 2.0
#: Side of a cell, mm.
CELL = 0.2
#: A notch of 2 mm that the tool cannot enter.
NOTCH = shapely.Polygon([(37, 17), (48, 18), (48, 20), (37, 21)])
#: A pocket of 44 × 36 mm with round corners, a round island and the notch.
POCKET = shapely.box(7, 7, 37, 29).buffer(7, quad_segs=32).union(NOTCH) - shapely.Point(22, 18).buffer(4, quad_segs=32)
#: Floor within reach of the tool, without the notch, mm².
FLOOR = 44 * 36 - (4 - math.pi) * 7**2 - math.pi * 4**2


@pytest.mark.parametrize(
    "strategy", [pytest.param(way.name, marks=[pytest.mark.slow] * (way.name == "adaptive")) for way in STRATEGIES]
)
def test_height_field_and_polygons_remove_the_same_of_a_pocket(strategy: str, tmp_path: Path) -> None:
    """They differ by at most a cell along the edges; neither cuts beyond the walls, and both leave the same uncut."""
    (tmp_path / "pocket.wkt").write_text(POCKET.wkt)
    outcome = leafcut.optimize(
        tmp_path / "pocket.wkt",
        process="pocket",
        units="mm",
        strategy=strategy,
        tool_diameter=TOOL,
        depth=DEPTH,
        step_down=STEP_DOWN,
        feed="800mm/min",
        preset="fast",
        iterations=3,
        threads=1,
        max_engagement="100deg" if strategy == "adaptive" else None,
    )
    (tmp_path / "pocket.ngc").write_text(outcome.text)
    field = leafcut.stock(
        tmp_path / "pocket.ngc", workpiece=f"-10,-10,{-DEPTH - 1},58,46,0", cell=CELL, tool_diameter=TOOL
    ).field
    deep = field.heights < -STEP_DOWN - 0.1
    rows, columns = deep.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))

    def inside(shape: Any) -> np.ndarray:
        shapely.prepare(shape)
        return np.asarray(shapely.contains_xy(shape, x, y))

    (plan,) = outcome.detail.plans
    polygons = measure_removal(plan.pocket, plan.result.path, plan.rules)
    assert not (inside(polygons.swept.buffer(-CELL)) & ~deep).any()
    assert not (deep & ~inside(polygons.swept.buffer(CELL))).any()
    assert not (deep & ~inside(POCKET.buffer(0.5 * CELL))).any()
    area = float(deep.sum()) * CELL**2
    assert area == pytest.approx(polygons.swept.area, rel=0.002)
    assert area == pytest.approx(FLOOR, rel=0.03)
    left = float((inside(polygons.reachable.buffer(-0.5 * CELL)) & ~deep).sum()) * CELL**2
    assert left == pytest.approx(polygons.uncovered.area, abs=2.0)
    assert polygons.gouges.area == 0.0
