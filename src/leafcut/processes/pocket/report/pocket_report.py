"""Report of a pocketing run: the chosen strategy, compared with the others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from leafcut.model.fact import Fact, SummaryTable
from leafcut.model.outcome import Outcome, Which
from leafcut.model.saving import plain
from leafcut.model.shown_stock import ShownStock
from leafcut.model.toolpath import Toolpath
from leafcut.processes.pocket.model import PocketDetail
from leafcut.processes.pocket.report import pocket_page
from leafcut.processes.pocket.report.level_way import way_over_level
from leafcut.processes.pocket.report.pocket_words import (
    STRATEGY_TITLES,
    StrategyFigures,
    chosen_words,
    facts,
    pocket_counts,
    pocket_counts_words,
    pockets_as_json,
    strategy_cells,
    strategy_figures,
)
from leafcut.report.overview import overview
from leafcut.report.pace_words import pace_facts
from leafcut.report.path_report import PathReport
from leafcut.report.wording import clean, time_words


class PocketReport(PathReport[PocketDetail]):
    """Views of a pocketing outcome."""

    proof = "read back and simulated"
    found = "read back and simulated: it does the work that was planned"
    package = "leafcut.processes.pocket.report"
    template = "pocket.html.jinja"
    styles = "pocket.css"
    file_name = "file"

    def __init__(self, outcome: Outcome[PocketDetail]) -> None:
        super().__init__(outcome)
        # A single region needs no order.
        self.ordered = any(len(o.solution.nodes) != 1 for o in outcome.operations)
        self.cleared = outcome.operations[0].tool.diameter

    def counts(self) -> dict[str, int]:
        """Return the numbers of pockets, islands and levels."""
        return pocket_counts(self.outcome)

    def counts_words(self) -> str:
        """Return ``1 pocket of 180 × 140 mm · 3 islands · 2 levels · end mill Ø10``."""
        return pocket_counts_words(self.outcome)

    def answer(self) -> dict[str, Any]:
        """Return the measures of one level of the written path, all strategies, and the effect of new feeds."""
        pace = self.outcome.detail.pace
        return {**pockets_as_json(self.outcome), **({} if pace is None else {"pace": plain(pace)})}

    def pace(self) -> list[Fact]:
        """Return the time that feeds by engagement save, if requested."""
        pace = self.outcome.detail.pace
        return pace_facts(pace) if pace else []

    def stock(self) -> ShownStock:
        """Return the tools and the stock: the solid with filled pockets if known, else a block around the cuts."""
        found, before = super().stock(), self.outcome.detail.before
        return found if before is None else replace(found, surface=before)

    def summary_table(self) -> SummaryTable:
        """Return all possible strategies, measured over one level."""
        rows = [row for row in self._figures() if row.measures is not None]
        return SummaryTable(
            ("one level", *STRATEGY_TITLES),
            tuple((row.name, *strategy_cells(row)) for row in rows),
            tuple(row.chosen for row in rows),
            apart=2,
        )

    def facts(self) -> list[Fact]:
        """Return the time of the program, facts for the operator, and refused strategies."""
        outcome = self.outcome
        return [
            Fact("program", f"{time_words(outcome.after.time_s)} by {chosen_words(outcome)}", "bold"),
            *(Fact(*fact) for fact in facts(outcome)),
            *self.pace(),
            *(
                Fact(row.name, f"not possible: {clean(row.refused)}", "dim")
                for row in self._figures()
                if row.measures is None
            ),
            *(
                Fact(row.name, f"not written: {clean(row.passed_over)}", "dim")
                for row in self._figures()
                if row.passed_over
            ),
        ]

    def overview(self) -> dict[str, Any]:
        """Return the figures of the program and the shares of its time."""
        return overview(pocket_page.facts(self.outcome), pocket_page.times(self.outcome))

    def page(self) -> dict[str, Any]:
        """Return the drawing, the strategies side by side, the facts of the program."""
        outcome = self.outcome
        return {
            "size": pocket_page.pocket_size(outcome),
            "saved": pocket_page.saved(outcome),
            "orders": pocket_page.cards(outcome),
            "way": "Rapids",
            "pocket": pocket_page.pocket_content(outcome),
        }

    def drawing(self, which: Which) -> str:
        """Return the paths over one level: usual (``before``) and written (``after``)."""
        return pocket_page.pocket_svg(self.outcome, which)

    def ways(self) -> Iterator[tuple[str, Toolpath]]:
        """Yield the path of each strategy over one level of all pockets."""
        outcome = self.outcome
        for row in self._figures():
            found = [r.path for p in outcome.detail.plans for r in p.results if r.strategy == row.name]
            paths = [path for path in found if path is not None]
            if row.measures is not None and paths:
                yield (
                    row.name,
                    way_over_level(paths, outcome.detail.plans[0].levels[0], outcome.operations[0].tool),
                )

    def _figures(self) -> list[StrategyFigures]:
        return strategy_figures(self.outcome)
