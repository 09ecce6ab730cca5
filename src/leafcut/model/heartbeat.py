"""Progress of all slow steps, from reading a file to a search: one callback for the user interface.

The callback receives a `Progress` when a step starts, and again while it runs. It may raise an exception to end the
work.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Trial:
    """An alternative with a unique name; `figure` (in words) and `cost` are "" and None until its result is known."""

    name: str
    figure: str = ""
    cost: float | None = None


@dataclass(frozen=True, slots=True)
class Progress:
    """State of the work.

    Attributes
    ----------
    step
        Name of the step that runs.
    share
        Fraction of the work that is done, 0 to 1; 0 if it is not known.
    cost
        Cost of the best result yet; None before the first.
    gap
        Largest gap of `cost` to the optimum, as a fraction; None without a lower bound.
    trial
        The alternative that the step tries; None if it tries none.
    """

    step: str
    share: float = 0.0
    cost: float | None = None
    gap: float | None = None
    trial: Trial | None = None


#: Callback for progress; must be quick.
OnProgress = Callable[[Progress], None]


class Heartbeat(Protocol):
    """Callback for a running step, which calls it at least several times a second; must be quick."""

    def __call__(self, share: float = 0.0, /) -> None:
        """Report that the step is running; `share` is the fraction done, from 0 to 1, or 0 if it is not known."""


#: Minimum interval between two reports of a running step, s.
_REPORT_INTERVAL = 0.1


def unseen(_: float = 0.0, /) -> None:
    """Ignore the report."""


def looking_for(progress: OnProgress | None, step: str) -> Heartbeat:
    """Report the start of a step; return a heartbeat that reports it again while it runs."""
    if progress is None:
        return unseen
    progress(Progress(step))
    last_report = time.monotonic()

    def report(share: float = 0.0, /) -> None:
        nonlocal last_report
        now = time.monotonic()
        if now - last_report >= _REPORT_INTERVAL:
            last_report = now
            progress(Progress(step, share))

    return report


def passing_on(progress: OnProgress | None, step: str, left: float = 1.0, part: float = 1.0) -> OnProgress | None:
    """Return the progress callback of a search, reported as the step `step`.

    The search does `part` of the whole work; `left` is the remaining share at its start. Both are fractions.
    """
    if progress is None:
        return None

    def report(current: Progress) -> None:
        progress(replace(current, step=step, share=1.0 - left + part * current.share))

    return report
