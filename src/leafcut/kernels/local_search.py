"""2-opt and Or-opt on candidate lists with a queue of nodes to examine.

A tour is an array of nodes and `place`, the position of every node. All moves consist of one primitive, a 2-opt
exchange given by its four nodes, which reverses the shorter side, so the direction of the array never matters.
"""

from __future__ import annotations

from numpy.typing import NDArray

from leafcut.kernels import EPSILON, kernel, part
from leafcut.kernels.cost import CostModel, travel

#: Maximum length of a run moved by Or-opt (Or 1976).
LONGEST_SEGMENT = 3


@part
def beside(tour: NDArray, place: NDArray, node: int, forward: bool) -> int:
    """Return the node after (or before) `node`."""
    n = len(tour)
    index = place[node] + (1 if forward else -1)
    if index == n:
        index = 0
    return int(tour[index])  # -1 is the last node


@part
def reverse(tour: NDArray, place: NDArray, first: int, last: int) -> None:
    """Reverse the run of positions first … last (wrapping around if last < first), or the rest if that is shorter.
    Changes: tour, place.
    """
    n = len(tour)
    length = last - first + 1
    if length <= 0:
        length += n
    if 2 * length > n:
        first, last, length = last + 1, first - 1, n - length
        if first == n:
            first = 0
        if last < 0:
            last = n - 1
    for _ in range(length // 2):
        a, b = tour[first], tour[last]
        tour[first], place[b] = b, first
        tour[last], place[a] = a, last
        first += 1
        if first == n:
            first = 0
        last -= 1
        if last < 0:
            last = n - 1


@part
def exchange(tour: NDArray, place: NDArray, a: int, b: int, c: int, d: int) -> None:
    """Replace the edges a–b and c–d by a–c and b–d, where b follows a and d follows c in the same direction. Changes:
    tour, place.
    """
    if beside(tour, place, a, True) == b and beside(tour, place, c, True) == d:
        reverse(tour, place, place[b], place[c])
    else:
        reverse(tour, place, place[c], place[b])


@part
def _push(queue: NDArray, queued: NDArray, state: NDArray, node: int) -> None:
    if queued[node] == 0:
        queued[node] = 1
        n = len(queue)
        tail = state[0] + state[1]
        queue[tail - n if tail >= n else tail] = node
        state[1] += 1


@part
def two_opt_move(cost: CostModel, tour: NDArray, place: NDArray, candidates: NDArray, a: int, touched: NDArray) -> bool:
    """Make the first improving 2-opt move at node a. Changes: tour, place, touched int32[≥4] (its four nodes)."""
    for direction in range(2):
        forward = direction == 0
        b = beside(tour, place, a, forward)
        old = travel(cost, a, b)
        for k in range(candidates.shape[1]):
            c = candidates[a, k]
            if c < 0:
                break
            gain = old - travel(cost, a, c)
            if gain <= EPSILON:
                break
            d = beside(tour, place, c, forward)
            if c == b or d == a:
                continue
            if gain + travel(cost, c, d) - travel(cost, b, d) > EPSILON:
                exchange(tour, place, a, b, c, d)
                touched[0], touched[1], touched[2], touched[3] = a, b, c, d
                return True
    return False


@part
def _within(tour: NDArray, place: NDArray, a: int, length: int, forward: bool, node: int) -> bool:
    n = len(tour)
    offset = place[node] - place[a] if forward else place[a] - place[node]
    if offset < 0:
        offset += n
    return bool(offset < length)


@part
def or_opt_move(cost: CostModel, tour: NDArray, place: NDArray, candidates: NDArray, a: int, touched: NDArray) -> bool:
    """Move a run of 1 … 3 nodes that starts at a to a better position, in either direction, if that improves the tour.

    Symbols: the run is a … e, p the node before a, q the node after e; it goes between c and d, with a next to c.
    Changes: tour, place, touched int32[≥6].
    Source: I. Or, PhD thesis, Northwestern University 1976.
    """
    for direction in range(2):
        forward = direction == 0
        p = beside(tour, place, a, not forward)
        e = a
        for length in range(1, LONGEST_SEGMENT + 1):
            if length > 1:
                e = beside(tour, place, e, forward)
            q = beside(tour, place, e, forward)
            removed = travel(cost, p, a) + travel(cost, e, q) - travel(cost, p, q)
            for k in range(candidates.shape[1]):
                c = candidates[a, k]
                if c < 0:
                    break
                gain = removed - travel(cost, a, c)
                if gain <= EPSILON:
                    break
                if _within(tour, place, a, length, forward, c):
                    continue
                for side in range(2):
                    d = beside(tour, place, c, forward if side == 0 else not forward)
                    if _within(tour, place, a, length, forward, d):
                        continue
                    if gain + travel(cost, c, d) - travel(cost, e, d) > EPSILON:
                        _move_run(tour, place, p, a, e, q, c, d, side == 0)
                        touched[0], touched[1], touched[2] = p, a, e
                        touched[3], touched[4], touched[5] = q, c, d
                        return True
    return False


@part
def _move_run(tour: NDArray, place: NDArray, p: int, a: int, e: int, q: int, c: int, d: int, c_first: bool) -> None:
    """Turn p a…e q … c d into p q … c a…e d (c_first), or p a…e q … d c into p q … d e…a c. Changes: tour, place."""
    if c_first:
        if c != q:
            exchange(tour, place, p, a, c, d)  # p c…q e…a d
            exchange(tour, place, p, c, q, e)  # p q…c e…a d
            exchange(tour, place, c, e, a, d)  # p q…c a…e d
        else:
            exchange(tour, place, p, a, q, d)  # p q e…a d
            exchange(tour, place, q, e, a, d)  # p q a…e d
    else:
        exchange(tour, place, p, a, d, c)  # p d…q e…a c
        exchange(tour, place, p, d, q, e)  # p q…d e…a c


@kernel
def improve(
    cost: CostModel,
    tour: NDArray,
    place: NDArray,
    candidates: NDArray,
    queue: NDArray,
    queued: NDArray,
    state: NDArray,
    touched: NDArray,
    use_or_opt: bool,
    max_moves: int,
) -> int:
    """Improve the tour at the queued nodes until the queue is empty or `max_moves` are made; return their number.

    A node leaves the queue if no move at it improves the tour (its don't-look bit); the ends of every move enter it.

    ========= ========= ===========================================================
    tour      int32[n]  nodes in order; `place` int32[n] is its inverse
    queue     int32[n]  ring buffer; state int64[2] is (first, length)
    queued    uint8[n]  1 for nodes in the queue
    touched   int32[6]  scratch
    ========= ========= ===========================================================

    Changes: all arrays but candidates.
    Source: J. L. Bentley, Fast algorithms for geometric travelling salesman problems, ORSA J. Computing 4 (1992).
    """
    moves = 0
    n = len(queue)
    while state[1] > 0 and moves < max_moves:
        a = queue[state[0]]
        state[0] = state[0] + 1 if state[0] + 1 < n else 0
        state[1] -= 1
        queued[a] = 0
        count = 0
        if two_opt_move(cost, tour, place, candidates, a, touched):
            count = 4
        elif use_or_opt and or_opt_move(cost, tour, place, candidates, a, touched):
            count = 6
        if count > 0:
            moves += 1
            for k in range(count):
                _push(queue, queued, state, touched[k])
    return moves


@kernel
def queue_all(tour: NDArray, place: NDArray, queue: NDArray, queued: NDArray, state: NDArray) -> None:
    """Add every node to the queue in the order of the tour, and set `place`. Changes: all but tour."""
    for k in range(len(tour)):
        place[tour[k]] = k
        queue[k] = tour[k]
        queued[k] = 1
    state[0], state[1] = 0, len(tour)
