"""Compares published results with the results of our own runs of the same experiment."""

from __future__ import annotations

import csv
import io
import shlex
import string
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from statistics import fmean, median
from typing import Any

from leafcut.errors import OptionError
from leafcut.files.schemas import EXPERIMENT
from leafcut.files.whole_files import parse_toml
from leafcut.lab.description import Description
from leafcut.lab.results import DesignCell, ReportBlock, Results, Table, five_digits
from leafcut.lab.running import has_enough_cores
from leafcut.lab.statistics import one_way_anova, trend_test
from leafcut.lab.store import Row

#: Languages of the page. The same file contains the texts and the published results.
LANGUAGES = ("en", "es")
_SOURCES = resources.files("leafcut.lab") / "shipped" / "published" / "sources.toml"
#: Minimum number of gains that a trend needs.
_MIN_TREND = 4

#: Texts in one language.
Texts = Mapping[str, str]


@dataclass(frozen=True)
class Figure:
    """A published result, and the runs to compare with this result. ``sources.toml`` explains the fields."""

    row: Texts
    quantity: Texts
    published: float | str
    experiment: str
    response: str
    statistic: str
    unit: str
    instance: str
    levels: Mapping[str, tuple[str, ...]]
    base: Mapping[str, tuple[str, ...]]
    factor: str
    scale: float


@dataclass(frozen=True)
class PublishedTable:
    """A table of published results. `without` names the row that is left out of a second report of a trend."""

    source: Texts
    title: Texts
    row: Texts
    figures: tuple[Figure, ...]
    sentences: tuple[Texts, ...]
    without: str


@dataclass(frozen=True)
class Runs:
    """The stored runs of an experiment.

    Attributes
    ----------
    whole
        The full form of the experiment.
    rows
        The runs, including refused runs without results.
    """

    whole: Description
    description: Description
    rows: Sequence[Row]

    @cached_property
    def results(self) -> Results:
        """The runs that have results, grouped by cell."""
        return Results.from_rows(self.description, self.rows)

    @cached_property
    def cells(self) -> tuple[DesignCell, ...]:
        """The cells of the experiment."""
        return tuple(self.results.cells())

    @cached_property
    def possible_cells(self) -> frozenset[DesignCell]:
        """The cells that this machine has enough cores to run."""
        description = self.description
        return frozenset(
            (plan.instance.name, *(level.name for level in plan.levels.values()))
            for plan in description.runs()
            if has_enough_cores(description, plan)
        )

    @cached_property
    def stored_cells(self) -> frozenset[DesignCell]:
        """The cells that have a stored run, even if the run was refused."""
        return frozenset(self.results.cell(row) for row in self.rows)

    @cached_property
    def values_by_response(self) -> Mapping[str, Mapping[DesignCell, list[float]]]:
        """Values of each response by cell."""
        return {response.name: self.results.values_by_cell(response.name) for response in self.description.responses}

    def factor_index(self, factor: str) -> int:
        """Return the index of a factor in a cell."""
        return 1 + [item.name for item in self.description.factors].index(factor)

    def matching_cells(self, figure: Figure) -> list[DesignCell]:
        """Return the cells that belong to a published result."""
        wanted = {self.factor_index(name): names for name, names in figure.levels.items()}
        return [
            cell
            for cell in self.cells
            if figure.instance in ("", cell[0]) and all(cell[k] in names for k, names in wanted.items())
        ]

    def base_cell(self, cell: DesignCell, figure: Figure) -> DesignCell:
        """Return the cell of a table with the value before a saving."""
        changed = {self.factor_index(name): names[0] for name, names in figure.base.items()}
        return tuple(changed.get(k, name) for k, name in enumerate(cell))


@dataclass(frozen=True)
class Ours:
    """Our counterpart to a published result.

    If we do not have a counterpart, `value` is None, and `missing` is the key of a text that explains why.
    """

    value: float | str | None
    runs: int = 0
    planned: int = 0
    missing: str = ""


FigurePair = tuple[Figure, Ours]


@cache
def page_texts(language: str) -> Texts:
    """Return the texts of the page in one language."""
    texts: Texts = _read_sources()["words"][language]
    return texts


