"""The command `leafcut lab`: every shipped experiment runs in its reduced form and is reported."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
from pathlib import Path

import pytest
from lab_descriptions import SMALL, written

from leafcut.cli.app import run
from leafcut.lab import loading
from leafcut.lab.loading import included_names, load_experiment, reduced_experiment, titles_of_included_experiments
from page_parser import Page


def lab(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Return exit status, standard output and standard error of a command line."""
    status = run(["lab", *words])
    output = capsys.readouterr()
    return status, output.out, output.err


@pytest.mark.parametrize("name", ["small", *(pytest.param(name, marks=pytest.mark.slow) for name in included_names())])
def test_every_experiment_runs_in_its_reduced_form_and_is_reported(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "r.sqlite")
    if name == "small":
        name = str(written(tmp_path))
    short = reduced_experiment(load_experiment(name))
    status, out, err = lab(capsys, "run", name, "--reduced", "--results", file, "--json")
    answer = json.loads(out)
    assert (status, answer["failed"], err) == (0, [], "")
    assert answer["done"] == answer["finished"] == answer["runs"] == short.n_runs - answer["left_out"]
    status, out, _ = lab(capsys, "report", name, "--reduced", "--results", file, "-o", str(tmp_path), "--json")
    assert status == 0
    html, table = (Path(one) for one in json.loads(out)["files"])
    rows = list(csv.DictReader(io.StringIO(table.read_text(encoding="utf-8"))))
    assert len(rows) == answer["runs"]
    # A strategy without a search has no figures of one.
    values = [(row[one.name], one.path) for row in rows for one in short.responses]
    assert all("search." in path if value == "" else float(value) >= 0.0 for value, path in values)
    words = Page(html.read_text(encoding="utf-8")).words
    assert short.title in words
    assert "proves nothing" in words


@pytest.mark.parametrize("results", ["own results.sqlite", ""])
def test_the_command_that_a_finished_experiment_prints_writes_its_page(
    results: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the results are kept in a file of their own, with a space in its name."""
    monkeypatch.chdir(tmp_path)
    name = written(tmp_path).name
    status, out, _ = lab(capsys, "run", name, "--reduced", *(["--results", results] if results else []))
    (command,) = re.findall(r"^leafcut lab (report .+) writes the page$", out, re.MULTILINE)
    assert (status, lab(capsys, *shlex.split(command))[0]) == (0, 0)
    assert list(tmp_path.glob("*.html"))


def test_the_list_shows_the_finished_runs_of_each_experiment(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file, names = str(tmp_path / "r.sqlite"), ("machining_time", "boards")
    titles = titles_of_included_experiments()
    monkeypatch.setattr(loading, "titles_of_included_experiments", lambda: {name: titles[name] for name in names})
    assert lab(capsys, "list", "--results", file)[0] == 0
    assert not Path(file).exists()
    run_again = [lab(capsys, "run", names[0], "--reduced", "--results", file, "--json")[1] for _ in range(2)]
    assert [json.loads(answer)["done"] for answer in run_again] == [8, 0], "finished runs are not repeated"
    rows = {row["name"]: row for row in json.loads(lab(capsys, "list", "--results", file, "--json")[1])["experiments"]}
    assert rows.keys() == {*names}
    assert [row["done"] for row in rows.values()] == [0, 0], "the reduced form is an experiment of its own"
    assert [row["reduced_done"] for row in rows.values()] == [8, 0]


def test_the_report_has_only_current_runs_and_no_failure_that_was_repeated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, text = str(tmp_path / "r.sqlite"), SMALL.replace('input = "random:30:5"', 'input = "map.csv"')
    description = str(written(tmp_path, text))
    (tmp_path / "map.csv").write_text("x,y\n", encoding="utf-8")
    status, out, _ = lab(capsys, "run", description, "--results", file)
    assert status == 1
    assert "6 of 12 runs done" in out
    assert out.count("failed: thirty") == 6
    (tmp_path / "map.csv").write_text("x,y\n1,1\n2,2\n3,1\n", encoding="utf-8")
    assert lab(capsys, "run", description, "--results", file)[0] == 0
    written(tmp_path, text.replace("iterations = 5", "iterations = 6"))  # another experiment
    assert lab(capsys, "run", description, "--results", file)[0] == 0
    assert lab(capsys, "report", description, "--results", file, "-o", str(tmp_path))[0] == 0
    rows = list(csv.DictReader(io.StringIO((tmp_path / "small.csv").read_text(encoding="utf-8"))))
    assert len(rows) == 12
    assert not any(row["failed"] for row in rows)


@pytest.mark.parametrize(
    ("words", "status", "line"),
    [
        (("run", "thesys"), 2, "unknown experiment 'thesys'; did you mean 'thesis'"),
        (("run", "{here}/none.toml"), 2, "none.toml: file not found"),
        (("run", "{here}/small.toml", "--results", "{here}"), 1, "a folder; --results names a file"),
        (("run", "{here}/small.toml", "--results", "{here}/small.toml"), 1, "this is not a results file of leafcut"),
        (("run", "{here}/small.toml", "--results", "{here}/no/r.sqlite"), 1, "unable to open"),
        (("report", "{here}/small.toml", "--results", "{here}/r.sqlite"), 1, "no results here yet"),
        (("report", "{here}/small.toml", "--reduced", "--results", "{here}/r.sqlite"), 1, "no results here yet"),
        (("report", "published", "--results", "{here}/r.sqlite"), 1, "no results here yet"),
        (("report", "published", "--results", "{here}/small.toml"), 1, "this is not a results file of leafcut"),
        (("report", "publishd", "--results", "{here}/r.sqlite"), 2, "unknown experiment 'publishd'"),
    ],
)
def test_bad_input_is_one_line(
    words: tuple[str, ...], status: int, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path)
    before = sorted(tmp_path.iterdir())
    found, out, err = lab(capsys, *(word.format(here=tmp_path) for word in words))
    assert (found, out) == (status, "")
    assert line in err
    assert err.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def test_a_wrong_file_of_an_experiment_is_refused_as_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A wrong file has status 1, an unknown name (wrong usage) has status 2."""
    file = tmp_path / "mine.toml"
    file.write_text("titel = 3\n")
    assert run(["lab", "run", str(file)]) == 1
    assert "unknown key 'titel'" in capsys.readouterr().err
    assert run(["lab", "run", "no_such_experiment"]) == 2
