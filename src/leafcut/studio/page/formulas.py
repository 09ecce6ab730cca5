"""Formulas as MathML, which browsers can display: `formula(sub("τ", "ij"), "←", …)`."""

from __future__ import annotations

import math
from html import escape

#: Number of significant digits.
DIGITS = 4


class MathMark(str):
    """A MathML string, which must not be escaped."""


def formula(*parts: str | float) -> str:
    """Return a formula on a separate line."""
    return f'<math display="block">{row(*parts)}</math>'


def row(*parts: str | float) -> MathMark:
    """Place parts side by side.

    A letter becomes a variable, a number stays a number, and any other text is an operator.
    """
    return MathMark(f"<mrow>{''.join(_to_mathml(part) for part in parts)}</mrow>")


def frac(above: str | float, below: str | float) -> MathMark:
    """Return a fraction."""
    return MathMark(f"<mfrac>{row(above)}{row(below)}</mfrac>")


def sub(base: str, index: str) -> MathMark:
    """Return a letter with an index.

    An index with one or two letters consists of variables. A longer index is upright.
    """
    return MathMark(f"<msub>{_to_mathml(base)}{_index_mathml(index)}</msub>")


def power(base: str | float, exponent: str | float) -> MathMark:
    """Return a power."""
    return MathMark(f"<msup>{_to_mathml(base)}{row(exponent)}</msup>")


def power_with_index(base: str, index: str, exponent: str | float) -> MathMark:
    """Return a letter with an index, raised to a power."""
    return MathMark(f"<msubsup>{_to_mathml(base)}{_index_mathml(index)}{row(exponent)}</msubsup>")


def sum_over(index: str, *parts: str | float) -> MathMark:
    """Return a sum over an index."""
    return MathMark(f"<munder><mo>∑</mo>{row(index)}</munder>{row(*parts)}")


def rounded_number(value: float) -> MathMark:
    """Round a number. Very small and very large numbers are written with a power of ten."""
    if value == 0.0 or not math.isfinite(value) or 1e-3 <= abs(value) < 1e6:
        return MathMark(f"<mn>{'∞' if math.isinf(value) else short_number(value)}</mn>")
    mantissa, _, exponent = f"{value:.{DIGITS - 1}e}".partition("e")
    ten = f"<msup><mn>10</mn><mn>{str(int(exponent)).replace('-', '−')}</mn></msup>"
    return MathMark(f"<mrow><mn>{mantissa}</mn><mo>·</mo>{ten}</mrow>")


def short_number(value: float) -> str:
    """Format a number with a few digits, such as 6,120, 0.02 or 25."""
    rounded = float(f"{value:.{DIGITS}g}")
    return f"{rounded:,.0f}" if abs(rounded) >= 10 ** (DIGITS - 1) else f"{rounded:g}"


def _to_mathml(part: str | float) -> str:
    if isinstance(part, MathMark):
        return part
    if isinstance(part, int | float):
        return rounded_number(part)
    return f"<mi>{part}</mi>" if len(part) == 1 and part.isalpha() else f"<mo>{escape(part)}</mo>"


def _index_mathml(index: str) -> str:
    if len(index) > 2:
        return f'<mtext class="index">{escape(index)}</mtext>'
    return f"<mrow>{''.join(f'<mn>{c}</mn>' if c.isdigit() else f'<mi>{c}</mi>' for c in index)}</mrow>"
