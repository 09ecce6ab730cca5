"""A program that is ready to be sent to a machine, with its checked lines, its cycle times and its holes."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, ReadError, printable
from leafcut.files.whole_files import read_program
from leafcut.gcode.dialects import Dialect, load_dialect
from leafcut.gcode.languages import describe_unsupported_language
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.model.issue import CODES, Issue, Severity
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Kind
from leafcut.proof.dangers import find_dangers
from leafcut.read.machine import load_machine
from leafcut.sender.character_counting import SentLine
from leafcut.sender.firmware import conversation_class
from leafcut.sender.lines import DrilledHole, Pause, SentStep, convert_to_dialect, steps_from_lines
from leafcut.timing.grbl import count_line_bytes_and_words
from leafcut.timing.toolpath import time_rows

#: Codes of issues that require --accept at any severity, because they are dangerous, exceed a limit, or have an unknown
#: effect.
_NEVER = ("L803", "L806", "L808")
#: Kinds of rows after which lines cannot be checked. They move the origin, or only the machine knows their effect.
_LOST = {
    Kind.FOREIGN: Message("is not understood"),
    Kind.SHIFT: Message("moves the origin, so later lines cannot be checked"),
}
#: Modes that the program reader assumes at the start of a program, and words for its default units.
_AT_FIRST = "G17 G90 G94 G40 G49 G80"
_UNITS = {"mm": "G21", "in": "G20"}
#: Tolerance for equal positions, mm.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class SendJob:
    """A program that was read for a machine and its dialect.

    Attributes
    ----------
    machine, dialect
        The machine, and the dialect of its controller.
    steps
        The lines and pauses to send.
    issues
        Warnings for the operator.
    accept
        Codes of issues that do not prevent sending.
    """

    file: str
    machine: Machine
    dialect: Dialect
    program: Program
    steps: tuple[SentStep, ...]
    issues: tuple[Issue, ...] = ()
    accept: tuple[str, ...] = ()

    @property
    def is_laser(self) -> bool:
        """Whether the machine is a laser."""
        return self.machine.head is Head.LASER

    @cached_property
    def holes(self) -> tuple[DrilledHole, ...]:
        """The holes of the program. Repeated plunges (pecks) at the same position count as one hole.

        A hole is a vertical plunge at feed rate that follows a rapid, unless a sideways cut comes next.
        """
        return tuple(_find_holes(self.program))

    @cached_property
    def seconds_by_line(self) -> tuple[Floats, Floats]:
        """Cutting time and other time of each line, s. Both are float64[lines + 1], indexed by line number."""
        timed = time_rows(self.program.path, self.machine, count_line_bytes_and_words(self.program.lines))
        at_feed = (timed.path.kind >= Kind.FEED) & (timed.path.kind <= Kind.ARC_CCW)
        lines = np.clip(timed.path.line, 0, len(self.program.lines))
        count = len(self.program.lines) + 1
        per_line = [
            np.bincount(lines, weights=np.where(rows, timed.seconds, 0.0), minlength=count).astype(np.float64)
            for rows in (at_feed, ~at_feed)
        ]
        return per_line[0], per_line[1]

    def for_machine(self, machine: Machine) -> SendJob:
        """Return the same program for a different machine. The cycle times change accordingly."""
        return replace(self, machine=machine)

    def hole_at_line(self, line: int) -> DrilledHole | None:
        """Return the last hole that starts at or before a line, or None if the line is before the first hole."""
        latest = None
        for hole in self.holes:
            if hole.first > line:
                break
            latest = hole
        return latest

    def line_text(self, line: int) -> str:
        """Return a line of the program, shortened to fit into a message."""
        lines = self.program.lines
        return printable(lines[line - 1].strip()) if 0 < line <= len(lines) else ""


def read_job(
    file: str,
    machine: str,
    *,
    dialect_name: str | None = None,
    units: str | None = None,
    accept: Collection[str] = (),
) -> SendJob:
    """Read a program for a machine and run all checks that do not need the machine itself.

    Issues with a code in `accept` do not prevent sending.

    Raises
    ------
    ReadError
        The program cannot be read, or leafcut does not understand a line. Also raised if a line moves the origin or
        uses a command that this controller lacks.
    OptionError
        leafcut cannot send to this controller, or the program has a danger that was not accepted.
    """
    known = load_machine(machine)
    controller_dialect = load_dialect(dialect_name or known.controller)
    conversation_class(known, machine)
    return job_from_text(read_program_text(file, file), file, known, controller_dialect, units, accept)


def read_program_text(file: str | Path, name: str) -> str:
    """Read the text of a program. Raises `ReadError`, which mentions `name`, if the file is not readable G-code."""
    text = read_program(file)
    if problem := describe_unsupported_language(text):
        raise ReadError(name, problem)
    return text


def parse_accepted_codes(words: str) -> tuple[str, ...]:
    """Parse a list of issue codes, such as ``L801,L806``. Raises `OptionError` if a code is unknown."""
    codes = tuple(entry.strip().upper() for entry in words.split(",") if entry.strip())
    for code in codes:
        if code not in CODES:
            raise OptionError("--accept: '{}' is not an issue code such as L801", code)
    return codes


def job_from_text(
    text: str, file: str, machine: Machine, controller_dialect: Dialect, units: str | None, accept: Collection[str] = ()
) -> SendJob:
    """Create a job from the text of a program (see `read_job`)."""
    program = interpret_program(text, controller_dialect, file, units=units or machine.units)
    steps = (
        *_mode_setting_lines(program, controller_dialect, units or machine.units),
        *steps_from_lines(program.lines, controller_dialect, file),
    )
    _check_known_positions(program, file)
    dangers = find_dangers(program, machine, "laser" if machine.head is Head.LASER else "mill")
    for issue in dangers:
        if (issue.severity is Severity.DANGER or issue.code in _NEVER) and issue.code not in accept:
            raise OptionError("{} is not sent: {}; if that is right, add --accept {}", file, issue, issue.code)
    issues = list(dangers)
    if program.assumed_units:
        name = {"mm": "mm", "in": Message("inches")}[units or machine.units]
        issues.append(
            Issue("L102", Message("the program does not state its units (G20 or G21) and is read in {}", name))
        )
    if not (program.path.kind <= Kind.ARC_CCW).any():
        raise ReadError(file, "the program has no moves")
    return SendJob(file, machine, controller_dialect, program, steps, tuple(issues), tuple(accept))


def _mode_setting_lines(program: Program, controller_dialect: Dialect, units: str) -> list[SentLine]:
    if not convert_to_dialect(controller_dialect, _UNITS[units]):
        raise OptionError("{} has no {}; write the program in millimetres", controller_dialect.name, _UNITS[units])
    blocks = [_AT_FIRST, "G54", _UNITS[units]]
    # A program that never starts the spindle relies on a spindle started by hand.
    if ((program.path.kind == Kind.SPINDLE) & (program.path.value != 0.0)).any():
        blocks += ["M5", "M9"]
    return [SentLine(text) for text in convert_to_dialect(controller_dialect, *blocks)]


def _check_known_positions(program: Program, file: str) -> None:
    path = program.path
    for kind, reason in _LOST.items():
        rows = np.flatnonzero(path.kind == kind)
        if len(rows):
            line = int(path.line[rows[0]])
            block = int(program.row_block[rows[0]])
            explanation = program.fixed.get(block, "") or f"'{program.lines[line - 1].strip()}' {reason}"
            raise ReadError(file, Message("{}; remove it, and send again", explanation), line)


def _find_holes(program: Program) -> list[DrilledHole]:
    path, before = program.path, program.path.before
    down = (path.kind == Kind.FEED) & (path.end[:, 2] < before[:, 2] - _SAME)
    down &= (np.abs(path.end[:, :2] - before[:, :2]) < _SAME).all(axis=1)
    sideways: NDArray[np.bool_] = (path.kind <= Kind.ARC_CCW) & ~(
        (np.abs(path.end[:, :2] - before[:, :2]) < _SAME).all(axis=1)
    )
    holes: list[DrilledHole] = []
    travel, cut = -1, False
    for row in np.flatnonzero(down | sideways).tolist():
        line = int(path.line[row])
        if sideways[row]:
            if cut and path.kind[row] != Kind.RAPID:
                holes.pop()  # a sideways cut follows: milling, not drilling
            travel, cut = (row if path.kind[row] == Kind.RAPID else -1), False
        elif cut:
            holes[-1] = replace(holes[-1], last=line)
        elif travel >= 0:
            x, y, _ = path.end[row].tolist()
            holes.append(DrilledHole(len(holes) + 1, x, y, int(path.line[travel]), line))
            cut = True
    return holes


def tools_after_line(job: SendJob, line: int = 0) -> list[str | None]:
    """Return the tools for the cuts after a line, in order of use, such as ``T1 drill 3 mm``.

    A tool that the program does not name is None.
    """
    path = job.program.path
    cuts = path.line[(path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW) & (path.line >= line)]
    first = int(cuts.min()) if len(cuts) else line
    changes = [step for step in job.steps if isinstance(step, Pause) and step.change]
    earlier = [_tool_name(change) for change in changes if change.number <= first]
    return [earlier[-1] if earlier else None, *(_tool_name(change) for change in changes if change.number > first)]


def _tool_name(change: Pause) -> str | None:
    name = f"T{change.tool}"
    if change.tool is None or change.remark.upper().startswith(name):
        return change.remark or None
    return f"{name} ({change.remark})" if change.remark else name


def issues_except_notes(issues: Sequence[Issue]) -> list[Issue]:
    """Return all issues except notes. The operator must see these issues before the start."""
    return [issue for issue in issues if issue.severity is not Severity.NOTE]
