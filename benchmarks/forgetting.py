"""What forgetting earns where nodes are in sets: kicks alone, and kicks and forgetting by turns.

    python benchmarks/forgetting.py --time 3 --seeds 3 --write docs/colony.md

Both use the same candidates, exchanges and kernels, and the same seconds of the processor; without, no problem counts
as small enough for forgetting (`solve.annealing`). Tours are judged as in `benchmarks/gtsp.py`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import mean
from unittest.mock import patch

from gtsp import known, measure
from page import facts, table, write_section

from leafcut.solve import sequential

#: Instances measured unless others are named: a sheet, precedence of many kinds, and none.
USUAL = ["e5x_1", "ESC47", "ry48p.1", "ft70.1", "rbg109a", "115rat575"]


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("instances", nargs="*", default=USUAL, help="names of instances")
    made.add_argument("--time", type=float, default=3.0, help="seconds of the processor")
    made.add_argument("--seeds", type=int, default=3, help="runs of each, with the seeds 1, 2, …")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    options = made.parse_args()
    options.algorithm = "auto"
    instances, rows = known(), []
    for name in options.instances:
        by_turns, _ = measure(instances[name], options)
        with patch.object(sequential, "is_small", lambda _: False):
            alone, _ = measure(instances[name], options)
        rows.append([name, instances[name].sizes[-1], f"{mean(alone):.2f}", f"{mean(by_turns):.2f}"])
        print(" ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""What forgetting earns: gap to the best known in percent, mean of {options.seeds} seeds, after
{options.time:g} s of the processor; below 0 is better.

{table(["instance", "pairs", "kicks alone", "kicks and forgetting by turns"], rows)}

{facts("forgetting", sys.argv[1:], ["leafcut", "numpy", "numba"])}"""
    print(text)
    if options.write:
        write_section(options.write, "forgetting", text)


if __name__ == "__main__":
    main()
