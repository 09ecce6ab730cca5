"""leafcut part, FreeCAD and viaConstructor on eight drawings: machine time, lengths, tabs and remaining material.

    python -m benchmarks part_peers bracket nameplate --viaconstructor venv/bin/python

All programs get the same drawing, tools, feeds, speeds, step-down and safe height, and tabs of the same size. FreeCAD
(`freecadcmd`) and viaConstructor (the Python of its environment) generate their own programs. FreeCAD plunges by
default; its ramps have the entry angle of leafcut. viaConstructor plunges by default or descends in a helix.

leafcut computes the machine time of all programs on the same machine, and cuts the same stock with each of them. The
check of the stock uses shapely and the drawing, and shares no code with the planner.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import shapely

import leafcut
from benchmarks import ROOT, data_folder, page
from benchmarks.pace import accepted
from leafcut.model.contour import Contour
from leafcut.model.toolpath import Kind
from leafcut.options import SheetOptions
from leafcut.processes.contours import prepare_sheet
from leafcut.read import read_contours

HEAD = [
    "drawing", "program", "time, s", "cut, m", "rapid, m", "retracts", "tools", "tabs", "not cut, mm", "into part, mm²",
    "note",
]  # fmt: skip
MACHINE = "linuxcnc-mill"
#: Lengths of the job, mm, and angle of ramps, degrees.
DIAMETER, DRILL, STEP, SAFE, BREAK_THROUGH, TAB_WIDTH, TAB_HEIGHT, RAMP = 3.0, 5.0, 1.5, 2.0, 0.5, 6.0, 1.5, 3.0
POCKET, ENGRAVING = 3.0, 0.3
#: Tools: feeds in mm/min, speeds in rpm.
MILL = {"diameter": DIAMETER, "speed": 6000, "feed": 600, "plunge": 200}
DRILLS = {"diameter": DRILL, "speed": 3000, "feed": 300, "plunge": 300}
#: Tip length of a 118° drill, mm.
TIP = round(0.5 * DRILL / np.tan(np.radians(59.0)), 3)
#: Cell of the stock, and tolerance of heights and edges, mm.
CELL, HEIGHT, EDGE = 0.15, 0.05, 0.2
#: A place that is not cut through is a tab if its length is between these, mm.
TABS = (0.5 * TAB_WIDTH, 3.0 * TAB_WIDTH)
LIBRARY = f"""
[[tool]]
number = 1
kind = "end-mill"
diameter = "{DIAMETER} mm"
spindle_speed = "{MILL["speed"]} rpm"
feed = "{MILL["feed"]} mm/min"
plunge_feed = "{MILL["plunge"]} mm/min"
[[tool]]
number = 2
diameter = "{DRILL} mm"
spindle_speed = "{DRILLS["speed"]} rpm"
feed = "{DRILLS["feed"]} mm/min"
"""
#: Thickness of each drawing, mm.
DRAWINGS = {
    "bracket": 4.0, "nameplate": 6.0, "deepnestport_1": 4.0, "deepnestport_3": 4.0, "deepnestport_6": 4.0,
    "deepnestport_10": 4.0, "deepnestport_11": 4.0, "dxfjs_closedlwpolylinebug": 4.0,
}  # fmt: skip


#: Text of the results page.
WORDS = f"""All programs mill the same drawings with the same tools: an end mill of {DIAMETER:g} mm
({MILL["feed"]} mm/min, plunge {MILL["plunge"]} mm/min, {MILL["speed"]} rpm), and a drill for holes of {DRILL:g} mm.
The step-down is {STEP:g} mm, the safe height is {SAFE:g} mm, and the mill goes {BREAK_THROUGH:g} mm below the plate.
Each outline has four tabs of {TAB_WIDTH:g} × {TAB_HEIGHT:g} mm.
leafcut computes all times on the machine `{MACHINE}`, including tool changes. It also cuts the same stock with each
program (cells of {CELL:g} mm). The column *tabs* counts the places along all edges that are not cut through and are as
long as a tab. *Not cut* is the remaining length of edges, lines and pockets that the mill can reach but did not cut.
*Into part* is the area of the part that a cut enters. Places that are too narrow for the mill do not count.
A note states if LinuxCNC's interpreter (rs274) refuses a program.

