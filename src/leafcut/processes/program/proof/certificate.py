"""The proof of a rewritten program: `certify` compares the work of two programs and returns a `Certificate`.

The comparison uses only the two programs; it does not know how the second program was derived from the first.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import narrowest_tool
from leafcut.message import Message
from leafcut.model.certificate import Certificate, Counts
from leafcut.model.difference import Difference
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.proof.barriers import (
    ComparisonGroups,
    compare_barrier_groups,
    compare_unreached_settings,
    find_misplaced_barriers,
)
from leafcut.processes.program.proof.changed_order import ChangedOrder
from leafcut.processes.program.proof.explanation import explain
from leafcut.processes.program.proof.features import FIRST_CYCLE, first_block_with_units
from leafcut.processes.program.proof.matching import Feature, MatchTolerance, Pairing, match_features
from leafcut.processes.program.proof.program_work import (
    ProgramWork,
    cuts_with_beam,
    has_no_mill,
    read_work,
    works_without_cycles,
)
from leafcut.processes.program.proof.rapids import compare_rapids, group_rapids
from leafcut.processes.program.proof.reversed_cuts import in_reference_direction, reversed_runs, unchanged_work
from leafcut.processes.program.proof.stated_modes import find_lost_modes
from leafcut.proof.difference import MOST_LISTED, cap_differences
from leafcut.proof.envelope import check_envelope
from leafcut.units import MM_PER_INCH

#: Checks covered by a certificate, in order.
COMPARED = (
    "barriers: pauses, tool changes, work offsets, machine moves, settings that the controller takes from comments and "
    "parameters, and blocks that are not understood, in order",
    "holes, cuts and dwells between two barriers: position, depth, cycle, peck, dwell, feed, speed or power, "
    "direction, tool, length offset, work offset, coolant, radius compensation, feed mode, blending, plane",
    "order of cuts that touch each other, and of closed cuts, outlines with tabs, and the work inside them",
    "order of nearby passes of a mill: at different levels, side by side, and in rows",
    "work of a mill before parts are detached",
    "heights of rapids at both ends and between them; no rapid interrupts a cut",
    "envelope",
)
#: Additional check if cuts may be reversed.
_EITHER_WAY = "open cuts at one level without lead-in or lead-out, in either direction"

#: Lowest and highest x, y, z, mm.
Bounds = tuple[tuple[float, ...], tuple[float, ...]]

_NOT_IN_COMMENT = re.compile(r"[^A-Za-z0-9 ._+=,-]")
#: Maximum length of a comment, characters: a GRBL line has 80, and parentheses and line number need some of them.
_LONGEST_COMMENT = 66
_LINES_AT_ONCE = 10_000


def certify(
    original: Program,
    new: Program,
    *,
    machine: Machine | None = None,
    tolerance_mm: float = 0.002,
    allow_reverse: bool = False,
    tool_diameter_mm: float | None = None,
    beyond: Bounds | None = None,
    check_cancelled: Heartbeat = ignore_heartbeat,
    notes: bool = False,
) -> Certificate:
    """Return a proof that two programs do the same work, or the differences between them.

    - Barriers (`barriers`): both programs have the same barriers in the same order, and the tool is no lower there. At
      an unknown block, the tool is at the same position. Only whole tool changes may be missing.
    - Between two barriers (`matching`): both programs have the same holes, cuts and dwells, in any order, except for
    the rules below.
    - Cuts that touch each other keep their order (`order_rules`).
    - Work inside a closed cut, or inside an outline with tabs, stays before or after that cut (`outlines`). With a
      laser or torch, only work before the cut must stay before it.
    - Passes of a mill at two levels or side by side, and rows, keep their order (`order_rules`).
    - Work that comes before a cut by which a mill detaches a part stays before that cut (`order_rules`).
    - Rapids depart, cross and arrive no lower than in the original program at the same point (`rapids`).
    - The new program reaches no farther than the original program. If the work offset of the machine is known, the new
      program stays within the travel.

    Feed moves above the work count as cuts; feed moves with a laser or torch that is off do not. If only one program
    uses drilling cycles, both are compared as single moves. Coordinates agree within `tolerance_mm` on every axis. A
    line may be divided into several feed moves if the intermediate points are within half of `tolerance_mm` of it.
    Moves of zero length do not count.

    Parameters
    ----------
    machine
        Machine whose travel is checked.
    allow_reverse
        Whether open cuts at one level may be reversed (`reversed_cuts`).
    tool_diameter_mm
        Diameter of the mills that no comment describes.
    beyond
        Bounds that the new program may reach in addition to those of the original, mm.
    check_cancelled
        Callback for progress and cancellation.
    notes
        Whether to note that parts are detached in a new order. For parts side by side, this is not a difference.

    Raises
    ------
    PlanError
        A cycle has more pecks than any machine would drill.
    """

    def compared(straight: float | None) -> Certificate:
        comparison = _Comparison(original, new, tolerance_mm, allow_reverse, tool_diameter_mm, check_cancelled, notes)
        return comparison.certificate(straight, machine, beyond)

    as_written = compared(None)
    if as_written.same or as_written.before.cuts + as_written.before.dwells == 0:
        return as_written
    straight = compared(tolerance_mm / 2)
    return straight if straight.same else as_written


def proof_lines(certificate: Certificate, version: str, name: str = "the original") -> list[str]:
    """Return the comment lines for the top of the new program, without comment signs.

    `name` is the file name of the original. Characters that could end a comment are replaced, and only the end
    of a long name is kept.
    """
    clean = " ".join(_NOT_IN_COMMENT.sub("_", name).split()) or "the original"
    if not certificate.same:
        return [f"leafcut {version}: NOT the same work as", clean[-_LONGEST_COMMENT:]]
    before = certificate.before
    work = f"sha256 {certificate.sha256[:12]}, {before.holes} holes, {before.cuts} cuts, verified"
    head = f"leafcut {version}: same work as "
    lines = [head + clean[-(_LONGEST_COMMENT - len(head)) :], f"leafcut: {work}"]
    if certificate.reversed_cuts:
        lines.append(f"leafcut: reversed cuts: {certificate.reversed_cuts}, --allow-reverse")
    return lines


def _digest(program: Program) -> str:
    """Return the SHA-256 digest of a program's text."""
    digest = hashlib.sha256()
    for begin in range(0, len(program.lines), _LINES_AT_ONCE):
        text = "".join(program.lines[begin : begin + _LINES_AT_ONCE])
        digest.update(text.encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


class _Comparison:
    """A comparison of two programs: the first differences that each check finds, the number of all differences, and
    notes.
    """

    def __init__(
        self,
        original: Program,
        new: Program,
        tolerance: float,
        allow_reverse: bool,
        tool_diameter: float | None,
        check_cancelled: Heartbeat,
        noting: bool,
    ) -> None:
        self.programs, self.tolerance, self.allow_reverse = (original, new), tolerance, allow_reverse
        self.tool_diameter = tool_diameter
        self.check_cancelled, self.noting = check_cancelled, noting
        self.beam, self.no_mill = cuts_with_beam(original), has_no_mill(original)
        self.notes: list[str] = []
        self.differences: list[Difference] = []
        self.count = 0

    def add(self, differences: Iterable[Difference], count: int = 0) -> None:
        self.check_cancelled()
        new = list(differences)
        self.differences += new[:MOST_LISTED]
        self.count += max(count, len(new))

    def certificate(self, straight: float | None, machine: Machine | None, beyond: Bounds | None) -> Certificate:
        """Compare the programs. `straight` is the tolerance for merging the moves of straight cuts, mm; None means that
        they are not merged.
        """
        original, new = self.programs
        written_out = works_without_cycles(original.path) != works_without_cycles(new.path)
        before, after = (
            read_work(program, written_out=written_out, beam=self.beam, straight=straight) for program in self.programs
        )
        grouping = compare_barrier_groups(before.walls, after.walls)
        self.add(grouping.differences)
        self.add(compare_unreached_settings(original, new))
        pairing, turned = self._compare_work(before, after, grouping)
        self.add(find_misplaced_barriers(before.marks, grouping.mark_of, self.tolerance))
        self.add(find_lost_modes(self.programs, (before, after), pairing.new_of, grouping.mark_of))
        self.add(_farther_reach(before.path, after.path, self.tolerance, [beyond, _known_bounds(pairing.extra)]))
        self.add(_moves_outside_travel(new.path, machine))
        differences = tuple(cap_differences(self.differences, self.count))
        compared = () if differences else (*COMPARED, _EITHER_WAY) if self.allow_reverse else COMPARED
        return Certificate(
            not differences,
            differences,
            _counts(before),
            _counts(after),
            compared,
            _digest(original),
            self.allow_reverse,
            turned,
            tuple(self.notes),
        )

    def _compare_work(self, before: ProgramWork, after: ProgramWork, grouping: ComparisonGroups) -> tuple[Pairing, int]:
        """Compare the work between barriers and add the differences.

        Return the matched features and the number of reversed cuts.
        """
        both = [
            in_reference_direction(work) if self.allow_reverse else unchanged_work(work) for work in (before, after)
        ]
        features = [
            replace(
                side.work.features,
                group=np.searchsorted(ends, np.arange(len(side.work.features)), side="right").astype(np.int32),
            )
            for side, ends in zip(both, (grouping.before, grouping.after), strict=True)
        ]
        before, after = (replace(side.work, features=f) for side, f in zip(both, features, strict=True))
        room = MatchTolerance(self.tolerance, self.beam)
        pairing = match_features(features[0], features[1], room)
        if pairing.missing and not (pairing.new_of >= 0).any():
            self.add(_unit_difference(self.programs))
        explanation = explain(pairing, room, grouping.implied)
        self.add(difference for difference, changes in grouping.states if not changes <= explanation.changes)
        self.add(explanation.differences, explanation.found)
        turned = reversed_runs(both[0], both[1], pairing.new_of)
        self.add(*compare_rapids(before, after, pairing.new_of, turned, grouping.mark_of, self.tolerance, self.no_mill))
        order = ChangedOrder(before, after, group_rapids(before), pairing.new_of, self.no_mill, self.check_cancelled)
        self.add((*order.touching(self.tolerance), *order.work_inside_contours()))
        if not self.no_mill:
            self.add(order.reordered_passes(min(narrowest_tool(self.programs[0]), self.tool_diameter or math.inf)))
        elif self.noting:
            self.notes += order.parts_note()
        return pairing, len(np.unique(turned[turned >= 0]))


def _unit_difference(programs: tuple[Program, Program]) -> Iterator[Difference]:
    """Yield a difference if the programs state different units, because this may explain all other differences."""
    units = [{m.unit for m in program.modals if m.unit} for program in programs]
    stated = [first_block_with_units(program) for program in programs]
    written = all(block < program.n_blocks for block, program in zip(stated, programs, strict=True))
    if written and all(len(side) == 1 for side in units) and units[0] != units[1]:
        was, now = (Message("inches") if side == {MM_PER_INCH} else "mm" for side in units)
        old, new = (int(program.line[block]) for program, block in zip(programs, stated, strict=True))
        yield Difference(
            Message("units"), old, new, Message("{} became {}, but the lengths did not change accordingly", was, now)
        )


def _known_bounds(features: list[Feature]) -> Bounds | None:
    """Return the bounds of features that have already been reported as different, including R planes and retracts."""
    places = [f.place[k : k + 3] for f in features for k in (0, 3) if k == 0 or f.exact[0] < FIRST_CYCLE]
    places += [(*f.place[:2], height) for f in features if f.exact[0] >= FIRST_CYCLE for height in f.height]
    if not places:
        return None
    known = np.array(places)
    lowest, highest = np.fmin.reduce(known), np.fmax.reduce(known)
    return tuple(lowest.tolist()), tuple(highest.tolist())


def _farther_reach(
    before: Toolpath, after: Toolpath, tolerance: float, beyond: list[Bounds | None]
) -> Iterator[Difference]:
    """Yield the axes on which the new program reaches farther than the original program.

    Checking the ends of moves is sufficient, because the cuts are equal.
    """
    bounds = [one for one in beyond if one is not None]
    lowest = np.fmin.reduce([(math.inf,) * 3, *(low for low, _ in bounds)])
    highest = np.fmax.reduce([(-math.inf,) * 3, *(high for _, high in bounds)])
    for axis, name in enumerate("XYZ"):
        for sign in (1.0, -1.0):
            (was, reached), (now, reaches) = (_farthest_move(path, axis, sign) for path in (before, after))
            room = max(reached, sign * (highest if sign > 0 else lowest)[axis])
            if was < 0 or reaches <= room + tolerance + 1e-9:
                continue
            text = Message(
                "{}{:.3f} is above every move of the original, {}{:.3f}"
                if sign > 0.0
                else "{}{:.3f} is below every move of the original, {}{:.3f}",
                name,
                after.end[now, axis],
                name,
                before.end[was, axis],
            )
            yield Difference(Message("envelope"), int(before.line[was]), int(after.line[now]), text)


def _farthest_move(path: Toolpath, axis: int, sign: float) -> tuple[int, float]:
    """Return the move that ends farthest along an axis (`sign` 1) or against it (`sign` -1), and the coordinate of its
    end multiplied by `sign`.

    Without a move, the row is -1.
    """
    moves = path.kind <= Kind.DRILL
    ends = np.where(moves, path.end[:, axis], np.nan)
    np.multiply(ends, sign, out=ends)
    ends[np.isnan(ends)] = -np.inf
    row = int(np.argmax(ends)) if moves.any() else -1
    return row, float(ends[row]) if row >= 0 else -math.inf


def _moves_outside_travel(path: Toolpath, machine: Machine | None) -> list[Difference]:
    """Return the moves outside the machine's travel before the first origin shift; later positions are unknown."""
    if machine is None or machine.work_offset is None:
        return []
    moved = (path.kind == Kind.SHIFT) | ((path.kind == Kind.FRAME) & (path.ref != 540))
    n = int(np.argmax(moved)) if moved.any() else len(path)
    return [d for d in check_envelope(path.take(slice(n)), machine) if d.what == "outside travel"]


def _counts(work: ProgramWork) -> Counts:
    kind = work.features.kind
    ends = [wall.after for wall in work.walls if wall.after > 0]
    return Counts(
        holes=int((kind >= FIRST_CYCLE).sum()),
        cuts=int(((kind < FIRST_CYCLE) & (kind != Kind.DWELL)).sum()),
        dwells=int((work.path.kind == Kind.DWELL).sum()),
        stages=len(set(ends)),
        tool_changes=int((work.path.kind == Kind.TOOL).sum()),
    )
