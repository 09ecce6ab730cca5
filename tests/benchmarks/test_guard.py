"""The guard reports worse results, and only worse results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import guard, page

KEY, OTHER = ("board", "10 iterations"), ("pocket", "whole path")
FIGURES = {KEY: guard.Figure(100.0, 0.01, 10, 5.0), OTHER: guard.Figure(40.0, None, 0, 2.0)}


def test_the_guard_compares_with_the_written_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures = dict(FIGURES)
    monkeypatch.setattr(page, "RESULTS", tmp_path)
    monkeypatch.setattr(guard, "results", lambda: iter(figures.items()))
    assert guard.main([]) == 0, "no record to compare with"
    assert guard.main(["--write"]) == 0
    assert guard.main([]) == 0
    figures[KEY] = replace(figures[KEY], seconds=100.1)
    assert guard.main([]) == 1


def test_the_record_of_the_release_can_be_compared() -> None:
    figures = guard.figures_of((page.RESULTS / "guard.md").read_text(encoding="utf-8"))
    jobs = [(name, guard.words_of(budget)) for name, (_, _, budgets) in guard.JOBS.items() for budget in budgets]
    assert list(figures) == jobs
    assert guard.worse(figures, figures) == []


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"seconds": 100.01}, "board, 10 iterations: machine time 100.01 s, before 100 s"),
        ({"gap": 0.0101}, "board, 10 iterations: gap 1.01 %, before 1 %"),
        ({"gap": None}, "board, 10 iterations: no gap, before 1 %"),
        ({"loops": 8.0}, "board, 10 iterations: processor time 8 loops, before 5"),
    ],
)
def test_a_worse_figure_has_a_line(changed: dict[str, float | None], line: str) -> None:
    assert guard.worse(FIGURES, {**FIGURES, KEY: replace(FIGURES[KEY], **changed)}) == [line]


def test_better_and_slightly_slower_figures_have_no_line_and_a_missing_job_has_one() -> None:
    after = {**FIGURES, KEY: guard.Figure(99.0, 0.009, 10, 6.0), ("new", "job"): FIGURES[KEY]}
    assert guard.worse(FIGURES, after) == []
    assert guard.worse(after, FIGURES)[-1] == "new, job: the job is missing"
