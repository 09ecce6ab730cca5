"""Match each torch run of a cutting program with the contours that the run follows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.dialects import Dialect
from leafcut.message import Message
from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.model.machine import Probe
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE, Target, build_targets, part_areas
from leafcut.processes.sheet.proof.torch_runs import FLATNESS, TorchRun, burning_sections

#: Chords are divided into sections of at most this length, mm.
PIECE = 1.0
#: A run counts as a cut of a contour if it follows more than this share of the path of the contour.
MOST = 0.5


@dataclass(frozen=True)
class CutRequest:
    """Requests of the user that the plan does not contain.

    Attributes
    ----------
    half
        Half of the compensated kerf, mm.
    joints, joint_width
        Maximum number of micro-joints of an outline, and their maximum width, mm.
    safe_height
        Minimum height of rapids, mm.
    probe
        The probe for touching off; None if the program must not probe.
    power
        Power for cutting. Any lower power is for marking. None stands for the maximum power in the program.
    material_number
        Number in the material table of the controller; None if the program itself specifies the material.
    """

    half: float
    joints: int = 0
    joint_width: float = 0.0
    safe_height: float | None = None
    probe: Probe | None = None
    power: float | None = None
    material_number: int | None = None


@dataclass(frozen=True)
class RunMatch:
    """A run that follows the path of a target.

    Attributes
    ----------
    followed
        Length of the path that the run follows, mm.
    first, last
        First and last position at which the run is on the path, mm along the run.
    """

    run: int
    target: Target
    followed: float
    first: float
    last: float
    clockwise: bool


class MatchedRuns:
    """The runs of a program and the shapes of the sheet that they follow.

    Attributes
    ----------
    targets
        The contours to cut or mark, in the order of the sheet.
    parts, numbers
        Areas of the finished parts, shrunk by `TOLERANCE`, and the part numbers.
    sheet
        Area of the sheet; None if unknown.
    lines
        The path of each run while the torch is on, as shapely lines.
    of_target
        The matches, keyed by the index of the contour.
    """

    def __init__(self, runs: list[TorchRun], plan: CutPlan, sheet: Sheet, dialect: Dialect, asked: CutRequest) -> None:
        self.runs, self.plan, self.asked = runs, plan, asked
        self.targets = build_targets(sheet, asked.half)
        self.parts, self.numbers = part_areas(sheet)
        rings = [path.flattened(FLATNESS) for path in sheet.paths]
        self.sheet = shapely.Polygon(rings[0], rings[1:]) if rings else None
        self.zones = [shapely.box(*zone) for zone in sheet.zones]
        self.marks = _marking_mask(runs, dialect, asked.power)
        self.lines = np.array([shapely.MultiLineString(run.lines()) for run in runs], dtype=object)
        ways = np.array([t.centreline for t in self.targets], dtype=object)
        self.pairs = shapely.STRtree(ways).query(self.lines, predicate="dwithin", distance=TOLERANCE).T.tolist()
        claims = [self._match_run(run, self.targets[number]) for run, number in self.pairs]
        self.claims = [c for c in claims if c is not None and self.marks[c.run] == c.target.marks]
        self.of_target: dict[int, list[RunMatch]] = {}
        for claim in self.claims:
            self.of_target.setdefault(claim.target.index, []).append(claim)

    def _match_run(self, number: int, target: Target) -> RunMatch | None:
        run = self.runs[number]
        middles, lengths, along = burning_sections(run, PIECE)
        near = shapely.dwithin(target.centreline, shapely.points(middles), TOLERANCE)
        if not near.any():
            return None
        own = middles[near]
        centre = own.mean(axis=0)
        step = np.roll(own, -1, axis=0) - own
        swept = float(np.sum((own - centre)[:, 0] * step[:, 1] - (own - centre)[:, 1] * step[:, 0]))
        half = 0.5 * lengths[near]
        return RunMatch(
            number,
            target,
            float(lengths[near].sum()),
            float((along[near] - half).min()),
            float((along[near] + half).max()),
            swept < 0.0,
        )

    @property
    def kerf(self) -> float:
        """Width of the kerf, mm. This kerf must not touch other kerfs."""
        return 2.0 * self.asked.half if self.asked.half > 0.0 else self.plan.data.kerf

    @cached_property
    def kerf_lines(self) -> NDArray[Any]:
        """For each run, the lines along which it cuts through the sheet, as shapely geometry.

        The geometry of a mark is empty.
        """
        nothing: Any = shapely.MultiLineString()
        return np.where(self.marks, nothing, self.lines)

    def pierces(self, number: int) -> bool:
        """Return whether a run starts with a pierce. `number` is the index of the run."""
        cuts = self.plan.cuts
        return cuts[number].pierce if number < len(cuts) else True

    def detaches(self, claim: RunMatch) -> bool:
        """Return whether a run cuts a contour free.

        A run that merely passes the contour at a distance of one kerf does not.
        """
        whole = claim.followed > MOST * claim.target.centreline.length and not self.only_follows_common_line(claim)
        return whole or (claim.run < len(self.plan.cuts) and claim.target.index in self.plan.cuts[claim.run].contours)

    def only_follows_common_line(self, claim: RunMatch) -> bool:
        """Return whether a run goes around other parts with common lines and only passes the contour one kerf away."""
        cut = self.plan.cuts[claim.run] if claim.run < len(self.plan.cuts) else None
        return cut is not None and cut.group > 0 and claim.target.index not in cut.contours

    def line_at(self, number: int, x: float, y: float) -> int:
        """Return the program line of the chord that is nearest to a point. Only the chords of the given run count."""
        run = self.runs[number]
        chords = shapely.linestrings(np.stack([run.points[:-1], run.points[1:]], axis=1))
        return int(run.row_line[int(np.argmin(shapely.distance(chords, shapely.Point(x, y))))])


def _marking_mask(runs: list[TorchRun], dialect: Dialect, power: float | None) -> list[bool]:
    """Return whether each run marks.

    A run marks if it uses the spindle of the marking tool or less than the cutting power.
    """
    most = power if power is not None else max((light.power for run in runs for light in run.lightings), default=0.0)
    by_power = dialect.torch is not None and dialect.torch.power
    return [
        bool(run.lightings) and all(light.spindle != 0 or (by_power and light.power < most) for light in run.lightings)
        for run in runs
    ]


def sheet_difference(what: Message, text: Message, line: int) -> Difference:
    """Return a difference of the kind `what`, with a text and a line of the program."""
    return Difference(what, 0, line, text)
