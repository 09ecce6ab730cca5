"""A cutting program read back: the rows that were planned, as its controller is told them."""

from __future__ import annotations

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.torch import for_controller
from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Toolpath
from leafcut.proof.program import read_back as as_written
from leafcut.proof.read_back import compare_motion
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE


def check_cut_motion(planned: Toolpath, written: Toolpath, dialect: Dialect, units: str) -> list[Difference]:
    """Return where a program read back is not the planned toolpath as its controller is told it, row by row."""
    half = 0.5 * 10.0**-dialect.decimals_mm
    if units == "inch":
        half = 0.5 * MM_PER_INCH * 10.0**-dialect.decimals_inch
    told = for_controller(planned, dialect)
    return compare_motion(told, written, half * 1.001 + 1e-9, cycles=True)


def read_back(text: str, plan: CutPlan, dialect: Dialect) -> Toolpath:
    """Return what a cutting program does, whatever another one left active; a feed from the controller's table of
    materials is that of the plan.

    Raises
    ------
    ReadError
        The text is no program that the controller takes.
    """
    torch = dialect.torch
    if torch is not None and torch.material_feed:
        text = text.replace(torch.material_feed, f"F{plan.data.feed * SECONDS_PER_MINUTE:.6f}")
    return as_written(text, dialect)
