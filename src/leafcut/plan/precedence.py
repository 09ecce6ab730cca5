"""Which piece of work must come before which: those that touch, and those that lie inside what frees them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.model.sequence import Chain
from leafcut.model.toolpath import Kind, arc_extremes, arc_sweep
from leafcut.plan.chains import BEAMS, Rows
from leafcut.units import MM_PER_INCH

#: Cuts closer than this are at the same place, mm.
TOUCHING = 0.05
#: How far a chord may lie from its arc, mm.
_SAGITTA = 0.02
#: Segments in one piece of a path, so that its box is small.
_PIECE = 32
#: A path of more points is not made into an area; the hull of its points stands for it.
_MOST_POINTS = 20_000
#: Lines above a section in which its tool may be described.
_FARTHEST_COMMENT = 2000
_DIAMETER = re.compile(
    r"(?:diameter|\bdia\b\.?|drill size|bit size|\bD\s*=|Ø)\s*[:=]?\s*([0-9]*\.?[0-9]+)\s*(mm|inch|in\b|\")?",
    re.IGNORECASE,
)


def find_precedence(program: Program, rows: Rows, chains: Sequence[Chain], process: str) -> NDArray[np.int32]:
    """Return int32[k, 2], pairs (before, after) of chains, in which the order of the program is kept.

    Two cuts that come nearer to each other than the tool is wide (where a comment says how wide; else than
    `TOUCHING`) keep their order: passes over the same place, a finishing pass, a hole drilled again. A closed cut
    stays behind what is inside it and came before it; what a mill makes inside a closed cut stays behind that, too, as
    the outer one may be the rough one. What follows from others is left out.
    """
    pairs = related(program, rows, chains, chains, process)
    keep = pairs[pairs[:, 0] < pairs[:, 1]]
    return _without_implied(keep, len(chains))


def related(
    program: Program, rows: Rows, ones: Sequence[Chain], others: Sequence[Chain], process: str
) -> NDArray[np.int64]:
    """Return int64[k, 2], pairs of a chain of `ones` and one of `others` whose order has meaning, in that order."""
    import shapely

    reach = TOUCHING + 2 * _SAGITTA + max(tool_width(program, ones[0].begin), tool_width(program, others[0].begin))
    first = [_path(program, rows, c) for c in ones]
    second = first if others is ones else [_path(program, rows, c) for c in others]
    lines, owner = _pieces(shapely, first)
    other_lines, other_owner = (lines, owner) if others is ones else _pieces(shapely, second)
    found = shapely.STRtree(lines).query(other_lines, predicate="dwithin", distance=reach)
    pairs = [np.stack([owner[found[1]], other_owner[found[0]]], axis=1)]
    # Inside something that came before it, work is free again, unless a mill goes round.
    pairs.append(_inside(shapely, first, second))
    if process not in BEAMS:
        pairs.append(_inside(shapely, second, first)[:, ::-1])
    every = np.concatenate(pairs)
    return np.unique(every, axis=0) if len(every) else every


def tool_width(program: Program, block: int) -> float:
    """Return the diameter, mm, that the last comment before a block gives for a tool, or 0."""
    line = int(program.line[block]) - 1
    unit = program.modal(block).unit or 1.0
    changes = np.flatnonzero(program.path.kind == Kind.TOOL)
    at = program.path.line[changes]
    last = int(at[at <= line].max()) if (at <= line).any() else 1
    for number in range(line, max(last - 20, line - _FARTHEST_COMMENT, 0) - 1, -1):
        text = program.lines[number]
        match = _DIAMETER.search(text) if "(" in text or ";" in text else None
        if match:
            said = (match.group(2) or "").lower()
            scale = 1.0 if said == "mm" else MM_PER_INCH if said else unit
            return float(match.group(1)) * scale
    return 0.0


def _path(program: Program, rows: Rows, chain: Chain) -> NDArray[np.float64]:
    """Return float64[n, 2], the places that the cut of a chain goes through, arcs as chords."""
    path = program.path
    low, high = int(program.first[chain.begin]), int(program.first[chain.end])
    chosen = low + np.flatnonzero(rows.cut[low:high] & (path.kind[low:high] != Kind.DWELL))
    if not len(chosen):
        return np.array([chain.entry, chain.entry])
    kinds = path.kind[chosen]
    if not np.isin(kinds, [Kind.ARC_CW, Kind.ARC_CCW]).any():
        start = path.end[chosen[:1], :2] if kinds[0] == Kind.DRILL else rows.before[chosen[:1], :2]
        points = np.concatenate([start, path.end[chosen, :2]])
    else:
        parts = [rows.before[chosen[:1], :2]]
        parts += [
            _chords(program, row) if kind in (Kind.ARC_CW, Kind.ARC_CCW) else path.end[row : row + 1, :2]
            for row, kind in zip(chosen.tolist(), kinds.tolist(), strict=True)
        ]
        points = np.concatenate(parts)
    points = points[np.isfinite(points).all(axis=1)]
    return points if len(points) > 1 else np.array([chain.entry, chain.entry])


def _chords(program: Program, row: int) -> NDArray[np.float64]:
    path = program.path
    arc, end = path.arcs[int(path.ref[row])], path.end[row : row + 1, :2]
    if arc.plane != 17:
        return np.concatenate([np.array(arc_extremes(path, row)).reshape(-1, 3)[:, :2], end])
    radius, start, sweep = arc_sweep(path, row)
    sweep = math.copysign(min(abs(sweep), math.tau), sweep)
    step = 2 * math.acos(max(1 - _SAGITTA / radius, 0.0)) if radius > _SAGITTA else math.pi / 2
    count = min(max(math.ceil(abs(sweep) / step), 1), 360)
    angles = start + sweep * np.arange(1, count) / count
    centre = np.array(arc.center[:2])
    return np.concatenate([centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), end])


def _pieces(shapely: Any, paths: list[NDArray[np.float64]]) -> tuple[NDArray[np.object_], NDArray[np.int64]]:
    """Return short lines that together are the paths, and the number of the path that each is of."""
    coordinates: list[NDArray[np.float64]] = []
    line_of: list[NDArray[np.int64]] = []
    owner: list[int] = []
    still: list[int] = []
    for number, path in enumerate(paths):
        for begin in range(0, len(path) - 1, _PIECE):
            piece = path[begin : begin + _PIECE + 1]
            if (piece == piece[0]).all():
                still.append(len(owner))
            coordinates.append(piece)
            line_of.append(np.full(len(piece), len(owner)))
            owner.append(number)
    lines: NDArray[np.object_] = shapely.linestrings(np.concatenate(coordinates), indices=np.concatenate(line_of))
    # A line without length is no line to GEOS, and near to nothing.
    lines[still] = shapely.points(np.array([coordinates[k][0] for k in still]).reshape(-1, 2))
    return lines, np.array(owner, dtype=np.int64)


def _inside(shapely: Any, inner: list[NDArray[np.float64]], outer: list[NDArray[np.float64]]) -> NDArray[np.int64]:
    """Return int64[k, 2], pairs of a path of `inner` that begins inside a loop of a path of `outer`, and that one."""
    areas: list[Any] = []
    owner: list[int] = []
    for number, path in enumerate(outer):
        area = _area(shapely, path)
        if area is not None:
            areas.append(area)
            owner.append(number)
    if not areas or not inner:
        return np.zeros((0, 2), dtype=np.int64)
    points = shapely.points(np.array([path[0] for path in inner]))
    area_at, point_at = shapely.STRtree(points).query(np.array(areas, dtype=object), predicate="contains")
    return np.stack([point_at, np.array(owner)[area_at]], axis=1)


def _is_closed(path: NDArray[np.float64]) -> bool:
    """Return whether a path ends about where it began: a lead-in and a lead-out may lie between."""
    if len(path) < 4:
        return False
    steps = np.hypot(*np.diff(path, axis=0).T)
    gap = float(np.hypot(*(path[-1] - path[0])))
    return gap <= max(TOUCHING, 0.1 * float(steps.sum())) and float(steps.sum()) > TOUCHING


def _area(shapely: Any, path: NDArray[np.float64]) -> Any:
    """Return the area that a path goes round, or None."""
    closed = _is_closed(path)
    if len(path) < 4 or not (closed or len(path) > _MOST_POINTS or not shapely.is_simple(shapely.linestrings(path))):
        return None
    if len(path) > _MOST_POINTS:
        hull = shapely.convex_hull(shapely.multipoints(path))
        return hull if hull.geom_type == "Polygon" else None
    whole = np.concatenate([path, path[:1]]) if closed else path
    ring = shapely.polygons(whole) if closed else None
    if ring is not None and shapely.is_valid(ring):
        return ring if ring.area > 0 else None
    # It crosses itself, as a lead-in does, or goes round several times: all that its lines enclose.
    noded = shapely.node(shapely.linestrings(whole))
    cells = shapely.polygonize(shapely.get_parts(noded))
    area = shapely.union_all(shapely.get_parts(cells))
    return area if area.area > 0 else None


def _without_implied(pairs: NDArray[np.int64], n: int) -> NDArray[np.int32]:
    """Return the pairs (before, after), all from a lower to a higher number, without those that others imply."""
    if not len(pairs):
        return np.zeros((0, 2), dtype=np.int32)
    before_of: list[list[int]] = [[] for _ in range(n)]
    for before, after in pairs.tolist():
        before_of[after].append(before)
    # Bit k of `ancestors[i]`: chain k must come before chain i.
    ancestors = [0] * n
    kept = []
    for after, those in enumerate(before_of):
        known = 0
        for before in sorted(set(those), reverse=True):
            if not known >> before & 1:
                kept.append((before, after))
                known |= ancestors[before] | 1 << before
        ancestors[after] = known
    return np.array(kept, dtype=np.int32)
