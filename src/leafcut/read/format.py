"""The `Format` type, the input of a reader (`Source`), and functions that all readers share."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

from leafcut.errors import ReadError, parser_errors, printable
from leafcut.files.whole_files import decode_text
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.units import MM_PER_UNIT

#: Maximum size of a file, bytes. Drawings of holes are smaller, and a larger file could exhaust the memory.
MAX_BYTES = 512 * 1024 * 1024
#: Maximum number of holes of a part.
MAX_HOLES = 1_000_000
#: Maximum coordinate, mm. No machine is larger than 1 km, so a larger number is a mistake.
MAX_COORDINATE = 1e6
#: Message and remedy for an entity beyond `MAX_COORDINATE`.
OUT_OF_RANGE = Message("more than 1 km from the drawing origin: move the drawing, or check --units")
#: If the longer side of a drawing is shorter than this, mm, the drawing has the wrong unit. `--units` disables the
#: check.
SMALLEST_DRAWING = 2.0
#: Maximum number of lines and arcs of a part.
MAX_SEGMENTS = 1_000_000
#: Tolerance of the arcs and lines that approximate splines and ellipses, mm.
CURVE_TOLERANCE = 0.01
#: Number of bytes that `Format.sniff` receives.
SNIFF_BYTES = 64 * 1024


#: Number of elements that the blocks of a drawing may expand to: base value, base value for holes (which are faster to
#: read), and increase per byte of the file.
FREE_COPIES, FREE_HOLES, COPIES_PER_BYTE = 100_000, 400_000, 1
#: Number of points along the curves of a drawing: base value, and increase per byte of the file.
FREE_POINTS, POINTS_PER_BYTE = 500_000, 4


class Match(IntEnum):
    """How well the first bytes of a file match a format."""

    NO = 0
    MAYBE = 1
    YES = 2


@dataclass(frozen=True)
class Source:
    """The input of a reader: the path as the user typed it, and the bytes of the file.

    Readers report their progress to `on_progress`, which may cancel them. A reader stores expensive results in `cache`,
    so that the next reader can reuse them.
    """

    path: str
    data: bytes = b""
    on_progress: Heartbeat = field(default=ignore_heartbeat, compare=False)
    cache: dict[str, Any] | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        return self.path

    @property
    def file_name(self) -> str:
        """The file name without its folder, so that the header of a program does not reveal the folder."""
        return Path(self.path).name

    @property
    def name(self) -> str:
        """The file name without folder and extension, for display."""
        return Path(self.path).stem

    def text(self) -> str:
        """Decode the file as UTF-8, as UTF-16 if it has a byte order mark, or else as Latin-1.

        Raises
        ------
        ReadError
            The file is not text.
        """
        if self.data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            return self.data.decode("utf-16", errors="replace")
        if b"\0" in self.data:
            raise ReadError(self.path, "this is a binary file; a text file was expected")
        return decode_text(self.data)[0]


@contextmanager
def convert_xml_errors(path: str, advice: str) -> Iterator[None]:
    """Convert exceptions of XML parsers to a `ReadError` with the line number.

    If a file declares entities, the message contains `advice`. No supported format needs entities.
    """
    from xml.etree.ElementTree import ParseError
    from xml.sax import SAXParseException

    from defusedxml import DefusedXmlException

    line: int | None = None
    with parser_errors(path, Message("the XML could not be read")):
        try:
            yield
            return
        except DefusedXmlException as problem:
            external = type(problem).__name__ == "ExternalReferenceForbidden"
            reason = Message(
                "refused: the file has an {}, {}",
                Message("external reference") if external else Message("entity declaration"),
                advice,
            )
        except SAXParseException as problem:
            reason, line = (
                Message("this is not well-formed XML: {}", printable(str(problem.getMessage()), 80)),
                problem.getLineNumber(),
            )
        except ParseError as problem:
            reason, line = Message("this is not well-formed XML: {}", printable(str(problem), 80)), problem.position[0]
        except (LookupError, ValueError) as problem:
            # The encoding is unknown. Only the declaration, in the first line, names an encoding.
            reason, line = Message("this is not well-formed XML: {}", printable(str(problem), 80)), 1
        raise ReadError(path, reason, line)


class ReadBudget:
    """Limits the work on a file, because a few lines can require hours of work."""

    def __init__(self, path: str, limit: int, reason: str) -> None:
        self.path, self.left, self.reason = path, limit, reason

    def __call__(self, amount: int) -> None:
        """Subtract an amount of work from the budget, and raise `ReadError` if the budget is exceeded."""
        self.check(amount)
        self.left -= amount

    def check(self, amount: int) -> None:
        """Raise `ReadError` if an amount of work exceeds the remaining budget."""
        if amount > self.left:
            raise ReadError(self.path, self.reason)


def expansion_budget(source: Source, noun: str, free: int = FREE_COPIES) -> ReadBudget:
    """Return the budget for the elements that the blocks or uses of a drawing expand to."""
    limit = free + COPIES_PER_BYTE * len(source.data)
    reason = Message(
        "the {} of this drawing, which has {}, expand to more than {:,} elements", noun, file_size_text(source), limit
    )
    return ReadBudget(source.path, limit, Message("{}; explode fewer blocks", reason))


def point_budget(source: Source) -> ReadBudget:
    """Return the budget for the points along the curves of a drawing."""
    limit = FREE_POINTS + POINTS_PER_BYTE * len(source.data)
    reason = Message(
        "the curves of this drawing, which has {}, need more than {:,} points", file_size_text(source), limit
    )
    return ReadBudget(source.path, limit, Message("{}; check its units", reason))


def file_size_text(source: Source) -> str:
    """Format the size of a file in kB."""
    return f"{max(len(source.data) // 1000, 1):,} kB"


def _never_match(_: bytes) -> Match:
    return Match.NO


@dataclass(frozen=True)
class Format:
    """A file format, and the functions that read it.

    Attributes
    ----------
    extensions
        File name extensions in lower case, with the dot.
    read
        ``(Source, ReadOptions) -> Part``; raises `ReadError`.
    prefix
        An input with one of these prefixes is a name for this format, not a file (``example:plate-70``).
    error
        The reason why a plug-in could not be loaded; empty for a working format.
    contours
        ``(Source, ReadOptions) -> Part``: returns the contours to cut, without changes. None for a format without
        contours.
    pockets
        ``(Source, ReadOptions, PocketDrawingOptions, SheetOptions) -> Part``: returns the pockets to clear. None for a
        format without pockets.
    whole
        ``(Source, ReadOptions) -> Part``: returns the complete drawing for display: contours, and circles and points as
        holes. None if `contours` already does this, or `read` for a format without `contours`.
    processes
        The processes that use such files, starting with the most common: ``drill``, ``cut``, ``pocket``.
    """

    name: str
    extensions: tuple[str, ...]
    help: str
    read: Callable[[Source, ReadOptions], Part]
    sniff: Callable[[bytes], Match] = _never_match
    prefix: tuple[str, ...] = ()
    error: str = ""
    contours: Callable[[Source, ReadOptions], Part] | None = None
    pockets: Callable[[Source, ReadOptions, PocketDrawingOptions, SheetOptions], Part] | None = None
    whole: Callable[[Source, ReadOptions], Part] | None = None
    processes: tuple[str, ...] = ("drill",)


def load_source(path: str | Path) -> Source:
    """Read a regular file as the input of a reader.

    Raises
    ------
    ReadError
        The file is missing, is a folder or a device, cannot be read, is empty, or is larger than `MAX_BYTES`.
    """
    try:
        status = os.stat(path)  # noqa: PTH116  # a name with a NUL must end in the same except clause
        if stat.S_ISDIR(status.st_mode):
            raise ReadError(path, "this is a folder; name a file in it")
        if not stat.S_ISREG(status.st_mode):
            raise ReadError(path, "this is not a regular file; save it to a file first")
        if status.st_size > MAX_BYTES:
            raise ReadError(
                path, Message("the file has {} MiB; the limit is {} MiB", status.st_size >> 20, MAX_BYTES >> 20)
            )
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise ReadError(path, "file not found") from None
    except OSError as problem:
        raise ReadError(path, Message("cannot be read ({})", problem.strerror or problem)) from None
    except ValueError:
        raise ReadError(printable(str(path)), "not a valid file name") from None
    if not data.strip():
        raise ReadError(path, "the file is empty")
    return Source(str(path), data)


def load_json(path: str | Path) -> Any:
    """Read a JSON file.

    Raises
    ------
    ReadError
        The file cannot be read (`load_source`), or is not JSON.
    """
    try:
        return parse_json(load_source(path).text())
    except (ValueError, RecursionError) as problem:
        raise ReadError(path, Message("is not valid JSON ({})", printable(str(problem), 100))) from None


def parse_json(text: str) -> Any:
    """Parse a JSON text.

    Raises
    ------
    ValueError, RecursionError
        The text is not JSON, or contains a lone surrogate (``\\ud800``), which cannot be encoded.
    """
    value = json.loads(text)
    if "\\ud" in text.lower() and has_lone_surrogate(value):
        raise ValueError(Message("a text with an unpaired surrogate, \\ud800 to \\udfff"))
    return value


def has_lone_surrogate(value: Any) -> bool:
    """Return whether a string in a JSON value contains a lone surrogate, which cannot be encoded."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return True
    return False


