"""Machine code is kept on disk where that can be, and nothing on the disk can stop a run."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from leafcut.kernels import keeping
from leafcut.kernels.calling import listening

KERNEL = "from leafcut.kernels import kernel\n\n@kernel\ndef twice(x):\n    return 2 * x\n"


class Count:
    """Counts what is compiled."""

    def __init__(self) -> None:
        self.compiled, self.kept = 0, True

    def began(self, kept: bool) -> None:
        self.compiled += 1
        self.kept = kept

    def ended(self) -> None:
        """Count no end."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a module that holds a kernel; the folder holds its cache, too."""
    (tmp_path / "own_kernel.py").write_text(KERNEL, encoding="utf-8")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
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
    with listening(count):
        answer = importlib.import_module("own_kernel").twice(21)
    assert count.kept != keeping.not_kept()
    return answer, count.compiled, keeping.not_kept()


def test_a_kernel_is_compiled_once_on_a_machine_and_again_where_its_file_is_damaged(folder: Path) -> None:
    """One wrong bit, cut short, empty: compiled anew, and whole on the disk again."""
    assert run(folder) == (42, 1, False)
    assert run(folder) == (42, 0, False)
    (data,) = (folder / "cache").rglob("*.kernel")
    whole = data.read_bytes()
    middle = len(whole) // 2
    for damage in (whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :], whole[:100], whole[:3], b""):
        data.write_bytes(damage)
        assert run(folder) == (42, 1, False), damage[:20]
    assert run(folder) == (42, 0, False)
    assert [file.name for file in data.parent.iterdir()] == [data.name]


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
    """While leafcut is upgraded two processes write at once."""
    assert run(folder)[0] == 42
    (data,) = (folder / "cache").rglob("*.kernel")
    older = data.read_bytes()
    (folder / "own_kernel.py").write_text(KERNEL.replace("2 * x", "3 * x"), encoding="utf-8")
    assert run(folder)[0] == 63
    assert data.read_bytes() != older
    data.write_bytes(older)
    assert run(folder)[:2] == (63, 1)


def test_code_of_another_processor_family_or_numba_is_not_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A home folder may be shared by machines, and a wheel's code meets any Numba that leafcut allows."""
    assert run(folder)[1] == 1
    monkeypatch.setattr(keeping, "_made_with", lambda: ("another machine",))
    assert run(folder)[1] == 1


