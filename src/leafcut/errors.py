"""Every error that leafcut raises on purpose, in one tree.

    LeafcutError
    ├── ReadError      a file cannot be read, or what it says cannot be meant
    ├── OptionError    an option is wrong (also a ValueError)
    │   └── DataError  a tool library, material, machine or dialect is invalid, or a document has an unknown schema
    ├── PlanError      the part cannot be made as asked
    ├── SolveError     a routing problem cannot be solved as asked
    ├── PostError      the toolpath cannot be said in this controller's words
    ├── VerifyError    what was written is not what was planned, or is not safe
    └── SendError      a program cannot be sent to a machine, or its run was ended

A message says what was found, what was expected and what to do; it is one line. What it quotes of a file is cut here
(`brief`), whoever wrote it, and here the exceptions of other libraries become a `ReadError` (`parsing`).
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: What somebody else wrote is quoted up to here; names of files are not cut.
LONGEST_QUOTE = 60
#: And no message is longer than this.
LONGEST_MESSAGE = 1000

_QUOTED = re.compile(rf"(?<!\w)'([^']{{{LONGEST_QUOTE + 1},}})'(?!\w)")
#: The folders of a path are words of their own; a backslash is a letter like others where folders are not parted by it.
_UNBROKEN = re.compile(rf"[^\s{re.escape(os.sep + (os.altsep or ''))}]{{{LONGEST_QUOTE + 3},}}")


def shown(text: str, limit: int = LONGEST_QUOTE) -> str:
    """Return text from a file as it may stand in a message: one line, printable, not too long.

    With a larger `limit`, for what another library says of a file, every word in it is cut as a quotation is.
    """
    words = text[: 10 * limit].split()
    line = " ".join(w if len(w) <= LONGEST_QUOTE else f"{w[: LONGEST_QUOTE - 1]}…" for w in words)
    printable = "".join(c if c.isprintable() else "?" for c in line[: limit + 1])
    return printable if len(printable) <= limit else printable[: limit - 1] + "…"


def brief(message: str) -> str:
    """Return a message with every quotation in it cut, and every word that is too long for one."""
    if len(message) <= LONGEST_QUOTE:
        return message
    line = message[: 10 * LONGEST_MESSAGE]
    line = _QUOTED.sub(lambda found: f"'{shown(found[1])}'", line)
    line = _UNBROKEN.sub(lambda found: shown(found[0]), line)
    return line if len(line) <= LONGEST_MESSAGE else line[: LONGEST_MESSAGE - 1] + "…"


class LeafcutError(Exception):
    """Base class of all errors that leafcut raises on purpose.

    Attributes
    ----------
    answered
        Whether a JSON answer that reports the error has been printed.
    """

    answered = False

    def __init__(self, message: str = "") -> None:
        super().__init__(brief(message))

    def __reduce__(self) -> tuple[Any, ...]:
        """Come from another process as it was, whatever an error is made of: else a pool takes its worker for dead."""
        return _as_it_was, (type(self), self.args, self.__dict__)


def _as_it_was(kind: type[LeafcutError], args: tuple[Any, ...], state: dict[str, Any]) -> LeafcutError:
    made = kind.__new__(kind)
    made.args = args
    made.__dict__.update(state)
    return made


class ReadError(LeafcutError):
    """A file cannot be read; says which, at which line where that is known, and why."""

    def __init__(self, file: str | Path, reason: str, line: int | None = None) -> None:
        self.file = str(file)
        self.line = line
        self.reason = brief(reason)
        place = self.file if line is None else f"{self.file}:{line}"
        super().__init__()
        self.args = (f"{place}: {self.reason}",)  # the name of a file is never cut


class OptionError(LeafcutError, ValueError):
    """An option has a value that cannot be used, or a name that does not exist."""


class DataError(OptionError):
    """A file of tools, of a material, of a machine or of a dialect is invalid, or a document has an unknown schema.

    The command line that names the file is valid, so the exit status is 1, as for any other input.
    """


class PlanError(LeafcutError):
    """The part cannot be made with these tools, depths or machine."""


class SolveError(LeafcutError):
    """A routing problem cannot be solved as asked."""


class PostError(LeafcutError):
    """The toolpath needs a word that this controller does not have, or a program cannot be put into an order.

    `section` is the number of the section, from 0, that the order is of; None where it is about all.
    """

    def __init__(self, message: str, section: int | None = None) -> None:
        self.section = section
        super().__init__(message)


class VerifyError(LeafcutError):
    """The program read back differs from the toolpath, or is not safe to run."""


class SendError(LeafcutError):
    """A program is not sent to a machine, or its run was ended: says why, and what the machine does now."""


@contextmanager
def parsing(file: str | Path, what: str, line: int | None = None) -> Iterator[None]:
    """Turn whatever a parser from elsewhere raises on a damaged file into a `ReadError`.

    `what` says what is wrong, in words: ``"the drawing could not be read"``.
    """
    try:
        yield
    except (LeafcutError, MemoryError):
        raise
    except RecursionError:
        raise ReadError(file, f"{what} (nested too deep)", line) from None
    except Exception as problem:
        reason = shown(str(problem), 120) or "no reason given"
        raise ReadError(file, f"{what} ({type(problem).__name__}: {reason})", line) from None


def close_to(name: str, known: Iterable[str]) -> str:
    """Return the known name that `name` was most likely meant to be, "" where none is near.

    A name that begins with `name`, or has it as a word, comes before names that are spelled alike: `tools` for `tool`,
    and `spindle-speed` for `speed`, not `seed`.
    """
    from difflib import get_close_matches  # start-up: seldom asked for

    name = name.lower()
    lower = {one.lower(): one for one in known}
    having = [one for one in lower if len(name) > 2 and (one.startswith(name) or name in re.split("[-_ ]", one))]
    near = sorted(having, key=lambda one: (not one.startswith(name), len(one)))[:1] or get_close_matches(
        name, lower, n=1, cutoff=0.6
    )
    return lower[near[0]] if near else ""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the known name closest to `name`, or the list of what there is.

    The end of an error message about an unknown name, the same everywhere.
    """
    known = list(known)
    near = close_to(name, known)
    if near:
        return f"; did you mean '{near}'?"
    return f"; choose one of {', '.join(known)}"


def count_of(number: int, noun: str, style: str = "") -> str:
    """Return ``1 hole`` or ``1200 holes``; with the style ``,`` it is ``1,200 holes``."""
    return f"{number:{style}} {noun}" + ("" if number == 1 else "s")
