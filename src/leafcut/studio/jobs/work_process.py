"""The process that executes tasks for the studio (see `workers`). It ends when the studio ends."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from leafcut.studio.jobs import run_job
from leafcut.studio.jobs.jobs import error_line, is_internal
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.preview import READY, read_preview
from leafcut.studio.jobs.task import ReadyTask
from leafcut.studio.jobs.workers import Done, Failed

#: A job that loads the modules and the compiled code that most jobs need.
READY_TASK = ReadyTask("optimize", ("example:plate-10",), "auto", {"thickness": "6mm", "iterations": 1, "threads": 1})


def main() -> None:
    """Read tasks from standard input and execute them until the input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output that a library prints must not mix with the answers
    lock = threading.Lock()

    def send(message: Any) -> None:
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        with lock, suppress(OSError):  # if the studio has ended, this process ends too
            answers.write(data)
            answers.flush()

    link, busy = Link(lambda _: None), threading.Event()
    try:
        while True:
            name, *arguments = pickle.load(sys.stdin.buffer)
            if name == "get_ready":
                threading.Thread(target=_preload, args=(busy,), daemon=True).start()
            elif name == "run":
                work, function, values, messages = arguments
                busy.set()
                send_for = partial(_send_task_message, send, work)
                link = Link(send_for)
                for message, words in messages:
                    link.obey(message, *words)
                threading.Thread(target=_execute_task, args=(link, send_for, function, values), daemon=True).start()
            else:
                link.obey(name, *arguments)
    except EOFError:
        pass
    finally:
        if os.name == "posix" and os.getpgrp() == os.getpid():
            os.killpg(0, signal.SIGKILL)  # including the processes that a task has started
        os._exit(0)


def _send_task_message(send: Callable[[Any], None], work: int, message: Any) -> None:
    """Send a message with the number of its task.

    With this number, the studio can drop late messages from earlier tasks.
    """
    send((work, message))


def _execute_task(
    link: Link, send: Callable[[Any], None], function: Callable[..., Any], arguments: tuple[Any, ...]
) -> None:
    try:
        send(Done(function(link, *arguments)))
    except BaseException as problem:
        send(Failed(error_line(problem), is_internal(problem)))


def _preload(busy: threading.Event) -> None:
    """Load the modules and the compiled code for the most common tasks. Stop as soon as a task arrives."""
    with suppress(Exception):  # errors are shown when the user opens a file
        for source in READY:
            if not busy.is_set():
                read_preview(source)
        if not busy.is_set():
            run_job.run_task(Link(lambda _: None), READY_TASK, ("plate-10",))
