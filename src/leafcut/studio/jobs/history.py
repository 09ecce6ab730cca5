"""The history of jobs: an SQLite file in the studio's folder.

Jobs are stored immediately, so they survive a restart.
"""

from __future__ import annotations

import json
import os
import sqlite3
import threading
import time
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from leafcut.errors import DataError
from leafcut.files.schemas import ANSWER, HISTORY, add_schema_number, check_schema
from leafcut.files.whole_files import OutputError
from leafcut.message import Message, messages_from_json, messages_to_json
from leafcut.studio.jobs.task import Task

#: Suffixes of the SQLite database and its two companion files.
BESIDE = ("", "-wal", "-shm")
_TABLES = """
CREATE TABLE IF NOT EXISTS job (
    id TEXT PRIMARY KEY, title TEXT NOT NULL, task TEXT NOT NULL, state TEXT NOT NULL, created REAL NOT NULL,
    finished REAL, line TEXT NOT NULL DEFAULT '', figures TEXT NOT NULL DEFAULT '{}', answer BLOB,
    line_parts TEXT NOT NULL DEFAULT '""'
);
CREATE INDEX IF NOT EXISTS job_created ON job (created);
CREATE TABLE IF NOT EXISTS artefact (
    job TEXT NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    name TEXT NOT NULL, file_name TEXT NOT NULL, media_type TEXT NOT NULL, data BLOB NOT NULL,
    PRIMARY KEY (job, name)
);
CREATE TABLE IF NOT EXISTS message (
    job TEXT NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    number INTEGER NOT NULL, seconds REAL NOT NULL, words TEXT NOT NULL, parts TEXT NOT NULL DEFAULT '""',
    PRIMARY KEY (job, number)
);
"""
#: Columns that schema 1 does not have. They contain the template and the values of a message as JSON, or "" for a plain
#: text.
_ADDED = {"job": "line_parts", "message": "parts"}
#: zlib level. Higher levels take ten times longer and save little space.
_LEVEL = 3


