"""Find the pairs of cuts and holes that must keep their order. The order rules run with the thresholds `KEEP`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import tool_diameter_in_comments
from leafcut.geometry.index import connected_components, unique_pairs
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import ProgramTask
from leafcut.processes.program.plan.program_rows import Rows
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.order_rules import (
    LEVEL,
    Visits,
    build_visits,
    detaching_visits,
    line_index,
    nearby_passes,
    rows_in_order,
)
from leafcut.processes.program.proof.order_thresholds import KEEP
from leafcut.processes.program.proof.outlines import (
    BEAM_TAB,
    MILL_TAB,
    TOUCHING,
    Line,
    lines_starting_inside,
    outlines_of,
    task_lines,
)
from leafcut.processes.program.proof.program_work import has_no_mill
from leafcut.processes.program.proof.traces import Traces, traces_of

#: Number of tasks that share one integer as a bit set.
_BITS = 8192
#: A pair consists of a task and a later task that detaches a part. More pairs than this would slow down the search.
_MOST_PAIRS = 50_000
#: Reasons to keep an order: two cuts touch, two passes of a mill of unknown width, work inside an outline, a detached
#: part.
TOUCHES, PASSES, INSIDE, FREES = "touches", "passes", "inside", "frees"


class Precedence(NamedTuple):
    """The tasks of a section with their precedence.

    Tasks that detach a part are marked. The class also holds the pairs of tasks that must keep their order, and
    `Section.ties`.
    """

    pieces: tuple[ProgramTask, ...]
    pairs: NDArray[np.int32]
    ties: dict[str, NDArray[np.int32]]


class _OrderRuleInput:
    """Input of the order rules. The tasks of several sections are concatenated.

    `owner` (int64[m]) is the task of each feature. `section` (int64[n]) is the section of each task.
    """

    def __init__(self, program: Program, rows: Rows, sections: Sequence[Sequence[ProgramTask]]) -> None:
        self.program, self.rows = program, rows
        self.sections = sections
        self.pieces = [piece for pieces in sections for piece in pieces]
        self.section = np.repeat(np.arange(len(sections)), [len(pieces) for pieces in sections])
        begin, end = program.first[np.array([(piece.begin, piece.end) for piece in self.pieces]).T]
        row = rows.features.row
        low, high = np.searchsorted(row, [begin[0], end[-1]])
        owner = np.searchsorted(begin, row[low:high], side="right") - 1
        inside = row[low:high] < end[owner]
        self.features: Features = rows.features.pick(low + np.flatnonzero(inside))
        self.owner = owner[inside]
        self.traces: Traces = traces_of(self.features)

    def lines(self) -> list[Line]:
        """Return the lines of all tasks. A task without lines is represented by its start point."""
        lines = list(task_lines(self.features, self.traces, self.owner, KEEP.sagitta))
        without = set(range(len(self.pieces))) - {line.owner for line in lines}
        return lines + [Line(number, np.array([self.pieces[number].entry] * 2)) for number in sorted(without)]

    def visits(self) -> Visits:
        visits = build_visits(self.features, self.traces, self.owner, len(self.pieces), KEEP)
        entries = np.array([piece.entry for piece in self.pieces], dtype=np.float64)
        return replace(visits, start=entries, bottom=np.array([piece.bottom for piece in self.pieces]))


def with_precedence(
    program: Program,
    rows: Rows,
    pieces: Sequence[ProgramTask],
    process: str,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> Precedence:
    """Mark the tasks that detach a part, and find the pairs that must keep their order.

    - Cuts keep their order if they are closer than the tool width, which comes from a comment or from `rows`. If the
      width is unknown, the distance is `TOUCHING`. Examples are repeated passes, finishing passes and holes drilled
      twice.
    - A closed cut stays after the earlier work inside it. With a mill, later work inside it also stays after it,
      because the closed cut may be a roughing pass.
    - A task that detaches a part stays after all earlier work.

    Pairs that follow from other pairs are left out.
    """
    n = len(pieces)
    work = _OrderRuleInput(program, rows, [pieces])
    causes = _related_pairs(work, process, check_cancelled)
    marked = _mark_detaching_tasks(work, process, check_cancelled)
    causes[FREES] = work_before_detaching(marked)
    ties = {cause: ties_from_pairs(pairs, n) for cause, pairs in causes.items() if len(pairs)}
    stages = ties_at_edges(detaching_stages(marked), n)
    if stages is not None:
        ties[FREES] = combine_ties(ties.get(FREES, no_ties(n)), stages)
    return Precedence(marked, _transitive_reduction(np.concatenate(list(causes.values())), n, check_cancelled), ties)


def are_related(
    program: Program,
    rows: Rows,
    sections: Sequence[Sequence[ProgramTask]],
    process: str,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> bool:
    """Return whether any two tasks in different sections must keep their order."""
    return any(map(len, _related_pairs(_OrderRuleInput(program, rows, sections), process, check_cancelled).values()))


def _related_pairs(work: _OrderRuleInput, process: str, check_cancelled: Heartbeat) -> dict[str, NDArray[np.int64]]:
    """Find the pairs of tasks whose order matters, grouped by cause, int64[k, 2].

    If there are several sections, only pairs of tasks in different sections are returned.
    """
    across = len(work.sections) > 1
    widths = [
        tool_diameter_in_comments(work.program, pieces[0].begin) or work.rows.tool_diameter for pieces in work.sections
    ]
    lines = work.lines()
    near, owner = line_index(lines)

    def wanted(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        chosen: NDArray[np.bool_] = (work.section[a] < work.section[b]) if across else (a < b)
        return chosen

    pairs: dict[str, list[NDArray[np.int64]]] = {TOUCHES: [], PASSES: [], INSIDE: []}
    reach = TOUCHING + 2 * KEEP.sagitta + max(widths)
    for a, b in near.pairs(near, reach, lambda a, b: wanted(owner[a], owner[b])):
        check_cancelled()
        pairs[TOUCHES].append(unique_pairs(owner[a], owner[b]))
    if process not in BEAMS and not all(widths):
        visits = work.visits()
        for _, found in nearby_passes(visits, near, owner, KEEP, np.inf, wanted):
            check_cancelled()
            pairs[PASSES].append(found)
        if not across:
            pairs[PASSES].append(rows_in_order(visits, KEEP))
    tab = BEAM_TAB if process in BEAMS else MILL_TAB
    # With a beam, work inside a part that was already cut out can be reordered.
    both_ways = process not in BEAMS or not has_no_mill(work.program)
    for number in range(len(work.sections)):
        mine = [line for line in lines if work.section[line.owner] == number]
        outlines = list(outlines_of(mine, tab, KEEP, check_cancelled))
        for outline, inner in lines_starting_inside(lines, outlines):
            outer = np.array(outline.owners)
            found = np.array(np.meshgrid(inner, outer)).reshape(2, -1).T
            pairs[INSIDE] += [found[wanted(*found.T)], found[wanted(*found.T[::-1])][:, ::-1]][: 1 + both_ways]
    return {cause: _distinct_pairs(found) for cause, found in pairs.items()}


def _distinct_pairs(pairs: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    every = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
    return unique_pairs(every[:, 0], every[:, 1])


def _mark_detaching_tasks(work: _OrderRuleInput, process: str, check_cancelled: Heartbeat) -> tuple[ProgramTask, ...]:
    """Mark the tasks that detach a part. For a mill, the deepest sideways cut defines the underside of the material."""
    pieces = tuple(work.pieces)
    if process in BEAMS or has_no_mill(work.program):
        return pieces
    deepest = work.rows.deepest[work.program.before[pieces[0].begin]]
    visits = work.visits()
    above = np.where([piece.kind == "cut" for piece in pieces], visits.bottom - deepest, np.inf)
    if not (above <= KEEP.through).any():
        return pieces
    detaches = detaching_visits(work.features, work.traces, visits, work.owner, above, KEEP, check_cancelled)
    return tuple(
        replace(piece, may_detach=may, detaches=may and surely) if may else piece
        for piece, may, surely in zip(pieces, *(mask.tolist() for mask in detaches), strict=True)
    )


def detaching_stages(pieces: Sequence[ProgramTask]) -> list[int]:
    """Find the stages in which every task detaches a part, and return the first task of each stage in ascending order.

    No task moves across the start of such a stage, so each stage becomes a section of its own.
    """
    may, detaches, bottoms = _detaching_columns(pieces)
    if not may.any():
        return []
    only = np.logical_and.accumulate(may[::-1])[::-1]
    # Pieces that certainly detach a part may change places with each other.
    lowest = np.minimum.accumulate(np.where(detaches, bottoms, np.inf))[:-1]
    highest = np.maximum.accumulate(bottoms[::-1])[::-1][1:]
    found: list[int] = (1 + np.flatnonzero(only[1:] & (lowest > highest + LEVEL))).tolist()
    return found


def work_before_detaching(pieces: Sequence[ProgramTask]) -> NDArray[np.int64]:
    """Pair each task with the later tasks that detach a part. Return the pairs (before, after), int64[k, 2].

    Tasks that detach parts at the same depth may change places. Pairs of tasks in different stages are left out. If
    there are too many pairs, the parts are detached in the original order.
    """
    may, detaches, bottoms = _detaching_columns(pieces)
    found = []
    for low, high in pairwise([0, *detaching_stages(pieces), len(pieces)]):
        after = low + np.flatnonzero(may[low:high])
        many = (after - low).sum() > _MOST_PAIRS
        for first, last in pairwise([low, *after.tolist()]):
            earlier = np.arange(first if many else low, last)
            alike = detaches[earlier] & (bottoms[earlier] <= bottoms[last] + KEEP.same_depth) & (not many)
            found.append(np.column_stack([earlier[~alike], np.full(np.count_nonzero(~alike), last)]))
    return np.concatenate(found) if found else np.zeros((0, 2), dtype=np.int64)


def _detaching_columns(
    pieces: Sequence[ProgramTask],
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float64]]:
    may, detaches = (np.array([getattr(c, name) for c in pieces], dtype=bool) for name in ("may_detach", "detaches"))
    return may, detaches, np.array([c.bottom for c in pieces], dtype=np.float64)


def ties_from_pairs(pairs: NDArray[np.int64], n: int) -> NDArray[np.int32]:
    """Compute `Section.ties` for n tasks from the pairs (before, after), int64[k, 2]."""
    ties = no_ties(n)
    np.minimum.at(ties[:, 0], pairs[:, 0], pairs[:, 1].astype(np.int32))
    np.maximum.at(ties[:, 1], pairs[:, 1], pairs[:, 0].astype(np.int32))
    return ties


def no_ties(n: int) -> NDArray[np.int32]:
    """Return `Section.ties` for n tasks that may run in any order."""
    return np.tile(np.array([n, -1], dtype=np.int32), (n, 1))


def combine_ties(one: NDArray[np.int32], other: NDArray[np.int32]) -> NDArray[np.int32]:
    """Combine the ties from two causes. Each task keeps its nearer tie."""
    return np.stack([np.minimum(one[:, 0], other[:, 0]), np.maximum(one[:, 1], other[:, 1])], axis=1)


def ties_at_edges(edges: Sequence[int], n: int) -> NDArray[np.int32] | None:
    """Compute `Section.ties` for n tasks that must not cross the given edges, or return None if there are no edges.

    An edge is a task number. All earlier tasks stay before that task and all tasks after it.
    """
    inner = [edge for edge in edges if 0 < edge < n]
    if not inner:
        return None
    ends = np.array([*inner, n], dtype=np.int32)
    part = np.searchsorted(ends, np.arange(n), side="right")
    return np.stack([ends[part], np.array([0, *inner], dtype=np.int32)[part] - 1], axis=1).astype(np.int32)


def _transitive_reduction(
    pairs: NDArray[np.int64], n: int, check_cancelled: Heartbeat = ignore_heartbeat
) -> NDArray[np.int32]:
    """Remove the pairs that follow from other pairs (transitive reduction).

    Each pair leads from a lower to a higher number. Connected groups of tasks are reduced separately, in blocks of
    `_BITS` tasks, so that memory grows linearly with n.
    """
    if not len(pairs):
        return np.zeros((0, 2), dtype=np.int32)
    group = connected_components(n, pairs[:, 0], pairs[:, 1])
    # Sort pieces by group, so that connected pieces have nearby numbers.
    order = np.argsort(group, kind="stable")
    rank = np.empty(n, dtype=np.int64)
    rank[order] = np.arange(n)
    pairs = unique_pairs(*rank[pairs].T)
    stop = np.searchsorted(group[order], group[order], side="right")
    kept: list[tuple[int, int]] = []
    by_after = pairs[np.lexsort([-pairs[:, 0], pairs[:, 1]])]
    for low in range(0, n, _BITS):
        check_cancelled()
        high = min(low + _BITS, n)
        first, last = np.searchsorted(by_after[:, 1], [low, stop[high - 1]])
        kept += _reduced_pairs(by_after[first:last].tolist(), low, high)
    whole = order[np.array(kept, dtype=np.int64)]
    return whole[np.lexsort([-whole[:, 0], whole[:, 1]])].astype(np.int32)


def _reduced_pairs(pairs: list[list[int]], low: int, high: int) -> list[tuple[int, int]]:
    """Return the pairs with low ≤ before < high that do not follow from other pairs.

    The caller sorts `pairs` by after, then by −before.
    """
    # Bit k of `ancestors[i]`: piece low + k must come before piece i.
    ancestors: dict[int, int] = {}
    kept = []
    for before, after in pairs:
        known = ancestors.get(after, 0)
        if low <= before < high and not known >> (before - low) & 1:
            kept.append((before, after))
            known |= 1 << (before - low)
        known |= ancestors.get(before, 0)
        if known:
            ancestors[after] = known
    return kept
