"""A drawing in, a drilling program out: read, plan, solve, lay, post, read back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut._version import __version__
from leafcut.errors import OptionError
from leafcut.model.cutter import bodies_of
from leafcut.model.measure import Measure
from leafcut.model.mesh import Mesh
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import ProgramZero
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.model.toolpath import Toolpath
from leafcut.options import SolveOptions, flag_name
from leafcut.processes.course import (
    Run,
    check_words_used,
    library_of,
    machine_issues,
    refuse,
    refuse_missing,
    refuse_too_large,
)
from leafcut.processes.deadline import Deadline
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.processes.drilling.options import DrillOptions
from leafcut.processes.placing import negative_axes

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.model.part import Part
    from leafcut.processes.drilling.judge import DrillingRequest
    from leafcut.processes.drilling.plan.drilling import DrillPlan
    from leafcut.read.format import Source


def _with_work_asked_for(part: Part, run: Run, source: Source, everything: bool) -> Part:
    """Return a part whose issues call missing what was asked for.

    Whoever asks for drilling asks for no contours; whoever says which of several circles with one centre is the hole
    asks for no other. Without such a choice contours, and pockets of a solid, are missing as well.
    """
    chosen = "concentric" in run.settings.given
    issues = [issue.as_note() if issue.code == "L302" and chosen else issue for issue in part.issues]
    besides = [*part.besides]
    if everything and any(hole.depth is not None for hole in part.holes):
        from leafcut.read.step import work_besides_holes

        besides += work_besides_holes(source, run.settings.read)
    issues += besides if everything else [issue.as_note() for issue in besides]
    return replace(part, issues=tuple(issues), besides=())


def _meshes(run: Run, source: Source, part: Part, of_step: bool) -> tuple[Mesh | None, Mesh | None]:
    """Return the surface with the holes of a part, and its fixture, in the axes and with the zero of the part."""
    ours, which = run.settings.of(DrillOptions), run.settings.read.solid
    solid = any(hole.depth is not None for hole in part.holes)
    if ours.surface is None and ours.fixture_file is None and not solid:
        return None, None
    from leafcut.processes.placing import upright_mesh
    from leafcut.read.meshes import load_mesh
    from leafcut.read.registry import format_name
    from leafcut.read.step import step_mesh

    surface = fixture = None
    if ours.surface is not None:
        run.tell("reading the surface")
        if which is not None and of_step and format_name(ours.surface) != part.format:
            which = None  # it was of the drawing
        surface = load_mesh(ours.surface, ours.surface_unit, which=which)
    elif solid:
        # What stands between the holes of a solid is known.
        run.tell("reading the surface")
        surface = Mesh(step_mesh(source.path, source.data, which), part.name)
    if ours.fixture_file is not None:
        run.tell("reading the fixture")
        fixture = load_mesh(ours.fixture_file, ours.surface_unit, which="all")
    return (
        None if surface is None else upright_mesh(surface, part),
        None if fixture is None else upright_mesh(fixture, part),
    )


def _plan(run: Run, sources: Sequence[Source], everything: bool = False) -> tuple[DrillPlan, DrillingRequest]:
    """Return the plan, and what the judge of its program sees: the part and the surface as they were read."""
    from leafcut.processes.drilling.judge import DrillingRequest
    from leafcut.processes.drilling.plan.drilling import plan_drilling
    from leafcut.processes.placing import placed, placed_mesh, placing_words
    from leafcut.read import Match, read
    from leafcut.read.format import SNIFF_BYTES
    from leafcut.read.recognition import sniff_step

    look, reading = run.looking("reading"), run.settings.read
    job, ours = run.settings.job, run.settings.of(DrillOptions)
    of_step = any(sniff_step(source.data[:SNIFF_BYTES]) is Match.YES for source in sources)
    if ours.surface is not None and not of_step:
        # The solid is that of the surface.
        reading = replace(reading, solid=None)
    if len(sources) == 1:
        part = read(sources[0], reading, look)
    else:
        from leafcut.read.joining import read_drill_files

        part = read_drill_files(sources, reading, look)
    part = _with_work_asked_for(part, run, sources[0], everything)
    solid = any(hole.depth is not None for hole in part.holes)
    if solid and "hole_heights" in run.settings.asked and ours.hole_heights == "one":
        raise OptionError("--hole-heights one: the holes of a solid have heights of their own; leave it out")
    surface, fixture = _meshes(run, sources[0], part, of_step)
    mesh, fixture = (None if one is None else placed_mesh(one, part, run.settings.read) for one in (surface, fixture))
    library = library_of(run.settings, run.machine)
    request = DrillingRequest(part, run.settings.read, job, ours, library, surface)
    made_for = "" if mesh is None else placing_words(str(ours.surface or sources[0].path), part, run.settings.read)
    part = placed(part, run.settings.read)
    if not solid and mesh is not None:
        part = replace(part, zero=replace(part.zero or ProgramZero(), level="surface", z=float(mesh.high[2])))
    elif not solid and ours.hole_heights == "drawn" and part.holes:
        part = replace(
            part, zero=replace(part.zero or ProgramZero(), level="holes", z=max(hole.z for hole in part.holes))
        )
    plan = replace(plan_drilling(part, run.machine, library, job, ours, mesh, fixture), made_for=made_for)
    if "retract" in run.settings.asked and plan.always_initial and job.retract != "initial":
        raise OptionError(
            "--retract r: what stands between holes of different heights is not known, so the tool rises over the "
            "highest after each; leave it out"
        )
    for name in ("feed", "spindle_speed"):
        if name in run.settings.asked and not any(tool.assumed for tool in plan.tools):
            raise OptionError(f"{flag_name(name)}: every tool of {job.tools} has its own; leave it out")
    return plan, request


def drill(run: Run, *sources: Source, everything: bool = False) -> Outcome[DrillingDetail]:
    """Return the verified drilling program of a drawing, or of several drill files, and all that was found out.

    Parameters
    ----------
    everything
        Nobody asked for drilling alone: contours and pockets that no drill makes are missing work, too.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    tools = run.settings.job.tools
    if "material" in run.settings.asked and tools is not None:
        from leafcut.read.tool_formats import WITH_PRESETS

        if tools.suffix.lower() not in WITH_PRESETS:
            raise OptionError("--material: chooses among the presets of a Fusion tool library only; leave it out")
    plan, request = _plan(run, sources, everything)
    refuse_missing(run.settings, sources[0], (*plan.part.issues, *plan.issues))
    return _order(run, plan, request)


