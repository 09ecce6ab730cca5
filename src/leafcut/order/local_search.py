"""The friendly side of the local-search kernels: buffers, and stopping in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.local_search import improve, queue_all
from leafcut.order.instance import Instance
from leafcut.order.stop import Stop

#: Moves between two looks at the clock: some milliseconds of work.
MOVES_PER_LOOK = 2000


@dataclass(frozen=True, eq=False)
class LocalSearch:
    """2-opt, with Or-opt if wanted, on the candidate lists of one instance; one object per worker."""

    instance: Instance
    place: NDArray[np.int32]
    queue: NDArray[np.int32]
    queued: NDArray[np.uint8]
    state: NDArray[np.int64]
    touched: NDArray[np.int32]
    use_or_opt: bool

    @classmethod
    def of(cls, instance: Instance, use_or_opt: bool = True) -> LocalSearch:
        """Return a local search with buffers of its own."""
        n = instance.n
        place, queue = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
        queued, touched = np.zeros(n, dtype=np.uint8), np.zeros(8, dtype=np.int32)
        return cls(instance, place, queue, queued, np.zeros(2, dtype=np.int64), touched, use_or_opt)

    def __call__(self, tour: NDArray[np.int32], stop: Stop) -> None:
        """Improve the tour int32[n] in place to a local optimum, or until `stop.now()`."""
        queue_all(tour, self.place, self.queue, self.queued, self.state)
        cost, lists = self.instance.cost, self.instance.candidates
        while True:
            moves = improve(
                cost, tour, self.place, lists, self.queue, self.queued, self.state, self.touched, self.use_or_opt,
                MOVES_PER_LOOK,
            )  # fmt: skip
            if moves < MOVES_PER_LOOK or stop.now():
                return
