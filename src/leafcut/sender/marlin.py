"""Communication with Marlin 2, one numbered line at a time.

Every line has a number and a checksum: ``N7 G1 X10*95``. Noise may turn ``G1 X10`` into ``G1 X1``, and Marlin would
execute it. If a numbered line is corrupted, Marlin requests it again (``Resend: 7``). It never executes a numbered
line twice. The next line is sent when the previous line is answered. Marlin answers when a move is planned, not when
it is finished. Therefore its look-ahead buffer (BLOCK_BUFFER_SIZE, 16 blocks, up to 64 on large boards) stays full.

Marlin has no realtime byte for a status query. ``M400`` and ``M114`` report whether it is at rest, and its position.
They wait in the queue like any other line, so they are sent only if no other line is waiting. While a program runs, its
progress is inferred from the accepted lines, and ``busy:`` shows that the board is alive.

* Hold: leafcut sends nothing, and the machine comes to rest after the planned moves.
* Immediate stop: ``M410``. It does not decelerate, so the position may be lost.
* Emergency stop, if the board no longer answers: ``M112`` turns motors and spindle off until a reset.

Source: MarlinFirmware/Marlin 2.1, gcode/queue.cpp (`get_serial_commands`: numbers, checksums, commands that act
before their turn), module/planner.cpp (`quick_stop`: moves are dropped for a second after it), module/motion.cpp
(`quickstop_stepper`: the position is taken from the steppers), gcode/host/M115.cpp, M114.cpp, gcode/control/M211.cpp
(in program coordinates), M17_M18_M84.cpp, M999.cpp, gcode/config/M220.cpp, gcode/host/M113.cpp; marlinfw.org, M410:
"Since there will be no deceleration, steppers are expected to be out of position after this command".
"""

from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

from leafcut.errors import ReadError, SendError, printable
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.read.controllers.importing import machine_from_settings
from leafcut.sender.answers import (
    Accepted,
    Alarm,
    ControllerAnswer,
    Greeting,
    InvalidAnswer,
    Refused,
    Report,
    Status,
    parse_position,
)
from leafcut.sender.character_counting import GRBL_BUFFER
from leafcut.sender.controller_facts import Facts, SettingNames, TimingSettings
from leafcut.sender.conversation import (
    ANSWER_SECONDS,
    STOPPED_SHORT,
    Conversation,
    Log,
    OnAnswer,
    ignore_answer,
    wrong_firmware_error,
)
from leafcut.sender.port import Port

#: Time that a board with a boot loader takes to start, and interval between attempts to reach it, s.
START_SECONDS, KNOCK_SECONDS = 12.0, 1.0
#: Time of silence after which an extra ``ok`` has arrived, s. Marlin sends such an ``ok`` after each ``Resend:``.
QUIET_SECONDS = 0.15
#: A line is sent again if neither an answer nor a ``busy:`` (sent every 2 s) arrives within this time, s. The second
#: value is the maximum number of repeats.
LOST_SECONDS, MAX_RESENDS = 3.0, 3
#: Time for which Marlin ignores moves after a quick stop, with a margin, s (`Planner::quick_stop`).
DROPPED_SECONDS = 1.3
#: Maximum time for the planned moves if the board sends no ``busy:``, s.
PLANNED_SECONDS = 30.0
#: Words that the firmware may lack. It does not need them in this case: it has one plane, only mm, and no outputs to
#: turn off.
_NOTHING_TO_DO = ("G17", "G21", "M5", "M9")

_NO_BUSY = Message("the firmware does not report that it is busy; turn on M113 S2 (HOST_KEEPALIVE_FEATURE)")
_NO_SETTINGS = Message("the firmware does not report its settings (M503); build the firmware with this command")
_NO_TRAVEL = Message("the firmware does not report its travel (M211), so it has no soft end stops")

_VERSION = re.compile(r"Marlin\s+(?:bugfix-)?(\d+)\.[^\s(]*")
_ENDS = re.compile(r"(Min|Max):\s*X\s*(-?[\d.]+)\s*Y\s*(-?[\d.]+)\s*Z\s*(-?[\d.]+)", re.IGNORECASE)
_M211_WORD = re.compile(r"M211 S([01])")

