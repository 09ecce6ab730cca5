"""Whether a tool may come down where it is to go on: only where earlier runs took all of its disc."""

from __future__ import annotations

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import PocketRules
from leafcut.processes.pocket.plan.toolpath import ClearedArea, DescentClearance

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)


def line(*points: tuple[float, float]) -> Polyline:
    return Polyline.of_points(points)


def test_nothing_is_open_before_the_first_run_nor_beside_it() -> None:
    cleared = ClearedArea(RULES)
    assert cleared.add_run(line((0, 0), (50, 0))) is DescentClearance.NO
    assert cleared.add_run(line((25, 11), (25, 30))) is DescentClearance.NO


def test_where_a_run_has_been_the_tool_comes_down_and_a_little_beside_it_does_not() -> None:
    """Half a tolerance (0.005 mm) is open; a fiftieth of the radius (0.1 mm) nearly; more is not."""
    for off, opened in (
        (0.0, DescentClearance.CLEAR),
        (0.003, DescentClearance.CLEAR),
        (0.08, DescentClearance.NEARLY),
        (0.3, DescentClearance.NO),
    ):
        cleared = ClearedArea(RULES)
        cleared.add_run(line((0, 0), (50, 0)))
        assert cleared.add_run(line((25, off), (25, 30))) is opened, off


def test_a_run_counts_for_those_behind_it_only() -> None:
    cleared = ClearedArea(RULES)
    cleared.add_run(line((0, 0), (10, 0)))
    assert cleared.add_run(line((40, 0), (50, 0))) is DescentClearance.NO
    assert cleared.add_run(line((40, 0), (41, 0))) is DescentClearance.CLEAR


def test_two_runs_side_by_side_open_what_is_between_them_together() -> None:
    """Rows 9.9 mm apart touch where the tool is widest; rows 10.5 mm apart leave a strip of half a millimetre."""
    for apart, opened in ((0.2, DescentClearance.CLEAR), (9.9, DescentClearance.CLEAR), (10.5, DescentClearance.NO)):
        cleared = ClearedArea(RULES)
        cleared.add_run(line((0, 0), (50, 0)))
        cleared.add_run(line((0, apart), (50, apart)))
        assert cleared.add_run(line((25, 0.5 * apart), (25, 90))) is opened, apart


def test_what_is_cleared_is_a_stadium_round_every_run() -> None:
    cleared = ClearedArea(RULES)
    cleared.add_run(line((0, 0), (50, 0)))
    assert cleared.area().area == pytest.approx(50 * 10 + 3.14159265 * 25, rel=1e-3)
    cleared.add_run(line((100, 0), (150, 0)))
    assert cleared.area().area == pytest.approx(2 * (50 * 10 + 3.14159265 * 25), rel=1e-3)
