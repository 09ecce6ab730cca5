"""Results survive a crash of the program: finished runs are kept, and files of others are not touched."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from leafcut.errors import LeafcutError
from leafcut.lab.store import Row, Store

ROW = Row(
    "k1",
    "small",
    "ten",
    {"algorithm": "as"},
    1,
    {"iterations": 5, "seed": 1},
    "ab" * 32,
    "",
    {"length": 12.5, "gap": None},
    ((0, 0.0, 14.0), (3, 0.25, 12.5)),
    "2026-01-01T00:00:00+00:00",
    "1.0",
    {"numpy": "2.0"},
    "a machine",
    0.5,
)


def test_a_row_comes_back_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "r.sqlite"
    with Store(file) as store:
        store.add(ROW)
        store.add(replace(ROW, key="k2", experiment="other"))
    with Store(file, read_only=True) as store:
        assert store.rows("small") == [ROW]
        assert store.successful_run_counts() == {"small": 1, "other": 1}


def test_a_run_that_failed_is_replaced_and_not_counted(tmp_path: Path) -> None:
    with Store(tmp_path / "r.sqlite") as store:
        store.add(replace(ROW, failed="no"))
        assert store.successful_run_counts() == {}
        store.add(ROW)
        assert store.rows("small") == [ROW]


def test_what_was_added_before_a_kill_is_there(tmp_path: Path) -> None:
    file = tmp_path / "r.sqlite"
    code = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_store import ROW
from dataclasses import replace
from leafcut.lab.store import Store
with Store({str(file)!r}) as store:
    for k in range(3):
        store.add(replace(ROW, key=str(k)))
    print("added", flush=True)
    sys.stdin.read()
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout
    assert child.stdout.readline() == "added\n"
    os.kill(child.pid, signal.SIGKILL)
    child.communicate()
    with Store(file) as store:
        assert [row.key for row in store.rows("small")] == ["0", "1", "2"]


def test_files_that_are_none_of_ours_are_refused_and_left_as_they_are(tmp_path: Path) -> None:
    text, other, newer, broken = (tmp_path / name for name in ("a.txt", "b.sqlite", "c.sqlite", "d.sqlite"))
    text.write_text("my notes, all of them", encoding="utf-8")
    with sqlite3.connect(other) as data:
        data.execute("create table t (x)")
    data.close()
    with Store(newer) as store:
        store.add(ROW)
    with sqlite3.connect(newer) as data:
        data.execute("pragma user_version = 2")
    data.close()
    with Store(broken) as store:
        store.add(ROW)
    broken.write_bytes(broken.read_bytes()[:5000])  # half-written
    said = {}
    for file in (text, other, newer, broken, tmp_path):
        before = file.read_bytes() if file.is_file() else b""
        with pytest.raises(LeafcutError) as refused, Store(file) as store:
            store.add(ROW)
        assert (file.read_bytes() if file.is_file() else b"") == before
        assert "\n" not in str(refused.value)
        said[file.name] = str(refused.value)
    assert "this is not a results file of leafcut" in said["a.txt"]
    assert "another program" in said["b.sqlite"]
    assert "'schema' is 2, but the newest results file that this version reads has 1; upgrade" in said["c.sqlite"]
    assert "damaged" in said["d.sqlite"]


def test_a_full_disk_is_told_and_loses_nothing(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk: SQLite meets both in the same way."""
    file = tmp_path / "r.sqlite"
    code = f"""
import resource, signal, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_store import ROW
from dataclasses import replace
from leafcut.errors import LeafcutError
from leafcut.lab.store import Store
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
with Store({str(file)!r}) as store:
    for k in range(1000):
        try:
            store.add(replace(ROW, key=str(k)))
        except LeafcutError as problem:
            print(k, problem)
            break
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    kept, _, line = said.partition(" ")
    assert "disk" in line
    with Store(file) as store:
        assert len(store.rows("small")) == int(kept) > 10


def test_results_that_are_not_there_are_told_and_not_made_by_looking(tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match="no results here yet"), Store(tmp_path / "r.sqlite", read_only=True):
        pass
    assert not list(tmp_path.iterdir())
