"""Compute the cycle time, cost and consumption of each part, the sheet and the batch."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType

from leafcut.geometry.arrays import Point
from leafcut.model.cutting import Consumption, Cut, CutData, CutMeasures, CutPlan, CutTimes, PartTimes
from leafcut.model.quote import cost_of_time
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions

#: Joules per kilowatt-hour.
_JOULES = 3.6e6
#: Fields of `CutTimes` that are times, s, or lengths, mm.
_SUMS = ("cut_s", "pierce_s", "rapid_s", "cut_mm", "rapid_mm", "perimeter_mm", "common_mm")


def measure_cuts(
    plan: CutPlan,
    seconds: Sequence[tuple[float, float, float]],
    whole: float,
    options: CutOptions,
    corners: Mapping[int, Sequence[Point]] = MappingProxyType({}),
    shop_rate: float = 0.0,
    quantity: int = 1,
) -> CutMeasures:
    """Measure the times, lengths, costs and consumption of the cuts in a plan.

    Moves before the first cut and after the last cut count as rapids of the sheet.

    Parameters
    ----------
    seconds
        Three times for each cut, s: cutting, piercing, and rapids including the retract.
    whole
        Time for the whole program, s.
    corners
        Corners of the travel move before each cut, keyed by the index of the cut.
    shop_rate
        Cost of the machine and its operator per hour.
    quantity
        Number of sheets in the batch.
    """
    sheet, cuts, data = plan.sheet, plan.cuts, plan.data
    each = [_times_of_cut(sheet, cuts, k, parts, corners.get(k, ())) for k, parts in enumerate(seconds)]
    one = _sum_times(each)
    one = replace(one, rapid_s=one.rapid_s + whole - one.total_s)
    areas = part_areas(sheet)
    names = {c.part: c.name for c in sheet.contours if c.name}
    shares: dict[int, list[CutTimes]] = {}
    for times, cut in zip(each, cuts, strict=True):
        for number in {sheet.contours[i].part for i in cut.contours}:
            shares.setdefault(number, []).extend(_share_of_part(sheet, cut, times, number))
    cut_parts = {sheet.contours[i].part for c in cuts if c.kind == "cut" for i in c.contours}
    used = sum(area for number, area in areas.items() if number in cut_parts)
    parts = []
    for number in sorted(shares):
        own, area = _sum_times(shares[number]), areas.get(number, 0.0)
        # The price of the sheet is divided among its parts by area.
        metal = sheet.price * area / used if number in cut_parts and used else 0.0
        used_up = consumption_of(own, data, one)
        parts.append(
            PartTimes(number, area, own, cost_of(own, options, shop_rate) + metal, names.get(number, ""), used_up)
        )
    cost = cost_of(one, options, shop_rate) + sheet.price
    batch = one.multiplied_by(quantity)
    return CutMeasures(
        sheet=one,
        batch=batch,
        quantity=quantity,
        parts=tuple(parts),
        utilisation=used / sheet.area if sheet.area > 0.0 else None,
        cost=cost,
        batch_cost=cost * quantity,
        cuts=tuple(each),
        used=consumption_of(one, data, one),
        batch_used=consumption_of(batch, data, one),
    )


def _times_of_cut(
    sheet: Sheet, cuts: Sequence[Cut], k: int, seconds: tuple[float, float, float], corners: Sequence[Point]
) -> CutTimes:
    cut = cuts[k]
    places = [cuts[k - 1].path.end, *corners, cut.path.start] if k else []
    way = sum(math.dist(a, b) for a, b in pairwise(places))
    # The edges along a common line count as part of the cut around its parts.
    return CutTimes(*seconds, cut.path.length, way, _perimeter(sheet, cut), cut.common, int(cut.pierce))


def _perimeter(sheet: Sheet, cut: Cut, part: int | None = None) -> float:
    """Return the drawn length of the contours in a cut, mm. If `part` is given, only the contours of that part count.

    Chambers of notches do not count, because their edges belong to an outline.
    """
    contours = () if cut.common else (sheet.contours[i] for i in cut.contours)
    return sum(c.path.length for c in contours if not c.chamber and part in (None, c.part))


def _share_of_part(sheet: Sheet, cut: Cut, times: CutTimes, part: int) -> list[CutTimes]:
    """Return the times of a cut that a part accounts for.

    If several parts share a cut, its times are divided by the length of their contours. The pierce of a chain counts
    for the first part of the chain. The list is empty if the part has no contour in the cut.
    """
    if len(cut.contours) == 1:
        return [times] if cut.part == part else []
    lengths = {i: sheet.contours[i].path.length for i in cut.contours}
    own = sum(length for i, length in lengths.items() if sheet.contours[i].part == part)
    share = own / max(sum(lengths.values()), 1e-9)
    if not own:
        return []
    part_of = CutTimes(**{name: getattr(times, name) * share for name in _SUMS})
    pierces = times.pierces if cut.part == part else 0
    return [replace(part_of, perimeter_mm=_perimeter(sheet, cut, part), pierces=pierces)]


def _sum_times(times: Sequence[CutTimes]) -> CutTimes:
    sums = {name: math.fsum(getattr(t, name) for t in times) for name in _SUMS}
    return CutTimes(**sums, pierces=sum(t.pierces for t in times))


def part_areas(sheet: Sheet) -> dict[int, float]:
    """Return the area of each part without its holes, mm²."""
    areas: dict[int, float] = {}
    for c in sheet.contours:
        if c.kind == "cut" and c.path.closed and c.part and not c.chamber:
            sign = -1.0 if c.is_hole else 1.0
            areas[c.part] = areas.get(c.part, 0.0) + sign * abs(c.path.area)
    return areas


def cost_of(times: CutTimes, options: CutOptions, shop_rate: float) -> float:
    """Return the cost of consumables while the torch is on, of pierces, and of machine time."""
    burning = cost_of_time(options.cutting_rate, times.cut_s + times.pierce_s)
    return burning + cost_of_time(shop_rate, times.total_s) + options.pierce_cost * times.pierces


def consumption_of(times: CutTimes, data: CutData, sheet: CutTimes) -> Consumption:
    """Return the consumption during the given times. An amount stays unknown if the cut chart has no data for it.

    The machine uses gas, power and abrasive while the torch is on, for cutting and for piercing. If the chart does not
    state the power, it is computed as current times voltage of the arc. Nozzles and electrodes wear out either by
    cutting time or by the number of pierces. Whichever limit is reached first on the whole `sheet` is also used for
    each part, so that the parts add up to the sheet.
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
        nozzles=_worn_parts(times, sheet, rates.nozzle_life, rates.nozzle_pierces),
        electrodes=_worn_parts(times, sheet, rates.electrode_life, rates.electrode_pierces),
        at_arc=rates.power is None and arc is not None,
    )


def _worn_parts(times: CutTimes, sheet: CutTimes, life: float | None, pierces: float | None) -> float | None:
    def worn_by_time(of: CutTimes) -> float:
        return (of.cut_s + of.pierce_s) / life if life else 0.0

    def worn_by_pierces(of: CutTimes) -> float:
        return of.pierces / pierces if pierces else 0.0

    if life is None and pierces is None:
        return None
    return worn_by_time(times) if worn_by_time(sheet) >= worn_by_pierces(sheet) else worn_by_pierces(times)
