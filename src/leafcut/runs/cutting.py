"""A nested sheet in, a cutting program out: read, prepare, order, slide, lay, post, prove."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from leafcut import __version__
from leafcut.errors import OptionError, PlanError
from leafcut.model.cutting import CutData, CutPlan, PlanFile
from leafcut.model.issue import Issue, Severity
from leafcut.model.outcome import Measure, OperationOutcome, Outcome
from leafcut.model.problem import Metric
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import SolveOptions
from leafcut.runs.run import Run, machine_issues, passing_on, refuse, share

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.model.machine import Machine
    from leafcut.model.part import Part
    from leafcut.model.sheet import Sheet
    from leafcut.plan.cut_starts import CutStart
    from leafcut.plan.cut_toolpath import LaidCut
    from leafcut.plan.cutting import Cutting

Point = tuple[float, float]

_KINDS = {"torch": "plasma", "laser": "laser"}


@dataclass(frozen=True)
class _Job:
    """What is the same for every order of one sheet."""

    run: Run
    part: Part
    cutting: Cutting
    data: CutData
    metric: Metric
    overhead: float
    start: Point | None
    end: Point | None
    words: Dialect
    plan: PlanFile | None

    @property
    def switches(self) -> bool:
        """Whether the controller can put the torch off while it moves."""
        return _switches(self.words)

    def travel(self) -> Callable[[Point, Point], float]:
        """Return what a way costs."""
        from leafcut.timing.travel import travel_cost

        return lambda a, b: travel_cost(self.metric, a, b)


def cut(run: Run, source: str | Path) -> Outcome:
    """Return the verified cutting program of a nested sheet, and all that was found out on the way.

    Raises
    ------
    ReadError, OptionError, PlanError, SolveError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    from leafcut.plan.clear_pierces import clear_pierces
    from leafcut.plan.cutting import drawing_order, in_bands
    from leafcut.plan.following import plan_order
    from leafcut.runs.chaining import chained
    from leafcut.solve.compiling import announced
    from leafcut.verify.envelope import check_envelope

    job, issues = _prepared(run, source)
    with announced(lambda: run.tell("compiling (first run on this machine)")):
        drawn = plan_order(job.cutting, job.plan) if job.plan else drawing_order(job.cutting)
        drawn = clear_pierces(job.cutting, in_bands(job.cutting, drawn, run.settings.cut), job.travel(), None, None)
        drawn_laid = _laid(job, drawn)
        # What no order changes is known before any is sought.
        refuse(check_envelope(drawn_laid.path, run.machine))
        nearest = _nearest(job)
        cutting, spent = chained(run, job.cutting, job.overhead, job.plan)
        joined = replace(job, cutting=cutting)
        found, solutions = _ordered(joined, drawn if cutting is job.cutting else None, spent)
    planned = _as_planned(job)
    first = drawn_laid if planned is None else _laid(*planned)
    third = _laid(joined, found)
    bound = run.settings.cut.heat_distance > 0.0 or (run.settings.cut.sweep != "free" and planned is not None)
    if run.settings.resequence.keep_order or (third.score(run) > first.score(run) and not bound):
        third = first
    return _outcome(job, issues, solutions, first, _laid(job, nearest), third)


def _prepared(run: Run, source: str | Path) -> tuple[_Job, list[Issue]]:
    """Read the sheet and its rules, and make it ready for the search."""
    from leafcut.gcode.dialects import dialect
    from leafcut.plan.cut_rules import resolve_rules
    from leafcut.plan.cutting import corner_point, prepare_cutting, with_options
    from leafcut.plan.drilling import parse_zones
    from leafcut.plan.following import follow_plan
    from leafcut.post.cutting import check_words
    from leafcut.read.plan_file import load_plan
    from leafcut.timing.travel import travel_metric

    settings = run.settings
    run.tell("reading")
    data, issues = _cut_data(run)
    words = dialect(settings.post.dialect or run.machine.controller)
    rules = resolve_rules(data, settings.cut, switches=_switches(words))
    part, sheet = _sheet(run, source)
    sheet = with_options(sheet, settings.cut, parse_zones(settings.drill.keep_out))
    marks = any(c.contour.kind == "mark" for c in sheet.contours)
    check_words(words, settings.post, marks=marks, compensates=settings.cut.compensation == "controller")
    plan = load_plan(settings.cut.plan) if settings.cut.plan else None
    run.tell("looking for places to pierce")
    cutting = prepare_cutting(sheet, rules)
    if plan is not None:
        cutting = follow_plan(cutting, plan, everything=settings.resequence.keep_order)
    start = corner_point(sheet, settings.cut.start_corner) or _xy(settings.drill.start_point)
    job = _Job(
        run=run,
        part=part,
        cutting=cutting,
        data=data,
        metric=travel_metric(run.machine, settings.solve.objective),
        overhead=_overhead(run, data),
        start=start,
        end=_xy(settings.drill.end_point),
        words=words,
        plan=plan,
    )
    return job, [*sheet.issues, *issues, *cutting.issues]


