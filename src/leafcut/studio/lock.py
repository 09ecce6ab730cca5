"""Lock of the studio's folder. A second studio would mark running jobs as interrupted and delete their files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from leafcut.files.whole_files import OutputError
from leafcut.message import Message

#: Position of the locked byte, beyond all content, so that other studios can read the owner's address.
_BYTE = 1 << 20


@contextmanager
def lock_folder(root: Path, address: str) -> Iterator[None]:
    """Lock a folder during the context; create the folder if necessary.

    The operating system releases the lock, however the process ends. A second studio shows `address`, which is the
    address of this studio. Raise `OutputError` if another studio holds the lock, or the folder cannot be written.
    """
    file = root / "lock"
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        number = os.open(file, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as problem:
        raise OutputError("{}: cannot write to the studio's folder ({})", root, problem.strerror) from None
    try:
        if not _is_locked(number):
            other_address = os.read(number, 200).decode("ascii", "ignore")
            place = Message(" at {}", other_address) if other_address.isprintable() and other_address else ""
            raise OutputError(
                "a studio is already running{}; use that one, or stop it first: both would write to {}", place, root
            )
        os.ftruncate(number, 0)
        os.write(number, address.encode("ascii"))
        yield
    finally:
        with suppress(OSError):
            os.close(number)


def _is_locked(number: int) -> bool:
    """Lock a byte of an open file; return False if another process holds it.

    Return True if the file system does not support locks.
    """
    try:
        import fcntl
    except ImportError:
        import msvcrt

        os.lseek(number, _BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(number, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
        except OSError:
            return False
        finally:
            os.lseek(number, 0, os.SEEK_SET)
        return True
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
