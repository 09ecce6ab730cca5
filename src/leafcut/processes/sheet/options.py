"""Options for cutting sheets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option, when_given, when_one_of


@dataclass(frozen=True)
class CutOptions(OptionGroup):
    """Options for cutting a nested sheet by plasma, laser, oxyfuel or water jet.

    `JobOptions` contains the thickness of the sheet, the safe height, the clamps, and the start and end points.
    `CutDataOptions` contains the cutting data.
    """

    section: ClassVar[str] = "cut"
    title: ClassVar[str] = "Cutting"

    mark_speed: float | None = option(
        "quantity",
        None,
        "marking speed, with a laser or a scribe",
        unit="mm/s",
        minimum=0.01,
        default_words="2500 mm/min, or the machine's highest feed rate if lower",
        of_file=True,
    )
    pierce_delay: float | None = option(
        "quantity",
        None,
        "pierce delay after the torch turns on",
        unit="s",
        minimum=0,
        maximum=600,
        default_words="the chart's",
        of_file=True,
    )
    pierce_height: float | None = option(
        "quantity",
        None,
        "torch height for piercing",
        unit="mm",
        minimum=0.01,
        maximum=100,
        default_words="the chart's",
        of_file=True,
    )
    cut_height: float | None = option(
        "quantity",
        None,
        "torch height for cutting",
        unit="mm",
        minimum=0.01,
        maximum=100,
        default_words="the chart's",
        of_file=True,
    )
    compensation: str = option(
        "text",
        "geometry",
        "kerf compensation: in the path (geometry), by the controller (G41, G42), or none",
        choices=("geometry", "controller", "none"),
    )
    direction: str = option(
        "text",
        "auto",
        "cutting direction of outlines; holes run in the opposite direction",
        choices=("auto", "clockwise", "counter-clockwise", "free"),
        default_words="auto: clockwise for plasma and oxyfuel, else free",
    )
    lead_in: str = option(
        "text",
        "auto",
        "shape of the lead-in",
        choices=("auto", "line", "arc", "none"),
        default_words="auto: arc for plasma and oxyfuel, else line",
    )
    lead_out: str = option(
        "text",
        "auto",
        "shape of the lead-out",
        choices=("auto", "line", "arc", "none"),
        default_words="auto: as the lead-in for outlines by plasma or oxyfuel, else none",
    )
    lead_in_length: float | None = option(
        "quantity",
        None,
        "length of the lead-in",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="plasma 6, oxyfuel 15, or the thickness if larger; laser and water 3 kerfs, at least 2",
        needs=(when_one_of("lead_in", "auto", "line", "arc"),),
    )
    overcut: float | None = option(
        "quantity",
        None,
        "overcut past the start of a closed contour, with the torch off if the controller can turn it off in motion",
        unit="mm",
        minimum=0,
        maximum=100,
        default_words="4 mm for plasma holes, else 0",
    )
    small_hole: float | None = option(
        "quantity",
        None,
        "holes below this diameter are cut more slowly, from near the centre, without a lead-out",
        unit="mm",
        minimum=0,
        maximum=1000,
        default_words="32 mm for plasma, else 0",
    )
    corner_loops: bool = option("flag", False, "loop through the scrap at sharp outer corners, if there is room")
    micro_joints: int = option("whole", 0, "number of micro-joints that hold each part", minimum=0, maximum=100)
    joint_width: float = option(
        "quantity",
        0.5,
        "width of a micro-joint",
        unit="mm",
        minimum=0.01,
        maximum=50,
        needs=(when_given("micro_joints"),),
    )
    chains: bool = option(
        "flag",
        False,
        "cut neighbouring outlines as a chain, with one pierce and bridges through the scrap, if that is faster",
    )
    common_lines: bool = option(
        "flag",
        False,
        "common-line cutting: make a single cut between edges that are one kerf apart",
    )
    heat_distance: float = option(
        "quantity", 0.0, "minimum distance between the start points of consecutive cuts", unit="mm", minimum=0
    )
    sweep: str = option(
        "text",
        "free",
        "cut parts band by band in this direction, to keep the rest of the sheet flat",
        choices=("free", "x", "y", "-x", "-y"),
    )
    sheet_size: str | None = option(
        "text",
        None,
        "sheet size, such as 3000x1500, with its lower left corner at 0,0",
        default_words="the outline in the drawing, else unknown",
        of_file=True,
    )
    save_plan: Path | None = option(
        "path", None, "plan file to write", default_words="none", changes_program=False, of_file=True
    )
    cutting_rate: float = option("number", 0.0, "cost of gas, power and consumables per hour of cutting", minimum=0)
    pierce_cost: float = option("number", 0.0, "cost of consumables per pierce", minimum=0)
