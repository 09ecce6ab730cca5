"""Communication with GRBL 1.1, grblHAL and FluidNC.

Most actions are realtime bytes. For grblHAL, leafcut uses grblHAL's own bytes above 0x7F, because ``?``, ``!`` and
``~`` may be disabled there (``[NEWOPT:…,RT-``) and would then become part of a line.

Source: gnea/grbl 1.1, config.h, protocol.c and its wiki, "Grbl v1.1 Commands"; grblHAL/core, grbl.h (CMD_…) and
protocol.c, `protocol_enqueue_realtime_command`; bdring/FluidNC, RealtimeCmd.h (same bytes as GRBL).
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from leafcut.errors import SendError, printable
from leafcut.message import Message
from leafcut.sender.answers import (
    Accepted,
    Alarm,
    ControllerAnswer,
    Greeting,
    InvalidAnswer,
    Refused,
    Report,
    Status,
    parse_numbers,
    parse_position,
)
from leafcut.sender.controller_facts import Facts
from leafcut.sender.conversation import (
    ANSWER_SECONDS,
    LOCKED,
    POLL_SECONDS,
    SLOW_POLL_SECONDS,
    START_SECONDS,
    Conversation,
    Interrupted,
    Log,
    OnAnswer,
    answer_text,
    ignore_answer,
    wrong_firmware_error,
)
from leafcut.sender.error_texts import firmware_family
from leafcut.sender.grbl_facts import facts_from_answers
from leafcut.sender.port import Port

#: Soft reset. All three firmwares use this byte.
RESET = b"\x18"
#: Time limit for the machine to come to rest, and time between hold and reset if it no longer responds, s.
REST_SECONDS, UNANSWERED_SECONDS = 15.0, 3.0
#: Time limit for the report that explains an alarm, and interval for repeating an unanswered reset, s.
ALARM_SECONDS, RESET_SECONDS = 3.0, 2.0
#: Time to wait for another firmware to answer an empty line, s.
_LINE_SECONDS = 1.0
#: States in which the machine stays at rest until the next command.
_AT_REST = ("Idle", "Check", *LOCKED)
_FEED_NORMAL = b"\x90"
#: Maps override steps in percent to bytes.
_FEED_STEPS = {10: b"\x91", -10: b"\x92", 1: b"\x93", -1: b"\x94"}

_NUMBERED = re.compile(r"(error|ALARM):\s*(\d{1,3})", re.IGNORECASE)
_GREETING = re.compile(r"Grbl(?:HAL)?\s+([0-9][^\s\['\"]{0,20})(?:\s+\[([^\]]{1,60})\])?", re.IGNORECASE)
#: A setting. In grblHAL, the value may also be a text, such as a network name or a password, or empty.
_SETTING = re.compile(r"\$(\d{1,4})=(.*)")
#: A remark in parentheses after the value of a setting.
_REMARK = re.compile(r"\s+\(.*\)\s*$")


@dataclass(frozen=True)
class RealtimeBytes:
    """Realtime bytes for the status query, the feed hold and the cycle start."""

    ask: bytes
    hold: bytes
    resume: bytes


_LEGACY, _GRBLHAL = RealtimeBytes(b"?", b"!", b"~"), RealtimeBytes(b"\x80", b"\x82", b"\x81")


class GrblConversation(Conversation):
    """A connection to a controller that uses the protocol of GRBL 1.1."""

    check_line = "$C"

    def __init__(self, port: Port, log: Log | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(port, log, clock)
        self.act = _LEGACY
        self._knocks = 0
        #: The lines of FluidNC's configuration received so far, or None if no configuration is being received.
        self._raw: list[str] | None = None

    def parse(self, line: str) -> ControllerAnswer:
        """Parse a line from the controller. If the line names the firmware, remember it."""
        answer = parse_grbl_line(line)
        if not self.family and isinstance(answer, Greeting | Report) and (family := firmware_family(line)):
            self.family = family
            if family == "grblHAL":
                self.act = _GRBLHAL
        return answer

    def request_status(self, *, more: bool = False) -> None:
        """Query the status with a realtime byte. The report arrives like any other answer."""
        self.port.write(self.act.ask)

    def connect(self) -> Status:
        """Wait for the controller, and return its status.

        Raises `SendError` if the controller does not answer, or if it has a different firmware.
        """
        replies: list[str] = []
        for answer in self.receive_answers(START_SECONDS, SLOW_POLL_SECONDS, self._query_board):
            if isinstance(answer, Status):
                if self._knocks > 1:
                    self._detect_realtime_bytes()
                return answer
            if isinstance(answer, Greeting):
                self.restarted = True
                self.request_status()
            else:
                replies.append(answer_text(answer))
        if not replies and not self._rest:
            replies = self._answers_to_empty_line()
        replies += [printable(self._rest.decode("ascii", "replace"))] * bool(self._rest)
        raise wrong_firmware_error(self.port.name, replies, "GRBL")

    def _answers_to_empty_line(self) -> list[str]:
        """Send an empty line and return the answers. Some firmwares respond only to lines."""
        self.write(b"\n")
        return [answer_text(answer) for answer in self.receive_answers(_LINE_SECONDS)]

    def _query_board(self) -> None:
        """Query the status of an unknown board.

        A grblHAL board may ignore ``?``. From the second attempt on, this method therefore also sends grblHAL's own
        query byte.
        """
        self._knocks += 1
        if self._knocks > 1 and not self.family:
            self.port.write(_GRBLHAL.ask)
        self.request_status()

    def _detect_realtime_bytes(self) -> None:
        """Switch to grblHAL's realtime bytes if the board answers grblHAL's status query. GRBL ignores that byte."""
        self.discard_answers(SLOW_POLL_SECONDS)
        self.port.write(_GRBLHAL.ask)
        if any(isinstance(answer, Status) for answer in self.receive_answers(SLOW_POLL_SECONDS)):
            self.act = _GRBLHAL

    def read_facts(self) -> Facts:
        """Read the settings and the state of the controller.

        Raises `SendError` if the firmware is not GRBL, or if the controller does not report a required value.
        """
        self._end_partial_line()
        answers: list[ControllerAnswer] = []
        for question in ("$I", "$$", "$#", "$G"):
            answers += self.ask(question)
        configuration = self._query_fluidnc_configuration() if self.family == "FluidNC" else ""
        return facts_from_answers(answers, self.query_status(), homed=self.homed, configuration=configuration)

    def read_settings_text(self) -> tuple[str, str]:
        """Read the settings, or the configuration in the case of FluidNC. Return their kind and their text.

        Raises `SendError` if the controller does not report them.
        """
        self._end_partial_line()
        build_info = self.ask("$I")
        if not any(isinstance(report, Report) for report in build_info):
            raise wrong_firmware_error(self.port.name, ["ok"], "GRBL")
        if self.family == "FluidNC":
            return "fluidnc", self._query_fluidnc_configuration()
        reports = [report for report in [*build_info, *self.ask("$$")] if isinstance(report, Report)]
        lines = [f"{report.name}={report.text}" if report.name.startswith("$") else f"[{report}]" for report in reports]
        return "grbl", "\n".join(lines) + "\n"

    def _end_partial_line(self) -> None:
        self.write(b"\n")
        if not any(isinstance(answer, Accepted | Refused) for answer in self.receive_answers(ANSWER_SECONDS)):
            raise SendError(
                "the device on {} reports its state, but accepts no line; reset it, and check the cable", self.port.name
            )
        self.listen()

    def _query_fluidnc_configuration(self) -> str:
        lines: list[str] = []
        self._raw = lines
        try:
            self.ask("$CD")
        finally:
            self._raw = None
        return "\n".join(lines) + "\n"

    def _parse_line(self, text: str) -> ControllerAnswer:
        if self._raw is not None and isinstance(parse_grbl_line(text), InvalidAnswer):
            self._raw.append(text)
            self.log("<", printable(text, 200))
            return Report("", "")
        return super()._parse_line(text)

    def send(self, text: str) -> None:
        """Send a line."""
        self.write(text.encode("ascii") + b"\n")

    def hold(self) -> None:
        """Send a feed hold. The machine decelerates and waits."""
        self.write(self.act.hold)

    def resume(self) -> None:
        """Continue after a hold."""
        self.write(self.act.resume)

    def step_feed_override(self, current: int, target: int) -> None:
        """Change the feed override by 10 or 1 percent.

        The method sends a single step, because the board merges steps that arrive together.
        """
        change = target - current
        step = (10 if abs(change) >= 10 else 1) * (1 if change > 0 else -1)
        self.write(_FEED_NORMAL if target == 100 else _FEED_STEPS[step])

    def prepare_for_program(self) -> None:
        """Do nothing, because the controller needs no preparation."""

    def homing_command(self) -> str:
        """Return the homing command."""
        return "$H"

    def _abort_homing(self) -> None:
        # A homing machine ignores a hold.
        with suppress(SendError):
            self.reset()

    def zeroing_command(self, axes: str) -> str:
        """Return the command that sets the zero of G54 to the current tool position."""
        return "G10 L20 P1 " + " ".join(f"{axis}0" for axis in axes)

    def unlock(self) -> bool:
        """Unlock the machine without homing it. Return whether it was locked.

        Raises `SendError` if the machine stays locked.
        """
        status = self.query_status()
        if status.state not in _AT_REST or status.state in ("Check", "Sleep"):
            status = self.stop()
        locked = status.state in LOCKED
        if locked:
            self.ask("$X")
        return locked

    def stop(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Hold the machine, wait until it is at rest, reset it, and return the status.

        The reset stops the spindle and discards all lines. `on_answer` receives every answer that arrives in the
        meantime. Raises `SendError` if the controller no longer answers.
        """
        try:
            self.hold()
            self._wait_for_rest(on_answer)
        except (KeyboardInterrupt, Interrupted):
            pass  # a second interrupt resets at once
        return self.reset(on_answer)

    def _wait_for_rest(self, on_answer: OnAnswer) -> None:
        for answer in self.receive_answers(REST_SECONDS, POLL_SECONDS):
            on_answer(answer)
            if isinstance(answer, Greeting):
                return
            if isinstance(answer, Status) and (answer.state in _AT_REST or has_come_to_rest(answer)):
                return

    def reset(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Reset the controller and return its status. Raises `SendError` if it no longer answers."""
        self._resetting = True
        try:
            return self._reset(on_answer)
        finally:
            self._resetting = self._interrupted = False

    def _reset(self, on_answer: OnAnswer) -> Status:
        sent = 0

        def send_reset() -> None:
            # A reset is lost while an alarm is being reported (gnea/grbl 1.1, protocol.c).
            nonlocal sent
            self.write(RESET)
            sent += 1

        for answer in self.receive_answers(ANSWER_SECONDS, RESET_SECONDS, send_reset):
            on_answer(answer)
            if isinstance(answer, Greeting):
                break
        if sent > 1:
            self.discard_answers(RESET_SECONDS)  # repeated resets may be answered as well
        return self.query_status()

    def clean_up_after_alarm(self, on_answer: OnAnswer = ignore_answer) -> Status:
        """Wait until GRBL has reported the alarm, then reset the controller.

        GRBL takes half a second to report an alarm and ignores resets during this time.
        """
        self.wait_for_alarm_report(ALARM_SECONDS)
        return self.reset(on_answer)

    def stop_unanswered(self) -> Message:
        """Send a hold, wait until the machine should be at rest, and send a reset.

        The board may still receive these bytes, even if it no longer answers.
        """
        self.hold()
        self.discard_answers(UNANSWERED_SECONDS)
        self.write(RESET)
        return Message("a hold and a reset were sent anyway")


def has_come_to_rest(status: Status) -> bool:
    """Return whether the machine has come to rest in the state Hold or Door.

    Source: gnea/grbl wiki, "Grbl v1.1 Interface"; grblHAL/core, system.h (`Hold_Complete`, `Parking_DoorAjar`). FluidNC
    prints the same states, and ``Door:0`` if the door has been closed again.
    """
    return status.state in ("Hold", "Door") and status.detail in (0, 1 if status.state == "Door" else 0)


def parse_grbl_line(line: str) -> ControllerAnswer:
    """Parse a line from a controller. An invalid line becomes an `InvalidAnswer`.

        parse("<Run|MPos:1.000,2.000,-0.500|Bf:15,128|FS:500,8000>").state    'Run'

    Source: gnea/grbl 1.1, report.c, and its wiki, "Grbl v1.1 Interface"; grblHAL/core and bdring/FluidNC, their
    reports.
    """
    line = line.strip()
    if line == "ok":
        return Accepted()
    if match := _NUMBERED.fullmatch(line):
        return (Refused if match[1].lower() == "error" else Alarm)(int(match[2]))
    if line.startswith("<") and line.endswith(">"):
        return _parse_status(line[1:-1]) or InvalidAnswer(printable(line))
    if line.startswith("[") and line.endswith("]"):
        name, colon, rest = line[1:-1].partition(":")
        return Report(name, _shorten_to_printable(rest)) if colon else Report("", printable(name, 120))
    if match := _GREETING.match(line):
        return Greeting(match[1], match[2] or "")
    if match := _SETTING.match(line):
        return Report(f"${match[1]}", _shorten_to_printable(_REMARK.sub("", match[2]).strip()))
    # Start-up lines, which are echoed when they are executed, and additional output of grblHAL and FluidNC.
    if line.startswith((">", "$N")):
        return Report("", printable(line))
    return InvalidAnswer(printable(line))


def _shorten_to_printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:200])


def _parse_status(text: str) -> Status | None:
    state, *fields = text.split("|")
    state, _, detail = state.partition(":")
    if not state.isalpha():
        return None
    values = {name: value for name, _, value in (field.partition(":") for field in fields)}
    free = parse_numbers(values.get("Bf", "")) or ()
    moving = parse_numbers(values.get("FS", values.get("F", ""))) or ()
    overrides = parse_numbers(values.get("Ov", "")) or ()
    return Status(
        state=state,
        detail=int(detail) if detail.isdecimal() else None,
        machine=parse_position(values.get("MPos")),
        work=parse_position(values.get("WPos")),
        offset=parse_position(values.get("WCO")),
        free_blocks=int(free[0]) if len(free) == 2 else None,
        free_bytes=int(free[1]) if len(free) == 2 else None,
        feed=moving[0] if moving else None,
        speed=moving[1] if len(moving) > 1 else None,
        overrides=(int(overrides[0]), int(overrides[1]), int(overrides[2])) if len(overrides) == 3 else None,
        pins=values.get("Pn", ""),
    )
