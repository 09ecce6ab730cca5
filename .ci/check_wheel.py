"""Build the wheel, install it in a new environment without extras, and run commands outside the checkout.

Every command gives its result, or one line that names the extra it needs.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]

#: What must be in the wheel, beside the modules.
HELD = ("leafcut/py.typed", "leafcut/machines/", "leafcut/gcode/dialects/", ".dist-info/licenses/LICENSE")

#: Command lines that give a result; `{examples}` is a copy of the examples, the working folder is empty.
WORK = (
    "--version",
    "--help",
    "machines",
    "machines --show haas-vf2",
    "algorithms",
    "formats",
    "optimize example:plate-70 -o plate.nc --machine haas-vf2 --thickness 6mm --report plate.html --json",
    "optimize {examples}/plate_27.dxf -o drilled.nc --thickness 6mm",
    "optimize {examples}/cam_121.nc -o faster.nc --machine haas-vf2",
    "optimize {examples}/sheet.dxf --process cut --thickness 6mm --preset fast -o sheet.ngc --report sheet.html",
    "optimize {examples}/pocket.dxf -o pocket.nc --process pocket --tool-diameter 10 --depth 2 --preset fast",
    "simulate plate.nc --machine haas-vf2",
    "verify {examples}/cam_121.nc faster.nc",
    "solve example:plate-70 --time-limit 1s --json",
)
#: Command lines that need an extra, and which.
WANTING = {
    "nest {examples}/bracket.dxf:10 {examples}/gusset.svg:4": "leafcut[nest]",
    "studio": "leafcut[studio]",
}


def main() -> None:
    """Check the wheel; what is wrong ends the run with a sentence."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        (folder / "work").mkdir()
        pip(Path(sys.executable), "wheel", "--no-deps", "--wheel-dir", str(folder), str(ROOT))
        (wheel,) = folder.glob("leafcut-*.whl")
        names = names_in(wheel)
        for part in HELD:
            expect(any(part in name for name in names), f"the wheel holds no {part}")
        expect(not any(name.startswith(("tests/", "benchmarks/")) for name in names), "the wheel holds tests")
        expect(wheel.name.endswith("-py3-none-any.whl"), f"{wheel.name} is not for every machine")

        venv.create(folder / "environment", with_pip=True)
        programs = folder / "environment" / ("Scripts" if os.name == "nt" else "bin")
        pip(programs / "python", "install", str(wheel))
        for line in (*WORK, *WANTING):
            run(programs / "leafcut", line, folder)


def pip(python: Path, *words: str) -> None:
    """Run pip."""
    subprocess.run([python, "-m", "pip", "--quiet", "--disable-pip-version-check", *words], check=True)


def names_in(wheel: Path) -> list[str]:
    """Return the names of the files in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


def run(program: Path, line: str, folder: Path) -> None:
    """Run a command line; it gives a result, or says which extra it needs."""
    words = line.format(examples=folder / "examples").split()
    own = {key: text for key, text in os.environ.items() if not key.startswith(("PYTHON", "LEAFCUT", "NUMBA"))}
    own["NUMBA_CACHE_DIR"] = str(folder / "kernels")
    began = time.perf_counter(), os.times()
    done = subprocess.run([program, *words], cwd=folder / "work", env=own, capture_output=True, text=True, check=False)
    clock, now = time.perf_counter() - began[0], os.times()
    spent = now.children_user + now.children_system - began[1].children_user - began[1].children_system
    said = done.stderr.strip()
    if line in WANTING:
        right = done.returncode == 1 and len(said.splitlines()) == 1 and WANTING[line] in said
    else:
        right = done.returncode == 0 and bool(done.stdout.strip() or said)
    print("ok  " if right else "BAD ", f"{spent:5.2f} s of processor, {clock:5.2f} s by the clock: leafcut {line}")
    expect(right, f"exit status {done.returncode}\n{done.stdout[-500:]}\n{said[-1500:]}")


def expect(right: bool, problem: str) -> None:
    """End the run where something is not right."""
    if not right:
        sys.exit(problem)


if __name__ == "__main__":
    main()
