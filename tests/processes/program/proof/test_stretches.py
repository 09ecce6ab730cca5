"""New speeds of a program by row of the original: divided cuts, and every row that is not the same."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from leafcut.errors import VerifyError
from leafcut.model.pace import PaceStretch
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.processes.program.proof.new_speeds import changed_stretches, check_lowered

Rows = Callable[[ToolpathBuilder], object]
RAPID = math.inf


def path_of(*rows: Rows) -> Toolpath:
    """A rapid to (0, 0, 0), then the rows; each with its own line from 2."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0, line=1)
    for row in rows:
        row(builder)
    return builder.build()


def feed(x: float, speed: float = 10.0, y: float = 0.0, line: int = 2) -> Rows:
    return lambda b: b.feed(x, y, feed=speed, line=line)


def rapid(x: float, y: float = 0.0) -> Rows:
    return lambda b: b.rapid(x, y, line=2)


def arc(x: float = 20.0, centre: float = 10.0, turns: int = 1, speed: float = 10.0, plane: int = 17) -> Rows:
    return lambda b: b.arc(True, (x, 0.0, 0.0), Arc((centre, 0.0, 0.0), plane, turns), feed=speed, line=2)


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        (feed(10.0), [feed(10.0)], ()),
        (feed(10.0), [feed(10.0, 10.000009)], ()),
        (feed(10.0), [feed(10.0, 10.0001)], (PaceStretch(1.0, 10.0001),)),
        (feed(10.0), [rapid(10.0)], (PaceStretch(1.0, RAPID),)),
        (feed(10.0), [feed(2.5, 5.0), rapid(7.5), feed(10.0)],
         (PaceStretch(0.25, 5.0), PaceStretch(0.75, RAPID), PaceStretch(1.0, 10.0))),
        (feed(10.0), [feed(5.0, y=1.9e-4), feed(10.0)], (PaceStretch(0.5, 10.0), PaceStretch(1.0, 10.0))),
        (arc(), [arc()], ()),
        (arc(), [arc(speed=12.0)], (PaceStretch(1.0, 12.0),)),
        (arc(), [rapid(20.0)], (PaceStretch(1.0, RAPID),)),
        (arc(), [arc(centre=10.0 + 9e-7)], ()),
        (rapid(10.0), [rapid(10.0 + 9e-7)], ()),
        (lambda b: b.dwell(1.0), [lambda b: b.dwell(1.0)], ()),
        (lambda b: b.set_place(Kind.SHIFT, (1.0, 2.0, 3.0), 4),
         [lambda b: b.set_place(Kind.SHIFT, (1.0, 2.0, 3.0), 5)], ()),
        (lambda b: b.tool(2), [lambda b: b.tool(2)], ()),
        (lambda b: b.drill(1.0, 2.0, DrillCycle("G81", 1.0, -5.0), feed=1.0),
         [lambda b: b.drill(1.0, 2.0, DrillCycle("G81", 1.0, -5.0), feed=1.0)], ()),
    ],
)  # fmt: skip
def test_the_stretches_of_a_row_have_their_shares_and_speeds(
    before: Rows, after: list[Rows], found: tuple[PaceStretch, ...]
) -> None:
    """The row has number 1, after the rapid."""
    stretches = changed_stretches(path_of(before, feed(50.0, 7.0)), path_of(*after, feed(50.0, 7.0)))
    assert set(stretches) == ({1} if found else set())
    assert [value for part in stretches.get(1, ()) for value in part] == pytest.approx(
        [value for part in found for value in part]
    )


DIFFERS = "line 2: the program with new speeds differs from line 2 of the original in more than its speed"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (feed(10.0), [feed(5.0, y=2.1e-4), feed(10.0)]),
        (feed(10.0), [feed(5.0), feed(4.0), feed(10.0)]),
        (feed(10.0), [feed(-1.0), feed(10.0)]),
        (feed(10.0), [feed(11.0), feed(10.0)]),
        (feed(10.0), [arc(x=10.0, centre=5.0)]),
        (arc(), [arc(centre=10.0 + 1e-5)]),
        (arc(), [arc(turns=2)]),
        (arc(), [arc(plane=18)]),
        (arc(), [rapid(20.0, 1e-5)]),
        (arc(), [feed(20.0)]),
        (arc(), [arc(x=20.0 + 1e-5)]),
        (rapid(10.0), [rapid(10.0 + 1e-5)]),
        (rapid(10.0), [feed(10.0)]),
        (lambda b: b.dwell(1.0, 2), [lambda b: b.dwell(1.01, 2)]),
        (lambda b: b.spindle(100.0, 2), [lambda b: b.spindle(101.0, 2)]),
        (lambda b: b.tool(2, 2), [lambda b: b.tool(3, 2)]),
        (lambda b: b.coolant(2, 2), [lambda b: b.coolant(1, 2)]),
        (
            lambda b: b.drill(1.0, 2.0, DrillCycle("G81", 1.0, -5.0), feed=1.0, line=2),
            [lambda b: b.drill(1.0, 2.0, DrillCycle("G81", 1.0, -5.1), feed=1.0, line=2)],
        ),
        (
            lambda b: b.drill(1.0, 2.0, DrillCycle("G81", 1.0, -5.0), feed=1.0, line=2),
            [lambda b: b.drill(1.0, 2.0, DrillCycle("G81", 1.0, -5.0), feed=2.0, line=2)],
        ),
    ],
)  # fmt: skip
def test_a_row_that_does_something_else_is_refused_with_both_lines(before: Rows, after: list[Rows]) -> None:
    with pytest.raises(VerifyError) as refused:
        changed_stretches(path_of(before, feed(50.0, line=2)), path_of(*after, feed(50.0, line=2)))
    assert str(refused.value) == DIFFERS


def test_a_longer_and_a_shorter_program_are_refused() -> None:
    one, two = path_of(rapid(1.0)), path_of(rapid(1.0), rapid(2.0))
    with pytest.raises(VerifyError) as refused:
        changed_stretches(one, two)
    assert str(refused.value) == "line 2: the program with new speeds continues after the end of the original"
    for shorter, longer in ((one, two), (path_of(), path_of(feed(3.0)))):
        with pytest.raises(VerifyError) as refused:
            changed_stretches(longer, shorter)
        assert (
            str(refused.value)
            == "the end: the program with new speeds differs from line 2 of the original in more than its speed"
        )


def test_lower_heights_with_different_work_are_refused() -> None:
    with pytest.raises(VerifyError) as refused:
        check_lowered(path_of(feed(3.0)), path_of(feed(4.0)), None, None)  # type: ignore[arg-type]
    assert str(refused.value) == "the program with lower heights differs from the original in more than its heights"
