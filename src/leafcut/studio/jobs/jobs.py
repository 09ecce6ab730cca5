"""Runs jobs in separate processes, with progress. Users can stop a job and keep its best result, or cancel it."""

from __future__ import annotations

import asyncio
import os
import re
import secrets
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace

from leafcut.errors import LeafcutError
from leafcut.files.whole_files import OutputError
from leafcut.message import Message, map_text
from leafcut.model.heartbeat import Progress
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import History, JobRecord, JobState, SearchTerm
from leafcut.studio.jobs.run_job import JobResult, run_task
from leafcut.studio.jobs.search_watch import Picture, Watch
from leafcut.studio.jobs.task import ReadyTask, Task, input_names, resolve_task, task_title
from leafcut.studio.jobs.workers import StudioWork, StudioWorkers, WorkError

#: Number of jobs that run at the same time. Even a single search uses all cores.
AT_ONCE = 2
#: Maximum number of messages per job. Older messages are dropped.
_MAX_MESSAGES = 1000
#: Number of finished jobs in memory. Some pages may not have shown the end of these jobs yet.
_MAX_ENDED = 16
#: Maximum number of trials that are listed for each job.
_MAX_TRIED = 64
#: Maximum number of points in the convergence chart of a running job, and minimum interval between points, s.
_MAX_POINTS, _POINT_SECONDS = 4000, 0.02


@dataclass
class LiveJob:
    """A job of this server.

    Attributes
    ----------
    points
        (seconds, cost, step) at every new step and whenever the cost decreases.
    messages
        The latest messages (seconds, text) without duplicates.
    said
        Total number of messages, including dropped messages.
    tried
        Trials of a job that compares several strategies, in the order in which they started: name → (result, cost).
    stopped, dropped
        Whether the job must end with its best result, or without any result.
    ended
        Completed when the job has ended and is stored in the history.
    """

    id: str
    call: ReadyTask
    names: tuple[str, ...]
    work: StudioWork
    state: JobState = JobState.WAITING
    line: str = ""
    internal: bool = False
    latest: Progress = Progress(Message(""))
    latest_s: float = 0.0
    points: list[tuple[float, float, str]] = field(default_factory=list)
    messages: list[tuple[float, str]] = field(default_factory=list)
    said: int = 0
    tried: dict[str, tuple[str, float | None]] = field(default_factory=dict)
    began: float = 0.0
    watch: Watch = field(default_factory=Watch)
    stopped: bool = False
    dropped: bool = False
    ended: Future[None] = field(default_factory=Future)

    def end_without_result(self) -> None:
        """End the job without a result."""
        self.dropped = True
        self.work.cancel()

    def receive(self, message: Progress | Picture | str) -> None:
        """Handle a message that the job has sent."""
        if isinstance(message, Progress):
            self.record_progress(message)
        else:
            self.watch.store_message(message)

    def record_progress(self, progress: Progress) -> None:
        """Record the progress of the job, which may be a message, a trial or a point in the convergence chart."""
        step, cost, trial = progress.step, progress.cost, progress.trial
        if trial is not None and (trial.name in self.tried or len(self.tried) < _MAX_TRIED):
            self.tried[trial.name] = trial.figure, trial.cost
        now = time.perf_counter() - self.began
        if not self.messages or self.messages[-1][1] != step:
            self.messages.append((now, step))
            self.said += 1
            del self.messages[:-_MAX_MESSAGES]
        self.latest, self.latest_s = progress, now
        if cost is None:
            return
        last = self.points[-1] if self.points else None
        fresh = last is None or last[2] != step or cost < last[1]
        if fresh and (last is None or last[2] != step or now - last[0] >= _POINT_SECONDS):
            self.points.append((now, cost, step))
            if len(self.points) > _MAX_POINTS:
                del self.points[1:-1:2]


