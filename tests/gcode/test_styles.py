"""Programs in the styles of ten CAM systems are read, and make the same moves as in LinuxCNC's interpreter."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.program_rows import detect_process
from leafcut.processes.program.reading import read_foreign
from leafcut.processes.settings import collect_settings
from leafcut.read.machine import load_machine
from rs274_moves import PRINTED, assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274

FILES = sorted(p for p in (Path(__file__).parents[1] / "styles").iterdir() if p.suffix != ".md")
#: Start of the file name → machine that runs it. The first match wins.
MACHINES = {
    "fusion_haas": "haas-vf2", "mastercam": "haas-vf2", "fusion_grbl": "grbl-3018", "freecad_grbl": "grbl-3018",
    "estlcam": "grbl-3018", "vcarve_grbl": "grbl-3018", "vcarve": "mach3-router", "sheetcam_mach3": "mach3-router",
    "sheetcam_qtplasmac": "plasma-table", "lightburn": "grbl-3018", "inkscape_laser": "grbl-3018",
}  # fmt: skip


def machine_of(name: str) -> str:
    """Return the machine of a file."""
    return next((machine for begin, machine in MACHINES.items() if name.startswith(begin)), "linuxcnc-mill")


def read(path: Path) -> Program:
    """Interpret a file as its controller would."""
    machine = load_machine(machine_of(path.name))
    words = load_dialect(machine.controller)
    return read_foreign(path.read_text(encoding="utf-8"), path.name, collect_settings({}), machine, words).program


def test_there_are_four_of_each_style_at_least() -> None:
    """Ten styles, forty programs."""
    styles = [path.name.partition("_")[0] for path in FILES]
    assert len(set(styles)) == 10 and all(styles.count(style) >= 4 for style in styles)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_no_program_of_a_cam_is_refused(path: Path) -> None:
    program = read(path)
    assert (program.path.kind <= Kind.DRILL).sum() > 20
    foreign = program.path.line[program.path.kind == Kind.FOREIGN]
    known = re.compile(r"G31|M190|M66|M52|MSG|G53 G90", re.IGNORECASE)
    assert all(known.search(program.lines[line - 1]) for line in foreign.tolist())
    laser, plasma = path.name.startswith(("lightburn", "inkscape_laser")), path.name.startswith("sheetcam_qt")
    assert not laser or detect_process(program) == "laser"
    assert not plasma or detect_process(program) == "plasma"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_programs_of_cams_do_what_linuxcnc_makes_of_them(rs274: str, tmp_path: Path, path: Path) -> None:
    """Move by move, of every program that it takes, but for its program number."""
    program = read(path)
    text = re.sub(r"(?m)^O[0-9]+", "", "".join(program.lines))
    status, output = run_rs274(rs274, text, tmp_path)
    shifted = np.isin(program.path.kind, [Kind.MACHINE, Kind.SHIFT, Kind.FOREIGN]).any()
    if status == 0 and not shifted:
        printed = PRINTED["inch" if "CANON_UNITS_INCHES" in output else "mm"]
        assert_same_moves(moves_of_toolpath(program.path), moves_of_rs274(output), printed)
