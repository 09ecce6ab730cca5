"""Runs a job: calls leafcut and collects the answer and the files."""

from __future__ import annotations

import csv
import io
import json
import threading
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut import api
from leafcut.files.whole_files import read_program
from leafcut.message import messages_to_json
from leafcut.model.heartbeat import OnProgress
from leafcut.model.nest import NestOutcome
from leafcut.model.outcome import Outcome, Which
from leafcut.model.part import Part
from leafcut.model.shown_stock import CUT_THROUGH
from leafcut.model.simulation import Simulation
from leafcut.model.snapshot import Observer
from leafcut.model.study import Iteration, Study
from leafcut.model.toolpath import Toolpath
from leafcut.options.sheet_word import OFFERED
from leafcut.report.path_report import PathReport
from leafcut.studio.drawing.line_match import matching_lines
from leafcut.studio.jobs.history import Artefact
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.nest_request import needs_list, parts_list_text
from leafcut.studio.jobs.task import LIST, NEST, ReadyTask, program_name, unique_names

_BOTH: tuple[Which, ...] = ("before", "after")
_TEXT, _HTML, _SVG = "text/plain; charset=utf-8", "text/html; charset=utf-8", "image/svg+xml"
_DXF, _CSV = "image/vnd.dxf", "text/csv; charset=utf-8"


#: Maximum number of holes up to which users can edit the order.
_MAX_HOLES = 20_000
#: Maximum number of searches that have a chart.
_MAX_SEARCHES = 50


@dataclass(frozen=True)
class JobResult:
    """The result of a job: its ``--json`` answer, its files, and the figures that lists show."""

    answer: dict[str, Any]
    figures: dict[str, Any]
    artefacts: dict[str, Artefact]


def run_task(link: Link, call: ReadyTask, names: tuple[str, ...]) -> JobResult:
    """Run a task. `names` contains the displayed names of the inputs. Raises the same errors as the command line."""
    from leafcut.report.json_answer import simulation_as_json

    on_progress, cancelled = link.report, link.stop
    observe: Observer = link.observer
    if call.records_iterations:
        observe = link.observer.study = Study(link.observer)
    if call.command == "optimize":
        return _optimize(call, names[0], on_progress, cancelled, observe)
    if call.command == "nest":
        return _nest(call, names, on_progress, cancelled)
    if call.command == "solve":
        return _solve(call, names[0], on_progress, cancelled, observe)
    if call.command == "simulate":
        simulation = replace(api.simulate(call.sources[0], progress=on_progress, **call.options), program=names[0])
        return JobResult(simulation_as_json(simulation), {"time_s": simulation.measure.time_s}, {})
    return _verify(call, names, on_progress)


def _verify(call: ReadyTask, names: tuple[str, ...], on_progress: OnProgress) -> JobResult:
    from leafcut.report.json_answer import verification_as_json
    from leafcut.studio.drawing.differences import differences_scene
    from leafcut.studio.drawing.scene import toolpath_scene

    proof = api.verify(call.sources[0], call.sources[1], progress=on_progress, **call.options)
    shared_options = {name: value for name, value in call.options.items() if name != "allow_reverse"}
    runs = [api.simulate(source, progress=on_progress, **shared_options) for source in call.sources]
    texts = [read_program(source) for source in call.sources]
    artefacts = {
        f"scene-{layer}": _scene_artefact(toolpath_scene(run.run, run.machine, name=name, measured=run.measure))
        for layer, run, name in zip(_BOTH, runs, names, strict=True)
    }
    artefacts |= _solid_scene_artefacts(call, runs)
    artefacts["scene-differences"] = _scene_artefact(differences_scene(proof.differences, *(run.run for run in runs)))
    artefacts["lines"] = _line_pairs_artefact(runs[0].path, runs[1].path, *texts)
    return JobResult(verification_as_json(proof), {"same": proof.same}, artefacts)


def _solid_scene_artefacts(call: ReadyTask, runs: Sequence[Simulation]) -> dict[str, Artefact]:
    from leafcut.processes import registry
    from leafcut.processes.settings import collect_settings
    from leafcut.studio.drawing.solid import compared_solid_scenes

    used = registry.work("stock").used()
    settings = collect_settings({name: value for name, value in call.options.items() if name in used})
    # `verify` has no options for tools and stock. Comments in the programs name the tools.
    stocks = [registry.command_function("shown_stock")(source, settings, by_options=False) for source in call.sources]
    if CUT_THROUGH in stocks:
        return {}
    first, second = ((run.run, run.machine, stock) for run, stock in zip(runs, stocks, strict=True))
    scenes = compared_solid_scenes(first, second, (runs[0].measure, runs[1].measure))
    return {f"scene-solid_{side}": _scene_artefact(scene) for side, scene in zip(_BOTH, scenes, strict=True)}


