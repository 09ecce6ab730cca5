"""What every piece of a program's motions meets in its stock: chips, widths and volumes, and how near material is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.cutter import Cutter
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.pace import ToolLimits
from leafcut.model.tool import MILLS, Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.stock.chip_thickness import chip_share, cut_width
from leafcut.stock.cutting import Removed, cut
from leafcut.stock.height_field import HeightField
from leafcut.stock.straight_moves import StraightMoves, straight_moves
from leafcut.units import SECONDS_PER_MINUTE

#: A cut that falls by more than this per mm goes down into the material: it keeps its feed.
_LEVEL = 0.001
#: Tools whose feed goes by their chips.
_MILLING = (*MILLS, ToolKind.SLOT_MILL)


@dataclass(frozen=True, eq=False)
class StockBefore:
    """The material before a program: its cells, how high it stands beside them, mm, and whether it was described."""

    field: HeightField
    beside: float
    known: bool


@dataclass(frozen=True, eq=False)
class Loads:
    """What every straight piece of a program's motions meets.

    Attributes
    ----------
    moves, removed
        The pieces, and what they take off.
    feed, rpm
        Of every piece: mm/s, 0 for rapids; 1/min.
    share, width
        The thickest chip as a share of the feed per tooth; how wide is cut, mm.
    rate
        Volume by time, mm³/s.
    source
        int64[m]: the row of the path.
    """

    moves: StraightMoves
    removed: Removed
    feed: Floats
    rpm: Floats
    share: Floats
    width: Floats
    rate: Floats
    source: NDArray[np.int64]

    @cached_property
    def chip(self) -> Floats:
        """The thickest chip in one revolution, mm: of one tooth, if it had but one."""
        with np.errstate(divide="ignore", invalid="ignore"):
            chip: Floats = np.where(self.rpm > 0, SECONDS_PER_MINUTE * self.share * self.feed / self.rpm, 0.0)
        return chip

    @cached_property
    def upright(self) -> NDArray[np.bool_]:
        """Which pieces go straight up or down."""
        return np.asarray(np.hypot(*(self.moves.ends[:, 3:5] - self.moves.ends[:, :2]).T) < 1e-9)

    @cached_property
    def mills(self) -> NDArray[np.bool_]:
        """Which pieces are fed through material, and not down into it."""
        ends = self.moves.ends
        across = np.hypot(*(ends[:, 3:5] - ends[:, :2]).T)
        mills: NDArray[np.bool_] = (
            ~self.moves.rapid & self.removed.cuts & ~self.upright & (ends[:, 5] - ends[:, 2] >= -_LEVEL * across)
        )
        return mills


def loads_of(
    path: Toolpath,
    cutters: Mapping[int, Cutter],
    stock: StockBefore,
    clearance: float,
    threads: int = 1,
    look: Heartbeat = unseen,
) -> Loads:
    """Return what every piece of the motions of a path meets in the stock, which stays as it is.

    Raises
    ------
    PlanError
        There are too many pieces.
    """
    field_ = stock.field.copy()
    smallest = 2.0 * min(cutter.radius for cutter in cutters.values())
    numbered = replace(path, line=np.arange(len(path), dtype=np.int32))
    moves = straight_moves(numbered, 0.05 * field_.cell, max(0.5 * smallest, 2.0 * field_.cell)).of_tools(cutters)
    margin = clearance + field_.cell
    removed = cut(field_, moves, cutters, threads, look, margin=margin, beside=stock.beside)
    source = moves.path.line[moves.row].astype(np.int64)
    radius = np.array([cutters[number].radius for number in moves.tool.tolist()])
    fed = np.where(moves.rapid, 0.0, moves.path.value[moves.row])
    rpm = np.abs(path.latest(Kind.SPINDLE, path.value))[source]
    length = np.sqrt(((moves.ends[:, 3:] - moves.ends[:, :3]) ** 2).sum(axis=1))
    rate = np.divide(removed.volume * fed, length, out=np.zeros_like(length), where=length > 0)
    share, width = chip_share(removed, radius, field_.cell), cut_width(removed, radius, field_.cell)
    return Loads(moves, removed, fed, rpm, share, width, rate, source)


def limits_of(loads: Loads, tools: Mapping[int, Tool]) -> dict[int, ToolLimits]:
    """Return what every milling tool is asked for at most: by its library, else by the program's own worst cut."""
    limits: dict[int, ToolLimits] = {}
    mills, chip = loads.mills, loads.chip
    for number, tool in tools.items():
        mine = mills & (loads.moves.tool == number)
        if tool.kind not in _MILLING or not mine.any() or not (loads.rpm[mine] > 0).all():
            continue
        rate = float(loads.rate[mine].max())
        if tool.feed > 0 and tool.spindle_rpm > 0 and not tool.assumed:
            limits[number] = ToolLimits(SECONDS_PER_MINUTE * tool.feed / tool.spindle_rpm, rate, True)
        else:
            limits[number] = ToolLimits(float(chip[mine].max()), rate, False)
    return limits
