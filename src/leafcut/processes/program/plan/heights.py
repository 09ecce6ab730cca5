"""Lower the retracts, R planes and cycle returns of a program to just above the material."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from leafcut.gcode.program import Program
from leafcut.material.loads import Loads
from leafcut.model.machine import Machine
from leafcut.model.obstacles import Obstacles
from leafcut.model.pace import CycleReturn, Lowered
from leafcut.model.toolpath import MOTIONS, Kind
from leafcut.processes.program.plan.corners import longest_rounding, rows_with_free_rounding

#: A height is lowered only if the reduction is at least this large, mm.
_WORTH = 0.25
_SAME = 1e-6
_LETTERS = frozenset("NGXYZF")
_CODES = frozenset((0, 1, 17, 18, 19, 40, 90, 94))
#: Letters allowed in a block that sets an initial height: length offset, work offset, coolant, spindle.
_BESIDE_LETTERS = frozenset("HMS")
_BESIDE_CODES = frozenset((43, 54, 55, 56, 57, 58, 59))
#: Rows that neither move nor stop the machine, and change no position.
_WITHOUT_EFFECT = (Kind.COOLANT, Kind.BLENDING, Kind.TORCH, Kind.HEIGHT)
#: Rows that do not move the tool.
_STILL = (Kind.SPINDLE, Kind.DWELL)
#: Kinds of travel moves between cuts: rapids, and feed moves through air.
_MOVES = (Kind.RAPID, Kind.FEED)
#: These cycles keep their R plane because it depends on the thread pitch or on an oriented spindle stop.
_KEEP_R = ("G74", "G76", "G84", "G87", "G88")
#: These cycles must retract to the initial height because they retract by hand or with an oriented spindle.
_KEEP_INITIAL = ("G76", "G87", "G88")


@dataclass
class _MovesAtHeight:
    """All moves at a height that the program states.

    Attributes
    ----------
    stated
        Rows that state the height.
    moves
        Rows of the travel moves at the height.
    contacts
        Heights at which these moves would touch the material, mm.
    planes
        Other lower bounds for the height, such as R planes, mm.
    returns
        Whether a cycle retracts to this height.
    """

    stated: list[int]
    moves: list[int]
    contacts: list[float]
    planes: list[float]
    returns: bool = False


class HeightLowering:
    """Finds heights in a program that can be lowered while every move keeps its clearance from the material.

    If the controller rounds corners without a limit, retracts get some extra height, because the sideways move may
    start early. Moves over an obstacle that the user named keep their height. `top` is the highest point of the
    material, mm. It is also the lowest height for rapids that are not straight.
    """

    #: Lines of the moves that keep their height because an obstacle is in the way.
    kept: set[int]

    def __init__(
        self,
        program: Program,
        loads: Loads,
        clearance: float,
        machine: Machine,
        top: float,
        obstacles: Obstacles | None = None,
    ) -> None:
        self.program, self.path, self.loads = program, program.path, loads
        self.obstacles, self.kept = obstacles, set()
        self.clearance, self.top = clearance, top
        self.dogleg = machine.rapid_style == "dogleg"
        self.free = rows_with_free_rounding(self.path, machine, clearance)
        self.longest = longest_rounding(machine)
        rows = np.arange(len(self.path) + 1)
        self.first_piece = np.searchsorted(loads.source, rows, side="left")
        self.does = ~np.isin(self.path.kind, _WITHOUT_EFFECT)

    def lowered_heights(self) -> list[Lowered]:
        """Return the retracts and the R planes that can be lowered."""
        return [*self.lowered_retracts(), *self.lowered_r_planes()]

    def find_cycle_returns(self) -> list[CycleReturn]:
        """Replace G98 by G99 where the tool can stay at the R plane between the holes of a series.

        After the last hole of a series, the tool still retracts to the initial height, because the next move starts
        there.
        """
        found: list[CycleReturn] = []
        series: list[int] = []
        drills = np.flatnonzero(self.path.kind == Kind.DRILL).tolist()
        for row in drills:
            if series and self.next_effective_row(series[-1]) != row:
                found += self._find_returns_in_series(series)
                series = []
            series.append(row)
        return [*found, *(self._find_returns_in_series(series) if series else [])]

    def _find_returns_in_series(self, series: list[int]) -> list[CycleReturn]:
        cycles = [self.path.cycles[int(self.path.ref[row])] for row in series]
        if not all(one.to_initial and one.approach == "level" and one.name not in _KEEP_R for one in cycles):
            return []
        plane = cycles[0].r_plane
        if any(one.r_plane != plane for one in cycles) or not all(self._drills_alone(row) for row in series):
            return []
        found = []
        state = 98
        for row, following in zip(series, [*series[1:], None], strict=True):
            code = 98 if following is None or not self._can_stay_at_plane(row, following, plane) else 99
            if code != state or {98.0, 99.0} & self._g_codes(row):
                found.append(CycleReturn(self._block(row), code))
            state = code
        return found if any(one.code == 99 for one in found) else []

    def _drills_alone(self, row: int) -> bool:
        """Return whether a block only drills its hole, so that G98 or G99 can be added to the block."""
        return self.program.is_plain(row) and not self.program.modal(self._block(row) + 1).incremental

    def _can_stay_at_plane(self, row: int, following: int, plane: float) -> bool:
        if not self.path.end[row, 2] > plane + _WORTH:
            return False
        return self.contact_height(
            following, to_hole=True
        ) + self.clearance <= plane + _SAME and not self._hits_obstacle([following], plane)

    def _hits_obstacle(self, moves: list[int], height: float) -> bool:
        """Return whether a lowered move would hit an obstacle. If so, record the line of the move in `kept`."""
        if self.obstacles is None or height >= self.obstacles.height:
            return False
        over = [row for row in moves if height < self._min_height_over_obstacles(row)]
        self.kept.update(int(self.path.line[row]) for row in over)
        return bool(over)

    def _min_height_over_obstacles(self, row: int) -> float:
        """Return the lowest height that clears all obstacles below a move, mm, or −∞ without obstacles."""
        assert self.obstacles is not None
        (x0, y0), (x1, y1) = self.path.before[row, :2].tolist(), self.path.end[row, :2].tolist()
        return self.obstacles.min_rapid_height((x0, y0), (x1, y1), int(self.path.tool[row]))

    def next_effective_row(self, row: int) -> int:
        """Return the next row that affects the machine, or the number of rows at the end."""
        row += 1
        while row < len(self.path) and not self.does[row]:
            row += 1
        return row

    def contact_height(self, row: int, to_hole: bool = False) -> float:
        """Return the height where a level move, or the move to a hole, would touch the material, mm."""
        which = slice(int(self.first_piece[row]), int(self.first_piece[row + 1]))
        ends, over = self.loads.moves.ends[which], self.loads.removed.over[which]
        touches = np.minimum(ends[:, 2], ends[:, 5]) + over
        if to_hole:
            touches = touches[self.loads.moves.rapid[which] & ~self.loads.is_vertical[which]]
        elif not len(touches):
            return math.inf
        return self._contact_of_move(row, float(touches.max(initial=-math.inf)))

    def _contact_of_move(self, row: int, contact: float) -> float:
        way = self.path.end[row] - self.path.before[row]
        bent = self.dogleg and np.count_nonzero(np.abs(way) > _SAME) > 1
        return max(contact, self.top) if bent else contact

    def lowered_retracts(self) -> list[Lowered]:
        """Find retracts that can be lowered: straight up, across at a constant height, and straight down."""
        path = self.path
        rises = np.isin(path.kind, _MOVES) & (np.abs(path.end - path.before)[:, :2] < _SAME).all(axis=1)
        rises &= path.end[:, 2] > path.before[:, 2] + _WORTH
        return [one for row in np.flatnonzero(rises).tolist() for one in self._lower_retract(row)]

    def _lower_retract(self, rise: int) -> list[Lowered]:
        path = self.path
        high, start = float(path.end[rise, 2]), float(path.before[rise, 2])
        across, stated = [], [rise]
        row = self.next_effective_row(rise)
        while row < len(path) and path.kind[row] in _MOVES and abs(path.end[row, 2] - high) < _SAME:
            across.append(row)
            if "Z" in self._letters(row):
                stated.append(row)
            row = self.next_effective_row(row)
        if not across or row >= len(path) or path.kind[row] not in _MOVES:
            return []
        down = path.end[row] - path.before[row]
        if not (np.isfinite(down).all() and (np.abs(down[:2]) < _SAME).all() and down[2] < 0):
            return []
        if "Z" not in self._letters(row) or not all(self._is_changeable(one) for one in stated):
            return []
        lowest = max(self.contact_height(one) for one in across) + self.clearance
        if self.free[rise]:
            lengths = [float(np.linalg.norm(path.end[one] - path.before[one])) for one in (across[0], across[-1])]
            bottom = min(start, float(path.end[row, 2]))
            lowest += max(min(self.longest, 0.5 * max(lengths), lowest - bottom), 0.0)
        new = max(lowest, start, float(path.end[row, 2]))
        if not new < high - _WORTH or self._hits_obstacle(across, new):
            return []
        return [Lowered(self._block(one), "Z", new) for one in stated]

    def lowered_initial_heights(self) -> list[Lowered]:
        """Find initial heights (G98) of drilling series that can be lowered.

        At the new height, all moves stay clear of the material. An initial height never drops below an R plane of its
        series.
        """
        path = self.path
        sets = np.isin(path.kind, _MOVES) & np.isfinite(path.end[:, 2])
        sets &= ~(np.abs(path.end[:, 2] - path.before[:, 2]) < _SAME)
        return [one for row in np.flatnonzero(sets).tolist() for one in self._lower_initial_height(row)]

    def _lower_initial_height(self, first: int) -> list[Lowered]:
        path, high = self.path, float(self.path.end[first, 2])
        series = self._collect_at_height(first)
        if series is None or not all(self._states_height(one) for one in series.stated):
            return []
        lowest = max([*series.planes, *(contact + self.clearance for contact in series.contacts)])
        start = float(path.before[first, 2])
        straight = not self._letters(first) & {"X", "Y"}
        if start < high:
            if not straight:
                return []
            lowest = max(lowest, start)
        elif math.isfinite(start) or straight:
            lowest = max(lowest, self.contact_height(first) + self.clearance)
        else:
            return []
        moves = [*series.moves, first]
        if self.free[moves].any():
            lengths = [float(np.linalg.norm((path.end[one] - path.before[one])[:2])) for one in series.moves]
            bottom = min([*series.planes, start] if start < high else series.planes)
            lowest += max(min(self.longest, 0.5 * max(lengths, default=0.0), lowest - bottom), 0.0)
        if not lowest < high - _WORTH or self._hits_obstacle(moves, lowest):
            return []
        return [Lowered(self._block(one), "Z", lowest) for one in series.stated]

    def _collect_at_height(self, first: int) -> _MovesAtHeight | None:
        """Collect the cycles and travel moves at a stated height, up to the next vertical move.

        Return None if the height must not change.
        """
        path, high = self.path, float(self.path.end[first, 2])
        there = _MovesAtHeight([first], [], [], [])
        row, last, goes_on = self.next_effective_row(first), first, True
        while row < len(path) and goes_on:
            here = abs(float(path.before[row, 2]) - high) < _SAME
            hole = path.kind[row] == Kind.DRILL
            if not here and not (hole and path.kind[last] == Kind.DRILL):
                break
            added = self._add_hole(row, high, here, there) if hole else self._add_move(row, high, there)
            if added is None:
                return None
            goes_on = added
            row, last = self.next_effective_row(row), row
        ended = row < len(path) or not goes_on
        return there if ended and there.returns else None

    def _add_hole(self, row: int, high: float, here: bool, there: _MovesAtHeight) -> bool | None:
        """Add a hole that the tool reaches from the initial height or from the R plane.

        Returns
        -------
        bool | None
            Whether the scan may continue with the next row. None means that the height must not change.
        """
        path = self.path
        cycle = path.cycles[int(path.ref[row])]
        incremental = self.program.modal(self._block(row) + 1).incremental
        # The tool rises in a slanted line from the R plane to the next hole, so the start of the line must be clear.
        slants = cycle.approach == "slant" and not here
        if cycle.name in _KEEP_INITIAL or incremental or cycle.r_plane > high:
            return None
        if not slants and cycle.approach != "level":
            return None
        if slants and not self.contact_height(row, to_hole=True) + self.clearance <= float(path.before[row, 2]) + _SAME:
            return None
        there.planes.append(cycle.r_plane)
        there.returns |= abs(float(path.end[row, 2]) - high) < _SAME
        if self._moves_sideways(row) and (here or slants):
            there.contacts += [self._contact_at_plane(row, high)] if here else []
            there.moves.append(row)
        return True

    def _add_move(self, row: int, high: float, there: _MovesAtHeight) -> bool | None:
        """Add a row between or after the holes. Return the same values as `_add_hole`."""
        path, kind = self.path, self.path.kind[row]
        if kind in _STILL:
            return True
        if kind == Kind.MACHINE:
            return None if np.isfinite(path.end[row, :2]).any() else False
        if kind not in _MOVES:
            return None
        if abs(float(path.end[row, 2]) - high) < _SAME:
            there.contacts.append(self.contact_height(row))
            there.moves.append(row)
            there.stated += [row] if "Z" in self._letters(row) else []
            return True
        if self._moves_sideways(row):
            return None
        there.planes += [float(path.end[row, 2])] if path.end[row, 2] < high else []
        return False

    def _moves_sideways(self, row: int) -> bool:
        return bool((np.abs(self.path.end[row] - self.path.before[row])[:2] > _SAME).any())

    def _states_height(self, row: int) -> bool:
        """Return whether the Z of a move can be changed.

        The block may also contain offset, coolant and spindle words.
        """
        if self._is_changeable(row):
            return True
        program, block = self.program, self._block(row)
        rows = range(int(program.first[block]), int(program.first[block + 1]))
        others = {int(self.path.kind[one]) for one in rows if one != row}
        if block in program.fixed or block in program.descriptions or program.text_line[block] != program.line[block]:
            return False
        after = program.modal(block + 1)
        if after.incremental or after.radius != 40 or others & {int(kind) for kind in (*MOTIONS, Kind.MACHINE)}:
            return False
        letters = [word.letter for word in program.words(block)]
        return (
            letters.count("Z") == 1
            and set(letters) <= _LETTERS | _BESIDE_LETTERS
            and self._g_codes(row) <= _CODES | _BESIDE_CODES
        )

    def lowered_r_planes(self) -> list[Lowered]:
        """Find R planes that can be lowered, and the block that states each of them."""
        drills = np.flatnonzero(self.path.kind == Kind.DRILL)
        stated: list[list[int]] = []
        for row in drills.tolist():
            if "R" in self._letters(row) or not stated:
                stated.append([row])
            else:
                stated[-1].append(row)
        return [one for rows in stated for one in self._lower_r_plane(rows)]

    def _lower_r_plane(self, rows: list[int]) -> list[Lowered]:
        path = self.path
        cycles = [path.cycles[int(path.ref[row])] for row in rows]
        plane = cycles[0].r_plane
        if not self._plane_may_change(rows):
            return []
        contacts = [self._contact_at_plane(row, plane) for row in rows]
        moves = [row for row in rows if self._starts_at_plane(row, plane)]
        # Moves at this height after the last hole go to the next position or straight up.
        after = self.next_effective_row(rows[-1])
        while after < len(path) and abs(float(path.before[after, 2]) - plane) < _SAME:
            if path.kind[after] == Kind.DRILL:
                cycle = path.cycles[int(path.ref[after])]
                if cycle.to_initial or cycle.approach != "level":
                    return []
                contacts.append(self._contact_at_plane(after, plane))
                moves.append(after)
                break
            if path.kind[after] not in (Kind.RAPID, Kind.TOOL, Kind.MACHINE, Kind.END, Kind.PAUSE, Kind.SPINDLE):
                return []
            if path.kind[after] == Kind.MACHINE and np.isfinite(path.end[after, :2]).any():
                return []  # the path of this sideways move is unknown
            if path.kind[after] == Kind.RAPID:
                level = abs(float(path.end[after, 2]) - plane) < _SAME
                upright = bool((np.abs(path.end[after] - path.before[after])[:2] < _SAME).all())
                if "Z" in self._letters(after) and level:
                    return []
                if not level:
                    if not upright or path.end[after, 2] < plane:
                        return []
                    break
                contacts.append(self.contact_height(after))
                moves.append(after)
            after = self.next_effective_row(after)
        lowest = max(contacts) + self.clearance
        deepest = max(one.bottom for one in cycles)
        if not (deepest < lowest < plane - _WORTH) or self._hits_obstacle(moves, lowest):
            return []
        return [Lowered(self._block(rows[0]), "R", lowest)]

    def _plane_may_change(self, rows: list[int]) -> bool:
        cycles = [self.path.cycles[int(self.path.ref[row])] for row in rows]
        plane = cycles[0].r_plane
        if not self.program.is_plain(rows[0]) or "R" not in self._letters(rows[0]):
            return False
        if any(one.r_plane != plane or one.name in _KEEP_R for one in cycles):
            return False
        # A slanted approach that starts at another height would follow another path to a lower plane.
        slants = [row for one, row in zip(cycles, rows, strict=True) if one.approach == "slant"]
        if not all(self._starts_at_plane(row, plane) for row in slants):
            return False
        return not any(self.program.modal(self._block(row) + 1).incremental for row in rows)

    def _contact_at_plane(self, row: int, plane: float) -> float:
        """Return the height where a rapid to the R plane of a cycle first touches the material, mm."""
        which = slice(int(self.first_piece[row]), int(self.first_piece[row + 1]))
        moves, over = self.loads.moves, self.loads.removed.over[which]
        ends = moves.ends[which]
        low = np.minimum(ends[:, 2], ends[:, 5])
        goes = (ends[:, 5] <= ends[:, 2] + _SAME) | ~self.loads.is_vertical[which]
        mine = moves.rapid[which] & (np.abs(low - plane) < _SAME) & goes
        # Pecking cycles rapid back into their own hole, but stay above the remaining material.
        contact = float((low + over)[mine].max(initial=-math.inf))
        if self._starts_at_plane(row, plane):
            contact = self._contact_of_move(row, contact)
        return contact if math.isfinite(contact) else math.inf

    def _starts_at_plane(self, row: int, plane: float) -> bool:
        return abs(float(self.path.before[row, 2]) - plane) < _SAME

    def _block(self, row: int) -> int:
        return int(self.program.row_block[row])

    def _letters(self, row: int) -> set[str]:
        return {word.letter for word in self.program.words(self._block(row))}

    def _is_changeable(self, row: int) -> bool:
        return self.program.is_plain(row) and self._letters(row) <= _LETTERS and self._g_codes(row) <= _CODES

    def _g_codes(self, row: int) -> set[float]:
        return {word.value for word in self.program.words(self._block(row)) if word.letter == "G"}
