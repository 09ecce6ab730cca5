"""The compiled code: small Numba kernels, one step of one algorithm each.

A kernel takes arrays, numbers and named tuples of them; it trusts its input, allocates nothing that its caller could
give, holds no state, and lets go of the GIL. With ``NUMBA_DISABLE_JIT=1`` every kernel is the plain Python it is
written in. Compiled code is kept on disk, so a machine compiles once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])

#: A gain smaller than this is rounding, not an improvement (costs are millimetres, seconds or TSPLIB's whole numbers).
EPSILON = 1e-9


def kernel(function: Function) -> Function:
    """Compile a function: cached on disk, without the GIL. The one place that holds the flags."""
    return cast(Function, numba.njit(cache=True, nogil=True)(function))
