"""What is told of a sheet: its parts, its cuts, the time and the cost of a sheet and of the batch."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from leafcut.model.cutting import CutMeasures, CutPlan
from leafcut.model.fact import Fact
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome, Which
from leafcut.model.shown_stock import CUT_THROUGH, ShownStock
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.report import sheet_page
from leafcut.processes.sheet.report.cut_words import cut_counts, cut_counts_words, cutting_as_json, norm_facts
from leafcut.processes.sheet.report.norms import norms_text
from leafcut.processes.sheet.report.sheet_drawing import build_sheet_scene, sheet_drawing
from leafcut.report.overview import overview
from leafcut.report.path_report import PathReport
from leafcut.report.wording import at_most_words, count


class SheetReport(PathReport[SheetDetail]):
    """What a sheet shows."""

    package = "leafcut.processes.sheet.report"
    template = "sheet.html.jinja"
    styles = "sheet.css"
    # The ways from cut to cut are told, as in the plan; all travel would count every rise and descent.
    travel = "between"

    def __init__(self, outcome: Outcome[SheetDetail]) -> None:
        super().__init__(outcome)
        if "--plan" in outcome.options:
            self.came_in = "plan"

    def stock(self) -> ShownStock:
        """Return that a sheet is cut through."""
        return CUT_THROUGH

    def stated(self) -> tuple[Measure, Measure | None, Measure]:
        """Return the three measures with the lengths of the plans: along the cuts, and between them in X and Y.

        What the torch rises and descends, `Measure` has besides; a controller that finds the sheet itself does that
        without the program.
        """
        outcome, (before, nearest, after) = self.outcome, self.outcome.detail.norms
        near = outcome.nearest if outcome.nearest is None or nearest is None else _of_sheet(outcome.nearest, nearest)
        return _of_sheet(outcome.before, before), near, _of_sheet(outcome.after, after)

    def counts(self) -> dict[str, int]:
        """Return how many parts, contours, marks and pierces there are."""
        return cut_counts(self.outcome.detail.plan)

    def counts_words(self) -> str:
        """Return ``4 parts · 16 contours · 16 pierces``."""
        return cut_counts_words(self.outcome.detail.plan)

    def answer(self) -> dict[str, Any]:
        """Return data, time and cost of the plan."""
        return cutting_as_json(self.outcome.detail)

    def bound_words(self) -> str:
        """Return how far the cost of the cuts and the ways between them is from the least, with the starts tried."""
        outcome = self.outcome
        if outcome.gap is None:
            return ""
        unit = outcome.operations[0].solution.unit
        words = (
            f"{'time' if unit == 's' else 'travel'} {at_most_words(outcome.gap, unit)} with the starts that were tried"
        )
        several = len(outcome.operations) > 1
        return words + (", each band from where the one before it ended" if several else "")

    def search_name(self, number: int) -> str:
        """Return what is ordered at once: all of the cuts, or a band of them."""
        operations = self.outcome.operations
        cuts = count(operations[number].cuts, "cut")
        return cuts if len(operations) == 1 else f"band {number + 1}, {cuts}"

    def nearest_cost(self) -> float | None:
        """Return nothing: starts are refined along their contours once the order is found."""
        return None

    def facts(self) -> list[Fact]:
        """Return what it is cut with, its time and its cost."""
        return [*(Fact(*fact) for fact in norm_facts(self.outcome.detail.plan)), *super().facts()]

    def overview(self) -> dict[str, Any]:
        """Return time and cost, where the time goes, and the parts."""
        plan = self.outcome.detail.plan
        return overview(
            sheet_page.facts(self, plan),
            sheet_page.norm_times(self),
            sheet_page.parts_table(plan),
            sheet_page.norms_table(plan),
        )

    def norms(self) -> str:
        """Return the table of norms."""
        return norms_text(self.outcome.detail.plan)

    def page(self) -> dict[str, Any]:
        """Return drawings, time and cost, parts, cutting data."""
        plan = self.outcome.detail.plan
        return {
            "size": sheet_page.sheet_size(plan),
            "saved": sheet_page.saved(self, plan),
            "orders": sheet_page.cards(self),
            "way": "Between cuts",
            "sheet": sheet_page.sheet_content(self, plan),
        }

    def drawing(self, which: Which) -> str:
        """Return the cuts in an order on the sheet."""
        known = [plan for plan in self.outcome.detail.plans if plan is not None]
        words = sheet_page.plan_words(self, 0 if which == "before" else 2)
        return sheet_drawing(build_sheet_scene(known, self.outcome.missing), self.plan(which), which, words, size=True)

    def plan(self, which: Which) -> CutPlan:
        """Return the plan of an order."""
        before, _, after = self.outcome.detail.plans
        return before if which == "before" else after


def _of_sheet(measure: Measure, norm: CutMeasures) -> Measure:
    """Return a measure with the lengths of a sheet's plan."""
    return replace(measure, travel_mm=norm.sheet.rapid_mm, cut_mm=norm.sheet.cut_mm)
