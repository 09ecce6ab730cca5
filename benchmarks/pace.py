"""What the stock lets real programs save: time by order, retracts, air and feeds, and the thickest chips.

    python benchmarks/pace.py --simulate 900 --write docs/benchmarks.md
    python benchmarks/pace.py enclosure kb35

Every program of the data that mills or drills a block that can be derived is put in order with all three options. The
block is what `leafcut stock` derives: just around the cuts below Z0. LinuxCNC's interpreter must take what it took
before (but for what changes no move: `real_files.for_linuxcnc`); with ``--simulate`` the simulated LinuxCNC runs what
takes no more than so many seconds: its time is compared with leafcut's. A chip above its limit, or a time that is
farther off than 2 %, is an error.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from machine_time import estimated_seconds
from page import facts, table, write_section
from real_files import RUNS, Simulation, for_linuxcnc
from resequence import real_files

import leafcut
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.pace_change import PaceChange
from leafcut.model.toolpath import MOTIONS

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from rs274_moves import run_rs274

#: The simulated machine's profile; how wide tools are that nothing describes, mm.
MACHINE, WIDTH = "linuxcnc-sim", 3.0
#: A time may be so far off.
OFF = 0.02
HEAD = ["program", "before, s", "order", "retracts", "air", "feeds", "after, s", "saved, %", "chip", "judged"]


def taken(text: str) -> bool:
    """Return whether LinuxCNC's interpreter takes a program."""
    program = shutil.which("rs274")
    assert program is not None, "rs274 is needed: apt-get install linuxcnc-uspace"
    with tempfile.TemporaryDirectory() as folder:
        return run_rs274(program, text, Path(folder))[0] == 0


def until_last_move(text: str) -> str:
    """Return a program without what stands behind its last move: the simulation counts no dwell there."""
    path = interpret_program(text, dialect("linuxcnc")).path
    last = int(path.line[np.isin(path.kind, [int(kind) for kind in MOTIONS])][-1])
    return "\n".join([*text.splitlines()[:last], "M2", ""])


def run(path: Path, longest: float, simulation: Simulation) -> list[str]:
    """Return a line of the table, or the program's name and why there is none."""
    try:
        found = leafcut.cut_stock(path, machine=MACHINE, mill_diameter=WIDTH)
        block = ",".join(f"{side:.6f}" for side in (*found.block.low, *found.block.high))
        outcome = leafcut.optimize(
            path, process="reorder", machine=MACHINE, mill_diameter=WIDTH, workpiece=block, time_limit=5,
            air=True, feeds=True, low_retracts=True,
        )  # fmt: skip
    except LeafcutError as error:
        return [path.name, str(error).partition(": ")[2]]
    pace: PaceChange = outcome.detail.pace
    parts = [pace.retracts_s or 0.0, pace.air_s or 0.0, pace.feeds_s or 0.0]
    before, after = outcome.before.time_s, outcome.after.time_s
    order = before - after - sum(parts)
    for tool in pace.tools:
        assert tool.chip_after <= tool.chip_limit * 1.000001, f"{path.name}: {tool}"
    chips = ", ".join(f"{one.chip_before:.3g} → {one.chip_after:.3g}" for one in pace.tools) or "–"
    text = path.read_text(encoding="utf-8", errors="replace")
    judged = "rs274" if taken(for_linuxcnc(text)) else "not taken before"
    assert judged != "rs274" or taken(for_linuxcnc(outcome.text)), f"{path.name}: rs274 does not take the new program"
    if judged == "rs274" and after <= longest:
        # Nobody is there to go on after a stop.
        run_on = re.sub(r"(?m)^([ \t]*(?:N[0-9]+[ \t]*)?)M0?[01](?![0-9])", r"\1", for_linuxcnc(outcome.text))
        run_on = until_last_move(run_on)
        ours = estimated_seconds(run_on)
        for runs in range(1, RUNS + 1):
            # What else the host does can only make a run longer.
            truth = simulation.seconds(run_on, outcome.machine, runs)
            assert isinstance(truth, float), f"{path.name}: LinuxCNC does not run the new program: {truth}"
            if abs(ours / truth - 1.0) <= OFF:
                break
        judged += f", simulated {truth:.1f} s: {ours / truth:.3f}"
        assert abs(ours / truth - 1.0) <= OFF, f"{path.name}: {judged}"
    return [
        path.name, f"{before:.1f}", *(f"{part:.1f}" for part in (order, *parts)), f"{after:.1f}",
        f"{100 * (1 - after / before):.1f}", chips, judged,
    ]  # fmt: skip


def main() -> None:
    """Run all programs and print the table; write it into the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", help="only programs with one of these in their name")
    parser.add_argument("--simulate", type=float, default=0.0, help="longest program that LinuxCNC runs, s")
    parser.add_argument("--write", type=Path, help="page whose section is to be renewed")
    arguments = parser.parse_args()
    rows, left_out = [], []
    simulation = Simulation()
    # Long ones last.
    for path in sorted(real_files(), key=lambda file: file.stat().st_size):
        if arguments.names and not any(part in path.name for part in arguments.names):
            continue
        row = run(path, arguments.simulate, simulation)
        print("  ".join(row), file=sys.stderr, flush=True)
        (rows if len(row) == len(HEAD) else left_out).append(row)
    rows, left_out = sorted(rows), sorted(left_out)
    known = sum("rs274" in row[-1] for row in rows)
    off = [abs(float(row[-1].rpartition(" ")[2]) - 1.0) for row in rows if "simulated" in row[-1]]
    worst = f", the time farthest off by {100 * max(off):.1f} %" if off else ""
    text = f"""## What the stock lets real programs save

Seconds saved by the order (`reorder` alone), by lower retracts and R planes (`--low-retracts`), by rapids in the air
(`--air`) and by feeds fitted to the chips (`--feeds`, at most 50 % more), on the machine `{MACHINE}`. The stock is
the block just around the cuts below Z0; tools that nothing describes are taken to be flat mills of {WIDTH:g} mm.
Chip: the thickest in one revolution of each tool, before and after, mm; the limit is the program's own. Judged: by
LinuxCNC's interpreter, and by the simulated machine, with leafcut's time as a part of its time. Of {len(rows)} programs
LinuxCNC takes {known}, before and after; {len(off)} were simulated{worst}. No chip is thicker than its limit.

{facts("pace", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(HEAD, rows)}

Left out: {"; ".join(f"{name} ({why})" for name, why in left_out)}."""
    print(text)
    if arguments.write:
        write_section(arguments.write, "pace", text)


if __name__ == "__main__":
    main()
