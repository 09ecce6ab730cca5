"""What a controller says, line by line, in the words of no firmware: each has a file that reads its lines into these.

What a line in brackets or behind an ``echo:`` says is kept as text (`Report`): who asked for it knows what it means.
"""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.machine import XYZ

#: Nothing that a controller says in one line is longer.
LONGEST_ANSWER = 1024


@dataclass(frozen=True)
class Accepted:
    """A line was taken: ``ok``."""


@dataclass(frozen=True)
class Refused:
    """A line was refused: the number of the error, or what is wrong with it in words."""

    why: int | str


@dataclass(frozen=True)
class Alarm:
    """Everything has stopped: the number of the alarm, or what has happened in words."""

    why: int | str


@dataclass(frozen=True)
class Greeting:
    """The controller has just started, or was reset."""

    version: str
    name: str


@dataclass(frozen=True)
class Status:
    """What it does now. Places in the units of its reports; what it does not say is None.

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
class Report:
    """Something that it tells: ``[GC:G0 G54]``, ``$110=500``, ``[MSG:Caution: Unlocked]``, ``Cap:EEPROM:1``."""

    name: str
    text: str

    def __str__(self) -> str:
        return f"{self.name}: {self.text}" if self.name and self.name != "MSG" else self.text

    @property
    def numbers(self) -> tuple[float, ...] | None:
        """The text as numbers between commas; None where it is something else."""
        return numbers_in(self.text)


@dataclass(frozen=True)
class Strange:
    """A line that no such controller says."""

    text: str


ControllerAnswer = Accepted | Refused | Alarm | Greeting | Status | Report | Strange


def numbers_in(text: str) -> tuple[float, ...] | None:
    """Return numbers between commas; None where there is something else."""
    try:
        return tuple(float(one) for one in text.split(",")) if text else None
    except ValueError:
        return None


def place_in(text: str | None) -> XYZ | None:
    """Return the first three numbers between commas, x, y and z; None where there are fewer."""
    values = numbers_in(text or "")
    return None if values is None or len(values) < 3 else (values[0], values[1], values[2])
