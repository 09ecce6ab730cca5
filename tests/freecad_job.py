"""A FreeCAD job run by freecadcmd: a plate with six holes, written by a post-processor.

Environment variables: folder of the user's post-processors (MACROS), post-processor (POST), its arguments (ARGUMENTS),
and output file (OUT). FreeCAD ends with status 0 whatever a script does, so this script ends it.
"""

import os
import sys

try:
    import FreeCAD
    import Part

    sys.path.append(FreeCAD.getHomePath() + "/Mod/Path")
    FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Macro").SetString("MacroPath", os.environ["MACROS"])
    from PathScripts import PathDrilling, PathJob
    from PathScripts.PathPostProcessor import PostProcessor

    shape = Part.makeBox(120, 80, 6)
    for x, y in ((10, 10), (110, 70), (20, 60), (100, 15), (60, 40), (30, 20)):
        shape = shape.cut(Part.makeCylinder(2.5, 6, FreeCAD.Vector(x, y, 0)))
    document = FreeCAD.newDocument("plate")
    plate = document.addObject("Part::Feature", "Plate")
    plate.Shape = shape
    job = PathJob.Create("Job", [plate], None)
    tool = job.Tools.Group[0]
    tool.VertFeed, tool.SpindleSpeed, tool.SpindleDir = os.environ.get("FEED", "120 mm/min"), 1500, "Forward"
    drilling = PathDrilling.Create("Drilling")
    model = job.Model.Group[0]
    round_faces = [k for k, face in enumerate(model.Shape.Faces, 1) if face.Surface.TypeId == "Part::GeomCylinder"]
    drilling.Base = [(model, [f"Face{k}" for k in round_faces])]
    document.recompute()
    assert PostProcessor.exists(os.environ["POST"])
    post = PostProcessor.load(os.environ["POST"])
    post.export([tool, *job.Operations.Group], os.environ["OUT"], os.environ["ARGUMENTS"])
except BaseException as problem:
    sys.stderr.write(f"\nFAILED: {problem}\n")
    sys.stderr.flush()
    os._exit(1)
os._exit(0)
