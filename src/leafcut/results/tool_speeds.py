"""Result of choosing speeds and feeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.errors import count_of
from leafcut.model.cutting_front import CuttingData
from leafcut.results.base import Result
from leafcut.units import format_time


@dataclass(frozen=True, repr=False, eq=False)
class ToolSpeedsResult(Result, CuttingData):
    """Speeds and feeds of tools. `save` writes ``.json``, or the Pareto fronts as ``.svg``."""

    def _summary_line(self) -> str:
        chosen = f"{count_of(len(self.tools), 'tool')} for {self.material.name}, chosen by {self.objective}"
        return f"{self.source or 'no drawing'}: {chosen}, {format_time(self.time)}, cost {self.cost:.2f}"

    def _json_answer(self) -> dict[str, Any]:
        from leafcut.report.cutting_data_report import cutting_data_as_json

        return cutting_data_as_json(self)

    def _svg(self) -> str:
        from leafcut.report.front_chart import front_svg

        return front_svg(self)
