"""Compiled code is kept on disk where that can be, and nothing on the disk can stop a run."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest
from numba.core import config, event
from numba.core.caching import CacheImpl

from leafcut.kernels import keeping

KERNEL = "from leafcut.kernels import kernel\n\n@kernel\ndef twice(x):\n    return 2 * x\n"


class Count(event.Listener):
    """Counts what is compiled."""

    def __init__(self) -> None:
        self.compiled = 0

    def on_start(self, event: object) -> None:
        self.compiled += 1

    def on_end(self, event: object) -> None:
        """Count no end."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a module that holds a kernel; the folder holds its cache, too."""
    (tmp_path / "own_kernel.py").write_text(KERNEL, encoding="utf-8")
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setattr(keeping, "_not_kept", set())
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def run(folder: Path) -> tuple[int, int, bool]:
    """Call the kernel as a new process does, of which nothing is known but what lies on the disk.

    Return its answer, how often it was compiled, and whether compiled code is not kept.
    """
    for file in folder.glob("*.py"):
        sys.modules.pop(file.stem, None)
    importlib.invalidate_caches()
    keeping._digest_of.cache_clear()
    count = Count()
    event.register("numba:compile", count)
    try:
        answer = importlib.import_module("own_kernel").twice(21)
    finally:
        event.unregister("numba:compile", count)
    return answer, count.compiled, keeping.not_kept()


def test_a_kernel_is_compiled_once_on_a_machine_and_again_where_its_files_are_damaged(folder: Path) -> None:
    """One wrong bit, cut short, of another program: compiled anew, and whole on the disk again."""
    assert run(folder) == (42, 1, False)
    assert run(folder) == (42, 0, False)
    (data,) = (folder / "cache").rglob("*.nbc")
    (index,) = (folder / "cache").rglob("*.nbi")
    whole = data.read_bytes()
    middle = len(whole) // 2
    for file, damage in (
        (data, whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]),
        (data, whole[:100]),
        (index, index.read_bytes()[:40]),
        (index, b""),
    ):
        file.write_bytes(damage)
        assert run(folder) == (42, 1, False), damage[:20]
    assert run(folder) == (42, 0, False)


def test_a_kernel_is_compiled_anew_when_what_it_uses_of_another_file_has_changed(folder: Path) -> None:
    """Machine code holds constants and called functions of other files as they were when it was compiled."""
    kernel, own, numbers = (folder / f"{name}.py" for name in ("own_kernel", "own_part", "own_numbers"))
    head = "from leafcut.kernels import {}\nfrom {} import {}\n\n"
    kernel.write_text(
        head.format("kernel", "own_part", "scaled") + "@kernel\ndef twice(x):\n    return scaled(x)\n", encoding="utf-8"
    )
    part = head.format("part", "own_numbers", "BY") + "@part\ndef scaled(x):\n    return BY * x{}\n"
    own.write_text(part.format(""), encoding="utf-8")
    numbers.write_text("BY = 2\n")
    assert run(folder)[0] == 42
    numbers.write_text("BY = 3\n")
    assert run(folder)[0] == 63
    own.write_text(part.format(" + 1"))
    assert run(folder)[0] == 64
    assert run(folder)[:2] == (64, 0)


def test_code_that_another_version_wrote_in_the_same_place_is_not_run(folder: Path) -> None:
    """While leafcut is upgraded two processes write at once: the index is of the one, the code of the other."""
    assert run(folder)[0] == 42
    (data,) = (folder / "cache").rglob("*.nbc")
    older = data.read_bytes()
    (folder / "own_kernel.py").write_text(KERNEL.replace("2 * x", "3 * x"), encoding="utf-8")
    assert run(folder)[0] == 63
    assert data.read_bytes() != older
    data.write_bytes(older)
    assert run(folder)[:2] == (63, 1)


def test_a_kernel_is_compiled_in_memory_where_no_folder_can_be_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None of the places that Numba knows is there for it; before, this ended the program."""
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    assert run(folder) == (42, 1, True)


def test_the_line_about_compiling_says_where_nothing_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """And what to do."""
    from leafcut.solve import compiling

    told: list[str] = []
    for kept in (True, False):
        monkeypatch.setattr(compiling, "not_kept", lambda kept=kept: not kept)
        listener = compiling._Listener(told.append, lambda _: None)
        listener.on_start(None)
        listener.on_end(None)
    assert told[0] == "compiling (first run on this machine)"
    assert "NUMBA_CACHE_DIR" in told[1]
