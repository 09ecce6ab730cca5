"""The proof of a rewritten program: `certify` compares what two programs do, and says it in a `model.certificate`.

It sees the two programs and nothing of how one was made from the other.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Indices
from leafcut.model.certificate import Certificate, Counts
from leafcut.model.difference import Difference
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.proof.barriers import ComparisonGroups, compare_unrun, compare_walls, misplaced
from leafcut.processes.program.proof.came_free import came_free
from leafcut.processes.program.proof.features import FIRST_CYCLE
from leafcut.processes.program.proof.inner_first import exchanged
from leafcut.processes.program.proof.loosened import loosened
from leafcut.processes.program.proof.matching import Room, pair
from leafcut.processes.program.proof.passes import misordered, told_width
from leafcut.processes.program.proof.program_work import STILL, ProgramWork, cuts_with_beam, read_work
from leafcut.processes.program.proof.rapids import compare_rapids, gaps_of, heights_of
from leafcut.processes.program.proof.reversed_cuts import as_it_is, one_way, runs_turned
from leafcut.processes.program.proof.same_work import list_changes, only_moves
from leafcut.processes.program.proof.stated import no_longer_stated
from leafcut.processes.program.proof.tabbed import BEAM_TAB, MILL_TAB, freed
from leafcut.processes.program.proof.touching_order import inverted
from leafcut.processes.program.proof.traces import traces_of
from leafcut.proof.difference import MOST_LISTED, place, shorten
from leafcut.proof.envelope import check_envelope

#: What a certificate stands for, in the order in which it is looked at.
COMPARED = (
    "barriers: pauses, tool changes, work offsets, machine moves, settings that the controller takes from comments and "
    "parameters, and blocks that are not understood, in order",
    "holes, cuts and dwells between two barriers: place, depth, cycle, peck, dwell, feed, speed and direction, tool, "
    "length offset, work offset, coolant, radius compensation, feed mode, blending, plane",
    "order of cuts that touch each other, and of closed cuts and outlines with tabs and what lies inside them",
    "order of a mill's passes near each other: levels, side by side, rows",
    "what a mill makes before parts come free",
    "rapids: heights at every place and across, no cut torn apart",
    "envelope",
)
#: Compared besides, where it is allowed to turn cuts round.
_EITHER_WAY = "open cuts at one level without lead-in or lead-out, in either direction"

#: Lowest and highest x, y, z, mm.
Bounds = tuple[tuple[float, ...], tuple[float, ...]]

#: A rewritten program keeps the words of the original: only noise, and a change of units, may be between the two.
_FEED_PART, _FEED, _DWELL, _SPEED_PART, _SPEED = 5e-5, 1e-4, 1e-4, 1e-6, 1e-3

_NOT_IN_COMMENT = re.compile(r"[^A-Za-z0-9 ._+=,-]")
#: GRBL takes lines of 80 characters at most; the parentheses and a line number need some of them.
_LONGEST_COMMENT = 66
_LINES_AT_ONCE = 10_000


def certify(
    original: Program,
    new: Program,
    *,
    machine: Machine | None = None,
    tolerance_mm: float = 0.002,
    allow_reverse: bool = False,
    beyond: Bounds | None = None,
    look: Heartbeat = unseen,
    notes: bool = False,
) -> Certificate:
    """Return the proof that two programs do the same work, or in what they differ.

    - Barriers are the same, in the same order, and the tool is not lower there; where a block is not understood, it
      begins at the same place. Only whole tool changes may be missing (`barriers`).
    - Between two barriers there are the same holes, cuts and dwells, in any order (`matching`); but
    - those that touch each other have kept theirs, and what lies inside a closed cut, or an outline with tabs, stays
      before or after it (with a laser or torch, only before) (`touching_order`, `inner_first`,
      `tabbed`). Passes of a mill at two levels or side by side, and rows, have kept theirs, too
      (`passes`), and what was made before a mill freed a part is not made after it
      (`loosened`).
    - Rapids leave, cross and arrive nowhere lower than they did at that place (`rapids`).
    - The new program reaches no farther than the original and, where the machine's work offset is known, stays in its
      travel.

    Feeds above the work count as cuts; feeds of a laser or torch that is off do not. When only one of the two uses
    drilling cycles, both are compared as single moves. Coordinates agree within `tolerance_mm` on every axis.

    With `allow_reverse`, open cuts at one level may be made from their other end (`reversed_cuts`).
    `look` is called as it goes on. `notes`: also tell what comes free before what, which is no difference where parts
    lie beside each other.

    Raises
    ------
    PlanError
        The pecks of a cycle are so many that no machine would drill so.
    """
    written_out, beam = only_moves(original.path) != only_moves(new.path), cuts_with_beam(original)
    before, after = (read_work(program, written_out=written_out, beam=beam) for program in (original, new))
    grouping = compare_walls(before.walls, after.walls)
    found = _Found(look, notes)
    found.add(grouping.differences)
    found.add(compare_unrun(original, new))
    found.add(no_longer_stated(original, new))
    found.add(misplaced(before.marks, grouping.mark_of, tolerance_mm))
    turned = _compare_work(before, after, grouping, tolerance_mm, beam, allow_reverse, told_width(original), found)
    found.add(_larger(before.path, after.path, tolerance_mm, beyond))
    found.add(_outside(new.path, machine))
    differences = tuple(shorten(found.differences, found.count))
    counts = _counts(before), _counts(after)
    compared = () if differences else (*COMPARED, _EITHER_WAY) if allow_reverse else COMPARED
    return Certificate(
        not differences, differences, *counts, compared, _digest(original), allow_reverse, turned, tuple(found.notes)
    )


def proof_lines(certificate: Certificate, name: str = "the original") -> list[str]:
    """Return a few short lines for the top of the new program, without the signs that make them a comment.

    `name` is that of the original; what would end a comment, or be too long for a controller, is left out of it.
    """
    clean = " ".join(_NOT_IN_COMMENT.sub("_", name).split()) or "the original"
    if not certificate.same:
        return ["leafcut: NOT the same work as", clean[-_LONGEST_COMMENT:]]
    before = certificate.before
    work = f"sha256 {certificate.sha256[:12]}, {before.holes} holes, {before.cuts} cuts, verified"
    head = "leafcut: same work as "
    said = [head + clean[-(_LONGEST_COMMENT - len(head)) :], f"leafcut: {work}"]
    if certificate.reversed_cuts:
        said.append(f"leafcut: {certificate.reversed_cuts} of the cuts from their other end, --allow-reverse")
    return said


def _digest(program: Program) -> str:
    """Return the SHA-256 of a program's text, some lines after the others: all at once fill the memory."""
    digest = hashlib.sha256()
    for begin in range(0, len(program.lines), _LINES_AT_ONCE):
        text = "".join(program.lines[begin : begin + _LINES_AT_ONCE])
        digest.update(text.encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


class _Found:
    """Differences as they come: the first of each sort, and how many there are in all; and notes where asked for."""

    def __init__(self, look: Heartbeat, noting: bool) -> None:
        self.look, self.noting = look, noting
        self.notes: list[str] = []
        self.differences: list[Difference] = []
        self.count = 0

    def add(self, differences: Iterable[Difference], count: int = 0) -> None:
        self.look()
        new = list(differences)
        self.differences += new[:MOST_LISTED]
        self.count += max(count, len(new))


def _compare_work(
    before: ProgramWork,
    after: ProgramWork,
    grouping: ComparisonGroups,
    tolerance: float,
    beam: bool,
    either_way: bool,
    width: float,
    found: _Found,
) -> int:
    """Add the differences of the work between the barriers; return how many cuts are made from their other end."""
    both = [one_way(work) if either_way else as_it_is(work) for work in (before, after)]
    features = [
        replace(
            side.work.features,
            group=np.searchsorted(ends, np.arange(len(side.work.features)), side="right").astype(np.int32),
        )
        for side, ends in zip(both, (grouping.before, grouping.after), strict=True)
    ]
    before, after = (replace(side.work, features=f) for side, f in zip(both, features, strict=True))
    room = Room(tolerance, _FEED_PART, _FEED, _DWELL, _SPEED, _SPEED_PART, rise=0.0)
    pairing = pair(features[0], features[1], room)
    found.add(*list_changes(pairing, room))
    turned = runs_turned(both[0], both[1], pairing.new_of)
    no_mill = beam or _is_flat(before.path)
    found.add(*compare_rapids(before, after, pairing.new_of, turned, grouping.mark_of, tolerance, no_mill))
    found.add(_disordered(before, after, pairing.new_of, tolerance, no_mill, found.look))
    if no_mill and found.noting:
        chain = _chains(before)
        found.notes += came_free(before.features, traces_of(before.features), chain, pairing.new_of, look=found.look)
    if not no_mill:
        found.add(_passes(before, after, pairing.new_of, width))
    return len(np.unique(turned[turned >= 0]))


def _is_flat(path: Toolpath) -> bool:
    """Return whether the tool never moves up or down: a laser whose beam is dark in rapids by itself, or a plotter."""
    z = path.end[path.kind <= Kind.DRILL, 2]
    return not bool((np.abs(np.diff(z[np.isfinite(z)])) > STILL).any() or (path.kind == Kind.DRILL).any())


def _disordered(
    before: ProgramWork, after: ProgramWork, new_of: Indices, tolerance: float, flat: bool, look: Heartbeat
) -> Iterator[Difference]:
    """Yield the cuts whose order has meaning, and has changed."""
    features = before.features
    if (np.diff(new_of[new_of >= 0]) > 0).all():
        return
    known = np.isfinite(features.end[:, :2]).all(axis=1)
    for one in _overtaken(new_of, np.flatnonzero(~known)):
        yield _both(
            before, after, new_of, one, one, "order", "the position of {} is unknown, and it has moved in the order"
        )
    traces = traces_of(features)
    look()
    touching = inverted(traces, new_of, tolerance)
    for one, other in touching.pairs[:MOST_LISTED].tolist():
        yield _both(before, after, new_of, one, other, "order", "{} touches {}, which came after it and is now before")
    if not touching.proved:
        yield Difference("order", 0, 0, "so many cuts lie on top of each other that their order cannot be proved")
    look()
    chain = _chains(before)
    places = features.end[:, :2]
    for inner, outer in exchanged(traces, places, chain, new_of, inner_may_come_first=flat):
        was, now = ("before", "after") if inner < outer else ("after", "before")
        text = f"{{}} lies inside a closed cut that ends at {{}}, and was made {was} it; now it is made {now} it"
        text += ", in a part that is free by then" if flat else ""
        yield _both(before, after, new_of, inner, outer, f"inner {now} outer", text)
    tab = BEAM_TAB if flat else MILL_TAB
    for inner, outer in freed(traces, chain, new_of, tab, look, inner_may_come_first=flat):
        was, now = ("before", "after") if inner < outer else ("after", "before")
        text = (
            f"{{}} lies inside an outline with tabs that ends at {{}}, and was made {was} it; now it is made {now} it"
        )
        yield _both(before, after, new_of, inner, outer, f"inner {now} outer", text)


def _chains(work: ProgramWork) -> Indices:
    """Return numbers of the runs of cuts without a way across in between, int64[n], from 0."""
    chain: Indices = np.cumsum(heights_of(work, gaps_of(work)).follows == 0)
    return np.subtract(chain, chain[:1], dtype=np.int64)


def _passes(before: ProgramWork, after: ProgramWork, new_of: Indices, width: float) -> Iterator[Difference]:
    """Yield the passes of a mill, of tools so wide, that touch nowhere, but have an order, and have left it."""
    features, gaps = before.features, gaps_of(before)
    if (np.diff(new_of[new_of >= 0]) > 0).all():
        return
    first = ~gaps.opened_by_feature[gaps.gap_of]
    visit = np.cumsum(gaps.across[gaps.gap_of] | first, dtype=np.int64)
    traces = traces_of(features)
    for one, other, text in misordered(features, traces, visit, gaps.cross[gaps.gap_of], new_of, width):
        yield _both(before, after, new_of, one, other, "order", text)
    shifts = [mark.key for mark in before.marks if mark.kind == Kind.SHIFT]
    origin = np.searchsorted(shifts, features.row).astype(np.int64)
    text = "{} was made before the part whose outline ends at {} came free; now it is made after it"
    for other, outline in loosened(features, traces, visit, origin, new_of):
        yield _both(before, after, new_of, other, outline, "part free too early", text)


def _overtaken(rank: Indices, which: Indices) -> list[int]:
    """Return those of `which` that have not the same features before them as they had."""
    highest = np.maximum.accumulate(np.concatenate([[-1], rank]))[:-1]
    lowest = np.minimum.accumulate(np.where(rank >= 0, rank, len(rank) + rank.max(initial=0))[::-1])[::-1]
    here = rank[which]
    wrong: list[int] = which[(here >= 0) & ((highest[which] > here) | (lowest[which] < here))].tolist()
    return wrong


def _both(
    before: ProgramWork, after: ProgramWork, new_of: Indices, one: int, other: int, what: str, text: str
) -> Difference:
    """Return a difference of two features: the first one's line in the original and in the new program."""
    said = [place(*before.features.end[k]) + f" (line {before.features.line[k]})" for k in (one, other)]
    lines = int(before.features.line[one]), int(after.features.line[new_of[one]])
    return Difference(what, *lines, text.format(*said))


def _larger(before: Toolpath, after: Toolpath, tolerance: float, beyond: Bounds | None) -> Iterator[Difference]:
    """Yield the axes on which the new program goes farther. Cuts are the same: what is looked at are ends of moves."""
    lowest, highest = beyond or ((math.inf,) * 3, (-math.inf,) * 3)
    for axis, name in enumerate("XYZ"):
        for sign, word in ((1.0, "above"), (-1.0, "below")):
            (was, reached), (now, reaches) = (_farthest(path, axis, sign) for path in (before, after))
            room = max(reached, sign * (highest if sign > 0 else lowest)[axis])
            if was < 0 or reaches <= room + tolerance + 1e-9:
                continue
            text = f"{name}{after.end[now, axis]:.3f} is {word} all of the original, {name}{before.end[was, axis]:.3f}"
            yield Difference("envelope", int(before.line[was]), int(after.line[now]), text)


def _farthest(path: Toolpath, axis: int, sign: float) -> tuple[int, float]:
    """Return the move that ends farthest along an axis (sign 1) or against it, -1 without moves, and how far."""
    moves = path.kind <= Kind.DRILL
    ends = np.where(moves, path.end[:, axis], np.nan)
    np.multiply(ends, sign, out=ends)
    ends[np.isnan(ends)] = -np.inf
    row = int(np.argmax(ends)) if moves.any() else -1
    return row, float(ends[row]) if row >= 0 else -math.inf


def _outside(path: Toolpath, machine: Machine | None) -> list[Difference]:
    """Return what lies outside the travel, up to where the origin moves: beyond, it is not known where the work is."""
    if machine is None or machine.work_offset is None:
        return []
    moved = (path.kind == Kind.SHIFT) | ((path.kind == Kind.FRAME) & (path.ref != 540))
    n = int(np.argmax(moved)) if moved.any() else len(path)
    columns = {name: getattr(path, name)[:n] for name in ("kind", "end", "value", "ref", "line")}
    return [d for d in check_envelope(replace(path, **columns), machine) if d.what == "outside travel"]


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
