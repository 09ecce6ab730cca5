"""Texts about a run, such as its progress, its result, and the command that resumes it."""

from __future__ import annotations

from typing import Any

from leafcut.errors import count_of, shorten_message
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.sender.job import SendJob
from leafcut.sender.run import RunResult, RunView
from leafcut.units import format_time


def position_in_words(place: XYZ) -> str:
    """Format a position, such as ``X1.000 Y2.000 Z-0.500``."""
    return " ".join(f"{axis}{value:.3f}" for axis, value in zip("XYZ", place, strict=True))


def progress_in_words(view: RunView, job: SendJob) -> str:
    """Describe the progress of a program in one line for a terminal."""
    position = f"hole {view.hole}/{len(job.holes)}, line {view.line}" if job.holes else Message("line {}", view.line)
    place = "" if view.place is None else f"  {position_in_words(view.place)}"
    state = {"Hold": "ON HOLD", "Door": "DOOR OPEN"}.get(view.state, "")
    rest = f"{format_time(view.done_s)} done, {format_time(view.left_s)} left"
    return "  ".join(filter(None, [f"{state}", f"{position}{place}", f"F{view.feed:.0f} at {view.override} %", rest]))


def ending_in_words(ending: RunResult, job: SendJob) -> str:
    """Describe the result of a run in one line: reason, state, progress, and the command that resumes it."""
    lines = job.steps[-1].number
    if ending.complete:
        return Message("{}: all {} done; the machine is {}", job.file, count_of(lines, "line"), ending.state)
    parts = [ending.reason, ending.state if ending.lost else Message("the machine is {}", ending.state)]
    if ending.place is not None:
        parts.append(
            Message(
                "the position of the machine is {} ({})"
                if ending.homed
                else "the last known position of the machine is {} ({})",
                position_in_words(ending.place),
                ending.coordinates,
            )
        )
    if ending.line:
        line = Message(
            "the machine was in line {}" if ending.sure else "the machine was in or after line {}", ending.line
        )
        parts.append(Message("{}, hole {}", line, ending.hole.number) if ending.hole else line)
        parts.append(Message("lines up to {} of {} were accepted", ending.taken, lines))
        advice = (
            Message("resume with {}", ending.resume_option)
            if ending.resume_option
            else Message("start from the beginning")
        )
        parts.append(advice if ending.homed else Message("{} after homing, or after setting the position", advice))
    else:
        parts.append(Message("no line of the program was executed"))
    return shorten_message(Message.joined("; ", parts))


def ending_as_json(ending: RunResult, job: SendJob) -> dict[str, Any]:
    """Convert the result of a run to JSON data."""
    return {
        "program": job.file,
        "complete": ending.complete,
        "reason": ending.reason,
        "lines": job.steps[-1].number,
        "taken": ending.taken,
        "sent": ending.sent,
        "line": ending.line,
        "hole": None if ending.hole is None else ending.hole.number,
        "state": ending.state,
        "position_kept": ending.homed,
        "place": None if ending.place is None else list(ending.place),
        "go_on": ending.resume_option,
        "errors": [{"line": line, "error": text} for line, text in ending.errors],
    }
