"""Build a sheet from the strokes of a drawing.

Strokes are joined to outlines, which are cleaned and checked. Holes and marks are then assigned to parts. Repairs are
reported, and outlines that are not safe to cut are refused with their positions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError, count_of, printable
from leafcut.geometry.cleaning import clean_path, counter_clockwise
from leafcut.geometry.containment import count_enclosing_polygons, find_outline_conflicts, nesting_depths_and_parents
from leafcut.geometry.polyline import COINCIDENT, Polyline
from leafcut.geometry.tidying import advice_for_open_path, chord_polygons, tidy_outlines
from leafcut.message import Message
from leafcut.model.contour import Contour, is_annotation_layer, layer_matcher
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.model.sheet import Sheet
from leafcut.options import ReadOptions, SheetOptions
from leafcut.processes.layers import contour_kinds
from leafcut.processes.placing import place_part
from leafcut.read import read_contours

if TYPE_CHECKING:
    from leafcut.processes.job import Job
    from leafcut.read.format import Source

#: A closed outline that is smaller than this in both directions is probably a drawing mistake, mm.
TINY = 0.5
#: Circles belong to the same bore if their centres are at most this far apart, mm. Coordinates are rounded, and arcs
#: may consist of chords.
SAME_CENTRE = 0.05
#: Maximum diameter of a stepped bore with three or more circles, mm (the head of an M20 screw). Larger circles are
#: treated as nested rings.
WIDEST_STEPPED = 40.0
#: All values of --open-paths that allow open paths.
OPEN_VALUES = Message("cut, mark or drop")
#: Maximum number of layers that a message lists if the drawing has no cuts.
MOST_LAYERS = 5
#: Tolerance for round holes. It applies to the relative difference between 4π·area and the squared perimeter, and
#: between width and height. Polygons with 24 or more sides count as circles.
ROUND = 0.01
#: Two thicknesses count as equal if they differ by no more than this, mm, because inches are rounded.
SAME_THICKNESS = 0.001
#: Tolerance for the height of a solid, mm. Drawings round gauges and inches.
_HEIGHT_TOLERANCE = 0.1
#: Largest difference between a thickness and a common substitute, in mm and relative to the thickness. For example, 3
#: mm or 11 gauge may replace 1/8 in.
_SUBSTITUTE, _SUBSTITUTE_SHARE = 0.5, 0.1
#: Tolerance for diameter limits, mm, because inches are rounded. A limit of 6.35 includes a 1/4 in hole.
_SLACK = 1e-6


def read_placed_contours(job: Job, source: Source) -> Part:
    """Read the contours of a drawing and move them to the program zero.

    The part includes the issues about its thickness.
    """
    part = read_contours(source, job.settings.read, job.start_step(Message("reading")))
    part = replace(part, issues=(*part.issues, *check_thickness(part, job.settings.job.thickness)))
    return place_part(part, job.settings.read)


def prepare_sheet(
    part: Part,
    options: SheetOptions | None = None,
    concentric: str = "smallest",
    open_values: str = OPEN_VALUES,
) -> Sheet:
    """Build the sheet of a drawing in O(n log n).

    Contours are joined, cleaned and checked. The function also determines which contours lie inside others.

    Parameters
    ----------
    concentric
        Which circles of a bore to cut (`ReadOptions.concentric`): ``smallest``, ``largest`` or ``all``.
    open_values
        Values of --open-paths that the process accepts, for messages.

    Raises
    ------
    PlanError
        If the sheet has no cuts or marks. If an outline crosses itself, or is open although `options.open_paths` does
        not allow it. If parts overlap, fall apart where their outlines touch, or extend beyond the edge of the sheet.
    """
    options = options or SheetOptions()
    issues = list(part.issues)
    kinds = contour_kinds(part.contours, options, issues)
    strokes = _strokes_by_kind(part.contours, kinds, issues)
    found = {k: _join_strokes(strokes.get(k, []), k, options, issues) for k in ("cut", "mark", "sheet", "maybe sheet")}
    outline, holes, price = _sheet_edge(found["sheet"])
    cuts, marks = found["cut"], found["mark"]
    if found["maybe sheet"]:
        if outline is None and (named := _sheet_edge_by_layer_name(found["maybe sheet"], cuts, marks)) is not None:
            outline = named.path
            message = Message(
                "layer {} is used as the edge of the sheet; set --sheet-layers to change that", named.layer
            )
            issues.append(Issue("L421", message, severity=Severity.NOTE))
        else:
            cuts = sorted([*cuts, *found["maybe sheet"]], key=lambda m: m.order)
    closed, opened = [m for m in cuts if m.path.closed], [m for m in cuts if not m.path.closed]
    opened, more_marks = _sort_open_paths(opened, options, open_values, issues)
    marks = [*marks, *more_marks]
    shapes = chord_polygons([m.path for m in closed])
    _check_simple(closed, shapes)
    kept, touching = _without_duplicates(closed, shapes, issues)
    _check_parts_stay_whole(closed, shapes, kept, touching)
    closed, shapes = [closed[k] for k in kept], shapes[kept]
    kept = _select_bore_circles(closed, shapes, concentric, issues)
    closed, shapes = [closed[k] for k in kept], shapes[kept]
    if not closed and not opened and not marks:
        layers = list(dict.fromkeys(printable(c.layer) for c in part.contours if c.layer))
        listed = ", ".join([*layers[:MOST_LAYERS], *(["…"] if len(layers) > MOST_LAYERS else [])])
        hint = (
            Message("; its contours are on the layers {}; check --cut-layers and --ignore-layers", listed)
            if layers
            else ""
        )
        raise PlanError("{}: nothing is left to cut or mark{}", part.source or part.name, hint)
    contours = _nested_contours(closed, shapes, [*opened, *marks])
    _check_inside(contours, outline, holes)
    _refuse_frames(contours, options, issues)
    _warn_of_frame(contours, outline, issues)
    return Sheet(part.name, contours, outline, issues=tuple(issues), holes=holes, price=price)


def engraved_paths(contours: Sequence[Contour], options: SheetOptions, issues: list[Issue]) -> list[Contour]:
    """Return the lines and texts to engrave.

    Lines are joined where they meet, and closed paths are counter-clockwise.
    """
    every = replace(options, cut_layers=(), mark_layers=("*",), sheet_layers=(), ignore_layers=())
    strokes = _strokes_by_kind(contours, contour_kinds(contours, every, issues), issues)
    return _join_strokes(strokes.get("mark", []), "mark", every, issues)


def open_contours(contours: Sequence[Contour], options: SheetOptions) -> list[Contour]:
    """Return the contours on cut layers that are still open after strokes have been joined."""
    ignored: list[Issue] = []
    strokes = _strokes_by_kind(contours, contour_kinds(contours, options, ignored), ignored)
    joined = _join_strokes(strokes.get("cut", []), "cut", replace(options, open_paths="drop"), ignored)
    return [contour for contour in joined if not contour.path.closed]


def check_thickness(part: Part, thickness: float | None) -> list[Issue]:
    """Compare the thickness of the sheet, mm, with the height of the solid in the drawing.

    If the thickness is a common substitute for the height, return a warning (L413). If the difference is larger, raise
    OptionError.
    """
    if part.height is None or thickness is None:
        return []
    apart = abs(thickness - part.height)
    if apart <= _HEIGHT_TOLERANCE:
        return []
    if apart > max(_SUBSTITUTE, _SUBSTITUTE_SHARE * part.height) + SAME_THICKNESS:
        raise OptionError(
            "--thickness is {:g} mm, but the solid is {:.4g} mm high; give --thickness {:.4g}mm, or turn the "
            "solid with --up",
            thickness,
            part.height,
            part.height,
        )
    words = Message(
        "the solid is {:.4g} mm high, but the sheet is {:.4g} mm thick (--thickness); it is cut with the data "
        "for the sheet; check that slots, tabs and bends fit the sheet",
        part.height,
        thickness,
    )
    return [Issue("L413", words)]


def _strokes_by_kind(contours: Sequence[Contour], kinds: list[str], issues: list[Issue]) -> dict[str, list[Contour]]:
    """Clean and number the strokes, and group them by kind. Strokes of zero length are reported (L313)."""
    found: dict[str, list[Contour]] = {}
    gone = []
    for k, (contour, kind) in enumerate(zip(contours, kinds, strict=True)):
        path = clean_path(contour.path) if kind else None
        if path is not None:
            found.setdefault(kind, []).append(replace(contour, path=path, order=k))
        elif kind:
            gone.append(contour.path.start)
    if gone:
        issues.append(
            Issue(
                "L313",
                Message("left out {} of zero length", count_of(len(gone), "line")),
                _places_text(gone),
                Severity.NOTE,
            )
        )
    return found


def _join_strokes(strokes: list[Contour], kind: str, options: SheetOptions, issues: list[Issue]) -> list[Contour]:
    """Join strokes of the same kind to contours.

    Each contour takes the layer, handle and order of its first stroke.
    """
    marked = kind == "mark"
    if not strokes:
        return []
    tidied = tidy_outlines([s.path for s in strokes], options.join_tolerance)
    gaps = [gap for made in tidied.paths for gap in made.gaps]
    if gaps and not marked:
        message = Message(
            "closed {}; the widest was {:.3g} mm", count_of(len(gaps), "gap"), max(width for _, width in gaps)
        )
        issues.append(Issue("L311", message, _places_text([place for place, _ in gaps])))
    if tidied.branches and tidied.doubles and not marked and options.open_paths == "refuse":
        raise PlanError(
            "lines of several outlines meet {}, so the outlines are ambiguous; draw each outline as one closed "
            "polyline",
            _places_text(tidied.branches),
        )
    if tidied.branches and not marked:
        message = Message(
            "more than two line ends meet at {}; check the outlines", count_of(len(tidied.branches), "place")
        )
        issues.append(Issue("L314", message, _places_text(tidied.branches)))
    if tidied.doubles:
        message = Message("merged {} drawn on top of other lines", count_of(len(tidied.doubles), "line"))
        issues.append(Issue("L312", message, _places_text(tidied.doubles)))
    made = []
    for path, members, _ in tidied.paths:
        first = strokes[min(members)]
        good = clean_path(path)
        if good is None:
            continue
        made.append(replace(first, path=counter_clockwise(good), kind="mark" if marked else "cut"))
    return made


def _sheet_edge(sheets: list[Contour]) -> tuple[Polyline | None, tuple[Polyline, ...], float]:
    """Return the edge of the sheet, its holes, and its price. The edge is None if no layer contains it."""
    if not sheets:
        return None, (), 0.0
    closed = [m for m in sheets if m.path.closed]
    shapes = chord_polygons([m.path for m in closed])
    _check_simple(closed, shapes)
    depth = (
        nesting_depths_and_parents(shapes)[0].tolist()
        if len(closed) == len(sheets) and not find_outline_conflicts(shapes)
        else []
    )
    if depth.count(0) != 1 or max(depth) > 1:
        places = _places_text([m.path.start for m in sheets])
        raise PlanError(
            "the sheet's layer must contain one closed outline with only separate holes inside it; it contains "
            "{} closed and {}, {}",
            len(closed),
            count_of(len(sheets) - len(closed), "open path"),
            places,
        )
    edge = closed[depth.index(0)]
    holes = tuple(m.path for m, deep in zip(closed, depth, strict=True) if deep)
    return edge.path, holes, _price_in_sheet_name(edge.name)


def _price_in_sheet_name(name: str) -> float:
    """Return the price in the name of a sheet, such as ``3000x1500@180``, or 0 if the name has no price."""
    _, found, text = name.rpartition("@")
    try:
        price = float(text) if found else 0.0
    except ValueError:
        return 0.0
    return price if 0.0 <= price < math.inf else 0.0


def _sheet_edge_by_layer_name(maybe: list[Contour], cuts: list[Contour], marks: list[Contour]) -> Contour | None:
    """Search for the edge of the sheet among the outlines on layers whose names suggest a sheet.

    The edge encloses or crosses all other contours. If a part crosses the edge, the part is partly off the sheet. An
    outline without contours inside it is a part. If there are only such outlines, return None.

    Raises PlanError if some contours are inside an outline and others are outside, because a wrong guess would cut each
    part on the wrong side of its line.
    """
    closed = [m for m in maybe if m.path.closed]
    others = [*cuts, *marks]
    if not closed or not others:
        return None
    shapes = chord_polygons([m.path for m in closed])
    lines = np.array([shapely.LineString(m.path.flattened()) for m in others], dtype=object)
    held = shapely.STRtree(lines).query(shapely.buffer(shapes, COINCIDENT), predicate="covers")
    for k in range(len(closed)):
        inside = np.zeros(len(others), dtype=bool)
        inside[held[1][held[0] == k]] = True
        if not shapes[k].is_valid:
            continue
        across = shapely.crosses(lines, shapes[k]) & np.array([m.path.closed for m in others])
        if len(maybe) == 1 and (inside | across).all():
            return closed[k]
        if inside[: len(cuts)].any():
            beyond = [m for m, within in zip(others, inside, strict=True) if not within]
            fact = (
                Message("leaves {} outside", count_of(len(beyond), "contour"))
                if beyond
                else Message("is only one of several paths")
            )
            places = _places_text([m.path.start for m in (beyond or maybe)])
            layer = closed[k].layer
            raise PlanError(
                "the name of layer {} indicates the edge of a sheet, and an outline on it encloses parts, but "
                "{}, {}; leave out what is not the sheet with --ignore-layers, or assign {} with "
                "--sheet-layers or --cut-layers",
                layer,
                fact,
                places,
                layer,
            )
    return None


def _sort_open_paths(
    opened: list[Contour], options: SheetOptions, open_values: str, issues: list[Issue]
) -> tuple[list[Contour], list[Contour]]:
    """Return the open paths to cut, and the open paths to mark. The option `open_paths` decides."""
    if not opened:
        return [], []
    paths = [m.path for m in opened]
    places = _places_text([p.start for p in paths])
    number = count_of(len(opened), "open path")
    if options.open_paths == "refuse":
        first = Message.joined(
            "; ", (_open_path_text(m) + advice_for_open_path(k, paths) for k, m in enumerate(opened[:3]))
        )
        raise PlanError(
            "the layers to cut contain {}: {}{}; close the outline, leave a layer out with --ignore-layers, or "
            "use --open-paths {}",
            number,
            first,
            " …" if len(opened) > 3 else "",
            open_values,
        )
    if options.open_paths == "drop":
        issues.append(Issue("L212", Message("the program leaves out {}", number), places))
        return [], []
    if options.open_paths == "mark":
        issues.append(Issue("L424", Message("the program marks {}", number), places, Severity.NOTE))
        return [], [replace(m, kind="mark") for m in opened]
    issues.append(Issue("L424", Message("the program cuts {} as drawn, without kerf compensation", number), places))
    return opened, []


def _check_simple(closed: list[Contour], shapes: NDArray[Any]) -> None:
    """Raise PlanError if an outline crosses or touches itself, or encloses no area."""
    # The hull is used because the areas of the two halves of a figure 8 cancel.
    thin = 2.0 * shapely.area(shapely.convex_hull(shapes)) <= COINCIDENT * shapely.length(shapes)
    if thin.any():
        places = [m.path.start for m, t in zip(closed, thin, strict=True) if t]
        number = count_of(len(places), "outline")
        raise PlanError(
            "the drawing contains {} with no area, such as a line drawn back and forth, {}; repair the drawing",
            number,
            _places_text(places),
        )
    crossed = [r.partition("[")[2].rstrip("]").split() for r in shapely.is_valid_reason(shapes) if r.endswith("]")]
    if crossed:
        number = count_of(len(crossed), "outline")
        places = [(float(w[0]), float(w[1])) for w in crossed]
        raise PlanError(
            "the drawing contains {} with self-intersections, {}; redraw them so that no outline crosses or "
            "touches itself",
            number,
            _places_text(places),
        )


def _without_duplicates(
    closed: list[Contour], shapes: NDArray[Any], issues: list[Issue]
) -> tuple[list[int], list[tuple[int, int]]]:
    """Return the indices of all outlines without duplicates, and the pairs of outlines that touch each other.

    Duplicate, touching and tiny outlines are reported. Raises PlanError if outlines overlap.
    """
    met = find_outline_conflicts(shapes)
    gone = {c.second for c in met if c.kind == "same"}
    across = [c for c in met if c.kind == "overlap" and not {c.first, c.second} & gone]
    if across:
        first = across[0]
        a, b = (_outline_text(closed[k]) for k in (first.first, first.second))
        layers = {closed[k].layer for c in across for k in (c.first, c.second)}
        advice = Message("move the parts apart") + (
            Message(", or choose what is cut with --cut-layers (leafcut part: --operations)") if len(layers) > 1 else ""
        )
        where = _places_text([c.place for c in across])
        raise PlanError(
            "the drawing contains {} of overlapping outlines: {} and {}, {}; {}",
            count_of(len(across), "pair"),
            a,
            b,
            where,
            advice,
        )
    if gone:
        places = [closed[k].path.start for k in sorted(gone)]
        issues.append(
            Issue("L312", Message("merged {} drawn twice", count_of(len(gone), "outline")), _places_text(places))
        )
    touching = [c for c in met if c.kind == "touch" and not {c.first, c.second} & gone]
    if touching:
        message = Message(
            "{} of outlines touch each other, which leaves no room for the kerf; move them apart",
            count_of(len(touching), "pair"),
        )
        issues.append(Issue("L423", message, _places_text([c.place for c in touching])))
    kept = [k for k in range(len(closed)) if k not in gone]
    tiny = [e for e in (closed[k].path.extents for k in kept) if max(e[2] - e[0], e[3] - e[1]) < TINY]
    if tiny:
        message = Message(
            "the drawing contains {} smaller than {:g} mm; check whether it should",
            count_of(len(tiny), "outline"),
            TINY,
        )
        issues.append(Issue("L213", message, _places_text([(e[0], e[1]) for e in tiny])))
    return kept, [(c.first, c.second) for c in touching]


def _check_parts_stay_whole(
    closed: list[Contour], shapes: NDArray[Any], kept: list[int], touching: list[tuple[int, int]]
) -> None:
    """Raise PlanError if a part falls apart because its holes touch its outline or each other."""
    if not touching:
        return
    inside = np.full((2, len(closed)), -1)
    depth, parent = nesting_depths_and_parents(shapes[kept])
    inside[:, kept] = depth, [kept[outer] if outer >= 0 else -1 for outer in parent.tolist()]
    owner = [k if deep % 2 == 0 else outer for k, (deep, outer) in enumerate(inside.T.tolist())]
    for part in sorted({owner[a] for a, b in touching if owner[a] == owner[b]}):
        holes = [k for k in kept if inside[0, k] % 2 and inside[1, k] == part]
        whole = shapely.difference(shapes[part], shapely.union_all(shapes[holes]))
        # Outlines closer than this distance touch.
        pieces = shapely.get_parts(shapely.buffer(whole, -COINCIDENT, join_style="mitre"))
        if len(pieces) > 1:
            x0, y0, x1, y1 = min(pieces, key=lambda piece: piece.area).bounds
            raise PlanError(
                "the part with {} falls into {} pieces, the smallest {:.3g} × {:.3g} mm at ({:.5g}, {:.5g}), "
                "because its holes touch its outline or each other; move them apart",
                _outline_text(closed[part]),
                len(pieces),
                x1 - x0,
                y1 - y0,
                x0,
                y0,
            )


def _select_bore_circles(
    closed: list[Contour], shapes: NDArray[Any], concentric: str, issues: list[Issue]
) -> list[int]:
    """Keep only the smallest or the largest circle of each bore, depending on `concentric`. Return all indices to keep.

    Countersinks, counterbores and threads are drawn as a second circle around the hole. If all circles were cut, the
    hole would be too wide. Circles that are left out are reported (L302).
    """
    every = list(range(len(closed)))
    if concentric == "all":
        return every
    gone = []
    for bore in _bore_circles(closed, shapes):
        bore.sort(key=lambda k: abs(closed[k].path.area), reverse=concentric == "largest")
        gone += bore[1:]
    if gone:
        circles, places = (
            count_of(len(gone), "circle"),
            _places_text([shapely.centroid(shapes[k]).coords[0] for k in gone]),
        )
        if concentric == "largest":
            words = Message(
                "the program does not cut {} inside a larger one with the same centre (--concentric largest)", circles
            )
            issues.append(Issue("L302", words, places))
        else:
            words = Message(
                "the program does not cut {} around a hole with the same centre, because countersinks, "
                "counterbores and threads are left to other machines; to cut every circle, use --concentric all",
                circles,
            )
            issues.append(Issue("L302", words, places, Severity.MISSING))
    return [k for k in every if k not in set(gone)]


def _bore_circles(closed: list[Contour], shapes: NDArray[Any]) -> list[list[int]]:
    """Group the circles of each bore, as indices. A bore is a round hole with nothing but concentric circles inside."""
    widths = [diameter_if_round(m.path) for m in closed]
    if sum(width is not None for width in widths) < 2:
        return []
    depth, parent = (column.tolist() for column in nesting_depths_and_parents(shapes))
    centres = shapely.get_coordinates(shapely.centroid(shapes)).tolist()
    inside: dict[int, list[int]] = {}
    for k, outer in enumerate(parent):
        inside.setdefault(outer, []).append(k)

    def concentric(a: int, b: int) -> bool:
        same_part = closed[a].part == closed[b].part
        return None not in (widths[a], widths[b]) and same_part and math.dist(centres[a], centres[b]) <= SAME_CENTRE

    found: list[list[int]] = []
    for hole in (k for k in range(len(closed)) if depth[k] % 2):
        bore = [hole]
        while len(within := inside.get(bore[-1], [])) == 1 and concentric(bore[-1], within[0]):
            bore.append(within[0])
        # A single ring around a bore is a washer; several rings are nested rings.
        outer = parent[hole]
        washer = concentric(hole, outer)
        nested = washer and depth[outer] > 0 and concentric(outer, parent[outer])
        stepped = len(bore) == 2 or (not washer and (widths[hole] or 0.0) <= WIDEST_STEPPED)
        if len(bore) > 1 and not within and not nested and stepped:
            found.append(bore)
    return found


def _nested_contours(closed: list[Contour], shapes: NDArray[Any], loose: list[Contour]) -> tuple[Contour, ...]:
    """Return all contours in drawing order. Each contour gets its nesting depth, its parent and its part number."""
    depth, parent = nesting_depths_and_parents(shapes)
    middles: Any = shapely.points(np.array([m.path.point_at(0.5 * m.path.length) for m in loose]).reshape(-1, 2))
    _, holder = count_enclosing_polygons(middles, shapes)
    every = [*closed, *loose]
    parents = [*parent.tolist(), *holder.tolist()]
    depths = [*depth.tolist(), *(int(depth[h]) if h >= 0 else 0 for h in holder.tolist())]
    order = sorted(range(len(every)), key=lambda k: every[k].order)
    place = {k: at for at, k in enumerate(order)}
    parts = _part_numbers(closed, depths, parents, order)
    parts += [parts[h] if h >= 0 else 0 for h in parents[len(closed) :]]
    return tuple(
        replace(
            every[k],
            part=parts[k],
            depth=depths[k],
            parent=place[parents[k]] if parents[k] >= 0 else -1,
        )
        for k in order
    )


def _part_numbers(closed: list[Contour], depths: list[int], parents: list[int], order: list[int]) -> list[int]:
    """Return the part number of each closed contour.

    If the numbers in the drawing contradict the nesting, the parts are numbered again.
    """
    drawn = [m.part for m in closed]
    outlines = [k for k in order if k < len(closed) and depths[k] % 2 == 0]
    numbers = {k: drawn[k] for k in outlines}
    agrees = 0 not in numbers.values() and len(set(numbers.values())) == len(outlines)
    if not agrees or any(drawn[k] != drawn[parents[k]] for k in range(len(closed)) if depths[k] % 2):
        numbers = {k: number for number, k in enumerate(outlines, 1)}
    return [numbers[k] if depths[k] % 2 == 0 else numbers[parents[k]] for k in range(len(closed))]


def _check_inside(contours: Sequence[Contour], outline: Polyline | None, holes: Sequence[Polyline]) -> None:
    if outline is None:
        return
    edge, *inner = chord_polygons([outline, *holes])
    sheet = shapely.Polygon(edge.exterior, [hole.exterior for hole in inner]).buffer(COINCIDENT)
    shapely.prepare(sheet)
    outer = [c for c in contours if c.parent < 0]
    beyond = [c for c in outer if not sheet.covers(shapely.LineString(c.path.flattened()))]
    if beyond:
        first = beyond[0]
        what = Message("part {}", first.part) if first.part else first.kind
        or_holes = Message(" or in its holes") if holes else ""
        raise PlanError(
            "the drawing has {} beyond the edge of the sheet{}: {}, {}; move the part or use a larger sheet",
            count_of(len(beyond), "contour"),
            or_holes,
            what,
            _places_text([c.path.start for c in beyond]),
        )


def _refuse_frames(contours: Sequence[Contour], options: SheetOptions, issues: list[Issue]) -> None:
    """Raise PlanError if an outline around parts is on a layer whose name suggests a drawing frame.

    If a frame were cut as a part, the parts inside it would become holes. Layers that the user selected for cutting are
    accepted. An outline around a single outline may be a part with a window, so it only causes a warning (L422).
    """
    chosen = layer_matcher(options.cut_layers)
    inside: dict[int, list[int]] = {}
    for k, inner in enumerate(contours):
        if inner.parent >= 0 and inner.path.closed and inner.kind == "cut":
            inside.setdefault(inner.parent, []).append(k)
    for k, within in inside.items():
        frame = contours[k]
        if (
            not is_annotation_layer(frame.layer)
            or chosen(frame.layer)
            or all(is_annotation_layer(contours[i].layer) for i in within)
        ):
            continue
        if len(within) > 1 or within[0] in inside:
            raise PlanError(
                "the name of layer {} indicates a drawing frame, a text or a dimension, and an outline on it "
                "encloses other outlines, {}; leave the layer out with --ignore-layers, or name the layers to cut "
                "with --cut-layers",
                frame.layer,
                _places_text([frame.path.start]),
            )
        words = Message(
            "the outline on layer {} is cut as a part, and the outline inside it as a hole; if the outer one "
            "is a drawing frame, leave it out with --ignore-layers",
            frame.layer,
        )
        issues.append(Issue("L422", words, _places_text([frame.path.start])))


def _warn_of_frame(contours: Sequence[Contour], outline: Polyline | None, issues: list[Issue]) -> None:
    """Warn (L422) if a rectangle around most contours looks like the sheet but would be cut as a part."""
    outer = [c for c in contours if c.parent < 0 and c.path.closed]
    if outline is not None or not outer or len(contours) < 3:
        return
    frame = max(outer, key=lambda c: c.path.area)
    path, layer = frame.path, frame.layer
    rest = [c for c in contours if c is not frame]
    beyond = sum(c.part != frame.part for c in rest if c.depth < 2)
    x0, y0, x1, y1 = path.extents
    alone = all(c.layer != layer for c in rest)
    if 2 * beyond >= len(rest) or abs(path.area - (x1 - x0) * (y1 - y0)) > 1e-6 * path.area:
        return
    # A part may have a window with a smaller part inside. If there are several such outlines, they are parts with
    # holes.
    if alone or len({c.parent for c in rest if c.depth == 2}) > (1 if beyond else 0):
        what = Message("everything") if not beyond else Message("all but {}", count_of(beyond, "contour"))
        message = Message(
            "a rectangle of {:g} × {:g} mm on layer {} encloses {} and is cut as a part; if it is the edge of "
            "the sheet, name its layer with --sheet-layers",
            x1 - x0,
            y1 - y0,
            layer or "0",
            what,
        )
        issues.append(Issue("L422", message))


def _outline_text(made: Contour) -> Message:
    x, y = made.path.start
    if made.layer:
        return Message("the outline that starts at ({:g}, {:g}) on layer {}", x, y, made.layer)
    return Message("the outline that starts at ({:g}, {:g})", x, y)


def _open_path_text(made: Contour) -> Message:
    (x0, y0), (x1, y1) = made.path.start, made.path.end
    apart = math.hypot(x1 - x0, y1 - y0)
    message = Message("from ({:g}, {:g}) to ({:g}, {:g}), {:.3g} mm apart", x0, y0, x1, y1, apart)
    return Message("{} on layer {}", message, made.layer) if made.layer else message


def _places_text(places: Sequence[Any]) -> Message:
    first = ", ".join(f"({x:g}, {y:g})" for x, y in places[:3])
    return Message("at {}", first) + (" …" if len(places) > 3 else "")


# -- options --------------------------------------------------------------------------------------------------------


def without_excluded_holes(sheet: Sheet, options: ReadOptions) -> Sheet:
    """Remove the round holes that the diameter limits exclude, and report their number (L205).

    Slots, windows, outlines of parts and marks are kept, whatever their size. Raises PlanError if an excluded hole
    contains contours, because these would then lie in the material of the part.
    """
    low = options.min_diameter if options.min_diameter is not None else 0.0
    high = options.max_diameter if options.max_diameter is not None else math.inf
    gone = {
        k
        for k, c in enumerate(sheet.contours)
        if c.is_hole and (d := diameter_if_round(c.path)) is not None and not low - _SLACK <= d <= high + _SLACK
    }
    if not gone:
        return sheet
    _refuse_contours_in_excluded_holes(sheet, gone)
    places = {k: at for at, k in enumerate(k for k in range(len(sheet.contours)) if k not in gone)}
    kept = tuple(replace(sheet.contours[k], parent=places.get(sheet.contours[k].parent, -1)) for k in places)
    number = Message("1 hole") if len(gone) == 1 else Message("{} holes", len(gone))
    first = ", ".join(_start_text(sheet.contours[k]) for k in sorted(gone)[:3]) + (" …" if len(gone) > 3 else "")
    words = Message("left out {} outside the selected range of diameters", number)
    return replace(
        sheet, contours=kept, issues=(*sheet.issues, Issue("L205", words, Message("at {}", first), Severity.NOTE))
    )


def diameter_if_round(path: Polyline) -> float | None:
    """Return the diameter of a circle, or of a polygon that approximates a circle, mm.

    Return None for all other shapes.
    """
    low_x, low_y, high_x, high_y = path.extents
    narrow, wide = sorted((high_x - low_x, high_y - low_y))
    if narrow < (1.0 - ROUND) * wide or 4.0 * math.pi * abs(path.area) < (1.0 - ROUND) * path.length**2:
        return None
    return wide


def _refuse_contours_in_excluded_holes(sheet: Sheet, gone: set[int]) -> None:
    held = [c for c in sheet.contours if c.parent in gone]
    if held:
        around = sheet.contours[held[0].parent]
        raise PlanError(
            "the hole at {} in part {} is excluded by its diameter, but it contains contours to cut or mark, such as "
            "the one at {}; change --min-diameter or --max-diameter",
            _start_text(around),
            around.part,
            _start_text(held[0]),
        )


def _start_text(contour: Contour) -> str:
    x, y = contour.path.start
    return f"({x:g}, {y:g})"
