"""Features: the holes, cuts and dwells of a toolpath in columns, with all that makes them what they are."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Modal, Program
from leafcut.model.toolpath import SPEED_ALONE, DrillCycle, Kind, Toolpath, positions_before

Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: What the columns of `Features.exact` hold: equal or not.
EXACT = (
    "kind", "plane", "turns", "tool", "coolant",
    "length", "frame", "radius", "blending", "feed_mode", "direction", "stated", "obeyed",
)  # fmt: skip
#: What the columns of `Features.place` hold, mm: the end of a cut or the bottom of a hole, its start, an arc's centre.
PLACE = ("x", "y", "depth", "start x", "start y", "start z", "centre x", "centre y", "centre z")
#: What the columns of `Features.amount` hold: mm/s, rpm (< 0 backwards), mm, s, D as written, mm, mm.
AMOUNT = ("feed", "speed", "peck", "dwell", "register", "corner", "joining")
#: What the columns of `Features.height` hold, mm; these may rise.
HEIGHT = ("r_plane", "retract")

#: Kinds of cuts and what people call them.
CUTS = {
    Kind.RAPID: "rapid under radius compensation",
    Kind.FEED: "cut",
    Kind.ARC_CW: "clockwise arc",
    Kind.ARC_CCW: "counter-clockwise arc",
    Kind.DWELL: "dwell",
}


@dataclass(frozen=True, eq=False)
class Features:
    """Holes, cuts and dwells in the order of the program; columns as `EXACT`, `PLACE`, `AMOUNT` and `HEIGHT` name them.

    Attributes
    ----------
    row, line
        int64[n]: the row of the toolpath; int32[n]: the line of the text.
    exact
        int64[n, 13]; `kind` is a `Kind`, or the number of a cycle's name.
    place, amount, height
        float64[n, 9], float64[n, 7], float64[n, 2].
    group
        int64[n]: features of different groups are never equal.
    """

    row: Ints
    line: NDArray[np.int32]
    exact: Ints
    place: Floats
    amount: Floats
    height: Floats
    group: Ints

    def __len__(self) -> int:
        return len(self.row)

    @property
    def kind(self) -> Ints:
        """The `Kind` of every cut; a cycle is a number above all of them."""
        return self.exact[:, 0]

    def pick(self, which: Mask | Ints, group: Ints | None = None) -> Features:
        """Return some of the features, with their groups or with others."""
        return Features(
            self.row[which],
            self.line[which],
            self.exact[which],
            self.place[which],
            self.amount[which],
            self.height[which],
            self.group[which] if group is None else group,
        )


def name_of(kind: int) -> str:
    """Return what people call a kind of feature: ``cut``, ``G83`` …"""
    return CUTS[Kind(kind)] if kind < FIRST_CYCLE else kind.to_bytes(7, "big").lstrip(b"\0").decode("ascii", "replace")


#: Names of cycles are numbers far above all kinds: their letters, read as a number.
FIRST_CYCLE = 256


def _number_of(cycle: DrillCycle) -> int:
    return int.from_bytes(cycle.name.encode("ascii", "replace")[:7], "big")


class States(NamedTuple):
    """What is active at every row of a toolpath, by row; see `EXACT` and `AMOUNT` for what is not said by the name.

    `plane` is that of the radius compensation: 0 where there is none.
    """

    plane: Ints
    tool: Ints
    coolant: Ints
    length: Ints
    frame: Ints
    radius: Ints
    blending: Ints
    feed_mode: Ints
    direction: Ints
    stated: Ints
    obeyed: Ints
    speed: Floats
    register: Floats
    corner: Floats
    joining: Floats

    def take(self, rows: Ints) -> States:
        """Return the states at some rows."""
        return States._make(column[rows] for column in self)


def states_of_path(path: Toolpath) -> States:
    """Return what the rows of a toolpath themselves set."""
    none = np.zeros(len(path), dtype=np.int64)

    def number(kind: Kind, default: int = 0) -> Ints:
        return _latest(path, kind, path.ref, default).astype(np.int64)

    return States(
        plane=none,
        tool=number(Kind.TOOL),
        coolant=number(Kind.COOLANT),
        length=number(Kind.OFFSET),
        frame=number(Kind.FRAME, 540),
        radius=number(Kind.RADIUS, 40),
        blending=number(Kind.BLENDING),
        feed_mode=none,
        direction=none,
        stated=none,
        obeyed=none,
        speed=_latest(path, Kind.SPINDLE, path.value),
        register=_latest(path, Kind.RADIUS, path.value),
        corner=_latest(path, Kind.BLENDING, path.value),
        joining=_latest(path, Kind.BLENDING, path.end[:, 0]),
    )


def states_of_program(program: Program) -> States:
    """Return what is active at every row of a program: what its rows set, and what only its words say.

    A block's own words count for its motions. Whether the spindle turns is taken from M3, M4 and M5, since a torch
    needs no S. Where the work's units are stated, no machine can take them for others. What the controller obeys
    beside the G-code it obeys in the order of the text.
    """
    states = states_of_path(program.path)
    rows = np.arange(len(program.path))
    block = np.searchsorted(program.first, rows, side="right") - 1
    active = program.before[np.clip(block + 1, 0, len(program.before) - 1)]

    def column(take: Callable[[Modal], float]) -> Floats:
        return np.array([take(modal) for modal in program.modals], dtype=np.float64)[active]

    if not len(program.modals):
        return states
    direction = column(lambda m: m.spindle)
    return states._replace(
        plane=np.where(states.radius != 40, column(lambda m: m.plane), 0).astype(np.int64),
        length=states.length + TAKEN * _table_of(program.path),
        feed_mode=column(lambda m: m.feed_mode).astype(np.int64),
        direction=direction.astype(np.int64),
        stated=(block >= _first_with_units(program)) + 2 * _started(program.path, direction),
        obeyed=np.searchsorted([said.line for said in program.obeyed], program.path.line).astype(np.int64),
        speed=direction * column(lambda m: m.rpm),
    )


#: A length offset is its register and this many times the number of blocks before it that may have changed the table.
TAKEN = 1 << 20


def _table_of(path: Toolpath) -> Ints:
    """Return for every row how many blocks that are not understood came before its length offset was taken."""
    count = np.cumsum(path.kind == Kind.FOREIGN)
    return _latest(path, Kind.OFFSET, count).astype(np.int64)


def _started(path: Toolpath, direction: Floats) -> Ints:
    """Return for every row 1, or 0 where the spindle turns and was not started since the last tool change.

    M6 stops it in LinuxCNC and Haas; elsewhere that differs.
    """
    rows = np.arange(len(path))
    starts = (path.kind == Kind.SPINDLE) & (path.ref != SPEED_ALONE)
    last = [np.maximum.accumulate(np.where(which, rows, -1)) for which in (starts, path.kind == Kind.TOOL)]
    started: Ints = ((last[0] >= last[1]) | (direction == 0)).astype(np.int64)
    return started


def _first_with_units(program: Program) -> int:
    """Return the first block that states the units."""
    for block, line in enumerate(program.line.tolist()):
        text = program.lines[line - 1]
        if ("2" in text or "7" in text) and _UNITS.search(_COMMENT.sub("", text)):
            return block
    return program.n_blocks


_UNITS = re.compile(r"G\s*0*(?:20|21|70|71)(?![0-9.])", re.IGNORECASE)
_COMMENT = re.compile(r"\([^()]*\)|;.*")


def _latest(path: Toolpath, kind: Kind, column: NDArray, default: float = 0.0) -> Floats:
    """Return for every row the value that the latest row of `kind` set, `default` before the first."""
    n = len(path)
    rows = np.maximum.accumulate(np.where(path.kind == kind, np.arange(n), -1)) if n else np.zeros(0, dtype=np.int64)
    return np.where(rows >= 0, column[rows], default).astype(np.float64)


def features_of(path: Toolpath, states: States, which: Mask) -> Features:
    """Return the features that the rows `which` are: cuts, cycles, dwells, and rapids (under radius compensation)."""
    rows = np.flatnonzero(which)
    kind = path.kind[rows]
    here, at = positions_before(path)[rows], states.take(rows)
    n = len(rows)
    place, amount, height = np.zeros((n, len(PLACE))), np.zeros((n, len(AMOUNT))), np.zeros((n, len(HEIGHT)))
    dwell = kind == Kind.DWELL
    place[:, :3] = np.where(dwell[:, None], here, path.end[rows])
    place[:, 3:6] = here
    exact = np.zeros((n, len(EXACT)), dtype=np.int64)
    exact[:, 0] = kind
    for name in (
        "plane",
        "tool",
        "coolant",
        "length",
        "frame",
        "radius",
        "blending",
        "feed_mode",
        "direction",
        "stated",
        "obeyed",
    ):
        exact[:, EXACT.index(name)] = getattr(at, name)
    amount[:, 0] = np.where(dwell | (kind == Kind.RAPID), 0.0, path.value[rows])
    amount[:, 1], amount[:, 4], amount[:, 5], amount[:, 6] = at.speed, at.register, at.corner, at.joining
    amount[dwell, 3] = path.value[rows][dwell]
    _fill_cycles(path, rows, exact, place, amount, height)
    _fill_arcs(path, rows, exact, place)
    return Features(rows, path.line[rows], exact, place, amount, height, np.zeros(n, dtype=np.int64))


def _fill_cycles(path: Toolpath, rows: Ints, exact: Ints, place: Floats, amount: Floats, height: Floats) -> None:
    drill = path.kind[rows] == Kind.DRILL
    if not drill.any():
        return
    ref = path.ref[rows[drill]]
    words = np.array([(c.bottom, c.peck, c.dwell, c.r_plane) for c in path.cycles], dtype=np.float64)[ref]
    exact[drill, 0] = np.array([_number_of(c) for c in path.cycles], dtype=np.int64)[ref]
    height[drill, 0], height[drill, 1] = words[:, 3], place[drill, 2]
    place[drill, 2] = words[:, 0]
    place[drill, 3:5], place[drill, 5] = place[drill, :2], 0.0
    amount[drill, 2], amount[drill, 3] = words[:, 1], words[:, 2]


def _fill_arcs(path: Toolpath, rows: Ints, exact: Ints, place: Floats) -> None:
    arc = (path.kind[rows] == Kind.ARC_CW) | (path.kind[rows] == Kind.ARC_CCW)
    if not arc.any():
        return
    used = [path.arcs[ref] for ref in path.ref[rows[arc]].tolist()]
    place[arc, 6:9] = np.array([a.center for a in used])
    exact[arc, 1] = [a.plane for a in used]
    exact[arc, 2] = [a.turns for a in used]
