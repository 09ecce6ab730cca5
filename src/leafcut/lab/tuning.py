"""`tune` optimizes the parameters of an algorithm on some parts, and evaluates them on other parts of the same kind.

The search uses optuna's tree-structured Parzen estimator (Bergstra et al., Algorithms for Hyper-Parameter Optimization,
NIPS 2011). The same seed and the same costs always lead to the same trials. After an interruption, the search therefore
replays the stored runs and then continues.
"""

from __future__ import annotations

import random
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any

from leafcut._version import __version__
from leafcut.errors import LeafcutError, OptionError, count_of, name_suggestion
from leafcut.files.schemas import OPTIONS
from leafcut.lab import charts
from leafcut.lab.description import OPTIMIZE, SOLVE, Analysis, Description, Factor, LabInstance, Level, Response
from leafcut.lab.own_experiment import command_responses
from leafcut.lab.results import ReportBlock, Table, five_digits
from leafcut.lab.running import Performer, execute_experiment, stored_rows
from leafcut.lab.store import Row, Store
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.options.option_spec import flag_name
from leafcut.options.search import ANT_ALGORITHMS
from leafcut.processes import registry
from leafcut.processes.settings import group_of

if TYPE_CHECKING:
    from optuna.trial import Trial

#: Maximum number of trials, seeds and inputs.
MAX_TRIALS, MAX_SEEDS, MAX_INPUTS = 10_000, 100, 1000
#: Minimum number of inputs: two for training, and one for the evaluation.
MIN_INPUTS = 3
#: Names of the factor and of its levels.
FACTOR, DEFAULTS, TUNED = "parameters", "defaults", "tuned"
#: First seed for the evaluation. It is larger than all seeds of the search.
_FRESH = 10_001


@dataclass(frozen=True)
class SearchRange:
    """The range of values in which a parameter is searched.

    Attributes
    ----------
    log
        Whether the logarithm of the value is sampled uniformly.
    paced
        Whether larger values cause more work per iteration.
    """

    name: str
    low: float
    high: float
    log: bool = False
    whole: bool = False
    paced: bool = False


_ANTS = (
    SearchRange("n_ants", 4, 128, log=True, whole=True, paced=True),
    SearchRange("pheromone_weight", 0.25, 4.0, log=True),
    SearchRange("heuristic_weight", 0.5, 8.0, log=True),
    SearchRange("evaporation_rate", 0.01, 0.9, log=True),
    SearchRange("candidates", 5, 40, log=True, whole=True),
)
_FIREFLIES = (
    SearchRange("n_fireflies", 4, 64, log=True, whole=True, paced=True),
    SearchRange("attractiveness", 1.0, 80.0, log=True, paced=True),
    SearchRange("absorption", 1e-4, 1.0, log=True),
)
#: Search ranges for each algorithm. They cover parameters that the authors leave open, around the values that the
#: authors have tested.
RANGES: Mapping[str, tuple[SearchRange, ...]] = {
    **dict.fromkeys(ANT_ALGORITHMS, _ANTS),
    "acs": (*_ANTS, SearchRange("greedy_probability", 0.0, 0.99)),
    "firefly": _FIREFLIES,
}


