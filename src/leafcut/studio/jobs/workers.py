"""Processes that execute one task at a time for the studio. They can be killed at any time.

A process reads its tasks from standard input and answers on standard output, and both are pickled (see `work_process`).
When one side ends, its pipe closes, and the other side notices this.
"""

from __future__ import annotations

import itertools
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from leafcut.errors import LeafcutError
from leafcut.message import Message
from leafcut.model.heartbeat import Progress

#: Maximum number of idle processes. Each process uses about 250 MB for modules and compiled code.
_MAX_IDLE = 2
#: A process is reused if its last task took no longer than this time, s. Otherwise it is ended to free its memory.
_LONG_SECONDS = 10.0
#: Numbers for the tasks. Each message contains the number of its task.
_NUMBERS = itertools.count()
_COMMAND = (sys.executable, "-P", "-c", "from leafcut.studio.jobs.work_process import main; main()")


@dataclass(frozen=True)
class Done:
    """The last message of a process about a task, which contains the result."""

    result: Any


@dataclass(frozen=True)
class Failed:
    """The last message of a process about a failed task: the error in one line, and whether it is an internal error."""

    line: str
    internal: bool


class WorkError(LeafcutError):
    """A task has failed or was cancelled, or its process has died."""

    def __init__(self, line: str, internal: bool = False) -> None:
        super().__init__(line)
        self.internal = internal


class _Process:
    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = tempfile.mkdtemp(dir=folder)
        self._lock = threading.Lock()
        # The process gets its own group (not on Windows). Its child processes are killed with the group, and Ctrl-C in
        # the terminal does not reach the group.
        try:
            self._process = subprocess.Popen(
                _COMMAND,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self._folder)},
                start_new_session=True,
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            )
        except OSError:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    def send(self, *message: Any) -> None:
        """Send a message. If the process has ended, do nothing, because `receive` will report this."""
        data = pickle.dumps(message)
        assert self._process.stdin is not None
        with self._lock, suppress(OSError, ValueError):
            self._process.stdin.write(data)
            self._process.stdin.flush()

    def receive(self) -> Any:
        """Return the next message. Raises `EOFError` if the process has ended."""
        assert self._process.stdout is not None
        try:
            return pickle.load(self._process.stdout)
        except (OSError, ValueError, pickle.UnpicklingError):
            raise EOFError from None

    def signal_kill(self) -> None:
        """Kill the process and all processes that it has started, without waiting until they end."""
        if self._process.returncode is None:
            with suppress(OSError):
                os.killpg(self._process.pid, signal.SIGKILL) if os.name == "posix" else self._process.kill()

    def kill(self) -> int:
        """Kill the process and all processes that it has started, and delete its files. Return the exit status."""
        self.signal_kill()  # ends a blocked `send`
        with self._lock:
            self._process.wait()
            shutil.rmtree(self._folder, ignore_errors=True)
        return self._process.returncode

    def close(self) -> None:
        """Kill the process and close its pipes. No thread may use the pipes after this call."""
        self.kill()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(OSError):
                pipe.close()


class StudioWorkers:
    """The processes of the studio.

    With `spare`, one idle process is always ready, because it takes seconds to start one.
    """

    def __init__(self, folder: Path, spare: bool = True) -> None:
        self._folder, self._spare = folder, spare
        self._all: set[_Process] = set()
        self._idle: list[_Process] = []
        self._lock = threading.Lock()
        self._closed = False
        shutil.rmtree(folder, ignore_errors=True)

    def start_spare_process(self) -> None:
        """Start a process for the next task, unless one is already idle."""
        with self._lock:
            if self._spare and not any(process.is_alive for process in self._idle) and not self._closed:
                process = self._start_process()
                process.send("get_ready")
                self._idle.append(process)

    def take_process(self) -> _Process:
        """Return an idle process, or start a new one. Raises `WorkError` if the studio is closing."""
        with self._lock:
            if self._closed:
                raise WorkError("the studio is closing; no new jobs are started")
            while self._idle:
                process = self._idle.pop()
                if process.is_alive:
                    return process
                self._all.discard(process)
                process.close()
            return self._start_process()

    def put_back(self, process: _Process, reusable: bool) -> None:
        """Keep a `reusable` process for the next task. Otherwise, end the process."""
        with self._lock:
            if reusable and process.is_alive and not self._closed and len(self._idle) < _MAX_IDLE:
                self._idle.append(process)
                return
            self._all.discard(process)
        process.close()

    def close(self) -> None:
        """Kill all processes. Tasks that are waiting for them fail."""
        with self._lock:
            self._closed = True
            processes, idle = list(self._all), list(self._idle)
            self._idle.clear()
        for process in processes:
            process.close() if process in idle else process.kill()

    def _start_process(self) -> _Process:
        process = _Process(self._folder)
        self._all.add(process)
        return process


