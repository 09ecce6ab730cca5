"""A nested sheet in, a cutting program out: read, prepare, order, slide, lay, post, prove."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from leafcut._version import __version__
from leafcut.errors import count_of
from leafcut.model.cutting import CutPlan
from leafcut.model.issue import Issue, Severity
from leafcut.model.measure import Measure
from leafcut.model.obstacles import Obstacles
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.solution import Solution
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import SpeedOptions
from leafcut.processes.job import Job, machine_issues, refuse
from leafcut.processes.keep_out import meetings
from leafcut.processes.placing import negative_axes
from leafcut.processes.sheet.job import SheetJob, prepared
from leafcut.processes.sheet.model import SheetDetail
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.orders import as_planned, check_precedence, nearest_order, ordered

if TYPE_CHECKING:
    from leafcut.model.machine import Machine
    from leafcut.processes.sheet.plan.cut_toolpath import LaidCut
    from leafcut.processes.sheet.plan.freed_parts import Round
    from leafcut.processes.sheet.plan.leads.cut_starts import CutStart
    from leafcut.read.format import Source

#: Where leads met, an order is sought anew so often at most; of more cuts than this never.
ROUNDS, MOST_AGAIN = 2, 1000

#: How far the torch may round corners to keep speed, mm (G64 P).
PATH_TOLERANCE = 0.1


def cut(run: Job, source: Source) -> Outcome[SheetDetail]:
    """Return the verified cutting program of a nested sheet, and all that was found out on the way.

    Raises
    ------
    ReadError, OptionError, PlanError, SolveError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    from leafcut.order.compiling import announced
    from leafcut.processes.sheet.chain_search import chained
    from leafcut.processes.sheet.plan.apply_plan_file import plan_order
    from leafcut.processes.sheet.plan.cutting import drawing_order, in_bands
    from leafcut.processes.sheet.plan.leads.clear_pierces import clear_pierces
    from leafcut.proof.envelope import check_envelope

    job, issues = prepared(run, source)
    options = run.settings.of(CutOptions)
    with announced(run.tell):
        drawn = plan_order(job.cutting, job.plan) if job.plan else drawing_order(job.cutting)
        drawn = clear_pierces(job.cutting, in_bands(job.cutting, drawn, options), job.travel(), None, None)
        drawn_laid = _laid(job, drawn)
        # What no order changes is known before any is sought.
        refuse(check_envelope(drawn_laid.path, run.machine))
        nearest = nearest_order(job)
        cutting, spent = chained(job)
        joined = replace(job, cutting=cutting)
        found, solutions = ordered(joined, drawn if cutting is job.cutting else None)
    planned = as_planned(job)
    first = drawn_laid if planned is None else _laid(*planned)
    second, third = _laid(job, nearest), _laid(joined, found)
    bound = options.heat_distance > 0.0 or (options.sweep != "free" and planned is not None)
    searched = sum(s.seconds for s in solutions)
    if run.settings.solve.algorithm == "auto" and not run.settings.job.keep_order:
        met = any(a is not b for a, b in zip(found, third.order, strict=True))
        if cutting is job.cutting and planned is None and not bound and second.score(run) < third.score(run):
            third, solutions = second, []
        if met and len(found) <= MOST_AGAIN:
            third, solutions = _without_meeting(joined, third, solutions, spent + searched)
    if not (job.words.moves_z or run.settings.job.keep_order or planned is not None or bound):
        third = _kept_off(joined, third)
    if run.settings.job.keep_order or (third.score(run) > first.score(run) and not bound):
        third, solutions = first, []
    return _outcome(job, issues, solutions, first, second, third)


# -- toolpath, time and program --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _LaidOrder:
    """An order as motions, and what it costs."""

    plan: CutPlan
    path: Toolpath
    rows: list[LaidCut]
    measure: Measure
    order: list[CutStart]
    round: Round | None = None

    def score(self, run: Job) -> float:
        return self.measure.time_s if run.settings.solve.objective == "time" else self.measure.travel_mm


