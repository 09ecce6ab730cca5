"""Result of simulating a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.errors import count_of
from leafcut.model.issue import Severity
from leafcut.model.simulation import Simulation
from leafcut.results.base import Result
from leafcut.units import format_time


@dataclass(frozen=True, repr=False, eq=False)
class SimulationResult(Result, Simulation):
    """The motion of a program on a machine. `save` writes ``.json``, or draws the path as ``.svg``."""

    def _summary_line(self) -> str:
        dangers = sum(issue.severity is Severity.DANGER for issue in self.issues)
        time = f"{format_time(self.measure.time_s)} on {self.machine.name}"
        return f"{self.program}: {time}, {count_of(dangers, 'danger')}"

    def _json_answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import simulation_as_json

        return simulation_as_json(self)

    def _svg(self) -> str:
        from leafcut.report.pictures import simulation_picture

        return simulation_picture(self)
