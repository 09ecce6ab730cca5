"""Many inputs with the same options: one after another, in threads, in processes or on a cluster.

A folder of programs gets a report and a table (CSV), from which an interrupted run is resumed. An input is skipped if
the input, the options and the version of leafcut are the same, and its program is unchanged.
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
from leafcut.cli.several import PAGE, TABLE
from leafcut.cli.shared import error_line_and_status, prefix_input_name
from leafcut.errors import LeafcutError, count_of
from leafcut.files.whole_files import OutputError, write_all_or_none
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.model.issue import Issue
from leafcut.order.executors import WatchedExecutor, run_tasks
from leafcut.processes.registry import report_of
from leafcut.read.registry import read_source_with_format
from leafcut.report.json_answer import program_as_json
from leafcut.report.several import batch_page_html

WRITTEN, REFUSED, SIMULATED = "written", "refused", "not written"


@dataclass(frozen=True)
class BatchRow:
    """The result for one input, as a row of the table.

    Attributes
    ----------
    state
        `WRITTEN`, `REFUSED`, or `SIMULATED` if no program is to be written.
    before_s, after_s
        Machine times, s, of the nearest-neighbour order or the given program, and of the new program; "" if unknown.
    issues, worst
        Number of issues except notes, and severity of the worst issue.
    line
        Reason for a refusal.
    key
        Hash of the input, the options and the version of leafcut.
    program_sha256
        Hash of the program.
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
    """One input with its options.

    `source` is already read, so that a worker on another machine needs no file of this machine. `target` and `report`
    are the files to write, or "" if there is no such file.
    """

    name: str
    target: str
    report: str
    key: str
    source: Any
    given: Mapping[str, Any]


