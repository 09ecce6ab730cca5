"""Real programs, and those in the styles of ten CAMs, put in order: time saved, what stays and why, judged by LinuxCNC.

    python benchmarks/real_files.py --simulate 6000 --state simulated.json --write docs/benchmarks.md
    python benchmarks/real_files.py lightburn vcarve

Every new program was read back and does the same work as the original, or it was not written. Where LinuxCNC's
interpreter (`rs274`) takes the original, it must take the new one, and its canonical cutting moves must be the same.
With ``--simulate`` the simulated LinuxCNC runs both on axes as fast as those of the machine, where they differ and the
original takes no more than so many seconds; where a new one is slower the exit status is 1. That takes an hour; with
``--state`` a run that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from machine_time import PYTHON, SIMULATION, check_tools
from page import facts, table, write_section
from resequence import judged, real_files

import leafcut
from leafcut.errors import LeafcutError
from leafcut.files import write_whole
from leafcut.model.machine import Machine
from leafcut.model.outcome import Outcome
from leafcut.processes.program.report import staying_words

STYLES = Path(__file__).parents[1] / "tests" / "styles"

#: By the beginning of the name, the machine that runs it; the first that fits counts. None: what leafcut chooses.
MACHINES: dict[str, str | None] = {
    "fusion_haas": "haas-vf2", "mastercam": "haas-vf2", "fusion_grbl": "grbl-3018", "freecad_grbl": "grbl-3018",
    "estlcam": "grbl-3018", "vcarve_grbl": "grbl-3018", "vcarve": "mach3-router", "sheetcam_mach3": "mach3-router",
    "sheetcam_qtplasmac": "plasma-table", "lcnc_plasmac": "plasma-table", "lightburn": None, "inkscape_laser": None,
    "cncjs_jsdc": None,
}  # fmt: skip

#: The simulated machine runs so many times faster than life; where it stops part-way, on a busy host, slower.
SPEEDS = (20, 8, 4)
#: So many reasons why pieces stay are named.
MOST_REASONS = 4
#: A program may be so much slower in the simulation, whose M words and dwells depend on its host, s and part.
ROOM_S, ROOM = 0.2, 0.005
#: So many times both are run where the new one seems slower, each time less fast: what else a host does makes a run
#: longer, as moves come too late to be blended.
RUNS = 4
#: The tools that the simulated machine has.
TOOL_TABLE = "".join(f"T{t} P{t} D3.0 Z0 ;\n" for t in range(1, 100))


def machine_of(name: str) -> str | None:
    """Return the machine of a file."""
    return next((machine for begin, machine in MACHINES.items() if name.startswith(begin)), "linuxcnc-mill")


def for_linuxcnc(text: str) -> str:
    """Return a program without what LinuxCNC's interpreter alone cannot take, and which changes no move.

    Its number at the top, the units that it leaves to the machine, the materials of QtPlasmaC.
    """
    if "M98" not in text:
        text = re.sub(r"(?m)^[ \t]*O[0-9]+", "", text)
    text = text.replace("F#<_hal[plasmac.cut-feed-rate]>", "F2540")
    text = re.sub(r"(?m)^(M190.*|M66 P3.*)$", "", text)
    if not re.search(r"(?i)G ?2[01](?![0-9])", text):
        text = "G21\n" + text
    return text if re.search(r"(?im)^[^(;\n]*M0?(2|30)(?![0-9])|^%", text) else f"{text}\nM2\n"


class Simulation:
    """The simulated LinuxCNC; what it has run is kept in a file, if one is given."""

    def __init__(self, state: Path | None = None) -> None:
        self.state = state
        #: By program and machine, the seconds of every run, or why it does not run.
        self.known: dict[str, list[float] | str] = {}
        if state is not None and state.exists():
            self.known = json.loads(state.read_text(encoding="utf-8"))

    def seconds(self, text: str, machine: Machine, runs: int = 1) -> float | str:
        """Return the least seconds of so many runs from the first move to the last, or why it does not run."""
        # Nobody is there to go on after a stop.
        text = re.sub(r"(?m)^([ \t]*(?:N[0-9]+[ \t]*)?)M0?[01](?![0-9])", r"\1", text)
        axes = [",".join(f"{value:g}" for value in of) for of in (machine.rapid_velocity, machine.acceleration)]
        name = hashlib.sha256("\n".join([text, *axes]).encode()).hexdigest()[:20]
        found = self.known.get(name, [])
        while not isinstance(found, str) and len(found) < runs:
            one = _simulated(text, axes, SPEEDS[min(len(found), len(SPEEDS) - 1) :])
            found = one if isinstance(one, str) else [*found, one]
            self.known[name] = found
            if self.state is not None:
                write_whole(self.state, json.dumps(self.known))
        return found if isinstance(found, str) else min(found)

    def compared(self, before: str, after: str, machine: Machine) -> str:
        """Return the seconds of a program and of the new one, and ``slower`` where the new one is; or why not."""
        for runs in range(1, RUNS + 1):
            old, new = self.seconds(before, machine, runs), self.seconds(after, machine, runs)
            if isinstance(old, str):
                return f"not run: {old}"
            if isinstance(new, str):
                raise AssertionError(f"LinuxCNC ran the original, and not the new program: {new}")
            if new <= old * (1 + ROOM) + ROOM_S:
                return f"{old:.1f} → {new:.1f}"
        return f"{old:.1f} → {new:.1f} slower"


def _simulated(text: str, axes: list[str], speeds: tuple[int, ...]) -> float | str:
    """Return the seconds of one run, or what LinuxCNC says."""
    check_tools()
    said = "it did not come to an end"
    with tempfile.TemporaryDirectory() as folder:
        # Its own folder, with a table of all the tools that programs ask for.
        for part in SIMULATION.iterdir():
            shutil.copy(part, folder)
        file, tools = Path(folder, "part.ngc"), Path(folder, "tool.tbl")
        file.write_text(text, encoding="latin-1", errors="replace")
        tools.chmod(0o644)
        tools.write_text(TOOL_TABLE)
        for speed in speeds:
            command = [PYTHON, str(Path(folder, "simrun.py")), str(file), "--speed", str(speed), "--limit", "20000"]
            done = subprocess.run(
                [*command, "--vel", axes[0], "--acc", axes[1]], capture_output=True, text=True, check=False
            )
            try:
                answer: dict[str, Any] = json.loads(done.stdout or "{}")
            except json.JSONDecodeError:
                continue
            if answer.get("ok"):
                return float(answer["motion_s"])
            # 11: the operator is told of an error of the program; everything else may be the busy host's doing.
            said = next((e[1] for e in answer.get("errors", []) if e[0] == 11 and "timeout" not in e[1]), "")
            if said:
                break
    return said or "it did not come to an end"


def why(outcome: Outcome) -> str:
    """Return how many pieces of work stay, and why."""
    return "; ".join(said.replace("|", "/") for said in staying_words(outcome.detail, MOST_REASONS)) or "none stays"


def run(path: Path, longest: float, simulation: Simulation) -> list[str]:
    """Return the row of one program."""
    machine, text = machine_of(path.name), path.read_text(encoding="latin-1")
    try:
        outcome = leafcut.optimize(path, threads=1, **({} if machine is None else {"machine": machine}))
    except LeafcutError as problem:
        return [path.name, "", "", "", "", "", "", f"refused: {str(problem).split(': ', 1)[-1][:90]}", ""]
    assert outcome.verified and outcome.after.time_s <= outcome.before.time_s * (1 + 1e-9)
    counts = asdict(outcome.detail.certificate.before)
    work = ", ".join(f"{counts[k]:,} {k}" for k in ("holes", "cuts") if counts.get(k))
    free = outcome.detail.pieces - sum(group.count for group in outcome.detail.staying)
    text, new = for_linuxcnc(text), for_linuxcnc(outcome.text)
    said = judged(text, replace(outcome, text=new))
    simulated = ""
    if new == text:
        simulated = "not changed"
    elif outcome.before.time_s > longest:
        simulated = "not run: too long" if longest else ""
    else:
        simulated = simulation.compared(text, new, outcome.machine)
    of = f"{free:,} of {outcome.detail.pieces:,}"
    return [
        path.name, work, of, f"{outcome.before.time_s:.1f}", f"{outcome.after.time_s:.1f}",
        f"{outcome.saved_percent:.1f}", simulated, said, why(outcome),
    ]  # fmt: skip


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("names", nargs="*", help="only programs with one of these in their name")
    made.add_argument("--simulate", type=float, default=0.0, help="simulate programs up to so many seconds")
    made.add_argument("--state", type=Path, help="a file that keeps what was simulated, to go on with")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    files = [*real_files(), *sorted(p for p in STYLES.iterdir() if p.suffix != ".md")]
    rows, simulation = [], Simulation(arguments.state)
    for path in files:
        if arguments.names and not any(part in path.name for part in arguments.names):
            continue
        rows.append(run(path, arguments.simulate, simulation))
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    taken = [row for row in rows if row[3]]
    before, after = (sum(float(row[k]) for row in taken) for k in (3, 4))
    by_rs274 = sum("by rs274, too" in row[7] for row in taken)
    simulated = [row[6] for row in taken if "→" in row[6]]
    slower = sum("slower" in words for words in simulated)
    changed = sum(row[6] != "not changed" for row in taken)
    text = f"""## Real files, and programs in the styles of ten CAMs

{len(rows)} programs, {len(taken)} of them read and ordered; machine time in s before and after on the machine of
each, {before:,.0f} s before and {after:,.0f} s after in all; what was saved, percent. {by_rs274} were judged by rs274:
the same cutting moves. {changed} have been changed; {len(simulated)} of these ran in the simulated LinuxCNC before and
after (its own seconds, on axes as fast as those of the machine), {slower} of them slower after. Pieces of work that \
are free to
be ordered, and why the others stay, with the first line.

LinuxCNC runs one and the same program up to 7 % longer or shorter by the number of comment lines at its top: the first
pocket of fusion_linuxcnc_inch_two_tools.ngc takes 21.1 s with none or three and 19.7 s with five, as corners are
blended or not where a program says neither G61 nor G64. With the two comments of the new program above the original,
that one takes 406.0 s and the new 398.3 s: it is not slower for its order.

{facts("real_files", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["program", "work", "free", "before", "after", "saved", "LinuxCNC", "judged", "what stays and why"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "real_files", text)
    if slower:
        sys.exit(f"slower in the simulated LinuxCNC: {', '.join(row[0] for row in taken if 'slower' in row[6])}")


if __name__ == "__main__":
    main()
