"""The command `leafcut send`: send a program to a GRBL or Marlin board over its serial port."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TextIO

from cyclopts import Parameter

from leafcut.cli.flags import File, Json, Name, switch_parameter
from leafcut.cli.shared import print_json
from leafcut.cli.usage import DASH, HELD
from leafcut.errors import OptionError, SendError
from leafcut.files.whole_files import check_output
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.sender.controller_facts import Facts
    from leafcut.sender.conversation import Conversation
    from leafcut.sender.job import SendJob
    from leafcut.sender.lines import Pause, SentStep
    from leafcut.sender.run import RunResult, RunView, SendRun

_KEYS_HELP = "keys: space or ! hold, ~ or Enter resume, q stop; feed + - (10 %), > < (1 %), = as programmed"

_LOOK_SECONDS = 0.05


def send(
    program: Annotated[str, Parameter(name="PROGRAM", help="a G-code program for this machine")],
    /,
    *more: Annotated[str, Parameter(show=False)],
    port: Annotated[
        Name | None, Parameter(name="--port", help="serial port of the controller: /dev/ttyUSB0, COM3")
    ] = None,
    machine: Annotated[Name, Parameter(name="--machine", help="the machine, by name or profile file")],
    baud: Annotated[int, Parameter(name="--baud", help="baud rate of the port")] = 115_200,
    dialect: Annotated[
        Name | None,
        Parameter(name="--dialect", help="dialect of the program, by name or TOML file (default: the machine's)"),
    ] = None,
    units: Annotated[
        Literal["mm", "in"] | None, Parameter(name="--units", help="units of a program that does not state them")
    ] = None,
    from_hole: Annotated[
        int | None, Parameter(name="--from-hole", help="resume after an interruption at this hole, counted from 1")
    ] = None,
    from_line: Annotated[
        int | None, Parameter(name="--from-line", help="resume after an interruption at this line of the program")
    ] = None,
    check: Annotated[
        bool,
        switch_parameter("--check", help="the controller reads the program without moving the machine ($C)"),
    ] = False,
    dry_run: Annotated[
        bool,
        switch_parameter(
            "--dry-run",
            help="query the machine and check everything, but do not send the program",
        ),
    ] = False,
    home: Annotated[bool, switch_parameter("--home", help="home the machine first ($H)")] = False,
    unlock: Annotated[
        bool,
        switch_parameter(
            "--unlock",
            help="first clear a hold or an alarm, without homing ($X)",
        ),
    ] = False,
    unhomed: Annotated[
        bool,
        switch_parameter(
            "--unhomed",
            help="the machine has no homing ($22=0): only the size of the program is checked against its travel",
        ),
    ] = False,
    zero_here: Annotated[
        bool,
        switch_parameter(
            "--zero-here",
            help="the tool is at the program's zero (G10 L20 P1 X0 Y0 Z0)",
        ),
    ] = False,
    accept: Annotated[
        Name | None,
        Parameter(name="--accept", help="codes of the dangers that you accept, such as L801,L806"),
    ] = None,
    log: Annotated[
        File | None, Parameter(name="--log", help="log file, to which all serial traffic is appended")
    ] = None,
    yes: Annotated[bool, switch_parameter("--yes", "-y", help="start without asking for confirmation")] = False,
    as_json: Json = False,
    quiet: Annotated[
        bool,
        switch_parameter("--quiet", "-q", help="print only warnings: no progress and no summary"),
    ] = False,
) -> int:
    """Send a program to a GRBL or Marlin board, after checking it against the machine's current state.

    While it runs, keys hold it, stop it and change the feed. After any failure the machine is stopped, and the option
    to resume is shown.
    """
    from leafcut.sender.firmware import conversation_class
    from leafcut.sender.job import parse_accepted_codes, read_job
    from leafcut.sender.port import SerialPort, serial_ports_sentence

    if more:
        raise OptionError(f"send takes one program, not {1 + len(more)}; send them one by one")
    _check_flags(program, from_hole, from_line, check=check, dry_run=dry_run, yes=yes)
    check_output(log, [program, *[file for file in (machine, dialect) if file and file.endswith(".toml")]])
    accepted = parse_accepted_codes(accept or "")
    job = read_job(program, machine, dialect_name=dialect, units=units, accept=accepted)
    speaker = conversation_class(job.machine, machine)
    if check and not speaker.check_line:
        raise OptionError("--check: Marlin has no check mode; --dry-run checks the program without sending it")
    if port is None:
        raise OptionError(f"send needs --port; {serial_ports_sentence()}")
    with _open_log(log) as add, _stop_on_signals():
        line = SerialPort(port, baud)
        try:
            talk = speaker(line, add)
            talk.connect()
            locked = unlock and talk.unlock()
            if home:
                talk.home()
            if zero_here:
                talk.zero_here()
            if locked and not (home or zero_here or unhomed):
                raise SendError("it was locked by an alarm, so its position may be wrong: add --home, or --unhomed")
            facts, job = _prepare_job(talk, job, unhomed=unhomed or zero_here, quiet=quiet)
            steps = _steps_to_send(job, facts, from_hole, from_line, quiet=quiet or as_json)
            if dry_run:
                _print_unless_quiet(f"{program}: can be sent to {port}; nothing was sent", quiet=quiet or as_json)
                ending = None
            else:
                ending = _run_program(
                    talk, facts, job, steps, check=check, unhomed=unhomed or zero_here, yes=yes, quiet=quiet
                )
        finally:
            line.close()
    return _print_ending(ending, job, port, as_json=as_json, quiet=quiet)


def _check_flags(
    program: str, from_hole: int | None, from_line: int | None, *, check: bool, dry_run: bool, yes: bool
) -> None:
    from leafcut.sender.resuming import refuse_hole_and_line

    if program in (DASH, HELD):
        raise OptionError("send -: name a file, so that the run can be resumed after a break")
    refuse_hole_and_line(from_hole, from_line)
    if check and dry_run:
        raise OptionError("--check and --dry-run exclude each other: --check sends the program, --dry-run does not")
    if not (check or dry_run or yes or (sys.stdin is not None and sys.stdin.isatty())):
        raise OptionError("no terminal to confirm the start: use a terminal, or add --yes")


def _prepare_job(talk: Conversation, job: SendJob, *, unhomed: bool, quiet: bool) -> tuple[Facts, SendJob]:
    from leafcut.sender.job import issues_except_notes
    from leafcut.sender.job_checks import check_machine_ready, check_program

    facts = talk.read_facts_at_rest()
    check_machine_ready(facts, unhomed=unhomed, restarted=talk.restarted, family=talk.family)
    differences = check_program(job, facts, unhomed=unhomed)
    for issue in issues_except_notes([*job.issues, *differences]):
        print(f"leafcut: {issue.severity}: {issue}", file=sys.stderr)
    if not quiet and facts.soft_limits_warning:
        print(f"leafcut: {facts.soft_limits_warning}", file=sys.stderr)
    return facts, job.for_machine(facts.machine_with_settings(job.machine))


def _steps_to_send(
    job: SendJob, facts: Facts, from_hole: int | None, from_line: int | None, *, quiet: bool
) -> Sequence[SentStep]:
    from leafcut.sender.resuming import steps_to_send

    line, steps, tool = steps_to_send(job, facts, from_hole, from_line)
    put = "" if tool is None else f"; tool T{tool} must be in the spindle"
    if line:
        _print_unless_quiet(f"continues from line {line} '{job.line_text(line)}'{put}", quiet=quiet)
    return steps


def _run_program(
    talk: Conversation,
    facts: Facts,
    job: SendJob,
    steps: Sequence[SentStep],
    *,
    check: bool,
    unhomed: bool,
    yes: bool,
    quiet: bool,
) -> RunResult:
    from leafcut.sender.run import SendRun

    run = SendRun(talk, facts, job, steps, check=check, unhomed=unhomed)
    shown = _ProgressLine(job, quiet=quiet)
    run.observe = shown.show
    keys = Keys(lambda key: _handle_key(run, key))
    if keys.terminal and not check:
        run.prompt = lambda pause, messages: shown.ask_operator(keys, pause, messages)
    if not check and not yes:
        feed_s, other_s = job.seconds_by_line

        print(f"{job.file}: {format_time(float(feed_s.sum() + other_s.sum()))} on {job.machine.name}", file=sys.stderr)
        print("Enter starts, q ends: ", end="", file=sys.stderr, flush=True)
        if sys.stdin.readline().strip():
            raise SendError("not started; nothing was sent")
    if keys.terminal and not quiet:
        print(_KEYS_HELP, file=sys.stderr)
    with keys if not check else nullcontext():
        ending = run.run()
    shown.clear()
    return ending


def _handle_key(run: SendRun, key: str) -> None:
    from leafcut.sender.run import Request

    requests = {
        " ": Request.HOLD,
        "!": Request.HOLD,
        "~": Request.RESUME,
        "\n": Request.RESUME,
        "\r": Request.RESUME,
        "q": Request.STOP,
        "+": Request.FASTER,
        "-": Request.SLOWER,
        ">": Request.LITTLE_FASTER,
        "<": Request.LITTLE_SLOWER,
        "=": Request.NORMAL,
    }
    if key in requests:
        run.queue_request(requests[key])


class _ProgressLine:
    def __init__(self, job: SendJob, *, quiet: bool) -> None:
        self.job, self.width = job, 0
        self.for_machine = not quiet and sys.stderr.isatty()

    def show(self, view: RunView) -> None:
        from leafcut.sender.run_texts import progress_in_words

        if not self.for_machine:
            return
        end = time.strftime("%H:%M:%S", time.localtime(time.time() + view.left_s))
        line = f"{progress_in_words(view, self.job)}, ends {end}"
        print(f"\r{line:{self.width}}", end="", file=sys.stderr, flush=True)
        self.width = len(line)

    def clear(self) -> None:
        if self.width:
            print(file=sys.stderr)
            self.width = 0

    def ask_operator(self, keys: Keys, pause: Pause, messages: Sequence[str]) -> str | None:
        self.clear()
        for line in messages:
            print(line, file=sys.stderr)
        with keys.line_input():
            words = (
                "Enter continues, q stops, a line such as G10 L20 P0 Z0 or $J=G91 Z5 F500 is sent to the controller: "
            )
            print(f"{pause}\n{words}", end="", file=sys.stderr, flush=True)
            line = sys.stdin.readline()
        return None if not line or line.strip().lower() == "q" else line.strip()


def _print_ending(ending: RunResult | None, job: SendJob, port: str, *, as_json: bool, quiet: bool) -> int:
    from leafcut.sender.run_texts import ending_as_json, ending_in_words

    if ending is None:
        if as_json:
            print_json({"program": job.file, "port": port, "complete": False, "dry_run": True})
        return 0
    words = ending_in_words(ending, job)
    if as_json:
        print_json({"port": port, "machine": job.machine.name, **ending_as_json(ending, job)})
    elif ending.complete:
        _print_unless_quiet(words, quiet=quiet)
    if not ending.complete:
        stopped = SendError(words)
        stopped.answered = as_json
        raise stopped
    return 0


def _print_unless_quiet(line: str, *, quiet: bool) -> None:
    if not quiet:
        print(line)


@contextmanager
def _open_log(name: str | None) -> Iterator[Any]:
    if name is None:
        yield None
        return
    try:
        file: TextIO = Path(name).open("a", encoding="utf-8")  # noqa: SIM115 - closed below
    except OSError as problem:
        raise OptionError(f"--log {name}: cannot be written ({problem.strerror})") from None
    with file:

        def add(direction: str, text: str) -> None:
            now = time.time()
            stamp = f"{time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(now))}.{int(now % 1 * 1000):03d}"
            with suppress(OSError, ValueError):
                file.write(f"{stamp} {direction} {text}\n")
                file.flush()

        yield add


@contextmanager
def _stop_on_signals() -> Iterator[None]:
    """Stop the machine even if this program is terminated by a signal."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {name: signal.signal(getattr(signal, name), interrupt) for name in names}
    if hasattr(signal, "SIGTSTP"):  # a suspended program cannot hold the machine
        before["SIGTSTP"] = signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    try:
        yield
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)


