"""Cut a height field with straight moves. A move lowers each cell to the lowest height of the tool surface above it."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

#: Newton's method finds the lowest point of a round corner on a slope. It stops when a step is smaller than _CLOSE,
#: relative to the corner radius (the next step would be about the square of this value), or after _MOST_STEPS steps. A
#: few steps are usually enough, because each step at least halves the error.
_CLOSE, _MOST_STEPS = 1e-7, 40


class ToolShape(NamedTuple):
    """Dimensions of a tool's shape in mm (see `leafcut.model.cutter.Cutter`). A slope of 0 means a cylinder."""

    radius: float
    flat: float
    corner: float
    reach: float
    rise: float
    slope: float


class CellRows(NamedTuple):
    """Several rows of a height field.

    =========== ====================== ======================================================================
    heights     float32[rows, columns] height of the material in each cell, mm
    lowered     float32[rows, columns] height of the cells that rapids have lowered; float32[0, 0] if not requested
    first, last int                    the rows: first … last − 1
    x, y        float                  centre of the first cell of the field, mm
    cell        float                  side length of a cell, mm
    =========== ====================== ======================================================================
    """

    heights: NDArray
    lowered: NDArray
    first: int
    last: int
    x: float
    y: float
    cell: float


@inner_kernel
def tool_surface_height(shape: ToolShape, r: float) -> float:
    """Return the height of the tool surface above the tool tip in mm, at a distance r ≤ radius from the axis."""
    if r <= shape.flat:
        return 0.0
    if r <= shape.reach:
        out = r - shape.flat
        return shape.corner - math.sqrt(max(shape.corner * shape.corner - out * out, 0.0))
    return shape.rise + shape.slope * (r - shape.reach)


@inner_kernel
def corner_rises_faster_than_path(shape: ToolShape, d: float, grade: float, w: float) -> bool:
    """Check whether the arc of the tool corner, at the offset w ≥ 0, rises at least as fast as the path falls.

    d, grade  as in `deepest_cut_offset`; the point is within the reach of the arc
    """
    r2 = d * d + w * w
    out = math.sqrt(r2) - shape.flat
    return out * out * w * w >= grade * grade * r2 * (shape.corner * shape.corner - out * out)


@inner_kernel
def deepest_cut_distance(shape: ToolShape, d: float, grade: float, max_distance: float) -> float:
    """Return the distance from the axis at which a tool corner cuts deepest.

    The point is at a distance d < reach from the path.

    flat, corner > 0; grade  as in `deepest_cut_offset`
    max_distance             upper bound of the result, mm

    With r² = d² + w², the arc rises along the path as fast as the path falls where

        (r − flat)² · (1 + grade² − d²/r²) − (grade · corner)² = 0.

    The left side increases with r ≥ max(flat, d) and is convex, so Newton's method from a larger r converges to the
    root from above.
    """
    square, corner_term = 1.0 + grade * grade, grade * grade * shape.corner * shape.corner
    r = max_distance
    if d < shape.flat:  # upper bound of the root, with the maximum of d²/r², which is at the edge of the flat
        turn = square - d * d / (shape.flat * shape.flat)
        if turn > 0.0:
            r = min(max_distance, shape.flat + math.sqrt(corner_term / turn))
    elif d > shape.flat:  # a Newton step from d, which is below the root, reaches or passes the root
        out = d - shape.flat
        r = min(max_distance, d + (corner_term - out * out * grade * grade) / (2.0 * out * (grade * grade + out / d)))
    for _ in range(_MOST_STEPS):
        out, share = r - shape.flat, d * d / (r * r)
        if out <= 0.0:  # on a nearly horizontal path, the root is rounded to the edge of the flat
            return shape.flat
        turn = square - share
        step = (out * out * turn - corner_term) / (2.0 * out * (turn + out * share / r))
        r -= step
        if step <= _CLOSE * shape.corner:
            break
    return r


