"""Classify the rows of a program as cuts or travel moves, and find the blocks that separate the tasks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.program import Modal, Program
from leafcut.gcode.program_interpreter import CALLED
from leafcut.gcode.words import parse_plain_block
from leafcut.message import Message
from leafcut.model.kinds import BEAMS, ProgramKind
from leafcut.model.toolpath import MOTIONS, SPEED_ALONE, Kind, latest_marked_rows
from leafcut.processes.program.proof.features import Features, ProgramPath, features_of
from leafcut.processes.program.proof.order_thresholds import FREE

#: Why a block stays, by the kind of its row.
_BARRIERS = {
    Kind.TOOL: Message("a tool change"),
    Kind.OFFSET: Message("a change of length offset"),
    Kind.COOLANT: Message("coolant is switched on or off"),
    Kind.PAUSE: Message("the program stops for the operator"),
    Kind.MACHINE: Message("a move in machine coordinates"),
    Kind.END: Message("the end of the program"),
    Kind.FRAME: Message("a change of work offset"),
    Kind.SHIFT: Message("the origin is moved"),
    Kind.BLENDING: Message("a change of path control (G61, G64)"),
    Kind.FOREIGN: Message("the block is not understood"),
}
#: Why a block stays, by the modal value that it changes.
_CHANGES = {
    "unit": Message("a change of units"),
    "feed_mode": Message("a change of feed mode"),
    "coolant": Message("coolant is switched on or off"),
    "tool": Message("a tool change"),
    "next_tool": Message("the choice of the next tool"),
    "length": Message("a change of length offset"),
    "frame": Message("a change of work offset"),
    "shift": Message("the origin is moved"),
    "blending": Message("a change of path control (G61, G64)"),
    "tolerance": Message("a change of path control (G61, G64)"),
    "joining": Message("a change of path control (G61, G64)"),
}
#: Why the block with the first length stays if the program does not state its units: the assumed units take effect
#: there.
_ASSUMED_UNITS = Message("the units are assumed: G20 or G21 is missing")
_TORCH = re.compile(r"plasma|torch|pierce|\bTHC\b", re.IGNORECASE)

TOLERANCE = 1e-6
#: A program drives a beam if at least this share of its switch-on commands come directly before a cut.
_MOSTLY = 0.9


@dataclass(frozen=True, eq=False)
class Rows:
    """The role of every row of a program: cut, travel move or neither.

    Attributes
    ----------
    cut, travel
        Masks of the rows that cut, and of the rows that move sideways without cutting, bool[n]. A canned cycle does
        both.
    sideways
        Mask of the rows that move in X or Y, bool[n].
    beam
        Mask of the rows of a laser or torch program in which the beam is on, bool[n].
    deepest
        Z of the deepest sideways cut in the work offset of each entry of `Program.modals`, mm, float64[m]; NaN without
        a cut.
    tool_diameter
        Diameter of the tools that no comment describes, mm; 0 if it is unknown.
    """

    program: Program
    cut: NDArray[np.bool_]
    travel: NDArray[np.bool_]
    sideways: NDArray[np.bool_]
    beam: NDArray[np.bool_]
    deepest: NDArray[np.float64]
    tool_diameter: float

    @cached_property
    def features(self) -> Features:
        """The cuts, holes and dwells of the program."""
        kind = self.program.path.kind
        # A beam at zero power that was not switched off may still cut.
        dim = (kind >= Kind.FEED) & (kind <= Kind.ARC_CCW) & self.sideways & ~self.travel
        return features_of(ProgramPath.of(self.program), self.cut | dim | (kind == Kind.DWELL))


def read_rows(program: Program, process: str, tool_diameter: float = 0.0) -> Rows:
    """Classify the rows of a program.

    In a laser or torch program, a feed move after M5 is a travel move, just like a rapid.
    """
    path = program.path
    before = path.before
    block = program.row_block
    feed = np.isin(path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    rapid, drill = path.kind == Kind.RAPID, path.kind == Kind.DRILL
    with np.errstate(invalid="ignore"):
        # An axis without a known position has not moved yet.
        same = (np.abs(path.end[:, :2] - before[:, :2]) < TOLERANCE) | np.isnan(path.end[:, :2])
    sideways = (rapid | drill | feed) & ~same.all(axis=1)
    if process not in BEAMS:
        dark = np.zeros(len(path), dtype=bool)
        with np.errstate(invalid="ignore"):
            aside = np.hypot(*(path.end[:, :2] - before[:, :2]).T) > FREE.still
        deepest = _deepest_by_modal(program, block, feed & (aside | (path.kind != Kind.FEED)))
        return Rows(program, feed | drill, (rapid | drill) & sideways, sideways, dark, deepest, tool_diameter)
    beam = _beam_mask(program)
    off = np.array([program.modals[k].spindle == 0 for k in program.before.tolist()], dtype=bool)[block]
    off &= ~beam & (np.bincount(block[path.kind == Kind.SPINDLE], minlength=program.n_blocks) == 0)[block]
    cut = (feed & beam) | drill | ((path.kind == Kind.DWELL) & beam)
    # An arc depends on its start point, so it stays with the move to that point.
    off &= path.kind == Kind.FEED
    across = (rapid & ~beam) | off if process == ProgramKind.PLASMA else rapid | off
    return Rows(program, cut, across & sideways, sideways, beam, np.full(len(program.modals), np.nan), 0.0)


def _deepest_by_modal(program: Program, block: NDArray[np.int32], aside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Compute `Rows.deepest`. `aside` is a mask of the rows that cut sideways."""
    keys = [(m.frame, m.shift) for m in program.modals]
    number = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    of_modal = np.array([number[key] for key in keys], dtype=np.int64)
    rows = np.flatnonzero(aside & np.isfinite(program.path.end[:, 2]))
    found = np.full(len(number), np.inf)
    np.minimum.at(found, of_modal[program.before[block[rows]]], program.path.end[rows, 2])
    return np.where(np.isfinite(found), found, np.nan)[of_modal]


