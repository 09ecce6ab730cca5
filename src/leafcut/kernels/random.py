"""Random numbers with an explicit state. Each ant has one 64-bit word."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

_A, _B, _C, _MANTISSA = np.uint64(13), np.uint64(7), np.uint64(17), np.uint64(11)
_SCALE = 1.0 / 9007199254740992.0  # 2**-53


@kernel
def random_uniform(states: NDArray, k: int) -> float:
    """Draw a random number from [0, 1) and advance the state ``states[k]`` (uint64, never 0).

    Changes: states[k].
    Source: G. Marsaglia, Xorshift RNGs, J. Statistical Software 8 (2003), triple (13, 7, 17).
    """
    state = states[k]
    state ^= state << _A
    state ^= state >> _B
    state ^= state << _C
    states[k] = state
    return float(state >> _MANTISSA) * _SCALE


@inner_kernel
def random_below(states: NDArray, k: int, n: int) -> int:
    """Draw a random integer from 0 … n - 1. Changes: states[k]."""
    return int(random_uniform(states, k) * n)
