"""Collect the copper that is isolated, with the width of the groove that its tool cuts."""

from __future__ import annotations

from collections.abc import Sequence

import shapely

from leafcut.errors import PlanError, count_of
from leafcut.message import Message
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.tool import CONES, Tool, ToolKind
from leafcut.processes.part.model import CHORD, Isolation
from leafcut.processes.part.operations import LayeredPart, open_shape
from leafcut.processes.part.plan.chamfers import v_bit
from leafcut.processes.part.plan.isolation import narrow_gaps
from leafcut.processes.part.plan.task import Mill
from leafcut.read.operations import LayerRule, Operation

#: Minimum radius of a groove, mm. The verification locates a cut with an accuracy of 0.01 mm.
_NARROWEST = 0.03


def isolations_of(divided: LayeredPart, mills: Sequence[Mill]) -> tuple[list[Isolation], list[Issue]]:
    """Return the copper to isolate, and an issue about gaps that are narrower than the tool.

    The last of `mills` is the end mill of the part, which isolates the layers that name no tool.

    Raises
    ------
    PlanError
        The drawing is no circuit board, or two rules isolate copper: a groove of one layer could cut the copper of the
        other. A shape is open, or the tool is neither an end mill nor a V-bit, or its width at the depth is unknown or
        too small.
    """
    faces = divided.faces_of(Operation.ISOLATE)
    if not faces:
        return [], []
    (rule, contours), *others = faces
    if divided.edges.format != "gerber":
        raise PlanError(
            "{}: 'isolate' is only for circuit boards in Gerber files; use 'engrave' or 'pocket'", rule.place
        )
    if others:
        raise PlanError("{}: only one layer can be isolated; leave one out", others[0][0].place)
    tool = next(one.data.tool for one in mills if one.data.tool.number == (rule.tool or mills[-1].data.tool.number))
    radius = _groove_radius(rule, tool)
    rings = []
    for contour in contours:
        if not contour.path.closed:
            raise open_shape(rule, contour)
        rings.append(shapely.LinearRing(contour.path.flattened(CHORD)))
    # Shapes inside a shape are openings in the copper.
    copper = shapely.build_area(shapely.GeometryCollection(rings))
    isolation = Isolation(copper, rule.depth, tool.number, round(radius, 6), rule.passes, contours[0].layer)
    places = narrow_gaps(isolation)
    if not places:
        return [isolation], []
    words = Message(
        "{} of copper narrower than the groove of {}, {:.3g} mm, not isolated",
        count_of(len(places), "gap"),
        tool.label,
        2.0 * radius,
    )
    where = Message("the first at ({:.4g}, {:.4g}): use a finer tool or a smaller depth", *places[0])
    return [isolation], [Issue("L707", words, where, missing=MissingWork("gap", len(places), tuple(places)))]


def _groove_radius(rule: LayerRule, tool: Tool) -> float:
    """Return half the width of a groove at the top of the plate, mm."""
    if tool.kind not in (ToolKind.END_MILL, *CONES):
        raise PlanError("{}: {} is neither an end mill nor a V-bit", rule.place, tool.label)
    radius = 0.5 * tool.diameter
    if tool.kind in CONES:
        if not tool.tip_diameter:
            raise PlanError(
                "{}: {} needs its tip_diameter in the library, so that its groove has a known width",
                rule.place,
                tool.label,
            )
        bit = v_bit(tool)
        radius = bit.tip + rule.depth * bit.spread
        if radius > bit.radius:
            raise PlanError("{}: {} is too narrow to cut {:g} mm deep", rule.place, tool.label, rule.depth)
    if radius < _NARROWEST:
        raise PlanError(
            "{}: {} cuts a groove of {:.3g} mm at this depth, which is too narrow to be verified; give a larger depth",
            rule.place,
            tool.label,
            2.0 * radius,
        )
    return radius
