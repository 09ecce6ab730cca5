"""The planner cuts nested blocks with common lines, and proves loops and joints together."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import PlanError

EXAMPLE = Path(__file__).parents[2] / "examples" / "sheet.dxf"
LASER: dict[str, Any] = {"process": "cut", "machine": "laser-table", "thickness": 3, "iterations": 5, "threads": 1}
#: Plates of 60 × 40 with a hole; the kerf is the chart's for steel of 3 mm.
KERF = 0.22


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (60, 0), (60, 40), (0, 40)], close=True)
    space.add_circle((30, 20), 6)
    document.saveas(tmp_path / "plate.dxf")
    return tmp_path / "plate.dxf"


def nested(plate: Path, count: int, *more: str) -> Path:
    sheet = plate.with_name("sheet.dxf")
    words = ["nest", f"{plate}:{count}", "--sheet", "500x300", "--kerf", str(KERF), *more, "-o", str(sheet), "-q"]
    assert run([*words, "--machine", "laser-table"]) == 0
    return sheet


@pytest.mark.parametrize(
    ("kind", "least"), [("pairs", 10 * 40.0), pytest.param("grids", 12 * 40.0, marks=pytest.mark.slow)]
)
def test_twenty_laser_parts_are_nested_in_blocks_and_cut_with_common_lines(
    kind: str, least: float, plate: Path
) -> None:
    """Each pair shares an edge of at least 40 mm."""
    sheet = nested(plate, 20, "--gap", "10", "--blocks", kind)
    outcome = api.optimize(sheet, common_lines=True, **LASER)
    assert outcome.verified
    assert outcome.detail.plan is not None
    assert outcome.detail.plan.measures.sheet.common_mm >= least
    assert [i.code for i in outcome.issues if i.severity == "missing"] == []


def test_parts_packed_without_a_gap_are_refused_with_a_remedy(plate: Path) -> None:
    sheet = nested(plate, 20, "--gap", "0", "--nester", "rectangles")
    with pytest.raises(PlanError, match=r"no lead fits .*leafcut nest --blocks.*--common-lines"):
        api.optimize(sheet, **LASER)


@pytest.mark.parametrize(
    "machine",
    [{"machine": "laser-table", "micro_joints": 2}, pytest.param({"micro_joints": 1}, marks=pytest.mark.slow)],
    ids=str,
)
def test_loops_round_corners_and_micro_joints_are_proved_together_on_the_example(machine: dict[str, Any]) -> None:
    options = {"process": "cut", "thickness": 3, "iterations": 5, "threads": 1, **machine}
    assert api.optimize(EXAMPLE, corner_loops=True, **options).verified
