"""Prices of a quote, against hand calculations."""

from __future__ import annotations

import math

import pytest

from leafcut.model.quote import PartCost, RunCost, cost_of_time, quote_lines, round_up_to_cents


def run_of(time_s: float, cost: float, *parts: PartCost) -> RunCost:
    return RunCost(time_s, cost, parts, "steel", 6.0, 10.0)


def test_the_example_of_the_page_on_quotes() -> None:
    """Half an hour at 80 and a plate of 40, four parts, five plates, a set-up of 25, 20 % markup: 25.50 each."""
    cost = cost_of_time(80.0, 1800.0) + 40.0
    assert cost == 80.0
    (line,) = quote_lines(run_of(1800.0, cost, PartCost("a", 4, 450.0, 20.0, 1.0)), 5, 25.0, 20.0)
    assert (line.quantity, line.time_s, line.price, line.total) == (20, 450.0, 25.5, 510.0)


def test_moves_outside_the_parts_and_the_set_up_are_shared_by_cost_and_time_by_time() -> None:
    """Parts: 2 · 30 + 1 · 40 = 100 of 110 per sheet. Set-up: 100 on 10 sheets. So a part costs 1.2 of its own."""
    parts = PartCost("a", 2, 20.0, 30.0, 1.0), PartCost("b", 1, 40.0, 40.0, 2.0)
    first, second = quote_lines(run_of(100.0, 110.0, *parts), 10, 100.0, 0.0)
    assert (first.price, first.quantity, first.total) == (36.0, 20, 720.0)
    assert (second.price, second.quantity, second.total) == (48.0, 10, 480.0)
    assert first.total + second.total == 10 * 110.0 + 100.0
    assert (first.time_s, second.time_s) == (25.0, 50.0)
    assert 2 * first.time_s + second.time_s == 100.0


def test_prices_are_never_below_the_cost_and_exceed_it_by_less_than_a_hundredth() -> None:
    parts = [PartCost(str(k), k, 0.37 * k + 0.1, 0.0137 * k, 1.0) for k in range(1, 30)]
    cost = math.fsum(part.per_run * part.cost for part in parts) + 0.777
    lines = quote_lines(run_of(1000.0, cost, *parts), 7, 3.33, 12.5)
    least = (7 * cost + 3.33) * 1.125
    total = math.fsum(line.total for line in lines)
    assert least - 1e-6 <= total < least + 0.01 * sum(line.quantity for line in lines)


@pytest.mark.parametrize("cost, price", [(12.3, 12.3), (1.1 + 2.2, 3.3), (0.001, 0.01), (0.0, 0.0), (2.341, 2.35)])
def test_a_whole_hundredth_stays_and_others_are_rounded_up(cost: float, price: float) -> None:
    assert round_up_to_cents(cost) == price


def test_without_costs_the_set_up_is_shared_by_time() -> None:
    parts = PartCost("a", 1, 10.0, 0.0, 1.0), PartCost("b", 1, 30.0, 0.0, 1.0)
    assert [line.price for line in quote_lines(run_of(40.0, 0.0, *parts), 2, 80.0, 0.0)] == [10.0, 30.0]
