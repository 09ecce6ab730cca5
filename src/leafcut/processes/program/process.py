"""Defines the process that reorders a program: its options, steps and form fields."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.files.whole_files import check_is_text
from leafcut.message import Message
from leafcut.model.kinds import ProgramKind
from leafcut.options import (
    FeedOptions,
    JobOptions,
    MachineOptions,
    PostOptions,
    ReadOptions,
    StockOptions,
)
from leafcut.options.option_spec import when_given
from leafcut.processes.base import (
    HELP_OF_CUTTING_DATA,
    HELP_OF_PROGRAM,
    LOOKED_UP,
    ORDERED,
    SEARCH,
    SEARCH_MORE,
    Process,
    option_names,
    use,
)
from leafcut.processes.program.options import ResequenceOptions

if TYPE_CHECKING:
    from leafcut.model.issue import Issue
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.plan import Candidate, Order
    from leafcut.processes.job import Job
    from leafcut.processes.plan import OrderRefused, Pass, Plan
    from leafcut.processes.program.model import ProgramDetail
    from leafcut.processes.program.report import ProgramReport
    from leafcut.read.format import Source


#: Options for solids only affect the stock.
_OF_STOCK = (when_given("workpiece"),)


_MAIN = (
    "machine", "tools", "merge_tools", "mix_operations", "allow_reverse", "air", "feeds", "workpiece",
    "keep_out",
)  # fmt: skip


class ForeignProgram(Process):
    """Reorders a G-code program from any CAM system."""

    name = "program"
    title = "reordering a program"
    options = (ResequenceOptions,)
    uses = (
        use(ReadOptions, "units", "strict", solid=_OF_STOCK, up=_OF_STOCK, z_zero=_OF_STOCK)
        | use(MachineOptions)
        | LOOKED_UP
        | ORDERED
    )
    uses |= use(
        JobOptions,
        "keep_out",
        "start_point",
        "tools",
        "tool_diameter",
        clearance_height=(when_given("keep_out"),),
    )
    uses |= use(StockOptions, but=("part",)) | use(FeedOptions)
    uses |= use(PostOptions, "dialect", "header", "line_numbers")
    otherwise = {  # noqa: RUF012  # the protocol declares a class attribute
        "output_units": "a program keeps its own units",
        "coolant": "a program keeps its own coolant",
        "depth": "a program keeps its own depths",
        "program_number": "a program keeps its own number",
        "origin": "a program keeps its zero; set the work offset on the machine",
        "mirror": "mirror the drawing instead, or in the CAM, which knows leads and climb milling",
        "rotate": "rotate the drawing instead, in the CAM, or by the machine's work offset",
    }
    helps = HELP_OF_PROGRAM | {
        "workpiece": ("", "derived from the program: all space that no rapid has crossed"),
        "start_point": ("position of the tool before the program's first rapid, x,y, or free", ""),
        "thickness": HELP_OF_CUTTING_DATA["thickness"],
        "material": (
            "material: for a sheet, its name in the cut chart; for --feeds, a name in `leafcut list materials` "
            "or a TOML file",
            "",
        ),
        "feeds": (
            "adapt the feeds of milling tools to the chip thickness: faster where the tool cuts less than in "
            "its worst cut, slower where the worst cut exceeds the tool's data; needs --workpiece",
            "",
        ),
    }
    command = "reorder"
    help = "Reorder another CAM's G-code program for less machine time, and prove that it does the same work."
    takes = "a G-code program"
    process_values = ("reorder", *ProgramKind)
    asks = "auto"
    reads = "program"
    with_nearest = False
    by_itself = True
    instead = {  # noqa: RUF012  # the protocol declares a class attribute
        "cut": Message("the input is a program, not a drawing; use leafcut reorder, or --process laser or plasma"),
        "pocket": Message("the input is a program, not a drawing; use leafcut reorder, or --process mill"),
    }
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        (
            "pace",
            (
                *option_names(ResequenceOptions, _MAIN),
                "material",
                "solid",
                "up",
                "z_zero",
                "tool_diameter",
                "cell",
            ),
        ),
        ("post", ("dialect", "line_numbers", "units", "cut_speed")),
        ("place", ("start_point", "work_offset", "clearance_height")),
        ("read", ("strict",)),
        ("solve", SEARCH_MORE),
    )

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Plan a stage for each section of the program, and a task for each cut or hole."""
        from leafcut.processes.program.planning import plan_program

        (source,) = sources
        check_is_text(source.path, source.data)
        return plan_program(job, source.path, source.data, "auto" if asked == self.command else asked)

    @property
    def order_passes(self) -> Sequence[Pass]:
        """The pass that keeps the spindle speed from changing more often than in the input."""
        from leafcut.processes.program.planning import with_few_speed_changes

        return (with_few_speed_changes,)

    def generate_input_order(self, plan: Plan) -> Candidate:
        """Return the unchanged program as a candidate."""
        from leafcut.processes.program.proving import rewrite_program

        return rewrite_program(plan, replace(plan.input_order, unchanged=True))

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Return the program with its tasks in the given order."""
        from leafcut.processes.program.proving import rewrite_program

        return rewrite_program(plan, order)

    def fastest(self, plan: Plan, best: Candidate, given: Candidate, nearest: Candidate | None) -> Candidate:
        """Return the faster candidate. If the new order costs more, this is the program in its original order."""
        import numpy as np

        from leafcut.processes.plan import OrderRefused

        objective = plan.job.settings.solve.objective
        if best.order.unchanged or best.cost(objective) <= given.cost(objective):
            return best
        if all(map(np.array_equal, best.order.choices, plan.input_order.choices)):
            return best
        try:
            own = self.generate(plan, replace(best.order, choices=plan.input_order.choices))
        except OrderRefused:
            return best
        # With obstacles, the costs are comparable only after both programs avoid them.
        return own if plan.work.obstacles is None or own.cost(objective) <= best.cost(objective) else best

    def write_and_verify(self, plan: Plan, given: Candidate, best: Candidate) -> Candidate:
        """Prove that the new program does the same work as the original."""
        from leafcut.processes.program.proving import prove_program

        return prove_program(plan, best)

    def keep_in_place(self, plan: Plan, order: Order, refused: OrderRefused, trial: int) -> Order:
        """Put the faulty tasks back at their original position and return the new order."""
        from leafcut.processes.program.proving import keep_tasks_in_place

        return keep_tasks_in_place(plan, order, refused, trial)

    def finish(self, plan: Plan, best: Candidate) -> Candidate:
        """Choose new heights and feeds if requested, and add a comment about moves across new areas."""
        from leafcut.processes.program.finishing import finish_program

        return finish_program(plan, best)

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the operations of the program, one per ordered section."""
        from leafcut.processes.program.operations import operations_of

        return operations_of(plan.work, best.order)

    def issues(self, plan: Plan, best: Candidate) -> Sequence[Issue]:
        """Return the issues: dangers first, followed by the reasons why tasks keep their position."""
        from leafcut.processes.program.finishing import reordering_issues

        return reordering_issues(plan, best)

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> ProgramDetail:
        """Return the proof of the order, the work that was not moved, and the remaining stock."""
        from leafcut.processes.program.finishing import program_detail

        return program_detail(plan, best)

    def report(self, outcome: Outcome[ProgramDetail]) -> ProgramReport:
        """Return the report of an outcome."""
        from leafcut.processes.program.report import ProgramReport

        return ProgramReport(outcome)
