"""Canned cycles written out: all at once as one by one, and as LinuxCNC does it."""

from __future__ import annotations

import math
import os
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import PlanError
from leafcut.model.cycles import expand_cycle, expand_cycles
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Motion, Toolpath, ToolpathBuilder

HEIGHT = st.sampled_from([-3.0, 0.5, 1.0, 2.0, 10.0])
CYCLE = st.builds(
    DrillCycle,
    name=st.sampled_from(["G81", "G82", "G83", "G73", "G84", "G85"]),
    r_plane=st.sampled_from([0.5, 1.0, 2.0]),
    bottom=st.sampled_from([-1.0, -4.0, -7.3]),
    to_initial=st.booleans(),
    peck=st.sampled_from([0.0, 1.0, 3.0]),
    dwell=st.sampled_from([0.0, 0.5]),
)
STEP = st.one_of(
    st.tuples(st.just("rapid"), HEIGHT),
    st.tuples(st.just("drill"), CYCLE),
    st.tuples(st.just("machine"), st.just(0.0)),
    st.tuples(st.just("dwell"), st.just(1.0)),
    st.tuples(st.just("arc"), st.just(0.0)),
)


def build(steps: list[tuple[str, object]]) -> Toolpath:
    builder = ToolpathBuilder()
    for number, (what, value) in enumerate(steps):
        if what == "rapid":
            builder.rapid(x=float(number), z=value, line=number)
        elif what == "drill":
            builder.drill(number * 10.0, 5.0, value, feed=2.0, line=number)
        elif what == "machine":
            builder.machine(z=value, line=number)
        elif what == "dwell":
            builder.dwell(value, line=number)
        else:
            builder.arc(True, (1.0, 2.0, 3.0), Arc((0.0, 0.0, 0.0)), feed=1.0, line=number)
    return builder.build()


def one_by_one(path: Toolpath) -> list[Motion]:
    rows: list[Motion] = []
    x = y = z = math.nan
    for motion in path:
        steps = [motion]
        if motion.kind is Kind.DRILL:
            steps = list(expand_cycle(motion, path.cycles[motion.ref], z))
        for step in steps:
            end = step.end
            if step.kind <= Kind.ARC_CCW:
                if motion.kind is Kind.DRILL and math.isnan(end[0]):
                    end = (x, y, end[2])
                x, y, z = end
            elif step.kind is Kind.MACHINE:
                x, y, z = (p if math.isnan(m) else math.nan for p, m in zip((x, y, z), end, strict=True))
            rows.append(step._replace(end=end))
    return rows


@given(st.lists(STEP, max_size=8))
def test_all_holes_at_once_are_the_same_moves_as_one_by_one(steps) -> None:
    path = build(steps)
    assert [repr(m) for m in expand_cycles(path)] == [repr(m) for m in one_by_one(path)]


@given(st.lists(STEP, max_size=8))
def test_the_place_before_a_row_is_the_end_of_the_row_before(steps) -> None:
    path = build(steps)
    x = y = z = math.nan
    for motion, before in zip(path, path.before, strict=True):
        np.testing.assert_array_equal(before, (x, y, z))
        if motion.kind <= Kind.DRILL:
            x, y, z = motion.end
        elif motion.kind is Kind.MACHINE:
            x, y, z = (p if math.isnan(m) else math.nan for p, m in zip((x, y, z), motion.end, strict=True))


def test_a_peck_that_cannot_be_meant_is_refused_before_it_fills_the_memory() -> None:
    with pytest.raises(PlanError, match="strokes per hole"):
        expand_cycles(build([("drill", DrillCycle("G83", 2.0, -1000.0, peck=1e-9))]))
    many = [DrillCycle("G83", 2.0, -4000.0 - i, peck=0.5) for i in range(300)]
    with pytest.raises(PlanError, match="use larger pecks"):
        expand_cycles(build([("drill", cycle) for cycle in many]))


PROGRAM = """G21 G90 G17 G40 G49 G80 G54 G94
G0 Z10
G0 X1 Y2
G98 G81 X10 Y10 Z-5 R2 F120
X20
G99 X30 Y5
X35
G83 X40 Y5 Z-5 R2 Q3
G73 X50 Y5 Z-5 R2 Q3
G82 X60 Y5 Z-5 R2 P0.5
G85 X70 Y5 Z-5 R2
G80
G0 Z1
G81 X80 Y5 Z-5 R2
M2
"""


