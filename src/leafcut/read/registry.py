"""The formats there are, and which of them reads a file: by prefix, by content, by extension."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, ReadError, parsing
from leafcut.files.plugins import Plugin, PluginKind
from leafcut.files.whole_files import StandardInput
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.part import Part
from leafcut.options import ReadOptions, flag_name
from leafcut.read import csvmap, dxf, examples, excellon, gcode, gtsp, picture, sirius, step, svg, tsplib, wkt, xmlmap
from leafcut.read.format import SNIFF_BYTES, Format, Match, Source, load

#: What can be read: a file, the name of an example, what came through standard input, or what was read already.
Input = str | Path | StandardInput | Source

BUILT_IN = (
    dxf.FORMAT,
    svg.FORMAT,
    step.FORMAT,
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


def _own_names() -> set[str]:
    return {format_.name for format_ in BUILT_IN}


def _format_of(name: str, found: Any) -> Format:
    """Return the format that an entry point names; `name` is the entry point's own."""
    if not isinstance(found, Format):
        raise TypeError(f"a leafcut.read.Format was expected, not {type(found).__name__}")
    texts = (found.name, found.help, *found.extensions, *found.prefix, *found.processes)
    if not all(isinstance(text, str) and text.isprintable() and text for text in texts):
        raise ValueError("a format's name, help, extensions, prefixes and processes are texts of one line")
    if found.name in _own_names():
        raise ValueError(f"leafcut already has a format '{found.name}'")
    return found


#: Packages of other people add a format by an entry point that names a `Format`.
READERS = PluginKind("reader", "leafcut.readers", _own_names, _format_of, lambda format_: format_.help)


def formats() -> tuple[Format, ...]:
    """Return every format, those of plug-ins last; a plug-in that cannot be used is there with its `error`."""
    return (*BUILT_IN, *(plugin.adds or _unusable(plugin) for plugin in READERS.plugins()))


def _unusable(plugin: Plugin[Format]) -> Format:
    def refuse(source: Source, options: ReadOptions) -> Part:
        raise ReadError(source.path, f"the reader '{plugin.name}' is a {plugin.told}")

    return Format(plugin.name, (), plugin.told, refuse, error=plugin.error)


def read_source(source: Input, look: Heartbeat = unseen) -> tuple[Format, Source]:
    """Return the format that takes an input, and the input's bytes; who waits looks at its reader by `look`.

    What was read already (a `Source`) is not read again, and keeps its own `look` where none is given.

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
    loaded = source if isinstance(source, Source) else load(source)
    if look is not unseen:
        loaded = replace(loaded, look=look)
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
    own = [(_sniff(format_, head), format_) for format_ in known if extension in format_.extensions]
    for match, format_ in own:
        if match == Match.YES:  # the others, some of which look long, need not be asked
            return format_
    others = [(_sniff(format_, head), format_) for format_ in known if extension not in format_.extensions]
    for wanted, among in ((Match.YES, others), (Match.MAYBE, own), (Match.NO, own), (Match.MAYBE, others)):
        for match, format_ in among:
            if match == wanted:
                return format_
    there_are = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in known if f.extensions)
    raise ReadError(source.path, f"unknown file format; leafcut reads {there_are}")


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
    OptionError
        A solid is chosen, turned or lifted, and the format has none.
    """
    if format_.name != step.FORMAT.name:
        for name in ("solid", "up", "z_zero"):
            if getattr(options, name) is not None:
                raise OptionError(f"{flag_name(name)}: {format_.name} has no solids, a STEP file has; leave it out")
    with parsing(source.path, f"could not be read as {format_.name}"):
        return format_.read(source, options)
