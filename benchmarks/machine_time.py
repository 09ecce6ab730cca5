"""Estimated machine time against a simulated LinuxCNC that runs the same programs.

    python benchmarks/machine_time.py --write docs/benchmarks.md
    python benchmarks/machine_time.py plasma relief
    python benchmarks/machine_time.py --sheets --write docs/benchmarks.md
    python benchmarks/machine_time.py --pockets --write docs/benchmarks.md

LinuxCNC's time is counted in its own servo cycles, so it does not depend on the host. The simulation (``simrun.py``) is
looked for in LEAFCUT_LINUXCNC, or in ../shared/linuxcnc.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from page import facts, table, write_section
from timed_programs import SLOW, pockets, programs, sheets

from leafcut.gcode.dialects import dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.read.machine import load_machine
from leafcut.timing.toolpath import measure

SIMULATION = Path(os.environ.get("LEAFCUT_LINUXCNC") or Path(__file__).parents[2] / "shared" / "linuxcnc")

#: The simulation's Python: LinuxCNC's own modules belong to the system's.
PYTHON = "/usr/bin/python3"

#: What it needs: program → Debian package.
TOOLS = {"linuxcnc": "linuxcnc-uspace", "faketime": "faketime"}

#: How many times faster than life the simulated machine runs; M words and dwells stretch when it is faster.
SPEED, SPEED_WITH_DWELLS = 20, 5

#: No program may be farther off, and none that leafcut has written itself.
WORST, WORST_OWN = 0.05, 0.02


def check_tools() -> None:
    """Say in one line what the simulated machine needs and is not here.

    Raises
    ------
    AssertionError
        LinuxCNC, faketime or the simulation is missing.
    """
    missing = [f"Debian's {package}" for tool, package in TOOLS.items() if shutil.which(tool) is None]
    missing += [] if (SIMULATION / "simrun.py").exists() else [f"{SIMULATION}/simrun.py (LEAFCUT_LINUXCNC)"]
    assert not missing, f"the simulated LinuxCNC needs {' and '.join(missing)}"


def simulated_seconds(text: str, slow: bool = False) -> float:
    """Return the seconds from the first to the last change of the commanded position on the simulated LinuxCNC.

    Raises
    ------
    AssertionError
        LinuxCNC refused the program or did not run it to its end.
    """
    check_tools()
    slow = slow or re.search(r"G4 ?P|G82|M3", text) is not None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.ngc"
        file.write_text(text, encoding="utf-8")
        for speed in (SPEED_WITH_DWELLS if slow else SPEED, SPEED_WITH_DWELLS):
            command = [PYTHON, str(SIMULATION / "simrun.py"), str(file), "--speed", str(speed)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            answer: dict[str, Any] = json.loads(done.stdout or "{}")
            if answer.get("ok"):
                return float(answer["motion_s"])
    raise AssertionError(f"LinuxCNC did not run it: {answer.get('errors') or done.stderr[-300:]}")


def estimated_seconds(text: str) -> float:
    """Return leafcut's seconds on the same machine, from its zero, where the simulation stands at first."""
    path = interpret_program(text, dialect("linuxcnc")).path
    return measure(_from_zero(path), load_machine("linuxcnc-sim")).time_s


def _from_zero(path: Toolpath) -> Toolpath:
    return replace(
        path,
        kind=np.append(np.int8(Kind.RAPID), path.kind),
        end=np.concatenate([np.zeros((1, 3)), path.end]),
        value=np.append(0.0, path.value),
        ref=np.append(np.int32(0), path.ref),
        line=np.append(np.int32(0), path.line),
    )


def main() -> None:
    """Run both on every program and print the ratios; write them into the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", help="only programs with one of these in their name")
    parser.add_argument("--sheets", action="store_true", help="sheets that leafcut cuts, in a section of their own")
    parser.add_argument("--pockets", action="store_true", help="pockets that leafcut clears, in a section of their own")
    parser.add_argument("--write", type=Path, help="page whose section is to be renewed")
    arguments = parser.parse_args()
    own = arguments.sheets or arguments.pockets
    made = sheets() if arguments.sheets else pockets() if arguments.pockets else programs()
    worst = WORST_OWN if own else WORST
    rows, off = [], []
    for name, text_of in made.items():
        if arguments.names and not any(part in name for part in arguments.names):
            continue
        text = text_of()
        # What else a host does can only lengthen the many standstills of a sheet: of two runs the shorter counts.
        runs = [simulated_seconds(text, slow=name == SLOW) for _ in range(2 if own else 1)]
        truth, ours = min(runs), estimated_seconds(text)
        off.append(abs(ours / truth - 1.0))
        rows.append([name, f"{truth:.3f}", f"{ours:.3f}", f"{ours / truth:.4f}"])
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
        assert off[-1] <= worst, f"{name}: {100 * off[-1]:.1f} % off"
    if not rows:
        parser.error("no program has such a name")
    said = (
        words_of_sheets() if arguments.sheets else words_of_pockets() if arguments.pockets else words_of_programs(off)
    )
    text = f"""{said}

{facts("machine_time", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["program", "LinuxCNC, s", "leafcut, s", "ratio"], rows)}"""
    print(text)
    if arguments.write:
        kind = "_sheets" if arguments.sheets else "_pockets" if arguments.pockets else ""
        write_section(arguments.write, f"machine_time{kind}", text)


def words_of_programs(off: list[float]) -> str:
    """Return what stands over the table of programs, of which each is so far off."""
    return f"""## Machine time beside LinuxCNC

Seconds of LinuxCNC 2.9 by its own servo clock, on a simulated machine of 100/100/50 mm/s and 500/500/300 mm/s², and
leafcut's estimate for the same program (profile `linuxcnc-sim`). {len(off)} programs: {sum(o <= 0.02 for o in off)} \
within 2 %, the
worst {100 * max(off):.1f} % off, median {100 * median(off):.2f} %. Both begin at machine zero. A real file that does
not say G61 or G64 was given G64, with which LinuxCNC begins. The planner's formulas are LinuxCNC's own; half a cycle at
every stop, and the radius of helices, were chosen after first comparisons with programs of this table."""


def words_of_sheets() -> str:
    """Return what stands over the table of sheets."""
    return """### Sheets beside LinuxCNC

The same comparison for programs that leafcut wrote itself, drawing in, program out (`--process cut --dialect plasma`,
mild steel by plasma, G64 P0.1): at every cut down to the pierce height, torch on, pierce delay, down to the cut height,
leads, the contour, small holes slower, torch off and up. Of two runs of the simulation the shorter counts: when its
host is busy it stands longer at M words and dwells."""


def words_of_pockets() -> str:
    """Return what stands over the table of pockets."""
    return """### Pockets beside LinuxCNC

The same comparison for programs that leafcut wrote itself for pockets (`--process pocket`, a mill of 10 mm at
1200 mm/min): levels, ramps, helices, arcs, finished walls."""


if __name__ == "__main__":
    main()
