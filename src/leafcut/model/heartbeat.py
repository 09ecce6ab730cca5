"""What stages that may take long call as they go on: whoever waits is told, and may end them by an exception."""

from __future__ import annotations

from collections.abc import Callable

#: Called several times a second at least; must be quick.
Look = Callable[[], None]


def unseen() -> None:
    """Nobody waits."""
