"""Parts and quantities become nests: sheet after sheet, in several variants. None of them is trusted before a check."""

from __future__ import annotations

import math
import os
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Protocol

from leafcut.model.nest import Layout, Nest, NestPart
from leafcut.options import NestOptions, SolveOptions
from leafcut.plan.nest_blocks import in_blocks
from leafcut.plan.nest_holes import filled_holes
from leafcut.plan.nest_pieces import FORGIVEN, Piece, check_fit, pieces_of, share_of
from leafcut.plan.nest_rectangles import RULES, Laid, RectanglePacker
from leafcut.plan.nest_shapes import ShapePacker
from leafcut.plan.nest_strip import Budget, NesterError

#: Steps of the irregular nester for one strip, by preset. Some 200 take a few seconds, each of the next far longer.
STEPS = {"fast": 120, "default": 250, "thorough": 1000}
#: And how often it may give up on a width: a few parts soon lie as well as they can.
FAILURES = {"fast": 1, "default": 1, "thorough": 5}
#: The least that stays between two parts, mm.
TOUCHING = 0.1
#: A strip is packed this often for one sheet: once with what is there, and again with what fits.
STRIPS_PER_SHEET = 2.0

#: Told what is being done, and the share of it that is done.
Tell = Callable[[str, float], None]


class Packer(Protocol):
    """Fills one sheet."""

    offered: float
    repeatable: bool

    def weight(self, piece: int) -> float:
        """Return what a piece takes of a sheet, mm²."""

    @property
    def room(self) -> float:
        """What a sheet has, mm²."""

    def fill(self, offered: Counter[int], last: bool) -> list[Laid]:
        """Return what fits of the pieces offered; of the `last` ones, as far to the left as was found."""


@dataclass(frozen=True)
class Task:
    """What is to be nested: parts as pieces, how many of each, and on what."""

    parts: tuple[NestPart, ...]
    pieces: tuple[Piece, ...]
    counts: tuple[int, ...]
    options: NestOptions

    @property
    def inner(self) -> tuple[float, float]:
        """Length and width of a sheet less its margins, mm."""
        length, width = self.options.size
        return length - 2.0 * self.options.margin, width - 2.0 * self.options.margin

    @property
    def spacing(self) -> float:
        """What stays between two parts, mm; never nothing: edges that touch would be taken for one."""
        return max(self.options.kerf + self.options.gap, TOUCHING)


def prepare(parts: Sequence[NestPart], options: NestOptions) -> Task:
    """Return what is to be nested.

    Raises
    ------
    PlanError
        There is nothing to nest, an outline is no outline, or a part fits no sheet.
    """
    pieces = pieces_of(parts)
    plain = Task(tuple(parts), tuple(pieces), tuple(p.quantity for p in parts), options)
    check_fit(parts, pieces, *plain.inner)
    counts = list(plain.counts)
    if options.into_holes:
        pieces, counts = filled_holes(parts, pieces, plain.spacing)
    if options.blocks != "none":
        pieces, counts = in_blocks(pieces, counts, options.kerf, options.blocks, plain.inner)
    return replace(plain, pieces=tuple(pieces), counts=tuple(counts))


def variants(task: Task, search: SolveOptions, tell: Tell, cancelled: threading.Event) -> Iterator[Nest | str]:
    """Yield nests as they are found, unchecked; a line of text for one that could not be made.

    By shapes, one for each seed from the one asked for; by rectangles, one for each rule of `RULES`.
    """
    if _by_shapes(task):
        yield from _shape_variants(task, search, tell, cancelled)
    tell("nesting by rectangles", 0.99)
    for rule in range(len(RULES)):
        if not cancelled.is_set():
            packer = RectanglePacker(task.pieces, *task.inner, task.options.margin, task.spacing, rule)
            yield _nest(task, packer, "rectangles", rule)


