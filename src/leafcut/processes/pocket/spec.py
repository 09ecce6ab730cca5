"""Prepare a pocket milling job from a drawing, a picture or a solid: find the pockets, and set the tool, levels and
rules.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from leafcut.errors import OptionError, count_of
from leafcut.geometry.regions import tool_centres
from leafcut.geometry.zones import widen_zones
from leafcut.message import Message
from leafcut.model.cutter import shank_and_holder_discs, widest_radius_below
from leafcut.model.issue import Issue
from leafcut.model.mesh import Mesh
from leafcut.model.part import Part
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.model.work_material import WorkMaterial
from leafcut.options import FeedOptions, JobOptions, MillingOptions, Settings
from leafcut.processes.job import (
    Job,
    check_dialect_options,
    dialect_of,
    library_of,
    plane_point,
    refuse_missing_work,
    refuse_too_large,
)
from leafcut.processes.milling.clamps import Clamp, parse_clamps, refuse_clamp_collisions
from leafcut.processes.milling.mill import assumed_number_issues, library_mill_for, milling_data
from leafcut.processes.placing import place_mesh, place_part, placement_text
from leafcut.processes.pocket.job import PocketJob, PocketSolid, raise_path
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.feed_limits import feed_limits
from leafcut.processes.pocket.plan.rules import clearing_rules, divide_into_levels, enclosing_pockets, select_pockets
from leafcut.processes.pocket.plan.stock_top import fill_pockets, stock_tops
from leafcut.processes.pocket.plan.toolpath import PocketHeights
from leafcut.processes.pocket.strategies import check_algorithm
from leafcut.processes.zones import crossing_heights, parse_zones, refuse_higher_zones
from leafcut.proof.envelope import check_machine_limits
from leafcut.read import read_pockets
from leafcut.read.format import Source
from leafcut.read.work_materials import load_material


def prepare_pocket_job(run: Job, source: Source) -> tuple[PocketJob, list[Issue]]:
    """Read the pockets. Return the milling job and its issues.

    Raises ReadError, OptionError, PlanError or VerifyError.
    """
    settings = run.settings
    check_algorithm(settings)
    options, milling = settings.of(PocketOptions), settings.of(MillingOptions)
    if settings.job.is_through:
        raise OptionError("--depth through does not apply to pockets, which have a floor; give a depth")
    part = read_pockets(
        source, settings.read, settings.pocket_drawing, settings.sheet, run.start_step(Message("reading"))
    )
    whole, library = part, library_of(settings, run.machine)
    mill = library_mill_for(library, settings, settings.job.blind_depth)
    diameter = settings.job.tool_diameter if mill is None else mill.diameter
    part, left = select_pockets(part, settings.job.blind_depth, diameter)
    depths = [one.depth or 0.0 for one in part.pockets]
    if mill is not None:
        # The depths of a solid were not known before, so the mill may be too short.
        mill = library_mill_for(library, settings, max(depths))
    rules = clearing_rules(options, milling.milling, settings.job.step_over, diameter)
    around = enclosing_pockets(part.pockets, rules.tolerance)
    solid, tops = _load_solid(run, source, whole, part, rules.radius)
    levels = tuple(
        divide_into_levels(
            depth,
            settings.job.step_down,
            rules.tool_diameter,
            top if over is None else -depths[over],
            settings.job.thickness,
            settings.job.break_through,
        )
        for depth, over, top in zip(depths, around, tops, strict=True)
    )
    data, issues = milling_data(milling, settings.job, rules.tool_diameter, run.machine, mill, options.entry)
    issues = [*assumed_number_issues(milling, mill, data.tool), *issues]
    limits = None
    if settings.of(FeedOptions).feeds:
        limits, limit_issues = feed_limits(settings, run.machine, levels, data, mill, _load_material(settings))
        issues = [*issues, *limit_issues]
        data = replace(data, limits=limits)
    made_for = "" if part.pockets[0].top is None else placement_text(source.path, part, settings.read)
    part = place_part(part, settings.read)
    surface, keep_out = part.pockets[0].top or 0.0, settings.job.keep_out
    refuse_higher_zones(keep_out, settings.job.clearance_height + surface)
    over, retract = (
        crossing_heights(keep_out, settings.job.clearance_height + surface),
        settings.job.retract_height + surface,
    )
    high, radius = over > retract, 0.5 * data.tool.diameter
    beside = widest_radius_below(radius, shank_and_holder_discs(data.tool), retract, over) - radius
    heights = PocketHeights(
        clearance=settings.job.clearance_height,
        retract=settings.job.retract_height,
        always_clearance=settings.job.retract == "initial",
        end=plane_point(settings.job.end_point),
        zones=widen_zones(parse_zones(keep_out), beside)[high],
    )
    floors, clearance = [one.floor + surface for one in levels], settings.job.clearance_height + surface
    _refuse_clamp_collisions(part.pockets, floors, rules, data.tool, parse_clamps(keep_out, clearance))
    post_dialect = dialect_of(run)
    run = run.for_dialect(post_dialect)
    check_dialect_options(settings, post_dialect)
    job = PocketJob(
        run,
        part,
        rules,
        levels,
        tuple(around),
        heights,
        data,
        post_dialect,
        plane_point(settings.job.start_point),
        limits,
        tuple(tops),
        solid,
        made_for,
    )
    refuse_missing_work(settings, source, (*part.issues, *left))
    refuse_too_large(check_machine_limits(_extent_moves(job), run.machine), part, settings)
    return job, [*part.issues, *left, *issues, *_lower_top_issues(part.pockets, tops)]


def _load_solid(
    run: Job, source: Source, whole: Part, part: Part, radius: float
) -> tuple[PocketSolid | None, list[float]]:
    """Return the solid, and the height of the material above each pocket, mm.

    Without --pocket-top surface, the function returns None and zeros. Raises OptionError if the input is not a
    solid.
    """
    if run.settings.of(PocketOptions).pocket_top == "highest":
        return None, [0.0] * len(part.pockets)
    if any(one.top is None for one in part.pockets):
        raise OptionError("--pocket-top surface requires a STEP file; leave the option out, or give a STEP file")
    from leafcut.read.step import Pose, read_step_mesh

    run.report(Message("reading the surface"))
    read = run.settings.read
    triangles = read_step_mesh(source.path, source.data, read.solid, Pose.of(read))
    all_tops = stock_tops(whole.pockets, whole.pockets, triangles, radius)
    before = place_mesh(Mesh(fill_pockets(triangles, whole.pockets, all_tops), part.name), part, read)
    tops = [all_tops[k] for k, one in enumerate(whole.pockets) if any(one is mine for mine in part.pockets)]
    return PocketSolid(triangles, whole.pockets, part.pockets, before), tops


def _lower_top_issues(pockets: Sequence[Pocket], tops: Sequence[float]) -> list[Issue]:
    lower = [k for k, top in enumerate(tops) if top < 0.0]
    if not lower:
        return []
    heights = sorted({round((pockets[k].top or 0.0) + tops[k], 3) for k in lower}, reverse=True)
    words = Message(
        "the material of {} starts below the highest point of the solid, at {}; remove the material above it first",
        count_of(len(lower), "pocket"),
        ", ".join(f"Z{z:g}" for z in heights),
    )
    return [Issue("L706", words)]


def _load_material(settings: Settings) -> WorkMaterial | None:
    """Return the material of the workpiece, or None if no material is given or its cutting force is unknown.

    Raises OptionError if a material file is invalid.
    """
    named = settings.job.material
    if "material" not in settings.given:
        return None
    try:
        return load_material(named)
    except OptionError:
        if JobOptions.specs()["material"].names_file(named):
            raise
        return None  # the material is listed only in the tables of cutting speeds


def _extent_moves(job: PocketJob) -> Toolpath:
    """Return moves that cross the bounding box of each pocket, from the clearance height down to the floor.

    These moves are used to check the limits of the machine.
    """
    builder = ToolpathBuilder()
    builder.rapid(z=job.heights.clearance)
    for one, levels in zip(job.part.pockets, job.levels, strict=True):
        x0, y0, x1, y1 = one.outline.extents
        r = job.rules.radius
        builder.rapid(x0 + r, y0 + r)
        builder.feed(z=levels.floor, feed=job.data.tool.feed)
        builder.feed(x1 - r, y1 - r, feed=job.data.tool.feed)
        builder.rapid(z=job.heights.clearance)
    return raise_path(builder.build(), job.top)


def _refuse_clamp_collisions(
    pockets: Sequence[Pocket], floors: Sequence[float], rules: PocketRules, tool: Tool, clamps: Sequence[Clamp]
) -> None:
    """Raise PlanError if the tool would hit a clamp in any pocket. `floors` contains the height of each floor, mm."""
    for pocket, floor in zip(pockets, floors, strict=True) if clamps else ():
        centres = tool_centres(pocket.region(rules.tolerance), rules.radius + rules.stock, rules.tolerance)
        if not centres.is_empty:
            refuse_clamp_collisions(pocket.label, centres, floor, tool, rules.radius, clamps)
