"""Tasks that a page requests: a command with inputs and options. They are translated into calls of leafcut."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, name_suggestion, printable
from leafcut.files.user_files import has_defaults
from leafcut.message import Message
from leafcut.options import LITERATURE
from leafcut.options.option_spec import flag_name, split_names
from leafcut.options.sheet_word import OFFERED, SheetWord, parse_sheet
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings, group_of
from leafcut.read.format import has_lone_surrogate
from leafcut.studio.folder import BUILT_IN, OWN, Folder
from leafcut.studio.jobs.nest_request import WantedPart, needs_list

#: Number of input files for each command, or 0 for any number.
COMMANDS = {"optimize": 1, "nest": 0, "solve": 1, "simulate": 1, "verify": 2}
LIST, NEST = "parts.csv", "nest.dxf"
#: Maximum number of drawings to mention in a title.
_MAX_NAMED = 4
#: Maps each option that may name one of the user's own files to the kind of file. Unlike uploads, these files may
#: change.
OWN_KINDS = {"machine": "machines", "tools": "tools"}


@dataclass(frozen=True)
class Task:
    """A command with its inputs and options, as sent by a page.

    Inputs are ids of uploads or names of built-in parts. For a nest, `nest_request.WantedPart.word` encodes the inputs.
    The value of an option is a text, a boolean or a number. An option refers to a file by the id of an upload, or by
    ``mine:`` and the name of one of the user's own files. If the input is a nested sheet, `origin` contains its job,
    variant and layout, separated by slashes.
    """

    command: str
    inputs: tuple[str, ...]
    process: str = "auto"
    options: dict[str, Any] = field(default_factory=dict)
    origin: str = ""

    def as_json(self) -> str:
        """Convert the task to one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Task:
        """Convert the result of `as_json` back to a task."""
        plain = json.loads(text)
        return cls(
            plain["command"],
            tuple(plain["inputs"]),
            plain["process"],
            plain["options"],
            plain.get("origin", ""),
        )


@dataclass(frozen=True)
class ReadyTask:
    """A checked task with paths instead of ids. Only a nest has `parts`."""

    command: str
    sources: tuple[str, ...]
    process: str
    options: dict[str, Any]
    parts: tuple[WantedPart, ...] = ()

    @property
    def records_iterations(self) -> bool:
        """Whether iterations are recorded. This is the case if the search is an algorithm from the literature."""
        return self.command in ("solve", "optimize") and self.options.get("algorithm") in LITERATURE

    @property
    def objective_unit(self) -> str:
        """The unit of the search's objective. It is empty for a map, which has its own distance function."""
        units = {"time": "s", "distance": "mm"}
        return units.get(str(self.options.get("objective") or "time"), "") if self.command == "optimize" else ""


def resolve_task(task: Task, folder: Folder) -> ReadyTask:
    """Check a task without reading its inputs, and replace its ids with paths.

    Raises `OptionError` if an option is invalid or names a file outside the studio.
    """
    if task.command not in COMMANDS:
        raise OptionError("unknown command '{}'{}", task.command, name_suggestion(task.command, COMMANDS))
    if has_lone_surrogate([task.inputs, task.options]):
        raise OptionError("the text contains an invalid character (\\ud800 to \\udfff)")
    parts, drawn = nested_parts(task), _uploads_of_sheets(task, folder)
    parts = tuple(part for part in parts if part.input not in drawn.values())
    if task.command == "nest" and not parts:
        raise OptionError("there are no parts to nest; open their drawings")
    if task.command != "nest" and len(task.inputs) != COMMANDS[task.command]:
        files = Message("one file") if COMMANDS[task.command] == 1 else Message("{} files", COMMANDS[task.command])
        raise OptionError("{} needs {}", task.command, files)
    registry.check_process_value(task.process)
    options = {name: _resolve_option(name, value, folder) for name, value in options_with_value(task.options).items()}
    if drawn:
        options["sheet"] = tuple(
            _sheet_option_text(word, str(folder.input_path(drawn[word.name])) if word.size is None else word.name)
            for word in map(parse_sheet, split_names(options["sheet"]))
        )
    collect_settings(options)
    # Built-in sources are not drawings, so every part is an upload.
    sources = [str(folder.input_path(part.input)) for part in parts] or [
        folder.resolve_source(word) for word in task.inputs
    ]
    if parts and any(source.lower().endswith(".csv") for source in sources):
        raise OptionError("the studio cannot read the files of a parts list; open the drawings themselves")
    return ReadyTask(task.command, tuple(sources), task.process, options, parts)


def nested_parts(task: Task) -> tuple[WantedPart, ...]:
    """Return the parts of a nest.

    Other tasks have no parts. Raises `OptionError` if a quantity or an angle is invalid.
    """
    return tuple(WantedPart.decode(word) for word in task.inputs) if task.command == "nest" else ()


