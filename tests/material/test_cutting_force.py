"""Forces, torque and power of drills and mills, against the catalogues' formulas in their own units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.material.cutting_force import (
    drilling_power,
    drilling_thrust,
    drilling_torque,
    mean_chip_thickness,
    milling_power,
    specific_force,
    spindle_torque,
)
from leafcut.model.work_material import WorkMaterial

STEEL = WorkMaterial("steel", kc11=1700.0, mc=0.25)


def test_the_specific_cutting_force_is_kc11_at_a_chip_of_one_millimetre_and_rises_for_thinner_ones() -> None:
    """Kienzle at 0.1 mm: 1700 × 0.1^-0.25 = 1700 × 1.77828 = 3023 N/mm²."""
    assert specific_force(STEEL, 1.0) == pytest.approx(1700.0)
    assert specific_force(STEEL, 0.1) == pytest.approx(3023.08, abs=0.01)


@pytest.mark.parametrize("width", [0.05, 0.7, 2.0, 5.0, 9.3, 10.0])
def test_the_mean_chip_is_the_mean_of_what_a_tooth_cuts_over_its_angle(width: float) -> None:
    """h = f_z sin φ from 0 to the angle where the tooth is 1 − 2 ae/D across; its mean by many small steps."""
    end = math.acos(1.0 - 2.0 * width / 10.0)
    angles = (np.arange(200_000) + 0.5) / 200_000 * end
    assert mean_chip_thickness(0.1, width, 10.0) == pytest.approx(0.1 * np.sin(angles).mean(), rel=1e-6)


def test_the_mean_chip_of_a_slot_is_two_over_pi_and_of_a_narrow_cut_the_catalogues_root() -> None:
    """ae = D: 2 f_z / π. ae = D/100: f_z √0.01 (Dijet 2018, p. F007), which is 0.2 % off there."""
    assert mean_chip_thickness(0.1, 10.0, 10.0) == pytest.approx(0.2 / math.pi)
    assert mean_chip_thickness(0.1, 25.0, 10.0) == pytest.approx(0.2 / math.pi)
    assert mean_chip_thickness(0.1, 0.1, 10.0) == pytest.approx(0.1 * math.sqrt(0.01), rel=2e-3)


def test_the_power_of_milling_is_the_catalogues_in_kilowatts() -> None:
    """Pc = ap ae vf kc / 60·10⁶ at the cutter, kW, mm/min (Dijet 2018, p. F007)."""
    ap, ae, vf = 5.0, 8.0, 600.0
    chip = float(mean_chip_thickness(0.05, ae, 10.0))
    kilowatts = ap * ae * vf * 1700.0 * chip**-0.25 / 60e6
    assert milling_power(STEEL, ap * ae * vf / 60.0, chip) == pytest.approx(1000.0 * kilowatts)


def test_power_and_torque_of_drilling_are_the_catalogues_in_kilowatts_and_newton_metres() -> None:
    """Pc = fn vc DC kc / (240·10³), kW; Mc = Pc 30·10³ / (π n), N·m (Sandvik Coromant, Drilling formulas).

    Ff = 0.7 D/2 f kc (Common Drilling Formulas, scribd.com, 262196644).
    """
    diameter, feed, rpm = 10.0, 0.2, 900.0
    kc = 1700.0 * (feed / 2 * math.sin(math.radians(59))) ** -0.25
    kilowatts = feed * (math.pi * diameter * rpm / 1000.0) * diameter * kc / 240e3
    torque = drilling_torque(STEEL, diameter, feed)
    assert torque / 1000.0 == pytest.approx(kilowatts * 30e3 / (math.pi * rpm))
    assert drilling_power(torque, rpm) == pytest.approx(1000.0 * kilowatts)
    assert drilling_power(torque, rpm, 0.5) == pytest.approx(2000.0 * kilowatts)
    assert spindle_torque(drilling_power(torque, rpm), rpm) == pytest.approx(torque)
    assert drilling_thrust(STEEL, diameter, feed) == pytest.approx(0.7 * kc * feed * 5.0)


def test_a_measured_constant_of_drills_goes_before_the_specific_cutting_force() -> None:
    """K = 2.22 at 10 mm, 0.2 mm, by hand: 2.22·100·(0.630 + 3.368)/100 = 8.876 N·m; 570·2.22·10·0.25463 = 3222 N."""
    steel = WorkMaterial("steel", 1700.0, 0.25, drill_constant=2.22)
    assert drilling_torque(steel, 10.0, 0.2) == pytest.approx(8876.0, abs=1.0)
    assert drilling_thrust(steel, 10.0, 0.2) == pytest.approx(3222.0, abs=1.0)
