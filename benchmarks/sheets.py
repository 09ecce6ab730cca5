"""Sheets cut: routes beside published ones, machine time with chains and common lines, ants and nearest neighbour.

    python benchmarks/sheets.py --limit 10 --write docs/benchmarks.md
    python benchmarks/sheets.py --only routes --sheets E1X_6

Three real sheets of the Sirius CAM (shared data, nesting/sirius_sheets). Their routes are counted as published: from
(0, 0) through one given place of every contour and back, every way rounded to a millimetre, what is inside first. The
judge shares nothing with the solver. Machine time is that of the whole verified program, on the machine that the sheets
come with (500 mm/s between cuts, 10 mm/s, 7 s for a pierce) and by the cut chart of a plasma torch.

The published tour of 8877 was made under a looser rule, and breaks inner before outer: its matrix only forbids to go
from a contour straight to one inside it. So that sheet has two lines: by the looser rule, and by the real one.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from nests import SIZES, make, plates
from page import facts, table, write_section

from leafcut import api
from leafcut.model.cutting import CutTimes
from leafcut.model.outcome import Outcome
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.processes.nesting.post import write_layout
from leafcut.processes.settings import collect
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cut_rules import resolve_rules
from leafcut.processes.sheet.plan.cutting import prepare_cutting
from leafcut.processes.sheet.plan.sheet import prepare_sheet
from leafcut.read import read_contours
from leafcut.read.cutchart import find_cut_data, load_chart
from leafcut.solve.solve import solve

HERE = Path(__file__).parent
DATA = Path(os.environ.get("LEAFCUT_DATA") or HERE.parents[1] / "shared" / "data") / "nesting" / "sirius_sheets"

#: What a way costs that is forbidden, mm: more than all ways of any tour together.
FORBIDDEN = 1e7


@dataclass(frozen=True)
class Sheet:
    """A sheet: its drawing, its places to pierce, and its published route: mm and whose.

    `result` is the file of the tour, where there is one; `first` its number of the first place; `loose`: made under the
    looser rule.
    """

    drawing: str
    places: str
    published: int
    by: str
    result: str = ""
    first: int = 0
    loose: bool = False


#: The routes: solver runs stored with the sheets; of E1X_6 the optimum (Gurobi; in the same source as e1x_6.pcglns).
SHEETS = {
    "8877": Sheet("8877_01.DBS.JSON", "8877.json", 7631, "PCGLNS", "8877-2.result.txt", 1, loose=True),
    "test1": Sheet("test1.dbs.json", "test1.gtsp.json", 4662, "PCGLNS", "test1.result.txt", 2),
    "E1X_6": Sheet("E1X_6_01.dbs.json", "E1X_6_01.gtsp.json", 1513, "optimum"),
}


# -- routes as published ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Places:
    """Places to pierce: (x, y) and contour of each, the first the home of contour 0; pairs (inner, directly outer)."""

    xy: list[tuple[float, float]]
    contour: list[int]
    pairs: list[tuple[int, int]]

    def problem(self, loose: bool) -> RoutingProblem:
        """Return the closed problem; inner before outer, or `loose`: from no contour straight to one inside it."""
        xy, contour = np.array(self.xy), np.array(self.contour, dtype=np.int32)
        if loose:
            ways = np.floor(np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1)) + 0.5)
            for inner, outer in self.inside():
                ways[np.ix_(contour == outer, contour == inner)] = FORBIDDEN
            return RoutingProblem(xy, xy, contour, np.zeros(len(xy)), Metric("EXPLICIT", matrix=ways), closed=True)
        pairs = [*self.pairs, *((0, k) for k in range(1, max(self.contour) + 1))]
        return RoutingProblem(
            xy, xy, contour, np.zeros(len(xy)), Metric("EUC_2D"), np.array(pairs, dtype=np.int32), closed=True
        )

    def inside(self) -> list[tuple[int, int]]:
        """Return all pairs (inner, outer), however deep."""
        around = dict(self.pairs)
        found = []
        for inner in around:
            outer = around.get(inner)
            while outer is not None:
                found.append((inner, outer))
                outer = around.get(outer)
        return found

    def judged(self, nodes: Sequence[int], loose: bool) -> int:
        """Return the length of a tour, mm; one that breaks the rule ends the benchmark."""
        order = [self.contour[n] for n in nodes]
        if sorted(order) != list(range(max(self.contour) + 1)):
            sys.exit("a contour is not visited once")
        home = order.index(0)
        place = {contour: (k - home) % len(order) for k, contour in enumerate(order)}
        late = [pair for pair in self.inside() if place[pair[0]] > place[pair[1]]]
        if loose:
            late = [(inner, outer) for inner, outer in late if place[inner] == place[outer] + 1]
        if late:
            sys.exit(f"contour {late[0][0]} comes after contour {late[0][1]} around it")
        points = [self.xy[n] for n in nodes]
        return sum(math.floor(math.dist(a, b) + 0.5) for a, b in zip(points, points[1:] + points[:1], strict=True))


def places_of(sheet: Sheet) -> Places:
    """Return the places to pierce that a sheet comes with."""
    data = json.loads((DATA / sheet.places).read_text(encoding="utf-8"))
    found = Places([(data["TaskData"]["StartX"], data["TaskData"]["StartY"])], [0], [])
    for number, contour, parent in _nested(data["Contours"], 0):
        found.xy.extend((p["X"], p["Y"]) for p in contour["Points"])
        found.contour.extend(number for _ in contour["Points"])
        if parent:
            found.pairs.append((number, parent))
    return found


def _nested(contours: list[dict[str, Any]], parent: int) -> Iterator[tuple[int, dict[str, Any], int]]:
    for contour in contours:
        yield contour["Index"], contour, parent
        yield from _nested(contour.get("NestedContours", []), contour["Index"])


def published_tour(sheet: Sheet, places: Places) -> list[int]:
    """Return the published tour as positions in `places`: its file counts points as they are, home last or first."""
    words = (DATA / sheet.result).read_text(encoding="utf-8").partition("Tour Ordering")[2]
    numbers = json.loads(words[words.index("[") : words.index("]") + 1])
    order = np.argsort(np.array(places.contour), kind="stable")
    return [int(order[(n - sheet.first + 1) % len(places.xy)]) for n in numbers]


def route_rows(names: Sequence[str], limit: float) -> Iterator[list[str]]:
    """Yield a row per sheet, or two: the published route and ours."""
    for name in names:
        sheet = SHEETS[name]
        places = places_of(sheet)
        if sheet.result and places.judged(published_tour(sheet, places), sheet.loose) != sheet.published:
            sys.exit(f"{name}: the published tour does not have its published length")
        for loose in (True, False) if sheet.loose else (False,):
            began, worked = time.perf_counter(), time.process_time()
            found = solve(places.problem(loose), SolveOptions(time_limit=limit, bound=False, threads=1))
            clock, worked = time.perf_counter() - began, time.process_time() - worked
            ours = places.judged([int(n) for n in found.nodes], loose)
            comparable = loose or not sheet.loose
            yield [
                f"{name}, looser rule" if loose else name,
                str(max(places.contour)),
                str(len(places.xy) - 1),
                f"{sheet.published:,} ({sheet.by})" if comparable else "none that keeps the rule",
                f"{ours:,}",
                f"{100.0 * (ours / sheet.published - 1.0):+.2f}" if comparable else "–",
                f"{clock:.1f}",
                f"{worked:.1f}",
            ]


# -- machine time ----------------------------------------------------------------------------------------------------

MACHINES: dict[str, dict[str, Any]] = {
    "Sirius": {"machine": str(HERE / "sirius_table.toml"), "cut_speed": "10 mm/s", "pierce_delay": "7 s"},
    "plasma 6 mm": {"machine": str(HERE / "sirius_table.toml")},
}


def cut(drawing: Path, limit: float, **options: Any) -> Outcome:
    """Return the verified program of a sheet of 6 mm mild steel."""
    done = api.optimize(drawing, process="cut", thickness="6", time_limit=limit, threads=1, bound=False, **options)
    if not done.verified:
        sys.exit(f"{drawing.name}: not verified")
    return done


def times_of(done: Outcome) -> CutTimes:
    """Return the time norm of the program as written."""
    if done.detail.plan is None:
        sys.exit("no plan of cuts")
    return done.detail.plan.measures.sheet


def edge_seconds(done: Outcome) -> float:
    """Return the seconds that the edges of the parts take, whatever the order: each once, at its speed."""
    plan = done.detail.plan
    assert plan is not None
    total = 0.0
    for c in plan.cuts:
        slow = c.speeds[0][1] if c.small_hole else plan.data.feed
        total += sum(plan.sheet.contours[k].contour.path.length for k in c.contours if c.kind == "cut") / slow
    return total


def time_rows(names: Sequence[str], limit: float) -> Iterator[list[str]]:
    """Yield a row per sheet and machine: contour by contour, and with chains."""
    for name in names:
        for machine, options in MACHINES.items():
            single = cut(DATA / SHEETS[name].drawing, limit, **options)
            chains = cut(DATA / SHEETS[name].drawing, limit, chains=True, **options)
            one, other, edges = times_of(single), times_of(chains), edge_seconds(single)
            yield [
                name,
                machine,
                f"{edges:.0f}",
                f"{one.pierces}",
                f"{one.total_s:.0f}",
                f"{other.pierces}",
                f"{other.total_s:.0f}",
                f"{100.0 * (1.0 - other.total_s / one.total_s):.1f}",
                f"{one.total_s - edges:.0f}",
                f"{other.total_s - edges:.0f}",
                f"{100.0 * (1.0 - (other.total_s - edges) / (one.total_s - edges)):.1f}",
            ]


# -- nests -----------------------------------------------------------------------------------------------------------


def nearest_neighbour(drawing: Path) -> float:
    """Return the moves of the comparison, mm: always the nearest start of a cut before which nothing must come.

    From the lower left corner; the way to the first cut is not counted.
    """
    settings = collect({"thickness": "6"})
    part = read_contours(drawing, settings.read)
    data, _ = find_cut_data(load_chart(None), "plasma", "mild_steel", 6.0, None)
    cutting = prepare_cutting(
        prepare_sheet(part, settings.sheet), resolve_rules(data, settings.of(CutOptions), switches=True)
    )
    entry, leave = (np.array([getattr(s, end) for s in cutting.starts]) for end in ("entry", "exit"))
    contour = np.array([s.contour for s in cutting.starts])
    waits = {k: {a for a, b in cutting.pairs if b == k} for k in range(len(cutting.contours))}
    done: set[int] = set()
    here, total = np.zeros(2), 0.0
    while len(done) < len(cutting.contours):
        free = np.array([k not in done and waits[k] <= done for k in contour.tolist()])
        away = np.where(free, np.hypot(*(entry - here).T), np.inf)
        best = int(np.argmin(away))
        total += float(away[best]) if done else 0.0
        done.add(int(contour[best]))
        here = leave[best]
    return total


def nest_rows(sizes: Sequence[int], limit: float) -> Iterator[list[str]]:
    """Yield a row per nest: nearest neighbour, and leafcut."""
    with tempfile.TemporaryDirectory() as folder:
        for size in sizes:
            drawing = Path(folder) / f"nest_{size:03d}.dxf"
            found = make(size)
            drawing.write_text(write_layout(found, found.layouts[0]), encoding="utf-8")
            table_ = str(HERE / "sirius_table.toml")
            best = times_of(cut(drawing, limit, machine=table_, objective="distance", start_point=(0.0, 0.0)))
            near = nearest_neighbour(drawing)
            route = best.length_mm - best.rapid_mm
            yield [
                str(size),
                str(best.pierces),
                f"{near:,.0f}",
                f"{best.rapid_mm:,.0f}",
                f"{100.0 * (1.0 - best.rapid_mm / near):.1f}",
                f"{route + near:,.0f}",
                f"{best.length_mm:,.0f}",
                f"{100.0 * (1.0 - best.length_mm / (route + near)):.2f}",
            ]


# -- common lines ----------------------------------------------------------------------------------------------------

#: Rows and columns of plates, by the torch: a plasma cuts two rows with common lines.
GRIDS = {"plasma 6 mm": (2, 8), "Sirius": (2, 8), "laser 6 mm": (5, 8)}
#: Between parts that are cut one by one, mm, besides the kerf.
APART = 10.0


def common_rows(limit: float) -> Iterator[list[str]]:
    """Yield a row per torch: plates with a gap cut one by one, and plates a kerf apart cut with common lines."""
    for name, (rows, columns) in GRIDS.items():
        options = {"machine": "laser-table"} if name.startswith("laser") else MACHINES[name]
        process = "laser_fiber_3kW" if name.startswith("laser") else "plasma"
        kerf = find_cut_data(load_chart(None), process, "mild_steel", 6.0, None)[0].kerf
        times = []
        for gap in (APART, 0.0):
            found = plates(rows, columns, kerf, gap)
            if len(found.layouts) != 1 or found.n_placed != rows * columns:
                sys.exit(f"{name}: the plates are not on one sheet")
            with tempfile.TemporaryDirectory() as folder:
                drawing = Path(folder) / "grid.dxf"
                drawing.write_text(write_layout(found, found.layouts[0]), encoding="utf-8")
                times.append(times_of(cut(drawing, limit, cut_process=process, common_lines=gap == 0.0, **options)))
        one, other = times
        yield [
            name,
            str(rows * columns),
            f"{kerf:g}",
            f"{one.cut_mm:,.0f}",
            f"{other.cut_mm:,.0f}",
            f"{other.common_mm:,.0f}",
            f"{one.pierces}",
            f"{other.pierces}",
            f"{one.total_s:.0f}",
            f"{other.total_s:.0f}",
            f"{100.0 * (1.0 - other.total_s / one.total_s):.1f}",
        ]


# -- the page --------------------------------------------------------------------------------------------------------

ROUTE_HEAD = ("sheet", "contours", "places", "published, mm", "leafcut, mm", "gap, %", "clock, s", "processor, s")
TIME_HEAD = (
    "sheet", "machine", "edges, s", "pierces", "time, s", "pierces with chains", "time, s", "saved, %",
    "without edges, s", "with chains, s", "saved, %",
)  # fmt: skip
NEST_HEAD = (
    "parts", "pierces", "moves, nearest, mm", "leafcut, mm", "saved, %", "route, nearest, mm", "leafcut, mm", "saved, %"
)  # fmt: skip
COMMON_HEAD = (
    "machine", "plates", "kerf, mm", "cut, mm", "with common lines", "cut once, mm", "pierces", "with common lines",
    "time, s", "with common lines", "saved, %",
)  # fmt: skip

ROUTE_TEXT = """## Sheets: routes

