"""What milling pockets alone finds out: how every pocket is cleared, and the other ways that were tried."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.pace_change import PaceChange
from leafcut.model.pocket import PocketPlan, PocketProgram


@dataclass(frozen=True)
class PocketDetail:
    """Pockets cleared.

    Attributes
    ----------
    plans
        How every pocket is cleared, with all strategies that were tried.
    programs
        Of several pockets: the program as it is written, and that of every strategy that clears all of them.
    pace
        What feeds that follow what the tool meets did; None where one feed is used throughout.
    before
        The material before the first cut, where it is that of a solid with steps; None: a block.
    """

    plans: tuple[PocketPlan, ...]
    programs: tuple[PocketProgram, ...] = ()
    pace: PaceChange | None = None
    before: Mesh | None = field(default=None, compare=False, repr=False)
