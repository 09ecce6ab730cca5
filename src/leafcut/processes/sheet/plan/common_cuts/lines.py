"""Common lines: parts share the cut between straight edges a kerf apart, or along edges that coincide.

Parts that share edges make a group. Its common lines are cut first, as open cuts that begin in the scrap beside the
group and end in another kerf of it; what runs around all of the group comes last and lets every part go. So nothing
moves while anything of it is still to be cut.

A common line runs half a kerf beside both parts, which is where their paths coincide. It reaches from kerf to kerf:
to the middle of the path around the group, or of another common line.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely

from leafcut.errors import count_of
from leafcut.geometry.fitting import fit_arcs
from leafcut.model.issue import Issue, Severity
from leafcut.model.sheet import SheetContour
from leafcut.processes.sheet.plan.common_cuts.edges import GAP, EdgeGap, facing_edges, least_length
from leafcut.processes.sheet.plan.common_cuts.groups import MEET, CommonCutGroup, Grouper
from leafcut.processes.sheet.plan.cut_contours import CutContour, corners_along, flat_line
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import travel_at
from leafcut.processes.sheet.plan.leads.leads import Scrap, lead_shape, placed


def with_common_lines(
    contours: list[CutContour], scrap: Scrap, rules: CutRules
) -> tuple[list[CutContour], list[tuple[int, int]], list[Issue]]:
    """Return the contours with common lines, pairs (before, after) of them that must be kept, and what was found.

    The outlines of a group become one contour around it, and its common lines. Edges stay cut twice where the lines
    between them could not be cut from the scrap: a grid of three rows and more by plasma.
    """
    slots = facing_edges(contours, rules)
    groups = _groups(contours, slots, scrap, rules)
    if not groups:
        return contours, [], _without(slots, rules)
    gone = {k for group in groups for k in group.members}
    made = [c for k, c in enumerate(contours) if k not in gone]
    last = max(c.index for c in contours) + 1
    pairs: list[tuple[int, int]] = []
    for number, group in enumerate(groups, 1):
        around = _around(contours, group, number)
        lines = [_line(contours, group, number, n, last + n) for n in range(len(group.lines))]
        last += len(lines)
        pairs += _order(made, around, group, len(made))
        made += [*lines, around]
    return made, pairs, _issues(slots, groups, rules)


def beside_leads(scrap: Scrap, contours: Sequence[CutContour]) -> Scrap:
    """Return the scrap with the lead-ins of common lines in it: others keep away from them."""
    leads = []
    for c in contours:
        for at, backward, lead in ((0.0, False, c.inlets[0]), (c.path.length, True, c.inlets[1])):
            if c.common and lead is not None and lead.length:
                here, travel = np.array([c.path.point_at(at)]), np.array([travel_at(c.path, at, backward)])
                leads.append(shapely.LineString(placed(lead_shape(lead), here, travel, backward)[0]))
    return scrap.with_bridges(leads, np.full((len(leads), 2), -1, dtype=np.int64)) if leads else scrap


def _groups(
    contours: list[CutContour], slots: Sequence[EdgeGap], scrap: Scrap, rules: CutRules
) -> list[CommonCutGroup]:
    """Return the groups: all parts that hang together, or, where not all of their lines can be cut then, fewer.

    Those are joined pair by pair, the longest edges first, as long as all lines can be cut.
    """
    grouper = Grouper(contours, slots, scrap, rules)
    shared: dict[tuple[int, int], float] = {}
    for slot in slots:
        shared[slot.parts] = shared.get(slot.parts, 0.0) + slot.length
    of: dict[int, frozenset[int]] = {k: frozenset([k]) for pair in shared for k in pair}
    found: dict[frozenset[int], CommonCutGroup] = {}
    for members in _connected(shared):
        group = grouper.group(members)
        if group is not None:
            found[members] = group
            of.update(dict.fromkeys(members, members))
    tried: set[frozenset[int]] = set()
    joined = True
    while joined:
        joined = False
        for a, b in sorted(shared, key=lambda pair: (-round(shared[pair], 3), pair)):
            members = of[a] | of[b]
            if of[a] == of[b] or members in tried:
                continue
            tried.add(members)
            group = grouper.group(members)
            if group is not None:
                found.pop(of[a], None)
                found.pop(of[b], None)
                found[members] = group
                of.update(dict.fromkeys(members, members))
                joined = True
    return sorted(found.values(), key=lambda g: min(g.members))


def _connected(pairs: Iterable[tuple[int, int]]) -> list[frozenset[int]]:
    """Return the sets of parts that pairs hold together."""
    of: dict[int, set[int]] = {}
    for a, b in pairs:
        both = of.get(a, {a}) | of.get(b, {b})
        of.update(dict.fromkeys(both, both))
    return list(dict.fromkeys(frozenset(x) for x in of.values()))


def _around(contours: list[CutContour], group: CommonCutGroup, number: int) -> CutContour:
    """Return the contour around a group."""
    first = contours[min(group.members)]
    source = replace(first.source, contour=replace(first.source.contour, path=group.shape))
    line = flat_line(group.path)
    return CutContour(
        index=first.index,
        source=source,
        path=group.path,
        line=line,
        hole=False,
        diameter=2.0 * math.sqrt(abs(group.shape.area) / math.pi),
        corners=corners_along(group.shape, group.path, line),
        covers=tuple(sorted(contours[k].index for k in group.members)),
        group=number,
    )


def _line(contours: list[CutContour], group: CommonCutGroup, number: int, n: int, index: int) -> CutContour:
    """Return one common line as an open contour."""
    line = group.lines[n]
    first = contours[min(line.parts)].source
    path = fit_arcs(np.array(line.points), 0.5 * MEET)
    outline = contours[min(group.members)].index
    contour = replace(first.contour, path=path, kind="cut")
    return CutContour(
        index=index,
        source=SheetContour(contour, first.depth + 1, outline, first.part),
        path=path,
        line=flat_line(path),
        hole=False,
        diameter=0.0,
        covers=tuple(sorted(contours[k].index for k in line.parts)),
        group=number,
        common=line.shared,
        inlets=line.inlets,
    )


def _order(
    others: Sequence[CutContour], around: CutContour, group: CommonCutGroup, at: int
) -> Iterable[tuple[int, int]]:
    """Yield what comes before what: all inside the parts before the lines; of the lines those that others end at."""
    count = len(group.lines)
    inside, numbers = set(around.covers), group.parts
    for k, c in enumerate(others):
        if c.source.parent in inside or (c.kind == "mark" and c.source.part in numbers):
            yield from ((k, at + n) for n in range(count + 1))
    yield from ((at + n, at + count) for n in range(count))
    yield from ((at + a, at + b) for a, b in group.order)


def _without(slots: Sequence[EdgeGap], rules: CutRules) -> list[Issue]:
    """Return why there are no common lines, for those who asked for them."""
    if not rules.common_lines:
        return []
    if slots:
        return _apart(slots, rules)
    return [Issue("L616", _no_common_lines(least_length(rules), rules), "", Severity.NOTE)]


def _no_common_lines(least: float, rules: CutRules) -> str:
    if rules.half <= 0.0:
        return (
            f"no common lines: without compensation, parts share only edges that coincide over {least:.3g} mm or more"
        )
    return (
        f"no common lines: no two parts have straight edges one kerf of {rules.kerf:.4g} mm apart, within {GAP:g} mm, "
        f"that face each other over {least:.3g} mm or more"
    )


def _apart(slots: Sequence[EdgeGap], rules: CutRules) -> list[Issue]:
    """Return the note of edges that could be common lines and are cut separately."""
    if not slots or rules.half <= 0.0:  # edges that coincide: `doubled_edges` reports them
        return []
    (x, y), (u, v) = slots[0].begin, slots[0].end
    words = f"{math.fsum(s.length for s in slots):.6g} mm of edges one kerf apart are cut separately: no line "
    words += "between them can start in the scrap and cut without crossing another"
    return [Issue("L617", words, f"at ({(x + u) / 2:.5g}, {(y + v) / 2:.5g})", Severity.NOTE)]


def _issues(slots: Sequence[EdgeGap], groups: Sequence[CommonCutGroup], rules: CutRules) -> list[Issue]:
    lines = [line for g in groups for line in g.lines]
    length = math.fsum(line.shared for line in lines)
    parts = sum(len(g.members) for g in groups)
    words = f"{length:.6g} mm of edges of {parts} parts are cut once for two parts, in {count_of(len(lines), 'line')}"
    found = [Issue("L616", words, "", Severity.NOTE)]
    of = {k: n for n, g in enumerate(groups) for k in g.members}
    left = [s for s in slots if of.get(s.parts[0], -1) != of.get(s.parts[1], -2)]
    return [*found, *_apart(left, rules)]
