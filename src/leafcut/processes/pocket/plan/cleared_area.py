"""What a level's runs have cleared so far, where the tool is to come down again."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import FINE, quarter
from leafcut.model.pocket import PocketRules

#: Part of the tool's radius by which what is cleared may miss its disc, and the tool still feeds straight down there.
_SLIVER = 0.02
#: The same, in tolerances, where it comes down by a rapid: less than the proof allows.
_FILM = 0.5


class Opened(IntEnum):
    """Whether what was cut before lets the tool come down at a place: not, but for a sliver, or all of it."""

    NO = 0
    NEARLY = 1
    CLEAR = 2


class ClearedArea:
    """The ground that runs clear, one after the other."""

    def __init__(self, rules: PocketRules) -> None:
        self.rules = rules
        self._chords: list[Any] = []

    def after(self, run: Polyline) -> Opened:
        """Return whether the place where a run begins is cleared, and then count what the run clears."""
        opened = self._opened(shapely.Point(run.start))
        points = run.flattened(FINE * self.rules.tolerance)
        self._chords.append(shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1)))
        return opened

    def cleared(self) -> Any:
        """Return all that the runs clear: shapely geometry."""
        return shapely.union_all(shapely.buffer(np.concatenate([[], *self._chords]), self.rules.radius, quad_segs=32))

    def _opened(self, start: Any) -> Opened:
        radius, tolerance = self.rules.radius, self.rules.tolerance
        near = [chords[shapely.dwithin(chords, start, 2.0 * radius)] for chords in self._chords]
        chords = quarter(radius, FINE * tolerance)
        # Chord by chord: a buffer of the whole line would round its hollows.
        cleared = shapely.union_all(shapely.buffer(np.concatenate([[], *near]), radius, quad_segs=chords))
        if cleared.covers(start.buffer(radius - _FILM * tolerance, quad_segs=chords)):
            return Opened.CLEAR
        return Opened.NEARLY if cleared.covers(start.buffer((1.0 - _SLIVER) * radius)) else Opened.NO
