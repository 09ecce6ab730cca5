"""Assign the contours of a drawing to the rules in its --operations file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from leafcut.errors import PlanError, name_suggestion, printable
from leafcut.geometry.arrays import Point
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.part import Part
from leafcut.options import SheetOptions
from leafcut.read.operations import CARVED, DEEP, THROUGH, WILDCARDS, LayerRule, Operation, check_depth, names_for


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
        check_depth(rule, thickness)
    is_sheet = layer_matcher(options.sheet_layers)
    layers = list(dict.fromkeys(contour.layer for contour in part.contours))
    for rule in rules:
        if rule.is_exact and rule.layer.lower() not in (layer.lower() for layer in layers):
            known = name_suggestion(rule.layer, [printable(layer) for layer in layers])
            raise PlanError("{}: no shape of {} is on layer '{}'{}", rule.place, _name(part), rule.layer, known)
    rule_of = rules_by_layer(part, rules, file, options)

    def on(rule: LayerRule) -> tuple[Contour, ...]:
        return tuple(contour for contour in part.contours if rule_of.get(contour.layer) is rule)

    edges = tuple(c for c in part.contours if is_sheet(c.layer) or rule_of[c.layer].operation in THROUGH)
    faces = tuple(
        (rule.chamfer or rule, on(rule)) for rule in rules if rule.chamfer or rule.operation in (*DEEP, *CARVED)
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
    """Return the rule that matches a layer."""
    by_name = {rule.layer: rule for rule in rules}
    matching = [by_name[name] for name in names_for(layer, by_name)]
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
    names = tuple(WILDCARDS.sub(r"[\g<0>]", layer) for layer in dict.fromkeys(c.layer for c in divided.edges.contours))
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
