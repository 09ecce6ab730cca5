"""Programs in the native language of Siemens controls: G-code with MCALL CYCLE81, T="1", D1 and SUPA."""

from __future__ import annotations

from leafcut.model.cycles import PECKING
from leafcut.model.toolpath import DrillCycle, Motion
from leafcut.post.row_writer import Writer
from leafcut.post.words import format_number, peck_text


class SinumerikWriter(Writer):
    """Writes programs in the language of Siemens controls.

    While MCALL is active, every block with a move drills a hole, and so does a block with F alone. Therefore F is
    written before the call, and MCALL alone ends the cycle before any other block.
    """

    end_of_cycle = "MCALL"
    calls_cycles = True

    _tool_now: int | None = None

    def _write_hole(self, row: Motion, cycle: DrillCycle) -> None:
        if self.cycle is None:
            self.out.write(self.out.modal("plane", "G17"))
            self.out.write(self._feed_word(row))
            self.out.write(self._call(cycle, row.end[2]))
            self.out.forget(["motion", *"XY"])
        position = self._place_words(row)
        self.out.write(self.out.modal("motion", "G0"), *position)

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
            first = max(self.numbers.rounded(cycle.r_plane) - peck, self.numbers.rounded(cycle.bottom))
            words += ["", length(first), "", "0", "0", "0", "1", "1" if cycle.name == "G83" else "0"]
        return f"MCALL {name}({','.join(words)})"

    def _tool_word(self, number: int) -> str:
        return f'T="{number}"'

    def _change_tool(self, word: str, number: int) -> None:
        self.out.write(word)
        self.out.write("M6")

    def _tool(self, row: Motion) -> None:
        super()._tool(row)
        self._tool_now = row.ref

    def _offset_words(self, number: int) -> list[str]:
        return ["D1"]

    def _move_machine(self, words: list[str], to_zero: bool) -> None:
        self.out.forget(["motion"])
        self.out.write(self.out.modal("motion", "G0"), "SUPA", *words, "D0")
        # The length offset is off now; the next move in Z activates it again.
        self.pending_offset = self._tool_now
