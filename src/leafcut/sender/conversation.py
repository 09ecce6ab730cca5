"""What is said to a controller and heard from it, one thing at a time: connect, ask, home, unlock, stop."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from leafcut.errors import SendError, shown
from leafcut.model.machine import XYZ
from leafcut.sender.answers import (
    LONGEST_ANSWER,
    Accepted,
    Alarm,
    Build,
    ControllerAnswer,
    Greeting,
    Refused,
    Remark,
    Status,
    Strange,
    parse,
)
from leafcut.sender.explained import alarm_in_words, error_in_words, family_of, state_in_words
from leafcut.sender.facts import Facts, gathered
from leafcut.sender.port import Port

#: Bytes that act at once, without a line of their own (gnea/grbl 1.1, config.h).
ASK, HOLD, RESUME, RESET = b"?", b"!", b"~", b"\x18"

#: How long is waited for an answer, for a board that restarts when its port is opened, and for homing, s.
ANSWER_SECONDS, START_SECONDS, HOMING_SECONDS = 5.0, 5.0, 180.0
#: How long a machine may take to come to rest, s.
REST_SECONDS = 15.0
#: After an alarm its reason is told, s; and a reset that is not answered for so long is sent again, s.
ALARM_SECONDS, RESET_SECONDS = 3.0, 2.0
#: Between two questions for the status while something is waited for, s.
_AGAIN = 0.1
_READ_SECONDS = 0.02
#: States in which a machine stands, and goes on with nothing by itself.
_AT_REST = ("Idle", "Alarm", "Check", "Sleep")


class Interrupted(Exception):
    """A person wants the machine to do something else than what is waited for."""


#: Is told what goes over the line: "<" or ">", and the text.
Log = Callable[[str, str], None]


class Conversation:
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
        What lay between machine and work coordinates when it said so last, in the units of ``$13``.
    restarted
        It has started anew since it was connected, as many boards do when their port is opened: without homing it
        counts its place from where it stands.
    family
        The firmware that it told of, by whose list an error or an alarm is explained (`explained.family_of`).
    """

    patience = 1.0

    def __init__(self, port: Port, log: Log | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self.port, self.clock = port, clock
        self.log = log or (lambda _way, _text: None)
        self.status: Status | None = None
        self.on_status: Callable[[Status], None] = lambda _: None
        self.offset: XYZ | None = None
        self.restarted = False
        self.family = ""
        self._zeroed: set[str] = set()
        self._interrupted = self._resetting = False
        self._rest = b""

    def _until(self, seconds: float) -> float:
        return self.clock() + seconds * self.patience

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.log(">", data.decode("ascii", "backslashreplace").rstrip("\n"))
        self.port.write(data)

    def ask_status(self) -> None:
        """Ask what it does now; the answer comes like any other."""
        self.port.write(ASK)

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
        answers = []
        for line in lines:
            if not line.strip():
                continue
            text = line.decode("ascii", "replace")
            answer = parse(text)
            if not isinstance(answer, Status):
                self.log("<", shown(text, 200))
                if isinstance(answer, Greeting | Build | Remark):
                    self.family = self.family or family_of(text)
            else:
                self.log("<", text)
                self.status, self.offset = answer, answer.offset or self.offset
                self.on_status(answer)
            answers.append(answer)
        return answers

    def connect(self) -> Status:
        """Return what it does now, after waiting for it to answer.

        Raises
        ------
        SendError
            Nothing answers, or what answers is no GRBL.
        """
        heard: list[str] = []
        until, again = self._until(START_SECONDS), 0.0
        while self.clock() < until:
            if self.clock() >= again:
                self.ask_status()
                again = self.clock() + 5 * _AGAIN
            for answer in self.listen():
                if isinstance(answer, Status):
                    return answer
                if isinstance(answer, Greeting):
                    again, self.restarted = 0.0, True
                elif isinstance(answer, Strange):
                    heard.append(answer.text)
        heard += [shown(self._rest.decode("ascii", "replace"))] * bool(self._rest)
        raise SendError(_not_grbl(self.port.name, heard))

    def facts(self) -> Facts:
        """Return what it says of itself.

        Raises
        ------
        SendError
            It moves, or what answers is no GRBL.
        """
        status = self.fresh_status()
        if status.state not in ("Idle", "Alarm"):
            raise SendError(f"the machine is {state_in_words(status.state)}; wait until it stands, or use --unlock")
        self._settle()
        answers: list[ControllerAnswer] = []
        for question in ("$I", "$$", "$#", "$G"):
            answers += self.ask(question)
        return gathered(answers, self.fresh_status())

    def _settle(self) -> None:
        """End a line that somebody may have begun, whatever is said to that."""
        self.write(b"\n")
        until = self._until(ANSWER_SECONDS)
        while self.clock() < until:
            if any(isinstance(one, Accepted | Refused) for one in self.listen()):
                self.listen()
                return
        raise SendError(_not_grbl(self.port.name, []))

    def ask(self, text: str, seconds: float = ANSWER_SECONDS) -> list[ControllerAnswer]:
        """Return what it says to a line, while nothing else is on its way; its status is asked for in a long wait.

        Raises
        ------
        SendError
            It refuses the line, gives an alarm, is reset, says what makes no sense, or nothing.
        """
        self.write(text.encode("ascii") + b"\n")
        found: list[ControllerAnswer] = []
        until, again = self._until(seconds), self.clock() + 2 * _AGAIN
        while self.clock() < until:
            if seconds > ANSWER_SECONDS and self.clock() >= again:
                self.ask_status()
                again = self.clock() + 2 * _AGAIN
            for answer in self.listen():
                match answer:
                    case Accepted():
                        return found
                    case Refused(code):
                        raise SendError(f"'{text}' was refused: {self.error_in_words(code)}")
                    case Alarm(code):
                        raise SendError(f"'{text}': {self.alarm_in_words(code)}")
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
        until, again = self._until(seconds), 0.0
        while self.clock() < until:
            if self.clock() >= again:
                self.ask_status()
                again = self.clock() + 5 * _AGAIN
            for answer in self.listen():
                if isinstance(answer, Status):
                    return answer
        raise SendError(f"nothing answers on {self.port.name} any more")

    def error_in_words(self, code: int) -> str:
        """Return what an error means to the firmware that is here."""
        return error_in_words(code, self.family)

    def alarm_in_words(self, code: int) -> str:
        """Return what an alarm means to the firmware that is here, and what to do."""
        return alarm_in_words(code, self.family)

    def start_anew(self) -> None:
        """Note that it has started anew: what was set as zero is forgotten."""
        self.restarted = True
        self._zeroed.clear()

    def home(self) -> None:
        """Home the machine; if that ends in any other way, it is reset, so that nothing goes on moving.

        Raises
        ------
        SendError
            Homing is off, or failed.
        """
        try:
            self.ask("$H", HOMING_SECONDS)
        except (KeyboardInterrupt, Interrupted, SendError):
            # A hold means nothing to a machine that homes.
            with suppress(SendError):
                self.reset()
            raise

    def zero_here(self, axes: str = "XYZ") -> None:
        """Make the place where the tool is the zero of the first work offset (G54), in some axes.

        Raises
        ------
        SendError
            It is refused.
        """
        self.ask("G10 L20 P1 " + " ".join(f"{axis}0" for axis in axes))
        self._zeroed |= set(axes)
        if self._zeroed >= set("XYZ"):
            self.restarted = False

    def unlock(self) -> bool:
        """Bring a machine that is on hold, moving or locked to rest, without homing it; return whether it was locked.

        Raises
        ------
        SendError
            It stays locked.
        """
        status = self.fresh_status()
        if status.state not in _AT_REST or status.state in ("Check", "Sleep"):
            status = self.stop()
        if status.state == "Alarm":
            self.ask("$X")
        return status.state == "Alarm"

    def stop(self, heard: Callable[[ControllerAnswer], None] = lambda _: None) -> Status:
        """Hold, wait until it stands, then reset: the spindle is off, and nothing is left in it. Return what it does.

        `heard` is told of every answer on the way.

        Raises
        ------
        SendError
            It does not answer any more.
        """
        try:
            self.write(HOLD)
            self._wait_for_rest(heard)
        except (KeyboardInterrupt, Interrupted):
            pass  # twice: at once, then
        return self.reset(heard)

    def _wait_for_rest(self, heard: Callable[[ControllerAnswer], None]) -> None:
        until, again = self._until(REST_SECONDS), 0.0
        while self.clock() < until:
            if self.clock() >= again:
                self.ask_status()
                again = self.clock() + _AGAIN
            for answer in self.listen():
                heard(answer)
                if isinstance(answer, Greeting):
                    return
                if isinstance(answer, Status) and (answer.state in _AT_REST or at_hold(answer)):
                    return

    def reset(self, heard: Callable[[ControllerAnswer], None] = lambda _: None) -> Status:
        """Reset it, and return what it does then.

        Raises
        ------
        SendError
            It does not answer any more.
        """
        self._resetting = True
        try:
            return self._reset(heard)
        finally:
            self._resetting = self._interrupted = False

    def _reset(self, heard: Callable[[ControllerAnswer], None]) -> Status:
        until, again, sent = self._until(ANSWER_SECONDS), 0.0, 0
        greeted = False
        while not greeted and self.clock() < until:
            if self.clock() >= again:
                # One that comes while an alarm is being told is lost (gnea/grbl 1.1, protocol.c).
                self.write(RESET)
                again, sent = self.clock() + RESET_SECONDS, sent + 1
            for answer in self.listen():
                heard(answer)
                greeted |= isinstance(answer, Greeting)
        if sent > 1:
            self.pass_time(RESET_SECONDS)  # the others may be answered, too
        return self.fresh_status()

    def hear_alarm(self) -> None:
        """Wait until an alarm is told to its end, half a second on GRBL: from then on a reset is heard."""
        until = self._until(ALARM_SECONDS)
        while self.clock() < until:
            if any(isinstance(one, Remark | Greeting) for one in self.listen()):
                return

    def pass_time(self, seconds: float) -> None:
        """Let time pass, whatever is said."""
        until = self.clock() + seconds
        while self.clock() < until:
            self.listen()


def at_hold(status: Status) -> bool:
    """Return whether a machine has come to rest on hold, or at its safety door."""
    return status.state in ("Hold", "Door") and status.detail in (0, 1 if status.state == "Door" else 0)


def _not_grbl(port: str, heard: list[str]) -> str:
    if not heard:
        return f"nothing answers on {port}; is the machine on, and is this its port and its --baud?"
    text = shown(heard[-1], 40)
    if sum(not ("\x20" <= c <= "\x7e") for c in text) > len(text) // 4:
        return f"what comes from {port} makes no sense ('{text}'); is it another --baud, or a bad cable?"
    return f"what answers on {port} is not GRBL ('{text}')"
