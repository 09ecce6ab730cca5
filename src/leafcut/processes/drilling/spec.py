"""Prepare a drilling job. Planning and verification both need the part, its surface and its operations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import OptionError, PlanError, count_of, printable
from leafcut.geometry.arrays import Ints
from leafcut.message import Message
from leafcut.model.contour import layer_matcher
from leafcut.model.issue import Issue
from leafcut.model.mesh import Mesh
from leafcut.model.part import Part, ProgramZero
from leafcut.options import flag_name
from leafcut.options.drawings import ISLAND_NAMES, POCKET_NAMES
from leafcut.processes.drilling.judge import DrillingRequest
from leafcut.processes.drilling.options import DrillOptions
from leafcut.processes.drilling.plan.drilling import DrillPlan, plan_drilling
from leafcut.processes.job import Job, library_of
from leafcut.processes.placing import place_mesh, place_part, placement_text, turn_mesh_like_part
from leafcut.read import Match, read
from leafcut.read.format import SNIFF_BYTES
from leafcut.read.order_file import identify_drawing, load_order
from leafcut.read.recognition import sniff_step
from leafcut.read.registry import detect_format_name

if TYPE_CHECKING:
    from leafcut.model.mesh import Mesh
    from leafcut.read.format import Source


def _with_omitted_work_issues(part: Part, job: Job, source: Source, everything: bool) -> Part:
    """Add issues about work that the drilling program does not do.

    If the user asked for drilling (`everything` is false), contours only cause a note. If the user chose which of
    several concentric circles to drill, the omitted circles only cause a note as well.
    """
    chosen = "concentric" in job.settings.given
    issues = [issue.as_note() if issue.code == "L302" and chosen else issue for issue in part.issues]
    besides = [*part.besides]
    if everything and part.has_hole_depths:
        from leafcut.read.step import report_work_besides_holes

        besides += report_work_besides_holes(source, job.settings.read)
    issues += besides if everything else [issue.as_note() for issue in besides]
    if not job.settings.read.layers:
        issues += _pocket_layer_issues(part)
    return replace(part, issues=tuple(issues), besides=())


def _pocket_layer_issues(part: Part) -> list[Issue]:
    is_other = layer_matcher((*POCKET_NAMES, *ISLAND_NAMES))
    issues = []
    for layer, number in Counter(hole.layer for hole in part.holes).items():
        if is_other(layer):
            message = Message(
                "the program drills {} on layer '{}', whose name suggests other work; to exclude them, name "
                "the layers to drill with --layers",
                count_of(number, "hole"),
                printable(layer),
            )
            issues.append(Issue("L418", message))
    return issues


def _load_meshes(job: Job, source: Source, part: Part, of_step: bool) -> tuple[Mesh | None, Mesh | None]:
    """Load the surface and the fixture. Both use the coordinates of the part as it was read."""
    drill_options, solid_number = job.settings.of(DrillOptions), job.settings.read.solid
    if drill_options.surface is None and drill_options.fixture is None and not part.has_hole_depths:
        return None, None
    from leafcut.read.meshes import load_mesh
    from leafcut.read.step import read_step_mesh

    surface = fixture = None
    if drill_options.surface is not None:
        job.report(Message("reading the surface"))
        if solid_number is not None and of_step and detect_format_name(drill_options.surface) != part.format:
            solid_number = None  # the number refers to a solid of the drawing
        surface = load_mesh(drill_options.surface, drill_options.surface_unit, which=solid_number)
    elif part.has_hole_depths:
        job.report(Message("reading the surface"))
        surface = Mesh(read_step_mesh(source.path, source.data, solid_number), part.name)
    if drill_options.fixture is not None:
        job.report(Message("reading the fixture"))
        fixture = load_mesh(drill_options.fixture, drill_options.surface_unit, which="all")
    return (
        None if surface is None else turn_mesh_like_part(surface, part),
        None if fixture is None else turn_mesh_like_part(fixture, part),
    )


def prepare_drilling(job: Job, sources: Sequence[Source], everything: bool) -> tuple[DrillPlan, DrillingRequest]:
    """Return the drilling plan, and the request that the verification compares with the program.

    If `everything` is set, the user did not ask for drilling explicitly, so contours and pockets count as missing work.
    """
    tools = job.settings.job.tools
    if "material" in job.settings.asked and tools is not None:
        from leafcut.read.tool_formats import WITH_PRESETS

        if tools.suffix.lower() not in WITH_PRESETS:
            raise OptionError(
                "--material selects the presets of a Fusion tool library; leave it out. To write a tool library for a "
                "material, use leafcut tools speeds"
            )
    on_progress, reading = job.start_step(Message("reading")), job.settings.read
    options, drill_options = job.settings.job, job.settings.of(DrillOptions)
    of_step = any(sniff_step(source.data[:SNIFF_BYTES]) is Match.YES for source in sources)
    if drill_options.surface is not None and not of_step:
        # --solid refers to a solid of the surface.
        reading = replace(reading, solid=None)
    if len(sources) == 1:
        part = read(sources[0], reading, on_progress)
    else:
        from leafcut.read.joining import read_drill_files

        part = read_drill_files(sources, reading, on_progress)
    part = _with_omitted_work_issues(part, job, sources[0], everything)
    surface, fixture = _load_meshes(job, sources[0], part, of_step)
    mesh, fixture = (
        None if loaded is None else place_mesh(loaded, part, job.settings.read) for loaded in (surface, fixture)
    )
    library = library_of(job.settings, job.machine)
    request = DrillingRequest(part, job.settings.read, options, drill_options, library, surface)
    made_for = (
        "" if mesh is None else placement_text(str(drill_options.surface or sources[0].path), part, job.settings.read)
    )
    part = place_part(part, job.settings.read)
    if not part.has_hole_depths and mesh is not None:
        part = replace(part, zero=replace(part.zero or ProgramZero(), level="surface", z=float(mesh.high[2])))
    elif not part.has_hole_depths and reading.z_zero == "drawn" and part.holes:
        part = replace(
            part, zero=replace(part.zero or ProgramZero(), level="holes", z=max(hole.z for hole in part.holes))
        )
    drawn = reading.z_zero == "drawn"
    plan = plan_drilling(part, job.machine, library, options, drill_options, mesh, fixture, drawn=drawn)
    plan = replace(plan, made_for=made_for)
    if "retract" in job.settings.asked and plan.always_initial and options.retract != "initial":
        raise OptionError(
            "--retract r: the surface between holes at different heights is unknown, so the tool rises above "
            "the highest hole after each hole; leave the option out"
        )
    for name in ("feed", "spindle_speed"):
        if name in job.settings.asked and not any(tool.assumed for tool in plan.tools):
            raise OptionError(
                "{}: the tools in {} have values of their own; leave it out", flag_name(name), options.tools
            )
    for name in ("peck", "dwell"):
        value = getattr(drill_options, name)
        if name in job.settings.asked and value and all(getattr(one.cycle, name) != value for one in plan.operations):
            raise OptionError(
                "{}: no cycle of this program uses it; leave it out, or choose another --cycle", flag_name(name)
            )
    return plan, request


def nodes_to_visit_first(plan: DrillPlan, path: Path | None) -> dict[int, Ints]:
    """Read an order file, and return the nodes that each operation must visit first, in order.

    Without a file, the result is empty. A node is an index in the routing problem of the operation.

    Raises
    ------
    ReadError
        If the file is not an order file.
    PlanError
        If the file belongs to another drawing, or if it contains an unknown hole or the same hole twice.
    """
    if path is None:
        return {}

    order, drawing = load_order(path), identify_drawing(plan.part.hole_xy.tolist())
    if order.drawing is not None and order.drawing != drawing:
        same_number = order.drawing.holes == drawing.holes
        difference = Message("the same number at other positions") if same_number else f"{drawing.holes}"
        raise PlanError(
            "{}: this order is for another drawing with {} holes, but this drawing has {}; create a new file, "
            "or remove 'drawing' from the file to use it anyway",
            path,
            order.drawing.holes,
            difference,
        )
    nodes = {}
    for number, holes in order.operations.items():
        where = Message("{}: operation {}", path, number + 1)
        if number >= len(plan.operations):
            raise PlanError("{}: the last operation of the job is {}; create a new file", where, len(plan.operations))
        operation = plan.operations[number]
        if operation.slots:
            raise PlanError("{} mills slots; only holes can be given an order; remove it from the file", where)
        node_of = {int(hole): node for node, hole in enumerate(operation.targets)}
        for k, hole in enumerate(holes):
            if hole not in node_of:
                raise PlanError("{}: hole {} is not drilled by {}", where, hole + 1, operation.tool.label)
            if hole in holes[:k]:
                raise PlanError("{}: hole {} is listed twice", where, hole + 1)
        nodes[number] = np.array([node_of[hole] for hole in holes], dtype=np.int32)
    return nodes
