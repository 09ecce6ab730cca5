"""The process that mills a part: its options, its planning steps, and its form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.options import (
    JobOptions,
    MachineOptions,
    MillingOptions,
    QuoteOptions,
    ReadOptions,
    Settings,
    SheetOptions,
    SpeedOptions,
)
from leafcut.options.option_spec import when_absent, when_given
from leafcut.processes.base import ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, WRITTEN, Process, use
from leafcut.processes.part.options import PartOptions

if TYPE_CHECKING:
    from leafcut.model.difference import Difference
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.part import Part
    from leafcut.model.plan import Candidate, Order
    from leafcut.model.quote import RunCost
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.job import Job
    from leafcut.processes.part.model import PartDetail
    from leafcut.processes.part.report import PartReport
    from leafcut.processes.plan import Plan
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN = (
    "machine", "thickness", "operations", "tools", "tool_diameter", "material", "feed", "spindle_speed", "step_down",
    "tabs", "clearance_height",
)  # fmt: skip
_MORE = (
    "tab_width", "tab_height", "finish", "milling", "entry_angle", "plunge_feed", "tool_number", "diameter_tolerance",
    "break_through", "retract_height", "retract", "keep_out", "start_point", "end_point",
)  # fmt: skip
_READ = ("units", "layers", "min_diameter", "max_diameter", "concentric", "solid", "up", "side", "strict")
_JOB = (
    "tools", "thickness", "break_through", "clearance_height", "retract_height", "retract", "keep_out", "tool_diameter",
    "feed", "spindle_speed", "step_down", "diameter_tolerance", "material", "start_point", "end_point",
)  # fmt: skip
#: Suitability relative to cutting. A drawing is suggested for cutting unless the machine is a mill.
_AFTER_CUTTING = 0.99


#: Condition for the options that an operations file replaces.
_BY_NAME = (when_absent("operations"),)


class PartMilling(Process):
    """Mills the outlines and openings of a drawing through a plate, and leaves tabs."""

    name = "part"
    title = "milling parts"
    options = (PartOptions,)
    uses = use(ReadOptions, *_READ, *PLACE) | use(MachineOptions)
    uses |= use(SheetOptions) | use(
        SheetOptions, cut_layers=_BY_NAME, mark_layers=_BY_NAME, ignore_layers=_BY_NAME, open_paths=_BY_NAME
    )
    uses |= use(JobOptions, *_JOB) | use(MillingOptions) | use(MillingOptions, entry_angle=()) | ORDERED | WRITTEN
    uses |= use(QuoteOptions) | use(SpeedOptions, shop_rate=(when_given("quote"),))
    helps = {  # noqa: RUF012  # `Process` declares it as a class variable
        "thickness": ("thickness of the plate: outlines and openings go through it", "required"),
        "material": (
            "material of the plate, such as aluminium; it sets the speed of an end mill that has no cutting data (for "
            "wood, set --feed and --spindle-speed instead)",
            "",
        ),
        "feed": ("feed rate of the end mill", "from the tool library or --material"),
        "spindle_speed": ("spindle speed of the end mill", "from the tool library or --material"),
        "tool_diameter": ("diameter of the end mill", ""),
        "step_down": ("step-down: maximum depth per pass around an edge", "half the diameter of the mill"),
        "break_through": ("break-through: distance that the mill extends below the plate", ""),
        "retract": ("height of rapids between edges: the R plane, or the clearance height (initial)", ""),
        "diameter_tolerance": ("largest difference between --tool-diameter and the tool of the library", ""),
        "start_point": ("start point of the tool, x,y, or free", ""),
        "end_point": ("", "where the last cut ends"),
        "tools": ("tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, or a .csv table", "none"),
        "concentric": ("which of several concentric circles to mill", ""),
        "quantity": ("number of plates in the batch", ""),
        "shop_rate": ("", "required for a quote"),
    }
    command = "part"
    quoted_with = ("material",)
    help = "Mill a part from a plate: outlines with tabs, openings, holes, pockets and engraving."
    reads = "drawing"
    heads = (Head.SPINDLE,)
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("part", _MORE),
        ("place", ("copies", "copy_spacing", "pitch", *PLACE, "work_offset")),
        ("sheet", tuple(SheetOptions.specs())),
        ("read", _READ),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def rate_drawing(self, drawing: WholeDrawing) -> Suitability | None:
        """Rate the suitability of a drawing for this process. Return None unless an outline surrounds holes or
        openings.

        The rating is slightly lower than the rating of cutting. Milling therefore wins over drilling only for drawings
        that suit cutting on a beam or torch machine.
        """
        from leafcut.processes.suitability import COUNTED, Suitability

        if not drawing.has_openings:
            return None
        works = drawing.machined_mask, drawing.part.diameters > 0.0
        return Suitability(_AFTER_CUTTING * COUNTED * drawing.outline_share, "openings", drawing.counts, *works)

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Plan a stage for each tool.

        Each edge is a task of the mill, and each start point is a choice for this task.
        """
        from leafcut.processes.part.spec import plan_part

        return plan_part(job, sources[0])

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Generate the motion for an order, and compute its time."""
        from leafcut.processes.part.spec import part_candidate

        return part_candidate(plan, order)

    def header_notes(self, plan: Plan, best: Candidate) -> Sequence[str]:
        """Return the work offsets of the fixtures, if there are several."""
        from leafcut.model.toolpath import g_word

        offsets = plan.work.work_offsets
        return [f"one plate each in {', '.join(map(g_word, offsets))}"] if len(offsets) > 1 else []

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Check the program against the planned motion, the limits of the machine, and the drawing."""
        from leafcut.processes.part.proof.fixtures import at_common_height, judge_fixtures
        from leafcut.processes.zones import crossing_heights, parse_zones
        from leafcut.proof.program import check_program, interpret_written_program

        settings, written = plan.job.settings, interpret_written_program(text, plan.dialect)
        safe_z, planned, checked = plan.job.machine.safe_z, best.path, written
        if safe_z is None and len(plan.work.work_offsets) > 1:
            planned, checked = map(at_common_height, (best.path, written))
        problems = check_program(
            planned,
            checked,
            plan.dialect,
            plan.job.machine,
            settings.post.output_units,
            zones=parse_zones(settings.job.keep_out),
            zone_height=crossing_heights(settings.job.keep_out, settings.job.clearance_height),
            tools=plan.tools,
            milled=bool(plan.spec.clearing_mills),
        )
        fixtures = judge_fixtures(plan.spec, written, plan.work.work_offsets, safe_z, plan.work.heights.clearance)
        return written, [*problems, *fixtures]

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return an operation for each drill with its holes, and then for each mill with its number of tasks."""
        from leafcut.model.outcome import OperationOutcome

        groups, solutions = plan.work.groups, best.order.solutions
        operations, first = [], 0
        for group, solution in zip(groups, solutions[: len(groups)], strict=True):
            cycle = group.cycle.name if group.cycle.name in plan.dialect.cycles else ""
            holes = tuple(first + int(node) for node in solution.nodes)
            operations.append(OperationOutcome(group.tool, cycle, holes, False, solution))
            first += len(holes)
        for stage, solution in zip(plan.work.mills, solutions[len(groups) :], strict=True):
            operations.append(OperationOutcome(stage.mill.data.tool, "", (), False, solution, cuts=len(solution.nodes)))
        return tuple(operations)

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> PartDetail:
        """Count the outlines, openings and tabs, and collect the heights of the program."""
        from leafcut.processes.part.model import PartDetail

        request, cuts, heights = plan.spec, plan.work.cuts, plan.work.heights
        inside = [request.edges[number].inside for number in {cut.edge for cut in cuts}]
        return PartDetail(
            outlines=inside.count(False),
            openings=inside.count(True),
            holes=len(request.holes),
            tabs=sum(len(cut.tabs) for cut in cuts),
            thickness=request.thickness,
            clearance=heights.clearance,
            retract=heights.retract,
            finish=request.finish,
            layers=plan.work.layers,
            copies=plan.work.copies,
            work_offsets=plan.work.work_offsets,
        )

    def run_cost(self, plan: Plan, best: Candidate) -> RunCost:
        """Return the cost of a plate with its parts, for a quote."""
        from leafcut.processes.part.pricing import plate_cost

        return plate_cost(plan, best.measure.time_s)

    def report(self, outcome: Outcome[PartDetail]) -> PartReport:
        """Create the report of an outcome, with its facts and pictures."""
        from leafcut.processes.part.report import PartReport

        return PartReport(outcome)

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the contours of the drawing, moved to the program zero.

        The copies are included if --copy-spacing or --pitch is given.
        """
        from leafcut.processes.part.copies import repeat_part
        from leafcut.processes.placing import place_part
        from leafcut.read import read_contours

        part = place_part(read_contours(source, settings.read), settings.read)
        options = settings.of(PartOptions)
        is_repeated = options.copy_spacing is not None or options.pitch is not None
        return repeat_part(part, settings)[0] if is_repeated else part
