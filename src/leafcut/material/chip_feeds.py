"""Compute the feed of a mill from its engagement.

The feed is limited by power and by chip thickness. No chip may be thicker than in a slot at the nominal feed of the
tool.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.material.cutting_force import feed_ratio_for_power, mean_chip_thickness, milling_power, ramp_power
from leafcut.model.feed_limits import FeedLimits
from leafcut.units import SECONDS_PER_MINUTE

if TYPE_CHECKING:
    from leafcut.material.engagement import Engaged


def chip_thickness(engaged: Engaged, feed: Floats | float, rpm: Floats | float) -> Floats:
    """Return the maximum chip thickness per revolution at each point, mm. Feeds are in mm/s and speeds in rpm.

    The formula treats the tool as if it had a single tooth: h = f sin φ / n, where φ is the angle of the maximum
    thickness (Altintas, Manufacturing Automation, 2nd ed., section 2.6).
    """
    return np.asarray(SECONDS_PER_MINUTE * engaged.chip * np.asarray(feed) / np.asarray(rpm))


def removal_rate(engaged: Engaged, feed: Floats | float, limits: FeedLimits) -> Floats:
    """Return the material removal rate at each point, mm³/s. Feeds are in mm/s."""
    depth = np.where(engaged.width <= limits.film, max(limits.depth, limits.film_depth), limits.depth)
    return np.asarray(engaged.width * depth * np.asarray(feed))


def cutting_power(engaged: Engaged, feed: Floats | float, limits: FeedLimits) -> Floats:
    """Return the cutting power at each point, W, or 0 without a cut or a power limit. Feeds are in mm/s.

    If a tooth is engaged over the angle φ in a cut of width b, the mean chip thickness is f_z b / (r φ). This is the
    mean of f_z sin θ over the angle φ.
    """
    feeds = np.broadcast_to(np.asarray(feed, dtype=float), engaged.width.shape)
    power = np.zeros(len(engaged.width))
    cuts = engaged.width > 0.0
    if limits.material is None or not cuts.any():
        return power
    # b / (r φ) from the width and angle at each point; the tool radius cancels, because b = r ∫ sin φ.
    mean = np.minimum(engaged.width[cuts] / (engaged.angle[cuts] * 0.5 * limits.diameter), 1.0)
    chip = mean * SECONDS_PER_MINUTE * feeds[cuts] / (limits.rpm * limits.teeth)
    power[cuts] = milling_power(limits.material, removal_rate(engaged, feeds, limits)[cuts], chip)
    return power


def allowed_feed(engaged: Engaged, limits: FeedLimits) -> Floats:
    """Return the maximum feed at each point, mm/s, that respects the limits for chip thickness, power and feed."""
    chip_limit = np.full(len(engaged.width), limits.feed)
    feed = np.minimum(chip_limit / np.maximum(engaged.chip, 1e-9), limits.most)
    if limits.material is not None:
        power = cutting_power(engaged, feed, limits)
        overloaded = power > limits.power
        feed[overloaded] *= feed_ratio_for_power(limits.material, limits.power / power[overloaded])
    return np.asarray(feed)


def power_on_ramp(limits: FeedLimits, across: float, sink_rate: float, depth: float) -> float:
    """Return the maximum power on a ramp or a helix, W, or 0 without a power limit.

    The calculation is conservative. It assumes that the side of the tool cuts a slot as deep as the level everywhere.
    In fact, only the end of a ramp reaches this depth, and a helix is only as deep as its pitch. The end of the tool
    cuts with its full area.

    Parameters
    ----------
    across, sink_rate
        Horizontal and downward feed, mm/s.
    depth
        Depth of the end of the ramp below the uncut surface, mm.
    """
    if limits.material is None or not across > 0.0 or not sink_rate > 0.0:
        return 0.0
    teeth_by_time = limits.rpm * limits.teeth / SECONDS_PER_MINUTE
    side = limits.diameter * max(depth, limits.depth) * across
    end = 0.25 * math.pi * limits.diameter**2 * sink_rate
    chip = mean_chip_thickness(across / teeth_by_time, limits.diameter, limits.diameter)
    return float(ramp_power(limits.material, side, end, chip, sink_rate / teeth_by_time))


def power_on_plunge(limits: FeedLimits, sink_rate: float) -> float:
    """Return the power, W, of a straight plunge at `sink_rate` mm/s. Return 0 if there is no power limit.

    A plunge is treated like the end of a ramp (`material.cutting_force.ramp_power`).
    """
    if limits.material is None or not sink_rate > 0.0:
        return 0.0
    teeth_by_time = limits.rpm * limits.teeth / SECONDS_PER_MINUTE
    return float(
        milling_power(limits.material, 0.25 * math.pi * limits.diameter**2 * sink_rate, sink_rate / teeth_by_time)
    )


def plunge_feed(limits: FeedLimits, feed: float) -> float:
    """Return the plunge feed of a mill, mm/s. This is `feed`, or less if `feed` exceeds the power limit."""
    return _limit_feed_by_power(limits, feed, power_on_plunge(limits, feed))


def ramp_feed(limits: FeedLimits, feed: float, angle: float, depth: float) -> float:
    """Return the feed on a ramp or helix with a slope of up to `angle`, rad.

    The power limit may reduce the given `feed`. Feeds are in mm/s. The calculation treats the full feed as horizontal,
    as on a flat ramp.
    """
    power = power_on_ramp(limits, feed * math.cos(angle), feed * math.sin(angle), depth) / math.cos(angle)
    return _limit_feed_by_power(limits, feed, power)


def _limit_feed_by_power(limits: FeedLimits, feed: float, power: float) -> float:
    """Reduce `feed` if the `power` that it needs, W, exceeds the limit."""
    if limits.material is None or power <= limits.power:
        return feed
    return float(feed * feed_ratio_for_power(limits.material, limits.power / power))


def sliding_minimum_along_path(values: Floats, length: Floats, reach: float) -> Floats:
    """Return the minimum of the values within `reach` mm before and after each segment of a path.

    A feed that depends on these values is reduced both before and after the critical position. `length` contains the
    lengths of the segments, mm.
    """
    middles = np.cumsum(length) - 0.5 * length
    first, last = (
        np.searchsorted(middles, middles - reach, side="left"),
        np.searchsorted(middles, middles + reach, side="right"),
    )
    # Row k contains the minima of 2^k values; two overlapping minima cover any range.
    table = [values]
    while 2 << len(table) - 1 <= int((last - first).max(initial=1)):
        half, doubled = 1 << len(table) - 1, table[-1].copy()
        doubled[:-half] = np.minimum(doubled[:-half], table[-1][half:])
        table.append(doubled)
    powers = np.log2(np.maximum(last - first, 1)).astype(np.int64)
    result = np.empty_like(values)
    for k, minima in enumerate(table):
        same_power = powers == k
        result[same_power] = np.minimum(minima[first[same_power]], minima[last[same_power] - (1 << k)])
    return result
