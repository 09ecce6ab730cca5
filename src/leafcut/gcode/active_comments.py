"""Detect comments and settings that a controller acts on, although its interpreter ignores them.

    is_active_comment("MSG, turn it over")                                           True
    controller_settings(["(o=0, kw=1.5, ph=4, pd=0.5, ch=1.5, fr=1200)"], dialect("qtplasmac"))

A setting may select another material, slow down in holes, or disable cutting. The dialect lists the settings that its
controller knows. They apply in the order of the text, because the filter of the controller's screen ignores loops and
subprograms.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import split_line

#: Matches a comment that aborts the program with an error. Source: LinuxCNC 2.9, `convert_comment`; confirmed with
#: rs274.
_STOP = re.compile(r"abort[ \t]*,", re.IGNORECASE)
#: Matches comments that run a command, write a record, or show a text. Comments of all controllers count, because a
#: program may be read in the wrong dialect. docs/programs.md lists the controllers and sources.
_ACTION = re.compile(
    r"(?:debug|print|log|logopen|logappend|py|pyrun|axis|preview)[ \t]*,"
    r"|(?:msg|logclose|probeopen|probeclose|pyreload)(?![a-z0-9_])|\{",
    re.IGNORECASE,
)
#: Matches words of Fanuc and Haas that display the comment on their line to the operator: alarm, stop, question.
_PROMPT = re.compile(r"#[ \t]*300[06][ \t]*=|M[ \t]*0*109(?![0-9.])", re.IGNORECASE)
#: When QtPlasmaC reads this parameter, it turns all following cuts into pierces.
_PIERCE_ONLY = "pierce-only"
_NUMBER = re.compile(r"^/?n[0-9.]+", re.IGNORECASE)
_SETTING = re.compile(r"#<([^<>]+)>=([^(;]*)")
#: These parameters are compared as decimal numbers. The others are integers or names.
_MEASURES = frozenset({"ph", "pd", "ch", "fr", "kw", "jh", "jd", "ca", "cv", "pe", "gp", "cm"})
#: Settings are shortened to this length in messages, characters.
_LONGEST = 60


def is_active_comment(comment: str) -> bool:
    """Return whether any controller acts on a comment. The comment is passed without its parentheses or semicolon."""
    return bool(_STOP.match(comment) or _ACTION.match(comment))


def may_stop_program(comments: Iterable[str]) -> bool:
    """Return whether any of the comments may stop the program."""
    return any(_STOP.match(comment) for comment in comments)


def select_active_comments(comments: Sequence[str]) -> list[str]:
    """Return the first active comment of a block, and all comments after it.

    The later comments matter because LinuxCNC only acts on the last comment of a block.
    """
    first = next((at for at, comment in enumerate(comments) if is_active_comment(comment)), len(comments))
    return list(comments[first:])


def active_or_displayed_comments(line: str, dialect: Dialect) -> list[str]:
    """Return the active comments of a line.

    All comments are active if the line displays its comments to the operator (alarm, stop, question).
    """
    if "(" not in line and ";" not in line:
        return []
    comments = split_line(line, nested=True)[1]
    return list(comments) if dialect.groups == "fanuc" and _PROMPT.search(line) else select_active_comments(comments)


class ControllerSetting(NamedTuple):
    """A setting of the controller on a line of a program.

    Lines are counted from 1, and equivalent settings have the same `value`.
    """

    line: int
    value: tuple[object, ...]
    text: str

    @property
    def pierces_only(self) -> bool:
        """Whether the setting turns all following cuts into pierces."""
        return self.value[0] == _PIERCE_ONLY and str(self.value[1]).startswith("1")


def controller_settings(lines: Sequence[str], dialect: Dialect) -> tuple[ControllerSetting, ...]:
    """Return the controller settings of a program in order."""
    if not dialect.obeyed_comments and not dialect.obeyed_parameters:
        return ()
    openings = tuple(_without_spaces(opening) for opening in dialect.obeyed_comments)
    settings = []
    for number, line in enumerate(lines, 1):
        if "(" not in line and ";" not in line and "#" not in line:
            continue
        bare = _NUMBER.sub("", _without_spaces(line))
        parameter = _SETTING.match(bare)
        if parameter is not None and parameter.group(1) in dialect.obeyed_parameters:
            value: tuple[object, ...] = (parameter.group(1), _number_or_text(parameter.group(2)))
        elif any(opening in bare for opening in openings):
            exactly = _NUMBER.sub("", line.strip()).lstrip().startswith(dialect.obeyed_comments)
            value = ("comment", exactly, *_comment_parameters(line, bare))
        else:
            continue
        settings.append(ControllerSetting(number, value, line.strip()[:_LONGEST]))
    return tuple(settings)


def _without_spaces(text: str) -> str:
    return "".join(text.split()).casefold()


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _comment_parameters(line: str, bare: str) -> Sequence[object]:
    """Return the parameters of a comment such as ``(o=0, kw=1.5, na=steel)``, sorted by name.

    If a name occurs twice, its last value counts. A name with a space before the equals sign is not recognized. If the
    line is not such a comment, the function returns its text.
    """
    if not bare.startswith("("):
        return [bare]
    inside = line.partition("(")[2].partition(")")[0]
    named = {name.lstrip(): value.strip() for name, _, value in (item.partition("=") for item in inside.split(","))}
    return sorted((name, _number_or_text(value) if name in _MEASURES else value) for name, value in named.items())
