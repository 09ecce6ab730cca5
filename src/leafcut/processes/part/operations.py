"""Read the --operations file, and assign the contours of a drawing to the rules in this file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

from leafcut.errors import DataError, OptionError, PlanError, closest_names, name_suggestion, printable
from leafcut.files.schemas import OPERATIONS
from leafcut.files.toml_table import TomlTable
from leafcut.files.whole_files import key_place, parse_toml, read_toml_text
from leafcut.geometry.arrays import Point
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.part import Part
from leafcut.options import SheetOptions
from leafcut.units import parse_quantity


class Operation(StrEnum):
    """An operation that a layer can have."""

    PROFILE = "profile"
    BORE = "bore"
    ENGRAVE = "engrave"
    POCKET = "pocket"
    CHAMFER = "chamfer"
    VCARVE = "vcarve"
    IGNORE = "ignore"


#: Operations that mill through the plate. Their edges may have a chamfer.
_THROUGH = (Operation.PROFILE, Operation.BORE)
#: Operations on the top face that have a depth. Their rules may name a tool.
_DEEP = (Operation.ENGRAVE, Operation.POCKET)
#: Operations of a V-bit. Their rules must name it.
CARVED = (Operation.CHAMFER, Operation.VCARVE)
#: Pattern for an operation with its depth and tools, such as ``engrave 0.3mm T5``, ``pocket 3mm T5 rest T6`` or
#: ``vcarve 2mm T6 flat T5``.
_RULE = re.compile(
    r"(?P<word>\S+)(?:\s+(?P<depth>[^T\s].*?))?"
    r"(?:\s+T(?P<tool>\d{1,8})(?:\s+rest\s+T(?P<rest>\d{1,8})|\s+flat\s+T(?P<flat>\d{1,8}))?)?"
)
_WILDCARDS = re.compile(r"[*?\[]")
#: Minimum depth, mm. It must exceed the tolerance for heights in the program.
_SHALLOWEST = 0.01


@dataclass(frozen=True)
class LayerRule:
    """A rule that assigns an operation to a layer.

    The layer name may contain wildcards. The depth is in mm, and 0 means through the plate. For a chamfer, it is the
    width. For V-carving, it is the maximum depth, and 0 means that none is given. `place` is the position of the rule
    in the file. `chamfer` is the rule for the edges of this operation. In a pocket, the tool `rest` clears the places
    that `tool` cannot reach. In V-carving, the tool `flat` clears the floor at the maximum depth.
    """

    layer: str
    operation: Operation
    depth: float = 0.0
    tool: int | None = None
    place: str = field(default="", compare=False)
    chamfer: LayerRule | None = None
    rest: int | None = None
    flat: int | None = None

    @property
    def is_exact(self) -> bool:
        """Whether the name contains no wildcards."""
        return not _WILDCARDS.search(self.layer)


@dataclass(frozen=True, eq=False)
class LayeredPart:
    """A drawing divided by operation.

    Attributes
    ----------
    edges
        The contours of profiles and bores.
    faces
        The contours of pockets, engravings, chamfers and V-carving, grouped by rule.
    rules
        The rule of each layer.
    """

    edges: Part
    faces: tuple[tuple[LayerRule, tuple[Contour, ...]], ...] = ()
    rules: dict[str, LayerRule] = field(default_factory=dict)

    def operation(self, layer: str) -> Operation | None:
        """Return the operation of a layer, or None if there are no rules."""
        rule = self.rules.get(layer)
        return None if rule is None else rule.operation

    def faces_of(self, operation: Operation) -> list[tuple[LayerRule, tuple[Contour, ...]]]:
        """Return all rules that use an operation, with the contours of each rule."""
        return [face for face in self.faces if face[0].operation is operation]


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
        raise DataError(
            '{}: no layer has an operation; write a table [layer] with lines such as "CUT" = "profile"', path
        )
    return tuple(_rule(name, value, key_place(path, text, "layer", name)) for name, value in table.items())


def _rule(layer: str, value: object, place: str) -> LayerRule:
    """Parse an operation, such as ``engrave 0.3mm T5`` or ``profile + chamfer 0.5mm T6``."""
    first, *more = value.split("+") if isinstance(value, str) else [value]
    rule, *chamfers = (_single_rule(layer, text, place) for text in (first, *more))
    if rule.operation is Operation.CHAMFER:
        raise DataError(
            "{}: 'chamfer' needs the operation that mills the edge; write 'profile + chamfer 0.5mm T6'", place
        )
    if not chamfers:
        return rule
    if rule.operation not in _THROUGH or [one.operation for one in chamfers] != [Operation.CHAMFER]:
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
    takes_depth = operation in (*_DEEP, *CARVED)
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
    first, rest, flat = (int(match[name]) if match[name] else None for name in ("tool", "rest", "flat"))
    return LayerRule(layer, operation, _depth(depth, place) if depth else 0.0, first, place, rest=rest, flat=flat)


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


def divide_by_layer(
    part: Part, rules: Sequence[LayerRule], file: Path, thickness: float, options: SheetOptions
) -> LayeredPart:
    """Divide a drawing according to the rules of an operations `file`.

    Raises
    ------
    PlanError
        A layer of the drawing matches no rule or several rules, a rule matches no shape, or a depth exceeds the
        thickness of the plate.
    """
    for rule in rules:
        if rule.depth >= thickness:
            raise PlanError(
                "{}: a depth of {:g} mm goes through the plate of {:g} mm; give a smaller depth, or 'profile'",
                rule.place,
                rule.depth,
                thickness,
            )
    is_sheet = layer_matcher(options.sheet_layers)
    layers = list(dict.fromkeys(contour.layer for contour in part.contours))
    for rule in rules:
        if rule.is_exact and rule.layer.lower() not in (layer.lower() for layer in layers):
            known = name_suggestion(rule.layer, [printable(layer) for layer in layers])
            raise PlanError("{}: no shape of {} is on layer '{}'{}", rule.place, _name(part), rule.layer, known)
    rule_of = rules_by_layer(part, rules, file, options)

    def on(rule: LayerRule) -> tuple[Contour, ...]:
        return tuple(contour for contour in part.contours if rule_of.get(contour.layer) is rule)

    edges = tuple(c for c in part.contours if is_sheet(c.layer) or rule_of[c.layer].operation in _THROUGH)
    faces = tuple(
        (rule.chamfer or rule, on(rule)) for rule in rules if rule.chamfer or rule.operation in (*_DEEP, *CARVED)
    )
    return LayeredPart(replace(part, contours=edges), tuple(face for face in faces if face[1]), rule_of)


def rules_by_layer(part: Part, rules: Sequence[LayerRule], file: Path, options: SheetOptions) -> dict[str, LayerRule]:
    """Return the rule of each layer of a drawing except the layers of the sheet.

    Raises PlanError if no rule of the operations `file`, or more than one, matches a layer.
    """
    is_sheet = layer_matcher(options.sheet_layers)
    layers = dict.fromkeys(contour.layer for contour in part.contours)
    return {layer: _rule_for(layer, rules, file, part) for layer in layers if not is_sheet(layer)}


def _rule_for(layer: str, rules: Sequence[LayerRule], file: Path, part: Part) -> LayerRule:
    """Return the rule that matches a layer.

    An exact name takes precedence over wildcards, even if it contains brackets.
    """
    matching = [rule for rule in rules if rule.layer.lower() == layer.lower()]
    matching = matching or [rule for rule in rules if not rule.is_exact and layer_matcher((rule.layer,))(layer)]
    if not matching:
        raise PlanError(
            '{}: layer \'{}\' of {} has no operation; add "{}" = "ignore" or another operation',
            file,
            printable(layer),
            _name(part),
            printable(layer),
        )
    if len(matching) > 1:
        raise PlanError(
            "{}: layer '{}' is already named by '{}' ({}); leave out one of them",
            matching[1].place,
            printable(layer),
            matching[0].layer,
            matching[0].place,
        )
    return matching[0]


def edge_options(divided: LayeredPart, options: SheetOptions) -> SheetOptions:
    """Return options that select only the layers of profiles and bores for cutting."""
    names = tuple(_WILDCARDS.sub(r"[\g<0>]", layer) for layer in dict.fromkeys(c.layer for c in divided.edges.contours))
    return replace(options, cut_layers=names, mark_layers=(), ignore_layers=(), open_paths="refuse")


def open_shape(rule: LayerRule, contour: Contour) -> PlanError:
    """Create the error for an open contour on a layer whose operation requires closed shapes."""
    (x0, y0), (x1, y1) = contour.path.start, contour.path.end
    return PlanError(
        "{}: '{}' needs closed shapes, but layer '{}' has an open path from ({:g}, {:g}) to ({:g}, {:g})",
        rule.place,
        rule.operation,
        printable(contour.layer),
        x0,
        y0,
        x1,
        y1,
    )


def not_a_bore(rule: LayerRule, place: Point, *, is_round: bool) -> PlanError:
    """Create the error for a shape on a bore layer that is not round or that contains another shape."""
    x, y = place
    if is_round:
        return PlanError("{}: the bore at ({:g}, {:g}) has another shape inside; use 'profile'", rule.place, x, y)
    return PlanError(
        "{}: the shape at ({:g}, {:g}) is not round, so it cannot be a bore; use 'profile'", rule.place, x, y
    )


def _name(part: Part) -> str:
    return part.source or part.name
