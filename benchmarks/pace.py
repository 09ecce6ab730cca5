"""Machine time saved on real programs by order, lower retracts, rapids in air and higher feeds; thickest chips.

    python -m benchmarks pace --simulate 900
    python -m benchmarks pace enclosure kb35

leafcut optimizes every program whose stock can be derived, with all three options. The stock is the block reported by
`leafcut stock`, which is the bounding box of all cuts below Z0. If LinuxCNC's interpreter accepts the original, it must
also accept the new program. With `--simulate`, the simulated LinuxCNC runs all new programs up to that machine time,
without stops and without lines after the last move. leafcut estimates the time of the same program, and both times are
compared.

The benchmark stops if a chip exceeds its limit, or if the error of a time exceeds 2 %.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import leafcut
from benchmarks import data_folder, page
from benchmarks.machine_time import TOOL_TABLE, check_tools, estimated_seconds, run_simulation
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.pace_change import PaceChange
from leafcut.model.toolpath import MOTIONS

#: Profile of the simulated machine, and width of tools without a description, mm.
MACHINE, WIDTH = "linuxcnc-sim", 3.0
#: Maximum relative error of a time.
WORST = 0.02
#: Speeds of the simulation, as multiples of real time, that are tried until leafcut's time agrees.
SPEEDS = (20, 8, 4, 4)
#: Maximum machine time of a simulation, s.
LONGEST = 20_000.0
HEAD = ["program", "before, s", "order", "retracts", "air", "feeds", "after, s", "saved, %", "chip", "check"]


def real_files() -> list[Path]:
    """Return the programs in the shared data, shortest first."""
    files = [path for path in (data_folder() / "gcode").iterdir() if path.suffix != ".md"]
    return sorted(files, key=lambda path: path.stat().st_size)


def for_linuxcnc(text: str) -> str:
    """Return a program with the same moves that LinuxCNC accepts: without an O number, and with units and an end."""
    if "M98" not in text:
        text = re.sub(r"(?m)^[ \t]*O[0-9]+", "", text)
    if not re.search(r"(?i)G ?2[01](?![0-9])", text):
        text = "G21\n" + text
    return text if re.search(r"(?im)^[^(;\n]*M0?(2|30)(?![0-9])|^%", text) else f"{text}\nM2\n"


def accepted(text: str) -> bool:
    """Return whether LinuxCNC's interpreter accepts a program."""
    program = shutil.which("rs274")
    assert program is not None, "rs274 is required: apt-get install linuxcnc-uspace"
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "tool.tbl").write_text(TOOL_TABLE)
        Path(folder, "part.ngc").write_text(text, encoding="utf-8")
        # At its start, rs274 truncates a memory map in its home folder, so two runs in the same folder kill each other.
        done = subprocess.run(
            [program, "-g", "-t", "tool.tbl", "part.ngc"],
            cwd=folder, env={**os.environ, "HOME": folder}, capture_output=True, check=False,
        )  # fmt: skip
    return done.returncode == 0


def moves_only(text: str) -> str:
    """Remove stops, which wait for a person, and lines after the last move from a program.

    The simulation does not count a dwell at the end.
    """
    text = re.sub(r"(?m)^([ \t]*(?:N[0-9]+[ \t]*)?)M0?[01](?![0-9])", r"\1", text)
    path = interpret_program(text, load_dialect("linuxcnc")).path
    last = int(path.line[np.isin(path.kind, [int(kind) for kind in MOTIONS])][-1])
    return "\n".join([*text.splitlines()[:last], "M2", ""])


def simulated(text: str, ours: float) -> float:
    """Return the time of a program in LinuxCNC, s.

    Other load on the host can only lengthen a run. Therefore, while the time differs from `ours`, the program is run
    again more slowly, and the shortest run counts.
    """
    truth = math.inf
    for speed in SPEEDS:
        answer = run_simulation(text, speed, LONGEST)
        truth = min(truth, float(answer["motion_s"]) if answer.get("ok") else math.inf)
        if abs(ours / truth - 1.0) <= WORST:
            break
    return truth


