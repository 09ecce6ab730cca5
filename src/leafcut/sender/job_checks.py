"""Checks whether the machine can run a program in its current state (mode, homing, travel and speeds)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leafcut.errors import SendError
from leafcut.gcode.words import parse_words, split_line
from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.model.cycles import expand_cycles
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import MOTIONS, PLACES, Kind, Toolpath, arc_extremes, latest_marked_rows
from leafcut.proof.clearance import rapid_height_checks
from leafcut.sender.controller_facts import Facts
from leafcut.sender.conversation import LOCKED
from leafcut.sender.error_texts import state_in_words
from leafcut.sender.job import SendJob

#: Tolerance for rounded positions, mm.
_TOLERANCE = 0.005
#: A setting is reported if it differs by more than this relative amount between the profile and the controller.
_MAX_DIFFERENCE = 0.01


#: Rules in `rapid_height_checks`, with the code that accepts a violation.
_CODES = {"rapid below clearance": "L801", "rapid into the part": "L802"}

#: States that only the operator can end.
_STANDING = ("Check", "Hold", "Door")

_UNSURE = Message("the controller does not report whether it was homed, and does not require homing")


def check_machine_ready(facts: Facts, *, unhomed: bool, restarted: bool = False, family: str = "") -> None:
    """Check that the machine is idle and its position is known.

    Parameters
    ----------
    facts
        Values that the controller has reported.
    unhomed
        Whether the operator has confirmed the position of a machine that was not homed.
    restarted
        Whether the board has just restarted. Its position is then wrong until the machine is homed.
    family
        The firmware, which determines the list of alarms.

    Raises
    ------
    SendError
        The machine is not ready. The message contains the state and a remedy.
    """
    state = state_in_words(facts.status, family)
    if facts.status.state == "Alarm":
        if facts.homing:
            raise SendError("the machine is {}; home it with --home", state)
        raise SendError("the machine is {}; unlock it with --unlock", state)
    if facts.status.state == "Sleep":
        raise SendError("the machine is {}; wake it with --unlock", state)
    if facts.status.state in LOCKED:
        raise SendError("the machine is {}", state)
    if facts.status.state in _STANDING:
        raise SendError("the machine is {}; reset it with --unlock", state)
    if facts.status.state != "Idle":
        raise SendError("the machine is {}; wait until it has stopped, or reset it with --unlock", state)
    if facts.status.pins and set(facts.status.pins) & set("XYZ"):
        raise SendError("a limit switch is pressed ({}); move the machine away from it", facts.status.pins)
    if not facts.homing and not unhomed:
        raise SendError(
            "homing is off ({}), so the machine does not know its position and does not enforce its travel; "
            "set its zero by hand and add --unhomed, or turn homing on",
            facts.names.homing,
        )
    if facts.homing and not facts.homed and not unhomed:
        reason = Message("the controller reports that it was not homed") if facts.homed is False else _UNSURE
        raise SendError("{}; add --home, or set its zero by hand and add --unhomed", reason)
    if not facts.has_valid_coordinates and restarted:
        raise SendError(
            "the board restarted when its port was opened, and lost its position; move the tool to the "
            "program's zero by hand, and add --zero-here"
        )


def check_program(job: SendJob, facts: Facts, *, unhomed: bool, begun: bool = False) -> list[Issue]:
    """Check whether the machine can run the program in its current state, and return any warnings.

    Set `begun` if the program is at a pause. Its first move was already checked in this case. Raises `SendError`, which
    mentions the line, if the machine cannot run the program.
    """
    if job.is_laser != facts.laser_mode:
        name = facts.names.laser
        raise SendError(
            "laser mode is off ({}=0), but the program is for a laser; set {}, or name the right --machine"
            if job.is_laser
            else "laser mode is on ({}=1), but the program is for a spindle; set {}, or name the right --machine",
            name,
            name,
        )
    arcs = np.flatnonzero(np.isin(job.program.path.kind, (Kind.ARC_CW, Kind.ARC_CCW)))
    if len(arcs) and not facts.arcs:
        line = int(job.program.path.line[arcs[0]])
        raise SendError(
            "the firmware has no arcs (ARC_SUPPORT), but line {} is an arc; post the program without arcs", line
        )
    _check_spindle_speeds(job, facts)
    _check_travel(job, facts, unhomed=unhomed and not facts.has_valid_coordinates)
    if not job.is_laser:
        path = replace_machine_moves(job, facts)
        if not begun and "L805" not in job.accept:
            _check_start_height(job, facts, path)
        _check_rapid_heights(job, facts, path)
    return _profile_difference_issues(job, facts)


def _check_spindle_speeds(job: SendJob, facts: Facts) -> None:
    path = job.program.path
    rows = np.flatnonzero((path.kind == Kind.SPINDLE) & (np.abs(path.value) > facts.fastest + 0.5))
    if len(rows):
        row = int(rows[0])
        limit = f"{facts.names.fastest}={facts.fastest:g}"
        problem = Message(
            "S{:g} in line {} is above the controller's {}", abs(path.value[row]), int(path.line[row]), limit
        )
        raise SendError("{}; is this program for another machine?", problem)
    if not job.is_laser and _current_spindle_speed(facts) == 0.0:
        _check_spindle(job)


def _current_spindle_speed(facts: Facts) -> float | None:
    return next((float(word[1:]) for word in facts.modes if word.startswith("S")), None)


def _check_spindle(job: SendJob) -> None:
    """Raise `SendError` if the spindle starts without a speed before a cut. The controller would use S0."""
    program = job.program
    path = program.path
    cuts = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW))
    starts = latest_marked_rows(path.kind == Kind.SPINDLE)[cuts]
    for start in np.unique(starts[starts >= 0]).tolist():
        block = int(program.row_block[start])
        if path.value[start] == 0.0 and program.modal(block + 1).spindle:
            cut = int(cuts[np.argmax(starts == start)])
            raise SendError(
                "line {} starts the spindle without a speed, the controller's is S0, and line "
                "{} cuts; add S to line {}",
                int(path.line[start]),
                int(path.line[cut]),
                int(path.line[start]),
            )


def positions_on_machine(job: SendJob, facts: Facts, *, fed: bool = False) -> tuple[Floats, Floats]:
    """Return the positions that the program reaches in machine coordinates.

    Set `fed` to select only the start points, end points and arc extremes of feed moves.

    Returns
    -------
    tuple[Floats, Floats]
        Positions as float64[n, 3] in mm, with NaN for unknown coordinates, and the line of each position.
    """
    path = job.program.path
    frames = path.latest(Kind.FRAME, path.ref, 540)
    places, lines = [np.zeros((0, 3))], [np.zeros(0)]
    for frame in np.unique(frames).tolist():
        zero = np.array(facts.work_zero(int(frame)))
        moving = (frames == frame) & np.isin(path.kind, [int(k) for k in MOTIONS if not (fed and k is Kind.RAPID)])
        for ends in (path.end, path.before) if fed else (path.end,):
            places.append(ends[moving] + zero)
            lines.append(path.line[moving].astype(np.float64))
        for row in np.flatnonzero((frames == frame) & np.isin(path.kind, (Kind.ARC_CW, Kind.ARC_CCW))).tolist():
            extremes = known_arc_extremes(path, row)
            if extremes:
                places.append(np.array(extremes) + zero)
                lines.append(np.full(len(extremes), float(path.line[row])))
    if not fed:
        rows = np.flatnonzero(path.kind == Kind.MACHINE)
        places += [_end_in_machine_coordinates(job, facts, path, row).reshape(1, 3) for row in rows.tolist()]
        lines.append(path.line[rows].astype(np.float64))
    return np.concatenate(places), np.concatenate(lines)


def _stored_position_word(job: SendJob, line: int) -> str | None:
    words = parse_words(split_line(job.program.lines[line - 1].strip(), nested=True)[0].removeprefix("/"))
    codes = {round(word.value * 10) for word in words if word.letter == "G"}
    return "G28" if 280 in codes else "G30" if 300 in codes else None


def _end_in_machine_coordinates(job: SendJob, facts: Facts, path: Toolpath, row: int) -> Floats:
    """Return the end of a move in machine coordinates, float64[3] mm. An axis that does not move is NaN.

    Raises `SendError` if the move goes to a stored position that the controller does not report.
    """
    place: Floats = path.end[row]
    line = int(path.line[row])
    name = _stored_position_word(job, line)
    if name is None:
        return place
    if name not in facts.places:
        raise SendError(
            "line {} goes to the position stored for {}, and the controller does not report that "
            "position ($#); remove the line",
            line,
            name,
        )
    end: Floats = np.where(np.isfinite(place), np.array(facts.places[name]), place)
    return end


def replace_machine_moves(job: SendJob, facts: Facts) -> Toolpath:
    """Replace moves in machine coordinates (G28, G30, G53) with rapids in program coordinates.

    The program alone does not determine where such a move ends. This depends on the origins and stored positions of the
    machine. Raises `SendError` if the controller does not report a stored position that the program uses.
    """
    path = expand_cycles(job.program.path)
    in_machine = path.kind == Kind.MACHINE
    if not in_machine.any():
        return path
    frames = path.latest(Kind.FRAME, path.ref, 540)
    zeros = np.zeros((len(path), 3))
    for frame in np.unique(frames).tolist():
        zeros[frames == frame] = facts.work_zero(int(frame))
    placed = np.isin(path.kind, [int(kind) for kind in PLACES]) | in_machine
    ends = np.where(placed[:, None], path.end + zeros, np.nan)
    for row in np.flatnonzero(in_machine).tolist():
        ends[row] = _end_in_machine_coordinates(job, facts, path, row)
    for axis in range(3):
        # A change of the work offset moves no axis. The height at which a probe stops is unknown in advance.
        lost = (path.kind == Kind.PROBE) & (axis == 2)
        last = latest_marked_rows(np.isfinite(ends[:, axis]) & ~lost | lost)
        ends[:, axis] = np.where(last >= 0, np.where(lost, np.nan, ends[:, axis])[last], np.nan)
    return replace(
        path,
        kind=np.where(in_machine, int(Kind.RAPID), path.kind).astype(path.kind.dtype),
        end=np.where(placed[:, None], ends - zeros, path.end),
    )


def _check_rapid_heights(job: SendJob, facts: Facts, path: Toolpath) -> None:
    """Raise `SendError` if a move in machine coordinates leads to a rapid below the surface.

    `find_dangers` has already checked all other rapids, because their heights do not depend on the machine.
    """
    original = expand_cycles(job.program.path)
    moved = original.kind == Kind.MACHINE
    if not moved.any():
        return
    before = path.before
    unseen = moved | (np.isnan(original.before[:, 2]) & np.isfinite(before[:, 2]))
    checks = rapid_height_checks(path, 0.0, -np.inf, milled=False)
    low = [
        (int(row), code)
        for danger, mask, _ in checks
        if (code := _CODES.get(danger)) is not None and code not in job.accept
        for row in np.flatnonzero(mask & unseen)[:1]
    ]
    if low:
        row, code = min(low)
        line, height = int(original.line[row]), float(np.fmin(before[row, 2], path.end[row, 2]))
        raise SendError(
            "line {} '{}' is a rapid at Z{:.3f}, below the surface of the part: {}; if that is right, add --accept {}",
            line,
            job.line_text(line),
            height,
            _cause_of_low_height(job, facts, original, row),
            code,
        )


def _cause_of_low_height(job: SendJob, facts: Facts, path: Toolpath, row: int) -> Message:
    """Explain why a rapid is too low.

    The cause is the last move in machine coordinates, the stored position that it uses, or the work zero.
    """
    at = int(np.flatnonzero(path.kind[: row + 1] == Kind.MACHINE)[-1])
    line = int(path.line[at])
    zero = facts.work_zero(int(path.latest(Kind.FRAME, path.ref, 540)[at]))[2]
    name = _stored_position_word(job, line)
    if name is None:
        cause = Message("the work zero is at Z{:.3f} in machine coordinates; choose a higher position", zero)
    else:
        cause = _stored_position_cause(name, facts, zero, line)
    return cause if at == row else Message("line {} left the tool there, {}", line, cause)


def _stored_position_cause(name: str, facts: Facts, zero: float, line: int) -> Message:
    return Message(
        "the position stored for {} is Z{:.3f} in machine coordinates ($#), the work "
        "zero is at Z{:.3f}; store a position above the part ({}.1), or remove line {}",
        name,
        facts.places[name][2],
        zero,
        name,
        line,
    )


def known_arc_extremes(path: Toolpath, row: int) -> list[XYZ]:
    """Return the extreme points of an arc in program coordinates, mm.

    The list is empty if the start of the arc is unknown.
    """
    try:
        return [(x, y, z) for x, y, z in arc_extremes(path, row)]
    except ValueError:
        return []


def _check_travel(job: SendJob, facts: Facts, *, unhomed: bool) -> None:
    """Raise `SendError` if the program leaves the travel of the machine.

    If the machine was not homed, the program must not be larger than the travel.
    """
    places, lines = positions_on_machine(job, facts)
    low, high = facts.travel_limits()
    for axis, name in enumerate("XYZ"):
        values = places[:, axis]
        known = np.isfinite(values)
        if not known.any():
            continue
        lowest, highest = float(values[known].min()), float(values[known].max())
        if unhomed:
            if highest - lowest > high[axis] - low[axis] + _TOLERANCE:
                raise SendError(
                    "the program needs {:.3f} mm in {}, but the machine's travel is "
                    "{:.3f} mm ({}); is this program "
                    "for another machine?",
                    highest - lowest,
                    name,
                    high[axis] - low[axis],
                    facts.names.travel[axis],
                )
            continue
        outside = known & ((values < low[axis] - _TOLERANCE) | (values > high[axis] + _TOLERANCE))
        if outside.any():
            first = np.flatnonzero(outside)[np.argmin(lines[outside])]
            zero = facts.work_zero(540)[axis]
            raise SendError(
                "line {} goes to {} {:.3f} mm in {}, outside "
                "the travel of {:g} to {:g} mm ({}); the work zero is at "
                "{:.3f}: set it again, or move the part",
                int(lines[first]),
                name,
                values[first],
                facts.names.coordinates,
                low[axis],
                high[axis],
                facts.names.travel[axis],
                zero,
            )


def _check_start_height(job: SendJob, facts: Facts, path: Toolpath) -> None:
    """Raise `SendError` if the tool starts too low.

    This is the case if the first move is sideways while the tool is below the greatest Z of the program.
    """
    place = facts.machine_position()
    program_path = expand_cycles(job.program.path)
    heights = program_path.end[np.isin(program_path.kind, (Kind.RAPID, Kind.FEED)), 2]
    known = heights[np.isfinite(heights)]
    if not len(known) or place is None:
        return
    # G28 moves all axes at once, starting at the current height of the tool.
    unknown = np.isnan(path.end[:, 2]) | (np.isnan(path.before[:, 2]) & (program_path.kind == Kind.MACHINE))
    sideways = (path.kind <= Kind.ARC_CCW) & np.isfinite(path.end[:, :2]).any(axis=1) & unknown
    rows = np.flatnonzero(sideways)
    if not len(rows):
        return
    z = place[2] - facts.work_zero(540)[2]
    if z < float(known.max()) - _TOLERANCE:
        raise SendError(
            "line {} moves in X or Y before the program sets a height, and the tool is at "
            "Z{:.3f}, below the program's highest, Z{:.3f}; raise it first, or add --accept L805",
            int(path.line[rows[0]]),
            z,
            float(known.max()),
        )


def _profile_difference_issues(job: SendJob, facts: Facts) -> list[Issue]:
    profile, timed = job.machine, facts.machine_with_settings(job.machine)
    low, high = facts.travel_limits()
    names = facts.names
    pairs = [(profile.rapid_velocity[k] * 60.0, timed.rapid_velocity[k] * 60.0, names.rates[k]) for k in range(3)]
    pairs += [(profile.acceleration[k], timed.acceleration[k], names.accelerations[k]) for k in range(3)]
    pairs += [(profile.reach(k), high[k] - low[k], names.travel[k]) for k in range(3) if np.isfinite(profile.reach(k))]
    wrong = [
        f"{name}={actual:g} ({expected:g})"
        for expected, actual, name in pairs
        if abs(actual - expected) > _MAX_DIFFERENCE * expected
    ]
    if not wrong:
        return []
    message = Message(
        "the controller differs from the profile of {}: {}; times and limits are "
        "the controller's; create a profile of it with leafcut machine import",
        profile.name,
        ", ".join(wrong),
    )
    return [Issue("L820", message, severity=Severity.WARNING)]
