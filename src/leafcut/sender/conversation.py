"""What is said to a controller and heard from it, one thing at a time, whatever its firmware.

Here stands what is common: the port, the log, waiting for an answer. How a firmware is asked, held, stopped and homed
is in its own class: `grbl.GrblConversation`, `marlin.MarlinConversation`.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator

from leafcut.errors import SendError, shown
from leafcut.model.machine import XYZ
from leafcut.sender.answers import (
    LONGEST_ANSWER,
    Accepted,
    Alarm,
    ControllerAnswer,
    Greeting,
    Refused,
    Report,
    Status,
    Strange,
)
from leafcut.sender.explained import alarm_in_words, error_in_words, state_in_words
from leafcut.sender.facts import Facts
from leafcut.sender.port import Port

#: How long is waited for an answer, for a board that restarts when its port is opened, and for homing, s.
ANSWER_SECONDS, START_SECONDS, HOMING_SECONDS = 5.0, 5.0, 180.0
#: Between two questions for the status: while something is waited for, and where nothing else goes on, s.
AGAIN, SELDOM = 0.1, 0.5
_READ_SECONDS = 0.02
#: States in which nothing moves, and nothing is taken before a person has done something.
LOCKED = ("Alarm", "ConfigAlarm", "Critical", "Sleep")
#: The state of a machine that was stopped without slowing down: it may have lost steps.
STOPPED_SHORT = "Stopped"


class Interrupted(Exception):
    """A person wants the machine to do something else than what is waited for."""


#: Is told what goes over the line: "<" or ">", and the text.
Log = Callable[[str, str], None]
#: Is told every answer that comes while something else is waited for.
Heard = Callable[[ControllerAnswer], None]


def unheard(_answer: ControllerAnswer) -> None:
    """Take an answer for what it is."""


class Conversation(ABC):
    """A controller at a port.

    Attributes
    ----------
    patience
        How many times longer than usual is waited for anything: for a computer that does much else.
    status
        What it said last of what it does.
    on_status
        Is told every status.
    offset
        What lay between machine and work coordinates when it said so last, in the units of its reports.
    restarted
        It has started anew since it was connected, as many boards do when their port is opened: without homing it
        counts its place from where it stands.
    homed
        It was homed since it was connected.
    family
        The firmware that it told of, by whose list an error or an alarm is explained (`explained.family_of`).
    most_lines
        So many lines may wait for an answer at once; None where only its buffer counts.
    most_ahead
        So many lines at most are taken and not run yet: blocks of the planner, and lines between that move nothing.
    check_line
        Has it read what comes, and move nothing; empty where it cannot.
    """

    patience = 1.0
    check_line = ""
    most_ahead = 40
    most_lines: int | None = None

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

    # What each firmware does in its own way.

    @abstractmethod
    def parse(self, line: str) -> ControllerAnswer:
        """Return what a line of it means."""

    @abstractmethod
    def connect(self) -> Status:
        """Return what it does now, after waiting for it to answer; raise `SendError` where another one answers."""

    @abstractmethod
    def ask_status(self, *, more: bool = False) -> None:
        """Ask what it does now; the answer comes like any other. With `more`, lines follow at once."""

    @abstractmethod
    def gather(self) -> Facts:
        """Return what it says of itself, while it stands."""

    @abstractmethod
    def gather_settings(self) -> tuple[str, str]:
        """Return the kind of its settings, and what it says of them, as `leafcut machine import` reads them."""

    @abstractmethod
    def send(self, text: str) -> None:
        """Send a line, without waiting for its answer."""

    @abstractmethod
    def hold(self) -> None:
        """Let it come to rest, so that it can go on."""

    @abstractmethod
    def resume(self) -> None:
        """Let it go on."""

    @abstractmethod
    def step_feed(self, now: int, wanted: int) -> None:
        """Go a step from one override of the feed towards another, percent."""

    @abstractmethod
    def home_lines(self) -> str:
        """Return the line that homes it."""

    @abstractmethod
    def zero_line(self, axes: str) -> str:
        """Return the line that makes the place of the tool zero in some axes."""

    @abstractmethod
    def unlock(self) -> bool:
        """Bring it to rest, without homing it; return whether it was locked."""

    @abstractmethod
    def stop(self, heard: Heard = unheard) -> Status:
        """Stop the machine, spindle and coolant off, nothing left in it; return what it does then."""

    @abstractmethod
    def reset(self, heard: Heard = unheard) -> Status:
        """Leave it as it is when it has just started, as far as that can be; return what it does then."""

    @abstractmethod
    def halt(self, heard: Heard = unheard) -> Status:
        """Do what is left to do when it has stopped by itself, by an alarm; return what it does then."""

    @abstractmethod
    def stop_unheard(self) -> str:
        """Stop a machine that does not answer any more, and return what was sent, in words."""

    @abstractmethod
    def begin(self) -> None:
        """Do what is needed before a program."""

    @property
    def takes_lines(self) -> bool:
        """Whether a line may be sent to it now, as far as that does not lie in its buffer."""
        return True

    # What is common.

    def _until(self, seconds: float) -> float:
        return self.clock() + seconds * self.patience

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.log(">", data.decode("ascii", "backslashreplace").rstrip("\n"))
        self.port.write(data)

    def interrupt(self) -> None:
        """Let whatever waits for an answer end with `Interrupted`; may be called from any thread."""
        self._interrupted = True

    def listen(self, seconds: float = _READ_SECONDS) -> list[ControllerAnswer]:
        """Return what it has said, waiting at most so long; the last status is kept.

        Raises
        ------
        Interrupted
            A person wants something else first.
        """
        if self._interrupted and not self._resetting:
            self._interrupted = False
            raise Interrupted
        self._rest += self.port.read(seconds)
        *lines, self._rest = self._rest.replace(b"\r", b"").split(b"\n")
        if len(self._rest) > LONGEST_ANSWER:
            lines, self._rest = [*lines, self._rest], b""
        return [self._heard_line(line.decode("ascii", "replace")) for line in lines if line.strip()]

    def _heard_line(self, text: str) -> ControllerAnswer:
        answer = self.parse(text)
        self.log("<", text if isinstance(answer, Status) else shown(text, 200))
        if isinstance(answer, Status):
            self.keep(answer)
        return answer

    def keep(self, status: Status) -> None:
        """Keep a status as the last one, and tell of it."""
        self.status, self.offset = status, status.offset or self.offset
        self.on_status(status)

    def heard(
        self, seconds: float, every: float | None = None, ask: Callable[[], None] | None = None, *, later: bool = False
    ) -> Iterator[ControllerAnswer]:
        """Yield what it says for so long; meanwhile its status is asked for every so often, or `ask` is called.

        The first time at once, or, with `later`, when that time has passed. Whoever has heard enough leaves.
        """
        until, again = self._until(seconds), self.clock() + (every or 0.0) * later
        while self.clock() < until:
            if every is not None and self.clock() >= again:
                (ask or self.ask_status)()
                again = self.clock() + every
            yield from self.listen()

    def facts(self) -> Facts:
        """Return what it says of itself.

        Raises
        ------
        SendError
            It moves, or what answers is another firmware.
        """
        if doing := self._moving():
            raise SendError(f"the machine is {doing}; wait until it stands, or use --unlock")
        return self.gather()

    def settings(self) -> tuple[str, str]:
        """Return the kind of its settings (`importing.KINDS`), and their text; nothing is changed, nothing moves.

        Raises
        ------
        SendError
            It moves, does not say its settings, or what answers is another firmware.
        """
        if doing := self._moving():
            raise SendError(f"the machine is {doing}; wait until it stands")
        return self.gather_settings()

    def _moving(self) -> str:
        """Return what it does now, in words; "" where it stands."""
        status = self.fresh_status()
        return "" if status.state in ("Idle", *LOCKED) else state_in_words(status)

    def ask(self, text: str, seconds: float = ANSWER_SECONDS) -> list[ControllerAnswer]:
        """Return what it says to a line, while nothing else is on its way; its status is asked for in a long wait.

        Raises
        ------
        SendError
            It refuses the line, gives an alarm, is reset, says what makes no sense, or nothing.
        """
        self.send(text)
        found: list[ControllerAnswer] = []
        for answer in self.heard(seconds, 2 * AGAIN if seconds > ANSWER_SECONDS else None, later=True):
            match answer:
                case Accepted():
                    return found
                case Refused():
                    raise SendError(f"'{text}' was refused: {self.explained(answer)}")
                case Alarm():
                    raise SendError(f"'{text}': {self.explained(answer)}")
                case Greeting():
                    raise SendError(f"the controller was reset at '{text}'")
                case Status():
                    continue
                case Strange(words):
                    raise SendError(f"what came over the line to '{text}' makes no sense: '{words}'")
                case _:
                    found.append(answer)
        raise SendError(f"the controller does not answer to '{text}'")

    def fresh_status(self, seconds: float = ANSWER_SECONDS) -> Status:
        """Return what it does now.

        Raises
        ------
        SendError
            It does not answer.
        """
        for answer in self.heard(seconds, SELDOM):
            if isinstance(answer, Status):
                return answer
        raise SendError(f"nothing answers on {self.port.name} any more")

    def explained(self, answer: Refused | Alarm) -> str:
        """Return what an error or an alarm means to the firmware that is here."""
        if isinstance(answer.why, str):
            return answer.why
        return (error_in_words if isinstance(answer, Refused) else alarm_in_words)(answer.why, self.family)

    def start_anew(self) -> None:
        """Note that it has started anew: what was set as zero is forgotten."""
        self.restarted, self.homed = True, False
        self._zeroed.clear()

    def home(self) -> None:
        """Home the machine; if that ends in any other way, it is reset, so that nothing goes on moving.

        Raises
        ------
        SendError
            Homing is off, or failed.
        """
        try:
            self.ask(self.home_lines(), HOMING_SECONDS)
        except (KeyboardInterrupt, Interrupted, SendError):
            self._give_up_homing()
            raise
        self.homed = True

    @abstractmethod
    def _give_up_homing(self) -> None:
        """Stop a machine that homes, whether it answers or not."""

    def zero_here(self, axes: str = "XYZ") -> None:
        """Make the place where the tool is the zero of the program, in some axes.

        Raises
        ------
        SendError
            It is refused.
        """
        self.ask(self.zero_line(axes))
        self._zeroed |= set(axes)
        if self._zeroed >= set("XYZ"):
            self.restarted = False

    def hear_out(self, seconds: float) -> bool:
        """Wait until it has told what it tells of an alarm, or greets; return whether it did within so long."""
        return any(isinstance(one, Report | Greeting) for one in self.heard(seconds))

    def pass_time(self, seconds: float) -> None:
        """Let time pass, whatever is said."""
        until = self.clock() + seconds
        while self.clock() < until:
            self.listen()


class NotThisFirmware(SendError):
    """What answers is another firmware, or nothing does; `heard` is what it said."""

    def __init__(self, message: str, heard: list[str]) -> None:
        super().__init__(message)
        self.heard = heard


def what_answers(port: str, heard: list[str], wanted: str) -> NotThisFirmware:
    """Return the error that says that something else than a wanted firmware answers, or nothing at all."""
    if not heard:
        words = f"nothing answers on {port}; is the machine on, and is this its port and its --baud?"
    else:
        text = shown(heard[-1], 40)
        words = f"what answers on {port} is not {wanted} ('{text}')"
        if sum(not ("\x20" <= c <= "\x7e") for c in text) > len(text) // 4:
            words = f"what comes from {port} makes no sense ('{text}'); is it another --baud, or a bad cable?"
    return NotThisFirmware(words, heard)


def as_said(answer: ControllerAnswer) -> str:
    """Return what a controller said, near enough to recognise it."""
    match answer:
        case Accepted():
            return "ok"
        case Refused(why):
            return f"error:{why}"
        case Alarm(why):
            return f"ALARM:{why}"
        case Strange(text):
            return text
        case _:
            return str(answer)
