"""Evaluate an experiment: each analysis of its description as sentences, tables and charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import fmean

from leafcut.errors import OptionError
from leafcut.lab import charts, comparing
from leafcut.lab.description import TIMES, Analysis, Response
from leafcut.lab.results import MOST_CHARTS, ReportBlock, Results, Table, number, or_dash, p_words, way_of
from leafcut.lab.statistics import OneWay, Pair, crossed, interval, one_way, pareto_front, trend

#: Relative tolerance for equal figures of a cell.
_ALIKE = 1e-3


def judged(results: Results) -> list[ReportBlock]:
    """Return a block for each analysis, or the reason why it cannot be done yet."""
    blocks = []
    for analysis in results.description.analyses:
        response = results.description.response(analysis.response)
        try:
            blocks.append(_JUDGES[analysis.kind](_once(results, analysis, response), analysis, response))
        except OptionError as problem:
            blocks.append(ReportBlock(f"{_TITLES[analysis.kind]}: {response.title}", (f"Not done: {problem}.",)))
    return blocks


def _once(results: Results, analysis: Analysis, response: Response) -> Results:
    """Drop runs that only repeat others: threads change the time of a search, not its result."""
    cores = results.description.cores
    if not cores or cores in analysis.factors or response.path in TIMES:
        return results
    first = results.description.factor(cores).levels[0].name
    return replace(results, rows=tuple(row for row in results.rows if row.levels[cores] == first))


def _anova(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    words: list[str] = []
    tables: list[Table] = []
    drawn: list[tuple[str, str]] = []
    for rest, groups in results.groups(response.name, factor.name).items():
        name = ", ".join(rest)
        found = one_way(groups, analysis.alpha)
        words += _of_one_way(name, factor.title, found)
        best = sorted(found.means, key=found.means.__getitem__, reverse=response.more_is_better)
        rows = [
            (
                level,
                str(found.counts[level]),
                number(found.means[level]),
                number(found.deviations[level]),
                found.letters[level],
            )
            for level in best
        ]
        tables.append(
            Table((factor.title, "Runs", f"{response.heading}: mean", "s", "Letters (Tukey)"), tuple(rows), 1, name)
        )
        tables.append(_pairs(f"{name}: every two levels", found.fisher, found.tukey, analysis.alpha))
        if len(drawn) < MOST_CHARTS:
            drawn.append((name, _chart_of(groups, factor.numeric, factor.title, response, name)))
    return ReportBlock(
        f"{_TITLES['anova']} of {factor.title.lower()}: {response.title.lower()}",
        tuple(words),
        tuple(tables),
        tuple(drawn),
    )


def _of_one_way(name: str, factor: str, found: OneWay) -> list[str]:
    proved = found.p < found.alpha
    words = [
        f"{name}: F = {number(found.f)} ({found.between} and {found.within} degrees of freedom; critical "
        f"{number(found.f_critical)} at α = {found.alpha:g}), {p_words(found.p)}: {factor.lower()} "
        f"{'makes a difference' if proved else 'makes no difference that these runs can prove'}. "
        f"It explains η² = {100 * found.eta_squared:.0f} % of the variance (ω² = {100 * found.omega_squared:.0f} %)."
    ]
    if found.lsd is not None:
        words[0] += f" Least significant difference: {number(found.lsd)}."
    checks = [
        f"{test} {p_words(p)}"
        for test, p in (("Shapiro–Wilk", found.normal_p), ("Brown–Forsythe", found.equal_p))
        if p is not None
    ]
    if found.residuals_doubtful:
        others = [
            f"{test} {p_words(p)}"
            for test, p in (("Welch", found.welch_p), ("Kruskal–Wallis", found.kruskal_p))
            if p is not None
        ]
        words.append(
            f"{name}: the residuals do not look as the analysis assumes ({', '.join(checks)}). Tests that do not "
            f"assume it: {', '.join(others)}."
        )
    elif checks:
        words.append(f"{name}: the residuals look as the analysis assumes ({', '.join(checks)}).")
    return words


def _crossed(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    one, two = (results.description.factor(name) for name in analysis.factors)
    places = [1 + [f.name for f in results.description.factors].index(f.name) for f in (one, two)]
    figures = results.figures(response.name)
    alike = all(max(values) - min(values) <= _ALIKE * abs(max(values)) for values in figures.values())
    together = alike and len({cell[0] for cell in figures}) > 1
    by: dict[str, list[tuple[str, str, float]]] = {}
    for cell, values in figures.items():
        rest = [word for k, word in enumerate(cell) if k not in places]
        name = ", ".join(["all instances", *rest[1:]] if together else rest)
        mine = [
            fmean(many) for other, many in figures.items()
            if [word for k, word in enumerate(other) if k not in places] == rest
        ]  # fmt: skip
        counted = [100.0 * fmean(values) / fmean(mine)] if together else [fmean(values)] if alike else values
        by.setdefault(name, []).extend((cell[places[0]], cell[places[1]], v) for v in counted)
    words: list[str] = []
    tables: list[Table] = []
    drawn: list[tuple[str, str]] = []
    if alike:
        words.append("All runs of a cell agree within 0.1 %: there is no chance in a cell, and it counts once.")
    if together:
        words.append(
            "Each instance is one repetition, in percent of its mean over all cells, as instances differ in size."
        )
    for name, rows in by.items():
        effects = crossed(rows, (one.title, two.title))
        told = [f"{e.name} {p_words(e.p)}" for e in effects if e.p is not None]
        words.append(
            f"{name}: {'; '.join(told)}." if told else f"{name}: every run of a cell is equal; no chance is in it."
        )
        tables.append(
            Table(
                ("Effect", "Sum of squares", "Degrees of freedom", "F", "p", "Partial η²"),
                tuple(
                    (
                        e.name,
                        number(e.squares),
                        f"{e.freedom:g}",
                        or_dash(e.f),
                        "–" if e.p is None else p_words(e.p, ""),
                        or_dash(e.eta_squared),
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
                (one.title, *(level.name for level in two.levels)),
                tuple((a.name, *(number(means[a.name, b.name]) for b in two.levels)) for a in one.levels),
                1,
                f"{name}: means" + (", percent of the instance's mean" if together else f", {response.unit}"),
            )
        )
        unit = "% of the mean" if together else response.heading
        series = {
            f"{two.title}: {b.name}": [
                (
                    k if a.value is None else a.value,
                    means[a.name, b.name],
                    *interval([y for x, z, y in rows if (x, z) == (a.name, b.name)]),
                )
                for k, a in enumerate(one.levels)
            ]
            for b in two.levels
        }
        if len(drawn) < MOST_CHARTS:
            label = f"{response.title} over {one.title.lower()}, a line for each {two.title.lower()}: {name}"
            drawn.append((name, charts.means(series, _levels_words(one.title, one), unit, label)))
    return ReportBlock(f"{_TITLES['crossed']}: {response.title.lower()}", tuple(words), tuple(tables), tuple(drawn))


def _levels_words(name: str, factor: object) -> str:
    levels = getattr(factor, "levels", ())
    if getattr(factor, "numeric", False):
        return name
    return f"{name} ({', '.join(f'{k} = {level.name}' for k, level in enumerate(levels))})"


def _speedup(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    numbers = {level.name: level.value or 0.0 for level in factor.levels}
    rows, series = [], {}
    for rest, groups in results.groups(response.name, factor.name).items():
        one = next((values for name, values in groups.items() if numbers[name] == 1.0), None)
        if one is None:
            raise OptionError("a speed-up needs runs on one thread")
        points = []
        for name, values in groups.items():
            ratios = [fmean(one) / value for value in values]
            low, high = interval(ratios)
            speed = fmean(one) / fmean(values)
            points.append((numbers[name], speed, min(low, speed), max(high, speed)))
            rows.append((*rest, name, number(fmean(values)), f"{speed:.2f}", f"{100 * speed / numbers[name]:.0f} %"))
        series[", ".join(rest)] = points
    most = max(numbers[name] for groups in results.groups(response.name, factor.name).values() for name in groups)
    others = [one.title for one in results.description.factors if one.name != factor.name]
    columns = ("Instance", *others, factor.title, f"{response.heading}: mean", "Speed-up S", "Efficiency E")
    words = (
        "S = T(1) / T(p), E = S / p; the ideal is S = p. Where each run is a process of its own, its start counts.",
    )
    drawn = [
        (
            "",
            charts.means(
                series, factor.title, "speed-up", f"Speed-up over {factor.title.lower()}", [(1, 1), (most, most)]
            ),
        )
    ]
    tables = (Table(columns, tuple(rows), 1 + len(others) + 1),)
    return ReportBlock(_TITLES["speedup"], words, tables, tuple(drawn) if most > 1 else ())


def _trend(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Report whether a figure, or the gain over the level `base`, grows with the size of the instance."""
    of = results.description
    sizes = {one.name: one.facts["size"] for one in of.instances if "size" in one.facts}
    factor = of.factor(analysis.factors[0])
    rows = []
    gains: dict[str, list[tuple[str, float, float]]] = {}
    for rest, groups in results.groups(response.name, factor.name).items():
        if analysis.base not in groups or rest[0] not in sizes:
            continue
        base = fmean(groups[analysis.base])
        for name, values in groups.items():
            if name != analysis.base and base:
                gain = round(100.0 * (fmean(values) / base - 1.0) * (1 if response.more_is_better else -1), 9) + 0.0
                gains.setdefault(name, []).append((rest[0], sizes[rest[0]], gain))
                rows.append(
                    (rest[0], f"{sizes[rest[0]]:g}", name, number(base), number(fmean(values)), f"{gain:.2f} %")
                )
    # An instance counts once, whatever else varies: its gains are not independent of each other.
    for name, points in gains.items():
        of_one: dict[str, list[float]] = {}
        for instance, _, gain in points:
            of_one.setdefault(instance, []).append(gain)
        gains[name] = [(instance, sizes[instance], fmean(many)) for instance, many in of_one.items()]
    words = []
    for name, points in gains.items():
        for left, kept in (
            ("", points),
            (f" without {', '.join(analysis.without)}", [p for p in points if p[0] not in analysis.without]),
        ):
            if left and len(kept) == len(points):
                continue
            told = f"{name} over {analysis.base}{left}: mean gain {fmean(p[2] for p in kept):.2f} %"
            words.append(f"{told}; {_trend_words([p[1] for p in kept], [p[2] for p in kept], analysis.alpha)}.")
    if not gains:
        raise OptionError("a trend needs facts.size of the instances, and runs of the base level")
    columns = ("Instance", "Size", factor.title, f"{response.heading}, {analysis.base}", "This way", "Gain")
    series = {name: [(x, y) for _, x, y in points] for name, points in gains.items()}
    drawn = [("", charts.scatter(series, "size", "gain, %", f"Gain over {analysis.base} by the size of the instance"))]
    return ReportBlock(
        f"Gain over {analysis.base}, and its trend", tuple(words), (Table(columns, tuple(rows), 3),), tuple(drawn)
    )


