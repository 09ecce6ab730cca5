"""A short slice of the mutants: none that LinuxCNC's interpreter prints otherwise is called the same work."""

from __future__ import annotations

from benchmarked import benchmark

mutants = benchmark("verify_mutants")


def test_no_mutant_is_called_the_same_that_rs274_tells_apart(rs274: str) -> None:
    found = mutants.judge_all(80, 5, rs274, every=5)
    assert found.missed == []
    assert found.unequal == []
    assert found.alarms == []
    assert found.became["seen"] > 40 and found.became["same"] > 3


def test_the_judge_tells_other_work_apart_and_another_order_not(rs274: str) -> None:
    judge = mutants.Judge(rs274)
    holes = [f"G0 X{x} Y0\nG0 Z2\nG1 Z-1 F100\nG0 Z20\n" for x in (1, 9)]
    head, end = mutants.HEAD, mutants.END
    text = head + holes[0] + holes[1] + end
    prints = judge.prints(text)
    assert not mutants.differ(prints, judge.prints(head + holes[1] + holes[0] + end))
    for old, new in (("Z-1", "Z-1.1"), ("G0 Z20\n", "G0 Z3\n"), ("F100", "F101"), ("S900", "S901"), ("X9", "X9.01")):
        assert mutants.differ(prints, judge.prints(text.replace(old, new)))
    assert judge.prints("G1 X5\nM2\n") is None
    judge.close()
