"""One number means different things to GRBL, grblHAL and FluidNC: the list of the board's own firmware is used."""

from __future__ import annotations

import pytest
from fake_families import CONFIGURATION, FakeFluidNc, FakeGrblHal
from fake_marlin import FakeMarlin

from fake_grbl import FakeGrbl
from leafcut.errors import OptionError, SendError
from leafcut.gcode.dialects import load_dialect
from leafcut.read.controllers.importing import machine_from_settings
from leafcut.read.machine import load_machine
from leafcut.sender.answers import Greeting, Report, Status
from leafcut.sender.controller_facts import Facts
from leafcut.sender.error_texts import alarm_in_words, error_in_words, firmware_family
from leafcut.sender.firmware import query_settings
from leafcut.sender.grbl import GrblConversation, parse_grbl_line
from leafcut.sender.grbl_facts import facts_from_answers
from leafcut.sender.job import SendJob, job_from_text
from leafcut.sender.job_checks import check_machine_ready, check_program
from leafcut.sender.marlin import MarlinConversation
from leafcut.sender.run import Request, RunResult, RunView, SendRun


@pytest.mark.parametrize(
    "line, family",
    [
        ("Grbl 1.1h ['$' for help]", ""),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", "grblHAL"),
        ("[FIRMWARE:grblHAL]", "grblHAL"),
        ("Grbl 3.7 [FluidNC v3.7.12 (wifi) '$' for help]", "FluidNC"),
        ("[VER:3.7 FluidNC v3.7.12:]", "FluidNC"),
    ],
)
def test_the_firmware_is_told_by_its_greeting_or_its_version(line: str, family: str) -> None:
    assert firmware_family(line) == family
    assert isinstance(parse_grbl_line(line), Greeting) == line.startswith("Grbl")


def test_numbers_that_mean_different_things_are_told_by_the_firmware() -> None:
    """Status_LimitsEngaged is 45 and Status_EStop 50 (grblHAL errors.h); FsFileNotFound is 65 (FluidNC Error.h)."""
    assert "limit switch" in error_in_words(45, "grblHAL") and "emergency stop" in error_in_words(50, "grblHAL")
    assert error_in_words(65, "FluidNC") == "error 65: the file does not exist"
    assert error_in_words(20, "FluidNC") == error_in_words(20)
    assert "unknown to FluidNC" in error_in_words(45, "FluidNC")
    assert "unknown to GRBL" in error_in_words(45)
    assert "emergency stop" in alarm_in_words(10, "grblHAL") and "spindle" in alarm_in_words(10, "FluidNC")
    assert "homing is needed" in alarm_in_words(14, "FluidNC") and "spindle" in alarm_in_words(14, "grblHAL")


class Says:
    """A port at which a controller greets, then refuses everything."""

    name = "a port"

    def __init__(self, greeting: bytes) -> None:
        self.said = greeting

    def read(self, _seconds: float) -> bytes:
        said, self.said = self.said, b""
        return said

    def write(self, _data: bytes) -> None:
        self.said = b"error:39\r\n"


class Answers:
    """Gives the same answer to every byte."""

    name = "fake"

    def __init__(self, answers: dict[bytes, bytes]) -> None:
        self.answers, self.said, self.now = answers, b"", 0.0

    def clock(self) -> float:
        return self.now

    def close(self) -> None:
        """Do nothing: no resource is open."""

    def read(self, seconds: float) -> bytes:
        self.now += seconds
        said, self.said = self.said, b""
        return said

    def write(self, data: bytes) -> None:
        self.said += b"".join(self.answers.get(bytes([byte]), b"") for byte in data)


@pytest.mark.parametrize(
    "greeting, told",
    [
        (b"Grbl 3.7 [FluidNC v3.7.12 (wifi) '$' for help]\r\n", "the value of P is too large"),
        (b"GrblHAL 1.1f ['$' or '$HELP' for help]\r\n", "a value is out of range"),
    ],
)
def test_a_conversation_explains_by_the_firmware_that_greeted(greeting: bytes, told: str) -> None:
    # As much of a port as this needs; no time passes.
    talk = GrblConversation(Says(greeting), clock=lambda: 0.0)  # type: ignore[arg-type]
    talk.listen()
    with pytest.raises(SendError, match=f"'G4 P1' was refused: error 39: {told}$"):
        talk.ask("G4 P1")


