"""Watch a folder: each drawing or program that is added or changed becomes a program in another folder.

The folder is polled, because change notifications of the operating system do not work on every disk and share.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from leafcut import api
from leafcut.cli.batch import REFUSED, WRITTEN, BatchRow, file_sha256, read_table, run_batch
from leafcut.cli.several import PAGE, TABLE, is_input, refuse_foreign_file
from leafcut.cli.shared import prefix_input_name
from leafcut.errors import LeafcutError, OptionError
from leafcut.files.whole_files import OutputError, check_output
from leafcut.order.executors import ExecutorError, WatchedExecutor

#: Number of polls without a change after which a file counts as complete: with the end of its format, and without that
#: end (a slow copy).
_POLLS, _POLLS_WITHOUT_END = 2, 10
#: Common end of all files of a format.
_ENDS = {"dxf": b"EOF", "svg": b"</svg>"}
#: Bytes read at the end of a file.
_TAIL = 64
#: Extensions of temporary files, which are ignored.
_PASSING = (".tmp", ".part", ".partial", ".crdownload", ".bak", ".swp", ".lock")

#: Identifies the state of a file: size, modification time, and inode.
_Signature = tuple[int, int, int]


@dataclass
class _FileState:
    """State of a file at the last poll, number of polls in this state, and the last state that was processed."""

    signature: _Signature
    polls: int = 1
    done: _Signature | None = None


@dataclass
class FolderPoll:
    """Finds new or changed files in a folder once they are completely written."""

    folder: Path
    seen: dict[Path, _FileState] = field(default_factory=dict)

    def complete_files(self) -> list[Path]:
        """Poll once, and return the complete files in a new state. Raises OSError if the folder cannot be read."""
        signatures = dict(self._files_with_signatures())
        self.seen = {path: known for path, known in self.seen.items() if path in signatures}
        ready = []
        for path, signature in sorted(signatures.items()):
            seen_file = self.seen.get(path)
            if seen_file is None:
                self.seen[path] = _FileState(signature)
            elif seen_file.signature != signature:
                seen_file.signature, seen_file.polls = signature, 1
            elif seen_file.done != signature:
                seen_file.polls += 1
                if seen_file.polls >= (_POLLS if _is_complete(path) else _POLLS_WITHOUT_END):
                    seen_file.done = signature
                    if is_input(path):
                        ready.append(path)
        return ready

    def return_again(self, path: Path) -> None:
        """Make the next poll return a file again."""
        if path in self.seen:
            self.seen[path].done = None

    def _files_with_signatures(self) -> Iterator[tuple[Path, _Signature]]:
        for path in self.folder.iterdir():
            name = path.name
            if name.startswith((".", "~")) or name.endswith("~") or path.suffix.lower() in _PASSING:
                continue
            try:
                # A link may lead out of the folder; read only files in it.
                if path.is_symlink() or not path.is_file():
                    continue
                state = path.stat()
            except OSError:  # the file was removed
                continue
            if state.st_size and name not in (TABLE, PAGE):
                yield path, (state.st_size, state.st_mtime_ns, state.st_ino)


def _is_complete(path: Path) -> bool:
    """Return whether a file ends as its format requires; True for formats without a common end."""
    end = _ENDS.get(path.suffix.lower().removeprefix("."))
    if end is None:
        return True
    try:
        with path.open("rb") as stream:
            stream.seek(max(0, path.stat().st_size - _TAIL))
            return stream.read(_TAIL).rstrip(b"\0 \t\r\n").endswith(end)
    except OSError:
        return False


@dataclass
class FolderWatch:
    """Generates programs for the files of a folder until it is stopped.

    `folder` and `output` must differ. `given` are the arguments of `api.optimize` for each file. `written` is called
    with the row of each written program. `refused` is called with a line for each refused input and for each other
    failure.
    """

    folder: Path
    output: Path
    given: Mapping[str, Any]
    executor: WatchedExecutor
    written: Callable[[BatchRow], None]
    refused: Callable[[str], None]
    rows: dict[str, BatchRow] = field(default_factory=dict)
    earlier: dict[str, BatchRow] = field(default_factory=dict)
    hindered: str = ""

    def check_settings(self) -> None:
        """Raise OptionError or OutputError for invalid folders and options before any file is processed."""
        for role, folder in (("the folder to watch", self.folder), ("-o", self.output)):
            if not folder.is_dir():
                raise OutputError(f"{folder}: not a folder; {role} must exist; create it first")
        if self.folder.samefile(self.output):
            raise OptionError(f"-o {self.output}: programs would be watched as well; name another folder")
        check_output(self.output / TABLE, ())
        api.output_name("drawing.dxf", **self.given)
        self.earlier = read_table(self.output / TABLE)

    def run_until_interrupted(self, seconds: float, sleep: Callable[[float], None] = time.sleep) -> None:
        """Poll the folder every `seconds` until Ctrl-C. Raises ExecutorError if a cluster is lost."""
        poll = FolderPoll(self.folder)
        while True:
            self.process_ready_files(poll)
            sleep(seconds)

    def process_ready_files(self, poll: FolderPoll) -> None:
        """Poll once, and process the files that are ready."""
        if not self.output.is_dir():
            self._report_failure(f"{self.output}: the folder for programs is missing; trying again")
            return
        before = set(poll.seen)
        try:
            ready = poll.complete_files()
        except OSError as problem:
            self._report_failure(f"{self.folder}: cannot be read ({problem.strerror}); trying again")
            return
        if before - set(poll.seen):
            # Another file may have been refused because a removed file had its program name.
            for name in [name for name, row in self.rows.items() if not row.program]:
                poll.return_again(Path(name))
        inputs = [str(path) for path in ready if self._accept_file(path, poll)]
        if not inputs:
            return
        present = [row for name, row in self.rows.items() if Path(name) in poll.seen]
        try:
            targets = [str(self.output / self.rows[name].program) for name in inputs]
            results = run_batch(
                inputs,
                targets,
                self.given,
                self.executor,
                folder=str(self.output),
                refused=self.refused,
                beside=present,
            )
        except ExecutorError:
            raise
        except LeafcutError as problem:
            self._report_failure(f"{problem}; it is tried again")
            for name in inputs:
                poll.return_again(Path(name))
            return
        self.hindered = ""
        for result in results:
            self._record_result(result.row)

    def _report_failure(self, line: str) -> None:
        if line != self.hindered:
            self.hindered = line
            self.refused(line)

    def _accept_file(self, path: Path, poll: FolderPoll) -> bool:
        try:
            name = api.output_name(str(path), **self.given)
            for other_input, row in self.rows.items():
                if (
                    other_input != str(path)
                    and Path(other_input) in poll.seen
                    and row.program.casefold() == name.casefold()
                ):
                    raise OptionError(f"{path} and {other_input} would both be written as {name}; rename one of them")
            check_output(self.output / name, [path, *poll.seen])
            earlier = {row.program_sha256 for row in (*self.earlier.values(), *self.rows.values())}
            refuse_foreign_file(str(self.output / name), [str(path)], earlier=earlier)
        except LeafcutError as problem:
            self.refused(prefix_input_name(str(path), str(problem)))
            self._record_result(BatchRow(str(path), "", REFUSED, line=str(problem)))
            return False
        # Reserve the name at once, because another file of this poll may want it too.
        if str(path) not in self.rows or self.rows[str(path)].program != name:
            self.rows[str(path)] = BatchRow(str(path), name, REFUSED)
        return True

    def _record_result(self, row: BatchRow) -> None:
        """Store a row. For a refused input, delete its old program, which could be mistaken for a new one."""
        before = self.earlier.get(row.input)
        self.rows[row.input] = row
        if row.state == WRITTEN:
            self.earlier[row.input] = row
            self.written(row)
        elif before is not None:
            del self.earlier[row.input]
            old = self.output / before.program
            if file_sha256(old) != before.program_sha256:
                return
            try:
                old.unlink()
            except OSError as problem:
                self.refused(
                    f"{old}: made from an earlier version of {row.input}; it cannot be removed ({problem.strerror})"
                )
            else:
                self.refused(f"{old}: removed, because it was made from an earlier version of {row.input}")
