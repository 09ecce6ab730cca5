"""List the operations of a reordered program for its report, one operation per section."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.model.outcome import OperationOutcome
from leafcut.model.plan import Order
from leafcut.model.sequence import Section
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath, arc_radius_start_sweep
from leafcut.processes.program.planning import ForeignWork, fixed_hole_rows


def operations_of(work: ForeignWork, order: Order) -> tuple[OperationOutcome, ...]:
    """Return the operations of a reordered program, with the tool, feed and holes of each operation.

    Each ordered section is an operation. A fixed hole, such as the first hole of a cycle, is assigned to the next
    section that uses the same tool. If no such section follows, the hole is assigned to the last section.
    """
    program, sequence = work.program, work.sequence
    first, found = 0, list[OperationOutcome]()
    for number, section in enumerate(sequence.sections):
        if order.solutions:
            solution = order.solutions[number]
            if not np.array_equal(solution.nodes, order.choices[number]):
                solution = replace(solution, nodes=order.choices[number], lower_bound=None)
            found.append(_describe_operation(program, section, sequence.process, first, solution))
        first += sum(piece.kind == "hole" for piece in section.pieces)
    starts = [int(program.first[section.pieces[0].begin]) for section in sequence.sections]
    staying = _fixed_holes(program.path, fixed_hole_rows(program, sequence), [o.tool.number for o in found], starts)
    return tuple(replace(one, staying=tuple(first + k for k in mine)) for one, mine in zip(found, staying, strict=True))


def _fixed_holes(path: Toolpath, rows: NDArray[np.intp], tools: list[int], starts: list[int]) -> list[list[int]]:
    changes = np.flatnonzero(path.kind == Kind.TOOL)
    last = np.searchsorted(changes, rows) - 1
    tool = np.where(last >= 0, path.ref[changes[last]], 0) if len(changes) else np.zeros(len(rows))
    staying: list[list[int]] = [[] for _ in tools]
    of_tool: dict[int, list[int]] = {}
    for k, number in enumerate(tools):
        of_tool.setdefault(number, []).append(k)
    for hole, (row, number) in enumerate(zip(rows.tolist(), tool.tolist(), strict=True)):
        mine = of_tool.get(number)
        if mine:
            staying[next((k for k in mine if starts[k] > row), mine[-1])].append(hole)
    return staying


def _main_feed(path: Toolpath, works: NDArray[np.intp]) -> float:
    """Return the main feed of the tasks, mm/s.

    A cut counts with the feed that covers most of its XY length, a hole with the feed of its first row.
    """
    if not len(works):
        return 0.0
    places = np.concatenate([path.before[works[:1]], path.end[works]])
    length = np.nan_to_num(np.hypot(*np.diff(places, axis=0)[:, :2].T))
    for k in np.flatnonzero(path.kind[works] != Kind.FEED).tolist():
        if path.kind[works[k]] != Kind.DRILL:
            radius, _, sweep = arc_radius_start_sweep(path, int(works[k]))
            length[k] = radius * abs(sweep)
    feeds, of = np.unique(path.value[works], return_inverse=True)
    return float(feeds[np.bincount(of.reshape(-1), length).argmax()] if length.any() else path.value[works[0]])


def _describe_operation(
    program: Program, section: Section, process: str, first: int, solution: Solution
) -> OperationOutcome:
    """Describe a section as an operation. Feed, speed and cycle come from its first hole, or from its first cut."""
    path, holes = program.path, [k for k, c in enumerate(section.pieces) if c.kind == "hole"]
    piece = section.pieces[holes[0] if holes else 0]
    rows = np.arange(program.first[piece.begin], program.first[piece.end])
    works = rows[(path.kind[rows] >= Kind.FEED) & (path.kind[rows] <= Kind.DRILL)]
    drilling = works[path.kind[works] == Kind.DRILL]
    tool = Tool(
        number=0 if section.tool is None else section.tool,
        diameter=0.0,
        kind=ToolKind.DRILL if holes else ToolKind.SLOT_MILL,
        name="" if holes else process,
        feed=_main_feed(path, works[:1] if holes else works),
        spindle_rpm=program.modal(piece.end).rpm,
    )
    at = {piece: first + i for i, piece in enumerate(holes)}
    order = tuple(at[k] for k in solution.nodes.tolist() if k in at)
    cycle = path.cycles[int(path.ref[drilling[0]])].name if len(drilling) else ""
    line = program.text_line
    lines = int(line[section.pieces[0].begin]), int(line[section.pieces[-1].end - 1])
    return OperationOutcome(tool, cycle, order, False, solution, len(section.pieces) - len(holes), lines)
