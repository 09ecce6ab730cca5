"""The joints of rings: against a spanning tree by brute force, and shapely for the area that may stay uncut."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from pocket_shapes import RULES, l_shape, only_region, plate

from leafcut.processes.pocket.plan.ring_links import RingLinks, joint_spanning_tree, tree_children
from leafcut.processes.pocket.plan.rings import Ring, offset_rings

STEP = RULES.step_over


def circle(x: float, y: float, radius: float, level: int) -> Ring:
    turn = np.linspace(0.0, math.tau, 240, endpoint=False)
    return Ring.from_open_points(np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)]), level)


def some(seed: int) -> list[Ring]:
    dice = np.random.default_rng(seed)
    return [circle(40.0 * k, *dice.uniform((0, 3), (60, 17)), int(dice.integers(0, 3))) for k in range(6)]


def weight(a: Ring, b: Ring) -> float:
    """Return the cost of a joint: its length, more for two rings of one level, most for two walls."""
    return a.line.distance(b.line) + STEP * (0.5 * (a.level == b.level) + (a.level == b.level == 0))


@pytest.mark.parametrize("seed", range(6))
def test_the_rings_are_joined_by_the_cheapest_tree_of_all(seed: int) -> None:
    cut = some(seed)
    tree = joint_spanning_tree(cut, STEP)
    assert len(tree) == len(cut) - 1
    pairs = list(itertools.combinations(range(len(cut)), 2))
    costs = {(a, b): weight(cut[a], cut[b]) for a, b in pairs}

    def whole(edges: tuple[tuple[int, int], ...]) -> bool:
        seen, queue = {0}, [0]
        for i in queue:
            for a, b in edges:
                for one, other in ((a, b), (b, a)):
                    if one == i and other not in seen:
                        seen.add(other)
                        queue.append(other)
        return len(seen) == len(cut)

    least = min(sum(costs[e] for e in edges) for edges in itertools.combinations(pairs, 5) if whole(edges))
    assert sum(costs[min(e), max(e)] for e in tree) == pytest.approx(least)


def test_every_ring_beside_the_spine_is_visited_in_passing_from_one_that_it_is_joined_to() -> None:
    edges = [(0, 1), (1, 2), (1, 3), (3, 4), (0, 5)]
    assert tree_children([0, 1, 2], edges, 6) == {0: [5], 1: [3], 2: [], 3: [4], 4: [], 5: []}


def test_rings_of_concentric_circles_are_joined_each_to_the_next() -> None:
    cut = [circle(0, 0, 40 - STEP * level, level) for level in range(5)]
    assert {tuple(sorted(edge)) for edge in joint_spanning_tree(cut, STEP)} == {(k, k + 1) for k in range(4)}


@pytest.mark.parametrize("pocket", [plate(), l_shape()], ids=["plate", "l-shape"])
def test_one_way_goes_through_all_rings_at_depth_and_leaves_neither_the_region_nor_a_wall_out(pocket) -> None:
    region = only_region(pocket)
    cut = offset_rings(region)
    layout = RingLinks(region, cut)
    ways = layout.joined_paths(np.zeros((0, 2)))
    assert len(ways) == 1 + len(layout.apart) == 1
    line = shapely.LineString(ways[0])
    assert region.polygon.buffer(1e-3).covers(line)
    near = line.buffer(1e-3)
    for ring in cut:
        # A joint leaves out a step-over of a ring, as often as rings are joined to it; of walls nothing.
        missing = ring.line.difference(near).length
        joints = sum(i in edge for i, own in enumerate(cut) if own is ring for edge in layout.edges)
        assert missing <= (0.01 if ring.level == 0 else joints * STEP + 0.01)
    assert layout.spine
    lengths = sum(ring.length for ring in cut)
    assert line.length <= lengths + 2.0 * STEP * len(cut)