@cache
def published_tables() -> tuple[PublishedTable, ...]:
    """Return all tables of published results."""
    return tuple(
        PublishedTable(
            _text_by_language(source["title"]),
            _text_by_language(table["title"]),
            _text_by_language(table["row"]),
            tuple(_parse_figures(table)),
            tuple(table.get("sentence", ())),
            table.get("without", ""),
        )
        for source in _read_sources()["source"]
        for table in source["table"]
    )


def published_experiments() -> list[str]:
    """Return the names of the experiments that have published results."""
    return list(dict.fromkeys(figure.experiment for table in published_tables() for figure in table.figures))


def published_blocks(runs: Mapping[str, Runs], language: str, options: str = "") -> list[ReportBlock]:
    """Return a report section for each table that has results of the experiments in `runs`.

    `options` are the options of `leafcut lab run` that add the missing runs.
    """
    return [
        _table_block(table, pairs, runs, language, options)
        for table in published_tables()
        if (pairs := pair_with_ours(table, runs))
    ]


def pair_with_ours(table: PublishedTable, runs: Mapping[str, Runs]) -> list[FigurePair]:
    """Pair the published results in a table with ours, for the experiments in `runs`."""
    return [
        (figure, our_counterpart(figure, runs[figure.experiment]))
        for figure in table.figures
        if figure.experiment in runs
    ]


def our_counterpart(figure: Figure, runs: Runs) -> Ours:
    """Return our counterpart to a published result."""
    cells = runs.matching_cells(figure)
    if not cells:
        return Ours(None, missing="not_here")
    needed = list(dict.fromkeys([*cells, *(runs.base_cell(cell, figure) for cell in cells)]))
    values = runs.values_by_response[figure.response]
    done = sum(len(values.get(cell, ())) for cell in needed)
    planned = len(needed) * len(runs.description.seeds)
    if all(cell in values for cell in needed):
        try:
            return Ours(_our_value(figure, runs, cells), done, planned)
        except OptionError:  # too few results for an analysis of variance
            return Ours(None, done, planned, "not_run" if done < planned else "no_figure")
    lacking = {cell for cell in needed if cell not in values}
    missing = "cores" if lacking - runs.possible_cells else "not_run" if lacking - runs.stored_cells else "no_figure"
    return Ours(None, done, planned, missing)


def _table_block(
    table: PublishedTable, pairs: Sequence[FigurePair], runs: Mapping[str, Runs], language: str, options: str
) -> ReportBlock:
    texts = page_texts(language)
    several = len({figure.quantity.get(language, "") for figure, _ in pairs}) > 1
    columns = [table.row[language], *(texts[key] for key in ("quantity", "published", "ours", "change", "runs"))]
    rows = []
    for figure, own in pairs:
        unit = f" {figure.unit}" if figure.unit else ""
        cells = [figure.row[language], figure.quantity.get(language, ""), f"{_published_text(figure.published)}{unit}"]
        if own.value is None:
            command = f"leafcut lab run {figure.experiment}{options}"
            cells += [texts[own.missing].format(command=command), "–"]
        else:
            value = own.value if isinstance(own.value, str) else five_digits(own.value)
            cells += [f"{value}{unit}", _difference_words(figure, own, texts)]
        rows.append((*cells, f"{own.runs} / {own.planned}"))
    if not several:
        del columns[1]
        rows = [(row[0], *row[2:]) for row in rows]
    known = _placeholder_values(table, pairs, runs)
    sentences = [texts["difference"], texts["only"], *(sentence[language] for sentence in table.sentences)]
    shown = [sentence.format(**known) for sentence in sentences if _placeholder_names(sentence) <= known.keys()]
    table_of_report = Table(tuple(columns), tuple(rows), 1 + several, table.title[language])
    return ReportBlock(table.source[language], tuple(shown), (table_of_report,))


