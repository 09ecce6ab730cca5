"""Statistics of experiments agree with textbooks and statsmodels."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas
import pytest
from scipy import stats
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.multicomp import pairwise_tukeyhsd

from leafcut.errors import OptionError
from leafcut.lab.statistics import (
    bootstrap_interval,
    compare_ranks,
    one_way_anova,
    pareto_front,
    trend_test,
    two_way_anova,
)

#: Etch rate by power, W: Montgomery, Design and Analysis of Experiments, 8th ed., table 3.1.
ETCH = {
    "160": [575, 542, 530, 539, 570],
    "180": [565, 593, 590, 579, 610],
    "200": [600, 651, 610, 637, 629],
    "220": [725, 700, 715, 685, 710],
}
#: Life of batteries, hours, by material and temperature, °F: the same book, table 5.1.
BATTERIES = {
    ("1", "15"): [130, 155, 74, 180], ("1", "70"): [34, 40, 80, 75], ("1", "125"): [20, 70, 82, 58],
    ("2", "15"): [150, 188, 159, 126], ("2", "70"): [136, 122, 106, 115], ("2", "125"): [25, 70, 58, 45],
    ("3", "15"): [138, 110, 168, 160], ("3", "70"): [174, 120, 150, 139], ("3", "125"): [96, 104, 82, 60],
}  # fmt: skip
#: Times to round first base, s, of 22 players with three methods: Hollander and Wolfe 1973, page 140.
BASE = """
5.40 5.50 5.55 5.85 5.70 5.75 5.20 5.60 5.50 5.55 5.50 5.40 5.90 5.85 5.70 5.45 5.55 5.60
5.40 5.40 5.35 5.45 5.50 5.35 5.25 5.15 5.00 5.85 5.80 5.70 5.25 5.20 5.10 5.65 5.55 5.45
5.60 5.35 5.45 5.05 5.00 4.95 5.50 5.50 5.40 5.45 5.55 5.50 5.55 5.55 5.35 5.45 5.50 5.55
5.50 5.45 5.25 5.65 5.60 5.40 5.70 5.65 5.55 6.30 6.30 6.25
"""


def test_one_way_analysis_is_that_of_the_book() -> None:
    found = one_way_anova(ETCH)
    assert found.f == pytest.approx(66.80, abs=0.005)
    assert (found.between, found.within) == (3, 16)
    assert found.f_critical == pytest.approx(3.24, abs=0.005)
    assert found.lsd == pytest.approx(24.49, abs=0.01)
    assert found.means == {"160": 551.2, "180": 587.4, "200": 625.4, "220": 707.0}
    # All means differ by Tukey's 33.09, so each has a letter of its own.
    half = {
        round((pair.high - pair.low) / 2.0, 1) for pair in found.tukey if pair.high is not None and pair.low is not None
    }
    assert half == {33.1}
    assert len(set(found.letters.values())) == 4
    assert found.eta_squared == pytest.approx(66870.55 / 72209.75, abs=1e-4)
    assert not found.residuals_doubtful


def test_one_way_analysis_is_that_of_statsmodels_with_groups_of_several_sizes() -> None:
    groups = {"a": [1.0, 2.0, 4.0], "b": [2.0, 2.5, 6.0, 3.0], "c": [7.0, 8.0]}
    frame = pandas.DataFrame([(name, y) for name, one in groups.items() for y in one], columns=["g", "y"])
    table = anova_lm(ols("y ~ C(g)", data=frame).fit())
    found = one_way_anova(groups)
    assert found.f == pytest.approx(table.loc["C(g)", "F"])
    assert found.p == pytest.approx(table.loc["C(g)", "PR(>F)"])
    assert found.lsd is None
    tukey = pairwise_tukeyhsd(frame["y"], frame["g"])
    for pair, p, limits in zip(found.tukey, tukey.pvalues, tukey.confint, strict=True):
        assert pair.p == pytest.approx(p, abs=1e-4)
        assert sorted((-pair.low, -pair.high)) == pytest.approx(list(limits), abs=2e-3)


def test_levels_that_do_not_differ_share_a_letter() -> None:
    draw = np.random.default_rng(3)
    found = one_way_anova({"a": draw.normal(10, 1, 8), "b": draw.normal(10, 1, 8), "c": draw.normal(30, 1, 8)})
    shared = {
        (a, b): bool(set(found.letters[a]) & set(found.letters[b])) for a, b in itertools.combinations(found.letters, 2)
    }
    assert shared == {("a", "b"): True, ("a", "c"): False, ("b", "c"): False}
    assert {(pair.first, pair.second): pair.p >= 0.05 for pair in found.tukey} == shared


def test_figures_that_are_equal_in_every_level_are_told_apart_without_a_division_by_zero() -> None:
    found = one_way_anova({"a": [3.0, 3.0], "b": [5.0, 5.0]})
    assert math.isinf(found.f)
    assert found.p == 0.0
    assert found.letters["a"] != found.letters["b"]


def test_crossed_analysis_is_that_of_the_book() -> None:
    rows = [(a, b, float(y)) for (a, b), ys in BATTERIES.items() for y in ys]
    material, temperature, both, residual = two_way_anova(rows, ("material", "temperature"))
    assert (material.name, both.name) == ("material", "material × temperature")
    assert material.squares == pytest.approx(10683.72, abs=0.01)
    assert temperature.squares == pytest.approx(39118.72, abs=0.01)
    assert both.squares == pytest.approx(9613.78, abs=0.01)
    assert residual.squares == pytest.approx(18230.75, abs=0.01)
    assert [round(one.f or 0.0, 2) for one in (material, temperature, both)] == [7.91, 28.97, 3.56]
    assert both.p == pytest.approx(0.0186, abs=1e-4)
    assert residual.f is None


def test_crossed_analysis_without_repetition_tells_no_interaction() -> None:
    rows = [("a", "x", 1.0), ("a", "y", 2.5), ("b", "x", 3.0), ("b", "y", 4.0), ("c", "x", 5.5), ("c", "y", 6.0)]
    assert [one.name for one in two_way_anova(rows, ("one", "two"))] == ["one", "two", "residual"]


#: Machining time, s, of three plates: plate, order, pecks. Pecks add the same time to both orders of a plate.
PLATES = [
    ("ten", "random", "pecks", 92.1), ("ten", "random", "none", 65.1),
    ("ten", "ordered", "pecks", 88.8), ("ten", "ordered", "none", 61.8),
    ("twenty", "random", "pecks", 186.7), ("twenty", "random", "none", 130.0),
    ("twenty", "ordered", "pecks", 178.2), ("twenty", "ordered", "none", 121.5),
    ("forty", "random", "pecks", 309.6), ("forty", "random", "none", 215.1),
    ("forty", "ordered", "pecks", 293.5), ("forty", "ordered", "none", 199.0),
]  # fmt: skip


def test_blocks_take_their_degrees_of_freedom_as_in_statsmodels() -> None:
    frame = pandas.DataFrame(PLATES, columns=["plate", "order", "peck", "y"])
    table = anova_lm(ols("y ~ C(plate) + C(order) * C(peck)", data=frame).fit(), typ=2)
    found = two_way_anova([row[1:] for row in PLATES], ("order", "peck"), [row[0] for row in PLATES])
    assert [one.name for one in found] == ["block", "order", "peck", "order × peck", "residual"]
    assert [one.freedom for one in found] == [2, 1, 1, 1, 6]
    assert found[1].f == pytest.approx(table.loc["C(order)", "F"])
    assert found[2].p == pytest.approx(table.loc["C(peck)", "PR(>F)"])
    assert found[4].squares == pytest.approx(table.loc["Residual", "sum_sq"])


def test_an_interaction_that_is_zero_by_construction_is_not_tested() -> None:
    both = two_way_anova([row[1:] for row in PLATES], ("order", "peck"), [row[0] for row in PLATES])[3]
    assert both.zero
    assert (both.f, both.p, both.squares) == (None, None, 0.0)
    other = [(*row[:3], row[3] + 5.0 * (row[1:3] == ("random", "pecks"))) for row in PLATES]
    assert two_way_anova([row[1:] for row in other], ("order", "peck"), [row[0] for row in other])[3].f is not None


def test_letters_of_lsd_are_those_of_uncorrected_pairs_of_statsmodels() -> None:
    """LSD separates more levels than Tukey: the paper on fireflies used it."""
    close = {"a": [1.0, 1.2, 1.4], "b": [1.35, 1.6, 1.75], "c": [1.8, 1.9, 2.2], "d": [2.1, 2.4, 2.3]}
    frame = pandas.DataFrame([(name, y) for name, ys in close.items() for y in ys], columns=["g", "y"])
    pairs = ols("y ~ C(g)", data=frame).fit().t_test_pairwise("C(g)").result_frame
    found = one_way_anova(close)
    assert sorted(pair.p for pair in found.fisher) == pytest.approx(sorted(pairs["P>|t|"]))
    for pair in found.fisher:
        shared = set(found.fisher_letters[pair.first]) & set(found.fisher_letters[pair.second])
        assert bool(shared) == (pair.p >= 0.05)
    assert sum(pair.p < 0.05 for pair in found.fisher) > sum(pair.p < 0.05 for pair in found.tukey)


def test_the_critical_value_of_the_paper_is_that_of_eight_levels_and_five_replicates() -> None:
    assert stats.f.ppf(0.95, 7, 32) == pytest.approx(2.313, abs=5e-4)
    rng = np.random.default_rng(1)
    groups = {str(level): rng.normal(level, 1.0, 5) for level in range(5, 13)}
    found = one_way_anova(groups)
    assert found.f_critical == pytest.approx(2.313, abs=5e-4)
    assert found.f == pytest.approx(stats.f_oneway(*groups.values()).statistic)


def test_friedman_is_that_of_the_book() -> None:
    table = np.array(BASE.split(), dtype=float).reshape(22, 3).T
    found = compare_ranks({"round out": table[0], "narrow": table[1], "wide": table[2]})
    assert found.blocks == 22
    assert found.statistic == pytest.approx(11.143, abs=5e-4)
    assert found.p == pytest.approx(0.003805, abs=1e-6)
    assert found.kendall_w == pytest.approx(11.143 / 44, abs=1e-4)
    assert found.mean_ranks["wide"] < found.mean_ranks["narrow"] < found.mean_ranks["round out"]


def test_holm_multiplies_the_least_p_by_the_number_of_pairs() -> None:
    table = np.array(BASE.split(), dtype=float).reshape(22, 3).T
    ways = {"a": table[0], "b": table[1], "c": table[2]}
    of_two = {
        pair: compare_ranks({pair[0]: ways[pair[0]], pair[1]: ways[pair[1]]}).pairs[0].p
        for pair in itertools.combinations("abc", 2)
    }
    of_all = {(pair.first, pair.second): pair.p for pair in compare_ranks(ways).pairs}
    least, middle, most = sorted(of_two, key=of_two.__getitem__)
    assert of_all[least] == pytest.approx(3 * of_two[least])
    assert of_all[middle] == pytest.approx(max(3 * of_two[least], 2 * of_two[middle]))
    assert of_all[most] == pytest.approx(max(of_all[middle], of_two[most]))


def test_the_effect_of_pairs_is_one_where_every_figure_is_larger() -> None:
    (pair,) = compare_ranks({"a": [2.0, 4.0, 6.0, 8.0, 11.0], "b": [1.0, 2.0, 3.0, 4.0, 5.0]}).pairs
    assert pair.effect == 1.0
    # Walsh averages of 1, 2, 3, 4, 6: fifteen, of which 3 is the eighth.
    assert pair.difference == 3.0
    (equal,) = compare_ranks({"a": [1.0] * 5, "b": [1.0] * 5}).pairs
    assert (equal.p, equal.effect) == (1.0, 0.0)


def test_trend_of_the_published_nests_is_told_by_hand() -> None:
    """Kendall's τ of 1, 2, 3, 4 against 1, 3, 2, 4: five pairs agree, one does not."""
    found = trend_test([1, 2, 3, 4], [1, 3, 2, 4])
    assert found.tau == pytest.approx((5 - 1) / 6)
    # Slopes of all pairs: 2, 1/2, 1, -1, 1/2, 2; the median of six lies between 1/2 and 1.
    assert found.slope == pytest.approx(0.75)


