"""Progress of all slow steps, from reading a file to a search: one callback for the user interface.

The callback receives the name of each step when it begins, and again while it runs. It may raise an exception to end
the work.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

#: Callback for progress: (name of the step, cost of the best result or None, fraction done from 0 to 1, largest gap of
#: the cost to the optimum as a fraction, or None without a bound). Must be quick.
Progress = Callable[[str, float | None, float, float | None], None]


class Heartbeat(Protocol):
    """Callback for a running step, which calls it at least several times a second; must be quick."""

    def __call__(self, share: float = 0.0, /) -> None:
        """Report that the step is running; `share` is the fraction done, from 0 to 1, or 0 if it is not known."""


#: Least time between two reports of a running step, s.
_TOLD_AGAIN = 0.1


class Trial(str):
    """Name of a step that tries one of several alternatives in turn; a progress callback receives it as a step's name.

    Attributes
    ----------
    name
        Unique name of the alternative.
    figure, cost
        Its result in words and as a cost to compare; "" and None until it is known.
    """

    name: str
    figure: str
    cost: float | None


def trial(words: str, name: str, figure: str = "", cost: float | None = None) -> Trial:
    """Return the name of a step that tries an alternative."""
    made = Trial(words)
    made.name, made.figure, made.cost = name, figure, cost
    return made


def unseen(_: float = 0.0, /) -> None:
    """Ignore the report."""


def looking_for(progress: Progress | None, what: str) -> Heartbeat:
    """Report the beginning of a step; return a heartbeat that reports it again while it runs."""
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
    """Return the progress callback of a search, reported as the step `what`.

    The search does `part` of the whole work, of which `left` is not done when it begins. Both are fractions.
    """
    if progress is None:
        return None

    def tell(_: str, cost: float | None, share: float, gap: float | None) -> None:
        progress(what, cost, 1.0 - left + part * share, gap)

    return tell
