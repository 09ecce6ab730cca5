"""Recognise the format of a file from its first bytes, without loading a reader."""

from __future__ import annotations

import re

from leafcut.read.format import Match

BINARY_DXF = b"AutoCAD Binary DXF\r\n\x1a\x00"
#: Start of a text DXF: group code 0 with SECTION, case-insensitive.
DXF_SECTION = rb"(?:^|[\r\n])[ \t]*0[ \t]*\r?\n[ \t]*SECTION\b"

#: XML elements that define points.
POINT_TAGS = ("city", "point", "hole", "node", "ciudad", "punto", "agujero", "nodo")

#: Magic bytes of pictures. The list includes unsupported formats, so that messages can name them.
_PICTURES = (
    (b"\x89PNG\r\n\x1a\n", "PNG"),
    (b"\xff\xd8\xff", "JPEG"),
    (b"BM", "BMP"),
    (b"GIF8", "GIF"),
    (b"II*\0", "TIFF"),
    (b"MM\0*", "TIFF"),
    (b"RIFF", "WebP"),
)

#: Geometries of well-known text.
_GEOMETRIES = (
    "POINT|LINESTRING|LINEARRING|POLYGON|MULTIPOINT|MULTILINESTRING|MULTIPOLYGON|GEOMETRYCOLLECTION|CIRCULARSTRING|"
    "COMPOUNDCURVE|CURVEPOLYGON|MULTICURVE|MULTISURFACE|POLYHEDRALSURFACE|TIN|TRIANGLE"
)

#: Patterns of Excellon files: a tool with its diameter, header words, a tool alone, a coordinate.
_DRILL_TOOL, _DRILL_HEADER = rb"^T\d.*C[.\d]", rb"^(?:METRIC|INCH|M71|M72|FMAT)"
_BARE_TOOL, _DRILL_PLACE = rb"^T\d{1,6}\s*$", rb"^X[-+.\d]+Y[-+.\d]+\s*$"
#: Words in G-code programs that drill files never contain: Z, spindle and tool changes, and all G codes except
#: drilling, routing, slots, absolute and incremental coordinates, and the zero.
_NOT_IN_DRILL_FILES = (
    rb"^(?!T\d|METRIC|INCH|M7[12])[^;(\n]*?(?:Z|M0?[3-6](?!\d)|G(?!0?[0-5](?!\d)|4[0-2](?!\d)|85(?!\d)|9[013](?!\d))\d)"
)

#: To detect a G-code program: number of lines to examine, and minimum share of blocks.
_LINES, _SHARE = 60, 0.8
#: A block of a program: words that consist of a letter and a number, a comment, a percent sign, an O-word, or an
#: assignment. The quantifiers are possessive, because backtracking on a long truncated line would take forever.
_BLOCK = (
    rb"\s*(%.*|[(;].*|[oO]\s*(\d+|<).*|#.*|/?\s*+([A-Za-z]\s*+[+-]?(\d++\.?\d*+|\.\d++|[\[#].*)\s*+)++([(;].*)?|)\s*"
)
_CODE = rb"\b[GgMm]\s*0*\d{1,3}(?!\d)"


def sniff_dxf(head: bytes) -> Match:
    """Recognise DXF by the sentinel of binary files, or by group code 0 with SECTION in text files."""
    if head.startswith(BINARY_DXF):
        return Match.YES
    text = head[:4096].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return Match.YES if re.search(DXF_SECTION, text, re.IGNORECASE) else Match.NO


def sniff_svg(head: bytes) -> Match:
    """Recognise SVG by its root element."""
    return Match.YES if re.search(rb"<(?:\w+:)?svg[\s>]", head[:16384]) else Match.NO


def sniff_step(head: bytes) -> Match:
    """Recognise STEP by its first keyword (ISO 10303-21)."""
    return Match.YES if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"ISO-10303-21;") else Match.NO


def sniff_sirius(head: bytes) -> Match:
    """Recognise a sheet of Sirius by its list of parts."""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    return Match.YES if start.startswith(b"[") and re.search(rb'"partid"\s*:', start) else Match.NO


def sniff_wkt(head: bytes) -> Match:
    """Recognise well-known text by its first geometry."""
    pattern = rf"\s*(?:SRID\s*=\s*\d+\s*;\s*)?(?:{_GEOMETRIES})\b\s*(?:(?:Z|M|ZM)\s*)?(?:\(|EMPTY\b)"
    text = head[:4096].decode("latin-1").removeprefix("ï»¿")
    return Match.YES if re.match(pattern, text, re.IGNORECASE) else Match.NO


def sniff_picture(head: bytes) -> Match:
    """Recognise a picture by its first bytes."""
    return Match.YES if picture_kind(head) else Match.NO


