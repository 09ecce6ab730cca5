"""Lock of the studio's folder.

Without it, a second studio in the same folder would mark running jobs as interrupted and delete their files.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from leafcut.files.whole_files import OutputError
from leafcut.message import Message


@contextmanager
def lock_folder(root: Path, address: str) -> Iterator[None]:
    """Lock a folder during the context; create the folder if necessary.

    The operating system releases the lock even if the process is killed. `address` is the address of this studio, for
    the message of a second studio. Raise `OutputError` if another studio holds the lock, or the folder cannot be
    written.
    """
    with closing(_locked(root, address)):
        yield


def _locked(root: Path, address: str) -> sqlite3.Connection:
    """Return a connection to an empty database that no other process can lock."""
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        connection = sqlite3.connect(root / "lock.sqlite", timeout=0.0, isolation_level=None)
        connection.execute("BEGIN EXCLUSIVE")
        (root / "address").write_text(address, encoding="ascii")
    except (OSError, sqlite3.OperationalError) as problem:
        if getattr(problem, "sqlite_errorcode", None) != sqlite3.SQLITE_BUSY:
            reason = getattr(problem, "strerror", None) or problem
            raise OutputError("{}: cannot write to the studio's folder ({})", root, reason) from None
    else:
        return connection
    place: Message | str = ""
    with suppress(OSError, UnicodeDecodeError):
        place = Message(" at {}", (root / "address").read_text(encoding="ascii"))
    raise OutputError(
        "a studio is already running{}; use that one, or stop it first: both would write to {}", place, root
    )
