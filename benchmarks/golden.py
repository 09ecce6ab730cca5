"""Output of every process, to compare two revisions of the code byte for byte.

    python -m benchmarks golden write FOLDER        with the code before a change
    python -m benchmarks golden write OTHER         with the code after the change
    python -m benchmarks golden compare FOLDER OTHER

It writes programs, JSON answers, report pages, plan files and studio drawings: for the included examples, for the
programs in ``tests/styles`` on three machines each, and for sheets on which each cutting option has an effect. Except
for measured times, the output is reproducible (same seed, same program). If a job is refused, the message is written.
"""

from __future__ import annotations

import contextlib
import filecmp
import io
import json
import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks import ROOT, page

DRILLS = ("haas-vf2", "grbl-3018", "fagor-8055")
CUTTERS = ("plasma-table", "laser-table", "water-table")
MILLS = ("linuxcnc-mill", "haas-vf2", "grbl-3018")

#: Options of a job in which holes are only spot-drilled.
SPOTS: dict[str, Any] = {"depth": 1.0, "depth_to": "tip"}

#: Jobs whose options change the sequence of steps: name → drawing or program, process, options.
VARIANTS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "drill-library": ("plate_70.dxf", "drill", {"tools": "examples/tools.toml", "thickness": 6.0}),
    "drill-given-order": ("plate_27.dxf", "drill", {**SPOTS, "algorithm": "none", "start_point": (0.0, 0.0)}),
    "drill-nearest": ("plate_65.dxf", "drill", {"algorithm": "nn", "thickness": 8.0}),
    "drill-by-distance": ("board_97.dxf", "drill", {**SPOTS, "objective": "distance", "end_point": (0.0, 0.0)}),
    "drill-keep-out": ("plate_45.dxf", "drill", {"keep_out": "20 20 40 40", "depth": 4.0}),
    "drill-initial": ("plate_27.dxf", "drill", {**SPOTS, "retract": "initial", "dialect": "heidenhain"}),
    "drill-solid": ("stepped_plate.step", "drill", {}),
    "drill-surface": ("plate_10.dxf", "drill", {"machine": "haas-vf2", "dialect": "siemens", "depth": 3.0}),
    "pocket-feeds": (
        "pocket.dxf",
        "pocket",
        {"depth": 4.0, "tool_diameter": 6.0, "feeds": True, "feed": 600.0, "spindle_speed": 8000.0},
    ),
    "pocket-stock": ("pocket.dxf", "pocket", {"depth": 6.0, "tool_diameter": 8.0, "stock": 0.3, "strategy": "contour"}),
    "pocket-ramp": ("pocket.png", "pocket", {"pixel_size": 0.2, "depth": 3.0, "tool_diameter": 4.0, "entry": "ramp"}),
    "program-kept": ("cam_121.nc", "reorder", {"algorithm": "none"}),
    "program-keep-out": ("cam_121.nc", "reorder", {"keep_out": "40 40 60 60", "clearance_height": 8.0}),
    "program-merged": ("cam_121.nc", "reorder", {"merge_tools": True, "mix_operations": True, "allow_reverse": True}),
    "program-low": (
        "cam_121.nc",
        "reorder",
        {"low_retracts": True, "workpiece": "0,0,-10,200,200,0", "tool_diameter": 3.0},
    ),
    "program-air": ("cam_121.nc", "reorder", {"air": True, "tool_diameter": 3.0}),
    "program-nearest": (
        "cam_121.nc",
        "reorder",
        {"algorithm": "nn", "objective": "distance", "start_point": (0.0, 0.0)},
    ),
}

