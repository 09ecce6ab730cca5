"""The stock of a program for display: its tools and its block, or the reason why they are unknown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from leafcut.errors import LeafcutError, OptionError
from leafcut.model.heartbeat import unseen
from leafcut.model.kinds import BEAMS
from leafcut.model.machine import Machine
from leafcut.model.shown_stock import CUT_THROUGH, ShownStock
from leafcut.options import Settings
from leafcut.processes.program.workpiece import block_of, solid_of_file, tools_of
from leafcut.read.step import ChosenSolid

if TYPE_CHECKING:
    from leafcut.gcode.program import Program
    from leafcut.read import Input


def shown_stock(
    program: Program, source: str, settings: Settings, machine: Machine, process: str, *, by_options: bool = True
) -> ShownStock:
    """Return the known stock and tools of a program; for `by_options` see `tools_of`.

    `ReadError` or `OptionError` if the tool library or ``--workpiece`` is unusable.
    """
    if process in BEAMS:
        return CUT_THROUGH
    given = settings.stock.workpiece
    block = block_of(given, ChosenSolid.of(settings.read)) if given else None
    try:
        tools = tools_of(program, Path(source).name, settings, machine, by_options=by_options)
    except OptionError as problem:
        return ShownStock(refused=str(problem))
    surface = solid_of_file(given, ChosenSolid.of(settings.read)) if given else None
    return ShownStock(tools, None if block is None else (block.low, block.high), surface=surface)


def stock_of_file(program: Input, settings: Settings, *, by_options: bool = True) -> ShownStock:
    """Return the known stock and tools of a program file; for `by_options` see `tools_of`."""
    from leafcut.processes.program.reading import read_file

    try:
        read = read_file(program, settings, None, unseen)
        return shown_stock(
            read.program, str(program), settings, read.machine, read.process, by_options=by_options
        )  # fmt: skip
    except LeafcutError as problem:
        return ShownStock(refused=str(problem))
