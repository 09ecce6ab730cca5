"""Real programs, and those in the styles of ten CAMs, put in order: time saved, what stays and why, judged by LinuxCNC.

    python benchmarks/real_files.py --simulate 200 --write docs/benchmarks.md
    python benchmarks/real_files.py lightburn vcarve

Every new program was read back and does the same work as the original, or it was not written. Where LinuxCNC's
interpreter (`rs274`) takes the original, it must take the new one, and its canonical cutting moves must be the same.
With ``--simulate`` the simulated LinuxCNC runs both, where they differ and the original takes no more than so many
seconds.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from machine_time import PYTHON, SIMULATION
from page import facts, table, write_section
from resequence import judged, real_files

import leafcut
from leafcut.errors import LeafcutError
from leafcut.model.outcome import Outcome
from leafcut.report.wording import staying_words

STYLES = Path(__file__).parents[1] / "tests" / "styles"

#: By the beginning of the name, the machine that runs it; the first that fits counts. None: what leafcut chooses.
MACHINES: dict[str, str | None] = {
    "fusion_haas": "haas-vf2", "mastercam": "haas-vf2", "fusion_grbl": "grbl-3018", "freecad_grbl": "grbl-3018",
    "estlcam": "grbl-3018", "vcarve_grbl": "grbl-3018", "vcarve": "mach3-router", "sheetcam_mach3": "mach3-router",
    "sheetcam_qtplasmac": "plasma-table", "lcnc_plasmac": "plasma-table", "lightburn": None, "inkscape_laser": None,
    "cncjs_jsdc": None,
}  # fmt: skip

#: The simulated machine runs so many times faster than life; where it stops part-way, slower. M words stretch a little.
SPEEDS = (20, 5)
#: So many reasons why pieces stay are named.
MOST_REASONS = 4
#: A program may be so much slower in the simulation, whose M words and dwells depend on its host, s and part.
ROOM_S, ROOM = 0.2, 0.005


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


def simulated_seconds(text: str, speeds: tuple[int, ...] = SPEEDS) -> float | None:
    """Return the seconds that the simulated LinuxCNC takes from the first move to the last, or None."""
    # Nobody is there to go on after a stop.
    text = re.sub(r"(?m)^([ \t]*(?:N[0-9]+[ \t]*)?)M0?[01](?![0-9])", r"\1", text)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.ngc"
        file.write_text(text, encoding="latin-1", errors="replace")
        for speed in speeds:
            command = [PYTHON, str(SIMULATION / "simrun.py"), str(file), "--speed", str(speed)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            try:
                answer: dict[str, Any] = json.loads(done.stdout or "{}")
            except json.JSONDecodeError:
                continue
            if answer.get("ok"):
                return float(answer["motion_s"])
    return None


def why(outcome: Outcome) -> str:
    """Return how many pieces of work stay, and why."""
    return "; ".join(said.replace("|", "/") for said in staying_words(outcome, MOST_REASONS)) or "none stays"


def run(path: Path, longest: float) -> list[str]:
    """Return the row of one program."""
    machine, text = machine_of(path.name), path.read_text(encoding="latin-1")
    try:
        outcome = leafcut.optimize(path, threads=1, **({} if machine is None else {"machine": machine}))
    except LeafcutError as problem:
        return [path.name, "", "", "", "", "", "", f"refused: {str(problem).split(': ', 1)[-1][:90]}", ""]
    assert outcome.verified and outcome.after.time_s <= outcome.before.time_s * (1 + 1e-9)
    counts = (outcome.certificate or {}).get("before", {})
    work = ", ".join(f"{counts[k]:,} {k}" for k in ("holes", "cuts") if counts.get(k))
    free = outcome.pieces - sum(group.count for group in outcome.staying)
    text, new = for_linuxcnc(text), for_linuxcnc(outcome.text)
    said = judged(text, replace(outcome, text=new))
    simulated = ""
    if longest and outcome.before.time_s <= longest and new != text:
        before, after = simulated_seconds(text), simulated_seconds(new)
        if before is not None and after is not None:
            if after > before * (1 + ROOM) + ROOM_S:
                # On a busy host M words take longer, the more so the faster it runs.
                before, after = (simulated_seconds(t, SPEEDS[1:]) or s for t, s in ((text, before), (new, after)))
            simulated = f"{before:.1f} → {after:.1f}"
            if after > before * (1 + ROOM) + ROOM_S:
                simulated += " slower"
    of = f"{free:,} of {outcome.pieces:,}"
    return [
        path.name, work, of, f"{outcome.before.time_s:.1f}", f"{outcome.after.time_s:.1f}",
        f"{outcome.saved_percent:.1f}", simulated, said, why(outcome),
    ]  # fmt: skip


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("names", nargs="*", help="only programs with one of these in their name")
    made.add_argument("--simulate", type=float, default=0.0, help="simulate programs up to so many seconds")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    files = [*real_files(), *sorted(p for p in STYLES.iterdir() if p.suffix != ".md")]
    rows = []
    for path in files:
        if arguments.names and not any(part in path.name for part in arguments.names):
            continue
        rows.append(run(path, arguments.simulate))
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    taken = [row for row in rows if row[3]]
    before, after = (sum(float(row[k]) for row in taken) for k in (3, 4))
    by_rs274 = sum("by rs274, too" in row[7] for row in taken)
    simulated = [row[6] for row in taken if row[6]]
    slower = sum("slower" in words for words in simulated)
    text = f"""## Real files, and programs in the styles of ten CAMs

{len(rows)} programs, {len(taken)} of them read and ordered; machine time in s before and after on the machine of
each, {before:,.0f} s before and {after:,.0f} s after in all; what was saved, percent. {by_rs274} were judged by rs274:
the same cutting moves. {len(simulated)} ran in the simulated LinuxCNC before and after (its own seconds, on its own \
machine), {slower}
of them slower after. Pieces of work that are free to be ordered, and why the others stay, with the first line.

{facts("real_files", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["program", "work", "free", "before", "after", "saved", "LinuxCNC", "judged", "what stays and why"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "real_files", text)


if __name__ == "__main__":
    main()