@inner_kernel
def deepest_cut_offset(shape: ToolShape, d: float, grade: float, min_offset: float, max_offset: float) -> float:
    """Return the offset towards the lower end of a path at which the tool cuts deepest, at a distance d from the path.

    d            distance of the point from the path of the tool, mm
    grade        descent of the path per mm, > 0
    min_offset, max_offset  range of offsets on the path, mm; the caller clamps the result to this range. If the deepest
                 offset lies outside, any offset on the same side may be returned.

    The height is surface(√(d² + w²)) − grade · w. It is convex in w, so its only minimum is where the slope is 0.
    """
    at_reach = math.sqrt(max(shape.reach * shape.reach - d * d, 0.0))
    if d >= shape.reach or (shape.slope > 0.0 and shape.slope * at_reach < grade * shape.reach):
        if shape.slope <= grade:  # a cylinder, or a cone that is flatter than the descent
            return max_offset
        return max(grade * d / math.sqrt(shape.slope * shape.slope - grade * grade), at_reach)
    inner = math.sqrt(max(shape.flat * shape.flat - d * d, 0.0))
    if shape.corner <= 0.0 or max_offset <= inner:
        return inner
    if shape.flat <= 0.0:
        return grade * math.sqrt((shape.corner * shape.corner - d * d) / (1.0 + grade * grade))
    if min_offset >= at_reach or (min_offset > inner and corner_rises_faster_than_path(shape, d, grade, min_offset)):
        return min_offset
    farthest = shape.reach
    if max_offset < at_reach:
        if not corner_rises_faster_than_path(shape, d, grade, max_offset):
            return max_offset
        farthest = math.sqrt(d * d + max_offset * max_offset)
    r = deepest_cut_distance(shape, d, grade, farthest)
    return math.sqrt(max(r * r - d * d, 0.0))


@inner_kernel
def covered_range_in_row(y: float, dx: float, dy: float, radius: float) -> tuple[float, float]:
    """Return the range in x that a disc moving from (0, 0) by (dx, dy) covers in the row at y.

    If the disc does not reach the row, low > high. The disc's edge is farthest out where its normal is perpendicular to
    the path, or at an end of the path.
    """
    if abs(dy) < 1e-12:
        if abs(y) > radius:
            return math.inf, -math.inf
        half = math.sqrt(radius * radius - y * y)
        return min(0.0, dx) - half, max(0.0, dx) + half
    enters, leaves = (y - radius) / dy, (y + radius) / dy
    if enters > leaves:
        enters, leaves = leaves, enters
    enters, leaves = max(enters, 0.0), min(leaves, 1.0)
    if enters > leaves:
        return math.inf, -math.inf
    side = math.copysign(radius / math.sqrt(dx * dx + dy * dy), dy) * dx
    t = min(max((y - side) / dy, enters), leaves)
    v = y - t * dy
    low = t * dx - math.sqrt(max(radius * radius - v * v, 0.0))
    t = min(max((y + side) / dy, enters), leaves)
    v = y - t * dy
    return low, t * dx + math.sqrt(max(radius * radius - v * v, 0.0))


@inner_kernel
def rows_in_reach(y: float, dy: float, radius: float, first: int, last: int, cell: float) -> tuple[int, int]:
    """Return the first and the last row within first … last − 1 that a disc reaches while moving from y by dy."""
    low, high = min(y, y + dy) - radius, max(y, y + dy) + radius
    return max(first, math.ceil(low / cell)), min(last - 1, math.floor(high / cell))


@inner_kernel
def columns_in_range(low: float, high: float, columns: int, cell: float) -> tuple[int, int]:
    """Return the first and the last column whose centres lie within low … high. The limits themselves are included."""
    return max(0, math.ceil(low / cell - 1e-9)), min(columns - 1, math.floor(high / cell + 1e-9))


@inner_kernel
def lowest_tool_height(
    shape: ToolShape, margin: float, along: float, d: float, length: float, grade: float, bound_limit: float
) -> float:
    """Compute the lowest height of a tool above a point under its path, relative to the start of the tip, mm.

    along, d     position of the point: along the path from its start, and to the side of the path, mm
    length       length of the path in the plane, mm; 0 if vertical
    grade        rise of the path per mm
    bound_limit  above this height, any lower bound of the result may be returned, mm
    """
    if length <= 0.0:
        return tool_surface_height(shape, min(math.sqrt(d * d + along * along) + margin, shape.radius))
    w = min(max(0.0, -along), length - along)
    if grade != 0.0:
        # Lower bound: the lowest height of the tip, at the smallest distance of the point.
        bound = min(0.0, grade * length) + tool_surface_height(
            shape, min(math.sqrt(d * d + w * w) + margin, shape.radius)
        )
        if bound >= bound_limit:
            return bound
        edge = shape.radius - margin
        max_offset = math.sqrt(max(edge * edge - d * d, 0.0))
        if grade > 0.0:
            w = -min(deepest_cut_offset(shape, abs(d), grade, along - length, min(max_offset, along)), max_offset)
        else:
            w = min(deepest_cut_offset(shape, abs(d), -grade, -along, min(max_offset, length - along)), max_offset)
        w = min(max(w, -along), length - along)
    return grade * (along + w) + tool_surface_height(shape, min(math.sqrt(d * d + w * w) + margin, shape.radius))