@dataclass(frozen=True)
class TuningTask:
    """A tuning problem.

    Attributes
    ----------
    options
        Options of every run, including a budget (`iterations` or `time_limit`).
    trials, seeds
        Number of parameter sets, and number of seeds per training input.
    hold_out
        Share of the inputs that are reserved for the evaluation.
    """

    algorithm: str
    inputs: tuple[str, ...]
    options: Mapping[str, Any]
    command: str = "optimize"
    trials: int = 50
    seeds: int = 3
    hold_out: float = 0.3
    seed: int = 1

    def __post_init__(self) -> None:
        if self.algorithm not in RANGES:
            raise OptionError(f"--algorithm: cannot tune '{self.algorithm}'{name_suggestion(self.algorithm, RANGES)}")
        for flag, value, limit in (("--trials", self.trials, MAX_TRIALS), ("--seeds", self.seeds, MAX_SEEDS)):
            if not 1 <= value <= limit:
                raise OptionError(f"{flag}: choose 1 to {limit:,}")
        if not MIN_INPUTS <= len(self.inputs) <= MAX_INPUTS:
            raise OptionError(
                f"{count_of(len(self.inputs), 'input')}: give {MIN_INPUTS} to {MAX_INPUTS}, some for tuning and "
                "others for evaluation"
            )
        if not 0.0 < self.hold_out < 1.0:
            raise OptionError("--hold-out: choose a share between 0 and 1")
        twice = next((name for name, times in Counter(self.inputs).items() if times > 1), None)
        if twice is not None:
            raise OptionError(f"{twice}: is given for tuning and for evaluation; use different inputs")
        for name in self.options:
            if name in {range_.name for range_ in RANGES[self.algorithm]} | {"algorithm", "seed"}:
                raise OptionError(f"{flag_name(name)}: is set by the search; leave it out of the options")

    @property
    def ranges(self) -> tuple[SearchRange, ...]:
        """The ranges to search. Without a time limit, parameters that change the work per iteration are left out."""
        timed = self.options.get("time_limit") is not None
        return tuple(range_ for range_ in RANGES[self.algorithm] if timed or not range_.paced)

    @property
    def response(self) -> Response:
        """The response to minimise."""
        return command_responses(self.command)[0]

    def split_inputs(self) -> tuple[list[LabInstance], list[LabInstance]]:
        """Split the inputs at random into training and evaluation inputs. Both lists keep the given order."""
        n_held_out = min(max(round(self.hold_out * len(self.inputs)), 1), len(self.inputs) - 2)
        held_out = set(random.Random(self.seed).sample(range(len(self.inputs)), n_held_out))
        names = _unique_input_names(self.inputs)
        instances = [LabInstance(name, source, {}, {}) for name, source in zip(names, self.inputs, strict=True)]
        return [instance for k, instance in enumerate(instances) if k not in held_out], [
            instances[k] for k in sorted(held_out)
        ]


@dataclass(frozen=True)
class TrialResult:
    """A parameter set and its mean cost relative to the defaults. The cost is None if the set was refused."""

    parameters: Mapping[str, float | int]
    cost: float | None


@dataclass(frozen=True)
class TuningResult:
    """The result of tuning.

    Attributes
    ----------
    parameters
        The best parameter set. It is empty if no set was better than the defaults.
    judging, rows
        The experiment on the evaluation inputs, and its runs. There are no runs if no set was better.
    change
        Mean relative change of the cost on the evaluation inputs. For example, −0.02 means 2 % less.
    """

    task: TuningTask
    trials: tuple[TrialResult, ...]
    parameters: Mapping[str, float | int]
    judging: Description
    rows: tuple[Row, ...]
    change: float | None
    finished: bool = True

    def summary_sentence(self) -> str:
        """Describe the result in one sentence."""
        trained, unseen = (count_of(len(instances), "input") for instances in self.task.split_inputs())
        if self.change is None:
            return f"no set of {count_of(len(self.trials), 'trial')} was better than the defaults on {trained}"
        better = "less" if self.change < 0.0 else "more"
        measure = self.task.response.title.lower()
        return (
            f"on {unseen} that were not used for tuning: {measure} {abs(100.0 * self.change):.2f} % {better} "
            "than the defaults"
        )


def command_for_process(process: str) -> str:
    """Return the command for a process, for ``solve`` or for ``auto``. Raises `OptionError` if the name is unknown."""
    if process == SOLVE:
        return SOLVE
    registry.check_process_value(process)
    return OPTIMIZE if process == "auto" else process


