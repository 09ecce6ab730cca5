"""Filter the holes of a drawing by layer and diameter, and remove duplicates."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import ReadError, count_of, printable
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import is_annotation_layer, layer_filter
from leafcut.model.heights import SAME_HEIGHT
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.format import Source, first_positions_text, unknown_units_issue

#: Holes of equal diameter are duplicates if they are closer than this, mm.
MERGE_TOLERANCE = 0.01
#: Largest distance between the centres of concentric circles, relative to the larger radius.
_CONCENTRIC = 0.05
#: Tolerance in centre and radius of the arcs of one circle, mm: drawings keep 4 to 6 digits.
SAME_CIRCLE = 0.01
#: Largest gap between two arcs of a closed circle: the length along the arc, mm, and bounds for its angle, rad.
GAP_LENGTH, GAP_SMALLEST, GAP_LARGEST = 0.01, 2e-4, 0.01


def holes_on_part_layers(holes: Sequence[Hole], options: ReadOptions) -> tuple[list[Hole], list[Issue]]:
    """Return the holes that belong to the part, and issues.

    The function drops holes on layers for frames, texts and dimensions, unless `options.layers` is set. The dropped
    holes may be balloons or centre marks. Issue L204 reports their number, which reveals a part layer with a misleading
    name.
    """
    skipped_layers = (
        set() if options.layers else {layer for layer in {hole.layer for hole in holes} if is_annotation_layer(layer)}
    )
    skipped = [hole for hole in holes if hole.layer in skipped_layers]
    if not skipped:
        return list(holes), []
    layers = Counter(hole.layer for hole in skipped)
    layer_texts = Message.joined(
        ", ", (Message("{} on layer {}", count, printable(layer, 30)) for layer, count in layers.most_common(5))
    )
    more = " …" if len(layers) > 5 else ""
    message = Message(
        "circles on layers that are named like a drawing frame, text or dimension will not be drilled: {}{}; "
        "choose the layers to drill with --layers",
        layer_texts,
        more,
    )
    positions = [(hole.x, hole.y) for hole in skipped]
    return [hole for hole in holes if hole.layer not in skipped_layers], [
        Issue("L204", message, first_positions_text(positions))
    ]


def part_of_points(
    source: Source,
    holes: Sequence[Hole],
    issues: list[Issue],
    options: ReadOptions,
    format_name: str,
    own_units: str | None,
    noun: Message,
) -> Part:
    """Create the part of a list of points: the holes on the chosen layers and the holes without a layer.

    Raises
    ------
    ReadError
        No hole remains.
    """
    chosen = layer_filter(options.layers)
    on_layer = [h for h in holes if not h.layer or chosen(h.layer)]
    left_out = []
    if n_left_out := len(holes) - len(on_layer):
        message = Message("left out {} on layers that are not selected", count_of(n_left_out, "hole"))
        left_out.append(Issue("L204", message, severity=Severity.NOTE))
    kept, selection_issues = select_holes(on_layer, options, point_tolerance=0.0)
    if not kept:
        reasons = Message.joined("; ", (i.message for i in (*left_out, *selection_issues)))
        raise ReadError(source.path, Message("no holes: {}", reasons))
    units = options.units or own_units
    part = Part(source.name, kept, source=source.file_name, format=format_name, units=units or "mm")
    if units is None:
        selection_issues.append(unknown_units_issue(noun, part, Severity.NOTE))
    return replace(part, issues=(*issues, *left_out, *selection_issues))


def select_holes(
    holes: Sequence[Hole], options: ReadOptions, point_tolerance: float = MERGE_TOLERANCE
) -> tuple[tuple[Hole, ...], list[Issue]]:
    """Return the holes to drill, in file order, and issues.

    * Holes outside the chosen diameters are left out (L205).
    * If holes of equal diameter coincide, the first is kept (L301).
    * If circles are concentric, `options.concentric` selects the circle to keep (L302).
    * A bare point in the centre of a circle is a centre mark and not a hole.

    Bare points closer than `point_tolerance` (mm) are duplicates. If it is None, `MERGE_TOLERANCE` applies.
    """
    issues: list[Issue] = []
    kept = _filter_by_diameter(holes, options, issues)
    kept = _without_duplicates(kept, point_tolerance, issues)
    kept = _without_centre_marks(kept, issues)
    if options.concentric != "all":
        kept = _select_concentric(kept, options, issues)
        # The remaining circle may have a centre mark that belonged to a circle just removed.
        kept = _without_centre_marks(kept, issues)
    return tuple(kept), issues


def _filter_by_diameter(holes: Sequence[Hole], options: ReadOptions, issues: list[Issue]) -> list[Hole]:
    low = options.min_diameter if options.min_diameter is not None else 0.0
    high = options.max_diameter if options.max_diameter is not None else math.inf
    # The conversion from inches rounds: a limit of 6.35 must include a hole of 1/4 in.
    slack = 1e-6
    kept = [h for h in holes if low - slack <= h.diameter <= high + slack]
    if n_left_out := len(holes) - len(kept):
        issues.append(
            Issue(
                "L205",
                Message("left out {} outside the selected range of diameters", count_of(n_left_out, "hole")),
                severity=Severity.NOTE,
            )
        )
    return kept


def _without_duplicates(holes: list[Hole], point_tolerance: float, issues: list[Issue]) -> list[Hole]:
    double = [False] * len(holes)
    highest = [h.z for h in holes]
    for circles, reach in ((True, MERGE_TOLERANCE), (False, point_tolerance)):
        rows = [i for i, hole in enumerate(holes) if (hole.diameter > 0) == circles]
        table = np.array([(holes[i].x, holes[i].y, holes[i].diameter) for i in rows]).reshape(-1, 3)
        for row, first in zip(rows, anchors_of_points(table, reach), strict=True):
            double[row] = rows[first] != row
            # Both edges of a hole may be drawn: the hole starts at the upper edge.
            highest[rows[first]] = max(highest[rows[first]], holes[row].z)
    if duplicates := [(h.x, h.y) for h, is_double in zip(holes, double, strict=True) if is_double]:
        issues.append(
            Issue(
                "L301",
                Message("merged {} drawn on top of another of the same diameter", count_of(len(duplicates), "hole")),
                first_positions_text(duplicates),
            )
        )
    return [_hole_at_height(h, z) for h, z, is_double in zip(holes, highest, double, strict=True) if not is_double]


def _hole_at_height(hole: Hole, z: float) -> Hole:
    return hole if hole.z == z else replace(hole, z=z)


def _without_centre_marks(holes: list[Hole], issues: list[Issue]) -> list[Hole]:
    circles = [h for h in holes if h.diameter > 0]
    if not circles or len(circles) == len(holes):
        return holes
    # Circles first: a point whose anchor is a circle marks its centre.
    ordered = circles + [h for h in holes if h.diameter <= 0]
    table = np.array([(h.x, h.y, 0.0) for h in ordered])
    first_rows = anchors_of_points(table, MERGE_TOLERANCE)
    marks = {id(ordered[i]) for i in range(len(circles), len(ordered)) if first_rows[i] < len(circles)}
    if marks:
        issues.append(
            Issue(
                "L302",
                Message("treated {} in the centre of a circle as centre marks", count_of(len(marks), "point")),
                severity=Severity.NOTE,
            )
        )
    return [h for h in holes if id(h) not in marks]


def _select_concentric(holes: list[Hole], options: ReadOptions, issues: list[Issue]) -> list[Hole]:
    sign = 1.0 if options.concentric == "smallest" else -1.0
    circles = [i for i, hole in enumerate(holes) if hole.diameter > 0]
    order = sorted(circles, key=lambda i: sign * holes[i].diameter)
    table = np.array([(holes[i].x, holes[i].y, 0.0) for i in order]).reshape(-1, 3)
    anchor_ranks = _concentric_anchors(table, [0.5 * holes[i].diameter for i in order])
    removed = {row for rank, row in enumerate(order) if anchor_ranks[rank] != rank}
    highest = [hole.z for hole in holes]
    for rank, row in enumerate(order):
        kept_row = order[anchor_ranks[rank]]
        highest[kept_row] = max(highest[kept_row], holes[row].z)
    raised = [(h.x, h.y) for i, h in enumerate(holes) if i not in removed and highest[i] > h.z + SAME_HEIGHT]
    if raised:
        # A rapid to the height of the lower circle would enter the material above it.
        message = Message("concentric circles are drawn at different heights, so the hole starts at the highest")
        issues.append(Issue("L406", message, first_positions_text(raised)))
    if removed:
        positions = [(holes[i].x, holes[i].y) for i in sorted(removed)]
        issues.append(
            Issue(
                "L302",
                Message(
                    "left out {} in favour of the {} with the same centre",
                    count_of(len(removed), "circle"),
                    options.concentric,
                ),
                first_positions_text(positions),
                missing=MissingWork("circle", len(positions), tuple(positions)),
            )
        )
    return [_hole_at_height(hole, highest[i]) for i, hole in enumerate(holes) if i not in removed]


def _concentric_anchors(centres: NDArray[np.float64], radii: list[float]) -> list[int]:
    """Return the anchor of each circle like `anchors_of_points`, but use the tolerance for concentric circles."""
    anchor_of = anchors_of_points(centres, MERGE_TOLERANCE)
    table = np.column_stack([centres[:, :2], radii])
    pairs = []
    reach = np.maximum(MERGE_TOLERANCE, _CONCENTRIC * table[:, 2])
    for k, neighbours, distances in _nearby_smaller_circles(table, reach):
        steps = neighbours[distances <= _concentric_tolerance(table[k, 2], table[neighbours, 2])]
        pairs += [(min(k, step), max(k, step)) for step in steps.tolist()]
    for first, second in sorted(pairs):
        if anchor_of[first] == first and anchor_of[second] == second:
            anchor_of[second] = first
    return [anchor_of[k] for k in anchor_of]


def outline_circle_indices(holes: Sequence[Hole], paths: Sequence[Polyline]) -> list[int]:
    """Return the circles that are outlines of parts and not holes.

    Such a circle encloses an off-centre hole, or several off-centre contours that lie apart. Concentric circles are
    steps of one hole. A concentric contour, or a single contour, may be drawn inside a hole, for example the square of
    a screw head, or a letter.
    """
    table = np.array([(hole.x, hole.y, 0.5 * hole.diameter) for hole in holes]).reshape(-1, 3)
    radius = table[:, 2]
    outlines = set()
    for k, neighbours, distances in _nearby_smaller_circles(table, radius):
        off_centre = distances > _concentric_tolerance(radius[k], radius[neighbours])
        if (off_centre & (distances + radius[neighbours] <= radius[k])).any():
            outlines.add(k)
    boxes: dict[int, list[tuple[float, float, float, float]]] = {}
    low, high = table[:, :2] - table[:, 2:], table[:, :2] + table[:, 2:]
    for path in paths:
        x0, y0, x1, y1 = path.extents
        middle, half = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), 0.5 * min(x1 - x0, y1 - y0)
        for k in np.flatnonzero(((low <= (x0, y0)) & (high >= (x1, y1))).all(axis=1)).tolist():
            if math.dist(middle, table[k, :2]) <= _concentric_tolerance(radius[k], half):
                continue
            if np.hypot(*(path.flattened() - table[k, :2]).T).max() <= radius[k]:
                boxes.setdefault(k, []).append((x0, y0, x1, y1))
    for k, inner_boxes in boxes.items():
        # Two boxes are apart if, in one axis, one starts after the other ends.
        starts, ends = np.array(inner_boxes)[:, :2].max(axis=0), np.array(inner_boxes)[:, 2:].min(axis=0)
        if (starts > ends).any():
            outlines.add(k)
    return sorted(outlines)


def _concentric_tolerance(radius: float, inner: Any) -> Any:
    """Return the maximum distance between the centres of two concentric items, mm.

    `inner` is the radius of the inner item, which must contain the centre of the circle.
    """
    return np.maximum(MERGE_TOLERANCE, np.minimum(_CONCENTRIC * radius, inner))


def _nearby_smaller_circles(
    table: NDArray[np.float64], reach: NDArray[np.float64]
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.float64]]]:
    """Yield each circle with the smaller circles near it.

    A row of `table` contains x, y and radius. Each result has the index of the circle, the indices of the smaller
    circles within `reach` in x, and the distances between their centres and the centre of the circle.
    """
    x, y, radius = table.T
    order = np.argsort(x, kind="stable")
    first = np.searchsorted(x[order], x - reach, "left")
    last = np.searchsorted(x[order], x + reach, "right")
    for k in np.flatnonzero((last - first > 1) & (radius > radius.min(initial=np.inf))).tolist():
        neighbours = order[first[k] : last[k]]
        neighbours = neighbours[radius[neighbours] < radius[k]]
        yield k, neighbours, np.hypot(x[neighbours] - x[k], y[neighbours] - y[k])


def anchors_of_points(points: NDArray[np.float64], tolerance: float) -> list[int]:
    """Return the first anchor within `tolerance` of each point.

    A point without an earlier anchor nearby becomes an anchor.

    The function processes the points in order, so anchors are more than `tolerance` apart. It only uses a grid to find
    candidates, so the cell borders do not matter. The run time is O(n), because a cell holds few anchors.

    `points` is float64[n, 3], finite. The distance is Euclidean in the first two columns; the third column may differ
    by `tolerance`.
    """
    anchor_rows = list(range(len(points)))
    cells: dict[tuple[float, float, float], list[int]] = {}
    rows = points.tolist()
    for i in np.flatnonzero(_is_near_another_point(points, tolerance)).tolist():
        x, y, w = rows[i]
        cell = _grid_cell(x, y, w, tolerance)
        best = i
        for key in _neighbour_cells(cell, tolerance):
            for j in cells.get(key, ()):
                xj, yj, wj = rows[j]
                if j < best and abs(w - wj) <= tolerance and math.hypot(x - xj, y - yj) <= tolerance:
                    best = j
        anchor_rows[i] = best
        if best == i:
            cells.setdefault(cell, []).append(i)
    return anchor_rows


def _grid_cell(x: float, y: float, w: float, tolerance: float) -> tuple[float, float, float]:
    if tolerance <= 0:
        return (x, y, w)
    # Cells are slightly wider than the tolerance, so that rounding cannot put neighbours two cells apart.
    size = tolerance * 1.001
    return (x // size, y // size, w // size)


def _neighbour_cells(cell: tuple[float, float, float], tolerance: float) -> list[tuple[float, float, float]]:
    if tolerance <= 0:
        return [cell]
    x, y, w = cell
    return [(x + i, y + j, w + k) for i, j, k in product((-1.0, 0.0, 1.0), repeat=3)]


def _is_near_another_point(points: NDArray[np.float64], tolerance: float) -> NDArray[np.bool_]:
    """Return a mask, bool[n], of the points that share their cell or an adjacent cell with another point.

    All other points are anchors.
    """
    if len(points) < 2:
        return np.zeros(len(points), dtype=np.bool_)
    size = max(tolerance, 1e-3)
    # Coordinates are within ±1e6 mm: a cell number fits in 31 bits, and two of them in one key.
    column = np.floor(points[:, 0] / size).astype(np.int64)
    key = column * 2**32 + np.floor(points[:, 1] / size).astype(np.int64)
    cells, counts = np.unique(key, return_counts=True)
    total = np.zeros(len(points), dtype=np.int64)
    for i, j in product((-1, 0, 1), repeat=2):
        neighbour = key + i * 2**32 + j
        index = np.minimum(np.searchsorted(cells, neighbour), len(cells) - 1)
        total += np.where(cells[index] == neighbour, counts[index], 0)
    crowded: NDArray[np.bool_] = total > 1
    return crowded


class ArcPiece(NamedTuple):
    """An arc in mm and rad. It runs counter-clockwise from `start` over the angle `sweep`.

    `entity` is the number of the entity that contains the arc.
    """

    x: float
    y: float
    radius: float
    start: float
    sweep: float
    entity: int
    z: float = 0.0


def join_arcs_to_circles(pieces: Sequence[ArcPiece]) -> tuple[list[ArcPiece], set[int]]:
    """Find the circles that arcs close, in O(n log n).

    Returns
    -------
    list of ArcPiece
        The first piece of each circle, in the given order.
    set of int
        The entities of all pieces of the circles.
    """
    table = np.array([(p.x, p.y, p.radius) for p in pieces]).reshape(-1, 3)
    groups: dict[int, list[ArcPiece]] = {}
    for piece, anchor in zip(pieces, anchors_of_points(table, SAME_CIRCLE), strict=True):
        groups.setdefault(anchor, []).append(piece)
    circles: list[ArcPiece] = []
    used: set[int] = set()
    for group in groups.values():
        if _covers_full_turn(group):
            circles.append(group[0])
            used.update(p.entity for p in group)
    return circles, used


def _covers_full_turn(group: list[ArcPiece]) -> bool:
    gap = min(max(GAP_LENGTH / group[0].radius, GAP_SMALLEST), GAP_LARGEST)
    if sum(p.sweep for p in group) < math.tau - gap * len(group):
        return False
    spans = sorted((p.start % math.tau, p.sweep) for p in group)
    first_start = spans[0][0]
    covered = first_start
    for start, sweep in spans:
        if start > covered + gap:
            return False
        covered = max(covered, start + sweep)
    # The last piece must meet the first again, one turn later.
    return covered >= first_start + math.tau - gap
