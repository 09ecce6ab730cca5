"""A folded test runs all its cases, and fails with each of those that are wrong."""

from __future__ import annotations

import inspect

import pytest

from every import Faults, every


def test_all_cases_run_and_every_fault_is_told_by_its_case() -> None:
    ran: list[tuple[int, str]] = []

    @every("n", [1, 2, 3])
    @every("word", ["a", "b"])
    def rule(n: int, word: str, given: str) -> None:
        ran.append((n, word))
        assert given == "fixture"
        if n == 2:
            raise ValueError("two")
        if (n, word) == (3, "b"):
            pytest.fail("three")

    assert list(inspect.signature(rule).parameters) == ["given"]
    with pytest.raises(Faults) as told:
        rule(given="fixture")
    assert ran == [(n, word) for n in (1, 2, 3) for word in "ab"]
    assert str(told.value).splitlines() == [
        "3 of the cases:",
        "[2-a] ValueError: two",
        "[2-b] ValueError: two",
        "[3-b] Failed: three",
    ]


def test_a_rule_that_holds_for_all_cases_passes_and_of_no_case_it_is_told() -> None:
    every("a, b", [(1, 1), (2, 2)])(lambda a, b: None)()
    with pytest.raises(pytest.skip.Exception, match="no cases"):
        every("a", [])(lambda a: None)()
