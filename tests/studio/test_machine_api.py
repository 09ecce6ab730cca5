"""The machine through the routes of the studio, against the real firmware of GRBL: each step waits for the board."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient
from waiting import until

from grbl_board import EACH, HEAD, PROFILE, ZERO, Board, plate
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.port import SerialPort
from leafcut.studio.studio import Studio

State = dict[str, Any]

#: Holes of a plate. The sixth one takes 5 s, in which the program can be held or stopped.
MANY = 40
SLOW = plate(MANY, {6: 12})


class Machine:
    """Requests of a program to the studio's machine."""

    def __init__(self, client: TestClient, studio: Studio, board: Board) -> None:
        self.client, self.studio, self.board = client, studio, board

    def state(self) -> State:
        found: State = self.client.get("/api/machine").json()
        return found

    def ask(self, what: str, status: int = 200, **body: object) -> State:
        answer = self.client.post(f"/api/machine/{what}", json=body)
        assert answer.status_code == status, answer.text
        found: State = answer.json()
        return found

    def refused(self, what: str, status: int = 422, **body: object) -> str:
        return str(self.ask(what, status, **body)["error"])

    def until(self, true: Callable[[State], object]) -> State:
        found: list[State] = []

        def look() -> object:
            found[:] = [self.state()]
            return true(found[0])

        until(look)
        return found[0]

    def idle(self) -> State:
        return self.until(lambda s: s["status"] == "Idle" and s["doing"] == "")

    def file(self, text: str) -> str:
        return str(self.client.post("/api/files?name=plate.nc", content=text.encode()).json()["id"])

    def start(self, text: str, **wishes: object) -> State:
        return self.ask("run", source=self.file(text), machine="mine:board", **wishes)

    def ended(self) -> State:
        found: State = self.until(lambda s: s["ended"])["ended"]
        return found


@pytest.fixture
def open_board(studio: Studio, client: TestClient, board: Board) -> Iterator[Machine]:
    """Return a studio that is connected to the board, whose profile is the person's own machine."""
    studio.rooms["control"].link.grace = 60.0
    port = SerialPort(board.port)
    GrblConversation(port).ask("G10 L2 P1 X{} Y{} Z{}".format(*ZERO))  # it keeps the zeros of the test before
    port.close()
    board.forget()
    studio.folder.save_own("machines", "board", PROFILE)
    machine = Machine(client, studio, board)
    machine.ask("connect", port=board.port)
    yield machine
    studio.rooms["control"].close()


def test_a_board_is_connected_told_of_and_given_back(open_board: Machine) -> None:
    state = open_board.idle()
    assert (state["connection"], state["version"][:4], state["holder"]) == ("open", "1.1h", "program")
    assert state["travel"] == [[-200.0, -200.0, -60.0], [0.0, 0.0, 0.0]] and state["homing"]
    place = zip(state["machine"], ZERO, state["work"], strict=True)
    assert all(abs(here - zero - work) < 0.01 for here, zero, work in place)
    assert "connected" in open_board.refused("connect", port=open_board.board.port)
    assert open_board.ask("disconnect")["connection"] == "closed"
    assert open_board.refused("home") == "no machine is connected"
    assert open_board.ask("connect", port=open_board.board.port)["connection"] == "open"


def test_a_jog_is_done_or_ended_and_zeros_are_set(open_board: Machine) -> None:
    begin = open_board.idle()["machine"]
    open_board.ask("jog", x=-2, z=-1, feed=6000)
    there = open_board.until(lambda s: s["status"] == "Idle" and s["machine"][0] == pytest.approx(begin[0] - 2))
    assert there["machine"][2] == pytest.approx(begin[2] - 1)
    assert "error 15" in open_board.refused("jog", x=300, feed=6000)
    open_board.ask("jog", x=-40, feed=10)
    open_board.until(lambda s: s["status"] == "Jog")
    open_board.ask("cancel")
    assert open_board.idle()["machine"][0] > begin[0] - 40
    open_board.ask("zero", axes="XZ")
    work = open_board.idle()["work"]
    assert (work[0], work[2]) == (0.0, 0.0) and work[1] == pytest.approx(begin[1] - ZERO[1])
    assert "axes" in open_board.refused("zero", 400, axes="XQ")
    open_board.ask("jog", x=-40, feed=10)
    open_board.until(lambda s: s["status"] == "Jog")
    open_board.ask("stop")
    state = open_board.until(lambda s: s["said"].startswith("stopped by you"))
    assert state["status"] == "Idle" and not state["unsure"]


