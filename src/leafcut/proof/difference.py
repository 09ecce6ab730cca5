"""Describe differences and positions in words, and limit the number of differences in a list."""

from __future__ import annotations

import math
from functools import partial

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Motion, Toolpath
from leafcut.units import to_fixed

#: Maximum number of differences in a list. A program that is wrong everywhere may have a million.
MOST_LISTED = 50


def limit_differences(differences: list[Difference], count: int | None = None) -> list[Difference]:
    """Return at most `MOST_LISTED` of `count` differences. If more exist, the last entry states how many."""
    total = len(differences) if count is None else count
    if total <= MOST_LISTED:
        return differences
    summary = Difference(Message("and more"), 0, 0, Message("{} more differences", total - MOST_LISTED))
    return [*differences[:MOST_LISTED], summary]


def position_text(x: float, y: float, z: float | None = None) -> str:
    """Describe a position in words: ``X10.000 Y20.000``, ``X10.000 and an unknown Y``, ``an unknown position``."""
    axes = [(axis, value) for axis, value in zip("XYZ", (x, y, z), strict=True) if value is not None]
    known = " ".join(f"{axis}{to_fixed(value, 3)}" for axis, value in axes if not math.isnan(value))
    unknown = [axis for axis, value in axes if math.isnan(value)]
    if known and unknown:
        return Message("{} and an unknown {}", known, Message.joined_by_and(unknown))
    return known or Message("an unknown position")


def start_and_end_texts(path: Toolpath, row: int) -> tuple[str, str]:
    """Describe the start and the end of a move in words."""
    return position_text(*path.before[row].tolist()), position_text(*path.end[row].tolist())


def describe_motion(motion: Motion) -> Message:
    """Describe a motion in words: ``rapid to X1.000 Y2.000 Z3.000``."""
    kind = motion.kind
    if kind is Kind.END:
        return Message("end of program")
    if kind is Kind.TORCH:
        return Message("torch on") if motion.value else Message("torch off")
    if kind is Kind.HEIGHT:
        return Message("height control on") if motion.value else Message("height control off")
    return _DESCRIPTIONS[kind](_motion_value_text(motion))


def _motion_value_text(motion: Motion) -> str:
    kind = motion.kind
    if kind is Kind.MACHINE:
        axes = zip("XYZ", motion.end, strict=True)
        known = " ".join(f"{axis}{to_fixed(value, 3)}" for axis, value in axes if not math.isnan(value))
        return known or position_text(*motion.end)
    if kind is Kind.PAUSE:
        return f"M{motion.ref}"
    if kind <= Kind.DRILL or kind in (Kind.PROBE, Kind.SHIFT):
        return position_text(*motion.end)
    if kind in (Kind.DWELL, Kind.SPINDLE):
        return f"{motion.value:g}"
    if kind is Kind.RADIUS:
        return f"G{motion.ref}" + (f" D{motion.value:g}" if motion.value else "")
    if kind in (Kind.FRAME, Kind.BLENDING):
        tolerance = f" P{motion.value:g}" if kind is Kind.BLENDING and motion.value else ""
        return f"G{motion.ref / 10:g}{tolerance}"
    return str(motion.ref)


#: Describes a row with its value, by kind.
_DESCRIPTIONS = {
    Kind.RAPID: partial(Message, "rapid to {}"),
    Kind.FEED: partial(Message, "feed to {}"),
    Kind.ARC_CW: partial(Message, "arc clockwise to {}"),
    Kind.ARC_CCW: partial(Message, "arc counter-clockwise to {}"),
    Kind.DRILL: partial(Message, "drilling cycle to {}"),
    Kind.DWELL: partial(Message, "dwell of {} s"),
    Kind.TOOL: partial(Message, "change to tool {}"),
    Kind.OFFSET: partial(Message, "length offset {}"),
    Kind.SPINDLE: partial(Message, "spindle speed {} rpm"),
    Kind.COOLANT: partial(Message, "coolant {}"),
    Kind.PAUSE: partial(Message, "pause {}"),
    Kind.MACHINE: partial(Message, "rapid in machine coordinates to {}"),
    Kind.FRAME: partial(Message, "work offset {}"),
    Kind.SHIFT: partial(Message, "shift of the origin that puts the tool at {}"),
    Kind.RADIUS: partial(Message, "radius compensation {}"),
    Kind.BLENDING: partial(Message, "blending {}"),
    Kind.FOREIGN: partial(Message, "block that is not understood, number {}"),
    Kind.PROBE: partial(Message, "probe to {}"),
}
