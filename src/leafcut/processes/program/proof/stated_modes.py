"""Check that the new program states the modes of a safe start line: G90, G17, G40, G94 and others.

A mode that is not stated keeps the last state of the machine, which a comparison of motion does not show.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from leafcut.gcode.block_description import normalized
from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Indices, Mask
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.barriers import Barrier
from leafcut.processes.program.proof.program_work import ProgramWork

#: Kinds of rows that rely on a mode; an unknown block may rely on any mode.
_ARCS = (Kind.FOREIGN, Kind.ARC_CW, Kind.ARC_CCW)
_CYCLES = (Kind.FOREIGN, Kind.DRILL)
_ROUND = (*_ARCS, Kind.DRILL)
_CUTS = (*_ROUND, Kind.FEED)
_MOVES = (*_CUTS, Kind.RAPID)


class _Mode(NamedTuple):
    """A mode: its name, its G words (a regular expression for their numbers), and the kinds of rows that need it.

    A `rare` word is unknown to some controllers, so the new program must not add it.
    """

    name: str
    words: str
    kinds: tuple[Kind, ...]
    rare: bool = False


_MODES = (
    _Mode(Message("the distance mode (G90, G91)"), "9[01]", _MOVES),
    _Mode(Message("the plane (G17)"), "1[789]", _ROUND),
    _Mode(Message("radius compensation off (G40)"), "4[012](?:[.]1)?", _MOVES),
    _Mode(Message("the feed mode (G94)"), "9[345]", _CUTS),
    _Mode(Message("the arc distance mode (G91.1)"), "9[01][.]1", _ARCS),
    _Mode(Message("the return of cycles (G98, G99)"), "9[89]", _CYCLES),
    _Mode(Message("the length offset (G43, G49)"), "4[349](?:[.][0-9])?", _MOVES),
    _Mode(Message("the work offset (G54)"), "(?:5[4-9](?:[.][1-9])?|154|1[12][0-9])", _MOVES),
    _Mode(Message("constant surface speed off (G97)"), "9[67]", _CUTS),
    _Mode(Message("rotation off (G69)"), "6[89](?:[.][0-9])?", _MOVES, True),
    _Mode(Message("scaling off (G50)"), "5[01]", _MOVES, True),
    _Mode(Message("mirroring off (G50.1)"), "5[01][.]1", _MOVES, True),
    _Mode(Message("polar coordinates off (G15)"), "1[56]", _MOVES, True),
    _Mode(Message("macro calls off (G67)"), "6[67](?:[.]1)?", _MOVES, True),
    _Mode(Message("the shift of the origin (G92.1)"), "92(?:[.][123])?", _MOVES, True),
)
#: A G word except G0 to G3; numbers may contain blanks.
_OTHER = re.compile(r"[Gg](?![ \t]*0*[0-3](?![ \t]*[0-9.]))")
_PATTERNS = [re.compile(rf"G0*{mode.words}(?![0-9.])") for mode in _MODES]


def find_lost_modes(
    programs: tuple[Program, Program],
    works: tuple[ProgramWork, ProgramWork],
    new_of: Indices,
    mark_of: dict[float, Barrier],
) -> Iterator[Difference]:
    """Yield the modes that only the original program states before the work that depends on them.

    `new_of` and `mark_of` are the matched features and barriers. Only cuts in both programs count, because an added cut
    depends on the same modes as its neighbours.
    """
    words = [_lines_with_g_words(program) for program in programs]
    counted = _common_rows(works, new_of, mark_of)
    for mode, pattern in zip(_MODES, _PATTERNS, strict=True):
        was, now = (_first_use(*side, mode, pattern) for side in zip(programs, works, words, counted, strict=True))
        if (now.first and not was.first) or now.cuts > was.cuts:
            text = Message(
                "{}: the original states this mode before line {}, which relies on it; the new program does not",
                mode.name,
                now.line or was.line,
            )
            yield Difference(Message("not stated"), was.line, now.line, text)
        elif mode.rare and was.first and not now.first:
            text = Message(
                "{}: the new program states this mode before line {}, which relies on it; the original does not",
                mode.name,
                was.line,
            )
            yield Difference(Message("newly stated"), was.line, now.line, text)


def _common_rows(
    works: tuple[ProgramWork, ProgramWork], new_of: Indices, mark_of: dict[float, Barrier]
) -> tuple[Mask, Mask]:
    """Return masks of the rows that both programs have. If no work is missing or new, return all rows."""
    old = np.flatnonzero(new_of >= 0)
    features = old, new_of[old]
    keys = set(mark_of), {mark.key for mark in mark_of.values()}
    masks = []
    whole = True
    for work, paired, known in zip(works, features, keys, strict=True):
        foreign = [mark for mark in work.marks if mark.kind == Kind.FOREIGN]
        same = [int(mark.key) for mark in foreign if mark.key in known]
        mask = np.zeros(len(work.path), dtype=bool)
        mask[work.features.row[paired]] = True
        mask[same] = True
        masks.append(mask)
        whole &= len(paired) == len(work.features) and len(same) == len(foreign)
    if whole:
        for mask in masks:
            mask[:] = True
    return masks[0], masks[1]


class _FirstUse(NamedTuple):
    """The first use of a mode: whether the first row that depends on the mode comes before the word, the line of that
    row, and the number of cuts before the word.
    """

    first: bool
    line: int
    cuts: int


def _lines_with_g_words(program: Program) -> dict[int, str]:
    """Return the normalized text of all lines with a G word other than G0 to G3, by line number."""
    return {number: normalized(text) for number, text in enumerate(program.lines, 1) if _OTHER.search(text)}


def _first_use(
    program: Program, work: ProgramWork, words: dict[int, str], counted: Mask, mode: _Mode, pattern: re.Pattern[str]
) -> _FirstUse:
    path = program.path
    rows = np.flatnonzero(np.isin(path.kind, mode.kinds))
    if not len(rows):
        return _FirstUse(False, 0, 0)
    block = int(program.row_block[rows[0]])
    stating = _first_block_on(program, [number for number, text in words.items() if pattern.search(text)])
    if stating <= block:
        return _FirstUse(False, int(path.line[rows[0]]), 0)
    return _FirstUse(
        True, int(path.line[rows[0]]), _cuts_before(program, work, int(program.first[stating]), counted, mode)
    )


def _cuts_before(program: Program, work: ProgramWork, end: int, counted: Mask, mode: _Mode) -> int:
    kinds = [kind for kind in mode.kinds if kind in _CUTS]
    if Kind.FEED in kinds:
        return int((np.isin(work.path.kind, kinds) & (work.source < end) & counted).sum())
    # The feed moves of an expanded cycle rely on fewer modes than the cycle.
    rows = np.unique(work.source[counted & (work.source < end)])
    return int(np.isin(program.path.kind[rows[rows < len(program.path)]], kinds).sum())


def _first_block_on(program: Program, lines: list[int]) -> int:
    """Return the first block on any of the given lines, or the number of blocks."""
    found = np.isin(program.line, lines)
    return int(np.argmax(found)) if found.any() else program.n_blocks
