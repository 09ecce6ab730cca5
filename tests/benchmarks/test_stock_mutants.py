"""Programs spoilt in one place leave another part, and that is seen; what changes nothing of the part is not."""

from __future__ import annotations

import random

from benchmarked import benchmark

mutants = benchmark("stock_mutants")


def test_no_mutant_is_missed_and_none_is_a_false_alarm() -> None:
    counts, wrong = mutants.run(40, 7)
    assert wrong == []
    assert counts["seen"] > 10
    assert counts["the same"] > 10


def test_the_judge_of_new_orders_misses_none_and_raises_no_false_alarm() -> None:
    counts, wrong = mutants.run(40, 7, mutants.reordered, mutants.LEAST_REORDERED)
    assert wrong == []
    assert min(counts["seen"], counts["the same"]) > 10


def test_a_judge_that_calls_all_the_same_would_be_seen() -> None:
    made = [mutants.mutant(mutants.features(random.Random(seed)), random.Random(seed)) for seed in range(40)]
    assert {part for _, _, part in made} == {True, False}
