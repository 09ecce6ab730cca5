"""LinuxCNC needs the estimated time for a short program."""

from __future__ import annotations

import pytest

from benchmarks import machine_time, timed_programs
from outside_programs import program_path


@pytest.fixture
def simulated_linuxcnc() -> None:
    """Skip the test without the simulated LinuxCNC."""
    if not (machine_time.SIMULATION / "simrun.py").exists():
        pytest.skip("the simulated LinuxCNC is missing; set LEAFCUT_LINUXCNC")
    for name, package in machine_time.TOOLS.items():
        program_path(name, package)


@pytest.mark.usefixtures("simulated_linuxcnc")
def test_linuxcnc_takes_as_long_as_estimated_within_two_percent() -> None:
    """A busy host starves a fast simulation of lines, which only lengthens its time; then a slower one is asked."""
    text = timed_programs.polygon(3000, "G64")
    estimated, times = machine_time.estimated_seconds(text), list[float]()
    for speed in (machine_time.SPEED, machine_time.SPEED_WITH_DWELLS, machine_time.REAL_TIME):
        answer = machine_time.run_simulation(text, speed)
        times += [answer["motion_s"]] if answer.get("ok") else []
        if times and min(times) <= 1.02 * estimated:
            break
    assert min(times) == pytest.approx(estimated, rel=0.02)
