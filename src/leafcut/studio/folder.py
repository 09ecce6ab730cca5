"""The studio's own folder. All uploads are stored here, and pages have no access to files outside this folder."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import secrets
import shutil
import sys
import time
import unicodedata
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from leafcut.errors import OptionError
from leafcut.files.whole_files import OutputError, write_whole
from leafcut.message import map_text

#: Format of the id of an upload. An id cannot be a path.
_ID = re.compile(r"[A-Za-z0-9_-]{16}")
#: Format of the name of a machine or tool library that the user has created.
_OWN = re.compile(r"[a-z0-9][a-z0-9_-]{0,60}")
#: Prefix of the user's own files, and prefixes of built-in sources, which are not files.
OWN, BUILT_IN = "mine:", ("example:", "random:")
#: Maximum size of a file, bytes.
LARGEST_UPLOAD = 64 * 1024 * 1024
#: Maximum length of a file name, bytes. File systems allow 255.
_LONGEST_NAME = 160
#: Age after which unused uploads are deleted, s. Pages that are still open may need newer uploads.
_UNUSED_SECONDS = 14 * 24 * 3600.0
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\.|\Z)")


def data_folder() -> Path:
    """Return the folder in which the studio stores the data of this user (XDG base directory specification)."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    else:
        base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "leafcut" / "studio"


def safe_name(name: str) -> str:
    """Return a file name that is valid in any folder, on the command line, and in program comments."""
    last = re.split(r"[/\\]", unicodedata.normalize("NFC", name))[-1]
    kept = "".join(c for c in last if c.isprintable() and c not in '<>:"|?*').strip(" .")
    extension = Path(kept).suffix if len(Path(kept).suffix) < 20 else ""
    stem = kept.removesuffix(extension)
    while len((stem + extension).encode()) > _LONGEST_NAME:
        stem = stem[:-1]
    kept = stem + extension
    if kept.startswith("-") or _RESERVED.match(kept):
        kept = "_" + kept.lstrip("-")
    return kept or "file"


class Folder:
    """The folder with uploads, machines and tool libraries. Raises `OutputError` if the folder cannot be created."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.inputs = root / "inputs"
        try:
            for folder in (root, self.inputs, *(root / kind for kind in ("machines", "tools"))):
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as problem:
            raise OutputError("{}: cannot create the studio's folder ({})", root, problem.strerror) from None

    def new_input(self, name: str) -> tuple[str, Path]:
        """Return the id and the path for a new upload. The caller writes the file."""
        input_id = secrets.token_urlsafe(12)
        folder = self.inputs / input_id
        folder.mkdir(mode=0o700, parents=True)
        return input_id, folder / safe_name(name)

    def add_input(self, name: str, data: bytes) -> str:
        """Store an upload and return its id."""
        input_id, path = self.new_input(name)
        path.write_bytes(data)
        return input_id

    def store_text(self, name: str, text: str) -> str:
        """Store a text that the studio has written, and return its id. The same name and text have the same id."""
        key = hashlib.sha256(f"{name}\n{text}".encode()).digest()
        input_id = base64.urlsafe_b64encode(key)[:16].decode()
        folder = self.inputs / input_id
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(folder / safe_name(name), text)
        os.utime(folder)  # it is in use again
        return input_id

    def input_path(self, input_id: str) -> Path:
        """Return the path of an upload. Raises `OptionError` if the id is unknown."""
        files = (
            sorted((self.inputs / input_id).iterdir())
            if _ID.fullmatch(input_id) and (self.inputs / input_id).is_dir()
            else []
        )
        if len(files) != 1:
            raise OptionError("this file is no longer in the studio; open it again")
        return files[0]

    def resolve_source(self, word: str) -> str:
        """Return the source of a page's input, which is the path of an upload or the name of a built-in source."""
        return word if word.startswith(BUILT_IN) else str(self.input_path(word))

    def delete_inputs(self, ids: Iterable[str]) -> None:
        """Delete uploads by their ids."""
        for input_id in ids:
            if _ID.fullmatch(input_id):
                shutil.rmtree(self.inputs / input_id, ignore_errors=True)

    def delete_unused_inputs(self, used: Iterable[str]) -> None:
        """Delete uploads that are older than two weeks and no longer in use."""
        keep, now = set(used), time.time()
        old = [p.name for p in self.inputs.iterdir() if now - p.stat().st_mtime > _UNUSED_SECONDS]
        self.delete_inputs(name for name in old if name not in keep)

    def own_names(self, kind: str) -> list[str]:
        """Return the sorted names of the user's own ``machines`` or ``tools``."""
        return sorted(p.stem for p in (self.root / kind).glob("*.toml") if _OWN.fullmatch(p.stem))

    def own_path(self, kind: str, name: str) -> Path:
        """Return the path of one of the user's own files, even if the file does not exist.

        Raises `OptionError` if the name is invalid.
        """
        if not _OWN.fullmatch(name):
            raise OptionError("'{}' is not a valid name; use lower-case letters, digits, - and _", safe_name(name))
        return self.root / kind / f"{name}.toml"

    def existing_own_path(self, kind: str, word: str, flag: str) -> Path:
        """Return the path of ``mine:NAME``, which is the value of `flag`.

        Raises `OptionError` if the file does not exist.
        """
        name = word.removeprefix(OWN)
        path = self.own_path(kind, name)
        if not path.is_file():
            raise OptionError("{}: '{}' is no longer in your library", flag, name)
        return path

    def save_own(self, kind: str, name: str, text: str) -> None:
        """Save one of the user's own files. The write is atomic."""
        write_whole(self.own_path(kind, name), text)

    def draft(self, kind: str, name: str) -> str | None:
        """Return the unsaved changes to one of the user's own files, or None."""
        with suppress(OSError, UnicodeDecodeError):
            return self._draft_path(kind, name).read_text(encoding="utf-8")
        return None

    def set_draft(self, kind: str, name: str, text: str | None) -> None:
        """Store the unsaved changes to one of the user's own files, or delete them if `text` is None."""
        if text is None:
            self._draft_path(kind, name).unlink(missing_ok=True)
        else:
            write_whole(self._draft_path(kind, name), text)

    def _draft_path(self, kind: str, name: str) -> Path:
        return self.own_path(kind, name).with_suffix(".draft")

    def hide_paths(self, line: str) -> str:
        """Replace paths in the studio's folder with the user's file names in a message."""
        folder = re.escape(str(self.root) + os.sep)
        inner = r"(inputs[/\\][A-Za-z0-9_-]{16}[/\\]|machines[/\\]|tools[/\\])?"
        return map_text(line, lambda text: re.sub(folder + inner, "", text))
