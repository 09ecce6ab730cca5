"""The command `leafcut lab`: list, run and report experiments, and tune parameters."""

from __future__ import annotations

import shlex
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, Json, Name, Percent, Time, switch_parameter
from leafcut.cli.progress import Reporter
from leafcut.cli.shared import print_json
from leafcut.errors import OptionError, count_of
from leafcut.files.whole_files import check_output, write_all_or_none
from leafcut.options.option_spec import OptionSpec, convert_value
from leafcut.processes.settings import read_options_file

if TYPE_CHECKING:
    from leafcut.lab.store import Store

RESULTS = "leafcut_lab.sqlite"
#: Default of --executor: all runs are in this process.
HERE = "here"
#: Iterations per run of `tune` without a budget.
_USUAL_ITERATIONS = 50
_HOLD_OUT = OptionSpec("", "share", minimum=0, maximum=1)

#: Name of the report of all published figures.
PUBLISHED = "published"

_Name = Annotated[
    str, Parameter(name="NAME", help="an experiment from `leafcut lab list`, or a TOML file that describes one")
]
_Results = Annotated[File, Parameter(name="--results", help="results file with all runs (SQLite)")]
_Reduced = Annotated[
    bool,
    switch_parameter("--reduced", help="the short form: fewer inputs, levels and seeds"),
]
_Mixed = Annotated[
    bool,
    switch_parameter(
        "--mixed",
        help="allow runs of several versions of leafcut in one table",
    ),
]
_Executor = Annotated[
    Name,
    Parameter(name="--executor", help="where to run: here (one run after the other), processes, or dask://host:port"),
]
_Workers = Annotated[
    int | None,
    Parameter(name="--workers", help="number of parallel runs (default: one per core, or per worker of a cluster)"),
]


def list_experiments(*, results: _Results = File(RESULTS), as_json: Json = False) -> int:
    """List the experiments that come with leafcut, and the number of finished runs of each."""
    from leafcut.lab.loading import load_experiment, reduced_experiment, titles_of_included_experiments
    from leafcut.lab.store import Store

    done: dict[str, int] = {}
    if Path(results).is_file():
        with Store(results, read_only=True) as store:
            done = store.successful_run_counts()
    rows = []
    for name, title in titles_of_included_experiments().items():
        whole = load_experiment(name)
        rows.append(
            (
                name,
                title,
                whole.n_runs,
                done.get(whole.storage_key, 0),
                done.get(reduced_experiment(whole).storage_key, 0),
            )
        )
    if as_json:
        names = ("name", "title", "runs", "done", "reduced_done")
        print_json({"experiments": [dict(zip(names, row, strict=True)) for row in rows]})
        return 0
    from rich.console import Console
    from rich.table import Table

    table = Table("Name", "Experiment", box=None, pad_edge=False)
    table.add_column("Runs", justify="right")
    table.add_column("Done", justify="right")
    for name, title, runs, finished, _ in rows:
        table.add_row(name, title, str(runs), str(finished) if finished else "–")
    Console().print(table)
    return 0


def run_experiment(
    name: _Name,
    /,
    *,
    reduced: _Reduced = False,
    results: _Results = File(RESULTS),
    mixed: _Mixed = False,
    executor: _Executor = Name(HERE),
    workers: _Workers = None,
    as_json: Json = False,
) -> int:
    """Do the runs of an experiment that are not done yet; finished runs are never repeated."""
    from leafcut.lab.running import execute_experiment

    description = _load_experiment(name, reduced)
    with _open_store_and_executor(results, executor, workers) as (store, run_options):
        ran = execute_experiment(description, store, mixed=mixed, **run_options)
    if as_json:
        print_json(
            {
                "experiment": description.storage_key,
                "runs": ran.runs,
                "finished": ran.finished,
                "done": ran.done,
                "left_out": ran.left_out,
                "failed": list(ran.failed),
                "results": results,
            }
        )
    else:
        print(
            f"{description.title}: {ran.finished} of {count_of(ran.runs, 'run')} done, "
            f"{ran.done} of them now, in {results}"
        )
        if ran.left_out:
            print(f"{count_of(ran.left_out, 'run')} left out: they need more threads than this machine has cores")
        for line in ran.failed:
            print(f"failed: {line}")
        words = [name, *(["--reduced"] if reduced else []), *(["--results", results] if results != RESULTS else [])]
        print(f"leafcut lab report {shlex.join(words)} writes the page")
    return 1 if ran.failed else 0