def _switches(words: Dialect) -> bool:
    return words.torch is not None and words.torch.darkens


def _sheet(run: Run, source: str | Path) -> tuple[Part, Sheet]:
    """Return the drawing, and its contours made ready."""
    from leafcut.plan.sheet import prepare_sheet
    from leafcut.read import read_contours

    part = read_contours(source, run.settings.read)
    return part, prepare_sheet(part, run.settings.sheet)


def _cut_data(run: Run) -> tuple[CutData, list[Issue]]:
    from leafcut.read.cutchart import find_cut_data, load_chart

    options, thickness = run.settings.cut, run.settings.drill.thickness
    machine_kind = _KINDS.get(run.machine.process)
    if machine_kind is None:
        raise OptionError(
            f"{run.machine.name} has a spindle and cannot cut a sheet by heat or water; choose --machine plasma-table, "
            'laser-table or a profile of your own with process = "torch"'
        )
    if thickness is None:
        raise OptionError("cutting needs the sheet's thickness; give --thickness")
    return find_cut_data(
        load_chart(options.chart),
        options.cut_process or machine_kind,
        options.material,
        thickness,
        options.amps,
        feed=options.cut_speed,
        kerf=options.kerf_width,
        pierce_delay=options.pierce_delay,
        pierce_height=options.pierce_height,
        cut_height=options.cut_height,
    )


def _overhead(run: Run, data: CutData) -> float:
    """Return what each cut takes to come down and to rise, s."""
    from leafcut.timing.profile import trapezoid_time

    machine, clearance = run.machine, run.settings.drill.clearance_height
    velocity, acceleration = machine.rapid_velocity[2], machine.acceleration[2] * machine.acceleration_factor
    ways = (clearance - data.pierce_height, clearance - data.cut_height)
    return sum(trapezoid_time(max(way, 0.0), velocity, acceleration) for way in ways)


def _xy(point: tuple[float, ...] | None) -> Point | None:
    if point is not None and len(point) != 2:
        raise OptionError("--start-point and --end-point need two numbers, x,y")
    return None if point is None else (point[0], point[1])


# -- orders ----------------------------------------------------------------------------------------------------------


def _as_planned(job: _Job) -> tuple[_Job, list[CutStart]] | None:
    """Return the plan file's own order with all its choices; None without a plan, or where they do not fit any more."""
    from leafcut.plan.chaining import planned_chains, with_chains
    from leafcut.plan.following import follow_plan, plan_order

    if job.plan is None:
        return None
    try:
        cutting = follow_plan(job.cutting, job.plan, everything=True)
        cutting = with_chains(cutting, planned_chains(cutting, job.plan, everything=True))
        return replace(job, cutting=cutting), plan_order(cutting, job.plan)
    except PlanError:
        return None


def _ordered(job: _Job, before: list[CutStart] | None, spent: float = 0.0) -> tuple[list[CutStart], list[Solution]]:
    """Return the best order found, its starts slid to where they are best, and the solutions it came from.

    `before` is a known order, None for the drawing's; `spent` are seconds of the time limit that are gone.
    """
    from leafcut.plan.clear_pierces import clear_pierces
    from leafcut.plan.cutting import bands, drawing_order, in_bands
    from leafcut.plan.heat import HeatRule, spread_starts
    from leafcut.plan.sliding import slide_starts

    run, options = job.run, job.run.settings
    before = in_bands(job.cutting, drawing_order(job.cutting), options.cut) if before is None else before
    if options.resequence.keep_order:
        return before, []
    order, solutions = _solve_bands(job, options.solve, before, spent)
    travel = job.travel()
    if options.solve.algorithm == "none":
        return clear_pierces(job.cutting, order, travel, job.start, job.end), solutions
    run.tell("sliding the starts")
    order = slide_starts(job.cutting, order, travel, job.start, job.end)
    if options.cut.heat_distance > 0.0:
        rule = HeatRule(options.cut.heat_distance, options.cut.heat_time)
        order = spread_starts(job.cutting, order, rule, travel, job.start, bands(job.cutting, options.cut))
    return clear_pierces(job.cutting, order, travel, job.start, job.end), solutions


