"""Compare the levels of a factor by ranks over all instances, pairwise tests, and savings over a base level."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, median

from leafcut.errors import OptionError, count_of
from leafcut.lab import charts
from leafcut.lab.description import Analysis, Response
from leafcut.lab.results import MAX_CHARTS, ReportBlock, Results, Table, number, p_words
from leafcut.lab.statistics import MIN_OF_PAIRS, Pair, compare_ranks, interval


def comparison_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Report the ranks of a factor's levels over all instances, and the savings over the base level."""
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    by_cell = results.groups(response.name, factor.name)
    complete = {rest: groups for rest, groups in by_cell.items() if len(groups) == len(factor.levels)}
    blocks = [{level.name: median(groups[level.name]) for level in factor.levels} for groups in complete.values()]
    sentences = []
    meaning = "an instance (the median of its runs)"
    if len(blocks) < MIN_OF_PAIRS:
        blocks = [
            dict(zip(groups, values, strict=True))
            for groups in complete.values()
            for values in zip(*groups.values(), strict=False)
        ]
        meaning = "a run of an instance with one seed"
        if len(complete) > 1:
            sentences.append(
                "There are few instances, so each block is one run, and the results hold only for these instances."
            )
    heading = f"{factor.title} compared: {response.title.lower()}"
    has_reference = bool(analysis.base or analysis.fact)
    against = [_difference_table(results, analysis, response, factor.title, sentences)] if has_reference else []
    try:
        ranking = compare_ranks(
            {level.name: [block[level.name] for block in blocks] for level in factor.levels}, analysis.alpha
        )
    except OptionError as problem:
        if not against:
            raise
        return ReportBlock(heading, (*sentences, f"No ranks: {problem}."), tuple(against))
    if ranking.p is not None:
        sentences.append(
            f"Friedman over {count_of(ranking.blocks, 'block')}, each {meaning}: "
            f"χ² = {number(ranking.statistic or 0.0)}, "
            f"{p_words(ranking.p)}, agreement W = {ranking.kendall_w:.2f}."
        )
    ranks = sorted(ranking.mean_ranks.items(), key=lambda item: item[1], reverse=response.more_is_better)
    for pair in ranking.pairs:
        if pair.p < analysis.alpha and len(ranking.pairs) <= 3:
            better = pair.first if (pair.difference < 0) != response.more_is_better else pair.second
            sentences.append(
                f"{pair.first} against {pair.second}: {better} is better, {p_words(pair.p)}, effect {pair.effect:+.2f}."
            )
    tables = [
        *against,
        Table((factor.title, "Mean rank of its figures"), tuple((name, f"{rank:.2f}") for name, rank in ranks)),
        _ranked_pairs(factor.title, ranking.pairs, response),
    ]
    drawn = [
        (
            ", ".join(rest),
            charts.box_plots(
                groups, response.heading, f"{response.title} of {', '.join(rest)}, by {factor.title.lower()}"
            ),
        )
        for rest, groups in list(by_cell.items())[:MAX_CHARTS]
    ]
    return ReportBlock(heading, tuple(sentences), tuple(tables), tuple(drawn))


def _difference_table(
    results: Results, analysis: Analysis, response: Response, title: str, sentences: list[str]
) -> Table:
    """Return a table of differences from the base level or a known value. Append the mean savings to `sentences`."""
    base_name = analysis.base or analysis.fact
    known = {instance.name: instance.facts.get(analysis.fact, 0.0) for instance in results.description.instances}
    levels = [level.name for level in results.description.factor(analysis.factors[0]).levels]
    compared_levels = [name for name in levels if name != analysis.base]
    rows, saved = [], {name: list[float]() for name in compared_levels}
    for rest, groups in results.groups(response.name, analysis.factors[0]).items():
        base = known[rest[0]] if analysis.fact else fmean(groups.get(analysis.base, [0.0]))
        cells = []
        for name in compared_levels:
            if name not in groups or not base:
                cells.append(number(fmean(groups[name])) if name in groups else "–")
                continue
            change = 100.0 * (fmean(groups[name]) / base - 1.0)
            saved[name].append(change)
            cells.append(f"{number(fmean(groups[name]))} ({change:+.2f} %)")
        rows.append((", ".join(rest), number(base) if base else "–", *cells))
    for name, changes in saved.items():
        if not changes:
            continue
        low, high = interval(changes)
        sentences.append(
            f"{name} against {base_name}: {fmean(changes):+.2f} % in the mean of "
            f"{count_of(len(changes), 'instance')} (95 % interval {low:+.2f} to {high:+.2f}; "
            f"from {min(changes):+.2f} to {max(changes):+.2f})."
        )
    return Table(
        ("Instance", base_name, *compared_levels),
        tuple(rows),
        1,
        f"{response.heading}: means, and against {base_name} ({title.lower()})",
    )


def _ranked_pairs(title: str, pairs: Sequence[Pair], response: Response) -> Table:
    rows = [
        (
            f"{pair.first} – {pair.second}",
            number(pair.difference),
            "–" if pair.low is None or pair.high is None else f"{number(pair.low)} to {number(pair.high)}",
            p_words(pair.p, ""),
            f"{pair.effect or 0.0:+.2f}",
        )
        for pair in pairs
    ]
    unit = f", {response.unit}" if response.unit else ""
    return Table(
        (title, f"Median difference{unit}", "95 % interval", "p (Wilcoxon, Holm)", "Effect (rank-biserial)"),
        tuple(rows),
    )
