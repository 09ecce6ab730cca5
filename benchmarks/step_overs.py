"""Every strategy on seven pockets at step-overs from a tenth of the tool to nine: none leaves its passes further apart.

    python benchmarks/step_overs.py --write docs/benchmarks.md

The pockets lie in the data folder (`pockets`); the tool is 10 mm wide. How far passes are apart, what is cut beyond the
walls and what stays uncut is told by `stock.removal`, which knows nothing of how a path was planned. A strategy may
refuse a step-over (a grid needs points half a tool apart at least); it may not exceed it.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import replace
from pathlib import Path

from page import facts, table, write_section
from pockets import RULES, folder, pocket_of

from leafcut.errors import LeafcutError
from leafcut.processes.course import Run, machine_of
from leafcut.processes.pocket.measures import measure_path
from leafcut.processes.pocket.plan.arcs import fitted
from leafcut.processes.pocket.plan.region import centre_regions
from leafcut.processes.pocket.plan.rules import USUAL_POINTS
from leafcut.processes.pocket.strategies import WAYS, ClearingWay
from leafcut.processes.settings import collect

#: Shares of the tool's diameter.
SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
#: Rounding, mm: what the proof of a program allows.
ROUNDING = 0.005
REFUSED = "–"


def measured(name: str, way: ClearingWay, share: float) -> tuple[float, float] | None:
    """Return the largest step-over, mm, and what stays uncut, percent, of a pocket; None where the way is refused.

    Raises
    ------
    AssertionError
        It exceeds what was asked for, or cuts beyond the walls.
    """
    d = RULES.tool_diameter
    rules = replace(RULES, step_over=share * d, pitch=min(share, USUAL_POINTS) * d)
    if way.name == "adaptive":
        # Of a straight cut as wide as the step-over.
        rules = replace(rules, max_engagement=math.acos(1.0 - 2.0 * share))
    pocket, settings = pocket_of(name), collect({"tool_diameter": d})
    run = Run(settings, machine_of(settings))
    try:
        (region,) = centre_regions(pocket, rules)[0]
        path = fitted(way.path(region, run), rules.tolerance)
    except LeafcutError:
        return None
    found = measure_path(pocket, path, rules, run.machine)
    if found.max_step_over > rules.step_over + ROUNDING or found.gouge_mm2:
        raise AssertionError(
            f"{name}, {way.name}, {share:g}: passes {found.max_step_over:.3f} mm apart where {rules.step_over:g} were "
            f"asked for, {found.gouge_mm2:g} mm² beyond the walls"
        )
    return found.max_step_over, found.uncovered_percent


def main() -> None:
    """Measure and print the table; write it into the page where asked; status 1 where a figure is wrong."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("pockets", nargs="*", default=sorted(file.stem for file in folder().glob("*.wkt")))
    made.add_argument("--step-overs", nargs="*", type=float, default=SHARES, help="shares of the diameter")
    made.add_argument("--strategies", nargs="*", default=[way.name for way in WAYS], help="only these")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    rows, wrong = [], []
    for way in (way for way in WAYS if way.name in arguments.strategies):
        cells, uncut = [], 0.0
        for share in arguments.step_overs:
            most, refused, began = 0.0, 0, time.process_time()
            for name in arguments.pockets:
                try:
                    found = measured(name, way, share)
                except AssertionError as problem:
                    wrong.append(str(problem))
                    print(problem, file=sys.stderr, flush=True)
                    continue
                refused += found is None
                most, uncut = (most, uncut) if found is None else (max(most, found[0]), max(uncut, found[1]))
            said = (
                REFUSED if refused == len(arguments.pockets) else f"{most:.2f}" + (f" ({refused})" if refused else "")
            )
            cells.append(said)
            print(f"{way.name} {share:g}: {said}, {time.process_time() - began:.1f} s", file=sys.stderr, flush=True)
        rows.append([way.name, *cells, f"{uncut:.3f}"])
    text = f"""## Step-overs

The largest distance between neighbouring passes, mm, over the pockets `{" ".join(arguments.pockets)}`, by the step-over
that was asked for (a flat end mill of 10 mm; *adaptive* engages no more than a straight cut of the step-over does). In
brackets: on so many of them the strategy refuses the step-over; a dash: on all of them. The last column is the most
that stays uncut of what the tool can reach, percent, in the plane and before the passes that a run adds where something
stays.

{facts("step_overs", sys.argv[1:], ["leafcut", "numpy", "shapely"])}

{table(["work", *(f"{10.0 * share:g} mm" for share in arguments.step_overs), "uncut %"], rows)}"""
    print(text)
    if arguments.write and not wrong:
        write_section(arguments.write, "step-overs", text)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
