"""Forces, torque and power of drills and mills, by Kienzle's specific cutting force.

Sources: O. Kienzle, Die Bestimmung von Kräften und Leistungen an spanenden Werkzeugen und Werkzeugmaschinen, VDI-Z 94
(1952), p. 299: kc = kc1.1 h^-mc; Dijet, general catalogue 2018, p. F007: kc = kc1 hm^-mc, Pc = ap ae vf kc / (6·10⁷ η);
Sandvik Coromant, Machining formulas and definitions, Milling and Drilling: hm, Pc and Mc. In mm, N, s and rad the
numbers 6·10⁷, 240·10³ and 30·10³ of their kW, m/min and rpm go away. kc11 is that of a rake of 0°: sharp tools with
more need about 1 % less for each degree (Sandvik Coromant, Specific cutting force); it is left in, as room for wear.

Torque and thrust of twist drills as measured: Tungaloy, general catalogue 2020-2021, p. L068, Cutting forces and power
requirement: Mc = K D² (0.630 + 16.84 f) / 100, N·m; Tc = 570 K D f^0.85, N; K = 1 for cast iron of 177 HB.
"""

from __future__ import annotations

import math

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.work_material import WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

#: A twist drill has two lips, each with half of the feed.
_LIPS = 2
#: Torque of a twist drill by its constant, N·mm and mm: K D² (a + b f); and its thrust: K D c f^d, N (Tungaloy).
_TORQUE, _TORQUE_BY_FEED = 6.30, 168.4
_THRUST, _THRUST_FEED = 570.0, 0.85
#: Thrust of a drill by the specific cutting force, as a share: Common Drilling Formulas (scribd.com, 262196644), Ff =
#: 0.7 D/2 f kc, "approximately". With 0.7 C45 needs 2470 N at 10 mm and 0.3 mm; Mitsubishi Materials' course Basic
#: Drilling (mmc-permanent.learnways.com) prints 2500 N.
_THRUST_SHARE = 0.7
#: Share of the spindle's power that reaches the tool (estimate for belts and gears; makers state 0.7 to 0.8).
DRIVE_EFFICIENCY = 0.75
#: W per N·mm/s.
_WATT = 0.001


def mean_chip(feed_per_tooth: Floats | float, width: Floats | float, diameter: float) -> Floats:
    """Return the mean chip thickness hm of a mill that cuts at one side, mm.

    hm = f_z (1 − cos φ) / φ, where the tooth is in the cut over the angle φ, cos φ = 1 − 2 ae/D: the mean of f_z sin φ
    (Altintas, Manufacturing Automation, 2nd ed., section 2.6). At the full width that is 2 f_z / π. The catalogues'
    f_z √(ae/D) for narrow cuts is what it tends to.

    Parameters
    ----------
    width
        ae: how wide the cut is, mm; more than the diameter counts as that.
    """
    share = np.clip(np.asarray(width, dtype=float) / diameter, 1e-12, 1.0)
    angle = 2.0 * np.arcsin(np.sqrt(share))  # arccos(1 − 2 share), exact where share is small
    return np.asarray(np.asarray(feed_per_tooth) * 2.0 * share / angle)


def specific_force(material: WorkMaterial, chip: Floats | float) -> Floats:
    """Return kc = kc11 h^-mc, N/mm², at a chip thickness h, mm."""
    return np.asarray(material.kc11 * np.asarray(chip, dtype=float) ** -material.mc)


def milling_power(
    material: WorkMaterial, rate: Floats | float, chip: Floats | float, efficiency: float = 1.0
) -> Floats:
    """Return the power of a milling cut, W.

    Parameters
    ----------
    rate
        Material removed by time, mm³/s.
    chip
        Mean chip thickness, mm: `mean_chip`.
    efficiency
        Of the machine's drive, η; with 1 it is the power at the cutter.
    """
    return np.asarray(_WATT * np.asarray(rate) * specific_force(material, chip) / efficiency)


def ramp_power(
    material: WorkMaterial,
    side_rate: Floats | float,
    end_rate: Floats | float,
    side_chip: Floats | float,
    end_chip: Floats | float,
) -> Floats:
    """Return the power of a mill that goes down on a slope, W: what its side takes off, and what its end does.

    P = kc(h) Q of both, each with its own chip. That of the end is as thick as the mill sinks for each tooth: on a flat
    ramp it is much thinner, and so needs more force by its area. What the end takes off is counted with the thinner
    one of both chips, as where the end begins is not known of every shape.

    Parameters
    ----------
    side_rate, end_rate
        Material removed by time, mm³/s.
    side_chip, end_chip
        Chip thickness, mm: the mean one of the motion across, and how far the mill sinks for each tooth. More than 0.
    """
    return np.asarray(
        milling_power(material, side_rate, side_chip)
        + milling_power(material, end_rate, np.minimum(side_chip, end_chip))
    )


def spindle_torque(power: Floats | float, rpm: Floats | float) -> Floats:
    """Return the torque of a power, W, at a spindle speed, N·mm: P / ω."""
    return np.asarray(np.asarray(power) / (_WATT * math.tau / SECONDS_PER_MINUTE * np.asarray(rpm)))


def drilling_power(torque: Floats | float, rpm: Floats | float, efficiency: float = 1.0) -> Floats:
    """Return the power of a torque, N·mm, at a spindle speed, W: M ω / η."""
    turning = _WATT * math.tau / SECONDS_PER_MINUTE
    return np.asarray(np.asarray(torque) * turning * np.asarray(rpm) / efficiency)


def drilling_torque(
    material: WorkMaterial, diameter: float, feed: Floats | float, point_angle: float = math.radians(118)
) -> Floats:
    """Return the torque of a drill, N·mm, at a feed, mm per revolution.

    As measured (`WorkMaterial.drill_constant`) where that is known; else M = kc f D² / 8, with the chip f/2 sin κ of
    one lip, κ half of the point's angle.
    """
    if material.drill_constant:
        return np.asarray(material.drill_constant * diameter**2 * (_TORQUE + _TORQUE_BY_FEED * np.asarray(feed)))
    return np.asarray(specific_force(material, _lip_chip(feed, point_angle)) * np.asarray(feed) * diameter**2 / 8.0)


def drilling_thrust(
    material: WorkMaterial, diameter: float, feed: Floats | float, point_angle: float = math.radians(118)
) -> Floats:
    """Return the thrust of a drill, N, at a feed, mm per revolution.

    As measured (`WorkMaterial.drill_constant`) where that is known; else F = 0.7 kc f D/2, which a drill with a thinned
    web comes near: an unthinned one needs up to twice as much.
    """
    if material.drill_constant:
        return np.asarray(material.drill_constant * _THRUST * diameter * np.asarray(feed) ** _THRUST_FEED)
    kc = specific_force(material, _lip_chip(feed, point_angle))
    return np.asarray(_THRUST_SHARE * kc * np.asarray(feed) * 0.5 * diameter)


def _lip_chip(feed: Floats | float, point_angle: float) -> Floats:
    return np.asarray(np.asarray(feed, dtype=float) / _LIPS * math.sin(0.5 * point_angle))
