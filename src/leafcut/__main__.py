"""`leafcut` and `python -m leafcut`: the command line. Printing the version does not import it."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from leafcut._version import __version__


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its status."""
    given = sys.argv[1:] if arguments is None else arguments
    if list(given) == ["--version"]:
        print(__version__)
        sys.exit(0)
    from leafcut.cli.app import main as run

    run(arguments)


if __name__ == "__main__":
    main()
