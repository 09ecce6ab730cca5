"""Programs in the native language of Siemens controls: MCALL CYCLE81, T="1", D1, SUPA; otherwise G-code."""

from __future__ import annotations

import math

from leafcut.errors import PostError
from leafcut.gcode.numbers import format_number
from leafcut.model.cycles import PECKING
from leafcut.model.toolpath import DrillCycle, Motion
from leafcut.post.row_writer import Writer
from leafcut.post.words import has_cycle, peck_text, said_with


class SinumerikWriter(Writer):
    """Writes row after row.

    Under MCALL every block with a move drills, and so does a block with only F. Therefore F is written before the call,
    and MCALL alone before anything else.
    """

    end_of_cycle = "MCALL"

    _feed_of_call = 0.0
    _tool_now: int | None = None

    def _drill(self, row: Motion) -> None:
        cycle = self.path.cycles[row.ref]
        self._check_cutting(row)
        if any(math.isnan(v) for v in (*row.end, self.position[2])):
            raise PostError("a hole while the place of the tool is not known")
        is_same_cycle = (
            self.cycle is not None
            and said_with(self.cycle) == said_with(cycle)
            and self._feed_of_call == row.value
            and self.cycle.to_initial == cycle.to_initial
        )
        if not is_same_cycle:
            self._leave_cycle()
        # A tool below the R plane would approach the hole there, because the cycle does not lift it first.
        if (
            not has_cycle(cycle, self.dialect)
            or self.numbers.said(self.position[2]) < self.numbers.said(cycle.r_plane)
            or not self._can_return(cycle, row.end[2])
        ):
            self._expand(row, cycle)
            return
        if self.cycle is None:
            self.out.say(self.out.modal("plane", "G17"))
            self.out.say(self._feed_word(row))
            self.out.say(self._call(cycle, row.end[2]))
            self.out.forget(["motion", *"XY"])
        position = [self._axis(row, 0), self._axis(row, 1)]
        if not any(position):
            self.out.forget("XY")
            position = [self._axis(row, 0), self._axis(row, 1)]
        self.out.say(self.out.modal("motion", "G0"), *position)
        self.cycle, self._feed_of_call = cycle, row.value
        self._arrive(row)
        self._axis(row, 2)

    def _call(self, cycle: DrillCycle, after: float) -> str:
        length = self.numbers.length
        words = [length(after), length(cycle.r_plane), "0", length(cycle.bottom)]
        name = "CYCLE81"
        if cycle.name == "G82":
            name = "CYCLE82"
            words += ["", format_number(cycle.dwell, 3)]
        elif cycle.name in PECKING:
            name = "CYCLE83"
            peck = float(peck_text(cycle, self.numbers)) * self.numbers.unit
            first = max(self.numbers.said(cycle.r_plane) - peck, self.numbers.said(cycle.bottom))
            words += ["", length(first), "", "0", "0", "0", "1", "1" if cycle.name == "G83" else "0"]
        return f"MCALL {name}({','.join(words)})"

    def _tool(self, row: Motion) -> None:
        name = self.tool_names.get(row.ref, "")
        self.out.comment(f"T{row.ref} {name}".strip())
        self.out.say(f'T="{row.ref}"')
        self.out.say("M6")
        following = next(self.tools, row.ref)
        if following != row.ref and self.preselect_tool:
            self.out.say(f'T="{following}"')
        self.pending_offset = self._tool_now = row.ref
        self.safe = self.at_machine_height
        self.out.forget(["motion", *"XYZF"])

    def _offset_words(self, number: int) -> list[str]:
        return ["D1"]

    def _machine(self, row: Motion) -> None:
        moved_axes = [axis for axis in range(3) if not math.isnan(row.end[axis])]
        if not self.safe and moved_axes != [2]:
            raise PostError("the first move, in machine coordinates, must be in Z alone")
        if not moved_axes:
            raise PostError("a move in machine coordinates to nowhere")
        words = ["XYZ"[axis] + self.numbers.length(row.end[axis]) for axis in moved_axes]
        self.out.forget(["motion"])
        self.out.say(self.out.modal("motion", "G0"), "SUPA", *words, "D0")
        # The length offset is off now; the next move in Z activates it again.
        self.pending_offset = self._tool_now
        for axis in moved_axes:
            self.place[axis], self.position[axis] = None, math.nan
        self.out.forget("XYZ"[axis] for axis in moved_axes)
        if 2 in moved_axes:
            self.safe = self.at_machine_height = True