#: Names of the reports that leafcut responds to. All other messages become a `Report` with a different name or no name.
RESEND, BUSY, PLACE, UNKNOWN, HOME_FIRST, FIRMWARE, CAPABILITY, ACTION = (
    "Resend", "busy", "place", "Unknown command", "Home first", "FIRMWARE_NAME", "Cap", "action",
)  # fmt: skip

_OK = re.compile(r"ok(\s.*)?")
_RESEND = re.compile(r"(?:Resend:|rs)\s*N?(\d{1,9})", re.IGNORECASE)
#: Parts of the error messages for a corrupted line in various versions of Marlin. A `Resend:` follows these errors.
_LINE_ERRORS = ("checksum", "line number", "expected line")
_UNKNOWN = re.compile(r".*Unknown command:\s*\"?([^\"]*)\"?\s*$", re.IGNORECASE)
_HOME_FIRST = re.compile(r"echo:\s*Home\s+([XYZ ]+)\s+First", re.IGNORECASE)
_PLACE = re.compile(r"X:\s*(-?[\d.]+)\s+Y:\s*(-?[\d.]+)\s+Z:\s*(-?[\d.]+)")
_NAMED = re.compile(r"(FIRMWARE_NAME|Cap):\s*(.*)")

#: Explanation of an error that requires a reset.
KILLED = Message(
    "the board has switched off the motors and the spindle (kill): find the cause, then press the reset button"
)
#: Maps a part of an error message to an explanation.
_ERRORS = {
    "kill() called": KILLED,
    "stopped due to errors": Message(
        "the board was stopped by an internal error; unlock it with --unlock (M999) after fixing the cause"
    ),
    "MINTEMP": Message("a temperature sensor is missing, or too cold"),
    "MAXTEMP": Message("a temperature sensor is shorted, or too hot"),
    "Thermal Runaway": Message("a heater does not follow its command"),
    "Heating failed": Message("a heater does not follow its command"),
    "bad parameters": Message("an arc has invalid words"),
    "Watchdog": Message("the watchdog has stopped the board"),
    "flow fault": Message("the coolant has stopped flowing"),
}


def _setting_names_by_axis(word: str) -> tuple[str, str, str]:
    return (f"{word} X", f"{word} Y", f"{word} Z")


_NAMES = SettingNames(
    "M211",
    "M211 S0",
    _setting_names_by_axis("M211"),
    _setting_names_by_axis("M203"),
    _setting_names_by_axis("M201"),
    coordinates=Message("the program's coordinates"),
)


class NotBuiltIn(SendError):
    """The firmware was built without support for a command."""


@dataclass(frozen=True)
class NumberedLine:
    """A line that was sent, with its number. `is_query` marks queries that this module adds."""

    number: int
    text: str
    is_query: bool = False

    @property
    def data(self) -> bytes:
        """The bytes to send. The checksum is the exclusive or of all bytes before the asterisk."""
        body = f"N{self.number} {self.text}".encode("ascii")
        check = 0
        for byte in body:
            check ^= byte
        return body + b"*%d\n" % check


#: Marlin's idle message (NO_TIMEOUTS). It does not confirm that the last line has arrived.
_WAITS = Report("", "wait")
#: Line that resets the line number, so that the next number is 1. Marlin accepts it regardless of the previous number.
_FIRST = NumberedLine(0, "M110 N0")