def run(path: Path, longest: float) -> list[str]:
    """Return the table row of a program, or its name and the reason why it was refused."""
    try:
        stock = leafcut.stock(path, machine=MACHINE, tool_diameter=WIDTH)
        block = ",".join(f"{side:.6f}" for side in (*stock.block.low, *stock.block.high))
        outcome = leafcut.optimize(
            path,
            process="reorder",
            machine=MACHINE,
            tool_diameter=WIDTH,
            workpiece=block,
            time_limit=5,
            air=True,
            feeds=True,
            low_retracts=True,
        )
    except LeafcutError as error:
        return [path.name, str(error).partition(": ")[2]]
    pace: PaceChange = outcome.detail.pace
    parts = [pace.retracts_s or 0.0, pace.air_s or 0.0, pace.feeds_s or 0.0]
    before, after = outcome.before.time_s, outcome.after.time_s
    order = before - after - sum(parts)
    for tool in pace.tools:
        assert tool.chip_after <= tool.chip_limit * 1.000001, f"{path.name}: {tool}"
    chips = ", ".join(f"{tool.chip_before:.3g} → {tool.chip_after:.3g}" for tool in pace.tools) or "–"
    check = "original refused"
    if accepted(for_linuxcnc(path.read_text(encoding="utf-8", errors="replace"))):
        assert accepted(for_linuxcnc(outcome.text)), f"{path.name}: rs274 refuses the new program"
        check = "rs274"
        if after <= longest:
            text = moves_only(for_linuxcnc(outcome.text))
            ours = estimated_seconds(text)
            truth = simulated(text, ours)
            check += f", simulated {truth:.1f} s: {ours / truth:.3f}"
            assert abs(ours / truth - 1.0) <= WORST, f"{path.name}: {check}"
    return [
        path.name, f"{before:.1f}", *(f"{part:.1f}" for part in (order, *parts)), f"{after:.1f}",
        f"{100 * (1 - after / before):.1f}", chips, check,
    ]  # fmt: skip


def main(argv: Sequence[str]) -> int:
    """Optimize all programs and publish the table."""
    parser = page.parser("pace", __doc__)
    parser.add_argument("names", nargs="*", help="only programs with one of these texts in their name")
    parser.add_argument("--simulate", type=float, default=0.0, help="most machine time of a simulated program, s")
    given = parser.parse_args(argv)
    if given.simulate:
        check_tools()
    rows: list[list[str]] = []
    refused: list[list[str]] = []
    for path in real_files():
        if given.names and not any(part in path.name for part in given.names):
            continue
        row = run(path, given.simulate)
        print("  ".join(row), file=sys.stderr, flush=True)
        (rows if len(row) == len(HEAD) else refused).append(row)
    rows, refused = sorted(rows), sorted(refused)
    known = sum("rs274" in row[-1] for row in rows)
    errors = [abs(float(row[-1].rpartition(" ")[2]) - 1.0) for row in rows if "simulated" in row[-1]]
    worst = f", largest error {100 * max(errors):.1f} %" if errors else ""
    text = f"""# Savings on real programs

Seconds saved by the order (`reorder` alone), by lower retracts and R planes (`--low-retracts`), by rapids in air
(`--air`) and by higher feeds (`--feeds`, at most 50 % more), on the machine `{MACHINE}`. The stock is the block around
all cuts below Z0. Tools without a description are flat mills of {WIDTH:g} mm. The column *chip* shows the thickest chip
of each tool before and after, in mm per revolution; the limit is that of the original program. The column *check*
states whether LinuxCNC's interpreter (rs274) accepts both programs, and whether the simulated LinuxCNC runs the new
program. The ratio is leafcut's time divided by LinuxCNC's time. Both times are of the new program without stops and
without lines after its last move, so they can differ from the column *after*. LinuxCNC accepts {known} of {len(rows)}
programs; {len(errors)} were simulated{worst}. No chip exceeds its limit.

{page.facts("pace", argv, ["leafcut", "numpy", "numba"])}

{page.table(HEAD, rows)}

Refused: {"; ".join(f"{name} ({reason})" for name, reason in refused) or "none"}."""
    page.publish("pace", text, given.write)
    return 0
