"""Matching the lines of two programs, and their differences."""

from __future__ import annotations

import json
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as some

from leafcut.model.difference import Difference
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.studio.drawing.differences import Change, differences_scene, kind_of_change
from leafcut.studio.drawing.line_match import matching_lines

CYCLE = DrillCycle("G81", r_plane=2.0, bottom=-6.0)
HEAD = ["%", "G21 G90", "T1 M6", "G0 Z20"]


def drilled(order: list[int]) -> tuple[Toolpath, str]:
    """Return a program that drills holes 10 mm apart in an order; the first states the cycle, the others only
    positions.
    """
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 20.0, line=4)
    lines = list(HEAD)
    for number, hole in enumerate(order):
        lines.append(("G81 Z-6 R2 F300 " if not number else "") + f"X{10 * hole}")
        path.drill(10.0 * hole, 0.0, CYCLE, feed=5.0, line=len(lines))
    return path.build(), "\n".join([*lines, "G80", "M30", "%", ""])


@given(some.permutations(range(9)))
def test_every_hole_is_paired_with_itself_whatever_is_written_on_its_line(order: list[int]) -> None:
    """The first hole of a cycle has words that the others have not: it is the same hole all the same."""
    one, other = list(range(9)), order
    pairs = matching_lines(*(drilled(one)[0], drilled(other)[0]), drilled(one)[1], drilled(other)[1])
    new_of = dict(pairs.tolist())
    for hole in range(9):
        assert new_of[len(HEAD) + 1 + one.index(hole)] == len(HEAD) + 1 + other.index(hole)
    assert len(set(new_of.values())) == len(new_of)  # no line is two lines of the other program
    assert [new_of[line] for line in (1, 2, 3, 4, 14, 15, 16)] == [1, 2, 3, 4, 14, 15, 16]


def test_a_cut_that_is_turned_round_and_a_comment_that_went_with_it_are_found_again() -> None:
    def cut(*rows: tuple[float, float, int]) -> Toolpath:
        path = ToolpathBuilder()
        for begin, end, line in rows:
            path.rapid(begin, 0.0, -1.0, line=line - 1)
            path.feed(end, 0.0, feed=5.0, line=line)
        return path.build()

    old = "(SLOT A)\nG0 X0\nG1 X10\n(SLOT B)\nG0 X50\nG1 X70\n"
    new = "(SLOT B)\nG0 X50\nG1 X70\n(SLOT A)\nG0 X10\nG1 X0\n"
    pairs = dict(matching_lines(cut((0, 10, 3), (50, 70, 6)), cut((50, 70, 3), (10, 0, 6)), old, new).tolist())
    assert pairs[3] == 6
    assert (pairs[4], pairs[5], pairs[6]) == (1, 2, 3)
    assert 2 not in pairs  # the move to the slot differs


def scene(data: bytes) -> tuple[dict[str, object], dict[str, np.ndarray]]:
    """Return header and blocks with their places in mm."""
    size = int.from_bytes(data[8:12], "little")
    header = json.loads(data[16 : 16 + size])
    blocks = {}
    for name, (_, offset, count, width) in header["blocks"].items():
        rows = np.frombuffer(data, dtype="<f4", count=count, offset=16 + size + offset).reshape(-1, width).astype(float)
        rows[:, :2] += header["origin"]
        blocks[name] = rows
    return header, blocks


def test_a_missing_hole_and_an_added_arc_are_marked_where_they_are() -> None:
    old = ToolpathBuilder()
    old.drill(30.0, 40.0, CYCLE, feed=5.0, line=5)
    new = ToolpathBuilder()
    new.rapid(80.0, 0.0, -1.0, line=6)
    new.arc(False, (60.0, 20.0, -1.0), Arc((60.0, 0.0, 0.0)), feed=10.0, line=7)
    found = [Difference("missing hole", 5, 0, "a hole is gone"), Difference("extra cut", 0, 7, "an arc is new")]
    header, blocks = scene(differences_scene(found, old.build(), new.build()))
    assert [row[0] for row in header["differences"]] == ["missing hole", "extra cut"]  # type: ignore[index]
    assert blocks["mark"][:, :2].tolist() == [[30.0, 40.0], [60.0, 20.0]]
    assert blocks["mark"][:, 3].tolist() == [Change.MISSING, Change.ADDED]
    arc = blocks["added"][np.isfinite(blocks["added"]).all(axis=1)]
    assert len(arc) > 8
    assert np.allclose(np.hypot(arc[:, 0] - 60.0, arc[:, 1]), 20.0, atol=1e-3)
    assert not np.isfinite(blocks["missing"]).any()  # a hole has no way in x and y


def test_what_has_lines_in_both_programs_has_changed_and_is_marked_in_both() -> None:
    paths = []
    for x in (10.0, 12.0):
        path = ToolpathBuilder()
        path.drill(x, 0.0, CYCLE, feed=5.0, line=3)
        paths.append(path.build())
    one = Difference("moved hole", 3, 3, "2 mm to the right")
    _, blocks = scene(differences_scene([one], *paths))
    assert kind_of_change(one) is Change.CHANGED
    assert sorted(blocks["mark"][:, 0].tolist()) == [10.0, 12.0]


def test_a_difference_without_a_line_has_no_place() -> None:
    nothing = ToolpathBuilder().build()
    header, blocks = scene(differences_scene([Difference("order", 0, 0, "too many cuts")], nothing, nothing))
    assert not len(blocks["mark"])
    assert header["extents"] is None
    assert math.isfinite(sum(header["origin"]))  # type: ignore[arg-type]
