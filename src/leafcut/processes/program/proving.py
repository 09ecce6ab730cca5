"""Write and verify a reordered program. Tasks that fail the verification keep their position."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut._version import __version__
from leafcut.errors import PostError, ReadError, VerifyError
from leafcut.files.digests import DIGEST_LINE, fill_in_digest
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.issue import Issue
from leafcut.model.measure import Measure
from leafcut.model.plan import Candidate, Order
from leafcut.post.words import comment_lines
from leafcut.processes.plan import OrderRefused, Plan
from leafcut.processes.program.model import AvoidedAreas
from leafcut.processes.program.options import ResequenceOptions
from leafcut.processes.program.plan.program_rows import beam_off_rows
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.reading import read_new
from leafcut.timing.grbl import count_line_bytes_and_words
from leafcut.timing.toolpath import corner_style_of_machine, measure_toolpath

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program
    from leafcut.model.certificate import Certificate
    from leafcut.processes.program.pace import PacedProgram
    from leafcut.processes.program.planning import ForeignWork

#: Maximum number of trials. Each trial runs a full proof. After the last trial, all tasks keep their position.
_MOST_TRIALS = 6


@dataclass(frozen=True, eq=False)
class Rewritten:
    """A reordered program with its proof.

    `avoided` contains the new moves across areas that the original program avoided.
    """

    program: Program
    certificate: Certificate | None = None
    paced: PacedProgram | None = None
    dangers: tuple[Issue, ...] = ()
    avoided: AvoidedAreas = AvoidedAreas()


def measure_program(plan: Plan, program: Program) -> Measure:
    """Compute the time and the lengths of a program. Moves with the beam off count as travel moves.

    On GRBL, the time includes sending the lines to the board.
    """
    machine = plan.job.machine
    lines = None
    if corner_style_of_machine(machine) == "grbl":
        lines = count_line_bytes_and_words(program.lines)
    return measure_toolpath(program.path, machine, beam_off_rows(program, plan.kind), plan.work.stands, lines)


def rewrite_program(plan: Plan, order: Order) -> Candidate:
    """Write the program with its sections in the given order. The result is not yet proved.

    Raises
    ------
    OrderRefused
        A section cannot be written in this order.
    PostError
        Not even the original order can be written.
    """
    work: ForeignWork = plan.work
    text = work.text
    if not order.unchanged and (work.obstacles is not None or not plan.job.settings.solve.keeps_order):
        text = _text_in_order(plan, order)
    program = work.program if text == work.text else _read_back(plan, text)
    return Candidate(order, program.path, measure_program(plan, program), Rewritten(program), text)


def prove_program(plan: Plan, best: Candidate) -> Candidate:
    """Verify a program, and add comments that describe the proof.

    The program must do the same work as the original program, hit no obstacle, and leave the same stock.

    Raises
    ------
    OrderRefused
        The verification failed. The error contains the first difference, and the tasks and sections at fault.
    """
    from leafcut.processes.program.proof.certificate import certify, proof_lines

    work: ForeignWork = plan.work
    job, check_cancelled, text, new = (
        plan.job,
        plan.job.start_step(Message("verifying")),
        best.text,
        best.detail.program,
    )
    certificate = certify(
        work.program,
        new,
        machine=job.machine,
        allow_reverse=job.settings.of(ResequenceOptions).allow_reverse,
        tool_diameter_mm=job.settings.job.tool_diameter,
        beyond=None if work.obstacles is None else work.obstacles.extent_of_detours(),
        check_cancelled=check_cancelled,
    )
    if not certificate.same:
        message = _first_difference_text(certificate.differences)
        lines = {line for d in certificate.differences for line, _ in ((d.original, d.new), *d.also) if line}
        sections = {_section_at(work, line) for line in lines} - {-1}
        raise OrderRefused(message, _pieces_at(work, lines), sections)
    if work.obstacles is not None:
        from leafcut.processes.keep_out import obstacle_hits

        if met := obstacle_hits(job, work.obstacles, new.path):
            raise OrderRefused(_first_difference_text(met))
    if work.judge is not None and text != work.text:
        try:
            work.judge.check(new, check_cancelled)
        except VerifyError as problem:
            raise OrderRefused(str(problem)) from None
    best = replace(best, detail=replace(best.detail, certificate=certificate))
    if job.settings.post.header and text != work.text:
        comments = [*proof_lines(certificate, __version__, Path(work.source).name), DIGEST_LINE]
        return replace_text(plan, best, fill_in_digest(with_comments(text, comments, plan.dialect)))
    return best


def _first_difference_text(found: Sequence[Difference]) -> Message:
    more = Message(" (and {} more)", len(found) - 1) if len(found) > 1 else ""
    return Message("{}{}", found[0], more)


def replace_text(plan: Plan, best: Candidate, text: str) -> Candidate:
    """Replace the text of a candidate. The new text must describe the same motion."""
    program = read_new(plan.job, plan.dialect, text)
    timed = best.measure if best.measure.lines is None else measure_program(plan, program)
    return replace(best, text=text, path=program.path, measure=timed, detail=replace(best.detail, program=program))


def keep_tasks_in_place(plan: Plan, order: Order, refused: OrderRefused, trial: int) -> Order:
    """Return the order with more tasks at their original position. No other task moves past them.

    If the tasks at fault are known, only they go back. Otherwise, their sections go back, or else all tasks. The last
    resort is the unchanged program.

    Raises
    ------
    VerifyError
        Even the unchanged program fails the verification.
    """
    from leafcut.processes.program.plan.resequencing import nodes_from_tasks, tasks_from_nodes

    if order.unchanged:
        raise VerifyError("the program was not written: {}", refused) from None
    sections = plan.work.sequence.sections if plan.stages else ()
    free = {(n, k) for n, section in enumerate(sections) for k in range(len(section.pieces))} - order.kept.keys()
    if not free:
        return replace(order, choices=plan.input_order.choices, unchanged=True)
    faulty = set[tuple[int, int]]()
    if trial < _MOST_TRIALS:
        faulty = refused.faulty & free or {one for one in free if one[0] in refused.stages}
    kept = {**order.kept, **dict.fromkeys(faulty or free, str(refused))}
    choices = []
    for number, (section, nodes) in enumerate(zip(sections, order.choices, strict=True)):
        mine = {piece for stage, piece in kept if stage == number}
        choices.append(nodes_from_tasks(section, _kept_in_place(tasks_from_nodes(section, nodes), mine)))
    return replace(order, choices=tuple(choices), kept=kept)


def kept_task_issues(work: ForeignWork, order: Order) -> Iterator[Issue]:
    """Yield one issue for each reason why tasks keep their position although a better order was known."""
    by_reason: dict[str, list[tuple[int, int]]] = {}
    for place, reason in sorted(order.kept.items()):
        by_reason.setdefault(reason, []).append(place)
    for reason, places in by_reason.items():
        number, piece = places[0]
        line = work.sequence.sections[number].pieces[piece].line
        message = Message("1 task keeps its original position, because verification rejected a new order: {}", reason)
        if len(places) > 1:
            message = Message(
                "{:,} tasks keep their original positions, because verification rejected a new order: {}",
                len(places),
                reason,
            )
        yield Issue("L505", message, Message("line {}", line))


def _text_in_order(plan: Plan, order: Order) -> str:
    from leafcut.processes.program.plan.resequencing import tasks_from_nodes

    sections = plan.work.sequence.sections
    pieces = [np.arange(len(section.pieces), dtype=np.int32) for section in sections]
    if plan.stages:
        pieces = [tasks_from_nodes(section, nodes) for section, nodes in zip(sections, order.choices, strict=True)]
    try:
        return rewrite(
            plan.work.program,
            plan.work.sequence,
            pieces,
            renumber=plan.job.settings.post.line_numbers,
            longest=plan.dialect.max_line,
            check_cancelled=plan.job.start_step(Message("writing")),
            obstacles=plan.work.obstacles,
        )
    except PostError as problem:
        if problem.section is None:
            raise
        raise OrderRefused(str(problem), stages=[problem.section]) from None


def _read_back(plan: Plan, text: str) -> Program:
    try:
        return read_new(plan.job, plan.dialect, text)
    except ReadError as problem:
        raise OrderRefused(str(problem)) from None


def _kept_in_place(order: NDArray[np.int32], kept: set[int]) -> NDArray[np.int32]:
    """Return the order with the tasks `kept` at their original position. No other task moves past them.

    The result satisfies the precedence, because the given order and the original order both satisfy it.
    """
    fixed = np.array(sorted(kept), dtype=np.int32)
    piece = np.where(order < 0, ~order, order)
    staying = np.isin(piece, fixed)
    # Even numbers are runs of pieces between kept pieces, odd numbers are kept pieces.
    run = 2 * np.searchsorted(fixed, piece) + staying
    new: NDArray[np.int32] = np.where(staying, piece, order)[np.argsort(run, kind="stable")].astype(np.int32)
    return new


def _pieces_at(work: ForeignWork, lines: set[int]) -> set[tuple[int, int]]:
    """Return the tasks, as (section, task), with a block on one of the given lines of the original program."""
    named = np.isin(work.program.text_line, list(lines))
    return {
        (number, k)
        for number, section in enumerate(work.sequence.sections)
        for k, piece in enumerate(section.pieces)
        if named[piece.begin : piece.end].any()
    }


def _section_at(work: ForeignWork, line: int) -> int:
    """Return the section that contains a line of the original program.

    If no section contains the line, return the last section before it, or -1 if no section comes before it.
    """
    last, text_line = -1, work.program.text_line
    for number, section in enumerate(work.sequence.sections):
        first, final = int(text_line[section.pieces[0].begin]), int(text_line[section.pieces[-1].end - 1])
        if first <= line:
            last = number
        if first <= line <= final:
            break
    return last


def with_comments(text: str, comments: Iterable[str], dialect: Dialect) -> str:
    """Insert comments near the top of a program, below the percent sign and the program number."""
    lines = text.splitlines(keepends=True)
    end = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    at = 0
    while at < len(lines) and (not lines[at].strip() or lines[at].lstrip()[:1] in "%Oo:"):
        at += 1
    header = [part + end for c in comments for part in comment_lines(c, dialect.max_line, dialect.uppercase_comments)]
    return "".join([*lines[:at], *header, *lines[at:]])
