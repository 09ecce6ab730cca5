"""A pocket in, a milling program out: read, clear it in every way there is, choose, order, lay, post, prove."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut._version import __version__
from leafcut.errors import OptionError, PlanError, SolveError, count_of
from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.regions import as_polyline
from leafcut.geometry.zones import widened
from leafcut.model.cutter import bodies_of, widest_below
from leafcut.model.heartbeat import Trial
from leafcut.model.issue import Issue, Severity
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.pace_change import PaceChange
from leafcut.model.pocket import (
    UNCOVERED,
    USUAL,
    Pocket,
    PocketLevels,
    PocketMeasures,
    PocketPath,
    PocketPiece,
    PocketPlan,
    PocketProgram,
    PocketResult,
)
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.model.work_material import WorkMaterial
from leafcut.options import FeedOptions, JobOptions, Settings
from leafcut.processes.job import Job, check_words_used, library_of, machine_issues, refuse_missing, refuse_too_large
from leafcut.processes.pocket.job import LaidPockets, PocketJob, PocketSolid, holes, raised
from leafcut.processes.pocket.model import PocketDetail
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.proving import prove_pockets, write_pockets
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.model.part import Part
    from leafcut.processes.pocket.plan.entries import Descent
    from leafcut.processes.pocket.plan.region import CentreRegion
    from leafcut.processes.pocket.plan.toolpath import Clearing
    from leafcut.processes.pocket.strategies import ClearingWay, SearchTime
    from leafcut.read.format import Source


#: This part of a time limit is for the order of several pockets, for what shops run and for what is written.
ORDERING = 0.1
#: Part of the time for lower bounds that each of these two orders has.
BOUND_SHARE = 0.5
#: Of ways that cost little more than the best, the one that is lifted least: every way down wears the tool and marks
#: the floor.
NEARLY = 1.05


@dataclass(frozen=True, eq=False)
class _Cleared:
    """A pocket with every strategy: the plan that is told, and the regions of each strategy that has a path.

    `even` has the regions at one feed, where those of `ways` have feeds that follow what the tool meets.
    """

    plan: PocketPlan
    ways: dict[str, list[Clearing]]
    even: dict[str, list[Clearing]]


def pocket(run: Job, source: Source) -> Outcome[PocketDetail]:
    """Return the verified milling program of the pockets in a drawing or a picture, and all that was found out.

    Raises
    ------
    ReadError, OptionError, PlanError, SolveError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    from leafcut.order.compiling import announced
    from leafcut.processes.pocket.strategies import SearchTime
    from leafcut.proof.envelope import check_envelope

    job, issues = _prepared(run, source)
    # What no strategy changes is known before any is tried.
    refuse_too_large(check_envelope(_box(job), run.machine), job.part, run.settings)
    with announced(run.tell):
        cleared, time = [], SearchTime(run.deadline.part(1.0 - ORDERING if len(job.part.pockets) > 1 else 1.0))
        for number, one in enumerate(job.part.pockets):
            found, more = _cleared(job, one, number, time)
            cleared.append(found)
            issues += more
        usual = _ordered(replace(job, run=run.quiet()), [c.ways[c.plan.usual.strategy] for c in cleared], 0.5)[0]
        chosen, solution = _ordered(job, [c.ways[c.plan.result.strategy] for c in cleared], 1.0)
    even = [clearing for c in cleared for clearing in c.even[c.plan.result.strategy]]
    even_s = _laid(job, [even[int(node)] for node in solution.nodes]).measure.time_s if job.limits else None
    return _outcome(job, issues, cleared, solution, (_laid(job, usual), _laid(job, chosen)), even_s)


def _programs(job: PocketJob, cleared: list[_Cleared], nodes: Sequence[int]) -> tuple[PocketProgram, ...]:
    """Return what the program of all pockets is, as it is written and by every strategy that clears all of them.

    All go from pocket to pocket in the order of what is written: `nodes` are its regions, numbered through.
    """
    if len(cleared) < 2:
        return ()
    names = [name for name in cleared[0].ways if all(name in c.ways for c in cleared)]
    chosen = {"": [c.plan.result.strategy for c in cleared], **{name: [name] * len(cleared) for name in names}}
    programs = []
    for name, strategies in chosen.items():
        regions = [clearing for c, strategy in zip(cleared, strategies, strict=True) for clearing in c.ways[strategy]]
        order = [regions[node] for node in nodes]
        path = PocketPath(name, tuple(piece for clearing in order for piece in clearing.path.pieces))
        programs.append(PocketProgram(name, _laid(job, order).measure.time_s, path.rapid_mm, path.retracts))
    return tuple(programs)