class StudioWork:
    """A task in another process. Any thread may cancel the task."""

    def __init__(self, workers: StudioWorkers) -> None:
        self._workers = workers
        self._number = next(_NUMBERS)
        self._lock = threading.Lock()
        #: Protects `_taken` and `_cancelled`. No thread waits while it holds this lock, so `cancel` returns
        #: immediately.
        self._ending = threading.Lock()
        #: The process of the task, from its start to its end.
        self._taken: _Process | None = None
        #: The same process, but only after it has received the task.
        self._process: _Process | None = None
        #: Messages for a task that has not started yet, with their arguments.
        self._pending: dict[str, tuple[Any, ...]] = {}
        self._cancelled = False

    def run(self, function: Callable[..., Any], *arguments: Any, on_message: Callable[[Any], Any] | None = None) -> Any:
        """Execute ``function(link, *arguments)`` in another process, and return the result. `link` is a `link.Link`.

        The function, its arguments and its result are pickled. `on_message` receives the messages that the function
        sends over the link. Raises `WorkError` if the task has failed or was cancelled, if its process has died, or if
        the studio is closing.
        """
        process = self._workers.take_process()
        with self._ending:
            self._taken, cancelled = process, self._cancelled
        if cancelled:
            self._workers.put_back(process, reusable=True)
            raise WorkError("cancelled")
        with self._lock:
            process.send("run", self._number, function, arguments, list(self._pending.items()))
            self._process = process
        began, step, answer = time.monotonic(), "", None
        try:
            with suppress(OSError):  # without a spare process, the next task only starts later
                self._workers.start_spare_process()
            while not isinstance(answer, Done | Failed):
                number, message = process.receive()
                if number != self._number:  # a late message of the previous task
                    continue
                answer = message
                if isinstance(answer, Progress):
                    step = answer.step
                if on_message is not None and not isinstance(answer, Done | Failed):
                    on_message(answer)
        except EOFError:
            status = process.kill()
            how = Message("signal {}", -status) if status < 0 else Message("status {}", status)
            during = Message(" during '{}'", step) if step else ""
            line = Message(
                "the process of this job ended unexpectedly{} ({}); it may have run out of memory", during, how
            )
            raise WorkError(line, internal=True) from None
        finally:
            with self._ending:
                self._taken = None
            with self._lock:
                self._process = None
            ended = isinstance(answer, Done | Failed)
            self._workers.put_back(process, ended and time.monotonic() - began < _LONG_SECONDS)
        if isinstance(answer, Failed):
            raise WorkError(answer.line, answer.internal)
        return answer.result

    def call_link_method(self, name: str, *arguments: Any) -> None:
        """Call a method of the link in the process.

        If the task has not started yet, the call takes place when it starts.
        """
        with self._lock:
            if self._process is not None:
                self._process.send(name, *arguments)
            else:
                self._pending[name] = arguments

    def cancel(self) -> None:
        """Kill the process, or prevent it from starting."""
        with self._ending:
            self._cancelled = True
            if self._taken is not None:
                self._taken.signal_kill()
