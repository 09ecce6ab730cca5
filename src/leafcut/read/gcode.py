"""G-code programs are not drawings; the processes that read programs handle them."""

from __future__ import annotations

from leafcut.errors import ReadError
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read.format import Source


def read_gcode(source: Source, options: ReadOptions) -> Part:
    """Raise `ReadError`: a program contains no drawing."""
    raise ReadError(source.path, "this is a program, not a drawing; give it to leafcut optimize, simulate or verify")
