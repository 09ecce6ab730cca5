"""Read drawings and other input files.

Each format has its own module, whose reader converts a file to a `Part`. The `registry` module chooses the reader for a
file.
"""

from __future__ import annotations

from dataclasses import replace

from leafcut.errors import ReadError
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.format import Format, Match, Source
from leafcut.read.registry import Input, formats, read_source_with_format, run_reader

__all__ = ["Format", "Input", "Match", "Source", "formats", "read", "read_contours", "read_pockets", "read_whole"]


def read(source: Input, options: ReadOptions | None = None, on_progress: Heartbeat = ignore_heartbeat) -> Part:
    """Read a part from a file, or create it from a name such as ``example:plate-70`` or ``random:200:7``.

    All lengths in the part are in mm.

    Raises
    ------
    ReadError
        The file cannot be read or contains no holes. With `options.strict`, the function also raises this error if the
        reader skipped or repaired anything.
    """
    options = options or ReadOptions()
    format_, loaded = read_source_with_format(source, on_progress)
    return _read_with_reference(format_, format_, loaded, options)


def read_contours(source: Input, options: ReadOptions | None = None, on_progress: Heartbeat = ignore_heartbeat) -> Part:
    """Read the lines and curves of a drawing as contours, in mm.

    The contours are not modified. Call `processes.contours.prepare_sheet` to join and clean them.

    Raises
    ------
    ReadError
        The file cannot be read or contains no contours. With `options.strict`, the function also raises this error if
        the reader skipped or repaired anything.
    """
    options = options or ReadOptions()
    format_, loaded = read_source_with_format(source, on_progress)
    if format_.contours is None:
        known_formats = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in formats() if f.contours)
        raise ReadError(loaded.path, Message("{} has no contours to cut; use {}", format_.name, known_formats))
    return _read_with_reference(replace(format_, read=format_.contours), format_, loaded, options)


def read_pockets(
    source: Input,
    options: ReadOptions | None = None,
    pocket_options: PocketDrawingOptions | None = None,
    joining: SheetOptions | None = None,
    on_progress: Heartbeat = ignore_heartbeat,
) -> Part:
    """Read the pockets of a drawing or a picture, in mm.

    The function joins the walls and islands, cleans them, and checks them. It only uses `join_tolerance` and
    `open_paths` from `joining`.

    Raises
    ------
    ReadError
        The file cannot be read, contains no pockets, or has a format that does not support pockets. The error is also
        raised if an outline is open, crosses itself, or touches another outline. With `options.strict`, it is also
        raised if the reader skipped or repaired anything.
    OptionError
        The file is a picture and `pixel_size` is missing.
    """
    options = options or ReadOptions()
    format_, loaded = read_source_with_format(source, on_progress)
    if format_.pockets is None:
        known_formats = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in formats() if f.pockets)
        raise ReadError(loaded.path, Message("{} has no pockets; use {}", format_.name, known_formats))
    clear, drawing_options, join = format_.pockets, pocket_options or PocketDrawingOptions(), joining or SheetOptions()
    reader = replace(format_, read=lambda file, reading: clear(file, reading, drawing_options, join))
    return _read_with_reference(reader, format_, loaded, options)


def read_whole(source: Input, options: ReadOptions | None = None, on_progress: Heartbeat = ignore_heartbeat) -> Part:
    """Read everything in a drawing, in mm, for display.

    Circles become holes, or contours if the format does not distinguish circles from other curves. The function ignores
    the layer and hole selections in `options`.

    Raises
    ------
    ReadError
        The file cannot be read, or is empty.
    """
    from leafcut.read.reference import read_whole_drawing

    return read_whole_drawing(*read_source_with_format(source, on_progress), options or ReadOptions())


def _read_with_reference(reader: Format, format_: Format, loaded: Source, options: ReadOptions) -> Part:
    named = isinstance(options.origin, str)
    if named and loaded.cache is None:
        loaded = replace(loaded, cache={})  # the drawing is read twice, but parsed once
    part = _refuse_if_strict(run_reader(reader, loaded, options), loaded, options)
    if named and part.reference is None:
        from leafcut.read.reference import read_reference_geometry

        part = replace(part, reference=read_reference_geometry(format_, loaded, options))
    return part


def _refuse_if_strict(part: Part, loaded: Source, options: ReadOptions) -> Part:
    warnings = [issue for issue in part.issues if issue.severity in (Severity.WARNING, Severity.MISSING)]
    if options.strict and warnings:
        more = Message(", and {} more", len(warnings) - 1) if len(warnings) > 1 else ""
        raise ReadError(loaded.path, Message("refused by --strict: {}{}", warnings[0], more))
    return part
