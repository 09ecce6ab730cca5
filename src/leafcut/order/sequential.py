"""Paths with a direction: nodes left elsewhere than entered, costs by direction, and clusters that precede others.

One path is kicked at one place at a time, mended there by exchanges that keep the precedence, and taken back if it got
longer, as in `order.kicks`. Now and then it may get longer for a while, so that it comes away from where it stands:
with directions and precedence kept, there are many more paths than without that no exchange makes shorter.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from leafcut.geometry.arrays import Ints
from leafcut.kernels.directed import lay_route
from leafcut.kernels.layers import Clusters
from leafcut.kernels.route import BLOCK, RING, TWISTED, Route, begin_bias
from leafcut.kernels.sequential import improve_route, kick_route
from leafcut.order.annealing import Forgetting, is_small
from leafcut.order.construction import random_words
from leafcut.order.directed import DirectedInstance
from leafcut.order.kicks import LONGEST_REWRITE, OFFER_EVERY, kicks_per_iteration
from leafcut.order.statistics import Best

#: Candidates of each node, and how many of them are tried for the first and for the second new way of an exchange.
#: Measured on contours whose holes come first: 12 and 16 are far better than 8, which are mostly their own holes.
CANDIDATES, BREADTH = 16, (16, 8)

#: A preset is a budget of kicks: per node, fewest and most.
PRESETS = {"fast": (60, 5e3, 1e5), "default": (250, 2e4, 5e5), "thorough": (2000, 1e5, math.inf)}

#: Kicks per node before the path may get longer; then by turns so many in which it may, and so many in which not.
FIRST_COLD, HOT, COLD = 10, 1, 4

#: How much longer a kick may make the path in hot times, in mean ways between nodes: by turns. What of it is best
#: depends on how much precedence there is; more of it was better with more.
HEATS = (0.3, 1.0, 3.0)

#: After so many turns without a better path the search goes back to the best one.
TURNS_AWAY = 2

#: A gain less than this part of a mean way is rounding.
LEAST = 1e-8

#: A turn has as many kicks as if there were so many nodes at least.
FEWEST_KICKS = 50

#: Kicks per node before pieces of the path are forgotten for the first time.
PHASE = 50

#: How much longer a greedy path is than one that was improved, at most: what it has more are ways not allowed.
GREEDY = 1.5

#: Exchanges looked for between two looks at the clock in the first improvement: some ten milliseconds.
LOOKS = 5000

#: What a kick takes for each square root of the nodes, s: about as much as it took on one core of 2024, from 30
#: nodes to 3000. A counted cost and not the clock, so that answers stay the same.
SECONDS_PER_KICK = 5e-6


def route_of(instance: DirectedInstance, node: Ints, enter: Ints, log: int = 0) -> Route:
    """Return a path int32[n], whose nodes are entered at int32[n], with all that the kernels need to work on it.

    No node is in the queue; the log has room for that many entries.
    """
    n = instance.n
    leave = enter + np.int32(instance.rules.beyond[0])
    if instance.anchored:
        leave[n - 1] = instance.leave[n - 1]
    route = Route(
        node=node.copy(),
        place=np.zeros(n, dtype=np.int32),
        enter=enter.copy(),
        leave=leave,
        bias=np.zeros(n),
        shift=np.zeros((n >> BLOCK) + 1),
        flags=np.zeros(2, dtype=np.int64),
        queue=np.zeros(n, dtype=np.int32),
        queued=np.zeros(n, dtype=np.uint8),
        counts=np.zeros(4, dtype=np.int64),
        log=np.zeros(log, dtype=np.int32),
        buffer=np.zeros(n, dtype=np.int32),
        move=np.zeros(6, dtype=np.int64),
    )
    route.place[node] = np.arange(n, dtype=np.int32)
    route.flags[TWISTED], route.flags[RING] = instance.twisted, not instance.anchored
    return route


def greedy_path(instance: DirectedInstance) -> Route:
    """Return the path that always goes on to the cheapest cluster that may come next."""
    n, rules = instance.n, instance.rules
    missing = np.diff(rules.before_begin).astype(np.int32)
    free = np.flatnonzero(missing == 0).astype(np.int32)
    first = n - 1 if instance.anchored else int(free[0])
    free = free[free != first]
    waiting, spot = np.full(n, -1, dtype=np.int32), np.full(n, -1, dtype=np.int32)
    waiting[: len(free)], spot[free] = free, np.arange(len(free), dtype=np.int32)
    route = route_of(instance, np.full(n, first, dtype=np.int32), instance.enter)
    lay_route(instance.cost, route, rules, waiting, spot, missing)
    return route


def budget(preset: str, clusters: int) -> float:
    """Return the kicks that a preset stands for."""
    per_node, fewest, most = PRESETS[preset]
    return min(max(per_node * clusters, fewest), most)


class PathSearch:
    """The search of one path: the one that is worked on, the best one, and how far the search has got.

    `iteration` counts runs of up to `kicks_per_iteration` kicks, `kicks` all of them.
    """

    def __init__(
        self, instance: DirectedInstance, seed: int, best: Best, number: int = 0, layers: Clusters | None = None,
        alone: bool = True,
    ) -> None:  # fmt: skip
        """Begin; of several searches that share `best` and `layers`, each has a number, and none is `alone`."""
        self.instance, self.stop, self.best, self.layers = instance, best.stop, best, layers
        self.alone = alone
        self.words, self.number = random_words(seed, number, count=1), number
        self.breadth = np.array(BREADTH, dtype=np.int64)
        self.iteration = self.kicks = 0
        self.shortest = math.inf

    def run(self, most: float, start: Route, phase: float = PHASE) -> int:
        """Improve a path, the greedy one, to a local optimum and then kick by kick, until `stop` or `most` kicks.

        Where the problem is small, by turns: kick by kick, and forgetting pieces of the path while cooling down; first
        with `phase` kicks per node, then twice as many each time. Return the iterations made. What comes out depends on
        the seed and on their number only.
        """
        instance = self.instance
        self.route = route_of(instance, start.node, start.enter, log=3 * instance.n + 1000)
        self._offer()
        self.mean = self._mean_way()
        self.least = LEAST * self.mean
        self._descend()
        self.mean = min(self.mean, self._mean_way() * GREEDY)
        if self.best.cost < self.cost:
            self._take_up(self.best.tour)
        self._is_worth()
        forgetting = Forgetting(instance, self.words, self.layers) if is_small(instance) else None
        kicks = phase * max(instance.n, FEWEST_KICKS) if forgetting else math.inf
        while True:
            self._kick_by_turns(min(kicks, most - self.kicks))
            if forgetting is None or self._is_over(most):
                return self.iteration
            self._forget(forgetting, int(min(kicks, most - self.kicks)))
            if self._is_over(most):
                return self.iteration
            kicks *= 2

    def _is_over(self, most: float) -> bool:
        reached = self.stop.reached(self.iteration, self.iteration - self.best.iteration)
        return self.kicks >= most or reached or not self._is_worth()

    def _is_worth(self) -> bool:
        """Return whether more kicks are worth their seconds; of several searches, whose time the clock ends, always."""
        seconds = SECONDS_PER_KICK * math.sqrt(self.instance.n) * self.kicks
        return not self.alone or self.stop.thrift.goes_on(seconds, self.best.cost)

    def _mean_way(self) -> float:
        """Return what going from one node to the next costs in the mean, without the work itself."""
        rules, route = self.instance.rules, self.route
        return max(self.cost - float(rules.service[route.enter].sum()), 0.0) / self.instance.n

    def _kick_by_turns(self, most: float) -> None:
        """Kick by turns so that the path may get longer or not, until `stop` or `most` kicks more."""
        away, most = 0, most + self.kicks
        for heat, kicks in _turns(max(self.instance.n, FEWEST_KICKS)):
            before = self.best.cost
            self._kick(heat, min(kicks, most - self.kicks))
            if self._is_over(most):
                return
            if heat == 0.0:
                away = 0 if self.best.cost < before else away + 1
                if away >= TURNS_AWAY:
                    self._take_up(self.best.tour)
                    away = 0

    def _forget(self, forgetting: Forgetting, steps: int) -> None:
        """Cool down from the best path in so many steps, and take up what comes out; a step counts as a kick."""

        def go_on(made: int) -> bool:
            self.iteration, self.kicks = self.iteration + 1, self.kicks + made
            self._tell(self.iteration)
            return not self.stop.reached(self.iteration, self.iteration - self.best.iteration)

        found = forgetting.cool_down(self.best.tour, self.mean, steps, self.least, go_on)
        self._take_up(found)
        self._offer()

    def _descend(self) -> None:
        """Improve the path until no exchange helps: first by those that write little, which most do."""
        instance, route = self.instance, self.route._replace(log=np.zeros(0, dtype=np.int32))
        offered = self.stop.elapsed()
        for longest in (LONGEST_REWRITE, instance.n):
            working = route._replace(buffer=route.buffer[:longest])
            route.queue[:], route.queued[:] = route.node, 1
            route.counts[:2] = 0, instance.n
            begin_bias(instance.cost, route)
            while route.counts[1] > 0 and not self.stop.now():
                self.cost -= improve_route(instance.cost, working, instance.rules, self.breadth, self.least, LOOKS)
                if self.stop.elapsed() > offered + OFFER_EVERY:
                    self._offer()
                    self._tell(0)
                    offered = self.stop.elapsed()
        route.queued[:], route.counts[:] = 0, 0
        self._offer()

    def _kick(self, heat: float, kicks: float) -> None:
        """Make so many kicks, and offer every path that is better than the best."""
        instance, stop, best = self.instance, self.stop, self.best
        at_once = kicks_per_iteration(instance.n)
        while kicks > 0 and not stop.reached(self.iteration, self.iteration - best.iteration):
            count = int(min(at_once, kicks))
            self.cost -= kick_route(
                instance.cost,
                self.route,
                instance.rules,
                self.breadth,
                self.least,
                heat * self.mean,
                self.words,
                0,
                count,
            )
            self.iteration, self.kicks, kicks = self.iteration + 1, self.kicks + count, kicks - count
            if self.cost < best.cost - self.least:
                self._offer()
            self._tell(self.iteration)
            if not self._is_worth():
                return

    def _tell(self, iteration: int) -> None:
        """Report how far the search is, for the first of several."""
        if self.number == 0:
            self.best.tell(iteration, alone=self.alone)

    def _offer(self) -> None:
        """Add the path up, and offer it."""
        route, instance = self.route, self.instance
        self.cost = instance.length(route.node, route.enter, route.leave)
        self.shortest = min(self.shortest, self.cost)
        self.best.offer(instance.nodes(route.node, route.enter), self.cost, self.iteration)

    def _take_up(self, nodes: Ints) -> None:
        """Go on with a path given by the problem's nodes int32[clusters]."""
        route, instance = self.route, self.instance
        again = route_of(instance, *instance.path_of(nodes))
        for name in ("node", "place", "enter", "leave"):
            getattr(route, name)[:] = getattr(again, name)
        self.cost = instance.length(route.node, route.enter, route.leave)


def _turns(n: int) -> Iterator[tuple[float, int]]:
    """Yield, without end, how much longer the path may get at a kick, and for how many kicks."""
    yield 0.0, FIRST_COLD * n
    for heat in itertools.cycle(HEATS):
        yield heat, HOT * n
        yield 0.0, COLD * n
