"""One row of a toolpath, and the meaning of its columns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

UNKNOWN = math.nan
#: `ref` of a SPINDLE row from an S word without M3 or M4.
SPEED_ALONE = -1


class Kind(IntEnum):
    """Kind of a row, which determines the meaning of its columns.

    ========== ============================================ ==================== ===========================
    kind       end (x, y, z)                                value                ref
    ========== ============================================ ==================== ===========================
    RAPID      end position                                 –                    –
    FEED       end position                                 feed, mm/s           –
    ARC_CW     end position                                 feed, mm/s           row of `arcs`
    ARC_CCW    end position                                 feed, mm/s           row of `arcs`
    DRILL      the hole, and the height after the cycle     feed, mm/s           row of `cycles`
    DWELL      –                                            seconds              –
    TOOL       –                                            –                    tool number
    OFFSET     –                                            –                    length offset (H), 0 = G49
    SPINDLE    –                                            rpm; < 0 = backwards spindle; torch: 1 marks; -1 = S alone
    COOLANT    –                                            –                    0 off, 1 mist, 2 flood, 3 both
    PAUSE      –                                            –                    0 = M0, 1 = M1
    MACHINE    machine coordinates, NaN = axis stays        –                    –
    END        –                                            –                    –
    FRAME      new position                                 –                    work offset in tenths (540 is G54)
    SHIFT      new position                                 –                    origin moved (G52, G92 …), counted
    RADIUS     –                                            D, as written        40, 41 or 42
    BLENDING   x: tolerance for joining short moves, mm     tolerance, mm        610, 611 or 640 (G61, G61.1, G64)
    FOREIGN    new position                                 of a probe, mm/s     1: state unknown; 2: `STILL`
    TORCH      –                                            1 on, 0 off          – (while moving)
    HEIGHT     –                                            1 on, 0 off          – (torch height control)
    PROBE      farthest position                            feed, mm/s           – (until a probe trips)
    ========== ============================================ ==================== ===========================

    SPINDLE switches a torch like M3 and M5 do. TORCH and HEIGHT act with the next motion, without a stop. A new
    position is in the program coordinates that are valid after the row. It is NaN for an axis that must be programmed
    again before its position is known.
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


#: Kinds whose `end` is a position in program coordinates.
MOTIONS = (Kind.RAPID, Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL, Kind.PROBE)
#: Kinds of rows after which the tool is at `end`, in program coordinates.
PLACES = (*MOTIONS, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)
#: `ref` of a FOREIGN row whose block does not move an axis, such as M52 P1.
STILL = 2


@dataclass(frozen=True, slots=True)
class DrillCycle:
    """Parameters of a canned cycle: heights in mm, dwell in s.

    `name` is the G word of LinuxCNC and Fanuc (G81 … G86, G89, G73), for all controllers. If `to_initial`, the tool
    retracts to its height before the cycle (G98), otherwise to `r_plane` (G99). `approach` is the move over the hole:

    - ``level``: at the current height, or at the R plane if that is higher;
    - ``slant``: rising to the return height on the way;
    - ``sink``: after a vertical move down to the R plane.
    """

    name: str
    r_plane: float
    bottom: float
    to_initial: bool = False
    peck: float = 0.0
    dwell: float = 0.0
    approach: str = "level"

    def height_after(self, initial: float) -> float:
        """Return the height after the hole, mm, in a series of cycles that started at height `initial`, mm.

        G98 retracts to the height before the series, or to the R plane if that is higher (RS274/NGC 3.5.16.1; observed
        with `rs274 -g`).
        """
        return initial if self.to_initial and initial >= self.r_plane else self.r_plane

    def approach_in_series(self, initial: float, height: float) -> str:
        """Return the `approach` of LinuxCNC 2.9 in a series of cycles that started at height `initial`, mm.

        If `initial` is below the R plane, the tool first moves vertically to the R plane. Otherwise, a tool at or below
        the R plane rises to the return height on its way over the hole. Unknown heights are NaN. Observed with `rs274
        -g`.
        """
        if initial < self.r_plane:
            return "sink" if height > self.r_plane else "level"
        return "slant" if height <= self.r_plane and height < self.height_after(initial) else "level"


@dataclass(frozen=True, slots=True)
class Arc:
    """Centre of an arc in program coordinates, mm, its plane (17 xy, 18 zx, 19 yz), and its number of turns."""

    center: tuple[float, float, float]
    plane: int = 17
    turns: int = 1


class Motion(NamedTuple):
    """A row of a toolpath as an object, for messages and for loops that need not be fast."""

    kind: Kind
    end: tuple[float, float, float]
    value: float
    ref: int
    line: int
