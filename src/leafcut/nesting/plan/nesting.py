"""Nest parts on sheets and produce several variants. Small parts may lie in the holes of large parts.

Each nest is checked afterwards by code that does not depend on this module.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from shapely.geometry.base import BaseGeometry

from leafcut.errors import OptionError
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, Progress, Trial
from leafcut.model.nest import Nest, NestPart, Placement, Stock
from leafcut.nesting.options import NestOptions
from leafcut.nesting.plan.blocks import group_in_blocks
from leafcut.nesting.plan.fill import FillPlan, NestTask, Packer, fill_sheets
from leafcut.nesting.plan.pieces import NestPiece, check_fit, chord_polygon, has_common_rotation, pieces_from_parts
from leafcut.nesting.plan.positions import FREE_ANGLES, buffer_distance, find_position
from leafcut.nesting.plan.rectangles import RULES, RectanglePacker
from leafcut.nesting.plan.remnant import RemnantPacker
from leafcut.nesting.plan.shapes import ShapePacker
from leafcut.nesting.plan.sheet_choice import (
    cheaper_plans,
    cheapest_by_density,
    find_cheapest_nest,
    plan_of_nest,
    single_kind_plan,
)
from leafcut.nesting.plan.strip import NesterError, StripBudget
from leafcut.options import SolveOptions

#: Number of steps that the shape nester runs per strip, by preset. The first 200 steps take a few seconds; later steps
#: are slower.
STEPS = {"fast": 120, "default": 250, "thorough": 1000}
#: Number of failed strip widths after which a search ends, by preset. Small jobs reach their optimum quickly.
FAILURES = {"fast": 1, "default": 1, "thorough": 5}
#: Expected number of strip searches per sheet. The first search offers all pieces, and the second only the pieces that
#: fit.
STRIPS_PER_SHEET = 2.0
#: After nesting by rectangles, this many cheaper choices of sheets are tried by shapes, without and with a time limit.
SHAPE_TRIES, TIMED_TRIES = 3, 12
#: Share of the remaining time for each choice of sheets, and share of the total time that is reserved for the last
#: search.
TRY_SHARE, LAST_SEARCH = 0.25, 0.35
#: Highest utilisation that the choice of sheets assumes.
DENSEST = 0.93
#: Share of the time limit that is spent on choosing the sheets by rectangles.
CHOOSING = 0.2
#: With a time limit, each additional variant gets this many threads. One of them runs that variant, and the others run
#: the first variant.
THREADS_PER_VARIANT = 3

#: Maximum number of holes to fill in a part, starting with the largest, and maximum number of kinds of part to try in
#: each hole.
MAX_HOLES = 20
MAX_TRIED = 40


def prepare_task(parts: Sequence[NestPart], options: NestOptions, kerf: float, stocks: Sequence[Stock]) -> NestTask:
    """Create the nesting task for the given kinds of sheet.

    Raises
    ------
    PlanError
        If the list of parts is empty, an outline is invalid, or a part fits no sheet.
    OptionError
        If `options.blocks` is set without a kerf.
    """
    if options.blocks != "none" and kerf <= 0.0:
        raise OptionError("--blocks needs --kerf, the kerf width of the cutting data")
    pieces = pieces_from_parts(parts)
    plain = NestTask(tuple(parts), tuple(pieces), tuple(p.quantity for p in parts), tuple(stocks), options, kerf)
    inner = [plain.usable_size(k) for k in range(len(stocks))]
    check_fit(parts, pieces, inner)
    pieces, counts = nest_in_holes(parts, pieces, plain.spacing)
    if options.blocks != "none":
        pieces, counts = _grouped_pieces(pieces, counts, options, kerf, inner)
    return replace(plain, pieces=tuple(pieces), counts=tuple(counts))


def _grouped_pieces(
    pieces: Sequence[NestPiece],
    counts: Sequence[int],
    options: NestOptions,
    kerf: float,
    inner: Sequence[tuple[float, float]],
) -> tuple[list[NestPiece], list[int]]:
    grouped: list[NestPiece] = []
    numbers: list[int] = []
    for piece, count in zip(pieces, counts, strict=True):
        smallest = min((size for size in inner if piece.fits(*size)), key=math.prod)
        blocks, block_counts = group_in_blocks([piece], [count], kerf, options.blocks, smallest)
        grouped += blocks
        numbers += block_counts
    return grouped, numbers


def nest_variants(
    task: NestTask, search: SolveOptions, on_progress: OnProgress, cancelled: threading.Event
) -> Iterator[Nest | str]:
    """Yield nests that are not yet checked. If a variant fails, yield a message instead.

    Nests by shapes use consecutive seeds. Nests by rectangles use each of the `RULES`.
    """
    task = _with_remnant_packers(task, search)
    if len(task.stocks) > 1:
        yield from _nest_on_several_kinds(task, search, on_progress, cancelled)
        return
    if _uses_shape_nester(task):
        numbers = range(task.options.n_offered)
        yield from _shape_variants(
            search,
            numbers,
            lambda seed, clock: _nest_on_plan(task, single_kind_plan(task), clock, seed, cancelled),
            on_progress,
            cancelled,
        )
    yield from _rectangle_variants(task, on_progress, cancelled.is_set, cancelled)


def _nest_on_several_kinds(
    task: NestTask, search: SolveOptions, on_progress: OnProgress, cancelled: threading.Event
) -> Iterator[Nest | str]:
    """Yield nests on the cheapest sheets.

    Nesting by rectangles is fast and comes first; shapes then try cheaper sheets.

    The first variant by shapes chooses the sheets for all other variants. With a time limit, it is the only variant by
    shapes.
    """
    shapes, nests = _uses_shape_nester(task), list[Nest]()
    start_time, limit = time.monotonic(), math.inf if search.time_limit is None else search.time_limit
    timed_out = [False]

    def is_late() -> bool:
        timed_out[0] |= time.monotonic() > start_time + (CHOOSING if shapes else 1.0) * limit
        return timed_out[0] or cancelled.is_set()

    for rectangle_nest in _rectangle_variants(task, on_progress, is_late, cancelled):
        nests.append(replace(rectangle_nest, repeatable=not timed_out[0]))
        yield nests[-1]
    if not shapes or not nests:
        return
    remaining_search = (
        search
        if search.time_limit is None
        else replace(search, time_limit=0.01 + max(start_time + limit - time.monotonic(), 0.0))
    )
    best_by_rectangles = min(nests, key=lambda nest: nest.rank)
    for shape_nest in _shape_variants(
        remaining_search,
        range(1),
        lambda seed, clock: _nest_on_cheapest(task, best_by_rectangles, clock, seed, cancelled),
        on_progress,
        cancelled,
    ):
        nests += [shape_nest] if isinstance(shape_nest, Nest) else []
        yield shape_nest
    if search.time_limit is None:
        plan = plan_of_nest(min(nests, key=lambda nest: nest.rank))
        yield from _shape_variants(
            remaining_search,
            range(1, task.options.n_offered),
            lambda seed, clock: _nest_on_plan(task, plan, clock, seed, cancelled),
            on_progress,
            cancelled,
        )


def _rectangle_variants(
    task: NestTask, on_progress: OnProgress, late: Callable[[], bool], cancelled: threading.Event
) -> Iterator[Nest]:
    for rule in range(len(RULES)):
        if not (rule and (cancelled.is_set() or late())):
            on_progress(Progress(Message("nesting by rectangles"), 0.99, trial=Trial(f"rectangles {rule}")))
            yield find_cheapest_nest(task, _rectangle_packers(task, rule), "rectangles", rule, late)


def _rectangle_packers(task: NestTask, rule: int) -> list[Packer]:
    margin, spacing = task.options.margin, task.spacing
    return _sheet_packers(task, lambda k: RectanglePacker(task.pieces, *task.usable_size(k), margin, spacing, rule))


def _sheet_packers(task: NestTask, rectangular: Callable[[int], Packer]) -> list[Packer]:
    return [task.remnants[k] if k in task.remnants else rectangular(k) for k in range(len(task.stocks))]


def _with_remnant_packers(task: NestTask, search: SolveOptions) -> NestTask:
    """Create a packer for each non-rectangular sheet, and add it to the task. All variants share these packers."""
    limit = math.inf if search.time_limit is None else search.time_limit
    end = time.monotonic() + limit
    kinds = [k for k, stock in enumerate(task.stocks) if stock.edge]
    seconds = CHOOSING * limit / max(len(kinds), 1)
    return replace(
        task,
        remnants={
            k: RemnantPacker(task.pieces, task.stocks[k], task.options.margin, task.spacing, seconds=seconds, end=end)
            for k in kinds
        },
    )


def _shape_variants(
    search: SolveOptions,
    numbers: range,
    nest_by_shapes: Callable[[int, _Clock], Nest],
    on_progress: OnProgress,
    cancelled: threading.Event,
) -> Iterator[Nest | str]:
    """Run several searches in parallel. Yield a nest by shapes, or a message, for each seed `search.seed + number`.

    With a time limit, the first variant may use all the time and at least two thirds of the threads, so that additional
    variants do not make it less dense. The additional variants share the remaining threads, if there are any. Without a
    limit, each variant gets one thread, so that the number of threads does not affect the nests.
    """
    n_threads = search.threads or os.cpu_count() or 1
    threads = min(n_threads, len(numbers))
    rounds, workers = [1] * len(numbers), [1] * len(numbers)
    if search.time_limit is not None:
        n_others = min(len(numbers) - 1, n_threads // THREADS_PER_VARIANT)
        numbers, threads = numbers if n_others else numbers[:1], 1 + n_others
        rounds = [1, *[math.ceil((len(numbers) - 1) / max(n_others, 1))] * (len(numbers) - 1)]
        workers = [n_threads - n_others, *[1] * (len(numbers) - 1)]

    def search_variant(number: int, rounds: int, workers: int) -> Nest | str:
        if cancelled.is_set():
            return ""
        try:
            return nest_by_shapes(search.seed + number, _Clock(search, rounds, workers))
        except NesterError as problem:
            return "" if cancelled.is_set() else Message("by shapes, seed {}: {}", search.seed + number, problem)

    with ThreadPoolExecutor(max(threads, 1)) as executor:
        futures = [
            executor.submit(search_variant, *arguments) for arguments in zip(numbers, rounds, workers, strict=False)
        ]
        message = (
            Message("nesting by shapes, {} variants", len(futures))
            if len(futures) > 1
            else Message("nesting by shapes")
        )
        try:
            for number in numbers[: len(futures)]:
                on_progress(Progress(message, trial=Trial(f"shapes {search.seed + number}")))
            for number, future in enumerate(futures):
                on_progress(Progress(message, number / len(futures)))
                if outcome := future.result():
                    yield outcome
        # On Ctrl-C, or if the caller stops iterating, end the searches; otherwise the executor would wait for them.
        except BaseException:
            cancelled.set()
            raise


def _uses_shape_nester(task: NestTask) -> bool:
    nester = task.options.nester
    return nester == "shapes" or (nester == "auto" and not all(piece.is_rectangle for piece in task.pieces))


def _nest_on_cheapest(task: NestTask, reference: Nest, clock: _Clock, seed: int, cancelled: threading.Event) -> Nest:
    packers = _shape_packers(task, seed, clock.budget, cancelled, shorten=False)

    def attempt(plan: FillPlan) -> Nest:
        clock.start_plan(task, plan, 1.0 / TRY_SHARE)
        return fill_sheets(task, packers, plan, "shapes", seed)

    best = cheapest_by_density(
        task,
        packers,
        cheaper_plans(task, packers, reference, DENSEST),
        0.5 * (reference.utilisation_of_used + DENSEST),
        TIMED_TRIES if clock.limited else SHAPE_TRIES,
        attempt,
        lambda: cancelled.is_set() or clock.share_left < LAST_SEARCH,
    )
    final_nest = _nest_on_plan(task, plan_of_nest(best or reference), clock, seed, cancelled)
    return min([final_nest] if best is None else [final_nest, best], key=lambda nest: nest.rank)


def _nest_on_plan(task: NestTask, plan: FillPlan, clock: _Clock, seed: int, cancelled: threading.Event) -> Nest:
    clock.start_plan(task, plan, 1)
    return fill_sheets(task, _shape_packers(task, seed, clock.budget, cancelled), plan, "shapes", seed)


def _shape_packers(
    task: NestTask, seed: int, budget: Callable[[], StripBudget], cancelled: threading.Event, *, shorten: bool = True
) -> list[Packer]:
    margin, spacing = task.options.margin, task.spacing

    def packer(k: int) -> Packer:
        inner = task.usable_size(k)
        return ShapePacker(task.pieces, *inner, margin, spacing, seed, budget, cancelled, shorten=shorten)

    return _sheet_packers(task, packer)


class _Clock:
    """Divides the time for a variant among its strips. Without a time limit, it limits the number of steps instead."""

    def __init__(self, search: SolveOptions, rounds: int, workers: int = 1) -> None:
        self.all = math.inf if search.time_limit is None else search.time_limit / rounds
        self.limited, self.workers = search.time_limit is not None, workers
        self.steps, self.failures = math.inf, math.inf
        if search.iterations is not None:
            self.steps = search.iterations
        elif search.time_limit is None:
            self.steps, self.failures = STEPS[search.preset], FAILURES[search.preset]
        self.strips = 1.0
        self.end = time.monotonic() + self.all

    def start_plan(self, task: NestTask, plan: FillPlan, plans: float) -> None:
        area = sum(piece.area * count for piece, count in zip(task.pieces, task.counts, strict=True))
        sheets = 0.0
        for stock, count in plan:
            sheet_area = math.prod(task.usable_size(stock))
            sheets += min(count, area / sheet_area)
            area -= min(count * sheet_area, area)
        self.strips = plans * max(1.0, STRIPS_PER_SHEET * math.floor(sheets))

    @property
    def share_left(self) -> float:
        """Share of the time that is left, from 0 to 1. Without a time limit, it is always 1."""
        return (self.end - time.monotonic()) / self.all if self.limited else 1.0

    def budget(self) -> StripBudget:
        share = max(self.end - time.monotonic(), 0.0) / self.strips
        self.strips = max(1.0, self.strips - 1.0)
        return StripBudget(self.steps, self.failures, share, self.workers)


def nest_in_holes(
    parts: Sequence[NestPart], pieces: Sequence[NestPiece], spacing: float
) -> tuple[list[NestPiece], list[int]]:
    """Put small parts into the holes of other pieces, starting with the smallest pieces.

    The members of all pieces add up to the quantities of `parts`. Inside a hole, parts keep a distance of at least
    `spacing` mm from its edge. The function returns all pieces and their quantities.
    """
    filled, counts = list(pieces), [part.quantity for part in parts]
    clear = buffer_distance(spacing)
    for root in sorted(range(len(parts)), key=lambda i: (pieces[i].area, i)):
        spaces = _free_spaces_in_holes(parts[root].holes, clear)
        while spaces and counts[root]:
            members, used = _nest_in_spaces(root, spaces, filled, counts, clear)
            if not used:
                break
            number = min([counts[root], *(counts[piece] // count for piece, count in used.items())])
            filled.append(NestPiece(pieces[root].path, (*pieces[root].members, *members), pieces[root].angles))
            counts.append(number)
            counts[root] -= number
            for piece, count in used.items():
                counts[piece] -= count * number
    kept = [i for i, count in enumerate(counts) if count]
    return [filled[i] for i in kept], [counts[i] for i in kept]


def _free_spaces_in_holes(holes: Sequence[Polyline], clear: float) -> list[BaseGeometry]:
    large = sorted(holes, key=lambda hole: -abs(hole.area))[:MAX_HOLES]
    polygons = [chord_polygon(hole) for hole in large]
    spaces = [polygon.buffer(-clear) for polygon in polygons if polygon.is_valid]
    return [space for space in spaces if not space.is_empty]


def _nest_in_spaces(
    root: int, spaces: list[BaseGeometry], pieces: list[NestPiece], counts: list[int], clear: float
) -> tuple[list[Placement], Counter[int]]:
    members: list[Placement] = []
    used: Counter[int] = Counter()
    for space in spaces:
        remaining = space
        fitting = [i for i, p in enumerate(pieces) if i != root and counts[i] and p.area < space.area]
        for number in sorted(fitting, key=lambda i: (-pieces[i].area, i))[:MAX_TRIED]:
            piece = pieces[number]
            while used[number] < counts[number] and piece.area < remaining.area:
                position = find_position(piece, remaining, _relative_angles(piece, pieces[root].angles), quick=True)
                if position is None:
                    break
                angle, x, y, polygon = position
                members += piece.placements(angle, x, y)
                used[number] += 1
                remaining = remaining.difference(polygon.buffer(clear))
    return members, +used


def _relative_angles(piece: NestPiece, outer: Sequence[float] | None) -> list[float]:
    """Return the rotations of a piece relative to the surrounding part, rad.

    Each of them must work for every rotation in `outer` that the surrounding part may have.
    """
    angles = piece.angles if piece.angles is not None else FREE_ANGLES
    return [angle for angle in angles if has_common_rotation(piece.angles, outer, angle)]
