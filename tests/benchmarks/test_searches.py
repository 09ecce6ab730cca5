"""Gaps over time, and the handling of failed and wrong peers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks import boards, peers, tsplib


def test_a_gap_at_a_time_comes_from_the_best_tour_until_then() -> None:
    run = tsplib.Run(((0.1, 300.0), (0.5, 220.0), (2.0, 210.0)), np.zeros(0, np.int32), 210.0, 2.0, 2.0)
    assert [run.length_at(t) for t in (0.05, 0.1, 0.49, 1.0, 9.0)] == [np.inf, 300.0, 300.0, 220.0, 210.0]
    board = boards.Board("b", np.zeros((3, 2)), "EUC_2D", 200.0, "optimal")
    assert tsplib.gap_words(board, [220.0, 210.0, 200.0]) == "5.000 (0.000 to 10.000)"
    assert tsplib.gap_words(board, [210.0, 210.0, np.inf]) == "5.000 (5.000 to –)"
    assert tsplib.gap_words(board, [np.inf]) == "–"


def test_a_failed_peer_has_a_reason_and_a_wrong_tour_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[object] = []
    pipe = type("Pipe", (), {"send": lambda _, message: sent.append(message)})()

    def peer(answer: object) -> peers.Peer:
        def prepare(*_: object) -> Callable[[], object]:
            if isinstance(answer, Exception):
                raise answer
            return lambda: answer

        return peers.Peer("peer", "", lambda board: "", prepare)

    for answer in (MemoryError(), ([0, 1, 2, 2, 4], None), ([0, 1, 2, 3, 4], 7.0), ([0, 1, 2, 3, 4], None)):
        monkeypatch.setattr(peers, "PEERS", (peer(answer),))
        peers.work(pipe, 0, "uniform:5", peers.Task(1.0, 1, 1))
    failed, _, wrong, _, misstated, _, good = sent
    assert isinstance(failed, peers.Result) and isinstance(good, peers.Result)
    assert (failed.why, peers.cell([failed])) == ("MemoryError", "–")
    assert isinstance(wrong, AssertionError)
    assert isinstance(misstated, AssertionError)
    assert good.why == ""
