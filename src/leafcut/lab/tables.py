"""An experiment as JSON and CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from leafcut.lab.experiment import Experiment, Repetition
from leafcut.lab.spread import Spread
from leafcut.model.study import Iteration


def experiment_as_json(experiment: Experiment) -> dict[str, Any]:
    """Return the results of an experiment as JSON data. Lengths are in the unit of the map's metric."""
    part = experiment.part
    return {
        "instance": part.name,
        "n": len(part.holes),
        "optimum": part.optimum,
        "lower_bound": experiment.lower_bound,
        "stopped_early": experiment.stopped,
        "algorithms": [_summary(name, experiment.runs_of(name)) for name in experiment.algorithms],
        "runs": [_plain(run) for run in experiment.repetitions],
    }


def curves_as_json(experiment: Experiment) -> list[dict[str, Any]]:
    """Return the convergence curve of each run: algorithm, seed, and points (iteration, seconds, length)."""
    return [
        {"algorithm": run.algorithm, "seed": run.seed, "points": [list(point) for point in run.curve]}
        for run in experiment.repetitions
    ]


def runs_as_csv(experiment: Experiment) -> str:
    """Return the runs as CSV, one row per run."""
    rows = [list(_plain(run).values()) for run in experiment.repetitions]
    return _csv(_plain(experiment.repetitions[0]), rows)


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


def _plain(run: Repetition) -> dict[str, Any]:
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
