"""Precedence in programs with many tasks: nothing is lost if only connected tasks are compared."""

from __future__ import annotations

import random

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.processes.program.plan import precedence
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.proof.order_thresholds import KEEP
from leafcut.processes.program.proof.outlines import Line, joined_outlines
from rewriting import program_of


def implied(pairs: set[tuple[int, int]], n: int) -> set[tuple[int, int]]:
    """Return the pairs that follow from other pairs."""
    reach = np.zeros((n, n), dtype=bool)
    for one, other in pairs:
        reach[one, other] = True
    for k in range(n):
        reach |= reach[:, k : k + 1] & reach[k : k + 1]
    return {(a, b) for a, b in pairs if (reach[a] & reach[:, b]).any()}


@pytest.mark.parametrize("at_once", [1, 5, 8192])
@pytest.mark.parametrize("seed", range(15))
def test_left_out_are_those_pairs_that_others_imply(seed: int, at_once: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(precedence, "_BITS", at_once)
    rng = random.Random(seed)
    n = rng.randint(2, 30)
    pairs = {tuple(sorted(rng.sample(range(n), 2))) for _ in range(rng.randint(0, 80))}
    kept = precedence._transitive_reduction(np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2), n)
    assert len(kept) == len(pairs - implied(pairs, n))
    assert {(a, b) for a, b in kept.tolist()} == pairs - implied(pairs, n)


def square(x: float, y: float, first: int) -> list[Line]:
    """Return a square in four lines with tabs at its corners, made by four pieces."""
    lines = [[(1, 0), (9, 0)], [(10, 1), (10, 9)], [(9, 10), (1, 10)], [(0, 9), (0, 1)]]
    return [Line(first + k, np.add(line, (x, y), dtype=float)) for k, line in enumerate(lines)]


def test_outlines_that_share_nothing_are_found_as_each_by_itself() -> None:
    squares = [square(100.0 * k, 7.0 * k, 4 * k) for k in range(6)]
    mixed = [line for lines in zip(*squares, strict=True) for line in lines]
    alone = [found for lines in squares for found in joined_outlines(lines, 3.0, KEEP)]
    together = list(joined_outlines(mixed, 3.0, KEEP))
    assert [(found.area.wkb, found.owners) for found in together] == [(found.area.wkb, found.owners) for found in alone]
    assert len(alone) == 6


def strokes(n: int) -> Program:
    rng = random.Random(n)
    lines = [f"G0 X{rng.uniform(0, 30):.2f} Y{rng.uniform(0, 30):.2f} / M3 / G1 X{k % 30} / M5" for k in range(n)]
    return program_of("G21 G90 / F1000 S500 / " + " / ".join(lines) + " / M2")


def test_who_waits_is_looked_at_for_every_piece_of_work_and_may_end_the_search_for_them() -> None:
    looks: list[int] = []
    find_sequence(strokes(50), check_cancelled=lambda: looks.append(1))
    assert len(looks) > 100

    def end() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_sequence(strokes(50), check_cancelled=end)


def test_who_waits_is_looked_at_in_plain_lines_as_well() -> None:
    looks: list[int] = []
    text = "G21 G90\nF1000\nG1 X0 Y0\n" + "X1\nX0\n" * 10_000
    interpret_program(text, load_dialect("linuxcnc"), on_progress=lambda *_: looks.append(1))
    assert len(looks) >= 5
