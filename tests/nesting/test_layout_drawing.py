"""The drawing of a nested sheet: which layer each outline is on, and what is drawn as a circle."""

from __future__ import annotations

import io
import math

import ezdxf
import numpy as np
import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, NestPart, Placement, Stock
from leafcut.nesting.post import layout_as_dxf


def entities(*contours: Contour) -> list[tuple[str, str]]:
    """Return type and layer of all that is drawn of a part, at X100 Y50."""
    nest = Nest((NestPart("part", contours),), (Stock(300, 200),), (Layout((Placement(0, 0.0, 100, 50),)),), (0,))
    drawing = ezdxf.read(io.StringIO(layout_as_dxf(nest, nest.layouts[0])))
    return [(one.dxftype(), one.dxf.layer) for one in drawing.modelspace() if one.dxf.layer != "SHEET"]


OUTLINE = Contour(Polyline.of_points([(0, 0), (80, 0), (80, 60), (0, 60)], closed=True))


def test_holes_open_cuts_and_marks_are_on_layers_of_their_own() -> None:
    slit = Polyline.of_points([(5, 5), (9, 5)])
    found = entities(OUTLINE, Contour(Polyline.circle(20, 20, 5)), Contour(slit), Contour(slit, "mark"))
    assert found == [("LWPOLYLINE", "CUT"), ("CIRCLE", "CUT_HOLES"), ("LWPOLYLINE", "CUT"), ("LWPOLYLINE", "MARK")]


@pytest.mark.parametrize(
    "rows, kind",
    [
        ([(10, 20, 1), (30, 20, 1)], "CIRCLE"),
        ([(10, 20, -1), (30, 20, -1)], "CIRCLE"),
        ([(10, 20, 1), (30, 20, 0)], "LWPOLYLINE"),
        ([(10, 20, 1), (30, 20, 0.5)], "LWPOLYLINE"),
        ([(10, 20, 0.5), (30, 20, 0.5)], "LWPOLYLINE"),
        ([(10, 20, 1), (30, 20, 1), (35, 20, 1)], "LWPOLYLINE"),
    ],
    ids=["half circles", "half circles clockwise", "half disc", "two radii", "lens", "three arcs"],
)
def test_only_two_equal_half_circles_are_drawn_as_a_circle(rows: list[tuple[float, float, float]], kind: str) -> None:
    assert entities(OUTLINE, Contour(Polyline(np.array(rows, dtype=float), closed=True)))[1] == (kind, "CUT_HOLES")


def test_a_circle_has_the_centre_and_radius_of_its_hole() -> None:
    nest = Nest(
        (NestPart("ring", (OUTLINE, Contour(Polyline.circle(20, 25, 5)))),),
        (Stock(300, 200),),
        (Layout((Placement(0, math.pi / 2, 100, 50),)),),
        (0,),
    )
    (circle,) = ezdxf.read(io.StringIO(layout_as_dxf(nest, nest.layouts[0]))).modelspace().query("CIRCLE")
    # A quarter turn brings (20, 25) to (-25, 20).
    assert tuple(circle.dxf.center) == pytest.approx((75, 70, 0))
    assert circle.dxf.radius == pytest.approx(5)
