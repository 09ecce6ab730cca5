"""Features: the holes, cuts and dwells of a toolpath as columns, with all values that the proof compares.

A million features must fit into memory, so values that rarely change are kept in tables.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.block_description import normalized
from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Floats, Indices, Ints, Mask
from leafcut.message import Message
from leafcut.model.toolpath import SPEED_ALONE, DrillCycle, Kind, Toolpath, last_rows

Selection = Indices | Mask | slice | int

#: Values that must be equal. All but the first three come from `States`; so does the plane, except for arcs.
EXACT = (
    "kind", "plane", "turns", "tool", "coolant",
    "length", "frame", "radius", "blending", "feed_mode", "spindle", "stated", "obeyed",
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


class States:
    """Modal state at every row of a toolpath.

    `number`, int32[n], is the state of each row. `table` has a column for each value (see `EXACT` and `AMOUNT`), with
    one entry per distinct state. `plane` is the plane of radius compensation, or 0 without compensation.
    """

    def __init__(self, number: Ints, table: dict[str, NDArray]) -> None:
        self.number = number
        self.table = table

    @classmethod
    def of_columns(cls, columns: Iterable[tuple[str, NDArray]], n: int) -> States:
        """Build the states from columns with n values each; the columns are read one by one to save memory."""
        number, table = np.zeros(n, dtype=np.int64), dict[str, NDArray]()
        for name, column in columns:
            values, which = _numbered(column)
            if len(values) > 1:
                pairs, number = _numbered(number * len(values) + which)
                was, now = np.divmod(pairs.astype(np.int64), len(values))
                table = {known: one[was] for known, one in table.items()}
                values = values[now]
            else:
                values = values[np.zeros(len(next(iter(table.values()), np.zeros(1))), dtype=np.int64)]
            table[name] = values
        return cls(number.astype(np.int32), table)

    def of(self, name: str, rows: Selection = _ALL) -> NDArray:
        """Return the values of a column for the given rows."""
        column: NDArray = self.table[name][self.number[rows]]
        return column

    def take(self, rows: Indices) -> States:
        """Return the states at the given rows."""
        return States(self.number[rows], self.table)


def _numbered(column: NDArray) -> tuple[NDArray, Indices]:
    """Return the distinct values of a column, and the index of each row's value; fast if few rows differ from the
    previous.
    """
    if not len(column):
        return np.zeros(1, dtype=column.dtype), np.zeros(0, dtype=np.int64)
    begins = np.concatenate([[0], np.flatnonzero(column[1:] != column[:-1]) + 1])
    values, which = np.unique(column[begins], return_inverse=True)
    return values, np.repeat(which.ravel(), np.diff(np.append(begins, len(column))))


class Tables(NamedTuple):
    """Data of arcs and cycles. Entry 0 of each column is 0, for features that are neither arcs nor cycles.

    Arcs have `center` (float64[a, 3], mm), `plane` and `turns`; cycles have `r_plane` and `peck` (mm).
    """

    center: Floats
    plane: Indices
    turns: Indices
    r_plane: Floats
    peck: Floats


@dataclass(frozen=True, eq=False)
class Features:
    """Holes, cuts and dwells in program order; `of` returns the columns named in `EXACT`, `PLACE`, `AMOUNT` and
    `HEIGHT`.

    Attributes
    ----------
    row, line
        int32[n]: row of the toolpath, line of the text.
    kind
        int64[n]: `Kind` of a cut; for a cycle, its name as a number from `FIRST_CYCLE` up.
    end, start
        float64[n, 3], mm. The end of a hole is its bottom, and its start is at the retract height.
    feed, dwell
        float64[n]: mm/s, s.
    state, arc, cycle
        int32[n]: rows in `states` and in `tables`.
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
    states: dict[str, NDArray]
    tables: Tables

    def __len__(self) -> int:
        return len(self.row)

    def of(self, name: str, rows: Selection = _ALL) -> NDArray:
        """Return the column with this name for the given rows."""
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
                column = np.where(arc > 0, self.tables.plane[arc], self.states["plane"][self.state[rows]])
            case "turns":
                column = self.tables.turns[self.arc[rows]]
            case "peck" | "r_plane":
                column = getattr(self.tables, name)[self.cycle[rows]]
            case "kind" | "feed" | "dwell":
                column = getattr(self, name)[rows]
            case _:
                column = self.states[name][self.state[rows]]
        return column

    def several(self, names: Iterable[str], rows: Selection = _ALL) -> NDArray:
        """Return several columns side by side, [n, names]."""
        return np.column_stack([self.of(name, rows) for name in names])

    def pick(self, which: Mask | Indices) -> Features:
        """Return the features with these indices, or those that a mask selects."""
        return replace(self, **{name: getattr(self, name)[which] for name in _BY_FEATURE})


_BY_FEATURE = ("row", "line", "kind", "end", "start", "feed", "dwell", "state", "arc", "cycle", "group")


def name_of(kind: int) -> str:
    """Return the name of a kind of feature, such as ``cut`` or ``G83``."""
    return CUTS[Kind(kind)] if kind < FIRST_CYCLE else kind.to_bytes(7, "big").lstrip(b"\0").decode("ascii", "replace")


#: Lowest number of a cycle. The number is the name of the cycle, read as the bytes of an integer.
FIRST_CYCLE = 256


def _number_of(cycle: DrillCycle) -> int:
    return int.from_bytes(cycle.name.encode("ascii", "replace")[:7], "big")


