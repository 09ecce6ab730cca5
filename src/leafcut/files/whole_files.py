"""Read and write files.

Inputs are read up to a size limit. Outputs are written atomically, and never replace an input.
"""

from __future__ import annotations

import codecs
import os
import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

from leafcut.errors import DataError, LeafcutError, OptionError, ReadError, printable
from leafcut.files.schemas import Schema, check_schema
from leafcut.message import Message

#: Maximum size of a program, bytes. This is ten times the size of the largest known program.
LARGEST_PROGRAM = 512 * 1024 * 1024
#: Maximum size of a TOML file, bytes; typical files have a few kilobytes.
LARGEST_TOML = 1_000_000


#: Default for `encodings`: all files have the same encoding.
_NO_EXCEPTIONS: Mapping[str, str] = MappingProxyType({})


class OutputError(LeafcutError):
    """A file cannot be written, or would overwrite an input."""


@dataclass(frozen=True)
class StandardInput:
    """Data from standard input. All functions that take a drawing or a program file also accept these data."""

    data: bytes

    def __str__(self) -> str:
        return "standard input"

    @classmethod
    def read(cls) -> StandardInput:
        """Read all of standard input.

        Raises
        ------
        ReadError
            The input is empty or larger than `LARGEST_PROGRAM`.
        """
        try:
            data = sys.stdin.buffer.read(LARGEST_PROGRAM + 1) if sys.stdin is not None else b""
        except OSError as problem:
            raise ReadError("standard input", Message("cannot be read ({})", problem.strerror)) from None
        if len(data) > LARGEST_PROGRAM:
            raise ReadError(
                "standard input", Message("is larger than {} MiB, the limit for a program", LARGEST_PROGRAM >> 20)
            )
        if not data.strip():
            raise ReadError("standard input", "is empty")
        return cls(data)


class Loaded(Protocol):
    """An input that is already in memory. `str` returns its name."""

    @property
    def data(self) -> bytes:
        """The whole content."""


def read_program(source: str | Path | Loaded) -> str:
    """Read a program, and decode it as UTF-8 or Latin-1.

    Raises
    ------
    ReadError
        The file is unreadable, empty, binary or too large.
    """
    data = _read_bytes(Path(source)) if isinstance(source, str | Path) else source.data
    check_is_text(str(source), data)
    return decode_text(data)[0]


def decode_text(data: bytes) -> tuple[str, str]:
    """Decode bytes as UTF-8, or as Latin-1 if that fails.

    Returns
    -------
    str
        The text without a byte order mark.
    str
        The encoding.
    """
    try:
        encoding = "utf-8-sig" if data.startswith(codecs.BOM_UTF8) else "utf-8"
        return data.decode(encoding), encoding
    except UnicodeDecodeError:
        return data.decode("latin-1"), "latin-1"


def check_is_text(source: str, data: bytes) -> None:
    """Raise `ReadError` for binary data and UTF-16 text. Both contain zero bytes."""
    if b"\0" in data:
        wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        if wide:
            raise ReadError(source, "this text is UTF-16; save it as UTF-8")
        raise ReadError(source, "this is a binary file; a G-code program was expected")


def _read_bytes(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST_PROGRAM:
            raise ReadError(path, Message("is larger than {} MiB, the limit for a program", LARGEST_PROGRAM >> 20))
        data = path.read_bytes()
    except OSError as problem:
        raise ReadError(path, Message("cannot be read ({})", problem.strerror)) from None
    if not data.strip():
        raise ReadError(path, "is empty")
    return data


def check_file_exists(flag: str, path: Path | None) -> None:
    """Check that the file of an option exists.

    Raises
    ------
    OptionError
        The file does not exist or is a folder. The message uses `flag` as the name of the option.
    """
    try:
        exists = path is None or path.exists()
    except OSError:
        return  # the reader reports other problems
    if path is not None and (not exists or path.is_dir()):
        if str(path) == "-":
            raise OptionError("{} -: cannot be read from standard input; name a file", flag)
        reason = Message("this is a folder; name a file in it") if exists else Message("file not found")
        raise OptionError("{} {}: {}", flag, path, reason)


def read_toml(path: Path, schema: Schema) -> dict[str, Any]:
    """Read the tables of a TOML file, without its schema number.

    Raises
    ------
    OptionError
        The file does not exist.
    DataError
        The file cannot be read, is too large, is not TOML, or has a schema that this version of leafcut cannot read.
    """
    return parse_toml(read_toml_text(path), str(path), schema)


def read_toml_text(path: Path) -> str:
    """Read the text of a TOML file, without a byte order mark.

    Raises the same errors as `toml_bytes`, and `DataError` if the text is not UTF-8.
    """
    try:
        return read_toml_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise DataError("{}: not a TOML file (not UTF-8 text)", path) from None


def read_toml_bytes(path: Path) -> bytes:
    """Read the bytes of a TOML file.

    Raises
    ------
    OptionError
        The file is missing.
    DataError
        The file is unreadable or too large.
    """
    if not path.is_file():
        raise OptionError("{}: file not found", path)
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_TOML + 1)
    except OSError as problem:
        raise DataError("{}: cannot be read ({})", path, problem.strerror) from None
    if len(content) > LARGEST_TOML:
        raise DataError(
            "{}: the file is larger than {} kB, the limit for files of options, machines and tools",
            path,
            LARGEST_TOML // 1000,
        )
    return content


