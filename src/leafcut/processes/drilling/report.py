"""What is told of holes that are drilled: what is told of every path over holes, and what low ways save."""

from __future__ import annotations

from typing import Any

from leafcut.model.process_report import Fact
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.report.path_report import PathReport
from leafcut.report.wording import time_words


class DrillingReport(PathReport[DrillingDetail]):
    """What holes show."""

    def answer(self) -> dict[str, Any]:
        """Return what the ways over a surface save."""
        saved = self.outcome.detail.low_ways_saved_s
        return {} if saved is None else {"low_ways_saved_s": saved}

    def facts(self) -> list[Fact]:
        """Return what every path tells, and what the ways over a surface save."""
        saved = self.outcome.detail.low_ways_saved_s
        low = [] if saved is None else [Fact("low ways", f"save {time_words(saved)} against all ways over the highest")]
        return [*low, *super().facts()]
