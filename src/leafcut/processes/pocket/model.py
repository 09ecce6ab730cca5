"""What milling pockets alone finds out: how every pocket is cleared, and the other ways that were tried."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from leafcut.model.outcome import Outcome
from leafcut.model.pocket import PocketPlan, PocketProgram

if TYPE_CHECKING:
    from leafcut.processes.pocket.report.pocket_report import PocketReport


@dataclass(frozen=True)
class PocketDetail:
    """Pockets cleared.

    Attributes
    ----------
    plans
        How every pocket is cleared, with all strategies that were tried.
    programs
        Of several pockets: the program as it is written, and that of every strategy that clears all of them.
    """

    plans: tuple[PocketPlan, ...]
    programs: tuple[PocketProgram, ...] = ()

    def report(self, outcome: Outcome[PocketDetail]) -> PocketReport:
        """Return what is told of pockets."""
        from leafcut.processes.pocket.report.pocket_report import PocketReport

        return PocketReport(outcome)
