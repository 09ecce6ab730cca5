"""Conversion of a `Toolpath` to a program in the dialect of a controller.

    write_program(toolpath, dialect("haas"), PostOptions(), header=["plate.dxf"])

The rows of the toolpath are written one after the other, without additional motion. A move in X or Y is refused while
the height of the tool is unknown: before the first move in Z, and after every tool change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect
from leafcut.model.toolpath import Toolpath
from leafcut.options import PostOptions
from leafcut.post.row_writer import NO_NAMES, Writer


def write_program(
    toolpath: Toolpath,
    dialect: Dialect,
    options: PostOptions,
    header: Sequence[str] = (),
    *,
    tool_names: Mapping[int, str] = NO_NAMES,
    spindle_start_s: float = 0.0,
    rapid_velocity: float = math.nan,
    preselect_tool: bool = False,
) -> str:
    """Return the text of the program.

    Parameters
    ----------
    toolpath
        Motion in mm, mm/s, s and rpm; its last row is `Kind.END`. Numbers are rounded to the decimals of the dialect,
        so a position read back differs by at most half of the last decimal. `Kind.OFFSET` rows are not needed: the
        length offset of every tool is activated with its first move in Z.
    options
        Units, line numbers, program number and header. The dialect of the options is not used.
    header
        Comment lines at the top; the first line names the program. They are not written if `options.header` is off.
    tool_names
        Tool number → name for comments.
    rapid_velocity
        Speed of rapids, mm/s, for a dialect whose G0 states it (`Dialect.rapid_feed`); NaN to leave it out.
    spindle_start_s
        Dwell, s, after a spindle start that has no dwell in the toolpath.
    preselect_tool
        Whether the next tool is named after each tool change.

    Raises
    ------
    PostError
        The toolpath needs a word that the controller lacks, or would move before its height is known.
    """
    check_options(dialect, options)
    writer = _writer_of(dialect.language)(
        toolpath, dialect, options, tool_names, spindle_start_s, rapid_velocity, preselect_tool
    )
    return writer.program(header if options.header else ())


def _writer_of(language: str) -> type[Writer]:
    """Return the writer of a language; all dialects without their own language use the writer of G-code."""
    if language == "klartext":
        from leafcut.post.klartext import KlartextWriter

        return KlartextWriter
    if language == "sinumerik":
        from leafcut.post.sinumerik import SinumerikWriter

        return SinumerikWriter
    return Writer


def check_options(dialect: Dialect, options: PostOptions) -> None:
    """Raise PostError for inches or line numbers if the controller does not support them."""
    if options.output_units == "inch" and not dialect.units_inch:
        raise PostError("--output-units inch: {} programs are in millimetres; leave it out", dialect.name)
    if options.line_numbers and not dialect.line_numbers:
        raise PostError("--line-numbers: {} does not support block numbers; leave it out", dialect.name)