def _shape_variants(task: Task, search: SolveOptions, tell: Tell, cancelled: threading.Event) -> Iterator[Nest | str]:
    """Yield a nest by shapes for every seed, in the order of the seeds; several are sought at a time.

    Of a time limit the first has all, as if it were the only one, and the others what the other threads have: more
    variants never cost density. One thread makes one.
    """
    wanted = task.options.variants
    threads = min(search.threads or os.cpu_count() or 1, wanted)
    rounds = [1] * wanted
    if search.time_limit is not None:
        wanted = wanted if threads > 1 else 1
        rounds = [1, *[math.ceil((wanted - 1) / max(threads - 1, 1))] * (wanted - 1)]

    def make(number: int) -> Nest | str:
        if cancelled.is_set():
            return ""
        seed, clock = search.seed + number, _Clock(task, search, rounds[number])
        try:
            return _nest(task, _shape_packer(task, seed, clock, cancelled), "shapes", seed)
        except NesterError as problem:
            return "" if cancelled.is_set() else f"by shapes, seed {seed}: {problem}"

    with ThreadPoolExecutor(threads) as executor:
        futures = [executor.submit(make, number) for number in range(wanted)]
        try:
            for number, future in enumerate(futures):
                tell(f"nesting by shapes, {wanted} variants", number / wanted)
                if found := future.result():
                    yield found
        except BaseException:  # Ctrl-C, or nobody wants more: the searches end, or leaving would wait for them
            cancelled.set()
            raise


def _by_shapes(task: Task) -> bool:
    wanted = task.options.nester
    return wanted == "shapes" or (wanted == "auto" and not all(piece.is_rectangle for piece in task.pieces))


def _shape_packer(task: Task, seed: int, clock: _Clock, cancelled: threading.Event) -> ShapePacker:
    return ShapePacker(task.pieces, *task.inner, task.options.margin, task.spacing, seed, clock.budget, cancelled)


class _Clock:
    """Shares the time that one variant has among its strips; without a limit, a number of steps for each."""

    def __init__(self, task: Task, search: SolveOptions, rounds: int) -> None:
        left = math.inf if search.time_limit is None else search.time_limit / rounds
        self.steps, self.failures = math.inf, math.inf
        if search.iterations is not None:
            self.steps = search.iterations
        elif search.time_limit is None:
            self.steps, self.failures = STEPS[search.preset], FAILURES[search.preset]
        area = sum(piece.area * count for piece, count in zip(task.pieces, task.counts, strict=True))
        self.strips = max(1.0, STRIPS_PER_SHEET * math.floor(area / (task.inner[0] * task.inner[1])))
        self.end = time.monotonic() + left

    def budget(self) -> Budget:
        """Return what the next strip may take."""
        share = max(self.end - time.monotonic(), 0.0) / self.strips
        self.strips = max(1.0, self.strips - 1.0)
        return Budget(self.steps, self.failures, share)


def _nest(task: Task, packer: Packer, method: str, seed: int) -> Nest:
    """Fill sheets until nothing is left, or no sheets are."""
    left = Counter(dict(enumerate(task.counts)))
    most = task.options.max_sheets or math.inf
    layouts: list[Layout] = []
    n_sheets = 0
    while left.total() and n_sheets < most:
        offered = _offer(packer, left)
        laid = packer.fill(offered, last=offered == left) or _alone(task, left)
        used = Counter(piece.piece for piece in laid)
        count = min(left[piece] // number for piece, number in used.items())
        count = int(min(count, most - n_sheets))
        placements = [p for one in laid for p in task.pieces[one.piece].laid(one.angle, one.x, one.y)]
        layouts.append(Layout(tuple(placements), count))
        left -= Counter({piece: number * count for piece, number in used.items()})
        n_sheets += count
    length, width = task.options.size
    return Nest(task.parts, length, width, tuple(layouts), _unplaced(task, left), method, seed, packer.repeatable)


def _unplaced(task: Task, left: Counter[int]) -> tuple[int, ...]:
    missing = Counter[int]()
    for piece, count in left.items():
        for member in task.pieces[piece].members:
            missing[member.part] += count
    return tuple(missing[number] for number in range(len(task.parts)))


def _offer(packer: Packer, left: Counter[int]) -> Counter[int]:
    """Return what one sheet is chosen from: all that is left, or a little more than it can hold."""
    return share_of(left, packer.weight, packer.offered * packer.room)


def _alone(task: Task, left: Counter[int]) -> list[Laid]:
    """Return the largest piece in the corner of a sheet of its own, for a packer that found no place for any."""
    length, width = task.inner
    piece = max(left, key=lambda p: (task.pieces[p].area, -p))
    fitting = [b for b in task.pieces[piece].boxes if b.width <= length + FORGIVEN and b.height <= width + FORGIVEN]
    box, margin = fitting[0], task.options.margin
    return [Laid(piece, box.angle, margin - box.x, margin - box.y)]
