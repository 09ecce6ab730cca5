"""The sheet cutting process: options, planning, files, and form."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.model.tool import Tool, ToolKind
from leafcut.options import (
    CutDataOptions,
    JobOptions,
    MachineOptions,
    PostOptions,
    QuoteOptions,
    ReadOptions,
    Settings,
    SheetOptions,
    SpeedOptions,
)
from leafcut.options.drawings import SHEET_NAMES
from leafcut.processes.base import ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, Process, option_names, use
from leafcut.processes.cutting_machines import with_default_cutting_machine
from leafcut.processes.sheet.options import CutOptions

if TYPE_CHECKING:
    from leafcut.model.difference import Difference
    from leafcut.model.issue import Issue
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.part import Part
    from leafcut.model.plan import Candidate, Order
    from leafcut.model.quote import RunCost
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.job import Job
    from leafcut.processes.plan import Pass, Plan
    from leafcut.processes.sheet.model import SheetDetail
    from leafcut.processes.sheet.report.sheet_report import SheetReport
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN = (
    "machine", "thickness", "material", "cut_process", "amps", "beam_power", "kerf", "lead_in", "lead_in_length",
    "micro_joints",
)  # fmt: skip
_CUT = ("chains", "common_lines", "chart", "nozzle", "cut_speed")
_JOB = ("thickness", "material", "clearance_height", "keep_out", "end_point", "plan")
#: How well a drawing suits sheet cutting if the name of a layer suggests a sheet.
_BY_NAME = 0.95
_PLACES = ("clearance_height", "keep_out", "start_point", "end_point")


class SheetCutting(Process):
    """Cuts the contours of a drawing from sheet by plasma, laser, oxyfuel or water jet."""

    name = "cut"
    title = "cutting a sheet"
    options = (CutOptions,)
    uses = use(ReadOptions, but=("z_zero", "side")) | use(SheetOptions) | use(MachineOptions)
    uses |= use(JobOptions, *_JOB, "start_point") | use(CutDataOptions)
    uses |= use(SpeedOptions, "shop_rate") | use(QuoteOptions) | use(QuoteOptions, quantity=())
    uses |= ORDERED | use(PostOptions, but=("coolant",))
    helps = {  # noqa: RUF012  # `Process` declares it as a class variable
        "thickness": ("thickness of the sheet", "required"),
        "plan": ("plan file with the order and choices to keep", ""),
        "material": ("material of the sheet, by its name in the cut chart", ""),
        "concentric": ("which of several concentric circles to cut as a hole", ""),
        "kerf": ("", "the chart's"),
        "start_point": ("start point of the tool, x,y, or free", ""),
        "end_point": ("", "where the last cut ends"),
        "shop_rate": ("", "0"),
        "quantity": ("number of sheets in the batch", ""),
    }
    command = "cut"
    tabulates = True
    quoted_with = ("cutting_rate", "material")
    help = "Cut the contours of a drawing from sheet, by plasma, laser, oxyfuel or waterjet."
    reads = "drawing"
    heads = tuple(head for head in Head if head.method is not None)
    layer_names = SHEET_NAMES
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("cut", (*_CUT, *option_names(CutOptions, (*_MAIN, *_CUT, "save_plan")), "plan", "quantity", "shop_rate")),
        ("place", (*PLACE, *_PLACES, "work_offset")),
        ("sheet", option_names(SheetOptions)),
        ("read", ("units", "layers", "min_diameter", "max_diameter", "concentric", "solid", "up", "strict")),
        ("post", (*POST, "mark_power", "material_number")),
        ("solve", SEARCH_MORE),
    )

    def with_defaults(self, settings: Settings) -> Settings:
        """Return the settings with a cutting machine, unless the user chose a machine."""
        return with_default_cutting_machine(settings)

    def rate_drawing(self, drawing: WholeDrawing) -> Suitability | None:
        """Rate how well a drawing suits sheet cutting.

        The rating is high if the name of a layer suggests a sheet. Otherwise, it depends on the share of outlines.
        """
        from leafcut.processes.suitability import COUNTED, Suitability

        works = drawing.machined_mask, drawing.part.diameters > 0.0
        if not any(mask.any() for mask in works):
            return None
        named = drawing.layers_matching(self.layer_names)
        if named and drawing.n_outlines > 1:
            words = ", ".join(named)
            return Suitability(_BY_NAME, "sheet_layers", {**drawing.counts, "layers": words}, *works)
        return Suitability(COUNTED * drawing.outline_share, "outlines", drawing.counts, *works)

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Plan the cutting of a sheet.

        The plan has a stage for each band of the sweep, and a choice for each start and direction of a cut.
        """
        from leafcut.processes.sheet.spec import plan_sheet

        return plan_sheet(job, sources[0])

    @property
    def order_passes(self) -> Sequence[Pass]:
        """The passes that adjust the order after the search (`order_passes.PASSES`)."""
        from leafcut.processes.sheet.order_passes import PASSES

        return PASSES

    def generate_input_order(self, plan: Plan) -> Candidate:
        """Return the motion in the order that the drawing or the plan file gives."""
        from leafcut.model.plan import Order

        return self.generate(plan, Order((plan.work.given,)))

    def generate_nearest_order(self, plan: Plan) -> Candidate:
        """Return the motion in nearest-neighbour order.

        It avoids detached parts in the same way as the order from the search.
        """
        from leafcut.processes.sheet.order_passes import nearest_order_with_postponed_cuts

        return self.generate(plan, nearest_order_with_postponed_cuts(plan))

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Generate the motion for an order of cuts."""
        from leafcut.processes.sheet.order_passes import cached_motion

        return cached_motion(plan, order)

    def write(self, plan: Plan, given: Candidate, best: Candidate) -> str:
        """Write the program for a torch or a beam."""
        from leafcut.processes.header import header_lines
        from leafcut.processes.sheet.post import write_cut_program

        post = plan.job.settings.post
        return write_cut_program(
            best.detail[0], best.path, plan.dialect, post, header_lines(plan, given, best, self.command)
        )

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Compare the program with the planned motion, the limits of the machine and the drawing.

        Return the motion that was read back from the program, and the differences.
        """
        from leafcut.processes.sheet.proof.cut_motion import check_cut_motion, read_cut_program
        from leafcut.processes.sheet.proof.sheet import check_sheet
        from leafcut.processes.sheet.proof.sheet_shapes import check_divided_shapes

        work, dialect, post, cuts = plan.work, plan.dialect, plan.job.settings.post, best.detail[0]
        written = read_cut_program(text, cuts, dialect, post.material_number)
        problems = check_cut_motion(best.path, written, dialect, post.output_units)
        if work.obstacles is not None and not problems:
            from leafcut.processes.keep_out import obstacle_hits

            problems = obstacle_hits(plan.job, work.obstacles, best.path)
        problems = problems or check_divided_shapes(work.drawn, work.cutting.sheet, plan.spec.half)
        problems = problems or check_sheet(
            work.cutting.sheet, cuts, text, written, dialect, plan.job.machine, plan.spec
        )
        return written, problems

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the result of each search. A search orders either all cuts or the cuts of one band."""
        from leafcut.model.outcome import OperationOutcome

        data = plan.work.torch.data
        tool = Tool(number=1, diameter=data.kerf, kind=ToolKind.TORCH, name=data.process, feed=data.feed)
        return tuple(OperationOutcome(tool, "", (), False, s, cuts=len(s.nodes)) for s in best.order.solutions)

    def issues(self, plan: Plan, best: Candidate) -> Sequence[Issue]:
        """Report starts in hot metal or beyond the sheet, and parts that the head may hit."""
        from leafcut.processes.sheet.order_passes import order_issues

        return order_issues(plan, best)

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> SheetDetail:
        """Return the cuts in three orders, with times and costs.

        These are the order of the input, the nearest-neighbour order, and the best order.
        """
        from leafcut.processes.sheet.model import SheetDetail

        return SheetDetail((given.detail[0], None if nearest is None else nearest.detail[0], best.detail[0]))

    def run_cost(self, plan: Plan, best: Candidate) -> RunCost:
        """Return the cost of a sheet with its parts, for a quote."""
        from leafcut.processes.sheet.pricing import sheet_cost

        return sheet_cost(best.detail[0], plan.job.settings)

    def extra_output_paths(self, settings: Settings) -> list[Path]:
        """Return the paths of the quote and of the plan file, if the user asked for them."""
        plan = settings.of(CutOptions).save_plan
        return [*super().extra_output_paths(settings), *([plan] if plan else [])]

    def extra_files(self, outcome: Outcome[SheetDetail], settings: Settings) -> dict[str, str]:
        """Return the texts of the quote and of the plan file, keyed by their paths, if the user asked for them."""
        files, plan = super().extra_files(outcome, settings), settings.of(CutOptions).save_plan
        if not plan:
            return files
        from leafcut.read.plan_file import plan_file_text

        return {**files, str(plan): plan_file_text(outcome.detail.plan.file)}

    def report(self, outcome: Outcome[SheetDetail]) -> SheetReport:
        """Return the report of an outcome, with its facts and pictures."""
        from leafcut.processes.sheet.report.sheet_report import SheetReport

        return SheetReport(outcome)

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the contours of the drawing. They are moved to the program origin."""
        from leafcut.processes.placing import place_part
        from leafcut.read import read_contours

        return place_part(read_contours(source, settings.read), settings.read)
