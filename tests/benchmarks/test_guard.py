"""The guard of what a fixed amount of work finds tells what is worse, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarked import benchmark

KEY, OTHER = ("board", "10 iterations"), ("pocket", "all of it")


@pytest.fixture
def guard(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the guard, whose jobs find what `found` of it says."""
    module = benchmark("guard")
    figures = {KEY: module.Figure(100.0, 0.01, 10, 5.0), OTHER: module.Figure(40.0, None, 0, 2.0)}
    monkeypatch.setattr(module, "found", lambda: iter(figures.items()))
    module.figures = figures
    return module


def test_a_worse_record_is_found_and_an_equal_one_is_not(guard: Any, tmp_path: Path) -> None:
    words = ["--history", str(tmp_path / "history.jsonl")]
    assert guard.main(words) == 0, "nothing is kept to compare with"
    assert guard.main([*words, "--keep"]) == 0
    assert guard.main(words) == 0
    guard.figures[KEY] = replace(guard.figures[KEY], seconds=100.1)
    assert guard.main(words) == 1


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"seconds": 100.01}, "board, 10 iterations: 100.01 s of the machine, before 100 s"),
        ({"gap": 0.0101}, "board, 10 iterations: a gap of 1.01 %, before 1 %"),
        ({"gap": None}, "board, 10 iterations: no gap, before 1 %"),
        ({"loops": 8.0}, "board, 10 iterations: processor time of 8 loops, before 5"),
    ],
)
def test_what_is_worse_is_told_in_words(guard: Any, changed: dict[str, float | None], said: str) -> None:
    other = {**guard.figures, KEY: replace(guard.figures[KEY], **changed)}
    assert guard.worse(guard.figures, other) == [said]


def test_what_is_better_or_a_little_slower_is_not_told(guard: Any) -> None:
    other = {**guard.figures, KEY: guard.Figure(99.0, 0.009, 10, 6.0), ("new", "job"): guard.figures[KEY]}
    assert guard.worse(guard.figures, other) == []
    assert guard.worse(other, guard.figures)[-1] == "new, job: not done any more"


def test_what_is_kept_can_be_drawn(guard: Any, tmp_path: Path) -> None:
    words = ["--history", str(tmp_path / "history.jsonl"), "--draw", str(tmp_path / "guard.svg")]
    assert guard.main(words) == 2, "nothing to draw yet"
    guard.main([*words[:2], "--keep"])
    assert guard.main(words) == 0
    assert "<svg" in (tmp_path / "guard.svg").read_text()


def test_a_picture_of_a_kind_that_is_not_offered_is_refused(
    guard: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--history", str(tmp_path / "history.jsonl")]
    guard.main([*words, "--keep"])
    with pytest.raises(SystemExit):
        guard.main([*words, "--draw", str(tmp_path / "guard.txt")])
    assert "guard.txt is neither .svg nor .png" in capsys.readouterr().err
