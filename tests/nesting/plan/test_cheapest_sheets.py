"""Which sheets to take: by halves among the cheaper plans, and those plans by brute force over all numbers."""

from __future__ import annotations

import itertools
import math
import random
from collections import Counter
from dataclasses import dataclass

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, NestPart, Placement, Stock
from leafcut.nesting.options import NestOptions
from leafcut.nesting.plan.fill import Filling, NestTask, fill_sheets
from leafcut.nesting.plan.pieces import pieces_from_parts
from leafcut.nesting.plan.rectangles import PlacedPiece
from leafcut.nesting.plan.sheet_choice import (
    cheaper_plans,
    cheapest_by_density,
    cheapest_of_plans,
    find_cheapest_nest,
    plan_of_nest,
)


@dataclass
class Shelves:
    """A packer without geometry: a sheet holds a number of plates."""

    size: int
    offered: float = 1.3
    repeatable: bool = True

    def fits_on_empty_sheet(self, piece: int) -> bool:
        return self.size > 0

    def required_area(self, piece: int) -> float:
        return 1.0

    @property
    def sheet_area(self) -> float:
        return float(self.size)

    def fill(self, offered: Counter[int], last: bool) -> list[PlacedPiece]:
        pieces = sorted(offered.elements())[: self.size]
        return [PlacedPiece(piece, 0.0, 0.0, 0.0) for piece in pieces]


def task(count: int, *sheets: tuple[int | None, float]) -> NestTask:
    """Return plates on sheets of (available number, price)."""
    path = Polyline.of_points([(0, 0), (1, 0), (1, 1), (0, 1)], closed=True)
    parts = (NestPart("plate", (Contour(path),), count),)
    stocks = tuple(Stock(10.0, 10.0, number, price) for number, price in sheets)
    return NestTask(parts, tuple(pieces_from_parts(parts)), (count,), stocks, NestOptions(), 2.0)


def nest_of(cost: float, unplaced: int = 0) -> Nest:
    part = task(1, (1, cost)).parts
    layouts = (Layout((Placement(0, 0.0, 0.0, 0.0),)),)
    return Nest(part, (Stock(10.0, 10.0, 1, cost),), layouts, (unplaced,), "rectangles", 0)


def taken(nest: Nest, kinds: int) -> list[int]:
    return [sum(one.count for one in nest.layouts if one.stock == k) for k in range(kinds)]


@pytest.mark.parametrize("seed", range(30))
def test_no_choice_of_sheets_that_holds_all_is_cheaper(seed: int) -> None:
    """Brute force over every number of every kind of sheet."""
    dice = random.Random(seed)
    sizes = [dice.randint(1, 9) for _ in range(3)]
    sheets = [(dice.randint(1, 4), float(dice.randint(1, 30))) for _ in range(3)]
    wanted = dice.randint(1, sum(n * size for (n, _), size in zip(sheets, sizes, strict=True)))
    found = find_cheapest_nest(task(wanted, *sheets), [Shelves(size) for size in sizes], "m", 0, lambda: False)
    choices = itertools.product(*(range(n + 1) for n, _ in sheets))
    least = min(
        sum(n * price for n, (_, price) in zip(choice, sheets, strict=True))
        for choice in choices
        if sum(n * size for n, size in zip(choice, sizes, strict=True)) >= wanted
    )
    assert found.unplaced == (0,)
    assert found.cost == least
    assert all(n <= there for n, (there, _) in zip(taken(found, 3), sheets, strict=True))


@pytest.mark.parametrize("seed", range(30))
def test_the_plans_looked_at_are_all_that_cost_less_and_have_area_enough_the_cheapest_first(seed: int) -> None:
    dice = random.Random(seed)
    sizes = [dice.randint(1, 9) for _ in range(3)]
    sheets = [(dice.randint(1, 3), float(dice.randint(1, 30))) for _ in range(3)]
    job, packers = task(dice.randint(1, 12), *sheets), [Shelves(size) for size in sizes]
    whole = fill_sheets(job, packers, tuple((k, n) for k, (n, _) in enumerate(sheets)), "m", 0)
    plans = cheaper_plans(job, packers, whole)
    if whole.unplaced != (0,):
        assert plans == []
        return
    want = {
        counts
        for counts in itertools.product(*(range(n + 1) for n, _ in sheets))
        if sum(n * price for n, (_, price) in zip(counts, sheets, strict=True)) < whole.cost * (1 - 1e-9)
        and sum(n * size for n, size in zip(counts, sizes, strict=True)) >= job.counts[0]
    }
    assert {tuple(dict(plan).get(k, 0) for k in range(3)) for plan in plans} == want
    costs = [sum(n * sheets[k][1] for k, n in plan) for plan in plans]
    assert costs == sorted(costs)


