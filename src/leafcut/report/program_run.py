"""What a program does on a machine, and what that costs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Toolpath


@dataclass(frozen=True)
class ProgramRun:
    """What a program does on a machine.

    Attributes
    ----------
    path
        What the program says, and `run` that with what its controller adds at every cut.
    dialect
        In which it was read.
    issues
        What is dangerous in it, what was assumed, and what of the controller's own doing is not known.
    """

    path: Toolpath
    run: Toolpath
    machine: Machine
    dialect: str
    issues: tuple[Issue, ...] = ()

    def cost(self) -> dict[str, Any]:
        """Return what `simulate` tells, but for the program's name."""
        from leafcut.report.json_answer import issues_as_json
        from leafcut.timing.toolpath import measure

        path, machine = self.path, self.machine
        # From where `optimize` counts, too, unless `--start-point` says otherwise.
        result = measure(self.run, machine, start=(0.0, 0.0))
        low, high = path.extents
        return {
            "machine": machine.name,
            "time_s": result.time_s,
            "rapid_mm": result.travel_mm,
            "feed_mm": result.cut_mm,
            "by_kind": result.by_kind,
            "extents": {axis: [low[k], high[k]] for k, axis in enumerate("xyz")},
            "issues": issues_as_json(self.issues),
        }
