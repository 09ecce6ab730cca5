"""`Toolpath`: motions and commands in order. All code after planning uses this format.

Planners and the G-code interpreter create toolpaths. Writers, timing, plots and verification use them. A toolpath is
stored in columns, so that a million rows need little memory. Units are mm, mm/s, s and rpm, in absolute program
coordinates.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Numbers per row of a `ToolpathBuilder`.
WIDTH = 7

UNKNOWN = math.nan
#: The work offset at the start of a program, in tenths (G54).
FIRST_OFFSET = 540
#: Value of `ref` in a SPINDLE row that comes from an S word without M3 or M4.
SPEED_ALONE = -1


class Kind(IntEnum):
    """Kind of a row, which determines the meaning of its columns.

    ========== ============================================ ==================== ===========================
    kind       end (x, y, z)                                value                ref
    ========== ============================================ ==================== ===========================
    RAPID      end position                                 –                    –
    FEED       end position                                 feed, mm/s           –
    ARC_CW     end position                                 feed, mm/s           row of `arcs`
    ARC_CCW    end position                                 feed, mm/s           row of `arcs`
    DRILL      the hole, and the height after the cycle     feed, mm/s           row of `cycles`
    DWELL      –                                            seconds              –
    TOOL       –                                            –                    tool number
    OFFSET     –                                            –                    length offset (H), 0 = G49
    SPINDLE    –                                            rpm; < 0 = backwards spindle; torch: 1 marks; -1 = S alone
    COOLANT    –                                            –                    0 off, 1 mist, 2 flood, 3 both
    PAUSE      –                                            –                    0 = M0, 1 = M1
    MACHINE    machine coordinates, NaN = axis stays        –                    –
    END        –                                            –                    –
    FRAME      new position                                 –                    work offset in tenths (540 is G54)
    SHIFT      new position                                 –                    origin moved (G52, G92 …), counted
    RADIUS     –                                            D, as written        40, 41 or 42
    BLENDING   x: tolerance for joining short moves, mm     tolerance, mm        610, 611 or 640 (G61, G61.1, G64)
    FOREIGN    new position                                 of a probe, mm/s     1: state unknown; 2: `STILL`
    TORCH      –                                            1 on, 0 off          – (while moving)
    HEIGHT     –                                            1 on, 0 off          – (torch height control)
    PROBE      farthest position                            feed, mm/s           – (until a probe trips)
    ========== ============================================ ==================== ===========================

    SPINDLE switches a torch like M3 and M5 do. TORCH and HEIGHT act with the next motion, without a stop. A new
    position is in the program coordinates that are valid after the row. It is NaN for an axis that must be programmed
    again before its position is known.
    """

    RAPID = 0
    FEED = 1
    ARC_CW = 2
    ARC_CCW = 3
    DRILL = 4
    DWELL = 5
    TOOL = 6
    OFFSET = 7
    SPINDLE = 8
    COOLANT = 9
    PAUSE = 10
    MACHINE = 11
    END = 12
    FRAME = 13
    SHIFT = 14
    RADIUS = 15
    BLENDING = 16
    FOREIGN = 17
    TORCH = 18
    HEIGHT = 19
    PROBE = 20


#: Kinds whose `end` is a position in program coordinates.
MOTIONS = (Kind.RAPID, Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL, Kind.PROBE)
#: Kinds of rows that leave the tool at `end`, in program coordinates.
PLACES = (*MOTIONS, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)
#: Value of `ref` in a FOREIGN row whose block does not move any axis, such as M52 P1.
STILL = 2


@dataclass(frozen=True, slots=True)
class DrillCycle:
    """Parameters of a canned cycle: heights in mm, dwell in s.

    `name` is the G word of LinuxCNC and Fanuc (G81 … G86, G89, G73), for all controllers. If `to_initial`, the tool
    retracts to its height before the cycle (G98), otherwise to `r_plane` (G99). `approach` is the move over the hole:

    - ``level``: at the current height, or at the R plane if that is higher;
    - ``slant``: rising to the return height on the way;
    - ``sink``: after a vertical move down to the R plane.
    """

    name: str
    r_plane: float
    bottom: float
    to_initial: bool = False
    peck: float = 0.0
    dwell: float = 0.0
    approach: str = "level"

    def height_after(self, initial: float) -> float:
        """Return the height after the hole, mm, in a series of cycles that started at height `initial`, mm.

        G98 retracts to the height before the series. If the R plane is higher, it retracts to the R plane (RS274/NGC
        3.5.16.1; observed with `rs274 -g`).
        """
        return initial if self.to_initial and initial >= self.r_plane else self.r_plane

    def approach_in_series(self, initial: float, height: float) -> str:
        """Return how LinuxCNC 2.9 approaches a hole (see `approach`).

        The series of cycles started at height `initial`, mm. If `initial` is below the R plane, the tool first moves
        vertically to the R plane. Otherwise, a tool at or below the R plane rises to the return height on its way over
        the hole. Unknown heights are NaN. This was observed with `rs274 -g`.
        """
        if initial < self.r_plane:
            return "sink" if height > self.r_plane else "level"
        return "slant" if height <= self.r_plane and height < self.height_after(initial) else "level"


@dataclass(frozen=True, slots=True)
class Arc:
    """The centre of an arc in program coordinates, mm, its plane (17 xy, 18 zx, 19 yz), and its number of turns."""

    center: tuple[float, float, float]
    plane: int = 17
    turns: int = 1


class Motion(NamedTuple):
    """A row of a toolpath as an object. Messages use it, and so do loops that do not need to be fast."""

    kind: Kind
    end: tuple[float, float, float]
    value: float
    ref: int
    line: int


@dataclass(frozen=True, eq=False)
class Toolpath:
    """Motions and commands as columns with n rows. `Kind` defines the meaning of the columns.

    Attributes
    ----------
    kind
        Kind of each row, int8[n].
    end
        End position of each row, float64[n, 3], mm. NaN for an unknown coordinate (the axis has not moved yet), or for
        an axis that does not move (`Kind.MACHINE`).
    value
        Feed, seconds or rpm, depending on the kind, float64[n].
    ref
        Number of the tool, cycle, arc …, depending on the kind, int32[n].
    line
        Line of the source text, from 1, int32[n]; 0 for a planned row.
    cycles, arcs
        The cycles and arcs that `ref` refers to.
    """

    kind: NDArray[np.int8]
    end: NDArray[np.float64]
    value: NDArray[np.float64]
    ref: NDArray[np.int32]
    line: NDArray[np.int32]
    cycles: tuple[DrillCycle, ...] = ()
    arcs: tuple[Arc, ...] = ()

    @classmethod
    def of_motions(cls, motions: Iterable[Motion]) -> Toolpath:
        """Create a toolpath from motions without cycles and arcs."""
        rows = [(int(m.kind), *m.end, m.value, m.ref, m.line) for m in motions]
        return _toolpath_from_columns(np.array(rows, dtype=np.float64).reshape(-1, WIDTH), (), ())

    def __len__(self) -> int:
        return len(self.kind)

    def __getitem__(self, row: int) -> Motion:
        x, y, z = self.end[row].tolist()
        kind = Kind(int(self.kind[row]))
        return Motion(kind, (x, y, z), float(self.value[row]), int(self.ref[row]), int(self.line[row]))

    def __iter__(self) -> Iterator[Motion]:
        columns = (self.kind.tolist(), self.end.tolist(), self.value.tolist(), self.ref.tolist(), self.line.tolist())
        for kind, (x, y, z), value, ref, line in zip(*columns, strict=True):
            yield Motion(Kind(kind), (x, y, z), value, ref, line)

    def take(self, rows: NDArray[Any] | list[int] | slice) -> Toolpath:
        """Return a toolpath with only the selected rows (indices, a mask or a slice)."""
        return replace(
            self,
            kind=self.kind[rows],
            end=self.end[rows],
            value=self.value[rows],
            ref=self.ref[rows],
            line=self.line[rows],
        )

    @cached_property
    def before(self) -> NDArray[np.float64]:
        """Position of the tool before every row, float64[n, 3], mm; NaN for unknown coordinates.

        After a move in machine coordinates (`Kind.MACHINE`), the position of the axis is unknown until the program
        moves the axis again. The same applies to the height after a probe move.
        """
        n = len(self)
        moving = np.isin(self.kind, [int(k) for k in PLACES])
        machine = self.kind == Kind.MACHINE
        before = np.full((n, 3), UNKNOWN)
        for axis in range(3):
            last = latest_marked_rows(moving | (machine & np.isfinite(self.end[:, axis])))
            lost = machine | ((self.kind == Kind.PROBE) & (axis == 2))
            known = last[:-1] >= 0
            before[1:][known, axis] = np.where(lost, UNKNOWN, self.end[:, axis])[last[:-1][known]]
        before.setflags(write=False)
        return before

    def place_before(self, row: int) -> tuple[float, float, float]:
        """Return the position of the tool before a row, mm. For the number of rows, return the final position."""
        if row < len(self):
            x, y, z = self.before[row].tolist()
        elif row:
            x, y, z = (self.end if self.kind[-1] in PLACES else self.before)[-1].tolist()
        else:
            x = y = z = UNKNOWN
        return x, y, z

    @cached_property
    def tool(self) -> NDArray[np.int64]:
        """Number of the active tool in every row, int64[n]; 0 before the first tool change."""
        return self.latest(Kind.TOOL, self.ref)

    @cached_property
    def length_offset(self) -> NDArray[np.int64]:
        """Register of the active tool length offset in every row, int64[n]; 0 before the first length offset."""
        return self.latest(Kind.OFFSET, self.ref)

    def latest(self, kind: Kind, column: NDArray[Any], default: float = 0) -> NDArray[Any]:
        """For each row, return the value of `column` in the latest row of `kind`.

        Before the first such row, return `default`.

        The result is int64 for integer columns, otherwise float64.
        """
        rows = latest_marked_rows(self.kind == kind)
        wide = np.int64 if np.issubdtype(column.dtype, np.integer) else np.float64
        return np.where(rows >= 0, column[rows], default).astype(wide)

    @property
    def extents(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Bounds of all motions in x, y and z, including arcs and hole bottoms, mm. Zeros if unknown."""
        moving = np.isin(self.kind, [int(k) for k in MOTIONS])
        points = [self.end[moving]]
        drills = self.kind == Kind.DRILL
        if drills.any():
            bottoms = self.end[drills].copy()
            bottoms[:, 2] = np.array([c.bottom for c in self.cycles])[self.ref[drills]]
            points.append(bottoms)
        points.extend(self._arc_extents())
        every = np.concatenate(points)
        low, high = [], []
        for axis in range(3):
            known = every[np.isfinite(every[:, axis]), axis]
            low.append(float(known.min()) if len(known) else 0.0)
            high.append(float(known.max()) if len(known) else 0.0)
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def _arc_extents(self) -> list[NDArray[np.float64]]:
        rows = np.flatnonzero((self.kind == Kind.ARC_CW) | (self.kind == Kind.ARC_CCW))
        return [np.array(arc_extremes(self, int(row))).reshape(-1, 3) for row in rows]


