"""Compiled code is kept on disk where that is possible, and belongs to the sources that it was compiled from."""

from __future__ import annotations

import hashlib
import importlib
import pkgutil
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import leafcut.kernels
from leafcut.kernels.compiling import EVERY_RUN, FIRST_RUN, announced_compilations

KERNEL = """
from kernels_copy import kernel
from kernels_copy.callee import scaled

@kernel
def twice(x):
    return scaled(x)
"""
CALLEE = """
from kernels_copy import inner_kernel
from kernels_copy.numbers import BY

@inner_kernel
def scaled(x):
    return BY * x
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the folder of a package with the decorators of leafcut and two kernels of its own."""
    leafcut.kernels.install_compilation_listener()
    folder = tmp_path / "kernels_copy"
    folder.mkdir()
    shutil.copy(leafcut.kernels.__file__, folder)
    for name, text in (("caller", KERNEL), ("callee", CALLEE), ("numbers", "BY = 2\n")):
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield folder
    forget()


def forget() -> None:
    """Forget the package, as a new process does."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "kernels_copy"]:
        del sys.modules[name]
    importlib.invalidate_caches()


def run() -> tuple[int, int]:
    """Call the kernel as a new process does; return its answer and the number of compilations."""
    forget()
    with announced_compilations(lambda _: None) as compilations:
        answer = importlib.import_module("kernels_copy.caller").twice(21)
    return answer, compilations.count


def test_a_kernel_is_compiled_once_on_a_machine(package: Path) -> None:
    assert run() == (42, 2)
    assert run() == (42, 0)


def test_a_kernel_is_compiled_again_when_a_constant_or_a_called_kernel_of_another_file_changes(package: Path) -> None:
    assert run()[0] == 42
    (package / "numbers.py").write_text("BY = 3\n", encoding="utf-8")
    assert run()[0] == 63
    (package / "callee.py").write_text(CALLEE.replace("BY * x", "BY * x + 1"), encoding="utf-8")
    assert run()[0] == 64
    assert run() == (64, 0)


def test_other_packages_keep_the_cache_folder_of_their_numba_functions(package: Path, tmp_path: Path) -> None:
    run()
    assert str(tmp_path / "cache") == numba.config.CACHE_DIR


@pytest.mark.parametrize(("writable", "line"), [(True, FIRST_RUN), (False, EVERY_RUN)])
def test_the_line_about_compiling_names_a_missing_cache_folder(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writable: bool, line: str
) -> None:
    """A file stands in place of the folder: that stops root, too."""
    if not writable:
        (tmp_path / "cache").write_text("", encoding="utf-8")
    forget()
    copy = importlib.import_module("kernels_copy")
    monkeypatch.setattr("leafcut.kernels.compiling.cache_folder", copy.cache_folder)
    told: list[str] = []
    with announced_compilations(told.append) as compilations:
        assert importlib.import_module("kernels_copy.caller").twice(21) == 42
    assert told == [line]
    assert compilations.is_cached == writable


def test_the_cache_folder_is_that_of_the_user_where_none_is_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    folder = leafcut.kernels.cache_folder.__wrapped__()
    assert folder.parent == tmp_path / "leafcut"
    assert folder.is_dir()


def test_every_kernel_releases_the_lock_of_python_and_is_kept_in_the_cache_folder() -> None:
    """Parts, which only kernels call, have no wrappers."""
    count = {True: 0, False: 0}
    for found in pkgutil.iter_modules(leafcut.kernels.__path__):
        module = importlib.import_module(f"leafcut.kernels.{found.name}")
        for function in vars(module).values():
            if isinstance(function, Dispatcher) and function.__module__ == module.__name__:
                flags = function.targetoptions
                bare = flags.get("no_cpython_wrapper", False)
                count[bare] += 1
                assert flags["nogil"] is True
                assert flags.get("no_cfunc_wrapper", False) is bare
                assert flags.get("parallel", False) is False
                assert Path(function.stats.cache_path).is_relative_to(leafcut.kernels.cache_folder())
    assert min(count.values()) > 30


@pytest.mark.parametrize(
    ("system", "platform", "environment", "root"),
    [
        ("posix", "linux", {}, "home/.cache/leafcut"),
        ("posix", "darwin", {}, "home/Library/Caches/leafcut"),
        ("posix", "linux", {"XDG_CACHE_HOME": "xdg", "LOCALAPPDATA": "local"}, "xdg/leafcut"),
        ("nt", "win32", {"XDG_CACHE_HOME": "xdg", "LOCALAPPDATA": "local"}, "local/leafcut"),
        ("nt", "win32", {}, "home/.cache/leafcut"),
        ("posix", "darwin", {"NUMBA_CACHE_DIR": "chosen", "XDG_CACHE_HOME": "xdg"}, "chosen"),
        ("posix", "linux", {"NUMBA_CACHE_DIR": ""}, "home/.cache/leafcut"),
    ],
)
def test_the_root_of_caches_is_chosen_or_that_of_the_system(
    system: str, platform: str, environment: dict[str, str], root: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(leafcut.kernels, "os", SimpleNamespace(name=system, environ=environment))
    monkeypatch.setattr(leafcut.kernels, "sys", SimpleNamespace(platform=platform))
    monkeypatch.setattr(Path, "home", lambda: Path("home"))
    assert leafcut.kernels._cache_root() == Path(root)


def test_the_folder_is_named_by_all_sources_and_missing_where_none_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    sources = tmp_path / "sources"
    sources.mkdir()
    monkeypatch.setattr(leafcut.kernels, "__file__", str(sources / "__init__.py"))
    folder = leafcut.kernels.cache_folder.__wrapped__
    names = [folder()]
    for name, text in (("b.py", "1"), ("b.py", "2"), ("a.py", "2"), ("notes.txt", "x")):
        (sources / name).write_text(text)
        names.append(folder())
    digest = hashlib.sha256(b"a.py 1 2b.py 1 2").hexdigest()
    assert names[-1] == names[-2] == tmp_path / "cache" / f"kernels-{digest[:16]}"
    assert len(set(names)) == 4
    assert all(name.is_dir() and not list(name.iterdir()) for name in names)

    def homeless() -> Path:
        raise RuntimeError

    monkeypatch.setattr(leafcut.kernels, "_cache_root", homeless)
    assert folder() is None


def test_constants_have_the_types_of_numpy() -> None:
    yes, three = leafcut.kernels.typed_constant(True), leafcut.kernels.typed_constant(3)
    assert (type(yes), yes) == (np.bool_, True)
    assert (type(three), three) == (np.int64, 3)
    assert (type(leafcut.kernels.NONE), leafcut.kernels.NONE) == (np.int64, -1)
