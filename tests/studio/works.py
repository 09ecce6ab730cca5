"""Works that another process of the studio does in tests."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from leafcut.model.heartbeat import Progress
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.run_job import JobResult


def read_for_ever(link: Link, *_: Any) -> None:
    """Read in plain Python and ignore all errors, as a reader of another package may."""
    link.report(Progress(f"process {os.getpid()}", 0.25))
    while True:
        try:
            json.loads("[" * 50 + "]" * 50)
        except BaseException:
            continue


def start_another(link: Link, *_: Any) -> None:
    """Start a process that would never end, and write a temporary file."""
    other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(3600)"])
    Path(tempfile.mkdtemp(), "file").write_text("temporary")
    link.report(Progress(f"process {other.pid}"))
    time.sleep(3600)


def hold_the_interpreter(link: Link, *_: Any) -> None:
    """Work in one call that no other thread interrupts, as compiled code of another package may."""
    link.report(Progress(f"process {os.getpid()}"))
    sum(range(10**12))


def wait_for_stop(link: Link, *_: Any) -> JobResult:
    """Return a result when asked to stop."""
    link.report(Progress(f"process {os.getpid()}"))
    link.stop.wait()
    return JobResult({}, {}, {})


def die(link: Link, *_: Any) -> None:
    """End as a process does that the system kills."""
    link.report(Progress("searching"))
    os.kill(os.getpid(), signal.SIGKILL if os.name == "posix" else signal.SIGTERM)


#: Set when the next work has started, and when the late message of the work before has been sent.
_next, _sent = threading.Event(), threading.Event()


def leave_a_message(link: Link) -> None:
    """Send a message during the next work of the process, as the answer to a page may come."""

    def send() -> None:
        _next.wait(120)
        link.observer.look()
        _sent.set()

    threading.Thread(target=send, daemon=True).start()


def wait_for_the_message(link: Link) -> None:
    """Report once the message of the work before has been sent."""
    _next.set()
    assert _sent.wait(120)
    link.report(Progress("late"))


def number_of_process(_: Link) -> int:
    """Return the number of the process."""
    return os.getpid()


def temporary_folder(_: Link) -> str:
    """Return the folder for temporary files."""
    return tempfile.gettempdir()


def unpicklable(_: Link) -> Any:
    """Return a result that cannot be sent."""
    return lambda: None


def raise_division(*_: Any) -> None:
    """Fail by an internal error."""
    raise ZeroDivisionError("by zero")


def raise_ValueError(*_: Any) -> None:
    """Fail with a message of two lines."""
    raise ValueError("odd\nthing")


def raise_MemoryError(*_: Any) -> None:
    """Fail without memory."""
    raise MemoryError


def raise_SystemExit(*_: Any) -> None:
    """End the interpreter."""
    raise SystemExit(3)


def raise_KeyboardInterrupt(*_: Any) -> None:
    """Fail as by Ctrl-C."""
    raise KeyboardInterrupt
