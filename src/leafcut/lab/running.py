"""`execute_experiment` executes the missing runs of an experiment, and stores each run when it is complete."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
import random
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from leafcut import api
from leafcut._version import __version__
from leafcut.errors import LeafcutError, OptionError, count_of
from leafcut.files.whole_files import check_file_exists
from leafcut.geometry.arrays import Floats
from leafcut.lab.description import (
    OPTIMIZE,
    PROCESSOR,
    RAPID,
    SEARCH,
    SOLVE,
    TIMES,
    WALL,
    Description,
    RunPlan,
)
from leafcut.lab.store import Row, Store, run_key
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.model.solution import Solution
from leafcut.model.study import Study
from leafcut.options.option_spec import flag_name
from leafcut.order.executors import WatchedExecutor, run_tasks
from leafcut.processes import registry
from leafcut.read.format import Source
from leafcut.read.registry import read_source_with_format
from leafcut.report.json_answer import program_as_json, tour_as_json

#: Maximum number of points to store per curve.
MAX_POINTS = 300
#: Maximum number of points for a search that is part of a process.
_MAX_SEARCH_POINTS = 50
#: Time limit for a run in a new process, s.
_LONGEST_PROCESS = 3600.0
#: Packages whose versions are stored with every run.
_PACKAGES = ("numpy", "numba")


@dataclass(frozen=True)
class RunTask:
    """A run as plain data, which can be sent to another process or machine.

    `input` is the name of a built-in input, or a file that has already been read.
    """

    key: str
    command: str
    input: str | Source
    options: Mapping[str, Any]
    responses: Mapping[str, tuple[str, float]]
    new_process: bool = False


@dataclass(frozen=True)
class Answer:
    """The result of a run, with the machine and the start time.

    `failed` contains the error message. If a run fails after its search, the answer still contains the results of the
    search.
    """

    responses: Mapping[str, float | None] = field(default_factory=dict)
    curve: tuple[tuple[int, float, float], ...] = ()
    failed: str = ""
    began: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    machine: str = ""
    load: float | None = None


#: Executes tasks, and yields each task with its answer as soon as it is finished. The order may change.
Performer = Callable[[Iterable[RunTask]], Iterator[tuple[RunTask, Answer]]]


@dataclass(frozen=True)
class RunSummary:
    """Summary of a call to `execute_experiment`.

    Attributes
    ----------
    runs
        Number of runs that this machine can execute.
    finished
        Number of these runs that are stored.
    done
        Number of runs that this call has executed.
    left_out
        Number of runs that need more threads than this machine has cores.
    """

    runs: int
    finished: int
    done: int
    failed: tuple[str, ...] = ()
    left_out: int = 0
    stopped: bool = False


def execute_experiment(
    description: Description,
    store: Store,
    *,
    performer: Performer | None = None,
    progress: OnProgress | None = None,
    cancelled: threading.Event | None = None,
    mixed: bool = False,
) -> RunSummary:
    """Execute the runs of an experiment that are not stored yet, and repeat failed runs.

    Runs with the same seed form a round. The order within a round is random, so that all levels are affected equally if
    the machine slows down. Each run is stored as soon as it is finished. If `cancelled` is set, or if the user
    interrupts the experiment, unfinished runs are discarded.

    Parameters
    ----------
    performer
        Executes the runs. By default, they run one after the other in this process.
    mixed
        Whether runs from different versions of leafcut may be combined.

    Raises
    ------
    OptionError
        This machine cannot execute any of the runs, or the stored results are from a different version of leafcut and
        `mixed` is not set.
    ReadError, OutputError
        An input cannot be read, or the results cannot be written. Stored runs are kept.
    """
    plans = [plan for plan in description.runs() if has_enough_cores(description, plan)]
    left_out = description.n_runs - len(plans)
    if not plans:
        raise OptionError(
            "experiment '{}': no run fits this machine, which has {} cores", description.name, _core_count()
        )
    rows = {row.key: row for row in store.rows(description.storage_key) if not row.failed}
    inputs = _inputs_with_hashes(description)
    todo = [
        (plan, task)
        for plan in shuffled_by_seed(plans, description.storage_key)
        if (task := task_for_plan(description, plan, inputs)).key not in rows
    ]
    stored_keys = {task_for_plan(description, plan, inputs).key for plan in plans} & rows.keys()
    versions = sorted({rows[key].leafcut for key in stored_keys} - {__version__})
    if versions and todo and not mixed:
        raise OptionError(
            "{} has runs of '{}' by leafcut {}, but this version is {}; give another --results, or --mixed to "
            "combine both in one table",
            store.path,
            description.storage_key,
            ", ".join(versions),
            __version__,
        )
    cancel_event = cancelled or threading.Event()
    plans_by_key = {task.key: plan for plan, task in todo}
    failed: list[str] = []
    done = 0
    report_progress = _progress_reporter(progress, len(todo), [plan.label for plan, _ in todo])
    report_progress(0)
    for task, answer in (performer or (lambda tasks: _execute_one_by_one(tasks, cancel_event)))(
        [task for _, task in todo]
    ):
        plan = plans_by_key[task.key]
        store.add(_result_row(description, plan, task, inputs[plan.input][1], answer))
        done += 1
        if answer.failed:
            failed.append(f"{plan.label}: {answer.failed}")
        report_progress(done)
    return RunSummary(
        len(plans), len(stored_keys) + done - len(failed), done, tuple(failed), left_out, done < len(todo)
    )


def shuffled_by_seed(plans: Iterable[RunPlan], name: str) -> list[RunPlan]:
    """Sort the runs by seed, and shuffle the runs of each seed. The order depends only on the name."""
    by_seed: dict[int, list[RunPlan]] = {}
    for plan in plans:
        by_seed.setdefault(plan.seed, []).append(plan)
    for seed, plans_of_seed in by_seed.items():
        random.Random(f"{name} {seed}").shuffle(plans_of_seed)
    return [plan for plans_of_seed in by_seed.values() for plan in plans_of_seed]


def stored_rows(description: Description, store: Store) -> list[Row]:
    """Return the stored runs that match the current description of an experiment, in the order of the description.

    Runs whose options or inputs have changed since then are left out.

    Raises
    ------
    ReadError
        An input cannot be read.
    """
    by_key = {row.key: row for row in store.rows(description.storage_key)}
    inputs = _inputs_with_hashes(description)
    keys = [task_for_plan(description, plan, inputs).key for plan in description.runs()]
    return [by_key[key] for key in keys if key in by_key]


def has_enough_cores(description: Description, plan: RunPlan) -> bool:
    """Return whether this machine has enough cores for the threads of a run."""
    return not description.cores or (plan.levels[description.cores].value or 0) <= _core_count()


def task_for_plan(description: Description, plan: RunPlan, inputs: Mapping[str, tuple[str | Source, str]]) -> RunTask:
    """Return the task for a planned run. `inputs` maps each input to its content and its hash."""
    source, sha = inputs[plan.input]
    responses = {response.name: (response.path, response.scale) for response in description.responses}
    levels = {name: level.name for name, level in plan.levels.items()}
    # If an option names a file, the content of the file identifies the run, not its path.
    options = {name: _hash_if_file(value) for name, value in plan.options.items()}
    content: dict[str, Any] = {"input": sha, "instance": plan.instance.name, "levels": levels, "options": options}
    content |= {"responses": responses, "new_process": description.new_process}
    key = run_key(description.storage_key, description.command, content)
    return RunTask(key, description.command, source, dict(plan.options), responses, description.new_process)


def execute_run(task: RunTask, cancelled: threading.Event | None = None) -> Answer:
    """Execute a run. If the run fails, the answer contains the error."""
    started, load = datetime.now(UTC).isoformat(timespec="seconds"), _load_average()
    environment = Answer(began=started, load=load, versions=_package_versions(), machine=_processor_and_system())
    study = _study_if_needed(task)
    try:
        if not task.new_process and any(path in TIMES for path, _ in task.responses.values()):
            _run_once_untimed(task)
        wall, processor = time.perf_counter(), _processor_seconds()
        answer, curve = (_run_in_new_process(task), ()) if task.new_process else _run_command(task, study, cancelled)
    except LeafcutError as problem:
        figures = _response_values({SEARCH: _figures_of_study(study)}, task)
        return replace(environment, failed=str(problem), responses=figures, curve=_curve_of_study(study))
    answer |= {
        WALL: time.perf_counter() - wall,
        PROCESSOR: _processor_seconds() - processor,
        SEARCH: _figures_of_study(study),
    }
    return replace(environment, responses=_response_values(answer, task), curve=curve)


def executor_performer(executor: WatchedExecutor, ended: threading.Event) -> Performer:
    """Return a performer that uses an executor for each run.

    If a worker dies, its run is repeated. If this happens repeatedly, the run fails.

    Raises
    ------
    OptionError
        The executor runs several tasks at once in the same process. Their processor times cannot be separated.
    """
    if executor.together > 1:
        raise OptionError(
            "--executor: runs are timed by the processor time of their process, so each process may execute only "
            "one run at a time; use processes, or Dask workers with --nthreads 1"
        )

    def performs(tasks: Iterable[RunTask]) -> Iterator[tuple[RunTask, Answer]]:
        for task, answer in run_tasks(executor, execute_run, tasks, ended=ended.is_set):
            yield task, answer if isinstance(answer, Answer) else Answer(failed=f"{type(answer).__name__}: {answer}")

    return performs


def _execute_one_by_one(tasks: Iterable[RunTask], cancel_event: threading.Event) -> Iterator[tuple[RunTask, Answer]]:
    """Execute tasks one after the other. A cancelled task does not yield an answer."""
    for task in tasks:
        answer = execute_run(task, cancel_event)
        if cancel_event.is_set():
            return
        yield task, answer


class SearchStudy(Study):
    """A study that also records processor times, iteration times, and the best tour built by the search itself."""

    def __init__(self) -> None:
        super().__init__(None)
        self.processor = 0.0
        self._last = 0.0
        #: Lowest cost of the tours that the last search has built itself, without an initial tour.
        self._own = math.inf
        #: Time since the start of the search and total time of its workers after the previous iteration, s.
        self._before: tuple[float, float] | None = None
        #: Shortest iteration of the last search, and shortest time that a worker was idle in an iteration, s.
        self._iteration_s = self._rest_s = math.inf

    def begin(self) -> None:
        """Start recording a new search."""
        super().begin()
        self._last, self._own = time.process_time(), math.inf
        self._before, self._iteration_s, self._rest_s = None, math.inf, math.inf

    def note(
        self,
        number: int,
        seconds: float,
        shortest: float,
        costs: Floats | None = None,
        branching: Callable[[], float | None] = lambda: None,
        working: float = 0.0,
    ) -> None:
        """Record an iteration with its processor time and the time of its workers."""
        super().note(number, seconds, shortest, costs, branching, working)
        if self._before is not None:
            step, worked = seconds - self._before[0], working - self._before[1]
            self._iteration_s = min(self._iteration_s, step)
            self._rest_s = min(self._rest_s, max(0.0, step - worked))  # negative for several workers
        self._before = seconds, working
        if costs is not None:
            self._own = min(self._own, float(costs.min(initial=math.inf)))
        now = time.process_time()
        self.processor, self._last = self.processor + now - self._last, now

    def figures(self) -> dict[str, float]:
        """Return the total times of all searches, and the cost and the shortest iteration of the last search.

        The result is empty if no iteration was recorded.
        """
        searches = [rows for k in range(len(self.searches)) if (rows := self.iterations(k))]
        if not searches:
            return {}
        times = {"processor_s": self.processor, "seconds": sum(rows[-1].seconds for rows in searches)}
        if self._iteration_s < math.inf:
            times |= {"iteration_s": self._iteration_s, "rest_s": self._rest_s}
        return {**times, "cost": searches[-1][-1].shortest, **({"own_cost": self._own} if self._own < math.inf else {})}


def _study_if_needed(task: RunTask) -> SearchStudy | None:
    """Create a study if a response or a convergence curve needs one. Returns None otherwise.

    A study slows the search down, for example because it computes a lower bound.
    """
    observed = task.command in (SOLVE, "pocket") or any(f"{SEARCH}." in path for path, _ in task.responses.values())
    return SearchStudy() if observed else None


def _figures_of_study(study: SearchStudy | None) -> dict[str, float]:
    return {} if study is None else study.figures()


def _curve_of_study(study: Study | None) -> tuple[tuple[int, float, float], ...]:
    return () if study is None else tuple(latest_search_curve(study, _MAX_SEARCH_POINTS))


def latest_search_curve(study: Study, max_points: int) -> Iterator[tuple[int, float, float]]:
    """Yield (iteration, seconds, cost) for each improvement in the latest search and for its end.

    At most about `max_points` improvements are selected.
    """
    points: list[tuple[int, float, float]] = []
    rows = study.iterations()
    for row in rows:
        if not points or row.shortest < points[-1][2]:
            points.append((row.number, row.seconds, row.shortest))
    yield from points[:: len(points) // max_points + 1]
    if rows:
        yield (rows[-1].number, rows[-1].seconds, rows[-1].shortest)


def solution_curve(solution: Solution, study: Study, max_points: int) -> Iterator[tuple[int, float, float]]:
    """Yield (iteration, seconds, cost) for the initial tour, for each improvement, and for the end.

    At most about `max_points` improvements are selected.
    """
    started, cost = solution.history[0]
    points, rows = [(0, started, cost)], study.iterations()
    # For a map with sets of points, the search may have reported the lengths through the centres of the sets.
    known = bool(rows) and math.isclose(rows[-1].shortest, solution.cost, rel_tol=1e-9)
    for row in rows if known else ():
        if row.shortest < points[-1][2]:
            points.append((row.number, row.seconds, row.shortest))
    yield from points[:: len(points) // max_points + 1]
    yield (solution.iterations, solution.seconds, solution.cost)


def _run_command(
    task: RunTask, study: Study | None, cancelled: threading.Event | None
) -> tuple[dict[str, Any], tuple[tuple[int, float, float], ...]]:
    """Run the command. Return its ``--json`` answer, and the convergence curve if the search was observed."""
    if task.command == SOLVE:
        solved = api.solve(task.input, observe=study, cancelled=cancelled, **task.options)
        return tour_as_json(solved), () if study is None else tuple(solution_curve(solved.solution, study, MAX_POINTS))
    if task.command == "nest":
        nested = api.nest([str(task.input)], cancelled=cancelled, **task.options)
        return registry.command_function("nest_answer")(nested), ()
    word = "auto" if task.command == OPTIMIZE else task.command
    outcome = api.optimize(task.input, process=word, observe=study, cancelled=cancelled, **task.options)
    report = registry.report_of(outcome)
    return program_as_json(report) | {RAPID: report.compared_measures()[2].by_kind.get("rapid")}, _curve_of_study(study)


def _run_once_untimed(task: RunTask) -> None:
    """Run the first task of each kind once without timing it. Compilation then does not affect the measured times."""
    variant = (task.command, *(str(task.options.get(name)) for name in ("algorithm", "strategy", "parallel")))
    if variant not in _warmed_variants():
        _warmed_variants().add(variant)
        with suppress(LeafcutError):  # the run itself reports the error
            _run_command(task, _study_if_needed(task), None)


@cache
def _warmed_variants() -> set[tuple[str, ...]]:
    return set()


def _run_in_new_process(task: RunTask) -> dict[str, Any]:
    arguments = [task.command, str(task.input), "--json", "--no-defaults"]
    for name, value in task.options.items():
        if isinstance(value, bool):
            arguments.append(flag_name(name) if value else flag_name(name).replace("--", "--no-", 1))
        elif value is not None:
            arguments += [flag_name(name), str(value)]
    code = "from leafcut.__main__ import main; main()"
    try:
        completed = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, timeout=_LONGEST_PROCESS, check=False
        )
    except subprocess.TimeoutExpired:
        raise LeafcutError("the run took longer than {:g} s; reduce its work", _LONGEST_PROCESS) from None
    if completed.returncode:
        lines = completed.stderr.decode("utf-8", "replace").strip().splitlines()
        raise LeafcutError(
            lines[-1].removeprefix("leafcut: ") if lines else Message("ended with status {}", completed.returncode)
        )
    answer: dict[str, Any] = json.loads(completed.stdout)
    return answer


def _response_values(answer: Mapping[str, Any], task: RunTask) -> dict[str, float | None]:
    """Extract the responses from an answer.

    A response is a sum of values. If a value has several paths, the first path that exists in the answer is used.
    """
    figures: dict[str, float | None] = {}
    for name, (sum_of, scale) in task.responses.items():
        numbers = [
            next(
                (number for path in paths.split("|") if (number := _number_at_path(answer, path, scale)) is not None),
                None,
            )
            for paths in sum_of.split(" + ")
        ]
        known = [number for number in numbers if number is not None]
        figures[name] = sum(known) if len(known) == len(numbers) else None
    return figures


def _number_at_path(answer: Mapping[str, Any], path: str, scale: float) -> float | None:
    """Return the scaled number at a path of keys and list indices, or None if the path does not exist."""
    value: Any = answer
    for word in path.split("."):
        if isinstance(value, Mapping):
            value = value.get(word)
        elif isinstance(value, list) and word.isdigit() and int(word) < len(value):
            value = value[int(word)]
        else:
            return None
    return float(value) * scale if isinstance(value, int | float) and not isinstance(value, bool) else None


def _inputs_with_hashes(description: Description) -> dict[str, tuple[str | Source, str]]:
    instances = {plan.input: plan.instance.name for plan in description.runs()}
    return {name: _input_and_hash(description.command, name, instance) for name, instance in instances.items()}


def _input_and_hash(command: str, name: str, instance: str) -> tuple[str | Source, str]:
    """Return an input and its hash. The hash depends on the content, or on the name if there is no file."""
    if command == "nest":  # the input is a list of drawings, which the command reads itself
        check_file_exists(f"instance {instance}", Path(name))
        return name, hashlib.sha256(Path(name).read_bytes()).hexdigest()

    _, source = read_source_with_format(name)
    return source, hashlib.sha256(source.data or name.encode()).hexdigest()


def _hash_if_file(value: Any) -> Any:
    """If the value is the absolute path of a file, return the hash of its content. Otherwise, return the value."""
    if not isinstance(value, str) or not Path(value).is_absolute() or not Path(value).is_file():
        return value
    return hashlib.sha256(Path(value).read_bytes()).hexdigest()


def _result_row(description: Description, plan: RunPlan, task: RunTask, sha: str, answer: Answer) -> Row:
    levels = {name: level.name for name, level in plan.levels.items()}
    return Row(
        task.key, description.storage_key, plan.instance.name, levels, plan.seed, task.options, sha, answer.failed,
        answer.responses, answer.curve, answer.began, __version__, answer.versions, answer.machine, answer.load,
    )  # fmt: skip


def _progress_reporter(progress: OnProgress | None, todo: int, labels: list[str]) -> Callable[[int], None]:
    def report(done: int) -> None:
        if progress is not None and done < todo:
            progress(Progress(Message("{} ({} of {})", labels[done], done + 1, count_of(todo, "run")), done / todo))

    return report


def _core_count() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _load_average() -> float | None:
    return round(os.getloadavg()[0] / _core_count(), 2) if hasattr(os, "getloadavg") else None


def _processor_seconds() -> float:
    """Return the processor time of this process and all of its finished child processes, s."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@cache
def _package_versions() -> dict[str, str]:
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}


@cache
def _processor_and_system() -> str:
    model = platform.processor() or platform.machine()
    cpu_info = Path("/proc/cpuinfo")
    if cpu_info.is_file():
        lines = cpu_info.read_text(encoding="utf-8", errors="replace").splitlines()
        model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), model)
    return f"{model}, {count_of(_core_count(), 'core')}, {platform.system()}"