def _prepared(run: Job, source: Source) -> tuple[PocketJob, list[Issue]]:
    """Read the pockets and what is said of them."""
    from leafcut.gcode.dialects import dialect
    from leafcut.processes.placing import placed, placing_words
    from leafcut.processes.pocket.plan.clamps import refuse_clamps
    from leafcut.processes.pocket.plan.feed_limits import feed_limits
    from leafcut.processes.pocket.plan.rules import levels_of, lying_in, milled_pockets, milling_data, rules_of
    from leafcut.processes.pocket.plan.toolpath import PocketHeights
    from leafcut.processes.pocket.strategies import check_algorithm
    from leafcut.processes.zones import crossing_heights, parse_zones, refuse_higher_zones
    from leafcut.read import read_pockets

    settings = run.settings
    check_algorithm(settings)
    options = settings.of(PocketOptions)
    part = read_pockets(source, settings.read, settings.pocket_drawing, settings.sheet, run.looking("reading"))
    mill = _library_mill(run, settings.job.depth)
    diameter = settings.job.tool_diameter if mill is None else mill.diameter
    whole = part
    part, left = milled_pockets(part, settings.job.depth, diameter)
    depths = [one.depth or 0.0 for one in part.pockets]
    if mill is not None:
        # Of the pockets of a solid the depths are known now: whether the mill is long enough.
        mill = _library_mill(run, max(depths))
    rules = rules_of(options, diameter)
    around = lying_in(part.pockets, rules.tolerance)
    solid, tops = _solid(run, source, whole, part, rules.radius)
    levels = tuple(
        levels_of(
            depth,
            options,
            rules.tool_diameter,
            top if over is None else -depths[over],
            settings.job.thickness,
            settings.job.break_through,
        )
        for depth, over, top in zip(depths, around, tops, strict=True)
    )
    data, issues = milling_data(options, settings.job, rules, run.machine, mill)
    limits = None
    if settings.of(FeedOptions).feeds:
        limits, told = feed_limits(settings, run.machine, rules, levels, data, mill, _material(settings))
        issues = [*issues, *told]
        data = replace(data, limits=limits)
    made_for = "" if part.pockets[0].top is None else placing_words(source.path, part, settings.read)
    part = placed(part, settings.read)
    surface, keep_out = part.pockets[0].top or 0.0, settings.job.keep_out
    refuse_higher_zones(keep_out, settings.job.clearance_height + surface)
    over, retract = (
        crossing_heights(keep_out, settings.job.clearance_height + surface),
        settings.job.retract_height + surface,
    )
    high, radius = over > retract, 0.5 * data.tool.diameter
    beside = widest_below(radius, bodies_of(data.tool), retract, over) - radius
    heights = PocketHeights(
        clearance=settings.job.clearance_height,
        retract=settings.job.retract_height,
        always_clearance=settings.job.retract == "initial",
        end=_xy(settings.job.end_point),
        zones=widened(parse_zones(keep_out), beside)[high],
    )
    floors, clearance = [one.floor + surface for one in levels], settings.job.clearance_height + surface
    refuse_clamps(part.pockets, floors, rules, data.tool, keep_out, clearance)
    words = dialect(settings.post.dialect or run.machine.controller)
    run = run.for_words(words)
    check_words_used(settings, run.machine, words)
    job = PocketJob(
        run, part, rules, levels, tuple(around), heights, data, words, _xy(settings.job.start_point), limits,
        tuple(tops), solid, made_for,
    )  # fmt: skip
    refuse_missing(settings, source, (*part.issues, *left))
    return job, [*part.issues, *left, *issues, *_lower(part.pockets, tops)]


