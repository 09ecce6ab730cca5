"""The production search beside the algorithms of the literature, on every shipped example.

    python benchmarks/students.py                                # every drawing of examples/, drilled and cut
    python benchmarks/students.py sheet.dxf plate_70.dxf --preset default --others default

The rule: in the same time, `auto` finds no path that costs more than any other algorithm's. By its default preset it
takes about as long as the others by the preset `fast`; processor seconds of one thread stand beside the costs. Exit
status 1 where it is behind.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest import mock

from leafcut import api
from leafcut.errors import LeafcutError
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import ALGORITHM_TITLES, SolveOptions

EXAMPLES = Path(__file__).parent.parent / "examples"
#: Costs that differ by less are equal, as a part of them.
ROUNDING = 1e-9
OTHERS = [name for name in ALGORITHM_TITLES if name not in ("auto", "colony", "none")]


def problems_of(source: Path, process: str, objective: str) -> list[RoutingProblem]:
    """Return what `optimize` has its search solve for a drawing, in order."""
    from leafcut.solve import solve as room

    found: list[RoutingProblem] = []
    solve = room.solve

    def recorded(problem: RoutingProblem, options: SolveOptions, *rest: object, **more: object) -> Solution:
        if options.algorithm == "auto":
            found.append(problem)
        return solve(problem, replace(options, preset="fast", bound=False), *rest, **more)  # type: ignore[arg-type]

    with mock.patch.object(room, "solve", recorded):
        api.optimize(source, process=process, objective=objective, thickness="6mm")
    return found


def costs(problem: RoutingProblem, preset: str = "default", others: str = "fast") -> Iterator[tuple[str, float, float]]:
    """Yield what each algorithm that can solve a problem finds: name, cost, processor seconds; `auto` first."""
    from leafcut.solve.solve import solve

    for name in ("auto", *OTHERS):
        began = time.process_time()
        try:
            used = preset if name == "auto" else others
            solution = solve(problem, SolveOptions(algorithm=name, preset=used, threads=1, bound=False))
        except LeafcutError:
            continue  # it cannot keep a precedence
        yield name, solution.cost, time.process_time() - began


def main() -> int:
    """Print a row for every problem; return 1 where the production search is behind."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", help="of examples/ (default: all)")
    parser.add_argument("--preset", default="default", choices=("fast", "default"), help="of auto")
    parser.add_argument("--others", default="fast", choices=("fast", "default"), help="the preset of the others")
    arguments = parser.parse_args()
    names = arguments.names or sorted(p.name for p in EXAMPLES.glob("*.dxf") if p.name != "pocket.dxf")
    behind = 0
    for name in names:
        for process in ("drill", "cut"):
            for objective in ("time", "distance"):
                for problem in problems_of(EXAMPLES / name, process, objective):
                    (_, cost, seconds), *rest = costs(problem, arguments.preset, arguments.others)
                    best, least, its = min(rest, key=lambda row: row[1])
                    late = cost > least * (1.0 + ROUNDING)
                    behind += late
                    print(
                        f"{name:20} {process:6} {objective:9} {problem.n_clusters:4} clusters  auto {cost:10.3f} "
                        f"{seconds:6.2f} s  {best:8} {least:10.3f} {its:6.2f} s  {100 * (cost / least - 1):+.3f} %"
                        + ("  behind" if late else ""),
                        flush=True,
                    )
    print(f"behind in {behind}")
    return int(behind > 0)


if __name__ == "__main__":
    sys.exit(main())
