"""Programs sent to Marlin: a simulated board that does and prints what Marlin's sources say; no real one was there."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from fake_marlin import FakeMarlin, MarlinOnACable, xor
from hypothesis import example, given
from hypothesis import strategies as st

from leafcut.cli.app import run as leafcut
from leafcut.errors import LeafcutError, OptionError, SendError
from leafcut.gcode.dialects import load_dialect
from leafcut.read.machine import load_machine
from leafcut.sender.answers import Accepted, Alarm, Greeting, InvalidAnswer, Report
from leafcut.sender.character_counting import SentLine
from leafcut.sender.controller_facts import Facts
from leafcut.sender.firmware import conversation_class
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.job import SendJob, job_from_text, read_job
from leafcut.sender.job_checks import check_machine_ready, check_program
from leafcut.sender.lines import Pause
from leafcut.sender.marlin import MarlinConversation, NumberedLine, parse_marlin_line
from leafcut.sender.resuming import first_line_of_hole, resuming_steps
from leafcut.sender.run import Request, RunResult, RunView, SendRun
from leafcut.sender.run_texts import ending_in_words

MACHINE = load_machine("marlin-mpcnc")
HEAD = ["; a plate", "G21", "G17", "G90", "G0 Z5 F900", "M3 S9000", "G4 P2000"]
#: Lines added before the program: M84 S0, then the modes that the program assumes.
OPENING = ["M84 S0", "G17", "G90", "G21", "M5", "M9"]


def drilled(count: int) -> list[str]:
    """Hole k has the lines len(HEAD) + 4k - 3 and the three lines after it."""
    lines = []
    for k in range(count):
        lines += [f"G0 X{10 + 5 * k} Y10 F3000", "G0 Z1 F900", "G1 Z-1 F120", "G0 Z5 F900"]
    return lines


def text_of(lines: Sequence[str]) -> str:
    return "\n".join([*HEAD, *lines, "M5", ""])


def job_with(lines: Sequence[str]) -> SendJob:
    return job_from_text(text_of(lines), "part.gcode", MACHINE, load_dialect("marlin"), None)


def met(board: FakeMarlin, *, homed: bool = True) -> tuple[MarlinConversation, Facts]:
    talk = MarlinConversation(board, clock=board.clock)
    talk.connect()
    if homed:
        talk.home()
        board.place, board.planned = [0.0, 0.0, 20.0], [0.0, 0.0, 20.0]
    return talk, talk.read_facts_at_rest()


def sent(
    board: FakeMarlin,
    job: SendJob,
    watch: Callable[[SendRun, RunView], None] = lambda run, view: None,
    prompt: Callable[[Pause, Sequence[str]], str | None] | None = None,
    steps: Sequence[SentLine | Pause] | None = None,
) -> RunResult:
    talk, facts = met(board)
    check_machine_ready(facts, unhomed=False)
    check_program(job, facts, unhomed=False)
    run = SendRun(talk, facts, job, job.steps if steps is None else steps, prompt=prompt)
    run.observe = lambda view: watch(run, view)
    return run.run()


def obeyed(board: FakeMarlin) -> list[str]:
    """Return the executed program lines: without queries and feed changes."""
    return [line for line in board.taken if not line.startswith(("M400", "M114", "M220", "M110", "M410"))]


def bare(lines: Sequence[str]) -> list[str]:
    """Return a program's lines without comments, by other means than the sender's."""
    return [line for line in (re.sub(";.*", "", line).strip() for line in lines) if line]


def test_a_program_goes_line_by_line_each_with_its_number_and_checksum() -> None:
    board = FakeMarlin()
    ending = sent(board, job_with(drilled(5)))
    assert ending.complete and ending.homed, ending
    assert obeyed(board) == [*OPENING, *bare(HEAD), *bare(drilled(5)), "M5"]
    assert ending.place == (30.0, 10.0, 5.0) and board.spindle == 0.0
    lines = [line for line in board.written.decode().split("\n") if line and "M110" not in line]
    for number, line in enumerate(lines, 1):
        body, _, check = line.rpartition("*")
        assert body.startswith(f"N{number} ") and int(check) == xor(body)


def test_a_checksum_is_that_of_marlins_own_example() -> None:
    """marlinfw.org, "Line numbers and checksums"; RepRap wiki, G-code, "Checking": N3 T0*57, N4 G92 E0*67."""
    assert NumberedLine(3, "T0").data == b"N3 T0*57\n"
    assert NumberedLine(4, "G92 E0").data == b"N4 G92 E0*67\n"
    assert NumberedLine(0, "M110 N0").data == b"N0 M110 N0*125\n"


@pytest.mark.hazard
@given(
    faults=st.dictionaries(
        st.integers(1, 30), st.sampled_from(["noise", "split", "dropped", "deaf", "slow"]), max_size=6
    ),
    resend_ok=st.booleans(),
    waiting=st.booleans(),
)
@example(
    faults={1: "slow", 2: "dropped"}, resend_ok=False, waiting=False
)  # a late ok, mistaken for that of the next line
def test_noise_on_the_line_changes_nothing_every_line_is_obeyed_once_and_in_order(faults, resend_ok, waiting) -> None:
    """Marlin 2.1 sends ok after Resend:, some earlier versions do not; ``wait`` does not confirm a line."""
    board = FakeMarlin(faults)
    board.resend_ok, board.waiting = resend_ok, waiting
    ending = sent(board, job_with(drilled(6)))
    assert ending.complete, ending.reason
    assert obeyed(board) == [*OPENING, *bare(HEAD), *bare(drilled(6)), "M5"]
    assert board.moves[-1] == [35.0, 10.0, 5.0]


@pytest.mark.parametrize(
    "fault, told",
    [
        ("reset", r"the controller was reset while the machine was in line \d+"),
        ("kill", r"the board has switched off the motors and the spindle \(kill\).*the machine is locked by an alarm"),
        ("error", r"^[^;]*in or after line \d+: an arc has invalid words; the machine is stopped without deceleration"),
        ("endstop", r"an end stop was hit unexpectedly \(X:12\.00\)"),
        ("garbage", r"invalid answer: 'o.k.*check the cable"),
        ("silent", r"fake no longer responds; M112 \(emergency stop\) was sent anyway"),
        ("lost", r"the connection to fake is lost.*its spindle may stay on"),
    ],
)
def test_every_fault_ends_the_run_with_its_state_told(fault: str, told: str) -> None:
    job = job_with(drilled(20))
    board = FakeMarlin({75: fault})
    ending = sent(board, job)
    words = ending_in_words(ending, job)
    assert not ending.complete and not ending.homed and "\n" not in words and re.search(told, words), words
    done = len(board.moves) - 1  # the first move is up, each hole has four
    assert ending.hole is not None and ending.hole.number <= done // 4 + 1, words
    assert ("resume with --from-hole" in words) == (ending.hole.number > 1) and "after homing" in words
    if fault in ("error", "endstop", "garbage"):
        # Stopped at once: planned moves are dropped, the spindle is off.
        assert b"M410\n" in board.written and not board.blocks and board.spindle == 0.0
        assert ending.place == pytest.approx(board.place, abs=0.006)
    if fault == "silent":
        assert board.written.endswith(b"M112\n")


def test_a_word_that_the_firmware_lacks_stops_the_run_although_it_is_answered_with_ok() -> None:
    """Marlin answers ok to everything (process_parsed_command): a drill whose spindle does not run would break."""
    board = FakeMarlin()
    board.lacks |= {"M3"}
    ending = sent(board, job_with(drilled(2)))
    assert ending.reason == "line 6 'M3 S9000': the firmware does not support 'M3 S9000'"
    assert not any(line.startswith("G1 ") for line in board.taken)


def test_a_hold_lets_it_finish_what_is_planned_and_keeps_its_place() -> None:
    board = FakeMarlin()
    stages: list[str] = []
    stood: list[list[float]] = []

    def watch(run: SendRun, view: RunView) -> None:
        if not stages and view.hole >= 3:
            stages.append("hold")
            run.queue_request(Request.HOLD)
        if stages == ["hold"] and view.state == "Hold":
            stood.append(list(board.place))
            assert view.place == pytest.approx(board.place) and not board.blocks
            if len(stood) == 3:
                assert stood[0] == stood[2]
                stages.append("faster")
                run.queue_request(Request.FASTER)
                run.queue_request(Request.FASTER)
        if stages[-1:] == ["faster"] and view.override == 120:
            stages.append("on")
            run.queue_request(Request.RESUME)

    ending = sent(board, job_with(drilled(8)), watch)
    assert ending.complete, ending.reason
    assert stages == ["hold", "faster", "on"] and board.percent == 120
    assert obeyed(board) == [*OPENING, *bare(HEAD), *bare(drilled(8)), "M5"]


def test_stop_is_at_once_and_the_place_is_no_longer_trusted_but_from_a_hold_it_is() -> None:
    """marlinfw.org, M410: without slowing down, so steps may be lost."""
    board = FakeMarlin(keen=5.0)
    ending = sent(
        board, job_with(drilled(20)), lambda run, view: run.queue_request(Request.STOP) if view.hole >= 8 else None
    )
    assert ending.reason == "stopped by you" and not ending.homed and board.spindle == 0.0
    assert ending.place == pytest.approx(board.place, abs=0.006)
    # The hole by position, not by accepted lines: 15 moves are dropped, nearly four holes.
    assert ending.sure and ending.hole is not None and ending.taken - 24 < ending.line < ending.taken
    assert abs(ending.hole.x - ending.place[0]) <= 5.0
    assert "stopped without deceleration" in ending_in_words(ending, job_with(drilled(20)))

    def held(run: SendRun, view: RunView) -> None:
        run.queue_request(Request.STOP if view.state == "Hold" else Request.HOLD) if view.hole >= 4 else None

    board = FakeMarlin()
    ending = sent(board, job_with(drilled(20)), held)
    assert ending.reason == "stopped by you" and ending.homed and b"M410" not in board.written
    assert board.spindle == 0.0 and not board.blocks


def test_a_change_of_tool_waits_until_it_stands_and_neither_m0_nor_t_reaches_it() -> None:
    board = FakeMarlin()
    asked: list[str] = []

    def prompt(pause: Pause, _said: Sequence[str]) -> str:
        assert not board.blocks and (board.spindle == 0.0 or not pause.change)
        asked.append(str(pause))
        return ""

    lines = [*drilled(2), "M5", "; 6 mm mill", "M0 T2", "M3 S5000", "G4 P4000", *drilled(1), "M1"]
    ending = sent(board, job_with(lines), prompt=prompt)
    assert ending.complete, ending.reason
    assert asked == ["line 18: mount tool T2 (6 mm mill)", "line 25: pause"]
    assert not any(re.match("M[016]$|T", line) for line in board.taken)


def test_what_is_done_at_a_change_is_undone_and_the_program_goes_on_from_above() -> None:
    board = FakeMarlin()
    typed = ["G92 Z12", ""]
    lines = [*drilled(2), "M5", "M0 T2", "M3 S5000", "G4 P4000", *drilled(2)]
    ending = sent(board, job_with(lines), prompt=lambda _pause, _said: typed.pop(0))
    assert ending.complete, ending.reason
    at = board.taken.index("G92 Z12") + 1
    assert (
        obeyed(board)[obeyed(board).index("G92 Z12") + 1 :][:9]
        == [
            "M113",
            "M503",
            "M211",
            "M5",
            "M9",
            "G21",
            "G90",
            "G17",
            "G0 Z12 F900",
        ]
        or board.taken[at:]
    )
    way = [line for line in board.taken[at:] if line[0] == "G"]
    assert way[:6] == ["G21", "G90", "G17", "G0 Z12 F900", "G0 X15 Y10 F3000", "G0 Z5 F900"]


def test_it_goes_on_at_a_hole_in_the_words_of_marlin() -> None:
    """Up, over, spindle, down; each line one command; rapids with their feed, dwell in ms; no G54, G94, G40, G49."""
    job = job_with(drilled(4))
    steps, _ = resuming_steps(job, first_line_of_hole(job, 3), 20.0)
    board = FakeMarlin()
    ending = sent(board, job, steps=steps)
    assert ending.complete, ending.reason
    lead = obeyed(board)[1:]
    assert lead[: len(lead) - 9] == [
        "M5",
        "M9",
        "G21",
        "G90",
        "G17",
        "G0 Z20 F900",
        "G0 X15 Y10 F3000",
        "M3 S9000",
        "G4 P4000",
        "G0 Z5 F900",
        "G21",
        "G1 F900",
        "G17",
        "G90",
    ]
    assert lead[-9:] == [*drilled(4)[8:], "M5"]


@pytest.mark.parametrize(
    "lines, told",
    [
        (["T1"], "T1 is not a word of marlin|each block must contain a single G or M word"),
        (["G28"], "not a word of marlin"),
        (["M112"], "not a word of marlin"),
        (["G20"], "not a word of marlin"),
        (["G0 X-1 Y0 F3000"], r"goes to X -1\.000 mm .* outside the travel of 0 to 600 mm \(M211 X\)"),
    ],
)
def test_what_marlin_must_not_get_is_refused(lines: list[str], told: str) -> None:
    """Marlin clips a move at its soft end stops without a message (apply_motion_limits)."""
    board = FakeMarlin()
    with pytest.raises(LeafcutError, match=told):
        sent(board, job_with([*lines, *drilled(1)]))
    assert not board.moves


def test_arcs_are_refused_before_the_start_where_the_firmware_says_that_it_has_none() -> None:
    """M115, Cap:ARCS:0: ARC_SUPPORT is off."""
    lines = ["G0 X10 Y10 F3000", "G1 Z-1 F120", "G2 X20 Y10 I5 J0 F300", "G0 Z5 F900"]
    assert sent(FakeMarlin(), job_with(lines)).complete
    board = FakeMarlin()
    board.abilities = board.abilities.replace("ARCS:1", "ARCS:0")
    with pytest.raises(SendError, match=r"no arcs \(ARC_SUPPORT\), but line 10 is an arc"):
        sent(board, job_with(lines))


def test_what_a_person_does_at_the_machines_own_display_is_obeyed() -> None:
    """feature/host_actions.cpp: //action:paused, resumed, cancel."""
    board = FakeMarlin()
    said: list[str] = []

    def watch(_run: SendRun, view: RunView) -> None:
        if not said and view.hole >= 3:
            said.append("paused")
            board.say("//action:paused")
        elif said == ["paused"] and view.state == "Hold":
            said.append("resumed")
            board.say("//action:resumed")
        elif len(said) == 2 and view.hole >= 12:
            said.append("cancel")
            board.say("//action:cancel")

    ending = sent(board, job_with(drilled(30)), watch)
    assert said == ["paused", "resumed", "cancel"]
    assert ending.reason.endswith("the board was stopped at its display (cancel)") and board.spindle == 0.0