def test_the_frame_of_a_program_is_traced_in_the_air_and_only_within_the_travel(open_board: Machine) -> None:
    seen: list[State] = []
    source = open_board.file(plate(20))
    start = open_board.idle()["machine"]
    height = max(start[2], ZERO[2] + 4.0)  # where the tool is, if that is above the program
    open_board.ask("frame", source=source, machine="mine:board", feed=9000)
    open_board.until(lambda s: seen.append(s) or (s["status"] == "Idle" and s["doing"] == ""))
    jogs = [line for line in open_board.board.lines() if line.startswith("$J=G53")]
    low, high = (ZERO[0], ZERO[1]), (ZERO[0] + 13.5, ZERO[1] + 1.5)
    corners = [(x, y) for x, y in (low, (high[0], low[1]), high, (low[0], high[1]), low)]
    assert jogs == [f"$J=G53G21Z{height:g}F9000", *(f"$J=G53G21X{x:g}Y{y:g}F9000" for x, y in corners)]
    assert {s["machine"][2] for s in seen if s["machine"][:2] != start[:2]} <= {height}
    assert seen[-1]["machine"] == pytest.approx([*low, height], abs=0.01)
    far = open_board.file(plate(20).replace("X1.500", "X-60"))
    told = open_board.refused("frame", source=far, machine="mine:board", feed=9000)
    assert told.startswith("line 9 goes to X -210.000 mm in machine coordinates, outside the travel of -200 to 0 mm")


def test_a_program_runs_is_held_goes_on_is_hurried_and_ends(open_board: Machine) -> None:
    checked = open_board.ask("check", source=open_board.file(plate(MANY)), machine="mine:board")
    assert checked["holes"] == MANY and checked["seconds"] > 1.0
    assert checked["box"] == [[0.0, 0.0, -0.5], [13.5, 4.5, 0.5]] and checked["tools"] == [None]
    twice = {"source": open_board.file(plate(MANY)), "machine": "mine:board", "from_hole": 3, "from_line": 40}
    assert "both set the line to resume at" in open_board.refused("check", 400, **twice)
    assert checked["told"] == ["soft limits are off ($20=0): the controller does not stop at the limits"]
    open_board.start(SLOW)
    open_board.until(lambda s: s["progress"]["hole"] >= 3)
    assert "busy" in open_board.refused("jog", x=1, feed=100)
    open_board.ask("hold")
    open_board.until(lambda s: s["status"] == "Hold")
    open_board.ask("feed/faster")
    state = open_board.until(lambda s: s["progress"]["override"] == 110)
    assert state["progress"]["left_s"] > 0.0 and state["progress"]["holes"] == MANY
    open_board.ask("resume")
    ended = open_board.ended()
    assert ended["complete"] and ended["words"].startswith(f"plate.nc: all {HEAD + EACH * MANY + 3} lines done")


def test_stop_ends_a_program_and_it_goes_on_at_a_hole(open_board: Machine) -> None:
    open_board.start(SLOW)
    open_board.until(lambda s: s["progress"]["hole"] >= 5)
    open_board.ask("stop")
    ended = open_board.ended()
    sent = sum(line.startswith("G1Z-0.5") for line in open_board.board.lines())
    assert not ended["complete"] and ended["position_kept"] and ended["go_on_hole"] >= 5
    # The board drops at most the lines that it has: 15 of its planner and 128 bytes.
    assert sent - 10 <= ended["go_on_hole"] <= sent + 1
    assert ended["words"].startswith("stopped by you; the machine is standing still")
    open_board.board.forget()
    open_board.start(plate(MANY), from_hole=MANY - 2)
    assert open_board.ended()["complete"]
    assert [line for line in open_board.board.lines() if line == "G1Z-0.5F3000"] == 3 * ["G1Z-0.5F3000"]


def test_holes_are_drilled_one_by_one_with_a_jog_between(open_board: Machine) -> None:
    """Each hole is drilled on request, and not before."""
    open_board.start(plate(5), by_hole=True)
    for hole in range(1, 6):
        state = open_board.until(lambda s, hole=hole: (s["question"] or {}).get("hole") == hole)
        assert state["question"]["kind"] == "hole" and state["question"]["line"] == HEAD + EACH * (hole - 1) + 1
        assert open_board.board.lines().count("G1Z-0.5F3000") == hole - 1
        if hole == 4:
            place = state["machine"]
            open_board.ask("jog", x=3, feed=6000)
            open_board.until(lambda s, x=place[0]: s["status"] == "Idle" and s["machine"][0] == pytest.approx(x + 3))
        open_board.ask("answer", answer="go on")
    assert open_board.ended()["complete"]
    assert open_board.board.lines().count("G1Z-0.5F3000") == 5


def test_from_the_next_hole_on_it_may_go_to_the_end(open_board: Machine) -> None:
    open_board.start(plate(6), by_hole=True, from_hole=3)
    open_board.until(lambda s: (s["question"] or {}).get("hole") == 3)
    open_board.ask("answer", answer="all")
    assert open_board.ended()["complete"]
    assert open_board.board.lines().count("G1Z-0.5F3000") == 4


def test_a_program_is_held_when_nobody_shows_the_machine_and_can_go_on(open_board: Machine) -> None:
    link = open_board.studio.rooms["control"].link
    open_board.start(SLOW)
    link.grace = 0.2
    until(lambda: link.state.status == "Hold")
    link.grace = 60.0
    state = open_board.state()
    assert state["said"] == "no page shows the machine any more, so the machine is on hold" and state["bad"]
    open_board.ask("resume")
    assert open_board.ended()["complete"]


