"""Charts of searches: their series, their axes and their descriptions."""

from __future__ import annotations

from typing import Any

import pytest

from leafcut.studio.page.charts import brightness_chart, convergence_chart, learning_chart
from leafcut.studio.wording import words

WORDS = words("en").section("chart")


def named(options: dict[str, Any], name: str) -> list[list[float]]:
    return next(line["data"] for line in options["series"] if line["name"].startswith(name))


def test_a_long_search_has_a_logarithmic_axis_that_shows_its_start() -> None:
    short, label = convergence_chart([(0.01, 60.0), (0.4, 50.0)], 48.5, "s", WORDS)
    long, _ = convergence_chart([(0.0, 61.0), (0.01, 60.0), (100.0, 50.0)], 48.5, "s", WORDS)
    assert (short["xAxis"]["type"], long["xAxis"]["type"]) == ("value", "log")
    assert label == "best 50.00 s"
    assert all(x >= long["xAxis"]["min"] > 0.0 for x, _ in long["series"][0]["data"])
    assert short["yAxis"]["min"] < 48.5
    assert short["yAxis"]["max"] > 60.0
    assert "48.50" in short["series"][0]["markLine"]["label"]["formatter"]


@pytest.mark.parametrize("by", ["iteration", "time"])
def test_a_learning_curve_has_a_line_for_each_figure_of_an_iteration(by: str) -> None:
    rows = [[k, 0.1 * k, 90.0 - k, 91.0 - k, 95.0 - k, 99.0 - k, 12.0 - k] for k in range(1, 6)]
    options, label = learning_chart(rows, None, "mm", WORDS, by)
    at = [row[0 if by == "iteration" else 1] for row in rows]
    for name, column in (("best so far", 2), ("best of the", 3), ("mean", 4), ("worst", 5), ("λ-branching", 6)):
        assert named(options, name) == [[x, row[column]] for x, row in zip(at, rows, strict=True)]
    assert label.startswith("best so far 85.00 mm, best of the iteration 86.00, mean 90.00, worst 94.00")


def test_a_search_without_rounds_has_only_its_best() -> None:
    options, _ = learning_chart([[1, 0.1, 90.0, None, None, None, None]], 80.0, "", WORDS, "iteration")
    assert len(options["series"]) == 1


def test_the_brightest_firefly_is_marked() -> None:
    options, label = brightness_chart([0.2, 1.0, 0.5], WORDS)
    marked = [bar["value"] for bar in options["series"][0]["data"] if "accent" in bar["itemStyle"]["color"]]
    assert marked == [1.0]
    assert label == "best 1.000"
