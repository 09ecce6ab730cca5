"""Programs of other CAMs, before and after: real files, and boards whose holes come in random order.

    python benchmarks/resequence.py --write docs/benchmarks.md

Every new program was read back and does the same work as the original, or it was not written. Where LinuxCNC's
interpreter (`rs274`) is installed and accepts the original, it must accept the new program, too, and its canonical
cutting moves must be the same.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import numpy as np
from boards import load
from numpy.typing import NDArray
from page import facts, table, write_section

import leafcut
from leafcut.errors import LeafcutError
from leafcut.model.machine import Machine
from leafcut.model.outcome import Outcome
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.timing.profile import move_time

EXAMPLES = Path(__file__).parents[1] / "examples"

#: A tool table for rs274 with every tool that the files ask for.
TOOLS = "".join(f"T{t} P{t} D3.0 Z0 ;\n" for t in range(1, 100))


def real_files() -> list[Path]:
    """Return the programs of the shared data."""
    data = Path(os.environ.get("LEAFCUT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    return sorted(p for p in (data / "gcode").iterdir() if p.suffix != ".md")


def drilling_program(xy: NDArray[np.float64], seed: int) -> str:
    """Return a program that drills float64[n, 2] in random order, as CAMs do that take holes as they were drawn."""
    order = np.random.default_rng(seed).permutation(len(xy))
    holes = [f"X{x:.3f} Y{y:.3f}" for x, y in xy[order].tolist()]
    top = ["%", "G21 G17 G40 G49 G80 G90 G94", "T1 M6", "S3000 M3", "G0 Z20."]
    body = [f"G99 G81 {holes[0]} Z-3. R1. F200.", *holes[1:]]
    return "\n".join([*top, *body, "G80", "G0 Z20.", "M5", "M30", "%", ""])


def boards() -> list[tuple[str, NDArray[np.float64]]]:
    """Return the boards of random order: pcb442 a tenth as large as TSPLIB has it, and the examples' boards."""
    found = [("pcb442", load("pcb442").xy / 10.0)]
    return found + [(f"board_{n}", leafcut.read_part(EXAMPLES / f"board_{n}.dxf").hole_xy) for n in (97, 121, 200)]


def cutting_moves(text: str, beam: bool = False) -> Counter[str] | None:
    """Return the canonical cutting moves of a program by rs274, or None where it does not accept the program.

    A cut is told by where it begins and ends, and by its feed, tool, speed and coolant. Of a beam, what is not on does
    not cut.
    """
    with tempfile.TemporaryDirectory() as folder:
        tools, program = Path(folder, "tool.tbl"), Path(folder, "p.ngc")
        tools.write_text(TOOLS)
        program.write_text(text)
        # rs274 keeps a memory map in its home and truncates it at the start: two at once in one home kill each other.
        done = subprocess.run(
            ["rs274", "-g", "-t", str(tools), str(program)],
            capture_output=True, text=True, check=False, timeout=300, cwd=folder, env={**os.environ, "HOME": folder},
        )  # fmt: skip
    return None if done.returncode else _cuts(done.stdout, beam)


def _cuts(canon: str, beam: bool) -> Counter[str]:
    state: dict[str, str] = {}
    place, found = "", Counter[str]()
    for line in canon.splitlines():
        match = re.search(r"([A-Z_]+)\((.*)\)", line)
        if match is None:
            continue
        name, words = match.groups()
        cuts = not beam or state.get("spindle", "STOP").startswith("START")
        if name in ("STRAIGHT_FEED", "ARC_FEED") and words != place and cuts:
            found[f"{place} {name} {words} {sorted(state.items())}"] += 1
        if name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            place = words
        elif name == "ARC_FEED":
            # The end in the plane, and the height; the plane is XY in these files.
            x, y, _, _, _, z, *rest = (w.strip() for w in words.split(","))
            place = ", ".join([x, y, z, *rest])
        elif "SPINDLE_TURNING" in name or "START_SPINDLE" in name:
            state["spindle"] = f"{name}"
        elif name.startswith(("SET_FEED_RATE", "SET_SPINDLE_SPEED", "CHANGE_TOOL", "USE_TOOL_LENGTH", "SET_PLANE")):
            state[name] = words
        elif name.startswith(("FLOOD", "MIST")):
            state[name.split("_")[0]] = name
    return found


