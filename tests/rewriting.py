"""What tests of resequencing and rewriting share: orders that keep precedence, and work as multisets of cuts."""

from __future__ import annotations

import math
import random
from bisect import insort
from collections import Counter
from dataclasses import replace

import numpy as np

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.sequence import Section, Sequence
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.features import Features, ProgramPath, features_of

CUTS = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW, Kind.DRILL)


def program_of(text: str, name: str = "linuxcnc") -> Program:
    """Return the program of a text; blocks are separated by `` / `` or by line ends."""
    return interpret_program(text.replace(" / ", "\n"), load_dialect(name))


def rewritten(text: str, *orders: list[int], **options: object) -> str:
    """Return a text with its sections in the given orders, in the notation of `program_of`."""
    program = program_of(text)
    sequence = find_sequence(program, **options)  # type: ignore[arg-type]
    return rewrite(program, sequence, [np.array(o) for o in orders]).rstrip("\n").replace("\n", " / ")


def features_in(path: Toolpath, which: np.ndarray) -> Features:
    """Return the features in the rows `which` of a toolpath."""
    program = Program.of_toolpath(path, [""] * (1 + int(path.line.max(initial=0))))
    return features_of(ProgramPath.of(program), which)


def some_order(section: Section, rng: random.Random) -> np.ndarray:
    """Return a random order of the pieces of a section that keeps its precedence."""
    n = len(section.pieces)
    waits_for, then = [0] * n, [list[int]() for _ in range(n)]
    for one, other in {(one, other) for one, other in section.precedence.tolist()}:
        waits_for[other] += 1
        then[one].append(other)
    ready = [k for k in range(n) if not waits_for[k]]
    order: list[int] = []
    while len(order) < n:
        order.append(ready.pop(ready.index(rng.choice(ready))))
        for other in then[order[-1]]:
            waits_for[other] -= 1
            if not waits_for[other]:
                insort(ready, other)
    return np.array(order)


def some_orders(sequence: Sequence, seed: int) -> list[np.ndarray]:
    """Return a random order for every section."""
    rng = random.Random(seed)
    return [some_order(section, rng) for section in sequence.sections]


def work_of(program: Program) -> Counter:
    """Return every cut of a program with its start, end, feed, tool, spindle, coolant and offset, as a multiset.

    What a feed does while a beam is off (M5) is a way, not work.
    """
    path = program.path
    before = path.before
    beam = bool((path.kind == Kind.SPINDLE).any()) and not np.isfinite(path.end[:, 2]).any()
    tool = coolant = offset = 0
    spindle = 0.0
    work: Counter = Counter()
    for row, motion in enumerate(path):
        if motion.kind is Kind.TOOL:
            tool = motion.ref
        elif motion.kind is Kind.OFFSET:
            offset = motion.ref
        elif motion.kind is Kind.SPINDLE:
            spindle = motion.value
        elif motion.kind is Kind.COOLANT:
            coolant = motion.ref
        elif motion.kind is Kind.DWELL and motion.value > 0:
            work["dwell", motion.value] += 1
        elif motion.kind in CUTS and not (beam and spindle == 0):
            detail: object = None
            start = tuple(round(v, 6) for v in before[row].tolist())
            if motion.kind is Kind.DRILL:
                detail, start = replace(path.cycles[motion.ref], approach="level"), ()
            elif motion.kind is not Kind.FEED:
                detail = path.arcs[motion.ref]
            end = tuple(round(v, 6) for v in motion.end)
            work[str((motion.kind, start, end, round(motion.value, 9), detail, tool, spindle, coolant, offset))] += 1
    return work


def lowest_way(program: Program) -> float:
    """Return the lowest height, mm, at which a program goes across at rapid."""
    path = program.path
    before = path.before
    lowest = math.inf
    for row, motion in enumerate(path):
        moves = any(abs(a - b) > 1e-6 for a, b in zip(motion.end[:2], before[row, :2].tolist(), strict=True))
        if moves and motion.kind is Kind.RAPID:
            lowest = min(lowest, motion.end[2], float(before[row, 2]))
        elif moves and motion.kind is Kind.DRILL:
            lowest = min(lowest, max(float(before[row, 2]), path.cycles[motion.ref].r_plane))
    return lowest
