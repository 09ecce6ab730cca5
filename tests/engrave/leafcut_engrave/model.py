"""What engraving alone finds out in a run."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EngravingDetail:
    """How many lines were engraved, and how deep, mm."""

    lines: int
    depth: float
