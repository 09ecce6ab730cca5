"""Drilling as a process: its options, its planning steps, and its form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.options import JobOptions, MachineOptions, ReadOptions, Settings
from leafcut.options.condition import given
from leafcut.processes.base import ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, WRITTEN, Process, use
from leafcut.processes.drilling.options import DrillOptions

if TYPE_CHECKING:
    from leafcut.model.difference import Difference
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.part import Part
    from leafcut.model.plan import Candidate, Order
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.drilling.model import DrillingDetail
    from leafcut.processes.drilling.plan.drilling import DrillPlan
    from leafcut.processes.drilling.report import DrillingReport
    from leafcut.processes.job import Job
    from leafcut.processes.plan import Plan
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN = (
    "machine", "thickness", "depth", "tools", "material", "feed", "spindle_speed", "cycle", "peck", "clearance_height",
)  # fmt: skip
#: Form fields of the job below the main group, around the drilling options.
_DEPTHS = (
    "depth_to", "break_through", "hole_heights", "surface", "surface_unit", "through", "fixture",
    "fixture_file",
    "retract_height", "keep_out",
)  # fmt: skip
_REST = ("retract", "dwell", "diameter_tolerance", "centre_drill")
#: Layer names of holes to drill, and the suitability if they exist.
_DRILL_NAMES, _BY_NAME = ("DRILL*",), 0.93
_WAY = ("start_point", "end_point", "hole_order")


class Drilling(Process):
    """Holes and slots of a drawing, of a drill file, or of several drill files of one board."""

    name = "drill"
    title = "drilling"
    options = (DrillOptions,)
    uses = use(ReadOptions) | use(MachineOptions) | ORDERED | WRITTEN
    uses |= use(JobOptions, but=("material", "keep_order", "tool_diameter", "step_over", "step_down")) | use(
        JobOptions, material=(given("tools"),), diameter_tolerance=()
    )
    otherwise = {"keep_order": "--algorithm none keeps the order of the drawing"}  # noqa: RUF012
    helps = {  # noqa: RUF012  # `Process` declares both as class variables
        "thickness": ("thickness of the plate: the holes go through", "unknown: the holes are blind"),
        "depth": ("depth of blind holes below Z0", "from --thickness, else 1 mm (spotting)"),
        "material": ("material of the plate; it chooses among the presets of a tool library", ""),
        "feed": ("feed rate of assumed drills", "by diameter"),
        "spindle_speed": ("spindle speed of assumed drills", "20 m/min surface speed"),
    }
    command = "drill"
    help = "Drill the holes and slots of a drawing, a drill file, or several drill files of a board."
    takes = "a drawing, a drill file or a point map; several drill files make one program"
    asked_as = ("drill",)
    reads = "drawing"
    by_itself = True
    joins = "excellon"
    heads = (Head.SPINDLE,)
    pictured = "holes"
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("drill", (*_DEPTHS, *_REST, *_WAY)),
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

    def machine_for(self, format_name: str) -> str:
        """Return the machine for circuit boards if the file is a drill file."""
        return "pcb-drill" if format_name == self.joins else ""

    def suits(self, drawing: WholeDrawing) -> Suitability | None:
        """Rate the drawing by its share of round holes."""
        from leafcut.processes.suitability import COUNTED, Suitability

        if not drawing.n_holes:
            return None
        named = drawing.named(_DRILL_NAMES)
        works = drawing.drilled, drawing.narrow
        if named and (drawing.on(named)[drawing.drilled].any() or drawing.holes_on(named)[drawing.narrow].any()):
            words = ", ".join(named)
            return Suitability(_BY_NAME, "drill_layers", {**drawing.figures, "layers": words}, *works)
        reason = "holes" if drawing.n_outlines else "only_holes"
        return Suitability(COUNTED * (1.0 - drawing.share_of_outlines), reason, drawing.figures, *works)

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Return one stage of tasks for each tool: a hole has one choice, a slot two directions."""
        from leafcut.gcode.dialects import dialect
        from leafcut.processes.drilling.plan.drill_toolpath import stages_of
        from leafcut.processes.drilling.spec import check_tool_changes, planned, wanted_nodes
        from leafcut.processes.job import check_words_used
        from leafcut.processes.plan import Plan

        work, request = planned(job, sources, everything=asked == "auto")
        words = dialect(job.settings.post.dialect or job.machine.controller)
        job = job.for_words(words)
        check_words_used(job.settings, job.machine, words)
        check_tool_changes(job.machine, words)
        wanted = wanted_nodes(work, job.settings.of(DrillOptions).hole_order)
        return Plan(
            job=job,
            part=work.part,
            words=words,
            work=work,
            spec=request,
            stages=stages_of(work, job.machine, job.settings.solve.objective, wanted),
            kind="drill",
            tools=work.tools,
            box=work.part.extents,
            made_for=work.made_for,
            start=work.start,
            issues=(*work.part.issues, *work.issues),
            unforced=not wanted,
        )

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Return the motion of an order."""
        from leafcut.model.plan import Candidate
        from leafcut.timing.toolpath import measure

        path = _motion(plan, plan.work, order)
        return Candidate(order, path, measure(path, plan.job.machine, start=plan.start))

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Compare the program with the motion, the limits of the machine, and the drawing."""
        from leafcut.model.cutter import bodies_of
        from leafcut.processes.drilling.judge import judge_holes
        from leafcut.processes.drilling.plan.drill_toolpath import surface_tops
        from leafcut.processes.zones import crossing_heights
        from leafcut.proof.program import check_program, read_back, rounding_of

        work, settings, words = plan.work, plan.job.settings, plan.words
        written, units = read_back(text, words), settings.post.output_units
        problems = check_program(
            best.path,
            written,
            words,
            plan.job.machine,
            units,
            zones=work.zones,
            zone_height=crossing_heights(settings.job.keep_out, work.clearance_height),
            tool_radii={tool.number: 0.5 * tool.diameter for tool in work.tools},
            bodies={tool.number: bodies_of(tool) for tool in work.tools},
            tops=surface_tops(work, settings.of(DrillOptions).hole_heights == "drawn"),
            surface=None if work.ground is None else work.ground.triangles,
        )
        return written, [*problems, *judge_holes(plan.spec, text, written, rounding_of(words, units))]

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the holes and slots of each tool, in order."""
        from leafcut.model.outcome import OperationOutcome
        from leafcut.processes.drilling.plan.drill_toolpath import targets_in_order

        return tuple(
            OperationOutcome(
                one.tool,
                one.cycle.name if one.cycle.name in plan.words.cycles else "",
                tuple(targets_in_order(one, solution.nodes).tolist()),
                one.slots,
                solution,
            )
            for one, solution in zip(plan.work.operations, best.order.solutions, strict=True)
        )

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> DrillingDetail:
        """Return the surface, and the time saved by low travel moves over it."""
        from leafcut.processes.drilling.model import DrillingDetail
        from leafcut.processes.drilling.plan.drill_toolpath import with_high_travel
        from leafcut.timing.toolpath import measure

        work, saved = plan.work, None
        if work.reliefs:
            high = _motion(plan, with_high_travel(work), best.order)
            saved = measure(high, plan.job.machine, start=plan.start).time_s - best.measure.time_s
        ground = work.ground
        mesh, boxes = (None, ()) if ground is None else (ground.mesh, ground.boxes)
        return DrillingDetail(saved, plan.job.settings.job.thickness, mesh, boxes)

    def report(self, outcome: Outcome[DrillingDetail]) -> DrillingReport:
        """Return the facts and pictures of an outcome."""
        from leafcut.processes.drilling.report import DrillingReport

        return DrillingReport(outcome)

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return the holes and slots after placement."""
        from leafcut.processes.placing import placed
        from leafcut.read import read

        return placed(read(source, settings.read), settings.read)


def _motion(plan: Plan, work: DrillPlan, order: Order) -> Toolpath:
    from leafcut.processes.drilling.plan.drill_toolpath import lay_toolpath

    machine, post = plan.job.machine, plan.job.settings.post
    pause = plan.words.hand_change_pause and not machine.tool_changer
    return lay_toolpath(work, machine, order.choices, coolant=post.coolant, pause=pause)