def _solid(run: Job, source: Source, whole: Part, part: Part, radius: float) -> tuple[PocketSolid | None, list[float]]:
    """Return the solid that says where the material of its pockets begins, and where that is.

    None, and all of them at its highest place, where nothing else is asked for.

    Raises
    ------
    OptionError
        It is asked for, and what was read is no solid.
    """
    if run.settings.of(PocketOptions).pocket_top == "highest":
        return None, [0.0] * len(part.pockets)
    if any(one.top is None for one in part.pockets):
        raise OptionError("--pocket-top surface: a drawing has no surface; leave it out, or give a STEP file")
    from leafcut.model.mesh import Mesh
    from leafcut.processes.placing import placed_mesh
    from leafcut.processes.pocket.plan.stock_top import filled, stock_tops
    from leafcut.read.step import Pose, step_mesh

    run.tell("reading the surface")
    read = run.settings.read
    triangles = step_mesh(source.path, source.data, read.solid, Pose.of(read))
    every = stock_tops(whole.pockets, whole.pockets, triangles, radius)
    before = placed_mesh(Mesh(filled(triangles, whole.pockets, every), part.name), part, read)
    tops = [every[k] for k, one in enumerate(whole.pockets) if any(one is mine for mine in part.pockets)]
    return PocketSolid(triangles, whole.pockets, part.pockets, before), tops


def _lower(pockets: Sequence[Pocket], tops: Sequence[float]) -> list[Issue]:
    """Return where the tool goes down below the highest place of the solid, as what stood there is milled already."""
    lower = [k for k, top in enumerate(tops) if top < 0.0]
    if not lower:
        return []
    heights = sorted({round((pockets[k].top or 0.0) + tops[k], 3) for k in lower}, reverse=True)
    words = (
        f"{count_of(len(lower), 'pocket')} with material that begins below the highest place, at "
        f"{', '.join(f'Z{z:g}' for z in heights)}: what is above has to be gone before this program runs"
    )
    return [Issue("L706", words)]


def _library_mill(run: Job, depth: float | None) -> Tool | None:
    """Return the end mill of the tool library for pockets of a depth; None without a library."""
    from leafcut.processes.pocket.plan.tool import library_mill

    tools = library_of(run.settings, run.machine)
    if tools is None:
        return None
    job = run.settings.job
    return library_mill(
        tools, run.settings.of(PocketOptions).tool_number, job.tool_diameter, job.diameter_tolerance, depth
    )


def _material(settings: Settings) -> WorkMaterial | None:
    """Return what is cut, where somebody says it and the force that it needs is known.

    Raises
    ------
    OptionError
        The file of a material cannot be read.
    """
    from leafcut.read.work_materials import load_material

    named = settings.job.material
    if "material" not in settings.given:
        return None
    try:
        return load_material(named)
    except OptionError:
        if JobOptions.specs()["material"].names_file(named):
            raise
        return None  # a name of the tables of cutting speeds


def _xy(point: tuple[float, ...] | None) -> Point | None:
    if point is not None and len(point) != 2:
        raise OptionError("--start-point and --end-point need two numbers, x,y")
    return None if point is None else (point[0], point[1])


def _box(job: PocketJob) -> Toolpath:
    """Return rapids and a feed round the box of all pockets, from the clearance height to the bottom."""
    builder = ToolpathBuilder()
    builder.rapid(z=job.heights.clearance)
    for one, levels in zip(job.part.pockets, job.levels, strict=True):
        x0, y0, x1, y1 = one.outline.extents
        r = job.rules.radius
        builder.rapid(x0 + r, y0 + r)
        builder.feed(z=levels.floor, feed=job.data.tool.feed)
        builder.feed(x1 - r, y1 - r, feed=job.data.tool.feed)
        builder.rapid(z=job.heights.clearance)
    return raised(builder.build(), job.top)


# -- strategies ------------------------------------------------------------------------------------------------------