def broken(board: FakeMarlin, what: str, value: object) -> FakeMarlin:
    setattr(board, what, value)
    return board


@pytest.mark.parametrize(
    "what, value, told",
    [
        ("firmware", "FIRMWARE_NAME:Marlin 1.1.9 (Github)", "is Marlin 1.1.9; Marlin 2 is needed"),
        ("firmware", "FIRMWARE_NAME:Repetier_1.0.3", r"is not Marlin \('Repetier_1\.0\.3'\)"),
        ("keepalive", "echo:M113 S0", "does not report that it is busy"),
        ("lacks", {"M113"}, "does not report that it is busy"),
        ("lacks", {"M211"}, "does not report its travel"),
        ("lacks", {"M503"}, r"does not report its settings \(M503\)"),
        ("settings", "echo:  M92 X80", "settings cannot be used: .*M203"),
        ("killed", True, "no response on fake"),
    ],
)
def test_a_board_that_cannot_say_what_is_needed_is_refused(what: str, value: object, told: str) -> None:
    with pytest.raises(SendError, match=told) as caught:
        met(broken(FakeMarlin(), what, value), homed=False)
    assert "\n" not in str(caught.value)


def test_whether_it_was_homed_cannot_be_asked_so_a_person_says_it() -> None:
    board = FakeMarlin()
    talk, facts = met(board, homed=False)
    with pytest.raises(SendError, match="does not report whether it was homed"):
        check_machine_ready(facts, unhomed=False)
    board.start()
    talk, facts = met(board, homed=False)
    assert talk.restarted
    with pytest.raises(SendError, match="add --zero-here"):
        check_machine_ready(facts, unhomed=True, restarted=talk.restarted)
    talk.zero_here()
    facts = talk.read_facts_at_rest()
    check_machine_ready(facts, unhomed=True, restarted=talk.restarted)
    assert facts.machine_position() == (0.0, 0.0, 0.0)