def _order(run: Run, plan: DrillPlan, request: DrillingRequest) -> Outcome[DrillingDetail]:
    """Order the work, lay the toolpath, and prove the program before anybody sees it."""
    from leafcut.gcode.dialects import dialect
    from leafcut.order.compiling import announced
    from leafcut.processes.drilling.plan.drill_toolpath import drawing_order, lay_toolpath, targets_in_order
    from leafcut.proof.envelope import check_envelope
    from leafcut.timing.toolpath import measure

    words = dialect(run.settings.post.dialect or run.machine.controller)
    run = run.for_words(words)
    check_words_used(run.settings, run.machine, words)
    pause = words.hand_change_pause and not run.machine.tool_changer

    post = run.settings.post

    def lay(orders: list[NDArray[np.int32]], plan: DrillPlan = plan) -> Toolpath:
        return lay_toolpath(
            plan, run.machine, orders, coolant=post.coolant, pause=pause, optional_stop=post.optional_stop
        )

    # What no order changes is known before any is sought.
    drawn = lay([drawing_order(o) for o in plan.operations])
    refuse_too_large(check_envelope(drawn, run.machine), plan.part, run.settings)
    with announced(run.tell):
        nearest = _solve_operations(run.quiet(), plan, SolveOptions(algorithm="nn", bound=False))
        solutions = _solve_operations(run, plan, run.settings.solve)
    plans = [[drawing_order(o) for o in plan.operations], [s.nodes for s in nearest], [s.nodes for s in solutions]]
    paths = [lay(orders) for orders in plans]
    measures = [measure(path, run.machine, start=plan.start) for path in paths]
    costs = [m.time_s if run.settings.solve.objective == "time" else m.travel_mm for m in measures]
    winner = int(np.argmin(costs))
    free = run.settings.solve.algorithm not in ("nn", "none") and run.settings.of(DrillOptions).hole_order is None
    if free and costs[winner] < costs[2]:
        # No tool's path is longer than theirs, but where one tool ends the next begins: all together may be.
        solutions = _restated(run, plan, plans[winner], solutions, ("none", "nn")[winner])
        paths[2], measures[2] = paths[winner], measures[winner]
    before, after = paths[0], paths[2]
    text = _write(run, plan, words, after, measures)
    return Outcome(
        part=plan.part,
        machine=run.machine,
        process="drill",
        operations=tuple(
            OperationOutcome(
                o.tool,
                o.cycle.name if o.cycle.name in words.cycles else "",
                tuple(targets_in_order(o, s.nodes).tolist()),
                o.slots,
                s,
            )
            for o, s in zip(plan.operations, solutions, strict=True)
        ),
        before=measures[0],
        nearest=measures[1],
        after=measures[2],
        path_before=before,
        path_after=after,
        text=text,
        dialect=words.name,
        extension=words.extension,
        seed=run.settings.solve.seed,
        verified=True,
        written=_verify(run, plan, request, words, after, text),
        issues=(
            *plan.part.issues,
            *plan.issues,
            *machine_issues(run.machine, plan.part.extents, run.settings.read.origin is not None),
        ),
        options=run.settings.changed(),
        version=__version__,
        detail=DrillingDetail(
            _saved_by_low_ways(run, plan, lay, [s.nodes for s in solutions], measures[2]),
            run.settings.job.thickness,
            None if plan.ground is None else plan.ground.mesh,
            () if plan.ground is None else plan.ground.boxes,
        ),
    )


