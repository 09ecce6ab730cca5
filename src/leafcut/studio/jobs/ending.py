"""Asynchronous termination of another thread's work, where that work does not check for cancellation itself.

Readers of other packages cannot be cancelled while they read a damaged or endless file. They own all their data, so
that they can be aborted anywhere. Searches and compilers hold shared data and check for cancellation instead.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from types import TracebackType

#: Interval for checking a thread that is to end, s.
_RETRY_SECONDS = 0.05
#: Loaders of modules and compiled code; an aborted load would leave a broken module for all other threads.
_LOADERS = ("<frozen importlib._bootstrap>", f"{os.sep}llvmlite{os.sep}", f"{os.sep}numba{os.sep}")


class Ended(BaseException):
    """Raised in the thread at its current line; `except Exception` in a reader does not catch it."""


class Endable:
    """Work of a thread that another thread may end: ``with endable: …``, and there ``endable.end()``.

    Attributes
    ----------
    raised
        `Ended` was raised and not lost since. Python discards it in the callback of a weak reference, for example; this
        is only noticed after a call of `catch_discarded_end`.
    """

    def __init__(self) -> None:
        self.raised = False
        self._lock = threading.Lock()
        self._thread: int | None = None
        self._over = self._watched = False
        self._ended = type("Ended", (Ended,), {"work": self})

    def __enter__(self) -> None:
        self.allow_end()

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.leave()

    def allow_end(self) -> None:
        """Allow this thread's work to be ended from now on.

        Raises
        ------
        Ended
            `end` was called before.
        """
        with self._lock:
            if self._over:
                raise self._ended
            self._thread = threading.get_ident()

    def leave(self) -> None:
        """Leave the section that may be ended; after the return, `Ended` is not raised."""
        try:
            with self._lock:
                self._thread = None
        finally:  # `Ended` may be raised right here
            self._thread = None

    def end(self) -> None:
        """Raise `Ended` in the thread if it is inside, else as soon as it enters; return at once.

        A single call into compiled code finishes first. Loading a module finishes too, as a half-loaded module would
        stay for all threads. So does starting a thread: until the new thread runs, it has the id of its starter; an
        exception raised by id would hit it, and the starter would wait forever. The exception is raised once, and again
        only if it was lost.
        """
        with self._lock:
            self._over = True
            if self._watched:
                return
            self._watched = True
        self._try_to_end()

    def _try_to_end(self) -> None:
        """Raise `Ended` if possible, and repeat until the thread has left."""
        with self._lock:
            thread = self._thread
            if thread is None or thread not in sys._current_frames():  # noqa: SLF001  # documented: nothing else shows other threads' frames
                self._watched = False
                return
            if not self.raised and not _must_not_end(thread):
                self.raised = True
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(self._ended))
        timer = threading.Timer(_RETRY_SECONDS, self._try_to_end)
        timer.daemon = True
        timer.start()


def catch_discarded_end() -> None:
    """Detect a discarded `Ended`, so that it is raised again; for use in a separate process."""
    previous_hook = sys.unraisablehook

    def hook(hook_args: sys.UnraisableHookArgs) -> None:
        work = getattr(hook_args.exc_type, "work", None)
        if isinstance(work, Endable):
            work.raised = False
        else:
            previous_hook(hook_args)

    sys.unraisablehook = hook


def _must_not_end(thread: int) -> bool:
    """Return whether a thread is loading a module or compiled code, or is starting another thread."""
    frame = sys._current_frames().get(thread)  # noqa: SLF001
    while frame is not None:
        code = frame.f_code
        if code is threading.Thread.start.__code__ or any(loader in code.co_filename for loader in _LOADERS):
            return True
        frame = frame.f_back
    return False
