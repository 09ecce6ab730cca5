"""Chains: several closed cuts with one pierce, the torch burning on through the scrap from one to the next.

Which contours follow each other, and where each is begun, is a routing problem of its own: a cluster is a contour, a
node a place on it, and from node to node it costs a bridge, or what it takes to rise, go there and pierce anew. Along
the order found, the places are chosen once more, so that no two bridges lie beside each other where they meet; what
crosses is taken apart. A chain is then one cluster of the order of all cuts.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.processes.sheet.plan.chains.bridges import Bridges, ChainPlaces, clockwise_of, find_bridges, joins, left_at
from leafcut.processes.sheet.plan.chains.chain_starts import Chain, Link, chain_starts, starts_beside
from leafcut.processes.sheet.plan.cut_contours import ROUNDING

if TYPE_CHECKING:
    from leafcut.model.cutting import CutChoice, PlanFile
    from leafcut.processes.sheet.options import CutOptions
    from leafcut.processes.sheet.plan.cutting import Cutting
    from leafcut.processes.sheet.plan.leads.cut_starts import CutStart
    from leafcut.processes.sheet.plan.leads.leads import Scrap

#: Where two bridges meet on a contour they are this far apart at least, rad: the sliver between them must not melt.
LEAST_ANGLE = math.radians(40.0)
#: Contours of one chain at most.
MOST_CONTOURS = 12
#: Contours of one search at most.
BLOCK = 400


@dataclass(frozen=True, eq=False)
class ChainProblem:
    """The routing problem of chains, the bridges it may use, and what each saves, s."""

    problem: RoutingProblem
    bridges: Bridges
    saving: dict[tuple[int, int], float]


def pierce_seconds(cutting: Cutting, overhead: float) -> float:
    """Return what a pierce costs with all that goes with it, leads included, s; without the way to it."""
    rules = cutting.rules
    leads = (rules.lead_in.length + rules.lead_out.length) / rules.data.feed
    return rules.data.pierce_delay + overhead + leads


def chain_problem(
    cutting: Cutting,
    options: CutOptions,
    overhead: float,
    rapid: float,
    members: Sequence[int],
) -> ChainProblem | None:
    """Return the problem of which contours of a block (`chain_blocks`) to chain; None where no bridge would save time.

    Parameters
    ----------
    overhead
        What each cut takes to come down and to rise, s.
    rapid
        Velocity of rapids, mm/s.
    """
    feed = cutting.rules.data.feed
    single = pierce_seconds(cutting, overhead)
    # A bridge of length d costs d / feed, a pierce the rapid of about d besides.
    reach = single / max(1.0 / feed - 1.0 / rapid, 1e-9)
    found = find_bridges(cutting.contours, members, cutting.scrap, reach)
    saving = {
        (a, b): single + length / rapid - length / feed
        for a, b, length in zip(found.begin.tolist(), found.end.tolist(), found.length.tolist(), strict=True)
    }
    saving = {pair: s for pair, s in saving.items() if s > 0.0}
    return None if not saving else ChainProblem(_routing(found, saving, single, rapid), found, saving)


def chain_blocks(cutting: Cutting, bands: Sequence[Sequence[int]], taken: Sequence[Chain] = ()) -> list[list[int]]:
    """Return the contours that can be in a chain, in blocks of neighbours that are not too many for one search.

    They are closed, no small holes, in no chain of `taken`, and nothing that a plan file fixes. A block is in one of
    `bands` (`cutting.bands`), since a chain stays within one.
    """
    held = {k for pair in cutting.order for k in pair} | set(cutting.fixed)
    held |= {link.contour for chain in taken for link in chain}
    blocks: list[list[int]] = []
    for band in bands:
        own = [
            k
            for k in band
            if k not in held and cutting.contours[k].has_leads and not cutting.contours[k].is_small(cutting.rules)
        ]
        own.sort(key=lambda k: cutting.contours[k].path.extents[0])
        count = max(math.ceil(len(own) / BLOCK), 1)
        blocks += [own[len(own) * n // count : len(own) * (n + 1) // count] for n in range(count)]
    return [block for block in blocks if len(block) > 1]


def _routing(found: Bridges, saving: dict[tuple[int, int], float], single: float, rapid: float) -> RoutingProblem:
    places = found.places
    step = places.arrive[None] - places.leave[:, None]
    costs = single + np.hypot(step[..., 0], step[..., 1]) / rapid
    for (a, b), saved in saving.items():
        costs[a, b] -= saved
    _, cluster = np.unique(places.contour, return_inverse=True)
    n = len(places.contour)
    return RoutingProblem(
        places.arrive, places.leave, cluster.astype(np.int32), np.zeros(n), Metric("EXPLICIT", matrix=costs)
    )


def chains_of(
    cutting: Cutting, of: ChainProblem, nodes: Sequence[int], options: CutOptions, before: Sequence[Chain] = ()
) -> list[Chain]:
    """Return the chains in a solution, without the bridges that cannot be made beside the others.

    `before` are chains that there are already.
    """
    places = of.bridges.places
    nodes = _best_places(of, [int(places.contour[n]) for n in nodes])
    taken = [(a, b) for a, b in itertools.pairwise(nodes) if (a, b) in of.saving]
    link = {n: link_at(cutting, int(places.contour[n]), float(places.at[n])) for n in nodes}
    kept: list[tuple[int, int]] = []
    planned = [(a.leave, b.arrive) for chain in before for a, b in itertools.pairwise(chain)]
    for pair in sorted(taken, key=lambda p: (-of.saving[p], p)):
        bridge = (link[pair[0]].leave, link[pair[1]].arrive)
        others = [*planned, *((link[a].leave, link[b].arrive) for a, b in kept)]
        if all(_go_together(bridge, other, cutting.rules.kerf) for other in others):
            kept.append(pair)
    return [
        tuple(link[n] for n in run) for whole in _runs(nodes, set(kept)) for run in _short_enough(whole) if len(run) > 1
    ]


def link_at(cutting: Cutting, contour: int, at: float, clockwise: bool | None = None) -> Link:
    """Return a place of a chain; None: the contour runs in the direction that the rules ask for."""
    c, rules = cutting.contours[contour], cutting.rules
    way = clockwise_of(c, rules) if clockwise is None else clockwise
    return Link(contour, at, c.path.point_at(at), c.path.point_at(left_at(c, at, way, rules)), way)


def planned_chains(cutting: Cutting, plan: PlanFile, *, everything: bool = False) -> list[Chain]:
    """Return the chains of a plan file: those it fixes, or `everything`: all.

    Raises
    ------
    PlanError
        A bridge of the plan cannot be made: says to which cut.
    """
    position = {c.index: k for k, c in enumerate(cutting.contours)}
    chains: list[list[Link]] = []
    if plan.cuts and plan.cuts[0].bridge and (everything or "bridge" in plan.cuts[0].fixed):
        raise PlanError(f"{plan.source}: cut 1: no cut precedes it, so it cannot have a bridge")
    for number, (before, choice) in enumerate(itertools.pairwise(plan.cuts), 2):
        if not choice.bridge or not (everything or "bridge" in choice.fixed):
            continue
        ends = [_planned_link(cutting, position, c) for c in (before, choice)]
        a, b = ends
        if (
            a is None
            or b is None
            or not joins(cutting.contours, (a.contour, b.contour), (a.leave, b.arrive), cutting.scrap)
        ):
            raise PlanError(f"{plan.source}: cut {number}: no path through the scrap leads to it from the cut before")
        if chains and chains[-1][-1].contour == a.contour:
            chains[-1].append(b)
        else:
            chains.append([a, b])
    return [tuple(chain) for chain in chains]


def _planned_link(cutting: Cutting, position: dict[int, int], choice: CutChoice) -> Link | None:
    k = position.get(choice.contours[0], -1)
    if k < 0 or choice.start is None or not cutting.contours[k].has_leads:
        return None
    contour = cutting.contours[k]
    share = float(shapely.line_locate_point(contour.line, shapely.Point(*choice.start), normalized=True))
    way = {"clockwise": True, "counter-clockwise": False}.get(choice.direction)
    return link_at(cutting, k, share * contour.path.length, way)


def _best_places(of: ChainProblem, order: Sequence[int]) -> list[int]:
    """Return the place of every contour, in a given order, with which bridges save most and none meet too sharply.

    Exact, by dynamic programming: what may follow depends on a place and on the bridge by which it was come to.
    """
    places = of.bridges.places
    out: dict[int, list[int]] = {}
    for a, b in of.saving:
        out.setdefault(a, []).append(b)
    at = {k: np.flatnonzero(places.contour == k).tolist() for k in order}
    State = tuple[int, int]  # place, and the place that the bridge came from; -1 for none
    best: dict[State, float] = {(p, -1): 0.0 for p in at[order[0]]}
    came: list[dict[State, State]] = []
    for k in order[1:]:
        last = max(best, key=lambda s: best[s])
        after: dict[State, float] = {(q, -1): best[last] for q in at[k]}
        back: dict[State, State] = dict.fromkeys(after, last)
        inside = set(at[k])
        for (p, before), value in best.items():
            for q in out.get(p, ()):
                if q not in inside or (before >= 0 and not _meet(places, before, p, q)):
                    continue
                if value + of.saving[p, q] > after.get((q, p), -math.inf):
                    after[q, p] = value + of.saving[p, q]
                    back[q, p] = (p, before)
        came.append(back)
        best = after
    path = [max(best, key=lambda s: best[s])]
    for back in reversed(came):
        path.append(back[path[-1]])
    return [place for place, _ in reversed(path)]


def _meet(places: ChainPlaces, before: int, place: int, after: int) -> bool:
    """Return whether the bridges to a place and from it are far enough apart."""
    came = _towards(_xy(places.arrive[place]), _xy(places.leave[before]))
    goes = _towards(_xy(places.leave[place]), _xy(places.arrive[after]))
    return math.acos(max(-1.0, min(1.0, came[0] * goes[0] + came[1] * goes[1]))) >= LEAST_ANGLE


def _xy(place: NDArray[np.float64]) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _runs(nodes: Sequence[int], kept: set[tuple[int, int]]) -> Iterable[list[int]]:
    """Yield the stretches of a path that bridges hold together."""
    run = [nodes[0]]
    for a, b in itertools.pairwise(nodes):
        if (a, b) not in kept:
            yield run
            run = []
        run.append(b)
    yield run


def _short_enough(run: list[int]) -> Iterable[list[int]]:
    """Yield a run in parts of at most `MOST_CONTOURS`, about equally long."""
    parts = math.ceil(len(run) / MOST_CONTOURS)
    for k in range(parts):
        yield run[len(run) * k // parts : len(run) * (k + 1) // parts]


Crossing = tuple[tuple[float, float], tuple[float, float]]


def _go_together(one: Crossing, other: Crossing, kerf: float) -> bool:
    """Return whether two bridges keep their kerfs apart, or only meet where one contour is left and come to."""
    if one[0] == other[1] or one[1] == other[0]:
        meet, p, q = (one[0], one[1], other[0]) if one[0] == other[1] else (one[1], one[0], other[1])
        (ux, uy), (vx, vy) = _towards(meet, p), _towards(meet, q)
        return math.acos(max(-1.0, min(1.0, ux * vx + uy * vy))) >= LEAST_ANGLE
    away: float = shapely.distance(shapely.LineString(one), shapely.LineString(other))
    return away >= kerf - ROUNDING


def _towards(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    length = max(math.dist(a, b), 1e-9)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def with_chains(cutting: Cutting, chains: Sequence[Chain]) -> Cutting:
    """Return the cutting with chains as starts of their first contour; other cuts keep away from the bridges.

    A bridge that leaves no room for a lead is taken out.
    """
    chains = list(chains)
    while chains:
        scrap = _bridged(cutting, chains)
        starts: dict[int, list[CutStart]] = {}
        for number, chain in enumerate(chains):
            own = chain_starts(cutting, chain, scrap) or chain_starts(cutting, _turned(cutting, chain), scrap)
            if not own:
                chains[number : number + 1] = [chain[1:]] if len(chain) > 2 else []
                break
            starts[own[0].contour] = own
        else:
            members = {link.contour for chain in chains for link in chain}
            stuck = _singles(cutting, scrap, members, starts)
            if stuck is None:
                rows = [s for k in sorted(starts) for s in starts[k]]
                return replace(cutting, scrap=scrap, starts=rows)
            chains = _without_nearest(cutting, chains, stuck)
    return cutting


def _bridged(cutting: Cutting, chains: Sequence[Chain]) -> Scrap:
    pairs = [pair for chain in chains for pair in itertools.pairwise(chain)]
    lines = shapely.linestrings(np.array([[a.leave, b.arrive] for a, b in pairs]))
    index = [[cutting.contours[k].index for k in (a.contour, b.contour)] for a, b in pairs]
    return cutting.scrap.with_bridges(lines, np.array(index, dtype=np.int64))


def _turned(cutting: Cutting, chain: Chain) -> Chain:
    """Return a chain the other way round; as it is where it ends with a hole, or where that is left elsewhere."""
    if cutting.contours[chain[-1].contour].hole or any(link.arrive != link.leave for link in chain):
        return chain
    return chain[::-1]


def _singles(cutting: Cutting, scrap: Scrap, members: set[int], starts: dict[int, list[CutStart]]) -> int | None:
    """Put the starts of all other contours into `starts`; return the first contour that has none any more."""
    for k in range(len(cutting.contours)):
        if k not in members:
            starts[k] = starts_beside(cutting, k, scrap)
            if not starts[k] and cutting.by_contour[k]:
                return k
    return None


def _without_nearest(cutting: Cutting, chains: Sequence[Chain], stuck: int) -> list[Chain]:
    """Return the chains without the bridge that is nearest to a contour."""
    line = cutting.contours[stuck].line
    ways = [(n, i) for n, chain in enumerate(chains) for i in range(len(chain) - 1)]
    away = [shapely.distance(line, shapely.LineString([chains[n][i].leave, chains[n][i + 1].arrive])) for n, i in ways]
    number, i = ways[int(np.argmin(away))]
    parts = [chains[number][: i + 1], chains[number][i + 1 :]]
    return [*chains[:number], *(p for p in parts if len(p) > 1), *chains[number + 1 :]]
