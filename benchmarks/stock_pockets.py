"""The height field against the polygons of the pocket proof, cell by cell: every strategy, several pockets.

    python benchmarks/stock_pockets.py --write docs/benchmarks.md

leafcut mills a pocket, and the program is cut by the stock model as anybody's would be: from its text. What lies deeper
than the last level but one is compared with what `stock.removal` unites from the planned path: discs along it, as
polygons. A cell that is more than a cell inside of these must be cut, one more than a cell outside must not be; what
both leave of the reachable ground, and cut beyond the walls, is told.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import boards
import numpy as np
import shapely
from page import facts, table, write_section

import leafcut
from leafcut.processes.pocket.strategies import WAYS
from leafcut.stock.removal import removal

#: What is milled: mm. Two levels of unequal depth, so that only the second one counts.
TOOL, DEPTH, STEP_DOWN = 10.0, 3.0, 2.0
HEAD = ("pocket", "strategy", "cells", "by cells mm²", "by polygons mm²", "apart %", "left mm²", "gouged mm²", "wrong")
ROOT = Path(__file__).parents[1]
SHAPES = ("p1_rect_rounded", "p3_fleur", "p4_star", "p5_islands3")


class Compared(NamedTuple):
    """What two models say of a pocket: cells, areas, what is left and gouged by both, mm², and cells that differ."""

    cells: int
    by_cells: float
    by_polygons: float
    left: tuple[float, float]
    gouged: tuple[float, float]
    wrong: int

    @property
    def apart(self) -> float:
        """How much the areas differ, as a part."""
        return abs(self.by_cells / self.by_polygons - 1.0)


def compare(drawing: Path, strategy: str, cell: float, **options: object) -> Compared:
    """Mill a pocket and return what both models say of it."""
    given = {"tool_diameter": TOOL, "depth": DEPTH, "step_down": STEP_DOWN, "preset": "fast", "threads": 1, **options}
    if strategy == "adaptive":
        given["max_engagement"] = "100deg"
    outcome = leafcut.optimize(drawing, process="pocket", strategy=strategy, milling_feed="800mm/min", **given)
    (plan,) = outcome.detail.plans
    found = removal(plan.pocket, plan.result.path, plan.rules)
    low_x, low_y, high_x, high_y = found.pocket.bounds
    stock = f"{low_x - TOOL},{low_y - TOOL},{-DEPTH - 1},{high_x + TOOL},{high_y + TOOL},0"
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "pocket.ngc")
        program.write_text(outcome.text, encoding="utf-8")
        field = leafcut.cut_stock(program, workpiece=stock, cell=cell, mill_diameter=TOOL).field
    deep = field.heights < -STEP_DOWN - 0.1
    rows, columns = deep.shape
    x, y = np.meshgrid(field.x + cell * np.arange(columns), field.y + cell * np.arange(rows))

    def inside(shape: object) -> np.ndarray:
        shapely.prepare(shape)
        return np.asarray(shapely.contains_xy(shape, x, y))

    wrong = (inside(found.swept.buffer(-cell)) & ~deep) | (deep & ~inside(found.swept.buffer(cell)))
    left = inside(found.reachable.buffer(-0.5 * cell)) & ~deep
    gouged = deep & ~inside(found.pocket.buffer(0.5 * cell))
    area = cell * cell
    return Compared(
        deep.size, float(deep.sum()) * area, found.swept.area,
        (float(left.sum()) * area, found.uncovered.area), (float(gouged.sum()) * area, found.gouges.area),
        int(wrong.sum()),
    )  # fmt: skip


def main() -> None:
    """Compare and print the table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("--cell", type=float, default=0.1, help="side of a cell, mm")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    drawings = [boards.data_folder().parent / "pockets" / f"{name}.dxf" for name in SHAPES]
    rows, wrong = [], 0
    for drawing in drawings:
        for way in WAYS:
            found = compare(drawing, way.name, arguments.cell)
            pairs = [f"{one:.1f} ({other:.1f})" for one, other in (found.left, found.gouged)]
            areas = [f"{found.by_cells:.1f}", f"{found.by_polygons:.1f}", f"{100 * found.apart:.3f}"]
            rows.append([drawing.stem, way.name, f"{found.cells:,}", *areas, *pairs, str(found.wrong)])
            wrong += found.wrong
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Stock against the pocket proof

Pockets that leafcut mills with a tool of {TOOL:g} mm, cut by the stock model from the text of the program, in cells of
{arguments.cell:g} mm, beside the polygons of the pocket proof: the area cut; what is left of the reachable ground and
cut beyond the walls by cells (by polygons); cells that are cut more than a cell outside of the polygons, or are not cut
more than a cell inside.

{facts("stock_pockets", sys.argv[1:], ["leafcut", "numpy", "shapely"])}

{table(HEAD, rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "stock_pockets", text)
    if wrong:
        raise SystemExit(f"{wrong} cells differ")


if __name__ == "__main__":
    main()
