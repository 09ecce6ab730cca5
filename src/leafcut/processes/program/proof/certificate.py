"""Prove that a rewritten program does the same work: `certify` compares two programs and returns a `Certificate`.

The comparison only looks at the two programs. It does not know how the second program was derived from the first.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice, pairwise
from typing import NamedTuple

import numpy as np
import shapely

from leafcut.gcode.block_description import normalize_line
from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import smallest_diameter_in_comments
from leafcut.geometry.arrays import Indices, Mask
from leafcut.message import Message
from leafcut.model.certificate import Certificate, Counts
from leafcut.model.difference import Difference
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.proof.barriers import (
    Barrier,
    ComparisonGroups,
    compare_barrier_groups,
    compare_unreached_settings,
    find_misplaced_barriers,
)
from leafcut.processes.program.proof.explanation import explain
from leafcut.processes.program.proof.features import (
    AMOUNT,
    EXACT,
    FIRST_CYCLE,
    Features,
    first_block_with_units,
    is_uniform,
)
from leafcut.processes.program.proof.matching import Feature, MatchTolerance, Pairing, match_features
from leafcut.processes.program.proof.order_rules import (
    LEVEL,
    Visits,
    build_visits,
    detaching_visits,
    line_index,
    nearby_passes,
    rows_in_order,
    touching_in_new_order,
)
from leafcut.processes.program.proof.order_thresholds import FREE
from leafcut.processes.program.proof.outlines import BEAM_TAB, MILL_TAB, lines_starting_inside, outlines_of, task_lines
from leafcut.processes.program.proof.program_work import (
    STILL,
    ProgramWork,
    cuts_with_beam,
    has_no_mill,
    read_work,
    works_without_cycles,
)
from leafcut.processes.program.proof.rapids import RapidGaps, allowed_heights, compare_rapids, group_rapids
from leafcut.processes.program.proof.traces import is_simple, traces_of
from leafcut.proof.difference import MOST_LISTED, limit_differences, position_text
from leafcut.proof.envelope import check_machine_limits
from leafcut.units import MM_PER_INCH

#: The checks that a certificate covers, in order.
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
#: An extra check that applies if cuts may be reversed.
_EITHER_WAY = "open cuts at one level without lead-in or lead-out, in either direction"
#: Lowest and highest x, y, z, mm.
Bounds = tuple[tuple[float, ...], tuple[float, ...]]
_NOT_IN_COMMENT = re.compile(r"[^A-Za-z0-9 ._+=,-]")
#: Maximum length of a comment, characters. A GRBL line has 80 characters, and the parentheses and the line number take
#: up some of them.
_LONGEST_COMMENT = 66
#: Kinds of rows that depend on a mode. An unknown block may depend on any mode.
_ARCS = (Kind.FOREIGN, Kind.ARC_CW, Kind.ARC_CCW)
_CYCLES = (Kind.FOREIGN, Kind.DRILL)
_ROUND = (*_ARCS, Kind.DRILL)
_CUTS = (*_ROUND, Kind.FEED)
_MOVES = (*_CUTS, Kind.RAPID)
#: A cut is closed if the gap between its ends is at most this large, mm.
_CLOSED = 0.01
#: Cuts are compared in this direction. It is chosen so that lines in an ordinary drawing are not parallel to it.
_ONWARD = np.array([0.8386705679, 0.5446390350])
#: These values must be constant in a run that may be reversed. Dwells differ in feed and time, and arcs in kind, plane
#: and turns.
_STEADY = tuple(name for name in (*EXACT, *AMOUNT) if name not in ("kind", "plane", "turns", "feed", "dwell"))
#: Builds the message about two features from their positions.
_MessageOf = Callable[[Message, Message], Message]
#: Two features of the original program, the earlier feature first, with the message about how they are related.
_Pair = tuple[int, int, _MessageOf]


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
    """Prove that two programs do the same work, or list the differences between them.

    - Barriers (`barriers`): both programs have the same barriers in the same order, and the tool is no lower there. At
      an unknown block, the tool is at the same position. The new program may only omit whole tool changes.
    - Matching (`matching`): between two barriers, both programs have the same holes, cuts and dwells, in any order. The
      rules below restrict that order.
    - Touching cuts keep their order (`order_rules`).
    - Work inside a closed cut, or inside an outline with tabs, stays before or after that cut (`outlines`). With a
      laser or torch, only work before the cut must stay before it.
    - Passes of a mill at two levels or side by side, and rows, keep their order (`order_rules`).
    - If a mill detaches a part, all work that comes before this cut stays before it (`order_rules`).
    - Rapids depart, cross and arrive no lower than in the original program at the same point (`rapids`).
    - The new program reaches no farther than the original program. If the work offset of the machine is known, the new
      program stays within the travel.

    Feed moves above the work count as cuts, except with a laser or torch that is off. If only one of the programs uses
    drilling cycles, the cycles are expanded into single moves. Coordinates must agree within `tolerance_mm` on every
    axis. A line may be divided into several feed moves if the points between them are within half of `tolerance_mm` of
    the line. Moves of zero length are ignored.

    Parameters
    ----------
    machine
        Machine whose travel is checked.
    allow_reverse
        Whether open cuts at a single level may be reversed (`in_reference_direction`).
    tool_diameter_mm
        Diameter of the mills that no comment describes.
    beyond
        Bounds that the new program may reach in addition to the bounds of the original program, mm.
    check_cancelled
        Callback for progress and cancellation.
    notes
        Whether to add a note if parts are detached in a new order. For parts side by side, this is not a difference.

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

    `name` is the file name of the original program. Characters that could end a comment are replaced. If the name is
    long, only its end is kept.
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
    return hashlib.sha256("".join(program.lines).encode("utf-8", "surrogatepass")).hexdigest()


