"""Random numbers with explicit state: one 64-bit word per ant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import kernel, part

_A, _B, _C, _MANTISSA = np.uint64(13), np.uint64(7), np.uint64(17), np.uint64(11)
_SCALE = 1.0 / 9007199254740992.0  # 2**-53


@kernel
def uniform(words: NDArray, k: int) -> float:
    """Return a number in [0, 1) and advance the word ``words[k]`` (uint64, never 0).

    Changes: words[k].
    Source: G. Marsaglia, Xorshift RNGs, J. Statistical Software 8 (2003), triple (13, 7, 17).
    """
    word = words[k]
    word ^= word << _A
    word ^= word >> _B
    word ^= word << _C
    words[k] = word
    return float(word >> _MANTISSA) * _SCALE


@part
def below(words: NDArray, k: int, n: int) -> int:
    """Return an integer in 0 … n - 1. Changes: words[k]."""
    return int(uniform(words, k) * n)
