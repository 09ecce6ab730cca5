"""leafcut: verified CNC programs with minimum machine time, from a drawing or from another CAM's program.

outcome = leafcut.drill("plate.dxf", "plate.nc", machine="haas-vf2", thickness="0.25in")
print(f"{outcome.before.time_s:.1f} s became {outcome.after.time_s:.1f} s")
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut._version import __version__ as __version__

#: Public name → its module, which is imported when the name is first used.
_HOMES = {
    "optimize": "leafcut.api",
    "drill": "leafcut.api",
    "cut": "leafcut.api",
    "pocket": "leafcut.api",
    "part": "leafcut.api",
    "reorder": "leafcut.api",
    "nest": "leafcut.api",
    "simulate": "leafcut.api",
    "verify": "leafcut.api",
    "stock": "leafcut.api",
    "solve": "leafcut.api",
    "tool_speeds": "leafcut.api",
    "read_part": "leafcut.api",
    "ProgramResult": "leafcut.results.program",
    "NestResult": "leafcut.results.nest",
    "SimulationResult": "leafcut.results.simulation",
    "VerificationResult": "leafcut.results.verification",
    "StockResult": "leafcut.results.stock",
    "TourResult": "leafcut.results.tour",
    "ToolSpeedsResult": "leafcut.results.tool_speeds",
    "ReadOptions": "leafcut.options",
    "WantedDrawing": "leafcut.read.nest_list",
    "Issue": "leafcut.model.issue",
    "Machine": "leafcut.model.machine",
    "Part": "leafcut.model.part",
    "Progress": "leafcut.model.heartbeat",
    "Tool": "leafcut.model.tool",
    "Toolpath": "leafcut.model.toolpath",
    "LeafcutError": "leafcut.errors",
    "OptionError": "leafcut.errors",
    "PlanError": "leafcut.errors",
    "PostError": "leafcut.errors",
    "ReadError": "leafcut.errors",
    "SolveError": "leafcut.errors",
    "VerifyError": "leafcut.errors",
    "OutputError": "leafcut.files.whole_files",
}
__all__ = [*_HOMES, "__version__"]  # noqa: PLE0604  # the keys are strings

if TYPE_CHECKING:
    from leafcut.api import cut as cut
    from leafcut.api import drill as drill
    from leafcut.api import nest as nest
    from leafcut.api import optimize as optimize
    from leafcut.api import part as part
    from leafcut.api import pocket as pocket
    from leafcut.api import read_part as read_part
    from leafcut.api import reorder as reorder
    from leafcut.api import simulate as simulate
    from leafcut.api import solve as solve
    from leafcut.api import stock as stock
    from leafcut.api import tool_speeds as tool_speeds
    from leafcut.api import verify as verify
    from leafcut.errors import LeafcutError as LeafcutError
    from leafcut.errors import OptionError as OptionError
    from leafcut.errors import PlanError as PlanError
    from leafcut.errors import PostError as PostError
    from leafcut.errors import ReadError as ReadError
    from leafcut.errors import SolveError as SolveError
    from leafcut.errors import VerifyError as VerifyError
    from leafcut.files.whole_files import OutputError as OutputError
    from leafcut.model.heartbeat import Progress as Progress
    from leafcut.model.issue import Issue as Issue
    from leafcut.model.machine import Machine as Machine
    from leafcut.model.part import Part as Part
    from leafcut.model.tool import Tool as Tool
    from leafcut.model.toolpath import Toolpath as Toolpath
    from leafcut.options import ReadOptions as ReadOptions
    from leafcut.read.nest_list import WantedDrawing as WantedDrawing
    from leafcut.results.nest import NestResult as NestResult
    from leafcut.results.program import ProgramResult as ProgramResult
    from leafcut.results.simulation import SimulationResult as SimulationResult
    from leafcut.results.stock import StockResult as StockResult
    from leafcut.results.tool_speeds import ToolSpeedsResult as ToolSpeedsResult
    from leafcut.results.tour import TourResult as TourResult
    from leafcut.results.verification import VerificationResult as VerificationResult
else:

    def __getattr__(name):
        """Return a public name from its module, so that `import leafcut` loads no other module."""
        if name not in _HOMES:
            raise AttributeError(f"module 'leafcut' has no attribute '{name}'")
        from importlib import import_module

        value = globals()[name] = getattr(import_module(_HOMES[name]), name)
        return value

    def __dir__():
        return __all__