def _uploads_of_sheets(task: Task, folder: Folder) -> dict[str, str]:
    """Return the name and the upload id of each drawing that --sheet names.

    Raises `OptionError` if a drawing is not open.
    """
    sheet = options_with_value(task.options).get("sheet")
    if task.command != "nest" or sheet is None:
        return {}
    open_ = {folder.input_path(part.input).name: part.input for part in nested_parts(task)}
    names = [word.name for word in map(parse_sheet, split_names(sheet)) if word.size is None]
    for name in names:
        if name not in open_:
            raise OptionError("--sheet: drawing '{}' is not open; open it, or give a size", printable(name))
    return {name: open_[name] for name in names}


def _sheet_option_text(word: SheetWord, name: str) -> str:
    count = "" if word.count is None else f":{word.count}"
    return name + count + ("" if word.price is None else f"@{word.price:.6f}")


def options_with_value(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return all options that have a value, without empty fields."""
    return {name: value for name, value in options.items() if value is not None and value != ""}


def _resolve_option(name: str, value: Any, folder: Folder) -> Any:
    spec = group_of(name).specs()[name]
    flag = flag_name(name)
    if spec.is_output:
        raise OptionError("{}: the studio sets this file itself; leave it out", flag)
    if spec.kind != "path" and not spec.may_be_path:
        return value
    if not isinstance(value, str):
        raise OptionError("{}: unknown file id '{}'", flag, value)
    if value.startswith(OWN) and name in OWN_KINDS:
        return str(folder.existing_own_path(OWN_KINDS[name], value, flag))
    if spec.may_be_path and not spec.names_file(value) and "/" not in value and "\\" not in value:
        return value  # the name of a shipped file or the size of a block; checked where it is used
    try:
        return str(folder.input_path(value))
    except OptionError:
        raise OptionError("{}: choose a file opened in the studio, not a path", flag) from None


def input_names(task: Task, folder: Folder) -> tuple[str, ...]:
    """Return the displayed names of the inputs."""
    if task.command == "nest":
        return tuple(folder.input_path(part.input).name for part in nested_parts(task))
    return tuple(word if word.startswith(BUILT_IN) else folder.input_path(word).name for word in task.inputs)


def _parts_by_name(task: Task, folder: Folder, names: Sequence[str]) -> list[tuple[str, WantedPart]]:
    sheets = _uploads_of_sheets(task, folder).values()
    return [(name, part) for name, part in zip(names, nested_parts(task), strict=True) if part.input not in sheets]


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Make file names unique. Files with the same name are put into numbered folders, as in ``1/a.nc 2/a.nc``."""
    return tuple(f"{k}/{name}" if names.count(name) > 1 else name for k, name in enumerate(names, 1))


def source_display_name(word: str) -> str:
    """Return the displayed name of a built-in source, such as ``plate-27`` for ``example:plate-27``."""
    return word.removeprefix("example:")


def task_title(task: Task, folder: Folder) -> str:
    """Return the title of a task for the history. If a file no longer exists, its name is ``?``."""
    try:
        names = [source_display_name(name) for name in input_names(task, folder)]
        if task.command == "nest":
            names = [f"{name} × {part.quantity}" for name, part in _parts_by_name(task, folder, names)]
        return " · ".join(names[:_MAX_NAMED]) + (" …" if len(names) > _MAX_NAMED else "")
    except OptionError:
        return "?"


def program_name(source: str, extension: str) -> str:
    """Return the file name of the program for `source`. It always differs from the name of `source` itself."""
    name = source.replace("example:", "").replace("random:", "random-").replace(":", "-")
    stem, suffix = Path(name).stem, Path(name).suffix
    return f"{stem}_leafcut{suffix}" if suffix.lower() == extension.lower() else f"{stem}{extension}"


def command_line(task: Task, folder: Folder, output: str = "") -> str:
    """Return the shell command that repeats a job. It contains the file names that the user sees."""
    names = unique_names(input_names(task, folder))
    if task.command == "nest":
        parts = _parts_by_name(task, folder, input_names(task, folder))
        names = unique_names([name for name, _ in parts])
        counted = [f"{name}:{part.quantity}" for name, (_, part) in zip(names, parts, strict=True)]
        listed = needs_list(tuple(part for _, part in parts))
        words = ["leafcut", "nest", *([LIST] if listed else counted), "-o", NEST]
        words += [] if "variants" in options_with_value(task.options) else ["--variants", str(OFFERED)]
    else:
        words = ["leafcut", task.command, *names]
    if task.command == "optimize":
        words += ["-o", output] if output else []
        words += ["--process", task.process] if task.process != "auto" else []
    for name, value in options_with_value(task.options).items():
        words += _flag_words(name, value, folder)
    # The command contains all options of the page, including the user's defaults, so it must not load them again.
    return shlex.join([*words, *(["--no-defaults"] if has_defaults() else [])])


def _flag_words(name: str, value: Any, folder: Folder) -> list[str]:
    spec = group_of(name).specs()[name]
    if spec.kind == "flag":
        return [flag_name(name if value else f"no_{name}")] if value != group_of(name).defaults()[name] else []
    resolved = _resolve_option(name, value, folder)
    if spec.kind == "path" or (spec.may_be_path and resolved != value):
        return [flag_name(name), Path(resolved).name]
    words = ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    # A value that starts with a dash would be read as a flag.
    return [f"{flag_name(name)}={words}"] if words.startswith("-") else [flag_name(name), words]
