"""Collect the shapes to carve, and check that the V-bit is long and wide enough for them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from leafcut.errors import PlanError, count_of
from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.model.tool import Tool
from leafcut.options import Settings
from leafcut.processes.part.clearing import drawn_areas, pocket_mills, refuse_overlap
from leafcut.processes.part.model import Carving, PocketArea
from leafcut.processes.part.operations import LayeredPart
from leafcut.processes.part.plan.carving import carving_axis, floor_areas, floor_passes
from leafcut.processes.part.plan.chamfers import v_bit
from leafcut.processes.part.plan.outlines import missing_paths
from leafcut.processes.part.plan.pockets import PocketTask
from leafcut.processes.part.plan.rest import cleared_floor
from leafcut.processes.part.plan.task import Mill
from leafcut.read.operations import LayerRule, Operation

#: Minimum thickness of the plate below a carved shape, mm.
_SKIN = 0.1
#: Minimum radius of a place that is reported because it is narrower than the tip, in radii of the tip. Remainders in
#: corners are smaller.
_NARROW = 0.5


def carvings_of(
    divided: LayeredPart, settings: Settings, mills: Sequence[Mill], pockets: Sequence[PocketArea], thickness: float
) -> tuple[list[Carving], list[list[Floats]], list[Issue]]:
    """Return the shapes to carve, the paths of the tip in each shape, and issues.

    `mills` contains the V-bits, and the end mills that clear floors. The paths do not include the floors.

    Raises
    ------
    PlanError, ReadError
        An outline is open, or it crosses another outline. A shape overlaps another shape or a pocket. A shape is too
        wide or too narrow for its V-bit. An end mill fits into no floor.
    """
    tools, flats = {mill.data.tool.number: mill.data.tool for mill in mills}, pocket_mills(mills)
    carvings: list[Carving] = []
    axes: list[list[Floats]] = []
    issues: list[Issue] = []
    narrow: list[PocketArea] = []
    for rule, contours in divided.faces_of(Operation.VCARVE):
        tool, first = tools[rule.tool or 0], len(carvings)
        bit, flat = v_bit(tool), None if rule.flat is None else flats[rule.flat]
        for drawn in drawn_areas(rule, contours, settings, issues):
            name = Message("the shape at ({:.4g}, {:.4g}) on layer {}", *drawn.outline.start, drawn.layer)
            area = replace(drawn, name=name)
            refuse_overlap(rule, area, [*pockets, *(carving.area for carving in carvings)])
            axis = carving_axis(area.region, bit, rule.depth if flat else math.inf)
            if not axis:
                raise PlanError("{}: {} is narrower than the tip of {}", rule.place, name, tool.label)
            wide = area.region.buffer(-bit.tip).buffer(bit.tip)
            if bit.tip and not (area.region - wide).buffer(-_NARROW * bit.tip).is_empty:
                narrow.append(area)
            deepest = -min(float(branch[:, 2].min()) for branch in axis)
            limit = _limit(rule, name, deepest, tool, thickness)
            floors = floor_areas(area, bit, rule.depth, flat) if flat else ()
            carvings.append(Carving(replace(area, depth=round(deepest, 6)), bit, limit, flat, floors))
            axes.append(axis)
        if flat and not any(carving.floors for carving in carvings[first:]):
            raise PlanError(
                "{}: no shape has room for {} at a depth of {:g} mm; name a smaller mill after 'flat', or give a "
                "smaller depth",
                rule.place,
                tools[flat.tool].label,
                rule.depth,
            )
    if narrow:
        words = Message(
            "{} with places narrower than the tip of the V-bit, not carved there", count_of(len(narrow), "shape")
        )
        where = Message("the first at ({:.4g}, {:.4g}): use a sharper V-bit", *narrow[0].outline.start)
        missing = missing_paths("shape", [area.outline for area in narrow])
        issues.append(Issue("L707", words, where, missing=missing))
    return carvings, axes, issues


def with_floor_passes(
    carvings: Sequence[Carving], axes: Sequence[Sequence[Floats]], pockets: Mapping[int, Sequence[PocketTask]]
) -> list[tuple[Carving, list[Floats]]]:
    """Return each shape with the paths of its V-bit, which clear the places that the end mill leaves on its floor.

    `pockets` contains the tasks of each end mill, by tool number.
    """
    carved = []
    for carving, axis in zip(carvings, axes, strict=True):
        passes: list[Floats] = []
        if carving.flat is not None:
            own = (task.clearing for task in pockets[carving.flat.tool] if task.pocket in carving.floors)
            passes = floor_passes(carving, cleared_floor(own))
        carved.append((carving, [*axis, *passes]))
    return carved


def _limit(rule: LayerRule, name: str, deepest: float, tool: Tool, thickness: float) -> float:
    """Return the maximum depth, mm. Raises PlanError if the shape is deeper."""
    bit = v_bit(tool)
    limits = [
        (thickness - _SKIN, Message("the plate")),
        (tool.reach, Message("the length of {}", tool.label)),
        ((bit.radius - bit.tip) / bit.spread, Message("the diameter of {}", tool.label)),
        *([(rule.depth, Message("the file"))] if rule.depth else []),
    ]
    limit, reason = min(limits, key=lambda pair: pair[0])
    if deepest > limit + 1e-6 and rule.flat:
        raise PlanError(
            "{}: {} is carved {:.4g} mm deep, but {} allows at most {:.4g} mm; give a smaller depth, or use another "
            "V-bit",
            rule.place,
            name,
            deepest,
            reason,
            limit,
        )
    if deepest > limit + 1e-6:
        raise PlanError(
            "{}: {} is {:.4g} mm wide, so its carving is {:.4g} mm deep, but {} allows at most {:.4g} mm; use a V-bit "
            "with a larger angle or diameter, give a larger depth, add an end mill for a flat floor, as in 'vcarve 2mm "
            "T6 flat T5', or use 'pocket'",
            rule.place,
            name,
            2.0 * (bit.tip + deepest * bit.spread),
            deepest,
            reason,
            limit,
        )
    return limit