class _Comparison:
    """Collects the result of comparing two programs.

    Each check keeps its first differences. The class also counts all differences and collects notes.
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
        """Compare the programs.

        `straight` is the tolerance for merging the moves of straight cuts, mm. With None, the moves are not merged.
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
        differences = tuple(limit_differences(self.differences, self.count))
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
        """Compare the work between the barriers and record the differences.

        Return the matched features and the number of reversed cuts.
        """
        both = [
            in_reference_direction(work) if self.allow_reverse else without_reversals(work) for work in (before, after)
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
        self.add((*order.touching_differences(self.tolerance), *order.inside_contour_differences()))
        if not self.no_mill:
            self.add(
                order.pass_differences(
                    min(smallest_diameter_in_comments(self.programs[0]), self.tool_diameter or math.inf)
                )
            )
        elif self.noting:
            self.notes += order.parts_note()
        return pairing, len(np.unique(turned[turned >= 0]))


def _unit_difference(programs: tuple[Program, Program]) -> Iterator[Difference]:
    """Yield a difference if the programs use different units, because this may explain all other differences."""
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
    """Return the bounds of features that are already reported as different, including R planes and retracts."""
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

    It is enough to check the ends of the moves, because the cuts are equal.
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
    """Return the move that ends farthest in the direction of an axis (`sign` 1) or against it (`sign` -1).

    Returns
    -------
    tuple
        Row of the move, or -1 if the program never moves, and its end coordinate multiplied by `sign`.
    """
    moves = path.kind <= Kind.DRILL
    ends = np.where(moves, path.end[:, axis], np.nan)
    np.multiply(ends, sign, out=ends)
    ends[np.isnan(ends)] = -np.inf
    row = int(np.argmax(ends)) if moves.any() else -1
    return row, float(ends[row]) if row >= 0 else -math.inf


def _moves_outside_travel(path: Toolpath, machine: Machine | None) -> list[Difference]:
    """Return the moves outside the machine's travel, up to the first origin shift. Later positions are unknown."""
    if machine is None or machine.work_offset is None:
        return []
    moved = (path.kind == Kind.SHIFT) | ((path.kind == Kind.FRAME) & (path.ref != 540))
    n = int(np.argmax(moved)) if moved.any() else len(path)
    return [d for d in check_machine_limits(path.take(slice(n)), machine) if d.what == "outside travel"]


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


# -- stated modes ----------------------------------------------------------------------------------------------------


class _Mode(NamedTuple):
    """A mode with its name, the G words that set it, and the kinds of rows that need it.

    A regular expression matches the numbers of the G words. Some controllers do not know a `rare` word, so the new
    program must not add it.
    """

    name: str
    words: str
    kinds: tuple[Kind, ...]
    rare: bool = False


_MODES = (
    _Mode(Message("the distance mode (G90, G91)"), "9[01]", _MOVES),
    _Mode(Message("the plane (G17)"), "1[789]", _ROUND),
    _Mode(Message("radius compensation off (G40)"), "4[012](?:[.]1)?", _MOVES),
    _Mode(Message("the feed mode (G94)"), "9[345]", _CUTS),
    _Mode(Message("the arc distance mode (G91.1)"), "9[01][.]1", _ARCS),
    _Mode(Message("the return of cycles (G98, G99)"), "9[89]", _CYCLES),
    _Mode(Message("the length offset (G43, G49)"), "4[349](?:[.][0-9])?", _MOVES),
    _Mode(Message("the work offset (G54)"), "(?:5[4-9](?:[.][1-9])?|154|1[12][0-9])", _MOVES),
    _Mode(Message("constant surface speed off (G97)"), "9[67]", _CUTS),
    _Mode(Message("rotation off (G69)"), "6[89](?:[.][0-9])?", _MOVES, True),
    _Mode(Message("scaling off (G50)"), "5[01]", _MOVES, True),
    _Mode(Message("mirroring off (G50.1)"), "5[01][.]1", _MOVES, True),
    _Mode(Message("polar coordinates off (G15)"), "1[56]", _MOVES, True),
    _Mode(Message("macro calls off (G67)"), "6[67](?:[.]1)?", _MOVES, True),
    _Mode(Message("the shift of the origin (G92.1)"), "92(?:[.][123])?", _MOVES, True),
)
#: Matches a G word other than G0 to G3. Numbers may contain blanks.
_OTHER = re.compile(r"[Gg](?![ \t]*0*[0-3](?![ \t]*[0-9.]))")
_PATTERNS = [re.compile(rf"G0*{mode.words}(?![0-9.])") for mode in _MODES]


def find_lost_modes(
    programs: tuple[Program, Program],
    works: tuple[ProgramWork, ProgramWork],
    new_of: Indices,
    mark_of: dict[float, Barrier],
) -> Iterator[Difference]:
    """Yield the modes that only the original program states before the work that depends on them.

    If a program does not state a mode such as G90, the machine keeps its last state. Comparing the motion cannot reveal
    that. `new_of` and `mark_of` map features and barriers of the original program to their match in the new program.
    Only cuts that occur in both programs count, because an added cut depends on the same modes as its neighbours.
    """
    words = [_lines_with_g_words(program) for program in programs]
    counted = _common_rows(works, new_of, mark_of)
    for mode, pattern in zip(_MODES, _PATTERNS, strict=True):
        was, now = (_first_use(*side, mode, pattern) for side in zip(programs, works, words, counted, strict=True))
        if (now.first and not was.first) or now.cuts > was.cuts:
            text = Message(
                "{}: the original states this mode before line {}, which relies on it; the new program does not",
                mode.name,
                now.line or was.line,
            )
            yield Difference(Message("not stated"), was.line, now.line, text)
        elif mode.rare and was.first and not now.first:
            text = Message(
                "{}: the new program states this mode before line {}, which relies on it; the original does not",
                mode.name,
                was.line,
            )
            yield Difference(Message("newly stated"), was.line, now.line, text)


def _common_rows(
    works: tuple[ProgramWork, ProgramWork], new_of: Indices, mark_of: dict[float, Barrier]
) -> tuple[Mask, Mask]:
    """Return masks of the rows that both programs contain. If no work is missing or new, the masks select all rows."""
    old = np.flatnonzero(new_of >= 0)
    features = old, new_of[old]
    keys = set(mark_of), {mark.key for mark in mark_of.values()}
    masks = []
    whole = True
    for work, paired, known in zip(works, features, keys, strict=True):
        foreign = [mark for mark in work.marks if mark.kind == Kind.FOREIGN]
        same = [int(mark.key) for mark in foreign if mark.key in known]
        mask = np.zeros(len(work.path), dtype=bool)
        mask[work.features.row[paired]] = True
        mask[same] = True
        masks.append(mask)
        whole &= len(paired) == len(work.features) and len(same) == len(foreign)
    if whole:
        for mask in masks:
            mask[:] = True
    return masks[0], masks[1]


class _FirstUse(NamedTuple):
    """The first use of a mode.

    It records whether the first row that depends on the mode comes before the word. It also stores the line of that
    row, and the number of cuts before the word.
    """

    first: bool
    line: int
    cuts: int


def _lines_with_g_words(program: Program) -> dict[int, str]:
    """Return the normalized text of all lines that contain a G word other than G0 to G3, by line number."""
    return {number: normalize_line(text) for number, text in enumerate(program.lines, 1) if _OTHER.search(text)}


def _first_use(
    program: Program, work: ProgramWork, words: dict[int, str], counted: Mask, mode: _Mode, pattern: re.Pattern[str]
) -> _FirstUse:
    path = program.path
    rows = np.flatnonzero(np.isin(path.kind, mode.kinds))
    if not len(rows):
        return _FirstUse(False, 0, 0)
    block = int(program.row_block[rows[0]])
    stating = _first_block_on(program, [number for number, text in words.items() if pattern.search(text)])
    if stating <= block:
        return _FirstUse(False, int(path.line[rows[0]]), 0)
    return _FirstUse(
        True, int(path.line[rows[0]]), _cuts_before(program, work, int(program.first[stating]), counted, mode)
    )


def _cuts_before(program: Program, work: ProgramWork, end: int, counted: Mask, mode: _Mode) -> int:
    kinds = [kind for kind in mode.kinds if kind in _CUTS]
    if Kind.FEED in kinds:
        return int((np.isin(work.path.kind, kinds) & (work.source < end) & counted).sum())
    # The feed moves of an expanded cycle rely on fewer modes than the cycle.
    rows = np.unique(work.source[counted & (work.source < end)])
    return int(np.isin(program.path.kind[rows[rows < len(program.path)]], kinds).sum())


def _first_block_on(program: Program, lines: list[int]) -> int:
    """Return the first block on any of the given lines, or the number of blocks if there is none."""
    found = np.isin(program.line, lines)
    return int(np.argmax(found)) if found.any() else program.n_blocks


# -- reversed cuts ---------------------------------------------------------------------------------------------------


class DirectedWork(NamedTuple):
    """The work of a program after all reversible cuts were turned to the reference direction.

    Attributes
    ----------
    run
        Reversible run of each feature, int64[n], or -1. The features are sorted by run, and a reversed run keeps its
        position in the order.
    turned
        Mask of the features that were reversed.
    """

    work: ProgramWork
    run: Indices
    turned: Mask


def without_reversals(work: ProgramWork) -> DirectedWork:
    """Return the work without reversing any cut."""
    n = len(work.features)
    return DirectedWork(work, np.full(n, -1), np.zeros(n, dtype=bool))


def in_reference_direction(work: ProgramWork) -> DirectedWork:
    """Turn every reversible cut to the reference direction.

    This function derives reversibility again from the motion alone. A cut is reversible if it is open, stays at a
    single level, does not cross itself, and has neither lead-in nor lead-out. The tool must arrive and leave by rapids.
    """
    features, gaps = work.features, group_rapids(work)
    n = len(features)
    begins = np.flatnonzero(gaps.rows[gaps.gap_of] | ~gaps.opened_by_feature[gaps.gap_of])
    order, run, turned = np.arange(n), np.full(n, -1), np.zeros(n, dtype=bool)
    new = features.pick(order)
    for first, end in pairwise([*begins.tolist(), n]):
        body = _cuts_of_run(features, gaps, first, end)
        if body is None:
            continue
        run[first:end] = first
        way = features.end[body[-1], :2] - features.start[body[0], :2]
        if float(way @ _ONWARD) < 0.0:
            turned[first:end] = True
            order[body] = body[::-1]
            _reverse_run(new, features, first, end, body)
    if turned.any():
        picked = new.pick(order)
        # The row gives the place among the rapids, which belongs to the run and not to the cut.
        new = replace(picked, row=features.row)
    return DirectedWork(replace(work, features=new), run, turned)


def _cuts_of_run(features: Features, gaps: RapidGaps, first: int, end: int) -> Indices | None:
    """Return the cuts of a run without its plunge and retract, or None if the run is not reversible."""
    rows = np.arange(first, end)
    level = rows[~_vertical_mask(features, rows)]
    if not len(level):
        return None
    body: Indices = np.arange(level[0], level[-1] + 1)
    after = gaps.gap_of[end - 1] + 1
    reached = gaps.rows[gaps.gap_of[first]] and (gaps.rows[after] or not gaps.closed_by_feature[after])
    if len(body) != len(level) or not reached or not _is_constant(features, rows, body):
        return None
    ends = features.start[body[0], :2], features.end[body[-1], :2]
    if not np.isfinite(ends).all() or np.hypot(*(ends[1] - ends[0])) <= _CLOSED:
        return None
    cuts = features.pick(body)
    return body if is_uniform(cuts) and is_simple(cuts) else None


def _vertical_mask(features: Features, rows: Indices) -> Mask:
    """Return a mask of the dwells, and of the cuts without sideways movement."""
    moved = np.abs(features.end[rows, :2] - features.start[rows, :2]) > STILL
    upright: Mask = ((features.kind[rows] == Kind.FEED) & ~moved.any(axis=1)) | (features.kind[rows] == Kind.DWELL)
    return upright


def _is_constant(features: Features, rows: Indices, body: Indices) -> bool:
    steady = features.several(_STEADY, rows)
    kinds = np.isin(features.kind[rows], [int(k) for k in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DWELL)])
    arcs = body[features.kind[body] != Kind.FEED]
    flat = (features.of("plane", arcs) == 17) & (features.of("turns", arcs) == 1)
    z = np.concatenate([features.end[body, 2], features.start[body, 2]])
    level = bool(np.isnan(z).all() or np.ptp(z) <= STILL)
    radius, mode = (features.of(name, rows[:1])[0] for name in ("radius", "feed_mode"))
    return bool(
        kinds.all() and (steady == steady[0]).all() and flat.all() and level and radius == 40 and mode in (94, 95)
    )


