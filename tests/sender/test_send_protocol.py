"""Rules of sending, on a board in plain Python: the buffer, every kind of fault, holds, pauses."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fake_grbl import BUFFER, FakeGrbl
from leafcut.errors import OptionError, SendError
from leafcut.gcode.dialects import load_dialect
from leafcut.read.machine import load_machine
from leafcut.sender.character_counting import CharacterCounter, SentLine
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.job import SendJob, job_from_text
from leafcut.sender.job_checks import check_machine_ready, check_program
from leafcut.sender.lines import Pause
from leafcut.sender.run import Request, RunResult, RunView, SendRun
from leafcut.sender.run_texts import ending_in_words

MACHINE = load_machine("grbl-3018")
HEAD = ["G21 G90 G94 G17", "G0 Z5", "M3 S900"]


#: Lines of our own before the first of the program.
OPENING = 5


def job_with(lines: Sequence[str]) -> SendJob:
    return job_from_text("\n".join([*HEAD, *lines, "M30", ""]), "part.nc", MACHINE, load_dialect("grbl"), None)


def drilled(count: int) -> list[str]:
    return [text for k in range(count) for text in (f"G0 X{k} Y0", "Z1", "G1 Z-1 F100", "G0 Z5")]


def sent(
    board: FakeGrbl,
    job: SendJob,
    watch: Callable[[SendRun, RunView], None] = lambda run, view: None,
    prompt: Callable[[Pause, Sequence[str]], str | None] | None = None,
) -> RunResult:
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    run = SendRun(talk, talk.read_facts_at_rest(), job, job.steps, prompt=prompt)
    run.observe = lambda view: watch(run, view)
    return run.run()


@given(
    decimals=st.lists(st.integers(0, 12), min_size=1, max_size=60),
    paces=st.lists(st.integers(0, 12), min_size=1, max_size=7),
)
def test_the_buffer_never_holds_more_than_it_has_room_for_and_every_line_arrives_in_order(decimals, paces) -> None:
    lines = [f"G1 X{k % 9}.{'1' * n}1 F{100 + k}" for k, n in enumerate(decimals)]
    board = FakeGrbl(tuple(paces))
    job = job_with([*lines, "G0 Z5"])
    ending = sent(board, job)
    assert ending.complete, ending.reason
    assert board.most <= BUFFER
    assert board.taken == [step.text for step in job.steps if isinstance(step, SentLine)]
    assert board.realtime == []


def test_the_buffer_is_kept_full_while_the_board_is_slow() -> None:
    board = FakeGrbl((20,))
    sent(board, job_with(drilled(20)))
    assert 110 < board.most <= BUFFER


def test_a_line_that_does_not_fit_is_not_sent() -> None:
    counter = CharacterCounter()
    counter.record_sent(SentLine("X" * 79))
    assert not counter.fits(SentLine("X" * 79)) and counter.fits(SentLine("X" * 46))
    with pytest.raises(ValueError, match="does not fit"):
        counter.record_sent(SentLine("X" * 79))
    assert counter.record_answer() == SentLine("X" * 79) and counter.record_answer() is None and counter.bytes == 0


@pytest.mark.hazard
@pytest.mark.parametrize(
    "fault, told",
    [
        ("error:20", r"line 20 'G0 X4 Y0': error 20: the controller does not support this word"),
        ("error:99", r"line 20 'G0 X4 Y0': error 99: unknown to GRBL"),
        ("alarm", r"alarm 1: a limit switch was reached.*the machine is locked by an alarm"),
        ("reset", r"the controller was reset while the machine was in line \d+"),
        ("garbage", r"invalid answer: 'o.k.*check the cable"),
        ("drop", r"an answer was lost on the way"),
        ("twice", r"is another program connected to it"),
        ("silent", r"fake no longer responds.*the machine runs its buffered lines, at most up to line \d+"),
        ("lost", r"the connection to fake is lost.*its spindle may stay on"),
    ],
)
def test_every_fault_ends_the_run_with_the_machine_stopped_and_its_state_told(fault: str, told: str) -> None:
    job = job_with(drilled(20))
    board = FakeGrbl((3,), {20 + OPENING: fault})
    board.strict = fault != "twice"  # then nobody can know any more what is in the buffer
    ending = sent(board, job)
    words = ending_in_words(ending, job)
    assert not ending.complete and re.search(told, words), words
    # Before the first hole no work is done: there is no position to resume from.
    assert "\n" not in words
    assert ("resume with --from-hole 11" if fault == "drop" else "start from the beginning") in words
    if fault != "lost":
        assert board.realtime == [b"!"] * (fault != "alarm") + [b"\x18"] and not board.buffer
    # Lines sent after it were never accepted: nothing is executed after the stop.
    assert len(board.taken) <= 20 + OPENING + 24 or fault == "drop"


@pytest.mark.hazard
def test_after_a_reset_without_an_alarm_the_position_is_not_trusted() -> None:
    """GRBL 1.1h reports no alarm if a reset during a move arrives between its checks for alarms and for resets."""
    job = job_with(drilled(20))
    ending = sent(FakeGrbl((3,), {40 + OPENING: "reset"}), job)
    assert (ending.state, ending.homed) == ("standing still", False)
    assert "after homing, or after setting the position" in ending_in_words(ending, job)


def test_stop_by_the_person_holds_first_and_resets_then() -> None:
    board = FakeGrbl((5,))

    def watch(run: SendRun, view: RunView) -> None:
        if view.taken >= 10:
            run.queue_request(Request.STOP)

    ending = sent(board, job_with(drilled(20)), watch)
    assert ending.reason == "stopped by you" and ending.homed
    assert board.realtime == [b"!", b"\x18"]


@pytest.mark.parametrize("at_once", [False, True])
def test_it_goes_on_also_where_that_is_asked_for_while_it_still_slows_down(at_once: bool) -> None:
    """Until it stands GRBL overhears it (gnea/grbl 1.1, protocol.c: EXEC_CYCLE_START)."""

    class Slow(FakeGrbl):
        left = 3

        def _act(self, byte: bytes) -> None:
            slows = self.state == "Hold" and self.left > 0
            if byte == b"~" and slows:
                self.realtime.append(byte)
                return
            self.left -= byte == b"?" and slows
            self.shown = "Hold:1" if self.state == "Hold" and self.left > 0 else ""
            super()._act(byte)

        def read(self, seconds: float) -> bytes:
            assert self.now < 600.0, "it never goes on"
            return super().read(seconds)

    board = Slow((5,))
    asked: list[Request] = []

    def watch(run: SendRun, view: RunView) -> None:
        held = view.state == "Hold"
        for wanted in [Request.HOLD, Request.RESUME] if at_once else [Request.RESUME if held else Request.HOLD]:
            if wanted not in asked and view.taken >= 10:
                asked.append(wanted)
                run.queue_request(wanted)

    assert sent(board, job_with(drilled(20)), watch).complete
    assert asked == [Request.HOLD, Request.RESUME]
    assert board.realtime == [b"!", b"~"]


def test_the_override_goes_up_a_step_at_a_time_and_back() -> None:
    """The board takes two steps that come at once for one."""
    board = FakeGrbl((30,))
    seen: list[int] = []

    def watch(run: SendRun, view: RunView) -> None:
        seen.append(view.override)
        if len(seen) == 1:
            for _ in range(3):
                run.queue_request(Request.FASTER)
        if view.override == 130 and 130 not in seen[:-1]:
            run.queue_request(Request.NORMAL)

    assert sent(board, job_with(drilled(10)), watch).complete
    assert board.realtime == [b"\x91"] * 3 + [b"\x90"]
    assert seen[-1] == 100


def test_whatever_is_left_active_in_a_board_the_program_begins_in_the_state_in_which_it_was_read() -> None:
    """Otherwise a program without G90 would run as G91 after a program that ended in G91."""
    board = FakeGrbl()
    assert sent(board, job_from_text("G0 Z5\nG0 X1 Y1\nM30\n", "part.nc", MACHINE, load_dialect("grbl"), "in")).complete
    assert board.taken[:4] == ["G17G90G94G40G49G80", "G54", "G20", "G0Z5"]
    board = FakeGrbl()
    assert sent(board, job_with(drilled(1))).complete
    assert board.taken[:OPENING] == ["G17G90G94G40G49G80", "G54", "G21", "M5", "M9"]


@pytest.mark.hazard
@given(
    faults=st.dictionaries(
        st.integers(1, 60),
        st.sampled_from(["error:3", "error:x", "alarm", "reset", "garbage", "drop", "twice", "silent", "lost", ""]),
        max_size=4,
    ),
    paces=st.lists(st.integers(0, 9), min_size=1, max_size=4),
)
def test_whatever_a_board_does_a_run_ends_with_one_line_and_complete_only_if_all_was_answered(faults, paces) -> None:
    job = job_with(drilled(10))
    board = FakeGrbl(tuple(paces), faults)
    board.strict = False
    ending = sent(board, job)
    words = ending_in_words(ending, job)
    assert "\n" not in words and 0 < len(words) < 1000
    hurt = [fault for number, fault in faults.items() if fault and number <= len(board.taken)]
    assert ending.complete == (not hurt)
    if hurt and not board.lost:
        assert board.realtime[-1] == b"\x18"


def test_a_change_of_tool_waits_stops_the_spindle_and_never_reaches_the_board() -> None:
    asked: list[str] = []
    board = FakeGrbl((2,))

    def prompt(pause: Pause, _said: Sequence[str]) -> str:
        assert not board.buffer
        asked.append(str(pause))
        return ""

    lines = [*drilled(2), "M5", "(6 mm mill)", "T2 M6", "S500 M3", *drilled(1), "M0 (turn the part)", *drilled(1)]
    job = job_with(lines)
    ending = sent(board, job, prompt=prompt)
    assert ending.complete, ending.reason
    assert asked == ["line 14: mount tool T2 (6 mm mill)", "line 20: pause (turn the part)"]
    assert not any("M6" in line or "M0" in line for line in board.taken)
    at = board.taken.index("T2")
    assert board.taken[at - 2 : at + 2] == ["M5", "M5", "T2", "S500M3"]


def test_what_is_typed_at_a_change_is_undone_and_the_program_goes_on_from_above_in_its_state() -> None:
    board = FakeGrbl((1,))
    typed = ["$J=G91Z5F500", "G91", "G10 L20 P0 Z0", ""]

    def prompt(_pause: Pause, _said: Sequence[str]) -> str:
        return typed.pop(0)

    lines = [*drilled(2), "M5", "T2 M6", "S500 M3", *drilled(2)]
    assert sent(board, job_with(lines), prompt=prompt).complete
    at = board.taken.index("G10 L20 P0 Z0") + 1
    assert board.taken[at : at + 8] == [
        "M5",
        "M9",
        "G21G90G94G17G40G49",
        "G54",
        "G0Z30",
        "G0X1Y0",
        "S900",
        "G0Z5",
    ]
    assert board.taken[at + 8 : at + 13] == ["G21", "F100", "G17G90", "T2", "S500M3"]


def test_nobody_to_ask_is_said_before_anything_is_sent_but_the_first_tool_is_in() -> None:
    board = FakeGrbl()
    assert sent(board, job_with(["M5", "T1 M6", "M3 S900", *drilled(1)])).complete
    board = FakeGrbl()
    with pytest.raises(
        OptionError, match=r"stops for the operator \(line 4: pause\), but no terminal is available to ask"
    ):
        sent(board, job_with(["M0", *drilled(1)]))
    assert board.taken == []


class Deaf(FakeGrbl):
    """Always gives the same answer."""

    def __init__(self, words: bytes) -> None:
        super().__init__()
        self.words = words

    def write(self, data: bytes) -> None:
        pass

    def read(self, seconds: float) -> bytes:
        self.now += seconds
        said, self.words = self.words, b""
        return said


@pytest.mark.parametrize(
    "words, told",
    [
        (b"", "no response on fake; is the machine on"),
        (b"start\r\necho:Marlin 2.1.2\r\n", r"the device on fake is not GRBL \('echo:Marlin 2\.1\.2'\)"),
        (bytes(range(128, 255)), "sends invalid data .*; check --baud and the cable"),
        (b"x" * 5000, "is not GRBL"),
    ],
)
def test_what_is_no_grbl_is_told_in_one_line(words: bytes, told: str) -> None:
    board = Deaf(words)
    with pytest.raises(SendError, match=told) as caught:
        GrblConversation(board, clock=board.clock).connect()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "state, told",
    [
        ("Sleep", "is asleep; wake it with --unlock"),
        ("Check", "is in check mode; reset it with --unlock"),
        ("Door:1", "is stopped by its safety door; reset it with --unlock"),
        ("Tool", "is waiting for a tool change; wait until it has stopped, or reset it with --unlock"),
    ],
)
def test_a_machine_that_does_not_stand_ready_is_refused_with_what_helps(state: str, told: str) -> None:
    board = FakeGrbl()
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    facts = talk.read_facts_at_rest()
    does, _, detail = state.partition(":")
    status = replace(facts.status, state=does, detail=int(detail) if detail else None)
    with pytest.raises(SendError, match=f"the machine {told}$"):
        check_machine_ready(replace(facts, status=status), unhomed=False)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, told",
    [
        ({32: 1}, r"laser mode is on \(\$32=1\), but the program is for a spindle"),
        ({30: 500}, r"S900 in line 3 is above the controller's \$30=500"),
        ({130: 90}, r"line 4 goes to X -100\.000 mm .* outside the travel of -90 to 0 mm"),
        ({132: 20}, r"goes to Z"),
        ({22: 0}, r"homing is off \(\$22=0\).*--unhomed"),
    ],
)
def test_a_machine_that_is_set_otherwise_is_refused(change: dict[int, float], told: str) -> None:
    board = FakeGrbl()
    board.settings |= change
    board.place = "-1.000,-1.000,-1.000"
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    facts = talk.read_facts_at_rest()
    job = job_with([*drilled(2), "G0 X99", "G0 X0"])

    def checked() -> None:
        check_machine_ready(facts, unhomed=False)
        check_program(job, facts, unhomed=False)

    with pytest.raises(SendError, match=told):
        checked()


def test_a_board_that_restarts_when_its_port_is_opened_and_is_never_homed_asks_for_its_zero() -> None:
    """It counts from its current position, but keeps the earlier work offset."""
    board = FakeGrbl()
    board.settings[22] = 0
    board.say("Grbl 1.1h ['$' for help]")
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    with pytest.raises(SendError, match=r"restarted .* add --zero-here"):
        check_machine_ready(talk.read_facts_at_rest(), unhomed=True, restarted=talk.restarted)
    talk.zero_here()
    assert board.taken == ["G10 L20 P1 X0 Y0 Z0"]
    check_machine_ready(talk.read_facts_at_rest(), unhomed=True, restarted=talk.restarted)


def test_reports_in_inches_are_understood() -> None:
    board = FakeGrbl()
    board.settings[13] = 1
    board.origin, board.place = "-4.000,-4.000,-2.000", "-3.000,-4.000,-1.000"
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    facts = talk.read_facts_at_rest()
    assert facts.work_zero(540) == pytest.approx((-101.6, -101.6, -50.8))
    assert facts.machine_position() == pytest.approx((-76.2, -101.6, -25.4))


def test_a_machine_that_differs_from_its_profile_is_told_and_timed_as_it_is() -> None:
    board = FakeGrbl()
    board.settings |= {110: 60.0, 130: 300, 131: 180, 132: 45}
    board.origin = "-100.000,-100.000,-30.000"
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    facts = talk.read_facts_at_rest()
    job = job_with(drilled(4))
    (issue,) = check_program(job, facts, unhomed=False)
    assert issue.code == "L820" and "$110=60 (800)" in issue.message and "$130" not in issue.message
    slower = job.for_machine(facts.machine_with_settings(job.machine))
    assert sum(map(sum, slower.seconds_by_line)) > sum(map(sum, job.seconds_by_line))


def checked_on(board: FakeGrbl, *lines: str, accept: Sequence[str] = ()) -> None:
    """Check a program on a board in its current state."""
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    text = "\n".join([*HEAD, *lines, "M30", ""])
    check_program(
        job_from_text(text, "part.nc", MACHINE, load_dialect("grbl"), None, accept),
        talk.read_facts_at_rest(),
        unhomed=False,
    )


#: The work zero of the fake board is at Z-50 in machine coordinates.
LOW, HIGH = "-90.000,-100.000,-89.000", "-90.000,-100.000,-5.000"


@pytest.mark.hazard
@pytest.mark.parametrize("name", ["G28", "G30"])
@pytest.mark.parametrize(
    "lines, code, number, height",
    [
        (["G91 {} Z0"], "L802", 8, "-39.000"),
        (["G91", "{} Z0", "G90"], "L802", 9, "-39.000"),
        (["{}"], "L801", 8, "-39.000"),
        (["{} Z20"], "L802", 8, "-39.000"),
    ],
)
def test_a_stored_place_below_the_surface_is_refused(
    name: str, lines: list[str], code: str, number: int, height: str
) -> None:
    """39 mm below the surface, and inside the travel: by `$#`, whatever the other stored place is."""
    board = FakeGrbl()
    board.stored |= {name: LOW, "G30" if name == "G28" else "G28": HIGH}
    moves = [*drilled(1), *(line.format(name) for line in lines)]
    told = rf"line {number} .*rapid at Z{height}, below the surface.*stored for {name} is Z-89\.000.*--accept {code}$"
    with pytest.raises(SendError, match=told):
        checked_on(board, *moves)
    board.stored[name] = HIGH
    checked_on(board, *moves)


@pytest.mark.hazard
def test_a_move_after_a_stored_place_or_a_machine_place_has_its_height() -> None:
    """G53 is checked as G28 is, and so is the next move across, whose height the program alone does not say."""
    board = FakeGrbl()
    board.origin = "-100.000,-100.000,-30.000"
    with pytest.raises(SendError, match=r"line 8 'G53 G0 Z-40' is a rapid at Z-10\.000.*the work zero is at Z-30\.000"):
        checked_on(board, *drilled(1), "G53 G0 Z-40", "G0 X5")
    with pytest.raises(SendError, match=r"line 9 'G0 X5' is a rapid at Z-10\.000.*line 8 left the tool there"):
        checked_on(board, *drilled(1), "G53 G0 Z-40", "G0 X5", accept=["L802"])
    checked_on(board, *drilled(1), "G53 G0 Z-40", "G0 X5", accept=["L801", "L802"])
    checked_on(board, *drilled(1), "G53 G0 Z-5", "G0 X5")
    # Named in a comment alone: where it goes by G53 counts, and not what is stored.
    board.stored["G28"] = LOW
    checked_on(board, *drilled(1), "G53 G0 Z-5 (not G28)")


def test_a_board_that_does_not_report_a_stored_place_is_not_sent_there() -> None:
    board = FakeGrbl()
    del board.stored["G28"]
    checked_on(board, *drilled(1))
    with pytest.raises(
        SendError, match=r"line 8 goes to the position stored for G28, .* does not report that position"
    ):
        checked_on(board, *drilled(1), "G28 G91 Z0")


@pytest.mark.hazard
@pytest.mark.parametrize("line", ["G28", "G53 G0 X-100 Y-100"])
def test_a_first_move_across_starts_above_the_program(line: str) -> None:
    """Both go sideways from where the tool stands: here 10 mm below the surface."""
    board = FakeGrbl()
    board.place = "-150.000,-150.000,-60.000"
    text = "\n".join(["G21 G90 G94 G17", line, "G0 Z5", "M3 S900", *drilled(1), "M30", ""])
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    job = job_from_text(text, "part.nc", MACHINE, load_dialect("grbl"), None)
    with pytest.raises(SendError, match=r"line 2 moves in X or Y before .* the tool is at Z-10\.000"):
        check_program(job, talk.read_facts_at_rest(), unhomed=False)
    board.place = "-150.000,-150.000,-1.000"
    check_program(job, talk.read_facts_at_rest(), unhomed=False)


@pytest.mark.hazard
def test_a_cut_needs_a_spindle_that_the_program_starts_and_that_has_a_speed() -> None:
    lines = ["G21 G90 G94 G17", "G0 Z5", "{}", *drilled(2), "M30", ""]

    def job(start: str, accept: Sequence[str] = ()) -> SendJob:
        return job_from_text("\n".join(lines).format(start), "part.nc", MACHINE, load_dialect("grbl"), None, accept)

    with pytest.raises(OptionError, match=r"is not sent: L803 the program never starts the spindle.*--accept L803"):
        job("G4 P1")
    job("G4 P1", ["L803"])
    board = FakeGrbl()
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    with pytest.raises(SendError, match=r"line 3 starts the spindle without a speed, .* S0, and line 6 cuts; add S"):
        check_program(job("M3"), talk.read_facts_at_rest(), unhomed=False)
    check_program(job("M3 S900"), talk.read_facts_at_rest(), unhomed=False)
    check_program(job("S900\nM3"), talk.read_facts_at_rest(), unhomed=False)
    for speed in ("", " S900"):  # a spindle that is only switched, and one that has its speed
        board.speed = speed
        check_program(job("M3"), talk.read_facts_at_rest(), unhomed=False)