def _saved_by_low_ways(
    run: Run, plan: DrillPlan, lay: Callable[..., Toolpath], orders: list[NDArray[np.int32]], after: Measure
) -> float | None:
    """Return how much longer the same order takes with all ways over the highest place, s; None where all is flat."""
    from leafcut.timing.toolpath import measure

    if not plan.reliefs:
        return None
    over = tuple(replace(o, cycle=replace(o.cycle, to_initial=True)) for o in plan.operations)
    high = replace(plan, operations=over, always_initial=True, reliefs=())
    return measure(lay(orders, high), run.machine, start=plan.start).time_s - after.time_s


def _problems(run: Run, plan: DrillPlan) -> list[RoutingProblem]:
    """Return one routing problem per operation, with no start yet: it depends on the one before."""
    from leafcut.processes.drilling.plan.drill_toolpath import build_problem
    from leafcut.timing.travel import travel_metric

    height = 0.0 if plan.always_initial else plan.clearance_height - plan.retract_height
    problems = []
    for number, operation in enumerate(plan.operations):
        objective = run.settings.solve.objective
        if plan.reliefs:
            metric = travel_metric(run.machine, objective, relief=plan.reliefs[number])
        else:
            zones = plan.high_zones_for(operation.tool)
            metric = travel_metric(run.machine, objective, zones=zones, lift_height_mm=height)
        end = plan.end if operation is plan.operations[-1] else None
        problems.append(build_problem(plan, operation, metric, None, end))
    return problems


def _solve_operations(run: Run, plan: DrillPlan, options: SolveOptions) -> list[Solution]:
    """Solve one routing problem per operation, each beginning where the one before ends; all are ordered together."""
    from leafcut.order.solve import solve
    from leafcut.processes.drilling.hole_order import wanted_nodes
    from leafcut.processes.drilling.plan.drill_toolpath import drawing_order
    from leafcut.processes.together import Stage, solve_together

    problems = _problems(run, plan)
    total = left = sum(problem.n_clusters for problem in problems)
    deadline = run.deadline if options.algorithm != "nn" else Deadline()

    def search(number: int, problem: RoutingProblem, options: SolveOptions) -> Solution:
        nonlocal left
        label, holes = plan.operations[number].tool.label, problems[number].n_clusters
        tell = run.passing_on(f"ordering {label}", left / total, holes / total)
        own = replace(options, time_limit=deadline.part(problem.n_clusters / left).seconds)
        found = solve(
            problem, own, run.settings.aco, firefly=run.settings.firefly, progress=tell, observe=run.observe,
            cancelled=run.cancelled, bound_late=run.bound_late(holes / total),
        )  # fmt: skip
        deadline.spend(found.seconds)
        left = max(left - holes, 1)
        return found

    def quick(_: int, problem: RoutingProblem, options: SolveOptions) -> Solution:
        found = solve(problem, options, run.settings.aco, firefly=run.settings.firefly, cancelled=run.cancelled)
        deadline.spend(found.seconds)
        return found

    wanted = {} if options.algorithm == "nn" else wanted_nodes(plan, run.settings.of(DrillOptions).hole_order)
    if wanted:
        return _as_wanted(run, plan, problems, wanted, partial(search, options=options))
    stages = [
        Stage(replace(problem, start=None if number else plan.start), number > 0, drawing_order(operation))
        for number, (operation, problem) in enumerate(zip(plan.operations, problems, strict=True))
    ]
    return solve_together(
        stages, search, options, quick, run.cancelled, lambda problem: run.bound_late(problem.n_clusters / total)
    )


