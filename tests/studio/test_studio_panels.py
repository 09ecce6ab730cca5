"""Parts of the page, without a browser."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from nicegui.client import Client
from nicegui.page import page as page_of

from leafcut.message import Message
from leafcut.studio.drawing.editing import HoleOrder
from leafcut.studio.jobs.history import Artefact, JobState
from leafcut.studio.jobs.jobs import LiveJob
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.task import Task, resolve_task
from leafcut.studio.jobs.workers import StudioWork
from leafcut.studio.page.elements import box
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_edit import EditPanel
from leafcut.studio.page.panel_input import InputPanel
from leafcut.studio.page.panel_nest import NestPanel
from leafcut.studio.page.panel_parts import PartsPanel
from leafcut.studio.page.panel_result import ResultPanel, TriedPanel
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words


def test_an_outcome_is_shown_once_the_page_knows_that_the_run_is_over(studio: Studio) -> None:
    """Not earlier: the end of the run on the page removes elements and messages created with the outcome."""
    plate = Path(__file__).parents[2] / "examples" / "plate_10.dxf"
    source = studio.folder.add_input("plate.dxf", plate.read_bytes())
    job = studio.jobs.start(Task("optimize", (source,), options={"thickness": "6", "preset": "fast"}))
    studio.jobs.wait(job, 60)
    page: Any = SimpleNamespace(
        run=SimpleNamespace(watching=True, show_outdated_notice=lambda _: None),
        input=SimpleNamespace(request_run=lambda: None),
    )
    with Client(page_of("/")):
        view = View(studio, words("en"))
        view.job = job
        panel = ResultPanel(view, page)
        shown = [e.props.get("id") for e in panel.place.descendants()]
        assert "result-panel" not in shown
        page.run.watching = False
        panel.draw()
        assert "result-panel" in [e.props.get("id") for e in panel.place.descendants()]


def test_a_result_of_a_command_of_an_earlier_version_is_named_and_its_files_remain(studio: Studio) -> None:
    source = studio.folder.add_input("map.csv", b"0,0")
    job = "abcdefghijkl"
    studio.history.add(job, "map", Task("study", (source,)), 1e9)
    tour = Artefact("map.tour", "text/plain", b"1")
    studio.history.finish(job, JobState.DONE, answer={"runs": []}, artefacts={"tour": tour})
    page: Any = SimpleNamespace(run=SimpleNamespace(watching=False, show_outdated_notice=lambda _: None))
    with Client(page_of("/")):
        view = View(studio, words("en"))
        view.job, view.source, view.work = job, source, "solve"
        texts = [getattr(e, "text", "") for e in ResultPanel(view, page).place.descendants()]
    assert {words("en")("result.unknown"), words("en")("file.tour")} <= set(texts)


def test_of_what_is_tried_the_least_cost_is_the_best_so_far_and_what_is_not_over_is_told_so(studio: Studio) -> None:
    live = LiveJob(
        "a",
        resolve_task(Task("optimize", ("example:plate-27",)), studio.folder),
        ("plate-27",),
        StudioWork(studio.workers),
    )
    live.tried = {"zigzag": ("52.0 s", 52.0), "shapes 3": ("41.2 s", 41.2), "ants": ("", None), "adaptive": ("–", None)}
    with Client(page_of("/")):
        panel = TriedPanel(words("en"), live)
        rows = [
            [getattr(part, "text", "") for part in row.descendants()]
            for row in panel.place.descendants()
            if row.tag == "li"
        ]
    assert rows == [
        ["zigzag", "52.0 s"],
        ["by shapes · 3", "best so far", "41.2 s"],
        ["ants", "trying …"],
        ["adaptive", "–"],
    ]


def test_run_that_was_pressed_for_one_input_does_not_begin_another(studio: Studio) -> None:
    """The user had not seen the other input when pressing Run."""
    with Client(page_of("/")):
        view = View(studio, words("en"))
        panel = InputPanel.__new__(InputPanel)
        panel.view, panel.page = (
            view,
            SimpleNamespace(run=SimpleNamespace(running=False), show_message=lambda *_, **__: None),
        )
        panel.reading, panel._run_wanted = True, False
        panel.request_run()
        assert panel._run_wanted
        panel.open("example:plate-27", "").close()
        assert not panel._run_wanted


def nothing(*_: Any, **__: Any) -> None:
    """Stand for a part of the page that is not looked at."""


def test_a_drag_that_cannot_be_done_says_why_and_a_button_without_a_stop_asks_for_one(studio: Studio) -> None:
    """A drag does not select a stop: its message is about the drag."""
    said: list[str] = []
    page: Any = SimpleNamespace(show_message=lambda line, *_: said.append(line), store_changed_choices=nothing)
    names = ("select", "select_stop", "clear_selection", "set_editable", "show", "hide")
    canvas: Any = SimpleNamespace(**dict.fromkeys(names, nothing))
    with Client(page_of("/")):
        panel = EditPanel(View(studio, words("en")), page, canvas)
        panel._open(HoleOrder({0: (0, 1), 1: (2,)}, np.zeros((3, 2))))
        for args in ({"number": 1, "onto": 3}, {"number": 1, "onto": None, "to": [5, 5]}):
            panel.drag(SimpleNamespace(args=args))  # type: ignore[arg-type]
        assert [line.partition(";")[0] for line in said] == [
            "these holes use different tools",
            "hole positions are fixed",
        ]
        panel._change_chosen_stop(lambda edited: edited.reverse(0))
        assert said[2:] == [words("en")("edit.choose")]


def test_a_row_of_parts_that_is_removed_twice_takes_no_other_with_it(studio: Studio) -> None:
    part: Any = SimpleNamespace(draw=nothing)
    page: Any = SimpleNamespace(input=part, run=part, result=part)
    with Client(page_of("/")):
        view = View(studio, words("en"))
        view.parts = [WantedPart("a"), WantedPart("b"), WantedPart("c")]
        panel = PartsPanel(view, page)
        panel.draw()
        row = panel.rows.props["rows"][1]["id"]
        panel._remove_part(row)
        panel._remove_part(row)
        panel._change_part(row, "quantity", "7")
        assert view.parts == [WantedPart("a"), WantedPart("c")]


def test_why_a_sheet_could_not_be_cut_is_said_in_the_language_of_the_page(studio: Studio) -> None:
    line = Message("there are no parts to nest; open their drawings")
    variant = {"method": "rectangles", "seed": 1, "utilisation_of_used_percent": 50.0, "sheets": 1, "layouts": []}
    row = {"state": "failed", "line": line, "time_s": None, "quickest": False, "jobs": []}
    page: Any = SimpleNamespace()
    with Client(page_of("/")):
        panel = NestPanel(View(studio, words("es")), page)
        panel._answer, panel._rows = {"variants": [{**variant, "cost": None, "unplaced": {}}]}, [row]
        panel.variants = box()
        panel._draw_variants()
        shown = [str(getattr(e, "text", "")) + str(e.props.get("title")) for e in panel.variants.descendants()]
    assert sum(words("es").translate_for_page(line) in one for one in shown) == 2
    assert not any(line in one for one in shown)
