"""What a reader is: a named format, the file it is given, and small things that all readers share."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

from leafcut.errors import ReadError, parsing, shown
from leafcut.files.whole_files import decoded
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.units import MM_PER_UNIT

#: Files larger than this are refused: no drawing of holes is, and reading one could exhaust the memory.
MAX_BYTES = 512 * 1024 * 1024
#: More holes than this are refused, whatever the file.
MAX_HOLES = 1_000_000
#: No machine that leafcut writes for is a kilometre wide; beyond this a number is a mistake, mm.
MAX_COORDINATE = 1e6
#: What is wrong with such an entity, and what to do.
OUT_OF_RANGE = "lying or extending more than 1 km from the drawing zero: move it to the zero, or give --units"
#: A drawing that is smaller than this on its longer side is in another unit, mm; `--units` says that it is not.
SMALLEST_DRAWING = 2.0
#: More lines and arcs than this are refused, whatever the file.
MAX_SEGMENTS = 1_000_000
#: Splines and ellipses become arcs and lines that leave them by at most this, mm.
CURVE_TOLERANCE = 0.01
#: How much of a file `Format.sniff` sees, bytes.
SNIFF_BYTES = 64 * 1024


#: What the blocks of a drawing of any size may expand to (holes are quicker to read), and so many more for each byte.
FREE_COPIES, FREE_HOLES, COPIES_PER_BYTE = 100_000, 400_000, 1
#: The same for the points along its curves.
FREE_POINTS, POINTS_PER_BYTE = 500_000, 4


class Match(IntEnum):
    """How sure a format is, from the first bytes, that a file is its own."""

    NO = 0
    MAYBE = 1
    YES = 2


@dataclass(frozen=True)
class Source:
    """What a reader is given: the path as the user wrote it, and the bytes of the file.

    Readers call `look` as they go on: who waits may end them. Where there is a `kept`, they leave there what takes long
    to make of the bytes, for the next reader of the same source.
    """

    path: str
    data: bytes = b""
    look: Heartbeat = field(default=unseen, compare=False)
    kept: dict[str, Any] | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        return self.path

    @property
    def file_name(self) -> str:
        """The file's name without its folders, so that no program's header tells where it was made."""
        return Path(self.path).name

    @property
    def name(self) -> str:
        """The file's name without folders and extension, for people."""
        return Path(self.path).stem

    def text(self) -> str:
        """Return the file as text: UTF-8, UTF-16 by its mark, else Latin-1.

        Raises
        ------
        ReadError
            The file is not text.
        """
        if self.data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            return self.data.decode("utf-16", errors="replace")
        if b"\0" in self.data:
            raise ReadError(self.path, "this is a binary file; a text file was expected")
        return decoded(self.data)[0]


@contextmanager
def parsing_xml(path: str, advice: str) -> Iterator[None]:
    """Turn what the parsers of XML raise into a `ReadError` with its line.

    `advice` is what to do where the file declares entities, which nothing that leafcut reads needs.
    """
    from xml.etree.ElementTree import ParseError
    from xml.sax import SAXParseException

    from defusedxml import DefusedXmlException

    line: int | None = None
    with parsing(path, "the XML could not be read"):
        try:
            yield
            return
        except DefusedXmlException as problem:
            external = type(problem).__name__ == "ExternalReferenceForbidden"
            reason = f"refused: the file has an {'external reference' if external else 'entity declaration'}, {advice}"
        except SAXParseException as problem:
            reason, line = f"not well-formed XML: {shown(str(problem.getMessage()), 80)}", problem.getLineNumber()
        except ParseError as problem:
            reason, line = f"not well-formed XML: {shown(str(problem), 80)}", problem.position[0]
        except (LookupError, ValueError) as problem:
            # An encoding that there is not: only the declaration, in the first line, names one.
            reason, line = f"not well-formed XML: {shown(str(problem), 80)}", 1
        raise ReadError(path, reason, line)


class ReadBudget:
    """What reading a file may come to, by the file's size: a few lines can ask for the work of a night."""

    def __init__(self, path: str, most: int, reason: str) -> None:
        self.path, self.left, self.reason = path, most, reason

    def __call__(self, amount: int) -> None:
        """Spend an amount; raise `ReadError` where that is more than there is."""
        self.check(amount)
        self.left -= amount

    def check(self, amount: int) -> None:
        """Raise `ReadError` where an amount is more than there is."""
        if amount > self.left:
            raise ReadError(self.path, self.reason)


def copies_of(source: Source, what: str, free: int = FREE_COPIES) -> ReadBudget:
    """Return the budget for what the blocks or uses of a drawing expand to."""
    most = free + COPIES_PER_BYTE * len(source.data)
    reason = f"the {what} of this drawing, which has {size_of(source)}, expand to more than {most:,} elements"
    return ReadBudget(source.path, most, f"{reason}; explode less of it")


def points_of(source: Source) -> ReadBudget:
    """Return the budget for the points along the curves of a drawing."""
    most = FREE_POINTS + POINTS_PER_BYTE * len(source.data)
    reason = f"the curves of this drawing, which has {size_of(source)}, need more than {most:,} points"
    return ReadBudget(source.path, most, f"{reason}; check its units")


def size_of(source: Source) -> str:
    """Return the size of a file in words."""
    return f"{max(len(source.data) // 1000, 1):,} kB"


def _no_match(_: bytes) -> Match:
    return Match.NO


