"""How low a program may go between its cuts: retracts, R planes and cycles just above what stands under the way."""

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
from leafcut.processes.program.plan.corners import longest_rounding, rounds_freely
from leafcut.processes.program.plan.plain_blocks import block_of_row, is_plain, words_of_row

#: What is lowered by less is left as it is, mm.
_WORTH = 0.25
_SAME = 1e-6
_LETTERS = frozenset("NGXYZF")
_CODES = frozenset((0, 1, 17, 18, 19, 40, 90, 94))
#: What may stand beside the height that cycles come up to: a tool length offset, a work offset, coolant and spindle.
_BESIDE_LETTERS = frozenset("HMS")
_BESIDE_CODES = frozenset((43, 54, 55, 56, 57, 58, 59))
#: Rows that leave the tool where it is.
_STILL = (Kind.SPINDLE, Kind.DWELL)
#: What goes from one cut to the next: a rapid, or at feed through the air.
_WAYS = (Kind.RAPID, Kind.FEED)
#: Cycles whose R plane has to do with the pitch of a thread, or with a tool that turns to one side.
_KEEP_R = ("G74", "G76", "G84", "G87", "G88")
#: Cycles that an operator, or a turned tool, comes out of at the initial height.
_KEEP_INITIAL = ("G76", "G87", "G88")


@dataclass
class _AtHeight:
    """What is done at one height, mm.

    Rows that state it, rows of ways at it, where those would touch the material, what it stays above, and whether a
    cycle comes up to it.
    """

    stated: list[int]
    ways: list[int]
    contacts: list[float]
    planes: list[float]
    returns: bool = False