def pairs_as_csv(runs: Mapping[str, Runs]) -> str:
    """Write the published results and ours side by side as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            "source",
            "table",
            "row",
            "figure",
            "unit",
            "experiment",
            "instance",
            "levels",
            "response",
            "statistic",
            "published",
            "ours",
            "difference_percent",
            "runs",
            "planned",
        ]
    )
    for table in published_tables():
        for figure, own in pair_with_ours(table, runs):
            levels = "; ".join(f"{name} = {' or '.join(names)}" for name, names in figure.levels.items())
            change = _difference_percent(figure, own)
            writer.writerow(
                [
                    table.source["en"],
                    table.title["en"],
                    figure.row["en"],
                    figure.quantity.get("en", ""),
                    figure.unit,
                    figure.experiment,
                    figure.instance,
                    levels,
                    figure.response,
                    figure.statistic,
                    figure.published,
                    own.value,
                    change,
                    own.runs,
                    own.planned,
                ]
            )
    return text.getvalue()


def run_environment_sentence(runs: Mapping[str, Runs], language: str) -> list[str]:
    """Describe the versions, machines and dates of our runs in a sentence. The list is empty if there are no runs."""
    rows = [row for item in runs.values() for row in item.rows]
    if not rows:
        return []
    versions, machines = (", ".join(sorted({getattr(row, name) for row in rows})) for name in ("leafcut", "machine"))
    first, last = (pick(row.began for row in rows) for pick in (min, max))
    return [page_texts(language)["circumstances"].format(versions=versions, machines=machines, first=first, last=last)]


def command_options(reduced: bool, results: str = "") -> str:
    """Return the options for `leafcut lab run`. If `results` is empty, the command uses its default results file."""
    return f"{' --reduced' if reduced else ''}{f' --results {shlex.quote(results)}' if results else ''}"


def _our_value(figure: Figure, runs: Runs, cells: Sequence[DesignCell]) -> float | str:
    values = runs.values_by_response[figure.response]
    if figure.statistic in ("mean", "max"):
        pool = [value for cell in cells for value in values[cell]]
        return figure.scale * (fmean(pool) if figure.statistic == "mean" else max(pool))
    if figure.statistic in ("saving", "saved"):
        means = [(fmean(values[runs.base_cell(cell, figure)]), fmean(values[cell])) for cell in cells]
        base, own = max(means, key=lambda pair: 1.0 - pair[1] / pair[0])
        return figure.scale * (base - own if figure.statistic == "saved" else 100.0 * (1.0 - own / base))
    place = runs.factor_index(figure.factor)
    anova = one_way_anova({cell[place]: values[cell] for cell in cells})
    if figure.statistic == "F":
        return anova.f
    letters = anova.fisher_letters
    best = set(letters[min(anova.means, key=anova.means.__getitem__)])
    equal = [level.name for level in runs.description.factor(figure.factor).levels if best & set(letters[level.name])]
    return equal[0] if figure.statistic == "cheapest" else ", ".join(equal)


def _difference_percent(figure: Figure, own: Ours) -> float | None:
    """Return the difference between our result and the published result in percent.

    The difference is None if one of the results is not a number.
    """
    if isinstance(own.value, str) or isinstance(figure.published, str) or own.value is None or not figure.published:
        return None
    return 100.0 * (own.value / figure.published - 1.0)


def _difference_words(figure: Figure, own: Ours, texts: Texts) -> str:
    percent = _difference_percent(figure, own)
    if percent is None:
        return texts["same"] if figure.published == own.value else texts["other"]
    if figure.unit == "%" and isinstance(own.value, float) and isinstance(figure.published, float):
        return f"{own.value - figure.published:+.2f} {texts['points']}"
    return _signed_percent(percent)


def _placeholder_values(table: PublishedTable, pairs: Sequence[FigurePair], runs: Mapping[str, Runs]) -> dict[str, str]:
    """Return the values of the placeholders in a table's sentences, by field name."""
    known = {"cells": str(len(pairs)), "compared": str(sum(own.value is not None for _, own in pairs))}
    changes = [
        change
        for figure, own in pairs
        if figure.unit != "%" and (change := _difference_percent(figure, own)) is not None
    ]
    if len(changes) == 1:
        known["only"] = _signed_percent(changes[0])
    elif changes:
        known |= {
            "low": _signed_percent(min(changes)),
            "high": _signed_percent(max(changes)),
            "middle": _signed_percent(median(changes)),
        }
    known |= _time_per_hole_values(pairs, runs)
    gains = [
        (size, figure.published, own.value, figure.row["en"])
        for figure, own in pairs
        if figure.statistic == "saving"
        and (size := _instance_size(figure, runs))
        and isinstance(figure.published, float)
    ]
    own_gains = [(size, value) for size, _, value, _ in gains if isinstance(value, float)]
    if own_gains:
        compared_gains = [gain for _, gain, value, _ in gains if value is not None]
        known |= {"gain": f"{fmean(compared_gains):.2f} %", "own_gain": f"{fmean(gain for _, gain in own_gains):.2f} %"}
    if len(gains) >= _MIN_TREND:
        rest = [gain for gain in gains if gain[3] != table.without]
        known |= {"without": table.without}
        known |= _trend_values("", [(size, gain) for size, gain, _, _ in gains])
        known |= _trend_values("rest_", [(size, gain) for size, gain, _, _ in rest])
        known |= _trend_values("own_", own_gains)
    return known