def report_experiment(
    name: Annotated[
        str,
        Parameter(
            name="NAME",
            help=(
                "an experiment of `leafcut lab list`, a TOML file that describes one, or `published` to compare "
                "all published figures with ours"
            ),
        ),
    ],
    /,
    *,
    output: Annotated[File, Parameter(name=["--output", "-o"], help="the folder to write into")] = File("."),
    reduced: _Reduced = False,
    results: _Results = File(RESULTS),
    as_json: Json = False,
) -> int:
    """Write the page (HTML) and the table (CSV) of the finished runs of an experiment."""
    from leafcut.lab.page import experiment_page_html, rows_as_csv
    from leafcut.lab.running import has_enough_cores, stored_rows
    from leafcut.lab.store import Store

    if name == PUBLISHED:
        return _write_published_report(output, reduced, results, as_json)
    description = _load_experiment(name, reduced)
    with Store(results, read_only=True) as store:
        rows = stored_rows(description, store)
    n_possible = sum(has_enough_cores(description, plan) for plan in description.runs())
    page = experiment_page_html(description, rows, n_possible, description.n_runs - n_possible)
    stem = Path(output) / (description.name + ("_reduced" if reduced else ""))
    files = {f"{stem}.html": page, f"{stem}.csv": rows_as_csv(description, rows)}
    for file in files:
        check_output(file, [results, name if name.endswith(".toml") else None])
    write_all_or_none(files)
    if as_json:
        print_json({"experiment": description.storage_key, "rows": len(rows), "files": list(files)})
    else:
        print(f"{description.title}: {' and '.join(files)}")
    return 0


def _write_published_report(output: str, reduced: bool, results: str, as_json: bool) -> int:
    """Write the pages (HTML, one for each language) and the table (CSV) of published figures beside ours."""
    from leafcut.lab.loading import load_experiment, reduced_experiment
    from leafcut.lab.page import published_page_html
    from leafcut.lab.published import LANGUAGES, Runs, command_options, page_texts, pairs_as_csv, published_experiments
    from leafcut.lab.running import stored_rows
    from leafcut.lab.store import Store

    runs = {}
    with Store(results, read_only=True) as store:
        for name in published_experiments():
            whole = load_experiment(name)
            description = reduced_experiment(whole) if reduced else whole
            runs[name] = Runs(whole, description, stored_rows(description, store))
    options = command_options(reduced, "" if results == RESULTS else results)
    stem = Path(output) / (PUBLISHED + ("_reduced" if reduced else ""))
    files = {
        f"{stem}{'' if language == 'en' else f'_{language}'}.html": published_page_html(runs, language, options)
        for language in LANGUAGES
    }
    files[f"{stem}.csv"] = pairs_as_csv(runs)
    for file in files:
        check_output(file, [results])
    write_all_or_none(files)
    n_rows = sum(len(item.rows) for item in runs.values())
    if as_json:
        print_json({"experiment": PUBLISHED, "rows": n_rows, "files": list(files)})
    else:
        print(f"{page_texts('en')['title']}: {', '.join(files)}")
    return 0


