"""Which cuts of a mill free a part, and what therefore has to be done before them.

A part that hangs on to the sheet by nothing may tilt or fly when its neighbours are machined. So a cut that goes round
something, through the material and without tabs, is not made before other work that was before it, wherever that is.

How thick the material is no program says: the deepest place that a mill goes to sideways is taken to be its underside,
and what comes within `_THROUGH` of it to be through. A cut-out that lies inside another cut through the material, and
has nothing in it, frees no part but a scrap: it is work like any other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import PieceOfWork
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.sections.program_rows import Rows, works_with_beam

#: What is so near the deepest cut is through the material, mm: bores go a little deeper than outlines. An outline in
#: which a cut-out may lie is as deep as this at least.
THROUGH, OUTER = 1.0, 0.6
#: A tab is higher than this, mm; what rises less while it cuts is at one level.
LOWEST_TAB = 0.2
#: A part is no smaller, mm²: a mill that goes round less makes a hole as a drill would.
LEAST_AREA = 1.0
#: Ends that lie no farther apart than this meet, mm.
MEETING = 0.005
#: Depths that differ by less are one, mm.
_LEVEL = 0.01
#: An area inside another one is smaller by more than this part; else both are passes of one outline.
_SMALLER = 0.95
#: More pairs of work and what frees a part later are too many for a search.
_MOST_PAIRS = 50_000

_ARCS = (int(Kind.ARC_CW), int(Kind.ARC_CCW))


class Area(NamedTuple):
    """What a piece goes round, by the piece's number; `alone` says that it is the whole of it, ends that meet."""

    piece: int
    shape: Any
    alone: bool


def through_cuts(
    program: Program, rows: Rows, pieces: Sequence[PieceOfWork], process: str
) -> tuple[NDArray[np.int64], float]:
    """Return the pieces that reach through the material, as far as a program tells, int64[k], rising; and how deep."""
    if process in BEAMS or works_with_beam(program, rows):
        return np.zeros(0, dtype=np.int64), math.nan
    deepest = float(rows.deepest[program.before[pieces[0].begin]])
    bottom = np.array([c.bottom for c in pieces], dtype=np.float64)
    cuts = np.array([c.kind == "cut" for c in pieces], dtype=bool)
    with np.errstate(invalid="ignore"):
        return np.flatnonzero(cuts & (bottom <= deepest + THROUGH)), deepest


def level_rows(program: Program, rows: Rows, piece: PieceOfWork) -> NDArray[np.bool_]:
    """Return which rows of a piece are part of what it cuts at its lowest level, bool[rows of the piece].

    A tab lies higher. A way that sinks from its begin to its end has no tabs, and is all of it.
    """
    part = slice(int(program.first[piece.begin]), int(program.first[piece.end]))
    z, before = program.path.end[part, 2], rows.before[part, 2]
    feeds = rows.cut[part] & (program.path.kind[part] <= Kind.ARC_CCW)
    aside = np.flatnonzero(feeds & (rows.sideways[part] | np.isin(program.path.kind[part], _ARCS)))
    if not len(aside):
        return np.zeros(len(z), dtype=bool)
    among = slice(int(aside[0]), int(aside[-1]) + 1)
    if (z[among] <= before[among] + _LEVEL).all():
        return feeds
    limit = piece.bottom + LOWEST_TAB
    return feeds & (z <= limit) & (before <= limit)


def freeing_pieces(areas: Sequence[Area], pieces: Sequence[PieceOfWork], deepest: float) -> tuple[PieceOfWork, ...]:
    """Return the pieces, those marked that free a part; `areas` are what they go round, as far as they reach through.

    `deepest` is how deep the mill goes, mm.
    """
    if not areas:
        return tuple(pieces)
    owner = np.array([area.piece for area in areas])
    shapes = np.array([area.shape for area in areas], dtype=object)
    size = shapely.area(shapes)
    tree = shapely.STRtree(shapes)
    entries: Any = shapely.points(np.array([c.entry for c in pieces], dtype=np.float64))
    around, spot = shapely.STRtree(entries).query(shapes, predicate="contains")
    holds = _any(len(areas), around[owner[around] != spot])
    # In doubt a cut-out is no scrap where that holds it back, and one where that would set it free.
    deep = np.array([pieces[number].bottom <= deepest + OUTER for number in owner.tolist()], dtype=bool)
    inner, outer = tree.query(shapes, predicate="within")
    scrap = _any(len(areas), inner[deep[outer] & (size[inner] < _SMALLER * size[outer])])
    inner, outer = tree.query(shapely.point_on_surface(shapes), predicate="within")
    doubtful = _any(len(areas), inner[size[inner] < _SMALLER * size[outer]])
    alone = np.array([area.alone for area in areas], dtype=bool)
    may = _any(len(pieces), owner[~scrap | holds]).tolist()
    surely = _any(len(pieces), owner[alone & (~doubtful | holds)]).tolist()
    return tuple(
        replace(c, may_free=one, frees=one and other) if one else c
        for c, one, other in zip(pieces, may, surely, strict=True)
    )


def _any(n: int, which: NDArray[np.int64]) -> NDArray[np.bool_]:
    found = np.zeros(n, dtype=bool)
    found[which] = True
    return found


def freeing_stages(pieces: Sequence[PieceOfWork]) -> list[int]:
    """Return the pieces from which on all there is frees parts that nothing before it may wait for, rising.

    All before such a piece comes before all behind it, so that each stage is a section of its own.
    """
    may, frees, bottoms = _of_pieces(pieces)
    if not may.any():
        return []
    only = np.logical_and.accumulate(may[::-1])[::-1]
    # Of what surely frees parts, as that may change places with its like.
    lowest = np.minimum.accumulate(np.where(frees, bottoms, np.inf))[:-1]
    highest = np.maximum.accumulate(bottoms[::-1])[::-1][1:]
    found: list[int] = (1 + np.flatnonzero(only[1:] & (lowest > highest + _LEVEL))).tolist()
    return found


def work_before_freeing(pieces: Sequence[PieceOfWork]) -> NDArray[np.int64]:
    """Return int64[k, 2], pairs (before, after): all work before every later piece that frees a part.

    Those that free parts at one depth may change places: which of two parts comes free first is all the same. Pairs
    of different stages are left out; where there are too many others, parts come free in their old order.
    """
    may, frees, bottoms = _of_pieces(pieces)
    found = []
    for low, high in pairwise([0, *freeing_stages(pieces), len(pieces)]):
        after = low + np.flatnonzero(may[low:high])
        many = (after - low).sum() > _MOST_PAIRS
        for first, last in pairwise([low, *after.tolist()]):
            earlier = np.arange(first if many else low, last)
            alike = frees[earlier] & (bottoms[earlier] <= bottoms[last] + _LEVEL) & (not many)
            found.append(np.column_stack([earlier[~alike], np.full(np.count_nonzero(~alike), last)]))
    return np.concatenate(found) if found else np.zeros((0, 2), dtype=np.int64)


def _of_pieces(pieces: Sequence[PieceOfWork]) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float64]]:
    may, frees = (np.array([getattr(c, name) for c in pieces], dtype=bool) for name in ("may_free", "frees"))
    return may, frees, np.array([c.bottom for c in pieces], dtype=np.float64)
