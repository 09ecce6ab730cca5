"""Scenes: content of the studio's drawing as bytes that a browser reads without parsing numbers.

A scene consists of

- the eight bytes ``LCSCENE1``;
- uint32: length of the header in bytes, then uint32: 0;
- the header: one JSON object in UTF-8, padded with spaces to a multiple of 8;
- blocks of numbers, each starting at a multiple of 8.

All numbers are little-endian. The header has

- ``kind``: ``part``, ``toolpath``, ``path``, ``pheromone``, ``differences`` (`studio.drawing.differences`), ``solid``
  (`studio.drawing.solid`) or ``program`` (`studio.drawing.program_text`), and a ``name`` to display;
- ``origin``: x and y in mm, subtracted from all float32 positions so that distant positions keep their precision;
- ``extents``: smallest x and y, largest x and y, mm, including the origin; null for an empty scene;
- ``blocks``: name → [type, offset from the first block in bytes, number of items, items in a row]; types are
  ``f8``, ``f4``, ``i4``, ``u4`` and ``u1``.

Blocks of a ``part``:

==================== ======== =======================================================================================
``hole``             f4 × 3   centre and diameter, mm (0: not known)
``hole_tool``        i4       number of the last tool that works on it, 0 if unknown
``slot``             f4 × 5   both ends of the centre line, width
``vertex``           f4 × 3   x, y and bulge of all outlines, concatenated
``hole_layer``       u4       layer of each hole: index into the header's ``layers``, from 1; 0: none
``slot_layer``       u4       layer of each slot
``outline_layer``    u4       layer of each outline
``outline``          u4 × 4   first vertex, number of vertices, kind (``OUTLINES``) plus 16 if closed, part number
``issue``            f4 × 3   position of an issue, and its index in the header's ``issues``
==================== ======== =======================================================================================

Blocks of a ``toolpath``, one row per move or command in machining order:

==================== ======== =======================================================================================
``doing``            u1       0 rapid, 1 cut, 2 arc clockwise, 3 counter-clockwise, 4 at rest, 5 moving with beam off
``place``            f4 × 3   position after the row, NaN for unknown coordinates
``seconds``          f4       duration of the row; the tool moves uniformly within a row
``line``             u4       line of the program, from 1; 0: none
``source``           u4       row of the toolpath; shared by all rows of a canned cycle
``feed``             f4       mm/s
``tool``             u4       number of the tool
``arc_row``, ``arc`` u4, f4×5 rows that are arcs; centre, radius, start angle and signed sweep, rad
``stop``             u4       rows at which the tool starts to work, numbered in their order
``pierce``           f4 × 3   position of a pierce and number of the cut, from 1 (a sheet)
``lead``             f4 × 2   points of leads, separated by NaN (a sheet)
``text``             u1       the program, UTF-8
==================== ======== =======================================================================================

and the header's ``seconds``, ``rapid_mm``, ``cut_mm``, ``kerf`` (mm, 0: none), ``tools`` (number → label),
``which`` (``before``, ``after``), and ``cleared``, the width that a mill clears (mm, 0: unknown). If ``has_no_unit`` is
true (a map or its tour), numbers have no unit.

A ``path`` is the best order of a running search: ``point`` f4 × 2, in the order of visits. An order edited by hand
also has ``visit`` u4, the number of each point in the toolpath, from 1; ``held`` u1, whether its rank is fixed; and
``moved`` u1, whether its position differs from the toolpath. The header's ``signs`` (index of a point → sign) are shown
beside the numbers.

Blocks of a ``pheromone``: ``point`` f4 × 2, ``edge`` u4 × 2 and ``strength`` f4, 0 … 1.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.model.contour import Contour
from leafcut.model.cutting import CutPlan
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.nest import Layout, Nest
from leafcut.model.outcome import Outcome, Which
from leafcut.model.part import Hole, Part, Slot
from leafcut.model.pocket import Pocket
from leafcut.model.toolpath import Toolpath
from leafcut.processes.registry import report_of
from leafcut.report.playback import Playback, outcome_playback, playback_of_path
from leafcut.report.wording import replace_unprintable
from leafcut.studio.drawing.editing import OrderStop

MAGIC = b"LCSCENE1"

OUTLINES = ("cut", "mark", "sheet", "pocket", "island")
CLOSED = 16

#: Maximum distance between an arc of missing work and its chords, mm.
MISSING_CHORDS = 0.05
#: Maximum number of issues in a scene, and maximum number of positions of an issue.
MAX_ISSUES = 500

_LEAD_TOLERANCE = 0.02
_PLACE = re.compile(r"\((-?[\d.]+(?:e[+-]?\d+)?), (-?[\d.]+(?:e[+-]?\d+)?)\)")
_HANDLE = re.compile(r"handle ([0-9A-Fa-f]+)")

Columns = dict[str, tuple[str, NDArray[Any]]]


def part_scene(part: Part, tools: dict[int, int] | None = None, *, filled: bool = False) -> bytes:
    """Create the scene of a part. A `filled` part looks like sheet metal.

    `tools` maps holes to tool numbers if they are known.
    """
    x0, y0, x1, y1 = part.extents
    origin = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    hole = np.column_stack([part.hole_xy - origin, part.diameters])
    of_hole = np.zeros(len(part.holes), dtype=np.int32)
    if tools:
        of_hole[list(tools)] = list(tools.values())
    ends = np.array([(*s.start, *s.end, s.width) for s in part.slots]).reshape(-1, 5)
    vertex, outline = _outline_columns(part.contours, part.pockets)
    vertex[:, :2] -= origin
    layers = _LayerNumbers(part)
    columns: Columns = {
        "hole": ("f4", hole),
        "hole_tool": ("i4", of_hole),
        "slot": ("f4", ends - np.array([*origin, *origin, 0.0])),
        "vertex": ("f4", vertex),
        "outline": ("u4", outline),
        "hole_layer": ("u4", layers.numbers_of(part.holes)),
        "slot_layer": ("u4", layers.numbers_of(part.slots)),
        "outline_layer": ("u4", layers.outline_numbers(part)),
        "issue": ("f4", _issue_places(part) - np.array([*origin, 0.0])),
    }
    low, high = _part_box(part)
    header = {
        "kind": "part",
        "name": replace_unprintable(part.name),
        "extents": [*low, *high] if len(hole) + len(ends) + len(vertex) else None,
        "origin": origin.tolist(),
        "layers": [replace_unprintable(layer) for layer in layers.names],
        "unitless": is_tsplib_map(part),
        "issues": _issues_as_json(part.issues),
        "missing": _missing_outlines(part.issues),
        "filled": filled,
    }
    return pack_scene(header, columns)


def _part_box(part: Part) -> tuple[list[float], list[float]]:
    x0, y0, x1, y1 = part.extents
    if not part.holes:
        return [x0, y0], [x1, y1]
    radius = 0.5 * part.diameters[:, None]
    low = np.minimum((x0, y0), (part.hole_xy - radius).min(axis=0))
    high = np.maximum((x1, y1), (part.hole_xy + radius).max(axis=0))
    return low.tolist(), high.tolist()


class _LayerNumbers:
    def __init__(self, part: Part) -> None:
        layers = {item.layer for nouns in (part.holes, part.slots, part.contours, part.pockets) for item in nouns}
        self.names = sorted(layers - {""})
        self._number = {name: number for number, name in enumerate(self.names, 1)}

    def numbers_of(self, nouns: Iterable[Hole | Slot | Contour]) -> NDArray[np.int64]:
        return np.array([self._number.get(noun.layer, 0) for noun in nouns], dtype=np.int64)

    def outline_numbers(self, part: Part) -> NDArray[np.int64]:
        pockets = [self._number.get(p.layer, 0) for p in part.pockets for _ in range(1 + len(p.islands))]
        return np.concatenate([self.numbers_of(part.contours), np.array(pockets, dtype=np.int64)])


def is_tsplib_map(part: Part) -> bool:
    """Return whether a part is a TSPLIB map. The coordinates of a map have no unit."""
    return part.edge_weight_type != ""


def nest_scene(nest: Nest, layout: Layout) -> bytes:
    """Draw a sheet of a nest as a part, with the edge of the sheet and the nested parts."""
    edges = (Contour(path, "sheet") for path in nest.stock_of(layout).paths)
    return part_scene(Part(name="nest", holes=(), contours=(*edges, *nest.contours(layout))), filled=True)


def outcome_scene(outcome: Outcome, which: Which) -> bytes:
    """Create the scene of an outcome's toolpath. Raises `PlanError` if its drilling cycles contain too many moves."""
    shown = report_of(outcome)
    before, _, after = shown.compared_measures()
    measure = before if which == "before" else after
    header = {
        "name": replace_unprintable(outcome.part.name),
        "which": which,
        "rapid_mm": measure.travel_mm,
        "cut_mm": measure.cut_mm,
        "tools": {
            str(tool.number): replace_unprintable(tool.label if tool.diameter > 0 else tool.label.rpartition(" Ø")[0])
            for tool in (operation.tool for operation in outcome.operations)
        },
        "cleared": shown.cleared,
    }
    return _pack_toolpath(
        outcome_playback(outcome, which), header, outcome.text if which == "after" else "", shown.cut_plan(which)
    )


