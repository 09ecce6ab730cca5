"""Seven pockets, every strategy: length, air, retracts, what stays uncut, step-over, engagement, distance to the floor.

    python benchmarks/pockets.py --write docs/benchmarks.md

The pockets and the paths they are compared with lie in the data folder (`pockets`); the tool is 10 mm wide, the
step-over 6 mm. What a path does is told by `stock.removal`, which knows nothing of how it was planned.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import boards
import shapely
from page import facts, table, write_section

from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.processes.course import Run, machine_of
from leafcut.processes.pocket.measures import measure_path
from leafcut.processes.pocket.plan.arcs import fitted
from leafcut.processes.pocket.plan.region import centre_regions
from leafcut.processes.pocket.strategies import WAYS
from leafcut.processes.settings import collect

#: What the lists of baselines were made for.
RULES = PocketRules(tool_diameter=10.0, step_over=6.0)
#: The limit of the strategy that keeps one: half the tool's width in straight cuts.
LIMITED = replace(RULES, max_engagement=0.5 * math.pi)
#: Feed for the machine's time, mm/s.
FEED = 20.0
#: Rows of the list of baselines that stand beside: what shops run, and the honest rival.
RIVALS = ("zigzag_best", "contour_0.6D")
#: Columns of the table.
HEAD = (
    *("instance", "work", "feed mm", "air mm", "lifts", "uncut %", "step-over mm"),
    *("engagement ° (mean)", "over the floor %", "time min", "CPU s"),
)


def folder() -> Path:
    """Return the folder of the pockets."""
    return boards.data_folder().parent / "pockets"


def pocket_of(name: str) -> Pocket:
    """Return a pocket of the data folder."""
    shape = shapely.from_wkt((folder() / f"{name}.wkt").read_text(encoding="utf-8"))
    outline, *islands = (Polyline.of_points(ring.coords, closed=True) for ring in (shape.exterior, *shape.interiors))
    return Pocket(outline, tuple(islands), name=name)


def rivals(name: str) -> list[list[str]]:
    """Return the rows of a pocket's baselines."""
    with (folder() / "baseline.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["pocket"] == name and row["method"].startswith(RIVALS)]
    found = []
    for row in rows:
        feed, air, floor = (float(row[k]) for k in ("feed_total_mm", "rapid_xy_mm", "bound_area_over_stepover_mm"))
        over = f"{100.0 * ((feed + air) / floor - 1.0):.1f}"
        uncut = f"{float(row['uncovered_pct']):.3f}"
        known = [f"*{row['method']}*", f"{feed:.0f}", f"{air:.0f}", row["retracts"], uncut]
        found.append([name, *known, "", "", over, "", ""])
    return found


def ours(name: str, only: list[str]) -> list[list[str]]:
    """Return the rows of leafcut's strategies on a pocket."""
    pocket, settings = pocket_of(name), collect({"tool_diameter": RULES.tool_diameter})
    run = Run(settings, machine_of(settings))
    rows = []
    for way in WAYS:
        if only and way.name not in only:
            continue
        rules = LIMITED if way.name == "adaptive" else RULES
        (region,) = centre_regions(pocket, rules)[0]
        began = time.process_time()
        path = fitted(way.path(region, run), rules.tolerance)
        spent = time.process_time() - began
        found = measure_path(pocket, path, rules, run.machine, feed=FEED)
        if found.gouge_mm2:
            raise AssertionError(f"{name}, {way.name}: {found.gouge_mm2:g} mm² beyond the walls are cut")
        angles = f"{math.degrees(found.max_engagement):.0f} ({math.degrees(found.mean_engagement):.0f})"
        over = f"{100.0 * ((found.feed_mm + found.rapid_mm) / found.floor_mm - 1.0):.1f}"
        lengths = [f"{found.feed_mm:.0f}", f"{found.rapid_mm:.0f}", str(found.retracts)]
        times = [f"{found.time_s / 60.0:.2f}", f"{spent:.1f}"]
        what = [f"{found.uncovered_percent:.3f}", f"{found.max_step_over:.2f}", angles, over, *times]
        rows.append([name, way.name, *lengths, *what])
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    return rows


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("pockets", nargs="*", default=sorted(file.stem for file in folder().glob("*.wkt")))
    made.add_argument("--strategies", nargs="*", default=[], help="only these")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    rows = [row for name in arguments.pockets for row in (*rivals(name), *ours(name, arguments.strategies))]
    text = f"""## Pockets

A flat end mill of 10 mm, step-over 6 mm; one level in the plane, without approach and departure. Rows in italics are
paths of others, measured for the data folder. The floor is the area of the allowed tool centres divided by the
step-over; feed and air (rapids from piece to piece) together are compared with it. A gouge would have stopped the
measurement. The step-over is the distance of a pass from its nearer neighbour, at most (`stock.step_over`); the
engagement is the angle of the tool's edge in the material. The time is that of linuxcnc-mill at 1200 mm/min, with its
accelerations, arcs fitted and lifts included; CPU is what finding the path took. *adaptive* keeps the engagement
below 90°.

{facts("pockets", sys.argv[1:], ["leafcut", "numpy", "shapely"])}

{table(HEAD, rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "pockets", text)


if __name__ == "__main__":
    main()