def parse_toml(text: str, source: str, schema: Schema) -> dict[str, Any]:
    """Parse TOML text, and return its tables without the schema number. Error messages use `source` as its name.

    Raises
    ------
    DataError
        The text is not TOML, or has a schema that this version of leafcut cannot read.
    """
    import tomllib

    try:
        tables = tomllib.loads(text)
        _check_integer_sizes(tables)
    except RecursionError:
        raise DataError("{}: not a TOML file (nested too deep)", source) from None
    except ValueError as problem:  # TOMLDecodeError, or a number with thousands of digits
        error = DataError("{}: not a TOML file ({})", source, printable(str(problem), 200))
        raise error.at(line=_line_of_syntax_error(str(problem), text)) from None
    check_schema(schema, tables.pop(schema.key, schema.current), source)
    return tables


def _line_of_syntax_error(message: str, toml: str) -> int | None:
    """Extract the line number from a message of `tomllib`. Before Python 3.14, the exception has no line attribute."""
    if message.endswith("(at end of document)"):
        return len(toml.splitlines())
    match = re.search(r"\(at line (\d+), column \d+\)$", message)
    return int(match[1]) if match else None


def key_line_number(toml: str, section: str, name: str = "", entry: int = 0) -> int | None:
    """Return the line number of a key in a section of TOML text, or None if the key is missing.

    If `name` is empty, the function returns the line number of the section header. To look up a table as a key of the
    top level, pass an empty `section`. `entry` is the number of a table in an array, from 1.
    """
    current_section, count, header = "", 0, section if not name else "" if section else name
    full_name = f"{section}.{name}".lstrip(".")
    for number, line in enumerate(toml.splitlines(), 1):
        words = line.partition("#")[0].strip()
        if words.startswith("["):
            current_section = words.strip("[] \t").strip("\"'")
            count += current_section == section
            if header and current_section == header and (not entry or count == entry):
                return number
        key = ".".join(part.strip().strip("\"'") for part in words.partition("=")[0].split("."))
        is_key = name and "=" in words and f"{current_section}.{key}".lstrip(".") == full_name
        if is_key and (not entry or count == entry):
            return number
    return None


def key_place(source: str | Path, toml: str, section: str, name: str = "") -> str:
    """Return ``source:line`` for a key or a section of TOML text. Return only the source if `line_of` returns None."""
    line = key_line_number(toml, section, name)
    return Message("{}:{}", source, line) if line else Message("{}", source)


def _check_integer_sizes(value: Any) -> None:
    """Raise `ValueError` for integers of more than 64 bits (TOML 1.0.0, "Integer").

    Huge integers would overflow a float.
    """
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            _check_integer_sizes(inner)
    elif isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError(Message("'{}' is a whole number of more than 64 bits", printable(str(value))))


