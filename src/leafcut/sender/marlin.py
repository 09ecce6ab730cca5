"""Communication with Marlin 2, one numbered line at a time.

Every line has a number and a checksum, ``N7 G1 X10*95``. Marlin executes a line without a number even if it is
corrupted: noise may turn ``G1 X10`` into ``G1 X1``. It refuses a corrupted numbered line and requests it again
(``Resend: 7``). Numbers also make it safe to repeat a line that may be lost, because it is never executed twice. The
next line is sent when the last one is answered. Marlin answers when a move is planned, not when it is finished, so its
look-ahead buffer (BLOCK_BUFFER_SIZE, 16 blocks, up to 64 on large boards) stays full.

Marlin has no realtime byte for its status. ``M400`` and ``M114`` report whether it is at rest, and its position. They
wait in the queue like any line, so they are sent only when no other line is. While it runs, its progress is known from
the accepted lines, and ``busy:`` shows that it is alive.

* Hold: send nothing; the machine comes to rest after the planned moves.
* Immediate stop: ``M410``. It does not decelerate, so the position may be lost.
* Emergency stop, when nothing is answered any more: ``M112`` turns motors and spindle off until a reset.

Source: MarlinFirmware/Marlin 2.1, gcode/queue.cpp (`get_serial_commands`: numbers, checksums, commands that act before
their turn), module/planner.cpp (`quick_stop`: moves are dropped for a second after it), module/motion.cpp
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

from leafcut.errors import ReadError, SendError, shown
from leafcut.model.machine import XYZ
from leafcut.read.controllers.importing import imported
from leafcut.sender import marlin_lines
from leafcut.sender.answers import (
    Accepted,
    Alarm,
    ControllerAnswer,
    Greeting,
    Refused,
    Report,
    Status,
    Strange,
    place_in,
)
from leafcut.sender.conversation import (
    ANSWER_SECONDS,
    STOPPED_SHORT,
    Conversation,
    Heard,
    Log,
    OnAnswer,
    ignore_answer,
    wrong_firmware,
)
from leafcut.sender.counting import GRBL_BUFFER
from leafcut.sender.facts import Clock, Facts, SettingNames
from leafcut.sender.marlin_lines import ACTION, BUSY, CAPABILITY, FIRMWARE, HOME_FIRST, PLACE, RESEND, UNKNOWN
from leafcut.sender.port import Port

#: Start-up time of a board with a boot loader, s; interval of the attempts to reach it, s.
START_SECONDS, KNOCK_SECONDS = 12.0, 1.0
#: After a ``Resend:`` an ``ok`` follows that answers no line. Silence of this length means that it has arrived, s.
QUIET_SECONDS = 0.15
#: A line without an answer or a ``busy:`` (sent every 2 s) for this time, s, is repeated, at most this many times.
LOST_SECONDS, MAX_RESENDS = 3.0, 3
#: Time in which moves are dropped after a quick stop, with a margin, s (`Planner::quick_stop`).
DROPPED_SECONDS = 1.3
#: Maximum time to finish the planned moves without a ``busy:``, s.
PLANNED_SECONDS = 30.0
#: Words that may be missing in the firmware: it then has one plane, millimetres only, and no outputs to turn off.
_NOTHING_TO_DO = ("G17", "G21", "M5", "M9")

_NO_BUSY = "the firmware does not report that it is busy; turn on M113 S2 (HOST_KEEPALIVE_FEATURE)"
_NO_SETTINGS = "the firmware does not say its settings (M503): build it with them"
_NO_TRAVEL = "the firmware does not say its travel (M211): it has no soft end stops"

_VERSION = re.compile(r"Marlin\s+(?:bugfix-)?(\d+)\.[^\s(]*")
_ENDS = re.compile(r"(Min|Max):\s*X\s*(-?[\d.]+)\s*Y\s*(-?[\d.]+)\s*Z\s*(-?[\d.]+)", re.IGNORECASE)
_M211_WORD = re.compile(r"M211 S([01])")


def _axis_names(word: str) -> tuple[str, str, str]:
    return (f"{word} X", f"{word} Y", f"{word} Z")


_NAMES = SettingNames(
    "M211",
    "M211 S0",
    _axis_names("M211"),
    _axis_names("M203"),
    _axis_names("M201"),
    coordinates="the program's coordinates",
)


class NotBuiltIn(SendError):
    """The firmware was built without a command."""


@dataclass(frozen=True)
class NumberedLine:
    """A sent line: its number, its text, and whether it is internal to this module."""

    number: int
    text: str
    ours: bool = False

    @property
    def data(self) -> bytes:
        """The bytes to send. The checksum is the exclusive or of all bytes before the asterisk."""
        body = f"N{self.number} {self.text}".encode("ascii")
        check = 0
        for byte in body:
            check ^= byte
        return body + b"*%d\n" % check


#: Idle message (NO_TIMEOUTS); does not show that the last line has arrived.
_WAITS = Report("", "wait")
#: Makes the next number 1; accepted whatever the last number was.
_FIRST = NumberedLine(0, "M110 N0")


class MarlinConversation(Conversation):
    """A controller with Marlin 2."""

    max_lines, max_ahead = 1, 80

    def __init__(self, port: Port, log: Log | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(port, log, clock)
        self.family = "Marlin"
        #: Last number; number of repeats of the unanswered line; time of the last answer.
        self._number, self._n_repeats, self._heard_at = 0, 0, 0.0
        self._unanswered: NumberedLine | None = None
        #: The last answered line, and the line to send after it if the controller requests it again.
        self._answered_last: NumberedLine | None = None
        self._next: NumberedLine | None = None
        #: Internal lines that wait until no line is unanswered.
        self._own_lines: deque[str] = deque()
        #: Time until which an ``ok`` answers no line, and the number of the requested line.
        self._requested_repeat: tuple[float, int] | None = None
        #: Answers that may still arrive to lines without a number; the error of the unanswered line.
        self._stray_answers, self._line_error = 0, ""
        self._place: XYZ | None = None
        self._percent = 100
        #: Held; a status was requested; the firmware has halted itself.
        self._held = self._asked = self._killed = False
        #: The machine may be moving; its position counter has restarted.
        self._has_moved = self._restarted_now = False

    # Receiving.

    def parse(self, line: str) -> ControllerAnswer:
        """Parse a line of the controller."""
        return marlin_lines.parse(line)

    def listen(self, seconds: float = 0.02) -> list[ControllerAnswer]:
        """Return the answers received, waiting at most `seconds`; repeats are handled here."""
        answers = self._send_due()
        for answer in super().listen(seconds):
            if answer != _WAITS:
                self._heard_at = self.clock()
            answers += self._process(answer)
            if self._asked:
                # Marlin has no status report: while lines are unanswered, any message shows that it runs.
                self._asked = False
                answers.append(self._report_status(self._status_of("Run")))
        return answers

    def _send_due(self) -> list[ControllerAnswer]:
        """Repeat a line or send the next internal line when it is due."""
        now, unanswered = self.clock(), self._unanswered
        if self._requested_repeat is not None:
            due, number = self._requested_repeat
            if now < due:
                return []
            self._requested_repeat = None
            if unanswered is not None and number == unanswered.number + 1:
                self._stray_answers += 1  # its answer was lost or is still to come
                return self._answered()
            if flying is not None:
                self._put(flying)
        elif flying is not None:
            if now - self._heard_at > LOST_SECONDS * self.patience and self._times < MAX_RESENDS:
                self._times += 1
                self._put(flying)
                self._heard_at = now
        elif self._own_lines:
            self._send_numbered(self._own_lines.popleft(), is_own=True)
        return []

    def _process(self, answer: ControllerAnswer) -> list[ControllerAnswer]:
        """Process an answer and return the answers that matter to the caller."""
        match answer:
            case Accepted():
                return self._ok()
            case Greeting():
                self._clear_line()
                self._restarted_now = True
            case Alarm(reason):
                self._killed |= "(kill)" in str(reason)
            case Report(name, text) if name == RESEND:
                return self._repeat_from(int(text))
            case Report(name, text) if name == UNKNOWN:
                if text.partition(" ")[0] not in _NOTHING_TO_DO:
                    self._line_error = f"the firmware does not have this word ('{shown(text, 40)}')"
            case Report(name, text) if name == HOME_FIRST:
                self._line_error = f"homing of {text} is needed first"
            case Report(name, _) if name == BUSY:
                return [self._report_status(self._status_of("Run"))]
            case Report(name, text) if name == PLACE:
                self._place = place_in(text)
            case Report(name, text) if name == ACTION:
                return self._at_display(text.partition(" ")[0])
            case _:
                pass
        return [answer]

    def _at_display(self, action: str) -> list[ControllerAnswer]:
        """Follow a request from the machine's own display."""
        if action in ("pause", "paused"):
            self._held = True
        elif action in ("resume", "resumed"):
            self._held = False
        elif action in ("cancel", "poweroff", "disconnect"):
            return [Alarm(f"it was stopped at its own display ({action})")]
        return []

    def _ok(self) -> list[ControllerAnswer]:
        if self._requested_repeat is not None:
            return []
        if self._unanswered is None:
            if not self._stray_answers:
                return [Accepted()]
            self._stray_answers -= 1
            return []
        return self._answered()

    def _answered(self) -> list[ControllerAnswer]:
        """Mark the unanswered line as answered."""
        line, self._unanswered, self._n_repeats = self._unanswered, None, 0
        wrong, self._line_error = self._line_error, ""
        assert line is not None
        self._answered_last = line
        if self._next is not None:
            self._unanswered, self._next = self._next, None
            self._number = self._unanswered.number
            self._write_line(self._unanswered)
            return [Strange(f"line {line.number}: {wrong}")] if wrong else []
        if not line.ours:
            return [Refused(wrong) if wrong else Accepted()]
        if line.text == "M114":
            self._has_moved = False
            return [self._report_status(self._status_of("Idle", self._place))]
        if line.text.startswith("M220"):
            self._percent = int(line.text.rpartition("S")[2])
            return [self._report_status(self._status_of("Run"))]
        return []

    def _repeat_from(self, number: int) -> list[ControllerAnswer]:
        """Record a request for a line. It is sent after a pause, because the controller may repeat the request."""
        flying, last = self._unanswered, self._answered_last
        if flying is not None and last is not None and self._next is None and number == last.number == self._number - 1:
            # The `ok` counted for this line belonged to an earlier one; the controller does not have the line.
            self._next, self._unanswered, self._number = flying, last, number
        newest = self._number
        if number not in (newest, newest + 1) or (self._unanswered is None and number == newest):
            self._clear_line()
            # The controller has restarted its count, or has lost lines.
            self._restarted_now = number == 1
            return [Greeting("", "Marlin") if number == 1 else Strange(f"Resend: {number}")]
        self._requested_repeat = (self.clock() + QUIET_SECONDS, number)
        self._line_error = ""
        return []

    def _status_of(self, state: str, position: XYZ | None = None) -> Status:
        state = "Hold" if self._held and state == "Idle" else state
        percent = (self._percent, self._percent, 100)
        return Status(state, 0 if state == "Hold" else None, machine=position, work=position, overrides=percent)

    def _report_status(self, status: Status) -> Status:
        self.keep(status)
        return status

    # Sending.

    def _write_line(self, line: NumberedLine) -> None:
        self.write(line.data)
        self._heard_at = self.clock()

    def _send_numbered(self, text: str, *, is_own: bool = False) -> None:
        self._number += 1
        self._has_moved |= not is_own
        self._place = None if text == "M114" else self._place
        self._unanswered = NumberedLine(self._number, text, is_own)
        self._write_line(self._unanswered)

    def _clear_line(self) -> None:
        """Start again: no line is unanswered, and the next number is 1."""
        self._unanswered, self._requested_repeat, self._number, self._n_repeats, self._line_error = None, None, 0, 0, ""
        self._answered_last = self._next = None
        self._own_lines.clear()

    @property
    def takes_lines(self) -> bool:
        """Whether no line is unanswered and the machine is not held."""
        return not self._held and self._is_free

    @property
    def _is_free(self) -> bool:
        return self._unanswered is None and self._requested_repeat is None and not self._own_lines

    def send(self, text: str) -> None:
        """Send a line when no other is unanswered.

        Raises
        ------
        SendError
            An earlier line is not answered.
        """
        deadline = self._deadline(PLANNED_SECONDS)
        while not self._is_free:
            if any(isinstance(answer, Status) for answer in self.listen()):
                deadline = self._deadline(PLANNED_SECONDS)
            if self.clock() > deadline:
                raise SendError(f"nothing answers on {self.port.name} any more")
        self._send_numbered(text)

    def ask_status(self, *, more: bool = False) -> None:
        """Query position and rest if no line is unanswered or follows; otherwise infer the status."""
        if (more and not self._held) or (self._unanswered is not None and not self._unanswered.ours):
            self._asked = True
        elif self._is_free:
            self._own_lines.extend(("M400", "M114"))

    # Commands.

    def connect(self) -> Status:
        """Wait for the controller to start and to answer; return its status.

        Raises
        ------
        SendError
            Nothing answers, or the firmware is not Marlin 2.
        """
        replies: list[str] = []
        for answer in self.receive(START_SECONDS, KNOCK_SECONDS, self._knock):
            match answer:
                case Accepted():
                    break
                case Greeting():
                    self.restarted = True
                case Report() | Strange():
                    replies.append(answer.text)
                case _:
                    pass
        else:
            replies += [shown(self._rest.decode("ascii", "replace"))] * bool(self._rest)
            raise wrong_firmware(self.port.name, replies, "Marlin")
        self._synchronise()
        self._firmware()
        self._restarted_now = False
        return self.fresh_status()

    def _knock(self) -> None:
        self.write(b"\n" + _FIRST.data)

    def _synchronise(self) -> None:
        """Wait until no more answers arrive to earlier lines, and restart the numbering at 1."""
        self._clear_line()
        self._stray_answers = 0
        quiet = self.clock()
        until = self._deadline(ANSWER_SECONDS)
        while self.clock() - quiet < 2 * QUIET_SECONDS and self.clock() < until:
            if self.listen():
                quiet = self.clock()

    def _firmware(self) -> tuple[str, dict[str, bool]]:
        """Return the name and the capabilities of the firmware.

        Raises
        ------
        SendError
            It is not Marlin 2.
        """
        reports = [report for report in self.ask("M115") if isinstance(report, Report)]
        name = next((report.text for report in reports if report.name == FIRMWARE), "")
        version = _VERSION.match(name)
        if version is None:
            raise wrong_firmware(self.port.name, [name or "ok"], "Marlin")
        if int(version[1]) < 2:
            raise SendError(f"what answers on {self.port.name} is {shown(version[0], 40)}; Marlin 2 is needed")
        pairs = [report.text.rpartition(":") for report in reports if report.name == CAPABILITY]
        return version[0], {name: on.strip() == "1" for name, _, on in pairs}

    def gather(self) -> Facts:
        """Return the facts that the controller reports.

        Raises
        ------
        SendError
            It does not report its settings, its travel or busy messages.
        """
        version, abilities = self._firmware()
        if not re.search(r"M113 S[12]\b", self._answer_text("M113", _NO_BUSY)):
            raise SendError(_NO_BUSY)
        settings = self._answer_text("M503", _NO_SETTINGS)
        on, low, high = _soft_endstops(self._answer_text("M211", _NO_TRAVEL))
        try:
            machine = imported(settings, "M503", "marlin").machine
        except ReadError as problem:
            raise SendError(f"the controller's settings cannot be used: {problem}") from None
        if machine.units != "mm":
            raise SendError("the controller counts in inches (G20 in M503); leafcut sends millimetres to Marlin")
        status = self._rest_status()
        if status.machine is None:
            raise SendError("the controller does not say where it is (M114)")
        return Facts(
            version=version,
            buffer=GRBL_BUFFER,
            status=status,
            low=low,
            high=high,
            names=_NAMES,
            homed=True if self.homed else None,
            soft_limits=on,
            arcs=abilities.get("ARCS", True),
            clock=Clock(machine.rapid_velocity, machine.acceleration, None, machine.corner_deviation),
        )

    def gather_settings(self) -> tuple[str, str]:
        """Return the kind and the text of the settings, with the travel if it is known.

        Raises
        ------
        SendError
            It does not report its settings.
        """
        settings = self._answer_text("M503", _NO_SETTINGS)
        with suppress(NotBuiltIn):
            settings += self._answer_text("M211", _NO_TRAVEL)
        return "marlin", settings

    def _answer_text(self, question: str, missing_message: str) -> str:
        """Return the answer to a query as text; `missing_message` is the error for a firmware without this command."""
        try:
            answers = self.ask(question)
        except SendError:
            if self._unanswered is not None:  # not answered at all
                raise
            raise NotBuiltIn(missing_message) from None
        return (
            "\n".join(answer.text for answer in answers if isinstance(answer, Report) and answer.name != PLACE) + "\n"
        )

    def prepare(self) -> None:
        """Keep the motors on: otherwise a tool change would release them and lose the position (M84 S0)."""
        self.ask("M84 S0")

    def hold(self) -> None:
        """Send no more lines; the machine comes to rest after the planned moves."""
        self._held = True

    def resume(self) -> None:
        """Continue sending."""
        self._held = False

    def step_feed(self, current: int, target: int) -> None:
        """Set the feed override, rapids included, for moves that are planned from now on."""
        self._own_lines.append(f"M220 S{target}")

    def home_lines(self) -> str:
        """Return the homing command."""
        return "G28"

    def _give_up_homing(self) -> None:
        with suppress(SendError):
            self.stop()

    def zero_line(self, axes: str) -> str:
        """Return the command that zeroes the current position."""
        return "G92 " + " ".join(f"{axis}0" for axis in axes)

    def unlock(self) -> bool:
        """Bring the machine to rest and clear its stop condition.

        Raises
        ------
        SendError
            It does not answer.
        """
        if self.fresh_status().state == "Run":
            self.stop()
        self.ask("M999 S1")  # without S1 it would request lines again
        return False

    def stop(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop the spindle if the machine has not moved; otherwise stop the motors at once.

        Raises
        ------
        SendError
            The controller no longer answers.
        """
        is_at_rest, self._held, self._resetting = not self._has_moved, False, True
        try:
            if is_at_rest:
                self.ask("M5")
                return self._rest_status()
            return self._stop_motors(on_answer)
        finally:
            self._resetting = self._interrupted = False

    def _stop_motors(self, on_answer: Heard) -> Status:
        self.homed = False
        self._own_lines.clear()
        # Without a number, so that it acts before its turn.
        self.write(b"M410\n")
        self._stray += 1
        for answer in self.receive(DROPPED_SECONDS / self.patience):
            on_answer(answer)
        self._forget()
        self._stray = 0  # its answer may have been counted for a line that had none
        if not any(isinstance(answer, Accepted) for answer in self.receive(ANSWER_SECONDS, KNOCK_SECONDS, self._knock)):
            self.write(b"M112\n")
            raise SendError("it does not answer to M410; M112 (emergency stop) was sent")
        self._synchronise()
        self.ask("M5")
        status = replace(self._rest_status(), state=STOPPED_SHORT)
        if self._restarted_now:
            status = replace(status, machine=None, work=None)
        on_answer(status)
        return self._report_status(status)

    def _rest_status(self) -> Status:
        """Return the status once the machine is at rest."""
        status = self.fresh_status(PLANNED_SECONDS)
        while status.state == "Run":
            status = self.fresh_status(PLANNED_SECONDS)
        return status

    def reset(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop the machine: Marlin has no reset over the serial line."""
        return self.stop(on_answer)

    def halt(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop remaining motion after an error; a halted firmware receives nothing."""
        if self._killed:
            return self._report_status(Status("Alarm"))
        return self.stop(on_answer)

    def stop_unanswered(self) -> str:
        """Send the emergency stop in case the machine still receives."""
        self.write(b"M112\n")
        return "M112 (emergency stop) was sent all the same"


def _soft_endstops(text: str) -> tuple[bool, XYZ, XYZ]:
    """Return whether soft end stops are on, and the limits of the travel, mm, from the answer to M211.

    Raises
    ------
    SendError
        The firmware has no soft end stops, so the travel is unknown.
    """
    limits = {match[1].lower(): match for match in _ENDS.finditer(text)}
    if "min" not in limits or "max" not in limits:
        raise SendError(_NO_TRAVEL)
    low, high = ((float(match[2]), float(match[3]), float(match[4])) for match in (limits["min"], limits["max"]))
    word = _M211_WORD.search(text)
    is_on = word[1] == "1" if word else re.search(r"endstops:\s*ON", text, re.IGNORECASE) is not None
    return is_on, low, high
