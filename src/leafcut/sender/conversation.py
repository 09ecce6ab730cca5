"""Communication with a controller, one request at a time. Each subclass implements the protocol of a firmware."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator

from leafcut.errors import SendError, printable
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.sender.answers import (
    LONGEST_ANSWER,
    Accepted,
    Alarm,
    ControllerAnswer,
    Greeting,
    InvalidAnswer,
    Refused,
    Report,
    Status,
)
from leafcut.sender.controller_facts import Facts
from leafcut.sender.error_texts import alarm_in_words, error_in_words, state_in_words
from leafcut.sender.port import Port

#: Time limits for an answer, for the restart of a board when its port is opened, and for homing, s.
ANSWER_SECONDS, START_SECONDS, HOMING_SECONDS = 5.0, 5.0, 180.0
#: Intervals between status queries while waiting for a result and while idle, s.
POLL_SECONDS, SLOW_POLL_SECONDS = 0.1, 0.5
_READ_SECONDS = 0.02
#: States in which the machine is at rest and refuses every line until the operator intervenes.
LOCKED = ("Alarm", "ConfigAlarm", "Critical", "Sleep")
#: State of a machine that has stopped without decelerating. The motors may have lost steps.
STOPPED_SHORT = "Stopped"


class Interrupted(Exception):
    """The operator has interrupted a wait."""


#: Receives each line that is sent or received, with its direction (">" or "<").
Log = Callable[[str, str], None]
#: Receives the answers that arrive while the caller is waiting for a different answer.
OnAnswer = Callable[[ControllerAnswer], None]


def ignore_answer(_answer: ControllerAnswer) -> None:
    """Do nothing with an answer."""


class Conversation(ABC):
    """A connection to a controller.

    Attributes
    ----------
    patience
        Factor for all time limits. It is greater than 1 on a busy computer.
    offset
        The last reported offset between machine and work coordinates, in report units.
    restarted
        Whether the board has restarted since the connection was opened. Many boards restart when the port is opened.
        Until the machine is homed, positions are relative to the position at the restart.
    homed
        Whether the machine was homed since the connection was opened.
    family
        The firmware that the board has reported. It determines which list explains errors and alarms (see
        `meaning_of`).
    max_lines
        Maximum number of unanswered lines, or None if only the size of the buffer matters.
    max_ahead
        Maximum number of lines that the board accepts before it executes them. This covers the blocks in the planner
        and any lines without motion between these blocks.
    check_line
        Command that turns on check mode, in which the board reads lines but does not move. It is empty if the firmware
        has no check mode.
    """

    patience = 1.0
    check_line = ""
    max_ahead = 40
    max_lines: int | None = None

    def __init__(self, port: Port, log: Log | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self.port, self.clock = port, clock
        self.log = log or (lambda _way, _text: None)
        self.status: Status | None = None
        self.on_status: Callable[[Status], None] = lambda _: None
        self.offset: XYZ | None = None
        self.restarted = self.homed = False
        self.family = ""
        self._zeroed: set[str] = set()
        self._interrupted = self._resetting = False
        self._rest = b""

    # Methods that each firmware implements.

    @abstractmethod
    def parse(self, line: str) -> ControllerAnswer:
        """Parse a line from the controller."""

    @abstractmethod
    def connect(self) -> Status:
        """Wait until the controller answers, and return its status.

        Raises `SendError` if the controller does not answer, or if the board has a different firmware.
        """

    @abstractmethod
    def request_status(self, *, more: bool = False) -> None:
        """Request a status report. The report arrives like any other answer.

        Set `more` if more lines are about to be sent.
        """

    @abstractmethod
    def read_facts(self) -> Facts:
        """Read the settings and the state that the controller reports while it is idle."""

    @abstractmethod
    def read_settings_text(self) -> tuple[str, str]:
        """Read the settings in the format that `leafcut machine import` understands.

        Return their kind and their text.
        """

    @abstractmethod
    def send(self, text: str) -> None:
        """Send a line without waiting for the answer."""

    @abstractmethod
    def hold(self) -> None:
        """Stop the machine with a feed hold, so that it can continue later."""

    @abstractmethod
    def resume(self) -> None:
        """Continue after a hold."""

    @abstractmethod
    def step_feed_override(self, current: int, target: int) -> None:
        """Change the feed override by one step from `current` toward `target`, percent."""

    @abstractmethod
    def homing_command(self) -> str:
        """Return the homing command."""

    @abstractmethod
    def zeroing_command(self, axes: str) -> str:
        """Return the command that sets the zero of the given axes to the current position."""

    @abstractmethod
    def unlock(self) -> bool:
        """Unlock the machine without homing it. Return whether it was locked."""

    @abstractmethod
    def stop(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop the machine, the spindle and the coolant, discard all queued lines, and return the status."""

    @abstractmethod
    def reset(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Reset the controller as far as the firmware allows, and return the status."""

    @abstractmethod
    def clean_up_after_alarm(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Clean up after the machine has stopped with an alarm, and return the status."""

    @abstractmethod
    def stop_unanswered(self) -> str:
        """Send a stop to a machine that no longer responds. Return the names of the commands that were sent."""

    @abstractmethod
    def prepare_for_program(self) -> None:
        """Prepare the controller for running a program."""

    @property
    def can_send_line(self) -> bool:
        """Whether a line may be sent now, if it fits into the buffer."""
        return True

    # Methods that all firmwares share.

    def _deadline(self, seconds: float) -> float:
        return self.clock() + seconds * self.patience

    def write(self, data: bytes) -> None:
        """Write bytes to the port, and log them."""
        self.log(">", data.decode("ascii", "backslashreplace").rstrip("\n"))
        self.port.write(data)

    def interrupt_wait(self) -> None:
        """Interrupt the current wait, which then raises `Interrupted`. This method may be called from any thread."""
        self._interrupted = True

    def listen(self, seconds: float = _READ_SECONDS) -> list[ControllerAnswer]:
        """Return the answers that arrive within `seconds`. Raises `Interrupted` if `interrupt` was called."""
        if self._interrupted and not self._resetting:
            self._interrupted = False
            raise Interrupted
        self._rest += self.port.read(seconds)
        *lines, self._rest = self._rest.replace(b"\r", b"").split(b"\n")
        if len(self._rest) > LONGEST_ANSWER:
            lines, self._rest = [*lines, self._rest], b""
        return [self._parse_line(line.decode("ascii", "replace")) for line in lines if line.strip()]

    def _parse_line(self, text: str) -> ControllerAnswer:
        answer = self.parse(text)
        self.log("<", text if isinstance(answer, Status) else printable(text, 200))
        if isinstance(answer, Status):
            self.store_status(answer)
        return answer

    def store_status(self, status: Status) -> None:
        """Remember a status and pass it to `on_status`."""
        self.status, self.offset = status, status.offset or self.offset
        self.on_status(status)

    def receive_answers(
        self, seconds: float, every: float | None = None, ask: Callable[[], None] | None = None, *, later: bool = False
    ) -> Iterator[ControllerAnswer]:
        """Yield the answers that arrive within the next `seconds`.

        Parameters
        ----------
        seconds
            Time to wait, s.
        every
            Interval between status queries, s. Without it, no status is queried.
        ask
            Function to call instead of the status query.
        later
            Send the first query after one interval instead of immediately.
        """
        until, next_query = self._deadline(seconds), self.clock() + (every or 0.0) * later
        while self.clock() < until:
            if every is not None and self.clock() >= next_query:
                (ask or self.request_status)()
                next_query = self.clock() + every
            yield from self.listen()

    def read_facts_at_rest(self) -> Facts:
        """Read the settings and the state of the controller.

        Raises `SendError` if the machine is moving, or if the controller does not report a required value.
        """
        if movement := self._moving_state_words():
            raise SendError("the machine is {}; wait until it has stopped, or use --unlock", movement)
        return self.read_facts()

    def read_settings_at_rest(self) -> tuple[str, str]:
        """Read the settings of the controller. Return their kind (see `importing.KINDS`) and their text.

        Raises `SendError` if the settings cannot be read at the moment.
        """
        if movement := self._moving_state_words():
            raise SendError("the machine is {}; wait until it has stopped", movement)
        return self.read_settings_text()

    def _moving_state_words(self) -> str:
        status = self.query_status()
        return "" if status.state in ("Idle", *LOCKED) else state_in_words(status)

    def ask(self, text: str, seconds: float = ANSWER_SECONDS) -> list[ControllerAnswer]:
        """Send a line and return all answers up to the ``ok``.

        Raises `SendError` if the controller refuses the line, if an alarm occurs, or if no answer arrives within
        `seconds`.
        """
        self.send(text)
        answers: list[ControllerAnswer] = []
        for answer in self.receive_answers(seconds, 2 * POLL_SECONDS if seconds > ANSWER_SECONDS else None, later=True):
            match answer:
                case Accepted():
                    return answers
                case Refused():
                    raise SendError("'{}' was refused: {}", text, self.error_meaning(answer))
                case Alarm():
                    raise SendError("'{}': {}", text, self.error_meaning(answer))
                case Greeting():
                    raise SendError("the controller was reset at '{}'", text)
                case Status():
                    continue
                case InvalidAnswer(words):
                    raise SendError("invalid answer to '{}': '{}'", text, words)
                case _:
                    answers.append(answer)
        raise SendError("the controller does not respond to '{}'", text)

    def query_status(self, seconds: float = ANSWER_SECONDS) -> Status:
        """Query the status and wait for the answer. Raises `SendError` if the controller does not answer."""
        for answer in self.receive_answers(seconds, SLOW_POLL_SECONDS):
            if isinstance(answer, Status):
                return answer
        raise SendError("{} no longer responds", self.port.name)

    def error_meaning(self, answer: Refused | Alarm) -> str:
        """Explain an error or an alarm in words. The explanation depends on the firmware."""
        if isinstance(answer.why, str):
            return answer.why
        return (error_in_words if isinstance(answer, Refused) else alarm_in_words)(answer.why, self.family)

    def record_restart(self) -> None:
        """Record that the board has restarted. A restart deletes the work zeros that were set before."""
        self.restarted, self.homed = True, False
        self._zeroed.clear()

    def home(self) -> None:
        """Home the machine.

        If homing fails or is interrupted, all motion is stopped first. Raises `SendError` if homing is disabled or
        fails.
        """
        try:
            self.ask(self.homing_command(), HOMING_SECONDS)
        except (KeyboardInterrupt, Interrupted, SendError):
            self._abort_homing()
            raise
        self.homed = True

    @abstractmethod
    def _abort_homing(self) -> None:
        """Stop a machine that is homing, even if it no longer answers."""

    def zero_here(self, axes: str = "XYZ") -> None:
        """Set the program zero to the current tool position. Raises `SendError` if the controller refuses."""
        self.ask(self.zeroing_command(axes))
        self._zeroed |= set(axes)
        if self._zeroed >= set("XYZ"):
            self.restarted = False

    def wait_for_alarm_report(self, seconds: float) -> bool:
        """Wait for the message or greeting that follows an alarm. Return whether it arrived in time."""
        return any(isinstance(answer, Report | Greeting) for answer in self.receive_answers(seconds))

    def discard_answers(self, seconds: float) -> None:
        """Ignore all answers that arrive within the next `seconds`."""
        until = self.clock() + seconds
        while self.clock() < until:
            self.listen()


class NotThisFirmware(SendError):
    """Nothing answers on the port, or not the expected firmware. `answers` contains the lines that were received."""

    def __init__(self, message: str, answers: list[str]) -> None:
        super().__init__(message)
        self.answers = answers


def wrong_firmware_error(port: str, answers: list[str], firmware: str) -> NotThisFirmware:
    """Return the error to raise if no firmware, or an unexpected firmware, answers at a port."""
    if not answers:
        words = Message("no response on {}; is the machine on, and are port and --baud right?", port)
    else:
        text = printable(answers[-1], 40)
        words = Message("the device on {} is not {} ('{}')", port, firmware, text)
        if sum(not ("\x20" <= c <= "\x7e") for c in text) > len(text) // 4:
            words = Message("{} sends invalid data ('{}'); check --baud and the cable", port, text)
    return NotThisFirmware(words, answers)


def answer_text(answer: ControllerAnswer) -> str:
    """Convert an answer back to a line of text, such as ``ok``, ``error:20`` or ``ALARM:1``."""
    match answer:
        case Accepted():
            return "ok"
        case Refused(why):
            return f"error:{why}"
        case Alarm(why):
            return f"ALARM:{why}"
        case InvalidAnswer(text):
            return text
        case _:
            return str(answer)
