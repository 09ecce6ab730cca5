"""Check a program that mills the same part in several fixtures, each with its own work offset.

The positions of the fixtures are unknown. So the tool must be fully retracted before the work offset changes, and the
first move after the change must be level. The cuts in each work offset are compared with the request separately.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import FIRST_OFFSET, MOTIONS, Kind, Toolpath, g_word, latest_marked_rows
from leafcut.processes.part.model import PartRequest
from leafcut.processes.part.proof.cuts import HEIGHT
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.difference import limit_differences


def judge_fixtures(
    request: PartRequest, written: Toolpath, work_offsets: Sequence[int], safe_z: float | None, clearance: float
) -> list[Difference]:
    """Compare the work in each fixture with the request, and check the moves between the fixtures.

    Parameters
    ----------
    work_offsets
        Work offset of each fixture in the order of the work, in tenths.
    safe_z
        Safe height in machine coordinates, mm. Without one, the tool moves at the `clearance` height, mm.
    """
    active = written.latest(Kind.FRAME, written.ref, FIRST_OFFSET)
    moving = np.isin(written.kind, MOTIONS)
    differences = [*_check_visits(written, work_offsets, active, moving), *_check_changes(written, safe_z, clearance)]
    for offset in work_offsets:
        own = judge_part(request, written.take(~moving | (active == offset)))
        if len(work_offsets) > 1:
            own = [replace(one, text=Message("{}: {}", g_word(offset), one.text)) for one in own]
        differences += own
    return limit_differences(differences)


def at_common_height(path: Toolpath) -> Toolpath:
    """Return the same toolpath under the assumption that Z0 of all fixtures is at the same height.

    A change of the work offset then keeps the height of the tool.
    """
    lost = np.isnan(path.end[:, 2]) & np.isin(path.kind, [Kind.RAPID, Kind.FRAME])
    known = latest_marked_rows(np.isfinite(path.end[:, 2]) & np.isin(path.kind, MOTIONS))
    end = path.end.copy()
    end[lost, 2] = np.where(known[lost] >= 0, path.end[known[lost], 2], np.nan)
    return replace(path, end=end)


def _check_visits(
    path: Toolpath, work_offsets: Sequence[int], active: NDArray[np.int64], moving: NDArray[np.bool_]
) -> list[Difference]:
    """Check that each tool works once in each fixture, in the given order."""
    names = ", ".join(map(g_word, work_offsets))
    number = np.cumsum(path.kind == Kind.TOOL)
    differences = []
    for visit in range(int(number.max(initial=0)) + 1):
        rows = np.flatnonzero(moving & (number == visit))
        if visit == 0 and not len(rows):
            continue
        if not len(rows):
            rows = np.flatnonzero((path.kind == Kind.TOOL) & (number == visit))
        visited = active[rows]
        first = rows[np.append(True, visited[1:] != visited[:-1])[: len(rows)]]
        if active[first].tolist() != list(work_offsets):
            words = ", ".join(map(g_word, active[first].tolist()))
            text = Message("T{} works in {}, not once in each of {}", int(path.tool[rows[0]]), words, names)
            differences.append(Difference(Message("fixtures"), 0, int(path.line[rows[0]]), text))
    return differences


def _is_at_safe_height(path: Toolpath, rows: NDArray[np.int64], safe_z: float) -> bool:
    """Return whether the last of the motions `rows` with a height ends at the safe height of the machine.

    Moves to a position for tool changes keep this height.
    """
    for row in rows[::-1].tolist():
        if path.kind[row] != Kind.MACHINE:
            return False
        if np.isfinite(path.end[row, 2]):
            return bool(path.end[row, 2] >= safe_z - HEIGHT)
    return False


def _check_changes(path: Toolpath, safe_z: float | None, clearance: float) -> list[Difference]:
    """Check that the tool is retracted before each change of the work offset, and that it then moves level.

    Without a safe height, a move to the clearance height may follow a change of the tool.
    """
    differences = []
    high = np.isin(path.kind, [*MOTIONS, Kind.MACHINE])
    changes, tool = np.flatnonzero(path.kind == Kind.FRAME), np.flatnonzero(path.kind == Kind.TOOL)
    for row in changes.tolist():
        before, after = np.flatnonzero(high[:row]), row + np.flatnonzero(high[row:])
        if not len(after):
            continue
        last, following = path[int(before[-1])] if len(before) else None, path[int(after[0])]
        is_new_tool = bool(((tool < row) & (tool > (before[-1] if len(before) else -1))).any())
        if safe_z is not None:
            is_retracted = _is_at_safe_height(path, before, safe_z)
        else:
            is_retracted = is_new_tool or (last is not None and last.end[2] >= clearance - HEIGHT)
        x, y, z = following.end
        is_level = following.kind is Kind.RAPID and np.isfinite([x, y]).all() and np.isnan(z)
        if safe_z is None and is_new_tool:
            is_level = following.kind is Kind.RAPID and np.isnan([x, y]).all() and z >= clearance - HEIGHT
        if not (is_retracted and is_level):
            text = Message(
                "the tool must be retracted before {} is selected, and then move in X and Y alone",
                g_word(int(path.ref[row])),
            )
            differences.append(Difference(Message("fixtures"), 0, int(path.line[row]), text))
    return differences
