"""`Fact`: a result of a run. The summary, the JSON answer, the report page and the studio all use the same facts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Fact:
    """A result of a run.

    Attributes
    ----------
    key
        Path in the JSON answer: names joined by dots. "" for a fact that is not in the JSON answer.
    value
        A number, a text, or lists and dicts of numbers and texts.
    unit
        Unit of a number: s, mm, mm², % or °; "" for a count (int) and a cost (float).
    sentence
        Text for users; "" for a value that only scripts need.
    name
        Heading of value and sentence. A fact without a name is part of the title.
    of_search
        Whether the fact is about the search, not about the program. The summary shows such a fact only to users who set
        a search option.
    """

    key: str = ""
    value: Any = None
    unit: str = ""
    sentence: str = ""
    name: str = ""
    of_search: bool = False
