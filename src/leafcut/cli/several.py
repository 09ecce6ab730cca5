"""Several inputs of one command: which files are meant, whether each is done by itself, and what it is written as."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Sequence
from pathlib import Path

from leafcut.errors import OptionError, ReadError
from leafcut.files.whole_files import OutputError, check_output

#: Stands for standard input.
_DASH = "-"


def expanded(
    words: Sequence[str], command: str, *, folder: str | None = None, joins: bool = False
) -> tuple[list[str], bool]:
    """Return the inputs that are meant, and whether each is done by itself.

    A word with ``*``, ``?`` or ``[`` that is no file stands for the files that fit it, in the order of their names: not
    every shell looks for them. Several inputs are done by themselves, but for drill files, of which one program is
    made where the command `joins` them, unless a `folder` is there for several.

    Raises
    ------
    ReadError
        Nothing fits.
    OptionError
        There is no input, or standard input beside others.
    """
    inputs: list[str] = []
    pattern = False
    for word in words:
        if not glob.has_magic(word) or Path(word).exists():
            inputs.append(word)
            continue
        found = sorted(name for name in glob.glob(word) if Path(name).is_file())  # noqa: PTH207  # as it is typed
        if not found:
            raise ReadError(word, "no file matches")
        inputs, pattern = [*inputs, *found], True
    if not inputs:
        raise OptionError(f"{command} needs an INPUT (see leafcut {command} --help)")
    if len(inputs) > 1 and _DASH in inputs:
        raise OptionError("-: standard input cannot be combined with other inputs")
    if joins and len(inputs) > 1 and all_drill_files(inputs) and not (folder and Path(folder).is_dir()):
        return inputs, False
    return inputs, pattern or len(inputs) > 1


def all_drill_files(inputs: Iterable[str]) -> bool:
    """Return whether inputs may be those of one board."""
    from leafcut.read.registry import format_name

    return all(format_name(one) == "excellon" for one in inputs)


def targets_of(inputs: Sequence[str], names: Sequence[str], folder: str | None, flag: str) -> list[str | None]:
    """Return where each of several inputs is written: in a folder, under its name; None for each without a folder.

    Raises
    ------
    OptionError
        The folder is none, or two inputs would be written under one name.
    OutputError
        One cannot be written, or is an input.
    """
    first: dict[str, str] = {}
    for source, name in zip(inputs, names, strict=True):
        if name.casefold() in first:
            raise OptionError(
                f"{first[name.casefold()]} and {source} would both be written as {name}; run them separately"
            )
        first[name.casefold()] = source
    if folder is None:
        return [None for _ in inputs]
    if folder == _DASH:
        raise OptionError(
            f"{flag} -: only one program can go to standard output; for {len(inputs)} inputs name a folder"
        )
    if not Path(folder).is_dir():
        raise OutputError(f"{folder}: not a folder; with several inputs {flag} names a folder, create it first")
    targets = [str(Path(folder) / name) for name in names]
    for target in targets:
        check_output(target, inputs)
    return list(targets)
