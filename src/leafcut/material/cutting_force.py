"""Forces, torque and power of drills and mills, from Kienzle's specific cutting force.

Sources: O. Kienzle, Die Bestimmung von Kräften und Leistungen an spanenden Werkzeugen und Werkzeugmaschinen, VDI-Z 94
(1952), p. 299: kc = kc1.1 h^-mc; Dijet, general catalogue 2018, p. F007: kc = kc1 hm^-mc, Pc = ap ae vf kc / (6·10⁷ η);
Sandvik Coromant, Machining formulas and definitions, Milling and Drilling: hm, Pc and Mc. In mm, N, s and rad, the
factors 6·10⁷, 240·10³ and 30·10³ for kW, m/min and rpm are not needed. kc11 applies to a rake angle of 0°. Sharp tools
need about 1 % less per degree of rake (Sandvik Coromant, Specific cutting force); this difference is kept as a reserve
for wear. Measured torque and thrust of twist drills: Tungaloy, general catalogue 2020-2021, p. L068, Cutting forces and
power requirement: Mc = K D² (0.630 + 16.84 f) / 100, N·m; Tc = 570 K D f^0.85, N; K = 1 for cast iron of 177 HB.
"""

from __future__ import annotations

import math

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.work_material import WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

#: Number of lips of a twist drill. Each lip cuts half of the feed.
_LIPS = 2
#: Torque of a twist drill, N·mm: K D² (a + b f), and its thrust, N: K D c f^d, with D and f in mm (Tungaloy).
_TORQUE, _TORQUE_BY_FEED = 6.30, 168.4
_THRUST, _THRUST_FEED = 570.0, 0.85
#: Factor for the thrust of a drill from the specific cutting force: Common Drilling Formulas (scribd.com, 262196644),
#: Ff = 0.7 D/2 f kc, "approximately". With 0.7, C45 needs 2470 N at 10 mm and 0.3 mm; the course Basic Drilling of
#: Mitsubishi Materials (mmc-permanent.learnways.com) gives 2500 N.
_THRUST_SHARE = 0.7
#: Share of the spindle power that reaches the tool (an estimate for belts and gears; manufacturers state 0.7 to 0.8).
DRIVE_EFFICIENCY = 0.75
#: W per N·mm/s.
_WATT = 0.001


def mean_chip_thickness(feed_per_tooth: Floats | float, width: Floats | float, diameter: float) -> Floats:
    """Return the mean chip thickness hm of a one-sided milling cut, mm.

    A tooth is engaged over the angle φ, where cos φ = 1 − 2 ae/D. The mean of f_z sin φ is hm = f_z (1 − cos φ) / φ
    (Altintas, Manufacturing Automation, 2nd ed., section 2.6). At full width, hm is 2 f_z / π. For narrow cuts, it
    approaches f_z √(ae/D), the formula used in catalogues. `width` is ae, mm. It is limited to the diameter.
    """
    share = np.clip(np.asarray(width, dtype=float) / diameter, 1e-12, 1.0)
    angle = 2.0 * np.arcsin(np.sqrt(share))  # arccos(1 − 2 share), accurate for small shares
    return np.asarray(np.asarray(feed_per_tooth) * 2.0 * share / angle)


def specific_force(material: WorkMaterial, chip: Floats | float) -> Floats:
    """Return the specific cutting force kc = kc11 h^-mc, N/mm², for a chip thickness h, mm."""
    return np.asarray(material.kc11 * np.asarray(chip, dtype=float) ** -material.mc)


def milling_power(material: WorkMaterial, rate: Floats | float, chip: Floats | float) -> Floats:
    """Return the power of a milling cut, W, from the material removal rate, mm³/s, and the mean chip thickness, mm."""
    return np.asarray(_WATT * np.asarray(rate) * specific_force(material, chip))


def feed_ratio_for_power(material: WorkMaterial, power_ratio: Floats | float) -> Floats:
    """Return the factor by which the feed changes when the power of a cut changes by `power_ratio`.

    The power is proportional to f^(1 − mc), because kc is proportional to h^−mc.
    """
    return np.asarray(np.asarray(power_ratio) ** (1.0 / (1.0 - material.mc)))


def ramp_power(
    material: WorkMaterial,
    side_rate: Floats | float,
    end_rate: Floats | float,
    side_chip: Floats | float,
    end_chip: Floats | float,
) -> Floats:
    """Return the power of a mill on a sloped descent, W. This is the power at its side plus the power at its end.

    Both follow P = kc(h) Q, but with different chip thicknesses. At the end of the tool, the chip thickness is the
    descent per tooth. On a flat ramp, this chip is much thinner and needs a higher specific force. The removal by the
    end is calculated with the smaller of both chip thicknesses, because the boundary of the end is not known for every
    shape.

    Parameters
    ----------
    side_rate, end_rate
        Material removal rate, mm³/s.
    side_chip, end_chip
        Chip thickness, mm, above 0: the mean for the horizontal motion, and the descent per tooth.
    """
    return np.asarray(
        milling_power(material, side_rate, side_chip)
        + milling_power(material, end_rate, np.minimum(side_chip, end_chip))
    )


def spindle_torque(power: Floats | float, rpm: Floats | float) -> Floats:
    """Return the torque, N·mm, at a power, W, and a spindle speed, rpm: P / ω."""
    return np.asarray(np.asarray(power) / (_WATT * math.tau / SECONDS_PER_MINUTE * np.asarray(rpm)))


def drilling_power(torque: Floats | float, rpm: Floats | float, efficiency: float = 1.0) -> Floats:
    """Return the power, W, at a torque, N·mm, and a spindle speed, rpm: M ω / η."""
    turning = _WATT * math.tau / SECONDS_PER_MINUTE
    return np.asarray(np.asarray(torque) * turning * np.asarray(rpm) / efficiency)


def drilling_torque(
    material: WorkMaterial, diameter: float, feed: Floats | float, point_angle: float = math.radians(118)
) -> Floats:
    """Return the torque of a drill, N·mm. The feed is in mm per revolution.

    If the material has a `WorkMaterial.drill_constant`, the measured formula applies. Otherwise, M = kc f D² / 8. The
    chip thickness per lip is f/2 sin κ, where κ is half the point angle.
    """
    if material.drill_constant:
        return np.asarray(material.drill_constant * diameter**2 * (_TORQUE + _TORQUE_BY_FEED * np.asarray(feed)))
    return np.asarray(
        specific_force(material, _chip_thickness_per_lip(feed, point_angle)) * np.asarray(feed) * diameter**2 / 8.0
    )


def drilling_thrust(
    material: WorkMaterial, diameter: float, feed: Floats | float, point_angle: float = math.radians(118)
) -> Floats:
    """Return the thrust of a drill, N. The feed is in mm per revolution.

    If the material has a `WorkMaterial.drill_constant`, the measured formula applies. Otherwise, F = 0.7 kc f D/2. This
    is a good approximation for a drill with a thinned web. Without a thinned web, the thrust is up to twice as high.
    """
    if material.drill_constant:
        return np.asarray(material.drill_constant * _THRUST * diameter * np.asarray(feed) ** _THRUST_FEED)
    kc = specific_force(material, _chip_thickness_per_lip(feed, point_angle))
    return np.asarray(_THRUST_SHARE * kc * np.asarray(feed) * 0.5 * diameter)


def _chip_thickness_per_lip(feed: Floats | float, point_angle: float) -> Floats:
    return np.asarray(np.asarray(feed, dtype=float) / _LIPS * math.sin(0.5 * point_angle))
