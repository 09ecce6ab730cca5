"""Slots of one to two kerfs are cut along their centreline: a kerf wide, as long as drawn, proved; by hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.model.outcome import Outcome

KERF = 1.5
CUT: dict[str, Any] = {"process": "cut", "thickness": 6, "kerf": KERF, "iterations": 5, "threads": 1}


def cut(folder: Path, width: float, *, rounded: bool = False, angle: float = 0.0, length: float = 30.0) -> Outcome:
    """Cut a plate of 100 × 60 with a slot about (50, 30)."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
    half, bulge = 0.5 * (length - width if rounded else length), 1.0 if rounded else 0.0
    corners = [
        (-half, -0.5 * width, 0.0),
        (half, -0.5 * width, bulge),
        (half, 0.5 * width, 0.0),
        (-half, 0.5 * width, bulge),
    ]
    cos, sin = math.cos(angle), math.sin(angle)
    slot = [(50 + cos * x - sin * y, 30 + sin * x + cos * y, b) for x, y, b in corners]
    space.add_lwpolyline(slot, format="xyb", close=True)
    document.saveas(folder / "slot.dxf")
    return api.optimize(folder / "slot.dxf", **CUT)


@pytest.mark.parametrize(
    ("width", "rounded", "angle", "told"), [(2.4, False, 0.0, True), (2.0, True, 0.7, True), (KERF, False, 0.3, False)]
)
def test_a_narrow_slot_is_cut_on_its_middle_as_long_as_drawn(
    width: float, rounded: bool, angle: float, told: bool, tmp_path: Path
) -> None:
    """30 mm less half a kerf at either end: the kerf's own round ends reach the rest."""
    outcome = cut(tmp_path, width, rounded=rounded, angle=angle)
    assert outcome.verified
    assert outcome.detail.plan is not None
    first, last = outcome.detail.plan.cuts
    assert last.contours == (0,)
    ends = sorted([first.path.start, first.path.end])
    along = (0.5 * (30.0 - KERF) * math.cos(angle), 0.5 * (30.0 - KERF) * math.sin(angle))
    assert ends[0] == pytest.approx((50 - along[0], 30 - along[1]), abs=0.02)
    assert ends[1] == pytest.approx((50 + along[0], 30 + along[1]), abs=0.02)
    assert [i.severity for i in outcome.issues if i.code == "L627"] == (["warning"] if told else [])
    assert not [i for i in outcome.issues if i.severity == "missing"]


@pytest.mark.parametrize(("width", "length"), [(1.2, 30.0), (2.4, 4.0)])
def test_a_slot_narrower_than_the_kerf_or_as_short_as_a_hole_is_still_told_as_missing(
    width: float, length: float, tmp_path: Path
) -> None:
    outcome = cut(tmp_path, width, length=length)
    assert [i.code for i in outcome.issues if i.severity == "missing"] == ["L611"]
