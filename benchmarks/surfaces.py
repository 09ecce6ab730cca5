"""Plates that are not flat: seconds with ways as low as is safe, with one safe height for all, and how clear they are.

    python benchmarks/surfaces.py --write docs/benchmarks.md

The stepped plate of the examples, as STEP and as STL, and plates with bosses made here. Every rapid that is not
straight up is walked, in steps of 0.5 mm, by the rim of the tool's tip: how near it comes to the triangles is found by
the exact distance of a point from a triangle, which planner and proof do not use. Less than 0.5 mm ends the benchmark.
"""

from __future__ import annotations

import argparse
import math
import struct
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from page import facts, table, write_section

from leafcut import api
from leafcut.model.cycles import expand
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.read.meshes import load_mesh

EXAMPLES = Path(__file__).parent.parent / "examples"
#: Holes of the made plates, their diameter and spacing, mm.
HOLES, DIAMETER, PITCH = (200, 900), 4.0, 10.0
#: What stands near to a move is looked at so far around it, mm; a walk has such steps, and so many places of the rim.
NEAR, STEP, RIM = 6.0, 0.5, 8
#: A way that is nearer is not clear, mm.
CLEAR = 0.5


class Plate(NamedTuple):
    """A plate: what is drilled, and the options that say its surface."""

    name: str
    holes: Path
    mesh: Path
    options: dict[str, Any]


