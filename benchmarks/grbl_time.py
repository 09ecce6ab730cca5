"""Estimated machine time compared with the firmware GRBL 1.1h on a simulated board.

    python -m benchmarks grbl_time
    python -m benchmarks grbl_time drill arcs
    python -m benchmarks grbl_time --recorded

The board's clock runs from the first motor step to the last, at about the speed of real time; all programs take ten
minutes. `--recorded` compares with the recorded times in `grbl_recorded.toml`. LEAFCUT_GRBL names the folder of the
board (``grblrun.c`` and the firmware), which is ../shared/grbl by default.
"""

from __future__ import annotations

import json
import math
import random
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import ROOT, data_folder, page, shared
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import DrillCycle, Kind, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.writer import write_program
from leafcut.read.machine import load_machine
from leafcut.timing.grbl import count_line_bytes_and_words
from leafcut.timing.toolpath import measure_toolpath, time_rows

BOARD = shared("LEAFCUT_GRBL", "grbl")
DATA = data_folder() / "gcode"
STYLES = ROOT / "tests" / "styles"
RECORDED = Path(__file__).parent / "grbl_recorded.toml"
FIRMWARE = "grbl-1.1h-uno.elf"

#: Maximum relative error for a program, and for a program that only waits for the next line.
WORST, WORST_STARVED = 0.01, 0.04

#: Name prefix of programs that only wait for the next line.
STARVED = "starved"


def machine_of(steps: Sequence[float], rates: Sequence[float], accelerations: Sequence[float], head: Head) -> Machine:
    """Return a machine with a GRBL board, from steps/mm, mm/min and mm/s²."""
    base = load_machine("grbl-laser-5w" if head is Head.LASER else "grbl-3018")
    x, y, z = (rate / 60.0 for rate in rates)
    return replace(
        base,
        steps_per_mm=(steps[0], steps[1], steps[2]),
        rapid_velocity=(x, y, z),
        acceleration=(accelerations[0], accelerations[1], accelerations[2]),
        max_feed=1e4,
    )


SMALL = machine_of([250] * 3, [800] * 3, [10] * 3, Head.SPINDLE)
DESK = machine_of([250] * 3, [2000, 2000, 1000], [50, 50, 30], Head.SPINDLE)
ROUTER = machine_of([40, 40, 189], [5000, 5000, 1000], [400, 400, 250], Head.SPINDLE)
FINE = machine_of([250] * 3, [6000] * 3, [2000] * 3, Head.SPINDLE)
COARSE = machine_of([40] * 3, [6000] * 3, [2000] * 3, Head.SPINDLE)
LASER = machine_of([80] * 3, [6000, 6000, 1000], [1000, 1000, 100], Head.LASER)

HEAD = ["G21 G90 G94 G17"]


def holes(count: int) -> list[tuple[float, float]]:
    """Return random hole positions, mm."""
    rng = random.Random(7)
    return [(round(rng.uniform(2, 60), 3), round(rng.uniform(2, 60), 3)) for _ in range(count)]


def drilling(count: int, feed: int) -> list[str]:
    """Return a program that drills holes with G0 and G1."""
    lines = [*HEAD, "M3 S1000", "G4 P0.5", "G0 Z5"]
    for x, y in holes(12)[:count]:
        lines += [f"G0 X{x} Y{y}", "G0 Z2", f"G1 Z-3 F{feed}", "G0 Z5"]
    return [*lines, "M5", "M30"]


def posted() -> list[str]:
    """Return a program for 8 holes with pecks, written by leafcut's post-processor for GRBL."""
    builder = ToolpathBuilder()
    builder.rapid(z=5.0)
    for x, y in holes(8):
        builder.drill(x, y, DrillCycle("G83", 1.0, -3.0, peck=1.5, to_initial=True), feed=5.0)
    builder.end()
    return write_program(builder.build(), load_dialect("grbl"), PostOptions(header=False)).splitlines()


def pecks() -> list[str]:
    """Return a program for 8 holes, each with pecks and a dwell."""
    lines = [*HEAD, "G0 Z5"]
    for x, y in holes(8):
        lines += [f"G0 X{x} Y{y}", "G0 Z1"]
        for k in range(1, 4):
            lines += [f"G1 Z{-k} F300", "G0 Z1", f"G0 Z{-k + 0.254:.3f}"]
        lines += ["G4 P0.2", "G0 Z5"]
    return [*lines, "M30"]


