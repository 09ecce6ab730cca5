"""Build the path of a cut with a given start: lead-in, contours, bridges, overcut, lead-out, and their speeds.

For a controller with kerf compensation (G41, G42), the program contains the contour as drawn, and lead arcs whose
radius is larger by half a kerf. Compensation starts on the straight run-in. LinuxCNC moves along a tangent to the
circle with a radius of half a kerf around the end of the run-in. The torch must start on this tangent.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline, joined
from leafcut.message import Message
from leafcut.model.cutting import Cut, CutChoice
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import CutMethod
from leafcut.processes.sheet.plan.contours import CORNER, ROUNDING, CutContour, corner_turns, flat_line, names_of
from leafcut.processes.sheet.plan.leads import FLATNESS
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import FEWEST_PLACES, CutStart, starts_of

#: Maximum distance between coincident points, mm.
SAME_PLACE = 1e-6
#: Minimum length of segments at a concave corner, in kerf widths; with shorter segments, the offset path crosses
#: itself.
SHORTEST_KERFS = 2.0
#: Minimum radius of concave arcs, in half kerf widths; a controller cannot compensate tighter arcs.
TIGHTEST = 1.05

#: A section of a path: distances of both ends from the start of the path, mm.
Span = tuple[float, float]
#: Names of the choices that a plan file fixes, by index of the contour.
Fixed = Mapping[int, tuple[str, ...]]


def make_cut(contours: Sequence[CutContour], start: CutStart, fixed: Fixed) -> Cut:
    """Return the cut of a single contour with the chosen start."""
    contour = contours[start.contour]
    rules, choice = contour.rules, plan_file_entry(contour, start, fixed.get(start.contour, ()))
    if rules.compensation == "controller" and contour.has_leads:
        path, begin = programmed_path(contour, start)
        return Cut(
            contours=(contour.index,),
            path=path,
            lead_in=begin,
            lead_out=path.length - contour.overcut,
            torch_off_at=path.length,
            speeds=((0.0, contour.feed),),
            choice=choice,
            pierce=start.pierce,
            part=contour.source.part,
            compensation=41 if contour.is_scrap_left(start.clockwise) else 42,
            small_hole=contour.is_small,
        )
    body, past = path_from_start(contour, start)
    closed = contour.path.closed
    lead_in = contour.lead_at(start.lead_in, start.at, start.clockwise) if closed or start.lead_in.length else None
    end = start.at - past if start.clockwise else start.at + past
    out = contour.lead_at(start.lead_out, end, start.clockwise, out=True) if closed else None
    whole = joined(*(without_tiny_segments(p) for p in (lead_in, body, out) if p is not None))
    begin = lead_in.length if lead_in is not None else 0.0
    leave, overcut = begin + body.length, max(past, 0.0)
    return Cut(
        contours=contour.indices,
        path=whole,
        lead_in=begin,
        lead_out=leave - overcut,
        torch_off_at=leave - overcut if rules.torch_off_in_overcut and overcut > 0.0 else whole.length,
        speeds=((0.0, contour.feed),),
        choice=choice,
        joints=joints_of(contour, start, begin),
        loops=loops_of(contour, start, begin),
        pierce=start.pierce and contour.kind == "cut",
        kind=contour.kind,
        part=contour.source.part,
        small_hole=contour.is_small,
        group=contour.group,
        common=contour.common,
    )


def make_chain(contours: Sequence[CutContour], start: CutStart, fixed: Fixed) -> Cut:
    """Return the cut of a chain: several contours with one pierce, connected by bridges through the scrap.

    Only the last contour has an overcut. The other contours end where they close, or earlier by a micro-joint.
    """
    steps = [start, *start.then]
    first, last = contours[start.contour], contours[steps[-1].contour]
    rules = first.rules
    pieces: list[Polyline] = []
    bridges: list[Span] = []
    joints: list[Span] = []
    loops: list[Span] = []
    lead_in = first.lead_at(start.lead_in, start.at, start.clockwise)
    at = lead = 0.0
    if lead_in is not None:
        pieces.append(lead_in)
        at = lead = lead_in.length
    past = 0.0
    for number, step in enumerate(steps):
        contour = contours[step.contour]
        body, past = path_from_start(contour, step, overcut=step is steps[-1])
        if number:
            bridge = Polyline.of_points([pieces[-1].end, body.start])
            pieces.append(bridge)
            bridges.append((at, at + bridge.length))
            at += bridge.length
        joints += joints_of(contour, step, at)
        loops += loops_of(contour, step, at)
        pieces.append(body)
        at += body.length
    overcut, end = max(past, 0.0), steps[-1]
    out = last.lead_at(end.lead_out, end.at + (-past if end.clockwise else past), end.clockwise, out=True)
    whole = joined(*(without_tiny_segments(p) for p in (*pieces, *([out] if out is not None else []))))
    choices = [plan_file_entry(contours[s.contour], s, fixed.get(s.contour, ())) for s in steps]
    return Cut(
        contours=tuple(contours[s.contour].index for s in steps),
        path=whole,
        lead_in=lead,
        lead_out=at - overcut,
        torch_off_at=at - overcut if rules.torch_off_in_overcut and overcut > 0.0 else whole.length,
        speeds=((0.0, rules.data.feed),),
        choice=choices[0],
        joints=tuple(joints),
        loops=tuple(loops),
        pierce=start.pierce,
        part=first.source.part,
        bridges=tuple(bridges),
        chained=tuple(replace(choice, lead_in=None, lead_out=None, bridge=True) for choice in choices[1:]),
    )


def chain_length(contours: Sequence[CutContour], start: CutStart) -> float:
    """Return the length of the path of a chain, mm, including micro-joints."""
    steps = [start, *start.then]
    places = [contours[s.contour].path.point_at(s.at) for s in steps]
    bridges = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
    bodies = sum(contours[s.contour].path.length for s in steps)
    overcut = contours[steps[-1].contour].overcut
    return bridges + bodies + start.lead_in.length + steps[-1].lead_out.length + overcut


def path_from_start(contour: CutContour, start: CutStart, *, overcut: bool = True) -> tuple[Polyline, float]:
    """Return the path of a contour from its start, and its overlap past the start, mm.

    The overlap is negative if a micro-joint remains.
    """
    path = contour.path
    if not path.closed:
        return (path.reversed() if start.clockwise else path), 0.0
    past = (contour.overcut if overcut else 0.0) - contour.closing_joint
    return _path_from(path, start.at, path.length + past, start.clockwise), past


def _path_from(path: Polyline, at: float, length: float, clockwise: bool) -> Polyline:
    if clockwise:
        return path.reversed().piece(path.length - at, path.length - at + length)
    return path.piece(at, at + length)


def without_tiny_segments(piece: Polyline) -> Polyline:
    """Remove tiny segments, which are caused by rounding errors, from an open path."""
    rows = piece.vertices
    step = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    keep = np.append(step > SAME_PLACE, True)
    return piece if keep.all() or keep.sum() < 2 else Polyline(rows[keep])


def plan_file_entry(contour: CutContour, start: CutStart, fixed: tuple[str, ...] = ()) -> CutChoice:
    """Return the entry of a start in a plan file."""
    x, y = contour.path.point_at(start.at)
    words = ("clockwise", "counter-clockwise") if contour.path.closed else ("backward", "forward")
    return CutChoice(
        contours=contour.indices,
        start=(round(x, 4), round(y, 4)),
        direction=words[0] if start.clockwise else words[1],
        lead_in=start.lead_in,
        lead_out=start.lead_out,
        fixed=fixed,
    )


def _distance_along_cut(contour: CutContour, start: CutStart, at: float) -> float:
    return (start.at - at if start.clockwise else at - start.at) % contour.path.length


def loops_of(contour: CutContour, start: CutStart, begin: float) -> tuple[Span, ...]:
    """Return the corner loops of a cut as sections of its path. The contour starts `begin` mm along this path."""
    spans = []
    for low, high in contour.loops:
        first = _distance_along_cut(contour, start, high if start.clockwise else low)
        spans.append((begin + first, begin + first + high - low))
    return tuple(sorted(spans))


def joints_of(contour: CutContour, start: CutStart, begin: float) -> tuple[Span, ...]:
    """Return the micro-joints of a laser cut as sections of its path, evenly spaced.

    The beam is off for the length of a joint plus a kerf. Joints keep away from corners, because they are hard to break
    and grind off there. They also keep away from the start and end of the cut, because the kerf would sever them.
    """
    rules = contour.rules
    wanted = contour.joints if rules.kind == CutMethod.LASER else 0
    length, off = contour.path.length, rules.joint_width + rules.kerf
    count = min(wanted, int(length / (4.0 * off)))
    room = 0.5 * off + rules.kerf
    taken = [
        (at - room, at + room)
        for at in (0.0, length, *(_distance_along_cut(contour, start, c) for c in contour.corners))
    ]
    taken += [(low - room, high + room) for low, high in loops_of(contour, start, 0.0)]
    spans = []
    for k in range(count):
        middle, reach = length * (k + 0.5) / count, 0.5 * (length / count - off)
        places = (middle, *(edge for span in taken for edge in span))
        free = [abs(at - middle) for at in places if not any(low < at < high for low, high in taken)]
        nearest = min(free, default=length)
        if nearest <= reach:
            at = next(at for at in places if abs(at - middle) == nearest) + begin
            spans.append((at - 0.5 * off, at + 0.5 * off))
    return tuple(spans)


# -- compensation by the controller ----------------------------------------------------------------------------------


def compensate_where_needed(contours: list[CutContour], scrap: Scrap) -> tuple[list[CutContour], list[Issue]]:
    """Return the contours, with compensation by the program where the controller cannot compensate the kerf, and a note
    about these contours.

    The controller cannot compensate if run-in and arc do not fit, as in small holes, if the radius of a concave arc is
    too small, or if a notch is narrower than the kerf.
    """
    made = [
        replace(c, rules=c.rules.compensated_by_program())
        if c.has_leads and not _controller_can_compensate(k, c, scrap)
        else c
        for k, c in enumerate(contours)
    ]
    own = [c for c in made if c.rules.compensation != "controller"]
    if not own:
        return made, []
    words = Message(
        "{} contours are compensated by the program for a kerf of {:g} mm: no room for a controller's lead-in, or a "
        "concave arc that is too tight for it",
        len(own),
        scrap.rules.kerf,
    )
    if len(own) == 1:
        words = Message(
            "1 contour is compensated by the program for a kerf of {:g} mm: no room for a controller's lead-in, or a "
            "concave arc that is too tight for it",
            scrap.rules.kerf,
        )
    return made, [Issue("L626", words, names_of(own), Severity.NOTE)]


def _controller_can_compensate(number: int, contour: CutContour, scrap: Scrap) -> bool:
    side, drawn, rules = 1.0 if contour.hole else -1.0, _drawn_path(contour), contour.rules
    arcs = [s for s in drawn.segments() if s.is_arc and s.bulge * side > 0.0]
    if contour.pinched or any(s.radius < rules.half * TIGHTEST for s in arcs):
        return False
    concave, lengths = side * np.asarray(corner_turns(drawn)) > CORNER, drawn.lengths
    if (concave & (np.minimum(lengths, np.roll(lengths, 1)) < SHORTEST_KERFS * rules.kerf)).any():
        return False
    return bool(starts_of(number, contour, scrap, FEWEST_PLACES))


def _drawn_path(contour: CutContour) -> Polyline:
    """Return the path of a contour as drawn, counter-clockwise."""
    path = contour.source.path
    return path if path.area >= 0.0 else path.reversed()


def programmed_path(contour: CutContour, start: CutStart) -> tuple[Polyline, float]:
    """Return the programmed path for a controller that compensates the kerf, and the length of its lead-in, mm.

    Raises PlanError if compensation cannot start there.
    """
    half, here, travel = (
        contour.rules.half,
        contour.path.point_at(start.at),
        contour.travel_at(start.at, start.clockwise),
    )
    side = 1.0 if contour.is_scrap_left(start.clockwise) else -1.0
    on = (here[0] + side * travel[1] * half, here[1] - side * travel[0] * half)
    drawn = _drawn_path(contour)
    line, point = flat_line(drawn), shapely.Point(*on)
    if shapely.distance(point, line) > ROUNDING + FLATNESS:
        raise PlanError(
            "{}: the controller's compensation cannot start at ({:.5g}, {:.5g})", contour.name(), on[0], on[1]
        )
    at = float(shapely.line_locate_point(line, point, normalized=True)) * drawn.length
    body = _path_from(drawn, at, drawn.length + contour.overcut, start.clockwise)
    wanted = contour.lead_at(start.lead_in, start.at, start.clockwise)
    if wanted is None:
        return body, 0.0
    radius = start.lead_in.length / start.lead_in.angle
    center = (here[0] - side * travel[1] * radius, here[1] + side * travel[0] * radius)
    lead = _widened_lead(wanted, center, radius + half, body.start)
    return joined(lead, body), lead.length


def _widened_lead(lead: Polyline, center: Point, radius: float, on: Point) -> Polyline:
    """Return a lead with the same first point and the same centre of its arc, but with another radius."""
    x, y = lead.vertices[1, :2].tolist()
    scale = radius / math.hypot(x - center[0], y - center[1])
    corner = (center[0] + scale * (x - center[0]), center[1] + scale * (y - center[1]))
    rows = [[*lead.start, 0.0], [*corner, float(lead.vertices[1, 2])], [*on, 0.0]]
    return Polyline(np.array(rows))
