"""Positions where paths are too wide, for successive paths."""

from __future__ import annotations

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.material.step_over import WidePlaceFinder, points_beyond_step_over
from leafcut.material.tool_steps import steps_along_path
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules

RULES = PocketRules(tool_diameter=4.0, step_over=2.4)
CENTRES = shapely.box(-50, -50, 50, 50)


def lines_at(heights: list[float], dent: tuple[float, float] | None = None) -> PocketPath:
    """Lines across the pocket; the second and the fourth leave the third by 0.5 mm between two places."""
    pieces = []
    for k, y in enumerate(heights):
        points = [(-50.0, y), (50.0, y)]
        if dent and k in (1, 3):
            away = y + 0.5 * (k - 2)
            points[1:1] = [(dent[0], y), (dent[0] + 1, away), (dent[1] - 1, away), (dent[1], y)]
        pieces.append(PocketPiece(Polyline.of_points(points)))
    return PocketPath("test", tuple(pieces))


def test_no_place_of_equal_lines_is_too_wide_and_all_are_between_lines_too_far_apart() -> None:
    assert not len(WidePlaceFinder(CENTRES, RULES)(lines_at([-4.8, -2.4, 0.0, 2.4, 4.8])))
    wide = WidePlaceFinder(CENTRES, RULES)(lines_at([-6.0, -3.0, 0.0, 3.0, 6.0]))
    assert wide[:, 0].min() < -45.0 and wide[:, 0].max() > 45.0
    assert np.diff(np.unique(wide[:, 0])).max() < 0.5


def test_a_path_that_differs_somewhere_from_the_last_is_told_as_if_there_had_been_none() -> None:
    """One after the other: nothing wide; dents; others elsewhere; a line missing; as at first."""
    rows = [0.0, 2.4, 4.8, 7.2, 9.6]
    paths = [
        lines_at(rows),
        lines_at(rows, dent=(-30.0, -20.0)),
        lines_at(rows, dent=(25.0, 31.0)),
        lines_at([0.0, 4.8, 7.2, 9.6]),
        lines_at(rows),
    ]
    again, counts = WidePlaceFinder(CENTRES, RULES), []
    for path in paths:
        whole = points_beyond_step_over(steps_along_path(path, RULES), CENTRES, RULES)
        found = again(path)
        counts.append(len(found))
        assert np.array_equal(np.unique(found.round(6), axis=0), np.unique(whole.round(6), axis=0))
    assert counts[0] == counts[4] == 0 and min(counts[1:4]) > 0
