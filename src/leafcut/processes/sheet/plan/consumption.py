"""What cutting uses up, in physical units, from the rates of the cut chart."""

from __future__ import annotations

from leafcut.model.cutting import Consumption, CutData, CutTimes

_JOULES = 3.6e6  # of a kWh


def consumption_of(times: CutTimes, data: CutData, sheet: CutTimes) -> Consumption:
    """Return what a time uses up; what the chart does not say stays unknown.

    Gas, power and abrasive flow while the torch is on: cutting and piercing. Without a figure for the power that is
    drawn it is that of the arc, current times voltage. A nozzle or an electrode wears by seconds of cutting or by
    pierces, whichever ends it first on the whole `sheet`, so that its parts add up.
    """
    rates, burning = data.rates, times.cut_s + times.pierce_s

    def flowed(rate: float | None) -> float | None:
        return None if rate is None else rate * burning

    arc = data.amps * data.volts if data.amps and data.volts else None
    energy = flowed(rates.power if rates.power is not None else arc)
    return Consumption(
        gas_l=flowed(rates.gas_flow),
        second_gas_l=flowed(rates.second_gas_flow),
        energy_kwh=None if energy is None else energy / _JOULES,
        abrasive_kg=flowed(rates.abrasive),
        nozzles=_worn(times, sheet, rates.nozzle_life, rates.nozzle_pierces),
        electrodes=_worn(times, sheet, rates.electrode_life, rates.electrode_pierces),
        at_arc=rates.power is None and arc is not None,
    )


def _worn(times: CutTimes, sheet: CutTimes, life: float | None, pierces: float | None) -> float | None:
    def by_time(of: CutTimes) -> float:
        return (of.cut_s + of.pierce_s) / life if life else 0.0

    def by_pierces(of: CutTimes) -> float:
        return of.pierces / pierces if pierces else 0.0

    if life is None and pierces is None:
        return None
    return by_time(times) if by_time(sheet) >= by_pierces(sheet) else by_pierces(times)
