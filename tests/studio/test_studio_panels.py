"""Parts of the page, without a browser."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from nicegui.client import Client
from nicegui.page import page as page_of

from leafcut.studio.page_state import View
from leafcut.studio.panel_result import ResultPanel
from leafcut.studio.studio import Studio
from leafcut.studio.task import Task
from leafcut.studio.wording import words


def test_an_outcome_is_shown_once_the_page_knows_that_the_run_is_over(studio: Studio) -> None:
    """Not before: the end of the run on the page takes away what was begun with the outcome, and what is told."""
    plate = Path(__file__).parents[2] / "examples" / "plate_10.dxf"
    source = studio.folder.add_input("plate.dxf", plate.read_bytes())
    job = studio.jobs.start(Task("optimize", (source,), options={"thickness": "6", "preset": "fast"}))
    studio.jobs.wait(job, 60)
    page: Any = SimpleNamespace(run=SimpleNamespace(watching=True))
    with Client(page_of("/")):
        view = View(studio, words("en"))
        view.job = job
        panel = ResultPanel(view, page)
        shown = [e.props.get("id") for e in panel.place.descendants()]
        assert "result-panel" not in shown
        page.run.watching = False
        panel.draw()
        assert "result-panel" in [e.props.get("id") for e in panel.place.descendants()]
