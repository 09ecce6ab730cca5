"""What opens the studio: addresses that work once, a token for programs, and cookies that end.

Everybody on this machine can read the command lines of its processes, and the browser's holds what it was told to open.
Therefore it is told a file that only its owner can read, which sends it on to the address (as Jupyter does), and an
address is of no use to anybody once it was used.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from html import escape
from pathlib import Path

from leafcut.files.whole_files import OutputError

#: A cookie ends so many seconds after the page was last loaded.
COOKIE_SECONDS = 12 * 3600
#: Addresses that were not used yet; the oldest goes when there are more.
_MOST_UNUSED = 8


class StudioKeys:
    """The keys of one studio.

    Parameters
    ----------
    secret
        What cookies are made of; kept over a restart, so that a page that is open stays open.
    clock
        Seconds since the epoch.

    Attributes
    ----------
    token
        What programs send in an ``Authorization`` header.
    """

    def __init__(self, secret: bytes, clock: Callable[[], float] = time.time) -> None:
        self.token = secrets.token_urlsafe(24)
        self._secret, self._clock = secret, clock
        self._unused: list[str] = []

    def is_token(self, word: str) -> bool:
        """Return whether a word is the token of programs."""
        return hmac.compare_digest(word.encode(), self.token.encode())

    def new_entry(self) -> str:
        """Return a word that lets one browser in, once."""
        made = secrets.token_urlsafe(24)
        self._unused = [*self._unused[1 - _MOST_UNUSED :], made]
        return made

    def enter(self, word: str) -> bool:
        """Return whether a word lets a browser in; it does so no more then."""
        for one in self._unused:
            if hmac.compare_digest(one.encode(), word.encode()):
                self._unused.remove(one)
                return True
        return False

    def new_cookie(self) -> str:
        """Return the value of a cookie that holds from now on for `COOKIE_SECONDS`."""
        end = str(int(self._clock()) + COOKIE_SECONDS)
        return f"{end}.{self._signed(end)}"

    def is_cookie(self, value: str) -> bool:
        """Return whether a cookie is one of this studio and has not ended."""
        end, _, signature = value.partition(".")
        known = hmac.compare_digest(signature.encode(), self._signed(end).encode())
        return known and int(end) > self._clock()

    def _signed(self, end: str) -> str:
        return hmac.new(self._secret, f"leafcut studio {end}".encode(), hashlib.sha256).hexdigest()


def kept_secret(root: Path) -> bytes:
    """Return the secret of a studio's folder; made where there is none yet.

    Raises
    ------
    OutputError
        It cannot be kept.
    """
    file = root / "key"
    try:
        if not file.is_file() or file.stat().st_size != 32:
            write_private(file, secrets.token_bytes(32))
        return file.read_bytes()
    except OSError as problem:
        raise OutputError(f"{file}: cannot save the studio's key ({problem.strerror})") from None


def write_private(file: Path, data: bytes) -> None:
    """Write a file that nobody else can read at any moment."""
    with suppress(FileNotFoundError):
        file.unlink()
    number = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(number, "wb") as opened:
        opened.write(data)


def page_that_goes_to(address: str) -> bytes:
    """Return a page that sends the browser on to an address."""
    to = escape(address, quote=True)
    return (
        '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
        f'<meta http-equiv="refresh" content="0; url={to}"><title>leafcut studio</title>'
        f'<p><a href="{to}">leafcut studio</a></p>\n'
    ).encode()
