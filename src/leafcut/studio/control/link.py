"""The studio's connection to a controller. One thread talks to the controller, and all other threads send it requests.

`leafcut.sender` implements the communication. This module decides which page may control the machine, which command is
sent next, and which state the pages show. Stop and the requests during a program bypass the queue. All other requests
wait in the queue.

A page that shows the machine reports to the link at regular intervals. If no page has reported for `GRACE` seconds, the
link ends any jog or frame. It also holds a running program, unless the program was started to run unattended.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

from leafcut.errors import LeafcutError, OptionError, SendError
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.sender.answers import Alarm, ControllerAnswer, Greeting, InvalidAnswer, Status
from leafcut.sender.controller_facts import Facts
from leafcut.sender.conversation import LOCKED, Interrupted, NotThisFirmware
from leafcut.sender.error_texts import state_in_words
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.job import SendJob, issues_except_notes, tools_after_line
from leafcut.sender.job_checks import check_machine_ready, check_program
from leafcut.sender.jogging import bounding_box_of_cuts, cancel_jog, check_jog, jog, probe_z, program_frame
from leafcut.sender.lines import Pause, SentStep
from leafcut.sender.port import BAUD, Port, PortLost, SerialPort
from leafcut.sender.resuming import steps_to_send
from leafcut.sender.run import SILENCE_SECONDS, STATUS_SECONDS, Request, RunResult, RunView, SendRun
from leafcut.sender.run_texts import ending_in_words
from leafcut.studio.control.state import (
    Connection,
    MachineQuestion,
    MachineState,
    MachineTask,
    ProgramEnd,
    ProgramProgress,
)

#: A program is put on hold if no page has shown the machine for this time, s.
GRACE = 5.0
#: Maximum number of queued jogs, so that the machine stops soon after the user releases a key.
_MAX_JOGS = 2
#: Maximum duration of the queued jogs while the user holds a key, s.
_JOG_AHEAD = 0.3
#: Alarms that do not affect the position: soft limit and probe alarms. Source: gnea/grbl 1.1, alarm codes.
_KEPT = (2, 4, 5)
#: Maximum time to wait for the machine to stop when the studio closes, s.
_END_SECONDS = 30.0

_Act = Callable[[Callable[[], None]], Any]


@dataclass
class _Task:
    """A request to the thread. `act` receives a function, and calls it as soon as the action has started."""

    doing: MachineTask
    act: _Act
    future: Future[Any]
    by_hand: bool = False
    jog: bool = False


@dataclass(frozen=True)
class RunOptions:
    """Options for a run.

    The run starts at a hole or a line, counted from 1. If both are None, it starts at the first line.

    Attributes
    ----------
    by_hole
        Whether to ask the user before every hole.
    unhomed
        Whether the user has set the zero of a machine that cannot home.
    alone
        Whether to continue even if no page shows the machine.
    """

    from_hole: int | None = None
    from_line: int | None = None
    by_hole: bool = False
    unhomed: bool = False
    alone: bool = False


@dataclass(frozen=True)
class ReadyProgram:
    """A program that was checked against the current state of the machine and is ready to run.

    Attributes
    ----------
    job
        The program, with its cycle times on this machine.
    facts
        Values that the controller has reported.
    steps
        The lines and pauses to send.
    line
        The line at which the program starts, or 0 for its start.
    told
        Messages to show to the user before the program starts.
    """

    job: SendJob
    facts: Facts
    steps: Sequence[SentStep]
    line: int
    told: tuple[str, ...]

    @property
    def box(self) -> tuple[XYZ, XYZ] | None:
        """Smallest and largest x, y and z of the cuts in program coordinates, mm. It is None if nothing is cut."""
        return bounding_box_of_cuts(self.job)

    @property
    def tools(self) -> list[str | None]:
        """The tools from `line` on, in order of use. A tool that the program does not name is None."""
        return tools_after_line(self.job, self.line)


class MachineLink:
    """The connection to a controller. There is at most one, and all methods are thread-safe."""

    def __init__(
        self, open_port: Callable[[str, int], Port] = SerialPort, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.state = MachineState()
        self.grace = GRACE
        self._open_port, self._clock = open_port, clock
        self._lock = threading.RLock()
        self._tasks: deque[_Task] = deque()
        self._answers: deque[str | None] = deque()
        self._thread: threading.Thread | None = None
        self._talk: GrblConversation | None = None
        self._facts: Facts | None = None
        self._run: SendRun | None = None
        self._wishes = RunOptions()
        self._leaving = self._cancel = self._left_alone = False
        self._alive_at = clock()
        self._asked_at = self._heard_at = self._jog_until = 0.0

    @property
    def job(self) -> SendJob | None:
        """The running program, or None if no program is running."""
        run = self._run
        return None if run is None else run.job

    # Requests; called from any thread.

    def record_page(self, holder: str, *, adopt: bool = False) -> None:
        """Record that a page shows the machine.

        With `adopt`, the page takes control unless another page already has it.
        """
        with self._lock:
            if self.state.holder == holder or (
                adopt and self.state.connection is not Connection.CLOSED and self._is_abandoned()
            ):
                self._alive_at = self._clock()
                if self.state.holder != holder:
                    self._update_state(holder=holder)

    def take_control(self, holder: str) -> None:
        """Take control of the machine, even if another page currently has it."""
        with self._lock:
            self._alive_at = self._clock()
            self._update_state(holder=holder)

    def connect(self, holder: str, port: str, baud: int = BAUD) -> Future[Any]:
        """Open a port and identify the controller. Raises `SendError` if a machine is already connected."""
        future: Future[Any] = Future()
        with self._lock:
            if self.state.connection is not Connection.CLOSED:
                raise SendError("the machine on {} is connected; disconnect it first", self.state.port)
            if self._thread is not None:
                self._thread.join()
            self._leaving, self._alive_at = False, self._clock()
            self._update_state(connection=Connection.OPENING, port=port, holder=holder, said="", bad=False, ended=None)
            self._thread = threading.Thread(target=self._run_connection, args=(port, baud, future), daemon=True)
            self._thread.start()
        return future

    def disconnect(self, holder: str) -> None:
        """Close the port. Raises `SendError` if the machine is busy, or if another page has control."""
        self._check_control(holder)
        if self.state.doing not in (MachineTask.NOTHING, MachineTask.ASKING) or self.state.is_moving:
            raise SendError("the machine is not at rest; stop it first, then disconnect it")
        self._close_connection()

    def home(self, holder: str) -> Future[Any]:
        """Home the machine."""
        return self._submit_task(holder, MachineTask.HOMING, self._home)

    def unlock(self, holder: str) -> Future[Any]:
        """Unlock the machine after an alarm, or stop it during a hold or a move."""
        return self._submit_task(holder, MachineTask.STOPPING, self._unlock)

    def jog(self, holder: str, moves: dict[str, float], feed: float, *, held: bool = False) -> Future[Any]:
        """Jog by the given distances, mm, at a feed in mm/min.

        If the jog comes from a `held` key, it is skipped when enough jogs are already queued.
        """
        with self._lock:
            if held and (len(self._tasks) >= _MAX_JOGS or self._jog_until - self._clock() > _JOG_AHEAD):
                done: Future[Any] = Future()
                done.set_result(None)
                return done
        return self._submit_task(holder, MachineTask.ASKING, lambda _: self._jog(moves, feed), by_hand=True, jog=True)

    def cancel_motion(self, holder: str) -> None:
        """End a jog or a frame. The machine stops and keeps its position."""
        with self._lock:
            self._check_control(holder)
            for task in [task for task in self._tasks if task.jog]:
                self._tasks.remove(task)
                task.future.set_result(None)
            self._cancel = True

    def set_zero(self, holder: str, axes: str) -> Future[Any]:
        """Set the zero of G54 to the current position for the given axes, such as ``XY``."""
        named = "".join(axis for axis in "XYZ" if axis in axes.upper())
        if not named or len(named) != len(axes):
            raise OptionError("'{}' are not axes; use X, Y and Z", axes)
        return self._submit_task(holder, MachineTask.ASKING, lambda _: self._set_zero(named), by_hand=True)

    def probe(self, holder: str, plate: float, feed: float, travel: float) -> Future[Any]:
        """Set Z0 with a probe plate.

        Parameters
        ----------
        holder
            The page that sends the request.
        plate
            Thickness of the plate, mm.
        feed
            Probing feed, mm/min.
        travel
            Maximum distance to move down, mm.
        """
        return self._submit_task(holder, MachineTask.PROBING, lambda _: self._probe(plate, feed, travel), by_hand=True)

    def trace_frame(self, holder: str, job: SendJob, wishes: RunOptions, feed: float) -> Future[Any]:
        """Check a program, then trace its bounding box above the part at a feed in mm/min.

        The result becomes available when the machine starts to trace the box.
        """
        return self._submit_task(
            holder, MachineTask.FRAMING, lambda on_start: self._trace_frame(on_start, job, wishes, feed)
        )

    def check_program(self, holder: str, job: SendJob, wishes: RunOptions) -> Future[Any]:
        """Check a program without sending it. The result is a `ReadyProgram`."""
        return self._submit_task(holder, MachineTask.ASKING, lambda _: self._check_and_prepare(job, wishes))

    def run_program(self, holder: str, job: SendJob, wishes: RunOptions) -> Future[Any]:
        """Check and run a program. The result is a `ReadyProgram`. It becomes available when the program starts."""
        return self._submit_task(holder, MachineTask.RUNNING, lambda on_start: self._run_program(on_start, job, wishes))

    def answer_question(self, holder: str, words: str | None) -> None:
        """Answer the program's question: "" continues, ``all`` leaves hole-by-hole mode, and None stops the program."""
        self._check_control(holder)
        if self.state.question is None:
            raise SendError("no question is open")
        self._answers.append(words)

    def send_request(self, holder: str, request: Request) -> None:
        """Hold or resume a program, or change its feed. A hold also ends a jog or a frame."""
        self._check_control(holder)
        if self._run is not None:
            if request is Request.RESUME:
                self._left_alone = False
            self._run.queue_request(request)
        elif request is Request.HOLD:
            self._cancel = True
        else:
            raise SendError("no program is running")

    def stop_machine(self) -> None:
        """Stop the machine: hold it, wait until it is at rest, and reset it. Any page may call this method."""
        with self._lock:
            waiting, talk = [*self._tasks], self._talk
            self._tasks.clear()
            self._jog_until = 0.0
            if talk is not None:
                talk.interrupt_wait()
        for task in waiting:
            task.future.set_exception(SendError("stopped by you"))

    def close(self) -> None:
        """Stop the machine and close the port. The studio calls this method when it closes."""
        if self._thread is not None:
            if self.state.is_moving:
                self.stop_machine()
            self._close_connection()

    # Control of the machine.

    def _is_abandoned(self) -> bool:
        return not self.state.holder or self._clock() - self._alive_at > self.grace

    def _check_control(self, holder: str) -> None:
        with self._lock:
            if not self.state.is_connected:
                raise SendError("no machine is connected")
            if self.state.holder != holder and not self._is_abandoned():
                raise SendError("another page controls the machine; take it over first")
            self._alive_at = self._clock()
            if self.state.holder != holder:
                self._update_state(holder=holder)

    def _submit_task(
        self, holder: str, task: MachineTask, act: _Act, *, by_hand: bool = False, jog: bool = False
    ) -> Future[Any]:
        future: Future[Any] = Future()
        with self._lock:
            self._check_control(holder)
            busy = self.state.doing not in (MachineTask.NOTHING, MachineTask.ASKING)
            if busy and not (by_hand and self.state.question is not None):
                raise SendError("the machine is busy; wait for the end, or stop it")
            self._tasks.append(_Task(task, act, future, by_hand, jog))
        return future

    def _update_state(self, **changes: Any) -> None:
        with self._lock:
            self.state = replace(self.state, number=self.state.number + 1, **changes)

    def _show_message(self, line: str, *, bad: bool = False) -> None:
        self._update_state(said=line, bad=bad, saying=self.state.saying + 1)

    def _close_connection(self) -> None:
        self._leaving = True
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(_END_SECONDS)

    # The thread.

    def _run_connection(self, name: str, baud: int, connected: Future[Any]) -> None:
        port: Port | None = None
        message = ""
        try:
            port = self._open_port(name, baud)
            talk = GrblConversation(port, clock=self._clock)
            with self._lock:
                self._talk = talk
            talk.on_status = self._process_status
            status = talk.connect()
            self._asked_at = self._heard_at = self._clock()
            if status.state in ("Idle", *LOCKED):
                self._read_facts()
            self._update_state(connection=Connection.OPEN)
            self._process_status(talk.status or status)
            connected.set_result(None)
            self._serve_connection(talk)
        except Interrupted:
            message = Message("stopped by you")
        except NotThisFirmware as problem:
            message = str(problem)
            if problem.answers:
                message += Message("; this page supports only GRBL boards: send to Marlin boards with leafcut send")
        except LeafcutError as problem:
            message = str(problem)
        except Exception as fault:  # after an internal error, no page must show a connected machine
            message = Message(
                "an internal error in leafcut ({}): the connection is closed; stop the machine at its own switch", fault
            )
        finally:
            if port is not None:
                port.close()
            self._drop_connection(message)
            if not connected.done():
                connected.set_exception(SendError(message))

    def _drop_connection(self, message: str) -> None:
        with self._lock:
            waiting = [*self._tasks]
            self._tasks.clear()
            self._answers.clear()
            self._talk = self._facts = self._run = None
            self._cancel = self._left_alone = False
            kept = self.state
            self.state = MachineState(kept.number, said=kept.said, bad=kept.bad, saying=kept.saying, ended=kept.ended)
            self._show_message(message, bad=bool(message))
        for task in waiting:
            task.future.set_exception(SendError(message or "no machine is connected"))

    def _serve_connection(self, talk: GrblConversation) -> None:
        while not self._leaving:
            try:
                self._run_next_task()
                self._poll_machine(talk)
            except Interrupted:
                self._stop_and_report(talk)
            except PortLost:
                raise
            except LeafcutError as problem:
                self._show_message(str(problem), bad=True)
        if talk.status is not None and talk.status.state in ("Jog", "Run", "Hold"):
            talk.stop()

    def _run_next_task(self) -> None:
        with self._lock:
            if not self._tasks:
                return
            task = self._tasks.popleft()
            # The state stays "running" during manual actions while the program waits for an answer.
            previous = self.state.doing
            self._update_state(doing=task.doing if self._run is None else previous)
        future = task.future

        def finish(result: object = None) -> None:
            if not future.done():
                future.set_result(result)

        try:
            finish(task.act(finish))
        except Interrupted:
            if not future.done():
                future.set_exception(SendError("stopped by you"))
            raise
        except LeafcutError as problem:
            if not future.done():
                future.set_exception(problem)
            raise
        except Exception as fault:
            if not future.done():
                future.set_exception(SendError("an internal error in leafcut ({})", fault))
            raise
        finally:
            self._heard_at = self._clock()
            self._update_state(doing=previous)

    def _poll_machine(self, talk: GrblConversation, handle: Callable[[ControllerAnswer], None] | None = None) -> None:
        now = self._clock()
        if now - self._asked_at >= STATUS_SECONDS:
            self._asked_at = now
            talk.request_status()
        for answer in talk.listen():
            (handle or self._process_answer)(answer)
        if now - self._heard_at > SILENCE_SECONDS * talk.patience:
            raise PortLost("{} no longer responds", talk.port.name)
        if self._cancel or (self._is_abandoned() and self.state.status == "Jog"):
            self._cancel, self._jog_until = False, 0.0
            cancel_jog(talk)

    def _process_answer(self, answer: ControllerAnswer) -> None:
        assert self._talk is not None
        match answer:
            case Alarm(why):
                self._show_message(self._talk.error_meaning(answer), bad=True)
                self._update_state(unsure=self.state.unsure or why not in _KEPT)
            case Greeting():
                self._talk.record_restart()
                self._facts = None
                # A reset during a move loses the position. GRBL 1.1h does not report its alarm if the reset arrives
                # between its checks for alarms and for resets (protocol.c: `protocol_exec_rt_system`).
                moving = self.state.is_moving or self._jog_until > self._clock()
                self._update_state(unsure=self.state.unsure or moving)
                self._show_message(Message("the controller was reset"), bad=True)
            case InvalidAnswer(words):
                self._show_message(Message("invalid answer: '{}'; check the cable", words), bad=True)
            case _:
                pass

    def _process_status(self, status: Status) -> None:
        self._heard_at = self._clock()
        talk, facts = self._talk, self._facts
        if talk is None:
            return
        unit = 1.0 if facts is None else facts.unit
        changes: dict[str, Any] = {
            "status": status.state,
            "feed": (status.feed or 0.0) * unit,
        }
        if facts is not None:
            changes |= {"machine": facts.machine_position(status), "work": facts.work_position(status, talk.offset)}
        now = self.state
        if any(getattr(now, name) != value for name, value in changes.items()):
            self._update_state(**changes)

    def _read_facts(self) -> Facts:
        assert self._talk is not None
        facts = self._facts = self._talk.read_facts_at_rest()
        self._update_state(version=facts.version, homing=facts.homing, travel=facts.travel_limits())
        self._process_status(facts.status)
        return facts

    def _facts_at_rest(self) -> Facts:
        """Read the settings and state of the controller. Raises `SendError` if the machine is moving or locked."""
        assert self._talk is not None
        status = self._talk.query_status()
        if status.state != "Idle":
            raise SendError("the machine is {}; bring it to rest first", state_in_words(status, self._talk.family))
        return self._read_facts()

    def _stop_and_report(self, talk: GrblConversation) -> None:
        self._update_state(doing=MachineTask.STOPPING, question=None)
        try:
            talk.stop()
        finally:
            self._update_state(doing=MachineTask.NOTHING)
        if talk.status is not None and talk.status.state == "Alarm":
            self._update_state(unsure=True)
        self._show_message(Message("stopped by you; the spindle is off"))

    # Manual operation.

    def _home(self, on_start: Callable[[], None]) -> None:
        assert self._talk is not None
        on_start()
        try:
            self._talk.home()
        except (Interrupted, SendError) as problem:
            self._update_state(unsure=True)
            if isinstance(problem, Interrupted):
                raise SendError("homing was stopped by you: the position is lost") from None
            raise
        self._talk.restarted = False
        self._update_state(unsure=False)
        self._read_facts()

    def _unlock(self, _: Callable[[], None]) -> None:
        assert self._talk is not None
        if self._talk.unlock():
            self._update_state(unsure=True)
        self._read_facts()

    def _jog(self, moves: dict[str, float], feed: float) -> None:
        assert self._talk is not None
        self._record_manual_action()
        if self._facts is not None and not self.state.unsure:
            check_jog(self._facts, self.state.machine, moves)
        jog(self._talk, moves, feed)
        seconds = 60.0 * math.hypot(*moves.values()) / feed
        self._jog_until = max(self._jog_until, self._clock()) + seconds

    def _set_zero(self, axes: str) -> None:
        assert self._talk is not None
        self._record_manual_action()
        self._talk.ask("G54")
        self._talk.zero_here(axes)
        if not self._talk.restarted and axes == "XYZ":
            self._update_state(unsure=False)
        self._read_facts()

    def _probe(self, plate: float, feed: float, travel: float) -> None:
        assert self._talk is not None
        facts = self._facts_at_rest()
        self._record_manual_action()
        probe_z(self._talk, facts, plate, feed, travel)
        self._show_message(Message("Z0 is set by the probe"))

    def _record_manual_action(self) -> None:
        if self._run is not None:
            self._run.touched = True

    def _trace_frame(self, on_start: Callable[[], None], job: SendJob, wishes: RunOptions, feed: float) -> None:
        talk = self._talk
        assert talk is not None
        lines = program_frame(job, self._check_and_prepare(job, wishes).facts).tracing_lines(feed)
        on_start()
        for line in lines:
            talk.ask(line)
        rests = 0
        while rests < 2:
            before = talk.status
            self._poll_machine(talk)
            if talk.status is not before and talk.status is not None:
                rests = rests + 1 if talk.status.state in ("Idle", "Alarm") else 0

    # Programs.

    def _check_and_prepare(self, job: SendJob, wishes: RunOptions) -> ReadyProgram:
        talk = self._talk
        assert talk is not None
        facts = self._read_facts()
        check_machine_ready(facts, unhomed=wishes.unhomed, restarted=talk.restarted, family=talk.family)
        if self.state.unsure and not wishes.unhomed:
            raise SendError(
                "the machine was locked by an alarm, so its position may be wrong: home it, or set its zero again"
            )
        issues = check_program(job, facts, unhomed=wishes.unhomed)
        notes = [str(issue) for issue in issues_except_notes([*job.issues, *issues])]
        if facts.soft_limits_warning:
            notes.append(facts.soft_limits_warning)
        if wishes.by_hole and not job.holes:
            raise SendError("{} has no holes to drill one at a time", job.file)
        line, steps, tool = steps_to_send(job, facts, wishes.from_hole, wishes.from_line)
        if tool is not None:
            notes.append(Message("tool T{} must be in the spindle", tool))
        return ReadyProgram(job.for_machine(facts.machine_with_settings(job.machine)), facts, steps, line, tuple(notes))

    def _run_program(self, on_start: Callable[..., None], job: SendJob, wishes: RunOptions) -> None:
        assert self._talk is not None
        ready = self._check_and_prepare(job, wishes)
        job = ready.job
        self._wishes, self._left_alone = wishes, False
        self._answers.clear()
        run = SendRun(self._talk, ready.facts, job, ready.steps, unhomed=wishes.unhomed, by_hole=wishes.by_hole)
        run.prompt, run.observe = self._ask_user, lambda view: self._show_progress(run, view)
        feed_s, other_s = job.seconds_by_line
        progress = ProgramProgress(
            job.file,
            job.steps[-1].number,
            len(job.holes),
            left_s=float(feed_s.sum() + other_s.sum()),
        )
        self._run = run
        self._update_state(progress=progress, ended=None)
        self._show_message("")
        on_start(ready)
        try:
            ending = run.run()
        finally:
            self._run = None
            self._update_state(question=None, progress=None)
        self._report_ending(job, ending)

    def _report_ending(self, job: SendJob, ending: RunResult) -> None:
        words = ending_in_words(ending, job)
        can_go_on = bool(ending.resume_option)
        hole = ending.hole.number if can_go_on and ending.hole is not None else 0
        line = ending.line if can_go_on else 0
        self._update_state(
            ended=ProgramEnd(job.file, ending.complete, words, line, hole),
            unsure=self.state.unsure or not ending.homed,
        )
        self._show_message(words, bad=not ending.complete)

    def _show_progress(self, run: SendRun, view: RunView) -> None:
        """Show the progress of a program to all pages. If no page shows the program any more, put it on hold."""
        now = self.state.progress
        if now is None:
            return
        self._update_state(
            progress=replace(
                now,
                line=view.line,
                hole=view.hole,
                feed=view.feed,
                override=view.override,
                done_s=view.done_s,
                left_s=view.left_s,
            )
        )
        if self._is_abandoned() and not (self._wishes.alone or self._left_alone):
            self._left_alone = True
            run.queue_request(Request.HOLD)
            self._show_message(Message("no page shows the machine any more, so the machine is on hold"), bad=True)

    def _ask_user(self, pause: Pause, messages: Sequence[str]) -> str | None:
        talk, run = self._talk, self._run
        assert talk is not None and run is not None
        kind = "hole" if pause.hole else "tool" if pause.change else "pause"
        self._update_state(question=MachineQuestion(kind, str(pause), pause.number, pause.hole, tuple(messages)))

        def check_answer(answer: ControllerAnswer) -> None:
            if isinstance(answer, Alarm):
                raise SendError(talk.error_meaning(answer))
            if isinstance(answer, Greeting):
                raise SendError("the controller was reset")

        try:
            while not self._answers:
                try:
                    self._run_next_task()
                except PortLost:
                    raise
                except LeafcutError as problem:
                    self._show_message(str(problem), bad=True)
                self._poll_machine(talk, check_answer)
                if self._leaving:
                    return None
            answer = self._answers.popleft()
        finally:
            self._update_state(question=None)
        if answer == "all":
            run.leave_hole_by_hole_mode()
            return ""
        return answer
