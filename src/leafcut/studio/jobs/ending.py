"""Ending what another thread does between any two steps of its Python, where it does not look up by itself.

Readers of other packages take no word from outside while they read a damaged or endless file. What they hold is their
own, so that nothing is harmed where they end anywhere; searches and compilers hold what others use, and look up.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from types import TracebackType

#: Seconds until a thread that is to end, and is still at work, is looked at again.
_AGAIN = 0.05
#: Who loads modules, and who loads and makes compiled code: half of either would stay for all others.
_LOADERS = ("<frozen importlib._bootstrap>", f"{os.sep}llvmlite{os.sep}", f"{os.sep}numba{os.sep}")


class Ended(BaseException):
    """Raised where the thread just is; no `except Exception` of a reader takes it."""


class Endable:
    """A stretch of work of one thread, which another one may end: ``with endable: …``, and there ``endable.end()``.

    Attributes
    ----------
    raised
        `Ended` was raised, and Python has not let go of it since, as it does in the callback of a weak reference: that
        is known where `hear_what_is_lost` was called.
    """

    def __init__(self) -> None:
        self.raised = False
        self._lock = threading.Lock()
        self._thread: int | None = None
        self._over = self._watched = False
        self._ended = type("Ended", (Ended,), {"work": self})

    def __enter__(self) -> None:
        self.begin()

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.leave()

    def begin(self) -> None:
        """Let the work of this thread be ended from now on.

        Raises
        ------
        Ended
            It is to be ended already.
        """
        with self._lock:
            if self._over:
                raise self._ended
            self._thread = threading.get_ident()

    def leave(self) -> None:
        """Let the work of this thread not be ended any more; once this has returned, nothing is raised in it."""
        try:
            with self._lock:
                self._thread = None
        finally:  # `Ended` may come just here
            self._thread = None

    def end(self) -> None:
        """Raise `Ended` in the thread, if it is inside, else as soon as it begins; return at once.

        What a package in another language does in one call is done first, and what is being loaded, as half a module
        would stay for all others. A thread that is being started is started first: until it runs it goes by the number
        of the one that starts it, and what is raised by number would end it, and that one would wait for ever. It is
        raised once, and again only where it was lost.
        """
        with self._lock:
            self._over = True
            if self._watched:
                return
            self._watched = True
        self._look()

    def _look(self) -> None:
        """Raise what is to be raised, and look again until the thread has left."""
        with self._lock:
            thread = self._thread
            if thread is None or thread not in sys._current_frames():  # noqa: SLF001  # documented: nothing else shows other threads' frames
                self._watched = False
                return
            if not self.raised and not _is_not_to_be_ended(thread):
                self.raised = True
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(self._ended))
        again = threading.Timer(_AGAIN, self._look)
        again.daemon = True
        again.start()


def hear_what_is_lost() -> None:
    """Hear when Python lets go of an `Ended`, so that it is raised again; for a process of its own."""
    before = sys.unraisablehook

    def hear(told: sys.UnraisableHookArgs) -> None:
        work = getattr(told.exc_type, "work", None)
        if isinstance(work, Endable):
            work.raised = False
        else:
            before(told)

    sys.unraisablehook = hear


def _is_not_to_be_ended(thread: int) -> bool:
    """Return whether a thread is loading a module or compiled code, or is starting another one."""
    frame = sys._current_frames().get(thread)  # noqa: SLF001
    while frame is not None:
        code = frame.f_code
        if code is threading.Thread.start.__code__ or any(who in code.co_filename for who in _LOADERS):
            return True
        frame = frame.f_back
    return False
