"""How fast foreign programs are read: lines a second of processor time, and bytes kept, by kind of line.

    python benchmarks/interpret.py --lines 200000 --write docs/benchmarks.md

The programs are made up, so that the number of motions that must come out is known; it is checked.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from page import facts, table, write_section

from leafcut.gcode.dialects import dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import MOTIONS

HEAD = "G21 G90 G17\nG0 X0 Y0 Z5\nF600\n"
#: Rows of the head that move.
IN_HEAD = 1


def cuts(chance: random.Random, lines: int) -> Iterator[str]:
    """Yield straight cuts, rapids and half circles, modal words left out, as most CAMs write them."""
    for k in range(lines):
        x, y, r = chance.uniform(0, 300), chance.uniform(0, 300), chance.uniform(1, 20)
        match k % 5:
            case 0:
                yield f"G1X{x:.3f}Y{y:.3f}"
            case 1:
                yield f"X{x:.3f}F{chance.choice((600, 800))}"
            case 2:
                yield f"N{k} G01 Y{y:.4f} Z{-r:.4f}"
            case 3:
                yield "G0 X5. Y5. Z5."
            case _:
                yield f"G2 X{5 + 2 * r:.4f} I{r:.4f} J0"


def holes(chance: random.Random, lines: int) -> Iterator[str]:
    """Yield holes of one canned cycle."""
    yield "G99 G81 X1 Y1 Z-2 R1"
    for _ in range(lines - 1):
        yield f"X{chance.uniform(0, 300):.3f} Y{chance.uniform(0, 300):.3f}"


def remarks(chance: random.Random, lines: int) -> Iterator[str]:
    """Yield cuts with a remark each."""
    for k in range(lines):
        yield f"G1 X{chance.uniform(0, 300):.3f} (cut {k})"


def loop(_: random.Random, lines: int) -> Iterator[str]:
    """Yield a loop that comes to as many cuts."""
    yield from ("#1=0", f"o1 repeat [{lines}]", "#1=[#1+0.1]", "G1 X[#1 MOD 100] Y#1", "o1 endrepeat")


KINDS: dict[str, tuple[Callable[[random.Random, int], Iterator[str]], int]] = {
    "cuts, rapids and arcs": (cuts, 1),
    "holes of a canned cycle": (holes, 1),
    "cuts with a remark each": (remarks, 1),
    "a loop with expressions": (loop, 4),
}


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("--lines", type=int, default=200_000, help="motions of every program (default: %(default)s)")
    made.add_argument("--runs", type=int, default=5, help="runs of each, of which the median counts")
    made.add_argument("--write", type=Path, help="write the table into this page")
    arguments = made.parse_args()
    rows = []
    for name, (kind, share) in KINDS.items():
        lines = max(arguments.lines // share, 2)
        text = HEAD + "\n".join(kind(random.Random(1), lines)) + "\nM2\n"
        seconds = statistics.median(_seconds(text, lines) for _ in range(arguments.runs))
        tracemalloc.start()
        program = interpret_program(text, dialect("linuxcnc"))
        kept, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        figures = (program.n_blocks / seconds, kept / program.n_blocks, most / program.n_blocks)
        rows.append([name, f"{program.n_blocks:,}", *(f"{figure:,.0f}" for figure in figures)])
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Reading programs

Blocks read in a second of processor time, median of {arguments.runs} runs, and bytes a block that the answer keeps
(its text included) and that reading it takes at most.

{facts("interpret", sys.argv[1:], ["leafcut", "numpy"])}

{table(["program", "blocks", "blocks a second", "bytes kept", "bytes at most"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "interpret", text)


def _seconds(text: str, motions: int) -> float:
    """Return the processor seconds of one run, whose motions must be as many as the program has."""
    begin = time.process_time()
    program: Program = interpret_program(text, dialect("linuxcnc"))
    seconds = time.process_time() - begin
    found = int(np.isin(program.path.kind, [int(kind) for kind in MOTIONS]).sum()) - IN_HEAD
    if found != motions:
        raise SystemExit(f"{found} motions came out of a program of {motions}")
    return seconds


if __name__ == "__main__":
    main()
