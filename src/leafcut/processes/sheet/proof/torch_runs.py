"""The torch runs of a program that was read back, with the path, speed and height of each run.

A run consists of all feed moves between two rapids across the sheet. The torch may be off during some of these moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.model.toolpath import Kind, Motion, Toolpath, arc_radius_start_sweep

#: Chord error for arcs, mm.
FLATNESS = 0.002
_NOTHING = 1e-9


@dataclass(frozen=True)
class Lighting:
    """The event of switching the torch on.

    Attributes
    ----------
    line
        Line in the program.
    height
        Height of the torch, mm, or NaN if the program does not move Z.
    power, spindle
        Power and spindle in the command.
    waited
        Pierce delay, s.
    """

    line: int
    height: float
    power: float
    spindle: int
    waited: float


@dataclass(frozen=True, eq=False)
class TorchRun:
    """A run of the torch, approximated by n chords.

    Attributes
    ----------
    line
        Program line at which the run starts.
    points
        Ends of the chords, float64[n + 1, 2], mm.
    burning
        Whether the torch is on during each chord, bool[n].
    feed
        Feed along each chord, mm/s, float64[n].
    height
        Height at the end of each chord, mm above the sheet, float64[n].
    row_line
        Program line of each chord, int64[n].
    """

    line: int
    points: NDArray[np.float64]
    burning: NDArray[np.bool_]
    feed: NDArray[np.float64]
    height: NDArray[np.float64]
    row_line: NDArray[np.int32]
    lightings: tuple[Lighting, ...]

    @property
    def start(self) -> tuple[float, float]:
        """The first point of the run, mm."""
        return float(self.points[0, 0]), float(self.points[0, 1])

    @property
    def along(self) -> NDArray[np.float64]:
        """Distance of each point from the start, along the run, float64[n + 1], mm."""
        steps = np.hypot(*np.diff(self.points, axis=0).T)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def lines(self) -> list[NDArray[np.float64]]:
        """Return the sections of the run in which the torch is on, each float64[k, 2], mm."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.burning, [False]]).astype(np.int8)))
        return [self.points[a : b + 1] for a, b in zip(edges[::2], edges[1::2], strict=True)]


@dataclass
class _RunCollector:
    """Collects the rows of a toolpath into runs. A rapid across the sheet ends a run."""

    runs: list[TorchRun] = field(default_factory=list)
    points: list[tuple[float, float]] = field(default_factory=list)
    burning: list[bool] = field(default_factory=list)
    feed: list[float] = field(default_factory=list)
    height: list[float] = field(default_factory=list)
    row_line: list[int] = field(default_factory=list)
    side: list[float] = field(default_factory=list)
    lightings: list[Lighting] = field(default_factory=list)
    lit: Motion | None = None
    dark: bool = False
    resting: bool = False
    aside: float = 0.0

    def finish_run(self) -> None:
        if self.lightings or any(self.burning):
            points, chord = compensated_path(np.array(self.points).reshape(-1, 2), np.array(self.side))
            self.runs.append(
                TorchRun(
                    line=self.lightings[0].line if self.lightings else self.row_line[0],
                    points=points,
                    burning=np.array(self.burning, dtype=bool)[chord],
                    feed=np.array(self.feed, dtype=np.float64)[chord],
                    height=np.array(self.height, dtype=np.float64)[chord],
                    row_line=np.array(self.row_line, dtype=np.int32)[chord],
                    lightings=tuple(self.lightings),
                )
            )
        for column in (self.points, self.burning, self.feed, self.height, self.row_line, self.side, self.lightings):
            column.clear()

    def record_lighting(self, row: Motion, place: NDArray[np.float64]) -> None:
        self.lit = row if row.value != 0.0 else None
        self.resting = self.lit is not None
        if self.lit is not None:
            if not self.points:
                self.points.append((float(place[0]), float(place[1])))
            self.lightings.append(Lighting(row.line, float(place[2]), abs(row.value), row.ref, 0.0))

    def record_dwell(self, seconds: float) -> None:
        """Record a dwell. If it comes directly after the torch is switched on, it is the pierce delay."""
        if self.resting:
            last = self.lightings[-1]
            waited = last.waited + seconds
            self.lightings[-1] = Lighting(last.line, last.height, last.power, last.spindle, waited)

    def add_chords(self, row: Motion, begin: NDArray[np.float64], chords: NDArray[np.float64]) -> None:
        """Add the chords of a feed move, float64[k, 2]."""
        self.resting = False
        if not self.points:
            self.points.append((float(begin[0]), float(begin[1])))
        for x, y in chords.tolist():
            self.points.append((x, y))
            self.burning.append(self.lit is not None and not self.dark)
            self.feed.append(row.value)
            self.height.append(row.end[2])
            self.row_line.append(row.line)
            self.side.append(self.aside)


