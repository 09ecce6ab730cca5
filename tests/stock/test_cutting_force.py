"""Forces, torque and power of drills and mills, against the catalogues' formulas in their own units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.model.work_material import DrillLoad, WorkMaterial
from leafcut.read.work_materials import load_material
from leafcut.stock.cutting_force import (
    drilling_power,
    drilling_thrust,
    drilling_torque,
    mean_chip,
    milling_power,
    specific_force,
    spindle_torque,
)

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
    assert mean_chip(0.1, width, 10.0) == pytest.approx(0.1 * np.sin(angles).mean(), rel=1e-6)


def test_the_mean_chip_of_a_slot_is_two_over_pi_and_of_a_narrow_cut_the_catalogues_root() -> None:
    """ae = D: 2 f_z / π. ae = D/100: f_z √0.01 (Dijet 2018, p. F007), which is 0.2 % off there."""
    assert mean_chip(0.1, 10.0, 10.0) == pytest.approx(0.2 / math.pi)
    assert mean_chip(0.1, 25.0, 10.0) == pytest.approx(0.2 / math.pi)
    assert mean_chip(0.1, 0.1, 10.0) == pytest.approx(0.1 * math.sqrt(0.01), rel=2e-3)


def test_the_power_of_milling_is_the_catalogues_in_kilowatts() -> None:
    """Pc = ap ae vf kc / (60·10⁶ η), kW, mm/min (Dijet 2018, p. F007)."""
    ap, ae, vf = 5.0, 8.0, 600.0
    chip = float(mean_chip(0.05, ae, 10.0))
    kilowatts = ap * ae * vf * 1700.0 * chip**-0.25 / (60e6 * 0.8)
    assert milling_power(STEEL, ap * ae * vf / 60.0, chip, 0.8) == pytest.approx(1000.0 * kilowatts)


def test_power_and_torque_of_drilling_are_the_catalogues_in_kilowatts_and_newton_metres() -> None:
    """Pc = fn vc DC kc / (240·10³), kW; Mc = Pc 30·10³ / (π n), N·m (Sandvik Coromant, Drilling formulas)."""
    diameter, feed, rpm = 10.0, 0.2, 900.0
    kc = 1700.0 * (feed / 2 * math.sin(math.radians(59))) ** -0.25
    kilowatts = feed * (math.pi * diameter * rpm / 1000.0) * diameter * kc / 240e3
    torque = drilling_torque(STEEL, diameter, feed)
    assert torque / 1000.0 == pytest.approx(kilowatts * 30e3 / (math.pi * rpm))
    assert drilling_power(torque, rpm) == pytest.approx(1000.0 * kilowatts)
    assert drilling_power(torque, rpm, 0.5) == pytest.approx(2000.0 * kilowatts)
    assert spindle_torque(drilling_power(torque, rpm), rpm) == pytest.approx(torque)
    assert drilling_thrust(STEEL, diameter, feed) == pytest.approx(0.5 * kc * feed * 5.0 * math.sin(math.radians(59)))


def test_measured_loads_of_drills_go_before_the_specific_cutting_force() -> None:
    """M = 345 D² f^0.8 N·mm and F = 680 D f^0.7 N, at 10 mm and 0.2 mm by hand: 345·100·0.27595, 6800·0.32413."""
    load = DrillLoad(345.0, 2.0, 0.8, 680.0, 1.0, 0.7)
    steel = WorkMaterial("steel", 1700.0, 0.25, drill_load=load)
    assert drilling_torque(steel, 10.0, 0.2) == pytest.approx(9520.2, rel=1e-4)
    assert drilling_thrust(steel, 10.0, 0.2) == pytest.approx(2204.1, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "constant"),
    [("steel-s235", 2.22), ("steel-42crmo4", 2.41), ("cast-iron-gjl-250", 1.0), ("aluminium-6061", 1.01)],
)
def test_the_torque_of_shipped_materials_is_near_that_of_another_maker(name: str, constant: float) -> None:
    """Tungaloy 2020–2021, p. L068: Mc = K D² (0.630 + 16.84 f) / 100, N·m. Such figures differ by up to a half."""
    theirs = constant * 100.0 * (0.630 + 16.84 * 0.2) / 100.0
    ours = float(drilling_torque(load_material(name), 10.0, 0.2)) / 1000.0
    assert 1 / 1.5 < ours / theirs < 1.5


def test_the_torque_of_a_20_mm_drill_is_that_of_a_printed_example() -> None:
    """0.0345·20²·0.4^0.8 = 6.63 kgf·m in steel of 750 MPa (byxap7.narod.ru, T-501, question 116); C45 has 650 MPa."""
    torque = float(drilling_torque(load_material("steel-c45"), 20.0, 0.4)) / 10e3
    assert torque == pytest.approx(6.63 * (650 / 750) ** 0.75, rel=0.005)
