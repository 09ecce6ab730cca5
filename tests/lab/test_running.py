"""An interrupted experiment continues: it repeats and loses no finished run; each run equals its command."""

from __future__ import annotations

import itertools
import json
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lab_descriptions import SMALL, written
from test_store import ROW

from leafcut import api
from leafcut._version import __version__
from leafcut.errors import OptionError, VerifyError
from leafcut.lab import running
from leafcut.lab.analysis_blocks import blocks_of_all_analyses
from leafcut.lab.loading import load_experiment
from leafcut.lab.results import Results
from leafcut.lab.running import (
    Answer,
    RunTask,
    execute_experiment,
    execute_run,
    executor_performer,
    latest_search_curve,
    stored_rows,
    task_for_plan,
)
from leafcut.lab.store import Store
from leafcut.model.heartbeat import Progress
from leafcut.model.study import Study
from leafcut.order.executors import open_executor
from leafcut.read.machine import machine_template


def counted(done: list[str], most: int = 1000) -> running.Performer:
    """Return a performer that records its tasks and stops after `most` of them, like a killed program."""

    def perform_some(tasks: Iterable[RunTask]) -> Iterator[tuple[RunTask, Answer]]:
        for task in list(tasks)[:most]:
            done.append(task.key)
            yield task, execute_run(task)

    return perform_some


def test_a_run_is_what_its_command_answers(tmp_path: Path) -> None:
    found = load_experiment(written(tmp_path))
    with Store(tmp_path / "r.sqlite") as store:
        ran = execute_experiment(found, store)
        rows = store.rows("small")
    assert (ran.runs, ran.finished, ran.done, ran.failed) == (12, 12, 12, ())
    assert len({row.key for row in rows}) == 12
    (row,) = [row for row in rows if (row.instance, row.levels["algorithm"], row.seed) == ("thirty", "acs", 2)]
    alone = api.solve(
        "random:30:5", algorithm="acs", seed=2, iterations=5, threads=1, bound=False, local_search=False
    ).solution
    assert row.responses == {"length": alone.cost}
    assert row.curve[-1][0] == alone.iterations
    assert row.curve[-1][2] == alone.cost
    assert (row.leafcut, row.options["seed"]) == (__version__, 2)
    assert "core" in row.machine
    assert {"python", "numpy", "numba"} <= row.versions.keys()


def test_a_curve_has_few_points_never_rises_and_ends_with_the_search() -> None:
    study = Study()
    study.begin()
    for number in range(1, 401):
        study.note(number, 0.1 * number, 1000.0 - 2.0 * min(number, 300))
    curve = list(latest_search_curve(study, 50))
    assert curve[0] == (1, 0.1, 998.0)
    assert curve[-1] == (400, 40.0, 400.0)
    assert len(curve) <= 51
    assert all(a[0] < b[0] and a[2] >= b[2] for a, b in itertools.pairwise(curve))


def test_a_pocket_has_the_curve_of_its_search_also_if_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def optimized(source: object, *, observe: Study, **options: object) -> object:
        observe.begin()
        for number, cost in enumerate((30.0, 20.0, 20.0), 1):
            observe.note(number, number / 8.0, cost)
        raise VerifyError("refused")

    monkeypatch.setattr(api, "optimize", optimized)
    answer = execute_run(RunTask("k", "pocket", "part.dxf", {}, {"machining": ("after.time_s", 1.0)}))
    assert answer.failed == "refused"
    assert answer.curve == ((1, 0.125, 30.0), (2, 0.25, 20.0), (3, 0.375, 20.0))


def test_what_is_finished_is_not_repeated_and_what_is_not_is_done(tmp_path: Path) -> None:
    found, first, second, third = load_experiment(written(tmp_path)), [], [], []
    with Store(tmp_path / "r.sqlite") as store:
        assert execute_experiment(found, store, performer=counted(first, 5)).stopped
    with Store(tmp_path / "r.sqlite") as store:
        ran = execute_experiment(found, store, performer=counted(second))
        assert not execute_experiment(found, store, performer=counted(third)).stopped
    assert (len(first), len(second), third) == (5, 7, [])
    assert not set(first) & set(second)
    assert (ran.finished, ran.done) == (12, 7)


