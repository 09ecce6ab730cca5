"""List the known formats, and choose the format of a file by prefix, content or extension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, ReadError, parser_errors
from leafcut.files.plugins import Plugin, PluginKind, lazy_function
from leafcut.files.whole_files import StandardInput
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.part import Part
from leafcut.options import ReadOptions, flag_name
from leafcut.read import recognition
from leafcut.read.format import SNIFF_BYTES, Format, Match, Source, load_source

#: Input of a reader: a file, the name of an example, standard input, or a source that is already loaded.
Input = str | Path | StandardInput | Source


def _lazy_reader(place: str) -> Callable[..., Part]:
    return lazy_function(f"leafcut.read.{place}")


def _refusing_reader(text: Message) -> Callable[..., Part]:
    """Return a reader that always raises `ReadError`, for a format without holes."""

    def refuse(source: Source, options: ReadOptions) -> Part:
        raise ReadError(source.path, text)

    return refuse


BUILT_IN = (
    Format(
        "dxf",
        (".dxf",),
        "drawing (AutoCAD DXF, text or binary): circles are holes, lines and curves are contours or pockets",
        _lazy_reader("dxf:read_dxf"),
        recognition.sniff_dxf,
        contours=_lazy_reader("dxf_contours:read_dxf_contours"),
        pockets=_lazy_reader("dxf_contours:read_dxf_pockets"),
        whole=_lazy_reader("dxf_whole:read_dxf_whole"),
        processes=("drill", "cut", "pocket", "part"),
    ),
    Format(
        "svg",
        (".svg",),
        "drawing (Inkscape, Illustrator, laser programs): paths and shapes are contours or pockets, not holes",
        _refusing_reader(
            Message(
                "an SVG drawing is read for cutting from sheet and for pockets only; for drilling use DXF or Excellon"
            )
        ),
        recognition.sniff_svg,
        contours=_lazy_reader("svg:read_svg_contours"),
        pockets=_lazy_reader("svg:read_svg_pockets"),
        processes=("cut", "pocket", "part"),
    ),
    Format(
        "step",
        (".step", ".stp"),
        "solids of CAD (extra step): holes and pockets with their depths, outlines of flat sheets",
        _lazy_reader("step:read_step"),
        recognition.sniff_step,
        contours=_lazy_reader("step:read_outlines_of_step"),
        pockets=_lazy_reader("step:read_pockets_of_step"),
        whole=_lazy_reader("step:read_step"),
        processes=("drill", "pocket", "cut", "part"),
    ),
    Format(
        "sirius",
        (".dbs.json",),
        "nested sheet of the Sirius CAM (JSON): parts and the sheet, for cutting only",
        _refusing_reader(Message("a sheet of a CAM system is read for cutting only; for drilling use DXF or Excellon")),
        recognition.sniff_sirius,
        contours=_lazy_reader("sirius:read_sirius_contours"),
        processes=("cut",),
    ),
    Format(
        "wkt",
        (".wkt",),
        "well-known text: polygons with holes are pockets with islands, for pockets only",
        _refusing_reader(Message("well-known text (WKT) is read for pockets only; use --process pocket")),
        recognition.sniff_wkt,
        pockets=_lazy_reader("wkt:read_wkt_pockets"),
        processes=("pocket",),
    ),
    Format(
        "picture",
        (".png", ".jpg", ".jpeg", ".bmp"),
        "picture: dark areas are pockets, with --pixel-size; for pockets only",
        _refusing_reader(Message("pictures are read for pockets only; use --process pocket")),
        recognition.sniff_picture,
        pockets=_lazy_reader("picture:read_picture_pockets"),
        processes=("pocket",),
    ),
    Format(
        "excellon",
        (".drl", ".xln", ".exc", ".ncd", ".drd"),
        "drill file of a circuit board: holes by tool, straight slots",
        _lazy_reader("excellon:read_excellon"),
        recognition.sniff_excellon,
    ),
    Format(
        "gerber",
        (".gbr", ".gtl", ".gbl", ".gko", ".gm1", ".zip"),
        "circuit board: a ZIP archive of Gerber and drill files, or one Gerber file; copper, outline and holes as "
        "layers, for milling parts only",
        _refusing_reader(Message("a Gerber board is milled with leafcut part; for drilling, give its drill file")),
        recognition.sniff_gerber,
        contours=_lazy_reader("gerber:read_gerber"),
        processes=("part",),
    ),
    Format(
        "xml",
        (".xml", ".map"),
        "point map in XML: <city>, <point>, <hole> or <node>, or their Spanish names, with x and y",
        _lazy_reader("xmlmap:read_xml"),
        recognition.sniff_xml,
    ),
    Format(
        "csv",
        (".csv", ".tsv", ".xy"),
        "table of points: x, y[, diameter][, name]",
        _lazy_reader("csvmap:read_csv"),
        recognition.sniff_csv,
    ),
    Format(
        "tsplib",
        (".tsp",),
        "TSPLIB problem (symmetric), nodes as points",
        _lazy_reader("tsplib:read_tsplib"),
        recognition.sniff_tsplib,
    ),
    Format(
        "gtsp",
        (".gtsp", ".pcglns"),
        "sets of nodes: a tour visits one node per set, with or without precedence",
        _lazy_reader("gtsp:read_gtsp"),
        recognition.sniff_gtsp,
    ),
    Format(
        "gcode",
        (".nc", ".ngc", ".gcode", ".gc", ".tap", ".cnc", ".min", ".eia", ".pim"),
        "G-code program of any CAM, to be reordered",
        _refusing_reader(Message("this is a program, not a drawing; give it to leafcut optimize, simulate or verify")),
        recognition.sniff_gcode,
        processes=("program",),
    ),
    Format(
        "example",
        (),
        "built in: example:{ten-points, plate-10, plate-27, plate-45, plate-65, plate-70, plate-8x8-10, plate-8x8-21, "
        "plate-8x8-35, plate-8x8-70, plate-15x15-10, plate-15x15-21, plate-15x15-35, plate-15x15-70, board-97, "
        "board-121, board-200} and random:N[:SEED]",
        _lazy_reader("examples:read_example"),
        prefix=("example:", "random:"),
    ),
)


def _built_in_names() -> set[str]:
    return {format_.name for format_ in BUILT_IN}


def _checked_plugin_format(name: str, entry: Any) -> Format:
    if not isinstance(entry, Format):
        raise TypeError(f"a leafcut.read.Format was expected, not {type(entry).__name__}")
    texts = (entry.name, entry.help, *entry.extensions, *entry.prefix, *entry.processes)
    if not all(isinstance(text, str) and text.isprintable() and text for text in texts):
        raise ValueError("a format's name, help, extensions, prefixes and processes are texts of one line")
    if entry.name in _built_in_names():
        raise ValueError(f"leafcut already has a format '{entry.name}'")
    return entry


#: Plug-in formats. A package adds a format with an entry point that refers to a `Format`.
READERS = PluginKind("reader", "leafcut.readers", _built_in_names, _checked_plugin_format, lambda format_: format_.help)


def formats() -> tuple[Format, ...]:
    """Return all formats, with plug-ins at the end. An unusable plug-in is included with its `error`."""
    return (*BUILT_IN, *(plugin.adds or _unusable_format(plugin) for plugin in READERS.plugins()))


def _unusable_format(plugin: Plugin[Format]) -> Format:
    refuse = _refusing_reader(Message("the reader '{}' is a {}", plugin.name, plugin.refusal))
    return Format(plugin.name, (), plugin.refusal, refuse, error=plugin.error)


def read_source_with_format(source: Input, on_progress: Heartbeat = ignore_heartbeat) -> tuple[Format, Source]:
    """Detect the format of an input, and read its bytes.

    If the input is already a `Source`, the function does not read it again. The source keeps its own `on_progress`
    unless the caller passes another callback.

    Raises
    ------
    ReadError
        The file does not exist, cannot be read, or has no known format.
    """
    known = formats()
    for format_ in known:
        if format_.prefix and str(source).startswith(format_.prefix):
            return format_, Source(str(source), on_progress=on_progress)
    if isinstance(source, StandardInput):
        source = Source(str(source), source.data)
    loaded = source if isinstance(source, Source) else load_source(source)
    if on_progress is not ignore_heartbeat:
        loaded = replace(loaded, on_progress=on_progress)
    return choose_format(known, loaded), loaded


def read_once(source: Input) -> Source:
    """Read an input into memory, so that several readers can share its bytes and its cache.

    Raises the same errors as `read_source_with_format`.
    """
    _, loaded = read_source_with_format(source)
    return loaded if loaded.cache is not None else replace(loaded, cache={})


def detect_format_name(path: str | Path) -> str:
    """Return the name of the format of a file, based on its first bytes.

    Return "" if the file is unreadable or has an unknown format.
    """
    try:
        with Path(path).open("rb") as stream:
            return choose_format(formats(), Source(str(path), stream.read(SNIFF_BYTES))).name
    except (OSError, ValueError, ReadError):
        return ""


def choose_format(known: tuple[Format, ...], source: Source) -> Format:
    """Choose the format of a file.

    A certain match by content comes first, then the extension, and then a likely match by content.
    """
    extension = Path(source.path).suffix.lower()
    head = source.data[:SNIFF_BYTES]
    by_extension = [(_sniff_safely(format_, head), format_) for format_ in known if extension in format_.extensions]
    for match, format_ in by_extension:
        if match == Match.YES:  # the other tests, some of them slow, are not needed
            return format_
    by_content = [(_sniff_safely(format_, head), format_) for format_ in known if extension not in format_.extensions]
    for required, candidates in (
        (Match.YES, by_content),
        (Match.MAYBE, by_extension),
        (Match.NO, by_extension),
        (Match.MAYBE, by_content),
    ):
        for match, format_ in candidates:
            if match == required:
                return format_
    known_formats = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in known if f.extensions)
    raise ReadError(source.path, Message("unknown file format; leafcut reads {}", known_formats))


def _sniff_safely(format_: Format, head: bytes) -> Match:
    try:
        return Match(format_.sniff(head))
    except Exception:  # an error in the sniff function of a plug-in must not stop the others
        return Match.NO


def run_reader(format_: Format, source: Source, options: ReadOptions) -> Part:
    """Run the reader of a format.

    Raises
    ------
    ReadError
        The file cannot be read, or a third-party parser raises any exception.
    OptionError
        The options choose, turn or lift a solid, but the format has no solids.
    """
    if format_.name != "step":
        for name in ("solid", "up", "z_zero"):
            if getattr(options, name) is not None and (name, options.z_zero) != ("z_zero", "drawn"):
                raise OptionError(
                    "{}: {} has no solids; remove the option, or use a STEP file", flag_name(name), format_.name
                )
    with parser_errors(source.path, Message("could not be read as {}", format_.name)):
        return format_.read(source, options)