def first_positions_text(points: Sequence[tuple[float, float]]) -> Message:
    """Format the first of several positions for `Issue.place`."""
    first = ", ".join(f"({x:g}, {y:g})" for x, y in points[:3])
    return Message("at {}", first) + (" …" if len(points) > 3 else "")


def skipped_entities_issue(handles: Sequence[str], message: Message) -> Issue:
    """Report the entities of a drawing that a reader skipped, by their handles."""
    location = Message("handle {}", ", ".join(h or "?" for h in handles[:3])) + (" …" if len(handles) > 3 else "")
    return Issue("L203", message, location, missing=MissingWork("element", len(handles)))


def drawing_unit_mm(options: ReadOptions, own_units: str | None) -> float:
    """Return the length of the drawing unit, mm.

    The user's unit overrides the unit of the file. If neither is known, the unit is 1 mm.
    """
    return MM_PER_UNIT[options.units or own_units or "mm"]


def to_mm(value: float, factor: float) -> float:
    """Convert a length to mm, and round off the digits that the conversion adds."""
    return value if factor == 1.0 else round(value * factor, 6)


def unknown_units_issue(noun: str, part: Part, severity: Severity) -> Issue:
    """Create the issue L102, which states the size of the part in mm, so that the user notices a wrong unit."""
    left, low, right, high = part.extents
    widths = [w for w in part.diameters if w > 0]
    holes = Message("holes of Ø {:g} to {:g} mm", min(widths), max(widths)) if widths else Message("the points")
    holes = Message("the contours") if part.contours else Message("the pockets") if part.pockets else holes
    return Issue(
        "L102",
        Message(
            "{} does not state its units; in mm, {} span {:g} × {:g} mm; set --units if that is wrong",
            noun,
            holes,
            right - left,
            high - low,
        ),
        severity=severity,
    )


def refuse_tiny_drawing(path: str, part: Part, options: ReadOptions) -> None:
    """Raise `ReadError` if a drawing is so small that its unit is probably wrong.

    The function does not check the size if the user states the unit or selects layers.
    """
    if options.units or options.layers:
        return
    left, low, right, high = part.extents
    widest = float(part.diameters.max(initial=0.0))
    width, height = right - left + widest, high - low + widest
    if max(width, height) < SMALLEST_DRAWING:
        raise ReadError(
            path,
            Message(
                "the whole drawing is {:.3g} × {:.3g} mm, so its unit is probably wrong; set it with --units "
                "(mm if the part really is that small)",
                width,
                height,
            ),
        )


def too_many_holes_error(path: str) -> ReadError:
    """Create the error for a file with more holes than `MAX_HOLES`."""
    return ReadError(path, Message("more than {:,} holes; select some with --layers or split the file", MAX_HOLES))


def too_many_segments_error(path: str) -> ReadError:
    """Create the error for a file with more lines and arcs than `MAX_SEGMENTS`."""
    return ReadError(
        path, Message("more than {:,} lines and arcs; select some with --layers or split the file", MAX_SEGMENTS)
    )