def _cleared(job: PocketJob, one: Pocket, number: int, time: SearchTime) -> tuple[_Cleared, list[Issue]]:
    """Clear a pocket in the way that is asked for, or in every way there is, and choose."""
    from leafcut.processes.pocket.plan.region import centre_regions
    from leafcut.processes.pocket.strategies import WAYS

    regions, issues = centre_regions(one, job.exact)
    roughed = centre_regions(one, job.rules)[0] if job.rules.stock > 0.0 else regions
    found: dict[str, PocketResult] = {}
    ways: dict[str, list[Clearing]] = {}
    even: dict[str, list[Clearing]] = {}
    several = f"pocket {number + 1}: " if len(job.part.pockets) > 1 else ""
    asked = job.run.settings.of(PocketOptions).strategy
    ways_tried = [way for way in WAYS if asked in ("best", way.name)]
    each = len(regions) * (len(job.part.pockets) - number)
    time.to_come = each * sum(way.searches for way in ways_tried)
    for place, way in enumerate(sorted(ways_tried, key=lambda one: one.searches)):
        words, share = f"{several}{way.name}", (number + place / len(ways_tried)) / len(job.part.pockets)
        job.run.tell(words, share, Trial(words))
        result, clearings, fitted = _tried(job, number, way, regions, roughed, time)
        found[way.name] = result
        known = result.measures is not None
        figure = format_time(result.program_s) if known else "–"
        job.run.tell(words, share, Trial(words, figure, result.program_s if known else None))
        if clearings:
            ways[way.name], even[way.name] = fitted, clearings
    results = [found[way.name] for way in ways_tried]
    chosen, levels = _chosen(job, one, results), job.levels[number]
    in_floor = job.around[number] is not None
    results = with_reasons(job, results, results[chosen])
    plan = PocketPlan(one, job.rules, levels.levels, tuple(results), chosen, levels.begin, in_floor)
    return _Cleared(plan, ways, even), issues


def _tried(
    job: PocketJob,
    number: int,
    way: ClearingWay,
    regions: list[CentreRegion],
    roughed: list[CentreRegion],
    time: SearchTime,
) -> tuple[PocketResult, list[Clearing], list[Clearing]]:
    """Return what a strategy does to a pocket, and its regions, none where it is refused: at one feed, and at others.

    The others follow what the tool meets, where that is asked for.
    """
    from leafcut.material.removal import engaged_way
    from leafcut.processes.pocket.air import with_air
    from leafcut.processes.pocket.measures import measure_path

    if job.run.cancelled.is_set() and way.name not in (*USUAL, job.run.settings.of(PocketOptions).strategy):
        return PocketResult(way.name, refused="stopped before it was tried"), [], []
    try:
        clearings = [_clearing(job, job.levels[number], way, region, roughed, time) for region in regions]
    except (PlanError, SolveError) as problem:
        return PocketResult(way.name, refused=str(problem)), [], []
    path = PocketPath(way.name, tuple(piece for c in clearings for piece in c.path.pieces))
    steps, engaged = engaged_way(path, job.exact)
    found = measure_path(job.part.pockets[number], path, job.exact, looked=(steps, engaged))
    if job.data.air_feed > job.data.tool.feed:
        divided = iter(with_air(path.pieces, steps, engaged, job.exact))
        clearings = [_aired(clearing, divided) for clearing in clearings]
    fitted, time_s = _fitted(job, clearings)
    return PocketResult(way.name, path, found, program_s=time_s), clearings, fitted


def _fitted(job: PocketJob, clearings: list[Clearing]) -> tuple[list[Clearing], float]:
    """Return regions with feeds that follow what the tool meets, where that is asked for, and their time, s.

    A move that is divided is joined to its neighbours otherwise, and some machines stop after each: feeds may change
    anywhere, at the ends of moves alone, or not at all, whatever takes the least time. A cut that needs more power than
    there is becomes slower whatever that takes.
    """
    from leafcut.processes.pocket.feeds import with_feeds

    even = (clearings, _laid(job, clearings).measure.time_s)
    if job.limits is None:
        return even
    acceleration = min(job.run.machine.acceleration[:2]) * job.run.machine.acceleration_factor
    tried = []
    for anywhere in (True, False):
        found = [
            # Each region by itself: it is not known yet which comes first.
            _aired(c, iter(with_feeds(c.path.pieces, job.limits, job.exact, acceleration, anywhere=anywhere)))
            for c in clearings
        ]
        tried.append((found, _laid(job, found).measure.time_s))
    slower = any(piece.feed < 1.0 for found, _ in tried for c in found for piece in c.path.pieces)
    return min(tried if slower else [even, *tried], key=lambda one: one[1])


