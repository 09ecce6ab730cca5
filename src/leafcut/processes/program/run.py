"""A program in, the same work in less time out: interpret, find what may change places, solve, rewrite, prove."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut._version import __version__
from leafcut.errors import OptionError, VerifyError
from leafcut.files.digests import signed
from leafcut.files.whole_files import decoded
from leafcut.geometry.arrays import Point
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.measure import Measure
from leafcut.model.obstacles import Obstacles
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Hole, Part
from leafcut.model.plan import Stage
from leafcut.model.problem import Metric
from leafcut.model.sequence import Kept, Section, Sequence
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import PLACES, STILL, Kind, Toolpath, arc_sweep, position_before
from leafcut.processes.job import Job, machine_issues
from leafcut.processes.keep_out import obstacles_of
from leafcut.processes.program.model import AvoidedAreas, ProgramDetail
from leafcut.processes.program.options import ResequenceOptions
from leafcut.processes.program.pace import check_library, wants_pace, with_new_pace
from leafcut.processes.program.proving import Proved, SectionOrders, with_comments, write_proved
from leafcut.processes.program.shown import shown_stock
from leafcut.processes.program.stock_proof import stock_judge

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program
    from leafcut.processes.program.reading import ProgramRead


#: Planning a program that needs more steps than this is given up, and its order kept.
MOST_STEPS = 1_000_000
#: A way round an obstacle is taken to cost as much as a rise by so much, mm: it depends on the way.
_ROUND = 50.0
#: Rows that say where the tool is, in coordinates of the program or the machine.
_PLACES = [int(k) for k in (*PLACES, Kind.MACHINE)]


def resequence(run: Job, source: str, data: bytes, process: str) -> Outcome[ProgramDetail]:
    """Return the program that does the same work in the shortest machine time, proved, and what was found out.

    Parameters
    ----------
    source
        The name of the program.
    data
        Its bytes.
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``; ``auto``: what the program shows.

    Raises
    ------
    ReadError, PlanError, SolveError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    from leafcut.gcode.dialects import dialect
    from leafcut.order.compiling import announced
    from leafcut.processes.program.plan.precedence.staying import count_pieces, grouped
    from leafcut.processes.program.plan.sections.program_rows import dark_rows
    from leafcut.processes.program.reading import read_foreign
    from leafcut.timing.grbl import sent_lines
    from leafcut.timing.toolpath import corner_style, measure

    words = dialect(run.settings.post.dialect or run.machine.controller)
    if words.one_command or words.language != "g-code":
        reason = "has one command a line" if words.language == "g-code" else "is no G-code"
        raise OptionError(f"{words.name} {reason}: leafcut writes and verifies its programs, but does not reorder them")
    text, encoding = decoded(data)
    read = read_foreign(
        text, source, run.settings, run.machine, words, run.looking("reading"), process=process,
        router=not wants_pace(run),
    )  # fmt: skip
    original, words, run = read.program, read.words, replace(run, machine=read.machine)
    others = check_library(run, original, source, read.process)
    judge, stock, met = stock_judge(run, original, source, read.process)
    dangers = [*read.dangers, *met]
    _refuse_dangers(run, source, dangers)
    sequence = _planned(run, original, read.process)
    obstacles, noticed = obstacles_of(run, original, sequence.process in BEAMS)
    with announced(run.tell):
        stands, begins = _stands(run, original, sequence)

        def timed_as_run(program: Program) -> Measure:
            dark = dark_rows(program, sequence.process)
            # Only GRBL's time depends on the lines that it is sent.
            lines = sent_lines(program.lines) if corner_style(run.machine) == "grbl" else None
            return measure(program.path, run.machine, dark, stands, lines)

        solutions = _solve_sections(run, sequence, obstacles, begins)
        solutions = [
            None if found is None else _with_few_speeds(original, section, found)
            for section, found in zip(sequence.sections, solutions, strict=True)
        ]
        measures = [timed_as_run(original)]
        proved = write_proved(run, words, original, sequence, _orders(sequence, solutions), source, obstacles, judge)
        measures.append(timed_as_run(proved.program))
        timed = run.settings.solve.objective == "time"
        before, after = (m.time_s if timed else m.travel_mm for m in measures)
        refused = proved.kept
        if after > before:
            # The solver's cost leaves out what the look-ahead knows; what is no better is not written. Of a program
            # that crosses obstacles its own order is the measure once it goes over or round them.
            own = write_proved(run, words, original, sequence, [None for _ in solutions], source, obstacles, judge)
            measured = timed_as_run(own.program)
            if obstacles is None or (measured.time_s if timed else measured.travel_mm) <= after:
                proved, measures[1] = own, measured
        solutions = [
            None if found is None else _as_written(section, found, order)
            for section, found, order in zip(sequence.sections, solutions, proved.orders, strict=True)
        ]
        # Rapids that the stock allows are none of the dangers that are guessed without it.
        new_dangers = _new_dangers(read, proved.program)
        paced = None
        if wants_pace(run):
            paced = with_new_pace(run, words, original, proved.program, source, sequence.process, obstacles)
            found = timed_as_run(paced.program)
            proved, measures[1] = replace(proved, text=paced.text, program=paced.program), found
    proved, avoided = _with_avoided(run, words, original, proved)
    if avoided.moves:
        # Its comments move the lines, from which the player takes the time of each.
        measures[1] = timed_as_run(proved.program)
    part, operations = _work_of(source, original, sequence, solutions)
    return Outcome(
        part=part,
        machine=run.machine,
        process=sequence.process,
        operations=operations,
        before=measures[0],
        nearest=None,
        after=measures[1],
        path_before=original.path,
        path_after=proved.program.path,
        text=proved.text,
        dialect=words.name,
        extension=words.extension,
        seed=run.settings.solve.seed,
        verified=True,
        issues=(
            *others,
            *_no_work_issues(proved),
            *dangers,
            *new_dangers,
            *_avoided_issues(avoided, obstacles),
            *noticed,
            *read.issues,
            *_unknown_materials(run, words, original),
            *sequence.issues,
            *_offers(run, sequence),
            *proved.issues,
            *(paced.issues if paced else ()),
            *machine_issues(read.checked),
        ),
        detail=ProgramDetail(
            certificate=proved.certificate,
            barriers=sum(isinstance(item, Kept) and bool(item.reasons) for item in sequence.items),
            pieces=count_pieces(sequence),
            staying=grouped(sequence, refused, run.settings.job.keep_order),
            pace=paced.change if paced else None,
            stock=stock,
            shown=shown_stock(original, source, run.settings, run.machine, sequence.process),
            avoided=avoided,
        ),
        encoding=encoding,
        options=run.settings.changed(),
        version=__version__,
    )