def test_settings_of_numba_that_change_no_code_do_not_have_it_compiled_anew(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They would also overwrite what every other process has kept; one that changes code is another matter."""
    assert run(folder)[1] == 1
    monkeypatch.setattr(keeping, "_made_with", keeping._made_with.__wrapped__)  # asked anew each time
    for name, value, compiled in (("DISABLE_JIT", "0", 0), ("ENABLE_CUDASIM", "1", 0), ("BOUNDSCHECK", "1", 1)):
        monkeypatch.setenv(f"NUMBA_{name}", value)
        assert run(folder)[:2] == (42, compiled), name


def test_code_that_comes_with_leafcut_is_run_where_nothing_can_be_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wheel's folder of code is looked into first; what is damaged there stops nothing."""
    run(folder)
    (data,) = (folder / "cache").rglob("*.kernel")
    monkeypatch.setattr(keeping, "SHIPPED", data.parent)
    monkeypatch.setattr(keeping, "folders", lambda source: iter(()))
    assert run(folder) == (42, 0, False)
    data.write_bytes(b"damaged")
    assert run(folder) == (42, 1, True)


def test_a_kernel_is_compiled_in_memory_where_no_folder_can_be_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file stands where the folder would be made; the administrator may write everywhere else."""
    (folder / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder / "file"))
    assert run(folder) == (42, 1, True)


def test_the_line_about_compiling_says_where_nothing_is_kept() -> None:
    """And what to do."""
    from leafcut.solve.compiling import _Listener

    told: list[str] = []
    for kept in (True, False):
        listener = _Listener(told.append, lambda _: None)
        listener.began(kept)
        listener.ended()
    assert told[0] == "compiling (first run on this machine)"
    assert "NUMBA_CACHE_DIR" in told[1]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    """Return a module with kernels for `test_values_reach_machine_code`, its code in a folder of its own."""
    folder = tmp_path_factory.mktemp("kernels")
    (folder / "kinds_of_values.py").write_text(KINDS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setenv("NUMBA_CACHE_DIR", str(folder / "cache"))
        yield importlib.import_module("kinds_of_values")
        del sys.modules["kinds_of_values"]


KINDS = """
from typing import Any, NamedTuple
from leafcut.kernels import kernel

class Pair(NamedTuple):
    table: Any
    by: float
    yes: bool

@kernel
def weigh(a, pair, least, shift):
    total = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            if pair.yes and a[i, j] > least:
                total += a[i, j] * pair.by * pair.table[j] + shift
    return total

@kernel
def shape(a, of):
    of[0], of[1], of[2] = a.size, a.itemsize, a.shape[-1]

@kernel
def ratio(a, b):
    return a / b

@kernel
def odd(x):
    return x % 2 == 1

@kernel
def several(x, y):
    return x > y, x + y, x / 4

@kernel
def two(x):
    return x, -x
"""


@pytest.mark.slow
def test_values_reach_machine_code_as_they_are(compiled: object) -> None:
    """Layouts of arrays, read-only and empty ones, named tuples, widths of numbers: as the function in Python."""
    weigh, pair = compiled.weigh, compiled.Pair  # type: ignore[attr-defined]
    table = np.random.default_rng(1).uniform(-1.0, 1.0, (6, 4))
    fixed = table.copy()
    fixed.flags.writeable = False
    for a in (table, table.T.copy().T, table[::2, ::-1], fixed, table[:0], table[:, 1:3].astype(np.float32)):
        for numbers in (np.arange(4), np.arange(8.0)[::2]):
            for least, shift in ((-0.5, 1), (np.float32(0.25), np.int32(-2)), (np.float64(0.1), np.uint8(200))):
                given = (a, pair(numbers, 1.5, True), least, shift)
                assert weigh(*given) == pytest.approx(weigh.py_func(*given), rel=1e-6)
    assert weigh(table, shift=1, least=0.0, pair=pair(np.arange(4), 1.0, False)) == 0.0
    assert compiled.odd(2**64 - 1) is True  # type: ignore[attr-defined]
    assert compiled.odd(-(2**63)) is False  # type: ignore[attr-defined]
    assert compiled.several(3, 2) == (True, 5, 0.75)  # type: ignore[attr-defined]
    assert compiled.two(1.5) == (1.5, -1.5)  # type: ignore[attr-defined]
    for a in (np.zeros((3, 5), np.int16), np.zeros((0, 2))):
        of = np.zeros(3, np.int64)
        compiled.shape(a, of)  # type: ignore[attr-defined]
        assert of.tolist() == [a.size, a.itemsize, a.shape[-1]]


def test_an_error_inside_machine_code_is_that_of_python(compiled: object) -> None:
    """Divisions by zero are looked for in machine code, too."""
    with pytest.raises(ZeroDivisionError, match="division by zero"):
        compiled.ratio(1.0, 0.0)  # type: ignore[attr-defined]


def test_what_kernels_cannot_take_is_refused_in_one_line(compiled: object) -> None:
    """Before, a wrong argument of a caller came out as a page of Numba's."""
    for wrong in ("text", None, np.zeros(2, dtype=">f8"), np.array(["a"])):
        with pytest.raises(TypeError, match="kernels take arrays, numbers and tuples"):
            compiled.odd(wrong)  # type: ignore[attr-defined]


def test_kept_machine_code_runs_without_numba(folder: Path) -> None:
    """Importing Numba takes longer than a small job."""
    script = "import sys, json; from own_kernel import twice; print(json.dumps([twice(21), 'numba' in sys.modules]))"
    environment = dict(os.environ, PYTHONPATH=str(folder))
    answers = [
        json.loads(
            subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, env=environment).stdout
        )
        for _ in range(2)
    ]
    assert answers == [[42, True], [42, False]]