def arcs() -> list[str]:
    """Return a program with arcs, circles and helices."""
    lines = [*HEAD, "G0 X5 Y0"]
    for i in range(14):
        word, feed = ("G2", " F1500") if i % 2 else ("G3", "  F1200")
        lines.append(f"{word} X{5 + (i + 1) % 3} Y{i + 1} R{1 + 2 * i}{feed}")
    for r in (2, 5, 10):
        lines += [f"G0 X{20 + r} Y20", f"G2 X{20 + r} Y20 I{-r} J0 F2000"]
        lines += [f"G3 X{20 + r} Y20 Z-1 I{-r} J0 F2000", "G0 Z0"]
    return [*lines, "M30"]


def wave(step: float, feed: int, count: int) -> list[str]:
    """Return a program that follows a wave in short moves."""
    lines, x = [*HEAD, "G0 X0 Y0", f"G1 F{feed}"], 0.0
    for _ in range(count):
        x += step
        lines.append(f"X{x:.3f} Y{10 * math.sin(x / 8):.3f}")
    return [*lines, "M30"]


def raster() -> list[str]:
    """Return a laser engraving with a power in every block."""
    lines = [*HEAD, "G0 X0 Y0", "M4 S0"]
    for j in range(12):
        lines.append(f"G0 X{-3 if j % 2 == 0 else 43} Y{j * 0.2:.1f}")
        xs = range(41) if j % 2 == 0 else range(40, -1, -1)
        lines += [f"G1 X{x} S{(x * 37 + j * 11) % 1000} F4000" for x in xs]
    return [*lines, "M5", "M30"]


