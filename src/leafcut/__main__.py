"""`leafcut`, and `python -m leafcut`: the command line; the version is said without importing it."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from leafcut._version import __version__


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit status."""
    words = sys.argv[1:] if arguments is None else arguments
    if list(words) == ["--version"]:
        print(__version__)
        sys.exit(0)
    import atexit
    import gc

    # Most objects of a run live to its end, so Python searches for garbage less often than by default (700, 10, 10).
    gc.set_threshold(10_000, 50, 10)
    # At exit Python searches all objects for cycles, several times: a fifth of a short run.
    atexit.register(gc.freeze)
    from leafcut.cli.app import main as run

    run(arguments)


if __name__ == "__main__":
    main()
