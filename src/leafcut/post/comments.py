"""Comments that no controller can mistake for commands."""

from __future__ import annotations

import re
import textwrap
import unicodedata

from leafcut.gcode.active_comments import is_active_comment

#: ASCII replacements of special characters. GRBL acts at once on ? ! and ~, and % ends a tape.
_PLAIN = str.maketrans(
    {"(": "[", ")": "]", "{": "[", "}": "]", "%": " pct", "?": ".", "!": ".", "~": "-", "×": "x", "–": "-", "—": "-"}
    | {"µ": "u", "μ": "u", "°": " deg", "Ø": "D", "ø": "d", "⌀": "D", "²": "2", "³": "3", "·": ",", "→": "->"}
)
# Controllers act on comments such as (MSG, …), (PROBEOPEN x) and (o=0, …).
_ACTIVE = re.compile(r"\A([A-Za-z_]+)\s*,")
_MATERIAL = re.compile(r"\Ao\s*=", re.IGNORECASE)


def plain_text(text: str) -> str:
    """Return a text as one line of printable ASCII, without parentheses and without words on which a controller acts.

    >>> plain_text("Ø3 mm (steel)\\nMSG, 20 %")
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
    """Return a text as comments in parentheses or after semicolons, with at most `width` characters per line."""
    plain = plain_text(text)
    if uppercase:
        plain = plain.upper()
    parts = [plain_text(part) for part in textwrap.wrap(plain, width - 4) or [""]]
    return [f"; {part}".rstrip() if style == ";" else f"({part})" for part in parts]
