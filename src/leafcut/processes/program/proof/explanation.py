"""Explain unmatched features in a machinist's terms: each change once, without its consequences.

A changed feed word is a single difference. A cut that only starts at the changed end of its predecessor is no
difference.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple, TypeVar

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.program.proof.barriers import ImpliedChange
from leafcut.processes.program.proof.features import EXACT, FIRST_CYCLE, Features, name_of
from leafcut.processes.program.proof.matching import (
    CellKey,
    Feature,
    FeatureChange,
    MatchTolerance,
    Pairing,
    cells_around,
    feature_changes,
    match_one_by_one,
    sorted_into_cells,
)
from leafcut.proof.difference import position_text

#: Maximum number of missing features that are explained, and of candidates per grid cell; further features are counted.
_MOST_EXPLAINED, _MOST_TRIED = 20_000, 40
#: Maximum number of stretches in the search for moved features.
_MOST_MOVED = 200
#: Maximum number of holes listed by position.
_MOST_NAMED = 3
#: Tolerance of equal points, mm.
_NEAR = 1e-6

#: Consecutive features without a move between them, or a single hole.
Stretch = list[Feature]
_Item = TypeVar("_Item")


class Explanation(NamedTuple):
    """The explained differences in the order of their lines.

    `found` is the minimum number of differences. `changes` are those of work that is in both programs.
    """

    differences: list[Difference]
    found: int
    changes: set[FeatureChange]


class _ChangedFeature(NamedTuple):
    """A feature, its counterpart in the new program, and their differences: at the start point, and others."""

    one: Feature
    other: Feature
    start: list[FeatureChange]
    rest: list[FeatureChange]


def explain(pairing: Pairing, room: MatchTolerance, implied: Sequence[ImpliedChange] = ()) -> Explanation:
    """Explain each unmatched feature as done elsewhere, changed, moved, missing or new, without `implied` changes."""
    elsewhere, missing, extra = _moved_past_barrier(pairing, room)
    counted = max(len(missing) - _MOST_EXPLAINED, 0)
    pairs, gone, new = _changed_features(missing[:_MOST_EXPLAINED], extra, room, set(implied))
    found = [*elsewhere, *_grouped_changes(pairs, gone, new)]
    sides = pairing.before, pairing.after
    stretches = [list(_stretches(rest)) for rest in (gone, new)]
    if counted:
        # New features may be counterparts of features that were counted but not explained.
        stretches[1] = []
    found += _moved(stretches[0], stretches[1], sides, room)
    for words, verb, rest, side in (
        ("missing", "gone", stretches[0], sides[0]),
        ("extra", "new", stretches[1], sides[1]),
    ):
        found += (_group_difference(words, verb, group, side) for group in _grouped(rest, _adjacent))
    if not found and (missing or extra) and not implied:
        # Without an explanation, the programs still differ.
        one, other = (side[0].line if side else 0 for side in (missing, extra))
        found.append(Difference("not compared", one, other, "too many moves lie at one position"))
    found.sort(key=lambda one: one.original or one.new)
    return Explanation(found, len(found) + counted, {change for one in pairs for change in one.rest})


def _moved_past_barrier(
    pairing: Pairing, room: MatchTolerance
) -> tuple[list[Difference], list[Feature], list[Feature]]:
    """Return the differences for features that are done before or after another barrier, and the remaining features."""
    missing, extra = pairing.missing, pairing.extra
    if not any(f.group for f in (*missing, *extra)):
        return [], missing, extra
    nowhere = [[f._replace(group=0) for f in side] for side in (missing, extra)]
    pairs, missing, extra = match_one_by_one(nowhere[0], nowhere[1], room)
    text = "done before or after another barrier (pause, tool change, work offset …)"
    found = []
    for group in _grouped(pairs, lambda p, q: (q[0].number, q[1].number) == (p[0].number + 1, p[1].number + 1)):
        ones = [one for one, _ in group]
        said = _feature_text(ones[0]) if len(ones) == 1 else f"{_count_text(ones)}, the first {_feature_text(ones[0])},"
        found.append(_difference("moved", group, f"{said} {_verb_of(ones)} {text}"))
    return found, missing, extra


def _grouped(items: Iterable[_Item], goes_on: Callable[[_Item, _Item], bool]) -> Iterator[list[_Item]]:
    """Yield groups of consecutive items; `goes_on` decides whether an item joins the group of its predecessor."""
    group: list[_Item] = []
    for item in items:
        if group and not goes_on(group[-1], item):
            yield group
            group = []
        group.append(item)
    if group:
        yield group


def _changed_features(
    missing: list[Feature], extra: list[Feature], room: MatchTolerance, implied: set[ImpliedChange]
) -> tuple[list[_ChangedFeature], list[Feature], list[Feature]]:
    """Return the features that changed in place, the missing features and the new features."""
    cells = sorted_into_cells(extra, room.place, 2)
    pairs, gone = [], []
    for feature in missing:
        there: list[tuple[Feature, CellKey]] = []
        for key in cells_around(feature, room.place, 2):
            there += ((f, key) for f in cells.get(key, ())[:_MOST_TRIED])
        if not there:
            gone.append(feature)
            continue
        (other, key), found = min(
            ((one, feature_changes(feature, one[0], room)) for one in there), key=lambda one: len(one[1])
        )
        cells[key].remove(other)
        own = [
            change
            for change in found
            if implied.isdisjoint([(change.name, "was", change.was), (change.name, "now", change.now)])
        ]
        start, rest = ([c for c in own if (c.name == "start") == first] for first in (True, False))
        pairs.append(_ChangedFeature(feature, other, start, rest))
    return pairs, gone, sorted(feature for cell in cells.values() for feature in cell)


def _grouped_changes(pairs: list[_ChangedFeature], gone: list[Feature], new: list[Feature]) -> Iterator[Difference]:
    """Yield the changes; equal changes form one difference, and consequences of other changes are left out."""
    differing = [pair for pair in pairs if pair.rest]
    ends = [
        {f.number: f.place[:3] for f in side}
        for side in ([*gone, *(pair.one for pair in differing)], [*new, *(pair.other for pair in differing)])
    ]
    groups: dict[tuple[str, ...], list[_ChangedFeature]] = defaultdict(list)
    begun: list[_ChangedFeature] = []
    for pair in pairs:
        follows = any(
            _same_point(end.get(f.number - 1), f.place[3:6])
            for end, f in zip(ends, (pair.one, pair.other), strict=True)
        )
        start = [] if follows else pair.start
        if start and not pair.rest:
            begun.append(pair)
        elif pair.rest or start:
            groups[*(change.text for change in (*pair.rest, *start)),].append(pair)
    for run in _grouped(begun, lambda p, q: q.one.number == p.one.number + 1):
        numbers = [pair.other.number for pair in run]
        ordered = sorted(numbers)
        if numbers != ordered and ordered[-1] - ordered[0] == len(run) - 1:
            ones = [pair.one for pair in run]
            text = f"{_count_text(ones)}, the first to {position_text(*ones[0].place[:3])}, come in another order"
            others = sorted((pair.other for pair in run), key=lambda f: f.number)
            yield _difference("reordered", [*zip(ones, others, strict=True)], text)
        else:
            for pair in run:
                groups[tuple(change.text for change in pair.start)].append(pair)
    for texts, group in groups.items():
        ones = [pair.one for pair in group]
        where = Message("at {}", position_text(*ones[0].place[:2]))
        said = where if len(ones) == 1 else f"{_count_text(ones)}, the first {where}"
        yield _difference("changed", [(p.one, p.other) for p in group], f"{said}: {'; '.join(texts)}")


def _stretches(features: list[Feature]) -> Iterator[Stretch]:
    return _grouped(sorted(features, key=lambda f: f.number), _is_continued_by)


def _is_continued_by(one: Feature, other: Feature) -> bool:
    if other.number != one.number + 1 or _is_cycle(one) or _is_cycle(other) or _tool_of(one) != _tool_of(other):
        return False
    # A hole pecked by single moves counts as one hole, despite the retracts.
    pecked = _is_upright(one) and _is_upright(other) and _same_point(one.place[:2], other.place[:2])
    return pecked or _same_point(one.place[:3], other.place[3:6])


def _is_upright(feature: Feature) -> bool:
    return _same_point(feature.place[:2], feature.place[3:5])


def _adjacent(one: Stretch, other: Stretch) -> bool:
    return other[0].number == one[-1].number + 1 and _tool_of(other[0]) == _tool_of(one[0])


def _group_difference(words: str, verb: str, group: list[Stretch], side: Features) -> Difference:
    """Return the difference for adjacent stretches that are all missing or all new."""
    features = [feature for stretch in group for feature in stretch]
    holes = [_hole(stretch, side) for stretch in group]
    text = (
        f"{_group_text(group, holes)} {'is' if len(group) == 1 and (holes[0] or len(features) == 1) else 'are'} {verb}"
    )
    noun = "hole" if all(holes) else _noun_of(features)
    lines = [(f.line, 0) if words == "missing" else (0, f.line) for f in features]
    return Difference(f"{words} {noun}", *lines[0], text, _further_lines(lines))


def _group_text(group: list[Stretch], holes: list[str]) -> str:
    tool = f"with tool {_tool_of(group[0][0])}"
    if len(group) == 1:
        return f"{_stretch_text(group[0], holes[0])} {tool}"
    if not all(holes):
        features = [feature for stretch in group for feature in stretch]
        return f"{_count_text(features)}, the first at {position_text(*features[0].place[:3])}, {tool}"
    if len(group) <= _MOST_NAMED:
        places = [hole.partition(" at ")[2] for hole in holes]
        return f"{len(group)} holes at {', '.join(places[:-1])} and {places[-1]} {tool}"
    return f"{len(group)} holes, the first {holes[0]}, {tool}"


def _stretch_text(stretch: Stretch, hole: str) -> str:
    first, last = stretch[0], stretch[-1]
    if hole and not _is_cycle(first) and len(stretch) > 1:
        return f"{hole}, of {_count_text(stretch)},"
    if len(stretch) == 1:
        return f"{name_of(first.exact[0])} at {position_text(*first.place[:3])}"
    return f"{_count_text(stretch)} from {position_text(*first.place[3:6])} to {position_text(*last.place[:3])}"


def _hole(stretch: Stretch, side: Features) -> str:
    """Describe a hole: a cycle, or vertical cuts without adjoining cuts; "" for other work."""
    first, last = stretch[0], stretch[-1]
    if _is_cycle(first):
        return f"{name_of(first.exact[0])} at {position_text(*first.place[:3])}"
    bottom = min(f.place[2] for f in stretch)
    if not all(map(_is_upright, stretch)) or not bottom < first.place[5]:
        return ""
    n, before, after = len(side), first.number - 1, last.number + 1
    if before >= 0 and side.kind[before] < FIRST_CYCLE and _same_point(tuple(side.end[before]), first.place[3:6]):
        return ""
    if after < n and side.kind[after] < FIRST_CYCLE and _same_point(tuple(side.start[after]), last.place[:3]):
        return ""
    return Message("hole at {}", position_text(first.place[0], first.place[1], bottom))


def _moved(
    gone: list[Stretch], new: list[Stretch], sides: tuple[Features, Features], room: MatchTolerance
) -> Iterator[Difference]:
    """Yield the features that only moved, and remove them from both lists."""
    if len(new) > _MOST_MOVED or len(gone) > _MOST_MOVED:
        return
    groups: dict[tuple[float, ...], list[tuple[Stretch, Stretch]]] = defaultdict(list)
    for stretch in gone.copy():
        near = [other for other in new if _differs_only_in_position(stretch, other, room)]
        if near:
            found = min(near, key=lambda other: math.dist(other[0].place[:2], stretch[0].place[:2]))
            gone.remove(stretch)
            new.remove(found)
            ends = zip(stretch[-1].place[:2], found[-1].place[:2], strict=True)
            groups[tuple(round(b - a, 3) + 0.0 for a, b in ends)].append((stretch, found))
    for shift, group in groups.items():
        one, other = group[0]
        holes = [_hole(s, side) for s, side in zip((one, other), sides, strict=True)]
        before, after = (hole or _stretch_text(s, "") for s, hole in zip((one, other), holes, strict=True))
        tool = f"with tool {_tool_of(one[0])}"
        if len(group) == 1:
            _, word, where = after.partition(" from " if " from " in after else " at ")
            text = f"{before} {tool} {'is' if holes[0] else _verb_of(one)} now{word}{where}"
        else:
            features = [f for s, _ in group for f in s]
            text = (
                f"{_count_text(features)} {tool} are moved by {position_text(shift[0], shift[1])}, the first {before}"
            )
        pairs = [pair for both in group for pair in zip(*both, strict=True)]
        yield _difference("moved", pairs, text, "hole" if all(_hole(s, sides[0]) for s, _ in group) else "")


def _differs_only_in_position(one: Stretch, other: Stretch, room: MatchTolerance) -> bool:
    """Return whether two stretches differ only in position, or two single cuts only in their end."""
    if len(one) != len(other) or any(a.exact != b.exact for a, b in zip(one, other, strict=True)):
        return False
    if not all(map(math.isfinite, (*one[0].place[:2], *other[0].place[:2]))):
        return False
    a, b = one[0], other[0]
    if len(one) == 1:
        moved = b._replace(place=a.place if _noun_of([a]) != "cut" else (*a.place[:3], *b.place[3:]))
        if not feature_changes(a, moved, room):
            return True
    x, y = (q - p for p, q in zip(a.place[:2], b.place[:2], strict=True))
    return not any(
        feature_changes(p, q._replace(place=_shifted(q, -x, -y)), room) for p, q in zip(one, other, strict=True)
    )


def _shifted(feature: Feature, x: float, y: float) -> tuple[float, ...]:
    places = list(feature.place)
    for k in (0, 3, 6) if feature.exact[EXACT.index("turns")] else (0, 3):
        places[k] += x
        places[k + 1] += y
    return tuple(places)


def _difference(words: str, pairs: list[tuple[Feature, Feature]], text: str, noun: str = "") -> Difference:
    lines = [(one.line, other.line) for one, other in pairs]
    return Difference(f"{words} {noun or _noun_of(one for one, _ in pairs)}", *lines[0], text, _further_lines(lines))


def _further_lines(lines: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    return tuple(dict.fromkeys(pair for pair in lines[1:] if pair != lines[0]))


def _same_point(a: tuple[float, ...] | None, b: tuple[float, ...]) -> bool:
    """Return whether two points are equal; two unknown coordinates are equal."""
    if a is None:
        return False
    return all(abs(p - q) <= _NEAR or (math.isnan(p) and math.isnan(q)) for p, q in zip(a, b, strict=True))


def _feature_text(feature: Feature) -> str:
    return Message(
        "{} at {} with tool {}", name_of(feature.exact[0]), position_text(*feature.place[:3]), _tool_of(feature)
    )


def _count_text(features: list[Feature]) -> str:
    """Return the number of features in words: ``3 holes``, ``7 cuts and 1 dwell``."""
    nouns = Counter(_noun_of([feature]) for feature in features)
    return " and ".join(f"{n} {noun}{'s' if n > 1 else ''}" for noun, n in nouns.most_common())


def _verb_of(features: list[Feature]) -> str:
    return "is" if len(features) == 1 else "are"


def _is_cycle(feature: Feature) -> bool:
    return feature.exact[0] >= FIRST_CYCLE


def _tool_of(feature: Feature) -> int:
    return feature.exact[EXACT.index("tool")]


def _noun_of(features: Iterable[Feature]) -> str:
    """Return the most frequent noun: hole, dwell or cut."""
    return Counter(
        "hole" if _is_cycle(f) else "dwell" if name_of(f.exact[0]) == "dwell" else "cut" for f in features
    ).most_common(1)[0][0]
