"""Where a tool may be: by hand calculation on shapes with known offsets."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline
from leafcut.model.issue import Severity
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.processes.pocket.plan.region import centre_regions, unreachable_areas

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
    [told] = issues
    assert told.severity is Severity.NOTE
    assert told.message.startswith("the pocket: 4 corners, ") and "; the largest measures " in told.message
    areas = [float(word) for word in re.findall(r"([\d.]+) mm²", told.message)]
    assert areas == pytest.approx([4 * (1 - math.pi / 4) * 25, (1 - math.pi / 4) * 25], rel=0.03)


def test_a_slot_as_wide_as_the_tool_has_its_middle_as_region() -> None:
    """A quarter of a circle of 40 mm and its tangent; where a slot has a corner it is wider, and no line will do."""
    turn = [(40 * math.sin(a), 40 - 40 * math.cos(a)) for a in np.linspace(0, math.pi / 2, 400)]
    smooth, bent = shapely.LineString([(-30, 0), *turn]), shapely.LineString([(0, 0), (40, 0), (60, 25)])
    [region], issues = centre_regions(
        Pocket(as_polyline(smooth.buffer(5.0, quad_segs=64).exterior.coords, True)), RULES
    )
    assert region.slot_centre_line is not None and not issues
    path = shapely.LineString(region.slot_centre_line)
    assert path.length == pytest.approx(30.0 + 20.0 * math.pi, abs=0.02)
    assert path.hausdorff_distance(smooth) < 0.01
    [region], _ = centre_regions(Pocket(as_polyline(bent.buffer(5.0, quad_segs=64).exterior.coords, True)), RULES)
    assert region.slot_centre_line is None


def test_a_slot_as_wide_as_the_tool_that_leads_out_of_a_pocket_belongs_to_its_region() -> None:
    shape = shapely.union_all([shapely.box(0, -20, 40, 20), shapely.box(30, -5, 80, 5)])
    [region], issues = centre_regions(Pocket(as_polyline(shape.exterior.coords, True)), RULES)
    assert region.slot_centre_line is None
    assert region.polygon.bounds[2] == pytest.approx(75.0, abs=0.01)
    assert all(issue.severity is Severity.NOTE for issue in issues)  # corners only


@pytest.mark.parametrize("width", [9.98, 9.5])
def test_a_slot_narrower_than_the_tool_is_refused(width: float) -> None:
    with pytest.raises(PlanError, match="does not fit anywhere"):
        centre_regions(Pocket(box(0, 0, 60, width)), RULES)


def test_a_ring_has_a_region_round_its_island() -> None:
    pocket = Pocket(Polyline.circle(0, 0, 40), (Polyline.circle(0, 0, 12, clockwise=True),))
    regions, issues = centre_regions(pocket, RULES)
    assert regions[0].polygon.area == pytest.approx(math.pi * (35**2 - 17**2), rel=1e-3)
    assert [len(r.boundary_rings) for r in regions] == [2] and issues == []
    assert abs(math.hypot(*regions[0].boundary_rings[1][0]) - 17.0) < 0.01


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
    # The passage by itself, and all corners (four of each square) in one line.
    passage, corners = issues
    assert "near (50.00, 20.00) remains uncut" in passage.message and passage.severity is Severity.MISSING
    assert "8 corners" in corners.message


@pytest.mark.parametrize("wide, deep, off", [(8.0, 30.0, True), (9.98, 30.0, True), (8.0, 1.0, False)])
def test_a_slot_narrower_than_the_tool_is_cut_off_and_a_shallow_notch_is_as_a_corner(
    wide: float, deep: float, off: bool
) -> None:
    shape = shapely.union(shapely.box(0, 0, 60, 60), shapely.box(60, 20, 60 + deep, 20 + wide))
    issues = centre_regions(Pocket(as_polyline(shape.exterior.coords, True)), RULES)[1]
    assert ["remains uncut" in issue.message for issue in issues] == ([True, False] if off else [False])


@pytest.mark.parametrize("degrees", [30.0, 60.0, 120.0])
def test_the_tip_of_a_wedge_is_a_corner_with_the_area_between_its_walls_and_the_tool(degrees: float) -> None:
    """Between two walls at 2α a disc of radius r leaves r² (cot α − (π/2 − α))."""
    half = math.radians(0.5 * degrees)
    x, y = 100.0 * math.cos(half), 100.0 * math.sin(half)
    wedge = shapely.Polygon([(0, 0), (x, -y), (x, y)]).intersection(shapely.Point(0, 0).buffer(80, quad_segs=64))
    tips = [u for u in unreachable_areas(wedge, RULES) if math.hypot(*u.place) < 25]
    assert [u.corner for u in tips] == [True]
    assert tips[0].area == pytest.approx(25.0 * (1.0 / math.tan(half) - (0.5 * math.pi - half)), rel=0.03)


def test_a_tool_that_fits_nowhere_is_refused() -> None:
    with pytest.raises(PlanError, match="a tool of 10 mm does not fit anywhere"):
        centre_regions(Pocket(box(0, 0, 9, 50)), RULES)


def test_a_pocket_is_named_once() -> None:
    named = [Pocket(box(0, 0, 9, 9), name=name).label for name in ("", "pocket", "3", "POCKET_A")]
    assert named == ["the pocket", "the pocket", "pocket 3", "POCKET_A"]


def test_an_island_that_crosses_the_wall_is_refused() -> None:
    with pytest.raises(PlanError, match="must not cross or touch"):
        centre_regions(Pocket(box(0, 0, 50, 50), (box(40, 10, 60, 20).reversed(),)), RULES)
