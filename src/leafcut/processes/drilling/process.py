"""The drilling process: options, planning steps, and form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.options import JobOptions, MachineOptions, ReadOptions
from leafcut.options.option_spec import when_given
from leafcut.processes.base import ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, WRITTEN, Process, option_names, use
from leafcut.processes.drilling.options import DrillOptions

if TYPE_CHECKING:
    from leafcut.model.difference import Difference
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.plan import Candidate, Order
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.drilling.model import DrillingDetail
    from leafcut.processes.drilling.plan.drilling import DrillPlan
    from leafcut.processes.drilling.report import DrillingReport
    from leafcut.processes.job import Job
    from leafcut.processes.plan import Plan
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN_OPTIONS = (
    "machine", "thickness", "depth", "tools", "material", "feed", "spindle_speed", "cycle", "peck", "clearance_height",
)  # fmt: skip
_JOB_OPTIONS = (
    "break_through", "retract_height", "keep_out", "retract", "diameter_tolerance", "start_point", "end_point", "plan",
)  # fmt: skip
#: How well a drawing suits drilling if its layers are named for drilling.
_SUITED_BY_NAME = 0.93


class Drilling(Process):
    """Drills the holes and slots of a drawing, of a drill file, or of several drill files of one board."""

    name = "drill"
    title = "drilling"
    options = (DrillOptions,)
    uses = use(ReadOptions, but=("side",)) | use(ReadOptions, z_zero=()) | use(MachineOptions) | ORDERED | WRITTEN
    uses |= use(JobOptions, but=("material", "tool_diameter", "step_over", "step_down")) | use(
        JobOptions, material=(when_given("tools"),), diameter_tolerance=()
    )
    helps = {  # noqa: RUF012  # `Process` declares both as class variables
        "thickness": ("thickness of the plate: the holes go through", "required without --depth"),
        "depth": ("depth of blind holes below Z0", "required without --thickness"),
        "material": ("material of the plate; it selects the presets of a Fusion tool library", ""),
        "feed": ("feed rate of drills, without a tool library", "assumed by diameter"),
        "plan": ("order file: drill these holes first, in this order; the search orders the rest", ""),
        "spindle_speed": ("spindle speed of drills, without a tool library", "20 m/min surface speed"),
        "concentric": ("which of several concentric circles to drill", ""),
        "z_zero": ("", "top"),
        "start_point": ("start point of the tool, x,y, or free", ""),
    }
    command = "drill"
    help = "Drill the round holes of a drawing, or the holes and slots of the drill files of a board."
    takes = "a drawing, a drill file or a point map; several drill files make one program"
    asks = "auto"
    reads = "drawing"
    by_itself = True
    joins = "excellon"
    heads = (Head.SPINDLE,)
    layer_names = ("DRILL*",)
    pictured = "holes"
    form = (
        ("main", _MAIN_OPTIONS),
        ("search", SEARCH),
        ("drill", (*option_names(DrillOptions, _MAIN_OPTIONS), *_JOB_OPTIONS)),
        (
            "read",
            (
                *("units", "layers", "min_diameter", "max_diameter", "concentric"),
                *("solid", "up", "z_zero", "strict"),
            ),
        ),
        ("place", (*PLACE, "work_offset")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def usual_machine(self, format_name: str) -> str:
        """Return the machine for circuit boards if the input is a drill file, otherwise ""."""
        return "pcb-drill" if format_name == self.joins else ""

    def rate_drawing(self, drawing: WholeDrawing) -> Suitability | None:
        """Rate a drawing by the names of its layers. If the names give no hint, rate it by its share of round holes."""
        from leafcut.processes.suitability import COUNTED, Suitability

        if not drawing.n_holes:
            return None
        named = drawing.layers_matching(self.layer_names)
        masks = drawing.drilled_mask, drawing.narrow_hole_mask
        if named and (
            drawing.contour_mask_on(named)[drawing.drilled_mask].any()
            or drawing.hole_mask_on(named)[drawing.narrow_hole_mask].any()
        ):
            layers = ", ".join(named)
            return Suitability(_SUITED_BY_NAME, "drill_layers", {**drawing.counts, "layers": layers}, *masks)
        reason = "holes" if drawing.n_outlines else "only_holes"
        return Suitability(COUNTED * (1.0 - drawing.outline_share), reason, drawing.counts, *masks)

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Plan the drilling of a part, with one stage for each tool.

        A hole has one choice, and a slot has two, one for each direction.
        """
        from leafcut.processes.drilling.plan.drill_toolpath import build_stages
        from leafcut.processes.drilling.spec import nodes_to_visit_first, prepare_drilling
        from leafcut.processes.job import check_dialect_options, check_tool_change_options, dialect_of
        from leafcut.processes.plan import Plan

        drill_plan, request = prepare_drilling(job, sources, everything=asked == "auto")
        post_dialect = dialect_of(job)
        job = job.for_dialect(post_dialect)
        check_dialect_options(job.settings, post_dialect)
        check_tool_change_options(job.machine, post_dialect)
        first_nodes = nodes_to_visit_first(drill_plan, job.settings.job.plan)
        return Plan(
            job=job,
            part=drill_plan.part,
            dialect=post_dialect,
            work=drill_plan,
            spec=request,
            stages=build_stages(drill_plan, job.machine, job.settings.solve.objective, first_nodes),
            tools=drill_plan.tools,
            box=drill_plan.part.extents,
            made_for=drill_plan.made_for,
            start=drill_plan.start,
            issues=(*drill_plan.part.issues, *drill_plan.issues),
            may_fall_back=not first_nodes,
        )

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Generate the motion for an order and compute its time."""
        from leafcut.model.plan import Candidate
        from leafcut.timing.toolpath import measure_toolpath

        path = _drilling_motion(plan, plan.work, order)
        return Candidate(order, path, measure_toolpath(path, plan.job.machine, start=plan.start))

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Compare the program with the planned motion, the limits of the machine, and the drawing.

        Return the motion that was read back from the program, and the differences.
        """
        from leafcut.processes.drilling.judge import judge_holes
        from leafcut.processes.drilling.plan.drill_toolpath import surface_tops
        from leafcut.processes.zones import crossing_heights
        from leafcut.proof.program import check_program, interpret_written_program, max_rounding_error

        drill_plan, settings, dialect = plan.work, plan.job.settings, plan.dialect
        written, units = interpret_written_program(text, dialect), settings.post.output_units
        problems = check_program(
            best.path,
            written,
            dialect,
            plan.job.machine,
            units,
            zones=drill_plan.zones,
            zone_height=crossing_heights(settings.job.keep_out, drill_plan.clearance_height),
            tools=drill_plan.tools,
            tops=surface_tops(drill_plan, settings.read.z_zero == "drawn"),
            surface=None if drill_plan.work_surface is None else drill_plan.work_surface.triangles,
        )
        return written, [*problems, *judge_holes(plan.spec, text, written, max_rounding_error(dialect, units))]

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """For each operation, return its tool, its cycle, and its holes or slots in the final order."""
        from leafcut.model.outcome import OperationOutcome
        from leafcut.processes.drilling.plan.drill_toolpath import targets_in_order

        return tuple(
            OperationOutcome(
                operation.tool,
                operation.cycle.name if operation.cycle.name in plan.dialect.cycles else "",
                tuple(targets_in_order(operation, solution.nodes).tolist()),
                operation.slots,
                solution,
            )
            for operation, solution in zip(plan.work.operations, best.order.solutions, strict=True)
        )

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> DrillingDetail:
        """Return the data of the part, the heights, and the time that low travel moves save."""
        from leafcut.processes.drilling.model import DrillingDetail
        from leafcut.processes.drilling.plan.drill_toolpath import with_high_travel
        from leafcut.timing.toolpath import measure_toolpath

        drill_plan, saved = plan.work, None
        if drill_plan.reliefs:
            high = _drilling_motion(plan, with_high_travel(drill_plan), best.order)
            saved = measure_toolpath(high, plan.job.machine, start=plan.start).time_s - best.measure.time_s
        work_surface = drill_plan.work_surface
        mesh, boxes = (None, ()) if work_surface is None else (work_surface.mesh, work_surface.shown_boxes)
        planes = drill_plan.r_planes
        retract = (float(planes.min()), float(planes.max())) if len(planes) else None
        return DrillingDetail(saved, plan.job.settings.job.thickness, mesh, boxes, drill_plan.clearance_height, retract)

    def report(self, outcome: Outcome[DrillingDetail]) -> DrillingReport:
        """Return the report of an outcome, with its facts and pictures."""
        from leafcut.processes.drilling.report import DrillingReport

        return DrillingReport(outcome)


def _drilling_motion(plan: Plan, drill_plan: DrillPlan, order: Order) -> Toolpath:
    from leafcut.processes.drilling.plan.drill_toolpath import generate_toolpath

    machine, post = plan.job.machine, plan.job.settings.post
    pause = plan.dialect.hand_change_pause and not machine.tool_changer
    return generate_toolpath(drill_plan, machine, order.choices, coolant=post.coolant, pause=pause)
