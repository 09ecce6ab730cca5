"""Write new speeds and heights into the text of a program. Cuts are divided where their speed changes."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from leafcut.gcode.modal_dependencies import BlockReader
from leafcut.gcode.program import Program
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.pace import CycleReturn, Lowered, Pace, PaceStretch
from leafcut.model.toolpath import Kind
from leafcut.processes.program.post.insertion import (
    code_without_comments,
    format_value,
    insert_words_within,
    line_ending,
    replace_words,
)
from leafcut.units import SECONDS_PER_MINUTE

_MOTION_OF_CUTS = re.compile(r"([Gg])[ \t]*0*[123](?![0-9.])")
_CENTRE_WORD = re.compile(r"[ \t]*[IJKRijkr][ \t]*[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_MOTION_WORD = re.compile(r"[Gg][ \t]*0*[0-3](?![0-9.])")
_RETURN_WORD = re.compile(r"([Gg][ \t]*)9[89](?![0-9.])")
_FEED_WORD = re.compile(r"[Ff][ \t]*[-+]?[0-9.]")
#: Number of significant digits in a new feed.
_DIGITS = 3
#: Number of decimals of division points, for programs in millimetres and in inches.
_DECIMALS, _DECIMALS_INCH = 4, 5
#: Number of decimals of heights, for programs in millimetres and in inches. Heights are rounded up.
_HEIGHTS, _HEIGHTS_INCH = 3, 4


def with_pace(program: Program, pace: Pace, longest: int, check_cancelled: Heartbeat = ignore_heartbeat) -> str:
    """Write new speeds into a program and return its text.

    Raises
    ------
    PostError
        A line would be longer than `longest` characters.
    """
    return _PaceWriter(program, pace, longest).text(check_cancelled)


def with_heights(program: Program, lowered: Sequence[Lowered]) -> str:
    """Write lower heights into a program and return its text. Heights are rounded up."""
    lines = list(program.lines)
    for block, letter, height in lowered:
        unit = program.modal(block + 1).unit or 1.0
        scale = 10.0 ** (_HEIGHTS if unit == 1.0 else _HEIGHTS_INCH)
        at = int(program.line[block]) - 1
        lines[at] = replace_words(lines[at], {letter: format_value(math.ceil(height / unit * scale - 1e-6) / scale)})
    return "".join(lines)


def with_returns(program: Program, returns: Sequence[CycleReturn], longest: int) -> str:
    """Write new cycle returns (G98, G99) into a program and return its text.

    Raises
    ------
    PostError
        A line would be longer than `longest` characters.
    """
    lines = list(program.lines)
    for block, code in returns:
        at = int(program.line[block]) - 1
        was = len(lines[at].rstrip("\r\n"))
        line, stated = _replace_in_code(lines[at], _RETURN_WORD, rf"\g<1>{code}")
        front = [] if stated else [f"G{code}"]
        lines[at] = "".join(insert_words_within(line, front, [], longest, was))
    return "".join(lines)


class _PaceWriter:
    def __init__(self, program: Program, pace: Pace, longest: int) -> None:
        self.program, self.pace, self.longest = program, pace, longest
        self.reader = BlockReader(program)
        # Motion and feed in the new text, from the first new speed on.
        self.motion: int | None
        self.feed: float
        self.end = line_ending(program.lines)

    def text(self, check_cancelled: Heartbeat) -> str:
        program = self.program
        rows = np.array(sorted(self.pace.stretches), dtype=np.int64)
        edited = dict(zip(program.row_block[rows].tolist(), rows.tolist(), strict=True))
        lines = list(program.lines)
        if not edited:
            return "".join(lines)
        differs = False
        for block in range(min(edited), program.n_blocks):
            check_cancelled()
            at = int(program.line[block]) - 1
            if block in edited:
                if not differs:
                    before = program.modal(block)
                    self.motion, self.feed = before.motion, before.feed
                lines[at] = self._edited_line(lines[at], block, edited[block])
                differs = True
            elif differs:
                lines[at] = self._restore_modal_words(lines[at], block)
                after = program.modal(block + 1)
                differs = self.motion != after.motion or self.feed != after.feed
        return "".join(lines)

    def _restore_modal_words(self, line: str, block: int) -> str:
        """Add the motion and feed words that an unchanged line can no longer inherit from the lines before it."""
        need, after = self.program.modal(block), self.program.modal(block + 1)
        modal_use = self.reader.modal_use(block, block + 1)
        front, back = [], []
        if "motion" in modal_use.inherited and need.motion is not None and self.motion != need.motion:
            front.append(f"G{need.motion}")
        if "feed" in modal_use.inherited and need.feed and self.feed != need.feed:
            back.append("F" + format_value(need.feed))
        if "motion" in modal_use.sets:
            self.motion = after.motion
        if "feed" in modal_use.sets:
            self.feed = after.feed
        if not front and not back:
            return line
        if block in self.program.fixed or self.reader.words(block) is None:
            # The words need a separate block. G2 and G3 are not allowed there, but fixed blocks state them anyway.
            words = [word for word in (*front, *back) if word not in ("G2", "G3")]
            return " ".join(words) + self.end + line if words else line
        return "".join(insert_words_within(line, front, back, self.longest, len(line.rstrip("\r\n"))))

    def _edited_line(self, line: str, block: int, row: int) -> str:
        program, path = self.program, self.program.path
        unit = program.modal(block + 1).unit or 1.0
        begin, end = path.before[row], path.end[row]
        decimals = _DECIMALS if unit == 1.0 else _DECIMALS_INCH
        written = []
        *parts, last = self.pace.stretches[row]
        own = program.modal(block + 1).feed
        for part in parts:
            place = begin + part.until * (end - begin)
            axes = [
                letter + format_value(round(float(place[axis]) / unit, decimals))
                for axis, letter in enumerate("XYZ")
                if abs(end[axis] - begin[axis]) > 1e-9
            ]
            words = ["G0" if math.isinf(part.speed) else "G1", *axes]
            if math.isfinite(part.speed):
                words += self._feed_words(part, row, own, unit)
            written.append(" ".join(words) + self.end)
            self.motion = 0 if math.isinf(part.speed) else 1
        return "".join(written) + self._last_stretch_line(line, block, row, last, own, unit)

    def _last_stretch_line(self, line: str, block: int, row: int, last: PaceStretch, own: float, unit: float) -> str:
        was = len(line.rstrip("\r\n"))
        code = code_without_comments(line)
        states_feed = _FEED_WORD.search(code) is not None
        front: list[str] = []
        back: list[str] = []
        if math.isinf(last.speed):
            line, count = _replace_in_code(line, _MOTION_OF_CUTS, r"\g<1>0")
            if self.program.path.kind[row] != Kind.FEED:
                line = _without_centre(line)
            if not count and self.motion != 0:
                front.append("G0")
            self.motion = 0
            self.feed = own if states_feed else self.feed
            return "".join(insert_words_within(line, front, back, self.longest, was))
        motion = self.program.modal(block + 1).motion
        if _MOTION_WORD.search(code) is None and self.motion != motion:
            front.append(f"G{motion}")
        self.motion = motion
        if states_feed:
            value = self._feed_in_program_units(last, row, own, unit)
            if value != own:
                line = replace_words(line, {"F": format_value(value)})
            self.feed = value
        else:
            back += self._feed_words(last, row, own, unit)
        return "".join(insert_words_within(line, front, back, self.longest, was))

    def _feed_words(self, stretch: PaceStretch, row: int, own: float, unit: float) -> list[str]:
        value = self._feed_in_program_units(stretch, row, own, unit)
        if value == self.feed:
            return []
        self.feed = value
        return ["F" + format_value(value)]

    def _feed_in_program_units(self, stretch: PaceStretch, row: int, own: float, unit: float) -> float:
        """Convert the speed of a segment to program units per minute.

        Unless it is the original feed, it is rounded down.
        """
        if abs(stretch.speed - float(self.program.path.value[row])) <= 1e-9 * stretch.speed:
            return own
        value = stretch.speed * SECONDS_PER_MINUTE / unit
        digits = max(_DIGITS - 1 - math.floor(math.log10(value)), 0)
        return math.floor(value * 10.0**digits + 1e-9) / 10.0**digits


def _without_centre(line: str) -> str:
    """Remove the words for the centre and the radius of an arc from a line.

    >>> _without_centre("N5 G0 X5 Y2 I-3. J0 (J2)")
    'N5 G0 X5 Y2 (J2)'
    """
    for match in reversed(list(_CENTRE_WORD.finditer(code_without_comments(line)))):
        line = line[: match.start()] + line[match.end() :]
    return line


def _replace_in_code(line: str, pattern: re.Pattern[str], text: str) -> tuple[str, int]:
    """Replace the first match of a pattern outside of comments. Return the line and the number of replacements."""
    match = pattern.search(code_without_comments(line))
    if match is None:
        return line, 0
    return line[: match.start()] + match.expand(text) + line[match.end() :], 1
