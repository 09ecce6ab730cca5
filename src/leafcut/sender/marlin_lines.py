"""Parser for the lines of Marlin 2.

    parse("echo:busy: processing")    Report("busy", "processing")

Source: MarlinFirmware/Marlin, core/language.h (the words), gcode/queue.cpp (`ok_to_send`, `flush_and_request_resend`,
`gcode_line_error`), gcode/gcode.cpp (`host_keepalive`), gcode/parser.cpp (`unknown_command_warning`),
gcode/host/M114.cpp and M115.cpp, module/motion.cpp (`report_logical_position`, `homing_needed_error`), MarlinCore.cpp
(`setup`, `kill`), feature/host_actions.cpp.
"""

from __future__ import annotations

import re

from leafcut.errors import printable
from leafcut.message import Message
from leafcut.sender.answers import Accepted, Alarm, ControllerAnswer, Greeting, InvalidAnswer, Report

#: Names of the reports that leafcut acts upon. Other messages become a `Report` with another name or none.
RESEND, BUSY, PLACE, UNKNOWN, HOME_FIRST, FIRMWARE, CAPABILITY, ACTION = (
    "Resend", "busy", "place", "Unknown command", "Home first", "FIRMWARE_NAME", "Cap", "action",
)  # fmt: skip

_OK = re.compile(r"ok(\s.*)?")
_RESEND = re.compile(r"(?:Resend:|rs)\s*N?(\d{1,9})", re.IGNORECASE)
#: Parts of the errors for a corrupted line in various versions of Marlin. A `Resend:` follows them.
_LINE_ERRORS = ("checksum", "line number", "expected line")
_UNKNOWN = re.compile(r".*Unknown command:\s*\"?([^\"]*)\"?\s*$", re.IGNORECASE)
_HOME_FIRST = re.compile(r"echo:\s*Home\s+([XYZ ]+)\s+First", re.IGNORECASE)
_PLACE = re.compile(r"X:\s*(-?[\d.]+)\s+Y:\s*(-?[\d.]+)\s+Z:\s*(-?[\d.]+)")
_NAMED = re.compile(r"(FIRMWARE_NAME|Cap):\s*(.*)")

#: Meaning of an error after which only a reset helps.
KILLED = Message(
    "the board has switched off the motors and the spindle (kill): find the cause, then press the reset button"
)
#: Part of an error text → meaning.
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


def parse(line: str) -> ControllerAnswer:
    """Convert a line of a controller to an answer; a line with unprintable characters (noise) is an `InvalidAnswer`."""
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
        return _error(line.partition(":")[2].strip() or line)
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


def _error(text: str) -> ControllerAnswer:
    if any(words in text.lower() for words in _LINE_ERRORS):
        return Report("line error", printable(text, 80))
    meaning = next((words for part, words in _ERRORS.items() if part in text), "")
    return Alarm(meaning or Message("Marlin stopped with '{}'", printable(text, 80)))
