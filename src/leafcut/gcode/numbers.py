"""Number formats for controllers: fixed decimals, no exponent, never -0, a decimal point if required."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.errors import PostError
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE

#: Maximum length or feed on any machine tool, mm or mm/min.
MAX_LENGTH = 1e6


def format_number(value: float, decimals: int, point: bool = False) -> str:
    """Format a number with at most `decimals` decimals, without trailing zeros; `point` keeps the point of an integer.

    >>> format_number(-0.0004, 3), format_number(12.5, 3), format_number(3.0, 3, point=True)
    ('0', '12.5', '3.')

    Raises PostError if the number is not finite, or out of range.
    """
    if not abs(value) <= MAX_LENGTH:
        raise PostError("the toolpath has the number {:g}, out of range of any machine", value)
    text = f"{value:.{decimals}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text == "-0":
        text = "0"
    return text + "." if point and "." not in text else text


@dataclass(frozen=True, slots=True)
class NumberFormat:
    """Format of the lengths and feeds in a program: unit (mm or inch), decimals, and decimal point."""

    inch: bool
    decimals: int
    point: bool

    @property
    def unit(self) -> float:
        """Millimetres in one unit of the program."""
        return MM_PER_INCH if self.inch else 1.0

    @property
    def resolution(self) -> float:
        """Resolution of lengths in the program, mm."""
        return self.unit * 10.0**-self.decimals

    def length(self, mm: float) -> str:
        """Format a length given in mm."""
        return format_number(mm / self.unit, self.decimals, self.point)

    def rounded(self, mm: float) -> float:
        """Return a length rounded to the resolution of the program, mm."""
        return float(self.length(mm)) * self.unit

    def feed(self, mm_per_s: float) -> str:
        """Format a feed in mm/s as units per minute. Raises PostError if it is zero after rounding, or out of range."""
        text = format_number(mm_per_s * SECONDS_PER_MINUTE / self.unit, self.decimals, self.point)
        if not float(text) > 0:
            raise PostError("a cut has the feed {:g} mm/s; give the tool a feed", mm_per_s)
        return text
