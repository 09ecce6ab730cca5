"""Sending programs to the real GRBL firmware; every step waits for an answer of the board, never for a clock."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from grbl_board import EACH, HEAD, HOLES, SETTINGS, ZERO, Board, plate
from leafcut.cli.app import run as leafcut
from leafcut.errors import SendError
from leafcut.read.machine import load_machine
from leafcut.sender.controller_facts import Facts
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.job import SendJob, read_job
from leafcut.sender.job_checks import check_machine_ready, check_program
from leafcut.sender.jogging import probe_z
from leafcut.sender.port import SerialPort
from leafcut.sender.resuming import first_line_of_hole, resuming_steps
from leafcut.sender.run import Request, RunResult, RunView, SendRun

#: Above the last hole, in machine coordinates.
END = [ZERO[0] + 13.5, ZERO[1] + 9.0, ZERO[2] + 4.0]


def prepared(board: Board, program: Path, machine: str) -> tuple[GrblConversation, Facts, SendJob]:
    job = read_job(str(program), machine)
    talk = GrblConversation(SerialPort(board.port))
    talk.connect()
    facts = talk.read_facts_at_rest()
    check_machine_ready(facts, unhomed=False)
    assert check_program(job, facts, unhomed=False) == []
    board.forget()
    return talk, facts, job.for_machine(facts.machine_with_settings(job.machine))


def send(
    board: Board,
    program: Path,
    machine: str,
    hole: int = 1,
    watch: Callable[[SendRun, RunView], None] = lambda run, view: None,
) -> tuple[RunResult, list[RunView], SendJob]:
    talk, facts, job = prepared(board, program, machine)
    steps = job.steps if hole == 1 else resuming_steps(job, first_line_of_hole(job, hole))[0]
    run = SendRun(talk, facts, job, steps)
    seen: list[RunView] = []

    def observe(view: RunView) -> None:
        seen.append(view)
        watch(run, view)

    run.observe = observe
    try:
        return run.run(), seen, job
    finally:
        talk.port.close()


def bare(text: str) -> list[str]:
    """Return the lines of a text without comments and blanks, cut by other means than the sender's."""
    lines = [re.sub(r"\(.*?\)|;.*|\s", "", line) for line in text.splitlines()]
    return [line for line in lines if line]


def line_of(hole: int) -> int:
    return HEAD + EACH * (hole - 1) + 1


def test_a_plate_of_70_holes_is_held_goes_on_and_is_hurried(board: Board, program: Path, machine: str) -> None:
    """The position is queried throughout; the buffer never holds more than 128 bytes; times are those of the board."""
    stages: list[str] = []
    before: list[RunView] = []
    at_rest: list[RunView] = []

    def watch(run: SendRun, view: RunView) -> None:
        match stages:
            case []:
                before.append(view)
            case ["hold", "faster"]:
                at_rest.append(view)
        match stages:
            case [] if view.hole >= 8:
                stages.append("hold")
                run.queue_request(Request.HOLD)
            # Hold:0 is at rest, Hold:1 slows down.
            case ["hold"] if view.state == "Hold" and run.talk.status is not None and run.talk.status.detail == 0:
                at_rest.append(view)
                stages.append("faster")
                for _ in range(3):
                    run.queue_request(Request.FASTER)
                run.queue_request(Request.LITTLE_SLOWER)
            case ["hold", "faster"] if view.override == 129:
                stages.append("resume")
                run.queue_request(Request.RESUME)
            case ["hold", "faster", "resume"] if view.state == "Run":
                stages.append("normal")
                run.queue_request(Request.NORMAL)
            case _:
                pass

    ending, seen, job = send(board, program, machine, watch=watch)
    assert ending.complete and ending.taken == len(program.read_text().splitlines()), ending
    assert stages == ["hold", "faster", "resume", "normal"]
    assert seen[-1].override == 100
    assert len({(view.state, view.place, view.taken) for view in at_rest}) == 1
    # First the modes that a program assumes at its start.
    assert board.lines() == ["G17G90G94G40G49G80", "G54", "G21", "M5", "M9", *bare(program.read_text())]
    assert 100 < board.most <= 128
    assert len(job.holes) == HOLES and seen[-1].hole == HOLES
    assert [v.line for v in seen] == sorted(v.line for v in seen)
    # Positions are reported before the hold, during it and after it.
    assert len({before[-1].place, at_rest[0].place, seen[-1].place}) == 3
    for view in (v for v in seen if v.hole):
        assert view.place is not None and -1e-6 <= view.place[0] <= 13.51 and -1e-6 <= view.place[1] <= 9.01
        if view.override == 100:
            assert view.done_s + view.left_s == pytest.approx(sum(map(sum, job.seconds_by_line)), rel=1e-6)
    assert ending.place == pytest.approx(END, abs=0.02)


