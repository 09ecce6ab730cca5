"""Which piece of work must come before which: those that touch, and those that lie inside what frees them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import tool_width
from leafcut.geometry.index import NearLines, linked, unique_pairs
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import PieceOfWork
from leafcut.model.toolpath import Kind, arc_extremes, arc_sweep
from leafcut.processes.program.plan.precedence.freeing import (
    LEAST_AREA,
    MEETING,
    Area,
    freeing_pieces,
    freeing_stages,
    level_rows,
    through_cuts,
    work_before_freeing,
)
from leafcut.processes.program.plan.precedence.passes import passes_in_order, rows_in_order
from leafcut.processes.program.plan.precedence.split_outlines import BEAM_TAB, MILL_TAB, TOUCHING, closed_together
from leafcut.processes.program.plan.sections.program_rows import TOLERANCE, Rows, works_with_beam

#: How far a chord may lie from its arc, mm.
_SAGITTA = 0.02
#: Segments in one piece of a path, so that its box is small.
_STRETCH = 32
#: A path of more points is not made into an area; the hull of its points stands for it.
_MOST_POINTS = 20_000
#: So many pieces are looked at together for what they imply.
_BITS = 8192
#: Why an order is kept: cuts touch, passes of a mill whose width is not told, one lies inside the other, a part may
#: come free.
TOUCHES, PASSES, INSIDE, FREES = "touches", "passes", "inside", "frees"
#: The number of a piece, and float64[n, 2]: a line along which it cuts.
_Path = tuple[int, NDArray[np.float64]]


class Precedence(NamedTuple):
    """Pieces, those that free a part marked; the pairs in which their order is kept; and `Section.ties`."""

    pieces: tuple[PieceOfWork, ...]
    pairs: NDArray[np.int32]
    ties: dict[str, NDArray[np.int32]]


def with_precedence(
    program: Program, rows: Rows, pieces: Sequence[PieceOfWork], process: str, look: Heartbeat = unseen
) -> Precedence:
    """Return the pieces, those that free a part marked, and the pairs in which the order of the program is kept.

    Two cuts that come nearer to each other than the tool is wide (where a comment says how wide; else than
    `TOUCHING`) keep their order: passes over the same place, a finishing pass, a hole drilled again. A closed cut
    stays behind what is inside it and came before it, also where several pieces close it together; what a mill makes
    inside a closed cut stays behind that, too, as the outer one may be the rough one. What frees a part stays behind
    all other work before it (`freeing`). What follows from others is left out: int32[k, 2], pairs
    (before, after). `look` is called as it goes on.
    """
    n = len(pieces)
    causes = related(program, rows, pieces, pieces, process, look)
    causes = {cause: pairs[pairs[:, 0] < pairs[:, 1]] for cause, pairs in causes.items()}
    marked = _freeing(program, rows, pieces, process, look)
    causes[FREES] = work_before_freeing(marked)
    ties = {cause: ties_of(pairs, n) for cause, pairs in causes.items() if len(pairs)}
    stages = divided_at(freeing_stages(marked), n)
    if stages is not None:
        ties[FREES] = nearer(ties.get(FREES), stages)
    return Precedence(marked, _without_implied(np.concatenate(list(causes.values())), n, look), ties)


def ties_of(pairs: NDArray[np.int64], n: int) -> NDArray[np.int32]:
    """Return `Section.ties` of pairs (before, after), int64[k, 2], of n pieces."""
    ties = no_ties(n)
    np.minimum.at(ties[:, 0], pairs[:, 0], pairs[:, 1].astype(np.int32))
    np.maximum.at(ties[:, 1], pairs[:, 1], pairs[:, 0].astype(np.int32))
    return ties


def no_ties(n: int) -> NDArray[np.int32]:
    """Return `Section.ties` of pieces that nothing binds."""
    return np.tile(np.array([n, -1], dtype=np.int32), (n, 1))


def nearer(one: NDArray[np.int32] | None, other: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return what binds pieces that are bound by both of two causes."""
    if one is None:
        return other
    return np.stack([np.minimum(one[:, 0], other[:, 0]), np.maximum(one[:, 1], other[:, 1])], axis=1)


def divided_at(edges: Sequence[int], n: int) -> NDArray[np.int32] | None:
    """Return `Section.ties` of n pieces that stay on their side of every edge; None without edges."""
    inner = [edge for edge in edges if 0 < edge < n]
    if not inner:
        return None
    ends = np.array([*inner, n], dtype=np.int32)
    part = np.searchsorted(ends, np.arange(n), side="right")
    return np.stack([ends[part], np.array([0, *inner], dtype=np.int32)[part] - 1], axis=1).astype(np.int32)


