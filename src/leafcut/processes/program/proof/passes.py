"""Passes of a mill: levels beside each other, a finishing pass beside its roughing, rows that clear a surface.

They touch nowhere, and yet their order has meaning: made the other way round, the tool cuts what another pass was to
take away before it. What is judged here is judged from the cuts alone and from what comments say of the tools; where
that leaves room for doubt the order counts as free, as whoever wrote the new program may know more.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import FIRST_CYCLE, Features
from leafcut.processes.program.proof.traces import Traces
from leafcut.proof.difference import MOST_LISTED
from leafcut.units import MM_PER_INCH

#: Where no comment says how wide the tool is: what is farther apart than this no mill needs to take in one go, mm.
_REACH = 6.0
#: Roughing leaves no more than this for finishing, mm.
_BESIDE = 0.99
#: Depths that differ by no more are one level, mm.
_LEVEL = 0.01
#: So much of a cut lies at its lowest place if it is a level one, and not the line of a surface.
_FLAT_PART = 0.25
#: A cut whose ends are nearer than this goes round, mm.
_ROUND = 1.0
#: So much of the shorter of two passes side by side lies beside the other, of so many places that are looked at.
_BESIDE_PART, _PLACES = 0.55, 40
#: Rows: how far apart at most, mm; how much of the length they lean at most; how many at least.
_ROW, _LEAN, _LEAST_ROWS = 100.0, 0.015, 3
#: Lines of a way in one piece, pieces and pairs that are looked at together.
_PIECE, _PIECES, _PAIRS = 32, 512, 2000
#: Traces whose ways are made together.
_AT_ONCE = 50_000
#: Times that an arc of an eighth of a turn is halved to be drawn as lines: 0.005 of its radius are left.
_HALVINGS = 2

_ABOUT_TOOL = re.compile(r"tool|mill|drill|bit\b|nose|cutter|\bdia|\bD\s?=|Ø", re.IGNORECASE)
_NUMBER = r"([0-9]{1,3}\s?/\s?[0-9]{1,3}|[0-9]{0,4}\.[0-9]{1,6}|[0-9]{1,4})\.?"
_TOOL = r"[a-z-]{0,12}(?:mill|drill|nose|cutter|bit)\b"
#: A number is the width of a tool where its word or its tool stands beside it, with nothing but adjectives between.
_WIDTH = re.compile(
    rf"(?:\bD\s?=|\bdia[a-z]*\b\.?|\bsize\b|Ø)\s?[:=]?\s?{_NUMBER}\s?(mm|inch|in\b|\")?"
    rf"|(?:{_TOOL}|\btool\b|\b(?:tool\s?)?T?[0-9]{{1,3}}(?=\s*[-=:]))[^a-z0-9.]{{1,6}}{_NUMBER}\s?(mm|inch|in\b|\")"
    rf"|{_NUMBER}\s?(mm|inch|in\b|\")?[\s-]?(?=(?:[a-z]{{1,20}}[\s-]{{1,3}}){{0,3}}?{_TOOL})",
    re.IGNORECASE,
)
#: What stands before a number that is none of a tool's, or between it and its tool.
_OTHER = (
    r"leav\w*|left|stock|allow\w*|offset\w*|depth|deep|step\w*|over\w*|down|up|tol\w*|clear\w*|finish\w*|rough\w*|"
    r"remain\w*|thick\w*|doc|woc|ae|ap|length|long|stickout|corner|radius|flutes?|fl|teeth|deg|feed|speed|rpm|by|for|of|"
    r"with|per|every|spring|pass\w*|add|minus|plus"
)
_BEFORE_OTHER = re.compile(rf"\b(?:{_OTHER})[^a-z0-9]*$", re.IGNORECASE)
_BETWEEN_OTHER = re.compile(rf"\b(?:{_OTHER})\b", re.IGNORECASE)
_AFTER_OTHER = re.compile(r"[^a-z0-9]{0,3}(?:deep|depth|stock|left|long|steps?|pass\w*|doc|woc)\b", re.IGNORECASE)


class Misordered(NamedTuple):
    """Two features of passes that have changed places: the earlier and the later as they were, and in what way."""

    one: int
    other: int
    text: str


@dataclass(frozen=True, eq=False)
class _Visits:
    """What is made between two ways across, an entry each.

    Attributes
    ----------
    first
        int64[n]: the first feature that is made on the way there.
    begins
        int64[n]: the place of it in the new program, -1 where it is gone.
    bottom
        float64[n], mm.
    cuts, level, round
        bool[n]: it goes sideways; most of it at its lowest place; and back to its begin.
    ends
        float64[n, 2, 2]: begin and end of the way, NaN where there is none.
    length
        float64[n]: of the way, seen from above.
    """

    first: Indices
    begins: Indices
    bottom: Floats
    cuts: Mask
    level: Mask
    round: Mask
    ends: Floats
    length: Floats


def told_width(program: Program) -> float:
    """Return the smallest width that comments of a program give a tool, mm; infinite where none does."""
    unit = next((m.unit for m in program.modals if m.unit), 1.0)
    widths = [math.inf]
    for text in program.lines:
        begin = min((k for k in (text.find("("), text.find(";")) if k >= 0), default=-1)
        if begin < 0 or not _ABOUT_TOOL.search(text, begin):
            continue
        for match in _WIDTH.finditer(text, begin):
            whole, named = match[1] or match[3] or match[5], (match[2] or match[4] or match[6] or "").lower()
            if not match[1] and _is_other(text, match):
                continue
            if "size" in match[0].lower() and _BEFORE_OTHER.search(text[begin : match.start()]):
                continue
            above, _, below = whole.partition("/")
            value = float(above) / (float(below) or 1.0) if below else float(above)
            scale = 1.0 if named == "mm" else MM_PER_INCH if named else unit
            widths.append(value * scale if value > 0 else math.inf)
    return min(widths)


def _is_other(text: str, match: re.Match[str]) -> bool:
    """Return whether a number is that of something else about the tool: stock that is left, a depth, a step-over."""
    number = 3 if match[3] else 5
    if number == 3 and _BEFORE_OTHER.search(match[0][: match.start(3) - match.start()]):
        return True
    ahead = re.match(rf"(?:[\sa-z-]){{0,60}}?{_TOOL}", text[match.end(number) :], re.IGNORECASE)
    between = _BETWEEN_OTHER.search(ahead[0]) if number == 5 and ahead else None
    return bool(between or _AFTER_OTHER.match(text, match.end()) or _BEFORE_OTHER.search(text[: match.start(number)]))


def misordered(
    features: Features, traces: Traces, visit: Indices, cross: Floats, new_of: Indices, width: float
) -> Iterator[Misordered]:
    """Yield passes that have changed places.

    Parameters
    ----------
    visit
        int64[n], rising: features between which the tool goes nowhere by a rapid have one number.
    cross
        float64[n]: the lowest place of the rapids across to a feature, mm; infinite without any.
    width
        Of the narrowest tool, mm, as `told_width` says it.
    """
    if not len(features):
        return
    visit = np.unique(visit, return_inverse=True)[1].ravel()
    visits = _visits(features, traces, visit, new_of)
    passes = visits.cuts & visits.level & (visits.begins >= 0) & (cross[visits.first] > visits.bottom + _LEVEL)
    passes &= _moved(visits.begins)
    chosen = np.flatnonzero(passes)
    if len(chosen) > 1:
        yield from _near(visits, traces.pick(passes[visit[traces.feature]]), visit, width)
    for one, other in _rows(visits, width):
        if 0 <= visits.begins[other] < visits.begins[one]:
            yield _said(visits, one, other, "{} is a row beside {}, which came after it and is now before")


def _said(visits: _Visits, one: int, other: int, text: str) -> Misordered:
    return Misordered(int(visits.first[one]), int(visits.first[other]), text)


def _moved(begins: Indices) -> Mask:
    """Return which visits have another one before or after them than they had."""
    here = begins >= 0
    most = np.maximum.accumulate(begins) > begins
    least = np.minimum.accumulate(np.where(here, begins, np.iinfo(np.int64).max)[::-1])[::-1] < begins
    return here & (most | least)


def _visits(features: Features, traces: Traces, visit: Indices, new_of: Indices) -> _Visits:
    n = int(visit[-1]) + 1
    kind, z, start = features.kind, features.end[:, 2], features.of("start z")
    bottom = np.full(n, np.inf)
    made = kind != Kind.DWELL
    np.fmin.at(bottom, visit[made], z[made])
    step = np.hypot(*(traces.end - traces.begin).T)
    curved, arcs = traces.arc >= 0, traces.arcs
    turn = np.abs(arcs.sweep) * (arcs.radius + 0.5 * arcs.grows) * np.all(arcs.axes[:, :2] == (0, 1), axis=1)
    step[curved] = np.maximum(step[curved], turn[traces.arc[curved]] * (traces.high - traces.low)[curved])
    of_feature = np.bincount(traces.feature, step, minlength=len(features))
    sideways = made & (kind < FIRST_CYCLE) & (of_feature > _LEVEL)
    length = np.bincount(visit, np.where(sideways, of_feature, 0.0), minlength=n).astype(np.float64)
    lowest = bottom[visit] + _LEVEL
    flat = np.bincount(visit, np.where(sideways & (z <= lowest) & (start <= lowest), of_feature, 0.0), minlength=n)
    ends = np.full((n, 2, 2), np.nan)
    rows = np.flatnonzero(sideways[traces.feature])
    for side, at, order in ((0, traces.begin, rows[::-1]), (1, traces.end, rows)):
        ends[visit[traces.feature[order]], side] = at[order]
    gap = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    first = np.searchsorted(visit, np.arange(n))
    return _Visits(first, new_of[first], bottom, length > 0, flat >= _FLAT_PART * length, gap <= _ROUND, ends, length)


def _near(visits: _Visits, traces: Traces, visit: Indices, width: float) -> Iterator[Misordered]:
    """Yield the passes near each other that have changed places: at two levels, or side by side at one."""
    beside = min(_BESIDE, width)
    owner = visit[traces.feature]
    depths = visits.bottom[np.unique(owner)]
    levels = bool(depths.max() - depths.min() > _LEVEL)
    lines, owner_of = ways_of(traces, owner, _PIECE)
    whole, number = ways_of(traces, owner, len(traces.feature) << _HALVINGS)
    shapely.prepare(whole)
    tree = shapely.STRtree(lines)
    found: dict[tuple[int, int], str] = {}
    for begin in range(0, len(lines), _PIECES):
        some = slice(begin, begin + _PIECES)
        reach = max(beside, min(_REACH, width)) if levels else beside
        one, other = tree.query(lines[some], predicate="dwithin", distance=reach)
        pairs = np.unique(np.stack([owner_of[some][one], owner_of[other]], axis=1), axis=0)
        pairs = pairs[(pairs[:, 0] < pairs[:, 1]) & (visits.begins[pairs[:, 0]] > visits.begins[pairs[:, 1]])]
        a, b = pairs.T
        apart = np.abs(visits.bottom[a] - visits.bottom[b]) > _LEVEL
        for pair in pairs[apart][:MOST_LISTED].tolist():
            found[pair[0], pair[1]] = "{} is at another level beside {}, which came after it and is now before"
        alike = pairs[~apart & ~(visits.round[a] & visits.round[b])]
        for k in range(0, len(alike), _PAIRS):
            part = alike[k : k + _PAIRS]
            sure = _side_by_side(whole[np.searchsorted(number, part)], visits.length[part], beside)
            for pair in part[sure].tolist():
                found[pair[0], pair[1]] = "{} runs side by side with {}, which came after it and is now before"
        if len(found) > MOST_LISTED:
            break
    for (one_, other_), text in sorted(found.items())[:MOST_LISTED]:
        yield _said(visits, one_, other_, text)


def ways_of(traces: Traces, owner: Indices, most: int) -> tuple[NDArray[np.object_], Indices]:
    """Return the ways of visits as lines of at most so many parts, and the visit that each is of."""
    begins = np.flatnonzero(np.diff(owner, prepend=-1))
    at = begins[
        np.unique(np.searchsorted(begins, np.arange(0, len(owner), _AT_ONCE)).clip(max=max(len(begins) - 1, 0)))
    ]
    if len(at) <= 1:
        return _ways_of(traces, owner, most)
    # A part after the other, as every halving doubles what it needs of memory.
    parts = [
        _ways_of(traces.pick(np.arange(begin, end)), owner[begin:end], most)
        for begin, end in pairwise([*at.tolist(), len(owner)])
    ]
    return np.concatenate([lines for lines, _ in parts]), np.concatenate([of for _, of in parts])


def _ways_of(traces: Traces, owner: Indices, most: int) -> tuple[NDArray[np.object_], Indices]:
    for _ in range(_HALVINGS if (traces.arc >= 0).any() else 0):
        twice = np.repeat(traces.arc >= 0, 2)
        keep = np.flatnonzero(twice | (np.arange(len(twice)) % 2 == 0))
        traces, owner = traces.halved().pick(keep), np.repeat(owner, 2)[keep]
    begins = np.flatnonzero(np.diff(owner, prepend=-1))
    nth = np.arange(len(owner)) - np.repeat(begins, np.diff(np.append(begins, len(owner))))
    heads = np.flatnonzero(nth % most == 0)
    line = np.cumsum(nth % most == 0) - 1
    points = np.concatenate([traces.begin[heads], traces.end])
    of = np.concatenate([np.arange(len(heads)), line])
    order = np.argsort(of, kind="stable")
    lines: Any = shapely.linestrings(points[order], indices=of[order])
    return lines, owner[heads]


def _side_by_side(lines: NDArray[np.object_], length: Floats, reach: float) -> Mask:
    """Return bool[k]: of lines[k, 2], whether most of the shorter one is within reach of the longer."""
    rows = np.arange(len(lines))
    short = np.argmin(length, axis=1)
    where = (np.arange(_PLACES) + 0.5) / _PLACES
    places = shapely.line_interpolate_point(lines[rows, short][:, None], where, normalized=True)
    near = shapely.dwithin(lines[rows, 1 - short][:, None], places, reach)
    side: Mask = near.mean(axis=1) >= _BESIDE_PART
    return side


def _rows(visits: _Visits, width: float) -> Iterator[tuple[int, int]]:
    """Yield visits that follow each other as straight rows at one depth, each evenly farther to one side."""
    run: list[tuple[int, int]] = []
    last = 0.0
    for number in range(1, len(visits.first)):
        step = _step(visits, number - 1, number, min(_ROW, width))
        if not run or math.isnan(step) or step * last < 0 or abs(step) > 1.01 * abs(last):
            yield from run if len(run) + 1 >= _LEAST_ROWS else ()
            run = []
        if not math.isnan(step):
            run.append((number - 1, number))
            last = step
    yield from run if len(run) + 1 >= _LEAST_ROWS else ()


def _step(visits: _Visits, one: int, other: int, widest: float) -> float:
    """Return how far a row lies to the left of the one before it, mm; NaN where they are no rows."""
    both = [one, other]
    if not (visits.cuts[both] & visits.level[both]).all() or abs(visits.bottom[one] - visits.bottom[other]) > _LEVEL:
        return math.nan
    a, b = visits.ends[one], visits.ends[other]
    sizes = [math.hypot(*(e[1] - e[0])) for e in (a, b)]
    if any(way > 1.01 * size for way, size in zip(visits.length[both].tolist(), sizes, strict=True)):
        return math.nan
    along = (a[1] - a[0]) / sizes[0]
    if along[0] < -1e-9 or (along[0] < 1e-9 and along[1] < 0):
        along = -along
    across = np.array([-along[1], along[0]])
    step = float((b.mean(axis=0) - a.mean(axis=0)) @ across)
    common = min((a @ along).max(), (b @ along).max()) - max((a @ along).min(), (b @ along).min())
    lean, shorter = abs(float((b[1] - b[0]) @ across)), min(sizes)
    rows = lean <= _LEAN * sizes[1] and _LEVEL < abs(step) <= min(widest, shorter) and common >= 0.5 * shorter
    return step if rows else math.nan
