"""A studio as a person starts it, for the tests that need a whole one."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2

#: Time limit of an answer and of the end of a process on a busy machine, s; only a safety net.
PATIENCE = 240.0
#: Code that lets the studio wait longer for a page whose browser is busy, as with axe.
PATIENT_PAGES = "from leafcut.studio.page import pages; pages.RECONNECT_SECONDS = 60.0"


def free_port() -> int:
    """Return a port of this machine that nothing listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Server:
    """A studio in a process of its own, which runs the Python code `first` before it; empty for the plain command."""

    def __init__(
        self, home: Path, port: int = 0, browser: tuple[str, str] | None = None, first: str = PATIENT_PAGES
    ) -> None:
        environment = {**os.environ, "XDG_DATA_HOME": str(home), "LOCALAPPDATA": str(home), "PYTHONFAULTHANDLER": "1"}
        environment.update([browser] if browser else [])
        home.mkdir(parents=True, exist_ok=True)
        #: Its output goes to files: an unread pipe would fill up and block it.
        self._out, self._error = home / "studio-out.txt", home / "studio-error.txt"
        for _ in range(1 if port else 5):  # a port that is free now may be taken until it is used
            words = ["studio", *([] if browser else ["--no-open"]), "--port", str(port or free_port())]
            code = f"{first}; from leafcut.cli.app import main; main({words!r})"
            command = ["-c", code] if first else ["-m", "leafcut", *words]
            with self._out.open("w") as out, self._error.open("w") as error:
                self.process = subprocess.Popen([sys.executable, *command], stdout=out, stderr=error, env=environment)
            self.line = self._first_line()
            if self.line:
                break
            self.process.wait(timeout=PATIENCE)
        found = re.search(r"(http://127\.0\.0\.1:(\d+))/\?token=([\w-]+)$", self.line.strip())
        assert found, self.line
        self.origin, self.port, self.key = found.group(1), int(found.group(2)), found.group(3)
        #: What programs of the same person send.
        self.folder = home / "leafcut" / "studio"
        self.token = (self.folder / "token").read_text()
        self._cookies: dict[str, str] = {}
        self._read = 0
        # It prints its address before it listens: a busy machine may take some time in between.
        for left in reversed(range(1200)):
            try:
                httpx2.get(self.origin, timeout=PATIENCE)
                break
            except httpx2.TransportError:
                if not left:
                    raise
                time.sleep(0.05)

    def _first_line(self) -> str:
        """Wait for the line with its address; return nothing if it ends without one."""
        while True:
            over = self.process.poll() is not None
            line, end, _ = self._out.read_text().partition("\n")
            if end or over:
                return line
            time.sleep(0.02)

    def complained(self) -> str:
        """Return new output on standard error, without the message on Ctrl-C."""
        said = self._error.read_text()
        new, self._read = said[self._read :], len(said)
        return new.replace("leafcut: Ctrl-C ends it\n", "")

    def standing(self) -> str:
        """Kill it; return its output, and the stack of each thread."""
        self.process.send_signal(signal.SIGABRT)
        self.process.wait(timeout=PATIENCE)
        return self._error.read_text()

    def cookies(self) -> dict[str, str]:
        """Return the cookie of a browser that came in by the address that was printed."""
        if not self._cookies:
            answer = httpx2.get(self.origin, params={"token": self.key}, timeout=PATIENCE)
            name, _, value = answer.headers["set-cookie"].partition(";")[0].partition("=")
            self._cookies = {name: value}
        return self._cookies

    def let_in(self, context: Any) -> None:
        """Give a context of Playwright's the cookie, as if it had come in."""
        context.add_cookies([{"name": n, "value": v, "url": self.origin} for n, v in self.cookies().items()])

    def speak_as_the_browser(self) -> None:
        """Forget the chosen language, which is stored for all later pages."""
        (self.folder / "language").unlink(missing_ok=True)

    def end(self) -> tuple[int, str, str]:
        """Stop it with Ctrl-C; return its status and its output."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=PATIENCE)
        # The first line has been read.
        return self.process.returncode, self._out.read_text().partition("\n")[2], self._error.read_text()


@contextmanager
def running(home: Path, *browser: str, port: int = 0, first: str = PATIENT_PAGES) -> Iterator[Server]:
    """Start a studio, and kill it in the end whatever it does then; it opens a browser where one is named."""
    started = Server(home, port, browser=(browser[0], browser[1]) if browser else None, first=first)
    try:
        yield started
    finally:
        started.process.kill()
        started.process.wait(timeout=PATIENCE)
