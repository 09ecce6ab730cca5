"""The compiled code: small Numba kernels, one step of one algorithm each.

A kernel takes arrays, numbers and named tuples of them; it trusts its input, allocates nothing that its caller could
give, holds no state, and lets go of the GIL. With ``NUMBA_DISABLE_JIT=1`` every kernel is the plain Python it is
written in.

Numba is imported only to compile. A kernel's machine code comes with the wheel or lies on disk from the first run on
(`leafcut.kernels.keeping`), and is called without Numba (`leafcut.kernels.calling`): importing Numba and having it load
its own files took longer than all else of a small job. `leafcut.kernels.compiling` holds the flags.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar, cast

from leafcut.kernels.calling import Kernel

Function = TypeVar("Function", bound=Callable[..., object])

#: A gain smaller than this is rounding, not an improvement (costs are millimetres, seconds or TSPLIB's whole numbers).
EPSILON = 1e-9


def kernel(function: Function) -> Function:
    """Compile a function that Python calls, for each kind of arguments when it is first called with them."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return function
    return cast(Function, Kernel(function))


#: Marks a function that only kernels call, and Python in tests at most. It is compiled into those that call it.
part = kernel
