"""Options of the machine, and of what several processes know of the job: its material, its heights, its clamps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option

#: The cycles that a tool library and ``--cycle`` may ask for.
CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85")


@dataclass(frozen=True)
class MachineOptions(OptionGroup):
    """Which machine, and where the part lies on it."""

    section: ClassVar[str] = "machine"
    title: ClassVar[str] = "Machine"

    machine: str = option(
        "text",
        "linuxcnc-mill",
        "name of a machine (see `leafcut machines`), or the path of a TOML profile",
        may_be_path=True,
    )
    work_offset: tuple[float, ...] | None = option(
        "point",
        None,
        "program zero in machine coordinates, x,y,z",
        unit="mm",
        default_words="the machine's own, else unknown",
    )


@dataclass(frozen=True)
class JobOptions(OptionGroup):
    """What is worked, and the heights, places and obstacles of the work: each process uses what it has a use for."""

    section: ClassVar[str] = "job"
    title: ClassVar[str] = "Job"

    tools: Path | None = option(
        "path",
        None,
        "tool library: TOML, or LinuxCNC's .tbl, Fusion's .json or .tools, FreeCAD's .fctl",
        default_words="a drill per diameter is assumed",
    )
    depth: float | None = option(
        "quantity",
        None,
        "depth of a blind hole below Z0",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="from --thickness, else 1 mm (spotting)",
    )
    thickness: float | None = option(
        "quantity",
        None,
        "thickness of the plate, through which holes go, or of the sheet that is cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="holes are not through",
    )
    break_through: float = option(
        "quantity",
        0.5,
        "how far below the plate a through hole goes",
        unit="mm",
        minimum=0,
        maximum=100,
        needs="thickness",
    )
    clearance_height: float = option(
        "quantity",
        10.0,
        "initial plane: safe height over the part and its clamps",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract_height: float = option(
        "quantity",
        2.0,
        "R plane: where rapid becomes feed",
        unit="mm",
        minimum=0.05,
        maximum=1000,
    )
    retract: str = option(
        "text",
        "r",
        "after a hole: up to the R plane (G99) or to the initial plane (G98)",
        choices=("r", "initial"),
    )
    keep_out: tuple[str, ...] = option(
        "names",
        (),
        "rectangles 'x0 y0 x1 y1' in mm, such as clamps: nothing is cut there, rapids cross them at --clearance-height "
        "or above, or go round, and the tool's radius is kept away; several with commas",
        default_words="none",
    )
    spindle_speed: float | None = option(
        "quantity",
        None,
        "spindle speed of assumed drills, or of a pocket's end mill",
        unit="rpm",
        minimum=1,
        default_words="20 m/min at the tool's edge; of an end mill as its library or --material has it",
    )
    diameter_tolerance: float = option(
        "quantity",
        0.05,
        "how far a tool may differ from the hole drawn",
        unit="mm",
        minimum=0,
        maximum=5,
        needs="tools",
    )
    material: str = option(
        "text",
        "mild_steel",
        "material, as the cut chart names it; of a pocket it says how fast an assumed mill turns",
    )
    start_point: tuple[float, ...] | None = option(
        "point",
        (0.0, 0.0),
        "where the tool starts, x,y, or free; of a program, where it stands before the first rapid",
        unit="mm",
    )
    end_point: tuple[float, ...] | None = option(
        "point",
        None,
        "where the tool ends, x,y, or free",
        unit="mm",
        default_words="at the last hole",
    )
    keep_order: bool = option("flag", False, "leave the order as it is; of a program, only measure it")
