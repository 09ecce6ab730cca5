"""Check a nest independently of the planner by counting its parts and measuring the distances between them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Point, Polygon, STRtree

from leafcut.geometry.index import connected_components
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, Placement, Stock
from leafcut.model.sheet import Sheet

#: Chord error of arcs, mm. It is added to the required distance for each outline that contains arcs.
CHORD = 0.005
#: Tolerance for rounding errors of distances, mm.
ROUNDING = 1e-5
#: Largest accepted difference between the plan and the drawing that was read back, mm.
SAME_PLACE = 1e-3
#: Minimum length of a common edge, mm.
COMMON = 2.0
#: Largest difference between equal angles, rad.
SAME_ANGLE = 1e-6


def check_nest(nest: Nest, spacing: float, margin: float, kerf: float = 0.0) -> list[Message]:
    """Check a nest and return its errors as messages. The list is empty if the nest can be cut.

    * The number of sheets of each kind does not exceed the available number.
    * Every part is placed as often as requested, at an allowed rotation, and inside the margin of the sheet.
    * Parts are at least `spacing` mm apart, and at least as far from the edge of a surrounding hole. With a `kerf`
      (mm), parts may be one kerf apart if they share common edges.
    """
    errors = _check_sheets(nest) + _check_counts(nest)
    for number, layout in enumerate(nest.layouts, 1):
        messages = (
            _check_angles(nest, layout)
            + _check_inside_sheet(nest, layout, margin)
            + _check_distances(nest, layout, spacing, kerf)
        )
        errors += [Message("sheet {}: {}", number, line) for line in messages]
    return errors


def _check_counts(nest: Nest) -> list[Message]:
    placed = Counter[int]()
    for layout in nest.layouts:
        for placement in layout.placements:
            placed[placement.part] += layout.count
    expected = [part.quantity - missing for part, missing in zip(nest.parts, nest.unplaced, strict=True)]
    return [
        Message("{}: {} placed, {} expected", part.name, placed[i], wanted)
        for i, (part, wanted) in enumerate(zip(nest.parts, expected, strict=True))
        if placed[i] != wanted
    ]


def _check_sheets(nest: Nest) -> list[Message]:
    used = Counter[int]()
    for layout in nest.layouts:
        used[layout.stock] += layout.count
    return [
        Message("{} sheets of {} are used, {} are available", used[k], stock.name, stock.count)
        for k, stock in enumerate(nest.stocks)
        if stock.count is not None and used[k] > stock.count
    ]


def _check_angles(nest: Nest, layout: Layout) -> list[Message]:
    return [
        Message("{}: is rotated by {:g}°, which is not allowed", nest.parts[p.part].name, math.degrees(p.angle))
        for p in layout.placements
        if not _is_allowed_angle(p.angle, nest.parts[p.part].rotations)
    ]


def _is_allowed_angle(angle: float, rotations: tuple[float, ...] | None) -> bool:
    return rotations is None or any(abs(math.remainder(angle - r, math.tau)) <= SAME_ANGLE for r in rotations)


def _check_inside_sheet(nest: Nest, layout: Layout, margin: float) -> list[Message]:
    min_edge, stock = margin - ROUNDING, nest.stock_of(layout)
    if stock.edge:
        return _check_inside_outline(nest, layout, margin)
    errors: list[Message] = []
    for p in layout.placements:
        x0, y0, x1, y1 = p.placed(nest.parts[p.part].outline).extents
        if min(x0, y0) < min_edge or x1 > stock.length - min_edge or y1 > stock.width - min_edge:
            errors.append(
                Message(
                    "{}: extends from ({:.3f}, {:.3f}) to ({:.3f}, {:.3f})", nest.parts[p.part].name, x0, y0, x1, y1
                )
            )
    return errors


def _check_inside_outline(nest: Nest, layout: Layout, margin: float) -> list[Message]:
    outline, *holes = (path.flattened(CHORD) for path in nest.stock_of(layout).paths)
    sheet = shapely.Polygon(outline, holes)
    rounded = any(path.bulges.any() for path in nest.stock_of(layout).paths)
    errors: list[Message] = []
    for p in layout.placements:
        shell = shapely.Polygon(_placed_region(nest, p).exterior)
        distance = shell.distance(sheet.boundary) - CHORD * (rounded + _has_arcs(nest, p)[0])
        if not sheet.contains(shell) or distance < margin - ROUNDING:
            x, y = shell.representative_point().coords[0]
            errors.append(
                Message(
                    "{}: lies {:.3f} mm from the edge near ({:.1f}, {:.1f})", nest.parts[p.part].name, distance, x, y
                )
            )
    return errors


def _check_distances(nest: Nest, layout: Layout, spacing: float, kerf: float) -> list[Message]:
    placements = layout.placements
    regions = [_placed_region(nest, p) for p in placements]
    shells = [shapely.Polygon(region.exterior) for region in regions]
    rounds = [_has_arcs(nest, p) for p in placements]
    round_shell, round_hole = [CHORD * shell for shell, _ in rounds], [CHORD * hole for _, hole in rounds]
    tree = shapely.STRtree(regions)
    first, second = tree.query(regions, "dwithin", spacing + 2.0 * CHORD)
    close_pairs = [(i, j) for i, j in sorted(zip(first.tolist(), second.tolist(), strict=True)) if i < j]
    joined = [(i, j) for i, j in close_pairs if kerf > 0.0 and _have_common_edge(shells[i], shells[j], kerf)]
    groups = connected_components(len(regions), *np.array(joined, dtype=np.int64).reshape(-1, 2).T)
    errors = []
    for i, j in close_pairs:
        distance = regions[i].distance(regions[j])
        # The distance of a part in a hole of another part is measured from the edge of the hole.
        slack = (round_hole if shells[i].contains(shells[j]) else round_shell)[i]
        slack += (round_hole if shells[j].contains(shells[i]) else round_shell)[j]
        minimum = kerf if groups[i] == groups[j] else spacing + slack
        if distance < minimum - ROUNDING or (distance == 0.0 and regions[i].intersects(regions[j])):
            names = f"{nest.parts[placements[i].part].name} and {nest.parts[placements[j].part].name}"
            x, y = regions[j].representative_point().coords[0]
            errors.append(
                Message("{} are {:.3f} mm apart near ({:.1f}, {:.1f}), {:g} expected", names, distance, x, y, minimum)
            )
    return errors


def _have_common_edge(a: Polygon, b: Polygon, kerf: float) -> bool:
    if abs(a.distance(b) - kerf) > ROUNDING:
        return False
    return bool(b.exterior.intersection(a.buffer(kerf + SAME_PLACE)).length >= COMMON)


def _placed_paths(nest: Nest, placement: Placement) -> list[Polyline]:
    part = nest.parts[placement.part]
    return [placement.placed(path) for path in (part.outline, *part.holes)]


def _has_arcs(nest: Nest, placement: Placement) -> tuple[bool, bool]:
    outline, *holes = _placed_paths(nest, placement)
    return bool(outline.bulges.any()), any(hole.bulges.any() for hole in holes)


def _placed_region(nest: Nest, placement: Placement) -> Polygon:
    outline, *holes = (path.flattened(CHORD) for path in _placed_paths(nest, placement))
    return shapely.Polygon(outline, holes)


def check_remnants(
    nest: Nest, layout: Layout, remnants: Sequence[tuple[Stock, tuple[float, float]]], spacing: float
) -> list[Message]:
    """Check the remnants of a sheet and return their errors as messages. The list is empty if the remnants can be used.

    A remnant must lie within the sheet, at least `spacing` mm away from each part. `remnants` contains each remnant and
    the position of its lower left corner on the sheet, mm.
    """
    outline, *holes = (path.flattened(CHORD) for path in nest.stock_of(layout).paths)
    sheet = shapely.Polygon(outline, holes).buffer(2.0 * CHORD)
    shells = [shapely.Polygon(_placed_region(nest, p).exterior) for p in layout.placements]
    errors: list[Message] = []
    for stock, (x, y) in remnants:
        ring, *inner = (path.moved(x, y).flattened(CHORD) for path in stock.paths)
        piece = shapely.Polygon(ring, inner)
        if not piece.is_valid or not sheet.covers(piece):
            errors.append(Message("{} reaches beyond the sheet, or crosses itself", stock.name))
        close_shells = [shell for shell in shells if shell.distance(piece) < spacing - ROUNDING]
        errors += [
            Message("{} is {:.3f} mm from a part, {:g} expected", stock.name, shell.distance(piece), spacing)
            for shell in close_shells
        ]
    return errors


def check_drawing(nest: Nest, layout: Layout, sheet: Sheet) -> list[Message]:
    """Compare the planned sheet with the drawing that was read back. Return the differences as messages."""
    errors: list[Message] = []
    stock = nest.stock_of(layout)
    edges = [Contour(path, "sheet") for path in sheet.paths]
    for path in stock.paths:
        edge = next((candidate for candidate in edges if _is_same_contour(Contour(path, "sheet"), candidate)), None)
        if edge is None:
            errors.append(
                Message("the drawing does not show the edge of the {:g} × {:g} mm sheet", stock.length, stock.width)
            )
        else:
            edges.remove(edge)
    if edges:
        errors.append(Message("the sheet has a hole that was not planned"))
    if sheet.n_parts != len(layout.placements):
        errors.append(Message("{} parts are in the drawing, {} expected", sheet.n_parts, len(layout.placements)))
    drawn = sheet.contours
    tree = STRtree([Point(_box_centre(c.path)) for c in drawn])
    remaining = set(range(len(drawn)))
    names = Counter(nest.parts[p.part].label for p in layout.placements)
    if Counter(c.name for c in drawn if c.name) != names:
        errors.append(Message("the names of the parts differ from the drawing"))
    for contour in nest.contours(layout):
        candidates = tree.query(Point(_box_centre(contour.path)), "dwithin", SAME_PLACE)
        match = next(
            (int(i) for i in sorted(candidates) if int(i) in remaining and _is_same_contour(contour, drawn[i])), None
        )
        if match is None:
            x, y = contour.path.start
            errors.append(Message("a contour ({}) at ({:.3f}, {:.3f}) is not in the drawing", contour.kind, x, y))
        else:
            remaining.remove(match)
    return errors + [
        Message("a contour ({}) at {} is not in the nest", drawn[i].kind, drawn[i].path.start)
        for i in sorted(remaining)
    ]


def _box_centre(path: Polyline) -> tuple[float, float]:
    x0, y0, x1, y1 = path.extents
    return (0.5 * (x0 + x1), 0.5 * (y0 + y1))


def _is_same_contour(a: Contour, b: Contour) -> bool:
    if a.kind != b.kind or a.path.closed != b.path.closed or _boxes_differ(a.path.extents, b.path.extents):
        return False
    area = abs(abs(a.path.area) - abs(b.path.area))
    return abs(a.path.length - b.path.length) <= SAME_PLACE and area <= SAME_PLACE * max(a.path.length, 1.0)


def _boxes_differ(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return max(abs(p - q) for p, q in zip(a, b, strict=True)) > SAME_PLACE