**Peers that plunge are faster.** By default, FreeCAD and viaConstructor plunge straight into the plate at each level.
leafcut never plunges a mill into the plate. It ramps down at {RAMP:g}°, and after each tab it does so back and forth.
These ramps make its paths longer, most of all on small parts with four tabs. To compare entries without plunges, see
*FreeCAD, ramps* (the same angle) and *viaConstructor, helix* (one turn per level). Even with its helix, viaConstructor
goes straight down at the full feed rate behind each tab.

* FreeCAD: a profile for the openings, a profile with holding tags for the outline, and operations for drilling, pockets
  (offset pattern, 50 % step-over, minimal travel) and engraving. FreeCAD sorts the paths within each operation; the
  script sets the order of the operations. Ramps and tabs could not be combined: with ramps on the tabs, the path was
  empty, and with tabs on the ramps, there were no tabs. Therefore, the parts come loose in the programs with ramps.
* viaConstructor: nearest object first, inner objects before outer objects. It does not choose places for tabs, so the
  drawing contains lines across leafcut's tabs. It cannot drill, so it mills the holes and needs no tool change. Its
  command line has no settings for layers, so a short script sets them. In a pocket, it moves to the next ring with a
  rapid at the new depth.
* leafcut: the default options.
"""


@dataclass(frozen=True)
class Work:
    """A drawing: its joined contours by kind of work, and the thickness of the plate, mm."""

    name: str
    thickness: float
    layers: dict[str, list[Contour]]

    @property
    def bottom(self) -> float:
        """Lowest height of the mill, mm."""
        return -self.thickness - BREAK_THROUGH

    def area(self, layer: str) -> Any:
        """Return the area between the closed paths of a layer, by the even-odd rule."""
        area: Any = shapely.Polygon()
        for contour in self.layers[layer]:
            if contour.path.closed:
                area = area.symmetric_difference(shapely.Polygon(contour.path.flattened(0.002)))
        return area


def read_work(name: str) -> Work:
    """Read a drawing, join its lines, and sort its contours by layer and shape. Texts are left out."""
    file = next(
        path for path in (ROOT / "examples", data_folder() / "dxf") for path in [path / f"{name}.dxf"] if path.is_file()
    )
    contours = [
        one for one in prepare_sheet(read_contours(file), SheetOptions(open_paths="cut")).contours if one.kind == "cut"
    ]
    layers: dict[str, list[Contour]] = {"PROFILE": [], "BORE": [], "POCKET": [], "ENGRAVE": []}
    for contour in contours:
        layer = {"POCKET_3": "POCKET", "TEXT": "ENGRAVE", "HOLES": "BORE"}.get(contour.layer, "PROFILE")
        drilled = layer == "PROFILE" and _is_circle(contour) and abs(contour.path.length / np.pi - DRILL) < 0.01
        layers["BORE" if drilled else layer].append(contour)
    return Work(name, DRAWINGS[name], layers)


def _is_circle(contour: Contour) -> bool:
    shape = shapely.Polygon(contour.path.flattened(0.002))
    return bool(4.0 * np.pi * shape.area > 0.999 * shape.length**2)


def write_dxf(file: Path, layers: dict[str, list[Contour]], tabs: Sequence[Any] = ()) -> str:
    """Write closed polylines and circles, and short lines across the tabs, which viaConstructor expects."""
    document = ezdxf.new(units=4)
    model = document.modelspace()
    for layer, contours in layers.items():
        for contour in contours:
            path = contour.path
            if path.closed and _is_circle(contour):
                x, y = shapely.Polygon(path.flattened(0.002)).centroid.coords[0]
                model.add_circle((x, y), path.length / (2.0 * np.pi), {"layer": layer})
            else:
                points = path.vertices.tolist()
                model.add_lwpolyline(points, "xyb", close=path.closed, dxfattribs={"layer": layer})
    for line in tabs:
        model.add_line(*line.coords, {"layer": "_TABS"})
    document.saveas(file)
    return str(file)


def leafcut_program(work: Work, folder: Path) -> tuple[str, str]:
    """Return leafcut's program, and a note about missing work."""
    (folder / "tools.toml").write_text(LIBRARY)
    used = {name: contours for name, contours in work.layers.items() if contours}
    operations = {
        "PROFILE": "profile",
        "BORE": "bore",
        "POCKET": f"pocket {POCKET}mm",
        "ENGRAVE": f"engrave {ENGRAVING}mm",
    }
    (folder / "operations.toml").write_text(
        "[layer]\n" + "".join(f'"{name}" = "{operations[name]}"\n' for name in used)
    )
    outcome = leafcut.part(
        write_dxf(folder / "leafcut.dxf", used), thickness=work.thickness, tools=folder / "tools.toml", tool_number=1,
        operations=folder / "operations.toml", machine=MACHINE, step_down=STEP, retract_height=SAFE,
        clearance_height=SAFE, break_through=BREAK_THROUGH, tab_width=TAB_WIDTH, tab_height=TAB_HEIGHT,
        entry_angle=RAMP,
    )  # fmt: skip
    return outcome.text, "; ".join(str(issue.message) for issue in outcome.issues if issue.missing)


