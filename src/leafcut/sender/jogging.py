"""Manual operation of the machine: jogging, probing the top of the workpiece, and tracing the bounding box of a part.

All moves except the probing move are jogs (``$J=``). A jog respects the soft limits and does not change any modes. A
single byte cancels a jog without a reset. Source: gnea/grbl wiki, "Grbl v1.1 Jogging".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from leafcut.errors import OptionError, SendError
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import Kind
from leafcut.sender.answers import Report, parse_position
from leafcut.sender.controller_facts import Facts
from leafcut.sender.error_texts import error_in_words
from leafcut.sender.grbl import ALARM_SECONDS, GrblConversation
from leafcut.sender.job import SendJob
from leafcut.sender.job_checks import known_arc_extremes, positions_on_machine
from leafcut.sender.resuming import format_without_trailing_zeros

#: Cancels a jog immediately. The machine keeps its position.
JOG_CANCEL = b"\x85"
#: Time limit of a probing move, s.
_PROBE_SECONDS = 600.0
#: Distance to retract above the plate after probing, mm.
_RETRACT = 2.0
#: Tolerance for rounded positions, mm.
_TOLERANCE = 0.005
_AXES = "XYZ"


def jog_command(moves: dict[str, float], feed: float, *, machine: bool = False) -> str:
    """Return the command for a jog.

    Parameters
    ----------
    moves
        Distance for each axis, mm, or machine coordinates if `machine` is set.
    feed
        Feed, mm/min.
    machine
        Whether `moves` contains machine coordinates.

    Raises
    ------
    OptionError
        An axis, a length or the feed is invalid.
    """
    words = [
        f"{axis}{format_without_trailing_zeros(value)}"
        for axis, value in moves.items()
        if axis in _AXES and math.isfinite(value)
    ]
    if not words or len(words) < len(moves):
        raise OptionError("a jog needs distances in X, Y or Z, mm")
    if not (math.isfinite(feed) and feed > 0.0):
        raise OptionError("a jog needs a feed above 0 mm/min")
    return f"$J={'G53' if machine else 'G91'}G21{''.join(words)}F{format_without_trailing_zeros(feed)}"


def jog(talk: GrblConversation, moves: dict[str, float], feed: float) -> None:
    """Jog by the distance in `moves` for each axis, mm, at a feed in mm/min.

    Raises `SendError` if the controller refuses.
    """
    talk.ask(jog_command(moves, feed))


def check_jog(facts: Facts, place: XYZ | None, moves: dict[str, float]) -> None:
    """Raise `SendError` if a jog leaves the travel of the machine, even if soft limits are off.

    A machine outside its travel may jog back into it.
    """
    if place is None or not facts.has_valid_coordinates:
        return
    low, high = facts.travel_limits()
    for axis, move in moves.items():
        k = _AXES.index(axis)
        target = place[k] + move
        if (target > high[k] + _TOLERANCE and move > 0.0) or (target < low[k] - _TOLERANCE and move < 0.0):
            raise SendError("{} goes from {:g} to {:g} mm: {}", axis, low[k], high[k], error_in_words(15))


def cancel_jog(talk: GrblConversation) -> None:
    """Cancel the jog in progress."""
    talk.write(JOG_CANCEL)


def probe_z(talk: GrblConversation, facts: Facts, plate: float, feed: float, travel: float) -> None:
    """Probe down onto a plate, set Z0 to the underside of the plate, and retract.

    Parameters
    ----------
    talk
        The connection to the controller.
    facts
        Values that the controller has reported.
    plate
        Thickness of the plate, mm.
    feed
        Probing feed, mm/min.
    travel
        Maximum distance to move down, mm.

    Raises
    ------
    OptionError
        A value is invalid.
    SendError
        The move would leave the travel of the machine, or the probe makes no contact.
    """
    if not (math.isfinite(plate) and plate >= 0.0):
        raise OptionError("the thickness of the plate must be 0 or more, mm")
    if not (math.isfinite(feed) and math.isfinite(travel) and feed > 0.0 and travel > 0.0):
        raise OptionError("the probe needs a feed and a maximum distance above 0")
    place = facts.machine_position(talk.query_status())
    lowest = facts.travel_limits()[0][2]
    if facts.has_valid_coordinates and place is not None and place[2] - travel < lowest - _TOLERANCE:
        raise SendError(
            "the probe can descend only {:.3f} mm here before the end of the machine's "
            "travel; its maximum distance is {:g} mm",
            max(place[2] - lowest, 0.0),
            travel,
        )
    try:
        answers = talk.ask(
            f"G91G21G38.2Z{format_without_trailing_zeros(-travel)}F{format_without_trailing_zeros(feed)}",
            _PROBE_SECONDS,
        )
    except SendError:
        talk.wait_for_alarm_report(ALARM_SECONDS)
        raise
    talk.ask("G90")
    contact_report = next(
        (answer.text for answer in answers if isinstance(answer, Report) and answer.name == "PRB"), ""
    )
    contact_text, _, touched = contact_report.partition(":")
    contact = parse_position(contact_text)
    place_now = facts.machine_position(talk.query_status())
    if contact is None or touched.strip() != "1" or place_now is None:
        raise SendError("the controller does not report the position of the contact")
    # Z0 is set from the reported point of contact, because the tool comes to rest slightly below it.
    talk.ask("G54")
    talk.ask(f"G10 L20 P1 Z{format_without_trailing_zeros(plate + place_now[2] - contact[2] * facts.unit)}")
    talk.ask(jog_command({"Z": _RETRACT}, max(feed, 100.0)))


@dataclass(frozen=True)
class FrameBox:
    """The bounding box of a program's cuts and the height for tracing it, in machine coordinates, mm."""

    low: tuple[float, float]
    high: tuple[float, float]
    height: float

    def tracing_lines(self, feed: float) -> list[str]:
        """Return the jogs that raise the tool, move to a corner and trace the box. The tool stays up."""
        (x0, y0), (x1, y1) = self.low, self.high
        corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))
        up = jog_command({"Z": self.height}, feed, machine=True)
        return [up, *(jog_command({"X": x, "Y": y}, feed, machine=True) for x, y in corners)]


