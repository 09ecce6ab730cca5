"""Explain why a fixed task keeps its position, and which line is the cause.

A task is fixed if every other task must come either before or after it. The reason is the rule that must be lifted for
the task to move. If no single rule is enough, the reason is a combination of rules.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.gcode.words import split_line
from leafcut.message import Message
from leafcut.model.sequence import Section, Sequence, StayGroup, StayReason
from leafcut.processes.program.plan.precedence import ties_at_edges

#: Messages by reason. `{cause}` stands for the cause, such as the kind of barrier.
PHRASES: dict[str, str] = {
    "frees": "because each may detach a part (a closed cut at the full depth of the mill)",
    "touches": "because cuts that touch keep their order",
    "passes": "because passes of a mill of unknown width keep their order",
    "inside": "because work inside an outline stays before or after that outline",
    "operation": "because CAM operations are not mixed (--mix-operations)",
    "holds": "with a block that stays ({cause})",
    "alone": "alone between barriers ({cause})",
    "only": "with no other work to swap with",
    "unknown-height": "because the approach height is unknown",
    "low": "because the tool does not retract far enough before them",
    "lit": "because the beam is still on at their end",
    "crossing": "alone between rapids at a greater height",
    "relative": "because the move to their start is incremental (G91)",
    "compensated": "because radius compensation is on during the move",
    "unknown-modes": "because a block may have changed all modes, and no G40 follows it",
    "goes-on": "because the fixed blocks after them start at their end point",
    "refused": "because another order was not proved ({cause})",
    "keep-order": "because of --algorithm none",
    "too-large": "because the program is too large to plan",
}
OPERATION = "operation"
#: Blocks are shortened to this length in messages, characters.
_MOST_LETTERS = 40
_NUMBER = re.compile(r"^[/ \t]*N[ \t]*[0-9]+(?:\.[0-9]+)?[ \t]*", re.IGNORECASE)


def stay_reasons(section: Section, apart: Iterable[int]) -> tuple[StayReason | None, ...]:
    """Return the reason why each task is fixed, or None if the task can move.

    `apart` contains the first task of each CAM operation whose work must not be mixed with other operations.
    """
    n = len(section.pieces)
    ties = dict(section.ties)
    operations = ties_at_edges(list(apart), n)
    if operations is not None:
        ties[OPERATION] = operations
    why: list[str] = [""] * n
    left = _immovable_tasks(list(ties.values()), n)
    for size in range(1, len(ties) + 1):
        for some in combinations(ties, size):
            if not left.any():
                break
            freed = left & ~_immovable_tasks([tie for cause, tie in ties.items() if cause not in some], n)
            for piece in np.flatnonzero(freed).tolist():
                why[piece] = "+".join(some)
            left &= ~freed
    lines = (piece.line for piece in section.pieces)
    return tuple(StayReason(reason, line) if reason else None for reason, line in zip(why, lines, strict=True))


def _immovable_tasks(ties: list[NDArray[np.int32]], n: int) -> NDArray[np.bool_]:
    """Return a mask of the tasks that cannot change places with any other task, bool[n].

    A task cannot move forward if every earlier task has to come before it, either directly or through a third task.
    """
    if not ties or n < 2:
        return np.zeros(n, dtype=bool)
    behind = np.minimum.reduce([tie[:, 0] for tie in ties])
    before = np.maximum.reduce([tie[:, 1] for tie in ties])
    numbers = np.arange(n)
    last = np.concatenate([[0], np.maximum.accumulate(behind)[:-1]])
    first = np.concatenate([np.minimum.accumulate(before[::-1])[::-1][1:], [n - 1]])
    held: NDArray[np.bool_] = (last <= numbers) & (first >= numbers)
    return held


def line_text(program: Program, line: int) -> str:
    """Return a program line without its line number and comments, shortened for a message."""
    text = program.lines[line - 1].strip() if 0 < line <= len(program.lines) else ""
    body, comments = split_line(text, nested=True) if text.count("(") == text.count(")") else (text, ())
    body = " ".join(_NUMBER.sub("", body).split())
    shown = body or (f"({comments[0]})" if comments else "")
    return shown if len(shown) <= _MOST_LETTERS else shown[: _MOST_LETTERS - 1] + "…"


def count_tasks(sequence: Sequence) -> int:
    """Count the tasks of a program."""
    return len(sequence.stays) + sum(len(section.pieces) for section in sequence.sections)


def group_stay_reasons(
    sequence: Sequence, refused: Mapping[tuple[int, int], str], keep_order: bool
) -> tuple[StayGroup, ...]:
    """Group the fixed tasks by reason, with the largest group first.

    `refused` maps (section number, task number) to the reason why the task could not be written in a new order.
    """
    stays = list(sequence.stays)
    for number, section in enumerate(sequence.sections):
        for place, piece in enumerate(section.pieces):
            stay = section.stays[place] if section.stays else None
            if stay is None and keep_order:
                stay = StayReason("keep-order", piece.line)
            elif stay is None and (number, place) in refused:
                stay = StayReason("refused", piece.line, cause=refused[number, place])
            stays += [] if stay is None else [stay]
    groups: dict[tuple[str, str], list[StayReason]] = {}
    for stay in stays:
        groups.setdefault((stay.reason, stay.cause), []).append(stay)
    found = []
    for (reason, cause), alike in groups.items():
        first = min(alike, key=lambda stay: stay.line)
        found.append(
            StayGroup(reason, len(alike), first.line, first.word, _group_text(reason, cause, len(alike), first))
        )
    return tuple(sorted(found, key=lambda s: (-s.count, s.first_line)))


def _group_text(reason: str, cause: str, number: int, first: StayReason) -> str:
    text = " and ".join(PHRASES[name].format(cause=cause) for name in reason.split("+")).replace(" and because", " and")
    where = f"{first.word} at line {first.line}" if first.word else Message("line {}", first.line)
    return f"{text}: {'first ' if number > 1 else ''}{where}"
