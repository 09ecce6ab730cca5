"""Programs in Heidenhain Klartext: drilling, by cycle 200 and straight moves."""

from __future__ import annotations

import math
from collections.abc import Sequence

from leafcut.errors import PostError
from leafcut.files.digests import signed
from leafcut.gcode.klartext import CYCLE_200
from leafcut.gcode.numbers import format_number
from leafcut.model.toolpath import DrillCycle, Kind, Motion
from leafcut.post.comments import comment_lines
from leafcut.post.row_writer import Writer
from leafcut.post.words import coolant_words, has_cycle, said_with

_NAME = "LEAFCUT"
_WIDTH = 70


class KlartextWriter(Writer):
    """Writes row after row; every block has a number, and a ~ at its end continues it on the next line."""

    _blocks: list[str]
    _speeds: dict[int, float]

    def program(self, header: Sequence[str]) -> str:
        """Return the whole text."""
        self._blocks = [f"BEGIN PGM {_NAME} MM"]
        low, high = self.path.extents
        # A blank must have a size, even if all holes are at one place.
        for corner, values, margin in (("0.1 Z", low, -1.0), ("0.2", high, 1.0)):
            words = [f"{axis}{self._length(v + margin)}" for axis, v in zip("XYZ", values, strict=True)]
            self._blocks.append(" ".join([f"BLK FORM {corner}", *words]))
        for line in (*header, *(self.dialect.notes if header else ())):
            self._blocks += comment_lines(line, _WIDTH, style=";")
        self._speeds = self._speeds_of_tools()
        self._speed_now = 0.0
        write = {
            Kind.RAPID: self._rapid,
            Kind.FEED: self._feed,
            Kind.DRILL: self._drill,
            Kind.DWELL: self._dwell,
            Kind.TOOL: self._tool,
            Kind.OFFSET: lambda row: None,
            Kind.SPINDLE: self._spindle,
            Kind.COOLANT: self._coolant,
            Kind.PAUSE: self._pause,
            Kind.END: self._end,
        }
        for number, row in enumerate(self.path):
            if self.ended:
                raise PostError("the toolpath goes on after its end")
            if row.kind is not Kind.DRILL:
                self._leave_cycle()
            if row.kind not in write:
                names = {Kind.ARC_CW: "arcs", Kind.ARC_CCW: "arcs", Kind.MACHINE: "moves to machine zero"}
                raise PostError(
                    f"{self.dialect.name}: leafcut writes drilling only in this language, and no "
                    f"{names.get(row.kind, row.kind.name.lower())}"
                )
            self._row = number
            write[row.kind](row)
        if not self.ended:
            raise PostError("the toolpath has no end (Kind.END)")
        self._blocks.append(f"END PGM {_NAME} MM")
        return signed("".join(f"{number} {block}\n" for number, block in enumerate(self._blocks)))

    def _speeds_of_tools(self) -> dict[int, float]:
        """Return the speed for each TOOL row: that of the next spindle start."""
        speeds: dict[int, float] = {}
        tool = -1
        for number, row in enumerate(self.path):
            if row.kind is Kind.TOOL:
                tool = number
            elif row.kind is Kind.SPINDLE and row.value and tool >= 0:
                speeds.setdefault(tool, abs(row.value))
        return speeds

    def _say(self, *words: str) -> None:
        self._blocks.append(" ".join(word for word in words if word))

    def _length(self, mm: float) -> str:
        text = self.numbers.length(mm)
        return text if text.startswith("-") else f"+{text}"

    # -- moves -------------------------------------------------------------------------------------------------------

    def _axis(self, row: Motion, axis: int) -> str:
        value = row.end[axis]
        return "" if math.isnan(value) else self.out.modal("XYZ"[axis], "XYZ"[axis] + self._length(value))

    def _rapid(self, row: Motion) -> None:
        sideways = self._changes(row.end[0], 0) or self._changes(row.end[1], 1)
        if not self.safe and (sideways or math.isnan(row.end[2])):
            raise PostError("at the start, and after a change of tool, the first move must be in Z alone")
        self._say("L", *self._axes(row, only_z=not self.safe), "R0", "FMAX")
        self._arrive(row)

    def _feed(self, row: Motion) -> None:
        self._check_cutting(row)
        self._say("L", *self._axes(row), "R0", "F" + self.numbers.feed(row.value))
        self._arrive(row)

    def _drill(self, row: Motion) -> None:
        cycle = self.path.cycles[row.ref]
        self._check_cutting(row)
        if any(math.isnan(v) for v in (*row.end, self.position[2])):
            raise PostError("a hole while the place of the tool is not known")
        rounded = self.numbers.said
        is_same_cycle = (
            self.cycle is not None
            and said_with(self.cycle) == said_with(cycle)
            and self.cycle.to_initial == cycle.to_initial
            and self._feed_of_cycle == row.value
        )
        if not is_same_cycle:
            self._leave_cycle()
        low = rounded(self.position[2]) < rounded(cycle.r_plane)
        if not has_cycle(cycle, self.dialect) or low or not self._can_return(cycle, row.end[2]):
            self._expand(row, cycle)
            return
        if self.cycle is None:
            self._define(cycle, row)
            self.out.forget("XY")
        position = [self._axis(row, 0), self._axis(row, 1)]
        if not any(position):
            self.out.forget("XY")
            position = [self._axis(row, 0), self._axis(row, 1)]
        self._say("L", *position, "R0", "FMAX", "M99")
        self.cycle, self._feed_of_cycle = cycle, row.value
        self._arrive(row)
        self._axis(row, 2)

    _feed_of_cycle = 0.0

    def _define(self, cycle: DrillCycle, row: Motion) -> None:
        rounded = self.numbers.said
        r_plane, bottom, after = rounded(cycle.r_plane), rounded(cycle.bottom), rounded(row.end[2])
        surface = 0.0 if bottom < 0.0 < r_plane else rounded((r_plane + bottom) / 2)
        values = {
            "Q200": self._length(r_plane - surface),
            "Q201": self._length(bottom - surface),
            "Q206": self.numbers.feed(row.value),
            "Q202": self._length(surface - bottom),
            "Q210": "+0",
            "Q203": self._length(surface),
            "Q204": self._length(after - surface),
            "Q211": "+" + format_number(cycle.dwell if cycle.name == "G82" else 0.0, 3),
        }
        parameters = [f"  {name}={values[name]} ;{title}" for name, title in CYCLE_200.items()]
        self._blocks.append(" ~\n".join(["CYCL DEF 200 DRILLING", *parameters]))

    def _leave_cycle(self) -> None:
        self.cycle = None

    # -- commands ----------------------------------------------------------------------------------------------------

    def _dwell(self, row: Motion) -> None:
        self._say("CYCL DEF 9.0 DWELL TIME")
        self._say(f"CYCL DEF 9.1 DWELL {format_number(row.value, 3)}")

    def _tool(self, row: Motion) -> None:
        if self.spinning:
            raise PostError("a tool is called while the spindle turns; stop it before")
        name = self.tool_names.get(row.ref, "")
        self._blocks += comment_lines(f"T{row.ref} {name}".strip(), _WIDTH, style=";")
        self._speed_now = self._speeds.get(self._row, 0.0)
        speed = f"S{format_number(self._speed_now, 0)}" if self._speed_now else ""
        self._say(f"TOOL CALL {row.ref} Z", speed)
        self.safe = self.at_machine_height
        self.out.forget("XYZ")

    def _spindle(self, row: Motion) -> None:
        self.spinning = row.value != 0.0
        if not self.spinning:
            self._say("M5")
            return
        if abs(row.value) != self._speed_now:
            raise PostError(f"{self.dialect.name}: one tool has one speed here; it is in its TOOL CALL")
        self._say("M3" if row.value > 0 else "M4")

    def _coolant(self, row: Motion) -> None:
        for word in coolant_words(row.ref, self.coolant_mode, self.dialect):
            self._say(word)
        self.coolant_mode = row.ref

    def _pause(self, row: Motion) -> None:
        self._say("M1" if row.ref else "M0")

    def _end(self, row: Motion) -> None:
        self._say("M30")
        self.ended = True
