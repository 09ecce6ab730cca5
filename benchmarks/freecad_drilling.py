"""Script for `freecadcmd`: drill the holes in a file with FreeCAD's drilling operation, and write their order.

Environment variables: HOLES, the file of hole centres x,y in mm, and ORDER, the file for the drilled centres in order.
FreeCAD ends with status 0 regardless of the script, so this script ends FreeCAD.
"""

import csv
import os
import sys
from pathlib import Path

#: Radius of the holes and thickness of the plate, mm.
RADIUS, THICKNESS = 1.5, 6.35

try:
    import FreeCAD
    import Part

    sys.path.append(FreeCAD.getHomePath() + "/Mod/Path")
    from PathScripts import PathDrilling, PathJob

    with Path(os.environ["HOLES"]).open(encoding="utf-8", newline="") as file:
        centres = [(float(x), float(y)) for x, y in csv.reader(file)]
    side = max(max(centre) for centre in centres) + 10
    cylinders = [Part.makeCylinder(RADIUS, THICKNESS, FreeCAD.Vector(x, y, 0)) for x, y in centres]
    document = FreeCAD.newDocument("plate")
    plate = document.addObject("Part::Feature", "Plate")
    plate.Shape = Part.makeBox(side, side, THICKNESS).cut(Part.makeCompound(cylinders))
    job = PathJob.Create("Job", [plate], None)
    drilling = PathDrilling.Create("Drilling")
    model = job.Model.Group[0]
    round_faces = [k for k, face in enumerate(model.Shape.Faces, 1) if face.Surface.TypeId == "Part::GeomCylinder"]
    drilling.Base = [(model, [f"Face{k}" for k in round_faces])]
    document.recompute()
    cycles = [command for command in drilling.Path.Commands if command.Name in ("G81", "G82", "G83")]
    with Path(os.environ["ORDER"]).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows((cycle.Parameters["X"], cycle.Parameters["Y"]) for cycle in cycles)
except BaseException as problem:
    sys.stderr.write(f"\n{type(problem).__name__}: {problem}\n")
    sys.stderr.flush()
    os._exit(1)
os._exit(0)
