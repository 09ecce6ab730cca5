"""How deep a tool goes: from the plate's thickness or a given depth, to the shoulder or to the tip."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.errors import PlanError
from leafcut.model.issue import Issue, Severity
from leafcut.model.tool import Tool, ToolKind
from leafcut.options import JobOptions
from leafcut.processes.drilling.options import DrillOptions

#: A hole is spotted this deep when nobody said how deep holes are: it marks the place and harms nothing.
SPOT_DEPTH = 1.0

#: A centre drill goes this part of its diameter deep when the library does not say (the cone of a spot for the drill).
CENTRE_DEPTH_RATIO = 0.4

#: A tap cuts full threads only behind its lead; of a plug tap that is 3.5 to 5 pitches long (DIN 2197, form B).
TAP_LEAD = 5.0


@dataclass(frozen=True)
class DepthRule:
    """The depth that holes are given, mm below the surface.

    `through` means that the full diameter goes through the plate and `break_through` further, so a tool's point hangs
    below by its own length.
    """

    depth: float
    through: bool
    to_shoulder: bool
    break_through: float
    thickness: float | None = None
    issues: tuple[Issue, ...] = ()

    @property
    def given(self) -> str:
        """What a person gave, for a message that the depth is too much: `` for --thickness 80 mm``."""
        return f" for {'--thickness' if self.through else '--depth'} {self.depth:g} mm"

    def tip_depth(self, tool: Tool) -> float:
        """Return how far the tip of `tool` goes below the surface, mm.

        Raises
        ------
        PlanError
            A tap or a reamer would meet the cone that a drill's point leaves, or a blind hole would not stay blind.
        """
        if tool.kind is ToolKind.CENTRE_DRILL:
            return centre_depth(tool)
        if self.through:
            return self.depth + self.break_through + tool.point_length
        if tool.kind in (ToolKind.TAP, ToolKind.REAMER) and not self.to_shoulder:
            raise PlanError(
                f"{tool.label} would break at the bottom: the drill before it reaches {self.depth:g} mm with its tip "
                "only; give --thickness, or --depth with --depth-to shoulder"
            )
        tip = self.depth + (tool.point_length if self.to_shoulder else 0.0)
        if self.thickness is not None and self.depth < self.thickness < tip:
            raise PlanError(
                f"a hole of --depth {self.depth:g} mm in a plate of {self.thickness:g} mm is blind, but the tip of "
                f"{tool.label} would go {tip:.3g} mm deep; use a smaller --depth or --depth-to tip, or leave --depth "
                "out for through holes"
            )
        return tip


def centre_depth(tool: Tool) -> float:
    """Return how far the tip of a centre drill goes below the surface, mm."""
    return tool.depth if tool.depth is not None else CENTRE_DEPTH_RATIO * tool.diameter


def tap_lead_issue(tool: Tool, rule: DepthRule) -> Issue | None:
    """Return a note when a through hole's thread will not be full at its far side, for the lead of the tap.

    The tap is not sent deeper for it: what lies below the plate is not known, and a tap that meets the table breaks.
    """
    lead = TAP_LEAD * tool.pitch if tool.pitch else 0.0
    if not rule.through or rule.break_through >= lead:
        return None
    return Issue(
        "L402",
        f"{tool.label} goes {rule.break_through:g} mm below the plate, and its lead may be {lead:g} mm long: for a "
        "full thread at the exit give --break-through, if there is room below",
        severity=Severity.NOTE,
    )


def depth_rule(job: JobOptions, options: DrillOptions) -> DepthRule:
    """Return the rule that the options state.

    Raises
    ------
    PlanError
        A depth and a thickness that contradict each other.
    """
    to_shoulder = options.depth_to == "shoulder"
    if job.thickness is None and job.depth is None:
        note = Issue(
            "L402",
            f"no depth given: holes are only spotted, {SPOT_DEPTH:g} mm deep; give --thickness or --depth",
        )
        return DepthRule(SPOT_DEPTH, False, False, 0.0, issues=(note,))
    if job.depth is None:
        assert job.thickness is not None
        return DepthRule(job.thickness, True, to_shoulder, job.break_through)
    if job.thickness is not None and job.depth > job.thickness:
        raise PlanError(
            f"--depth {job.depth:g} mm is more than --thickness {job.thickness:g} mm; "
            "leave --depth out for through holes"
        )
    return DepthRule(job.depth, False, to_shoulder, 0.0, job.thickness)
