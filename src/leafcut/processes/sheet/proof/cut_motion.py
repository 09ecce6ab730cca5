"""Read a cutting program back and compare it with the plan.

The comparison covers the moves and the state of the torch during each move. Some actions are performed by the
controller itself. This module has its own rules for them, so it does not depend on the post-processor.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import count_of
from leafcut.gcode.dialects import Dialect, Torch
from leafcut.gcode.torch import KERF_REGISTER
from leafcut.message import Message
from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.model.toolpath import MOTIONS, SPEED_ALONE, Kind, Motion, Toolpath
from leafcut.proof.difference import describe_motion, limit_differences
from leafcut.proof.program import interpret_written_program as as_written
from leafcut.proof.read_back import DWELL_ROUNDING, SPEED_ROUNDING, compare_motion
from leafcut.units import MM_PER_INCH


class _State(NamedTuple):
    """The state of the torch during a move, and the events since the previous move."""

    #: 0 if off, 1 if cutting, 2 if marking.
    beam: float = 0.0
    #: Power of the beam, if the S word states it.
    power: float = 0.0
    #: Whether height control is on.
    follows: float = 1.0
    #: Compensation (40, 41 or 42). The next field is the kerf width, mm, or the register that contains it.
    side: float = 40.0
    kerf: float = 0.0
    #: 1 if corners are rounded (G64), and their tolerance, mm.
    blends: float = 0.0
    tolerance: float = 0.0
    #: How often the torch was switched on.
    pierces: float = 0.0
    #: Dwell times with the torch off and with the torch on, s.
    dark_s: float = 0.0
    lit_s: float = 0.0


#: Descriptions of the fields of `_State`.
_NAMES = (
    Message("torch (0 dark, 1 cuts, 2 marks)"),
    Message("power"),
    Message("height control"),
    Message("side of the kerf"),
    Message("kerf"),
    Message("path control"),
    Message("tolerance of corners"),
    Message("number of pierces"),
    Message("dwell before the torch is lit"),
    Message("dwell after the torch is lit"),
)


def check_cut_motion(planned: Toolpath, written: Toolpath, dialect: Dialect, units: str) -> list[Difference]:
    """Return the differences between the plan and the program, in both the moves and the state of the torch.

    Actions that the controller performs itself are ignored. `units` is the unit of the program, ``mm`` or ``inch``.
    """
    half = 0.5 * 10.0**-dialect.decimals_mm
    if units == "inch":
        half = 0.5 * MM_PER_INCH * 10.0**-dialect.decimals_inch
    tolerance = half * 1.001 + 1e-9
    torch = dialect.torch
    if torch is None:
        return compare_motion(planned, written, tolerance)
    moves, states = _TorchTracker(dialect, torch, 2.0 * tolerance, planned=True).moves_with_states(planned)
    read, found = _TorchTracker(dialect, torch, 2.0 * tolerance, planned=False).moves_with_states(written)
    if differences := compare_motion(moves, read, tolerance):
        return differences
    if len(states) != len(found):
        return [
            Difference(
                Message("motion"), 0, 0, Message("{} planned, {} written", count_of(len(states), "move"), len(found))
            )
        ]
    room = np.array(
        _State(0.0, SPEED_ROUNDING, 0.0, 0.0, tolerance, 0.0, tolerance, 0.0, DWELL_ROUNDING, DWELL_ROUNDING)
    )
    wrong = np.abs(states - found) > room + 1e-9
    rows = np.flatnonzero(wrong.any(axis=1))
    differences = [_difference(read, states, found, wrong, int(row)) for row in rows[:100].tolist()]
    return limit_differences(differences, len(rows))


def _difference(
    read: Toolpath,
    states: NDArray[np.float64],
    found: NDArray[np.float64],
    wrong: NDArray[np.bool_],
    row: int,
) -> Difference:
    column = int(np.flatnonzero(wrong[row])[0])
    text = Message(
        "at {}: {} {:g} became {:g}",
        describe_motion(read[row]),
        _NAMES[column],
        states[row, column],
        found[row, column],
    )
    return Difference(Message("torch"), 0, int(read.line[row]), text)


class _TorchTracker:
    """Tracks the state of the torch along a path.

    If the path is `planned`, the tracker ignores actions that the controller performs itself.
    """

    def __init__(self, dialect: Dialect, torch: Torch, shortest: float, *, planned: bool) -> None:
        self.dialect, self.torch, self.shortest, self.planned = dialect, torch, shortest, planned
        self.now = _State()
        #: `armed` is like `_State.beam`. If `dark` is set, an output or S0 keeps the torch off in spite of it.
        self.armed, self.dark = 0.0, False
        self.power = 0.0
        #: Whether the torch was switched on a moment ago, so that a pierce delay may follow.
        self.piercing = False

    def moves_with_states(self, path: Toolpath) -> tuple[Toolpath, NDArray[np.float64]]:
        """Return the moves and commands of a path, and the `_State` at each of them, float64[n, 10].

        Straight moves of at most `shortest` mm are left out. The events before such a move count for the next move.
        """
        rows, states = list[Motion](), list[_State]()
        last = [math.nan] * 3
        for given in path:
            # A plan contains no offsets; `proof.torch.check_lighting_tool` checks them.
            if self._apply_switch(given) or given.kind is Kind.OFFSET:
                continue
            self.piercing &= given.kind not in MOTIONS
            if self.planned and not self.dialect.has_z_words and given.kind in (Kind.PROBE, Kind.SHIFT):
                continue
            row = given if self.dialect.has_z_words else given._replace(end=(*given.end[:2], math.nan))
            if row.kind in (Kind.RAPID, Kind.FEED) and self._is_still(row, last):
                continue
            if row.kind in MOTIONS:
                last = [q if math.isnan(p) else p for p, q in zip(row.end, last, strict=True)]
            rows.append(row)
            beam = 0.0 if self.dark else self.armed
            states.append(self.now._replace(beam=beam, power=self.power if beam and self.torch.power else 0.0))
            self.now = self.now._replace(pierces=0.0, dark_s=0.0, lit_s=0.0)
        arcs = path.arcs
        if not self.dialect.has_z_words:
            arcs = tuple(replace(arc, center=(*arc.center[:2], math.nan)) for arc in arcs)
        moves = replace(Toolpath.of_motions(rows), arcs=tuple(arcs), cycles=path.cycles)
        return moves, np.array(states, dtype=np.float64).reshape(-1, len(_NAMES))

    def _is_still(self, row: Motion, last: list[float]) -> bool:
        return all(math.isnan(p) or abs(p - q) <= self.shortest for p, q in zip(row.end, last, strict=True))

    def _apply_switch(self, row: Motion) -> bool:
        """Apply a row that only changes the state of the torch. Return False if the row does anything else."""
        kind, torch, now = row.kind, self.torch, self.now
        if kind is Kind.SPINDLE:
            self._record_lighting(row)
        elif kind is Kind.TORCH:
            # If no output can suspend the torch, a dark torch is switched off.
            self.dark = torch.can_switch_off_along_path and row.value == 0.0
            self.armed *= torch.can_switch_off_along_path
        elif kind is Kind.HEIGHT:
            self.now = now if torch.height_output is None else now._replace(follows=row.value)
        elif kind is Kind.RADIUS:
            on = row.ref != 40
            by_register = self.planned and torch.compensation == "G41"
            self.now = now._replace(side=row.ref, kerf=on * (KERF_REGISTER if by_register else row.value))
        elif kind is Kind.BLENDING:
            on = row.ref == 640 and 640 in self.dialect.g_codes
            # On a Fanuc, G64 has no tolerance.
            states = on and not (self.planned and self.dialect.groups == "fanuc")
            self.now = now._replace(blends=on, tolerance=states * row.value)
        elif kind is Kind.DWELL:
            self._record_dwell(row.value)
        else:
            return False
        return True

    def _record_lighting(self, row: Motion) -> None:
        if row.ref == SPEED_ALONE:
            self.power = abs(row.value)
            return
        if row.value and not self.armed:
            self.now = self.now._replace(pierces=self.now.pierces + 1.0)
            self.piercing = True
        marks = row.ref != 0 and self.torch.mark_on != self.torch.on
        self.armed = 0.0 if not row.value else 2.0 if marks else 1.0
        self.power = abs(row.value)

    def _record_dwell(self, seconds: float) -> None:
        if self.planned and self.piercing and not self.torch.waits:
            self.piercing = False
        elif self.armed and not self.dark:
            self.now = self.now._replace(lit_s=self.now.lit_s + seconds)
        else:
            self.now = self.now._replace(dark_s=self.now.dark_s + seconds)


def read_cut_program(text: str, plan: CutPlan, dialect: Dialect, material_number: int | None = None) -> Toolpath:
    """Read a cutting program back and return the motion that its controller would execute.

    Modal states that an earlier program left behind do not affect the result. If the controller takes feeds from its
    material table, only the feed of the material `material_number` is known, which is the feed of the plan.

    Raises
    ------
    ReadError
        If the controller does not accept the text, or if the text selects another material.
    """
    feeds = {} if material_number is None else {material_number: plan.data.feed}
    return as_written(text, dialect, material_feeds=feeds)
