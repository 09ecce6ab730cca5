"""The result of a study: distribution of each algorithm's tour lengths, learning curves, and files."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.page.charts import Chart, SwitchedChart, box_plots, boxes_style, run_curves
from leafcut.studio.page.elements import box, button, link, table, text
from leafcut.studio.page.page_state import View
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

_LENGTHS = ("best", "mean", "standard_deviation", "worst")


class StudyPanel:
    """The result of a study, narrow in its column and wide in a dialog."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page

    def draw(self, record: JobRecord, answer: dict[str, Any]) -> None:
        """Show the result of a study in the current container."""
        w = self.view.words
        best = min(answer["runs"], key=lambda run: run["length"])
        text("p", _length(best["length"], _decimals(answer)), "headline")
        text("p", w("study.won", algorithm=best["algorithm"], seed=best["seed"]), "under")
        goal = answer["optimum"] or answer["lower_bound"]
        if goal and best["length"] >= goal > 0:
            percent = f"{100 * (best['length'] / goal - 1):.3f}"
            text("p", w("result.gap_optimum" if answer["optimum"] else "result.gap", percent=percent), "quiet")
        if answer["stopped_early"]:
            text("p", w("study.stopped", number=len(answer["runs"])), "hint")
        with box("section"):
            self._head(w("study.lengths"), f"{answer['instance']}_lengths.png")
            self._boxes(answer)
        self._lengths(answer)
        curves = self._curves(record)
        with box("section"):
            self._head(w("study.curves"), f"{answer['instance']}_runs.png")
            self._runs(answer, curves)
        self._effort(answer)
        self._files(record)
        self._large(answer, curves)

    def _boxes(self, answer: dict[str, Any]) -> None:
        chart = Chart("chart boxes")
        chart.place.style(boxes_style(answer["algorithms"]))
        chart.show(*box_plots(answer["algorithms"], _bound(answer), self._chart_words(answer)))

    def _runs(self, answer: dict[str, Any], curves: list[dict[str, Any]]) -> None:
        words = self._chart_words(answer)
        SwitchedChart(words, "chart study-runs").show(lambda by: run_curves(curves, _bound(answer), words, by))

    def _head(self, title: str, name: str) -> None:
        w = self.view.words
        with box("div", "chart-head"):
            text("h3", title)
            button("PNG", None, "small plain", aria_label=f"{title}: PNG", title=w("study.png"), data_picture=name)

    def _lengths(self, answer: dict[str, Any]) -> None:
        w, decimals = self.view.words, _decimals(answer)
        rows = [[row["algorithm"], *(_length(row[key], decimals) for key in _LENGTHS)] for row in answer["algorithms"]]
        table([("", ""), *((w(f"study.{key}"), "n") for key in _LENGTHS)], rows, w("study.lengths"))

    def _effort(self, answer: dict[str, Any]) -> None:
        w = self.view.words
        table(
            [("", ""), *((w(f"study.{key}"), "n") for key in ("runs", "iterations", "seconds"))],
            [[row["algorithm"], *_effort_cells(row)] for row in answer["algorithms"]],
            w("study.effort"),
        )

    def _files(self, record: JobRecord) -> None:
        w = self.view.words
        files = self.view.studio.history.artefacts(record.id)
        with box("div", "files"):
            for name in ("runs", "comparison"):
                address = f"/api/jobs/{record.id}/files/{name}"
                link(w(f"study.{name}_csv"), address, "button small", download=files[name], title=files[name])
            button(w("study.enlarge"), None, "small", data_dialog="study-large")

    def _large(self, answer: dict[str, Any], curves: list[dict[str, Any]]) -> None:
        w, decimals = self.view.words, _decimals(answer)
        with box("dialog", "study-large", id="study-large", aria_label=w("study.title")):
            text("h2", f"{w('study.title')}: {answer['instance']}")
            with box("div", "study-charts"):
                self._runs(answer, curves)
                self._boxes(answer)
            keys = (*_LENGTHS, "median", "runs", "iterations", "seconds")
            rows = [
                [row["algorithm"], *(_length(row[key], decimals) for key in (*_LENGTHS, "median")), *_effort_cells(row)]
                for row in answer["algorithms"]
            ]
            table([("", ""), *((w(f"study.{key}"), "n") for key in keys)], rows, w("study.title"))
            button(w("help.close"), None, "", data_close="")

    def _chart_words(self, answer: dict[str, Any]) -> dict[str, str]:
        w = self.view.words
        return {**w.section("chart"), **({"bound": w("result.optimum")} if answer["optimum"] else {})}

    def _curves(self, record: JobRecord) -> list[dict[str, Any]]:
        kept = self.view.studio.history.artefact(record.id, "curves")
        return [] if kept is None else list(json.loads(kept.data))


def _bound(answer: dict[str, Any]) -> float | None:
    bound: float | None = answer["optimum"] or answer["lower_bound"]
    return bound


def _decimals(answer: dict[str, Any]) -> int:
    """Return the number of decimals for lengths: none for a large map, one or two for a small map."""
    best = min(run["length"] for run in answer["runs"])
    return 2 if best < 1e3 else 1 if best < 1e5 else 0


def _length(value: float | None, decimals: int) -> str:
    return "–" if value is None else f"{value:,.{decimals}f}"


def _effort_cells(row: dict[str, Any]) -> list[str]:
    return [f"{row['runs']:,}", f"{row['iterations']:,.4g}", format_time(row["seconds"])]
