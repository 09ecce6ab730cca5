"""Answers of a controller, independent of its firmware. Each firmware has its own module that parses its lines."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.machine import XYZ

#: Maximum length of an answer line, characters.
LONGEST_ANSWER = 1024


@dataclass(frozen=True)
class Accepted:
    """A line was accepted: ``ok``."""


@dataclass(frozen=True)
class Refused:
    """A line was refused, with an error number or a reason as text."""

    why: int | str


@dataclass(frozen=True)
class Alarm:
    """The machine has stopped with an alarm, with an alarm number or a reason as text."""

    why: int | str


@dataclass(frozen=True)
class Greeting:
    """The greeting of a controller that has just started or was reset."""

    version: str
    name: str


@dataclass(frozen=True)
class Status:
    """A status report. Positions are in the units of the report; missing fields are None.

    Attributes
    ----------
    state, detail
        ``Idle``, ``Run``, ``Hold``, ``Alarm`` …, and the number after it, such as 0 in ``Hold:0``.
    free_blocks, free_bytes
        Free space in the planner and in the receive buffer.
    overrides
        Feed, rapid and spindle override, percent.
    pins
        Active inputs, one letter each.
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
class Report:
    """Any other controller report: ``[GC:G0 G54]``, ``$110=500``, ``[MSG:Caution: Unlocked]``, ``Cap:EEPROM:1``."""

    name: str
    text: str

    def __str__(self) -> str:
        return f"{self.name}: {self.text}" if self.name and self.name != "MSG" else self.text

    @property
    def numbers(self) -> tuple[float, ...] | None:
        """The comma-separated numbers in the text of the report; None if the text is not a list of numbers."""
        return numbers_in(self.text)


@dataclass(frozen=True)
class InvalidAnswer:
    """A line that is not a valid answer."""

    text: str


ControllerAnswer = Accepted | Refused | Alarm | Greeting | Status | Report | InvalidAnswer


def numbers_in(text: str) -> tuple[float, ...] | None:
    """Return comma-separated numbers; None if the text is not a list of numbers."""
    try:
        return tuple(float(number) for number in text.split(",")) if text else None
    except ValueError:
        return None


def place_in(text: str | None) -> XYZ | None:
    """Return the first three of several comma-separated numbers as x, y, z; None if there are fewer than three."""
    values = numbers_in(text or "")
    return None if values is None or len(values) < 3 else (values[0], values[1], values[2])
