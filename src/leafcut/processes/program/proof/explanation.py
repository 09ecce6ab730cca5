"""Explain unmatched features in a machinist's terms. Each change is reported once, without its consequences.

A changed feed word is a single difference. A cut that only starts elsewhere because the cut before it ends elsewhere is
not a difference.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple, TypeVar

from leafcut.errors import count_of
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import EXACT, FIRST_CYCLE, Features, feature_kind_name
from leafcut.processes.program.proof.matching import (
    CellKey,
    Feature,
    FeatureChange,
    MatchTolerance,
    Pairing,
    StateChange,
    cells_around,
    feature_changes,
    is_near,
    match_one_by_one,
    sorted_into_cells,
)
from leafcut.proof.difference import position_text

#: Maximum number of missing features that are explained, and of candidates per grid cell. Further features are only
#: counted.
_MOST_EXPLAINED, _MOST_TRIED = 20_000, 40
#: The search for moved features considers at most this many stretches.
_MOST_MOVED = 200
#: At most this many holes are listed by position.
_MOST_NAMED = 3
#: Points within this distance count as equal, mm.
_NEAR = 1e-6

#: Consecutive features without a travel move between them, or a single hole.
Stretch = list[Feature]
_Item = TypeVar("_Item")


class Explanation(NamedTuple):
    """The explained differences, sorted by line.

    `found` is a lower bound for the number of differences. `changes` contains the changes of work that occurs in both
    programs.
    """

    differences: list[Difference]
    found: int
    changes: set[FeatureChange]


class _ChangedFeature(NamedTuple):
    """A feature with its counterpart in the new program.

    The start point is compared separately from the other values.
    """

    one: Feature
    other: Feature
    start: list[FeatureChange]
    rest: list[FeatureChange]


def explain(pairing: Pairing, room: MatchTolerance, implied: Sequence[StateChange] = ()) -> Explanation:
    """Explain each unmatched feature as done elsewhere, changed, moved, missing or new.

    Changes in `implied` are left out, because they follow from other differences.
    """
    elsewhere, missing, extra = _moved_past_barrier(pairing, room)
    counted = max(len(missing) - _MOST_EXPLAINED, 0)
    pairs, gone, new = _changed_features(missing[:_MOST_EXPLAINED], extra, room, implied)
    found = [*elsewhere, *_grouped_changes(pairs, gone, new)]
    sides = pairing.before, pairing.after
    stretches = [list(_stretches(rest)) for rest in (gone, new)]
    if counted:
        # New features may be counterparts of features that were counted but not explained.
        stretches[1] = []
    found += _moved_features(stretches[0], stretches[1], sides, room)
    for change, rest, side in (("missing", stretches[0], sides[0]), ("extra", stretches[1], sides[1])):
        found += (_group_difference(change, group, side) for group in _consecutive_groups(rest, _adjacent))
    if not found and (missing or extra) and not implied:
        # Without an explanation, the programs still differ.
        one, other = (side[0].line if side else 0 for side in (missing, extra))
        message = Message("too many moves lie at one position")
        found.append(Difference(Message("not compared"), one, other, message))
    found.sort(key=lambda one: one.original or one.new)
    return Explanation(found, len(found) + counted, {change for one in pairs for change in one.rest})


def _moved_past_barrier(
    pairing: Pairing, room: MatchTolerance
) -> tuple[list[Difference], list[Feature], list[Feature]]:
    """Report the features that moved to the other side of a barrier.

    Returns
    -------
    tuple
        The differences, and the remaining features of the original program and of the new program.
    """
    missing, extra = pairing.missing, pairing.extra
    if not any(f.group for f in (*missing, *extra)):
        return [], missing, extra
    nowhere = [[f._replace(group=0) for f in side] for side in (missing, extra)]
    pairs, missing, extra = match_one_by_one(nowhere[0], nowhere[1], room)
    found = []
    for group in _consecutive_groups(
        pairs, lambda p, q: (q[0].number, q[1].number) == (p[0].number + 1, p[1].number + 1)
    ):
        ones = [one for one, _ in group]
        if len(ones) == 1:
            message = Message(
                "{} is done before or after another barrier (pause, tool change, work offset …)", _feature_text(ones[0])
            )
        else:
            message = Message(
                "{}, the first {}, are done before or after another barrier (pause, tool change, work offset …)",
                _count_text(ones),
                _feature_text(ones[0]),
            )
        found.append(_difference("moved", group, message))
    return found, missing, extra


def _consecutive_groups(items: Iterable[_Item], goes_on: Callable[[_Item, _Item], bool]) -> Iterator[list[_Item]]:
    """Yield groups of consecutive items.

    `goes_on` decides whether an item belongs to the same group as the item before it.
    """
    group: list[_Item] = []
    for item in items:
        if group and not goes_on(group[-1], item):
            yield group
            group = []
        group.append(item)
    if group:
        yield group


def _changed_features(
    missing: list[Feature], extra: list[Feature], room: MatchTolerance, implied: Sequence[StateChange]
) -> tuple[list[_ChangedFeature], list[Feature], list[Feature]]:
    """Return the features that changed but kept their place, the missing features, and the new features."""
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
        changes = [change for change in found if not any(map(change.matches, implied))]
        start = [change for change in changes if change.name == "start"]
        pairs.append(_ChangedFeature(feature, other, start, [change for change in changes if change not in start]))
    return pairs, gone, sorted(feature for cell in cells.values() for feature in cell)


def _grouped_changes(pairs: list[_ChangedFeature], gone: list[Feature], new: list[Feature]) -> Iterator[Difference]:
    """Yield the changes as differences.

    Equal changes are grouped, and changes that follow from other changes are skipped.
    """
    differing = [pair for pair in pairs if pair.rest]
    ends = [
        {f.number: f.place[:3] for f in side}
        for side in ([*gone, *(pair.one for pair in differing)], [*new, *(pair.other for pair in differing)])
    ]
    groups: dict[tuple[FeatureChange, ...], list[_ChangedFeature]] = defaultdict(list)
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
            groups[*pair.rest, *start].append(pair)
    for run in _consecutive_groups(begun, lambda p, q: q.one.number == p.one.number + 1):
        numbers = [pair.other.number for pair in run]
        ordered = sorted(numbers)
        if numbers != ordered and ordered[-1] - ordered[0] == len(run) - 1:
            ones = [pair.one for pair in run]
            first = position_text(*ones[0].place[:3])
            message = Message("{}, the first to {}, come in another order", _count_text(ones), first)
            others = sorted((pair.other for pair in run), key=lambda f: f.number)
            yield _difference("reordered", [*zip(ones, others, strict=True)], message)
        else:
            for pair in run:
                groups[tuple(pair.start)].append(pair)
    for changes, group in groups.items():
        ones = [pair.one for pair in group]
        where = Message("at {}", position_text(*ones[0].place[:2]))
        what = where if len(ones) == 1 else Message("{}, the first {}", _count_text(ones), where)
        message = Message("{}: {}", what, Message.joined("; ", (change.message for change in changes)))
        yield _difference("changed", [(p.one, p.other) for p in group], message)


def _stretches(features: list[Feature]) -> Iterator[Stretch]:
    return _consecutive_groups(sorted(features, key=lambda f: f.number), _is_continued_by)


def _is_continued_by(one: Feature, other: Feature) -> bool:
    if other.number != one.number + 1 or _is_cycle(one) or _is_cycle(other) or _tool_number(one) != _tool_number(other):
        return False
    # A hole pecked by single moves counts as one hole, despite the retracts.
    pecked = _is_upright(one) and _is_upright(other) and _same_point(one.place[:2], other.place[:2])
    return pecked or _same_point(one.place[:3], other.place[3:6])


def _is_upright(feature: Feature) -> bool:
    return _same_point(feature.place[:2], feature.place[3:5])


def _adjacent(one: Stretch, other: Stretch) -> bool:
    return other[0].number == one[-1].number + 1 and _tool_number(other[0]) == _tool_number(one[0])


def _group_difference(change: str, group: list[Stretch], side: Features) -> Difference:
    features = [feature for stretch in group for feature in stretch]
    holes = [_describe_hole(stretch, side) for stretch in group]
    text = _group_text(group, holes)
    if len(group) == 1 and (holes[0] or len(features) == 1):
        message = Message("{} is missing", text) if change == "missing" else Message("{} is new", text)
    else:
        message = Message("{} are missing", text) if change == "missing" else Message("{} are new", text)
    noun = "hole" if all(holes) else _commonest_noun(features)
    lines = [(f.line, 0) if change == "missing" else (0, f.line) for f in features]
    return Difference(_KINDS[change][noun], *lines[0], message, _further_lines(lines))


def _group_text(group: list[Stretch], holes: list[Message | None]) -> Message:
    tool = _tool_number(group[0][0])
    if len(group) == 1:
        return Message("{} with tool {}", _describe_run(group[0], holes[0]), tool)
    described = [hole for hole in holes if hole]
    if len(described) < len(holes):
        features = [feature for stretch in group for feature in stretch]
        first = position_text(*features[0].place[:3])
        return Message("{}, the first at {}, with tool {}", _count_text(features), first, tool)
    if len(group) <= _MOST_NAMED:
        *places, last = (hole.values[-1] for hole in described)
        return Message("{} holes at {} and {} with tool {}", len(group), Message.joined(", ", places), last, tool)
    return Message("{} holes, the first {}, with tool {}", len(group), described[0], tool)


def _describe_run(stretch: Stretch, hole: Message | None) -> Message:
    """Describe a run of features.

    The last value of the message is the end of the run. The start comes before it, unless several cuts make a single
    hole.
    """
    first, last = stretch[0], stretch[-1]
    if hole and not _is_cycle(first) and len(stretch) > 1:
        return Message("{}, of {},", hole, _count_text(stretch))
    if len(stretch) == 1:
        return Message("{} at {}", feature_kind_name(first.exact[0]), position_text(*first.place[:3]))
    start, end = position_text(*first.place[3:6]), position_text(*last.place[:3])
    return Message("{} from {} to {}", _count_text(stretch), start, end)


def _describe_hole(stretch: Stretch, side: Features) -> Message | None:
    """Describe a hole made by a canned cycle or by vertical cuts without adjoining cuts. Return None for other work.

    The last value of the message is the position of the hole.
    """
    first, last = stretch[0], stretch[-1]
    if _is_cycle(first):
        return Message("{} at {}", feature_kind_name(first.exact[0]), position_text(*first.place[:3]))
    bottom = min(f.place[2] for f in stretch)
    if not all(map(_is_upright, stretch)) or not bottom < first.place[5]:
        return None
    n, before, after = len(side), first.number - 1, last.number + 1
    if before >= 0 and side.kind[before] < FIRST_CYCLE and _same_point(tuple(side.end[before]), first.place[3:6]):
        return None
    if after < n and side.kind[after] < FIRST_CYCLE and _same_point(tuple(side.start[after]), last.place[:3]):
        return None
    return Message("hole at {}", position_text(first.place[0], first.place[1], bottom))


def _moved_features(
    gone: list[Stretch], new: list[Stretch], sides: tuple[Features, Features], room: MatchTolerance
) -> Iterator[Difference]:
    """Yield differences for features that only moved, and remove these features from both lists."""
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
        holes = [_describe_hole(s, side) for s, side in zip((one, other), sides, strict=True)]
        before, after = (hole or _describe_run(s, None) for s, hole in zip((one, other), holes, strict=True))
        tool, single = _tool_number(one[0]), holes[0] is not None or len(one) == 1
        if len(group) > 1:
            count = _count_text([f for s, _ in group for f in s])
            moved = position_text(shift[0], shift[1])
            message = Message("{} with tool {} are shifted by {}; the first is {}", count, tool, moved, before)
        elif holes[1] is None and len(other) > 1:
            message = Message(
                "{} with tool {} is now from {} to {}" if single else "{} with tool {} are now from {} to {}",
                before,
                tool,
                *after.values[1:],
            )
        else:
            message = Message(
                "{} with tool {} is now at {}" if single else "{} with tool {} are now at {}",
                before,
                tool,
                after.values[-1],
            )
        pairs = [pair for both in group for pair in zip(*both, strict=True)]
        yield _difference("moved", pairs, message, "hole" if all(_describe_hole(s, sides[0]) for s, _ in group) else "")


def _differs_only_in_position(one: Stretch, other: Stretch, room: MatchTolerance) -> bool:
    """Return whether two runs of features are equal after a shift in X and Y.

    Two single cuts also match if only their end points differ.
    """
    if len(one) != len(other) or any(a.exact != b.exact for a, b in zip(one, other, strict=True)):
        return False
    if not all(map(math.isfinite, (*one[0].place[:2], *other[0].place[:2]))):
        return False
    a, b = one[0], other[0]
    if len(one) == 1:
        moved = b._replace(place=a.place if _commonest_noun([a]) != "cut" else (*a.place[:3], *b.place[3:]))
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


#: Kinds of differences by change and noun.
_KINDS = {
    "missing": {"hole": Message("missing hole"), "dwell": Message("missing dwell"), "cut": Message("missing cut")},
    "extra": {"hole": Message("extra hole"), "dwell": Message("extra dwell"), "cut": Message("extra cut")},
    "moved": {"hole": Message("moved hole"), "dwell": Message("moved dwell"), "cut": Message("moved cut")},
    "reordered": {
        "hole": Message("reordered hole"),
        "dwell": Message("reordered dwell"),
        "cut": Message("reordered cut"),
    },
    "changed": {"hole": Message("changed hole"), "dwell": Message("changed dwell"), "cut": Message("changed cut")},
}


def _difference(change: str, pairs: list[tuple[Feature, Feature]], message: Message, noun: str = "") -> Difference:
    lines = [(one.line, other.line) for one, other in pairs]
    kind = _KINDS[change][noun or _commonest_noun(one for one, _ in pairs)]
    return Difference(kind, *lines[0], message, _further_lines(lines))


def _further_lines(lines: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    return tuple(dict.fromkeys(pair for pair in lines[1:] if pair != lines[0]))


def _same_point(a: tuple[float, ...] | None, b: tuple[float, ...]) -> bool:
    return a is not None and is_near(a, b, _NEAR)


def _feature_text(feature: Feature) -> Message:
    return Message(
        "{} at {} with tool {}",
        feature_kind_name(feature.exact[0]),
        position_text(*feature.place[:3]),
        _tool_number(feature),
    )


def _count_text(features: list[Feature]) -> Message:
    """Describe the number of features in words: ``3 holes``, ``7 cuts and 1 dwell``."""
    nouns = Counter(_commonest_noun([feature]) for feature in features)
    return Message.joined_by_and(count_of(n, noun) for noun, n in nouns.most_common())


def _is_cycle(feature: Feature) -> bool:
    return feature.exact[0] >= FIRST_CYCLE


def _tool_number(feature: Feature) -> int:
    return feature.exact[EXACT.index("tool")]


def _commonest_noun(features: Iterable[Feature]) -> str:
    return Counter(
        "hole" if _is_cycle(f) else "dwell" if f.exact[0] == Kind.DWELL else "cut" for f in features
    ).most_common(1)[0][0]
