"""Within what the feeds of one run's pockets may follow what the tool meets."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from leafcut.errors import OptionError, PlanError
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.pocket import FILM, PocketRules
from leafcut.model.tool import Tool
from leafcut.model.work_material import WorkMaterial
from leafcut.options import FeedOptions, Settings, SpeedOptions
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.rules import MillingData, finishing_levels
from leafcut.stock.chip_feeds import allowed_feed, power_at
from leafcut.stock.engagement import Engaged
from leafcut.units import SECONDS_PER_MINUTE

#: A feed below this share of the tool's rubs more than it cuts.
SLOWEST = 0.25


class _Power(NamedTuple):
    """What the spindle gives to a cut, W, and by which limit, in words."""

    watts: float
    words: str


def feed_limits(
    settings: Settings,
    machine: Machine,
    rules: PocketRules,
    levels: tuple[float, ...],
    data: MillingData,
    mill: Tool | None,
) -> tuple[FeedLimits, list[Issue]]:
    """Return within what feeds may change, and what has to be said of it.

    Parameters
    ----------
    mill
        The tool of the library; None without one.

    Raises
    ------
    OptionError
        The feed or the speed of the tool is not stated, or a limit of the spindle is given that nothing can be
        compared with.
    PlanError
        The spindle has much less power than a first cut needs.
    """
    options = settings.of(PocketOptions)
    _check_stated(settings, data.tool, mill)
    tool = data.tool
    increase = 1.0 + settings.of(FeedOptions).feed_increase / 100.0
    most = max(min(increase * tool.feed, machine.max_feed, data.air_feed), tool.feed)
    depth = -levels[0]
    finish = finishing_levels(-levels[-1], tool.diameter)[0] if options.stock else levels[0]
    slot = settings.of(FeedOptions).slot_chip
    limits = FeedLimits(
        tool.diameter, tool.feed, tool.spindle_rpm, most, depth, -finish, FILM * tool.diameter,
        1.0 if slot is None else slot / 100.0,
    )  # fmt: skip
    power = _power(settings, machine, tool)
    if power is None:
        return limits, []
    material, why = _material(settings, tool)
    if material is None:
        speeds = settings.of(SpeedOptions)
        if speeds.max_power or speeds.max_torque:
            flag = "--max-power" if speeds.max_power else "--max-torque"
            raise OptionError(f"{flag}: what a cut needs is not known, as {why}")
        words = f"feeds are not compared with the power of the spindle, as {why}"
        return limits, [Issue("L705", words, severity=Severity.NOTE)]
    limits = replace(limits, power=power.watts, power_words=power.words, material=material, teeth=tool.teeth or 0)
    _check_slot(limits, tool)
    return limits, []


def _check_slot(limits: FeedLimits, tool: Tool) -> None:
    """Check that the spindle has the power for a cut of the whole width at a feed that still makes chips.

    Raises
    ------
    PlanError
        It has not.
    """
    slot = Engaged(np.array([math.pi]), np.array([tool.diameter]), np.ones(1))
    slowest = float(allowed_feed(slot, replace(limits, slot=1.0))[0])
    if slowest < SLOWEST * tool.feed:
        needed = float(power_at(slot, tool.feed, limits)[0])
        raise PlanError(
            f"--feeds: a first cut {limits.depth:.4g} mm deep needs {needed / 1000.0:.3g} kW at the feed of "
            f"{tool.label}, but there are {limits.power_words}; give a smaller --step-down"
        )


def _check_stated(settings: Settings, tool: Tool, mill: Tool | None) -> None:
    """Check that the chip of the tool is known: that nobody assumed its feed or its speed."""
    feed = settings.of(PocketOptions).milling_feed or (mill.feed if mill else 0.0)
    speed = settings.job.spindle_speed or (mill.spindle_rpm if mill else 0.0)
    missing = [(feed, "feed", "--milling-feed"), (speed, "spindle speed", "--spindle-speed")]
    lacking = [(name, flag) for value, name, flag in missing if not value]
    if lacking:
        names, flags = (" and ".join(one) for one in zip(*lacking, strict=True))
        verb = "is" if len(lacking) == 1 else "are"
        where = settings.job.tools or "a tool library with --tools"
        raise OptionError(
            f"--feeds: {names} of {tool.label} {verb} not stated, so that its chips are not known; give {flags}, or "
            f"state them in {where}"
        )


def _power(settings: Settings, machine: Machine, tool: Tool) -> _Power | None:
    """Return what the spindle gives to a cut at the tool's speed; None where that is not known."""
    options = settings.of(SpeedOptions)
    power, torque = options.max_power or machine.spindle_power, options.max_torque or machine.spindle_torque
    found = []
    if power:
        words = f"{power / 1000.0:.3g} kW of the spindle, {100.0 * options.drive_efficiency:g} % of them at the tool"
        found.append(_Power(power * options.drive_efficiency, words))
    if torque:
        watts = torque / 1000.0 * math.tau * tool.spindle_rpm / SECONDS_PER_MINUTE
        found.append(_Power(watts, f"{torque / 1000.0:.3g} N·m of the spindle"))
    return min(found) if found else None


def _material(settings: Settings, tool: Tool) -> tuple[WorkMaterial | None, str]:
    """Return what is cut, where the force that it needs is known; else None and why it is not."""
    from leafcut.read.work_materials import load_material

    if "material" not in settings.given:
        return None, "no material is given; name it with --material"
    name = settings.job.material
    if not tool.teeth:
        return None, f"the library does not say how many teeth {tool.label} has; add teeth to it"
    try:
        return load_material(name), ""
    except OptionError:
        if name.lower().endswith(".toml"):
            raise
        return None, f"nothing is known of '{name}'; name one of `leafcut materials`"
