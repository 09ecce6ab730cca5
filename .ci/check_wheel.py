"""Build both wheels, install them in a new environment without extras, and run commands outside the checkout.

Every command gives its result, or one line that names the extra it needs; with the wheel that holds machine code none
compiles anything.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from build_wheels import build, build_with_kernels, environment, install, pip

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
    """Check the wheels; what is wrong ends the run with a sentence."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        (folder / "work").mkdir()
        plain = build(folder)
        names = names_in(plain)
        for part in HELD:
            expect(any(part in name for name in names), f"the wheel holds no {part}")
        expect(not any(name.startswith(("tests/", "benchmarks/")) for name in names), "the wheel holds tests")
        expect(not any(name.endswith(".kernel") for name in names), f"{plain.name} holds machine code")
        expect(plain.name.endswith("-py3-none-any.whl"), f"{plain.name} is not for every machine")

        kernels, none = folder / "kernels", folder / "none"
        programs = install(plain, folder)
        ours = build_with_kernels(folder, programs, kernels)
        for line in (*WORK, *WANTING):
            run(programs / "leafcut", line, folder, kernels)

        expect(any(name.endswith(".kernel") for name in names_in(ours)), f"{ours.name} holds no machine code")
        expect("-none-any" not in ours.name, f"{ours.name} does not say for which machines it is")
        pip(programs / "python", "install", "--no-deps", "--force-reinstall", str(ours))
        print(f"with {ours.name}:")
        for line in WORK:
            run(programs / "leafcut", line, folder, none)
            expect(not [*none.rglob("*.kernel")], "a kernel was compiled that the wheel should hold")


def names_in(wheel: Path) -> list[str]:
    """Return the names of the files in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


def run(program: Path, line: str, folder: Path, kernels: Path) -> None:
    """Run a command line, with compiled code in `kernels`; it gives a result, or says which extra it needs."""
    words = line.format(examples=folder / "examples").split()
    own, began = environment(kernels), (time.perf_counter(), os.times())
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
