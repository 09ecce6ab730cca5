"""Stock to be seen in three dimensions, and how to go on with it in the browser, for the tests of that."""

from __future__ import annotations

import math
from typing import Any

from canvas_scenes import MACHINE
from canvas_server import until

from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.stock.solid import Solid, solid_of
from leafcut.studio.drawing.scene import toolpath_scene
from leafcut.studio.drawing.solid import solid_scene

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


def shaped_path() -> Toolpath:
    """Return cuts by every tool: level, on slopes of several grades, along an arc, down, and drilled through."""
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
        path.feed(z=-3.0, feed=5.0, line=line + 1)
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
    return solid_of(shaped_path(), STOCK)


def shaped_scenes() -> dict[str, bytes]:
    """Return the scenes: shapes, and one whose tools nobody knows."""
    text = "\n".join(f"(line {k})" for k in range(1, 100))
    path = toolpath_scene(shaped_path(), MACHINE, name="shapes", text=text)
    return {
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
