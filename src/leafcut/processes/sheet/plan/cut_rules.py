"""The rules for cutting a sheet.

They come from the user's options, with defaults that depend on the cutting process.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from leafcut.errors import OptionError
from leafcut.model.cutting import CutData, Lead
from leafcut.model.kinds import CutMethod, first_word_of_process
from leafcut.processes.sheet.options import CutOptions

#: Minimum length of a lead-in, mm. The values for plasma and oxyfuel are from a table of lead-ins by lapas.io. The
#: others are estimates that keep the pierce mark off the part.
SHORTEST_LEAD_IN: dict[str, float] = {
    CutMethod.PLASMA: 6.0,
    CutMethod.OXYFUEL: 15.0,
    CutMethod.LASER: 2.0,
    CutMethod.WATERJET: 2.0,
}
#: Length of a lead-in, in kerf widths (LightBurn forum: 1.5 to 3 for a laser). The methods in `THICK_LEAD_IN` use the
#: thickness of the sheet instead (note by Hypertherm).
KERFS_OF_LEAD_IN = 3.0
THICK_LEAD_IN = (CutMethod.PLASMA, CutMethod.OXYFUEL)
#: Minimum length of a lead-out, mm (MultiCAM: 6 to 12 mm for outlines).
SHORTEST_LEAD_OUT = 6.0
#: Defaults of LinuxCNC QtPlasmaC for holes: the overcut, mm, and the diameter below which a hole is cut slowly, mm.
HOLE_OVERCUT = 4.0
SMALL_HOLE = 32.0
#: Speed in small holes, percent of the cutting speed (QtPlasmaC's default).
SMALL_HOLE_SPEED = 60.0
#: Angle between a straight lead and the contour, or angle of an arc, rad.
LEAD_ANGLE = 0.5 * math.pi
#: Maximum angle of a corner that gets a loop, rad.
LOOP_ANGLE = math.radians(100.0)
#: Marking speed, mm/s (2500 mm/min). This is an estimate for scribes, and for lasers at a fifth of their power. The
#: cutting speeds in the chart do not suit marks: they are too high for a scribe on thin sheets, and too low for a beam
#: on thick sheets.
MARK_FEED = 2500.0 / 60.0
#: Minimum ratio of diameter to thickness for a plasma hole. Smaller holes come out conical (plasma primer in the
#: documentation of QtPlasmaC).
NARROWEST_HOLE = 1.5


@dataclass(frozen=True)
class CutRules:
    """The rules for cutting a sheet, in mm, s, mm/s and rad. Individual contours may get shorter leads.

    Attributes
    ----------
    kind
        Cutting method, a `CutMethod`.
    data
        Row of the cut chart.
    half
        Distance between the torch path and the part: half a kerf, or 0 without compensation.
    outline_direction
        ``clockwise``, ``counter-clockwise`` or ``free``. Holes are cut in the opposite direction.
    once
        Whether coincident edges are cut only once even if the user did not ask for common lines. This is the case if
        the kerf is not compensated.
    """

    kind: str
    data: CutData
    half: float
    outline_direction: str
    lead_in: Lead
    lead_out: Lead
    hole_lead_out: bool
    hole_overcut: float
    overcut: float
    torch_off_in_overcut: bool
    small_hole: float
    small_hole_feed: float
    mark_feed: float
    loops: bool
    loop_length: float
    joints: int
    joint_width: float
    edge_start: bool
    compensation: str
    common_lines: bool = False
    once: bool = False

    def feed_of(self, kind: str, *, small: bool) -> float:
        """Return the speed for a contour of the kind ``cut`` or ``mark``, mm/s. Small holes are cut more slowly."""
        if kind == "mark":
            return self.mark_feed
        return self.small_hole_feed if small else self.data.feed

    def with_program_compensation(self) -> CutRules:
        """Return the rules for a contour whose kerf the program must compensate because the controller cannot."""
        return replace(self, compensation="geometry", lead_in=replace(self.lead_in, run_in=0.0))

    @property
    def kerf(self) -> float:
        """Width of the cut, mm."""
        return self.data.kerf

    def cut_direction(self, hole: bool) -> str:
        """Return the direction in which holes or outlines are cut: ``clockwise``, ``counter-clockwise`` or ``free``."""
        if self.outline_direction == "free" or not hole:
            return self.outline_direction
        return "clockwise" if self.outline_direction == "counter-clockwise" else "counter-clockwise"


def resolve_rules(
    data: CutData, options: CutOptions, *, switches: bool = False, max_feed: float = math.inf, planned: bool = False
) -> CutRules:
    """Derive the cutting rules of a sheet from its options. Raises OptionError if two options exclude each other.

    Parameters
    ----------
    switches
        Whether the controller can switch the torch off while it moves. If it cannot, a plasma cut ends where it closes,
        without an overcut.
    max_feed
        Maximum feed of the machine, mm/s, which limits the default marking speed.
    planned
        Whether the user gave a plan file.
    """
    kind = first_word_of_process(data.process)
    hot = kind in THICK_LEAD_IN
    _check_options(kind, options, data, planned)
    length = options.lead_in_length
    if length is None:
        length = max(SHORTEST_LEAD_IN.get(kind, 2.0), data.thickness if hot else KERFS_OF_LEAD_IN * data.kerf)
    style = options.lead_in if options.lead_in != "auto" else ("arc" if hot else "line")
    # G41 and G42 start on a straight run-in, followed by an arc tangent to the contour. During compensation, torch and
    # height control are not switched (LinuxCNC: M62 to M68 are invalid under compensation).
    by_controller = options.compensation == "controller"
    style = "arc" if by_controller else style
    out = options.lead_out if options.lead_out != "auto" else (style if hot else "none")
    out = "none" if by_controller else out
    overcut = options.overcut if kind != CutMethod.PLASMA or (switches and not by_controller) else 0.0
    direction = options.direction if options.direction != "auto" else ("clockwise" if hot else "free")
    return CutRules(
        kind=kind,
        data=data,
        half=0.0 if options.compensation == "none" else 0.5 * data.kerf,
        outline_direction=direction,
        lead_in=Lead(style, length if style != "none" else 0.0, LEAD_ANGLE, 2.0 * data.kerf if by_controller else 0.0),
        lead_out=_lead_out(out, length),
        hole_lead_out=options.lead_out not in ("auto", "none"),
        hole_overcut=overcut if overcut is not None else (HOLE_OVERCUT if kind == CutMethod.PLASMA else 0.0),
        overcut=overcut or 0.0,
        torch_off_in_overcut=kind == CutMethod.PLASMA,
        small_hole=options.small_hole
        if options.small_hole is not None
        else (SMALL_HOLE if kind == CutMethod.PLASMA else 0.0),
        small_hole_feed=data.feed * SMALL_HOLE_SPEED / 100.0,
        mark_feed=options.mark_speed if options.mark_speed is not None else min(MARK_FEED, max_feed),
        loops=options.corner_loops,
        loop_length=0.5 * length,
        joints=options.micro_joints,
        joint_width=options.joint_width,
        edge_start=not data.can_pierce,
        compensation=options.compensation,
        common_lines=options.common_lines,
        once=options.compensation == "none" and not options_excluding_common_lines(options, data, planned),
    )


def _lead_out(style: str, length: float) -> Lead:
    if style == "none":
        return Lead("none", 0.0, LEAD_ANGLE)
    return Lead(style, max(SHORTEST_LEAD_OUT, length), LEAD_ANGLE)


def _check_options(kind: str, options: CutOptions, data: CutData, planned: bool) -> None:
    if options.micro_joints > 1 and kind != CutMethod.LASER:
        raise OptionError(
            "--micro-joints {}: only a laser can be switched off and on in motion; a {} cut "
            "can have one joint, at its end: use --micro-joints 1",
            options.micro_joints,
            kind,
        )
    if options.chains and options.heat_distance > 0.0:
        raise OptionError(
            "--chains: each contour of a chain starts next to the previous one, in hot metal; leave out "
            "--heat-distance, or --chains"
        )
    if options.common_lines:
        _check_common_lines(options, data, planned)
    if options.compensation == "controller":
        if options.chains:
            raise OptionError(
                "--chains: the controller cannot compensate a bridge from contour to contour; use --compensation "
                "geometry"
            )
        if options.corner_loops or options.micro_joints:
            raise OptionError(
                "--compensation controller: corner loops and micro-joints need a path that the program compensates; "
                "use --compensation geometry"
            )
        if options.lead_in == "none":
            raise OptionError("--compensation controller: G41 and G42 start on a lead-in; give --lead-in line")
        if not data.can_pierce:
            raise OptionError("--compensation controller: starts at the edge need --compensation geometry")


def options_excluding_common_lines(options: CutOptions, data: CutData, planned: bool) -> list[str]:
    """Return the names of the options and settings in use that rule out common lines."""
    given = {
        "--chains": options.chains,
        "--plan": planned,
        "--save-plan": bool(options.save_plan),
        "--corner-loops": options.corner_loops,
        "--micro-joints": options.micro_joints > 0,
        "--heat-distance": options.heat_distance > 0.0,
        "--compensation controller": options.compensation == "controller",
        "starts at the sheet's edge": not data.can_pierce,
    }
    return [name for name, is_given in given.items() if is_given]


def _check_common_lines(options: CutOptions, data: CutData, planned: bool) -> None:
    wrong = options_excluding_common_lines(options, data, planned)
    if wrong:
        raise OptionError("--common-lines cannot be combined with {}; leave out one of them", " and ".join(wrong))