class LowWays:
    """What of a program may be lower, so that every way keeps a clearance from what stands under it.

    Where a controller may round corners as far as it likes, a retract is as much higher as it may begin to go across
    too early. A way over a named obstacle stays as high as it is.

    Parameters
    ----------
    top
        Nothing stands higher, mm: what holds for rapids whose way is not straight.
    """

    #: Lines of ways over named obstacles that would be lower without these.
    kept: set[int]

    def __init__(
        self, program: Program, loads: Loads, clearance: float, machine: Machine, top: float,
        obstacles: Obstacles | None = None,
    ) -> None:  # fmt: skip
        self.program, self.path, self.loads = program, program.path, loads
        self.obstacles, self.kept = obstacles, set()
        self.clearance, self.top = clearance, top
        self.dogleg = machine.rapid_style == "dogleg"
        self.free = rounds_freely(self.path, machine, clearance)
        self.longest = longest_rounding(machine)
        rows = np.arange(len(self.path) + 1)
        self.first_piece = np.searchsorted(loads.source, rows, side="left")
        moving = np.isin(self.path.kind, [int(k) for k in MOTIONS])
        self.does = moving | np.isin(
            self.path.kind,
            [int(k) for k in (Kind.TOOL, Kind.MACHINE, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN, Kind.PAUSE, Kind.END,
                              Kind.OFFSET, Kind.RADIUS, Kind.DWELL, Kind.SPINDLE)],
        )  # fmt: skip

    def heights(self) -> list[Lowered]:
        """Return the heights of retracts and R planes that may be lower."""
        return [*self.retracts(), *self.r_planes()]

    def returns(self) -> list[CycleReturn]:
        """Return where series of holes that come up to their initial height (G98) may stay at their R plane (G99).

        The last hole of a series comes up as before, so that what is behind it begins at the same height.
        """
        found: list[CycleReturn] = []
        series: list[int] = []
        drills = np.flatnonzero(self.path.kind == Kind.DRILL).tolist()
        for row in drills:
            if series and self.next(series[-1]) != row:
                found += self._returns(series)
                series = []
            series.append(row)
        return [*found, *(self._returns(series) if series else [])]

    def _returns(self, series: list[int]) -> list[CycleReturn]:
        cycles = [self.path.cycles[int(self.path.ref[row])] for row in series]
        if not all(one.to_initial and one.approach == "level" and one.name not in _KEEP_R for one in cycles):
            return []
        plane = cycles[0].r_plane
        if any(one.r_plane != plane for one in cycles) or not all(self._drills_alone(row) for row in series):
            return []
        found = []
        state = 98
        for row, behind in zip(series, [*series[1:], None], strict=True):
            code = 98 if behind is None or not self._stays(row, behind, plane) else 99
            if code != state or {98.0, 99.0} & self._codes(row):
                found.append(CycleReturn(self._block(row), code))
            state = code
        return found if any(one.code == 99 for one in found) else []

    def _drills_alone(self, row: int) -> bool:
        """Return whether a hole is all that its block does, so that another word may be put into it."""
        return is_plain(self.program, row) and not self.program.modal(self._block(row) + 1).incremental

    def _stays(self, row: int, behind: int, plane: float) -> bool:
        """Return whether the way from one hole to the next may be at the R plane."""
        if not self.path.end[row, 2] > plane + _WORTH:
            return False
        return self._across(behind) + self.clearance <= plane + _SAME and not self._over_obstacle([behind], plane)

    def _across(self, row: int) -> float:
        """Return the height at which the tool would touch the material on its way to a hole, mm."""
        which = slice(int(self.first_piece[row]), int(self.first_piece[row + 1]))
        ends, over = self.loads.moves.ends[which], self.loads.removed.over[which]
        across = self.loads.moves.rapid[which] & ~self.loads.upright[which]
        low = np.minimum(ends[:, 2], ends[:, 5])
        return self._of_way(row, float((low + over)[across].max(initial=-math.inf)))

    def _over_obstacle(self, ways: list[int], height: float) -> bool:
        """Return whether a way that is to be lower goes over a named obstacle, and keep its line in mind."""
        if self.obstacles is None or height >= self.obstacles.height:
            return False
        over = [row for row in ways if height < self._least_height(row)]
        self.kept.update(int(self.path.line[row]) for row in over)
        return bool(over)

    def _least_height(self, row: int) -> float:
        """Return the height at or above which a way crosses all obstacles under it, mm; −∞ where there is none."""
        assert self.obstacles is not None
        (x0, y0), (x1, y1) = self.path.before[row, :2].tolist(), self.path.end[row, :2].tolist()
        return self.obstacles.between((x0, y0), (x1, y1), int(self.path.tool[row]))

    def next(self, row: int) -> int:
        """Return the next row that does anything, or the number of rows."""
        row += 1
        while row < len(self.path) and not self.does[row]:
            row += 1
        return row

    def contact(self, row: int) -> float:
        """Return the height at which the tool would touch the material on the level way of a row, mm."""
        which = slice(int(self.first_piece[row]), int(self.first_piece[row + 1]))
        ends, over = self.loads.moves.ends[which], self.loads.removed.over[which]
        if not len(over):
            return math.inf
        low = np.minimum(ends[:, 2], ends[:, 5])
        return self._of_way(row, float((low + over).max()))

    def _of_way(self, row: int, contact: float) -> float:
        way = self.path.end[row] - self.path.before[row]
        bent = self.dogleg and np.count_nonzero(np.abs(way) > _SAME) > 1
        return max(contact, self.top) if bent else contact

    def retracts(self) -> list[Lowered]:
        """Return retracts straight up, with rapids across behind them and a way straight down at their end."""
        found: list[Lowered] = []
        path = self.path
        rises = np.isin(path.kind, _WAYS) & (np.abs(path.end - path.before)[:, :2] < _SAME).all(axis=1)
        rises &= path.end[:, 2] > path.before[:, 2] + _WORTH
        for row in np.flatnonzero(rises).tolist():
            found += self._retract(row)
        return found

    def _retract(self, rise: int) -> list[Lowered]:
        path = self.path
        high, start = float(path.end[rise, 2]), float(path.before[rise, 2])
        across, stated = [], [rise]
        row = self.next(rise)
        while row < len(path) and path.kind[row] in _WAYS and abs(path.end[row, 2] - high) < _SAME:
            across.append(row)
            if "Z" in self._letters(row):
                stated.append(row)
            row = self.next(row)
        if not across or row >= len(path) or path.kind[row] not in _WAYS:
            return []
        down = path.end[row] - path.before[row]
        if not (np.isfinite(down).all() and (np.abs(down[:2]) < _SAME).all() and down[2] < 0):
            return []
        if "Z" not in self._letters(row) or not all(self._plain(one) for one in stated):
            return []
        lowest = max(self.contact(one) for one in across) + self.clearance
        if self.free[rise]:
            ways = [float(np.linalg.norm(path.end[one] - path.before[one])) for one in (across[0], across[-1])]
            bottom = min(start, float(path.end[row, 2]))
            lowest += max(min(self.longest, 0.5 * max(ways), lowest - bottom), 0.0)
        new = max(lowest, start, float(path.end[row, 2]))
        if not new < high - _WORTH or self._over_obstacle(across, new):
            return []
        return [Lowered(self._block(one), "Z", new) for one in stated]

    def initials(self) -> list[Lowered]:
        """Return the heights before series of cycles that come up to them (G98): the words that state each.

        They are as low as all ways at them allow, those from hole to hole and those behind the last one, and no lower
        than an R plane of the series.
        """
        found: list[Lowered] = []
        path = self.path
        sets = np.isin(path.kind, _WAYS) & np.isfinite(path.end[:, 2])
        sets &= ~(np.abs(path.end[:, 2] - path.before[:, 2]) < _SAME)
        for row in np.flatnonzero(sets).tolist():
            found += self._initial(row)
        return found

    def _initial(self, first: int) -> list[Lowered]:
        path, high = self.path, float(self.path.end[first, 2])
        series = self._at_height(first)
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
            lowest = max(lowest, self.contact(first) + self.clearance)
        else:
            return []
        ways = [*series.ways, first]
        if self.free[ways].any():
            lengths = [float(np.linalg.norm((path.end[one] - path.before[one])[:2])) for one in series.ways]
            bottom = min([*series.planes, start] if start < high else series.planes)
            lowest += max(min(self.longest, 0.5 * max(lengths, default=0.0), lowest - bottom), 0.0)
        if not lowest < high - _WORTH or self._over_obstacle(ways, lowest):
            return []
        return [Lowered(self._block(one), "Z", lowest) for one in series.stated]

    def _at_height(self, first: int) -> _AtHeight | None:
        """Return what is done at the height that a row states; None where that must stay.

        There are cycles that come up to it, and ways at it, up to a way straight up or down.
        """
        path, high = self.path, float(self.path.end[first, 2])
        there = _AtHeight([first], [], [], [])
        row, last, goes_on = self.next(first), first, True
        while row < len(path) and goes_on:
            here = abs(float(path.before[row, 2]) - high) < _SAME
            hole = path.kind[row] == Kind.DRILL
            if not here and not (hole and path.kind[last] == Kind.DRILL):
                break
            added = self._add_hole(row, high, here, there) if hole else self._add_way(row, high, there)
            if added is None:
                return None
            goes_on = added
            row, last = self.next(row), row
        ended = row < len(path) or not goes_on
        return there if ended and there.returns else None

    def _add_hole(self, row: int, high: float, here: bool, there: _AtHeight) -> bool | None:
        """Add a hole of a series that began at a height, to which it comes from there or from its R plane.

        Return whether more may follow; None: the height must stay.
        """
        path = self.path
        cycle = path.cycles[int(path.ref[row])]
        incremental = self.program.modal(self._block(row) + 1).incremental
        # From an R plane up to the height over the next hole: another way, that keeps clear where it begins.
        slants = cycle.approach == "slant" and not here
        if cycle.name in _KEEP_INITIAL or incremental or cycle.r_plane > high:
            return None
        if not slants and cycle.approach != "level":
            return None
        if slants and not self._across(row) + self.clearance <= float(path.before[row, 2]) + _SAME:
            return None
        there.planes.append(cycle.r_plane)
        there.returns |= abs(float(path.end[row, 2]) - high) < _SAME
        if self._goes_across(row) and (here or slants):
            there.contacts += [self._at_plane(row, high)] if here else []
            there.ways.append(row)
        return True

    def _add_way(self, row: int, high: float, there: _AtHeight) -> bool | None:
        """Add what is done at a height between holes and behind them; see `_add_hole`."""
        path, kind = self.path, self.path.kind[row]
        if kind in _STILL:
            return True
        if kind == Kind.MACHINE:
            return None if np.isfinite(path.end[row, :2]).any() else False
        if kind not in _WAYS:
            return None
        if abs(float(path.end[row, 2]) - high) < _SAME:
            there.contacts.append(self.contact(row))
            there.ways.append(row)
            there.stated += [row] if "Z" in self._letters(row) else []
            return True
        if self._goes_across(row):
            return None
        there.planes += [float(path.end[row, 2])] if path.end[row, 2] < high else []
        return False

    def _goes_across(self, row: int) -> bool:
        return bool((np.abs(self.path.end[row] - self.path.before[row])[:2] > _SAME).any())

    def _states_height(self, row: int) -> bool:
        """Return whether another height may be put into the block of a way, whatever else that says of the tool."""
        if self._plain(row):
            return True
        program, block = self.program, self._block(row)
        rows = range(int(program.first[block]), int(program.first[block + 1]))
        others = {int(self.path.kind[one]) for one in rows if one != row}
        if block in program.fixed or block in program.said or program.text_line[block] != program.line[block]:
            return False
        after = program.modal(block + 1)
        if after.incremental or after.radius != 40 or others & {int(kind) for kind in (*MOTIONS, Kind.MACHINE)}:
            return False
        letters = [word.letter for word in words_of_row(program, row)]
        return (
            letters.count("Z") == 1
            and set(letters) <= _LETTERS | _BESIDE_LETTERS
            and self._codes(row) <= _CODES | _BESIDE_CODES
        )

    def r_planes(self) -> list[Lowered]:
        """Return R planes of cycles, by the block that states each."""
        found: list[Lowered] = []
        drills = np.flatnonzero(self.path.kind == Kind.DRILL)
        stated: list[list[int]] = []
        for row in drills.tolist():
            if "R" in self._letters(row) or not stated:
                stated.append([row])
            else:
                stated[-1].append(row)
        for rows in stated:
            found += self._r_plane(rows)
        return found

    def _r_plane(self, rows: list[int]) -> list[Lowered]:
        path = self.path
        cycles = [path.cycles[int(path.ref[row])] for row in rows]
        plane = cycles[0].r_plane
        if not self._plane_may_change(rows):
            return []
        contacts = [self._at_plane(row, plane) for row in rows]
        ways = [row for row in rows if self._begins_at(row, plane)]
        # What comes behind the last hole at this height: the way to the next place, straight up, or nothing known.
        after = self.next(rows[-1])
        while after < len(path) and abs(float(path.before[after, 2]) - plane) < _SAME:
            if path.kind[after] == Kind.DRILL:
                cycle = path.cycles[int(path.ref[after])]
                if cycle.to_initial or cycle.approach != "level":
                    return []
                contacts.append(self._at_plane(after, plane))
                ways.append(after)
                break
            if path.kind[after] not in (Kind.RAPID, Kind.TOOL, Kind.MACHINE, Kind.END, Kind.PAUSE, Kind.SPINDLE):
                return []
            if path.kind[after] == Kind.MACHINE and np.isfinite(path.end[after, :2]).any():
                return []  # where it goes across is not known here
            if path.kind[after] == Kind.RAPID:
                level = abs(float(path.end[after, 2]) - plane) < _SAME
                upright = bool((np.abs(path.end[after] - path.before[after])[:2] < _SAME).all())
                if "Z" in self._letters(after) and level:
                    return []
                if not level:
                    if not upright or path.end[after, 2] < plane:
                        return []
                    break
                contacts.append(self.contact(after))
                ways.append(after)
            after = self.next(after)
        lowest = max(contacts) + self.clearance
        deepest = max(one.bottom for one in cycles)
        if not (deepest < lowest < plane - _WORTH) or self._over_obstacle(ways, lowest):
            return []
        return [Lowered(self._block(rows[0]), "R", lowest)]

    def _plane_may_change(self, rows: list[int]) -> bool:
        """Return whether the R plane that the first of some holes states may be another one."""
        cycles = [self.path.cycles[int(self.path.ref[row])] for row in rows]
        plane = cycles[0].r_plane
        if not is_plain(self.program, rows[0]) or "R" not in self._letters(rows[0]):
            return False
        if any(one.r_plane != plane or one.name in _KEEP_R for one in cycles):
            return False
        # A slant from another height than the plane gets another way where the plane is lower.
        slants = [row for one, row in zip(cycles, rows, strict=True) if one.approach == "slant"]
        if not all(self._begins_at(row, plane) for row in slants):
            return False
        return not any(self.program.modal(self._block(row) + 1).incremental for row in rows)

    def _at_plane(self, row: int, plane: float) -> float:
        """Return the highest contact of those rapids of a cycle that end at its R plane, mm."""
        which = slice(int(self.first_piece[row]), int(self.first_piece[row + 1]))
        moves, over = self.loads.moves, self.loads.removed.over[which]
        ends = moves.ends[which]
        low = np.minimum(ends[:, 2], ends[:, 5])
        goes = (ends[:, 5] <= ends[:, 2] + _SAME) | ~self.loads.upright[which]
        mine = moves.rapid[which] & (np.abs(low - plane) < _SAME) & goes
        # Pecking cycles come down again into their own hole: that is above what is left of it.
        contact = float((low + over)[mine].max(initial=-math.inf))
        if self._begins_at(row, plane):
            contact = self._of_way(row, contact)
        return contact if math.isfinite(contact) else math.inf

    def _begins_at(self, row: int, plane: float) -> bool:
        return abs(float(self.path.before[row, 2]) - plane) < _SAME

    def _block(self, row: int) -> int:
        return block_of_row(self.program, row)

    def _letters(self, row: int) -> set[str]:
        return {word.letter for word in words_of_row(self.program, row)}

    def _plain(self, row: int) -> bool:
        """Return whether a way may end at another height."""
        return is_plain(self.program, row) and self._letters(row) <= _LETTERS and self._codes(row) <= _CODES

    def _codes(self, row: int) -> set[float]:
        return {word.value for word in words_of_row(self.program, row) if word.letter == "G"}
