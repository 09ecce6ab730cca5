"""`Fact`: a result of a run, stated once for the summary, the JSON answer, the report page and the studio."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fact:
    """A line of the summary: its name, its words, and how it is set (a style of `rich`, or nothing)."""

    name: str
    words: str
    style: str = ""


@dataclass(frozen=True)
class SummaryTable:
    """The table of the summary: titles, the first of them of the names, and rows of cells; `ours` is set in bold."""

    titles: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    ours: tuple[bool, ...]
    #: Columns of blanks between two columns; fewer where there are many.
    apart: int = 3