def _unknown_materials(run: Job, words: Dialect, original: Program) -> list[Issue]:
    """Return that cuts use materials that the program does not define."""
    from leafcut.processes.program.simulate import run_of_controller

    return run_of_controller(original, words, run.settings.job.clearance_height)[1]


def _refuse_dangers(run: Job, source: str, dangers: list[Issue]) -> None:
    """Refuse a program with dangers in it where `--strict` asks for that."""
    worst = [issue for issue in dangers if issue.severity is Severity.DANGER]
    if run.settings.read.strict and worst:
        more = f" (and {len(worst) - 1} more)" if len(worst) > 1 else ""
        raise VerifyError(f"{source}: {worst[0]}{more}; --strict refuses a program that is dangerous as it is")


def _new_dangers(read: ProgramRead, program: Program) -> list[Issue]:
    """Return the kinds of danger that the original has not; there are none, or the proof has missed something."""
    known = {issue.code for issue in read.dangers}
    found = replace(read, program=program).dangers
    return [replace(i, message=f"in the new program: {i.message}") for i in found if i.code not in known]


def _with_avoided(run: Job, words: Dialect, original: Program, proved: Proved) -> tuple[Proved, AvoidedAreas]:
    """Return the program with a comment on new moves across areas that the original avoided, and these moves."""
    from leafcut.processes.program.proof.avoided_areas import avoided_areas
    from leafcut.processes.program.reading import read_new

    if proved.text == "".join(original.lines):
        return proved, AvoidedAreas()
    found = avoided_areas(original, proved.program, run.machine.safe_z or 0.0)
    if not found.moves or not run.settings.post.header:
        return proved, found
    # The comments move all moves down by their own lines.
    found = replace(found, line=found.line + len(with_comments("", _avoided_comments(found), words).splitlines()))
    text = signed(with_comments(proved.text, _avoided_comments(found), words))
    program = read_new(run, words, text)
    return replace(proved, text=text, program=program), found


