"""The proof of a cutting program: what its text does to the sheet, checked against the drawing.

Nothing of what planned the cuts is asked here. The text is read as the controller reads it, the runs of its torch are
laid over the drawing, and shapely says what they touch. Of the plan only what a person asked for is compared: feeds,
directions, and the figures of the chart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.dialects import Dialect
from leafcut.model.cutting import CutPlan
from leafcut.model.machine import Machine, Probe
from leafcut.model.sheet import Sheet
from leafcut.verify.bridged import Followed, check_bridges
from leafcut.verify.common import check_common_lines
from leafcut.verify.cut_motion import read_back
from leafcut.verify.difference import Difference, place, shorten
from leafcut.verify.envelope import check_envelope
from leafcut.verify.sheet_shapes import TOLERANCE, Shapes, Target, shapes_of
from leafcut.verify.torch import check_torch
from leafcut.verify.torch_runs import TorchRun, pieces_of, torch_runs

#: Chords are looked at in pieces no longer than this, mm.
PIECE = 1.0
#: A run cuts a contour when it follows so much of its way.
MOST = 0.5
#: Following this much of a way is going round it twice.
TWICE = 1.9
#: A stretch of a way that is not followed and is shorter is rounding, mm.
SHORT = 0.1


@dataclass(frozen=True)
class Asked:
    """What was asked for besides the plan: half of the kerf that is compensated, mm, and how parts may hang on.

    `joints` micro-joints of a contour at most, each no wider than `joint_width` mm, `joint_holes`: of holes, too;
    `safe_height` of rapids, mm; `probe`: how the sheet is found before every pierce.
    """

    half: float
    joints: int = 0
    joint_width: float = 0.0
    joint_holes: bool = False
    safe_height: float | None = None
    probe: Probe | None = None


def check_sheet(
    sheet: Sheet, plan: CutPlan, text: str, dialect: Dialect, machine: Machine, asked: Asked
) -> list[Difference]:
    """Return all that is wrong with the text of a cutting program; an empty list is the proof.

    1. Every contour that the kerf fits is cut once, all the way round, and marks are marked.
    2. No kerf touches the metal of any part, a clamp, or the air beyond the sheet's edge.
    3. What lies inside is cut before what is around it; marks come before the outline around them.
    4. Every pierce is in scrap that is still there.
    5. The torch is off in rapids, which are high; it finds the sheet, pierces, feeds and turns as planned.
    6. A run that cuts several contours goes from one to the next through scrap that holds, and into no other kerf.
    7. Edges that are cut once for two parts are cut before what is around the parts, and by no other run.
    8. The machine can reach and do all of it.

    Raises
    ------
    ReadError
        The text is no program that the controller takes.
    """
    path = read_back(text, plan, dialect)
    by_register = dialect.torch is not None and dialect.torch.compensation == "G41"
    runs = torch_runs(path, plan.data.kerf if by_register else None)
    found = check_torch(path, runs, plan, text, dialect, asked.safe_height, asked.probe)
    shapes = shapes_of(sheet, asked.half)
    laid = _Laid(runs, plan, shapes, dialect, asked)
    found += [*laid.missing(), *laid.repeated(), *laid.gouges(), *laid.strays(), *laid.misplaced()]
    found += [*laid.disordered(), *laid.in_the_air(), *laid.turned(), *laid.chained()]
    return shorten([*found, *check_envelope(path, machine)])


@dataclass(frozen=True)
class _Claim:
    """A run follows the way of a target: how much of it, mm, and from where to where along the run."""

    run: int
    target: Target
    followed: float
    first: float
    last: float
    clockwise: bool


class _Laid:
    """The runs of a program laid over the shapes of a sheet."""

    def __init__(self, runs: list[TorchRun], plan: CutPlan, shapes: Shapes, dialect: Dialect, asked: Asked) -> None:
        import shapely

        self.runs, self.plan, self.shapes, self.asked = runs, plan, shapes, asked
        self.marks = _marking(runs, dialect)
        self.lines = np.array([shapely.MultiLineString(run.lines()) for run in runs], dtype=object)
        ways = np.array([t.way for t in shapes.targets], dtype=object)
        self.pairs = shapely.STRtree(ways).query(self.lines, predicate="dwithin", distance=TOLERANCE).T.tolist()
        claims = [self._claim(run, shapes.targets[number]) for run, number in self.pairs]
        self.claims = [c for c in claims if c is not None and self.marks[c.run] == c.target.marks]
        self.of_target: dict[int, list[_Claim]] = {}
        for claim in self.claims:
            self.of_target.setdefault(claim.target.index, []).append(claim)

    def _claim(self, number: int, target: Target) -> _Claim | None:
        import shapely

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
        return _Claim(
            number,
            target,
            float(lengths[near].sum()),
            float((along[near] - half).min()),
            float((along[near] + half).max()),
            swept < 0.0,
        )

    # -- every contour once ------------------------------------------------------------------------------------------

    def missing(self) -> list[Difference]:
        """Return the contours that are not cut, or not all the way."""
        found = []
        for target in self.shapes.targets:
            claims = self.of_target.get(target.index, [])
            if target.may_stay and not claims:
                continue
            gaps = self._gaps(target, [self.lines[c.run] for c in claims])
            what = "marked" if target.marks else "cut"
            if sum(g.length for g in gaps) > MOST * target.way.length:
                found.append(self._wrong(f"not {what}", f"{target.name} is not {what}", _line_of(self.runs, claims)))
                continue
            joints = 0 if target.marks or (target.source.is_hole and not self.asked.joint_holes) else self.asked.joints
            widest = self.asked.joint_width + 2.0 * self.asked.half + 2.0 * TOLERANCE
            wrong = gaps if len(gaps) > joints else [g for g in gaps if g.length > widest]
            if wrong:
                x, y = wrong[0].interpolate(0.5, normalized=True).coords[0]
                text = f"{target.name} is not {what} all the way: {wrong[0].length:.3f} mm are left at {place(x, y)}"
                found.append(self._wrong("not all the way", text, _line_of(self.runs, claims)))
        return found

    def _gaps(self, target: Target, lines: Sequence[Any]) -> list[Any]:
        """Return the stretches of a target's way that no run follows, but for corners that are gone round in a loop."""
        import shapely

        if not lines:
            return [target.way]
        burnt = shapely.union_all(lines)
        left = target.way.difference(burnt.buffer(1.5 * TOLERANCE))
        if target.shape is not None and len(pieces := shapely.get_parts(left)) > 1:
            left = shapely.line_merge(shapely.multilinestrings(pieces))
        return [g for g in shapely.get_parts(left) if g.length > SHORT and not self._at_corner(target, g, burnt)]

    def _at_corner(self, target: Target, gap: Any, burnt: Any) -> bool:
        """Return whether a stretch is the arc about a corner that the kerf touches from both sides."""
        import shapely

        half = self.asked.half
        if not len(target.corners):
            return False
        points = shapely.points(gap.coords)
        corners = shapely.points(target.corners)
        near = corners[shapely.dwithin(corners, gap, half + TOLERANCE)]
        return any(
            np.all(np.abs(shapely.distance(corner, points) - half) < TOLERANCE)
            and shapely.distance(corner, burnt) < half + 2.0 * TOLERANCE
            for corner in near
        )

    def repeated(self) -> list[Difference]:
        """Return the contours that are cut twice, and the runs that cut nothing of the drawing."""
        found = []
        for claims in self.of_target.values():
            target = claims[0].target
            whole = [c for c in claims if c.followed > MOST * target.way.length and not self._passes(c)]
            if len(whole) > 1 or any(c.followed > TWICE * target.way.length for c in whole):
                lines = ", ".join(str(self.runs[c.run].line) for c in whole)
                text = f"{target.name} is gone round more than once, from line {lines}"
                found.append(self._wrong("cut twice", text, self.runs[whole[-1].run].line))
        used = {c.run for c in self.claims}
        for number, run in enumerate(self.runs):
            if number not in used:
                what = "marks" if self.marks[number] else "cuts"
                text = f"from {place(*run.start)} the torch {what} nothing that is drawn"
                found.append(self._wrong("cuts nothing", text, run.line))
        return found

    # -- what a kerf may touch ---------------------------------------------------------------------------------------

    def gouges(self) -> list[Difference]:
        """Return the parts that a kerf cuts into."""
        import shapely

        shapes, found = self.shapes, []
        tree = shapely.STRtree(shapes.parts)
        slits = {t.index: t.edge for t in shapes.targets if t.shape is None and not t.marks}
        for number, line in enumerate(self.lines):
            if self.marks[number]:
                continue
            own = [slits[c.target.index] for c in self.claims if c.run == number and c.target.index in slits]
            free = line.difference(shapely.union_all(own).buffer(2.0 * TOLERANCE)) if own else line
            for part in tree.query(free, predicate="dwithin", distance=self.asked.half).tolist():
                into = free.intersection(shapes.parts[part].buffer(self.asked.half))
                depth = self.asked.half - shapely.distance(free, shapes.parts[part]) + TOLERANCE
                x, y = shapely.get_coordinates(into if not into.is_empty else free)[0]
                text = f"the kerf goes {depth:.3f} mm or more into part {shapes.numbers[part]}, at {place(x, y)}"
                found.append(self._wrong("cuts into a part", text, self._line_at(number, x, y)))
        return found

    def strays(self) -> list[Difference]:
        """Return where a kerf runs into a clamp, or off the sheet but for a start or an end in the air."""
        import shapely

        found = []
        for zone in self.shapes.zones:
            for number in np.flatnonzero(shapely.dwithin(self.lines, zone, self.asked.half - TOLERANCE)).tolist():
                x, y = shapely.get_coordinates(shapely.shortest_line(zone, self.lines[number]))[1]
                text = f"the kerf runs into a forbidden zone at {place(x, y)}"
                found.append(self._wrong("in a forbidden zone", text, self._line_at(number, x, y)))
        sheet = self.shapes.sheet
        if sheet is None:
            return found
        inside = sheet.buffer(TOLERANCE)
        shapely.prepare(inside)
        for number in np.flatnonzero(~shapely.contains(inside, self.lines)).tolist():
            outside = self._outside(number, inside)
            if len(outside):
                x, y = outside[0]
                text = f"the torch burns off the sheet, at {place(x, y)}"
                found.append(self._wrong("off the sheet", text, self._line_at(number, x, y)))
        return found

    def _outside(self, number: int, inside: Any) -> NDArray[np.float64]:
        """Return the places off the sheet where a run may not be; a lead of an edge start may come from there."""
        import shapely

        middles, _, along = pieces_of(self.runs[number], PIECE)
        out = ~shapely.contains(inside, shapely.points(middles))
        if not self._pierces(number):
            out &= along >= min((c.first for c in self.claims if c.run == number), default=0.0)
        places: NDArray[np.float64] = middles[out]
        return places

    def _pierces(self, number: int) -> bool:
        cuts = self.plan.cuts
        return cuts[number].pierce if number < len(cuts) else True

    # -- order, pierces, directions ----------------------------------------------------------------------------------

    def disordered(self) -> list[Difference]:
        """Return what is cut after the contour around it has cut it loose."""
        import shapely

        closed = [t for t in self.shapes.targets if t.shape is not None]
        everything = list(self.shapes.targets)
        points = shapely.line_interpolate_point(np.array([t.edge for t in everything], dtype=object), 0.0)
        tree = shapely.STRtree(points)
        found = []
        for around in closed:
            shape = around.shape.buffer(-TOLERANCE)
            for number in tree.query(shape, predicate="contains").tolist():
                inner = everything[number]
                late = self._later(inner, around) if inner.index != around.index else None
                if late is not None:
                    text = f"{inner.name} comes after {around.name}, which cuts it loose"
                    found.append(self._wrong("out of order", text, self.runs[late].line))
        return found

    def _later(self, inner: Target, around: Target) -> int | None:
        """Return the run of `inner` that is not done before `around` begins."""
        one, other = self.of_target.get(inner.index), self.of_target.get(around.index)
        if not one or not other:
            return None
        last = max(one, key=lambda c: (c.run, c.last))
        first = min((c for c in other if self._frees(c)), key=lambda c: (c.run, c.first), default=other[0])
        return last.run if (last.run, last.last) > (first.run, first.first + TOLERANCE) else None

    def _frees(self, claim: _Claim) -> bool:
        """Return whether a run is one that cuts a contour loose; that of a part a kerf away only follows an edge."""
        whole = claim.followed > MOST * claim.target.way.length and not self._passes(claim)
        return whole or (claim.run < len(self.plan.cuts) and claim.target.index in self.plan.cuts[claim.run].contours)

    def _passes(self, claim: _Claim) -> bool:
        """Return whether a run around other parts with common lines follows a contour only as it lies a kerf away."""
        cut = self.plan.cuts[claim.run] if claim.run < len(self.plan.cuts) else None
        return cut is not None and cut.group > 0 and claim.target.index not in cut.contours

    def misplaced(self) -> list[Difference]:
        """Return the cuts that are not the plan's, in number or in what they cut."""
        cuts, found = self.plan.cuts, []
        if len(cuts) != len(self.runs):
            text = f"the torch goes on for {len(self.runs)} cuts; {len(cuts)} are planned"
            found.append(self._wrong("number of cuts", text, 0))
        planned = {i for cut in cuts for i in cut.contours}
        return found + [
            self._wrong("not planned", f"{target.name} is in no cut of the plan", 0)
            for target in self.shapes.targets
            if target.index not in planned and not target.may_stay
        ]

    def in_the_air(self) -> list[Difference]:
        """Return the pierces where there is no metal any more: in an earlier kerf, or in what was cut free."""
        import shapely

        found = []
        starts = shapely.points([run.start for run in self.runs])
        tree = shapely.STRtree(starts)
        for number, line in enumerate(self.lines):
            reach = max(self.asked.half - TOLERANCE, 0.0)
            for later in tree.query(line, predicate="dwithin", distance=reach).tolist():
                if later > number and self._pierces(later) and not self.marks[later] and not self.marks[number]:
                    text = f"the torch is lit at {place(*self.runs[later].start)}, in the kerf of an earlier cut"
                    found.append(self._wrong("pierces in the air", text, self.runs[later].line))
        for claim in self.claims:
            if claim.target.shape is None or not self._frees(claim):
                continue
            for later in tree.query(claim.target.shape, predicate="contains").tolist():
                if later > claim.run and all(c.run != later for c in self.of_target[claim.target.index]):
                    text = (
                        f"the torch is lit at {place(*self.runs[later].start)}, inside of {claim.target.name}, "
                        "which was cut before"
                    )
                    found.append(self._wrong("pierces in the air", text, self.runs[later].line))
        return found

    def turned(self) -> list[Difference]:
        """Return the contours that are cut the other way round than asked."""
        found = []
        for claim in self.claims:
            if claim.run >= len(self.plan.cuts) or claim.target.shape is None:
                continue
            cut = self.plan.cuts[claim.run]
            asked = next((c.direction for c in cut.choices if c.contours == (claim.target.index,)), "")
            if asked not in ("clockwise", "counter-clockwise"):
                continue
            if (asked == "clockwise") != claim.clockwise:
                way = "clockwise" if claim.clockwise else "counter-clockwise"
                text = f"{claim.target.name} is cut {way}, not {asked}"
                found.append(self._wrong("direction", text, self.runs[claim.run].line))
        return found

    def chained(self) -> list[Difference]:
        """Return what is wrong with the runs that cut several contours."""
        import shapely

        followed: list[list[Followed]] = [[] for _ in self.runs]
        in_group = {k for k, cut in enumerate(self.plan.cuts) if cut.group}
        for c in self.claims:
            if c.followed > MOST * c.target.way.length and c.run not in in_group:
                followed[c.run].append(Followed(c.target.index, c.first, c.last, c.target.shape))
        kerf = 2.0 * self.asked.half if self.asked.half > 0.0 else self.plan.data.kerf
        burnt = np.where(self.marks, shapely.MultiLineString(), self.lines)
        return [
            *check_bridges(self.runs, followed, self.plan, burnt, kerf),
            *check_common_lines(self.runs, self.plan, burnt, kerf),
        ]

    # -- words -------------------------------------------------------------------------------------------------------

    def _line_at(self, number: int, x: float, y: float) -> int:
        """Return the line of the program whose chord is nearest to a place."""
        import shapely

        run = self.runs[number]
        chords = shapely.linestrings(np.stack([run.points[:-1], run.points[1:]], axis=1))
        return int(run.row_line[int(np.argmin(shapely.distance(chords, shapely.Point(x, y))))])

    @staticmethod
    def _wrong(what: str, text: str, line: int) -> Difference:
        return Difference(what, 0, line, text)


def _marking(runs: list[TorchRun], dialect: Dialect) -> list[bool]:
    """Return which runs mark: by another spindle, or by less power than the others have."""
    most = max((light.power for run in runs for light in run.lightings), default=0.0)
    by_power = dialect.torch is not None and dialect.torch.power
    return [
        bool(run.lightings) and all(light.spindle != 0 or (by_power and light.power < most) for light in run.lightings)
        for run in runs
    ]


def _line_of(runs: list[TorchRun], claims: list[_Claim]) -> int:
    return runs[claims[0].run].line if claims else 0
