"""Whether a program can run on the machine as it stands there: mode, homing, travel, speeds."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from leafcut.errors import SendError
from leafcut.geometry.arrays import Floats
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import MOTIONS, Kind, Toolpath, arc_extremes
from leafcut.sender.conversation import LOCKED
from leafcut.sender.explained import state_in_words
from leafcut.sender.facts import Facts
from leafcut.sender.job import SendJob

#: Room for the rounding of places, mm.
_ROOM = 0.005
#: Speeds and travels that differ by more are told.
_APART = 0.01


#: States in which it waits for a person, and not for its own end.
_STANDING = ("Check", "Hold", "Door")

_UNSURE = "the controller does not say whether it was homed, and does not wait for that"


def check_ready(facts: Facts, *, unhomed: bool, restarted: bool = False, family: str = "") -> None:
    """Refuse a machine that is not at rest, or does not know where it is.

    Parameters
    ----------
    unhomed
        A person has said that its place is right although it was not homed.
    restarted
        The board has just started, so that without homing its place cannot be right.
    family
        The firmware, by whose list an alarm is explained.

    Raises
    ------
    SendError
        Says what it does, and what to do.
    """
    does = state_in_words(facts.status, family)
    if facts.status.state == "Alarm":
        how = "home it with --home" if facts.homing else "free it with --unlock"
        raise SendError(f"the machine is {does}; {how}")
    if facts.status.state in LOCKED:
        how = "; wake it with --unlock" if facts.status.state == "Sleep" else ""
        raise SendError(f"the machine is {does}{how}")
    if facts.status.state != "Idle":
        how = "" if facts.status.state in _STANDING else "wait until it stands, or "
        raise SendError(f"the machine is {does}; {how}reset it with --unlock")
    if facts.status.pins and set(facts.status.pins) & set("XYZ"):
        raise SendError(f"a limit switch is pressed ({facts.status.pins}); move the machine away from it")
    if not facts.homing and not unhomed:
        raise SendError(
            f"homing is off ({facts.names.homing}): the machine does not know where it is, and nothing keeps it inside "
            "its travel; set its zero by hand and add --unhomed, or turn homing on"
        )
    if facts.homing and not facts.homed and not unhomed:
        says = "the controller says that it was not homed" if facts.homed is False else _UNSURE
        raise SendError(f"{says}: add --home; or set its zero by hand and add --unhomed")
    if not facts.knows_place and restarted:
        raise SendError(
            "the board started anew when its port was opened, and has forgotten where it was: bring the tool to the "
            "program's zero by hand, and add --zero-here"
        )


def check_program(job: SendJob, facts: Facts, *, unhomed: bool, accept: Collection[str] = ()) -> list[Issue]:
    """Return what a person should know; refuse a program that this machine, as it stands, cannot run.

    Raises
    ------
    SendError
        Says what does not fit, with its line.
    """
    if job.laser != facts.laser_mode:
        name = facts.names.laser
        mode, other = (f"off ({name}=0)", "laser") if job.laser else (f"on ({name}=1)", "spindle")
        raise SendError(
            f"laser mode is {mode}, but the program is for a {other}; set {name}, or name the right --machine"
        )
    arcs = np.flatnonzero(np.isin(job.program.path.kind, (Kind.ARC_CW, Kind.ARC_CCW)))
    if len(arcs) and not facts.arcs:
        line = int(job.program.path.line[arcs[0]])
        raise SendError(
            f"the firmware has no arcs (ARC_SUPPORT), and line {line} is one; post the program without arcs"
        )
    _check_speeds(job, facts)
    _check_travel(job, facts, unhomed=unhomed and not facts.knows_place)
    if "L805" not in accept:
        _check_start(job, facts)
    return _differences(job, facts)


def _check_speeds(job: SendJob, facts: Facts) -> None:
    path = job.program.path
    rows = np.flatnonzero((path.kind == Kind.SPINDLE) & (np.abs(path.value) > facts.fastest + 0.5))
    if len(rows):
        row = int(rows[0])
        limit = f"{facts.names.fastest}={facts.fastest:g}"
        what = f"S{abs(path.value[row]):g} in line {int(path.line[row])} is above the controller's {limit}"
        raise SendError(f"{what}; is this the program of another machine?")


def machine_places(job: SendJob, facts: Facts, *, fed: bool = False) -> tuple[Floats, Floats]:
    """Return every place that a program reaches in machine coordinates, float64[n, 3] mm, NaN unknown, and its line.

    `fed` leaves out where it only goes as a rapid.
    """
    path = job.program.path
    frames = path.latest(Kind.FRAME, path.ref, 540)
    places, lines = [np.zeros((0, 3))], [np.zeros(0)]
    for frame in np.unique(frames).tolist():
        zero = np.array(facts.origin(int(frame)))
        moving = (frames == frame) & np.isin(path.kind, [int(k) for k in MOTIONS if not (fed and k is Kind.RAPID)])
        places.append(path.end[moving] + zero)
        lines.append(path.line[moving].astype(np.float64))
        for row in np.flatnonzero((frames == frame) & np.isin(path.kind, (Kind.ARC_CW, Kind.ARC_CCW))).tolist():
            extremes = _extremes(path, row)
            if extremes:
                places.append(np.array(extremes) + zero)
                lines.append(np.full(len(extremes), float(path.line[row])))
    for row in [] if fed else np.flatnonzero(path.kind == Kind.MACHINE).tolist():
        place, line = path.end[row], int(path.line[row])
        text = job.program.lines[line - 1].upper().replace(" ", "")
        for word in ("G28", "G30"):
            if word in text:
                stored = np.array(facts.places.get(word, (0.0, 0.0, 0.0)))
                place = np.where(np.isfinite(place), stored, place)
        places.append(place.reshape(1, 3))
        lines.append(np.array([float(line)]))
    return np.concatenate(places), np.concatenate(lines)


def _extremes(path: Toolpath, row: int) -> list[XYZ]:
    try:
        return [(x, y, z) for x, y, z in arc_extremes(path, row)]
    except ValueError:
        return []


def _check_travel(job: SendJob, facts: Facts, *, unhomed: bool) -> None:
    """Refuse a program that leaves the travel; of a machine that is not homed only its size is known."""
    places, lines = machine_places(job, facts)
    low, high = facts.travel()
    for axis, name in enumerate("XYZ"):
        values = places[:, axis]
        known = np.isfinite(values)
        if not known.any():
            continue
        least, most = float(values[known].min()), float(values[known].max())
        if unhomed:
            if most - least > high[axis] - low[axis] + _ROOM:
                raise SendError(
                    f"the program needs {most - least:.3f} mm in {name}, but the machine's travel is "
                    f"{high[axis] - low[axis]:.3f} mm ({facts.names.travel[axis]}); is this the "
                    "program of another machine?"
                )
            continue
        outside = known & ((values < low[axis] - _ROOM) | (values > high[axis] + _ROOM))
        if outside.any():
            first = np.flatnonzero(outside)[np.argmin(lines[outside])]
            zero = facts.origin(540)[axis]
            raise SendError(
                f"line {int(lines[first])} goes to {name} {values[first]:.3f} mm in {facts.names.coordinates}, outside "
                f"the travel of {low[axis]:g} to {high[axis]:g} mm ({facts.names.travel[axis]}); the work zero is at "
                f"{zero:.3f}: set it anew, or move the part"
            )


def _check_start(job: SendJob, facts: Facts) -> None:
    """Refuse a first way in X or Y below the heights of the program, where it does not say Z before."""
    path = job.program.path
    place = facts.machine_place()
    heights = path.end[np.isin(path.kind, (Kind.RAPID, Kind.FEED)), 2]
    known = heights[np.isfinite(heights)]
    if job.laser or not len(known) or place is None:
        return
    sideways = (path.kind <= Kind.ARC_CCW) & np.isfinite(path.end[:, :2]).any(axis=1) & np.isnan(path.end[:, 2])
    rows = np.flatnonzero(sideways)
    if not len(rows):
        return
    z = place[2] - facts.origin(540)[2]
    if z < float(known.max()) - _ROOM:
        raise SendError(
            f"line {int(path.line[rows[0]])} moves in X or Y before the program says a height, and the tool is at "
            f"Z{z:.3f}, below the program's highest, Z{float(known.max()):.3f}; raise it first, or add --accept L805"
        )


def _differences(job: SendJob, facts: Facts) -> list[Issue]:
    """Return in what the machine's profile is not this controller."""
    mine, its = job.machine, facts.timed(job.machine)
    low, high = facts.travel()
    names = facts.names
    pairs = [(mine.rapid_velocity[k] * 60.0, its.rapid_velocity[k] * 60.0, names.rates[k]) for k in range(3)]
    pairs += [(mine.acceleration[k], its.acceleration[k], names.accelerations[k]) for k in range(3)]
    pairs += [(mine.reach(k), high[k] - low[k], names.travel[k]) for k in range(3) if np.isfinite(mine.reach(k))]
    wrong = [f"{name}={has:g} ({said:g})" for said, has, name in pairs if abs(has - said) > _APART * said]
    if not wrong:
        return []
    message = (
        f"the controller is not set as the profile of {mine.name} says: {', '.join(wrong)}; times and limits are "
        "the controller's; leafcut machine import makes a profile of it"
    )
    return [Issue("L820", message, severity=Severity.WARNING)]
