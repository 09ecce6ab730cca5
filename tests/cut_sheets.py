"""Small sheets for the tests of cutting, and what is checked of every plan without the code that made it."""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.cutting import Cut, CutData
from leafcut.model.sheet import Sheet
from leafcut.options import SolveOptions
from leafcut.order.solve import solve
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.chains import Chain, chain_blocks, chain_problem, chains_from_solution, with_chains
from leafcut.processes.sheet.plan.cut_rules import CutRules, resolve_rules
from leafcut.processes.sheet.plan.cutting import CutSequence, Cutting, prepare_cutting, sweep_bands
from leafcut.processes.sheet.plan.starts import CutStart

PLASMA = CutData("plasma", "mild_steel", 6.0, 20.0, 1.5, 45.0, 3.8, 0.5, 1.5)
LASER = CutData("laser_fiber_3kW", "mild_steel", 3.0, 100.0, 0.2, None, 1.0, 0.3, 1.0)
#: Accuracy of the checks, mm: chords of contours, and paths next to them.
FINE, ROOM = 0.002, 0.04


def square(x: float, y: float, side: float) -> Polyline:
    return Polyline.of_points([(x, y), (x + side, y), (x + side, y + side), (x, y + side)], closed=True)


def rectangle(x: float, y: float, width: float, height: float) -> Polyline:
    return Polyline.of_points([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], closed=True)


def split_rectangle(seed: int, kerf: float) -> list[tuple[float, float, float, float]]:
    """Return (x, y, width, height) of the pieces of a rectangle split at random, one kerf apart; one may be missing."""
    chance = random.Random(seed)
    boxes = [(40.0, 40.0, 300.0, 200.0)]
    for _ in range(chance.randint(1, 6)):
        k = chance.randrange(len(boxes))
        x, y, width, height = boxes[k]
        share = chance.choice((0.3, 0.5, 0.62))
        if chance.random() < 0.5 and width > 60:
            low = round(share * width, 1)
            boxes[k : k + 1] = [(x, y, low, height), (x + low + kerf, y, width - low - kerf, height)]
        elif height > 60:
            low = round(share * height, 1)
            boxes[k : k + 1] = [(x, y, width, low), (x, y + low + kerf, width, height - low - kerf)]
    if len(boxes) > 3 and chance.random() < 0.4:
        boxes.pop(chance.randrange(len(boxes)))
    return boxes


def sheet_of(
    *closed: tuple[Polyline, int, int, int],
    marks: Sequence[tuple[Polyline, int, int]] = (),
    size: float | None = None,
    zones: Sequence[tuple[float, float, float, float]] = (),
) -> Sheet:
    """Return a sheet of (path, depth, parent, part), and marks of (path, parent, part)."""
    contours = [Contour(path, depth=depth, parent=parent, part=part) for path, depth, parent, part in closed]
    contours += [Contour(path, kind="mark", depth=1, parent=parent, part=part) for path, parent, part in marks]
    outline = None if size is None else square(0, 0, size)
    return Sheet("test", tuple(contours), outline, tuple(zones))


def two_squares(gap: float = 20.0) -> Sheet:
    return sheet_of((square(20, 20, 50), 0, -1, 1), (square(70 + gap, 20, 50), 0, -1, 2))


def ring() -> Sheet:
    """An annulus of radius 60 with a hole of radius 30, and a mark between them."""
    mark = Polyline.of_points([(60, 95), (60, 105)])
    return sheet_of(
        (Polyline.circle(100, 100, 60), 0, -1, 1), (Polyline.circle(100, 100, 30), 1, 0, 1), marks=[(mark, 0, 1)]
    )


def part_in_hole() -> Sheet:
    """Part 1 has a large hole, part 2 lies in it and has a hole of its own; drawn from the outside in."""
    return sheet_of(
        (square(20, 20, 160), 0, -1, 1),
        (Polyline.circle(100, 100, 60), 1, 0, 1),
        (square(80, 80, 40), 2, 1, 2),
        (Polyline.circle(100, 100, 9), 3, 2, 2),
        size=200,
    )


def part_in_notch(mouth: float) -> Sheet:
    """A C of 100 mm whose notch of 60 mm has a mouth at the right; part 2 with a hole lies in the notch."""
    low, high = 70.0 - 0.5 * mouth, 70.0 + 0.5 * mouth
    inner = [(100.0, low), (100.0, 40.0), (40.0, 40.0), (40.0, 100.0), (100.0, 100.0), (100.0, high)]
    corners = [(20.0, 20.0), (120.0, 20.0), (120.0, low), *inner, (120.0, high), (120.0, 120.0), (20.0, 120.0)]
    return sheet_of(
        (Polyline.of_points(corners, closed=True), 0, -1, 1),
        (square(55, 60, 20), 0, -1, 2),
        (Polyline.circle(65, 70, 6), 1, 1, 2),
        size=200,
    )


def rules_of(data: CutData = PLASMA, *, switches: bool = True, planned: bool = False, **options: Any) -> CutRules:
    return resolve_rules(data, CutOptions(**options), switches=switches, planned=planned)


def cutting_of(sheet: Sheet, data: CutData = PLASMA, **options: Any) -> Cutting:
    return prepare_cutting(sheet, rules_of(data, **options))


