"""Kernels that only kernels call run as plain Python here."""

from __future__ import annotations

import pytest

from plain_python import plain_parts

__all__ = ["plain_parts"]


@pytest.fixture(autouse=True)
def _plain(plain_parts: None) -> None:
    """Use it in every case."""
