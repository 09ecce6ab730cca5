"""A golden program of a pocket: two levels with a ramp, arcs and a finished wall, as text and read back.

After a change that is meant: LEAFCUT_WRITE_GOLDEN=1 pytest with this file, and look at the diff.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketLevels, PocketPath, PocketPiece, PocketRules
from leafcut.model.toolpath import Toolpath
from leafcut.options import JobOptions, MillingOptions, PostOptions
from leafcut.post.writer import write_program
from leafcut.processes.milling.mill import milling_data
from leafcut.processes.pocket.plan.arcs import fit_arcs_to_path
from leafcut.processes.pocket.plan.region import centre_regions
from leafcut.processes.pocket.plan.toolpath import Clearing, PocketHeights, pocket_motion
from leafcut.processes.pocket.plan.walls import wall_passes
from leafcut.processes.pocket.proof.pocket import check_pockets
from leafcut.proof.program import check_program, interpret_written_program
from leafcut.read.machine import load_machine
from rs274_moves import run_rs274

GOLDEN = Path(__file__).parents[2] / "golden"
RULES = PocketRules(tool_diameter=10.0, step_over=6.0, stock=0.5)
POCKET = Pocket(Polyline.circle(30, 30, 21))
CASES = [("linuxcnc", "mm"), ("linuxcnc", "inch"), ("haas", "mm"), ("fagor8055", "mm"), ("grbl", "mm")]
MACHINE = load_machine("linuxcnc-mill")


def path() -> Toolpath:
    """Rings of a round pocket by hand, the outer one half a millimetre away from the finished wall."""
    exact = PocketRules(tool_diameter=10.0, step_over=6.0)
    region, rough = centre_regions(POCKET, exact)[0][0], centre_regions(POCKET, RULES)[0][0]
    points = [(30.0, 30.0)]
    for radius in (4.0, 9.75, 15.48):
        angles = np.linspace(0.0, 2.0 * np.pi, 181)
        points += list(zip(30.0 + radius * np.cos(angles), 30.0 + radius * np.sin(angles), strict=True))
    rings = PocketPath("rings", (PocketPiece(Polyline.of_points(points)),))
    walls = fit_arcs_to_path(wall_passes(region, rough.polygon), 0.01)
    clearing = Clearing(region, rough.polygon, fit_arcs_to_path(rings, 0.01), PocketLevels(0.0, (-2.0, -4.0)), walls)
    job = JobOptions(spindle_speed=3000.0, feed=800 / 60)
    data = milling_data(MillingOptions(), job, RULES.tool_diameter, MACHINE)[0]
    return pocket_motion([clearing], PocketHeights(10.0, 2.0), data, MACHINE)[0]


def program(name: str, units: str) -> str:
    return write_program(path(), load_dialect(name), PostOptions(output_units=units), ["pocket"])


@pytest.mark.parametrize("name, units", CASES)
def test_a_pocket_is_the_golden_program(name: str, units: str) -> None:
    file = GOLDEN / f"pocket_{name}_{units}{load_dialect(name).extension}"
    text = program(name, units)
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        file.write_bytes(text.encode("ascii"))
    assert file.read_bytes() == text.encode("ascii")


@pytest.mark.parametrize("name, units", CASES)
def test_a_golden_pocket_reads_back_and_hurts_no_wall(name: str, units: str) -> None:
    words = load_dialect(name)
    written = interpret_written_program(program(name, units), words)
    assert check_program(path(), written, words, MACHINE, units, milled=True) == []
    assert check_pockets(written, [POCKET], RULES, [4.0], 2.0) == []


def test_a_round_pocket_is_written_in_arcs() -> None:
    assert len(program("linuxcnc", "mm").splitlines()) < 60


@pytest.mark.parametrize(("name", "units"), [case for case in CASES if case[0] in ("linuxcnc", "grbl")])
def test_linuxcnc_accepts_a_golden_pocket(rs274: str, tmp_path: Path, name: str, units: str) -> None:
    status, said = run_rs274(rs274, program(name, units), tmp_path)
    assert status == 0, said[-500:]
