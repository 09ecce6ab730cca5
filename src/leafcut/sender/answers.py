"""Answers that a controller can send, independent of the firmware. Each firmware module parses its own lines."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.machine import XYZ

#: Maximum length of an answer line, characters.
LONGEST_ANSWER = 1024


@dataclass(frozen=True)
class Accepted:
    """The controller has accepted a line (``ok``)."""


@dataclass(frozen=True)
class Refused:
    """The controller has refused a line. Contains the error number, or the reason as text."""

    why: int | str


@dataclass(frozen=True)
class Alarm:
    """The machine has stopped with an alarm. Contains the alarm number, or the reason as text."""

    why: int | str


@dataclass(frozen=True)
class Greeting:
    """The greeting that a controller sends after it starts or resets."""

    version: str
    name: str


@dataclass(frozen=True)
class Status:
    """A status report. Positions use the units of the report. Fields that the controller did not report are None.

    Attributes
    ----------
    state, detail
        The state, such as ``Idle``, ``Run``, ``Hold`` or ``Alarm``, and the number after it, such as 0 in ``Hold:0``.
    free_blocks, free_bytes
        Free space in the planner and in the receive buffer.
    overrides
        Overrides of feed, rapids and spindle, percent.
    pins
        Active inputs. Each input has one letter.
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
    """Any other report of the controller, such as ``[GC:G0 G54]``, ``$110=500`` or ``[MSG:Caution: Unlocked]``."""

    name: str
    text: str

    def __str__(self) -> str:
        return f"{self.name}: {self.text}" if self.name and self.name != "MSG" else self.text

    @property
    def numbers(self) -> tuple[float, ...] | None:
        """The numbers in a comma-separated report, or None if the text is not a list of numbers."""
        return parse_numbers(self.text)


@dataclass(frozen=True)
class InvalidAnswer:
    """A line that is not a valid answer."""

    text: str


ControllerAnswer = Accepted | Refused | Alarm | Greeting | Status | Report | InvalidAnswer


def parse_numbers(text: str) -> tuple[float, ...] | None:
    """Parse a list of comma-separated numbers. Return None if the text is not such a list."""
    try:
        return tuple(float(number) for number in text.split(",")) if text else None
    except ValueError:
        return None


def parse_position(text: str | None) -> XYZ | None:
    """Read x, y and z from a list of comma-separated numbers. Return None if the list has fewer than three numbers."""
    values = parse_numbers(text or "")
    return None if values is None or len(values) < 3 else (values[0], values[1], values[2])
