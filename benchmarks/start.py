"""What a start takes: a drawing of 70 holes to its program, in processor seconds and by the clock.

    python benchmarks/start.py [--runs N] [--beside CHECKOUT] [--wheel WHEEL] [--write docs/benchmarks.md]

Cold is the first run of a new installation, with an empty folder for compiled code; warm is every run after it. Byte
code is kept before both, as it is where pip installs leafcut, whatever `PYTHONDONTWRITEBYTECODE` says here. The other
checkout's runs take turns with this one's, so that a busy machine is busy for both; its programs must be equal, and so
must those of the wheel, one with machine code as `make wheels` builds it, which is installed in a new environment.
"""

from __future__ import annotations

import argparse
import compileall
import os
import resource
import runpy
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from page import facts, table, write_section

ROOT = Path(__file__).parents[1]
#: Runs leafcut as its command does; an older checkout has its command elsewhere.
_CODE = """
try:
    from leafcut.__main__ import main
except ImportError:
    from leafcut.cli import main
main()
"""
#: What is run: name → words after the name of the command.
WORK = {
    "`--version`": ("--version",),
    "70 holes to a program": ("optimize", str(ROOT / "examples" / "plate_70.dxf"), "-o", "-", "--machine", "haas-vf2"),
}


def run(python: Path, source: Path | None, words: Sequence[str], cache: Path) -> tuple[float, float, bytes]:
    """Return (processor seconds, seconds by the clock, standard output) of one run; of what is installed: no source."""
    environment = {key: text for key, text in os.environ.items() if not key.startswith("PYTHON")}
    environment |= {"NUMBA_CACHE_DIR": str(cache)} | ({"PYTHONPATH": str(source / "src")} if source else {})
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([python, "-c", _CODE, *words], env=environment, capture_output=True, check=True, cwd=cache)
    after, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - start
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, clock, done.stdout


def figures(sources: dict[str, tuple[Path, Path | None]], runs: int, caches: dict[str, Path]) -> list[list[str]]:
    """Return the rows of the table, of every (Python, source); what they write is compared."""
    rows = []
    for title, words in WORK.items():
        took: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for number in range(runs + 1):
            written = set()
            for name, (python, source) in sources.items():
                processor, clock, text = run(python, source, words, caches[name])
                took.setdefault((name, "warm" if number else "cold"), []).append((processor, clock))
                written.add(text)
            if len(written) > 1 and "--version" not in words:
                raise SystemExit(f"{title}: they write different programs")
        for (name, state), figures_of in sorted(took.items()):
            if state == "cold" and "--version" in words:
                continue
            middle = [statistics.median(one) for one in zip(*figures_of, strict=True)]
            rows.append([title, state, name, f"{middle[0]:.2f}", f"{middle[1]:.2f}", str(len(figures_of))])
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="warm runs of each (default 5)")
    parser.add_argument("--beside", type=Path, help="another checkout, run by the same Python")
    parser.add_argument("--wheel", type=Path, help="a wheel with machine code, as `make wheels` builds it")
    parser.add_argument("--write", type=Path, help="the page whose section is replaced")
    given = parser.parse_args(arguments)
    own = Path(sys.executable)
    sources: dict[str, tuple[Path, Path | None]] = {"this": (own, ROOT)}
    if given.beside:
        sources["the other"] = own, given.beside.resolve()
    with tempfile.TemporaryDirectory() as name:
        if given.wheel:
            install = runpy.run_path(str(ROOT / ".ci" / "build_wheels.py"))["install"]
            sources["the wheel"] = install(given.wheel.resolve(), Path(name)) / "python", None
        caches = {key: Path(name) / str(number) for number, key in enumerate(sources)}
        for folder in caches.values():
            folder.mkdir()
        for _, source in sources.values():
            if source:
                compileall.compile_dir(source / "src" / "leafcut", quiet=2)
        rows = figures(sources, given.runs, caches)
    made = table(("work", "state", "what runs", "processor s", "clock s", "runs"), rows)
    told = [f"--runs {given.runs}", *(["--beside CHECKOUT"] if given.beside else [])]
    told += [*(["--wheel WHEEL"] if given.wheel else []), "--write docs/benchmarks.md"]
    head = facts("start", " ".join(told).split(), ("leafcut", "numpy", "numba"))
    note = (
        "Medians. Cold: the first run, with no machine code but what a wheel brings. Warm: every later run. Byte code "
        "is there, as pip puts it. The programs were equal, byte for byte."
    )
    text = f"## The start\n\n{note}\n\n{head}\n\n{made}"
    print(text)
    if given.write:
        write_section(given.write, "start", text)


if __name__ == "__main__":
    main()