def test_it_is_timed_by_its_own_settings() -> None:
    board = FakeMarlin()
    board.settings = board.settings.replace("M203 X50.00", "M203 X20.00")
    _, facts = met(board)
    timed = facts.machine_with_settings(MACHINE)
    assert timed.rapid_velocity == (20.0, 50.0, 15.0) and timed.acceleration == (180.0, 180.0, 80.0)
    assert timed.corner_deviation == 0.05
    (issue,) = check_program(job_with(drilled(2)), facts, unhomed=False)
    assert "M203 X=1200 (3000)" in issue.message and "M203 Y" not in issue.message


def test_each_firmware_is_refused_by_the_other_in_one_line() -> None:
    from fake_grbl import FakeGrbl

    grbl = FakeGrbl()
    grbl.strict = False
    with pytest.raises(SendError, match="is not Marlin"):
        MarlinConversation(grbl, clock=grbl.clock).connect()
    marlin = FakeMarlin()
    marlin.start()
    with pytest.raises(SendError, match=r"is not GRBL \('echo:Marlin 2\.1\.2\.1'\)"):
        GrblConversation(marlin, clock=marlin.clock).connect()


def test_the_machine_decides_how_it_is_spoken_to(tmp_path: Path) -> None:
    assert conversation_class(MACHINE, "m") is MarlinConversation
    assert conversation_class(load_machine("grbl-3018"), "m") is GrblConversation
    laser = tmp_path / "laser.toml"
    laser.write_text(
        'name = "l"\ncontroller = "marlin"\nprocess = "laser"\nrapid.velocity = "3 m/min"\n'
        'rapid.acceleration = "180 mm/s2"\n'
    )
    with pytest.raises(OptionError, match="does not send to lasers on Marlin"):
        read_job("part.gcode", str(laser))


