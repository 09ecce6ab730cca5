"""Script that runs the shape nester in a subprocess.

It reads the task from standard input and writes the answer to standard output. The subprocess has two advantages: a
panic in the Rust code of the nester does not end leafcut, and a limit on steps makes a search repeatable. The script
does not import leafcut, so that it starts quickly.
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

#: Interval at which the steps of the search are checked, s.
POLL = 0.005
#: Time limit that is passed to the nester, s. The nester never reaches it, because this script ends the search earlier.
NEVER = 1_000_000
#: Kinds of step (`spyrrow.ReportType`) without a solution, because some parts still overlap. After a step of the first
#: kind, the nester gives up on the strip width.
GIVEN_UP, OVERLAPPING = 1, 2


class StripSearch:
    """The progress of a search: number of steps and failures, shortest strip, and the reason why it ended."""

    def __init__(self, task: dict[str, Any]) -> None:
        self.task = task
        self.began = time.monotonic()
        self.steps = self.failures = 0
        self.best: Any = None
        self.reason = ""

    def record_step(self, kind: int, solution: Any) -> bool:
        """Record a step, and return whether the search should stop."""
        self.steps += 1
        self.failures += kind == GIVEN_UP
        if kind not in (GIVEN_UP, OVERLAPPING) and (self.best is None or solution.width < self.best.width):
            self.best = solution
        if self.best is not None and self.best.width <= self.task["enough"]:
            self.reason = "enough"
        elif self.best is not None and (self.steps >= self.task["steps"] or self.failures >= self.task["failures"]):
            self.reason = "steps"
        return bool(self.reason)

    def is_late(self) -> bool:
        """Return whether the search should stop because it is out of time and already has a solution."""
        if self.best is not None and time.monotonic() - self.began >= self.task["seconds"]:
            self.reason = "clock"
        return bool(self.reason)

    def answer(self) -> dict[str, Any]:
        """Return the strip length, mm, the placements (index, degrees, x, y), and the reason why the search ended."""
        items = [(int(i.id), i.rotation, *i.translation) for i in self.best.placed_items]
        return {"width": self.best.width, "items": items, "steps": self.steps, "ended": self.reason}


def phase_time_limits(seconds: float) -> tuple[int, int]:
    """Return time limits for the exploration and the compression phase of the nester, s.

    Together they last at least `seconds`. The nester ignores fractions of a second, so this script ends the search
    itself.
    """
    if seconds >= NEVER:
        return NEVER, NEVER
    exploration = max(round(0.8 * seconds), 1)
    return exploration, max(math.ceil(seconds) - exploration, 1)


def pack_items(task: dict[str, Any]) -> dict[str, Any]:
    """Pack the items of a task into the shortest strip, and return the answer.

    The task has the following keys: ``height`` (of the strip), ``items`` (``shape``, ``demand``, ``angles``), ``seed``,
    and ``workers`` (threads). The search is limited by ``steps``, ``failures``, ``seconds``, and ``enough``, a length
    that is short enough.
    """
    items = [
        spyrrow.Item(str(number), [tuple(p) for p in item["shape"]], item["demand"], item["angles"])
        for number, item in enumerate(task["items"])
    ]
    instance = spyrrow.StripPackingInstance("strip", task["height"], items)
    exploration, compression = phase_time_limits(task["seconds"])
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
        working = worker.is_alive()  # check before emptying the queue, so that later solutions count in the next round
        for kind, solution in queue.drain():
            if search.record_step(int(kind), solution):
                return search.answer()
        if search.is_late():
            return search.answer()
        if not working:
            if search.best is None:
                raise SystemExit("the search ended without a result")
            search.reason = "end"
            return search.answer()
        time.sleep(POLL)


def _exit_with_parent() -> None:
    """End the process when standard input closes. Then the parent has ended or no longer needs an answer."""
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    given = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    print(json.dumps(pack_items(given)), flush=True)
    os._exit(0)  # the search thread is still running, and a normal exit would wait for it