def _toolpath_from_columns(
    table: NDArray[np.float64], cycles: tuple[DrillCycle, ...], arcs: tuple[Arc, ...]
) -> Toolpath:
    return Toolpath(
        kind=table[:, 0].astype(np.int8),
        end=np.ascontiguousarray(table[:, 1:4]),
        value=np.ascontiguousarray(table[:, 4]),
        ref=table[:, 5].astype(np.int32),
        line=table[:, 6].astype(np.int32),
        cycles=cycles,
        arcs=arcs,
    )


def g_word(tenths: int) -> str:
    """Return a G word from its number in tenths, such as G54 for 540."""
    return f"G{tenths / 10:g}"


def plane_axes(plane: int) -> tuple[int, int, int]:
    """Return the numbers of the first, second and normal axis of G17, G18 or G19.

    G3 turns from the first to the second axis.
    """
    return {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[plane]


def arc_radius_start_sweep(path: Toolpath, row: int) -> tuple[float, float, float]:
    """Return the radius, mm, the start angle, rad, and the sweep, rad, of an arc. ARC_CCW has a positive sweep."""
    arc = path.arcs[int(path.ref[row])]
    first, second, _ = plane_axes(arc.plane)
    before, end = path.before[row], path.end[row]
    u0, v0 = before[first] - arc.center[first], before[second] - arc.center[second]
    u1, v1 = end[first] - arc.center[first], end[second] - arc.center[second]
    start, stop = math.atan2(v0, u0), math.atan2(v1, u1)
    sweep = (stop - start) % math.tau if path.kind[row] == Kind.ARC_CCW else -((start - stop) % math.tau)
    if abs(sweep) < 1e-9:
        sweep = math.copysign(math.tau, 1.0 if path.kind[row] == Kind.ARC_CCW else -1.0)
    return math.hypot(u0, v0), start, sweep + math.copysign(math.tau * (arc.turns - 1), sweep)


def arc_extremes(path: Toolpath, row: int) -> list[tuple[float, float, float]]:
    """Return the extreme points of an arc along the axes of its plane, mm, without the end points of the arc."""
    arc = path.arcs[int(path.ref[row])]
    first, second, normal = plane_axes(arc.plane)
    radius, start, sweep = arc_radius_start_sweep(path, row)
    low, high = min(start, start + sweep), max(start, start + sweep)
    points = []
    for quarter in range(math.ceil(low / (math.pi / 2)), math.floor(high / (math.pi / 2)) + 1):
        angle = quarter * math.pi / 2
        point = [0.0, 0.0, 0.0]
        point[first] = arc.center[first] + radius * math.cos(angle)
        point[second] = arc.center[second] + radius * math.sin(angle)
        point[normal] = float(path.end[row, normal])
        points.append((point[0], point[1], point[2]))
        if len(points) >= 4:
            break
    return points


def latest_marked_rows(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For every row, return the index of the latest masked row up to this row, or -1 before the first."""
    return np.maximum.accumulate(np.where(mask, np.arange(len(mask)), -1))


@dataclass
class ToolpathBuilder:
    """Collects rows, and tracks the position of the tool. The method `build` returns the toolpath."""

    position: list[float] = field(default_factory=lambda: [UNKNOWN, UNKNOWN, UNKNOWN])
    #: Height before the current series of canned cycles, mm. G98 returns to this height. None outside a series.
    initial_plane: float | None = None
    #: Whether the approach to a hole depends on the height before the series of canned cycles, as in LinuxCNC.
    slants: bool = False
    #: Work offset that `work_offset` has selected, in tenths.
    frame: int = FIRST_OFFSET
    #: All rows in a single array: kind, x, y, z, value, ref, line (56 bytes per row).
    _rows: array[float] = field(default_factory=lambda: array("d"))
    _cycles: dict[DrillCycle, int] = field(default_factory=dict)
    _arcs: list[Arc] = field(default_factory=list)

    def kinds_from(self, row: int) -> list[int]:
        """Return the kinds of all rows from `row` on."""
        return [int(kind) for kind in self._rows[WIDTH * row :: WIDTH]]

    def rapid(self, x: float | None = None, y: float | None = None, z: float | None = None, line: int = 0) -> None:
        """Add a rapid. An axis does not move if its coordinate is None."""
        self._move(Kind.RAPID, x, y, z, 0.0, 0, line)

    def feed(
        self, x: float | None = None, y: float | None = None, z: float | None = None, *, feed: float, line: int = 0
    ) -> None:
        """Add a straight cut at `feed` mm/s."""
        self._move(Kind.FEED, x, y, z, feed, 0, line)

    def arc(self, clockwise: bool, end: tuple[float, float, float], arc: Arc, *, feed: float, line: int = 0) -> None:
        """Add an arc or a helix at `feed` mm/s."""
        self._arcs.append(arc)
        self._move(Kind.ARC_CW if clockwise else Kind.ARC_CCW, *end, feed, len(self._arcs) - 1, line)

    def drill(self, x: float, y: float, cycle: DrillCycle, *, feed: float, line: int = 0) -> None:
        """Add a canned cycle at (x, y). Any other motion ends the series of cycles, and so does `end_cycles` (G80)."""
        initial = self.position[2] if self.initial_plane is None else self.initial_plane
        after = cycle.height_after(initial)
        if self.slants and self.initial_plane is not None:
            approach = cycle.approach_in_series(initial, self.position[2])
            cycle = cycle if approach == cycle.approach else replace(cycle, approach=approach)
        self._move(Kind.DRILL, x, y, after, feed, self._cycles.setdefault(cycle, len(self._cycles)), line)
        self.initial_plane = initial

    def end_cycles(self) -> None:
        """End a series of canned cycles (G80)."""
        self.initial_plane = None

    def dwell(self, seconds: float, line: int = 0) -> None:
        """Add a dwell, s."""
        self._command(Kind.DWELL, seconds, 0, line)

    def tool(self, number: int, line: int = 0) -> None:
        """Add a tool change."""
        self._command(Kind.TOOL, 0.0, number, line)

    def offset(self, number: int, line: int = 0) -> None:
        """Activate the tool length offset of a register. Register 0 cancels the offset."""
        self._command(Kind.OFFSET, 0.0, number, line)

    def spindle(self, rpm: float, line: int = 0, number: int = 0) -> None:
        """Set the spindle speed: positive for clockwise (M3), negative for counter-clockwise (M4), 0 to stop (M5)."""
        self._command(Kind.SPINDLE, rpm, number, line)

    def coolant(self, mode: int, line: int = 0) -> None:
        """Set coolant: 0 off, 1 mist, 2 flood, 3 both."""
        self._command(Kind.COOLANT, 0.0, mode, line)

    def pause(self, optional: bool = False, line: int = 0) -> None:
        """Add a stop for the operator (M0, or M1 if optional)."""
        self._command(Kind.PAUSE, 0.0, int(optional), line)

    def machine(self, x: float | None = None, y: float | None = None, z: float | None = None, line: int = 0) -> None:
        """Add a rapid to machine coordinates. The positions of the moved axes are unknown afterwards."""
        place = [UNKNOWN if v is None else v for v in (x, y, z)]
        self._rows.extend((int(Kind.MACHINE), place[0], place[1], place[2], 0.0, 0, line))
        self.initial_plane = None
        self.position = [p if math.isnan(v) else UNKNOWN for p, v in zip(self.position, place, strict=True)]

    def end(self, line: int = 0) -> None:
        """End the program."""
        self._command(Kind.END, 0.0, 0, line)

    def radius(self, mode: int, register: float = 0.0, line: int = 0) -> None:
        """Set radius compensation: 40 off, 41 left, 42 right."""
        self._command(Kind.RADIUS, register, mode, line)

    def torch(self, is_on: bool, line: int = 0) -> None:
        """Switch the torch on or off while moving."""
        self._command(Kind.TORCH, float(is_on), 0, line)

    def height_control(self, is_on: bool, line: int = 0) -> None:
        """Switch torch height control on or off."""
        self._command(Kind.HEIGHT, float(is_on), 0, line)

    def probe(self, z: float, *, feed: float, line: int = 0) -> None:
        """Add a probe move that goes down to height `z` at most, at `feed` mm/s.

        A following SHIFT may set the new position.
        """
        self._move(Kind.PROBE, None, None, z, feed, 0, line)
        self.position[2] = UNKNOWN

    def blending(self, mode: int, tolerance: float = 0.0, joining: float | None = None, line: int = 0) -> None:
        """Set the blending of corners (610, 611 or 640 for G61, G61.1 or G64), and its tolerance, mm.

        `joining` is the tolerance within which the controller joins short moves, mm. It defaults to `tolerance`.
        """
        x = tolerance if joining is None else joining
        self._rows.extend((int(Kind.BLENDING), x, UNKNOWN, UNKNOWN, tolerance, mode, line))

    def work_offset(self, number: int) -> None:
        """Select a work offset (540 is G54). If it changes, the position becomes unknown."""
        if number != self.frame:
            self.frame = number
            self.set_place(Kind.FRAME, (UNKNOWN, UNKNOWN, UNKNOWN), number)

    def set_place(
        self, kind: Kind, place: tuple[float, float, float], ref: int, line: int = 0, value: float = 0.0
    ) -> None:
        """Add a FRAME, SHIFT or FOREIGN row that leaves the tool at `place`."""
        self._rows.extend((int(kind), *place, value, ref, line))
        if kind is not Kind.FOREIGN:
            self.initial_plane = None
        self.position = list(place)

    @property
    def rows(self) -> array[float]:
        """All rows so far, with `WIDTH` numbers each (kind, x, y, z, value, ref, line).

        Callers may extend the list in place.
        """
        return self._rows

    @property
    def arcs(self) -> list[Arc]:
        """All arcs so far. Callers may extend the list in place."""
        return self._arcs

    def __len__(self) -> int:
        return len(self._rows) // WIDTH

    def cut_back(self, rows: int, arcs: int) -> None:
        """Keep the first `rows` rows and `arcs` arcs, and drop the rest. The caller has to set the position."""
        del self._rows[rows * WIDTH :]
        del self._arcs[arcs:]

    def build(self) -> Toolpath:
        """Create a frozen toolpath from the rows."""
        table = np.array(self._rows, dtype=np.float64).reshape(-1, WIDTH)
        return _toolpath_from_columns(table, tuple(self._cycles), tuple(self._arcs))

    def _move(
        self, kind: Kind, x: float | None, y: float | None, z: float | None, value: float, ref: int, line: int
    ) -> None:
        self.initial_plane = None
        p = self.position
        if x is not None:
            p[0] = x
        if y is not None:
            p[1] = y
        if z is not None:
            p[2] = z
        self._rows.extend((int(kind), p[0], p[1], p[2], value, ref, line))

    def _command(self, kind: Kind, value: float, ref: int, line: int) -> None:
        self._rows.extend((int(kind), UNKNOWN, UNKNOWN, UNKNOWN, value, ref, line))