def _along(strategy: str, middle: Points) -> PocketPath:
    return PocketPath(strategy, (PocketPiece(as_polyline(middle)),))


def _aired(clearing: Clearing, divided: Iterator[list[PocketPiece]]) -> Clearing:
    """Return a clearing with the pieces that its own were divided into."""
    rough, walls = (
        None if path is None else replace(path, pieces=tuple(p for _ in path.pieces for p in next(divided)))
        for path in (clearing.rough, clearing.walls)
    )
    return replace(clearing, rough=rough or clearing.rough, walls=walls)


def _clearing(
    job: PocketJob,
    levels: PocketLevels,
    way: ClearingWay,
    region: CentreRegion,
    roughed: list[CentreRegion],
    time: SearchTime,
) -> Clearing:
    """Return one region cleared by a strategy: all of it, or less the stock and then along its walls."""
    from leafcut.processes.pocket.plan.arcs import fitted
    from leafcut.processes.pocket.plan.toolpath import Clearing
    from leafcut.processes.pocket.plan.walls import wall_passes

    tolerance = job.rules.tolerance
    if region.middle is not None:
        # A slot as wide as the tool: there is one way to clear it.
        along = _along(way.name, region.middle)
        return Clearing(region, region.polygon, fitted(along, tolerance), levels)
    inside = [r for r in roughed if region.polygon.intersects(r.polygon)] if job.rules.stock > 0.0 else []
    if not inside:
        # Where stock leaves no room the tool clears up to the wall.
        return Clearing(region, region.polygon, fitted(time.path(way, region, job.run), tolerance), levels)
    rough = [fitted(time.path(way, r, job.run), tolerance) for r in inside]
    allowed = shapely.union_all([r.polygon for r in inside])
    whole = PocketPath(way.name, tuple(piece for path in rough for piece in path.pieces))
    return Clearing(region, allowed, whole, levels, fitted(wall_passes(region, allowed), tolerance))


def _chosen(job: PocketJob, one: Pocket, results: list[PocketResult]) -> int:
    """Return the strategy that is written: the one asked for, or the best of those that do the whole work.

    Raises
    ------
    PlanError
        The strategy asked for is refused or does more than it may, or none has a path without a gouge.
    """
    options = job.run.settings.of(PocketOptions)
    name = one.label
    if options.strategy != "best":
        found = {r.strategy: (k, r) for k, r in enumerate(results)}.get(options.strategy)
        if found is None or found[1].path is None:
            why = "leafcut does not have it" if found is None else found[1].refused
            raise PlanError(f"{name}: --strategy {options.strategy} is not possible: {why}")
        if found[1].measures is not None and (more := _beyond(job, found[1].strategy, found[1].measures)):
            raise PlanError(f"{name}: {found[1].strategy} {more}")
        return found[0]
    known = [(k, r, r.measures) for k, r in enumerate(results) if r.measures is not None]
    sound = [row for row in known if not row[2].gouge_mm2 and not _beyond(job, row[1].strategy, row[2])]
    if not sound:
        wrong = {k: _beyond(job, r.strategy, m) or "gouges" for k, r, m in known}
        reasons = (f"{r.strategy}: {r.refused or wrong[k]}" for k, r in enumerate(results))
        raise PlanError(f"{name}: no strategy is possible ({'; '.join(reasons)})")
    whole = [row for row in sound if row[2].uncovered_percent <= UNCOVERED]
    if not whole:
        return min(sound, key=lambda row: row[2].uncovered_percent)[0]
    costs = [_cost(job, row[1], row[2]) for row in whole]
    near = [
        (row[2].retracts, cost, row[0]) for row, cost in zip(whole, costs, strict=True) if cost <= NEARLY * min(costs)
    ]
    return min(near)[2]


def _cost(job: PocketJob, result: PocketResult, measures: PocketMeasures) -> float:
    """Return what a strategy costs: the time of its program, s, or the length of its path, mm."""
    timed = job.run.settings.solve.objective == "time"
    return result.program_s if timed else measures.feed_mm + measures.rapid_mm


