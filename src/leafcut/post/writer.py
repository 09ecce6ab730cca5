"""The writer: a `Toolpath` in a controller's own words.

    write_program(toolpath, dialect("haas"), PostOptions(), header=["plate.dxf"])

It writes the rows of the toolpath, one after the other, and nothing else that moves. It refuses what could break
something: a move in X or Y while the height of the tool is not known, that is before the first move in Z and after
every change of tool.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect
from leafcut.model.toolpath import Toolpath
from leafcut.options import PostOptions
from leafcut.post.klartext import KlartextWriter
from leafcut.post.row_writer import Writer
from leafcut.post.sinumerik import SinumerikWriter

#: By the language of a dialect; any other is G-code.
_WRITERS: dict[str, type[Writer]] = {"sinumerik": SinumerikWriter, "klartext": KlartextWriter}
_NO_NAMES: Mapping[int, str] = MappingProxyType({})


def write_program(
    toolpath: Toolpath,
    dialect: Dialect,
    options: PostOptions,
    header: Sequence[str] = (),
    *,
    tool_names: Mapping[int, str] = _NO_NAMES,
    spindle_start_s: float = 0.0,
    rapid_velocity: float = math.nan,
    preselect_tool: bool = False,
) -> str:
    """Return the program.

    Parameters
    ----------
    toolpath
        mm, mm/s, s, rpm; its last row is `Kind.END`. Its numbers are rounded to the decimals of the dialect, so that
        a place read back differs by half of the last decimal at most. `Kind.OFFSET` rows are not needed: the tool
        length offset of every tool is taken up with its first move in Z.
    options
        Units, line numbers, program number, header and repeated words. The dialect is the argument's.
    header
        Lines for the comments at the top; the first one names the program. Not written with `options.header` off.
    tool_names
        Written as a comment where the tool is taken up.
    spindle_start_s
        Dwell after a start of the spindle that the toolpath does not follow by a dwell of its own.
    rapid_velocity
        Speed of rapids, mm/s, for a dialect whose G0 states it (`Dialect.rapid_feed`); NaN: not stated.
    preselect_tool
        After each tool change name the next tool (T without M6).

    Raises
    ------
    PostError
        The toolpath needs a word that the controller does not have, or would move before its height is known.
    """
    check_options(dialect, options)
    writer = _WRITERS.get(dialect.language, Writer)(
        toolpath, dialect, options, tool_names, spindle_start_s, rapid_velocity, preselect_tool
    )
    return writer.program(header if options.header else ())


def check_options(dialect: Dialect, options: PostOptions) -> None:
    """Refuse what the controller has no words for.

    Raises
    ------
    PostError
        Inches, or numbered blocks.
    """
    if options.output_units == "inch" and not dialect.units_inch:
        raise PostError(f"--output-units inch: {dialect.name} programs are in millimetres; leave it out")
    if options.line_numbers and not dialect.line_numbers:
        raise PostError(f"--line-numbers: {dialect.name} takes no numbered blocks; leave it out")