def freecad_program(work: Work, folder: Path, ramp: float) -> tuple[str, str]:
    """Return FreeCAD's program, or an empty text and the reason."""
    files = {
        layer: write_dxf(folder / f"{layer}.dxf", {layer: contours}) if contours else ""
        for layer, contours in work.layers.items()
    }
    drilled = [shapely.Polygon(one.path.flattened(0.002)).centroid.coords[0] for one in work.layers["BORE"]]
    job = {
        "profile": files["PROFILE"], "pocket": files["POCKET"], "engrave": files["ENGRAVE"], "drilled": drilled,
        "mill": MILL, "drill": DRILLS, "thickness": work.thickness, "bottom": work.bottom, "tip": work.bottom - TIP,
        "pocket_depth": POCKET, "engrave_depth": ENGRAVING, "step": STEP, "safe_height": SAFE, "tab_width": TAB_WIDTH,
        "tab_height": TAB_HEIGHT + BREAK_THROUGH, "ramp_angle": ramp, "out": str(folder / "freecad.ngc"),
    }  # fmt: skip
    (folder / "job.json").write_text(json.dumps(job))
    return _run([_freecad(), str(ROOT / "benchmarks" / "part_freecad.py")], folder, "freecad.ngc")


def viaconstructor_program(
    work: Work, folder: Path, python: str, tabs: Sequence[Any], *, helix: bool
) -> tuple[str, str]:
    """Return viaConstructor's program, or an empty text and the reason."""
    mill = {
        "depth": work.bottom,
        "step": -STEP,
        "fast_move_z": SAFE,
        "back_home": False,
        "helix_mode": helix,
        "G64": 0.0,
    }
    tool = {"number": 1, "speed": MILL["speed"], "rate_h": MILL["feed"], "rate_v": MILL["plunge"], "pause": 0}
    tool["tooltable"] = [
        {"name": "mill", "number": 1, "diameter": DIAMETER, "lenght": 10.0, "blades": 2}
    ]  # its spelling
    setup = {
        "mill": mill, "tool": tool, "workpiece": {"zero": "original"},
        "tabs": {"active": True, "width": TAB_WIDTH + DIAMETER, "height": TAB_HEIGHT + BREAK_THROUGH},
    }  # fmt: skip
    untabbed = {"tabs": {"active": False}}
    layers = {
        "BORE": untabbed,
        "POCKET": untabbed | {"mill": {"depth": -POCKET, "helix_mode": False}, "pockets": {"active": True}},
        "ENGRAVE": untabbed | {"mill": {"depth": -ENGRAVING, "offset": "none", "helix_mode": False}},
    }
    (folder / "setup.json").write_text(json.dumps(setup))
    (folder / "layers.json").write_text(json.dumps(layers))
    drawing = write_dxf(folder / "via.dxf", work.layers, tabs)
    script = str(ROOT / "benchmarks" / "part_viaconstructor.py")
    return _run([python, script, "layers.json", "-s", "setup.json", "-o", "via.ngc", drawing], folder, "via.ngc")


