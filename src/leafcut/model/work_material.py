"""`WorkMaterial`: data of a work material for cutting forces and tool life."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.kinds import CuttingWork, ToolMaterial


@dataclass(frozen=True)
class ToolLife:
    """Extended Taylor tool life of a tool kind in a material.

    The cutting speed for a life T is v = C D^q / (T^m f^y ae^x ap^u z^p); so T = (C D^q / (v f^y ae^x ap^u z^p))^(1/m).
    With all exponents except m at 0 it is Taylor's v T^n = C, n = m.

    Source: F. W. Taylor, On the Art of Cutting Metals (1907); in this form, with D for drills and mills, A. G. Kosilova
    and R. K. Meshcheryakov, Handbook of the Manufacturing Engineer, vol. 2 (1986), Drilling and Milling.

    Attributes
    ----------
    constant
        C: mm/s, for a life of 1 s, with every length 1 mm.
    life, diameter, feed, width, depth, teeth
        The exponents m, q, y, x, u and p. The feed is per revolution of a drill, per tooth of a mill.
    least_feed
        Lower end of its range of feeds, mm; the upper end is the lower end of the next.
    """

    work: CuttingWork
    tool_material: ToolMaterial
    constant: float
    life: float
    diameter: float = 0.0
    feed: float = 0.0
    width: float = 0.0
    depth: float = 0.0
    teeth: float = 0.0
    least_feed: float = 0.0
    source: str = ""

    def seconds(
        self,
        speed: Floats | float,
        feed: Floats | float,
        diameter: float,
        width: float = 1.0,
        depth: float = 1.0,
        teeth: int = 1,
    ) -> Floats:
        """Return the life, s, at a cutting speed, mm/s; lengths in mm."""
        scaled_constant = (
            self.constant * diameter**self.diameter / (width**self.width * depth**self.depth * teeth**self.teeth)
        )
        return np.asarray((scaled_constant / (np.asarray(speed) * np.asarray(feed) ** self.feed)) ** (1.0 / self.life))


@dataclass(frozen=True)
class WorkMaterial:
    """A work material: N/mm², kg/m³, mm, s.

    Attributes
    ----------
    kc11, mc
        Kienzle: kc = kc11 h^-mc, N/mm², with the chip thickness h in mm.
    tensile_strength, hardness, density
        N/mm², HB, kg/m³; 0 if unknown.
    lives
        Tool life by operation and tool material, in order of their feeds; empty if no source is known.
    drill_constant
        K of the measured torque and thrust of twist drills (`leafcut.material.cutting_force`); 0: they follow from
        `kc11` and `mc`.
    drill_feed, mill_feed
        Highest feed of a drill per revolution, and of a carbide mill per tooth, as a fraction of the diameter; 0 if
        unknown.
    sources
        Source of each value, by key, or "estimate: …".
    """

    name: str
    kc11: float
    mc: float
    description: str = ""
    also: tuple[str, ...] = ()
    tensile_strength: float = 0.0
    hardness: float = 0.0
    density: float = 0.0
    lives: tuple[ToolLife, ...] = ()
    drill_constant: float = 0.0
    drill_feed: float = 0.0
    mill_feed: float = 0.0
    sources: dict[str, str] = field(default_factory=dict)

    def lives_of(self, work: CuttingWork, tool_material: ToolMaterial) -> tuple[ToolLife, ...]:
        """Return the tool life data of an operation and tool material, by feed; empty if unknown."""
        return tuple(life for life in self.lives if life.work is work and life.tool_material is tool_material)
