"""What engraving alone finds out in a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class EngravingDetail:
    """How many lines were engraved, and how deep, mm."""

    report: ClassVar[str] = "leafcut_engrave.report:EngravingReport"

    lines: int
    depth: float