Routes between the cuts of three real sheets, closed, counted as published. The tour published for 8877 was made under a
looser rule (from no contour straight to one inside it) and cuts four contours before what is inside them; so that sheet
has two lines.
"""
TIME_TEXT = """## Sheets: machine time

Machine time of the verified programs of the same sheets, 6 mm mild steel, kerf and leads included: each contour with a
pierce of its own, in the best order found, and with chains (`--chains`). *edges* is what cutting the drawn contours
takes at their speed; no order and no chain changes it, so that even without any pierce or move the whole time could not
come below it. The last columns leave it out: what pierces, leads, bridges and moves take.
"""
NEST_TEXT = """## Sheets: ants and nearest neighbour

Nests made by `benchmarks/nests.py`: nearest neighbour (same places to begin, inner before outer) beside the ants
(`--objective distance`). *route* is the published measure: the perimeters and the moves in between.
"""


COMMON_TEXT = f"""## Sheets: common lines

Plates of 150 × 100 mm with a hole of 40 mm, laid in rows by leafcut's nester: {APART:g} mm and a kerf apart, and cut
one by one; and one kerf apart, with `--common-lines`. *cut* is all that the torch goes while it burns, leads included,
*cut once* what of it lies between two plates. Machine time is that of the whole verified program.
"""


def parts(given: argparse.Namespace) -> Iterator[tuple[str, str]]:
    """Yield the name of each part of the page, and its text, as they are done."""
    names, sizes = given.sheets.split(","), [int(size) for size in given.sizes.split(",")]
    only = given.only.split(",")
    if "routes" in only:
        yield "sheets: routes", f"{ROUTE_TEXT}\n{table(ROUTE_HEAD, route_rows(names, given.limit))}"
    if "times" in only:
        yield "sheets: time", f"{TIME_TEXT}\n{table(TIME_HEAD, time_rows(names, given.limit))}"
    if "nests" in only:
        yield "sheets: nests", f"{NEST_TEXT}\n{table(NEST_HEAD, nest_rows(sizes, given.limit))}"
    if "common" in only:
        yield "sheets: common lines", f"{COMMON_TEXT}\n{table(COMMON_HEAD, common_rows(given.limit))}"


def main() -> None:
    """Measure, print, and write the sections of the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sheets", default=",".join(SHEETS), help="names of sheets")
    parser.add_argument("--sizes", default=",".join(str(n) for n in SIZES), help="numbers of parts of the nests")
    parser.add_argument("--only", default="routes,times,nests,common", help="what to measure")
    parser.add_argument("--limit", type=float, default=10.0, help="time limit of a search, s")
    parser.add_argument("--write", type=Path, help="page whose sections are replaced")
    given = parser.parse_args()
    for name, text in parts(given):
        whole = f"{text}\n\n{facts('sheets', sys.argv[1:], ('numpy', 'numba', 'shapely'))}"
        if given.write:
            write_section(given.write, name, whole)
        print(whole, flush=True)


if __name__ == "__main__":
    main()
