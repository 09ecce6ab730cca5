"""Open a DXF file safely.

The module checks the size of the file before parsing it, reports repairs, and reads the units and layers.
"""

from __future__ import annotations

import io
import logging
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from leafcut.errors import ReadError, count_of, printable
from leafcut.message import Message
from leafcut.model.contour import layer_filter
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.options import ReadOptions
from leafcut.read.dxf_blocks import INVISIBLE, BlockWalk, LayerFilter
from leafcut.read.format import Source, drawing_unit_mm, skipped_entities_issue
from leafcut.read.recognition import BINARY_DXF, DXF_SECTION

#: Memory limits: ezdxf needs about 1.6 kB per circle and 0.1 kB per tag (two lines).
MAX_ENTITIES = 1_500_000
MAX_LINES = 30_000_000
#: Tags between two progress reports: a few milliseconds.
_TAGS_PER_REPORT = 1000
#: mm per unit of $INSUNITS (DXF reference, HEADER section); 0 and missing codes mean unknown.
INSUNITS = {
    1: 25.4,
    2: 304.8,
    3: 1609344.0,
    4: 1.0,
    5: 10.0,
    6: 1000.0,
    7: 1e6,
    8: 25.4e-6,
    9: 0.0254,
    10: 914.4,
    11: 1e-7,
    12: 1e-6,
    13: 1e-3,
    14: 100.0,
    15: 1e4,
    16: 1e5,
    21: 1200e3 / 3937,
    22: 100e3 / 3937,
    23: 3600e3 / 3937,
}
UNIT_NAMES = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 9: "mil", 13: "µm"}

#: Code of the ezdxf repair that guesses a number, which would put a hole in the wrong position.
GUESSED_NUMBER = 117
#: Codes of ezdxf repairs that change no geometry: sections and tables invalid in R12, the root dictionary, a character.
TRIVIAL_REPAIRS = (9, 10, 14, 111)

_END = re.compile(rb"[\r\n][ \t]*0[ \t]*\r?\n[ \t]*EOF[ \t]*(?:[\r\n\x1a\0]|$)", re.IGNORECASE)
_STRUCTURE = re.compile(rb"\n[ \t]*0[ \t]*\r?\n(?=[ \t]*[A-Za-z])")
_SECTION_END = re.compile(rb"\n[ \t]*0[ \t]*\r?\n[ \t]*ENDSEC\b")
_LINE = re.compile(r"\bline:? (\d+)")
#: Half of a surrogate pair (beyond U+FFFF), which cannot be encoded.
_HALF_LETTER = re.compile(rb"\\U\+[dD][89a-fA-F][0-9a-fA-F]{2}")


def open_document(source: Source, issues: list[Issue]) -> Any:
    """Open a file with ezdxf and apply repairs, but skip the audit.

    The audit deletes circles with duplicate handles. It also follows all paths through nested blocks, which can take
    forever even for a hundred lines of DXF. `BlockWalk` reports the errors in holes and blocks instead.
    """
    cache = {} if source.cache is None else source.cache
    if "document" not in cache:
        load_issues: list[Issue] = []
        cache["document"] = _load_document(source, load_issues), load_issues
    document, document_issues = cache["document"]
    issues += document_issues
    return document


def _load_document(source: Source, issues: list[Issue]) -> Any:
    data = _HALF_LETTER.sub(rb"\\U+FFFD", source.data)
    if data[:4] == b"AC10":
        raise ReadError(source.path, "this is a DWG drawing; save it as DXF")
    binary = data.startswith(BINARY_DXF)
    if not binary:
        if b"\n" not in data:
            data = data.replace(b"\r", b"\n")
        if not re.search(DXF_SECTION, data[:65536], re.IGNORECASE):
            raise ReadError(source.path, "this is not a DXF drawing: it does not start with group code 0 and SECTION")
        _check_size_and_end(source.path, data, issues)
    elif b"EOF\0" not in data[-64:]:
        raise ReadError(source.path, "the end of the drawing is missing; save or send it again")
    with _silence_ezdxf():
        try:
            document = _load_binary(data) if binary else _load_text(source, data, issues)
            document.modelspace()
            return document
        except ReadError:
            raise
        except Exception as problem:  # ezdxf raises almost any exception on a damaged file
            text = printable(str(problem), 160) or type(problem).__name__
            line = _LINE.search(text)
            reason = Message("the drawing is damaged and could not be repaired: {}", text)
            raise ReadError(source.path, reason, int(line.group(1)) if line else None) from None


def _check_size_and_end(path: str, data: bytes, issues: list[Issue]) -> None:
    lines = data.count(b"\n")
    if lines > MAX_LINES or sum(1 for _ in _STRUCTURE.finditer(data)) > MAX_ENTITIES:
        raise ReadError(
            path, Message("the drawing has more than {:,} entities or {:,} lines; split it", MAX_ENTITIES, MAX_LINES)
        )
    if end := _END.search(data):
        if data[end.end() :].strip(b" \t\r\n\0\x1a"):
            issues.append(Issue("L101", Message("text after the end of the drawing (EOF) was ignored")))
        return
    start = data.rfind(b"ENTITIES")
    if start < 0 or not _SECTION_END.search(data, start):
        raise ReadError(path, "the end of the drawing is missing; save or send it again", lines)
    issues.append(Issue("L101", Message("the drawing ends without EOF; its entities are complete")))


