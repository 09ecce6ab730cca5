"""What a second thread is worth: leafcut on one thread and on several, in the same time by the clock.

    python benchmarks/threads.py pcb3038 rl5915 rl11849 --times 2 --seeds 7 --threads 2 --write docs/benchmarks.md

One thread and several take turns, seed by seed, so that what else the machine does falls on both.
"""

from __future__ import annotations

import statistics
import sys

import boards
from page import facts, table, write_section
from tsplib import gap_words, parser, run_leafcut, warm_up

from leafcut.options import SolveOptions

#: Boards measured unless others are named.
USUAL = ["pcb442", "pcb3038", "rl5915", "rl11849", "pla85900"]


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = parser((__doc__ or "").splitlines()[0], "2", 7)
    made.set_defaults(boards=USUAL, threads=2)
    arguments = made.parse_args()
    rows = []
    for name in arguments.boards:
        board = boards.load(name)
        warm_up(board, SolveOptions(threads=arguments.threads))
        for t in arguments.times:
            lengths: dict[int, list[float]] = {1: [], arguments.threads: []}
            for seed in range(1, arguments.seeds + 1):
                for threads, found in lengths.items():
                    run = run_leafcut(board, SolveOptions(seed=seed, time_limit=t, threads=threads))
                    found.append(run.length_at(t))
            one, several = (statistics.median(found) for found in lengths.values())
            better = sum(b < a for a, b in zip(*lengths.values(), strict=True))
            words = [gap_words(board, found) for found in lengths.values()]
            shares = [f"{several / one:.5f}", f"{better} of {arguments.seeds}"]
            rows.append([board.name, f"{t:g}", *words, *shares])
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Several threads

Gap in percent after the same time by the clock, median of {arguments.seeds} seeds (lowest to highest), on one thread
and on {arguments.threads}, taking turns; the ratio of the median lengths, and in how many seeds several threads found
the shorter tour.

{facts("threads", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["board", "seconds", "one thread", f"{arguments.threads} threads", "ratio", "shorter"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "threads", text)


if __name__ == "__main__":
    main()
