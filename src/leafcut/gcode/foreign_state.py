"""What the interpreter of foreign programs remembers beside `State`: all that a `Modal` tells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from leafcut.gcode.state import AXES, State
from leafcut.gcode.words import UnclearBlock, Word
from leafcut.model.toolpath import UNKNOWN, Kind


@dataclass
class ForeignState(State):
    """Modal state of a foreign program.

    `feed_said` and `cycle_said` are F and the words of the cycle as they were written. `register` is the length offset.
    `foreign_motion` is the motion or cycle that is active but not understood,
    `transform` a G code in tenths that turns, scales or mirrors all that follows, `surface` says that G96 is active.
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

    def __post_init__(self) -> None:
        fanuc = self.dialect.groups == "fanuc"
        self.may_store = fanuc
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

    def feed_for(self, letters: dict[str, Word], length: float) -> float:
        """Return the feed of a cut, mm/s; with G96 the revolutions are not known."""
        if self.surface and self.feed_mode == 95:
            raise UnclearBlock("a feed per revolution (G95) with constant surface speed (G96)")
        return super().feed_for(letters, length)

    def choose_frame(self, number: int) -> None:
        """Take a work offset, in tenths; where the tool is in it is not known."""
        if number != self.frame:
            self.frame = number
            self.path.set_place(Kind.FRAME, (UNKNOWN, UNKNOWN, UNKNOWN), number, line=self.line)

    def set_register(self, number: int) -> None:
        """Take a tool length offset; another one than before moves the origin of Z by what the program does not say."""
        self.path.offset(number, line=self.line)
        self.offset_on = number != 0
        if number != self.register:
            self.register = number
            self.path.position[2] = UNKNOWN
            self.path.initial_plane = None

    def known_value(self, name: str) -> float | None:
        """Return the value of a parameter that follows from the program's own state, or None."""
        lengths = {"_x": 0, "_y": 1, "_z": 2, "5420": 0, "5421": 1, "5422": 2}
        if name in lengths:
            place = self.path.position[lengths[name]]
            return None if math.isnan(place) or self.unit is None else place / self.unit
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
