"""`run_batch`: many inputs with the same options, in threads, processes or on a cluster, and one report of all.

What becomes of each input stands in a table (CSV) beside the programs, a line as soon as it is over. From it a batch
goes on that was cut short: an input that is the same, with the same options and version, is not done again.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from leafcut import api
from leafcut._version import __version__
from leafcut.cli.several import targets_of
from leafcut.errors import LeafcutError, OptionError, count_of
from leafcut.files.whole_files import OutputError, write_together
from leafcut.model.heartbeat import Progress
from leafcut.order.executors import WatchedExecutor, run_tasks
from leafcut.read.registry import format_name, read_source
from leafcut.report.batch_page import batch_page

#: The table and the report, beside the programs.
TABLE, PAGE = "batch.csv", "batch.html"
#: A list of inputs has this ending, and at most so many lines.
LIST, MOST_INPUTS = ".list", 100_000

WRITTEN, REFUSED = "written", "refused"


@dataclass(frozen=True)
class BatchRow:
    """What became of one input.

    Attributes
    ----------
    state
        `WRITTEN` or `REFUSED`.
    before_s, after_s
        Machine time of the usual order, or of the program that was given, and of the one that was written; "" where it
        is not known.
    issues
        How many were noticed, beside notes; `worst` is the severity of the worst.
    line
        Why it was refused.
    key, program_sha256
        Of all that the program is made of, and of the program.
    """

    input: str
    program: str
    state: str
    before_s: str = ""
    after_s: str = ""
    saved_percent: str = ""
    issues: int = 0
    worst: str = ""
    line: str = ""
    key: str = ""
    program_sha256: str = ""


@dataclass(frozen=True)
class BatchTask:
    """One input with all that is asked of it; `source` is read already, so that a worker needs no file of this one."""

    name: str
    program: str
    key: str
    source: Any
    given: Mapping[str, Any]


def inputs_of(words: Iterable[str]) -> list[str]:
    """Return the inputs that are meant: a folder stands for its files, and a list for the inputs on its lines.

    Of a folder all are meant that leafcut may read, by their content or ending. A line of a list that begins with #
    says nothing; a relative path is that from the list.

    Raises
    ------
    OptionError, OutputError
        There is no input, or a list cannot be read.
    """
    found: list[str] = []
    for word in words:
        path = Path(word)
        if path.is_dir():
            inside = sorted(one for one in path.iterdir() if one.is_file() and not one.name.startswith("."))
            found += [str(one) for one in inside if one.name not in (TABLE, PAGE) and format_name(one)]
        elif path.suffix.lower() == LIST:
            found += _listed(path)
        else:
            found.append(word)
    if not found:
        raise OptionError("batch needs inputs: a folder with drawings or programs, a list (.list), or files")
    if len(found) > MOST_INPUTS:
        raise OptionError(f"{count_of(len(found), 'input')}; a batch takes {MOST_INPUTS:,} at most")
    return list(dict.fromkeys(found))


def _listed(path: Path) -> list[str]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise OptionError(f"{path}: cannot be read as a list of inputs ({problem})") from None
    names = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    return [name if ":" in name else str(path.parent / name) for name in names]


def run_batch(
    inputs: Sequence[str],
    folder: str,
    given: Mapping[str, Any],
    executor: WatchedExecutor,
    *,
    progress: Progress | None = None,
    refused: Callable[[str], None] = lambda line: None,
    beside: Iterable[BatchRow] = (),
) -> list[BatchRow]:
    """Make a program of each input in a folder, with a table and a report of all; return a row for each.

    Parameters
    ----------
    given
        What `api.optimize` is given with each.
    refused
        Told a line for each input that is refused, when that is known.
    beside
        Rows of other inputs, which the table and the report have, too.

    Raises
    ------
    OptionError, OutputError
        Options hold for no input, or the folder cannot be written.
    ExecutorError
        The cluster is gone. What is done stays, and the same call goes on.
    """
    names = [api.output_name(source, **given) for source in inputs]
    targets = [str(one) for one in targets_of(inputs, names, folder, "-o")]
    table = Path(folder) / TABLE
    known = read_table(table)
    asked = _asked(given)
    rows: dict[str, BatchRow] = {}
    others = [row for row in beside if row.input not in inputs]
    tasks: list[tuple[str, str, str]] = []
    for source, target in zip(inputs, targets, strict=True):
        try:
            key = _key(source, asked)
        except LeafcutError as problem:
            rows[source] = BatchRow(source, Path(target).name, REFUSED, line=str(problem))
            refused(_told(source, str(problem)))
            continue
        old = known.get(source)
        if old is not None and old.key == key and sha_of(Path(target)) == old.program_sha256:
            rows[source] = old
        else:
            tasks.append((source, target, key))
    _write_table(table, (*others, *rows.values()))
    todo = len(tasks)
    if progress is not None and todo:
        progress(f"{todo} of {count_of(len(inputs), 'input')}", None, 0.0, None)
    for done, (task, answer) in enumerate(run_tasks(executor, do, _tasks(tasks, given)), 1):
        row = _kept(task, answer, folder)
        rows[task.name] = row
        if row.state == REFUSED:
            refused(_told(task.name, row.line))
        _append(table, row)
        if progress is not None:
            progress(f"{Path(task.name).name} ({done} of {todo})", None, done / todo, None)
    every = [rows[source] for source in inputs]
    told = [*others, *every]
    page = batch_page([asdict(row) for row in told], __version__)
    write_together({str(table): _as_csv(told), str(Path(folder) / PAGE): page})
    return every


def do(task: BatchTask) -> tuple[BatchRow, bytes]:
    """Return the row of an input and its program; what is refused is told in the row, as errors may not travel."""
    row = BatchRow(task.name, task.program, REFUSED, key=task.key)
    try:
        outcome = api.optimize(task.source, **task.given)
    except LeafcutError as problem:
        return replace(row, line=str(problem)), b""
    except MemoryError:
        return replace(row, line="not enough memory for this input"), b""
    data = outcome.text.encode(outcome.encoding)
    issues = [issue.severity for issue in outcome.issues if issue.severity != "note"]
    worst = next((one for one in ("danger", "missing", "warning") if one in issues), "")
    before, after = outcome.before.time_s, outcome.after.time_s
    saved = outcome.saved_percent
    made = replace(
        row,
        state=WRITTEN,
        before_s=_figure(before),
        after_s=_figure(after),
        saved_percent=_figure(saved),
        issues=len(issues),
        worst=worst,
        program_sha256=hashlib.sha256(data).hexdigest(),
    )
    return made, data


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _tasks(tasks: Iterable[tuple[str, str, str]], given: Mapping[str, Any]) -> Iterator[BatchTask]:
    """Yield the tasks, each read when it is given out: only so many are in memory."""
    for source, target, key in tasks:
        yield BatchTask(source, Path(target).name, key, read_source(source)[1], given)


def _kept(task: BatchTask, answer: Any, folder: str) -> BatchRow:
    """Write the program of an answer; return its row."""
    if isinstance(answer, BaseException):
        return BatchRow(task.name, task.program, REFUSED, line=f"{type(answer).__name__}: {answer}", key=task.key)
    row, data = answer
    if row.state == WRITTEN:
        path = Path(folder) / task.program
        # latin-1 has a letter for each byte: the program is written as it was made.
        write_together({str(path): data.decode("latin-1")}, encodings={str(path): "latin-1"}, newline="")
    return row  # type: ignore[no-any-return]


def _told(source: str, line: str) -> str:
    return line if source in line else f"{source}: {line}"


def _key(source: str, asked: str) -> str:
    """Return the hash of all that a program is made of."""
    data = read_source(source)[1].data or source.encode()
    return hashlib.sha256(b"\0".join([hashlib.sha256(data).digest(), asked.encode()])).hexdigest()


def _asked(given: Mapping[str, Any]) -> str:
    """Return the options and the version as a text; a file among them counts by what is in it."""
    words = {}
    for name, value in sorted(given.items()):
        path = Path(str(value)) if isinstance(value, str | Path) else None
        words[name] = sha_of(path) if path is not None and path.is_file() else repr(value)
    return repr((__version__, words))


def sha_of(path: Path) -> str:
    """Return the hash of what a file holds; "" where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


