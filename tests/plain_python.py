"""Runs kernels as the Python they are written in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from leafcut.kernels.calling import Kernel


@contextmanager
def plain_python() -> Iterator[None]:
    """Run all kernels as plain Python, so that a small case does not wait for the compiler."""

    def call(kernel: Kernel, *arguments: Any, **named: Any) -> Any:
        return kernel.py_func(*arguments, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Kernel, "__call__", call)
        yield
