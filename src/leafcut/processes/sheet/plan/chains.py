"""Chains: several closed cuts that share a single pierce.

Between the cuts of a chain, the torch stays on and moves along straight bridges through the scrap. A bridge connects
two contours that border on the same piece of scrap. These are either two outlines, both directly on the sheet or both
in the same hole, or an outline and the hole around it. A hole is cut last, because cutting it detaches the scrap. A
bridge must not touch a part, a clamp, or the kerf of a third contour.

The search for chains is a routing problem. Each contour is a cluster, and the positions along the contour are its
nodes. A move between two nodes is either a bridge, or a retract followed by a rapid and a new pierce. Its cost is the
time that it takes. Once the best order is known, the positions are optimised again for that order. If two bridges
cross, the one that saves more time is kept.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Indices, Mask, Point, Points
from leafcut.model.cutting import CutChoice, PlanFile
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.processes.sheet.plan.contours import ROUNDING, CutContour, distance_on_closed_path
from leafcut.processes.sheet.plan.cutting import Cutting
from leafcut.processes.sheet.plan.leads import NO_LEAD, leads_as_lines
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import (
    CutStart,
    edge_starts,
    find_contour_starts,
    fitting_lead_out,
    leads_to_try,
    starts_with_leads,
)

#: Number of samples along a contour, and number of nearest contours to which the search tries to build bridges.
SAMPLES, NEIGHBOURS = 160, 8
#: Maximum number of positions per contour and in total, and distance below which two positions are merged, mm.
PLACES, MOST_PLACES, SAME_PLACE = 16, 3000, 1.0
#: A bridge must leave the kerf of its contour within this distance, in kerf widths.
LEAVES_WITHIN = 3.0
#: Minimum angle between two bridges that meet at the same point of a contour, rad. At smaller angles, the thin sliver
#: of metal between them would melt.
LEAST_ANGLE = math.radians(40.0)
#: Maximum number of contours in a chain, and in a block that one search handles.
MOST_CONTOURS, BLOCK = 12, 400
#: Two positions count as equal if they are this close along a contour, mm.
SAME = 0.01
#: Maximum number of starts of a chain.
MOST_STARTS = 4
#: Number of alternative start positions to try if the leads of a contour would hit a bridge.
NEW_PLACES = 16

#: A chain is a sequence of steps, one per contour. Each bridge leads from the exit of a step to the entry of the next
#: step.
Chain = tuple[CutStart, ...]
Bridge = tuple[Point, Point]


@dataclass(frozen=True, eq=False)
class Bridges:
    """The positions on contours that bridges may use, and the bridges between them, stored as columns.

    There are n positions and m bridges.

    Attributes
    ----------
    contour
        Index of the contour on which each position lies, int64[n].
    at
        Distance of each position along its contour, mm, float64[n].
    arrive, leave
        Points at which a bridge to a position ends, and at which a bridge from it starts, mm, float64[n, 2].
    begin, end
        Indices of the first and last position of each bridge, int64[m].
    length
        Length of each bridge, mm, float64[m].
    saving
        Time that a bridge saves, s, keyed by its two positions. Bridges that save no time are left out.
    """

    contour: Indices
    at: NDArray[np.float64]
    arrive: Points
    leave: Points
    begin: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    end: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    length: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    saving: dict[tuple[int, int], float] = field(default_factory=dict)

    def step(self, cutting: Cutting, n: int) -> CutStart:
        """Return position number `n` as a step of a chain."""
        return chain_step(cutting, int(self.contour[n]), float(self.at[n]))


# -- the search ------------------------------------------------------------------------------------------------------


def chain_blocks(cutting: Cutting, bands: Sequence[Sequence[int]], taken: Sequence[Chain] = ()) -> list[list[int]]:
    """Group the contours that may form chains into blocks small enough for one search.

    All closed contours may form chains, except small holes, contours that a plan file fixes, and contours in the
    existing chains `taken`. Each block contains neighbouring contours from one of the `bands` (`cutting.sweep_bands`).
    """
    held = {k for pair in cutting.order for k in pair} | set(cutting.fixed)
    held |= {step.contour for chain in taken for step in chain}
    blocks: list[list[int]] = []
    for band in bands:
        own = [k for k in band if k not in held and cutting.contours[k].has_leads and not cutting.contours[k].is_small]
        own.sort(key=lambda k: cutting.contours[k].path.extents[0])
        count = max(math.ceil(len(own) / BLOCK), 1)
        blocks += [own[len(own) * n // count : len(own) * (n + 1) // count] for n in range(count)]
    return [block for block in blocks if len(block) > 1]


def chain_problem(
    cutting: Cutting, members: Sequence[int], overhead: float, rapid: float
) -> tuple[RoutingProblem, Bridges] | None:
    """Set up the routing problem for the chains of a block.

    Parameters
    ----------
    members
        A block from `chain_blocks`.
    overhead
        Time to lower and raise the head at each cut, s.
    rapid
        Velocity of rapids, mm/s.

    Returns
    -------
    tuple of RoutingProblem and Bridges, or None
        The problem and the bridges it uses, or None if no bridge saves time.
    """
    rules, feed = cutting.rules, cutting.rules.data.feed
    # Time of a pierce and its leads, without travel.
    single = rules.data.pierce_delay + overhead + (rules.lead_in.length + rules.lead_out.length) / feed
    # A bridge of length d costs d / feed; a separate pierce also requires a rapid of about d.
    reach = single / max(1.0 / feed - 1.0 / rapid, 1e-9)
    found = find_bridges(cutting.contours, members, cutting.scrap, reach)
    saving = {
        (a, b): single + length / rapid - length / feed
        for a, b, length in zip(found.begin.tolist(), found.end.tolist(), found.length.tolist(), strict=True)
    }
    saving = {pair: s for pair, s in saving.items() if s > 0.0}
    if not saving:
        return None
    step = found.arrive[None] - found.leave[:, None]
    costs = single + np.hypot(step[..., 0], step[..., 1]) / rapid
    for (a, b), saved in saving.items():
        costs[a, b] -= saved
    _, cluster = np.unique(found.contour, return_inverse=True)
    service, metric = np.zeros(len(found.contour)), Metric("EXPLICIT", matrix=costs)
    problem = RoutingProblem(found.arrive, found.leave, cluster.astype(np.int32), service, metric)
    return problem, replace(found, saving=saving)


def chains_from_solution(
    cutting: Cutting, bridges: Bridges, nodes: Sequence[int], before: Sequence[Chain] = ()
) -> list[Chain]:
    """Convert a solution of `chain_problem` to chains.

    `nodes` lists the positions in the order of the solution. A bridge is dropped if it conflicts with a better bridge
    or with one of the chains in `before`.
    """
    nodes = _best_positions(bridges, [int(bridges.contour[n]) for n in nodes])
    taken = [(a, b) for a, b in itertools.pairwise(nodes) if (a, b) in bridges.saving]
    step = {n: bridges.step(cutting, n) for n in nodes}
    kept: list[tuple[int, int]] = []
    planned = [(a.exit, b.entry) for chain in before for a, b in itertools.pairwise(chain)]
    for pair in sorted(taken, key=lambda p: (-bridges.saving[p], p)):
        bridge = (step[pair[0]].exit, step[pair[1]].entry)
        others = [*planned, *((step[a].exit, step[b].entry) for a, b in kept)]
        if all(_bridges_stay_apart(bridge, other, cutting.rules.kerf) for other in others):
            kept.append(pair)
    runs = (run for whole in _connected_runs(nodes, set(kept)) for run in _split_long_run(whole))
    return [tuple(step[n] for n in run) for run in runs if len(run) > 1]


def chain_step(cutting: Cutting, contour: int, at: float, clockwise: bool | None = None) -> CutStart:
    """Return the step of a chain at a position on a contour, mm along its path.

    If `clockwise` is not given, the cutting rules decide on the direction.
    """
    c = cutting.contours[contour]
    way = c.allowed_directions[0] if clockwise is None else clockwise
    return CutStart(contour, at, way, c.path.point_at(at), c.path.point_at(exit_position(c, at, way)))


def _best_positions(bridges: Bridges, order: Sequence[int]) -> list[int]:
    """Choose one position on each contour of `order` so that the bridges save as much time as possible.

    The method is dynamic programming. Two bridges that meet at a position must form an angle of at least `LEAST_ANGLE`.
    """
    out: dict[int, list[int]] = {}
    for a, b in bridges.saving:
        out.setdefault(a, []).append(b)
    at = {k: np.flatnonzero(bridges.contour == k).tolist() for k in order}
    State = tuple[int, int]  # position, and position at the other end of its bridge, or -1 for no bridge
    best: dict[State, float] = {(p, -1): 0.0 for p in at[order[0]]}
    came: list[dict[State, State]] = []
    for k in order[1:]:
        last = max(best, key=lambda s: best[s])
        after: dict[State, float] = {(q, -1): best[last] for q in at[k]}
        back: dict[State, State] = dict.fromkeys(after, last)
        inside = set(at[k])
        for (p, before), value in best.items():
            for q in out.get(p, ()):
                if q not in inside or (before >= 0 and not _bridges_diverge(bridges, before, p, q)):
                    continue
                if value + bridges.saving[p, q] > after.get((q, p), -math.inf):
                    after[q, p] = value + bridges.saving[p, q]
                    back[q, p] = (p, before)
        came.append(back)
        best = after
    path = [max(best, key=lambda s: best[s])]
    for back in reversed(came):
        path.append(back[path[-1]])
    return [place for place, _ in reversed(path)]


def _bridges_diverge(bridges: Bridges, before: int, place: int, after: int) -> bool:
    came = _unit_vector(bridges.arrive[place].tolist(), bridges.leave[before].tolist())
    goes = _unit_vector(bridges.leave[place].tolist(), bridges.arrive[after].tolist())
    return _angle(came, goes) >= LEAST_ANGLE


def _bridges_stay_apart(one: Bridge, other: Bridge, kerf: float) -> bool:
    """Return whether the kerfs of two bridges stay apart.

    If both bridges end at the same point, they only need an angle of `LEAST_ANGLE` between them.
    """
    if one[0] == other[1] or one[1] == other[0]:
        meet, p, q = (one[0], one[1], other[0]) if one[0] == other[1] else (one[1], one[0], other[1])
        return _angle(_unit_vector(meet, p), _unit_vector(meet, q)) >= LEAST_ANGLE
    away: float = shapely.distance(shapely.LineString(one), shapely.LineString(other))
    return away >= kerf - ROUNDING


def _unit_vector(a: Sequence[float], b: Sequence[float]) -> Point:
    length = max(math.dist(a, b), 1e-9)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _angle(a: Point, b: Point) -> float:
    return math.acos(max(-1.0, min(1.0, a[0] * b[0] + a[1] * b[1])))


def _connected_runs(nodes: Sequence[int], kept: set[tuple[int, int]]) -> Iterable[list[int]]:
    run = [nodes[0]]
    for a, b in itertools.pairwise(nodes):
        if (a, b) not in kept:
            yield run
            run = []
        run.append(b)
    yield run


def _split_long_run(run: list[int]) -> Iterable[list[int]]:
    parts = math.ceil(len(run) / MOST_CONTOURS)
    for k in range(parts):
        yield run[len(run) * k // parts : len(run) * (k + 1) // parts]


# -- bridges ---------------------------------------------------------------------------------------------------------


def scrap_number(contour: CutContour) -> int:
    """Return a number that identifies the piece of scrap next to a contour.

    Scrap in a hole has the index of the hole as its number. For scrap in a closed notch, the number is -2 minus the
    index of the outline. All other scrap has the number -1.
    """
    if contour.hole:
        return contour.index
    return -2 - contour.notch_of if contour.notch_of >= 0 else contour.source.parent


def exit_position(contour: CutContour, at: float, clockwise: bool) -> float:
    """Return the position at which a chain leaves a contour, mm along its path.

    A chain normally leaves where it entered. If the contour needs a micro-joint, the chain leaves earlier.
    """
    return at + (contour.closing_joint_length if clockwise else -contour.closing_joint_length)


def bridge_fits(contours: list[CutContour], pair: tuple[int, int], ends: Bridge, scrap: Scrap) -> bool:
    """Return whether two contours border on the same scrap, and the bridge `ends` stays inside this scrap."""
    one, other = (contours[k] for k in pair)
    if one.hole or pair[0] == pair[1] or scrap_number(one) != scrap_number(other):
        return False
    return bool(_fitting_bridges(np.array([ends]), one, other, scrap)[0])


def find_bridges(contours: list[CutContour], members: Sequence[int], scrap: Scrap, reach: float) -> Bridges:
    """Find all bridges shorter than `reach` mm between the contours with the indices `members`."""
    pairs = _neighbours(contours, members, reach)
    places = _candidate_positions(contours, pairs, reach)
    begin, end = _close_pairs(places, pairs, reach)
    step = places.arrive[end] - places.leave[begin]
    length = np.hypot(*step.T) if len(step) else np.zeros(0)
    lines = np.stack([places.leave[begin], places.arrive[end]], axis=1).reshape(-1, 2, 2)
    fits = np.zeros(len(lines), dtype=bool)
    groups: dict[tuple[int, int], list[int]] = {}
    for k, pair in enumerate(zip(places.contour[begin].tolist(), places.contour[end].tolist(), strict=True)):
        groups.setdefault(pair, []).append(k)
    for (a, b), group in groups.items():
        fits[group] = _fitting_bridges(lines[group], contours[a], contours[b], scrap)
    return replace(places, begin=begin[fits], end=end[fits], length=length[fits])


def _fitting_bridges(lines: NDArray[np.float64], one: CutContour, other: CutContour, scrap: Scrap) -> Mask:
    """Return a mask of the bridges, float64[n, 2, 2], from `one` to `other` that stay inside the scrap."""
    ok = leaves_kerf_at_once(lines, one.line, scrap.rules.kerf)
    ok &= leaves_kerf_at_once(lines[:, ::-1], other.line, scrap.rules.kerf)
    if ok.any():
        ok[ok] = scrap.allowed_mask(leads_as_lines(lines[ok]), one, other)
    return ok


def leaves_kerf_at_once(lines: NDArray[np.float64], kerf_line: Any, kerf: float) -> Mask:
    """Return a mask of the lines, float64[n, 2, 2], that leave a kerf directly and never return to it.

    `kerf_line` is the centreline of the kerf, and `kerf` is its width, mm.
    """
    step = lines[:, 1] - lines[:, 0]
    length = np.hypot(*step.T)
    share = np.minimum(LEAVES_WITHIN * kerf / np.maximum(length, 1e-9), 1.0)
    rest = np.stack([lines[:, 0] + share[:, None] * step, lines[:, 1]], axis=1)
    away: NDArray[np.float64] = shapely.distance(leads_as_lines(rest), kerf_line)
    # GEOS treats a line of length zero as empty, and nothing is near an empty line.
    short = share >= 1.0
    away[short] = shapely.distance(shapely.points(lines[short, 1]), kerf_line)
    stays: Mask = away >= kerf - ROUNDING
    return stays


def _neighbours(contours: list[CutContour], members: Sequence[int], reach: float) -> list[tuple[int, int]]:
    """Return the pairs of neighbouring contours that border on the same scrap.

    Each pair appears in both orders, except that a hole never comes first.
    """
    lines = np.array([contours[k].line for k in members], dtype=object)
    if not len(lines):
        return []
    a, b = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=reach)
    side = np.array([scrap_number(contours[k]) for k in members])
    keep = (a != b) & (side[a] == side[b])
    a, b = a[keep], b[keep]
    away = shapely.distance(lines[a], lines[b])
    rank = np.lexsort((away, a))
    chosen: set[tuple[int, int]] = set()
    count: dict[int, int] = {}
    for k in rank.tolist():
        one, other = members[int(a[k])], members[int(b[k])]
        count[one] = count.get(one, 0) + 1
        if count[one] <= NEIGHBOURS:
            chosen |= {(one, other), (other, one)}
    return sorted((one, other) for one, other in chosen if not contours[one].hole)


def _candidate_positions(contours: list[CutContour], pairs: Sequence[tuple[int, int]], reach: float) -> Bridges:
    """Choose positions where bridges might be useful.

    These are points close to one or two neighbouring contours, and the points opposite them.
    """
    near: dict[int, list[int]] = {}
    for one, other in pairs:
        near.setdefault(one, []).append(other)
        near.setdefault(other, []).append(one)
    wanted: dict[int, dict[float, float]] = {k: {} for k in near}
    for k, neighbours in near.items():
        contour, others = contours[k], sorted(set(neighbours))
        at = _sample_positions(contour)
        points = shapely.points([contour.path.point_at(a) for a in at])
        away = np.array([shapely.distance(points, contours[o].line) for o in others])
        for i, j in itertools.combinations_with_replacement(range(len(others)), 2):
            for best, total in _positions_between(away[i], away[j], reach):
                # A position between two neighbours has twice the weight of a position near one.
                _add_position(wanted[k], float(at[best]), total * (0.5 if i != j else 0.25))
                for o in {others[i], others[j]}:
                    share = float(shapely.line_locate_point(contours[o].line, points[best], normalized=True))
                    _add_position(wanted[o], share * contours[o].path.length, total)
    most = max(2, min(PLACES, MOST_PLACES // max(len(wanted), 1)))
    rows = [(k, at) for k in sorted(wanted) for at in _spaced_positions(contours[k], wanted[k], most)]
    arrive = [contours[k].path.point_at(at) for k, at in rows]
    leave = [
        contours[k].path.point_at(exit_position(contours[k], at, contours[k].allowed_directions[0])) for k, at in rows
    ]
    return Bridges(
        np.array([k for k, _ in rows], dtype=np.int64),
        np.array([at for _, at in rows], dtype=np.float64),
        np.array(arrive, dtype=np.float64).reshape(-1, 2),
        np.array(leave, dtype=np.float64).reshape(-1, 2),
    )


def _positions_between(one: NDArray[np.float64], other: NDArray[np.float64], reach: float) -> set[tuple[int, float]]:
    """Return the samples of a contour that are best suited for bridges to two neighbours.

    There are up to two such samples. One minimises the sum of the distances to both neighbours, and the other minimises
    the larger of the two distances. Each sample comes with the sum of both distances, mm. The arrays `one` and `other`
    contain the distances from every sample to the two neighbours, mm.
    """
    total, farther = one + other, np.maximum(one, other)
    if not (farther < reach).any():
        return set()
    # If sums are equal, take the position halfway, because bridges to both neighbours can start there.
    best = int(np.lexsort((farther, np.round(np.where(farther < reach, total, np.inf), 1)))[0])
    return {(k, float(total[k])) for k in (best, int(np.argmin(farther)))}


def _sample_positions(contour: CutContour) -> NDArray[np.float64]:
    """Sample a contour at regular intervals and at the ends of its segments. Return the positions, mm."""
    length = contour.path.length
    even = (np.arange(SAMPLES) + 0.5) * length / SAMPLES
    meet = np.cumsum(contour.path.lengths)[:-1][:SAMPLES]
    at = np.unique(np.concatenate([even, meet]))
    kept = [a for a in at.tolist() if not contour.is_in_loop(a)]
    return np.array(kept or at.tolist())


def _add_position(wanted: dict[float, float], at: float, away: float) -> None:
    wanted[at] = min(away, wanted.get(at, np.inf))


def _spaced_positions(contour: CutContour, wanted: dict[float, float], most: int) -> list[float]:
    """Select up to `most` positions along a contour, mm, that keep a minimum distance from each other.

    Positions near other contours are preferred. The result is sorted.
    """
    kept: list[float] = []
    for at in sorted(wanted, key=lambda a: (wanted[a], a)):
        if contour.is_in_loop(at) or any(
            distance_on_closed_path(at, b, contour.path.length) < SAME_PLACE for b in kept
        ):
            continue
        kept.append(at)
        if len(kept) == most:
            break
    return sorted(kept)


def _close_pairs(places: Bridges, pairs: Sequence[tuple[int, int]], reach: float) -> tuple[Indices, Indices]:
    """Return all pairs of positions on neighbouring contours that are less than `reach` mm apart."""
    of: dict[int, Indices] = {int(k): np.flatnonzero(places.contour == k) for k in np.unique(places.contour)}
    begin, end = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for one, other in pairs:
        a, b = of.get(one), of.get(other)
        if a is None or b is None:
            continue
        step = places.leave[a][:, None] - places.arrive[b][None]
        i, j = np.nonzero(np.hypot(step[..., 0], step[..., 1]) < reach)
        begin.append(a[i])
        end.append(b[j])
    return np.concatenate(begin), np.concatenate(end)


# -- chains of a plan file -------------------------------------------------------------------------------------------


def chains_from_plan_file(cutting: Cutting, plan: PlanFile, *, everything: bool = False) -> list[Chain]:
    """Return the chains that a plan file fixes, or all chains in the file if `everything` is set.

    Raises PlanError if a bridge does not fit.
    """
    position = {c.index: k for k, c in enumerate(cutting.contours)}
    chains: list[list[CutStart]] = []
    if plan.cuts and plan.cuts[0].bridge and (everything or "bridge" in plan.cuts[0].fixed):
        raise PlanError("{}: no cut precedes cut 1, so it cannot have a bridge", plan.source)
    for number, (before, choice) in enumerate(itertools.pairwise(plan.cuts), 2):
        if not choice.bridge or not (everything or "bridge" in choice.fixed):
            continue
        a, b = (_planned_step(cutting, position, c) for c in (before, choice))
        if (
            a is None
            or b is None
            or not bridge_fits(cutting.contours, (a.contour, b.contour), (a.exit, b.entry), cutting.scrap)
        ):
            raise PlanError(
                "{}: cut {}: no bridge through the scrap fits between it and the previous cut", plan.source, number
            )
        if chains and chains[-1][-1].contour == a.contour:
            chains[-1].append(b)
        else:
            chains.append([a, b])
    return [tuple(chain) for chain in chains]


def _planned_step(cutting: Cutting, position: dict[int, int], choice: CutChoice) -> CutStart | None:
    k = position.get(choice.contours[0], -1)
    if k < 0 or choice.start is None or not cutting.contours[k].has_leads:
        return None
    contour = cutting.contours[k]
    share = float(shapely.line_locate_point(contour.line, shapely.Point(*choice.start), normalized=True))
    way = {"clockwise": True, "counter-clockwise": False}.get(choice.direction)
    return chain_step(cutting, k, share * contour.path.length, way)


# -- starts of chains ------------------------------------------------------------------------------------------------


def with_chains(cutting: Cutting, chains: Sequence[Chain]) -> Cutting:
    """Add each chain to the cutting, as a start of the first contour of the chain.

    The leads of other cuts keep clear of the bridges. If a bridge leaves no room for the lead of another cut, the
    bridge is removed.
    """
    chains = list(chains)
    while chains:
        scrap = _scrap_with_bridges(cutting, chains)
        starts: dict[int, list[CutStart]] = {}
        for number, chain in enumerate(chains):
            own = chain_starts(cutting, chain, scrap) or chain_starts(cutting, _reversed_chain(cutting, chain), scrap)
            if not own:
                chains[number : number + 1] = [chain[1:]] if len(chain) > 2 else []
                break
            starts[own[0].contour] = own
        else:
            members = {step.contour for chain in chains for step in chain}
            stuck = _add_single_starts(cutting, scrap, members, starts)
            if stuck is None:
                return replace(cutting, scrap=scrap, starts=[s for k in sorted(starts) for s in starts[k]])
            chains = _without_nearest_bridge(cutting, chains, stuck)
    return cutting


def _scrap_with_bridges(cutting: Cutting, chains: Sequence[Chain]) -> Scrap:
    pairs = [pair for chain in chains for pair in itertools.pairwise(chain)]
    lines = shapely.linestrings(np.array([[a.exit, b.entry] for a, b in pairs]))
    index = [[cutting.contours[k].index for k in (a.contour, b.contour)] for a, b in pairs]
    return cutting.scrap.with_bridges(lines, np.array(index, dtype=np.int64))


def _reversed_chain(cutting: Cutting, chain: Chain) -> Chain:
    """Reverse the direction of a chain.

    A chain keeps its direction if it ends with a hole, or if the torch leaves one of its contours at a different point
    than it entered.
    """
    if cutting.contours[chain[-1].contour].hole or any(step.entry != step.exit for step in chain):
        return chain
    return chain[::-1]


def _add_single_starts(
    cutting: Cutting, scrap: Scrap, members: set[int], starts: dict[int, list[CutStart]]
) -> int | None:
    """Add the starts of the contours outside chains to `starts`.

    Return the first contour that has no start, or None if all contours have starts.
    """
    for k in range(len(cutting.contours)):
        if k not in members:
            starts[k] = _starts_clear_of_bridges(cutting, k, scrap)
            if not starts[k] and cutting.starts_by_contour[k]:
                return k
    return None


def _starts_clear_of_bridges(cutting: Cutting, number: int, scrap: Scrap) -> list[CutStart]:
    contour, own = cutting.contours[number], cutting.starts_on([number])
    if contour.kind != "cut":
        return own

    def is_free(start: CutStart) -> bool:
        lines = cutting.lead_lines(start)
        return not lines or bool(scrap.allowed_mask(lines, contour, leaves_sheet=not start.pierce).all())

    return [s for s in own if is_free(s)] or find_contour_starts(number, contour, scrap, NEW_PLACES)


def _without_nearest_bridge(cutting: Cutting, chains: Sequence[Chain], stuck: int) -> list[Chain]:
    line = cutting.contours[stuck].line
    at = [(n, i) for n, chain in enumerate(chains) for i in range(len(chain) - 1)]
    away = [shapely.distance(line, shapely.LineString([chains[n][i].exit, chains[n][i + 1].entry])) for n, i in at]
    number, i = at[int(np.argmin(away))]
    parts = [chains[number][: i + 1], chains[number][i + 1 :]]
    return [*chains[:number], *(p for p in parts if len(p) > 1), *chains[number + 1 :]]


def chain_starts(cutting: Cutting, chain: Chain, scrap: Scrap) -> list[CutStart]:
    """Return the starts of a chain whose lead-ins keep clear of its bridges. The list may be empty."""
    contours, kerf = cutting.contours, cutting.rules.kerf
    bridges = [shapely.LineString([a.exit, b.entry]) for a, b in itertools.pairwise(chain)]
    head, last = chain[0], _with_chain_lead_out(contours[chain[-1].contour], chain[-1], scrap, bridges[-1])
    contour, found = contours[head.contour], []
    begun = (
        cutting.starts_on([head.contour])
        if head.contour in cutting.fixed
        else _chain_entry_starts(contour, head, scrap)
    )
    for first in begun:
        if abs(first.at - head.at) > SAME or first.clockwise != head.clockwise:
            continue
        lead = contour.lead_points(first.lead_in, first.at, first.clockwise)
        if len(lead) < 2 or not first.pierce or lead_leaves_bridge(lead[::-1], bridges[0], kerf):
            found.append(replace(first, exit=last.exit, lead_out=NO_LEAD, then=(*chain[1:-1], last)))
    return found[:MOST_STARTS]


def _chain_entry_starts(contour: CutContour, step: CutStart, scrap: Scrap) -> list[CutStart]:
    rules = contour.rules
    if rules.edge_start:
        return [s for s in edge_starts(step.contour, contour, scrap, [step.at]) if s.clockwise == step.clockwise]
    if rules.lead_in.style == "none":
        return [step]
    found: list[CutStart] = []
    for splash in (True, False) if rules.kerf > 0.0 else (False,):
        for lead in leads_to_try(contour):
            found += starts_with_leads(step.contour, contour, scrap, [(step.at, step.clockwise)], [lead], splash)
        if len(found) >= MOST_STARTS:
            break
    return list(dict.fromkeys(found))


def _with_chain_lead_out(contour: CutContour, step: CutStart, scrap: Scrap, bridge: Any) -> CutStart:
    """Add a lead-out to the last step of a chain.

    This is the longest lead-out that keeps clear of the bridge to this step. If none fits, the step has no lead-out.
    """
    end, wanted = contour.end_position(step.at, step.clockwise), contour.requested_lead_out
    for share in (1.0, 0.5, 0.25) if wanted.style != "none" else ():
        lead = replace(wanted, length=share * wanted.length)
        out, leave = fitting_lead_out(contour, scrap, (step.at, step.clockwise), lead)
        points = contour.lead_points(out, end, step.clockwise, out=True)
        if out.style != "none" and lead_leaves_bridge(points, bridge, contour.rules.kerf):
            return replace(step, exit=leave, lead_out=out)
    return replace(step, exit=contour.path.point_at(end), lead_out=NO_LEAD)


def lead_leaves_bridge(lead: Points, bridge: Any, kerf: float) -> bool:
    """Return whether a lead moves out of the kerf of a bridge and stays outside.

    `lead` is float64[k, 2]. It starts at the contour.
    """
    line = shapely.LineString(lead)
    count = max(math.ceil(line.length / max(0.25 * kerf, 0.01)), 2)
    points = shapely.line_interpolate_point(line, np.linspace(0.0, line.length, count + 1))
    apart = shapely.distance(points, bridge) >= kerf - ROUNDING
    return bool((apart | ~np.maximum.accumulate(apart)).all() and apart[-1])
