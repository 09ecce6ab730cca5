"""Code that several commands share: exit statuses, flags, error lines, files."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, Name, switch_parameter
from leafcut.cli.usage import DASH, HELD
from leafcut.errors import DataError, LeafcutError, OptionError
from leafcut.files.schemas import ANSWER, add_schema_number
from leafcut.files.user_files import DEFAULTS_VARIABLE, defaults_file
from leafcut.files.whole_files import OutputError
from leafcut.message import Message

DONE, REFUSED, USAGE, INCOMPLETE = 0, 1, 2, 3
STATUSES = "Exit status: 0 done; 1 refused; 2 wrong usage; 3 done, but work is missing, which is reported first."
_WORST_FIRST = ("danger", "missing", "warning")
#: Exit statuses, best first. For several inputs, the worst status counts.
_STATUS_ORDER = (DONE, INCOMPLETE, REFUSED, USAGE)
#: Maximum number of warnings printed with --quiet.
MAX_WARNINGS = 10

OptionsFile = Annotated[File | None, Parameter(name="--options", help="a TOML file of options")]
NoDefaults = Annotated[
    bool,
    switch_parameter(
        "--no-defaults",
        help=f"ignore your defaults file (leafcut/defaults.toml in your settings folder, or ${DEFAULTS_VARIABLE})",
    ),
]
DialectOption = Annotated[
    Name | None,
    Parameter(name="--dialect", help="dialect of the program, by name or TOML file (default: the machine's)"),
]
Quiet = Annotated[bool, switch_parameter("--quiet", "-q", help="print only warnings: no progress and no summary")]


def error_line_and_status(problem: Exception) -> tuple[str, int]:
    """Return the error line of an exception, and the exit status."""
    if isinstance(problem, LeafcutError):
        line = "; ".join([str(problem), *getattr(problem, "__notes__", ())])
        wrong_usage = isinstance(problem, OptionError) and not isinstance(problem, DataError)
        return line, USAGE if wrong_usage else REFUSED
    if isinstance(problem, MemoryError):
        return "not enough memory for this input", REFUSED
    if os.environ.get("LEAFCUT_TRACEBACK"):
        raise problem
    text = " ".join(f"{type(problem).__name__}: {problem}".split())
    return Message("internal error in leafcut ({}); set LEAFCUT_TRACEBACK=1 for details", text), REFUSED


def print_issues(issues: Iterable[Any], place: str = "") -> None:
    """Print the issues that matter even without a summary, such as missing holes and assumed depths."""
    from leafcut.model.issue import LIMITS

    worst_first = sorted((i for i in issues if i.severity != "note"), key=lambda i: _WORST_FIRST.index(i.severity))
    lines = {f"{place}{issue.severity}: {issue}": issue.code in LIMITS for issue in worst_first}
    n_left = MAX_WARNINGS
    for line, is_limit in lines.items():
        # Never shorten assumptions.
        if is_limit or n_left > 0:
            print_error_line(line, DONE)
        n_left -= not is_limit
    if n_left < 0:
        print_error_line(f"warning: {-n_left} more", DONE)


def print_error_line(line: str, status: int) -> int:
    """Print a line on standard error, and return the status."""
    print(f"leafcut: {printable(line)}", file=sys.stderr)
    return status


def printable(line: str) -> str:
    """Return a line without unprintable characters, which file names may contain."""
    line = line.replace(HELD, DASH)  # the placeholder of a dash that does not stand for standard input
    return "".join(c if c.isprintable() else "?" for c in line)


def print_json(answer: Mapping[str, Any]) -> None:
    """Print the answer of a command as JSON, schema number first."""
    text = json.dumps(add_schema_number(ANSWER, answer), allow_nan=False, indent=2, ensure_ascii=False)
    with suppress(UnicodeError):
        # If a file name does not fit the locale, Python stores its bytes as surrogates: restore the characters.
        text = text.encode("utf-8", "surrogateescape").decode("utf-8")
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except (UnicodeError, LookupError):
        # Standard output cannot encode all characters: escape them.
        text = json.dumps(json.loads(text), indent=2)
    print(text)


@contextmanager
def note_unchanged_output(output: str | None) -> Iterator[None]:
    """Add a note to an error if the output of an earlier run still exists, because that program would run on the
    machine.
    """
    try:
        yield
    except LeafcutError as problem:
        if output and Path(output).is_file() and not isinstance(problem, OutputError):
            problem.add_note(f"{output} was not changed")
        raise


def process_each_input(
    noun: str, inputs: Sequence[str], do: Callable[[int, str], tuple[dict[str, Any], int]]
) -> tuple[list[dict[str, Any]], int]:
    """Return the answer for each input with its ``status``, and the worst status; errors are printed at once."""
    rows: list[dict[str, Any]] = []
    for number, source in enumerate(inputs):
        try:
            answer, status = do(number, source)
        except KeyboardInterrupt:
            print_error_line(f"interrupted; {number} of {len(inputs)} inputs were done", REFUSED)
            rows += [{noun: unfinished, "error": "interrupted", "status": REFUSED} for unfinished in inputs[number:]]
            break
        except BrokenPipeError:
            raise
        except Exception as problem:
            line, status = error_line_and_status(problem)
            print_error_line(prefix_input_name(source, line), status)
            answer = {noun: source, "error": line}
        rows.append({**answer, "status": status})
    return rows, max((row["status"] for row in rows), key=_STATUS_ORDER.index)


def prefix_input_name(source: str, line: str) -> str:
    """Return a line that names its input."""
    return line if source in line or str(Path(source)) in line else f"{source}: {line}"


def print_defaults(options: Sequence[str]) -> None:
    """Print the options that came from the user's defaults file."""
    if options:
        print(f"from your defaults file: {', '.join(options)}")


def given_options(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that have a value."""
    return {name: restore_dash(value) for name, value in options.items() if value is not None}


def refuse_standard_output(flag: str, name: str | None) -> None:
    """Raise OptionError if standard output is named for an output that is not a program."""
    if restore_dash(name) == DASH:
        raise OptionError(f"{flag} -: only a program can be written to standard output; name a file")


def restore_dash(word: Any) -> Any:
    """Return ``-`` for its placeholder on the command line (`HELD`); other words are unchanged."""
    return DASH if word == HELD else word


def defaults_file_unless(left_out: bool) -> Path | None:
    """Return the user's defaults file; None if `left_out` is set or the file does not exist."""
    return None if left_out else defaults_file()


def write_program_to_stdout(data: bytes) -> None:
    """Write a program to standard output as bytes, independent of the terminal's encoding."""
    sys.stdout.flush()
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()
