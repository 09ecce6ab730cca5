"""Many short strokes that lie densely and cross: the proof finds outlines among them, within little memory."""

from __future__ import annotations

import math
import random

import pytest

from leafcut.gcode.program import Program
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of


def strokes(n: int, seed: int, outlines: int = 0) -> list[str]:
    """Return n strokes of 1.4 mm, two on every three square millimetres, and squares in four parts with tabs."""
    rng, side = random.Random(seed), math.sqrt(1.5 * n)
    cuts = []
    for _ in range(n):
        x, y, way = rng.uniform(0, side), rng.uniform(0, side), rng.uniform(0, math.tau)
        cuts.append([(x, y), (x + 1.4 * math.cos(way), y + 1.4 * math.sin(way))])
    for _ in range(outlines):
        x, y, a, g = rng.uniform(0, side), rng.uniform(0, side), rng.uniform(2, 0.5 * side), 0.2
        for u, v, p, q in ((g, 0, a, 0), (a, g, a, a), (a - g, a, 0, a), (0, a - g, 0, 0)):
            cuts.append([(x + u, y + v), (x + p, y + q)])
    rng.shuffle(cuts)
    return [f"G0 X{a:.3f} Y{b:.3f} / M3 / G1 X{c:.3f} Y{d:.3f} / M5" for (a, b), (c, d) in cuts]


def program(cuts: list[str]) -> Program:
    return program_of("G21 G90 / F1000 S500 / " + " / ".join(cuts) + " / M2")


def test_outlines_with_tabs_are_found_among_strokes_that_lie_densely_and_cross() -> None:
    sheets = [strokes(40, seed, outlines=5) for seed in range(12)]
    found = [
        certify(program(cuts), program(random.Random(k).sample(cuts, len(cuts)))).differences
        for k, cuts in enumerate(sheets)
    ]
    assert sum(any("outline with tabs" in d.text for d in differences) for differences in found) > 5


@pytest.mark.slow
def test_memory_grows_by_less_than_a_kilobyte_a_line() -> None:
    """What both programs and their proof need at most, by the interpreter's own count; 1.7 kB a line once."""
    import tracemalloc

    contours = [
        f"G0 X{12 * k} Y0\nG0 Z1\nG1 Z-1 F200\n"
        + "".join(f"G1 X{12 * k + 0.3 * j:.1f} Y{5 + j % 3} F800\n" for j in range(20))
        + "G0 Z5\n"
        for k in range(400)
    ]
    head = "G21 G90 G17 G40 G94\nS900 M3\nG0 Z5\n"
    texts = [head + "".join(order) + "M5\nM2\n" for order in (contours, contours[::-1])]
    certify(*(program_of(t, "linuxcnc") for t in (texts[0][:200], texts[0][:200])))  # one-time loading is not counted
    tracemalloc.start()
    found = certify(*(program_of(t, "linuxcnc") for t in texts))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.same
    assert most / texts[0].count("\n") < 1100