def run(source: Path, machine: str) -> tuple[list[str], Outcome | None]:
    """Return the row of one program, and what came out."""
    try:
        outcome = leafcut.optimize(source, machine=machine, threads=1)
    except LeafcutError as problem:
        reason = str(problem).split(": ", 1)[-1]
        return [source.name, "", "", "", "", "", "", f"refused: {reason}"], None
    counts = asdict(outcome.detail.certificate.before)
    assert outcome.verified
    assert outcome.after.time_s <= outcome.before.time_s * (1 + 1e-9)
    features = ", ".join(f"{counts[k]:,} {k}" for k in ("holes", "cuts") if counts.get(k))
    moved = sum(len(o.solution.nodes) for o in outcome.operations)
    row = [
        source.name, features, f"{moved:,}", f"{outcome.detail.barriers:,}",
        f"{outcome.before.time_s:.1f}", f"{outcome.after.time_s:.1f}",
        f"{outcome.saved_percent:.1f}", judged(source.read_text(encoding="latin-1"), outcome),
    ]  # fmt: skip
    return row, outcome


def judged(original: str, outcome: Outcome) -> str:
    """Return what rs274 says; a difference stops the benchmark."""
    if shutil.which("rs274") is None:
        return "verified"
    beam = outcome.process in ("laser", "plasma")
    before = cutting_moves(original, beam)
    if before is None:
        return "verified; rs274 does not take the original"
    assert before == cutting_moves(outcome.text, beam), "rs274 sees other cutting moves"
    return "verified, by rs274, too"


def travel_seconds(path: Toolpath, machine: Machine) -> float:
    """Return the time from hole to hole, s, without what goes up and down at each."""
    places = path.end[path.kind == Kind.DRILL]
    return float(move_time(np.diff(places * (1.0, 1.0, 0.0), axis=0), machine).sum())


def travel(source: str, machine: str) -> list[str]:
    """Return what ordering saves of the travel between holes of a program in random order."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "board.nc")
        path.write_text(source)
        row, outcome = run(path, machine)
    assert outcome is not None, row
    before, after = outcome.before, outcome.after
    seconds = [travel_seconds(path, outcome.machine) for path in (outcome.path_before, outcome.path_after)]
    gap = "" if outcome.gap is None else f"{100 * outcome.gap:.2f}"
    return [
        f"{before.travel_mm / 1000:.2f}", f"{after.travel_mm / 1000:.2f}",
        f"{seconds[0]:.1f}", f"{seconds[1]:.1f}", f"{100 * (1 - seconds[1] / seconds[0]):.1f}", gap,
        f"{outcome.saved_percent:.1f}", row[-1],
    ]  # fmt: skip


def main() -> None:
    """Measure and print the tables; write them into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("--machine", default="linuxcnc-mill", help="a machine of leafcut")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    rows = [run(path, arguments.machine)[0] for path in real_files()]
    random = [[name, *travel(drilling_program(xy, 1), arguments.machine)] for name, xy in boards()]
    text = f"""## Programs of other CAMs

Pieces of work that can be reordered (movable), barriers that stayed, machine time in s before and after on
{arguments.machine}, and what was saved of it, percent. Most programs spend their
time in the cuts, which stay as they are.

{facts("resequence", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["program", "work", "movable", "barriers", "before", "after", "saved", "judged"], rows)}

Drilling programs in random order: travel in m; time from hole to hole in s, without up and down at the holes, and what
was saved of it, percent; how far it is at most above the least possible, percent; and what was saved of all machine
time, percent.

{table(["board", "travel", "now", "time", "now", "saved", "gap", "in all", "judged"], random)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "resequence", text)


if __name__ == "__main__":
    main()
