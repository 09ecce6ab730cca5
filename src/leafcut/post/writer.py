"""Conversion of a `Toolpath` to a program in the dialect of a controller.

    write_program(toolpath, dialect("haas"), PostOptions(), header=["plate.dxf"])

The writer outputs the rows of the toolpath one after another and adds no motion. While the height of the tool is
unknown, it refuses moves in X or Y. The height is unknown before the first move in Z and after every tool change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.klartext import CYCLE_200
from leafcut.message import Message
from leafcut.model.cycles import PECKING
from leafcut.model.toolpath import DrillCycle, Kind, Motion, Toolpath
from leafcut.options import PostOptions
from leafcut.post.row_writer import NO_NAMES, Blocks, Writer
from leafcut.post.words import comment_lines, format_number, format_peck

#: Name of a program in Klartext, and maximum width of its comments, characters.
_NAME, _WIDTH = "LEAFCUT", 70


def write_program(
    toolpath: Toolpath,
    dialect: Dialect,
    options: PostOptions,
    header: Sequence[str] = (),
    *,
    tool_names: Mapping[int, str] = NO_NAMES,
    rapid_velocity: float = math.nan,
    preselect_tool: bool = False,
) -> str:
    """Return the text of the program.

    Parameters
    ----------
    toolpath
        Motion in mm, mm/s, s and rpm. Its last row is `Kind.END`. Numbers are rounded to the decimals of the dialect,
        so a position that is read back differs by at most half of the last decimal. `Kind.OFFSET` rows are not needed,
        because every tool activates its length offset with its first move in Z.
    options
        Units, line numbers, program number and header. The dialect in the options is ignored.
    header
        Comment lines at the top. The first line names the program. If `options.header` is off, the lines are not
        written.
    tool_names
        Tool number → name for comments.
    rapid_velocity
        Speed of rapids, mm/s, for a dialect whose G0 states it (`Dialect.rapid_feed`); NaN to leave it out.
    preselect_tool
        Whether to name the next tool after each tool change.

    Raises
    ------
    PostError
        The toolpath needs a word that the controller lacks, or moves before its height is known.
    """
    check_post_options(dialect, options)
    writer = _writer_class(dialect.language)(toolpath, dialect, options, tool_names, rapid_velocity, preselect_tool)
    return writer.program_text(header if options.header else ())


def _writer_class(language: str) -> type[Writer]:
    """Return the writer of a language. Dialects without their own language use the writer of G-code."""
    if language == "klartext":
        return KlartextWriter
    if language == "sinumerik":
        return SinumerikWriter
    return Writer


def check_post_options(dialect: Dialect, options: PostOptions) -> None:
    """Check that the controller supports the requested units and line numbers.

    Raises
    ------
    PostError
        The controller does not support inches or line numbers.
    """
    if options.output_units == "inch" and not dialect.units_inch:
        raise PostError("--output-units inch: {} programs are in millimetres; leave it out", dialect.name)
    if options.line_numbers and not dialect.line_numbers:
        raise PostError("--line-numbers: {} does not support block numbers; leave it out", dialect.name)


class KlartextWriter(Writer):
    """Writes drilling programs in Klartext. Every block has a number, and a ~ continues a block on the next line."""

    #: A cycle ends with any move except a move to a hole, so no word is needed.
    end_of_cycle = ""
    calls_cycles = True

    _speed_now = 0.0

    def _write_header(self, header: Sequence[str]) -> None:
        # All blocks are numbered at the end.
        self.out = Blocks(self.dialect, numbered=False)
        lines = self.out.lines
        lines.append(f"BEGIN PGM {_NAME} MM")
        low, high = self.path.extents
        # A blank must have a size, even if all holes are at one position.
        for corner, values, margin in (("0.1 Z", low, -1.0), ("0.2", high, 1.0)):
            words = [f"{axis}{self._format_length(v + margin)}" for axis, v in zip("XYZ", values, strict=True)]
            lines.append(" ".join([f"BLK FORM {corner}", *words]))
        for line in (*header, *(self.dialect.notes if header else ())):
            lines += comment_lines(line, _WIDTH, style=";")
        self._speeds = self._speeds_of_tools()

    def _join_lines(self) -> str:
        blocks = [*self.out.lines, f"END PGM {_NAME} MM"]
        return "".join(f"{number} {block}\n" for number, block in enumerate(blocks))

    def _unsupported_message(self, kind: Kind) -> Message:
        names = {Kind.ARC_CW: "arcs", Kind.ARC_CCW: "arcs", Kind.MACHINE: "moves to machine zero"}
        return Message(
            "{}: leafcut writes only drilling programs in this language, not {}",
            self.dialect.name,
            names.get(kind, kind.name.lower()),
        )

    def _row_writers(self) -> dict[Kind, Callable[[Motion], None]]:
        lacks = (Kind.ARC_CW, Kind.ARC_CCW, Kind.MACHINE, Kind.FRAME, Kind.BLENDING)
        known = {kind: write for kind, write in super()._row_writers().items() if kind not in lacks}
        return {**known, Kind.OFFSET: lambda row: None}

    def _speeds_of_tools(self) -> dict[int, float]:
        """Map each TOOL row to the speed of the next spindle start, rpm."""
        speeds: dict[int, float] = {}
        tool = -1
        for number, row in enumerate(self.path):
            if row.kind is Kind.TOOL:
                tool = number
            elif row.kind is Kind.SPINDLE and row.value:
                speeds.setdefault(tool, abs(row.value))
        return speeds

    def _format_length(self, mm: float) -> str:
        text = self.numbers.format_length(mm)
        return text if text.startswith("-") else f"+{text}"

    # -- moves -------------------------------------------------------------------------------------------------------

    def _write_rapid(self, row: Motion) -> None:
        sideways = self._is_changed(row.end[0], 0) or self._is_changed(row.end[1], 1)
        if not self.safe and (sideways or math.isnan(row.end[2])):
            raise PostError("at the start, and after a change of tool, the first move must be in Z only")
        self.out.write("L", *self._axis_words(row, only_z=not self.safe), "R0", "FMAX")
        self._track_position(row)

    def _write_feed_move(self, row: Motion) -> None:
        self._check_position_known(row)
        self.out.write("L", *self._axis_words(row), "R0", "F" + self.numbers.format_feed(row.value))
        self._track_position(row)

    def _write_hole(self, row: Motion, cycle: DrillCycle) -> None:
        if self.cycle is None:
            self._write_cycle_definition(cycle, row)
            self.out.forget_modal_words("XY")
        self.out.write("L", *self._position_words(row), "R0", "FMAX", "M99")

    def _write_cycle_definition(self, cycle: DrillCycle, row: Motion) -> None:
        rounded = self.numbers.rounded
        r_plane, bottom, after = rounded(cycle.r_plane), rounded(cycle.bottom), rounded(row.end[2])
        surface = 0.0 if bottom < 0.0 < r_plane else rounded((r_plane + bottom) / 2)
        values = {
            "Q200": self._format_length(r_plane - surface),
            "Q201": self._format_length(bottom - surface),
            "Q206": self.numbers.format_feed(row.value),
            "Q202": self._format_length(surface - bottom),
            "Q210": "+0",
            "Q203": self._format_length(surface),
            "Q204": self._format_length(after - surface),
            "Q211": "+" + format_number(cycle.dwell if cycle.name == "G82" else 0.0, 3),
        }
        parameters = [f"  {name}={values[name]} ;{title}" for name, title in CYCLE_200.items()]
        self.out.lines.append(" ~\n".join(["CYCL DEF 200 DRILLING", *parameters]))

    # -- commands ----------------------------------------------------------------------------------------------------

    def _write_dwell(self, row: Motion) -> None:
        self.out.write("CYCL DEF 9.0 DWELL TIME")
        self.out.write(f"CYCL DEF 9.1 DWELL {format_number(row.value, 3)}")

    def _write_tool_change(self, row: Motion) -> None:
        if self.spinning:
            raise PostError("a tool is called while the spindle is running; stop it first")
        name = self.tool_names.get(row.ref, "")
        self.out.lines += comment_lines(f"T{row.ref} {name}".strip(), _WIDTH, style=";")
        self._speed_now = self._speeds.get(self.row, 0.0)
        speed = f"S{format_number(self._speed_now, 0)}" if self._speed_now else ""
        self.out.write(f"TOOL CALL {row.ref} Z", speed)
        self.safe = self.at_machine_height
        self.out.forget_modal_words("XYZ")

    def _write_spindle(self, row: Motion) -> None:
        self.spinning = row.value != 0.0
        if not self.spinning:
            self.out.write("M5")
            return
        if abs(row.value) != self._speed_now:
            raise PostError("{}: each tool has a single speed here, set by its TOOL CALL", self.dialect.name)
        self.out.write("M3" if row.value > 0 else "M4")


class SinumerikWriter(Writer):
    """Writes programs in the language of Siemens controls.

    While MCALL is active, every block with a move drills a hole, and so does a block with F alone. F is therefore
    written before the call, and MCALL alone ends the cycle before any other block.
    """

    end_of_cycle = "MCALL"
    calls_cycles = True

    _tool_now: int | None = None

    def _write_hole(self, row: Motion, cycle: DrillCycle) -> None:
        if self.cycle is None:
            self.out.write(self.out.activate_modal_word("plane", "G17"))
            self.out.write(self._feed_word(row))
            self.out.write(self._cycle_call_text(cycle, row.end[2]))
            self.out.forget_modal_words(["motion", *"XY"])
        position = self._position_words(row)
        self.out.write(self.out.activate_modal_word("motion", "G0"), *position)

    def _cycle_call_text(self, cycle: DrillCycle, after: float) -> str:
        length = self.numbers.format_length
        words = [length(after), length(cycle.r_plane), "0", length(cycle.bottom)]
        name = "CYCLE81"
        if cycle.name == "G82":
            name = "CYCLE82"
            words += ["", format_number(cycle.dwell, 3)]
        elif cycle.name in PECKING:
            name = "CYCLE83"
            peck = float(format_peck(cycle, self.numbers)) * self.numbers.unit
            first = max(self.numbers.rounded(cycle.r_plane) - peck, self.numbers.rounded(cycle.bottom))
            words += ["", length(first), "", "0", "0", "0", "1", "1" if cycle.name == "G83" else "0"]
        return f"MCALL {name}({','.join(words)})"

    def _tool_word(self, number: int) -> str:
        return f'T="{number}"'

    def _write_tool_change_words(self, word: str, number: int) -> None:
        self.out.write(word)
        self.out.write("M6")

    def _write_tool_change(self, row: Motion) -> None:
        super()._write_tool_change(row)
        self._tool_now = row.ref

    def _offset_words(self, number: int) -> list[str]:
        return ["D1"]

    def _write_machine_move_words(self, words: list[str], to_zero: bool) -> None:
        self.out.forget_modal_words(["motion"])
        self.out.write(self.out.activate_modal_word("motion", "G0"), "SUPA", *words, "D0")
        # The length offset is off now; the next move in Z activates it again.
        self.pending_offset = self._tool_now