def check_output(target: str | Path | None, inputs: Iterable[str | Path | None]) -> None:
    """Raise `OutputError` if `target` cannot be written or is one of `inputs`."""
    if target is None:
        return
    path = Path(target)
    if str(target) == "-":
        raise OutputError("-: only a program can be written to standard output; name a file")
    if not str(target):
        raise OutputError("the name of the output is empty; name a file")
    if path.is_dir():
        raise OutputError("{}: is a folder; name a file in it", path)
    if str(target).endswith(("/", os.sep)):
        raise OutputError("{}: no such folder; name a file without the last '{}'", target, str(target)[-1])
    if path.exists() and not path.is_file():
        raise OutputError("{}: is a device or a pipe; name a file", path)
    if not path.parent.is_dir():
        raise OutputError("{}: no folder '{}'; create it first", path, path.parent)
    if not os.access(path.parent, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise OutputError("{}: no permission to write; choose another folder", path)
    for source in inputs:
        if source is not None and same_file(path, Path(source)):
            raise OutputError(
                "{}: is an input or another output of this run and is never overwritten; choose another name", path
            )


def same_file(a: Path, b: Path) -> bool:
    """Return whether two paths refer to the same file, even if the file does not exist."""
    if a.exists() and b.exists():
        return a.samefile(b)
    return os.path.realpath(a) == os.path.realpath(b)


def write_whole(target: str | Path, text: str, *, encoding: str = "utf-8", newline: str = "\n") -> None:
    """Write `text` to a file atomically: write a temporary file, then rename it.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    write_all_or_none({str(target): text}, encoding=encoding, newline=newline)


def write_bytes(target: str | Path, data: bytes) -> None:
    """Write `data` to a file atomically.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    write_whole(target, data.decode("latin-1"), encoding="latin-1", newline="")


def write_all_or_none(
    texts: Mapping[str, str],
    *,
    encoding: str = "utf-8",
    newline: str = "\n",
    encodings: Mapping[str, str] = _NO_EXCEPTIONS,
) -> None:
    """Write several related files, either all of them or none.

    The first file is the main file, and the others describe it. The function first writes all files under temporary
    names. It then deletes the old versions of the other files, renames the main file into place, and finally renames
    the others. If the process is killed in between, the main file exists in its old or its new version, but never next
    to a description of a different version. If a rename fails, the function restores the previous contents. It also
    deletes temporary files that killed runs left over.

    `encodings` lists the files whose encoding differs from `encoding`.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    temporary: dict[Path, Path] = {}
    before: dict[Path, Path | None] = {}
    done = False
    target = encoding_of = ""
    try:
        for target, text in texts.items():
            path = Path(os.path.realpath(target))  # write through a symbolic link
            _remove_stale_temporary_files(path)
            encoding_of = encodings.get(target, encoding)
            mode = path.stat().st_mode & 0o777 if path.exists() else None
            written = path.with_name(f"{_prefix_of_this_process(path)}{os.urandom(4).hex()}")
            opener = partial(os.open, mode=0o666 if mode is None else mode)
            with open(written, "x", encoding=encoding_of, newline=newline, opener=opener) as file:
                temporary[path] = written
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            if mode is not None:  # whatever the umask
                written.chmod(mode)
        for path in temporary if len(temporary) > 1 else ():
            target = str(path)
            before[path] = _create_backup(path)
        for path in list(before)[1:]:
            target = str(path)
            path.unlink(missing_ok=True)
        _sync_folders(temporary)
        for path, written in temporary.items():
            target = str(path)
            written.replace(path)
            _sync_folders([path])
        done = True
    except OSError as problem:
        raise OutputError("{}: cannot be written ({})", target, problem.strerror) from None
    except UnicodeError:
        raise OutputError("{}: cannot be written (a character is not in {})", target, encoding_of) from None
    finally:
        if not done:
            _restore_backups(before)
        for written in (*temporary.values(), *(old for old in before.values() if old is not None)):
            with suppress(OSError):
                written.unlink()


def _temporary_file_prefix(path: Path) -> str:
    """Return the common prefix of all temporary files for a file. The process id follows the prefix."""
    return f".{path.name}.leafcut-"


def _prefix_of_this_process(path: Path) -> str:
    return f"{_temporary_file_prefix(path)}{os.getpid()}-"


def _remove_stale_temporary_files(path: Path) -> None:
    import glob  # imported here for a quick start

    for left in path.parent.glob(f"{glob.escape(_temporary_file_prefix(path))}*-*"):
        process = left.name.removeprefix(_temporary_file_prefix(path)).partition("-")[0]
        if process.isdecimal() and not _is_running(int(process)):
            with suppress(OSError):
                left.unlink()


def _is_running(process: int) -> bool:
    if os.name == "nt":  # on Windows, signal 0 would end the process
        return process == os.getpid()
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def _create_backup(path: Path) -> Path | None:
    """Back up a file as a hard link or a copy, and return the path of the backup.

    Return None if the file does not exist.
    """
    if not path.exists():
        return None
    backup = path.with_name(f"{_prefix_of_this_process(path)}before-{os.urandom(4).hex()}")
    try:
        os.link(path, backup)
    except OSError:  # not every file system supports hard links
        backup.write_bytes(path.read_bytes())
    return backup


def _restore_backups(before: Mapping[Path, Path | None]) -> None:
    for path in list(before)[1:]:
        with suppress(OSError):
            path.unlink()
    for path, old in before.items():
        with suppress(OSError):
            path.unlink() if old is None else old.replace(path)


def _sync_folders(paths: Iterable[Path]) -> None:
    for folder in {path.parent for path in paths}:
        with suppress(OSError):
            number = os.open(folder, os.O_RDONLY)
            try:
                os.fsync(number)
            finally:
                os.close(number)
