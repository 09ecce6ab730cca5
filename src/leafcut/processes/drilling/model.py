"""What drilling alone finds out in a run: nothing that not every process does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from leafcut.model.outcome import Outcome

if TYPE_CHECKING:
    from leafcut.report.path_report import PathReport


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling: all that there is to tell is of every outcome."""

    def report(self, outcome: Outcome[DrillingDetail]) -> PathReport[DrillingDetail]:
        """Return what is told of paths over holes."""
        from leafcut.report.path_report import PathReport

        return PathReport(outcome)
