"""`WorkMaterial`: data about a work material, used to compute cutting forces and tool life."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.kinds import CuttingWork, ToolMaterial


@dataclass(frozen=True)
class ToolLife:
    """The extended Taylor law for the life of a kind of tool in a material.

    The cutting speed for a life T is v = C D^q / (T^m f^y ae^x ap^u z^p), so
    T = (C D^q / (v f^y ae^x ap^u z^p))^(1/m). If all exponents except m are 0, this is Taylor's v T^n = C with n = m.

    Source: F. W. Taylor, On the Art of Cutting Metals (1907); in this form, with D for drills and mills, A. G. Kosilova
    and R. K. Meshcheryakov, Handbook of the Manufacturing Engineer, vol. 2 (1986), Drilling and Milling.

    Attributes
    ----------
    constant
        The constant C, mm/s. It is the speed for a life of 1 s if all lengths are 1 mm.
    life, diameter, feed, width, depth, teeth
        The exponents m, q, y, x, u and p. The feed is per revolution of a drill, and per tooth of a mill.
    least_feed
        Lowest feed to which the law applies, mm. Above this feed, the law applies up to the lowest feed of the next
        law.
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
        """Return the tool life, s, at a cutting speed in mm/s. Lengths are in mm."""
        scaled_constant = (
            self.constant * diameter**self.diameter / (width**self.width * depth**self.depth * teeth**self.teeth)
        )
        return np.asarray((scaled_constant / (np.asarray(speed) * np.asarray(feed) ** self.feed)) ** (1.0 / self.life))


@dataclass(frozen=True)
class WorkMaterial:
    """A work material. Units are N/mm², kg/m³, mm and s.

    Attributes
    ----------
    kc11, mc
        Constants of Kienzle's law: the specific cutting force is kc = kc11 h^-mc, N/mm², for a chip thickness h, mm.
    tensile_strength, hardness, density
        Tensile strength, N/mm², Brinell hardness, HB, and density, kg/m³; 0 if unknown.
    lives
        Tool life laws for each operation and tool material, in order of their feeds. Empty if no source is known.
    drill_constant
        Constant K for measured torque and thrust of twist drills (`leafcut.material.cutting_force`). If it is 0, torque
        and thrust are computed from `kc11` and `mc`.
    drill_feed, mill_feed
        Maximum feed of a drill per revolution, and of a carbide mill per tooth, as a share of the diameter; 0 if
        unknown.
    sources
        Maps a key to the source of its value, or to "estimate: …".
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
        """Return the tool life laws for an operation and a tool material, in order of feed.

        The result is empty if no law is known.
        """
        return tuple(life for life in self.lives if life.work is work and life.tool_material is tool_material)
