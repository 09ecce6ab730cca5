"""The judge of tours agrees with published optima, and refuses wrong tours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks import boards
from shared_data import tour_nodes


@pytest.mark.parametrize("name", ["kroA100", "pcb442"])
def test_the_judge_agrees_with_published_optima(name: str, data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LEAFCUT_DATA", str(data))
    board, tour = boards.load(name), tour_nodes(data / "tsplib" / f"{name}.opt.tour")
    assert boards.checked_length(board, tour, stated=board.reference) == board.reference
    assert boards.matrix(board, "int64")[tour, np.roll(tour, -1)].sum() == board.reference


def test_the_judge_refuses_missing_and_repeated_nodes_and_wrong_lengths() -> None:
    board = boards.uniform(5)
    length = boards.checked_length(board, [0, 1, 2, 3, 4])
    for tour, stated in (([0, 1, 2, 3], None), ([0, 1, 2, 3, 3], None), ([0, 1, 2, 3, 4], length * 1.000001)):
        with pytest.raises(AssertionError, match="uniform:5: the tour"):
            boards.checked_length(board, tour, stated)


def test_distances_are_rounded_by_the_rules_of_tsplib() -> None:
    """√2 = 1.41 and √8 = 2.83: rounded to the nearest 1 and 3, rounded up 2 and 3."""
    distances = np.sqrt([2.0, 8.0])
    assert boards.rounded("EUC_2D", distances).tolist() == [1.0, 3.0]
    assert boards.rounded("CEIL_2D", distances).tolist() == [2.0, 3.0]
    assert boards.rounded("EUC_2D", np.array([2.5])).tolist() == [3.0]
    with pytest.raises(ValueError, match="GEO"):
        boards.rounded("GEO", distances)