def _time_per_hole_values(pairs: Sequence[FigurePair], runs: Mapping[str, Runs]) -> dict[str, str]:
    """Return the published time for all holes and for one hole, and our time for one hole.

    The published time follows from the saving. If d minutes are a share p of the total time, the total time is d / p.
    """
    by_cell: dict[tuple[str, str], dict[str, FigurePair]] = {}
    for pair in pairs:
        if (pair[0].unit, pair[0].statistic) in (("min", "saved"), ("%", "saving")):
            by_cell.setdefault((pair[0].experiment, pair[0].instance), {})[pair[0].statistic] = pair
    for both in by_cell.values():
        if len(both) == 2:
            (figure, own), (share, own_share) = both["saved"], both["saving"]
            size = _instance_size(figure, runs)
            base = 100.0 * float(figure.published) / float(share.published)
            known = {
                "saved": _published_text(figure.published),
                "saving": _published_text(share.published),
                "base": f"{base:.1f}",
            }
            known |= {"size": f"{size:g}", "pace": f"{60.0 * base / size:.1f}"}
            if own.value and own_share.value:
                own_base = 100.0 * float(own.value) / float(own_share.value)
                known["own_pace"] = f"{60.0 * own_base / size:.2f}"
            return known
    return {}


def _trend_values(prefix: str, gains: Sequence[tuple[float, float]]) -> dict[str, str]:
    try:
        line = trend_test([size for size, _ in gains], [gain for _, gain in gains])
    except OptionError:
        return {}
    return {f"{prefix}tau": f"{line.tau:.2f}", f"{prefix}p": f"{line.tau_p:.2f}"}


def _instance_size(figure: Figure, runs: Mapping[str, Runs]) -> float:
    """Return the size of the instance that a published result belongs to, or 0 if the size is unknown."""
    instances = runs[figure.experiment].whole.instances
    return next((item.facts.get("size", 0.0) for item in instances if item.name == figure.instance), 0.0)


def _signed_percent(percent: float) -> str:
    return f"{percent:+.1f} %"


def _published_text(published: float | str) -> str:
    return published if isinstance(published, str) else f"{published:,.7g}"


def _placeholder_names(sentence: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(sentence) if name}


@cache
def _read_sources() -> dict[str, Any]:
    return parse_toml(_SOURCES.read_text(encoding="utf-8"), _SOURCES.name, EXPERIMENT)


def _parse_figures(table: Mapping[str, Any]) -> Iterator[Figure]:
    for row in table["rows"]:
        for quantity, published in zip(table["quantities"], row["published"], strict=True):
            if published == "":
                continue
            keys = {**table, **quantity, **row}
            levels, base = (
                _parse_levels(table.get(key, {}) | quantity.get(key, {}) | row.get(key, {}))
                for key in ("levels", "base")
            )
            yield Figure(
                _text_by_language(row["title"]),
                _text_by_language(quantity.get("title", "")),
                published if isinstance(published, str) else float(published),
                keys["experiment"],
                keys["response"],
                keys["statistic"],
                keys.get("unit", ""),
                keys.get("instance", ""),
                levels,
                base,
                keys.get("factor", ""),
                keys.get("scale", 1.0),
            )


def _parse_levels(table: Mapping[str, str | list[str]]) -> dict[str, tuple[str, ...]]:
    return {name: tuple(names) if isinstance(names, list) else (names,) for name, names in table.items()}


def _text_by_language(value: str | Texts) -> Texts:
    return dict.fromkeys(LANGUAGES, value) if isinstance(value, str) else value
