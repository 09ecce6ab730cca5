"""Explains program lines in words, for beginners."""

from __future__ import annotations

import math

from leafcut.model.toolpath import Kind
from leafcut.sender.job import SendJob
from leafcut.sender.lines import DrilledHole
from leafcut.studio.wording import Words

#: Tolerance for equal positions, mm.
_SAME = 1e-6


def explained_lines_of_hole(job: SendJob, hole: DrilledHole, words: Words) -> list[tuple[int, str, str]]:
    """Return the number, the text and the explanation of each line that drills a hole, up to the retract."""
    following = job.holes[hole.number].first if hole.number < len(job.holes) else hole.last + 2
    last = min(max(hole.last, following - 1), hole.last + 1, len(job.program.lines))
    return [(line, job.line_text(line), explain_line(job, line, words)) for line in range(hole.first, last + 1)]


def explain_line(job: SendJob, line: int, words: Words) -> str:
    """Explain a line in words. Returns an empty string if the line needs no explanation."""
    path = job.program.path
    parts = []
    for row in (path.line == line).nonzero()[0].tolist():
        kind, value = Kind(int(path.kind[row])), float(path.value[row])
        end, before = path.end[row].tolist(), path.before[row].tolist()
        if kind in (Kind.ARC_CW, Kind.ARC_CCW):
            name = "clockwise" if kind is Kind.ARC_CW else "counter"
            parts.append(
                words(
                    f"explain.{name}",
                    x=_millimetres_text(end[0]),
                    y=_millimetres_text(end[1]),
                    feed=_feed_text(value),
                )
            )
        elif kind is Kind.RAPID or kind is Kind.FEED:
            parts.append(_explain_move(kind, before, end, value, words))
        elif kind is Kind.SPINDLE:
            parts.append(words("explain.spindle", rpm=f"{abs(value):g}") if value else words("explain.spindle_off"))
        elif kind is Kind.DWELL:
            parts.append(words("explain.dwell", seconds=f"{value:g}"))
    return "; ".join(part for part in parts if part)


def _explain_move(kind: Kind, before: list[float], end: list[float], feed: float, words: Words) -> str:
    """Explain a straight move. If a start coordinate is unknown (NaN), the move is assumed to change it."""
    sideways = any(not abs(a - b) <= _SAME for a, b in zip(before[:2], end[:2], strict=True))
    level = not abs(before[2] - end[2]) > _SAME
    rapid = kind is Kind.RAPID
    given = {
        "x": _millimetres_text(end[0]),
        "y": _millimetres_text(end[1]),
        "z": _millimetres_text(end[2]),
        "feed": _feed_text(feed),
    }
    if sideways and math.isfinite(end[0] + end[1]):
        return words(f"explain.{'go' if rapid else 'cut'}{'' if level else '_z'}", **given)
    if not math.isfinite(end[2]):
        return ""
    if level and math.isfinite(before[2]):
        return words("explain.stay", **given)
    up = not end[2] < before[2]
    key = ("rise" if rapid else "draw") if up else ("lower" if rapid else "drill")
    return words(f"explain.{key}", **given)


def _millimetres_text(value: float) -> str:
    return f"{value:.3f}".rstrip("0").rstrip(".") or "0"


def _feed_text(value: float) -> str:
    return f"{60.0 * value:.0f}"
