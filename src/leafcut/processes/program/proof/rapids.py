"""Check that no rapid interrupts a cut, or is lower than in the original program at the same point."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import count_of
from leafcut.geometry.arrays import Floats, Indices, Ints, Mask
from leafcut.message import Message
from leafcut.model.cycles import hole_approaches
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.barriers import PLACELESS, Barrier
from leafcut.processes.program.proof.features import FIRST_CYCLE
from leafcut.processes.program.proof.program_work import ProgramWork, goes_across
from leafcut.proof.clearance import rows_at_machine_height
from leafcut.proof.difference import MOST_LISTED, position_text

#: At most this many faulty rapids are grouped by message.
_MOST_GROUPED = 2_000
#: Number of features whose rapids are compared at a time.
_AT_ONCE = 30_000
#: Flags of a sideways rapid: it starts at an unknown height, or it ends at an unknown height.
FROM, TO = 1, 2


@dataclass(frozen=True, eq=False)
class RapidGaps:
    """Rapids, grouped by gap. A gap is between two stops, which are features and barriers.

    Gap k comes before stop k, and the last gap comes after all stops. An unknown height (after a move in machine
    coordinates) counts as infinite, because the tool is retracted there. A rapid is sideways if it moves in x or y.

    Attributes
    ----------
    feature
        Feature of stop k, int32[n]; -1 for a barrier.
    gap_of
        Gap before each feature, int32[m].
    rows, across
        Whether the gap has rapids, and whether it has sideways rapids, bool[n + 1].
    line
        Line of the first rapid, int64[n + 1].
    leave
        Height at the start of the first sideways rapid, mm; infinite without sideways rapids.
    arrive
        Height at the end of the last sideways rapid, mm; infinite without sideways rapids.
    cross
        Lowest height between the first and the last sideways rapid, mm; infinite without sideways rapids.
    down_here, down_there
        Lowest height of descents before the first sideways rapid, and after the last sideways rapid, mm.
    top
        Greatest height, mm; minus infinity without rapids.
    unknown, unknown_first, unknown_last
        Sum of `FROM` and `TO` for all sideways rapids, for the first sideways rapid, and for the last, int8[n + 1].
    lit, lit_first, lit_last
        Whether the spindle (beam) is on in any sideways rapid, in the first sideways rapid, and in the last, bool[n +
        1].
    """

    feature: Ints
    gap_of: Ints
    rows: Mask
    across: Mask
    line: Indices
    leave: Floats
    arrive: Floats
    cross: Floats
    down_here: Floats
    down_there: Floats
    top: Floats
    unknown: NDArray[np.int8]
    unknown_first: NDArray[np.int8]
    unknown_last: NDArray[np.int8]
    lit: Mask
    lit_first: Mask
    lit_last: Mask

    @cached_property
    def closed_by_feature(self) -> Mask:
        """Mask of the gaps with a feature at their end, bool[n + 1]."""
        return np.append(self.feature >= 0, False)

    @cached_property
    def opened_by_feature(self) -> Mask:
        """Mask of the gaps with a feature at their start, bool[n + 1]."""
        return np.concatenate([[False], self.feature >= 0])


def group_rapids(work: ProgramWork) -> RapidGaps:
    """Group the rapids of a program by gap."""
    barriers = [mark.key for mark in work.marks if mark.kind != Kind.DWELL]
    keys = np.concatenate([work.features.row.astype(np.float64), barriers])
    number = np.concatenate([np.arange(len(work.features)), np.full(len(barriers), -1)])
    order = np.argsort(keys, kind="stable")
    keys, feature = keys[order], number[order].astype(np.int32)
    gap_of = np.empty(len(work.features), dtype=np.int32)
    gap_of[feature[feature >= 0]] = np.flatnonzero(feature >= 0)
    at, row, begin, end = _rapid_columns(work)
    gap = np.searchsorted(keys, at)
    across = goes_across(begin, end)
    low, high = (np.where(np.isnan(z), np.inf, z) for z in (begin[:, 2], end[:, 2]))
    n = len(keys) + 1
    first, last = np.full(n, len(at)), np.full(n, -1)
    ways = np.flatnonzero(across)
    np.minimum.at(first, gap[ways], ways)
    np.maximum.at(last, gap[ways], ways)
    has_across = last >= 0
    moves = np.arange(len(at))
    # A retract needs no check: the tool rises where it came down before.
    sinks = ~across & (high < low)
    here, there = sinks & (moves < first[gap]), sinks & (moves > last[gap])
    amid = across | (sinks & ~here & ~there)
    begins = np.full(n, -1)
    begins[gap[::-1]] = row[::-1]
    on = np.append(work.modal("spindle", row) != 0, False)
    if not work.dark_rapids:
        # A beam at zero power is off.
        on[:-1] &= work.modal("rpm", row) != 0
    lit = np.zeros(n, dtype=bool)
    lit[gap[across & on[:-1]]] = True
    # At machine zero or above, the tool is retracted for any work offset.
    lost = across & ~rows_at_machine_height(work.path, 0.0)[row]
    unknown = np.append(lost * (FROM * np.isnan(begin[:, 2]) + TO * np.isnan(end[:, 2])), 0).astype(np.int8)
    any_unknown = np.zeros(n, dtype=np.int8)
    np.bitwise_or.at(any_unknown, gap, unknown[:-1])
    padded = [np.append(z, np.inf) for z in (low, high)]
    return RapidGaps(
        feature,
        gap_of,
        begins >= 0,
        has_across,
        np.where(begins >= 0, work.path.line[begins] if len(work.path) else 0, 0),
        padded[0][first],
        np.where(has_across, padded[1][last], np.inf),
        _minimum_by_gap(n, gap[amid], np.minimum(low, high)[amid]),
        _minimum_by_gap(n, gap[here & has_across[gap]], high[here & has_across[gap]]),
        _minimum_by_gap(n, gap[there], high[there]),
        -_minimum_by_gap(n, gap, -np.maximum(low, high)),
        any_unknown,
        unknown[first],
        np.where(has_across, unknown[last], np.int8(0)),
        lit,
        on[first],
        has_across & on[last],
    )


def _minimum_by_gap(n: int, gap: Indices, value: Floats) -> Floats:
    least = np.full(n, np.inf)
    np.minimum.at(least, gap, value)
    return least


def _rapid_columns(work: ProgramWork) -> tuple[Floats, Indices, Floats, Floats]:
    """Return all rapids in order as columns: key, row, start and end.

    The moves to the R planes of cycles are included.
    """
    path = work.path
    drill = np.flatnonzero(path.kind == Kind.DRILL)
    over, level = path.end[drill].copy(), work.drill_from.copy()
    approach = hole_approaches(path, drill, level[:, 2])
    level[:, 2], over[:, 2] = approach.begin, approach.end
    down = over.copy()
    down[:, 2] = np.array([c.r_plane for c in path.cycles], dtype=np.float64)[path.ref[drill]]
    # A cycle may also descend before its sideways move.
    upright = approach.upright
    at = np.concatenate([work.travel, drill[upright] - 0.5, drill - 0.4, drill - 0.3])
    order = np.argsort(at, kind="stable")
    row = np.concatenate([work.travel, drill[upright], drill, drill])
    begin = np.concatenate([work.travel_from, work.drill_from[upright], level, over])
    end = np.concatenate([path.end[work.travel], level[upright], over, down])
    return at[order], row[order], begin[order], end[order]


@dataclass(frozen=True, eq=False)
class AllowedHeights:
    """The lowest heights that the original program permits at each feature, mm.

    A height is infinite if the original program only travels there at unknown heights.

    Attributes
    ----------
    leave, arrive
        Height of the departure after the feature, and of the arrival before it.
    down_here, down_there
        Height of descents after the feature, and before it.
    follows
        Whether the feature has no rapid before it.
    first
        Whether the feature is the first feature after a barrier.
    """

    leave: Floats
    arrive: Floats
    follows: Mask
    down_here: Floats
    down_there: Floats
    first: Mask


def allowed_heights(work: ProgramWork, gaps: RapidGaps) -> AllowedHeights:
    """Return the lowest travel heights that the original program permits at each feature."""
    before, after = gaps.gap_of, gaps.gap_of + 1
    # If a barrier follows, the tool departs in the next gap with rapids before any work.
    n = len(gaps.rows)
    ready = np.where(gaps.rows | gaps.closed_by_feature, np.arange(n), n - 1)
    following = np.minimum.accumulate(ready[::-1])[::-1][after]
    leave = _departure_heights(gaps)[following]
    leave = np.where(gaps.rows[following], leave, np.inf)
    first = ~gaps.opened_by_feature[before]
    arrive = np.where(gaps.across[before], gaps.arrive[before], gaps.top[before])
    arrive = np.where(gaps.rows[before], arrive, np.inf)
    # The tool reaches the first feature of a stage from anywhere, and leaves the last feature towards the next stage.
    # The limit is the height at which it left, or reached, that point.
    visit = np.cumsum(gaps.across[before] | first)
    first_of_visit = np.searchsorted(visit, visit)
    last_of_visit = np.searchsorted(visit, visit, side="right") - 1
    # The same applies if the tool retracts and dwells, because a dwell is possible at any height.
    waits = (work.features.kind == Kind.DWELL) & gaps.rows[before] & ~gaps.across[before] & ~first
    last = ~gaps.closed_by_feature[after] | np.append(waits[1:], False)
    reached = arrive[first_of_visit]
    arrive, leave = (
        np.where(first & gaps.rows[before], np.minimum(arrive, leave[last_of_visit]), arrive),
        np.where(last, np.minimum(leave, reached), leave),
    )
    arrive = np.where(waits, np.minimum(arrive, reached), arrive)
    made = work.features
    end = np.where(made.kind >= FIRST_CYCLE, made.start[:, 2], made.end[:, 2])
    start = np.where(made.kind >= FIRST_CYCLE, made.of("r_plane"), made.start[:, 2])
    # Without a sideways rapid, the whole gap is at one point.
    sunk = _first_descents(gaps)[after]
    return AllowedHeights(
        leave,
        arrive,
        ~gaps.rows[before],
        np.fmin(np.minimum(sunk, leave), end),
        np.fmin(np.minimum(gaps.down_there[before], arrive), start),
        first,
    )


def _limits_of_reversed_runs(heights: AllowedHeights, turned: Indices) -> AllowedHeights:
    """Adjust the allowed heights for reversed runs. Both ends of a reversed run get the higher of their two limits."""
    if not (turned >= 0).any():
        return heights
    arrive, leave = heights.arrive.copy(), heights.leave.copy()
    _, first, count = np.unique(turned[turned >= 0], return_index=True, return_counts=True)
    first = np.flatnonzero(turned >= 0)[first]
    last = first + count - 1
    arrive[first] = leave[last] = np.maximum(arrive[first], leave[last])
    return replace(heights, arrive=arrive, leave=leave)


def compare_rapids(
    original: ProgramWork,
    new: ProgramWork,
    new_of: Indices,
    turned: Indices,
    mark_of: dict[float, Barrier],
    tolerance: float,
    beam: bool,
) -> tuple[list[Difference], int]:
    """Find the rapids of the new program that interrupt a cut, or that are lower than in the original program.

    Parameters
    ----------
    new_of
        New feature of each original feature, or -1 if it is missing.
    turned
        Run of each feature if this run is reversed, otherwise -1.
    mark_of
        Maps the key of an original barrier to the barrier of the new program.

    Returns
    -------
    tuple
        The faulty rapids as differences, and their number.
    """
    both = original, group_rapids(original), new, group_rapids(new)
    found = list(_after_length_change(original, new, tolerance + 1e-9))
    count = len(found)
    reported: set[tuple[int, int]] = set()
    for what, text, old_line, new_line, wrong in (
        *_checks_by_feature(both, new_of, turned, tolerance + 1e-9, beam),
        *_checks_by_barrier(both, mark_of, tolerance + 1e-9),
    ):
        # Each rapid is reported once.
        rows = [
            row for row in np.flatnonzero(wrong).tolist() if (int(old_line[row]), int(new_line[row])) not in reported
        ]
        reported.update((int(old_line[row]), int(new_line[row])) for row in rows if old_line[row] and new_line[row])
        count += len(rows)
        alike: dict[Message, list[int]] = {}
        for row in rows[:_MOST_GROUPED]:
            alike.setdefault(text(row)[0], []).append(row)
        for message, same in list(alike.items())[:MOST_LISTED]:
            lines = [(int(old_line[row]), int(new_line[row])) for row in same]
            place = text(same[0])[1]
            if len(same) > 1:
                place = Message("{} and {}", place, count_of(len(same) - 1, "other place"))
            filled = Message(message.template, place, *message.values[1:]) if message.values else message
            also = tuple(dict.fromkeys(pair for pair in lines if pair != lines[0]))
            found.append(Difference(what, *lines[0], filled, also))
        count -= min(len(rows), _MOST_GROUPED) - len(alike)
    return found, count


#: A check of rapids: kind of difference; function that maps a row to a message with "" as its first value, and the
#: place for it; lines in the original program; lines in the new program; mask of the faulty rapids.
RapidCheck = tuple[Message, Callable[[int], tuple[Message, str]], NDArray, NDArray, Mask]
Both = tuple[ProgramWork, RapidGaps, ProgramWork, RapidGaps]


_LEAVES = partial(Message, "a rapid leaves {} at {} instead of {}")
_ARRIVES = partial(Message, "a rapid arrives at {} at {} instead of {}")
_GOES_DOWN = partial(Message, "a rapid goes down over {} at {} instead of {}")
_GOES_ACROSS_TO = partial(Message, "a rapid goes across to {} at {} instead of {}")
_GOES_ACROSS_FROM = partial(Message, "a rapid goes across from {} at {} instead of {}")


def _checks_by_feature(both: Both, new_of: Indices, turned: Indices, room: float, beam: bool) -> Iterator[RapidCheck]:
    original, old_gaps, _, _ = both
    allowed = _limits_of_reversed_runs(allowed_heights(original, old_gaps), turned)
    lowest = _lowest_crossing(original, old_gaps)
    old = np.flatnonzero(new_of >= 0)
    old_of = np.full(int(new_of.max(initial=-1)) + 2, -1)
    old_of[new_of[old]] = old
    # The columns of all features at once would need more memory than the programs.
    for begin in range(0, len(old), _AT_ONCE):
        some = old[begin : begin + _AT_ONCE]
        yield from _checks_of_features(both, allowed, lowest, some, new_of, old_of, room, beam)


def _checks_of_features(
    both: Both,
    allowed: AllowedHeights,
    lowest: Floats,
    old: Indices,
    new_of: Indices,
    old_of: Indices,
    room: float,
    beam: bool,
) -> Iterator[RapidCheck]:
    original, old_gaps, new, gaps = both
    now = new_of[old]
    previous = old_of[now - 1]
    before, old_before = gaps.gap_of[now], old_gaps.gap_of[old]
    follows, rows = allowed.follows[old], gaps.rows[before]
    came_from = np.where(old > 0, new_of[old - 1], -1)
    stayed = np.where(old_gaps.opened_by_feature[old_before], (came_from == now - 1) | (came_from < 0), True)
    # The predecessor was removed or added: that is reported elsewhere.
    gone = old_gaps.opened_by_feature[old_before] & (came_from < 0)
    gone |= gaps.opened_by_feature[before] & (previous < 0)
    stayed &= gone | (gaps.opened_by_feature[before] == old_gaps.opened_by_feature[old_before])
    lines = original.features.line[old], new.features.line[now]
    places = original.features.end[old]

    def at(row: int) -> str:
        return position_text(*places[row, :2])

    yield (
        Message("interrupted cut"),
        lambda row: (
            Message(
                "the cut to {} originally followed the previous cut without a rapid; now a rapid lies between them", ""
            ),
            at(row),
        ),
        *lines,
        follows & (rows | ~stayed),
    )
    goes_to = np.append(new_of, 0)[old + 1]
    yield from _heights_by_feature(both, allowed, lowest, old, now, previous, goes_to, room)
    if beam:
        text = Message("a rapid next to {} is made with the beam on; in the original it was off", "")
        for lit in _newly_lit(old_gaps, gaps, old, now, previous, allowed.first):
            yield Message("beam on"), lambda row: (text, at(row)), *lines, lit


def _newly_lit(
    old_gaps: RapidGaps, gaps: RapidGaps, old: Indices, now: Indices, previous: Indices, first: Mask
) -> Iterator[Mask]:
    """Yield masks of the rapids that now run with the beam on, although the beam was off in the original program.

    The masks cover the rapids to, from and between features.
    """
    before, was = gaps.gap_of[now], old_gaps.gap_of[old]
    yield gaps.lit_last[before] & old_gaps.across[was] & ~old_gaps.lit_last[was] & ~first[old]
    yield gaps.lit_first[before + 1] & old_gaps.across[was + 1] & ~old_gaps.lit_first[was + 1]
    known = old_gaps.across[was] & ~old_gaps.lit[was] & (previous >= 0) & ~first[old]
    yield gaps.lit[before] & known & ~old_gaps.lit[old_gaps.gap_of[previous] + 1]


def _heights_by_feature(
    both: Both,
    allowed: AllowedHeights,
    lowest: Floats,
    old: Indices,
    now: Indices,
    previous: Indices,
    goes_to: Indices,
    room: float,
) -> Iterator[RapidCheck]:
    original, old_gaps, new, gaps = both
    before, old_before = gaps.gap_of[now], old_gaps.gap_of[old]
    after, old_after = before + 1, old_before + 1
    rows, across = gaps.rows[before], gaps.across[before]
    approach = old_gaps.line[old_before], gaps.line[before]
    retract = old_gaps.line[old_after], gaps.line[after]
    places, start = original.features.end[old], new.features.of("start z", now)

    def message(
        of_heights: Callable[[str, str, str], Message], before: Floats, after: Floats
    ) -> Callable[[int], tuple[Message, str]]:
        return lambda row: (
            of_heights("", _height_text(after[row]), _height_text(before[row])),
            position_text(*places[row, :2]),
        )

    arrive = np.where(across, gaps.arrive[before], np.where(rows, gaps.top[before], start))
    # Without a rapid, an added predecessor is the cause, which is reported elsewhere.
    low_there = ~allowed.follows[old] & (arrive < allowed.arrive[old] - room)
    low_there &= rows | ~gaps.opened_by_feature[before] | (previous >= 0)
    leave = gaps.leave[after]
    low = gaps.across[after] & (leave < allowed.leave[old] - room)
    # A removed successor without a rapid in between is reported elsewhere too.
    low &= old_gaps.rows[old_after] | ~old_gaps.closed_by_feature[old_after] | (goes_to >= 0)
    yield Message("lower retract"), message(_LEAVES, allowed.leave[old], leave), *retract, low
    yield Message("lower approach"), message(_ARRIVES, allowed.arrive[old], arrive), *approach, low_there
    # Without a sideways rapid both are at one point, so the descent after the predecessor counts too.
    together = ~across & gaps.opened_by_feature[before] & (previous >= 0)
    behind = old_gaps.gap_of[previous] + 1
    after_previous = np.where(together, _first_descents(old_gaps)[behind], np.inf)
    for lines, limit, deep in (
        (approach, np.fmin(allowed.down_there[old], after_previous), gaps.down_there[before]),
        (retract, allowed.down_here[old], gaps.down_here[after]),
    ):
        yield Message("deeper rapid"), message(_GOES_DOWN, limit, deep), *lines, deep < limit - room
    for now_gap, old_gap, lines, first in ((before, old_before, approach, False), (after, old_after, retract, True)):
        found, was = _unknown_flags(gaps, now_gap, first), _unknown_flags(old_gaps, old_gap, first)
        yield (
            Message("unknown height"),
            lambda row: (
                Message("a rapid next to {} crosses at an unknown height", ""),
                position_text(*places[row, :2]),
            ),
            *lines,
            _newly_unknown(found, was) & np.isfinite(places[:, 2]),
        )
    limit = np.where(np.isinf(lowest[old]), allowed.arrive[old], lowest[old])
    cross = np.where(across, gaps.cross[before], np.inf)
    yield Message("lower retract"), message(_GOES_ACROSS_TO, limit, cross), *approach, cross < limit - room
    # Also for rapids to a barrier.
    limit = np.where(np.isinf(lowest[old]), allowed.leave[old], lowest[old])
    cross = np.where(gaps.closed_by_feature[after], np.inf, gaps.cross[after])
    yield Message("lower retract"), message(_GOES_ACROSS_FROM, limit, cross), *retract, cross < limit - room


def _unknown_flags(gaps: RapidGaps, gap: Indices | Ints, first: bool) -> NDArray[np.int8]:
    """Return the flags of unknown heights at each feature. At a barrier, only the nearest sideways rapid counts."""
    nearest, inside = gaps.unknown_last, gaps.opened_by_feature
    if first:
        nearest, inside = gaps.unknown_first, gaps.closed_by_feature
    return np.where(inside[gap], gaps.unknown[gap], nearest[gap])


def _newly_unknown(now: NDArray[np.int8], before: NDArray[np.int8]) -> Mask:
    less: Mask = (now & ~before) != 0
    return less


def _lowest_crossing(work: ProgramWork, gaps: RapidGaps) -> Floats:
    """Return, for each feature, the height of the lowest sideways rapid with the same tool in the same group, mm.

    If no such rapid exists, the rapids of all tools in the group count.
    """
    group, tool = work.features.group, work.features.of("tool")
    cross = np.minimum(gaps.cross[gaps.gap_of], gaps.cross[gaps.gap_of + 1])
    lowest = np.full(len(group), np.inf)
    for number in (group * (np.ptp(tool) + 1) + tool if len(tool) else tool, group):
        _, key = np.unique(number, return_inverse=True)
        key = key.reshape(-1)
        lowest = np.where(np.isinf(lowest), _minimum_by_gap(int(key.max(initial=-1)) + 1, key, cross)[key], lowest)
    return lowest


def _height_text(height: float) -> str:
    return f"Z{height:.3f}" if np.isfinite(height) else Message("an unknown height")


def _checks_by_barrier(both: Both, mark_of: dict[float, Barrier], room: float) -> Iterator[RapidCheck]:
    original, old_gaps, new, gaps = both
    begins = _newly_unknown(gaps.unknown_first[:1], old_gaps.unknown[:1]) & old_gaps.across[:1]
    yield (
        Message("unknown height"),
        lambda _: (Message("the program starts with a sideways rapid at an unknown height"), ""),
        old_gaps.line[:1],
        gaps.line[:1],
        begins,
    )
    yield (
        Message("deeper rapid"),
        lambda _: (Message("the program starts with a rapid to a lower height than before"), ""),
        old_gaps.line[:1],
        gaps.line[:1],
        old_gaps.rows[:1] & (gaps.down_here[:1] < _first_descents(old_gaps)[:1] - room),
    )
    at = {
        mark.key: k
        for mark, k in zip(_barriers_without_dwells(new), np.flatnonzero(gaps.feature < 0).tolist(), strict=True)
    }
    marks = zip(_barriers_without_dwells(original), np.flatnonzero(old_gaps.feature < 0).tolist(), strict=True)
    pairs = [(mark, mark_of[mark.key], k, at[mark_of[mark.key].key]) for mark, k in marks if mark.key in mark_of]
    if not pairs:
        return
    old = np.array([k for *_, k, _ in pairs])
    now = np.array([k for *_, k in pairs])
    lines = np.array([a.line for a, *_ in pairs]), np.array([b.line for _, b, *_ in pairs])
    here = np.array([mark.place for mark, *_ in pairs], dtype=np.float64)
    there = np.array([mark.place for _, mark, *_ in pairs], dtype=np.float64)
    apart = ~(np.abs(here - there) <= room) & ~(np.isnan(here) & np.isnan(there))
    known = np.array([a.kind not in PLACELESS for a, *_ in pairs])

    def barrier_text(message: Message) -> Callable[[int], tuple[Message, str]]:
        return lambda row: (message, pairs[row][0].text)

    to, from_ = (
        Message("a rapid to '{}' is lower than before", ""),
        Message("a rapid from '{}' is lower than before", ""),
    )
    down_to = Message("a rapid down to '{}' is lower than before", "")
    down_from = Message("a rapid down from '{}' is lower than before", "")
    parked = known & old_gaps.across[old]
    text = Message("the tool does not return to its original position for {}", "")
    yield (
        Message("parked elsewhere"),
        lambda row: (text, Message("'{}': {}", pairs[row][0].text, position_text(*here[row]))),
        *lines,
        parked & apart[:, :2].any(axis=1),
    )
    low = old_gaps.across[old] & gaps.across[now] & (gaps.arrive[now] < old_gaps.arrive[old] - room)
    yield Message("lower approach"), barrier_text(to), *lines, low
    # Between two barriers, no feature limits the descent.
    between = ~gaps.opened_by_feature[now] & ~old_gaps.opened_by_feature[old]
    sunk = [
        np.minimum(np.minimum(side.down_here[gap], side.down_there[gap]), side.cross[gap])
        for side, gap in ((gaps, now), (old_gaps, old))
    ]
    yield Message("deeper rapid"), barrier_text(down_to), *lines, between & (sunk[0] < sunk[1] - room)
    # Before and after a stop, the tool descends no lower than its height at the stop.
    stops = np.isfinite(here[:, 2])
    limit = np.fmin(old_gaps.down_there[old], here[:, 2])
    yield Message("deeper rapid"), barrier_text(down_to), *lines, stops & (gaps.down_there[now] < limit - room)
    for word, unknown, here_now, here_old in (
        ("to", Message("a rapid to '{}' crosses at an unknown height", ""), now, old),
        ("from", Message("a rapid from '{}' crosses at an unknown height", ""), now + 1, old + 1),
    ):
        # Rapids farther from the barrier may belong to other work.
        found = gaps.unknown[here_now] if word == "to" else gaps.unknown_first[here_now]
        less = _newly_unknown(found, old_gaps.unknown[here_old]) & old_gaps.across[here_old]
        yield Message("unknown height"), barrier_text(unknown), *lines, less
    leave = _departure_heights(old_gaps)[old + 1]
    low = old_gaps.rows[old + 1] & gaps.across[now + 1] & (gaps.leave[now + 1] < leave - room)
    yield Message("lower retract"), barrier_text(from_), *lines, low
    limit = np.fmin(_first_descents(old_gaps)[old + 1], here[:, 2])
    yield Message("deeper rapid"), barrier_text(down_from), *lines, stops & (gaps.down_here[now + 1] < limit - room)


def _departure_heights(gaps: RapidGaps) -> Floats:
    """Return the departure height at the start of each gap, mm.

    If a gap has no sideways rapid, this is the greatest height in the gap.
    """
    return np.where(gaps.across, gaps.leave, gaps.top)


def _first_descents(gaps: RapidGaps) -> Floats:
    """Return the lowest height of the descents at the start of each gap, mm.

    If a gap has no sideways rapid, all descents in the gap count.
    """
    return np.where(gaps.across, gaps.down_here, gaps.down_there)


def _after_length_change(original: ProgramWork, new: ProgramWork, room: float) -> Iterator[Difference]:
    """Yield rapids right after a change of length offset (G43, G49) if they are lower than in the original program.

    Heights before and after the change cannot be compared, so these rapids are only compared with each other.
    """
    limits = _lowest_by_length(original)
    for length, (height, line) in _lowest_by_length(new).items():
        limit, was = limits.get(length, (height, 0))
        if height < limit - room:
            text = Message(
                "a rapid right after a change of length offset goes to Z{:.3f}; in the original, such rapids go no "
                "lower than Z{:.3f}",
                height,
                limit,
            )
            yield Difference(Message("deeper rapid"), was, line, text)


def _lowest_by_length(work: ProgramWork) -> dict[int, tuple[float, int]]:
    """Return the height and line of the lowest rapid for each length offset register.

    Only rapids between the change to this offset and the next feature count. Rapids after the first sideways rapid at a
    known height are skipped, because their heights are compared elsewhere.
    """
    path = work.path
    changes, made = np.flatnonzero(path.kind == Kind.OFFSET), work.features.row
    rapids = work.travel
    begin, end = work.travel_from, path.end[rapids]
    sure = np.concatenate([[0], np.cumsum(goes_across(begin, end) & np.isfinite(begin[:, 2]))])
    change = np.searchsorted(changes, rapids) - 1
    after = change >= 0
    change = changes[np.maximum(change, 0)] if len(changes) else change
    counted = after & (np.searchsorted(made, rapids) == np.searchsorted(made, change)) & np.isfinite(end[:, 2])
    counted &= sure[:-1] == sure[np.searchsorted(rapids, change)]
    rapids = rapids[counted]
    found: dict[int, tuple[float, int]] = {}
    length = work.modal("length", rapids)
    for register in np.unique(length).tolist():
        rows = rapids[length == register]
        row = int(rows[np.argmin(path.end[rows, 2])])
        found[int(register)] = float(path.end[row, 2]), int(path.line[row])
    return found


def _barriers_without_dwells(work: ProgramWork) -> list[Barrier]:
    return [mark for mark in work.marks if mark.kind != Kind.DWELL]