def program_frame(job: SendJob, facts: Facts) -> FrameBox:
    """Return the frame of a program.

    The tool traces the frame at the greatest Z of the program, or at its current Z if this is higher. The program and
    its frame stay within the travel, because `job_checks.check_program` has already checked the program. Raises
    `SendError` if the program does not cut anything, or if the machine does not report its position.
    """
    places, _ = positions_on_machine(job, facts, fed=True)
    every, _ = positions_on_machine(job, facts)
    known = places[np.isfinite(places[:, :2]).all(axis=1)]
    heights = every[np.isfinite(every[:, 2]), 2]
    place = facts.machine_position()
    if not len(known) or place is None:
        raise SendError(
            "framing is not possible: the program cuts nothing, or the machine does not report its position"
        )
    low, high = known[:, :2].min(axis=0), known[:, :2].max(axis=0)
    # A laser that never moves Z traces the frame at its current height.
    top = max([place[2], *heights.tolist()])
    return FrameBox((float(low[0]), float(low[1])), (float(high[0]), float(high[1])), float(top))


def bounding_box_of_cuts(job: SendJob) -> tuple[XYZ, XYZ] | None:
    """Return the smallest and largest x, y and z of the cuts in program coordinates, mm, or None if nothing is cut."""
    path = job.program.path
    cuts = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)
    arcs = np.flatnonzero(np.isin(path.kind, (Kind.ARC_CW, Kind.ARC_CCW))).tolist()
    bulges = [place for row in arcs for place in known_arc_extremes(path, row)]
    places = np.concatenate([path.before[cuts], path.end[cuts], np.reshape(bulges, (-1, 3))])
    known = places[np.isfinite(places).all(axis=1)]
    if not len(known):
        return None
    low, high = known.min(axis=0).tolist(), known.max(axis=0).tolist()
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])
