"""Estimated machine time compared with a simulated LinuxCNC that runs the same programs.

    python -m benchmarks machine_time
    python -m benchmarks machine_time plasma relief

LinuxCNC counts its own servo cycles, so its time does not depend on the host. LEAFCUT_LINUXCNC names the folder of the
simulation (``simrun.py``), which is ../shared/linuxcnc by default.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks import page, shared
from benchmarks.timed_programs import SLOW, pockets, programs, sheets
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.read.machine import load_machine
from leafcut.timing.toolpath import measure_toolpath

SIMULATION = shared("LEAFCUT_LINUXCNC", "linuxcnc")

#: Python for the simulation, because the modules of LinuxCNC belong to the Python of the system.
PYTHON = "/usr/bin/python3"

#: Required programs and their Debian packages.
TOOLS = {"linuxcnc": "linuxcnc-uspace", "faketime": "faketime"}

#: Tool table of the simulation.
TOOL_TABLE = "".join(f"T{tool} P{tool} D3.0 Z0 ;\n" for tool in range(1, 100))

#: Speed of the simulation, as a factor of real time; a faster simulation stretches M words and dwells, and on a busy
#: host it stops a program early, or starves it of lines, which lengthens its time.
SPEED, SPEED_WITH_DWELLS, REAL_TIME = 20, 5, 1

#: Maximum relative error of any program, and of a program that leafcut wrote.
WORST, WORST_OWN = 0.05, 0.02


def check_tools() -> None:
    """Raise an error unless LinuxCNC, faketime and the simulation are installed.

    Raises
    ------
    AssertionError
        A program or the simulation is missing.
    """
    missing = [f"Debian's {package}" for tool, package in TOOLS.items() if shutil.which(tool) is None]
    missing += [] if (SIMULATION / "simrun.py").exists() else [f"{SIMULATION}/simrun.py (LEAFCUT_LINUXCNC)"]
    assert not missing, f"the simulated LinuxCNC needs {' and '.join(missing)}"


def run_simulation(text: str, speed: int, limit: float = 3600.0) -> dict[str, Any]:
    """Run a program in the simulated LinuxCNC for at most `limit` seconds of machine time, and return its answer."""
    with tempfile.TemporaryDirectory() as folder:
        # Use a copy of the simulation, with a table of all tools that programs call.
        for part in SIMULATION.iterdir():
            shutil.copy(part, folder)
        program, tools = Path(folder, "part.ngc"), Path(folder, "tool.tbl")
        program.write_text(text, encoding="latin-1", errors="replace")
        tools.chmod(0o644)
        tools.write_text(TOOL_TABLE)
        command = [PYTHON, str(Path(folder, "simrun.py")), str(program), "--speed", str(speed), "--limit", f"{limit:g}"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        answer: dict[str, Any] = json.loads(done.stdout)
    except json.JSONDecodeError:
        return {"ok": False, "errors": [[0, done.stderr[-300:]]]}
    return answer


def simulated_seconds(text: str, slow: bool = False) -> float:
    """Return the time from the first to the last change of the commanded position in the simulated LinuxCNC, s.

    Raises
    ------
    AssertionError
        LinuxCNC refused the program or stopped before its end.
    """
    check_tools()
    slow = slow or re.search(r"G4 ?P|G82|M3", text) is not None
    for speed in (SPEED_WITH_DWELLS if slow else SPEED, SPEED_WITH_DWELLS, REAL_TIME):
        answer = run_simulation(text, speed)
        if answer.get("ok"):
            return float(answer["motion_s"])
    raise AssertionError(f"LinuxCNC did not run the program: {answer.get('errors')}")


def estimated_seconds(text: str) -> float:
    """Return the time that leafcut estimates for the same machine, s; like the simulation, the path starts at machine
    zero.
    """
    path = interpret_program(text, load_dialect("linuxcnc")).path
    return measure_toolpath(_from_zero(path), load_machine("linuxcnc-sim")).time_s


def _from_zero(path: Toolpath) -> Toolpath:
    return replace(
        path,
        kind=np.append(np.int8(Kind.RAPID), path.kind),
        end=np.concatenate([np.zeros((1, 3)), path.end]),
        value=np.append(0.0, path.value),
        ref=np.append(np.int32(0), path.ref),
        line=np.append(np.int32(0), path.line),
    )


@dataclass(frozen=True)
class Group:
    """A table: introduction, programs, number of simulated runs of each program, and maximum relative error.

    Other load on the host can only lengthen the many stops of a sheet, so the shortest run counts.
    """

    words: str
    programs: Callable[[], dict[str, Callable[[], str]]]
    runs: int
    worst: float


GROUPS = (
    Group(
        """## Programs

