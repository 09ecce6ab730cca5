"""Result of solving a map, which is a tour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.errors import count_of
from leafcut.model.issue import Issue
from leafcut.model.solution import Solved
from leafcut.results.base import Kinds, Result


@dataclass(frozen=True, repr=False, eq=False)
class TourResult(Result, Solved):
    """A map with a tour. `save` writes ``.tour`` (TSPLIB), ``.csv`` (the points of the map), ``.svg`` or ``.json``."""

    def _summary_line(self) -> str:
        gap = "" if self.gap is None else f", gap {100.0 * self.gap:.2f} %"
        points = count_of(len(self.part.holes), "point")
        return f"{self.part.name}: {points}, length {self.solution.cost:,.6g}{gap}, {self.solution.algorithm}"

    def _json_answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import tour_as_json

        return tour_as_json(self)

    def _svg(self) -> str:
        from leafcut.report.pictures import tour_picture

        return tour_picture(self)

    def _shown_issues(self) -> tuple[Issue, ...]:
        return self.part.issues

    def _contents_by_extension(self) -> Kinds:
        from leafcut.read.csvmap import holes_as_csv
        from leafcut.read.tsplib import tour_text

        part, nodes = self.part, self.solution.nodes
        tour = {".tour": lambda: tour_text(part.name, nodes, every=part.grouping is None)}
        return super()._contents_by_extension() | tour | {".csv": lambda: holes_as_csv(part)}
