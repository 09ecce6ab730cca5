"""Statistical tests for experiments: analysis of variance, rank comparisons, and trends.

The tests use scipy, statsmodels and scikit-posthocs. Values may have any unit, and the names of the levels identify the
groups. No test depends on whether smaller values are better.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError

Groups = Mapping[str, Sequence[float]]

#: Minimum number of values per group for a variance, and minimum number of blocks for a rank comparison.
MIN_OF_A_GROUP, MIN_OF_PAIRS = 2, 5
_RESAMPLES = 5000
#: An interaction counts as a rounding error if its share of the total sum of squares is below this value.
_ZERO_SHARE = 1e-12


@dataclass(frozen=True)
class Pair:
    """A comparison of two groups.

    Attributes
    ----------
    difference
        Mean of the first group minus the mean of the second group. For ranks, this is the Hodges–Lehmann median.
    low, high
        Confidence interval of the difference at the level of the test, or None if it is not available.
    p
        Probability that a difference of this size or more occurs by chance. It is corrected for multiple comparisons if
        the test does so.
    effect
        Matched-pairs rank-biserial correlation from -1 to 1 for ranks, otherwise None.
    """

    first: str
    second: str
    difference: float
    p: float
    low: float | None = None
    high: float | None = None
    effect: float | None = None


@dataclass(frozen=True)
class OneWay:
    """The result of a one-way analysis of variance (completely randomised design).

    Attributes
    ----------
    f, p, f_critical
        Ratio of the mean squares between and within groups, its p value, and its critical value at `alpha`.
    lsd
        Fisher's least significant difference between two means at `alpha`, or None if the groups have different sizes.
    fisher, tukey
        Pairwise comparisons by LSD (uncorrected) and by Tukey's honestly significant difference.
    fisher_letters, letters
        Maps each level to its letters. Levels that share a letter do not differ by LSD or by Tukey's test.
    normal_p, equal_p
        Shapiro–Wilk test of the residuals and Brown–Forsythe test of the variances, or None if a test is not possible.
    welch_p, kruskal_p
        p values of tests that do not need equal variances (Welch) or that use ranks (Kruskal–Wallis).
    eta_squared, omega_squared
        Share of the variance that the factor explains, in the sample and estimated for the population.
    """

    means: Mapping[str, float]
    deviations: Mapping[str, float]
    counts: Mapping[str, int]
    f: float
    p: float
    f_critical: float
    between: int
    within: int
    alpha: float
    lsd: float | None
    fisher: tuple[Pair, ...]
    tukey: tuple[Pair, ...]
    fisher_letters: Mapping[str, str]
    letters: Mapping[str, str]
    normal_p: float | None
    equal_p: float | None
    welch_p: float | None
    kruskal_p: float | None
    eta_squared: float
    omega_squared: float

    @property
    def residuals_doubtful(self) -> bool:
        """Whether a check of the residuals fails at `alpha`. In this case, use `welch_p` or `kruskal_p`."""
        return any(p is not None and p < self.alpha for p in (self.normal_p, self.equal_p))


@dataclass(frozen=True)
class Effect:
    """A row of a two-way analysis of variance: sum of squares, degrees of freedom, F, p and partial η².

    `zero` marks an interaction that is zero by construction. It is not tested.
    """

    name: str
    squares: float
    freedom: float
    f: float | None
    p: float | None
    eta_squared: float | None
    zero: bool = False


@dataclass(frozen=True)
class RankComparison:
    """A comparison of treatments by rank. Each block contains every treatment.

    Attributes
    ----------
    mean_ranks
        Maps each treatment to its mean rank. Rank 1 is the smallest value.
    statistic, p, kendall_w
        Friedman's test, and Kendall's coefficient of concordance from 0 to 1. They are None for two treatments.
    """

    blocks: int
    mean_ranks: Mapping[str, float]
    statistic: float | None
    p: float | None
    kendall_w: float | None
    pairs: tuple[Pair, ...]


@dataclass(frozen=True)
class Trend:
    """The trend of one variable against another: Kendall's τ-b, and the Theil–Sen slope with its
    interval.
    """

    n: int
    tau: float
    tau_p: float
    slope: float
    low: float
    high: float


def one_way_anova(groups: Groups, alpha: float = 0.05) -> OneWay:
    """Perform a one-way analysis of variance, with pairwise comparisons and checks of the residuals.

    Source: Montgomery, *Design and Analysis of Experiments*, chapter 3 (F, LSD, Tukey, model adequacy).

    Raises
    ------
    OptionError
        There are fewer than two groups, a group has fewer than two values, or all values are equal.
    """
    import pandas
    from scipy import stats
    from statsmodels.formula.api import ols

    values = _checked_groups(groups)
    counts = {name: len(sample) for name, sample in values.items()}
    if np.ptp(np.concatenate(list(values.values()))) == 0.0:
        raise OptionError("all figures are equal; no analysis is possible")
    frame = pandas.DataFrame([(name, y) for name, sample in values.items() for y in sample], columns=["g", "y"])
    fit = ols("y ~ C(g)", data=frame).fit()
    between, within, ms_within = int(fit.df_model), int(fit.df_resid), float(fit.mse_resid)
    spread = any(np.ptp(sample) > 0.0 for sample in values.values())
    t = float(stats.t.ppf(1.0 - alpha / 2.0, within))
    fisher = _fisher_pairs(values, ms_within if spread else 0.0, within, t)
    tukey = _tukey_pairs(values, alpha, spread)
    return OneWay(
        means={name: float(sample.mean()) for name, sample in values.items()},
        deviations={name: float(sample.std(ddof=1)) for name, sample in values.items()},
        counts=counts,
        f=float(fit.fvalue) if spread else math.inf,
        p=float(fit.f_pvalue) if spread else 0.0,
        f_critical=float(stats.f.ppf(1.0 - alpha, between, within)),
        between=between,
        within=within,
        alpha=alpha,
        lsd=t * math.sqrt(2.0 * ms_within / max(counts.values())) if len(set(counts.values())) == 1 else None,
        fisher=fisher,
        tukey=tukey,
        fisher_letters=_letter_display(values, fisher, alpha),
        letters=_letter_display(values, tukey, alpha),
        normal_p=float(stats.shapiro(fit.resid).pvalue) if spread and 3 <= len(frame) <= 5000 else None,
        equal_p=float(stats.levene(*values.values(), center="median").pvalue) if _all_groups_vary(values) else None,
        welch_p=_welch_p(values),
        kruskal_p=float(stats.kruskal(*values.values()).pvalue),
        eta_squared=float(fit.rsquared),
        omega_squared=max(0.0, float((fit.ess - between * ms_within) / (fit.centered_tss + ms_within))),
    )


def two_way_anova(
    rows: Sequence[tuple[str, str, float]], names: tuple[str, str], blocks: Sequence[str] = ()
) -> tuple[Effect, ...]:
    """Perform a two-way analysis of variance with an interaction and a residual (type II sums of squares).

    An interaction of zero is not tested. It is zero by construction if the simulated time is a sum with one term per
    factor.

    Parameters
    ----------
    rows
        Level of the first factor, level of the second factor, and value. Without repeated cells, the interaction cannot
        be separated from chance and is left out.
    names
        Names of the two factors.
    blocks
        Block of each row, as a third factor without interactions. It is empty if there are no blocks.

    Raises
    ------
    OptionError
        A factor has only one level, a combination has no value, or all values are equal.
    """
    import pandas
    from statsmodels.formula.api import ols
    from statsmodels.stats.anova import anova_lm

    first, second = ({row[k] for row in rows} for k in (0, 1))
    cells = {row[:2] for row in rows}
    if min(len(first), len(second)) < 2:
        raise OptionError("each of the two factors needs two levels or more")
    if len(cells) < len(first) * len(second):
        raise OptionError("a combination of the two factors has no figure yet")
    if len({row[2] for row in rows}) < 2:
        raise OptionError("all figures are equal; no analysis is possible")
    repeated, blocked = len(rows) > len(cells), len(set(blocks)) > 1
    frame = pandas.DataFrame(rows, columns=["a", "b", "y"]).assign(block=blocks or "")
    formula = f"y ~ {'C(block) + ' if blocked else ''}C(a) {'*' if repeated else '+'} C(b)"
    fit = ols(formula, data=frame).fit()
    variances = anova_lm(fit, typ=2)
    effect_names = {
        "C(block)": "block", "C(a)": names[0], "C(b)": names[1], "C(a):C(b)": f"{names[0]} × {names[1]}",
        "Residual": "residual",
    }  # fmt: skip
    residual = float(variances.loc["Residual", "sum_sq"])
    effects = []
    for key, name in effect_names.items():
        if key not in variances.index:
            continue
        squares, freedom, f, p = (float(variances.loc[key, column]) for column in ("sum_sq", "df", "F", "PR(>F)"))
        zero = key == "C(a):C(b)" and squares <= _ZERO_SHARE * fit.centered_tss
        known = key != "Residual" and math.isfinite(f) and not zero
        eta = squares / (squares + residual) if key != "Residual" and squares + residual > 0.0 else None
        effects.append(
            Effect(name, 0.0 if zero else squares, freedom, f if known else None, p if known else None, eta, zero)
        )
    return tuple(effects)


def compare_ranks(treatments: Groups, alpha: float = 0.05) -> RankComparison:
    """Compare treatments by rank. The values of all treatments must belong to the same blocks, in the same order.

    Friedman's test compares all treatments. Wilcoxon's signed-rank test with Holm's correction compares pairs (Demšar
    2006, section 3.2; García and Herrera 2008). The difference of a pair is the Hodges–Lehmann median with a bootstrap
    interval.

    Raises
    ------
    OptionError
        There are fewer than two treatments, or too few blocks.
    """
    from scipy import stats

    table = np.array([list(values) for values in treatments.values()], dtype=np.float64)
    if len(table) < 2:
        raise OptionError("a comparison needs two methods or more")
    if table.shape[1] < MIN_OF_PAIRS:
        raise OptionError(f"a comparison by ranks needs {MIN_OF_PAIRS} blocks or more; there are {table.shape[1]}")
    blocks = table.shape[1]
    ranks = stats.rankdata(table, axis=0).mean(axis=1)
    statistic = p = w = None
    if len(table) > 2 and (np.ptp(table, axis=0) > 0).any():
        friedman = stats.friedmanchisquare(*table)
        statistic, p = float(friedman.statistic), float(friedman.pvalue)
        w = statistic / (blocks * (len(table) - 1))
    pairs = [
        _signed_rank_pair(a, b, x, y, alpha)
        for (a, x), (b, y) in itertools.combinations(zip(treatments, table, strict=True), 2)
    ]
    return RankComparison(
        blocks, dict(zip(treatments, ranks.tolist(), strict=True)), statistic, p, w, _holm_correction(pairs)
    )


def trend_test(x: Sequence[float], y: Sequence[float], alpha: float = 0.05) -> Trend:
    """Test whether `y` has a trend over `x`, with two-sided tests.

    Raises
    ------
    OptionError
        There are fewer than four points, or all values of `x` or `y` are equal.
    """
    from scipy import stats

    if len(x) < 4 or len(set(x)) < 2 or len(set(y)) < 2:
        raise OptionError("a trend needs four points or more that differ in both numbers")
    tau = stats.kendalltau(x, y)
    slope = stats.theilslopes(y, x, alpha=1.0 - alpha)
    return Trend(
        len(x),
        float(tau.statistic),
        float(tau.pvalue),
        float(slope[0]),
        float(slope[2]),
        float(slope[3]),
    )


def bootstrap_interval(values: Sequence[float], alpha: float = 0.05) -> tuple[float, float]:
    """Return the bootstrap interval of the mean (bias-corrected and accelerated).

    The width of the interval is zero if all values are equal.
    """
    from scipy import stats

    array = np.asarray(values, dtype=np.float64)
    if len(array) < 2 or np.ptp(array) == 0.0:
        return float(array[0]), float(array[-1])
    limits = stats.bootstrap(
        (array,), np.mean, confidence_level=1.0 - alpha, n_resamples=_RESAMPLES, rng=np.random.default_rng(1)
    ).confidence_interval
    return float(limits.low), float(limits.high)


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the indices of the Pareto-optimal points. Smaller values are better."""
    return [k for k, (x, y) in enumerate(points) if not any(a <= x and b <= y and (a < x or b < y) for a, b in points)]


