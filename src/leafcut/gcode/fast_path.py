"""The quick way through plain lines: `G1X12.5Y3.F600` and its like, most of the lines of most programs.

S may stand in them, before F or behind it: a laser's picture has a power of its own in every line.

It gives what `BlockRunner` gives, row for row, and leaves to it every line that is not plain in a plain state.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from leafcut.gcode.block_record import BlockRecord
from leafcut.gcode.foreign_state import ForeignState
from leafcut.gcode.motion import RADIUS_RELATIVE_TOLERANCE, RADIUS_TOLERANCE
from leafcut.gcode.torch import say_power
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.toolpath import SPEED_ALONE, Arc
from leafcut.units import SECONDS_PER_MINUTE

_SPACES = r"[ \t]*+"
_ANY = r"([+-]?(?:[0-9]{1,8}+(?:\.[0-9]{0,20}+)?|\.[0-9]{1,20}+))"
_POINTED = r"([+-]?(?:[0-9]{1,8}+\.[0-9]{0,20}+|\.[0-9]{1,20}+))"

#: kind, x, y, z, feed, arc; the line comes behind it. Empty: a line that moves nothing.
MovedRow = tuple[float, ...]


def _pattern(number: str) -> re.Pattern[str]:
    words = "".join(f"(?:[{letter}{letter.lower()}]{_SPACES}{number}{_SPACES})?+" for letter in "XYZIJ")
    start = f"{_SPACES}(?:[Nn]{_SPACES}[0-9]{{1,8}}+{_SPACES})?+(?:[Gg]{_SPACES}0?([0-3])(?![0-9.]){_SPACES})?+"
    feed, speed = (f"(?:[{letter}{letter.lower()}]{_SPACES}{_ANY}{_SPACES})" for letter in "FS")
    return re.compile(f"{start}{words}(?:{speed}{feed}?+|{feed}{speed}?+)?+[\r\n]*+")


#: Somebody looks at one in so many lines, less one.
_LOOKS = 0xFFF


class FastPath:
    """Runs plain lines of one program."""

    def __init__(
        self, lines: Sequence[str], state: ForeignState, record: BlockRecord, look: Heartbeat = unseen
    ) -> None:
        self._lines = lines
        self._state = state
        self._record = record
        self._look = look
        self._match = _pattern(_POINTED if state.dialect.point_required else _ANY).fullmatch

    def open(self) -> bool:
        """Return whether the state is plain enough."""
        state = self._state
        return (
            state.unit is not None
            and state.motion is not None
            and state.cycle is None
            and not state.incremental
            and state.feed_mode == 94
            and not state.foreign_motion
            and not state.unsure
            and not state.feed_forgotten
            and not state.transform
            and state.override == 1.0
        )

    def run(self, start: int) -> int:
        """Run the plain lines from `start` (from 0) on; return the first that is not."""
        state, record, lines = self._state, self._record, self._lines
        path, unit, match = state.path, state.unit or 1.0, self._match
        add_row, add_line = path.rows.extend, record.line.append
        add_first, add_before = record.first.append, record.before.append
        count = len(path)
        for at in range(start, len(lines)):
            if not at & _LOOKS:
                self._look(at / len(lines))
            found = match(lines[at])
            if found is None or found.lastindex is None:
                return at
            g, x, y, z, i, j, s, f, f_first, s_last = found.groups()
            f, s = f or f_first, s or s_last
            motion = state.motion or 0 if g is None else int(g)
            feed = state.feed if f is None else float(f) * unit / SECONDS_PER_MINUTE
            speed = state.rpm if s is None else float(s)
            here = path.position
            end = [
                here[0] if x is None else float(x) * unit + 0.0,
                here[1] if y is None else float(y) * unit + 0.0,
                here[2] if z is None else float(z) * unit + 0.0,
            ]
            if motion >= 2:
                row = self._arc(motion, end, i, j, feed)
            elif i is not None or j is not None or (motion and not feed > 0.0):
                return at
            elif x is None and y is None and z is None:
                row = ()
            else:
                row = (motion, *end, feed if motion else 0.0, 0)
            if row is None or feed < 0.0 or speed < 0.0:
                return at
            add_line(at + 1)
            add_first(count)
            add_before(record.current)
            if s is not None:
                count = self._turn(speed, at + 1)
            if row:
                add_row(row)
                add_row((at + 1,))
                count += 1
                path.position = end
                path.initial_plane = None
            if motion != state.motion or f is not None or s is not None:
                state.motion, state.feed = motion, feed
                if f is not None:
                    state.feed_said = float(f)
                record.current = record.current_of(motion, state.feed_said, speed)
        return len(lines)

    def _turn(self, speed: float, line: int) -> int:
        """Take an S; return how many rows there are then."""
        state = self._state
        state.line, state.rpm = line, speed
        if state.spindle and not say_power(state):
            state.path.spindle(state.spindle * speed, line, SPEED_ALONE)
        return len(state.path)

    def _arc(self, motion: int, end: list[float], i: str | None, j: str | None, feed: float) -> MovedRow | None:
        """Return the row of an arc, or None when it is for the full way."""
        state = self._state
        if (i is None and j is None) or not feed > 0.0 or state.plane != 17 or state.absolute_centres:
            return None
        unit, here, arcs = state.unit or 1.0, state.path.position, state.path.arcs
        u = here[0] + (0.0 if i is None else float(i) * unit)
        v = here[1] + (0.0 if j is None else float(j) * unit)
        inner = math.hypot(here[0] - u, here[1] - v)
        most = max(RADIUS_TOLERANCE, RADIUS_RELATIVE_TOLERANCE * inner)
        # What is near the limit is for the full way to decide.
        if not (inner > 1e-9 and abs(inner - math.hypot(end[0] - u, end[1] - v)) < 0.999 * most):
            return None
        arcs.append(Arc((u, v, here[2])))
        return (motion, *end, feed, len(arcs) - 1)