def outcome_part_scene(outcome: Outcome) -> bytes:
    """Create the part scene of an outcome. For each hole, it includes the last tool that works on the hole."""
    tools = {hole: o.tool.number for o in outcome.operations if not o.slots for hole in o.holes}
    part = outcome.part
    planned = (issue for issue in outcome.missing if issue not in part.issues)
    return part_scene(replace(part, issues=(*part.issues, *planned)), tools)


def toolpath_scene(
    path: Toolpath,
    machine: Machine,
    *,
    name: str = "",
    text: str = "",
    beam: bool = False,
    part: Part | None = None,
    cleared: float = 0.0,
    measured: Measure | None = None,
    untimed: bool = False,
) -> bytes:
    """Create the scene of a toolpath as the machine runs it.

    Parameters
    ----------
    path, machine
        The toolpath and the machine that runs it.
    name
        Name to display.
    text
        Program of the toolpath.
    beam
        Whether the machine cuts with a beam.
    part
        The machined part.
    cleared
        Width that a mill clears, mm.
    measured
        Times of the toolpath. By default, they are computed here.
    untimed
        Show the progress without times during playback.

    Raises
    ------
    PlanError
        The drilling cycles contain too many moves.
    """
    return _pack_toolpath(
        playback_of_path(path, machine, beam, measured=measured),
        {
            "name": replace_unprintable(name),
            "which": "after",
            "unitless": part is not None and is_tsplib_map(part),
            "untimed": untimed or (part is not None and is_tsplib_map(part)),
            "cleared": cleared,
        },
        text,
        None,
    )