def in_our_words() -> Toolpath:
    """Return PROGRAM as leafcut writes it: G98, then G99 and every cycle, and a hole that starts below its R plane."""
    builder = ToolpathBuilder()
    builder.rapid(z=10.0)
    builder.rapid(1.0, 2.0)
    plain = DrillCycle("G81", 2.0, -5.0)
    builder.drill(10.0, 10.0, replace(plain, to_initial=True), feed=2.0)
    builder.drill(20.0, 10.0, replace(plain, to_initial=True), feed=2.0)
    builder.drill(30.0, 5.0, plain, feed=2.0)
    builder.drill(35.0, 5.0, plain, feed=2.0)
    builder.drill(40.0, 5.0, DrillCycle("G83", 2.0, -5.0, peck=3.0), feed=2.0)
    builder.drill(50.0, 5.0, DrillCycle("G73", 2.0, -5.0, peck=3.0), feed=2.0)
    builder.drill(60.0, 5.0, DrillCycle("G82", 2.0, -5.0, dwell=0.5), feed=2.0)
    builder.drill(70.0, 5.0, DrillCycle("G85", 2.0, -5.0), feed=2.0)
    builder.rapid(z=1.0)
    builder.drill(80.0, 5.0, plain, feed=2.0)
    return builder.build()


def without_still(moves: list[tuple]) -> list[tuple]:
    """Return moves without those that go nowhere, from the first move whose place is known whole."""
    placed = [m for m in moves if not any(math.isnan(v) for v in m[1:])][1:]
    return [m for before, m in zip([None, *placed], placed, strict=False) if before is None or m[1:] != before[1:]]


def test_linuxcnc_makes_the_same_moves_of_the_same_cycles(tmp_path: Path, rs274: str) -> None:
    program, tools = tmp_path / "part.ngc", tmp_path / "tool.tbl"
    program.write_text(PROGRAM)
    tools.write_text("T1 P1 D3.0 Z0\n")
    home = dict(os.environ, HOME=str(tmp_path))  # rs274 keeps a file in its home, one run at a time
    run = subprocess.run(
        [rs274, "-g", "-t", tools, program], capture_output=True, text=True, timeout=600, check=True, env=home
    )
    words = {"STRAIGHT_TRAVERSE": "rapid", "STRAIGHT_FEED": "feed", "DWELL": "dwell"}
    theirs = []
    for word, numbers in re.findall(r"(STRAIGHT_TRAVERSE|STRAIGHT_FEED|DWELL)\((.*)\)", run.stdout):
        theirs.append((words[word], *map(float, numbers.split(",")[:3])))
    ours = []
    for motion in expand_cycles(in_our_words()):
        place = (motion.value,) if motion.kind is Kind.DWELL else motion.end
        ours.append((motion.kind.name.lower(), *(round(v, 4) for v in place)))
    theirs, ours = without_still(theirs), without_still(ours)
    assert theirs[1:] == ours
    assert len(ours) > 40


def test_cycles_that_the_controller_has_are_kept_and_the_others_written_out() -> None:
    """G81, then G83 in two pecks, then G81: only the middle hole becomes moves, and heights stay what they were."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 10.0)
    for x, cycle in ((1.0, DrillCycle("G81", 2.0, -3.0)), (2.0, DrillCycle("G83", 2.0, -3.0, peck=2.5))):
        builder.drill(x, 0.0, cycle, feed=1.0)
    builder.drill(3.0, 0.0, DrillCycle("G81", 2.0, -3.0), feed=1.0)
    path = builder.build()
    mixed = expand_cycles(path, keep=("G81", "G82"))
    drills = [m for m in mixed if m.kind is Kind.DRILL]
    assert [(m.end, mixed.cycles[m.ref].name) for m in drills] == [((1, 0, 2), "G81"), ((3, 0, 2), "G81")]
    assert [m.end for m in mixed if m.kind is Kind.FEED] == [(2, 0, -0.5), (2, 0, -3)]
    assert [tuple(m) for m in expand_cycles(mixed)] == [tuple(m) for m in expand_cycles(path)]
    assert expand_cycles(path, keep=("G81", "G83")) is path
