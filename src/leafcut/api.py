"""The whole way in one place: read, plan, solve, lay, post, read back, verify, write, report.

The only file that joins the rooms. Rooms are imported where they are used, so `import leafcut` stays quick.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut import __version__
from leafcut.errors import OptionError, VerifyError
from leafcut.files import check_output, read_program, write_whole
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.outcome import Measure, OperationOutcome, Outcome
from leafcut.model.part import Part
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution
from leafcut.model.toolpath import Toolpath
from leafcut.options import Settings, SolveOptions

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.plan.drilling import DrillPlan

#: Told about the work as it goes: (what is being done, cost so far or None, share done 0 … 1, how far at most the cost
#: is above the least possible as a fraction, or None where no bound is known yet). Must be quick.
Progress = Callable[[str, float | None, float, float | None], None]


@dataclass(frozen=True)
class Run:
    """What every step of one run needs."""

    settings: Settings
    machine: Machine
    progress: Progress | None = None
    cancelled: threading.Event = field(default_factory=threading.Event)

    def tell(self, what: str, cost: float | None = None, share: float = 0.0, gap: float | None = None) -> None:
        """Pass on what is being done."""
        if self.progress is not None:
            self.progress(what, cost, share, gap)


def optimize(
    source: str | Path,
    output: str | Path | None = None,
    *,
    report: str | Path | None = None,
    options_file: str | Path | None = None,
    progress: Progress | None = None,
    cancelled: threading.Event | None = None,
    **options: Any,
) -> Outcome:
    """Turn a drawing into a verified drilling program with the shortest machine time.

    Parameters
    ----------
    source
        A drawing or a map that `leafcut.read_part` understands, or the name of an example such as ``example:plate-70``.
    output, report
        Where to write the program and the report page; nothing is written without them.
    options_file
        A TOML file of options.
    progress
        Called as the work goes on with (what, cost so far or None, share done, gap or None).
    cancelled
        Set it from another thread to stop the search and keep the best.
    options
        Any option of `leafcut.options` by its name: ``machine="haas-vf2", thickness="0.25in", seed=7``. A number
        without a unit is what it is on the command line: mm, s, rpm, and mm/min for feeds.

    Returns
    -------
    Outcome
        Toolpaths, measures before and after, the program's text and all else that was found out.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError, OutputError
        One line that says what was found and what to do. Nothing has been written then.
    """
    began = time.perf_counter()
    settings = Settings.collect(options, Path(options_file) if options_file else None)
    profile = settings.machine.machine
    inputs = [source, options_file, settings.drill.tools, profile if profile.endswith(".toml") else None]
    for target in (output, report):
        check_output(target, inputs)
    check_output(report, [output])
    run = Run(settings, _machine(settings), progress, cancelled or threading.Event())
    plan = _plan(run, source)
    outcome = replace(_order(run, plan), output=str(output or ""), report=str(report or ""))
    outcome = replace(outcome, seconds=time.perf_counter() - began)
    page = _page(outcome) if report else ""  # before anything is written: it may fail
    if output:
        write_whole(output, outcome.text)
    if report:
        write_whole(report, page)
    return outcome


def _machine(settings: Settings) -> Machine:
    from leafcut.read.machine import load_machine

    offset = settings.machine.work_offset
    if offset is not None and len(offset) != 3:
        raise OptionError("--work-offset: needs three numbers, x,y,z")
    return load_machine(settings.machine.machine, offset)


def _plan(run: Run, source: str | Path) -> DrillPlan:
    from leafcut.plan.drilling import plan_drilling
    from leafcut.read import read
    from leafcut.read.tools import load_tools

    run.tell("reading")
    part = read(source, run.settings.read)
    tools = run.settings.drill.tools
    return plan_drilling(part, run.machine, load_tools(tools) if tools else None, run.settings.drill)


def _order(run: Run, plan: DrillPlan) -> Outcome:
    """Order the work, lay the toolpath, and prove the program before anybody sees it."""
    from leafcut.gcode.dialects import dialect
    from leafcut.plan.routing import drawing_order, lay_toolpath, targets_in_order
    from leafcut.solve.compiling import announced
    from leafcut.timing.toolpath import measure

    words = dialect(run.settings.post.dialect or run.machine.controller)
    pause = words.hand_change_pause and not run.machine.tool_changer

    def lay(orders: list[NDArray[np.int32]]) -> Toolpath:
        return lay_toolpath(plan, run.machine, orders, coolant=run.settings.post.coolant, pause=pause)

    with announced(lambda: run.tell("compiling (first run on this machine)")):
        solutions = _solve_operations(run, plan, run.settings.solve)
        nearest = _solve_operations(replace(run, progress=None), plan, SolveOptions(algorithm="nn", bound=False))
    orders = [drawing_order(o) for o in plan.operations]
    before, after = lay(orders), lay([s.nodes for s in solutions])
    measures = [measure(path, run.machine) for path in (before, lay([s.nodes for s in nearest]), after)]
    if run.settings.solve.objective == "time" and measures[2].time_s > measures[0].time_s:
        # Each tool's path is no longer than the drawing's, but where one ends the next begins: all together may be.
        solutions = _restated(run, plan, orders, solutions)
        after, measures[2] = before, measures[0]
    text = _write(run, plan, words, after, measures)
    return Outcome(
        part=plan.part,
        machine=run.machine,
        process="drill",
        operations=tuple(
            OperationOutcome(o.tool, o.cycle.name, tuple(targets_in_order(o, s.nodes).tolist()), o.slots, s)
            for o, s in zip(plan.operations, solutions, strict=True)
        ),
        before=measures[0],
        nearest=measures[1],
        after=measures[2],
        path_before=before,
        path_after=after,
        text=text,
        dialect=words.name,
        seed=run.settings.solve.seed,
        verified=_verify(run, plan, words, after, text),
        issues=(*plan.part.issues, *plan.issues, *_machine_issues(run.machine)),
        options=run.settings.changed(),
        version=__version__,
    )


def _problems(run: Run, plan: DrillPlan) -> list[RoutingProblem]:
    """Return one routing problem per operation, with no start yet: it depends on the one before."""
    from leafcut.plan.routing import build_problem
    from leafcut.timing.travel import travel_metric

    height = 0.0 if plan.always_initial else plan.clearance_height - plan.retract_height
    problems = []
    for operation in plan.operations:
        zones = plan.zones_for(operation.tool)
        metric = travel_metric(run.machine, run.settings.solve.objective, zones=zones, lift_height_mm=height)
        end = plan.end if operation is plan.operations[-1] else None
        problems.append(build_problem(plan, operation, metric, None, end))
    return problems


def _solve_operations(run: Run, plan: DrillPlan, options: SolveOptions) -> list[Solution]:
    """Solve one routing problem per operation, each beginning where the one before ended."""
    from leafcut.plan.routing import drawing_order, last_place
    from leafcut.solve.solve import keep_better, solve

    total = left = sum(len(o.targets) for o in plan.operations)
    place, solutions = plan.start, list[Solution]()
    for operation, endless in zip(plan.operations, _problems(run, plan), strict=True):
        problem = replace(endless, start=place)
        tell = _passing_on(run.progress, f"ordering {operation.tool.label}", left / total, problem.n_clusters / total)
        budget = _share(options, sum(s.seconds for s in solutions), left, problem)
        found = solve(problem, budget, run.settings.aco, progress=tell, cancelled=run.cancelled)
        if options.algorithm != "nn":
            found = keep_better(problem, found, drawing_order(operation))
        solutions.append(found)
        left -= problem.n_clusters
        place = last_place(problem, found.nodes, place)
    return solutions


def _passing_on(
    progress: Progress | None, what: str, left: float = 1.0, part: float = 1.0
) -> Callable[[int, float, float, float, float | None], None]:
    """Return what `solve` tells its progress to; this search does `part` of the whole work, of which `left` is left."""

    def tell(_: int, cost: float, __: float, share: float, gap: float | None) -> None:
        if progress is not None:
            progress(what, cost, 1.0 - left + part * share, gap)

    return tell


def _share(options: SolveOptions, used: float, left: int, problem: RoutingProblem) -> SolveOptions:
    """Return the options with this operation's part of the time that is left, by its part of the targets `left`.

    `used` are the seconds that the searches before took: lower bounds and compiling are outside the limit.
    """
    if options.time_limit is None:
        return options
    rest = options.time_limit - used
    return replace(options, time_limit=max(rest * problem.n_clusters / left, 0.001))


def _restated(run: Run, plan: DrillPlan, orders: list[NDArray[np.int32]], solutions: list[Solution]) -> list[Solution]:
    """Return the solutions with the drawing's own orders in place of theirs, at those orders' cost.

    Their lower bounds go, but for the first: they were of paths from where leafcut's orders ended.
    """
    from leafcut.plan.routing import last_place
    from leafcut.solve.instance import path_cost

    place, restated = plan.start, list[Solution]()
    for problem, nodes, solution in zip(_problems(run, plan), orders, solutions, strict=True):
        here = replace(problem, start=place)
        cost = path_cost(here, nodes)
        bound = None if restated else solution.lower_bound
        restated.append(
            replace(solution, nodes=nodes, cost=cost, history=((solution.seconds, cost),), lower_bound=bound)
        )
        place = last_place(here, nodes, place)
    return restated


def _write(run: Run, plan: DrillPlan, words: Dialect, path: Toolpath, measures: list[Measure]) -> str:
    from leafcut.post.header import header_lines
    from leafcut.post.writer import write_program

    settings = run.settings
    header = header_lines(
        source=Path(plan.part.source or plan.part.name).name,
        version=__version__,
        machine=run.machine,
        tools=plan.tools,
        path=path,
        seconds=(measures[0].time_s, measures[2].time_s),
        seed=settings.solve.seed,
        options=settings.changed(),
        units=settings.post.output_units,
        date=settings.post.date,
    )
    names = {tool.number: tool.label.split(" ", 1)[1] for tool in plan.tools}
    return write_program(path, words, settings.post, header, tool_names=names)


def _verify(run: Run, plan: DrillPlan, words: Dialect, path: Toolpath, text: str) -> bool:
    """Read the program back and compare it with the toolpath; check it against the machine and the part.

    Raises
    ------
    VerifyError
        The first difference or danger, and how many more there are.
    """
    from leafcut.verify.program import check_program

    run.tell("verifying")
    problems = check_program(
        path,
        text,
        words,
        run.machine,
        run.settings.post.output_units,
        zones=plan.zones,
        zone_height=plan.clearance_height,
        tool_radii={tool.number: 0.5 * tool.diameter for tool in plan.tools},
    )
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise VerifyError(f"the program was not written: {problems[0]}{more}")
    return True


def _machine_issues(machine: Machine) -> list[Issue]:
    if machine.work_offset is not None:
        return []
    return [
        Issue(
            "L403",
            f"where the part lies on {machine.name} is not known: only its size was checked against the travel; "
            "give --work-offset to check its place",
            severity=Severity.NOTE,
        )
    ]


def _page(outcome: Outcome) -> str:
    from leafcut.report.page import write_page

    return write_page(outcome)


def solve_part(
    part: Part, *, progress: Progress | None = None, cancelled: threading.Event | None = None, **options: Any
) -> Solution:
    """Return a closed tour through the points of a map, by TSPLIB's rule of distance where the file has one.

    `progress`, `cancelled` and `options` are those of `optimize`.
    """
    from leafcut.solve.compiling import announced
    from leafcut.solve.solve import solve

    settings = Settings.collect(options)
    metric = Metric(part.edge_weight_type or "euclidean", matrix=part.matrix)
    problem = RoutingProblem.of_points(part.hole_xy, metric, closed=True, name=part.name)

    tell = _passing_on(progress, f"solving {part.name}")
    with announced(lambda: progress("compiling (first run on this machine)", None, 0.0, None) if progress else None):
        return solve(problem, settings.solve, settings.aco, progress=tell, cancelled=cancelled)


def solve_file(
    source: str | Path, *, progress: Progress | None = None, cancelled: threading.Event | None = None, **options: Any
) -> tuple[dict[str, Any], NDArray[np.int32]]:
    """Solve a map file as a closed tour; return the answer of ``leafcut solve --json`` and the tour int32[n]."""
    from leafcut.read import read
    from leafcut.report.json_answer import solution_as_json

    part = read(source, Settings.collect(options).read)
    solution = solve_part(part, progress=progress, cancelled=cancelled, **options)
    return solution_as_json(part, solution), solution.nodes


def simulate(program: str | Path, *, dialect: str | None = None, **options: Any) -> dict[str, Any]:
    """Return what a program costs on a machine: seconds and lengths by kind of motion, extents, and dangers in it."""
    from leafcut.timing.toolpath import measure
    from leafcut.verify.clearance import check_clearance
    from leafcut.verify.envelope import check_envelope

    machine = _machine(Settings.collect(options))
    path = _interpret(program, dialect or machine.controller)
    result = measure(path, machine)
    low, high = path.extents
    return {
        "program": str(program),
        "machine": machine.name,
        "time_s": result.time_s,
        "rapid_mm": result.travel_mm,
        "feed_mm": result.cut_mm,
        "by_kind": result.by_kind,
        "extents": {axis: [low[k], high[k]] for k, axis in enumerate("xyz")},
        "issues": [
            str(d) for d in (*check_envelope(path, machine), *check_clearance(path, safe_z=machine.safe_z or 0.0))
        ],
    }


def verify_programs(
    original: str | Path, new: str | Path, *, dialect: str | None = None, **options: Any
) -> dict[str, Any]:
    """Return whether two programs do the same work, and every difference as one line."""
    from leafcut.verify.same_work import same_work

    machine = _machine(Settings.collect(options))
    words = dialect or machine.controller
    differences = same_work(_interpret(original, words), _interpret(new, words))
    return {"same": not differences, "differences": [str(d) for d in differences]}


def _interpret(program: str | Path, dialect_name: str) -> Toolpath:
    from leafcut.gcode.dialects import dialect
    from leafcut.gcode.interpreter import interpret

    return interpret(read_program(program), dialect(dialect_name), str(program))