def _run(command: Sequence[str], folder: Path, program: str) -> tuple[str, str]:
    file = folder / program
    file.unlink(missing_ok=True)
    environment = {**os.environ, "JOB": str(folder / "job.json"), "HOME": str(folder), "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if file.is_file():
        return file.read_text(encoding="utf-8"), ""
    return "", (done.stderr.strip() or done.stdout.strip() or "no program").splitlines()[-1]


def _freecad() -> str:
    return shutil.which("freecadcmd") or ""


def remaining(field: Any, work: Work) -> tuple[list[Any], float, float]:
    """Compare the stock after a program with the drawing.

    Returns
    -------
    tabs
        The places on the tool paths that are not cut through and are as long as a tab, as lines.
    left
        Length of tool path that is neither cut through nor a tab, and of engraved line that is not cut, mm. A pocket
        adds the area that the mill can reach but did not clear, divided by its diameter.
    into
        Area of the part, or of the walls of pockets, that a cut enters, mm².
    """
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + field.cell * np.arange(columns), field.y + field.cell * np.arange(rows))
    part = work.area("PROFILE")
    for hole in work.layers["BORE"]:
        part = part.difference(shapely.Polygon(hole.path.flattened(0.002)))
    pocket = work.area("POCKET")
    lines = [shapely.LineString(one.path.flattened(0.002)) for one in work.layers["ENGRAVE"]]
    closed = [one.path.closed for one in work.layers["ENGRAVE"]]
    lines = [shapely.LinearRing(line.coords) if ring else line for line, ring in zip(lines, closed, strict=True)]
    engraved = shapely.union_all(lines).buffer(0.5 * DIAMETER)
    kept = part.difference(pocket).difference(engraved).buffer(-EDGE)
    shapely.prepare(kept)
    into = float((shapely.contains_xy(kept, x, y) & (field.heights < -HEIGHT)).sum()) * field.cell**2
    floor = pocket.buffer(-0.5 * DIAMETER).buffer(0.5 * DIAMETER).buffer(-EDGE)
    shapely.prepare(floor)
    on_floor = shapely.contains_xy(floor, x, y)
    into += float((on_floor & (field.heights < -POCKET - HEIGHT)).sum()) * field.cell**2
    left = float((on_floor & (field.heights > -POCKET + HEIGHT)).sum()) * field.cell**2 / DIAMETER

    def is_high(ring: Any, height: float) -> tuple[Any, Any, float]:
        count = max(int(ring.length / field.cell), 8)
        points = shapely.get_coordinates(
            shapely.line_interpolate_point(ring, np.arange(count) / count, normalized=True)
        )
        column = np.clip(np.round((points[:, 0] - field.x) / field.cell).astype(int), 0, columns - 1)
        row = np.clip(np.round((points[:, 1] - field.y) / field.cell).astype(int), 0, rows - 1)
        return field.heights[row, column] > height + HEIGHT, points, ring.length / count

    tabs = []
    for piece in shapely.get_parts(part.buffer(0.5 * DIAMETER, quad_segs=64)):
        for ring in (piece.exterior, *piece.interiors):
            high, points, step = is_high(ring, -work.thickness)
            if high.all():
                left += ring.length
                continue
            turned = np.roll(np.arange(len(high)), -int(np.argmin(high)))
            runs = np.split(turned, np.flatnonzero(np.diff(high[turned].astype(int))) + 1)
            for run in runs:
                if high[run[0]]:
                    length = len(run) * step
                    if TABS[0] <= length <= TABS[1]:
                        tabs.append(_across(points, run, part))
                    elif length > 2.0 * EDGE:
                        left += length
    for line in lines:
        high, _, step = is_high(line, -ENGRAVING)
        left += float(high.sum()) * step if high.mean() > 0.02 else 0.0
    return tabs, left, into


