"""What a person does with the machine by hand, beside a program: jog, probe the height of the work, frame the part.

All moves here but that of the probe are jogs (``$J=``): a jog keeps to the soft limits and leaves every mode as it
was, and one byte ends it without a reset. Source: gnea/grbl wiki, "Grbl v1.1 Jogging".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from leafcut.errors import OptionError, SendError
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import Kind
from leafcut.sender.answers import Report, place_in
from leafcut.sender.checking import bulge, machine_places
from leafcut.sender.explained import error_in_words
from leafcut.sender.facts import Facts
from leafcut.sender.grbl import ALARM_SECONDS, GrblConversation
from leafcut.sender.job import SendJob
from leafcut.sender.resuming import number_in_mm

#: Ends a jog at once, with the position kept.
JOG_CANCEL = b"\x85"
#: How long a probe may be on its way, s.
_PROBE_SECONDS = 600.0
#: Above the plate after a probe, mm.
_BACK = 2.0
#: Room for the rounding of places, mm.
_ROOM = 0.005
_AXES = "XYZ"


def jog_line(moves: dict[str, float], feed: float, *, machine: bool = False) -> str:
    """Return the line of a jog: axis → mm, from where the tool is, or in `machine` coordinates; feed in mm/min.

    Raises
    ------
    OptionError
        An axis, a length or a feed is none.
    """
    words = [f"{axis}{number_in_mm(value)}" for axis, value in moves.items() if axis in _AXES and math.isfinite(value)]
    if not words or len(words) < len(moves):
        raise OptionError("a jog needs lengths in X, Y or Z, mm")
    if not (math.isfinite(feed) and feed > 0.0):
        raise OptionError("a jog needs a feed above 0 mm/min")
    return f"$J={'G53' if machine else 'G91'}G21{''.join(words)}F{number_in_mm(feed)}"


def jog(talk: GrblConversation, moves: dict[str, float], feed: float) -> None:
    """Move by lengths, axis → mm, at a feed, mm/min; return when the controller has taken it.

    Raises
    ------
    SendError
        It leaves the travel, or the machine may not be jogged now.
    """
    talk.ask(jog_line(moves, feed))


def check_jog(facts: Facts, place: XYZ | None, moves: dict[str, float]) -> None:
    """Refuse a jog out of the travel, also where the controller's own limits are off; back into it is always right.

    Raises
    ------
    SendError
        As the controller would say it.
    """
    if place is None or not facts.knows_place:
        return
    low, high = facts.travel()
    for axis, move in moves.items():
        k = _AXES.index(axis)
        to = place[k] + move
        if (to > high[k] + _ROOM and move > 0.0) or (to < low[k] - _ROOM and move < 0.0):
            raise SendError(f"{axis} goes from {low[k]:g} to {high[k]:g} mm: {error_in_words(15)}")


def cancel_jog(talk: GrblConversation) -> None:
    """End a jog."""
    talk.write(JOG_CANCEL)


def probe_z(talk: GrblConversation, facts: Facts, plate: float, feed: float, travel: float) -> None:
    """Go down onto a plate until the probe closes, make its lower side Z0, and rise off it.

    Parameters
    ----------
    plate, feed, travel
        The thickness of the plate, mm; the feed, mm/min; how far down it may go, mm.

    Raises
    ------
    OptionError
        A value is none.
    SendError
        It would leave the machine's travel, or the probe touches nothing.
    """
    if not (math.isfinite(plate) and plate >= 0.0):
        raise OptionError("the thickness of the plate must be 0 or more, mm")
    if not (math.isfinite(feed) and math.isfinite(travel) and feed > 0.0 and travel > 0.0):
        raise OptionError("the probe needs a feed and a limit of its way above 0")
    place = facts.machine_place(talk.fresh_status())
    lowest = facts.travel()[0][2]
    if facts.knows_place and place is not None and place[2] - travel < lowest - _ROOM:
        raise SendError(
            f"the probe may go down {max(place[2] - lowest, 0.0):.3f} mm here, then the machine's travel ends; "
            f"its limit is {travel:g} mm"
        )
    try:
        answers = talk.ask(f"G91G21G38.2Z{number_in_mm(-travel)}F{number_in_mm(feed)}", _PROBE_SECONDS)
    except SendError:
        talk.hear_out(ALARM_SECONDS)
        raise
    talk.ask("G90")
    said = next((one.text for one in answers if isinstance(one, Report) and one.name == "PRB"), "")
    place_said, _, touched = said.partition(":")
    contact = place_in(place_said)
    now = facts.machine_place(talk.fresh_status())
    if contact is None or touched.strip() != "1" or now is None:
        raise SendError("the controller does not say where the probe touched")
    # It has come to rest a little below the place where it was closed.
    talk.ask("G54")
    talk.ask(f"G10 L20 P1 Z{number_in_mm(plate + now[2] - contact[2] * facts.unit)}")
    talk.ask(jog_line({"Z": _BACK}, max(feed, 100.0)))


@dataclass(frozen=True)
class FrameBox:
    """The box of what a program cuts, and the height at which it is traced, in machine coordinates, mm."""

    low: tuple[float, float]
    high: tuple[float, float]
    height: float

    def lines(self, feed: float) -> list[str]:
        """Return the jogs: up, to a corner, round, and there the tool stays."""
        (x0, y0), (x1, y1) = self.low, self.high
        corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))
        up = jog_line({"Z": self.height}, feed, machine=True)
        return [up, *(jog_line({"X": x, "Y": y}, feed, machine=True) for x, y in corners)]


def frame_of(job: SendJob, facts: Facts) -> FrameBox:
    """Return the frame of a program on the machine as it stands: at its highest place, or higher where the tool is.

    `checking.check_program` has found every place of the program within the travel, and so is the frame.

    Raises
    ------
    SendError
        The program cuts nothing, or the machine does not report its place.
    """
    places, _ = machine_places(job, facts, fed=True)
    every, _ = machine_places(job, facts)
    known = places[np.isfinite(places[:, :2]).all(axis=1)]
    heights = every[np.isfinite(every[:, 2]), 2]
    place = facts.machine_place()
    if not len(known) or place is None:
        raise SendError("there is nothing to frame: the program cuts nothing, or the machine does not say where it is")
    low, high = known[:, :2].min(axis=0), known[:, :2].max(axis=0)
    # A laser that never moves Z is framed where it stands.
    top = max([place[2], *heights.tolist()])
    return FrameBox((float(low[0]), float(low[1])), (float(high[0]), float(high[1])), float(top))


def fed_box(job: SendJob) -> tuple[XYZ, XYZ] | None:
    """Return the smallest and largest x, y and z of what a program cuts, in its own coordinates; None for nothing."""
    path = job.program.path
    cuts = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)
    arcs = np.flatnonzero(np.isin(path.kind, (Kind.ARC_CW, Kind.ARC_CCW))).tolist()
    bulges = [place for row in arcs for place in bulge(path, row)]
    places = np.concatenate([path.before[cuts], path.end[cuts], np.reshape(bulges, (-1, 3))])
    known = places[np.isfinite(places).all(axis=1)]
    if not len(known):
        return None
    low, high = known.min(axis=0).tolist(), known.max(axis=0).tolist()
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])
