"""Access to the studio: addresses that work once, a token for programs, and cookies that expire.

Every user of this computer can read the command lines of all processes, including an address that is passed to a
browser. For this reason, the browser opens a file that only its owner can read. Like in Jupyter, this file redirects to
the address. Each address works only once.
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

#: Lifetime of a cookie after the page was last loaded, s.
COOKIE_SECONDS = 12 * 3600
#: Maximum number of unused addresses. If there are more, the oldest address is dropped.
_MAX_UNUSED = 8


class StudioKeys:
    """The keys of a studio.

    Attributes
    ----------
    secret
        Key that signs the cookies. It survives a restart, so that open pages remain valid.
    clock
        Returns the seconds since the epoch.
    token
        Token that programs send in an ``Authorization`` header.
    """

    def __init__(self, secret: bytes, clock: Callable[[], float] = time.time) -> None:
        self.token = secrets.token_urlsafe(24)
        self._secret, self._clock = secret, clock
        self._unused: list[str] = []

    def is_token(self, word: str) -> bool:
        """Return whether a text is the token for programs."""
        return hmac.compare_digest(word.encode(), self.token.encode())

    def new_entry(self) -> str:
        """Create a key that admits a single browser, once."""
        key = secrets.token_urlsafe(24)
        self._unused = [*self._unused[1 - _MAX_UNUSED :], key]
        return key

    def redeem_entry(self, word: str) -> bool:
        """Return whether a key admits a browser. The key becomes invalid."""
        for unused in self._unused:
            if hmac.compare_digest(unused.encode(), word.encode()):
                self._unused.remove(unused)
                return True
        return False

    def new_cookie(self) -> str:
        """Create the value of a new cookie. It is valid for `COOKIE_SECONDS`."""
        end = str(int(self._clock()) + COOKIE_SECONDS)
        return f"{end}.{self._cookie_signature(end)}"

    def is_cookie(self, value: str) -> bool:
        """Return whether this studio has issued a cookie that has not expired."""
        end, _, signature = value.partition(".")
        known = hmac.compare_digest(signature.encode(), self._cookie_signature(end).encode())
        return known and int(end) > self._clock()

    def _cookie_signature(self, end: str) -> str:
        return hmac.new(self._secret, f"leafcut studio {end}".encode(), hashlib.sha256).hexdigest()


def read_or_create_secret(root: Path) -> bytes:
    """Load the secret of a studio's folder, or create it. Raises `OutputError` if the secret cannot be saved."""
    file = root / "key"
    try:
        if not file.is_file() or file.stat().st_size != 32:
            write_private(file, secrets.token_bytes(32))
        return file.read_bytes()
    except OSError as problem:
        raise OutputError("{}: cannot save the studio's key ({})", file, problem.strerror) from None


def write_private(file: Path, data: bytes) -> None:
    """Write a file that only its owner can read, even while it is being written."""
    with suppress(FileNotFoundError):
        file.unlink()
    number = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(number, "wb") as opened:
        opened.write(data)


def redirect_page(address: str) -> bytes:
    """Return an HTML page that redirects the browser to an address."""
    target = escape(address, quote=True)
    return (
        '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
        f'<meta http-equiv="refresh" content="0; url={target}"><title>leafcut studio</title>'
        f'<p><a href="{target}">leafcut studio</a></p>\n'
    ).encode()
