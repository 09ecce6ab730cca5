"""Write a `Toolpath` in the dialect of a controller.

    write_program(toolpath, dialect("haas"), PostOptions(), header=["plate.dxf"])

It writes the rows of the toolpath one after the other, and adds no motion. It refuses a move in X or Y while the tool
height is unknown: before the first move in Z, and after every tool change.
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

#: Writer by language of a dialect; G-code for any other.
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
        mm, mm/s, s, rpm; its last row is `Kind.END`. Numbers are rounded to the decimals of the dialect, so that a
        position read back differs by at most half of the last decimal. `Kind.OFFSET` rows are not needed: the length
        offset of every tool is activated with its first move in Z.
    options
        Units, line numbers, program number, header and repeated words. The dialect is the argument's.
    header
        Comment lines at the top; the first names the program. Not written with `options.header` off.
    rapid_velocity
        Speed of rapids, mm/s, for a dialect whose G0 states it (`Dialect.rapid_feed`); NaN: not stated.
    spindle_start_s
        Dwell after a spindle start that has no dwell of its own in the toolpath.

    Raises
    ------
    PostError
        The toolpath needs a word that the controller lacks, or would move before its height is known.
    """
    check_options(dialect, options)
    writer = _WRITERS.get(dialect.language, Writer)(
        toolpath, dialect, options, tool_names, spindle_start_s, rapid_velocity, preselect_tool
    )
    return writer.program(header if options.header else ())


def check_options(dialect: Dialect, options: PostOptions) -> None:
    """Raise `PostError` for inches or numbered blocks if the controller does not support them."""
    if options.output_units == "inch" and not dialect.units_inch:
        raise PostError(f"--output-units inch: {dialect.name} programs are in millimetres; leave it out")
    if options.line_numbers and not dialect.line_numbers:
        raise PostError(f"--line-numbers: {dialect.name} does not support block numbers; leave it out")