def states_of_path(path: Toolpath) -> States:
    """Return the states set by the rows of a toolpath."""
    return States.of_columns(_columns_of_path(path), len(path))


def _columns_of_path(path: Toolpath) -> Iterator[tuple[str, NDArray]]:
    none = np.zeros(len(path), dtype=np.int64)
    for name, kind, default in (
        ("tool", Kind.TOOL, 0),
        ("coolant", Kind.COOLANT, 0),
        ("length", Kind.OFFSET, 0),
        ("frame", Kind.FRAME, 540),
        ("radius", Kind.RADIUS, 40),
        ("blending", Kind.BLENDING, 0),
    ):
        yield name, path.latest(kind, path.ref, default)
    for name in ("plane", "feed_mode", "spindle", "stated", "obeyed"):
        yield name, none
    yield "speed", path.latest(Kind.SPINDLE, path.value)
    yield "register", path.latest(Kind.RADIUS, path.value)
    yield "tolerance", path.latest(Kind.BLENDING, path.value)
    yield "joining", path.latest(Kind.BLENDING, path.end[:, 0])


def states_of_program(program: Program) -> States:
    """Return the states at every row of a program, from its rows and from its modal words.

    The words of a block apply to its own motions. The spindle direction comes from M3, M4 and M5, because a torch needs
    no S. `stated` has a bit for stated units, for a spindle start since the tool change, and for a length offset that
    is not cancelled. `obeyed` is the number of earlier comments and settings that the controller obeys.
    """
    path, block = program.path, program.row_block
    spindle = program.modal_at_rows("spindle")

    def columns() -> Iterator[tuple[str, NDArray]]:
        radius = np.zeros(0)
        for name, known in _columns_of_path(path):
            match name:
                case "length":
                    yield name, known + TAKEN * _table_of(path)
                case "plane":
                    yield name, np.where(radius != 40, program.modal_at_rows(name), 0)
                case "feed_mode":
                    yield name, program.modal_at_rows(name)
                case "spindle":
                    yield name, spindle
                case "stated":
                    yield (
                        name,
                        (block >= first_with_units(program)) + 2 * _started(path, spindle) + 4 * _length_taken(path),
                    )
                case "obeyed":
                    yield name, np.searchsorted([said.line for said in program.obeyed], path.line).astype(np.int64)
                case "speed":
                    yield name, spindle * program.modal_at_rows("rpm")
                case _:
                    radius = known if name == "radius" else radius
                    yield name, known

    return States.of_columns(columns(), len(path))


#: The state `length` is the register plus this factor times the number of blocks that may have changed the tool table.
TAKEN = 1 << 20


def _table_of(path: Toolpath) -> Indices:
    """Return for each row how many blocks of unknown effect precede the block that set its length offset."""
    count = np.cumsum(path.kind == Kind.FOREIGN)
    return path.latest(Kind.OFFSET, count)


def _started(path: Toolpath, spindle: Indices) -> Indices:
    """Return 0 for rows where the spindle turns without a start since the last tool change, and 1 for all others.

    M6 stops the spindle in LinuxCNC and on Haas machines; other controllers differ.
    """
    starts = (path.kind == Kind.SPINDLE) & (path.ref != SPEED_ALONE)
    last = [last_rows(which) for which in (starts, path.kind == Kind.TOOL)]
    started: Indices = ((last[0] >= last[1]) | (spindle == 0)).astype(np.int64)
    return started


def compensated_moves(path: Toolpath, states: States) -> Mask:
    """Return a mask of the moves under radius compensation, and of the first move after it, which is still affected."""
    moving = np.flatnonzero(path.kind <= Kind.DRILL)
    on = states.of("radius", moving) != 40
    mask = np.zeros(len(path), dtype=bool)
    mask[moving] = on | np.concatenate([[False], on[:-1]])[: len(on)]
    return mask


def _length_taken(path: Toolpath) -> Indices:
    """Return 0 for rows whose length offset may be cancelled since it was stated, and 1 for all others.

    On some controllers, such as Fanuc and Haas, a tool change or a move to a machine position (G28, G53) cancels it.
    """
    offset = path.kind == Kind.OFFSET
    taken, lost = last_rows(offset), last_rows(np.isin(path.kind, [int(Kind.TOOL), int(Kind.MACHINE)]))
    without = path.latest(Kind.OFFSET, path.ref, 0) == 0
    found: Indices = ((taken >= lost) | without).astype(np.int64)
    return found


def first_with_units(program: Program) -> int:
    """Return the first block that states the units, or the number of blocks."""
    for block, line in enumerate(program.line.tolist()):
        text = program.lines[line - 1]
        if ("2" in text or "7" in text) and _UNITS.search(normalized(text)):
            return block
    return program.n_blocks


_UNITS = re.compile(r"G0*(?:20|21|70|71)(?![0-9.])")


def features_of(path: Toolpath, states: States, which: Mask) -> Features:
    """Return the features in the rows `which`: cuts, cycles, dwells, and rapids under radius compensation."""
    rows = np.flatnonzero(which)
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
        state=states.number[rows],
        arc=np.where(curved, ref + 1, 0).astype(np.int32),
        cycle=np.where(drill, ref + 1, 0).astype(np.int32),
        group=np.zeros(len(rows), dtype=np.int64),
        states=states.table,
        tables=_tables_of(path),
    )


def is_uniform(cuts: Features) -> bool:
    """Return whether the first and last cuts have the usual kind and feed of all cuts, as without lead-in and
    lead-out.
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