_PLASMA = {"machine": "plasma-table", "thickness": 6.0, "iterations": 20}
_LASER = {"machine": "laser-table", "thickness": 3.0, "iterations": 20}
#: Sheets that `drawn_sheets` draws: name → (drawing, options). If ``planned`` is True, the job follows the
#: nearest-neighbour plan of the same sheet, in which some choices are fixed.
SHEETS: dict[str, tuple[str, dict[str, Any]]] = {
    "leads": ("crowded", _PLASMA),
    "leads-again": ("tight", _PLASMA),
    "leads-nearest": ("crowded", {**_PLASMA, "algorithm": "nn"}),
    "leads-given": ("plain", {**_PLASMA, "algorithm": "none"}),
    "leads-distance": ("tight", {**_PLASMA, "objective": "distance"}),
    "lines": ("crowded", {**_PLASMA, "lead_in": "line", "lead_out": "none"}),
    "chains": ("tight", {**_PLASMA, "chains": True}),
    "chains-sweep": ("crowded", {**_PLASMA, "chains": True, "sweep": "-y", "start_point": (250.0, 192.0)}),
    "common": ("joined", {**_PLASMA, "common_lines": True, "kerf": 2.0}),
    "common-laser": ("joined", {**_LASER, "common_lines": True, "kerf": 2.0}),
    "common-sweep": ("joined", {**_PLASMA, "common_lines": True, "kerf": 2.0, "sweep": "x"}),
    "joints": ("crowded", {**_PLASMA, "micro_joints": 1, "joint_width": 0.8}),
    "joints-laser": ("tight", {**_LASER, "micro_joints": 2}),
    "heat": ("tight", {**_PLASMA, "heat_distance": 40.0}),
    "heat-laser": ("tight", {**_LASER, "heat_distance": 40.0}),
    "sweep": ("crowded", {**_PLASMA, "sweep": "-x", "start_point": (250.0, 0.0)}),
    "sweep-heat": ("tight", {**_PLASMA, "sweep": "y", "heat_distance": 30.0}),
    "plan": ("crowded", {**_PLASMA, "planned": True}),
    "plan-kept": ("crowded", {**_PLASMA, "planned": True, "algorithm": "none"}),
    "plan-sweep": ("crowded", {**_PLASMA, "planned": True, "sweep": "x"}),
    "plan-laser": ("tight", {**_LASER, "planned": True}),
    "plan-chains": ("tight", {**_PLASMA, "planned": True, "chains": True}),
    "plan-chains-kept": ("tight", {**_PLASMA, "planned": True, "chains": True, "algorithm": "none"}),
    "kept": ("crowded", {**_PLASMA, "algorithm": "none"}),
    "laser": ("tight", _LASER),
    "laser-holes": ("crowded", {**_LASER, "start_point": (0.0, 0.0), "end_point": (0.0, 0.0)}),
    "laser-clamp": ("crowded", {**_LASER, "keep_out": "66 30 68 40"}),
    "laser-grbl": (
        "crowded",
        {**_LASER, "machine": "grbl-laser-20w", "cut_speed": 300.0, "kerf": 0.2, "pierce_delay": 0.0},
    ),
    "controller": ("crowded", {**_PLASMA, "compensation": "controller", "dialect": "qtplasmac"}),
    "controller-chains": ("tight", {**_PLASMA, "compensation": "controller"}),
    "uncompensated": ("crowded", {**_PLASMA, "compensation": "none"}),
    "loops": ("tight", {**_PLASMA, "corner_loops": True}),
    "probe": ("tight", {**_PLASMA, "dialect": "plasma"}),
    "flame": ("crowded", {"machine": "flame-table", "thickness": 12.0, "iterations": 20}),
    "water": ("tight", {"machine": "water-table", "thickness": 10.0, "iterations": 20}),
    "edge": ("plain", {**_PLASMA, "thickness": 25.0, "amps": 45.0}),
    "clamp": ("crowded", {**_PLASMA, "keep_out": "66 30 68 40", "end_point": (0.0, 0.0)}),
    "ants": ("tight", {**_PLASMA, "algorithm": "mmas", "local_search": False}),
}

#: Measured times to be omitted: keys in JSON; on a report page, the computing time, a chart, and the rows of the
#: workers.
_CLOCKED = {"seconds", "search_seconds", "compile_seconds", "history"}
_CLOCK_WORDS = re.compile(
    r"[^,<>]* of computing|<svg[^>]*><title>Cost against seconds.*?</svg>|(?<=<th>Worker</th>).*?</tbody>", re.DOTALL
)


