"""How fast a mill may go by what it engages: its chips no thicker than in a slot at its own feed, its power kept."""

from __future__ import annotations

import math

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.material.cutting_force import mean_chip, milling_power, ramp_power
from leafcut.material.engagement import Engaged
from leafcut.model.feed_limits import FeedLimits
from leafcut.units import SECONDS_PER_MINUTE


def chip_at(engaged: Engaged, feed: Floats | float, rpm: Floats | float) -> Floats:
    """Return the thickest chip in a revolution at every place, mm, at feeds, mm/s, and speeds, 1/min.

    Of one tooth, if it had but one: h = f sin φ / n, where φ is the angle at which it is thickest (Altintas,
    Manufacturing Automation, 2nd ed., section 2.6).
    """
    return np.asarray(SECONDS_PER_MINUTE * engaged.chip * np.asarray(feed) / np.asarray(rpm))


def removal_rate(engaged: Engaged, feed: Floats | float, limits: FeedLimits) -> Floats:
    """Return the volume that is taken off by time at every place, mm³/s, at feeds, mm/s."""
    depth = np.where(engaged.width <= limits.film, max(limits.depth, limits.film_depth), limits.depth)
    return np.asarray(engaged.width * depth * np.asarray(feed))


def power_at(engaged: Engaged, feed: Floats | float, limits: FeedLimits) -> Floats:
    """Return the power of the cut at every place, W, at feeds, mm/s; 0 where it is not limited, or nothing is cut.

    The mean chip is f_z b / (r φ) where a tooth is in the cut over the angle φ and the cut is b wide: the mean of
    f_z sin φ. It is measured on the whole edge, wherever that is engaged.
    """
    feeds = np.broadcast_to(np.asarray(feed, dtype=float), engaged.width.shape)
    power = np.zeros(len(engaged.width))
    cuts = engaged.width > 0.0
    if limits.material is None or not cuts.any():
        return power
    # b / (r φ), of a place by its own width and angle; the tool's radius goes away with b = r ∫ sin φ.
    mean = np.minimum(engaged.width[cuts] / (engaged.angle[cuts] * 0.5 * limits.diameter), 1.0)
    chip = mean * SECONDS_PER_MINUTE * feeds[cuts] / (limits.rpm * limits.teeth)
    power[cuts] = milling_power(limits.material, removal_rate(engaged, feeds, limits)[cuts], chip)
    return power


def allowed_feed(engaged: Engaged, limits: FeedLimits) -> Floats:
    """Return the highest feed at every place, mm/s, that keeps the chip, the power and the highest feed.

    The power of a cut goes with f^(1 − mc), where kc goes with h^−mc.
    """
    most = np.full(len(engaged.width), limits.feed)
    feed = np.minimum(most / np.maximum(engaged.chip, 1e-9), limits.most)
    if limits.material is not None:
        power = power_at(engaged, feed, limits)
        over = power > limits.power
        feed[over] *= (limits.power / power[over]) ** (1.0 / (1.0 - limits.material.mc))
    return np.asarray(feed)


def power_on_ramp(limits: FeedLimits, across: float, down: float, depth: float) -> float:
    """Return the power of a ramp or a helix at most, W; 0 where it is not limited.

    Its side is taken to cut a slot as deep as the level all the way, though only the end of a ramp is so deep, and a
    helix only as deep as one turn falls; its end cuts on the whole area of the tool.

    Parameters
    ----------
    across, down
        The feed along the table and downwards, mm/s.
    depth
        From what is uncut down to where the ramp ends, mm.
    """
    if limits.material is None or not across > 0.0 or not down > 0.0:
        return 0.0
    teeth_by_time = limits.rpm * limits.teeth / SECONDS_PER_MINUTE
    side = limits.diameter * max(depth, limits.depth) * across
    end = 0.25 * math.pi * limits.diameter**2 * down
    chip = mean_chip(across / teeth_by_time, limits.diameter, limits.diameter)
    return float(ramp_power(limits.material, side, end, chip, down / teeth_by_time))


def power_on_plunge(limits: FeedLimits, down: float) -> float:
    """Return the power of a mill that goes straight down, W, at a feed, mm/s; 0 where it is not limited.

    Its end cuts on the whole area of the tool, with a chip as thick as it sinks for each tooth: as the end of a ramp
    does (`material.cutting_force.ramp_power`).
    """
    if limits.material is None or not down > 0.0:
        return 0.0
    teeth_by_time = limits.rpm * limits.teeth / SECONDS_PER_MINUTE
    return float(milling_power(limits.material, 0.25 * math.pi * limits.diameter**2 * down, down / teeth_by_time))


def plunge_feed(limits: FeedLimits, feed: float) -> float:
    """Return how fast a mill may go straight down, mm/s: `feed`, or within the power, which goes with f^(1 − mc)."""
    power = power_on_plunge(limits, feed)
    if limits.material is None or power <= limits.power:
        return feed
    return float(feed * (limits.power / power) ** (1.0 / (1.0 - limits.material.mc)))


def ramp_feed(limits: FeedLimits, feed: float, angle: float, depth: float) -> float:
    """Return how fast a ramp or a helix of a slope of at most `angle`, rad, may go, mm/s: `feed`, or within the power.

    A flatter one goes a little farther along the table: it counts as if it went along at all of its feed.
    """
    power = power_on_ramp(limits, feed * math.cos(angle), feed * math.sin(angle), depth) / math.cos(angle)
    if limits.material is None or power <= limits.power:
        return feed
    # The power of both parts goes with f^(1 − mc).
    return float(feed * (limits.power / power) ** (1.0 / (1.0 - limits.material.mc)))