def picture_kind(head: bytes) -> str:
    """Detect the kind of picture from the first bytes. Return "" if the file is not a picture."""
    kind = next((kind for magic, kind in _PICTURES if head.startswith(magic)), "")
    checks = {"BMP": head[6:10] == bytes(4), "WebP": head[8:12] == b"WEBP"}
    return kind if checks.get(kind, True) else ""


def sniff_excellon(head: bytes) -> Match:
    """Recognise Excellon by its header, or by tools and coordinates.

    The extension alone is not enough, because drill files can also have the extension ``.tap`` or ``.nc``.
    """
    lines = head.replace(b"\r", b"\n")
    tools = _has_line(_DRILL_TOOL, lines)
    if _has_line(rb"^M48\s*$", lines) and (tools or _has_line(_DRILL_HEADER, lines)):
        return Match.YES
    if not _has_line(_DRILL_PLACE, lines):
        return Match.NO
    if tools:
        return Match.MAYBE if _has_line(_NOT_IN_DRILL_FILES, lines) else Match.YES
    bare = _has_line(_BARE_TOOL, lines) and not _has_line(rb"^[^;(\n]*G\d", lines)
    return Match.YES if bare and not _has_line(_NOT_IN_DRILL_FILES, lines) else Match.NO


def is_gerber_text(head: bytes) -> bool:
    """Return whether a file is Gerber: it states its unit or its coordinate format."""
    return re.search(rb"%(?:MO(?:MM|IN)\*|FS[LTD][AI])", head[:65536]) is not None


def sniff_gerber(head: bytes) -> Match:
    """Recognise a Gerber file, or a ZIP archive, which may contain Gerber files."""
    if head.startswith(b"PK\x03\x04"):
        return Match.MAYBE
    return Match.YES if is_gerber_text(head) else Match.NO


def _has_line(pattern: bytes, lines: bytes) -> bool:
    return re.search(pattern, lines, re.MULTILINE) is not None


def sniff_xml(head: bytes) -> Match:
    """Recognise XML by its first character, and exclude SVG and HTML."""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()[:2000].lower()
    if not start.startswith((b"<?xml", b"<")) or b"<svg" in start or b"<html" in start or b"<!doctype html" in start:
        return Match.NO
    return Match.YES if any(b"<" + tag.encode() in head.lower() for tag in POINT_TAGS) else Match.MAYBE


def sniff_csv(head: bytes) -> Match:
    """Recognise a table if most lines start with two numbers. The match is never certain."""
    from leafcut.read.table_rows import detect_separator, is_number, split_row

    if b"\0" in head:
        return Match.NO
    lines = [line for line in head.decode("latin-1").splitlines()[:50] if line.strip() and not line.startswith("#")]
    separator = detect_separator(lines)
    rows = [split_row(line, separator) for line in lines]
    numeric = sum(len(r) >= 2 and is_number(r[0], separator) and is_number(r[1], separator) for r in rows)
    return Match.MAYBE if rows and numeric >= max(1, len(rows) // 2) else Match.NO


def sniff_tsplib(head: bytes) -> Match:
    """Recognise TSPLIB by its keys."""
    if sniff_gtsp(head) == Match.YES:
        return Match.NO
    text = head[:4096].decode("latin-1").upper()
    keys = re.findall(
        r"^[^\S\n]*(NAME|TYPE|COMMENT|DIMENSION|EDGE_WEIGHT_TYPE|NODE_COORD_SECTION)\b", text, re.MULTILINE
    )
    return Match.YES if len(set(keys)) >= 2 and "DIMENSION" in keys else Match.NO


def sniff_gtsp(head: bytes) -> Match:
    """Recognise GTSPLIB by the key for the number of sets."""
    text = head[:4096].decode("latin-1").upper()
    return Match.YES if re.search(r"^[^\S\n]*GTSP_SETS\b", text, re.MULTILINE) else Match.NO


def sniff_gcode(head: bytes) -> Match:
    """Recognise a G-code program by its blocks. The match is never certain."""
    if b"\0" in head:
        return Match.NO
    lines = [line[:300] for line in head.splitlines()[:_LINES] if line.strip()]
    blocks = sum(re.fullmatch(_BLOCK, line) is not None for line in lines)
    codes = sum(re.search(_CODE, line) is not None for line in lines)
    if lines and codes and blocks >= _SHARE * len(lines):
        return Match.MAYBE
    from leafcut.gcode.languages import describe_unsupported_language

    # Programs in other languages are recognised too, so that messages can name them.
    return Match.MAYBE if describe_unsupported_language(head.decode("latin-1")) else Match.NO
