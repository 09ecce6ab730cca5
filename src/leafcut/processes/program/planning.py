"""Plan the reordering of a program. The sections of the program become stages with tasks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError, VerifyError
from leafcut.files.whole_files import decode_text
from leafcut.geometry.arrays import Point
from leafcut.material.height_field import default_cell_size
from leafcut.material.straight_moves import smallest_tool_diameter, undivided_cutting_moves
from leafcut.message import Message
from leafcut.model.cutter import cutter_of_tool, shank_and_holder_sections
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.part import Hole, Part
from leafcut.model.plan import Order, Stage
from leafcut.model.problem import Metric
from leafcut.model.sequence import Section, Sequence
from leafcut.model.solution import Solution
from leafcut.model.toolpath import PLACES, STILL, Kind
from leafcut.processes.job import Job, dialect_of, library_of
from leafcut.processes.plan import Plan
from leafcut.processes.program.model import StockProof
from leafcut.processes.program.options import ResequenceOptions, pace_flags
from leafcut.processes.program.reading import ProgramRead, controller_motion, read_foreign
from leafcut.processes.program.tools import known_tools, tool_diameter_warnings
from leafcut.timing.travel import travel_metric

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program
    from leafcut.model.obstacles import Obstacles
    from leafcut.processes.program.proof.stock_judge import StockJudge

#: Maximum number of planning steps. A program that needs more steps keeps its order.
MOST_STEPS = 1_000_000
#: Assumed cost of a path around an obstacle of unknown height: as much as a retract by this height, mm.
_AROUND = 50.0
#: Kinds of rows with a position in program or machine coordinates.
_PLACES = [int(k) for k in (*PLACES, Kind.MACHINE)]
#: Usual number of cells, maximum cell size as a share of the smallest tool diameter, and maximum number of cells.
_CELLS, _SHARE, _MOST = 2_000_000, 0.05, 8_000_000
_NO_SHAPES = Message("the shapes of its tools are unknown; give --tools or --tool-diameter")


@dataclass(frozen=True, eq=False)
class ForeignWork:
    """A program from another CAM system, ready to be reordered.

    Attributes
    ----------
    source
        Name of the program file.
    sequence
        Sections that can be reordered, and blocks that stay.
    judge, stock
        The judge that compares the remaining stock, with its height field. If there is no judge, `stock` has the
        reason.
    stands
        Position of the tool before its first move, mm; None unless the user specified it.
    dangers
        Dangers of the original program.
    codes
        Codes of the dangers that were detected without simulating the stock.
    before, after
        Other issues, which are reported before and after the dangers.
    """

    source: str
    read: ProgramRead
    sequence: Sequence
    obstacles: Obstacles | None
    judge: StockJudge | None
    stock: StockProof | None
    stands: Point | None
    dangers: tuple[Issue, ...]
    codes: frozenset[str]
    before: tuple[Issue, ...]
    after: tuple[Issue, ...]

    @property
    def program(self) -> Program:
        """The interpreted program."""
        return self.read.program

    @property
    def text(self) -> str:
        """The text of the program."""
        return "".join(self.program.lines)


def plan_program(job: Job, source: str, data: bytes, process: str) -> Plan:
    """Plan the reordering of a program. Each section of the program becomes a stage.

    Raises
    ------
    ReadError, OptionError, PlanError
        The program cannot be read or planned.
    VerifyError
        The program is dangerous, and ``--strict`` is set.
    """
    post_dialect = dialect_of(job)
    _refuse_fixed_dialect(post_dialect)
    text, encoding = decode_text(data)
    read = read_foreign(
        text,
        source,
        job.settings,
        job.machine,
        post_dialect,
        job.start_step(Message("reading")),
        process=process,
        router=not pace_flags(job.settings),
    )
    _refuse_fixed_dialect(read.dialect)  # the header may name another machine
    original, job = read.program, replace(job, machine=read.machine)
    others = _check_library(job, original, source, read.process)
    judging = create_stock_judge(job, original, source, read.process)
    own = read.find_dangers()
    dangers = (*own, *judging.issues)
    if job.settings.read.strict:
        _refuse_dangers(source, dangers)
    sequence = _divide_into_sections(job, original, read.process)
    obstacles, noticed = None, list[Issue]()
    if job.settings.job.keep_out:
        from leafcut.processes.keep_out import keep_out_obstacles

        obstacles, noticed = keep_out_obstacles(job, original, sequence.process in BEAMS)
    stands, starts = _tool_start(job.settings.job.start_point, original, sequence)
    work = ForeignWork(
        source=source,
        read=read,
        sequence=sequence,
        obstacles=obstacles,
        judge=judging.judge,
        stock=judging.proof,
        stands=stands,
        dangers=dangers,
        codes=frozenset(issue.code for issue in own),
        before=tuple(others),
        after=(
            *noticed,
            *read.issues,
            *controller_motion(original, read.dialect, job.settings.job.clearance_height)[1],
            *sequence.issues,
            *_merge_offer_issues(job, sequence),
        ),
    )
    return Plan(
        job=job,
        part=part_of_program(source, original, sequence),
        dialect=read.dialect,
        work=work,
        stages=() if job.settings.solve.keeps_order else _stages(job, sequence, obstacles, starts),
        kind=sequence.process,
        encoding=encoding,
        limits=read.limits,
    )


def _check_library(job: Job, program: Program, source: str, process: str) -> list[Issue]:
    """Return an issue for each tool whose diameter in the ``--tools`` library differs from its diameter in the program.

    Raises
    ------
    OptionError
        Such a tool exists, and new speeds or heights are requested. They would depend on the wrong diameter.
    """
    others = [] if process in BEAMS else tool_diameter_warnings(program, job.settings, job.machine)
    flags = pace_flags(job.settings)
    if flags and others:
        raise OptionError("{}: {}: {}", flags[0], source, others[0])
    return others


def _refuse_dangers(source: str, dangers: tuple[Issue, ...]) -> None:
    worst = [issue for issue in dangers if issue.severity is Severity.DANGER]
    if worst:
        more = Message(" (and {} more)", len(worst) - 1) if len(worst) > 1 else ""
        raise VerifyError("{}: {}{}; --strict refuses dangerous programs", source, worst[0], more)


class _TooManySteps(Exception):
    """Raised if planning takes more than `MOST_STEPS` steps."""


def _divide_into_sections(job: Job, original: Program, process: str) -> Sequence:
    """Divide a program into sections. If this takes too many steps, the whole program stays unchanged."""
    from leafcut.processes.program.plan.resequencing import find_sequence, unchanged_sequence

    options, steps = job.settings.of(ResequenceOptions), 0
    tell = job.start_step(Message("finding tasks to reorder"))

    def check_cancelled(_: float = 0.0, /) -> None:
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
            tool_diameter=_tool_diameter(job),
            check_cancelled=check_cancelled,
        )
    except _TooManySteps:
        said = Message("the program keeps its order, because it is too large to plan; divide it into several programs")
        return replace(unchanged_sequence(original, process, "too-large"), issues=(Issue("L507", said),))


def _tool_diameter(job: Job) -> float:
    """Return the diameter of the mills that no comment describes, mm.

    This is the value of ``--tool-diameter``, or the diameter of the largest tool in the library if that tool is larger.
    Without the option, the result is 0.
    """
    given = job.settings.job.tool_diameter
    if given is None:
        return 0.0
    library = library_of(job.settings, job.machine)
    return max([given, *(tool.diameter for tool in library.tools)] if library is not None else [given])


def _stages(job: Job, sequence: Sequence, obstacles: Obstacles | None, start: Point | None) -> tuple[Stage, ...]:
    """Create a stage for each section.

    If the position of every move between two stages is unknown, the second stage starts where the first stage ends.
    """
    from leafcut.processes.program.plan.resequencing import build_problem

    stages: list[Stage] = []
    moves = True
    for number, section in enumerate(sequence.sections, 1):
        follows = bool(stages) and not (moves and section.start is not None)
        starts = None if follows else start if section.start is None else section.start
        problem = build_problem(section, _metric(job, section, obstacles), starts, section.end)
        given = np.arange(len(section.pieces), dtype=np.int32)
        stages.append(Stage(problem, follows, given, Message("ordering section {}", number)))
        moves = section.end is not None
    return tuple(stages)


def _metric(job: Job, section: Section, obstacles: Obstacles | None) -> Metric:
    """Return the travel metric of a section.

    If an obstacle is in the way, the metric adds a rise above it or a path around it.
    """
    objective = job.settings.solve.objective
    if obstacles is None:
        return travel_metric(job.machine, objective)
    over = obstacles.heights > section.clearance
    zones, highest = obstacles.zones_for_tool(section.tool)[over], float(obstacles.heights[over].max(initial=-math.inf))
    rise = highest - section.clearance if math.isfinite(highest) else _AROUND
    return travel_metric(job.machine, objective, zones=zones, lift_height_mm=rise if len(zones) else 0.0)


def _tool_start(
    start: tuple[float, ...] | None, original: Program, sequence: Sequence
) -> tuple[Point | None, Point | None]:
    """Return the position of the tool before the first move, and the start point of the first section.

    The start point is None unless the tool is still at its initial position when the first section starts.
    """
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


def _refuse_fixed_dialect(dialect: Dialect) -> None:
    """Raise OptionError if programs in a dialect cannot be reordered."""
    if dialect.one_command or dialect.language != "g-code":
        reason = Message("has one command per line") if dialect.language == "g-code" else Message("is not G-code")
        raise OptionError(
            "{} {}: leafcut writes and verifies such programs, but does not reorder them", dialect.name, reason
        )


def _merge_offer_issues(job: Job, sequence: Sequence) -> list[Issue]:
    changes = sequence.mergeable
    if not changes or job.settings.solve.keeps_order:
        return []
    seconds = changes * job.machine.tool_change_s
    said = Message("--merge-tools would save {} tool change", changes)
    if changes > 1:
        said = Message("--merge-tools would save {} tool changes", changes)
    if seconds:
        said = Message("{}, {:.0f} s", said, seconds)
    return [Issue("L506", said, severity=Severity.NOTE)]


def with_few_speed_changes(plan: Plan, order: Order) -> Order:
    """Limit the number of spindle speed changes in each section to the number in the original program."""
    sections = plan.work.sequence.sections
    solutions = tuple(
        _few_speed_changes(plan.work.program, section, solution)
        for section, solution in zip(sections, order.solutions, strict=False)
    )
    return replace(order, choices=tuple(solution.nodes for solution in solutions), solutions=solutions)


def _few_speed_changes(program: Program, section: Section, solution: Solution) -> Solution:
    """Return the solution if it has few speed changes.

    Otherwise, group the work by speed, or keep the original order.
    """
    from leafcut.processes.program.plan.resequencing import first_cut_speeds, tasks_from_nodes

    speeds = first_cut_speeds(program, section)
    if len(np.unique(speeds)) < 2:
        return solution
    pieces = tasks_from_nodes(section, solution.nodes)
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
    order = tasks_from_nodes(section, np.array(nodes, dtype=np.int32))
    if np.count_nonzero(np.diff(speeds[np.where(order < 0, ~order, order)])) > most:
        return replace(solution, nodes=np.arange(len(solution.nodes), dtype=np.int32), lower_bound=None)
    return replace(solution, nodes=np.array(nodes, dtype=np.int32), lower_bound=None)


def part_of_program(source: str, program: Program, sequence: Sequence) -> Part:
    """Return a part with the holes of a program. Holes in sections come first, followed by the fixed holes."""
    holes = [Hole(*piece.entry, 0.0) for s in sequence.sections for piece in s.pieces if piece.kind == "hole"]
    holes += [Hole(x, y, 0.0) for x, y in program.path.end[fixed_hole_rows(program, sequence), :2].tolist()]
    return Part(name=Path(source).stem, source=source, format="gcode", holes=tuple(holes))


def fixed_hole_rows(program: Program, sequence: Sequence) -> NDArray[np.intp]:
    """Return the rows of the drilled holes that belong to no section."""
    path, stays = program.path, np.ones(len(program.path), dtype=bool)
    for section in sequence.sections:
        for piece in section.pieces:
            stays[program.first[piece.begin] : program.first[piece.end]] = False
    return np.flatnonzero(stays & (path.kind == Kind.DRILL) & np.isfinite(path.end[:, :2]).all(axis=1))


# -- judge of the stock ----------------------------------------------------------------------------------------------


class Judging(NamedTuple):
    """Result of creating a stock judge, with issues about the original program.

    Without a judge, the reason replaces the height field.
    """

    judge: StockJudge | None = None
    proof: StockProof | None = None
    issues: tuple[Issue, ...] = ()


def create_stock_judge(job: Job, program: Program, source: str, process: str) -> Judging:
    """Create a judge that compares the stock after a reordered program with the stock after the original program.

    Without ``--workpiece``, the stock is a block around the cuts below Z0. If only the diameter of a tool is known, the
    tool counts as a flat end mill. Cuts by tools of unknown diameter are skipped. The judge is None for a laser or
    torch program, and for a program that only drills with tools of unknown diameter.

    Raises
    ------
    OptionError
        The stock that the user described is not a block, or the program never touches it.
    PlanError
        The stock that the user described has too many cells.
    """
    if process in BEAMS:
        return Judging()
    tools, unknown = known_tools(program, job.settings, job.machine, flat=True)
    left_out = tuple(unknown)
    if not tools and process == "drill":
        return Judging()
    if not tools:
        beam = dialect_of(job).torch is not None
        why = (
            Message("the program is read as a milling program; if a beam cuts, give --process laser or plasma")
            if beam
            else _NO_SHAPES
        )
        why = why if unknown else Message("nothing is cut")
        return Judging(proof=StockProof(unknown=left_out, reason=why))
    from leafcut.processes.program.proof.stock_judge import StockJudge
    from leafcut.processes.program.workpiece import block_around, stock_block, stock_field, stock_issues
    from leafcut.read.step import ChosenSolid

    cutters = {number: cutter_of_tool(tool) for number, tool in tools.items()}
    smallest = smallest_tool_diameter(cutters)
    options = job.settings.stock
    try:
        whole = undivided_cutting_moves(program.path, cutters)
        which = ChosenSolid.of(job.settings.read)
        block = stock_block(options.workpiece, which) if options.workpiece else block_around(whole, cutters)
        if block is None:
            why = Message("the program cuts nothing below Z0, so the top of the stock is unknown; give --workpiece")
            return Judging(proof=StockProof(unknown=left_out, reason=why))
        stock = stock_field(
            options, block, options.cell or default_cell_size(block, smallest, _SHARE, _CELLS, _MOST), which
        )
        bodies = {number: shank_and_holder_sections(tool) for number, tool in tools.items()}
        judge = StockJudge.from_original(
            program,
            tools,
            cutters,
            bodies,
            stock,
            bool(options.workpiece),
            job.start_step(Message("cutting the stock")),
        )
    except PlanError as problem:
        if options.workpiece or options.cell:
            raise
        return Judging(proof=StockProof(unknown=left_out, reason=str(problem)))
    if options.workpiece and not judge.touched:
        raise OptionError("--workpiece: {} never touches this stock; specify the stock in program coordinates", source)
    flat = tuple(number for number, tool in tools.items() if tool.assumed)
    issues = (*judge.issues(), *stock_issues(options, program, cutters, block, which))
    return Judging(judge, StockProof(stock.heights.size, stock.cell, judge.given, flat, left_out), issues)
