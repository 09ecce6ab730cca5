"""Determine the stock of a program: the block or solid of ``--workpiece``, or a block around the cuts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from leafcut.errors import OptionError, PlanError, ReadError, count_of, printable
from leafcut.gcode.program import Program
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.mesh_field import bounding_block, mesh_to_height_field, overhang_area
from leafcut.material.straight_moves import StraightMoves, undivided_cutting_moves
from leafcut.message import Message
from leafcut.model.cutter import Cutter
from leafcut.model.issue import Issue
from leafcut.model.mesh import Mesh
from leafcut.options import StockOptions
from leafcut.read.step import ChosenSolid
from leafcut.units import MM_PER_INCH, parse_quantity

#: Default: the only solid of a file, in its original position.
THE_ONLY = ChosenSolid()
#: A lead may start outside the material by at most the tool diameter plus this distance, mm.
_LEAD = 5.0
#: A derived block extends this far below the deepest cut, mm.
BELOW = 1.0
#: Smaller undercuts are treated as rounding errors, mm².
_SMALL_AREA = 0.1
#: Lengths that differ by at most this much count as equal, mm.
_SAME = 1e-6
#: Maximum length of a stock, mm.
LONGEST = 20_000.0
#: If a cut is more than this many stock lengths away from the stock, the stock is probably in the wrong unit.
FAR_OFF = 3.0


def stock_block(text: str, which: ChosenSolid = THE_ONLY) -> StockBlock:
    """Return the block of ``--workpiece``, or the bounding box of the solid in its STL or STEP file.

    Raises
    ------
    OptionError
        The value is neither six lengths (lower corner first) nor the path of an STL or STEP file.
    ReadError
        The file contains no closed solid.
    """
    if _is_file(text):
        return bounding_block(solid_file(text, which))
    if which != THE_ONLY:
        raise OptionError("--solid, --up and --z-zero apply to STEP files only, not to a block; leave them out")
    parts = text.replace(";", ",").split(",")
    if len(parts) != 6:
        raise OptionError(
            "--workpiece: '{}' has {}; give six numbers (x,y,z of the lower and of the upper corner), or an "
            "STL or STEP file",
            printable(text, 60),
            count_of(len(parts), "number"),
        )
    try:
        lengths = [parse_quantity(part.strip(), "mm") for part in parts]
        block = StockBlock((lengths[0], lengths[1], lengths[2]), (lengths[3], lengths[4], lengths[5]))
    except (OptionError, PlanError) as problem:
        raise OptionError("--workpiece {}: {}", text, problem) from None
    longest = max(high - low for low, high in zip(block.low, block.high, strict=True))
    if longest > LONGEST:
        raise OptionError(
            "--workpiece {} is {:.4g} m long, which is too long for a stock; check its coordinates",
            text,
            longest / 1000.0,
        )
    return block


def stock_field(options: StockOptions, block: StockBlock, cell: float, which: ChosenSolid = THE_ONLY) -> HeightField:
    """Return the material before the first cut as a height field.

    Raises
    ------
    PlanError
        The field has too many cells.
    """
    if not options.workpiece or not _is_file(options.workpiece):
        return HeightField.of_block(block, cell)

    return mesh_to_height_field(solid_file(options.workpiece, which), cell)


def stock_issues(
    options: StockOptions,
    program: Program,
    cutters: Mapping[int, Cutter],
    block: StockBlock,
    which: ChosenSolid = THE_ONLY,
) -> list[Issue]:
    """Check the stock that the user described. Return warnings about cuts beyond it and about undercuts.

    Undercuts count as filled.
    """
    if not options.workpiece:
        return []
    outside = first_cut_beyond(program, cutters, block)
    found = [outside.issue(unit_that_fits(options.workpiece, program, cutters, block))] if outside else []
    if _is_file(options.workpiece):
        area = overhang_area(solid_file(options.workpiece, which))
        if area > _SMALL_AREA:
            message = Message(
                "the stock has undercuts ({:.1f} mm² seen from below), which are treated as solid material", area
            )
            found.append(Issue("L811", message))
    return found


def workpiece_solid(text: str, which: ChosenSolid = THE_ONLY) -> Mesh | None:
    """Return the solid of ``--workpiece``, or None if it describes a block.

    Raises
    ------
    ReadError
        The file contains no closed solid.
    """
    return solid_file(text, which) if _is_file(text) else None


def _is_file(text: str) -> bool:
    return StockOptions.specs()["workpiece"].names_file(text)


def solid_file(path: str, which: ChosenSolid) -> Mesh:
    """Load the solid in a file, in mm.

    Raises
    ------
    ReadError
        The file contains no closed solid.
    """
    try:
        return _load_cached(path, which, Path(path).stat().st_mtime_ns)
    except OSError:
        return _load_cached(path, which, 0)  # raises the error


@lru_cache(maxsize=1)
def _load_cached(path: str, which: ChosenSolid, _changed: int) -> Mesh:
    """Load the solid in a file. The last solid is cached, because several steps of a job need it."""
    from leafcut.read.meshes import load_mesh

    mesh = load_mesh(path, "mm", Message("save it in mm"), which.which, which.pose)
    if not mesh.closed:
        raise ReadError(path, "has holes in its surface, so its inside is unknown; repair it in CAD")
    return mesh


def block_around(moves: StraightMoves, cutters: Mapping[int, Cutter]) -> StockBlock | None:
    """Return a block around the cuts below Z0.

    Without such cuts, the result is None, because the top of the stock is unknown.
    """
    deep = ~moves.rapid & (np.minimum(moves.ends[:, 2], moves.ends[:, 5]) < 0.0)
    if not deep.any():
        return None
    low, high = moves.swept_box(deep, cutters)
    return StockBlock((float(low[0]), float(low[1]), float(low[2]) - BELOW), (float(high[0]), float(high[1]), 0.0))


def check_block_size(
    program: Program, cutters: Mapping[int, Cutter], block: StockBlock, source: str, text: str
) -> None:
    """Check that no cut below the top of a block is far outside the block. Otherwise, the real stock must be larger.

    Raises
    ------
    OptionError
        Such a cut exists.
    """
    found = first_cut_beyond(program, cutters, block)
    if found is not None:
        line, axis, place, edge = found
        more = unit_hint(unit_that_fits(text, program, cutters, block))
        raise OptionError(
            "--workpiece: {}:{}: a cut reaches {}{:.2f}, but this stock ends at {}{:g}; give the whole stock{}",
            source,
            line,
            axis,
            place,
            axis,
            edge,
            more,
        )


class CutBeyondStock(NamedTuple):
    """A cut that reaches far outside a block.

    `place` is the coordinate of the cut, and `edge` is the edge of the block, mm.
    """

    line: int
    axis: str
    place: float
    edge: float

    def issue(self, unit: str = "") -> Issue:
        """Return a warning. `unit` is the unit in which the stock would contain all cuts, or ""."""
        more = unit_hint(unit)
        place, edge = f"{self.axis}{self.place:.2f}", f"{self.axis}{self.edge:g}"
        message = Message("a cut reaches {}, but the given stock ends at {}{}", place, edge, more)
        return Issue("L810", message, Message("line {}", self.line))


def unit_hint(unit: str) -> str:
    """Return the end of a message, which suggests the unit in which the stock would contain all cuts, or ""."""
    return Message("; in {}, the stock would contain all cuts: save the file in mm", unit) if unit else ""


def unit_that_fits(text: str, program: Program, cutters: Mapping[int, Cutter], block: StockBlock) -> str:
    """Return the unit in which the stock would contain all cuts, or "".

    A unit is suggested only if a cut is many stock lengths away from the stock.
    """
    length = max(high - low for low, high in zip(block.low[:2], block.high[:2], strict=True))
    outside = first_cut_beyond(program, cutters, block) if _is_file(text) else None
    if outside is None or abs(outside.place - outside.edge) < FAR_OFF * length:
        return ""
    for name, times in ((Message("inches"), MM_PER_INCH), (Message("metres"), 1000.0)):
        low, high = (tuple(times * value for value in corner) for corner in (block.low, block.high))
        larger = StockBlock((low[0], low[1], low[2]), (high[0], high[1], high[2]))
        if times * length <= LONGEST and first_cut_beyond(program, cutters, larger) is None:
            return name
    return ""


def first_cut_beyond(program: Program, cutters: Mapping[int, Cutter], block: StockBlock) -> CutBeyondStock | None:
    """Return a cut below the top of a block that is far outside the block, or None.

    A tool may start outside the block by its diameter plus the length of a lead.
    """
    moves = undivided_cutting_moves(program.path, cutters)
    across = np.abs(moves.ends[:, 3:5] - moves.ends[:, :2]).max(axis=1) > 0
    fed = ~moves.rapid & across & (np.maximum(moves.ends[:, 2], moves.ends[:, 5]) < block.high[2])
    if not fed.any():
        return None
    ends, tool = moves.ends[fed], moves.tool[fed]
    room = _LEAD + 2.0 * np.array([cutters[number].radius for number in tool.tolist()])
    for axis, letter in enumerate("XY"):
        low = np.minimum(ends[:, axis], ends[:, axis + 3]) - (block.low[axis] - room)
        high = (block.high[axis] + room) - np.maximum(ends[:, axis], ends[:, axis + 3])
        for spare, edge in ((low, block.low[axis]), (high, block.high[axis])):
            at = int(np.argmin(spare))
            if spare[at] < -_SAME:
                line = int(moves.path.line[moves.row[fed][at]])
                reach = ends[at, [axis, axis + 3]]
                place = float(reach.min() if spare is low else reach.max())
                return CutBeyondStock(line, letter, place, edge)
    return None
