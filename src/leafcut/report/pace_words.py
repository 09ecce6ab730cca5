"""What is said of new speeds and heights: what they save, and how the feeds of every tool have changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut.model.fact import Fact
from leafcut.report.wording import clean, count, time_words
from leafcut.units import SECONDS_PER_MINUTE

if TYPE_CHECKING:
    from leafcut.model.pace_change import FeedLimit, PaceChange, ToolPace

#: How each limit of feeds is called, its unit for people, and how many of these one of ours is.
_LIMITS = {
    "power": ("power", "kW", 0.001),
    "torque": ("torque", "N·m", 0.001),
    "plunge": ("downwards", "mm/min", SECONDS_PER_MINUTE),
}


def pace_facts(pace: PaceChange) -> list[Fact]:
    """Return what new heights and speeds saved, and how the feeds of every tool have changed."""
    facts = []
    if pace.retracts_s is not None:
        words = f"{_saved(pace.retracts_s)}, {count(pace.lowered, 'height')} lower" if pace.lowered else "as they were"
        facts.append(Fact("retracts", words))
    if pace.air_s is not None:
        near = f", {pace.clearance_mm:.2g} mm or more from all material" if pace.clearance_mm is not None else ""
        words = f"{_saved(pace.air_s)}, {count(pace.rapids, 'cut')} in the air now a rapid{near}"
        facts.append(Fact("air", words if pace.rapids else "no cut in the air that could be a rapid"))
    if pace.feeds_s is not None:
        facts.append(Fact("feeds", _saved(pace.feeds_s) if pace.tools else "as they were"))
        facts += [Fact("", _tool_words(tool)) for tool in pace.tools]
    return facts


def _saved(seconds: float) -> str:
    if seconds < 0:
        return f"{time_words(-seconds)} more, for chips that the tools bear"
    return f"{time_words(seconds)} saved" if seconds > 0 else "nothing saved"


def _tool_words(tool: ToolPace) -> str:
    """Return how the feeds of a tool have changed, and its thickest chip."""
    before, after = (_feed_words(*one) for one in (tool.feed_before, tool.feed_after))
    whose = "by its own feed and speed" if tool.limit_stated else "the program's own thickest"
    return (
        f"{clean(tool.label)}: {before} → {after} mm/min; thickest chip {tool.chip_before:.3g} → "
        f"{tool.chip_after:.3g} mm a revolution, at most {tool.chip_limit:.3g} ({whose})"
        + "".join(f"; {_limit_words(limit)}" for limit in tool.limits)
    )


def _limit_words(limit: FeedLimit) -> str:
    """Return what a limit was asked for before and after: "power 1.2 → 0.9 kW, at most 0.9"."""
    words, unit, scale = _LIMITS[limit.name]
    before, after, most = (f"{scale * value:.3g}" for value in limit[1:])
    return f"{words} {before} → {after} {unit}, at most {most}"


def _feed_words(low: float, high: float) -> str:
    one, other = (f"{SECONDS_PER_MINUTE * value:.4g}" for value in (low, high))
    return one if one == other else f"{one} to {other}"