def _checked_groups(groups: Groups) -> dict[str, NDArray[np.float64]]:
    values = {name: np.asarray(sample, dtype=np.float64) for name, sample in groups.items()}
    if len(values) < 2:
        raise OptionError("an analysis of variance needs two groups or more")
    for name, sample in values.items():
        if len(sample) < MIN_OF_A_GROUP:
            raise OptionError(
                f"an analysis of variance needs {MIN_OF_A_GROUP} figures of each level; '{name}' has {len(sample)}"
            )
    return values


def _all_groups_vary(values: Mapping[str, NDArray[np.float64]]) -> bool:
    return all(np.ptp(np.abs(sample - np.median(sample))) > 0.0 for sample in values.values())


def _welch_p(values: Mapping[str, NDArray[np.float64]]) -> float | None:
    from statsmodels.stats.oneway import anova_oneway

    if any(np.ptp(sample) == 0.0 for sample in values.values()):
        return None
    return float(anova_oneway(list(values.values()), use_var="unequal").pvalue)


def _fisher_pairs(values: Mapping[str, NDArray[np.float64]], ms: float, freedom: int, t: float) -> tuple[Pair, ...]:
    """Compare all pairs by Fisher's LSD, with the pooled variance `ms` and without a correction."""
    from scipy import stats

    pairs = []
    for (a, x), (b, y) in itertools.combinations(values.items(), 2):
        difference = float(x.mean() - y.mean())
        error = math.sqrt(ms * (1.0 / len(x) + 1.0 / len(y)))
        p = float(2.0 * stats.t.sf(abs(difference) / error, freedom)) if error else float(difference == 0.0)
        pairs.append(Pair(a, b, difference, p, difference - t * error, difference + t * error))
    return tuple(pairs)


