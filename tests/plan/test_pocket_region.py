"""Where a tool may be: by hand calculation on shapes with known offsets."""

from __future__ import annotations

import math

import pytest

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.plan.pocket_region import centre_regions

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)


def box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    """A rectangle, counter-clockwise."""
    return Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def test_a_rectangle_keeps_the_radius_and_the_stock_away_from_its_walls_and_leaves_its_corners_uncut() -> None:
    rules = PocketRules(tool_diameter=10.0, step_over=6.0, stock=0.5)
    regions, issues = centre_regions(Pocket(box(0, 0, 100, 60)), rules)
    assert len(regions) == 1
    assert regions[0].polygon.area == pytest.approx(89.0 * 49.0, rel=1e-3)
    # Each corner keeps (1 − π/4)·r² whatever the stock: the finishing pass goes to the wall.
    assert len(issues) == 4
    areas = [float(issue.message.split(": ")[1].split(" mm²")[0]) for issue in issues]
    assert areas == pytest.approx([(1 - math.pi / 4) * 25] * 4, rel=0.03)


def test_a_ring_has_a_region_round_its_island() -> None:
    pocket = Pocket(Polyline.circle(0, 0, 40), (Polyline.circle(0, 0, 12, clockwise=True),))
    regions, issues = centre_regions(pocket, RULES)
    assert regions[0].polygon.area == pytest.approx(math.pi * (35**2 - 17**2), rel=1e-3)
    assert [len(r.rings) for r in regions] == [2] and issues == []
    assert abs(math.hypot(*regions[0].rings[1][0]) - 17.0) < 0.01


def test_a_passage_that_is_too_narrow_parts_the_region_and_is_told() -> None:
    outline = Polyline.of_points(
        [
            (0, 0),
            (40, 0),
            (40, 16),
            (60, 16),
            (60, 0),
            (100, 0),
            (100, 40),
            (60, 40),
            (60, 24),
            (40, 24),
            (40, 40),
            (0, 40),
        ],
        closed=True,
    )
    regions, issues = centre_regions(Pocket(outline), RULES)
    assert len(regions) == 2
    assert any("near (50" in issue.message for issue in issues)


def test_a_tool_that_fits_nowhere_is_refused() -> None:
    with pytest.raises(PlanError, match="a tool of 10 mm fits nowhere"):
        centre_regions(Pocket(box(0, 0, 9, 50)), RULES)


def test_an_island_that_crosses_the_wall_is_refused() -> None:
    with pytest.raises(PlanError, match="must not cross or touch"):
        centre_regions(Pocket(box(0, 0, 50, 50), (box(40, 10, 60, 20).reversed(),)), RULES)
