"""Comments and parameters that a controller obeys before, or beside, the interpreter of its G-code.

    obeyed_lines(["G21", "(o=0, kw=1.5, ph=4, pd=0.5, ch=1.5, fr=1200)", "#<holes>=2"], dialect("qtplasmac"))

To an interpreter these are remarks, or settings that nothing reads; what cuts is another material, a slower hole, no
cut at all. Which they are says the dialect. They are taken in the order of the text, as the filter of a controller's
screen takes them, which knows of no loop or subprogram.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from leafcut.gcode.dialects import Dialect

#: The parameter after which QtPlasmaC makes a pierce of every cut to come.
PIERCE_ONLY = "pierce-only"
_NUMBER = re.compile(r"^/?n[0-9.]+", re.IGNORECASE)
_SETTING = re.compile(r"#<([^<>]+)>=([^(;]*)")
#: Figures that are the same with more zeros behind the point; the others must be whole numbers, or are names.
_MEASURES = frozenset({"ph", "pd", "ch", "fr", "kw", "jh", "jd", "ca", "cv", "pe", "gp", "cm"})
_LONGEST = 60


class Obeyed(NamedTuple):
    """One such line.

    Attributes
    ----------
    line
        Its number in the text, from 1.
    what
        What it comes to: equal for two lines that mean the same.
    said
        Its text, for messages.
    """

    line: int
    what: tuple[object, ...]
    said: str

    @property
    def pierces_only(self) -> bool:
        """Whether all cuts behind it are made into pierces."""
        return self.what[0] == PIERCE_ONLY and str(self.what[1]).startswith("1")


def obeyed_lines(lines: Sequence[str], dialect: Dialect) -> tuple[Obeyed, ...]:
    """Return the lines of a program that its controller obeys though no word of them is G-code, in order."""
    if not dialect.obeyed_comments and not dialect.obeyed_parameters:
        return ()
    openings = tuple(_bare(opening) for opening in dialect.obeyed_comments)
    found = []
    for number, line in enumerate(lines, 1):
        if "(" not in line and ";" not in line and "#" not in line:
            continue
        bare = _NUMBER.sub("", _bare(line))
        setting = _SETTING.match(bare)
        if setting is not None and setting.group(1) in dialect.obeyed_parameters:
            what: tuple[object, ...] = (setting.group(1), _value(setting.group(2)))
        elif any(opening in bare for opening in openings):
            exactly = _NUMBER.sub("", line.strip()).lstrip().startswith(dialect.obeyed_comments)
            what = ("comment", exactly, *_figures(line, bare))
        else:
            continue
        found.append(Obeyed(number, what, line.strip()[:_LONGEST]))
    return tuple(found)


def _bare(text: str) -> str:
    return "".join(text.split()).casefold()


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _figures(line: str, bare: str) -> Sequence[object]:
    """Return the figures of a comment such as ``(o=0, kw=1.5, na=steel)``, by name; of another its text.

    A space between name and sign hides a figure from the filter, and of one that is there twice it takes the last.
    """
    if not bare.startswith("("):
        return [bare]
    inside = line.partition("(")[2].partition(")")[0]
    named = {name.lstrip(): value.strip() for name, _, value in (item.partition("=") for item in inside.split(","))}
    return sorted((name, _value(value) if name in _MEASURES else value) for name, value in named.items())
