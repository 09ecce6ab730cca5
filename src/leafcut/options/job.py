"""Options of the machine, the job and the program that several processes share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option, when_given

#: Cycles allowed in a tool library and for ``--cycle``.
CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85")

#: Value of ``--depth`` for holes through the part, as deep as the part is thick at each hole.
THROUGH = "through"


@dataclass(frozen=True)
class MachineOptions(OptionGroup):
    """The machine, and the position of the part on it."""

    section: ClassVar[str] = "machine"
    title: ClassVar[str] = "Machine"

    machine: str = option(
        "text",
        "linuxcnc-mill",
        "machine name (see `leafcut list machines`), or path of a TOML profile",
        may_be_path=".toml",
    )
    work_offset: tuple[float, ...] | None = option(
        "point",
        None,
        "work offset: program zero in machine coordinates, x,y,z",
        unit="mm",
        default_words="the machine's, else unknown",
        example="-400,-200,-300",
        of_file=True,
    )


@dataclass(frozen=True)
class JobOptions(OptionGroup):
    """Material, heights, positions and obstacles of the job. Each process uses those that apply to it."""

    section: ClassVar[str] = "job"
    title: ClassVar[str] = "Job"

    tools: Path | None = option(
        "path",
        None,
        "tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, or a .csv table",
        default_words="one assumed drill per diameter",
    )
    depth: float | str | None = option(
        "quantity",
        None,
        "depth of blind holes or pockets below Z0; through: each hole goes through the part under --surface",
        words=(THROUGH,),
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="required, except for holes with --thickness",
        of_file=True,
    )
    thickness: float | None = option(
        "quantity",
        None,
        "thickness of the plate (holes go through), or of the sheet to cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="unknown; required for sheets, and for holes without --depth",
        of_file=True,
    )
    break_through: float = option(
        "quantity",
        0.5,
        "break-through: distance that through holes extend below the plate",
        unit="mm",
        minimum=0,
        maximum=100,
        needs=(when_given("thickness"),),
        of_file=True,
    )
    clearance_height: float = option(
        "quantity",
        10.0,
        "clearance height (initial plane), at which the tool clears the part and the clamps",
        unit="mm",
        minimum=0.1,
        maximum=1000,
        of_file=True,
    )
    retract_height: float = option(
        "quantity",
        2.0,
        "retract height (R plane): height at which a rapid changes to a feed move",
        unit="mm",
        minimum=0.05,
        maximum=1000,
        of_file=True,
    )
    retract: str = option(
        "text",
        "r",
        "retract after a hole to the R plane (G99) or the initial plane (G98)",
        choices=("r", "initial"),
        of_file=True,
    )
    keep_out: tuple[str, ...] = option(
        "names",
        (),
        "keep-out zones such as clamps, separated by commas: rectangles 'x0 y0 x1 y1' in mm, or 'x0 y0 x1 y1 h' with "
        "the height h above Z0. Cuts stay outside. Rapids cross a zone at least 1 mm above h (without h, at "
        "--clearance-height), or go around it. The margin is the radius of the tool, or of a shank or holder below h",
        default_words="none",
        of_file=True,
    )
    tool_diameter: float | None = option(
        "quantity",
        None,
        "diameter of the end mill for a pocket, of the drill for `leafcut tools speeds` without a library, or of the "
        "flat mills that a program does not describe",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="from the tool library",
    )
    feed: float | None = option(
        "quantity",
        None,
        "feed rate of the end mill, or of drills without a tool library",
        unit="mm/s",
        minimum=0.001,
        default_words="from the tool library, else assumed by diameter",
    )
    spindle_speed: float | None = option(
        "quantity",
        None,
        "spindle speed of the end mill, or of drills without a tool library",
        unit="rpm",
        minimum=1,
        default_words="drills: 20 m/min surface speed; end mills: from the tool library or --material",
    )
    step_over: float | None = option(
        "share",
        None,
        "maximum step-over in a pocket, or width of an end mill's cut, as a share of the tool diameter",
        minimum=0.02,
        maximum=0.95,
        default_words="0.6 in pockets, else a full slot",
    )
    step_down: float | None = option(
        "quantity",
        None,
        "step-down: depth per level of a pocket, or of an end mill's cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="half the tool diameter",
    )
    diameter_tolerance: float = option(
        "quantity",
        0.05,
        "largest difference between tool and hole diameter; without a tool library, drills have catalogue sizes within "
        "this tolerance",
        unit="mm",
        minimum=0,
        maximum=5,
        needs=(when_given("tools"),),
    )
    material: str = option(
        "text",
        "mild_steel",
        "material: for sheets, a name in the cut chart; for `leafcut tools speeds` and when a program's feeds "
        "are adapted, a name in `leafcut list materials` or a TOML file. For pockets, it sets the speed of an "
        "end mill that has no cutting data. It also selects the presets of a Fusion tool library",
        default_words="mild-steel",
        may_be_path=".toml",
        of_file=True,
    )
    start_point: tuple[float, ...] | None = option(
        "point",
        (0.0, 0.0),
        "start point of the tool, x,y, or free; for a program, its position before the first rapid",
        unit="mm",
    )
    end_point: tuple[float, ...] | None = option(
        "point",
        None,
        "end point of the tool, x,y, or free",
        unit="mm",
        default_words="at the last hole",
    )
    plan: Path | None = option(
        "path",
        None,
        "plan file with choices to keep: cuts of a sheet, or holes to drill first; the search completes the rest",
        default_words="none",
        of_file=True,
    )

    @property
    def is_through(self) -> bool:
        """Whether each hole goes through the part under the surface."""
        return self.depth == THROUGH

    @property
    def blind_depth(self) -> float | None:
        """Depth of blind holes or pockets, mm; None if it is not given, or holes go through."""
        return None if isinstance(self.depth, str) else self.depth


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """Format of the written program."""

    section: ClassVar[str] = "post"
    title: ClassVar[str] = "Program"

    dialect: str | None = option(
        "text",
        None,
        "dialect of the controller (see `leafcut list dialects`), or path of a TOML file",
        default_words="the machine's",
        may_be_path=".toml",
    )
    output_units: str = option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = option("flag", False, "number the blocks N10, N20, …")
    program_number: int = option(
        "whole", 1, "program number, such as 1 for O0001", minimum=1, maximum=9999, of_file=True
    )
    header: bool = option(
        "flag",
        True,
        "write header comments: source, options, tools, extents, time",
    )
    coolant: bool = option("flag", False, "turn coolant on while cutting")
    beam_power: int = option(
        "whole",
        1000,
        "laser power for cutting, S word (GRBL: value of $30)",
        minimum=1,
        maximum=1_000_000,
        of_file=True,
    )
    mark_power: int = option(
        "whole", 200, "laser power for marking, S word", minimum=1, maximum=1_000_000, of_file=True
    )
    material_number: int | None = option(
        "whole",
        None,
        "material number in the controller's table (QtPlasmaC M190); the controller then sets the feed",
        minimum=0,
        maximum=9_999_999,
        default_words="none: the program contains the cutting data",
        of_file=True,
    )
