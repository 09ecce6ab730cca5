"""Which sheets of several kinds to take, so that they cost least and hold all parts; never more than there are.

First one sheet after the other is taken, the one that gives most parts for its cost; remnants that cost nothing come
before all others. Then the choices of sheets that cost less and have area enough are tried: the cheapest that holds all
parts is taken. Where there are more of them than time to try them, it is sought by halves, or by how dense the parts
lay on the sheets that were tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from leafcut.model.nest import Nest, sheet_costs
from leafcut.processes.nesting.plan.fill import Filling, FillPlan, NestTask, Packer, filled

#: So many choices of sheets are tried, by the number of pieces that are packed for it: between these two.
TRIES, LEAST_TRIES, MOST_TRIES = 5_000, 4, 60
#: And so many are looked at.
MOST_LOOKED = 50_000
#: Costs nearer than this share of themselves are the same.
SAME = 1e-9


def as_many(task: NestTask, kind: int = 0) -> FillPlan:
    """Return a plan that takes as many of one kind of sheet as it needs."""
    return ((kind, min(task.at_hand[kind], task.most)),)


def same_sheets(nest: Nest) -> FillPlan:
    """Return a plan that takes the sheets of a nest, in its order."""
    return tuple((layout.stock, layout.count) for layout in nest.layouts)


def cheapest(task: NestTask, packers: Sequence[Packer], method: str, seed: int, late: Callable[[], bool]) -> Nest:
    """Return a nest on the sheets that cost least, as far as was looked until it was `late`."""
    if len(packers) == 1:
        return filled(task, packers, as_many(task), method, seed)
    best = _one_by_one(task, packers).nest(method, seed)
    # A choice of kinds never costs more than the best of them alone, however little time there is.
    alone = (filled(task, packers, as_many(task, kind), method, seed) for kind in range(len(packers)))
    best = min([best, *alone], key=_rank)
    if any(best.unplaced):
        best = min([best, *(filled(task, packers, plan, method, seed) for plan in _all(task, packers))], key=_rank)
    tries = min(max(TRIES // sum(task.counts), LEAST_TRIES), MOST_TRIES)
    plans = cheaper(task, packers, best)
    return cheapest_of(plans, tries, best, lambda plan, _: filled(task, packers, plan, method, seed), late)


def cheapest_of(
    plans: Sequence[FillPlan],
    tries: int,
    best: Nest,
    attempt: Callable[[FillPlan, int], Nest],
    late: Callable[[], bool],
) -> Nest:
    """Return the nest on the cheapest of some plans, sorted by cost, that hold all parts; `best` where none does.

    Of more plans than may be tried, those in the middle are tried first: most that cost more hold more. `attempt` makes
    a nest of a plan, and is told how many may be tried after it.
    """
    low, high = 0, len(plans)
    for left in range(tries, 0, -1):
        if low >= high or late():
            break
        at = low if high - low <= left else (low + high) // 2
        one = attempt(plans[at], left - 1)
        best = min(best, one, key=_rank)
        low, high = (at + 1, high) if any(one.unplaced) else (low, at)
    return best


def cheapest_by_density(
    task: NestTask, packers: Sequence[Packer], plans: Sequence[FillPlan], density: float, tries: int,
    attempt: Callable[[FillPlan], Nest], late: Callable[[], bool],
) -> Nest | None:  # fmt: skip
    """Return the nest on the cheapest of some plans, sorted by cost, that holds all parts; None where none does.

    Parameters
    ----------
    density
        The share of the sheets that the parts are expected to take. Every attempt corrects it.
    """
    need = _needs(task, packers)[0][1]
    wanted = [need / sum(packers[k].room * count for k, count in plan) for plan in plans]
    whole = sum(part.area * part.quantity for part in task.parts)
    left, best = list(range(len(plans))), None
    for _ in range(tries):
        if not left or late():
            break
        middle = sorted(wanted[k] for k in left)[(len(left) - 1) // 2]
        likely = [k for k in left if wanted[k] <= density]
        at = min(likely or [k for k in left if wanted[k] <= middle])
        one = attempt(plans[at])
        if any(one.unplaced):
            density = min(density, wanted[at] * one.area / whole)
            left = [k for k in left if wanted[k] < wanted[at]]
        else:
            best, density = one, max(density, wanted[at])
            left = [k for k in left if k < at]
    return best


def _rank(nest: Nest) -> tuple[float, ...]:
    return nest.rank


def _one_by_one(task: NestTask, packers: Sequence[Packer]) -> Filling:
    """Return sheets each of which gives most parts for its cost; the last is the cheapest that holds the rest."""
    made = Filling(task, packers)
    costs, at_hand = sheet_costs(task.stocks), task.at_hand
    while made.left.total() and made.n_sheets < task.most:
        there = [k for k in range(len(packers)) if at_hand[k] > 0]
        tried = {k: laid for k in there if (laid := made.laid(k, [other for other in there if other != k]))}
        if not tried:
            break
        whole = [k for k, laid in tried.items() if len(laid) == made.left.total()]
        areas = {k: sum(task.pieces[one.piece].area for one in laid) for k, laid in tried.items()}
        free = [k for k in tried if costs[k] <= 0.0]
        if free:
            stock = max(free, key=lambda k: areas[k] / packers[k].room)
        else:
            stock = min(whole or tried, key=lambda k: costs[k] if whole else costs[k] / areas[k])
        at_hand[stock] -= made.add(stock, tried[stock], min(at_hand[stock], task.most - made.n_sheets))
    return made


def _all(task: NestTask, packers: Sequence[Packer]) -> Iterator[FillPlan]:
    """Return plans that take all sheets there are, the largest of them where no more may be taken."""
    left, counts = task.most, [0.0] * len(packers)
    for k in sorted(range(len(packers)), key=lambda k: (-packers[k].room, k)):
        counts[k] = min(task.at_hand[k], left)
        left -= counts[k]
    return _orders(packers, counts, sheet_costs(task.stocks))


def cheaper(task: NestTask, packers: Sequence[Packer], than: Nest, densest: float = 1.0) -> list[FillPlan]:
    """Return plans of sheets that cost less than a whole nest, the cheapest first, and have area enough.

    Parameters
    ----------
    densest
        The share of a sheet that parts can take at most.
    """
    if any(than.unplaced):
        return []
    costs, rooms = sheet_costs(task.stocks), [densest * packer.room for packer in packers]
    below = than.rank[1] * (1.0 - SAME)
    found = _Choice(costs, rooms, task.at_hand, task.most, _needs(task, packers), below).found()
    found.sort(key=lambda counts: (_cost(counts, costs), -_unpaid(counts, costs), sum(counts), counts))
    return [plan for counts in found for plan in _orders(packers, counts, costs)]


def _unpaid(counts: Sequence[int], costs: Sequence[float]) -> int:
    return sum(number for number, cost in zip(counts, costs, strict=True) if cost <= 0.0)


def _orders(packers: Sequence[Packer], counts: Sequence[float], costs: Sequence[float]) -> Iterator[FillPlan]:
    """Yield the plans that fill some sheets: the largest first, then the smallest first; those for nothing before."""
    kinds = sorted((k for k, n in enumerate(counts) if n), key=lambda k: (-packers[k].room, k))
    unpaid = tuple((k, counts[k]) for k in kinds if costs[k] <= 0.0)
    plan = tuple((k, counts[k]) for k in kinds if costs[k] > 0.0)
    yield (*unpaid, *plan)
    if len(plan) > 1:
        yield (*unpaid, *plan[::-1])


def _cost(counts: Sequence[float], costs: Sequence[float]) -> float:
    return sum(number * cost for number, cost in zip(counts, costs, strict=True))


#: Which kinds of sheet hold some of the pieces, and what these take at least, mm².
_Need = tuple[frozenset[int], float]


def _needs(task: NestTask, packers: Sequence[Packer]) -> list[_Need]:
    """Return for sets of kinds of sheet what the pieces take that have room on no others."""
    areas: dict[frozenset[int], float] = {frozenset(range(len(packers))): 0.0}
    for piece, count in enumerate(task.counts):
        kinds = frozenset(k for k, packer in enumerate(packers) if packer.holds(piece))
        if kinds:
            areas[kinds] = areas.get(kinds, 0.0) + count * min(packers[k].weight(piece) for k in kinds)
    return [(kinds, sum(area for other, area in areas.items() if other <= kinds)) for kinds in areas]


@dataclass(frozen=True)
class _Choice:
    """Looks for numbers of sheets that cost less than `below` and have area enough; all lists are by kind of sheet."""

    costs: Sequence[float]
    rooms: Sequence[float]
    at_hand: Sequence[float]
    most: float
    needs: Sequence[_Need]
    below: float

    def found(self) -> list[tuple[int, ...]]:
        """Return the numbers of every kind."""
        rates = [cost / max(room, SAME) for cost, room in zip(self.costs, self.rooms, strict=True)]
        # What has most area for its cost comes first: what is still needed costs no less than by the next kind.
        order = sorted(range(len(rates)), key=lambda k: (rates[k], k))
        whole = max(need for _, need in self.needs)
        made: list[tuple[int, ...]] = []
        waiting: list[tuple[int, ...]] = [()]
        for _ in range(MOST_LOOKED):
            if not waiting:
                break
            numbers = waiting.pop()
            taken = dict(zip(order, numbers, strict=False))
            if len(taken) == len(order):
                counts = tuple(taken[k] for k in range(len(order)))
                made += [counts] if self._enough(counts) else []
                continue
            k, cost = order[len(taken)], sum(n * self.costs[i] for i, n in taken.items())
            rest = whole - sum(n * self.rooms[i] for i, n in taken.items())
            if cost + max(rest, 0.0) * rates[k] < self.below:
                waiting += [(*numbers, n) for n in range(self._up_to(k, cost, sum(numbers), whole) + 1)]
        return made

    def _up_to(self, k: int, cost: float, taken: int, whole: float) -> int:
        """Return how many of a kind can be taken besides what costs `cost`."""
        # What costs nothing would be taken without end: twice what area asks for is enough.
        worth = (
            (self.below - cost) / self.costs[k] if self.costs[k] else 2.0 * math.ceil(whole / max(self.rooms[k], 1.0))
        )
        return int(min(self.at_hand[k], self.most - taken, worth, MOST_LOOKED))

    def _enough(self, counts: Sequence[int]) -> bool:
        if not any(counts) or _cost(counts, self.costs) >= self.below:
            return False
        return all(
            sum(counts[k] * self.rooms[k] for k in kinds) >= need and any(counts[k] for k in kinds)
            for kinds, need in self.needs
        )
