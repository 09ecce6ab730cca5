"""Many inputs: each program equals a single run, a broken input harms no other, and finished inputs are skipped."""

from __future__ import annotations

import csv
import json
import os
import pickle
import random
import time
from pathlib import Path
from typing import Any

import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.order import executors
from page_parser import Page


def program(seed: int) -> str:
    """Return a program with six holes."""
    place = random.Random(seed)
    holes = "".join(f"X{place.randint(0, 200)} Y{place.randint(0, 150)}\n" for _ in range(5))
    return f"G21 G90 G17 G54\nT1 M6\nS1200 M3\nG0 Z10\nG98 G81 X5 Y5 Z-5 R2 F120\n{holes}G80\nG0 Z50\nM30\n"


def folder_of(folder: Path, count: int, broken: int = -1) -> Path:
    """Write this number of programs, and create a folder for the results."""
    (folder / "in").mkdir()
    (folder / "out").mkdir()
    for k in range(count):
        text = program(k)
        (folder / "in" / f"p{k:03}.nc").write_text(text.replace("G81 X", "G81 Q X") if k == broken else text)
    return folder


WORDS = ["--machine", "linuxcnc-mill", "--preset", "fast", "--executor", "threads", "--workers", "1", "--no-defaults"]


def batch(folder: Path, *words: str) -> int:
    return run(["optimize", str(folder / "in"), "-o", str(folder / "out"), *WORDS, *words])


def table(folder: Path) -> list[dict[str, str]]:
    with (folder / "out" / "batch.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_of_six_programs_one_is_broken_and_the_others_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_of(tmp_path, 6, broken=4)
    assert batch(folder) == 1
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert "p004.nc:5" in said.err
    assert "refused   1 input" in said.out and "5 files in" in said.out
    rows = table(folder)
    assert [row["state"] for row in rows].count("written") == 5
    assert sorted(one.name for one in (folder / "out").glob("*.nc")) == [f"p{k:03}.nc" for k in range(6) if k != 4]
    alone = api.optimize(rows[0]["input"], machine="linuxcnc-mill", preset="fast")
    assert (folder / "out" / rows[0]["program"]).read_bytes() == alone.text.encode(alone.encoding)
    assert float(rows[0]["after_s"]) == pytest.approx(alone.after.time_s, abs=1e-3)
    page = Page((folder / "out" / "batch.html").read_text(encoding="utf-8"))
    assert "5 programs written · 1 refused" in page.words
    assert "script" not in page.tags


def test_it_goes_on_where_it_was_cut_short_and_does_again_what_is_not_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_of(tmp_path, 4)
    assert batch(folder) == 0
    out = folder / "out"
    past = time.time_ns() - 10**12
    for one in out.glob("*.nc"):
        os.utime(one, ns=(past, past))
    lines = (out / "batch.csv").read_text().splitlines(keepends=True)
    (out / "batch.csv").write_text("".join(lines[:4]) + lines[4][:40])  # killed while it wrote the last line
    (out / "p001.nc").write_text("changed by hand")
    assert batch(folder) == 1
    assert (out / "p001.nc").read_text() == "changed by hand"
    (out / "p001.nc").unlink()
    (folder / "in" / "p002.nc").write_text(program(99))
    assert batch(folder) == 0
    new = {one.name for one in out.glob("*.nc") if one.stat().st_mtime_ns != past}
    assert new == {"p001.nc", "p002.nc", "p003.nc"}
    capsys.readouterr()
    assert batch(folder, "--json") == 0
    assert [row["done_before"] for row in json.loads(capsys.readouterr().out)["runs"]] == [True] * 4
    assert batch(folder, "--seed", "5") == 0
    assert {one.stat().st_mtime_ns == past for one in out.glob("*.nc")} == {False}


def test_a_list_names_inputs_from_where_it_lies(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, 3)
    (folder / "in" / "two.list").write_text("# of the day\np002.nc\n\np000.nc\n")
    assert run(["optimize", str(folder / "in" / "two.list"), "-o", str(folder / "out"), *WORDS, "-q"]) == 0
    assert [Path(row["input"]).name for row in table(folder)] == ["p002.nc", "p000.nc"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["no_such.list", "-o", "."], "cannot be read as a list"),
        ([".", "-o", "."], "this folder has no drawing and no program"),
        (["a.nc", "b.nc", "-o", "gone"], "not a folder"),
        (["a.nc", "b.nc", "-o", ".", "--workers", "0"], "--workers: choose 1 to 1024"),
        (["a.nc", "b.nc", "-o", ".", "--executor", "thread"], "--executor: unknown value 'thread'"),
        (["a.nc", "b.nc", "-o", ".", "--save-plan", "x.json"], "--save-plan: names one file"),
        (["a.nc", "b.nc", "-o", ".", "--executor", "dask://127.0.0.1:1"], "no Dask scheduler responds"),
    ],
)
def test_a_wrong_command_line_is_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], line: str
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(executors, "CONNECT_SECONDS", 0.1)
    assert run(["optimize", *words]) in (1, 2)
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_table_of_another_kind_and_inputs_are_never_overwritten(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, 1)
    (folder / "out" / "batch.csv").write_text("a,b\n1,2\n")
    assert batch(folder) == 1
    assert (folder / "out" / "batch.csv").read_text() == "a,b\n1,2\n"
    before = (folder / "in" / "p000.nc").read_text()
    assert run(["optimize", str(folder / "in"), "-o", str(folder / "in"), *WORDS]) == 1
    assert (folder / "in" / "p000.nc").read_text() == before


def test_options_of_the_command_line_can_be_sent_to_worker_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are plain texts: a type made while leafcut runs is unknown to a worker."""
    sent: dict[str, Any] = {}
    monkeypatch.setattr("leafcut.cli.batch.run_batch", lambda inputs, programs, given, **_: sent.update(given) or [])
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    for name in ("a.nc", "b.nc"):
        Path(name).write_text("G21 G90\nG0 X1. Y1. Z5.\nM2\n")
    words = ["--machine", "linuxcnc-mill", "--keep-out", "0 0 1 1", "--time-limit", "1s", "--air"]
    run(["reorder", "a.nc", "b.nc", "-o", "out", *words, "--no-defaults"])
    assert sent["machine"] == "linuxcnc-mill"
    assert pickle.loads(pickle.dumps(sent)) == sent
