"""Results that are specific to pocket milling."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.pace_change import PaceChange
from leafcut.model.pocket import PocketPlan, PocketProgram


@dataclass(frozen=True)
class PocketDetail:
    """The results of pocket milling that a general outcome does not contain.

    Attributes
    ----------
    programs
        Time and rapids of the written program, and of one program for each strategy. Empty for a single pocket.
    pace
        Effect of load-dependent feeds, or None for a constant feed.
    before
        Surface of the stock, or None if the stock is a block.
    clearance, retract
        Heights of rapids, mm.
    entries
        Each kind of entry move, with the number of these moves.
    """

    plans: tuple[PocketPlan, ...]
    programs: tuple[PocketProgram, ...] = ()
    pace: PaceChange | None = None
    before: Mesh | None = field(default=None, compare=False, repr=False)
    clearance: float = 0.0
    retract: float = 0.0
    entries: tuple[tuple[str, int], ...] = ()