class MarlinConversation(Conversation):
    """A connection to a controller with Marlin 2."""

    max_lines, max_ahead = 1, 80

    def __init__(self, port: Port, log: Log | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(port, log, clock)
        self.family = "Marlin"
        #: Number of the last line, number of repeats of the unanswered line, and time of the last answer.
        self._number, self._times, self._heard_at = 0, 0, 0.0
        self._flying: NumberedLine | None = None
        #: The last answered line, and the line to send next if the controller requests that line again.
        self._answered_last: NumberedLine | None = None
        self._next: NumberedLine | None = None
        #: Queries to send as soon as every line has been answered.
        self._queries: deque[str] = deque()
        #: Time until which an ``ok`` does not answer any line, and the number of the requested line.
        self._wanted: tuple[float, int] | None = None
        #: Number of pending answers to lines without a number, and the error of the unanswered line.
        self._stray, self._wrong = 0, ""
        self._place: XYZ | None = None
        self._percent = 100
        #: Whether the machine is on hold, whether a status was requested, and whether the firmware has halted itself.
        self._held = self._asked = self._killed = False
        #: Whether the machine may be moving, and whether the board has restarted and lost its position.
        self._moved = self._anew = False

    # Receiving.

    def parse(self, line: str) -> ControllerAnswer:
        """Convert a line of the controller to an answer."""
        return parse_marlin_line(line)

    def listen(self, seconds: float = 0.02) -> list[ControllerAnswer]:
        """Wait up to `seconds`, and return the answers that have arrived.

        This method also handles requests to resend a line.
        """
        answers = self._send_next()
        for answer in super().listen(seconds):
            if answer != _WAITS:
                self._heard_at = self.clock()
            answers += self._process_answer(answer)
            if self._asked:
                # Marlin has no status report. While lines are unanswered, any message shows that the board is running.
                self._asked = False
                answers.append(self._store_and_return_status(self._inferred_status("Run")))
        return answers

    def _send_next(self) -> list[ControllerAnswer]:
        now, flying = self.clock(), self._flying
        if self._wanted is not None:
            until, number = self._wanted
            if now < until:
                return []
            self._wanted = None
            if flying is not None and number == flying.number + 1:
                self._stray += 1  # its answer was lost or is still to come
                return self._finish_line()
            if flying is not None:
                self._write_line(flying)
        elif flying is not None:
            if now - self._heard_at > LOST_SECONDS * self.patience and self._times < MAX_RESENDS:
                self._times += 1
                self._write_line(flying)
                self._heard_at = now
        elif self._queries:
            self._send_numbered(self._queries.popleft(), is_query=True)
        return []

    def _process_answer(self, answer: ControllerAnswer) -> list[ControllerAnswer]:
        match answer:
            case Accepted():
                return self._process_ok()
            case Greeting():
                self._restart_numbering()
                self._anew = True
            case Alarm(why):
                self._killed |= why is KILLED
            case Report(name, text) if name == RESEND:
                return self._schedule_resend(int(text))
            case Report(name, text) if name == UNKNOWN:
                if text.partition(" ")[0] not in _NOTHING_TO_DO:
                    self._wrong = Message("the firmware does not support '{}'", printable(text, 40))
            case Report(name, text) if name == HOME_FIRST:
                self._wrong = Message("homing of {} is needed first", text)
            case Report(name, _) if name == BUSY:
                return [self._store_and_return_status(self._inferred_status("Run"))]
            case Report(name, text) if name == PLACE:
                self._place = parse_position(text)
            case Report(name, text) if name == ACTION:
                return self._process_prompt(text.partition(" ")[0])
            case _:
                pass
        return [answer]

    def _process_prompt(self, action: str) -> list[ControllerAnswer]:
        if action in ("pause", "paused"):
            self._held = True
        elif action in ("resume", "resumed"):
            self._held = False
        elif action in ("cancel", "poweroff", "disconnect"):
            return [Alarm(Message("the board was stopped at its display ({})", action))]
        return []

    def _process_ok(self) -> list[ControllerAnswer]:
        if self._wanted is not None:
            return []
        if self._flying is None:
            if not self._stray:
                return [Accepted()]
            self._stray -= 1
            return []
        return self._finish_line()

    def _finish_line(self) -> list[ControllerAnswer]:
        line, self._flying, self._times = self._flying, None, 0
        wrong, self._wrong = self._wrong, ""
        assert line is not None
        self._answered_last = line
        if self._next is not None:
            self._flying, self._next = self._next, None
            self._number = self._flying.number
            self._write_line(self._flying)
            return [InvalidAnswer(Message("line {}: {}", line.number, wrong))] if wrong else []
        if not line.is_query:
            return [Refused(wrong) if wrong else Accepted()]
        if line.text == "M114":
            self._moved = False
            return [self._store_and_return_status(self._inferred_status("Idle", self._place))]
        if line.text.startswith("M220"):
            self._percent = int(line.text.rpartition("S")[2])
            return [self._store_and_return_status(self._inferred_status("Run"))]
        return []

    def _schedule_resend(self, number: int) -> list[ControllerAnswer]:
        """Record a request to resend a line.

        The line is sent again after a short wait, because the controller may repeat its request.
        """
        flying, last = self._flying, self._answered_last
        if flying is not None and last is not None and self._next is None and number == last.number == self._number - 1:
            # The `ok` counted for this line belonged to an earlier line; the controller does not have the line.
            self._next, self._flying, self._number = flying, last, number
        newest = self._number
        if number not in (newest, newest + 1) or (self._flying is None and number == newest):
            self._restart_numbering()
            # The controller has restarted its line numbers, or has lost lines.
            self._anew = number == 1
            return [Greeting("", "Marlin") if number == 1 else InvalidAnswer(f"Resend: {number}")]
        self._wanted = (self.clock() + QUIET_SECONDS, number)
        self._wrong = ""
        return []

    def _inferred_status(self, state: str, place: XYZ | None = None) -> Status:
        state = "Hold" if self._held and state == "Idle" else state
        percent = (self._percent, self._percent, 100)
        return Status(state, 0 if state == "Hold" else None, machine=place, work=place, overrides=percent)

    def _store_and_return_status(self, status: Status) -> Status:
        self.store_status(status)
        return status

    # Sending.

    def _write_line(self, line: NumberedLine) -> None:
        self.write(line.data)
        self._heard_at = self.clock()

    def _send_numbered(self, text: str, *, is_query: bool = False) -> None:
        self._number += 1
        self._moved |= not is_query
        self._place = None if text == "M114" else self._place
        self._flying = NumberedLine(self._number, text, is_query)
        self._write_line(self._flying)

    def _restart_numbering(self) -> None:
        self._flying, self._wanted, self._number, self._times, self._wrong = None, None, 0, 0, ""
        self._answered_last = self._next = None
        self._queries.clear()

    @property
    def can_send_line(self) -> bool:
        """Whether a line may be sent. All lines must be answered, and the machine must not be on hold."""
        return not self._held and self._all_lines_answered

    @property
    def _all_lines_answered(self) -> bool:
        return self._flying is None and self._wanted is None and not self._queries

    def send(self, text: str) -> None:
        """Send a line as soon as the previous line has been answered.

        Raises `SendError` if an earlier line gets no answer.
        """
        until = self._deadline(PLANNED_SECONDS)
        while not self._all_lines_answered:
            if any(isinstance(answer, Status) for answer in self.listen()):
                until = self._deadline(PLANNED_SECONDS)
            if self.clock() > until:
                raise SendError("{} no longer responds", self.port.name)
        self._send_numbered(text)

    def request_status(self, *, more: bool = False) -> None:
        """Query the position and whether the machine is at rest.

        If some lines are unanswered, or more lines are about to be sent, the status is inferred without a query.
        """
        if (more and not self._held) or (self._flying is not None and not self._flying.is_query):
            self._asked = True
        elif self._all_lines_answered:
            self._queries.extend(("M400", "M114"))

    # Commands.

    def connect(self) -> Status:
        """Wait for the controller, and return its status.

        Raises `SendError` if the controller does not answer, or if it is not Marlin 2.
        """
        replies: list[str] = []
        for answer in self.receive_answers(START_SECONDS, KNOCK_SECONDS, self._query_board):
            match answer:
                case Accepted():
                    break
                case Greeting():
                    self.restarted = True
                case Report() | InvalidAnswer():
                    replies.append(answer.text)
                case _:
                    pass
        else:
            replies += [printable(self._rest.decode("ascii", "replace"))] * bool(self._rest)
            raise wrong_firmware_error(self.port.name, replies, "Marlin")
        self._synchronise()
        self._query_firmware()
        self._anew = False
        return self.query_status()

    def _query_board(self) -> None:
        self.write(b"\n" + _FIRST.data)

    def _synchronise(self) -> None:
        self._restart_numbering()
        self._stray = 0
        quiet = self.clock()
        until = self._deadline(ANSWER_SECONDS)
        while self.clock() - quiet < 2 * QUIET_SECONDS and self.clock() < until:
            if self.listen():
                quiet = self.clock()

    def _query_firmware(self) -> tuple[str, dict[str, bool]]:
        """Return the name and the capabilities of the firmware. Raises `SendError` if it is not Marlin 2."""
        reports = [report for report in self.ask("M115") if isinstance(report, Report)]
        name = next((report.text for report in reports if report.name == FIRMWARE), "")
        version = _VERSION.match(name)
        if version is None:
            raise wrong_firmware_error(self.port.name, [name or "ok"], "Marlin")
        if int(version[1]) < 2:
            raise SendError("the device on {} is {}; Marlin 2 is needed", self.port.name, printable(version[0], 40))
        pairs = [report.text.rpartition(":") for report in reports if report.name == CAPABILITY]
        return version[0], {name: value.strip() == "1" for name, _, value in pairs}

    def read_facts(self) -> Facts:
        """Read the settings and the state of the controller.

        Raises `SendError` if the controller does not report its settings, its travel or its busy messages.
        """
        version, abilities = self._query_firmware()
        if not re.search(r"M113 S[12]\b", self._query_text("M113", _NO_BUSY)):
            raise SendError(_NO_BUSY)
        settings = self._query_text("M503", _NO_SETTINGS)
        soft_limits_on, low, high = _parse_soft_endstops(self._query_text("M211", _NO_TRAVEL))
        try:
            machine = machine_from_settings(settings, "M503", "marlin").machine
        except ReadError as problem:
            raise SendError("the controller's settings cannot be used: {}", problem) from None
        if machine.units != "mm":
            raise SendError("the controller is set to inches (G20 in M503); leafcut sends millimetres to Marlin")
        status = self._wait_for_rest()
        if status.machine is None:
            raise SendError("the controller does not report its position (M114)")
        return Facts(
            version=version,
            buffer=GRBL_BUFFER,
            status=status,
            low=low,
            high=high,
            names=_NAMES,
            homed=True if self.homed else None,
            soft_limits=soft_limits_on,
            arcs=abilities.get("ARCS", True),
            clock=TimingSettings(machine.rapid_velocity, machine.acceleration, None, machine.corner_deviation),
        )

    def read_settings_text(self) -> tuple[str, str]:
        """Read the settings. Return the kind of the controller and the text.

        The text includes the travel of the axes if the firmware reports it. Raises `SendError` if the firmware does not
        report its settings.
        """
        settings = self._query_text("M503", _NO_SETTINGS)
        with suppress(NotBuiltIn):
            settings += self._query_text("M211", _NO_TRAVEL)
        return "marlin", settings

    def _query_text(self, question: str, lacking: str) -> str:
        """Send a query and return the answer as text.

        Raises `NotBuiltIn` with the message `lacking` if the firmware does not support the command.
        """
        try:
            answers = self.ask(question)
        except SendError:
            if self._flying is not None:  # no answer at all
                raise
            raise NotBuiltIn(lacking) from None
        return (
            "\n".join(answer.text for answer in answers if isinstance(answer, Report) and answer.name != PLACE) + "\n"
        )

    def prepare_for_program(self) -> None:
        """Keep the motors on (M84 S0).

        Otherwise the motors could turn off during a tool change, and the position would be lost.
        """
        self.ask("M84 S0")

    def hold(self) -> None:
        """Stop sending lines. The machine comes to rest after the moves that are already planned."""
        self._held = True

    def resume(self) -> None:
        """Send lines again."""
        self._held = False

    def step_feed_override(self, current: int, target: int) -> None:
        """Set the feed override. It applies to all moves, including rapids, that the board plans from now on."""
        self._queries.append(f"M220 S{target}")

    def homing_command(self) -> str:
        """Return the homing command."""
        return "G28"

    def _abort_homing(self) -> None:
        with suppress(SendError):
            self.stop()

    def zeroing_command(self, axes: str) -> str:
        """Return the command that sets the zero of the given axes to the current position."""
        return "G92 " + " ".join(f"{axis}0" for axis in axes)

    def unlock(self) -> bool:
        """Bring the machine to rest and clear its stop condition. Raises `SendError` if the machine does not answer."""
        if self.query_status().state == "Run":
            self.stop()
        self.ask("M999 S1")  # without S1, it would request lines again
        return False

    def stop(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop the spindle. If the machine may be moving, stop the motors immediately first.

        Raises `SendError` if the controller no longer answers.
        """
        unmoved, self._held, self._resetting = not self._moved, False, True
        try:
            if unmoved:
                self.ask("M5")
                return self._wait_for_rest()
            return self._stop_motors(on_answer)
        finally:
            self._resetting = self._interrupted = False

    def _stop_motors(self, on_answer: OnAnswer) -> Status:
        self.homed = False
        self._queries.clear()
        # Without a number, because it must act before its turn.
        self.write(b"M410\n")
        self._stray += 1
        for answer in self.receive_answers(DROPPED_SECONDS / self.patience):
            on_answer(answer)
        self._restart_numbering()
        self._stray = 0  # the answer to M410 may have been assigned to another line
        if not any(
            isinstance(answer, Accepted)
            for answer in self.receive_answers(ANSWER_SECONDS, KNOCK_SECONDS, self._query_board)
        ):
            self.write(b"M112\n")
            raise SendError("the board does not respond to M410; M112 (emergency stop) was sent")
        self._synchronise()
        self.ask("M5")
        status = replace(self._wait_for_rest(), state=STOPPED_SHORT)
        if self._anew:
            status = replace(status, machine=None, work=None)
        on_answer(status)
        return self._store_and_return_status(status)

    def _wait_for_rest(self) -> Status:
        status = self.query_status(PLANNED_SECONDS)
        while status.state == "Run":
            status = self.query_status(PLANNED_SECONDS)
        return status

    def reset(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop the machine. Marlin cannot be reset over the serial line."""
        return self.stop(on_answer)

    def clean_up_after_alarm(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop any remaining motion after an error. A firmware that has halted itself receives nothing."""
        if self._killed:
            return self._store_and_return_status(Status("Alarm"))
        return self.stop(on_answer)

    def stop_unanswered(self) -> str:
        """Send the emergency stop in case the machine can still receive it."""
        self.write(b"M112\n")
        return Message("M112 (emergency stop) was sent anyway")


def _parse_soft_endstops(text: str) -> tuple[bool, XYZ, XYZ]:
    """Parse the answer to M211. Return whether the soft end stops are on, and the limits of the travel, mm.

    Raises `SendError` if the firmware has no soft end stops, because the travel is unknown in this case.
    """
    ends = {match[1].lower(): match for match in _ENDS.finditer(text)}
    if "min" not in ends or "max" not in ends:
        raise SendError(_NO_TRAVEL)
    low, high = ((float(match[2]), float(match[3]), float(match[4])) for match in (ends["min"], ends["max"]))
    word = _M211_WORD.search(text)
    is_on = word[1] == "1" if word else re.search(r"endstops:\s*ON", text, re.IGNORECASE) is not None
    return is_on, low, high


def parse_marlin_line(line: str) -> ControllerAnswer:
    """Parse a line from a controller. A line with unprintable characters (noise) becomes an `InvalidAnswer`.

        parse("echo:busy: processing")    Report("busy", "processing")

    Source: MarlinFirmware/Marlin, core/language.h (the words), gcode/queue.cpp (`ok_to_send`,
    `flush_and_request_resend`, `gcode_line_error`), gcode/gcode.cpp (`host_keepalive`), gcode/parser.cpp
    (`unknown_command_warning`), gcode/host/M114.cpp and M115.cpp, module/motion.cpp (`report_logical_position`,
    `homing_needed_error`), MarlinCore.cpp (`setup`, `kill`), feature/host_actions.cpp.
    """
    line = line.strip()
    if not line.isprintable() or "\ufffd" in line:
        return InvalidAnswer(printable(line))
    if line == "start":
        return Greeting("", "Marlin")
    if _OK.fullmatch(line):
        return Accepted()
    if match := _RESEND.match(line):
        return Report(RESEND, match[1])
    if line.startswith(("Error:", "!!")):
        return _parse_error(line.partition(":")[2].strip() or line)
    if "endstops hit" in line:
        return Alarm(
            Message("an end stop was hit unexpectedly ({})", printable(line.rpartition("hit:")[2].strip(), 40))
        )
    if match := _UNKNOWN.match(line):
        return Report(UNKNOWN, match[1].strip())
    if match := _HOME_FIRST.match(line):
        return Report(HOME_FIRST, match[1].replace(" ", ""))
    if line.startswith("echo:busy:"):
        return Report(BUSY, line.rpartition(":")[2].strip())
    if match := _PLACE.match(line):
        return Report(PLACE, f"{match[1]},{match[2]},{match[3]}")
    if match := _NAMED.match(line):
        return Report(match[1], match[2].strip())
    if line.startswith("//action:"):
        return Report(ACTION, line.partition(":")[2].strip())
    return Report("", line[:300])


def _parse_error(text: str) -> ControllerAnswer:
    if any(words in text.lower() for words in _LINE_ERRORS):
        return Report("line error", printable(text, 80))
    meaning = next((words for part, words in _ERRORS.items() if part in text), "")
    return Alarm(meaning or Message("Marlin stopped with '{}'", printable(text, 80)))
