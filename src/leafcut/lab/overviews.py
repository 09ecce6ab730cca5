"""Sections of every experiment report: a table of all cells, and the convergence of the searches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import fmean

from leafcut.lab import charts
from leafcut.lab.description import Response
from leafcut.lab.results import MAX_CHARTS, ReportBlock, Results, Table, number, number_or_dash, variant_name
from leafcut.lab.statistics import interval
from leafcut.lab.store import Row

#: Candidate targets, percent above the best result. The chart uses the smallest target that half of all runs reach.
_TARGETS = (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)

#: Maximum number of variants in a chart with a curve for each variant.
_MAX_CURVES = 8


def overview(results: Results) -> ReportBlock:
    """Return a table of all cells with the number of runs and missing runs, and statistics of each response."""
    description = results.description
    columns = ["Instance", *(factor.title for factor in description.factors), "Runs", "Missing"]
    for response in description.responses:
        columns += [f"{response.heading}: mean", "± 95 %", "s", "best", "worst"]
    by_measure = {response.name: results.figures(response.name) for response in description.responses}
    rows = []
    for cell in results.cells():
        runs = max((len(figures.get(cell, ())) for figures in by_measure.values()), default=0)
        if not runs:
            continue
        row = [*cell, str(runs), str(results.missing(runs))]
        for response in description.responses:
            row += _spread_cells(by_measure[response.name].get(cell, []), response)
        rows.append(tuple(row))
    sentences = ("± is half the bootstrap interval of the mean, s the standard deviation of a sample (n − 1).",)
    return ReportBlock("All runs", sentences, (Table(tuple(columns), tuple(rows), 1 + len(description.factors)),))


def searches(results: Results) -> ReportBlock | None:
    """Return convergence and time-to-target charts of each instance, or None if no run recorded a curve.

    The charts have a curve for each variant, or for each level of the first factor if there are more than `_MAX_CURVES`
    variants.
    """
    description = results.description
    n_variants = len({cell[1:] for cell in results.cells()})
    curve_of = replace(description, factors=description.factors[:1]) if n_variants > _MAX_CURVES else description
    curves: dict[str, dict[str, list[Row]]] = {}
    for row in results.rows:
        if len(row.curve) > 1:
            cell = results.cell(row)[: 1 + len(curve_of.factors)]
            curves.setdefault(row.instance, {}).setdefault(variant_name(curve_of, cell), []).append(row)
    if not curves:
        return None
    drawn = []
    for name, variants in list(curves.items())[:MAX_CHARTS]:
        by_iteration = any(
            step[0] != row.curve[0][0] for rows in variants.values() for row in rows for step in row.curve
        )
        across, k = ("iteration", 0) if by_iteration else ("s", 1)
        steps = {
            variant: [[(float(point[k]), point[2]) for point in row.curve] for row in rows]
            for variant, rows in variants.items()
        }
        sentences = f"Convergence on {name}: the mean of the runs, and the band from the best to the worst"
        drawn.append((f"{name}: convergence", charts.convergence(steps, across, "cost of the best", sentences)))
        timed = {
            variant: [[(point[1], point[2]) for point in row.curve] for row in rows]
            for variant, rows in variants.items()
        }
        target, percent = _common_target(timed)
        times = {
            variant: [charts.time_to_reach(curve, target) for curve in timed_curves]
            for variant, timed_curves in timed.items()
        }
        sentences = f"Time to target on {name}: the share of runs that came within {percent:g} % of the best found"
        drawn.append((f"{name}: time to {percent:g} % of the best found", charts.time_to_target(times, "s", sentences)))
    return ReportBlock("Progress of the searches", (), (), tuple(drawn))


def _common_target(variants: Mapping[str, Sequence[Sequence[tuple[float, float]]]]) -> tuple[float, float]:
    ends = sorted(curve[-1][1] for curves in variants.values() for curve in curves)
    for percent in _TARGETS:
        target = ends[0] * (1.0 + percent / 100.0)
        if ends[len(ends) // 2] <= target:
            return target, percent
    return ends[-1], 100.0 * (ends[-1] / ends[0] - 1.0)


def _spread_cells(values: Sequence[float], response: Response) -> list[str]:
    if not values:
        return ["–"] * 5
    low, high = interval(values)
    best, worst = (max, min) if response.more_is_better else (min, max)
    mean = fmean(values)
    deviation = math.sqrt(sum((v - mean) ** 2 for v in values) / (len(values) - 1)) if len(values) > 1 else None
    half = number((high - low) / 2.0) if len(values) > 1 else "–"
    return [number(mean), half, number_or_dash(deviation), number(best(values)), number(worst(values))]