def test_a_kill_in_the_middle_loses_no_finished_run_and_none_is_repeated(tmp_path: Path) -> None:
    description, file = written(tmp_path), tmp_path / "r.sqlite"
    code = f"""
from leafcut.lab import running
from leafcut.lab.loading import load_experiment
from leafcut.lab.store import Store
from leafcut.read.machine import machine_template
def tell(progress):
    print(progress.step, flush=True)
with Store({str(file)!r}) as store:
    running.execute_experiment(load_experiment({str(description)!r}), store, progress=tell)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout
    begun = [child.stdout.readline() for _ in range(5)]  # the fifth has begun: four are over
    os.kill(child.pid, signal.SIGKILL)
    child.communicate()
    assert "5 of 12" in begun[4]
    with Store(file) as store:
        kept = {row.key for row in store.rows("small")}
        again: list[str] = []
        ran = execute_experiment(load_experiment(description), store, performer=counted(again))
    assert len(kept) >= 4
    assert not kept & set(again)
    assert (ran.finished, len(again)) == (12, 12 - len(kept))


def test_a_run_that_is_refused_is_one_line_stops_no_other_and_is_tried_again(tmp_path: Path) -> None:
    text = SMALL.replace('input = "random:30:5"', 'input = "broken.csv"')
    (tmp_path / "broken.csv").write_text("x,y\n", encoding="utf-8")
    found = load_experiment(written(tmp_path, text))
    with Store(tmp_path / "r.sqlite") as store:
        ran = execute_experiment(found, store)
        assert (ran.finished, len(ran.failed)) == (6, 6)
        assert "broken.csv" in ran.failed[0]
        (tmp_path / "broken.csv").write_text("x,y\n1,1\n2,2\n3,1\n", encoding="utf-8")
        ran = execute_experiment(found, store)
        assert (ran.finished, ran.done, ran.failed) == (12, 6, ())


def test_a_file_that_changed_is_run_anew(tmp_path: Path) -> None:
    text = SMALL.replace('input = "random:30:5"', 'input = "map.csv"')
    (tmp_path / "map.csv").write_text("x,y\n1,1\n2,3\n3,1\n", encoding="utf-8")
    found = load_experiment(written(tmp_path, text))
    with Store(tmp_path / "r.sqlite") as store:
        execute_experiment(found, store)
        (tmp_path / "map.csv").write_text("x,y\n1,1\n2,3\n9,1\n", encoding="utf-8")
        assert execute_experiment(found, store).done == 6


def test_a_run_that_is_stopped_is_not_kept(tmp_path: Path) -> None:
    ended = threading.Event()

    def stop(progress: Progress) -> None:
        if "3 of 12" in progress.step:
            ended.set()

    with Store(tmp_path / "r.sqlite") as store:
        ran = execute_experiment(load_experiment(written(tmp_path)), store, progress=stop, cancelled=ended)
        assert ran.stopped
        assert len(store.rows("small")) == 2


def test_runs_of_another_version_are_mixed_only_when_that_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = load_experiment(written(tmp_path))
    with Store(tmp_path / "r.sqlite") as store:
        execute_experiment(found, store, performer=counted([], 5))
        monkeypatch.setattr(running, "__version__", "99.0")
        with pytest.raises(OptionError, match=r"but this version is 99\.0"):
            execute_experiment(found, store)
        assert execute_experiment(found, store, mixed=True).finished == 12
        assert {row.leafcut for row in store.rows("small")} > {"99.0"}


@pytest.mark.slow
def test_a_run_in_a_process_of_its_own_finds_the_same_and_its_start_counts(tmp_path: Path) -> None:
    text = SMALL.replace("seeds = 3", "seeds = 1\nnew_process = true").replace(
        "[[analysis]]", '[response.wall]\npath = "wall_s"\n[response.own]\npath = "seconds"\n[[analysis]]'
    )
    text = text.replace('input = "random:30:5"', 'input = "example:plate-10"')
    with Store(tmp_path / "r.sqlite") as store:
        execute_experiment(load_experiment(written(tmp_path, text)), store)
        rows = store.rows("small")
    assert len(rows) == 4
    for row in rows:
        here = api.solve(
            "example:plate-10",
            algorithm=row.levels["algorithm"],
            seed=1,
            iterations=5,
            threads=1,
            bound=False,
            local_search=False,
        )
        assert row.responses["length"] == here.solution.cost
        assert (row.responses["wall"] or 0.0) > (row.responses["own"] or math.inf)


def test_more_threads_than_cores_are_left_out_and_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = SMALL.replace("seeds = 3", 'seeds = 1\ncores = "threads"').replace("threads = 1, ", "")
    text = text.replace("[response", '[factor.threads]\noption = "threads"\nlevels = [1, 2, 3]\n[response', 1)
    monkeypatch.setattr(running, "_core_count", lambda: 2)
    with Store(tmp_path / "r.sqlite") as store:
        ran = execute_experiment(load_experiment(written(tmp_path, text)), store, performer=counted([]))
        assert (ran.runs, ran.left_out) == (8, 4)
        assert {row.levels["threads"] for row in store.rows("small")} == {"1", "2"}


def test_figures_are_found_by_their_path() -> None:
    answer = json.loads('{"a": {"b": [1, {"c": 2.5}]}, "t": true}')
    figure = running.__dict__["_number_at_path"]
    assert figure(answer, "a.b.1.c", 2.0) == 5.0
    for path in ("a.b.2", "a.x", "a", "t", "a.b.c"):
        assert figure(answer, path, 1.0) is None


def test_a_file_that_an_option_names_counts_by_its_content_wherever_it_lies(tmp_path: Path) -> None:
    text = SMALL.replace('command = "solve"', 'command = "drill"').replace(
        "options = {", 'options = {machine = "mine.toml", '
    )
    text = text.replace('path = "length"', 'path = "after.time_s"').replace("local_search = false", 'thickness = "6mm"')
    keys = []
    for name, profile in (("a", "x"), ("b", "x"), ("c", "y")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "mine.toml").write_text(machine_template("haas-vf2") + f"# {profile}\n", encoding="utf-8")
        description = load_experiment(written(folder, text))
        inputs = {plan.input: ("input", "hash") for plan in description.runs()}
        keys.append([task_for_plan(description, plan, inputs).key for plan in description.runs()])
    assert keys[0] == keys[1]
    assert not set(keys[0]) & set(keys[2])


def test_a_level_with_a_folder_reads_the_files_of_that_folder(tmp_path: Path) -> None:
    for folder, holes in (("a", "0,0\n3,4\n"), ("b", "0,0\n6,8\n")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "map.csv").write_text(f"x,y\n{holes}", encoding="utf-8")
    text = """
