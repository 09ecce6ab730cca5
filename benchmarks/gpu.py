"""What a GPU brings the ants: the tours of an iteration built on it, beside all threads of the CPU.

    python benchmarks/gpu.py --write docs/colony.md

Maps of 1,000 to 20,000 places, as many ants as places up to 1,000, no local search. Both must find tours of the same
cost, but for the last digit of a rounding. Each runs three times in turn; the median of the seconds of an iteration
counts, without those of compiling. Without a GPU it says so and writes nothing.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from statistics import median

from page import facts, table, write_section

from leafcut import api
from leafcut.errors import SolveError
from leafcut.solve.gpu_ants import check_gpu

SIZES, ANTS, ITERATIONS, ROUNDS = (1000, 5000, 20_000), 1000, 5, 3
#: Costs may differ by so much: a GPU joins a product and a sum in one rounding.
SAME = 1e-3


def seconds(n: int, device: str) -> tuple[float, float]:
    """Return the seconds of an iteration, and the cost of the best tour."""
    given = {"algorithm": "mmas", "n_ants": ANTS, "local_search": False, "bound": False, "device": device}
    api.solve_file(f"random:{n}", iterations=1, **given)  # compiles, and fills what is kept
    times = []
    for iterations in (1, 1 + ITERATIONS):
        began = time.perf_counter()
        solved = api.solve_file(f"random:{n}", iterations=iterations, **given)
        times.append(time.perf_counter() - began)
    return (times[1] - times[0]) / ITERATIONS, solved.solution.cost


def main() -> None:
    """Measure and print; write into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    asked = made.parse_args()
    try:
        check_gpu()
    except SolveError as problem:
        raise SystemExit(str(problem)) from None
    rows = []
    for n in SIZES:
        found: dict[str, list[tuple[float, float]]] = {"cpu": [], "gpu": []}
        for _ in range(ROUNDS):
            for device, runs in found.items():
                runs.append(seconds(n, device))
        costs = [runs[0][1] for runs in found.values()]
        assert abs(costs[1] / costs[0] - 1.0) < SAME, f"{n}: tours of {costs}"
        cpu, gpu = (median(run[0] for run in runs) for runs in found.values())
        rows.append([f"{n:,}", f"{cpu:.3f}", f"{gpu:.3f}", f"{cpu / gpu:.1f}"])
    head = ["places", "CPU, all threads, s", "GPU, s", "CPU by GPU"]
    lines = [
        f"Seconds of an iteration of MMAS with {ANTS:,} ants.",
        "",
        table(head, rows),
        "",
        facts("gpu", [], ("leafcut", "numpy", "numba", "numba-cuda")),
    ]
    print("\n".join(lines))
    if asked.write:
        write_section(asked.write, "gpu", "\n".join(lines))


if __name__ == "__main__":
    main()
