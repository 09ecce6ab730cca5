"""Many jobs are sent in pages, found by their words, compared in pairs, and wait in a custom order."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest
from nicegui.client import Client
from nicegui.page import page as page_of

from leafcut.studio.jobs import jobs as room
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.run_job import JobResult
from leafcut.studio.jobs.task import ReadyTask, Task
from leafcut.studio.jobs.workers import StudioWork
from leafcut.studio.page.job_words import search_terms
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_jobs import MAX_ROWS, JobsPanel, compared_figures, compared_options
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words

EN, ES = words("en"), words("es")


def noted(studio: Studio, count: int, **options: Any) -> None:
    """Put jobs into the history as if they had run."""
    for k in range(count):
        task = Task("optimize", ("example:plate-10",), options=dict(options))
        studio.history.add(f"job-{k:04}", f"plate_{k}.dxf", task, 1e9 + k)
        studio.history.finish(
            f"job-{k:04}", JobState.DONE, figures={"before_s": 9.0, "after_s": 7.0, "saved_percent": 22.2}
        )


def rows(panel: JobsPanel) -> list[Any]:
    return [e for e in panel.place.descendants() if str(e.props.get("data-focus", "")).startswith("job-")]


def test_the_list_shows_one_page_of_many_jobs_and_reaches_all(studio: Studio) -> None:
    count = 2 * MAX_ROWS
    noted(studio, count)
    page: Any = SimpleNamespace(open_job=lambda job: None)
    with Client(page_of("/")):
        panel = JobsPanel(View(studio, EN), page)
        panel.draw()
        seen: list[str] = []
        for _ in range(2):
            shown = [row.props["data-focus"] for row in rows(panel)]
            assert len(shown) == MAX_ROWS
            seen += shown
            panel._turn_page(panel._skip + MAX_ROWS, count)
        assert seen == [f"job-job-{k:04}" for k in reversed(range(count))]
        small = len(list(panel.place.descendants()))
        panel._search(SimpleNamespace(args="plate_27"))
        assert [row.props["data-focus"] for row in rows(panel)] == [
            f"job-job-{k:04}" for k in reversed(range(count)) if f"plate_{k}".startswith("plate_27")
        ]
        assert len(list(panel.place.descendants())) < small
    assert studio.jobs.find((), MAX_ROWS, count - 10)[1] == count


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", {"job-0000", "other"}),
        ("other", {"other"}),
        ("PLATE_0", {"job-0000"}),
        ("thickness", {"job-0000"}),
        ("3/8", {"job-0000"}),
        ("2001-09-09", {"job-0000", "other"}),
        ("2001-09-09 done", {"job-0000"}),
        ("failed", {"other"}),
        ("tool diameter", {"other"}),
        ("100%", set()),
        ("plate_", {"job-0000"}),
        ("'; --", set()),
    ],
)
def test_a_job_is_found_by_its_name_its_day_its_options_and_how_it_ended(
    studio: Studio, text: str, found: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TZ", "UTC")
    noted(studio, 1, thickness='3/8"')
    studio.history.add("other", "other.svg", Task("optimize", ("example:plate-27",), "pocket"), 1e9 + 60)
    studio.history.finish("other", JobState.FAILED, line="pockets need the end mill; give “Tool diameter”")
    records, count = studio.jobs.find(search_terms(text, EN), 50)
    assert ({record.id for record in records}, count) == (found, len(found))


@pytest.mark.parametrize("text", ["algorithm", "run", "origin", "option", "put", "Origin", "false"])
def test_a_job_is_not_found_by_a_word_that_only_its_storage_has(studio: Studio, text: str) -> None:
    noted(studio, 1, header=False)
    assert studio.jobs.find(search_terms(text, EN), 50)[1] == 0


def test_a_job_is_found_by_letters_beyond_ascii_and_by_what_is_in_a_list(studio: Studio) -> None:
    noted(studio, 1, machine="mine:fräse", tools=["6mm", "größe"])
    assert [studio.jobs.find(search_terms(text, EN), 50)[1] for text in ("fräse", "größe", "plasma")] == [1, 1, 0]


def test_jobs_are_found_by_the_words_of_the_language_that_is_spoken(studio: Studio) -> None:
    noted(studio, 2, kerf="1.5")
    assert studio.jobs.find(search_terms("sangría", ES), 50)[1] == 2
    assert studio.jobs.find(search_terms(ES("state.done"), ES), 50)[1] == 2
    assert studio.jobs.find(search_terms("sangría", EN), 50)[1] == 0


def test_what_two_jobs_have_in_common_is_told_apart_from_what_differs(studio: Studio) -> None:
    answers = (
        {"before": {"time_s": 9.0}, "after": {"time_s": 7.0, "travel_mm": 5.0}, "machine": "haas-vf2", "seed": 1},
        {"before": {"time_s": 9.0}, "after": {"time_s": 6.0, "travel_mm": 5.0}, "machine": "haas-vf2"},
    )
    found = {row.label: row for row in compared_figures(answers, EN)}
    assert {label for label, row in found.items() if row.differs} == {"leafcut", "Seed"}
    assert (found["leafcut"].one, found["leafcut"].other) == ("7.00 s", "6.00 s")
    assert (found["Seed"].one, found["Seed"].other) == ("1", "–")
    noted(studio, 1, thickness="6mm", header=False)
    studio.history.add(
        "other", "b", Task("optimize", ("example:plate-10",), options={"thickness": "6mm", "peck": "2"}), 2e9
    )
    records = studio.jobs.record("job-0000"), studio.jobs.record("other")
    assert records[0] is not None and records[1] is not None
    rows_of = {row.label: row for row in compared_options((records[0], records[1]), studio.folder, EN)}
    assert set(rows_of) == {"Thickness", "Peck depth", "Header"}
    assert not rows_of["Thickness"].differs
    assert (rows_of["Peck depth"].one, rows_of["Peck depth"].other) == ("no pecking", "2\u00a0mm")
    assert (rows_of["Header"].one, rows_of["Header"].other) == ("off", "on")


def test_of_a_job_without_a_machine_the_one_of_its_work_is_told(studio: Studio) -> None:
    for name, options in (("cut", {}), ("other", {"machine": "haas-vf2"})):
        studio.history.add(name, name, Task("optimize", ("example:plate-10",), "cut", options), 1e9)
    records = studio.jobs.record("cut"), studio.jobs.record("other")
    assert records[0] is not None and records[1] is not None
    (row,) = compared_options((records[0], records[1]), studio.folder, EN)
    assert (row.one, row.other) == ("plasma-table", "haas-vf2")


def test_jobs_that_wait_come_to_their_turn_in_the_order_that_was_given_them(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    go, began = threading.Semaphore(0), []

    def held(_work: StudioWork, _run: Any, call: ReadyTask, *_: Any, **__: Any) -> JobResult:
        began.append(call.options["seed"])
        go.acquire()
        return JobResult({}, {}, {})

    monkeypatch.setattr(StudioWork, "run", held)
    jobs = [
        studio.jobs.start(Task("optimize", ("example:plate-10",), options={"depth": "3", "seed": k}))
        for k in range(room.AT_ONCE + 4)
    ]
    first, second, third, fourth = jobs[room.AT_ONCE :]
    from waiting import until

    until(lambda: len(began) == room.AT_ONCE)
    assert studio.jobs.waiting_ids() == [first, second, third, fourth]
    studio.jobs.move_in_queue(fourth, 0)
    studio.jobs.move_in_queue(first, 2)
    studio.jobs.move_in_queue(jobs[0], 0)  # it runs: nothing happens
    assert studio.jobs.waiting_ids() == [fourth, second, first, third]
    studio.jobs.cancel(second)
    assert studio.jobs.wait(second, 120) is JobState.CANCELLED
    for count in range(3):
        go.release()
        until(lambda count=count: len(began) == room.AT_ONCE + count + 1)
    assert began[room.AT_ONCE :] == [room.AT_ONCE + k for k in (3, 0, 2)]
    go.release(room.AT_ONCE)
    assert all(studio.jobs.wait(job, 120).is_over for job in jobs)
    assert studio.jobs.waiting_ids() == []