@dataclass(frozen=True)
class BatchResult:
    """The result of a task: row, issues, bytes of the program, report page, and the answer for ``--json``."""

    row: BatchRow
    data: bytes = b""
    page: str = ""
    answer: Mapping[str, Any] | None = None
    issues: tuple[Issue, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the JSON answer of this input in a list of several."""
        if self.row.state == REFUSED:
            return {"input": self.row.input, "error": self.row.line, "status": 1}
        if self.answer is None:  # finished by an earlier run
            return {"input": self.row.input, "output": self.row.program, "status": 0, "done_before": True}
        return {**self.answer, "input": self.row.input, "status": 3 if self.row.worst == "missing" else 0}


def run_batch(
    inputs: Sequence[str],
    targets: Sequence[str | None],
    given: Mapping[str, Any],
    executor: WatchedExecutor | None = None,
    *,
    folder: str | None = None,
    reports: Sequence[str | None] = (),
    progress: OnProgress | None = None,
    refused: Callable[[str], None] = lambda line: None,
    beside: Iterable[BatchRow] = (),
) -> list[BatchResult]:
    """Generate a program for each input, and return the results in the order of the inputs.

    Parameters
    ----------
    targets, reports
        Program and report page of each input; None for none.
    given
        Arguments of `api.optimize`.
    executor
        Runs the tasks; without it, they run one after another in this thread.
    folder
        Folder for the table and the report of all inputs; without it, no input is skipped.
    refused
        Called with one line for each refused input.
    beside
        Further rows for the table and the report.

    Raises
    ------
    OutputError
        The folder cannot be written.
    ExecutorError
        The cluster is lost; finished inputs are kept.
    """
    known = read_table(Path(folder) / TABLE) if folder else {}
    asked = _options_key(given)
    results: dict[str, BatchResult] = {}
    earlier_rows = [row for row in beside if row.input not in inputs]
    tasks: list[tuple[str, str, str, str]] = []
    pages = reports or [None] * len(inputs)
    for source, target, page in zip(inputs, targets, pages, strict=True):
        try:
            key = _task_key(source, asked)
        except LeafcutError as problem:
            results[source] = BatchResult(BatchRow(source, Path(target or "").name, REFUSED, line=str(problem)))
            refused(prefix_input_name(source, str(problem)))
            continue
        old = known.get(source)
        if old is not None and target and old.key == key and file_sha256(Path(target)) == old.program_sha256:
            results[source] = BatchResult(old)
        else:
            tasks.append((source, target or "", page or "", key))
    if folder:
        _write_table(Path(folder) / TABLE, (*earlier_rows, *(result.row for result in results.values())))
    todo = len(tasks)
    if progress is not None and executor is not None and todo:
        progress(Progress(Message("{} of {}", todo, count_of(len(inputs), "input"))))
    for number, (task, answer) in enumerate(_run_tasks(tasks, given, executor, progress), 1):
        result = _write_result(task, answer)
        results[task.name] = result
        if result.row.state == REFUSED:
            refused(prefix_input_name(task.name, result.row.line))
        if folder:
            _append_row(Path(folder) / TABLE, result.row)
        if progress is not None and executor is not None:
            progress(Progress(Message("{} ({} of {})", Path(task.name).name, number, todo), number / todo))
    ordered = [results[source] for source in inputs]
    if folder:
        rows = [*earlier_rows, *(result.row for result in ordered)]
        page_of_all = batch_page_html([asdict(row) for row in rows], __version__)
        write_all_or_none({str(Path(folder) / TABLE): _as_csv(rows), str(Path(folder) / PAGE): page_of_all})
    return ordered


def _run_tasks(
    tasks: Iterable[tuple[str, str, str, str]],
    given: Mapping[str, Any],
    executor: WatchedExecutor | None,
    progress: OnProgress | None,
) -> Iterator[tuple[BatchTask, Any]]:
    """Yield each task with its result or error. An input is read when its task starts, so that few inputs are in
    memory.
    """
    ready = (
        BatchTask(name, target, page, key, read_source_with_format(name)[1], given) for name, target, page, key in tasks
    )
    if executor is not None:
        yield from run_tasks(executor, run_task, ready)
        return
    for task in ready:
        yield task, run_task(task, progress)


def run_task(task: BatchTask, progress: OnProgress | None = None) -> BatchResult:
    """Return the result of a task. A refusal is stored as text, because some exceptions cannot be sent between
    processes.
    """
    from leafcut.report.page import report_page_html

    row = BatchRow(task.name, Path(task.target).name, REFUSED, key=task.key)
    try:
        outcome = api.optimize(task.source, progress=progress, **task.given)
        page = report_page_html(report_of(outcome)) if task.report else ""
    except Exception as problem:
        line, _ = error_line_and_status(problem)
        return BatchResult(replace(row, line=line))
    outcome = replace(outcome, output=task.target, report=task.report)
    data = outcome.text.encode(outcome.encoding)
    issues = [issue.severity for issue in outcome.issues if issue.severity != "note"]
    result_row = replace(
        row,
        state=WRITTEN if task.target else SIMULATED,
        before_s=_three_decimals(outcome.before.time_s),
        after_s=_three_decimals(outcome.after.time_s),
        saved_percent=_three_decimals(outcome.saved_percent),
        issues=len(issues),
        worst=next((severity for severity in ("danger", "missing", "warning") if severity in issues), ""),
        program_sha256=hashlib.sha256(data).hexdigest(),
    )
    return BatchResult(result_row, data, page, program_as_json(report_of(outcome)), outcome.issues)


def _three_decimals(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _write_result(task: BatchTask, answer: Any) -> BatchResult:
    if isinstance(answer, BaseException):
        line = f"{type(answer).__name__}: {answer}"
        answer = BatchResult(BatchRow(task.name, Path(task.target).name, REFUSED, line=line, key=task.key))
    result: BatchResult = answer
    if result.row.state == REFUSED:
        if task.target and Path(task.target).is_file():
            result = replace(result, row=replace(result.row, line=f"{result.row.line}; {task.target} was not changed"))
        return result
    # latin-1 has a character for each byte: the program is written byte for byte.
    texts = {task.target: result.data.decode("latin-1")} if task.target else {}
    encodings = {task.target: "latin-1"}
    if task.report:
        texts[task.report] = result.page
    if texts:
        write_all_or_none(texts, encodings=encodings, newline="")
    return result


def _task_key(source: str, asked: str) -> str:
    data = read_source_with_format(source)[1].data or source.encode()
    return hashlib.sha256(b"\0".join([hashlib.sha256(data).digest(), asked.encode()])).hexdigest()


def _options_key(given: Mapping[str, Any]) -> str:
    """Return options and version as a text; an option that names a file is represented by the hash of the file."""
    words = {}
    for name, value in sorted(given.items()):
        path = Path(str(value)) if isinstance(value, str | Path) else None
        words[name] = file_sha256(path) if path is not None and path.is_file() else repr(value)
    return repr((__version__, words))


def file_sha256(path: Path) -> str:
    """Return the hash of a file's content; "" if it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


# -- table -----------------------------------------------------------------------------------------------------------


_NAMES = [field.name for field in fields(BatchRow)]


def _as_csv(rows: Iterable[BatchRow]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_NAMES)
    writer.writerows([getattr(row, name) for name in _NAMES] for row in rows)
    return text.getvalue()


def _write_table(table: Path, rows: Iterable[BatchRow]) -> None:
    write_all_or_none({str(table): _as_csv(rows)})


def _append_row(table: Path, row: BatchRow) -> None:
    """Append a row to the table at once, so that it survives if this program is killed."""
    line = _as_csv([row]).split("\n", 1)[1]
    try:
        with table.open("a", encoding="utf-8", newline="") as file:
            file.write(line)
    except OSError as problem:
        raise OutputError(f"{table}: cannot be written ({problem.strerror}); finished programs are kept") from None


def read_table(table: Path) -> dict[str, BatchRow]:
    """Return the complete rows of an earlier batch by input. Raises OutputError if the file is not the table of a
    batch.
    """
    if not table.is_file():
        return {}
    try:
        rows = list(csv.reader(table.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise OutputError(f"{table}: cannot be read ({problem}); choose another folder") from None
    if not rows or rows[0] != _NAMES:
        raise OutputError(f"{table}: not a table of a batch; choose another folder")
    by_input = {}
    for row in rows[1:]:
        if len(row) != len(_NAMES) or not row[_NAMES.index("issues")].isdecimal():
            continue
        values: dict[str, Any] = dict(zip(_NAMES, row, strict=True))
        entry = BatchRow(**{**values, "issues": int(values["issues"])})
        if entry.state == WRITTEN and len(entry.program_sha256) == 64:
            by_input[entry.input] = entry
    return by_input
