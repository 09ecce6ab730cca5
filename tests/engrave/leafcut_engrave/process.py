"""The engraving process: options, planning, judge and form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leafcut.errors import count_of
from leafcut.gcode.dialects import load_dialect
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.fact import Fact
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
from leafcut.processes.spindle_moves import check_spindle_heights
from leafcut.proof.program import check_program, interpret_written_program
from leafcut.read import read_contours
from leafcut.read.format import Source
from leafcut.report.path_report import PathReport
from leafcut.timing.toolpath import measure_toolpath
from leafcut.timing.travel import travel_metric
from leafcut_engrave.model import EngravingDetail
from leafcut_engrave.options import EngraveOptions
from leafcut_engrave.plan import TOLERANCE, depth_of, generate_toolpath, problem_of, tool_of
from leafcut_engrave.proof import check_lines


class Engraving(Process):
    """Engraves the lines and curves of a drawing."""

    name = "engrave"
    title = "engraving"
    command = "engrave"
    help = "Engrave the lines of a drawing."
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
        """Return a plan with one stage. A line is a task with two choices, one per direction."""
        settings = job.settings
        check_spindle_heights(job.machine, settings.job, "engrave")
        post_dialect = load_dialect(settings.post.dialect or job.machine.controller)
        check_dialect_options(settings, post_dialect)
        job = job.for_dialect(post_dialect)
        part = place_part(read_contours(sources[0], settings.read, job.start_step(Message("reading"))), settings.read)
        lines = [contour.path.flattened(TOLERANCE) for contour in part.contours]
        problem = problem_of(lines, travel_metric(job.machine, settings.solve.objective), settings.job)
        given = np.arange(0, 2 * len(lines), 2, dtype=np.int32)
        return Plan(
            job=job,
            part=part,
            dialect=post_dialect,
            work=lines,
            stages=(Stage(problem, False, given, Message("ordering lines")),),
            tools=[tool_of(settings.of(EngraveOptions))],
            start=problem.start,
            issues=part.issues,
        )

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Generate and time the motion of an order."""
        path = generate_toolpath(plan.work, order.choices[0].tolist(), plan.job)
        return Candidate(order, path, measure_toolpath(path, plan.job.machine, start=plan.start))

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Compare the program with the motion, the limits of the machine, and the drawing."""
        written, depth = interpret_written_program(text, plan.dialect), depth_of(plan.job.settings.job)
        machine, units = plan.job.machine, plan.job.settings.post.output_units
        problems = check_program(best.path, written, plan.dialect, machine, units)
        return written, [*problems, *check_lines(written, plan.work, depth, 2.0 * TOLERANCE)]

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the tool with its order."""
        return (OperationOutcome(plan.tools[0], "engrave", (), False, best.order.solutions[0]),)

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> EngravingDetail:
        """Return the number of lines and their depth."""
        return EngravingDetail(len(plan.work), depth_of(plan.job.settings.job))

    def report(self, outcome: Outcome[EngravingDetail]) -> PathReport[EngravingDetail]:
        """Return a report with the number of lines instead of holes."""
        lines = outcome.detail.lines
        return PathReport(outcome, [Fact("counts.lines", lines, "", count_of(lines, "line"))])

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the lines after placement."""
        return place_part(read_contours(source, settings.read), settings.read)