def beam_off_rows(program: Program, process: str) -> NDArray[np.bool_]:
    """Return a mask of the feed moves with the beam off, bool[n]. For a cutting tool, the mask is all False."""
    dark: NDArray[np.bool_] = (program.path.kind == Kind.FEED) & (process in BEAMS)
    return dark & ~_beam_mask(program) if dark.any() else dark


def _beam_mask(program: Program) -> NDArray[np.bool_]:
    """Return a mask of the rows with the beam on. If the program sets a power, the power must be above zero."""
    path = program.path
    switched = path.kind == Kind.SPINDLE
    on = path.value != 0.0
    if switched.any() and not on[switched].any():
        on = program.modal_at_rows("spindle") != 0
    last = latest_marked_rows(switched)
    beam: NDArray[np.bool_] = (last >= 0) & on[last]
    return beam


def detect_process(program: Program) -> str:
    """Detect whether a program drives a beam or a spindle.

    A beam is switched on before every cut. A spindle is switched on only before the first move.
    """
    path = program.path
    feed = np.isin(path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    before = path.before
    with np.errstate(invalid="ignore"):
        still = (np.abs(path.end - before) < TOLERANCE) | np.isnan(path.end)
    steady = still[:, :2].all(axis=1)
    # A full circle ends at its start, but still moves sideways.
    sideways = feed & (~steady | (path.kind != Kind.FEED))
    if not sideways.any():
        return "drill"
    spindle = path.kind == Kind.SPINDLE
    if (path.kind == Kind.DRILL).any() or not spindle.any():
        return "mill"
    ways = (path.kind == Kind.RAPID) & ~steady
    moving = np.isin(path.kind, [int(k) for k in MOTIONS])
    level = not (moving & ~still[:, 2] & np.isfinite(before[:, 2])).any()
    beam = _beam_mask(program)
    on = np.flatnonzero(spindle & beam & ~np.concatenate([[False], beam[:-1]]))
    crossing = np.flatnonzero(ways | sideways)
    follower = np.searchsorted(crossing, on)
    on_place = sideways[crossing[follower[follower < len(crossing)]]]
    # Cuts are separated by rapids.
    cuts = len(np.unique(np.cumsum(ways)[sideways]))
    if level or (len(on) >= 2 and on_place.mean() >= _MOSTLY and 2 * len(on) >= cuts):
        return ProgramKind.PLASMA if _is_torch(program, spindle) else ProgramKind.LASER
    return "mill"


def _is_torch(program: Program, spindle: NDArray[np.bool_]) -> bool:
    """Return whether a program mentions a torch or has rapids at several heights, as programs for torches do."""
    if any(_TORCH.search(line) for line in program.lines[:400]):
        return True
    z = program.path.end[program.path.kind == Kind.RAPID, 2]
    z = z[np.isfinite(z)]
    first = int(np.argmax(spindle))
    after = program.path.end[first:][program.path.kind[first:] == Kind.RAPID, 2]
    return len(z) > 0 and len(np.unique(after[np.isfinite(after)].round(3))) > 1


def find_barriers(program: Program, rows: Rows) -> dict[int, str]:
    """Find the blocks that must never move, and the reason for each of them."""
    barriers: dict[int, str] = {}
    path = program.path
    hard = np.isin(path.kind, [int(k) for k in _BARRIERS])
    block = program.row_block
    for row in np.flatnonzero(hard).tolist():
        barriers.setdefault(int(block[row]), _BARRIERS[Kind(int(path.kind[row]))])
    before = program.before
    reasons: dict[tuple[int, int], str] = {}
    for number in np.flatnonzero(before[1:] != before[:-1]).tolist():
        pair = int(before[number]), int(before[number + 1])
        if pair not in reasons:
            reasons[pair] = _changed_mode(program.modals[pair[0]], program.modals[pair[1]])
            if program.assumed_units and reasons[pair] == _CHANGES["unit"]:
                reasons[pair] = _ASSUMED_UNITS
        if reasons[pair]:
            barriers.setdefault(number, reasons[pair])
    for row in _idle_rows(program, rows):
        what = Message("a dwell") if path.kind[row] == Kind.DWELL else Message("the spindle is switched on or off")
        barriers.setdefault(int(block[row]), Message("{} between two tasks", what))
    _add_calls_to_barriers(program, barriers)
    return barriers


def _add_calls_to_barriers(program: Program, barriers: dict[int, str]) -> None:
    """Add fixed blocks and repeated lines to the barriers.

    Subprogram calls that can move as a whole are skipped. A call with M98 or M97 can move if it has no parameters and
    does not change the spindle state.
    """
    free: set[int] = set()
    held: dict[int, str] = {}
    for begin, end in program.calls:
        why = _reason_call_stays(program, barriers, begin, end)
        if why:
            held[begin] = why
        else:
            free.update(range(begin, end))
    often = np.bincount(program.line, minlength=2)
    for number in np.flatnonzero(often[program.line] > 1).tolist():
        if number not in free:
            barriers[number] = Message("the block is run more than once")
    barriers.update((block, why) for block, why in program.fixed.items() if block not in free)
    barriers.update(held)


def _reason_call_stays(program: Program, barriers: dict[int, str], begin: int, end: int) -> str:
    """Return the reason why a call and its subprogram cannot move as a whole, or "" if they can."""
    for block in range(begin, end):
        fixed = program.fixed.get(block, "")
        inner = barriers.get(block) or ("" if fixed in CALLED else fixed)
        line = int(program.line[block])
        text = program.lines[line - 1]
        if not inner and ((plain := parse_plain_block(text)) is None or plain.percent is not None):
            inner = (
                Message("the numbers in the block come from parameters")
                if "#" in text
                else Message("the block contains more than words with numbers")
            )
        if inner and block == begin:
            return inner
        if inner:
            return Message("the subprogram has a block at line {} that keeps its position: {}", line, inner)
    before, after = program.modal(begin), program.modal(end)
    same = (before.spindle, before.rpm) == (after.spindle, after.rpm)
    return "" if same else Message("the subprogram changes the spindle state")


def _idle_rows(program: Program, rows: Rows) -> list[int]:
    """Return the rows that dwell or switch the spindle between two tasks for an unknown purpose.

    Such a row comes after a cut and a retract, and before the next travel move. A dwell at a position without a cut
    also counts. Switching a beam does not count, because a beam is switched on and off for every cut.
    """
    kind = program.path.kind
    n = len(kind)
    numbers = np.arange(n)

    def next_(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
        return np.minimum.accumulate(np.where(mask, numbers, n)[::-1])[::-1]

    if not n:
        return []
    ways = rows.travel & ~rows.cut
    cut, rapid, travel = latest_marked_rows(rows.cut), latest_marked_rows(kind == Kind.RAPID), latest_marked_rows(ways)
    dwells = kind == Kind.DWELL
    # A spindle speed set by S alone belongs to the following cut (`SectionFinder`).
    switches = (kind == Kind.SPINDLE) & (program.path.ref != SPEED_ALONE) & (not rows.beam.any())
    after_work = (cut >= 0) & (rapid > cut)
    leads_away = ((dwells | switches) & (travel < cut)) | (dwells & (next_(ways) < next_(rows.cut)))
    # A canned cycle ends with its own retract.
    idle = ~rows.cut & ((after_work & leads_away) | (dwells & (cut >= 0) & (cut > rapid) & (kind[cut] == Kind.DRILL)))
    found: list[int] = np.flatnonzero(idle).tolist()
    return found


def _changed_mode(one: Modal, other: Modal) -> str:
    for name, reason in _CHANGES.items():
        if getattr(one, name) != getattr(other, name):
            return reason
    return ""


def runs_without_barriers(program: Program, barriers: dict[int, str]) -> list[tuple[int, int]]:
    """Return the half-open ranges of blocks that contain no barriers.

    Only comments may separate the lines of a range.
    """
    edges = {0, program.n_blocks}
    for block in barriers:
        edges |= {block, block + 1}
    step = np.diff(program.text_line)
    for begin, end in program.calls:
        # A subprogram stays together with its call.
        step[begin : end - 1] = 1
    edges |= {int(b) + 1 for b in np.flatnonzero(step < 1)}
    for block in np.flatnonzero(step > 1).tolist():
        between = program.lines[int(program.text_line[block]) : int(program.text_line[block + 1]) - 1]
        if not all(_is_comment_line(line) for line in between):
            edges.add(block + 1)
    ordered = sorted(edges)
    pairs = pairwise(ordered)
    return [(begin, end) for begin, end in pairs if begin not in barriers]


def _is_comment_line(line: str) -> bool:
    block = parse_plain_block(line)
    return (
        block is not None
        and block.percent is None
        and not block.deleted
        and all(word.letter == "N" for word in block.words)
    )
