"""Runs of several algorithms and seeds: each is the run that the command line makes, and the figures are right."""

from __future__ import annotations

import csv
import io
import itertools
import random
import statistics
import threading

import pytest

from leafcut import api
from leafcut.errors import OptionError
from leafcut.lab import experiment
from leafcut.lab.experiment import COMPARED, Experiment, options_for, run_experiment
from leafcut.lab.tables import Spread, curves_as_json, experiment_as_json, runs_as_csv, summary_as_csv
from leafcut.model.heartbeat import Progress
from leafcut.read import read

SHORT = {"iterations": "4", "threads": "1", "local_search": False}


@pytest.fixture(scope="module")
def found() -> Experiment:
    return run_experiment(read("random:30:2"), ("mmas", "firefly", "nn"), 3, {**SHORT, "n_ants": "5", "seed": "7"})


def test_every_run_is_the_run_of_its_algorithm_and_seed_alone(found: Experiment) -> None:
    assert [(t.algorithm, t.seed) for t in found.repetitions] == list(
        itertools.product(("mmas", "firefly", "nn"), (7, 8, 9))
    )
    for one in found.repetitions:
        given = {**SHORT, **({"n_ants": "5"} if one.algorithm == "mmas" else {})}
        alone = api.solve("random:30:2", algorithm=one.algorithm, seed=one.seed, **given).solution
        assert one.cost == alone.cost
        assert one.iterations == alone.iterations
        assert one.nodes.tobytes() == alone.nodes.tobytes()


def test_a_curve_falls_from_where_the_search_began_to_the_answer(found: Experiment) -> None:
    for one in found.repetitions:
        iterations, seconds, costs = zip(*one.curve, strict=True)
        assert list(iterations) == sorted(iterations)
        assert list(seconds) == sorted(seconds)
        assert list(costs) == sorted(costs, reverse=True)
        assert (iterations[0], iterations[-1]) == (0, one.iterations)
        assert costs[-1] == one.cost
    assert max(len(one.curve) for one in found.repetitions) > 2


def test_of_many_runs_each_curve_has_fewer_points(monkeypatch: pytest.MonkeyPatch) -> None:
    given = {"iterations": "60", "threads": "1", "local_search": False, "n_ants": "2"}

    def points() -> list[int]:
        runs = run_experiment(read("random:120:1"), ("acs",), 4, given).repetitions
        assert all((one.curve[0][0], one.curve[-1][2]) == (0, one.cost) for one in runs)
        return [len(one.curve) for one in runs]

    assert max(points()) > 6
    monkeypatch.setattr(experiment, "_ALL_POINTS", 20)
    monkeypatch.setattr(experiment, "_MIN_POINTS", 2)
    assert max(points()) <= 6  # a fourth of 20, and the answer


def test_the_bound_is_below_all_tours_and_sought_once(found: Experiment) -> None:
    assert found.lower_bound is not None
    assert 0.5 * found.best.cost < found.lower_bound <= found.best.cost
    assert run_experiment(read("random:8:1"), ("nn",), 1, {"bound": False}).lower_bound is None


def test_the_figures_are_those_of_pythons_statistics(found: Experiment) -> None:
    rows = {row["algorithm"]: row for row in experiment_as_json(found)["algorithms"]}
    for name in ("mmas", "firefly", "nn"):
        lengths = [t.cost for t in found.repetitions if t.algorithm == name]
        row = rows[name]
        assert row["runs"] == 3
        assert (row["best"], row["worst"]) == (min(lengths), max(lengths))
        assert row["mean"] == pytest.approx(statistics.mean(lengths))
        assert row["standard_deviation"] == pytest.approx(statistics.stdev(lengths), abs=1e-9)
        assert row["iterations"] == statistics.mean(t.iterations for t in found.runs_of(name))
        assert row["seconds"] == pytest.approx(statistics.mean(t.seconds for t in found.runs_of(name)))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 10, 37])
