"""Read tool widths from the comments of a program."""

from __future__ import annotations

import math
import re

from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import comment_start, size_in_mm

_ABOUT_TOOL = re.compile(r"tool|mill|drill|bit\b|nose|cutter|\bdia|\bD\s?=|Ø", re.IGNORECASE)
_NUMBER = r"([0-9]{1,3}\s?/\s?[0-9]{1,3}|[0-9]{0,4}\.[0-9]{1,6}|[0-9]{1,4})\.?"
_TOOL = r"[a-z-]{0,12}(?:mill|drill|nose|cutter|bit)\b"
#: A number is a tool width if it is next to a word for the diameter or the tool; only adjectives may be in between.
_WIDTH = re.compile(
    rf"(?:\bD\s?=|\bdia[a-z]*\b\.?|\bsize\b|Ø)\s?[:=]?\s?{_NUMBER}\s?(mm|inch|in\b|\")?"
    rf"|(?:{_TOOL}|\btool\b|\b(?:tool\s?)?T?[0-9]{{1,3}}(?=\s*[-=:]))[^a-z0-9.]{{1,6}}{_NUMBER}\s?(mm|inch|in\b|\")"
    rf"|{_NUMBER}\s?(mm|inch|in\b|\")?[\s-]?(?=(?:[a-z]{{1,20}}[\s-]{{1,3}}){{0,3}}?{_TOOL})",
    re.IGNORECASE,
)
#: Words that indicate another length if they precede a number or are between it and its tool.
_OTHER = (
    r"leav\w*|left|stock|allow\w*|offset\w*|depth|deep|step\w*|over\w*|down|up|tol\w*|clear\w*|finish\w*|rough\w*|"
    r"remain\w*|thick\w*|doc|woc|ae|ap|length|long|stickout|corner|radius|flutes?|fl|teeth|deg|feed|speed|rpm|by|for|of|"
    r"with|per|every|spring|pass\w*|add|minus|plus"
)
_BEFORE_OTHER = re.compile(rf"\b(?:{_OTHER})[^a-z0-9]*$", re.IGNORECASE)
_BETWEEN_OTHER = re.compile(rf"\b(?:{_OTHER})\b", re.IGNORECASE)
_AFTER_OTHER = re.compile(r"[^a-z0-9]{0,3}(?:deep|depth|stock|left|long|steps?|pass\w*|doc|woc)\b", re.IGNORECASE)


def narrowest_tool(program: Program) -> float:
    """Return the smallest tool width stated in the comments of a program, mm; infinite without a stated width."""
    unit = next((m.unit for m in program.modals if m.unit), 1.0)
    widths = [math.inf]
    for text in program.lines:
        begin = comment_start(text)
        if begin < 0 or not _ABOUT_TOOL.search(text, begin):
            continue
        for match in _WIDTH.finditer(text, begin):
            if not match[1] and _is_other(text, match):
                continue
            if "size" in match[0].lower() and _BEFORE_OTHER.search(text[begin : match.start()]):
                continue
            width = size_in_mm(match[1] or match[3] or match[5], match[2] or match[4] or match[6], unit)
            widths.append(width if width > 0 else math.inf)
    return min(widths)


def _is_other(text: str, match: re.Match[str]) -> bool:
    """Return whether a number is not a width but stock to leave, a depth or a step-over."""
    number = 3 if match[3] else 5
    if number == 3 and _BEFORE_OTHER.search(match[0][: match.start(3) - match.start()]):
        return True
    ahead = re.match(rf"(?:[\sa-z-]){{0,60}}?{_TOOL}", text[match.end(number) :], re.IGNORECASE)
    between = _BETWEEN_OTHER.search(ahead[0]) if number == 5 and ahead else None
    return bool(between or _AFTER_OTHER.match(text, match.end()) or _BEFORE_OTHER.search(text[: match.start(number)]))
