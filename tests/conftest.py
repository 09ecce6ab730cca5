"""Settings and fixtures for all tests."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from outside_programs import program_path
from packages import Installer, write_package
from shared_data import DATA
from solid_reader import SolidReader

#: Fixture that starts an outside program → marker of every case that uses it.
MARKER_OF_FIXTURE = {
    "browser": "browser",
    "chromium": "browser",
    "rs274": "external",
    "qtplasmac_gcode": "external",
    "inkscape": "external",
    "freecadcmd": "external",
    "kicad_python": "external",
    "linuxcnc_samples": "external",
    "simulated_linuxcnc": "external",
    "running": "external",  # the simulated GRBL board
    "bash": "external",
    "fish": "external",
    "zsh": "external",
}

# Each run tries the same examples. There is no deadline, so results do not depend on machine load.
# A rule with cheap examples multiplies this number: `@settings(max_examples=settings().max_examples * 5)`.
settings.register_profile(
    "fast",
    deadline=None,
    derandomize=True,
    max_examples=20,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.function_scoped_fixture],
)
settings.register_profile("thorough", settings.get_profile("fast"), max_examples=200)
settings.load_profile("fast")

# Keep byte code even if the environment forbids it: without it, every Python process of the tests starts more slowly.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Ignore the defaults of the user, and store no state between runs.
os.environ["LEAFCUT_DEFAULTS"] = ""
os.environ["XDG_STATE_HOME"] = os.environ["LOCALAPPDATA"] = os.devnull


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let every second worker import the files in reverse order.

    pytest compiles a file at its first import and keeps the byte code. Two workers thus compile half of the files each.
    """
    report = yield
    worker = getattr(collector.config, "workerinput", {}).get("workerid", "gw0")
    if isinstance(collector, pytest.Dir) and int(worker.removeprefix("gw")) % 2:
        report.result = (report.result or [])[::-1]
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the files, so that all workers have the same order, and mark each case that uses an outside program."""
    items.sort(key=lambda item: item.path)
    for item in items:
        for name in getattr(item, "fixturenames", ()):
            if name in MARKER_OF_FIXTURE:
                item.add_marker(MARKER_OF_FIXTURE[name])


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Exempt the collected cases and the imported modules from garbage collection; they live until the end."""
    gc.disable()
    result = yield
    gc.freeze()
    gc.set_threshold(10_000)
    gc.enable()
    return result


@pytest.fixture(scope="session")
def rs274() -> str:
    """Return the path of LinuxCNC's interpreter."""
    return program_path("rs274", "linuxcnc-uspace")


@pytest.fixture(scope="session")
def qtplasmac_gcode() -> str:
    """Return the path of the filter of LinuxCNC's QtPlasmaC screen."""
    return program_path("qtplasmac_gcode", "linuxcnc-uspace")


@pytest.fixture(scope="session")
def inkscape() -> str:
    """Return the path of Inkscape."""
    return program_path("inkscape", "inkscape")


@pytest.fixture(scope="session")
def freecadcmd() -> str:
    """Return the path of FreeCAD without its window."""
    return program_path("freecadcmd", "freecad")


@pytest.fixture(scope="session")
def bash() -> str:
    """Return the path of the shell bash."""
    return program_path("bash", "bash")


@pytest.fixture(scope="session")
def data() -> Path:
    """Return the folder of shared real files, or skip."""
    if not DATA.is_dir():
        pytest.skip("the data folder is missing; set LEAFCUT_DATA")
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
    """Read solids in forks of one process; `monkeypatch.undo()` restores a new process for each solid."""
    if hasattr(os, "fork"):
        monkeypatch.setattr("leafcut.read.step.subprocess", solid_reader)


@pytest.fixture
def install(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Installer]:
    """Return a function that installs a package for one test."""
    folders: list[str] = []

    def installed(name: str, groups: Mapping[str, Mapping[str, str]], files: Mapping[str, str] | None = None) -> Path:
        folder = tmp_path_factory.mktemp("packages")
        write_package(folder, name, groups, files or {})
        monkeypatch.syspath_prepend(str(folder))
        folders.append(str(folder))
        return folder

    yield installed
    files_of = {name: str(getattr(module, "__file__", None)) for name, module in sys.modules.items()}
    for name, file in files_of.items():
        if file.startswith(tuple(folders)):
            del sys.modules[name]
