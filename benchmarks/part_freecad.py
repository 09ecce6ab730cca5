"""Script for `freecadcmd`: mill a part with FreeCAD's CAM workbench, and write the program for LinuxCNC.

Environment variable: JOB, a JSON file with the values below. Lengths are in mm, feeds in mm/min, speeds in rpm.

profile, pocket, engrave    DXF files with the outlines and openings, the pockets, and the lines to engrave, or ""
drilled                     centres x,y of the holes to drill
mill, drill                 the tools: diameter, speed, feed, plunge
thickness, bottom, tip, pocket_depth, engrave_depth, step, safe_height, tab_width, tab_height, ramp_angle, out

FreeCAD ends with status 0 regardless of the script, so this script ends FreeCAD.
"""

import json
import os
import sys
from pathlib import Path

try:
    import FreeCAD
    import Import
    import Part

    sys.path.append(FreeCAD.getHomePath() + "/Mod/Path")
    from PathScripts import (
        PathDressupHoldingTags,
        PathDressupRampEntry,
        PathDrilling,
        PathEngrave,
        PathJob,
        PathPocketShape,
        PathProfile,
        PathToolController,
    )
    from PathScripts.PathPostProcessor import PostProcessor

    asked = json.loads(Path(os.environ["JOB"]).read_text(encoding="utf-8"))
    document = FreeCAD.newDocument("part")

    def wires_of(file):
        """Return the wires of a DXF file."""
        before = {one.Name for one in document.Objects}
        Import.readDXF(file, document.Name)
        read = [one for one in document.Objects if one.Name not in before]
        edges = [edge for one in read for edge in one.Shape.Edges]
        for one in read:
            document.removeObject(one.Name)
        return [Part.Wire(chain) for chain in Part.sortEdges(edges)]

    def solid_of(file, depth):
        """Return the closed wires of a DXF file as a solid below Z0; wires inside others are openings."""
        return Part.makeFace(wires_of(file), "Part::FaceMakerBullseye").extrude(FreeCAD.Vector(0, 0, -depth))

    shape = solid_of(asked["profile"], asked["thickness"])
    if asked["pocket"]:
        shape = shape.cut(solid_of(asked["pocket"], asked["pocket_depth"]))
    plate = document.addObject("Part::Feature", "Plate")
    plate.Shape = shape
    job = PathJob.Create("Job", [plate], None)
    model = job.Model.Group[0]
    faces = {f"Face{k}": face for k, face in enumerate(model.Shape.Faces, 1)}

    def describe(tool, number, data):
        """Set the number, diameter, speed and feeds of a tool."""
        tool.ToolNumber, tool.Tool.Diameter = number, data["diameter"]
        tool.SpindleSpeed, tool.SpindleDir = data["speed"], "Forward"
        tool.HorizFeed, tool.VertFeed = f"{data['feed']} mm/min", f"{data['plunge']} mm/min"
        return tool

    def operation(kind, name, bottom, **properties):
        """Return a new operation with the heights of the job."""
        made = kind.Create(name)
        heights = {"ClearanceHeight": asked["safe_height"], "SafeHeight": asked["safe_height"], "StartDepth": 0.0}
        for key, value in (heights | {"FinalDepth": bottom, "StepDown": asked["step"]}).items():
            if hasattr(made, key):
                made.setExpression(key, None)
                setattr(made, key, value)
        for key, value in properties.items():
            setattr(made, key, value)
        document.recompute()
        return made

    def ramped(base):
        """Return an operation with ramps, if they are requested."""
        if not asked["ramp_angle"]:
            return base
        made = document.addObject("Path::FeaturePython", "RampEntryDressup")
        PathDressupRampEntry.ObjectDressup(made)
        made.Base = base
        job.Proxy.addOperation(made, base)
        made.Proxy.setup(made)
        made.Angle, made.Method = 90 - asked["ramp_angle"], "RampMethod1"
        document.recompute()
        return made

    # Without its window, FreeCAD 0.20 can create operations only while the job has a single tool.
    mill = describe(job.Tools.Group[0], 1, asked["mill"])
    # Unlike the top, the bottom has no edges of pockets, which would be milled through the plate.
    bottom = [name for name, face in faces.items() if face.BoundBox.ZMax < model.Shape.BoundBox.ZMin + 1e-6]
    work = []
    if asked["engrave"]:
        lines = document.addObject("Part::Feature", "Lines")
        lines.Shape = Part.makeCompound(wires_of(asked["engrave"]))
        engraving = operation(PathEngrave, "Engraving", -asked["engrave_depth"], BaseShapes=[lines])
        work.append(engraving)
    if asked["pocket"]:
        floor = model.Shape.BoundBox.ZMax - asked["pocket_depth"]
        floors = [name for name, face in faces.items() if abs(face.BoundBox.ZMax - floor) < 1e-6]
        settings = {"OffsetPattern": "Offset", "StepOver": 50, "MinTravel": True, "CutMode": "Climb"}
        clearing = operation(PathPocketShape, "Pocket", -asked["pocket_depth"], Base=[(model, floors)], **settings)
        work.append(ramped(clearing))
    sides = {"Base": [(model, bottom)], "Direction": "CW", "UseComp": True}
    holes = operation(
        PathProfile,
        "Openings",
        asked["bottom"],
        processHoles=True,
        processPerimeter=False,
        processCircles=True,
        **sides,
    )
    if holes.Path.Commands:
        work.append(ramped(holes))
    outline = operation(PathProfile, "Outline", asked["bottom"], **sides)
    tags = PathDressupHoldingTags.Create(ramped(outline), "DressupTag")
    tags.Width, tags.Height, tags.Angle, tags.Radius = asked["tab_width"], asked["tab_height"], 90, 0
    document.recompute()
    work = [mill, *work, tags]
    if asked["drilled"]:
        places = [FreeCAD.Vector(x, y, 0) for x, y in asked["drilled"]]
        drilling = operation(PathDrilling, "Drilling", asked["tip"], Locations=places, RetractHeight=2.0)
        drill = PathToolController.Create("Drill")
        job.Proxy.addToolController(drill)
        drilling.ToolController = describe(drill, 2, asked["drill"])
        document.recompute()
        work = [drill, drilling, *work]
    PostProcessor.load("linuxcnc").export(work, asked["out"], "--no-show-editor --precision=4")
except BaseException as problem:
    sys.stderr.write(f"\n{type(problem).__name__}: {problem}\n")
    sys.stderr.flush()
    os._exit(1)
os._exit(0)
