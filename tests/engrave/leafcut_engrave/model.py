"""Results specific to engraving."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EngravingDetail:
    """Number of engraved lines, and their depth, mm."""

    lines: int
    depth: float