def _freeing(
    program: Program, rows: Rows, pieces: Sequence[PieceOfWork], process: str, look: Heartbeat
) -> tuple[PieceOfWork, ...]:
    """Return the pieces, those that free a part marked."""
    found, deepest = through_cuts(program, rows, pieces, process)
    through = found.tolist()
    if not through:
        return tuple(pieces)
    low, high = int(program.first[pieces[through[0]].begin]), int(program.first[pieces[through[-1]].end])
    level = np.zeros(len(program.path), dtype=bool)
    for number in through:
        level[program.first[pieces[number].begin] : program.first[pieces[number].end]] = level_rows(
            program, rows, pieces[number]
        )
    steps = _steps(program, rows, low, high, level)
    areas: list[Area] = []
    open_: list[_Path] = []
    for number in through:
        look()
        for path in _lines_of(program, rows, steps, pieces[number]):
            area = _area(path)
            if area is not None and area.area < LEAST_AREA:
                continue
            if area is not None:
                meets = np.abs(path[-1] - path[0]).max() <= MEETING
                areas.append(Area(number, area, meets or not shapely.is_simple(shapely.linestrings(path))))
            elif (path != path[0]).any():
                open_.append((number, path))
    for area, numbers in closed_together(open_, TOUCHING, look):
        areas += [Area(number, area, False) for number in numbers]
    return freeing_pieces(areas, pieces, deepest)


def related(
    program: Program,
    rows: Rows,
    ones: Sequence[PieceOfWork],
    others: Sequence[PieceOfWork],
    process: str,
    look: Heartbeat = unseen,
) -> dict[str, NDArray[np.int64]]:
    """Return int64[k, 2], pairs of a piece of `ones` and one of `others` whose order has meaning, by cause."""
    widths = tool_width(program, ones[0].begin), tool_width(program, others[0].begin)
    reach = TOUCHING + 2 * _SAGITTA + max(widths)
    first = _paths(program, rows, ones, look)
    second = first if others is ones else _paths(program, rows, others, look)
    near, owner = mine = _short_lines(first)
    other_near, other_owner = other = mine if others is ones else _short_lines(second)
    pairs: list[NDArray[np.int64]] = []
    for a, b in near.pairs(other_near, reach):
        look()
        pairs.append(unique_pairs(owner[a], other_owner[b]))
    passes: list[NDArray[np.int64]] = []
    if process not in BEAMS and not all(widths):
        for found in passes_in_order(program, rows, ones, others, (mine, other)):
            look()
            passes.append(found)
        if others is ones:
            passes.append(rows_in_order(first, ones))
    # Inside something that came before it, work is free again, unless a mill goes round.
    tab = BEAM_TAB if process in BEAMS else MILL_TAB
    inside = [_inside(first, second, tab, look)]
    if process not in BEAMS or not works_with_beam(program, rows):
        around = inside[0] if first is second else _inside(second, first, tab, look)
        inside.append(around[:, ::-1])
    return {TOUCHES: _each_once(pairs), PASSES: _each_once(passes), INSIDE: _each_once(inside)}


