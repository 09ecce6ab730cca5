"""What a Dask cluster of two workers on this machine costs, beside threads and processes: a batch of 200 programs.

    python benchmarks/cluster.py --write docs/cluster.md

The programs of all executors must be the same, byte by byte. Workers are started before the clock; the time is that of
the batch alone. Each executor runs three times in turn, and the median counts.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from page import facts, table, write_section

from leafcut.batch import run_batch
from leafcut.executors import open_executor, run_tasks

GIVEN = {"machine": "linuxcnc-mill", "preset": "fast", "process": "auto", "threads": 1}
ROUNDS, PROGRAMS, EMPTY = 3, 200, 500


def program(seed: int) -> str:
    """Return a program with forty holes."""
    place = random.Random(seed)
    holes = "".join(f"X{place.randint(0, 400)} Y{place.randint(0, 300)}\n" for _ in range(39))
    return f"G21 G90 G17 G54\nT1 M6\nS1200 M3\nG0 Z10\nG98 G81 X5 Y5 Z-5 R2 F120\n{holes}G80\nG0 Z50\nM30\n"


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """Give the address of a scheduler with two workers of one thread; they are ended by their numbers."""
    file, quiet = folder / "scheduler.json", {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    words = [sys.executable, "-m", "dask"]
    place = ["--no-dashboard", "--scheduler-file", str(file)]
    started = [
        subprocess.Popen([*words, "scheduler", "--host", "127.0.0.1", "--port", "0", *place], cwd=folder, **quiet)
    ]
    try:
        while not file.exists() or not file.read_text().endswith("}"):
            time.sleep(0.1)
        for _ in range(2):
            worker = [*words, "worker", "--nthreads", "1", "--no-nanny", *place]
            started.append(subprocess.Popen(worker, cwd=folder, **quiet))
        yield json.loads(file.read_text())["address"].replace("tcp://", "dask://")
    finally:
        for one in started:
            one.kill()
            one.wait()


def batch_s(spec: str, inputs: list[str], out: Path) -> tuple[float, bytes]:
    """Return the time of a batch, s, and all that it wrote."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    with open_executor(spec, 2) as executor:
        # The workers are there, and have compiled what they need.
        list(run_tasks(executor, abs, range(8)))
        run_batch(inputs[:4], str(out), GIVEN, executor)
        began = time.perf_counter()
        rows = run_batch(inputs, str(out), GIVEN, executor)
        took = time.perf_counter() - began
    assert all(row.state == "written" for row in rows)
    return took, b"".join((out / row.program).read_bytes() for row in rows)


def empty_s(spec: str) -> float:
    """Return what a task that does nothing takes, s."""
    with open_executor(spec, 2) as executor:
        list(run_tasks(executor, abs, range(8)))
        began = time.perf_counter()
        found = dict(run_tasks(executor, abs, range(EMPTY)))
        took = time.perf_counter() - began
    assert found == {k: k for k in range(EMPTY)}
    return took / EMPTY


def main() -> None:
    """Measure, print the table, and write it into a page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", type=Path, help="the page whose section is replaced")
    given = parser.parse_args()
    with TemporaryDirectory() as place, cluster(Path(place)) as dask:
        folder = Path(place)
        inputs = []
        for k in range(PROGRAMS):
            inputs.append(str(folder / f"p{k:03}.nc"))
            Path(inputs[-1]).write_text(program(k), encoding="utf-8")
        times: dict[str, list[float]] = {}
        wrote = set()
        for _ in range(ROUNDS):
            for name, spec in (("threads", "threads"), ("processes", "processes"), ("Dask", dask)):
                took, text = batch_s(spec, inputs, folder / "out")
                times.setdefault(name, []).append(took)
                wrote.add(text)
        assert len(wrote) == 1, "the executors wrote different programs"
        empty = {"threads": empty_s("threads"), "processes": empty_s("processes"), "Dask": empty_s(dask)}
    base = median(times["threads"])
    rows = [
        [name, f"{median(one):.1f}", f"{median(one) / base:.2f}", f"{1000.0 * empty[name]:.2f}"]
        for name, one in times.items()
    ]
    text = f"""A batch of {PROGRAMS} programs with 40 holes each, two workers; the programs are equal byte by byte.

{table(["executor", "batch, s", "of threads", "a task that does nothing, ms"], rows)}

{facts("cluster", sys.argv[1:], ["leafcut", "distributed"])}"""
    print(text)
    if given.write:
        write_section(given.write, "cluster", text)


if __name__ == "__main__":
    main()