def tune(
    task: TuningTask,
    store: Store,
    *,
    performer: Performer | None = None,
    progress: OnProgress | None = None,
    cancelled: threading.Event | None = None,
    mixed: bool = False,
) -> TuningResult:
    """Find the best parameters on some inputs, and evaluate them on all other inputs. Stored runs are not repeated.

    For `performer`, `progress`, `cancelled` and `mixed`, see `lab.running.execute_experiment`.

    Raises
    ------
    LeafcutError
        The extra ``lab`` is not installed.
    OptionError, ReadError, OutputError
        See `lab.running.execute_experiment`. `OptionError` is also raised if an input is refused with the default
        parameters.
    """
    if find_spec("optuna") is None:
        raise LeafcutError("tuning needs the package optuna: pip install 'leafcut[lab]'")
    cancel_event = cancelled or threading.Event()

    def execute_and_load(description: Description, share: float, width: float) -> list[Row]:
        on_progress = None if progress is None else _scaled_progress(progress, share, width)
        execute_experiment(
            description, store, performer=performer, progress=on_progress, cancelled=cancel_event, mixed=mixed
        )
        return stored_rows(description, store)

    training, held_out = task.split_inputs()
    # Share of the progress per trial. The base runs and the evaluation together count as three trials.
    width = 1.0 / (task.trials + 3)
    base = _costs_by_instance_and_seed(
        execute_and_load(_experiment_with_sets(task, training, {DEFAULTS: {}}, 1), 0.0, width), task, strict=True
    )
    trials: list[TrialResult] = []

    def measure_trial(parameters: Mapping[str, float | int]) -> float | None:
        trial_description = _experiment_with_sets(task, training, {f"trial {len(trials) + 1}": parameters}, 1)
        costs = _costs_by_instance_and_seed(execute_and_load(trial_description, (len(trials) + 1) * width, width), task)
        cost = None if costs.keys() != base.keys() else fmean(costs[key] / base[key] for key in base)
        if not cancel_event.is_set():
            trials.append(TrialResult(dict(parameters), cost))
        return cost

    if not cancel_event.is_set():
        _search_parameters(task, measure_trial, cancel_event)
    best = min((trial for trial in trials if trial.cost is not None), key=lambda trial: trial.cost or 0.0, default=None)
    better = best is not None and best.cost is not None and best.cost < 1.0
    parameters = best.parameters if best is not None and better else {}
    judging = replace(
        _experiment_with_sets(task, held_out, {DEFAULTS: {}, TUNED: parameters}, _FRESH),
        notes=(
            f"Parameters of {task.algorithm} were tuned in {count_of(len(trials), 'trial')} on "
            f"{', '.join(source.name for source in training)}; the tuning used neither these inputs nor these "
            "seeds.",
        ),
    )
    rows = execute_and_load(judging, 1.0 - 2.0 * width, 2.0 * width) if better and not cancel_event.is_set() else []
    return TuningResult(
        task,
        tuple(trials),
        parameters,
        judging,
        tuple(rows),
        _mean_relative_change(rows, task),
        not cancel_event.is_set(),
    )


def _search_parameters(
    task: TuningTask, evaluate: Callable[[Mapping[str, float | int]], float | None], cancel_event: threading.Event
) -> None:
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=task.seed))
    for _ in range(task.trials):
        if cancel_event.is_set():
            return
        trial = study.ask()
        cost = evaluate({range_.name: _suggest_value(trial, range_) for range_ in task.ranges})
        if cost is None:
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
        else:
            study.tell(trial, cost)


def _suggest_value(trial: Trial, range_: SearchRange) -> float | int:
    """Sample a value from a range. It is rounded to three significant digits, so that users can read it easily."""
    if range_.whole:
        return int(trial.suggest_int(range_.name, int(range_.low), int(range_.high), log=range_.log))
    return float(f"{trial.suggest_float(range_.name, range_.low, range_.high, log=range_.log):.3g}")


def _experiment_with_sets(
    task: TuningTask, instances: Sequence[LabInstance], sets: Mapping[str, Mapping[str, float | int]], first: int
) -> Description:
    """Create an experiment on these inputs with one level for each parameter set. The seeds count up from `first`."""
    levels = tuple(Level(name, dict(parameters)) for name, parameters in sets.items())
    return Description(
        name=f"tune_{task.algorithm}",
        title=f"Parameters of {task.algorithm}, tuned",
        about="The tuned parameters are compared with the default parameters on parts that were not used for tuning.",
        command=task.command,
        instances=tuple(instances),
        factors=(Factor(FACTOR, "Parameters", levels),),
        responses=command_responses(task.command),
        seeds=tuple(range(first, first + task.seeds)),
        options={"threads": 1, "bound": False, **task.options, "algorithm": task.algorithm},
        analyses=(Analysis("compare", task.response.name, (FACTOR,), base=DEFAULTS),),
        listed=False,
    )


