"""Describe differences and positions in words, and limit their number."""

from __future__ import annotations

import math

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Motion, Toolpath
from leafcut.units import to_fixed

#: Maximum number of listed differences; a program that is wrong everywhere may have a million.
MOST_LISTED = 50


def limit_differences(differences: list[Difference], count: int | None = None) -> list[Difference]:
    """Return at most `MOST_LISTED` differences; if there are more, the last one states how many of `count` are not
    listed.
    """
    total = len(differences) if count is None else count
    if total <= MOST_LISTED:
        return differences
    summary = Difference("and more", 0, 0, Message("{} more differences", total - MOST_LISTED))
    return [*differences[:MOST_LISTED], summary]


def position_text(x: float, y: float, z: float | None = None) -> str:
    """Describe a position in words: ``X10.000 Y20.000``, ``X10.000 and an unknown Y``, ``an unknown position``."""
    axes = [(axis, value) for axis, value in zip("XYZ", (x, y, z), strict=True) if value is not None]
    known = " ".join(f"{axis}{to_fixed(value, 3)}" for axis, value in axes if not math.isnan(value))
    unknown = " and ".join(axis for axis, value in axes if math.isnan(value))
    if known and unknown:
        return Message("{} and an unknown {}", known, unknown)
    return known or "an unknown position"


def end_texts(path: Toolpath, row: int) -> tuple[str, str]:
    """Return the start and the end of a move in words."""
    return position_text(*path.before[row].tolist()), position_text(*path.end[row].tolist())


def describe_motion(motion: Motion) -> str:
    """Describe a row in words, for example ``rapid to X1.000 Y2.000 Z3.000``."""
    if motion.kind is Kind.MACHINE:
        axes = " ".join(
            f"{axis}{to_fixed(v, 3)}" for axis, v in zip("XYZ", motion.end, strict=True) if not math.isnan(v)
        )
        return f"{_WORDS[motion.kind]} to {axes or position_text(*motion.end)}"
    if motion.kind is Kind.PAUSE:
        return f"{_WORDS[motion.kind]} M{motion.ref}"
    if motion.kind <= Kind.DRILL or motion.kind is Kind.PROBE:
        return f"{_WORDS[motion.kind]} to {position_text(*motion.end)}"
    if motion.kind is Kind.SHIFT:
        return f"{_WORDS[motion.kind]} that puts the tool at {position_text(*motion.end)}"
    if motion.kind in (Kind.DWELL, Kind.SPINDLE):
        return f"{_WORDS[motion.kind]} {motion.value:g}"
    if motion.kind is Kind.RADIUS:
        return f"{_WORDS[motion.kind]} G{motion.ref}" + (f" D{motion.value:g}" if motion.value else "")
    if motion.kind in (Kind.FRAME, Kind.BLENDING):
        tolerance = f" P{motion.value:g}" if motion.kind is Kind.BLENDING and motion.value else ""
        return f"{_WORDS[motion.kind]} G{motion.ref / 10:g}{tolerance}"
    if motion.kind in (Kind.TORCH, Kind.HEIGHT):
        return f"{_WORDS[motion.kind]} {'on' if motion.value else 'off'}"
    return f"{_WORDS[motion.kind]} {motion.ref}" if motion.kind is not Kind.END else _WORDS[motion.kind]


_WORDS = {
    Kind.RAPID: "rapid",
    Kind.FEED: "feed",
    Kind.ARC_CW: "arc clockwise",
    Kind.ARC_CCW: "arc counter-clockwise",
    Kind.DRILL: "drilling cycle",
    Kind.DWELL: "dwell of seconds",
    Kind.TOOL: "change to tool",
    Kind.OFFSET: "length offset",
    Kind.SPINDLE: "spindle at rpm",
    Kind.COOLANT: "coolant",
    Kind.PAUSE: "pause",
    Kind.MACHINE: "rapid in machine coordinates",
    Kind.END: "end of program",
    Kind.FRAME: "work offset",
    Kind.SHIFT: "shift of the origin",
    Kind.RADIUS: "radius compensation",
    Kind.BLENDING: "blending",
    Kind.FOREIGN: "block that is not understood, number",
    Kind.TORCH: "torch",
    Kind.HEIGHT: "height control",
    Kind.PROBE: "probe",
}
