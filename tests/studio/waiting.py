"""Waiting for what comes when it comes: on a busy machine that may take its time."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest


def until(true: Callable[[], object], seconds: float = 120.0) -> None:
    """Wait for something; how long it takes is no test's business, but that it comes at all."""
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            pytest.fail("it never came")
        time.sleep(0.05)  # to look takes work, too, which who is waited for would need