class Jobs:
    """All jobs of the studio, both running and finished.

    `kept` returns the ids of uploads to keep even if no job uses them.
    """

    def __init__(
        self, folder: Folder, history: History, workers: StudioWorkers, kept: Callable[[], set[str]] = set
    ) -> None:
        self.folder, self.history, self.workers, self._kept = folder, history, workers, kept
        self._live: dict[str, LiveJob] = {}
        #: Jobs whose end is stored in the history. The latest job is at the end.
        self._ended: deque[str] = deque()
        #: Ids of the waiting jobs, in the order in which they will run.
        self._queue: list[str] = []
        self._threads = ThreadPoolExecutor(AT_ONCE, thread_name_prefix="leafcut-job")
        self._lock = threading.Lock()
        self.closed = False

    def start(self, task: Task, watch: Watch | None = None) -> str:
        """Start a job, or add it to the queue, and return its id.

        If `watch` is paused, the search waits before its first step.

        Raises
        ------
        OptionError
            The task is invalid.
        OutputError
            The history cannot be written, or the studio is closing.
        """
        call = resolve_task(task, self.folder)
        if self.closed:
            raise OutputError("the studio is closing; no new jobs are started")
        work = StudioWork(self.workers)
        live = LiveJob(secrets.token_urlsafe(9), call, input_names(task, self.folder), work, watch=watch or Watch())
        live.watch.connect(work.call_link_method)
        self.history.add(live.id, task_title(task, self.folder), task, time.time())
        with self._lock:
            self._live[live.id] = live
            self._queue.append(live.id)
        self._threads.submit(self._start_next)
        return live.id

    def waiting_ids(self) -> list[str]:
        """Return the ids of the waiting jobs, in the order in which they will run."""
        with self._lock:
            return list(self._queue)

    def move_in_queue(self, job: str, place: int) -> None:
        """Move a waiting job to a position in the queue, counted from 0. Jobs that are not waiting are ignored."""
        with self._lock:
            if job in self._queue:
                self._queue.remove(job)
                self._queue.insert(max(place, 0), job)

    def find_live_job(self, job: str) -> LiveJob | None:
        """Return a job that is running or has recently finished on this server, or None for older jobs."""
        return self._live.get(job)

    def record(self, job: str) -> JobRecord | None:
        """Return a job with its current state, or None if it does not exist."""
        records = self._with_live_state(lambda: [record for record in [self.history.get(job)] if record is not None])
        return records[0] if records else None

    def newest(self, limit: int = 200) -> list[JobRecord]:
        """Return the newest jobs with their current state, up to `limit`."""
        return self._with_live_state(lambda: self.history.newest(limit))

    def find(self, terms: Sequence[SearchTerm], limit: int, skip: int = 0) -> tuple[list[JobRecord], int]:
        """Return the jobs that match all terms, newest first, and the total number of matches."""
        return self._with_live_state(lambda: self.history.find(terms, limit, skip)), self.history.count(terms)

    def sheet_jobs(self, job: str) -> list[JobRecord]:
        """Return the jobs that cut the sheets of a nest, newest first, with their current state."""
        return self._with_live_state(lambda: self.history.sheet_jobs(job))

    def _with_live_state(self, read: Callable[[], list[JobRecord]]) -> list[JobRecord]:
        """Read jobs from the history. If the latest state of a job could not be written there, correct it."""
        # The states are read before the history. A job that has ended by now is in the history, unless writing failed.
        known = {job: (live.state, live.line) for job, live in list(self._live.items())}
        return [
            record
            if record.state.is_over or record.id not in known
            else replace(record, state=known[record.id][0], line=known[record.id][1])
            for record in read()
        ]

    def unfinished_ids(self) -> list[str]:
        """Return the ids of all unfinished jobs."""
        return [job for job, live in list(self._live.items()) if not live.state.is_over]

    def stop(self, job: str) -> None:
        """Stop a job and keep its best result. Finished jobs are ignored."""
        live = self._live.get(job)
        if live is not None and not live.state.is_over:
            live.stopped = True
            live.work.call_link_method("stop")

    def cancel(self, job: str) -> None:
        """End a job without a result. Finished jobs are ignored."""
        live = self._live.get(job)
        if live is None or live.state.is_over:
            return
        live.end_without_result()
        with self._lock:
            waits = job in self._queue
            if waits:
                self._queue.remove(job)
        if waits:
            self._store_end(live, JobState.CANCELLED)

    def delete(self, job: str) -> None:
        """Delete a job and the uploads that only this job used. Uploads of open pages and recent files are kept."""
        self.cancel(job)
        self.folder.delete_inputs(self.history.delete(job) - self._kept())
        with self._lock:
            self._live.pop(job, None)

    def messages(self, job: str) -> list[tuple[float, str]]:
        """Return the messages of a job as (seconds, text)."""
        live = self._live.get(job)
        return (list(live.messages) if live is not None else []) or self.history.messages(job)

    def wait(self, job: str, seconds: float | None = None) -> JobState:
        """Wait until a job has ended, at most for `seconds`, and return its state."""
        live = self._live.get(job)
        if live is not None:
            wait([live.ended], seconds)
        record = self.record(job)
        return record.state if record else JobState.CANCELLED

    async def wait_without_blocking(self, job: str) -> None:
        """Wait for the end of a job without blocking a thread. Several callers may wait for the same job."""
        live = self._live.get(job)
        if live is not None:
            await asyncio.shield(asyncio.wrap_future(live.ended))

    def close(self) -> None:
        """End all jobs, and mark unfinished jobs as interrupted."""
        if self.closed:
            return
        self.closed = True
        for live in list(self._live.values()):
            if not live.state.is_over:
                live.end_without_result()
        self._threads.shutdown(wait=True, cancel_futures=True)
        self.history.mark_unfinished_interrupted()
        for live in list(self._live.values()):
            if not live.ended.done():  # still waiting for a process
                live.state = JobState.INTERRUPTED
                live.ended.set_result(None)

    def _start_next(self) -> None:
        with self._lock:
            live = self._live.get(self._queue.pop(0)) if self._queue and not self.closed else None
        if live is not None:
            self._run_to_end(live)

    def _run_to_end(self, live: LiveJob) -> None:
        """Run a job and wait until it ends. If it raises an exception, store the error as the state of the job."""
        live.state, live.began = JobState.RUNNING, time.perf_counter()
        try:
            self.history.set_state(live.id, JobState.RUNNING)
            result = live.work.run(run_task, live.call, live.names, on_message=live.receive)
        except BaseException as problem:
            if live.dropped:
                self._store_end(live, JobState.INTERRUPTED if self.closed else JobState.CANCELLED)
            else:
                live.internal = is_internal(problem)
                self._store_end(live, JobState.FAILED, line=self.folder.hide_paths(error_line(problem)))
        else:
            if live.dropped:
                self._store_end(live, JobState.INTERRUPTED if self.closed else JobState.CANCELLED)
            else:
                self._store_end(live, JobState.STOPPED if live.stopped else JobState.DONE, result=result)

    def _store_end(self, live: LiveJob, state: JobState, *, line: str = "", result: JobResult | None = None) -> None:
        live.line, noted = line, True
        try:
            if result is None:
                self.history.finish(live.id, state, line=line, messages=live.messages)
            else:
                self.history.finish(
                    live.id,
                    state,
                    answer=result.answer,
                    figures=result.figures,
                    artefacts=result.artefacts,
                    messages=live.messages,
                )
        except BaseException as problem:
            live.line, state = self.folder.hide_paths(error_line(problem)), JobState.FAILED
            try:
                self.history.finish(live.id, state, line=live.line, messages=live.messages)
            except LeafcutError:
                noted = False
        live.state = state
        # Release the data of the search, which would otherwise accumulate.
        live.points, live.watch, live.tried = [], Watch(), {}
        if noted:
            live.messages = []
            self._limit_ended_jobs(live.id)
        live.ended.set_result(None)

    def _limit_ended_jobs(self, job: str) -> None:
        with self._lock:
            self._ended.append(job)
            while len(self._ended) > _MAX_ENDED:
                self._live.pop(self._ended.popleft(), None)


def is_internal(problem: BaseException) -> bool:
    """Return whether an exception is an internal error of leafcut."""
    if isinstance(problem, WorkError):
        return problem.internal
    return not isinstance(problem, LeafcutError | MemoryError | OSError)


def error_line(problem: BaseException) -> str:
    """Return the message of an exception in one line. An unknown exception is reported as an internal error."""
    if isinstance(problem, LeafcutError):
        line = str(problem)
    elif isinstance(problem, MemoryError):
        line = Message("not enough memory for this input")
    elif isinstance(problem, OSError) and problem.strerror:
        line = Message("a file in the studio's folder cannot be written or read ({})", problem.strerror)
    else:
        if os.environ.get("LEAFCUT_TRACEBACK"):
            traceback.print_exception(problem, file=sys.stderr)
        line = Message(
            "internal error in leafcut ({}: {}); set LEAFCUT_TRACEBACK=1 for details", type(problem).__name__, problem
        )
    return map_text(line, lambda text: "".join(c if c.isprintable() else "?" for c in re.sub(r"\s+", " ", text)))
