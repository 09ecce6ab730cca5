"""The studio's connection to a board in plain Python: the same checks for every way of moving the machine."""

from __future__ import annotations

from collections.abc import Iterator
from unittest.mock import Mock

import pytest
from starlette.testclient import TestClient
from waiting import until

from fake_grbl import FakeGrbl
from leafcut.errors import OptionError, SendError
from leafcut.gcode.dialects import load_dialect
from leafcut.read.machine import load_machine
from leafcut.sender.job import SendJob, job_from_text, tools_after_line
from leafcut.sender.jogging import JOG_CANCEL
from leafcut.sender.run import Request
from leafcut.studio.control.link import MachineLink, RunOptions
from leafcut.studio.control.program import program_from_job
from leafcut.studio.control.state import Connection, MachineTask
from leafcut.studio.studio import Studio

PLATE = "G21 G90 G94 G17\nG0 Z5\nM3 S900\nG0 X1 Y2\nG1 Z-1 F100\nG0 Z5\nM5\nM30\n"
#: An answer of the thread that speaks to the board, s.
SOON = 60.0


def job(text: str = PLATE) -> SendJob:
    return job_from_text(text, "plate.nc", load_machine("grbl-3018"), load_dialect("grbl"), None)


@pytest.fixture
def board() -> FakeGrbl:
    made = FakeGrbl()
    made.origin = "-100.000,-100.000,-30.000"
    return made


@pytest.fixture
def link(board: FakeGrbl) -> Iterator[MachineLink]:
    made = MachineLink(lambda _name, _baud: board, board.clock)
    made.grace = float("inf")
    yield made
    made.close()


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, told",
    [
        ("unhomed", r"homing is off \(\$22=0\)"),
        ("alarm", "the machine is locked by an alarm; home it"),
        ("laser", r"laser mode is on \(\$32=1\)"),
        ("switch", "a limit switch is pressed"),
        ("stored", "stored for G28 is Z-89.000"),
        ("travel", "line 4 goes to X -99.000 mm"),
    ],
)
def test_frame_refuses_each_machine_that_check_and_start_refuse(
    link: MachineLink, board: FakeGrbl, change: str, told: str
) -> None:
    text = PLATE
    match change:
        case "unhomed":
            board.settings[22] = 0
        case "alarm":
            board.state = "Alarm"
        case "laser":
            board.settings[32] = 1
        case "switch":
            board.shown = "Idle|Pn:X"
        case "stored":
            board.stored["G28"] = "-100.000,-100.000,-89.000"
            text = PLATE.replace("M5\n", "G91 G28 Z0\nM5\n")
        case "travel":
            board.settings[130] = 90
    link.connect("page", "fake").result(SOON)
    board.taken.clear()
    for ask in (
        lambda: link.check_program("page", job(text), RunOptions()),
        lambda: link.trace_frame("page", job(text), RunOptions(), 500.0),
        lambda: link.run_program("page", job(text), RunOptions()),
    ):
        with pytest.raises(SendError, match=told):
            ask().result(SOON)
        until(lambda: link.state.doing is MachineTask.NOTHING)
    assert board.taken == [] and not any(line.startswith("$J") for line in board.asked)


@pytest.mark.hazard
@pytest.mark.parametrize("state, unsure", [("Idle", False), ("Jog", True), ("Run", True), ("Hold:0", True)])
def test_a_reset_without_an_alarm_makes_the_position_of_a_moving_machine_unsure(
    link: MachineLink, board: FakeGrbl, monkeypatch: pytest.MonkeyPatch, state: str, unsure: bool
) -> None:
    link.connect("page", "fake").result(SOON)
    board.shown = state
    until(lambda: link.state.status == state.partition(":")[0])
    resets, read = [board.greeting], board.read

    def read_after_reset(seconds: float) -> bytes:
        while resets:
            board.say(resets.pop())
        return read(seconds)

    monkeypatch.setattr(board, "read", read_after_reset)
    until(lambda: link.state.said == "the controller was reset")
    assert link.state.unsure is unsure


@pytest.mark.parametrize("alarm, unsure", [(1, True), (2, False), (5, False)])
def test_only_alarms_that_lose_the_position_make_it_unsure_and_then_no_program_starts(
    link: MachineLink, board: FakeGrbl, alarm: int, unsure: bool
) -> None:
    link.connect("page", "fake").result(SOON)
    board.say(f"ALARM:{alarm}")
    until(lambda: link.state.bad)
    assert link.state.said.startswith(f"alarm {alarm}: ") and link.state.unsure is unsure
    if unsure:
        with pytest.raises(SendError, match="its position may be wrong"):
            link.run_program("page", job(), RunOptions()).result(SOON)
    assert board.taken == []


def test_a_lost_cable_closes_the_connection_in_one_line_and_it_can_be_opened_again(
    link: MachineLink, board: FakeGrbl
) -> None:
    link.connect("page", "fake").result(SOON)
    with pytest.raises(SendError, match="the machine on fake is connected; disconnect it first"):
        link.connect("page", "fake")
    board.lost = True
    until(lambda: link.state.connection is Connection.CLOSED)
    assert link.state.bad and link.state.said == "the connection to fake is lost"
    with pytest.raises(SendError, match="no machine is connected"):
        link.home("page")
    board.lost = False
    link.connect("page", "fake").result(SOON)
    link.disconnect("page")
    assert link.state.connection is Connection.CLOSED and not link.state.bad