@pytest.mark.parametrize(
    "line, meant",
    [
        ("ok", Accepted()),
        ("ok N12 P15 B3", Accepted()),
        ("start", Greeting("", "Marlin")),
        ("Resend: 7", Report("Resend", "7")),
        ("Error:checksum mismatch, Last Line: 6", Report("line error", "checksum mismatch, Last Line: 6")),
        ("Error: Missing checksum", Report("line error", "Missing checksum")),
        ("echo:busy: paused for user", Report("busy", "paused for user")),
        ('echo:Unknown command: "G81 X1"', Report("Unknown command", "G81 X1")),
        ("echo:Home XY First", Report("Home first", "XY")),
        ("X:1.00 Y:-2.50 Z:0.30 E:0.00 Count X:80 Y:-200 Z:120", Report("place", "1.00,-2.50,0.30")),
        ("Cap:ARCS:1", Report("Cap", "ARCS:1")),
        ("//action:paused", Report("action", "paused")),
        (
            "Error:MINTEMP triggered, system stopped! Heater_ID: 0",
            Alarm("a temperature sensor is missing, or too cold"),
        ),
        ("ok\ufffd", InvalidAnswer("ok\ufffd")),
    ],
)
def test_what_marlin_says_is_understood(line: str, meant: object) -> None:
    assert parse_marlin_line(line) == meant


