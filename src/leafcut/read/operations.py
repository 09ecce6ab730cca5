"""Read and change the --operations file: a TOML file that assigns an operation to each layer of a drawing."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, OptionError, PlanError, closest_names, name_suggestion, printable
from leafcut.files.schemas import OPERATIONS
from leafcut.files.toml_table import TomlTable
from leafcut.files.whole_files import key_place, parse_toml, read_toml_text
from leafcut.model.contour import layer_matcher
from leafcut.model.tool import CONES, MILLS, Tool, ToolKind, ToolLibrary
from leafcut.units import parse_quantity


class Operation(StrEnum):
    """An operation that a layer can have."""

    PROFILE = "profile"
    BORE = "bore"
    ENGRAVE = "engrave"
    POCKET = "pocket"
    CHAMFER = "chamfer"
    VCARVE = "vcarve"
    ISOLATE = "isolate"
    IGNORE = "ignore"


#: Operations that mill through the plate. Their edges may have a chamfer.
THROUGH = (Operation.PROFILE, Operation.BORE)
#: Operations on the top face that have a depth. Their rules may name a tool.
DEEP = (Operation.ENGRAVE, Operation.POCKET, Operation.ISOLATE)
#: Operations of a V-bit. Their rules must name it.
CARVED = (Operation.CHAMFER, Operation.VCARVE)
#: Pattern for an operation with its depth and tools, such as ``engrave 0.3mm T5``, ``pocket 3mm T5 rest T6``,
#: ``vcarve 2mm T6 flat T5`` or ``isolate 0.1mm T6 passes 2``.
_RULE = re.compile(
    r"(?P<word>\S+)(?:\s+(?P<depth>[^T\s].*?))?"
    r"(?:\s+T(?P<tool>\d{1,8})(?:\s+rest\s+T(?P<rest>\d{1,8})|\s+flat\s+T(?P<flat>\d{1,8}))?)?"
    r"(?:\s+passes\s+(?P<passes>[1-9]))?"
)
WILDCARDS = re.compile(r"[*?\[]")
#: Minimum depth, mm. It must exceed the tolerance for heights in the program.
_SHALLOWEST = 0.01


@dataclass(frozen=True)
class LayerRule:
    """A rule that assigns an operation to a layer.

    The layer name may contain wildcards. The depth is in mm, and 0 means through the plate. For a chamfer, it is the
    width. For V-carving, it is the maximum depth, and 0 means that none is given. `place` is the position of the rule
    in the file. `chamfer` is the rule for the edges of this operation. In a pocket, the tool `rest` clears the places
    that `tool` cannot reach. In V-carving, the tool `flat` clears the floor at the maximum depth. `passes` is the
    number of passes side by side of an isolation.
    """

    layer: str
    operation: Operation
    depth: float = 0.0
    tool: int | None = None
    place: str = field(default="", compare=False)
    chamfer: LayerRule | None = None
    rest: int | None = None
    flat: int | None = None
    passes: int = 1

    @property
    def is_exact(self) -> bool:
        """Whether the name contains no wildcards."""
        return not WILDCARDS.search(self.layer)


def read_operations(path: Path) -> tuple[LayerRule, ...]:
    """Read the rules from an operations file.

    Raises
    ------
    OptionError
        The file does not exist.
    DataError
        The file is invalid. The message gives the line.
    """
    text = read_toml_text(path)
    tables = parse_toml(text, str(path), OPERATIONS)
    for key in tables:
        if key != "layer" and not closest_names(key, ["layer"]):
            raise DataError(
                '{}: unknown key \'{}\'; write a table [layer] with lines such as "POCKET" = "pocket 3mm"',
                key_place(path, text, "", key),
                printable(key),
            )
    try:
        table = TomlTable(tables, "", ["layer"]).values.get("layer")
    except DataError as problem:
        raise DataError("{}: {}", key_place(path, text, problem.table, problem.key), problem) from None
    if not isinstance(table, dict) or not table:
        raise _no_operation(path)
    return tuple(parse_rule(name, value, key_place(path, text, "layer", name)) for name, value in table.items())


def _no_operation(place: object) -> DataError:
    return DataError('{}: no layer has an operation; write a table [layer] with lines such as "CUT" = "profile"', place)


def parse_rule(layer: str, value: object, place: str) -> LayerRule:
    """Parse an operation, such as ``engrave 0.3mm T5`` or ``profile + chamfer 0.5mm T6``."""
    first, *more = value.split("+") if isinstance(value, str) else [value]
    rule, *chamfers = (_single_rule(layer, text, place) for text in (first, *more))
    if rule.operation is Operation.CHAMFER:
        raise DataError(
            "{}: 'chamfer' needs the operation that mills the edge; write 'profile + chamfer 0.5mm T6'", place
        )
    if not chamfers:
        return rule
    if rule.operation not in THROUGH or [one.operation for one in chamfers] != [Operation.CHAMFER]:
        raise DataError(
            "{}: '{}' cannot be combined; only 'profile' or 'bore' may have one '+ chamfer 0.5mm T6'",
            place,
            printable(str(value)),
        )
    return replace(rule, chamfer=chamfers[0])


def _single_rule(layer: str, value: object, place: str) -> LayerRule:
    match = _RULE.fullmatch(value.strip()) if isinstance(value, str) and value.isprintable() else None
    if match is None:
        raise DataError(
            "{}: '{}' is not an operation; write a text such as 'profile' or 'engrave 0.3mm T5'",
            place,
            printable(str(value)),
        )
    word, depth, tool = match["word"], match["depth"], match["tool"]
    if word not in list(Operation):
        raise DataError("{}: unknown operation '{}'{}", place, printable(word), name_suggestion(word[:80], Operation))
    operation = Operation(word)
    takes_depth = operation in (*DEEP, *CARVED)
    if tool and not takes_depth:
        raise DataError(
            "{}: '{}' takes no tool number, because the part's end mill is used; leave out T{}", place, word, tool
        )
    if depth and not takes_depth:
        raise DataError("{}: '{}' takes no depth; leave out '{}'", place, word, printable(depth))
    if (match["flat"] and not (operation is Operation.VCARVE and depth)) or "flat" in (depth or "").split():
        raise DataError(
            "{}: 'flat' is only for V-carving with a depth and an end mill, such as 'vcarve 2mm T6 flat T5'", place
        )
    if not tool and operation in CARVED:
        raise DataError("{}: '{}' needs a V-bit, such as '{} 0.5mm T6'", place, word, word)
    if not depth and takes_depth and operation is not Operation.VCARVE:
        raise DataError("{}: '{}' needs a depth, such as '{} 0.3mm'", place, word, word)
    if (match["rest"] and operation is not Operation.POCKET) or "rest" in (depth or "").split():
        raise DataError("{}: 'rest' is only for a pocket with two mills, such as 'pocket 3mm T5 rest T6'", place)
    if (match["passes"] and operation is not Operation.ISOLATE) or "passes" in (depth or "").split():
        raise DataError("{}: 'passes' is only for 'isolate', from 1 to 9, such as 'isolate 0.1mm T6 passes 2'", place)
    first, rest, flat = (int(match[name]) if match[name] else None for name in ("tool", "rest", "flat"))
    rule = LayerRule(layer, operation, _depth(depth, place) if depth else 0.0, first, place, rest=rest, flat=flat)
    return replace(rule, passes=int(match["passes"] or 1))


def _depth(text: str, place: str) -> float:
    try:
        depth = parse_quantity(text[:80], "mm")
    except OptionError as problem:
        raise DataError("{}: {}", place, str(problem)) from None
    if depth <= 0.0:
        raise DataError("{}: a depth of {:g} mm is not below the top; give a depth above 0", place, depth)
    if depth < _SHALLOWEST:
        raise DataError(
            "{}: a depth of {:g} mm is below the minimum of {:g} mm; give a larger depth", place, depth, _SHALLOWEST
        )
    return depth


@dataclass(frozen=True)
class RuleFields:
    """The parts of a rule as text, for a table. They may be incomplete or invalid.

    For a profile or a bore, `depth` and `tool` are the width and the V-bit of its chamfer. `second` is the number of
    the mill after ``rest`` or ``flat``, and `passes` the number of passes of an isolation.
    """

    operation: str = ""
    depth: str = ""
    tool: str = ""
    second: str = ""
    passes: str = ""

    @classmethod
    def split(cls, value: object) -> RuleFields:
        """Split the text of a rule."""
        first, _, chamfer = str(value).partition("+")
        match, edge = _RULE.fullmatch(first.strip()), _RULE.fullmatch(chamfer.strip())
        if match is None or (chamfer and (edge is None or edge["word"] != Operation.CHAMFER)):
            return cls(str(value))
        of_tool = edge or match
        second, passes = match["rest"] or match["flat"] or "", match["passes"] or ""
        return cls(match["word"], of_tool["depth"] or "", of_tool["tool"] or "", second, passes)

    def changed(self, **changes: str) -> RuleFields:
        """Return changed fields. A different operation keeps only the fields that have the same meaning."""
        after = replace(self, **changes)
        if after.operation == self.operation:
            return after
        kept = {self.operation, after.operation} <= set(DEEP)
        return RuleFields(after.operation, self.depth if kept else "", self.tool if kept else "")

    @property
    def text(self) -> str:
        """The text of the rule."""
        words = [self.depth, f"T{self.tool}" if self.tool else ""]
        if self.operation in THROUGH and any(words):
            return " ".join(filter(None, [self.operation, "+", Operation.CHAMFER, *words]))
        second = "flat" if self.operation == Operation.VCARVE else "rest"
        words += [f"{second} T{self.second}" if self.second else "", f"passes {self.passes}" if self.passes else ""]
        return " ".join(filter(None, [self.operation, *words]))


def rule_texts(text: str, place: str) -> dict[str, Any]:
    """Return the rule of each layer in the text of an operations file. Raises DataError if it is not valid."""
    table = parse_toml(text, place, OPERATIONS).get("layer", {})
    if not isinstance(table, dict):
        raise _no_operation(place)
    return table


def with_rule(text: str, layer: str, rule: str) -> str:
    """Return the text of an operations file with another rule for a layer, or without one if `rule` is empty.

    Everything else in the file is kept. The text is empty if no rule is left.
    """
    import tomlkit

    document = tomlkit.parse(text)
    table: Any = document.setdefault("layer", tomlkit.table())
    name = next((key for key in table if key.lower() == layer.lower()), layer)
    if rule:
        table[name] = rule
    else:
        table.pop(name, None)
    return tomlkit.dumps(document) if table else ""


def names_for(layer: str, names: Iterable[str]) -> list[str]:
    """Return the names in an operations file that match a layer.

    An exact name takes precedence over wildcards, even if it contains brackets.
    """
    exact = [name for name in names if name.lower() == layer.lower()]
    return exact or [name for name in names if WILDCARDS.search(name) and layer_matcher((name,))(layer)]


def check_depth(rule: LayerRule, thickness: float) -> None:
    """Raise PlanError if a depth exceeds the thickness of the plate, mm."""
    if rule.depth >= thickness:
        raise PlanError(
            "{}: a depth of {:g} mm goes through the plate of {:g} mm; give a smaller depth, or 'profile'",
            rule.place,
            rule.depth,
            thickness,
        )


def library_tool(rule: LayerRule, library: ToolLibrary | None) -> Tool:
    """Return the tool that a rule names. Raises OptionError or PlanError if the library has no such milling tool."""
    if library is None:
        raise OptionError("{}: T{} needs a tool library; give --tools", rule.place, rule.tool)
    tool = library.by_number.get(rule.tool or 0)
    if tool is None:
        raise OptionError("{}: {} has no T{}", rule.place, library.source, rule.tool)
    if rule.operation is Operation.POCKET and tool.kind is not ToolKind.END_MILL:
        raise PlanError("{}: {} is a {}, not an end mill", rule.place, tool.label, tool.kind.value)
    if tool.kind not in MILLS:
        raise PlanError("{}: {} is a {}, not a milling tool", rule.place, tool.label, tool.kind.value)
    return tool


def check_tool(rule: LayerRule, tool: Tool) -> None:
    """Raise PlanError if a tool is not a V-bit for a rule that needs one, or too short for its depth."""
    if rule.operation in CARVED:
        if tool.kind not in CONES:
            raise PlanError("{}: {} is not a V-bit or chamfer mill", rule.place, tool.label)
    elif rule.depth > tool.reach + 1e-9:
        raise PlanError(
            "{}: {} cuts {:g} mm deep at most, but {:g} mm are needed",
            rule.place,
            tool.label,
            tool.reach,
            rule.depth,
        )


def rules_with_tools(rule: LayerRule) -> list[LayerRule]:
    """Return a rule for each tool that a rule names: its own tool, and the end mill of the rest or of the floor."""
    rules = [rule]
    if rule.rest is not None:
        rules.append(replace(rule, tool=rule.rest))
    if rule.flat is not None:
        rules.append(replace(rule, tool=rule.flat, operation=Operation.POCKET))
    return rules
