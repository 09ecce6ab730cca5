"""Runs a program on a controller: sends lines, handles answers, holds and pauses, and reports the result."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from leafcut.errors import LeafcutError, OptionError, SendError
from leafcut.gcode.words import parse_words, split_line
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import Kind
from leafcut.sender.answers import Accepted, Alarm, ControllerAnswer, Greeting, InvalidAnswer, Refused, Status
from leafcut.sender.character_counting import GRBL_BUFFER, SPARED, CharacterCounter, SentLine
from leafcut.sender.controller_facts import Facts
from leafcut.sender.conversation import LOCKED, STOPPED_SHORT, Conversation, Interrupted
from leafcut.sender.error_texts import state_in_words
from leafcut.sender.job import SendJob
from leafcut.sender.job_checks import check_program
from leafcut.sender.line_tracking import LineTracker
from leafcut.sender.lines import DrilledHole, Pause, SentStep, insert_pauses_at_holes
from leafcut.sender.port import PortLost
from leafcut.sender.resuming import (
    add_motion_mode_to_first_move,
    mode_restoring_lines,
    resuming_steps,
    spindle_restoring_lines,
)

#: Interval between status queries, s. Shorter intervals would slow the program down.
STATUS_SECONDS = 0.25
#: The connection counts as lost if nothing arrives for this time, s.
SILENCE_SECONDS = 5.0
#: An idle machine must have answered a line within this time, s. Otherwise, the answer was lost.
OWING_SECONDS = 3.0
_MAX_ERRORS = 20


class Request(StrEnum):
    """A request from the operator while a program runs."""

    HOLD = "hold"
    RESUME = "resume"
    STOP = "stop"
    FASTER = "faster"
    SLOWER = "slower"
    LITTLE_FASTER = "a little faster"
    LITTLE_SLOWER = "a little slower"
    NORMAL = "as programmed"


#: Changes of the feed override, percent.
_CHANGES = {
    Request.FASTER: 10,
    Request.SLOWER: -10,
    Request.LITTLE_FASTER: 1,
    Request.LITTLE_SLOWER: -1,
}
#: Limits of the feed override, percent (gnea/grbl 1.1, config.h).
_SLOWEST, _FASTEST = 10, 200
#: State that GRBL reports while it decelerates for a hold. GRBL ignores a resume until the machine is at rest.
_SLOWING = ("Hold", 1)
#: Number of status reports to wait for after a hold. The controller may have sent the first report before the hold.
_HELD_BY = 2


@dataclass(frozen=True)
class RunView:
    """The progress of a program.

    Attributes
    ----------
    line, taken
        The current line, and the last line that the controller has accepted. Both count from 1.
    hole
        Number of the current hole, or 0 before the first hole.
    place
        Position in program coordinates, mm, or None if the controller does not report it.
    feed, override
        Feed in mm/min, and override in percent of the programmed feed.
    done_s, left_s
        Elapsed cycle time, and remaining cycle time at the current override, s.
    """

    state: str
    line: int
    taken: int
    hole: int
    place: XYZ | None
    feed: float
    override: int
    done_s: float
    left_s: float


@dataclass(frozen=True)
class RunResult:
    """The result of a run.

    Attributes
    ----------
    complete
        Whether the controller has accepted every line and the machine has come to rest after the last line.
    taken, sent, line
        The last accepted line, the last sent line, and the line that was running.
    hole
        The current hole, otherwise the next hole. It is None if there is no such hole.
    state
        State of the machine in words. If the connection is lost, this is an assumption.
    homed
        Whether the position can be trusted.
    place, coordinates
        The last reported position, mm, and the name of its coordinate system.
    errors
        The lines that failed a check, each with its error.
    lost
        Whether the connection is lost, so that `state` is only assumed.
    sure
        Whether `line` is certain. If the machine did not report its position, it may have reached a later line.
    """

    complete: bool
    reason: str
    taken: int
    sent: int
    line: int
    hole: DrilledHole | None
    state: str
    homed: bool
    place: XYZ | None
    errors: tuple[tuple[int, str], ...] = ()
    lost: bool = False
    sure: bool = True
    coordinates: str = Message("machine coordinates")

    @property
    def resume_option(self) -> str:
        """The option that resumes the program at this point, or an empty string if the program has to start over."""
        if self.complete or not self.line or (self.hole is not None and self.hole.number == 1):
            return ""
        if self.hole is not None:
            return f"--from-hole {self.hole.number}"
        return f"--from-line {self.line}"


#: Asks the operator at a pause. Returns "" to continue, a line for the controller, or None to stop.
Prompt = Callable[[Pause, Sequence[str]], str | None]


class _RunEnded(SendError):
    """The run cannot continue, but the controller still responds."""


class _AlarmStop(_RunEnded):
    """The controller has stopped with an alarm and accepts only a reset."""


class _NoAnswer(PortLost):
    """The port is open, but the controller no longer answers."""


class _StopRequested(Exception):
    """The operator wants to stop."""


@dataclass
class SendRun:
    """Runs a program on a controller.

    Parameters
    ----------
    prompt
        Asks the operator at a pause, or None if there is no operator. If it moves the machine, it sets `touched`. The
        run then moves the tool back before it continues.
    observe
        Receives the progress after every status report.
    check
        Collect errors without moving the machine.
    by_hole
        Pause before every hole.
    """

    talk: Conversation
    facts: Facts
    job: SendJob
    steps: Sequence[SentStep]
    prompt: Prompt | None = None
    observe: Callable[[RunView], None] | None = None
    check: bool = False
    unhomed: bool = False
    by_hole: bool = False
    touched: bool = False
    requests: deque[Request] = field(default_factory=deque)

    def __post_init__(self) -> None:
        self.counter = CharacterCounter(self.facts.buffer, self.talk.max_lines)
        self.left: deque[SentStep] = deque(self._with_pauses_at_holes(self.steps))
        self.path = self.job.program.path
        self._tracker = LineTracker(self.path)
        feed_s, other_s = self.job.seconds_by_line
        self._fed, self._other = np.cumsum(feed_s), np.cumsum(other_s)
        numbers = [step.number for step in self.steps if isinstance(step, SentLine) and step.number]
        self._first = min(numbers, default=1)
        self.taken = self.sent = self._first - 1
        self.line = self._passed = self._first
        self._history: deque[int] = deque(maxlen=self.talk.max_ahead)
        self._overrides = (100, 100, 100)
        self._wanted: int | None = None
        self._changing = self._to_resume = False
        self._not_yet_held = 0
        self._offset = self.facts.status.offset
        self._sure = self._work_position(self.facts.status) is not None
        self._errors: list[tuple[int, str]] = []
        self._rests = 0
        self._was_reset = False
        self._heard_at = self._owed_since = self._asked_at = self.talk.clock()

    def _with_pauses_at_holes(self, steps: Sequence[SentStep], after: int = 0) -> Sequence[SentStep]:
        return insert_pauses_at_holes(steps, self.job.holes[after:]) if self.by_hole else steps

    def leave_hole_by_hole_mode(self) -> None:
        """Leave hole-by-hole mode, so that the program runs to its end. The prompt may call this method."""
        self.by_hole = False
        self.left = deque(step for step in self.left if not (isinstance(step, Pause) and step.hole))

    def queue_request(self, request: Request) -> None:
        """Queue a request. This method may be called from any thread."""
        self.requests.append(request)

    def run(self) -> RunResult:
        """Send all steps and return the result. If anything fails, stop the machine and report its state."""
        if self.prompt is None and not self.check:
            self._assume_first_tool_mounted()
        try:
            if self.check:
                self.talk.ask(self.talk.check_line)
            else:
                self.talk.prepare_for_program()
            self._heard_at = self._owed_since = self.talk.clock()
            self._send_all()
            return self._end_check_mode() if self.check else self._build_result("", self.talk.status)
        except _NoAnswer as silent:
            return self._result_of_lost_machine(f"{silent}; {self._stop_unanswered()}")
        except PortLost as lost:
            return self._result_of_lost_machine(str(lost))
        except (_StopRequested, Interrupted, KeyboardInterrupt):
            return self._stop_and_report(Message("stopped by you"))
        except LeafcutError as problem:
            return self._stop_and_report(str(problem), at_once=isinstance(problem, _AlarmStop))

    def _assume_first_tool_mounted(self) -> None:
        """Assume that the first tool is mounted, because no operator can be asked.

        Raises `OptionError` if the program has any other pause.
        """
        fed = self.path.line[(self.path.kind >= Kind.FEED) & (self.path.kind <= Kind.ARC_CCW)]
        cut = int(fed[0]) if len(fed) else self._first
        first = next((step for step in self.left if isinstance(step, Pause)), None)
        if first is not None and first.change and first.number < cut:
            self.left.remove(first)
        pause = next((step for step in self.left if isinstance(step, Pause)), None)
        if pause is not None:
            raise OptionError(
                "{} stops for the operator ({}), but no terminal is available to ask; use one", self.job.file, pause
            )

    def _send_all(self) -> None:
        while True:
            self._process_requests()
            self._step_feed_override()
            self._send_lines()
            for answer in self.talk.listen():
                self._process_answer(answer)
            if not self.left and not self.counter.waiting and self._rests >= 2:
                return
            self._check_connection()

    def _process_requests(self) -> None:
        while self.requests:
            request = self.requests.popleft()
            if request is Request.STOP:
                raise _StopRequested
            if request in (Request.HOLD, Request.RESUME):
                self._to_resume = request is Request.RESUME
                if request is Request.HOLD:
                    self.talk.hold()
                    self._not_yet_held = _HELD_BY
                continue
            before = self._overrides[0] if self._wanted is None else self._wanted
            change = _CHANGES.get(request)
            self._wanted = 100 if change is None else min(max(before + change, _SLOWEST), _FASTEST)
        status = self.talk.status
        slowing = status is not None and (status.state, status.detail) == _SLOWING
        if self._to_resume and not slowing and not self._not_yet_held:
            self._to_resume = False
            self.talk.resume()

    def _step_feed_override(self) -> None:
        if self._wanted is None or self._changing:
            return
        if self._wanted == self._overrides[0]:
            self._wanted = None
            return
        self.talk.step_feed_override(self._overrides[0], self._wanted)
        self._changing = True
        self._asked_at = 0.0

    def _send_lines(self) -> None:
        while self.left:
            step = self.left[0]
            if isinstance(step, Pause):
                if not self.check and (self.counter.waiting or self._rests < 2):
                    return
                self.left.popleft()
                if not self.check:
                    self._ask_at_pause(step)
                continue
            if not (self.talk.can_send_line and self.counter.fits(step)):
                return
            self.left.popleft()
            if not self.counter.waiting:
                self._owed_since = self.talk.clock()
            self.counter.record_sent(step)
            self.talk.send(step.text)
            self.sent = max(self.sent, step.number)
            self._rests = 0

    def _check_connection(self) -> None:
        now = self.talk.clock()
        if now - self._asked_at >= STATUS_SECONDS:
            self._asked_at = now
            self.talk.request_status(more=bool(self.left) and not isinstance(self.left[0], Pause))
        if now - self._heard_at > SILENCE_SECONDS * self.talk.patience:
            raise _NoAnswer("{} no longer responds", self.talk.port.name)
        if (
            self._rests >= 2
            and self.counter.waiting
            and now - self._owed_since > OWING_SECONDS * self.talk.patience + self._dwell_of_oldest_line()
        ):
            raise _RunEnded("an answer was lost on the way, so the lines can no longer be counted; check the cable")

    def _dwell_of_oldest_line(self) -> float:
        """Return the dwell time of the oldest unanswered line, s."""
        oldest = self.counter.waiting[0].text
        if "G4" not in oldest and "G04" not in oldest:
            return 0.0
        return sum(word.value for word in parse_words(split_line(oldest)[0]) if word.letter == "P")

    def _process_answer(self, answer: ControllerAnswer) -> None:
        self._heard_at = self.talk.clock()
        match answer:
            case Accepted():
                self._process_line_answer()
            case Refused():
                self._process_line_answer(self.talk.error_meaning(answer))
            case Alarm():
                raise _AlarmStop("{}: {}", self._position_words(), self.talk.error_meaning(answer))
            case Greeting():
                # A reset during a move loses the position. GRBL 1.1h does not report its alarm if the reset arrives
                # between its checks for alarms and for resets (protocol.c: `protocol_exec_rt_system`).
                self._was_reset = True
                raise _RunEnded("the controller was reset{}", self._current_line_words())
            case InvalidAnswer(words):
                raise _RunEnded("invalid answer: '{}'; check the cable", words)
            case Status():
                self._process_status(answer)
            case _:
                pass

    def _process_line_answer(self, wrong: str = "") -> None:
        """Handle the answer to the oldest unanswered line. `wrong` contains an error, if there is one."""
        line = self.counter.record_answer()
        self._owed_since, self._rests = self.talk.clock(), 0
        if line is None:
            raise _RunEnded("the controller answered a line that was not sent: is another program connected to it?")
        if line.number:
            self.taken = line.number
            self._history.append(line.number)
        if not wrong:
            return
        text = self.job.line_text(line.number) or line.text
        problem = Message("line {} '{}': {}", line.number, text, wrong) if line.number else f"'{text}': {wrong}"
        if not self.check or not line.number:
            raise _RunEnded(problem)
        self._errors.append((line.number, problem))
        if len(self._errors) >= _MAX_ERRORS:
            raise _RunEnded("{}; {} errors; the rest was not checked", problem, _MAX_ERRORS)

    def _process_status(self, status: Status) -> None:
        if status.state in LOCKED:
            raise _RunEnded("{}: the machine is {}", self._position_words(), state_in_words(status, self.talk.family))
        used = None if status.free_bytes is None else self.facts.buffer - status.free_bytes
        if self.facts.buffer == GRBL_BUFFER and used is not None and used > self.counter.bytes + SPARED:
            raise _RunEnded("the controller's buffer holds more than was sent: is another program connected to it?")
        self._rests = self._rests + 1 if status.state in ("Idle", "Check") else 0
        self._not_yet_held = 0 if status.state == "Hold" else max(self._not_yet_held - 1, 0)
        if status.overrides is not None:
            self._overrides, self._changing = status.overrides, False
        self._offset = status.offset or self._offset
        place = self._work_position(status)
        if not self.check:
            self.line = self._line_at_position(place)
        if self.observe is not None:
            self.observe(self._progress_view(status, place))

    def _line_at_position(self, place: XYZ | None) -> int:
        last = max(self.taken, self._first)
        self._sure = place is not None
        if place is None:
            return last
        self._passed = self._tracker.line_at(place, min(self._earliest_possible_line, last), last)
        return self._passed

    @property
    def _earliest_possible_line(self) -> int:
        return max(self._passed, self._history[0] if len(self._history) == self.talk.max_ahead else self._first)

    def _assume_earliest_line(self) -> None:
        """If the position is unknown, assume the earliest possible line, so that resuming skips no line."""
        if not self._sure:
            self.line = min(self._earliest_possible_line, max(self.taken, self._first))

    def _work_position(self, status: Status) -> XYZ | None:
        return self.facts.work_position(status, self._offset)

    def _progress_view(self, status: Status, place: XYZ | None) -> RunView:
        line = self.taken if self.check else max(self.line - 1, 0)
        line = min(line, len(self._fed) - 1)
        feed, rapid = max(self._overrides[0], 1), max(self._overrides[1], 1)
        feed_left, other_left = self._fed[-1] - self._fed[line], self._other[-1] - self._other[line]
        hole = self.job.hole_at_line(self.line)
        return RunView(
            state=status.state,
            line=self.line,
            taken=self.taken,
            hole=0 if hole is None else hole.number,
            place=place,
            feed=(status.feed or 0.0) * self.facts.unit,
            override=self._overrides[0],
            done_s=float(self._fed[line] + self._other[line]),
            left_s=float(100.0 * feed_left / feed + 100.0 * other_left / rapid),
        )

    def _ask_at_pause(self, pause: Pause) -> None:
        """Ask the operator, then continue.

        Before the run continues, it undoes every change by the operator except new zeros. A tool change stops the
        spindle. The run restarts the spindle if it should be on at this point of the program.
        """
        assert self.prompt is not None
        if pause.change and not self.job.is_laser:
            self.talk.ask("M5")
        replies: list[str] = []
        changed = False
        while True:
            answer = self.prompt(pause, replies)
            if answer is None:
                raise _StopRequested
            if not answer.strip():
                break
            replies, changed = self._send_operator_line(answer.strip()), True
        self._heard_at = self.talk.clock()
        following = next((step.number for step in self.left if isinstance(step, SentLine)), 0)
        if not following:
            return
        if changed or self.touched:
            self.touched = False
            self._continue_after_pause(pause, following)
        elif pause.change and not self.job.is_laser:
            self.left.extendleft(reversed(spindle_restoring_lines(self.job, following)))
        self._heard_at, self._rests = self.talk.clock(), 0

    def _send_operator_line(self, text: str) -> list[str]:
        try:
            data = text.upper() if text.isascii() and text.isprintable() else ""
            if not data or len(data) > 79 or set(data) & set("!?~"):
                return [Message("this text is not a valid command line")]
            replies = [str(getattr(answer, "text", answer)) for answer in self.talk.ask(data, 600.0)]
            return [*replies, "ok"]
        except PortLost:
            raise
        except SendError as problem:
            return [str(problem)]

    def _continue_after_pause(self, pause: Pause, following: int) -> None:
        """Read the origins and the position again.

        Then continue at line `following` with the state that the program has there.
        """
        self._wait_idle()
        self.facts = self.talk.read_facts_at_rest()
        check_program(self.job, self.facts, unhomed=self.unhomed, begun=True)
        place = self.facts.machine_position()
        height = None if place is None else place[2] - self.facts.work_zero(540)[2]
        try:
            steps, _ = resuming_steps(self.job, following, height)
        except OptionError:
            # Before its first move, the program has no position to which the tool could return.
            motion, lines = mode_restoring_lines(self.job, following)
            steps = (*lines, *add_motion_mode_to_first_move(list(self.left), motion))
        self.left = deque(self._with_pauses_at_holes([step for step in steps if step != pause], pause.hole))

    def _wait_idle(self) -> None:
        for _ in range(2):
            while self.talk.query_status().state not in ("Idle", *LOCKED):
                pass

    def _position_words(self) -> Message:
        if self.taken < self._first:
            return Message("before the program")
        return (
            Message("line {} '{}'", self.line, self.job.line_text(self.line))
            if self._sure
            else Message("in or after line {}", self.line)
        )

    def _current_line_words(self) -> str:
        return Message(" while the machine was in line {}", self.line) if self.taken >= self._first else ""

    def _end_check_mode(self) -> RunResult:
        status = self.talk.reset()
        errors = self._errors
        reason = errors[0][1] if errors else ""
        reason = Message("{}; {} more", reason, len(errors) - 1) if len(errors) > 1 else reason
        return self._build_result(reason, status)

    def _stop_and_report(self, reason: str, *, at_once: bool = False) -> RunResult:
        """Stop the machine and return the result. Set `at_once` if an alarm has already stopped the machine."""
        try:
            stop = self.talk.clean_up_after_alarm if at_once else self.talk.reset if self.check else self.talk.stop
            status = stop(self._process_late_answer)
        except PortLost as lost:
            return self._result_of_lost_machine(Message("{}; {}", reason, lost))
        except SendError as problem:
            return self._result_of_lost_machine(Message("{}; {}", reason, problem))
        return self._build_result(reason, status)

    def _stop_unanswered(self) -> str:
        try:
            return self.talk.stop_unanswered()
        except LeafcutError:
            return Message("no stop could be sent")

    def _process_late_answer(self, answer: ControllerAnswer) -> None:
        if isinstance(answer, Accepted | Refused):
            line = self.counter.record_answer()
            if line is not None and line.number:
                self.taken = line.number
        if isinstance(answer, Status) and not self.check:
            self._offset = answer.offset or self._offset
            self.line = self._line_at_position(self._work_position(answer))

    def _build_result(self, reason: str, status: Status | None) -> RunResult:
        self.counter.forget_lines()
        self._assume_earliest_line()
        complete = not reason
        state = Message("standing still") if status is None else state_in_words(replace(status, detail=None))
        return RunResult(
            complete=complete,
            reason=reason,
            taken=self.taken,
            sent=self.sent,
            line=0 if self.taken < self._first else self.line,
            hole=self._current_hole(),
            state=state,
            homed=not self._was_reset and (status is None or status.state not in (*LOCKED, STOPPED_SHORT)),
            place=None if status is None else self.facts.machine_position(status),
            errors=tuple(self._errors),
            sure=self._sure,
            coordinates=self.facts.names.coordinates,
        )

    def _result_of_lost_machine(self, reason: str) -> RunResult:
        """Return the result for a machine that cannot be reached.

        It executes its buffered lines and then comes to rest.
        """
        self._assume_earliest_line()
        last = self.talk.status
        state = (
            Message("the machine runs its buffered lines, at most up to line {}, then stops", self.sent)
            if self.sent
            else Message("unknown")
        )
        if self._spindle_turns():
            state = Message(
                "{}; its laser may stay on: stop it at the machine"
                if self.job.is_laser
                else "{}; its spindle may stay on: stop it at the machine",
                state,
            )
        return RunResult(
            complete=False,
            reason=reason,
            taken=self.taken,
            sent=self.sent,
            line=0 if self.taken < self._first else self.line,
            hole=self._current_hole(),
            state=state,
            homed=False,
            place=None if last is None else self.facts.machine_position(last),
            lost=True,
            sure=self._sure,
            coordinates=self.facts.names.coordinates,
        )

    def _current_hole(self) -> DrilledHole | None:
        hole = self.job.hole_at_line(self.line)
        if hole is None:
            return self.job.holes[0] if self.job.holes and self.taken >= self._first else None
        if self.line > hole.last:
            moving = (self.path.kind == Kind.RAPID) & (self.path.line > hole.last)
            later = self.job.holes[hole.number : hole.number + 1]
            if moving.any() and later and self.line >= later[0].first:
                return later[0]
        return hole

    def _spindle_turns(self) -> bool:
        rows = (self.path.kind == Kind.SPINDLE) & (self.path.line <= max(self.sent, 1))
        values = self.path.value[rows]
        return bool(len(values) and values[-1] != 0.0)
