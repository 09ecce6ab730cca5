"""Format numbers and comments in programs, and the words for dwells, coolants and canned cycles in each dialect."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from dataclasses import dataclass

from leafcut.errors import PostError
from leafcut.gcode.active_comments import is_active_comment
from leafcut.gcode.dialects import Dialect
from leafcut.model.cycles import peck_heights
from leafcut.model.toolpath import DrillCycle
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE

#: Maximum length or feed on any machine tool, mm or mm/min.
MAX_LENGTH = 1e6
#: ASCII replacements for special characters. GRBL acts immediately on ? ! and ~, and % ends a tape.
_PLAIN = str.maketrans(
    {"(": "[", ")": "]", "{": "[", "}": "]", "%": " pct", "?": ".", "!": ".", "~": "-", "×": "x", "–": "-", "—": "-"}
    | {"µ": "u", "μ": "u", "°": " deg", "Ø": "D", "ø": "d", "⌀": "D", "²": "2", "³": "3", "·": ",", "→": "->"}
)
# Controllers act on comments such as (MSG, …), (PROBEOPEN x) and (o=0, …).
_ACTIVE = re.compile(r"\A([A-Za-z_]+)\s*,")
_MATERIAL = re.compile(r"\Ao\s*=", re.IGNORECASE)

_COOLANT_WORDS = {1: "M7", 2: "M8"}


def format_number(value: float, decimals: int, point: bool = False) -> str:
    """Format a number with at most `decimals` decimals, without trailing zeros. `point` keeps the point of an integer.

    >>> format_number(-0.0004, 3), format_number(12.5, 3), format_number(3.0, 3, point=True)
    ('0', '12.5', '3.')

    Raises
    ------
    PostError
        The number is not finite, or out of range.
    """
    if not abs(value) <= MAX_LENGTH:
        raise PostError("the toolpath has the number {:g}, which is out of range for any machine", value)
    text = f"{value:.{decimals}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text == "-0":
        text = "0"
    return text + "." if point and "." not in text else text


@dataclass(frozen=True, slots=True)
class NumberFormat:
    """Format of the lengths and feeds in a program: unit (mm or inch), number of decimals, and decimal point."""

    inch: bool
    decimals: int
    point: bool

    @property
    def unit(self) -> float:
        """Millimetres in one unit of the program."""
        return MM_PER_INCH if self.inch else 1.0

    @property
    def resolution(self) -> float:
        """Smallest step of a length in the program, mm."""
        return self.unit * 10.0**-self.decimals

    def format_length(self, mm: float) -> str:
        """Format a length given in mm."""
        return format_number(mm / self.unit, self.decimals, self.point)

    def rounded(self, mm: float) -> float:
        """Round a length to the resolution of the program, mm."""
        return float(self.format_length(mm)) * self.unit

    def format_feed(self, mm_per_s: float) -> str:
        """Format a feed, given in mm/s, as units per minute.

        Raises
        ------
        PostError
            The feed is zero after rounding, or out of range.
        """
        text = format_number(mm_per_s * SECONDS_PER_MINUTE / self.unit, self.decimals, self.point)
        if not float(text) > 0:
            raise PostError("a cut has the feed {:g} mm/s; give the tool a feed", mm_per_s)
        return text


def dwell_word(seconds: float, dialect: Dialect) -> str:
    """Return the word for a dwell: P or K, in seconds, milliseconds or hundredths of a second."""
    if not seconds >= 0.0:
        raise PostError("a dwell of {:g} s is out of range", seconds)
    unit = dialect.dwell_unit
    if unit in ("ms", "cs"):
        number = format_number(seconds * (1000 if unit == "ms" else 100), 0)
    else:
        number = format_number(seconds, 3, point=unit == "point")
    return dialect.dwell_letter + number


def coolant_words(mode: int, before: int, dialect: Dialect) -> list[str]:
    """Return the words that change the coolant from mode `before` to `mode`. Bit 1 is mist, and bit 2 is flood.

    Raises
    ------
    PostError
        The controller has no word for the change.
    """
    if mode == 0:
        return ["M9"]
    if before & ~mode:
        raise PostError("a single coolant cannot be switched off while two are on; switch off both first")
    words = [word for bit, word in _COOLANT_WORDS.items() if mode & bit]
    for word in words:
        if int(word[1:]) not in dialect.m_codes:
            raise PostError("{} has no {} (mist)", dialect.name, word)
    return words


def cycle_parameters(cycle: DrillCycle) -> tuple[str, float, float, float, float]:
    """Return the parameters that a cycle keeps while it is modal. G98 and G99 are separate words."""
    return cycle.name, cycle.r_plane, cycle.bottom, cycle.peck, cycle.dwell


def supports_cycle(cycle: DrillCycle, dialect: Dialect) -> bool:
    """Return whether the controller supports this cycle. Otherwise, the caller must expand the cycle.

    Raises
    ------
    PostError
        The controller lacks a tapping cycle, which cannot be expanded, or the cycle lacks a required parameter.
    """
    if cycle.name in ("G83", "G73") and not cycle.peck > 0:
        raise PostError("{} needs a peck depth", cycle.name)
    supported = cycle.name in dialect.cycles
    if cycle.name != "G84":
        return supported
    if not supported:
        raise PostError(
            "{} has no tapping cycle (G84) known to leafcut, and tapping cannot be written as plain "
            "moves; leave the tapped holes out, or choose another machine",
            dialect.name,
        )
    if cycle.dwell > 0 and "G84" not in dialect.dwell_cycles:
        raise PostError("the tapping cycle (G84) of {} has no dwell; remove it from the tool library", dialect.name)
    return True


def cycle_words(cycle: DrillCycle, numbers: NumberFormat, dialect: Dialect) -> tuple[str, list[str]]:
    """Return the G word of a cycle, and its other words except X, Y and F."""
    r_plane, bottom = numbers.format_length(cycle.r_plane), numbers.format_length(cycle.bottom)
    if dialect.cycle_words == "fagor":
        # On Fagor controls, G82 is G81 with a dwell; fagor8055.toml has the sources.
        dwelling = [dwell_word(cycle.dwell, dialect)] if cycle.name == "G82" else []
        return ("G81" if dwelling else cycle.name), [f"Z{r_plane}", f"I{bottom}", *dwelling]
    words = [f"Z{bottom}", f"R{r_plane}"]
    if cycle.name in ("G83", "G73"):
        words.append(f"Q{format_peck(cycle, numbers)}")
    # G84 states its dwell even if it is 0, because LinuxCNC would otherwise use the dwell of the last G82.
    if cycle.name == "G82" or (cycle.name == "G84" and "G84" in dialect.dwell_cycles):
        words.append(dwell_word(cycle.dwell, dialect))
    return cycle.name, words


def format_peck(cycle: DrillCycle, numbers: NumberFormat) -> str:
    """Format a peck depth, rounded so that the number of pecks stays the same.

    For example, 10 mm in three pecks of 3.3333 mm must not need a fourth peck of 0.001 mm after rounding.
    """
    r_plane, bottom = numbers.rounded(cycle.r_plane), numbers.rounded(cycle.bottom)
    count = len(peck_heights(cycle))
    for steps in (0, 1, -1):
        text = numbers.format_length(cycle.peck + steps * numbers.resolution)
        peck = float(text) * numbers.unit
        if peck > 0 and len(peck_heights(DrillCycle(cycle.name, r_plane, bottom, peck=peck))) == count:
            return text
    raise PostError("a peck of {:g} mm is too small to write; use a larger peck", cycle.peck)


def to_plain_ascii(text: str) -> str:
    """Convert a text to a single line of printable ASCII. No controller acts on the result, which has no parentheses.

    >>> to_plain_ascii("Ø3 mm (steel)\\nMSG, 20 %")
    'D3 mm [steel] MSG, 20 pct'
    """
    decomposed = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    letters = "".join(c for c in decomposed if not unicodedata.combining(c))
    ascii_text = "".join(c if " " <= c <= "\x7e" else " " if c.isspace() or ord(c) < 32 else "." for c in letters)
    # QtPlasmaC searches for ";qtplasmac filtered" anywhere in a text.
    one_line = re.sub(r";(?=\S)", ",", " ".join(ascii_text.translate(_PLAIN).split()))
    plain = _ACTIVE.sub(r"\1 -", one_line)
    return f"- {plain}" if is_active_comment(plain) or _MATERIAL.match(plain) else plain


def comment_lines(text: str, width: int, uppercase: bool = False, style: str = "()") -> list[str]:
    """Split a text into comments in parentheses or after semicolons, with at most `width` characters per line."""
    plain = to_plain_ascii(text)
    if uppercase:
        plain = plain.upper()
    parts = [to_plain_ascii(part) for part in textwrap.wrap(plain, width - 4) or [""]]
    return [f"; {part}".rstrip() if style == ";" else f"({part})" for part in parts]
