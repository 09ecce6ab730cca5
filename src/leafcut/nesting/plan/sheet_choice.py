"""Choose the cheapest combination of sheets of several kinds.

First, a greedy choice gives an upper limit for the cost. It takes the sheets with the most parts per cost, and free
remnants first. Then cheaper combinations are tried. The cheapest combination that holds all parts wins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from leafcut.model.nest import Nest, costs_per_sheet
from leafcut.nesting.plan.fill import Filling, FillPlan, NestTask, Packer, fill_sheets

#: Effort for trying combinations of sheets: total number of pieces to place, and minimum and maximum number of trials.
TRIES, MIN_TRIES, MAX_TRIES = 5_000, 4, 60
#: Maximum number of steps when combinations are enumerated.
MAX_CHOICES = 50_000
#: Two costs are equal if their relative difference is below this.
SAME = 1e-9


def single_kind_plan(task: NestTask, kind: int = 0) -> FillPlan:
    """Return a plan that fills as many sheets of a single kind as needed."""
    return ((kind, min(task.available_sheets[kind], task.max_sheets)),)


def plan_of_nest(nest: Nest) -> FillPlan:
    """Return a plan that fills the same kinds of sheet as a nest, in the same order."""
    return tuple((layout.stock, layout.count) for layout in nest.layouts)


def find_cheapest_nest(
    task: NestTask, packers: Sequence[Packer], method: str, seed: int, late: Callable[[], bool]
) -> Nest:
    """Return the cheapest nest on any combination of sheets.

    No more combinations are tried once `late` returns true.
    """
    if len(packers) == 1:
        return fill_sheets(task, packers, single_kind_plan(task), method, seed)
    best = _fill_greedily(task, packers).as_nest(method, seed)
    # A mix of kinds must never cost more than the best single kind, even if there is little time.
    alone = (fill_sheets(task, packers, single_kind_plan(task, kind), method, seed) for kind in range(len(packers)))
    best = min([best, *alone], key=_nest_rank)
    if any(best.unplaced):
        best = min(
            [best, *(fill_sheets(task, packers, plan, method, seed) for plan in _plans_with_all_sheets(task, packers))],
            key=_nest_rank,
        )
    tries = min(max(TRIES // sum(task.counts), MIN_TRIES), MAX_TRIES)
    plans = cheaper_plans(task, packers, best)
    return cheapest_of_plans(plans, tries, best, lambda plan: fill_sheets(task, packers, plan, method, seed), late)


def cheapest_of_plans(
    plans: Sequence[FillPlan],
    tries: int,
    best: Nest,
    attempt: Callable[[FillPlan], Nest],
    late: Callable[[], bool],
) -> Nest:
    """Return the nest of the cheapest plan that holds all parts. If no plan holds them, return `best`.

    `plans` are sorted by cost. If there are more than `tries` plans, they are searched by bisection, because more
    expensive plans usually hold more parts.
    """
    low, high = 0, len(plans)
    for tries_left in range(tries, 0, -1):
        if low >= high or late():
            break
        index = low if high - low <= tries_left else (low + high) // 2
        nest = attempt(plans[index])
        best = min(best, nest, key=_nest_rank)
        low, high = (index + 1, high) if any(nest.unplaced) else (low, index)
    return best


def cheapest_by_density(
    task: NestTask,
    packers: Sequence[Packer],
    plans: Sequence[FillPlan],
    density: float,
    tries: int,
    attempt: Callable[[FillPlan], Nest],
    late: Callable[[], bool],
) -> Nest | None:
    """Return the nest of the cheapest plan that holds all parts, or None if there is none.

    `plans` are sorted by cost. The first attempt uses plans with a utilisation of at most `density`, and each attempt
    updates this value.
    """
    need = _area_needs(task, packers)[0][1]
    densities = [need / sum(packers[k].sheet_area * count for k, count in plan) for plan in plans]
    total_area = sum(part.area * part.quantity for part in task.parts)
    candidates, best = list(range(len(plans))), None
    for _ in range(tries):
        if not candidates or late():
            break
        median = sorted(densities[k] for k in candidates)[(len(candidates) - 1) // 2]
        likely = [k for k in candidates if densities[k] <= density]
        index = min(likely or [k for k in candidates if densities[k] <= median])
        nest = attempt(plans[index])
        if any(nest.unplaced):
            density = min(density, densities[index] * nest.area / total_area)
            candidates = [k for k in candidates if densities[k] < densities[index]]
        else:
            best, density = nest, max(density, densities[index])
            candidates = [k for k in candidates if k < index]
    return best


def _nest_rank(nest: Nest) -> tuple[float, ...]:
    return nest.rank


def _fill_greedily(task: NestTask, packers: Sequence[Packer]) -> Filling:
    """Choose the sheets with the most parts per cost. The last sheet is the cheapest that holds all remaining parts."""
    filling = Filling(task, packers)
    costs, sheets_left = costs_per_sheet(task.stocks), task.available_sheets
    while filling.left.total() and filling.n_sheets < task.max_sheets:
        available = [k for k in range(len(packers)) if sheets_left[k] > 0]
        tried = {
            k: placed for k in available if (placed := filling.fill_sheet(k, [kind for kind in available if kind != k]))
        }
        if not tried:
            break
        complete = [k for k, placed in tried.items() if len(placed) == filling.left.total()]
        areas = {k: sum(task.pieces[placed_piece.piece].area for placed_piece in placed) for k, placed in tried.items()}
        free = [k for k in tried if costs[k] <= 0.0]
        if free:
            stock = max(free, key=lambda k: areas[k] / packers[k].sheet_area)
        else:
            stock = min(complete or tried, key=lambda k: costs[k] if complete else costs[k] / areas[k])
        sheets_left[stock] -= filling.add_sheets(
            stock, tried[stock], min(sheets_left[stock], task.max_sheets - filling.n_sheets)
        )
    return filling


def _plans_with_all_sheets(task: NestTask, packers: Sequence[Packer]) -> Iterator[FillPlan]:
    """Yield plans that use all available sheets. If the number of plans is limited, larger sheets are preferred."""
    remaining, counts = task.max_sheets, [0.0] * len(packers)
    for k in sorted(range(len(packers)), key=lambda k: (-packers[k].sheet_area, k)):
        counts[k] = min(task.available_sheets[k], remaining)
        remaining -= counts[k]
    return _filling_orders(packers, counts, costs_per_sheet(task.stocks))


def cheaper_plans(task: NestTask, packers: Sequence[Packer], reference: Nest, densest: float = 1.0) -> list[FillPlan]:
    """Return all plans that are cheaper than a complete nest and have enough area, cheapest first.

    The area is enough if the parts use at most the share `densest` of it. If the reference nest is incomplete, the list
    is empty.
    """
    if any(reference.unplaced):
        return []
    costs, areas = costs_per_sheet(task.stocks), [densest * packer.sheet_area for packer in packers]
    below = reference.rank[1] * (1.0 - SAME)
    choices = _SheetCounts(
        costs, areas, task.available_sheets, task.max_sheets, _area_needs(task, packers), below
    ).counts_below()
    choices.sort(
        key=lambda counts: (_total_cost(counts, costs), -_count_sheets_without_cost(counts, costs), sum(counts), counts)
    )
    return [plan for counts in choices for plan in _filling_orders(packers, counts, costs)]


def _count_sheets_without_cost(counts: Sequence[int], costs: Sequence[float]) -> int:
    return sum(number for number, cost in zip(counts, costs, strict=True) if cost <= 0.0)


def _filling_orders(packers: Sequence[Packer], counts: Sequence[float], costs: Sequence[float]) -> Iterator[FillPlan]:
    """Yield two orders for filling the sheets: largest first, and smallest first.

    In both orders, sheets without cost come first.
    """
    kinds = sorted((k for k, n in enumerate(counts) if n), key=lambda k: (-packers[k].sheet_area, k))
    unpaid = tuple((k, counts[k]) for k in kinds if costs[k] <= 0.0)
    plan = tuple((k, counts[k]) for k in kinds if costs[k] > 0.0)
    yield (*unpaid, *plan)
    if len(plan) > 1:
        yield (*unpaid, *plan[::-1])


def _total_cost(counts: Sequence[float], costs: Sequence[float]) -> float:
    return sum(number * cost for number, cost in zip(counts, costs, strict=True))


#: A set of kinds of sheet, and the total area of the pieces that fit on no other kind, mm².
_Need = tuple[frozenset[int], float]


def _area_needs(task: NestTask, packers: Sequence[Packer]) -> list[_Need]:
    """Return sets of kinds of sheet. For each set, give the total area of the pieces that fit on no other kind, mm²."""
    areas: dict[frozenset[int], float] = {frozenset(range(len(packers))): 0.0}
    for piece, count in enumerate(task.counts):
        kinds = frozenset(k for k, packer in enumerate(packers) if packer.fits_on_empty_sheet(piece))
        if kinds:
            areas[kinds] = areas.get(kinds, 0.0) + count * min(packers[k].required_area(piece) for k in kinds)
    return [(kinds, sum(area for subset, area in areas.items() if subset <= kinds)) for kinds in areas]


@dataclass(frozen=True)
class _SheetCounts:
    """Enumerates the numbers of sheets of each kind that have enough area and cost less than `below`.

    Each result is a sequence with a number for each kind of sheet.
    """

    costs: Sequence[float]
    areas: Sequence[float]
    available_sheets: Sequence[float]
    max_sheets: float
    needs: Sequence[_Need]
    below: float

    def counts_below(self) -> list[tuple[int, ...]]:
        rates = [cost / max(area, SAME) for cost, area in zip(self.costs, self.areas, strict=True)]
        # Kinds are sorted by cost per area, so the area still needed costs at least as much with every later kind.
        order = sorted(range(len(rates)), key=lambda k: (rates[k], k))
        total_need = max(need for _, need in self.needs)
        choices: list[tuple[int, ...]] = []
        stack: list[tuple[int, ...]] = [()]
        for _ in range(MAX_CHOICES):
            if not stack:
                break
            numbers = stack.pop()
            numbers_by_kind = dict(zip(order, numbers, strict=False))
            if len(numbers_by_kind) == len(order):
                counts = tuple(numbers_by_kind[k] for k in range(len(order)))
                choices += [counts] if self._has_enough_area(counts) else []
                continue
            k, cost = order[len(numbers_by_kind)], sum(n * self.costs[i] for i, n in numbers_by_kind.items())
            remaining = total_need - sum(n * self.areas[i] for i, n in numbers_by_kind.items())
            if cost + max(remaining, 0.0) * rates[k] < self.below:
                stack += [(*numbers, n) for n in range(self._max_count(k, cost, sum(numbers), total_need) + 1)]
        return choices

    def _max_count(self, k: int, cost: float, taken: int, total_need: float) -> int:
        # The cost does not limit the number of free sheets; twice the number required by area is enough.
        affordable = (
            (self.below - cost) / self.costs[k]
            if self.costs[k]
            else 2.0 * math.ceil(total_need / max(self.areas[k], 1.0))
        )
        return int(min(self.available_sheets[k], self.max_sheets - taken, affordable, MAX_CHOICES))

    def _has_enough_area(self, counts: Sequence[int]) -> bool:
        if not any(counts) or _total_cost(counts, self.costs) >= self.below:
            return False
        return all(
            sum(counts[k] * self.areas[k] for k in kinds) >= need and any(counts[k] for k in kinds)
            for kinds, need in self.needs
        )