@pytest.mark.parametrize(
    ("board", "kind", "rate"),
    [
        (FakeGrbl(), "grbl", None),
        (FakeGrblHal(), "grbl", None),
        (FakeFluidNc(), "fluidnc", 5000.0),
        (FakeMarlin(), "marlin", 3000.0),
    ],
)
def test_the_settings_of_a_board_are_asked_for_and_are_those_that_it_sends_by(
    board: FakeGrbl | FakeMarlin, kind: str, rate: float | None
) -> None:
    found, text = query_settings(board, clock=board.clock)
    assert found == kind
    machine = machine_from_settings(text, "port", found).machine
    speaker = MarlinConversation if kind == "marlin" else GrblConversation
    talk = speaker(board, clock=board.clock)
    talk.connect()
    facts = talk.read_facts_at_rest()
    assert facts.clock.rates is not None and facts.clock.accelerations is not None
    assert machine.rapid_velocity == pytest.approx(facts.clock.rates)
    assert machine.acceleration == pytest.approx(facts.clock.accelerations)
    if rate is not None:
        assert machine.rapid_velocity[0] == pytest.approx(rate / 60.0)
    assert machine.travel_min is not None and machine.travel_max is not None
    if kind == "marlin":
        assert (machine.travel_min, machine.travel_max) == (facts.low, facts.high)


def test_a_board_of_another_kind_than_said_is_refused() -> None:
    with pytest.raises(OptionError, match=r"--kind linuxcnc: only grbl, fluidnc, marlin can be read from a port"):
        query_settings(FakeGrbl(), "linuxcnc")
    board = FakeMarlin()  # it answers to nothing before the line ends
    with pytest.raises(SendError, match=r"the device on fake is not GRBL \('ok'\)"):
        query_settings(board, "grbl", clock=board.clock)


@pytest.mark.parametrize(
    ("answers", "told"),
    [
        ({}, "no response on fake; is the machine on"),
        ({b"\n": b"error:9\r\n"}, r"is not GRBL, grblHAL, FluidNC or Marlin \('error:9'\)"),
        ({b"\n": b"ok\r\n"}, r"is not GRBL, grblHAL, FluidNC or Marlin \('ok'\)"),
        ({b"\n": b"\r\nERROR\r\n"}, r"is not GRBL, grblHAL, FluidNC or Marlin \('ERROR'\)"),
        ({b"?": b"<Idle|MPos:0,0,0|FS:0,0>\r\n"}, "reports its state, but accepts no line"),
        ({b"?": b"<Idle|MPos:0,0,0|FS:0,0>\r\n", b"\n": b"ok\r\n"}, r"the device on fake is not GRBL \('ok'\)"),
    ],
)
def test_what_answers_as_no_board_does_is_not_called_silent(answers: dict[bytes, bytes], told: str) -> None:
    """A modem, a login, a board with another firmware: each answers a line ending or a query."""
    board = Answers(answers)
    with pytest.raises(SendError, match=told):
        query_settings(board, clock=board.clock)


def drilling() -> SendJob:
    lines = [
        "G21 G90 G94 G17",
        "G0 Z5",
        "M3 S900",
        "G0 X1 Y1",
        "Z1",
        "G1 Z-1 F100",
        "G0 Z5",
        "G0 X9",
        "G1 Z-1",
        "G0 Z5",
    ]
    return job_from_text(
        "\n".join([*lines, "M30", ""]), "part.nc", load_machine("grbl-3018"), load_dialect("grbl"), None
    )


def met(board: FakeGrbl) -> tuple[GrblConversation, Facts]:
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    return talk, talk.read_facts_at_rest()


def sent(board: FakeGrbl) -> RunResult:
    talk, facts = met(board)
    job = drilling()
    check_machine_ready(facts, unhomed=False)
    check_program(job, facts, unhomed=False)
    run = SendRun(talk, facts, job, job.steps)
    seen: list[str] = []

    def observe(view: RunView) -> None:
        seen.append(view.state)
        if len(seen) == 1:
            run.queue_request(Request.HOLD)
        elif view.state == "Hold":
            run.queue_request(Request.RESUME)

    run.observe = observe
    ending = run.run()
    assert "Hold" in seen
    return ending


def test_a_grblhal_that_takes_question_marks_for_letters_is_asked_held_and_freed_by_its_own_bytes() -> None:
    """grbl.h: CMD_STATUS_REPORT 0x80, CMD_CYCLE_START 0x81, CMD_FEED_HOLD 0x82; the buffer size is in [OPT:."""
    board = FakeGrblHal()
    assert met(board)[1].buffer == 1024
    ending = sent(board)
    assert ending.complete, ending.reason
    assert board.realtime == [b"\x82", b"\x81"]
    assert not any("?" in line or "!" in line for line in board.taken)


def test_settings_that_are_texts_or_empty_are_no_noise_and_five_axes_no_riddle() -> None:
    board = FakeGrblHal()
    _, facts = met(board)
    assert facts.work_zero(540) == (-100.0, -100.0, -50.0)
    assert facts.machine_position() == (-100.0, -100.0, -20.0)
    assert parse_grbl_line("$75=a word, and (one more)") == Report("$75", "a word, and")
    assert parse_grbl_line("$74=") == Report("$74", "")


