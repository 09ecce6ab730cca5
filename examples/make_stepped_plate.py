"""Makes stepped_plate.step and stepped_plate.stl: three steps, three bosses, 36 holes, through and blind.

Run it with the extra `step`: python examples/make_stepped_plate.py
"""

from __future__ import annotations

import math
from pathlib import Path

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.StlAPI import StlAPI_Writer

HERE = Path(__file__).parent
#: Corners of the steps and of the bosses on them: x0, y0, z0, x1, y1, z1, mm.
STEPS = ((0, 0, -20, 40, 80, 0), (40, 0, -20, 80, 80, -6), (80, 0, -20, 120, 80, -12))
BOSSES = ((15, 28, -5, 25, 52, 18), (54, 20, -8, 66, 60, 14), (96, 34, -14, 108, 48, 10))
DIAMETER, BLIND = 5.0, 6.0


def step_under(x: float) -> tuple[float, ...]:
    """Return the step at a place."""
    return next(step for step in STEPS if step[0] <= x <= step[3])


def holes() -> list[tuple[float, float, float, bool]]:
    """Return x, y, top and whether it goes through, of every hole: every third one is blind, with a drill's point."""
    places = [(x, y) for x in range(6, 120, 12) for y in range(8, 80, 13)]
    free = [
        (x, y)
        for x, y in places
        if not any(b[0] - 4 < x < b[3] + 4 and b[1] - 4 < y < b[4] + 4 for b in BOSSES)
        and min(abs(x - 40), abs(x - 80)) > 4
    ]
    return [(x, y, step_under(x)[5], k % 3 != 2) for k, (x, y) in enumerate(free)]


def solid() -> object:
    """Return the plate."""
    made = None
    for x0, y0, z0, x1, y1, z1 in (*STEPS, *BOSSES):
        box = BRepPrimAPI_MakeBox(gp_Pnt(x0, y0, z0), gp_Pnt(x1, y1, z1)).Shape()
        made = box if made is None else BRepAlgoAPI_Fuse(made, box).Shape()
    radius = 0.5 * DIAMETER
    for x, y, top, through in holes():
        depth = top + 20.0 if through else BLIND
        down = gp_Ax2(gp_Pnt(x, y, top), gp_Dir(0, 0, -1))
        made = BRepAlgoAPI_Cut(made, BRepPrimAPI_MakeCylinder(down, radius, depth).Shape()).Shape()
        if not through:
            point = gp_Ax2(gp_Pnt(x, y, top - depth), gp_Dir(0, 0, -1))
            cone = BRepPrimAPI_MakeCone(point, radius, 0.0, radius / math.tan(math.radians(59))).Shape()
            made = BRepAlgoAPI_Cut(made, cone).Shape()
    return made


def main() -> None:
    """Write both files."""
    plate = solid()
    writer = STEPControl_Writer()
    writer.Transfer(plate, STEPControl_AsIs)
    writer.Write(str(HERE / "stepped_plate.step"))
    BRepMesh_IncrementalMesh(plate, 0.2, False, 0.6, False)
    stl = StlAPI_Writer()
    stl.ASCIIMode = False
    stl.Write(plate, str(HERE / "stepped_plate.stl"))


if __name__ == "__main__":
    main()
