"""A machine fitted to a stop-watch: to times of the model with other values, and of LinuxCNC's own clock."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import page, timed_programs
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.machine import Machine
from leafcut.read.machine import load_machine
from leafcut.timing.fitting import HAND_S, MachineFit, MeasuredProgram, fit_machine, predict_program_seconds

ROOT = Path(__file__).parents[2]
ROUTER = replace(load_machine("mach3-router"), corners="grbl", corner_deviation=0.02, spindle_start_s=0.0)


def drilled(holes: int, pitch: float) -> str:
    """Return rapids and plunges alone: corners do not matter where every move ends at rest in z."""
    lines = ["G21 G90 G61", "G0 Z5"]
    for k in range(holes):
        lines += [f"G0 X{pitch * (k % 7)} Y{pitch * (k // 7)}", "G4 P0.1", "G1 Z-1 F300", "G4 P0.1", "G0 Z5", "G4 P0.1"]
    return "\n".join([*lines, "M2", ""])


def zigzag(turns: int, width: float, feed: int) -> str:
    """Return a pocket's zigzag: two corners of 90° for each line."""
    lines = ["G21 G90 G64", "G0 Z5", f"G1 Z0 F{feed}"]
    for k in range(turns):
        lines += [f"G1 X{width if k % 2 == 0 else 0} F{feed}", f"G1 Y{k + 1}"]
    return "\n".join([*lines, "M2", ""])


def polygon(sides: int, rounds: int, radius: float) -> str:
    """Return a polygon gone around several times: many flat corners."""
    lines = ["G21 G90 G64", f"G0 X{radius} Y0", "G1 Z0 F4000"]
    for k in range(1, sides * rounds + 1):
        angle = math.tau * k / sides
        lines.append(f"G1 X{radius * math.cos(angle):.4f} Y{radius * math.sin(angle):.4f} F4000")
    return "\n".join([*lines, "M2", ""])


TEXTS = {
    "holes": drilled(30, 25.0),
    "near holes": drilled(60, 4.0),
    "zigzag": zigzag(60, 30.0, 4000),
    "small zigzag": zigzag(150, 6.0, 3000),
    "polygon": polygon(24, 15, 12.0),
}


def programs(names: list[str], machine: Machine, off: float = 0.0) -> list[MeasuredProgram]:
    """Return programs with the model's own times on a machine, each off by some seconds, up and down in turn."""
    made = [MeasuredProgram(name, interpret_program(TEXTS[name], load_dialect("linuxcnc")).path, 1.0) for name in names]
    seconds = predict_program_seconds(made, machine)
    signs = np.resize([1.0, -1.0, 0.5], len(made))
    return [replace(one, seconds=float(s + off * sign)) for one, s, sign in zip(made, seconds, signs, strict=True)]


def changed(machine: Machine, factor: float, corner: float) -> Machine:
    x, y, z = machine.acceleration
    return replace(machine, acceleration=(x * factor, y * factor, z * factor), corner_deviation=corner)


@pytest.mark.parametrize(("factor", "corner"), [(0.6, 0.05), (1.8, 0.008)])
def test_times_of_another_machine_give_its_accelerations_and_its_corner_value(factor: float, corner: float) -> None:
    measured = programs(list(TEXTS), changed(ROUTER, factor, corner))
    found = fit_machine(measured, ROUTER)
    assert found.acceleration == pytest.approx(factor, rel=1e-3)
    assert found.corner == pytest.approx(corner, rel=5e-3)
    assert found.after == pytest.approx([one.seconds for one in measured], abs=0.01)
    assert np.abs(found.before - [one.seconds for one in measured]).max() > 1.0
    assert found.machine.acceleration == pytest.approx(tuple(a * factor for a in ROUTER.acceleration), rel=1e-3)
    assert found.held == {} and 1.0 <= found.condition < 10.0


