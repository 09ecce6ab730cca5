"""Drafts: unsaved texts of machine profiles and tool libraries, stored until they are saved or discarded."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from contextlib import suppress

from leafcut.errors import LeafcutError
from leafcut.files.whole_files import write_whole
from leafcut.studio.folder import Folder

#: Maximum length of a draft that is written to disk, characters; profiles have a few thousand.
MAX_CHARACTERS = 200_000


class Drafts(MutableMapping[str, str]):
    """Drafts of the user's own ``machines`` or ``tools``: name → text."""

    def __init__(self, folder: Folder, kind: str) -> None:
        self._folder, self._kind = folder, kind
        self._place = folder.root / "drafts" / kind
        #: Name → text of a draft that is not on disk.
        self._unwritten: dict[str, str] = {}

    def __getitem__(self, name: str) -> str:
        if name in self._unwritten:
            return self._unwritten[name]
        try:
            return (self._place / self._folder.own_path(self._kind, name).name).read_text(encoding="utf-8")
        except (OSError, ValueError):  # an invalid name raises a ValueError
            raise KeyError(name) from None

    def __setitem__(self, name: str, text: str) -> None:
        file = self._place / self._folder.own_path(self._kind, name).name
        self._unwritten[name] = text
        if len(text) <= MAX_CHARACTERS:
            with suppress(OSError, LeafcutError):
                self._place.mkdir(mode=0o700, parents=True, exist_ok=True)
                write_whole(file, text)
                del self._unwritten[name]

    def __delitem__(self, name: str) -> None:
        self._unwritten.pop(name, None)
        with suppress(OSError, ValueError):
            (self._place / self._folder.own_path(self._kind, name).name).unlink()

    def __iter__(self) -> Iterator[str]:
        return iter(sorted({*self._unwritten, *(file.stem for file in self._place.glob("*.toml"))}))

    def __len__(self) -> int:
        return sum(1 for _ in self)
