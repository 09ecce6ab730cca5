"""The recently opened files. Users can reopen a file as long as it exists in the studio's folder."""

from __future__ import annotations

import filecmp
import json
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from leafcut.errors import LeafcutError
from leafcut.files.whole_files import write_whole
from leafcut.studio.folder import BUILT_IN, Folder

MAX_RECENT = 12


@dataclass(frozen=True)
class RecentFile:
    """A file that was opened, with its source, its displayed name, and the time in seconds since the epoch."""

    source: str
    name: str
    opened: float


class RecentFiles:
    """The recently opened files, newest first."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._file = folder.root / "recent.json"
        self._lock = threading.Lock()

    def newest(self) -> list[RecentFile]:
        """Return the recent files that still exist."""
        return [recent for recent in self._read() if self._resolve_source(recent.source) is not None]

    def add(self, source: str, name: str) -> None:
        """Add a file that was opened. It replaces any entry with the same name and content."""
        with self._lock:
            kept = [recent for recent in self.newest() if not self._is_same(recent, source, name)]
            rows = [RecentFile(source, name, time.time()), *kept][:MAX_RECENT]
            with suppress(LeafcutError):  # opening a file must not fail because of this list
                write_whole(self._file, json.dumps([asdict(recent) for recent in rows]))

    def clear(self) -> None:
        """Clear the list."""
        self._file.unlink(missing_ok=True)

    def files_in_use(self) -> set[str]:
        """Return the ids of all uploads in the list."""
        return {recent.source for recent in self._read()}

    def _is_same(self, recent: RecentFile, source: str, name: str) -> bool:
        if recent.source == source:
            return True
        known_path, new_path = self._resolve_source(recent.source), self._resolve_source(source)
        if recent.name != name or not isinstance(known_path, Path) or not isinstance(new_path, Path):
            return False
        with suppress(OSError):
            return filecmp.cmp(known_path, new_path, shallow=False)
        return False

    def _resolve_source(self, source: str) -> Path | str | None:
        if source.startswith(BUILT_IN):
            return source
        with suppress(LeafcutError):
            return self._folder.input_path(source)
        return None

    def _read(self) -> list[RecentFile]:
        with suppress(OSError, ValueError, RecursionError):
            return list(_parse_rows(json.loads(self._file.read_text(encoding="utf-8"))))
        return []


def _parse_rows(plain: object) -> Iterator[RecentFile]:
    for row in plain if isinstance(plain, list) else []:
        with suppress(KeyError, TypeError, ValueError):
            yield RecentFile(str(row["source"]), str(row["name"]), float(row["opened"]))
