"""The production search is never behind the algorithms of the literature."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from leafcut import api
from leafcut.errors import SolveError
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import ALGORITHM_TITLES, SolveOptions
from leafcut.order import solve as solving

EXAMPLES = Path(__file__).parents[2] / "examples"
LITERATURE = [name for name in ALGORITHM_TITLES if name not in ("auto", "colony", "none")]
solve = solving.solve


def problems_of(drawing: str, process: str, objective: str, monkeypatch: pytest.MonkeyPatch) -> list[RoutingProblem]:
    """Return the problems that `optimize` solves for a drawing."""
    problems: list[RoutingProblem] = []

    def recorded(problem: RoutingProblem, options: SolveOptions, *rest: object, **more: object) -> Solution:
        if options.algorithm == "auto":
            problems.append(problem)
        return solve(problem, replace(options, preset="fast", bound=False), *rest, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(solving, "solve", recorded)
    api.optimize(EXAMPLES / drawing, process=process, objective=objective, thickness="6mm")
    return problems


def costs_of_literature(problem: RoutingProblem) -> Iterator[float]:
    """Yield the cost of each algorithm that can keep the precedences of a problem."""
    for name in LITERATURE:
        try:
            yield solve(problem, SolveOptions(algorithm=name, preset="fast", threads=1, bound=False)).cost
        except SolveError:
            continue


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drawing", "process", "objective"),
    [("sheet.dxf", "cut", "distance"), ("board_97.dxf", "cut", "distance"), ("plate_27.dxf", "drill", "time")],
)
def test_no_algorithm_of_the_literature_finds_a_shorter_path_in_about_the_same_time(
    drawing: str, process: str, objective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The default preset of `auto` takes about as long as the preset `fast` of the others."""
    for problem in problems_of(drawing, process, objective, monkeypatch):
        cost = solve(problem, SolveOptions(algorithm="auto", preset="default", threads=1, bound=False)).cost
        others = list(costs_of_literature(problem))
        assert len(others) >= 5
        assert cost <= min(others) * (1.0 + 1e-9)
