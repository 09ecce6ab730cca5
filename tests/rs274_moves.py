"""LinuxCNC's interpreter as a judge: the moves that `rs274 -g` makes of a text, and ours in the same form, in mm.

Every move is a tuple: ("rapid", x, y, z), ("feed", x, y, z, mm/min), ("arc", plane, x, y, z, u, v, turns) with the
centre in the plane and the sign of the turns for the direction, ("dwell", s), ("tool", n). Moves of no length are left
out: the two interpreters differ in them and no machine does.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
from pathlib import Path

from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind, Toolpath, plane_axes

_CALL = re.compile(r"^\s*\d+ \S+\s+([A-Z_0-9]+)\((.*)\)\s*$")
_PLANES = {"CANON_PLANE_XY": 17, "CANON_PLANE_XZ": 18, "CANON_PLANE_YZ": 19}
#: Moves that rs274 of LinuxCNC 2.9 made of the programs of the tests: name → moves. `test_*_rs274.py` compare them with
#: rs274 where it is installed.
RECORDED: dict[str, list[list]] = json.loads(
    (Path(__file__).parent / "gcode" / "rs274_moves.json").read_text(encoding="utf-8")
)
# Printed resolution: four decimals of an inch are 0.0025 mm.
PRINTED = {"mm": 1e-4, "inch": 2.54e-3}


def run_rs274(program: str, text: str, folder: Path) -> tuple[int, str]:
    """Return the exit status and output of rs274; the tool table has the tools 1 to 99 with length 0."""
    table, file = folder / "tool.tbl", folder / "part.ngc"
    table.write_text("".join(f"T{n} P{n} D3.0 Z0 ;tool\n" for n in range(1, 100)), encoding="ascii")
    file.write_text(text, encoding="utf-8")
    # QtPlasmaC has three: the torch, a scribe and a spotting torch.
    spindles = folder / "spindles.ini"
    spindles.write_text("[TRAJ]\nSPINDLES=3\n", encoding="ascii")
    command = [program, "-g", "-i", str(spindles), "-t", str(table), str(file)]
    # rs274 keeps a memory map in its home and truncates it at the start: two at once in one home kill each other.
    home = dict(os.environ, HOME=str(folder))
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=folder, env=home, check=False)
    return done.returncode, done.stdout + done.stderr


def moves_of_rs274(output: str) -> list[tuple]:
    """Return the moves that rs274 printed."""
    unit, plane, feed, place = 1.0, 17, 0.0, (0.0, 0.0, 0.0)
    moves: list[tuple] = []
    for line in output.splitlines():
        match = _CALL.match(line)
        if not match:
            continue
        name, arguments = match.group(1), match.group(2).split(",")
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in arguments[0] else 1.0
        elif name == "SELECT_PLANE":
            plane = _PLANES[arguments[0]]
        elif name == "SET_FEED_RATE":
            feed = float(arguments[0]) * unit
        elif name == "DWELL" and float(arguments[0]) > 0:
            moves.append(("dwell", float(arguments[0])))
        elif name == "CHANGE_TOOL":
            moves.append(("tool", int(arguments[0])))
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            end = tuple(float(a) * unit for a in arguments[:3])
            if end != place:
                moves.append(("rapid", *end) if name == "STRAIGHT_TRAVERSE" else ("feed", *end, feed))
            place = end
        elif name == "ARC_FEED":
            numbers = [float(a) * unit for a in arguments]
            first, second, normal = plane_axes(plane)
            point = [0.0, 0.0, 0.0]
            point[first], point[second], point[normal] = numbers[0], numbers[1], numbers[5]
            place = (point[0], point[1], point[2])
            moves.append(("arc", plane, *place, numbers[2], numbers[3], int(float(arguments[4]))))
    return moves


def moves_of_toolpath(path: Toolpath) -> list[tuple]:
    """Return our moves; program zero is machine zero and the tool starts there, as in rs274."""
    place, moves = [0.0, 0.0, 0.0], []
    for row in expand_cycles(path):
        if row.kind is Kind.DWELL and row.value > 0:
            moves.append(("dwell", row.value))
        elif row.kind is Kind.TOOL:
            moves.append(("tool", row.ref))
        if row.kind not in (Kind.RAPID, Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.MACHINE):
            continue
        before = list(place)
        place = [p if math.isnan(e) else e for p, e in zip(place, row.end, strict=True)]
        if row.kind in (Kind.ARC_CW, Kind.ARC_CCW):
            arc = path.arcs[row.ref]
            first, second, _ = plane_axes(arc.plane)
            turns = arc.turns if row.kind is Kind.ARC_CCW else -arc.turns
            moves.append(("arc", arc.plane, *place, arc.center[first], arc.center[second], turns))
        elif max(abs(a - b) for a, b in zip(before, place, strict=True)) > 6e-5:
            moves.append(("feed", *place, row.value * 60.0) if row.kind is Kind.FEED else ("rapid", *place))
    return moves


def assert_same_moves(ours: list[tuple], theirs: list[tuple], tolerance: float) -> None:
    """Compare move by move; the feed may differ by as much as four printed decimals of it allow."""
    for number, (one, other) in enumerate(zip(ours, theirs, strict=False)):
        assert one[0] == other[0] and len(one) == len(other), f"move {number}: {one} and {other}"
        close = [
            math.isclose(a, b, abs_tol=tolerance, rel_tol=0.0 if k < 3 else 1e-4)
            for k, (a, b) in enumerate(zip(one[1:], other[1:], strict=True))
        ]
        assert all(close), f"move {number}: {one} and {other}"
    assert len(ours) == len(theirs), (len(ours), len(theirs), ours[len(theirs) :][:1], theirs[len(ours) :][:1])