@inner_kernel
def material_height_over_tool(rows: CellRows, shape: ToolShape, move: NDArray, margin: float) -> float:
    """Compute how far material reaches above the surface of a tool along its path, in mm.

    The tool is enlarged by a margin all around. A negative value means that all material is below the tool. −∞ means
    that these rows contain no material under the tool. On a sloped move, the tool is assumed to pass each point at its
    lowest height and its smallest distance.
    """
    xa, ya, z_low = move[0] - rows.x, move[1] - rows.y, min(move[2], move[5])
    dx, dy = move[3] - move[0], move[4] - move[1]
    length = math.sqrt(dx * dx + dy * dy)
    ux, uy = (dx / length, dy / length) if length > 1e-9 else (1.0, 0.0)
    radius = shape.radius + margin
    highest = -math.inf
    row_low, row_high = rows_in_reach(ya, dy, radius, rows.first, rows.last, rows.cell)
    for row in range(row_low, row_high + 1):
        y = row * rows.cell - ya
        low, high = covered_range_in_row(y, dx, dy, radius)
        if low > high:
            continue
        column_low, column_high = columns_in_range(low + xa, high + xa, rows.heights.shape[1], rows.cell)
        for column in range(column_low, column_high + 1):
            h = float(rows.heights[row, column]) - z_low
            if h <= highest:
                continue
            x = column * rows.cell - xa
            along, d = x * ux + y * uy, y * ux - x * uy
            beyond = max(-along, along - length, 0.0)
            distance = math.sqrt(d * d + beyond * beyond)
            highest = max(highest, h - tool_surface_height(shape, min(max(distance - margin, 0.0), shape.radius)))
    return highest


@inner_kernel
def body_collision_depth(
    rows: CellRows, radius: float, body: ToolShape, above: float, move: NDArray, film: float
) -> tuple[float, float]:
    """Compute how deep a body above the flutes enters material during a move, in mm, and how many cells it affects.

    radius  radius of the cutting tool, mm; material under the tool is cut and cannot hit the body
    body    underside of the body, as a surface above its lower end
    above   height of that lower end above the tip, mm

    The body is reduced by one cell all around. Otherwise, it would hit every wall that its tool has just cut. A body
    that is no wider than its tool can only hit material where the tool cuts deeper than its flute length.
    """
    xa, ya, za = move[0] - rows.x, move[1] - rows.y, move[2] + above
    dx, dy, dz = move[3] - move[0], move[4] - move[1], move[5] - move[2]
    length = math.sqrt(dx * dx + dy * dy)
    inner_radius = body.radius - rows.cell
    deepest, cells = 0.0, 0.0
    if inner_radius <= 0.0:
        return deepest, cells
    ux, uy, grade, lowest = 1.0, 0.0, 0.0, min(za, za + dz)
    if length < 1e-9:
        length, za = 0.0, lowest
    else:
        ux, uy, grade = dx / length, dy / length, dz / length
    # The tool contacts the material ahead at its own edge.
    search_radius = max(inner_radius, radius)
    row_low, row_high = rows_in_reach(ya, dy, search_radius, rows.first, rows.last, rows.cell)
    for row in range(row_low, row_high + 1):
        y = row * rows.cell - ya
        low, high = covered_range_in_row(y, dx, dy, search_radius)
        if low > high:
            continue
        column_low, column_high = columns_in_range(low + xa, high + xa, rows.heights.shape[1], rows.cell)
        for column in range(column_low, column_high + 1):
            h = float(rows.heights[row, column])
            if h <= lowest + film:
                continue
            x = column * rows.cell - xa
            along, d = x * ux + y * uy, y * ux - x * uy
            if abs(d) > inner_radius or along * along + d * d <= radius * radius:
                continue
            until = length
            if abs(d) < radius and along > 0.0:
                until = min(length, along - math.sqrt(radius * radius - d * d))
            else:
                beyond = max(-along, along - length, 0.0)
                if beyond * beyond + d * d > inner_radius * inner_radius:
                    continue
            depth = h - za - lowest_tool_height(body, rows.cell, along, d, until, grade, h - za)
            if depth > film:
                deepest = max(deepest, depth)
                cells += 1.0
    return deepest, cells


