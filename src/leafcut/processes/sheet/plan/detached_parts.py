"""Routes for a head that stays down between cuts.

A part is detached once its outline has been cut without micro-joints. Detached parts may tip up, so the head has to
travel around them. A route keeps at least the radius of the head away from detached parts. If no such route exists,
only the centre of the head stays clear of them. If even that is impossible, the move crosses a part. Moves of both
kinds are counted. To avoid them, `cut_outlines_later` postpones an outline until the head no longer crosses its part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import shapely

from leafcut.errors import count_of
from leafcut.geometry.arrays import Point
from leafcut.geometry.obstacles import ObstacleMap
from leafcut.message import Message
from leafcut.model.cutting import Cut
from leafcut.model.issue import Issue, Severity
from leafcut.model.sheet import Sheet

#: Penalty for a move that crosses a detached part, in seconds or mm, for comparing orders.
HIT = 60.0
#: Penalty for a move in which the rim of the head passes over a detached part but its centre does not, in seconds or
#: mm.
CLOSE = 15.0
#: Maximum number of attempts to postpone an outline.
MOST_MOVES = 400

#: A route of the head: its corners, and its penalty, which is 0, `CLOSE` or `HIT`.
HeadRoute = tuple[tuple[Point, ...], float]


@dataclass(frozen=True)
class HeadRoutes:
    """Routes of the cutting head between the cuts.

    Attributes
    ----------
    corners
        Corners of each detour, keyed by the index of the next cut. The key of the detour to the end point is the number
        of cuts.
    crossing
        Indices of the cuts whose travel move still crosses a detached part.
    close
        Indices of the cuts whose travel move passes a detached part at less than the radius of the head.
    moves
        Number of travel moves.
    radius
        Radius of the head, mm.
    """

    corners: dict[int, list[Point]] = field(default_factory=dict)
    crossing: tuple[int, ...] = ()
    close: tuple[int, ...] = ()
    moves: int = 0
    radius: float = 0.0

    def crossing_issue(self, cuts: Sequence[Cut]) -> Issue | None:
        """Warn about moves that cross detached parts or come close to them.

        If there are only detours, the result is a note; if there are none, it is None.
        """
        if not (self.crossing or self.close or self.corners):
            return None
        detours = Message("{} of {} travel moves go around detached parts", len(self.corners), self.moves)
        unknown = (
            Message(
                "; the nozzle diameter is unknown (nozzle_diameter in the machine's profile), so only the head's "
                "centre is checked"
            )
            if self.radius <= 0.0
            else ""
        )
        if not (self.crossing or self.close):
            words = Message("the head stays down between cuts; {}, and none crosses such a part{}", detours, unknown)
            return Issue("L623", words, "", Severity.NOTE)
        first = min((*self.crossing, *self.close))
        x, y = cuts[min(first, len(cuts) - 1)].path.start
        crossing, close = len(self.crossing), len(self.close)
        over = [Message("{} of {} travel moves cross detached parts", crossing, self.moves)] if crossing else []
        if close:
            more = (
                count_of(close, "more travel move") if crossing else Message("{} of {} travel moves", close, self.moves)
            )
            over.append(Message("a nozzle of {:g} mm passes over detached parts on {}", 2.0 * self.radius, more))
        words = Message(
            "the head stays down between cuts, and {}; detached parts may tip up ({}){}; hold them with "
            "--micro-joints, or watch them",
            Message.joined_by_and(over),
            detours,
            unknown,
        )
        return Issue("L623", words, Message("the first on the move to ({:.4g}, {:.4g})", x, y))


class DetachableParts:
    """The parts of a sheet as obstacles for a head with the given radius, mm.

    The centre of the head never crosses a clamp.
    """

    def __init__(self, sheet: Sheet, radius: float = 0.0) -> None:
        self.sheet, self.radius = sheet, radius
        outlines = {
            k: shapely.Polygon(c.path.flattened(0.05))
            for k, c in enumerate(sheet.contours)
            if c.depth % 2 == 0 and c.path.closed and c.kind == "cut"
        }
        self.map = ObstacleMap(outlines, {-1 - z: shapely.box(*zone) for z, zone in enumerate(sheet.zones)})

    def detached_by(self, cut: Cut) -> list[int]:
        """Return the outlines that a cut detaches.

        Common lines, and outlines with micro-joints, do not detach a part.
        """
        if cut.kind != "cut" or cut.joints or cut.common:
            return []
        return [k for k in cut.contours if k in self.map.shapes]

    def route(self, a: Point, b: Point, detached: set[int]) -> HeadRoute:
        """Find the best route for the head, and return it with its penalty.

        The whole head stays clear of detached parts if possible. If not, at least the centre of the head does. If that
        is also impossible, the route crosses parts.
        """
        if not self.map.polygons_approached(a, b, self.radius) & detached:
            return (), 0.0
        if self.radius > 0.0:
            wide = self.map.path_around(a, b, detached, self.radius)
            if wide is not None:
                return tuple(wide), 0.0
        if not self.map.polygons_crossed(a, b) & detached:
            return (), CLOSE
        narrow = self.map.path_around(a, b, detached, 0.0)
        if narrow is None:
            return (), HIT
        return tuple(narrow), CLOSE if self.radius > 0.0 else 0.0

    def routes(self, cuts: Sequence[Cut], start: Point | None, end: Point | None) -> HeadRoutes:
        """Find the routes between all cuts. `start` and `end` are the first and last position of the head, or None."""
        starts = [start, *(cut.path.end for cut in cuts)]
        moves = [*zip(starts, (cut.path.start for cut in cuts), strict=False)]
        if end is not None and cuts:
            moves.append((starts[-1], end))
        detached: set[int] = set()
        corners: dict[int, list[Point]] = {}
        crossing, close = [], []
        for k, (a, b) in enumerate(moves):
            if a is not None:
                turns, penalty = self.route(a, b, detached)
                if turns:
                    corners[k] = list(turns)
                if penalty == HIT:
                    crossing.append(k)
                elif penalty == CLOSE:
                    close.append(k)
            if k < len(cuts):
                detached |= set(self.detached_by(cuts[k]))
        count = sum(a is not None for a, _ in moves)
        return HeadRoutes(corners, tuple(crossing), tuple(close), count, self.radius)


def cut_outlines_later(
    parts: DetachableParts,
    cuts: Sequence[Cut],
    pairs: Iterable[tuple[int, int]],
    cost: Callable[[Point, Point], float],
    late: Callable[[], bool] = lambda: False,
) -> list[int]:
    """Postpone outlines until after the moves across their parts, if this reduces the cost.

    Parameters
    ----------
    pairs
        Precedence pairs (before, after), as indices of `cuts`.
    cost
        Function that returns the cost of a straight move, in seconds or mm.
    late
        Function that returns True when the search has to stop. It is called between two attempts.

    Returns
    -------
    list of int
        The new order, as indices of `cuts`.
    """
    detaches = [frozenset(parts.detached_by(cut)) for cut in cuts]
    before: dict[int, set[int]] = {}
    for a, b in pairs:
        before.setdefault(a, set()).add(b)
    known: dict[tuple[int, int, frozenset[int]], float] = {}

    def met(a: int, b: int) -> frozenset[int]:
        return parts.map.polygons_approached(cuts[a].path.end, cuts[b].path.start, parts.radius)

    def move_cost(a: int, b: int, detached: set[int]) -> float:
        key = (a, b, met(a, b) & detached)
        if key not in known:
            begin, goal = cuts[a].path.end, cuts[b].path.start
            turns, penalty = parts.route(begin, goal, detached)
            known[key] = sum(cost(p, q) for p, q in pairwise([begin, *turns, goal])) + penalty
        return known[key]

    def travel_cost(order: Sequence[int], first: int, last: int, detached: set[int]) -> float:
        """Return the cost of the travel moves to the cuts at positions `first` to `last` of an order.

        `detached` contains the parts that are already detached when these moves start.
        """
        total = 0.0
        for place in range(first, min(last + 1, len(order))):
            total += move_cost(order[place - 1], order[place], detached) if place else 0.0
            detached = detached | detaches[order[place]]
        return total

    order = list(range(len(cuts)))
    tried, place = 0, 1
    while place < len(order) and tried < MOST_MOVES and not late():
        hit = met(order[place - 1], order[place])
        detached_at = {part: at for at, k in enumerate(order[:place]) for part in detaches[k]} if hit else {}
        for at in sorted({detached_at[part] for part in hit & detached_at.keys()}):
            moved, between = order[at], order[at + 1 : place + 1]
            if not before.get(moved, set()).isdisjoint(between):
                continue
            other = [*order[:at], *between, moved, *order[place + 1 :]]
            tried += 1
            # All other moves are the same in both orders.
            detached = {part for part, cut in detached_at.items() if cut < at}
            if travel_cost(other, at, place + 1, detached) < travel_cost(order, at, place + 1, detached) - 1e-9:
                order, place = other, max(at - 1, 0)
                break
        place += 1
    return order
