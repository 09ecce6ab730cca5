"""The irregular nester in a process of its own: one strip, read from standard input, answered on standard output.

Run as a script. Whatever the nester does there, a panic of its Rust code or a search without end, leafcut lives on; and
it can be ended after a number of steps. The steps of one seed are always the same, however long they take, so a search
that ends by their number can be repeated; its own clock it never asks.

Imports nothing of leafcut: it starts in a moment.
"""

from __future__ import annotations

import json
import math
import os
import sys
import threading
import time
from typing import Any

import spyrrow

#: How often the steps made so far are looked at, s.
POLL = 0.005
#: A limit that is never reached: the search is ended from here, s.
NEVER = 1_000_000
#: Kinds of step (numbers of `spyrrow.ReportType`) that carry no answer: parts still overlap. After the first of them
#: the nester has given up on a width.
GIVEN_UP, OVERLAPPING = 1, 2


class StripSearch:
    """The steps of a search so far, and the narrowest strip among them."""

    def __init__(self, task: dict[str, Any]) -> None:
        self.task = task
        self.began = time.monotonic()
        self.steps = self.failures = 0
        self.best: Any = None
        self.reason = ""

    def take(self, kind: int, solution: Any) -> bool:
        """Take the next step; return whether to stop there."""
        self.steps += 1
        self.failures += kind == GIVEN_UP
        if kind not in (GIVEN_UP, OVERLAPPING) and (self.best is None or solution.width < self.best.width):
            self.best = solution
        if self.best is not None and self.best.width <= self.task["enough"]:
            self.reason = "enough"
        elif self.best is not None and (self.steps >= self.task["steps"] or self.failures >= self.task["failures"]):
            self.reason = "steps"
        return bool(self.reason)

    def late(self) -> bool:
        """Return whether the time is over and there is an answer."""
        if self.best is not None and time.monotonic() - self.began >= self.task["seconds"]:
            self.reason = "clock"
        return bool(self.reason)

    def answer(self) -> dict[str, Any]:
        """Return the strip's width, where everything lies (id, degrees, x, y), and what ended the search."""
        items = [(int(i.id), i.rotation, *i.translation) for i in self.best.placed_items]
        return {"width": self.best.width, "items": items, "steps": self.steps, "ended": self.reason}


def phases(seconds: float) -> tuple[int, int]:
    """Return the seconds of exploration and compression, whole numbers, together no less than the time of the search.

    The search is ended from here: by its own clock it would lose the rest of a second of each phase.
    """
    if seconds >= NEVER:
        return NEVER, NEVER
    exploration = max(round(0.8 * seconds), 1)
    return exploration, max(math.ceil(seconds) - exploration, 1)


def solve(task: dict[str, Any]) -> dict[str, Any]:
    """Return the answer to a task.

    ``height`` of the strip, ``items`` (``shape``, ``demand``, ``angles``), ``seed``, and what ends the search:
    ``steps``, ``failures``, ``seconds``, or a strip as narrow as ``enough``. ``workers``: number of its threads.
    """
    items = [
        spyrrow.Item(str(number), [tuple(p) for p in item["shape"]], item["demand"], item["angles"])
        for number, item in enumerate(task["items"])
    ]
    instance = spyrrow.StripPackingInstance("strip", task["height"], items)
    exploration, compression = phases(task["seconds"])
    config = spyrrow.StripPackingConfig(
        early_termination=True,
        total_computation_time=None,
        exploration_time=exploration,
        compression_time=compression,
        num_workers=task["workers"],
        seed=task["seed"],
    )
    queue = spyrrow.ProgressQueue()
    search = StripSearch(task)
    worker = threading.Thread(target=instance.solve, args=(config, queue), daemon=True)
    worker.start()
    while True:
        working = worker.is_alive()  # asked before the queue is emptied: what comes after is seen in the next round
        for kind, solution in queue.drain():
            if search.take(int(kind), solution):
                return search.answer()
        if search.late():
            return search.answer()
        if not working:
            if search.best is None:
                raise SystemExit("the search ended without an answer")
            search.reason = "end"
            return search.answer()
        time.sleep(POLL)


def _leave_with_the_parent() -> None:
    """End when standard input is closed: the one who asked is gone, or wants no answer any more."""
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    given = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_leave_with_the_parent, daemon=True).start()
    print(json.dumps(solve(given)), flush=True)
    os._exit(0)  # the search goes on in its thread and would be waited for
