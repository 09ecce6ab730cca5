"""Read tool data from the comments of a program: the diameter and kind of a tool, and the smallest tool width."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from leafcut.gcode.program import Program
from leafcut.gcode.words import COMMENT
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.units import MM_PER_INCH

#: A comment about a tool must be at most this many lines above the section, and at most this many lines above the tool
#: change.
_FARTHEST_COMMENT, _BEFORE_CHANGE = 2000, 20
#: A tool list must be within this number of lines at the top of a program.
_TOP = 200
_NUMBER = r"([0-9]{1,3}\s?/\s?[0-9]{1,3}|[0-9]{0,4}\.?[0-9]{1,6})\.?"
_UNIT = r"\s?(mm|inch|in\b|\")?"
_MILL = r"(?:end\s?-?mill|face\s?-?mill|slot\s?-?mill|ball\s?-?nose|bull\s?-?nose|v-?bit|router\s?bit|cutter)"
#: Excludes the limits for the holes of a drawing in the options of leafcut: --min-diameter 6mm.
_NO_LIMIT = r"(?<!min-)(?<!max-)"
_NO_COUNT = r"(?!\s*(?:-\s*)?(?:flutes?|fl\b|teeth|tooth|inserts?|deg|°))"
_DIAMETERS = (
    # D=6., diameter 6 mm.
    re.compile(
        rf"(?:{_NO_LIMIT}diameter|\bdia\b\.?|drill size|bit size|\bD\s?=|Ø)\s?[:=]?\s?{_NUMBER}{_UNIT}",
        re.IGNORECASE,
    ),
    # Drill {3 mm}, Drill, 5 mm: only with a unit; otherwise it may be the number of an operation.
    re.compile(rf"\bdrill(?:\s?bit)?\s?[,{{]?\s?{_NUMBER}\s?(mm|inch|\")(?!\s*(?:deep|depth))", re.IGNORECASE),
    # T1 | 6. DRILL | H1
    re.compile(rf"\|\s*{_NUMBER}{_UNIT}\s?(?:[a-z]{{1,20}}[\s-]{{1,3}}){{0,2}}?drill\s*\|", re.IGNORECASE),
    # ( T1 : 3.0 )
    re.compile(rf"\(\s*T[0-9]{{1,9}}\s*:\s*{_NUMBER}()\s*\)"),
    # End Mill {6 mm}
    re.compile(rf"{_MILL}\s?\{{\s?{_NUMBER}{_UNIT}\s?\}}", re.IGNORECASE),
    # 1/2 FLAT ENDMILL
    re.compile(
        rf"(?<![\w./#-]){_NUMBER}{_NO_COUNT}{_UNIT}[\s-]?(?:[a-z]{{1,20}}[\s-]{{1,3}}){{0,2}}?{_MILL}", re.IGNORECASE
    ),
)
#: Matches a number with its unit.
_SIZE = re.compile(
    r"(?<![\w./])(?:[0-9]{1,3}/[0-9]{1,3}|[0-9]{0,4}\.?[0-9]{1,6}\.?)\s?-?(mm\b|inch(?:es)?\b|\")", re.IGNORECASE
)
#: Matches a comment that names its tool: T5, 5 = …
_NAMED = re.compile(r"\bT\s?([0-9]{1,9})\b|^[\s(;]*([0-9]{1,9})\s?=", re.IGNORECASE)


#: Words for kinds of tools. The first match counts. Without a match, the tool is an end mill.
_SHAPES = (
    (ToolKind.BALL_MILL, re.compile(r"\bball", re.IGNORECASE)),
    (ToolKind.V_BIT, re.compile(r"\bv-?\s?(?:bit|carve|groove)", re.IGNORECASE)),
    (ToolKind.END_MILL, re.compile(r"\bflat|\bend\s?-?mill|\bface\s?-?mill|\bslot", re.IGNORECASE)),
    (ToolKind.V_BIT, re.compile(r"\bengrav|chamfer|counter-?sink", re.IGNORECASE)),
    (ToolKind.DRILL, re.compile(r"drill", re.IGNORECASE)),
)
_ANGLE = re.compile(r"([0-9]{1,3}(?:\.[0-9]{0,6})?)\s?(?:deg|°)", re.IGNORECASE)
_CORNER = re.compile(r"\bCR\s?=\s?([0-9]{0,4}\.?[0-9]{1,6})", re.IGNORECASE)
#: Default point angle of a drill, rad.
_USUAL_POINT = math.radians(118)
_ABOUT_TOOL = re.compile(r"tool|mill|drill|bit\b|nose|cutter|\bdia|\bD\s?=|Ø", re.IGNORECASE)
_ANY_NUMBER = r"([0-9]{1,3}\s?/\s?[0-9]{1,3}|[0-9]{0,4}\.[0-9]{1,6}|[0-9]{1,4})\.?"
_TOOL = r"[a-z-]{0,12}(?:mill|drill|nose|cutter|bit)\b"
#: A number is a tool width if it is next to a word for the diameter or the tool. Only adjectives may separate them.
_WIDTH = re.compile(
    rf"(?:\bD\s?=|{_NO_LIMIT}\bdia[a-z]*\b\.?|\bsize\b|Ø)\s?[:=]?\s?{_ANY_NUMBER}\s?(mm|inch|in\b|\")?"
    rf"|(?:{_TOOL}|\btool\b|\b(?:tool\s?)?T?[0-9]{{1,3}}(?=\s*[-=:]))[^a-z0-9.]{{1,6}}{_ANY_NUMBER}\s?(mm|inch|in\b|\")"
    rf"|{_ANY_NUMBER}\s?(mm|inch|in\b|\")?[\s-]?(?=(?:[a-z]{{1,20}}[\s-]{{1,3}}){{0,3}}?{_TOOL})",
    re.IGNORECASE,
)
#: If one of these words comes before a number, or separates it from its tool, the number is a different length.
_OTHER = (
    r"leav\w*|left|stock|allow\w*|offset\w*|depth|deep|step\w*|over\w*|down|up|tol\w*|clear\w*|finish\w*|rough\w*|"
    r"remain\w*|thick\w*|doc|woc|ae|ap|length|long|stickout|corner|radius|flutes?|fl|teeth|deg|feed|speed|rpm|by|for|of|"
    r"with|per|every|spring|pass\w*|add|minus|plus"
)
_BEFORE_OTHER = re.compile(rf"\b(?:{_OTHER})[^a-z0-9]*$", re.IGNORECASE)
_BETWEEN_OTHER = re.compile(rf"\b(?:{_OTHER})\b", re.IGNORECASE)
_AFTER_OTHER = re.compile(r"[^a-z0-9]{0,3}(?:deep|depth|stock|left|long|steps?|pass\w*|doc|woc)\b", re.IGNORECASE)


def first_size_in_other_unit(lines: Iterable[str], unit: str) -> tuple[int, str]:
    """Return the line and text of the first size in a comment that is not in `unit` (``mm`` or ``in``).

    The line is 0 if no such size exists, or if comments also give sizes in `unit`.
    """
    first = (0, "")
    for number, text in enumerate(lines, 1):
        if "(" not in text and ";" not in text:
            continue
        for comment in COMMENT.findall(text):
            for size in _SIZE.finditer(comment):
                if (size.group(1).lower() == "mm") == (unit == "mm"):
                    return 0, ""
                first = first if first[0] else (number, size.group())
    return first


def tool_diameter_in_comments(program: Program, block: int) -> float:
    """Return the tool diameter from the last comment about the tool of a block, mm, or 0."""
    return _described_diameter(program, block)[0]


def tool_in_comments(program: Program, block: int, since: int = 0) -> Tool | None:
    """Return the tool of a block as the comments describe it.

    The result is None if the comments state neither a diameter nor the angle of a V-bit. Mills are assumed to be flat.
    A comment up to line `since` counts only if it names the tool.
    """
    width, comment = _described_diameter(program, block, since)
    if not width:
        return None
    number = program.modal(block).tool or 0
    kind = next((kind for kind, pattern in _SHAPES if pattern.search(comment)), ToolKind.END_MILL)
    angle, corner = _ANGLE.search(comment), _CORNER.search(comment)
    # CAM programs give the point angle of a drill as TAPER.
    degrees = float(angle.group(1)) if angle else 0.0
    point = math.radians(degrees) if 0 < degrees < 180 else _USUAL_POINT if kind is ToolKind.DRILL else math.pi
    if kind is ToolKind.V_BIT:
        return Tool(number, width, kind, point_angle=point) if point < math.pi else None
    if kind is ToolKind.DRILL:
        return Tool(number, width, kind, point_angle=point)
    radius = min(float(corner.group(1)) * (program.modal(block).unit or 1.0), 0.5 * width) if corner else 0.0
    return Tool(number, width, kind, point_angle=math.pi, corner_radius=0.0 if kind is ToolKind.BALL_MILL else radius)


def _described_diameter(program: Program, block: int, since: int = 0) -> tuple[float, str]:
    # In a subprogram the line of its call counts: the last tool change in the text may belong to a later call.
    line = int(program.text_line[block]) - 1
    modal = program.modal(block)
    unit, tool = modal.unit or 1.0, modal.tool
    changes = program.row_block[program.path.kind == Kind.TOOL]
    earlier = changes[changes < block]
    last = int(program.text_line[earlier[-1]]) if len(earlier) else 1
    for number in range(line, max(last - _BEFORE_CHANGE, 0, line - _FARTHEST_COMMENT) - 1, -1):
        described = _parse_tool_comment(program.lines[number], unit)
        if not described:
            continue
        named = tool is not None and described[1] == tool
        if named or (number >= since and None in (tool, described[1])):
            return described[0], described[2]
    for text in program.lines[: min(line, _TOP)]:
        described = _parse_tool_comment(text, unit)
        if described and tool is not None and described[1] == tool:
            return described[0], described[2]
    return 0.0, ""


def _parse_tool_comment(text: str, unit: float) -> tuple[float, int | None, str] | None:
    """Return the diameter in a comment, mm, the tool number or None, and the comment itself.

    Without a diameter, return None.
    """
    if "(" not in text and ";" not in text:
        return None
    match = next((m for pattern in _DIAMETERS if (m := pattern.search(text))), None)
    if match is None:
        return None
    comment = text[comment_start(text) :]
    tool = _NAMED.search(comment)
    number = int(tool.group(1) or tool.group(2)) if tool else None
    return convert_size_to_mm(match.group(1), match.group(2), unit), number, comment


def comment_start(text: str) -> int:
    """Return the index of the character that starts a comment in a line, or -1."""
    return min((k for k in (text.find("("), text.find(";")) if k >= 0), default=-1)


def convert_size_to_mm(number: str, named: str | None, unit: float) -> float:
    """Convert a size such as 6.35 or 1/4 to mm.

    `named` is the unit written after the size. Without it, the size is in program units, and `unit` is their length in
    mm.
    """
    whole, _, part = number.partition("/")
    value = float(whole) / (float(part) or 1.0) if part else float(whole)
    return value * (unit if not named else 1.0 if named.lower() == "mm" else MM_PER_INCH)


def smallest_diameter_in_comments(program: Program) -> float:
    """Return the smallest tool width in the comments of a program, mm. If the comments state none, return infinity."""
    unit = next((m.unit for m in program.modals if m.unit), 1.0)
    widths = [math.inf]
    for text in program.lines:
        begin = comment_start(text)
        if begin < 0 or not _ABOUT_TOOL.search(text, begin):
            continue
        for match in _WIDTH.finditer(text, begin):
            if not match[1] and _is_other_size(text, match):
                continue
            if "size" in match[0].lower() and _BEFORE_OTHER.search(text[begin : match.start()]):
                continue
            width = convert_size_to_mm(match[1] or match[3] or match[5], match[2] or match[4] or match[6], unit)
            widths.append(width if width > 0 else math.inf)
    return min(widths)


def _is_other_size(text: str, match: re.Match[str]) -> bool:
    """Return whether a number is a stock allowance, a depth or a step-over instead of a width."""
    number = 3 if match[3] else 5
    if number == 3 and _BEFORE_OTHER.search(match[0][: match.start(3) - match.start()]):
        return True
    ahead = re.match(rf"(?:[\sa-z-]){{0,60}}?{_TOOL}", text[match.end(number) :], re.IGNORECASE)
    between = _BETWEEN_OTHER.search(ahead[0]) if number == 5 and ahead else None
    return bool(between or _AFTER_OTHER.match(text, match.end()) or _BEFORE_OTHER.search(text[: match.start(number)]))
