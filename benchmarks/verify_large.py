"""Memory and time of `verify` and `simulate` for programs of a million lines.

    python benchmarks/verify_large.py --lines 1000000 --write docs/benchmarks.md

Contours of forty lines on a grid, the new program with them in another order; and the lines of a laser's picture, each
with a power of its own. A process of its own does each run; what is told is its peak of resident memory.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from page import facts, table, write_section

#: Lines of a contour, of which all but three cut.
LINES = 40
HEAD, END = "G21 G90 G17 G40 G94 G54\nT1 M6\nS9000 M3\nG0 Z5\n", "G0 Z5\nM5\nM30\n"


def contours(lines: int) -> list[str]:
    """Return open contours of forty lines, each in a square of its own."""
    count = max(lines // LINES, 1)
    side = math.ceil(math.sqrt(count))
    return [_contour(12.0 * (k % side), 12.0 * (k // side), random.Random(k)) for k in range(count)]


def _contour(x: float, y: float, chance: random.Random) -> str:
    turns = [(x + 5 + r * math.cos(0.15 * k), y + 5 + r * math.sin(0.15 * k)) for k in range(LINES - 3)
             for r in (4.0 + chance.uniform(-0.1, 0.1),)]  # fmt: skip
    first, rest = turns[0], turns[1:]
    cuts = "".join(f"G1 X{u:.3f} Y{v:.3f}\n" for u, v in rest)
    return f"G0 X{first[0]:.3f} Y{first[1]:.3f}\nG0 Z1\nG1 Z-1 F200\nG1 X{rest[0][0]:.3f} F800\n{cuts}G0 Z5\n"


def picture(lines: int) -> Iterator[str]:
    """Yield rows of a laser's picture, the power in every line."""
    chance = random.Random(1)
    for row in range(max(lines // 500, 1)):
        yield f"G0 X0 Y{0.1 * row:.1f}\n"
        yield from (f"G1 X{0.1 * k:.1f} S{chance.randrange(1000)}\n" for k in range(1, 500))


def write_programs(folder: Path, lines: int) -> dict[str, list[str]]:
    """Write the programs; return the arguments of each run."""
    made = contours(lines)
    (folder / "a.nc").write_text(HEAD + "".join(made) + END)
    random.Random(1).shuffle(made)
    (folder / "b.nc").write_text(HEAD + "".join(made) + END)
    (folder / "c.nc").write_text("G21 G90 G17 G94\nM4 S0\nF3000\n" + "".join(picture(lines)) + "M5\nM2\n")
    mill, laser = (["--machine", name] for name in ("linuxcnc-mill", "grbl-laser-5w"))
    return {
        "simulate": ["simulate", "a.nc", *mill],
        "verify, contours in another order": ["verify", "a.nc", "b.nc", *mill],
        "verify, a picture and itself": ["verify", "c.nc", "c.nc", *laser],
    }


def main() -> None:
    """Measure, print the table, write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("--lines", type=int, default=1_000_000)
    made.add_argument("--write", type=Path, help="write the table into this page")
    arguments = made.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, words in write_programs(Path(folder), arguments.lines).items():
            seconds, peak, said = run(words, folder)
            rows.append([name, f"{seconds:.0f} s", f"{peak / 1e6:.0f} MB", said])
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Programs of {arguments.lines:,} lines

Processor seconds and peak of resident memory of one run, interpreter and libraries included.

{facts("verify_large", sys.argv[1:], ["leafcut", "numpy"])}

{table(["run", "processor time", "memory at most", "answer"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "verify_large", text)


#: Starts a program, waits for it, and prints the processor seconds it took, its peak in bytes and its exit status.
_LAUNCHER = """
import json, os, subprocess, sys
child = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
_, status, used = os.wait4(child.pid, 0)
child.returncode = os.waitstatus_to_exitcode(status)
print(json.dumps([used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss, child.returncode]))
"""


def run(words: list[str], folder: str) -> tuple[float, float, str]:
    """Return the processor seconds, the peak in bytes and the exit status of one run of leafcut.

    A small process starts it: on Linux the peak of a process is at least that of the one that started it.
    """
    leafcut = [sys.executable, "-c", "from leafcut.cli import main; main()", *words]
    done = subprocess.run(
        [sys.executable, "-S", "-c", _LAUNCHER, *leafcut], cwd=folder, stdout=subprocess.PIPE, check=True
    )
    seconds, peak, status = json.loads(done.stdout)
    return seconds, peak, f"status {status}"


if __name__ == "__main__":
    main()
