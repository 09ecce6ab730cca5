"""Orders edited in the studio: each change can be undone, and the program follows the edited order."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from leafcut.errors import OptionError
from leafcut.read.order_file import load_order
from leafcut.studio.drawing.editing import CutOrder, HoleOrder, OrderStop, has_only_single_cuts
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.task import Task
from leafcut.studio.page.panel_edit import can_be_edited, load_edited_order
from leafcut.studio.studio import Studio

XY = np.array([[10.0 * k, 0.0] for k in range(5)])
CUT = {"start": [0.0, 0.0], "direction": "clockwise", "fixed": []}
PLAN = json.dumps({"leafcut_plan": 1, "contours": [], "cuts": [{"contours": [k], **CUT} for k in (1, 2, 3)]})


def order_of(edited: HoleOrder, tmp_path: Path) -> dict[int, tuple[int, ...]]:
    file = tmp_path / "order.json"
    file.write_text(edited.file_text())
    return load_order(file).operations


def test_a_hole_takes_the_place_of_the_one_that_it_is_dropped_on(tmp_path: Path) -> None:
    edited = HoleOrder({0: (4, 2, 0, 1, 3)}, XY)
    edited.move(1, 3)  # stop 1 is hole 4, stop 3 is hole 0
    assert order_of(edited, tmp_path) == {0: (2, 0, 4, 1, 3)}
    edited.move(5, 2)  # as the drawing numbers them still: hole 3 onto hole 2
    assert order_of(edited, tmp_path) == {0: (3, 2, 0, 4, 1)}
    assert [stop.place[0] for stop in edited.stops()] == [30, 20, 0, 40, 10]
    assert [stop.name for stop in edited.stops()] == [5, 2, 3, 1, 4]


def test_changes_are_taken_back_and_made_again_until_another_is_made(tmp_path: Path) -> None:
    edited = HoleOrder({0: (0, 1, 2)}, XY)
    assert not edited.undo()
    edited.reverse(1)
    edited.move_to_end(1, True)
    assert order_of(edited, tmp_path) == {0: (0, 2, 1)}
    assert edited.undo()
    assert order_of(edited, tmp_path) == {0: (2, 1, 0)}
    assert edited.redo()
    assert not edited.redo()
    assert order_of(edited, tmp_path) == {0: (0, 2, 1)}
    assert edited.undo()
    edited.move_to_end(3, False)
    assert not edited.redo()
    assert order_of(edited, tmp_path) == {0: (1, 0, 2)}


def test_what_comes_after_a_hole_is_left_to_the_search(tmp_path: Path) -> None:
    edited = HoleOrder({0: (0, 1, 2), 1: (3, 4)}, XY)
    edited.fix_order_up_to(2)
    assert order_of(edited, tmp_path) == {0: (0, 1), 1: (3, 4)}
    assert [stop.held for stop in edited.stops()] == [True, True, False, True, True]


def test_a_hole_put_among_those_that_are_held_is_held_and_one_put_among_the_others_is_not(tmp_path: Path) -> None:
    edited = HoleOrder({0: (0, 1, 2, 3, 4)}, XY)
    edited.fix_order_up_to(2)
    edited.move_to_end(4, True)
    assert order_of(edited, tmp_path) == {0: (3, 0, 1)}
    edited.move(5, 1)
    assert order_of(edited, tmp_path) == {0: (3, 4, 0, 1)}
    edited.move(4, 3)
    assert order_of(edited, tmp_path) == {0: (4, 0, 1)}
    edited.move_to_end(2, False)
    assert order_of(edited, tmp_path) == {0: (4, 0, 2, 3, 1)}


@pytest.mark.parametrize(
    ("stop", "onto", "line"), [(1, 4, "different tools"), (9, 1, "not in the order"), (0, 1, "not in the order")]
)
def test_what_cannot_be_meant_changes_nothing(stop: int, onto: int, line: str) -> None:
    edited = HoleOrder({0: (0, 1, 2), 1: (3, 4)}, XY)
    before = edited.file_text()
    with pytest.raises(OptionError, match=line):
        edited.move(stop, onto)
    assert edited.file_text() == before
    assert not edited.undo()


def test_changes_of_a_plan_are_fixed_in_it_and_nothing_else() -> None:
    """A cut has its place in the order among all others: the order of all is fixed with it."""
    edited = CutOrder(PLAN)
    edited.move(3, 1)
    edited.reverse(2)
    edited.move_start(1, (5.0, 6.00049))
    cuts = json.loads(edited.file_text())["cuts"]
    assert [cut["contours"] for cut in cuts] == [[3], [1], [2]]
    assert [cut["fixed"] for cut in cuts] == [["order"], ["order", "start"], ["direction", "order"]]
    assert cuts[2]["direction"] == "counter-clockwise"
    assert cuts[1]["start"] == [5.0, 6.0]
    assert [stop.sign for stop in edited.stops()] == ["", "", "↺"]
    assert edited.stops()[1] == OrderStop(1, (5.0, 6.0), moved=True)
    for _ in range(3):
        assert edited.undo()
    assert json.loads(edited.file_text()) == json.loads(PLAN)


def test_what_is_left_to_the_search_comes_after_the_cuts_that_are_held() -> None:
    edited = CutOrder(PLAN)
    edited.move(3, 1)
    edited.fix_order_up_to(1)
    edited.fix_order_up_to(3)
    cuts = json.loads(edited.file_text())["cuts"]
    assert [(cut["contours"], cut["fixed"]) for cut in cuts] == [([3], ["ahead", "order"]), ([1], []), ([2], [])]
    assert [(stop.name, stop.held) for stop in edited.stops()] == [(3, True), (1, False), (2, False)]


def test_a_cut_put_first_is_cut_first_and_one_put_last_is_cut_last(studio: Studio) -> None:
    """The middle plate of three in a row moves to either end, so that the path gets longer."""
    rows = "".join(f'<rect x="{60 * k}" y="0" width="40" height="30" fill="none" stroke="black"/>' for k in range(3))
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="40mm" viewBox="0 0 200 40">{rows}</svg>'
    sheet = studio.folder.add_input("three.svg", svg.encode())
    options = {"thickness": "6mm", "iterations": "1", "bound": False}
    first = studio.jobs.start(Task("optimize", (sheet,), "cut", options))
    assert studio.jobs.wait(first, 90) is JobState.DONE, studio.jobs.record(first)
    for at in (0, -1):
        edited = load_edited_order(studio.history, first)
        assert edited is not None
        middle = json.loads(edited.file_text())["cuts"][1]["contours"]
        edited.move_to_end(2, at == 0)
        if at == 0:
            edited.fix_order_up_to(2)
        given = edited.file_text().encode()
        made = studio.folder.add_input("three_edited.json", given)
        again = studio.jobs.start(Task("optimize", (sheet,), "cut", {**options, "plan": made}))
        assert studio.jobs.wait(again, 90) is JobState.DONE, studio.jobs.record(again)
        plan, kept = (studio.history.artefact(again, name) for name in ("plan", "given"))
        assert plan is not None and json.loads(plan.data)["cuts"][at]["contours"] == middle
        # The file that the command line is shown with is among the downloads.
        assert kept is not None and (kept.file_name, kept.data) == ("three_edited.json", given)


def test_plans_with_bridges_are_not_changed_by_hand() -> None:
    assert has_only_single_cuts(PLAN)
    assert not has_only_single_cuts(PLAN.replace('"fixed"', '"bridge": true, "fixed"', 1))


def test_common_lines_are_cut_and_not_changed_by_hand(studio: Studio) -> None:
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">'
    sheet = studio.folder.add_input(
        "one.svg", f'{svg}<path fill="none" stroke="black" d="M5 5H55V35H5Z"/></svg>'.encode()
    )
    options = {"thickness": "6mm", "preset": "fast", "common_lines": True}
    job = studio.jobs.start(Task("optimize", (sheet,), "cut", options))
    assert studio.jobs.wait(job, 90) is JobState.DONE, studio.jobs.record(job)
    record, files = studio.jobs.record(job), studio.history.artefacts(job)
    assert record is not None
    assert "program" in files
    assert not can_be_edited(studio.history, record, files)


def test_a_plate_is_drilled_in_the_order_that_was_changed(studio: Studio) -> None:
    first = studio.jobs.start(Task("optimize", ("example:plate-10",), options={"depth": "3", "preset": "fast"}))
    assert studio.jobs.wait(first, 60) is JobState.DONE
    edited = load_edited_order(studio.history, first)
    assert edited is not None
    before = json.loads(edited.file_text())
    edited.reverse(1)
    made = studio.folder.add_input("order.json", edited.file_text().encode())
    again = studio.jobs.start(
        Task("optimize", ("example:plate-10",), options={"depth": "3", "preset": "fast", "plan": made})
    )
    assert studio.jobs.wait(again, 60) is JobState.DONE
    drilled = load_edited_order(studio.history, again)
    assert drilled is not None
    assert json.loads(drilled.file_text()) == json.loads(edited.file_text()) != before
