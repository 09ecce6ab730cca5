"""Workers: shares of the work, spread over threads or any other executor."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.order.instance import Instance
from leafcut.order.statistics import WorkerLog
from leafcut.order.stop import Stop

#: What comes of a share of the work: tours int32[m, n], and their costs float64[m].
Share = tuple[NDArray[np.int32], NDArray[np.float64]]


@dataclass(frozen=True)
class Workers:
    """Where work is done.

    Attributes
    ----------
    executor
        Any of `concurrent.futures`, or None: all is done here.
    count
        How many workers it has.
    shared
        Whether they see this memory. Those that do not (other processes, other machines) are not told to stop, but
        finish what they have begun.
    """

    executor: Executor | None
    count: int
    stop: Stop
    log: WorkerLog
    shared: bool = True

    def shares(self, work: Callable[..., Share], instance: Instance, items: list[Any]) -> list[Share]:
        """Return what ``work(instance, item, stop)`` returns for every item, in their order.

        The answer does not depend on the number of workers.
        """
        if self.executor is None:
            done = [_timed(work, instance, item, self.stop) for item in items]
        else:
            stop = self.stop if self.shared else None
            jobs = [self.executor.submit(_timed, work, instance, item, stop) for item in items]
            done = [job.result() for job in jobs]
        for who, seconds, (_, costs) in done:
            self.log.add(self.log.number(who), len(costs), seconds, float(costs.min(initial=math.inf)))
        return [share for _, _, share in done]

    def spread(self, work: Callable[..., Share], instance: Instance, items: list[Any]) -> Share:
        """As `shares`, with one below the other."""
        tours, costs = zip(*self.shares(work, instance, items), strict=True)
        return np.concatenate(tours), np.concatenate(costs)


def _timed(
    work: Callable[..., Share], instance: Instance, item: Any, stop: Stop | None
) -> tuple[tuple[int, int], float, Share]:
    """Do a share of work; return who did it, and in how many seconds."""
    began = time.perf_counter()
    share = work(instance, item, stop)
    return (os.getpid(), threading.get_ident()), time.perf_counter() - began, share
