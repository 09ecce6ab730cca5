"""Runs kernels as the Python they are written in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from leafcut.kernels.random import random_uniform

#: Numba's type of a compiled function.
Kernel: Any = type(random_uniform)


@contextmanager
def plain_python() -> Iterator[None]:
    """Run all kernels as plain Python, so that a small case does not wait for the compiler."""

    def call(kernel: Any, *arguments: Any, **named: Any) -> Any:
        return kernel.py_func(*arguments, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Kernel, "__call__", call)
        yield


@pytest.fixture
def plain_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run kernels that only kernels call as plain Python, and all others compiled.

    The first kind has no machine code that Python can call.
    """
    compiled = Kernel.__call__

    def call(kernel: Any, *arguments: Any, **named: Any) -> Any:
        if is_part(kernel):
            return kernel.py_func(*arguments, **named)
        return compiled(kernel, *arguments, **named)

    monkeypatch.setattr(Kernel, "__call__", call)


def is_part(kernel: Any) -> bool:
    """Return whether only kernels may call a kernel."""
    return bool(kernel.targetoptions.get("no_cpython_wrapper"))
