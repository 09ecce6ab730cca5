"""State of the interpreter between two blocks. It also interprets single words in this state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from operator import attrgetter
from typing import Any, Protocol

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.program import Modal
from leafcut.gcode.words import BlockError, UnclearBlock, Word
from leafcut.message import Message
from leafcut.model.toolpath import UNKNOWN, DrillCycle, Kind, ToolpathBuilder
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE

AXES = ("X", "Y", "Z")
#: The values of the fields of `Modal`, in order.
ModalValues = tuple[Any, ...]
#: Pseudo-register for a tool length that is not in a register (G43.1, G43.2). Real registers go up to 99,999.
DYNAMIC_LENGTH = 100_000
#: After these rows, an active length offset may have another value, because the tool or the controller's table may have
#: changed. On Fanuc and Haas, moves in machine coordinates (G28, G53) cancel the offset.
_MAY_CHANGE_LENGTH = frozenset({Kind.TOOL, Kind.PAUSE, Kind.SHIFT, Kind.MACHINE, Kind.FOREIGN})
_modal_values = attrgetter(*(f.name for f in fields(Modal)))


@dataclass
class CycleValues:
    """Modal words of a canned cycle, in mm and s.

    `incremental` and `unit` (mm) are the modes that were active when the words were stated. `spare` contains letters
    that were stated but are not used by the cycle.
    """

    r: float | None = None
    z: float | None = None
    peck: float | None = None
    dwell: float | None = None
    incremental: bool = False
    unit: float | None = None
    spare: set[str] = field(default_factory=set)


class StatePolicy(Protocol):
    """The part of `policy.Policy` that the state and the interpretation of single words need."""

    def handle_unknown(self, message: str) -> None:
        """Handle a part of a block that is not understood."""

    def set_initial_state(self, state: InterpreterState) -> None:
        """Set the state of the interpreter at the start of a program."""

    def forget_height(self, state: InterpreterState) -> None:
        """Handle a change of the length offset."""

    def cancels_shift(self, state: InterpreterState) -> bool:
        """Return whether G92.1 to G92.3 may move the origin."""


@dataclass
class InterpreterState(Modal):
    """Complete state of the interpreter: the modal state, the toolpath up to now, and hidden state.

    Attributes
    ----------
    policy
        The rules that differ between leafcut's own programs and programs from other CAM systems.
    motion
        As in `Modal`, but kept while a cycle is active.
    call
        The cycle that a Siemens control runs at every position (MCALL).
    last_dwell
        Dwell of the last cycle that had a dwell, s.
    offset_number, offset_on
        The number of the last D word if D selects the length offset, and whether a length offset is active.
    unknown_lengths
        Number of blocks that made the length offset unknown.
    length_row
        First row after the last G43; -1 before the first G43.
    override, adaptive
        Factor of the feed that an analog output sets, and whether it is active (M52).
    dark, holds_height
        Whether outputs keep the arc off although the torch is on, and whether they hold the torch height.
    material, material_feeds
        Material selected by M190, and known feeds of the controller's material table by number, mm/s.
    default_unit, assumed_units
        Length of the unit that is assumed until the program states its units, mm, and whether it was needed.
    unknown_modes
        Modes that a block may have changed although it was not understood: plane, distance, retract, feed, speed.
    unknown_motion
        The active motion or cycle if it is unsupported, otherwise ``""``.
    transforms
        G codes, in tenths, of the active rotations, scalings and mirrorings.
    surface
        Whether G96 (constant surface speed) is active.
    rotary
        Line and letter of the first move of a rotary axis.
    feed_forgotten
        Whether G94 or G95 came after the last F word, so that LinuxCNC has forgotten the feed.
    """

    dialect: Dialect = field(kw_only=True)
    policy: StatePolicy = field(kw_only=True)
    path: ToolpathBuilder = field(default_factory=ToolpathBuilder)
    line: int = 0
    cycle_values: CycleValues = field(default_factory=CycleValues)
    call: DrillCycle | None = None
    last_dwell: float = 0.0
    #: Number of holes drilled by repeated cycles up to now.
    repeated_holes: int = 0
    offset_number: int | None = None
    offset_on: bool = False
    unknown_lengths: int = 0
    length_row: int = -1
    override: float = 1.0
    adaptive: bool = False
    dark: bool = False
    holds_height: bool = False
    material: int | None = None
    material_feeds: Mapping[int, float] | None = None
    default_unit: float | None = None
    assumed_units: bool = False
    unknown_modes: set[str] = field(default_factory=set)
    unknown_motion: str = ""
    transforms: frozenset[int] = frozenset()
    surface: bool = False
    rotary: tuple[int, str] | None = None
    feed_forgotten: bool = False

    def __post_init__(self) -> None:
        self.path.slants = self.dialect.groups == "rs274"
        self.policy.set_initial_state(self)

    @property
    def stores_cycles(self) -> bool:
        """Whether a cycle with zero repeats is stored. If so, G82 and peck cycles may omit their words."""
        return self.dialect.groups == "fanuc"

    @property
    def takes_plain_lines(self) -> bool:
        """Whether plain lines need no checks because all modes are known and ordinary.

        A plain line only contains G0 to G3, coordinates, F and S.
        """
        return (
            self.unit is not None
            and self.motion is not None
            and self.cycle is None
            and not self.incremental
            and self.feed_mode == 94
            and not self.unknown_motion
            and not self.unknown_modes
            and not self.feed_forgotten
            and not self.transforms
            and self.override == 1.0
        )

    def modal_values(self) -> ModalValues:
        """Return the values of the fields of `Modal`, in order."""
        values: ModalValues = _modal_values(self)
        return values if self.cycle is None else (None, *values[1:])

    def forget_position_and_modes(self, cause: str) -> None:
        """Mark the position and the modes as unknown after `cause`.

        Units and feed mode are kept, because the following numbers would be meaningless without them.
        """
        self.path.position = [UNKNOWN, UNKNOWN, UNKNOWN]
        self.path.initial_plane = None
        self.cycle, self.cycle_values, self.cycle_words = None, CycleValues(), ()
        self.motion, self.unknown_motion = None, Message("the motion mode that {} left active", cause)
        self.unknown_modes = {"plane", "distance", "retract", "feed", "speed"}
        self.feed = 0.0
        self.tool = self.next_tool = self.offset_number = None
        self.radius = -abs(self.radius)
        self.forget_length()
        self.shift += 1

    def forget_length(self) -> None:
        """Mark the length offset as unknown."""
        self.unknown_lengths += 1
        self.length = -self.unknown_lengths

    @property
    def feed_rate(self) -> float:
        """The active feed, mm/s, or mm per revolution with G95. It is 0 before the units are known."""
        return self.feed * (self.unit or 0.0) / (1.0 if self.feed_mode == 95 else SECONDS_PER_MINUTE)

    def _assume_unit(self) -> None:
        if self.unit is None and self.default_unit is not None:
            self.unit = self.default_unit
            self.assumed_units = True

    def mm(self, word: Word) -> float:
        """Return the length in a word, mm."""
        if word.value == 0.0:
            return 0.0
        self._assume_unit()
        if self.unit is None:
            raise BlockError("{} comes before the units are stated ({} for mm)", word, self.dialect.units_mm)
        if self.dialect.point_required and "." not in word.text:
            # The least increment of these controllers: 0.001 mm or 0.0001 inch.
            least = word.value * (0.001 if self.unit == 1.0 else 0.0001)
            raise BlockError(
                "{} has no decimal point, so a setting of the controller decides whether it means {}{:.1f} or "
                "{}{:.10g}; write it with a decimal point",
                word,
                word.letter,
                word.value,
                word.letter,
                least,
            )
        return word.value * self.unit

    def take_target(self, letters: dict[str, Word], axis: int) -> float | None:
        """Remove the word of an axis from `letters`.

        Return the target coordinate, mm, or None if the block has no such word.
        """
        word = letters.pop(AXES[axis], None)
        if word is None:
            return None
        value, here = self.mm(word), self.path.position[axis]
        if not self.incremental:
            return value
        if math.isnan(here) and value != 0.0:
            raise UnclearBlock("{} is incremental (G91), but the position of {} before it is unknown", word, AXES[axis])
        return None if math.isnan(here) else here + value

    def set_feed(self, word: Word) -> None:
        """Apply an F word, in units per minute or per revolution. F may come before the program states its units."""
        self.unknown_modes.discard("feed")
        if word.value < 0.0:
            raise BlockError("{} is negative", word)
        if word.value > 0.0 and self.unit is None and self.default_unit is None:
            raise BlockError("{} comes before the units are stated ({} for mm)", word, self.dialect.units_mm)
        self.feed = word.value

    def feed_for(self, letters: dict[str, Word], length: float) -> float:
        """Return the feed of a cut with the given length (mm), mm/s.

        With G93, F is the reciprocal of the duration of the cut in minutes.
        """
        if self.feed_mode == 93:
            return self._feed_from_inverse_time(letters, length)
        if self.feed:
            self._assume_unit()
        if "feed" in self.unknown_modes:
            raise UnclearBlock("the feed is unknown")
        feed = self.feed_rate
        if self.feed_mode == 95:
            if "speed" in self.unknown_modes:
                raise UnclearBlock("a feed per revolution needs a spindle speed, which is unknown here")
            if self.surface:
                raise UnclearBlock("a feed per revolution (G95) with constant surface speed (G96)")
            if self.spindle == 0:
                raise BlockError("a feed per revolution (G95) needs a running spindle")
            feed *= self.rpm / SECONDS_PER_MINUTE
        if not feed > 0.0:
            raise BlockError("the cut has no feed; F is missing")
        return feed * self.override if self.adaptive else feed

    def _feed_from_inverse_time(self, letters: dict[str, Word], length: float) -> float:
        if self.rotary is not None and not length > 0.0:
            line, axis = self.rotary
            raise BlockError(
                "a cut in inverse time (G93) needs a known length, but line {} moves the rotary axis {}, and "
                "leafcut does not read programs with four or five axes",
                line,
                axis,
            )
        word = letters.pop("F", None)
        if word is None or not word.value > 0.0:
            raise BlockError("a cut in inverse time (G93) needs its own F")
        if not length > 0.0:
            raise BlockError("a cut in inverse time (G93) needs a known length")
        return length * word.value / SECONDS_PER_MINUTE

    def move_origin(self, unknown: tuple[bool, bool, bool], known: dict[int, float] | None = None) -> None:
        """Add a SHIFT row for a move of the origin.

        `known` contains the new coordinates by axis. `unknown` marks the axes with unknown coordinates.
        """
        self.shift += 1
        place = [UNKNOWN if lost else p for p, lost in zip(self.path.position, unknown, strict=True)]
        for axis, value in (known or {}).items():
            place[axis] = value
        self.path.set_place(Kind.SHIFT, (place[0], place[1], place[2]), self.shift, line=self.line)

    def select_work_offset(self, number: int) -> None:
        """Select a work offset (591 for G59.1).

        If it differs from the active work offset, the position becomes unknown.
        """
        if number != self.frame:
            self.frame = number
            self.path.set_place(Kind.FRAME, (UNKNOWN, UNKNOWN, UNKNOWN), number, line=self.line)

    def set_dynamic_length(self) -> None:
        """Set a tool length offset that is not in a register (G43.1, G43.2).

        It stays active until the next G43 or G49.
        """
        self.length = DYNAMIC_LENGTH
        self.path.offset(DYNAMIC_LENGTH, line=self.line)

    def select_length_offset(self, register: int) -> None:
        """Select the tool length offset of a register. Register 0 cancels the offset.

        The origin in Z moves if the register differs from the last register, or if the tool or the tool table has
        changed since.
        """
        self.offset_on = register != 0
        since, self.length_row = self.length_row, len(self.path)
        if register == self.length and since >= 0 and not _MAY_CHANGE_LENGTH.intersection(self.path.kinds_from(since)):
            return
        self.path.offset(register, line=self.line)
        if register != self.length:
            self.policy.forget_height(self)
        self.length = register

    def dwell_seconds(self, word: Word) -> float:
        """Return the duration of a dwell word in this dialect, s."""
        if word.value < 0.0:
            raise BlockError("{}: a dwell cannot be negative", word)
        unit, whole = self.dialect.dwell_unit, "." not in word.text
        if unit == "s" or (unit == "point" and not whole):
            return word.value
        if unit in ("ms", "cs") and not whole:
            raise UnclearBlock("{}: with a decimal point, its meaning differs between machines", word)
        return word.value / (100.0 if unit == "cs" else 1000.0)

    def known_value(self, name: str) -> float | None:
        """Return the value of a system parameter, or None if the program does not determine it."""
        if name.isdecimal() and self.dialect.groups != "rs274":
            return None
        lengths = {"_x": 0, "_y": 1, "_z": 2, "5420": 0, "5421": 1, "5422": 2}
        if name in lengths:
            place = self.path.position[lengths[name]]
            return None if math.isnan(place) or self.unit is None else place / self.unit
        if self.unknown_modes and name.startswith("_"):
            return float(self.line) if name == "_line" else None
        if self.unit is not None and name in ("_metric", "_imperial"):
            return float((self.unit == 1.0) == (name == "_metric"))
        flags = {"_absolute": not self.incremental, "_incremental": self.incremental}
        if name in flags:
            return float(flags[name])
        numbers = {"_feed": self.feed, "_rpm": self.rpm, "_current_tool": self.tool}
        if name in numbers:
            number = numbers[name]
            return None if not number else float(number)
        return float(self.line) if name == "_line" else None


def axes_in_block(letters: dict[str, Word]) -> tuple[bool, bool, bool]:
    """Return for each of the axes X, Y and Z whether a block states it."""
    return (AXES[0] in letters, AXES[1] in letters, AXES[2] in letters)


def parse_whole_number(word: Word, most: int = 99_999_999) -> int:
    """Return the whole number in a word."""
    if not 0 <= word.value <= most or word.value != int(word.value):
        raise BlockError("{} must be a whole number from 0 to {}", word, most)
    return int(word.value)


def unit_for_code(code: int) -> float:
    """Return the length of the unit that G20, G21, G70, G71, G700 or G710 selects, mm. `code` is in tenths."""
    return MM_PER_INCH if code in (200, 700, 7000) else 1.0
