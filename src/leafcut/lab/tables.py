"""Results of an experiment as JSON and CSV, and the spread of these results."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from leafcut.lab.experiment import Experiment, Repetition
from leafcut.model.study import Iteration

#: Distance from the quartiles beyond which a value is an outlier, as a multiple of the interquartile range (Tukey
#: 1977).
WHISKER = 1.5


def experiment_as_json(experiment: Experiment) -> dict[str, Any]:
    """Return the results of an experiment as JSON data; lengths are in the unit of the map's metric."""
    part = experiment.part
    return {
        "instance": part.name,
        "n": len(part.holes),
        "optimum": part.optimum,
        "lower_bound": experiment.lower_bound,
        "stopped_early": experiment.stopped,
        "algorithms": [_summary(name, experiment.runs_of(name)) for name in experiment.algorithms],
        "runs": [_run_as_json(run) for run in experiment.repetitions],
    }


def curves_as_json(experiment: Experiment) -> list[dict[str, Any]]:
    """Return the convergence curve of each run: algorithm, seed, and points (iteration, seconds, length)."""
    return [
        {"algorithm": run.algorithm, "seed": run.seed, "points": [list(point) for point in run.curve]}
        for run in experiment.repetitions
    ]


def runs_as_csv(experiment: Experiment) -> str:
    """Return the runs as CSV, one row per run."""
    rows = [list(_run_as_json(run).values()) for run in experiment.repetitions]
    return _csv(_run_as_json(experiment.repetitions[0]), rows)


def summary_as_csv(experiment: Experiment) -> str:
    """Return the summary of the algorithms as CSV, one row per algorithm."""
    rows = [
        {
            name: value
            for name, value in _summary(algorithm, experiment.runs_of(algorithm)).items()
            if name != "outliers"
        }
        for algorithm in experiment.algorithms
    ]
    return _csv(rows[0], [list(row.values()) for row in rows])


def iterations_as_csv(rows: Sequence[Iteration]) -> str:
    """Return the iterations of a search as CSV, one row per iteration."""
    return _csv(Iteration._fields, rows)


def _run_as_json(run: Repetition) -> dict[str, Any]:
    return {
        "algorithm": run.algorithm,
        "seed": run.seed,
        "length": run.cost,
        "iterations": run.iterations,
        "seconds": run.seconds,
    }


def _summary(algorithm: str, repetitions: Sequence[Repetition]) -> dict[str, Any]:
    lengths = asdict(Spread.of(run.cost for run in repetitions))
    return {
        "algorithm": algorithm,
        "runs": lengths.pop("count"),
        "best": lengths.pop("best"),
        "mean": lengths.pop("mean"),
        "standard_deviation": lengths.pop("deviation"),
        "worst": lengths.pop("worst"),
        "iterations": sum(run.iterations for run in repetitions) / len(repetitions),
        "seconds": sum(run.seconds for run in repetitions) / len(repetitions),
        **lengths,
        "outliers": list(lengths["outliers"]),
    }


def _csv(head: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()


@dataclass(frozen=True)
class Spread:
    """Statistics of a sample in which smaller values are better.

    Attributes
    ----------
    deviation
        Sample standard deviation (n - 1); None for a single value.
    lower, median, upper
        Quartiles, linearly interpolated (`linear` in NumPy, `inclusive` in Python).
    low, high
        Smallest and largest value that is not an outlier.
    outliers
        Values more than `WHISKER` interquartile ranges outside the quartiles.
    """

    count: int
    best: float
    mean: float
    deviation: float | None
    worst: float
    lower: float
    median: float
    upper: float
    low: float
    high: float
    outliers: tuple[float, ...]

    @classmethod
    def of(cls, numbers: Iterable[float]) -> Spread:
        """Return the statistics of one or more values."""
        values = np.sort(np.fromiter(numbers, dtype=np.float64))
        lower, median, upper = (float(q) for q in np.percentile(values, (25, 50, 75)))
        reach = WHISKER * (upper - lower)
        inside = (values >= lower - reach) & (values <= upper + reach)
        return cls(
            count=len(values),
            best=float(values[0]),
            mean=float(values.mean()),
            deviation=float(values.std(ddof=1)) if len(values) > 1 else None,
            worst=float(values[-1]),
            lower=lower,
            median=median,
            upper=upper,
            low=float(values[inside][0]),
            high=float(values[inside][-1]),
            outliers=tuple(values[~inside].tolist()),
        )