def torch_runs(path: Toolpath, kerf: float | None = None) -> list[TorchRun]:
    """Collect the runs of the torch in program order. Moves in Z alone have no chords.

    If the controller compensates the kerf (G41, G42), a run follows the actual path of the torch. `kerf` is twice the
    value in the offset register of the controller, mm. If it is None, the D word states the kerf.
    """
    found, before = _RunCollector(), path.before
    for number, row in enumerate(path):
        if row.kind in (Kind.RAPID, Kind.MACHINE):
            if _moves_sideways(row, before[number]):
                found.finish_run()
        elif row.kind is Kind.SPINDLE:
            found.record_lighting(row, before[number])
        elif row.kind is Kind.TORCH:
            found.dark = row.value == 0.0
        elif row.kind is Kind.RADIUS:
            width = row.value if kerf is None else kerf
            found.aside = {41: 0.5, 42: -0.5}.get(row.ref, 0.0) * width
        elif row.kind is Kind.DWELL:
            found.record_dwell(row.value)
        elif row.kind is Kind.FEED:
            if _moves_sideways(row, before[number]):
                found.add_chords(row, before[number], np.array([row.end[:2]]))
            else:
                found.resting = False
        elif row.kind in (Kind.ARC_CW, Kind.ARC_CCW):
            found.add_chords(row, before[number], arc_chord_ends(path, number))
    found.finish_run()
    return found.runs


def burning_sections(
    run: TorchRun, longest: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Divide the chords with the torch on into sections of at most `longest` mm.

    Returns
    -------
    middles
        Midpoints of the sections, float64[k, 2], mm.
    lengths
        Lengths of the sections, mm.
    along
        Distances of the midpoints from the start of the run, mm.
    """
    begin, end = run.points[:-1][run.burning], run.points[1:][run.burning]
    at, length = run.along[:-1][run.burning], np.hypot(*(end - begin).T)
    count = np.maximum(np.ceil(length / longest), 1.0).astype(np.int64)
    which = np.repeat(np.arange(len(count)), count)
    place_in = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    share = (place_in + 0.5) / count[which]
    return (
        begin[which] + (end - begin)[which] * share[:, None],
        (length / count)[which],
        at[which] + share * length[which],
    )


def compensated_path(
    points: NDArray[np.float64], side: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Compute the torch path for a controller that compensates the kerf.

    At an outer corner, the torch follows an arc. At an inner corner, it moves to the intersection of the offset lines.
    The first compensated chord leads to the offset point at the end of that chord. Source: LinuxCNC, G-code reference,
    cutter compensation.

    Parameters
    ----------
    points
        Programmed path, float64[n + 1, 2], mm.
    side
        Offset of each chord to the left, float64[n], mm; negative to the right.

    Returns
    -------
    points
        Torch path, float64[m + 1, 2], mm.
    chord
        Index of the programmed chord for each chord of the torch path, int64[m].
    """
    chord = np.arange(len(side))
    if not side.any():
        return points, chord
    places, whose = [points[0]], list[int]()
    for k in range(len(side)):
        here = _offset_points(points, side, k)
        places += here
        whose += [k] * len(here)
    return np.array(places), np.array(whose, dtype=np.int64)


def _offset_points(points: NDArray[np.float64], side: NDArray[np.float64], k: int) -> list[NDArray[np.float64]]:
    """Return the points of the torch path at the end of chord `k`.

    There are several points around an outer corner, and a single point everywhere else.
    """
    corner, aside = points[k + 1], side[k]
    one = _left_normal(points[k], corner)
    if not aside:
        return [corner]
    if k + 1 == len(side) or not side[k + 1]:
        return [corner + aside * one]
    other = _left_normal(corner, points[k + 2])
    turn = math.atan2(one[0] * other[1] - one[1] * other[0], float(one @ other))
    if turn * aside >= 0.0:
        return [corner + aside * (one + other) / max(1.0 + float(one @ other), 1e-3)]
    step = 2.0 * math.acos(max(1.0 - FLATNESS / abs(aside), 0.0))
    angles = np.linspace(0.0, turn, max(math.ceil(abs(turn) / step), 1) + 1)
    turned = [
        np.array([one[0] * math.cos(a) - one[1] * math.sin(a), one[0] * math.sin(a) + one[1] * math.cos(a)])
        for a in angles
    ]
    return [corner + aside * normal for normal in turned]


def _left_normal(begin: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    along = end - begin
    return np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), _NOTHING)


def _moves_sideways(row: Motion, before: NDArray[np.float64]) -> bool:
    """Return whether a move changes x or y. If the previous position is unknown, assume that it does."""
    return any(
        not math.isnan(end) and not abs(end - begin) <= _NOTHING
        for end, begin in zip(row.end[:2], before[:2].tolist(), strict=True)
    )


def arc_chord_ends(path: Toolpath, row: int) -> NDArray[np.float64]:
    """Return the ends of the chords that approximate an arc, float64[k, 2], mm.

    The chord error is r·(1 − cos(step/2)).
    """
    radius, begin, sweep = arc_radius_start_sweep(path, row)
    centre = path.arcs[int(path.ref[row])].center
    step = 2.0 * math.acos(max(1.0 - FLATNESS / radius, 0.0)) if radius > FLATNESS else math.pi
    count = max(math.ceil(abs(sweep) / max(step, 1e-3)), 1)
    angles = begin + sweep * np.arange(1, count + 1) / count
    chords = np.column_stack([centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)])
    chords[-1] = path.end[row, :2]
    return chords
