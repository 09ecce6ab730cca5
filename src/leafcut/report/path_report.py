"""What is told of work along one path: of holes and slots, of a program. Other processes start from it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from leafcut.model.fact import Fact, SummaryTable
from leafcut.model.kinds import BEAMS
from leafcut.model.outcome import Outcome, Which
from leafcut.model.shown_stock import ShownStock
from leafcut.report import views
from leafcut.report.drawing import RAMP, Scene, build_scene, cut_tools, drawing, tool_class
from leafcut.report.overview import overview
from leafcut.report.wording import (
    NO_VALUE,
    at_most_words,
    clean,
    count,
    length_words,
    method_words,
    percent_words,
    said,
    saved_percent,
    time_words,
    tool_count,
)

if TYPE_CHECKING:
    from leafcut.model.cutting import CutPlan
    from leafcut.model.measure import Measure
    from leafcut.model.toolpath import Toolpath

D = TypeVar("D")


class PathReport(Generic[D]):
    """What `model.process_report.ProcessReport` asks for, of work that is drawn as paths over holes."""

    came_in = "drawing"
    proof = "read back, same work"
    found = "read back: it does the work that was planned"
    ordered = True
    package = "leafcut.report"
    template = "path.html.jinja"
    styles = ""
    cleared = 0.0
    file_name = "program"
    #: What the lengths between the cuts are called in the summary, and in the cards of the page.
    travel = "travel"

    def __init__(self, outcome: Outcome[D]) -> None:
        self.outcome = outcome

    def stated(self) -> tuple[Measure, Measure | None, Measure]:
        """Return the three measures as they are."""
        return self.outcome.before, self.outcome.nearest, self.outcome.after

    def orders(self) -> list[tuple[str, Measure]]:
        """Return the known orders by name, the first and the written one included."""
        names = (said(f"{self.came_in.capitalize()} order"), said("Nearest neighbour"), said(views.OURS))
        return [(name, measure) for name, measure in zip(names, self.stated(), strict=True) if measure is not None]

    def counts(self) -> dict[str, int]:
        """Return how many holes, slots, tools and operations there are."""
        outcome = self.outcome
        return {
            "holes": len(outcome.part.holes),
            "slots": len(outcome.part.slots),
            "tools": tool_count(outcome),
            "operations": len(outcome.operations),
        }

    def counts_words(self) -> str:
        """Return ``70 holes · 2 slots · 3 tools``."""
        part = self.outcome.part
        words = [count(len(part.holes), "hole")]
        if part.slots:
            words.append(count(len(part.slots), "slot"))
        return " · ".join([*words, count(tool_count(self.outcome), "tool")])

    def answer(self) -> dict[str, Any]:
        """Return nothing: all is said by what every process says."""
        return {}

    def bound_words(self) -> str:
        """Return what is certain of the orders: ``travel time at most 1.24 % above the least possible``.

        With several tools it says that each tool's path was taken from where the tool before it ended.
        """
        outcome = self.outcome
        if outcome.gap is None:
            return ""
        unit = outcome.operations[0].solution.unit
        words = f"{'travel time' if unit == 's' else 'travel'} {at_most_words(outcome.gap, unit)}"
        several = len(outcome.operations) > 1
        return words + (", each tool from where the one before it ended" if several else "")

    def search_name(self, number: int) -> str:
        """Return the tool and its work: ``T1 drill Ø6.35, 70 holes``."""
        return views.operation_words(self.outcome.operations[number])

    def nearest_cost(self) -> float | None:
        """Return what the nearest neighbour order costs in the solver's unit, or None where that is not known.

        Two orders of the same work differ by their travel alone, so the difference of the measures is the difference
        of the costs. With several operations the measures say nothing about one of them.
        """
        outcome = self.outcome
        if len(outcome.operations) != 1 or outcome.nearest is None:
            return None
        solution = outcome.operations[0].solution
        if solution.unit == "s":
            return solution.cost + outcome.nearest.time_s - outcome.after.time_s
        return solution.cost + outcome.nearest.travel_mm - outcome.after.travel_mm

    def summary_table(self) -> SummaryTable:
        """Return the three orders."""
        before, nearest, after = self.stated()
        named = ((self.came_in, before), ("nearest neighbour", nearest), ("leafcut", after))
        known = [(name, measure) for name, measure in named if measure is not None]
        rows = tuple(
            (
                name,
                length_words(measure.travel_mm),
                length_words(measure.cut_mm),
                time_words(measure.time_s),
                NO_VALUE if measure is before else percent_words(saved_percent(self.outcome, measure)),
            )
            for name, measure in known
        )
        return SummaryTable(
            ("order", self.travel, "cutting", "time", "saved"), rows, tuple(name == "leafcut" for name, _ in known)
        )

    def facts(self) -> list[Fact]:
        """Return how far the path is from the best possible, and how it was sought."""
        facts = [] if self.outcome.gap is None else [Fact("gap", self.bound_words())]
        return facts + ([Fact("method", method_words(self.outcome))] if self.outcome.operations else [])

    def overview(self) -> dict[str, Any]:
        """Return where the time goes."""
        return overview(times=views.times(self.outcome, self.orders()))

    def page(self) -> dict[str, Any]:
        """Return the drawings before and after, where the time goes, and the tools."""
        outcome = self.outcome
        scene = build_scene(outcome)
        return {
            "way": "Travel",
            "size": self.size(scene),
            "drawn": bool(outcome.part.holes or outcome.part.slots or len(scene.after.points)),
            "saved": self.saved(),
            "orders": views.cards(outcome, self.orders()),
            "times": self.overview()["times"],
            "before": drawing(scene, "before", self._path_words("before"), holes="=holes"),
            "after": drawing(scene, "after", self._path_words("after"), holes="#holes"),
            "wide": scene.frame.wide,
            "travel": [self._travel_words(measure) for measure in (outcome.before, outcome.after)],
            "legend": _legend(outcome, scene),
            "tools": views.tools(outcome, scene),
            "tools_say": views.tools_say(outcome),
            "tools_left_out": max(0, len(outcome.operations) - views.MOST_TOOL_ROWS),
            "staying": self.staying_words(),
            "pace": [(fact.name, fact.words) for fact in self.pace()],
            "sections": any(o.lines for o in outcome.operations),
        }

    def saved(self) -> views.PageRow:
        """Return the large figure and the words around it."""
        return views.saved(self.outcome, self.came_in, self.bound_words())

    def staying_words(self) -> list[str]:
        """Return what keeps its place, and why: nothing of what was planned from a drawing."""
        return []

    def pace(self) -> list[Fact]:
        """Return what new heights and speeds saved: none are given to what was planned from a drawing."""
        return []

    def size(self, scene: Scene) -> str:
        """Return how large the work is."""
        x0, y0, x1, y1 = self.outcome.part.extents
        return f"{x1 - x0:.4g} × {y1 - y0:.4g} mm between centres"

    def drawing(self, which: Which) -> str:
        """Return the path over the holes."""
        return drawing(build_scene(self.outcome), which, self._path_words(which), size=True)

    def ways(self) -> Iterator[tuple[str, Toolpath]]:
        """Yield nothing: there is one way to do the work."""
        yield from ()

    def norms(self) -> str:
        """Return nothing: there are no parts of a sheet."""
        return ""

    def plan(self, which: Which) -> CutPlan | None:
        """Return nothing: there are no cuts of a sheet."""
        return None

    def stock(self) -> ShownStock:
        """Return the tools of the operations, and a block around the cuts."""
        return ShownStock({o.tool.number: o.tool for o in self.outcome.operations})

    def _path_words(self, which: Which) -> str:
        order = f"the {self.came_in}’s order" if which == "before" else "leafcut’s order"
        return f"Path of {clean(self.outcome.part.name)} in {order}"

    def _travel_words(self, measure: Measure) -> str:
        return f"{length_words(measure.travel_mm)} {'with the beam off' if self.outcome.process in BEAMS else 'travel'}"


def _legend(outcome: Outcome, scene: Scene) -> dict[str, Any]:
    """Return what the drawings show; only what is there is explained."""
    # A hole's colour is that of its last tool, so a tool that is always followed by another one colours nothing.
    shown = {d.tool for d in scene.dots} | {tool for tool, _, _ in scene.slots}
    cutting = cut_tools(scene)
    shown |= set(cutting.values())
    holes = {d.tool for d in scene.dots} | {tool for tool, _, _ in scene.slots}
    entries = [
        (tool_class(scene, t), _tool_words(outcome, scene.tools[t]), t not in holes) for t in sorted(shown) if t >= 0
    ]
    if -1 in shown:
        entries.append(("idle", "not machined", False))
    return {
        "ramp": None if scene.numbered else [f"r{i}" for i in range(0, RAMP, 3)],
        "cuts": bool(len(scene.after.cuts) or len(scene.before.cuts)) and not cutting,
        "stops": bool(len(scene.after.stops)),
        "tools": entries,
        "enlarged": scene.enlarged,
        "unsized": scene.unsized,
        "edge": bool(len(scene.edge)),
    }


def _tool_words(outcome: Outcome, number: int) -> str:
    """Return ``T1 drill Ø6.35, 70 holes and 2 slots``, a tool's operations taken together."""
    mine = [o for o in outcome.operations if o.tool.number == number]
    return f"{views.tool_words(mine[0].tool)}, {' and '.join(views.work_words(o) for o in mine[:3])}"
