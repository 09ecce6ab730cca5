"""Stock to be seen in three dimensions, and how to go on with it in the browser, for the tests of that."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from canvas_scenes import MACHINE
from canvas_server import until

from leafcut.material.solid import Solid, cut_display_solid
from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import BodySegment, Tool, ToolKind
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.studio.drawing.scene import toolpath_scene
from leafcut.studio.drawing.solid import compared_solid_scenes, solid_scene
from meshes import box_triangles

#: A tool of every shape: flat, ball, bull-nose, with a point, a cone with a flat tip.
TOOLS = {
    1: Tool(1, 10.0, ToolKind.END_MILL, point_angle=math.pi),
    2: Tool(2, 8.0, ToolKind.BALL_MILL),
    3: Tool(3, 9.0, ToolKind.END_MILL, point_angle=math.pi, corner_radius=2.0),
    4: Tool(4, 6.0, ToolKind.DRILL, point_angle=math.radians(118)),
    5: Tool(5, 12.0, ToolKind.CHAMFER_MILL, point_angle=math.radians(90), tip_diameter=2.0),
}
STOCK = ShownStock(TOOLS, block=((0.0, 0.0, -15.0), (120.0, 80.0, 0.0)))
#: The line of the only rapid in the stock, and how deep it is in it, mm; the line that cuts the long slot.
CRASH_LINE, CRASH_DEPTH, SLOT_LINE = 90, 3.0, 12
#: Where a holder meets the stock.
HOLDER_LINE = 5


def shaped_path(slot: float = -3.0) -> Toolpath:
    """Return cuts by every tool: level, on slopes of several grades, along an arc, down, and drilled through.

    `slot` is the depth of the long slot of the first tool, mm.
    """
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 20.0, line=1)
    for number in TOOLS:
        line, y = 10 * number, 10.0 + 12.0 * (number - 1)
        path.tool(number, line=line)
        path.rapid(10.0, y, 5.0, line=line)
        if number == 4:
            path.drill(100.0, 66.0, DrillCycle("G81", r_plane=2.0, bottom=-18.0), feed=5.0, line=line + 1)
            path.rapid(z=5.0, line=line + 1)
            continue
        path.feed(z=slot if number == 1 else -3.0, feed=5.0, line=line + 1)
        path.feed(x=60.0, feed=20.0 + 10.0 * number, line=line + 2)
        path.feed(x=72.0, y=y + 4.0, z=-6.0, feed=20.0, line=line + 3)
        path.feed(x=80.0, y=y, z=-1.0, feed=20.0, line=line + 4)
        path.arc(False, (90.0, y, -4.0), Arc((85.0, y, 0.0)), feed=20.0, line=line + 5)
        path.rapid(z=5.0, line=line + 6)
    path.rapid(110.0, 20.0, 5.0, line=CRASH_LINE - 2)
    path.rapid(z=-CRASH_DEPTH, line=CRASH_LINE)
    path.rapid(z=5.0, line=CRASH_LINE + 1)
    return path.build()


def shaped_solid() -> Solid:
    """Return the stock that is cut by all tools, as Python cuts it."""
    return cut_display_solid(shaped_path(), STOCK)


def stepped_stock() -> ShownStock:
    """Return two steps with a hole of 5 mm that is open already, a clamp on them, and a drill with its holder."""
    steps = [(0, 0, -12, 60, 80, 0), (60, 0, -12, 120, 37.5, -5), (60, 42.5, -12, 120, 80, -5)]
    steps += [(60, 37.5, -12, 77.5, 42.5, -5), (82.5, 37.5, -12, 120, 42.5, -5)]
    mesh = Mesh(np.concatenate([box_triangles(*box) for box in steps]), "steps.stl")
    tool = replace(TOOLS[4], flute_length=20.0, stickout=30.0, holder=(BodySegment(12.0, 20.0, 20.0),))
    return ShownStock({4: tool}, surface=mesh, finished=True, fixtures=((-6.0, 30.0, -12.0, 10.0, 50.0, 8.0),))


def stepped_path() -> Toolpath:
    """Return a hole through each step; the second is so deep that the holder meets the first step."""
    path = ToolpathBuilder()
    path.tool(4, line=1)
    path.rapid(30.0, 20.0, 12.0, line=1)
    path.drill(30.0, 20.0, DrillCycle("G81", r_plane=2.0, bottom=-14.0), feed=5.0, line=2)
    path.drill(80.0, 40.0, DrillCycle("G81", r_plane=2.0, bottom=-14.0), feed=5.0, line=3)
    path.rapid(64.0, 60.0, 2.0, line=4)
    path.feed(z=-34.0, feed=5.0, line=HOLDER_LINE)
    path.rapid(z=12.0, line=6)
    return path.build()


def shaped_scenes() -> dict[str, bytes]:
    """Return the scenes: shapes, and one with unknown tools."""
    text = "\n".join(f"(line {k})" for k in range(1, 100))
    path = toolpath_scene(shaped_path(), MACHINE, name="shapes", text=text)
    one, other = ((shaped_path(slot), MACHINE, STOCK) for slot in (-3.0, -2.5))
    before, after = compared_solid_scenes(one, other)
    same, _ = compared_solid_scenes(one, one)
    return {
        "compared.before": path,
        "compared.after": toolpath_scene(shaped_path(-2.5), MACHINE, name="shapes", text=text),
        "compared.solid_before": before,
        "compared.solid_after": after,
        "same.after": path,
        "same.solid_after": same,
        "steps.after": toolpath_scene(stepped_path(), MACHINE, name="steps", text=text),
        "steps.solid_after": solid_scene(stepped_path(), MACHINE, stepped_stock()),
        "shapes.after": path,
        "shapes.solid_after": solid_scene(shaped_path(), MACHINE, STOCK),
        "unknown.after": path,
        "unknown.solid_after": solid_scene(shaped_path(), MACHINE, ShownStock(refused="the shape of T9 is unknown")),
    }


def see(page: Any, name: str = "shapes") -> None:
    """Show the solid view of a scene, and wait until it is cut."""
    page.evaluate("(name) => load(name, ['after', 'solid_after'])", name)
    page.evaluate("drawing.setSpace('solid')")
    cut(page)


def cut(page: Any) -> None:
    """Wait until what is shown is what was asked for, and drawn."""
    until(page, "drawing.solid.ready && !drawing.solid._request")
