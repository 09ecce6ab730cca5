"""Compares the strategies of a pocket. The drawing can show each strategy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from leafcut.report.wording import clock_text
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.units import format_length

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

_FIGURES = ("way", "lifts", "uncut", "time")


class StrategiesPanel:
    """The table with the results of all strategies for one level of the pockets.

    Users can select a strategy to draw.
    """

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self._job = ""
        #: The strategy that is drawn instead of the program.
        self._shown = ""

    def draw(self, record: JobRecord, answer: dict[str, Any]) -> None:
        """Show the strategies in the current container, and mark the selected strategy."""
        self._job, self._shown = record.id, ""
        w, known = self.view.words, self.view.studio.history.artefacts(record.id)
        text("h3", w("result.strategies"))
        if any(name.startswith("way-") for name in known):
            text("p", w("result.strategy_shown"), "quiet small")
        self._buttons: dict[str, Any] = {}
        with box("div", "scroll"), box("table", "strategies", aria_label=w("result.strategies")):
            with box("thead"), box("tr"):
                text("th", w("result.strategy"), scope="col")
                for key in _FIGURES:
                    text("th", w(f"result.{key}"), "n", scope="col")
            with box("tbody"):
                for row in answer["strategies"]:
                    self._draw_row(row, f"way-{row['strategy']}" in known)
        for row in answer["strategies"]:
            reason = row.get("refused") or row.get("passed_over")
            if reason:
                text(
                    "p", f"{row['strategy']}: {w.translate_for_page(reason)}", "quiet small", lang=w.language_of(reason)
                )

    def leave(self) -> None:
        """Draw the program instead of a strategy, unless the page shows a different job."""
        if self._shown and self.view.job == self._job:
            self._draw_strategy("")
        self._shown = ""

    def _draw_row(self, row: dict[str, Any], drawn: bool) -> None:
        name = row["strategy"]
        words = f"{name}\u00a0✓" if row["chosen"] else name
        with box("tr"):
            with box("th", scope="row"):
                if drawn:
                    show = lambda: self._draw_strategy("" if self._shown == name else name)  # noqa: E731
                    self._buttons[name] = button(words, show, "small", aria_pressed="false")
                else:
                    text("span", words)
            for cell in _figure_texts(row):
                text("td", cell, "n")

    def _draw_strategy(self, name: str) -> None:
        """Draw the toolpath of a strategy. If `name` is empty, draw the program before and after."""
        self._shown = name
        canvas, history = self.page.run.canvas, self.view.studio.history
        layers = {"after": f"way-{name}"} if name else {"before": "scene-before", "after": "scene-after"}
        canvas.hide("before")
        for layer, artefact in layers.items():
            kept = history.artefact(self._job, artefact)
            if kept is not None:
                canvas.show(kept.data, layer)
        for strategy, strategy_button in self._buttons.items():
            strategy_button.props(f'aria-pressed="{"true" if strategy == name else "false"}"')


def _figure_texts(row: dict[str, Any]) -> tuple[str, ...]:
    if "refused" in row:
        return ("–",) * len(_FIGURES)
    return (
        format_length(row["feed_mm"] + row["rapid_mm"]),
        f"{row['retracts']:,}",
        f"{row['uncovered_percent']:.2f}",
        clock_text(row["time_s"]),
    )
