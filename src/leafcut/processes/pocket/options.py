"""Options of pockets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option


@dataclass(frozen=True)
class PocketOptions(OptionGroup):
    """How pockets are cleared.

    Depth, safe height, retract height, spindle speed, and the first and last place are those of `JobOptions`.
    """

    section: ClassVar[str] = "pocket"
    title: ClassVar[str] = "Pockets"

    strategy: str = option(
        "text",
        "best",
        "how the pocket is cleared; with best every strategy is tried, and the quickest one written",
        choices=("best", "zigzag", "contour", "connected", "firefly", "ants", "adaptive"),
    )
    tool_diameter: float | None = option(
        "quantity",
        None,
        "diameter of the flat end mill",
        unit="mm",
        minimum=0.01,
        maximum=200,
        default_words="needed without a tool library",
    )
    tool_number: int | None = option(
        "whole",
        None,
        "number of the end mill, in the tool library where one is given",
        minimum=1,
        maximum=99_999_999,
        default_words="1; of a library the end mill of the diameter, or its only one",
    )
    step_over: float = option(
        "share", 0.6, "largest distance between passes, as a share of the tool's diameter", minimum=0.02, maximum=0.95
    )
    point_distance: float | None = option(
        "share",
        None,
        "distance between the points of a grid, as a share of the tool's diameter: above 0.5, or points crowd; below "
        "0.7, or the corners between four points stay uncut; no more than the step-over",
        minimum=0.02,
        maximum=2,
        default_words="the step-over, at most 0.6",
    )
    step_down: float | None = option(
        "quantity",
        None,
        "depth of one level",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="half the tool's diameter",
    )
    stock: float = option(
        "quantity", 0.0, "what roughing leaves on the walls for the finishing pass", unit="mm", minimum=0, maximum=100
    )
    finishing_pass: bool = option("flag", True, "go along every wall after zigzag and grid strategies")
    milling: str = option("text", "climb", "which side of the tool cuts", choices=("climb", "conventional"))
    zigzag_angle: float | None = option(
        "quantity",
        None,
        "angle of the lines of a zigzag",
        unit="rad",
        minimum=-math.tau,
        maximum=math.tau,
        default_words="the best of twelve",
    )
    max_engagement: float | None = option(
        "quantity",
        None,
        "largest angle of the tool's edge in the material",
        unit="rad",
        minimum=0.17,
        maximum=3.1416,
        default_words="not limited",
    )
    entry: str = option(
        "text",
        "ramp",
        "how the tool comes down to a level",
        choices=("ramp", "helix", "plunge", "predrilled"),
        default_words="ramp: along the first piece of the path",
    )
    entry_angle: float = option(
        "quantity",
        0.05235987755982989,
        "steepest way down of a ramp or a helix",
        unit="rad",
        minimum=0.001,
        maximum=0.8,
        needs="entry=ramp|helix",
    )
    plunge_feed: float | None = option(
        "quantity",
        None,
        "feed straight down",
        unit="mm/s",
        minimum=0.001,
        default_words="that of the tool library, else a third of the feed",
    )
    milling_feed: float | None = option(
        "quantity",
        None,
        "feed of the end mill",
        unit="mm/s",
        minimum=0.001,
        default_words="that of the tool library, else two teeth, a hundredth of the diameter each, 0.05 mm at most",
    )
    air_feed: float | None = option(
        "quantity",
        None,
        "feed at depth where the tool cuts nothing, which is proved; no less than that of the mill",
        unit="mm/s",
        minimum=0.001,
        default_words="the largest feed of the machine",
    )
    uncovered_tolerance: float = option(
        "percent", 0.1, "uncut share of the reachable area above which there is a warning", minimum=0, maximum=100
    )
