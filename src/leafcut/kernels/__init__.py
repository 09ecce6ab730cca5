"""The compiled code: small Numba kernels, one step of one algorithm each.

A kernel takes arrays, numbers and named tuples of them; it trusts its input, allocates nothing that its caller could
give, holds no state, and lets go of the GIL. With ``NUMBA_DISABLE_JIT=1`` every kernel is the plain Python it is
written in. Compiled code is kept on disk, so a machine compiles once; where no folder can be written, every process
compiles anew, and what is damaged on the disk is removed and compiled anew (`leafcut.kernels.keeping`).

No flag of Numba's says that a kernel is compiled for plain numbers only, at a level of its own, or without what Python
needs to call it. So methods of its dispatcher are wrapped here, and its global level is changed while one kernel
compiles; what each of these saves of the first run on a machine stands beside it, and none changes an answer. For their
sake pyproject.toml caps Numba below the first version not tried; run tests/kernels and tests/solve to raise it.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import config, types

from leafcut.kernels.keeping import keep

Function = TypeVar("Function", bound=Callable[..., object])

#: A gain smaller than this is rounding, not an improvement (costs are millimetres, seconds or TSPLIB's whole numbers).
EPSILON = 1e-9

#: LLVM's level of optimisation. Measured on the colony: 1 makes code as fast as 3 does, in an eighth less time.
LEVEL = 1

_compiling = threading.RLock()


def kernel(function: Function) -> Function:
    """Compile a function that Python calls: without the GIL, and kept on disk where that can be.

    With `part` the one place that holds the flags.
    """
    return cast(Function, keep(_compiled(function)))


def part(function: Function) -> Function:
    """Compile a function that kernels call, and Python in tests at most: it is cached as a part of the kernels.

    What kernels call is a twin that Python could not call: what makes that possible is a fifth of a compilation.
    """
    compiled = _compiled(function)
    if hasattr(compiled, "get_call_template"):
        twin = functools.cache(lambda: _compiled(function, no_cpython_wrapper=True))
        compiled.get_call_template = lambda args, kws: twin().get_call_template(args, kws)
        compiled.get_overload = lambda signature: twin().get_overload(signature)
    return cast(Function, compiled)


def _compiled(function: Callable[..., object], **flags: bool) -> Any:
    # Kernels allocate nothing, so no references are counted: a sixth less to compile.
    compiled = numba.njit(nogil=True, no_cfunc_wrapper=True, _nrt=False, **flags)(function)
    if hasattr(compiled, "get_call_template"):  # not so when compiling is off
        compiled.get_call_template = _with_plain_numbers(compiled.get_call_template)
        compiled.compile = _at_level(compiled.compile)
    return compiled


def _with_plain_numbers(get_call_template: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Have a kernel that another one calls compiled once, not again for every constant and width of whole number.

    Numba gives ``f(0)``, ``f(1)`` and ``f(i)`` a compilation each; that was a quarter of all that is compiled.
    """

    def plain(given: Any) -> Any:
        kind = types.unliteral(given)  # type: ignore[attr-defined]  # numba has no types
        return types.int64 if kind in (types.int8, types.uint8, types.int16, types.int32) else kind

    return lambda args, kws: get_call_template(tuple(map(plain, args)), {name: plain(k) for name, k in kws.items()})


def _at_level(compile_it: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Compile at `LEVEL`; Numba knows one level for a whole process, so it is set back at once."""

    def compile_at_level(signature: Any) -> Any:
        with _compiling:
            usual = config.OPT
            config.OPT = type(usual)(min(int(usual), LEVEL))
            try:
                return compile_it(signature)
            finally:
                config.OPT = usual

    return compile_at_level
