"""Short runs of the mutants: every mutant is detected, and the reference recognises different work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from benchmarks.verify_mutants import END, HEAD, Judge, differ

from benchmarks import stock_mutants, verify_mutants


@pytest.mark.parametrize(
    ("judge", "least"),
    [
        (stock_mutants.differ, stock_mutants.LEAST_PLACE),
        (stock_mutants.reordered, stock_mutants.LEAST_REORDERED),
    ],
)
def test_the_stock_model_misses_no_mutant_and_raises_no_false_alarm(
    judge: Callable[[Path, Path], bool], least: float
) -> None:
    counts, wrong = stock_mutants.run(15, 7, judge, least)
    assert wrong == []
    assert min(counts["seen"], counts["the same"]) > 3


def test_the_proof_misses_no_mutant_and_raises_no_false_alarm(rs274: str) -> None:
    found = verify_mutants.judge_all(80, 5, rs274, every=5)
    assert found.missed == []
    assert found.unequal == []
    assert found.alarms == []
    assert found.became["seen"] > 40 and found.became["same"] > 3


def test_a_mutant_differs_from_its_program_in_one_place() -> None:
    for mutant in verify_mutants.mutants(40, 5):
        assert mutant.new != mutant.original
        assert abs(mutant.new.count("\n") - mutant.original.count("\n")) <= 1


def test_the_reference_sees_other_work_and_accepts_another_order(rs274: str) -> None:
    judge = Judge(rs274)
    holes = [f"G0 X{x} Y0\nG0 Z2\nG1 Z-1 F100\nG0 Z20\n" for x in (1, 9)]
    text = HEAD + holes[0] + holes[1] + END
    before = judge.prints(text)
    assert before is not None
    reordered = judge.prints(HEAD + holes[1] + holes[0] + END)
    assert reordered is not None and not differ(before, reordered)
    for old, new in (("Z-1", "Z-1.1"), ("G0 Z20\n", "G0 Z3\n"), ("F100", "F101"), ("S900", "S901"), ("X9", "X9.01")):
        after = judge.prints(text.replace(old, new))
        assert after is not None and differ(before, after)
    assert judge.prints("G1 X5\nM2\n") is None
    judge.close()