def _without_meeting(
    job: SheetJob, best: _LaidOrder, solutions: list[Solution], spent: float
) -> tuple[_LaidOrder, list[Solution]]:
    """Search again where leads of the order that was found met: what moved away can cost more than the order saved.

    Starts whose leads meet those of the best order are left out. Returns what is best in the end, and the solutions
    that it came from, all seconds of searching among theirs; `spent` is all that was spent before.
    """
    from leafcut.processes.sheet.plan.leads.leads_apart import starts_apart

    for _ in range(ROUNDS):
        if job.run.deadline.left <= 0.0:
            break
        again = replace(job, cutting=starts_apart(job.cutting, best.order))
        order, found = ordered(again, best.order)
        spent += sum(s.seconds for s in found)
        other = _laid(again, order)
        if other.score(job.run) >= best.score(job.run):
            break
        best, solutions = other, found
    each = (spent - sum(s.seconds for s in solutions)) / max(len(solutions), 1)
    return best, [replace(s, seconds=s.seconds + each) for s in solutions]


def _laid(job: SheetJob, order: list[CutStart]) -> _LaidOrder:
    from leafcut.processes.sheet.plan.cost_estimate import cut_norm
    from leafcut.processes.sheet.plan.cut_toolpath import TORCH_ON, lay_cuts
    from leafcut.processes.sheet.plan.freed_parts import lead_round
    from leafcut.processes.sheet.plan.leads.leads_apart import leads_apart
    from leafcut.timing.toolpath import measure

    machine, settings, torch = job.run.machine, job.run.settings, job.words.torch
    check_precedence(job.cutting, order)
    order = leads_apart(job.cutting, order, job.travel(), job.start, job.end)
    cuts = tuple(job.cutting.cut(s) for s in order)
    led = None if job.freed is None else lead_round(job.freed, cuts, job.start, job.end)
    corners = {} if led is None else led.corners
    path, rows = lay_cuts(
        cuts,
        job.data,
        machine,
        clearance=settings.job.clearance_height,
        end=job.end,
        switches=job.switches,
        power=settings.post.beam_power if torch is not None and torch.power else TORCH_ON,
        mark_power=settings.post.mark_power if torch is not None and torch.power else TORCH_ON,
        tolerance=PATH_TOLERANCE if torch is not None else 0.0,
        probe=job.probe,
        moves_z=job.words.moves_z,
        mark_tool=torch.mark_tool if torch is not None else None,
        corners=corners,
        obstacles=_obstacles(job),
    )
    whole = measure(path, machine)
    seconds = _cut_seconds(path, rows, machine)
    norm = cut_norm(
        job.cutting.sheet,
        cuts,
        seconds,
        whole.time_s,
        settings.of(CutOptions),
        job.data,
        corners,
        settings.of(SpeedOptions).shop_rate or 0.0,
    )
    crossings, close = (None, 0) if led is None else (len(led.crossing), len(led.close))
    return _LaidOrder(CutPlan(job.cutting.sheet, job.data, cuts, norm, crossings, close), path, rows, whole, order, led)


def _kept_off(job: SheetJob, laid: _LaidOrder) -> _LaidOrder:
    """Return an order that frees parts behind the ways that cross them, if it comes out better: fewer ways over free
    parts, then fewer that come close to one, then less time."""
    from leafcut.processes.sheet.plan.freed_parts import cut_free_later
    from leafcut.processes.sheet.plan.leads.clear_pierces import clear_pierces

    if job.freed is None or laid.round is None or not (laid.round.crossing or laid.round.close or laid.round.corners):
        return laid
    place_of = {k: at for at, start in enumerate(laid.order) for k in start.contours}
    pairs = [(place_of[a], place_of[b]) for a, b in job.cutting.pairs if place_of[a] != place_of[b]]
    with job.run.deadline.part(1.0).running(job.run.cancelled) as late:
        place = cut_free_later(job.freed, laid.plan.cuts, pairs, job.travel(), lambda: not late())
    order = [laid.order[k] for k in place]
    other = _laid(job, clear_pierces(job.cutting, order, job.travel(), job.start, job.end))
    ranks = [(one.plan.crossings or 0, one.plan.close, one.score(job.run)) for one in (other, laid)]
    return other if ranks[0] < ranks[1] else laid