def _across(points: Any, run: Any, part: Any) -> Any:
    """Return a line across the tool path in the middle of a tab."""
    middle = points[run[len(run) // 2]]
    wall = np.array(shapely.shortest_line(part, shapely.Point(middle)).coords[0])
    away = (middle - wall) / max(float(np.hypot(*(middle - wall))), 1e-9)
    return shapely.LineString([middle - away, middle + away])


def measured(work: Work, label: str, text: str, note: str, folder: Path) -> tuple[list[str], list[Any]]:
    """Return the row of a program, and its tabs."""
    if not text:
        return [work.name, label, *["–"] * 8, note], []
    file = folder / "measured.ngc"
    file.write_text(text, encoding="utf-8")
    (folder / "tools.toml").write_text(LIBRARY)
    run = leafcut.simulate(file, machine=MACHINE)
    part = work.area("PROFILE").bounds
    low, high = ",".join(f"{v - 8.0:.3f}" for v in part[:2]), ",".join(f"{v + 8.0:.3f}" for v in part[2:])
    block = f"{low},{work.bottom - TIP - 1.0},{high},0"
    stock = leafcut.stock(file, machine=MACHINE, tools=folder / "tools.toml", workpiece=block, cell=CELL)
    tabs, left, into = remaining(stock.field, work)
    path = run.path
    rises = (path.kind == Kind.RAPID) & (path.end[:, 2] > path.before[:, 2] + 1e-6)
    tools = len(run.measure.by_tool) or 1
    notes = [note, "" if accepted(text) else "rs274 refuses it"]
    notes.append(f"{len(stock.rapids)} rapids in material" if stock.rapids else "")
    row = [
        work.name, label, f"{run.measure.time_s:.0f}", f"{run.measure.cut_mm / 1000:.2f}",
        f"{run.measure.travel_mm / 1000:.2f}", str(int(rises.sum())), str(tools), str(len(tabs)), f"{left:.1f}",
        f"{into:.1f}", "; ".join(filter(None, notes)),
    ]  # fmt: skip
    return row, tabs


def main(argv: Sequence[str]) -> int:
    """Run all programs on all drawings and publish the table."""
    parser = page.parser("part_peers", __doc__)
    parser.add_argument("names", nargs="*", type=page.one_of(DRAWINGS), help="drawings (default: all)")
    parser.add_argument("--viaconstructor", default="", help="Python of an environment with viaConstructor")
    given = parser.parse_args(argv)
    if not _freecad():
        print("part_peers: freecadcmd is required: apt-get install freecad", file=sys.stderr)
        return 2
    # A virtual environment is found by the path of its link, so links must not be resolved.
    python = str(Path.cwd() / given.viaconstructor) if given.viaconstructor else ""
    if python and not (Path(python).is_file() and _viaconstructor_version(python)):
        print(f"part_peers: {given.viaconstructor} has no viaConstructor: pip install viaconstructor", file=sys.stderr)
        return 2
    rows: list[list[str]] = []
    for name in given.names or DRAWINGS:
        rows += rows_of(read_work(name), python)
    text = f"""# leafcut, FreeCAD and viaConstructor

{WORDS}
* Total time: {"; ".join(_totals(rows))}
{page.facts("part_peers", argv, ["leafcut", "numpy", "numba"])}
* Peers: {_freecad_version()}, viaConstructor {_viaconstructor_version(python) or "not installed"}

{page.table(HEAD, rows)}"""
    page.publish("part_peers", text, given.write)
    return 0


def rows_of(work: Work, python: str) -> list[list[str]]:
    """Return the rows of all programs for a drawing. `python` is viaConstructor's Python, or ""."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        row, tabs = measured(work, "leafcut", *leafcut_program(work, folder), folder)
        rows = [row]
        for label, ramp in (("FreeCAD", 0.0), ("FreeCAD, ramps", RAMP)):
            rows.append(measured(work, label, *freecad_program(work, folder, ramp), folder)[0])
        for label, helix in (("viaConstructor", False), ("viaConstructor, helix", True)):
            if python:
                program = viaconstructor_program(work, folder, python, tabs, helix=helix)
                rows.append(measured(work, label, *program, folder)[0])
    for row in rows:
        print("  ".join(row), file=sys.stderr, flush=True)
    return rows


def _totals(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the total time of each program, s. A drawing without a program counts as missing."""
    labels = list(dict.fromkeys(row[1] for row in rows))
    times = {label: [row[2] for row in rows if row[1] == label] for label in labels}
    return [
        f"{label} {sum(float(time) for time in own if time != '–'):.0f} s"
        + (f" ({own.count('–')} missing)" if "–" in own else "")
        for label, own in times.items()
    ]


def _freecad_version() -> str:
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "HOME": folder}
        # Its option --version crashes in 0.20, so this starts the console, which ends at once.
        done = subprocess.run(
            [_freecad()], env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
        )
    return next(
        (line.partition(",")[0] for line in (done.stdout + done.stderr).splitlines() if line.startswith("FreeCAD")),
        "FreeCAD",
    )


def _viaconstructor_version(python: str) -> str:
    """Return the version of viaConstructor, or "" if this Python does not have it."""
    script = "from importlib.metadata import version; print(version('viaconstructor'))"
    command = [python, "-c", script]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip() if python else ""
