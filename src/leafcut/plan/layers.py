"""Which layers of a drawing are cut, marked, the sheet itself, or left out."""

from __future__ import annotations

import fnmatch
import re
from collections import Counter
from collections.abc import Callable, Sequence

from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, Severity
from leafcut.options import SheetOptions

#: What layers are for by their names, where the user does not say.
MARK_NAMES = ("MARK*", "SCRIBE*", "ENGRAV*", "ETCH*")
SHEET_NAMES = ("SHEET*", "PLATE*", "STOCK*")


def matcher(patterns: Sequence[str]) -> Callable[[str], bool]:
    """Return the test whether a layer's name fits one of the patterns: * and ?, upper and lower case alike."""
    tests = [re.compile(fnmatch.translate(p), re.IGNORECASE) for p in patterns]
    return lambda layer: any(t.match(layer) for t in tests)


def kinds_of(contours: Sequence[Contour], options: SheetOptions, issues: list[Issue]) -> list[str]:
    """Return the kind of every contour: ``cut``, ``mark``, ``sheet``, ``maybe sheet`` or empty for what is left out.

    ``maybe sheet`` is what only its layer's name says to be the sheet. What the drawing itself says of a contour holds
    unless an option says otherwise.
    """
    names = {c.layer for c in contours}
    said = {name: _said(name, options) for name in names}
    known = [said[c.layer] or (c.kind if c.kind != "cut" else "") for c in contours]
    by_name = matcher(MARK_NAMES)
    if not options.mark_layers and any(not k and not by_name(c.layer) for k, c in zip(known, contours, strict=True)):
        marks = {c.layer for k, c in zip(known, contours, strict=True) if not k and by_name(c.layer)}
        known = [k or ("mark" if c.layer in marks else "") for k, c in zip(known, contours, strict=True)]
        if marks:
            message = f"marked, not cut, by the name of the layer: {_listed(marks)}; --mark-layers says otherwise"
            issues.append(Issue("L421", message, severity=Severity.NOTE))
    if not options.sheet_layers and "sheet" not in known:
        maybe = matcher(SHEET_NAMES)
        known = [k or ("maybe sheet" if maybe(c.layer) else "") for k, c in zip(known, contours, strict=True)]
    left = Counter(c.layer for k, c in zip(known, contours, strict=True) if k == "ignore")
    if left:
        words = ", ".join(f"{number} on layer {name}" for name, number in left.most_common(5))
        issues.append(Issue("L211", f"not cut: {words}", severity=Severity.NOTE))
    return ["" if k == "ignore" else k or "cut" for k in known]


def _said(layer: str, options: SheetOptions) -> str:
    """Return what the options say of a layer, or empty."""
    for patterns, kind in (
        (options.ignore_layers, "ignore"),
        (options.sheet_layers, "sheet"),
        (options.mark_layers, "mark"),
        (options.cut_layers, "cut"),
    ):
        if matcher(patterns)(layer):
            return kind
    return "ignore" if options.cut_layers else ""


def _listed(names: set[str]) -> str:
    first = sorted(names)[:5]
    return ", ".join(first) + (" …" if len(names) > 5 else "")
