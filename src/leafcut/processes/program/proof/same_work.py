"""The same work in another order: every hole and every cut of one program is in the other, with nothing added."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from leafcut.geometry.arrays import Floats, Mask
from leafcut.model.cycles import expand
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.proof.explanation import explain
from leafcut.processes.program.proof.features import Features, features_of, states_of_path
from leafcut.processes.program.proof.matching import Room, pair
from leafcut.proof.difference import shorten
from leafcut.proof.read_back import compare_motion

__all__ = ["compare_motion", "same_work"]


def same_work(original: Toolpath, new: Toolpath, tolerance_mm: float = 0.002) -> list[Difference]:
    """Return in what two programs differ, whatever the order of their work; nothing when they do the same.

    Holes: place, depth, cycle, peck and dwell; cuts: both ends, and centre, plane and turns of arcs; all with tool,
    feed, spindle speed and direction, coolant. The R plane and the retract of a hole, and the lowest rapid across with
    each tool, may be higher than in the original, never lower. When only one of the two uses drilling cycles, both are
    compared as single moves. Coordinates agree within `tolerance_mm` on every axis.

    This is for toolpaths that were planned. Two programs are compared by `certificate.certify`, which
    looks at their order, too.
    """
    if only_moves(original) or only_moves(new):
        original, new = expand(original), expand(new)
    room = Room(tolerance_mm)
    pairing = pair(_planned(original), _planned(new), room)
    changed = explain(pairing, room)
    lower = list(_lower_traverses(original, new, tolerance_mm))
    return shorten([*lower, *changed.differences], len(lower) + changed.found)


def only_moves(path: Toolpath) -> bool:
    """Return whether a program does its work without drilling cycles; one that does no work fits any other."""
    return bool(_working(path).any()) and not bool((path.kind == Kind.DRILL).any())


def _working(path: Toolpath) -> Mask:
    working: Mask = (path.kind >= Kind.FEED) & (path.kind <= Kind.DRILL)
    return working


def _planned(path: Toolpath) -> Features:
    """Return the features of a planned toolpath: of its states only those that a plan has, a dwell with its cut."""
    features = features_of(path, states_of_path(path), _working(path))
    none = {name: np.zeros_like(features.states[name]) for name in ("length", "frame", "radius", "blending", "corner")}
    dwell = np.zeros(len(path))
    dwell[:-1] = np.where(path.kind[1:] == Kind.DWELL, path.value[1:], 0.0)
    cuts = path.kind[features.row] != Kind.DRILL
    features.dwell[cuts] = dwell[features.row[cuts]]
    return replace(features, states={**features.states, **none})


def _lower_traverses(original: Toolpath, new: Toolpath, tolerance: float) -> Iterator[Difference]:
    """Yield the tools with which rapids cross the part lower than they ever did before."""
    heights = _lowest_traverses(original)
    for tool, (height, line) in _lowest_traverses(new).items():
        if tool in heights and height < heights[tool][0] - tolerance - 1e-9:
            text = (
                f"rapids with tool {tool} cross the part at Z{height:.3f}, never below Z{heights[tool][0]:.3f} before"
            )
            yield Difference("lower retract", heights[tool][1], line, text)


def _lowest_traverses(path: Toolpath) -> dict[int, tuple[float, int]]:
    """Return by tool the lowest known height of a rapid in x or y, and its line."""
    path = expand(path)
    before = path.before
    moved = np.abs(path.end - before)
    across = (path.kind == Kind.RAPID) & ((moved[:, 0] > 0) | (moved[:, 1] > 0))
    lowest: Floats = np.fmin(before[:, 2], path.end[:, 2])
    tools = states_of_path(path).of("tool")
    found: dict[int, tuple[float, int]] = {}
    for tool in np.unique(tools[across]).tolist():
        rows = np.flatnonzero(across & (tools == tool) & np.isfinite(lowest))
        if len(rows):
            row = int(rows[np.argmin(lowest[rows])])
            found[int(tool)] = (float(lowest[row]), int(path.line[row]))
    return found