def _tukey_pairs(values: Mapping[str, NDArray[np.float64]], alpha: float, spread: bool) -> tuple[Pair, ...]:
    """Compare all pairs by Tukey's test, or by the Tukey–Kramer test if the groups have different sizes."""
    from scipy import stats

    means = np.array([sample.mean() for sample in values.values()])
    differences = np.subtract.outer(means, means)
    if spread:
        comparison = stats.tukey_hsd(*values.values())
        limits = comparison.confidence_interval(confidence_level=1.0 - alpha)
        p_values, low, high = comparison.pvalue, limits.low, limits.high
    else:
        p_values, low, high = (differences == 0.0).astype(float), differences, differences
    return tuple(
        Pair(a, b, float(differences[i, j]), float(p_values[i, j]), float(low[i, j]), float(high[i, j]))
        for (i, a), (j, b) in itertools.combinations(enumerate(values), 2)
    )


def _letter_display(values: Mapping[str, NDArray[np.float64]], pairs: Sequence[Pair], alpha: float) -> dict[str, str]:
    """Assign letters to the levels.

    Levels that share a letter do not differ, and the smallest mean has the letter a.
    """
    import pandas
    from scikit_posthocs import compact_letter_display

    order = sorted(values, key=lambda name: float(values[name].mean()))
    p_values = pandas.DataFrame(1.0, index=order, columns=order)
    for pair in pairs:
        p_values.loc[pair.first, pair.second] = p_values.loc[pair.second, pair.first] = pair.p
    letters = compact_letter_display(p_values, alpha=alpha)
    return {name: str(letters[name]).strip() for name in values}