def test_a_program_that_was_told_so_goes_on_alone_and_a_jog_never(open_board: Machine) -> None:
    link = open_board.studio.rooms["control"].link
    open_board.start(plate(20), alone=True)
    link.grace = 0.0
    until(lambda: link.state.ended)
    assert link.state.ended is not None and link.state.ended.complete
    link.grace = 60.0
    open_board.ask("jog", x=-40, feed=10)
    open_board.until(lambda s: s["status"] == "Jog")
    link.grace = 0.0
    until(lambda: link.state.status == "Idle")


def test_one_page_commands_it_the_other_sees_it_and_may_stop_it(open_board: Machine) -> None:
    link = open_board.studio.rooms["control"].link
    link.take("page")
    assert open_board.state()["holder"] == "page"
    assert open_board.refused("jog", x=1, feed=100) == "another page controls the machine; take it over first"
    open_board.ask("stop")
    open_board.until(lambda s: s["said"].startswith("stopped by you"))
    assert open_board.ask("take")["holder"] == "program"
    open_board.ask("jog", x=-0.1, feed=6000)  # a board that is just switched on stands at the end of its travel


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (plate(3).replace("X1.500", "X-60"), "line 9 goes to X -210.000 mm in machine coordinates"),
        (plate(3).replace("S5000", "S20000"), "S20000 in line 4 is above the controller's $30=10000"),
        (plate(3).replace("G0 Z0.5", "G81 Z0.5", 1), "plate.nc:8: "),
    ],
)
def test_what_the_machine_cannot_do_is_refused_before_anything_is_sent(
    open_board: Machine, text: str, told: str
) -> None:
    line = open_board.refused("run", source=open_board.file(text), machine="mine:board", accept="L806")
    assert told in line and "\n" not in line
    assert [line for line in open_board.board.lines() if not line.startswith("$")] == []


def test_a_program_made_for_another_machine_is_refused(open_board: Machine) -> None:
    made = open_board.client.post(
        "/api/optimize",
        data={"source": "example:ten-points", "options": '{"preset": "fast", "machine": "grbl-3018", "depth": "3"}'},
    ).json()
    line = open_board.refused("run", 400, job=made["job"], machine="mine:board")
    assert "was made and verified for grbl-3018, not for board" in line
    assert "controller is haas" in open_board.refused("run", 400, job=made["job"], machine="haas-vf2")


def test_an_alarm_and_a_reset_at_the_board_are_told_and_the_place_is_not_trusted(open_board: Machine) -> None:
    open_board.board.press(b"\x18")
    assert open_board.until(lambda s: s["bad"])["said"] == "the controller was reset"
    open_board.ask("jog", x=-40, feed=10)
    open_board.until(lambda s: s["status"] == "Jog")
    open_board.board.press(b"\x18")
    # GRBL 1.1h reports no alarm if the reset arrives between its checks for alarms and for resets.
    state = open_board.until(lambda s: s["unsure"] and s["status"] in ("Alarm", "Idle"))
    if state["status"] == "Alarm":
        line = open_board.refused("run", source=open_board.file(plate(3)), machine="mine:board")
        assert line.startswith("the machine is locked by an alarm; home it")
        open_board.ask("unlock")
    line = open_board.refused("run", source=open_board.file(plate(3)), machine="mine:board")
    assert "its position may be wrong" in line


def test_a_pulled_cable_is_one_line_and_the_machine_can_be_connected_again(open_board: Machine) -> None:
    open_board.board.pull()
    state = open_board.until(lambda s: s["connection"] == "closed")
    assert state["bad"] and state["said"].startswith("the connection to /dev/pts/")
    open_board.board.plug_in()
    assert open_board.ask("connect", port=open_board.board.port)["connection"] == "open"


def test_a_port_that_is_none_or_in_use_is_refused_in_one_line(open_board: Machine, client: TestClient) -> None:
    open_board.ask("disconnect")
    assert "the port does not exist" in open_board.refused("connect", port="/dev/nothing")
    other = SerialPort(open_board.board.port)
    assert "in use by another program" in open_board.refused("connect", port=open_board.board.port)
    other.close()
    assert "--baud 1234" in open_board.refused("connect", port=open_board.board.port, baud=1234)


def test_a_probe_that_touches_nothing_is_an_alarm_and_its_way_ends_with_the_travel(open_board: Machine) -> None:
    line = open_board.refused("probe", plate=1, feed=100, travel=100)
    assert "before the end of the machine's travel" in line
    line = open_board.refused("probe", plate=1, feed=600, travel=1)
    assert "alarm 5: the probe made no contact" in line
    assert open_board.until(lambda s: s["status"] == "Alarm")["unsure"] is False
    open_board.ask("unlock")
    open_board.idle()
