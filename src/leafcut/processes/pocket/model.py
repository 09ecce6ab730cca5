"""The pocket-specific part of an outcome."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.pace_change import PaceChange
from leafcut.model.pocket import PocketPlan, PocketProgram


@dataclass(frozen=True)
class PocketDetail:
    """Cleared pockets.

    Attributes
    ----------
    plans
        The strategy of each pocket, with all strategies that were tried.
    programs
        For several pockets: the written program, and the program of each strategy that clears all of them.
    pace
        Effect of load-dependent feeds; None for a constant feed.
    before
        The material before the first cut if it is a solid with steps; None: a block.
    """

    plans: tuple[PocketPlan, ...]
    programs: tuple[PocketProgram, ...] = ()
    pace: PaceChange | None = None
    before: Mesh | None = field(default=None, compare=False, repr=False)
