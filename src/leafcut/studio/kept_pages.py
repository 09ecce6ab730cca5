"""What every open page has chosen, kept in the studio's folder: a page that is loaded again goes on where it was."""

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

#: What the name of a page looks like: nothing that could be a path. It opens nothing: that takes the key.
PAGE = re.compile(r"[A-Za-z0-9_-]{16}")
#: So many pages are kept, and none longer than so many seconds after it was last changed.
MOST_PAGES, LONGEST = 60, 14 * 24 * 3600.0
#: Most characters of one page.
MOST_CHARACTERS = 4_000_000


class KeptPages:
    """Pages by name, each a JSON object; written at once, so that nothing is lost however the studio ends."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        #: Name → whether the page that has it is still seen.
        self._held: dict[str, Callable[[], bool]] = {}
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._prune()

    @staticmethod
    def new_name() -> str:
        """Return a name that no page has."""
        return secrets.token_urlsafe(12)

    def get(self, name: str) -> dict[str, Any] | None:
        """Return what a page had chosen; None where nothing is known of it."""
        if not PAGE.fullmatch(name):
            return None
        with suppress(OSError, ValueError, RecursionError):
            found = json.loads(self._file(name).read_text(encoding="utf-8"))
            if isinstance(found, dict):
                return found
        return None

    def put(self, name: str, text: str) -> None:
        """Keep what a page has chosen, a JSON object."""
        if not PAGE.fullmatch(name) or len(text) > MOST_CHARACTERS:
            return
        new = not self._file(name).exists()
        with self._lock, suppress(Exception):  # the page goes on, and says nothing: it has no need of it yet
            write_whole(self._file(name), text)
        if new:
            self._prune()

    def drop(self, name: str) -> None:
        """Forget a page."""
        if PAGE.fullmatch(name):
            self._file(name).unlink(missing_ok=True)

    def hold(self, name: str, seen: Callable[[], bool]) -> bool:
        """Take a page's name; return False where another page that is seen has it."""
        other = self._held.get(name)
        if other is not None and other is not seen and other():
            return False
        self._held[name] = seen
        return True

    def let_go(self, seen: Callable[[], bool]) -> None:
        """Note that a page is gone."""
        self._held = {name: one for name, one in self._held.items() if one is not seen}

    def newest_closed(self) -> tuple[str, dict[str, Any]] | None:
        """Return the page that was changed last among those that nobody sees, with what it had chosen."""
        for file in self._files():
            held = self._held.get(file.stem)
            if held is None or not held():
                found = self.get(file.stem)
                if found is not None and found.get("source"):
                    return file.stem, found
        return None

    def files_in_use(self) -> set[str]:
        """Return every word of the pages that may be the id of an upload."""
        return {word.partition(":")[0] for file in self._files() for word in _words(self.get(file.stem))}

    def _file(self, name: str) -> Path:
        return self._folder / f"{name}.json"

    def _files(self) -> list[Path]:
        """Return the files of the pages, that changed last first."""
        times: list[tuple[float, Path]] = []
        for file in self._folder.glob("*.json"):
            with suppress(OSError):
                times.append((file.stat().st_mtime, file))
        return [file for _, file in sorted(times, key=lambda one: one[0], reverse=True)]

    def _prune(self) -> None:
        """Drop the pages that are old, or more than are kept; never one that somebody sees."""
        now = time.time()
        for number, file in enumerate(self._files()):
            held = self._held.get(file.stem)
            with suppress(OSError):
                if (number >= MOST_PAGES or now - file.stat().st_mtime > LONGEST) and not (held and held()):
                    file.unlink()


def _words(plain: Any) -> Iterator[str]:
    """Yield every text of a JSON value."""
    if isinstance(plain, str):
        yield plain
    elif isinstance(plain, dict):
        for key, value in plain.items():
            yield key
            yield from _words(value)
    elif isinstance(plain, list):
        for value in plain:
            yield from _words(value)
