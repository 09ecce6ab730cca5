"""Readers: one file per format, each turns a file into a `Part`; `registry` knows which."""

from __future__ import annotations

from pathlib import Path

from leafcut.errors import ReadError
from leafcut.model import Part, Severity
from leafcut.options import ReadOptions
from leafcut.read.format import Format, Match, Source
from leafcut.read.registry import formats, read_source, run

__all__ = ["Format", "Match", "Source", "formats", "read"]


def read(source: str | Path, options: ReadOptions | None = None) -> Part:
    """Return the part that a file, or a name such as ``example:plate-70`` or ``random:200:7``, holds; in mm.

    Raises
    ------
    ReadError
        The file cannot be read, holds no holes, or, with `options.strict`, needed anything skipped or repaired.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source)
    part = run(format_, loaded, options)
    warnings = [issue for issue in part.issues if issue.severity is Severity.WARNING]
    if options.strict and warnings:
        more = f", and {len(warnings) - 1} more" if len(warnings) > 1 else ""
        raise ReadError(loaded.path, f"refused by --strict: {warnings[0]}{more}")
    return part
