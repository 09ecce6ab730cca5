"""Resequencing: what of a foreign program may be put into another order, and what must stay.

    find_sequence(program) -> Sequence          pieces
    build_problem(section, metric, start, end)  the routing problem of one section

A piece of work is everything from the rapid that brings the tool over a place to the next such rapid. Within one tool,
one offset, one spindle speed, one clearance height, the order of pieces is taken to be free, but for those whose cuts
touch, and for what an outer cut would set free. Whatever else stands in the program stays where it is, word for word.
"""

from __future__ import annotations

import numpy as np

from leafcut.errors import PlanError, nearest
from leafcut.gcode.program import Program
from leafcut.model.issue import Issue, Severity
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sequence import Kept, Section, Sequence
from leafcut.plan.chains import PROCESSES, known_process
from leafcut.plan.finding import Finder

Point = tuple[float, float]


def find_sequence(program: Program, *, process: str = "auto", merge_tools: bool = False) -> Sequence:
    """Return the program in pieces: sections whose chains may change places, and all that stays.

    Parameters
    ----------
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``; ``auto`` takes what the program tells.
    merge_tools
        Join sections of one tool where nothing between them forbids it, which saves changes of tool.

    Raises
    ------
    PlanError
        There is no such process.
    """
    if process != "auto" and process not in PROCESSES:
        raise PlanError(f"unknown process '{process}'{nearest(process, ['auto', *PROCESSES])}")
    found = known_process(program) if process == "auto" else process
    finder = Finder(program, found)
    items = finder.items()
    sequence = Sequence(tuple(items), found, (), tuple(_issues(program, items)))
    if merge_tools:
        from leafcut.plan.merging import merge_sections

        return merge_sections(program, sequence, finder.rows)
    return sequence


def build_problem(section: Section, metric: Metric, start: Point | None, end: Point | None) -> RoutingProblem:
    """Return the routing problem of a section: every chain is a cluster of one node, from its entry to its exit."""
    entry = np.array([c.entry for c in section.chains], dtype=np.float64).reshape(-1, 2).round(6)
    leave = np.array([c.exit for c in section.chains], dtype=np.float64).reshape(-1, 2).round(6)
    n = len(entry)
    tool = "" if section.tool is None else f" T{section.tool}"
    return RoutingProblem(
        entry,
        leave,
        np.arange(n, dtype=np.int32),
        np.zeros(n),
        metric,
        section.precedence,
        start,
        end,
        name=f"line {section.chains[0].line}{tool}",
    )


def _issues(program: Program, items: list[Kept | Section]) -> list[Issue]:
    """Return one note for every reason for which work stays, or one that says why all of it does."""
    where: dict[str, list[int]] = {}
    for item in items:
        if isinstance(item, Kept) and item.reason:
            for reason in item.reason.split("; "):
                where.setdefault(reason, []).append(int(program.line[item.begin]))
    free = any(isinstance(item, Section) for item in items)
    if not free:
        why = "; ".join(where) or next(iter(program.fixed.values()), "there is no work in it")
        return [Issue("L502", f"nothing in the program may change places: {why}", severity=Severity.NOTE)]
    issues = []
    for reason, lines in where.items():
        times = f", here and {len(lines) - 1} times more" if len(lines) > 1 else ""
        issues.append(Issue("L501", f"stays in its place: {reason}{times}", f"line {lines[0]}", Severity.NOTE))
    return issues