def with_reasons(job: PocketJob, results: list[PocketResult], written: PocketResult) -> list[PocketResult]:
    """Return results with the reason why those that cost less than the written one are not written."""
    best = written.measures
    if best is None:
        return results
    cost = _cost(job, written, best)
    found = []
    for result in results:
        reason, m = "", result.measures
        if m is not None and result is not written and _cost(job, result, m) < cost:
            reason = _excess(job, result.strategy, m)
            if m.gouge_mm2:
                reason = f"gouges {m.gouge_mm2:.3g} mm² of the walls"
            elif not reason and m.uncovered_percent > UNCOVERED:
                reason = f"leaves {m.uncovered_percent:.3g} % uncut"
            elif not reason:
                reason = f"costs at most {100.0 * (NEARLY - 1.0):.0f} % less, with more retracts"
        found.append(replace(result, passed_over=reason))
    return found


def _excess(job: PocketJob, strategy: str, measures: PocketMeasures) -> str:
    """Return in what a strategy goes beyond what is asked for; empty where it keeps all of it.

    What is asked for holds for every strategy: the step-over, and the engagement where a limit is given.
    """
    rules, limit = job.exact, job.exact.max_engagement
    if not rules.keeps(measures.max_step_over):
        return f"has passes {measures.max_step_over:.2f} mm apart, more than the step-over of {rules.step_over:.4g} mm"
    if limit is None or measures.max_engagement <= limit:
        return ""
    stock = " with the stock on its walls" if strategy == "adaptive" and job.rules.stock > 0.0 else ""
    return (
        f"engages {math.degrees(measures.max_engagement):.0f}°{stock}, more than --max-engagement "
        f"{math.degrees(limit):.0f}°"
    )


def _beyond(job: PocketJob, strategy: str, measures: PocketMeasures) -> str:
    """Return in what a strategy goes beyond what is asked for, and what to do; empty where it keeps all of it."""
    excess = _excess(job, strategy, measures)
    if not excess:
        return ""
    if not job.exact.keeps(measures.max_step_over):
        return f"{excess}; choose another --strategy, or a larger --step-over"
    other = "choose a smaller --tool-diameter" if strategy == "adaptive" else "use --strategy adaptive"
    other = "leave out --stock" if strategy == "adaptive" and job.rules.stock > 0.0 else other
    return f"{excess}; {other}, or give a larger limit"


# -- order and toolpath ----------------------------------------------------------------------------------------------


def _ordered(job: PocketJob, pockets: list[list[Clearing]], share: float) -> tuple[list[Clearing], Solution]:
    """Return all regions in the order in which they are cleared, and the solution; `share` of the time left is used."""
    from leafcut.order.solve import solve
    from leafcut.timing.travel import travel_metric

    clearings = [c for one in pockets for c in one]
    run, settings = job.run, job.run.settings
    problem = RoutingProblem(
        entry=np.array([c.start for c in clearings]),
        exit=np.array([c.end for c in clearings]),
        cluster=np.arange(len(clearings), dtype=np.int32),
        service=np.zeros(len(clearings)),
        precedence=_before(job, pockets),
        metric=travel_metric(run.machine, settings.solve.objective),
        start=job.start,
        end=job.heights.end,
    )
    options = replace(settings.solve, time_limit=run.deadline.part(share).seconds)
    if len(clearings) == 1:
        options = replace(options, algorithm="none", bound=False, target_gap=None)
    tell = run.passing_on("ordering the pockets")
    found = solve(
        problem, options, settings.aco, firefly=settings.firefly, progress=tell, observe=run.observe,
        cancelled=run.cancelled, bound_late=run.bound_late(BOUND_SHARE),
    )  # fmt: skip
    run.deadline.spend(found.seconds)
    return [clearings[int(node)] for node in found.nodes], found


def _before(job: PocketJob, pockets: list[list[Clearing]]) -> NDArray[np.int32]:
    """Return which region is cleared before which, int32[n, 2]: a pocket before those that lie in its floor."""
    last = np.cumsum([len(one) for one in pockets])
    rows = [list(range(end - len(one), end)) for one, end in zip(pockets, last.tolist(), strict=True)]
    pairs = [
        (first, then)
        for number, over in enumerate(job.around)
        if over is not None
        for first in rows[over]
        for then in rows[number]
    ]
    return np.array(pairs, dtype=np.int32).reshape(-1, 2)


