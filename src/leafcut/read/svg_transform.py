"""Parse SVG attributes: lengths, transforms, the view box, styles. Invalid values raise an error."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from leafcut.message import Message

#: User units (1/96 inch) per unit (CSS Values and Units 3, section 6.2).
PX_PER_UNIT = {"": 1.0, "px": 1.0, "in": 96.0, "mm": 96.0 / 25.4, "cm": 960.0 / 25.4, "q": 24.0 / 25.4, "pt": 4.0 / 3.0}
PX_PER_UNIT["pc"] = 16.0
#: Units that state the physical size of the drawing.
PHYSICAL = ("in", "mm", "cm", "q", "pt", "pc")

# These expressions cannot backtrack far, so a hostile file cannot stall the reader.
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*([a-zA-Z]*|%)")
_NEXT_NUMBER = re.compile(rf"[\s,]*({_NUMBER})")
_FUNCTION = re.compile(r"[\s,]*([a-zA-Z]+)\s*\(([^()]*)\)")
_CLASS = re.compile(r"\w*\.([\w-]+)")
#: Maximum number of characters of a length or view box, because each copy of a `use` parses them again.
_LONGEST = 200


class Affine(NamedTuple):
    """The transform x' = a·x + c·y + e, y' = b·x + d·y + f, as in SVG's matrix(a b c d e f)."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def after(self, inner: Affine) -> Affine:
        """Combine two transforms. The result applies `inner` first, and then this transform."""
        x, y = self.transform_point(inner.e, inner.f)
        return Affine(*self.transform_direction(inner.a, inner.b), *self.transform_direction(inner.c, inner.d), x, y)

    def transform_direction(self, x: float, y: float) -> tuple[float, float]:
        """Transform a direction."""
        return (self.a * x + self.c * y, self.b * x + self.d * y)

    def transform_point(self, x: float, y: float) -> tuple[float, float]:
        """Transform a point."""
        return (self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f)


def parse_numbers(text: str) -> list[float]:
    """Parse a list of numbers that are separated by commas or spaces. Raise ValueError for anything else."""
    values, position, text = [], 0, text.strip()
    while position < len(text):
        match = _NEXT_NUMBER.match(text, position)
        if match is None:
            raise ValueError(Message("'{}' is not a list of numbers", text[:40]))
        values.append(float(match.group(1)))
        position = match.end()
    if not all(math.isfinite(n) for n in values):
        raise ValueError(Message("a number that is not finite"))
    return values


def parse_length(text: str, reference: float) -> float:
    """Parse a length, and return it in user units. Percentages refer to the length `reference`."""
    value, unit = split_length(text)
    if unit == "%":
        return 0.01 * value * reference
    return value * PX_PER_UNIT[unit]


def split_length(text: str) -> tuple[float, str]:
    """Split a length into its number and its unit.

    Raise ValueError for invalid text, and for units that depend on a font.
    """
    match = _LENGTH.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    unit = match.group(2).lower() if match else "?"
    if match is None or (unit not in PX_PER_UNIT and unit != "%") or not math.isfinite(float(match.group(1))):
        raise ValueError(Message("'{}' is not a length", text[:20]))
    return float(match.group(1)), unit


def parse_transform(text: str) -> Affine:
    """Parse a transform attribute. Raise ValueError if the attribute is invalid."""
    result, position, text = Affine(), 0, text.strip()
    while position < len(text):
        match = _FUNCTION.match(text, position)
        if match is None:
            raise ValueError(Message("invalid transform '{}'", text[:40]))
        name, values = match.group(1), parse_numbers(match.group(2))
        result, position = result.after(_parse_transform_function(name, values)), match.end()
    return result


def _parse_transform_function(name: str, v: list[float]) -> Affine:
    count = len(v)
    if name == "matrix" and count == 6:
        return Affine(*v)
    if name == "translate" and count in (1, 2):
        return Affine(e=v[0], f=v[1] if count > 1 else 0.0)
    if name == "scale" and count in (1, 2):
        return Affine(a=v[0], d=v[-1])
    if name == "rotate" and count in (1, 3):
        cos, sin = math.cos(math.radians(v[0])), math.sin(math.radians(v[0]))
        x, y = (v[1], v[2]) if count > 1 else (0.0, 0.0)
        return Affine(e=x, f=y).after(Affine(cos, sin, -sin, cos)).after(Affine(e=-x, f=-y))
    if name in ("skewX", "skewY") and count == 1:
        tangent = math.tan(math.radians(v[0]))
        return Affine(c=tangent) if name == "skewX" else Affine(b=tangent)
    raise ValueError(Message("invalid transform '{}' with {} numbers", name, count))


def parse_view_box(text: str) -> list[float]:
    """Parse a view box. Raise ValueError if it is invalid."""
    if len(text) > _LONGEST:
        raise ValueError(Message("view box '{}'", f"{text[:20]} …"))
    return parse_numbers(text)


def viewport_transform(box: list[float], width: float, height: float, aspect: str) -> Affine:
    """Return the transform from a view box (x, y, width, height) to a viewport at the origin (SVG 1.1, section 7.8)."""
    x, y, w, h = box
    if not (w > 0.0 and h > 0.0):
        raise ValueError(Message("a view box without size"))
    sx, sy = width / w, height / h
    parts = aspect[:_LONGEST].split()
    align = parts[0] if parts else "xMidYMid"
    if align == "none":
        return Affine(sx, 0.0, 0.0, sy, -x * sx, -y * sy)
    scale = max(sx, sy) if "slice" in parts else min(sx, sy)
    shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
    across, down = shares.get(align[1:4], 0.5), shares.get(align[5:8], 0.5)
    return Affine(
        scale, 0.0, 0.0, scale, across * (width - w * scale) - x * scale, down * (height - h * scale) - y * scale
    )


def parse_style(style: str) -> dict[str, str]:
    """Parse the properties in a style attribute or a style rule. Names are converted to lower case."""
    pairs = (item.partition(":") for item in style.split(";"))
    return {name.strip().lower(): value.replace("!important", "").strip() for name, _, value in pairs if name.strip()}


def parse_class_rules(sheet: str) -> dict[str, dict[str, str]]:
    """Parse the rules of a style sheet that apply to a single class (``.cut { stroke: red }``), ignoring imports."""
    first, *others = sheet.split("/*")
    plain = first + "".join(text.partition("*/")[2] for text in others)
    rules: dict[str, dict[str, str]] = {}
    for rule in plain.split("}"):
        selectors, _, body = rule.partition("{")
        for selector in selectors.split(","):
            if name := _CLASS.fullmatch(selector.strip()):
                rules.setdefault(name.group(1), {}).update(parse_style(body))
    return rules
