"""An experiment as JSON and as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from leafcut.lab.experiment import Experiment, Repetition
from leafcut.lab.spread import Spread
from leafcut.model.study import Iteration


def experiment_as_json(found: Experiment) -> dict[str, Any]:
    """Return the results of an experiment as JSON data; lengths are in the unit of the map's metric."""
    part = found.part
    return {
        "instance": part.name,
        "n": len(part.holes),
        "optimum": part.optimum,
        "lower_bound": found.lower_bound,
        "stopped_early": found.stopped,
        "algorithms": [_summary(name, found.of(name)) for name in found.algorithms],
        "runs": [_plain(one) for one in found.repetitions],
    }


def curves_as_json(found: Experiment) -> list[dict[str, Any]]:
    """Return the convergence of every run, for charts: algorithm, seed, and points (iteration, seconds, length)."""
    return [
        {"algorithm": one.algorithm, "seed": one.seed, "points": [list(point) for point in one.curve]}
        for one in found.repetitions
    ]


def runs_as_csv(found: Experiment) -> str:
    """Return one row per run."""
    rows = [list(_plain(one).values()) for one in found.repetitions]
    return _csv(_plain(found.repetitions[0]), rows)


def summary_as_csv(found: Experiment) -> str:
    """Return one row per algorithm."""
    rows = [
        {name: value for name, value in _summary(algorithm, found.of(algorithm)).items() if name != "outliers"}
        for algorithm in found.algorithms
    ]
    return _csv(rows[0], [list(row.values()) for row in rows])


def iterations_as_csv(rows: Sequence[Iteration]) -> str:
    """Return one row per iteration of a search."""
    return _csv(Iteration._fields, rows)


def _plain(one: Repetition) -> dict[str, Any]:
    return {
        "algorithm": one.algorithm,
        "seed": one.seed,
        "length": one.cost,
        "iterations": one.iterations,
        "seconds": one.seconds,
    }


def _summary(algorithm: str, repetitions: Sequence[Repetition]) -> dict[str, Any]:
    """Return the spread of the lengths of an algorithm, and its mean iterations and seconds."""
    lengths = asdict(Spread.of(one.cost for one in repetitions))
    return {
        "algorithm": algorithm,
        "runs": lengths.pop("count"),
        "best": lengths.pop("best"),
        "mean": lengths.pop("mean"),
        "standard_deviation": lengths.pop("deviation"),
        "worst": lengths.pop("worst"),
        "iterations": sum(one.iterations for one in repetitions) / len(repetitions),
        "seconds": sum(one.seconds for one in repetitions) / len(repetitions),
        **lengths,
        "outliers": list(lengths["outliers"]),
    }


def _csv(head: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()