def test_a_spread_is_what_pythons_statistics_says_and_whiskers_end_at_numbers(count: int) -> None:
    rng = random.Random(count)
    numbers = [rng.gauss(100.0, 5.0) for _ in range(count)] + ([200.0] if count > 5 else [])
    spread = Spread.of(numbers)
    assert (spread.best, spread.worst, spread.count) == (min(numbers), max(numbers), len(numbers))
    assert spread.mean == pytest.approx(statistics.fmean(numbers))
    assert spread.median == pytest.approx(statistics.median(numbers))
    if count == 1:
        assert spread.deviation is None
        return
    assert spread.deviation == pytest.approx(statistics.stdev(numbers))
    quartiles = statistics.quantiles(numbers, n=4, method="inclusive")
    assert [spread.lower, spread.median, spread.upper] == pytest.approx(quartiles)
    reach = 1.5 * (quartiles[2] - quartiles[0])
    inside = [x for x in numbers if quartiles[0] - reach <= x <= quartiles[2] + reach]
    assert (spread.low, spread.high) == (min(inside), max(inside))
    assert sorted([*inside, *spread.outliers]) == sorted(numbers)
    assert (200.0 in spread.outliers) == (count > 5)


def test_csv_and_json_hold_every_run_and_every_algorithm(found: Experiment) -> None:
    runs = list(csv.DictReader(io.StringIO(runs_as_csv(found))))
    assert [(r["algorithm"], int(r["seed"]), float(r["length"])) for r in runs] == [
        (t.algorithm, t.seed, t.cost) for t in found.repetitions
    ]
    summary = list(csv.DictReader(io.StringIO(summary_as_csv(found))))
    assert [row["algorithm"] for row in summary] == ["mmas", "firefly", "nn"]
    assert float(summary[0]["mean"]) == pytest.approx(statistics.mean(t.cost for t in found.runs_of("mmas")))
    curves = curves_as_json(found)
    assert [len(curve["points"]) for curve in curves] == [len(t.curve) for t in found.repetitions]


def test_progress_names_the_run_and_grows_to_the_end() -> None:
    told: list[tuple[str, float]] = []
    run_experiment(
        read("random:20:1"),
        ("mmas", "acs"),
        2,
        SHORT,
        progress=lambda now: told.append((now.step, now.share)),
    )
    assert [what for what, _ in itertools.groupby(what for what, _ in told)] == [
        "mmas, seed 1 (1 of 4)",
        "mmas, seed 2 (2 of 4)",
        "acs, seed 1 (3 of 4)",
        "acs, seed 2 (4 of 4)",
    ]
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("after, of, runs", [(1, 4, 1), (2, 4, 1), (3, 4, 2), (1, 1, 1)])
def test_stopped_it_keeps_the_runs_that_were_finished_and_always_one(after: int, of: int, runs: int) -> None:
    """It is stopped at the first word of a run, which is then left out, unless it is the first of all."""
    stop, begun = threading.Event(), []

    def tell(progress: Progress) -> None:
        if progress.step not in begun:
            begun.append(progress.step)
        if len(begun) == after:
            stop.set()

    found = run_experiment(read("random:20:1"), ("mmas",), of, SHORT, progress=tell, cancelled=stop)
    assert len(found.repetitions) == runs
    assert found.stopped


@pytest.mark.parametrize(
    "algorithms, runs, words",
    [
        ((), 3, "at least one"),
        (("mmaz",), 3, "did you mean 'mmas'"),
        (("mmas",), 0, "1 to 1000"),
        (("auto",), 1, "auto"),
    ],
)
def test_what_cannot_be_meant_is_refused(algorithms: tuple[str, ...], runs: int, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        run_experiment(read("random:8:1"), algorithms, runs)


@pytest.mark.parametrize("seed, first", [(0, 0), ("0", 0), (None, 1), ("7", 7)])
def test_seeds_count_up_from_the_one_that_is_given_and_zero_is_one(seed: object, first: int) -> None:
    found = run_experiment(read("random:8:1"), ("nn",), 2, {"seed": seed})
    assert [one.seed for one in found.repetitions] == [first, first + 1]


@pytest.mark.parametrize("seed", ["abc", -1])
def test_a_seed_that_is_none_is_refused(seed: object) -> None:
    with pytest.raises(OptionError, match="--seed"):
        run_experiment(read("random:8:1"), ("nn",), 2, {"seed": seed})


def test_an_algorithm_gets_the_options_that_mean_something_to_it() -> None:
    options = {"n_ants": 5, "absorption": 0.1, "greedy_probability": 0.5, "iterations": 3}
    assert set(options_for("mmas", options)) == {"algorithm", "bound", "n_ants", "iterations"}
    assert set(options_for("acs", options)) == {"algorithm", "bound", "n_ants", "greedy_probability", "iterations"}
    assert set(options_for("firefly", options)) == {"algorithm", "bound", "absorption", "iterations"}
    assert set(options_for("nn", options)) == {"algorithm", "bound", "iterations"}
    assert "auto" not in COMPARED