class JobState(StrEnum):
    """The state of a job."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    STOPPED = "stopped"  # stopped by the user; the best result is stored
    FAILED = "failed"
    CANCELLED = "cancelled"
    INTERRUPTED = "interrupted"  # the studio ended during the job

    @property
    def is_over(self) -> bool:
        """Whether the job has ended."""
        return self not in (JobState.WAITING, JobState.RUNNING)

    @property
    def has_result(self) -> bool:
        """Whether the job has a result."""
        return self in (JobState.DONE, JobState.STOPPED)


@dataclass(frozen=True)
class Artefact:
    """A file that a job has created."""

    file_name: str
    media_type: str
    data: bytes

    @property
    def text(self) -> str:
        """The content as text. The media type specifies the charset."""
        return self.data.decode(self.media_type.partition("charset=")[2] or "utf-8", "replace")


@dataclass(frozen=True)
class JobRecord:
    """A job in the history. `figures` contains the numbers that lists show."""

    id: str
    title: str
    task: Task
    state: JobState
    created: float
    finished: float | None
    line: str
    figures: dict[str, Any]


@dataclass(frozen=True)
class SearchTerm:
    """A search term.

    A job matches if the word occurs in its title, command, option values, message or date. It also matches if it has
    one of the given `options` or `states`.
    """

    word: str
    options: tuple[str, ...] = ()
    states: tuple[JobState, ...] = ()


class History:
    """The stored jobs, newest first. All methods are thread-safe.

    A damaged file is renamed, and a new file is created.

    Raises
    ------
    OutputError
        The file cannot be opened or written.
    DataError
        A newer version of leafcut wrote the file. The file remains unchanged.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        self._path = path
        try:
            self._connection = self._open()
        except sqlite3.DatabaseError as problem:
            if isinstance(problem, sqlite3.OperationalError):
                raise OutputError("{}: cannot open the history ({})", path, problem) from None
            self._rename_damaged_file()
            self._connection = self._open()

    def _open(self) -> sqlite3.Connection:
        self._create_private_file()
        connection = sqlite3.connect(self._path, check_same_thread=False, isolation_level=None, timeout=10.0)
        try:
            (schema,) = connection.execute("PRAGMA user_version").fetchone()
            # leafcut 0.2 wrote schema 1 without a number.
            check_schema(HISTORY, max(schema, HISTORY.current), str(self._path))  # an older history is converted below
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA foreign_keys = ON")
            check_result = connection.execute("PRAGMA quick_check(1)").fetchone()
            if check_result != ("ok",):
                raise sqlite3.DatabaseError(str(check_result))
            connection.executescript(f"{_TABLES} PRAGMA user_version = {HISTORY.current};")
            for table, column in _ADDED.items():
                if column not in {row[1] for row in connection.execute(f"PRAGMA table_info({table})")}:
                    connection.execute(f"ALTER TABLE {table} ADD COLUMN {column} TEXT NOT NULL DEFAULT '\"\"'")
        except (sqlite3.Error, DataError):
            connection.close()
            raise
        return connection

    def _create_private_file(self) -> None:
        """Create the file with owner-only permissions before SQLite opens it.

        SQLite copies the permissions to its companion files.
        """
        try:
            os.close(os.open(self._path, os.O_RDWR | os.O_CREAT, 0o600))
            for suffix in BESIDE:
                file = self._path.with_name(self._path.name + suffix)
                if file.exists():
                    file.chmod(0o600)
        except OSError as problem:
            raise OutputError("{}: cannot open the history ({})", self._path, problem.strerror) from None

    def _rename_damaged_file(self) -> None:
        """Rename a damaged file and its companion files.

        Otherwise, SQLite would apply the companion files to the new file.
        """
        mark = f"damaged-{time.time():.0f}"
        for suffix in BESIDE:
            file = self._path.with_name(self._path.name + suffix)
            if file.exists():
                file.replace(file.with_name(f"{self._path.name}.{mark}{suffix}"))

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._lock:
            try:
                self._connection.execute("BEGIN IMMEDIATE")
                yield self._connection
                self._connection.execute("COMMIT")
            except BaseException as problem:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                if isinstance(problem, sqlite3.Error):
                    raise OutputError("cannot write the history ({})", problem) from None
                raise

    def _read(self, query: str, values: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        with self._lock:
            return self._connection.execute(query, values).fetchall()

    def add(self, job: str, title: str, task: Task, created: float) -> None:
        """Add a job in the state ``waiting``."""
        with self._transaction() as connection:
            connection.execute(
                "INSERT INTO job (id, title, task, state, created) VALUES (?, ?, ?, ?, ?)",
                (job, title, task.as_json(), JobState.WAITING.value, created),
            )

    def set_state(self, job: str, state: JobState) -> None:
        """Store the state of a job."""
        with self._transaction() as connection:
            connection.execute("UPDATE job SET state = ? WHERE id = ?", (state.value, job))

    def finish(
        self,
        job: str,
        state: JobState,
        *,
        line: str = "",
        answer: dict[str, Any] | None = None,
        figures: dict[str, Any] | None = None,
        artefacts: dict[str, Artefact] | None = None,
        messages: Sequence[tuple[float, str]] = (),
    ) -> None:
        """Store the end of a job, with its state, answer, figures and files. `messages` contains (seconds, text)."""
        document = None if answer is None else json.dumps(messages_to_json(add_schema_number(ANSWER, answer)))
        packed = None if document is None else zlib.compress(document.encode(), _LEVEL)
        files = [
            (job, name, artefact.file_name, artefact.media_type, zlib.compress(artefact.data, _LEVEL))
            for name, artefact in (artefacts or {}).items()
        ]
        with self._transaction() as connection:
            connection.execute(
                "UPDATE job SET state = ?, finished = ?, line = ?, line_parts = ?, figures = ?, answer = ?"
                " WHERE id = ?",
                (state.value, time.time(), line, _message_as_json(line), json.dumps(figures or {}), packed, job),
            )
            connection.executemany("INSERT OR REPLACE INTO artefact VALUES (?, ?, ?, ?, ?)", files)
            rows = [(job, number, s, words, _message_as_json(words)) for number, (s, words) in enumerate(messages)]
            connection.executemany("INSERT OR REPLACE INTO message VALUES (?, ?, ?, ?, ?)", rows)

    def mark_unfinished_interrupted(self) -> None:
        """Mark all unfinished jobs as interrupted. The studio calls this method when it starts."""
        with self._transaction() as connection:
            connection.execute(
                "UPDATE job SET state = ?, finished = ? WHERE state IN (?, ?)",
                (JobState.INTERRUPTED.value, time.time(), JobState.WAITING.value, JobState.RUNNING.value),
            )

    def get(self, job: str) -> JobRecord | None:
        """Return a job, or None if it does not exist."""
        rows = self._read(f"SELECT {_COLUMNS} FROM job WHERE id = ?", (job,))
        return _record_from_row(rows[0]) if rows else None

    def newest(self, limit: int = 200) -> list[JobRecord]:
        """Return the newest jobs, up to `limit`."""
        return [
            _record_from_row(row)
            for row in self._read(f"SELECT {_COLUMNS} FROM job ORDER BY created DESC LIMIT ?", (limit,))
        ]

    def find(self, terms: Sequence[SearchTerm], limit: int, skip: int = 0) -> list[JobRecord]:
        """Return up to `limit` jobs that match all terms, newest first. The first `skip` matches are left out."""
        condition, values = _where_clause(terms)
        query = f"SELECT {_COLUMNS} FROM job {condition} ORDER BY created DESC, rowid DESC LIMIT ? OFFSET ?"
        return [_record_from_row(row) for row in self._read(query, (*values, limit, skip))]

    def count(self, terms: Sequence[SearchTerm] = ()) -> int:
        """Return the number of jobs that match all terms."""
        condition, values = _where_clause(terms)
        return int(self._read(f"SELECT COUNT(*) FROM job {condition}", values)[0][0])

    def sheet_jobs(self, job: str) -> list[JobRecord]:
        """Return the jobs that cut the sheets of a nest, newest first."""
        # The origin is compared again below, because LIKE treats an underscore as a wildcard.
        query = f"SELECT {_COLUMNS} FROM job WHERE task LIKE ? ORDER BY created DESC, rowid DESC"
        records = [_record_from_row(row) for row in self._read(query, (f'%"origin": "{job}/%',))]
        return [record for record in records if record.task.origin.startswith(f"{job}/")]

    def messages(self, job: str) -> list[tuple[float, str]]:
        """Return the stored messages of a job as (seconds, text)."""
        query = "SELECT seconds, words, parts FROM message WHERE job = ? ORDER BY number"
        return [(seconds, messages_from_json(parts) or words) for seconds, words, parts in self._read(query, (job,))]

    def answer(self, job: str) -> dict[str, Any] | None:
        """Return the stored answer of a job with its schema number, or None if the job has no answer."""
        rows = self._read("SELECT answer FROM job WHERE id = ? AND answer IS NOT NULL", (job,))
        # leafcut 0.2 stored schema 1 without a number.
        return {ANSWER.key: 1, **messages_from_json(zlib.decompress(rows[0][0]))} if rows else None

    def artefact(self, job: str, name: str) -> Artefact | None:
        """Return a file that a job has created, or None if there is no such file."""
        rows = self._read("SELECT file_name, media_type, data FROM artefact WHERE job = ? AND name = ?", (job, name))
        return Artefact(rows[0][0], rows[0][1], zlib.decompress(rows[0][2])) if rows else None

    def artefacts(self, job: str) -> dict[str, str]:
        """Return the names of the files that a job has created."""
        return dict(self._read("SELECT name, file_name FROM artefact WHERE job = ?", (job,)))

    def delete(self, job: str) -> set[str]:
        """Delete a job. Return the uploads that no other job uses."""
        record = self.get(job)
        with self._transaction() as connection:
            connection.execute("DELETE FROM job WHERE id = ?", (job,))
        return possible_upload_ids([record.task]) - self.inputs_in_use() if record else set()

    def inputs_in_use(self) -> set[str]:
        """Return the ids of all uploads that are used by jobs."""
        return possible_upload_ids(Task.from_json(row[0]) for row in self._read("SELECT task FROM job"))

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._connection.close()


_COLUMNS = "id, title, task, state, created, finished, line, line_parts, figures"


#: Columns and JSON fields that a search covers.
_PLACES = (
    "title", "line", "date(created, 'unixepoch', 'localtime')",
    *(f"json_extract(task, '$.{of}')" for of in ("command", "process")),
)  # fmt: skip
#: Condition on the options of a job. Each row has a `key` and an `atom`. List elements also have their own rows.
_OPTIONS = "EXISTS (SELECT 1 FROM json_tree(task, '$.options') WHERE {})"


def _where_clause(terms: Sequence[SearchTerm]) -> tuple[str, tuple[Any, ...]]:
    parts: list[str] = []
    values: list[Any] = []
    for term in terms:
        word = term.word.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")
        either = [f"{place} LIKE ? ESCAPE '\\'" for place in _PLACES]
        either.append(_OPTIONS.format("type NOT IN ('true', 'false') AND atom LIKE ? ESCAPE '\\'"))
        values += [f"%{word}%"] * len(either)
        if term.options:
            either.append(_OPTIONS.format(f"key IN ({', '.join('?' * len(term.options))})"))
            values += term.options
        if term.states:
            either.append(f"state IN ({', '.join('?' * len(term.states))})")
            values += [state.value for state in term.states]
        parts.append(f"({' OR '.join(either)})")
    return f"WHERE {' AND '.join(parts)}" if parts else "", tuple(values)


def _record_from_row(row: tuple[Any, ...]) -> JobRecord:
    job, title, task, state, created, finished, line, parts, figures = row
    line = messages_from_json(parts) or line
    return JobRecord(job, title, Task.from_json(task), JobState(state), created, finished, line, json.loads(figures))


def _message_as_json(text: str) -> str:
    """Return the template and the values of a message as JSON, or an empty JSON string for a plain text."""
    return json.dumps(messages_to_json(text) if isinstance(text, Message) else "")


def possible_upload_ids(tasks: Iterable[Task]) -> set[str]:
    """Return all strings in tasks that may be ids of uploads, such as inputs and files named by options."""
    words = (w for task in tasks for w in (*task.inputs, *task.options.values()) if isinstance(w, str))
    return {w.partition(":")[0] for w in words}  # a part of a nest is `id:quantity`
