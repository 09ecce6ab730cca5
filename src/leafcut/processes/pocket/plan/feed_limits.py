"""Limits for feeds that depend on the load on the end mill."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from leafcut.errors import OptionError, PlanError
from leafcut.material.chip_feeds import allowed_feed, cutting_power
from leafcut.material.cutting_force import DRIVE_EFFICIENCY
from leafcut.message import Message
from leafcut.model.feed_limits import FEED_INCREASE, FeedLimits
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.pocket import FILM, PocketLevels
from leafcut.model.tool import Tool
from leafcut.model.work_material import WorkMaterial
from leafcut.options import Settings
from leafcut.processes.milling.mill import MillingData
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.rules import finishing_levels
from leafcut.units import SECONDS_PER_MINUTE

#: Minimum feed, relative to the feed of the tool. At lower feeds, the tool rubs instead of cutting.
SLOWEST = 0.25


def feed_limits(
    settings: Settings,
    machine: Machine,
    levels: Sequence[PocketLevels],
    data: MillingData,
    mill: Tool | None,
    material: WorkMaterial | None,
) -> tuple[FeedLimits, list[Issue]]:
    """Return the feed limits of the end mill, and a note if some limits are unknown.

    Raises
    ------
    OptionError
        The feed or the speed of the tool is not given.
    PlanError
        The spindle has far too little power for the first cut.
    """
    options = settings.of(PocketOptions)
    _check_feed_and_speed_given(settings, data.tool, mill)
    tool = data.tool
    highest = max(min(FEED_INCREASE * tool.feed, machine.max_feed, data.air_feed), tool.feed)
    # One tool cuts all pockets, so the largest step between levels counts.
    depth = max(one.step for one in levels)
    finish = max(one.begin - finishing_levels(one, tool.diameter)[0] for one in levels) if options.stock else depth
    limits = FeedLimits(tool.diameter, tool.feed, tool.spindle_rpm, highest, depth, finish, FILM * tool.diameter)
    power = _spindle_power(machine, tool)
    if power is None:
        return limits, []
    if material is None or not tool.teeth:
        return limits, [_unlimited_feed_note(settings, tool, material)]
    limits = replace(limits, power=power, material=material, teeth=tool.teeth)
    _check_power_in_slot(limits, tool)
    return limits, []


def _unlimited_feed_note(settings: Settings, tool: Tool, material: WorkMaterial | None) -> Issue:
    if "material" not in settings.given:
        return Issue(
            "L705",
            Message(
                "the power and torque of the spindle do not limit the feeds, because the material is unknown; give "
                "--material"
            ),
            severity=Severity.NOTE,
        )
    if material is None:
        name = settings.job.material
        words = Message(
            "the power and torque of the spindle do not limit the feeds, because the cutting force of '{}' is unknown",
            name,
        )
        return Issue("L705", Message("{}; name a material of `leafcut list materials`", words), severity=Severity.NOTE)
    words = Message(
        "the power and torque of the spindle do not limit the feeds of {}, because the number of teeth is unknown; "
        "give it with --tools",
        tool.label,
    )
    return Issue("L705", words, severity=Severity.NOTE)


def _check_power_in_slot(limits: FeedLimits, tool: Tool) -> None:
    """Raise an error if the spindle is too weak for a full slot even at the minimum feed."""
    from leafcut.material.engagement import slot_engagement  # loads kernels, which are not needed if a file is refused

    slowest = float(allowed_feed(slot_engagement(tool.diameter), limits)[0])
    if slowest < SLOWEST * tool.feed:
        needed = float(cutting_power(slot_engagement(tool.diameter), tool.feed, limits)[0])
        raise PlanError(
            "--feeds: a first cut {:.4g} mm deep needs {:.3g} kW at the feed of "
            "{}, but the spindle provides only {:.3g} kW; give a smaller --step-down",
            limits.depth,
            needed / 1000.0,
            tool.label,
            limits.power / 1000.0,
        )


def _check_feed_and_speed_given(settings: Settings, tool: Tool, mill: Tool | None) -> None:
    """Raise an error if the feed or speed of the tool is only assumed, because the chip load is then unknown."""
    feed = settings.job.feed or (mill.feed if mill else 0.0)
    speed = settings.job.spindle_speed or (mill.spindle_rpm if mill else 0.0)
    if not feed and not speed:
        raise OptionError(
            "--feeds: the feed and spindle speed of {} are not stated, so its chip load is unknown; give "
            "--feed and --spindle-speed, or a library that states both with --tools",
            tool.label,
        )
    if not feed:
        raise OptionError(
            "--feeds: the feed of {} is not stated, so its chip load is unknown; give --feed, "
            "or a library that states it with --tools",
            tool.label,
        )
    if not speed:
        raise OptionError(
            "--feeds: the spindle speed of {} is not stated, so its chip load is unknown; give "
            "--spindle-speed, or a library that states it with --tools",
            tool.label,
        )


def _spindle_power(machine: Machine, tool: Tool) -> float | None:
    """Return the power of the spindle at the speed of the tool, W, or None if it is unknown."""
    power, torque = machine.spindle_power, machine.spindle_torque
    limits = [power * DRIVE_EFFICIENCY] if power else []
    if torque:
        limits.append(torque / 1000.0 * math.tau * tool.spindle_rpm / SECONDS_PER_MINUTE)
    return min(limits) if limits else None