def _costs_by_instance_and_seed(
    rows: Sequence[Row], task: TuningTask, *, strict: bool = False
) -> dict[tuple[str, int], float]:
    responses = {(row.instance, row.seed): row.responses.get(task.response.name) for row in rows if not row.failed}
    costs = {key: value for key, value in responses.items() if value is not None and value > 0.0}
    for row in rows:
        if strict and row.failed:
            raise OptionError(f"{row.instance}: the defaults are refused: {row.failed}")
        if strict and (row.instance, row.seed) not in costs:
            raise OptionError(f"{row.instance}: its cost is 0, so no parameters can improve it; leave this input out")
    return costs


def _mean_relative_change(rows: Sequence[Row], task: TuningTask) -> float | None:
    """Return the mean relative change of the cost between the defaults and the tuned set.

    For each input, the mean over its seeds counts once. The change is None if one of the two sets has no runs.
    """
    sides = [
        _costs_by_instance_and_seed([row for row in rows if row.levels[FACTOR] == name], task)
        for name in (DEFAULTS, TUNED)
    ]
    common = sides[0].keys() & sides[1].keys()
    names = dict.fromkeys(name for name, _ in sorted(common))
    means = [[fmean(side[key] for key in common if key[0] == name) for side in sides] for name in names]
    return fmean(tuned / default for default, tuned in means) - 1.0 if means else None


def tuning_block(tuned: TuningResult) -> ReportBlock:
    """Describe the search in a report section: the best set, the cost of each trial, and a table of all trials."""
    task = tuned.task
    usual = {range_.name: _default_text(range_.name) for range_ in task.ranges}
    parameter_table = Table(
        ("Parameter", "Option", "Default", "Tuned", "Sought in"),
        tuple(
            (
                range_.name.replace("_", " "),
                flag_name(range_.name),
                usual[range_.name],
                f"{tuned.parameters[range_.name]:g}" if tuned.parameters else "–",
                f"{range_.low:g} to {range_.high:g}",
            )
            for range_ in task.ranges
        ),
        2,
        "Best parameter set",
    )
    costs = [(float(k), trial.cost) for k, trial in enumerate(tuned.trials, 1) if trial.cost is not None]
    heading = "cost ÷ cost of the defaults"
    words = "Cost of each trial divided by the cost of the defaults, and the minimum"
    drawn = (("", charts.tuning_trials_chart(costs, heading, words)),) if costs else ()
    rows = tuple(
        (
            str(k),
            "refused" if trial.cost is None else five_digits(trial.cost),
            *(f"{value:g}" for value in trial.parameters.values()),
        )
        for k, trial in enumerate(tuned.trials, 1)
    )
    names = tuple(trial.name.replace("_", " ") for trial in task.ranges)
    trial_table = Table(("Trial", "Cost", *names), rows, 1, "Every trial")
    return ReportBlock("The search", (f"In short: {tuned.summary_sentence()}.",), (parameter_table, trial_table), drawn)


def options_file_text(tuned: TuningResult) -> str:
    """Write the best set as an ``--options`` file. A comment states the measured gain."""
    lines = [
        f"# Parameters of {tuned.task.algorithm}, tuned by leafcut {__version__}: {tuned.summary_sentence()}.",
        OPTIONS.toml_line,
    ]
    tables: dict[str, list[str]] = {"solve": [f'algorithm = "{tuned.task.algorithm}"']}
    for name, value in tuned.parameters.items():
        tables.setdefault(group_of(name).section, []).append(f"{name} = {value:g}")
    for section, rows in tables.items():
        lines += ["", f"[{section}]", *rows]
    return "\n".join(lines) + "\n"


def _default_text(name: str) -> str:
    spec, group = group_of(name).specs()[name], group_of(name)()
    value = getattr(group, name)
    return spec.default_words if value is None else f"{value:g}"


def _unique_input_names(inputs: Sequence[str]) -> list[str]:
    """Return the names of the inputs. Identical names are numbered."""
    names = [source if ":" in source else Path(source).name for source in inputs]
    return [f"{name} ({k + 1})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def _scaled_progress(progress: OnProgress, share: float, width: float) -> OnProgress:

    def tell(now: Progress) -> None:
        progress(replace(now, share=min(share + width * now.share, 1.0)))

    return tell
