"""Modal dependencies of a range of blocks: the modes that it inherits from earlier blocks, and the modes that it sets.

`G1 Z-1` inherits the feed. `X5` inherits the motion and the Y position. If a range moves to another position in the
program, the modes that it inherits must be stated again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from leafcut.gcode.expressions import words_without_evaluation
from leafcut.gcode.program import Modal, Program
from leafcut.gcode.word_groups import GROUP_OF
from leafcut.gcode.words import parse_plain_block
from leafcut.model.toolpath import Kind

#: Fields of `Modal` that a block may inherit from earlier blocks, apart from the position. "motion" includes the active
#: cycle and its words.
INHERITED = frozenset({"motion", "plane", "incremental", "absolute_centres", "to_initial", "feed", "feed_mode", "rpm"})
#: The field of `Modal` that each group of G words sets.
_FIELD_OF = {
    "motion": "motion",
    "cycle": "motion",
    "plane": "plane",
    "distance": "incremental",
    "arc distance": "absolute_centres",
    "retract": "to_initial",
    "feed mode": "feed_mode",
}
#: Letters in M words for outputs and inputs. Their values are not lengths.
_OF_OUTPUTS = frozenset("PQEL$")
#: M words that store modes (M70), forget them (M71), or restore them, either now (M72) or at the end of a call (M73).
_RESTORE = (70, 71, 72, 73)
_CUTS = frozenset({int(Kind.FEED), int(Kind.ARC_CW), int(Kind.ARC_CCW), int(Kind.DRILL)})
_ARCS = frozenset({int(Kind.ARC_CW), int(Kind.ARC_CCW)})
_MOVES = _CUTS | {int(Kind.RAPID)}


@dataclass(frozen=True, slots=True)
class BlockWords:
    """The words of a block.

    Attributes
    ----------
    states
        Fields of `Modal` that the words set.
    letters
        Numbers as text, by letter.
    starts_spindle
        Whether the block contains M3 or M4.
    """

    states: frozenset[str]
    letters: dict[str, str]
    starts_spindle: bool
    #: Whether the block has no words but only comments, which may be active.
    empty: bool = False
    #: Whether the block consists of M words for outputs and their arguments.
    outputs: bool = False


@dataclass(frozen=True, slots=True)
class ModalUse:
    """The fields of `Modal` that a range of blocks uses before setting them, and all fields that it sets or uses."""

    inherited: frozenset[str]
    sets: frozenset[str]


def replace_fields(modal: Modal, fields: Iterable[str], source: Modal) -> Modal:
    """Return a copy of a modal state in which some `INHERITED` fields have the values of another state."""
    names = [
        name for field in fields for name in (("motion", "cycle", "cycle_words") if field == "motion" else (field,))
    ]
    return replace(modal, **{name: getattr(source, name) for name in names})


class BlockReader:
    """Parses the words of a program's blocks and caches the result.

    With `beam`, S is a beam power, which may act in rapids.
    """

    def __init__(self, program: Program, *, beam: bool = False) -> None:
        self.program = program
        self._lit_rapids = beam and not program.dark_rapids
        self._kinds: list[int] = program.path.kind.tolist()
        self._first: list[int] = program.first.tolist()
        self._words: dict[int, BlockWords | None] = {}
        self._obeyed = {setting.line for setting in program.obeyed}

    @cached_property
    def blocks_by_letter(self) -> dict[str, tuple[list[int], list[str]]]:
        """Map each letter to its blocks, in order, and to its numbers as text.

        Letters other than F and S count only in blocks that drill.
        """
        found: dict[str, tuple[list[int], list[str]]] = {}
        for block in range(self.program.n_blocks):
            words = self.words(block)
            if words is None:
                continue
            drills = int(Kind.DRILL) in self.kinds(block)
            for letter, text in words.letters.items():
                if letter in "FS" or drills:
                    blocks, texts = found.setdefault(letter, ([], []))
                    blocks.append(block)
                    texts.append(text)
        return found

    @cached_property
    def first_blocks_by_field(self) -> dict[str, int]:
        """The first block that sets each field of `Modal`."""
        found: dict[str, int] = {}
        for block in range(self.program.n_blocks):
            for field in self.fields_set_in_blocks(block, block + 1):
                found.setdefault(field, block)
        return found

    def fields_set_in_blocks(self, begin: int, end: int) -> set[str]:
        """Return the fields of `Modal` that the words in a half-open range of blocks set."""
        words = (self.words(block) for block in range(begin, end))
        return {field for w in words if w is not None for field in w.states}

    def kinds(self, block: int) -> list[int]:
        """Return the kinds of the toolpath rows of a block."""
        return self._kinds[self._first[block] : self._first[block + 1]]

    def words(self, block: int) -> BlockWords | None:
        """Return the words of a block, or None if they include expressions or other special syntax."""
        if block not in self._words:
            self._words[block] = self._parse_words(block)
        return self._words[block]

    def _parse_words(self, block: int) -> BlockWords | None:
        line = self.program.lines[int(self.program.line[block]) - 1].rstrip("\r\n")
        plain = parse_plain_block(line)
        words = words_without_evaluation(line) if plain is None else plain.words
        if words is None:
            return None
        states = {_FIELD_OF.get(GROUP_OF.get(round(w.value * 10), ""), "") for w in words if w.letter == "G"}
        states |= {{"F": "feed", "S": "rpm"}.get(w.letter, "") for w in words}
        letters = {w.letter: w.text for w in words if w.letter not in "GMN"}
        spindle = any(w.letter == "M" and w.value in (3, 4) for w in words)
        restores = any(w.letter == "M" and w.value in _RESTORE for w in words)
        outputs = not restores and {w.letter for w in words} <= {"M", "N"} | _OF_OUTPUTS
        return BlockWords(frozenset(states - {""}), letters, spindle, not words, outputs)

    def modal_use(self, begin: int, end: int) -> ModalUse:
        """Return the modes that a range of blocks inherits from earlier blocks, and the modes that it sets."""
        relies: set[str] = set()
        sets: set[str] = set()
        for block in range(begin, end):
            words = self.words(block)
            if words is not None and words.empty and not self.kinds(block):
                continue
            if self._has_no_effect(block, words):
                continue
            if words is None or block in self.program.fixed or int(Kind.FOREIGN) in self.kinds(block):
                return ModalUse(frozenset(relies | (INHERITED - sets)), INHERITED)
            used, stated = self._modes_used_and_set(block, words)
            relies |= used - sets
            sets |= used | stated
            if len(sets) == len(INHERITED):
                break
        return ModalUse(frozenset(relies), frozenset(sets))

    def _has_no_effect(self, block: int, words: BlockWords | None) -> bool:
        if int(self.program.line[block]) in self._obeyed:
            return words is None or words.empty
        return words is not None and words.outputs and set(self.kinds(block)) == {int(Kind.FOREIGN)}

    def _modes_used_and_set(self, block: int, words: BlockWords) -> tuple[set[str], set[str]]:
        kinds, stated = set(self.kinds(block)), set(words.states)
        after = self.program.modal(block + 1)
        used: set[str] = set()
        if kinds & _MOVES and int(Kind.MACHINE) not in kinds:
            used |= {"motion", "incremental"}
        if kinds & _CUTS:
            used |= {"feed", "feed_mode"}
            if after.spindle:
                used.add("rpm")
        if self._lit_rapids and int(Kind.RAPID) in kinds and after.spindle:
            used.add("rpm")
        if kinds & _ARCS:
            used |= {"plane", "absolute_centres"}
        if words.starts_spindle:
            used.add("rpm")
        used -= stated
        if int(Kind.DRILL) in kinds:
            used |= {"to_initial", "plane"} - stated
            if any(letter not in words.letters for letter, _ in after.cycle_words):
                used.add("motion")
        return used, stated


HERE = "here"


def next_position(reader: BlockReader, blocks: Iterable[int], clearance: float) -> tuple[float, float] | str | None:
    """Return the first position in X and Y in `blocks`.

    If the blocks do not move in X or Y, the result is None. If they depend on the position before them, it is `HERE`.
    `clearance` is the height, mm, above which the tool may descend anywhere.
    """
    program = reader.program
    path, first = program.path, program.first
    stated: set[str] = set()
    # A dwell between cuts belongs to its position; a dwell next to a stop belongs to the stop.
    waits = stopped = False
    for block in blocks:
        words = reader.words(block)
        if words is not None and words.empty and not reader.kinds(block):
            continue
        if words is None or block in program.fixed:
            return HERE
        stated |= {"X", "Y"} & words.letters.keys()
        for row in range(int(first[block]), int(first[block + 1])):
            kind = Kind(int(path.kind[row]))
            x, y, z = path.end[row].tolist()
            if kind is Kind.END:
                return HERE if stated else None
            stopped |= kind in (Kind.TOOL, Kind.PAUSE, Kind.MACHINE)
            waits = (waits or kind is Kind.DWELL) and not stopped
            if kind is Kind.MACHINE:
                if math.isfinite(x) and math.isfinite(y):
                    return None
            elif kind in (Kind.RAPID, Kind.DRILL):
                if program.modal(block + 1).incremental:
                    return HERE
                if len(stated) == 2:
                    return HERE if waits else (x, y)
                if kind is Kind.DRILL or z < clearance - 1e-6:
                    return HERE
            elif kind in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.FRAME, Kind.SHIFT, Kind.RADIUS, Kind.FOREIGN):
                return HERE
    # If only one axis was stated, the other has not moved.
    return HERE if stated or waits else None


def depends_on_height(reader: BlockReader, blocks: Iterable[int]) -> bool:
    """Return whether the effect of `blocks` depends on the height of the tool before them."""
    program = reader.program
    drilled = False
    for block in blocks:
        words = reader.words(block)
        if words is not None and words.empty and not reader.kinds(block):
            continue
        if words is None or block in program.fixed:
            return True
        kinds = reader.kinds(block)
        after = program.modal(block + 1)
        if int(Kind.MACHINE) in kinds:
            row = int(program.first[block])
            if any(np.isfinite(program.path.end[row : int(program.first[block + 1]), 2])):
                return False
        if not set(kinds) & (_MOVES | {int(Kind.FOREIGN), int(Kind.SHIFT)}):
            continue
        if int(Kind.DRILL) in kinds and not after.incremental:
            # G99 leaves the height before the series for a G98 later in it.
            if after.to_initial:
                return True
            drilled = True
        elif drilled:
            return False
        elif after.incremental or set(kinds) != {int(Kind.RAPID)}:
            return True
        elif "Z" in words.letters:
            return False
    return False
