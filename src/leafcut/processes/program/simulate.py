"""Simulate a program and report its machine time, motion and dangers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.gcode.dialects import Dialect
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, heartbeat_for_step
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.simulation import Simulation
from leafcut.model.toolpath import Toolpath
from leafcut.options import Settings
from leafcut.processes.job import assumed_machine_note
from leafcut.processes.program.reading import controller_motion, read_file
from leafcut.read import Input
from leafcut.timing.grbl import SentLines, count_line_bytes_and_words
from leafcut.timing.toolpath import measure_toolpath, rows_waiting_for_serial_line

#: A warning appears only if at least this share of the program time is lost.
WORTH_TELLING = 0.01

#: Two delayed moves belong to the same stretch if at most this many lines separate them.
GAP = 20


def simulate(program: Input, settings: Settings, dialect: str | None, progress: OnProgress | None) -> Simulation:
    """Simulate a program on the machine in `settings`. Return its motion, time and dangers.

    The simulation is cancelled if `progress` raises an exception.
    """
    read = read_file(program, settings, dialect, heartbeat_for_step(progress, Message("reading")))
    _check_clearance_height(settings, read.dialect)
    run, unknown = controller_motion(read.program, read.dialect, settings.job.clearance_height)
    # `optimize` starts at X0 Y0 by default too.
    lines = count_line_bytes_and_words(read.program.lines)
    cost = measure_toolpath(run, read.machine, start=(0.0, 0.0), lines=lines)
    assumed = assumed_machine_note(settings, read.machine, read.issues)
    issues = (
        *read.find_dangers(),
        *read.issues,
        *assumed,
        *unknown,
        *_starvation_issue(run, read.machine, lines, cost.time_s),
    )
    path, told = read.program.path, settings.options_from_defaults()
    return Simulation(str(program), read.machine, read.dialect.name, path, run, cost, issues, told)


def _starvation_issue(path: Toolpath, machine: Machine, lines: SentLines, seconds: float) -> list[Issue]:
    """Return a warning if a GRBL board spends more than `WORTH_TELLING` of the program time waiting for lines."""
    rows, lost = rows_waiting_for_serial_line(path, machine, lines)
    if not lost.sum() > WORTH_TELLING * seconds:
        return []
    whole = float(lost.sum())
    first, last, most = _worst_stretch(path.line[rows], lost)
    message = Message(
        "the board receives and plans lines more slowly than it runs their short moves: {:.1f} s of "
        "{:.1f} s are lost, {:.1f} s of it in lines {} to {}; join short moves (arcs, a wider "
        "tolerance in the CAM) or lower the feed",
        whole,
        seconds,
        most,
        first,
        last,
    )
    return [Issue("L415", message, Message("line {}", first))]


def _worst_stretch(line: NDArray[np.int32], lost: NDArray[np.float64]) -> tuple[int, int, float]:
    """Return the range of lines that loses the most time: first line, last line, and lost seconds. See `GAP`."""
    ends = np.flatnonzero(np.diff(line) > GAP)
    begins = np.append(0, ends + 1)
    ends = np.append(ends, len(line) - 1)
    sums = np.add.reduceat(lost, begins)
    worst = int(np.argmax(sums))
    return int(line[begins[worst]]), int(line[ends[worst]]), float(sums[worst])


def _check_clearance_height(settings: Settings, program_dialect: Dialect) -> None:
    """Check that a clearance height is set only if the controller adds its own moves.

    Raises
    ------
    OptionError
        A clearance height is set, but the controller adds no moves.
    """
    if "clearance_height" in settings.asked and (
        program_dialect.torch is None or not program_dialect.torch.material_comment
    ):
        raise OptionError(
            "--clearance-height: a program for {} sets its own heights; leave it out", program_dialect.name
        )
