"""Strategies for clearing a pocket. Each strategy has a name and a function that plans the path through a region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from leafcut.errors import OptionError
from leafcut.message import Message
from leafcut.model.heartbeat import progress_for_step
from leafcut.model.pocket import PocketPath
from leafcut.options import Settings
from leafcut.order.stop import Deadline
from leafcut.processes.job import Job
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.arcs import fit_arcs_to_path

if TYPE_CHECKING:
    from leafcut.geometry.arrays import Points
    from leafcut.model.problem import RoutingProblem
    from leafcut.processes.pocket.plan.grid import GridContext
    from leafcut.processes.pocket.plan.region import CentreRegion

#: Ant algorithms that --algorithm can select. For any other algorithm, the strategy `ants` uses ``auto``.
ANTS = ("colony", "as", "eas", "asrank", "mmas", "acs")
#: Algorithms that each grid strategy accepts.
OF_GRID = {"ants": ("auto", *ANTS), "firefly": ("auto", "firefly")}

#: Ring spacings to try, in step-overs. A smaller spacing keeps the gaps in corners within the step-over.
NEARER = (1.0, 0.98, 0.95, 0.92, 0.89)

#: Grids for the next strategy to reuse: the routing problem and the context of each region.
Grids = dict["CentreRegion", tuple["RoutingProblem", "GridContext"]]

#: Function that plans the path of the tool centre on one level of a region.
Strategy = Callable[["CentreRegion", Job, Grids], PocketPath]


def _with_planned_rules(region: CentreRegion) -> CentreRegion:
    return replace(region, rules=region.rules.planned)


def _wide_gap_finder(region: CentreRegion) -> Callable[[PocketPath], Points]:
    """Create a function that finds points of a path where passes are further apart than the step-over.

    The function returns these points as float64[n, 2]. It measures the path with the fitted arcs of the program,
    because these arcs move passes by a few micrometres.
    """
    from leafcut.material.step_over import WidePlaceFinder

    wide, tolerance = WidePlaceFinder(region.polygon, region.rules), region.rules.tolerance
    return lambda path: wide(fit_arcs_to_path(path, tolerance))


def _zigzag(region: CentreRegion, run: Job, grids: Grids) -> PocketPath:
    from leafcut.processes.pocket.plan.zigzag import zigzag

    wide = _wide_gap_finder(region)
    with run.deadline.running(run.cancelled) as late:
        return zigzag(_with_planned_rules(region), None, late, wide)


def _contour(region: CentreRegion, run: Job, grids: Grids) -> PocketPath:
    from leafcut.processes.pocket.plan.rings import contour_parallel_path

    planned, wide = _with_planned_rules(region), _wide_gap_finder(region)
    paths: list[tuple[int, PocketPath]] = []
    for share in NEARER:
        path = contour_parallel_path(
            replace(planned, rules=replace(planned.rules, step_over=share * planned.rules.step_over))
        )
        paths.append((len(wide(path)), path))
        if not paths[-1][0]:
            break
    return min(paths, key=lambda one: one[0])[1]


def _connected(region: CentreRegion, run: Job, grids: Grids) -> PocketPath:
    from leafcut.processes.pocket.plan.connected_rings import connected_path

    wide = _wide_gap_finder(region)
    with run.deadline.running(run.cancelled) as late:
        return connected_path(region, wide, late)


def _adaptive(region: CentreRegion, run: Job, grids: Grids) -> PocketPath:
    from leafcut.processes.pocket.plan.adaptive import adaptive

    return adaptive(region)


def check_algorithm(settings: Settings) -> None:
    """Raise OptionError if the strategy cannot use the requested algorithm."""
    strategy, algorithm = settings.of(PocketOptions).strategy, settings.solve.algorithm
    taken = OF_GRID.get(strategy, (algorithm,))
    if "algorithm" in settings.asked and algorithm not in taken:
        raise OptionError(
            "--algorithm: --strategy {} supports {}, not {}; choose one of these, or another --strategy",
            strategy,
            " or ".join(", ".join(taken).rsplit(", ", 1)),
            algorithm,
        )


def _grid_strategy(name: str) -> Strategy:
    def path(region: CentreRegion, run: Job, grids: Grids) -> PocketPath:
        from leafcut.order.solve import solve
        from leafcut.processes.pocket.plan.grid import grid_path, grid_problem

        settings, asked = run.settings, run.settings.of(PocketOptions)
        known = grids.pop(region, None)
        problem, context = known or grid_problem(region)
        if known is None and asked.strategy != name:
            grids[region] = problem, context
        options = replace(settings.solve, bound=False, time_limit=run.deadline.remaining_time_limit)
        if asked.strategy != name:
            # A short search is sufficient for the comparison: its cost is at most a few tenths of a percent higher.
            options = replace(options, preset="fast")
        ants = options.algorithm if options.algorithm in ANTS else "auto"
        solution = solve(
            problem,
            replace(options, algorithm=ants if name == "ants" else name),
            settings.aco,
            firefly=settings.firefly,
            progress=progress_for_step(run.progress, Message("{}: ordering the points of a grid", name)),
            observe=run.observe,
            cancelled=run.cancelled,
        )
        run.deadline.subtract(solution.seconds)
        return grid_path(context, solution.nodes, name)

    return path


@dataclass(frozen=True)
class ClearingStrategy:
    """A strategy that the user can select with --strategy."""

    name: str
    path: Strategy
    #: Whether the strategy searches until the time limit.
    searches: bool = True


#: All strategies, in the order of the report.
STRATEGIES = (
    ClearingStrategy("zigzag", _zigzag),  # back-and-forth lines, then along the walls
    ClearingStrategy("contour", _contour, searches=False),  # rings, linked from the inside out
    ClearingStrategy("connected", _connected),  # one connected path, never lifted
    ClearingStrategy(
        "firefly", _grid_strategy("firefly")
    ),  # a grid of points ordered by fireflies, then along the walls
    ClearingStrategy("ants", _grid_strategy("ants")),  # a grid of points ordered by ants, then along the walls
    ClearingStrategy("adaptive", _adaptive, searches=False),  # arcs with limited engagement, then along the walls
)


class SearchTime:
    """Divides a time limit equally among the remaining searches of all pockets.

    `to_come` is the number of remaining searches. `grids` stores grids that the next strategy can reuse.
    """

    def __init__(self, deadline: Deadline) -> None:
        self.deadline, self.to_come = deadline, 1
        self.grids: Grids = {}

    def plan_path(self, strategy: ClearingStrategy, region: CentreRegion, run: Job) -> PocketPath:
        """Plan the path of a strategy through a region. If the strategy searches, it gets its share of the time."""
        if strategy.searches:
            run = replace(run, deadline=self.deadline.for_share(1.0 / max(self.to_come, 1)))
            self.to_come -= 1
        return strategy.path(region, run, self.grids)
