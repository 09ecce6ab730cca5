"""Solids made with OpenCASCADE from boxes, cylinders and cones, and their STEP files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

DOWN, UP = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)


def box(*corners: float) -> Any:
    """Return a box of its lower and its upper corner."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*corners[:3]), gp_Pnt(*corners[3:])).Shape()


def cylinder(at: tuple[float, float, float], way: tuple[float, float, float], radius: float, length: float) -> Any:
    """Return a cylinder that goes some way from a place."""
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(*way)), radius, length).Shape()


def cone(at: tuple[float, float, float], below: float, above: float, length: float) -> Any:
    """Return an upright cone of two radii."""
    return BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(*at), gp_Dir(0, 0, 1)), below, above, length).Shape()


def cut(solid: Any, *tools: Any) -> Any:
    """Return a solid without others."""
    for tool in tools:
        solid = BRepAlgoAPI_Cut(solid, tool).Shape()
    return solid


def fused(solid: Any, *others: Any) -> Any:
    """Return solids as one."""
    for other in others:
        solid = BRepAlgoAPI_Fuse(solid, other).Shape()
    return solid


def rounded(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float, radius: float) -> Any:
    """Return a box with round upright edges: (x1 − x0)(y1 − y0) − (4 − π) r² in area."""
    inner = [(x, y) for x in (x0 + radius, x1 - radius) for y in (y0 + radius, y1 - radius)]
    return fused(
        box(x0 + radius, y0, z0, x1 - radius, y1, z1),
        box(x0, y0 + radius, z0, x1, y1 - radius, z1),
        *(cylinder((x, y, z0), UP, radius, z1 - z0) for x, y in inner),
    )


def saved(file: Path, *solids: Any, unit: str = "MM") -> Path:
    """Write solids to a STEP file."""
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    for solid in solids:
        writer.Transfer(solid, STEPControl_AsIs)
    writer.Write(str(file))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    return file
