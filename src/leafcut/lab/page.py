"""Reports an experiment as a self-contained HTML page, and its runs as a CSV table."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from statistics import fmean, median
from typing import Any

from leafcut._version import __version__
from leafcut.errors import LeafcutError, count_of
from leafcut.lab import charts
from leafcut.lab.analysis_blocks import blocks_of_all_analyses
from leafcut.lab.description import Description, Response
from leafcut.lab.published import Runs, command_options, page_texts, published_blocks
from leafcut.lab.published import run_environment_sentence as own_circumstances
from leafcut.lab.results import MAX_CHARTS, ReportBlock, Results, Table, five_digits, five_digits_or_dash, variant_name
from leafcut.lab.statistics import bootstrap_interval
from leafcut.lab.store import Row

#: Packages that a report needs. The extra ``lab`` installs them.
_NEEDED = ("scipy", "pandas", "statsmodels", "scikit_posthocs", "matplotlib")

#: Candidates for the target, in percent above the best result. The chart uses the smallest target that half of all runs
#: reach.
_TARGETS = (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)

#: Maximum number of variants for which each variant has its own curve.
_MAX_CURVES = 8


def experiment_page_html(
    description: Description, rows: Sequence[Row], n_runs: int, n_left_out: int = 0, before: Sequence[ReportBlock] = ()
) -> str:
    """Write the report page of an experiment.

    Parameters
    ----------
    description
        The experiment.
    rows
        The stored runs.
    n_runs
        Number of runs that are planned for this machine.
    n_left_out
        Number of runs that need more cores than this machine has.
    before
        Blocks at the top of the page.

    Raises
    ------
    LeafcutError
        The extra ``lab`` is not installed.
    """
    _check_packages()
    results = Results.from_rows(description, rows)
    measured = [*before, *_report_blocks(results)]
    runs = {description.name: Runs(description, description, rows)} if description.shipped else {}
    return _render_template(
        "page.html.jinja",
        title=description.title,
        language="en",
        of=description,
        done=len(results.finished_rows),
        state=_run_count_sentences(description, results, rows, n_runs, n_left_out),
        measured=bool(measured),
        blocks=[*measured, *published_blocks(runs, "en", command_options(description.reduced))],
        failed=[
            f"{row.instance}, {', '.join(row.levels.values())}, seed {row.seed}: {row.failed}"
            for row in rows
            if row.failed
        ],
        circumstances=run_environment_sentences(results.rows),
    )


def published_page_html(runs: Mapping[str, Runs], language: str, options: str = "") -> str:
    """Write the page that compares all published results with ours.

    Parameters
    ----------
    runs
        Maps the name of each experiment to its runs.
    language
        One of `published.LANGUAGES`.
    options
        Options of `leafcut lab run` that add the missing runs.

    Raises
    ------
    LeafcutError
        The extra ``lab`` is not installed.
    """
    _check_packages()
    return _render_template(
        "published.html.jinja",
        title=page_texts(language)["title"],
        language=language,
        words=page_texts(language),
        reduced=any(item.description.reduced for item in runs.values()),
        circumstances=own_circumstances(runs, language),
        blocks=published_blocks(runs, language, options),
    )


def _render_template(template: str, **values: Any) -> str:
    from leafcut.report.styles import drawing_css, page_templates, style_sheet

    css = drawing_css() + style_sheet("page.css") + style_sheet("lab.css", "leafcut.lab")
    return page_templates("leafcut.lab").get_template(template).render(css=css, version=__version__, **values)


def _check_packages() -> None:
    for package in _NEEDED:
        if find_spec(package) is None:
            raise LeafcutError(f"the report of an experiment needs the package {package}: pip install 'leafcut[lab]'")


def rows_as_csv(description: Description, rows: Sequence[Row]) -> str:
    """Write the runs as CSV, with one row per run. A row contains the responses, the machine and the start time."""
    factors, responses = [item.name for item in description.factors], [item.name for item in description.responses]
    first, last = ["experiment", "instance"], ["failed", "began", "leafcut", "machine", "load", "input_sha256"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*first, *factors, "seed", *responses, *last])
    for row in rows:
        levels, figures = [row.levels.get(name) for name in factors], [row.responses.get(name) for name in responses]
        before, after = ([getattr(row, name) for name in names] for names in (first, last))
        writer.writerow([*before, *levels, row.seed, *figures, *after])
    return text.getvalue()


def _report_blocks(results: Results) -> list[ReportBlock]:
    if not results.rows:
        return []
    search_charts = searches_block(results)
    return [*blocks_of_all_analyses(results), *([search_charts] if search_charts else []), overview_block(results)]


def _run_count_sentences(
    description: Description, results: Results, rows: Sequence[Row], n_runs: int, n_left_out: int
) -> list[str]:
    sentences = [f"{len(results.finished_rows)} of {count_of(n_runs, 'run')} done"]
    if n_left_out:
        sentences.append(f"{count_of(n_left_out, 'run')} left out, because this machine has fewer cores")
    if failed := sum(bool(row.failed) for row in rows):
        sentences.append(f"{failed} failed")
    sentences.append(
        f"{count_of(len(description.seeds), 'seed')}: {_joined_or_shortened([str(seed) for seed in description.seeds])}"
    )
    return sentences


def run_environment_sentences(rows: Sequence[Row]) -> list[str]:
    """Describe the machines, versions and dates of the runs in sentences."""
    if not rows:
        return []
    machines = sorted({row.machine for row in rows})
    loads = [row.load for row in rows if row.load is not None]
    versions = sorted({", ".join(f"{name} {v}" for name, v in row.versions.items()) for row in rows})
    words = [
        f"Machine: {'; '.join(machines)}.",
        f"leafcut {', '.join(sorted({row.leafcut for row in rows}))}; {'; '.join(versions)}.",
        f"From {min(row.began for row in rows)} to {max(row.began for row in rows)}.",
    ]
    if loads:
        words.append(
            f"Processes that waited for a core at the start of a run, per core: median {five_digits(median(loads))}, "
            f"maximum {five_digits(max(loads))}. A value above 1 means that other work used the machine as well."
        )
    return words


def _joined_or_shortened(words: Sequence[str], limit: int = 6) -> str:
    return ", ".join(words) if len(words) <= limit else f"{', '.join(words[:3])} … {words[-1]}"


def overview_block(results: Results) -> ReportBlock:
    """Create a table of all cells, with the numbers of runs and missing runs, and statistics for each response."""
    description = results.description
    columns = ["Instance", *(factor.title for factor in description.factors), "Runs", "Missing"]
    for response in description.responses:
        columns += [f"{response.heading}: mean", "± 95 %", "s", "best", "worst"]
    by_measure = {response.name: results.values_by_cell(response.name) for response in description.responses}
    rows = []
    for cell in results.cells():
        runs = max((len(figures.get(cell, ())) for figures in by_measure.values()), default=0)
        if not runs:
            continue
        row = [*cell, str(runs), str(results.missing_count(runs))]
        for response in description.responses:
            row += _statistics_cells(by_measure[response.name].get(cell, []), response)
        rows.append(tuple(row))
    sentences = ("± is half the bootstrap interval of the mean, s the standard deviation of a sample (n − 1).",)
    return ReportBlock("All runs", sentences, (Table(tuple(columns), tuple(rows), 1 + len(description.factors)),))


def searches_block(results: Results) -> ReportBlock | None:
    """Draw convergence and time-to-target charts for each instance. Returns None if no run has recorded a curve.

    The charts show a curve for each variant. If there are more than `_MAX_CURVES` variants, they show a curve for each
    level of the first factor instead.
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
        steps, timed = (
            {
                variant: [[(float(point[column]), point[2]) for point in row.curve] for row in rows]
                for variant, rows in variants.items()
            }
            for column in (k, 1)
        )
        sentences = f"Convergence on {name}: the mean of the runs, and the band from the best to the worst"
        drawn.append((f"{name}: convergence", charts.convergence_chart(steps, across, "cost of the best", sentences)))
        target, percent = _common_target(timed)
        times = {
            variant: [next((x for x, y in curve if y <= target), None) for curve in timed_curves]
            for variant, timed_curves in timed.items()
        }
        sentences = f"Time to target on {name}: the share of runs that came within {percent:g} % of the best found"
        drawn.append(
            (f"{name}: time to {percent:g} % of the best found", charts.time_to_target_chart(times, "s", sentences))
        )
    return ReportBlock("Progress of the searches", (), (), tuple(drawn))


def _common_target(variants: Mapping[str, Sequence[Sequence[tuple[float, float]]]]) -> tuple[float, float]:
    ends = sorted(curve[-1][1] for curves in variants.values() for curve in curves)
    for percent in _TARGETS:
        target = ends[0] * (1.0 + percent / 100.0)
        if ends[len(ends) // 2] <= target:
            return target, percent
    return ends[-1], 100.0 * (ends[-1] / ends[0] - 1.0)


def _statistics_cells(values: Sequence[float], response: Response) -> list[str]:
    if not values:
        return ["–"] * 5
    low, high = bootstrap_interval(values)
    best, worst = (max, min) if response.more_is_better else (min, max)
    mean = fmean(values)
    deviation = math.sqrt(sum((v - mean) ** 2 for v in values) / (len(values) - 1)) if len(values) > 1 else None
    half = five_digits((high - low) / 2.0) if len(values) > 1 else "–"
    return [
        five_digits(mean),
        half,
        five_digits_or_dash(deviation),
        five_digits(best(values)),
        five_digits(worst(values)),
    ]
