"""Detect reversible cuts: blocks that move to a position, cut at constant Z, and retract.

    G0 X0 Y0 / G1 Z-1 F50  |  X5 F200 / G2 X9 I2  |  G0 Z5
    lead                   |  body                |  tail

A cut is reversible only if its blocks have plain words. A block that is not fully supported cannot be reversed.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from leafcut.gcode.program import Program
from leafcut.gcode.words import Block, parse_plain_block
from leafcut.model.toolpath import Kind

#: G codes, in tenths, that may occur in the lead and the tail. They stay where they are.
_ASIDE = frozenset({0, 10, 170, 400, 900, 901, 911, 940})
_SPINDLE = frozenset({3.0, 4.0, 5.0})
_LETTERS = frozenset("NGMXYZFS")
_DWELL_LETTERS = frozenset("NGP")
_BODY_LETTERS = frozenset("NGXYZIJRFS")
_MOTIONS = frozenset({10, 20, 30})
_CUTS = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)
#: Matches a comment with a position, which would be wrong after reversing the cut.
_STATES_POSITION = re.compile(r"[XYIJR]\s*(?:[:=]\s*)?[-+]?\.?[0-9]", re.IGNORECASE)
_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class ReversibleCut:
    """The blocks of a lead, a cut and a retract.

    The cut starts at block `body`, and the retract starts at block `tail`. `places` contains X and Y as text for all
    points along the cut, including its start. A coordinate without a word is None.
    """

    begin: int
    body: int
    tail: int
    end: int
    rows: tuple[int, ...]
    places: tuple[tuple[str | None, str | None], ...]


def find_reversible_cut(program: Program, begin: int, end: int) -> ReversibleCut | None:
    """Return a range of blocks as a reversible cut, or None if a block is not plain or Z is not constant."""
    return _CutReader(program, begin, end).read_cut()


class _CutReader:
    def __init__(self, program: Program, begin: int, end: int) -> None:
        self.program, self.begin, self.end = program, begin, end
        self.path = program.path

    def read_cut(self) -> ReversibleCut | None:
        low, high = int(self.program.first[self.begin]), int(self.program.first[self.end])
        cuts = [row for row in range(low, high) if self.path.kind[row] in _CUTS and not self._is_standstill(row)]
        if not cuts or any(b in self.program.fixed for b in range(self.begin, self.end)):
            return None
        body, tail = int(self.program.row_block[cuts[0]]), int(self.program.row_block[cuts[-1]]) + 1
        blocks = self._words_of_blocks(body, tail)
        if body == self.begin or blocks is None:
            return None
        found = [self._cutting_row(block, blocks[block - self.begin]) for block in range(body, tail)]
        rows = [row for row in found if row is not None]
        if (
            None in found
            or len(cuts) != len(rows)
            or not self._has_constant_modes(body, tail)
            or not self._is_level(rows)
        ):
            return None
        entry, leave = self._position_before(rows[0]), self._position_after(rows[-1])
        aside = ((range(self.begin, body), entry), (range(tail, self.end), leave))
        if not all(self._is_plain_lead_block(b, blocks[b - self.begin], at) for part, at in aside for b in part):
            return None
        if not self._is_adjacent_to_cut(low, rows[0], down=True) or not self._is_adjacent_to_cut(
            rows[-1] + 1, high, down=False
        ):
            return None
        places = self._points_as_text(blocks, body, tail, rows)
        if places is None or not self._states_centres(blocks, body, rows):
            return None
        return ReversibleCut(self.begin, body, tail, self.end, tuple(rows), places)

    def _words_of_blocks(self, body: int, tail: int) -> list[Block] | None:
        """Return all blocks of the range, or None if a block has no plain words or a comment states a position."""
        lines, line = self.program.lines, self.program.line
        blocks = [parse_plain_block(lines[int(line[b]) - 1]) for b in range(self.begin, self.end)]
        between = map(parse_plain_block, lines[int(line[self.begin]) - 1 : int(line[tail - 1])])
        states = (_STATES_POSITION.search(remark) for block in between if block for remark in block.comments)
        plain = [b for b in blocks if b is not None and not b.deleted and b.percent is None]
        return plain if len(plain) == len(blocks) and not any(states) else None

    def _cutting_row(self, block: int, words: Block) -> int | None:
        """Return the toolpath row of a block that only cuts. For all other blocks, return None."""
        low, high = int(self.program.first[block]), int(self.program.first[block + 1])
        rows = [row for row in range(low, high) if self.path.kind[row] != Kind.SPINDLE]
        letters = [word.letter for word in words.words]
        codes = [round(word.value * 10) for word in words.words if word.letter == "G"]
        plain = _BODY_LETTERS.issuperset(letters) and len(codes) <= 1 and _MOTIONS.issuperset(codes)
        once = all(letters.count(letter) <= 1 for letter in set(letters))
        cuts = len(rows) == 1 and self.path.kind[rows[0]] in _CUTS
        return rows[0] if plain and once and cuts else None

    def _has_constant_modes(self, body: int, tail: int) -> bool:
        """Return whether only feeds and motions change in the cut, and all coordinates are absolute."""
        modals = [self.program.modal(block + 1) for block in range(body, tail)]
        first = modals[0]
        alike = len({(m.spindle, m.rpm, m.plane, m.absolute_centres) for m in modals}) == 1
        return (
            alike and not first.incremental and first.plane == 17 and first.radius == 40 and first.feed_mode in (94, 95)
        )

    def _is_level(self, rows: list[int]) -> bool:
        """Return whether Z is constant in the cut, and no arc has more than one turn."""
        z = np.concatenate([self.path.before[rows, 2], self.path.end[rows, 2]])
        level = bool(np.isnan(z).all() or np.ptp(z) < _TOLERANCE)
        arcs = [row for row in rows if self.path.kind[row] != Kind.FEED]
        return level and all(self.path.arcs[int(self.path.ref[row])].turns == 1 for row in arcs)

    def _is_plain_lead_block(self, block: int, words: Block, at: tuple[float, float]) -> bool:
        """Return whether a block of the lead or tail is plain. If the block moves in X or Y, it must move to `at`."""
        rows = range(int(self.program.first[block]), int(self.program.first[block + 1]))
        letters = {word.letter for word in words.words}
        if self.path.kind[rows.start : rows.stop].tolist() == [int(Kind.DWELL)]:
            codes = [round(word.value * 10) for word in words.words if word.letter == "G"]
            # A dwell at the start or the end of the cut.
            return letters <= _DWELL_LETTERS and codes == [40] and self._is_near(self._position_before(rows.start), at)
        plain = _LETTERS.issuperset(letters) and all(
            round(word.value * 10) in _ASIDE if word.letter == "G" else word.value in _SPINDLE
            for word in words.words
            if word.letter in "GM"
        )
        if not plain or not {int(Kind.RAPID), int(Kind.FEED), int(Kind.SPINDLE)}.issuperset(
            self.path.kind[rows.start : rows.stop].tolist()
        ):
            return False
        moves = [row for row in rows if self.path.kind[row] != Kind.SPINDLE]
        if not letters & {"X", "Y"}:
            return all(self._is_standstill(row) for row in moves)
        return all(
            self._is_near(self._position_after(row), at)
            and (self.path.kind[row] == Kind.RAPID or self._is_standstill(row))
            for row in moves
        )

    def _is_adjacent_to_cut(self, low: int, high: int, *, down: bool) -> bool:
        kinds = [int(k) for k in self.path.kind[low:high] if k in (Kind.RAPID, Kind.FEED)]
        return kinds == sorted(kinds, reverse=not down)

    def _points_as_text(
        self, blocks: list[Block], body: int, tail: int, rows: list[int]
    ) -> tuple[tuple[str | None, str | None], ...] | None:
        """Return X and Y as text for every point of the cut, or None if a text does not match its coordinate."""
        unit = self.program.modal(body).unit or 1.0
        stated: dict[str, str | None] = {"X": None, "Y": None}
        places: list[tuple[str | None, str | None]] = []
        for block in range(self.begin, tail):
            stated.update((w.letter, w.text) for w in blocks[block - self.begin].words if w.letter in "XY")
            if block < body - 1:
                continue
            at = self._position_before(rows[0]) if block < body else self._position_after(rows[block - body])
            for text, value in zip(stated.values(), at, strict=True):
                if not math.isfinite(value) or (text is not None and abs(float(text) * unit - value) > _TOLERANCE):
                    return None
            places.append((stated["X"], stated["Y"]))
        return tuple(places)

    def _states_centres(self, blocks: list[Block], body: int, rows: list[int]) -> bool:
        modal = self.program.modal(body)
        unit = modal.unit or 1.0
        for number, row in enumerate(rows):
            if self.path.kind[row] == Kind.FEED:
                continue
            centre = self.path.arcs[int(self.path.ref[row])].center
            origin = (0.0, 0.0) if modal.absolute_centres else self._position_before(row)
            stated = {word.letter: word.value for word in blocks[body - self.begin + number].words}
            for axis, letter in enumerate("IJ"):
                if letter in stated and abs(origin[axis] + stated[letter] * unit - centre[axis]) > _TOLERANCE:
                    return False
        return True

    # -- places ------------------------------------------------------------------------------------------------------

    def _position_before(self, row: int) -> tuple[float, float]:
        return float(self.path.before[row, 0]), float(self.path.before[row, 1])

    def _position_after(self, row: int) -> tuple[float, float]:
        return float(self.path.end[row, 0]), float(self.path.end[row, 1])

    def _is_near(self, one: tuple[float, float], other: tuple[float, float]) -> bool:
        return abs(one[0] - other[0]) < _TOLERANCE and abs(one[1] - other[1]) < _TOLERANCE

    def _is_standstill(self, row: int) -> bool:
        return self._is_near(self._position_before(row), self._position_after(row))
