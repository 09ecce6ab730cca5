"""How dense leafcut's nests are beside the best known ones: the ESICUP strips, one thread, some seconds each.

    python benchmarks/nesting.py fu swim --time 15 --write docs/benchmarks.md

A strip has a width and all the length that it needs; the shorter, the denser. leafcut lays the pieces of an instance
on one long sheet of that width, with no kerf, gap or margin. Even then it keeps a little between parts (0.1 mm, and
what the seven digits of its nester need); that is felt least on a large sheet, so an instance is drawn as large as a
sheet may be. Every nest is measured anew by `processes.nesting.proof`, which shares nothing with what made it, and its
density is added up here.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from page import facts, table, write_section

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Nest, NestPart
from leafcut.options import SolveOptions
from leafcut.options.sheet_word import LARGEST_SHEET
from leafcut.processes.nesting.options import NestOptions
from leafcut.processes.nesting.plan.fill import TOUCHING
from leafcut.processes.nesting.proof import check_nest
from leafcut.processes.nesting.run import nest

DATA = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data") / "nesting"

#: The strip is this much longer than the best known one: room for what is not as good.
LONGER = 1.5

#: What differs by this share of itself is the same.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Strip:
    """An instance: its pieces as (points float64[n, 2], how often, angles in degrees), in the file's own unit."""

    name: str
    width: float
    pieces: tuple[tuple[NDArray[np.float64], int, tuple[float, ...]], ...]
    best_length: float
    best_density: float

    @property
    def count(self) -> int:
        """Number of pieces."""
        return sum(number for _, number, _ in self.pieces)

    @property
    def area(self) -> float:
        """Of all pieces."""
        return sum(number * shoelace(points) for points, number, _ in self.pieces)

    @property
    def scale(self) -> float:
        """Millimetres to a unit of the file, so that the strip is as large as a sheet may be."""
        return (1.0 - SAME) * LARGEST_SHEET / max(self.width, LONGER * self.best_length)

    def parts(self) -> list[NestPart]:
        """Return the pieces as leafcut's parts, mm."""
        return [
            NestPart(
                f"{self.name} {number}",
                (Contour(Polyline.of_points((self.scale * points).tolist(), closed=True)),),
                count,
                tuple(math.radians(a) for a in angles),
            )
            for number, (points, count, angles) in enumerate(self.pieces, 1)
        ]

    def options(self) -> NestOptions:
        """Return what leafcut is asked for: one sheet, nothing between the parts but what must be."""
        size = f"{self.scale * LONGER * self.best_length!r}x{self.scale * self.width!r}"
        return NestOptions(sheet=size, kerf=0.0, gap=0.0, margin=0.0, variants=1, max_sheets=1)

    def judged(self, found: Nest) -> tuple[float, float]:
        """Return length (the file's unit) and density (percent) of a nest; one that is none ends the benchmark."""
        faults = check_nest(found, TOUCHING, 0.0)
        if found.n_placed != self.count:
            faults.append(f"{found.n_placed} pieces are laid, {self.count} expected")
        laid = [p.placed(found.parts[p.part].outline).vertices[:, :2] for p in found.layouts[0].placements]
        corners = np.concatenate(laid) / self.scale
        if np.ptp(corners[:, 1]) > (1.0 + SAME) * self.width:
            faults.append("it is wider than the strip")
        if not math.isclose(sum(shoelace(points) for points in laid), self.area * self.scale**2, rel_tol=SAME):
            faults.append("its pieces have another area than those of the file")
        if faults:
            sys.exit(f"{self.name}: {faults[0]}")
        length = float(corners[:, 0].max())
        return length, 100.0 * self.area / (self.width * length)


def shoelace(points: NDArray[np.float64]) -> float:
    """Return the area of a polygon, float64[n, 2]."""
    x, y = points[:, 0] - points[0, 0], points[:, 1] - points[0, 1]
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def load(name: str, best: tuple[float, float]) -> Strip:
    """Return an instance by its name; `best` is the best known length and density, percent."""
    file: dict[str, Any] = json.loads((DATA / "esicup" / f"{name}.json").read_text(encoding="utf-8"))
    pieces = tuple(
        (np.array(item["shape"]["data"], dtype=np.float64), int(item["demand"]), tuple(item["allowed_orientations"]))
        for item in file["items"]
    )
    return Strip(name, float(file["strip_height"]), pieces, *best)


def known() -> dict[str, tuple[float, float]]:
    """Return the best known length and density of every instance."""
    with (DATA / "best_known.csv").open(encoding="utf-8") as rows:
        return {
            row["instance"]: (float(row["best_known_length_sparrow_record"]), float(row["best_known_density_pct"]))
            for row in csv.DictReader(rows)
        }


def measured(strip: Strip, search: SolveOptions) -> list[str]:
    """Nest an instance once; return its row of the table."""
    began, processor = time.perf_counter(), os.times()
    found = nest(strip.parts(), strip.options(), search)
    seconds, after = time.perf_counter() - began, os.times()
    used = sum(after[:4]) - sum(processor[:4])
    length, density = strip.judged(found.nests[0])
    behind = f"{density - strip.best_density:+.2f}"
    figures = [f"{length:.5g}", f"{strip.best_length:.5g}", f"{density:.2f}", f"{strip.best_density:.2f}", behind]
    return [strip.name, f"{strip.count}", *figures, f"{seconds:.0f}", f"{used:.0f}"]


HEAD = [
    "instance",
    "pieces",
    "length",
    "best known",
    "density, %",
    "best known, %",
    "points",
    "clock, s",
    "processor, s",
]


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("instances", nargs="*", help="names of instances; all unless given")
    parser.add_argument("--time", type=float, default=18.0, help="seconds by the clock for each")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", type=Path, help="the page whose section is replaced")
    given = parser.parse_args()
    best, rows = known(), []
    for name in given.instances or best:
        rows.append(measured(load(name, best[name]), SolveOptions(time_limit=given.time, threads=1, seed=given.seed)))
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Nests beside the best known

Strips of the ESICUP: their length in the file's unit, and the share that ends in parts. One run of {given.time:g} s,
seed {given.seed}, one thread; the best known are sparrow's own records. leafcut keeps 0.1 mm between parts even where
no kerf is asked for, and a little for the seven digits that its nester reckons with; each instance was drawn on
a sheet of {LARGEST_SHEET / 1000:g} m, where that is felt least. Every nest was measured anew: all pieces there, in
allowed angles, inside the strip, and apart.

{facts("nesting", sys.argv[1:], ["leafcut", "spyrrow", "rectpack", "shapely"])}

{table(HEAD, rows)}"""
    print(text)
    if given.write:
        write_section(given.write, "nesting", text)


if __name__ == "__main__":
    main()
