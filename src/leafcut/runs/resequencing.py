"""A program in, the same work in less time out: interpret, find what may change places, solve, rewrite, prove."""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut import __version__
from leafcut.errors import ReadError, VerifyError
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Hole, Part
from leafcut.model.sequence import Kept, Section, Sequence
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.runs.run import Run, machine_issues, passing_on, share

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program

#: The order of the chains of every section.
Orders = list[NDArray[np.int32]]


def resequence(run: Run, source: str, data: bytes, process: str) -> Outcome:
    """Return the program that does the same work in the shortest machine time, proved, and what was found out.

    Parameters
    ----------
    source
        The name of the program.
    data
        Its bytes.
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``; ``auto``: what the program shows.

    Raises
    ------
    ReadError, PlanError, SolveError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    from leafcut.gcode.dialects import dialect
    from leafcut.gcode.foreign import interpret_program
    from leafcut.plan.resequencing import find_sequence
    from leafcut.solve.compiling import announced
    from leafcut.timing.toolpath import measure

    words = dialect(run.settings.post.dialect or run.machine.controller)
    options = run.settings.resequence
    text, encoding = decoded(source, data)
    run.tell("reading")
    original = interpret_program(text, words, source)
    sequence = find_sequence(original, process=process, merge_tools=options.merge_tools)
    with announced(lambda: run.tell("compiling (first run on this machine)")):
        solutions = [] if options.keep_order else _solve_sections(run, sequence)
        measures = [measure(original.path, run.machine)]
        new_text, new, certificate = _rewritten(run, words, original, sequence, solutions, source)
        measures.append(measure(new.path, run.machine))
        before, after = (m.time_s if run.settings.solve.objective == "time" else m.travel_mm for m in measures)
        if after > before:
            # The solver's cost leaves out what the look-ahead knows; what is no better is not written.
            solutions = [_unchanged(s) for s in solutions]
            new_text, new, certificate = _rewritten(run, words, original, sequence, [], source)
            measures[1] = measure(new.path, run.machine)
    part, operations = _work_of(source, original, sequence, solutions)
    return Outcome(
        part=part,
        machine=run.machine,
        process=sequence.process,
        operations=operations,
        before=measures[0],
        nearest=None,
        after=measures[1],
        path_before=original.path,
        path_after=new.path,
        text=new_text,
        dialect=words.name,
        seed=run.settings.solve.seed,
        verified=True,
        issues=(*sequence.issues, *machine_issues(run.machine)),
        certificate=certificate,
        barriers=sum(isinstance(item, Kept) and item.reason != "" for item in sequence.items),
        encoding=encoding,
        options=run.settings.changed(),
        version=__version__,
    )


def decoded(source: str, data: bytes) -> tuple[str, str]:
    """Return the text of a program, its line ends as they are, and the encoding that gives the same bytes again.

    Raises
    ------
    ReadError
        It is no text.
    """
    if b"\0" in data:
        raise ReadError(source, "this is a binary file; a G-code program was expected")
    try:
        encoding = "utf-8-sig" if data.startswith(codecs.BOM_UTF8) else "utf-8"
        return data.decode(encoding), encoding
    except UnicodeDecodeError:
        return data.decode("latin-1"), "latin-1"


def _solve_sections(run: Run, sequence: Sequence) -> list[Solution | None]:
    """Return an order for every section; None where there is nothing to choose."""
    from leafcut.plan.resequencing import build_problem
    from leafcut.solve.solve import keep_better, solve
    from leafcut.timing.travel import travel_metric

    metric = travel_metric(run.machine, run.settings.solve.objective)
    total = left = sum(len(s.chains) for s in sequence.sections)
    solutions: list[Solution | None] = []
    for number, section in enumerate(sequence.sections, 1):
        chains = len(section.chains)
        if chains < 2:
            solutions.append(None)
        else:
            problem = build_problem(section, metric, section.start, section.end)
            tell = passing_on(run.progress, f"ordering section {number}", left / total, chains / total)
            used = sum(s.seconds for s in solutions if s is not None)
            budget = share(run.settings.solve, used, left, problem)
            found = solve(problem, budget, run.settings.aco, progress=tell, cancelled=run.cancelled)
            solutions.append(keep_better(problem, found, np.arange(chains, dtype=np.int32)))
        left -= chains
    return solutions


def _unchanged(solution: Solution | None) -> Solution | None:
    if solution is None:
        return None
    return replace(solution, nodes=np.arange(len(solution.nodes), dtype=np.int32), lower_bound=None)


def _rewritten(
    run: Run, words: Dialect, original: Program, sequence: Sequence, solutions: list[Solution | None], source: str
) -> tuple[str, Program, dict[str, Any]]:
    """Return the new program, as text and as it runs, and the proof that it does the same work.

    Raises
    ------
    VerifyError
        It does not: nothing is written.
    """
    from leafcut.gcode.foreign import interpret_program
    from leafcut.post.rewriter import rewrite
    from leafcut.verify.certificate import certify

    options = run.settings.resequence
    run.tell("verifying")
    if options.keep_order:
        text = "".join(original.lines)
    else:
        orders = list(_orders(sequence, solutions))
        text = rewrite(original, sequence, orders, renumber=options.renumber, longest=words.max_line)
    new = interpret_program(text, words, "the new program")
    certificate = certify(original, new, machine=run.machine)
    if not certificate.same:
        more = len(certificate.differences) - 1
        raise VerifyError(
            f"the program was not written: {certificate.differences[0]}{f' (and {more} more)' if more > 0 else ''}"
        )
    if run.settings.post.header and text != "".join(original.lines):
        text = with_comments(text, certificate.comment_lines(Path(source).name), words)
        new = interpret_program(text, words, "the new program")
    return text, new, certificate.as_json()


def _orders(sequence: Sequence, solutions: list[Solution | None]) -> Iterator[NDArray[np.int32]]:
    for number, section in enumerate(sequence.sections):
        solution = solutions[number] if number < len(solutions) else None
        yield np.arange(len(section.chains), dtype=np.int32) if solution is None else solution.nodes


def with_comments(text: str, comments: Iterable[str], words: Dialect) -> str:
    """Return a program with comments near its top: below the percent sign and the program's number.

    They get the line ends of the program.
    """
    from leafcut.post.comments import comment_lines

    lines = text.splitlines(keepends=True)
    end = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    at = 0
    while at < len(lines) and (not lines[at].strip() or lines[at].lstrip()[:1] in "%Oo:"):
        at += 1
    said = [part + end for c in comments for part in comment_lines(c, words.max_line, words.uppercase_comments)]
    return "".join([*lines[:at], *said, *lines[at:]])


def _work_of(
    source: str, program: Program, sequence: Sequence, solutions: list[Solution | None]
) -> tuple[Part, tuple[OperationOutcome, ...]]:
    """Return the holes of a program as a part, and what was ordered, section by section."""
    holes: list[Hole] = []
    operations = []
    for number, section in enumerate(sequence.sections):
        first = len(holes)
        drilled = [c for c in section.chains if c.kind == "hole"]
        holes += [Hole(*c.entry, 0.0) for c in drilled]
        solution = solutions[number] if number < len(solutions) else None
        if solution is not None:
            operations.append(_operation(program, section, sequence.process, first, solution))
    part = Part(name=Path(source).stem, source=source, format="gcode", holes=tuple(holes))
    return part, tuple(operations)


def _operation(program: Program, section: Section, process: str, first: int, solution: Solution) -> OperationOutcome:
    """Return what was ordered in a section; feed, speed and cycle are those of its first piece of work."""
    path, holes = program.path, [k for k, c in enumerate(section.chains) if c.kind == "hole"]
    chain = section.chains[holes[0] if holes else 0]
    rows = np.arange(program.first[chain.begin], program.first[chain.end])
    works = rows[(path.kind[rows] >= Kind.FEED) & (path.kind[rows] <= Kind.DRILL)]
    drilling = works[path.kind[works] == Kind.DRILL]
    tool = Tool(
        number=0 if section.tool is None else section.tool,
        diameter=0.0,
        kind=ToolKind.DRILL if holes else ToolKind.SLOT_MILL,
        name="" if holes else process,
        feed=float(path.value[works[0]]) if len(works) else 0.0,
        spindle_rpm=program.modal(chain.end).rpm,
    )
    at = {chain: first + i for i, chain in enumerate(holes)}
    order = tuple(at[k] for k in solution.nodes.tolist() if k in at)
    cycle = path.cycles[int(path.ref[drilling[0]])].name if len(drilling) else ""
    return OperationOutcome(tool, cycle, order, False, solution, cuts=len(section.chains) - len(holes))
