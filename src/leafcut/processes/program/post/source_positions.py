"""Tool positions in the original program, from which the rewriter derives its own heights and positions."""

from __future__ import annotations

import math

import numpy as np

from leafcut.errors import PostError
from leafcut.gcode.program import Program
from leafcut.model.sequence import ProgramTask
from leafcut.model.toolpath import MOTIONS, Kind

_TOLERANCE = 1e-6
_STOPS = (Kind.TOOL, Kind.PAUSE, Kind.MACHINE, Kind.END, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)


class OriginalPositions:
    """The original program, with the tool position before every row (`before`, float64[n, 3], mm)."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.before = program.path.before

    def place_before(self, block: int) -> list[float]:
        """Return the tool position before a block, or at the end of the program, mm."""
        return list(self.program.path.place_before(int(self.program.first[block])))

    def initial_before(self, block: int) -> float:
        """Return the initial height of the canned cycle active before a block, or else the current height, mm."""
        if self.program.modal(block).cycle is None:
            return self.place_before(block)[2]
        row = int(self.program.first[block])
        kinds = self.program.path.kind
        while row > 0 and (kinds[row - 1] == Kind.DRILL or kinds[row - 1] not in MOTIONS):
            row -= 1
        return float(self.before[row, 2]) if row < len(kinds) else math.nan

    def follows_work(self, block: int) -> bool:
        """Return whether work precedes a block since the last stop or tool change.

        Work is a cut, or a dwell after a sideways rapid.
        """
        kinds = self.program.path.kind
        row = int(self.program.first[block]) - 1
        waited = False
        while row >= 0 and kinds[row] not in _STOPS:
            waited |= bool(kinds[row] == Kind.DWELL)
            if kinds[row] in MOTIONS and (kinds[row] != Kind.RAPID or (waited and not self.is_without_xy(row))):
                return True
            row -= 1
        return False

    def departure_height(self, piece: ProgramTask) -> float:
        """Return the height of the travel move after a piece of work, mm, or −∞ if there is none.

        The height is at most the approach height of the piece, because the original may retract higher before a stop.
        """
        path, first = self.program.path, self.program.first
        row = int(first[piece.end])
        if row < len(path) and path.kind[row] == Kind.DRILL:
            return float(max(self.before[row, 2], path.cycles[int(path.ref[row])].r_plane))
        ways = [
            r for r in range(int(first[piece.begin]), row) if path.kind[r] == Kind.RAPID and not self.is_without_xy(r)
        ]
        top = -math.inf
        while row < len(path) and (
            path.kind[row] not in MOTIONS or (path.kind[row] == Kind.RAPID and self.is_without_xy(row))
        ):
            top = max(top, float(path.end[row, 2])) if path.kind[row] == Kind.RAPID else top
            if path.kind[row] in _STOPS:
                break
            row += 1
        return min(top, float(path.end[ways[-1], 2])) if ways else -math.inf

    def crossing_height(self, piece: ProgramTask) -> float:
        """Return the lowest height at which the original program moves to the start of a piece of work, mm."""
        row = self.arrival(piece)[1]
        z0, z1 = float(self.before[row, 2]), float(self.program.path.end[row, 2])
        path = self.program.path
        return max(z0, path.cycles[int(path.ref[row])].r_plane) if path.kind[row] == Kind.DRILL else min(z0, z1)

    def arrival(self, piece: ProgramTask) -> tuple[int, int]:
        """Return the block and the row of the move to the start of a piece of work."""
        path, first = self.program.path, self.program.first
        for block in range(piece.begin, piece.end):
            for row in range(int(first[block]), int(first[block + 1])):
                x, y = path.end[row, :2].tolist()
                if path.kind[row] in MOTIONS and (x, y) == piece.entry and not self.is_without_xy(row):
                    return block, row
        raise PostError("line {}: the move to the start of this task is missing", piece.line)

    def is_without_xy(self, row: int) -> bool:
        """Return whether a row does not move in X or Y."""
        return bool((np.abs(self.program.path.end[row, :2] - self.before[row, :2]) < _TOLERANCE).all())

    def heights_of_first_return(self, rows: range) -> tuple[float, float] | None:
        """Return the retract height and the R plane of the first hole with G98 in a series, mm, or None."""
        path = self.program.path
        for row in rows:
            if path.kind[row] == Kind.DRILL:
                cycle = path.cycles[int(path.ref[row])]
                if cycle.to_initial:
                    return float(path.end[row, 2]), cycle.r_plane
            elif path.kind[row] in MOTIONS:
                return None
        return None