def _load_binary(data: bytes) -> Any:
    from ezdxf.document import Drawing
    from ezdxf.lldxf.tagger import binary_tags_loader

    return Drawing.load(binary_tags_loader(data, errors="replace"))


def _load_text(source: Source, data: bytes, issues: list[Issue]) -> Any:
    from ezdxf.document import Drawing
    from ezdxf.recover import Recover, bytes_loader

    def with_progress(stream: io.BytesIO) -> Iterator[Any]:
        for number, tag in enumerate(bytes_loader(stream)):
            if number % _TAGS_PER_REPORT == 0:
                source.on_progress(stream.tell() / len(data))
            yield tag

    tool = Recover.run(io.BytesIO(data), with_progress, errors="replace")
    for code, message in tool.errors:
        if code == GUESSED_NUMBER:
            line = _LINE.search(message)
            description = printable(message.split(" near ")[0].replace("recovered ", ""))
            reason = Message("{}; repair the drawing, because a guess could cut in the wrong place", description)
            raise ReadError(source.path, reason, int(line.group(1)) if line else None)
    document = Drawing.from_tags(_all_tags(tool.section_dict))
    repairs = [message for code, message in (*tool.errors, *tool.fixes) if code not in TRIVIAL_REPAIRS]
    if repairs:
        more = Message(" (and {} more)", len(repairs) - 1) if len(repairs) > 1 else ""
        issues.append(Issue("L101", Message("the drawing was damaged: {}{}", printable(repairs[0], 100), more)))
    return document


def _all_tags(sections: Mapping[str, Iterable[Iterable[Any]]]) -> Iterator[Any]:
    from ezdxf.lldxf.types import DXFTag

    for records in sections.values():
        for record in records:
            yield from record
        yield DXFTag(0, "ENDSEC")
    yield DXFTag(0, "EOF")


@contextmanager
def _silence_ezdxf() -> Iterator[None]:
    logger = logging.getLogger("ezdxf")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


def drawing_units(document: Any, options: ReadOptions) -> tuple[float, str | None]:
    """Return the length of the drawing unit, mm, and the name of the unit. The name is None if the unit is assumed."""
    if options.units:
        return drawing_unit_mm(options, None), options.units
    code = document.header.get("$INSUNITS", 0)
    if code not in INSUNITS:
        return 1.0, None
    return INSUNITS[code], UNIT_NAMES.get(code, f"$INSUNITS {code}")


def layer_filter_of_document(document: Any, options: ReadOptions) -> LayerFilter:
    """Return the filter that excludes layers that are frozen, off or not chosen."""
    frozen, off = set(), set()
    for layer in document.layers:
        name = str(layer.dxf.get("name", "")).casefold()
        if layer.is_frozen():
            frozen.add(name)
        if layer.is_off():
            off.add(name)
    return LayerFilter(frozen, off, layer_filter(options.layers))


def skipped_content_issues(walk: BlockWalk[Any]) -> list[Issue]:
    """Report everything that was skipped in a drawing: damaged entities, hidden layers, and unusable blocks."""
    issues = []
    reasons: dict[tuple[str, str], list[str]] = {}
    for kind, handle, reason in walk.broken:
        reasons.setdefault((kind, reason), []).append(handle)
    for (kind, reason), handles in reasons.items():
        message = Message("skipped {} {}: {}", len(handles), printable(kind), reason)
        issues.append(skipped_entities_issue(handles, message))
    if walk.hidden:
        issues.append(Issue("L204", Message("left out: {}", hidden_counts_text(walk)), severity=Severity.NOTE))
    for name, number in walk.missing_blocks.items():
        message = Message("{} of block '{}', which is missing", count_of(number, "insertion"), printable(name))
        issues.append(Issue("L206", message, missing=MissingWork("block", number)))
    for name, number in walk.endless_blocks.items():
        message = Message(
            "block '{}' refers to itself or is nested too deep: {} skipped",
            printable(name),
            count_of(number, "insertion"),
        )
        issues.append(Issue("L206", message, missing=MissingWork("block", number)))
    return issues


def hidden_counts_text(walk: BlockWalk[Any]) -> Message:
    """Describe the number of hidden entities on each layer."""
    named = [
        Message("{} on layer {}", n, printable(layer)) for layer, n in walk.hidden.most_common(5) if layer != INVISIBLE
    ]
    if invisible := walk.hidden.get(INVISIBLE):
        named.append(Message("{} invisible", invisible))
    return Message.joined(", ", named) + (" …" if len(walk.hidden) > 5 else "")
