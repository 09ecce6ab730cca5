"""Readers of files, one module per format. Each reader converts a file to a `Part`; `registry` chooses the reader."""

from __future__ import annotations

from dataclasses import replace

from leafcut.errors import ReadError
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.format import Format, Match, Source
from leafcut.read.registry import Input, formats, read_source, run_reader

__all__ = ["Format", "Input", "Match", "Source", "formats", "read", "read_contours", "read_pockets", "read_whole"]


def read(source: Input, options: ReadOptions | None = None, on_progress: Heartbeat = ignore_heartbeat) -> Part:
    """Return the part of a file, or of a name such as ``example:plate-70`` or ``random:200:7``, in mm.

    Raises
    ------
    ReadError
        The file cannot be read or contains no holes; with `options.strict`, also if anything was skipped or repaired.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source, on_progress)
    return _read(format_, format_, loaded, options)


def read_contours(source: Input, options: ReadOptions | None = None, on_progress: Heartbeat = ignore_heartbeat) -> Part:
    """Return the lines and curves of a drawing as contours, unchanged, in mm.

    `processes.contours.prepare_sheet` joins and cleans them.

    Raises
    ------
    ReadError
        The file cannot be read, or contains no contours; with `options.strict`, also if anything was skipped or
        repaired.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source, on_progress)
    if format_.contours is None:
        known_formats = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in formats() if f.contours)
        raise ReadError(loaded.path, Message("{} has no contours to cut; use {}", format_.name, known_formats))
    return _read(replace(format_, read=format_.contours), format_, loaded, options)


def read_pockets(
    source: Input,
    options: ReadOptions | None = None,
    pocket_options: PocketDrawingOptions | None = None,
    joining: SheetOptions | None = None,
    on_progress: Heartbeat = ignore_heartbeat,
) -> Part:
    """Return the pockets of a drawing or a picture, in mm: walls and islands, joined, cleaned and checked.

    Only `join_tolerance` and `open_paths` of `joining` are used.

    Raises
    ------
    ReadError
        The file cannot be read, contains no pockets, or its format has none; or an outline is open, crosses itself or
        touches another outline. With `options.strict`, also if anything was skipped or repaired.
    OptionError
        A picture needs `pixel_size`.
    """
    options = options or ReadOptions()
    format_, loaded = read_source(source, on_progress)
    if format_.pockets is None:
        known_formats = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in formats() if f.pockets)
        raise ReadError(loaded.path, Message("{} has no pockets; use {}", format_.name, known_formats))
    clear, drawing_options, join = format_.pockets, pocket_options or PocketDrawingOptions(), joining or SheetOptions()
    reader = replace(format_, read=lambda file, reading: clear(file, reading, drawing_options, join))
    return _read(reader, format_, loaded, options)


def read_whole(source: Input, options: ReadOptions | None = None, on_progress: Heartbeat = ignore_heartbeat) -> Part:
    """Return everything in a drawing, in mm, for display.

    Circles become holes, or contours if the format does not distinguish them from other curves. Layer and hole
    selections in `options` are ignored.

    Raises
    ------
    ReadError
        The file cannot be read, or is empty.
    """
    from leafcut.read.reference import read_whole_drawing

    return read_whole_drawing(*read_source(source, on_progress), options or ReadOptions())


def _read(reader: Format, format_: Format, loaded: Source, options: ReadOptions) -> Part:
    named = isinstance(options.origin, str)
    if named and loaded.cache is None:
        loaded = replace(loaded, cache={})  # the drawing is read twice, but parsed once
    part = _refuse_if_strict(run_reader(reader, loaded, options), loaded, options)
    if named and part.reference is None:
        from leafcut.read.reference import reference_geometry

        part = replace(part, reference=reference_geometry(format_, loaded, options))
    return part


def _refuse_if_strict(part: Part, loaded: Source, options: ReadOptions) -> Part:
    warnings = [issue for issue in part.issues if issue.severity in (Severity.WARNING, Severity.MISSING)]
    if options.strict and warnings:
        more = Message(", and {} more", len(warnings) - 1) if len(warnings) > 1 else ""
        raise ReadError(loaded.path, Message("refused by --strict: {}{}", warnings[0], more))
    return part
