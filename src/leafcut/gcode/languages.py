"""Detect unsupported programs: for lathes and 3D printers, and in the languages of Heidenhain and Siemens.

Outside of comments, such programs contain words that never occur in a program for a mill, a laser or a torch.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import partial

from leafcut.gcode.words import COMMENT
from leafcut.message import Message

#: Only this many characters are examined. The start of a program is enough to recognize its kind.
_LOOKED_AT = 400_000

_HEIDENHAIN = re.compile(
    r"\d*\s*(BEGIN PGM|END PGM|TOOL CALL|TOOL DEF|CYCL DEF|BLK FORM|LBL|CALL LBL)\b", re.IGNORECASE
)
#: Matches DIN/ISO programs of Heidenhain: program name, units, and an asterisk at the end of each block.
_HEIDENHAIN_ISO = re.compile(r"%\S+\s+G7[01]\s*\*", re.IGNORECASE)
_FMAX = re.compile(r"\d*\s*(?:L|CC|C|CR|APPR|DEP)\s.*\bFMAX\b", re.IGNORECASE)
_SIEMENS_HEAD = re.compile(r";\s*\$PATH\s*=|%_N_\w+_(?:MPF|SPF|INI)\b", re.IGNORECASE)
_SIEMENS = re.compile(
    r"(?:N\d+\s*)?(MCALL\b|(?:MCALL\s+)?CYCLE\d{2,4}\s*\(|MSG\s*\(|A?(?:TRANS|MIRROR)\b|A?(?:ROT|SCALE)\s+[XYZR]|"
    r"WORKPIECE\s*\(|DEF\s+(?:REAL|INT|BOOL|STRING)\b|EXTERN\b|REPEATB?\s|POCKET\d\s*\(|HOLES\d\s*\()",
    re.IGNORECASE,
)
_PRINTS = re.compile(r"(?:N\d+\s*)?G0*1(?![0-9.]).*E[-+]?[0-9.]", re.IGNORECASE)
_HEATS = re.compile(r"(?:N\d+\s*)?(M10[49]|M140|M8[23])(?![0-9])", re.IGNORECASE)
_SLICER = re.compile(
    r";\s*(?:FLAVOR:|LAYER:\d|LAYER_COUNT|TYPE:|"
    r"generated (?:by|with) (?:PrusaSlicer|SuperSlicer|Slic3r|Cura|OrcaSlicer|Bambu))",
    re.IGNORECASE,
)
#: Lathe words, in lines without spaces.
_LATHE = (
    re.compile(r"G96(?![0-9.])", re.IGNORECASE),
    re.compile(r"G(?:50|92)(?=S[0-9])", re.IGNORECASE),
    re.compile(r"T[0-9]{4}(?![0-9.])(?!.*M0*6(?![0-9]))", re.IGNORECASE),
    re.compile(r"G7[0-3](?![0-9.])(?=.*P[0-9]+.*Q[0-9]|[UW][0-9.]+R[0-9.])|G76(?![0-9.])(?=.*P[0-9])", re.IGNORECASE),
)
#: Words that indicate a lathe even if the program has M6: diameter mode, radius mode (G8 P1 differs on Fanuc), the XZ
#: plane.
_LATHE_MODES = (
    re.compile(r"G0?7(?![0-9.])", re.IGNORECASE),
    re.compile(r"G0?8(?![0-9.])(?!.*P[0-9])", re.IGNORECASE),
    re.compile(r"G18(?![0-9.])", re.IGNORECASE),
)
_ARC = re.compile(r"G0?[23](?![0-9.])", re.IGNORECASE)
#: Matches words that only mills use: the planes G17 and G19, and rotary axes.
_OF_MILL = re.compile(r"G1[79](?![0-9.])|[AB][-+\[#.0-9]", re.IGNORECASE)
_Y = re.compile(r"Y\s*[-+\[#.0-9]", re.IGNORECASE)
_X = re.compile(r"[XU]\s*[-+\[#.0-9]", re.IGNORECASE)
_Z = re.compile(r"[ZW]\s*[-+\[#.0-9]", re.IGNORECASE)
_DRILLS = re.compile(r"G8[1-9](?![0-9.])", re.IGNORECASE)
_CHANGES = re.compile(r"M0*6(?![0-9.])", re.IGNORECASE)


def describe_unsupported_language(text: str) -> str:
    """Return a message that names the unsupported language of a text. For a mill, laser or torch program, return ""."""
    lines = text[:_LOOKED_AT].splitlines()
    if len(text) > _LOOKED_AT:
        lines = lines[:-1]
    code = [COMMENT.sub(" ", line).strip() for line in lines]
    for words, kind in (
        (
            _heidenhain_evidence(lines),
            partial(Message, "this is a Heidenhain conversational (Klartext) program ({}), not G-code"),
        ),
        (_heidenhain_iso_evidence(lines), partial(Message, "this is a Heidenhain DIN/ISO program ({})")),
        (
            _siemens_evidence(lines),
            partial(Message, "this is a Siemens (SINUMERIK) program ({}), not plain G-code"),
        ),
        (_printer_evidence(lines, code), partial(Message, "this is a program for a 3D printer ({})")),
        (lathe := _lathe_evidence(code, text), partial(Message, "this is a program for a lathe ({})")),
    ):
        if words:
            does = Message("leafcut orders the work of mills, drills, lasers and torches whose programs are in G-code")
            message = Message("{}; {}", kind(words), does)
            return Message("{}; if it is for a mill, state G17 in its first lines", message) if lathe else message
    return ""


def _heidenhain_evidence(lines: list[str]) -> str:
    found = {" ".join(m.group(1).upper().split()) for m in _matching_lines(_HEIDENHAIN, lines)}
    if found & {"BEGIN PGM", "END PGM"}:
        return "BEGIN PGM"
    rapid = any(True for _ in _matching_lines(_FMAX, lines))
    return sorted(found)[0] if len(found) > 1 or (found and rapid) else ""


def _heidenhain_iso_evidence(lines: list[str]) -> str:
    found = next(_matching_lines(_HEIDENHAIN_ISO, lines), None)
    return "" if found is None else Message("blocks that end in *")


def _siemens_evidence(lines: list[str]) -> str:
    head = next(_matching_lines(_SIEMENS_HEAD, lines), None)
    if head is not None:
        return head.group().lstrip("; ")[:20]
    found = next(_matching_lines(_SIEMENS, lines), None)
    return "" if found is None else found.group(1).upper().rstrip(" (")


def _printer_evidence(lines: list[str], code: list[str]) -> str:
    prints = sum(1 for _ in _matching_lines(_PRINTS, code))
    heats = next(_matching_lines(_HEATS, code), None)
    sliced = next(_matching_lines(_SLICER, lines), None)
    if prints < 2 or (heats is None and sliced is None):
        return ""
    return Message("G1 with E, {}", heats.group(1).upper() if heats else Message("layers"))


def _lathe_evidence(code: list[str], text: str) -> str:
    """Return the first lathe word and its line if the program moves X and Z but not Y and has no drilling cycles.

    G18 counts only if the program has arcs, as in a turned contour. A slot along X may also be milled in G18.
    """
    if any(_Y.search(line) or _DRILLS.search(line) for line in code):
        return ""
    if not (any(_X.search(line) for line in code) and any(_Z.search(line) for line in code)):
        return ""
    compact = ["".join(line.split()) for line in code]
    patterns = list(_LATHE_MODES[:2])
    if any(map(_ARC.search, compact)) and not any(map(_OF_MILL.search, compact)):
        patterns.append(_LATHE_MODES[2])
    if not any(map(_CHANGES.search, compact)):
        patterns += _LATHE
    found = next(
        (
            Message("{}, and no Y; line {}", word.group().upper(), number)
            for pattern in patterns
            for number, word in enumerate(map(pattern.search, compact), 1)
            if word is not None
        ),
        "",
    )
    return "" if _Y.search(COMMENT.sub(" ", text[_LOOKED_AT:])) else found


def _matching_lines(pattern: re.Pattern[str], lines: Iterable[str]) -> Iterator[re.Match[str]]:
    return (found for found in (pattern.match(line.lstrip()) for line in lines) if found is not None)
