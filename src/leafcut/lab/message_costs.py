"""Speed-up of parallel ants over a single thread: measured, and simulated from the costs of iterations and messages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from leafcut.errors import OptionError
from leafcut.lab import charts
from leafcut.lab.description import Analysis, Factor, Response
from leafcut.lab.results import ReportBlock, Results, Table, five_digits, five_digits_or_dash


@dataclass(frozen=True)
class IterationCost:
    """The three parts of the cost of an iteration, in the unit of the response. `simulated` calls them C, U and M."""

    ants: float
    update: float
    messages: float

    def simulated(self, workers: float) -> float:
        """Return the cost C / p + U + p·M for p workers.

        The workers share the ants. Messages do not overlap with other work.
        """
        return self.ants / workers + self.update + workers * self.messages


@dataclass(frozen=True)
class _Instance:
    """The times of an iteration on an instance for each model and number of workers, and the costs for each model."""

    name: str
    size: float
    single: float
    measured: dict[tuple[str, float], float]
    costs: dict[str, IterationCost]

    def speedup(self, model: str, workers: float, simulated: bool) -> float | None:
        if not simulated:
            time = self.measured.get((model, workers))
        else:
            time = self.costs[model].simulated(workers) if model in self.costs else None
        return self.single / time if time else None


def message_costs_block(results: Results, analysis: Analysis, response: Response) -> ReportBlock:
    """Report the costs of an iteration, the speed-up and the efficiency of each model, and the break-even sizes."""
    description = results.description
    model, workers = (description.factor(name) for name in analysis.factors)
    if description.factors != (model, workers) or not workers.numeric:
        raise OptionError("the factors of the experiment must be a model and a number of workers")
    instances = _measured_instances(results, analysis, response, model, workers)
    if not instances:
        raise OptionError(f"needs facts.size of the instances, and runs of '{analysis.base}' with one worker")
    sentences = (
        "S = T(1 thread) / T(p) and E = S / p, for the time of an iteration, without the start of processes. The "
        "fastest iteration of all seeds counts, because all iterations do the same work, and other load on the machine "
        "only slows them down.",
        "Simulated, not measured: T(p) = C / p + U + p·M. C is the time of the ants and U the rest of an iteration on "
        f"one thread ({analysis.base}). U + M is the rest of an iteration with one worker, so M is the time of its "
        "messages. All three are measured.",
        "The break-even size is the smallest size above which an iteration is faster than on one thread, interpolated "
        "between instances.",
    )
    models = [level.name for level in model.levels if any(level.name in item.costs for item in instances)]
    sent = [name for name in models if name != analysis.base]
    rows = []
    for item in instances:
        base = item.costs[analysis.base]
        messages = [five_digits(item.costs[name].messages) if name in item.costs else "–" for name in sent]
        rows.append((item.name, f"{item.size:g}", five_digits(base.ants), five_digits(base.update), *messages))
    columns = ("Instance", "Size", "Ants C", "Update U", *(f"Messages M of {name}" for name in sent))
    costs = Table(columns, tuple(rows), 1, f"Measured costs of an iteration, {response.unit}")
    break_even = _break_even_table(instances, models, workers)
    speedups = [_speedup_table(item, models, workers, response) for item in instances]
    title = f"Speed-up over one thread, and the cost of messages: {response.title.lower()}"
    return ReportBlock(
        title, sentences, (costs, break_even, *speedups), (_speedup_chart(instances[-1], models, workers),)
    )


def _worker_counts(workers: Factor) -> dict[str, float]:
    return {level.name: level.value or 0.0 for level in workers.levels}


def break_even_size(points: Sequence[tuple[float, float]]) -> str:
    """Return the size above which the speed-up exceeds 1.

    The size is interpolated logarithmically between the given points (size, speed-up).
    """
    points = sorted(points)
    if not points:
        return "–"
    losing = [k for k, (_, speedup) in enumerate(points) if speedup <= 1.0]
    if not losing:
        return f"≤ {points[0][0]:g}"
    if losing[-1] == len(points) - 1:
        return f"> {points[-1][0]:g}"
    (low, slow), (high, fast) = points[losing[-1]], points[losing[-1] + 1]
    share = -math.log(slow) / (math.log(fast) - math.log(slow))
    return f"{math.exp(math.log(low) + share * (math.log(high) - math.log(low))):.0f}"


def _break_even_table(instances: Sequence[_Instance], models: Sequence[str], workers: Factor) -> Table:
    rows = []
    for name in models:
        for level, p in _worker_counts(workers).items():
            if p == 1.0:
                continue
            points = [
                [(item.size, item.speedup(name, p, simulated)) for item in instances] for simulated in (False, True)
            ]
            sizes = [break_even_size([(n, s) for n, s in pairs if s is not None]) for pairs in points]
            rows.append((name, level, *sizes))
    return Table(("Model", workers.title, "Measured", "Simulated"), tuple(rows), 2, "Break-even sizes")


def _measured_instances(
    results: Results, analysis: Analysis, response: Response, model: Factor, workers: Factor
) -> list[_Instance]:
    """Return the instances that have a size and were measured with one thread, smallest first."""
    figures, rests = results.values_by_cell(response.name), results.values_by_cell(analysis.against)
    numbers = _worker_counts(workers)
    one = next((name for name, value in numbers.items() if value == 1.0), "")
    instances = []
    for instance in results.description.instances:
        single = (instance.name, analysis.base, one)
        if "size" not in instance.facts or single not in figures or single not in rests:
            continue
        measured = {
            (cell[1], numbers[cell[2]]): min(values) for cell, values in figures.items() if cell[0] == instance.name
        }
        total, update = min(figures[single]), min(rests[single])
        costs = {
            level.name: IterationCost(total - update, update, max(min(rests[cell]) - update, 0.0))
            for level in model.levels
            if (cell := (instance.name, level.name, one)) in rests
        }
        instances.append(_Instance(instance.name, instance.facts["size"], total, measured, costs))
    return sorted(instances, key=lambda item: item.size)


def _speedup_table(item: _Instance, models: Sequence[str], workers: Factor, response: Response) -> Table:
    rows = []
    for name in models:
        for level, p in _worker_counts(workers).items():
            speedup, simulated = item.speedup(name, p, False), item.speedup(name, p, True)
            rows.append(
                (
                    name,
                    level,
                    five_digits_or_dash(item.measured.get((name, p))),
                    "–" if speedup is None else f"{speedup:.2f}",
                    "–" if speedup is None else f"{100.0 * speedup / p:.0f} %",
                    "–" if simulated is None else f"{simulated:.2f}",
                )
            )
    columns = ("Model", workers.title, response.heading, "Speed-up S", "Efficiency E", "S simulated")
    return Table(columns, tuple(rows), 2, item.name)


def _speedup_chart(item: _Instance, models: Sequence[str], workers: Factor) -> tuple[str, str]:
    series, counts = {}, list(_worker_counts(workers).values())
    for simulated, suffix in ((False, ""), (True, ", simulated")):
        for name in models:
            points = [
                (p, speedup, speedup, speedup)
                for p in counts
                if (speedup := item.speedup(name, p, simulated)) is not None
            ]
            if points:
                series[f"{name}{suffix}"] = points
    most = max(counts)
    label = f"Speed-up over one thread on {item.name}, measured and simulated"
    return item.name, charts.chart_of_means(series, workers.title, "speed-up", label, [(1, 1), (most, most)])