def pheromone_scene(points: ArrayLike, edges: ArrayLike, strength: ArrayLike) -> bytes:
    """Create the scene of edges (int[k, 2]) between points (float[n, 2], mm). Each edge has a strength from 0 to 1."""
    header, point = _centred_points(points)
    columns: Columns = {
        "point": ("f4", point),
        "edge": ("u4", np.asarray(edges).reshape(-1, 2)),
        "strength": ("f4", np.asarray(strength)),
    }
    return pack_scene({**header, "kind": "pheromone", "name": "pheromone"}, columns)


def path_scene(points: ArrayLike) -> bytes:
    """Create the scene of a path through points (float[n, 2], mm), in the order in which they are visited."""
    header, point = _centred_points(points)
    return pack_scene({**header, "kind": "path", "name": "path"}, {"point": ("f4", point)})


def edited_scene(stops: Sequence[OrderStop]) -> bytes:
    """Create the scene of an edited order, as a numbered path."""
    header, point = _centred_points([stop.place for stop in stops])
    signs = {str(k): stop.sign for k, stop in enumerate(stops) if stop.sign}
    columns: Columns = {
        "point": ("f4", point),
        "visit": ("u4", np.array([stop.name for stop in stops], dtype=np.int64)),
        "held": ("u1", np.array([stop.held for stop in stops], dtype=np.bool_)),
        "moved": ("u1", np.array([stop.moved for stop in stops], dtype=np.bool_)),
    }
    return pack_scene({**header, "kind": "path", "name": "path", "signs": signs}, columns)


def _centred_points(points: ArrayLike) -> tuple[dict[str, Any], NDArray[np.float64]]:
    xy = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    low, high = (xy.min(axis=0), xy.max(axis=0)) if len(xy) else (np.zeros(2), np.zeros(2))
    origin = 0.5 * (low + high)
    extents = [*low.tolist(), *high.tolist()] if len(xy) else None
    return {"origin": origin.tolist(), "extents": extents}, xy - origin


def pack_scene(header: dict[str, Any], columns: Columns) -> bytes:
    """Convert a header and its blocks to the bytes of a scene."""
    blocks, parts, offset = {}, [], 0
    for name, (kind, column) in columns.items():
        data = np.ascontiguousarray(column, dtype=f"<{kind}").tobytes()
        width = column.shape[1] if column.ndim == 2 else 1
        blocks[name] = [kind, offset, column.size, width]
        padding = -len(data) % 8
        parts.append(data + bytes(padding))
        offset += len(data) + padding
    words = json.dumps({**header, "blocks": blocks}, ensure_ascii=False, allow_nan=False).encode()
    words += b" " * (-len(words) % 8)
    return b"".join((MAGIC, len(words).to_bytes(4, "little"), bytes(4), words, *parts))


