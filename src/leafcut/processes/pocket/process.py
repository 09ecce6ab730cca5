"""The pocket milling process: its options, planning, verification and form."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.message import Message
from leafcut.model.kinds import Head
from leafcut.model.pace_change import PaceChange
from leafcut.options import (
    FeedOptions,
    FireflyOptions,
    JobOptions,
    MachineOptions,
    MillingOptions,
    PocketDrawingOptions,
    ReadOptions,
    Settings,
    SheetOptions,
)
from leafcut.options.drawings import ISLAND_NAMES, POCKET_NAMES
from leafcut.options.search import FIREFLIES
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
from leafcut.processes.pocket.options import PocketOptions

if TYPE_CHECKING:
    from leafcut.model.issue import Issue
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.part import Part
    from leafcut.model.plan import Candidate, Order
    from leafcut.processes.job import Job
    from leafcut.processes.plan import Plan
    from leafcut.processes.pocket.model import PocketDetail
    from leafcut.processes.pocket.report.pocket_report import PocketReport
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN = (
    "machine",
    "tools",
    "tool_diameter",
    "depth",
    "material",
    "feed",
    "spindle_speed",
    "strategy",
    "step_down",
    "outline",
    "pixel_size",
)
#: Suitability if layer names suggest pockets, and suitability of all other drawings.
_BY_NAME, _UNNAMED = 0.98, 0.01
#: Share of the time limit for ordering several pockets.
ORDERING = 0.1
_PLACES = ("clearance_height", "retract_height", "start_point", "end_point", "work_offset")


class Pocketing(Process):
    """Mills pockets with islands from a drawing, a picture or a solid."""

    name = "pocket"
    title = "milling pockets"
    options = (PocketOptions,)
    uses = use(ReadOptions, "units", "layers", "solid", "up", "z_zero", *PLACE, "strict") | use(
        SheetOptions, "join_tolerance", "open_paths"
    )
    uses |= use(FeedOptions)
    uses |= (
        use(MillingOptions)
        | use(PocketDrawingOptions)
        | use(MachineOptions)
        | use(JobOptions, but=("plan",))
        | ORDERED
        | WRITTEN
    )
    #: The firefly options apply to every --algorithm, because all strategies are tried.
    uses |= {name: tuple(one for one in needs if one != FIREFLIES) for name, needs in use(FireflyOptions).items()}
    helps = {  # noqa: RUF012  # a class attribute of the protocol
        "depth": ("depth of the pockets below Z0", "required"),
        "thickness": ("thickness of the plate, for pockets through it", "unknown"),
        "material": ("material of the part; it sets the speed of an end mill that has no cutting data", ""),
        "feed": ("feed rate of the end mill", "from the tool library"),
        "spindle_speed": ("spindle speed of the end mill", "from the tool library or --material"),
        "tool_diameter": ("diameter of the flat end mill", ""),
        "step_over": ("maximum step-over, as a share of the tool diameter", "0.6"),
        "step_down": ("step-down: depth per level", ""),
        "break_through": ("break-through: distance that pockets through the plate extend below it", ""),
        "retract": ("height of rapids between cuts: the R plane, or the clearance height (initial)", ""),
        "diameter_tolerance": ("largest difference between --tool-diameter and the tool of the library", ""),
        "z_zero": (
            "Z0 of the program on a solid after it is turned: the highest point, the lowest point, or the "
            "solid's own Z0 (drawn)",
            "top",
        ),
        "start_point": ("start point of the tool, x,y, or free", ""),
        "end_point": ("", "where the last cut ends"),
        "feeds": (
            "adapt the feed to the load: faster where chips are thin, slower where a cut needs "
            "more power than the spindle has",
            "",
        ),
        "tools": ("tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, or a .csv table", "none"),
    }
    command = "pocket"
    help = "Mill the pockets of a drawing or a picture."
    takes = "a drawing or a picture"
    reads = "drawing"
    by_itself = True
    heads = (Head.SPINDLE,)
    layer_names = (*POCKET_NAMES, *ISLAND_NAMES)
    pictured = "areas"
    with_nearest = False
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        (
            "pocket",
            (
                *option_names(PocketOptions, _MAIN),
                "step_over",
                *option_names(MillingOptions),
                *option_names(PocketDrawingOptions, _MAIN),
            ),
        ),
        ("pace", ("feeds",)),
        ("place", (*PLACE, *_PLACES)),
        ("read", ("units", "layers", "solid", "up", "z_zero", "join_tolerance", "strict")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def rate_drawing(self, drawing: WholeDrawing) -> Suitability | None:
        """Return a high suitability if layer names suggest pockets or islands, otherwise a low suitability."""
        from leafcut.processes.suitability import Suitability

        named = drawing.layers_matching(self.layer_names)
        if named:
            words = ", ".join(named)
            on = drawing.contour_mask_on(named) & drawing.machined_mask, drawing.hole_mask_on(named)
            return Suitability(_BY_NAME, "pocket_layers", {**drawing.counts, "layers": words}, *on)
        closed = drawing.machined_mask & drawing.closed_mask, drawing.part.diameters > 0.0
        return Suitability(_UNNAMED, "outlines", drawing.counts, *closed) if drawing.n_outlines else None

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Clear each pocket with the best strategy.

        Return a plan with a single stage that has a task for each region.
        """
        import numpy as np

        from leafcut.model.plan import Stage
        from leafcut.processes.plan import Plan
        from leafcut.processes.pocket.spec import prepare_pocket_job

        ours, issues = prepare_pocket_job(job, sources[0])
        # These imports load the compiled kernels, which are not needed if a file or option is refused.
        from leafcut.processes.pocket.clearing import PocketWork, clear_pocket, order_problem
        from leafcut.processes.pocket.strategies import SearchTime

        pockets, cleared = ours.part.pockets, []
        time = SearchTime(ours.run.deadline.for_share(1.0 - ORDERING if len(pockets) > 1 else 1.0))
        for number, pocket in enumerate(pockets):
            result, more = clear_pocket(ours, pocket, number, time)
            cleared.append(result)
            issues += more
        chosen = [pocket.clearings[pocket.plan.result.strategy] for pocket in cleared]
        problem = order_problem(ours, chosen)
        none = np.zeros(0, dtype=np.int32)
        return Plan(
            job=ours.run,
            part=ours.part,
            dialect=ours.dialect,
            work=PocketWork(ours, tuple(cleared)),
            stages=(Stage(problem, False, none, Message("ordering the pockets")),),
            tools=(ours.data.tool,),
            box=ours.part.extents,
            made_for=ours.made_for,
            compared_with=f"by {' and '.join(dict.fromkeys(pocket.plan.usual.strategy for pocket in cleared))}",
            start=ours.start,
            issues=issues,
            may_fall_back=False,
        )

    def generate_input_order(self, plan: Plan) -> Candidate:
        """Return the motion of the most common strategy in its best order. It serves as a comparison."""
        from leafcut.model.plan import Order, Stage
        from leafcut.processes.ordering import find_order
        from leafcut.processes.pocket.clearing import order_problem

        work, job = plan.work, plan.job
        (stage,) = plan.stages
        usual = Stage(
            order_problem(work.job, [pocket.usual_clearings for pocket in work.cleared]), False, stage.given, stage.name
        )
        options = replace(job.settings.solve, bound=False)
        order = find_order(job.quiet(), [usual], options, job.deadline.for_share(0.5))
        return self.generate(plan, Order((order.choices[0] + len(work.chosen_clearings),)))

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Generate the motion that clears the regions in the given order.

        The choices first number the regions of the chosen strategies, then the regions of the usual strategy.
        """
        from leafcut.model.plan import Candidate
        from leafcut.processes.pocket.clearing import clearing_motion

        work = plan.work
        recipes = [
            *work.chosen_clearings,
            *(clearing for pocket in work.cleared for clearing in pocket.usual_clearings),
        ]
        motion = clearing_motion(work.job, [recipes[node] for node in order.choices[0].tolist()])
        return Candidate(order, motion.path, motion.measure, motion)

    def write_and_verify(self, plan: Plan, given: Candidate, best: Candidate) -> Candidate:
        """Compare the program with the planned motion, and simulate the program to find gouges and uncut areas."""
        from leafcut.processes.pocket.proving import prove_pockets

        text = self.write(plan, given, best)
        written, left, chips = prove_pockets(plan.work.job, best.detail, text)
        return replace(best, text=text, written=written, detail=replace(best.detail, left=left, chips=chips))

    def header_notes(self, plan: Plan, best: Candidate) -> Sequence[str]:
        """Return a line for the program header for each hole that must be drilled before milling."""
        from leafcut.processes.pocket.proving import required_hole_lines

        return required_hole_lines(plan.work.job, best.detail.descents)

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the operation of the end mill, with the order of the regions.

        A single region needs no search, so its operation has no algorithm and no lower bound.
        """
        from leafcut.model.outcome import OperationOutcome

        (solution,) = best.order.solutions
        if len(solution.nodes) == 1:
            solution = replace(solution, algorithm="none", lower_bound=None)
        return (OperationOutcome(plan.tools[0], "", (), False, solution, cuts=len(solution.nodes)),)

    def issues(self, plan: Plan, best: Candidate) -> Sequence[Issue]:
        """Return issues about changed entries, holes to drill first, stops after every move, and uncut areas."""
        from leafcut.processes.pocket.proving import entry_issues, exact_stop_notes

        return (*entry_issues(best.detail.descents), *exact_stop_notes(plan.work.job), *best.detail.left)

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> PocketDetail:
        """Collect the results of all strategies, the time saved by load-dependent feeds, the stock, and the entries."""
        from leafcut.processes.pocket.clearing import clearing_motion, strategy_programs
        from leafcut.processes.pocket.model import PocketDetail

        work, chips, pace = plan.work, best.detail.chips, None
        nodes = best.order.choices[0].tolist()
        if chips is not None:
            even = [clearing for pocket in work.cleared for clearing in pocket.even[pocket.plan.result.strategy]]
            seconds = clearing_motion(work.job, [even[node] for node in nodes]).measure.time_s
            pace = PaceChange(feeds_s=seconds - best.measure.time_s, changed=chips.changed, tools=(chips.tool,))
        solid, heights = work.job.solid, work.job.heights
        return PocketDetail(
            tuple(pocket.plan for pocket in work.cleared),
            strategy_programs(work.job, list(work.cleared), nodes),
            pace,
            None if solid is None else solid.before,
            heights.clearance + work.job.top,
            (heights.clearance if heights.always_clearance else heights.retract) + work.job.top,
            tuple(Counter(descent.kind for descent in best.detail.descents).items()),
        )

    def report(self, outcome: Outcome[PocketDetail]) -> PocketReport:
        """Create the report of an outcome, with its facts and pictures."""
        from leafcut.processes.pocket.report.pocket_report import PocketReport

        return PocketReport(outcome)

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the pockets of a source, moved to the program origin."""
        from leafcut.processes.placing import place_part
        from leafcut.read import read_pockets

        return place_part(read_pockets(source, settings.read, settings.pocket_drawing, settings.sheet), settings.read)