def _obstacles(job: SheetJob) -> Obstacles | None:
    """Return what is named on the sheet: crossed at the clearance height, or gone round where nobody moves Z."""
    from leafcut.processes.zones import crossing_heights, parse_zones

    settings = job.run.settings.job
    zones = parse_zones(settings.keep_out)
    if not len(zones):
        return None
    heights = np.full(len(zones), math.inf)
    if job.words.moves_z:
        heights = crossing_heights(settings.keep_out, settings.clearance_height)
    return Obstacles(zones, heights, dogleg=job.run.machine.rapid_style == "dogleg")


def _cut_seconds(path: Toolpath, rows: list[LaidCut], machine: Machine) -> list[tuple[float, float, float]]:
    """Return the seconds of every cut: cutting, piercing, rapids."""
    from leafcut.timing.toolpath import seconds_by_row

    moving = seconds_by_row(path, machine)
    rapid = path.kind == Kind.RAPID
    finding = path.kind == Kind.PROBE
    waiting = np.where(path.kind == Kind.DWELL, path.value, np.where(finding, moving, 0.0))
    columns = (np.where(rapid | finding, 0.0, moving), waiting, np.where(rapid, moving, 0.0))
    return [
        (float(columns[0][r].sum()), float(columns[1][r].sum()), float(columns[2][r].sum()))
        for r in (slice(row.first, row.last) for row in rows)
    ]


def _outcome(
    job: SheetJob,
    issues: list[Issue],
    solutions: list[Solution],
    before: _LaidOrder,
    nearest: _LaidOrder,
    after: _LaidOrder,
) -> Outcome[SheetDetail]:
    run, settings = job.run, job.run.settings
    text = _write(job, before, after)
    written = _verify(job, after, text)
    tool = Tool(number=1, diameter=job.data.kerf, kind=ToolKind.TORCH, name=job.data.process, feed=job.data.feed)
    return Outcome(
        part=job.part,
        machine=run.machine,
        process="cut",
        operations=tuple(OperationOutcome(tool, "", (), False, s, cuts=len(s.nodes)) for s in solutions),
        before=before.measure,
        nearest=nearest.measure,
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
            *_heat_issues(job, after),
            *_probing_issues(job, after),
            *_freed_issues(after),
            *machine_issues(run.machine, job.box, settings.read.origin is not None),
        ),
        options=settings.changed(),
        version=__version__,
        detail=SheetDetail((before.plan, nearest.plan, after.plan)),
    )


def _heat_issues(job: SheetJob, laid: _LaidOrder) -> list[Issue]:
    from leafcut.processes.sheet.plan.heat import too_near

    options = job.run.settings.of(CutOptions)
    if options.heat_distance <= 0.0:
        return []
    left = too_near(job.cutting, laid.order, options.heat_distance)
    if not left:
        words = (
            f"no cut starts within {options.heat_distance:g} mm of a hot one; the nearest-neighbour order ignores heat"
        )
        return [Issue("L614", words, "", Severity.NOTE)]
    x, y = laid.order[left[0][1]].entry
    starts = "1 cut starts" if len(left) == 1 else f"{len(left)} cuts start"
    words = f"{starts} within {options.heat_distance:g} mm of a hot one: no small change of the order avoids that"
    return [Issue("L614", words, f"the first at ({x:.4g}, {y:.4g})")]


def _probing_issues(job: SheetJob, laid: _LaidOrder) -> list[Issue]:
    """Warn of starts in the air under a controller that probes before each cut: it would find a slat, or nothing."""
    torch = job.words.torch
    starts = [c.path.start for c in laid.plan.cuts if c.kind == "cut" and not c.pierce]
    if torch is None or torch.heights != "controller" or not starts:
        return []
    many = "1 cut starts" if len(starts) == 1 else f"{len(starts)} cuts start"
    words = (
        f"{many} beyond the sheet's edge, where the controller probes beside the sheet: lay a piece of the same "
        "thickness there, or give --dialect plasma --probe off"
    )
    return [Issue("L619", words, f"the first at ({starts[0][0]:.4g}, {starts[0][1]:.4g})")]


