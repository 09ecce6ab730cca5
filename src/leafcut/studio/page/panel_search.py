"""The searches of a run: a chart per search, the workers, and the messages."""

from __future__ import annotations

import json
from typing import Any

from leafcut.model.study import Iteration
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.search_watch import thinned
from leafcut.studio.page.charts import Chart, SwitchedChart, bar_chart, convergence_chart, learning_chart
from leafcut.studio.page.elements import box, button, link, text
from leafcut.studio.page.page_state import View

_MAX_POINTS, _MAX_WORKERS = 600, 64


def draw_searches(view: View, record: JobRecord, answer: dict[str, Any]) -> None:
    """Show the charts of a run's searches, and the workers."""
    kept = view.studio.history.artefact(record.id, "search")
    for search in json.loads(kept.data) if kept is not None else []:
        if search.get("iterations"):
            _learning(view, record, search)
            continue
        text("h3", search["name"])
        if search["history"]:
            words = view.words.section("chart")
            Chart("chart tall").show(*convergence_chart(search["history"], search["bound"], search["unit"], words))
    _workers(view, answer)


def _learning(view: View, record: JobRecord, search: dict[str, Any]) -> None:
    w = view.words
    with box("section"):
        with box("div", "chart-head"):
            text("h3", search["name"])
            button("PNG", None, "small plain", title=w("chart.png"), data_picture=f"{record.id}.png")
            files = view.studio.history.artefacts(record.id)
            if "iterations" in files:
                address = f"/api/jobs/{record.id}/files/iterations"
                link("CSV", address, "button small plain", download=files["iterations"], title=files["iterations"])
        rows, words = thinned(search["iterations"], _MAX_POINTS), w.section("chart")
        SwitchedChart(words, "chart learned").show(
            lambda by: learning_chart(rows, search["bound"], search["unit"], words, by)
        )
    last = Iteration(*search["iterations"][-1])
    if last.branching is not None:
        text("p", w("lesson.branching", factor=f"{last.branching:.2f}"), "quiet small")


def _workers(view: View, answer: dict[str, Any]) -> None:
    w = view.words
    workers = [row for row in answer.get("workers", []) if row["ants"]][:_MAX_WORKERS]
    if not workers:
        return
    best = min(row["best"] for row in workers)
    text("h3", w("result.workers"))
    rows = (
        (
            f"{w('canvas.worker')} {row['worker']}",
            row["seconds"],
            w("result.ants", number=f"{row['ants']:,}", seconds=f"{row['seconds']:.2f}"),
            row["best"] <= best,
        )
        for row in workers
    )
    bar_chart(box("div"), rows)
