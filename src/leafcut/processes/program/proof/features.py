"""Store the holes, cuts and dwells of a toolpath as features, in columns with all values that verification compares.

A million features must fit into memory, so values that rarely change are stored in tables.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.block_description import normalize_line
from leafcut.gcode.program import Modal, Program
from leafcut.geometry.arrays import Floats, Indices, Ints, Mask
from leafcut.message import Message
from leafcut.model.toolpath import SPEED_ALONE, DrillCycle, Kind, Toolpath, latest_marked_rows

Selection = Indices | Mask | slice | int

#: Values that must be equal. They belong to the features, to `Modal` (the plane counts only for arcs and with radius
#: compensation), and to `TextHistory`.
EXACT = (
    "kind", "plane", "turns", "tool", "coolant",
    "length", "frame", "radius", "blending", "feed_mode", "spindle", "stated", "obeyed", "table",
)  # fmt: skip
#: Points, mm: the end of a cut or the bottom of a hole, the start, and the centre of an arc.
PLACE = ("x", "y", "depth", "start x", "start y", "start z", "centre x", "centre y", "centre z")
#: Amounts: feed in mm/s, speed in rpm (negative for M4), peck in mm, dwell in s, D number, and two tolerances in mm.
AMOUNT = ("feed", "speed", "peck", "dwell", "register", "tolerance", "joining")
#: The new program may use greater values for these heights, mm.
HEIGHT = ("r_plane", "retract")

#: Names of the kinds of cuts in messages.
CUTS = {
    Kind.RAPID: Message("rapid under radius compensation"),
    Kind.FEED: Message("cut"),
    Kind.ARC_CW: Message("clockwise arc"),
    Kind.ARC_CCW: Message("counter-clockwise arc"),
    Kind.DWELL: Message("dwell"),
}
_ALL = slice(None)


@dataclass(frozen=True, eq=False)
class ProgramPath:
    """The toolpath of a program. Its cycles may have been expanded, and its straight moves merged.

    `source` maps each row of `path` to its program row, int64[n].
    """

    program: Program
    path: Toolpath
    source: Indices

    @classmethod
    def of(cls, program: Program) -> ProgramPath:
        """Return the unchanged toolpath of a program."""
        return cls(program, program.path, np.arange(len(program.path)))

    def modal(self, field: str, rows: Selection = _ALL) -> NDArray:
        """Return the values of a `Modal` field at the given rows."""
        return self.program.modal_at_rows(field)[self.source[rows]]

    def modal_at(self, row: int) -> Modal:
        """Return the modal state that applies to a row."""
        return self.program.modals[int(self.program.row_modal[self.source[row]])]


class TextHistory(NamedTuple):
    """Facts about the earlier text of a program that no modal value shows, per row or per feature, [n].

    Attributes
    ----------
    stated
        Bits for three facts: the units are stated, the spindle was started after the tool change, and a length offset
        was stated and not cancelled.
    obeyed
        Number of earlier comments and settings that the controller obeys.
    table
        Number of blocks that may have changed the tool table before the length offset was stated.
    """

    stated: Ints
    obeyed: Ints
    table: Ints


class Tables(NamedTuple):
    """Data of arcs and cycles. In each column, entry 0 is 0 and stands for features that are neither arcs nor cycles.

    Arcs have `center` (float64[a, 3], mm), `plane` and `turns`. Cycles have `r_plane` and `peck` (mm).
    """

    center: Floats
    plane: Indices
    turns: Indices
    r_plane: Floats
    peck: Floats


@dataclass(frozen=True, eq=False)
class Features:
    """Holes, cuts and dwells in program order.

    The method `of` returns the columns named in `EXACT`, `PLACE`, `AMOUNT` and `HEIGHT`.

    Attributes
    ----------
    row, line
        Row of the toolpath and line of the text, int32[n].
    kind
        Kind of each feature, int64[n]. A cut has its `Kind`. A cycle has its name as a number, `FIRST_CYCLE` or higher.
    end, start
        Points, float64[n, 3], mm. A hole ends at its bottom and starts at the retract height.
    feed, dwell
        Feed, mm/s, and dwell, s, float64[n].
    state, arc, cycle
        Rows in `modals` and in `tables`, int32[n].
    group
        Features of different groups never match, int64[n].
    """

    row: Ints
    line: Ints
    kind: Indices
    end: Floats
    start: Floats
    feed: Floats
    dwell: Floats
    state: Ints
    arc: Ints
    cycle: Ints
    group: Indices
    history: TextHistory
    modals: dict[str, NDArray]
    tables: Tables

    def __len__(self) -> int:
        return len(self.row)

    def of(self, name: str, rows: Selection = _ALL) -> NDArray:
        """Return the column with the given name for the given rows."""
        column: NDArray
        match name:
            case "x" | "y" | "depth":
                column = self.end[rows, ("x", "y", "depth").index(name)]
            case "start x" | "start y":
                column = self.start[rows, int(name == "start y")]
            case "start z":
                column = np.where(self.kind[rows] >= FIRST_CYCLE, 0.0, self.start[rows, 2])
            case "retract":
                column = np.where(self.kind[rows] >= FIRST_CYCLE, self.start[rows, 2], 0.0)
            case "centre x" | "centre y" | "centre z":
                column = self.tables.center[self.arc[rows], "xyz".index(name[-1])]
            case "plane":
                arc = self.arc[rows]
                compensated = np.abs(self._modal("radius", rows)) != 40
                column = np.where(arc > 0, self.tables.plane[arc], np.where(compensated, self._modal(name, rows), 0))
            case "turns":
                column = self.tables.turns[self.arc[rows]]
            case "peck" | "r_plane":
                column = getattr(self.tables, name)[self.cycle[rows]]
            case "kind" | "feed" | "dwell":
                column = getattr(self, name)[rows]
            case "stated" | "obeyed" | "table":
                column = getattr(self.history, name)[rows]
            case "speed":
                column = self._modal("spindle", rows) * self._modal("rpm", rows)
            case _:
                column = self._modal(name, rows)
        return column

    def _modal(self, field: str, rows: Selection) -> NDArray:
        column: NDArray = self.modals[field][self.state[rows]]
        return column

    def several(self, names: Iterable[str], rows: Selection = _ALL) -> NDArray:
        """Return several columns side by side in an array [n, names]."""
        return np.column_stack([self.of(name, rows) for name in names])

    def pick(self, which: Mask | Indices) -> Features:
        """Return the features with the given indices or mask."""
        history = TextHistory(*(column[which] for column in self.history))
        return replace(self, history=history, **{name: getattr(self, name)[which] for name in _BY_FEATURE})


_BY_FEATURE = ("row", "line", "kind", "end", "start", "feed", "dwell", "state", "arc", "cycle", "group")


def feature_kind_name(kind: int) -> str:
    """Return the name of a kind of feature, such as ``cut`` or ``G83``."""
    return CUTS[Kind(kind)] if kind < FIRST_CYCLE else kind.to_bytes(7, "big").lstrip(b"\0").decode("ascii", "replace")


#: Lowest number of a cycle. To get the number of a cycle, the bytes of its name are read as an integer.
FIRST_CYCLE = 256


def _number_of(cycle: DrillCycle) -> int:
    return int.from_bytes(cycle.name.encode("ascii", "replace")[:7], "big")


#: Fields of `Modal` in `EXACT` and `AMOUNT`, and the fields from which `speed` is computed.
_MODAL = (
    "plane", "tool", "coolant", "length", "frame", "radius", "register", "blending", "tolerance", "joining",
    "feed_mode", "spindle", "rpm",
)  # fmt: skip


def _columns(modals: Iterable[Modal]) -> dict[str, NDArray]:
    """Return the compared fields of modal states as columns. An unknown tool counts as 0."""
    every = list(modals)
    return {name: np.array([getattr(modal, name) or 0 for modal in every]) for name in _MODAL}


def _history(program: Program) -> TextHistory:
    path, length = program.path, program.modal_at_rows("length")
    stated = (program.row_block >= first_block_with_units(program)) + 2 * _spindle_started(
        path, program.modal_at_rows("spindle")
    )
    return TextHistory(
        (stated + 4 * _length_offset_known(path, length)).astype(np.int8),
        np.searchsorted([setting.line for setting in program.obeyed], path.line).astype(np.int32),
        path.latest(Kind.OFFSET, np.cumsum(path.kind == Kind.FOREIGN)).astype(np.int32),
    )


def _spindle_started(path: Toolpath, spindle: Indices) -> Indices:
    """Return 0 for rows in which the spindle turns but has not been started since the last tool change, otherwise 1.

    M6 stops the spindle on LinuxCNC and on Haas machines. On other controllers, it may keep turning.
    """
    starts = (path.kind == Kind.SPINDLE) & (path.ref != SPEED_ALONE)
    last = [latest_marked_rows(which) for which in (starts, path.kind == Kind.TOOL)]
    started: Indices = ((last[0] >= last[1]) | (spindle == 0)).astype(np.int64)
    return started


def same_state_mask(rows: ProgramPath) -> Mask:
    """Return whether each row but the first has the same machine state as the row before it."""
    number = rows.program.row_modal[rows.source]
    changed = np.flatnonzero(number[1:] != number[:-1])
    equal = np.ones(max(len(number) - 1, 0), dtype=bool)
    for column in _columns(rows.program.modals).values():
        equal[changed] &= column[number[changed + 1]] == column[number[changed]]
    for column in _history(rows.program):
        value = column[rows.source]
        equal &= value[1:] == value[:-1]
    return equal


def compensated_moves(rows: ProgramPath) -> Mask:
    """Return a mask of the moves with cutter compensation, and of the move after them, which is still affected."""
    moving = np.flatnonzero(rows.path.kind <= Kind.DRILL)
    on = np.abs(rows.modal("radius", moving)) != 40
    mask = np.zeros(len(rows.path), dtype=bool)
    mask[moving] = on | np.concatenate([[False], on[:-1]])[: len(on)]
    return mask


def _length_offset_known(path: Toolpath, length: Indices) -> Indices:
    """Return 0 for rows in which the length offset may have been cancelled since it was stated, otherwise 1.

    On some controllers, such as Fanuc and Haas, a tool change or a move to a machine position (G28, G53) cancels it.
    """
    offset = path.kind == Kind.OFFSET
    taken, lost = (
        latest_marked_rows(offset),
        latest_marked_rows(np.isin(path.kind, [int(Kind.TOOL), int(Kind.MACHINE)])),
    )
    found: Indices = ((taken >= lost) | (length == 0)).astype(np.int64)
    return found


def first_block_with_units(program: Program) -> int:
    """Return the first block that states the units, or the number of blocks."""
    for block, line in enumerate(program.line.tolist()):
        text = program.lines[line - 1]
        if ("2" in text or "7" in text) and _UNITS.search(normalize_line(text)):
            return block
    return program.n_blocks


_UNITS = re.compile(r"G0*(?:20|21|70|71)(?![0-9.])")


def features_of(program_path: ProgramPath, which: Mask) -> Features:
    """Return the features in the rows `which`: cuts, cycles, dwells, and rapids with cutter compensation."""
    program, path = program_path.program, program_path.path
    rows = np.flatnonzero(which)
    source = program_path.source[rows]
    kind = path.kind[rows].astype(np.int64)
    start = path.before[rows]
    dwell, drill = kind == Kind.DWELL, kind == Kind.DRILL
    end = path.end[rows]
    end[dwell] = start[dwell]
    value, ref = path.value[rows], path.ref[rows]
    curved = (kind == Kind.ARC_CW) | (kind == Kind.ARC_CCW)
    if drill.any():
        kind[drill] = np.array([_number_of(c) for c in path.cycles], dtype=np.int64)[ref[drill]]
        # The start of a hole is above it, at the retract height.
        start[drill] = end[drill]
        end[drill, 2] = np.array([c.bottom for c in path.cycles])[ref[drill]]
    waits = np.where(dwell, value, 0.0)
    waits[drill] = np.array([c.dwell for c in path.cycles], dtype=np.float64)[ref[drill]]
    return Features(
        row=rows.astype(np.int32),
        line=path.line[rows],
        kind=kind,
        end=end,
        start=start,
        feed=np.where(dwell | (kind == Kind.RAPID), 0.0, value),
        dwell=waits,
        state=program.row_modal[source],
        arc=np.where(curved, ref + 1, 0).astype(np.int32),
        cycle=np.where(drill, ref + 1, 0).astype(np.int32),
        group=np.zeros(len(rows), dtype=np.int64),
        history=TextHistory(*(column[source] for column in _history(program))),
        modals=_columns(program.modals),
        tables=_tables_of(path),
    )


def is_uniform(cuts: Features) -> bool:
    """Return whether the first and the last cut have the same kind and feed as most other cuts.

    If they differ, the path has a lead-in or a lead-out.
    """
    if len(cuts) == 1:
        return True
    arc, feed = (cuts.kind != Kind.FEED).tolist(), cuts.feed.round(6).tolist()
    usual = Counter(feed).most_common(1)[0][0]
    return arc[0] in arc[1:] and arc[-1] in arc[:-1] and feed[0] == feed[-1] == usual


def _tables_of(path: Toolpath) -> Tables:
    return Tables(
        np.array([(0.0, 0.0, 0.0), *(a.center for a in path.arcs)]),
        np.array([0, *(a.plane for a in path.arcs)], dtype=np.int64),
        np.array([0, *(a.turns for a in path.arcs)], dtype=np.int64),
        np.array([0.0, *(c.r_plane for c in path.cycles)]),
        np.array([0.0, *(c.peck for c in path.cycles)]),
    )
