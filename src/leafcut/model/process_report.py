"""What every process tells of its outcomes, in plain values: pages, summaries and JSON only lay it out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:
    from leafcut.model.cutting import CutPlan
    from leafcut.model.measure import Measure
    from leafcut.model.shown_stock import ShownStock
    from leafcut.model.toolpath import Toolpath

#: Which of the two paths of an outcome.
Which = Literal["before", "after"]


@dataclass(frozen=True)
class Fact:
    """A line of the summary: its name, its words, and how it is set (a style of `rich`, or nothing)."""

    name: str
    words: str
    style: str = ""


@dataclass(frozen=True)
class SummaryTable:
    """The table of the summary: titles, the first of them of the names, and rows of cells; `ours` is set in bold."""

    titles: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    ours: tuple[bool, ...]
    #: Columns of blanks between two columns; fewer where there are many.
    apart: int = 3


class ProcessReport(Protocol):
    """What a process tells of one of its outcomes. All methods are quick but `page` and `drawing`."""

    #: What made the order that the work came in: ``drawing``, ``plan`` file or ``program``.
    came_in: str
    #: How the program was proved, as the badge of the page says it; and what the proof found, as the summary does.
    proof: str
    found: str
    #: Whether the tool is a beam, whose moves at feed are dark while it is off.
    beam: bool
    #: Whether there was anything to order.
    ordered: bool
    #: The package and the name of the page's template for this work, and of its style sheet ("" for none).
    package: str
    template: str
    styles: str
    #: The width that the tool clears along its path, mm; 0 where the drawing shows lines.
    cleared: float
    #: What the summary calls the file that was written.
    file_name: str

    def stated(self) -> tuple[Measure, Measure | None, Measure]:
        """Return the three orders as every face states them: before, nearest neighbour, as written."""

    def counts(self) -> dict[str, int]:
        """Return how much of what there is: the ``counts`` of the JSON answer."""

    def counts_words(self) -> str:
        """Return the same in words: ``70 holes · 3 tools``."""

    def answer(self) -> dict[str, Any]:
        """Return what the JSON answer has for this process alone."""

    def bound_words(self) -> str:
        """Return what is certain of the orders; "" for nothing."""

    def search_name(self, number: int) -> str:
        """Return what one search put in order."""

    def nearest_cost(self) -> float | None:
        """Return what the nearest neighbour order costs in the solver's unit, None where that is not known."""

    def summary_table(self) -> SummaryTable:
        """Return the table of the summary."""

    def facts(self) -> list[Fact]:
        """Return the lines of the summary that belong to this process."""

    def overview(self) -> dict[str, Any]:
        """Return the figures of the page without its drawings (`report.overview`): tiles, times and parts."""

    def page(self) -> dict[str, Any]:
        """Return what the page's template needs."""

    def drawing(self, which: Which) -> str:
        """Return the path ``before`` or ``after`` as a drawing in SVG that stands alone but for its styles."""

    def ways(self) -> Iterator[tuple[str, Toolpath]]:
        """Yield the other ways to do the same work that were tried, and the one that is written, each by its name."""

    def norms(self) -> str:
        """Return norms of time and consumption as a table, CSV; nothing for work that has none."""

    def plan(self, which: Which) -> CutPlan | None:
        """Return the plan of a sheet's cuts ``before`` or ``after``; None for other work."""

    def stock(self) -> ShownStock:
        """Return the stock that is worked on, or why it cannot be shown."""
