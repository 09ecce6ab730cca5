"""Results that only pocket milling has."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.pace_change import PaceChange
from leafcut.model.pocket import PocketPlan, PocketProgram


@dataclass(frozen=True)
class PocketDetail:
    """Results of clearing pockets, in addition to the general outcome.

    `programs` is empty for a single pocket. `pace` is None for a constant feed. `before` is the surface of the stock;
    None if the stock is a block. `clearance` and `retract` are the heights of rapids, mm. `entries` contains each kind
    of entry move and the number of these moves.
    """

    plans: tuple[PocketPlan, ...]
    programs: tuple[PocketProgram, ...] = ()
    pace: PaceChange | None = None
    before: Mesh | None = field(default=None, compare=False, repr=False)
    clearance: float = 0.0
    retract: float = 0.0
    entries: tuple[tuple[str, int], ...] = ()
