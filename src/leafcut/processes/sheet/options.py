"""Options of cutting sheets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option


@dataclass(frozen=True)
class CutOptions(OptionGroup):
    """How a nested sheet is cut by plasma, laser, flame or water.

    The sheet's thickness, the safe height, clamps and the first and last place are those of `JobOptions`; the figures
    of the cut are those of `CutDataOptions`.
    """

    section: ClassVar[str] = "cut"
    title: ClassVar[str] = "Cutting"

    mark_speed: float | None = option(
        "quantity",
        None,
        "speed of marks, with a laser or a scribe",
        unit="mm/s",
        minimum=0.01,
        default_words="2500 mm/min, or the machine's highest feed",
    )
    kerf_width: float | None = option(
        "quantity", None, "width of the cut", unit="mm", minimum=0.001, maximum=50, default_words="the chart's"
    )
    pierce_delay: float | None = option(
        "quantity",
        None,
        "wait after the torch goes on",
        unit="s",
        minimum=0,
        maximum=600,
        default_words="the chart's",
    )
    pierce_height: float | None = option(
        "quantity",
        None,
        "height of the torch when it goes on",
        unit="mm",
        minimum=0.01,
        maximum=100,
        default_words="the chart's",
    )
    cut_height: float | None = option(
        "quantity",
        None,
        "height of the torch while it cuts",
        unit="mm",
        minimum=0.01,
        maximum=100,
        default_words="the chart's",
    )
    probe: str = option(
        "text",
        "auto",
        "find the sheet with the torch before every pierce (G38.2), where the program moves Z",
        choices=("auto", "on", "off"),
        default_words="auto: where the machine's profile has a probe",
    )
    switch_offset: float | None = option(
        "quantity",
        None,
        "how far Z goes on after the torch has touched the sheet, until the switch of the probe trips",
        unit="mm",
        minimum=0,
        maximum=50,
        default_words="the machine's",
    )
    compensation: str = option(
        "text",
        "geometry",
        "who keeps half a kerf away from the part: the program's path, the controller (G41, G42), or nobody",
        choices=("geometry", "controller", "none"),
    )
    direction: str = option(
        "text",
        "auto",
        "which way round outlines are cut; holes the other way",
        choices=("auto", "clockwise", "counter-clockwise", "free"),
        default_words="auto: clockwise for plasma and oxyfuel, else free",
    )
    lead_in: str = option(
        "text",
        "auto",
        "how a cut comes to its contour",
        choices=("auto", "line", "arc", "none"),
        default_words="auto: arc for plasma and oxyfuel, else line",
    )
    lead_out: str = option(
        "text",
        "auto",
        "how a cut leaves its contour",
        choices=("auto", "line", "arc", "none"),
        default_words="auto: as the lead-in on outlines cut by plasma or oxyfuel, else none",
    )
    lead_in_length: float | None = option(
        "quantity",
        None,
        "length of the lead-in",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="plasma 6, oxyfuel 15, or the thickness; laser and water 3 kerfs, at least 2",
        needs="lead_in=auto|line|arc",
    )
    lead_out_length: float | None = option(
        "quantity",
        None,
        "length of the lead-out",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="as the lead-in, 6 at least",
        needs="lead_out=auto|line|arc",
    )
    lead_angle: float = option(
        "quantity",
        1.5707963267948966,
        "angle of a line to the contour, or that an arc turns by",
        unit="rad",
        minimum=0.17,
        maximum=2.97,
    )
    overcut: float | None = option(
        "quantity",
        None,
        "how far a closed cut goes on past its beginning; with the torch off where the controller can",
        unit="mm",
        minimum=0,
        maximum=100,
        default_words="4 mm on holes cut by plasma, else 0",
    )
    small_hole: float | None = option(
        "quantity",
        None,
        "holes below this diameter are cut slower, from near the centre and without a lead-out",
        unit="mm",
        minimum=0,
        maximum=1000,
        default_words="32 mm for plasma, else 0",
    )
    small_hole_speed: float = option(
        "percent", 60.0, "speed in small holes, in percent of the cutting speed", minimum=1, maximum=100
    )
    corner_loops: bool = option(
        "flag", False, "go round sharp outer corners in a loop through the scrap, where there is room"
    )
    loop_angle: float = option(
        "quantity",
        1.7453292519943295,
        "corners sharper than this have a loop",
        unit="rad",
        minimum=0.17,
        maximum=2.8,
        needs="corner_loops",
    )
    loop_length: float | None = option(
        "quantity",
        None,
        "how far a loop goes on past its corner",
        unit="mm",
        minimum=0.1,
        maximum=100,
        default_words="half the lead-in",
        needs="corner_loops",
    )
    micro_joints: int = option(
        "whole", 0, "places where an outline stays uncut, so that the part hangs on", minimum=0, maximum=100
    )
    joint_holes: bool = option(
        "flag",
        False,
        "holes have micro-joints like outlines, so that what falls out of them hangs on; not small holes",
        needs="micro_joints",
    )
    joint_width: float = option(
        "quantity", 0.5, "width of a micro-joint", unit="mm", minimum=0.01, maximum=50, needs="micro_joints"
    )
    chains: bool = option(
        "flag",
        False,
        "cut neighbouring outlines with one pierce: with the torch on from one to the next, through the scrap, where "
        "that is quicker than a new pierce",
    )
    chain_contours: int = option("whole", 12, "contours in one chain at most", minimum=2, maximum=1000, needs="chains")
    chain_bridge: float | None = option(
        "quantity",
        None,
        "longest way through the scrap from one outline of a chain to the next",
        unit="mm",
        minimum=0.1,
        maximum=1000,
        default_words="as long as it is quicker than a pierce",
        needs="chains",
    )
    common_lines: bool = option(
        "flag",
        False,
        "cut the edges of parts that lie one kerf apart once for both parts, before what is around them",
    )
    pierce_pitch: float | None = option(
        "quantity",
        None,
        "distance between the places of a contour that are tried as its start",
        unit="mm",
        minimum=0.1,
        default_words="a sixteenth of the contour, between 10 and 100 mm",
    )
    start_at: str = option(
        "text", "any", "where on a contour a cut may start: anywhere, or at its corners", choices=("any", "corners")
    )
    edge_start: str = option(
        "text",
        "auto",
        "start outlines beyond the sheet's edge, in the air",
        choices=("auto", "always", "never"),
        default_words="auto: above the pierce capacity",
    )
    splash: float | None = option(
        "quantity",
        None,
        "radius around a pierce that is kept clear of parts where there is room",
        unit="mm",
        minimum=0,
        maximum=100,
        default_words="one kerf",
    )
    heat_distance: float = option(
        "quantity", 0.0, "least distance between one start and the next", unit="mm", minimum=0
    )
    heat_time: float = option(
        "quantity",
        0.0,
        "starts nearer than --heat-distance are this far apart in time at least",
        unit="s",
        minimum=0,
        default_words="0: only the next start is kept away",
        needs="heat_distance",
    )
    sweep: str = option(
        "text",
        "free",
        "cut the parts in bands along an axis, so that the rest of the sheet stays flat",
        choices=("free", "x", "y"),
    )
    sweep_width: float | None = option(
        "quantity",
        None,
        "width of a band",
        unit="mm",
        minimum=1,
        default_words="a fifth of the sheet, or its largest part",
        needs="sweep=x|y",
    )
    start_corner: str = option(
        "text",
        "free",
        "corner of the sheet at which cutting begins",
        choices=("free", "lower-left", "lower-right", "upper-left", "upper-right"),
    )
    sheet_size: str | None = option(
        "text",
        None,
        "size of the sheet from its lower left corner at 0,0, such as 3000x1500",
        default_words="the outline in the drawing, else not known",
    )
    sheet_margin: float = option(
        "quantity", 0.0, "leads keep this far from the sheet's edge", unit="mm", minimum=0, maximum=1000
    )
    plan: Path | None = option("path", None, "plan file whose fixed choices are kept", default_words="none")
    save_plan: Path | None = option("path", None, "plan file to write", default_words="none", changes_program=False)
    quantity: int = option("whole", 1, "sheets in the batch", minimum=1, maximum=1_000_000)
    gas_rate: float = option("number", 0.0, "cost of gas or abrasive for an hour of cutting", minimum=0)
    power_rate: float = option("number", 0.0, "cost of power for an hour of cutting", minimum=0)
    consumables_rate: float = option("number", 0.0, "cost of consumables for an hour of cutting", minimum=0)
    pierce_cost: float = option("number", 0.0, "what a pierce costs besides, in consumables", minimum=0)
    machine_rate: float = option("number", 0.0, "cost of the machine and its operator for an hour", minimum=0)