def _avoided_comments(avoided: AvoidedAreas) -> list[str]:
    return [f"leafcut: {avoided.crossings}", f"leafcut: name clamps with --keep-out, first: line {avoided.line}"]


def _no_work_issues(proved: Proved) -> list[Issue]:
    """Return a warning about a program that neither cuts nor drills: it may be another file than the one meant."""
    if proved.certificate.before.works:
        return []
    return [Issue("L502", "no cut and no hole was found in the program: check that this is the file that you mean")]


def _avoided_issues(avoided: AvoidedAreas, obstacles: Obstacles | None) -> list[Issue]:
    """Return a warning about new moves across areas that the original avoided; a note where zones are named."""
    severity = Severity.WARNING if obstacles is None else Severity.NOTE
    return [Issue("L515", avoided.text, severity=severity)] if avoided.moves else []


class _TooManySteps(Exception):
    """Planning took more than `MOST_STEPS`."""


def _planned(run: Job, original: Program, process: str) -> Sequence:
    """Return the program in pieces; all of it stays where it is if finding them takes too many steps."""
    from leafcut.processes.program.plan.resequencing import all_stay, find_sequence
    from leafcut.processes.program.plan.sections.program_rows import known_process

    options, steps = run.settings.of(ResequenceOptions), 0
    tell = run.looking("finding what can be reordered")

    def look(_: float = 0.0, /) -> None:
        nonlocal steps
        steps += 1
        if steps > MOST_STEPS:
            raise _TooManySteps
        tell()

    try:
        return find_sequence(
            original,
            process=process,
            merge_tools=options.merge_tools,
            allow_reverse=options.allow_reverse,
            mix_operations=options.mix_operations,
            look=look,
        )
    except _TooManySteps:
        said = "the order stays: the program is too large to plan; divide it into several"
        found = known_process(original) if process == "auto" else process
        return replace(all_stay(original, found, "too-large"), issues=(Issue("L507", said),))


def _solve_sections(
    run: Job, sequence: Sequence, obstacles: Obstacles | None, start: Point | None
) -> list[Solution | None]:
    """Return an order for every section, all ordered together; None where the order is kept.

    A section begins where the one before it now ends, if nothing in between goes anywhere, or where that is not known.
    `start` is where the tool stands before the program moves it, where that is where the first section begins.
    """
    from leafcut.processes.ordering import find_order
    from leafcut.processes.program.plan.resequencing import build_problem

    if run.settings.job.keep_order or not sequence.sections:
        return [None for _ in sequence.sections]
    stages: list[Stage] = []
    goes = True
    for number, section in enumerate(sequence.sections, 1):
        follows = bool(stages) and not (goes and section.start is not None)
        begins = None if follows else start if section.start is None else section.start
        problem = build_problem(section, _metric(run, section, obstacles), begins, section.end)
        given = np.arange(len(section.pieces), dtype=np.int32)
        stages.append(Stage(problem, follows, given, f"ordering section {number}"))
        goes = section.end is not None
    return list(find_order(run, stages).solutions)


def _stands(run: Job, original: Program, sequence: Sequence) -> tuple[Point | None, Point | None]:
    """Return where the tool stands before the program moves it, and the same if the first section begins there."""
    start = run.settings.job.start_point
    if start is None:
        return None, None
    stands = float(start[0]), float(start[1])
    if not sequence.sections:
        return stands, None
    path = original.path
    before = slice(0, int(original.first[sequence.sections[0].pieces[0].begin]))
    known = np.isfinite(path.end[before, :2]).any(axis=1) & np.isin(path.kind[before], _PLACES)
    moved = known.any() or ((path.kind[before] == Kind.FOREIGN) & (path.ref[before] != STILL)).any()
    return stands, None if moved else stands


