"""Readers: one file per format, each turns a file into a `Part`; `registry` knows which."""

from __future__ import annotations

from dataclasses import replace

from leafcut.errors import ReadError
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.issue import Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.format import Format, Match, Source
from leafcut.read.reference import reference_of, whole_of
from leafcut.read.registry import Input, formats, read_source, run

__all__ = ["Format", "Input", "Match", "Source", "formats", "read", "read_contours", "read_pockets", "read_whole"]


def read(source: Input, options: ReadOptions | None = None, look: Heartbeat = unseen) -> Part:
    """Return the part that a file, or a name such as ``example:plate-70`` or ``random:200:7``, holds; in mm.

    `look` is called as it goes on.

    Raises
    ------
    ReadError
        The file cannot be read, holds no holes, or, with `options.strict`, needed anything skipped or repaired.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source, look)
    return _read(format_, format_, loaded, options)


def read_contours(source: Input, options: ReadOptions | None = None, look: Heartbeat = unseen) -> Part:
    """Return the lines and curves of a drawing as contours, as they are drawn, in mm.

    `processes.sheet.plan.sheet.prepare_sheet` joins and cleans them. `look` is called as it goes on.

    Raises
    ------
    ReadError
        The file cannot be read, is of a format without contours, holds none, or, with `options.strict`, needed
        anything skipped or repaired.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source, look)
    if format_.contours is None:
        there_are = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in formats() if f.contours)
        raise ReadError(loaded.path, f"{format_.name} has no contours to cut; use {there_are}")
    return _read(replace(format_, read=format_.contours), format_, loaded, options)


def read_pockets(
    source: Input,
    options: ReadOptions | None = None,
    pocket_options: PocketDrawingOptions | None = None,
    joining: SheetOptions | None = None,
    look: Heartbeat = unseen,
) -> Part:
    """Return the pockets of a drawing or a picture, in mm: walls and islands, joined, cleaned and checked.

    Of `joining` count `join_tolerance` and `open_paths`, of `pocket_options` the layers and what is said of pictures.
    `look` is called as it goes on.

    Raises
    ------
    ReadError
        The file cannot be read, is of a format without pockets, holds none, has outlines that are open, cross
        themselves or touch each other, or, with `options.strict`, needed anything skipped or repaired.
    OptionError
        A picture needs `pixel_size`.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source, look)
    if format_.pockets is None:
        there_are = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in formats() if f.pockets)
        raise ReadError(loaded.path, f"{format_.name} has no pockets; use {there_are}")
    clear, given, join = format_.pockets, pocket_options or PocketDrawingOptions(), joining or SheetOptions()
    reader = replace(format_, read=lambda file, reading: clear(file, reading, given, join))
    return _read(reader, format_, loaded, options)


def read_whole(source: Input, options: ReadOptions | None = None, look: Heartbeat = unseen) -> Part:
    """Return all that a drawing shows, in mm, whatever of it is to be worked, for a look at it.

    Its circles are holes, or contours where the format does not tell them from others. Which layers and holes `options`
    choose makes no difference. `look` is called as it goes on.

    Raises
    ------
    ReadError
        The file cannot be read, or shows nothing.
    """
    return whole_of(*read_source(source, look), options or ReadOptions())


def _read(reader: Format, format_: Format, loaded: Source, options: ReadOptions) -> Part:
    """Return the part that `reader` finds, with its reference if a place of it becomes zero."""
    named = isinstance(options.origin, str)
    if named and loaded.kept is None:
        loaded = replace(loaded, kept={})  # the drawing is read twice, and parsed once
    part = _unless_strict(run(reader, loaded, options), loaded, options)
    if named and part.reference is None:
        part = replace(part, reference=reference_of(format_, loaded, options))
    return part


def _unless_strict(part: Part, loaded: Source, options: ReadOptions) -> Part:
    warnings = [issue for issue in part.issues if issue.severity in (Severity.WARNING, Severity.MISSING)]
    if options.strict and warnings:
        more = f", and {len(warnings) - 1} more" if len(warnings) > 1 else ""
        raise ReadError(loaded.path, f"refused by --strict: {warnings[0]}{more}")
    return part
