"""How a sheet is cut and what it is cut on: they match, or the run is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.errors import OptionError
from leafcut.read.machine import load_machine
from rs274_moves import run_rs274

FAST: dict[str, Any] = {"process": "cut", "thickness": "6", "iterations": 5, "threads": 1}
TABLES = {
    "plasma": ("plasma-table", "qtplasmac", "torch"),
    "laser": ("laser-table", "fanuc-laser", "laser"),
    "oxyfuel": ("flame-table", "flame", "flame"),
    "waterjet": ("water-table", "waterjet", "water"),
}


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One plate with a hole."""
    file = tmp_path_factory.mktemp("plate") / "plate.dxf"
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(40, 40), (240, 40), (240, 240), (40, 240)], close=True)
    document.modelspace().add_circle((140, 140), 40)
    document.saveas(file)
    return file


@pytest.mark.parametrize("how", TABLES)
def test_a_process_without_a_machine_is_cut_on_a_table_that_can(
    how: str, plate: Path, rs274: str, tmp_path: Path
) -> None:
    """The table, its dialect and its kind of process by name; LinuxCNC takes what is for it, without a probe."""
    machine, words, kind = TABLES[how]
    outcome = api.optimize(plate, cut_process=how, **FAST)
    assert (outcome.machine.name, outcome.dialect, outcome.machine.head) == (machine, words, kind)
    assert outcome.detail.plan.data.process.startswith(how)
    assert outcome.verified
    if how in ("oxyfuel", "waterjet"):
        status, said = run_rs274(rs274, outcome.text, tmp_path)
        assert status == 0
        assert said.count("START_SPINDLE_CLOCKWISE") == said.count("DWELL(") == 2
        assert "PROBE" not in said


@pytest.mark.parametrize(
    "how, machine, material",
    [
        ("laser_co2_60W", "grbl-laser-co2", "acrylic"),
        ("laser", "grbl-laser-co2", "acrylic"),
        ("laser_fiber_6kW", "laser-table", "mild_steel"),
        ("laser", "laser-table", "mild_steel"),
    ],
)
def test_a_laser_named_by_its_kind_cuts_on_the_table_of_such_a_laser(
    how: str, machine: str, material: str, plate: Path
) -> None:
    """A CO2 tube cuts acrylic behind flying mirrors, a fibre laser steel on a table of tons: by the longest name."""
    outcome = api.optimize(plate, cut_process=how, material=material, **FAST)
    assert outcome.machine.name == machine
    assert outcome.verified


@pytest.mark.parametrize("how", TABLES)
@pytest.mark.parametrize("other", TABLES)
def test_a_table_or_a_dialect_that_cuts_in_another_way_is_refused_with_one_that_can(
    how: str, other: str, plate: Path
) -> None:
    if how == other:
        return
    with pytest.raises(OptionError, match=rf"cuts by {other}, not by {how}; choose --machine {TABLES[how][0]}"):
        api.optimize(plate, cut_process=how, machine=TABLES[other][0], **FAST)
    with pytest.raises(OptionError, match=rf"cut by {other}, not by {how}; choose --dialect"):
        api.optimize(plate, cut_process=how, dialect=TABLES[other][1], **FAST)


def test_a_flame_does_not_touch_the_sheet_to_find_it(plate: Path) -> None:
    """Neither the shipped table nor its programs have a probe, and asking for one is refused."""
    assert load_machine("flame-table").probe is None
    with pytest.raises(OptionError, match="--probe on"):
        api.optimize(plate, cut_process="oxyfuel", probe="on", **FAST)


def test_own_figures_cut_a_material_that_no_chart_has(plate: Path) -> None:
    own = {"cut_speed": "900mm/min", "kerf_width": "1.2", "pierce_delay": "0.4s"}
    outcome = api.optimize(plate, material="titanium", **own, **FAST)
    data = outcome.detail.plan.data
    assert (data.feed, data.kerf, data.pierce_delay) == (15.0, 1.2, 0.4)
