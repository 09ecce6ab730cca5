"""The way of a strategy over one level, as a toolpath that can be drawn and played."""

from __future__ import annotations

import math
from collections.abc import Sequence

from leafcut.model.pocket import SAME_PLACE, PocketPath
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder

#: So far above the work the tool goes from piece to piece, mm.
_ABOVE = 2.0


def way_over_level(paths: Sequence[PocketPath], level: float, tool: Tool) -> Toolpath:
    """Return the ways of all pockets over one level, one after the other; the tool plunges where a way begins."""
    builder = ToolpathBuilder()
    builder.tool(tool.number)
    builder.spindle(tool.spindle_rpm)
    for path in paths:
        for number, piece in enumerate(path.pieces):
            x, y, _ = builder.position
            if not number or math.dist((x, y), piece.path.start) > SAME_PLACE:
                builder.rapid(z=_ABOVE)
                builder.rapid(*piece.path.start)
                builder.feed(z=level, feed=tool.feed)
            for step in piece.path.segments():
                if step.is_arc:
                    builder.arc(step.bulge < 0.0, (*step.end, level), Arc((*step.center, level)), feed=tool.feed)
                else:
                    builder.feed(*step.end, feed=tool.feed)
    builder.rapid(z=_ABOVE)
    return builder.build()