def test_an_error_in_line_40_stops_the_machine_and_is_told_with_its_line(
    board: Board, program: Path, machine: str
) -> None:
    """Mist (M7) is a word of GRBL that this board was built without: nobody but the board can know that."""
    lines = program.read_text().splitlines()
    lines[39] += " M7"
    program.write_text("\n".join(lines) + "\n")
    ending, _, job = send(board, program, machine)
    assert not ending.complete and ending.homed and ending.state == "standing still"
    assert ending.reason == "line 40 'G0 Z0.5 M7': error 20: the controller does not support this word"
    assert 40 <= ending.taken < 80 and ending.line <= 40 + 24
    assert b"!" in board.sent and board.sent.rstrip(b"?").endswith(b"\x18")
    talk = GrblConversation(SerialPort(board.port))
    assert talk.connect().speed == 0 and "M5" in talk.read_facts_at_rest().modes
    talk.port.close()
    assert ending.hole is not None and ending.hole.first <= ending.line
    assert job.holes[ending.hole.number - 1] == ending.hole


def test_a_reset_in_the_middle_is_noticed_and_the_place_is_not_trusted(
    board: Board, program: Path, machine: str
) -> None:
    pressed: list[RunView] = []

    def watch(_run: SendRun, view: RunView) -> None:
        if view.hole >= 3 and view.state == "Run" and not pressed:
            pressed.append(view)
            board.press(b"\x18")

    ending, _, _ = send(board, program, machine, watch=watch)
    assert pressed and not ending.complete and not ending.homed
    assert "reset during a move" in ending.reason or "the controller was reset" in ending.reason
    # GRBL 1.1h reports no alarm if the reset arrives between its checks for alarms and for resets.
    assert ending.state in ("locked by an alarm", "standing still")
    # Until the reset, the board executes at most the lines that it has: 15 of its planner and 128 bytes.
    assert ending.hole is not None and 0 <= ending.hole.number - pressed[0].hole <= 10


