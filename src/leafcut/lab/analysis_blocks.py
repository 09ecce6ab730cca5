"""Runs the analyses of an experiment, and reports them as sentences, tables and charts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import fmean, median

from leafcut.errors import OptionError, count_of
from leafcut.lab import charts, message_costs
from leafcut.lab.description import TIMES, WALL, Analysis, Factor, Response
from leafcut.lab.results import (
    MAX_CHARTS,
    ReportBlock,
    Results,
    Table,
    five_digits,
    five_digits_or_dash,
    p_value_words,
    variant_name,
)
from leafcut.lab.statistics import (
    MIN_OF_PAIRS,
    OneWay,
    Pair,
    bootstrap_interval,
    compare_ranks,
    one_way_anova,
    pareto_front,
    trend_test,
    two_way_anova,
)
from leafcut.options import FireflyOptions
from leafcut.order.literature.flight import Flight

#: Results of a cell count as equal if they differ by less than this relative amount.
_EQUAL_SHARE = 1e-3
#: Value of β₀ and values of γ in the chart of attractiveness (figure 3 of the paper on fireflies for pockets).
_PLOTTED_BETA, _PLOTTED_GAMMAS = 10.0, (0.010, 0.012, 0.014, 0.015, 0.016, 0.018)
#: Number of points of the tours in this chart.
_PLACES = 100


def comparison_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Compare the levels of a factor by their ranks over all instances, and by their savings over the base level."""
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    by_cell = results.values_by_level(response.name, factor.name)
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
    against = [_table_of_differences(results, analysis, response, factor.title, sentences)] if has_reference else []
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
            f"χ² = {five_digits(ranking.statistic or 0.0)}, "
            f"{p_value_words(ranking.p)}, agreement W = {ranking.kendall_w:.2f}."
        )
    ranks = sorted(ranking.mean_ranks.items(), key=lambda item: item[1], reverse=response.more_is_better)
    for pair in ranking.pairs:
        if pair.p < analysis.alpha and len(ranking.pairs) <= 3:
            better = pair.first if (pair.difference < 0) != response.more_is_better else pair.second
            sentences.append(
                f"{pair.first} against {pair.second}: {better} is better, {p_value_words(pair.p)}, "
                f"effect {pair.effect:+.2f}."
            )
    tables = [
        *against,
        Table((factor.title, "Mean rank of its figures"), tuple((name, f"{rank:.2f}") for name, rank in ranks)),
        _pair_difference_table(factor.title, ranking.pairs, response),
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


def _table_of_differences(
    results: Results, analysis: Analysis, response: Response, title: str, sentences: list[str]
) -> Table:
    """Tabulate the differences from the base level or a known value, and add the mean savings to `sentences`."""
    base_name = analysis.base or analysis.fact
    known = {instance.name: instance.facts.get(analysis.fact, 0.0) for instance in results.description.instances}
    levels = [level.name for level in results.description.factor(analysis.factors[0]).levels]
    compared_levels = [name for name in levels if name != analysis.base]
    rows, saved = [], {name: list[float]() for name in compared_levels}
    for rest, groups in results.values_by_level(response.name, analysis.factors[0]).items():
        base = known[rest[0]] if analysis.fact else fmean(groups.get(analysis.base, [0.0]))
        cells = []
        for name in compared_levels:
            if name not in groups or not base:
                cells.append(five_digits(fmean(groups[name])) if name in groups else "–")
                continue
            change = 100.0 * (fmean(groups[name]) / base - 1.0)
            saved[name].append(change)
            cells.append(f"{five_digits(fmean(groups[name]))} ({change:+.2f} %)")
        rows.append((", ".join(rest), five_digits(base) if base else "–", *cells))
    for name, changes in saved.items():
        if not changes:
            continue
        low, high = bootstrap_interval(changes)
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


def _pair_difference_table(title: str, pairs: Sequence[Pair], response: Response) -> Table:
    rows = [
        (
            f"{pair.first} – {pair.second}",
            five_digits(pair.difference),
            "–" if pair.low is None or pair.high is None else f"{five_digits(pair.low)} to {five_digits(pair.high)}",
            p_value_words(pair.p, ""),
            f"{pair.effect or 0.0:+.2f}",
        )
        for pair in pairs
    ]
    unit = f", {response.unit}" if response.unit else ""
    return Table(
        (title, f"Median difference{unit}", "95 % interval", "p (Wilcoxon, Holm)", "Effect (rank-biserial)"),
        tuple(rows),
    )


def blocks_of_all_analyses(results: Results) -> list[ReportBlock]:
    """Return one report block for each analysis. If an analysis has too few results, its block states this."""
    blocks = []
    for analysis in results.description.analyses:
        response = results.description.response(analysis.response)
        try:
            blocks.append(
                _JUDGES[analysis.kind](_only_first_thread_count(results, analysis, response), analysis, response)
            )
        except OptionError as problem:
            blocks.append(ReportBlock(f"{_TITLES[analysis.kind]}: {response.title}", (f"Not done: {problem}.",)))
    return blocks


def _only_first_thread_count(results: Results, analysis: Analysis, response: Response) -> Results:
    """Keep only the runs with the first number of threads, unless the analysis compares threads or times.

    The number of threads affects how long a search takes, but not its result.
    """
    cores = results.description.cores
    if not cores or cores in analysis.factors or response.path in TIMES:
        return results
    first = results.description.factor(cores).levels[0].name
    return replace(results, rows=tuple(row for row in results.rows if row.levels[cores] == first))


def _one_way_anova_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    sentences: list[str] = []
    tables: list[Table] = []
    drawn: list[tuple[str, str]] = []
    for rest, groups in results.values_by_level(response.name, factor.name).items():
        name = ", ".join(rest)
        anova = one_way_anova(groups, analysis.alpha)
        sentences += _anova_sentences(name, factor.title, anova)
        best = sorted(anova.means, key=anova.means.__getitem__, reverse=response.more_is_better)
        rows = [
            (
                level,
                str(anova.counts[level]),
                str(results.missing_count(anova.counts[level])),
                five_digits(anova.means[level]),
                five_digits(anova.deviations[level]),
                anova.fisher_letters[level],
                anova.letters[level],
            )
            for level in best
        ]
        columns = (
            factor.title, "Runs", "Missing", f"{response.heading}: mean", "s", "Letters (LSD)", "Letters (Tukey)",
        )  # fmt: skip
        tables.append(Table(columns, tuple(rows), 1, name))
        tables.append(_pair_table(f"{name}: every two levels", anova.fisher, anova.tukey, analysis.alpha))
        if len(drawn) < MAX_CHARTS:
            drawn.append((name, _group_chart(groups, factor.numeric, factor.title, response, name)))
    return ReportBlock(
        f"{_TITLES['anova']} of {factor.title.lower()}: {response.title.lower()}",
        tuple(sentences),
        tuple(tables),
        tuple(drawn),
    )


def _anova_sentences(name: str, factor: str, anova: OneWay) -> list[str]:
    proved = anova.p < anova.alpha
    sentences = [
        f"{name}: F = {five_digits(anova.f)} ({anova.between} and {anova.within} degrees of freedom; critical "
        f"{five_digits(anova.f_critical)} at α = {anova.alpha:g}), {p_value_words(anova.p)}: "
        f"{'an effect' if proved else 'no effect can be proved from these runs'} of the factor '{factor.lower()}'. "
        f"It explains η² = {100 * anova.eta_squared:.0f} % of the variance (ω² = {100 * anova.omega_squared:.0f} %)."
    ]
    if anova.lsd is not None:
        sentences[0] += f" Least significant difference: {five_digits(anova.lsd)}."
    checks = [
        f"{test} {p_value_words(p)}"
        for test, p in (("Shapiro–Wilk", anova.normal_p), ("Brown–Forsythe", anova.equal_p))
        if p is not None
    ]
    if anova.residuals_doubtful:
        alternatives = [
            f"{test} {p_value_words(p)}"
            for test, p in (("Welch", anova.welch_p), ("Kruskal–Wallis", anova.kruskal_p))
            if p is not None
        ]
        sentences.append(
            f"{name}: the residuals contradict the assumptions of the analysis ({', '.join(checks)}). "
            f"Tests without this assumption: {', '.join(alternatives)}."
        )
    elif checks:
        sentences.append(f"{name}: the residuals agree with the assumptions of the analysis ({', '.join(checks)}).")
    return sentences


def _two_way_anova_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    first, second = (results.description.factor(name) for name in analysis.factors)
    places = [1 + [f.name for f in results.description.factors].index(f.name) for f in (first, second)]
    figures = results.values_by_cell(response.name)
    deterministic = all(max(values) - min(values) <= _EQUAL_SHARE * abs(max(values)) for values in figures.values())
    blocked = deterministic and len({cell[0] for cell in figures}) > 1
    by_name: dict[str, list[tuple[str, str, float]]] = {}
    blocks: dict[str, list[str]] = {}
    for cell, values in figures.items():
        rest = [word for k, word in enumerate(cell) if k not in places]
        name = ", ".join(["all instances", *rest[1:]] if blocked else rest)
        counted = [fmean(values)] if deterministic else values
        by_name.setdefault(name, []).extend((cell[places[0]], cell[places[1]], value) for value in counted)
        blocks.setdefault(name, []).extend([cell[0]] * len(counted))
    sentences: list[str] = []
    tables: list[Table] = []
    drawn: list[tuple[str, str]] = []
    if deterministic:
        sentences.append(
            "The runs of a cell agree within 0.1 %, so chance has no influence, and each cell counts once."
        )
    if blocked:
        sentences.append(
            "Each instance is a block with its own degrees of freedom. The analysis takes logarithms, because effects "
            "are proportional to the size of the instance."
        )
    for name, rows in by_name.items():
        effects = two_way_anova(rows, (first.title, second.title))
        if blocked:
            if min(y for _, _, y in rows) <= 0.0:
                raise OptionError("an analysis over several instances uses logarithms, but a value is not positive")
            zero = any(e.zero for e in effects)
            logs = [(a, b, math.log(y)) for a, b, y in rows]
            effects = tuple(
                replace(e, squares=0.0, f=None, p=None, eta_squared=None, zero=True) if zero and "×" in e.name else e
                for e in two_way_anova(logs, (first.title, second.title), blocks[name])
            )
        effects_text = [f"{e.name} {p_value_words(e.p)}" for e in effects if e.p is not None]
        sentences.append(
            f"{name}: {'; '.join(effects_text)}."
            if effects_text
            else f"{name}: all runs of a cell are equal, so chance has no influence."
        )
        sentences += [
            f"{name}: {e.name} is zero by construction (the model of the machine adds the two), so it is not tested."
            for e in effects
            if e.zero
        ]
        tables.append(
            Table(
                ("Effect", "Sum of squares", "Degrees of freedom", "F", "p", "Partial η²"),
                tuple(
                    (
                        e.name,
                        five_digits(e.squares),
                        f"{e.freedom:g}",
                        five_digits_or_dash(e.f),
                        "–" if e.p is None else p_value_words(e.p, ""),
                        five_digits_or_dash(e.eta_squared),
                    )
                    for e in effects
                ),
                1,
                name,
            )
        )
        means = {(a, b): fmean(y for x, z, y in rows if (x, z) == (a, b)) for a, b, _ in rows}
        tables.append(
            Table(
                (first.title, *(level.name for level in second.levels)),
                tuple((a.name, *(five_digits(means[a.name, b.name]) for b in second.levels)) for a in first.levels),
                1,
                f"{name}: means, {response.unit}",
            )
        )
        series = {
            f"{second.title}: {b.name}": [
                (
                    k if a.value is None else a.value,
                    means[a.name, b.name],
                    *bootstrap_interval([y for x, z, y in rows if (x, z) == (a.name, b.name)]),
                )
                for k, a in enumerate(first.levels)
            ]
            for b in second.levels
        }
        if len(drawn) < MAX_CHARTS:
            label = f"{response.title} over {first.title.lower()}, a line for each {second.title.lower()}: {name}"
            drawn.append((name, charts.chart_of_means(series, _levels_words(first), response.heading, label)))
    return ReportBlock(f"{_TITLES['crossed']}: {response.title.lower()}", tuple(sentences), tuple(tables), tuple(drawn))


def _levels_words(factor: Factor) -> str:
    if factor.numeric:
        return factor.title
    return f"{factor.title} ({', '.join(f'{k} = {level.name}' for k, level in enumerate(factor.levels))})"


def _speedup_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    numbers = {level.name: level.value or 0.0 for level in factor.levels}
    rows, series = [], {}
    for rest, groups in results.values_by_level(response.name, factor.name).items():
        single = next((values for name, values in groups.items() if numbers[name] == 1.0), None)
        if single is None:
            raise OptionError("a speed-up needs runs on one thread")
        points = []
        for name, values in groups.items():
            ratios = [fmean(single) / value for value in values]
            low, high = bootstrap_interval(ratios)
            speed = fmean(single) / fmean(values)
            points.append((numbers[name], speed, min(low, speed), max(high, speed)))
            rows.append(
                (*rest, name, five_digits(fmean(values)), f"{speed:.2f}", f"{100 * speed / numbers[name]:.0f} %")
            )
        series[", ".join(rest)] = points
    max_threads = max(
        numbers[name] for groups in results.values_by_level(response.name, factor.name).values() for name in groups
    )
    others = [item.title for item in results.description.factors if item.name != factor.name]
    columns = ("Instance", *others, factor.title, f"{response.heading}: mean", "Speed-up S", "Efficiency E")
    start = (
        " The time includes the start of a process."
        if response.path == WALL and results.description.new_process
        else ""
    )
    sentences = (f"S = T(1) / T(p), E = S / p; the ideal is S = p.{start}",)
    drawn = [
        (
            "",
            charts.chart_of_means(
                series,
                factor.title,
                "speed-up",
                f"Speed-up over {factor.title.lower()}",
                [(1, 1), (max_threads, max_threads)],
            ),
        )
    ]
    tables = (Table(columns, tuple(rows), 1 + len(others) + 1),)
    return ReportBlock(_TITLES["speedup"], sentences, tables, tuple(drawn) if max_threads > 1 else ())


def _trend_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Report the gain over the level `base` for each instance, and whether larger instances gain more."""
    description = results.description
    sizes = {entry.name: entry.facts["size"] for entry in description.instances if "size" in entry.facts}
    factor = description.factor(analysis.factors[0])
    rows = []
    gains: dict[str, list[tuple[str, float, float]]] = {}
    for rest, groups in results.values_by_level(response.name, factor.name).items():
        if analysis.base not in groups or rest[0] not in sizes:
            continue
        base = fmean(groups[analysis.base])
        for name, values in groups.items():
            if name != analysis.base and base:
                gain = round(100.0 * (fmean(values) / base - 1.0) * (1 if response.more_is_better else -1), 9) + 0.0
                gains.setdefault(name, []).append((rest[0], sizes[rest[0]], gain))
                rows.append(
                    (
                        ", ".join(rest),
                        f"{sizes[rest[0]]:g}",
                        name,
                        five_digits(base),
                        five_digits(fmean(values)),
                        f"{gain:.2f} %",
                    )
                )
    # Each instance counts once, because its gains are not independent of each other.
    for name, points in gains.items():
        by_instance: dict[str, list[float]] = {}
        for instance, _, gain in points:
            by_instance.setdefault(instance, []).append(gain)
        gains[name] = [(instance, sizes[instance], fmean(own_gains)) for instance, own_gains in by_instance.items()]
    sentences = []
    for name, points in gains.items():
        for excluded, kept in (
            ("", points),
            (f" without {', '.join(analysis.without)}", [p for p in points if p[0] not in analysis.without]),
        ):
            if excluded and len(kept) == len(points):
                continue
            sentence = f"{name} over {analysis.base}{excluded}: mean gain {fmean(p[2] for p in kept):.2f} %"
            sentences.append(
                f"{sentence}; {_trend_sentence([p[1] for p in kept], [p[2] for p in kept], analysis.alpha)}."
            )
    if not gains:
        raise OptionError("a trend needs facts.size of the instances, and runs of the base level")
    columns = ("Instance", "Size", factor.title, f"{response.heading}: {analysis.base}", "of this level", "Gain")
    series = {name: [(x, y) for _, x, y in points] for name, points in gains.items()}
    drawn = [
        ("", charts.scatter_chart(series, "size", "gain, %", f"Gain over {analysis.base} by the size of the instance"))
    ]
    return ReportBlock(
        f"{response.title}: gain over {analysis.base}, and its trend",
        tuple(sentences),
        (Table(columns, tuple(rows), 3),),
        tuple(drawn),
    )


def _trend_sentence(sizes: Sequence[float], gains: Sequence[float], alpha: float) -> str:
    try:
        line = trend_test(sizes, gains, alpha)
    except OptionError as problem:
        return str(problem)
    proved = "shows no trend that can be proved from these instances"
    if line.tau_p < alpha:
        proved = f"{'grows' if line.tau > 0 else 'falls'} with the size"
    return (
        f"it {proved} (Kendall τ = {line.tau:.2f}, {p_value_words(line.tau_p)}; {line.slope:+.4f} percentage points "
        f"for each more, {line.low:+.4f} to {line.high:+.4f}; n = {line.n})"
    )


def _batch_projection_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    rows = []
    for rest, groups in results.values_by_level(response.name, factor.name).items():
        for name, values in groups.items():
            if name == analysis.base or analysis.base not in groups:
                continue
            base, other = fmean(groups[analysis.base]), fmean(values)
            for boards in analysis.boards or (1,):
                saved = boards * (base - other)
                percent = f"{100.0 * (1.0 - other / base):.2f} %" if base else "–"
                rows.append(
                    (
                        ", ".join(rest),
                        name,
                        str(boards),
                        five_digits(boards * base),
                        five_digits(boards * other),
                        five_digits(saved),
                        percent,
                    )
                )
    if not rows:
        raise OptionError(f"a projection needs runs of '{analysis.base}' and of another level")
    unit = f", {response.unit}" if response.unit else ""
    columns = (
        "Instance",
        factor.title,
        "Pieces",
        f"{analysis.base}{unit}",
        f"of this level{unit}",
        f"Saved{unit}",
        "Saved, %",
    )
    sentences = (
        "The projected time is the time of one workpiece, multiplied by their number. It does not include set-up and "
        "loading.",
    )
    return ReportBlock(
        f"{_TITLES['projection']}: {response.title.lower()}", sentences, (Table(columns, tuple(rows), 2),)
    )


def _pareto_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    description = results.description
    second = description.response(
        analysis.against or next(figure.name for figure in description.responses if figure.name != response.name)
    )
    drawn, sentences = [], []
    x_all, y_all = results.values_by_cell(second.name), results.values_by_cell(response.name)
    for instance in results.description.instances[:MAX_CHARTS]:
        points = {
            variant_name(results.description, cell): (fmean(x_all[cell]), fmean(values))
            for cell, values in y_all.items()
            if cell[0] == instance.name and cell in x_all
        }
        if len(points) < 2:
            continue
        signs = [-1.0 if item.more_is_better else 1.0 for item in (second, response)]
        costs = [(signs[0] * x, signs[1] * y) for x, y in points.values()]
        front = [list(points)[k] for k in pareto_front(costs)]
        sentences.append(f"{instance.name}: no variant is better than {', '.join(front)} in both responses.")
        label = f"{response.title} against {second.title.lower()} on {instance.name}"
        drawn.append((instance.name, charts.pareto_chart(points, front, second.heading, response.heading, label)))
    if not drawn:
        raise OptionError("a Pareto plot needs two methods with both figures")
    return ReportBlock(f"{response.title} against {second.title.lower()}", tuple(sentences), (), tuple(drawn))


def _firefly_attraction_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Plot the attractiveness β against the distance r between two fireflies, as in figure 3 of the paper."""
    flight = Flight.from_options(FireflyOptions(attractiveness=_PLOTTED_BETA), limited=True)
    series = {
        f"γ = {gamma:.3f}": [
            (10.0 * apart / _PLACES, replace(flight, absorption=gamma).attraction(apart, _PLACES))
            for apart in range(_PLACES + 1)
        ]
        for gamma in _PLOTTED_GAMMAS
    }
    half = [math.sqrt(math.log(2.0) / gamma) for gamma in (_PLOTTED_GAMMAS[0], _PLOTTED_GAMMAS[-1])]
    sentence = (
        f"β = β₀·exp(−γ·r²) with β₀ = {_PLOTTED_BETA:g}; r is 0 for equal tours and 10 for tours that differ "
        f"everywhere. β is halved at r = {half[0]:.2f} with γ = {_PLOTTED_GAMMAS[0]:.3f}, and at r = {half[1]:.2f} "
        f"with γ = {_PLOTTED_GAMMAS[-1]:.3f}."
    )
    title = "Attractiveness β over the distance r"
    return ReportBlock(
        title, (sentence,), (), (("", charts.line_chart(series, "distance r", "attractiveness β", title)),)
    )


def _group_chart(
    groups: Mapping[str, Sequence[float]], numeric: bool, factor: str, response: Response, name: str
) -> str:
    if numeric:
        points = [(float(level), fmean(values), *bootstrap_interval(values)) for level, values in groups.items()]
        return charts.chart_of_means(
            {"mean": points}, factor, response.heading, f"Mean {response.title.lower()} over {factor.lower()}: {name}"
        )
    return charts.box_plots(groups, response.heading, f"{response.title} by {factor.lower()}: {name}")


def _pair_table(name: str, fisher: Sequence[Pair], tukey: Sequence[Pair], alpha: float) -> Table:
    rows = [
        (
            f"{a.first} – {a.second}",
            five_digits(a.difference),
            p_value_words(a.p, ""),
            p_value_words(b.p, ""),
            f"{five_digits(b.low or 0.0)} to {five_digits(b.high or 0.0)}",
            "yes" if b.p < alpha else "no",
        )
        for a, b in zip(fisher, tukey, strict=True)
    ]
    columns = (
        "Levels",
        "Difference",
        "p (LSD)",
        "p (Tukey)",
        f"{100 * (1 - alpha):g} % interval (Tukey)",
        "Differ",
    )
    return Table(columns, tuple(rows), 1, name)


_TITLES = {
    "anova": "Analysis of variance",
    "crossed": "Two factors crossed",
    "compare": "Comparison",
    "speedup": "Speed-up and efficiency",
    "messages": "Speed-up over one thread, and the cost of messages",
    "trend": "Gain and its trend",
    "pareto": "Two figures at once",
    "projection": "Projection to several workpieces",
    "attraction": "Attractiveness",
}
_JUDGES = {
    "anova": _one_way_anova_block,
    "crossed": _two_way_anova_block,
    "compare": comparison_block,
    "speedup": _speedup_block,
    "messages": message_costs.message_costs_block,
    "trend": _trend_block,
    "pareto": _pareto_block,
    "projection": _batch_projection_block,
    "attraction": _firefly_attraction_block,
}
