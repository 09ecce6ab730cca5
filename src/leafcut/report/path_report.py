"""The base class of all reports: facts and pictures of work along a path, such as holes and slots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.kinds import BEAMS
from leafcut.model.outcome import Outcome, Which
from leafcut.model.shown_stock import ShownStock
from leafcut.report.set_up import drawing_facts, range_facts, time_facts
from leafcut.report.wording import (
    NO_VALUE,
    OURS,
    count_text,
    fact_heading,
    gap_words,
    length_words,
    operation_work_words,
    percent_words,
    replace_unprintable,
    saved_percent,
    search_summary,
    time_words,
    tool_count,
    tool_words,
)

if TYPE_CHECKING:
    from leafcut.model.cutting import CutPlan
    from leafcut.model.measure import Measure
    from leafcut.model.toolpath import Toolpath
    from leafcut.report.drawing import Scene

D = TypeVar("D")


class PathReport(Generic[D]):
    """Facts and pictures of an outcome. The pictures show paths over holes.

    Reports for other processes override some of the methods.

    Attributes
    ----------
    came_in
        Where the first order comes from: ``drawing``, ``plan`` file or ``program``.
    proof, found
        Text of the badge on the page, and result of the proof for the summary.
    ordered
        Whether a search ordered the work.
    package, template
        Package and name of the page template. The package of a process also has a style sheet of that name.
    travel
        Heading of the column with travel lengths.
    cleared
        Width that the tool clears along its path, mm; 0 if drawings show lines.
    """

    came_in = "drawing"
    proof = "read back, same work"
    found = "read back: it does the work that was planned"
    ordered = True
    package = "leafcut.report"
    template = "path"
    travel = "travel"
    cleared = 0.0

    def __init__(self, outcome: Outcome[D], counts: Sequence[Fact] = ()) -> None:
        """Create the report of an outcome. `counts` replaces the counts of holes, slots and tools."""
        self.outcome = outcome
        self._counts = counts

    def compared_measures(self) -> tuple[Measure, Measure | None, Measure]:
        """Return the measures of the original order, the nearest-neighbour order, and the written order."""
        return self.outcome.before, self.outcome.nearest, self.outcome.after

    def known_orders(self) -> list[tuple[str, Measure]]:
        """Return the name and the measure of each known order, from the original to the written order."""
        measures = zip(self.order_names(), self.compared_measures(), strict=True)
        return [(name, measure) for name, measure in measures if measure is not None]

    def order_names(self) -> tuple[str, str, str]:
        """Return the names of the three orders."""
        names = {
            "drawing": Message("Drawing order"),
            "plan": Message("Plan order"),
            "program": Message("Program order"),
        }
        return names[self.came_in], Message("Nearest neighbour"), OURS

    # -- facts -------------------------------------------------------------------------------------------------------

    @cached_property
    def facts(self) -> list[Fact]:
        """All facts, in the order title, work, set-up, search."""
        bound, outcome = self.gap_sentence(), self.outcome
        return [
            *(self._counts or self.count_facts()),
            *self.process_facts(),
            *self._quote_facts(),
            *drawing_facts(outcome.part),
            *range_facts(outcome),
            *([Fact(sentence=bound, name="gap", of_search=True)] if bound else []),
            *([Fact(sentence=search_summary(outcome), name="method", of_search=True)] if outcome.operations else []),
        ]

    def _quote_facts(self) -> list[Fact]:
        if self.outcome.quote is None:
            return []
        from leafcut.report.quote_page import quote_fact

        return [quote_fact(self.outcome.quote)]

    def count_facts(self) -> list[Fact]:
        """Return the numbers of holes, slots, tools and operations."""
        outcome, tools = self.outcome, tool_count(self.outcome)
        holes, slots = len(outcome.part.holes), len(outcome.part.slots)
        return [
            Fact("counts.holes", holes, "", count_text(holes, "hole")),
            Fact("counts.slots", slots, "", count_text(slots, "slot") if slots else ""),
            Fact("counts.tools", tools, "", count_text(tools, "tool")),
            Fact("counts.operations", len(outcome.operations)),
        ]

    def process_facts(self) -> list[Fact]:
        """Return the facts specific to the process."""
        return [*time_facts(self.outcome), *self.savings_facts()]

    def savings_facts(self) -> list[Fact]:
        """Return facts about the time saved by changes other than the order."""
        return []

    def gap_sentence(self) -> str:
        """Describe the proved gap: ``travel time at most 1.24 % above the least possible``. Return "" without a bound.

        With several tools, the text adds that each tool starts at the end of the previous tool's path.
        """
        outcome = self.outcome
        if outcome.gap is None:
            return ""
        unit = outcome.operations[0].solution.unit
        words = f"{'travel time' if unit == 's' else 'travel'} {gap_words(outcome.gap, unit)}"
        several = len(outcome.operations) > 1
        return words + (", each tool from the end of the last" if several else "")

    # -- tables ------------------------------------------------------------------------------------------------------

    def summary_rows(self) -> list[tuple[tuple[str, ...], bool]]:
        """Return the rows of the summary's table, starting with the titles.

        Each row has its cells, and a flag that marks the written order.
        """
        rows: list[tuple[tuple[str, ...], bool]] = [(("order", self.travel, "cutting", "time", "saved"), False)]
        for row in self.order_rows():
            cells = (row[key] for key in ("travel", "cut", "time", "saved"))
            rows.append(((fact_heading(row["name"]).removesuffix(" order"), *cells), row["ours"]))
        return rows

    def order_rows(self) -> list[dict[str, Any]]:
        """Return the measures of each order as text. Savings are relative to the original order.

        `ours` marks the written order.
        """
        orders = self.known_orders()
        return [
            {
                "name": name,
                "ours": number == len(orders) - 1,
                "time": time_words(measure.time_s),
                "travel": length_words(measure.travel_mm),
                "cut": length_words(measure.cut_mm),
                "saved": percent_words(saved_percent(self.outcome, measure)) if number else NO_VALUE,
            }
            for number, (name, measure) in enumerate(orders)
        ]

    def page_tables(self) -> dict[str, Any]:
        """Return the tables that the report page and the studio share, by name.

        The table ``times`` contains the seconds by kind of motion.
        """
        from leafcut.report import views

        return {"times": views.time_bars(self.outcome, self.known_orders())}

    def operation_title(self, number: int) -> str:
        """Describe the tool and the work of an operation: ``T1 drill Ø6.35, 70 holes``."""
        operation = self.outcome.operations[number]
        return f"{tool_words(operation.tool)}, {operation_work_words(operation)}"

    def nearest_neighbour_cost(self) -> float | None:
        """Return the cost of the nearest-neighbour order in the unit of the solver, or None if it is unknown.

        Orders of the same work differ only in their travel, so the measures differ by the same amount as the costs.
        With several operations, the cost of a single operation is unknown.
        """
        outcome = self.outcome
        if len(outcome.operations) != 1 or outcome.nearest is None:
            return None
        solution = outcome.operations[0].solution
        if solution.unit == "s":
            return solution.cost + outcome.nearest.time_s - outcome.after.time_s
        return solution.cost + outcome.nearest.travel_mm - outcome.after.travel_mm

    # -- page and pictures -------------------------------------------------------------------------------------------

    def template_values(self) -> dict[str, Any]:
        """Return the values for the page template: the drawings before and after, and the tools."""
        from leafcut.report import views
        from leafcut.report.drawing import build_scene, toolpath_svg

        outcome = self.outcome
        scene = build_scene(outcome)
        return {
            "way": "Travel",
            "size": self.size_words(scene),
            "drawn": bool(outcome.part.holes or outcome.part.slots or len(scene.after.all_points)),
            "saved": self.savings_headline(),
            "before": toolpath_svg(scene, "before", self._path_title("before"), holes="=holes"),
            "after": toolpath_svg(scene, "after", self._path_title("after"), holes="#holes"),
            "wide": scene.frame.needs_both_columns,
            "travel": [self._travel_words(measure) for measure in (outcome.before, outcome.after)],
            "legend": views.legend_rows(outcome, scene),
            "tools": views.tool_rows(outcome, scene),
            "tool_columns": views.used_tool_columns(outcome),
            "tools_left_out": max(0, len(outcome.operations) - views.MAX_TOOL_ROWS),
            "staying": self.staying_reasons(),
            "sections": any(o.lines for o in outcome.operations),
        }

    def savings_headline(self) -> dict[str, Any]:
        """Return the headline figure about the savings, with its text."""
        from leafcut.report import views

        return views.savings_headline(self.outcome, self.came_in, self.gap_sentence())

    def staying_reasons(self) -> list[str]:
        """Return lines that explain why tasks keep their position. The result is empty for drawings."""
        return []

    def size_words(self, scene: Scene) -> str:
        """Describe the size of the work."""
        x0, y0, x1, y1 = self.outcome.part.extents
        return f"{x1 - x0:.4g} × {y1 - y0:.4g} mm between centres"

    def drawing(self, which: Which) -> str:
        """Draw a path as a stand-alone SVG without styles."""
        from leafcut.report.drawing import build_scene, toolpath_svg

        return toolpath_svg(build_scene(self.outcome), which, self._path_title(which), size=True)

    def tried_paths(self) -> Iterator[tuple[str, Toolpath]]:
        """Yield the name and the path of each strategy that was tried. Processes without strategies yield nothing."""
        yield from ()

    def cycle_time_csv(self) -> str:
        """Return time and consumption per part as CSV, or "" if the process has no such table."""
        return ""

    def cut_plan(self, which: Which) -> CutPlan | None:
        """Return the plan of the cuts of a sheet, or None for other processes."""
        return None

    def shown_stock(self) -> ShownStock:
        """Return the tools and the stock. The stock is a block around the cuts."""
        return ShownStock({o.tool.number: o.tool for o in self.outcome.operations})

    def _path_title(self, which: Which) -> str:
        order = f"the {self.came_in}’s order" if which == "before" else "leafcut’s order"
        return f"Path of {replace_unprintable(self.outcome.part.name)} in {order}"

    def _travel_words(self, measure: Measure) -> str:
        kind = "with the beam off" if self.outcome.process in BEAMS else "travel"
        return f"{length_words(measure.travel_mm)} {kind}"
