"""Fit as few lines and arcs as possible to a closed line of noisy points, and keep sharp corners.

The line is divided into pieces, and each piece becomes a line or an arc. The cost of a piece is the sum of the squared
distances between its points and the best line or circle, in units of the noise, plus a fixed fee. Dynamic programming
finds the cheapest division (Perez and Vidal, "Optimum polygonal approximation of digitized curves", Pattern Recognition
Letters 15 (1994), for lines). Neighbouring pieces end where their lines or circles meet.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Floats, Points
from leafcut.geometry.polyline import Polyline

#: Fees of a line (3 parameters) and an arc (4 parameters). Each parameter costs about the logarithm of the number of
#: points (Schwarz, "Estimating the dimension of a model", 1978). The values are for a few thousand points.
LINE_FEE, ARC_FEE = 20.0, 26.0
#: Maximum number of points per piece in the search. Longer pieces are merged afterwards.
WINDOW = 320
#: Number of piece starts that are evaluated together. Their data fit into the processor's cache.
_BLOCK = 48
#: A piece between two lines may be a rounded corner if it has at most this number of points. The piece becomes tangent
#: to both lines, unless this costs more than the second value, in squares of the noise. A tangent arc has two
#: parameters fewer, and each parameter is worth about 12.
FILLET_POINTS, FILLET_WORTH = 400, 24.0
#: Maximum additional cost of a radius that is as likely as the best radius, in squares of the noise.
EQUALLY_LIKELY = 1.0
#: If a point is farther from its line or arc than the first value, in point distances, the piece is divided at lower
#: fees. The second value is the lowest share of the fees.
MAX_DISTANCE, LEAST_SHARE = 0.6, 0.1
#: Maximum distance of an intersection from the points at which two pieces meet, in point distances.
MAX_JOINT_DISTANCE = 4.0
_TINY = 1e-12


class _Piece(NamedTuple):
    """A line or an arc through the points from `first` to `beyond` - 1.

    For an arc, (x, y) is the centre. For a line, (x, y) is a point on the line and (dx, dy) is its direction.
    """

    first: int
    beyond: int
    x: float
    y: float
    #: Positive for a counter-clockwise arc; 0 for a line.
    radius: float
    dx: float
    dy: float


def fit_outline(points: Points, noise: Floats) -> Polyline | None:
    """Fit lines and arcs to a closed line of points, in O(n · `WINDOW`).

    Parameters
    ----------
    points
        float64[n, 2], with a spacing of about one unit (one pixel). The first point is not repeated at the end.
    noise
        Standard deviation of each point in the same unit, float64[n].

    Returns
    -------
    path
        The fitted path, or None if the lines and arcs do not form a closed path.
    """
    if len(points) < 3:
        return None
    weights = noise**-2.0
    cuts = _divide_into_pieces(points, weights)
    # The ring was opened at an arbitrary point. Open it at a corner instead, and divide it again.
    shift = cuts[len(cuts) // 2]
    points, weights = np.roll(points, -shift, axis=0), np.roll(weights, -shift)
    cuts = _remove_needless_cuts(points, weights, _divide_into_pieces(points, weights))
    pieces = [
        piece
        for a, b in zip(cuts, [*cuts[1:], len(points)], strict=True)
        for piece in _accurate_pieces(points, weights, a, b, 1.0)
    ]
    if len(pieces) == 1:
        return _circle_of_piece(pieces[0])
    return _polyline_of_pieces(points, _replace_with_fillets(points, weights, pieces))


# -- division into pieces ----------------------------------------------------------------------------------------------


def _accurate_pieces(points: Points, weights: Floats, first: int, beyond: int, share: float) -> list[_Piece]:
    """Fit a single piece to a run of points. If the piece is inaccurate, fit several pieces at lower fees instead."""
    whole = _fit_piece(points, weights, first, beyond)
    run = points[first:beyond]
    if len(run) < 6 or share < LEAST_SHARE or float(np.abs(_distances_from_piece(whole, run)).max()) <= MAX_DISTANCE:
        return [whole]
    share *= 0.5
    cuts = [first + cut for cut in _divide_into_pieces(run, weights[first:beyond], share)]
    pairs = zip(cuts, [*cuts[1:], beyond], strict=True)
    return [piece for a, b in pairs for piece in _accurate_pieces(points, weights, a, b, share)]


def _divide_into_pieces(points: Points, weights: Floats, share: float = 1.0) -> list[int]:
    """Find the cheapest division of an open line. Return the index of the first point of each piece."""
    n = len(points)
    window = min(WINDOW, n)
    padded = np.concatenate([points, np.repeat(points[-1:], window, axis=0)])
    padded_weights = np.concatenate([weights, np.zeros(window)])
    cost = np.full(n + 1, np.inf)
    cost[0] = 0.0
    previous = np.zeros(n + 1, dtype=np.int64)
    for block in range(0, n, _BLOCK):
        starts = np.arange(block, min(block + _BLOCK, n))
        window_rows = starts[:, None] + np.arange(window)
        fees = _piece_costs(padded[window_rows] - padded[starts][:, None], padded_weights[window_rows], share)
        for row, start in enumerate(starts.tolist()):
            stop = min(start + window, n)
            total = cost[start] + fees[row, : stop - start]
            better = np.flatnonzero(total < cost[start + 1 : stop + 1])
            cost[start + 1 + better] = total[better]
            previous[start + 1 + better] = start
    cuts = [int(previous[n])]
    while cuts[-1] > 0:
        cuts.append(int(previous[cuts[-1]]))
    return cuts[::-1]


def _remove_needless_cuts(points: Points, weights: Floats, cuts: list[int]) -> list[int]:
    """Remove cuts inside a single line or arc.

    Such cuts appear where a piece exceeds the window, and where the closed line was opened.
    """
    cuts = list(cuts)
    k = 1
    while k < len(cuts):
        a, b, c = cuts[k - 1], cuts[k], cuts[k + 1] if k + 1 < len(cuts) else len(points)
        if _piece_cost(points, weights, a, c) <= _piece_cost(points, weights, a, b) + _piece_cost(
            points, weights, b, c
        ):
            del cuts[k]
        else:
            k += 1
    return cuts


def _piece_cost(points: Points, weights: Floats, first: int, beyond: int) -> float:
    return float(_piece_costs(points[None, first:beyond] - points[first], weights[None, first:beyond])[0, -1])


def _piece_costs(points: Floats, weights: Floats, share: float = 1.0) -> Floats:
    """Return the costs of pieces with 1, 2, 3 … points for each row of `points`, float64[rows, points, 2]."""
    m = running_moments(points, weights)
    total = np.cumsum(weights, axis=1)
    straight, off = line_fit_error(m), circle_fit_error(m)[0]
    return np.minimum(total * straight + share * LINE_FEE, total * np.minimum(off, straight) + share * ARC_FEE)


# -- lines and arcs --------------------------------------------------------------------------------------------------


def _fit_piece(points: Points, weights: Floats, first: int, beyond: int) -> _Piece:
    origin, run = points[first], points[first:beyond]
    m = running_moments(run[None] - origin, weights[None, first:beyond])
    total = float(weights[first:beyond].sum())
    off, *circle = (float(t[0, -1]) for t in circle_fit_error(m))
    line = float(line_fit_error(m)[0, -1])
    mx, my = float(m.x[0, -1] + origin[0]), float(m.y[0, -1] + origin[1])
    if total * off + ARC_FEE < total * line + LINE_FEE and np.isfinite(circle).all():
        x, y = circle[0] + mx, circle[1] + my
        out = run - (x, y)
        turn = float(np.sum(out[:-1, 0] * out[1:, 1] - out[:-1, 1] * out[1:, 0]))
        return _Piece(first, beyond, x, y, math.copysign(circle[2], turn), 0.0, 0.0)
    angle = 0.5 * math.atan2(2.0 * float(m.xy[0, -1]), float(m.xx[0, -1] - m.yy[0, -1]))
    dx, dy = math.cos(angle), math.sin(angle)
    along = run[-1] - run[0]
    if along[0] * dx + along[1] * dy < 0.0:
        dx, dy = -dx, -dy
    return _Piece(first, beyond, mx, my, 0.0, dx, dy)


def _circle_of_piece(piece: _Piece) -> Polyline | None:
    if piece.radius == 0.0:
        return None
    return Polyline.circle(piece.x, piece.y, abs(piece.radius), clockwise=piece.radius < 0.0)


def _replace_with_fillets(points: Points, weights: Floats, pieces: list[_Piece]) -> list[_Piece]:
    """Replace a piece between two lines with an arc tangent to both lines, if this fits the points nearly as well."""
    result: list[_Piece] = []
    for k, piece in enumerate(pieces):
        before, after = pieces[k - 1], pieces[(k + 1) % len(pieces)]
        short = piece.beyond - piece.first <= FILLET_POINTS and len(pieces) > 2
        fillet = _fit_fillet(points, weights, piece, before, after) if short else None
        if fillet is None and len(_joint_points(points, before, piece)) > 1:
            # A sharp corner would be visible in the pixels. This one is rounded, but has too few points for a piece.
            empty = _Piece(piece.first, piece.first, 0.0, 0.0, 0.0, 0.0, 0.0)
            corner = _fit_fillet(points, weights, empty, before, piece)
            result += [corner] if corner is not None else []
        result.append(fillet or piece)
    return result


def _fit_fillet(points: Points, weights: Floats, piece: _Piece, before: _Piece, after: _Piece) -> _Piece | None:
    """Return the arc tangent to both lines, or None if the arc does not fit the points."""
    cross = before.dx * after.dy - before.dy * after.dx
    corner = [] if before.radius or after.radius else _piece_intersections(before, after)
    if not corner or abs(cross) < 0.1:
        return None
    # The centre lies on the bisector. For radius 1, its distance from the corner is 1 / sin(half the corner angle).
    half = 0.5 * (math.pi - math.atan2(abs(cross), before.dx * after.dx + before.dy * after.dy))
    bx, by = after.dx - before.dx, after.dy - before.dy
    centre_distance = 1.0 / (math.hypot(bx, by) * math.sin(half))
    # The points of both lines next to the arc must fit as well.
    extra = FILLET_POINTS // 8 + piece.beyond - piece.first
    sides = [
        _range_of_last_points(before, extra),
        (piece.first, piece.beyond),
        (after.first, min(after.first + extra, after.beyond)),
    ]
    rows = np.concatenate([np.arange(a, b) for a, b in sides])
    offsets = points[rows] - corner[0]
    on_first = np.arange(len(rows)) < len(rows) - (sides[2][1] - sides[2][0]) - (piece.beyond - piece.first) // 2
    along = np.where(on_first, -(offsets @ (before.dx, before.dy)), offsets @ (after.dx, after.dy))
    line_distance = np.where(on_first, offsets @ (before.dy, -before.dx), offsets @ (after.dy, -after.dx))

    def distances(radius: float) -> Floats:
        out = offsets - radius * centre_distance * np.array([bx, by])
        round_off = np.hypot(out[:, 0], out[:, 1]) - radius
        return np.asarray(np.where(along > radius / math.tan(half), line_distance, round_off))

    row_weights = weights[rows]
    length = min(_chord_length(points, line) for line in (before, after)) + piece.beyond - piece.first
    radius = _likely_value(
        lambda r: float((row_weights * distances(r) ** 2).sum()), 0.3, max(length * math.tan(half), 0.6)
    )
    cost_before = sum(
        float((weights[a:b] * _distances_from_piece(fitted, points[a:b]) ** 2).sum())
        for fitted, (a, b) in zip((before, piece, after), sides, strict=True)
    )
    if (
        np.abs(distances(radius)).max() > 1.0
        or float((row_weights * distances(radius) ** 2).sum()) > cost_before + FILLET_WORTH
    ):
        return None
    x, y = corner[0][0] + radius * centre_distance * bx, corner[0][1] + radius * centre_distance * by
    return _Piece(piece.first, piece.beyond, x, y, math.copysign(radius, cross), 0.0, 0.0)


def _range_of_last_points(piece: _Piece, count: int) -> tuple[int, int]:
    return max(piece.first, piece.beyond - count), piece.beyond


def _chord_length(points: Points, piece: _Piece) -> float:
    dx, dy = (points[piece.beyond - 1] - points[piece.first]).tolist()
    return math.hypot(dx, dy)


def _likely_value(cost: Callable[[float], float], low: float, high: float) -> float:
    """Return the middle of the range of values that are about as likely as the best value.

    `cost` returns the squared error of a value, in squares of the noise. The search tries 64 steps on a logarithmic
    scale, then refines the best value by ternary search. A value whose cost is at most `EQUALLY_LIKELY` higher is
    within one standard deviation. The middle of the range of these values minimises the error.
    """
    samples: list[float] = np.geomspace(low, high, 64).tolist()
    costs = [cost(step) for step in samples]
    best = int(np.argmin(costs))
    a, b = samples[max(best - 1, 0)], samples[min(best + 1, 63)]
    for _ in range(24):
        c, d = a + (b - a) / 3.0, b - (b - a) / 3.0
        a, b = (a, d) if cost(c) < cost(d) else (c, b)
    best_value = 0.5 * (a + b)
    limit = cost(best_value) + EQUALLY_LIKELY
    likely = [best_value, *(step for step, value in zip(samples, costs, strict=True) if value <= limit)]
    return 0.5 * (min(likely) + max(likely))


def _distances_from_piece(piece: _Piece, points: Points) -> Floats:
    out = points - (piece.x, piece.y)
    if piece.radius == 0.0:
        return np.asarray(out[:, 0] * piece.dy - out[:, 1] * piece.dx)
    return np.asarray(np.hypot(out[:, 0], out[:, 1]) - abs(piece.radius))


def _polyline_of_pieces(points: Points, pieces: list[_Piece]) -> Polyline:
    rows: list[list[float]] = []
    for k, piece in enumerate(pieces):
        entry, exit_points = (
            _joint_points(points, pieces[k - 1], piece),
            _joint_points(points, piece, pieces[(k + 1) % len(pieces)]),
        )
        start, stop = entry[-1], exit_points[0]
        rows.append([*start, _piece_bulge(points, piece, start, stop)])
        if len(exit_points) > 1:
            rows.append([*stop, 0.0])
    return Polyline(np.array(rows), closed=True)


def _joint_points(points: Points, first: _Piece, second: _Piece) -> list[tuple[float, float]]:
    """Return the point where two pieces meet, or both end points of a line that connects the pieces."""
    a, b = points[first.beyond - 1], points[second.first % len(points)]
    middle = 0.5 * (a + b)
    for line, arc in ((first, second), (second, first)):
        if line.radius == 0.0 != arc.radius and _is_tangent(line, arc):
            return [_nearest_point_on_piece(line, np.array([arc.x, arc.y]))]
    crossings = _piece_intersections(first, second)
    if crossings:
        crossing = min(crossings, key=lambda p: math.dist(p, middle))
        if math.dist(crossing, middle) <= MAX_JOINT_DISTANCE and not _covers_a_pixel_centre(a, b, crossing):
            return [crossing]
    p, q = _nearest_point_on_piece(first, middle), _nearest_point_on_piece(second, middle)
    if math.dist(p, q) <= 1.0:
        # Choose a point between both pieces, nearer to the piece with more points.
        share = (second.beyond - second.first) / max(second.beyond - second.first + first.beyond - first.first, 1)
        return [(p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1]))]
    return [_nearest_point_on_piece(first, a), _nearest_point_on_piece(second, b)]


def _is_tangent(line: _Piece, arc: _Piece) -> bool:
    off = (arc.x - line.x) * line.dy - (arc.y - line.y) * line.dx
    return abs(abs(off) - abs(arc.radius)) < 1e-6


def _covers_a_pixel_centre(a: Points, b: Points, tip: tuple[float, float]) -> bool:
    """Return whether a triangle contains a pixel centre. If so, the traced line would have passed around the tip."""
    corners = np.array([a, b, tip])
    low, high = np.ceil(corners.min(axis=0) - 0.5) + 0.5, np.floor(corners.max(axis=0) - 0.5) + 0.5
    xs, ys = np.arange(low[0], high[0] + 0.5), np.arange(low[1], high[1] + 0.5)
    if not len(xs) or not len(ys):
        return False
    x, y = (t.ravel() for t in np.meshgrid(xs, ys))
    successors = np.roll(corners, -1, axis=0)
    side = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in zip(corners, successors, strict=True)]
    inside = (np.array(side) > _TINY).all(axis=0) | (np.array(side) < -_TINY).all(axis=0)
    return bool(inside.any())


def _nearest_point_on_piece(piece: _Piece, point: Points) -> tuple[float, float]:
    dx, dy = float(point[0]) - piece.x, float(point[1]) - piece.y
    if piece.radius == 0.0:
        along = dx * piece.dx + dy * piece.dy
        return (piece.x + along * piece.dx, piece.y + along * piece.dy)
    scale = abs(piece.radius) / max(math.hypot(dx, dy), _TINY)
    return (piece.x + scale * dx, piece.y + scale * dy)


def _piece_intersections(first: _Piece, second: _Piece) -> list[tuple[float, float]]:
    if first.radius == 0.0 and second.radius == 0.0:
        cross = first.dx * second.dy - first.dy * second.dx
        if abs(cross) < 1e-6:
            return []
        t = ((second.x - first.x) * second.dy - (second.y - first.y) * second.dx) / cross
        return [(first.x + t * first.dx, first.y + t * first.dy)]
    if first.radius != 0.0 and second.radius != 0.0:
        x, y = second.x - first.x, second.y - first.y
        gap = math.hypot(x, y)
        if gap < _TINY:
            return []
        # The circles intersect on their radical line. It crosses the line of centres at `along` from the first centre.
        along = 0.5 * (gap + (first.radius**2 - second.radius**2) / gap)
        line = (first.x + along * x / gap, first.y + along * y / gap, -y / gap, x / gap)
        return _line_circle_intersections(first, *line)
    circle, line_piece = (first, second) if second.radius == 0.0 else (second, first)
    return _line_circle_intersections(circle, line_piece.x, line_piece.y, line_piece.dx, line_piece.dy)


def _line_circle_intersections(circle: _Piece, x: float, y: float, dx: float, dy: float) -> list[tuple[float, float]]:
    foot = (circle.x - x) * dx + (circle.y - y) * dy
    px, py = x + foot * dx, y + foot * dy
    square = circle.radius**2 - (px - circle.x) ** 2 - (py - circle.y) ** 2
    if square < 0.0:
        return []
    half = math.sqrt(square)
    return [(px + half * dx, py + half * dy), (px - half * dx, py - half * dy)]


def _piece_bulge(points: Points, piece: _Piece, start: tuple[float, float], end: tuple[float, float]) -> float:
    if piece.radius == 0.0 or math.dist(start, end) < _TINY:
        return 0.0
    side = math.copysign(1.0, piece.radius)
    angles = [math.atan2(y - piece.y, x - piece.x) for x, y in (start, end)]
    turn = side * (angles[1] - angles[0]) % (2.0 * math.pi)
    out = points[piece.first : piece.beyond] - (piece.x, piece.y)
    spanned = float(np.ptp(np.unwrap(np.arctan2(out[:, 1], out[:, 0])))) if len(out) else 0.0
    if turn - spanned > math.pi:  # the joints are in reverse order: the arc is shorter than the point spacing
        return 0.0
    # The arc passes through the middle of the piece, because the joints may not lie on the circle.
    angle, radius = angles[0] + 0.5 * side * turn, abs(piece.radius)
    x, y = piece.x + radius * math.cos(angle), piece.y + radius * math.sin(angle)
    chord = (end[0] - start[0], end[1] - start[1])
    rise = (chord[0] * (y - start[1]) - chord[1] * (x - start[0])) / math.hypot(*chord)
    return -2.0 * rise / math.hypot(*chord)


# -- mean squared distances from the best line and circle, for all runs of points at once ----------------------------


class Moments(NamedTuple):
    """Means and central moments of x, y and z = x² + y² for the first n points of each row, for every n."""

    x: Floats
    y: Floats
    xx: Floats
    yy: Floats
    xy: Floats
    xz: Floats
    yz: Floats
    zz: Floats


def running_moments(points: Floats, weights: Floats) -> Moments:
    """Return the moments of the first 1, 2, 3 … points of each row of `points`, float64[rows, n, 2].

    The points should be close to the origin, because this preserves precision.
    """
    x, y = points[..., 0], points[..., 1]
    z = x * x + y * y
    total = np.maximum(np.cumsum(weights, axis=1), _TINY)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.cumsum(weights * values, axis=1) / total)

    a, b, xx, yy, xy, xz, yz = mean(x), mean(y), mean(x * x), mean(y * y), mean(x * y), mean(x * z), mean(y * z)
    # Relative to the mean (a, b), z becomes z − 2ax − 2by + c with c = a² + b². Its mean is the covariance's trace.
    c = a * a + b * b
    trace = np.maximum(xx + yy - c, 0.0)
    zz = mean(z * z) + 4.0 * (a * a * xx + b * b * yy + 2.0 * a * b * xy - a * xz - b * yz) + 2.0 * c * (xx + yy)
    return Moments(
        a,
        b,
        np.maximum(xx - a * a, 0.0),
        np.maximum(yy - b * b, 0.0),
        xy - a * b,
        xz - 2.0 * (a * xx + b * xy) + c * a - a * trace,
        yz - 2.0 * (a * xy + b * yy) + c * b - b * trace,
        zz - 3.0 * c * c,
    )


def line_fit_error(m: Moments) -> Floats:
    """Return the mean squared distance from the best line. This is the smaller eigenvalue of the covariance matrix."""
    half = 0.5 * (m.xx + m.yy)
    return np.maximum(half - np.sqrt(0.25 * (m.xx - m.yy) ** 2 + m.xy**2), 0.0)


def circle_fit_error(m: Moments) -> tuple[Floats, Floats, Floats, Floats]:
    """Fit a circle, and return the approximate mean squared distance, the centre (x and y), and the radius.

    The centre is relative to the mean of the points.

    Source: Taubin, "Estimation of planar curves …", IEEE Trans. PAMI 13 (1991); Newton's method from 0 for the root, as
    in Chernov, "Circular and linear regression" (2010), section 5.9.
    """
    trace, area = m.xx + m.yy, m.xx * m.yy - m.xy**2
    spread = m.zz - trace**2
    a3, a2 = 4.0 * trace, -3.0 * trace**2 - m.zz
    a1 = spread * trace + 4.0 * area * trace - m.xz**2 - m.yz**2
    a0 = m.xz * (m.xz * m.yy - m.yz * m.xy) + m.yz * (m.yz * m.xx - m.xz * m.xy) - spread * area
    root = np.zeros_like(trace)
    with np.errstate(all="ignore"):
        for _ in range(8):
            slope = a1 + root * (2.0 * a2 + 3.0 * a3 * root)
            step = (a0 + root * (a1 + root * (a2 + root * a3))) / slope
            root = root - np.where(np.isfinite(step), step, 0.0)
        root = np.where(np.isfinite(root) & (root >= 0.0), root, 0.0)
        # Three points always lie on a circle; the root is then 0 within rounding.
        down = 2.0 * (root * root - root * trace + area)
        x = (m.xz * (m.yy - root) - m.yz * m.xy) / down
        y = (m.yz * (m.xx - root) - m.xz * m.xy) / down
        return root, x, y, np.sqrt(x * x + y * y + trace)