@pytest.mark.parametrize("homed, ready", [(7, True), (31, True), (3, False), (0, False)])
def test_a_grblhal_says_which_axes_were_homed_and_one_that_was_not_is_refused(homed: int, ready: bool) -> None:
    """`report_home_position`: the mask of homed axes; without a lock at start it stands idle all the same."""
    _, facts = met(FakeGrblHal(homed))
    assert facts.homed is ready
    if ready:
        check_machine_ready(facts, unhomed=False)
        return
    with pytest.raises(SendError, match="reports that it was not homed; add --home"):
        check_machine_ready(facts, unhomed=False)
    check_machine_ready(facts, unhomed=True)


def test_a_grbl_that_is_not_locked_until_it_is_homed_cannot_say_it() -> None:
    """L of [OPT: (gnea/grbl, report.c): HOMING_INIT_LOCK is off."""
    status = Status("Idle", machine=(0.0, 0.0, 0.0))
    answers = [parse_grbl_line(line) for line in ("[VER:1.1h:]", "[OPT:VL,15,128]", "$22=1", "$20=1")]
    with pytest.raises(
        SendError, match="does not report whether it was homed, and does not require homing; add --home"
    ):
        check_machine_ready(facts_from_answers(answers, status, homed=False), unhomed=False)
    check_machine_ready(facts_from_answers(answers, status, homed=True), unhomed=False)
    with pytest.raises(SendError, match=r"does not report the size of its buffer \(\[OPT:V\]\)"):
        facts_from_answers(
            [parse_grbl_line("[VER:1.1h:]"), parse_grbl_line("[OPT:V]"), parse_grbl_line("$22=1")], status, homed=False
        )


def test_an_alarm_with_its_number_in_the_status_is_explained_by_its_firmware() -> None:
    board = FakeGrblHal()
    board.shown = "Alarm:11"
    talk, facts = met(board)
    with pytest.raises(
        SendError, match=r"locked by an alarm \(alarm 11: homing is needed first\); home it with --home"
    ):
        check_machine_ready(facts, unhomed=False, family=talk.family)


@pytest.mark.parametrize("state, told", [("ConfigAlarm", "its configuration is invalid"), ("Critical", "reset it")])
def test_what_locks_a_fluidnc_is_told(state: str, told: str) -> None:
    board = FakeFluidNc()
    board.shown = state
    _, facts = met(board)
    with pytest.raises(SendError, match=told):
        check_machine_ready(facts, unhomed=True)


def test_a_fluidnc_is_known_by_its_configuration_and_not_by_the_few_numbers_that_it_shows() -> None:
    """Machine/Axes.cpp: X homed downwards to 0 goes up to 200, Y homed upwards to 5 goes down to -195."""
    _, facts = met(FakeFluidNc())
    assert facts.travel_limits() == ((0.0, -195.0, -100.0), (200.0, 5.0, 0.0))
    assert facts.fastest == 24000.0 and facts.buffer == 128
    assert facts.homing and facts.homed and facts.soft_limits
    timed = facts.machine_with_settings(load_machine("grbl-3018"))
    assert timed.rapid_velocity == pytest.approx((5000 / 60, 4000 / 60, 800 / 60))
    assert timed.acceleration == (150.0, 150.0, 25.0) and timed.corner_deviation == 0.02
    ending = sent(FakeFluidNc())
    assert ending.complete, ending.reason
    board = FakeFluidNc()
    board.origin = "-3.000,-100.000,-50.000"
    with pytest.raises(SendError, match=r"line 4 goes to X -2\.000 mm .* \(max_travel_mm of x\)"):
        check_program(drilling(), met(board)[1], unhomed=False)


@pytest.mark.parametrize(
    "was, now, told",
    [
        ("must_home: true", "must_home: false", "does not report whether it was homed"),
        ("cycle: 1", "cycle: -1", r"homing is off \(not every axis has a homing cycle\)"),
        ("max_travel_mm: 100.000000", "max_travel_mm: much", r"\$CD:\d+: max_travel_mm of z is 'much'"),
        ("axes:", "axes: &a", "has an anchor"),
    ],
)
def test_a_fluidnc_of_which_something_cannot_be_known_is_refused_in_one_line(was: str, now: str, told: str) -> None:
    board = FakeFluidNc(CONFIGURATION.replace(was, now))
    with pytest.raises(SendError, match=told) as caught:
        check_machine_ready(met(board)[1], unhomed=False)
    assert "\n" not in str(caught.value)


def test_the_soft_limits_of_a_fluidnc_are_on_only_where_each_axis_has_them() -> None:
    """$20 shows only the soft limits of X (SettingsDefinitions.cpp)."""
    _, facts = met(FakeFluidNc(CONFIGURATION.replace("soft_limits: true", "soft_limits: false", 2)))
    assert not facts.soft_limits and "(soft_limits)" in facts.soft_limits_warning
