"""leafcut: the shortest-time, verified CNC program for a drawing or for another CAM's code.

import leafcut

outcome = leafcut.optimize("plate.dxf", "plate.nc", machine="haas-vf2", thickness="0.25in")
print(f"{outcome.before.time_s:.1f} s became {outcome.after.time_s:.1f} s")
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut._version import __version__ as __version__

if TYPE_CHECKING:
    from leafcut.public import *  # noqa: F403
else:

    def __getattr__(name):
        """Import the public names when one is first used: `import leafcut` itself costs next to nothing."""
        if name.startswith("__") and name != "__all__":
            raise AttributeError(f"module 'leafcut' has no attribute '{name}'")
        from importlib import import_module
        from importlib.util import find_spec

        if name != "__all__" and find_spec(f"leafcut.{name}"):  # `from leafcut import api` asks before it imports
            raise AttributeError(f"module 'leafcut' has no attribute '{name}'")
        public = import_module("leafcut.public")
        if name == "__all__":
            return [*public.__all__, "__version__"]
        if name not in public.__all__:
            raise AttributeError(f"module 'leafcut' has no attribute '{name}'")
        return getattr(public, name)

    def __dir__():
        return __getattr__("__all__")
