"""What the interpreter remembers between blocks, and the readings of single words that depend on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import BlockError, UnclearBlock, Word
from leafcut.model.toolpath import UNKNOWN, DrillCycle, Kind, ToolpathBuilder
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE

AXES = ("X", "Y", "Z")


@dataclass
class CycleWords:
    """The words of a canned cycle that stay from hole to hole: as given, in mm and s.

    `incremental` is the distance mode they were given in; `unit` the millimetres in one unit then.
    `spare` holds the letters that the active cycle was given and does not use.
    """

    r: float | None = None
    z: float | None = None
    peck: float | None = None
    dwell: float | None = None
    incremental: bool = False
    unit: float | None = None
    spare: set[str] = field(default_factory=set)


@dataclass
class InterpreterState:
    """Modal state and the toolpath so far.

    `unit` is millimetres in one unit of the program, or None before G20 or G21. `feed` is in mm/s, or mm per
    revolution with G95; with G93 every cutting block brings its own. `motion` is 0 to 3 or None, `cycle` the number of
    the canned cycle or None, `call` the cycle that Siemens calls at every place (MCALL). `last_dwell` is the dwell of
    the last cycle that had one, s.
    `pending_tool` is the tool that the next change brings. `may_store` says that a cycle with no repeats is stored,
    `lenient` that a cycle may have words that it does not use.
    `rounds`: G64 is on since the program said so. `radius` is 40, 41 or 42. `shift` counts changes of the origin.
    `override` is the part of the feed that an output asks for, heard while `adaptive` (M52). `dark` and
    `holds_height` say that outputs keep a torch off, and at its height, though it is lit. `material` is the number of
    the controller's material that M190 selected, `material_feeds` the known feeds of its table by number, mm/s.
    """

    dialect: Dialect
    unit: float | None = None
    path: ToolpathBuilder = field(default_factory=ToolpathBuilder)
    line: int = 0
    incremental: bool = False
    absolute_centres: bool = False
    plane: int = 17
    feed_mode: int = 94
    feed: float = 0.0
    rpm: float = 0.0
    spindle: int = 0
    coolant: int = 0
    motion: int | None = None
    cycle: int | None = None
    cycle_words: CycleWords = field(default_factory=CycleWords)
    call: DrillCycle | None = None
    last_dwell: float = 0.0
    #: Holes of cycles that were repeated so far.
    repeated_holes: int = 0
    rounds: bool = False
    to_initial: bool = True
    pending_tool: int | None = None
    tool: int | None = None
    offset_number: int | None = None
    offset_on: bool = False
    may_store: bool = False
    lenient: bool = False
    radius: int = 40
    shift: int = 0
    override: float = 1.0
    adaptive: bool = False
    dark: bool = False
    holds_height: bool = False
    material: int | None = None
    material_feeds: Mapping[int, float] | None = None

    def __post_init__(self) -> None:
        self.path.slants = self.dialect.groups == "rs274"

    def know_unit(self, unit: float) -> None:
        """Take the units that the program states."""
        self.unit = unit

    def length(self, word: Word) -> float:
        """Return the length of a word in mm."""
        if word.value == 0.0:
            return 0.0
        if self.unit is None:
            raise BlockError(f"{word} comes before the units are stated ({self.dialect.units_mm} for mm)")
        if self.dialect.point_required and "." not in word.text:
            # The least increment of these controllers: 0.001 mm or 0.0001 inch.
            least = word.value * (0.001 if self.unit == 1.0 else 0.0001)
            raise BlockError(
                f"{word} has no decimal point: whether that is {word.letter}{word.value:.1f} or "
                f"{word.letter}{least:.10g} depends on a setting of the controller; write it with a decimal point"
            )
        return word.value * self.unit

    def target(self, letters: dict[str, Word], axis: int) -> float | None:
        """Take the word of an axis and return where it goes, mm, or None where it is not given."""
        word = letters.pop(AXES[axis], None)
        if word is None:
            return None
        value, here = self.length(word), self.path.position[axis]
        if not self.incremental:
            return value
        if math.isnan(here) and value != 0.0:
            raise UnclearBlock(f"{word} is incremental (G91), but where {AXES[axis]} is before it is not known")
        return None if math.isnan(here) else here + value

    def set_feed(self, word: Word) -> None:
        """Take an F word in the mode that is active."""
        if word.value < 0.0:
            raise BlockError(f"{word} is negative")
        if word.value == 0.0:
            self.feed = 0.0
            return
        if self.unit is None:
            raise BlockError(f"{word} comes before the units are stated ({self.dialect.units_mm} for mm)")
        self.feed = word.value * self.unit / (1.0 if self.feed_mode == 95 else SECONDS_PER_MINUTE)

    def feed_for(self, letters: dict[str, Word], length: float) -> float:
        """Return the feed, mm/s, of a cut of `length` mm.

        With G93, F is the reciprocal of the minutes that the cut takes, and every block needs its own.
        """
        if self.feed_mode == 93:
            word = letters.pop("F", None)
            if word is None or not word.value > 0.0:
                raise BlockError("a cut in inverse time (G93) needs its own F")
            if not length > 0.0:
                raise BlockError("a cut in inverse time (G93) needs a known length")
            return length * word.value / SECONDS_PER_MINUTE
        feed = self.feed
        if self.feed_mode == 95:
            if self.spindle == 0:
                raise BlockError("a feed per revolution (G95) needs a turning spindle")
            feed *= self.rpm / SECONDS_PER_MINUTE
        if not feed > 0.0:
            raise BlockError("a cut without a feed; F is missing")
        return feed * self.override if self.adaptive else feed

    def move_origin(self, unknown: tuple[bool, bool, bool], known: dict[int, float] | None = None) -> None:
        """Add a row SHIFT: the origin moved; `known` tells the new coordinates of axes, `unknown` axes have none."""
        self.shift += 1
        place = [UNKNOWN if lost else p for p, lost in zip(self.path.position, unknown, strict=True)]
        for axis, value in (known or {}).items():
            place[axis] = value
        self.path.set_place(Kind.SHIFT, (place[0], place[1], place[2]), self.shift, line=self.line)

    def dwell(self, word: Word) -> float:
        """Return the seconds that a dwell word means in this dialect."""
        if word.value < 0.0:
            raise BlockError(f"{word}: a dwell cannot be negative")
        unit, whole = self.dialect.dwell_unit, "." not in word.text
        if unit == "s" or (unit == "point" and not whole):
            return word.value
        if unit in ("ms", "cs") and not whole:
            raise UnclearBlock(f"{word}: with a decimal point, its meaning differs between machines")
        return word.value / (100.0 if unit == "cs" else 1000.0)


def whole(word: Word, most: int = 99_999_999) -> int:
    """Return the whole number of a word."""
    if not 0 <= word.value <= most or word.value != int(word.value):
        raise BlockError(f"{word} must be a whole number from 0 to {most}")
    return int(word.value)


def unit_of(code: int) -> float:
    """Return the millimetres in one unit for G20, G21, G70, G71, G700 and G710, given in tenths."""
    return MM_PER_INCH if code in (200, 700, 7000) else 1.0
