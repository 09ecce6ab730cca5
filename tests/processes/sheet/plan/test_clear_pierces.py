"""Pierces lie in whole metal, not in the kerf of a cut made before."""

from __future__ import annotations

import shapely

from cut_sheets import PLASMA, assert_leads_in_scrap, assert_nothing_is_gouged, cutting_of, in_order, sheet_of, square
from leafcut.model.problem import Metric
from leafcut.processes.sheet.plan.cutting import Cutting, HeadTravel, drawing_order
from leafcut.processes.sheet.plan.moved_starts import clear_pierces_of_kerfs
from leafcut.processes.sheet.plan.starts import CutStart


def in_earlier_kerfs(cutting: Cutting, order: list[CutStart]) -> int:
    """Count the pierces whose middle an earlier kerf has taken."""
    kerfs = [shapely.LineString(cutting.cut(s).path.flattened(0.005)).buffer(0.5 * PLASMA.kerf) for s in order]
    points = [shapely.Point(*s.entry) for s in order]
    return sum(kerfs[i].contains(points[j]) for j in range(len(order)) for i in range(j))


def crossing_starts(cutting: Cutting) -> list[CutStart]:
    """Return starts of two contours; the second pierces on the first one's lead."""
    for a in (cutting.starts[n] for n in cutting.starts_by_contour[0]):
        for b in (cutting.starts[n] for n in cutting.starts_by_contour[1]):
            if in_earlier_kerfs(cutting, [a, b]):
                return [a, b]
    raise AssertionError("no lead of one square reaches a pierce of the other")


def close_squares() -> Cutting:
    """Two squares 8 mm apart, and leads of up to 6 mm between them."""
    sheet = sheet_of((square(20, 20, 50), 0, -1, 1), (square(78, 20, 50), 0, -1, 2))
    return cutting_of(sheet, lead_in_length=6.0)


def test_a_pierce_in_an_earlier_kerf_moves_to_whole_metal() -> None:
    cutting = close_squares()
    order = crossing_starts(cutting)
    clear = list(clear_pierces_of_kerfs(in_order(cutting, order), HeadTravel(Metric())).starts)
    assert [s.contour for s in clear] == [0, 1]
    assert in_earlier_kerfs(cutting, clear) == 0
    cuts = [cutting.cut(s) for s in clear]
    assert_nothing_is_gouged(cutting.sheet, cuts, PLASMA.kerf)
    assert_leads_in_scrap(cutting.sheet, cuts, PLASMA.kerf)


def test_starts_that_are_clear_of_all_kerfs_stay() -> None:
    cutting = cutting_of(sheet_of((square(20, 20, 50), 0, -1, 1), (square(200, 20, 50), 0, -1, 2)))
    order = drawing_order(cutting)
    assert list(clear_pierces_of_kerfs(in_order(cutting, order), HeadTravel(Metric())).starts) == order


def test_a_start_that_is_fixed_stays_even_in_a_kerf() -> None:
    cutting = close_squares()
    order = crossing_starts(cutting)
    only = Cutting(cutting.sheet, cutting.rules, cutting.contours, cutting.scrap, order)
    assert list(clear_pierces_of_kerfs(in_order(only, order), HeadTravel(Metric())).starts) == order
