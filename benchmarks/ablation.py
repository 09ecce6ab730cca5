"""What earns its time: ants that follow each other's trails, against the same ants alone and against random kicks.

    python benchmarks/ablation.py pcb442 d2103 pcb3038 --times 1,5 --seeds 5 --write docs/benchmarks.md

All three use the same candidate lists, exchanges and kernels, and the same time by the clock:

* colony: ants build tours of their own and then follow each other's trails (what `auto` does),
* ants alone: the same ants build tours until the time is up, and the best tour counts,
* random kicks: one ant's tour, kicked at a random place and mended there, again and again.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from unittest.mock import patch

import boards
from page import facts, table, write_section
from tsplib import gap_words, parser, run_leafcut, warm_up

from leafcut.options import SolveOptions
from leafcut.solve import colony
from leafcut.solve import solve as room

#: Boards measured unless others are named: of several sizes, even and clustered.
USUAL = ["pcb442", "fl1577", "d2103", "pcb3038", "rl5915", "rl11849"]
WAYS = {"colony": "colony", "ants alone": "colony", "random kicks": "kicks"}


@contextmanager
def only(way: str) -> Iterator[None]:
    """Make ants of a colony meet nobody, for `ants alone`."""
    # A warm-up counts generations, and ants that meet nobody live none; all is warm already.
    alone = {"PATIENCE_BY_CLOCK": 0, "SAME_ANSWERS": sys.maxsize, "FEWEST_BY_CLOCK": 0, "FEWEST_KICKING": 0}
    with ExitStack() as changes:
        if way == "ants alone":
            for name, value in alone.items():
                changes.enter_context(patch.object(colony, name, value))
            changes.enter_context(patch.object(room, "warm_up"))
        yield


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = parser((__doc__ or "").splitlines()[0], "1,5", 5)
    made.set_defaults(boards=USUAL)
    arguments = made.parse_args()
    rows = []
    for name in arguments.boards:
        board = boards.load(name)
        for way, algorithm in WAYS.items():
            options = SolveOptions(algorithm=algorithm, threads=arguments.threads)
            warm_up(board, options)
            cells = []
            for t in arguments.times:
                with only(way):
                    runs = [
                        run_leafcut(board, replace(options, seed=seed, time_limit=t))
                        for seed in range(1, arguments.seeds + 1)
                    ]
                cells.append(gap_words(board, [run.length_at(t) for run in runs]))
            rows.append([board.name, way, *cells])
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## What earns its time

Gap in percent, median of {arguments.seeds} seeds (lowest to highest), threads: {arguments.threads}. Colony: ants build
tours of their own and follow each other's trails. Ants alone: the same ants, who meet nobody. Random kicks: one ant's
tour, kicked at random places and mended. All use the same lists, exchanges and kernels.

{facts("ablation", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["board", "solver", *(f"{t:g} s" for t in arguments.times)], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "ablation", text)


if __name__ == "__main__":
    main()
