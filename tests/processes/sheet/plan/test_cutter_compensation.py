"""Input for a controller that compensates half the kerf itself; it determines the torch path."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cut_sheets import PLASMA, cutting_of, part_in_notch, ring, sheet_of, square, two_squares
from leafcut.geometry.polyline import Polyline
from leafcut.processes.sheet.plan.contours import CutContour
from leafcut.processes.sheet.plan.cutting import programmed_path

HALF = PLASMA.kerf / 2


def by_path(contour: CutContour) -> bool:
    """Return whether the program compensates the kerf of a contour."""
    return contour.rules.compensation == "geometry"


def test_the_contour_is_programmed_as_it_is_drawn_and_the_kerf_runs_half_of_it_beside() -> None:
    for sheet in (two_squares(), ring()):
        cutting = cutting_of(sheet, compensation="controller")
        cuts = [start for start in cutting.starts if cutting.contours[start.contour].has_leads]
        assert {start.contour for start in cuts} == {0, 1}
        for start in cuts:
            contour = cutting.contours[start.contour]
            path, lead_in = programmed_path(contour, start)
            body = shapely.LineString(path.piece(lead_in, path.length).flattened(0.001))
            drawn = shapely.LinearRing(contour.source.path.flattened(0.001))
            assert drawn.hausdorff_distance(body) < 0.02
            at = contour.path.point_at(start.at)
            assert drawn.distance(shapely.Point(at)) == pytest.approx(HALF, abs=0.01)
            assert shapely.Point(path.piece(lead_in, path.length).start).distance(shapely.Point(at)) == pytest.approx(
                HALF, abs=0.01
            )


def test_the_lead_begins_where_the_torch_pierces_and_comes_in_along_the_contour() -> None:
    """Where the arc of the lead meets the contour, both have the same direction; none of it is in the part."""
    cutting = cutting_of(two_squares(), compensation="controller")
    parts = [shapely.box(20, 20, 70, 70), shapely.box(90, 20, 140, 70)]
    for start in cutting.starts:
        contour = cutting.contours[start.contour]
        path, lead_in = programmed_path(contour, start)
        assert path.start == pytest.approx(start.entry, abs=1e-6)
        before, after = (np.array(path.direction_at(lead_in + d)) for d in (-1e-3, 1e-3))
        assert before @ after == pytest.approx(1.0, abs=1e-3)
        lead = shapely.LineString(path.piece(0.0, lead_in).flattened(0.001))
        assert lead.intersection(shapely.union_all(parts).buffer(-0.01)).is_empty


def test_an_outline_with_a_notch_narrower_than_the_kerf_is_compensated_by_the_program() -> None:
    cutting = cutting_of(part_in_notch(0.5), compensation="controller")
    assert [by_path(c) for c in cutting.contours if c.pinched] == [True]


def test_a_hollow_rounder_than_the_kerf_and_a_hole_without_room_are_compensated_by_the_program() -> None:
    """A hole of 3 mm has no room for run-in and arc; one of 40 mm has, and so has the outline."""
    small, large = Polyline.circle(60, 60, 1.5), Polyline.circle(120, 120, 20)
    sheet = sheet_of((square(20, 20, 160), 0, -1, 1), (small, 1, 0, 1), (large, 1, 0, 1), size=200)
    cutting = cutting_of(sheet, compensation="controller")
    assert {round(c.diameter): by_path(c) for c in cutting.contours if c.hole} == {3: True, 40: False}
    assert [by_path(c) for c in cutting.contours if not c.hole] == [False]
    assert [issue.code for issue in cutting.issues].count("L626") == 1
