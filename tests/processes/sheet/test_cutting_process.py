"""How a sheet is cut and what it is cut on: they match, or the run is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.errors import OptionError
from leafcut.processes.sheet.spec import resolve_cut_process
from leafcut.read.cutchart import load_chart
from leafcut.read.machine import load_machine, machine_names, machine_template
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


@pytest.mark.hazard
@pytest.mark.parametrize(
    "machine, asked, words",
    [
        ("grbl-laser-5w", None, "no data for laser_diode_5w, only for laser_co2_60w, .*--chart .*--cut-speed"),
        ("grbl-laser-20w", "laser", "no data for laser_diode_20w"),
        ("grbl-laser-5w", "laser_co2_60W", "--cut-process laser_co2_60w: grbl-laser-5w has laser_diode_5w"),
        ("laser-table", "laser_co2_60W", "laser-table has laser_fiber_3kw"),
        ("laser-table", None, "the chart has no 'plywood' for laser_fiber_3kw"),
        ("mine.toml", None, "the chart has laser_co2_60w, .*unknown kind and power; name yours"),
    ],
)
def test_a_laser_gets_no_cutting_data_of_another_kind_or_power(
    machine: str, asked: str | None, words: str, plate: Path, tmp_path: Path
) -> None:
    if machine == "mine.toml":
        text = machine_template("grbl-laser-co2").replace("\ncut_process =", "\n# cut_process =")
        file = tmp_path / machine
        file.write_text(text.replace('cut_process = "a tube', '# "a tube'), encoding="utf-8")
        machine = str(file)
    with pytest.raises(OptionError, match=words) as caught:
        api.optimize(plate, machine=machine, cut_process=asked, material="plywood", **FAST)
    assert "\n" not in str(caught.value)


def test_every_shipped_table_uses_the_rows_of_its_own_source_only() -> None:
    """Diodes get none, since no chart at hand is of them."""
    named = {row.process for row in load_chart()}
    found = {
        name: resolve_cut_process(machine, None)[0]
        for name in machine_names()
        if (machine := load_machine(name)).head.method
    }
    assert found == {
        "plasma-table": "plasma",
        "flame-table": "oxyfuel",
        "water-table": "waterjet",
        "laser-table": "laser_fiber_3kw",
        "grbl-laser-co2": "laser_co2_60w",
        "grbl-laser-5w": "laser_diode_5w",
        "grbl-laser-20w": "laser_diode_20w",
    }
    assert {name for name, process in found.items() if process not in named} == {"grbl-laser-5w", "grbl-laser-20w"}


def test_another_power_than_the_machine_has_is_used_where_it_is_named_with_a_warning() -> None:
    process, issues = resolve_cut_process(load_machine("laser-table"), "laser_fiber_6kW")
    assert (process, [i.code for i in issues]) == ("laser_fiber_6kw", ["L413"])
    assert "but laser-table has laser_fiber_3kw" in issues[0].message


def test_a_flame_does_not_touch_the_sheet_to_find_it(plate: Path) -> None:
    """Neither the shipped table nor its programs have a probe."""
    assert load_machine("flame-table").probe is None
    assert "G38.2" not in api.optimize(plate, cut_process="oxyfuel", **FAST).text


def test_own_figures_cut_a_material_that_no_chart_has(plate: Path) -> None:
    own = {"cut_speed": "900mm/min", "kerf": "1.2", "pierce_delay": "0.4s"}
    outcome = api.optimize(plate, material="titanium", **own, **FAST)
    data = outcome.detail.plan.data
    assert (data.feed, data.kerf, data.pierce_delay) == (15.0, 1.2, 0.4)
