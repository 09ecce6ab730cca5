"""What a person is told of a sheet that can be cut, but not as well as it seems."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api

FAST: dict[str, Any] = {"process": "cut", "iterations": 5, "threads": 1}
LASER: dict[str, Any] = {"machine": "laser-table", "cut_process": "laser_fiber_3kW", **FAST}


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One plate of 60 mm with a mark on it."""
    file = tmp_path_factory.mktemp("plate") / "plate.dxf"
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(20, 20), (80, 20), (80, 80), (20, 80)], close=True, dxfattribs={"layer": "CUT"})
    space.add_line((40, 50), (60, 50), dxfattribs={"layer": "MARK"})
    document.saveas(file)
    return file


def test_micro_joints_of_a_laser_are_warned_of_above_3_mm_and_not_below(plate: Path) -> None:
    thick = [i for i in api.optimize(plate, thickness="6", micro_joints=2, **LASER).issues if i.code == "L620"]
    assert len(thick) == 1
    assert "without the 0.73 s" in thick[0].message and thick[0].message.endswith("or leave out --micro-joints")
    for options in ({"thickness": "3", "micro_joints": 2}, {"thickness": "6"}):
        assert "L620" not in {i.code for i in api.optimize(plate, **options, **LASER).issues}