def tune_parameters(
    sources: Annotated[
        list[str],
        Parameter(name="SOURCE", help="inputs of the same kind: files, folders, file lists, examples or random maps"),
    ],
    /,
    *,
    algorithm: Annotated[Name, Parameter(name="--algorithm", help="the algorithm whose parameters are tuned")],
    output: Annotated[File, Parameter(name=["--output", "-o"], help="the folder to write into")] = File("."),
    process: Annotated[Name, Parameter(name="--process", help="command to run: a process, or solve for maps")] = Name(
        "auto"
    ),
    options_file: Annotated[
        File | None, Parameter(name="--options", help="a TOML file of options for all runs")
    ] = None,
    trials: Annotated[int, Parameter(name="--trials", help="number of parameter sets to try")] = 50,
    seeds: Annotated[int, Parameter(name="--seeds", help="number of runs of each set on each input")] = 3,
    iterations: Annotated[
        int | None, Parameter(name="--iterations", help="iterations of each run (default: 50, without --time-limit)")
    ] = None,
    time_limit: Annotated[
        Time | None,
        Parameter(
            name="--time-limit", help="time limit of each run; the number of ants or fireflies is then tuned as well"
        ),
    ] = None,
    hold_out: Annotated[
        Percent, Parameter(name="--hold-out", help="share of the inputs that is reserved for the evaluation")
    ] = Percent("30%"),
    seed: Annotated[int, Parameter(name="--seed", help="random seed of the search")] = 1,
    results: _Results = File(RESULTS),
    mixed: _Mixed = False,
    executor: _Executor = Name(HERE),
    workers: _Workers = None,
    as_json: Json = False,
) -> int:
    """Tune the parameters of an algorithm on some inputs, and evaluate them on the others."""
    from leafcut.cli.several import expand_folders_and_lists, expand_inputs
    from leafcut.lab.page import experiment_page_html, rows_as_csv
    from leafcut.lab.tuning import TuningTask, command_for_process, options_file_text, tune, tuning_block

    inputs, _ = expand_inputs(expand_folders_and_lists(sources), "tune", folder=output)
    shared = read_options_file(Path(options_file)) if options_file else {}
    budget = {"iterations": iterations, "time_limit": time_limit}
    shared |= {name: value for name, value in budget.items() if value is not None}
    if shared.keys() >= budget.keys():
        raise OptionError("--iterations and --time-limit exclude each other; give one of them")
    if not shared.keys() & budget.keys():
        shared["iterations"] = _USUAL_ITERATIONS
    share = convert_value("hold_out", _HOLD_OUT, hold_out)
    task = TuningTask(algorithm, tuple(inputs), shared, command_for_process(process), trials, seeds, share, seed)
    stem = Path(output) / f"tune_{algorithm}"
    files = [f"{stem}{end}" for end in (".toml", ".html", ".csv")]
    for file in files:
        check_output(file, [results, options_file, *(source for source in inputs if ":" not in source)])
    with _open_store_and_executor(results, executor, workers) as (store, run_options):
        tuned = tune(task, store, mixed=mixed, **run_options)
    n_runs = tuned.judging.n_runs if tuned.parameters else 0
    page = experiment_page_html(tuned.judging, tuned.rows, n_runs, before=[tuning_block(tuned)])
    texts = (options_file_text(tuned), page, rows_as_csv(tuned.judging, tuned.rows))
    write_all_or_none(dict(zip(files, texts, strict=True)))
    if as_json:
        print_json(
            {
                "algorithm": algorithm,
                "trials": len(tuned.trials),
                "parameters": dict(tuned.parameters),
                "learnt_on": [instance.name for instance in task.split_inputs()[0]],
                "judged_on": [instance.name for instance in task.split_inputs()[1]],
                "change_percent": None if tuned.change is None else 100.0 * tuned.change,
                "files": files,
            }
        )
    else:
        print(tuned.summary_sentence())
        print(f"wrote {', '.join(files)}")
    return 0


@contextmanager
def _open_store_and_executor(
    results: str, executor: str, workers: int | None
) -> Iterator[tuple[Store, dict[str, Any]]]:
    """Open the results, and yield them with arguments of `lab.running.execute_experiment`; an interrupt becomes a
    short error message.
    """
    from leafcut.lab.running import executor_performer
    from leafcut.lab.store import Store
    from leafcut.order.executors import MOST_WORKERS, open_executor

    if workers is not None and executor == HERE:
        raise OptionError("--workers needs --executor")
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise OptionError(f"--workers: choose 1 to {MOST_WORKERS}")
    ended = threading.Event()
    with Store(results) as store, Reporter() as reporter, ExitStack() as opened:
        performer = None
        if executor != HERE:
            performer = executor_performer(opened.enter_context(open_executor(executor, workers or 0)), ended)
        try:
            yield store, {"performer": performer, "progress": reporter, "cancelled": ended}
        except KeyboardInterrupt:
            raise OptionError("interrupted; finished runs are kept, and the same command continues") from None


def _load_experiment(name: str, reduced: bool) -> Any:
    from leafcut.lab.loading import load_experiment, reduced_experiment

    experiment = load_experiment(name)
    return reduced_experiment(experiment) if reduced else experiment
