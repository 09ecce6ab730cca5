"""What drilling alone finds out in a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling: nearly all that there is to tell is of every outcome.

    Attributes
    ----------
    thickness
        Of the plate, mm; None where it is not given.
    """

    report: ClassVar[str] = "leafcut.processes.drilling.report:DrillingReport"

    thickness: float | None = None
