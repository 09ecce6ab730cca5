"""Convert the outlines of a drawing to pockets.

The module joins and cleans the outlines, and assigns each island to its pocket. Layer names or options distinguish
pockets and islands. Without them, nested outlines are ambiguous: the outermost outline may be a pocket with islands, or
the edge of a plate with pockets. The user has to decide (`--outline`), because a wrong guess would mill the negative of
the part.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import LeafcutError, ReadError, count_of, printable
from leafcut.geometry.cleaning import clean_path, counter_clockwise
from leafcut.geometry.containment import Conflict, find_outline_conflicts, nesting_depths_and_parents
from leafcut.geometry.polyline import COINCIDENT
from leafcut.geometry.tidying import advice_for_open_path, chord_polygons, tidy_outlines
from leafcut.message import Message
from leafcut.model.contour import Contour, layer_filter
from leafcut.model.heights import HeightCount
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.model.pocket import EDGE, EITHER, ISLAND, POCKET, Pocket
from leafcut.options import PocketDrawingOptions, SheetOptions
from leafcut.options.drawings import ISLAND_NAMES, POCKET_NAMES
from leafcut.read.format import first_positions_text


@dataclass(frozen=True)
class PocketOutline:
    """A closed contour with the number of its first stroke in the drawing. Its kind depends on its layer."""

    contour: Contour
    order: int
    kind: str

    def __str__(self) -> Message:
        return self.describe_as(self.kind)

    def describe_as(self, kind: str) -> Message:
        """Describe the outline for a message, as a ``pocket``, an ``island``, or an outline of unknown kind ("")."""
        x, y = self.contour.path.start
        if kind == "pocket":
            message = Message("the pocket that starts at ({:.6g}, {:.6g})", x, y)
        elif kind == "island":
            message = Message("the island that starts at ({:.6g}, {:.6g})", x, y)
        else:
            message = Message("the outline that starts at ({:.6g}, {:.6g})", x, y)
        layer = self.contour.layer
        return Message("{} on layer {}", message, printable(layer, 30)) if layer else message


def drawing_to_pockets(part: Part, options: PocketDrawingOptions, joining: SheetOptions, path: str) -> Part:
    """Convert the contours of a part to pockets. Layers or `options.outline` determine which contours are islands.

    Raises
    ------
    ReadError
        An outline is open or crosses itself, two outlines touch or overlap, or an island lies outside all pockets. The
        message states the position. The error is also raised if outlines are nested and the kind of the outermost
        outline is unknown. The message then describes both interpretations with their sizes.
    """
    issues = list(part.issues)
    kinds, named = _outline_kinds(part.contours, options, issues, path)
    outermost = options.outline or (POCKET if named else EITHER)
    if outermost == EDGE and {POCKET, ISLAND} & set(kinds):
        raise ReadError(path, "--outline edge: layers already distinguish pockets and islands; leave out --outline")
    chosen = [c for c, kind in zip(part.contours, kinds, strict=True) if kind is not None]
    heights = HeightCount.of((*c.path.start, c.z) for c in chosen)
    if heights.differ:
        raise ReadError(
            path,
            Message(
                "outlines of pockets and islands are drawn at different heights: {}; all must start at Z0: "
                "select a single height (--layers, --pocket-layers), or draw them at the same height",
                heights,
            ),
        )
    issues = [i for i in issues if i.code != "L406"] + heights.notes(Message("outlines of pockets and islands"))
    return contours_to_pockets(replace(part, issues=tuple(issues)), kinds, joining, path, outermost)


def contours_to_pockets(
    part: Part,
    kinds: Sequence[str | None],
    joining: SheetOptions,
    path: str,
    outermost: str = POCKET,
    *,
    picture: bool = False,
) -> Part:
    """Convert the contours of a part to pockets.

    If `outermost` is `EDGE`, the outermost outlines become the edges of plates (`Part.edge`). Raises the same errors as
    `drawing_to_pockets`.

    Parameters
    ----------
    kinds
        Kind of each contour: `POCKET`, `ISLAND`, `EITHER`, or None to leave the contour out.
    outermost
        Kind of the outermost outlines: `POCKET`, `EDGE`, or `EITHER` to refuse nested outlines.
    picture
        Whether the contours come from a picture. Only messages depend on it.
    """
    issues = list(part.issues)
    try:
        outlines = _join_to_outlines(part.contours, kinds, joining, issues)
        shapes = chord_polygons([o.contour.path for o in outlines])
        _check_simple(outlines, shapes, picture)
        contacts = find_outline_conflicts(shapes)
        kept = _without_duplicates(outlines, contacts, issues)
        new_index = {k: index for index, k in enumerate(kept)}
        contacts = [
            c._replace(first=new_index[c.first], second=new_index[c.second])
            for c in contacts
            if c.first in new_index and c.second in new_index
        ]
        outlines, shapes = [outlines[k] for k in kept], shapes[kept]
        depth, parent = nesting_depths_and_parents(shapes)
        _check_interpretation(outlines, depth, outermost)
        _check_layers_match_nesting(outlines, depth, parent)
        level = depth - (outermost == EDGE)
        _check_contacts(outlines, contacts, level, issues, picture)
    except ReadError:
        raise
    except LeafcutError as problem:
        raise ReadError(path, str(problem)) from None
    pockets = _build_pockets(outlines, level, parent, part.name)
    edge = tuple(replace(outlines[k].contour, kind="sheet") for k in np.flatnonzero(level < 0).tolist())
    return replace(part, contours=(), pockets=pockets, edge=edge, issues=tuple(issues))


# -- layers ----------------------------------------------------------------------------------------------------------


def _outline_kinds(
    contours: Sequence[Contour], options: PocketDrawingOptions, issues: list[Issue], path: str
) -> tuple[list[str | None], bool]:
    """Return the kind of every contour, and whether layers determine the kinds.

    The function reports kinds that it derives from layer names (L421).
    """
    names = sorted({c.layer for c in contours})
    pocket_names = _matching_layers(names, options.pocket_layers, POCKET_NAMES)
    island_names = _matching_layers(names, options.island_layers, ISLAND_NAMES) - pocket_names
    for given, matching, flag in (
        (options.pocket_layers, pocket_names, "--pocket-layers"),
        (options.island_layers, island_names, "--island-layers"),
    ):
        if given and not matching:
            layer_names = printable(", ".join(name or "(without a name)" for name in names), 120)
            raise ReadError(
                path,
                Message("no lines on the layers of {} {}; there are lines on {}", flag, ",".join(given), layer_names),
            )
    guessed = [name for name in sorted(pocket_names) if not options.pocket_layers]
    guessed += [name for name in sorted(island_names) if not options.island_layers]
    if guessed:
        layers = printable(", ".join(guessed), 80)
        message = Message(
            "pockets and islands are chosen by layer name: {}; to change this, use --pocket-layers and --island-layers",
            layers,
        )
        issues.append(Issue("L421", message, severity=Severity.NOTE))
    # If layers name islands only, all other lines are pockets.
    other_kind = None if pocket_names else POCKET if island_names else EITHER
    # Without a layer for islands, islands are drawn on the layers of the pockets.
    pocket = POCKET if island_names else EITHER
    kinds = [pocket if c.layer in pocket_names else ISLAND if c.layer in island_names else other_kind for c in contours]
    if left_out := Counter(c.layer for c, kind in zip(contours, kinds, strict=True) if kind is None):
        left_texts = Message.joined(
            ", ", (Message("{} on layer {}", number, printable(name, 30)) for name, number in left_out.most_common(5))
        )
        issues.append(Issue("L211", Message("lines that belong to no pocket: {}", left_texts), severity=Severity.NOTE))
    return kinds, bool(pocket_names or island_names)


def _matching_layers(names: Sequence[str], given: tuple[str, ...], usual: tuple[str, ...]) -> set[str]:
    fits = layer_filter(given or usual)
    return {name for name in names if fits(name)}


# -- outlines --------------------------------------------------------------------------------------------------------


def _join_to_outlines(
    contours: Sequence[Contour], kinds: Sequence[str | None], joining: SheetOptions, issues: list[Issue]
) -> list[PocketOutline]:
    strokes: dict[str, list[tuple[int, Contour]]] = {}
    zero_length = []
    for k, (contour, kind) in enumerate(zip(contours, kinds, strict=True)):
        path = clean_path(contour.path) if kind is not None else None
        if kind is not None and path is not None:
            strokes.setdefault(kind, []).append((k, replace(contour, path=path)))
        elif kind is not None:
            zero_length.append(contour.path.start)
    if zero_length:
        message = Message("left out {} of zero length", count_of(len(zero_length), "line"))
        issues.append(Issue("L313", message, first_positions_text(zero_length), Severity.NOTE))
    joined = [outline for kind, members in strokes.items() for outline in _join_strokes(members, kind, joining, issues)]
    opened = [o for o in joined if not o.contour.path.closed]
    if opened and joining.open_paths != "drop":
        paths = [o.contour.path for o in opened]
        x, y = paths[0].end
        raise LeafcutError(
            "{}, {}; the first ends at ({:.6g}, {:.6g}){}; close the outline, or use --open-paths drop",
            count_of(len(opened), "open path"),
            first_positions_text([p.start for p in paths]),
            x,
            y,
            advice_for_open_path(0, paths),
        )
    if opened:
        positions = [o.contour.path.start for o in opened]
        issues.append(
            Issue(
                "L212",
                Message("the program leaves out {}", count_of(len(opened), "open path")),
                first_positions_text(positions),
            )
        )
    closed = sorted((o for o in joined if o.contour.path.closed), key=lambda o: o.order)
    if not closed:
        raise LeafcutError("no closed outline remains, so there is nothing to mill")
    return closed


def _join_strokes(
    strokes: Sequence[tuple[int, Contour]], kind: str, joining: SheetOptions, issues: list[Issue]
) -> list[PocketOutline]:
    """Join strokes to outlines. Each outline takes the layer and the handle of its first stroke."""
    tidied = tidy_outlines([contour.path for _, contour in strokes], joining.join_tolerance)
    gaps = [gap for joined_path in tidied.paths for gap in joined_path.gaps]
    if gaps:
        message = Message(
            "closed {}; the widest was {:.3g} mm", count_of(len(gaps), "gap"), max(width for _, width in gaps)
        )
        issues.append(Issue("L311", message, first_positions_text([point for point, _ in gaps])))
    if tidied.branches:
        number = count_of(len(tidied.branches), "place")
        message = Message("more than two line ends meet at {}; check the outlines", number)
        issues.append(Issue("L314", message, first_positions_text(tidied.branches)))
    if tidied.doubles:
        message = Message("merged {} drawn on top of other lines", count_of(len(tidied.doubles), "line"))
        issues.append(Issue("L312", message, first_positions_text(tidied.doubles)))
    outlines = []
    for path, members, _ in tidied.paths:
        order, stroke = strokes[min(members)]
        cleaned = clean_path(path)
        if cleaned is not None:
            outlines.append(PocketOutline(replace(stroke, path=counter_clockwise(cleaned)), order, kind))
    return outlines


# -- checks ----------------------------------------------------------------------------------------------------------


def _check_simple(outlines: Sequence[PocketOutline], shapes: NDArray[Any], picture: bool) -> None:
    """Raise an error for outlines that cross or touch themselves, or that enclose no area."""
    # Use the hull, because the areas of the two halves of a figure 8 cancel.
    thin = 2.0 * shapely.area(shapely.convex_hull(shapes)) <= COINCIDENT * shapely.length(shapes)
    for outline in (o for o, is_thin in zip(outlines, thin, strict=True) if is_thin):
        if picture:
            raise LeafcutError("{} encloses no area: noise; blur the picture, or set a larger --speckle", outline)
        raise LeafcutError("{} encloses no area; repair the drawing", outline)
    for outline, reason in zip(outlines, shapely.is_valid_reason(shapes), strict=True):
        if coordinates := reason.partition("[")[2].rstrip("]").split():
            x, y = float(coordinates[0]), float(coordinates[1])
            if picture:
                raise LeafcutError(
                    "{} crosses or touches itself at ({:.6g}, {:.6g}): noise; blur the picture, or set a "
                    "larger --speckle",
                    outline,
                    x,
                    y,
                )
            raise LeafcutError("{} crosses or touches itself at ({:.6g}, {:.6g}); repair the drawing", outline, x, y)


def _without_duplicates(
    outlines: Sequence[PocketOutline], contacts: Sequence[Conflict], issues: list[Issue]
) -> list[int]:
    """Drop duplicate outlines (L312), and return the indices of the others. Raise an error if outlines overlap."""
    duplicates = {c.second for c in contacts if c.kind == "same"}
    for c in contacts:
        first, second = outlines[c.first], outlines[c.second]
        if c.kind == "same" and first.kind != second.kind:
            raise LeafcutError("{} and {} coincide; an island must leave material to mill", first, second)
        if c.kind == "overlap" and not {c.first, c.second} & duplicates:
            raise LeafcutError(
                "{} and {} overlap, {}; outlines must not cross", first, second, _conflict_location_text(c)
            )
    if duplicates:
        positions = [outlines[k].contour.path.start for k in sorted(duplicates)]
        issues.append(
            Issue(
                "L312",
                Message("merged {} drawn twice", count_of(len(duplicates), "outline")),
                first_positions_text(positions),
            )
        )
    return [k for k in range(len(outlines)) if k not in duplicates]


def _check_interpretation(outlines: Sequence[PocketOutline], depth: NDArray[np.int64], outermost: str) -> None:
    """Raise an error if nested outlines are ambiguous, or if all outlines are edges of plates without pockets.

    Nested outlines are ambiguous if the outermost outlines may be either edges or pockets.
    """
    nested = bool(depth.any())
    if outermost == EDGE and not nested:
        raise LeafcutError("--outline edge: no outline read as a pocket lies inside another; use --outline pocket")
    if outermost != EITHER or not nested:
        return
    # A pocket has its islands at odd depth; a plate has its pockets there.
    even = [o for o, deep in zip(outlines, depth.tolist(), strict=True) if deep % 2 == 0]
    odd = [o for o, deep in zip(outlines, depth.tolist(), strict=True) if deep % 2]
    plates = [o for o, deep in zip(outlines, depth.tolist(), strict=True) if deep == 0]
    layers = dict.fromkeys(outline.contour.layer for outline in outlines)
    names = printable(", ".join(layers))
    or_layers = (
        Message("; or name the layers of the pockets with --pocket-layers ({})", names) if len(layers) > 1 else ""
    )
    raise LeafcutError(
        "{} with {}, or {} with {}: choose --outline pocket or --outline edge{}",
        _describe_sizes(even, "pocket"),
        count_of(len(odd), "island"),
        _describe_sizes(plates, "plate"),
        _describe_sizes(odd, "pocket"),
        or_layers,
    )


def _describe_sizes(outlines: Sequence[PocketOutline], noun: str) -> str:
    """Describe outlines by their number and the largest size, such as ``5 pockets (at most 30 × 20 mm)``."""
    x0, y0, x1, y1 = max((o.contour.path for o in outlines), key=lambda path: path.area).extents
    size = f"{x1 - x0:.4g} × {y1 - y0:.4g} mm"
    return f"{count_of(len(outlines), noun)} ({size if len(outlines) == 1 else Message('at most {}', size)})"


def _check_layers_match_nesting(
    outlines: Sequence[PocketOutline], depth: NDArray[np.int64], parent: NDArray[np.int64]
) -> None:
    """Raise an error if layers contradict the nesting, such as an island outside all pockets."""
    for outline, level, enclosing in zip(outlines, depth.tolist(), parent.tolist(), strict=True):
        if outline.kind == ISLAND and enclosing < 0:
            raise LeafcutError("{} lies in no pocket", outline)
        if outline.kind == ISLAND and level % 2 == 0:
            raise LeafcutError("{} lies in another island, not in a pocket", outline)
        if outline.kind == POCKET and level % 2:
            raise LeafcutError(
                "{} lies directly in another pocket; draw it on an island layer to leave it standing", outline
            )


def _check_contacts(
    outlines: Sequence[PocketOutline],
    contacts: Sequence[Conflict],
    level: NDArray[np.int64],
    issues: list[Issue],
    picture: bool,
) -> None:
    """Raise an error for islands that touch a wall or another island.

    Pockets that touch each other or an edge are only reported (L423). `level` is -1 for the edge of a plate, even for
    pockets, and odd for islands.
    """
    touching, at_edge = [], []
    for c in contacts:
        if min(level[c.first], level[c.second]) < 0:
            if max(level[c.first], level[c.second]) == 0:
                at_edge.append(c.place)
            continue
        if level[c.first] % 2 == level[c.second] % 2 == 0:
            touching.append(c.place)
            continue
        islands = [k for k in (c.first, c.second) if level[k] % 2]
        island, neighbour = outlines[islands[0]], Message("another island") if len(islands) == 2 else Message("a wall")
        if picture:
            raise LeafcutError(
                "{} touches {}, {}: blur the picture, or set a larger --speckle",
                island.describe_as(island.kind or "island"),
                neighbour,
                _conflict_location_text(c),
            )
        raise LeafcutError(
            "{} touches {}, {}; islands must stand clear, or be drawn as part of the wall",
            island.describe_as(island.kind or "island"),
            neighbour,
            _conflict_location_text(c),
        )
    if touching:
        message = Message(
            "{} of pockets touch each other, so no wall remains between them", count_of(len(touching), "pair")
        )
        issues.append(Issue("L423", message, first_positions_text(touching)))
    if at_edge:
        message = Message("no wall remains at the edge of the plate for {}", count_of(len(at_edge), "pocket"))
        issues.append(Issue("L423", message, first_positions_text(at_edge)))


def _conflict_location_text(conflict: Conflict) -> Message:
    return Message("at ({:.6g}, {:.6g})", conflict.place[0], conflict.place[1])


def _build_pockets(
    outlines: Sequence[PocketOutline], level: NDArray[np.int64], parent: NDArray[np.int64], name: str
) -> tuple[Pocket, ...]:
    """Create the pockets. A single pocket has the name of the drawing, and several pockets are numbered."""
    islands: dict[int, list[int]] = {}
    for k in np.flatnonzero((level > 0) & (level % 2 == 1)).tolist():
        islands.setdefault(int(parent[k]), []).append(k)
    pocket_indices = np.flatnonzero(level % 2 == 0).tolist()
    return tuple(
        Pocket(
            outlines[k].contour.path,
            tuple(outlines[i].contour.path.reversed() for i in islands.get(k, ())),
            name if len(pocket_indices) == 1 else str(number),
            outlines[k].contour.layer,
            outlines[k].contour.handle,
        )
        for number, k in enumerate(pocket_indices, 1)
    )
