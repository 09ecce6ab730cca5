"""Torque, thrust and power of drills as others have printed them: worked examples and another handbook's tables."""

from __future__ import annotations

import pytest

from leafcut.material.cutting_force import drilling_power, drilling_thrust, drilling_torque
from leafcut.model.work_material import WorkMaterial
from leafcut.read.work_materials import load_material

#: Machinery's Handbook, 31st ed., tables 8 and 9, p. 1153: feed, mm, and its factor; diameter, mm, with its factors of
#: thrust and torque.
FEED_FACTORS = {0.1: 0.158, 0.2: 0.276, 0.3: 0.382}
DIAMETER_FACTORS = {4.8: (3.51, 16.84), 9.5: (6.06, 57.53), 16.0: (9.19, 147.0)}
#: Its factors of the work material, table 31 of the 28th edition, as dubstar-04/FeedsAndSpeeds on GitHub quotes them.
WORK_FACTORS = {
    "aluminium-6061": 7000.0, "aluminium-7075": 7000.0, "aluminium-cast": 7000.0, "brass-cuzn39pb3": 7000.0,
    "steel-s235": 24_000.0, "steel-c45": 24_000.0, "stainless-316": 24_000.0,
}  # fmt: skip


def handbook(kd: float, diameter: float, feed: float) -> tuple[float, float]:
    """Return torque, N·m, and thrust, N, by the equations of p. 1152 for SI units, a sharp drill and c/d = 0.18."""
    by_thrust, by_torque = DIAMETER_FACTORS[diameter]
    by_feed = FEED_FACTORS[feed]
    torque = 0.000025 * kd * by_feed * by_torque * 1.085
    thrust = 0.05 * kd * by_feed * by_thrust * 1.355 + 0.007 * kd * diameter**2 * 0.030
    return torque, thrust


@pytest.mark.parametrize("diameter", DIAMETER_FACTORS)
@pytest.mark.parametrize("feed", FEED_FACTORS)
@pytest.mark.parametrize("name", WORK_FACTORS)
def test_torque_and_thrust_are_near_those_of_machinerys_handbook(name: str, feed: float, diameter: float) -> None:
    """Two books differ: torque is 0.68 to 1.38 of the handbook's, thrust 0.78 to 1.62, aluminium above, steel below."""
    torque, thrust = handbook(WORK_FACTORS[name], diameter, feed)
    material = load_material(name)
    assert 0.67 < float(drilling_torque(material, diameter, feed)) / 1000.0 / torque < 1.4
    assert 0.77 < float(drilling_thrust(material, diameter, feed)) / thrust < 1.65


def test_the_constant_of_leaded_brass_is_that_of_the_handbooks_torque() -> None:
    """7000 at 10 mm and 0.2 mm: 0.000025·7000·0.276·10^1.8·1.085 = 3.307 N·m; K = 3.307/(0.630 + 3.368) = 0.827."""
    torque = 0.000025 * 7000 * 0.276 * 10.0**1.8 * 1.085
    assert load_material("brass-cuzn39pb3").drill_constant == pytest.approx(torque / 3.998, abs=0.005)


def test_the_constant_of_stainless_steel_is_that_of_a_worked_example() -> None:
    """0.041·D²·f^0.7 and 143·D·f^0.7 kgf of 12Cr18Ni9Ti (hogyan-kell.it.com), at 10 mm and 0.2 mm in N·m and N."""
    material = load_material("stainless-304")
    torque, thrust = 0.41 * 100.0 * 0.2**0.7, 1430.0 * 10.0 * 0.2**0.7
    assert float(drilling_torque(material, 10.0, 0.2)) / 1000.0 == pytest.approx(torque, rel=0.01)
    assert float(drilling_thrust(material, 10.0, 0.2)) == pytest.approx(thrust, rel=0.05)


def test_the_torque_of_a_20_mm_drill_is_that_of_a_printed_example() -> None:
    """0.0345·20²·0.4^0.8 = 6.63 kgf·m in steel of 750 MPa (byxap7.narod.ru, T-501, question 116), by another formula.

    The steels of the catalogue with 690 to 770 MPa have K from 2.02 to 2.12.
    """
    printed = 6.63 * 9.80665
    found = [float(drilling_torque(WorkMaterial("", 1.0, 0.0, drill_constant=k), 20.0, 0.4)) for k in (2.02, 2.12)]
    assert [torque / 1000.0 for torque in found] == pytest.approx([printed, printed], rel=0.09)


@pytest.mark.parametrize(("diameter", "feed", "rpm"), [(5.0, 0.1, 1500.0), (10.0, 0.2, 900.0), (20.0, 0.4, 300.0)])
def test_power_is_that_of_the_catalogues_own_formula(diameter: float, feed: float, rpm: float) -> None:
    """Pc = K D² n (0.647 + 17.29 f)·10⁻⁶ kW (Tungaloy 2020-2021, p. L068): its numbers are 2 % less than M ω."""
    printed = 2.41 * diameter**2 * rpm * (0.647 + 17.29 * feed) * 1e-6
    torque = drilling_torque(load_material("steel-42crmo4"), diameter, feed)
    assert drilling_power(torque, rpm) / 1000.0 == pytest.approx(printed, rel=0.022)


def test_the_torque_of_a_magnesium_alloy_is_kalpakjians() -> None:
    """A 10 mm drill, 0.2 mm/rev, 800 rpm: 210 mm³/s at 0.5 W·s/mm³ are 105 W, 1.25 N·m (example 23.4, as remembered).

    S. Kalpakjian and S. R. Schmid, Manufacturing Engineering and Technology. A specific energy of 0.5 W·s/mm³ is a
    cutting force of 500 N/mm² at any chip.
    """
    magnesium = WorkMaterial("magnesium", kc11=500.0, mc=0.0)
    torque = drilling_torque(magnesium, 10.0, 0.2)
    assert torque / 1000.0 == pytest.approx(1.25, abs=0.005)
    assert drilling_power(torque, 800.0) == pytest.approx(105.0, abs=0.5)


def test_the_thrust_of_a_drill_without_a_measured_constant_is_that_of_a_makers_course() -> None:
    """10 mm at 0.3 mm/rev: 2500 N, the steel is not named (Mitsubishi Materials, Basic Drilling, learnways.com)."""
    steel = load_material("steel-c45")
    bare = WorkMaterial("c45", steel.kc11, steel.mc)
    assert float(drilling_thrust(bare, 10.0, 0.3)) == pytest.approx(2500.0, rel=0.02)
