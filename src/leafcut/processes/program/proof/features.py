"""Features are the holes, cuts and dwells of a toolpath, in columns with all values that verification compares.

A million features must fit into memory, so values that rarely change are kept in tables.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.block_description import normalized
from leafcut.gcode.program import Modal, Program
from leafcut.geometry.arrays import Floats, Indices, Ints, Mask
from leafcut.message import Message
from leafcut.model.toolpath import SPEED_ALONE, DrillCycle, Kind, Toolpath, last_rows

Selection = Indices | Mask | slice | int

#: Values that must be equal: of the features, of `Modal` (the plane only of arcs and under radius compensation), and of
#: `TextHistory`.
EXACT = (
    "kind", "plane", "turns", "tool", "coolant",
    "length", "frame", "radius", "blending", "feed_mode", "spindle", "stated", "obeyed", "table",
)  # fmt: skip
#: Points, mm: end of a cut or bottom of a hole, start, centre of an arc.
PLACE = ("x", "y", "depth", "start x", "start y", "start z", "centre x", "centre y", "centre z")
#: Amounts: feed in mm/s, speed in rpm (negative for M4), peck in mm, dwell in s, D number, two tolerances in mm.
AMOUNT = ("feed", "speed", "peck", "dwell", "register", "tolerance", "joining")
#: Heights that may be higher in the new program, mm.
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
    """The toolpath of a program. Its cycles may be expanded, and its straight moves merged.

    `source`, int64[n], is the program row of each row of `path`.
    """

    program: Program
    path: Toolpath
    source: Indices

    @classmethod
    def of(cls, program: Program) -> ProgramPath:
        """Return the unchanged toolpath of a program."""
        return cls(program, program.path, np.arange(len(program.path)))

    def modal(self, field: str, rows: Selection = _ALL) -> NDArray:
        """Return the values of a field of `Modal` at the given rows."""
        return self.program.modal_at_rows(field)[self.source[rows]]

    def modal_at(self, row: int) -> Modal:
        """Return the modal state in which a row acts."""
        return self.program.modals[int(self.program.row_modal[self.source[row]])]


class TextHistory(NamedTuple):
    """Facts about the earlier text of a program that no modal value shows, for each row or each feature, [n].

    `stated` has a bit for stated units, for a spindle start since the tool change, and for a length offset that is not
    cancelled. `obeyed` is the number of earlier comments and settings that the controller obeys. `table` is the number
    of blocks before the length offset was stated that may have changed the tool table.
    """

    stated: Ints
    obeyed: Ints
    table: Ints


class Tables(NamedTuple):
    """Data of arcs and cycles. Entry 0 of each column is 0; features that are neither arcs nor cycles refer to it.

    Arcs have `center` (float64[a, 3], mm), `plane` and `turns`; cycles have `r_plane` and `peck` (mm).
    """

    center: Floats
    plane: Indices
    turns: Indices
    r_plane: Floats
    peck: Floats


@dataclass(frozen=True, eq=False)
class Features:
    """Holes, cuts and dwells in program order. `of` returns the columns that `EXACT`, `PLACE`, `AMOUNT` and `HEIGHT`
    name.

    Attributes
    ----------
    row, line
        int32[n]: row of the toolpath, and line of the text.
    kind
        int64[n]: `Kind` of a cut; for a cycle, its name as a number from `FIRST_CYCLE` up.
    end, start
        float64[n, 3], mm. The end of a hole is its bottom, and its start is at the retract height.
    feed, dwell
        float64[n]: feed, mm/s, and dwell, s.
    state, arc, cycle
        int32[n]: rows in `modals` and in `tables`.
    group
        int64[n]: features of different groups never match.
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
        """Return several columns side by side, as an array [n, names]."""
        return np.column_stack([self.of(name, rows) for name in names])

    def pick(self, which: Mask | Indices) -> Features:
        """Return the features with the given indices, or those that a mask selects."""
        history = TextHistory(*(column[which] for column in self.history))
        return replace(self, history=history, **{name: getattr(self, name)[which] for name in _BY_FEATURE})


_BY_FEATURE = ("row", "line", "kind", "end", "start", "feed", "dwell", "state", "arc", "cycle", "group")


def name_of(kind: int) -> str:
    """Return the name of a kind of feature, such as ``cut`` or ``G83``."""
    return CUTS[Kind(kind)] if kind < FIRST_CYCLE else kind.to_bytes(7, "big").lstrip(b"\0").decode("ascii", "replace")


#: Lowest number of a cycle. The number is the name of the cycle, read as the bytes of an integer.
FIRST_CYCLE = 256


def _number_of(cycle: DrillCycle) -> int:
    return int.from_bytes(cycle.name.encode("ascii", "replace")[:7], "big")


#: Fields of `Modal` in `EXACT` and `AMOUNT`, and those from which `speed` is computed.
_MODAL = (
    "plane", "tool", "coolant", "length", "frame", "radius", "register", "blending", "tolerance", "joining",
    "feed_mode", "spindle", "rpm",
)  # fmt: skip


def _columns(modals: Iterable[Modal]) -> dict[str, NDArray]:
    """Return the compared fields of modal states as columns; an unknown tool counts as 0."""
    every = list(modals)
    return {name: np.array([getattr(modal, name) or 0 for modal in every]) for name in _MODAL}


def _history(program: Program) -> TextHistory:
    """Return the text history at each row of a program."""
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
    """Return 0 for rows where the spindle turns without a start since the last tool change, and 1 for all others.

    M6 stops the spindle on LinuxCNC and on Haas machines; on other controllers it may not.
    """
    starts = (path.kind == Kind.SPINDLE) & (path.ref != SPEED_ALONE)
    last = [last_rows(which) for which in (starts, path.kind == Kind.TOOL)]
    started: Indices = ((last[0] >= last[1]) | (spindle == 0)).astype(np.int64)
    return started


def same_state(rows: ProgramPath) -> Mask:
    """Return a mask of all rows except the first: whether the machine state equals that of the row before."""
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
    """Return a mask of the moves under cutter compensation, and of the next move, which is still affected."""
    moving = np.flatnonzero(rows.path.kind <= Kind.DRILL)
    on = np.abs(rows.modal("radius", moving)) != 40
    mask = np.zeros(len(rows.path), dtype=bool)
    mask[moving] = on | np.concatenate([[False], on[:-1]])[: len(on)]
    return mask


def _length_offset_known(path: Toolpath, length: Indices) -> Indices:
    """Return 0 for rows whose length offset may be cancelled since it was stated, and 1 for all others.

    On some controllers, such as Fanuc and Haas, a tool change or a move to a machine position (G28, G53) cancels it.
    """
    offset = path.kind == Kind.OFFSET
    taken, lost = last_rows(offset), last_rows(np.isin(path.kind, [int(Kind.TOOL), int(Kind.MACHINE)]))
    found: Indices = ((taken >= lost) | (length == 0)).astype(np.int64)
    return found


def first_block_with_units(program: Program) -> int:
    """Return the first block that states the units, or the number of blocks."""
    for block, line in enumerate(program.line.tolist()):
        text = program.lines[line - 1]
        if ("2" in text or "7" in text) and _UNITS.search(normalized(text)):
            return block
    return program.n_blocks


_UNITS = re.compile(r"G0*(?:20|21|70|71)(?![0-9.])")


def features_of(program_path: ProgramPath, which: Mask) -> Features:
    """Return the features in the rows `which`: cuts, cycles, dwells, and rapids under cutter compensation."""
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
    """Return whether the first and the last cuts have the same kind and feed as most cuts, so that there is no lead-in
    or lead-out.
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
