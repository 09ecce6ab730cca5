"""Work that does not write a program. Examples are simulating a program and choosing speeds."""

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
from leafcut.options.option_spec import Conditions, when_absent, when_given, when_input_is, when_input_is_not
from leafcut.processes.base import HELP_OF_CUTTING_DATA, HELP_OF_PROGRAM, LOOKED_UP, ORDERED, PLACE, Work, use

_OF_STOCK = (when_given("workpiece"),)


class Solving(Work):
    """Search for a closed tour through the points of a map."""

    name = command = "solve"
    title = "solving a map"
    helps = {  # noqa: RUF012  # `Work` declares it as a class variable
        "bound": ("compute a lower bound and report the gap", ""),
        "concentric": ("which of several concentric circles to visit", ""),
    }
    uses = {name: need for name, need in ORDERED.items() if name != "objective"} | use(
        ReadOptions, but=(*PLACE, "up", "z_zero", "side")
    )
    form = (
        ("search", ("algorithm", "preset", "time_limit", "iterations", "seed")),
        ("solve", ("bound", "threads", "candidates", "local_search")),
        ("read", ("units", "layers", "strict")),
    )


class Simulating(Work):
    """Compute the machine time and the cost of a program."""

    name = command = "simulate"
    title = "simulating a program"
    helps = HELP_OF_CUTTING_DATA
    uses = use(ReadOptions, "units", "strict") | use(MachineOptions) | use(JobOptions, "clearance_height") | LOOKED_UP
    form = (("main", ("machine", "dialect", "work_offset", "clearance_height", "units", "cut_speed", "strict")),)


class Verifying(Work):
    """Compare the work that two programs do."""

    name = command = "verify"
    title = "comparing programs"
    helps = HELP_OF_CUTTING_DATA | {
        "tool_diameter": ("diameter of the flat mills that the programs do not describe", "unknown"),
    }
    uses = use(ReadOptions, "units") | use(MachineOptions) | use(JobOptions, "tool_diameter") | LOOKED_UP
    form = (("main", ("machine", "dialect", "allow_reverse", "tool_diameter", "work_offset", "units", "cut_speed")),)


class CuttingStock(Work):
    """Simulate how a program removes stock."""

    name = command = "stock"
    title = "cutting stock by a program"
    helps = HELP_OF_PROGRAM | {"workpiece": ("", "derived from the program: a block around the cuts below Z0")}
    uses = (
        use(ReadOptions, "units", "strict", solid=(when_given("workpiece", "part"),), up=_OF_STOCK, z_zero=_OF_STOCK)
        | use(MachineOptions)
        | use(JobOptions, "tools", "tool_diameter")
    )
    uses |= use(StockOptions)


_SPEED_HELPS = {
    "material": ("material of the part: a name in `leafcut list materials`, or a TOML file", "required"),
    "tools": ("", "one drill per diameter of the drawing, or --tool-diameter"),
    "tool_diameter": ("diameter of the drill, without a drawing and --tools", "none"),
    "step_over": ("width of an end mill's cut, as a share of the tool diameter", "a full slot"),
    "step_down": ("depth of an end mill's cut", ""),
    "shop_rate": ("", "60"),
}


class ChoosingSpeeds(Work):
    """Choose spindle speeds and feeds for the tools of a part. A drawing is planned as for `drilling`."""

    name = command = "cutting-data"
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
        tool_diameter=(when_absent("tools"), when_input_is_not("drawing")),
        step_over=(when_given("tools"), when_input_is_not("drawing")),
        step_down=(when_given("tools"), when_input_is_not("drawing")),
    )

    def __init__(self) -> None:
        from leafcut.processes.registry import process

        drilling = process("drill")
        unused = {name for group in (PostOptions, SolveOptions, AcoOptions, FireflyOptions) for name in group.specs()}
        unused -= {"preset", "time_limit", "seed", "threads"}
        self.drilling = {name: need for name, need in drilling.used().items() if name not in unused}
        self.helps = {**drilling.helps, **_SPEED_HELPS}  # type: ignore[misc]  # set per object
        self.options = drilling.options  # type: ignore[misc]  # set per object

    def used(self) -> Mapping[str, Conditions]:
        """Return the options of this work. If there is a drawing, the drilling options apply as well."""
        # The reader refuses solid options for a drawing.
        drawn, solid = when_input_is("drawing"), when_input_is("step")
        needs = {
            name: tuple(condition for condition in needs if condition != solid) for name, needs in self.drilling.items()
        }
        return {name: (drawn, *own) for name, own in needs.items()} | dict(self.uses)
