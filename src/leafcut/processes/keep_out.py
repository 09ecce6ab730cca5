"""Keep-out zones for programs from other CAM systems.

This module computes heights and tool radii, and detects collisions in the original program.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from leafcut.errors import OptionError, PlanError
from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import tool_diameter_in_comments
from leafcut.message import Message
from leafcut.model.cutter import shank_and_holder_discs
from leafcut.model.difference import Difference
from leafcut.model.issue import Issue
from leafcut.model.obstacles import Obstacles
from leafcut.model.tool import Tool
from leafcut.model.toolpath import MOTIONS, Kind, Toolpath
from leafcut.processes.job import Job, library_of
from leafcut.processes.zones import crossing_heights, parse_zones
from leafcut.proof.difference import MOST_LISTED

#: Z counts as constant if it changes by no more than this, mm. A laser program may state a single height.
_FLAT = 1e-6


def keep_out_obstacles(job: Job, program: Program, beam: bool) -> tuple[Obstacles, list[Issue]]:
    """Return the obstacles that ``--keep-out`` defines for a program, and the issues.

    Raises
    ------
    PlanError
        If the program cuts inside an obstacle, which no order or route can avoid. Also if a move from an unknown
        position may cross an obstacle.
    OptionError
        If the user gave a clearance height, but the program never moves Z.
    """
    from leafcut.proof.obstacles import CUTS, MAY_CROSS

    settings = job.settings.job
    zones = parse_zones(settings.keep_out)
    known = None if beam else library_of(job.settings, job.machine)
    library = {} if known is None else known.by_number
    radii, unknown = ({}, []) if beam else _tool_radii(program, library)
    lifts = _moves_z(program.path)
    heights = crossing_heights(settings.keep_out, settings.clearance_height)
    heights = heights if lifts else np.full(len(zones), math.inf)
    if not lifts and "clearance_height" in job.settings.asked:
        raise OptionError(
            "--clearance-height: this program never moves Z, so rapids go around keep-out zones; leave it out"
        )
    obstacles = Obstacles(
        zones,
        heights,
        radii,
        job.machine.rapid_style == "dogleg",
        {number: shank_and_holder_discs(library[number]) for number in radii if number in library},
        {number: _lowest_tip(program.path, number) for number in radii},
    )
    hits = obstacle_hits(job, obstacles, program.path)
    if hits and hits[0].what == CUTS:
        raise PlanError("{}; move the obstacle, or the program's origin", hits[0])
    if hits and hits[0].what == MAY_CROSS:
        raise PlanError("{}; raise the tool before this move, or leave out --keep-out", hits[0])
    issues = []
    if hits:
        often = Message("once") if len(hits) == 2 else Message("{} times", len(hits) - 1)
        often = Message("at least {}", often) if len(hits) > MOST_LISTED else often
        route = Message("goes around the zones")
        if lifts:
            route = Message("passes over the zones at Z{:g} or higher", heights.min())
        message = Message("rapids of the original cross --keep-out zones; the new program {}", route)
        if len(hits) > 1:
            message = Message(
                "rapids of the original cross --keep-out zones, here and {} more; the new program {}", often, route
            )
        issues.append(Issue("L508", message, Message("line {}", hits[0].new)))
    if unknown:
        tools = ", ".join(f"T{number}" for number in unknown)
        message = Message(
            "the diameter of {} is unknown, so only the tool's centre stays out of the zones; widen the "
            "rectangles by the tool's radius, or set --tools",
            tools,
        )
        issues.append(Issue("L509", message))
    return obstacles, issues


def obstacle_hits(job: Job, obstacles: Obstacles, path: Toolpath) -> list[Difference]:
    """Return a difference for each motion of a program that hits an obstacle."""
    from leafcut.proof.obstacles import check_obstacles

    return check_obstacles(
        path,
        obstacles.zones,
        obstacles.heights,
        tool_radii=obstacles.radii,
        bodies=obstacles.bodies,
        safe_z=job.machine.safe_z or 0.0,
        dogleg=obstacles.dogleg,
    )


def _moves_z(path: Toolpath) -> bool:
    if (path.kind == Kind.DRILL).any():
        return True
    z = path.end[np.isin(path.kind, [int(k) for k in MOTIONS]), 2]
    z = z[np.isfinite(z)]
    return bool(len(z) and np.ptp(z) > _FLAT)


def _lowest_tip(path: Toolpath, tool: int) -> float:
    """Return the lowest position that the tip of a tool reaches, mm, or −∞ if it is unknown."""
    of_tool = path.tool == tool
    z = path.end[of_tool & np.isin(path.kind, [int(k) for k in MOTIONS]), 2]
    bottoms = [path.cycles[ref].bottom for ref in path.ref[of_tool & (path.kind == Kind.DRILL)].tolist()]
    known = [*z[np.isfinite(z)].tolist(), *bottoms]
    return min(known, default=-math.inf)


def _tool_radii(program: Program, library: Mapping[int, Tool]) -> tuple[dict[int, float], list[int]]:
    """Return the radius of each tool, mm, and the numbers of the tools whose radius is unknown.

    The radius comes from the library. If the library does not contain the tool, the radius comes from a comment.
    """
    radii: dict[int, float] = {}
    unknown: list[int] = []
    kind = program.path.kind
    works = np.flatnonzero((kind >= Kind.FEED) & (kind <= Kind.DRILL))
    used = [(program.modal(block).tool or 0, block) for block in np.unique(program.row_block[works]).tolist()]
    for number, block in dict(reversed(used)).items():
        width = library[number].diameter if number in library else tool_diameter_in_comments(program, block)
        radii[number] = 0.5 * width
        if not width:
            unknown.append(number)
    return radii, sorted(unknown)
