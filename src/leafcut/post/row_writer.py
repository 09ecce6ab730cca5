"""Writer that converts a toolpath to G-code in a controller's dialect. Writers for other languages inherit from it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType

from leafcut.errors import PostError
from leafcut.files.digests import fill_in_digest
from leafcut.gcode.dialects import Dialect
from leafcut.message import Message
from leafcut.model.cycles import expand_cycle
from leafcut.model.toolpath import DrillCycle, Kind, Motion, Toolpath, g_word, plane_axes
from leafcut.options import PostOptions
from leafcut.post.words import (
    NumberFormat,
    comment_lines,
    coolant_words,
    cycle_parameters,
    cycle_words,
    dwell_word,
    format_number,
    supports_cycle,
    to_plain_ascii,
)

#: Names for a program without tool comments.
NO_NAMES: Mapping[int, str] = MappingProxyType({})

#: Step of block numbers, and maximum block number.
_STEP = 10
_LAST_NUMBER = 99_990


class Blocks:
    """Collects the lines of a program, and tracks the active modal words."""

    def __init__(self, dialect: Dialect, numbered: bool) -> None:
        self.lines: list[str] = []
        self._dialect = dialect
        self._numbered = numbered
        self._number = 0
        self._active: dict[str, str] = {}

    def write(self, *words: str) -> None:
        """Write a block of words. Empty words are left out, and a block without words is not written."""
        kept = [word for word in words if word]
        if self._dialect.one_command:
            commands = [word for word in kept if word[0] in "GM"]
            for word in commands[:-1]:
                self._write_line(word)
            kept = [*commands[-1:], *(word for word in kept if word not in commands)]
        self._write_line(" ".join(kept))

    def _write_line(self, text: str) -> None:
        if not text:
            return
        if self._numbered:
            self._number = self._number % _LAST_NUMBER + _STEP
            text = f"N{self._number} {text}"
        if len(text) > self._dialect.max_line:
            raise PostError("a block is longer than {} accepts: {}…", self._dialect.name, text[:60])
        self.lines.append(text)

    def write_comment(self, text: str) -> None:
        """Write a text as comment lines."""
        dialect = self._dialect
        self.lines += comment_lines(text, dialect.max_line, dialect.uppercase_comments, dialect.comments)

    def activate_modal_word(self, group: str, word: str) -> str:
        """Activate a modal word in its group. Return the word, or "" if it was already active."""
        repeat = self._dialect.one_command and group == "motion"
        if self._active.get(group) == word and not repeat:
            return ""
        self._active[group] = word
        return word

    def forget_modal_words(self, groups: Iterable[str]) -> None:
        """Forget the active words of the given groups, so that the next word of each group is always written."""
        for group in groups:
            self._active.pop(group, None)


class Writer:
    """Writes the rows of a toolpath one after another, and tracks the state of the controller."""

    #: Word that ends a modal cycle.
    end_of_cycle = "G80"
    #: Whether a cycle is defined once and then called at each hole with the same feed and return height.
    calls_cycles = False

    def __init__(
        self,
        path: Toolpath,
        dialect: Dialect,
        options: PostOptions,
        tool_names: Mapping[int, str] = NO_NAMES,
        rapid_velocity: float = math.nan,
        preselect_tool: bool = False,
    ) -> None:
        decimals = dialect.decimals_inch if options.output_units == "inch" else dialect.decimals_mm
        self.path, self.dialect, self.options = path, dialect, options
        self.tool_names, self.rapid_velocity = tool_names, rapid_velocity
        self.preselect_tool = preselect_tool
        self.numbers = NumberFormat(options.output_units == "inch", decimals, dialect.point_required)
        self.out = Blocks(dialect, options.line_numbers)
        # Position of the tool as written (None if unknown), and in mm (NaN if unknown).
        self.place: list[str | None] = [None, None, None]
        self.position = [math.nan, math.nan, math.nan]
        # Whether X and Y may move, whether the tool is at a machine height, and the length offset to activate.
        self.safe = self.at_machine_height = False
        self.pending_offset: int | None = None
        self.cycle: DrillCycle | None = None
        # Feed of the active cycle, mm/s, and height before its series, mm.
        self.feed_of_cycle: float
        self.initial: float
        self.coolant_mode = 0
        self.spinning = False
        self.ended = False
        self.row: int
        #: Tools of all tool changes after the first change.
        self.tools = iter(path.ref[path.kind == Kind.TOOL][1:].tolist())

    def program_text(self, header: Sequence[str]) -> str:
        """Return the text of the program."""
        self._write_header(header)
        write = self._row_writers()
        for number, motion in enumerate(self.path):
            self.row = number
            if self.ended:
                raise PostError("the toolpath continues after its end")
            if motion.kind is not Kind.DRILL:
                self._end_cycle()
            if motion.kind not in write:
                raise PostError(self._unsupported_message(motion.kind))
            write[motion.kind](motion)
        if not self.ended:
            raise PostError("the toolpath has no end (Kind.END)")
        return fill_in_digest(self._join_lines())

    def _unsupported_message(self, kind: Kind) -> Message:
        return Message("{} programs cannot state {}", self.dialect.name, kind.name)

    def _join_lines(self) -> str:
        return "".join(f"{line}\n" for line in (*self.out.lines, *["%"] * (self.dialect.percent == "frame")))

    def _row_writers(self) -> dict[Kind, Callable[[Motion], None]]:
        return {
            Kind.RAPID: self._write_rapid,
            Kind.FEED: self._write_feed_move,
            Kind.ARC_CW: self._write_arc,
            Kind.ARC_CCW: self._write_arc,
            Kind.DRILL: self._write_drill,
            Kind.DWELL: self._write_dwell,
            Kind.TOOL: self._write_tool_change,
            Kind.OFFSET: self._write_offset,
            Kind.SPINDLE: self._write_spindle,
            Kind.COOLANT: self._write_coolant,
            Kind.PAUSE: self._write_pause,
            Kind.MACHINE: self._write_machine_move,
            Kind.FRAME: self._write_work_offset,
            **({Kind.BLENDING: self._write_blending} if self.dialect.corner_tolerance or self.dialect.rounding else {}),
            Kind.END: self._write_end,
        }

    # -- head --------------------------------------------------------------------------------------------------------

    def _write_header(self, header: Sequence[str]) -> None:
        dialect, lines = self.dialect, self.out.lines
        name = to_plain_ascii(header[0]) if header else ""
        if dialect.percent == "frame":
            lines.append("%")
        elif dialect.percent == "title":
            title = re.sub(r"[^A-Z0-9 _.-]", "", name.upper())[:20].strip() or "LEAFCUT"
            lines.append(f"%{title},MX,")
        if dialect.program_number:
            title = (name.upper() if dialect.uppercase_comments else name)[:32].strip()
            lines.append(f"O{self.options.program_number:04d}" + (f" ({title})" if title else ""))
        for line in (*header, *(dialect.notes if header else ())):
            self.out.write_comment(line)
        for line in dialect.opening:
            self.out.write(line)
        self.out.write(dialect.units_inch if self.numbers.inch else dialect.units_mm)
        for line in dialect.preamble:
            self.out.write(line)
        self.out.activate_modal_word("plane", "G17")

    # -- moves -------------------------------------------------------------------------------------------------------

    def _write_rapid(self, row: Motion) -> None:
        sideways = self._is_changed(row.end[0], 0) or self._is_changed(row.end[1], 1)
        z = row.end[2]
        if not self.safe and (sideways or math.isnan(z)):
            raise PostError(
                "the toolpath moves in X or Y while the height of the tool is unknown; at the start, and after a "
                "change of tool, the first move must be in Z only"
            )
        offset: list[str] = []
        if self.pending_offset is not None and not math.isnan(z):
            if sideways:
                raise PostError("the first move in Z after a change of tool must be in Z only")
            offset = self._offset_words(self.pending_offset)
            self.pending_offset = None
        words = self._axis_words(row, only_z=bool(offset) or not self.safe)
        self.out.write(self.out.activate_modal_word("motion", "G0"), *offset, *words, self._rapid_feed_word())
        self._track_position(row)

    def _rapid_feed_word(self) -> str:
        if not self.dialect.rapid_feed or math.isnan(self.rapid_velocity):
            return ""
        return self.out.activate_modal_word("F", "F" + self.numbers.format_feed(self.rapid_velocity))

    def _write_feed_move(self, row: Motion) -> None:
        self._check_position_known(row)
        self.out.write(self.out.activate_modal_word("motion", "G1"), *self._axis_words(row), self._feed_word(row))
        self._track_position(row)

    def _write_arc(self, row: Motion) -> None:
        self._check_position_known(row)
        arc = self.path.arcs[row.ref]
        axes = plane_axes(arc.plane)
        if arc.turns > 1 and not self.dialect.arc_turns:
            raise PostError("{} does not support arcs of more than one turn", self.dialect.name)
        start = [math.nan if text is None else float(text) * self.numbers.unit for text in self.place]
        if any(math.isnan(start[axis]) or math.isnan(row.end[axis]) for axis in axes[:2]):
            raise PostError("the arc starts at an unknown position")
        self._check_arc_after_rounding(row, axes)
        centre = [f"{'IJK'[a]}{self.numbers.format_length(arc.center[a] - start[a])}" for a in sorted(axes[:2])]
        turns = [f"P{arc.turns}"] if arc.turns > 1 else []
        plane = self.out.activate_modal_word("plane", f"G{arc.plane}")
        motion = self.out.activate_modal_word("motion", "G2" if row.kind is Kind.ARC_CW else "G3")
        words = [self._axis_word(row, axis) for axis in range(3)]
        if self.dialect.arc_ends and not any(words[axis] for axis in axes[:2]):
            self.out.forget_modal_words("XYZ"[axis] for axis in axes[:2])
            for axis in axes[:2]:
                words[axis] = self._axis_word(row, axis)
        self.out.write(plane, motion, *words, *centre, *turns, self._feed_word(row))
        self._track_position(row)

    def _check_arc_after_rounding(self, row: Motion, axes: tuple[int, int, int]) -> None:
        """Check that rounding cannot turn a very short arc into an almost full circle, or vice versa."""
        steps = [abs(row.end[a] - self.position[a]) / self.numbers.resolution for a in axes[:2]]
        if 1e-6 < max(steps) < 2.0:
            raise PostError("the ends of an arc are less than two units of the last decimal place apart")

    def _check_position_known(self, row: Motion) -> None:
        if not self.safe or self.pending_offset is not None:
            raise PostError(
                "the toolpath cuts before the height of the tool is known; at the start, and after a change of tool, "
                "the first move must be a rapid in Z alone"
            )
        if all(math.isnan(v) for v in row.end):
            raise PostError("a cut goes to an unknown position")

    def _is_changed(self, value: float, axis: int) -> bool:
        return not math.isnan(value) and self.numbers.format_length(value) != self.place[axis]

    def _axis_words(self, row: Motion, only_z: bool = False) -> list[str]:
        """Return the words of the axes whose position changes.

        If no position changes, return the words of all known axes.
        """
        if only_z:
            self.out.forget_modal_words("Z")
            return [self._axis_word(row, 2)]
        words = [self._axis_word(row, axis) for axis in range(3)]
        if not any(words):
            self.out.forget_modal_words("XYZ")
            words = [self._axis_word(row, axis) for axis in range(3)]
        if not any(words):
            raise PostError("a move goes to an unknown position")
        return words

    def _axis_word(self, row: Motion, axis: int) -> str:
        value = row.end[axis]
        return (
            ""
            if math.isnan(value)
            else self.out.activate_modal_word("XYZ"[axis], "XYZ"[axis] + self._format_length(value))
        )

    def _format_length(self, mm: float) -> str:
        return self.numbers.format_length(mm)

    def _feed_word(self, row: Motion) -> str:
        return self.out.activate_modal_word("F", "F" + self.numbers.format_feed(row.value))

    def _track_position(self, row: Motion) -> None:
        for axis, value in enumerate(row.end):
            if not math.isnan(value):
                self.place[axis], self.position[axis] = self.numbers.format_length(value), value
        if not math.isnan(row.end[2]):
            self.safe, self.at_machine_height = True, False

    def _write_machine_move(self, row: Motion) -> None:
        moved_axes = [axis for axis in range(3) if not math.isnan(row.end[axis])]
        if not self.safe and moved_axes != [2]:
            raise PostError("the first move, in machine coordinates, must be in Z only")
        if not moved_axes:
            raise PostError("a move in machine coordinates has no target")
        self._write_machine_move_words(
            ["XYZ"[axis] + self.numbers.format_length(row.end[axis]) for axis in moved_axes],
            all(row.end[axis] == 0.0 for axis in moved_axes),
        )
        for axis in moved_axes:
            self.place[axis], self.position[axis] = None, math.nan
        self.out.forget_modal_words("XYZ"[axis] for axis in moved_axes)
        if 2 in moved_axes:
            self.safe = self.at_machine_height = True

    def _write_machine_move_words(self, words: list[str], to_zero: bool) -> None:
        if self.dialect.machine_move == "G28" and to_zero:
            self.out.write("G91", "G28", *words)
            self.out.write("G90")
        elif 530 not in self.dialect.g_codes:
            raise PostError(
                "{} has no moves in machine coordinates; remove tool_change.position from the machine's profile",
                self.dialect.name,
            )
        else:
            self.out.forget_modal_words(["motion"])
            self.out.write("G53", self.out.activate_modal_word("motion", "G0"), *words)

    # -- canned cycles -----------------------------------------------------------------------------------------------

    def _write_drill(self, row: Motion) -> None:
        cycle = self.path.cycles[row.ref]
        self._check_position_known(row)
        if any(math.isnan(v) for v in (*row.end, self.position[2])):
            raise PostError("a hole is drilled while the position of the tool is unknown")
        if self.calls_cycles and self.cycle is not None:
            same = self._is_active_cycle(cycle) and self.cycle.to_initial == cycle.to_initial
            if not same or self.feed_of_cycle != row.value:
                self._end_cycle()
        # A called cycle does not lift the tool first: a tool below the R plane would travel to the hole at its height.
        low = self.calls_cycles and self.numbers.rounded(self.position[2]) < self.numbers.rounded(cycle.r_plane)
        if not supports_cycle(cycle, self.dialect) or low or not self._prepare_retract_to(cycle, row.end[2]):
            self._write_expanded_cycle(row, cycle)
            return
        self._write_hole(row, cycle)
        self.cycle, self.feed_of_cycle = cycle, row.value
        self._track_position(row)
        self._axis_word(row, 2)

    def _is_active_cycle(self, cycle: DrillCycle) -> bool:
        return self.cycle is not None and cycle_parameters(self.cycle) == cycle_parameters(cycle)

    def _write_hole(self, row: Motion, cycle: DrillCycle) -> None:
        """Write the block of a hole. The words of the cycle are left out if the cycle is active."""
        is_active = self._is_active_cycle(cycle)
        if not is_active:
            self.out.forget_modal_words(["motion", "retract", *"XY"])
        plane = self.out.activate_modal_word("plane", "G17")
        retract = self.out.activate_modal_word("retract", "G98" if cycle.to_initial else "G99")
        name, words = cycle_words(cycle, self.numbers, self.dialect)
        position = self._position_words(row)
        name, words = ("", []) if is_active else (name, words)
        self.out.write(plane, retract, name, *position, *words, self._feed_word(row))

    def _position_words(self, row: Motion) -> list[str]:
        """Return the words of X and Y whose values change. If neither value changes, return both words."""
        words = [self._axis_word(row, 0), self._axis_word(row, 1)]
        if not any(words):
            self.out.forget_modal_words("XY")
            words = [self._axis_word(row, 0), self._axis_word(row, 1)]
        return words

    def _prepare_retract_to(self, cycle: DrillCycle, height: float) -> bool:
        """Return whether the cycle can end at `height`, mm. If necessary, start a new series of cycles.

        Within a series, G98 returns to the height before its first hole, even after G99. LinuxCNC's move to the next
        hole depends on this height (`DrillCycle.approach_in_series`). A new series starts if the tool would otherwise
        not approach the hole at the current height.
        """
        if self.cycle is not None:
            returns = self._retracts_to(cycle, self.initial, height)
            restarts = self.dialect.cycle_words == "fagor" and cycle_parameters(self.cycle) != cycle_parameters(cycle)
            current = self.position[2]
            rises = current < cycle.height_after(self.initial)
            level = not rises and cycle.approach_in_series(self.initial, current) == "level"
            if returns and not restarts and level:
                return True
            self._end_cycle()
        self.initial = self.position[2]
        return self._retracts_to(cycle, self.initial, height)

    def _retracts_to(self, cycle: DrillCycle, initial: float, height: float) -> bool:
        return self.numbers.format_length(cycle.height_after(initial)) == self.numbers.format_length(height)

    def _write_expanded_cycle(self, row: Motion, cycle: DrillCycle) -> None:
        if cycle.name == "G84":
            raise PostError("after a tapped hole, the tool does not return to the R plane or the initial plane")
        self._end_cycle()
        for step in expand_cycle(row, cycle, self.position[2]):
            if step.kind is Kind.DWELL:
                self._write_dwell(step)
            else:
                x, y, z = step.end
                current = self.position
                end = (current[0] if math.isnan(x) else x, current[1] if math.isnan(y) else y, z)
                if step.kind is Kind.RAPID and end == tuple(current):
                    continue
                (self._write_rapid if step.kind is Kind.RAPID else self._write_feed_move)(step._replace(end=end))

    def _end_cycle(self) -> None:
        if self.cycle is not None:
            self.out.write(self.end_of_cycle)
            self.out.forget_modal_words(["motion"])
            self.cycle = None

    # -- commands ----------------------------------------------------------------------------------------------------

    def _write_dwell(self, row: Motion) -> None:
        self.out.write("G4", dwell_word(row.value, self.dialect))

    def _write_tool_change(self, row: Motion) -> None:
        is_manual = self.dialect.changes_by_hand
        if is_manual and self.spinning:
            raise PostError("a manual tool change is planned while the spindle is running; stop the spindle first")
        name = self.tool_names.get(row.ref, "")
        self.out.write_comment(f"T{row.ref} {name}".strip())
        tool = self._tool_word(row.ref)
        if self.dialect.tool_change == "M0":
            self.out.write("M0", tool)
        elif is_manual:
            self.out.write(tool)
            self.out.write(self.dialect.stop_word)
        else:
            self._write_tool_change_words(tool, row.ref)
            following = next(self.tools, row.ref)
            if following != row.ref and self.preselect_tool:
                self.out.write(self._tool_word(following))
        self.pending_offset = row.ref if self.dialect.length_offset else None
        # Any tool is clear of the part at a machine height; at other heights, the new tool may be too long.
        self.safe = self.at_machine_height
        # Operators restart programs at a tool change, so the first move after it repeats all words, including G0.
        self.out.forget_modal_words(["motion", *"XYZF"])

    def _tool_word(self, number: int) -> str:
        return f"T{number}"

    def _write_tool_change_words(self, word: str, number: int) -> None:
        offset = f"D{number}" if self.dialect.length_offset == "D" else ""
        self.out.write(word, offset, "M6")
        self.out.activate_modal_word("D", offset)

    def _write_offset(self, row: Motion) -> None:
        if row.ref:
            self.pending_offset = row.ref if self.dialect.length_offset else None
        else:
            self.pending_offset = None
            self.out.write(self.dialect.length_offset_off)

    def _offset_words(self, number: int) -> list[str]:
        if self.dialect.length_offset == "D":
            return ["G43", self.out.activate_modal_word("D", f"D{number}")]
        return ["G43", f"H{number}"]

    def _write_spindle(self, row: Motion) -> None:
        if row.value == 0.0:
            self.out.write("M5")
            self.spinning = False
            return
        self.out.write("S" + format_number(abs(row.value), 0), "M3" if row.value > 0 else "M4")
        self.spinning = True

    def _write_work_offset(self, row: Motion) -> None:
        if row.ref not in self.dialect.g_codes:
            raise PostError("{} programs have no work offset {}", self.dialect.name, g_word(row.ref))
        self.out.write(g_word(row.ref))
        self.place, self.position = [None] * 3, [math.nan] * 3
        # Operators restart programs at a fixture, so the first move repeats all words.
        self.out.forget_modal_words(["motion", *"XYZF"])

    def _write_coolant(self, row: Motion) -> None:
        self.out.write(*coolant_words(row.ref, self.coolant_mode, self.dialect))
        self.coolant_mode = row.ref

    def _write_blending(self, row: Motion) -> None:
        exact = row.ref != 640
        tolerance = "" if exact or not row.value else f"P{self.numbers.format_length(row.value)}"
        self.out.write("G61" if exact else "G64", tolerance)

    def _write_pause(self, row: Motion) -> None:
        if row.ref and "M1" not in self.dialect.m_words.split():
            raise PostError("{} has no optional stop (M1)", self.dialect.name)
        self.out.write("M1" if row.ref else self.dialect.stop_word)

    def _write_end(self, row: Motion) -> None:
        self.out.write(self.dialect.end_word)
        self.ended = True
