"""The choices of every open page, stored in the studio's folder, so that a reloaded page continues."""

from __future__ import annotations

import json
import re
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from leafcut.files.whole_files import write_whole

#: Format of a page's name, which cannot be a path. The name grants no access; access needs the key.
PAGE = re.compile(r"[A-Za-z0-9_-]{16}")
#: Maximum number of stored pages, and maximum time since their last change, s.
MAX_PAGES, LONGEST = 60, 14 * 24 * 3600.0
#: Maximum size of a stored page, characters.
MAX_CHARACTERS = 4_000_000


class KeptPages:
    """The stored pages by name, each a JSON object. Every change is written at once, so that a crash loses nothing."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        #: Name → function that returns whether the page is open in a browser.
        self._held: dict[str, Callable[[], bool]] = {}
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._prune()

    @staticmethod
    def new_name() -> str:
        """Return a new random name."""
        return secrets.token_urlsafe(12)

    def get(self, name: str) -> dict[str, Any] | None:
        """Return the choices of a page; None if the page is unknown or unreadable."""
        if not PAGE.fullmatch(name):
            return None
        with suppress(OSError, ValueError, RecursionError):
            choices = json.loads(self._file(name).read_text(encoding="utf-8"))
            if isinstance(choices, dict):
                return choices
        return None

    def put(self, name: str, text: str) -> None:
        """Store the choices of a page, a JSON object. A failure is ignored."""
        if not PAGE.fullmatch(name) or len(text) > MAX_CHARACTERS:
            return
        new = not self._file(name).exists()
        with self._lock, suppress(Exception):  # an open page does not depend on its stored state
            write_whole(self._file(name), text)
        if new:
            self._prune()

    def drop(self, name: str) -> None:
        """Delete a stored page."""
        if PAGE.fullmatch(name):
            self._file(name).unlink(missing_ok=True)

    def hold(self, name: str, seen: Callable[[], bool]) -> bool:
        """Claim a name for an open page; return False if another open page has it.

        `seen` returns whether the page is open.
        """
        holder = self._held.get(name)
        if holder is not None and holder is not seen and holder():
            return False
        self._held[name] = seen
        return True

    def release(self, seen: Callable[[], bool]) -> None:
        """Release the names of a closed page."""
        self._held = {name: holder for name, holder in self._held.items() if holder is not seen}

    def newest_closed(self) -> tuple[str, dict[str, Any]] | None:
        """Return name and choices of the most recently changed page that has a source and is not open, or None."""
        for file in self._files():
            holder = self._held.get(file.stem)
            if holder is None or not holder():
                choices = self.get(file.stem)
                if choices is not None and choices.get("source"):
                    return file.stem, choices
        return None

    def files_in_use(self) -> set[str]:
        """Return all texts in the stored pages that may be ids of uploads."""
        return {word.partition(":")[0] for file in self._files() for word in _words(self.get(file.stem))}

    def _file(self, name: str) -> Path:
        return self._folder / f"{name}.json"

    def _files(self) -> list[Path]:
        times: list[tuple[float, Path]] = []
        for file in self._folder.glob("*.json"):
            with suppress(OSError):
                times.append((file.stat().st_mtime, file))
        return [file for _, file in sorted(times, key=lambda entry: entry[0], reverse=True)]

    def _prune(self) -> None:
        now = time.time()
        for number, file in enumerate(self._files()):
            holder = self._held.get(file.stem)
            with suppress(OSError):
                if (number >= MAX_PAGES or now - file.stat().st_mtime > LONGEST) and not (holder and holder()):
                    file.unlink()


def _words(plain: Any) -> Iterator[str]:
    if isinstance(plain, str):
        yield plain
    elif isinstance(plain, dict):
        for key, value in plain.items():
            yield key
            yield from _words(value)
    elif isinstance(plain, list):
        for value in plain:
            yield from _words(value)
