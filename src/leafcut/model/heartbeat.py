"""Report the progress of slow steps, such as reading a file or searching, to a callback of the user interface.

The callback receives a `Progress` when a step starts, and again while the step runs. It may raise an exception to end
the work.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from leafcut.message import Message


@dataclass(frozen=True, slots=True)
class Trial:
    """An alternative that a step tries. Its name is unique.

    `figure` is the result as text, and `cost` is the result as a number. Until the result is known, they are "" and
    None.
    """

    name: str
    figure: str = ""
    cost: float | None = None


@dataclass(frozen=True, slots=True)
class Progress:
    """State of the work.

    Attributes
    ----------
    step
        Name of the running step.
    share
        Share of the work that is done, 0 to 1; 0 if unknown.
    cost
        Cost of the best result so far; None before the first result.
    gap
        Maximum gap between `cost` and the optimum, as a fraction; None without a lower bound.
    trial
        The alternative that the step tries; None if it tries no alternatives.
    """

    step: Message
    share: float = 0.0
    cost: float | None = None
    gap: float | None = None
    trial: Trial | None = None


#: Callback for progress. It must return quickly.
OnProgress = Callable[[Progress], None]


class Heartbeat(Protocol):
    """Function that a running step calls at least several times a second. It must return quickly."""

    def __call__(self, share: float = 0.0, /) -> None:
        """Report that the step is still running. `share` is the completed share, from 0 to 1, or 0 if it is unknown."""


#: Minimum interval between two reports of a running step, s.
_REPORT_INTERVAL = 0.1


def ignore_heartbeat(_: float = 0.0, /) -> None:
    """Do nothing. Steps that do not show their progress use this heartbeat."""


def heartbeat_for_step(progress: OnProgress | None, step: Message) -> Heartbeat:
    """Report the start of a step, and return a heartbeat that repeats the report while the step runs."""
    if progress is None:
        return ignore_heartbeat
    progress(Progress(step))
    last_report = time.monotonic()

    def report(share: float = 0.0, /) -> None:
        nonlocal last_report
        now = time.monotonic()
        if now - last_report >= _REPORT_INTERVAL:
            last_report = now
            progress(Progress(step, share))

    return report


def progress_for_step(
    progress: OnProgress | None, step: Message, left: float = 1.0, part: float = 1.0
) -> OnProgress | None:
    """Return a callback that forwards the progress of a search to `progress`, as the progress of the step `step`.

    `part` is the share of the search in the total work. `left` is the share of the work that remains when the search
    starts.
    """
    if progress is None:
        return None

    def report(current: Progress) -> None:
        progress(replace(current, step=step, share=1.0 - left + part * current.share))

    return report
