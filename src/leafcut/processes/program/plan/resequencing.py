"""Find the cuts and holes of a program from another CAM system that can be reordered, and the blocks that must stay.

A piece of work (a cut or a hole) extends from the rapid to its start point to the next such rapid. All blocks outside
pieces of work keep their position and their text.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError, name_suggestion
from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Point
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import ProgramKind
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sequence import FixedBlocks, Section, Sequence, StayReason
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.find_sections import STAYING, SectionFinder
from leafcut.processes.program.plan.merging import changes_saved, merge_sections
from leafcut.processes.program.plan.operations import divide_at_operations
from leafcut.processes.program.plan.program_rows import detect_process, read_rows
from leafcut.processes.program.plan.reversing import with_reversible


def find_sequence(
    program: Program,
    *,
    process: str = "auto",
    merge_tools: bool = False,
    allow_reverse: bool = False,
    mix_operations: bool = False,
    tool_diameter: float = 0.0,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> Sequence:
    """Divide a program into sections of pieces of work that can be reordered, and blocks that stay.

    Parameters
    ----------
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``; ``auto`` detects it. An unknown value raises PlanError.
    merge_tools
        Merge sections with the same tool if nothing between them forbids it, to save tool changes.
    allow_reverse
        Allow open cuts at one depth to start at either end (`reversing`).
    mix_operations
        Allow work of different CAM operations to be mixed (`operations`).
    tool_diameter
        Diameter of the mills that no comment describes, mm; 0 if it is unknown.
    """
    if process != "auto" and process not in tuple(ProgramKind):
        raise PlanError("unknown process '{}'{}", process, name_suggestion(process, ["auto", *ProgramKind]))
    found = detect_process(program) if process == "auto" else process
    finder = SectionFinder(program, found, check_cancelled, tool_diameter=tool_diameter)
    items = finder.items()
    stays = tuple(stay for item in items if isinstance(item, FixedBlocks) for stay in finder.stays(item))
    sequence = Sequence(tuple(items), found, (), tuple(_issues(finder, items)), stays=stays)
    if merge_tools:
        sequence = merge_sections(program, sequence, finder.rows, check_cancelled)
    else:
        sequence = replace(sequence, mergeable=changes_saved(program, sequence, finder.rows, check_cancelled))
    sequence = divide_at_operations(program, sequence, finder.rows, mix_operations)
    if allow_reverse:
        sequence = with_reversible(program, sequence, finder.rows)
    return sequence


def unchanged_sequence(program: Program, process: str, reason: str) -> Sequence:
    """Return a sequence in which all work keeps its position for one `reason`, a key of `fixed_tasks.PHRASES`."""
    rows = read_rows(program, process)
    ways, cuts = np.cumsum(rows.travel), np.flatnonzero(rows.cut)
    begins = cuts[np.flatnonzero(np.diff(ways[cuts], prepend=-1))]
    lines = program.line[program.row_block[begins]].tolist()
    return Sequence(
        (FixedBlocks(0, program.n_blocks),), process, stays=tuple(StayReason(reason, line) for line in lines)
    )


def build_problem(section: Section, metric: Metric, start: Point | None, end: Point | None) -> RoutingProblem:
    """Return the routing problem of a section, with one cluster per piece of work.

    The first node of a piece leads from its entry to its exit. A reversible piece has a second node for the opposite
    direction. The second nodes follow all first nodes, in the order of the pieces.
    """
    entry = np.array([c.entry for c in section.pieces], dtype=np.float64).reshape(-1, 2).round(6)
    leave = np.array([c.exit for c in section.pieces], dtype=np.float64).reshape(-1, 2).round(6)
    both = _reversible_tasks(section)
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
        name=Message("line {}{}", section.pieces[0].line, tool),
    )


def piece_order(section: Section, nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the pieces of work in the order of the nodes of `build_problem`, int32[n]; ~k means piece k reversed."""
    piece = np.concatenate([np.arange(len(section.pieces), dtype=np.int32), ~_reversible_tasks(section)])
    order: NDArray[np.int32] = piece[nodes]
    return order


def nodes_in_order(section: Section, order: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the nodes of `build_problem` for an order of pieces, int32[n]: the inverse of `piece_order`."""
    reversible = _reversible_tasks(section)
    turned = len(section.pieces) + np.searchsorted(reversible, ~order)
    nodes: NDArray[np.int32] = np.where(order < 0, turned, order).astype(np.int32)
    return nodes


def speeds_of(program: Program, section: Section) -> NDArray[np.float64]:
    """Return the spindle speed at the first cut of each piece of work in a section, rpm, float64[n]."""
    kind, first = program.path.kind, program.first
    ends = np.array([(piece.begin, piece.end) for piece in section.pieces], dtype=np.intp).reshape(-1, 2)
    begin, end = first[ends].T
    low, high = int(begin.min(initial=len(kind))), int(end.max(initial=0))
    works = low + np.flatnonzero((kind[low:high] >= Kind.FEED) & (kind[low:high] <= Kind.DRILL))
    work = np.append(works, len(kind))[np.searchsorted(works, begin)]
    blocks = program.row_block[np.where(work < end, work, begin)] + 1
    return np.array([program.modal(block).rpm for block in blocks.tolist()], dtype=np.float64)


def _reversible_tasks(section: Section) -> NDArray[np.int32]:
    return np.array([k for k, c in enumerate(section.pieces) if c.reversible], dtype=np.int32)


def _issues(finder: SectionFinder, items: list[FixedBlocks | Section]) -> list[Issue]:
    """Return a note for every reason why blocks stay, and a note if nothing can be reordered."""
    where: dict[str, list[int]] = {}
    for item in items:
        if isinstance(item, FixedBlocks):
            for reason in item.reasons:
                if reason == STAYING:
                    continue
                where.setdefault(reason, []).append(finder.line_of_reason(item, reason))
    issues = []
    if not any(isinstance(item, Section) for item in items):
        # Work that stays because of its travel move is reported separately (`SectionFinder.stays`).
        told = where or any(isinstance(item, FixedBlocks) and item.reasons for item in items)
        why = "" if told else ": " + next(iter(finder.program.fixed.values()), Message("the block contains no work"))
        issues.append(Issue("L502", Message("no work in the program can be reordered{}", why), severity=Severity.NOTE))
    for reason, lines in where.items():
        times = (
            ("", Message(", here and once more"))[len(lines) - 1]
            if len(lines) < 3
            else Message(", here and {} times more", len(lines) - 1)
        )
        issues.append(
            Issue(
                "L501",
                Message("the block keeps its position: {}{}", reason, times),
                Message("line {}", lines[0]),
                Severity.NOTE,
            )
        )
    return issues
