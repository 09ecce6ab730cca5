"""What the settings of a controller say of its machine, value by value, each with the place it comes from."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from leafcut.errors import ReadError, shown
from leafcut.gcode.dialects import dialects
from leafcut.model.kinds import Head
from leafcut.units import FACTORS

#: No machine is faster, speeds up harder or is longer: what goes beyond is a slip, in mm/s, mm/s² and mm. Sources:
#: linear motors of flat-bed lasers reach 3 to 5 m/s and 5 g; gantries of shipyards 50 m.
FASTEST, HARDEST, LONGEST = 10_000.0, 100_000.0, 100_000.0
#: Nor does a spindle turn faster, rpm: air bearings of drilling machines for boards reach 350,000.
FASTEST_SPINDLE = 500_000.0

#: What is taken for a machine whose file says nothing of it.
HAND_CHANGE = "60 s", "a practised hand, with setting z anew"
SPINDLE_START = "2 s", "a small spindle"

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class How(StrEnum):
    """How a value was come by."""

    TAKEN = "taken"
    DERIVED = "derived"
    ASSUMED = "assumed"


@dataclass(frozen=True)
class Value:
    """A value of a profile.

    Attributes
    ----------
    key
        Its key: ``key``, or ``table.key``.
    value
        As it stands in a profile: a text with its unit, a list of three, true or false, a number.
    how, source
        How it was come by, and from what, in words.
    """

    key: str
    value: Any
    how: How
    source: str

    @property
    def words(self) -> str:
        """Where it comes from, as `[sources]` of a profile says it."""
        return f"estimate: {self.source}" if self.how is How.ASSUMED else self.source


@dataclass
class Values:
    """The values that are found in a file.

    Attributes
    ----------
    file
        Its name, for messages.
    title
        What kind of settings these are: ``GRBL 1.1``.
    notes
        What the file says that a profile cannot hold, or that a person should look at.
    """

    file: str
    title: str
    found: dict[str, Value] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def take(self, key: str, value: Any, source: str) -> None:
        """Keep what the file says."""
        self.found[key] = Value(key, value, How.TAKEN, source)

    def derive(self, key: str, value: Any, source: str) -> None:
        """Keep what follows from what the file says, or from how its controller works."""
        self.found[key] = Value(key, value, How.DERIVED, source)

    def assume(self, key: str, value: Any, source: str) -> None:
        """Keep what the file does not say, and that is only likely."""
        self.found[key] = Value(key, value, How.ASSUMED, source)

    def note(self, words: str) -> None:
        """Keep what a person should know."""
        self.notes.append(words)

    def refusal(self, reason: str, line: int | None = None) -> ReadError:
        """Return the error that says why the file cannot be used."""
        return ReadError(self.file, reason, line)

    def controller(self, name: str, source: str, otherwise: str) -> None:
        """Keep the dialect of the controller; `otherwise` where leafcut does not know it."""
        if name in dialects():
            self.derive("controller", name, source)
        else:
            self.assume(
                "controller", otherwise, f"leafcut has no dialect of {self.title} yet; {otherwise} is the nearest"
            )

    def motion(self, velocity: Axes, acceleration: Axes) -> None:
        """Keep rapids and accelerations, and the highest feed as the slower rapid of x and y."""
        for key, axes, most in (("velocity", velocity, FASTEST), ("acceleration", acceleration, HARDEST)):
            axes.check(self, f"rapid.{key}", most, above_0=True)
        self._axes("rapid.velocity", velocity)
        self._axes("rapid.acceleration", acceleration)
        slower = min(velocity.numbers[:2])
        self.derive("max_feed", with_unit(slower, velocity.unit), "the slower rapid of x and y: axes limit feeds, too")

    def travel(self, lowest: Axes, highest: Axes) -> None:
        """Keep the travel, as far as it is known: an end that is not finite is unknown."""
        for low, high, name in zip(lowest.numbers, highest.numbers, "xyz", strict=True):
            if not high > low:
                raise self.refusal(
                    f"the travel of {name} ends at {high:g} {highest.unit}, not above its beginning, {low:g} "
                    f"{lowest.unit} ({highest.source})"
                )
        for key, axes in (("travel.min", lowest), ("travel.max", highest)):
            axes.check(self, key, LONGEST)
            self._axes(key, axes)
        unknown = [
            n for low, high, n in zip(lowest.numbers, highest.numbers, "xyz", strict=True) if high - low == math.inf
        ]
        if unknown:
            self.note(f"the travel of {', '.join(unknown)} is unknown: nothing is checked against it")

    def home_at(self, places: Axes) -> None:
        """Keep where the machine stands after homing; a place beyond the travel is moved to its end.

        Call it after `travel`.
        """
        ends = [self.found.get(f"travel.{end}") for end in ("min", "max")]
        inside = list(places.numbers)
        for axis in range(3):
            for end, choose in zip(ends, (max, min), strict=True):
                limit = end and (end.value if isinstance(end.value, str) else end.value[axis]).partition(" ")[0]
                if limit and _NUMBER.fullmatch(limit):
                    inside[axis] = choose(inside[axis], float(limit))
        moved = inside != list(places.numbers)
        where = f"{places.source}; moved into the travel" if moved else places.source
        keep = self.assume if places.assumed else self.derive if moved or places.derived else self.take
        keep("home", texts(inside, places.unit), where)

    def tools_by_hand(self, why: str) -> None:
        """Say that a person changes tools."""
        self.assume("tool_change.automatic", False, why)
        self.assume("tool_change.time", *HAND_CHANGE)

    def work(self, head: Head, source: str) -> None:
        """Keep what does the work."""
        self.derive("process", head.value, source)

    def spindle(self, highest: float, lowest: float, source: str) -> None:
        """Keep the range of the spindle, rpm."""
        if not 0 <= lowest <= highest <= FASTEST_SPINDLE or not highest > 0:
            raise self.refusal(f"the spindle turns {lowest:g} to {highest:g} rpm ({source}); correct that first")
        self.take("spindle.max_speed", f"{highest:g} rpm", source)
        if lowest > 0:
            self.take("spindle.min_speed", f"{lowest:g} rpm", source)

    def _axes(self, key: str, axes: Axes) -> None:
        keep = self.assume if axes.assumed else self.derive if axes.derived else self.take
        keep(key, texts(axes.numbers, axes.unit), axes.source)


@dataclass(frozen=True)
class Axes:
    """A value for each axis, with their unit and where they come from."""

    numbers: tuple[float, ...]
    unit: str
    source: str
    derived: bool = False
    assumed: bool = False

    def check(self, values: Values, key: str, most: float, above_0: bool = False) -> None:
        """Refuse what no machine has.

        Raises
        ------
        ReadError
            A value is too large, or not above 0 where it must be.
        """
        kind = {"rapid.velocity": "mm/s", "rapid.acceleration": "mm/s²"}.get(key, "mm")
        factor = FACTORS[kind][self.unit]
        for number, axis in zip(self.numbers, "xyz", strict=True):
            if above_0 and not number > 0:
                raise values.refusal(f"{key} of {axis} is {number:g} {self.unit}, but must be above 0 ({self.source})")
            if math.isfinite(number) and abs(number) * factor > most:
                raise values.refusal(
                    f"{key} of {axis} is {number:g} {self.unit}, more than any machine has, "
                    f"{most / factor:g} {self.unit} ({self.source}); correct that first"
                )


def number(values: Values, text: str, what: str, line: int | None = None) -> float:
    """Return a number; what stands behind it, such as a comment, does not count.

    Raises
    ------
    ReadError
        The text does not begin with one.
    """
    found = _NUMBER.match(text.strip())
    if found is None:
        raise values.refusal(f"{what} is '{shown(text.strip(), 30)}', but must be a number", line)
    value = float(found[0])
    if not math.isfinite(value):
        raise values.refusal(f"{what} is {shown(found[0], 30)}, which no machine has", line)
    return value


def with_unit(value: float, unit: str) -> str:
    """Return a number with its unit, as a profile has it; an end that is not known is so called."""
    return f"{value:.10g} {unit}" if math.isfinite(value) else "unknown"


def texts(numbers: Sequence[float], unit: str) -> Any:
    """Return a value for each axis, or one for all where they are alike."""
    written = [with_unit(one, unit) for one in numbers]
    return written[0] if len(set(written)) == 1 else written


def in_lines(lines: Iterable[int]) -> str:
    """Return ``line 3`` or ``lines 3, 5 and 7``."""
    each = sorted(set(lines))
    if len(each) == 1:
        return f"line {each[0]}"
    if len(each) > 2 and each[-1] - each[0] == len(each) - 1:
        return f"lines {each[0]} to {each[-1]}"
    return f"lines {', '.join(map(str, each[:-1]))} and {each[-1]}"
