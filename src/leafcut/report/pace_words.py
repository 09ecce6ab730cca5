"""Describe new speeds and heights: the savings, and the change in the feeds of each tool."""

from __future__ import annotations

from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.json_values import to_plain_json
from leafcut.model.pace_change import FeedLimit, PaceChange, ToolPace
from leafcut.report.wording import replace_unprintable
from leafcut.units import SECONDS_PER_MINUTE

#: Maps each feed limit to its displayed name, its unit, and a conversion factor.
_LIMITS = {
    "power": ("power", "kW", 0.001),
    "torque": ("torque", "N·m", 0.001),
    "plunge": ("downwards", "mm/min", SECONDS_PER_MINUTE),
}


def pace_facts(pace: PaceChange) -> list[Fact]:
    """Return facts about the savings from new heights and speeds, and about the change in the feeds of each tool."""
    facts = [Fact("pace", to_plain_json(pace))]
    if pace.retracts_s is not None:
        lower = Message("saved; heights unchanged")
        if pace.lowered:
            lower = Message("saved; heights lowered: {}", f"{pace.lowered:,}")
        facts.append(Fact("pace.retracts_s", pace.retracts_s, "s", lower, Message("Retracts")))
    if pace.air_s is not None:
        number, near = f"{pace.rapids:,}", pace.clearance_mm
        words = Message("saved; no air cut can become a rapid")
        if pace.rapids:
            words = Message("saved; air cuts converted to rapids: {}", number)
        if pace.rapids and near is not None:
            words = Message("saved; air cuts at least {:.2g} mm from any material, now rapids: {}", near, number)
        facts.append(Fact("pace.air_s", pace.air_s, "s", words, Message("Air")))
    if pace.feeds_s is not None:
        words = Message("saved" if pace.feeds_s >= 0.0 else "saved; the tools need slower feeds")
        facts.append(Fact("pace.feeds_s", pace.feeds_s, "s", words, Message("Feeds")))
        facts += [Fact(sentence=_tool_feed_line(tool), name="feeds") for tool in pace.tools]
    return facts


def _tool_feed_line(tool: ToolPace) -> str:
    before, after = (_feed_range(*feeds) for feeds in (tool.feed_before, tool.feed_after))
    origin = "from its feed and speed" if tool.limit_stated else "the thickest of the program"
    return (
        f"{replace_unprintable(tool.label)}: {before} → {after} mm/min; thickest chip {tool.chip_before:.3g} → "
        f"{tool.chip_after:.3g} mm a revolution, at most {tool.chip_limit:.3g} ({origin})"
        + "".join(f"; {_limit_line(limit)}" for limit in tool.limits)
    )


def _limit_line(limit: FeedLimit) -> str:
    """Format a feed limit with the loads: ``power 1.2 → 0.9 kW, at most 0.9``."""
    words, unit, scale = _LIMITS[limit.name]
    before, after, limit_text = (f"{scale * value:.3g}" for value in limit[1:])
    return f"{words} {before} → {after} {unit}, at most {limit_text}"


def _feed_range(low: float, high: float) -> str:
    low_text, high_text = (f"{SECONDS_PER_MINUTE * value:.4g}" for value in (low, high))
    return low_text if low_text == high_text else f"{low_text} to {high_text}"
