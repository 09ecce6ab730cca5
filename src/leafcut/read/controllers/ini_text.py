"""Read the INI files of controllers. Section names and keys are case-sensitive, and each value has a line number."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from leafcut.errors import ReadError, printable
from leafcut.message import Message

#: Maximum nesting depth of included files, and their maximum total size, bytes. Real files have a few kB.
DEEPEST, MOST_INCLUDED = 8, 4 * 1024 * 1024
#: Maximum number of included files, because files that include each other multiply quickly.
MOST_FILES = 200


@dataclass(frozen=True)
class Entry:
    """A value in an INI file, with its position as text, such as ``line 12`` or ``limits.inc, line 3``."""

    text: str
    place: str


@dataclass
class Ini:
    """The sections of an INI file by name, each with its keys.

    If a key occurs twice, the first value wins, as in LinuxCNC.
    """

    sections: dict[str, dict[str, Entry]] = field(default_factory=dict)

    def get(self, key: str, *sections: str) -> Entry | None:
        """Return the value of a key from the first of the given sections that has the key."""
        return next((self.sections[name][key] for name in sections if key in self.sections.get(name, {})), None)


def read_ini(text: str, file: str, include: bool = False) -> Ini:
    """Read an INI file.

    With `include`, the function follows LinuxCNC's ``#INCLUDE name`` to files in the same folder or its subfolders.

    Raises
    ------
    ReadError
        An included file is outside the folder, is missing, or includes itself.
    """
    ini = Ini()
    _IniParser(Path(file), ini, include).parse_lines(text, Path(file), 0, "")
    return ini


@dataclass
class _IniParser:
    root: Path
    ini: Ini
    include: bool
    bytes_read: int = 0
    files: int = 0

    def parse_lines(self, text: str, file: Path, depth: int, section: str) -> str:
        for count, line in enumerate(text.splitlines(), 1):
            stripped = line.strip()
            place = Message("line {}", count) if depth == 0 else f"{printable(file.name, 40)}, line {count}"
            if stripped.startswith("#INCLUDE ") and self.include:
                section = self._read_include(stripped.removeprefix("#INCLUDE ").strip(), file, depth, section, count)
            elif stripped.startswith("[") and "]" in stripped:
                section = stripped[1:].partition("]")[0].strip()
                self.ini.sections.setdefault(section, {})
            elif "=" in stripped and not stripped.startswith(("#", ";")):
                key, _, value = stripped.partition("=")
                self.ini.sections.setdefault(section, {}).setdefault(key.strip(), Entry(value.strip(), place))
        return section

    def _read_include(self, name: str, file: Path, depth: int, section: str, count: int) -> str:
        def refusal(reason: str) -> ReadError:
            return ReadError(self.root, f"includes '{printable(name, 60)}', {reason}", count if depth == 0 else None)

        folder = self.root.parent.resolve()
        path = (file.parent / name).resolve() if _is_relative_path(name) else folder
        if not path.is_relative_to(folder) or path == folder:
            raise refusal("which is not in its folder; copy the file there")
        if depth == DEEPEST:
            raise refusal(f"more than {DEEPEST} files deep; does it include itself?")
        try:
            if not path.is_file():
                raise refusal("which does not exist")
            self.files += 1
            if self.files > MOST_FILES:
                raise refusal(f"one of more than {MOST_FILES} files; does a file include itself?")
            self.bytes_read += path.stat().st_size
            if self.bytes_read > MOST_INCLUDED:
                raise refusal(f"with which the settings exceed {MOST_INCLUDED >> 20} MiB")
            text = path.read_bytes().decode("utf-8", "replace")
        except OSError as problem:
            raise refusal(f"which cannot be read ({problem.strerror})") from None
        return self.parse_lines(text, path, depth + 1, section)


def _is_relative_path(name: str) -> bool:
    """Return whether a name is a relative path. It must not start with a home directory or a drive."""
    return bool(name) and "\0" not in name and not name.startswith(("/", "~", "\\")) and ":" not in name
