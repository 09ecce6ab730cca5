"""Communication with a controller, one request at a time. Subclasses add the protocol of a firmware."""

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

#: Time limits, s: for an answer, for a restart of the board when its port is opened, and for homing.
ANSWER_SECONDS, START_SECONDS, HOMING_SECONDS = 5.0, 5.0, 180.0
#: Intervals of status queries, s: while waiting for a result, and while idle.
POLL_SECONDS, SLOW_POLL_SECONDS = 0.1, 0.5
_READ_SECONDS = 0.02
#: States in which the machine is at rest and refuses all lines until the operator acts.
LOCKED = ("Alarm", "ConfigAlarm", "Critical", "Sleep")
#: State of a machine that was stopped without deceleration. It may have lost steps.
STOPPED_SHORT = "Stopped"


class Interrupted(Exception):
    """The operator has interrupted a wait."""


#: Called with each line of traffic: direction ("<" or ">") and text.
Log = Callable[[str, str], None]
#: Called with each answer that arrives while the caller waits for another answer.
OnAnswer = Callable[[ControllerAnswer], None]


def ignore_answer(_answer: ControllerAnswer) -> None:
    """Ignore an answer."""


class Conversation(ABC):
    """A controller connected to a port.

    Attributes
    ----------
    patience
        Factor for all time limits; above 1 on a busy computer.
    offset
        Last reported offset between machine and work coordinates, in the units of the report.
    restarted
        Whether the board has restarted since the connection was opened, as many boards do when the port is opened.
        Unless it is homed, its position is measured from the position at the restart.
    homed
        Whether the machine was homed since the connection was opened.
    family
        Firmware that the board has reported; it selects the list of errors and alarms (`meaning_of.family_of`).
    max_lines
        Maximum number of lines without an answer; None if only the buffer limits it.
    max_ahead
        Maximum number of lines that the board accepts before it executes them: planner blocks, and lines without
        motion between them.
    check_line
        Command that turns on check mode, in which lines are read but nothing moves; empty if there is none.
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
        """Convert a line of the controller to an answer."""

    @abstractmethod
    def connect(self) -> Status:
        """Wait until the controller answers, and return its status.

        Raise `SendError` if nothing answers, or the board has another firmware.
        """

    @abstractmethod
    def ask_status(self, *, more: bool = False) -> None:
        """Request the status, which arrives like any other answer.

        `more`: the caller is about to send further lines.
        """

    @abstractmethod
    def read_facts(self) -> Facts:
        """Return the facts that the controller reports while it is idle."""

    @abstractmethod
    def read_settings_text(self) -> tuple[str, str]:
        """Return the kind and the text of the settings, in the format that `leafcut machine import` reads."""

    @abstractmethod
    def send(self, text: str) -> None:
        """Send a line without waiting for the answer."""

    @abstractmethod
    def hold(self) -> None:
        """Bring the machine to rest (feed hold) so that it can continue later."""

    @abstractmethod
    def resume(self) -> None:
        """Continue after a hold."""

    @abstractmethod
    def step_feed(self, current: int, target: int) -> None:
        """Change the feed override by one step from `current` towards `target`, percent."""

    @abstractmethod
    def home_lines(self) -> str:
        """Return the homing command."""

    @abstractmethod
    def zero_line(self, axes: str) -> str:
        """Return the command that zeroes the given axes at the current position."""

    @abstractmethod
    def unlock(self) -> bool:
        """Bring the machine to rest without homing; return whether it was locked."""

    @abstractmethod
    def stop(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Stop machine, spindle and coolant, discard all queued lines, and return the status."""

    @abstractmethod
    def reset(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Reset to the state after start-up, as far as possible; return the status."""

    @abstractmethod
    def halt(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Clean up after the machine has stopped with an alarm, and return the status."""

    @abstractmethod
    def stop_unanswered(self) -> str:
        """Send a stop to a machine that no longer answers; return the names of the commands."""

    @abstractmethod
    def prepare(self) -> None:
        """Prepare the controller for a program."""

    @property
    def takes_lines(self) -> bool:
        """Whether a line may be sent now, provided that the buffer has space."""
        return True

    # Methods that all firmwares share.

    def _deadline(self, seconds: float) -> float:
        return self.clock() + seconds * self.patience

    def write(self, data: bytes) -> None:
        """Write bytes to the port and to the log."""
        self.log(">", data.decode("ascii", "backslashreplace").rstrip("\n"))
        self.port.write(data)

    def interrupt(self) -> None:
        """Make the current wait end with `Interrupted`. May be called from any thread."""
        self._interrupted = True

    def listen(self, seconds: float = _READ_SECONDS) -> list[ControllerAnswer]:
        """Return the answers received within `seconds`; raise `Interrupted` if `interrupt` was called."""
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
        """Store a status and pass it to `on_status`."""
        self.status, self.offset = status, status.offset or self.offset
        self.on_status(status)

    def receive(
        self, seconds: float, every: float | None = None, ask: Callable[[], None] | None = None, *, later: bool = False
    ) -> Iterator[ControllerAnswer]:
        """Yield answers for `seconds`. With `every`, query the status at this interval, in s.

        `ask` replaces the status query. The first query is sent at once; with `later`, it is sent after an interval.
        """
        until, next_query = self._deadline(seconds), self.clock() + (every or 0.0) * later
        while self.clock() < until:
            if every is not None and self.clock() >= next_query:
                (ask or self.ask_status)()
                next_query = self.clock() + every
            yield from self.listen()

    def facts(self) -> Facts:
        """Return the facts that the controller reports; raise `SendError` if the machine moves or a fact is missing."""
        if movement := self._moving_state():
            raise SendError("the machine is {}; wait until it has stopped, or use --unlock", movement)
        return self.read_facts()

    def settings(self) -> tuple[str, str]:
        """Return the kind (`importing.KINDS`) and text of the settings.

        Raise `SendError` if they cannot be read now.
        """
        if movement := self._moving_state():
            raise SendError("the machine is {}; wait until it has stopped", movement)
        return self.read_settings_text()

    def _moving_state(self) -> str:
        status = self.fresh_status()
        return "" if status.state in ("Idle", *LOCKED) else state_in_words(status)

    def ask(self, text: str, seconds: float = ANSWER_SECONDS) -> list[ControllerAnswer]:
        """Send a line and return the answers before its ``ok``.

        Raise `SendError` if the line is refused, an alarm occurs, or no answer arrives within `seconds`.
        """
        self.send(text)
        answers: list[ControllerAnswer] = []
        for answer in self.receive(seconds, 2 * POLL_SECONDS if seconds > ANSWER_SECONDS else None, later=True):
            match answer:
                case Accepted():
                    return answers
                case Refused():
                    raise SendError("'{}' was refused: {}", text, self.meaning_of(answer))
                case Alarm():
                    raise SendError("'{}': {}", text, self.meaning_of(answer))
                case Greeting():
                    raise SendError("the controller was reset at '{}'", text)
                case Status():
                    continue
                case InvalidAnswer(words):
                    raise SendError("invalid answer to '{}': '{}'", text, words)
                case _:
                    answers.append(answer)
        raise SendError("the controller does not respond to '{}'", text)

    def fresh_status(self, seconds: float = ANSWER_SECONDS) -> Status:
        """Query the status and return it; raise `SendError` if the controller does not answer."""
        for answer in self.receive(seconds, SLOW_POLL_SECONDS):
            if isinstance(answer, Status):
                return answer
        raise SendError("{} no longer responds", self.port.name)

    def meaning_of(self, answer: Refused | Alarm) -> str:
        """Return the meaning of an error or alarm as text, according to the firmware."""
        if isinstance(answer.why, str):
            return answer.why
        return (error_in_words if isinstance(answer, Refused) else alarm_in_words)(answer.why, self.family)

    def record_restart(self) -> None:
        """Record a restart of the board, which loses the work zeros that were set before."""
        self.restarted, self.homed = True, False
        self._zeroed.clear()

    def home(self) -> None:
        """Home the machine.

        Raise `SendError` if homing is off or fails. On a failure or an interrupt, stop all motion first.
        """
        try:
            self.ask(self.home_lines(), HOMING_SECONDS)
        except (KeyboardInterrupt, Interrupted, SendError):
            self._give_up_homing()
            raise
        self.homed = True

    @abstractmethod
    def _give_up_homing(self) -> None:
        """Stop a homing machine, whether or not it answers."""

    def zero_here(self, axes: str = "XYZ") -> None:
        """Set the program zero at the current position of the tool; raise `SendError` if the controller refuses."""
        self.ask(self.zero_line(axes))
        self._zeroed |= set(axes)
        if self._zeroed >= set("XYZ"):
            self.restarted = False

    def wait_for_alarm_report(self, seconds: float) -> bool:
        """Wait for the message or greeting that follows an alarm; return whether it arrived in time."""
        return any(isinstance(answer, Report | Greeting) for answer in self.receive(seconds))

    def discard_answers(self, seconds: float) -> None:
        """Read and discard answers for a given time, s."""
        until = self.clock() + seconds
        while self.clock() < until:
            self.listen()


class NotThisFirmware(SendError):
    """A port at which no firmware or an unexpected firmware answers. `answers` contains the received lines."""

    def __init__(self, message: str, answers: list[str]) -> None:
        super().__init__(message)
        self.answers = answers


def wrong_firmware(port: str, answers: list[str], firmware: str) -> NotThisFirmware:
    """Return the error for a port at which no firmware or an unexpected firmware answers."""
    if not answers:
        words = Message("no response on {}; is the machine on, and are port and --baud right?", port)
    else:
        text = printable(answers[-1], 40)
        words = Message("the device on {} is not {} ('{}')", port, firmware, text)
        if sum(not ("\x20" <= c <= "\x7e") for c in text) > len(text) // 4:
            words = Message("{} sends invalid data ('{}'); check --baud and the cable", port, text)
    return NotThisFirmware(words, answers)


def answer_text(answer: ControllerAnswer) -> str:
    """Return an answer as a line of text, in the form ``ok``, ``error:20`` or ``ALARM:1`` if possible."""
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
