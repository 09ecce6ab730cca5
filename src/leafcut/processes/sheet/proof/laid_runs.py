"""The runs of a cutting program laid over the shapes of a sheet: which run follows which contour, and how far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from leafcut.gcode.dialects import Dialect
from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.model.machine import Probe
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE, SheetShapes, Target
from leafcut.processes.sheet.proof.torch_runs import TorchRun, pieces_of

#: Chords are looked at in pieces no longer than this, mm.
PIECE = 1.0
#: A run cuts a contour when it follows so much of its way.
MOST = 0.5


@dataclass(frozen=True)
class Asked:
    """What was asked for besides the plan: half of the kerf that is compensated, mm, and how parts may hang on.

    `joints` micro-joints of an outline at most, each no wider than `joint_width` mm,
    `safe_height` of rapids, mm; `probe`: how the sheet is found before every pierce; `power`: of a beam that cuts, so
    that one with less marks; None: the most that the program says. `material_number` of the controller's table; None:
    the program states the material.
    """

    half: float
    joints: int = 0
    joint_width: float = 0.0
    safe_height: float | None = None
    probe: Probe | None = None
    power: float | None = None
    material_number: int | None = None


@dataclass(frozen=True)
class Claim:
    """A run follows the way of a target: how much of it, mm, and from where to where along the run."""

    run: int
    target: Target
    followed: float
    first: float
    last: float
    clockwise: bool


class LaidRuns:
    """The runs of a program laid over the shapes of a sheet.

    Attributes
    ----------
    marks
        Of every run, whether it marks.
    lines
        What every run burns, shapely lines.
    claims, of_target
        Who follows what, and the same by the index of the contour.
    """

    def __init__(
        self, runs: list[TorchRun], plan: CutPlan, shapes: SheetShapes, dialect: Dialect, asked: Asked
    ) -> None:
        self.runs, self.plan, self.shapes, self.asked = runs, plan, shapes, asked
        self.marks = _marking(runs, dialect, asked.power)
        self.lines = np.array([shapely.MultiLineString(run.lines()) for run in runs], dtype=object)
        ways = np.array([t.way for t in shapes.targets], dtype=object)
        self.pairs = shapely.STRtree(ways).query(self.lines, predicate="dwithin", distance=TOLERANCE).T.tolist()
        claims = [self._claim(run, shapes.targets[number]) for run, number in self.pairs]
        self.claims = [c for c in claims if c is not None and self.marks[c.run] == c.target.marks]
        self.of_target: dict[int, list[Claim]] = {}
        for claim in self.claims:
            self.of_target.setdefault(claim.target.index, []).append(claim)

    def _claim(self, number: int, target: Target) -> Claim | None:
        run = self.runs[number]
        middles, lengths, along = pieces_of(run, PIECE)
        near = shapely.dwithin(target.way, shapely.points(middles), TOLERANCE)
        if not near.any():
            return None
        own = middles[near]
        centre = own.mean(axis=0)
        step = np.roll(own, -1, axis=0) - own
        swept = float(np.sum((own - centre)[:, 0] * step[:, 1] - (own - centre)[:, 1] * step[:, 0]))
        half = 0.5 * lengths[near]
        return Claim(
            number,
            target,
            float(lengths[near].sum()),
            float((along[near] - half).min()),
            float((along[near] + half).max()),
            swept < 0.0,
        )

    def pierces(self, number: int) -> bool:
        """Return whether a run begins by going through the sheet."""
        cuts = self.plan.cuts
        return cuts[number].pierce if number < len(cuts) else True

    def frees(self, claim: Claim) -> bool:
        """Return whether a run is one that cuts a contour loose; that of a part a kerf away only follows an edge."""
        whole = claim.followed > MOST * claim.target.way.length and not self.passes(claim)
        return whole or (claim.run < len(self.plan.cuts) and claim.target.index in self.plan.cuts[claim.run].contours)

    def passes(self, claim: Claim) -> bool:
        """Return whether a run around other parts with common lines follows a contour only as it lies a kerf away."""
        cut = self.plan.cuts[claim.run] if claim.run < len(self.plan.cuts) else None
        return cut is not None and cut.group > 0 and claim.target.index not in cut.contours

    def line_at(self, number: int, x: float, y: float) -> int:
        """Return the line of the program whose chord is nearest to a place."""
        run = self.runs[number]
        chords = shapely.linestrings(np.stack([run.points[:-1], run.points[1:]], axis=1))
        return int(run.row_line[int(np.argmin(shapely.distance(chords, shapely.Point(x, y))))])


def _marking(runs: list[TorchRun], dialect: Dialect, power: float | None) -> list[bool]:
    """Return which runs mark: by another spindle, or by less power than what cuts."""
    most = power if power is not None else max((light.power for run in runs for light in run.lightings), default=0.0)
    by_power = dialect.torch is not None and dialect.torch.power
    return [
        bool(run.lightings) and all(light.spindle != 0 or (by_power and light.power < most) for light in run.lightings)
        for run in runs
    ]


def wrong(what: str, text: str, line: int) -> Difference:
    """Return a difference of no single feature, with its line."""
    return Difference(what, 0, line, text)
