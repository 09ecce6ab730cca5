"""What every process writes, byte for byte, so that two states of the code can be compared.

    python benchmarks/golden.py write FOLDER        with the code of the one state
    python benchmarks/golden.py write OTHER         with that of the other one
    python benchmarks/golden.py compare FOLDER OTHER

Programs, answers in JSON, report pages, plan files and the studio's drawings of the shipped examples and of the
programs in ``tests/styles``, each on three machines. The presets repeat (same seed, same program); only seconds that a
clock measured are left out. A refusal is kept as its words.
"""

from __future__ import annotations

import argparse
import contextlib
import filecmp
import io
import json
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]

DRILLS = ("haas-vf2", "grbl-3018", "fagor-8055")
CUTTERS = ("plasma-table", "laser-table", "water-table")
MILLS = ("linuxcnc-mill", "haas-vf2", "grbl-3018")

#: What a clock measured: keys of JSON, and on a report page the time of computing, a chart, and a row of each worker.
_CLOCKED = {"seconds", "history"}
_CLOCK_WORDS = re.compile(
    r"[^,<>]* of computing|<svg[^>]*><title>Cost against seconds.*?</svg>|(?<=<th>Worker</th>).*?</tbody>", re.DOTALL
)


def jobs() -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Yield (name, input, process, options) of everything that is made."""
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


def write(folder: Path, only: str) -> None:
    """Make everything whose name holds `only` below `folder`."""
    with contextlib.chdir(ROOT):
        for name, source, process, options in jobs():
            if only in name:
                place = folder / name
                place.mkdir(parents=True, exist_ok=True)
                _make(place, source, process, options)
                print(name, flush=True)
        if only in "nest":
            _nest(folder / "nest")
        for program in _styles():
            if only in f"simulate/{program.name}":
                _simulate(folder / "simulate", str(program.relative_to(ROOT)))


def _styles() -> list[Path]:
    return [file for file in sorted((ROOT / "tests" / "styles").glob("*.*")) if file.suffix != ".md"]


def _make(place: Path, source: str, process: str, options: dict[str, Any]) -> None:
    import leafcut
    from leafcut.report.json_answer import as_json
    from leafcut.studio.drawing.scene import outcome_part_scene, outcome_scene

    with tempfile.TemporaryDirectory() as work:
        program, report, plan = (Path(work) / name for name in ("program.nc", "report.html", "plan.json"))
        more = {"save_plan": plan} if process == "cut" else {}
        try:
            outcome = leafcut.optimize(source, program, report=report, process=process, threads=1, **options, **more)
        except leafcut.LeafcutError as problem:
            (place / "refused.txt").write_text(str(problem).replace(work, ""))
            return
        for made in (program, report, plan):
            if made.exists():
                text = made.read_text(encoding=outcome.encoding if made == program else "utf-8")
                (place / made.name).write_text(_CLOCK_WORDS.sub("", text.replace(work, "")))
        answer = json.dumps(_unclocked(as_json(outcome)), indent=1, sort_keys=True)
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
    from leafcut.cli import run

    folder.mkdir(parents=True, exist_ok=True)
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), contextlib.suppress(SystemExit):
        run(["simulate", program, "--json"])
    (folder / f"{Path(program).name}.json").write_text(said.getvalue())


def _unclocked(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _unclocked(one) for key, one in value.items() if key not in _CLOCKED}
    return [_unclocked(one) for one in value] if isinstance(value, list) else value


def compare(one: Path, other: Path) -> list[str]:
    """Return the names of what differs or is on one side only."""
    names = {str(f.relative_to(side)) for side in (one, other) for f in side.rglob("*") if f.is_file()}
    return sorted(n for n in names if not ((one / n).exists() and (other / n).exists())
                  or not filecmp.cmp(one / n, other / n, shallow=False))  # fmt: skip


def main(words: Sequence[str] | None = None) -> None:
    """Do what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("write", "compare"))
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--only", default="", help="what the names of those made contain")
    given = parser.parse_args(words)
    if given.what == "write":
        write(given.folders[0].resolve(), given.only)
        return
    different = compare(*given.folders)
    print("\n".join(different) or "equal")
    sys.exit(bool(different))


if __name__ == "__main__":
    main()
