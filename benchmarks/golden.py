"""Output of every process, byte for byte, to compare two states of the code.

    python -m benchmarks golden write FOLDER        with the code before a change
    python -m benchmarks golden write OTHER         with the code after the change
    python -m benchmarks golden compare FOLDER OTHER

It writes programs, JSON answers, report pages, plan files and studio drawings, for the shipped examples and for the
programs in ``tests/styles``, each on three machines. Without the measured seconds the output repeats (same seed, same
program). A refusal is written as its message.
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

#: Jobs whose options change the course: name → drawing or program, process, options.
VARIANTS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "drill-library": ("plate_70.dxf", "drill", {"tools": "examples/tools.toml", "thickness": 6.0}),
    "drill-given-order": ("plate_27.dxf", "drill", {"algorithm": "none", "start_point": (0.0, 0.0)}),
    "drill-nearest": ("plate_65.dxf", "drill", {"algorithm": "nn", "thickness": 8.0}),
    "drill-by-distance": ("board_97.dxf", "drill", {"objective": "distance", "end_point": (0.0, 0.0)}),
    "drill-keep-out": ("plate_45.dxf", "drill", {"keep_out": "20 20 40 40", "depth": 4.0}),
    "drill-initial": ("plate_27.dxf", "drill", {"retract": "initial", "dialect": "heidenhain"}),
    "drill-solid": ("stepped_plate.step", "drill", {}),
    "drill-surface": ("plate_10.dxf", "drill", {"machine": "haas-vf2", "dialect": "siemens", "depth": 3.0}),
    "pocket-feeds": (
        "pocket.dxf",
        "pocket",
        {"depth": 4.0, "tool_diameter": 6.0, "feeds": True, "feed": 600.0, "spindle_speed": 8000.0},
    ),
    "pocket-stock": ("pocket.dxf", "pocket", {"depth": 6.0, "tool_diameter": 8.0, "stock": 0.3, "strategy": "contour"}),
    "pocket-ramp": ("pocket.png", "pocket", {"pixel_size": 0.2, "depth": 3.0, "tool_diameter": 4.0, "entry": "ramp"}),
    "program-kept": ("cam_121.nc", "reorder", {"keep_order": True}),
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

#: Measured seconds: keys in JSON; on a report page the computing time, a chart, and the rows of the workers.
_CLOCKED = {"seconds", "compile_seconds", "history"}
_CLOCK_WORDS = re.compile(
    r"[^,<>]* of computing|<svg[^>]*><title>Cost against seconds.*?</svg>|(?<=<th>Worker</th>).*?</tbody>", re.DOTALL
)


def jobs() -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Yield (name, input, process, options) of every output."""
    plates = sorted(p.name for p in (ROOT / "examples").glob("*.dxf") if p.name.startswith(("plate", "board")))
    for machine in DRILLS:
        for plate in plates:
            yield f"drill/{plate}/{machine}", f"examples/{plate}", "drill", {"machine": machine}
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
    """Write all outputs with `only` in their name to `folder`."""
    with contextlib.chdir(ROOT):
        for name, source, process, options in jobs():
            if only in name:
                place = folder / name
                place.mkdir(parents=True, exist_ok=True)
                _write(place, source, process, options)
                print(name, flush=True)
        if only in "nest":
            _nest(folder / "nest")
        for program in _styles():
            if only in f"simulate/{program.name}":
                _simulate(folder / "simulate", str(program.relative_to(ROOT)))


def _styles() -> list[Path]:
    return [file for file in sorted((ROOT / "tests" / "styles").glob("*.*")) if file.suffix != ".md"]


def _write(place: Path, source: str, process: str, options: dict[str, Any]) -> None:
    import leafcut
    from leafcut.processes.registry import report_of
    from leafcut.report.json_answer import as_json
    from leafcut.studio.drawing.scene import outcome_part_scene, outcome_scene

    with tempfile.TemporaryDirectory() as work:
        program, report, plan = (Path(work) / name for name in ("program.nc", "report.html", "plan.json"))
        more: dict[str, Any] = {"save_plan": plan} if process == "cut" else {}
        try:
            outcome = leafcut.optimize(source, program, report=report, process=process, threads=1, **options, **more)
        except leafcut.LeafcutError as problem:
            (place / "refused.txt").write_text(str(problem).replace(work, ""))
            return
        for file in (program, report, plan):
            if file.exists():
                text = file.read_text(encoding=outcome.encoding if file == program else "utf-8")
                (place / file.name).write_text(_CLOCK_WORDS.sub("", text.replace(work, "")))
        answer = json.dumps(_unclocked(as_json(report_of(outcome))), indent=1, sort_keys=True)
        (place / "answer.json").write_text(answer.replace(work, ""))
        scenes = {"part": outcome_part_scene, "before": lambda o: outcome_scene(o, "before")}
        scenes["after"] = lambda o: outcome_scene(o, "after")
        for kind, scene in scenes.items():
            with contextlib.suppress(leafcut.LeafcutError):
                (place / f"{kind}.scene").write_bytes(scene(outcome))


def _nest(folder: Path) -> None:
    import leafcut
    from leafcut.processes.nesting.report import nest_as_json

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
    return sorted(n for n in names if not ((one / n).exists() and (other / n).exists())
                  or not filecmp.cmp(one / n, other / n, shallow=False))  # fmt: skip


def main(argv: Sequence[str]) -> int:
    """Write or compare; return 1 if two folders differ."""
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