def _signed_rank_pair(a: str, b: str, x: NDArray[np.float64], y: NDArray[np.float64], alpha: float) -> Pair:
    from scipy import stats

    differences = x - y
    nonzero = differences[differences != 0.0]
    if not len(nonzero):
        return Pair(a, b, 0.0, 1.0, 0.0, 0.0, 0.0)
    ranks = stats.rankdata(np.abs(nonzero))
    effect = float((ranks[nonzero > 0].sum() - ranks[nonzero < 0].sum()) / ranks.sum())
    p = float(stats.wilcoxon(x, y, zero_method="wilcox").pvalue)
    low = high = None
    if np.ptp(differences) > 0.0:
        limits = stats.bootstrap(
            (differences,),
            _hodges_lehmann,
            confidence_level=1.0 - alpha,
            n_resamples=999,
            method="percentile",
            vectorized=False,
            rng=np.random.default_rng(1),
        ).confidence_interval
        low, high = float(limits.low), float(limits.high)
    return Pair(a, b, _hodges_lehmann(differences), p, low, high, effect)


def _hodges_lehmann(differences: NDArray[np.float64]) -> float:
    """Average each pair of differences, including pairs of a difference with itself, and return the median.

    Source: Hodges and Lehmann 1963.
    """
    i, j = np.triu_indices(len(differences))
    return float(np.median((differences[i] + differences[j]) / 2.0))


def _holm_correction(pairs: Sequence[Pair]) -> tuple[Pair, ...]:
    """Correct the p values of the pairs by Holm's step-down method (Holm 1979)."""
    from statsmodels.stats.multitest import multipletests

    corrected = multipletests([pair.p for pair in pairs], method="holm")[1]
    return tuple(replace(pair, p=float(p)) for pair, p in zip(pairs, corrected, strict=True))
