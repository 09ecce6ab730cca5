"""Runs experiments in the studio, one at a time and in a thread. Each run is stored when it ends."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace

from leafcut.errors import LeafcutError, OptionError
from leafcut.lab.description import Description
from leafcut.lab.loading import load_experiment, reduced_experiment
from leafcut.lab.own_experiment import OWN_PART
from leafcut.lab.running import execute_experiment, stored_rows
from leafcut.lab.store import Row, Store
from leafcut.model.heartbeat import Progress
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.jobs import error_line


@dataclass(frozen=True)
class LabState:
    """The state of the current experiment, or of the last experiment.

    Attributes
    ----------
    share
        Share of the runs that are complete, from 0 to 1. Runs that were already stored at the start do not count.
    began
        Start time on the monotonic clock, s.
    line
        Why the experiment ended early. It is empty otherwise.
    failed
        One error message for each refused run.
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
        """Estimated remaining time, s, or None if it is still unknown."""
        if not self.running or self.share <= 0.0:
            return None
        return (time.monotonic() - self.began) * (1.0 - self.share) / self.share


class LabRuns:
    """Starts and stops experiments, and reads their results."""

    def __init__(self, folder: Folder) -> None:
        self.folder, self.file = folder, folder.root / "lab.sqlite"
        self.state: LabState | None = None
        #: The most recent experiment on the user's own part.
        self.own: Description | None = None
        self._ended, self._lock = threading.Event(), threading.Lock()
        self._thread: threading.Thread | None = None

    @property
    def running(self) -> bool:
        """Whether an experiment is running."""
        return self.state is not None and self.state.running

    def load_description(self, name: str, reduced: bool) -> Description:
        """Return an included experiment, or the experiment on the user's part.

        Raises `OptionError` if the name is unknown.
        """
        if name == OWN_PART:
            if self.own is None:
                raise OptionError("no part was compared since the studio started; start a comparison on the Lab page")
            return self.own
        if name.endswith(".toml") or "/" in name or "\\" in name:
            raise OptionError("name an experiment that comes with leafcut")
        return reduced_experiment(load_experiment(name)) if reduced else load_experiment(name)

    def start(self, description: Description) -> None:
        """Start the missing runs of an experiment. Raises `OptionError` if another experiment is running."""
        with self._lock:
            if self.running:
                raise OptionError("an experiment is already running; wait until it ends, or stop it")
            if description.name == OWN_PART:
                self.own = description
            self._ended = threading.Event()
            self.state = LabState(description, began=time.monotonic())
            self._thread = threading.Thread(target=self._execute, args=(description, self._ended), daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Stop the experiment. Finished runs are kept, so a restart only executes the remaining runs."""
        self._ended.set()

    def close(self) -> None:
        """Stop the experiment and wait until it has ended."""
        self.stop()
        if self._thread is not None:
            self._thread.join()

    def wait(self) -> None:
        """Wait until the experiment has ended."""
        if self._thread is not None:
            self._thread.join()

    def run_counts(self) -> dict[str, int]:
        """Return the number of stored runs for each experiment.

        The result is empty if the results file cannot be read.
        """
        if not self.file.is_file():
            return {}
        try:
            with Store(str(self.file), read_only=True) as store:
                return store.successful_run_counts()
        except LeafcutError:
            return {}

    def rows(self, description: Description) -> list[Row]:
        """Return the stored runs that match a description.

        Raises `ReadError` if the results file or an input cannot be read.
        """
        if not self.file.is_file():
            return []
        with Store(str(self.file), read_only=True) as store:
            return stored_rows(description, store)

    def _execute(self, description: Description, cancel_event: threading.Event) -> None:
        line, failed = "", tuple[str, ...]()
        try:
            with Store(str(self.file)) as store:
                failed = execute_experiment(
                    description, store, progress=self._record_progress, cancelled=cancel_event, mixed=True
                ).failed
        except Exception as problem:
            line = self.folder.hide_paths(error_line(problem))
        lines = tuple(self.folder.hide_paths(text) for text in failed)
        assert self.state is not None
        self.state = replace(self.state, running=False, doing="", line=line, failed=lines)

    def _record_progress(self, progress: Progress) -> None:
        if self.state is not None:
            self.state = replace(self.state, doing=progress.step, share=progress.share)
