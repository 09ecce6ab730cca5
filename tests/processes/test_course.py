"""A time limit is that of the whole run: what came before the search, and what comes behind it, is taken off."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from leafcut.options import Settings, SolveOptions
from leafcut.processes.course import Run, RunClock
from leafcut.read.machine import load_machine


@dataclass
class Standing(RunClock):
    """A clock that stands at one time."""

    at: float = 0.0

    def elapsed(self) -> float:
        return self.at


@pytest.mark.parametrize(
    ("limit", "elapsed", "left"),
    [
        (10.0, 0.5, 9.0),  # as much is kept for what comes behind the search
        (10.0, 4.0, 3.5),  # but a quarter at most
        (10.0, 9.0, 1.0),  # a tenth is the search's own
        (10.0, 99.0, 1.0),
        (0.002, 5.0, 0.001),
    ],
)
def test_the_search_has_what_is_left_of_the_time_limit(limit: float, elapsed: float, left: float) -> None:
    settings = Settings().but(SolveOptions(time_limit=limit))
    run = Run(settings, load_machine("haas-vf2"), clock=Standing(at=elapsed))
    assert run.time_to_search() == pytest.approx(left)


def test_without_a_limit_there_is_none() -> None:
    assert Run(Settings(), load_machine("haas-vf2"), clock=Standing(at=5.0)).time_to_search() is None