def jobs() -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Yield (name, input, process, options) of each output."""
    plates = sorted(p.name for p in (ROOT / "examples").glob("*.dxf") if p.name.startswith(("plate", "board")))
    for machine in DRILLS:
        for plate in plates:
            yield f"drill/{plate}/{machine}", f"examples/{plate}", "drill", {"machine": machine, **SPOTS}
    kinds = dict(zip(CUTTERS, ("plasma", "laser", "waterjet"), strict=True))
    for machine in CUTTERS:
        for drawing in ("sheet.dxf", "bracket.dxf", "gusset.svg"):
            more = {"machine": machine, "cut_process": kinds[machine], "thickness": 6.0}
            yield f"cut/{drawing}/{machine}", f"examples/{drawing}", "cut", more
    for machine in MILLS:
        for drawing, more in (("pocket.dxf", {}), ("pocket.png", {"pixel_size": 0.2})):
            given = {"machine": machine, "depth": 4.0, "tool_diameter": 6.0, **more}
            yield f"pocket/{drawing}/{machine}", f"examples/{drawing}", "pocket", given
    for machine in MILLS:
        for program in (ROOT / "examples" / "cam_121.nc", *_styles()):
            yield f"program/{program.name}/{machine}", str(program.relative_to(ROOT)), "auto", {"machine": machine}
    for name, (source, process, more) in VARIANTS.items():
        yield f"variant/{name}", f"examples/{source}", process, more


def write(folder: Path, only: str) -> None:
    """Write all outputs whose names contain `only` to `folder`."""
    with contextlib.chdir(ROOT):
        for name, source, process, options in jobs():
            if only in name:
                place = folder / name
                place.mkdir(parents=True, exist_ok=True)
                _write(place, source, process, options)
                print(name, flush=True)
        _sheets(folder / "sheet", only)
        if only in "nest":
            _nest(folder / "nest")
        for program in _styles():
            if only in f"simulate/{program.name}":
                _simulate(folder / "simulate", str(program.relative_to(ROOT)))


def drawn_sheets(folder: Path) -> None:
    """Draw the sheets of `SHEETS`: parts with holes 12 mm and 7 mm apart, parts one kerf apart, and parts without
    holes.
    """
    import ezdxf

    for name, columns, rows, gap in (
        ("crowded", 4, 3, 12.0),
        ("tight", 6, 5, 7.0),
        ("joined", 3, 2, 2.0),
        ("plain", 3, 2, 40.0),
    ):
        document = ezdxf.new(units=4)
        space, step = document.modelspace(), 46.0 + gap
        for row in range(rows):
            for column in range(columns):
                x, y = 15.0 + step * column, 15.0 + step * row
                corners = [(x, y), (x + 46.0, y), (x + 46.0, y + 46.0), (x, y + 46.0)]
                if name != "joined" and (row + column) % 3 == 1:
                    corners = [(x, y), (x + 46.0, y), (x + 46.0, y + 30.0), (x + 25.0, y + 46.0), (x, y + 46.0)]
                space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "CUT"})
                if name == "plain":
                    continue
                space.add_circle((x + 15.0, y + 15.0), 8.0, dxfattribs={"layer": "CUT"})
                if (row + column) % 2:
                    space.add_circle((x + 34.0, y + 20.0), 4.0, dxfattribs={"layer": "CUT"})
                elif name == "crowded":
                    space.add_line((x + 10.0, y + 35.0), (x + 30.0, y + 35.0), dxfattribs={"layer": "MARK"})
        width, height = 30.0 + step * columns - gap, 30.0 + step * rows - gap
        edge = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
        space.add_lwpolyline(edge, close=True, dxfattribs={"layer": "SHEET"})
        document.saveas(folder / f"{name}.dxf")


def _sheets(folder: Path, only: str) -> None:
    import leafcut

    with tempfile.TemporaryDirectory() as work:
        drawn_sheets(Path(work))
        for name, (drawing, options) in SHEETS.items():
            if only not in f"sheet/{name}":
                continue
            place, source = folder / name, f"{work}/{drawing}.dxf"
            place.mkdir(parents=True, exist_ok=True)
            more = {"cut_process": "plasma", "ignore_layers": "MARK", **options}
            if "grbl" in name or more["machine"] in ("plasma-table", "laser-table"):
                del more["ignore_layers"]
            if more["machine"] != "plasma-table":
                del more["cut_process"]
            if more.pop("planned", False):
                plan = Path(work) / "fixed.json"
                nearest = {**more, "algorithm": "nn"}
                leafcut.optimize(source, process="cut", threads=1, **nearest, save_plan=plan)
                content = json.loads(plan.read_text())
                for number, cut in enumerate(content["cuts"]):
                    led = cut.get("lead_in", {}).get("style", "none") != "none" and not number % 3
                    named = {"order": bool(number % 2), "start": led, "lead": led, "bridge": "bridge" in cut}
                    cut["fixed"] = [word for word, fixed in named.items() if fixed]
                plan.write_text(json.dumps(content))
                more["plan"] = plan
            _write(place, source, "cut", more, work)
            print(f"sheet/{name}", flush=True)


def _styles() -> list[Path]:
    return [file for file in sorted((ROOT / "tests" / "styles").glob("*.*")) if file.suffix != ".md"]


def _write(place: Path, source: str, process: str, options: dict[str, Any], elsewhere: str = "") -> None:
    """Write the outputs of a job, without the folder `elsewhere` of its input."""
    import leafcut
    from leafcut.processes.registry import report_of
    from leafcut.report.json_answer import program_as_json
    from leafcut.studio.drawing.scene import outcome_part_scene, outcome_scene

    with tempfile.TemporaryDirectory() as work:
        program, report, plan = (Path(work) / name for name in ("program.nc", "report.html", "plan.json"))
        more: dict[str, Any] = {"save_plan": plan} if process == "cut" and not options.get("common_lines") else {}
        try:
            outcome = leafcut.optimize(source, program, report=report, process=process, threads=1, **options, **more)
        except leafcut.LeafcutError as problem:
            (place / "refused.txt").write_text(_named(str(problem), work, elsewhere))
            return
        for file in (program, report, plan):
            if file.exists():
                text = file.read_text(encoding=outcome.encoding if file == program else "utf-8")
                (place / file.name).write_text(_CLOCK_WORDS.sub("", _named(text, work, elsewhere)))
        answer = json.dumps(_unclocked(program_as_json(report_of(outcome))), indent=1, sort_keys=True)
        (place / "answer.json").write_text(_named(answer, work, elsewhere))
        scenes = {"part": outcome_part_scene, "before": lambda o: outcome_scene(o, "before")}
        scenes["after"] = lambda o: outcome_scene(o, "after")
        for kind, scene in scenes.items():
            with contextlib.suppress(leafcut.LeafcutError):
                (place / f"{kind}.scene").write_bytes(scene(outcome))


def _named(text: str, *folders: str) -> str:
    """Remove the names of folders from a text."""
    for folder in filter(None, folders):
        text = text.replace(folder, "")
    return text


def _nest(folder: Path) -> None:
    import leafcut
    from leafcut.nesting.report import nest_as_json

    folder.mkdir(parents=True, exist_ok=True)
    outcome = leafcut.nest(
        ["examples/bracket.dxf:6", "examples/gusset.svg:4"], folder / "sheet.dxf", sheet="600x400", variants=2,
        nester="rectangles",
    )  # fmt: skip
    answer = json.dumps(_unclocked(nest_as_json(outcome)), indent=1, sort_keys=True)
    (folder / "answer.json").write_text(answer.replace(str(folder), ""))


def _simulate(folder: Path, program: str) -> None:
    from leafcut.cli.app import run

    folder.mkdir(parents=True, exist_ok=True)
    answer = io.StringIO()
    with contextlib.redirect_stdout(answer), contextlib.redirect_stderr(answer), contextlib.suppress(SystemExit):
        run(["simulate", program, "--json"])
    (folder / f"{Path(program).name}.json").write_text(answer.getvalue())


def _unclocked(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _unclocked(item) for key, item in value.items() if key not in _CLOCKED}
    return [_unclocked(item) for item in value] if isinstance(value, list) else value


def compare(one: Path, other: Path) -> list[str]:
    """Return the names of all different, missing and new files."""
    names = {str(f.relative_to(side)) for side in (one, other) for f in side.rglob("*") if f.is_file()}
    return sorted(
        n
        for n in names
        if not ((one / n).exists() and (other / n).exists()) or not filecmp.cmp(one / n, other / n, shallow=False)
    )


def main(argv: Sequence[str]) -> int:
    """Write or compare outputs; return 1 if two folders differ."""
    parser = page.parser("golden", __doc__, writes=False)
    parser.add_argument("action", choices=("write", "compare"))
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--only", default="", help="write only outputs with this text in their name")
    given = parser.parse_args(argv)
    if given.action == "write":
        write(given.folders[0].resolve(), given.only)
        return 0
    different = compare(*given.folders)
    print("\n".join(different) or "equal")
    return int(bool(different))