def test_a_slow_hand_leaves_the_values_within_what_is_told_of_their_error() -> None:
    """Times 0.3 s off: the truth lies within three standard errors, and these are as a hand makes them."""
    found = fit_machine(programs(list(TEXTS), changed(ROUTER, 0.7, 0.04), HAND_S), ROUTER)
    assert found.acceleration is not None and found.corner is not None
    assert 0 < abs(math.log(found.acceleration / 0.7)) < 3 * found.error["acceleration"] < 0.1
    assert 0 < abs(math.log(found.corner / 0.04)) < 3 * found.error["corner"] < 0.45
    assert np.abs(found.after - found.before).max() > 2 * HAND_S


def test_programs_without_corners_leave_the_corner_value_as_it_is() -> None:
    """Each move ends at rest: no corner value changes the time."""
    found = fit_machine(programs(["holes", "near holes"], changed(ROUTER, 0.7, 0.2)), ROUTER)
    assert (found.corner, found.machine.corner_deviation) == (None, ROUTER.corner_deviation)
    assert found.acceleration == pytest.approx(0.7, rel=1e-3)
    assert "does not change their times" in found.held["corner"] and found.condition == math.inf


def test_one_program_fits_nothing() -> None:
    found = fit_machine(programs(["zigzag"], changed(ROUTER, 0.7, 0.04)), ROUTER)
    assert (found.acceleration, found.corner, found.machine) == (None, None, ROUTER)
    assert found.after == pytest.approx(found.before) and "measure at least two" in found.held["acceleration"]


def test_times_that_no_machine_has_are_not_fitted() -> None:
    """A coffee break in the middle: nine tenths of the time are no motion, and the best acceleration is none."""
    made = [replace(one, seconds=100.0 * one.seconds) for one in programs(["holes", "near holes"], ROUTER)]
    found = fit_machine(made, ROUTER)
    assert found.acceleration is None and found.machine == ROUTER
    assert {"acceleration", "corner"} == set(found.held)


def test_the_least_squares_are_the_least_of_a_grid() -> None:
    """Brute force over both values: no point of a 7 × 7 grid is better than the fit."""
    measured = programs(["zigzag", "small zigzag", "holes"], changed(ROUTER, 0.7, 0.04), 0.4)

    def squares(machine: Machine) -> float:
        seconds = np.array([one.seconds for one in measured])
        off = (predict_program_seconds(measured, machine) - seconds) / np.hypot(HAND_S, 0.005 * seconds)
        return float(off @ off)

    found = fit_machine(measured, ROUTER)
    best = min(
        squares(changed(ROUTER, 0.7 * math.exp(a), 0.04 * math.exp(c)))
        for a in np.linspace(-0.4, 0.4, 7)
        for c in np.linspace(-0.8, 0.8, 7)
    )
    assert squares(found.machine) <= best + 1e-9


def recorded() -> dict[str, float]:
    """Return LinuxCNC's seconds of the programs in docs/results/machine_time.md, by its own clock."""
    text = (page.RESULTS / "machine_time.md").read_text(encoding="utf-8")
    return {name: float(seconds) for name, seconds, *_ in page.rows_of(text)}


def test_recorded_times_of_linuxcnc_give_the_accelerations_it_had() -> None:
    """Its machine had 500, 500 and 300 mm/s²: a third of that, or twice, is put right within a percent."""
    writers = timed_programs.programs()
    names = ["40 holes, G82 P0.2", "zigzag pocket, 3000 mm/min, G61", "slot contours, 3000 mm/min, G61",
             "polygon of 24 corners, 3000 mm/min, G61"]  # fmt: skip
    truth, sim = recorded(), load_machine("linuxcnc-sim")
    # Its clock runs from machine zero on, where it stands at first.
    texts = {name: f"G0 X0 Y0 Z0\n{writers[name]()}" for name in names}
    paths = {name: interpret_program(text, load_dialect("linuxcnc")).path for name, text in texts.items()}
    measured = [MeasuredProgram(name, paths[name], truth[name]) for name in names]
    for wrong in (1 / 3, 2.0):
        found: MachineFit = fit_machine(measured, changed(sim, wrong, sim.corner_deviation))
        assert found.machine.acceleration == pytest.approx((500, 500, 300), rel=0.01)
        assert found.corner is None and "G64 P" in found.held["corner"]
        assert np.abs(found.after / [one.seconds for one in measured] - 1).max() < 0.005