def _line_pairs_artefact(before: Toolpath, after: Toolpath, original: str, new: str) -> Artefact:
    return Artefact(
        "", "application/octet-stream", zlib.compress(matching_lines(before, after, original, new).tobytes())
    )


def _optimize(
    call: ReadyTask, name: str, on_progress: OnProgress, cancelled: threading.Event, observe: Observer
) -> JobResult:
    from leafcut.processes.registry import report_of
    from leafcut.read.plan_file import plan_file_text
    from leafcut.report.json_answer import program_as_json, studio_overview_as_json

    outcome = api.optimize(
        call.sources[0],
        process=call.process,
        progress=on_progress,
        observe=observe,
        cancelled=cancelled,
        **call.options,
    )
    output = program_name(name, outcome.extension)
    # Users pass reports on, so a report names the displayed file instead of the internal path.
    source = name if outcome.part.source else ""
    outcome = replace(outcome, output=output, part=replace(outcome.part, source=source))
    report = report_of(outcome)
    answer = program_as_json(report)
    figures = {
        "before_s": answer["before"]["time_s"],
        "after_s": answer["after"]["time_s"],
        "saved_percent": answer["saved_percent"],
        "gap_percent": answer["gap_percent"],
    }
    kind = f"text/plain; charset={outcome.encoding}"
    artefacts = {
        "program": Artefact(output, kind, outcome.text.encode(outcome.encoding)),
        **_report_artefacts(report, output),
    }
    searches = [
        (report.operation_title(n), o.solution.history, o.solution.lower_bound, o.solution.unit)
        for n, o in enumerate(outcome.operations)
    ]
    artefacts["search"] = _search_charts_artefact(searches, observe)
    overview = json.dumps(messages_to_json(studio_overview_as_json(report)))
    artefacts["figures"] = Artefact("", "application/json", overview.encode())
    artefacts |= _order_file_artefacts(outcome, output) | _plan_file_artefact(call)
    if outcome.part.format == "gcode":
        original = read_program(call.sources[0])
        artefacts["lines"] = _line_pairs_artefact(outcome.path_before, outcome.path_after, original, outcome.text)
    plan = report.cut_plan("after")
    # Plans with common lines cannot be saved.
    if plan is not None and not call.options.get("common_lines"):
        text = plan_file_text(plan.file).encode()
        artefacts["plan"] = Artefact(f"{Path(output).stem}_plan.json", "application/json", text)
    norms = report.cycle_time_csv()
    if norms:
        artefacts["norms"] = Artefact(f"{Path(output).stem}_norms.csv", "text/csv", norms.encode())
    return JobResult(answer, figures, artefacts)


def _nest(call: ReadyTask, names: tuple[str, ...], on_progress: OnProgress, cancelled: threading.Event) -> JobResult:
    from leafcut.processes.registry import command_function
    from leafcut.read.nest_list import WantedDrawing
    from leafcut.studio.drawing.scene import nest_scene

    wanted = [
        WantedDrawing(file, part.quantity, tuple(part.rotations.split()))
        for file, part in zip(call.sources, call.parts, strict=True)
    ]
    options = {"variants": OFFERED, **call.options}
    outcome = api.nest(wanted, progress=on_progress, cancelled=cancelled, **options)
    outcome = replace(outcome, files=outcome.names(NEST, int(options["variants"])))
    artefacts = {
        f"sheet-{v}-{k}": Artefact(file, _DXF, text.encode())
        for v, (files, texts) in enumerate(zip(outcome.files, outcome.drawings, strict=True), 1)
        for k, (file, text) in enumerate(zip(files, texts, strict=True), 1)
    }
    for v, nest in enumerate(outcome.nests, 1):
        for k, layout in enumerate(nest.layouts, 1):
            artefacts[f"scene-{v}-{k}"] = _scene_artefact(nest_scene(nest, layout))
    if needs_list(call.parts):
        names = unique_names([Path(source).name for source in call.sources])  # names of all inputs, without the sheets
        artefacts["list"] = Artefact(LIST, _CSV, parts_list_text(call.parts, names).encode())
    return JobResult(command_function("nest_answer")(outcome), _nest_figures(outcome), artefacts)


def _nest_figures(outcome: NestOutcome) -> dict[str, Any]:
    best = outcome.nests[0]
    used = 100.0 * best.utilisation_of_used
    return {"utilisation_of_used_percent": used, "sheets": best.n_sheets, "variants": len(outcome.nests)}


def _order_file_artefacts(outcome: Outcome, output: str) -> dict[str, Artefact]:
    from leafcut.read.order_file import identify_drawing, order_file_text

    drilled = {n: tuple(o.hole_order) for n, o in enumerate(outcome.operations) if not o.slots}
    count = sum(map(len, drilled.values()))
    # A program of a CAM system has no initial order.
    if outcome.process != "drill" or outcome.nearest is None or not 0 < count <= _MAX_HOLES:
        return {}
    places = outcome.part.hole_xy.tolist()
    order = order_file_text(drilled, identify_drawing(places)).encode()
    return {
        "order": Artefact(f"{Path(output).stem}_order.json", "application/json", order),
        "holes": Artefact("", "application/json", json.dumps(places).encode()),
    }


