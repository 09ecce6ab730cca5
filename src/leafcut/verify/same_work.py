"""The same work in another order: every hole and every cut of one program is in the other, with nothing added."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from itertools import islice, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.cycles import expand
from leafcut.model.toolpath import DrillCycle, Kind, Toolpath, positions_before
from leafcut.verify.difference import MOST_LISTED, Difference, place, shorten
from leafcut.verify.read_back import DWELL_ROUNDING, FEED_PART, FEED_ROUNDING, SPEED_ROUNDING, compare_motion

__all__ = ["compare_motion", "same_work"]


class Feature(NamedTuple):
    """A hole or one cut: what it is, where, and how it is made. mm, mm/s, s, rpm; 0 where a field has no meaning.

    `start` is where a cut begins (a hole: its own x, y and 0), `center` the centre of an arc. `r_plane` and `retract`
    are heights of a hole that may rise but not fall.
    """

    name: str
    x: float
    y: float
    depth: float
    start: tuple[float, float, float]
    center: tuple[float, float, float]
    shape: tuple[int, int]
    tool: int
    coolant: int
    feed: float
    speed: float
    peck: float
    dwell: float
    r_plane: float
    retract: float
    line: int


def same_work(original: Toolpath, new: Toolpath, tolerance_mm: float = 0.002) -> list[Difference]:
    """Return in what two programs differ, whatever the order of their work; nothing when they do the same.

    Holes: place, depth, cycle, peck and dwell; cuts: both ends, and centre, plane and turns of arcs; all with tool,
    feed, spindle speed and direction, coolant. The R plane and the retract of a hole, and the lowest rapid across with
    each tool, may be higher than in the original, never lower. When only one of the two uses drilling cycles, both are
    compared as single moves. Coordinates agree within `tolerance_mm` on every axis.
    """
    if _only_moves(original) or _only_moves(new):
        original, new = expand(original), expand(new)
    before, after = list(_features(original)), list(_features(new))
    missing, extra = _match(before, after, tolerance_mm)
    # What lies beyond the list is counted only: to explain every one of a hundred thousand would take long.
    changes = list(islice(_explain(missing, extra, tolerance_mm), MOST_LISTED + 1))
    lower = list(_lower_traverses(original, new, tolerance_mm))
    found = len(lower) + (len(changes) if len(changes) <= MOST_LISTED else max(len(missing), len(extra), len(changes)))
    return shorten([*lower, *changes], found)


def _only_moves(path: Toolpath) -> bool:
    """Return whether a program does its work without drilling cycles; one that does no work fits any other."""
    return bool(_working(path).any()) and not bool((path.kind == Kind.DRILL).any())


def _working(path: Toolpath) -> NDArray[np.bool_]:
    working: NDArray[np.bool_] = (path.kind >= Kind.FEED) & (path.kind <= Kind.DRILL)
    return working


def _features(path: Toolpath) -> Iterator[Feature]:
    """Yield every hole and every cut, in the order of the program."""
    before = positions_before(path).tolist()
    tools, coolant = _latest(path, Kind.TOOL, path.ref), _latest(path, Kind.COOLANT, path.ref)
    speeds = _latest(path, Kind.SPINDLE, path.value).tolist()
    dwell = np.zeros(len(path))
    dwell[:-1] = np.where(path.kind[1:] == Kind.DWELL, path.value[1:], 0.0)
    for row in np.flatnonzero(_working(path)).tolist():
        motion = path[row]
        x, y, z = motion.end
        common = {"tool": int(tools[row]), "coolant": int(coolant[row]), "feed": motion.value, "speed": speeds[row]}
        if motion.kind is Kind.DRILL:
            cycle = path.cycles[motion.ref]
            yield Feature(
                cycle.name, x, y, cycle.bottom, (x, y, 0.0), _NOWHERE, (0, 0), **common,
                peck=_peck(cycle), dwell=_dwell(cycle), r_plane=cycle.r_plane, retract=z, line=motion.line,
            )  # fmt: skip
            continue
        center, shape, start = _NOWHERE, (0, 0), before[row]
        if motion.kind is not Kind.FEED:
            arc = path.arcs[motion.ref]
            center, shape = arc.center, (arc.plane, arc.turns)
        yield Feature(
            _CUTS[motion.kind], x, y, z, (start[0], start[1], start[2]), center, shape, **common,
            peck=0.0, dwell=float(dwell[row]), r_plane=0.0, retract=0.0, line=motion.line,
        )  # fmt: skip


_NOWHERE = (0.0, 0.0, 0.0)
_CUTS = {Kind.FEED: "cut", Kind.ARC_CW: "clockwise arc", Kind.ARC_CCW: "counter-clockwise arc"}


def _peck(cycle: DrillCycle) -> float:
    return cycle.peck if cycle.name in ("G83", "G73") else 0.0


def _dwell(cycle: DrillCycle) -> float:
    return cycle.dwell if cycle.name in ("G82", "G84") else 0.0


def _latest(path: Toolpath, kind: Kind, column: NDArray) -> NDArray[np.float64]:
    """Return for every row the value that the latest row of `kind` set, 0 before the first."""
    n = len(path)
    rows = np.maximum.accumulate(np.where(path.kind == kind, np.arange(n), -1)) if n else np.zeros(0, dtype=np.int64)
    return np.where(rows >= 0, column[rows], 0.0)


Cell = tuple[int, ...]


def _match(before: list[Feature], after: list[Feature], tolerance: float) -> tuple[list[Feature], list[Feature]]:
    """Return the features of either side that have no equal on the other: each is used once."""
    cells = _sorted_into_cells(after, tolerance, 3)
    missing = []
    for feature in before:
        for key in _cells_around(feature, tolerance, 3):
            cell = cells.get(key, [])
            # From the end, where taking one away is cheap however many lie here.
            equal = next((i for i in reversed(range(len(cell))) if not _changes(feature, cell[i], tolerance)), None)
            if equal is not None:
                del cell[equal]
                break
        else:
            missing.append(feature)
    return missing, [feature for cell in cells.values() for feature in cell]


def _sorted_into_cells(features: list[Feature], tolerance: float, axes: int) -> dict[Cell, list[Feature]]:
    cells: dict[Cell, list[Feature]] = defaultdict(list)
    for feature in features:
        cells[next(_cells_around(feature, tolerance, axes))].append(feature)
    return cells


def _cells_around(feature: Feature, tolerance: float, axes: int) -> Iterator[Cell]:
    """Yield the cells of a grid over x, y (and depth) within `tolerance` of a feature, the one that it lies in first.

    What is not known lies in a row of cells far away.
    """
    size, room = 4.0 * max(tolerance, 1e-6), tolerance + 1e-9
    place = (feature.x, feature.y, feature.depth)[:axes]
    own = tuple(math.floor(v / size) if math.isfinite(v) else _FAR for v in place)
    yield own
    reach = [{math.floor((v + d) / size) for d in (-room, room)} if math.isfinite(v) else {_FAR} for v in place]
    if any(len(cells) > 1 for cells in reach):
        yield from (cell for cell in product(*map(sorted, reach)) if cell != own)


_FAR = 1 << 62


def _changes(a: Feature, b: Feature, tolerance: float) -> list[str]:
    """Return in what `b` is not the work of `a`, in words; an empty list when it is."""
    room = tolerance + 1e-9
    changes = []
    if a.name != b.name:
        changes.append(f"{a.name} became {b.name}")
    if a.tool != b.tool:
        changes.append(f"tool {a.tool} became {b.tool}")
    for word, one, other, allowed, factor in (
        ("x", a.x, b.x, room, 1.0),
        ("y", a.y, b.y, room, 1.0),
        ("depth", a.depth, b.depth, room, 1.0),
        ("peck", a.peck, b.peck, room, 1.0),
        ("dwell", a.dwell, b.dwell, DWELL_ROUNDING + 1e-9, 1.0),
        ("feed in mm/min", a.feed, b.feed, max(FEED_PART * abs(a.feed), FEED_ROUNDING), 60.0),
        ("speed", a.speed, b.speed, max(0.001 * abs(a.speed), SPEED_ROUNDING), 1.0),
        ("coolant", a.coolant, b.coolant, 0.0, 1.0),
    ):
        if abs(one - other) > allowed or math.isnan(one) != math.isnan(other):
            changes.append(f"{word} {one * factor:.6g} became {other * factor:.6g}")
    if a.shape != b.shape or not (_near(a.start, b.start, room) and _near(a.center, b.center, room)):
        changes.append(f"start {place(*a.start)} became {place(*b.start)}, or the arc is another")
    for word, one, other in (("R plane", a.r_plane, b.r_plane), ("retract", a.retract, b.retract)):
        if not other >= one - room:
            changes.append(f"{word} {one:.6g} sank to {other:.6g}")
    return changes


def _near(a: tuple[float, ...], b: tuple[float, ...], room: float) -> bool:
    return all(abs(p - q) <= room or (math.isnan(p) and math.isnan(q)) for p, q in zip(a, b, strict=True))


def _explain(missing: list[Feature], extra: list[Feature], tolerance: float) -> Iterator[Difference]:
    """Yield what became of every feature without an equal: changed, if something else is at its place, or gone."""
    cells = _sorted_into_cells(extra, tolerance, 2)
    for feature in missing:
        there = [(f, key) for key in _cells_around(feature, tolerance, 2) for f in cells.get(key, ())]
        if there:
            found, key = min(there, key=lambda pair: len(_changes(feature, pair[0], tolerance)))
            cells[key].remove(found)
            text = f"at {place(feature.x, feature.y)}: {'; '.join(_changes(feature, found, tolerance))}"
            yield Difference(f"changed {_noun(feature)}", feature.line, found.line, text)
        else:
            yield Difference(f"missing {_noun(feature)}", feature.line, 0, f"{_said(feature)} is gone")
    for feature in (feature for rest in cells.values() for feature in rest):
        yield Difference(f"extra {_noun(feature)}", 0, feature.line, f"{_said(feature)} is new")


def _said(feature: Feature) -> str:
    return f"{feature.name} at {place(feature.x, feature.y, feature.depth)} with tool {feature.tool}"


def _noun(feature: Feature) -> str:
    return "cut" if feature.name in _CUTS.values() else "hole"


def _lower_traverses(original: Toolpath, new: Toolpath, tolerance: float) -> Iterator[Difference]:
    """Yield the tools with which rapids cross the part lower than they ever did before."""
    heights = _lowest_traverses(original)
    for tool, (height, line) in _lowest_traverses(new).items():
        if tool in heights and height < heights[tool][0] - tolerance - 1e-9:
            text = (
                f"rapids with tool {tool} cross the part at Z{height:.3f}, never below Z{heights[tool][0]:.3f} before"
            )
            yield Difference("lower retract", heights[tool][1], line, text)


def _lowest_traverses(path: Toolpath) -> dict[int, tuple[float, int]]:
    """Return by tool the lowest known height of a rapid in x or y, and its line."""
    path = expand(path)
    before = positions_before(path)
    moved = np.abs(path.end - before)
    across = (path.kind == Kind.RAPID) & ((moved[:, 0] > 0) | (moved[:, 1] > 0))
    lowest = np.fmin(before[:, 2], path.end[:, 2])
    tools = _latest(path, Kind.TOOL, path.ref)
    found: dict[int, tuple[float, int]] = {}
    for tool in np.unique(tools[across]).tolist():
        rows = np.flatnonzero(across & (tools == tool) & np.isfinite(lowest))
        if len(rows):
            row = int(rows[np.argmin(lowest[rows])])
            found[int(tool)] = (float(lowest[row]), int(path.line[row]))
    return found
