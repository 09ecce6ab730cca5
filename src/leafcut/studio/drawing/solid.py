"""Scene of the stock of a run. The browser cuts the stock move by move during playback.

The scene (`studio.drawing.scene`) has the kind ``solid``. Its header has

- ``refused``: the reason if the stock cannot be shown; the header then has only one other key, ``message``: the
  reason as template and values;
- ``origin``: x and y, mm, subtracted from all positions;
- ``grid``: ``x`` and ``y`` of the middle of the first cell and ``cell``, its side, mm; ``rows`` and ``columns``;
- ``of``: number of rows of the toolpath's scene;
- ``top`` and ``floor`` of the block, mm;
- ``tools``: number → ``words``, ``shape`` (radius, flat, corner, reach, rise, slope: `kernels.sweep.ToolShape`),
  ``length`` of its cutting part, mm, and ``bodies``, the known parts above: kind, lower end above the tip, radius;
- ``collisions``: kind and line of each;
- ``differs``: None for a single program. For two programs: ``count``, the number of positions with different
  heights, and ``places``, the largest differences: x, y, and the heights in both programs, mm.

Blocks; all except the last four have a row for each straight move:

=============== ======= =============================================================================================
``move``        f4 × 6  start and end of the tip, mm
``since``       f8      start time, s
``until``       f8      end time, s
``row``         u4      row of the toolpath's scene
``cutter``      u4      number of the tool
``rapid``       u1      1 for a rapid
``width``       u1      width of cut; 255: the tool's diameter
``chip``        u1      thickest chip; 255: the feed per tooth
``collision``   f4 × 4  position and depth of each collision, mm
``start``       f4      height of every cell before the first move, mm; empty if all are at the top
``differs``     u1      1 for cells that the other program leaves lower, 2 for cells that it leaves higher; empty if
                        none differ
``held``        u1      1 for cells of the fixture; empty without one
=============== ======= =============================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import LeafcutError
from leafcut.material.height_field import HeightField
from leafcut.material.same_stock import connected_regions, differing_cells
from leafcut.material.solid import Solid, cut_display_solid, displayed_block
from leafcut.message import messages_from_json, messages_to_json
from leafcut.model.cutter import BodyPart, Cutter
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome
from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath
from leafcut.processes.registry import report_of
from leafcut.report.playback import Playback, outcome_playback, playback_of_path
from leafcut.report.wording import replace_unprintable
from leafcut.studio.drawing.scene import Columns, pack_scene

#: Length of a tool's cutting part, in diameters, if the tool library does not specify it.
_FLUTES = 3.0
#: Maximum number of segments that represent a shank and a holder in the drawing.
_MAX_BODIES = 4
#: Tolerance for equal heights, mm, and maximum number of listed differences.
_TOLERANCE, _MAX_PLACES = 0.01, 200


def outcome_solid_scenes(outcome: Outcome) -> tuple[bytes, bytes]:
    """Create the scenes of the stock, as cut by the original and the new toolpath of an outcome.

    If the stock cannot be shown, the scenes explain why.
    """
    stock = report_of(outcome).shown_stock()
    return _compared_scenes(
        _ShownRun(outcome.path_before, stock, lambda: outcome_playback(outcome, "before")),
        _ShownRun(outcome.path_after, stock, lambda: outcome_playback(outcome, "after")),
    )


def compared_solid_scenes(
    first: tuple[Toolpath, Machine, ShownStock],
    second: tuple[Toolpath, Machine, ShownStock],
    measured: tuple[Measure | None, Measure | None] = (None, None),
) -> tuple[bytes, bytes]:
    """Create the scenes of a block that two toolpaths cut separately, and compare the results.

    If the stock cannot be shown, both scenes explain why.
    """
    return _compared_scenes(_shown_run(*first, measured[0]), _shown_run(*second, measured[1]))


def solid_scene(path: Toolpath, machine: Machine, stock: ShownStock, measured: Measure | None = None) -> bytes:
    """Create the scene of the stock that a toolpath cuts. If the stock cannot be shown, the scene explains why.

    The times come from `measured`, if it is given.
    """
    shown = _shown_run(path, machine, stock, measured)
    try:
        return _pack_solid(cut_display_solid(path, stock), shown.rows())
    except LeafcutError as problem:
        return _refusal_scene(problem)


class _ShownRun(NamedTuple):
    path: Toolpath
    stock: ShownStock
    rows: Callable[[], Playback]


def _shown_run(path: Toolpath, machine: Machine, stock: ShownStock, measured: Measure | None = None) -> _ShownRun:
    return _ShownRun(path, stock, lambda: playback_of_path(path, machine, measured=measured))


def _refusal_scene(problem: LeafcutError) -> bytes:
    message = replace_unprintable(str(problem))
    return pack_scene({**_HEAD, "refused": message, "message": messages_to_json(message)}, {})


def _compared_scenes(first: _ShownRun, second: _ShownRun) -> tuple[bytes, bytes]:
    try:
        blocks = [displayed_block(run.path, run.stock) for run in (first, second)]
    except LeafcutError as problem:
        return _refusal_scene(problem), _refusal_scene(problem)
    low = tuple(min(ends) for ends in zip(*(block.low for block in blocks), strict=True))
    high = tuple(max(ends) for ends in zip(*(block.high for block in blocks), strict=True))
    solids: list[Solid] = []
    for run in (first, second):
        try:
            solids.append(cut_display_solid(run.path, replace(run.stock, block=(low, high))))
        except LeafcutError as problem:
            return _refusal_scene(problem), _refusal_scene(problem)
    results = [replace(solid.after, heights=np.maximum(solid.after.heights, solid.after.floor)) for solid in solids]
    wrong = differing_cells(results[0], results[1], _TOLERANCE)
    deeper = results[1].heights < results[0].heights
    groups = connected_regions(wrong & deeper) + connected_regions(wrong & ~deeper)
    places = [_middle_cell(group, results) for group in groups[:_MAX_PLACES]]
    scenes = []
    for index, (run, solid) in enumerate(zip((first, second), solids, strict=True)):
        lower = results[1 - index].heights < results[index].heights
        cells = np.where(wrong, np.where(lower, 1, 2), 0)
        listed = [[x, y, *(heights if index == 0 else heights[::-1])] for x, y, heights in places]
        differs = {"count": len(groups), "places": listed}
        scenes.append(_pack_solid(solid, run.rows(), differs, cells))
    return scenes[0], scenes[1]


def translate_refusal(scene: bytes, say: Callable[[str], str]) -> bytes:
    """If the scene of a stock contains a refusal instead of the stock, translate the refusal with `say`."""
    size = int.from_bytes(scene[8:12], "little")
    header = messages_from_json(scene[16 : 16 + size])
    # Scenes of leafcut 0.2 have no template.
    message = header.get("message", header["refused"])
    return pack_scene({**_HEAD, "refused": say(message)}, {}) if message else scene


_HEAD: dict[str, Any] = {"kind": "solid", "name": "solid", "origin": [0.0, 0.0], "extents": None, "refused": ""}


def _middle_cell(cells: NDArray[np.int64], left: Sequence[HeightField]) -> tuple[float, float, list[float]]:
    """Return the cell closest to the middle of a group of cells: its x and y, and its height in both fields, mm."""
    row, column = cells[np.argmin(np.hypot(*(cells - cells.mean(axis=0)).T))].tolist()
    field = left[0]
    heights = [float(each.heights[row, column]) for each in left]
    return field.x + column * field.cell, field.y + row * field.cell, heights


def _pack_solid(
    solid: Solid, rows: Playback, differs: dict[str, Any] | None = None, cells: NDArray[np.int64] | None = None
) -> bytes:
    moves, field = solid.moves, solid.before
    first, since, until = _first_rows_and_move_times(solid, rows)
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
        "collision": (
            "f4",
            np.array([(*collision.place, collision.depth) for collision in solid.collisions]).reshape(-1, 4),
        ),
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
            str(n): _tool_as_json(solid.tools[n], cutter, solid.bodies.get(n, ()))
            for n, cutter in solid.cutters.items()
        },
        "differs": differs,
        "collisions": [[collision.kind, int(rows.line[first[collision.row]])] for collision in solid.collisions],
    }  # fmt: skip
    return pack_scene({**_HEAD, **header}, columns)


def _first_rows_and_move_times(
    solid: Solid, rows: Playback
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the first scene row of each path row, and the start time and end time of each move, s."""
    path_rows, count = np.arange(len(solid.moves.path)), len(solid.moves.path)
    first = np.searchsorted(rows.of, path_rows)
    seconds = np.bincount(rows.of, weights=rows.seconds, minlength=count)
    starts = np.cumsum(seconds) - seconds
    row = solid.moves.row
    n_moves = np.bincount(row, minlength=count)
    step = np.arange(len(row)) - np.searchsorted(row, row)
    since, until = (starts[row] + (step + end) / n_moves[row] * seconds[row] for end in (0, 1))
    return np.minimum(first, max(len(rows.of) - 1, 0)), since, until


def _tool_as_json(tool: Tool, cutter: Cutter, bodies: Sequence[BodyPart]) -> dict[str, Any]:
    slope = 0.0 if math.isinf(cutter.slope) else cutter.slope
    length = tool.flute_length or _FLUTES * tool.diameter
    shape = [cutter.radius, cutter.flat, cutter.corner, *cutter.tangent_point, slope]
    above = [[part.body.value, part.above, part.radius] for part in bodies[:_MAX_BODIES]]
    point = cutter.height(cutter.radius)
    seen = max(length, point) if math.isfinite(point) else length
    return {"words": replace_unprintable(tool.label), "shape": shape, "bodies": above, "length": seen}
