"""Build both wheels: the one for every machine, and one with machine code for machines as this one.

    python .ci/build_wheels.py [FOLDER]

The wheels are written into dist, or into FOLDER. The first one is installed in an environment of its own, with the
versions of Numba and llvmlite that a user gets today, and compiles all kernels there; the second one holds them, and
its tag names this kind of machine. With other versions, or elsewhere, its kernels are compiled on the first run.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Where a build of the package finds machine code; git does not hold it.
SHIPPED = ROOT / "src" / "leafcut" / "kernels" / "shipped"


def main() -> None:
    """Build the wheels, and say where they are."""
    folder = Path(sys.argv[1] if sys.argv[1:] else ROOT / "dist").resolve()
    with tempfile.TemporaryDirectory() as name:
        plain = build(folder)
        print(plain)
        print(build_with_kernels(folder, install(plain, Path(name)), Path(name) / "kernels"))


def build(folder: Path) -> Path:
    """Build a wheel of this checkout into a folder; return its path."""
    with tempfile.TemporaryDirectory() as name:
        pip(Path(sys.executable), "wheel", "--no-deps", "--wheel-dir", name, str(ROOT))
        (wheel,) = Path(name).glob("leafcut-*.whl")
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.move(wheel, folder / wheel.name))


def install(wheel: Path, folder: Path) -> Path:
    """Install a wheel without extras in a new environment; return the folder of its programs."""
    venv.create(folder / "environment", with_pip=True)
    programs = folder / "environment" / ("Scripts" if os.name == "nt" else "bin")
    pip(programs / "python", "install", str(wheel))
    return programs


def build_with_kernels(folder: Path, programs: Path, kernels: Path) -> Path:
    """Build the wheel with the machine code that an installed leafcut compiles into the folder `kernels`."""
    subprocess.run([programs / "leafcut", "warm-up"], cwd=programs, env=environment(kernels), check=True)
    shutil.rmtree(SHIPPED, ignore_errors=True)
    SHIPPED.mkdir()
    try:
        for file in kernels.rglob("*.kernel"):
            shutil.copy(file, SHIPPED)
        return build(folder)
    finally:
        shutil.rmtree(SHIPPED)


def environment(kernels: Path) -> dict[str, str]:
    """Return the environment of an installed leafcut that keeps compiled code in a folder."""
    own = {key: text for key, text in os.environ.items() if not key.startswith(("PYTHON", "LEAFCUT", "NUMBA"))}
    return {**own, "NUMBA_CACHE_DIR": str(kernels)}


def pip(python: Path, *words: str) -> None:
    """Run pip."""
    subprocess.run([python, "-m", "pip", "--quiet", "--disable-pip-version-check", *words], check=True)


if __name__ == "__main__":
    main()
