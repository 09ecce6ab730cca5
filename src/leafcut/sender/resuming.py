"""Resumes a program at a line after an interruption, and restores the state that the program has at that line.

The tool rises to the greatest height in the program and moves above its position. The spindle starts, and the tool
descends. The descent is a rapid only if the program itself uses a rapid at that height. Otherwise, the tool descends at
the feed of the program. leafcut reads the lines to send again and checks that their moves match the remaining moves of
the program.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from leafcut.errors import OptionError, count_of
from leafcut.gcode.program import Modal
from leafcut.gcode.words import parse_words, split_line
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.sender.character_counting import SentLine
from leafcut.sender.controller_facts import Facts
from leafcut.sender.job import SendJob, job_from_text
from leafcut.sender.lines import SentStep, convert_to_dialect, dwell_command, steps_from_lines

#: Number of decimals for a position in mm. A board with fine steps resolves 0.001 mm.
_DECIMALS = 4
_SPINDLE = {1: "M3", -1: "M4"}
_COOLANT = {0: [], 1: ["M7"], 2: ["M8"], 3: ["M7", "M8"]}
#: Tolerance for rounded output, mm.
_TOLERANCE = 2e-4


def first_line_of_hole(job: SendJob, number: int) -> int:
    """Return the first line of a hole. Holes are numbered from 1 in program order.

    Raises `OptionError` if the hole does not exist.
    """
    if not 1 <= number <= len(job.holes):
        have = count_of(len(job.holes), "hole") if job.holes else Message("no holes; use --from-line instead")
        raise OptionError("--from-hole {}: the program has {}", number, have)
    return job.holes[number - 1].first


def refuse_hole_and_line(from_hole: int | None, from_line: int | None) -> None:
    """Raise `OptionError` if both a hole and a line are given."""
    if from_hole is not None and from_line is not None:
        raise OptionError("--from-hole and --from-line both set the line to resume at; leave one out")


def steps_to_send(
    job: SendJob, facts: Facts, from_hole: int | None, from_line: int | None
) -> tuple[int, Sequence[SentStep], int | None]:
    """Return the steps that run a program from a hole or a line.

    Without a hole or a line, the program runs from the start.

    Returns
    -------
    tuple[int, Sequence[SentStep], int | None]
        The line at which the program resumes (0 for the start), the steps to send, and the tool that must be in the
        spindle, or None if the program does not name the tool.

    Raises
    ------
    OptionError
        Both a hole and a line are given, the hole or line does not exist, or the program cannot resume there.
    """
    refuse_hole_and_line(from_hole, from_line)
    if from_hole is None and from_line is None:
        return 0, job.steps, None
    line = first_line_of_hole(job, from_hole) if from_hole is not None else int(from_line or 0)
    if line < 1:
        raise OptionError("--from-line {}: lines are counted from 1", line)
    place = facts.machine_position()
    steps, tool = resuming_steps(job, line, None if place is None else place[2] - facts.work_zero(540)[2])
    return line, steps, tool


def resuming_steps(job: SendJob, line: int, height: float | None = None) -> tuple[tuple[SentStep, ...], int | None]:
    """Return the steps that resume a program at a line.

    `height` is the current Z of the tool in program coordinates, mm. The tool does not descend until it is above its
    position.

    Returns
    -------
    tuple[tuple[SentStep, ...], int | None]
        The steps to send, and the tool that must be in the spindle, or None if the program does not name the tool.

    Raises
    ------
    OptionError
        No block follows, or the state at the line is unknown. The message contains the reason.
    """
    program = job.program
    blocks = np.flatnonzero(program.line >= line)
    if not len(blocks):
        raise OptionError("--from-line {}: the program ends in line {}", line, int(program.line[-1]))
    block = int(blocks[0])
    first = int(program.line[block])
    modal, row = program.modal(block), int(program.first[block])
    path = program.path
    place = _position_before(job, row, first)
    lead = convert_to_dialect(job.dialect, *_state_restoring_lines(job, modal, path, row, place, height))
    rest = steps_from_lines(program.lines, job.dialect, job.file, first)
    rest = add_motion_mode_to_first_move(rest, modal.motion)
    _check_resumed_moves(job, lead, rest, row, first)
    return (*(SentLine(text) for text in lead), *rest), modal.next_tool if modal.tool is None else modal.tool


def _position_before(job: SendJob, row: int, line: int) -> XYZ:
    """Return the tool position before a row in program coordinates, mm. Z is 0 for a laser that never moves Z.

    Raises `OptionError` if the position is unknown, or if there is nothing left to do.
    """
    path = job.program.path
    if row >= len(path):
        raise OptionError("--from-line {}: no work remains after this line", line)
    x, y, z = path.before[row].tolist()
    never_moves_z = not np.isfinite(path.end[path.kind <= Kind.ARC_CCW, 2]).any()
    if never_moves_z:
        z = 0.0
    if not all(math.isfinite(v) for v in (x, y, z)):
        hole = next((hole for hole in job.holes if hole.first > line), None)
        advice = (
            Message("; resume from line {} (--from-hole {})", hole.first, hole.number)
            if hole
            else Message("; start from the first line")
        )
        raise OptionError("--from-line {}: the tool position before this line is not known{}", line, advice)
    return x, y, z


def _state_restoring_lines(
    job: SendJob, modal: Modal, path: Toolpath, row: int, place: XYZ, height: float | None
) -> list[str]:
    """Return the lines that restore the state and the position of the machine before a block.

    Raises `OptionError` if this is impossible because of inverse time feed (G93), unknown units, or a missing feed for
    the descent.
    """
    if modal.feed_mode != 94:
        raise OptionError(
            "G93 gives each move a time, so the program cannot be resumed there; start from the first line"
        )
    if modal.unit is None:
        raise OptionError("the program has not set its units there; start from the first line")
    x, y, z = place
    heights = path.end[np.isin(path.kind, (Kind.RAPID, Kind.FEED)), 2]
    known = heights[np.isfinite(heights)]
    lines = ["M5", "M9", "G21 G90 G94 G17 G40 G49", f"G{modal.frame / 10:g}"]
    if len(known):
        top = max(float(known.max()), z if height is None else height)
        lines.append(f"G0 Z{format_without_trailing_zeros(top)}{_rapid_feed_word(job, 'Z')}")
    lines.append(
        f"G0 X{format_without_trailing_zeros(x)} Y{format_without_trailing_zeros(y)}{_rapid_feed_word(job, 'XY')}"
    )
    lines += _COOLANT[modal.coolant]
    spindle = f"{_SPINDLE[modal.spindle]} S{modal.rpm:g}" if modal.spindle else f"S{modal.rpm:g}"
    if not job.is_laser:
        lines.append(spindle)
        if modal.spindle and job.machine.spindle_start_s:
            lines.append(dwell_command(job.dialect, job.machine.spindle_start_s))
    if len(known):
        lines.append(_descent_line(job, modal, row, z))
    # From here on, the lines are in the units and modes of the program.
    lines += _units_and_feed_lines(modal)
    lines.append(f"G{modal.plane} G{91 if modal.incremental else 90}")
    if job.is_laser:
        lines.append(spindle)
    return [line for line in lines if line]


def _rapid_feed_word(job: SendJob, axes: str) -> str:
    if not job.dialect.rapid_feed:
        return ""
    return (
        f" F{format_without_trailing_zeros(60.0 * min(job.machine.rapid_velocity['XYZ'.index(axis)] for axis in axes))}"
    )


def _descent_line(job: SendJob, modal: Modal, row: int, z: float) -> str:
    path = job.program.path
    before = path.before[row]
    moves = np.flatnonzero(path.kind[row:] <= Kind.ARC_CCW)
    travels = False
    if len(moves):
        first = row + int(moves[0])
        sideways = bool(np.isfinite(path.end[first, :2]).all() and (path.end[first, :2] != before[:2]).any())
        travels = path.kind[first] == Kind.RAPID and (sideways or bool(path.end[first, 2] > z))
        travels &= sideways or _arrived_by_rapid(path, row)
    if travels:
        return f"G0 Z{format_without_trailing_zeros(z)}{_rapid_feed_word(job, 'Z')}"
    feed = modal.feed * (modal.unit or 1.0)
    if not feed:
        fed = path.value[(path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)]
        feed = float(fed.min()) * 60.0 if len(fed) else 0.0
    if not feed:
        raise OptionError("the program has no feed rate for the plunge at that line; start from the first line")
    return f"G1 Z{format_without_trailing_zeros(z)} F{format_without_trailing_zeros(feed)}"


def _arrived_by_rapid(path: Toolpath, row: int) -> bool:
    """Return whether the last move before a row is a rapid up or sideways. Such a rapid ends clear of the material."""
    moves = np.flatnonzero(path.kind[:row] <= Kind.ARC_CCW)
    if not len(moves):
        return False
    last = int(moves[-1])
    return bool(path.kind[last] == Kind.RAPID and not path.end[last, 2] < path.before[last, 2])


def format_without_trailing_zeros(value: float) -> str:
    """Format a length in mm or a feed in mm/min without trailing zeros."""
    text = f"{value:.{_DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def mode_restoring_lines(job: SendJob, line: int) -> tuple[int | None, list[SentLine]]:
    """Return the motion mode before a line, and the lines that restore the spindle and all other modes."""
    modal = _modal_state_before(job, line)
    words = [f"G{modal.plane} G{91 if modal.incremental else 90} G94 G40 G49", f"G{modal.frame / 10:g}"]
    words += _units_and_feed_lines(modal)
    lines = [SentLine(text) for text in convert_to_dialect(job.dialect, *words)]
    return modal.motion, [*lines, *spindle_restoring_lines(job, line)]


def _units_and_feed_lines(modal: Modal) -> list[str]:
    """Return the units and the feed on two lines. On a common line, the unit of F would be ambiguous."""
    if modal.unit is None:
        return []
    return [f"G{21 if modal.unit == 1.0 else 20}", *[f"F{modal.feed:.10g}"] * bool(modal.feed)]


def spindle_restoring_lines(job: SendJob, line: int) -> list[SentLine]:
    """Return the lines that start the spindle, if the spindle is on before a line of the program."""
    modal = _modal_state_before(job, line)
    if not modal.spindle:
        return []
    blocks = [f"{_SPINDLE[modal.spindle]} S{modal.rpm:g}"]
    if job.machine.spindle_start_s:
        blocks.append(dwell_command(job.dialect, job.machine.spindle_start_s))
    return [SentLine(text) for text in convert_to_dialect(job.dialect, *blocks)]


def _modal_state_before(job: SendJob, line: int) -> Modal:
    block = int(np.searchsorted(job.program.line, line))
    return job.program.modal(min(block, job.program.n_blocks))


def add_motion_mode_to_first_move(rest: list[SentStep], motion: int | None) -> list[SentStep]:
    """Add the active motion mode (G0 to G3) to the first move that does not have one."""
    done = list(rest)
    for k, step in enumerate(rest):
        if not isinstance(step, SentLine):
            continue
        words = parse_words(split_line(step.text)[0])
        codes = {round(word.value * 10) for word in words if word.letter == "G"}
        if codes & {0, 10, 20, 30}:
            break
        if codes & {40, 280, 300, 530}:
            continue
        if any(word.letter in "XYZ" for word in words):
            if motion is None:
                raise OptionError(
                    "line {} moves, and no motion (G0 to G3) is active; start from the first line", step.number
                )
            done[k] = SentLine(f"G{motion}{step.text}", step.number)
            break
    return done


def _check_resumed_moves(job: SendJob, lead: list[str], rest: list[SentStep], row: int, line: int) -> None:
    """Read the lines to send again.

    Raises `OptionError` if their moves differ from the remaining moves of the program.
    """
    texts = [*lead, *(step.text for step in rest if isinstance(step, SentLine))]
    resumed = job_from_text("\n".join(texts) + "\n", job.file, job.machine, job.dialect, None, _EVERY)
    original_path, resumed_path = job.program.path, resumed.program.path
    kept_rows = [k for k in range(row, len(original_path)) if original_path.kind[k] not in (Kind.PAUSE, Kind.TOOL)]
    resumed_rows = (
        [k for k in range(len(resumed_path)) if resumed_path.kind[k] not in (Kind.PAUSE, Kind.TOOL)][-len(kept_rows) :]
        if kept_rows
        else []
    )
    same = len(resumed_rows) == len(kept_rows) and all(
        original_path.kind[a] == resumed_path.kind[b]
        and np.allclose(original_path.end[a], resumed_path.end[b], atol=_TOLERANCE, rtol=0.0, equal_nan=True)
        and abs(original_path.value[a] - resumed_path.value[b]) <= 1e-6 * max(1.0, abs(original_path.value[a]))
        and np.allclose(original_path.before[a], resumed_path.before[b], atol=_TOLERANCE, rtol=0.0, equal_nan=True)
        for a, b in zip(kept_rows, resumed_rows, strict=True)
    )
    if not same:
        raise OptionError("--from-line {}: the program cannot be resumed there exactly; choose an earlier line", line)


#: Codes of dangers that were already checked when the program was first read.
_EVERY = ("L801", "L802", "L803", "L804", "L805", "L806", "L807", "L808")
