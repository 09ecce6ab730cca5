"""Expand the inputs of a command from its arguments, and name the files to write for them."""

from __future__ import annotations

import glob
import hashlib
from collections.abc import Container, Iterable, Sequence
from pathlib import Path

from leafcut.errors import OptionError, ReadError, count_of
from leafcut.files.digests import command_in_header, is_unchanged
from leafcut.files.whole_files import OutputError, check_output, decode_text, same_file
from leafcut.units import FACTORS

TABLE, PAGE = "batch.csv", "batch.html"
#: Extension of a list of inputs, and the maximum number of inputs.
LIST, MAX_INPUTS = ".list", 100_000
#: All units of options.
UNIT_WORDS = frozenset(unit for units in FACTORS.values() for unit in units)
_DASH = "-"


def expand_folders_and_lists(words: Iterable[str]) -> list[str]:
    """Return the inputs; a folder is replaced by its files, and a list (.list) by the inputs on its lines.

    Of a folder, only files that leafcut can read (by content or extension) are used. Lines of a list that start with #
    are comments; relative paths are relative to the list. Raises OptionError if a folder has no input, a list cannot be
    read, or there are too many inputs.
    """
    inputs: list[str] = []
    for word in words:
        path = Path(word)
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if file.is_file() and not file.name.startswith("."))
            files = [str(file) for file in inside if file.name not in (TABLE, PAGE) and is_input(file)]
            if not files:
                raise OptionError(f"{word}: this folder has no drawing and no program")
            inputs += files
        elif path.suffix.lower() == LIST:
            inputs += _inputs_in_list(path)
        else:
            inputs.append(word)
    if len(inputs) > MAX_INPUTS:
        raise OptionError(f"{count_of(len(inputs), 'input')}; at most {MAX_INPUTS:,} are possible")
    return inputs


def is_input(path: Path) -> bool:
    """Return whether a file in a folder is an input: leafcut can read it and has not written it."""
    from leafcut.read.registry import detect_format_name

    kind = detect_format_name(path)
    try:
        return bool(kind) and not (kind in ("gcode", "dxf") and _is_unchanged_output(path.read_bytes()))
    except OSError:  # the file was removed
        return False


def _is_unchanged_output(data: bytes) -> bool:
    """Return whether the content of a file is an unchanged program or drawing of leafcut."""
    return is_unchanged(decode_text(data)[0])


def _inputs_in_list(path: Path) -> list[str]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise OptionError(f"{path}: cannot be read as a list of inputs ({problem})") from None
    names = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not names:
        raise OptionError(f"{path}: this list names no input")
    return [name if ":" in name else str(path.parent / name) for name in names]


def expand_inputs(
    words: Sequence[str], command: str, *, folder: str | None = None, joins: bool = False
) -> tuple[list[str], bool]:
    """Return the inputs, and whether each is processed separately.

    A word with ``*``, ``?`` or ``[`` that is not a file is replaced by the matching files, sorted by name, because not
    every shell expands patterns. Several inputs are processed separately, except drill files if the command joins them
    and no `folder` for several programs is given.

    Raises
    ------
    ReadError
        No file matches a pattern.
    OptionError
        The input is missing, standard input is combined with others, or a word is the unit of the preceding option.
    """
    inputs: list[str] = []
    pattern = False
    for word in words:
        if word in UNIT_WORDS and not Path(word).exists():
            raise OptionError(f"{word}: file not found; write a unit directly after its number, such as 6{word}")
        if not glob.has_magic(word) or Path(word).exists():
            inputs.append(word)
            continue
        matches = sorted(name for name in glob.glob(word) if Path(name).is_file())  # noqa: PTH207  # as it is typed
        if not matches:
            raise ReadError(word, "no file matches")
        inputs, pattern = [*inputs, *matches], True
    if not inputs:
        raise OptionError(f"{command} needs an INPUT (see leafcut {command} --help)")
    if len(inputs) > 1 and _DASH in inputs:
        raise OptionError("-: standard input cannot be combined with other inputs")
    if joins and len(inputs) > 1 and all_drill_files(inputs) and not (folder and Path(folder).is_dir()):
        return inputs, False
    return inputs, pattern or len(inputs) > 1


def all_drill_files(inputs: Iterable[str]) -> bool:
    """Return whether all inputs are drill files, which may belong to one board."""
    from leafcut.read.registry import detect_format_name

    return all(detect_format_name(source) == "excellon" for source in inputs)


def program_files_beside_inputs(inputs: Sequence[str], names: Sequence[str], all_inputs: Iterable[str]) -> list[str]:
    """Return the program file of each input, in the folder of the input or in the working folder for a built-in input.

    A program that would replace one of `all_inputs` gets ``.leafcut`` in its name. Raises OptionError if two inputs
    have the same program name, and OutputError if a file cannot be written.
    """
    targets = []
    known = [Path(source) for source in all_inputs]
    for source, name in zip(inputs, names, strict=True):
        path = (Path(source).parent if Path(source).is_file() else Path()) / name
        if any(same_file(path, source) for source in known):
            path = path.with_name(f"{path.stem}.leafcut{path.suffix}")
        targets.append(str(path))
    _refuse_equal_names(inputs, targets)
    for target in targets:
        check_output(target, known)
    return targets


def refuse_foreign_file(
    target: str | None, inputs: Sequence[str], command: str = "", earlier: Container[str] = frozenset()
) -> None:
    """Raise OutputError for an existing file, unless it is a copy of an input or an unchanged file of leafcut.

    With `command`, the file must be of this command. `earlier` are hashes of further files that may be replaced.
    """
    path = Path(target or "")
    if target is None or not path.is_file():
        return
    data = path.read_bytes()
    if hashlib.sha256(data).hexdigest() in earlier:
        return
    if any(Path(source).is_file() and Path(source).read_bytes() == data for source in inputs):
        return
    text = decode_text(data)[0]
    if not is_unchanged(text):
        raise OutputError(
            f"{target}: the file exists and its header does not show an unchanged file of leafcut; name another file "
            "with -o, or move this one away"
        )
    other = command_in_header(text)
    if command and other and other != command:
        raise OutputError(
            f"{target}: the file exists and was written by `leafcut {other}`; name another file with -o to keep both"
        )


def _refuse_equal_names(inputs: Sequence[str], names: Sequence[str]) -> None:
    first: dict[str, str] = {}
    for source, name in zip(inputs, names, strict=True):
        if name.casefold() in first:
            raise OptionError(
                f"{first[name.casefold()]} and {source} would both be written as {name}; run them separately"
            )
        first[name.casefold()] = source


def output_files(inputs: Sequence[str], names: Sequence[str], folder: str | None, flag: str) -> list[str | None]:
    """Return the output file of each of several inputs in a folder; None for each input without a folder.

    Raises OutputError if the folder does not exist, or if a file cannot be written or is an input. Raises OptionError
    if two inputs have the same program name.
    """
    if folder is None:
        return [None for _ in inputs]
    _refuse_equal_names(inputs, names)
    if folder == _DASH:
        raise OptionError(
            f"{flag} -: only one program can be written to standard output; for {len(inputs)} inputs name a folder"
        )
    if not Path(folder).is_dir():
        raise OutputError(f"{folder}: not a folder; with several inputs {flag} names a folder, create it first")
    targets = [str(Path(folder) / name) for name in names]
    for target in targets:
        check_output(target, inputs)
    return list(targets)
