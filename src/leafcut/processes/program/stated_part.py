"""Identify the part that the header of a program names, and derive the stock before the program from this part."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from leafcut.gcode.program import Program
from leafcut.material.height_field import HeightField
from leafcut.material.straight_moves import StraightMoves
from leafcut.model.cutter import Cutter
from leafcut.model.heartbeat import Heartbeat
from leafcut.model.mesh import Mesh
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.processes.placing import place_mesh, turn_mesh_up

#: The header is expected within this number of lines at the top.
_FIRST_LINES = 60
_STATED = re.compile(
    r"\bpart: (?P<name>.+?)(?:, (?P<up>-?[xyz]) up)?(?:, Z0 at Z(?P<z>-?[\d.]+) mm)?"
    r"(?:, zero at X(?P<x>-?[\d.]+) Y(?P<y>-?[\d.]+) mm)?(?:, mirrored (?P<mirror>[xy]))?"
    r"(?:, turned (?P<turn>-?[\d.]+) deg)?\s*\)?\s*$",
    re.IGNORECASE,
)
#: The two lines of the leafcut header that precede the line with the name of the part.
_OURS, _SOURCE = re.compile(r"\bleafcut \d", re.IGNORECASE), re.compile(r"\bsource: ", re.IGNORECASE)


@dataclass(frozen=True)
class StatedPart:
    """The part named in the header of a program, and its placement.

    The part is turned so that its axis `up` points up, and moved so that its height `z` (mm) becomes Z0. Then `placing`
    is applied.
    """

    name: str
    placing: ReadOptions
    up: str = "z"
    z: float = 0.0


def stated_part(program: Program) -> StatedPart | None:
    """Return the part that the header of a program names, or None.

    Only headers written by leafcut count, not those written by other CAM systems.
    """
    header = list(program.lines[:_FIRST_LINES])
    for before, source, line in zip(header, header[1:], header[2:], strict=False):
        found = _STATED.search(line.strip())
        if found and _OURS.search(before) and _SOURCE.search(source):
            x, y = float(found["x"] or 0.0), float(found["y"] or 0.0)
            turn = math.radians(float(found["turn"] or 0.0))
            mirror = found["mirror"] and found["mirror"].lower()
            placing = ReadOptions(mirror=mirror, rotate=turn, origin=(x, y))
            return StatedPart(found["name"], placing, (found["up"] or "z").lower(), float(found["z"] or 0.0))
    return None


def place_part_as_stated(mesh: Mesh, stated: StatedPart | None) -> Mesh:
    """Move the part to its place in program coordinates. Without a stated placement, the part does not move."""
    if stated is None:
        return mesh
    return place_mesh(turn_mesh_up(mesh, stated.up, stated.z), Part(mesh.name), stated.placing)


def stock_before_cuts(
    mesh: Mesh, cell: float, moves: StraightMoves, cutters: Mapping[int, Cutter], check_cancelled: Heartbeat
) -> HeightField:
    """Derive the stock before the cuts of a program from the finished part. `cell` is the side length of a cell, mm.

    Drilled holes are filled up to the surrounding surface. Milled areas are filled up to the highest point of the part.

    Raises
    ------
    PlanError
        The height field would have too many cells.
    """
    from leafcut.material.cutting import simulate_cutting
    from leafcut.material.mesh_field import bounding_block, mesh_to_height_field

    field = mesh_to_height_field(mesh, cell)
    fed = ~moves.rapid & np.isin(moves.tool, list(cutters))
    across = np.hypot(*(moves.ends[:, 3:5] - moves.ends[:, :2]).T) > 0.0
    mills = {number: cutters[number] for number in set(moves.tool[fed & across].tolist())}
    if mills:
        block = HeightField.of_block(bounding_block(mesh), cell)
        top = block.heights.copy()
        simulate_cutting(block, moves.of_tools(mills), mills, os.cpu_count() or 1, check_cancelled)
        milled = block.heights < top
        field.heights[milled] = top[milled]
    holes = fed & ~across & ~np.isin(moves.tool, list(mills))
    rows = np.column_stack([moves.ends[holes, 3:5], moves.tool[holes]])
    for x, y, number in np.unique(rows, axis=0).tolist():
        _fill_hole(field, x, y, cutters[int(number)].radius)
    return field


def _fill_hole(field: HeightField, x: float, y: float, radius: float) -> None:
    """Fill a round hole up to the median height of its rim."""
    edge, reach = radius + 0.5 * field.cell, radius + 2.0 * field.cell
    heights, away = field.heights_around(x, y, reach)
    rim, inside = (away > edge) & (away <= reach), away <= edge
    if rim.any():
        heights[inside] = np.maximum(heights[inside], np.median(heights[rim]))
