"""Tuning: the test instances are never used for training, no run is repeated, and the best set wins."""

from __future__ import annotations

import json
import threading
import tomllib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.lab.running import Answer, RunTask
from leafcut.lab.store import Store
from leafcut.lab.tuning import RANGES, TuningTask, command_for_process, options_file_text, tune, tuning_block
from leafcut.processes.settings import group_of

INPUTS = tuple(f"random:12:{k}" for k in range(1, 7))


def task(**changes: Any) -> TuningTask:
    words: dict[str, Any] = {"command": "solve", "trials": 8, "seeds": 2, "hold_out": 0.34} | changes
    inputs = words.pop("inputs", INPUTS)
    return TuningTask(words.pop("algorithm", "mmas"), inputs, words.pop("options", {"iterations": 3}), **words)


class Formula:
    """Computes runs by a formula of their options, and counts them; sets the event `ends` after a number of runs."""

    def __init__(self, cost: Callable[[dict[str, Any]], float | None], ends: tuple[int, threading.Event] | None = None):
        self.cost, self.ends, self.done = cost, ends, list[RunTask]()

    def __call__(self, tasks: Iterable[RunTask]) -> Iterator[tuple[RunTask, Answer]]:
        for one in tasks:
            self.done.append(one)
            cost = self.cost(dict(one.options))
            yield one, Answer(failed="refused") if cost is None else Answer({"length": cost, "time": 1.0})
            if self.ends and len(self.done) >= self.ends[0]:
                self.ends[1].set()
                return


def bowl(options: dict[str, Any]) -> float:
    """Return a cost that is 100 at 20 candidates, and 200 for the defaults."""
    return 100.0 + 5.0 * abs(options["candidates"] - 20) if "candidates" in options else 200.0


def test_the_best_trial_is_what_is_judged_and_its_change_is_that_of_the_formula(tmp_path: Path) -> None:
    with Store(tmp_path / "r.sqlite") as store:
        found = tune(task(trials=20), store, performer=Formula(bowl))
    costs = [trial.cost for trial in found.trials]
    assert costs == [pytest.approx(bowl(dict(trial.parameters)) / 200.0) for trial in found.trials]
    best = min(range(20), key=lambda k: costs[k] or 0.0)
    assert found.parameters == found.trials[best].parameters
    assert found.change == pytest.approx((costs[best] or 0.0) - 1.0)
    assert abs(found.parameters["candidates"] - 20) <= 3


def test_the_search_sees_neither_the_inputs_nor_the_seeds_that_judge(tmp_path: Path) -> None:
    wanted = task()
    learnt, held = ([one.name for one in part] for part in wanted.split_inputs())
    assert sorted(learnt + held) == sorted(INPUTS)
    assert len(held) == 2
    with Store(tmp_path / "r.sqlite") as store:
        found = tune(wanted, store, performer=Formula(bowl))
        rows = store.rows("tune_mmas")
    judged = [row for row in rows if row in found.rows]
    searched = [row for row in rows if row not in found.rows]
    assert {row.instance for row in judged} == set(held)
    assert {row.instance for row in searched} == set(learnt)
    assert not {row.seed for row in judged} & {row.seed for row in searched}
    assert len(judged) == 2 * 2 * 2
    assert len(searched) == (1 + 8) * 4 * 2


def test_after_an_interruption_the_same_search_goes_on_and_repeats_no_run(tmp_path: Path) -> None:
    with Store(tmp_path / "whole.sqlite") as store:
        whole = tune(task(), store, performer=Formula(bowl))
        number = len(store.rows("tune_mmas"))
    ended = threading.Event()
    first, second = Formula(bowl, (21, ended)), Formula(bowl)
    with Store(tmp_path / "r.sqlite") as store:
        broken = tune(task(), store, performer=first, cancelled=ended)
        assert not broken.finished
        again = tune(task(), store, performer=second)
    assert (again.trials, again.parameters, again.change) == (whole.trials, whole.parameters, whole.change)
    assert len(first.done) + len(second.done) == number
    assert not {one.key for one in first.done} & {one.key for one in second.done}


def test_a_set_that_is_refused_is_told_and_the_search_goes_on(tmp_path: Path) -> None:
    def half(options: dict[str, Any]) -> float | None:
        return None if options.get("candidates", 30) < 20 else bowl(options)

    with Store(tmp_path / "r.sqlite") as store:
        found = tune(task(trials=12), store, performer=Formula(half))
    refused = [trial for trial in found.trials if trial.cost is None]
    assert refused
    assert all(trial.parameters["candidates"] < 20 for trial in refused)
    assert found.parameters["candidates"] >= 20
    assert any(row[1] == "refused" for row in tuning_block(found).tables[1].rows)