# -- the table ------------------------------------------------------------------------------------------------------


_NAMES = [field.name for field in fields(BatchRow)]


def _as_csv(rows: Iterable[BatchRow]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_NAMES)
    writer.writerows([getattr(row, name) for name in _NAMES] for row in rows)
    return text.getvalue()


def _write_table(table: Path, rows: Iterable[BatchRow]) -> None:
    write_together({str(table): _as_csv(rows)})


def _append(table: Path, row: BatchRow) -> None:
    """Add a line at once: what is over stays, also when this program is killed."""
    line = _as_csv([row]).split("\n", 1)[1]
    try:
        with table.open("a", encoding="utf-8", newline="") as file:
            file.write(line)
    except OSError as problem:
        raise OutputError(f"{table}: cannot be written ({problem.strerror}); what is done stays") from None


def read_table(table: Path) -> dict[str, BatchRow]:
    """Return the rows of an earlier batch in this folder, by input; a line that was cut short is none.

    Raises
    ------
    OutputError
        There is a table of another kind.
    """
    if not table.is_file():
        return {}
    try:
        rows = list(csv.reader(table.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise OutputError(f"{table}: cannot be read ({problem}); choose another folder") from None
    if not rows or rows[0] != _NAMES:
        raise OutputError(f"{table}: not a table of a batch; choose another folder")
    found = {}
    for row in rows[1:]:
        if len(row) != len(_NAMES) or not row[_NAMES.index("issues")].isdecimal():
            continue
        values: dict[str, Any] = dict(zip(_NAMES, row, strict=True))
        one = BatchRow(**{**values, "issues": int(values["issues"])})
        if one.state == WRITTEN and len(one.program_sha256) == 64:
            found[one.input] = one
    return found