def test_of_more_plans_than_may_be_tried_the_cheapest_that_holds_all_is_found_by_halves() -> None:
    plans = [((0, float(k)),) for k in range(1000)]
    tried: list[int] = []

    def attempt(plan: tuple[tuple[int, float], ...]) -> Nest:
        tried.append(int(plan[0][1]))
        return nest_of(plan[0][1], unplaced=int(plan[0][1] < 617))

    best = cheapest_of_plans(plans, 12, nest_of(5000.0), attempt, lambda: False)
    assert best.cost == 617
    assert len(tried) <= 12


def test_nothing_is_tried_any_more_when_it_is_late_and_the_best_so_far_stays() -> None:
    best = nest_of(7.0)
    assert cheapest_of_plans([((0, 1.0),)], 9, best, lambda *_: pytest.fail("tried"), lambda: True) is best
    assert cheapest_of_plans([], 9, best, lambda *_: pytest.fail("tried"), lambda: False) is best


def test_the_sheets_of_a_nest_are_a_plan_that_makes_it_again() -> None:
    job, packers = task(11, (2, 1.0), (9, 1.0)), [Shelves(4), Shelves(1)]
    whole = fill_sheets(job, packers, ((0, 2), (1, 9)), "m", 0)
    assert (taken(whole, 2), whole.unplaced) == ([2, 3], (0,))
    again = fill_sheets(job, packers, plan_of_nest(whole), "m", 0)
    assert again.layouts == whole.layouts


def test_a_sheet_is_cut_as_often_as_there_are_parts_for_it_and_no_oftener() -> None:
    made = Filling(task(11, (None, 1.0)), [Shelves(4)])
    laid = made.fill_sheet(0, [])
    assert (len(laid), made.add_sheets(0, laid, math.inf), made.left.total()) == (4, 2, 3)
    rest = made.fill_sheet(0, [])
    assert (len(rest), made.add_sheets(0, rest, math.inf), made.left.total()) == (3, 1, 0)
    assert made.as_nest("m", 0).unplaced == (0,)


def test_a_second_kind_of_sheet_makes_no_nest_dearer_even_without_time() -> None:
    """Twenty plates on sheets of ten at 10 cost 20; sheets of nine at 8.9, more for their cost, would cost 26.7."""
    both = task(20, (None, 10.0), (None, 8.9))
    assert find_cheapest_nest(both, [Shelves(10), Shelves(9)], "rectangles", 0, lambda: True).cost == 20.0


@pytest.mark.parametrize("seed", range(20))
def test_by_density_few_tries_find_the_cheapest_plan_that_holds_all(seed: int) -> None:
    """Brute force over all plans, where parts take the same share of every sheet; no try of a plan is repeated."""
    made = random.Random(seed)
    real, expected, count = made.uniform(0.5, 0.9), made.uniform(0.4, 0.95), 10_000
    sizes = [made.randint(1000, 9000) for _ in range(3)]
    wanted = task(count, *((4, size * made.uniform(0.7, 1.3)) for size in sizes))
    packers = [Shelves(size) for size in sizes]
    costs = [stock.price or 0.0 for stock in wanted.stocks]
    plans = sorted(
        (
            tuple((k, n) for k, n in enumerate(numbers) if n)
            for numbers in itertools.product(range(5), repeat=3)
            if sum(n * size for n, size in zip(numbers, sizes, strict=True)) >= count
        ),
        key=lambda plan: sum(costs[k] * n for k, n in plan),
    )
    tried = []

    def attempt(plan: tuple[tuple[int, float], ...]) -> Nest:
        tried.append(plan)
        held = min(round(real * sum(sizes[k] * n for k, n in plan)), count)
        layout = Layout((Placement(0, 0.0, 0.0, 0.0),) * held, 1, plan[0][0])
        return Nest(wanted.parts, wanted.stocks, (layout,), (count - held,), "shapes", 0)

    found = cheapest_by_density(wanted, packers, plans, expected, 12, attempt, lambda: False)
    fitting = [plan for plan in plans if round(real * sum(sizes[k] * n for k, n in plan)) >= count]
    assert len(tried) == len(set(tried)) <= 12
    holding = [plan for plan in tried if plan in fitting]
    assert (found is None) == (not fitting)
    if fitting:
        assert min(plans.index(plan) for plan in holding) == plans.index(fitting[0])
