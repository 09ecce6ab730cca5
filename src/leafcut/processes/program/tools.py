"""Determine the tools of a program from its comments, a tool library and options, and the stock that a view shows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import LeafcutError, OptionError
from leafcut.gcode.tool_comments import tool_diameter_in_comments, tool_in_comments
from leafcut.message import Message
from leafcut.model.heartbeat import ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.machine import Machine
from leafcut.model.shown_stock import CUT_THROUGH, ShownStock
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.options import Settings
from leafcut.processes.job import library_of
from leafcut.processes.program.reading import read_file

if TYPE_CHECKING:
    from leafcut.gcode.program import Program
    from leafcut.read import Input

#: Tolerance for tool diameters, mm and relative. Comments round diameters, and mills are reground.
_OTHER_TOOL, _OTHER_SHARE = 0.1, 0.02


def program_tools(
    program: Program, source: str, settings: Settings, machine: Machine, *, by_options: bool = True
) -> dict[int, Tool]:
    """Return the cutting tools of a program by number, in the order of use.

    Without `by_options`, error messages do not mention options.

    Raises
    ------
    OptionError
        A tool shape is unknown.
    """
    found, unknown = known_tools(program, settings, machine)
    for number, block in unknown.items():
        line = int(program.text_line[block])
        if by_options:
            raise OptionError(
                "{}:{}: the shape of tool T{} is unknown; give a library that has it with --tools, or --tool-diameter "
                "for a flat mill",
                source,
                line,
                number,
            )
        raise OptionError(
            "{}:{}: the shape of tool T{} is unknown; describe it in a comment, such as "
            "(T1 D=8. CR=0. - flat end mill)",
            source,
            line,
            number,
        )
    return found


def tool_diameter_warnings(program: Program, settings: Settings, machine: Machine) -> list[Issue]:
    """Return a warning for each tool whose diameter in the library differs from the program's comments."""
    if not settings.job.tools:
        return []
    found = []
    for number, block, tool in _tools_in_use(program, settings, machine):
        named = tool_diameter_in_comments(program, block)
        if tool is not None and named and abs(named - tool.diameter) > max(_OTHER_TOOL, _OTHER_SHARE * named):
            message = Message(
                "T{} is Ø{:.4g} mm in the library, but Ø{:.4g} mm in the program's comment; name the library of "
                "this program with --tools",
                number,
                tool.diameter,
                named,
            )
            found.append(Issue("L813", message, Message("line {}", int(program.text_line[block])), Severity.WARNING))
    return found


def _tools_in_use(program: Program, settings: Settings, machine: Machine) -> list[tuple[int, int, Tool | None]]:
    whole = library_of(settings, machine)
    library = whole.by_number if whole is not None else {}
    kind = program.path.kind
    works = np.flatnonzero((kind >= Kind.FEED) & (kind <= Kind.DRILL))
    number_of = program.path.tool[works]
    _, first_of = np.unique(number_of, return_index=True)
    firsts = np.sort(first_of).tolist()
    return [(int(number_of[at]), int(program.row_block[works[at]]), library.get(int(number_of[at]))) for at in firsts]


def known_tools(
    program: Program, settings: Settings, machine: Machine, *, flat: bool = False
) -> tuple[dict[int, Tool], dict[int, int]]:
    """Return the cutting tools of a program, and the first cutting block of each tool with an unknown shape.

    The keys of both dictionaries are tool numbers, in the order of use. With `flat`, a tool counts as a flat end mill
    if only its diameter is known.
    """
    found: dict[int, Tool] = {}
    unknown: dict[int, int] = {}
    for number, first, listed in _tools_in_use(program, settings, machine):
        tool = listed or tool_in_comments(program, first)
        diameter = (
            0.0 if tool else settings.job.tool_diameter or (tool_diameter_in_comments(program, first) if flat else 0.0)
        )
        if diameter:
            tool = Tool(number, diameter, ToolKind.END_MILL, point_angle=math.pi, assumed=True)
        if tool is None:
            unknown[number] = first
        else:
            found[number] = tool
    return found, unknown


def shown_stock(
    program: Program, source: str, settings: Settings, machine: Machine, process: str, *, by_options: bool = True
) -> ShownStock:
    """Return the known stock and tools of a program. Without `by_options`, error messages do not mention options.

    Raises
    ------
    ReadError, OptionError
        The tool library or ``--workpiece`` is unusable.
    """
    if process in BEAMS:
        return CUT_THROUGH
    block = surface = None
    if given := settings.stock.workpiece:
        from leafcut.processes.program.workpiece import stock_block, workpiece_solid
        from leafcut.read.step import ChosenSolid

        which = ChosenSolid.of(settings.read)
        block, surface = stock_block(given, which), workpiece_solid(given, which)
    try:
        tools = program_tools(program, Path(source).name, settings, machine, by_options=by_options)
    except OptionError as problem:
        return ShownStock(refused=str(problem))
    return ShownStock(tools, None if block is None else (block.low, block.high), surface=surface)


def stock_of_file(program: Input, settings: Settings, *, by_options: bool = True) -> ShownStock:
    """Return the known stock and tools of a program file. See `tools_of` for `by_options`."""
    try:
        read = read_file(program, settings, None, ignore_heartbeat)
        return shown_stock(read.program, str(program), settings, read.machine, read.process, by_options=by_options)
    except LeafcutError as problem:
        return ShownStock(refused=str(problem))
