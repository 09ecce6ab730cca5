"""The choices of a page are stored as plain values; damaged entries are ignored."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from nicegui.client import Client
from nicegui.page import page as page_of

from leafcut.studio.drawing.editing import CutOrder, HoleOrder
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.task import Task
from leafcut.studio.page.form_values import Setter
from leafcut.studio.page.headline import saving_headline
from leafcut.studio.page.memory import kept_state, restore_choices
from leafcut.studio.page.page_state import View
from leafcut.studio.page.pages import Page
from leafcut.studio.page.stale_mark import changed_choices
from leafcut.studio.recent_files import MAX_RECENT, RecentFiles
from leafcut.studio.studio import Studio, open_studio
from leafcut.studio.wording import words

PLATE = Path(__file__).parents[2] / "examples" / "plate_10.dxf"


def view_with_everything(studio: Studio) -> View:
    """Return a view in which every value differs from the initial one."""
    source = studio.folder.add_input("plate.dxf", PLATE.read_bytes())
    job = studio.jobs.start(Task("optimize", (source,), options={"thickness": "6", "preset": "fast"}))
    view = View(studio, words("en"))
    view.source, view.name, view.origin = source, "plate.dxf", f"{job}/1/1"
    view.second, view.second_name = source, "other.nc"
    view.parts, view.part_names = [WantedPart(source, 3, "0 90")], {source: "plate.dxf"}
    view.sheet, view.work, view.process, view.pace, view.job = (2, 1), "cut", "plasma", "5", job
    view.table.set_value("thickness", "thick")
    view.table.set_value("machine", "laser-table")
    view.table.set_value("quantity", "4", setter=Setter.INPUT)
    return view


def test_what_is_kept_of_a_page_is_chosen_again_as_it_was(studio: Studio) -> None:
    view = view_with_everything(studio)
    state = kept_state(view, "search", {"job": view.job, "state": []})
    other = View(studio, words("en"))
    restore_choices(other, json.loads(json.dumps(state)))
    assert kept_state(other, "search", {"job": view.job, "state": []}) == state
    for name in (
        "source",
        "name",
        "second",
        "second_name",
        "parts",
        "part_names",
        "origin",
        "sheet",
        "work",
        "process",
        "table",
        "errors",
        "job",
        "pace",
    ):
        assert getattr(other, name) == getattr(view, name), name
    assert other.errors["thickness"]


@pytest.mark.parametrize(
    "plain",
    [
        {},
        {"source": 3, "table": [], "parts": "abc", "sheet": 7, "work": "none", "edit": []},
        {"table": {"no_option": ["1", "person", "", ""], "thickness": {"a": 1}}, "parts": [3, "x:many"], "pace": "9"},
        {
            "work": ["drill"],
            "process": {},
            "pace": [],
            "table": {"seed": ["1", "x", "", ""]},
            "sheet": ["a"],
            "job": "../../x",
        },
    ],
)
def test_what_is_damaged_of_a_page_is_as_if_it_had_not_been_chosen(studio: Studio, plain: dict[str, object]) -> None:
    view = View(studio, words("en"))
    restore_choices(view, plain)
    assert (view.work, view.process, view.pace, view.job, view.values, view.parts) == (
        "drill",
        "auto",
        "full",
        None,
        {},
        [],
    )


def test_what_lies_damaged_of_recent_files_stops_nothing(tmp_path: Path) -> None:
    root = tmp_path / "studio"
    root.mkdir()
    (root / "recent.json").write_text(
        '[1, {"source": "example:plate-27"}, {"source": "x", "name": "y", "opened": "z"}]'
    )
    studio = open_studio(root)
    assert studio.recent.newest() == []
    studio.jobs.close()
    studio.history.close()


def test_recent_files_are_told_once_and_no_more_than_some_and_what_is_gone_is_not(studio: Studio) -> None:
    folder, recent = studio.folder, studio.recent
    one = folder.add_input("plate.dxf", b"0\nEOF\n")
    recent.add(one, "plate.dxf")
    recent.add("example:plate-27", "plate-27")
    same = folder.add_input("plate.dxf", b"0\nEOF\n")
    recent.add(same, "plate.dxf")
    assert [row.source for row in recent.newest()] == [same, "example:plate-27"]
    recent.add(folder.add_input("plate.dxf", b"another"), "plate.dxf")
    assert [row.name for row in recent.newest()] == ["plate.dxf", "plate.dxf", "plate-27"]
    folder.delete_inputs([same])
    assert [row.name for row in recent.newest()] == ["plate.dxf", "plate-27"]
    for k in range(MAX_RECENT + 3):
        recent.add(f"random:{k + 5}:1", f"random:{k + 5}:1")
    assert len(RecentFiles(folder).newest()) == MAX_RECENT
    recent.clear()
    assert recent.newest() == []


def test_what_a_page_or_the_recent_files_have_stays_when_its_job_is_forgotten(studio: Studio) -> None:
    made = [studio.folder.add_input(f"plate{k}.dxf", PLATE.read_bytes()) for k in range(3)]
    jobs = [studio.jobs.start(Task("optimize", (one,), options={"thickness": "6", "preset": "fast"})) for one in made]
    with Client(page_of("/")):
        page = Page(studio, words("en"))
        page.build()
        page.view.switch_input(made[0], "plate0.dxf")
        studio.recent.add(made[1], "plate1.dxf")
        for job in jobs:
            studio.jobs.cancel(job)
            studio.jobs.wait(job, 60)
            studio.jobs.delete(job)
        assert [(studio.folder.inputs / one).is_dir() for one in made] == [True, True, False]


def test_an_order_that_was_put_away_is_gone_on_with_and_that_of_other_stops_is_not() -> None:
    xy = np.array([[0, 0], [1, 0], [2, 0], [3, 0]], dtype=np.float64)
    order = HoleOrder({0: (0, 1, 2), 1: (3,)}, xy)
    order.move_to_end(3, True)
    order.reverse(1)
    order.undo()
    plain = json.loads(json.dumps(order.as_plain()))
    again = HoleOrder({0: (0, 1, 2), 1: (3,)}, xy)
    assert not again.changed
    again.restore_plain(plain)
    assert (again.file_text(), again.changed) == (order.file_text(), True)
    assert again.redo()
    assert again.undo()
    assert again.undo()
    assert not again.undo()
    assert not again.changed
    for wrong in ({}, {**plain, "state": [[[0, 1, 9], 3], [[3], 1]]}, {**plain, "before": 7}, {"state": "x"}):
        other = HoleOrder({0: (0, 1, 2), 1: (3,)}, xy)
        other.restore_plain(wrong)
        assert not other.changed
    cuts = {"cuts": [{"contours": [k], "start": [k, 0], "fixed": [], "direction": "clockwise"} for k in range(3)]}
    plan = CutOrder(json.dumps(cuts))
    plan.move(3, 1)
    same = CutOrder(json.dumps(cuts))
    same.restore_plain(json.loads(json.dumps(plan.as_plain())))
    assert same.file_text() == plan.file_text()


def test_only_what_means_something_else_is_told_as_different(studio: Studio) -> None:
    source = studio.folder.add_input("plate.dxf", PLATE.read_bytes())
    task = Task("optimize", (source,), options={"thickness": "6", "preset": "fast"})
    job = studio.jobs.start(task)
    studio.jobs.cancel(job)
    studio.jobs.wait(job, 60)
    record = studio.jobs.record(job)
    assert record is not None
    view = View(studio, words("en"), source=source, name="plate.dxf")
    view.table.set_value("thickness", "0.6cm")
    view.table.set_value("preset", "fast")

    def told() -> list[str]:
        return [one.line(view.words).replace("\u00a0", " ") for one in changed_choices(as_record(record), view)]

    assert told() == []
    view.table.set_value("pixel_size", "0.1")  # means nothing to holes
    assert told() == []
    view.table.set_value("thickness", "25")
    view.table.set_value("strict", True)
    assert told() == ["Thickness 6 mm; now 25 mm", "Strict checks off; now on"]
    view.table.set_value("strict", False)
    view.table.set_value("thickness", "")
    assert told() == ["Thickness 6 mm; now unknown"]
    view.table.set_value("thickness", "6mm")
    view.source = studio.folder.add_input("other.dxf", b"0")
    assert told() == ["Part plate.dxf; now other.dxf"]
    view.source, view.work = source, "cut"
    assert told() == ["Work Drill the holes; now Cut from sheet"]
    view.work, view.edited = "drill", True
    assert told() == ["Order as found; now edited by hand"]


def as_record(record: JobRecord | None) -> JobRecord:
    """Return a job that is there."""
    assert record is not None
    return record


def test_a_program_that_stays_as_long_says_why_in_place_of_nothing_saved() -> None:
    w = words("en")
    answer = {
        "before": {"time_s": 12.5}, "after": {"time_s": 12.5}, "saved_percent": 0.0, "counts": {"pieces": 2},
        "staying": [{"count": 2, "reason": "only", "first_line": 3, "word": ""}],
    }  # fmt: skip
    found = saving_headline(answer, w)
    assert (found.large, found.kind) == ("2 of 2 sections stay: nothing to reorder it with", "same")
    assert saving_headline({**answer, "staying": []}, w).large == "Already in the best order found"


def test_the_large_figure_is_the_machine_time_as_in_the_player() -> None:
    w = words("en")
    answer = {"before": {"time_s": 1576.6}, "after": {"time_s": 1265.8}, "saved_percent": 19.7}
    found = saving_headline(answer, w)
    assert (found.large, found.kind) == ("21 min 06 s", "better")
    assert found.small == "5 min 11 s saved: 19.7 % less machine time"
    found = saving_headline({**answer, "after": {"time_s": 1639.7}, "saved_percent": -4.0}, w)
    assert (found.large, found.kind) == ("27 min 20 s", "worse")
    assert found.small == "1 min 03 s longer: 4.0 % more machine time"


def test_what_was_said_of_local_search_holds_when_the_page_comes_back(studio: Studio) -> None:
    """Ants were chosen for a map, and local search was turned on again; then another page stood here for a while."""
    view = View(studio, words("en"), source="random:50:1", name="random", work="solve")
    view.table.set_value("algorithm", "mmas")
    view.turn_off_local_search_for_study()
    assert view.values["local_search"] is False
    view.table.set_value("local_search", True)
    state = kept_state(view, "summary", None)
    view.work = "drill"
    view.table.clear()
    view.turn_off_local_search_for_study()
    restore_choices(view, state)
    view.turn_off_local_search_for_study()
    assert "local_search" not in view.values