def _laid(job: PocketJob, clearings: list[Clearing]) -> LaidPockets:
    from leafcut.processes.pocket.plan.toolpath import lay_pockets
    from leafcut.timing.toolpath import measure

    machine = job.run.machine
    pause = job.words.hand_change_pause and not machine.tool_changer
    coolant = job.run.settings.post.coolant
    corner = job.rules.tolerance if job.words.corner_tolerance else 0.0
    path, descents = lay_pockets(
        clearings,
        job.heights,
        job.data,
        machine,
        coolant=coolant,
        pause=pause,
        corner_tolerance=corner,
        rounded=job.words.rounding and job.rounding <= job.rules.stock,
    )
    path = raised(path, job.top)
    return LaidPockets(path, descents, measure(path, machine, start=job.start))


def _outcome(
    job: PocketJob,
    issues: list[Issue],
    cleared: list[_Cleared],
    solution: Solution,
    laid: tuple[LaidPockets, LaidPockets],
    even_s: float | None,
) -> Outcome[PocketDetail]:
    run, settings, (before, after) = job.run, job.run.settings, laid
    usual = dict.fromkeys(c.plan.usual.strategy for c in cleared)
    text = write_pockets(job, before, after, " and ".join(usual))
    written, left, chips = prove_pockets(job, after, text)
    pace = (
        None
        if even_s is None or chips is None
        else PaceChange(feeds_s=even_s - after.measure.time_s, changed=chips.changed, tools=(chips.tool,))
    )
    operation = OperationOutcome(job.data.tool, "", (), False, solution, cuts=len(solution.nodes))
    return Outcome(
        part=job.part,
        machine=run.machine,
        process="pocket",
        operations=(operation,),
        before=before.measure,
        nearest=None,
        after=after.measure,
        path_before=before.path,
        path_after=after.path,
        text=text,
        dialect=job.words.name,
        extension=job.words.extension,
        seed=settings.solve.seed,
        verified=True,
        written=written,
        issues=(
            *issues,
            *_entry_issues(after.descents),
            *_stops(job),
            *left,
            *machine_issues(run.machine, job.part.extents, settings.read.origin is not None),
        ),
        options=settings.changed(),
        version=__version__,
        detail=PocketDetail(
            tuple(c.plan for c in cleared),
            _programs(job, cleared, [int(node) for node in solution.nodes]),
            pace,
            None if job.solid is None else job.solid.before,
        ),
    )


def _stops(job: PocketJob) -> list[Issue]:
    """Return that the tool stands still after every move, and why, where stock would let it go on."""
    if not job.words.rounding or job.rounding <= job.rules.stock:
        return []
    words = (
        f"{job.words.name} stops after every move (G61): with G64 it would cut corners short by up to "
        f"{job.rounding:.2g} mm at this feed, into walls; give that much --stock to rough without stops"
    )
    return [Issue("L704", words, severity=Severity.NOTE)]


def _entry_issues(descents: Sequence[Descent]) -> list[Issue]:
    """Return where the tool comes down in another way than was asked for, and which holes have to be there."""
    other = [d for d in descents if d.kind != d.asked]
    issues = []
    for kind in dict.fromkeys(d.kind for d in other):
        places = list(dict.fromkeys(d.place for d in other if d.kind == kind))
        asked = next(d.asked for d in other if d.kind == kind)
        words = f"no room for a {asked}: entry changed to a {kind}"
        more = f", and at {len(places) - 1} more" if len(places) > 1 else ""
        severity = Severity.WARNING if kind == "plunge" else Severity.NOTE
        issues.append(Issue("L702", words, f"at ({places[0][0]:.3f}, {places[0][1]:.3f}){more}", severity))
    if needed := holes(descents):
        words = f"{len(needed)} holes have" if len(needed) > 1 else "a hole has"
        places = list(needed)[:4]
        at = "; ".join(f"({x:.3f}, {y:.3f})" for x, y in places) + (" …" if len(needed) > 4 else "")
        issues.append(Issue("L703", f"{words} to be there before this program runs, as deep as the pocket", f"at {at}"))
    return issues
