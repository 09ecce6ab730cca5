"""The studio's connection to a board in plain Python: the same checks for every way of moving the machine."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from waiting import until

from fake_grbl import FakeGrbl
from leafcut.errors import SendError
from leafcut.gcode.dialects import dialect
from leafcut.read.machine import load_machine
from leafcut.sender.job import SendJob, job_of, tools_of
from leafcut.studio.control.link import MachineLink, RunWishes
from leafcut.studio.control.state import MachineTask

PLATE = "G21 G90 G94 G17\nG0 Z5\nM3 S900\nG0 X1 Y2\nG1 Z-1 F100\nG0 Z5\nM5\nM30\n"
#: An answer of the thread that speaks to the board, s.
SOON = 60.0


def job(text: str = PLATE) -> SendJob:
    return job_of(text, "plate.nc", load_machine("grbl-3018"), dialect("grbl"), None)


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
        lambda: link.check("page", job(text), RunWishes()),
        lambda: link.frame("page", job(text), RunWishes(), 500.0),
        lambda: link.run("page", job(text), RunWishes()),
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


def test_frame_is_traced_on_a_machine_without_homing_once_a_person_says_so(link: MachineLink, board: FakeGrbl) -> None:
    board.settings[22] = 0
    link.connect("page", "fake").result(SOON)
    link.frame("page", job(), RunWishes(unhomed=True), 500.0).result(SOON)
    until(lambda: link.state.doing is MachineTask.NOTHING)
    assert [line[:7] for line in board.asked if line.startswith("$J")] == ["$J=G53G"] * 6


def test_a_checked_program_states_box_and_tools(link: MachineLink) -> None:
    """A full circle ends at its start: its box is that of the whole circle, not of a point."""
    circle = PLATE.replace("G1 Z-1 F100\n", "G1 Z-1 F100\nG2 X1 Y2 I5 J0\n")
    link.connect("page", "fake").result(SOON)
    ready = link.check("page", job(circle), RunWishes()).result(SOON)
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
    assert tools_of(job(text), line) == tools
