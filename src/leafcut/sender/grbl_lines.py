"""Parser for the lines of GRBL 1.1, grblHAL and FluidNC.

    parse("<Run|MPos:1.000,2.000,-0.500|Bf:15,128|FS:500,8000>").state    'Run'

Source: gnea/grbl 1.1, report.c, and its wiki, "Grbl v1.1 Interface"; grblHAL/core and bdring/FluidNC, their reports.
"""

from __future__ import annotations

import re

from leafcut.errors import printable
from leafcut.sender.answers import (
    Accepted,
    Alarm,
    ControllerAnswer,
    Greeting,
    InvalidAnswer,
    Refused,
    Report,
    Status,
    numbers_in,
    place_in,
)

_NUMBERED = re.compile(r"(error|ALARM):\s*(\d{1,3})", re.IGNORECASE)
_GREETING = re.compile(r"Grbl(?:HAL)?\s+([0-9][^\s\['\"]{0,20})(?:\s+\[([^\]]{1,60})\])?", re.IGNORECASE)
#: A setting. In grblHAL, the value may be a text or empty, such as a network name or a password.
_SETTING = re.compile(r"\$(\d{1,4})=(.*)")
#: Remark in parentheses after the value of a setting.
_REMARK = re.compile(r"\s+\(.*\)\s*$")


def parse(line: str) -> ControllerAnswer:
    """Convert a line of a controller to an answer; an invalid line becomes `InvalidAnswer`."""
    line = line.strip()
    if line == "ok":
        return Accepted()
    if match := _NUMBERED.fullmatch(line):
        return (Refused if match[1].lower() == "error" else Alarm)(int(match[2]))
    if line.startswith("<") and line.endswith(">"):
        return _status(line[1:-1]) or InvalidAnswer(printable(line))
    if line.startswith("[") and line.endswith("]"):
        name, colon, rest = line[1:-1].partition(":")
        return Report(name, _plain(rest)) if colon else Report("", printable(name, 120))
    if match := _GREETING.match(line):
        return Greeting(match[1], match[2] or "")
    if match := _SETTING.match(line):
        return Report(f"${match[1]}", _plain(_REMARK.sub("", match[2]).strip()))
    # Start-up lines, which are echoed when they are executed, and additional output of grblHAL and FluidNC.
    if line.startswith((">", "$N")):
        return Report("", printable(line))
    return InvalidAnswer(printable(line))


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:200])


def _status(text: str) -> Status | None:
    state, *fields = text.split("|")
    state, _, detail = state.partition(":")
    if not state.isalpha():
        return None
    values = {name: value for name, _, value in (field.partition(":") for field in fields)}
    free = numbers_in(values.get("Bf", "")) or ()
    moving = numbers_in(values.get("FS", values.get("F", ""))) or ()
    overrides = numbers_in(values.get("Ov", "")) or ()
    return Status(
        state=state,
        detail=int(detail) if detail.isdecimal() else None,
        machine=place_in(values.get("MPos")),
        work=place_in(values.get("WPos")),
        offset=place_in(values.get("WCO")),
        free_blocks=int(free[0]) if len(free) == 2 else None,
        free_bytes=int(free[1]) if len(free) == 2 else None,
        feed=moving[0] if moving else None,
        speed=moving[1] if len(moving) > 1 else None,
        overrides=(int(overrides[0]), int(overrides[1]), int(overrides[2])) if len(overrides) == 3 else None,
        pins=values.get("Pn", ""),
    )
