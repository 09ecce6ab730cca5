"""The production search is never behind the algorithms that it grew out of."""

from __future__ import annotations

import pytest

from benchmarked import benchmark

students = benchmark("students")


@pytest.mark.parametrize(
    "name, process, objective",
    [("sheet.dxf", "cut", "distance"), ("board_97.dxf", "cut", "distance"), ("plate_27.dxf", "drill", "time")],
)
def test_no_algorithm_of_the_literature_finds_a_shorter_path_in_about_the_same_time(
    name: str, process: str, objective: str
) -> None:
    for problem in students.problems_of(students.EXAMPLES / name, process, objective):
        (first, cost, _), *rest = students.costs(problem)
        assert first == "auto"
        assert len(rest) >= 5
        assert cost <= min(other for _, other, _ in rest) * (1.0 + students.ROUNDING)
