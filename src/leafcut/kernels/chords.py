"""Merge straight moves the way a controller does: skip points that are within a tolerance of the merged move."""

from __future__ import annotations

from numpy.typing import NDArray

from leafcut.kernels import kernel

#: A merged move skips at most this many points. Source: LinuxCNC 2.9, emc/task/emccanon.cc (a queue of 100).
MOST_POINTS = 100


@kernel
def merge_chords(point: NDArray, joins: NDArray, tolerance: NDArray, starts: NDArray) -> int:
    """Merge straight moves as long as all skipped points are within a tolerance of the chord.

    Returns the number of moves after merging.

    point      float64[m + 1, 3]   mm; move i goes from point i to point i + 1
    joins      bool[m]             move i may be merged with the previous move
    tolerance  float64[m]          mm
    starts     bool[m]             move i is the first of a merged move

    Changes: starts.
    Source: LinuxCNC documentation, G64 ("naive CAM detector"): greedy, each chord as long as possible.
    """
    first, count = 0, 0
    for i in range(len(joins)):
        starts[i] = i == 0 or not joins[i] or i - first > MOST_POINTS
        if not starts[i]:
            dx = point[i + 1, 0] - point[first, 0]
            dy = point[i + 1, 1] - point[first, 1]
            dz = point[i + 1, 2] - point[first, 2]
            chord2 = dx * dx + dy * dy + dz * dz
            starts[i] = chord2 == 0.0
            k = first + 1
            while not starts[i] and k <= i:
                px = point[k, 0] - point[first, 0]
                py = point[k, 1] - point[first, 1]
                pz = point[k, 2] - point[first, 2]
                along = min(1.0, max(0.0, (px * dx + py * dy + pz * dz) / chord2))
                px -= along * dx
                py -= along * dy
                pz -= along * dz
                starts[i] = px * px + py * py + pz * pz > tolerance[i] * tolerance[i]
                k += 1
        if starts[i]:
            first = i
            count += 1
    return count