def _nearest(job: _Job) -> list[CutStart]:
    """Return the nearest-neighbour order."""
    from leafcut.plan.clear_pierces import clear_pierces

    quiet = replace(job, run=replace(job.run, progress=None))
    order = _solve_bands(quiet, SolveOptions(algorithm="nn", bound=False, threads=1), None)[0]
    return clear_pierces(job.cutting, order, job.travel(), job.start, job.end)


def _solve_bands(
    job: _Job, options: SolveOptions, before: list[CutStart] | None, spent: float = 0.0
) -> tuple[list[CutStart], list[Solution]]:
    """Order band after band, each beginning where the one before ended; `spent` seconds of the limit are gone."""
    from leafcut.plan.cutting import bands, build_problem
    from leafcut.solve.solve import keep_better, solve

    cutting, run = job.cutting, job.run
    groups = bands(cutting, run.settings.cut)
    total = left = sum(map(len, groups))
    place, solutions = job.start, list[Solution]()
    order: list[CutStart] = []
    for number, members in enumerate(groups, 1):
        end = job.end if number == len(groups) else None
        problem, starts = build_problem(cutting, members, job.metric, job.overhead, place, end)
        name = "ordering the cuts" if len(groups) == 1 else f"ordering band {number}"
        tell = passing_on(run.progress, name, left / total, len(members) / total)
        budget = share(options, spent + sum(s.seconds for s in solutions), left, problem)
        found = solve(problem, budget, run.settings.aco, progress=tell, cancelled=run.cancelled)
        if before is not None and options.algorithm != "nn":
            node_of = {int(n): k for k, n in enumerate(starts)}
            position = {id(s): n for n, s in enumerate(cutting.starts)}
            inside = set(members)
            nodes = [node_of[position[id(s)]] for s in before if s.contour in inside]
            found = keep_better(problem, found, np.array(nodes, dtype=np.int32))
        solutions.append(found)
        order += [cutting.starts[int(starts[node])] for node in found.nodes]
        left -= len(members)
        place = order[-1].exit
    _check_precedence(cutting, order)
    return order, solutions


def _check_precedence(cutting: Cutting, order: Sequence[CutStart]) -> None:
    """Refuse an order that cuts a part loose before what is inside it: nothing later would see it."""
    cut = [k for s in order for k in s.contours]
    at = {k: place for place, k in enumerate(cut)}
    if len(at) != len(cutting.contours) or len(cut) != len(at):
        raise PlanError("the order does not cut every contour once; this is a fault of the algorithm, choose another")
    for a, b in cutting.pairs:
        if at[a] > at[b]:
            raise PlanError(
                f"{cutting.contours[b].name()} would be cut before {cutting.contours[a].name()}; take 'order' out of "
                "the plan file, or leave out --sweep"
            )


# -- toolpath, time and program --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Laid:
    """An order as motions, and what it costs."""

    plan: CutPlan
    path: Toolpath
    rows: list[LaidCut]
    measure: Measure
    order: list[CutStart]

    def score(self, run: Run) -> float:
        return self.measure.time_s if run.settings.solve.objective == "time" else self.measure.travel_mm


def _laid(job: _Job, order: list[CutStart]) -> _Laid:
    from leafcut.plan.cut_norm import cut_norm
    from leafcut.plan.cut_toolpath import TORCH_ON, lay_cuts
    from leafcut.plan.leads_apart import leads_apart
    from leafcut.timing.toolpath import measure

    machine, settings, torch = job.run.machine, job.run.settings, job.words.torch
    _check_precedence(job.cutting, order)
    order = leads_apart(job.cutting, order, job.travel(), job.start, job.end)
    cuts = tuple(job.cutting.cut(s) for s in order)
    path, rows = lay_cuts(
        cuts,
        job.data,
        machine,
        clearance=settings.drill.clearance_height,
        end=job.end,
        switches=job.switches,
        power=settings.post.beam_power if torch is not None and torch.power else TORCH_ON,
        mark_power=settings.post.mark_power if torch is not None and torch.power else TORCH_ON,
        tolerance=settings.post.path_tolerance if torch is not None else 0.0,
    )
    whole = measure(path, machine)
    seconds = _cut_seconds(path, rows, machine)
    norm = cut_norm(job.cutting.sheet, cuts, seconds, whole.time_s, settings.cut)
    return _Laid(CutPlan(job.cutting.sheet, job.data, cuts, norm), path, rows, whole, order)


