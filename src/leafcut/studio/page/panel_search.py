"""Searches of a run: a chart of each, its workers, and its messages."""

from __future__ import annotations

import json
from typing import Any

from leafcut.model.study import Iteration
from leafcut.studio.drawing.canvas import Bars, Convergence
from leafcut.studio.drawing.charts import Learning
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.search_watch import thinned
from leafcut.studio.page.elements import box, button, link, text
from leafcut.studio.page.page_state import View

_MAX_POINTS, _MAX_WORKERS = 600, 64


def draw_searches(view: View, record: JobRecord, answer: dict[str, Any]) -> None:
    """Show the charts of a run's searches, and its workers."""
    kept = view.studio.history.artefact(record.id, "search")
    for search in json.loads(kept.data) if kept is not None else []:
        if search.get("iterations"):
            _learning(view, record, search)
            continue
        text("h3", search["name"])
        chart = Convergence(words=view.words.section("canvas"))
        chart.classes("chart tall")
        chart.set(search["history"], search["bound"], search["unit"])
    _workers(view, answer)


def _learning(view: View, record: JobRecord, search: dict[str, Any]) -> None:
    w = view.words
    with box("section"):
        with box("div", "chart-head"):
            text("h3", search["name"])
            button("PNG", lambda: chart.save(f"{record.id}.png"), "small plain", title=w("study.png"))
            files = view.studio.history.artefacts(record.id)
            if "iterations" in files:
                address = f"/api/jobs/{record.id}/files/iterations"
                link("CSV", address, "button small plain", download=files["iterations"], title=files["iterations"])
        chart = Learning(w.section("chart"))
        chart.classes("chart learned")
        chart.set(thinned(search["iterations"], _MAX_POINTS), search["bound"], search["unit"])
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
    Bars().set(
        [
            {
                "name": f"{w('canvas.worker')} {row['worker']}",
                "value": row["seconds"],
                "note": w("result.ants", number=f"{row['ants']:,}", seconds=f"{row['seconds']:.2f}"),
                "best": row["best"] <= best,
            }
            for row in workers
        ]
    )
