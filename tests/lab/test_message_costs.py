"""Measured speed-up, the simulated curve and break-even sizes of parallel models agree with hand calculations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from lab_descriptions import written
from test_store import ROW

from leafcut.errors import OptionError
from leafcut.lab.loading import load_experiment
from leafcut.lab.message_costs import IterationCost, break_even_size, message_costs_block
from leafcut.lab.results import ReportBlock, Results
from leafcut.lab.running import SearchStudy
from leafcut.lab.store import Row

TEXT = """
command = "solve"
cores = "workers"
seeds = 2
options = {algorithm = "as", iterations = 3}
[[instance]]
name = "large"
input = "random:160:1"
facts = {size = 160}
[[instance]]
name = "small"
input = "random:10:1"
facts = {size = 10}
[factor.model]
level.threads = {parallel = "threads", without = ["n_processes"]}
level.exchange = {parallel = "exchange"}
[factor.workers]
level.1 = {threads = 1, n_processes = 1}
level.2 = {threads = 2, n_processes = 2}
level.4 = {threads = 4, n_processes = 4}
[response.time]
unit = "ms"
path = "search.iteration_s"
[response.rest]
path = "search.rest_s"
[[analysis]]
kind = "messages"
response = "time"
against = "rest"
factors = ["model", "workers"]
base = "threads"
"""

#: Instance → time of an iteration on one thread, and on one and two workers that exchange; runs with 4 are missing.
TIMES = {"small": (10.0, 12.0, 11.0), "large": (100.0, 102.0, 55.0)}


def block(folder: Path) -> ReportBlock:
    """Return the report of runs by formula: on one thread 80 % of an iteration are ants; the second seed is slower."""
    description = load_experiment(written(folder, TEXT))
    rows: list[Row] = []
    for plan in description.runs():
        model, workers = plan.levels["model"].name, plan.levels["workers"].name
        single, one, two = TIMES[plan.instance.name]
        time = {("threads", "1"): single, ("exchange", "1"): one, ("exchange", "2"): two}.get((model, workers))
        if time is None:
            continue
        figures = {"time": time * plan.seed, "rest": (time - 0.8 * single) * plan.seed}
        levels = {"model": model, "workers": workers}
        rows.append(
            replace(
                ROW, key=str(len(rows)), instance=plan.instance.name, levels=levels, seed=plan.seed, responses=figures
            )
        )
    return message_costs_block(
        Results.from_rows(description, rows), description.analyses[0], description.response("time")
    )


def test_a_simulated_iteration_is_that_of_ants_update_and_messages() -> None:
    """80 / 4 + 20 + 4 · 2 = 48."""
    cost = IterationCost(ants=80.0, update=20.0, messages=2.0)
    assert [cost.simulated(p) for p in (1, 4)] == [102.0, 48.0]


def test_the_break_even_size_is_interpolated_on_logarithms() -> None:
    """From a speed-up of 1/2 at 10 to 2 at 1000, 1 is halfway on logarithms: at 100."""
    assert break_even_size([(1000.0, 2.0), (10.0, 0.5)]) == "100"
    assert break_even_size([(10.0, 1.1), (20.0, 0.9), (80.0, 1 / 0.9)]) == "40"
    assert break_even_size([(10.0, 1.5), (20.0, 1.1)]) == "≤ 10"
    assert break_even_size([(10.0, 1.5), (20.0, 1.0)]) == "> 20"
    assert break_even_size([]) == "–"


def test_the_report_agrees_with_a_hand_calculation(tmp_path: Path) -> None:
    """On the small instance C = 8, U = 2 and M = 2: S = 10 / 11 measured, 10 / (4 + 2 + 4) simulated, with 2 workers.

    On the large instance C = 80, U = 20 and M = 2: 100 / 55 measured, 100 / (40 + 20 + 4) simulated.
    """
    costs, break_even, small, large = block(tmp_path).tables
    assert [[float(cell) for cell in row[1:]] for row in costs.rows] == [[10, 8, 2, 2], [160, 80, 20, 2]]
    rows = {row[:2]: row[2:] for row in small.rows}
    assert rows["exchange", "2"] == ("11.000", "0.91", "45 %", "1.00")
    assert rows["exchange", "4"] == ("–", "–", "–", "0.83")
    assert rows["threads", "4"][-1] == "2.50"
    rows = {row[:2]: row[2:] for row in large.rows}
    assert rows["exchange", "2"] == ("55.000", "1.82", "91 %", "1.56")
    found = {row[:2]: row[2:] for row in break_even.rows}
    assert 10 < float(found["exchange", "2"][0]) < 20
    assert found["exchange", "4"][0] == "–"
    assert float(found["exchange", "4"][1]) > 10


def test_levels_may_set_options_that_another_level_leaves_out(tmp_path: Path) -> None:
    description = load_experiment(written(tmp_path, TEXT))
    given = {tuple(level.name for level in plan.levels.values()): plan.options for plan in description.runs()}
    assert "n_processes" not in given["threads", "2"]
    assert (given["threads", "2"]["threads"], given["exchange", "4"]["n_processes"]) == (2, 4)
    assert description.factor("workers").numeric


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('against = "rest"', "", "needs against"),
        ('base = "threads"', "", "needs base"),
        ('factors = ["model", "workers"]', 'factors = ["model"]', "of 2 factors"),
    ],
)
def test_an_incomplete_analysis_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        load_experiment(written(tmp_path, TEXT.replace(old, new)))


def test_the_time_of_an_iteration_is_the_shortest_without_the_first() -> None:
    study = SearchStudy()
    study.begin()
    for number, (seconds, working) in enumerate(((2.0, 0.5), (2.1, 0.55), (2.3, 0.65), (3.3, 1.6)), 1):
        study.note(number, seconds, 10.0, working=working)
    assert study.figures()["iteration_s"] == pytest.approx(0.1)
    assert study.figures()["rest_s"] == pytest.approx(0.05)
