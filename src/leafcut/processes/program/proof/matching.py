"""Which feature of one program is which of another: each once, and what became of those that have no equal."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices
from leafcut.model.difference import Difference
from leafcut.processes.program.proof.features import AMOUNT, EXACT, FIRST_CYCLE, HEIGHT, PLACE, TAKEN, Features, name_of
from leafcut.proof.difference import place
from leafcut.proof.read_back import DWELL_ROUNDING, FEED_PART, FEED_ROUNDING, SPEED_ROUNDING
from leafcut.units import SECONDS_PER_MINUTE

#: Features that agree to this, in mm, mm/s, rpm and s, are paired all at once; the others one by one.
_QUANTUM = 1e-6
#: Pairs looked at one by one before the rest counts as different: only programs that have little in common need more.
_MOST_LOOKS = 3_000_000
#: No more features than this are looked through for one that has moved.
_MOST_MOVED = 200


class Room(NamedTuple):
    """By how much two features may differ: mm, part of the feed, mm/s, s, rpm, part of the speed, mm.

    The last is how much higher the R plane of a cycle may be; a retract may be higher by any height.
    """

    place: float
    feed_part: float = FEED_PART
    feed: float = FEED_ROUNDING
    dwell: float = DWELL_ROUNDING
    speed: float = SPEED_ROUNDING
    speed_part: float = 0.001
    rise: float = math.inf


class Feature(NamedTuple):
    """One row of `Features`, for messages and for loops that need not be fast."""

    number: int
    line: int
    group: int
    exact: tuple[int, ...]
    place: tuple[float, ...]
    amount: tuple[float, ...]
    height: tuple[float, ...]


class Pairing(NamedTuple):
    """Which feature is which.

    Attributes
    ----------
    new_of
        int64[n]: the new feature of every original one, -1 where there is none.
    missing, extra
        The features of either side that have no equal on the other.
    """

    new_of: Indices
    missing: list[Feature]
    extra: list[Feature]


def pair(before: Features, after: Features, room: Room) -> Pairing:
    """Return which feature is which, within `room`; of those that are alike, the first is paired with the first."""
    new_of = np.full(len(before), -1, dtype=np.int64)
    old, new = _paired_at_once(before, after, room.place)
    new_of[old] = new
    free = np.ones(len(after), dtype=bool)
    free[new] = False
    left, right = _listed(before, np.flatnonzero(new_of < 0)), _listed(after, np.flatnonzero(free))
    pairs, missing, extra = _paired_one_by_one(left, right, room)
    for one, other in pairs:
        new_of[one.number] = other.number
    return Pairing(new_of, missing, extra)


def _paired_at_once(before: Features, after: Features, tolerance: float) -> tuple[Indices, Indices]:
    """Return rows of either side that agree in everything, but for noise far below what can be written."""
    hashed = np.concatenate([_hashed(side) for side in (before, after)])
    _, number = np.unique(hashed, return_inverse=True)
    keys = [_counted(part) for part in (number[: len(before)], number[len(before) :])]
    del hashed, number
    _, old, new = np.intersect1d(keys[0], keys[1], assume_unique=True, return_indices=True)
    same = np.ones(len(old), dtype=bool)
    for one, other in zip(_rounded(before), _rounded(after), strict=True):
        same &= one[old] == other[new]
    for name in PLACE:
        here, there = before.of(name, old), after.of(name, new)
        same &= (np.abs(here - there) <= tolerance + 1e-9) | (np.isnan(here) & np.isnan(there))
    return old[same], new[same]


def _rounded(features: Features) -> Iterator[Indices]:
    """Yield all that a feature is as whole numbers, a column at a time: of a million, all at once fill the memory."""
    yield features.group
    yield from (features.of(name) for name in EXACT)
    for name in (*PLACE, *AMOUNT, *HEIGHT):
        values = features.of(name) / _QUANTUM
        known = np.isfinite(values) & (np.abs(values) < _FAR)
        yield np.where(known, np.rint(np.where(known, values, 0.0)), -float(_FAR)).astype(np.int64)


def _hashed(features: Features) -> NDArray[np.uint64]:
    """Return one number for every feature; what it says is checked afterwards."""
    mixed = np.zeros(len(features), dtype=np.uint64)
    for column in _rounded(features):
        mixed = (mixed ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def _counted(number: Indices) -> Indices:
    """Return a key for every row: its number, and how many with this number came before it."""
    order = np.argsort(number, kind="stable")
    ordered = number[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=-1))
    nth = np.arange(len(number)) - np.repeat(begins, np.diff(np.append(begins, len(number))))
    key = np.empty(len(number), dtype=np.int64)
    key[order] = ordered * (1 << 31) + nth
    return key


def _listed(features: Features, which: Indices) -> list[Feature]:
    parts: list[list[Any]] = [features.line[which].tolist(), features.group[which].tolist()]
    parts += [features.several(names, which).tolist() for names in (EXACT, PLACE, AMOUNT, HEIGHT)]
    return [
        Feature(index, line, group, tuple(e), tuple(p), tuple(a), tuple(h))
        for index, line, group, e, p, a, h in zip(which.tolist(), *parts, strict=True)
    ]


CellKey = tuple[int, ...]
Pairs = list[tuple[Feature, Feature]]


def _paired_one_by_one(
    before: list[Feature], after: list[Feature], room: Room
) -> tuple[Pairs, list[Feature], list[Feature]]:
    # Backwards, so that the first is at the end of its cell, where taking it away is cheap however many lie there.
    cells = _sorted_into_cells(after[::-1], room.place, 3)
    pairs, missing, looks = [], [], 0
    for feature in before:
        for key in _cells_around(feature, room.place, 3):
            cell = cells.get(key, [])
            if looks > _MOST_LOOKS:
                cell = []
            looks += len(cell)
            equal = next((i for i in reversed(range(len(cell))) if _equal(feature, cell[i], room)), None)
            if equal is not None:
                pairs.append((feature, cell.pop(equal)))
                looks -= equal
                break
        else:
            missing.append(feature)
    return pairs, missing, sorted(feature for cell in cells.values() for feature in cell)


def _equal(a: Feature, b: Feature, room: Room) -> bool:
    return a.group == b.group and a.exact == b.exact and not changes(a, b, room)


def _sorted_into_cells(features: list[Feature], tolerance: float, axes: int) -> dict[CellKey, list[Feature]]:
    cells: dict[CellKey, list[Feature]] = defaultdict(list)
    for feature in features:
        cells[next(_cells_around(feature, tolerance, axes))].append(feature)
    return cells


def _cells_around(feature: Feature, tolerance: float, axes: int) -> Iterator[CellKey]:
    """Yield the cells of a grid over x, y (and depth) within `tolerance` of a feature, the one that it lies in first.

    What is not known lies in a row of cells far away.
    """
    size, room = 4.0 * max(tolerance, 1e-6), tolerance + 1e-9
    at = feature.place[:axes]
    own = tuple(math.floor(v / size) if math.isfinite(v) else _FAR for v in at)
    yield own
    reach = [{math.floor((v + d) / size) for d in (-room, room)} if math.isfinite(v) else {_FAR} for v in at]
    if any(len(cells) > 1 for cells in reach):
        yield from (cell for cell in product(*map(sorted, reach)) if cell != own)


_FAR = 1 << 62


def _shown_work_offset(tenths: int) -> str:
    return f"G{tenths / 10:g}"


def _shown_stated(value: int) -> str:
    said = [text for bit, text in ((1, "units"), (2, "spindle since the tool change")) if value & bit]
    return " and ".join(said) or "nothing"


#: The words for what must be equal, and how its numbers are shown. The kind and arcs have texts of their own.
_EXACT_WORDS: dict[str, tuple[str, Callable[[int], object]]] = {
    "plane": ("plane", lambda v: f"G{v}"),
    "tool": ("tool", str),
    "coolant": ("coolant", str),
    "length": ("length offset", lambda v: v % TAKEN),
    "frame": ("work offset", _shown_work_offset),
    "radius": ("radius compensation", lambda v: f"G{v}"),
    "blending": ("blending", _shown_work_offset),
    "feed_mode": ("feed mode", lambda v: f"G{v}"),
    "direction": ("direction of the spindle", {1: "M3", -1: "M4", 0: "M5"}.get),
    "stated": ("stated", _shown_stated),
    "obeyed": ("number of the controller's settings before it, (o=…) or #<…>,", str),
}


def changes(a: Feature, b: Feature, room: Room) -> list[str]:
    """Return in what `b` is not the work of `a`, in words; an empty list when it is."""
    near = room.place + 1e-9
    found = []
    if a.exact[0] != b.exact[0]:
        found.append(f"{name_of(a.exact[0])} became {name_of(b.exact[0])}")
    if a.exact != b.exact:
        for name, (what, shown) in _EXACT_WORDS.items():
            was, now = a.exact[EXACT.index(name)], b.exact[EXACT.index(name)]
            if was != now:
                found.append(f"{what} {shown(was)} became {shown(now)}")
    amounts_a, amounts_b = dict(zip(AMOUNT, a.amount, strict=True)), dict(zip(AMOUNT, b.amount, strict=True))
    feed, speed = amounts_a["feed"], amounts_a["speed"]
    for word, one, other, allowed, factor in (
        *((word, a.place[i], b.place[i], near, 1.0) for i, word in enumerate(PLACE[:3])),
        ("peck", amounts_a["peck"], amounts_b["peck"], near, 1.0),
        ("dwell", amounts_a["dwell"], amounts_b["dwell"], room.dwell + 1e-9, 1.0),
        ("feed in mm/min", feed, amounts_b["feed"], max(room.feed_part * abs(feed), room.feed), SECONDS_PER_MINUTE),
        ("speed", speed, amounts_b["speed"], max(room.speed_part * abs(speed), room.speed), 1.0),
        ("D", amounts_a["register"], amounts_b["register"], 1e-9, 1.0),
        ("blending tolerance", amounts_a["corner"], amounts_b["corner"], near, 1.0),
        ("tolerance of short moves", amounts_a["joining"], amounts_b["joining"], near, 1.0),
    ):
        if abs(one - other) > allowed or math.isnan(one) != math.isnan(other):
            found.append(f"{word} {_figure(one * factor)} became {_figure(other * factor)}")
    if a.exact[2] != b.exact[2] or not _near(a.place[3:], b.place[3:], near):
        found.append(f"start {place(*a.place[3:6])} became {place(*b.place[3:6])}, or the arc is another")
    for word, one, other in zip(("R plane", "retract"), a.height, b.height, strict=True):
        if not other >= one - near and not (math.isnan(one) and math.isnan(other)):
            found.append(f"{word} {_figure(one)} sank to {_figure(other)}")
    if b.height[0] > a.height[0] + room.rise + near:
        found.append(f"R plane {_figure(a.height[0])} rose to {_figure(b.height[0])}")
    return found


def _figure(value: float) -> str:
    return "unknown" if math.isnan(value) else f"{value:.6g}"


def _near(a: tuple[float, ...], b: tuple[float, ...], room: float) -> bool:
    return all(abs(p - q) <= room or (math.isnan(p) and math.isnan(q)) for p, q in zip(a, b, strict=True))


def explain(pairing: Pairing, room: Room) -> Iterator[Difference]:
    """Yield what became of every feature without an equal: done elsewhere, changed, moved, gone or new."""
    missing, extra = pairing.missing, pairing.extra
    if any(f.group for f in (*missing, *extra)):
        nowhere = [[f._replace(group=0) for f in side] for side in (missing, extra)]
        pairs, missing, extra = _paired_one_by_one(nowhere[0], nowhere[1], room)
        for one, other in pairs:
            text = f"{_said(one)} is done before or after another barrier (pause, tool change, work offset …)"
            yield Difference(f"moved {_noun(one)}", one.line, other.line, text)
    rest = []
    cells = _sorted_into_cells(extra, room.place, 2)
    for feature in missing:
        there = [(f, key) for key in _cells_around(feature, room.place, 2) for f in cells.get(key, ())]
        if not there:
            rest.append(feature)
            continue
        found, key = min(there, key=lambda pair: len(changes(feature, pair[0], room)))
        cells[key].remove(found)
        text = f"at {place(*feature.place[:2])}: {'; '.join(changes(feature, found, room))}"
        yield Difference(f"changed {_noun(feature)}", feature.line, found.line, text)
    yield from _moved(rest, sorted(feature for cell in cells.values() for feature in cell), room)


def _moved(missing: list[Feature], extra: list[Feature], room: Room) -> Iterator[Difference]:
    """Yield what is gone and new, and both as one where only the place or the end is another."""
    for feature in missing:
        near = [f for f in extra if _only_moved(feature, f, room)] if len(extra) <= _MOST_MOVED else []
        said = f"{_said(feature)} is gone"
        if near:
            found = min(near, key=lambda f: math.dist(f.place[:3], feature.place[:3]))
            extra.remove(found)
            text = f"{said}, {_said(found)} is new"
            yield Difference(f"moved {_noun(feature)}", feature.line, found.line, text)
        else:
            yield Difference(f"missing {_noun(feature)}", feature.line, 0, said)
    for feature in extra:
        yield Difference(f"extra {_noun(feature)}", 0, feature.line, f"{_said(feature)} is new")


def _only_moved(a: Feature, b: Feature, room: Room) -> bool:
    """Return whether two holes or dwells differ in their place only, or two cuts in their end only."""
    if a.exact != b.exact or not all(map(math.isfinite, (*a.place[:3], *b.place[:3]))):
        return False
    moved = b._replace(place=a.place if _noun(a) != "cut" else (*a.place[:3], *b.place[3:]))
    return not changes(a, moved, room)


def _said(feature: Feature) -> str:
    name = name_of(feature.exact[0])
    return f"{name} at {place(*feature.place[:3])} with tool {feature.exact[EXACT.index('tool')]}"


def _noun(feature: Feature) -> str:
    kind = feature.exact[0]
    return "hole" if kind >= FIRST_CYCLE else "dwell" if name_of(kind) == "dwell" else "cut"