def test_a_pulled_cable_leaves_a_clear_state_and_the_plate_goes_on_at_hole_35(
    board: Board, program: Path, machine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The board runs what it has; back on the cable it drills from hole 35 to the end, in the right state."""

    def watch(_run: SendRun, view: RunView) -> None:
        if view.hole >= 34 and view.state == "Run" and board._plug:
            board.pull()

    ending, seen, job = send(board, program, machine, hole=32, watch=watch)
    assert not ending.complete and not ending.homed and "is lost" in ending.reason
    assert ending.hole is not None and 34 <= seen[-1].hole <= ending.hole.number <= seen[-1].hole + 1
    assert "its spindle may stay on" in ending.state and ending.sent >= ending.taken
    board.plug_in()
    words = ["send", str(program), "--port", board.port, "--machine", machine, "--unlock", "--yes", "--json"]
    assert leafcut([*words, "--from-hole", "35", "--log", str(program.with_suffix(".log"))]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["complete"] and answer["position_kept"] and answer["go_on"] == ""
    sent = board.lines()
    at = max(k for k, line in enumerate(sent) if line == "$G") + 1
    lead = sent[at : sent.index(bare(program.read_text())[line_of(35) - 2], at)]
    assert lead[0] == "M5" and [line for line in lead if line[0] in "GM" and "Z" not in line][-3:-1]
    first = next(line for line in lead if line.startswith("G0Z"))
    assert lead.index(first) < lead.index("M3S5000") < len(lead) - 2
    assert sent[-len(bare(program.read_text())) + line_of(35) - 2 :] == bare(program.read_text())[line_of(35) - 2 :]
    assert answer["place"] == pytest.approx(END, abs=0.02)
    log = program.with_suffix(".log").read_text()
    assert " > M3S5000" in log and " < ok" in log
    assert job.holes[34].first == line_of(35)


def test_an_alarm_in_the_middle_is_told_in_words(board: Board, program: Path, machine: str) -> None:
    """The board's own limits become narrower after it was asked: it refuses to go down."""
    talk, facts, job = prepared(board, program, machine)
    try:
        talk.ask("$132=30.2")
        talk.ask("$20=1")
        ending = SendRun(talk, facts, job, job.steps).run()
        assert not ending.complete and ending.state == "locked by an alarm"
        assert "alarm 2: a move would leave the machine's travel" in ending.reason
        assert ending.hole == job.holes[0]
        talk.unlock()
    finally:
        talk.ask("$20=0")
        talk.ask("$132=60")
        talk.port.close()


def test_a_probe_that_touches_nothing_is_an_alarm(board: Board) -> None:
    talk = GrblConversation(SerialPort(board.port))
    talk.connect()
    try:
        with pytest.raises(SendError, match="alarm 5: the probe made no contact"):
            probe_z(talk, talk.read_facts_at_rest(), plate=1.0, feed=600.0, travel=1.0)
        talk.unlock()
    finally:
        talk.port.close()


def test_check_mode_moves_nothing_and_lists_every_error(
    board: Board, program: Path, machine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["send", str(program), "--port", board.port, "--machine", machine, "--check"]
    assert leafcut(words) == 0
    lines = program.read_text().splitlines()
    lines[39] += " M7"
    lines[79] += " M7"
    program.write_text("\n".join(lines) + "\n")
    capsys.readouterr()
    assert leafcut([*words, "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert [error["line"] for error in answer["errors"]] == [40, 80]
    assert b"Run" not in board.said


def test_a_dry_run_asks_the_machine_and_sends_nothing(
    board: Board, program: Path, machine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["send", str(program), "--port", board.port, "--machine", machine, "--dry-run"]
    assert leafcut(words) == 0
    assert "can be sent" in capsys.readouterr().out
    assert [line for line in board.lines() if not line.startswith("$")] == []


@pytest.mark.parametrize(
    "change, told",
    [
        (
            ("G0 Z4 ; up", "G0 Z31"),
            r"line 3 goes to Z 1\.000 mm in machine coordinates, outside the travel of -60 to 0",
        ),
        (("S5000", "S20000"), r"S20000 in line 4 is above the controller's \$30=10000"),
        (("X1.500", "X-60"), r"line 9 goes to X -210\.000 mm"),
    ],
)
def test_what_this_machine_cannot_do_is_refused_before_anything_is_sent(
    board: Board, program: Path, machine: str, capsys: pytest.CaptureFixture[str], change: tuple[str, str], told: str
) -> None:
    program.write_text(program.read_text().replace(*change, 1))
    words = ["send", str(program), "--port", board.port, "--machine", machine, "--yes", "--accept", "L806"]
    assert leafcut(words) == 1
    err = capsys.readouterr().err
    assert re.search(told, err), err
    assert [line for line in board.lines() if not line.startswith("$")] == []


def test_a_profile_is_made_of_what_the_board_says_at_its_port(
    board: Board, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "asked.toml"
    assert leafcut(["machine", "import", "--port", board.port, "-o", str(out)]) == 0
    found, given = load_machine(str(out)), SETTINGS
    assert found.control == "grbl"
    assert found.name == "grbl-board"
    assert found.rapid_velocity == pytest.approx([given[k] / 60.0 for k in (110, 111, 112)])
    assert found.acceleration == pytest.approx([given[k] for k in (120, 121, 122)])
    assert found.corner_deviation == pytest.approx(given[11])
    assert [line for line in board.lines() if not line.startswith("$")] == []


def test_a_port_that_another_program_has_open_is_refused(
    board: Board, program: Path, machine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    other = SerialPort(board.port)
    try:
        assert leafcut(["send", str(program), "--port", board.port, "--machine", machine, "--yes"]) == 1
    finally:
        other.close()
    assert "in use by another program" in capsys.readouterr().err


def test_in_a_terminal_enter_starts_and_keys_hold_go_on_and_stop(board: Board, program: Path, machine: str) -> None:
    """A process with its own terminal; each key is typed when the screen asks for it."""
    program.write_text(plate(700))
    ours, theirs = pty.openpty()
    words = ["send", str(program), "--port", board.port, "--machine", machine]
    patient = "from leafcut.sender.grbl import GrblConversation; GrblConversation.patience = 10.0"
    command = [sys.executable, "-c", f"{patient}; from leafcut.cli.app import main; main({words!r})"]
    done = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True)
    os.close(theirs)
    screen = ""

    def until(pattern: str) -> None:
        nonlocal screen
        while not re.search(pattern, screen):
            screen += os.read(ours, 4096).decode()
        screen = screen[re.search(pattern, screen).start() :]  # type: ignore[union-attr]

    try:
        until("Enter starts, q ends: ")
        os.write(ours, b"\n")
        until(r"hole (?:[2-9]|\d\d+)/700, line \d+ .*F\d+ at 100 %  .* done, .* left, ends \d\d:\d\d:\d\d")
        os.write(ours, b"!")
        until("ON HOLD")
        os.write(ours, b"~")
        until(r"\r *hole \d")
        os.write(ours, b"q")
        until(r"leafcut: stopped by you; .*")
        assert done.wait() == 1
        with suppress(OSError):
            while data := os.read(ours, 4096):
                screen += data.decode()
    finally:
        done.kill()
        done.wait()
        os.close(ours)
    told = screen[screen.index("leafcut: stopped by you") :]
    assert re.search(
        r"the machine is standing still; the position of the machine is X.* \(machine coordinates\); "
        r"the machine was in line \d+",
        told,
    )
    assert re.search(r"resume with --from-hole \d+", told), told
