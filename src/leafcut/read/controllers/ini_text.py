"""INI files as controllers write them: sections and keys in their own case, each value with the line it stands in."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from leafcut.errors import ReadError, shown

#: Files that others include others in, and how much all of them hold, bytes: a real one has some kilobytes.
DEEPEST, MOST_INCLUDED = 8, 4 * 1024 * 1024
#: And how many of them: of files that each include some others there would soon be millions.
MOST_FILES = 200


@dataclass(frozen=True)
class Entry:
    """A value, and its place in words: ``line 12``, or ``limits.inc, line 3``."""

    text: str
    place: str


@dataclass
class Ini:
    """Sections by name, each with its keys; where a key is there twice, the first counts, as LinuxCNC has it."""

    sections: dict[str, dict[str, Entry]] = field(default_factory=dict)

    def get(self, key: str, *sections: str) -> Entry | None:
        """Return the value of a key in the first of some sections that has it."""
        return next((self.sections[name][key] for name in sections if key in self.sections.get(name, {})), None)


def read_ini(text: str, file: str, include: bool = False) -> Ini:
    """Return what an INI file holds.

    Parameters
    ----------
    include
        Follow LinuxCNC's ``#INCLUDE name``, to files in the folder of the file or below it.

    Raises
    ------
    ReadError
        A line is none of an INI file, or an included file lies elsewhere, is missing, or includes itself.
    """
    found = Ini()
    _Reading(Path(file), found, include).lines(text, Path(file), 0, "")
    return found


@dataclass
class _Reading:
    root: Path
    found: Ini
    include: bool
    taken: int = 0
    files: int = 0

    def lines(self, text: str, file: Path, depth: int, section: str) -> str:
        """Read the lines of a file, and return the section that they end in."""
        for count, line in enumerate(text.splitlines(), 1):
            words = line.strip()
            place = f"line {count}" if depth == 0 else f"{shown(file.name, 40)}, line {count}"
            if words.startswith("#INCLUDE ") and self.include:
                section = self._included(words.removeprefix("#INCLUDE ").strip(), file, depth, section, count)
            elif words.startswith("[") and "]" in words:
                section = words[1:].partition("]")[0].strip()
                self.found.sections.setdefault(section, {})
            elif "=" in words and not words.startswith(("#", ";")):
                key, _, value = words.partition("=")
                self.found.sections.setdefault(section, {}).setdefault(key.strip(), Entry(value.strip(), place))
        return section

    def _included(self, name: str, file: Path, depth: int, section: str, count: int) -> str:
        def refused(why: str) -> ReadError:
            return ReadError(self.root, f"includes '{shown(name, 60)}', {why}", count if depth == 0 else None)

        folder = self.root.parent.resolve()
        path = (file.parent / name).resolve() if _is_name(name) else folder
        if not path.is_relative_to(folder) or path == folder:
            raise refused("which is not in its folder; copy the file there")
        if depth == DEEPEST:
            raise refused(f"more than {DEEPEST} files deep; does it include itself?")
        try:
            if not path.is_file():
                raise refused("which is not there")
            self.files += 1
            if self.files > MOST_FILES:
                raise refused(f"one of more than {MOST_FILES} files; does one include itself?")
            self.taken += path.stat().st_size
            if self.taken > MOST_INCLUDED:
                raise refused(f"with which it holds more than {MOST_INCLUDED >> 20} MiB")
            text = path.read_bytes().decode("utf-8", "replace")
        except OSError as problem:
            raise refused(f"which cannot be read ({problem.strerror})") from None
        return self.lines(text, path, depth + 1, section)


def _is_name(name: str) -> bool:
    """Return whether a name is that of a file here or below, and none of a home, a device or another folder."""
    return bool(name) and "\0" not in name and not name.startswith(("/", "~", "\\")) and ":" not in name
