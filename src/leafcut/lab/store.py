"""The results file of experiments: an SQLite database with one row per run. Interruptions do not damage the file."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from leafcut.errors import LeafcutError, ReadError, printable
from leafcut.files.schemas import RESULTS, check_schema
from leafcut.files.whole_files import OutputError
from leafcut.message import Message

#: Application id that marks an SQLite file as a results file ("leaf").
_OWNER = 0x6C656166
#: Maximum time to wait while another program writes the file, s.
_PATIENCE = 10.0

_TABLE = """
create table run (
    key text primary key,       -- of all that the run is made of
    experiment text not null,
    instance text not null,
    levels text not null,       -- factor -> level
    seed integer not null,
    options text not null,
    input_sha256 text not null,
    failed text not null,       -- the line that refuses it, else empty
    responses text not null,     -- response -> figure
    curve text not null,        -- [iteration, seconds, cost] ...
    began text not null,        -- UTC
    leafcut text not null,
    versions text not null,     -- package -> version
    machine text not null,      -- processor, cores, system
    load real                   -- processes that waited when it began, for each core
) strict, without rowid
"""
#: Columns that contain JSON.
_JSON = ("levels", "options", "responses", "curve", "versions")


@dataclass(frozen=True)
class Row:
    """A finished run. The fields are the columns of the table in the same order.

    Attributes
    ----------
    failed
        Error message, or an empty text if the run has succeeded.
    responses
        Maps each name to its value, or to None if the answer does not contain the value.
    curve
        Iteration, seconds and cost at each improvement of the best tour. It is empty if the command reports no
        improvements.
    load
        Number of processes per core that were waiting when the run started.
    """

    key: str
    experiment: str
    instance: str
    levels: Mapping[str, str]
    seed: int
    options: Mapping[str, Any]
    input_sha256: str
    failed: str
    responses: Mapping[str, float | None]
    curve: tuple[tuple[int, float, float], ...]
    began: str
    leafcut: str
    versions: Mapping[str, str]
    machine: str
    load: float | None


def run_key(experiment: str, command: str, content: Mapping[str, Any]) -> str:
    """Return the key of a run. It is a hash of everything that affects the answer except the version of leafcut."""
    text = json.dumps([experiment, command, content], sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()


class Store:
    """The results file, as a context manager.

    A row is on disk when `add` returns. After a crash, SQLite rolls back incomplete writes.

    Raises
    ------
    ReadError, DataError
        The file is not a results file, is damaged, or has a schema that this version cannot read. The file remains
        unchanged.
    OutputError
        The file cannot be written, or another program is writing it. Stored rows are kept.
    """

    def __init__(self, path: str | Path, *, read_only: bool = False) -> None:
        self.path = Path(path)
        self._read_only = read_only

    def __enter__(self) -> Self:
        if self._read_only and not self.path.is_file():
            raise ReadError(
                self.path, "there are no results here yet; run `leafcut lab run NAME` first, or give --results"
            )
        if self.path.is_dir():
            raise OutputError("{}: a folder; --results names a file", self.path)
        with self._convert_errors():
            if self.path.is_file() and self.path.stat().st_size and not _is_sqlite(self.path):
                raise ReadError(self.path, "this is not a results file of leafcut (SQLite); give another --results")
            uri = self.path.absolute().as_uri() + ("?mode=ro" if self._read_only else "")
            self._data = sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)
        try:
            self._check_schema()
        except BaseException:
            self._data.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._data.close()

    def _check_schema(self) -> None:
        with self._convert_errors():
            if not self._read_only:
                self._data.execute("begin immediate")
            owner, schema = (
                self._data.execute(f"pragma {word}").fetchone()[0] for word in ("application_id", "user_version")
            )
            empty = not self._data.execute("select count(*) from sqlite_master").fetchone()[0]
            if owner == schema == 0 and empty and not self._read_only:
                self._data.execute(_TABLE)
                self._data.execute(f"pragma application_id = {_OWNER}")
                self._data.execute(f"pragma user_version = {RESULTS.current}")
            elif owner != _OWNER:
                raise ReadError(
                    self.path, "this SQLite file belongs to another program; choose another file for --results"
                )
            else:
                check_schema(RESULTS, schema, str(self.path))
                if (check_result := self._data.execute("pragma quick_check(1)").fetchone()[0]) != "ok":
                    raise ReadError(
                        self.path, Message("damaged results ({}); give another --results", printable(check_result, 120))
                    )
            if not self._read_only:
                self._data.execute("commit")

    def add(self, row: Row) -> None:
        """Store a run. It replaces a failed run that has the same key."""
        values = [
            json.dumps(value if name == "curve" else dict(value), default=str) if name in _JSON else value
            for name, value in vars(row).items()
        ]
        with self._convert_errors():
            self._data.execute(f"insert or replace into run values ({', '.join('?' * len(values))})", values)

    def rows(self, experiment: str) -> list[Row]:
        """Return the runs of an experiment, sorted by instance, levels and seed."""
        with self._convert_errors():
            records = self._data.execute(
                "select * from run where experiment = ? order by instance, levels, seed", (experiment,)
            ).fetchall()
            return [_row_from_record(record) for record in records]

    def successful_run_counts(self) -> dict[str, int]:
        """Count the successful runs of each experiment."""
        with self._convert_errors():
            return dict(
                self._data.execute("select experiment, count(*) from run where failed = '' group by experiment")
            )

    @contextmanager
    def _convert_errors(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError, ValueError) as problem:
            if isinstance(problem, LeafcutError):
                with suppress(AttributeError, sqlite3.Error):
                    self._data.rollback()
                raise
            raise self._one_line_error(problem) from None

    def _one_line_error(self, problem: Exception) -> LeafcutError:
        words = printable(str(problem), 120)
        if isinstance(problem, OSError):
            return OutputError("{}: cannot be opened ({})", self.path, problem.strerror)
        if not isinstance(problem, sqlite3.OperationalError):
            return ReadError(self.path, Message("damaged results ({}); give another --results", words))
        if "full" in words:
            return OutputError("{}: the disk is full; what was finished before is kept", self.path)
        if "locked" in words:
            return OutputError(
                "{}: another program writes these results; wait for it, or give another --results", self.path
            )
        return OutputError("{}: cannot be used ({}); give another --results", self.path, words)


def _is_sqlite(path: Path) -> bool:
    with path.open("rb") as stream:
        return stream.read(15) == b"SQLite format 3"


def _row_from_record(values: tuple[Any, ...]) -> Row:
    named = zip((field.name for field in fields(Row)), values, strict=True)
    row = {name: json.loads(value) if name in _JSON else value for name, value in named}
    row["curve"] = tuple((int(k), float(s), float(cost)) for k, s, cost in row["curve"])
    return Row(**row)