def _offers(run: Job, sequence: Sequence) -> list[Issue]:
    """Return what another option would save."""
    changes = sequence.mergeable
    if not changes or run.settings.job.keep_order:
        return []
    seconds = changes * run.machine.tool_change_s
    said = f"--merge-tools would save {changes} tool change{'s'[: changes != 1]}"
    return [Issue("L506", said + (f", {seconds:.0f} s" if seconds else ""), severity=Severity.NOTE)]


def _metric(run: Job, section: Section, obstacles: Obstacles | None) -> Metric:
    """Return what the ways of a section cost: those across an obstacle as much more as to rise over it, or go round."""
    from leafcut.timing.travel import travel_metric

    objective = run.settings.solve.objective
    if obstacles is None:
        return travel_metric(run.machine, objective)
    over = obstacles.heights > section.clearance
    zones, highest = obstacles.of_tool(section.tool)[over], float(obstacles.heights[over].max(initial=-math.inf))
    rise = highest - section.clearance if math.isfinite(highest) else _ROUND
    return travel_metric(run.machine, objective, zones=zones, lift_height_mm=rise if len(zones) else 0.0)


def _unchanged(solution: Solution) -> Solution:
    return replace(solution, nodes=np.arange(len(solution.nodes), dtype=np.int32), lower_bound=None)


def _as_written(section: Section, solution: Solution, order: NDArray[np.int32] | None) -> Solution:
    """Return the solution with the order in which its section is written."""
    from leafcut.processes.program.plan.resequencing import nodes_in_order

    if order is None:
        return _unchanged(solution)
    nodes = nodes_in_order(section, order)
    return solution if np.array_equal(nodes, solution.nodes) else replace(solution, nodes=nodes, lower_bound=None)


def _with_few_speeds(program: Program, section: Section, solution: Solution) -> Solution:
    """Return a solution that changes the speed of the spindle no more often than the program did.

    Where it changes more often, all that waits for a speed and may be made with it is made before the next one.
    """
    from leafcut.processes.program.plan.resequencing import piece_order, speeds_of

    speeds = speeds_of(program, section)
    if len(np.unique(speeds)) < 2:
        return solution
    pieces = piece_order(section, solution.nodes)
    pieces = np.where(pieces < 0, ~pieces, pieces)
    most = int(np.count_nonzero(np.diff(speeds)))
    if np.count_nonzero(np.diff(speeds[pieces])) <= most:
        return solution
    waits_for: dict[int, set[int]] = {}
    for one, other in section.precedence.tolist():
        waits_for.setdefault(other, set()).add(one)
    waiting = list(zip(pieces.tolist(), solution.nodes.tolist(), strict=True))
    speed, done, nodes = float(speeds[0]), set[int](), list[int]()
    while waiting:
        left = []
        for one, node in waiting:
            if speeds[one] == speed and waits_for.get(one, set()) <= done:
                done.add(one)
                nodes.append(node)
            else:
                left.append((one, node))
        if len(left) == len(waiting):
            speed = next(float(speeds[one]) for one, _ in left if waits_for.get(one, set()) <= done)
        waiting = left
    order = piece_order(section, np.array(nodes, dtype=np.int32))
    if np.count_nonzero(np.diff(speeds[np.where(order < 0, ~order, order)])) > most:
        return _unchanged(solution)
    return replace(solution, nodes=np.array(nodes, dtype=np.int32), lower_bound=None)


def _orders(sequence: Sequence, solutions: list[Solution | None]) -> SectionOrders:
    from leafcut.processes.program.plan.resequencing import piece_order

    given = zip(sequence.sections, solutions, strict=True)
    return [None if solution is None else piece_order(section, solution.nodes) for section, solution in given]


