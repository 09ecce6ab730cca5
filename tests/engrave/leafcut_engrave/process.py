"""Engraving as a process: its input, its steps, and its form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leafcut.errors import PlanError
from leafcut.gcode.dialects import dialect
from leafcut.model.difference import Difference
from leafcut.model.fact import Fact
from leafcut.model.kinds import Head
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Part
from leafcut.model.plan import Candidate, Order, Stage
from leafcut.model.toolpath import Toolpath
from leafcut.options import JobOptions, MachineOptions, ReadOptions, Settings
from leafcut.processes.base import (
    ORDERED,
    PLACE,
    POST,
    SEARCH,
    SEARCH_MORE,
    WRITTEN,
    Process,
    option_names,
    use,
)
from leafcut.processes.job import Job, check_dialect_options
from leafcut.processes.placing import place_part
from leafcut.processes.plan import Plan
from leafcut.proof.program import check_program, read_back
from leafcut.read import read_contours
from leafcut.read.format import Source
from leafcut.report.path_report import PathReport
from leafcut.timing.toolpath import measure_toolpath
from leafcut.timing.travel import travel_metric
from leafcut_engrave.model import EngravingDetail
from leafcut_engrave.options import EngraveOptions
from leafcut_engrave.plan import DEPTH, TOLERANCE, lay, problem_of, tool_of
from leafcut_engrave.proof import check_lines


class Engraving(Process):
    """Lines and curves of a drawing, engraved where they are drawn."""

    name = "engrave"
    title = "engraving"
    command = "engrave"
    help = "Engrave the lines of a drawing."
    asked_as = ("engrave",)
    asks = "engrave"
    reads = "drawing"
    formats = ("dxf", "svg")
    options = (EngraveOptions,)
    uses = use(ReadOptions, "units", "layers", *PLACE) | use(MachineOptions) | ORDERED | WRITTEN
    uses |= use(JobOptions, "depth", "clearance_height", "start_point", "end_point")
    form = (
        ("main", ("machine", "depth", *option_names(EngraveOptions))),
        ("search", SEARCH),
        ("place", (*PLACE, "clearance_height", "start_point", "end_point", "work_offset")),
        ("read", ("units", "layers")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Return a task for every line; it has two choices, one for each end."""
        settings, machine = job.settings, job.machine
        if machine.head is not Head.SPINDLE:
            raise PlanError(f"{machine.name} has a {machine.head}, which cannot engrave; give another --machine")
        words = dialect(settings.post.dialect or machine.controller)
        check_dialect_options(settings, words)
        part = place_part(read_contours(sources[0], settings.read, job.start_step("reading")), settings.read)
        lines = [contour.path.flattened(TOLERANCE) for contour in part.contours]
        problem = problem_of(lines, travel_metric(machine, settings.solve.objective), settings.job)
        given = np.arange(0, 2 * len(lines), 2, dtype=np.int32)
        return Plan(
            job=job, part=part, dialect=words, work=lines, stages=(Stage(problem, False, given, "ordering lines"),),
            kind="engrave", tools=[tool_of(settings.of(EngraveOptions))], start=problem.start, issues=part.issues,
        )  # fmt: skip

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Return the motion along the lines."""
        path = lay(plan.work, order.choices[0].tolist(), plan.job)
        return Candidate(order, path, measure_toolpath(path, plan.job.machine, start=plan.start))

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Compare the program with the motion and with the drawing."""
        written, depth = read_back(text, plan.dialect), plan.job.settings.job.depth or DEPTH
        machine, units = plan.job.machine, plan.job.settings.post.output_units
        problems = check_program(best.path, written, plan.dialect, machine, units)
        return written, [*problems, *check_lines(written, plan.work, depth, 2.0 * TOLERANCE)]

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the lines in their order."""
        return (OperationOutcome(plan.tools[0], "engrave", (), False, best.order.solutions[0]),)

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> EngravingDetail:
        """Return the number of lines and their depth."""
        return EngravingDetail(len(plan.work), plan.job.settings.job.depth or DEPTH)

    def report(self, outcome: Outcome[EngravingDetail]) -> PathReport[EngravingDetail]:
        """Return the report of a path that counts lines, not holes."""
        lines = outcome.detail.lines
        return PathReport(outcome, [Fact("counts.lines", lines, "", f"{lines} line{'' if lines == 1 else 's'}")])

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the lines as placed."""
        return place_part(read_contours(source, settings.read), settings.read)
