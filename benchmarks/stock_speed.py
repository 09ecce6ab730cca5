"""How long the stock model takes for 100,000 short cuts, by the shape of the tool and the number of threads.

    python benchmarks/stock_speed.py --write docs/benchmarks.md

A path that winds over 100 × 100 mm and goes up and down, in pieces of 0.5 mm, with a tool of 6 mm and cells of 0.1 mm.
The answer with two threads must be the one with one, cell by cell, and what the cuts take off must be what is gone.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np
from page import facts, table, write_section

from leafcut.model.cutter import ball_mill, bull_mill, flat_mill, pointed
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.stock.cutting import cut
from leafcut.stock.height_field import HeightField, StockBlock
from leafcut.stock.straight_moves import StraightMoves, straight_moves

SEGMENTS, SIDE, CELL = 100_000, 100.0, 0.1
CUTTERS = {
    "flat": flat_mill(6.0), "ball": ball_mill(6.0), "bull nose, 1 mm": bull_mill(6.0, 1.0),
    "V-bit, 90°": pointed(6.0, np.pi / 2),
}  # fmt: skip


def winding(segments: int) -> StraightMoves:
    """Return a path of so many cuts over a square."""
    angle = np.cumsum(np.random.default_rng(1).normal(0, 0.05, segments))
    xy = np.cumsum(np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle)]), axis=0)
    xy = SIDE - np.abs(xy % (2 * SIDE) - SIDE)
    z = -3.0 + 2.0 * np.sin(np.arange(segments) / 500.0)
    builder = ToolpathBuilder()
    builder.rapid(*xy[0].tolist(), 5.0)
    for (x, y), depth in zip(xy.tolist(), z.tolist(), strict=True):
        builder.feed(x, y, depth, feed=10.0)
    return straight_moves(builder.build(), 0.05 * CELL, np.inf)


def main() -> None:
    """Run all shapes and print the table; write it into the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--segments", type=int, default=SEGMENTS)
    parser.add_argument("--write", type=Path, help="page whose section is to be renewed")
    arguments = parser.parse_args()
    moves = winding(arguments.segments)
    block = StockBlock((0.0, 0.0, -10.0), (SIDE, SIDE, 0.0))
    cut(HeightField.of_block(block, 1.0), moves, {0: CUTTERS["flat"]})  # compiled now
    rows = []
    for name, cutter in CUTTERS.items():
        fields, spent = [], []
        for threads in (1, 2):
            field = HeightField.of_block(block, CELL)
            began = time.perf_counter(), time.process_time()
            removed = cut(field, moves, {0: cutter}, threads)
            spent.append((time.perf_counter() - began[0], time.process_time() - began[1]))
            fields.append(field)
        assert np.array_equal(fields[0].heights, fields[1].heights), name
        gone = block.high[2] * SIDE**2 - (fields[0].volume - 10.0 * SIDE**2)
        assert abs(removed.volume.sum() - gone) < 1e-3 * gone, name
        (one, work), (two, _) = spent
        rows.append([name, f"{one:.2f}", f"{two:.2f}", f"{one / two:.2f}", f"{work:.2f}", f"{gone:,.0f}"])
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Cutting stock

{arguments.segments:,} cuts of 0.5 mm over {SIDE:g} × {SIDE:g} mm that go up and down, a tool of 6 mm, cells of
{CELL:g} mm: seconds by the clock with one and with two threads, and their ratio; processor seconds; what is taken off,
mm³. The heights are the same with any number of threads.

{facts("stock_speed", sys.argv[1:], ["leafcut", "numpy", "numba"])}
* Threads at hand: {os.cpu_count()}

{table(["shape", "one thread, s", "two, s", "ratio", "processor, s", "mm³"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "stock_speed", text)


if __name__ == "__main__":
    main()