def _reverse_run(new: Features, old: Features, first: int, end: int, body: Indices) -> None:
    """Reverse the cuts of a run in `new`, and swap the positions of plunge and retract.

    A reversed cut has a new kind, start and end.
    """
    new.end[body], new.start[body] = old.start[body], old.end[body]
    kind = old.kind[body]
    back = np.where(kind == Kind.ARC_CW, int(Kind.ARC_CCW), np.where(kind == Kind.ARC_CCW, int(Kind.ARC_CW), kind))
    new.kind[body] = back
    entry, leave = old.start[body[0], :2], old.end[body[-1], :2]
    for part, place in ((slice(first, int(body[0])), leave), (slice(int(body[-1]) + 1, end), entry)):
        new.end[part, :2], new.start[part, :2] = place, place


def reversed_runs(one: DirectedWork, other: DirectedWork, new_of: Indices) -> Indices:
    """Return the run of each feature that the other program cuts in the opposite direction.

    All other features get -1.
    """
    paired = np.flatnonzero((new_of >= 0) & (one.run >= 0))
    differs = paired[one.turned[paired] != other.turned[new_of[paired]]]
    turned = np.isin(one.run, one.run[differs]) & (one.run >= 0)
    return np.where(turned, one.run, -1)


# -- the changed order -----------------------------------------------------------------------------------------------