def _cut_seconds(path: Toolpath, rows: list[LaidCut], machine: Machine) -> list[tuple[float, float, float]]:
    """Return the seconds of every cut: cutting, piercing, rapids."""
    from leafcut.timing.toolpath import seconds_by_row

    moving = seconds_by_row(path, machine)
    rapid = path.kind == Kind.RAPID
    waiting = np.where(path.kind == Kind.DWELL, path.value, 0.0)
    columns = (np.where(rapid, 0.0, moving), waiting, np.where(rapid, moving, 0.0))
    return [
        (float(columns[0][r].sum()), float(columns[1][r].sum()), float(columns[2][r].sum()))
        for r in (slice(row.first, row.last) for row in rows)
    ]


def _outcome(
    job: _Job, issues: list[Issue], solutions: list[Solution], before: _Laid, nearest: _Laid, after: _Laid
) -> Outcome:
    run, settings = job.run, job.run.settings
    text = _write(job, before, after)
    verified = _verify(job, after, text)
    tool = Tool(number=1, diameter=job.data.kerf, kind=ToolKind.TORCH, name=job.data.process, feed=job.data.feed)
    return Outcome(
        part=job.part,
        machine=run.machine,
        process="cut",
        operations=tuple(
            OperationOutcome(tool, "", (), False, s, cuts=len(s.nodes))
            for s in (solutions if after is not before else [])
        ),
        before=before.measure,
        nearest=nearest.measure,
        after=after.measure,
        path_before=before.path,
        path_after=after.path,
        text=text,
        dialect=job.words.name,
        seed=settings.solve.seed,
        verified=verified,
        issues=(*issues, *_heat_issues(job, after), *_probing_issues(job, after), *machine_issues(run.machine)),
        options=settings.changed(),
        version=__version__,
        cut_plans=(before.plan, nearest.plan, after.plan),
    )


def _heat_issues(job: _Job, laid: _Laid) -> list[Issue]:
    from leafcut.plan.heat import HeatRule, too_near

    options = job.run.settings.cut
    if options.heat_distance <= 0.0:
        return []
    left = too_near(job.cutting, laid.order, HeatRule(options.heat_distance, options.heat_time))
    if not left:
        return [Issue("L614", f"no cut starts within {options.heat_distance:g} mm of a hot one", "", Severity.NOTE)]
    x, y = laid.order[left[0][1]].entry
    words = f"{len(left)} cuts start within {options.heat_distance:g} mm of one just made: no order avoids them"
    return [Issue("L614", words, f"the first at ({x:.4g}, {y:.4g})")]


def _probing_issues(job: _Job, laid: _Laid) -> list[Issue]:
    """Warn of starts in the air under a controller that probes before each cut: it would find a slat, or nothing."""
    torch = job.words.torch
    starts = [c.path.start for c in laid.plan.cuts if c.kind == "cut" and not c.pierce]
    if torch is None or torch.heights != "controller" or not starts:
        return []
    words = (
        f"{len(starts)} cuts start beyond the sheet's edge, where the controller probes beside the sheet: lay a piece "
        "of the same thickness there, or give --dialect plasma, which does not probe"
    )
    return [Issue("L618", words, f"the first at ({starts[0][0]:.4g}, {starts[0][1]:.4g})")]


def _write(job: _Job, before: _Laid, after: _Laid) -> str:
    from leafcut.post.cutting import write_cut_program
    from leafcut.post.header import header_lines

    settings = job.run.settings
    header = header_lines(
        source=Path(job.part.source or job.part.name).name,
        version=__version__,
        machine=job.run.machine,
        tools=(),
        path=after.path,
        seconds=(before.measure.time_s, after.measure.time_s),
        seed=settings.solve.seed,
        options=settings.changed(),
        units=settings.post.output_units,
        date=settings.post.date,
    )
    return write_cut_program(after.plan, after.path, job.words, settings.post, header)


def _verify(job: _Job, laid: _Laid, text: str) -> bool:
    """Read the program back and compare it with the toolpath; check it against the drawing and the machine.

    The one place where a cutting program is proved: nothing that fails here is written.

    Raises
    ------
    VerifyError
        The first difference or danger, and how many more there are.
    """
    from leafcut.verify.cut_motion import check_cut_motion
    from leafcut.verify.sheet import Asked, check_sheet

    job.run.tell("verifying")
    settings, machine = job.run.settings, job.run.machine
    refuse(check_cut_motion(laid.path, laid.plan, text, job.words, settings.post.output_units))
    asked = Asked(
        half=job.cutting.rules.half,
        joints=settings.cut.micro_joints,
        joint_width=settings.cut.joint_width,
        safe_height=settings.drill.clearance_height,
    )
    refuse(check_sheet(job.cutting.sheet, laid.plan, text, job.words, machine, asked))
    return True
