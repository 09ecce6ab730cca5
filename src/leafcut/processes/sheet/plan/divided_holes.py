"""Holes that the kerf divides, and notches whose mouths it closes: each piece that it reaches becomes a hole."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.processes.sheet.plan.cut_contours import FLATNESS, ROUNDING, SMALL, flat_line
from leafcut.processes.sheet.plan.cut_rules import CutRules

#: Corners of a piece are as sharp as drawn up to this ratio of their length to half a kerf.
MITRE = 2.0
#: Arcs leave the chords of a piece by no more than this, mm.
FITTED = 0.002


def with_divided_holes(sheet: Sheet, rules: CutRules) -> tuple[Sheet, list[Issue]]:
    """Return a sheet with each hole that the kerf divides as its pieces, and what stays uncut of these holes (L612).

    The first piece takes the place of the hole, the others come last, so that no contour gets another number. What a
    hole holds belongs to the piece around it; a hole with something outside of its pieces stays unchanged: it is
    reported and not cut.
    """
    contours, added, issues = list(sheet.contours), list[SheetContour](), []
    for index, one in enumerate(sheet.contours):
        if not one.is_hole or one.contour.kind != "cut":
            continue
        hole = shapely.Polygon(one.contour.path.flattened(FLATNESS))
        rings = shapely.get_parts(hole.buffer(-rules.half, quad_segs=16))
        pieces = _pieces(hole, rings, rules) if len(rings) > 1 else []
        held = [k for k, c in enumerate(sheet.contours) if c.parent == index]
        around = [_piece_around(sheet.contours[k], pieces) for k in held]
        if not pieces or None in around:
            continue
        numbers = [index, *(len(contours) + len(added) + k for k in range(len(pieces) - 1))]
        contours[index], *others = (replace(one, contour=replace(one.contour, path=path)) for path in pieces)
        added += others
        for k, piece in zip(held, around, strict=True):
            contours[k] = replace(contours[k], parent=numbers[piece or 0])
        issues.append(_uncut(one, hole, pieces, rules))
    return (replace(sheet, contours=(*contours, *added)), issues) if issues else (sheet, [])


def with_chambers(sheet: Sheet, rules: CutRules) -> Sheet:
    """Return a sheet with the chambers of notches as holes: a kerf does not come in through their mouths.

    They come last. What a chamber holds belongs to it. An outline stays unchanged if anything else lies in its notches.
    Cuts that start at the edge of the sheet do not reach a chamber.
    """
    if rules.edge_start:
        return sheet
    contours, lines = list(sheet.contours), [flat_line(one.contour.path) for one in sheet.contours]
    obstacles = np.array([*(shapely.box(*zone) for zone in sheet.zones), *map(flat_line, sheet.paths)], dtype=object)
    for index, one in enumerate(sheet.contours):
        if one.is_hole or one.contour.kind != "cut" or not one.contour.path.closed:
            continue
        notches, rings = _closed_notches(shapely.Polygon(lines[index].coords), rules)
        pieces = _pieces(notches, rings, rules)
        if not pieces or len(pieces) < len(rings) or notches.intersects(obstacles).any():
            continue
        beside = [k for k, c in enumerate(contours) if c.parent == contours[index].parent and k != index]
        held = [k for k in beside if notches.intersects(lines[k])]
        around = [_piece_around(contours[k], pieces) for k in held]
        if None in around:
            continue
        for k, piece in zip(held, around, strict=True):
            contours[k] = replace(contours[k], parent=len(contours) + (piece or 0))
        chamber = replace(contours[index], depth=one.depth + 1, chamber=True)
        contours += (replace(chamber, contour=replace(one.contour, path=path)) for path in pieces)
        lines += map(flat_line, pieces)
    return replace(sheet, contours=tuple(contours))


def _closed_notches(outline: Any, rules: CutRules) -> tuple[Any, list[Any]]:
    """Return what the kerf closes of the notches of an outline, and the rings that its middle follows there.

    A ring has room for a pierce, and its kerf runs into no other: the arc would go out.
    """
    grown = outline.buffer(rules.half, quad_segs=16)
    ways = [grown.exterior, *grown.interiors]
    rings = [
        shapely.Polygon(way)
        for k, way in enumerate(ways[1:], 1)
        if shapely.distance(way, ways[:k] + ways[k + 1 :]).min() > rules.kerf + 2.0 * ROUNDING
        and not shapely.Polygon(way).buffer(-rules.half - ROUNDING).is_empty
    ]
    if not rings:
        return shapely.Polygon(), []
    closed = shapely.Polygon(grown.exterior).buffer(-rules.half, quad_segs=16).difference(outline)
    notches = [part for part in shapely.get_parts(closed) if any(part.intersects(ring) for ring in rings)]
    return shapely.union_all(notches), rings


def _piece_around(held: SheetContour, pieces: list[Polyline]) -> int | None:
    """Return the position of the piece of a hole that lies around a contour; None if there is none."""
    points = shapely.MultiPoint(held.contour.path.flattened(FLATNESS))
    around = (k for k, path in enumerate(pieces) if shapely.Polygon(path.flattened(FLATNESS)).covers(points))
    return next(around, None)


def _pieces(hole: Any, rings: Iterable[Any], rules: CutRules) -> list[Polyline]:
    """Return the pieces of a hole or a notch around the rings that the middle of the kerf reaches, if a pierce fits."""
    found = []
    for ring in sorted(rings, key=lambda ring: ring.bounds):
        piece = ring.buffer(rules.half + ROUNDING, join_style="mitre", mitre_limit=MITRE).intersection(hole)
        if ring.buffer(-rules.half - ROUNDING).is_empty or piece.geom_type != "Polygon":
            continue
        path = fit_arcs(np.asarray(piece.exterior.coords)[:-1, :2], FITTED, closed=True)
        path = path if path.area >= 0.0 else path.reversed()
        shape = shapely.Polygon(path.flattened(FLATNESS))
        if shape.is_valid and len(shapely.get_parts(shape.buffer(-rules.half))) == 1:
            found.append(path)
    return found


def _uncut(one: SheetContour, hole: Any, pieces: list[Polyline], rules: CutRules) -> Issue:
    """Return what of a hole stays uncut: its necks, and pieces without room for a pierce; not the corners of others."""
    rings = [shapely.Polygon(p.flattened(FLATNESS)).buffer(-rules.half) for p in pieces]
    burnt = [ring.buffer(rules.half + ROUNDING) for ring in rings]
    unused = hole.buffer(-rules.half).difference(shapely.union_all(burnt))
    left = [
        rest
        for rest in shapely.get_parts(hole.difference(shapely.union_all(burnt)))
        if rest.area > SMALL and (shapely.dwithin(burnt, rest, ROUNDING).sum() > 1 or rest.intersects(unused))
    ]
    x, y = one.contour.path.start
    number = "1 of its pieces is" if len(pieces) == 1 else f"{len(pieces)} of its pieces are"
    words = (
        f"a hole of part {one.part} has a neck narrower than the kerf of {rules.kerf:.4g} mm: {number} cut, and "
        f"{sum(rest.area for rest in left):.3g} mm² stay uncut"
    )
    outlines = tuple(Polyline.of_points(list(rest.exterior.coords)[:-1], closed=True) for rest in left)
    where = tuple((float(rest.centroid.x), float(rest.centroid.y)) for rest in left) or ((x, y),)
    return Issue("L612", words, f"at ({x:.6g}, {y:.6g})", missing=MissingWork("place", len(where), where, outlines))
