"""The formats there are, and which of them reads a file: by prefix, by content, by extension."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from leafcut.errors import ReadError, parsing, shown
from leafcut.files import StandardInput
from leafcut.model import Part
from leafcut.model.heartbeat import Look, unseen
from leafcut.options import ReadOptions
from leafcut.read import csvmap, dxf, examples, excellon, gcode, gtsp, picture, sirius, svg, tsplib, wkt, xmlmap
from leafcut.read.format import SNIFF_BYTES, Format, Match, Source, load

#: What can be read: a file, the name of an example, what came through standard input, or what was read already.
Input = str | Path | StandardInput | Source

#: Packages of other people add a format by an entry point of this group that names a `Format`.
PLUGIN_GROUP = "leafcut.readers"

BUILT_IN = (
    dxf.FORMAT,
    svg.FORMAT,
    sirius.FORMAT,
    wkt.FORMAT,
    picture.FORMAT,
    excellon.FORMAT,
    xmlmap.FORMAT,
    csvmap.FORMAT,
    tsplib.FORMAT,
    gtsp.FORMAT,
    gcode.FORMAT,
    examples.FORMAT,
)


def formats() -> tuple[Format, ...]:
    """Return every format, those of plug-ins last; a plug-in that does not load is there with its `error`."""
    return BUILT_IN + tuple(_plugin(entry) for entry in entry_points(group=PLUGIN_GROUP))


def _plugin(entry: EntryPoint) -> Format:
    try:
        found = entry.load()
        if not isinstance(found, Format):
            raise TypeError(f"{entry.value} is no leafcut.read.Format")
    except (Exception, SystemExit) as problem:  # whatever a stranger's module does must stop nothing else
        return _broken(entry.name, problem)
    return found


def _broken(name: str, problem: BaseException) -> Format:
    message = f"{type(problem).__name__}: {shown(str(problem), 120)}"

    def refuse(source: Source, options: ReadOptions) -> Part:
        raise ReadError(source.path, f"the plug-in '{name}' is broken ({message})")

    return Format(name, (), f"plug-in that does not load ({message})", refuse, error=message)


def read_source(source: Input, look: Look = unseen) -> tuple[Format, Source]:
    """Return the format that takes an input, and the input's bytes; who waits looks at its reader by `look`.

    What was read already (a `Source`) is not read again.

    Raises
    ------
    ReadError
        There is no such file, it cannot be read, or no format knows it.
    """
    known = formats()
    for format_ in known:
        if format_.prefix and str(source).startswith(format_.prefix):
            return format_, Source(str(source), look=look)
    if isinstance(source, StandardInput):
        source = Source(str(source), source.data)
    loaded = replace(source if isinstance(source, Source) else load(source), look=look)
    return choose(known, loaded), loaded


def format_name(path: str | Path) -> str:
    """Return the name of the format of a file, from its first bytes; empty where it cannot be read or is unknown."""
    try:
        with Path(path).open("rb") as stream:
            return choose(formats(), Source(str(path), stream.read(SNIFF_BYTES))).name
    except (OSError, ValueError, ReadError):
        return ""


def choose(known: tuple[Format, ...], source: Source) -> Format:
    """Return the format of a file: one that is sure of the content, else that of the extension, else a likely one."""
    extension = Path(source.path).suffix.lower()
    head = source.data[:SNIFF_BYTES]
    matches = [(_sniff(format_, head), format_) for format_ in known]
    own = [(match, format_) for match, format_ in matches if extension in format_.extensions]
    for wanted, among in ((Match.YES, own), (Match.YES, matches), (Match.MAYBE, own), (Match.NO, own)):
        for match, format_ in among:
            if match == wanted:
                return format_
    for match, format_ in matches:
        if match == Match.MAYBE:
            return format_
    there_are = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in known if f.extensions)
    raise ReadError(source.path, f"unknown kind of file; leafcut reads {there_are}")


def _sniff(format_: Format, head: bytes) -> Match:
    try:
        return Match(format_.sniff(head))
    except Exception:  # a plug-in's sniff must not stop the others
        return Match.NO


def run(format_: Format, source: Source, options: ReadOptions) -> Part:
    """Return the part that a format reads, whatever its parser does.

    Raises
    ------
    ReadError
        The file cannot be read; also for everything that a parser from elsewhere raises.
    """
    with parsing(source.path, f"could not be read as {format_.name}"):
        return format_.read(source, options)