def _work_of(
    source: str, program: Program, sequence: Sequence, solutions: list[Solution | None]
) -> tuple[Part, tuple[OperationOutcome, ...]]:
    """Return the holes of a program as a part, and what was ordered, section by section.

    A hole that keeps its place, such as the first one of a cycle, belongs to the next section of its tool, else to the
    last one.
    """
    holes: list[Hole] = []
    operations: list[OperationOutcome] = []
    begins: list[int] = []
    stays = np.ones(len(program.path), dtype=bool)
    for number, section in enumerate(sequence.sections):
        first = len(holes)
        drilled = [c for c in section.pieces if c.kind == "hole"]
        holes += [Hole(*c.entry, 0.0) for c in drilled]
        for piece in section.pieces:
            stays[program.first[piece.begin] : program.first[piece.end]] = False
        solution = solutions[number] if number < len(solutions) else None
        if solution is not None:
            operations.append(_operation(program, section, sequence.process, first, solution))
            begins.append(int(program.first[section.pieces[0].begin]))
    places, staying = _staying(program.path, stays, [o.tool.number for o in operations], begins)
    operations = [
        replace(o, staying=tuple(len(holes) + k for k in mine)) for o, mine in zip(operations, staying, strict=True)
    ]
    holes += [Hole(x, y, 0.0) for x, y in places]
    part = Part(name=Path(source).stem, source=source, format="gcode", holes=tuple(holes))
    return part, tuple(operations)


def _staying(
    path: Toolpath, stays: NDArray[np.bool_], tools: list[int], begins: list[int]
) -> tuple[list[tuple[float, float]], list[list[int]]]:
    """Return the holes drilled in rows that stay, (x, y) in mm, and which of them belong to each operation.

    `tools` are the operations' tools, `begins` their first rows.
    """
    rows = np.flatnonzero(stays & (path.kind == Kind.DRILL) & np.isfinite(path.end[:, :2]).all(axis=1))
    changes = np.flatnonzero(path.kind == Kind.TOOL)
    last = np.searchsorted(changes, rows) - 1
    tool = np.where(last >= 0, path.ref[changes[last]], 0) if len(changes) else np.zeros(len(rows))
    staying: list[list[int]] = [[] for _ in tools]
    of_tool: dict[int, list[int]] = {}
    for k, number in enumerate(tools):
        of_tool.setdefault(number, []).append(k)
    for hole, (row, number) in enumerate(zip(rows.tolist(), tool.tolist(), strict=True)):
        mine = of_tool.get(number)
        if mine:
            staying[next((k for k in mine if begins[k] > row), mine[-1])].append(hole)
    return [(x, y) for x, y in path.end[rows, :2].tolist()], staying


def _feed(path: Toolpath, works: NDArray[np.intp]) -> float:
    """Return the feed along most of the way of a piece of work, seen from above; of a hole, that of the way down."""
    if not len(works):
        return 0.0
    places = np.concatenate([[position_before(path, int(works[0]))], path.end[works]])
    length = np.nan_to_num(np.hypot(*np.diff(places, axis=0)[:, :2].T))
    for k in np.flatnonzero(path.kind[works] != Kind.FEED).tolist():
        if path.kind[works[k]] != Kind.DRILL:
            radius, _, sweep = arc_sweep(path, int(works[k]))
            length[k] = radius * abs(sweep)
    feeds, of = np.unique(path.value[works], return_inverse=True)
    return float(feeds[np.bincount(of.reshape(-1), length).argmax()] if length.any() else path.value[works[0]])


def _operation(program: Program, section: Section, process: str, first: int, solution: Solution) -> OperationOutcome:
    """Return what was ordered in a section; feed, speed and cycle are those of its first piece of work."""
    path, holes = program.path, [k for k, c in enumerate(section.pieces) if c.kind == "hole"]
    piece = section.pieces[holes[0] if holes else 0]
    rows = np.arange(program.first[piece.begin], program.first[piece.end])
    works = rows[(path.kind[rows] >= Kind.FEED) & (path.kind[rows] <= Kind.DRILL)]
    drilling = works[path.kind[works] == Kind.DRILL]
    tool = Tool(
        number=0 if section.tool is None else section.tool,
        diameter=0.0,
        kind=ToolKind.DRILL if holes else ToolKind.SLOT_MILL,
        name="" if holes else process,
        feed=_feed(path, works[:1] if holes else works),
        spindle_rpm=program.modal(piece.end).rpm,
    )
    at = {piece: first + i for i, piece in enumerate(holes)}
    order = tuple(at[k] for k in solution.nodes.tolist() if k in at)
    cycle = path.cycles[int(path.ref[drilling[0]])].name if len(drilling) else ""
    line = program.text_line
    lines = int(line[section.pieces[0].begin]), int(line[section.pieces[-1].end - 1])
    return OperationOutcome(tool, cycle, order, False, solution, len(section.pieces) - len(holes), lines)