class ChangedOrder:
    """Checks the order of the work in a new program.

    Attributes
    ----------
    new_of
        Index of each original feature in the new program, int64[n], or -1 if the feature is missing.
    flat
        Whether the tool is a beam or a pen, which makes no roughing passes.
    """

    def __init__(
        self,
        before: ProgramWork,
        after: ProgramWork,
        gaps: RapidGaps,
        new_of: Indices,
        flat: bool,
        check_cancelled: Heartbeat = ignore_heartbeat,
    ) -> None:
        self.before, self.after, self.gaps = before, after, gaps
        self.features, self.new_of, self.flat, self.check_cancelled = before.features, new_of, flat, check_cancelled
        self.unchanged = bool((np.diff(new_of[new_of >= 0]) > 0).all())
        self.traces = traces_of(self.features)
        # A run is a series of features without rapids between them.
        run = np.cumsum(allowed_heights(before, gaps).follows == 0)
        self.run: Indices = np.subtract(run, run[:1], dtype=np.int64)

    def touching_differences(self, tolerance: float) -> Iterator[Difference]:
        """Yield touching cuts whose order changed, and features at unknown positions that changed places."""
        if self.unchanged:
            return
        known = np.isfinite(self.features.end[:, :2]).all(axis=1)
        for one in np.flatnonzero(~known & _moved_mask(self.new_of)).tolist():
            yield self._difference(
                Message("order"),
                one,
                one,
                lambda where, _: Message("the position of {} is unknown, and it has moved in the order", where),
            )
        self.check_cancelled()
        pairs, proved = touching_in_new_order(self.features, self.traces, self.new_of, tolerance, self.check_cancelled)
        for one, other in pairs[:MOST_LISTED].tolist():
            yield self._difference(
                Message("order"),
                one,
                other,
                partial(Message, "{} touches {}, which originally came later and now comes first"),
            )
        if not proved:
            yield Difference(
                Message("order"), 0, 0, Message("too many cuts overlap, so their order cannot be verified")
            )

    def inside_contour_differences(self) -> Iterator[Difference]:
        """Yield work that moved from before an enclosing outline to after it, or vice versa.

        The outline is a closed cut or has tabs. With a beam or a pen, only work that is now after the outline counts.
        """
        if self.unchanged or not len(self.traces.feature):
            return
        n = int(self.run[-1]) + 1
        first = np.searchsorted(self.run, np.arange(n))
        last = np.searchsorted(self.run, np.arange(n), side="right") - 1
        begins, ends = self.new_of[first], np.full(n, -1)
        np.maximum.at(ends, self.run, self.new_of)
        latest = np.maximum.accumulate(np.concatenate([[-1], begins]))[:n]
        missing = len(self.new_of)
        soonest = np.minimum.accumulate(np.concatenate([[missing], np.where(begins < 0, missing, begins)[::-1]]))[:n]
        moved = ((latest > ends) | (soonest[::-1] < ends)) & (ends >= 0)
        tab = BEAM_TAB if self.flat else MILL_TAB
        lines = list(task_lines(self.features, self.traces, self.run, FREE.sagitta))
        counts = {False: 0, True: 0}
        for outline, within in lines_starting_inside(lines, outlines_of(lines, tab, FREE, self.check_cancelled, moved)):
            if counts[outline.joined] > MOST_LISTED or (begins[outline.owners] < 0).any():
                continue
            inner = np.setdiff1d(within, outline.owners)
            closes, closed = outline.owners[-1], ends[outline.owners].max()
            changed = (inner < closes) & (begins[inner] > closed)
            if not self.flat:
                changed |= (inner > closes) & (begins[inner] < closed) & (begins[inner] >= 0)
            for k in inner[changed].tolist():
                counts[outline.joined] += 1
                kind = Message("inner after outer") if k < closes else Message("inner before outer")
                message = partial(_changed_side, outline.joined, k < closes, self.flat)
                yield self._difference(kind, int(first[k]), int(last[closes]), message)

    def pass_differences(self, width: float) -> Iterator[Difference]:
        """Yield nearby passes of a mill whose order changed, and parts that are now detached too early.

        `width` is the width of the mill, mm.
        """
        if self.unchanged or not len(self.features):
            return
        first = ~self.gaps.opened_by_feature[self.gaps.gap_of]
        visit = np.cumsum(self.gaps.across[self.gaps.gap_of] | first, dtype=np.int64)
        visit = np.unique(visit, return_inverse=True)[1].ravel()
        visits = build_visits(self.features, self.traces, visit, int(visit[-1]) + 1, FREE)
        changed = islice(self._passes(visits, visit, width), 2 * MOST_LISTED)
        yield from (self._difference(Message("order"), *pair) for pair in changed)
        text = partial(
            Message, "{} was cut before the part whose outline ends at {} was detached; now it is cut afterwards"
        )
        for other, outline in islice(self._detached_too_early(visits, visit), MOST_LISTED + 1):
            yield self._difference(Message("part detached too early"), other, outline, text)

    def _passes(self, visits: Visits, visit: Indices, width: float) -> Iterator[_Pair]:
        begins = self.new_of[visits.first]
        crossed = self.gaps.cross[self.gaps.gap_of[visits.first]]
        chosen = visits.cuts & visits.level & (crossed > visits.bottom + LEVEL) & _moved_mask(begins)

        def wanted(a: Indices, b: Indices) -> Mask:
            changed: Mask = (a < b) & (begins[a] > begins[b])
            return changed

        if np.count_nonzero(chosen) > 1:
            owner = np.where(chosen[visit], visit, -1)
            near, of = line_index(task_lines(self.features, self.traces, owner, FREE.sagitta))
            known: set[tuple[str, int, int]] = set()
            for relation, pairs in nearby_passes(visits, near, of, FREE, width, wanted):
                self.check_cancelled()
                # Long cuts meet in several parts of the index.
                new = [pair for pair in ((relation, *pair) for pair in pairs.tolist()) if pair not in known]
                known.update(new)
                message = partial(_changed_order, relation)
                yield from ((*visits.first[list(pair)].tolist(), message) for _, *pair in new)
        for one, other in rows_in_order(visits, FREE, width).tolist():
            if 0 <= begins[other] < begins[one]:
                text = partial(Message, "{} clears a row beside {}, which originally came later and now comes first")
                yield int(visits.first[one]), int(visits.first[other]), text

    def _detached_too_early(self, visits: Visits, visit: Indices) -> Iterator[tuple[int, int]]:
        """Yield (feature, last feature of an outline) if the outline now detaches a part before the feature is cut.

        Parts that are detached at the same depth or deeper may be detached in either order.
        """
        features = self.features
        shifts = [mark.key for mark in self.before.marks if mark.kind == Kind.SHIFT]
        origin = np.searchsorted(shifts, features.row[visits.first])
        zeros = np.column_stack([features.of("frame", visits.first), origin])
        zero = np.unique(zeros, axis=0, return_inverse=True)[1].ravel()
        deepest = np.full(int(zero.max()) + 1, np.inf)
        np.minimum.at(deepest, zero, visits.floor)
        with np.errstate(invalid="ignore"):
            above = np.where(np.isfinite(visits.floor), visits.floor - deepest[zero], np.inf)
        ends = np.full(len(above), -1, dtype=np.int64)
        np.maximum.at(ends, visit, self.new_of)
        latest = np.maximum.accumulate(np.concatenate([[-1], ends]))[:-1]
        overtakes = (above <= FREE.surely_through) & (ends >= 0) & (latest > ends)
        if not overtakes.any():
            return
        may, surely = detaching_visits(features, self.traces, visits, visit, above, FREE, self.check_cancelled)
        for outline in np.flatnonzero(overtakes & surely).tolist():
            later = ends[:outline] > ends[outline]
            later &= ~(may[:outline] & (visits.floor[:outline] <= visits.floor[outline] + FREE.same_depth))
            if later.any():
                yield int(visits.first[np.argmax(later)]), int(visits.last[outline])

    def parts_note(self) -> list[Message]:
        """Return a note if the outlines of parts are cut in a different order."""
        features, run = self.features, self.run
        n = int(run[-1]) + 1 if len(run) else 0
        last = np.searchsorted(run, np.arange(n), side="right") - 1
        ends = np.full(n, -1, dtype=np.int64)
        np.maximum.at(ends, run, self.new_of)
        if (np.diff(ends[ends >= 0]) > 0).all():
            return []
        parts = self._part_outlines()
        parts = parts[ends[parts] >= 0]
        later = np.maximum.accumulate(np.concatenate([[-1], ends[parts]]))[:-1]
        moved = parts[later > ends[parts]]
        if not len(moved):
            return []
        one = int(moved[0])
        other = int(parts[(parts < one) & (ends[parts] > ends[one])][0])
        places = [
            Message("X{:.3f} Y{:.3f} (line {})", *features.end[k, :2], features.line[k])
            for k in last[[one, other]].tolist()
        ]
        return [
            Message(
                "parts detach in a different order: {} of {} outlines are cut earlier than before. "
                "Example: the outline that ends at {} is now cut before the path that ends at {}",
                len(moved),
                len(parts),
                *places,
            )
        ]

    def _part_outlines(self) -> Indices:
        """Return the runs that are outlines of parts: closed cuts inside an even number of other outlines."""
        lines = list(task_lines(self.features, self.traces, self.run, FREE.sagitta))
        outlines = list(outlines_of(lines, None, FREE, self.check_cancelled))
        if not outlines:
            return np.zeros(0, dtype=np.int64)
        starts = {line.owner: line.points[0] for line in reversed(lines)}
        owner = np.array([outline.owners[0] for outline in outlines])
        areas = np.array([outline.area for outline in outlines], dtype=object)
        inner, outer = shapely.STRtree(areas).query(
            shapely.points(np.array([starts[k] for k in owner.tolist()])), predicate="within"
        )
        depth = np.bincount(inner[owner[inner] != owner[outer]], minlength=len(owner))
        parts: Indices = np.unique(owner[depth % 2 == 0])
        return parts

    def _difference(self, what: Message, one: int, other: int, message: _MessageOf) -> Difference:
        features = self.features
        places = [Message("{} (line {})", position_text(*features.end[k]), features.line[k]) for k in (one, other)]
        lines = int(features.line[one]), int(self.after.features.line[self.new_of[one]])
        return Difference(what, *lines, message(*places))


def _changed_side(tabs: bool, later: bool, flat: bool, place: Message, end: Message) -> Message:
    message = Message(
        "{} lies inside an outline with tabs that ends at {}; originally it was cut {} this cut, and now it is "
        "cut {} it"
        if tabs
        else "{} lies inside a closed cut that ends at {}; originally it was cut {} this cut, and now it is cut {} it",
        place,
        end,
        Message("before") if later else Message("after"),
        Message("after") if later else Message("before"),
    )
    return Message("{}, in a part that is already detached by then", message) if flat and not tabs else message


def _changed_order(relation: Message, place: Message, other: Message) -> Message:
    return Message("{} {} {}, which originally came later and now comes first", place, relation, other)


def _moved_mask(begins: Indices) -> Mask:
    """Return a mask of the visits or features whose order relative to any other has changed. -1 means missing."""
    here = begins >= 0
    most = np.maximum.accumulate(begins) > begins
    least = np.minimum.accumulate(np.where(here, begins, np.iinfo(np.int64).max)[::-1])[::-1] < begins
    moved: Mask = here & (most | least)
    return moved
