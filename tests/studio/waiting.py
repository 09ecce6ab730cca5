"""Waiting for events, with long limits for busy machines."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest


def until(true: Callable[[], object], seconds: float = 120.0) -> None:
    """Wait for something; how long it takes is no test's business, but that it comes at all."""
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            pytest.fail("it never came")
        time.sleep(0.05)  # to look takes work, too, which who is waited for would need


def has_ended(number: int) -> bool:
    """Return whether a process has ended; the system may keep its number for a while."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return True
    state = Path(f"/proc/{number}/stat")
    return state.is_file() and state.read_text().rpartition(") ")[2].startswith("Z")
