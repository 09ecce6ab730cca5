"""leafcut: the shortest-time, verified CNC program for a drawing or for another CAM's code.

import leafcut

outcome = leafcut.optimize("plate.dxf", "plate.nc", machine="haas-vf2", thickness="0.25in")
print(f"{outcome.before.time_s:.1f} s became {outcome.after.time_s:.1f} s")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from leafcut.api import optimize, simulate, solve_part, verify
    from leafcut.errors import LeafcutError
    from leafcut.read import read

__all__ = ["LeafcutError", "__version__", "optimize", "read", "simulate", "solve_part", "verify"]

_HOMES = {
    "LeafcutError": "leafcut.errors",
    "optimize": "leafcut.api",
    "read": "leafcut.read",
    "simulate": "leafcut.api",
    "solve_part": "leafcut.api",
    "verify": "leafcut.api",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `import leafcut` itself costs next to nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'leafcut' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)
