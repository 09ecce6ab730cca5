"""The height field of leafcut's own pocket programs is what the polygons of their proof say, cell by cell."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import shapely

from benchmarked import benchmark
from leafcut.processes.pocket.strategies import WAYS

stock_pockets = benchmark("stock_pockets")
#: A pocket of 56 × 42 mm with round corners, a round island, and a notch that the tool does not reach all of.
NOTCH = shapely.Polygon([(49, 20), (62, 21), (62, 23), (49, 24)])
POCKET = shapely.box(7, 7, 49, 35).buffer(7, quad_segs=32).union(NOTCH) - shapely.Point(26, 21).buffer(5, quad_segs=32)


@pytest.mark.parametrize("strategy", [way.name for way in WAYS])
def test_both_models_cut_the_same_of_a_pocket_with_every_strategy(strategy: str, tmp_path: Path) -> None:
    """Up to a cell along the edges; what the tool does not reach is left by both, and neither cuts beyond the walls."""
    (tmp_path / "pocket.wkt").write_text(POCKET.wkt)
    found = stock_pockets.compare(tmp_path / "pocket.wkt", strategy, 0.2, iterations=3)
    assert found.wrong == 0
    assert found.apart < 0.002
    assert found.by_polygons == pytest.approx(56 * 42 - (4 - math.pi) * 49 - 25 * math.pi, rel=0.03)
    assert found.gouged == (0.0, 0.0)
    assert found.left[0] == pytest.approx(found.left[1], abs=2.0)