command = "solve"
options = {algorithm = "none", bound = false}
[[instance]]
name = "map"
input = "a/map.csv"
[factor.place]
level.here = {}
level.there = {folder = "b"}
[response.length]
path = "length"
"""
    description = load_experiment(written(tmp_path, text))
    with Store(tmp_path / "r.sqlite") as store:
        assert execute_experiment(description, store).failed == ()
        lengths = {row.levels["place"]: row.responses["length"] for row in stored_rows(description, store)}
    assert lengths == pytest.approx({"here": 10.0, "there": 20.0})


@pytest.mark.slow
def test_runs_in_processes_give_the_results_of_runs_in_this_process(tmp_path: Path) -> None:
    of = load_experiment(written(tmp_path))
    with Store(tmp_path / "here.sqlite") as store:
        execute_experiment(of, store)
        here = stored_rows(of, store)
    with Store(tmp_path / "there.sqlite") as store, open_executor("processes", 2) as executor:
        assert execute_experiment(of, store, performer=executor_performer(executor, threading.Event())).done == 12
        there = stored_rows(of, store)
    assert [(row.key, row.responses) for row in there] == [(row.key, row.responses) for row in here]


def test_threads_are_refused_as_their_processor_time_cannot_be_told_apart() -> None:
    with open_executor("threads", 2) as executor, pytest.raises(OptionError, match="only one run at a time"):
        executor_performer(executor, threading.Event())


def test_runs_that_differ_in_threads_alone_are_one_run_where_the_answer_is_judged(tmp_path: Path) -> None:
    """The same seed gives the same tour on any number of threads: counted twice, it would prove what it does not."""
    text = SMALL.replace("threads = 1, ", "").replace("seeds = 3", 'seeds = 3\ncores = "threads"')
    threads = '[factor.threads]\noption = "threads"\nlevels = [1, 2]\n[response.length]'
    one, both = (
        load_experiment(str(written(tmp_path, t, f"{n}.toml")))
        for n, t in (("one", SMALL), ("both", text.replace("[response.length]", threads)))
    )
    found = []
    for description in (one, both):
        with Store(tmp_path / f"{description.name}.sqlite") as store:
            execute_experiment(description, store)
            found.append(blocks_of_all_analyses(Results.from_rows(description, stored_rows(description, store)))[0])
    assert found[0].words == found[1].words
    assert [table.rows for table in found[0].tables] == [table.rows for table in found[1].tables]


def test_a_refused_run_keeps_the_figures_of_its_search(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = load_experiment(written(tmp_path))

    def refuse(*_: object, observe: Study, **__: object) -> object:
        observe.begin()
        observe.note(1, 0.5, 80.0, np.array([90.0, 95.0]))
        observe.note(2, 0.75, 80.0, np.array([85.0, 99.0]))
        raise VerifyError("passes lie too far apart")

    monkeypatch.setattr(running.api, "optimize", refuse)
    paths = ("search.cost", "search.own_cost", "search.seconds", "after.time_s")
    task = RunTask("key", "pocket", "example:pocket", {}, {path: (path, 1.0) for path in paths})
    answer = execute_run(task)
    assert answer.failed == "passes lie too far apart"
    assert answer.responses == {
        "search.cost": 80.0,
        "search.own_cost": 85.0,
        "search.seconds": 0.75,
        "after.time_s": None,
    }
    plan = next(iter(found.runs()))
    levels = {name: level.name for name, level in plan.levels.items()}
    row = replace(ROW, instance=plan.instance.name, levels=levels, seed=plan.seed, responses={"length": 80.0})
    results = Results.from_rows(found, [replace(row, failed=answer.failed)])
    assert list(results.values_by_cell("length").values()) == [[80.0]]
    assert results.finished_rows == ()
    assert results.missing_count(1) == len(found.seeds) - 1


def test_a_response_is_a_sum_of_the_first_figures_that_exist() -> None:
    task = RunTask("key", "cut", "x", {}, {"d": ("a.b + c|e", 2.0), "none": ("a.b + c", 1.0)})
    assert running._response_values({"a": {"b": 1.0}, "e": 3.0}, task) == {"d": 8.0, "none": None}


def test_runs_are_in_random_order_within_each_round(tmp_path: Path) -> None:
    plans = list(load_experiment(written(tmp_path)).runs())
    order = running.shuffled_by_seed(plans, "small")
    assert [plan.seed for plan in order] == [plan.seed for plan in plans]
    assert {plan.label for plan in order} == {plan.label for plan in plans}
    assert [plan.label for plan in order] != [plan.label for plan in plans]
    assert [plan.label for plan in running.shuffled_by_seed(plans, "small")] == [plan.label for plan in order]
