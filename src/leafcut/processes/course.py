"""The course of a job, which is the same for all processes: plan, order, generate, write and verify."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from leafcut._version import __version__
from leafcut.kernels.compiling import announced_compilations
from leafcut.model.outcome import Outcome
from leafcut.model.plan import Candidate, Order
from leafcut.model.toolpath import FIRST_OFFSET, MOTIONS, Kind, g_word
from leafcut.processes.job import Job, assumed_machine_note, machine_issues, refuse_missing_work, refuse_too_large
from leafcut.processes.ordering import check_order, find_order
from leafcut.processes.plan import OrderRefused, Plan

if TYPE_CHECKING:
    from leafcut.processes.base import Process
    from leafcut.read.format import Source


def run_process(process: Process, job: Job, sources: Sequence[Source], asked: str) -> Outcome[Any]:
    """Run a process on its input files. Return the verified program and the results of the job.

    Raises ReadError, OptionError, PlanError, SolveError, PostError or VerifyError.
    """
    if process.is_quoted(job.settings):
        from leafcut.processes.quoting import check_quote

        check_quote(job.settings, process)
    with announced_compilations(job.report):
        plan = process.plan(job, sources, asked)
        refuse_missing_work(plan.job.settings, sources[0], plan.issues)
        given = process.generate_input_order(plan)
        if process.reads == "drawing":
            _refuse_oversized_work(plan, given)
        nearest = process.generate_nearest_order(plan)
        order = given.order if plan.keeps_given else _search_order(process, plan)
        best = _write_verified_program(process, plan, order, given, nearest)
        best = process.finish(plan, best)
    outcome = _build_outcome(process, plan, given, nearest, best)
    if not process.is_quoted(plan.job.settings):
        return outcome
    from leafcut.processes.quoting import with_quote

    return with_quote(outcome, plan.job.settings, process.run_cost(plan, best))


def _search_order(process: Process, plan: Plan) -> Order:
    """Search for an order before the deadline of the job, and apply the passes of the process.

    `find_order` divides its share of the time among the stages. The passes get the remaining time. The lower bounds of
    the stages have a separate deadline (`Job.bounds`), and verification has no time limit. Pockets are also ordered in
    `Process.generate_input_order`.
    """
    order = find_order(plan.job, plan.stages, deadline=plan.job.deadline.for_share(plan.search_share))
    for improve in process.order_passes:
        order = improve(plan, order)
    check_order(plan.stages, order)
    return order


def _refuse_oversized_work(plan: Plan, given: Candidate) -> None:
    """Raise VerifyError before the search if no order can keep the work within the travel of the machine."""
    from leafcut.proof.envelope import check_machine_limits

    refuse_too_large(check_machine_limits(given.path, plan.job.machine), plan.part, plan.job.settings)


def _write_verified_program(
    process: Process, plan: Plan, order: Order, given: Candidate, nearest: Candidate | None
) -> Candidate:
    """Write the program of an order and verify it (`Process.write_and_verify`). Return the candidate with its text.

    A program from another CAM system may fail the verification. Then the next trial leaves the tasks at fault at their
    original position. In all other processes, VerifyError ends the job.
    """
    trial = 0
    while True:
        try:
            best = process.fastest(plan, process.generate(plan, order), given, nearest)
            order = best.order
            return process.write_and_verify(plan, given, best)
        except OrderRefused as refused:
            trial += 1
            order = process.keep_in_place(plan, order, refused, trial)
            check_order(plan.stages, order)


def _build_outcome(
    process: Process, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate
) -> Outcome[Any]:
    settings, machine = plan.job.settings, plan.job.machine
    issues = (*plan.issues, *process.issues(plan, best))
    return Outcome(
        part=plan.part,
        machine=machine,
        process=plan.kind or process.name,
        operations=process.operations(plan, best),
        before=given.measure,
        nearest=None if nearest is None else nearest.measure,
        after=best.measure,
        path_before=given.path,
        path_after=best.path,
        text=best.text,
        dialect=plan.dialect.name,
        extension=plan.dialect.extension,
        seed=settings.solve.seed,
        verified=True,
        made_by=process.name,
        written=best.written,
        encoding=plan.encoding,
        issues=(
            *issues,
            *assumed_machine_note(settings, machine, issues),
            *machine_issues(plan.limits or machine, plan.box, settings.read.origin is not None),
        ),
        work_offset=_work_offset(process, plan, best),
        options=settings.changed(),
        version=__version__,
        detail=process.detail(plan, given, nearest, best),
    )


def _work_offset(process: Process, plan: Plan, best: Candidate) -> str:
    """Return the work offsets that the program selects. The first blocks of a dialect may select G54."""
    path = best.path
    selected = dict.fromkeys(map(g_word, path.ref[path.kind == Kind.FRAME].tolist()))
    if process.reads != "program":
        moving = np.isin(path.kind, MOTIONS) & (path.latest(Kind.FRAME, path.ref, FIRST_OFFSET) == FIRST_OFFSET)
        stated = any("G54" in line.split() for line in plan.dialect.preamble)
        if stated and bool(moving.any()):
            selected = {"G54": None} | selected
    return ", ".join(selected)