def _plan_file_artefact(call: ReadyTask) -> dict[str, Artefact]:
    """Return the plan or order file that the job used. With this file, users can repeat the job on the command line."""
    if "plan" not in call.options:
        return {}
    file = Path(call.options["plan"])
    return {"given": Artefact(file.name, "application/json", file.read_bytes())}


def _search_charts_artefact(
    searches: Sequence[tuple[str, Sequence[tuple[float, float]], float | None, str]], observe: Observer
) -> Artefact:
    """Return the chart data of each search: its name, history, lower bound and unit.

    If there is only one search, its iterations are also included.
    """
    kept: list[dict[str, Any]] = [
        {"name": name, "history": [list(point) for point in history], "bound": bound, "unit": unit}
        for name, history, bound, unit in searches[:_MAX_SEARCHES]
    ]
    if isinstance(observe, Study) and len(kept) == len(observe.searches) == 1:
        kept[0]["iterations"] = [list(row) for row in observe.iterations()]
    return Artefact("", "application/json", json.dumps(kept).encode())


def _report_artefacts(report: PathReport[Any], output: str) -> dict[str, Artefact]:
    from leafcut.report.page import path_svg, report_page_html
    from leafcut.studio.drawing.scene import outcome_part_scene, outcome_scene, toolpath_scene
    from leafcut.studio.drawing.solid import outcome_solid_scenes

    outcome, stem = report.outcome, Path(output).stem
    pictures = {
        f"picture-{side}": Artefact(f"{stem}_{side}.svg", _SVG, path_svg(report, side).encode()) for side in _BOTH
    }
    scenes = {f"scene-{side}": _scene_artefact(outcome_scene(outcome, side)) for side in _BOTH}
    scenes["scene-part"] = _scene_artefact(outcome_part_scene(outcome))
    if report.shown_stock() != CUT_THROUGH:
        for side, solid in zip(_BOTH, outcome_solid_scenes(outcome), strict=True):
            scenes[f"scene-solid_{side}"] = _scene_artefact(solid)
    for name, path in report.tried_paths():
        scene = toolpath_scene(path, outcome.machine, name=name, cleared=report.cleared, untimed=True)
        scenes[f"way-{name}"] = _scene_artefact(scene)
    return {**scenes, "report": Artefact(f"{stem}.html", _HTML, report_page_html(report).encode()), **pictures}


def _scene_artefact(data: bytes) -> Artefact:
    return Artefact("", "application/octet-stream", data)


def _solve(
    call: ReadyTask, name: str, on_progress: OnProgress, cancelled: threading.Event, observe: Observer
) -> JobResult:
    from leafcut.read.tsplib import tour_text
    from leafcut.report.json_answer import tour_as_json

    solved = api.solve(call.sources[0], progress=on_progress, observe=observe, cancelled=cancelled, **call.options)
    part, solution = solved.part, solved.solution
    tour = tour_text(part.name, solution.nodes, every=part.grouping is None)
    answer = tour_as_json(solved)
    figures = {key: answer[key] for key in ("length", "gap_percent")}
    artefacts = {
        "tour": Artefact(program_name(name, ".tour"), _TEXT, tour.encode()),
        "search": _search_charts_artefact([(solution.algorithm, solution.history, solution.lower_bound, "")], observe),
        **_tour_scenes(part, solution.nodes),
    }
    if isinstance(observe, Study):
        text = _iterations_csv(observe.iterations())
        artefacts["iterations"] = Artefact(program_name(name, "_iterations.csv"), _CSV, text.encode())
    return JobResult(answer, figures, artefacts)


def _iterations_csv(rows: Sequence[Iteration]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Iteration._fields)
    writer.writerows(rows)
    return text.getvalue()


def _tour_scenes(part: Part, nodes: NDArray[np.int32]) -> dict[str, Artefact]:
    """Draw a closed tour as rapids through its points. The result is empty for a map without coordinates."""
    from leafcut.model.toolpath import ToolpathBuilder
    from leafcut.read.machine import load_machine
    from leafcut.studio.drawing.scene import part_scene, toolpath_scene

    if len(nodes) < 2 or not np.ptp(part.hole_xy, axis=0).any():
        return {}
    builder = ToolpathBuilder()
    for x, y in part.hole_xy[[*nodes, nodes[0]]].tolist():
        builder.rapid(x, y)
    path = toolpath_scene(builder.build(), load_machine(api.default_machine("solve")), name=part.name, part=part)
    return {"scene-part": _scene_artefact(part_scene(part)), "scene-after": _scene_artefact(path)}
