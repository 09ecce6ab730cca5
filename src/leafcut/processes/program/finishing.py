"""Finish a reordered program: choose new heights and feeds, add warning comments, and write the report."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.files.digests import fill_in_digest
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.model.plan import Candidate
from leafcut.model.sequence import FixedBlocks
from leafcut.processes.plan import Plan
from leafcut.processes.program.model import AvoidedAreas, ProgramDetail
from leafcut.processes.program.options import pace_flags
from leafcut.processes.program.proving import kept_task_issues, measure_program, replace_text, with_comments
from leafcut.processes.program.tools import shown_stock

if TYPE_CHECKING:
    from leafcut.gcode.program import Program
    from leafcut.processes.program.planning import ForeignWork


def finish_program(plan: Plan, best: Candidate) -> Candidate:
    """Verify a reordered program and return it.

    If the user asked for new heights or feeds, they are chosen here. If the new program moves across areas that the
    original program avoided, a comment in the header warns the operator.

    Raises
    ------
    OptionError, PlanError
        The heights or feeds cannot be chosen.
    """
    work, job = plan.work, plan.job
    best = replace(best, detail=replace(best.detail, dangers=_new_dangers(work, best.detail.program)))
    if pace_flags(job.settings):
        from leafcut.processes.program.pace import with_new_pace

        paced = with_new_pace(plan, best.detail.program)
        timed = measure_program(plan, paced.program)
        detail = replace(best.detail, program=paced.program, paced=paced)
        best = replace(best, text=paced.text, path=paced.program.path, measure=timed, detail=detail)
    return _add_avoided_comment(plan, best)


def _add_avoided_comment(plan: Plan, best: Candidate) -> Candidate:
    from leafcut.processes.program.proof.avoided_areas import find_avoided_areas

    if best.text == plan.work.text:
        return best
    areas = find_avoided_areas(plan.work.program, best.detail.program, plan.job.machine.safe_z or 0.0)
    if areas.moves and plan.job.settings.post.header:
        # The comments shift all line numbers.
        areas = replace(
            areas, line=areas.line + len(with_comments("", _avoided_area_comments(areas), plan.dialect).splitlines())
        )
        best = replace_text(
            plan, best, fill_in_digest(with_comments(best.text, _avoided_area_comments(areas), plan.dialect))
        )
    return replace(best, detail=replace(best.detail, avoided=areas))


def _avoided_area_comments(areas: AvoidedAreas) -> list[str]:
    return [f"leafcut: {areas.crossings}", f"leafcut: name clamps with --keep-out, first: line {areas.line}"]


def _new_dangers(work: ForeignWork, program: Program) -> tuple[Issue, ...]:
    """Return the kinds of dangers that occur only in the new program.

    Each of them exposes a gap in the verification.
    """
    if program is work.program:
        return ()
    dangers = replace(work.read, program=program).find_dangers()
    return tuple(
        replace(i, message=Message("in the new program: {}", i.message)) for i in dangers if i.code not in work.codes
    )


def reordering_issues(plan: Plan, best: Candidate) -> list[Issue]:
    """Return the issues of a reordered program.

    The list starts with the dangers. After the dangers, it explains why some cuts and holes keep their position.
    """
    work, detail = plan.work, best.detail
    issues = [*work.before]
    if not detail.certificate.before.has_cuts_or_holes:
        message = Message("the program has no cuts and no holes: check that this is the intended file")
        issues.append(Issue("L502", message))
    issues += [*work.dangers, *detail.dangers]
    if detail.avoided.moves:
        severity = Severity.WARNING if work.obstacles is None else Severity.NOTE
        issues.append(Issue("L515", detail.avoided.text, severity=severity))
    # Tool changes are saved only if the program was rewritten.
    issues += [issue for issue in work.after if not (issue.code == "L503" and best.order.unchanged)]
    issues += kept_task_issues(work, best.order)
    return [*issues, *(detail.paced.issues if detail.paced else ())]


def program_detail(plan: Plan, best: Candidate) -> ProgramDetail:
    """Collect the program-specific results: the proof, the work that keeps its position, and the stock."""
    from leafcut.processes.program.plan.fixed_tasks import count_tasks, group_stay_reasons

    work, settings, detail = plan.work, plan.job.settings, best.detail
    sequence = work.sequence
    return ProgramDetail(
        certificate=detail.certificate,
        barriers=sum(isinstance(item, FixedBlocks) and bool(item.reasons) for item in sequence.items),
        pieces=count_tasks(sequence),
        staying=group_stay_reasons(sequence, best.order.kept, settings.solve.keeps_order),
        pace=detail.paced.change if detail.paced else None,
        stock=work.stock,
        shown=shown_stock(work.program, work.source, settings, plan.job.machine, plan.kind),
        avoided=detail.avoided,
    )
