"""Compiled code: small Numba kernels. Each kernel performs a single step of an algorithm.

A kernel takes arrays, numbers, and named tuples of these. It does not validate its input, keeps no state, and releases
the GIL. The caller provides all buffers. With ``NUMBA_DISABLE_JIT=1``, each kernel is plain Python.

Numba compiles a kernel when it is first called with new types, and caches the code on disk. However, Numba does not
notice changes in other files, such as a called function or a constant. The name of the cache folder therefore contains
a digest of all sources in this folder, and kernels use no leafcut code from other packages.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

Function = TypeVar("Function", bound=Callable[..., object])
ConstantT = TypeVar("ConstantT", bool, int)

#: Numba events. PREPARE occurs when Numba loads or compiles a function while other threads wait. COMPILE occurs when
#: Numba compiles a function.
PREPARE, COMPILE = "numba:compiler_lock", "numba:compile"

#: These functions are called at each event with the kind of the event. The second argument is True when the event
#: starts and False when it ends.
listeners: list[Callable[[str, bool], None]] = []

#: Gains below this value count as rounding errors. Costs are in mm, in s, or integers (TSPLIB).
EPSILON = 1e-9


def kernel(function: Function) -> Function:
    """Compile a function that Python code calls."""
    return _compile(function)


def inner_kernel(function: Function) -> Function:
    """Compile a function that only other kernels call. It gets no wrappers for Python and C."""
    return _compile(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def typed_constant(value: ConstantT) -> ConstantT:
    """Return a constant with a NumPy type.

    If the constant had a Python type, Numba would compile the called function again for each value.
    """
    return cast(ConstantT, np.bool_(value) if isinstance(value, bool) else np.int64(value))


#: Stands for "no node".
NONE = typed_constant(-1)


def _compile(function: Function, **flags: Any) -> Function:
    import numba

    install_compilation_listener()
    folder = cache_folder()
    # Numba reads the cache folder when it decorates a function. The cache folder of other packages does not change.
    previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder or "")
    try:
        # Kernels allocate nothing. Reference counts of arrays made directed local search four times slower.
        return cast(Function, numba.njit(nogil=True, cache=folder is not None, _nrt=False, **flags)(function))
    finally:
        numba.config.CACHE_DIR = previous


@functools.cache
def install_compilation_listener() -> None:
    """Notify `listeners` whenever Numba loads or compiles a function."""
    from numba.core import event

    class Listener(event.Listener):  # type: ignore[misc]  # numba has no types
        def on_start(self, event: event.Event) -> None:
            self._report(event, True)

        def on_end(self, event: event.Event) -> None:
            self._report(event, False)

        def _report(self, event: event.Event, starts: bool) -> None:
            for listener in tuple(listeners):
                listener(event.kind, starts)

    for kind in (PREPARE, COMPILE):
        event.register(kind, Listener())


@functools.cache
def cache_folder() -> Path | None:
    """Return the folder for compiled code, or None if it is not writable.

    The folder is inside ``NUMBA_CACHE_DIR`` if that variable is set, and otherwise inside the user's cache folder.
    """
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        text = file.read_bytes()
        digest.update(f"{file.name} {len(text)} ".encode() + text)
    try:
        folder = _cache_root() / f"kernels-{digest.hexdigest()[:16]}"
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):  # RuntimeError: a user without a home folder
        return None


def _cache_root() -> Path:
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    if chosen := os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME"):
        return Path(chosen) / "leafcut"
    return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "leafcut"