def _each_once(pairs: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    every = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
    return unique_pairs(every[:, 0], every[:, 1])


def _paths(program: Program, rows: Rows, pieces: Sequence[PieceOfWork], look: Heartbeat) -> list[_Path]:
    """Return the lines that the cuts of pieces go along, in order."""
    low = min(int(program.first[c.begin]) for c in pieces)
    steps = _steps(program, rows, low, max(int(program.first[c.end]) for c in pieces))
    paths: list[_Path] = []
    for number, piece in enumerate(pieces):
        look()
        paths += [(number, points) for points in _lines_of(program, rows, steps, piece)]
    return paths


class _Steps(NamedTuple):
    """The rows of some pieces that cut, and those in which the tool waits.

    Attributes
    ----------
    row
        int64[k]: the rows that cut, or may.
    ends
        float64[k, 2, 2]: where each begins and ends.
    parts, bent
        bool[k]: the one before ends elsewhere; it is an arc, or where it goes is not known.
    waits
        int64[m]: the rows of dwells.
    """

    row: NDArray[np.int64]
    ends: NDArray[np.float64]
    parts: NDArray[np.bool_]
    bent: NDArray[np.bool_]
    waits: NDArray[np.int64]


def _steps(program: Program, rows: Rows, low: int, high: int, chosen: NDArray[np.bool_] | None = None) -> _Steps:
    """Return the steps among the rows low … high - 1, only those `chosen`, bool[rows], where that is given."""
    path = program.path
    kind, part = path.kind[low:high], slice(low, high)
    # A beam without power that was not switched off may cut for all that is known.
    dim = (kind >= Kind.FEED) & (kind <= Kind.ARC_CCW) & rows.sideways[part] & ~rows.travel[part]
    cuts = (rows.cut[part] & (kind != Kind.DWELL)) | dim
    row = low + np.flatnonzero(cuts if chosen is None else cuts & chosen[part])
    kinds, end = path.kind[row], path.end[row, :2]
    begin = np.where((kinds == Kind.DRILL)[:, None], end, rows.before[row, :2])
    with np.errstate(invalid="ignore"):
        goes_on = (np.abs(begin[1:] - end[:-1]) <= TOLERANCE).all(axis=1)
    ends = np.stack([begin, end], axis=1)
    bent = (kinds == Kind.ARC_CW) | (kinds == Kind.ARC_CCW) | ~np.isfinite(ends).all(axis=(1, 2))
    parts = np.concatenate([np.ones(min(len(row), 1), dtype=bool), ~goes_on])
    return _Steps(row, ends, parts, bent, low + np.flatnonzero(kind == Kind.DWELL))


def _lines_of(program: Program, rows: Rows, steps: _Steps, piece: PieceOfWork) -> list[NDArray[np.float64]]:
    """Return float64[n, 2] for every line that the cut of a piece goes along without a way in between, arcs as chords.

    A line has two points at least; a hole has its place twice, and so has where the tool waits.
    """
    rims = program.first[piece.begin], program.first[piece.end]
    low, high = np.searchsorted(steps.row, rims).tolist()
    waits = steps.waits[slice(*np.searchsorted(steps.waits, rims))]
    lines: list[NDArray[np.float64]] = []
    edges = [low, *(low + 1 + np.flatnonzero(steps.parts[low + 1 : high])).tolist(), high] if high > low else []
    for one, other in pairwise(edges):
        if other == one + 1 and not steps.bent[one]:
            lines.append(steps.ends[one])
            continue
        points = np.concatenate([steps.ends[one, :1], *_corners(program, steps.row[one:other])])
        points = points[np.isfinite(points).all(axis=1)]
        if len(points):
            lines.append(points if len(points) > 1 else np.repeat(points, 2, axis=0))
    if len(waits):
        places = rows.before[waits, :2]
        lines += [np.array([place, place]) for place in np.unique(places[np.isfinite(places).all(axis=1)], axis=0)]
    return lines or [np.array([piece.entry, piece.entry])]


def _corners(program: Program, rows: NDArray[np.int64]) -> list[NDArray[np.float64]]:
    """Return the ends of cuts that follow each other, those of arcs with the ends of their chords before them."""
    path = program.path
    kinds = path.kind[rows]
    arcs = (kinds == Kind.ARC_CW) | (kinds == Kind.ARC_CCW)
    if not arcs.any():
        return [path.end[rows, :2]]
    ends = zip(rows.tolist(), arcs.tolist(), strict=True)
    return [_chords(program, row) if arc else path.end[row : row + 1, :2] for row, arc in ends]


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


def _short_lines(paths: list[_Path]) -> tuple[NearLines, NDArray[np.int64]]:
    """Return short lines that together are the paths, and the number of the piece that each is of."""
    coordinates: list[NDArray[np.float64]] = []
    line_of: list[NDArray[np.int64]] = []
    owner: list[int] = []
    still: list[int] = []
    for number, path in paths:
        for begin in range(0, len(path) - 1, _STRETCH):
            stretch = path[begin : begin + _STRETCH + 1]
            if (stretch == stretch[0]).all():
                still.append(len(owner))
            coordinates.append(stretch)
            line_of.append(np.full(len(stretch), len(owner)))
            owner.append(number)
    lines: Any = shapely.linestrings(np.concatenate(coordinates), indices=np.concatenate(line_of))
    # A line without length is no line to GEOS, and near to nothing.
    lines[still] = shapely.points(np.array([coordinates[k][0] for k in still]).reshape(-1, 2))
    return NearLines(lines), np.array(owner, dtype=np.int64)


def _inside(inner: list[_Path], outer: list[_Path], tab: float, look: Heartbeat) -> NDArray[np.int64]:
    """Return int64[k, 2], pairs of a piece of `inner` that begins inside an outline of `outer`, and one that cuts it.

    An outline that several pieces cut together is closed by the last of them, whichever that will be: what is inside
    is paired with each.
    """
    areas: list[Any] = []
    owners: list[list[int]] = []
    open_: list[_Path] = []
    for number, path in outer:
        look()
        area = _area(path)
        if area is not None:
            areas.append(area)
            owners.append([number])
        elif (path != path[0]).any():
            open_.append((number, path))
    for area, numbers in closed_together(open_, tab, look):
        areas.append(area)
        owners.append(numbers)
    if not areas or not inner:
        return np.zeros((0, 2), dtype=np.int64)
    begins: Any = shapely.points(np.array([path[0] for _, path in inner]))
    tree = shapely.STRtree(begins)
    pairs: set[tuple[int, int]] = set()
    for area, numbers in zip(areas, owners, strict=True):
        look()
        points = tree.query(area, predicate="contains").tolist()
        pairs.update((inner[point][0], owner) for point in points for owner in numbers)
    # A piece of several lines may lie inside one of its own, or inside an outline that it helps to close.
    found = [pair for pair in pairs if inner is not outer or pair[0] != pair[1]]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _is_closed(path: NDArray[np.float64]) -> bool:
    """Return whether a path ends about where it began: a lead-in and a lead-out may lie between."""
    if len(path) < 4:
        return False
    steps = np.hypot(*np.diff(path, axis=0).T)
    gap = float(np.hypot(*(path[-1] - path[0])))
    return gap <= max(TOUCHING, 0.1 * float(steps.sum())) and float(steps.sum()) > TOUCHING


def _area(path: NDArray[np.float64]) -> Any:
    """Return the area that a path goes round, or None."""
    closed = _is_closed(path)
    if len(path) < 4 or not (closed or len(path) > _MOST_POINTS or not shapely.is_simple(shapely.linestrings(path))):
        return None
    if len(path) > _MOST_POINTS:
        hull: Any = shapely.convex_hull(shapely.multipoints(path))
        return hull if hull.geom_type == "Polygon" else None
    whole = np.concatenate([path, path[:1]]) if closed else path
    ring: Any = shapely.polygons(whole) if closed else None
    if ring is not None and shapely.is_valid(ring):
        return ring if ring.area > 0 else None
    # It crosses itself, as a lead-in does, or goes round several times: all that its lines enclose.
    noded = shapely.node(shapely.linestrings(whole))
    cells = shapely.polygonize(shapely.get_parts(noded))
    area = shapely.union_all(shapely.get_parts(cells))
    return area if area.area > 0 else None


def _without_implied(pairs: NDArray[np.int64], n: int, look: Heartbeat = unseen) -> NDArray[np.int32]:
    """Return the pairs (before, after), all from a lower to a higher number, without those that others imply.

    What hangs together is looked at by itself, and of that so many pieces at a time: memory grows with n alone.
    """
    if not len(pairs):
        return np.zeros((0, 2), dtype=np.int32)
    group = linked(n, pairs[:, 0], pairs[:, 1])
    # Pieces in the order of their groups: the numbers of what hangs together are near to each other.
    order = np.argsort(group, kind="stable")
    rank = np.empty(n, dtype=np.int64)
    rank[order] = np.arange(n)
    pairs = unique_pairs(*rank[pairs].T)
    stop = np.searchsorted(group[order], group[order], side="right")
    kept: list[tuple[int, int]] = []
    by_after = pairs[np.lexsort([-pairs[:, 0], pairs[:, 1]])]
    for low in range(0, n, _BITS):
        look()
        high = min(low + _BITS, n)
        first, last = np.searchsorted(by_after[:, 1], [low, stop[high - 1]])
        kept += _kept_from(by_after[first:last].tolist(), low, high)
    whole = order[np.array(kept, dtype=np.int64)]
    return whole[np.lexsort([-whole[:, 0], whole[:, 1]])].astype(np.int32)


def _kept_from(pairs: list[list[int]], low: int, high: int) -> list[tuple[int, int]]:
    """Return which pairs that begin at low ≤ before < high no others imply.

    `pairs` are sorted by their ends, those of one end with the highest beginning first.
    """
    # Bit k of `ancestors[i]`: piece low + k must come before piece i.
    ancestors: dict[int, int] = {}
    kept = []
    for before, after in pairs:
        known = ancestors.get(after, 0)
        if low <= before < high and not known >> (before - low) & 1:
            kept.append((before, after))
            known |= 1 << (before - low)
        known |= ancestors.get(before, 0)
        if known:
            ancestors[after] = known
    return kept