@inner_kernel
def measure_body_collision(
    rows: CellRows, shape: ToolShape, move: NDArray, film: float, top: float, bodies: NDArray, result: NDArray
) -> None:
    """Check whether a body above the flutes hits material during a move (see `cut_moves`).

    Changes: result[6], result[7], result[8].
    """
    for b in range(len(bodies)):
        above = bodies[b, 6]
        if min(move[2], move[5]) + above >= top:
            continue
        body = ToolShape(bodies[b, 0], bodies[b, 1], bodies[b, 2], bodies[b, 3], bodies[b, 4], bodies[b, 5])
        deepest, cells = body_collision_depth(rows, shape.radius, body, above, move, film)
        column = 6 if bodies[b, 7] == 0.0 else 7
        result[column] = max(result[column], deepest)
        if column == 6 and body.radius - rows.cell <= shape.radius:
            result[8] += cells
        elif column == 6 and cells > 0.0:
            result[8] = math.inf


@kernel
def cut_moves(
    rows: CellRows,
    shape: ToolShape,
    moves: NDArray,
    selected: NDArray,
    inset: NDArray,
    margin: float,
    film: float,
    top: float,
    bodies: NDArray,
    result: NDArray,
) -> int:
    """Cut some rows of a height field with one move after another, and return the number of lowered cells.

    moves        float64[m, 6]           start and end of the tip, mm
    selected     int64[k]                moves to process, in order
    inset        float64[m]              reduction of the tool radius for rapids, mm; otherwise 0
    margin       additional radius of the tool for `result[:, 5]`, mm; negative if not requested
    film         layers up to this thickness, mm, are rounding errors: they are removed, but only their volume counts
    top          upper bound on the height of the material, mm
    bodies       float64[b, 8]           parts of the tool above its flutes: the six numbers of a `ToolShape`, height of
                                         the lower end above the tip, mm, and 0 for a shank or 1 for a holder
    result       float64[k, 9]           per move: removed height, mm summed over cells; cut cells; deepest cut, mm;
                                         minimum and maximum distance to the left of the path at which it cut, mm;
                                         height of material over the wider tool, mm; depths of the shank and of the
                                         holder in the material, mm; cells of a shank that is no wider than the tool

    Changes: rows.heights, rows.lowered, result.
    Source: the swept volume of a convex tool along a line, seen from above: at every point the minimum of the tool's
    surface along the path, which is convex in the position on the path.
    """
    total = 0
    for k in range(len(selected)):
        i = selected[k]
        result[k, 0], result[k, 1], result[k, 2] = 0.0, 0.0, 0.0
        result[k, 3], result[k, 4], result[k, 5] = math.inf, -math.inf, -math.inf
        result[k, 6], result[k, 7], result[k, 8] = 0.0, 0.0, 0.0
        if margin >= 0.0:
            result[k, 5] = material_height_over_tool(rows, shape, moves[i], margin)
        if len(bodies):
            measure_body_collision(rows, shape, moves[i], film, top, bodies, result[k])
        xa, ya, za = moves[i, 0] - rows.x, moves[i, 1] - rows.y, moves[i, 2]
        dx, dy, dz = moves[i, 3] - moves[i, 0], moves[i, 4] - moves[i, 1], moves[i, 5] - za
        length = math.sqrt(dx * dx + dy * dy)
        radius = shape.radius - inset[i]
        if radius <= 0.0:
            continue
        ux, uy, grade, z_low = 1.0, 0.0, 0.0, min(za, za + dz)
        if length < 1e-9:
            length = 0.0
        else:
            ux, uy, grade = dx / length, dy / length, dz / length
        z_start = z_low if length == 0.0 else za
        level = grade == 0.0 and shape.flat >= shape.radius
        row_low, row_high = rows_in_reach(ya, dy, radius, rows.first, rows.last, rows.cell)
        for row in range(row_low, row_high + 1):
            y = row * rows.cell - ya
            low, high = covered_range_in_row(y, dx, dy, radius)
            if low > high:
                continue
            column_low, column_high = columns_in_range(low + xa, high + xa, rows.heights.shape[1], rows.cell)
            for column in range(column_low, column_high + 1):
                h = float(rows.heights[row, column])
                if h <= z_low:
                    continue
                x = column * rows.cell - xa
                d = y * ux - x * uy
                z = z_low
                if not level:
                    z = z_start + lowest_tool_height(shape, inset[i], x * ux + y * uy, d, length, grade, h - z_start)
                if z < h:
                    rows.heights[row, column] = z
                    if inset[i] > 0.0 and len(rows.lowered):
                        rows.lowered[row, column] = z
                    result[k, 0] += h - z
                    if h - z > film:
                        result[k, 1] += 1.0
                        result[k, 2] = max(result[k, 2], h - z)
                        result[k, 3] = min(result[k, 3], d)
                        result[k, 4] = max(result[k, 4], d)
                        total += 1
    return total
