"""One row of a toolpath: what it does, and what its columns then mean."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

UNKNOWN = math.nan
#: `ref` of a row SPINDLE that an S without M3 or M4 made.
SPEED_ALONE = -1


class Kind(IntEnum):
    """What a row does, and what its columns then mean.

    ========== ============================================ ==================== ===========================
    kind       end (x, y, z)                                value                ref
    ========== ============================================ ==================== ===========================
    RAPID      where it ends                                –                    –
    FEED       where it ends                                feed, mm/s           –
    ARC_CW     where it ends                                feed, mm/s           row of `arcs`
    ARC_CCW    where it ends                                feed, mm/s           row of `arcs`
    DRILL      the hole, and the height after the cycle     feed, mm/s           row of `cycles`
    DWELL      –                                            seconds              –
    TOOL       –                                            –                    tool number
    OFFSET     –                                            –                    length offset (H), 0 = G49
    SPINDLE    –                                            rpm; < 0 = backwards which; of a torch 1 marks; -1 = S alone
    COOLANT    –                                            –                    0 off, 1 mist, 2 flood, 3 both
    PAUSE      –                                            –                    0 = M0, 1 = M1
    MACHINE    machine coordinates, NaN = axis stays        –                    –
    END        –                                            –                    –
    FRAME      where the tool is then                       –                    work offset in tenths (540 is G54)
    SHIFT      where the tool is then                       –                    origin moved (G52, G92 …), counted
    RADIUS     –                                            D, as it is written  40, 41 or 42
    BLENDING   x: how far short moves may be joined, mm     tolerance, mm        610, 611 or 640 (G61, G61.1, G64)
    FOREIGN    where the tool is then                       of a probe, mm/s     1: all is lost; 2: `STILL`
    TORCH      –                                            1 on, 0 off          – (while it moves on)
    HEIGHT     –                                            1 on, 0 off          – (control of the torch's height)
    PROBE      the farthest it may go                       feed, mm/s           – (until a probe trips)
    ========== ============================================ ==================== ===========================

    A torch goes on and off by SPINDLE, as M3 and M5 have it; TORCH and HEIGHT act with the next motion, without a stop.
    Where the tool is then: in the program coordinates from there on, NaN for an axis until it is programmed again.
    """

    RAPID = 0
    FEED = 1
    ARC_CW = 2
    ARC_CCW = 3
    DRILL = 4
    DWELL = 5
    TOOL = 6
    OFFSET = 7
    SPINDLE = 8
    COOLANT = 9
    PAUSE = 10
    MACHINE = 11
    END = 12
    FRAME = 13
    SHIFT = 14
    RADIUS = 15
    BLENDING = 16
    FOREIGN = 17
    TORCH = 18
    HEIGHT = 19
    PROBE = 20


#: Kinds whose `end` is a place in program coordinates.
MOTIONS = (Kind.RAPID, Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL, Kind.PROBE)
#: Kinds whose `end` says where the tool is in program coordinates after them.
PLACES = (*MOTIONS, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)
#: `ref` of a FOREIGN row whose block moves nothing, such as M52 P1.
STILL = 2


@dataclass(frozen=True, slots=True)
class DrillCycle:
    """The words of a canned cycle: heights in mm, dwell in s.

    `name` is the G word as LinuxCNC and Fanuc have it (G81 … G86, G89, G73), whatever the controller calls it.
    `to_initial` is G98: after the hole the tool rises to where it was before the cycle; else G99, to `r_plane`.
    `approach` is how the tool comes over the hole: "level", where it is or at the R plane if that is higher; "slant",
    rising on its way to the height to which it returns; "sink", first straight down to the R plane where it stands.
    """

    name: str
    r_plane: float
    bottom: float
    to_initial: bool = False
    peck: float = 0.0
    dwell: float = 0.0
    approach: str = "level"

    def height_after(self, initial: float) -> float:
        """Return where the tool is after the hole, mm, in a series before which it was at `initial`.

        G98 rises to the height before the series of cycles, or to the R plane if that is higher (RS274/NGC 3.5.16.1;
        seen with `rs274 -g`).
        """
        return initial if self.to_initial and initial >= self.r_plane else self.r_plane

    def approach_in_series(self, initial: float, here: float) -> str:
        """Return the `approach` in LinuxCNC 2.9 (seen with rs274) from `here` in a series with `initial` before it.

        Where the height before the series is below R, it goes to R where it stands, up or down; else, from R or below
        it, it rises on its way over the hole as far as it will come back. A height that is not known may be any.
        """
        if initial < self.r_plane:
            return "sink" if here > self.r_plane else "level"
        return "slant" if here <= self.r_plane and here < self.height_after(initial) else "level"


@dataclass(frozen=True, slots=True)
class Arc:
    """Centre of an arc in program coordinates, the plane it lies in (17 xy, 18 zx, 19 yz) and its full turns."""

    center: tuple[float, float, float]
    plane: int = 17
    turns: int = 1


class Motion(NamedTuple):
    """One row of a toolpath, for messages and for loops that need not be fast."""

    kind: Kind
    end: tuple[float, float, float]
    value: float
    ref: int
    line: int
