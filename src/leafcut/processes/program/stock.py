"""Simulate how a program removes material from its stock, move by move, and return the remaining stock."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError, count_of
from leafcut.material.height_field import COARSEST, HeightField, StockBlock, default_cell_size
from leafcut.material.mesh_field import bounding_block
from leafcut.material.same_stock import stock_differences
from leafcut.material.stock_cut import BodyCut, RapidCut, StockCut, ToolCut
from leafcut.material.straight_moves import (
    StraightMoves,
    cutting_moves_for_cells,
    smallest_tool_diameter,
    undivided_cutting_moves,
)
from leafcut.message import Message
from leafcut.model.cutter import Body, BodyPart, Cutter, cutter_of_tool, shank_and_holder_sections
from leafcut.model.heartbeat import OnProgress, heartbeat_for_step
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Kind
from leafcut.options import Settings
from leafcut.processes.program.reading import BELOW_SURFACE, read_file
from leafcut.processes.program.stated_part import StatedPart, place_part_as_stated, stated_part, stock_before_cuts
from leafcut.processes.program.tools import program_tools, tool_diameter_warnings
from leafcut.processes.program.workpiece import (
    block_around,
    solid_file,
    stock_block,
    stock_field,
    stock_issues,
    unit_hint,
    unit_that_fits,
)
from leafcut.read.step import ChosenSolid

if TYPE_CHECKING:
    from leafcut.material.cutting import Removed
    from leafcut.model.heartbeat import Heartbeat
    from leafcut.processes.program.reading import ProgramRead
    from leafcut.read import Input

#: A simulated move is at most this share of the smallest tool diameter long, or at most this number of cells. The
#: larger limit applies.
_PIECE, _PIECE_CELLS = 0.5, 2.0
#: At most this many rapids in the material are reported individually.
_MOST_LISTED = 10


#: Tolerance for heights, mm. Rounding depends on the order of the cuts.
TOLERANCE = 0.01


class _Cuts(NamedTuple):
    """A program with its tools and their shapes. In `whole`, the cuts are not divided into shorter moves."""

    source: str
    read: ProgramRead
    tools: dict[int, Tool]
    cutters: dict[int, Cutter]
    bodies: dict[int, tuple[BodyPart, ...]]
    whole: StraightMoves

    @property
    def smallest(self) -> float:
        return smallest_tool_diameter(self.cutters)


def cut_stock(
    program: Input,
    settings: Settings,
    dialect: str | None,
    progress: OnProgress | None,
    *,
    same_as: Input | None = None,
) -> StockCut:
    """Simulate how a program removes material. With `same_as`, compare the remaining stock with another program.

    Raises
    ------
    ReadError, OptionError
        A program cannot be read, the stock is not a block, or a tool shape is unknown.
    PlanError
        The program drives a laser or torch or never touches the stock, or the simulation has too many cells or moves.
    """
    check_cancelled = heartbeat_for_step(progress, Message("reading"))
    mine = _read_with_tools(program, settings, dialect, check_cancelled)
    every = [mine] if same_as is None else [mine, _read_with_tools(same_as, settings, dialect, check_cancelled)]
    given = settings.stock.workpiece
    which = ChosenSolid.of(settings.read)
    stated = stated_part(mine.read.program)
    part = None
    if settings.stock.part:
        part = place_part_as_stated(solid_file(settings.stock.part, ChosenSolid(settings.read.solid)), stated)
    block = bounding_block(part) if part is not None else stock_block(given, which) if given else _common_block(every)
    cell = settings.stock.cell or default_cell_size(block, min(one.smallest for one in every))
    check_cancelled = heartbeat_for_step(progress, Message("cutting the stock"))
    if part is not None:
        stock = stock_before_cuts(part, cell, _divided_moves(mine, cell), mine.cutters, check_cancelled)
    else:
        stock = stock_field(settings.stock, block, cell, which)
    field, moves, removed = _simulate(mine, stock.copy() if same_as is not None else stock, check_cancelled)
    if not removed.cuts.any():
        sides = ", ".join(f"{a} {block.low[k]:g} to {block.high[k]:g}" for k, a in enumerate("XYZ"))
        unit = unit_that_fits(given or "", mine.read.program, mine.cutters, block)
        raise PlanError(
            "{}: the program never touches the stock ({} mm); give --workpiece in the coordinates of the program{}",
            mine.source,
            sides,
            unit_hint(unit),
        )
    rapids, collisions = _rapids_in_material(moves, removed), _body_collisions(moves, removed)
    assumed = _assumed_block(stated) if part is None and not given else []
    return StockCut(
        mine.source,
        mine.read.machine,
        block,
        part is None and not given,
        field,
        _removal_by_tool(moves, removed, mine.tools, mine.read.machine),
        rapids,
        collisions,
        None if same_as is None else str(same_as),
        tuple(
            one
            for other in every[1:]
            for one in stock_differences(_simulate(other, stock, check_cancelled)[0], field, TOLERANCE)
        ),
        (
            *tool_diameter_warnings(mine.read.program, settings, mine.read.machine),
            *assumed,
            *_rapid_issues(rapids, stated is not None and bool(assumed)),
            *_body_issues(collisions),
            *_stock_issues(mine, settings, block, cell),
            *_uncovered_dangers(mine, None if given or part is not None else block, part is not None),
            *mine.read.issues,
            *_unknown_move_issues(mine.whole),
        ),
        settings.options_from_defaults(),
        settings.stock.part or "",
    )


def _uncovered_dangers(one: _Cuts, assumed: StockBlock | None, in_part: bool) -> list[Issue]:
    path = one.read.program.path
    if any(
        len(np.unique(path.latest(kind, path.ref)[path.kind <= Kind.DRILL])) > 1 for kind in (Kind.FRAME, Kind.SHIFT)
    ):
        return one.read.find_dangers()
    mine = np.isin(path.tool, list(one.cutters))
    simulated = mine & np.isfinite(path.before).all(axis=1) & np.isfinite(path.end[:, :2]).all(axis=1)
    if assumed is not None:
        radius = np.zeros(len(path))
        radius[mine] = [one.cutters[k].radius for k in path.tool[mine].tolist()]
        for places in (path.before, path.end):
            for axis in (0, 1):
                low, high = assumed.low[axis] + radius - TOLERANCE, assumed.high[axis] - radius + TOLERANCE
                simulated &= (places[:, axis] >= low) & (places[:, axis] <= high)
    codes = ("L802",) if assumed is not None else BELOW_SURFACE
    found = one.read.find_dangers(dict.fromkeys(codes, simulated))
    return [danger for danger in found if not in_part or danger.code not in BELOW_SURFACE]


def _read_with_tools(program: Input, settings: Settings, dialect: str | None, check_cancelled: Heartbeat) -> _Cuts:
    source, read = str(program), read_file(program, settings, dialect, check_cancelled)
    if read.process in BEAMS:
        raise PlanError("{}: this program drives a laser or a torch; only milled and drilled stock has heights", source)
    tools = program_tools(read.program, source, settings, read.machine)
    if not tools:
        raise PlanError("{}: the program cuts nothing, so the stock is unchanged", source)
    cutters = {number: cutter_of_tool(tool) for number, tool in tools.items()}
    bodies = {number: shank_and_holder_sections(tool) for number, tool in tools.items()}
    return _Cuts(source, read, tools, cutters, bodies, undivided_cutting_moves(read.program.path, cutters))


def _simulate(one: _Cuts, field: HeightField, check_cancelled: Heartbeat) -> tuple[HeightField, StraightMoves, Removed]:
    from leafcut.material.cutting import simulate_cutting

    moves = _divided_moves(one, field.cell)
    return (
        field,
        moves,
        simulate_cutting(field, moves, one.cutters, os.cpu_count() or 1, check_cancelled, bodies=one.bodies),
    )


def _divided_moves(one: _Cuts, cell: float) -> StraightMoves:
    longest = max(_PIECE * one.smallest, _PIECE_CELLS * cell)
    return cutting_moves_for_cells(one.read.program.path, one.cutters, cell, longest)


def _assumed_block(stated: StatedPart | None) -> list[Issue]:
    if stated is None:
        message = Message(
            "the stock is assumed to be a full block around the cuts with its top at Z0; give the real stock "
            "with --workpiece"
        )
        return [Issue("L510", message, severity=Severity.NOTE)]
    return [
        Issue(
            "L510",
            Message(
                "the stock is assumed to be a full block around the cuts with its top at Z0, but the program "
                "was made for {}; give that file with --part to check rapids",
                stated.name,
            ),
        )
    ]


def _common_block(programs: Sequence[_Cuts]) -> StockBlock:
    """Return the smallest block around the cuts of all programs below Z0.

    Raises
    ------
    PlanError
        A program has no cuts below Z0.
    """
    blocks = []
    for one in programs:
        block = block_around(one.whole, one.cutters)
        if block is None:
            raise PlanError(
                "{}: the program cuts nothing below Z0, so the top of the stock is unknown; give --workpiece",
                one.source,
            )
        blocks.append(block)
    low, high = zip(*(one.low for one in blocks), strict=True), zip(*(one.high for one in blocks), strict=True)
    (x, y, z), (right, rear, top) = map(min, low), map(max, high)
    return StockBlock((x, y, z), (right, rear, top))


def _rapids_in_material(moves: StraightMoves, removed: Removed) -> tuple[RapidCut, ...]:
    deepest: dict[int, float] = {}
    for at in np.flatnonzero(moves.rapid & removed.cuts).tolist():
        line = int(moves.path.line[moves.row[at]])
        deepest[line] = max(deepest.get(line, 0.0), float(removed.depth[at]))
    return tuple(RapidCut(line, depth) for line, depth in sorted(deepest.items()))


def _stock_issues(one: _Cuts, settings: Settings, block: StockBlock, cell: float) -> list[Issue]:
    found = stock_issues(settings.stock, one.read.program, one.cutters, block, ChosenSolid.of(settings.read))
    if cell > COARSEST * one.smallest * (1.0 + 1e-9):
        message = Message(
            "cells of {:g} mm are coarse for a tool of {:g} mm; use a smaller --cell or a smaller stock",
            cell,
            one.smallest,
        )
        found.append(Issue("L812", message))
    return found


def _body_collisions(moves: StraightMoves, removed: Removed) -> tuple[BodyCut, ...]:
    deepest: dict[tuple[int, int, Body], float] = {}
    for body, depths in ((Body.SHANK, removed.shank), (Body.HOLDER, removed.holder)):
        for at in np.flatnonzero(depths > 0.0).tolist():
            key = int(moves.path.line[moves.row[at]]), int(moves.tool[at]), body
            deepest[key] = max(deepest.get(key, 0.0), float(depths[at]))
    return tuple(BodyCut(*key, depth) for key, depth in sorted(deepest.items()))


def _body_issues(collisions: tuple[BodyCut, ...]) -> list[Issue]:
    """Return a danger for each tool whose shank or holder enters the material.

    The message states the first line and the number of lines.
    """
    groups: dict[tuple[int, Body], list[BodyCut]] = {}
    for one in collisions:
        groups.setdefault((one.tool, one.body), []).append(one)
    return [
        Issue(
            "L809",
            Message("the {} of T{} enters the stock, {:.2f} mm deep", body, tool, max(one.depth_mm for one in found))
            + (Message(" at most, in {} lines starting here", len(found)) if len(found) > 1 else ""),
            Message("line {}", found[0].line),
            Severity.DANGER,
        )
        for (tool, body), found in groups.items()
    ]


def _rapid_issues(rapids: tuple[RapidCut, ...], doubtful: bool) -> list[Issue]:
    """Report the rapids in the material as dangers, or as warnings if the stock is uncertain.

    Only the first rapids are listed.
    """
    severity = Severity.WARNING if doubtful else Severity.DANGER
    issues = [
        Issue(
            "L802",
            Message("a rapid goes {:.2f} mm deep into the stock", one.depth_mm),
            Message("line {}", one.line),
            severity,
        )
        for one in rapids[:_MOST_LISTED]
    ]
    if len(rapids) > _MOST_LISTED:
        more = len(rapids) - _MOST_LISTED
        message = (
            Message("{} more rapids go into the stock", more)
            if more > 1
            else Message("1 more rapid goes into the stock")
        )
        issues.append(Issue("L802", message, Message("line {}", rapids[_MOST_LISTED].line), severity))
    return issues


def _unknown_move_issues(moves: StraightMoves) -> list[Issue]:
    """Report cuts with an unknown start. Only the end of such a cut is simulated."""
    fed = moves.unknown[moves.path.kind[moves.unknown] != Kind.RAPID]
    if not len(fed):
        return []
    line = int(moves.path.line[fed[0]])
    return [
        Issue(
            "L808",
            Message(
                "the start point of {} is unknown, so the simulation cuts only at the end point",
                count_of(len(fed), "cut"),
            ),
            Message("line {}", line),
        )
    ]


def _removal_by_tool(
    moves: StraightMoves, removed: Removed, tools: Mapping[int, Tool], machine: Machine
) -> tuple[ToolCut, ...]:
    from leafcut.timing.toolpath import seconds_by_row

    seconds = _seconds_by_move(moves, seconds_by_row(moves.path, machine))
    across = np.hypot(*(moves.ends[:, 3:5] - moves.ends[:, :2]).T) > 0
    rows = []
    for number, tool in tools.items():
        fed = (moves.tool == number) & ~moves.rapid
        cutting = fed & removed.cuts
        wide = cutting & across
        width = removed.left[wide] + removed.right[wide]
        mine = moves.tool == number
        rows.append(
            ToolCut(
                tool,
                float(removed.volume[mine].sum()),
                float(seconds[cutting].sum()),
                float(seconds[fed & ~removed.cuts].sum()),
                float(removed.depth[cutting].max(initial=0.0)),
                min(float(width.max(initial=0.0)), tool.diameter),
            )
        )
    return tuple(rows)


def _seconds_by_move(moves: StraightMoves, by_row: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the time of every move, s. The time of a row is divided among its moves in proportion to their length."""
    length = np.sqrt(((moves.ends[:, 3:] - moves.ends[:, :3]) ** 2).sum(axis=1))
    whole = np.bincount(moves.row, weights=length, minlength=len(by_row))[moves.row]
    share = np.divide(length, whole, out=np.zeros_like(length), where=whole > 0)
    seconds: NDArray[np.float64] = by_row[moves.row] * share
    return seconds
