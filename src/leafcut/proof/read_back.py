"""Compare the motion that was read back from a program with the planned toolpath, row by row."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Mask
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import DrillCycle, Kind, Toolpath, plane_axes
from leafcut.proof.difference import describe_motion, limit_differences

#: Relative tolerance for feeds. No controller maintains a feed more precisely, and the difference is not visible on a
#: part.
FEED_PART = 0.005
#: Absolute tolerance for feeds, mm/s: half of 1 mm/min, the coarsest rounding in a program.
FEED_ROUNDING = 0.5 / 60.0 + 1e-6
#: Tolerances for dwells, s, and speeds, rpm. Programs state dwells in thousandths of a second and speeds in whole
#: revolutions.
DWELL_ROUNDING = 0.001
SPEED_ROUNDING = 0.5 + 1e-6

_FEEDING = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL, Kind.PROBE)
_PLACED = (Kind.RAPID, *_FEEDING, Kind.MACHINE, Kind.SHIFT)


def compare_motion(
    planned: Toolpath,
    written: Toolpath,
    tolerance_mm: float,
    *,
    offsets: bool = False,
) -> list[Difference]:
    """Compare the planned toolpath with the motion read back from the program. Both must have the same rows in order.

    Positions must agree within `tolerance_mm` per axis, and feeds within 0.5 % or half of 1 mm/min. Dwells, speeds,
    tools, coolant and pauses must agree except for rounding. Drilling cycles are compared as cycles (name, R plane,
    bottom, retract, peck, dwell, feed). Straight moves of length 0 are ignored, because a post-processor may omit them.

    A plan contains no length offsets. With `offsets`, each tool must activate its own offset before it cuts or moves in
    z.

    Returns
    -------
    list
        The differences; empty if the program matches the plan. At most `MOST_LISTED` differences are listed, and the
        last entry states how many more exist.
    """
    wrong = _rows_with_wrong_offset(written) if offsets else []
    a, b = (_drop_ineffective_rows(path) for path in (planned, written))
    if not np.array_equal(a.kind, b.kind):
        # A short move may disappear by rounding. All remaining rows are compared.
        a, b = (_without_tiny_moves(path, 2.0 * tolerance_mm) for path in (a, b))
    if not np.array_equal(a.kind, b.kind):
        return [*wrong, _first_divergence(a, b, tolerance_mm)]
    masks = _difference_masks(a, b, tolerance_mm)
    wrong_rows = np.flatnonzero(np.any([mask for _, mask in masks], axis=0))
    listed = [_describe_row_difference(a, b, int(row), masks) for row in wrong_rows[:100]]
    return limit_differences(wrong + listed, len(wrong) + len(wrong_rows))


def _drop_ineffective_rows(path: Toolpath) -> Toolpath:
    """Remove length offsets, straight moves of length 0, and torch resets before ignition."""
    before = path.before
    is_motionless = ((path.end == before) | (np.isnan(path.end) & np.isnan(before))).all(axis=1)
    empty_move = is_motionless & ((path.kind == Kind.RAPID) | (path.kind == Kind.FEED))
    unlit = np.cumsum((path.kind == Kind.SPINDLE) & (path.value != 0.0)) == 0
    reset = np.zeros(len(path), dtype=bool)
    for kind in (Kind.TORCH, Kind.HEIGHT):
        rows = np.flatnonzero(unlit & (path.kind == kind))
        reset[rows[: len(rows) - int(len(rows) > 0 and path.value[rows[-1]] == 0.0)]] = True
    return path.take(~empty_move & ~reset & (path.kind != Kind.OFFSET))


def _without_tiny_moves(path: Toolpath, length: float) -> Toolpath:
    """Drop straight moves that stay within `length` of the last row that was kept."""
    keep: list[int] = []
    last = (math.nan, math.nan, math.nan)
    for row, (kind, end) in enumerate(zip(path.kind.tolist(), path.end.tolist(), strict=True)):
        if kind in (Kind.RAPID, Kind.FEED) and all(
            abs(p - q) <= length or (math.isnan(p) and math.isnan(q)) for p, q in zip(end, last, strict=True)
        ):
            continue
        keep.append(row)
        if kind <= Kind.DRILL:
            last = (end[0], end[1], end[2])
        elif kind in (Kind.MACHINE, Kind.FRAME):
            last = (math.nan, math.nan, math.nan)
    return path.take(keep)


def _difference_masks(a: Toolpath, b: Toolpath, tolerance: float) -> list[tuple[Message, Mask]]:
    """Return the name and the mask of each kind of difference. Both paths must have the same kinds of rows."""
    wrong_ends = ~_values_agree(a.end, b.end, tolerance) & np.isin(a.kind, _PLACED)[:, None]
    feeding = np.isin(a.kind, _FEEDING)
    feed_tolerance = np.maximum(FEED_PART * np.abs(a.value), FEED_ROUNDING)
    speed_tolerance = np.maximum(0.001 * np.abs(a.value), SPEED_ROUNDING)
    turning = a.kind == Kind.SPINDLE
    refs = np.isin(a.kind, (Kind.TOOL, Kind.COOLANT, Kind.PAUSE, Kind.SPINDLE, Kind.RADIUS, Kind.BLENDING, Kind.FRAME))
    switches = np.isin(a.kind, (Kind.TORCH, Kind.HEIGHT, Kind.BLENDING))
    masks = [
        (Message("place"), wrong_ends[:, :2].any(axis=1)),
        (Message("height"), wrong_ends[:, 2]),
        (Message("feed"), feeding & ~_values_agree(a.value, b.value, feed_tolerance)),
        (Message("dwell"), (a.kind == Kind.DWELL) & ~_values_agree(a.value, b.value, DWELL_ROUNDING)),
        (
            Message("speed"),
            turning & (~_values_agree(a.value, b.value, speed_tolerance) | (np.sign(a.value) != np.sign(b.value))),
        ),
        (Message("command"), refs & (a.ref != b.ref)),
        (Message("kerf"), (a.kind == Kind.RADIUS) & ~_values_agree(a.value, b.value, tolerance)),
        (Message("switch"), switches & ~_values_agree(a.value, b.value, tolerance)),
    ]
    return [*masks, *_cycle_masks(a, b, tolerance), (Message("arc"), _arc_mask(a, b, tolerance))]


def _values_agree(a: NDArray[np.float64], b: NDArray[np.float64], tolerance: float | NDArray[np.float64]) -> Mask:
    """Return a mask of the values that agree within the tolerance. Two unknown values agree."""
    near: Mask = (np.abs(a - b) <= tolerance + 1e-9) | (np.isnan(a) & np.isnan(b))
    return near


def _cycle_masks(a: Toolpath, b: Toolpath, tolerance: float) -> Iterator[tuple[Message, Mask]]:
    drills = np.flatnonzero(a.kind == Kind.DRILL)
    if not len(drills):
        return
    numbers: tuple[tuple[Message, Callable[[DrillCycle], float], float], ...] = (
        (Message("R plane"), lambda c: c.r_plane, tolerance),
        (Message("depth"), lambda c: c.bottom, tolerance),
        # If a peck is at least as deep as the hole, the hole is drilled in a single stroke.
        (Message("peck"), lambda c: min(c.peck, c.r_plane - c.bottom) if c.name in ("G83", "G73") else 0.0, tolerance),
        (Message("cycle dwell"), lambda c: c.dwell if c.name in ("G82", "G84") else 0.0, DWELL_ROUNDING),
    )
    names = [np.array([c.name for c in path.cycles])[path.ref[drills]] for path in (a, b)]
    yield Message("cycle"), _expand_mask(len(a), drills, names[0] != names[1])
    for word, value_of, allowed in numbers:
        values = [np.array([value_of(c) for c in path.cycles], dtype=np.float64)[path.ref[drills]] for path in (a, b)]
        yield word, _expand_mask(len(a), drills, ~_values_agree(values[0], values[1], allowed))


def _expand_mask(n: int, rows: NDArray[np.intp], mask: Mask) -> Mask:
    full = np.zeros(n, dtype=bool)
    full[rows] = mask
    return full


def _arc_mask(a: Toolpath, b: Toolpath, tolerance: float) -> Mask:
    wrong = np.zeros(len(a), dtype=bool)
    for row in np.flatnonzero((a.kind == Kind.ARC_CW) | (a.kind == Kind.ARC_CCW)).tolist():
        planned_arc, written_arc = a.arcs[int(a.ref[row])], b.arcs[int(b.ref[row])]
        axes = plane_axes(planned_arc.plane)[:2]
        distance = max(abs(planned_arc.center[i] - written_arc.center[i]) for i in axes)
        wrong[row] = (
            planned_arc.plane != written_arc.plane
            or planned_arc.turns != written_arc.turns
            or not distance <= tolerance + 1e-9
        )
    return wrong


def _describe_row_difference(a: Toolpath, b: Toolpath, row: int, masks: list[tuple[Message, Mask]]) -> Difference:
    kind = next(word for word, mask in masks if mask[row])
    before, after = _SHOWN.get(kind, _row_text)(a, row), _SHOWN.get(kind, _row_text)(b, row)
    text = Message("planned {}, written {}", before, after)
    if kind in _SHOWN and a.kind[row] <= Kind.DRILL:
        text = Message("{}, {}", text, describe_motion(a[row]))
    return Difference(kind, int(a.line[row]), int(b.line[row]), text)


def _row_text(path: Toolpath, row: int) -> str:
    return describe_motion(path[row])


def _cycle_value_text(word: str, unit: str) -> Callable[[Toolpath, int], str]:
    return lambda path, row: f"{getattr(path.cycles[int(path.ref[row])], word)}{unit}"


_SHOWN: dict[str, Callable[[Toolpath, int], str]] = {
    "feed": lambda path, row: f"{path.value[row] * 60.0:.6g} mm/min",
    "arc": lambda path, row: str(path.arcs[int(path.ref[row])]),
    "cycle": _cycle_value_text("name", ""),
    "R plane": _cycle_value_text("r_plane", " mm"),
    "depth": _cycle_value_text("bottom", " mm"),
    "peck": _cycle_value_text("peck", " mm"),
    "cycle dwell": _cycle_value_text("dwell", " s"),
}


def _first_divergence(a: Toolpath, b: Toolpath, tolerance: float) -> Difference:
    shorter = min(len(a), len(b))
    kinds = np.flatnonzero(a.kind[:shorter] != b.kind[:shorter])
    n_same = int(kinds[0]) if len(kinds) else shorter
    head_a, head_b = a.take(slice(n_same)), b.take(slice(n_same))
    wrong = np.flatnonzero(np.any([m for _, m in _difference_masks(head_a, head_b, tolerance)], axis=0))
    row = int(wrong[0]) if len(wrong) else n_same
    shown = [describe_motion(path[row]) if row < len(path) else Message("nothing more") for path in (a, b)]
    lines = [int(path.line[row]) if row < len(path) else 0 for path in (a, b)]
    return Difference(
        Message("order of moves"),
        lines[0],
        lines[1],
        Message("planned {}, written {}; {} rows planned, {} written", shown[0], shown[1], len(a), len(b)),
    )


def _rows_with_wrong_offset(path: Toolpath) -> list[Difference]:
    """Return the rows in which a tool cuts or moves in z without its own length offset."""
    tool, offset = path.tool, path.length_offset
    before = path.before[:, 2]
    rises = (path.kind == Kind.RAPID) & np.isfinite(path.end[:, 2]) & ~(path.end[:, 2] == before)
    wrong = np.flatnonzero((np.isin(path.kind, _FEEDING) | rises) & (tool > 0) & (offset != tool))
    if not len(wrong):
        return []
    _, first = np.unique(np.column_stack([tool[wrong], offset[wrong]]), axis=0, return_index=True)
    return [
        Difference(
            Message("length offset"),
            0,
            int(path.line[row]),
            Message(
                "tool {} moves with length offset {} instead of its own; {}",
                tool[row],
                offset[row],
                describe_motion(path[int(row)]),
            ),
        )
        for row in wrong[np.sort(first)]
    ]
