"""Resequencing: what of a foreign program may be put into another order, and what must stay.

    find_sequence(program) -> Sequence          pieces
    build_problem(section, metric, start, end)  the routing problem of one section
    piece_order(section, nodes)                 what its solution says

A piece of work is everything from the rapid that brings the tool over a place to the next such rapid. Within one tool,
one offset, one spindle speed, one clearance height, the order of pieces is taken to be free, but for those whose cuts
touch, and for what an outer cut would set free. Whatever else stands in the program stays where it is, word for word.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError, nearest
from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Point
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import ProgramKind
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sequence import Kept, Section, Sequence, Stay
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.sections.find_sections import STAYING, Finder
from leafcut.processes.program.plan.sections.merging import changes_saved, merge_sections
from leafcut.processes.program.plan.sections.operations import keep_apart
from leafcut.processes.program.plan.sections.program_rows import known_process, read_rows


def find_sequence(
    program: Program,
    *,
    process: str = "auto",
    merge_tools: bool = False,
    allow_reverse: bool = False,
    mix_operations: bool = False,
    look: Heartbeat = unseen,
) -> Sequence:
    """Return the program as sections whose pieces of work can be reordered, and all that stays.

    Parameters
    ----------
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``; ``auto`` takes what the program tells.
    merge_tools
        Join sections of one tool where nothing between them forbids it, which saves changes of tool.
    allow_reverse
        Let open cuts at one depth be made from either end (`reversing`).
    mix_operations
        Let the work of several operations of the CAM be mixed (`sections.operations`).
    look
        Called as it goes on.

    Raises
    ------
    PlanError
        There is no such process.
    """
    if process != "auto" and process not in tuple(ProgramKind):
        raise PlanError(f"unknown process '{process}'{nearest(process, ['auto', *ProgramKind])}")
    found = known_process(program) if process == "auto" else process
    finder = Finder(program, found, look)
    items = finder.items()
    stays = tuple(stay for item in items if isinstance(item, Kept) for stay in finder.stays(item))
    sequence = Sequence(tuple(items), found, (), tuple(_issues(finder, items)), stays=stays)
    if merge_tools:
        sequence = merge_sections(program, sequence, finder.rows, look)
    else:
        sequence = replace(sequence, mergeable=changes_saved(program, sequence, finder.rows, look))
    sequence = keep_apart(program, sequence, finder.rows, mix_operations)
    if allow_reverse:
        from leafcut.processes.program.plan.reversing import with_reversible

        sequence = with_reversible(program, sequence, finder.rows)
    return sequence


def all_stay(program: Program, process: str, reason: str) -> Sequence:
    """Return the program as one piece that stays, for one reason (`precedence.staying.PHRASES`)."""
    rows = read_rows(program, process)
    ways, cuts = np.cumsum(rows.travel), np.flatnonzero(rows.cut)
    begins = cuts[np.flatnonzero(np.diff(ways[cuts], prepend=-1))]
    lines = program.line[rows.block[begins]].tolist()
    return Sequence((Kept(0, program.n_blocks),), process, stays=tuple(Stay(reason, line) for line in lines))


def build_problem(section: Section, metric: Metric, start: Point | None, end: Point | None) -> RoutingProblem:
    """Return the routing problem of a section: every piece is a cluster.

    Its first node goes from the piece's entry to its exit. Those pieces that may be made from the other end have a
    second one; these nodes stand behind all first ones, in the order of the pieces.
    """
    entry = np.array([c.entry for c in section.pieces], dtype=np.float64).reshape(-1, 2).round(6)
    leave = np.array([c.exit for c in section.pieces], dtype=np.float64).reshape(-1, 2).round(6)
    both = _reversible(section)
    cluster = np.concatenate([np.arange(len(entry), dtype=np.int32), both])
    tool = "" if section.tool is None else f" T{section.tool}"
    return RoutingProblem(
        np.concatenate([entry, leave[both]]),
        np.concatenate([leave, entry[both]]),
        cluster,
        np.zeros(len(cluster)),
        metric,
        section.precedence,
        start,
        end,
        name=f"line {section.pieces[0].line}{tool}",
    )


def piece_order(section: Section, nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the pieces int32[n] in the order of the nodes of `build_problem`; ~k is piece k from its other end."""
    piece = np.concatenate([np.arange(len(section.pieces), dtype=np.int32), ~_reversible(section)])
    order: NDArray[np.int32] = piece[nodes]
    return order


def nodes_in_order(section: Section, order: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the nodes int32[n] of `build_problem` that give an order of pieces: the inverse of `piece_order`."""
    reversible = _reversible(section)
    turned = len(section.pieces) + np.searchsorted(reversible, ~order)
    nodes: NDArray[np.int32] = np.where(order < 0, turned, order).astype(np.int32)
    return nodes


def speeds_of(program: Program, section: Section) -> NDArray[np.float64]:
    """Return with how many revolutions per minute each piece of a section begins its work, float64[n]."""
    kind, first = program.path.kind, program.first
    ends = np.array([(piece.begin, piece.end) for piece in section.pieces], dtype=np.intp).reshape(-1, 2)
    begin, end = first[ends].T
    low, high = int(begin.min(initial=len(kind))), int(end.max(initial=0))
    works = low + np.flatnonzero((kind[low:high] >= Kind.FEED) & (kind[low:high] <= Kind.DRILL))
    # All at once: a search for one row of the whole program would look through a copy of it.
    work = np.append(works, len(kind))[np.searchsorted(works, begin)]
    blocks = np.searchsorted(first, np.where(work < end, work, begin), side="right")
    return np.array([program.modal(block).rpm for block in blocks.tolist()], dtype=np.float64)


def _reversible(section: Section) -> NDArray[np.int32]:
    return np.array([k for k, c in enumerate(section.pieces) if c.reversible], dtype=np.int32)


def _issues(finder: Finder, items: list[Kept | Section]) -> list[Issue]:
    """Return one note for every reason for which work stays, or one that says why all of it does."""
    where: dict[str, list[int]] = {}
    for item in items:
        if isinstance(item, Kept):
            for reason in item.reasons:
                if reason == STAYING:
                    continue
                where.setdefault(reason, []).append(finder.line_of(item, reason))
    issues = []
    if not any(isinstance(item, Section) for item in items):
        # Work that stays for the way it is reached, not for a line of its own, is told piece by piece (`Finder.stays`).
        told = where or any(isinstance(item, Kept) and item.reasons for item in items)
        why = "" if told else ": " + next(iter(finder.program.fixed.values()), "it contains no work")
        issues.append(Issue("L502", f"nothing in the program can be reordered{why}", severity=Severity.NOTE))
    for reason, lines in where.items():
        times = (
            ("", ", here and once more")[len(lines) - 1]
            if len(lines) < 3
            else f", here and {len(lines) - 1} times more"
        )
        issues.append(Issue("L501", f"stays in its place: {reason}{times}", f"line {lines[0]}", Severity.NOTE))
    return issues
