"""How those who wait are told: one call for all that takes long, from reading a file to a search.

Whoever is told may end the work by an exception. What is begun is told by its words, and again as it goes on.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

#: Told about the work as it goes: (what is being done, cost so far or None, share done 0 … 1, how far at most the cost
#: is above the least possible as a fraction, or None where no bound is known yet). Must be quick.
Progress = Callable[[str, float | None, float, float | None], None]


class Heartbeat(Protocol):
    """Called by a stage as it goes on, several times a second at least; must be quick."""

    def __call__(self, share: float = 0.0, /) -> None:
        """Note that the stage goes on; `share` of it, 0 … 1, is done, 0 where the stage does not know."""


#: Who waits is told this often, at most, that a stage goes on, s.
_TOLD_AGAIN = 0.1


class Trial(str):
    """Words about one of several ways that are tried in turn; a progress is told it in the place of plain words.

    Attributes
    ----------
    name
        Of the way, and of no other one.
    figure, cost
        What came of it, for people and to be compared: the less, the better; "" and None as long as that is not known.
    """

    name: str
    figure: str
    cost: float | None


def trial(words: str, name: str, figure: str = "", cost: float | None = None) -> Trial:
    """Return words about a way that is tried."""
    made = Trial(words)
    made.name, made.figure, made.cost = name, figure, cost
    return made


def unseen(_: float = 0.0, /) -> None:
    """Nobody waits."""


def looking_for(progress: Progress | None, what: str) -> Heartbeat:
    """Tell what is begun; return what tells the same again, now and then."""
    if progress is None:
        return unseen
    progress(what, None, 0.0, None)
    told = time.monotonic()

    def look(share: float = 0.0, /) -> None:
        nonlocal told
        now = time.monotonic()
        if now - told >= _TOLD_AGAIN:
            told = now
            progress(what, None, share, None)

    return look


def passing_on(progress: Progress | None, what: str, left: float = 1.0, part: float = 1.0) -> Progress | None:
    """Return what a search tells its progress to, by the name `what`.

    It does `part` of the whole work, of which `left` is left.
    """
    if progress is None:
        return None

    def tell(_: str, cost: float | None, share: float, gap: float | None) -> None:
        progress(what, cost, 1.0 - left + part * share, gap)

    return tell
