"""Verify a complete program before it is released."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import ReadError
from leafcut.gcode.active_comments import is_active_comment
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.gcode.words import COMMENT, numbered_lines
from leafcut.message import Message
from leafcut.model.cutter import shank_and_holder_discs, tip_radius_and_discs
from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath
from leafcut.proof.clearance import check_clearance
from leafcut.proof.envelope import check_machine_limits
from leafcut.proof.read_back import compare_motion
from leafcut.units import MM_PER_INCH


def interpret_written_program(
    text: str, dialect: Dialect, material_feeds: Mapping[int, float] | None = None
) -> Toolpath:
    """Return the motion of a program as its controller would execute it, whatever modes another program left active.

    `material_feeds` contains the feeds of the controller's material table, mm/s, by number (`gcode.interpreter`).

    Raises
    ------
    ReadError
        The text is not a valid program for the controller, or a comment in it triggers an action of a controller.
    """
    _refuse_active_comments(text)
    return interpret_own_program(text, dialect, left_over=True, material_feeds=material_feeds)


def _refuse_active_comments(text: str) -> None:
    """Refuse comments that a controller acts on. Such a comment can only come from a name in the header."""
    for number, line in numbered_lines(text):
        if "(" not in line and ";" not in line:
            continue
        comments = [found.strip("(;) \t") for found in COMMENT.findall(line)]
        obeyed = next(filter(is_active_comment, comments), None)
        if obeyed is not None:
            raise ReadError(
                "program",
                Message("a controller would execute the comment '{}'; rename the item in this comment", obeyed[:60]),
                number,
            )


def max_rounding_error(dialect: Dialect, units: str) -> float:
    """Return the maximum rounding error of a position, mm. `units` are the units of the program, mm or inch."""
    half = 0.5 * 10.0**-dialect.decimals_mm
    if units == "inch":
        half = 0.5 * MM_PER_INCH * 10.0**-dialect.decimals_inch
    return half * 1.001 + 1e-9


def check_program(
    planned: Toolpath,
    written: Toolpath,
    dialect: Dialect,
    machine: Machine,
    units: str,
    *,
    zones: NDArray[np.float64] | None = None,
    zone_height: ArrayLike = math.inf,
    tools: Sequence[Tool] = (),
    milled: bool = False,
    tops: NDArray[np.float64] | None = None,
    surface: NDArray[np.float64] | None = None,
    surface_z: float = 0.0,
) -> list[Difference]:
    """Return all errors of a program. Without errors, the program is verified.

    `written` is the motion from `interpret_written_program`. The program must match the planned toolpath. If the
    controller has no cycles, they are expanded before the comparison. The program must also stay inside the travel of
    the machine, above the workpiece, and at or above the height of the keep-out zones. Parts of a tool above its flutes
    must stay clear of the zones, too. At a zone, a spot drill is as wide as its cone
    (`model.cutter.tip_radius_and_discs`).

    Parameters
    ----------
    units
        Units of the program, mm or inch. Positions may differ by half of the last decimal.
    zone_height
        Minimum height at the keep-out zones, mm: a single value for all zones, or float64[k].
    tools
        The tools of the program.
    milled
        Whether `processes.pocket.proof.pocket` checks the rapids below the surface instead.
    tops
        Positions and heights of holes that start at different heights, float64[n, 3].
    surface
        Triangles of an uneven surface, float64[n, 3, 3]. Every rapid must stay clear of them. The parts of a tool above
        its flutes must stay clear of them in every move (`check_surface`).
    surface_z
        Height of a flat surface, mm.
    """
    differences = compare_motion(
        expand_cycles(planned, keep=dialect.cycles),
        written,
        max_rounding_error(dialect, units),
        offsets=bool(dialect.length_offset),
    )
    if differences:
        return differences
    differences = [
        *check_machine_limits(written, machine),
        *check_clearance(
            written,
            surface_z=surface_z,
            safe_z=machine.safe_z or 0.0,
            torch=machine.head is not Head.SPINDLE,
            milled=milled,
            tops=tops,
            level=surface is None,
        ),
    ]
    dogleg, bodies = machine.rapid_style == "dogleg", {tool.number: shank_and_holder_discs(tool) for tool in tools}
    if surface is not None:
        from leafcut.proof.surface import check_surface  # loads GEOS slowly, and most plates are flat

        radii = {tool.number: 0.5 * tool.diameter for tool in tools}
        differences += check_surface(written, surface, radii, bodies, dogleg=dogleg)
    if zones is not None and zones.size:
        from leafcut.proof.obstacles import check_obstacles  # loads GEOS slowly, and most tables are empty

        flutes = {tool.number: tip_radius_and_discs(tool) for tool in tools}
        differences += check_obstacles(
            written,
            zones,
            zone_height,
            tool_radii={number: radius for number, (radius, _) in flutes.items()},
            bodies={number: [*discs, *bodies[number]] for number, (_, discs) in flutes.items()},
            safe_z=machine.safe_z or 0.0,
            dogleg=dogleg,
        )
    return differences
