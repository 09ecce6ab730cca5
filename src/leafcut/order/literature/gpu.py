"""Construct tours on a GPU, with one thread per ant.

The GPU code is compiled from the source of the CPU kernel `kernels.construct.construct_tour`. Ants use the same random
numbers as on the CPU, but fused multiply-add may change the last digit of a result. On the same GPU, the same seed
always gives the same result.
"""

from __future__ import annotations

import types
from concurrent.futures import Executor
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError, printable
from leafcut.kernels.construct import Decay, Unvisited, WeightedEdges, construct_tour
from leafcut.order.construction import allocate_unvisited_buffers
from leafcut.order.instance import Instance
from leafcut.order.literature.ants import Ants, MoveSet
from leafcut.order.literature.pheromone import Trails
from leafcut.order.literature.places import Places
from leafcut.order.stop import Stop

#: Stands in for `numba.cuda` in the source of the kernel. The module is only loaded when a GPU is used.
cuda: Any = None

#: Number of threads per block. Ants take different branches at every step, so a larger block would wait for its slowest
#: thread.
_BLOCK = 32
#: A batch of ants uses at most this fraction of the free GPU memory.
_OF_FREE_MEMORY = 0.5


def check_gpu() -> None:
    """Raise SolveError if the package numba-cuda, a GPU, or its driver is missing."""
    from numba import config

    if config.ENABLE_CUDASIM:  # tests simulate CUDA threads in Python
        return
    if find_spec("numba_cuda") is None:
        raise SolveError("--parallel gpu needs the package numba-cuda: pip install 'leafcut[gpu]'")
    from numba import cuda as there

    if not there.is_available():
        raise SolveError("--parallel gpu: this machine has no CUDA GPU, or no driver for it; leave the option out")


class GpuAnts(Ants):
    """Ants that construct tours on a GPU. The CPU runs the local search in threads and computes the costs.

    If the GPU reports an error, SolveError is raised with the first line of its message.
    """

    def __init__(
        self, moves: MoveSet, trails: Trails, seed: int, stop: Stop, executor: Executor | None = None, workers: int = 1
    ) -> None:
        assert isinstance(moves, Places)
        super().__init__(moves, trails, seed, stop, executor, workers)
        self._gpu = _run_on_gpu(lambda: _TourConstructor(moves.instance, trails, self.tours))

    def _construct_all(self, words: NDArray[np.uint64]) -> int:
        _run_on_gpu(lambda: self._gpu.construct_tours(words))
        return len(self.tours)


class _TourConstructor:
    def __init__(self, instance: Instance, trails: Trails, tours: NDArray[np.int32]) -> None:
        from numba import cuda as there

        self.instance, self.trails, self.tours = instance, trails, tours
        ants, n = tours.shape
        buffers = allocate_unvisited_buffers(instance)
        bytes_of_ant = tours[0].nbytes + sum(array.nbytes for array in buffers) + np.uint64().nbytes
        free, _ = there.current_context().get_memory_info()
        self.share = int(min(max(_OF_FREE_MEMORY * free / bytes_of_ant, 1.0), ants))
        self.cost = _copy_to_gpu(instance.cost)
        self.tree = _copy_to_gpu(instance.tree)
        self.weights = there.to_device(trails.weights)
        candidates, nearness = there.to_device(instance.candidates), there.to_device(trails.nearness)
        # The weights also stand for the pheromone: only Ant Colony System, which does not run on a GPU, uses it.
        self.edges = WeightedEdges(candidates, self.weights, nearness, self.weights)
        self.unvisited = [there.device_array((self.share, len(array)), array.dtype) for array in buffers]
        self.made = there.device_array((self.share, n), tours.dtype)

    def construct_tours(self, words: NDArray[np.uint64]) -> None:
        """Construct the tours of all ants on the GPU. Changes: tours, words."""
        from numba import cuda as there

        instance, q0 = self.instance, self.trails.parameters.greedy_probability
        self.weights.copy_to_device(self.trails.weights)
        for begin in range(0, len(self.tours), self.share):
            mine = words[begin : begin + self.share]
            states = there.to_device(mine)
            blocks = -(-len(mine) // _BLOCK)
            _compile_tour_kernel()[blocks, _BLOCK](
                self.cost,
                self.tree,
                self.edges,
                q0,
                instance.first,
                instance.second,
                states,
                self.made,
                *self.unvisited,
            )
            self.tours[begin : begin + len(mine)] = self.made.copy_to_host()[: len(mine)]
            mine[:] = states.copy_to_host()


def _construct_tour_of_thread(
    cost: Any,
    tree: Any,
    edges: Any,
    greedy_probability: float,
    first: int,
    second: int,
    words: Any,
    tours: Any,
    visited: Any,
    alive: Any,
    stack: Any,
) -> None:
    ant = cuda.grid(1)
    if ant < len(words):
        construct_tour(
            cost,
            tree,
            edges,
            Decay(1.0, 0.0, 0.0),
            greedy_probability,
            first,
            second,
            words,
            ant,
            tours[ant],
            Unvisited(visited[ant], alive[ant], stack[ant]),
        )


@cache
def _compile_tour_kernel() -> Any:
    from numba import cuda as there

    return there.jit(_bind_to_gpu_kernels(_construct_tour_of_thread, {"cuda": there}))


@cache
def compile_for_gpu(function: Any) -> Any:
    """Compile a CPU kernel and the kernels it calls for the GPU, from the same source."""
    from numba import cuda as there

    return there.jit(device=True)(_bind_to_gpu_kernels(function, {}))


def _bind_to_gpu_kernels(function: Any, more: dict[str, Any]) -> Any:
    """Copy a function so that the names of kernels refer to their GPU versions."""
    source = getattr(function, "py_func", function)
    names = {**source.__globals__, **more}
    for name in source.__code__.co_names:
        if hasattr(names.get(name), "py_func"):
            names[name] = compile_for_gpu(names[name])
    return types.FunctionType(source.__code__, names, source.__name__, source.__defaults__)


def _copy_to_gpu(arrays: Any) -> Any:
    from numba import cuda as there

    return type(arrays)(*(there.to_device(one) if isinstance(one, np.ndarray) else one for one in arrays))


def _run_on_gpu(work: Any) -> Any:
    """Run a function on the GPU.

    If the driver raises an exception, convert it to a `SolveError` with its first line.
    """
    try:
        return work()
    except (ImportError, MemoryError, RuntimeError, OSError) as problem:
        line = (str(problem).strip().splitlines() or [type(problem).__name__])[0]
        raise SolveError("--parallel gpu: the GPU rejected the job ({}); leave it out", printable(line, 160)) from None
