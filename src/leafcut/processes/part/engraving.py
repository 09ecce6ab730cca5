"""Collect the paths to engrave from the layers of a part."""

from __future__ import annotations

from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.options import Settings
from leafcut.processes.part.model import Engraving
from leafcut.processes.part.operations import LayeredPart
from leafcut.read.operations import Operation


def engravings_of(divided: LayeredPart, settings: Settings, tool: int) -> tuple[list[Engraving], list[Issue]]:
    """Return the paths to engrave, and issues about repaired lines.

    If a layer names no tool, it uses the end mill `tool`.
    """
    from leafcut.processes.contours import engraved_paths

    engravings: list[Engraving] = []
    issues: list[Issue] = []
    for rule, contours in divided.faces_of(Operation.ENGRAVE):
        for contour in engraved_paths(contours, settings.sheet, issues):
            x, y = contour.path.start
            name = Message("the path at ({:.4g}, {:.4g}) on layer {}", x, y, contour.layer)
            engravings.append(Engraving(contour.path, rule.depth, rule.tool or tool, name, contour.layer))
    return engravings, issues
