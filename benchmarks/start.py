"""Start time: from a drawing with 70 holes to its program, in processor time and wall-clock time.

    python -m benchmarks start [--runs N] [--beside CHECKOUT]

A cold run is the first run of a new installation, with an empty folder for compiled code. A warm run is any later run.
Byte code exists before both, as after an installation by pip. A warm run is compared with the import of three packages.
`--beside` also measures another checkout, in turns. Both must write the same program.
"""

from __future__ import annotations

import compileall
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks import ROOT, page

#: Code that runs the command, or imports three packages.
_CODE = """
import sys
if sys.argv[1:] == ["imports"]:
    import numba, ezdxf, cyclopts
    sys.exit()
from leafcut.__main__ import main
main()
"""
#: Measured commands: name → arguments.
WORK = {
    "`import numba, ezdxf, cyclopts`": ("imports",),
    "`--version`": ("--version",),
    "70 holes to a program": (
        "optimize",
        str(ROOT / "examples" / "plate_70.dxf"),
        "-o",
        "-",
        "--machine",
        "haas-vf2",
        "--thickness",
        "6mm",
    ),
}


def run(source: Path, words: Sequence[str], cache: Path) -> tuple[float, float, bytes]:
    """Return the processor time, wall-clock time and output of a run."""
    environment = {key: text for key, text in os.environ.items() if not key.startswith("PYTHON")}
    environment |= {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(source / "src")}
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-c", _CODE, *words]
    done = subprocess.run(command, env=environment, capture_output=True, check=True, cwd=cache)
    after, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - start
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, clock, done.stdout


def figures(sources: dict[str, Path], runs: int, caches: dict[str, Path]) -> list[list[str]]:
    """Return the rows of the table for each checkout, and compare the programs written.

    All commands are run in turns, so that other work on the machine slows all of them equally.
    """
    took: dict[tuple[str, str, str], list[tuple[float, float]]] = {}
    for number in range(runs + 1):
        for title, words in WORK.items():
            written = set()
            for name, source in sources.items():
                processor, clock, text = run(source, words, caches[name])
                took.setdefault((title, name, "warm" if number else "cold"), []).append((processor, clock))
                written.add(text)
            if len(written) > 1 and "--version" not in words:
                raise SystemExit(f"{title}: the programs differ")
    rows = []
    for (title, name, state), figures_of in sorted(took.items(), key=lambda item: list(WORK).index(item[0][0])):
        if state == "cold" and len(WORK[title]) == 1:
            continue
        middle = [statistics.median(column) for column in zip(*figures_of, strict=True)]
        rows.append([title, state, name, f"{middle[0]:.2f}", f"{middle[1]:.2f}", str(len(figures_of))])
    return rows


def main(argv: Sequence[str]) -> int:
    """Measure all commands and publish the table."""
    parser = page.parser("start", __doc__)
    parser.add_argument("--runs", type=int, default=5, help="warm runs of each (default: 5)")
    parser.add_argument("--beside", type=Path, help="another checkout, run by the same Python")
    given = parser.parse_args(argv)
    sources = {"this checkout": ROOT}
    if given.beside:
        sources["other checkout"] = given.beside.resolve()
    with tempfile.TemporaryDirectory() as name:
        caches = {key: Path(name) / str(number) for number, key in enumerate(sources)}
        for folder in caches.values():
            folder.mkdir()
        for source in sources.values():
            compileall.compile_dir(source / "src" / "leafcut", quiet=2)
        rows = figures(sources, given.runs, caches)
    words = ["--runs", str(given.runs), *(["--beside", "CHECKOUT"] if given.beside else [])]
    words += ["--write"] if given.write else []
    text = f"""# Start time

The times are medians. A cold run is the first run, which compiles its kernels; a warm run is any later run. Byte code
already exists, as after an installation with pip. *This checkout* contains the measured code, and *other checkout* is
the argument of `--beside`. Both wrote the same program, byte for byte.

{page.facts("start", words, ["leafcut", "numpy", "numba"])}

{page.table(["work", "state", "code", "processor s", "clock s", "runs"], rows)}"""
    page.publish("start", text, given.write)
    return 0