The table compares the run time of LinuxCNC 2.9 with leafcut's estimate for the same program (profile `linuxcnc-sim`).
LinuxCNC ran on a simulated machine with 100/100/50 mm/s and 500/500/300 mm/s², timed by its servo clock. Both times
start at machine zero. A real file without G61 and G64 was given G64, LinuxCNC's initial mode. The formulas are
LinuxCNC's. Two details were chosen after first comparisons with these programs: half a cycle at every stop, and the
radius of helices.""",
        programs, 1, WORST,
    ),
    Group(
        """## Sheets

leafcut wrote these programs from a drawing of parts in mild steel, for plasma with G64 P0.1. In each cut, the torch
descends to the pierce height, is lit, waits for the pierce delay, descends to the cut height, cuts the lead-in, the
contour and the lead-out, is switched off, and rises. Small holes are cut more slowly. The shorter of two simulated runs
counts, because a busy host lengthens M words and dwells.""",
        sheets, 2, WORST_OWN,
    ),
    Group(
        """## Pockets

leafcut wrote these programs for pockets, with a mill of 10 mm at 1200 mm/min. They contain levels, ramps, helices, arcs
and finishing passes.""",
        pockets, 2, WORST_OWN,
    ),
)  # fmt: skip


def main(argv: Sequence[str]) -> int:
    """Compare both times of each program, and publish the tables."""
    parser = page.parser("machine_time", __doc__)
    parser.add_argument("names", nargs="*", help="only programs with one of these texts in their name")
    given = parser.parse_args(argv)
    check_tools()
    sections = []
    for group in GROUPS:
        chosen = {
            name: text_of
            for name, text_of in group.programs().items()
            if not given.names or any(part in name for part in given.names)
        }
        if chosen:
            sections.append(f"{group.words}\n\n{compared(group, chosen)}")
    if not sections:
        parser.error("no program has such a name")
    facts = page.facts("machine_time", argv, ["leafcut", "numpy", "numba"])
    text = "\n\n".join(["# Machine time compared with LinuxCNC", facts, *sections])
    page.publish("machine_time", text, given.write)
    return 0


def compared(group: Group, chosen: dict[str, Callable[[], str]]) -> str:
    """Return the table of some programs in a group, and a summary of the errors."""
    rows, errors = [], []
    for name, text_of in chosen.items():
        text = text_of()
        truth = min(simulated_seconds(text, slow=name == SLOW) for _ in range(group.runs))
        ours = estimated_seconds(text)
        errors.append(abs(ours / truth - 1.0))
        rows.append([name, f"{truth:.3f}", f"{ours:.3f}", f"{ours / truth:.4f}"])
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
        assert errors[-1] <= group.worst, f"{name}: {100 * errors[-1]:.1f} % off"
    summary = (
        f"{len(rows)} programs, {sum(error <= 0.02 for error in errors)} of them within 2 %; largest error "
        f"{100 * max(errors):.1f} %, median {100 * median(errors):.2f} %."
    )
    return f"{page.table(['program', 'LinuxCNC, s', 'leafcut, s', 'ratio'], rows)}\n\n{summary}"
