"""Extract the parts to nest from a prepared drawing, with their holes and marks."""

from __future__ import annotations

from dataclasses import replace

from leafcut.errors import PlanError
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.nest import NestPart
from leafcut.model.sheet import Sheet


def parts_of(sheet: Sheet, quantity: int, rotations: tuple[float, ...] | None) -> tuple[list[NestPart], list[Issue]]:
    """Return the parts of a drawing, each with the given quantity, and issues. `rotations` are the allowed angles, rad.

    Raises PlanError if the drawing has no closed outline.
    """
    contours_by_part: dict[int, list[Contour]] = {}
    outlines = [c for c in sheet.contours if _is_outline(c)]
    for contour in (*outlines, *(c for c in sheet.contours if not _is_outline(c))):
        contours_by_part.setdefault(contour.part, []).append(replace(contour, depth=0, parent=-1))
    strays = [] if any(c.part == 0 for c in outlines) else contours_by_part.pop(0, [])
    if not outlines:
        raise PlanError(f"{sheet.name}: no closed outline of a part; join its lines, or select its layer")
    several = len(contours_by_part) > 1
    parts = [
        NestPart(f"{sheet.name}-{number}" if several else sheet.name, tuple(contours), quantity, rotations)
        for number, (_, contours) in enumerate(sorted(contours_by_part.items()), 1)
    ]
    issues = []
    if several:
        message = f"{sheet.name}: {len(parts)} parts in one drawing; each is nested {quantity} times"
        issues.append(Issue("L432", message, severity=Severity.NOTE))
    if strays:
        x, y = strays[0].path.start
        message = f"{sheet.name}: {len(strays)} lines that lie in no part were left out"
        message = message if len(strays) > 1 else f"{sheet.name}: 1 line that lies in no part was left out"
        missing = MissingWork("line", len(strays), tuple(stray.path.start for stray in strays))
        position = f"at ({x:g}, {y:g})" + (" …" if len(strays) > 1 else "")
        issues.append(Issue("L431", message, position, missing=missing))
    return parts, issues


def _is_outline(contour: Contour) -> bool:
    return contour.path.closed and contour.kind == "cut" and contour.depth % 2 == 0
