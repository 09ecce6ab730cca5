"""Convert units at the interface. Internally, leafcut uses millimetres, seconds, mm/s and radians.

The spindle speed is an exception: it is in revolutions per minute (`*_rpm`), as on every machine panel and in every S
word. Forces are in N, torques in N·mm, powers in W, strengths in N/mm², and densities in kg/m³.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from leafcut.errors import OptionError
from leafcut.message import Message

MM_PER_INCH = 25.4
SECONDS_PER_MINUTE = 60.0
#: One pound-force, N.
NEWTON_PER_POUND = 4.4482216152605

#: Millimetres in each unit of length that leafcut can read.
MM_PER_UNIT = {
    "mm": 1.0,
    "cm": 10.0,
    "dm": 100.0,
    "m": 1000.0,
    "um": 0.001,
    "µm": 0.001,
    "in": MM_PER_INCH,
    "inch": MM_PER_INCH,
    '"': MM_PER_INCH,
    "″": MM_PER_INCH,
    "”": MM_PER_INCH,
    "mil": MM_PER_INCH / 1000.0,
    "thou": MM_PER_INCH / 1000.0,
    "ft": 12 * MM_PER_INCH,
}

#: Names of the units of drawings that are larger than 1 mm.
LARGE_UNITS = {"in": Message("inches"), "ft": Message("feet"), "cm": Message("centimetres"), "m": Message("metres")}

#: Maps each internal unit to the units of the same kind, with their conversion factors.
FACTORS: dict[str, dict[str, float]] = {
    "mm": MM_PER_UNIT,
    "s": {"s": 1.0, "ms": 0.001, "min": 60.0, "m": 60.0, "h": 3600.0},
    "mm/s": {
        "mm/s": 1.0,
        "mm/min": 1.0 / 60.0,
        "m/min": 1000.0 / 60.0,
        "m/s": 1000.0,
        "in/min": MM_PER_INCH / 60.0,
        "ipm": MM_PER_INCH / 60.0,
        "in/s": MM_PER_INCH,
        "ft/min": 12 * MM_PER_INCH / 60.0,
    },
    "mm/s²": {
        "mm/s²": 1.0,
        "mm/s2": 1.0,
        "mm/s^2": 1.0,
        "m/s2": 1000.0,
        "m/s²": 1000.0,
        "m/s^2": 1000.0,
        "g": 9806.65,
        "in/s2": MM_PER_INCH,
        "in/s²": MM_PER_INCH,
    },
    "rad": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "steps/mm": {"steps/mm": 1.0, "1/mm": 1.0, "/mm": 1.0},
    "rpm": {"rpm": 1.0, "1/min": 1.0, "/min": 1.0, "krpm": 1000.0},
    "N": {"N": 1.0, "kN": 1000.0, "lbf": NEWTON_PER_POUND},
    "N·mm": {
        "N·mm": 1.0,
        "Nmm": 1.0,
        "N·m": 1000.0,
        "Nm": 1000.0,
        "ft·lb": 12 * MM_PER_INCH * NEWTON_PER_POUND,
        "ft-lb": 12 * MM_PER_INCH * NEWTON_PER_POUND,
    },
    "W": {"W": 1.0, "kW": 1000.0, "hp": 550 * 12 * MM_PER_INCH * NEWTON_PER_POUND / 1000.0},
    "N/mm²": {
        "N/mm²": 1.0,
        "N/mm2": 1.0,
        "MPa": 1.0,
        "GPa": 1000.0,
        "psi": NEWTON_PER_POUND / MM_PER_INCH**2,
        "ksi": 1000.0 * NEWTON_PER_POUND / MM_PER_INCH**2,
    },
    "kg/m³": {"kg/m³": 1.0, "kg/m3": 1.0, "g/cm³": 1000.0, "g/cm3": 1000.0},
}

#: Maps each internal unit to the shop unit that applies to a number without a unit in user input.
BARE_UNIT = {
    "mm": "mm",
    "s": "s",
    "mm/s": "mm/min",
    "mm/s²": "mm/s²",
    "rad": "deg",
    "rpm": "rpm",
    "steps/mm": "steps/mm",
    "N": "N",
    "N·mm": "N·m",
    "W": "kW",
    "N/mm²": "N/mm²",
    "kg/m³": "kg/m³",
}

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*\Z")

#: A fraction as on a ruler or a drill index (``1/4``, ``1 1/2`` and ``1-1/2``), and the text after it.
_FRACTION = re.compile(r"\s*([-+]?)(?:(\d{1,9})(?:\s+|-))?(\d{1,9})/(\d{1,9})(?![\d./,])\s*(.*?)\s*\Z")
#: Text that looks like a fraction: a digit or a point before the slash, and a digit, a point or a sign after it.
_LIKE_FRACTION = re.compile(r"[\d.]\s*/\s*[-+.]?\d")

_COMMA = re.compile(r"\s*([-+]?\d+),(\d+)(?![\d.])([^,]*)\Z")


def replace_decimal_comma(text: str) -> str:
    """Replace a decimal comma with a decimal point: ``6,5 mm`` becomes ``6.5 mm``.

    Raises
    ------
    OptionError
        The comma may be a thousands separator, as in ``1,250``.
    """
    if "," not in text:
        return text
    match = _COMMA.match(text)
    if match is None:
        raise OptionError("'{}' is not a single number; write it with a point, such as 6.5", text)
    whole, part, rest = match.groups()
    if len(part) == 3 and 1 <= len(whole.lstrip("+-0")) <= 3:
        raise OptionError("'{}' is ambiguous: write {}{} or {}.{}", text, whole, part, whole, part)
    return f"{whole}.{part}{rest}"


def parse_quantity(value: str | float, unit: str) -> float:
    """Convert `value` to the internal `unit` (a key of `FACTORS`).

    A number is already in the internal unit. A text may state its own unit ("3mm", "0.1in", "90 ipm", "118deg"). If it
    has no unit, the shop unit applies (`BARE_UNIT`: feeds in mm/min, angles in degrees). The function treats a comma as
    a decimal point if it cannot mean anything else (`replace_decimal_comma`). Fractions are allowed: "1/4in", "3/8\"",
    "1 1/2in" and "1-1/2in".

    Raises
    ------
    OptionError
        The text is not a finite number with a known unit.
    """
    if isinstance(value, bool):
        raise OptionError("'{}' is not a number", value)
    if isinstance(value, int | float):
        number, factor = float(value), 1.0
    else:
        number, word = _split_number_and_unit(value, unit)
        factors = FACTORS[unit]
        # "M" and "m" are different in physics, but "MM" can only mean millimetres.
        factor_of_unit = factors.get(word or BARE_UNIT[unit], factors.get(word.lower()))
        if factor_of_unit is None:
            raise OptionError("unknown unit '{}' in '{}'; choose one of {}", word, value, ", ".join(factors))
        factor = factor_of_unit
    if not math.isfinite(number):
        raise OptionError("'{}' is not a finite number", value)
    return number * factor


def _split_number_and_unit(text: str, unit: str) -> tuple[float, str]:
    fraction = _FRACTION.match(text)
    # "3000 1/min" is a number with a unit: no digit follows the slash.
    if fraction is not None:
        sign, whole, part, parts, word = fraction.groups()
        if int(parts) == 0:
            raise OptionError("division by zero in '{}'", text)
        if whole and int(part) >= int(parts):
            raise OptionError(
                "'{}' is not a fraction: {}/{} is not less than 1; write a fraction such as 1 1/2in", text, part, parts
            )
        number = int(whole or 0) + int(part) / int(parts)
        return -number if sign == "-" else number, word
    if _LIKE_FRACTION.search(text):
        raise OptionError("'{}' is not a fraction; write a fraction such as 1/4in or 1 1/2in", text)
    match = _QUANTITY.match(replace_decimal_comma(text))
    if not match:
        raise OptionError("'{}' is not a number with a unit, such as '3{}'", text, BARE_UNIT[unit])
    return float(match.group(1)), match.group(2)


def add_default_unit(text: str, unit: str) -> str:
    """Add the default unit to a quantity: ``800`` becomes ``800 mm/min``.

    Raises
    ------
    OptionError
        The text is not a number.
    """
    number, word = _split_number_and_unit(text, unit)
    return text.strip() if word or not math.isfinite(number) else f"{text.strip()} {BARE_UNIT[unit]}"


def parse_point(value: str | tuple[float, ...]) -> tuple[float, ...]:
    """Parse the coordinates ``"x,y"`` or ``"x,y,z"``, and return them in mm. Each coordinate may have a unit."""
    parts: list[str] | tuple[float, ...] = value.split(",") if isinstance(value, str) else value
    return tuple(parse_quantity(part, "mm") for part in parts)


def format_time(seconds: float) -> str:
    """Format a time in seconds: ``8.42 s``, ``3 min 05 s``, ``1 h 02 min``."""
    if round(seconds, 1) < 60:
        return f"{seconds:.2f} s" if round(seconds, 2) < 10 else f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min"


def to_fixed(value: float, decimals: int) -> str:
    """Format a number with a fixed number of decimals. Zero has no sign."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def format_length(mm: float) -> str:
    """Format a length in mm: ``412.3 mm``, ``12.41 m``."""
    return f"{mm:.1f} mm" if abs(mm) < 1000 else f"{mm / 1000:.2f} m"


def parse_angles(words: Sequence[str], where: str) -> tuple[float, ...] | None:
    """Parse a list of distinct angles in degrees, and return them in rad. Return None for ``free``.

    Raises
    ------
    OptionError
        An angle is invalid.
    """
    if tuple(words) == ("free",):
        return None
    try:
        angles = [parse_quantity(word, "rad") % math.tau for word in words]
    except OptionError as problem:
        raise OptionError("{}: {}; give angles such as 0,90,180,270, or free for any", where, problem) from None
    if not angles:
        raise OptionError("{}: names no angle; give angles such as 0,90,180,270, or free for any", where)
    return tuple(dict.fromkeys(angles))