def _pack_toolpath(rows: Playback, header: dict[str, Any], text: str, plan: CutPlan | None) -> bytes:
    low, high = _playback_extents(rows)
    origin = np.nan_to_num(0.5 * (low + high))
    arc = rows.arc.copy()
    arc[:, :2] -= origin
    pierces, leads = _pierces_and_leads(plan)
    columns: Columns = {
        "place": ("f4", rows.place - np.array([*origin, 0.0])),
        "seconds": ("f4", rows.seconds),
        "line": ("u4", rows.line),
        "source": ("u4", rows.source),
        "feed": ("f4", rows.feed),
        "tool": ("u4", np.maximum(rows.tool, 0)),
        "doing": ("u1", rows.activity),
        "arc_row": ("u4", rows.arc_row),
        "arc": ("f4", arc),
        "stop": ("u4", rows.stops),
        "pierce": ("f4", pierces - np.array([*origin, 0.0])),
        "lead": ("f4", leads - origin),
        "text": ("u1", np.frombuffer(text.encode("utf-8", "replace"), dtype=np.uint8)),
    }
    shown = {
        "kind": "toolpath",
        "extents": [*low.tolist(), *high.tolist()] if np.isfinite(low).all() else None,
        "origin": origin.tolist(),
        "seconds": float(rows.seconds.sum()),
        "kerf": plan.data.kerf if plan else 0.0,
        "cuts": [_cut_as_json(plan, number) for number in range(len(plan.cuts))] if plan else [],
    }
    return pack_scene({**shown, **header}, columns)


def _playback_extents(rows: Playback) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the smallest and the largest x and y of all rows, including arcs, mm.

    Without any position, they are NaN.
    """
    places = rows.place[:, :2]
    every = [places[np.isfinite(places).all(axis=1)]]
    centre, radius, (start, sweep) = rows.arc[:, :2], rows.arc[:, 2], rows.arc[:, 3:].T
    for quarter in range(4):
        angle = 0.5 * math.pi * quarter
        passed = (angle - start) * np.sign(sweep) % math.tau <= np.abs(sweep)
        every.append((centre + np.outer(radius, (math.cos(angle), math.sin(angle))))[passed])
    points = np.concatenate(every)
    return (points.min(axis=0), points.max(axis=0)) if len(points) else (np.full(2, math.nan), np.full(2, math.nan))


def _outline_columns(
    contours: Iterable[Contour], pockets: Iterable[Pocket]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the vertices of all outlines, float64[n, 3], and the rows of the ``outline`` block."""
    every = [(c.path, "mark" if c.kind == "text" else c.kind, c.part) for c in contours]
    for number, pocket in enumerate(pockets, 1):
        every.append((pocket.outline, "pocket", number))
        every += [(island, "island", number) for island in pocket.islands]
    rows, first = [], 0
    for path, kind, part in every:
        count = len(path.vertices)
        rows.append((first, count, OUTLINES.index(kind) + CLOSED * path.closed, part))
        first += count
    vertices = [path.vertices for path, _, _ in every]
    return np.concatenate([np.zeros((0, 3)), *vertices]), np.array(rows, dtype=np.int64).reshape(-1, 4)


def _pierces_and_leads(plan: CutPlan | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    pierces, leads = [], list[NDArray[np.float64]]()
    gap = np.full((1, 2), math.nan)
    for number, cut in enumerate(plan.cuts if plan else (), 1):
        pierces.append((*cut.path.start, number))
        for start, end in ((0.0, cut.lead_in), (cut.lead_out, cut.path.length)):
            if end - start > _LEAD_TOLERANCE:
                leads += [cut.path.piece(start, end).flattened(_LEAD_TOLERANCE), gap]
    return np.array(pierces).reshape(-1, 3), np.concatenate([np.zeros((0, 2)), *leads])


def _cut_as_json(plan: CutPlan, number: int) -> list[Any]:
    cut = plan.cuts[number]
    return [cut.kind, cut.part, bool(cut.pierce)]


def _issues_as_json(issues: Iterable[Issue]) -> list[list[str]]:
    return [
        [i.code, i.severity.value, replace_unprintable(i.message), replace_unprintable(i.place)]
        for i in list(issues)[:MAX_ISSUES]
    ]


def _missing_outlines(issues: Iterable[Issue]) -> list[list[list[float]]]:
    paths = [path for issue in issues if issue.missing is not None for path in issue.missing.outlines]
    return [path.flattened(MISSING_CHORDS).round(3).tolist() for path in paths[:MAX_ISSUES]]


def _issue_places(part: Part) -> NDArray[np.float64]:
    """Return the known positions of all issues, float64[k, 3].

    Each row contains x and y in mm and the index of the issue.
    """
    named = [(h.handle, (h.x, h.y)) for h in part.holes if h.handle]
    named += [(c.handle, c.path.start) for c in part.contours if c.handle]
    of_handle = dict(reversed(named))
    places = []
    for index, issue in enumerate(part.issues[:MAX_ISSUES]):
        places += [(float(x), float(y), index) for x, y in _PLACE.findall(issue.place)[:MAX_ISSUES]]
        handle_match = _HANDLE.search(issue.place)
        if handle_match and handle_match[1] in of_handle:
            places.append((*of_handle[handle_match[1]], index))
    return np.array(places, dtype=np.float64).reshape(-1, 3)
