"""What is told of engraving: the path, and how many lines there are."""

from __future__ import annotations

from leafcut.report.path_report import PathReport
from leafcut.report.wording import count
from leafcut_engrave.model import EngravingDetail


class EngravingReport(PathReport[EngravingDetail]):
    """Lines in the place of holes."""

    def counts(self) -> dict[str, int]:
        """Return how many lines there are."""
        return {"lines": self.outcome.detail.lines}

    def counts_words(self) -> str:
        """Return ``3 lines``."""
        return count(self.outcome.detail.lines, "line")
