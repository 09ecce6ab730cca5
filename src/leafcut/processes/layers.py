"""Decide for each layer of a drawing whether it is cut, marked, ignored, or contains the outline of the sheet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from leafcut.errors import printable
from leafcut.message import Message
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.options import SheetOptions
from leafcut.options.drawings import MARK_NAMES, SHEET_NAMES


def contour_kinds(contours: Sequence[Contour], options: SheetOptions, issues: list[Issue]) -> list[str]:
    """Return the kind of each contour: ``cut``, ``mark``, ``sheet``, ``maybe sheet``, or "" for a contour to ignore.

    ``maybe sheet`` means that only the layer name suggests the outline of the sheet. If the drawing states a kind, only
    an option can override it. Texts on mark layers are marked, and all other texts are ignored.
    """
    names = {c.layer for c in contours}
    by_option = {name: _kind_by_option(name, options) for name in names}
    known = [by_option[c.layer] or (c.kind if c.kind != "cut" else "") for c in contours]
    by_name = layer_matcher(MARK_NAMES)
    if not options.mark_layers and any(not k and not by_name(c.layer) for k, c in zip(known, contours, strict=True)):
        marks = {c.layer for k, c in zip(known, contours, strict=True) if k in ("", "text") and by_name(c.layer)}
        known = ["mark" if k in ("", "text") and c.layer in marks else k for k, c in zip(known, contours, strict=True)]
        if marks:
            message = Message(
                "these layers are marked, not cut, because of their names: {}; set --mark-layers to change that",
                _join_names(marks),
            )
            issues.append(Issue("L421", message, severity=Severity.NOTE))
    if not options.sheet_layers and "sheet" not in known:
        is_sheet_name = layer_matcher(SHEET_NAMES)
        known = [k or ("maybe sheet" if is_sheet_name(c.layer) else "") for k, c in zip(known, contours, strict=True)]
    ignored = Counter(c.layer for k, c in zip(known, contours, strict=True) if k == "ignore" and c.kind != "text")
    if ignored:
        layers = Message.joined(
            ", ", (Message("{} on layer {}", number, name) for name, number in ignored.most_common(5))
        )
        issues.append(Issue("L211", Message("the program does not cut {}", layers), severity=Severity.NOTE))
    kinds = ["" if k == "ignore" else k or "cut" for k in known]
    return _resolve_text_kinds(contours, kinds, issues)


def _resolve_text_kinds(contours: Sequence[Contour], kinds: list[str], issues: list[Issue]) -> list[str]:
    """Decide which texts are marked, and return the kinds of all contours.

    A text is marked if it is on a mark layer and its font has strokes. All other texts are ignored.
    """
    texts = [k for k, c in enumerate(contours) if c.kind == "text"]
    failed = {contours[k].handle: contours[k] for k in texts if contours[k].name and kinds[k] == "mark"}
    left_out = Counter({contours[k].handle: contours[k].layer for k in texts if kinds[k] != "mark"}.values())
    for text in failed.values():
        x, y = text.path.start
        message = Message("a text on layer {} is not engraved: {}; draw it as lines", printable(text.layer), text.name)
        issues.append(
            Issue("L216", message, Message("at ({:g}, {:g})", x, y), missing=MissingWork("text", 1, ((x, y),)))
        )
    if left_out:
        layers = Message.joined(
            ", ", (Message("{} on layer {}", number, printable(name)) for name, number in left_out.most_common(5))
        )
        message = Message("texts are engraved only on mark layers; the program leaves out {}", layers)
        issues.append(Issue("L210", message, severity=Severity.NOTE))
    text_numbers = set(texts)
    return [
        kind if k not in text_numbers else "mark" if kind == "mark" and not contours[k].name else ""
        for k, kind in enumerate(kinds)
    ]


def _kind_by_option(layer: str, options: SheetOptions) -> str:
    for patterns, kind in (
        (options.ignore_layers, "ignore"),
        (options.sheet_layers, "sheet"),
        (options.mark_layers, "mark"),
        (options.cut_layers, "cut"),
    ):
        if layer_matcher(patterns)(layer):
            return kind
    return "ignore" if options.cut_layers else ""


def _join_names(names: set[str]) -> str:
    first = sorted(names)[:5]
    return ", ".join(first) + (" …" if len(names) > 5 else "")
