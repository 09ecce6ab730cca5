"""Small scenes that the tests of the drawing know everything about."""

from __future__ import annotations

from leafcut.model.machine import Machine
from leafcut.model.part import Hole, Part
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.studio.drawing.scene import part_scene, toolpath_scene

MACHINE = Machine(
    name="test-mill",
    description="a mill of no particular make",
    controller="fanuc",
    rapid_velocity=(100.0, 100.0, 100.0),
    acceleration=(1000.0, 1000.0, 1000.0),
    max_feed=100.0,
    travel_min=(0.0, 0.0, -300.0),
    travel_max=(700.0, 400.0, 0.0),
)
CYCLE = DrillCycle("G81", r_plane=2.0, bottom=-6.0)

#: Twelve holes, 20 mm apart, the first at (10, 10), row by row, with different diameters.
PLACES = [(10.0 + 20.0 * (k % 4), 10.0 + 20.0 * (k // 4)) for k in range(12)]
PART = Part("grid", tuple(Hole(x, y, 3.0 + 0.25 * k) for k, (x, y) in enumerate(PLACES)))

#: Line 1 of the program is a rapid; hole k is drilled on line k + 2; then come a cut and an arc.
TEXT = "\n".join(
    ["G0 Z20", *(f"G81 X{x:g} Y{y:g} Z-6 R2 F300" for x, y in PLACES), "G0 X0 Y70", "G1 X40 F600", "G3 X80 Y70 I20 J0"]
)
CUT_LINE, ARC_LINE = 15, 16


def grid_path() -> Toolpath:
    """Return the toolpath of `TEXT`, by hand."""
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 20.0, line=1)
    for line, (x, y) in enumerate(PLACES, 2):
        path.drill(x, y, CYCLE, feed=5.0, line=line)
    path.rapid(x=0.0, y=70.0, line=14)
    path.feed(x=40.0, feed=10.0, line=CUT_LINE)
    path.arc(False, (80.0, 70.0, 2.0), Arc((60.0, 70.0, 0.0)), feed=10.0, line=ARC_LINE)
    return path.build()


def grid_of_holes() -> bytes:
    """Return the scene of the part."""
    return part_scene(PART)


def grid_program() -> bytes:
    """Return the scene of the toolpath."""
    return toolpath_scene(grid_path(), MACHINE, name="grid", text=TEXT)
