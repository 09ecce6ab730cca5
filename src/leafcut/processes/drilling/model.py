"""What drilling alone finds out in a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling: nearly all that there is to tell is of every outcome.

    Attributes
    ----------
    low_ways_saved_s
        How much longer the same order would take with all ways over the highest place, s; None where all is flat.
    thickness
        Of the plate, mm; None where it is not given.
    level
        Whether its surface is flat, as far as it is known.
    """

    report: ClassVar[str] = "leafcut.processes.drilling.report:DrillingReport"

    low_ways_saved_s: float | None = None
    thickness: float | None = None
    level: bool = True