def test_one_page_commands_the_machine_and_whoever_has_the_key_may_stop_it(
    link: MachineLink, board: FakeGrbl, studio: Studio, client: TestClient
) -> None:
    link.connect("page", "fake").result(SOON)
    with pytest.raises(SendError, match="another page controls the machine; take it over first"):
        link.jog("other", {"X": 1.0}, 100.0)
    with pytest.raises(OptionError, match="'XQ' are not axes"):
        link.set_zero("page", "XQ")
    studio.rooms["control"].link = link
    assert client.post("/api/machine/stop").json() == {"schema": 1, "stop": "sent"}
    until(lambda: link.state.said == "stopped by you; the spindle is off")
    assert b"\x18" in board.realtime and (link.state.holder, link.state.unsure) == ("page", False)
    link.take_control("other")
    link.jog("other", {"X": 1.0}, 100.0).result(SOON)
    assert board.asked[-1] == "$J=G91G21X1F100"


def test_between_holes_the_machine_may_be_jogged_and_from_the_next_hole_the_program_may_go_to_its_end(
    link: MachineLink, board: FakeGrbl
) -> None:
    hole = "G0 X1 Y2\nG1 Z-1 F100\nG0 Z5\n"
    link.connect("page", "fake").result(SOON)
    holes = "".join(hole.replace("X1", f"X{x}") for x in range(1, 5))
    link.run_program("page", job(PLATE.replace(hole, holes)), RunOptions(from_hole=2, by_hole=True)).result(SOON)
    for number, answer in ((2, ""), (3, "all")):
        until(lambda number=number: link.state.question is not None and link.state.question.hole == number)
        assert board.taken.count("G1Z-1F100") == number - 2
        with pytest.raises(SendError, match="the machine is busy"):
            link.home("page")
        link.jog("page", {"X": 3.0}, 6000.0).result(SOON)
        link.answer_question("page", answer)
    until(lambda: link.state.ended is not None)
    assert link.state.ended is not None and link.state.ended.complete and board.taken.count("G1Z-1F100") == 3


@pytest.mark.parametrize("alone", [False, True])
def test_a_program_is_held_when_no_page_shows_the_machine_unless_it_may_run_unattended(
    link: MachineLink, board: FakeGrbl, alone: bool
) -> None:
    link.connect("page", "fake").result(SOON)
    link.grace = -1.0
    link.run_program("page", job(), RunOptions(alone=alone)).result(SOON)
    if not alone:
        until(lambda: link.state.status == "Hold")
        assert link.state.said == "no page shows the machine any more, so the machine is on hold" and link.state.bad
        link.grace = float("inf")
        link.send_request("page", Request.RESUME)
    until(lambda: link.state.ended is not None)
    assert link.state.ended is not None and link.state.ended.complete
    assert board.realtime == ([] if alone else [b"!", b"~"])


@pytest.mark.parametrize("by", ["page", "nobody"])
def test_a_jog_ends_by_cancel_or_when_no_page_shows_the_machine(link: MachineLink, board: FakeGrbl, by: str) -> None:
    link.connect("page", "fake").result(SOON)
    board.shown = "Jog"
    until(lambda: link.state.status == "Jog")
    if by == "page":
        link.cancel_motion("page")
    else:
        link.grace = -1.0
    until(lambda: JOG_CANCEL in board.realtime)


@pytest.mark.parametrize(
    "answer, told",
    [
        (None, "there is no program yet"),
        ({"verified": False}, "was not verified"),
        ({"verified": True, "machine": "router"}, "was made and verified for router, not for grbl-3018"),
    ],
)
def test_a_result_that_is_not_verified_for_this_machine_is_refused(
    answer: dict[str, object] | None, told: str, studio: Studio
) -> None:
    history = Mock(**{"answer.return_value": answer})
    with pytest.raises(OptionError, match=told):
        program_from_job(history, studio.folder, "job", "grbl-3018")


def test_frame_is_traced_on_a_machine_without_homing_once_a_person_says_so(link: MachineLink, board: FakeGrbl) -> None:
    board.settings[22] = 0
    link.connect("page", "fake").result(SOON)
    link.trace_frame("page", job(PLATE.replace("F100\n", "F100\nX11 Y7\n")), RunOptions(unhomed=True), 500.0).result(
        SOON
    )
    until(lambda: link.state.doing is MachineTask.NOTHING)
    # The tool is above the program: it stays at its height.
    corners = ("X-99Y-98", "X-89Y-98", "X-89Y-93", "X-99Y-93", "X-99Y-98")
    assert board.asked[-6:] == [f"$J=G53G21{place}F500" for place in ("Z-20", *corners)]


def test_a_checked_program_states_box_and_tools(link: MachineLink) -> None:
    """A full circle ends at its start: its box is that of the whole circle, not of a point."""
    circle = PLATE.replace("G1 Z-1 F100\n", "G1 Z-1 F100\nG2 X1 Y2 I5 J0\n")
    link.connect("page", "fake").result(SOON)
    ready = link.check_program("page", job(circle), RunOptions()).result(SOON)
    assert ready.box == ((1.0, -3.0, -1.0), (11.0, 7.0, 5.0))
    assert ready.tools == [None]


@pytest.mark.parametrize(
    "head, line, tools",
    [
        ("T1 (3 mm drill)\nM0\n", 0, ["T1 (3 mm drill)", "T2 mill 6 mm"]),
        ("(T1 drill 3 mm)\nT1\nM0\n", 0, ["T1 drill 3 mm", "T2 mill 6 mm"]),
        ("", 0, [None, "T2 mill 6 mm"]),
        ("", 11, ["T2 mill 6 mm"]),
    ],
)
def test_the_tools_of_a_program_are_those_that_a_person_puts_in(head: str, line: int, tools: list[str | None]) -> None:
    lines = PLATE.splitlines()
    text = "\n".join([lines[0], head + "\n".join(lines[1:7]), "(T2 mill 6 mm)", "T2 M6", "M3 S900", *lines[3:]])
    assert tools_after_line(job(text), line) == tools