def outlines() -> list[str]:
    """Return a program for outlines cut by laser."""
    lines = [*HEAD, "M4 S500"]
    for k in range(10):
        x, y = (k % 4) * 15, (k // 4) * 15
        lines += [f"G0 X{x} Y{y}", f"G1 X{x + 10} F1500 S500", f"Y{y + 10}", f"G3 X{x} Y{y + 10} I-5 J0", f"G1 Y{y}"]
    return [*lines, "M5", "M30"]


def switched() -> list[str]:
    """Return a program of cuts with M3 and M5 between them, without laser mode."""
    lines = [*HEAD, "G1 F1500"]
    for k in range(12):
        x, y = (k % 4) * 15, (k // 4) * 15
        lines += [f"G0 X{x} Y{y}", "M3 S500", f"G1 X{x + 10}", f"Y{y + 10}", "M5"]
    return [*lines, "M30"]


def powers() -> list[str]:
    """Return a program of moves with a different S in every block."""
    lines = [*HEAD, "M3 S100", "G1 F1500"]
    return [*lines, *(f"G1 X{(k % 2) * 10 + k * 0.1:.1f} S{100 + k * 10}" for k in range(40)), "M5", "M30"]


def dwells() -> list[str]:
    """Return a program of short moves, each followed by a dwell."""
    lines = [*HEAD, "G1 F1500"]
    for k in range(10):
        lines += [f"G1 X{k + 1}", f"G4 P{0.02 * k:.2f}"]
    return [*lines, "G0 X0", "M30"]


def zigzag() -> list[str]:
    """Return a program that clears a pocket in zigzag lines."""
    lines = [*HEAD, "G0 Z2", "G0 X0 Y0", "G1 Z-1 F200"]
    for k in range(12):
        lines += [f"G1 X{30 if k % 2 == 0 else 0} F1500", f"G1 Y{1.5 * (k + 1)}"]
    return [*lines, "G0 Z5", "M30"]


def short(form: str, count: int, step: float) -> list[str]:
    """Return a program of moves that are too short and fast for the serial line."""
    return ["G21G90G94G17", "G1F6000", *(form.format(step * (i + 1)) for i in range(count))]


def rings() -> list[str]:
    """Return a program of circles that are too small and fast for the processor."""
    lines = ["G21G90G94G17", "G0X0Y0", "G1F6000"]
    for r in (1, 2, 4):
        lines += [f"G2X0Y0I{r}J0", f"G3X0Y0I0J{r}"] * 2
    return lines


def part_of(file: Path, count: int | None = None) -> Callable[[], list[str]]:
    """Return a function that reads the first lines of a file."""
    return lambda: file.read_text(encoding="utf-8", errors="replace").splitlines()[:count]


PROGRAMS: dict[str, tuple[Machine, Callable[[], list[str]]]] = {
    "drilling, 10 mm/s²": (SMALL, lambda: drilling(6, 150)),
    "drilling, 50 mm/s²": (DESK, lambda: drilling(12, 300)),
    "drilling with pecks, leafcut's post": (ROUTER, posted),
    "pecks and dwells": (ROUTER, pecks),
    "drilling, VCarve": (ROUTER, part_of(STYLES / "vcarve_grbl_peck.nc", 60)),
    "arcs and helices": (ROUTER, arcs),
    "arcs and helices, 50 mm/s²": (DESK, arcs),
    "zigzag pocket": (ROUTER, zigzag),
    "zigzag pocket, 50 mm/s²": (DESK, zigzag),
    "pocket, FreeCAD": (ROUTER, part_of(STYLES / "freecad_grbl_pocket.nc", 40)),
    "contour with tabs, Fusion": (ROUTER, part_of(STYLES / "fusion_grbl_contour_tabs.nc", 50)),
    "moves of 1 mm at 4000 mm/min": (ROUTER, lambda: wave(1, 4000, 400)),
    "moves of 0.2 mm at 1200 mm/min": (DESK, lambda: wave(0.2, 1200, 600)),
    "dwells": (ROUTER, dwells),
    "M3 and M5 between cuts": (ROUTER, switched),
    "S in every block": (ROUTER, powers),
    "S in every block, $32=1": (LASER, powers),
    "laser raster, $32=1": (LASER, raster),
    "laser outlines, $32=1": (LASER, outlines),
    "laser raster, LightBurn": (LASER, part_of(STYLES / "lightburn_raster.gc")),
    "laser fill and cut, LightBurn": (LASER, part_of(STYLES / "lightburn_fill_and_cut.gc")),
    "laser, Inkscape": (LASER, part_of(STYLES / "inkscape_laser_switched.gcode", 70)),
    "engraving, bCNC": (ROUTER, part_of(DATA / "bcnc_sample.gcode")),
    "laser cuts, cncjs": (ROUTER, part_of(DATA / "cncjs_jsdc_laser.gcode", 700)),
    "relief, gSender": (ROUTER, part_of(DATA / "gsender_kb35.nc", 700)),
    "serial stress, UGS": (ROUTER, part_of(DATA / "ugs_serial_stress.gcode")),
    "starved: moves of 0.3 mm at 3000 mm/min": (ROUTER, lambda: wave(0.3, 3000, 500)),
    "starved: moves of 0.1 mm at 3000 mm/min": (ROUTER, lambda: wave(0.1, 3000, 500)),
    "starved: one word a line": (FINE, lambda: short("X{0:.3f}", 500, 0.052)),
    "starved: one word a line, 40 steps/mm": (COARSE, lambda: short("X{0:.2f}", 500, 0.05)),
    "starved: two words a line": (FINE, lambda: short("X{0:.1f}Y{0:.1f}", 400, 0.1)),
    "starved: three words a line": (FINE, lambda: short("X{0:.3f}Y{0:.3f}Z{0:.3f}", 500, 0.052)),
    "starved: four words a line": (FINE, lambda: short("G1X{0:.4f}Y{0:.4f}F6000.00", 500, 0.052)),
    "starved: small circles": (FINE, rings),
    "starved: small circles, 40 steps/mm": (COARSE, rings),
}


def settings_of(machine: Machine) -> list[str]:
    """Return the GRBL settings of a machine."""
    settings = [f"$1={min(round(1000 * machine.motor_lock_s), 254) or 255}", f"$32={int(machine.head is Head.LASER)}"]
    settings += [f"$11={machine.corner_deviation:.3f}", f"$12={machine.arc_tolerance:.3f}"]
    for first, values in (
        (100, machine.steps_per_mm),
        (110, [60.0 * v for v in machine.rapid_velocity]),
        (120, machine.acceleration),
    ):
        settings += [f"${first + axis}={value:.3f}" for axis, value in enumerate(values)]
    return settings


def missing() -> str:
    """Return the missing requirements of the board as text, or an empty text."""
    if not (BOARD / "grblrun.c").exists() or not (BOARD / FIRMWARE).exists():
        return f"{BOARD}/grblrun.c and {FIRMWARE} (LEAFCUT_GRBL)"
    if shutil.which("cc") is None or not Path("/usr/include/simavr/sim_avr.h").exists():
        return "Debian's libsimavr-dev, libelf-dev, gcc and libc6-dev"
    return ""


def build_board(folder: Path) -> Path:
    """Compile the simulated board into a folder, and return the path of the executable.

    Raises
    ------
    AssertionError
        A requirement is missing, or the compiler refused the source.
    """
    assert not missing(), f"the simulated board needs {missing()}"
    program = folder / "grblrun"
    command = ["cc", "-O2", "-o", str(program), str(BOARD / "grblrun.c"), "-lsimavr", "-lelf", "-lutil"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def board_seconds(board: Path, lines: Sequence[str], machine: Machine) -> float:
    """Return the time from the first step to the last, s, by the clock of the board.

    Raises
    ------
    AssertionError
        The board refused a line or reported an alarm.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.nc"
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        command = [str(board), str(BOARD / FIRMWARE), str(file)]
        for setting in settings_of(machine):
            command += ["--set", setting]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    answer = json.loads(done.stdout)
    assert answer["ok"], answer
    return float(answer["motion_s"])


def our_seconds(lines: Sequence[str], machine: Machine) -> float:
    """Return leafcut's estimate, s, without the stops before the first move and after the last move."""
    path = interpret_program("\n".join(lines), load_dialect(machine.controller), units="mm").path
    sent = count_line_bytes_and_words(lines)
    whole = measure_toolpath(path, machine, start=(0.0, 0.0), lines=sent)
    timed = time_rows(path, machine, sent)
    moving = timed.path.kind <= Kind.ARC_CCW
    # At the start, only a move away from zero has a known length.
    away = np.abs(np.nan_to_num(timed.path.end)).max(axis=1) > 0.0
    moves = np.flatnonzero(moving & (away | (timed.seconds > 0.0)))
    outside = np.ones(len(timed.path), dtype=np.bool_)
    outside[moves[0] : moves[-1] + 1] = False
    return whole.time_s - float(timed.seconds[outside & ~moving].sum())


def recorded() -> dict[str, float]:
    """Return the recorded times of the board, s, by program."""
    seconds: dict[str, float] = tomllib.loads(RECORDED.read_text(encoding="utf-8"))["seconds"]
    return seconds


def main(argv: Sequence[str]) -> int:
    """Compare both times of each program, and publish the table."""
    parser = page.parser("grbl_time", __doc__)
    parser.add_argument("names", nargs="*", help="only programs with one of these texts in their name")
    parser.add_argument("--recorded", action="store_true", help="compare with the recorded times of the board")
    given = parser.parse_args(argv)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        board = None if given.recorded else build_board(Path(folder))
        for name, (machine, lines_of) in PROGRAMS.items():
            if given.names and not any(part in name for part in given.names):
                continue
            if board is None and name not in recorded():
                continue
            lines = lines_of()
            truth = recorded()[name] if board is None else board_seconds(board, lines, machine)
            ours = our_seconds(lines, machine)
            error = ours / truth - 1.0
            rows.append([name, f"{truth:.3f}", f"{ours:.3f}", f"{100 * error:+.2f}"])
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
            worst = WORST_STARVED if name.startswith(STARVED) else WORST
            assert abs(error) <= worst, f"{name}: {100 * error:.2f} % off"
    if not rows:
        parser.error("no program has such a name")
    text = f"""# Machine time compared with GRBL

The table compares the run time of GRBL 1.1h with leafcut's estimate for the same program and settings. GRBL is the
released firmware on a simulated ATmega328P; its time runs from the first motor step to the last, by its own clock. In
the programs named "{STARVED}", the board only waits for the next line.

{page.facts("grbl_time", argv, ["leafcut", "numpy", "numba"])}

{page.table(["program", "GRBL, s", "leafcut, s", "error, %"], rows)}"""
    page.publish("grbl_time", text, given.write)
    return 0
