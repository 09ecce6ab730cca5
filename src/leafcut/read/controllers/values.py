"""The values in the settings of a controller. Each value has a source."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from leafcut.errors import ReadError, printable
from leafcut.gcode.dialects import dialect_names
from leafcut.message import Message
from leafcut.model.kinds import Head
from leafcut.units import FACTORS

#: Plausible maxima of speed, acceleration and travel, mm/s, mm/s², mm. Sources: linear motors of flat-bed lasers reach
#: 3 to 5 m/s and 5 g; shipyard gantries 50 m.
FASTEST, HARDEST, LONGEST = 10_000.0, 100_000.0, 100_000.0
#: Plausible maximum of the spindle speed, rpm: air bearings of circuit board drills reach 350,000.
FASTEST_SPINDLE = 500_000.0

#: Estimates for missing values.
HAND_CHANGE = "60 s", "a practised operator, including setting Z again"
SPINDLE_START = "2 s", "a small spindle"

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class ValueOrigin(StrEnum):
    """Where a value comes from: read from the settings, derived from other values, or assumed."""

    TAKEN = "taken"
    DERIVED = "derived"
    ASSUMED = "assumed"


@dataclass(frozen=True)
class Value:
    """A value of a machine profile.

    Attributes
    ----------
    key
        ``key`` or ``table.key``.
    value
        The value as written in a profile: text with a unit, a list of three values, a bool, or a number.
    """

    key: str
    value: Any
    how: ValueOrigin
    source: str

    @property
    def source_text(self) -> str:
        """Source of the value, formatted for the table `[sources]` of a profile."""
        return f"estimate: {self.source}" if self.how is ValueOrigin.ASSUMED else self.source


@dataclass(frozen=True)
class Scalar:
    """A text in a settings file, with its line."""

    text: str
    line: int


@dataclass
class Values:
    """The values of a settings file.

    Attributes
    ----------
    title
        Kind of file, such as ``GRBL 1.1``.
    notes
        Hints for the user, and settings that do not fit into a profile.
    """

    file: str
    title: str
    entries: dict[str, Value] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def take(self, key: str, value: Any, source: str) -> None:
        """Store a value from the settings file."""
        self.entries[key] = Value(key, value, ValueOrigin.TAKEN, source)

    def derive(self, key: str, value: Any, source: str) -> None:
        """Store a value derived from the settings file or from the kind of controller."""
        self.entries[key] = Value(key, value, ValueOrigin.DERIVED, source)

    def assume(self, key: str, value: Any, source: str) -> None:
        """Store an estimate for a value that the settings file does not contain."""
        self.entries[key] = Value(key, value, ValueOrigin.ASSUMED, source)

    def note(self, text: str) -> None:
        """Add a hint for the user."""
        self.notes.append(text)

    def refusal(self, reason: str, line: int | None = None) -> ReadError:
        """Create the error that explains why a settings file cannot be used."""
        return ReadError(self.file, reason, line)

    def store_controller(self, name: str, source: str, otherwise: str) -> None:
        """Store the dialect of a controller. If leafcut does not support the controller, store `otherwise` instead."""
        if name in dialect_names():
            self.derive("controller", name, source)
        else:
            self.assume(
                "controller", otherwise, f"leafcut has no dialect of {self.title} yet; {otherwise} is the nearest"
            )

    def store_motion(self, velocity: Axes, acceleration: Axes) -> None:
        """Store the rapid velocities and accelerations.

        The maximum feed becomes the lower of the x and y rapid velocities.
        """
        for key, axes, limit in (("velocity", velocity, FASTEST), ("acceleration", acceleration, HARDEST)):
            axes.check_plausible(self, f"rapid.{key}", limit, above_0=True)
        self._store_axes("rapid.velocity", velocity)
        self._store_axes("rapid.acceleration", acceleration)
        slower = min(velocity.numbers[:2])
        self.derive(
            "max_feed", format_with_unit(slower, velocity.unit), "the slower rapid of x and y: axes also limit feeds"
        )

    def store_travel(self, lowest: Axes, highest: Axes) -> None:
        """Store the travel limits. An infinite limit counts as unknown."""
        for low, high, name in zip(lowest.numbers, highest.numbers, "xyz", strict=True):
            if not high > low:
                raise self.refusal(
                    f"the travel of {name} ends at {high:g} {highest.unit}, not above its start, {low:g} "
                    f"{lowest.unit} ({highest.source})"
                )
        for key, axes in (("travel.min", lowest), ("travel.max", highest)):
            axes.check_plausible(self, key, LONGEST)
            self._store_axes(key, axes)
        unknown = [
            n for low, high, n in zip(lowest.numbers, highest.numbers, "xyz", strict=True) if high - low == math.inf
        ]
        if unknown:
            self.note(f"the travel of {', '.join(unknown)} is unknown: it is not checked")

    def store_home(self, position: Axes) -> None:
        """Store the home position, clamped to the travel. Call it after `store_travel`."""
        ends = [self.entries.get(f"travel.{end}") for end in ("min", "max")]
        inside = list(position.numbers)
        for axis in range(3):
            for end, choose in zip(ends, (max, min), strict=True):
                limit = end and (end.value if isinstance(end.value, str) else end.value[axis]).partition(" ")[0]
                if limit and _NUMBER.fullmatch(limit):
                    inside[axis] = choose(inside[axis], float(limit))
        moved = inside != list(position.numbers)
        source = f"{position.source}; moved into the travel" if moved else position.source
        store = self.assume if position.assumed else self.derive if moved or position.derived else self.take
        store("home", format_axes(inside, position.unit), source)

    def store_manual_tool_changes(self, why: str) -> None:
        """Store the fact that an operator changes tools by hand."""
        self.assume("tool_change.automatic", False, why)
        self.assume("tool_change.time", *HAND_CHANGE)

    def assume_spindle_start(self, laser: bool = False) -> None:
        """Store an estimate of the time that a spindle needs to start."""
        self.assume("spindle.start_time", *(("0 s", "a laser needs no start-up time") if laser else SPINDLE_START))

    def store_process(self, head: Head, source: str) -> None:
        """Store the process of the machine."""
        self.derive("process", head.value, source)

    def store_spindle_range(self, highest: float, lowest: float, source: str) -> None:
        """Store the speed range of the spindle, rpm."""
        if not 0 <= lowest <= highest <= FASTEST_SPINDLE or not highest > 0:
            raise self.refusal(f"the spindle turns {lowest:g} to {highest:g} rpm ({source}); correct it first")
        self.take("spindle.max_speed", f"{highest:g} rpm", source)
        if lowest > 0:
            self.take("spindle.min_speed", f"{lowest:g} rpm", source)

    def _store_axes(self, key: str, axes: Axes) -> None:
        store = self.assume if axes.assumed else self.derive if axes.derived else self.take
        store(key, format_axes(axes.numbers, axes.unit), axes.source)


@dataclass(frozen=True)
class Axes:
    """A value for each axis. All values have the same unit and source."""

    numbers: tuple[float, ...]
    unit: str
    source: str
    derived: bool = False
    assumed: bool = False

    def check_plausible(self, values: Values, key: str, limit: float, above_0: bool = False) -> None:
        """Check that the values of the axes are plausible.

        Raises
        ------
        ReadError
            A value is too large, or is not above 0 although `above_0` requires it.
        """
        kind = {"rapid.velocity": "mm/s", "rapid.acceleration": "mm/s²"}.get(key, "mm")
        factor = FACTORS[kind][self.unit]
        for number, axis in zip(self.numbers, "xyz", strict=True):
            if above_0 and not number > 0:
                raise values.refusal(f"{key} of {axis} is {number:g} {self.unit}, but must be above 0 ({self.source})")
            if math.isfinite(number) and abs(number) * factor > limit:
                raise values.refusal(
                    f"{key} of {axis} is {number:g} {self.unit}, more than any machine has, "
                    f"{limit / factor:g} {self.unit} ({self.source}); correct it first"
                )


def parse_leading_number(values: Values, text: str, label: str, line: int | None = None) -> float:
    """Parse a number, and ignore any text after it, such as a comment.

    Raises
    ------
    ReadError
        The text does not start with a number.
    """
    match = _NUMBER.match(text.strip())
    if match is None:
        raise values.refusal(f"{label} is '{printable(text.strip(), 30)}', but must be a number", line)
    value = float(match[0])
    if not math.isfinite(value):
        raise values.refusal(f"{label} is {printable(match[0], 30)}, which no machine has", line)
    return value


def format_with_unit(value: float, unit: str) -> str:
    """Format a number with its unit for a machine profile. Return "unknown" if the number is infinite."""
    return f"{value:.10g} {unit}" if math.isfinite(value) else "unknown"


def format_axes(numbers: Sequence[float], unit: str) -> Any:
    """Format the values of all axes for a machine profile, as a list, or as a single value if all axes are equal."""
    written = [format_with_unit(value, unit) for value in numbers]
    return written[0] if len(set(written)) == 1 else written


def format_line_numbers(lines: Iterable[int]) -> str:
    """Format line numbers: ``line 3`` or ``lines 3, 5 and 7``."""
    sorted_lines = sorted(set(lines))
    if len(sorted_lines) == 1:
        return Message("line {}", sorted_lines[0])
    if len(sorted_lines) > 2 and sorted_lines[-1] - sorted_lines[0] == len(sorted_lines) - 1:
        return f"lines {sorted_lines[0]} to {sorted_lines[-1]}"
    return f"lines {', '.join(map(str, sorted_lines[:-1]))} and {sorted_lines[-1]}"
