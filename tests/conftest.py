"""What several rooms' tests share."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from packages import Installer, lay
from shared_data import DATA
from solid_reader import SolidReader

# Compiling and a busy machine make times noisy, and no test asserts a duration; the same cases in every run.
settings.register_profile("leafcut", deadline=None, derandomize=True)
settings.load_profile("leafcut")

# Byte code is kept, whatever is said: without it what tests start takes half as long again, and collecting them thrice.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Nobody's own defaults are read, and nothing is remembered from run to run: what is told does not hang on that.
os.environ["LEAFCUT_DEFAULTS"] = ""
os.environ["XDG_STATE_HOME"] = os.environ["LOCALAPPDATA"] = os.devnull


def pytest_configure(config: pytest.Config) -> None:
    """Have one worker compile a kernel and the others wait for its file: to compile twice takes twice as long."""
    own = config.getoption("basetemp")
    if own and "PYTEST_XDIST_WORKER" in os.environ:
        # Beside the temporary folders of all workers of this run: pytest removes them with those of earlier runs.
        _compile_once(Path(own).parent / "compile-locks")


def _compile_once(locks: Path) -> None:
    try:
        import fcntl
    except ImportError:  # not on this system: every worker compiles for itself
        return
    from leafcut.kernels.calling import Kernel

    locks.mkdir(exist_ok=True)
    compile_now = Kernel._compiled

    def compile_alone(self: Kernel, kinds: Any, arguments: Any, kept: Any) -> Any:
        with (locks / kept.name).open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            return kept.load() or compile_now(self, kinds, arguments, kept)

    Kernel._compiled = compile_alone  # type: ignore[method-assign]


@pytest.fixture(scope="session")
def rs274() -> str:
    """Return the path of LinuxCNC's interpreter; skip without it, or fail where it is required."""
    return _of_linuxcnc("rs274")


@pytest.fixture(scope="session")
def qtplasmac_gcode() -> str:
    """Return the path of the filter of LinuxCNC's QtPlasmaC screen; skip without it, or fail where it is required."""
    return _of_linuxcnc("qtplasmac_gcode")


def _of_linuxcnc(name: str) -> str:
    return program_of(name, "linuxcnc-uspace")


def program_of(name: str, package: str) -> str:
    """Return the path of a program from outside; skip without it, or fail where it is required."""
    program = shutil.which(name)
    if program is None:
        if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
            pytest.fail(f"{name} is required here: apt-get install {package}")
        pytest.skip(f"{name} is not installed")
    return program


@pytest.fixture(scope="session")
def mypy_cache(pytestconfig: pytest.Config) -> Path:
    """Return where a type checker keeps what it knows of leafcut and its packages, from run to run."""
    assert pytestconfig.cache is not None
    return pytestconfig.cache.mkdir("mypy")


@pytest.fixture(scope="session")
def inkscape() -> str:
    """Return the path of Inkscape."""
    return program_of("inkscape", "inkscape")


@pytest.fixture(scope="session")
def freecadcmd() -> str:
    """Return the path of FreeCAD without its window."""
    return program_of("freecadcmd", "freecad")


@pytest.fixture(scope="session")
def data() -> Path:
    """Return the folder of shared real files, or skip."""
    if not DATA.is_dir():
        pytest.skip("the shared data is not here; set LEAFCUT_DATA")
    return DATA


@pytest.fixture(scope="session")
def examples() -> Path:
    """Return the folder of the drawings that leafcut ships."""
    return Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="session")
def solid_reader() -> Iterator[SolidReader]:
    """Yield a process with OpenCASCADE."""
    reader = SolidReader()
    yield reader
    reader.close()


@pytest.fixture
def opencascade_at_hand(solid_reader: SolidReader, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have solids read by forks of one process; `monkeypatch.undo()` gives each its own process again."""
    if hasattr(os, "fork"):
        monkeypatch.setattr("leafcut.read.step.subprocess", solid_reader)


@pytest.fixture
def install(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Installer]:
    """Return what installs a package for this test alone."""
    folders: list[str] = []

    def installed(name: str, groups: Mapping[str, Mapping[str, str]], files: Mapping[str, str] | None = None) -> Path:
        folder = tmp_path_factory.mktemp("packages")
        lay(folder, name, groups, files or {})
        monkeypatch.syspath_prepend(str(folder))
        folders.append(str(folder))
        return folder

    yield installed
    places = {name: str(getattr(one, "__file__", None)) for name, one in sys.modules.items()}
    for name, place in places.items():
        if place.startswith(tuple(folders)):
            del sys.modules[name]
