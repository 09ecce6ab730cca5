"""What leafcut does besides making programs: solving maps, simulating programs, cutting stock, and comparing."""

from __future__ import annotations

from collections.abc import Mapping

from leafcut.options import (
    AcoOptions,
    FireflyOptions,
    JobOptions,
    MachineOptions,
    PostOptions,
    ReadOptions,
    SolveOptions,
    SpeedOptions,
    StockOptions,
)
from leafcut.processes.base import LOOKED_UP, ORDERED, PLACE, Work, use


class Solving(Work):
    """A closed tour through the points of a map."""

    name = "solve"
    title = "solving a map"
    uses = {name: need for name, need in ORDERED.items() if name != "objective"} | use(
        ReadOptions, but=(*PLACE, "up", "z_zero")
    )


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
    uses = (
        use(ReadOptions, "units", "strict", solid="workpiece,part", up="workpiece", z_zero="workpiece")
        | use(MachineOptions)
        | use(JobOptions, "tools", "tool_diameter")
    )
    uses |= use(StockOptions)


class ChoosingSpeeds(Work):
    """Spindle speeds and feeds of the tools of a part, by time, cost and tool life.

    Parameters
    ----------
    drilling
        The options of drilling: for a drawing its program is planned, with the usual search, though not written.
    """

    name = "cutting-data"
    title = "choosing speeds and feeds"
    uses = use(MachineOptions) | use(SpeedOptions)
    uses |= use(
        JobOptions,
        "tools",
        "depth",
        "thickness",
        "break_through",
        "retract_height",
        "material",
        tool_diameter="!tools !input=drawing",
    )

    def __init__(self, drilling: Mapping[str, str]) -> None:
        unused = {name for group in (PostOptions, SolveOptions, AcoOptions, FireflyOptions) for name in group.specs()}
        unused -= {"preset", "time_limit", "seed", "threads"}
        self.drilling = {name: need for name, need in drilling.items() if name not in unused}

    def used(self) -> Mapping[str, str]:
        """Return its own options, and those of drilling for a drawing."""
        # That a drawing has no solid to turn, its reader says.
        needs = {name: need.replace("input=step", "") for name, need in self.drilling.items()}
        return {name: f"input=drawing {need}".strip() for name, need in needs.items()} | dict(self.uses)