class Keys:
    """Calls `pressed` with each key while it is open, from its own thread; without a terminal, it does nothing."""

    def __init__(self, pressed: Callable[[str], None]) -> None:
        self.pressed = pressed
        self.terminal = sys.stdin is not None and sys.stdin.isatty()
        self._reading = threading.Event()
        self._closed = threading.Event()
        self._idle = threading.Event()
        self._before: Any = None

    def __enter__(self) -> Keys:
        if self.terminal:
            self._enter_key_mode()
            threading.Thread(target=self._read_keys, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self._leave_key_mode()

    @contextmanager
    def line_input(self) -> Iterator[None]:
        """Release the terminal, so that whole lines can be read."""
        if self.terminal:
            self._leave_key_mode()
            self._idle.wait(1.0)
        try:
            yield
        finally:
            if self.terminal:
                self._enter_key_mode()

    def _read_keys(self) -> None:
        while not self._closed.is_set():
            if not self._reading.is_set():
                self._idle.set()
                self._reading.wait(_LOOK_SECONDS)
                continue
            self._idle.clear()
            key = _poll_key()
            if key and self._reading.is_set():
                self.pressed(key)

    def _enter_key_mode(self) -> None:
        if os.name == "posix":
            import termios
            import tty

            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        self._reading.set()

    def _leave_key_mode(self) -> None:
        self._reading.clear()
        if self._before is not None:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)
            self._before = None


def _poll_key() -> str:
    """Return a pressed key, or "" after a short wait."""
    if os.name == "posix":
        import select

        ready, _, _ = select.select([sys.stdin], [], [], _LOOK_SECONDS)
        return os.read(sys.stdin.fileno(), 1).decode("ascii", "replace") if ready else ""
    import msvcrt
    import time

    if not msvcrt.kbhit():  # type: ignore[attr-defined,unused-ignore]
        time.sleep(_LOOK_SECONDS)
        return ""
    return str(msvcrt.getwch())  # type: ignore[attr-defined,unused-ignore]