def box(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> NDArray[np.float64]:
    """Return the twelve triangles of a box."""
    c = np.array([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)], dtype=np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array(c[[(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)]])


def plate_of(holes: int, folder: Path) -> Plate:
    """Make a plate in three steps with a boss for every dozen of holes, none of which is under one."""
    columns = math.ceil(math.sqrt(holes * 1.6))
    rows = math.ceil(holes / columns * 1.25)
    wide, high = columns * PITCH, rows * PITCH
    third = math.ceil(columns / 3) * PITCH
    steps = [(k * third, 0, -20, min((k + 1) * third, wide), high, -6.0 * k) for k in range(3)]
    random = np.random.default_rng(holes)
    places = [(x, y) for x in range(columns) for y in range(rows)]
    chosen = random.permutation(len(places))
    bosses = [places[k] for k in chosen[: max(holes // 12, 1)]]
    free = [places[k] for k in chosen[len(bosses) : len(bosses) + holes]]
    parts = [box(*step) for step in steps]
    for x, y in bosses:
        centre, ground = ((x + 0.5) * PITCH, (y + 0.5) * PITCH), -6.0 * ((x * PITCH) // third)
        tall = float(random.uniform(8.0, 30.0))
        parts.append(
            box(centre[0] - 2.5, centre[1] - 2.5, ground - 1.0, centre[0] + 2.5, centre[1] + 2.5, ground + tall)
        )
    triangles = np.concatenate(parts)
    mesh, drawing = folder / f"plate_{holes}.stl", folder / f"plate_{holes}.csv"
    rows_of = [struct.pack("<12fH", 0.0, 0.0, 0.0, *triangle.ravel().tolist(), 0) for triangle in triangles]
    mesh.write_bytes(b"made".ljust(80) + struct.pack("<I", len(rows_of)) + b"".join(rows_of))
    lines = [f"{(x + 0.5) * PITCH:g},{(y + 0.5) * PITCH:g},{DIAMETER:g}" for x, y in free]
    drawing.write_text("x,y,diameter\n" + "\n".join(lines) + "\n")
    name = f"{len(bosses)} bosses on three steps"
    return Plate(name, drawing, mesh, {"surface": str(mesh), "through": True})


def examples() -> list[Plate]:
    """Return the stepped plate of the examples."""
    step, stl = EXAMPLES / "stepped_plate.step", EXAMPLES / "stepped_plate.stl"
    with_stl = {"surface": str(stl), "hole_heights": "drawn"}
    return [Plate("stepped plate, STEP", step, step, {}), Plate("stepped plate, STEP and STL", step, stl, with_stl)]


def distance(points: NDArray[np.float64], triangles: NDArray[np.float64]) -> float:
    """Return the least distance of points, float64[n, 3], from triangles, float64[m, 3, 3], mm; ∞ without any.

    The nearest place of a triangle is its foot, where that lies inside, else on one of its edges (Ericson, Real-Time
    Collision Detection, 2005, section 5.1.5).
    """
    if not len(triangles) or not len(points):
        return math.inf
    p = points[:, None, :]
    least = np.full((len(points), len(triangles)), np.inf)
    for k in range(3):
        a, b = triangles[:, k], triangles[:, (k + 1) % 3]
        way = b - a
        long = np.maximum((way * way).sum(axis=1), 1e-30)
        share = np.clip(((p - a) * way).sum(axis=2) / long, 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(a + share[..., None] * way - p, axis=2))
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(normal, axis=1)
    whole = size > 1e-12
    normal[whole] /= size[whole, None]
    foot = ((p - triangles[:, 0]) * normal).sum(axis=2)
    on = p - foot[..., None] * normal
    inside = np.tile(whole, (len(points), 1))
    for k in range(3):
        a, b = triangles[:, k], triangles[:, (k + 1) % 3]
        inside &= (np.cross(b - a, on - a) * normal).sum(axis=2) >= 0.0
    return float(np.where(inside, np.abs(foot), least).min())


def least_distance(path: Toolpath, triangles: NDArray[np.float64], radius: float) -> float:
    """Return how near the rim of the tip comes to a surface in any rapid that is not straight up, mm."""
    moves = expand(path)
    before, end = moves.before, moves.end
    known = (moves.kind == Kind.RAPID) & np.isfinite(before).all(axis=1) & np.isfinite(end).all(axis=1)
    rises = (before[:, :2] == end[:, :2]).all(axis=1) & (end[:, 2] >= before[:, 2])
    angle = np.linspace(0.0, math.tau, RIM, endpoint=False)
    rim = np.concatenate([[[0.0, 0.0, 0.0]], np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) * radius])
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    nearest = math.inf
    for row in np.flatnonzero(known & ~rises).tolist():
        a, b = before[row], end[row]
        near = (low < np.maximum(a, b) + radius + NEAR).all(axis=1) & (high > np.minimum(a, b) - radius - NEAR).all(
            axis=1
        )
        shares = np.linspace(0.0, 1.0, max(math.ceil(float(np.linalg.norm(b - a)) / STEP), 1) + 1)
        walked = (a + shares[:, None] * (b - a))[:, None, :] + rim
        nearest = min(nearest, distance(walked.reshape(-1, 3), triangles[near]))
    return nearest


def row_of(plate: Plate, machine: str, preset: str) -> list[str]:
    """Return a line of the table.

    Raises
    ------
    AssertionError
        A way is not clear, or low ways take longer.
    """
    common: dict[str, Any] = {"process": "drill", "machine": machine, "preset": preset, "seed": 1, **plate.options}
    low = api.optimize(plate.holes, **common)
    high = api.optimize(plate.holes, retract="initial", **common)
    clear = least_distance(low.written, load_mesh(plate.mesh).triangles, 0.5 * low.operations[0].tool.diameter)
    assert clear >= CLEAR, f"{plate.name}: {clear:.3f} mm from the surface"
    assert low.after.time_s < high.after.time_s, plate.name
    (operation,) = low.operations
    gap = operation.solution.gap
    saved = 100.0 * (1.0 - low.after.time_s / high.after.time_s)
    return [
        plate.name, f"{len(low.part.holes)}", f"{high.after.time_s:.1f}", f"{low.after.time_s:.1f}", f"{saved:.1f}",
        "–" if gap is None else f"{100.0 * gap:.2f}", f"{clear:.2f}",
    ]  # fmt: skip


def main() -> None:
    """Drill all plates and print the table; write it into the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--holes", type=int, nargs="*", default=list(HOLES), help="holes of the plates made here")
    parser.add_argument("--no-examples", action="store_true", help="leave out the stepped plate (no OpenCASCADE)")
    parser.add_argument("--machine", default="linuxcnc-mill")
    parser.add_argument("--preset", default="default")
    parser.add_argument("--write", type=Path, help="page whose section is to be renewed")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        made = [plate_of(holes, Path(folder)) for holes in arguments.holes]
        for plate in [*([] if arguments.no_examples else examples()), *made]:
            rows.append(row_of(plate, arguments.machine, arguments.preset))
            print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""## Plates that are not flat

Machine seconds of whole drilling programs on {arguments.machine}: with all ways over the highest place
(`--retract initial`, in an order sought for that), and with each way as low as is safe. The gap is that of the search's
own costs, rises and descents included, to their lower bound. Clear: how near the rim of the drill's tip comes to the
triangles in any rapid that is not straight up, by the exact distance of points every {STEP:g} mm.

{facts("surfaces", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["shape", "holes", "one height, s", "low ways, s", "saved, %", "gap, %", "clear, mm"], rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "surfaces", text)


if __name__ == "__main__":
    main()
