"""The stock of a run for the browser, which cuts it again, move by move, in step with the playing.

A scene (`studio.drawing.scene`) of the kind ``solid``. Its header has

- ``refused``: why the stock cannot be shown; then there is nothing else;
- ``origin``: x and y, mm, taken off all places;
- ``grid``: ``x`` and ``y`` of the middle of the first cell and ``cell``, its side, mm; ``rows`` and ``columns``;
- ``of``: how many rows the toolpath's scene has that it belongs to;
- ``top`` and ``floor`` of the block, mm;
- ``tools``: number → ``words``, ``shape`` (radius, flat, corner, reach, rise, slope: `kernels.sweep.ToolShape`),
  ``length`` of what cuts, mm, and ``bodies``, what is known of above that: kind, lower end above the tip and radius;
- ``collisions``: kind and line of each;
- ``differs``: None; of two programs how many places the other one leaves otherwise (``count``), and of the largest x,
  y, height here and height there, mm (``places``).

Blocks, a row for each straight move but in the last ones:

=============== ======= =============================================================================================
``move``        f4 × 6  begin and end of the tip, mm
``since``       f8      when it begins, s
``until``       f8      when it ends, s
``row``         u4      row of the toolpath's scene
``cutter``      u4      number of the tool
``rapid``       u1      1 for a rapid
``width``       u1      how wide it cuts, of the tool's diameter; 255: all of it
``chip``        u1      its thickest chip, of the feed per tooth; 255: all of it
``collision``   f4 × 4  place and depth of each collision, mm
``start``       f4      height of every cell before the first move, mm; nothing where all is at the top
``differs``     u1      1 for cells that the other program leaves lower, 2 for those that it leaves higher; nothing
                        where there is none
``held``        u1      1 for cells of what holds the material; nothing where there is none
=============== ======= =============================================================================================
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import LeafcutError
from leafcut.model.cutter import BodyPart, Cutter
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome
from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath
from leafcut.report.playback import Playback, outcome_playback, playback
from leafcut.report.wording import clean
from leafcut.stock.height_field import HeightField
from leafcut.stock.same_stock import differing_cells, regions
from leafcut.stock.solid import Solid, shown_block, solid_of
from leafcut.studio.drawing.scene import Columns, packed

#: So long is what of a tool is seen as its cutting part, in diameters, where its library does not say it.
_FLUTES = 3.0
#: So many pieces of a shank and a holder are drawn.
_MOST_BODIES = 4
#: Heights that differ by less are the same, mm; so many places that differ are told.
_TOLERANCE, _MOST_PLACES = 0.01, 200


def outcome_solid_scenes(outcome: Outcome) -> tuple[bytes, bytes]:
    """Return the stock that an outcome works on, with the moves before and after, or why it is not shown."""
    stock = outcome.shown.stock()
    return _scenes(
        _Shown(outcome.path_before, stock, lambda: outcome_playback(outcome, "before")),
        _Shown(outcome.path_after, stock, lambda: outcome_playback(outcome, "after")),
    )


def compared_solid_scenes(
    one: tuple[Toolpath, Machine, ShownStock],
    other: tuple[Toolpath, Machine, ShownStock],
    measured: tuple[Measure | None, Measure | None] = (None, None),
) -> tuple[bytes, bytes]:
    """Return what each of two toolpaths cuts of one block, and what they leave otherwise, or why it is not shown.

    Their times are those of `measured`.
    """
    return _scenes(_shown_run(*one, measured[0]), _shown_run(*other, measured[1]))


def solid_scene(path: Toolpath, machine: Machine, stock: ShownStock, measured: Measure | None = None) -> bytes:
    """Return the stock that any toolpath cuts, or why it is not shown; its time is that of `measured`."""
    shown = _shown_run(path, machine, stock, measured)
    try:
        return _packed(solid_of(path, stock), shown.rows())
    except LeafcutError as problem:
        return _refusal(problem)


class _Shown(NamedTuple):
    """A toolpath, the stock that it cuts, and what returns its rows as they are played."""

    path: Toolpath
    stock: ShownStock
    rows: Callable[[], Playback]


def _shown_run(path: Toolpath, machine: Machine, stock: ShownStock, measured: Measure | None = None) -> _Shown:
    return _Shown(path, stock, lambda: playback(path, machine, measured=measured))


def _refusal(problem: LeafcutError) -> bytes:
    return packed({**_HEAD, "refused": clean(str(problem))}, {})


def _scenes(one: _Shown, other: _Shown) -> tuple[bytes, bytes]:
    """Return the scenes of two toolpaths that cut one block, with what each leaves otherwise than the other."""
    try:
        blocks = [shown_block(each.path, each.stock) for each in (one, other)]
    except LeafcutError as problem:
        return _refusal(problem), _refusal(problem)
    low = tuple(min(ends) for ends in zip(*(block.low for block in blocks), strict=True))
    high = tuple(max(ends) for ends in zip(*(block.high for block in blocks), strict=True))
    solids: list[Solid] = []
    for each in (one, other):
        try:
            solids.append(solid_of(each.path, replace(each.stock, block=(low, high))))
        except LeafcutError as problem:
            return _refusal(problem), _refusal(problem)
    left = [replace(solid.after, heights=np.maximum(solid.after.heights, solid.after.floor)) for solid in solids]
    wrong = differing_cells(left[0], left[1], _TOLERANCE)
    deeper = left[1].heights < left[0].heights
    groups = regions(wrong & deeper) + regions(wrong & ~deeper)
    places = [_place_of(group, left) for group in groups[:_MOST_PLACES]]
    scenes = []
    for at, (each, solid) in enumerate(zip((one, other), solids, strict=True)):
        lower = left[1 - at].heights < left[at].heights
        cells = np.where(wrong, np.where(lower, 1, 2), 0)
        told = [[x, y, *(heights if at == 0 else heights[::-1])] for x, y, heights in places]
        differs = {"count": len(groups), "places": told}
        scenes.append(_packed(solid, each.rows(), differs, cells))
    return scenes[0], scenes[1]


def in_words(scene: bytes, say: Callable[[str], str]) -> bytes:
    """Return a scene with the reason why there is no stock, if there is one, in words of another language."""
    size = int.from_bytes(scene[8:12], "little")
    header = json.loads(scene[16 : 16 + size])
    return packed({**_HEAD, "refused": say(header["refused"])}, {}) if header["refused"] else scene


_HEAD: dict[str, Any] = {"kind": "solid", "name": "solid", "origin": [0.0, 0.0], "extents": None, "refused": ""}


def _place_of(cells: NDArray[np.int64], left: Sequence[HeightField]) -> tuple[float, float, list[float]]:
    """Return a place of a group of cells: the one nearest to its middle, with the heights of both fields, mm."""
    row, column = cells[np.argmin(np.hypot(*(cells - cells.mean(axis=0)).T))].tolist()
    field = left[0]
    heights = [float(each.heights[row, column]) for each in left]
    return field.x + column * field.cell, field.y + row * field.cell, heights


def _packed(
    solid: Solid, rows: Playback, differs: dict[str, Any] | None = None, cells: NDArray[np.int64] | None = None
) -> bytes:
    moves, field = solid.moves, solid.before
    first, since, until = _times(solid, rows)
    columns: Columns = {
        "move": ("f4", moves.ends),
        "since": ("f8", since),
        "until": ("f8", until),
        "row": ("u4", first[moves.row]),
        "cutter": ("u4", moves.tool),
        "rapid": ("u1", moves.rapid),
        "width": ("u1", np.rint(255.0 * np.clip(solid.width, 0.0, 1.0))),
        "chip": ("u1", np.rint(255.0 * np.clip(solid.chip, 0.0, 1.0))),
        "start": ("f4", field.heights.ravel() if (field.heights < solid.block.high[2]).any() else np.zeros(0)),
        "held": ("u1", solid.held.ravel() if solid.held.any() else np.zeros(0)),
        "differs": ("u1", cells.ravel() if cells is not None and cells.any() else np.zeros(0)),
        "collision": ("f4", np.array([(*one.place, one.depth) for one in solid.collisions]).reshape(-1, 4)),
    }
    header = {
        "origin": list(solid.origin),
        "grid": {
            "x": field.x, "y": field.y, "cell": field.cell, "rows": len(field.heights),
            "columns": field.heights.shape[1],
        },
        "of": len(rows.of),
        "top": solid.block.high[2],
        "floor": field.floor,
        "tools": {
            str(n): _tool(solid.tools[n], cutter, solid.bodies.get(n, ())) for n, cutter in solid.cutters.items()
        },
        "differs": differs,
        "collisions": [[one.kind, int(rows.line[first[one.row]])] for one in solid.collisions],
    }  # fmt: skip
    return packed({**_HEAD, **header}, columns)


def _times(solid: Solid, rows: Playback) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the scene's first row of every row of the moves' path, and when every move begins and ends, s."""
    whole, count = np.arange(len(solid.moves.path)), len(solid.moves.path)
    first = np.searchsorted(rows.of, whole)
    seconds = np.bincount(rows.of, weights=rows.seconds, minlength=count)
    begins = np.cumsum(seconds) - seconds
    row = solid.moves.row
    pieces = np.bincount(row, minlength=count)
    step = np.arange(len(row)) - np.searchsorted(row, row)
    since, until = (begins[row] + (step + end) / pieces[row] * seconds[row] for end in (0, 1))
    return np.minimum(first, max(len(rows.of) - 1, 0)), since, until


def _tool(tool: Tool, cutter: Cutter, bodies: Sequence[BodyPart]) -> dict[str, Any]:
    slope = 0.0 if math.isinf(cutter.slope) else cutter.slope
    length = tool.flute_length or _FLUTES * tool.diameter
    shape = [cutter.radius, cutter.flat, cutter.corner, *cutter.tangent, slope]
    above = [[part.body.value, part.above, part.radius] for part in bodies[:_MOST_BODIES]]
    point = cutter.height(cutter.radius)
    seen = max(length, point) if math.isfinite(point) else length
    return {"words": clean(tool.label), "shape": shape, "bodies": above, "length": seen}
