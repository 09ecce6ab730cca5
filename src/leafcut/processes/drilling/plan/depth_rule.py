"""Depth of each tool in a hole. It follows from the thickness of the plate, or from a given depth of the shoulder or of
the tip.
"""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.errors import OptionError, PlanError
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.model.tool import Tool, ToolKind
from leafcut.options import JobOptions
from leafcut.processes.drilling.options import DrillOptions

#: Default depth of a centre drill, relative to its diameter: its cone then centres the drill.
CENTRE_DEPTH_RATIO = 0.4

#: Length of the tapered lead of a tap, in pitches: 3.5 to 5 for a plug tap (DIN 2197, form B).
TAP_LEAD = 5.0


@dataclass(frozen=True)
class DepthRule:
    """The depth of holes, mm below the surface.

    If `through`, the full diameter of the tool goes `break_through` mm below the plate, and its point goes even deeper.
    """

    depth: float
    through: bool
    to_shoulder: bool
    break_through: float
    thickness: float | None = None

    @property
    def given(self) -> str:
        """The option that sets the depth, as part of a message, for example `` for --thickness 80 mm``."""
        return f" for {'--thickness' if self.through else '--depth'} {self.depth:g} mm"

    def tip_depth(self, tool: Tool) -> float:
        """Return the depth of the tip of `tool` below the surface, mm.

        Raises PlanError if a tap or a reamer would hit the cone that the point of the drill leaves, or if a blind hole
        would break through.
        """
        if tool.kind is ToolKind.CENTRE_DRILL:
            return centre_depth(tool)
        if self.through:
            return self.depth + self.break_through + tool.point_length
        if tool.kind in (ToolKind.TAP, ToolKind.REAMER) and not self.to_shoulder:
            raise PlanError(
                "{} would break at the bottom: the drill before it reaches {:g} mm with its tip "
                "only; give --thickness, or --depth with --depth-to shoulder",
                tool.label,
                self.depth,
            )
        tip = self.depth + (tool.point_length if self.to_shoulder else 0.0)
        if self.thickness is not None and self.depth < self.thickness < tip:
            raise PlanError(
                "a hole of --depth {:g} mm in a plate of {:g} mm is blind, but the tip of "
                "{} would go {:.3g} mm deep; use a smaller --depth or --depth-to tip, or leave --depth "
                "out for through holes",
                self.depth,
                self.thickness,
                tool.label,
                tip,
            )
        return tip


def centre_depth(tool: Tool) -> float:
    """Return the depth of the tip of a centre drill below the surface, mm.

    This is the depth stated for the tool, or else a share of the diameter.
    """
    return tool.depth if tool.depth is not None else CENTRE_DEPTH_RATIO * tool.diameter


def tap_lead_issue(tool: Tool, rule: DepthRule) -> Issue | None:
    """Return a note if the lead of the tap leaves incomplete threads at the exit of a through hole.

    The tap is not sent deeper automatically, because the space below is unknown, and a tap that hits the table breaks.
    """
    lead = TAP_LEAD * tool.pitch if tool.pitch else 0.0
    if not rule.through or rule.break_through >= lead:
        return None
    return Issue(
        "L402",
        Message(
            "{} ends {:g} mm below the plate, but its tapered lead may be {:g} mm long: for a full thread at "
            "the exit, set a larger --break-through if there is room below the plate",
            tool.label,
            rule.break_through,
            lead,
        ),
        severity=Severity.NOTE,
    )


def refuse_unknown_depth(part: Part, job: JobOptions) -> None:
    """Raise `OptionError` for a part if neither the options nor its drawing state the depth of the holes."""
    if job.depth is None and job.thickness is None and not part.has_hole_depths:
        raise OptionError(
            "{}: drilling needs a depth; give --thickness 6mm (through holes), --depth 5mm (blind holes), or "
            "--depth 1mm --depth-to tip (spots only)",
            part.name,
        )


def depth_rule(job: JobOptions, options: DrillOptions) -> DepthRule:
    """Return the depth rule that follows from the options. Raises PlanError if depth and thickness contradict each
    other.
    """
    to_shoulder = options.depth_to == "shoulder"
    depth = job.blind_depth
    if depth is None:
        assert job.thickness is not None
        return DepthRule(job.thickness, True, to_shoulder, job.break_through)
    if job.thickness is not None and depth > job.thickness:
        raise PlanError(
            "--depth {:g} mm is more than --thickness {:g} mm; leave --depth out for through holes",
            depth,
            job.thickness,
        )
    return DepthRule(depth, False, to_shoulder, 0.0, job.thickness)
