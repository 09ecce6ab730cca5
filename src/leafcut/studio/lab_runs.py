"""Experiments that run in the studio: one at a time, in a thread of its own; every finished run is kept at once."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace

from leafcut.errors import LeafcutError, OptionError
from leafcut.lab.description import Description
from leafcut.lab.loading import in_short, load
from leafcut.lab.own_part import OWN_PART
from leafcut.lab.running import rows_of, run
from leafcut.lab.store import Row, Store
from leafcut.model.heartbeat import Progress
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.jobs import line_of


@dataclass(frozen=True)
class LabState:
    """How the experiment stands that runs, or the last that ran.

    Attributes
    ----------
    doing
        What is done just now.
    share
        Of the runs that there were to do when it began, 0 to 1.
    began
        By the monotonic clock, s.
    line
        Why it ended before all was done; empty otherwise.
    failed
        A line for each run that was refused.
    """

    description: Description
    running: bool = True
    doing: str = ""
    share: float = 0.0
    began: float = 0.0
    line: str = ""
    failed: tuple[str, ...] = ()

    @property
    def seconds_left(self) -> float | None:
        """How long the rest takes if it goes on as it did, s; None while that is not known."""
        if not self.running or self.share <= 0.0:
            return None
        return (time.monotonic() - self.began) * (1.0 - self.share) / self.share


class LabRuns:
    """Starts and stops experiments, and has what they found."""

    def __init__(self, folder: Folder) -> None:
        self.folder, self.file = folder, folder.root / "lab.sqlite"
        self.state: LabState | None = None
        #: The experiment on a part of the person's own that was started last.
        self.own: Description | None = None
        self._ended, self._lock = threading.Event(), threading.Lock()
        self._thread: threading.Thread | None = None

    @property
    def running(self) -> bool:
        """Whether an experiment runs."""
        return self.state is not None and self.state.running

    def described(self, name: str, reduced: bool) -> Description:
        """Return an experiment by its name, one that comes with leafcut or the one on a part of the person's own.

        Raises
        ------
        OptionError
            There is none of that name.
        """
        if name == OWN_PART:
            if self.own is None:
                raise OptionError("no part was compared since the studio started; begin that on the Lab page")
            return self.own
        if name.endswith(".toml") or "/" in name or "\\" in name:
            raise OptionError("name an experiment that comes with leafcut")
        return in_short(load(name)) if reduced else load(name)

    def start(self, description: Description) -> None:
        """Do the runs of an experiment that are not done yet.

        Raises
        ------
        OptionError
            Another one runs.
        """
        with self._lock:
            if self.running:
                raise OptionError("an experiment runs already; wait until it ends, or stop it")
            if description.name == OWN_PART:
                self.own = description
            self._ended = threading.Event()
            self.state = LabState(description, began=time.monotonic())
            self._thread = threading.Thread(target=self._work, args=(description, self._ended), daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """End the experiment that runs; what is finished is kept, and it goes on from there when it is begun again."""
        self._ended.set()

    def close(self) -> None:
        """Stop, and wait until that is done."""
        self.stop()
        if self._thread is not None:
            self._thread.join()

    def wait(self) -> None:
        """Wait until the experiment that runs is over."""
        if self._thread is not None:
            self._thread.join()

    def counts(self) -> dict[str, int]:
        """Return how many runs each experiment has by now; none where the results cannot be read."""
        if not self.file.is_file():
            return {}
        try:
            with Store(str(self.file), read_only=True) as store:
                return store.counts()
        except LeafcutError:
            return {}

    def rows(self, description: Description) -> list[Row]:
        """Return the runs of an experiment as it is described now.

        Raises
        ------
        ReadError
            The results or an input cannot be read.
        """
        if not self.file.is_file():
            return []
        with Store(str(self.file), read_only=True) as store:
            return rows_of(description, store)

    def _work(self, description: Description, ended: threading.Event) -> None:
        line, failed = "", tuple[str, ...]()
        try:
            with Store(str(self.file)) as store:
                failed = run(description, store, progress=self._tell, cancelled=ended, mixed=True).failed
        except Exception as problem:
            line = self.folder.without_paths(line_of(problem))
        lines = tuple(self.folder.without_paths(one) for one in failed)
        assert self.state is not None
        self.state = replace(self.state, running=False, doing="", line=line, failed=lines)

    def _tell(self, now: Progress) -> None:
        if self.state is not None:
            self.state = replace(self.state, doing=now.step, share=now.share)
