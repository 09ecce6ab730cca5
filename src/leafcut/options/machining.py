"""Options of the machine, and of drilling."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option

CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85")


@dataclass(frozen=True)
class MachineOptions(OptionGroup):
    """Which machine, and where the part lies on it."""

    section: ClassVar[str] = "machine"
    works: ClassVar[str] = "drill cut pocket program simulate verify"

    machine: str = option(
        "text",
        "linuxcnc-mill",
        "name of a machine (see `leafcut machines`), or the path of a TOML profile",
        may_be_path=True,
        works="drill cut pocket program nest simulate verify",
    )
    work_offset: tuple[float, ...] | None = option(
        "point",
        None,
        "program zero in machine coordinates, x,y,z",
        unit="mm",
        default_words="the machine's own, else unknown",
    )


@dataclass(frozen=True)
class DrillOptions(OptionGroup):
    """How holes become drilling operations."""

    section: ClassVar[str] = "drill"
    works: ClassVar[str] = "drill"

    tools: Path | None = option(
        "path",
        None,
        "tool library: TOML, or LinuxCNC's .tbl, Fusion's .json or .tools, FreeCAD's .fctl",
        default_words="a drill per diameter is assumed",
        works="drill pocket program",
        needs="program:keep_out",
    )
    depth: float | None = option(
        "quantity",
        None,
        "depth of a blind hole below Z0",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="from --thickness, else 1 mm (spotting)",
        works="drill pocket",
    )
    thickness: float | None = option(
        "quantity",
        None,
        "thickness of the plate, through which holes go, or of the sheet that is cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="holes are not through",
        works="drill cut pocket program simulate verify",
        needs="program:!cut_speed simulate:!cut_speed verify:!cut_speed",
    )
    depth_to: str = option(
        "text",
        "shoulder",
        "what reaches the depth: the full diameter or the point of the drill",
        choices=("shoulder", "tip"),
    )
    break_through: float = option(
        "quantity",
        0.5,
        "how far below the plate a through hole goes",
        unit="mm",
        minimum=0,
        maximum=100,
        works="drill pocket",
        needs="thickness",
    )
    clearance_height: float = option(
        "quantity",
        10.0,
        "initial plane: safe height over the part and its clamps",
        unit="mm",
        minimum=0.1,
        maximum=1000,
        works="drill cut pocket program simulate",
        needs="program:keep_out",
    )
    retract_height: float = option(
        "quantity",
        2.0,
        "R plane: where rapid becomes feed",
        unit="mm",
        minimum=0.05,
        maximum=1000,
        works="drill pocket",
    )
    tool_change_height: float = option(
        "quantity",
        25.0,
        "height for changing tools, on a machine that has no safe height of its own",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract: str = option(
        "text",
        "r",
        "after a hole: up to the R plane (G99) or to the initial plane (G98)",
        choices=("r", "initial"),
        works="drill pocket",
    )
    keep_out: tuple[str, ...] = option(
        "names",
        (),
        "rectangles 'x0 y0 x1 y1' in mm, such as clamps: nothing is cut there, rapids cross them at --clearance-height "
        "or above, or go round, and the tool's radius is kept away; several with commas",
        default_words="none",
        works="drill cut pocket program",
    )
    cycle: str | None = option(
        "text",
        None,
        "cycle of every drill that the tool library says nothing of",
        choices=CYCLES,
        default_words="G83 with --peck, G82 with --dwell, else G81",
    )
    peck: float | None = option(
        "quantity",
        None,
        "depth of one peck (Q of G83 and G73)",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="no pecking",
    )
    dwell: float | None = option(
        "quantity", None, "wait at the bottom (P of G82)", unit="s", minimum=0, maximum=100, default_words="none"
    )
    feed: float | None = option(
        "quantity",
        None,
        "feed of drills whose data are assumed",
        unit="mm/s",
        minimum=0.001,
        default_words="0.02 diameters a revolution",
    )
    spindle_speed: float | None = option(
        "quantity",
        None,
        "spindle speed of assumed drills, or of a pocket's end mill",
        unit="rpm",
        minimum=1,
        default_words="20 m/min at the tool's edge; of an end mill as its library or --material has it",
        works="drill pocket",
    )
    diameter_tolerance: float = option(
        "quantity",
        0.05,
        "how far a tool may differ from the hole drawn",
        unit="mm",
        minimum=0,
        maximum=5,
        works="drill pocket",
        needs="tools",
    )
    centre_drill: bool = option("flag", False, "first centre every hole with the library's centre drill", needs="tools")
    start_point: tuple[float, ...] | None = option(
        "point",
        (0.0, 0.0),
        "where the tool starts, x,y, or free; of a program, where it stands before the first rapid",
        unit="mm",
        works="drill cut pocket program",
        needs="cut:start_corner=free",
    )
    end_point: tuple[float, ...] | None = option(
        "point",
        None,
        "where the tool ends, x,y, or free",
        unit="mm",
        default_words="at the last hole",
        works="drill cut pocket",
    )
    hole_order: Path | None = option(
        "path",
        None,
        "order file: holes that come first in the order of the file; the rest is found around them",
        default_words="none",
    )
