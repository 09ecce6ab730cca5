"""Read Excellon drill files with gerbonara: holes by tool, and slots.

Slots are routed or drilled with G85, and become straight slots. gerbonara supports the dialects of KiCad, Altium,
Eagle, Allegro and others. The reader translates unsupported commands (G85 slots, one-digit G codes, feeds and speeds of
a machine) line by line, so that messages keep the line numbers.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut.errors import ReadError, count_of, printable
from leafcut.message import Message
from leafcut.model.contour import layer_filter
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Hole, Part, Slot
from leafcut.options import ReadOptions
from leafcut.read.filter_holes import select_holes
from leafcut.read.format import (
    COPIES_PER_BYTE,
    FREE_COPIES,
    MAX_COORDINATE,
    MAX_HOLES,
    ReadBudget,
    Source,
    drawing_unit_mm,
    file_size_text,
    too_many_holes_error,
    unknown_units_issue,
)

#: Maximum length of a command, characters. A drill file has no longer lines, and matching them would be slow.
MAX_COMMAND = 200
#: Maximum number of tools: no board needs more, and gerbonara sorts all tools again at each definition.
MAX_TOOLS = 5_000

#: Default coordinate format without a decimal point: digits before and after it.
_DIGITS = {"mm": (3, 3), "in": (2, 4)}
_NUMBER = r"[+-]?\d*\.?\d*"
_COORDINATE = re.compile(rf"[XY]{_NUMBER}")
_SLOT = re.compile(rf"((?:X{_NUMBER})?(?:Y{_NUMBER})?)G85((?:X{_NUMBER})?(?:Y{_NUMBER})?)")
_TOOL = re.compile(r"T(\d{1,6})((?:[A-Z][+-]?[.\d]*)*)")
_TOOL_DIAMETER = re.compile(r"C([.\d]+)")
_REPEAT = re.compile(r"R(\d+)")
#: Excellon, CNC-7: reset hit counters, cutter distances and clocks of the machine. R,T resets the tools.
_COUNTERS = {"R,H", "R,D", "R,C", "R,CP", "R,CR"}
#: G93 that sets the program zero to the current zero.
_NO_ZERO_SET = re.compile(r"G93(?:X[+-]?0*\.?0*)?(?:Y[+-]?0*\.?0*)?")
_FORMAT_COMMENT = re.compile(
    r";\s*FORMAT=\{(\d):(\d)\s*/[^/]*/[^/]*/\s*(suppress leading|suppress trailing|keep)?", re.I
)
_GERBONARA_PLACE = re.compile(r"^.*?:(\d+) \"(.*?)\": (.*)$", re.DOTALL)
#: Warnings of gerbonara that do not affect the holes.
_HARMLESS = re.compile(
    r"header statement found|implicit number format|intended for CAM tools|in the middle of the file"
    r"|M30 statement found|end of program statement"
)

#: Tool number that replaces T0 with a diameter, because gerbonara reads T0 as the end of the job.
_TOOL_ZERO = 1_000_000


@dataclass
class _TranslatedCommands:
    lines: list[str] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    digits: tuple[int | None, int | None] = (None, None)
    zeros: str = "leading"
    has_format: bool = False
    has_plain_integers: bool = False
    metric: bool | None = None
    tools: set[str] = field(default_factory=set)

    def add(self, line: str, number: int) -> None:
        self.lines.append(line)
        self.numbers.append(number)


class EmptyDrillFile(ReadError):
    """A drill file is complete, but has no tools and holes.

    KiCad writes such a file for a board without unplated holes.
    """


def read_excellon(source: Source, options: ReadOptions) -> Part:
    """Read the holes and slots of a drill file, in mm. The layer of a hole or slot is the name of its tool (``T1``).

    Raises
    ------
    ReadError
        A command is unknown, a coordinate is ambiguous, or the file has no holes and slots.
    EmptyDrillFile
        The file has no holes, slots or tools.
    """
    prepared = _translate_commands(source, options.units)
    issues: list[Issue] = []
    _check_complete(source, prepared, issues)
    parser = _parse_commands(source, prepared, issues)
    own_units = _unit_name(parser.settings.unit)
    holes, slots = _holes_and_slots(source, parser, options, issues)
    kept, selection_issues = select_holes(holes, options)
    if not kept and not slots:
        tools = ", ".join(f"T{n}" for n in sorted(parser.tools)) or Message("none")
        reasons = Message.joined("; ", (i.message for i in (*issues, *selection_issues)))
        message = Message(
            "the file has no holes: {} (tools: {})", reasons or Message("no coordinates follow the header"), tools
        )
        raise ReadError(source.path, message) if reasons or parser.tools else EmptyDrillFile(source.path, message)
    units = options.units or own_units
    part = Part(source.name, kept, tuple(slots), source=source.file_name, format="excellon", units=units or "mm")
    if units is None:
        issues.append(unknown_units_issue(Message("the file"), part, Severity.WARNING))
    if prepared.has_plain_integers and not prepared.has_format:
        issues.append(_assumed_format_issue(part, prepared.metric))
    if prepared.has_plain_integers and (narrow := _coordinate_format_issue(holes)):
        issues.append(narrow)
    return replace(part, issues=(*issues, *selection_issues))


def _assumed_format_issue(part: Part, metric: bool | None) -> Issue:
    left, low, right, high = part.extents
    form = "000.000" if metric else "00.0000"
    return Issue(
        "L102",
        Message(
            "coordinates have no decimal point and the file gives no format; with the usual {} the holes span "
            "{:g} × {:g} mm",
            form,
            right - left,
            high - low,
        ),
    )


def _coordinate_format_issue(holes: list[Hole]) -> Issue | None:
    """Warn if all holes fit inside the largest hole, because the coordinate format is then wrong."""
    positions = {(hole.x, hole.y) for hole in holes}
    if len(positions) < 2:
        return None
    (left, low), (right, high) = (tuple(pick(values) for values in zip(*positions, strict=True)) for pick in (min, max))
    widest = max(hole.diameter for hole in holes)
    if max(right - left, high - low) >= widest:
        return None
    return Issue(
        "L102",
        Message(
            "{} holes span {:.3g} × {:.3g} mm, less than the diameter of the largest, {:g} mm, which is "
            "implausible; export the file with decimal points",
            len(positions),
            right - left,
            high - low,
            widest,
        ),
    )


def _translate_commands(source: Source, units: str | None) -> _TranslatedCommands:
    max_holes = FREE_COPIES + COPIES_PER_BYTE * len(source.data)
    reason = Message(
        "repeats (R) expand to more than {:,} holes, too many for a file of {}; use fewer repeats, or split the file",
        max_holes,
        file_size_text(source),
    )
    prepared, repeats = _TranslatedCommands(), ReadBudget(source.path, max_holes, reason)
    in_header = False
    for number, raw in enumerate(source.text().splitlines(), 1):
        line = raw.strip()
        if line.startswith(";"):
            _translate_comment(prepared, line, number)
            continue
        line = "".join(line.split()).upper()
        if len(line) > MAX_COMMAND:
            raise ReadError(source.path, Message("'{}' is not an Excellon command", printable(line, 30)), number)
        if line == "M48":
            in_header = True
        elif line in ("%", "M95"):
            in_header = False
        if line and not line.startswith("M47"):  # M47 shows a message to the operator
            _translate_command(source, prepared, line, number, in_header)
            if match := _REPEAT.match(line):
                repeats(int(match.group(1)))
    if "M48" not in prepared.lines and next((x for x in prepared.lines if x[0] != ";"), "") != "%":
        prepared.lines.insert(0, "%")
        prepared.numbers.insert(0, 1)
    if prepared.metric is None and units in _DIGITS:
        prepared.metric = units == "mm"
        prepared.digits = _DIGITS[units] if prepared.digits == (None, None) else prepared.digits
    if prepared.has_plain_integers and not prepared.has_format and prepared.metric:
        prepared.digits = _DIGITS["mm"]
    return prepared


def _check_complete(source: Source, prepared: _TranslatedCommands, issues: list[Issue]) -> None:
    last = next((i for i in reversed(range(len(prepared.lines))) if prepared.lines[i][0] != ";"), None)
    if last is None or prepared.lines[last] in ("M30", "M00"):
        return
    if prepared.lines[last][0] in "XYG" and not source.data.endswith((b"\n", b"\r")):
        # Half a number is still a number: the hole would be in the wrong position.
        reason = Message("the file is incomplete: its last line is truncated; export or send it again")
        raise ReadError(source.path, reason, prepared.numbers[last])
    issues.append(Issue("L101", Message("the file does not end with M30, so it may be incomplete and lack holes")))


def _translate_comment(prepared: _TranslatedCommands, line: str, number: int) -> None:
    if match := _FORMAT_COMMENT.match(line[:MAX_COMMAND]):
        prepared.digits = int(match.group(1)), int(match.group(2))
        prepared.has_format = True
        if match.group(3):
            prepared.zeros = "trailing" if match.group(3).lower() == "suppress trailing" else "leading"
    if re.match(r";FILE_FORMAT=\d:\d|; Format\s*: \d", line):
        prepared.has_format = True
    if len(line) <= MAX_COMMAND:
        prepared.add(line, number)


def _translate_command(source: Source, prepared: _TranslatedCommands, line: str, number: int, in_header: bool) -> None:
    if re.match(r"G[0-5](?!\d)", line):
        line = f"G0{line[1:]}"
    if line == "G91":
        line = "ICI,ON"
    # A slash alone skips no words.
    if line in _COUNTERS or line == "/" or _NO_ZERO_SET.fullmatch(line):
        return
    if line.startswith("G93"):
        reason = Message(
            "'{}' moves the origin, but leafcut reads only drill files with a single origin; export "
            "the file without G93",
            printable(line),
        )
        raise ReadError(source.path, reason, number)
    if re.match(r"G0[23]", line):
        raise ReadError(
            source.path,
            Message("'{}' is a routed arc, but leafcut reads only holes and straight slots", printable(line)),
            number,
        )
    if match := re.fullmatch(r"(METRIC|M71|INCH|M72)(,.*)?", line):
        prepared.metric = match.group(1) in ("METRIC", "M71")
        prepared.has_format |= bool(re.search(r"0\.0", match.group(2) or ""))
    if match := _TOOL.fullmatch(line):
        _translate_tool(prepared, match, number, in_header)
        if len(prepared.tools) > MAX_TOOLS:
            raise ReadError(source.path, Message("more than {:,} tools; split the file", MAX_TOOLS), number)
        return
    coordinates = _COORDINATE.findall(line)
    prepared.has_plain_integers |= any("." not in word for word in coordinates) and line[0] in "XYG"
    if "G85" in line:
        match = _SLOT.fullmatch(line)
        if not match or not match.group(1) or not match.group(2):
            raise ReadError(
                source.path, Message("slot '{}' needs a start and an end: X Y G85 X Y", printable(line)), number
            )
        for word in (f"G00{match.group(1)}", "M15", f"G01{match.group(2)}", "M16", "G05"):
            prepared.add(word, number)
        return
    prepared.add(line, number)


def _translate_tool(prepared: _TranslatedCommands, match: re.Match[str], number: int, in_header: bool) -> None:
    """Add a tool. Its feeds and speeds are dropped, because they only apply to the machine of the file."""
    index, diameter = int(match.group(1)), _TOOL_DIAMETER.search(match.group(2))
    name = f"T{index or _TOOL_ZERO}"
    if not diameter and name not in prepared.tools:
        name = f"T{index}"
    if diameter:
        prepared.tools.add(name)
        # One or two digits without a point are a size in whole units; gerbonara would apply the coordinate format.
        text = diameter.group(1)
        prepared.add(f"{name}C{text}{'.' if '.' not in text and len(text) <= 2 else ''}", number)
    if not diameter or not in_header:
        prepared.add(name, number)


def _parse_commands(source: Source, prepared: _TranslatedCommands, issues: list[Issue]) -> Any:
    from gerbonara.cam import FileSettings
    from gerbonara.excellon import ExcellonParser

    parser = ExcellonParser(FileSettings(number_format=prepared.digits, zeros=prepared.zeros))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            parser.do_parse("\n".join(prepared.lines), filename="drill file")
        except (SyntaxError, ValueError) as problem:
            line, text, reason = _locate_error(str(problem), prepared)
            raise ReadError(source.path, Message("'{}': {}", printable(text), _error_reason(reason)), line) from None
    for warning in caught:
        message = str(warning.message)
        if issubclass(warning.category, DeprecationWarning) or _HARMLESS.search(message):
            continue
        line, text, reason = _locate_error(message, prepared)
        if "first tool definition" in reason or "Bare coordinate" in reason:
            raise ReadError(source.path, Message("'{}' comes before any tool is selected", printable(text)), line)
        issues.append(
            Issue(
                "L101",
                Message("'{}': {}", printable(text), printable(reason, 100)),
                Message("{}:{}", source.file_name, line),
            )
        )
    if _TOOL_ZERO in parser.tools:
        parser.tools[0] = parser.tools.pop(_TOOL_ZERO)
    return parser


def _locate_error(message: str, prepared: _TranslatedCommands) -> tuple[int | None, str, str]:
    """Locate a gerbonara error.

    Returns
    -------
    int or None
        The line of the file.
    str
        The command.
    str
        The reason for the error.
    """
    match = _GERBONARA_PLACE.match(message)
    if match is None:
        return None, "", message
    row = int(match.group(1)) - 1
    return prepared.numbers[row] if 0 <= row < len(prepared.numbers) else None, match.group(2), match.group(3)


def _error_reason(text: str) -> str:
    if "No number format" in text or "NoneType" in text:
        return Message(
            "the number has no decimal point, and the file does not state its position (METRIC or INCH is missing); "
            "give --units in (format 00.0000) or --units mm (000.000)"
        )
    if "Unknown excellon statement" in text:
        return Message(
            "unknown Excellon command; export only drills: header M48, tools with a C size, and coordinates X Y"
        )
    return printable(text, 100)


def _unit_name(unit: Any) -> str | None:
    return None if unit is None else {"mm": "mm", "in": "in"}[unit.shorthand]


def _holes_and_slots(
    source: Source, parser: Any, options: ReadOptions, issues: list[Issue]
) -> tuple[list[Hole], list[Slot]]:
    chosen = layer_filter(options.layers)
    names = {id(tool): f"T{number}" for number, tool in parser.tools.items()}
    holes: list[Hole] = []
    slots: list[Slot] = []
    out_of_range = hidden = 0
    for item in parser.objects:
        layer = names.get(id(item.tool), "")
        factor = drawing_unit_mm(options, _unit_name(item.unit))
        width = round((item.tool.diameter or 0.0) * drawing_unit_mm(options, _unit_name(item.tool.unit)), 6)
        numbers = (item.x1, item.y1, item.x2, item.y2) if hasattr(item, "x1") else (item.x, item.y)
        ends = [round(v * factor, 6) for v in numbers]
        if not all(abs(v) <= MAX_COORDINATE for v in (*ends, width)):
            out_of_range += 1
        elif not chosen(layer):
            hidden += 1
        elif ends[:2] == ends[2:] or len(ends) == 2:
            holes.append(Hole(ends[0], ends[1], width, layer))
        else:
            slots.append(Slot((ends[0], ends[1]), (ends[2], ends[3]), width, layer))
        if len(holes) > MAX_HOLES:
            raise too_many_holes_error(source.path)
    if out_of_range:
        message = Message(
            "{} with coordinates or diameter out of range will not be drilled", count_of(out_of_range, "hole")
        )
        issues.append(Issue("L203", message, missing=MissingWork("hole", out_of_range)))
    if hidden:
        message = Message("left out {} of tools that are not selected", count_of(hidden, "hole"))
        issues.append(Issue("L204", message, severity=Severity.NOTE))
    return holes, slots