@dataclass(frozen=True)
class Format:
    """One kind of file and the function that reads it.

    Attributes
    ----------
    name
        One word, kept as `Part.format`.
    extensions
        Lower case, with the dot.
    help
        One line for `leafcut list formats`.
    read
        ``(Source, ReadOptions) -> Part``; raises `ReadError`.
    sniff
        Says from the first bytes of a file whether it is of this format.
    prefix
        Inputs that begin with it are no files; they are given to this format by name (``example:plate-70``).
    error
        Why a plug-in could not be loaded; empty for a format that works.
    contours
        ``(Source, ReadOptions) -> Part`` for what is to be cut: the part's contours, as they are drawn. None for a
        format that has none.
    pockets
        ``(Source, ReadOptions, PocketDrawingOptions, SheetOptions) -> Part`` for what is to be
        cleared: the part's pockets. None for a format that has none.
    whole
        ``(Source, ReadOptions) -> Part``: all that a drawing shows, whatever of it is worked: contours, and circles and
        points as holes. None where `contours`, or else `read`, gives that.
    processes
        What a file of this kind is read for, the usual first: ``drill``, ``cut``, ``pocket``.
    """

    name: str
    extensions: tuple[str, ...]
    help: str
    read: Callable[[Source, ReadOptions], Part]
    sniff: Callable[[bytes], Match] = _no_match
    prefix: tuple[str, ...] = ()
    error: str = ""
    contours: Callable[[Source, ReadOptions], Part] | None = None
    pockets: Callable[[Source, ReadOptions, PocketDrawingOptions, SheetOptions], Part] | None = None
    whole: Callable[[Source, ReadOptions], Part] | None = None
    processes: tuple[str, ...] = ("drill",)


def load(path: str | Path) -> Source:
    """Return the bytes of a regular file.

    Raises
    ------
    ReadError
        The file is missing, is a folder or a device, cannot be read, is empty, or is larger than `MAX_BYTES`.
    """
    try:
        found = os.stat(path)  # noqa: PTH116  # a name with a NUL must end in the same except clause
        if stat.S_ISDIR(found.st_mode):
            raise ReadError(path, "this is a folder; name a file in it")
        if not stat.S_ISREG(found.st_mode):
            raise ReadError(path, "this is not a regular file; save it to a file first")
        if found.st_size > MAX_BYTES:
            raise ReadError(path, f"the file has {found.st_size >> 20} MiB; the limit is {MAX_BYTES >> 20} MiB")
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise ReadError(path, "file not found") from None
    except OSError as problem:
        raise ReadError(path, f"cannot be read ({problem.strerror or problem})") from None
    except ValueError:
        raise ReadError(shown(str(path)), "not a valid file name") from None
    if not data.strip():
        raise ReadError(path, "the file is empty")
    return Source(str(path), data)


def load_json(path: str | Path) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    ReadError
        The file cannot be read (`load`), or is not JSON.
    """
    try:
        return parse_json(load(path).text())
    except (ValueError, RecursionError) as problem:
        raise ReadError(path, f"is not JSON ({shown(str(problem), 100)})") from None


def parse_json(text: str) -> Any:
    """Return what a JSON text holds.

    Raises
    ------
    ValueError, RecursionError
        It is not JSON, or a text in it has half of a letter (``\\ud800``), which nothing can be written with.
    """
    found = json.loads(text)
    if "\\ud" in text.lower() and has_half_letter(found):
        raise ValueError("a text with half of a letter, \\ud800 to \\udfff")
    return found


def has_half_letter(value: Any) -> bool:
    """Return whether a text somewhere in what JSON can say has half of a letter, which nothing can be written with."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return True
    return False


def places_of(points: list[tuple[float, float]], number: int) -> str:
    """Return the first places of `number` things, as the place of an `Issue`."""
    first = ", ".join(f"({x:g}, {y:g})" for x, y in points[:3])
    return f"at {first}" + (" …" if number > 3 else "")


def factor_of(options: ReadOptions, own_units: str | None) -> float:
    """Return mm per unit: the user's word, else the file's own, else mm."""
    return MM_PER_UNIT[options.units or own_units or "mm"]


def to_mm(value: float, factor: float) -> float:
    """Return a length in mm, without the digits that only a conversion makes: the same part in inch is the same."""
    return value if factor == 1.0 else round(value * factor, 6)


def units_unknown(what: str, part: Part, severity: Severity) -> Issue:
    """Return the issue L102, with the size that the part has in mm, so that a wrong guess is seen."""
    left, low, right, high = part.extents
    widths = [w for w in part.diameters if w > 0]
    holes = f"holes of Ø {min(widths):g} to {max(widths):g} mm" if widths else "the points"
    holes = "the contours" if part.contours else "the pockets" if part.pockets else holes
    return Issue(
        "L102",
        f"{what} does not state its units; in mm, {holes} span {right - left:g} × {high - low:g} mm; "
        "set --units if that is wrong",
        severity=severity,
    )


def refuse_tiny(path: str, part: Part, options: ReadOptions) -> None:
    """Refuse a drawing so small that its unit must be another, unless the user gives the unit, or chooses layers.

    Raises
    ------
    ReadError
        It is: states its size.
    """
    if options.units or options.layers:
        return
    left, low, right, high = part.extents
    wide = float(part.diameters.max(initial=0.0))
    width, height = right - left + wide, high - low + wide
    if max(width, height) < SMALLEST_DRAWING:
        raise ReadError(
            path,
            f"the whole drawing is {width:.3g} × {height:.3g} mm: its unit is probably wrong; give it with --units "
            "(mm if the part is so small)",
        )


def too_many_holes(path: str) -> ReadError:
    """Return the error about more holes than leafcut takes."""
    return ReadError(path, f"more than {MAX_HOLES:,} holes; select some with --layers or split the file")


def too_many_segments(path: str) -> ReadError:
    """Return the error about more lines and arcs than leafcut takes."""
    return ReadError(path, f"more than {MAX_SEGMENTS:,} lines and arcs; select some with --layers or split the file")
