"""What the interpreter of foreign programs remembers beside `InterpreterState`: all that a `Modal` tells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from leafcut.gcode.state import AXES, CycleWords, InterpreterState
from leafcut.gcode.words import BlockError, UnclearBlock, Word
from leafcut.model.toolpath import UNKNOWN, Kind
from leafcut.units import SECONDS_PER_MINUTE

#: Instead of the register of a tool length that is in none; registers go up to 99,999.
DYNAMIC_LENGTH = 100_000

#: After these the length offset that is active may be another one: the tool, or the table of the controller. A move in
#: machine coordinates (G28, G53) takes the offset off in a Fanuc or a Haas.
_MAY_CHANGE_LENGTH = frozenset({Kind.TOOL, Kind.PAUSE, Kind.SHIFT, Kind.MACHINE, Kind.FOREIGN})


@dataclass
class ForeignState(InterpreterState):
    """Modal state of a foreign program.

    `unsure` names what is active and not known, since something was run that cannot be seen: the plane, the distance
    mode, the height to which cycles rise ("retract"), the feed, the speed. `default_unit` holds where the program needs
    its units and has not stated them: `assumed` says that it did.

    `feed_said` and `cycle_said` are F and the words of the cycle as they were written. `register` is the length offset.
    `foreign_motion` is the motion or cycle that is active but not understood,
    `transform` a G code in tenths that turns, scales or mirrors all that follows, `surface` says that G96 is active.
    `rotary` is the line and the letter of the first move of a rotary axis.
    `feed_forgotten`: G94 or G95 came after the last F, for which LinuxCNC forgets it.
    """

    feed_said: float = 0.0
    cycle_said: dict[str, float] = field(default_factory=dict)
    register: int = 0
    frame: int = 540
    blending: int | None = None
    tolerance: float = 0.0
    joining: float = 0.0
    foreign_motion: str = ""
    transform: int = 0
    surface: bool = False
    feed_forgotten: bool = False
    rotary: tuple[int, str] | None = None
    unsure: set[str] = field(default_factory=set)
    default_unit: float | None = None
    assumed: bool = False
    _bare_feed: float | None = None
    #: The first row that was not looked at since a length offset was taken; -1 before the first.
    length_row: int = -1

    def __post_init__(self) -> None:
        super().__post_init__()
        fanuc = self.dialect.groups == "fanuc"
        self.may_store, self.lenient = fanuc, True
        if fanuc:
            self.foreign_motion = "what is active when the control is switched on"
        # What is active before the program says it: G98 at Fanuc, G99 in RS274/NGC (seen with rs274).
        self.to_initial = fanuc

    def modal_values(self) -> tuple[object, ...]:
        """Return the fields of `Modal`, in order."""
        return (
            None if self.cycle is not None else self.motion,
            self.cycle,
            tuple(self.cycle_said.items()) if self.cycle_said else (),
            self.unit,
            self.plane,
            self.incremental,
            self.absolute_centres,
            self.to_initial,
            self.feed_mode,
            self.feed_said,
            self.rpm,
            self.spindle,
            self.coolant,
            self.tool,
            self.pending_tool,
            self.register,
            self.radius,
            self.frame,
            self.shift,
            640 if self.blending is None else self.blending,
            self.tolerance,
            self.joining,
        )

    def forget(self, who: str) -> None:
        """Know nothing any more of where the tool is and what is active, after `who` did what cannot be seen.

        The units and the feed mode are taken to be as they were: other numbers would make no sense in the text that
        follows, and in what order that is run does not depend on them.
        """
        self.path.position = [UNKNOWN, UNKNOWN, UNKNOWN]
        self.path.initial_plane = None
        self.cycle, self.cycle_words = None, CycleWords()
        self.cycle_said.clear()
        self.motion, self.foreign_motion = None, f"what {who} left active"
        self.unsure = {"plane", "distance", "retract", "feed", "speed"}
        self.feed = self.feed_said = 0.0
        self.tool = self.pending_tool = self.offset_number = None
        self.radius = 0
        self.register = -self.line
        self.shift += 1

    def know_unit(self, unit: float) -> None:
        """Take the units that the program states."""
        self.unit = unit
        if self._bare_feed is not None:
            feed, self._bare_feed = self._bare_feed, None
            self.feed = feed * unit / (1.0 if self.feed_mode == 95 else SECONDS_PER_MINUTE)

    def length(self, word: Word) -> float:
        """Return the length of a word in mm, in the default units where the program has stated none."""
        if self.unit is None and word.value != 0.0 and self.default_unit is not None:
            self.know_unit(self.default_unit)
            self.assumed = True
        return super().length(word)

    def set_feed(self, word: Word) -> None:
        """Take an F word; before the units are stated, it waits for them."""
        self.unsure.discard("feed")
        if self.unit is None and self.default_unit is not None and word.value > 0.0:
            self._bare_feed = word.value
            return
        self._bare_feed = None
        super().set_feed(word)

    def note_axis(self, letter: str) -> None:
        """Note the first move of a rotary axis."""
        if letter in "ABC" and self.rotary is None:
            self.rotary = self.line, letter

    def feed_for(self, letters: dict[str, Word], length: float) -> float:
        """Return the feed of a cut, mm/s; with G96 the revolutions are not known."""
        if self._bare_feed is not None and self.default_unit is not None:
            self.know_unit(self.default_unit)
            self.assumed = True
        if "feed" in self.unsure and self.feed_mode != 93:
            raise UnclearBlock("its feed is not known")
        if "speed" in self.unsure and self.feed_mode == 95:
            raise UnclearBlock("its feed per revolution is that of a speed that is not known")
        if self.surface and self.feed_mode == 95:
            raise UnclearBlock("a feed per revolution (G95) with constant surface speed (G96)")
        if self.feed_mode == 93 and self.rotary is not None and not length > 0.0:
            line, axis = self.rotary
            raise BlockError(
                f"a cut in inverse time (G93) needs a known length, but line {line} moves the rotary axis {axis}: "
                "programs with four or five axes are not read"
            )
        return super().feed_for(letters, length)

    def choose_frame(self, number: int) -> None:
        """Take a work offset, in tenths; where the tool is in it is not known."""
        if number != self.frame:
            self.frame = number
            self.path.set_place(Kind.FRAME, (UNKNOWN, UNKNOWN, UNKNOWN), number, line=self.line)

    def take_dynamic_length(self) -> None:
        """Take a tool length that is in no register (G43.1, G43.2), until another one is taken, or G49."""
        self.register = DYNAMIC_LENGTH
        self.path.offset(DYNAMIC_LENGTH, line=self.line)

    def set_register(self, number: int) -> None:
        """Take a tool length offset; another one than before moves the origin of Z by what the program does not say.

        The active one, taken again, changes nothing, unless the tool or the table may have changed since.
        """
        self.offset_on = number != 0
        since, self.length_row = self.length_row, len(self.path)
        if number == self.register and since >= 0 and not _MAY_CHANGE_LENGTH.intersection(self.path.kinds_from(since)):
            return
        self.path.offset(number, line=self.line)
        if number != self.register:
            self.register = number
            self.path.position[2] = UNKNOWN
            self.path.initial_plane = None

    def known_value(self, name: str) -> float | None:
        """Return the value of a parameter that follows from the program's own state, or None."""
        if name.isdecimal() and self.dialect.groups != "rs274":
            return None
        lengths = {"_x": 0, "_y": 1, "_z": 2, "5420": 0, "5421": 1, "5422": 2}
        if name in lengths:
            place = self.path.position[lengths[name]]
            return None if math.isnan(place) or self.unit is None else place / self.unit
        if self.unsure and name.startswith("_"):
            return float(self.line) if name == "_line" else None
        if self.unit is not None and name in ("_metric", "_imperial"):
            return float((self.unit == 1.0) == (name == "_metric"))
        flags = {"_absolute": not self.incremental, "_incremental": self.incremental}
        if name in flags:
            return float(flags[name])
        numbers = {"_feed": self.feed_said, "_rpm": self.rpm, "_current_tool": self.tool}
        if name in numbers:
            number = numbers[name]
            return None if not number else float(number)
        return float(self.line) if name == "_line" else None


def named_axes(letters: dict[str, Word]) -> tuple[bool, bool, bool]:
    """Return which of X, Y and Z a block names."""
    return (AXES[0] in letters, AXES[1] in letters, AXES[2] in letters)
