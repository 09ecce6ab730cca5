"""Find the CAM operations of a program by its comments, and divide sections at them.

A comment line between two pieces of work starts an operation unless it labels a single piece. A comment is a label if
the same text, apart from its numbers, occurs often and is followed by one or two pieces each time. Consecutive comments
with one piece each are labels too.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from statistics import median

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.gcode.words import plain_block
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import FixedBlocks, Section, Sequence
from leafcut.model.toolpath import last_rows
from leafcut.processes.program.plan.fixed_tasks import why_pieces_stay
from leafcut.processes.program.plan.precedence import detaching_stages
from leafcut.processes.program.plan.program_rows import Rows

#: Minimum number of occurrences and maximum median number of pieces of a comment that labels pieces.
_OFTEN, _FEW = 3, 2

_NUMBERS = re.compile(r"[-+]?[0-9]*\.?[0-9]+")
_WORD = re.compile(r"[^\W\d_]{2}")


def divide_at_operations(program: Program, sequence: Sequence, rows: Rows, mix_operations: bool) -> Sequence:
    """Divide the sections at CAM operations, and before the cuts that detach parts.

    Cuts that detach parts and have no other work after them form a section of their own. Operations are ignored for
    lasers and torches, and with `mix_operations`.
    """
    items: list[FixedBlocks | Section] = []
    for item in sequence.items:
        if not isinstance(item, Section):
            items.append(item)
            continue
        apart = set() if mix_operations or sequence.process in BEAMS else set(_operations(program, item, rows))
        edges = sorted({0, *apart, *detaching_stages(item.pieces), len(item.pieces)})
        whole = replace(item, stays=why_pieces_stay(item, sorted(apart)))
        items += [_subsection(whole, low, high) for low, high in pairwise(edges)]
    return replace(sequence, items=tuple(items))


def _subsection(section: Section, low: int, high: int) -> Section:
    if high - low == len(section.pieces):
        return section
    pairs = section.precedence
    inside = ((pairs >= low) & (pairs < high)).all(axis=1)
    return replace(
        section,
        pieces=section.pieces[low:high],
        precedence=pairs[inside] - np.int32(low),
        start=section.start if not low else None,
        end=section.end if high == len(section.pieces) else None,
        stays=section.stays[low:high],
    )


def _operations(program: Program, section: Section, rows: Rows) -> list[int]:
    """Return the first piece of every operation except the first."""
    pieces = section.pieces
    last_cut = np.concatenate([[-1], last_rows(rows.cut)])
    texts = {k: text for k in range(len(pieces)) if (text := _comments_before(program, section, rows, k, last_cut))}
    begins = sorted({0, *texts})
    sizes = dict(zip(begins, np.diff([*begins, len(pieces)]).tolist(), strict=True))
    of_text: dict[str, list[int]] = defaultdict(list)
    for k, text in texts.items():
        of_text[text].append(sizes[k])
    labels = {text for text, found in of_text.items() if len(found) >= _OFTEN and median(found) <= _FEW}
    begins = [k for k in begins if k == 0 or texts.get(k) not in labels]
    sizes = dict(zip(begins, np.diff([*begins, len(pieces)]).tolist(), strict=True))
    return [b for a, b in pairwise(begins) if sizes[a] > 1 or sizes[b] > 1]


def _comments_before(program: Program, section: Section, rows: Rows, number: int, last_cut: NDArray[np.int64]) -> str:
    """Return the comments between the previous cut and the first travel move of a piece, as one text.

    Numbers are replaced, so that numbered labels give the same text. `last_cut` is the last cut before each row, or -1.
    """
    piece, line = section.pieces[number], program.text_line
    first, last = int(program.first[piece.begin]), int(program.first[piece.end])
    worked = last_cut[first]
    low = int(line[program.row_block[worked]]) if worked >= 0 else 0
    ways = np.flatnonzero(rows.travel[first:last])
    high = int(line[program.row_block[first + int(ways[0])]]) if len(ways) else int(line[piece.begin])
    comments = []
    for text in program.lines[low : high - 1]:
        if "(" not in text and ";" not in text:
            continue
        block = plain_block(text)
        if block is not None and all(word.letter == "N" for word in block.words) and not block.deleted:
            comments += [comment for comment in block.comments if _WORD.search(comment)]
    return " ".join(_NUMBERS.sub("#", " ".join(comments)).upper().split())