def test_defaults_that_are_refused_end_it_in_one_line(tmp_path: Path) -> None:
    with Store(tmp_path / "r.sqlite") as store, pytest.raises(OptionError, match="the defaults are refused: refused"):
        tune(task(), store, performer=Formula(lambda _: None))


def test_an_input_that_costs_nothing_is_told_and_not_divided_by(tmp_path: Path) -> None:
    with Store(tmp_path / "r.sqlite") as store, pytest.raises(OptionError, match=r"random:12:\d: its cost is 0"):
        tune(task(), store, performer=Formula(lambda _: 0.0))


def test_what_is_done_is_asked_for_by_the_words_of_a_process() -> None:
    assert [command_for_process(word) for word in ("auto", "solve", "reorder", "drill")] == [
        "optimize",
        "solve",
        "reorder",
        "drill",
    ]
    for word in ("dig", "nest"):
        with pytest.raises(OptionError, match=f"--process: unknown process '{word}'; choose one of auto, drill"):
            command_for_process(word)


def test_where_nothing_is_better_the_defaults_stay_and_nothing_is_judged(tmp_path: Path) -> None:
    with Store(tmp_path / "r.sqlite") as store:
        found = tune(task(), store, performer=Formula(lambda o: 2.0 if "candidates" in o else 1.0))
    assert (found.parameters, found.rows, found.change) == ({}, (), None)
    assert "no set of 8 trials was better than the defaults on 4 inputs" in found.summary_sentence()
    assert tomllib.loads(options_file_text(found)) == {"schema": 1, "solve": {"algorithm": "mmas"}}


@pytest.mark.parametrize("algorithm", sorted(RANGES))
def test_every_range_lies_within_the_bounds_of_its_option(algorithm: str) -> None:
    for one in RANGES[algorithm]:
        spec = group_of(one.name).specs()[one.name]
        assert one.low < one.high
        assert spec.minimum is None or one.low >= spec.minimum
        assert spec.maximum is None or one.high <= spec.maximum
        assert spec.kind in (("whole",) if one.whole else ("number", "percent"))


def test_the_number_of_ants_is_sought_only_where_time_is_the_budget() -> None:
    by_steps = {one.name for one in task().ranges}
    by_time = {one.name for one in task(options={"time_limit": "1s"}).ranges}
    assert by_time - by_steps == {"n_ants"}


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"algorithm": "colony"}, "--algorithm: cannot tune 'colony'"),
        ({"inputs": INPUTS[:2]}, "2 inputs: give 3 to 1000"),
        ({"inputs": (*INPUTS, INPUTS[0])}, "random:12:1: is given for tuning and for evaluation"),
        ({"hold_out": 1.0}, "--hold-out: choose a share"),
        ({"trials": 0}, "--trials: choose 1 to"),
        ({"seeds": 0}, "--seeds: choose 1 to"),
        ({"options": {"candidates": 8}}, "--candidates: is set by the search"),
        ({"options": {"seed": 8}}, "--seed: is set by the search"),
    ],
)
def test_what_cannot_be_tuned_is_refused_in_one_line(changes: dict[str, Any], line: str) -> None:
    with pytest.raises(OptionError, match=line):
        task(**changes)


def test_by_the_command_it_is_written_as_options_that_a_run_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["lab", "tune", *INPUTS, "--algorithm", "as", "--process", "solve", "--trials", "3", "--seeds", "1"]
    words += ["--iterations", "4", "--results", str(tmp_path / "r.sqlite"), "-o", str(tmp_path), "--json"]
    options = tmp_path / "shared.toml"
    options.write_text("[solve]\nlocal_search = false\n")
    words += ["--options", str(options)]
    assert run(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["trials"] == 3
    assert [Path(file).name for file in answer["files"]] == ["tune_as.toml", "tune_as.html", "tune_as.csv"]
    assert "Best parameter set" in (tmp_path / "tune_as.html").read_text()
    plate = ["optimize", "example:plate-10", "--depth", "3", "--no-bound", "--iterations", "2", "--json", "--dry-run"]
    assert run([*plate, "--options", str(tmp_path / "tune_as.toml")]) == 0
    assert json.loads(capsys.readouterr().out)["algorithm"] == "as"
    options.write_text("[solve]\ntime_limit = 1\n")
    timed = ["--options", str(options), "--iterations", "5"]
    for wrong in (["--iterations", "5", "--time-limit", "1s"], timed, ["--hold-out", "much"], ["--process", "dig"]):
        assert run(["lab", "tune", *INPUTS, "--algorithm", "as", *wrong, "-o", str(tmp_path)]) == 2
        said = capsys.readouterr().err
        assert said.startswith("leafcut: --")
        assert said.count("\n") == 1