def _trend_words(sizes: Sequence[float], gains: Sequence[float], alpha: float) -> str:
    try:
        found = trend(sizes, gains, alpha)
    except OptionError as problem:
        return str(problem)
    proved = "shows no trend that these instances can prove"
    if found.tau_p < alpha:
        proved = f"{'grows' if found.tau > 0 else 'falls'} with the size"
    return (
        f"it {proved} (Kendall τ = {found.tau:.2f}, {p_words(found.tau_p)}; {found.slope:+.4f} percentage points for "
        f"each more, {found.low:+.4f} to {found.high:+.4f}; n = {found.n})"
    )


def _projection(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Multiply the saving per piece by the batch size; nothing else changes between pieces."""
    (factor,) = (results.description.factor(name) for name in analysis.factors)
    rows = []
    for rest, groups in results.groups(response.name, factor.name).items():
        for name, values in groups.items():
            if name == analysis.base or analysis.base not in groups:
                continue
            base, this = fmean(groups[analysis.base]), fmean(values)
            for boards in analysis.boards or (1,):
                saved = boards * (base - this)
                percent = f"{100.0 * (1.0 - this / base):.2f} %" if base else "–"
                rows.append(
                    (
                        ", ".join(rest),
                        name,
                        str(boards),
                        number(boards * base),
                        number(boards * this),
                        number(saved),
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
        f"This way{unit}",
        f"Saved{unit}",
        "Saved, %",
    )
    words = ("Projected: the time of one piece, times the pieces. Set-up and loading are not in it.",)
    return ReportBlock(f"{_TITLES['projection']}: {response.title.lower()}", words, (Table(columns, tuple(rows), 2),))


def _pareto(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    of = results.description
    other = of.response(analysis.against or next(one.name for one in of.responses if one.name != response.name))
    drawn, words = [], []
    x_all, y_all = results.figures(other.name), results.figures(response.name)
    for instance in results.description.instances[:MOST_CHARTS]:
        points = {
            way_of(results.description, cell): (fmean(x_all[cell]), fmean(values))
            for cell, values in y_all.items()
            if cell[0] == instance.name and cell in x_all
        }
        if len(points) < 2:
            continue
        signs = [-1.0 if one.more_is_better else 1.0 for one in (other, response)]
        at = [(signs[0] * x, signs[1] * y) for x, y in points.values()]
        front = [list(points)[k] for k in pareto_front(at)]
        words.append(f"{instance.name}: nothing beats {', '.join(front)} in both.")
        label = f"{response.title} against {other.title.lower()} on {instance.name}"
        drawn.append((instance.name, charts.pareto(points, front, other.heading, response.heading, label)))
    if not drawn:
        raise OptionError("a Pareto plot needs two methods with both figures")
    return ReportBlock(f"{response.title} against {other.title.lower()}", tuple(words), (), tuple(drawn))


def _chart_of(groups: Mapping[str, Sequence[float]], numeric: bool, factor: str, response: Response, name: str) -> str:
    if numeric:
        points = [(float(level), fmean(values), *interval(values)) for level, values in groups.items()]
        return charts.means(
            {"mean": points}, factor, response.heading, f"Mean {response.title.lower()} over {factor.lower()}: {name}"
        )
    return charts.box_plots(groups, response.heading, f"{response.title} by {factor.lower()}: {name}")


def _pairs(name: str, fisher: Sequence[Pair], tukey: Sequence[Pair], alpha: float) -> Table:
    rows = [
        (f"{a.first} – {a.second}", number(a.difference), p_words(a.p, ""), p_words(b.p, ""),
         f"{number(b.low or 0.0)} to {number(b.high or 0.0)}",
         "yes" if b.p < alpha else "no")
        for a, b in zip(fisher, tukey, strict=True)
    ]  # fmt: skip
    columns = ("Levels", "Difference", "p (LSD)", "p (Tukey)", f"{100 * (1 - alpha):g} % interval (Tukey)", "Differ")
    return Table(columns, tuple(rows), 1, name)


_TITLES = {
    "anova": "Analysis of variance",
    "crossed": "Two factors crossed",
    "compare": comparing.TITLE,
    "speedup": "Speed-up and efficiency",
    "trend": "Gain and its trend",
    "pareto": "Two figures at once",
    "projection": "Projection to several pieces",
}
_JUDGES = {
    "anova": _anova,
    "crossed": _crossed,
    "compare": comparing.compared,
    "speedup": _speedup,
    "trend": _trend,
    "pareto": _pareto,
    "projection": _projection,
}
