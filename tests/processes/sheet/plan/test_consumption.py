"""Consumption of a sheet: the chart's rates times the time with the torch on, by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from leafcut.model.cutting import Consumption, ConsumptionRates, CutData, CutTimes
from leafcut.processes.sheet.plan.costs import consumption_of

DATA = CutData("plasma", "mild_steel", 6.0, 25.0, 1.5, 45.0, volts=128.0)
#: An hour with the torch on, half an hour of it in 300 pierces; the rapids use up nothing.
SHEET = CutTimes(cut_s=1800.0, pierce_s=1800.0, rapid_s=900.0, pierces=300)


def used(of: CutTimes = SHEET, **rates: object) -> Consumption:
    return consumption_of(of, replace(DATA, rates=ConsumptionRates(**rates)), SHEET)  # type: ignore[arg-type]


def test_what_flows_is_rate_times_the_time_that_the_torch_is_on() -> None:
    """90 l/min and 2 l/min for an hour; 7.2 kW for an hour; 360 g/min for an hour."""
    found = used(gas_flow=1.5, second_gas_flow=2.0 / 60.0, power=7200.0, abrasive=0.006)
    assert found.gas_l == pytest.approx(5400.0)
    assert found.second_gas_l == pytest.approx(120.0)
    assert found.energy_kwh == pytest.approx(7.2)
    assert found.abrasive_kg == pytest.approx(21.6)
    assert not found.at_arc


def test_what_the_chart_does_not_say_stays_unknown() -> None:
    none = consumption_of(SHEET, replace(DATA, volts=None), SHEET)
    assert none == Consumption()


def test_without_the_power_that_is_drawn_the_energy_is_that_of_the_arc() -> None:
    """45 A at 128 V for an hour: 5.76 kWh."""
    found = used()
    assert found.energy_kwh == pytest.approx(5.76)
    assert found.at_arc


@pytest.mark.parametrize(
    ("life_h", "pierces", "expected"), [(2.0, None, 0.5), (None, 600.0, 0.5), (2.0, 200.0, 1.5), (0.5, 200.0, 2.0)]
)
def test_a_nozzle_wears_by_whichever_ends_it_first(
    life_h: float | None, pierces: float | None, expected: float
) -> None:
    life = None if life_h is None else life_h * 3600.0
    assert used(nozzle_life=life, nozzle_pierces=pierces).nozzles == pytest.approx(expected)
    assert used(electrode_life=life, electrode_pierces=pierces).electrodes == pytest.approx(expected)


def test_parts_of_a_sheet_add_up_also_where_each_would_wear_in_another_way() -> None:
    """One part of many pierces, one of long cuts: of the sheet the pierces end the nozzle first, so they count."""
    holes = CutTimes(cut_s=300.0, pierce_s=1700.0, pierces=290)
    edges = CutTimes(cut_s=1500.0, pierce_s=100.0, pierces=10)
    rates = {"nozzle_life": 7200.0, "nozzle_pierces": 200.0, "gas_flow": 1.0}
    whole, each = used(**rates), [used(holes, **rates), used(edges, **rates)]
    assert math.fsum(one.nozzles or 0.0 for one in each) == pytest.approx(whole.nozzles)
    assert math.fsum(one.gas_l or 0.0 for one in each) == pytest.approx(whole.gas_l)
    assert each[1].nozzles == pytest.approx(10 / 200)