def in_order(cutting: Cutting, order: Sequence[CutStart]) -> CutSequence:
    return CutSequence(cutting, tuple(order))


def materials(sheet: Sheet) -> dict[int, Any]:
    """Return every part as a polygon with holes, by its number."""
    found: dict[int, Any] = {}
    for c in sheet.contours:
        if c.kind == "cut" and c.path.closed and not c.is_hole:
            found[c.part] = shapely.Polygon(c.path.flattened(FINE))
    for c in sheet.contours:
        if c.is_hole:
            found[c.part] = found[c.part].difference(shapely.Polygon(c.path.flattened(FINE)))
    return found


def swept(path: Polyline, kerf: float) -> Any:
    return shapely.LineString(path.flattened(FINE)).buffer(0.5 * kerf - ROOM, quad_segs=32)


def lead_in_of(cut: Cut) -> Polyline | None:
    return cut.path.piece(0.0, cut.lead_in) if cut.lead_in > 0.0 else None


def lead_out_of(cut: Cut) -> Polyline | None:
    return cut.path.piece(cut.lead_out, cut.path.length) if cut.path.length - cut.lead_out > 1e-6 else None


def assert_nothing_is_gouged(sheet: Sheet, cuts: Sequence[Cut], kerf: float) -> None:
    """The kerf of every cut, leads and loops included, is outside every part, and off the clamps."""
    parts = materials(sheet)
    zones = [shapely.box(*z) for z in sheet.zones]
    for cut in cuts:
        if cut.kind != "cut" or not sheet.contours[cut.contours[0]].path.closed:
            continue
        kerf_area = swept(cut.path, kerf)
        for number, part in parts.items():
            assert kerf_area.intersection(part).area < 1e-3, f"cut of {cut.contours} gouges part {number}"
        assert not any(kerf_area.intersects(zone) for zone in zones)


def assert_leads_in_scrap(sheet: Sheet, cuts: Sequence[Cut], kerf: float) -> None:
    """No lead touches the kerf of another contour, and it is outside outlines and inside holes."""
    lines = {
        cut.contours[0]: shapely.LineString(cut.path.piece(cut.lead_in, cut.lead_out).flattened(FINE))
        for cut in cuts
        if cut.kind == "cut"
    }
    for cut in cuts:
        contour = sheet.contours[cut.contours[0]]
        if cut.kind != "cut" or not contour.path.closed:
            continue
        inside = shapely.Polygon(contour.path.flattened(FINE))
        for lead in (lead_in_of(cut), lead_out_of(cut)):
            if lead is None:
                continue
            line = shapely.LineString(lead.flattened(FINE))
            if contour.is_hole:
                assert inside.contains(line)
            else:
                assert not inside.intersects(line)
            for index, other in lines.items():
                if index != cut.contours[0]:
                    assert line.distance(other) >= kerf - ROOM, f"a lead of {cut.contours} touches the kerf of {index}"
            if sheet.outline is not None and cut.pierce:
                assert shapely.Polygon(sheet.outline.flattened(FINE)).contains(line.buffer(0.5 * kerf - ROOM))


def all_cuts(cutting: Cutting) -> list[Cut]:
    return [cutting.cut(s) for s in cutting.starts]


def signed_area(points: np.ndarray) -> float:
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def runs_clockwise(cut: Cut) -> bool:
    return signed_area(cut.path.piece(cut.lead_in, cut.lead_out).flattened(FINE)) < 0.0


def chained(cutting: Cutting, overhead: float = 0.5, rapid: float = 250.0, **options: Any) -> Cutting:
    """Return a cutting with the chains that a short search finds."""
    given = CutOptions(chains=True, **options)
    chains: list[Chain] = []
    for block in chain_blocks(cutting, sweep_bands(cutting, given)):
        found = chain_problem(cutting, block, overhead, rapid)
        if found is not None:
            problem, bridges = found
            solution = solve(problem, SolveOptions(iterations=30, threads=1, bound=False))
            chains += chains_from_solution(cutting, bridges, [int(n) for n in solution.nodes], chains)
    return with_chains(cutting, chains)


def bridges_of(cut: Cut) -> list[Any]:
    """Return the bridges of a chain as shapely lines."""
    return [shapely.LineString(cut.path.piece(low, high).flattened(FINE)) for low, high in cut.bridges]


def assert_bridges_in_scrap(sheet: Sheet, cuts: Sequence[Cut], kerf: float) -> None:
    """The kerf of a bridge is outside every part and apart from all other kerfs, but for the two contours it joins."""
    parts = materials(sheet)
    for number, cut in enumerate(cuts):
        for (one, other), bridge in zip(itertools.pairwise(cut.contours), bridges_of(cut), strict=True):
            assert not any(bridge.buffer(0.5 * kerf - ROOM).intersects(part) for part in parts.values())
            for k, c in enumerate(sheet.contours):
                if k not in (one, other) and c.kind == "cut":
                    edge = shapely.LineString(c.path.flattened(FINE))
                    assert bridge.distance(edge) >= 1.5 * kerf - ROOM
            for k, another in enumerate(cuts):
                if k != number:
                    line = shapely.LineString(another.path.flattened(FINE))
                    assert bridge.distance(line) >= kerf - ROOM
