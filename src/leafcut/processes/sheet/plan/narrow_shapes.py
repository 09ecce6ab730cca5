"""Handle shapes that are narrow compared with the kerf: narrow slots, divided holes, and closed notches.

A slot that is one to two kerfs wide has no room for a pierce away from its edge, so it is cut along its centreline. If
the kerf divides a hole, the pieces are cut as separate holes. If the kerf closes the mouth of a notch, the chamber
behind the mouth is cut as a hole.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.contours import ROUNDING, SMALL, chord_line
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads import FLATNESS

#: Minimum ratio of length to width of a slot.
LONGER = 2.0
#: Relative tolerance for the area of a slot. The area is compared with a rectangle with square or round ends.
ALIKE = 0.01
#: Mitre limit: maximum length of a sharp corner in a divided hole, in half kerf widths.
MITRE = 2.0
#: Tolerance for fitting arcs to the chords of a divided hole, mm.
FITTED = 0.002


def with_narrow_shapes(sheet: Sheet, rules: CutRules) -> tuple[Sheet, Sheet, list[Issue]]:
    """Replace narrow shapes with shapes that the kerf can cut.

    If the kerf is not compensated, the sheet does not change.

    Returns
    -------
    Sheet
        The sheet with centreline cuts instead of narrow slots.
    Sheet
        The same sheet, in which divided holes are several holes and the chambers of closed notches are holes.
    list of Issue
        Issues about the widths of slots and about uncut areas.
    """
    if rules.half <= 0.0:
        return sheet, sheet, []
    whole, narrow = with_slot_cuts(sheet, rules.kerf) if rules.data.can_pierce else (sheet, [])
    divided, uncut = with_divided_holes(whole, rules)
    return whole, with_chambers(divided, rules), [*narrow, *uncut]


# -- slots -----------------------------------------------------------------------------------------------------------


def with_slot_cuts(sheet: Sheet, kerf: float) -> tuple[Sheet, list[Issue]]:
    """Replace narrow slots with open cuts along their centrelines.

    A slot is a rectangle with square or round ends that contains no other contours. Each cut ends half a kerf before
    the end of the slot, so that the slot gets the length in the drawing. The function returns the sheet and a warning
    about the widths of the slots (L627).
    """
    holding = {c.parent for c in sheet.contours}
    contours, widths = list(sheet.contours), []
    for index, one in enumerate(sheet.contours):
        middle = _slot_centreline(one.path, kerf) if one.is_hole and index not in holding else None
        if middle is not None:
            path, width = middle
            contours[index] = replace(one, path=path, depth=one.depth - 1)
            widths.append((width, path.point_at(0.5 * path.length)))
    if not widths:
        return sheet, []
    wider = [place for width, place in widths if abs(width - kerf) > ROUNDING]
    places = ", ".join(f"({x:.6g}, {y:.6g})" for x, y in wider[:3]) + (" …" if len(wider) > 3 else "")
    many = Message("a slot is") if len(wider) == 1 else Message("{} slots are", len(wider))
    words = Message(
        "{} narrower than two kerfs and cut once along the centreline, so the cut is {:.4g} mm wide instead of "
        "the drawn width",
        many,
        kerf,
    )
    return replace(sheet, contours=tuple(contours)), [Issue("L627", words, Message("at {}", places))] if wider else []


def _slot_centreline(slot: Polyline, kerf: float) -> tuple[Polyline, float] | None:
    """Return the centreline of a slot and the width of the slot, mm. Return None if the shape is not a slot.

    The centreline is shortened by half a kerf at each end.
    """
    x0, y0, x1, y1 = slot.extents
    # Most holes are too wide in both directions, as their area already shows.
    if abs(slot.area) > 2.0 * kerf * math.hypot(x1 - x0, y1 - y0):
        return None
    shape = shapely.Polygon(slot.flattened(FLATNESS))
    box: Any = shapely.oriented_envelope(shape)
    if box.geom_type != "Polygon":
        return None
    a, b, c, _ = np.array(box.exterior.coords[:4])
    first, second = b - a, c - b
    along, across = (first, second) if np.hypot(*first) >= np.hypot(*second) else (second, first)
    length, width = float(np.hypot(*along)), float(np.hypot(*across))
    if length < LONGER * width or not kerf - ROUNDING <= width < 2.0 * kerf - ROUNDING:
        return None
    round_ends = (length - width) * width + 0.25 * math.pi * width**2
    if not any(abs(shape.area - area) <= ALIKE * area for area in (length * width, round_ends)):
        return None
    half = 0.5 * (length - kerf) / length * along
    middle = 0.5 * (a + c)
    return Polyline.of_points([tuple(middle - half), tuple(middle + half)], closed=False), width


# -- divided holes and closed notches --------------------------------------------------------------------------------


def with_divided_holes(sheet: Sheet, rules: CutRules) -> tuple[Sheet, list[Issue]]:
    """Replace each hole that the kerf divides with several holes, and report uncut areas (L612).

    The first new hole takes the index of the original hole, and the others are appended, so that all other indices stay
    the same. A contour inside the original hole belongs to the new hole around it. If a contour lies outside all new
    holes, the original hole stays in place, but it is reported and not cut.
    """
    contours, added, issues = list(sheet.contours), list[Contour](), []
    for index, one in enumerate(sheet.contours):
        if not one.is_hole or one.kind != "cut":
            continue
        hole = shapely.Polygon(one.path.flattened(FLATNESS))
        rings = shapely.get_parts(hole.buffer(-rules.half, quad_segs=16))
        pieces = _outlines_cut_along_rings(hole, rings, rules) if len(rings) > 1 else []
        held = [k for k, c in enumerate(sheet.contours) if c.parent == index]
        around = [_enclosing_piece(sheet.contours[k], pieces) for k in held]
        if not pieces or None in around:
            continue
        numbers = [index, *(len(contours) + len(added) + k for k in range(len(pieces) - 1))]
        contours[index], *others = (replace(one, path=path) for path in pieces)
        added += others
        for k, piece in zip(held, around, strict=True):
            contours[k] = replace(contours[k], parent=numbers[piece or 0])
        issues.append(_uncut_issue(one, hole, pieces, rules))
    return (replace(sheet, contours=(*contours, *added)), issues) if issues else (sheet, [])


def with_chambers(sheet: Sheet, rules: CutRules) -> Sheet:
    """Add the chambers of closed notches as holes, because a kerf does not fit through the mouth of such a notch.

    Chambers are appended to the contours of the sheet. If a contour lies inside a chamber, it belongs to the chamber.
    If a contour lies in a notch of an outline but outside the chambers, the outline gets no chambers. If cuts start at
    the edge of the sheet, the sheet does not change, because such cuts cannot reach a chamber.
    """
    if rules.edge_start:
        return sheet
    contours, lines = list(sheet.contours), [chord_line(one.path) for one in sheet.contours]
    obstacles = np.array([*(shapely.box(*zone) for zone in sheet.zones), *map(chord_line, sheet.paths)], dtype=object)
    for index, one in enumerate(sheet.contours):
        if one.is_hole or one.kind != "cut" or not one.path.closed:
            continue
        notches, rings = _closed_notches(shapely.Polygon(lines[index].coords), rules)
        pieces = _outlines_cut_along_rings(notches, rings, rules)
        if not pieces or len(pieces) < len(rings) or notches.intersects(obstacles).any():
            continue
        beside = [k for k, c in enumerate(contours) if c.parent == contours[index].parent and k != index]
        held = [k for k in beside if notches.intersects(lines[k])]
        around = [_enclosing_piece(contours[k], pieces) for k in held]
        if None in around:
            continue
        for k, piece in zip(held, around, strict=True):
            contours[k] = replace(contours[k], parent=len(contours) + (piece or 0))
        chamber = replace(contours[index], depth=one.depth + 1, chamber=True)
        contours += (replace(chamber, path=path) for path in pieces)
        lines += map(chord_line, pieces)
    return replace(sheet, contours=tuple(contours))


def _closed_notches(outline: Any, rules: CutRules) -> tuple[Any, list[Any]]:
    """Return the area of the notches that the kerf closes, and the rings along which the torch can cut these notches.

    A ring is only used if it has room for a pierce and its kerf does not enter another kerf, where the arc would go
    out.
    """
    grown = outline.buffer(rules.half, quad_segs=16)
    paths = [grown.exterior, *grown.interiors]
    rings = [
        shapely.Polygon(path)
        for k, path in enumerate(paths[1:], 1)
        if shapely.distance(path, paths[:k] + paths[k + 1 :]).min() > rules.kerf + 2.0 * ROUNDING
        and not shapely.Polygon(path).buffer(-rules.half - ROUNDING).is_empty
    ]
    if not rings:
        return shapely.Polygon(), []
    closed = shapely.Polygon(grown.exterior).buffer(-rules.half, quad_segs=16).difference(outline)
    notches = [part for part in shapely.get_parts(closed) if any(part.intersects(ring) for ring in rings)]
    return shapely.union_all(notches), rings


def _enclosing_piece(held: Contour, pieces: list[Polyline]) -> int | None:
    points = shapely.MultiPoint(held.path.flattened(FLATNESS))
    around = (k for k, path in enumerate(pieces) if shapely.Polygon(path.flattened(FLATNESS)).covers(points))
    return next(around, None)


def _outlines_cut_along_rings(hole: Any, rings: Iterable[Any], rules: CutRules) -> list[Polyline]:
    """Return the outlines of the pieces that are cut if the torch follows `rings` in a hole or notch.

    Rings without room for a pierce are skipped.
    """
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


def _uncut_issue(one: Contour, hole: Any, pieces: list[Polyline], rules: CutRules) -> Issue:
    """Report the areas of a hole that stay uncut: necks, and areas without room for a pierce. Corners do not count."""
    rings = [shapely.Polygon(p.flattened(FLATNESS)).buffer(-rules.half) for p in pieces]
    burnt = [ring.buffer(rules.half + ROUNDING) for ring in rings]
    unused = hole.buffer(-rules.half).difference(shapely.union_all(burnt))
    left = [
        rest
        for rest in shapely.get_parts(hole.difference(shapely.union_all(burnt)))
        if rest.area > SMALL and (shapely.dwithin(burnt, rest, ROUNDING).sum() > 1 or rest.intersects(unused))
    ]
    x, y = one.path.start
    number = Message("1 of its pieces is") if len(pieces) == 1 else Message("{} of its pieces are", len(pieces))
    words = Message(
        "a hole of part {} has a neck narrower than the kerf of {:.4g} mm, so {} cut, and {:.3g} mm² stay uncut",
        one.part,
        rules.kerf,
        number,
        sum(rest.area for rest in left),
    )
    outlines = tuple(Polyline.of_points(list(rest.exterior.coords)[:-1], closed=True) for rest in left)
    where = tuple((float(rest.centroid.x), float(rest.centroid.y)) for rest in left) or ((x, y),)
    return Issue(
        "L612", words, Message("at ({:.6g}, {:.6g})", x, y), missing=MissingWork("place", len(where), where, outlines)
    )
