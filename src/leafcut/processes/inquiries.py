"""What leafcut does besides making programs: solving maps, simulating programs, cutting stock, and comparing."""

from __future__ import annotations

from leafcut.options import JobOptions, MachineOptions, ReadOptions, SolveOptions, SpeedOptions, StockOptions
from leafcut.processes.base import COLONIES, LOOKED_UP, ORDERED, PLACE, Work, use


class Solving(Work):
    """A closed tour through the points of a map."""

    name = "solve"
    title = "solving a map"
    uses = {name: need for name, need in ORDERED.items() if name != "objective"} | use(ReadOptions, but=PLACE)
    uses |= use(SolveOptions, *COLONIES)


class Simulating(Work):
    """What a program costs on a machine."""

    name = "simulate"
    title = "simulating a program"
    uses = use(ReadOptions, "units", "strict") | use(MachineOptions) | use(JobOptions, "clearance_height") | LOOKED_UP


class Verifying(Work):
    """Whether two programs do the same work."""

    name = "verify"
    title = "comparing programs"
    uses = use(ReadOptions, "units") | use(MachineOptions) | LOOKED_UP


class CuttingStock(Work):
    """What a program takes off its stock, and what it leaves."""

    name = "stock"
    title = "cutting stock by a program"
    uses = use(ReadOptions, "units", "strict") | use(MachineOptions) | use(JobOptions, "tools") | use(StockOptions)


#: What has a use only where the holes come from a drawing.
_DRAWN = "input=drawing"


class ChoosingSpeeds(Work):
    """Spindle speeds and feeds of the tools of a part, by time, cost and tool life."""

    name = "cutting-data"
    title = "choosing speeds and feeds"
    uses = use(MachineOptions) | use(SpeedOptions)
    uses |= use(JobOptions, "tools", "depth", "thickness", "break_through", "retract_height", "material")
    uses |= use(JobOptions, clearance_height=_DRAWN, retract=_DRAWN, diameter_tolerance=f"{_DRAWN} tools")
    uses |= dict.fromkeys(ReadOptions.specs(), _DRAWN)
    uses |= use(SolveOptions, **dict.fromkeys(("preset", "time_limit", "seed", "threads"), _DRAWN))
