"""leafcut: the shortest-time, verified CNC program for a drawing or for another CAM's code.

import leafcut

outcome = leafcut.optimize("plate.dxf", "plate.nc", machine="haas-vf2", thickness="0.25in")
print(f"{outcome.before.time_s:.1f} s became {outcome.after.time_s:.1f} s")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from leafcut._version import __version__

if TYPE_CHECKING:
    from leafcut.api import nest, optimize, simulate, solve_part, verify_programs
    from leafcut.errors import LeafcutError
    from leafcut.read import read as read_part

__all__ = ["LeafcutError", "__version__", "nest", "optimize", "read_part", "simulate", "solve_part", "verify_programs"]

#: Public name → (module, name there). None of them may be the name of a room: importing that would hide it.
_HOMES = {
    "LeafcutError": ("leafcut.errors", "LeafcutError"),
    "nest": ("leafcut.api", "nest"),
    "optimize": ("leafcut.api", "optimize"),
    "read_part": ("leafcut.read", "read"),
    "simulate": ("leafcut.api", "simulate"),
    "solve_part": ("leafcut.api", "solve_part"),
    "verify_programs": ("leafcut.api", "verify_programs"),
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `import leafcut` itself costs next to nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'leafcut' has no attribute '{name}'")
    from importlib import import_module

    module, attribute = _HOMES[name]
    return getattr(import_module(module), attribute)
