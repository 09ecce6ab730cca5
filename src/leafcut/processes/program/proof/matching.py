"""Match the features of two programs one to one, and describe how unmatched features have changed."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices, occurrence_keys
from leafcut.message import Message
from leafcut.model.toolpath import g_word
from leafcut.processes.program.proof.features import AMOUNT, EXACT, HEIGHT, PLACE, Features, feature_kind_name
from leafcut.proof.difference import position_text
from leafcut.units import SECONDS_PER_MINUTE

#: Features that agree within this difference (mm, mm/s, rpm, s) are matched in bulk. All others are matched one by one.
_QUANTUM = 1e-6
#: Tolerances of feeds (relative, and mm/s), dwells (s) and speeds (relative, and rpm). A rewritten program keeps the
#: words of the original, so its numbers differ only by rounding and by a change of units.
_FEED_PART, _FEED, _DWELL, _SPEED_PART, _SPEED = 5e-5, 1e-4, 1e-4, 1e-6, 1e-3
#: Maximum number of single comparisons. Only very different programs need more; their remaining features count as
#: different.
_MOST_LOOKS = 3_000_000


class MatchTolerance(NamedTuple):
    """Tolerance for positions, mm. If `beam` is set, the S word is the power of a beam."""

    place: float
    beam: bool = False


class Feature(NamedTuple):
    """A row of `Features`, used for messages and for single comparisons."""

    number: int
    line: int
    group: int
    exact: tuple[int, ...]
    place: tuple[float, ...]
    amount: tuple[float, ...]
    height: tuple[float, ...]


class Pairing(NamedTuple):
    """Matched features of two programs.

    Attributes
    ----------
    new_of
        The new feature that matches each original feature, int64[n], or -1.
    missing
        Features of the original program without a match.
    extra
        Features of the new program without a match.
    """

    new_of: Indices
    missing: list[Feature]
    extra: list[Feature]
    before: Features
    after: Features


def match_features(before: Features, after: Features, room: MatchTolerance) -> Pairing:
    """Match the features of two programs within the tolerances `room`. Equal features are matched in order."""
    new_of = np.full(len(before), -1, dtype=np.int64)
    old, new = _match_by_hash(before, after, room.place)
    new_of[old] = new
    free = np.ones(len(after), dtype=bool)
    free[new] = False
    left, right = _to_feature_list(before, np.flatnonzero(new_of < 0)), _to_feature_list(after, np.flatnonzero(free))
    pairs, missing, extra = match_one_by_one(left, right, room)
    for one, other in pairs:
        new_of[one.number] = other.number
    return Pairing(new_of, missing, extra, before, after)


def _match_by_hash(before: Features, after: Features, tolerance: float) -> tuple[Indices, Indices]:
    """Return the rows of both programs that match: their values agree except for rounding errors."""
    hashed = np.concatenate([_feature_hashes(side) for side in (before, after)])
    _, number = np.unique(hashed, return_inverse=True)
    old, new = _match_equal_numbers(number[: len(before)], number[len(before) :])
    del hashed, number
    same = np.ones(len(old), dtype=bool)
    for one, other in zip(_rounded_columns(before), _rounded_columns(after), strict=True):
        same &= one[old] == other[new]
    for name in PLACE:
        here, there = before.of(name, old), after.of(name, new)
        same &= (np.abs(here - there) <= tolerance + 1e-9) | (np.isnan(here) & np.isnan(there))
    return old[same], new[same]


def _match_equal_numbers(one: Indices, other: Indices) -> tuple[Indices, Indices]:
    """Match equal numbers. Start from both ends while the numbers agree, then match the rest in order.

    Matching in order keeps neighbours together.
    """
    n, m = len(one), len(other)
    differs = np.flatnonzero(one[: min(n, m)] != other[: min(n, m)])
    head = int(differs[0]) if len(differs) else min(n, m)
    rest = min(n, m) - head
    differs = np.flatnonzero(one[n - rest :][::-1] != other[m - rest :][::-1])
    tail = int(differs[0]) if len(differs) else rest
    keys = [occurrence_keys(side[head : len(side) - tail]) for side in (one, other)]
    _, old, new = np.intersect1d(keys[0], keys[1], assume_unique=True, return_indices=True)
    ends = np.arange(head), np.arange(tail)
    return (
        np.concatenate([ends[0], old + head, n - tail + ends[1]]),
        np.concatenate([ends[0], new + head, m - tail + ends[1]]),
    )


def _rounded_columns(features: Features) -> Iterator[Indices]:
    """Yield the values of all features as integers. To save memory, each step yields a single column."""
    yield features.group
    yield from (features.of(name) for name in EXACT)
    for name in (*PLACE, *AMOUNT, *HEIGHT):
        values = features.of(name) / _QUANTUM
        known = np.isfinite(values) & (np.abs(values) < _FAR)
        yield np.where(known, np.rint(np.where(known, values, 0.0)), -float(_FAR)).astype(np.int64)


def _feature_hashes(features: Features) -> NDArray[np.uint64]:
    """Return a hash for each feature. Callers must check whether features with the same hash are really equal."""
    mixed = np.zeros(len(features), dtype=np.uint64)
    for column in _rounded_columns(features):
        mixed = (mixed ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def _to_feature_list(features: Features, which: Indices) -> list[Feature]:
    parts: list[list[Any]] = [features.line[which].tolist(), features.group[which].tolist()]
    parts += [features.several(names, which).tolist() for names in (EXACT, PLACE, AMOUNT, HEIGHT)]
    return [
        Feature(index, line, group, tuple(e), tuple(p), tuple(a), tuple(h))
        for index, line, group, e, p, a, h in zip(which.tolist(), *parts, strict=True)
    ]


CellKey = tuple[int, ...]
Pairs = list[tuple[Feature, Feature]]


def match_one_by_one(
    before: list[Feature], after: list[Feature], room: MatchTolerance
) -> tuple[Pairs, list[Feature], list[Feature]]:
    """Return the pairs of features that agree within `room`, and the unmatched features of both programs."""
    # The first feature is at the end of its cell, where its removal is cheap.
    cells = sorted_into_cells(after[::-1], room.place, 3)
    pairs, missing, looks = [], [], 0
    for feature in before:
        for key in cells_around(feature, room.place, 3):
            cell = cells.get(key, [])
            if looks > _MOST_LOOKS:
                cell = []
            looks += len(cell)
            equal = next((i for i in reversed(range(len(cell))) if _are_equal(feature, cell[i], room)), None)
            if equal is not None:
                pairs.append((feature, cell.pop(equal)))
                looks -= equal
                break
        else:
            missing.append(feature)
    return pairs, missing, sorted(feature for cell in cells.values() for feature in cell)


def _are_equal(a: Feature, b: Feature, room: MatchTolerance) -> bool:
    return a.group == b.group and a.exact == b.exact and not feature_changes(a, b, room)


def sorted_into_cells(features: list[Feature], tolerance: float, axes: int) -> dict[CellKey, list[Feature]]:
    """Group features by grid cell (`cells_around`) without changing their order."""
    cells: dict[CellKey, list[Feature]] = defaultdict(list)
    for feature in features:
        cells[next(cells_around(feature, tolerance, axes))].append(feature)
    return cells


def cells_around(feature: Feature, tolerance: float, axes: int) -> Iterator[CellKey]:
    """Yield the grid cells around a feature in x, y (and z), starting with the cell that contains the feature.

    An unknown coordinate is assigned to a separate cell far away.
    """
    size, room = 4.0 * max(tolerance, 1e-6), tolerance + 1e-9
    at = feature.place[:axes]
    own = tuple(math.floor(v / size) if math.isfinite(v) else _FAR for v in at)
    yield own
    reach = [{math.floor((v + d) / size) for d in (-room, room)} if math.isfinite(v) else {_FAR} for v in at]
    if any(len(cells) > 1 for cells in reach):
        yield from (cell for cell in product(*map(sorted, reach)) if cell != own)


_FAR = 1 << 62


class FeatureChange(NamedTuple):
    """A difference between two features.

    `name` is either a value in `EXACT` or a group of other values. For a value in `EXACT`, the values before and after
    the change are stored.
    """

    name: str
    message: Message
    was: int | None = None
    now: int | None = None

    def matches(self, change: StateChange) -> bool:
        """Return whether this change equals `change`. In `change`, None matches any value."""
        name, was, now = change
        return self.name == name and was in (None, self.was) and now in (None, self.now)


#: Name of a modal value, and its values before and after the change. None matches any value.
StateChange = tuple[str, int | None, int | None]


def _stated_changes(was: int, now: int) -> Iterator[Message]:
    for bit, gone, new in (
        (1, Message("the units (G20, G21) are no longer stated"), Message("the units (G20, G21) are now stated")),
        (
            2,
            Message("the spindle is no longer started after the tool change"),
            Message("the spindle is now started after the tool change"),
        ),
        (
            4,
            Message("the length offset is no longer applied after the tool change or the machine move"),
            Message("the length offset is now applied after the tool change or the machine move"),
        ),
    ):
        if (was ^ now) & bit:
            yield gone if was & bit else new


#: Name and number format of the values that must be equal. Kinds and arcs have their own messages.
_EXACT_WORDS: dict[str, tuple[Message, Callable[[int], object]]] = {
    "plane": (Message("plane"), lambda v: f"G{v}"),
    "tool": (Message("tool"), str),
    "coolant": (Message("coolant"), {0: "M9", 1: "M7", 2: "M8", 3: "M7 M8"}.get),
    "length": (Message("length offset"), lambda v: v if v >= 0 else Message("unknown")),
    "frame": (Message("work offset"), g_word),
    "radius": (Message("radius compensation"), lambda v: f"G{v}" if v > 0 else Message("unknown")),
    "blending": (Message("blending"), lambda v: g_word(v) if v else Message("not stated")),
    "feed_mode": (Message("feed mode"), lambda v: f"G{v}"),
    "spindle": (Message("direction of the spindle"), {1: "M3", -1: "M4", 0: "M5"}.get),
    "obeyed": (Message("number of the preceding controller settings, (o=…) or #<…>,"), str),
    "table": (Message("number of blocks before the length offset that may change the tool table"), str),
}


def state_change_text(name: str, was: int, now: int) -> FeatureChange:
    """Describe the change of a value in `EXACT`."""
    what, shown = _EXACT_WORDS[name]
    return FeatureChange(name, Message("{} {} became {}", what, shown(was), shown(now)), was, now)


def feature_changes(a: Feature, b: Feature, room: MatchTolerance) -> list[FeatureChange]:
    """Return the values of feature `b` that differ from feature `a` by more than the tolerances, or an empty list."""
    near = room.place + 1e-9
    found: list[FeatureChange] = []
    if a.exact[0] != b.exact[0]:
        found.append(
            FeatureChange("kind", Message("{} became {}", feature_kind_name(a.exact[0]), feature_kind_name(b.exact[0])))
        )
    if a.exact != b.exact:
        for name in _EXACT_WORDS:
            was, now = a.exact[EXACT.index(name)], b.exact[EXACT.index(name)]
            if was != now:
                found.append(state_change_text(name, was, now))
        stated = EXACT.index("stated")
        found += (FeatureChange("stated", message) for message in _stated_changes(a.exact[stated], b.exact[stated]))
    amounts_a, amounts_b = dict(zip(AMOUNT, a.amount, strict=True)), dict(zip(AMOUNT, b.amount, strict=True))
    feed, speed, turns = amounts_a["feed"], amounts_a["speed"], Message("power") if room.beam else Message("speed")
    for word, one, other, allowed, factor in (
        ("x", a.place[0], b.place[0], near, 1.0),
        ("y", a.place[1], b.place[1], near, 1.0),
        (Message("depth"), a.place[2], b.place[2], near, 1.0),
        (Message("peck"), amounts_a["peck"], amounts_b["peck"], near, 1.0),
        (Message("dwell"), amounts_a["dwell"], amounts_b["dwell"], _DWELL + 1e-9, 1.0),
        (Message("feed in mm/min"), feed, amounts_b["feed"], max(_FEED_PART * abs(feed), _FEED), SECONDS_PER_MINUTE),
        (turns, speed, amounts_b["speed"], max(_SPEED_PART * abs(speed), _SPEED), 1.0),
        ("D", amounts_a["register"], amounts_b["register"], 1e-9, 1.0),
        (Message("blending tolerance"), amounts_a["tolerance"], amounts_b["tolerance"], near, 1.0),
        (Message("tolerance of short moves"), amounts_a["joining"], amounts_b["joining"], near, 1.0),
    ):
        if abs(one - other) > allowed or math.isnan(one) != math.isnan(other):
            values = _value_text(one * factor), _value_text(other * factor)
            found.append(FeatureChange("amount", Message("{} {} became {}", word, *values)))
    found += _path_changes(a, b, near)
    for word, one, other in zip((Message("R plane"), Message("retract")), a.height, b.height, strict=True):
        if not other >= one - near and not (math.isnan(one) and math.isnan(other)):
            found.append(
                FeatureChange("height", Message("{} {} was lowered to {}", word, _value_text(one), _value_text(other)))
            )
    if b.height[0] > a.height[0] + near:
        message = Message("R plane {} was raised to {}", _value_text(a.height[0]), _value_text(b.height[0]))
        found.append(FeatureChange("height", message))
    return found


def _path_changes(a: Feature, b: Feature, near: float) -> Iterator[FeatureChange]:
    """Yield the changes of an arc and of a start point.

    If the centre of an arc moves together with its start, only the start is reported.
    """
    if a.exact[2] != b.exact[2]:
        yield FeatureChange("arc", Message("turns of the arc {} became {}", a.exact[2], b.exact[2]))
    begun = not is_near(a.place[3:6], b.place[3:6], near)
    one, other = (tuple(q - p for p, q in zip(f.place[3:6], f.place[6:], strict=True)) for f in (a, b))
    if not is_near(a.place[6:], b.place[6:], near) and not (begun and is_near(one, other, near)):
        places = position_text(*a.place[6:]), position_text(*b.place[6:])
        yield FeatureChange("arc", Message("centre of the arc {} became {}", *places))
    if not is_near(a.place[3:5], b.place[3:5], near):
        places = position_text(*a.place[3:6]), position_text(*b.place[3:6])
        yield FeatureChange("start", Message("start {} became {}", *places))
    elif begun:
        heights = _value_text(a.place[5]), _value_text(b.place[5])
        yield FeatureChange("start", Message("start Z{} became Z{}", *heights))


def _value_text(value: float) -> str:
    return Message("unknown") if math.isnan(value) else f"{value:.6g}"


def is_near(a: tuple[float, ...], b: tuple[float, ...], room: float) -> bool:
    """Return whether all coordinates of two points agree within `room`. Two unknown coordinates count as equal."""
    return all(abs(p - q) <= room or (math.isnan(p) and math.isnan(q)) for p, q in zip(a, b, strict=True))