def _as_wanted(
    run: Run, plan: DrillPlan, problems: list[RoutingProblem], wanted: dict[int, NDArray[np.int32]],
    search: Callable[[int, RoutingProblem], Solution],
) -> list[Solution]:  # fmt: skip
    """Solve one operation after another, those with holes that are wanted first around these."""
    from leafcut.order.certificate import certify
    from leafcut.order.solve import keep_better
    from leafcut.processes.drilling.hole_order import solve_after
    from leafcut.processes.drilling.plan.drill_toolpath import drawing_order, last_place

    place, solutions = plan.start, list[Solution]()
    for number, (operation, endless) in enumerate(zip(plan.operations, problems, strict=True)):
        problem = replace(endless, start=place)
        if number in wanted:
            bound = run.settings.solve.bound
            late = run.bound_late(1.0 / len(problems))
            seek = partial(certify, problem, bound=None, cancelled=run.cancelled, late=late) if bound else _as_it_is
            solutions.append(solve_after(problem, wanted[number], partial(search, number), seek))
        else:
            solutions.append(keep_better(problem, search(number, problem), drawing_order(operation)))
        place = last_place(problem, solutions[-1].nodes, place)
    return solutions


def _as_it_is(solution: Solution) -> Solution:
    return solution


def _restated(
    run: Run, plan: DrillPlan, orders: list[NDArray[np.int32]], solutions: list[Solution], algorithm: str
) -> list[Solution]:
    """Return the solutions with other orders in place of theirs, at those orders' costs and bounds."""
    from leafcut.order.certificate import certify
    from leafcut.order.instance import path_cost
    from leafcut.processes.drilling.plan.drill_toolpath import last_place

    place, restated = plan.start, list[Solution]()
    for problem, nodes, solution in zip(_problems(run, plan), orders, solutions, strict=True):
        here = replace(problem, start=place)
        cost = path_cost(here, nodes)
        told = replace(
            solution, algorithm=algorithm, nodes=nodes, cost=cost, history=((solution.seconds, cost),), lower_bound=None
        )
        # The bound of the search was that of a path from where the search's own order before it ended.
        late = run.bound_late(1.0 / len(solutions))
        bound = run.settings.solve.bound
        restated.append(certify(here, told, None, run.cancelled, late=late) if bound else told)
        place = last_place(here, nodes, place)
    return restated


def _write(run: Run, plan: DrillPlan, words: Dialect, path: Toolpath, measures: list[Measure]) -> str:
    from leafcut.post.header import header_lines
    from leafcut.post.writer import write_program

    settings = run.settings
    header = header_lines(
        source=Path(plan.part.source or plan.part.name).name,
        zero=plan.part.zero,
        negative=negative_axes(plan.part.extents, run.machine),
        version=__version__,
        machine=run.machine,
        tools=plan.tools,
        path=path,
        seconds=(measures[0].time_s, measures[2].time_s),
        seed=settings.solve.seed,
        options=settings.changed(),
        units=settings.post.output_units,
        part=plan.made_for,
    )
    names = {tool.number: tool.label.split(" ", 1)[1] for tool in plan.tools}
    rapid = max(run.machine.rapid_velocity)
    return write_program(path, words, settings.post, header, tool_names=names, rapid_velocity=rapid)


def _verify(run: Run, plan: DrillPlan, request: DrillingRequest, words: Dialect, path: Toolpath, text: str) -> Toolpath:
    """Return the program read back, compared with the toolpath and checked against machine, drawing and options.

    Raises
    ------
    VerifyError
        The first difference or danger, and how many more there are.
    """
    from leafcut.processes.drilling.judge import judge_holes
    from leafcut.processes.zones import crossing_heights
    from leafcut.proof.program import check_program, read_back, rounding_of

    run.tell("verifying")
    written = read_back(text, words)
    tops = None
    if run.settings.of(DrillOptions).hole_heights == "drawn" or plan.solid:
        # Of the drawing, not of the plan.
        tops = np.array([(hole.x, hole.y, hole.z) for hole in plan.part.holes], dtype=np.float64).reshape(-1, 3)
    elif plan.ground is not None:
        tops = np.column_stack([plan.part.hole_xy, plan.tops])
    problems = check_program(
        path,
        written,
        words,
        run.machine,
        run.settings.post.output_units,
        zones=plan.zones,
        zone_height=crossing_heights(run.settings.job.keep_out, plan.clearance_height),
        tool_radii={tool.number: 0.5 * tool.diameter for tool in plan.tools},
        bodies={tool.number: bodies_of(tool) for tool in plan.tools},
        tops=tops,
        surface=None if plan.ground is None else plan.ground.triangles,
    )
    refuse([*problems, *judge_holes(request, text, written, rounding_of(words, run.settings.post.output_units))])
    return written