def _freed_issues(laid: _LaidOrder) -> list[Issue]:
    """Tell of the ways of a head that stays down: how many cross parts that are free, and how many go round them."""
    led = laid.round
    if led is None or not (led.crossing or led.close or led.corners):
        return []
    round_ = f"{len(led.corners)} of {led.ways} travel moves go around parts that are cut free"
    unknown = "; the diameter of its nozzle is unknown (nozzle_diameter in the machine's profile), so only its middle "
    unknown = "" if led.radius > 0.0 else f"{unknown}is counted"
    if not (led.crossing or led.close):
        words = f"the head stays down between cuts: {round_}, none crosses one{unknown}"
        return [Issue("L623", words, "", Severity.NOTE)]
    cuts, first = laid.plan.cuts, min((*led.crossing, *led.close))
    x, y = cuts[min(first, len(cuts) - 1)].path.start
    over = [f"{len(led.crossing)} of {led.ways} travel moves cross parts that are cut free"] if led.crossing else []
    wide = f"a nozzle of {2.0 * led.radius:g} mm comes over parts that are cut free on "
    more = count_of(len(led.close), "more travel move")
    over += [f"{wide}{more if led.crossing else f'{len(led.close)} of {led.ways} travel moves'}"] if led.close else []
    words = (
        f"the head stays down between cuts, and {' and '.join(over)}; free parts may tip up ({round_}){unknown}: hold "
        "them with --micro-joints, or watch them"
    )
    return [Issue("L623", words, f"the first on the way to ({x:.4g}, {y:.4g})")]


def _write(job: SheetJob, before: _LaidOrder, after: _LaidOrder) -> str:
    from leafcut.post.header import header_lines
    from leafcut.processes.sheet.post import write_cut_program

    settings = job.run.settings
    header = header_lines(
        source=Path(job.part.source or job.part.name).name,
        zero=job.part.zero,
        negative=negative_axes(job.box, job.run.machine),
        version=__version__,
        machine=job.run.machine,
        tools=(),
        path=after.path,
        seconds=(before.measure.time_s, after.measure.time_s),
        seed=settings.solve.seed,
        options=settings.changed(),
        units=settings.post.output_units,
    )
    return write_cut_program(after.plan, after.path, job.words, settings.post, header)


def _verify(job: SheetJob, laid: _LaidOrder, text: str) -> Toolpath:
    """Return the program read back, compared with the toolpath and checked against the drawing and the machine.

    The one place where a cutting program is proved: nothing that fails here is written.

    Raises
    ------
    VerifyError
        The first difference or danger, and how many more there are.
    """
    from leafcut.processes.sheet.proof.cut_motion import check_cut_motion, read_back
    from leafcut.processes.sheet.proof.divided import check_divided
    from leafcut.processes.sheet.proof.laid_runs import Asked
    from leafcut.processes.sheet.proof.sheet import check_sheet

    job.run.tell("verifying")
    settings, machine = job.run.settings, job.run.machine
    options = settings.of(CutOptions)
    written = read_back(text, laid.plan, job.words, settings.post.material_number)
    refuse(check_cut_motion(laid.path, written, job.words, settings.post.output_units))
    asked = Asked(
        half=job.cutting.rules.half,
        joints=options.micro_joints,
        joint_width=options.joint_width,
        safe_height=settings.job.clearance_height,
        probe=job.probe,
        power=settings.post.beam_power if job.words.torch is not None and job.words.torch.power else None,
        material_number=settings.post.material_number,
    )
    obstacles = _obstacles(job)
    if obstacles is not None:
        refuse(meetings(job.run, obstacles, laid.path))  # the text was just found to be this path
    refuse(check_divided(job.drawn, job.cutting.sheet, job.cutting.rules.half))
    refuse(check_sheet(job.cutting.sheet, laid.plan, text, written, job.words, machine, asked))
    return written
