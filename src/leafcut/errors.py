"""All errors that leafcut raises on purpose, in one tree.

    LeafcutError
    ├── ReadError      a file cannot be read, or its content is invalid
    ├── OptionError    an option is wrong (also a ValueError)
    │   └── DataError  a tool library, material, machine or dialect is invalid, or a document has an unknown schema
    ├── PlanError      the part cannot be made as requested
    ├── SolveError     a routing problem cannot be solved as requested
    ├── PostError      the toolpath cannot be written in this controller's dialect
    ├── VerifyError    the written program differs from the plan, or is not safe
    └── SendError      a program cannot be sent to a machine, or its run was ended

A message is one line: the problem, the expectation and the remedy. It is a template with its values (`Message`):
``PlanError("tool {} is too long for {}", tool, name)``. A text without values is its own template. Quotations are
shortened here (`shorten_message`), and exceptions of other libraries become a `ReadError` (`parser_errors`).
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from leafcut.message import Message, map_text

#: Maximum length of a quotation from a file; file names are not shortened.
LONGEST_QUOTE = 60
LONGEST_MESSAGE = 1000

_QUOTED = re.compile(rf"(?<!\w)'([^']{{{LONGEST_QUOTE + 1},}})'(?!\w)")
#: Path components count as separate words. On systems where a backslash is no separator, it is an ordinary character.
_UNBROKEN = re.compile(rf"[^\s{re.escape(os.sep + (os.altsep or ''))}]{{{LONGEST_QUOTE + 3},}}")


def printable(text: str, limit: int = LONGEST_QUOTE) -> str:
    """Convert text from a file to one printable line for a message. Long words and long lines are shortened."""
    words = text[: 10 * limit].split()
    line = " ".join(w if len(w) <= LONGEST_QUOTE else f"{w[: LONGEST_QUOTE - 1]}…" for w in words)
    quote = "".join(c if c.isprintable() else "?" for c in line[: limit + 1])
    return quote if len(quote) <= limit else quote[: limit - 1] + "…"


def shorten_message(message: str) -> str:
    """Shorten the quotations and long words in a message."""
    return message if len(message) <= LONGEST_QUOTE else map_text(message, _shorten_text)


def _shorten_text(text: str) -> str:
    line = text[: 10 * LONGEST_MESSAGE]
    line = _QUOTED.sub(lambda match: f"'{printable(match[1])}'", line)
    line = _UNBROKEN.sub(lambda match: printable(match[0]), line)
    return line if len(line) <= LONGEST_MESSAGE else line[: LONGEST_MESSAGE - 1] + "…"


class LeafcutError(Exception):
    """Base class of all errors that leafcut raises on purpose.

    Attributes
    ----------
    answered
        Whether a JSON answer with the error has already been printed.
    """

    answered = False

    def __init__(self, message: str, *values: object) -> None:
        super().__init__(shorten_message(Message(message, *values) if values else Message.of_text(message)))

    def __reduce__(self) -> tuple[Any, ...]:
        """Make the exception picklable with any arguments. Otherwise it would break a process pool."""
        return _unpickle_error, (type(self), self.args, self.__dict__)


def _unpickle_error(kind: type[LeafcutError], args: tuple[Any, ...], state: dict[str, Any]) -> LeafcutError:
    error = kind.__new__(kind)
    error.args = args
    error.__dict__.update(state)
    return error


class ReadError(LeafcutError):
    """A file cannot be read. The message states the file, the reason, and the line if it is known."""

    def __init__(self, file: str | Path, reason: str, line: int | None = None) -> None:
        self.file = str(file)
        self.line = line
        self.reason = shorten_message(Message.of_text(reason))
        place = self.file if line is None else f"{self.file}:{line}"
        super().__init__("")
        self.args = (Message("{}: {}", place, self.reason),)  # file names are never shortened


class OptionError(LeafcutError, ValueError):
    """An option has an unusable value, or its name does not exist."""


class DataError(OptionError):
    """A file or document is invalid.

    The file describes tools, a material, a machine or a dialect, or a document has an unknown schema. The command line
    with the file name is valid, so the exit status is 1, as for any other input.

    Attributes
    ----------
    table, number, key
        Position of the error in a TOML file; "" and 0 if unknown. `number` is the number of the table in an array, from
        1.
    line
        Line of a syntax error, from 1.
    """

    table = key = ""
    number = 0
    line: int | None = None

    def at(self, table: str = "", number: int = 0, key: str = "", line: int | None = None) -> Self:
        """Set the position of the error and return it."""
        self.table, self.number, self.key, self.line = table, number, key, line
        return self


class PlanError(LeafcutError):
    """The part cannot be made with the given tools, depths or machine."""


class SolveError(LeafcutError):
    """A routing problem cannot be solved as requested."""


class PostError(LeafcutError):
    """The toolpath needs a word that this controller does not have, or a program cannot be reordered.

    `section` is the number, from 0, of the section that cannot be reordered. It is None for the whole program.
    """

    def __init__(self, message: str, *values: object, section: int | None = None) -> None:
        self.section = section
        super().__init__(message, *values)


class VerifyError(LeafcutError):
    """The program, after reading it back, differs from the toolpath or is not safe to run."""


class SendError(LeafcutError):
    """A program was not sent to a machine, or its run was ended.

    The message states the reason and the state of the machine.
    """


@contextmanager
def parser_errors(file: str | Path, failure: Message, line: int | None = None) -> Iterator[None]:
    """Convert any exception of a third-party parser to a `ReadError`. `failure` describes the problem."""
    try:
        yield
    except (LeafcutError, MemoryError):
        raise
    except RecursionError:
        raise ReadError(file, Message("{} (nested too deep)", failure), line) from None
    except Exception as problem:
        reason = printable(str(problem), 120) or Message("no reason given")
        raise ReadError(file, Message("{} ({}: {})", failure, type(problem).__name__, reason), line) from None


def closest_names(name: str, known: Iterable[str]) -> list[str]:
    """Return the known names that the user may have meant by `name`. The list is empty if no name is close.

    Names that start with `name` or contain it as a word take precedence over names with a similar spelling. For
    `tool`, the function returns `tools`, `tool-number` and `tool-diameter`. For `speed`, it returns `spindle-speed` and
    not `seed`.
    """
    from difflib import get_close_matches  # imported here for a quick start: seldom needed

    name = name.lower()
    lower = {candidate.lower(): candidate for candidate in known}
    similar = [
        candidate
        for candidate in lower
        if len(name) > 2 and (candidate.startswith(name) or name in re.split("[-_ ]", candidate))
    ]
    similar.sort(key=lambda candidate: (not candidate.startswith(name), len(candidate), candidate))
    swapped = [candidate for candidate in lower if len(name) > 2 and sorted(candidate) == sorted(name)]
    matches = similar[:_MAX_CLOSE] or swapped[:1] or get_close_matches(name, lower, n=1, cutoff=0.75)
    return [lower[match] for match in matches]


#: Maximum numbers of known names that a message lists: of similar names, and of all names.
_MAX_CLOSE, _MAX_LISTED = 3, 60


def did_you_mean(names: Sequence[str]) -> Message:
    """Return ``"; did you mean 'x' or 'y'?"`` with at most three names."""
    match names:
        case [name]:
            return Message("; did you mean '{}'?", name)
        case [name, other]:
            return Message("; did you mean '{}' or '{}'?", name, other)
    return Message("; did you mean '{}', '{}' or '{}'?", *names)


def name_suggestion(name: str, known: Iterable[str]) -> str:
    """Ask whether the user meant one of the known names closest to `name` (`did_you_mean`).

    If only a few names are known, the text lists all of them instead.
    """
    known = list(known)
    if matches := closest_names(name, known):
        return did_you_mean(matches)
    return Message("; choose one of {}", ", ".join(known)) if len(known) <= _MAX_LISTED else ""


def count_of(number: int, noun: str, style: str = "") -> Message:
    """Format a number with its noun: ``1 hole``, ``1200 holes``, or with the style ``,``: ``1,200 holes``."""
    return Message(f"{{:{style}}} {noun}{'' if number == 1 else 's'}", number)