@given(st.text(max_size=200))
def test_no_line_of_marlin_stops_the_reader(line: str) -> None:
    parse_marlin_line(line)
    parse_marlin_line(f"Error:{line}")
    parse_marlin_line(f"echo:{line}")


def test_the_command_sends_to_a_marlin_behind_a_port_and_logs_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(MarlinConversation, "patience", 10.0)  # this board is in real time
    program, log = tmp_path / "part.gcode", tmp_path / "part.log"
    program.write_text(text_of(drilled(3)), encoding="utf-8")
    cable = MarlinOnACable(FakeMarlin({12: "noise"}))
    words = ["send", str(program), "--port", cable.port, "--machine", "marlin-mpcnc", "--yes"]
    try:
        assert leafcut([*words, "--home", "--check"]) == 2
        assert "Marlin has no check mode" in capsys.readouterr().err
        assert leafcut([*words, "--home", "--json", "--accept", "L805", "--log", str(log)]) == 0
    finally:
        cable.close()
    answer = json.loads(capsys.readouterr().out)
    assert answer["schema"] == 1 and answer["complete"] and answer["place"] == [20.0, 10.0, 5.0]
    assert cable.board.bad and obeyed(cable.board) == [*OPENING, *bare(HEAD), *bare(drilled(3)), "M5"]
    text = log.read_text()
    assert re.search(r" > N\d+ G28\*\d+", text) and " < Resend: " in text


