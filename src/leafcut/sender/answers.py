"""What a GRBL controller says, line by line: GRBL 1.1, and grblHAL and FluidNC, which speak as it does.

    parse("<Run|MPos:1.000,2.000,-0.500|Bf:15,128|FS:500,8000>").state    'Run'

Source: gnea/grbl 1.1, report.c, and its wiki, "Grbl v1.1 Interface". grblHAL/core, report.c.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from leafcut.errors import shown
from leafcut.model.machine import XYZ

#: Nothing that a controller says in one line is longer.
LONGEST_ANSWER = 1024

_NUMBERED = re.compile(r"(error|ALARM):\s*(\d{1,3})", re.IGNORECASE)
_GREETING = re.compile(r"Grbl(?:HAL)?\s+([0-9][^\s\['\"]{0,20})(?:\s+\[([^\]]{1,60})\])?", re.IGNORECASE)
_SETTING = re.compile(r"\$(\d{1,4})=([^\s(]+)")
_PLACES = ("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92")


@dataclass(frozen=True)
class Accepted:
    """A line was taken: ``ok``."""


@dataclass(frozen=True)
class Refused:
    """A line was refused: ``error:20``."""

    code: int


@dataclass(frozen=True)
class Alarm:
    """Everything has stopped: ``ALARM:1``."""

    code: int


@dataclass(frozen=True)
class Greeting:
    """The controller has just started, or was reset."""

    version: str
    name: str


@dataclass(frozen=True)
class Status:
    """What it does now: the answer to ``?``. Places in the units of ``$13``; what it does not say is None.

    Attributes
    ----------
    state, detail
        ``Idle``, ``Run``, ``Hold``, ``Alarm`` …; the number behind it, such as 0 of ``Hold:0``.
    machine, work, offset
        In machine coordinates, in work coordinates, and what lies between them.
    free_blocks, free_bytes
        What its planner and its buffer can take.
    overrides
        Of feed, rapids and spindle, percent.
    pins
        The inputs that are on, a letter each.
    """

    state: str
    detail: int | None = None
    machine: XYZ | None = None
    work: XYZ | None = None
    offset: XYZ | None = None
    free_blocks: int | None = None
    free_bytes: int | None = None
    feed: float | None = None
    speed: float | None = None
    overrides: tuple[int, int, int] | None = None
    pins: str = ""


@dataclass(frozen=True)
class StoredSetting:
    """One line of the answer to ``$$``."""

    number: int
    value: str


@dataclass(frozen=True)
class Place:
    """One line of the answer to ``$#``: an origin, ``G54``, ``G28``, ``G92`` … or the tool's length, ``TLO``."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Modes:
    """The words that are active: the answer to ``$G``."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class Build:
    """The version, ``[VER:1.1h.20190830:]``."""

    version: str


@dataclass(frozen=True)
class Abilities:
    """What it was built with, ``[OPT:V,15,128]``: letters, blocks of its planner, bytes of its buffer."""

    letters: str
    blocks: int
    buffer: int


@dataclass(frozen=True)
class Contact:
    """Where a probe was closed, in machine coordinates in the units of ``$13``; `touched` is False where it was not."""

    place: XYZ
    touched: bool


@dataclass(frozen=True)
class Remark:
    """Anything else that it says in brackets, such as ``[MSG:Caution: Unlocked]``."""

    text: str


@dataclass(frozen=True)
class Strange:
    """A line that no such controller says."""

    text: str


ControllerAnswer = (
    Accepted
    | Refused
    | Alarm
    | Greeting
    | Status
    | StoredSetting
    | Place
    | Modes
    | Build
    | Abilities
    | Contact
    | Remark
    | Strange
)


def parse(line: str) -> ControllerAnswer:
    """Return what a line of a controller means; a line that makes no sense is `Strange`."""
    line = line.strip()
    if line == "ok":
        return Accepted()
    if found := _NUMBERED.fullmatch(line):
        return (Refused if found[1].lower() == "error" else Alarm)(int(found[2]))
    if line.startswith("<") and line.endswith(">"):
        return _status(line[1:-1]) or Strange(shown(line))
    if line.startswith("[") and line.endswith("]"):
        return _bracketed(line[1:-1])
    if found := _GREETING.match(line):
        return Greeting(found[1], found[2] or "")
    if found := _SETTING.match(line):
        return StoredSetting(int(found[1]), found[2])
    # Start-up lines as they are run, and what grblHAL and FluidNC write besides.
    if line.startswith((">", "$N")):
        return Remark(shown(line))
    return Strange(shown(line))


def _bracketed(text: str) -> ControllerAnswer:
    name, _, rest = text.partition(":")
    if name in _PLACES or name == "TLO":
        values = _numbers(rest)
        return Remark(shown(text)) if values is None else Place(name, values)
    if name == "PRB":
        numbers, _, touched = rest.partition(":")
        place = _place(numbers)
        return Remark(shown(text)) if place is None else Contact(place, touched.strip() == "1")
    if name == "GC":
        return Modes(tuple(rest.split()))
    if name == "VER":
        return Build(rest.partition(":")[0])
    if name == "OPT":
        letters, *counts = rest.split(",")
        if len(counts) >= 2 and counts[0].isdecimal() and counts[1].isdecimal():
            return Abilities(letters, int(counts[0]), int(counts[1]))
    return Remark(shown(text.removeprefix("MSG:"), 120))


def _status(text: str) -> Status | None:
    state, *fields = text.split("|")
    state, _, detail = state.partition(":")
    if not state.isalpha():
        return None
    said = {name: value for name, _, value in (field.partition(":") for field in fields)}
    free = _numbers(said.get("Bf", "")) or ()
    moving = _numbers(said.get("FS", said.get("F", ""))) or ()
    overrides = _numbers(said.get("Ov", "")) or ()
    return Status(
        state=state,
        detail=int(detail) if detail.isdecimal() else None,
        machine=_place(said.get("MPos")),
        work=_place(said.get("WPos")),
        offset=_place(said.get("WCO")),
        free_blocks=int(free[0]) if len(free) == 2 else None,
        free_bytes=int(free[1]) if len(free) == 2 else None,
        feed=moving[0] if moving else None,
        speed=moving[1] if len(moving) > 1 else None,
        overrides=(int(overrides[0]), int(overrides[1]), int(overrides[2])) if len(overrides) == 3 else None,
        pins=said.get("Pn", ""),
    )


def _place(text: str | None) -> XYZ | None:
    values = _numbers(text or "")
    return None if values is None or len(values) < 3 else (values[0], values[1], values[2])


def _numbers(text: str) -> tuple[float, ...] | None:
    try:
        return tuple(float(one) for one in text.split(",")) if text else None
    except ValueError:
        return None
