"""Small grammars of SVG: lengths, transforms, the view box, styles. Everything strict: nothing is guessed."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

#: User units (1/96 inch) in one of each unit (CSS Values and Units 3, section 6.2).
PX_PER_UNIT = {"": 1.0, "px": 1.0, "in": 96.0, "mm": 96.0 / 25.4, "cm": 960.0 / 25.4, "q": 24.0 / 25.4, "pt": 4.0 / 3.0}
PX_PER_UNIT["pc"] = 16.0
#: Of these a length says how large the drawing is in the world.
PHYSICAL = ("in", "mm", "cm", "q", "pt", "pc")

# Each expression is matched at one place and knows its way without turning back: a hostile file cannot stall it.
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*([a-zA-Z]*|%)")
_NEXT_NUMBER = re.compile(rf"[\s,]*({_NUMBER})")
_FUNCTION = re.compile(r"[\s,]*([a-zA-Z]+)\s*\(([^()]*)\)")
_CLASS = re.compile(r"\w*\.([\w-]+)")
#: No length or view box has more letters; each copy of a `use` reads them again.
_LONGEST = 200


class Affine(NamedTuple):
    """x' = a·x + c·y + e, y' = b·x + d·y + f, as in SVG's matrix(a b c d e f)."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def of(self, inner: Affine) -> Affine:
        """Return the transform that applies `inner` first."""
        x, y = self.place(inner.e, inner.f)
        return Affine(*self.turn(inner.a, inner.b), *self.turn(inner.c, inner.d), x, y)

    def turn(self, x: float, y: float) -> tuple[float, float]:
        """Return the image of a direction."""
        return (self.a * x + self.c * y, self.b * x + self.d * y)

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return the image of a point."""
        return (self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f)


def numbers(text: str) -> list[float]:
    """Return the numbers of a list separated by commas or spaces; ValueError for anything else in it."""
    found, at, text = [], 0, text.strip()
    while at < len(text):
        match = _NEXT_NUMBER.match(text, at)
        if match is None:
            raise ValueError(f"'{text[:40]}' is not a list of numbers")
        found.append(float(match.group(1)))
        at = match.end()
    if not all(math.isfinite(n) for n in found):
        raise ValueError("a number that is not finite")
    return found


def length(text: str, whole: float) -> float:
    """Return a length in user units; `whole` is what 100 % stands for."""
    value, unit = parts_of_length(text)
    if unit == "%":
        return 0.01 * value * whole
    return value * PX_PER_UNIT[unit]


def parts_of_length(text: str) -> tuple[float, str]:
    """Return number and unit of a length; ValueError for a unit that needs a font, and for anything else."""
    match = _LENGTH.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    unit = match.group(2).lower() if match else "?"
    if match is None or (unit not in PX_PER_UNIT and unit != "%") or not math.isfinite(float(match.group(1))):
        raise ValueError(f"'{text[:20]}' is not a length")
    return float(match.group(1)), unit


def transform(text: str) -> Affine:
    """Return what a transform attribute says; ValueError for one that is not understood."""
    result, at, text = Affine(), 0, text.strip()
    while at < len(text):
        match = _FUNCTION.match(text, at)
        if match is None:
            raise ValueError(f"transform '{text[:40]}'")
        name, values = match.group(1), numbers(match.group(2))
        result, at = result.of(_function(name, values)), match.end()
    return result


def _function(name: str, v: list[float]) -> Affine:
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
        return Affine(e=x, f=y).of(Affine(cos, sin, -sin, cos)).of(Affine(e=-x, f=-y))
    if name in ("skewX", "skewY") and count == 1:
        tangent = math.tan(math.radians(v[0]))
        return Affine(c=tangent) if name == "skewX" else Affine(b=tangent)
    raise ValueError(f"transform '{name}' with {count} numbers")


def view_box(text: str) -> list[float]:
    """Return the numbers of a view box; ValueError for what is none."""
    if len(text) > _LONGEST:
        raise ValueError(f"view box '{text[:20]} …'")
    return numbers(text)


def view(box: list[float], width: float, height: float, aspect: str) -> Affine:
    """Return the transform from a view box (x, y, width, height) to a viewport at the origin (SVG 1.1, section 7.8)."""
    x, y, w, h = box
    if not (w > 0.0 and h > 0.0):
        raise ValueError("a view box without size")
    sx, sy = width / w, height / h
    words = aspect[:_LONGEST].split()
    align = words[0] if words else "xMidYMid"
    if align == "none":
        return Affine(sx, 0.0, 0.0, sy, -x * sx, -y * sy)
    scale = max(sx, sy) if "slice" in words else min(sx, sy)
    shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
    across, down = shares.get(align[1:4], 0.5), shares.get(align[5:8], 0.5)
    return Affine(
        scale, 0.0, 0.0, scale, across * (width - w * scale) - x * scale, down * (height - h * scale) - y * scale
    )


def declarations(style: str) -> dict[str, str]:
    """Return the properties of a style attribute or rule, names in lower case."""
    pairs = (item.partition(":") for item in style.split(";"))
    return {name.strip().lower(): value.replace("!important", "").strip() for name, _, value in pairs if name.strip()}


def class_rules(sheet: str) -> dict[str, dict[str, str]]:
    """Return what a style sheet gives to single classes (``.cut { stroke: red }``); nothing is loaded."""
    first, *others = sheet.split("/*")
    plain = first + "".join(text.partition("*/")[2] for text in others)
    found: dict[str, dict[str, str]] = {}
    for rule in plain.split("}"):
        selectors, _, body = rule.partition("{")
        for selector in selectors.split(","):
            if name := _CLASS.fullmatch(selector.strip()):
                found.setdefault(name.group(1), {}).update(declarations(body))
    return found
