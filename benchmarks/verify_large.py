"""Time and memory of `verify` and `simulate` for programs of a million lines.

    python -m benchmarks verify_large --lines 1000000

The programs are contours of forty lines each on a grid, the same contours in a different order, and a laser engraving
with a power in every line. Each run is a separate process.
"""

from __future__ import annotations

import json
import math
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks import page

#: Number of lines per contour; all but three of them cut.
LINES = 40
HEAD, END = "G21 G90 G17 G40 G94 G54\nT1 M6\nS9000 M3\nG0 Z5\n", "G0 Z5\nM5\nM30\n"


def contours(lines: int) -> list[str]:
    """Return open contours of forty lines, each in its own square."""
    count = max(lines // LINES, 1)
    side = math.ceil(math.sqrt(count))
    return [_contour(12.0 * (k % side), 12.0 * (k // side), random.Random(k)) for k in range(count)]


def _contour(x: float, y: float, chance: random.Random) -> str:
    turns = [
        (x + 5 + r * math.cos(0.15 * k), y + 5 + r * math.sin(0.15 * k))
        for k in range(LINES - 3)
        for r in (4.0 + chance.uniform(-0.1, 0.1),)
    ]
    first, rest = turns[0], turns[1:]
    cuts = "".join(f"G1 X{u:.3f} Y{v:.3f}\n" for u, v in rest)
    return f"G0 X{first[0]:.3f} Y{first[1]:.3f}\nG0 Z1\nG1 Z-1 F200\nG1 X{rest[0][0]:.3f} F800\n{cuts}G0 Z5\n"


def picture(lines: int) -> Iterator[str]:
    """Yield the rows of a laser engraving with a power in every line."""
    chance = random.Random(1)
    for row in range(max(lines // 500, 1)):
        yield f"G0 X0 Y{0.1 * row:.1f}\n"
        yield from (f"G1 X{0.1 * k:.1f} S{chance.randrange(1000)}\n" for k in range(1, 500))


def write_programs(folder: Path, lines: int) -> dict[str, list[str]]:
    """Write the programs, and return the arguments of each run."""
    cuts = contours(lines)
    (folder / "a.nc").write_text(HEAD + "".join(cuts) + END)
    random.Random(1).shuffle(cuts)
    (folder / "b.nc").write_text(HEAD + "".join(cuts) + END)
    (folder / "c.nc").write_text("G21 G90 G17 G94\nM4 S0\nF3000\n" + "".join(picture(lines)) + "M5\nM2\n")
    mill, laser = (["--machine", name] for name in ("linuxcnc-mill", "grbl-laser-5w"))
    return {
        "simulate": ["simulate", "a.nc", *mill],
        "verify, contours in another order": ["verify", "a.nc", "b.nc", *mill],
        "verify, an engraving with itself": ["verify", "c.nc", "c.nc", *laser],
    }


def main(argv: Sequence[str]) -> int:
    """Measure all runs and publish the table."""
    parser = page.parser("verify_large", __doc__)
    parser.add_argument("--lines", type=int, default=1_000_000, help="lines of each program (default: %(default)s)")
    arguments = parser.parse_args(argv)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, words in write_programs(Path(folder), arguments.lines).items():
            seconds, peak, status = run(words, folder)
            rows.append([name, f"{seconds:.0f} s", f"{peak / 1e6:.0f} MB", f"status {status}"])
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""# Programs of {arguments.lines:,} lines

The table shows the processor time and the peak resident memory of each process, including the interpreter and the
libraries.

{page.facts("verify_large", argv, ["leafcut", "numpy"])}

{page.table(["run", "processor time", "peak memory", "answer"], rows)}"""
    page.publish("verify_large", text, arguments.write)
    return 0


#: Code that starts a program, waits for it, and prints its processor time, s, its peak memory, bytes, and its exit
#: status. The output of the program goes to files in the working folder.
_LAUNCHER = """
import json, os, subprocess, sys
with open("stdout", "wb") as stdout, open("stderr", "wb") as stderr:
    child = subprocess.Popen(sys.argv[1:], stdout=stdout, stderr=stderr)
_, status, used = os.wait4(child.pid, 0)
child.returncode = os.waitstatus_to_exitcode(status)
print(json.dumps([used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss, child.returncode]))
"""


def run(words: Sequence[str], folder: str) -> tuple[float, float, int]:
    """Return the processor time, s, peak memory, bytes, and exit status of a leafcut command.

    A small process starts the command, because on Linux a process inherits the peak memory of its parent.
    """
    command = [sys.executable, "-c", "from leafcut.cli.app import main; main()", *words]
    launcher = [sys.executable, "-S", "-c", _LAUNCHER, *command]
    done = subprocess.run(launcher, cwd=folder, stdout=subprocess.PIPE, check=True)
    seconds, peak, status = json.loads(done.stdout)
    return seconds, peak, status