def test_the_page_of_the_studio_serves_grbl_boards_alone_and_says_so(tmp_path: Path) -> None:
    from leafcut.studio.control.program import included_or_own_machine, machines_to_send_to
    from leafcut.studio.folder import Folder

    with pytest.raises(OptionError, match="supports only GRBL boards; send to marlin with leafcut send"):
        included_or_own_machine("marlin-mpcnc", Folder(tmp_path))
    assert "marlin-mpcnc" not in machines_to_send_to(Folder(tmp_path)) and "grbl-3018" in machines_to_send_to(
        Folder(tmp_path)
    )


def test_the_page_of_the_studio_says_what_answers_and_what_sends_to_it() -> None:
    from leafcut.studio.control.link import MachineLink

    board = FakeMarlin()
    link = MachineLink(lambda _name, _baud: board, clock=board.clock)
    told = str(link.connect("page", "fake").exception(60.0))
    assert told.startswith("the device on fake is not GRBL ('ok'); this page supports only GRBL boards")
    assert told.endswith("send to Marlin boards with leafcut send") and link.state.said == told


def test_a_board_that_stopped_itself_is_freed_by_m999_and_one_that_moves_is_stopped_for_it() -> None:
    """M999.cpp: with S1 it asks for no line again."""
    board = FakeMarlin()
    talk, _ = met(board)
    assert talk.unlock() is False and board.written.rstrip().rpartition(b" ")[0].endswith(b"M999")
    board = FakeMarlin(keen=0.05)
    talk = MarlinConversation(board, clock=board.clock)
    talk.connect()
    talk.ask("G1 X100 F600")
    talk.unlock()
    assert b"M410\n" in board.written and not board.blocks
