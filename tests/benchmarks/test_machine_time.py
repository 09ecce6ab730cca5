"""The programs whose time is compared with LinuxCNC's are understood, and LinuxCNC agrees on a short one."""

from __future__ import annotations

import re

import pytest

from benchmarked import benchmark
from simulated_machine import need_simulation


def test_every_program_that_is_made_here_can_be_timed() -> None:
    script = benchmark("machine_time")
    made = {name: text() for name, text in benchmark("timed_programs").programs().items() if "," in name}
    assert len(made) >= 30
    assert all(5.0 < script.estimated_seconds(text) < 400.0 for text in made.values())


def test_the_program_of_a_sheet_is_timed_as_it_was_planned() -> None:
    """Two plates of an outline and two holes: six times down, pierce, round and up; the file reads back to its time."""
    text = benchmark("timed_programs").perforated(2.0, columns=2, rows=1, holes=2)
    assert text.count("M3 S1") == 6
    assert text.count("G4 P0.21") == 6
    stated = re.search(r"estimated time (?:(\d+) min )?([\d.]+) s", text)
    assert stated is not None
    seconds = 60.0 * float(stated[1] or 0) + float(stated[2])
    # The file's own time begins at the safe height over the first cut, the simulated machine at zero.
    assert benchmark("machine_time").estimated_seconds(text) == pytest.approx(seconds, abs=2.0)


def test_linuxcnc_takes_as_long_as_estimated_within_two_percent() -> None:
    script = benchmark("machine_time")
    need_simulation(script)
    text = benchmark("timed_programs").polygon(3000, "G64")
    assert script.estimated_seconds(text) == pytest.approx(script.simulated_seconds(text), rel=0.02)