def test_interval_of_a_mean_holds_it_and_of_equal_figures_is_those() -> None:
    low, high = bootstrap_interval([1.0, 2.0, 3.0, 4.0, 10.0])
    assert 1.0 < low < 4.0 < high < 10.0
    assert bootstrap_interval([7.0, 7.0, 7.0]) == (7.0, 7.0)
    assert bootstrap_interval([1.0, 2.0, 3.0, 4.0, 10.0]) == (low, high)


def test_the_pareto_front_is_what_nothing_beats_in_both() -> None:
    assert pareto_front([(1.0, 5.0), (2.0, 2.0), (3.0, 3.0), (5.0, 1.0), (2.0, 2.0)]) == [0, 1, 3, 4]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: one_way_anova({"a": [1.0, 2.0]}), "two groups"),
        (lambda: one_way_anova({"a": [1.0, 2.0], "b": [1.0]}), "'b' has 1"),
        (lambda: one_way_anova({"a": [1.0, 1.0], "b": [1.0, 1.0]}), "all figures are equal"),
        (lambda: two_way_anova([("a", "x", 1.0), ("a", "y", 2.0)], ("one", "two")), "two levels"),
        (lambda: two_way_anova([("a", "x", 1.0), ("a", "y", 2.0), ("b", "x", 2.0)], ("one", "two")), "no figure yet"),
        (lambda: compare_ranks({"a": [1.0, 2.0]}), "two methods"),
        (lambda: compare_ranks({"a": [1.0, 2.0], "b": [1.0, 2.0]}), "there are 2"),
        (lambda: trend_test([1, 1, 1, 1], [1, 2, 3, 4]), "differ in both"),
    ],
)
def test_too_few_figures_are_refused_in_a_line(call: object, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        call()  # type: ignore[operator]
