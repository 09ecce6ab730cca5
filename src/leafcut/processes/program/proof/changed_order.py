"""Find changes of order that matter, using the order rules with the thresholds `FREE`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice

import numpy as np
import shapely

from leafcut.geometry.arrays import Indices, Mask
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.order_rules import (
    LEVEL,
    Visits,
    detaching_visits,
    line_index,
    nearby_passes,
    rows_in_order,
    touching_in_new_order,
    visits_of,
)
from leafcut.processes.program.proof.order_thresholds import FREE
from leafcut.processes.program.proof.outlines import BEAM_TAB, MILL_TAB, lines_of, lines_starting_inside, outlines_of
from leafcut.processes.program.proof.program_work import ProgramWork
from leafcut.processes.program.proof.rapids import RapidGaps, allowed_heights
from leafcut.processes.program.proof.traces import traces_of
from leafcut.proof.difference import MOST_LISTED, position_text

#: Message about two features, from their places.
_MessageOf = Callable[[Message, Message], Message]
#: Two features of the original, the earlier first, and the message about their relation.
_Pair = tuple[int, int, _MessageOf]


class ChangedOrder:
    """Checks the order of the work in a new program.

    `new_of`, int64[n], is the index of each original feature in the new program, or -1 if it is missing. `flat` means
    that the tool is a beam or a pen, which makes no roughing passes.
    """

    def __init__(
        self,
        before: ProgramWork,
        after: ProgramWork,
        gaps: RapidGaps,
        new_of: Indices,
        flat: bool,
        check_cancelled: Heartbeat = ignore_heartbeat,
    ) -> None:
        self.before, self.after, self.gaps = before, after, gaps
        self.features, self.new_of, self.flat, self.check_cancelled = before.features, new_of, flat, check_cancelled
        self.unchanged = bool((np.diff(new_of[new_of >= 0]) > 0).all())
        self.traces = traces_of(self.features)
        # A run is a series of features without rapids between them.
        run = np.cumsum(allowed_heights(before, gaps).follows == 0)
        self.run: Indices = np.subtract(run, run[:1], dtype=np.int64)

    def touching(self, tolerance: float) -> Iterator[Difference]:
        """Yield touching cuts whose order changed, and features at unknown positions that moved in the order."""
        if self.unchanged:
            return
        known = np.isfinite(self.features.end[:, :2]).all(axis=1)
        for one in _reordered_features(self.new_of, np.flatnonzero(~known)):
            yield self._difference(
                Message("order"),
                one,
                one,
                lambda where, _: Message("the position of {} is unknown, and it has moved in the order", where),
            )
        self.check_cancelled()
        pairs, proved = touching_in_new_order(self.features, self.traces, self.new_of, tolerance, self.check_cancelled)
        for one, other in pairs[:MOST_LISTED].tolist():
            yield self._difference(
                Message("order"),
                one,
                other,
                partial(Message, "{} touches {}, which originally came later and now comes first"),
            )
        if not proved:
            yield Difference(
                Message("order"), 0, 0, Message("too many cuts overlap, so their order cannot be verified")
            )

    def work_inside_contours(self) -> Iterator[Difference]:
        """Yield work that was before a closed cut or a tabbed outline around it and is now after it, or vice versa.

        With a beam or a pen, only work that is now after the outline counts.
        """
        if self.unchanged or not len(self.traces.feature):
            return
        n = int(self.run[-1]) + 1
        first = np.searchsorted(self.run, np.arange(n))
        last = np.searchsorted(self.run, np.arange(n), side="right") - 1
        begins, ends = self.new_of[first], np.full(n, -1)
        np.maximum.at(ends, self.run, self.new_of)
        latest = np.maximum.accumulate(np.concatenate([[-1], begins]))[:n]
        missing = len(self.new_of)
        soonest = np.minimum.accumulate(np.concatenate([[missing], np.where(begins < 0, missing, begins)[::-1]]))[:n]
        moved = ((latest > ends) | (soonest[::-1] < ends)) & (ends >= 0)
        tab = BEAM_TAB if self.flat else MILL_TAB
        lines = list(lines_of(self.features, self.traces, self.run, FREE.sagitta))
        counts = {False: 0, True: 0}
        for outline, within in lines_starting_inside(lines, outlines_of(lines, tab, FREE, self.check_cancelled, moved)):
            if counts[outline.joined] > MOST_LISTED or (begins[outline.owners] < 0).any():
                continue
            inner = np.setdiff1d(within, outline.owners)
            closes, closed = outline.owners[-1], ends[outline.owners].max()
            changed = (inner < closes) & (begins[inner] > closed)
            if not self.flat:
                changed |= (inner > closes) & (begins[inner] < closed) & (begins[inner] >= 0)
            for k in inner[changed].tolist():
                counts[outline.joined] += 1
                kind = Message("inner after outer") if k < closes else Message("inner before outer")
                message = partial(_changed_side, outline.joined, k < closes, self.flat)
                yield self._difference(kind, int(first[k]), int(last[closes]), message)

    def reordered_passes(self, width: float) -> Iterator[Difference]:
        """Yield nearby passes of a mill of the given width (mm) in changed order, and parts detached too early."""
        if self.unchanged or not len(self.features):
            return
        first = ~self.gaps.opened_by_feature[self.gaps.gap_of]
        visit = np.cumsum(self.gaps.across[self.gaps.gap_of] | first, dtype=np.int64)
        visit = np.unique(visit, return_inverse=True)[1].ravel()
        visits = visits_of(self.features, self.traces, visit, int(visit[-1]) + 1, FREE)
        changed = islice(self._passes(visits, visit, width), 2 * MOST_LISTED)
        yield from (self._difference(Message("order"), *pair) for pair in changed)
        text = partial(
            Message, "{} was cut before the part whose outline ends at {} was detached; now it is cut afterwards"
        )
        for other, outline in islice(self._detached_too_early(visits, visit), MOST_LISTED + 1):
            yield self._difference(Message("part detached too early"), other, outline, text)

    def _passes(self, visits: Visits, visit: Indices, width: float) -> Iterator[_Pair]:
        begins = self.new_of[visits.first]
        crossed = self.gaps.cross[self.gaps.gap_of[visits.first]]
        chosen = visits.cuts & visits.level & (crossed > visits.bottom + LEVEL) & _moved_visits(begins)

        def wanted(a: Indices, b: Indices) -> Mask:
            changed: Mask = (a < b) & (begins[a] > begins[b])
            return changed

        if np.count_nonzero(chosen) > 1:
            owner = np.where(chosen[visit], visit, -1)
            near, of = line_index(lines_of(self.features, self.traces, owner, FREE.sagitta))
            known: set[tuple[str, int, int]] = set()
            for relation, pairs in nearby_passes(visits, near, of, FREE, width, wanted):
                self.check_cancelled()
                # Long cuts meet in several parts of the index.
                new = [pair for pair in ((relation, *pair) for pair in pairs.tolist()) if pair not in known]
                known.update(new)
                message = partial(_changed_order, relation)
                yield from ((*visits.first[list(pair)].tolist(), message) for _, *pair in new)
        for one, other in rows_in_order(visits, FREE, width).tolist():
            if 0 <= begins[other] < begins[one]:
                text = partial(Message, "{} clears a row beside {}, which originally came later and now comes first")
                yield int(visits.first[one]), int(visits.first[other]), text

    def _detached_too_early(self, visits: Visits, visit: Indices) -> Iterator[tuple[int, int]]:
        """Yield (feature, last feature of an outline) if the outline now detaches its part before the feature is cut.

        Parts that are detached at the same depth or deeper may be detached in either order.
        """
        features = self.features
        shifts = [mark.key for mark in self.before.marks if mark.kind == Kind.SHIFT]
        origin = np.searchsorted(shifts, features.row[visits.first])
        zeros = np.column_stack([features.of("frame", visits.first), origin])
        zero = np.unique(zeros, axis=0, return_inverse=True)[1].ravel()
        deepest = np.full(int(zero.max()) + 1, np.inf)
        np.minimum.at(deepest, zero, visits.floor)
        with np.errstate(invalid="ignore"):
            above = np.where(np.isfinite(visits.floor), visits.floor - deepest[zero], np.inf)
        ends = np.full(len(above), -1, dtype=np.int64)
        np.maximum.at(ends, visit, self.new_of)
        latest = np.maximum.accumulate(np.concatenate([[-1], ends]))[:-1]
        overtakes = (above <= FREE.surely_through) & (ends >= 0) & (latest > ends)
        if not overtakes.any():
            return
        may, surely = detaching_visits(features, self.traces, visits, visit, above, FREE, self.check_cancelled)
        for outline in np.flatnonzero(overtakes & surely).tolist():
            later = ends[:outline] > ends[outline]
            later &= ~(may[:outline] & (visits.floor[:outline] <= visits.floor[outline] + FREE.same_depth))
            if later.any():
                yield int(visits.first[np.argmax(later)]), int(visits.last[outline])

    def parts_note(self) -> list[Message]:
        """Return a note if the outlines of parts are cut in a different order."""
        features, run = self.features, self.run
        n = int(run[-1]) + 1 if len(run) else 0
        last = np.searchsorted(run, np.arange(n), side="right") - 1
        ends = np.full(n, -1, dtype=np.int64)
        np.maximum.at(ends, run, self.new_of)
        if (np.diff(ends[ends >= 0]) > 0).all():
            return []
        parts = self._part_outlines()
        parts = parts[ends[parts] >= 0]
        later = np.maximum.accumulate(np.concatenate([[-1], ends[parts]]))[:-1]
        moved = parts[later > ends[parts]]
        if not len(moved):
            return []
        one = int(moved[0])
        other = int(parts[(parts < one) & (ends[parts] > ends[one])][0])
        places = [
            Message("X{:.3f} Y{:.3f} (line {})", *features.end[k, :2], features.line[k])
            for k in last[[one, other]].tolist()
        ]
        return [
            Message(
                "parts detach in a different order: {} of {} outlines are cut earlier than before. "
                "Example: the outline that ends at {} is now cut before the path that ends at {}",
                len(moved),
                len(parts),
                *places,
            )
        ]

    def _part_outlines(self) -> Indices:
        """Return the runs that are outlines of parts, which are closed cuts inside an even number of other outlines."""
        lines = list(lines_of(self.features, self.traces, self.run, FREE.sagitta))
        outlines = list(outlines_of(lines, None, FREE, self.check_cancelled))
        if not outlines:
            return np.zeros(0, dtype=np.int64)
        starts = {line.owner: line.points[0] for line in reversed(lines)}
        owner = np.array([outline.owners[0] for outline in outlines])
        areas = np.array([outline.area for outline in outlines], dtype=object)
        inner, outer = shapely.STRtree(areas).query(
            shapely.points(np.array([starts[k] for k in owner.tolist()])), predicate="within"
        )
        depth = np.bincount(inner[owner[inner] != owner[outer]], minlength=len(owner))
        parts: Indices = np.unique(owner[depth % 2 == 0])
        return parts

    def _difference(self, what: Message, one: int, other: int, message: _MessageOf) -> Difference:
        """Return a difference between two features, with the lines of the first feature in both programs."""
        features = self.features
        places = [Message("{} (line {})", position_text(*features.end[k]), features.line[k]) for k in (one, other)]
        lines = int(features.line[one]), int(self.after.features.line[self.new_of[one]])
        return Difference(what, *lines, message(*places))


def _changed_side(tabs: bool, later: bool, flat: bool, place: Message, end: Message) -> Message:
    """Return the message about work inside a closed cut or tabbed outline that is now before or after this cut."""
    message = Message(
        "{} lies inside an outline with tabs that ends at {}; originally it was cut {} this cut, and now it is "
        "cut {} it"
        if tabs
        else "{} lies inside a closed cut that ends at {}; originally it was cut {} this cut, and now it is cut {} it",
        place,
        end,
        Message("before") if later else Message("after"),
        Message("after") if later else Message("before"),
    )
    return Message("{}, in a part that is already detached by then", message) if flat and not tabs else message


def _changed_order(relation: Message, place: Message, other: Message) -> Message:
    return Message("{} {} {}, which originally came later and now comes first", place, relation, other)


def _moved_visits(begins: Indices) -> Mask:
    """Return a mask of the visits whose order relative to any other visit changed."""
    here = begins >= 0
    most = np.maximum.accumulate(begins) > begins
    least = np.minimum.accumulate(np.where(here, begins, np.iinfo(np.int64).max)[::-1])[::-1] < begins
    moved: Mask = here & (most | least)
    return moved


def _reordered_features(rank: Indices, which: Indices) -> list[int]:
    """Return the features in `which` whose order relative to any other feature changed."""
    highest = np.maximum.accumulate(np.concatenate([[-1], rank]))[:-1]
    lowest = np.minimum.accumulate(np.where(rank >= 0, rank, len(rank) + rank.max(initial=0))[::-1])[::-1]
    here = rank[which]
    wrong: list[int] = which[(here >= 0) & ((highest[which] > here) | (lowest[which] < here))].tolist()
    return wrong
