"""Every error that leafcut raises on purpose, in one tree.

    LeafcutError
    ├── ReadError      a file cannot be read, or what it says cannot be meant
    ├── OptionError    an option, a machine or a tool library is wrong (also a ValueError)
    ├── PlanError      the part cannot be made as asked
    ├── SolveError     a routing problem cannot be solved as asked
    ├── PostError      the toolpath cannot be said in this controller's words
    └── VerifyError    what was written is not what was planned, or is not safe

A message says what was found, what was expected and what to do; it is one line.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


class LeafcutError(Exception):
    """The root: catch this to catch all that leafcut raises on purpose."""


class ReadError(LeafcutError):
    """A file cannot be read; says which, at which line where that is known, and why."""

    def __init__(self, file: str | Path, reason: str, line: int | None = None) -> None:
        self.file = str(file)
        self.line = line
        self.reason = reason
        place = self.file if line is None else f"{self.file}:{line}"
        super().__init__(f"{place}: {reason}")


class OptionError(LeafcutError, ValueError):
    """An option has a value that cannot be used, or a name that does not exist."""


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


def nearest(name: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the known name closest to `name`, or the list of what there is.

    The end of an error message about an unknown name, the same everywhere.
    """
    known = list(known)
    found = get_close_matches(name.lower(), [k.lower() for k in known], n=1, cutoff=0.5)
    if found:
        original = next(k for k in known if k.lower() == found[0])
        return f"; did you mean '{original}'?"
    return f"; there are: {', '.join(known)}"
