"""How Marlin 2 is spoken to: one numbered line at a time.

Every line has a number and a checksum, ``N7 G1 X10*95``. Marlin obeys a line without a number however it arrives, so
that noise may make ``G1 X1`` of ``G1 X10``; a numbered one that came wrong it refuses, and asks for it again
(``Resend: 7``). A line that may have been lost on either way can be sent again for the same reason: it is never obeyed
twice. The next line goes when the last is answered: Marlin answers when a move is planned, not when it is done, so its
16 blocks of look-ahead (BLOCK_BUFFER_SIZE, up to 64 on large boards) stay full.

Marlin has no byte that asks for its status. Whether it stands, and where, it says to ``M400`` and ``M114``, which wait
in the queue like any line: they are sent where nothing else is. While it runs, it is known by what it has taken, and
by its ``busy:`` that it lives.

* To hold it, nothing more is sent: it comes to rest when it has done what it has planned.
* To stop it at once there is ``M410``. It stands still without slowing down, so its place may be lost.
* To end it when nothing is answered any more there is ``M112``: motors and spindle off, until it is reset.

Source: MarlinFirmware/Marlin 2.1, gcode/queue.cpp (`get_serial_commands`: numbers, checksums, commands that act before
their turn), module/planner.cpp (`quick_stop`: moves are dropped for a second behind it), module/motion.cpp
(`quickstop_stepper`: the place is taken from the steppers), gcode/host/M115.cpp, M114.cpp, gcode/control/M211.cpp (in
the coordinates of the program), M17_M18_M84.cpp, M999.cpp, gcode/config/M220.cpp, gcode/host/M113.cpp; marlinfw.org,
M410: "Since there will be no deceleration, steppers are expected to be out of position after this command".
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
    unheard,
    what_answers,
)
from leafcut.sender.counting import GRBL_BUFFER
from leafcut.sender.facts import Clock, Facts, SettingNames
from leafcut.sender.marlin_lines import ACTION, BUSY, CAPABILITY, FIRMWARE, HOME_FIRST, PLACE, RESEND, UNKNOWN
from leafcut.sender.port import Port

#: A board with a boot loader takes so long to start, s; so often it is asked whether it has.
START_SECONDS, KNOCK_SECONDS = 12.0, 1.0
#: Behind a ``Resend:`` comes an ``ok`` that answers no line; when nothing has come for so long, it has come, s.
QUIET_SECONDS = 0.15
#: A line without an answer or a ``busy:`` for so long is sent again, s: ``busy:`` comes every two; and so often.
LOST_SECONDS, MOST_AGAIN = 3.0, 3
#: So long moves are dropped behind a quick stop, and a little more, s (`Planner::quick_stop`).
DROPPED_SECONDS = 1.3
#: How long it may take to do what it has planned, s, without saying that it is busy.
PLANNED_SECONDS = 30.0
#: What a firmware that lacks it need not do: it has one plane, millimetres, and nothing to switch off.
_NOTHING_TO_DO = ("G17", "G21", "M5", "M9")

_NO_BUSY = "the firmware does not say that it is busy (M113 S2, HOST_KEEPALIVE_FEATURE): turn that on"
_NO_SETTINGS = "the firmware does not say its settings (M503): build it with them"
_NO_TRAVEL = "the firmware does not say its travel (M211): it has no soft end stops"

_VERSION = re.compile(r"Marlin\s+(?:bugfix-)?(\d+)\.[^\s(]*")
_ENDS = re.compile(r"(Min|Max):\s*X\s*(-?[\d.]+)\s*Y\s*(-?[\d.]+)\s*Z\s*(-?[\d.]+)", re.IGNORECASE)
_M211_WORD = re.compile(r"M211 S([01])")


def _each(word: str) -> tuple[str, str, str]:
    return (f"{word} X", f"{word} Y", f"{word} Z")


_NAMES = SettingNames(
    "M211", "M211 S0", _each("M211"), _each("M203"), _each("M201"), coordinates="the program's coordinates"
)


class NotBuiltIn(SendError):
    """The firmware was built without a word."""


@dataclass(frozen=True)
class NumberedLine:
    """A line on its way: its number, its text, and whether it is one that only this file knows of."""

    number: int
    text: str
    ours: bool = False

    @property
    def data(self) -> bytes:
        """The bytes that go over the line: the checksum is all bytes before the asterisk, exclusive or."""
        body = f"N{self.number} {self.text}".encode("ascii")
        check = 0
        for byte in body:
            check ^= byte
        return body + b"*%d\n" % check


#: It has nothing to do, and waits (NO_TIMEOUTS): no sign that it has the line that is on its way.
_WAITS = Report("", "wait")
#: Makes the next number 1; taken whatever the last one was.
_FIRST = NumberedLine(0, "M110 N0")


class MarlinConversation(Conversation):
    """A controller with Marlin 2."""

    most_lines, most_ahead = 1, 80

    def __init__(self, port: Port, log: Log | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(port, log, clock)
        self.family = "Marlin"
        #: The last number; the line that waits for its answer; how often that was sent again, and when it was heard.
        self._number, self._times, self._heard_at = 0, 0, 0.0
        self._flying: NumberedLine | None = None
        #: The line that was answered last, and the line to send after it if the controller asks for it again.
        self._answered_last: NumberedLine | None = None
        self._next: NumberedLine | None = None
        #: Lines that only this file knows of, and that wait until nothing is on its way.
        self._ours: deque[str] = deque()
        #: Until when an ``ok`` answers no line, and which line it asked for.
        self._wanted: tuple[float, int] | None = None
        #: Answers that may still come to what has no number; what is wrong with the line that waits for its answer.
        self._stray, self._wrong = 0, ""
        self._place: XYZ | None = None
        self._percent = 100
        #: Whether it is held; its status is to be told; it has killed itself.
        self._held = self._asked = self._killed = False
        #: Whether it may move; it counts its place anew.
        self._moved = self._anew = False

    # What is heard.

    def parse(self, line: str) -> ControllerAnswer:
        """Return what a line of it means."""
        return marlin_lines.parse(line)

    def listen(self, seconds: float = 0.02) -> list[ControllerAnswer]:
        """Return what it has said, waiting at most so long; what is sent again, and why, nobody else needs to know."""
        found = self._take_turn()
        for answer in super().listen(seconds):
            if answer != _WAITS:
                self._heard_at = self.clock()
            found += self._digest(answer)
            if self._asked:
                # It says no status of itself: as long as it says anything while lines are on their way, it runs.
                self._asked = False
                found.append(self._told(self._doing("Run")))
        return found

    def _take_turn(self) -> list[ControllerAnswer]:
        """Do what it is time for: a line again, or the next one of ours."""
        now, flying = self.clock(), self._flying
        if self._wanted is not None:
            until, number = self._wanted
            if now < until:
                return []
            self._wanted = None
            if flying is not None and number == flying.number + 1:
                self._stray += 1  # its answer was lost, or is still to come
                return self._answered()
            if flying is not None:
                self._put(flying)
        elif flying is not None:
            if now - self._heard_at > LOST_SECONDS * self.patience and self._times < MOST_AGAIN:
                self._times += 1
                self._put(flying)
                self._heard_at = now
        elif self._ours:
            self._fly(self._ours.popleft(), ours=True)
        return []

    def _digest(self, answer: ControllerAnswer) -> list[ControllerAnswer]:
        """Return what of an answer others need to know."""
        match answer:
            case Accepted():
                return self._ok()
            case Greeting():
                self._forget()
                self._anew = True
            case Alarm(why):
                self._killed |= "(kill)" in str(why)
            case Report(name, text) if name == RESEND:
                return self._asked_again(int(text))
            case Report(name, text) if name == UNKNOWN:
                if text.partition(" ")[0] not in _NOTHING_TO_DO:
                    self._wrong = f"the firmware does not have this word ('{shown(text, 40)}')"
            case Report(name, text) if name == HOME_FIRST:
                self._wrong = f"homing of {text} is needed first"
            case Report(name, _) if name == BUSY:
                return [self._told(self._doing("Run"))]
            case Report(name, text) if name == PLACE:
                self._place = place_in(text)
            case Report(name, text) if name == ACTION:
                return self._at_display(text.partition(" ")[0])
            case _:
                pass
        return [answer]

    def _at_display(self, action: str) -> list[ControllerAnswer]:
        """Do what a person wants who stands at the machine's own display."""
        if action in ("pause", "paused"):
            self._held = True
        elif action in ("resume", "resumed"):
            self._held = False
        elif action in ("cancel", "poweroff", "disconnect"):
            return [Alarm(f"it was stopped at its own display ({action})")]
        return []

    def _ok(self) -> list[ControllerAnswer]:
        if self._wanted is not None:
            return []
        if self._flying is None:
            if not self._stray:
                return [Accepted()]
            self._stray -= 1
            return []
        return self._answered()

    def _answered(self) -> list[ControllerAnswer]:
        """Take the line on its way for answered."""
        line, self._flying, self._times = self._flying, None, 0
        wrong, self._wrong = self._wrong, ""
        assert line is not None
        self._answered_last = line
        if self._next is not None:
            self._flying, self._next = self._next, None
            self._number = self._flying.number
            self._put(self._flying)
            return [Strange(f"line {line.number}: {wrong}")] if wrong else []
        if not line.ours:
            return [Refused(wrong) if wrong else Accepted()]
        if line.text == "M114":
            self._moved = False
            return [self._told(self._doing("Idle", self._place))]
        if line.text.startswith("M220"):
            self._percent = int(line.text.rpartition("S")[2])
            return [self._told(self._doing("Run"))]
        return []

    def _asked_again(self, number: int) -> list[ControllerAnswer]:
        """Note that it asks for a line; it is sent when nothing more comes: what asks may ask twice."""
        flying, last = self._flying, self._answered_last
        if flying is not None and last is not None and self._next is None and number == last.number == self._number - 1:
            # The `ok` that counted for this line belonged to an earlier one: the controller does not have the line.
            self._next, self._flying, self._number = flying, last, number
        newest = self._number
        if number not in (newest, newest + 1) or (self._flying is None and number == newest):
            self._forget()
            # It has begun to count anew, or has lost what it had.
            self._anew = number == 1
            return [Greeting("", "Marlin") if number == 1 else Strange(f"Resend: {number}")]
        self._wanted = (self.clock() + QUIET_SECONDS, number)
        self._wrong = ""
        return []

    def _doing(self, state: str, place: XYZ | None = None) -> Status:
        state = "Hold" if self._held and state == "Idle" else state
        percent = (self._percent, self._percent, 100)
        return Status(state, 0 if state == "Hold" else None, machine=place, work=place, overrides=percent)

    def _told(self, status: Status) -> Status:
        self.keep(status)
        return status

    # What is sent.

    def _put(self, line: NumberedLine) -> None:
        self.write(line.data)
        self._heard_at = self.clock()

    def _fly(self, text: str, *, ours: bool = False) -> None:
        self._number += 1
        self._moved |= not ours
        self._place = None if text == "M114" else self._place
        self._flying = NumberedLine(self._number, text, ours)
        self._put(self._flying)

    def _forget(self) -> None:
        """Begin anew: nothing is on its way, and the next number is 1."""
        self._flying, self._wanted, self._number, self._times, self._wrong = None, None, 0, 0, ""
        self._answered_last = self._next = None
        self._ours.clear()

    @property
    def takes_lines(self) -> bool:
        """Whether nothing is on its way, and it is not held."""
        return not self._held and self._free

    @property
    def _free(self) -> bool:
        return self._flying is None and self._wanted is None and not self._ours

    def send(self, text: str) -> None:
        """Send a line, when nothing else is on its way.

        Raises
        ------
        SendError
            It does not answer to what was sent before.
        """
        until = self._until(PLANNED_SECONDS)
        while not self._free:
            if any(isinstance(one, Status) for one in self.listen()):
                until = self._until(PLANNED_SECONDS)
            if self.clock() > until:
                raise SendError(f"nothing answers on {self.port.name} any more")
        self._fly(text)

    def ask_status(self, *, more: bool = False) -> None:
        """Ask whether it stands, and where, if no line is on its way or follows; else whatever it says shows it."""
        if (more and not self._held) or (self._flying is not None and not self._flying.ours):
            self._asked = True
        elif self._free:
            self._ours.extend(("M400", "M114"))

    # What it is asked to do.

    def connect(self) -> Status:
        """Return what it does now, after waiting for it to start and to answer.

        Raises
        ------
        SendError
            Nothing answers, or what answers is no Marlin 2.
        """
        heard: list[str] = []
        for answer in self.heard(START_SECONDS, KNOCK_SECONDS, self._knock):
            match answer:
                case Accepted():
                    break
                case Greeting():
                    self.restarted = True
                case Report() | Strange():
                    heard.append(answer.text)
                case _:
                    pass
        else:
            heard += [shown(self._rest.decode("ascii", "replace"))] * bool(self._rest)
            raise what_answers(self.port.name, heard, "Marlin")
        self._synchronise()
        self._firmware()
        self._anew = False
        return self.fresh_status()

    def _knock(self) -> None:
        self.write(b"\n" + _FIRST.data)

    def _synchronise(self) -> None:
        """Wait until nothing more comes to what was sent before, and number the next line 1."""
        self._forget()
        self._stray = 0
        quiet = self.clock()
        until = self._until(ANSWER_SECONDS)
        while self.clock() - quiet < 2 * QUIET_SECONDS and self.clock() < until:
            if self.listen():
                quiet = self.clock()

    def _firmware(self) -> tuple[str, dict[str, bool]]:
        """Return its name and what it can do.

        Raises
        ------
        SendError
            It is no Marlin 2.
        """
        said = [one for one in self.ask("M115") if isinstance(one, Report)]
        name = next((one.text for one in said if one.name == FIRMWARE), "")
        version = _VERSION.match(name)
        if version is None:
            raise what_answers(self.port.name, [name or "ok"], "Marlin")
        if int(version[1]) < 2:
            raise SendError(f"what answers on {self.port.name} is {shown(version[0], 40)}; Marlin 2 is needed")
        pairs = [one.text.rpartition(":") for one in said if one.name == CAPABILITY]
        return version[0], {name: on.strip() == "1" for name, _, on in pairs}

    def gather(self) -> Facts:
        """Return what it says of itself.

        Raises
        ------
        SendError
            It does not say what is needed: settings, travel, signs of life.
        """
        version, abilities = self._firmware()
        if not re.search(r"M113 S[12]\b", self._words("M113", _NO_BUSY)):
            raise SendError(_NO_BUSY)
        settings = self._words("M503", _NO_SETTINGS)
        on, low, high = _soft_endstops(self._words("M211", _NO_TRAVEL))
        try:
            machine = imported(settings, "M503", "marlin").machine
        except ReadError as problem:
            raise SendError(f"the controller's settings cannot be used: {problem}") from None
        if machine.units != "mm":
            raise SendError("the controller counts in inches (G20 in M503); leafcut sends millimetres to Marlin")
        status = self._rested()
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
        """Return the kind of its settings, and what it says of them; its travel where it knows one.

        Raises
        ------
        SendError
            It does not say them.
        """
        settings = self._words("M503", _NO_SETTINGS)
        with suppress(NotBuiltIn):
            settings += self._words("M211", _NO_TRAVEL)
        return "marlin", settings

    def _words(self, question: str, lacking: str) -> str:
        """Return what it says to a question, as text; `lacking` is told of a firmware that lacks the word."""
        try:
            answers = self.ask(question)
        except SendError:
            if self._flying is not None:  # not answered at all
                raise
            raise NotBuiltIn(lacking) from None
        return "\n".join(one.text for one in answers if isinstance(one, Report) and one.name != PLACE) + "\n"

    def begin(self) -> None:
        """Keep the motors on: at a change of tool it would let them go, and the place with them (M84 S0)."""
        self.ask("M84 S0")

    def hold(self) -> None:
        """Send nothing more: it comes to rest when it has done what it has planned."""
        self._held = True

    def resume(self) -> None:
        """Go on sending."""
        self._held = False

    def step_feed(self, now: int, wanted: int) -> None:
        """Change the feed, and the rapids with it, of what is planned from now on."""
        self._ours.append(f"M220 S{wanted}")

    def home_lines(self) -> str:
        """Return the line that homes it."""
        return "G28"

    def _give_up_homing(self) -> None:
        with suppress(SendError):
            self.stop()

    def zero_line(self, axes: str) -> str:
        """Return the line that makes the place of the tool zero."""
        return "G92 " + " ".join(f"{axis}0" for axis in axes)

    def unlock(self) -> bool:
        """Bring it to rest, and out of what it was stopped by.

        Raises
        ------
        SendError
            It does not answer.
        """
        if self.fresh_status().state == "Run":
            self.stop()
        self.ask("M999 S1")  # without S1 it would ask for lines again
        return False

    def stop(self, heard: Heard = unheard) -> Status:
        """Stop it: of one that stands only the spindle; of any other the motors, at once.

        Raises
        ------
        SendError
            It does not answer any more.
        """
        standing, self._held, self._resetting = not self._moved, False, True
        try:
            if standing:
                self.ask("M5")
                return self._rested()
            return self._stop_at_once(heard)
        finally:
            self._resetting = self._interrupted = False

    def _stop_at_once(self, heard: Heard) -> Status:
        self.homed = False
        self._ours.clear()
        # Without a number: so it acts before its turn.
        self.write(b"M410\n")
        self._stray += 1
        for answer in self.heard(DROPPED_SECONDS / self.patience):
            heard(answer)
        self._forget()
        self._stray = 0  # its answer may have been taken for that of a line which had none
        if not any(isinstance(one, Accepted) for one in self.heard(ANSWER_SECONDS, KNOCK_SECONDS, self._knock)):
            self.write(b"M112\n")
            raise SendError("it does not answer to M410; M112 (emergency stop) was sent")
        self._synchronise()
        self.ask("M5")
        status = replace(self._rested(), state=STOPPED_SHORT)
        if self._anew:
            status = replace(status, machine=None, work=None)
        heard(status)
        return self._told(status)

    def _rested(self) -> Status:
        """Return what it does when it stands."""
        status = self.fresh_status(PLANNED_SECONDS)
        while status.state == "Run":
            status = self.fresh_status(PLANNED_SECONDS)
        return status

    def reset(self, heard: Heard = unheard) -> Status:
        """Stop it: it has no reset that comes over the line."""
        return self.stop(heard)

    def halt(self, heard: Heard = unheard) -> Status:
        """Stop what it may still do after an error; one that has killed itself hears nothing."""
        if self._killed:
            return self._told(Status("Alarm"))
        return self.stop(heard)

    def stop_unheard(self) -> str:
        """Send the emergency stop: perhaps it hears that."""
        self.write(b"M112\n")
        return "M112 (emergency stop) was sent all the same"


def _soft_endstops(text: str) -> tuple[bool, XYZ, XYZ]:
    """Return whether soft end stops are on, and the lowest and highest places, mm, of the answer to M211.

    Raises
    ------
    SendError
        The firmware has none: then nobody knows the travel.
    """
    ends = {found[1].lower(): found for found in _ENDS.finditer(text)}
    if "min" not in ends or "max" not in ends:
        raise SendError(_NO_TRAVEL)
    low, high = ((float(found[2]), float(found[3]), float(found[4])) for found in (ends["min"], ends["max"]))
    word = _M211_WORD.search(text)
    on = word[1] == "1" if word else re.search(r"endstops:\s*ON", text, re.IGNORECASE) is not None
    return on, low, high
